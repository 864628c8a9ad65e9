"""Measured speed beside the computed one, as a labelled dataset."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
import numpy.typing as npt

from engine_dyn.geometry.toothed_wheel import TURN, Wheel
from engine_dyn.recordings.measured_speed import (
    Fluctuation,
    GapAngle,
    fluctuation,
    likeness,
    orders_of_samples,
    speed_over_angle,
)
from engine_dyn.recordings.tooth_errors import (
    ToothErrors,
    speed_through_wheel,
    tooth_errors,
)
from engine_dyn.status import MEANINGS
from engine_dyn.types import Booleans, Floats, Integers
from engine_dyn.units import DEGREE
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import SceneError
from sweeps.base.one_thread import linear_algebra_on_one_thread
from sweeps.lab.speed.computed_speeds import SpeedsOfRecordings
from sweeps.lab.speed.fit_results import places_of
from sweeps.lab.speed.labelled import labelled_dataset, of_intervals, of_recordings
from sweeps.lab.speed.measured_doubts import (
    INERTIA_STEP,
    even_firing_doubt,
    far_speed_remark,
    gap_doubts,
    likeness_doubts,
    of_heavier_engine,
    repeats_every_turn,
)
from sweeps.lab.speed.recorded_speeds import (
    RecordedSpeeds,
    first_tooth,
    recorded_speeds,
)
from sweeps.scene.features.measured import Measured
from sweeps.scene.keywords import Tables, tables_in_signature
from sweeps.scene.model import Scene
from sweeps.scene.reading import read_scene

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class _Curves:
    """Measured and computed speeds of all recordings over the same intervals."""

    # Arrays of shape (recordings, intervals) begin with the first interval of each recording's
    # cycle; `order` sorts them by angle.

    # Middle of the intervals in the order of the angle [rad]; shape (intervals,)
    middle: Floats
    width: Floats
    order: list[Integers]  # Order of each recording's intervals by their angle
    # Raw speed in each interval of each cycle [rad/s]; shape (cycles, intervals)
    cycles: list[Floats]
    between: Floats  # Computed speed between the true teeth [rad/s]; shape (recordings, intervals)
    # Relative errors of the intervals and their standard errors; 0 where none are known; shape
    # (recordings, intervals)
    errors: Floats
    unsure: Floats
    edges: list[Floats]  # True angles of the teeth [rad]; shape (intervals + 1,)
    # False for intervals whose speed is far off that of their neighbours in every turn, see
    # `sound_intervals`; shape (recordings, intervals)
    sound: Booleans
    # Errors of the teeth that are estimated from all recordings
    of_wheel: ToothErrors | None = None
    gap_angle: float | None = None  # Crank angle of the first tooth after the longest gap [rad]
    # Errors of intervals for an inertia that is larger by INERTIA_STEP, where errors are estimated;
    # shape (recordings, intervals)
    heavier: Floats | None = None
    # Correlation of each recording with the computed speed, without errors of teeth.
    as_passed: list[float] = field(default_factory=list)
    doubts: tuple[str, ...] = ()  # Doubts about the angle of the gap, a line each

    def in_order(self, rows: Sequence[Any] | npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Values of all recordings in the order of the angle."""
        return np.array([row[order] for row, order in zip(rows, self.order, strict=True)])


@tables_in_signature
@linear_algebra_on_one_thread()
def measured(
    scene: str | Path | Mapping[str, Any] | Scene | None = None,
    *,
    computed: xr.Dataset | None = None,
    **tables: Unpack[Tables],
) -> xr.Dataset:
    """Put measured speeds beside the computed ones.

    Parameters
    ----------
    scene : str, Path, dict or Scene, optional
        A scene with the table [measured], see docs/measured_speed.md.
    computed : Dataset, optional
        Results of the same scene with `omega` over `crank_angle`; computed here unless given.
    **tables
        Tables of a scene as keywords; see `sweeps.read_scene`.

    Returns
    -------
    xarray.Dataset
        Over `recording`: delta, measured and computed, with uncertainty; correlation and relative
        rms difference. Over `crank_angle`: measured speed with its standard deviation over cycles,
        and the computed speed. Over `interval` (of teeth): raw speed, corrected speed, and the
        computed speed seen through the wheel. Over `order`: amplitudes of both.

    Raises
    ------
    SceneError
        One line: a scene without [measured], recordings that cannot be read or do not fit the
        wheel, and a scene whose designs the recordings do not tell apart.

    Examples
    --------
    >>> import numpy as np
    >>> import sweeps
    >>> computed = sweeps.run(engine="ntua", output={"quantities": ["omega"]})
    >>> table = np.column_stack([computed.crank_angle, computed.omega * 30 / np.pi])
    >>> heads = "crank angle [deg],speed [rpm]"
    >>> np.savetxt("speed.csv", table, delimiter=",", header=heads, comments="")
    >>> found = sweeps.measured(
    ...     engine="ntua",
    ...     output={"quantities": ["delta"]},
    ...     measured={"file": "speed.csv", "kind": "speed"},
    ... )
    >>> found.correlation.values.round(3)
    array([1.])
    """
    given = read_scene(scene, **tables)
    name = str(given.path or "scene")
    table = given.measured
    if table is None:
        raise SceneError(f"{name}: [measured] is missing; see the page 'Measured speed'")
    recorded = recorded_speeds(table, float(given.engine.period), name)
    from sweeps.running.compute.in_memory import run

    if table.disc is not None:
        task = SpeedsOfRecordings.of(given, places_of(given, recorded, name), ())
        silenced = (*given.silenced_warnings, "rigid_shaft")  # Of omega, which is replaced
        computed = run(replace(task.scene, quantities=("omega",), silenced_warnings=silenced))
        table = replace(table, at={DESIGN: np.arange(len(recorded.labels), dtype=float)})
        angle, (speeds,) = task.speeds(np.empty((1, 0)), first=True)
    else:
        table = replace(table, at={k: v[list(recorded.of_file)] for k, v in table.at.items()})
        if computed is None:
            computed = run(replace(given, quantities=("omega", "delta"), reference=None))
        angle, speeds = computed_speeds(computed, table, len(recorded.labels), name, lacking=True)
    if not _known(speeds).any():
        table = replace(table, errors="none" if isinstance(table.errors, str) else table.errors)
    try:
        if recorded.wheel is None:
            curves = _curves_over_angle(recorded, angle, speeds)
        else:
            gap = recorded.gap(recorded.raw, angle, speeds, recorded.known_gap)
            recorded = recorded.from_first_tooth(gap)
            curves = _curves(table, recorded, gap, angle, speeds)
    except ValueError as error:
        raise SceneError(f"{name}: [measured] {error}") from None
    return _dataset(given, table, recorded, curves, angle, speeds, computed)


def computed_speeds(
    computed: xr.Dataset, given: Measured, count: int, name: str, lacking: bool = False
) -> tuple[Floats, Floats]:
    """Angles [rad] and, for each recording, the computed speed of the design it belongs to.

    With `lacking` that of a design without a steady speed is NaN; it is refused otherwise.
    """
    if "omega" not in computed:
        raise SceneError(f"{name}: the computed results have no omega; add it to [output]")
    angle = np.asarray(computed["crank_angle"].values, dtype=float) * DEGREE
    rows = []
    for place in range(count):
        here = design_of(computed["omega"], given, place)
        left = [str(d) for d in here.dims if d != "crank_angle" and here.sizes[d] > 1]
        if left:
            raise SceneError(
                f"{name}: [measured] at: the scene also varies {', '.join(left)}; give the value "
                "that belongs to each file, such as at = { load = [50] }"
            )
        values = np.asarray(here.values, dtype=float).reshape(-1)
        if not (lacking or np.isfinite(values).all()):
            raise SceneError(
                f"{name}: the design of recording {place + 1} has no computed speed; see its status"
            )
        rows.append(values)
    return angle, np.array(rows)


def _known(speeds: Floats) -> Booleans:
    """Whether each recording has a computed speed."""
    return np.asarray(np.isfinite(speeds).all(axis=1))


def design_of(values: xr.DataArray, given: Measured, place: int) -> xr.DataArray:
    """Values of the design that a recording belongs to."""
    for key, wanted in given.at.items():
        if key not in values.dims:
            continue  # The values do not depend on this axis
        axis = values[key].values if key != DESIGN else np.arange(values.sizes[DESIGN])
        values = values.isel({key: int(np.argmin(np.abs(axis - wanted[place])))})
    return values


def _curves(
    given: Measured, recorded: RecordedSpeeds, gap: GapAngle, angle: Floats, speeds: Floats
) -> _Curves:
    """Measured and computed speeds on the intervals of the recordings."""
    assert recorded.wheel is not None
    wheel, turns, period = recorded.wheel, recorded.turns, recorded.period
    raw, sound, known = recorded.raw, recorded.sound, recorded.known_gap
    has = _known(speeds)
    starts = np.asarray(gap.angle + TURN * gap.turn)

    def first_teeth(errors: Floats) -> list[float]:
        """True angle of the first tooth of each recording."""
        pairs = zip(starts, errors, strict=True)
        return [first_tooth(start, one, wheel, sound) for start, one in pairs]

    def between(errors: Floats) -> Floats:
        """Computed speed between the true teeth, for the errors of each recording."""
        seen = [
            speed_through_wheel(angle, speed, wheel, tooth, period, one)
            for speed, tooth, one in zip(speeds, first_teeth(errors), errors, strict=True)
        ]
        return np.array(seen) * np.tile(1.0 + errors, turns)

    errors, unsure, of_wheel = _errors_of(given.errors, raw, between, wheel, has)
    heavier = None
    if isinstance(given.errors, str) and given.errors != "none":
        heavier, *_ = _errors_of(
            given.errors, raw, lambda errors: of_heavier_engine(between(errors)), wheel, has
        )
    doubts = []
    if has.any():
        compared = replace(gap, correlation=gap.correlation[has])
        doubts = gap_doubts(
            compared, known is not None, raw[has], angle, speeds[has], wheel, period, sound
        )
    width, middles = recorded.width, recorded.middles(starts)
    order = [np.argsort(one) for one in middles]
    return _Curves(
        middles[0][order[0]],
        width[order[0]],
        order,
        recorded.cycles,
        between(errors),
        np.tile(errors, turns),
        np.tile(unsure, turns),
        [
            tooth + np.concatenate([[0.0], np.cumsum(width * np.tile(1.0 + one, turns))])
            for tooth, one in zip(first_teeth(errors), errors, strict=True)
        ],
        np.tile(recorded.used, (len(raw), 1)),
        of_wheel,
        gap.angle,
        None if heavier is None else np.tile(heavier, turns),
        gap.correlation.max(axis=1).tolist(),
        tuple(doubts),
    )


def _errors_of(
    how: str | Floats, raw: Floats, between: Callable[[Floats], Floats], wheel: Wheel,
    has: Booleans,
) -> tuple[Floats, Floats, ToothErrors | None]:  # fmt: skip
    """Errors of the teeth for each recording, their uncertainty, and those of the wheel."""
    # The errors are estimated from recordings that have a computed speed.
    count, zero = len(raw), np.zeros((len(raw), wheel.teeth))
    if not isinstance(how, str):
        return np.tile(how, (count, 1)), zero, ToothErrors(how, np.full(wheel.teeth, np.nan))
    if how == "none":
        return zero, zero, None
    by_turn = raw.reshape(count, -1, wheel.teeth)
    every = none = ToothErrors(zero[0], zero[0])
    # Rounds of estimating errors: the first takes the computed speed between teeth without errors
    for _ in range(2):
        model = between(np.tile(every.error, (count, 1))).reshape(by_turn.shape)
        every = tooth_errors(by_turn[has], model[has], wheel)
    if how == "all":
        each = [every] * count
    else:
        each = []
        for place in range(count):
            rest = has & (np.arange(count) != place)
            each.append(tooth_errors(by_turn[rest], model[rest], wheel) if rest.any() else none)
    unsure = np.array([np.nan_to_num(one.uncertainty) for one in each])
    return np.array([one.error for one in each]), unsure, every


def _curves_over_angle(recorded: RecordedSpeeds, angle: Floats, speeds: Floats) -> _Curves:
    """Measured and computed speed over angle, on the finest recorded angles, without a wheel."""
    assert recorded.angle is not None
    middle, width, period, cycles = (
        recorded.angle, recorded.width, recorded.period, recorded.cycles,
    )  # fmt: skip
    between = np.array([np.interp(middle, angle, one, period=period) for one in speeds])
    edges = np.append(middle, middle[0] + period) - 0.5 * width[0]
    count, nothing = len(cycles), np.zeros(between.shape)
    order = [np.arange(middle.size)] * count
    sound = np.ones(between.shape, dtype=bool)
    return _Curves(middle, width, order, cycles, between, nothing, nothing, [edges] * count, sound)


def _dataset(
    scene: Scene, given: Measured, recorded: RecordedSpeeds, curves: _Curves, angle: Floats,
    speeds: Floats, computed: xr.Dataset,
) -> xr.Dataset:  # fmt: skip
    """Results with labels and units."""
    recording, over, along = ("recording",), ("recording", "interval"), ("recording", "crank_angle")
    count, period = range(len(recorded.labels)), recorded.period
    raw = recorded.raw
    mean = curves.in_order(raw)
    spread = curves.in_order([_deviation(one) for one in curves.cycles])
    errors, between = curves.in_order(curves.errors), curves.in_order(curves.between)
    corrected, through = mean * (1.0 + errors), between / (1.0 + errors)
    smooth = np.array(
        [speed_over_angle(raw[i] * (1.0 + curves.errors[i]), curves.edges[i], angle) for i in count]
    )
    around = np.array([np.interp(angle, curves.middle, one, period=period) for one in spread])
    sound = curves.in_order(curves.sound)[0]
    share = np.where(sound, curves.width, 0.0)
    known = [likeness(mean[i], through[i], share) for i in count]
    plain = [likeness(corrected[i], between[i], share) for i in count]
    raw_delta = [fluctuation(c[:, s]) for c, s in zip(curves.cycles, curves.sound, strict=True)]
    delta = [_corrected(one, curves, i) for i, one in enumerate(curves.cycles)]
    by_inertia = np.array([_by_inertia(one, curves, i) for i, one in enumerate(curves.cycles)])
    # Orders of the crank's turn that are compared; those of a disc up to four intervals a wave
    turns, highest = round(period / TURN), 6.0
    if given.disc is not None:
        highest = min(scene.highest_order, sound.sum() / (4.0 * turns))
    orders = np.arange(1, math.floor(highest * turns + 1e-9) + 1) / turns
    size, phase = orders_of_samples(
        corrected[:, sound], curves.middle[sound], curves.width[sound], orders
    )
    has = _known(speeds)
    own, own_phase = np.full((2, *size.shape), np.nan)
    # Computed speeds are samples and no means: intervals around them [rad] have almost no width.
    own[has], own_phase[has] = orders_of_samples(
        speeds[has], angle, np.full(angle.size, 1e-9), orders
    )
    rad, one = "rad s-1", "1"
    data: dict[str, Any] = {
        "delta_measured": (recording, [d.delta for d in delta], one,
                           "coefficient of speed fluctuation, measured"),
        "delta_measured_uncertainty": (recording, [d.uncertainty for d in delta], one,
                                       "standard error of delta_measured"),
        "delta_measured_by_inertia": (recording, by_inertia, one,
                                      "relative change of delta_measured per relative change of "
                                      "the scene's inertia, through the tooth errors"),
        "delta_measured_raw": (recording, [d.delta for d in raw_delta], one,
                               "coefficient of speed fluctuation, measured, including tooth "
                               "errors"),
        "delta_measured_raw_uncertainty": (recording, [d.uncertainty for d in raw_delta], one,
                                           "standard error of delta_measured_raw"),
        "delta_of_cycles": (recording, [d.of_cycles for d in delta], one,
                            "mean of delta over single cycles, measured"),
        "delta_of_cycles_std": (recording, [d.scatter for d in delta], one,
                                "standard deviation of delta over cycles, measured"),
        "delta": (recording, _computed_deltas(computed, given, speeds), one,
                  "coefficient of speed fluctuation, computed"),
        "delta_through_wheel": (recording, _fluctuations(through[:, sound]), one,
                                "coefficient of speed fluctuation, computed, through the wheel"),
        "correlation_raw": (recording, [k[0] for k in known], one,
                            "correlation of raw speed and computed speed through the wheel"),
        "rms_difference_raw": (recording, [k[1] for k in known], one,
                               "rms difference of raw speed and computed speed through the wheel, "
                               "over the mean"),
        "correlation": (recording, [k[0] for k in plain], one,
                        "correlation of corrected and computed speed"),
        "rms_difference": (recording, [k[1] for k in plain], one,
                           "rms difference of corrected and computed speed, over the mean"),
        "omega_mean_measured": (recording, [float(c.mean()) for c in mean], rad,
                                "mean speed over the angle, measured"),
        "recorded_cycles": (recording, [len(c) for c in curves.cycles], one,
                            "number of recorded cycles"),
        "omega": (along, speeds, rad, "crank speed, computed"),
        "omega_measured": (along, smooth, rad, "crank speed, measured, mean over cycles"),
        "omega_measured_std": (along, around, rad,
                               "standard deviation over cycles of the measured speed"),
        "omega_raw": (over, mean, rad, "raw speed between teeth, mean over cycles"),
        "omega_raw_std": (over, spread, rad, "standard deviation over cycles of the raw speed"),
        "omega_corrected": (over, corrected, rad, "speed between teeth, tooth errors taken out"),
        "omega_between_teeth": (over, between, rad, "computed speed between the teeth"),
        "omega_through_wheel": (over, through, rad, "computed speed seen through the wheel"),
        "omega_measured_order": (("recording", "order"), size, rad,
                                 "amplitude of the measured speed"),
        "omega_measured_phase": (("recording", "order"), phase / DEGREE, "degree",
                                 "phase of the measured speed"),
        "omega_order": (("recording", "order"), own, rad, "amplitude of the computed speed"),
        "omega_phase": (("recording", "order"), own_phase / DEGREE, "degree",
                        "phase of the computed speed"),
    }  # fmt: skip
    if given.disc is not None:
        data |= _angles_of_disc(orders, {
            "measured": (mean.mean(axis=1), size, phase),
            "computed": (speeds.mean(axis=1), own, own_phase),
        })  # fmt: skip
    if curves.of_wheel is not None:
        data["tooth_error"] = (("tooth",), curves.of_wheel.error, one,
                               "relative error of the wheel's interval")  # fmt: skip
        data["tooth_error_uncertainty"] = (("tooth",), curves.of_wheel.uncertainty, one,
                                           "standard error of tooth_error")  # fmt: skip
    dataset = labelled_dataset(
        data,
        _coordinates(given, recorded, curves, angle, orders, computed),
        _attributes(scene, given, recorded, curves, mean, speeds, computed),
    )
    doubts, alike = list(curves.doubts), [k[0] for k in plain]
    if curves.heavier is not None and repeats_every_turn(speeds[has], period):
        # Estimated tooth errors may hold all of the computed speed, so that corrected speeds always
        # agree with it: correlations without these errors are judged.
        alike = curves.as_passed
        doubts.append(even_firing_doubt(by_inertia))
    doubts += likeness_doubts(recorded.labels, alike, given.wheel is not None)
    dataset.attrs["remarks"] = "\n".join(filter(None, [dataset.attrs["remarks"], *doubts]))
    return dataset


def _angles_of_disc(
    orders: Floats, speeds: Mapping[str, tuple[Floats, Floats, Floats]]
) -> dict[str, Any]:
    """Orders of the angle of a disc by those of its speed: mean speed, amplitude and phase."""
    data: dict[str, Any] = {}
    for said, (level, size, phase) in speeds.items():
        kind = "disc_angle_" + ("measured_" if said == "measured" else "")
        # The speed of A cos(nu phi + psi) is -nu omega A sin(nu phi + psi)
        angle = size / (orders * level[:, None]) / DEGREE
        lag = np.degrees(np.angle(-1j * np.exp(1j * phase)))
        over = ("recording", "order")
        data[kind + "order"] = over, angle, "degree", f"amplitude of the disc, {said}"
        data[kind + "phase"] = over, lag, "degree", f"phase of the disc, {said}"
    return data


def _deviation(cycles: Floats) -> Floats:
    """Standard deviation over cycles; missing for a single cycle."""
    return cycles.std(axis=0, ddof=1) if len(cycles) > 1 else np.full(cycles.shape[1], np.nan)


def _corrected(cycles: Floats, curves: _Curves, place: int) -> Fluctuation:
    """Fluctuation without the errors of the teeth, where they are known."""
    sound = curves.sound[place]
    if not curves.errors[place].any():
        return fluctuation(cycles[:, sound])
    errors = ToothErrors(curves.errors[place][sound], curves.unsure[place][sound])
    return fluctuation(cycles[:, sound], errors)


def _by_inertia(cycles: Floats, curves: _Curves, place: int) -> float:
    """Relative change of the corrected delta over the relative change of the scene's inertia."""
    if curves.heavier is None:
        return 0.0
    delta = _corrected(cycles, curves, place).delta
    heavier = _corrected(cycles, replace(curves, errors=curves.heavier), place).delta
    return (heavier / delta - 1.0) / INERTIA_STEP


def _computed_deltas(computed: xr.Dataset, given: Measured, speeds: Floats) -> Floats:
    """Computed delta of the solver; that of the samples where the results do not have it."""
    deltas = _fluctuations(speeds)
    if "delta" in computed:
        for place in range(len(deltas)):
            here = design_of(computed["delta"], given, place).values
            deltas[place] = float(np.asarray(here).reshape(-1)[0])
    return deltas


def _fluctuations(speeds: Floats) -> Floats:
    return np.asarray(np.ptp(speeds, axis=1) / speeds.mean(axis=1))


def _coordinates(
    given: Measured, recorded: RecordedSpeeds, curves: _Curves, angle: Floats,
    orders: Floats, computed: xr.Dataset,
) -> dict[str, Any]:  # fmt: skip
    coordinates: dict[str, Any] = {
        **of_recordings(recorded.labels),
        "crank_angle": ("crank_angle", angle / DEGREE, dict(computed["crank_angle"].attrs)),
        **of_intervals(
            curves.middle, curves.width, curves.in_order(curves.sound)[0],
            "for delta, correlation and orders",
        ),
        "order": (("order",), orders, "1", "order of the crank's turn"),
    }  # fmt: skip
    if given.wheel is not None and curves.of_wheel is not None:
        numbers = np.arange(1, given.wheel.teeth + 1, dtype=np.int32)
        coordinates["tooth"] = ("tooth", numbers, "1", "tooth after the gap")
    for key, values in given.at.items():
        name = "design_number" if key == DESIGN else key
        attributes = dict(computed[key].attrs) if key in computed.coords else {"units": "1"}
        coordinates[name] = ("recording", np.asarray(values), attributes)
        if key == DESIGN:
            for column, coordinate in computed.coords.items():
                if coordinate.dims == (DESIGN,) and column != DESIGN:
                    picked = coordinate.values[np.asarray(values, dtype=int)]
                    coordinates[str(column)] = ("recording", picked, dict(coordinate.attrs))
    return coordinates


def _attributes(
    scene: Scene, given: Measured, recorded: RecordedSpeeds, curves: _Curves, mean: Floats,
    speeds: Floats, computed: xr.Dataset,
) -> dict[str, Any]:  # fmt: skip
    """Attributes on how the comparison was made, besides those of the computed results."""
    remarks = list(recorded.remarks)
    has = _known(speeds)
    for place, label in enumerate(recorded.labels):
        if has[place]:
            remarks += far_speed_remark(
                label, mean[place].mean(), speeds[place].mean(), "delta changes"
            )
        else:
            code = int(np.ravel(design_of(computed["status"], given, place).values)[0])
            remarks.append(
                f"{label}: has no computed speed ({MEANINGS[code]}); only the measured part is "
                "given"
            )
    if given.wheel is not None and not curves.sound.all():
        places = np.flatnonzero(~curves.sound[0][: given.wheel.teeth]) + 1
        remarks.append(
            f"intervals {', '.join(map(str, places))} of {given.wheel.teeth} after the gap differ "
            "strongly from their neighbours in every turn and are left out of delta, correlation "
            "and orders"
        )
    how = given.errors if isinstance(given.errors, str) else "given"
    said = {
        "others": "estimated from the other recordings with their computed speeds",
        "all": "estimated from these recordings with their computed speeds: they include errors "
        "of whole orders common to both, and correlations are too high",
        "none": "not taken out",
        "given": "as given",
    }
    attributes: dict[str, Any] = {
        **computed.attrs,
        "title": scene.title,
        "measured_kind": given.table.kind,
        **({} if given.table.disc is None else {"disc": given.table.disc}),
        "recordings": recorded.listed,
        "remarks": "\n".join(remarks),
    }
    if given.wheel is not None and curves.gap_angle is not None:
        attributes |= {
            "wheel": given.wheel.text,
            "tooth_errors": said[how],
            "gap_angle": curves.gap_angle / DEGREE,
            "gap_angle_from": "the scene"
            if given.table.gap_angle is not None
            else "the mark"
            if given.table.mark_column is not None
            else "the correlation of measured and computed speed: estimated, not measured"
            if has.any()
            else "an assumption, because there is no computed speed",
        }
        if given.table.end is not None:
            attributes["end_of_shaft"] = given.table.end
    return attributes
