"""Recorded cycles in a row: the speed over all of them, followed and closed, as a dataset."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from engine_dyn import status
from engine_dyn.geometry.toothed_wheel import TURN
from engine_dyn.recordings.transient import (
    SpeedOfTrain,
    TorqueTrain,
    close_train,
    fit_train,
    follow_train,
)
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE
from sweeps.base.errors import SceneError
from sweeps.base.one_thread import linear_algebra_on_one_thread
from sweeps.lab.speed.computed_speeds import LEFT_OUT, OneEngine, engine_of, values_of
from sweeps.lab.speed.labelled import labelled_dataset
from sweeps.lab.speed.measured_files import records_of
from sweeps.lab.speed.recorded_speeds import CyclesInARow, cycles_in_a_row
from sweeps.scene.features.measured import Measured
from sweeps.scene.keywords import Tables, tables_in_signature
from sweeps.scene.model import Scene
from sweeps.scene.reading import read_scene

if TYPE_CHECKING:
    import xarray as xr

NOT_FOLLOWED: Mapping[str, str] = {
    **LEFT_OUT,
    "stroke_friction": "not supported with friction over the stroke; its shares must be 0, and "
    "with a friction law by component ring_pressure must not be given",
    "angle_load": "not supported with a load over angle; the load must be a + k omega^alpha",
    "with_driver": "not supported with a driver; the engine must drive its load",
    "linear_square": "the load must be a + k omega^alpha with load_exponent",
    "table": "not supported with a load from a table; the load must be a + k omega^alpha",
    "motor": "not supported with a motor; the engine must drive its load",
}
"""Words of scenes whose trains of cycles are not computed, and what must hold instead."""

# Largest number of cycles by which the recordings of pressure and speed may begin apart
MOST_APART = 2

FEWEST = 2  # Smallest number of cycles: one does not determine both initial speed and load

MOST_SAMPLES = 10_000_000
"""Largest number of pressures of a series of cycles, two for each step: a thousand cycles in steps
of a seventh degree."""


@dataclass(frozen=True, eq=False)
class _Fit:
    """The computed train, and the measured speed next to it."""

    speed: SpeedOfTrain  # Computed speed over the series of recorded cycles
    how: str  # Source of first speed and load coefficient, in words
    # Crank angles in the middle of the intervals between teeth [rad], from the first of a cycle;
    # shape (intervals,)
    middle: Floats | None = None
    # Measured speed between teeth [rad/s]; NaN where it is missing; shape (cycles, intervals)
    raw: Floats | None = None
    # Measured mean over the angle of each cycle [rad/s]; shape (cycles,)
    means: Floats | None = None
    # Attributes of the dataset that describe the fit to the measured speed
    said: Mapping[str, Any] | None = None


@tables_in_signature
@linear_algebra_on_one_thread()
def follow_cycles(
    scene: str | Path | Mapping[str, Any] | Scene | None = None, **tables: Unpack[Tables]
) -> xr.Dataset:
    """Follow the speed over recorded cycles in a row, as they came.

    The train of cycles is an initial-value problem with variable inertia, docs/method.md section
    15.4. First speed and load coefficient are fitted to the speed that [measured] names, which must
    have been recorded together with the pressure. Without it, the mean cycle is taken to have run
    for ever before the train, and the train's mean speed is the nominal one.

    Parameters
    ----------
    scene : str, Path, dict or Scene, optional
        One design, with `recorded_cycle` on an axis whose numbers follow each other.
    **tables
        Tables of a scene as keywords; see `sweeps.read_scene`.

    Returns
    -------
    xarray.Dataset
        Over `recorded_cycle` and `crank_angle`: the speed, followed, closed on itself, and as if
        each cycle repeated for ever. Over `recorded_cycle`: delta and mean speed of each, imep.
        Without dimensions: first speeds, load coefficients, the jump that closing forces, and the
        memory of the train. With [measured], over `interval` (of teeth): the raw speed.

    Raises
    ------
    SceneError
        One line: no recorded cycles or several designs, engines and loads that are not followed,
        cycles that do not drive their load, and speeds that do not fit.

    Examples
    --------
    >>> import numpy as np
    >>> import sweeps
    >>> loads = [60, 70, 50, 60]  # of four cycles in a row
    >>> cycles = sweeps.run(
    ...     engine="ntua", axes={"load": [50, 60, 70]}, output={"quantities": ["pressure"]}
    ... ).sel(load=loads)
    >>> heads = ";".join(f"{angle:g}" for angle in cycles.crank_angle.values)
    >>> table = np.column_stack([[1, 2, 3, 4], cycles.pressure])
    >>> np.savetxt("cycles.csv", table, delimiter=";", header=f"cycle;{heads}", comments="")
    >>> train = sweeps.follow_cycles(
    ...     engine="ntua",
    ...     axes={"recorded_cycle": [1, 2, 3, 4]},
    ...     indicator={"file": "cycles.csv", "unit": "bar"},
    ...     output={"quantities": ["delta"]},
    ... )
    >>> int(train.imep.values.argmin()) + 1
    3
    """
    given = read_scene(scene, **tables)
    name = str(given.path or "scene")
    given, numbers = _one_design(given, name)
    engine = engine_of(given, f"{name}: a train of recorded cycles", NOT_FOLLOWED)
    exponent, constant, nominal = values_of(given, ("load_exponent", "load_offset", "speed"))
    samples = 2 * round(engine.period / DEGREE / given.angle_step)
    if samples * len(numbers) > MOST_SAMPLES:
        raise SceneError(
            f"{name}: [output] angle_step = {given.angle_step:g}: {len(numbers)} cycles of "
            f"{samples // 2} steps; must be at most {MOST_SAMPLES // 2:g} steps together"
        )
    repeated = _repeated(given)
    friction = float(repeated["friction_torque"].mean())

    angle = engine.period * (np.arange(samples) / samples - 0.5)
    pressure = np.array([given.recorded_cycles[number - 1](angle) for number in numbers])
    train = engine.train(pressure, friction, exponent, constant)
    one = engine.train(pressure.mean(axis=0)[None], friction, exponent, constant)
    surplus = float(train.torque.mean()) - constant
    if not surplus > 0.0:
        raise SceneError(
            f"{name}: the recorded cycles do not drive the load: their mean torque minus friction "
            f"and load_offset is {surplus:.3g} N m; must be above 0"
        )
    steady = _solved(close_train(one, nominal), "the mean cycle", name)
    from_steady = (
        "no speed is measured: the train starts from the steady state of the mean cycle at nominal "
        "speed; the load coefficient makes the mean speed of the train equal to the nominal speed"
    )
    if given.measured is None:
        fit = _Fit(_at_mean_speed(train, steady, nominal, name), from_steady)
    else:
        fit = _fitted(given.measured, train, engine, steady, numbers[0], name)
    mean = float(_means(fit.speed.speed, len(numbers)).mean())
    closed = _solved(close_train(train, mean), "the closed train", name)
    return _dataset(given, numbers, repeated, fit, closed, len(engine.firing))


def _one_design(scene: Scene, name: str) -> tuple[Scene, list[int]]:
    """The scene with one design for all its recorded cycles, and the numbers of these."""
    if "recorded_cycle" not in scene.axes:
        raise SceneError(
            f"{name}: [axes] recorded_cycle: missing; must be the numbers of recorded cycles that "
            "follow each other, such as { start = 1, stop = 12, num = 12 }"
        )
    several = [key for key in scene.dimensions if key != "recorded_cycle"
               and (key not in scene.axes or len(scene.axes[key]) > 1)]  # fmt: skip
    if several:
        raise SceneError(
            f"{name}: the scene also varies {', '.join(several)}; a train of recorded cycles must "
            "have one design"
        )
    single = {k: float(v[0]) for k, v in scene.axes.items() if k != "recorded_cycle"}
    numbers = [int(number) for number in scene.axes["recorded_cycle"]]
    if len(numbers) < FEWEST or numbers != list(range(numbers[0], numbers[0] + len(numbers))):
        raise SceneError(
            f"{name}: [axes] recorded_cycle: must be at least {FEWEST} consecutive numbers"
        )
    return replace(
        scene, settings={**scene.settings, **single},
        axes={"recorded_cycle": scene.axes["recorded_cycle"]}, dimensions=("recorded_cycle",),
    ), numbers  # fmt: skip


def _repeated(scene: Scene) -> xr.Dataset:
    """Each recorded cycle as if it repeated for ever, with variable inertia."""
    from sweeps.running.compute.in_memory import run

    quantities = ("omega", "delta", "omega_mean", "friction_torque", "imep", "load_coefficient")
    return run(
        replace(scene, quantities=quantities, inertia_models=("variable",), reference=None,
                fail_on=())
    )  # fmt: skip


def _solved(train: SpeedOfTrain, what: str, name: str) -> SpeedOfTrain:
    if train.status == status.CONVERGED:
        return train
    raise SceneError(
        f"{name}: {what} has no speed ({status.MEANINGS[train.status]}); increase the inertia or "
        "the speed"
    )


def _at_mean_speed(
    train: TorqueTrain, steady: SpeedOfTrain, wanted: float, name: str
) -> SpeedOfTrain:
    """Train from a first speed, with the load coefficient that gives it a wanted mean speed."""
    coefficient = steady.load_coefficient
    for _ in range(60):  # Largest number of steps of the search
        followed = _solved(follow_train(train, steady.start_speed, coefficient), "the train", name)
        step = (wanted - _mean(followed.speed)) / _mean(followed.by_coefficient)
        coefficient += step
        # Relative change of the load coefficient at which its search ends
        if abs(step) <= 1e-12 * abs(coefficient):
            break
    return followed


def _mean(values: Floats) -> float:
    """Mean over the angle, by trapezia."""
    return float(np.mean(0.5 * (values[1:] + values[:-1])))


def _means(speed: Floats, count: int) -> Floats:
    """Mean over the angle of each cycle."""
    return np.asarray((0.5 * (speed[1:] + speed[:-1])).reshape(count, -1).mean(axis=1))


# --- fit to the measured speed --------------------------------------------------------------------


def _fitted(
    given: Measured, train: TorqueTrain, engine: OneEngine, steady: SpeedOfTrain,
    first: int, name: str,
) -> _Fit:  # fmt: skip
    """First speed and load coefficient from the speed of [measured]."""
    where = f"{name}: [measured]"
    if len(given.files) > 1:
        raise SceneError(
            f"{where} file: {len(given.files)} files; must be the one file recorded together with "
            "the pressure"
        )
    period = engine.period
    (record,) = records_of(given, period, name)
    row = cycles_in_a_row(
        record, given, steady.angle[:-1] - 0.5 * period, steady.speed[:-1], period,
        engine.symmetry, where,
    )  # fmt: skip
    unit = period if row.turn_known else TURN
    most = round(MOST_APART * period / unit)
    tried = []
    for shift in unit * np.arange(-most, most + 1):
        begin = row.start + 0.5 * period + shift - (first - 1) * period
        fit = _fit_from(train, row, begin, period)
        if fit is not None:
            tried.append((*fit, begin))
    if not tried:
        raise SceneError(
            f"{where} {record.label}: {len(row.speed)} whole cycles of speed; must be at least "
            f"{FEWEST} together with the recorded pressure"
        )
    tried.sort(key=lambda one: one[0])
    own, rms, followed, begin = tried[0]
    if not math.isfinite(own):
        raise SceneError(
            f"{where} {record.label}: no initial speed and load coefficient fit the measured "
            "speed; check that it was recorded on this engine, and check inertia and pressure"
        )
    cycle = math.floor(begin / period + 1e-9)
    count, intervals = round(train.angle[-1] / period), row.width.size
    raw = np.full((count, intervals), np.nan)
    here = np.arange(len(row.speed)) + cycle
    inside = (here >= 0) & (here < count)
    raw[here[inside]] = np.where(row.used, row.speed, np.nan)[inside]
    middle = begin - cycle * period - 0.5 * period + np.cumsum(row.width) - 0.5 * row.width
    said = {
        "recording": f"{record.label} sha256 {record.sha256}",
        "rms_difference": rms,
        "rms_difference_of_cycles": own,
        "cycles_of_speed": len(row.speed),
        "first_cycle_of_speed": first + cycle,
        "start_of_speed_from": f"{row.start_from}; the cycle by the least rms_difference_of_cycles",
        "remarks": "\n".join(f"{record.label}: {line}" for line in record.remarks),
    }
    if len(tried) > 1 and math.isfinite(tried[1][0]):
        said["rms_difference_of_cycles_next"] = tried[1][0]
    means = _cycle_means(row, begin, count, period)
    measured = (
        "initial speed and load coefficient fitted by least squares to the measured speeds between "
        "teeth"
    )
    return _Fit(followed, measured, middle, raw, means, said)


def _fit_from(
    train: TorqueTrain, row: CyclesInARow, begin: float, period: float
) -> tuple[float, float, SpeedOfTrain] | None:
    """Fit to a recording that begins at an angle of the train, and its relative rms differences."""
    # The first of the two differences is of what changes from cycle to cycle: errors of teeth and
    # of the model repeat, and do not tell where the recording begins. The second is of everything.
    # Both are inf where no fit exists; the result is None where too little of the recording lies
    # within the series of cycles.
    edges = begin + np.concatenate([[0.0], np.cumsum(np.tile(row.width, len(row.speed)))])
    speed = np.where(row.used, row.speed, np.nan).ravel()
    inside = np.flatnonzero((edges >= 0.0) & (edges <= train.angle[-1]))
    if not inside.size:
        return None
    edges, speed = edges[inside], speed[inside[:-1]]
    known = np.isfinite(speed)
    if float(np.diff(edges)[known].sum()) < (FEWEST - 0.5) * period:
        return None
    followed = fit_train(train, edges, speed)
    if followed.status != status.CONVERGED:
        return math.inf, math.inf, followed
    slow = 0.5 * train.step * (1.0 / followed.speed[1:] + 1.0 / followed.speed[:-1])
    time = np.interp(edges, train.angle, np.concatenate([[0.0], np.cumsum(slow)]))
    off = np.full(row.speed.size, np.nan)
    off[inside[:-1]] = np.diff(edges) / np.diff(time) - speed
    off /= speed[known].mean()
    each = off.reshape(row.speed.shape)
    with np.errstate(invalid="ignore"):
        count = np.isfinite(each).sum(axis=0)
        usual = np.nansum(each, axis=0) / np.where(count, count, 1)
    own = each - usual
    # The deviations of few cycles from their mean are too small: their squares are divided by the
    # degrees of freedom
    freedom = max(int((count - 1).clip(min=0).sum()), 1)
    return float(np.sqrt(np.nansum(own**2) / freedom)), float(np.sqrt(np.nanmean(off**2))), followed


def _cycle_means(row: CyclesInARow, begin: float, count: int, period: float) -> Floats:
    """Measured mean over the angle of each cycle of the train; NaN where some of it is missing."""
    width = np.tile(row.width, len(row.speed))
    edges = begin + np.concatenate([[0.0], np.cumsum(width)])
    speed = row.speed.ravel()
    parts = np.nan_to_num(speed) * width, np.isnan(speed) * width
    at = period * np.arange(count + 1)
    whole, lost = (
        np.diff(np.interp(at, edges, np.concatenate([[0.0], np.cumsum(part)]))) for part in parts
    )
    covered = (at[:-1] >= edges[0] - 1e-9) & (at[1:] <= edges[-1] + 1e-9) & (lost < 1e-9)
    return np.where(covered, whole / period, np.nan)


# --- labels ---------------------------------------------------------------------------------------


def _dataset(
    scene: Scene, numbers: list[int], repeated: xr.Dataset, fit: _Fit, closed: SpeedOfTrain,
    cylinders: int,
) -> xr.Dataset:  # fmt: skip
    """Results with labels and units."""
    count, followed = len(numbers), fit.speed
    along, each, none = ("recorded_cycle", "crank_angle"), ("recorded_cycle",), ()
    rad, one, pairs = "rad s-1", "1", {"followed": followed, "closed": closed}
    texts = {"followed": "cycles in sequence", "closed": "train repeated periodically"}
    coefficient = repeated["load_coefficient"].attrs.get("units")
    data: dict[str, Any] = {}
    for word, speed in pairs.items():
        text = texts[word]
        curve, delta = _of_cycles(speed.speed, count)
        data[f"omega_{word}"] = (along, curve, rad, f"crank speed, {text}")
        data[f"delta_{word}"] = (each, delta, one, f"coefficient of speed fluctuation, {text}")
        data[f"omega_mean_{word}"] = (each, _means(speed.speed, count), rad,
                                      f"mean speed over the angle, {text}")  # fmt: skip
        data[f"start_speed_{word}"] = (none, speed.start_speed, rad, f"initial speed, {text}")
        data[f"load_coefficient_{word}"] = (none, speed.load_coefficient, coefficient,
                                            f"coefficient of the load torque, {text}")  # fmt: skip
    forever = "each cycle repeated periodically"
    data |= {
        "omega_repeated": (along, repeated["omega"].transpose(*along).values, rad,
                           f"crank speed, {forever}"),
        "delta_repeated": (each, repeated["delta"].values, one,
                           f"coefficient of speed fluctuation, {forever}"),
        "imep": (each, repeated["imep"].values, "bar", "indicated mean effective pressure"),
        "jump": (none, closed.start_speed - followed.start_speed, rad,
                 "jump of the initial speed when the train is repeated periodically"),
        "memory": (none, followed.memory, one,
                   "share of a small change of the initial energy that is left at the end"),
        "memory_of_a_cycle": (none, followed.memory ** (1.0 / count), one,
                              "share of a small change of energy that is left after one cycle, "
                              "mean of all cycles"),
    }  # fmt: skip
    coordinates: dict[str, Any] = {
        "recorded_cycle": (each, np.array(numbers, dtype=np.int32), one,
                           "number of the recorded cycle"),
        "crank_angle": (("crank_angle",), repeated["crank_angle"].values,
                        dict(repeated["crank_angle"].attrs)),
    }  # fmt: skip
    said: dict[str, Any] = {}
    if fit.raw is not None and fit.middle is not None:
        data["omega_raw"] = (("recorded_cycle", "interval"), fit.raw, rad,
                             "raw speed between teeth, measured")  # fmt: skip
        data["omega_mean_measured"] = (each, fit.means, rad, "mean speed over the angle, measured")
        coordinates["interval"] = (
            ("interval",), fit.middle / DEGREE, "degree",
            "crank angle in the middle of the interval between teeth, which may lie in the next "
            "cycle",
        )  # fmt: skip
        said |= fit.said or {}
    alone = "pressure recorded in cylinder 1"
    pressures = (
        "pressure recorded in cylinder 1; the other cylinders have the same cycles at their own "
        "firing angles"
    )
    attributes = {
        **repeated.attrs,
        "title": scene.title,
        "first_speed_and_load_from": fit.how,
        "pressures_of_cylinders": pressures if cylinders > 1 else alone,
        "friction_torque": float(repeated["friction_torque"].mean()),
        **said,
    }
    return labelled_dataset(data, coordinates, attributes, float)


def _of_cycles(speed: Floats, count: int) -> tuple[Floats, Floats]:
    """Speed of each cycle without its end point, and the delta of each."""
    curve = speed[:-1].reshape(count, -1)
    ends = np.append(curve[1:, 0], speed[-1])
    high, low = np.maximum(curve.max(axis=1), ends), np.minimum(curve.min(axis=1), ends)
    return curve, (high - low) / _means(speed, count)
