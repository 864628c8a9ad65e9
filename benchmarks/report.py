"""Measure everything and write docs/benchmarks.md; `--quick` sees that it works."""

from __future__ import annotations

import datetime
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib

from benchmarks import comparison, measure, page, study_times, throughput
from benchmarks.command import CPUS, ROOT, log, settings, versions
from benchmarks.studies import STUDIES
from benchmarks.tables import number, small
from sweeps.view.figures.sheet import STYLE


def write(run: measure.Run) -> None:
    """Measure everything; write the tables, the figures and the page."""
    began = time.perf_counter()
    facts = comparison.measured(run)
    style: Any = STYLE
    with matplotlib.rc_context(style):
        # 200 dpi: sharp in print at column width, small in the repository.
        figure = run.folder / "figures" / "bench_work_precision.png"
        figure.parent.mkdir(parents=True, exist_ok=True)
        comparison.work_precision(run.folder).savefig(figure, dpi=200, metadata={})
    studies = study_times.measured(
        STUDIES, run.threads, run.runs, 0.005 if run.quick else 1.0, 2 if run.quick else 24, log
    )
    run.save("studies", study_times.HEAD, study_times.body(studies))
    checked = [row.errors.designs for row in studies.rows]
    throughput.single(run)
    facts |= throughput.big_run(run)
    page.save_facts(run.folder, {
        "machine": measure.machine(run.threads),
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "versions": versions("engine-dyn", "numpy", "numba", "scipy", "xarray", "netCDF4"),
        "quick": "yes" if run.quick else "no",
        "threads": str(run.threads),
        "loop_steps": str(study_times.LOOP_STEPS),
        "loop_rate": number(studies.loop.rate),
        "loop_error": small(studies.loop_errors.worst),
        "checked": f"{min(checked, default=0)} to {max(checked, default=0)}",
        "minutes": f"{(time.perf_counter() - began) / 60.0:.0f}",
        **facts,
    })  # fmt: skip
    page.write(run.folder)


def main(arguments: Sequence[str]) -> None:
    """Measure and write."""
    given = settings("", __doc__, arguments, quick=False, threads=CPUS, seconds=float, output=Path)
    folder = given.output or (ROOT / "out" / "bench" if given.quick else ROOT / "docs")
    seconds = given.seconds or (0.05 if given.quick else 0.4)
    write(measure.Run(given.threads, given.quick, seconds, folder))
    print(folder / "benchmarks.md")
