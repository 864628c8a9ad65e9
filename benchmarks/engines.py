"""Throughput of engines: even ones of the catalogue beside plain in-line ones, then all others.

python -m benchmarks.engines [--designs N] [-o FILE]

Writes docs/throughput.md. Times are processor times of one thread, the least of some runs, so that
a busy machine counts little; ratios are to the even engine of as many cylinders. Engines of the
catalogue and the plain in-line engine that each is compared with take turns, run by run.
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
from engine_dyn.engine import Engine
from engine_dyn.geometry.arrangement import TWO_STROKE
from engine_dyn.geometry.cylinders import Cylinders, cylinders_of, even_cylinders
from engine_dyn.geometry.layouts import arrangement_from_text, in_line
from engine_dyn.pressure.family import Family
from engine_dyn.speed import dispatch
from engine_dyn.speed.mean_gas import mean_gas_torque
from sweeps.reading.engine_files import catalogue, load_engine

PERIOD = 4.0 * math.pi
RUNS = 15
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
    return least_seconds([{"cylinders_by_count": {count: kind.cylinders}, **given}])[0]


def least_seconds(calls: list[dict[str, Any]]) -> list[float]:
    """Least processor time of each of some calls of `sweep.solve`, which take turns."""
    best = [math.inf] * len(calls)
    for _ in range(RUNS + 1):  # the first may compile
        for place, given in enumerate(calls):
            began = time.process_time()
            dispatch.solve(
                wanted=("delta", "omega_max", "omega_min", "omega_mean"), threads=1, **given
            )
            best[place] = min(best[place], time.process_time() - began)
    return best


def even_engines() -> dict[str, Engine]:
    """Engines of the catalogue with several cylinders that fire evenly and drive a load."""
    found = {}
    for name in catalogue():
        engine = load_engine(name)
        own = own_cylinders(engine)
        if own.count > 1 and own.even and isinstance(engine.family, Family):
            found[name] = engine
    return found


def own_cylinders(engine: Engine) -> Cylinders:
    """Cylinders as the engine's file has them."""
    count = int(engine.values["cylinders"])
    return engine.own_cylinders or even_cylinders(count, engine.period, engine.firing_order)


def plain_cylinders(engine: Engine) -> Cylinders:
    """Cylinders of the in-line engine with as many, in its customary order."""
    return cylinders_of(in_line(int(engine.values["cylinders"]), period=engine.period))


def designs_of(engine: Engine, size: int, exponent: float, apart: bool) -> dict[str, Any]:
    """Inputs of `sweep.solve` without the cylinders: designs about the engine's own point."""
    values, count = engine.values, int(engine.values["cylinders"])
    family = engine.family
    assert isinstance(family, Family)
    base = scene(size, 2.0, count)
    bore, stroke, ratio = values["bore"], values["stroke"], values["crank_ratio"]
    lever = 0.25 * math.pi * bore**2 * 0.5 * stroke
    speed, inertia = values["speed"] * math.pi / 30.0, values["inertia"]
    # A piston with a third of its rod: what counts here is that masses differ.
    mass = values["piston_mass"] + values["rod_mass"] / 3.0
    # The last diagram of the family is that of full load.
    row = float(len(family.loads) - 1)
    inputs: dict[str, Any] = {
        "crank_ratio": ratio,
        "speed": np.linspace(0.6, 1.0, len(base.speed))[:, None, None] * speed,
        "mass": np.linspace(0.8, 1.2, len(base.mass))[:, None] * mass,
        "inertia": np.geomspace(0.8, 3.0, len(base.inertia)) * inertia,
    }
    if apart:
        inputs = {
            "crank_ratio": np.linspace(0.7, 1.0, size) * ratio, "speed": speed, "mass": mass,
            "inertia": np.geomspace(0.8, 3.0, size) * inertia,
        }  # fmt: skip
    gas = count * lever * mean_gas_torque(inputs["crank_ratio"], row, family)
    friction = 0.1 * float(np.mean(gas))
    return {
        "family": family, "row": row, "scale": 1.0, "crankcase_pressure": 1.01325e5, "bore": bore,
        "double_radius": stroke, "offset": 0.0, "exponent": exponent, "friction_torque": friction,
        "mean_torque": gas - friction, "cylinders": count, "inertia_model": "constant", **inputs,
    }  # fmt: skip


ALLOWED = 1.2
"""Time over that of the plain engine that even firing may take."""


def even_rows(cases: tuple[tuple[int, float, bool], ...]) -> list[str]:
    """Rows of the table of even engines, and what they say."""
    rows, over, ratios = [], [], []
    for name, engine in even_engines().items():
        count = int(engine.values["cylinders"])
        cells = []
        for size, exponent, apart in cases:
            given = designs_of(engine, size, exponent, apart)
            mine, plain = least_seconds(
                [
                    {"cylinders_by_count": {count: cylinders}, **given}
                    for cylinders in (own_cylinders(engine), plain_cylinders(engine))
                ]
            )
            ratios.append(mine / plain)
            cells.append(f"{1e6 * mine / size:.3g} | {1e6 * plain / size:.3g} | {ratios[-1]:.2f}")
            if ratios[-1] > ALLOWED:
                over.append(f"`{name}` ({ratios[-1]:.2f})")
        strokes = "two-stroke" if engine.period == TWO_STROKE else "four-stroke"
        rows.append(f"| `{name}` | in-line {count}, {strokes} | {' | '.join(cells)} |")
    held = (
        "holds within 20 % for all of them"
        if not over
        else f"does not hold within 20 % for {', '.join(over)}"
    )
    span = f"{min(ratios):.2f} to {max(ratios):.2f}"
    return [*rows, "", f"The throughput of even firing {held}; the ratios are {span}."]


def report(size: int) -> str:
    """Text of docs/throughput.md."""
    cases = ((size, 2.0, False), (size, 1.6, False), (size // 50, 2.0, True))
    lines = [
        "# Throughput of engines",
        "",
        "<!-- Made by python -m benchmarks.engines; change that, not this. -->",
        "",
        "The run takes some minutes. It was made on one thread of a shared "
        f"machine ({platform.machine()}, Python {platform.python_version()}). The tables give the "
        f"processor time per design in microseconds, the least of "
        f"{RUNS} runs. When others use the machine, runs differ by a third or more; a ratio below "
        f"1 "
        "is no gain. Speed compared with other solvers: [benchmarks](benchmarks.md).",
        "",
        f"Designs that share a table (*sharing*): {size:,} over inertia, speed and mass. "
        f"Designs with tables of their own: {size // 50:,} crank ratios.",
        "",
        "## Engines of the catalogue that fire evenly",
        "",
        "Each engine is compared with the plain in-line engine that has the same "
        "number of cylinders, bore, stroke, masses and diagrams; their runs "
        "alternate.",
        "",
        "| engine | beside | sharing, alpha 2 | plain | ratio | sharing, alpha 1.6 | plain | ratio "
        "| own tables, alpha 2 | plain | ratio |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
        *even_rows(cases),
        "",
        "## Uneven, offset and unequal engines",
        "",
        "The ratio is taken to the engine with the same number of equal cylinders, "
        "even firing and no offset.",
        "",
        "| engine | part of the cycle | sharing, alpha 2 | ratio | sharing, alpha 1.6 | ratio "
        "| own tables, alpha 2 | ratio |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
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
        "What explains the ratios:",
        "",
        "- Where designs share a table, the cost of a design is proportional to the "
        "number of nodes in one period of its torque. With cylinders of unequal mass "
        "the torque repeats once per cycle instead of Z times. An offset or friction "
        "over the stroke costs nothing beyond making the shared table.",
        "- A table of its own is a sum of columns: the works of a diagram, one for "
        "each polynomial of crank ratio and offset. Columns are made once for all "
        "designs, for each diagram and each cylinder that is no copy of another, so "
        "cylinders on different throws cost no more for a further design. With an offset "
        "there are six times as many columns to add up. Columns of friction over the "
        "stroke are made for each diagram, scale and crankcase pressure.",
        "- Parameters of single cylinders (`mass_factor_3`) make each design an "
        "engine of its own, whose diagrams are sampled again. This takes some "
        "milliseconds, ten times as long as a table.",
        "",
    ]
    return "\n".join(lines)


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--designs", type=int, default=100_000)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/throughput.md"))
    given = parser.parse_args()
    given.output.write_text(report(given.designs), encoding="utf-8")
    print(f"written: {given.output}")


if __name__ == "__main__":
    main()
