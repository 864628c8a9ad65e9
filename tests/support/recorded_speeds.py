"""Recordings of the speed of `ntua` as files, with diagrams that are not those of the catalogue."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

import sweeps
from engine_dyn.geometry.toothed_wheel import wheel_from_text
from engine_dyn.pressure.diagram import Diagram, diagram_from_points
from engine_dyn.pressure.family import Family
from sweeps.scene.reading import read_scene

from .teeth import SampledEngine, noisy, tooth_times, write_times

__all__ = ["CYCLE", "LOADS", "WHEEL", "Recorded", "engine_of", "write_speeds", "write_teeth"]

Floats = npt.NDArray[np.float64]

LOADS = (25.0, 50.0, 90.0)
WHEEL = wheel_from_text("36-1")
CYCLE = 4.0 * np.pi

SCENE = """title = "Recorded"
engine = "ntua"
[designs]
load = [25, 50, 90]
[solver]
closure = "cycle_time"
inertia_model = "variable"
[output]
quantities = ["omega"]
[measured]
file = ["load_0.csv", "load_1.csv", "load_2.csv"]
at = { design = [1, 2, 3] }
"""


@dataclass(frozen=True)
class Recorded:
    """What a recording was made with: kg m2, degree, bar, 1."""

    inertia: float = 2.2
    shift: float = 0.0
    pegging: float = 0.0
    factor: float = 1.0


def engine_of(load: float, made: Recorded) -> SampledEngine:
    """The engine whose speed is recorded."""

    def moved(diagram: Diagram) -> Diagram:
        spline = periodic(diagram.angle, diagram.pressure)
        pressure = made.factor * spline(diagram.angle - np.deg2rad(made.shift))
        return diagram_from_points(diagram.angle, pressure + 1e5 * made.pegging, diagram.period)

    scene = read_scene(
        {
            "engine": "ntua",
            "set": {"load": load, "speed": 1500, "inertia": made.inertia},
            "solver": {"closure": "cycle_time", "inertia_model": "variable"},
            "output": {"quantities": ["omega"]},
        }
    )
    assert isinstance(scene.engine.family, Family)
    engine = replace(scene.engine, family=scene.engine.family.each(moved))
    found = sweeps.run(replace(scene, engine=engine))
    return SampledEngine(np.deg2rad(found.crank_angle.values), found.omega.values.ravel())


def periodic(angle: Floats, values: Floats) -> CubicSpline:
    return CubicSpline(
        np.append(angle, angle[0] + CYCLE), np.append(values, values[0]), bc_type="periodic"
    )


def write_teeth(
    folder: Path, made: list[Recorded], errors: Floats, gap_angle: float, cycles: int = 30
) -> Path:
    """Files of times of teeth whose single intervals have an error of 0.2 %, and their scene."""
    rng = np.random.default_rng(8)
    for place, (load, one) in enumerate(zip(LOADS, made, strict=True)):
        gap = np.deg2rad(gap_angle) + 2.0 * np.pi * (place % 2)
        times = tooth_times(engine_of(load, one), WHEEL.width, 2 * cycles, gap, errors)
        write_times(folder / f"load_{place}.csv", noisy(times, 0.002, rng))
    path = folder / "scene.toml"
    path.write_text(f'{SCENE}kind = "teeth"\nwheel = "36-1"\n')
    return path


def write_speeds(folder: Path, made: list[Recorded], cycles: int = 15, step: float = 4.0) -> Path:
    """Files of speed over crank angle that runs on over the cycles, and their scene."""
    rng = np.random.default_rng(9)
    for place, (load, one) in enumerate(zip(LOADS, made, strict=True)):
        angle = np.arange(-360.0, 720.0 * cycles - 360.0, step)
        within = (np.deg2rad(angle) + 0.5 * CYCLE) % CYCLE - 0.5 * CYCLE
        count = round(720.0 / step)
        # Cycles differ in their low orders.
        waves = np.cos(
            np.arange(count) * np.arange(1, 6)[:, None] * 2.0 * np.pi / count
            + rng.uniform(0.0, 2.0 * np.pi, (cycles, 5, 1))
        )
        noise = 0.001 * np.einsum("cw,cwn->cn", rng.normal(size=(cycles, 5)), waves)
        speed = 30.0 / np.pi * engine_of(load, one).speed(within) * (1.0 + noise.ravel())
        lines = "\n".join(f"{a:g},{v:.5f}" for a, v in zip(angle, speed, strict=True))
        (folder / f"load_{place}.csv").write_text(f"crank angle [deg],speed [rpm]\n{lines}\n")
    path = folder / "scene.toml"
    path.write_text(f'{SCENE}kind = "speed"\n')
    return path
