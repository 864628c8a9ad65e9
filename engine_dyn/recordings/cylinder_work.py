"""Work of single cylinders from the speed of a rigid crank: deviations of imep, missed cycles.

A cylinder that does less work than the others leaves a step in the energy of the crank. How large
it is follows from speeds between teeth and a reference for them; docs/method.md (139) to (148).
Level and slope of the energy are unknown in every window, because the mean work and the torque of
the load change both, so only deviations from the mean of the other cylinders are found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from engine_dyn.geometry.toothed_wheel import TURN, Wheel
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry
from engine_dyn.types import Floats, Integers

NORMAL = NormalDist()

LEAST_PASSAGE = 1e-5
"""Least deviation of a passage: below, differences of templates below their errors would count."""


@dataclass(frozen=True, eq=False)
class MeanCycle:
    """Mean cycle of an engine whose cylinders all do the same work.

    Raises
    ------
    ValueError
        For arrays that do not fit together.
    """

    # Crank angles [rad], uniform over one cycle from -period/2, end excluded; shape (samples,)
    angle: Floats
    speed: Floats  # Speed at these angles [rad/s], above 0; shape (samples,)
    inertia: Floats  # Inertia Theta(phi) [kg m2]; shape (samples,)
    # Torque that one cylinder adds for each unit of its imep [m3/rad], with `angle` counted from
    # its own firing dead centre: see `combustion_torque`; shape (samples,)
    combustion: Floats
    firing: Sequence[float]  # Crank angle at which each cylinder fires [rad]
    period: float  # Crank angle of the cycle [rad]
    # Damping c [1/rad] of docs/method.md (141): fraction of an energy deviation that the load's
    # torque takes back; 0 where that torque does not change within a cycle; shape (samples,)
    damping: Floats | float = 0.0

    def __post_init__(self) -> None:
        """Refuse arrays that do not fit together."""
        grid = (np.arange(self.angle.size) / self.angle.size - 0.5) * self.period
        if self.angle.size < 8 or not np.allclose(self.angle, grid, atol=1e-9):
            raise ValueError("angle: must be uniform over one cycle from -period/2")
        for name in ("speed", "inertia", "combustion"):
            if getattr(self, name).shape != self.angle.shape:
                raise ValueError(f"{name}: must have a value for each of {self.angle.size} angles")
        if not (np.all(self.speed > 0.0) and np.all(self.inertia > 0.0)):
            raise ValueError("speed and inertia: must be more than 0")
        if len(self.firing) < 2:
            raise ValueError("firing: a deviation from the other cylinders needs at least two")

    @property
    def swept_volume(self) -> float:
        """Work of one cylinder for each unit of its imep: its swept volume [m3]."""
        return float(self.combustion.mean() * self.period)


@dataclass(frozen=True)
class WheelNoise:
    """Errors of the places of teeth, as fractions of the wheel's smallest interval.

    Raises
    ------
    ValueError
        For errors that are negative, or a smaller passage.
    """

    # Standard deviation of errors of single intervals, which repeat every turn and are unknown; 0
    # where they were corrected.
    interval: float = 0.001
    place: float = 0.0  # Standard deviation of errors of single teeth, which repeat every turn
    # Standard deviation of the place at which a passing tooth is detected, new at each passage:
    # edge detection, counter, vibration of the sensor. At least 1e-5, to include what a model of
    # the crank does not describe.
    passage: float = 0.0002

    def __post_init__(self) -> None:
        """Refuse noise that leaves nothing to chance: then nothing can be weighed."""
        if not (self.interval >= 0.0 and self.place >= 0.0 and self.passage >= LEAST_PASSAGE):
            raise ValueError(
                f"wheel noise: errors must not be negative, and passage at least {LEAST_PASSAGE:g}"
            )

    def covariance(self, wheel: Wheel, first: int, intervals: int, cycles: float = 1.0) -> Floats:
        """Covariance of relative speeds, docs/method.md (143).

        Parameters
        ----------
        wheel : Wheel
            Its pattern.
        first, intervals : int
            The first interval, counted from any first tooth after the longest gap, and how many.
        cycles : float
            Number of cycles over which the speeds are averaged.
        """
        tooth = (first + np.arange(intervals + 1)) % wheel.teeth
        size = wheel.width.min() / wheel.width[tooth[:-1]]
        same = (tooth[:, None] == tooth).astype(float)
        places = self.place**2 * same + self.passage**2 / cycles * np.eye(intervals + 1)
        total = np.diff(np.diff(places, axis=0), axis=1) + self.interval**2 * same[:-1, :-1]
        return np.asarray(size[:, None] * total * size)


@dataclass(frozen=True, eq=False)
class WorkEstimator:
    """Weights that turn speeds of a cycle into deviations of imep, one row a cylinder."""

    # Deviation of imep [Pa] for each energy deviation of a window of one cycle; shape (cylinders,
    # intervals)
    weights: Floats
    # First interval of each cylinder's window, counted from the first tooth of the cycle. Windows
    # are centred at half of the cylinder's work and reach into neighbouring cycles; shape
    # (cylinders,)
    first: Integers
    # Standard deviation of imep deviations by errors of teeth [Pa], over wheels and cycles; shape
    # (cylinders,)
    noise: Floats
    # Standard deviation of imep deviations by dispersion of all other cycles [Pa]; shape
    # (cylinders,)
    others: Floats
    dispersion: float  # Standard deviation of the imep of normal cycles [Pa]
    # Number of earlier cycles in the mean that each cycle is compared with; infinite where it is
    # compared with a computed speed.
    reference_cycles: float

    @property
    def uncertainty(self) -> Floats:
        """Standard deviation of a deviation of which only the errors are not known [Pa]."""
        return np.hypot(self.noise, self.others)

    def deviations(self, relative: Floats) -> Floats:
        """Deviation of imep of every cylinder in every cycle from the mean of the others.

        Parameters
        ----------
        relative : ndarray, shape (cycles, intervals)
            From `energy_deviation`; cycles follow each other.

        Returns
        -------
        ndarray, shape (cycles, cylinders)
            [Pa]; NaN where a window leaves the recording, which is so in the first or last cycles.
        """
        cycles, intervals = relative.shape
        if intervals != self.weights.shape[1]:
            raise ValueError(
                f"speeds: {intervals} intervals a cycle; the wheel has {self.weights.shape[1]}"
            )
        row = relative.ravel()
        deviation = np.full((cycles, len(self.first)), np.nan)
        windows = np.lib.stride_tricks.sliding_window_view(row, intervals)
        for place, (weights, first) in enumerate(zip(self.weights, self.first, strict=True)):
            starts = first + intervals * np.arange(cycles)
            inside = (starts >= 0) & (starts < len(windows))
            # The answer does not depend on the level; removing the level first avoids rounding.
            some = windows[starts[inside]]
            deviation[inside, place] = (some - some.mean(axis=1, keepdims=True)) @ weights
        return deviation

    def mean_deviations(self, relative: Floats) -> Floats:
        """Deviation of the mean imep of every cylinder, for an estimator of persistent ones.

        Parameters
        ----------
        relative : ndarray, shape (intervals,)
            Mean of `energy_deviation` over cycles; it repeats every cycle.

        Returns
        -------
        ndarray, shape (cylinders,)
            [Pa]
        """
        turned = np.array([np.roll(relative, -first) for first in self.first])
        return np.asarray(np.sum((turned - relative.mean()) * self.weights, axis=1))


@dataclass(frozen=True, eq=False)
class Detection:
    """How a missing imep is told from normal cycles."""

    # Deviation of imep [Pa], negative, below which a cycle counts as misfired; shape (cylinders,)
    threshold: Floats
    # How far the mean deviation of imep in missed cycles is below the threshold, over the standard
    # deviation of these deviations; shape (cylinders,)
    margin: Floats
    probability: Floats  # Probability that a missed cycle is detected; shape (cylinders,)
    false_alarms: float  # Probability of a false alarm in one cycle of the engine


def combustion_torque(
    angle: Floats, pressure: Floats, motored: Floats, geometry: CylinderGeometry
) -> Floats:
    """Torque that combustion adds for each unit of imep [m3/rad], docs/method.md (140).

    Parameters
    ----------
    angle : ndarray, shape (samples,)
        From the firing dead centre of the cylinder [rad], uniform over one cycle.
    pressure, motored : ndarray, shape (samples,)
        Of the same cylinder with and without combustion [Pa].
    geometry : CylinderGeometry
        Bore, stroke, crank ratio and offset.

    Raises
    ------
    ValueError
        Where combustion adds no work.
    """
    torque = (pressure - motored) * geometry.volume_slope(angle)
    work = float(torque.sum() * (angle[1] - angle[0]))
    if not work > 0.0:
        raise ValueError("pressure: does no more work than the motored pressure")
    return np.asarray(torque * (geometry.swept_volume / work))


def energy_deviation(raw: Floats, reference: Floats) -> Floats:
    """Deviation of the energy from its reference over twice the latter, docs/method.md (139).

    Parameters
    ----------
    raw, reference : ndarray, shape (..., intervals)
        Raw speeds of cycles [rad/s], and what they are compared with: the computed speed seen
        through the wheel, or the mean of earlier cycles.
    """
    return np.asarray(0.5 * ((raw / reference) ** 2 - 1.0))


def mean_of_earlier(raw: Floats, count: int) -> Floats:
    """Mean of the cycles before each one: a reference in which errors of teeth cancel.

    Parameters
    ----------
    raw : ndarray, shape (cycles, intervals)
        Raw speeds [rad/s].
    count : int
        How many cycles before.

    Returns
    -------
    ndarray, shape (cycles, intervals)
        NaN for the first `count` cycles.
    """
    if not 1 <= count < len(raw):
        raise ValueError(f"count = {count}: must be 1 to {len(raw) - 1}, of {len(raw)} cycles")
    total = np.cumsum(raw, axis=0)
    means = np.full(raw.shape, np.nan)
    means[count] = total[count - 1]
    means[count + 1 :] = total[count:-1] - total[: -count - 1]
    return means / count


def work_estimator(
    cycle: MeanCycle,
    wheel: Wheel,
    gap_angle: float,
    noise: WheelNoise,
    *,
    dispersion: float = 0.0,
    reference_cycles: float = np.inf,
    averaged: int | None = None,
) -> WorkEstimator:
    """Best linear unbiased estimator of each deviation, docs/method.md (142) to (145).

    Parameters
    ----------
    cycle : MeanCycle
        Mean cycle at this speed and load.
    wheel : Wheel
        Its pattern.
    gap_angle : float
        Crank angle at which the first tooth after the longest gap passes in a cycle [rad].
    noise : WheelNoise
        Errors of the teeth.
    dispersion : float
        Standard deviation of the imep of normal cycles [Pa]; with `averaged`, of the mean imep of
        the cylinders.
    reference_cycles : float
        Number of cycles of `mean_of_earlier`, where that is the reference: what repeats every turn
        cancels then. Infinite for a computed speed.
    averaged : int, optional
        Deviations that are the same in all of so many cycles, of which the mean speed is taken; for
        `WorkEstimator.mean_deviations`. Without it, each cycle deviates by itself.
    """
    turns = round(cycle.period / TURN)
    intervals = turns * wheel.teeth
    if np.isfinite(reference_cycles):
        noise = WheelNoise(0.0, 0.0, noise.passage * np.sqrt(1.0 + 1.0 / reference_cycles))
    spread = dispersion * np.sqrt(1.0 + 1.0 / reference_cycles)
    starts = _edges(wheel, gap_angle, 0, intervals)[:-1]
    middle = _middle_of_work(cycle)
    weights = np.empty((len(cycle.firing), intervals))
    first = np.empty(len(cycle.firing), dtype=np.int64)
    errors, others = np.empty(len(first)), np.empty(len(first))
    for place, firing in enumerate(cycle.firing):
        begin = firing + middle - 0.5 * cycle.period
        whole = np.round((begin - starts) / cycle.period)
        miss = np.abs(begin - starts - whole * cycle.period)
        first[place] = int(np.argmin(miss)) + intervals * int(whole[np.argmin(miss)])
        edges = _edges(wheel, gap_angle, int(first[place]), intervals)
        own, rest, nuisance = _templates(cycle, edges, place, averaged is not None)
        known = np.column_stack([own, own + rest.sum(axis=1), nuisance])
        teeth = noise.covariance(wheel, int(first[place]), intervals, float(averaged or 1))
        row = _best_row(known, spread * rest, teeth)
        weights[place] = row
        errors[place] = np.sqrt(row @ teeth @ row)
        others[place] = spread * np.linalg.norm(row @ rest)
    return WorkEstimator(weights, first, errors, others, dispersion, float(reference_cycles))


def detection(estimator: WorkEstimator, missing: float, false_alarms: float = 1e-4) -> Detection:
    """Threshold for a wanted rate of false alarms, and how many missed cycles it finds.

    docs/method.md (146) and (147): all errors are normally distributed, and wheels are drawn too
    where the errors of their teeth are not known.

    Parameters
    ----------
    estimator : WorkEstimator
        See there.
    missing : float
        imep that a missed cycle lacks [Pa]: that of the mean cycle less that of a motored one.
    false_alarms : float
        Probability of a false alarm in one cycle of the engine, all cylinders together.
    """
    if not 0.0 < false_alarms < 1.0:
        raise ValueError(f"false_alarms = {false_alarms:g}: must be between 0 and 1")
    own = estimator.dispersion
    each = -np.expm1(np.log1p(-false_alarms) / len(estimator.first))
    kept = own * np.sqrt(1.0 + 1.0 / estimator.reference_cycles)
    normal = np.hypot(estimator.uncertainty, kept)
    missed = np.hypot(estimator.uncertainty, own / np.sqrt(estimator.reference_cycles))
    threshold = NORMAL.inv_cdf(each) * normal
    margin = (threshold + missing) / missed
    return Detection(threshold, margin, np.array([NORMAL.cdf(x) for x in margin]), false_alarms)


def _edges(wheel: Wheel, gap_angle: float, first: int, intervals: int) -> Floats:
    """Angles of the teeth of a window; its first interval may be negative."""
    tooth = first + np.arange(intervals + 1)
    turn, place = np.divmod(tooth, wheel.teeth)
    return np.asarray(gap_angle + TURN * turn + wheel.angle[place])


def _middle_of_work(cycle: MeanCycle) -> float:
    """Angle after firing dead centre at which half of the combustion's work is done [rad]."""
    done = np.cumsum(cycle.combustion)
    return float(cycle.angle[np.flatnonzero(done >= 0.5 * done[-1])[0]])


def _templates(
    cycle: MeanCycle, edges: Floats, cylinder: int, persistent: bool
) -> tuple[Floats, Floats, Floats]:
    """Effect of a unit of imep on the energy deviations of a window, docs/method.md (142).

    Returns arrays with a row for each interval: that of the cycle in the window's middle [1/Pa];
    those of all other cycles in it (of all other cylinders where deviations persist); and level and
    slope of the energy, scaled.
    """
    count = cycle.angle.size
    step = cycle.period / count
    at = edges[0] + (edges[-1] - edges[0]) * np.arange(count + 1) / count
    place = (at - cycle.angle[0]) / step

    def over_window(values: Floats | float) -> Floats:
        curve = np.broadcast_to(values, cycle.angle.shape)
        return np.asarray(
            np.interp(place % count, np.arange(count + 1), np.append(curve, curve[0]))
        )

    speed, inertia = over_window(cycle.speed), over_window(cycle.inertia)
    fading = np.exp(-_integral(over_window(cycle.damping), step))
    weight = 1.0 / speed

    def seen(torque: Floats) -> Floats:
        energy = fading * _integral(torque / fading, step)
        return _means(energy / (inertia * speed**2), weight, at, edges)

    def burning(firing: float, cycles: Sequence[int]) -> Floats:
        torque = np.zeros(at.size)
        for shift in cycles:
            torque += np.interp(
                at - firing - shift * cycle.period, cycle.angle, cycle.combustion, 0.0, 0.0
            )
        return seen(torque)

    centre = 0.5 * (edges[0] + edges[-1]) - _middle_of_work(cycle)
    nearest = [round((centre - firing) / cycle.period) for firing in cycle.firing]
    own, rest = np.zeros(edges.size - 1), []
    for number, firing in enumerate(cycle.firing):
        near = [nearest[number] + shift for shift in (-1, 0, 1)]
        if persistent:
            together = burning(firing, near)
            own = together if number == cylinder else own
            rest += [] if number == cylinder else [together]
            continue
        for shift in near:
            one = burning(firing, [shift])
            if number == cylinder and shift == nearest[number]:
                own = one
            elif np.any(one):
                rest.append(one)
    level = _means(fading / (inertia * speed**2), weight, at, edges)
    slope = seen(np.ones(at.size))
    nuisance = np.column_stack([level / np.abs(level).max(), slope / np.abs(slope).max()])
    return own, np.column_stack(rest), nuisance


def _integral(values: Floats, step: float) -> Floats:
    """Integral from the first sample on, by the trapezoidal rule."""
    parts = 0.5 * step * (values[1:] + values[:-1])
    return np.concatenate([[0.0], np.cumsum(parts)])


def _means(values: Floats, weight: Floats, at: Floats, edges: Floats) -> Floats:
    """Weighted means of values between neighbouring edges."""
    step = float(at[1] - at[0])
    upper, lower = (
        np.diff(np.interp(edges, at, _integral(curve, step))) for curve in (values * weight, weight)
    )
    return np.asarray(upper / lower)


def _best_row(known: Floats, drawn: Floats, covariance: Floats) -> Floats:
    """Weights of the estimate of the first unknown, docs/method.md (144).

    Rows are measurements: `known` has their responses to the unknowns, `drawn` those to random
    numbers of variance 1, `covariance` that of their errors. As the covariance of both is nearly
    singular, random numbers are treated as further unknowns, each measured once as 0.
    """
    scale = np.linalg.norm(known, axis=0)
    lower = np.linalg.cholesky(covariance)
    white = np.linalg.solve(lower, np.hstack([known / scale, drawn]))
    unknowns, others = known.shape[1], drawn.shape[1]
    prior = np.hstack([np.zeros((others, unknowns)), np.eye(others)])
    orthogonal, upper = np.linalg.qr(np.vstack([white, prior]))
    first = np.linalg.solve(upper.T, np.eye(unknowns + others)[0])  # first row of upper^-1
    row = orthogonal[: len(known)] @ first
    return np.asarray(np.linalg.solve(lower.T, row) / scale[0])
