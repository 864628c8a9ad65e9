"""Speed over recorded cycles as an initial-value problem: given torque over angle, one load law.

The train of cycles is not periodic: what the crank did before it began is in its first speed. The
same train closed on itself is there to compare with. docs/method.md (116) to (120).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from engine_dyn import status
from engine_dyn.compilation import kernel
from engine_dyn.geometry.slider_crank import velocity
from engine_dyn.given_numbers import given_number
from engine_dyn.recordings.cylinder_geometry import RecordedCycles
from engine_dyn.types import Floats

# Largest number of steps of Newton's or the Gauss-Newton method; three to six are usual
MOST_STEPS = 60


@dataclass(frozen=True, eq=False)
class TorqueTrain:
    """Torque and inertia over the angle of a train of cycles, and the law of its load."""

    # Gas torque less friction [N m] at the ends and in the middle of n steps; shape (2 n + 1,)
    torque: Floats
    inertia: Floats  # Moment of inertia Theta(phi) [kg m2] at these angles; shape (2 n + 1,)
    step: float  # Angle of one of the n steps [rad]
    # Exponent alpha and constant a [N m] of the load torque a + k omega^alpha.
    exponent: float = 2.0
    constant: float = 0.0

    def __post_init__(self) -> None:
        """Refuse arrays that do not fit together."""
        if self.torque.ndim != 1 or self.torque.size < 3 or self.torque.size % 2 == 0:
            raise ValueError(f"torque: {self.torque.size} values; must be 2 n + 1, at least 3")
        if self.inertia.shape != self.torque.shape:
            raise ValueError(f"inertia: {self.inertia.size} values; the torque has another number")
        if not (np.isfinite(self.torque).all() and np.all(self.inertia > 0.0)):
            raise ValueError("torque and inertia: must be numbers, and the inertia more than 0")
        if not self.step > 0.0:
            raise ValueError(f"step: {self.step:g} rad; must be more than 0")

    @property
    def angle(self) -> Floats:
        """Angles at the ends of steps [rad] from the beginning, shape (n + 1,)."""
        return np.asarray(self.step * np.arange(self.torque.size // 2 + 1), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class SpeedOfTrain:
    """Speed over a train of cycles."""

    # `engine_dyn.status`: converged; stalled, where the speed falls to nothing; not converged.
    status: int
    # Angle from the beginning [rad] and speed [rad/s]; NaN after a stall; shape (n + 1,)
    angle: Floats
    speed: Floats
    # Speed at the beginning [rad/s], and load coefficient k [N m s^alpha].
    start_speed: float
    load_coefficient: float
    # Fraction of a small change of the first energy that is left at the end [1]: docs/method.md
    # (118).
    memory: float
    # Derivatives of the speed with respect to the first speed [1] and to k; shape (n + 1,)
    by_start: Floats
    by_coefficient: Floats


def train_of_cycles(
    cycles: Sequence[RecordedCycles], *, bore: float, stroke: float, crank_ratio: float,
    reciprocating_mass: float, inertia: float, firing_angles: Sequence[float] = (0.0,),
    friction_torque: float = 0.0, crankcase_pressure: float = 101325.0, exponent: float = 2.0,
    constant: float = 0.0,
) -> TorqueTrain:  # fmt: skip
    """Torque and variable inertia over recorded cycles, from their pressures.

    Parameters
    ----------
    cycles : sequence of RecordedCycles
        Absolute pressure of each cylinder, in the order of `firing_angles`, each at angles of its
        own dead centre; uniform angles, the same numbers of cycles and samples.
    bore, stroke : float
        [m].
    crank_ratio : float
        Crank radius over rod length; pins without offset.
    reciprocating_mass, inertia : float
        Per cylinder [kg]; mean of Theta(phi) of engine and load [kg m2].
    firing_angles : sequence of float
        Crank angle at which each cylinder fires [rad], the first 0.
    friction_torque : float
        Of the whole engine [N m], constant over the angle.
    crankcase_pressure : float
        Absolute [Pa].
    exponent, constant : float
        Of the load, see `TorqueTrain`.

    Returns
    -------
    TorqueTrain
        From the first angle of the first cylinder's first cycle, in steps of two samples. Of the
        other cylinders, whose cycles begin later, the last recorded cycle stands for what came
        before their first.

    Raises
    ------
    ValueError
        For cycles that do not fit together or are not uniform.
    """
    first = cycles[0]
    count, shape = len(first.angle), first.pressure.shape
    spacing = first.period / count
    if len(cycles) != len(firing_angles):
        raise ValueError(f"cycles: {len(cycles)} cylinders, {len(firing_angles)} firing angles")
    for one in cycles:
        if one.pressure.shape != shape or one.period != first.period:
            raise ValueError("cycles: all cylinders need as many cycles and samples")
        if not np.allclose(np.diff(one.angle), spacing, rtol=1e-6):
            raise ValueError("cycles: angles must be uniform over the whole cycle")
    total = shape[0] * count
    steps = (total - 1) // 2
    angle = first.angle[0] + spacing * np.arange(2 * steps + 1)
    area_radius = 0.25 * np.pi * bore**2 * 0.5 * stroke
    torque = np.full(angle.size, -float(friction_torque))
    squares = np.zeros(angle.size)
    for one, fires in zip(cycles, firing_angles, strict=True):
        own = angle - fires
        reduced = velocity(own, crank_ratio)
        places = (own - one.angle[0]) / spacing
        pressure = np.interp(places, np.arange(total), one.pressure.reshape(-1), period=total)
        torque += (pressure - crankcase_pressure) * area_radius * reduced
        squares += reduced**2 - np.mean(velocity(one.angle, crank_ratio) ** 2)
    theta = inertia + reciprocating_mass * (0.5 * stroke) ** 2 * squares
    return TorqueTrain(torque, theta, 2.0 * spacing, exponent, constant)


@kernel
def _follow(
    torque: Floats, inertia: Floats, step: float, coefficient: float, exponent: float, start: float
) -> Floats:
    """Energy and two derivatives at steps' ends by Runge and Kutta: docs/method.md (116), (117)."""
    found = np.full((3, torque.size // 2 + 1), math.nan)
    e, s, g = start, 1.0, 0.0
    found[0, 0], found[1, 0], found[2, 0] = e, s, g
    for place in range(found.shape[1] - 1):
        slope_e = slope_s = slope_g = last_e = last_s = last_g = 0.0
        for at, share, weight in ((0, 0.0, 1.0), (1, 0.5, 2.0), (1, 0.5, 2.0), (2, 1.0, 1.0)):
            now = e + share * step * last_e
            if not now > 0.0:
                return found
            power = math.pow(2.0 * now / inertia[2 * place + at], 0.5 * exponent)
            fading = coefficient * exponent * power / (2.0 * now)
            last_s = -fading * (s + share * step * last_s)
            last_g = -power - fading * (g + share * step * last_g)
            last_e = torque[2 * place + at] - coefficient * power
            slope_e += weight * last_e
            slope_s += weight * last_s
            slope_g += weight * last_g
        e += step / 6.0 * slope_e
        s += step / 6.0 * slope_s
        g += step / 6.0 * slope_g
        if not e > 0.0:
            break
        found[0, place + 1], found[1, place + 1], found[2, place + 1] = e, s, g
    return found


def follow_train(train: TorqueTrain, start_speed: float, load_coefficient: float) -> SpeedOfTrain:
    """Integrate the speed of a train from its first speed [rad/s], with k [N m s^alpha]."""
    start_speed = given_number("start_speed", start_speed)
    if not start_speed > 0.0:
        raise ValueError(f"start_speed: {start_speed:g} rad/s; must be more than 0")
    ends = np.ascontiguousarray(train.inertia[::2])
    energy, by_start, by_coefficient = _follow(
        train.torque - train.constant, train.inertia, float(train.step), float(load_coefficient),
        float(train.exponent), 0.5 * ends[0] * start_speed**2,
    )  # fmt: skip
    speed = np.sqrt(2.0 * energy / ends)
    by_energy = 1.0 / (ends * speed)
    return SpeedOfTrain(
        status.STALLED if math.isnan(energy[-1]) else status.CONVERGED, train.angle, speed,
        start_speed, float(load_coefficient), float(by_start[-1]),
        by_start * by_energy * ends[0] * start_speed, by_coefficient * by_energy,
    )  # fmt: skip


def fit_train(
    train: TorqueTrain, edges: Floats, measured: Floats, *, start_speed: float | None = None,
    load_coefficient: float | None = None,
) -> SpeedOfTrain:  # fmt: skip
    """Fit first speed and load coefficient to measured speeds: docs/method.md (119).

    The status is `not_converged` where the steps do not end.

    Parameters
    ----------
    edges : ndarray, shape (m + 1,)
        Ascending angles from the beginning of the train [rad], within it.
    measured : ndarray, shape (m,)
        Angle over time between them [rad/s], such as from tooth to tooth, or the mean speeds of the
        first and the last cycle alone; NaN where there is none. At least two are needed.
    start_speed, load_coefficient : float, optional
        First guesses; without them, the measured mean and the balance of mean torques.
    """
    edges, measured = np.asarray(edges, dtype=float), np.asarray(measured, dtype=float)
    known = np.isfinite(measured)
    if edges.size != measured.size + 1 or np.any(np.diff(edges) <= 0.0):
        raise ValueError("edges: must ascend, one more than measured speeds")
    if edges[0] < 0.0 or edges[-1] > train.angle[-1] * (1.0 + 1e-12):
        raise ValueError("edges: must lie within the train")
    if np.count_nonzero(known) < 2:
        raise ValueError("measured: at least two speeds are needed for first speed and load")

    def defects(speed: SpeedOfTrain) -> tuple[Floats, Floats]:
        slowness, length = 1.0 / speed.speed, np.diff(edges)
        means = length / np.diff(_integral_at(slowness, train, edges))
        slopes = [
            means**2 / length * np.diff(_integral_at(slowness**2 * derivative, train, edges))
            for derivative in (speed.by_start, speed.by_coefficient)
        ]
        return (means - measured)[known], np.stack(slopes, axis=1)[known]

    level = float(np.mean(measured[known]))
    first = level if start_speed is None else start_speed
    return _solved(train, first, load_coefficient, level, defects)


def close_train(train: TorqueTrain, mean_speed: float) -> SpeedOfTrain:
    """Speed of the same train if it repeated for ever: docs/method.md (120).

    `mean_speed` is that over the angle [rad/s]; with exponent 0 the first speed follows from it
    alone. The first speed, less that of the recorded train, is the jump that closing forces on the
    train; it fades as `memory` says.
    """
    mean_speed = given_number("mean_speed", mean_speed)
    if not mean_speed > 0.0:
        raise ValueError(f"mean_speed: {mean_speed:g} rad/s; must be more than 0")
    length = train.angle[-1:]

    def defects(speed: SpeedOfTrain) -> tuple[Floats, Floats]:
        curves = np.stack([speed.speed, speed.by_start, speed.by_coefficient])
        first, last = curves[:, 0], curves[:, -1]
        means = np.stack([_integral_at(one, train, length) for one in curves])[:, 0] / length
        ratios = means / mean_speed
        rise = last[0] / first[0]
        rows = np.stack([(last - rise * first)[1:] / first[0], ratios[1:]])
        return np.array([rise - 1.0, ratios[0] - 1.0]), rows

    return _solved(train, mean_speed, None, mean_speed, defects)


def _integral_at(values: Floats, train: TorqueTrain, at: Floats) -> Floats:
    """Integral over the angle from the beginning, of parabolas through three ends of steps each."""
    step, count = train.step, values.size - 1
    # Mean of the two parabolas that share an interval, one at the ends; a single step has a line.
    bend = np.zeros(count + 1)
    bend[1:-1] = values[2:] - 2.0 * values[1:-1] + values[:-2]
    bend[0], bend[-1] = bend[1], bend[-2]
    parts = step * (0.5 * (values[1:] + values[:-1]) - (bend[1:] + bend[:-1]) / 24.0)
    total = np.concatenate([[0.0], np.cumsum(parts)])
    place = np.clip((at / step).astype(np.int64), 0, count - 1)
    u = at / step - place
    rest = step * u * (values[place] + 0.5 * u * (values[place + 1] - values[place]))
    straight = 0.5 * step * (values[place + 1] + values[place])
    return np.asarray(total[place] + rest + u * u * (3.0 - 2.0 * u) * (parts[place] - straight))


def _solved(
    train: TorqueTrain, start: float, coefficient: float | None, level: float,
    defects: Callable[[SpeedOfTrain], tuple[Floats, Floats]],
) -> SpeedOfTrain:  # fmt: skip
    """Gauss-Newton method for the first speed and k; steps are halved where they stall."""
    if coefficient is None:
        coefficient = (float(train.torque.mean()) - train.constant) / level**train.exponent
    solution = follow_train(train, start, coefficient)
    if solution.status != status.CONVERGED:
        return solution
    for _ in range(MOST_STEPS):
        misses, slopes = defects(solution)
        scale = np.array([solution.start_speed, max(abs(solution.load_coefficient), 1e-300)])
        step, *_ = np.linalg.lstsq(slopes * scale, -misses, rcond=None)
        worth = float(misses @ misses)
        for _ in range(MOST_STEPS):
            speed, load = np.array([solution.start_speed, solution.load_coefficient]) + step * scale
            trial = follow_train(train, speed, load) if speed > 0.0 else None
            if trial is not None and trial.status == status.CONVERGED:
                now, _ = defects(trial)
                if float(now @ now) <= worth * (1.0 + 1e-9) + 1e-300:
                    break
            step = 0.5 * step
        else:
            break
        solution = trial
        # The search ends at this relative change of speed and load coefficient.
        if np.max(np.abs(step)) < 1e-12:
            return solution
    return replace(solution, status=status.NOT_CONVERGED)
