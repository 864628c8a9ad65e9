"""Throughput of engines that are not even, equal and centred, beside one that is.

python -m benchmarks.engines [--designs N] [-o FILE]

Writes docs/engines.md. Times are processor times of one thread, the least of some runs, so that a
busy machine counts little; ratios are to the even engine of as many cylinders.
"""

from __future__ import annotations

import argparse
import math
import platform
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.problem import family, own_inputs, scene
from engine_dyn.cylinders import Cylinders, cylinders_of, even_cylinders
from engine_dyn.layouts import arrangement_from_text
from engine_dyn.speed import sweep

PERIOD = 4.0 * math.pi
RUNS = 5
FAMILY = family()
FRICTION = {
    "boundary_friction": 3e3, "mixed_friction": 2e3, "hydrodynamic_friction": 5e3,
    "skirt_friction": 2e3, "ring_pressure": 1.5e5,
}  # fmt: skip


@dataclass(frozen=True)
class Kind:
    """An engine: what it is, its cylinders and what else its tables depend on."""

    text: str
    cylinders: Cylinders
    more: dict[str, Any] = field(default_factory=dict)


def of(text: str, **factors: Any) -> Cylinders:
    """Cylinders of an arrangement."""
    return cylinders_of(arrangement_from_text(text, PERIOD)).with_factors(**factors)


def kinds() -> list[list[Kind]]:
    """Engines by number of cylinders, the even one first."""
    return [
        [
            Kind("in-line 2, even", even_cylinders(2, PERIOD)),
            Kind("parallel twin 270, uneven", of("parallel twin 270")),
            Kind("in-line 2, offset 0.2 r", even_cylinders(2, PERIOD), {"offset_ratio": 0.2}),
            Kind("in-line 2, friction over the stroke", even_cylinders(2, PERIOD), FRICTION),
        ],
        [
            Kind("in-line 4, even", even_cylinders(4, PERIOD)),
            Kind("in-line 4, mass spread", of("in-line 4", mass_factor=(1, 1.02, 0.99, 1))),
            Kind("in-line 4, unequal throws", of("in-line 4", radius_factor=(1, 0.9, 0.9, 1))),
            Kind("in-line 4, offset 0.2 r", even_cylinders(4, PERIOD), {"offset_ratio": 0.2}),
            Kind("in-line 4, friction over the stroke", even_cylinders(4, PERIOD), FRICTION),
        ],
        [
            Kind("V8 cross-plane, even", of("V8 cross-plane")),
            Kind(
                "V8 cross-plane, mass spread",
                of("V8 cross-plane", mass_factor=(1.02, *(1.0,) * 7)),
            ),
        ],
    ]  # fmt: skip


def seconds(kind: Kind, size: int, exponent: float, apart: bool) -> float:
    """Processor time of `size` designs of one engine; `apart`: each with a table of its own."""
    count = kind.cylinders.count
    given = own_inputs(scene(size, exponent, count), FAMILY)
    if apart:
        # As many tables as designs: crank ratios along an axis of their own.
        given |= {"crank_ratio": np.linspace(0.2, 0.33, size), "mass": 6.0, "speed": 150.0}
        given |= {"inertia": np.geomspace(1.5, 8.0, size), "mean_torque": 200.0}
        if "offset_ratio" in kind.more:
            given["offset_ratio"] = np.full(size, 0.2)
    given = {**kind.more, **given} if apart else {**given, **kind.more}
    best = math.inf
    for _ in range(RUNS + 1):  # the first may compile
        began = time.process_time()
        sweep.solve(
            wanted=("delta", "omega_max", "omega_min", "omega_mean"), threads=1,
            cylinders_by_count={count: kind.cylinders}, **given,
        )  # fmt: skip
        best = min(best, time.process_time() - began)
    return best


def report(size: int) -> str:
    """Text of docs/engines.md."""
    lines = [
        "# Throughput of uneven, offset and unequal engines",
        "",
        "Made by `python -m benchmarks.engines`; a run of some minutes, on one thread of a shared "
        f"machine ({platform.machine()}, Python {platform.python_version()}). Processor time a "
        "design in microseconds; the ratio is to the even, equal, centred engine of as many "
        "cylinders, whose speed beside other solvers is in [benchmarks.md](benchmarks.md). Where "
        "others use the machine, runs differ by a third and more, and ratios below 1 are no gain.",
        "",
        f"Designs that share a table: {size:,} of inertia x speed x mass; designs with tables of "
        f"their own: {size // 50:,} crank ratios.",
        "",
        "| engine | part of the cycle | sharing, alpha 2 | ratio | sharing, alpha 1.6 | ratio "
        "| own tables, alpha 2 | ratio |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    cases = ((size, 2.0, False), (size, 1.6, False), (size // 50, 2.0, True))
    for group in kinds():
        base: list[float] = []
        for kind in group:
            each = [1e6 * seconds(kind, *case) / case[0] for case in cases]
            base = base or each
            cells = [f"{us:.3g} | {us / even:.2f}" for us, even in zip(each, base, strict=True)]
            solved = kind.cylinders.solved.split(",")[0]
            lines.append(f"| {kind.text} | {solved} | {' | '.join(cells)} |")
    lines += [
        "",
        "What the ratios are made of:",
        "",
        "- Where designs share a table, a design costs what its period has of nodes: cylinders "
        "of unequal mass repeat once a cycle instead of Z times, with as many nodes a cycle. An "
        "offset and friction over the stroke cost nothing beyond making their table.",
        "- Tables of even, equal, centred engines, each for few designs, are interpolated in "
        "the crank ratio between shared ones. With an offset (over the crank radius), friction "
        "over the stroke (whose level follows p_max and piston speed) or throws of unequal "
        "radius (whose crank ratios leave the panels) each design has its own: 720 nodes and "
        "4320 points of quadrature for each representative cylinder, some two nanoseconds a "
        "point and some twenty a node; friction takes its means first and so twice as long. "
        "Interpolating in a second variable would take ten times the shared tables; it is not "
        "done.",
        "- Parameters of single cylinders (`mass_factor_3`) make each design an engine of its "
        "own, with diagrams sampled anew: some milliseconds, ten times that of a table.",
        "",
    ]
    return "\n".join(lines)


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--designs", type=int, default=100_000)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/engines.md"))
    given = parser.parse_args()
    given.output.write_text(report(given.designs), encoding="utf-8")
    print(f"written: {given.output}")


if __name__ == "__main__":
    main()
