"""What compiling costs: processor time of the first run of a scene beyond that of the next one.

python -m benchmarks compile-times [--short] [--only NAME ...] [--designs N] [--runs N] [--keep]

Prints the machine and three kinds of rows: `engine-dyn run thesis` with an empty cache of Numba;
every kind of study of `benchmarks.studies`, one process after the other, with what `run thesis` and
the studies above it have left in that cache; all studies in one process, again with an empty cache.
With `--keep` the rows are kept in docs/benchmarks/compiling.csv, which docs/benchmarks.md names.

Times are user and system time of all threads of a process. Others that wait for the same processor
do not count, but who shares a core with it slows it down.
"""

from __future__ import annotations

import datetime
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numba

from benchmarks import measure, page
from benchmarks.command import CPUS, PROGRAM, ROOT, log, settings
from benchmarks.studies import STUDIES, Study, study
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

Command = Sequence[str | Path]
Run = Callable[[Command, Mapping[str, str]], float]


class Compiled(NamedTuple):
    """What ran, and seconds of processor time of the first run and of the next one."""

    words: str
    cold: float
    warm: float


def processor_time(command: Command, environment: Mapping[str, str]) -> float:
    """Seconds of user and system time of a command, which must succeed."""
    import resource  # only Unix has it, and the other benchmarks do without

    def spent() -> float:
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    before = spent()
    done = subprocess.run(
        command, cwd=ROOT, env={**os.environ, **environment}, capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"{command[0]} failed:\n{done.stderr}")
    return round(spent() - before, 3)


def measured(
    chosen: Sequence[Study], designs: int = DESIGNS, short: bool = False,
    run: Run = processor_time,
) -> list[Compiled]:  # fmt: skip
    """Rows of the table, in its order; without those of single studies where it is `short`.

    `run` runs a command with variables added to its environment, and returns its seconds.
    """
    with tempfile.TemporaryDirectory(prefix="compile_times") as name:
        folder = Path(name)

        def row(words: str, cache: str, *command: str | Path) -> Compiled:
            # Studies leave files where temporary files are.
            environment = {"NUMBA_CACHE_DIR": str(folder / cache), "TMPDIR": name}
            cold, warm = (run(command, environment) for _ in range(2))
            log(f"{words}: {cold:.1f} s, then {warm:.1f} s")
            return Compiled(words, cold, warm)

        # Bytecode, and what is read from the disk for the first time, must not count.
        run((PROGRAM, "--version"), {"NUMBA_CACHE_DIR": str(folder / "version")})
        of_studies = (sys.executable, "-c", RUN_STUDIES, str(designs))
        thesis = (PROGRAM, "run", "thesis", "-o", folder / "thesis.nc", "--overwrite")
        found = [row("`engine-dyn run thesis`", "apart", *thesis)]
        found += [row(one.words, "apart", *of_studies, one.name) for one in chosen if not short]
        names = [one.name for one in chosen]
        words = f"{len(chosen)} studies in one process"
        return [*found, row(words, "together", *of_studies, *names)]


# The table and the page ---------------------------------------------------------------------------

HEAD = ["what ran", "compiling", "first run", "next run"]


def machine() -> str:
    """Words for what is measured on."""
    words = measure.machine(CPUS).replace("threads", "cores")
    return f"{words}; numba {numba.__version__}; source hash {source_hash()[:8]}"


def body(found: Sequence[Compiled]) -> list[list[str]]:
    """Rows of the table; less than a tenth of a second is not told apart from nothing."""
    times = [(row.words, row.cold - row.warm, row.cold, row.warm) for row in found]
    return [[words, *("-" if s < 0.1 else f"{s:.1f} s" for s in each)] for words, *each in times]


def save_rows(found: Sequence[Compiled], designs: int, folder: Path) -> None:
    """Keep the rows beside the page in a folder, and write that again."""
    day = datetime.datetime.now(datetime.UTC).date().isoformat()
    page.save(folder, "compiling", HEAD, body(found))
    page.save_facts(folder, {"compiled": f"{day}: {machine()}", "compiled_designs": f"{designs:,}"})
    page.write(folder)


def main(arguments: Sequence[str]) -> None:
    """Measure and print."""
    given = settings(
        "benchmarks compile-times", __doc__, arguments, short=False,
        only=[one.name for one in STUDIES], designs=DESIGNS, runs=1, keep=False,
    )  # fmt: skip
    if given.keep and (given.short or given.only):
        sys.exit("--keep needs a row for every study")
    chosen = [study(name) for name in given.only] if given.only else STUDIES
    # Other work only ever adds: the least times count.
    every = [measured(chosen, given.designs, given.short) for _ in range(given.runs)]
    found = [
        Compiled(same[0].words, min(row.cold for row in same), min(row.warm for row in same))
        for same in zip(*every, strict=True)
    ]
    print("\n".join([machine(), "", *rows(HEAD, body(found))]))
    if given.keep:
        save_rows(found, given.designs, ROOT / "docs")
