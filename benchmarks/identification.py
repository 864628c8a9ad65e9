"""How often the 95 % intervals of fitted parameters cover the truth.

Every case is an engine with parameters drawn at random, whose recordings are written as files and
given to `sweeps.identify`, as a user does. What the recordings are made with shares nothing with
the fit but the solution of the speed: diagrams are shifted and multiplied through splines of scipy,
times at which teeth pass are integrals of such splines, and the noise is that of times.
"""

from __future__ import annotations

import json
import shutil
import tempfile
import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

import sweeps
from benchmarks.command import settings
from engine_dyn import ImplausibleWarning
from engine_dyn.geometry.toothed_wheel import TURN, wheel_from_text
from engine_dyn.pressure.diagram import Diagram, diagram_from_points
from engine_dyn.pressure.family import Family
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE
from oracle.teeth import SampledEngine, tooth_times, write_times
from sweeps.lab.speed.identification import Varied
from sweeps.scene.reading import read_scene

LOADS = (25.0, 50.0, 90.0)
SPEED = 1500.0
WHEEL = wheel_from_text("36-1")
CYCLES = 12
TOOTH_DEVIATION = 0.003
"""Standard deviation of the errors of the intervals, over the pitch."""

JITTER, SCATTER = 0.002, 0.002
"""Standard deviation of the time between two teeth, of one interval and of low orders."""

PRIORS = {"dead_centre_shift": 0.1, "load_exponent": 0.3, "pressure_factor": 0.02}
"""Standard deviation of what is known without the speed; degree, 1, 1."""


class Kind(NamedTuple):
    """A kind of case."""

    name: str
    words: str  # what tables say
    vary: tuple[str, ...] = ("inertia", "gap_angle", "dead_centre_shift", "load_exponent")
    low_orders: bool = True  # most of the noise, as that of combustion; else it is white
    priors: tuple[str, ...] = ()  # parameters that are known with `PRIORS`
    at_bound: bool = False  # the load torque is constant: its exponent is at its bound of 0
    with_teeth: bool = True  # the wheel has errors, which the fit then estimates


KINDS = (
    Kind("white", "white noise", low_orders=False),
    Kind("low_orders", "noise of low orders"),
    Kind("priors", "the same, priors for two", priors=("dead_centre_shift", "load_exponent")),
    Kind("bound", "the same, truth at a bound", at_bound=True),
    Kind("perfect", "the same, perfect wheel", with_teeth=False),
    Kind("own", "the same, a pressure factor with a prior for each recording",
         ("inertia", "gap_angle", "dead_centre_shift", "pressure_factor"),
         priors=("pressure_factor",)),
)  # fmt: skip


class Case(NamedTuple):
    """What a case was made with."""

    values: dict[str, float]  # of all parameters; of those of single recordings by ``key@number``
    errors: Floats  # of the intervals of the wheel, shape (teeth,)
    times: list[Floats]  # at which the teeth pass in three recordings [s]


def simulated(kind: Kind, rng: np.random.Generator) -> Case:
    """Draw a truth and the times at which teeth pass."""
    own = "pressure_factor" in kind.vary
    values = {
        "inertia": 2.0 * rng.uniform(0.8, 1.2),
        "gap_angle": rng.uniform(-150.0, 150.0),
        "dead_centre_shift": rng.normal(0.0, 0.5),
        "load_exponent": 1.0 if own else 0.0 if kind.at_bound else rng.uniform(0.9, 2.0),
    }
    for number in range(len(LOADS)):
        values[f"pressure_factor@{number + 1}"] = (
            1.0 + rng.normal(0.0, PRIORS["pressure_factor"]) if own else 1.0
        )
    errors = (TOOTH_DEVIATION if kind.with_teeth else 0.0) * rng.normal(size=WHEEL.teeth)
    errors -= errors @ WHEEL.width / TURN
    gap = values["gap_angle"] * DEGREE
    loads = range(len(LOADS))
    times = [_passed(_speed(values, number), gap, errors, kind, rng) for number in loads]
    return Case(values, errors, times)


def _speed(values: dict[str, float], number: int) -> Floats:
    """Speed of a recording over the angle, from -360 degrees [rad/s]."""
    scene = read_scene(
        {
            "engine": "ntua",
            "set": {"load": LOADS[number], "speed": SPEED, "inertia": values["inertia"],
                    "load_exponent": values["load_exponent"]},
            "solver": {"closure": "cycle_time", "inertia_model": "variable"},
            "output": {"quantities": ["omega"]},
        }
    )  # fmt: skip
    family = scene.engine.family
    assert isinstance(family, Family)
    shift, factor = values["dead_centre_shift"], values[f"pressure_factor@{number + 1}"]
    moved = family.each(lambda d: _moved(d, shift * DEGREE, factor))
    engine = replace(scene.engine, family=moved)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImplausibleWarning)
        return np.asarray(sweeps.run(replace(scene, engine=engine)).omega.values).ravel()


def _moved(diagram: Diagram, shift: float, factor: float) -> Diagram:
    """A diagram that comes later, multiplied, on the same angles."""
    angle = np.append(diagram.angle, diagram.angle[0] + diagram.period)
    closed = CubicSpline(
        angle, np.append(diagram.pressure, diagram.pressure[0]), bc_type="periodic"
    )
    pressure = closed(diagram.angle - shift)
    return diagram_from_points(diagram.angle, factor * pressure, diagram.period)


def _passed(
    speed: Floats, gap_angle: float, errors: Floats, kind: Kind, rng: np.random.Generator
) -> Floats:
    """Times at which the teeth of some cycles pass [s]."""
    angle: Floats = TURN * (np.arange(speed.size, dtype=np.float64) * (2.0 / speed.size) - 1.0)
    # On the average, the teeth are where they should be.
    aside = np.concatenate([[0.0], np.cumsum(WHEEL.width * errors)[:-1]]).mean()
    first = gap_angle - aside + TURN * rng.integers(2)
    passed = tooth_times(SampledEngine(angle, speed), WHEEL.width, 2 * CYCLES, first, errors)
    return np.concatenate([[0.0], np.cumsum(np.diff(passed) * (1.0 + _noise(kind, rng)).ravel())])


def _noise(kind: Kind, rng: np.random.Generator) -> Floats:
    """Relative errors of the times between teeth, shape (CYCLES, intervals)."""
    count = 2 * WHEEL.teeth
    noise = rng.normal(size=(CYCLES, count))
    if not kind.low_orders:
        return JITTER * noise
    spectrum = np.fft.rfft(noise, axis=1)
    spectrum *= 1.0 / (1.0 + (np.arange(spectrum.shape[1]) / 4.0) ** 2)  # half orders 1 to some 4
    noise = np.fft.irfft(spectrum, count, axis=1)
    noise *= SCATTER / np.sqrt(np.mean(noise**2))
    size = 1.0 + 0.5 * np.cos(2.0 * np.pi * np.arange(count) / count)
    return np.asarray(noise * size + 0.25 * JITTER * rng.normal(size=noise.shape))


def _write(folder: Path, recordings: Sequence[Floats]) -> None:
    """The scene, and its recordings."""
    shutil.copy(Path(__file__).with_suffix(".toml"), folder / "scene.toml")
    for number, times in enumerate(recordings, 1):
        write_times(folder / f"load_{number}.csv", times)


def _wanted(kind: Kind, case: Case, rng: np.random.Generator) -> dict[str, Varied]:
    """What is fitted, and what is said to be known: its error is as large as is said.

    A pressure factor is said to be 1, and was drawn around it.
    """
    wanted = {key: Varied(own=key == "pressure_factor") for key in kind.vary}
    for key in (key for key in kind.vary if key in kind.priors):
        known = 1.0 if wanted[key].own else case.values[key] + rng.normal(0.0, PRIORS[key])
        known = max(known, 0.0) if key == "load_exponent" else known
        wanted[key] = replace(wanted[key], prior=known, deviation=PRIORS[key])
    return wanted


def covered(kind: Kind, cases: int) -> Counter[str]:
    """Fit to some cases; how many intervals had the truth in them. Each case is always the same."""
    found = Counter[str]()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for place in range(cases):
            rng = np.random.default_rng([21, KINDS.index(kind), place])
            case = simulated(kind, rng)
            _write(folder, case.times)
            fit = sweeps.identify(
                folder / "scene.toml", _wanted(kind, case, rng), predict=False,
                teeth="estimated" if kind.with_teeth else "perfect",
            )  # fmt: skip
            for i, key in enumerate(fit.parameter.values.tolist()):
                found[key] += bool(fit.value_low[i] <= case.values[key] <= fit.value_high[i])
    return found


def main(arguments: Sequence[str]) -> None:
    """Count and print, or write."""
    options = settings(
        "identification", __doc__, arguments, cases=400,
        only=[kind.name for kind in KINDS], write=Path,
    )  # fmt: skip
    if options.write is not None:
        case = simulated(KINDS[0], np.random.default_rng([21, 0, 0]))
        options.write.mkdir(parents=True, exist_ok=True)
        _write(options.write, case.times)
        print(json.dumps(case.values, indent=1))
        return
    for kind in KINDS:
        if options.only is None or kind.name in options.only:
            found = covered(kind, options.cases)
            shares = (f"{key} {100.0 * n / options.cases:.1f} %" for key, n in found.items())
            print(f"{kind.words}, {options.cases} fits: {', '.join(shares)}", flush=True)
