"""Kinds of study that people run, as scenes: grids and samples over all that an engine may vary.

Each is a function from a number of designs to a scene, with fixed seeds. `benchmarks.study_times`
measures them; `benchmarks/tests/test_studies.py` counts the calls of Python of each kind.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.tables import save

Scene = dict[str, Any]
Ranges = Mapping[str, tuple[float, float]]
Build = Callable[[int], Scene]

SCALARS = ["delta", "omega_max", "omega_min", "omega_mean"]

RANGES = {
    "reciprocating_mass": (4.0, 9.0), "inertia": (1.5, 8.0), "crank_ratio": (0.2, 0.33),
    "speed": (1000.0, 2000.0), "load": (20.0, 90.0), "cylinders": (1, 8),
}  # fmt: skip
"""Of the engine `ntua`; kg, kg m2, 1, rpm, percent."""

FOUR = {name: RANGES[name] for name in list(RANGES)[:4]}
"""Without load and cylinders."""

STROKE_FRICTION = tuple(
    f"friction_{part}" for part in ("boundary", "mixed", "hydrodynamic", "skirt")
)

OF_WANTED = {**{name: FOUR[name] for name in FOUR if name != "inertia"},
             "wanted_delta": (0.01, 0.05)}  # fmt: skip
"""The inertia follows."""

OF_V6 = {"inertia": (0.15, 0.6), "speed": (2500.0, 6400.0), "load": (30.0, 100.0)}

OF_COMPRESSOR = {"flywheel_inertia": (0.04, 0.2), "crank_ratio": (0.25, 0.32),
                 "piston_mass": (0.35, 0.6), "speed": (1200.0, 1800.0)}  # fmt: skip

OF_CYCLE = {"combustion_start": (-35.0, -15.0), "compression_ratio": (8.5, 10.5),
            "heat": (14.0, 32.0)}  # fmt: skip


class Study(NamedTuple):
    """One kind of study."""

    name: str
    words: str  # what tables say
    build: Build  # makes a scene of about so many designs
    designs: int  # of a measurement
    modelled: bool = False  # whether every design has a modelled cycle of its own


def scene(engine: str = "ntua", quantities: Sequence[str] = (), **tables: Any) -> Scene:
    """Scene with four scalar results, and others."""
    return {"engine": engine, "output": {"quantities": [*SCALARS, *quantities]}, **tables}


def grid(size: int, exponent: float, quantities: Sequence[str] = ()) -> Scene:
    """Six axes: equally many values of five parameters, and one to eight cylinders."""
    each = max(2, round((size / 8) ** 0.2))
    axes: dict[str, Any] = {
        name: {"start": low, "stop": high, "num": each} for name, (low, high) in RANGES.items()
    }
    axes["cylinders"] = list(range(1, 9))
    return scene(quantities=quantities, axes=axes, set={"load_exponent": exponent})


def one_table(size: int) -> Scene:
    """Three axes that a table of work does not depend on."""
    each = max(2, round(size ** (1.0 / 3.0)))
    names = ("inertia", "reciprocating_mass", "speed")
    axes = {n: {"start": RANGES[n][0], "stop": RANGES[n][1], "num": each} for n in names}
    return scene(axes=axes, set={"load_exponent": 2})


def columns(size: int, ranges: Ranges, seed: int = 1) -> dict[str, Any]:
    """Columns of designs drawn at random, each evenly from its range."""
    random = np.random.default_rng(seed)
    return {
        name: random.integers(int(low), int(high) + 1, size)
        if name in ("cylinders", "misfire")
        else random.uniform(low, high, size)
        for name, (low, high) in ranges.items()
    }


def sampled(size: int, ranges: Ranges, engine: str = "ntua", seed: int = 1, **more: Any) -> Scene:
    """Parameters drawn at random."""
    return scene(engine, designs=columns(size, ranges, seed), **more)


@cache
def pump_torque() -> str:
    """Path of a table of torque over the angle of a made-up pump with three pistons."""
    path = Path(tempfile.mkdtemp(prefix="studies")) / "pump.csv"
    angle = np.arange(0, 360, 2)
    torque = 30.0 + 12.0 * np.cos(np.radians(3 * angle)) + 4.0 * np.sin(np.radians(6 * angle))
    body = [[str(a), f"{t:.9g}"] for a, t in zip(angle, torque, strict=True)]
    save(path, ["load_angle_deg", "torque_Nm"], body)
    return str(path)


def angle_load(size: int, ranges: Ranges, seed: int = 1) -> Scene:
    """Parameters drawn at random, and a load over the angle of its own shaft."""
    return sampled(size, ranges, seed=seed, set={"load_table": pump_torque()})


def of(*, engine: str = "ntua", more: Ranges | None = None, **options: Any) -> Build:
    """Samples of four parameters and more, or of those of another engine."""
    base = {"ntua": FOUR, "v6_96x81": OF_V6, "compressor_79x83": OF_COMPRESSOR,
            "si_four_87x101": OF_CYCLE}[engine]  # fmt: skip
    return partial(sampled, ranges={**base, **(more or {})}, engine=engine, **options)


STUDIES = (
    Study("one_table", "one table: inertia x mass x speed, alpha 2", one_table, 1_000_000),
    *(
        Study(f"grid_alpha_{alpha}", f"grid of five parameters and cylinders, alpha {alpha}",
              partial(grid, exponent=float(alpha)), 800_000)
        for alpha in (0, 1, 2)
    ),
    Study("small_grid", "the same with 6 values each, alpha 2", partial(grid, exponent=2.0),
          62_208),
    Study("sampled", "the six sampled at random", partial(sampled, ranges=RANGES), 1_000_000),
    Study("sampled_four", "sampled without load and cylinders", of(), 1_000_000),
    Study("any_exponent", "sampled, any exponent", of(more={"load_exponent": (0.5, 3.0)}), 500_000),
    Study("variable", "sampled, variable inertia", of(solver={"inertia_model": "variable"}),
          500_000),
    Study("cycle_time", "sampled, closure cycle_time", of(solver={"closure": "cycle_time"}),
          50_000),
    Study("pin_offset", "pin offset sampled", of(more={"pin_offset": (-0.018, 0.018)}), 50_000),
    Study("stroke_friction", "friction over the stroke sampled",
          of(more=dict.fromkeys(STROKE_FRICTION, (0.0, 0.25)), set={"ring_pressure": 1.5}), 50_000),
    Study("v6_load", "V6, load sampled", of(engine="v6_96x81"), 100_000),
    Study("v6_misfire", "V6, misfire and load sampled",
          of(engine="v6_96x81", more={"misfire": (0, 6)}), 10_000),
    Study("driven", "compressor with its motor, sampled", of(engine="compressor_79x83"), 50_000),
    Study("angle_load", "a load over angle, sampled", partial(angle_load, ranges=FOUR), 50_000),
    Study("wanted_delta", "wanted delta, sampled",
          partial(sampled, ranges=OF_WANTED, quantities=("inertia_required",)), 50_000),
    Study("modelled", "spark ignition: combustion start, compression ratio, heat sampled",
          of(engine="si_four_87x101"), 5000, modelled=True),
    Study("grid_errors", "grid, alpha 2, with delta_error",
          partial(grid, exponent=2.0, quantities=("delta_error",)), 800_000),
)  # fmt: skip
"""Every row of the table of studies, in its order."""


def study(name: str) -> Study:
    """Study of a name.

    Raises
    ------
    ValueError
        Naming all that there are.
    """
    for each in STUDIES:
        if each.name == name:
            return each
    raise ValueError(f"{name}: no study; there are {', '.join(s.name for s in STUDIES)}")
