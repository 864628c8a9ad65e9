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

import argparse
import datetime
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numba

from benchmarks import measure, page
from benchmarks.studies import STUDIES, Study, study
from benchmarks.wording import rows
from engine_dyn.compilation import source_hash

__all__ = ["Compiled", "measured", "save_rows"]

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

HEAD = ["what ran", "compiling", "first run", "next run"]


def machine() -> str:
    """Words for what is measured on."""
    return (
        f"{measure.processor()}, {os.cpu_count()} cores, {measure.lanes()}; "
        f"numba {numba.__version__}; source hash {source_hash()[:8]}"
    )


def body(found: Sequence[Compiled]) -> list[list[str]]:
    """Rows of the table."""
    return [[row.words, *map(_span, (row.compiling, row.cold, row.warm))] for row in found]


def _span(seconds: float) -> str:
    """Seconds; less than a tenth is not told apart from nothing."""
    return "-" if seconds < 0.1 else f"{seconds:.1f} s"


def save_rows(found: Sequence[Compiled], designs: int, folder: Path) -> None:
    """Keep the rows beside the page in a folder, and write that again."""
    day = datetime.datetime.now(datetime.UTC).date().isoformat()
    page.save(folder, "compiling", HEAD, body(found))
    page.save_facts(folder, {"compiled": f"{day}: {machine()}", "compiled_designs": f"{designs:,}"})
    page.write(folder)


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
    print("\n".join([machine(), "", *rows(HEAD, body(found))]))
    if options.keep:
        save_rows(found, options.designs, measure.ROOT / "docs")
