"""Parameters of an engine from its measured speed, and what the speed does not tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.recordings.measured_speed import cycles_of_turns, find_gap_angle, fluctuation
from engine_dyn.recordings.tooth_errors import sound_intervals, speed_through_wheel
from engine_dyn.recordings.wheel import TURN, Wheel
from engine_dyn.types import Booleans, Floats
from engine_dyn.units import DEGREE, RPM
from sweeps.dimensions import DESIGN
from sweeps.errors import SceneError
from sweeps.measuring.computed_speeds import OF_DIAGRAM, OF_WHEEL, SpeedsOfRecordings
from sweeps.measuring.measured_files import records_of
from sweeps.measuring.speed_fit import (
    LARGEST_CONDITION,
    FittedSpeeds,
    Loss,
    MeasuredCycles,
    Parameter,
    fit_speeds,
)
from sweeps.scene.model import Scene
from sweeps.scene.reading import read_scene

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Varied", "identify"]

NO_SPEED = 1.0
"""Size of the logarithms that stand for a design without an answer: a fit steps back from it."""

LARGE_SHARE = 0.1
"""Of a parameter's first value: a large change of it."""


@dataclass(frozen=True)
class Varied:
    """How a parameter is fitted, in the units of scenes.

    Attributes
    ----------
    low, high : float, optional
        Bounds; those of the parameter itself unless given.
    start : float, optional
        First value; that of the scene unless given.
    prior, deviation : float, optional
        What is known of it without the speed: a value and its standard deviation.
    own : bool
        Whether each recording has a value of its own.
    """

    low: float | None = None
    high: float | None = None
    start: float | None = None
    prior: float | None = None
    deviation: float | None = None
    own: bool = False


def identify(
    scene: str | Path | Mapping[str, Any] | Scene,
    vary: Sequence[str] | Mapping[str, Varied],
    *,
    teeth: str = "estimated",
    tooth_deviation: float | None = None,
    loss: Loss = "linear",
    predict: bool = True,
    largest_condition: float = LARGEST_CONDITION,
) -> xr.Dataset:
    """Fit parameters of a scene to its measured speeds.

    Parameters
    ----------
    scene : str, Path, dict or Scene
        A scene with the table [measured], see docs/measured_speed.md, of kind "teeth" or "encoder".
        Its speeds are replaced by the measured ones.
    vary : sequence of str, or dict of Varied
        What is fitted: parameters of scenes (``inertia``, ``load_exponent``, ...), and
        ``dead_centre_shift`` [degree], ``pegging`` [bar], ``pressure_factor`` [1] of the diagrams,
        ``gap_angle`` [degree] of the wheel.
    teeth : str
        "estimated": errors of the teeth are fitted too; "perfect": there are none.
    tooth_deviation : float, optional
        Standard deviation of the relative errors of intervals, where it is known.
    loss : str
        "linear" (least squares), "soft_l1" or "huber".
    predict : bool
        Fit once more without each recording in turn, and predict it.
    largest_condition : float
        Above this condition number the fit is refused.

    Returns
    -------
    xarray.Dataset
        Over `parameter`: value, interval of 95 % (`value_low`, `value_high`), standard deviation,
        correlations. Over `recording` and `interval`: measured and computed speed as the wheel
        shows it, residuals in standard errors. Over `recording`: raw delta measured with its
        scatter, computed, and predicted from the other recordings with its standard deviation.
        Attributes: condition number, reduced chi square, likelihood of noise.

    Raises
    ------
    SceneError
        One line: no recordings of teeth, unknown parameters, parameters that the speed cannot tell
        apart (docs/identification.md says which these are), a start without a steady speed.
    """
    given = read_scene(scene)
    wanted = dict(vary) if isinstance(vary, Mapping) else {key: Varied() for key in vary}
    task = _Task.of(given, wanted, teeth)
    try:
        fit = task.fit(range(task.count), tooth_deviation, loss, largest_condition)
        predicted = [
            task.predicted(one, tooth_deviation, loss, largest_condition)
            for one in range(task.count)
            if predict and task.count > 1
        ]
    except SceneError:
        raise
    except ValueError as error:
        raise SceneError(f"{task.name}: {error}") from None
    return _dataset(task, fit, predicted)


@dataclass(frozen=True, eq=False)
class _Task:
    """Recordings, and the designs that they belong to."""

    name: str
    scene: Scene
    places: list[dict[str, float]]
    wheel: Wheel
    period: float
    labels: tuple[str, ...]
    cycles: list[Floats]
    vary: dict[str, Varied]
    fitted_teeth: bool
    sound: Booleans

    @property
    def used(self) -> Booleans:
        """Intervals of a cycle whose teeth are where a sensor sees them."""
        return np.tile(self.sound, self.turns)

    @property
    def count(self) -> int:
        return len(self.cycles)

    @property
    def turns(self) -> int:
        return round(self.period / TURN)

    @classmethod
    def of(cls, scene: Scene, vary: dict[str, Varied], teeth: str) -> _Task:
        """Read the recordings."""
        name = str(scene.path or "scene")
        if teeth not in ("estimated", "perfect"):
            raise SceneError(f"teeth = {teeth!r}: must be 'estimated' or 'perfect'")
        if scene.measured is None:
            raise SceneError(f"{name}: [measured] is missing; docs/measured_speed.md describes it")
        if scene.measured.wheel is None:
            raise SceneError(f"{name}: [measured] kind: must be 'teeth' or 'encoder' for a fit")
        if not vary:
            raise SceneError(f"{name}: nothing to vary; name at least one parameter")
        period = float(scene.engine.period)
        records = records_of(scene.measured, period, name)
        try:
            cycles = [
                cycles_of_turns(record.teeth, round(period / TURN))
                for record in records
                if record.teeth is not None
            ]
        except ValueError as error:
            raise SceneError(f"{name}: [measured] {error}") from None
        wheel = scene.measured.wheel
        sound = sound_intervals(np.array([one.mean(axis=0) for one in cycles]), wheel)
        places = []
        for number, speeds in enumerate(cycles):
            place = _values_of(scene, number, len(cycles), name)
            width = np.tile(wheel.width, round(period / TURN))
            time = np.mean(np.sum(width / speeds, axis=1))
            places.append({**place, "speed": float(period / time / RPM)})
        return cls(
            name, scene, places, wheel, period, scene.measured.files, cycles, vary,
            teeth == "estimated", sound,
        )  # fmt: skip

    def keys(self, recordings: Sequence[int]) -> list[str]:
        """What varies in a fit to some of the recordings; their numbers are those of the fit."""
        return [
            key
            for plain, how in self.vary.items()
            for key in (
                [f"{plain}@{i + 1}" for i in range(len(recordings))] if how.own else [plain]
            )
        ]

    def speeds(self, recordings: Sequence[int]) -> SpeedsOfRecordings:
        """Computed speeds of some of the recordings."""
        return SpeedsOfRecordings.of(
            self.scene, [self.places[i] for i in recordings], self.keys(recordings)
        )

    def fit(
        self, recordings: Sequence[int], tooth_deviation: float | None, loss: Loss, largest: float
    ) -> _Fit:
        """Fit to some of the recordings."""
        computed = self.speeds(recordings)
        width = np.tile(self.wheel.width, self.turns)
        cycles = [
            MeasuredCycles(self.labels[i], self.cycles[i], width, self.used) for i in recordings
        ]
        start = np.array([[self._start(key, computed) for key in computed.keys]])
        for key, one in zip(computed.keys, start[0], strict=True):
            if not np.isfinite(one):
                raise ValueError(f"{key}: has no value to start from; give it one in [set]")
        angle, speed = computed.speeds(start, first=True)
        if not np.isfinite(speed).all():
            bad = int(np.flatnonzero(~np.isfinite(speed[0]).all(axis=1))[0])
            raise ValueError(
                f"{self.labels[recordings[bad]]}: no steady speed at the first values; give others"
            )
        raw = np.array([self.cycles[i].mean(axis=0) for i in recordings])
        assert self.scene.measured is not None
        known = self.scene.measured.table.gap_angle
        found = find_gap_angle(
            raw,
            angle,
            speed[0],
            self.wheel,
            self.period,
            None if known is None else known * DEGREE,
            self.sound,
        )
        starts = np.asarray(found.angle + TURN * found.turn, dtype=np.float64)
        seen = _Seen(computed, self.wheel, self.period, starts)
        parameters = [
            self._parameter(key, float(value), found.angle / DEGREE)
            for key, value in zip(computed.keys, start[0], strict=True)
        ]
        fit = fit_speeds(
            seen, parameters, cycles, teeth=self.wheel.teeth if self.fitted_teeth else 0,
            tooth_prior=tooth_deviation, loss=loss, largest_condition=largest,
        )  # fmt: skip
        return _Fit(fit, seen, tuple(recordings), found.angle)

    def _start(self, key: str, computed: SpeedsOfRecordings) -> float:
        how = self.vary[key.partition("@")[0]]
        if how.start is not None:
            return how.start
        return how.prior if how.prior is not None else computed.start(key)

    def _parameter(self, key: str, start: float, gap_angle: float) -> Parameter:
        plain = key.partition("@")[0]
        how = self.vary[plain]
        low, high, scale = -np.inf, np.inf, LARGE_SHARE * abs(start)
        if plain in PARAMETERS:
            node = PARAMETERS[plain]
            low = -np.inf if node.low is None else node.low
            high = np.inf if node.high is None else node.high
            scale = scale or 1.0
        else:
            scale = (OF_DIAGRAM | OF_WHEEL)[plain][1]
        low = low if how.low is None else how.low
        high = high if how.high is None else how.high
        prior, deviation = how.prior, how.deviation
        if plain in OF_WHEEL:  # counted from where the speeds are most alike
            prior = None if prior is None else prior - gap_angle
            low, high, start = low - gap_angle, high - gap_angle, 0.0
        return Parameter(key, start, low, high, prior, deviation, scale)

    def predicted(
        self, held_out: int, tooth_deviation: float | None, loss: Loss, largest: float
    ) -> tuple[float, float, Floats]:
        """Raw delta of a recording, its standard deviation, and the logarithms of its speed.

        Nothing of the recording enters but its mean speed and which of the turns fires.
        """
        rest = [i for i in range(self.count) if i != held_out]
        found = self.fit(rest, tooth_deviation, loss, largest)
        shared = [i for i, key in enumerate(found.seen.computed.keys) if "@" not in key]
        keys = [found.seen.computed.keys[i] for i in shared]
        computed = SpeedsOfRecordings.of(self.scene, [self.places[held_out]], keys)
        value = found.fit.value[shared]
        angle, speed = computed.speeds(value[None])
        raw = self.cycles[held_out].mean(axis=0)[None]
        turn = find_gap_angle(
            raw, angle, speed[0], self.wheel, self.period, found.gap_angle, self.sound
        ).turn
        starts = np.asarray(found.gap_angle + TURN * turn, dtype=np.float64)
        seen = _Seen(computed, self.wheel, self.period, starts)
        errors = np.tile(found.fit.tooth_error, self.turns) if self.fitted_teeth else 0.0
        logs = seen(value[None])[0][0][self.used] + errors
        step = 0.1 * found.fit.deviation[shared]
        step = np.where(step > 0.0, step, 1e-3 * np.maximum(np.abs(value), 1e-3))  # at bounds
        batch = value + np.diag(step)
        slopes = (seen(batch)[0][:, self.used] + errors - logs) / step[:, None]
        teeth = np.tile(np.eye(int(self.sound.sum())), (1, self.turns))
        if not self.fitted_teeth:
            teeth = teeth[:0]
        top, bottom = int(np.argmax(logs)), int(np.argmin(logs))
        rise = np.vstack([slopes, teeth])
        rise = rise[:, top] - rise[:, bottom]
        count = len(found.fit.parameters)
        picked = [*shared, *range(count, len(found.fit.covariance_with_teeth))]
        covariance = found.fit.covariance_with_teeth[np.ix_(picked, picked)]
        speeds = np.exp(logs)
        delta = float(np.ptp(speeds) / speeds.mean())
        return delta, float(np.sqrt(rise @ covariance @ rise)), logs


@dataclass(frozen=True, eq=False)
class _Fit:
    fit: FittedSpeeds
    seen: _Seen
    recordings: tuple[int, ...]
    gap_angle: float


@dataclass(frozen=True, eq=False)
class _Seen:
    """Logarithms of computed speeds as perfect teeth show them, in the order of the recordings."""

    computed: SpeedsOfRecordings
    wheel: Wheel
    period: float
    starts: Floats

    def __call__(self, values: Floats) -> list[Floats]:
        angle, speed = self.computed.speeds(values)
        shifts = np.zeros(len(values))
        for place, key in enumerate(self.computed.keys):
            if key in OF_WHEEL:
                shifts = values[:, place] * DEGREE
        found = []
        for number, start in enumerate(self.starts):
            rows = np.full((len(values), round(self.period / TURN) * self.wheel.teeth), NO_SPEED)
            rows[:, ::2] *= -1.0
            for shift in np.unique(shifts):
                here = (shifts == shift) & np.isfinite(speed[:, number]).all(axis=1)
                rows[here] = np.log(
                    speed_through_wheel(
                        angle, speed[here, number], self.wheel, float(start + shift), self.period
                    )
                )
            found.append(rows)
        return found


def _values_of(scene: Scene, number: int, count: int, name: str) -> dict[str, float]:
    """Values of all that varies in a scene for one recording."""
    assert scene.measured is not None
    at = scene.measured.at
    found = {}
    for key, values in scene.axes.items():
        if isinstance(values, tuple) or key not in PARAMETERS:
            continue
        if key in at:
            found[key] = float(at[key][number])
        elif len(values) == 1:
            found[key] = float(values[0])
        elif key != "speed":  # the measured one
            raise SceneError(
                f"{name}: [measured] at: the scene also varies {key}; must say which value belongs "
                "to each file"
            )
    if scene.designs:
        rows = at.get(DESIGN)
        if rows is None and len(next(iter(scene.designs.values()))) != 1:
            raise SceneError(f"{name}: [measured] at: must say which design belongs to each file")
        row = 0 if rows is None else int(rows[number])
        found |= {key: float(column[row]) for key, column in scene.designs.items()}
    return found


def _dataset(
    task: _Task, found: _Fit, predicted: Sequence[tuple[float, float, Floats]]
) -> xr.Dataset:
    """Labels and units."""
    import xarray as xr

    fit, count = found.fit, task.count
    errors = np.where(task.sound, 0.0, np.nan)
    if task.fitted_teeth:
        errors[task.sound] = fit.tooth_error
    deviations = np.full(errors.size, np.nan)
    deviations[task.sound] = fit.tooth_deviation if task.fitted_teeth else 0.0
    logs = np.array([one[0] for one in found.seen(fit.value[None])]) + np.tile(errors, task.turns)
    width = np.tile(task.wheel.width, task.turns)
    raw = np.array([one.mean(axis=0) for one in task.cycles])
    share = np.where(task.used, width, 0.0)
    level = np.nan_to_num(np.log(raw) - logs) @ share / share.sum()
    computed = np.exp(logs + level[:, None])
    counted = computed[:, task.used]
    deltas = [fluctuation(one[:, task.used]) for one in task.cycles]
    middle = np.concatenate([[0.0], np.cumsum(width)[:-1]]) + 0.5 * width + 0.5 * task.period
    middles = (found.seen.starts[:, None] + middle) % task.period - 0.5 * task.period
    order = np.argsort(middles, axis=1)
    raw, computed, residual = (
        np.take_along_axis(rows, order, axis=1) for rows in (raw, computed, np.array(fit.residual))
    )
    added = np.array([found.gap_angle / DEGREE if p.name in OF_WHEEL else 0.0
                      for p in fit.parameters])  # fmt: skip
    recording, over, of = ("recording",), ("recording", "interval"), ("parameter",)
    data: dict[str, Any] = {
        "value": (of, fit.value + added, "fitted value, in the unit of each"),
        "value_low": (of, fit.interval[:, 0] + added, "lower end of the 95 % interval"),
        "value_high": (of, fit.interval[:, 1] + added, "upper end of the 95 % interval"),
        "value_deviation": (of, fit.deviation, "standard deviation of the value"),
        "correlation": (("parameter", "other_parameter"), fit.correlation, "of fitted values"),
        "residual": (over, residual, "measured less computed, in standard errors"),
        "omega_raw": (over, raw, "raw speed between teeth, mean over cycles"),
        "omega_through_wheel": (over, computed, "fitted speed as the wheel shows it"),
        "delta_measured_raw": (recording, [d.delta for d in deltas],
                               "coefficient of speed fluctuation, measured, tooth errors in it"),
        "delta_measured_raw_uncertainty": (recording, [d.uncertainty for d in deltas],
                                           "standard error of delta_measured_raw"),
        "delta_through_wheel": (recording, np.ptp(counted, axis=1) / counted.mean(axis=1),
                                "coefficient of speed fluctuation, fitted, through the wheel"),
    }  # fmt: skip
    if task.fitted_teeth:
        data["tooth_error"] = (("tooth",), np.expm1(-errors),
                               "relative error of the wheel's interval")  # fmt: skip
        data["tooth_error_deviation"] = (("tooth",), deviations,
                                         "standard deviation of tooth_error")  # fmt: skip
    if predicted:
        data["delta_predicted"] = (recording, [one[0] for one in predicted],
                                   "raw delta predicted from the other recordings")  # fmt: skip
        data["delta_predicted_deviation"] = (recording, [one[1] for one in predicted],
                                             "standard deviation of delta_predicted")  # fmt: skip
    units = {"omega_raw": "rad s-1", "omega_through_wheel": "rad s-1"}
    names = np.array([p.name for p in fit.parameters], dtype=object)
    return xr.Dataset(
        {
            key: xr.Variable(
                dims, np.asarray(values), {"long_name": text, "units": units.get(key, "1")}
            )
            for key, (dims, values, text) in data.items()
        },
        coords={
            "parameter": ("parameter", names, {"long_name": "fitted parameter"}),
            "unit": ("parameter", np.array([_unit(n) for n in names], dtype=object),
                     {"long_name": "unit of the fitted parameter"}),
            "other_parameter": ("other_parameter", names, {"long_name": "fitted parameter"}),
            "recording": ("recording", np.arange(count, dtype=np.int32),
                          {"long_name": "number of the recording", "units": "1"}),
            "interval": ("interval", middles[0][order[0]] / DEGREE,
                         {"long_name": "crank angle in the middle of the interval between teeth",
                          "units": "degree"}),
            "interval_width": ("interval", width[order[0]] / DEGREE,
                               {"long_name": "width of the interval between teeth",
                                "units": "degree"}),
            "file": ("recording", np.array(task.labels, dtype=object),
                     {"long_name": "recording"}),
            "speed": ("recording", [place["speed"] for place in task.places],
                      {"long_name": "measured mean speed", "units": "rpm"}),
        },
        attrs={
            "title": task.scene.title,
            "condition_number": fit.condition,
            "reduced_chi_square": fit.reduced_chi_square,
            "likelihood_of_noise": fit.likelihood_of_noise,
            "teeth": "estimated" if task.fitted_teeth else "perfect",
            "wheel": task.wheel.text,
            "gap_angle": found.gap_angle / DEGREE,
        },
    )  # fmt: skip


def _unit(name: str) -> str:
    plain = name.partition("@")[0]
    return PARAMETERS[plain].unit if plain in PARAMETERS else (OF_DIAGRAM | OF_WHEEL)[plain][2]
