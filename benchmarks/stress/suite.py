"""Stress the solver and write docs/stability/*.csv, of which docs/trust.md is made.

Diagrams are so many of each kind, flywheels rounds of light ones, checked designs those of each
sampled study that an independent solver gets; the limit is that of a chunk. Ends with status 1 if
anything is not as it should be; out/stress.json then has the designs. docs/measurements.md says
what the tables mean.
"""

from __future__ import annotations

import datetime
import json
import platform
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

from benchmarks.command import CPUS, ROOT, log, processor, settings, versions
from benchmarks.stress import absurd, calibration, driven, sampled, spikes, strong
from benchmarks.stress.findings import DEFECTS, Findings, rows
from benchmarks.tables import save

SHOWN = 4
"""Designs of a kind that are shown."""


def shown(found: dict[Any, Findings]) -> Iterator[list[str]]:
    """Designs that should not be, a few of each kind."""
    for part, of_part in found.items():
        kinds = Counter[str]()
        for example in of_part.examples:
            what = example["what"]
            kinds[what] += 1
            if what.partition(" ")[0] in DEFECTS and kinds[what] <= SHOWN:
                told = {key: value for key, value in example.items() if key != "what"}
                yield [part.PART, what, json.dumps(told)]


def main(arguments: Sequence[str]) -> int:
    """Run everything and write the files."""
    chosen = settings(
        "stress", __doc__, arguments, designs=10_000_000, sample=4000, calibrate=4000,
        diagrams=100, flywheels=8, driven=3000, sampled=sampled.DESIGNS, checked=24, seed=20261121,
        processes=CPUS, limit=absurd.LIMIT, output=ROOT / "docs",
    )  # fmt: skip
    began, seed, processes = time.perf_counter(), chosen.seed, chosen.processes
    found: dict[Any, Findings] = {
        absurd: absurd.run(seed, chosen.designs, chosen.sample, log, chosen.limit),
        spikes: spikes.run(seed, chosen.diagrams, log),
        strong: strong.run(seed, chosen.flywheels, log),
        driven: driven.run(seed, chosen.driven, processes, log),
        sampled: sampled.run(seed, chosen.sampled, chosen.checked, processes, log),
        calibration: calibration.run(seed, chosen.calibrate, processes, log),
    }
    run = (
        f"{datetime.date.today().isoformat()}; {processor()}, {CPUS} processors, "
        f"{platform.system()}; {versions('numpy', 'numba', 'engine-dyn')}; seed {seed}; "
        f"{(time.perf_counter() - began) / 60.0:.1f} minutes."
    )
    words = {"run": run}
    for part, of_part in found.items():
        words |= part.words(of_part)
    numbers = [row for part, of_part in found.items() for row in rows(part.PART, of_part)]
    head, *meter = calibration.table(found[calibration])
    for name, heads, body in (
        ("findings", ["part", "what", "of", "number"], numbers),
        ("error_estimate", head, meter),
        ("examples", ["part", "what", "design"], shown(found)),
        ("summary", ["what", "words"], words.items()),
    ):
        save(chosen.output / "stability" / f"{name}.csv", heads, body, marks=name == "summary")
    examples = ROOT / "out" / "stress.json"
    examples.parent.mkdir(exist_ok=True)
    told = [{"part": p.PART, **example} for p, each in found.items() for example in each.examples]
    examples.write_text(json.dumps(told, indent=1), "utf-8")
    defects = sum(each.defects for each in found.values())
    log(f"written: out/stress.json; {defects} defects")
    return 1 if defects else 0
