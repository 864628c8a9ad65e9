"""What compiling costs: processor time of the first run of a scene beyond that of the next one.

Without the rows of single studies where it is `--short`; `--keep` keeps them all in
docs/benchmarks/compiling.csv. docs/benchmarks.md says what the rows are.

Times are user and system time of all threads of a process. Others that wait for the same processor
do not count, but who shares a core with it slows it down.
"""

from __future__ import annotations

import datetime
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numba

from benchmarks import measure, page
from benchmarks.command import CPUS, PROGRAM, ROOT, log, settings
from benchmarks.studies import STUDIES
from benchmarks.tables import rows
from engine_dyn.compilation import source_hash

DESIGNS = 2000
"""Of a study: so few that computing takes little of its time."""

RUN_STUDIES = """
import sys
import sweeps
from benchmarks.studies import study
for name in sys.argv[2:]:
    sweeps.run(study(name).build(int(sys.argv[1])))
"""

HEAD = ["what ran", "compiling", "first run", "next run"]


def processor_time(command: Sequence[str | Path], environment: Mapping[str, str]) -> float:
    """Seconds of user and system time of a command, which must succeed."""
    import resource  # only Unix has it, and the other benchmarks do without

    def spent() -> float:
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    before = spent()
    subprocess.run(command, cwd=ROOT, env={**os.environ, **environment}, capture_output=True,
                   check=True)  # fmt: skip
    return spent() - before


def measured(short: bool) -> list[list[str]]:
    """Rows of the table; less than a tenth of a second is not told apart from nothing."""
    body: list[list[str]] = []
    with tempfile.TemporaryDirectory(prefix="compile_times") as name:
        folder = Path(name)

        def add(words: str, cache: str, *command: str | Path) -> None:
            # Studies leave files where temporary files are.
            environment = {"NUMBA_CACHE_DIR": str(folder / cache), "TMPDIR": name}
            cold, warm = (processor_time(command, environment) for _ in range(2))
            log(f"{words}: {cold:.1f} s, then {warm:.1f} s")
            times = (cold - warm, cold, warm)
            body.append([words, *("-" if s < 0.1 else f"{s:.1f} s" for s in times)])

        # Bytecode, and what is read from the disk for the first time, must not count.
        processor_time((PROGRAM, "--version"), {"NUMBA_CACHE_DIR": str(folder / "version")})
        of_studies = (sys.executable, "-c", RUN_STUDIES, str(DESIGNS))
        thesis = (PROGRAM, "run", "thesis", "-o", folder / "thesis.nc", "--overwrite")
        add("`engine-dyn run thesis`", "apart", *thesis)
        for one in () if short else STUDIES:
            add(one.words, "apart", *of_studies, one.name)
        names = [one.name for one in STUDIES]
        add(f"{len(STUDIES)} studies in one process", "together", *of_studies, *names)
    return body


def main(arguments: Sequence[str]) -> None:
    """Measure and print."""
    given = settings("compile-times", __doc__, arguments, short=False, keep=False)
    if given.keep and given.short:
        sys.exit("--keep needs a row for every study")
    machine = measure.machine(CPUS).replace("threads", "cores")
    machine += f"; numba {numba.__version__}; source hash {source_hash()[:8]}"
    body = measured(given.short)
    print("\n".join([machine, "", *rows(HEAD, body)]))
    if given.keep:
        folder, day = ROOT / "docs", datetime.datetime.now(datetime.UTC).date().isoformat()
        page.save(folder, "compiling", HEAD, body)
        facts = {"compiled": f"{day}: {machine}", "compiled_designs": f"{DESIGNS:,}"}
        page.save_facts(folder, facts)
        page.write(folder)
