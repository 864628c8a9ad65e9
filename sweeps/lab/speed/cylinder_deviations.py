"""Work of single cylinders from a measured speed: missed cycles, weak cylinders, as a dataset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import NormalDist
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from engine_dyn.geometry.toothed_wheel import TURN, Wheel
from engine_dyn.quantities.parameters import CYCLE_KEYS
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry
from engine_dyn.recordings.cylinder_work import (
    Detection,
    MeanCycle,
    WheelNoise,
    WorkEstimator,
    combustion_torque,
    detection,
    energy_deviation,
    work_estimator,
)
from engine_dyn.recordings.tooth_errors import speed_through_wheel
from engine_dyn.types import Booleans, Floats
from engine_dyn.units import BAR, DEGREE
from sweeps.base.checks import mentioned
from sweeps.base.errors import SceneError
from sweeps.base.one_thread import linear_algebra_on_one_thread
from sweeps.lab.speed.computed_speeds import OneEngine, engine_of, values_of
from sweeps.lab.speed.labelled import labelled_dataset, of_recordings
from sweeps.lab.speed.measured import computed_speeds, design_of
from sweeps.lab.speed.measured_doubts import far_speed_remark
from sweeps.lab.speed.measured_files import records_of
from sweeps.lab.speed.recorded_speeds import CyclesInARow, cycles_in_a_row
from sweeps.scene.consistency.features import check_crossings
from sweeps.scene.consistency.pressure import check_motored
from sweeps.scene.features.measured import Measured
from sweeps.scene.keywords import Tables, tables_in_signature
from sweeps.scene.model import Scene
from sweeps.scene.reading import read_scene

if TYPE_CHECKING:
    import xarray as xr

FALSE_ALARMS = 1e-4  # Probability of a false alarm in one cycle of the whole engine, by default

TOOTH_DEVIATION = 0.001
"""Standard deviation of unknown errors of teeth, in shares of the smallest interval."""

FEWEST = 6  # Smallest number of cycles from which a dispersion is estimated

FEWEST_INTERVALS = 4  # Smallest number of intervals between teeth in a cycle, for each cylinder

SCATTER_OF_MEDIAN = 0.6745
"""Median of the absolute value of a normally distributed number, over its standard deviation."""

LEAST_PASSAGE = 1e-5  # Smallest error of the places of passing teeth that is assumed


@dataclass(frozen=True, eq=False)
class _Deviations:
    """Results of one recording; pressures in Pa."""

    row: CyclesInARow  # Speeds of the recording
    # Deviations of single cycles from the usual value of their cylinder; shape (cycles, cylinders)
    single: Floats
    single_std: Floats  # Standard deviation of the errors of single deviations; shape (cylinders,)
    # Deviation of each cylinder's mean cycle from the other cylinders; shape (cylinders,)
    lasting: Floats
    lasting_std: Floats
    # Detection of a missed cycle, and of a weak cylinder by its mean cycle.
    of_cycle: Detection
    of_mean: Detection
    missing: float  # Indicated mean effective pressure that a missed cycle lacks [Pa]
    # Standard deviation of the indicated mean effective pressure of normal cycles [Pa]
    dispersion: float
    passage: float  # Errors of the places of passing teeth, in shares of the smallest interval
    reference_cycles: int  # Number of cycles in the mean that single cycles are compared with

    @property
    def missed(self) -> Booleans:
        """Single cycles that are called missed."""
        return np.asarray(self.single < self.of_cycle.threshold)

    @property
    def weak(self) -> Booleans:
        """Cylinders that are called weak."""
        return np.asarray(self.lasting < self.of_mean.threshold)


@tables_in_signature
@linear_algebra_on_one_thread()
def cylinder_deviations(
    scene: str | Path | Mapping[str, Any] | Scene | None = None,
    *,
    false_alarms: float = FALSE_ALARMS,
    tooth_deviation: float = TOOTH_DEVIATION,
    **tables: Unpack[Tables],
) -> xr.Dataset:
    """Deviation of the imep of each cylinder from the others, by the measured speed.

    docs/method.md section 18: the crank is rigid, and the cylinders are equal but for the work of
    combustion. Single cycles are compared with the mean of the others of the same recording, in
    which errors of teeth cancel; mean cycles with the computed speed.

    Parameters
    ----------
    scene : str, Path, dict or Scene, optional
        An engine of at least two cylinders and the table [measured] with times of teeth or signals.
    false_alarms : float
        Wanted probability of a false alarm in one cycle of the engine, all cylinders together.
    tooth_deviation : float
        Standard deviation of the errors of the wheel's intervals, in shares of the smallest, that
        [measured] does not give; it blurs mean cycles alone.
    **tables
        Tables of a scene as keywords; see `sweeps.read_scene`.

    Returns
    -------
    xarray.Dataset
        Over `recording`, `recorded_cycle`, `cylinder`: deviation of the imep, of the cycle alone
        and with the lasting one, and whether the cycle is called missed. Over `recording` and
        `cylinder`: their standard deviations, thresholds, the share of missed cycles that is found;
        the lasting deviation, and whether the cylinder is called weak, or dead.

    Raises
    ------
    SceneError
        One line: a scene without [measured], speed over angle, fewer than two cylinders, engines
        whose cylinders differ, recordings that cannot be read or are too short.

    Examples
    --------
    >>> import numpy as np
    >>> import sweeps
    >>> computed = sweeps.run(
    ...     engine="si_four_87x101",
    ...     set={"speed": 2000, "misfire": 2},
    ...     output={"quantities": ["omega"]},
    ... )
    >>> step = np.tile(np.pi / 180 / computed.omega.values, 20)  # seconds a degree, of 20 cycles
    >>> teeth = np.concatenate([np.arange(turn, turn + 343, 6) for turn in range(0, 14400, 360)])
    >>> times = np.append(0.0, np.cumsum(step))[teeth]
    >>> np.savetxt("teeth.csv", times, header="time [s]", comments="")
    >>> found = sweeps.cylinder_deviations(
    ...     engine="si_four_87x101",
    ...     set={"speed": 2000},
    ...     output={"quantities": ["delta"]},
    ...     measured={"file": "teeth.csv", "kind": "teeth", "wheel": "60-2", "gap_angle": 360},
    ... )
    >>> found.dead.values
    array([[0., 1., 0., 0.]])
    """
    given = read_scene(scene, **tables)
    name = str(given.path or "scene")
    table, where = given.measured, f"{name}: [measured]"
    if table is None:
        raise SceneError(f"{where} is missing; see the page 'Measured speed'")
    if table.wheel is None:
        raise SceneError(
            f"{where} kind = 'speed': must be 'teeth' or 'encoder'; otherwise misfires cannot be "
            "distinguished from tooth errors"
        )
    if not 0.0 < false_alarms < 1.0:
        raise SceneError(f"false alarms {false_alarms:g}: must be between 0 and 1")
    if not 0.0 <= tooth_deviation < 0.5:
        raise SceneError(f"tooth deviation {tooth_deviation:g}: must be from 0 to 0.5")
    engine = engine_of(given, f"{name}: deviations of cylinders")
    if len(engine.firing) < 2:
        raise SceneError(f"{name}: cylinders = 1: a deviation from the others needs at least 2")
    intervals = table.wheel.teeth * round(engine.period / TURN)
    if intervals < FEWEST_INTERVALS * len(engine.firing):
        raise SceneError(
            f"{where} wheel: {intervals} intervals a cycle; must be at least "
            f"{FEWEST_INTERVALS} for each of {len(engine.firing)} cylinders"
        )
    _check_axes(given, name)
    records = records_of(table, engine.period, name)
    computed, motored = _computed(given, name)
    angle, speeds = computed_speeds(computed, table, len(records), name)
    results = []
    for place, record in enumerate(records):
        row = cycles_in_a_row(
            record, table, angle, speeds[place], engine.period, engine.symmetry, where
        )
        known = int(np.isfinite(row.speed[:, 0]).sum())
        if known < FEWEST:
            raise SceneError(
                f"{where} {record.label}: {known} whole cycles; must be at least {FEWEST}"
            )
        fired, without = (
            BAR * np.asarray(design_of(one["pressure"], table, place).values).ravel()
            for one in (computed, motored)
        )
        damping = _damping(given, computed, place, speeds[place])
        try:
            cycle, missing = _mean_cycle(engine, angle, speeds[place], fired, without, damping)
            results.append(_judged(row, cycle, missing, table.wheel, false_alarms, tooth_deviation))
        except ValueError as error:
            raise SceneError(f"{where} {record.label}: {mentioned(error)}") from None
    return _dataset(given, table, [r.label for r in records], results, computed, speeds)


def _check_axes(scene: Scene, name: str) -> None:
    """Refuse a scene with axes of the engine or of words."""
    allowed = {"load", "speed", *CYCLE_KEYS}
    bad = [k for k, v in scene.axes.items() if k not in allowed and len(v) > 1]
    bad += [k for k in scene.designs if k not in allowed]
    if bad:
        raise SceneError(
            f"{name}: the scene varies {', '.join(bad)}; deviations of cylinders need one engine; "
            "only load and speed may vary"
        )


def _computed(scene: Scene, name: str) -> tuple[xr.Dataset, xr.Dataset]:
    """Computed mean cycles, and the pressure of a cylinder that does not burn."""
    from sweeps.running.compute.in_memory import run

    step = scene.angle_step
    # Steps of the computed curves are at most 0.5 degree, because work is summed by trapezia.
    plain = replace(
        scene, quantities=("omega", "delta", "pressure", "load_coefficient"), reference=None,
        fail_on=(), inertia_models=("variable",),
        angle_step=step / np.ceil(step / 0.5 - 1e-9),
    )  # fmt: skip
    silent = replace(
        plain, settings={**scene.settings, "misfire": 1.0}, quantities=("pressure",)
    )  # fmt: skip
    check_crossings(silent, name)
    check_motored(silent, name)
    return run(plain), run(silent)


def _damping(scene: Scene, computed: xr.Dataset, place: int, speed: Floats) -> Floats:
    """Part of the load in c of docs/method.md (141), times the inertia; 0 but for a + k w^alpha."""
    if "power_law" not in scene.words or "load_coefficient" not in computed:
        return np.zeros(speed.size)
    assert scene.measured is not None
    coefficient = np.asarray(
        design_of(computed["load_coefficient"], scene.measured, place).values
    ).ravel()
    (exponent,) = values_of(scene, ["load_exponent"])
    return np.asarray(float(coefficient[0]) * exponent * speed ** (exponent - 2.0))


def _mean_cycle(
    engine: OneEngine, angle: Floats, speed: Floats, fired: Floats, motored: Floats, damping: Floats
) -> tuple[MeanCycle, float]:
    """Mean cycle of an engine with equal cylinders, and the imep that a missed cycle lacks [Pa]."""
    geometry = CylinderGeometry(engine.bore, engine.stroke, engine.crank_ratio)
    combustion = combustion_torque(angle, fired, motored, geometry)
    work = (fired - motored) * geometry.volume_slope(angle)
    missing = float(work.mean()) * engine.period / geometry.swept_volume
    inertia = engine.train(fired[None], 0.0, 0.0, 0.0).inertia[: angle.size]
    cycle = MeanCycle(
        angle, speed, inertia, combustion, engine.firing, engine.period, damping / inertia
    )
    return cycle, missing


def _judged(
    row: CyclesInARow, cycle: MeanCycle, missing: float, wheel: Wheel, false_alarms: float,
    tooth_deviation: float,
) -> _Deviations:  # fmt: skip
    """Deviations of single and mean cycles, and the decisions which are missed or weak."""
    if not row.used.all():
        row = replace(row, speed=_bridged(row))
    good = np.isfinite(row.speed[:, 0])
    # Standard deviation of the mean imep of sound cylinders, over the imep that a misfire lacks
    lasting_share = 0.03
    dispersion = lasting_share * missing
    # Number of rounds of leaving missed cycles out and, in each, of estimating the dispersion
    rounds = 4
    for _ in range(rounds):
        relative, count = _against_others(row.speed, good)
        passage = _passage(relative[good], wheel, count)
        noise = WheelNoise(0.0, 0.0, passage)
        for _ in range(rounds):
            single = work_estimator(
                cycle, wheel, row.start, noise, dispersion=dispersion, reference_cycles=count
            )
            deviations = single.deviations(relative)
            if not np.isfinite(deviations[good]).any(axis=0).all():
                raise ValueError("measured speed: no two consecutive complete cycles")
            dispersion = _dispersion(deviations, single.noise, single.others, dispersion,
                                     count)  # fmt: skip
        of_cycle = _with_estimated(
            detection(single, missing, false_alarms), single, missing,
            int(np.isfinite(deviations).sum()) - deviations.shape[1],
        )  # fmt: skip
        missed = np.asarray((deviations < of_cycle.threshold).any(axis=1))
        kept = np.isfinite(row.speed[:, 0]) & ~_beside(missed)
        if kept.sum() < FEWEST or (kept == good).all():
            break
        good = kept
    lasting = work_estimator(
        cycle, wheel, row.start, WheelNoise(tooth_deviation, 0.0, passage),
        dispersion=float(np.hypot(lasting_share * missing, dispersion / np.sqrt(good.sum()))),
        averaged=int(good.sum()),
    )  # fmt: skip
    through = speed_through_wheel(cycle.angle, cycle.speed, wheel, row.start, cycle.period)
    mean = row.speed[good].mean(axis=0)
    level = float(np.sum(row.width) / np.sum(row.width / mean)) / float(
        np.sum(row.width) / np.sum(row.width / through)
    )
    return _Deviations(
        row, deviations, single.uncertainty,
        lasting.mean_deviations(energy_deviation(mean / level, through)), lasting.uncertainty,
        of_cycle, detection(lasting, missing, false_alarms), missing, dispersion, passage, count,
    )  # fmt: skip


def _bridged(row: CyclesInARow) -> Floats:
    """Speeds; those of intervals far away from their neighbours are interpolated."""
    middle = np.cumsum(row.width) - 0.5 * row.width
    period = float(row.width.sum())
    return np.array([
        np.where(row.used, one, np.interp(middle, middle[row.used], one[row.used], period=period))
        for one in row.speed
    ])  # fmt: skip


def _beside(missed: Booleans) -> Booleans:
    """Cycles with a missed one within the same window: itself and its neighbours."""
    around = missed.copy()
    around[1:] |= missed[:-1]
    around[:-1] |= missed[1:]
    return around


def _against_others(speed: Floats, good: Booleans) -> tuple[Floats, int]:
    """Energy deviation of each cycle from the mean of the other good ones, and their number."""
    total, count = speed[good].sum(axis=0), int(good.sum())
    own = np.where(good[:, None], speed, 0.0)
    reference = (total - own) / (count - good[:, None])
    return energy_deviation(speed, reference), count - 1


def _passage(relative: Floats, wheel: Wheel, count: int) -> float:
    """Error of the passages of teeth, from changes too rough for any torque."""
    # The error follows from fourth differences of the places of teeth that are one pitch apart; the
    # relative speeds are their first differences. The median size of the fourth differences is
    # taken, so that single disturbed pulses do not count.
    turns = relative.shape[1] // wheel.teeth
    even = np.tile(wheel.width < wheel.width.min() * 1.01, turns)
    rough = np.diff(relative, 3, axis=1)
    whole = even[3:] & even[2:-1] & even[1:-2] & even[:-3]
    if not whole.any():
        return 0.2 * TOOTH_DEVIATION
    median = float(np.median(np.abs(rough[:, whole])))
    # Fourth differences (1, 4, 6, 4, 1) of independent numbers of variance 1 have variance 70.
    error = median / SCATTER_OF_MEDIAN / np.sqrt(70.0 * (1.0 + 1.0 / count))
    return max(error, LEAST_PASSAGE)


def _dispersion(
    deviations: Floats, noise: Floats, others: Floats, assumed: float, count: int
) -> float:
    """Dispersion of the imep of normal cycles that explains the scatter of the deviations."""
    spread = np.nanmedian(np.abs(deviations - np.nanmedian(deviations, axis=0))) / SCATTER_OF_MEDIAN
    # Variance of a deviation over that of normal cycles: by the other cylinders' cycles, by the
    # cycle itself, and by the mean over cycles
    each = float(np.mean(others / assumed) ** 2) + 1.0 + 1.0 / count
    left = float(spread) ** 2 - float(np.mean(noise**2))
    return float(np.sqrt(max(left, 0.01 * float(spread) ** 2) / each))


def _with_estimated(
    detection: Detection, single: WorkEstimator, missing: float, count: int
) -> Detection:
    """Threshold for a dispersion that is estimated from some deviations, by Student's distribution.

    Its quantile is the expansion of Abramowitz and Stegun (1964), 26.7.5, from memory.
    """
    # A spread from the median size of numbers is as certain as one from the root mean square of
    # 0.37 times as many (Rousseeuw and Croux 1993, J. Am. Stat. Assoc. 88:1273, from memory).
    freedom = max(0.37 * count, 2.0)
    cylinders = len(detection.threshold)
    z2 = NormalDist().inv_cdf(-np.expm1(np.log1p(-detection.false_alarms) / cylinders)) ** 2
    wider = (
        1.0 + (z2 + 1.0) / (4.0 * freedom) + (5.0 * z2**2 + 16.0 * z2 + 3.0) / (96.0 * freedom**2)
    )
    threshold = wider * detection.threshold
    own = single.dispersion / np.sqrt(single.reference_cycles)
    margin = (threshold + missing) / np.hypot(single.uncertainty, own)
    probability = np.array([NormalDist().cdf(float(one)) for one in margin])
    return replace(detection, threshold=threshold, margin=margin, probability=probability)


# --- labels ---------------------------------------------------------------------------------------


def _dataset(
    scene: Scene, given: Measured, labels: Sequence[str], results: Sequence[_Deviations],
    computed: xr.Dataset, speeds: Floats,
) -> xr.Dataset:  # fmt: skip
    """Results with labels and units."""
    most = max(len(one.single) for one in results)
    cylinders = results[0].single.shape[1]
    every, each, per = ("recording", "recorded_cycle", "cylinder"), ("recording", "cylinder"), (
        "recording",
    )  # fmt: skip
    bar, one = "bar", "1"

    def padded(rows: Sequence[Floats], scale: float = BAR) -> Floats:
        table = np.full((len(rows), most, cylinders), np.nan)
        for place, row in enumerate(rows):
            table[place, : len(row)] = row / scale
        return table

    single = padded([f.single for f in results])
    lasting = np.array([f.lasting for f in results]) / BAR
    singles, lastings = (
        np.array([getattr(f, key) for f in results]) / BAR for key in ("single_std", "lasting_std")
    )
    data: dict[str, Any] = {
        "imep_deviation": (every, single + lasting[:, None, :], bar,
                           "deviation of imep from the mean of the other cylinders"),
        "imep_deviation_of_cycle": (every, single, bar,
                                    "deviation of imep from what is usual for the cylinder"),
        "missed": (every, padded([f.missed.astype(float) for f in results], 1.0), one,
                   "whether the cycle is classified as a misfire (1)"),
        "imep_deviation_std": (each, np.hypot(singles, lastings), bar,
                               "standard deviation of the errors of imep_deviation"),
        "imep_deviation_of_cycle_std": (each, singles, bar,
                                        "standard deviation of the errors of "
                                        "imep_deviation_of_cycle"),
        "missed_threshold": (each, np.array([f.of_cycle.threshold for f in results]) / BAR, bar,
                             "deviation below which a cycle is classified as a misfire"),
        "missed_found": (each, [f.of_cycle.probability for f in results], one,
                         "share of misfires that falls below the threshold"),
        "missed_cycles": (each, [f.missed.sum(axis=0) for f in results], one,
                          "number of cycles classified as misfires"),
        "imep_deviation_lasting": (each, lasting, bar,
                                   "deviation of the mean imep from that of the other cylinders"),
        "imep_deviation_lasting_std": (each, lastings, bar,
                                       "standard deviation of the errors of "
                                       "imep_deviation_lasting"),
        "weak_threshold": (each, np.array([f.of_mean.threshold for f in results]) / BAR, bar,
                           "deviation of the mean imep below which a cylinder is classified as "
                           "weak"),
        "weak": (each, [f.weak.astype(float) for f in results], one,
                 "whether the cylinder is classified as weak (1)"),
        "dead": (each, [(f.weak & (f.lasting < -0.5 * f.missing)).astype(float) for f in results],
                 one, "whether the cylinder lacks more than half of the work of combustion (1)"),
        "imep_of_combustion": (per, [f.missing / BAR for f in results], bar,
                               "imep missing in a misfire"),
        "imep_dispersion": (per, [f.dispersion / BAR for f in results], bar,
                            "standard deviation of the imep of normal cycles, estimated"),
        "tooth_passage": (per, [f.passage for f in results], one,
                          "error of the tooth position over the smallest interval, estimated"),
        "recorded_cycles": (per, [int(np.isfinite(f.row.speed[:, 0]).sum()) for f in results], one,
                            "number of recorded cycles"),
        "reference_cycles": (per, [f.reference_cycles for f in results], one,
                             "number of cycles in the mean with which single cycles are compared"),
        "gap_angle": (per, [f.row.start / DEGREE for f in results], "degree",
                      "crank angle at which the first recorded cycle of the wheel begins"),
    }  # fmt: skip
    coordinates: dict[str, Any] = {
        **of_recordings(labels),
        "recorded_cycle": (("recorded_cycle",), np.arange(1, most + 1, dtype=np.int32), one,
                           "number of the recorded cycle"),
        "cylinder": (("cylinder",), np.arange(1, cylinders + 1, dtype=np.int32), one, "cylinder"),
    }  # fmt: skip
    for key, values in given.at.items():
        if key in computed.coords and key in ("load", "speed"):
            coordinates[key] = (per, np.asarray(values), dict(computed[key].attrs))
    attributes = {
        **computed.attrs,
        "title": scene.title,
        "wheel": given.wheel.text if given.wheel is not None else "",
        "false_alarms": results[0].of_cycle.false_alarms,
        "gap_angle_from": results[0].row.start_from,
        "remarks": "\n".join(_remarks(labels, results, speeds)),
    }
    return labelled_dataset(data, coordinates, attributes, float)


def _remarks(labels: Sequence[str], results: Sequence[_Deviations], speeds: Floats) -> list[str]:
    """Limits of the answers, a line each."""
    remarks = []
    for label, one, speed in zip(labels, results, speeds, strict=True):
        if not one.row.turn_known and "gap_angle" not in one.row.start_from:
            remarks.append(
                f"{label}: the speed does not determine with which turn the recording begins, so "
                "cylinders that fire one turn apart may be interchanged; give the gap_angle of "
                "the first complete turn, counted over the whole cycle"
            )
        measured = float(np.nanmean(one.row.mean))
        remarks += far_speed_remark(label, measured, speed.mean(), "deviations change")
        least = float(one.of_cycle.probability.min())
        if least < 0.99:
            remarks.append(
                f"{label}: at this rate of false alarms only {100.0 * least:.0f} % of misfires "
                "would be found"
            )
    return remarks
