"""Stress the solver and write docs/stability/*.csv, of which docs/trust.md is made.

python -m benchmarks.stress [--designs N] [--sample N] [--calibrate N] [--diagrams N]
                            [--flywheels N] [--driven N] [--sampled N] [--checked N] [--seed N]
                            [--processes N] [--limit SECONDS] [-o FOLDER]

Diagrams are so many of each kind, flywheels rounds of light ones, checked designs those of each
sampled study that an independent solver gets; the limit is that of a chunk. Ends with status 1 if
anything is not as it should be; out/stress.json then has the designs.
"""

from __future__ import annotations

import datetime
import json
import platform
import sys
import time

from benchmarks.command import CPUS, ROOT, log, processor, settings, versions
from benchmarks.stress import (
    calibration,
    chunks,
    draw,
    driven,
    report,
    sample,
    sampled,
    spikes,
    strong,
    weak,
)


def main() -> int:
    """Run everything and write the files."""
    chosen = settings(
        "benchmarks.stress", __doc__, designs=10_000_000, sample=4000, calibrate=4000,
        diagrams=100, flywheels=8, driven=3000, sampled=sampled.DESIGNS, checked=24, seed=20261121,
        processes=CPUS, limit=chunks.LIMIT, output=ROOT / "docs",
    )  # fmt: skip
    began, seed, processes = time.perf_counter(), chosen.seed, chosen.processes
    outcome = chunks.run(seed, chosen.designs, chosen.sample, log, chosen.limit)
    means, cure = weak.drift()
    measured = report.Measured(
        run=f"{datetime.date.today().isoformat()}; {processor()}, {CPUS} processors, "
        f"{platform.system()}; {versions('numpy', 'numba', 'engine-dyn')}; seed {seed}",
        outcome=outcome,
        agreement=sample.run(seed, outcome.picked, draw.size_of(chosen.designs), processes, log),
        spiky=spikes.run(seed, chosen.diagrams, log),
        light=strong.run(seed, chosen.flywheels, log),
        machines=driven.run(seed, chosen.driven, processes, log),
        studies=sampled.run(seed, chosen.sampled, chosen.checked, processes, log),
        reading=calibration.run(seed, chosen.calibrate, processes, log),
        own_error=calibration.own_error(seed),
        weak=weak.study(),
        drift=means,
        cure=cure,
        took=time.perf_counter() - began,
    )
    report.write(measured, chosen.output)
    examples = ROOT / "out" / "stress.json"
    examples.parent.mkdir(exist_ok=True)
    examples.write_text(json.dumps(measured.examples, indent=1), "utf-8")
    log(f"written: out/stress.json; {measured.defects} defects")
    return 1 if measured.defects else 0


if __name__ == "__main__":
    sys.exit(main())
