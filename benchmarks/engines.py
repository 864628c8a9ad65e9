"""Throughput of engines: even ones of the catalogue beside plain in-line ones, then all others.

python -m benchmarks.engines [--designs N] [-o FOLDER]

Writes docs/benchmarks/even_engines.csv and uneven_engines.csv, which docs/benchmarks.md names.
Times are processor times of one thread, the least of some runs, so that a busy machine counts
little; ratios are to the even engine of as many cylinders. Engines of the
catalogue and the plain in-line engine that each is compared with take turns, run by run.
"""

from __future__ import annotations

import math
import platform
import time
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import page
from benchmarks.command import ROOT, settings
from benchmarks.measure import in_turns
from benchmarks.problem import own_inputs, scene
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
    two, four, offset = even_cylinders(2, PERIOD), even_cylinders(4, PERIOD), {"offset_ratio": 0.2}
    return [
        [
            Kind("in-line 2, even", two),
            Kind("parallel twin 270, uneven", of("parallel twin 270")),
            Kind("in-line 2, offset 0.2 r", two, offset),
            Kind("in-line 2, friction over the stroke", two, FRICTION),
        ],
        [
            Kind("in-line 4, even", four),
            Kind("in-line 4, mass spread", of("in-line 4", mass_factor=(1, 1.02, 0.99, 1))),
            Kind("in-line 4, unequal throws", of("in-line 4", radius_factor=(1, 0.9, 0.9, 1))),
            Kind("in-line 4, offset 0.2 r", four, offset),
            Kind("in-line 4, friction over the stroke", four, FRICTION),
        ],
        [
            Kind("V8 cross-plane, even", of("V8 cross-plane")),
            Kind("V8 cross-plane, mass spread",
                 of("V8 cross-plane", mass_factor=(1.02, *(1.0,) * 7))),
        ],
    ]  # fmt: skip


def inputs_of(kind: Kind, size: int, exponent: float, apart: bool) -> dict[str, Any]:
    """Arguments of `sweep.solve` for an engine; `apart`: each design with a table of its own."""
    count = kind.cylinders.count
    given = {
        "cylinders_by_count": {count: kind.cylinders},
        **own_inputs(scene(size, exponent, count)),
    }
    if not apart:
        return {**given, **kind.more}
    # As many tables as designs: crank ratios along an axis of their own.
    given |= {"crank_ratio": np.linspace(0.2, 0.33, size), "mass": 6.0, "speed": 150.0}
    given |= {"inertia": np.geomspace(1.5, 8.0, size), "mean_torque": 200.0}
    more = dict(kind.more)
    if "offset_ratio" in more:
        more["offset_ratio"] = np.full(size, 0.2)
    return {**given, **more}


def least_seconds(*calls: dict[str, Any]) -> list[float]:
    """Least processor time of each of some calls of `sweep.solve`, which take turns."""
    wanted = ("delta", "omega_max", "omega_min", "omega_mean")
    works = [partial(dispatch.solve, wanted=wanted, threads=1, **given) for given in calls]
    # The first run may compile.
    runs = [RUNS + 1] * len(works)
    return [min(times) for times, _ in in_turns(works, runs, time.process_time)]


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
        "speed": np.linspace(0.6, 1.0, base.speed.size)[:, None, None] * speed,
        "mass": np.linspace(0.8, 1.2, base.mass.size)[:, None] * mass,
        "inertia": np.geomspace(0.8, 3.0, base.inertia.size) * inertia,
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


CASES = ("sharing, alpha 2", "sharing, alpha 1.6", "own tables, alpha 2")


def cases_of(size: int) -> tuple[tuple[int, float, bool], ...]:
    """Number of designs, exponent, and whether each has a table of its own."""
    return ((size, 2.0, False), (size, 1.6, False), (size // 50, 2.0, True))


def even_rows(size: int) -> tuple[list[list[str]], list[float]]:
    """One row an even engine of the catalogue, and all ratios."""
    rows, ratios = [], []
    for name, engine in even_engines().items():
        count = int(engine.values["cylinders"])
        cells = []
        for number, exponent, apart in cases_of(size):
            given = designs_of(engine, number, exponent, apart)
            both = own_cylinders(engine), plain_cylinders(engine)
            mine, plain = least_seconds(
                *({"cylinders_by_count": {count: cylinders}, **given} for cylinders in both)
            )
            ratios.append(mine / plain)
            cells += [
                *(f"{1e6 * each / number:.3g}" for each in (mine, plain)),
                f"{ratios[-1]:.2f}",
            ]
        strokes = "two-stroke" if engine.period == TWO_STROKE else "four-stroke"
        rows.append([name, f"in-line {count}, {strokes}", *cells])
    return rows, ratios


def uneven_rows(size: int) -> list[list[str]]:
    """One row an engine, each group beside its even one."""
    rows = []
    for group in kinds():
        base: list[float] = []
        for kind in group:
            each = [
                1e6 * least_seconds(inputs_of(kind, *case))[0] / case[0] for case in cases_of(size)
            ]
            base = base or each
            cells = []
            for us, even in zip(each, base, strict=True):
                cells += [f"{us:.3g}", f"{us / even:.2f}"]
            rows.append([kind.text, kind.cylinders.solved.split(",")[0], *cells])
    return rows


def write(size: int, folder: Path) -> None:
    """Measure, and write the files and the page that names them."""
    even, ratios = even_rows(size)
    head = [f"{what}{case}" for case in CASES for what in ("", "plain: ", "ratio: ")]
    page.save(folder, "even_engines", ["engine", "beside", *head], even)
    head = [f"{what}{case}" for case in CASES for what in ("", "ratio: ")]
    page.save(folder, "uneven_engines", ["engine", "part of the cycle", *head], uneven_rows(size))
    page.save_facts(folder, {
        "engines": f"{platform.machine()}, Python {platform.python_version()}",
        "engines_designs": f"{size:,}", "engines_tables": f"{size // 50:,}",
        "engines_ratios": f"{min(ratios):.2f} to {max(ratios):.2f}",
    })  # fmt: skip
    page.write(folder)


def main() -> None:
    """Measure and write."""
    given = settings("benchmarks.engines", __doc__, designs=100_000, output=ROOT / "docs")
    write(given.designs, given.output)
    print(f"written: {given.output / 'benchmarks.md'}")


if __name__ == "__main__":
    main()
