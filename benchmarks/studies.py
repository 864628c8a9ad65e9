"""Kinds of study that people run, as scenes: grids and samples over all that an engine may vary.

Each is a function from a number of designs to a scene, with fixed seeds. `benchmarks.study_times`
measures them; `benchmarks/tests/test_studies.py` counts the calls of Python of each kind.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

__all__ = ["LOOP", "ONE_TABLE", "STUDIES", "Aim", "Study", "study"]

Scene = dict[str, Any]

SCALARS = ["delta", "omega_max", "omega_min", "omega_mean"]

ONE_TABLE, LOOP = "one table", "the loop"
"""What a study's rate is compared with: the study `one_table`, or the hand-written Numba loop at
an error of 1.6e-6; another study is named by its name."""

LOOP_RATE = 157_000.0
"""Designs a second of that loop where the aims were set, so that they are ratios elsewhere."""

RANGES = {
    "reciprocating_mass": (4.0, 9.0), "inertia": (1.5, 8.0), "crank_ratio": (0.2, 0.33),
    "speed": (1000.0, 2000.0), "load": (20.0, 90.0), "cylinders": (1, 8),
}  # fmt: skip
"""Of the engine `ntua`; kg, kg m2, 1, rpm, percent."""

SIX, FOUR = tuple(RANGES), tuple(RANGES)[:4]


@dataclass(frozen=True)
class Aim:
    """A rate that is wanted, and one to hope for, as multiples of another rate.

    Attributes
    ----------
    of : str
        `ONE_TABLE`, `LOOP` or the name of a study.
    wanted, hoped_for : float, optional
        Ratios.
    """

    of: str
    wanted: float
    hoped_for: float | None = None


@dataclass(frozen=True)
class Study:
    """One kind of study.

    Attributes
    ----------
    name, words : str
        Short name, and what tables say.
    build : callable
        Makes a scene of about so many designs.
    designs : int
        Number of designs of a measurement.
    aim : Aim, optional
        What is wanted.
    modelled : bool
        Whether every design has a modelled cycle of its own.
    """

    name: str
    words: str
    build: Callable[[int], Scene]
    designs: int
    aim: Aim | None = None
    modelled: bool = False


def by_rate(wanted: float, hoped_for: float | None = None) -> Aim:
    """Aim that was set in designs a second, as a multiple of the loop's rate then."""
    return Aim(LOOP, wanted / LOOP_RATE, None if hoped_for is None else hoped_for / LOOP_RATE)


def scene(engine: str = "ntua", **tables: Any) -> Scene:
    """Scene with four scalar results."""
    return {"engine": engine, "output": {"quantities": SCALARS}, **tables}


def grid(size: int, exponent: float, more: tuple[str, ...] = ()) -> Scene:
    """Six axes: equally many values of five parameters, and one to eight cylinders."""
    each = max(2, round((size / 8) ** 0.2))
    axes: dict[str, Any] = {
        name: {"start": low, "stop": high, "num": each} for name, (low, high) in RANGES.items()
    }
    axes["cylinders"] = list(range(1, 9))
    found = scene(axes=axes, set={"load_exponent": exponent})
    found["output"] = {"quantities": [*SCALARS, *more]}
    return found


def one_table(size: int) -> Scene:
    """Three axes that a table of work does not depend on."""
    each = max(2, round(size ** (1.0 / 3.0)))
    names = ("inertia", "reciprocating_mass", "speed")
    axes = {n: {"start": RANGES[n][0], "stop": RANGES[n][1], "num": each} for n in names}
    return scene(axes=axes, set={"load_exponent": 2})


def columns(size: int, ranges: Mapping[str, tuple[float, float]], seed: int = 1) -> dict[str, Any]:
    """Columns of designs drawn at random, each evenly from its range."""
    random = np.random.default_rng(seed)
    return {
        name: random.integers(int(low), int(high) + 1, size)
        if name in ("cylinders", "misfire")
        else random.uniform(low, high, size)
        for name, (low, high) in ranges.items()
    }


def ranges_of(*names: str) -> dict[str, tuple[float, float]]:
    """Some of `RANGES`."""
    return {name: RANGES[name] for name in names}


def sampled(size: int, names: tuple[str, ...], **tables: Any) -> Scene:
    """Engine `ntua`, some of `RANGES` drawn at random."""
    return scene(designs=columns(size, ranges_of(*names)), **tables)


def any_exponent(size: int) -> Scene:
    """Four parameters and the load exponent."""
    return scene(designs=columns(size, {**ranges_of(*FOUR), "load_exponent": (0.5, 3.0)}))


def pin_offset(size: int) -> Scene:
    """Four parameters and the offset of the piston pin, up to a fifth of the crank radius."""
    return scene(designs=columns(size, {**ranges_of(*FOUR), "pin_offset": (-0.018, 0.018)}))


def stroke_friction(size: int) -> Scene:
    """Four parameters and how friction is spread over the stroke."""
    parts = dict.fromkeys(
        ("friction_boundary", "friction_mixed", "friction_hydrodynamic", "friction_skirt"),
        (0.0, 0.25),
    )  # fmt: skip
    return scene(designs=columns(size, {**ranges_of(*FOUR), **parts}), set={"ring_pressure": 1.5})


def v6(size: int, **more: tuple[float, float]) -> Scene:
    """A V6 at any load."""
    of_engine = {
        "inertia": (0.15, 0.6), "speed": (2500.0, 6400.0), "load": (30.0, 100.0), **more
    }  # fmt: skip
    return scene("v6_96x81", designs=columns(size, of_engine))


def compressor(size: int) -> Scene:
    """A compressor with an induction motor."""
    of_engine = {"flywheel_inertia": (0.04, 0.2), "crank_ratio": (0.25, 0.32),
                 "piston_mass": (0.35, 0.6), "speed": (1200.0, 1800.0)}  # fmt: skip
    return scene("compressor_79x83", designs=columns(size, of_engine))


@cache
def pump_torque() -> str:
    """Path of a table of torque over the angle of a made-up pump with three pistons."""
    folder = Path(tempfile.mkdtemp(prefix="studies"))
    angle = np.arange(0, 360, 2)
    torque = 30.0 + 12.0 * np.cos(np.radians(3 * angle)) + 4.0 * np.sin(np.radians(6 * angle))
    lines = ["load_angle_deg,torque_Nm", *(f"{a},{t:.9g}" for a, t in zip(angle, torque))]  # noqa: B905
    (folder / "pump.csv").write_text("\n".join(lines), encoding="utf-8")
    return str(folder / "pump.csv")


def angle_load(size: int) -> Scene:
    """Four parameters, and a load over the angle of its own shaft."""
    return sampled(size, FOUR, set={"load_table": pump_torque()})


def inverse(size: int) -> Scene:
    """The inertia for a wanted delta."""
    names = [name for name in FOUR if name != "inertia"]
    found = scene(designs=columns(size, {**ranges_of(*names), "wanted_delta": (0.01, 0.05)}))
    found["output"] = {"quantities": [*SCALARS, "inertia_required"]}
    return found


def modelled(size: int) -> Scene:
    """A modelled cycle of each design."""
    of_cycle = {"combustion_start": (-35.0, -15.0), "compression_ratio": (8.5, 10.5),
                "heat": (14.0, 32.0)}  # fmt: skip
    return scene("si_four_87x101", designs=columns(size, of_cycle))


STUDIES = (
    Study("one_table", "one table: inertia x mass x speed, alpha 2", one_table, 1_000_000,
          Aim(LOOP, 78.0)),
    *(
        Study(f"grid_alpha_{alpha}", f"grid of five parameters and cylinders, alpha {alpha}",
              partial(grid, exponent=float(alpha)), 800_000, Aim(ONE_TABLE, 0.6, 0.9))
        for alpha in (0, 1, 2)
    ),
    Study("small_grid", "the same with 6 values each, alpha 2", partial(grid, exponent=2.0),
          62_208, Aim(ONE_TABLE, 0.4)),
    Study("sampled", "the six sampled at random", partial(sampled, names=SIX), 1_000_000,
          Aim(LOOP, 8.0, 20.0)),
    Study("sampled_four", "sampled without load and cylinders", partial(sampled, names=FOUR),
          1_000_000, by_rate(2_000_000)),
    Study("any_exponent", "sampled, any exponent", any_exponent, 500_000, by_rate(1_500_000)),
    Study("variable", "sampled, variable inertia",
          partial(sampled, names=FOUR, solver={"inertia_model": "variable"}), 500_000,
          by_rate(1_500_000)),
    Study("cycle_time", "sampled, closure cycle_time",
          partial(sampled, names=FOUR, solver={"closure": "cycle_time"}), 50_000,
          by_rate(500_000)),
    Study("pin_offset", "pin offset sampled", pin_offset, 50_000, by_rate(200_000, 1_000_000)),
    Study("stroke_friction", "friction over the stroke sampled", stroke_friction, 50_000,
          by_rate(200_000, 1_000_000)),
    Study("v6_load", "V6, load sampled", v6, 100_000, by_rate(500_000)),
    Study("v6_misfire", "V6, misfire and load sampled", partial(v6, misfire=(0, 6)), 10_000,
          by_rate(200_000)),
    Study("driven", "compressor with its motor, sampled", compressor, 50_000,
          by_rate(150_000, 500_000)),
    Study("angle_load", "a load over angle, sampled", angle_load, 50_000,
          by_rate(150_000, 500_000)),
    Study("wanted_delta", "wanted delta, sampled", inverse, 50_000, by_rate(300_000)),
    Study("modelled", "spark ignition: combustion start, compression ratio, heat sampled",
          modelled, 5000, by_rate(5_000, 20_000), modelled=True),
    Study("grid_errors", "grid, alpha 2, with delta_error",
          partial(grid, exponent=2.0, more=("delta_error",)), 800_000,
          Aim("grid_alpha_2", 0.4, 0.5)),
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
