r"""Engine and generator as one rigid rotor, which a synchronous generator holds to the grid.

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

from engine_dyn.time_over_angle import extremes
from engine_dyn.types import Complexes, Floats

EXCITED = 1e-3
"""Part of the largest swing of the free rotor from which on an order counts as excited."""


def torque_from_power(power: Any, pole_pairs: Any, speed: Any) -> Any:
    """Synchronising torque c = P_s p/omega [N m/rad], at the generator.

    `power` P_s [W] belongs to an electrical radian, `speed` omega [rad/s] is the generator's.
    """
    return power * pole_pairs / speed


def natural_frequency(inertia: Any, stiffness: Any) -> Any:
    """Natural frequency without damping, sqrt(c/J) [rad/s].."""
    return np.sqrt(stiffness / inertia)


def damping_ratio(inertia: Any, stiffness: Any, damping: Any) -> Any:
    """Damping ratio, d/(2 sqrt(c J)) [1].."""
    return 0.5 * damping / np.sqrt(stiffness * inertia)


def _dynamic_stiffness(order: Any, speed: Any, inertia: Any, stiffness: Any, damping: Any) -> Any:
    frequency = order * speed
    return stiffness - inertia * frequency**2 + 1j * frequency * damping


def angle_harmonics(
    torque: Any, order: Any, speed: Any, inertia: Any, stiffness: Any, damping: Any
) -> Complexes:
    """Harmonics of the angle against the grid, theta_nu [rad]; everything broadcasts."""
    with np.errstate(divide="ignore", invalid="ignore"):  # an undamped order in resonance
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
    # Between 16 points a period of the highest order a sum of orders is a cubic.
    points = 16 * math.ceil(orders.max() * period / (2.0 * math.pi) - 1e-9)
    angle = period / points * np.arange(points)
    curve = sum_of_orders(harmonics, orders, angle)
    slope = sum_of_orders(1j * orders * np.asarray(harmonics), orders, angle)
    least, largest = extremes(curve, slope, period / points)
    return 0.5 * (largest - least)
