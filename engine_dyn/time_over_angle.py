r"""Time over the crank angle of a speed that repeats, and the deviation from uniform rotation.

With the speed omega over the crank angle phi, and Omega = 2 pi k/T where a cycle of k turns takes
the time T:

    t(phi) = integral of dphi/omega              theta(phi) = phi - Omega t(phi) - mean,

where the mean over the time is subtracted. The speed is known at equal steps of one cycle; the
integral is exact for what these samples of 1/omega resolve.

Engine and generator as one rigid rotor, which a synchronous generator holds to the grid.

The deviation theta of the rotor's angle from that of the grid, in the sense of rotation, follows

    J theta'' + d theta' + c theta = M(t),         M(t) = sum_nu Re M_nu exp(i nu omega t),

with the synchronising torque c per radian, the damping torque d per speed, both at the crank, and
the torque of gas and reciprocating masses at the constant mean speed omega. Hence

    theta_nu = M_nu/(c - J nu^2 omega^2 + i nu omega d),

which without c and d is theta_nu = -M_nu/(J nu^2 omega^2), the deviation of the free rotor.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from engine_dyn.types import Complexes, Floats


def time_harmonics(speed: Any, period: float) -> tuple[Floats, Complexes, Floats]:
    """Time over the angle, t = mean (phi - phi_0) + 2 Re sum_k T_k exp(i rate_k (phi - phi_0)).

    Parameters
    ----------
    speed : ndarray, shape (..., samples)
        [rad/s] at equal steps of one cycle from phi_0, its end left out.
    period : float
        Angle of the cycle [rad].

    Returns
    -------
    mean : ndarray, shape (...)
        Mean of 1/omega [s/rad].
    terms : ndarray, shape (..., samples // 2)
        T_k [s].
    rate : ndarray, shape (samples // 2,)
        Periods of each per radian, times 2 pi.
    """
    speed = np.asarray(speed, dtype=float)
    samples = speed.shape[-1]
    slowness = np.fft.rfft(1.0 / speed) / samples
    if samples % 2 == 0:
        slowness[..., -1] = 0.0  # samples do not determine the phase of the highest order
    rate = 2.0 * np.pi / period * np.arange(1, slowness.shape[-1])
    return slowness[..., 0].real, slowness[..., 1:] / (1j * rate), rate


def cycle_time(speed: Any, period: float) -> Any:
    """Duration of a cycle [s] of `period` [rad], from its speed [rad/s] at equal steps."""
    return period * _mean(1.0 / np.asarray(speed))


def duration(speed: Any, first: float, begin: Any, end: Any, period: float) -> Any:
    """Time from one crank angle to the next time that another is reached [s].

    Parameters
    ----------
    speed, period
        As of `time_harmonics`.
    first : float
        Angle of the first sample [rad].
    begin, end : array_like, shape (..., 1) or ()
        [rad]; where they are the same angle, the time is that of a whole cycle.
    """
    mean, terms, rate = time_harmonics(speed, period)
    width = period - np.mod(np.asarray(begin) - end, period)
    ends = np.exp(1j * rate * (begin + width - first)) - np.exp(1j * rate * (begin - first))
    swing = 2.0 * np.sum(np.ascontiguousarray((terms * ends).real), axis=-1)
    return mean * (width[..., 0] if width.ndim else width) + swing


def angle_deviation(speed: Any, period: float) -> Floats:
    """Deviation of the angle from uniform rotation [rad], at the samples of the speed.

    `speed` [rad/s] is at equal steps of a cycle of `period` [rad]. Positive: the shaft is ahead.
    """
    mean, terms, _ = time_harmonics(speed, period)
    samples = np.shape(speed)[-1]
    padded = np.concatenate([np.zeros((*terms.shape[:-1], 1)), terms], axis=-1)
    deviation = -np.fft.irfft(padded * samples, n=samples) / mean[..., None]
    return np.asarray(deviation - _mean(deviation / speed)[..., None] / mean[..., None])


def extremes(curve: Any, slope: Any, step: float) -> tuple[Floats, Floats]:
    """Least and largest value of a periodic curve, between its points too.

    Parameters
    ----------
    curve, slope : ndarray, shape (..., points)
        Values at equal steps of one cycle, and their slope over the angle. Between two points lies
        the cubic that has both values and both slopes.
    step : float
        [rad].
    """
    low, high = -_tops(-np.asarray(curve), -np.asarray(slope), step), _tops(curve, slope, step)
    return low.min(axis=-1), high.max(axis=-1)


def cycle_ranges(curve: Any, slope: Any, step: float, cycles: int) -> Floats:
    """Range of a curve within each of the cycles of its period, shape (..., cycles).

    `curve` and its `slope` are at equal steps [rad]; all cycles have as many points, and their end.
    """
    shape = *np.shape(curve)[:-1], cycles, -1
    low, high = -_tops(-np.asarray(curve), -np.asarray(slope), step), _tops(curve, slope, step)
    end = np.roll(np.reshape(curve, shape)[..., 0], -1, axis=-1)
    most = np.maximum(high.reshape(shape).max(axis=-1), end)
    return np.asarray(most - np.minimum(low.reshape(shape).min(axis=-1), end))


def between(curve: Any, slope: Any, step: float, place: Floats) -> Floats:
    """Values of a periodic curve between its points, those of the cubics of `extremes`.

    `place` are steps from the first point.
    """
    left = np.floor(place + 1e-9).astype(np.int64)
    x = np.maximum(place - left, 0.0)
    here = np.asarray(curve)
    left = left % here.shape[-1]
    right = (left + 1) % here.shape[-1]
    first, last = step * np.asarray(slope)[..., left], step * np.asarray(slope)[..., right]
    change = here[..., right] - here[..., left]
    square, cube = 3.0 * change - 2.0 * first - last, first + last - 2.0 * change
    return np.asarray(here[..., left] + x * (first + x * (square + x * cube)))


def _tops(curve: Any, slope: Any, step: float) -> Floats:
    """Largest value from each point on, of a x + b x^2 + c x^3 at a/(sqrt(b^2 - 3 a c) - b)."""
    values, slopes = np.array(curve, dtype=float), np.asarray(slope)
    inside = np.nonzero((slopes > 0.0) & (np.roll(slopes, -1, axis=-1) < 0.0))
    behind = (*inside[:-1], (inside[-1] + 1) % values.shape[-1])
    first, last = step * slopes[inside], step * slopes[behind]
    change = values[behind] - values[inside]
    square, cube = 3.0 * change - 2.0 * first - last, first + last - 2.0 * change
    place = first / (np.sqrt(square**2 - 3.0 * first * cube) - square)
    values[inside] += place * (first + place * (square + place * cube))
    return values


def deviation_harmonics(deviation: Any, speed: Any, angle: Any, orders: Floats) -> Complexes:
    """Harmonics over the time, theta_nu of sum_nu Re theta_nu exp(i nu Omega t) [rad].

    Parameters
    ----------
    deviation, speed : ndarray, shape (..., samples)
        As of `angle_deviation`.
    angle : ndarray, shape (samples,)
        Crank angles [rad].
    orders : ndarray, shape (orders,)
        nu, periods per turn.

    Returns
    -------
    ndarray, shape (..., orders)
    """
    slowness = 1.0 / np.asarray(speed)
    weighted = deviation * slowness / _mean(slowness)[..., None]
    uniform = angle - np.asarray(deviation)  # Omega t, the angle of uniform rotation
    harmonics = [2.0 * _mean(weighted * np.exp(-1j * order * uniform)) for order in orders]
    return np.stack(harmonics, axis=-1)


def _mean(curve: Any) -> Any:
    """Mean along the last axis; with this order in memory, bits do not depend on other rows."""
    return np.ascontiguousarray(curve).mean(axis=-1)


EXCITED = 1e-3  # Fraction of the free rotor's largest swing above which an order counts as excited


def torque_from_power(power: Any, pole_pairs: Any, speed: Any) -> Any:
    """Synchronising torque c = P_s p/omega [N m/rad], at the generator.

    `power` P_s [W] belongs to an electrical radian, `speed` omega [rad/s] is the generator's.
    """
    return power * pole_pairs / speed


def natural_frequency(inertia: Any, stiffness: Any) -> Any:
    """Natural frequency without damping, sqrt(c/J) [rad/s]."""
    return np.sqrt(stiffness / inertia)


def damping_ratio(inertia: Any, stiffness: Any, damping: Any) -> Any:
    """Damping ratio, d/(2 sqrt(c J)) [1]."""
    return 0.5 * damping / np.sqrt(stiffness * inertia)


def _dynamic_stiffness(order: Any, speed: Any, inertia: Any, stiffness: Any, damping: Any) -> Any:
    frequency = order * speed
    return stiffness - inertia * frequency**2 + 1j * frequency * damping


def angle_harmonics(
    torque: Any, order: Any, speed: Any, inertia: Any, stiffness: Any, damping: Any
) -> Complexes:
    """Harmonics of the angle against the grid, theta_nu [rad]; everything broadcasts."""
    with np.errstate(divide="ignore", invalid="ignore"):  # an undamped resonance divides by 0
        return np.asarray(torque / _dynamic_stiffness(order, speed, inertia, stiffness, damping))


def amplification(order: Any, speed: Any, inertia: Any, stiffness: Any, damping: Any) -> Any:
    """Amplitude of an order over that of the free rotor; infinite in resonance without damping."""
    dynamic = np.abs(_dynamic_stiffness(order, speed, inertia, stiffness, damping))
    with np.errstate(divide="ignore"):
        return inertia * (order * speed) ** 2 / dynamic


def power_harmonics(angle: Any, order: Any, speed: Any, stiffness: Any, damping: Any) -> Any:
    """Harmonics of the power to the grid, omega (c + i nu omega d) theta_nu [W]."""
    return speed * (stiffness + 1j * order * speed * damping) * angle


def nearest_order(order: Any, natural: Any, torque: Any) -> Any:
    """The excited order that is nearest to the natural one; orders are along the last axis.

    An order is excited where its torque, `torque` M_nu, moves the free rotor by at least `EXCITED`
    of what the order that moves it most does.
    """
    free = np.abs(torque) / np.square(order)
    excited = free >= EXCITED * np.max(free, axis=-1, keepdims=True)
    distance = np.where(excited, np.abs(order - np.asarray(natural)), np.inf)
    orders = np.broadcast_to(order, distance.shape)
    place = np.argmin(distance, axis=-1)[..., None]
    nearest = np.take_along_axis(orders, place, axis=-1)[..., 0]
    known = np.isfinite(np.take_along_axis(distance, place, axis=-1)[..., 0])
    return np.where(known, nearest, np.nan)


def nearness(band: Any, nearest: Any, natural: Any) -> Any:
    """Band over the relative distance of an order from the natural one; infinite in resonance."""
    with np.errstate(divide="ignore"):
        return band / np.abs(nearest / natural - 1.0)


def sum_of_orders(harmonics: Any, orders: Floats, angle: Floats) -> Floats:
    """Sum of Re Q_nu exp(i nu phi) over the last axis of `harmonics`, at angles phi [rad]."""
    values = np.asarray(harmonics)
    total = np.zeros((*values.shape[:-1], angle.size))
    for place, order in enumerate(orders):
        total += (values[..., place, None] * np.exp(1j * order * angle)).real
    return total


def half_range(harmonics: Any, orders: Floats, period: float) -> Floats:
    """Half of the range over the cycle of a sum of orders: see `sum_of_orders`.

    `period` is the angle of the cycle [rad].
    """
    # 16 points in each period of the highest order suffice: cubics between them represent the sum.
    points = 16 * math.ceil(orders.max() * period / (2.0 * math.pi) - 1e-9)
    angle = period / points * np.arange(points)
    curve = sum_of_orders(harmonics, orders, angle)
    slope = sum_of_orders(1j * orders * np.asarray(harmonics), orders, angle)
    least, largest = extremes(curve, slope, period / points)
    return 0.5 * (largest - least)
