"""Torque over an angle and torque over a speed: curves through points, or in closed form.

Sources
-------
Slopes of the monotone interpolant: Brodlie's formula, as in Fritsch and Butland, SIAM J. Sci. Stat.
Comput. 5 (1984), 300 (by the documentation of NAG's e01be, which says so; the paper itself was not
compared), and SciPy's PchipInterpolator.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.given_numbers import given_array
from engine_dyn.periodic_spline import monotone_slopes, periodic_spline_slopes
from engine_dyn.types import Floats

REVOLUTION = 2.0 * math.pi
MOST_REVOLUTIONS = 64  # Largest number of revolutions in the period of a torque over an angle
FEWEST_POINTS = 8
# Of a torque in closed form: highest order, largest number of orders, most periods of the highest
HIGHEST_ORDER, MOST_ORDERS, MOST_PERIODS = 256.0, 200, 4096

LARGEST = 1e12  # Largest torque and speed of a table, far above those of any machine

ENDS_TOLERANCE = 0.02
"""Largest difference of the torques at both ends of a period, over the range of the torque."""

ROUNDING = 1e-6  # Fraction of an interval by which rounding may put a speed beyond a table's end

ALIKE = 1e-9  # Fraction of its range by which a torque may differ from one repetition to the next

WHOLE = 1e-5  # Relative difference of a whole number of repetitions: gear ratios are decimals


@dataclass(frozen=True, eq=False)
class TorqueOverAngle:
    """A torque over an angle: a periodic cubic spline.

    That of a load is positive against the rotation, that of an engine with it.

    Attributes
    ----------
    angle : ndarray, shape (K,)
        Ascending knots within one period [rad].
    torque, slope : ndarray, shape (K,)
        Torque [N m] and its derivative at the knots [N m/rad].
    period : float
        A whole number of revolutions [rad].
    own_angle : bool
        Whether the angle is that of the load's shaft, and so its torque; else the crank's.
    """

    angle: Floats
    torque: Floats
    slope: Floats
    period: float
    own_angle: bool = False

    def __str__(self) -> str:
        whose = "its own angle" if self.own_angle else "the crank angle"
        return (
            f"torque over {whose}, {math.degrees(self.period):g} degrees, {len(self.angle)} points,"
            f" mean {self.mean:.4g} N m"
        )

    def __call__(self, theta: npt.ArrayLike) -> Floats:
        """Torque [N m] at any angles [rad], docs/method.md (43)."""
        t, _, _, y0, m0, c, d = self._pieces(given_array("theta", theta))
        return np.asarray(y0 + t * (m0 + t * (c + t * d)))

    def slope_at(self, theta: npt.ArrayLike) -> Floats:
        """Derivative of the torque [N m/rad] at any angles [rad]."""
        t, step, _, _, m0, c, d = self._pieces(given_array("theta", theta))
        return np.asarray((m0 + t * (2.0 * c + t * 3.0 * d)) / step)

    def work(self, theta: npt.ArrayLike) -> Floats:
        """Integral of the torque less its mean [J], docs/method.md (43), within one period."""
        t, step, before, *_ = self._pieces(given_array("theta", theta))
        _, torque, slope, work = self.table
        y0, y1 = torque[before], torque[before + 1]
        m0, m1 = step * slope[before], step * slope[before + 1]
        c, d = 3.0 * (y1 - y0) - 2.0 * m0 - m1, 2.0 * (y0 - y1) + m0 + m1
        done = step * t * (y0 + t * (m0 / 2.0 + t * (c / 3.0 + t * d / 4.0)))
        return np.asarray(work[before] + done)

    def _pieces(self, theta: npt.ArrayLike) -> tuple[Any, ...]:
        """Place t in an interval, the interval, its knot, and coefficients of its cubic in t."""
        knots = np.append(self.angle, self.angle[0] + self.period)
        place = self.angle[0] + np.mod(np.asarray(theta, float) - self.angle[0], self.period)
        before = np.clip(np.searchsorted(knots, place, side="right") - 1, 0, len(self.angle) - 1)
        step = knots[before + 1] - knots[before]
        after = (before + 1) % len(self.angle)
        y0, y1 = self.torque[before], self.torque[after]
        m0, m1 = step * self.slope[before], step * self.slope[after]
        c, d = 3.0 * (y1 - y0) - 2.0 * m0 - m1, 2.0 * (y0 - y1) + m0 + m1
        return (place - knots[before]) / step, step, before, y0, m0, c, d

    @cached_property
    def mean(self) -> float:
        """Mean over the angle [N m]: exact for the spline."""
        step = np.diff(self.angle, append=self.angle[0] + self.period)
        whole = step * 0.5 * (self.torque + np.roll(self.torque, -1))
        bent = step**2 / 12.0 * (self.slope - np.roll(self.slope, -1))
        return float((whole + bent).sum() / self.period)

    @cached_property
    def repeats(self) -> int:
        """How often the torque repeats within its period: found, not declared."""
        within = ALIKE * max(float(np.ptp(self.torque - self.torque.mean())), 1e-300)
        # Most candidates for the number of repetitions fail at the steepest knot, and need not be
        # tried at all the others.
        steepest = int(np.argmax(np.abs(self.slope)))
        number = np.arange(len(self.angle), 1, -1)
        there = self(self.angle[steepest] + self.period / number)
        for times in number[np.abs(there - self.torque[steepest]) <= within].tolist():
            shift = self.period / times
            if all(
                np.abs(self(self.angle + sign * shift) - self.torque).max() <= within
                for sign in (1.0, -1.0)
            ):
                return int(times)
        return 1

    @cached_property
    def table(self) -> Floats:
        """Knots to the end of the period, torque without its mean, slope, and its work there."""
        angle = np.append(self.angle, self.angle[0] + self.period)
        torque = np.append(self.torque, self.torque[0]) - self.mean
        slope = np.append(self.slope, self.slope[0])
        step = np.diff(angle)
        whole = step * 0.5 * (torque[:-1] + torque[1:]) + step**2 / 12.0 * (slope[:-1] - slope[1:])
        return np.stack([angle, torque, slope, np.concatenate([[0.0], np.cumsum(whole)])])


@dataclass(frozen=True, eq=False)
class TorqueOverSpeed:
    """Torque over a speed, between the knots a cubic that is monotone where these are.

    Attributes
    ----------
    speed : ndarray, shape (K,)
        Ascending [rad/s].
    torque, slope : ndarray, shape (K,)
        Torque [N m] and its derivative there [N m s/rad].
    own_speed : bool
        Whether the speed is that of the load's shaft, and so its torque; else the crank's.
    """

    speed: Floats
    torque: Floats
    slope: Floats
    own_speed: bool = False

    def __str__(self) -> str:
        low, high = (speed * 30.0 / math.pi for speed in (self.low, self.high))
        whose = "its own speed" if self.own_speed else "the crank speed"
        return f"torque over {whose} from {low:.6g} to {high:.6g} rpm, {len(self.speed)} points"

    @property
    def low(self) -> float:
        """Lowest speed [rad/s]."""
        return float(self.speed[0])

    @property
    def high(self) -> float:
        """Highest speed [rad/s]."""
        return float(self.speed[-1])

    def __call__(self, omega: npt.ArrayLike) -> Floats:
        """Torque [N m] at any speeds [rad/s]; NaN outside the table."""
        given = given_array("omega", omega)
        before = np.clip(np.searchsorted(self.speed, given, side="right") - 1, 0,
                         len(self.speed) - 2)  # fmt: skip
        step = self.speed[before + 1] - self.speed[before]
        t = (given - self.speed[before]) / step
        y0, y1 = self.torque[before], self.torque[before + 1]
        m0, m1 = step * self.slope[before], step * self.slope[before + 1]
        c, d = 3.0 * (y1 - y0) - 2.0 * m0 - m1, 2.0 * (y0 - y1) + m0 + m1
        value = y0 + t * (m0 + t * (c + t * d))
        return np.asarray(np.where((t >= -ROUNDING) & (t <= 1.0 + ROUNDING), value, np.nan))


def torque_over_angle(
    angle: npt.ArrayLike, torque: npt.ArrayLike, own_angle: bool = False
) -> TorqueOverAngle:
    """Torque through points over whole revolutions.

    Parameters
    ----------
    angle : array_like, shape (K,)
        Ascending [rad]; both ends of the period are the same angle: one may be missing, both are
        averaged. The period is as many whole revolutions as the points cover, `MOST_REVOLUTIONS` at
        most; no gap is wider than an eighth of it, or of two revolutions where it is longer.
    torque : array_like, shape (K,)
        [N m], at the shaft whose angle is given: of a load positive against the rotation, of an
        engine positive with it.
    own_angle : bool
        Whether the angle is that of the load's shaft; else the crank's, from firing dead centre.

    Raises
    ------
    ValueError
        Naming the point, for what is no such torque.
    """
    theta, values = given_array("angle", angle).copy(), given_array("torque", torque).copy()
    _check_points(theta, values, "angle", math.degrees(1.0), "degree", FEWEST_POINTS)
    span, gap = float(theta[-1] - theta[0]), float(np.diff(theta).max())
    revolutions = math.ceil((span - 1e-9) / REVOLUTION)
    period = revolutions * REVOLUTION
    if period - span > 1.5 * gap or revolutions > MOST_REVOLUTIONS:
        raise ValueError(
            f"angle covers {math.degrees(span):.6g} degrees: must cover whole revolutions, "
            f"{MOST_REVOLUTIONS} at most, without a gap at the ends"
        )
    widest = int(np.argmax(np.diff(theta)))
    widest_allowed = min(period, 2.0 * REVOLUTION) / FEWEST_POINTS
    if gap > widest_allowed * (1.0 + 1e-9):
        raise ValueError(
            f"point {widest + 2}: angle = {math.degrees(theta[widest + 1]):.6g} degree after "
            f"{math.degrees(theta[widest]):.6g}: a gap of {math.degrees(gap):.6g}, allowed are "
            f"{math.degrees(widest_allowed):.6g}"
        )
    if abs(period - span) <= 1e-9 * period:
        if abs(values[-1] - values[0]) > ENDS_TOLERANCE * np.ptp(values):
            raise ValueError(
                f"torque is {values[0]:.6g} at the beginning of the period and {values[-1]:.6g} "
                f"at its end, the same angle: must agree within {100.0 * ENDS_TOLERANCE:g} % of "
                "its range"
            )
        values[0] = 0.5 * (values[0] + values[-1])
        theta, values = theta[:-1], values[:-1]
    slope = periodic_spline_slopes(theta, values, period)
    return TorqueOverAngle(theta, values, slope, period, own_angle)


def torque_of_harmonics(
    mean: float, harmonics: Mapping[float, tuple[float, float]], own_angle: bool = False
) -> TorqueOverAngle:
    """Torque in closed form, M = a_0 + sum over orders nu of a sin(nu theta) + b cos(nu theta).

    The period is the shortest of whole revolutions. Knots are so close that the spline, whose
    slopes at the knots are exact, misses less than 1e-10 of an amplitude.

    Parameters
    ----------
    mean : float
        a_0 [N m].
    harmonics : mapping
        a and b [N m] of each order nu, which is a fraction of whole numbers, such as 0.5 and 3; at
        most `HIGHEST_ORDER`.
    own_angle : bool
        As of `torque_over_angle`.

    Raises
    ------
    ValueError
        For orders that are no such fractions, or above the highest, and for numbers that are none.

    Examples
    --------
    >>> torque = torque_of_harmonics(25e3, {3: (-8e3, 0.0)})
    >>> round(torque.mean), round(float(torque(np.pi / 6)))
    (25000, 17000)
    """
    revolutions = 1
    for order in harmonics:
        if not 0.0 < order <= HIGHEST_ORDER:
            raise ValueError(f"order = {order:g}: must be above 0 and at most {HIGHEST_ORDER:g}")
        fraction = Fraction(order).limit_denominator(MOST_REVOLUTIONS)
        if abs(fraction - order) > WHOLE:
            raise ValueError(
                f"order = {order:g}: must repeat within {MOST_REVOLUTIONS} revolutions, as 0.5 does"
                f"; the nearest that does is {fraction}, {float(fraction):.6g}"
            )
        revolutions = math.lcm(revolutions, fraction.denominator)
    if revolutions > MOST_REVOLUTIONS:
        raise ValueError(
            f"orders repeat together after {revolutions} revolutions: must be at most "
            f"{MOST_REVOLUTIONS}"
        )
    if revolutions * max(harmonics, default=0.0) > MOST_PERIODS:
        raise ValueError(
            f"order = {max(harmonics):g}: has more than {MOST_PERIODS} periods in the "
            f"{revolutions} revolutions after which all orders repeat"
        )
    # At least 720 knots in a revolution, and 480 in a period of the highest harmonic.
    count = revolutions * max(720, math.ceil(480 * max(harmonics, default=0.0)))
    theta: Floats = np.arange(count, dtype=np.float64) * (revolutions * REVOLUTION / count)
    torque: Floats = np.full(count, float(mean))
    slope: Floats = np.zeros(count)
    for order, (sine, cosine) in harmonics.items():
        exact = round(order * revolutions) / revolutions
        s, c = np.sin(exact * theta), np.cos(exact * theta)
        torque = torque + sine * s + cosine * c
        slope = slope + exact * (sine * c - cosine * s)
    _check_points(theta, torque, "angle", math.degrees(1.0), "degree", FEWEST_POINTS)
    return TorqueOverAngle(theta, torque, slope, revolutions * REVOLUTION, own_angle)


def superposed(one: TorqueOverAngle, phases: Sequence[float]) -> TorqueOverAngle:
    """Sum of a torque at the angles theta + phase [rad], as of cylinders that fire in turn.

    Knots are evenly spaced, as those of `torque_of_harmonics`, which then lose nothing.

    Examples
    --------
    >>> cylinder = torque_of_harmonics(10.0, {1: (0.0, 5.0), 2: (3.0, 0.0)})
    >>> both = superposed(cylinder, [0.0, math.pi])
    >>> round(both.mean, 9), round(float(both(math.pi / 4)), 9)
    (20.0, 26.0)
    """
    turns = round(one.period / REVOLUTION)
    count = max(one.angle.size, 720 * turns)
    theta = one.angle[0] + np.arange(count) * (one.period / count)
    torque = sum((one(theta + phase) for phase in phases), np.zeros(count))
    slope = sum((one.slope_at(theta + phase) for phase in phases), np.zeros(count))
    return TorqueOverAngle(theta, torque, slope, one.period, one.own_angle)


def torque_over_speed(
    speed: npt.ArrayLike, torque: npt.ArrayLike, driver: bool = False, own_speed: bool = False
) -> TorqueOverSpeed:
    """Torque through points over a speed.

    Parameters
    ----------
    speed : array_like, shape (K,)
        Ascending [rad/s].
    torque : array_like, shape (K,)
        [N m]: a load's against the rotation, a driver's with it; a driver may brake at some speeds.
    driver : bool
        Whose torque it is.
    own_speed : bool
        Whether speed and torque are those of the load's shaft; else of the crank.

    Raises
    ------
    ValueError
        Naming the point, for what is no such torque.
    """
    omega, values = given_array("speed", speed).copy(), given_array("torque", torque).copy()
    _check_points(omega, values, "speed", 30.0 / math.pi, "rpm", 2)
    if omega[0] < 0.0:
        raise ValueError(f"point 1: speed = {omega[0] * 30.0 / math.pi:.6g} rpm: must be 0 or more")
    if not driver and (values < 0.0).any():
        first = int(np.argmax(values < 0.0))
        raise ValueError(
            f"point {first + 1}: torque = {values[first]:.6g} N m: must be 0 or more; a load "
            "torque is positive against the rotation"
        )
    return TorqueOverSpeed(omega, values, monotone_slopes(omega, values), own_speed)


def _check_points(
    place: Floats, torque: Floats, name: str, size: float, unit: str, fewest: int
) -> None:
    if place.ndim != 1 or place.shape != torque.shape:
        raise ValueError(f"{name} and torque must be equally long lists")
    for what, values in ((name, place), ("torque", torque)):
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise ValueError(f"point {bad[0] + 1}: {what} must be a finite number")
        bad = np.flatnonzero(np.abs(values) > LARGEST)
        if bad.size:
            raise ValueError(
                f"point {bad[0] + 1}: {what} = {values[bad[0]]:.6g}: must be at most {LARGEST:g}"
            )
    if len(place) < fewest:
        raise ValueError(f"{len(place)} points: must be at least {fewest}")
    back = np.flatnonzero(np.diff(place) <= 0.0)
    if back.size:
        i = int(back[0]) + 1
        raise ValueError(
            f"point {i + 1}: {name} = {place[i] * size:.6g} {unit} after {place[i - 1] * size:.6g}:"
            " must ascend"
        )


SAMPLES_OF_TURN = 2048


def highest_order(torque: TorqueOverAngle | None) -> float:
    """Highest order of a torque, of its own shaft, with a hundredth of the largest amplitude.

    Examples
    --------
    >>> highest_order(torque_of_harmonics(2.0, {0.5: (10.0, 0.0), 24: (0.0, 1.0), 30: (0.0, 0.01)}))
    24.0
    """
    if torque is None:
        return 0.0
    turns = round(torque.period / (2.0 * math.pi))
    angles = np.arange(turns * SAMPLES_OF_TURN) * (2.0 * math.pi / SAMPLES_OF_TURN)
    amplitude = np.abs(np.fft.rfft(torque(angles)))[1:]
    # Only orders with an amplitude above one hundredth of the largest count.
    counting = np.flatnonzero(amplitude > 0.01 * amplitude.max(initial=0.0))
    return float(counting[-1] + 1) / turns if counting.size else 0.0
