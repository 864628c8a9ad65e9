"""What compiling costs: processor time of the first run of a scene beyond that of the next one.

python -m benchmarks compile-times [--short] [--only NAME ...] [--designs N] [--runs N] [--keep]

Prints the machine and three kinds of rows: `engine-dyn run thesis` with an empty cache of Numba;
every kind of study of `benchmarks.studies`, one process after the other, with what `run thesis` and
the studies above it have left in that cache; all studies in one process, again with an empty cache.
With `--keep` the numbers are kept beside docs/benchmarks.md, and its section on compiling is
written from them, as `python -m benchmarks` does too.

Times are user and system time of all threads of a process. Others that wait for the same processor
do not count, but who shares a core with it slows it down.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numba

from benchmarks import measure
from benchmarks.reliability_parts import write_part
from benchmarks.studies import STUDIES, Study, study
from benchmarks.wording import rows
from engine_dyn.compilation import source_hash

__all__ = ["Compiled", "compiling_section", "kept_section", "measured", "with_section"]

KEPT = "benchmarks_compiling.json"
"""What was measured last, beside docs/benchmarks.md."""

HEADING, NEXT_HEADING = "## Compiling", "## Traces"
"""Of the section, and of the one that it stands before."""

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


@dataclass(frozen=True)
class Compiled:
    """One row.

    Attributes
    ----------
    words : str
        What ran.
    cold, warm : float
        Seconds of processor time of the first run and of the next one.
    """

    words: str
    cold: float
    warm: float

    @property
    def compiling(self) -> float:
        """Seconds that the first run took longer."""
        return max(0.0, self.cold - self.warm)


def processor_time(command: Command, environment: Mapping[str, str]) -> float:
    """Seconds of user and system time of a command, which must succeed."""
    import resource  # only Unix has it, and the other benchmarks do without

    def spent() -> float:
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    before = spent()
    done = subprocess.run(
        command, cwd=measure.ROOT, env={**os.environ, **environment}, capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"{command[0]} failed:\n{done.stderr}")
    return round(spent() - before, 3)


def measured(
    chosen: Sequence[Study], designs: int = DESIGNS, short: bool = False, runs: int = 1,
    log: Callable[[str], None] = print, run: Run = processor_time,
) -> list[Compiled]:  # fmt: skip
    """Rows of the table, in its order.

    Parameters
    ----------
    chosen : sequence of Study
        Which.
    designs : int
        Number of designs of each.
    short : bool
        Leave out the rows of single studies.
    runs : int
        How often everything is measured, each time with new caches; the least times count.
    log : callable
        Told what goes on.
    run : callable
        Runs a command with variables added to its environment, and returns its seconds.
    """
    found = []
    for _ in range(runs):
        with tempfile.TemporaryDirectory(prefix="compile_times") as folder:
            found.append(_once(Path(folder), chosen, designs, short, log, run))
    return [
        Compiled(same[0].words, min(row.cold for row in same), min(row.warm for row in same))
        for same in zip(*found, strict=True)
    ]


def _once(
    folder: Path, chosen: Sequence[Study], designs: int, short: bool, log: Callable[[str], None],
    run: Run,
) -> list[Compiled]:  # fmt: skip
    """All rows, with caches in an empty folder."""
    program = Path(sys.executable).with_name("engine-dyn")

    def row(words: str, cache: str, *command: str | Path) -> Compiled:
        # Studies leave files where temporary files are.
        environment = {"NUMBA_CACHE_DIR": str(folder / cache), "TMPDIR": str(folder)}
        cold, warm = (run(command, environment) for _ in range(2))
        log(f"{words}: {cold:.1f} s, then {warm:.1f} s")
        return Compiled(words, cold, warm)

    def of_studies(words: str, cache: str, some: Sequence[Study]) -> Compiled:
        names = [one.name for one in some]
        return row(words, cache, sys.executable, "-c", RUN_STUDIES, str(designs), *names)

    # Bytecode, and what is read from the disk for the first time, must not count.
    run((program, "--version"), {"NUMBA_CACHE_DIR": str(folder / "version")})
    thesis = (program, "run", "thesis", "-o", folder / "thesis.nc", "--overwrite")
    return [
        row("`engine-dyn run thesis`", "apart", *thesis),
        *(of_studies(one.words, "apart", [one]) for one in chosen if not short),
        of_studies(f"{len(chosen)} studies in one process", "together", chosen),
    ]


# The table and the page ---------------------------------------------------------------------------


def figures(found: Sequence[Compiled], designs: int) -> dict[str, Any]:
    """What was measured, and on what."""
    return {
        "processor": measure.processor(),
        "cores": os.cpu_count(),
        "lanes": measure.lanes(),
        "numba": numba.__version__,
        "code": source_hash()[:8],
        "designs": designs,
        "rows": [asdict(row) for row in found],
    }


def machine_of(part: Mapping[str, Any]) -> str:
    """Words for what figures were measured on."""
    return (
        f"{part['processor']}, {part['cores']} cores, {part['lanes']}; numba {part['numba']}; "
        f"source hash `{part['code']}`"
    )


def table(part: Mapping[str, Any]) -> list[str]:
    """Rows of figures, in Markdown."""
    found = [Compiled(**row) for row in part["rows"]]
    body = [[row.words, *map(_span, (row.compiling, row.cold, row.warm))] for row in found]
    return rows(["what ran", "compiling", "first run", "next run"], body)


def _span(seconds: float) -> str:
    """Seconds; less than a tenth is not told apart from nothing."""
    return "-" if seconds < 0.1 else f"{seconds:.1f} s"


def compiling_section(part: Mapping[str, Any]) -> list[str]:
    """Section of docs/benchmarks.md."""
    return [
        HEADING, "",
        "Processor time (user and system time, all threads of the process) that a first run "
        "takes beyond the next one, which finds its kernels in the cache. "
        "`engine-dyn run thesis` began with an empty cache. The studies "
        f"({part['designs']:,} designs each) followed it, each in a process of its own, with what "
        "the rows above had left in the cache: a dash means that nothing was left to compile. "
        "The last row began with an empty cache again. Measured by `make compile-times` on "
        f"{part['date']}: {machine_of(part)}.", "",
        *table(part), "",
    ]  # fmt: skip


def kept_section(folder: Path) -> list[str]:
    """The section from what was kept last beside a page; nothing where that was not done."""
    path = folder / KEPT
    return compiling_section(json.loads(path.read_text("utf-8"))) if path.is_file() else []


def with_section(page: str, section: Sequence[str]) -> str:
    """The page with another section on compiling, or with its first one."""
    before, heading, after = page.partition(f"\n{NEXT_HEADING}\n")
    if not heading:
        raise ValueError(f"the page has no heading {NEXT_HEADING!r}")
    before = before.partition(f"\n{HEADING}\n")[0]
    return "\n".join([before, *section]) + heading + after


def keep(part: dict[str, Any], folder: Path) -> None:
    """Keep figures beside the page in a folder, and write its section."""
    write_part(folder / KEPT, part)
    page = folder / "benchmarks.md"
    page.write_text(with_section(page.read_text("utf-8"), kept_section(folder)), encoding="utf-8")


def main(arguments: Sequence[str]) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks compile-times", description=__doc__)
    parser.add_argument("--short", action="store_true", help="without a row for every study")
    parser.add_argument("--only", nargs="+", type=study, metavar="NAME", help="some studies")
    parser.add_argument("--designs", type=int, default=DESIGNS, help="of each study (2000)")
    parser.add_argument("--runs", type=int, default=1, help="the least of so many counts (1)")
    parser.add_argument("--keep", action="store_true", help="for docs/benchmarks.md")
    options = parser.parse_args(arguments)
    if options.keep and (options.short or options.only):
        parser.error("--keep needs a row for every study")

    def log(words: str) -> None:
        print(words, file=sys.stderr, flush=True)

    found = measured(options.only or STUDIES, options.designs, options.short, options.runs, log)
    part = figures(found, options.designs)
    print("\n".join([machine_of(part), "", *table(part)]))
    if options.keep:
        keep(part, measure.ROOT / "docs")
