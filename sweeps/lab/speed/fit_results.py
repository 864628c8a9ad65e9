"""A fit to measured speeds as a labelled dataset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.recordings.measured_speed import fluctuation
from engine_dyn.recordings.tooth_errors import speed_through_wheel
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE, RPM
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import SceneError
from sweeps.base.naming import named
from sweeps.lab.speed.computed_speeds import (
    NOT_OF_SCENES,
    OF_RECORDING,
    OF_WHEEL,
    SpeedsOfRecordings,
)
from sweeps.lab.speed.labelled import labelled_dataset, of_intervals, of_recordings
from sweeps.lab.speed.recorded_speeds import RecordedSpeeds, recorded_speeds
from sweeps.lab.speed.speed_fit import LEAST_LIKELIHOOD, FittedSpeeds
from sweeps.scene.model import Scene

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class SpeedFit:
    """A fit to some recordings."""

    # Fitted values and their uncertainty; a fitted gap angle counts from that of `seen`.
    fit: FittedSpeeds
    seen: Seen  # Computed speeds as the wheel of the recordings shows them
    with_teeth: bool  # Whether errors of the teeth were fitted

    @property
    def tooth_errors(self) -> Floats:
        """Logarithms that each interval of a cycle shows too much; 0 where none are known."""
        given = self.seen.recordings
        if not self.with_teeth:
            return np.zeros(given.width.size)
        errors = np.zeros(given.sound.size)
        errors[given.sound] = self.fit.tooth_error
        return np.tile(errors, given.turns)

    @property
    def added(self) -> Floats:
        """Addends that turn fitted values into those that are told, shape (P,)."""
        gap = self.seen.gap_angle or 0.0
        return np.array([gap / DEGREE if p.name in OF_WHEEL else 0.0 for p in self.fit.parameters])


@dataclass(frozen=True, eq=False)
class Prediction:
    """Prediction of one recording by a fit to the others."""

    # Predicted delta of the raw speed between the teeth, and its standard deviation.
    delta: float
    deviation: float
    # Logarithms of the raw speed between the teeth; NaN for intervals that the fit leaves out;
    # shape (intervals,)
    logs: Floats


def fit_dataset(
    about: Mapping[str, Any], speed_fit: SpeedFit, predicted: Sequence[Prediction]
) -> xr.Dataset:
    """Labels and units of a fit to all recordings; `about` has attributes of computed results."""
    fit, given = speed_fit.fit, speed_fit.seen.recordings
    names = np.array([p.name for p in fit.parameters], dtype=object)
    middles = given.middles(speed_fit.seen.starts)
    data = _of_parameters(speed_fit) | _of_speeds(speed_fit, middles) | _of_teeth(speed_fit)
    if predicted:
        data |= _of_predictions(given, predicted, middles)
    order = np.argsort(middles[0])
    coordinates: dict[str, Any] = {
        "parameter": ("parameter", names, {"long_name": "fitted parameter"}),
        "unit": ("parameter", np.array([_unit(n) for n in names], dtype=object),
                 {"long_name": "unit of the fitted parameter"}),
        "other_parameter": ("other_parameter", names, {"long_name": "fitted parameter"}),
        **of_recordings(given.labels),
        **of_intervals(
            middles[0][order], given.width[order], given.used[order], "in the fit"
        ),
    }  # fmt: skip
    coordinates |= {
        key: ("recording", [place[key] for place in given.places], _attributes_of(key))
        for key in given.places[0]
        if key != "speed"
    }
    coordinates["speed"] = ("recording", [place["speed"] for place in given.places],
                            {"long_name": "measured mean speed", "units": "rpm"})  # fmt: skip
    if speed_fit.with_teeth:
        numbers = np.arange(1, given.sound.size + 1, dtype=np.int32)
        coordinates["tooth"] = ("tooth", numbers, "1", "tooth after the gap")
    attributes = {
        **about,
        "condition_number": fit.condition,
        "reduced_chi_square": fit.reduced_chi_square,
        "likelihood_of_noise": fit.likelihood_of_noise,
        "least_likelihood": LEAST_LIKELIHOOD,
        "recordings": given.listed,
        "remarks": "\n".join(given.remarks),
    }
    if given.wheel is not None and speed_fit.seen.gap_angle is not None:
        attributes |= {
            "teeth": "estimated" if speed_fit.with_teeth else "perfect",
            "wheel": given.wheel.text,
            "gap_angle": speed_fit.seen.gap_angle / DEGREE,
        }
    labelled = {
        key: (dims, values, "rad s-1" if key.startswith("omega_") else "1", text)
        for key, (dims, values, text) in data.items()
    }
    return labelled_dataset(labelled, coordinates, attributes)


def _of_parameters(speed_fit: SpeedFit) -> dict[str, Any]:
    """Fitted values, their intervals, and the priors."""
    fit, of, added = speed_fit.fit, ("parameter",), speed_fit.added

    def known(values: Sequence[float | None]) -> Floats:
        return np.array([np.nan if value is None else value for value in values])

    prior = known([p.prior for p in fit.parameters]) + added
    return {
        "value": (of, fit.value + added, "fitted value, each in its own unit"),
        "value_low": (of, fit.interval[:, 0] + added, "lower end of the 95 % interval"),
        "value_high": (of, fit.interval[:, 1] + added, "upper end of the 95 % interval"),
        "at_bound": (of, fit.at_bound.astype(np.int8), "whether the value is at its bound (1)"),
        "value_deviation": (of, fit.deviation, "standard deviation of the value"),
        "prior": (of, prior, "prior value, known without the speed"),
        "prior_deviation": (of, known([p.prior_deviation for p in fit.parameters]),
                            "standard deviation of prior"),
        "correlation": (("parameter", "other_parameter"), fit.correlation, "of fitted values"),
    }  # fmt: skip


def _of_speeds(speed_fit: SpeedFit, middles: Floats) -> dict[str, Any]:
    """Measured and fitted speeds in the order of the angle, and their delta."""
    fit, given = speed_fit.fit, speed_fit.seen.recordings
    logs = np.array([one[0] for one in speed_fit.seen(fit.value[None])]) + speed_fit.tooth_errors
    raw = given.raw
    spread = np.array([_deviation_over_cycles(one) for one in given.cycles])
    computed = _at_measured_level(given, logs)
    counted = computed[:, given.used]
    deltas = [fluctuation(one[:, given.used]) for one in given.cycles]
    order = np.argsort(middles, axis=1)
    raw, spread, computed, residual = (
        np.take_along_axis(rows, order, axis=1)
        for rows in (raw, spread, computed, np.array(fit.residual))
    )
    recording, over = ("recording",), ("recording", "interval")
    return {
        "residual": (over, residual, "measured less computed, in standard errors"),
        "omega_raw": (over, raw, "raw speed between teeth, mean over cycles"),
        "omega_raw_std": (over, spread, "standard deviation of omega_raw over cycles"),
        "omega_through_wheel": (over, computed, "fitted speed as seen through the wheel"),
        "recorded_cycles": (recording, np.array([len(one) for one in given.cycles], dtype=np.int32),
                            "number of recorded cycles"),
        "delta_measured_raw": (recording, [d.delta for d in deltas],
                               "coefficient of speed fluctuation, measured, including tooth "
                               "errors"),
        "delta_measured_raw_uncertainty": (recording, [d.uncertainty for d in deltas],
                                           "standard error of delta_measured_raw"),
        "delta_through_wheel": (recording, np.ptp(counted, axis=1) / counted.mean(axis=1),
                                "coefficient of speed fluctuation, fitted, through the wheel"),
    }  # fmt: skip


def _of_predictions(
    given: FittedRecordings, predicted: Sequence[Prediction], middles: Floats
) -> dict[str, Any]:
    """Each recording as the others predict it, at its measured mean speed."""
    computed = _at_measured_level(given, np.array([one.logs for one in predicted]))
    speed = np.take_along_axis(computed, np.argsort(middles, axis=1), axis=1)
    recording = ("recording",)
    return {
        "delta_predicted": (recording, [one.delta for one in predicted],
                            "raw delta predicted from the other recordings"),
        "delta_predicted_deviation": (recording, [one.deviation for one in predicted],
                                      "standard deviation of delta_predicted"),
        "omega_predicted": (("recording", "interval"), speed,
                            "speed as seen through the wheel, predicted from the other recordings"),
    }  # fmt: skip


def _at_measured_level(given: FittedRecordings, logs: Floats) -> Floats:
    """Speeds [rad/s] from logarithms, with the measured mean over the used angle."""
    share = np.where(given.used, given.width, 0.0)
    level = np.nan_to_num(np.log(given.raw) - logs) @ share / share.sum()
    return np.exp(logs + level[:, None])


def _deviation_over_cycles(cycles: Floats) -> Floats:
    """Standard deviation over cycles, each of them scaled to the mean speed [rad/s]."""
    level = cycles.mean(axis=1, keepdims=True)
    return np.asarray((cycles / level).std(axis=0, ddof=1) * level.mean())


def _of_teeth(speed_fit: SpeedFit) -> dict[str, Any]:
    """Errors of the wheel's intervals."""
    if not speed_fit.with_teeth:
        return {}
    sound = speed_fit.seen.recordings.sound
    errors, deviations = np.full(sound.size, np.nan), np.full(sound.size, np.nan)
    errors[sound], deviations[sound] = speed_fit.fit.tooth_error, speed_fit.fit.tooth_deviation
    return {
        "tooth_error": (("tooth",), np.expm1(-errors), "relative error of the wheel's interval"),
        "tooth_error_deviation": (("tooth",), deviations, "standard deviation of tooth_error"),
    }


def _attributes_of(key: str) -> dict[str, str]:
    """Attributes of a value that the scene gives to each recording."""
    node = PARAMETERS[key]
    return {
        **named(key, node.long_name, node.unit),
        "units": node.unit,
        "symbol": f"${node.symbol}$",
    }


def _unit(name: str) -> str:
    plain = name.partition("@")[0]
    return PARAMETERS[plain].unit if plain in PARAMETERS else NOT_OF_SCENES[plain][2]


MOST_SAMPLES = 720
"""Largest number of samples of a cycle of speed over angle that a fit takes: a degree of a
four-stroke engine."""


@dataclass(frozen=True, eq=False)
class FittedRecordings(RecordedSpeeds):
    """Recordings that a fit is made to."""

    # For each recording, the values of all varied parameters and the measured speed.
    places: list[dict[str, float]]

    @classmethod
    def of(cls, scene: Scene, name: str) -> FittedRecordings:
        """Read the recordings of a scene.

        SceneError as of `recorded_speeds`, and for a scene that does not say which design a
        recording belongs to.
        """
        assert scene.measured is not None
        period = float(scene.engine.period)
        read = recorded_speeds(scene.measured, period, name, MOST_SAMPLES)
        if read.groups > 1 and len(read.labels) > 1:
            raise SceneError(
                f"{name}: [measured] first_tooth: missing; {read.groups} teeth of the wheel could "
                "be the first one, and a fit to several recordings needs the same tooth in all"
            )
        for label, one in zip(read.labels, read.cycles, strict=True):
            if len(one) < 2:
                raise SceneError(
                    f"{name}: [measured] {label}: one cycle has no scatter; a fit needs two or "
                    "more cycles"
                )
        return cls(**vars(read), places=places_of(scene, read, name))

    def seen(
        self, recordings: Sequence[int], computed: SpeedsOfRecordings, angle: Floats,
        speed: Floats, gap_angle: float | None,
    ) -> Seen:  # fmt: skip
        """How the recordings of these numbers show speeds that are `computed` for them.

        The `speed` [rad/s], shape (recordings, samples), over the `angle` tells where the wheel is,
        and which of the turns fires; `gap_angle` [rad] is given where it is known.
        """
        if self.wheel is None:
            return Seen(self, computed, None, np.zeros(len(recordings)))
        gap = self.gap(self.raw[list(recordings)], angle, speed, gap_angle)
        return Seen(self, computed, gap.angle, gap.start)


@dataclass(frozen=True, eq=False)
class Seen:
    """Logarithms of computed speeds as perfect teeth or samples show them."""

    recordings: FittedRecordings  # The recordings with their intervals
    computed: SpeedsOfRecordings  # Computed speeds of the fitted recordings, in their order
    # Crank angle of the first tooth after the longest gap [rad]; None without a wheel.
    gap_angle: float | None
    starts: Floats  # Crank angle at which each recording begins [rad]; shape (recordings,)

    def __call__(self, values: Floats) -> list[Floats]:
        """Shape (n, intervals) for each recording, of parameters of shape (n, P)."""
        angle, speed = self.computed.speeds(values)
        shifts = np.zeros(len(values))
        for place, key in enumerate(self.computed.keys):
            if key in OF_WHEEL | OF_RECORDING:
                shifts = shifts + values[:, place] * DEGREE
        shown_logs = []
        for number, start in enumerate(self.starts):
            # A design without an answer gets logarithms of +1 and -1 in turn, which are so far from
            # measured speeds that the fit takes a smaller step.
            rows = np.full((len(values), self.recordings.width.size), 1.0)
            rows[:, ::2] *= -1.0
            for shift in np.unique(shifts):
                here = (shifts == shift) & np.isfinite(speed[:, number]).all(axis=1)
                rows[here] = np.log(self._shown(angle, speed[here, number], float(start + shift)))
            shown_logs.append(rows)
        return shown_logs

    def _shown(self, angle: Floats, speed: Floats, start: float) -> Floats:
        """Speeds [rad/s] as the wheel shows them, shape (n, intervals)."""
        given = self.recordings
        if given.wheel is not None:
            return speed_through_wheel(angle, speed, given.wheel, start, given.period)
        assert given.angle is not None
        at = given.angle + start
        rows = [np.interp(at, angle, one, period=given.period) for one in speed]
        return np.array(rows).reshape(len(speed), -1)


def places_of(scene: Scene, read: RecordedSpeeds, name: str) -> list[dict[str, float]]:
    """For each recording, the values of all that varies in the scene, and the measured speed."""
    places = []
    for file, speeds in zip(read.of_file, read.cycles, strict=True):
        time = np.mean(np.sum(read.width / speeds, axis=1))
        places.append({**_values_of(scene, file, name), "speed": float(read.period / time / RPM)})
    return places


def _values_of(scene: Scene, number: int, name: str) -> dict[str, float]:
    """Values of all varied parameters of a scene for one recording."""
    assert scene.measured is not None
    at = scene.measured.at
    numbers = {}
    for key, values in scene.axes.items():
        if isinstance(values, tuple) or key not in PARAMETERS:
            continue
        if key in at:
            numbers[key] = float(at[key][number])
        elif len(values) == 1:
            numbers[key] = float(values[0])
        elif key != "speed":  # The measured speed replaces that of the scene
            raise SceneError(
                f"{name}: [measured] at: the scene also varies {key}; give the value that belongs "
                "to each file"
            )
    if scene.designs:
        rows = at.get(DESIGN)
        if rows is None and len(next(iter(scene.designs.values()))) != 1:
            raise SceneError(f"{name}: [measured] at: give the design that belongs to each file")
        row = 0 if rows is None else int(rows[number])
        numbers |= {key: float(column[row]) for key, column in scene.designs.items()}
    return numbers
