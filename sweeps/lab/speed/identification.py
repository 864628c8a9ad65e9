"""Parameters of an engine from its measured speed, and what the speed does not tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.units import DEGREE
from sweeps.base.errors import SceneError
from sweeps.base.one_thread import linear_algebra_on_one_thread
from sweeps.lab.speed.computed_speeds import (
    NOT_OF_SCENES,
    OF_RECORDING,
    OF_WHEEL,
    SpeedsOfRecordings,
)
from sweeps.lab.speed.fit_results import FittedRecordings, Prediction, SpeedFit, fit_dataset
from sweeps.lab.speed.speed_fit import (
    LARGEST_CONDITION,
    Loss,
    MeasuredCycles,
    Parameter,
    fit_speeds,
)
from sweeps.running.archive.labels import describe
from sweeps.scene.keywords import Tables, tables_in_signature
from sweeps.scene.model import Scene
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Varied:
    """How a parameter is fitted, in the units of scenes."""

    # Bounds of the value; by default those of the parameter itself.
    low: float | None = None
    high: float | None = None
    start: float | None = None  # First value of the fit; by default that of the scene
    # Prior value, known without the measured speed, and its standard deviation.
    prior: float | None = None
    deviation: float | None = None
    own: bool = False  # Whether each recording has its own value


@tables_in_signature
@linear_algebra_on_one_thread()
def identify(
    scene: str | Path | Mapping[str, Any] | Scene | None = None,
    vary: Sequence[str] | Mapping[str, Varied] = (),
    *,
    teeth: str = "estimated",
    tooth_deviation: float | None = None,
    loss: Loss = "linear",
    predict: bool = True,
    largest_condition: float = LARGEST_CONDITION,
    **tables: Unpack[Tables],
) -> xr.Dataset:
    """Fit parameters of a scene to its measured speeds.

    Parameters
    ----------
    scene : str, Path, dict or Scene, optional
        A scene with the table [measured], see docs/measured_speed.md. Its speeds are replaced by
        the measured ones. Recordings need two cycles or more: weights come from their spread.
    vary : sequence of str, or dict of Varied
        Numbers to fit: parameters of scenes (``inertia``, ``load_exponent``, ...), and
        ``dead_centre_shift`` [degree], ``pegging`` [bar], ``pressure_factor`` [1] of the diagrams,
        ``gap_angle`` [degree] of the wheel, ``recording_shift`` [degree] of diagrams and speeds
        together, where both were recorded with the same dead centre.
    teeth : str
        "estimated": errors of the teeth are fitted too; "perfect": there are none. Nothing of both
        for speed over angle.
    tooth_deviation : float, optional
        Standard deviation of the relative errors of intervals, where it is known.
    loss : str
        "linear" (least squares), "soft_l1" or "huber".
    predict : bool
        Fit once more without each recording in turn, and predict it.
    largest_condition : float
        Above this condition number the fit is refused.
    **tables
        Tables of a scene as keywords; see `sweeps.read_scene`.

    Returns
    -------
    xarray.Dataset
        Over `parameter`: value, interval of 95 % (`value_low`, `value_high`), standard deviation,
        correlations. Over `recording` and `interval`: measured speed with its spread over cycles,
        computed speed as the wheel shows it, residuals in standard errors. Over `recording`: raw
        delta measured with its scatter, computed, and predicted from the other recordings with its
        standard deviation. Attributes: condition number, reduced chi square, likelihood of noise.

    Raises
    ------
    SceneError
        One line: no recordings, single cycles, unknown parameters, parameters that the speed
        cannot tell apart (docs/identification.md says which these are), a start without a steady
        speed.

    Examples
    --------
    >>> import numpy as np
    >>> import sweeps
    >>> computed = sweeps.run(engine="ntua", set={"inertia": 2.5}, output={"quantities": ["omega"]})
    >>> cycles = np.tile(computed.omega[::4], 10) * 30 / np.pi
    >>> cycles *= 1 + 0.001 * np.random.default_rng(1).standard_normal(cycles.size)
    >>> table = np.column_stack([4.0 * np.arange(cycles.size) - 360, cycles])
    >>> heads = "crank angle [deg],speed [rpm]"
    >>> np.savetxt("speed.csv", table, delimiter=",", header=heads, comments="")
    >>> fit = sweeps.identify(
    ...     engine="ntua",
    ...     solver={"closure": "cycle_time"},
    ...     output={"quantities": ["delta"]},
    ...     measured={"file": "speed.csv", "kind": "speed"},
    ...     vary=["inertia"],
    ... )
    >>> bool(fit.value_low[0] < 2.5 < fit.value_high[0])
    True
    """
    given = read_scene(scene, **tables)
    wanted = dict(vary) if isinstance(vary, Mapping) else {key: Varied() for key in vary}
    task = _Task.of(given, wanted, teeth, tooth_deviation, loss, largest_condition)
    try:
        speed_fit = task.fit(range(task.count))
        predicted = [task.predicted(one) for one in range(task.count) if predict and task.count > 1]
    except SceneError:
        raise
    except ValueError as error:
        raise SceneError(f"{task.name}: {error}") from None
    return fit_dataset(describe(make_plan(given)).attributes, speed_fit, predicted)


@dataclass(frozen=True, eq=False)
class _Task:
    """Recordings, the designs that they belong to, and the parameters to fit."""

    name: str
    scene: Scene
    given: FittedRecordings
    vary: dict[str, Varied]
    with_teeth: bool
    tooth_deviation: float | None
    loss: Loss
    largest_condition: float

    @property
    def count(self) -> int:
        return len(self.given.cycles)

    @classmethod
    def of(
        cls, scene: Scene, vary: dict[str, Varied], teeth: str, tooth_deviation: float | None,
        loss: Loss, largest_condition: float,
    ) -> _Task:  # fmt: skip
        """Read the recordings."""
        name = str(scene.path or "scene")
        if teeth not in ("estimated", "perfect"):
            raise SceneError(f"teeth = {teeth!r}: must be 'estimated' or 'perfect'")
        if tooth_deviation is not None and not 0.0 < tooth_deviation < np.inf:
            raise SceneError(f"teeth: standard deviation {tooth_deviation:g} must be positive")
        if scene.measured is None:
            raise SceneError(f"{name}: [measured] is missing; see the page 'Measured speed'")
        if not vary:
            raise SceneError(f"{name}: nothing to fit; name at least one parameter")
        for key, how in vary.items():
            if "@" in key:
                raise SceneError(
                    f"{name}: {key}: must be {key.partition('@')[0]}; use own for a value of each "
                    "recording"
                )
            given_numbers = (how.low, how.high, how.start, how.prior, how.deviation)
            if any(one is not None and np.isnan(one) for one in given_numbers):
                raise SceneError(
                    f"{name}: {key}: nan is not allowed as bound, start, prior or deviation"
                )
            if key in OF_WHEEL and scene.measured.wheel is None:
                raise SceneError(
                    f"{name}: {key}: cannot be fitted to speed over angle, which has no wheel"
                )
            if key in OF_WHEEL | OF_RECORDING and how.own:
                raise SceneError(
                    f"{name}: {key}: cannot have a separate value for each recording, because the "
                    "wheel is the same")  # fmt: skip
        given = FittedRecordings.of(scene, name)
        with_teeth = teeth == "estimated" and given.wheel is not None
        return cls(
            name, scene, given, vary, with_teeth, tooth_deviation, loss, largest_condition
        )  # fmt: skip

    def keys(self, recordings: Sequence[int]) -> list[str]:
        """Parameters of a fit to some of the recordings; their numbers are those of the fit."""
        return [
            key
            for plain, how in self.vary.items()
            for key in (
                [f"{plain}@{i + 1}" for i in range(len(recordings))] if how.own else [plain]
            )
        ]

    def fit(self, recordings: Sequence[int]) -> SpeedFit:
        """Fit to some of the recordings."""
        given = self.given
        computed = SpeedsOfRecordings.of(
            self.scene, [given.places[i] for i in recordings], self.keys(recordings)
        )
        cycles = [
            MeasuredCycles(given.labels[i], given.cycles[i], given.width, given.used)
            for i in recordings
        ]
        start = np.array([[self._start(key, computed) for key in computed.keys]])
        for key, one in zip(computed.keys, start[0], strict=True):
            if not np.isfinite(one):
                raise ValueError(f"{key}: has no initial value; give one in [set]")
            if key not in OF_WHEEL:
                # A value that is out of range is refused before anything is computed
                self._parameter(key, float(one), 0.0)
        angle, speed = computed.speeds(start, first=True)
        if not np.isfinite(speed).all():
            bad = int(np.flatnonzero(~np.isfinite(speed[0]).all(axis=1))[0])
            raise ValueError(
                f"{given.labels[recordings[bad]]}: no steady speed at the initial values; give "
                "others"
            )
        seen = given.seen(recordings, computed, angle, speed[0], given.known_gap)
        gap = (seen.gap_angle or 0.0) / DEGREE
        parameters = [
            self._parameter(key, float(value), gap)
            for key, value in zip(computed.keys, start[0], strict=True)
        ]
        fit = fit_speeds(
            seen, parameters, cycles, teeth=given.sound.size if self.with_teeth else 0,
            tooth_prior=self.tooth_deviation, loss=self.loss,
            largest_condition=self.largest_condition,
        )  # fmt: skip
        return SpeedFit(fit, seen, self.with_teeth)

    def _start(self, key: str, computed: SpeedsOfRecordings) -> float:
        how = self.vary[key.partition("@")[0]]
        if how.start is not None:
            return how.start
        return how.prior if how.prior is not None else computed.start(key)

    def _parameter(self, key: str, start: float, gap_angle: float) -> Parameter:
        plain = key.partition("@")[0]
        how = self.vary[plain]
        # A parameter is changed much when it changes by a tenth of its first value.
        low, high, scale = -np.inf, np.inf, 0.1 * abs(start)
        if plain in PARAMETERS:
            node = PARAMETERS[plain]
            low = -np.inf if node.low is None else node.low
            high = np.inf if node.high is None else node.high
            scale = scale or 1.0
        else:
            scale = NOT_OF_SCENES[plain][1]
        low = low if how.low is None else how.low
        high = high if how.high is None else how.high
        prior, deviation = how.prior, how.deviation
        # A gap angle is fitted relative to that at which measured and computed speeds agree best.
        if plain in OF_WHEEL:
            prior = None if prior is None else prior - gap_angle
            if not low <= gap_angle <= high:
                raise ValueError(
                    f"{key}: found at {gap_angle:.4g} degrees from the correlation of the speeds; "
                    f"the bounds are {low:g} to {high:g}"
                )
            low, high, start = low - gap_angle, high - gap_angle, 0.0
        return Parameter(key, start, low, high, prior, deviation, scale)

    def predicted(self, held_out: int) -> Prediction:
        """Raw delta of a recording from a fit to the others.

        Nothing of the recording enters but its mean speed and which of the turns fires.
        """
        given = self.given
        speed_fit = self.fit([i for i in range(self.count) if i != held_out])
        keys = speed_fit.seen.computed.keys
        shared = [i for i, key in enumerate(keys) if "@" not in key]
        computed = SpeedsOfRecordings.of(
            self.scene, [given.places[held_out]], [keys[i] for i in shared]
        )
        value = speed_fit.fit.value[shared]
        angle, speed = computed.speeds(value[None])
        seen = given.seen([held_out], computed, angle, speed[0], speed_fit.seen.gap_angle)
        errors = speed_fit.tooth_errors[given.used]
        logs = seen(value[None])[0][0][given.used] + errors
        step = 0.1 * speed_fit.fit.deviation[shared]
        # A value at its bound has a deviation of 0; its step is then taken from the value itself.
        step = np.where(step > 0.0, step, 1e-3 * np.maximum(np.abs(value), 1e-3))
        rise = np.zeros((0, logs.size))
        if shared:
            batch = value + np.diag(step)
            rise = (seen(batch)[0][:, given.used] + errors - logs) / step[:, None]
        if self.with_teeth:
            rise = np.vstack([rise, np.tile(np.eye(int(given.sound.sum())), (1, given.turns))])
        rise = rise[:, int(np.argmax(logs))] - rise[:, int(np.argmin(logs))]
        count = len(speed_fit.fit.parameters)
        picked = [*shared, *range(count, len(speed_fit.fit.covariance_with_teeth))]
        covariance = speed_fit.fit.covariance_with_teeth[np.ix_(picked, picked)]
        speeds = np.exp(logs)
        delta = float(np.ptp(speeds) / speeds.mean())
        shown = np.full(given.used.size, np.nan)
        shown[given.used] = logs
        return Prediction(delta, float(np.sqrt(rise @ covariance @ rise)), shown)
