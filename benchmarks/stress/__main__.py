"""Stress the solver and write docs/stability/*.csv, of which docs/trust.md is made.

python -m benchmarks.stress [--designs N] [--sample N] [--calibrate N] [--diagrams N]
                            [--flywheels N] [--driven N] [--sampled N] [--checked N] [--seed N]
                            [--processes N] [-o FOLDER]
python -m benchmarks.stress --from REPORT [-o FOLDER]

The whole report is out/stability.md; with `--from` the files are written from an earlier one. Ends
with status 1 if anything is not as it should be; out/stress.json then has the designs.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import sys
import time
from importlib.metadata import version
from pathlib import Path

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
    tables,
    weak,
)

ROOT = Path(__file__).resolve().parents[2]


def log(words: str) -> None:
    """Say what goes on."""
    print(f"{time.strftime('%H:%M:%S')}  {words}", file=sys.stderr, flush=True)


def machine() -> str:
    """Processor, its number, and system."""
    name = platform.processor() or platform.machine()
    cpus = Path("/proc/cpuinfo")
    if cpus.is_file():
        for line in cpus.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                name = line.partition(":")[2].strip()
                break
    return f"{name}, {os.cpu_count()} processors, {platform.system()}"


def versions() -> str:
    """What numbers depend on."""
    names = ("numpy", "numba", "engine-dyn")
    return f"Python {platform.python_version()}, " + ", ".join(f"{n} {version(n)}" for n in names)


def main() -> int:
    """Run everything and write the document."""
    if sys.argv[1:2] == ["--worker"]:
        seed, begin, end, size, picks = (int(word) for word in sys.argv[2:])
        chunks.work(seed, range(begin, end), size, picks)
        return 0
    parser = argparse.ArgumentParser(prog="python -m benchmarks.stress", description=__doc__)
    parser.add_argument("--designs", type=int, default=10_000_000)
    parser.add_argument("--sample", type=int, default=4000)
    parser.add_argument("--calibrate", type=int, default=4000)
    parser.add_argument("--diagrams", type=int, default=100, help="of each kind")
    parser.add_argument("--flywheels", type=int, default=8, help="rounds of light flywheels")
    parser.add_argument("--driven", type=int, default=3000, help="designs with drivers and loads")
    parser.add_argument(
        "--sampled", type=int, default=sampled.DESIGNS, help="designs of sampled studies"
    )
    parser.add_argument(
        "--checked", type=int, default=24, help="of each of these, by an independent solver"
    )
    parser.add_argument("--seed", type=int, default=20261121)
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--limit", type=float, default=chunks.LIMIT, help="seconds for a chunk")
    parser.add_argument("-o", dest="folder", type=Path, default=ROOT / "docs")
    parser.add_argument(
        "--from", dest="report", type=Path, metavar="REPORT", help="only write the files, from it"
    )
    chosen = parser.parse_args()
    if chosen.report:
        tables.write(chosen.report.read_text(encoding="utf-8"), chosen.folder)
        return 0
    began = time.perf_counter()

    outcome = chunks.run(chosen.seed, chosen.designs, chosen.sample, log, chosen.limit)
    size = draw.size_of(chosen.designs)
    agreement = sample.run(chosen.seed, outcome.picked, size, chosen.processes, log)
    spiky = spikes.run(chosen.seed, chosen.diagrams, log)
    light = strong.run(chosen.seed, chosen.flywheels, log)
    machines = driven.run(chosen.seed, chosen.driven, chosen.processes, log)
    studies = sampled.run(chosen.seed, chosen.sampled, chosen.checked, chosen.processes, log)
    reading = calibration.run(chosen.seed, chosen.calibrate, chosen.processes, log)
    means, cure = weak.drift()
    measured = report.Measured(
        when=datetime.date.today().isoformat(),
        machine=machine(),
        versions=versions(),
        seed=chosen.seed,
        outcome=outcome,
        agreement=agreement,
        spiky=spiky,
        light=light,
        machines=machines,
        studies=studies,
        reading=reading,
        own_error=calibration.own_error(chosen.seed),
        weak=weak.study(),
        drift=means,
        cure=cure,
        took=time.perf_counter() - began,
    )
    text = report.document(measured)
    tables.write(text, chosen.folder)
    report.draw_all(measured, chosen.folder)
    examples = ROOT / "out" / "stress.json"
    examples.parent.mkdir(exist_ok=True)
    examples.with_name("stability.md").write_text(text, encoding="utf-8")
    examples.write_text(
        json.dumps(
            [
                *outcome.examples,
                *agreement.examples,
                *spiky.examples,
                *light.examples,
                *machines.examples,
                *(example for found in studies for example in found.examples),
                *reading.examples,
            ],
            indent=1,
        ),
        "utf-8",
    )
    log(f"written: out/stability.md, out/stress.json; {measured.defects} defects")
    return 1 if measured.defects else 0


if __name__ == "__main__":
    sys.exit(main())
