"""Gas, inertia and total torque of the engine over crank angle, as curves.

Each function knows nothing of the others. All broadcast over designs, with the crank angle as the
last dimension. Torque is positive in the sense of rotation and is the whole engine's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn import slider_crank
from engine_dyn.arrangement import phases_along_shaft
from engine_dyn.indicator import Family

__all__ = [
    "gas_torque",
    "inertia_torque",
    "inertia_torque_actual",
    "piston_area",
    "pressure",
    "superpose",
    "torque_after_throw",
]

Floats = npt.NDArray[np.float64]


def piston_area(bore: Any) -> Any:
    """Area of the piston [m2]. Kakaitsas (2015), eq. 2.1."""
    return 0.25 * np.pi * bore**2


def pressure(phi: Any, family: Family, row: Any, scale: Any = 1.0) -> Floats:
    """Absolute cylinder pressure [Pa] at `phi` [rad] of the diagrams at (fractional) rows.

    `phi`, `row` and `scale` broadcast. See `indicator.Family.locate` for rows.
    """
    phi, row = np.broadcast_arrays(np.asarray(phi, float), np.asarray(row, float))
    result = np.empty(phi.shape)
    for value in np.unique(row):
        here = row == value
        first = int(np.floor(value))
        weight = value - first
        curve = (1.0 - weight) * family.row(first)(phi[here])
        if weight > 0.0:
            curve += weight * family.row(first + 1)(phi[here])
        result[here] = curve
    return result * scale


def superpose(curve: Callable[[Any], Any], phi: Any, cylinders: Any, period: float) -> Any:
    """Sum of one cylinder's curve over evenly firing cylinders. Kakaitsas (2015), eqs. 5.1-5.3.

    The curve is evaluated at the shifted angles themselves; `cylinders` broadcasts with `phi`.
    """
    cylinders = np.asarray(cylinders, float)
    total: Any = 0.0
    for i in range(int(cylinders.max())):
        term = curve(phi - i * period / cylinders)
        total = total + (term if i == 0 else np.where(i < cylinders, term, 0.0))
    return total


def gas_torque(
    phi: Any,
    crank_ratio: Any,
    family: Family,
    row: Any,
    scale: Any,
    crankcase_pressure: Any,
    bore: Any,
    stroke: Any,
    cylinders: Any,
    period: float,
) -> Any:
    """Torque of the gas, (p - p_c) A r c/(r omega) [N m]. Kakaitsas (2015), eqs. 2.1, 2.4b, 2.6."""

    def one(angle: Any) -> Any:
        over = pressure(angle, family, row, scale) - crankcase_pressure
        return over * slider_crank.velocity(angle, crank_ratio)

    return piston_area(bore) * 0.5 * stroke * superpose(one, phi, cylinders, period)


def inertia_torque(
    phi: Any, crank_ratio: Any, mass: Any, stroke: Any, speed: Any, cylinders: Any, period: float
) -> Any:
    """Torque of the reciprocating masses at constant `speed` [rad/s]: -m r^2 omega^2 b v [N m].

    Kakaitsas (2015), eqs. 2.12, 2.13, 3.3, with reduced acceleration b and velocity v.
    """

    def one(angle: Any) -> Any:
        v = slider_crank.velocity(angle, crank_ratio)
        return -slider_crank.acceleration(angle, crank_ratio) * v

    return mass * (0.5 * stroke * speed) ** 2 * superpose(one, phi, cylinders, period)


def inertia_torque_actual(
    phi: Any,
    crank_ratio: Any,
    mass: Any,
    stroke: Any,
    omega: Any,
    acceleration: Any,
    cylinders: Any,
    period: float,
) -> Any:
    """Torque of the reciprocating masses at the solved speed and angular acceleration [N m].

    -m r^2 v (omega^2 b + epsilon v): minus the rate, over angle, of the kinetic energy
    m r^2 v^2 omega^2/2 (Eksergian's equation for one degree of freedom).
    """

    def one(angle: Any) -> Any:
        v = slider_crank.velocity(angle, crank_ratio)
        return -v * (omega**2 * slider_crank.acceleration(angle, crank_ratio) + acceleration * v)

    return mass * (0.5 * stroke) ** 2 * superpose(one, phi, cylinders, period)


def torque_after_throw(
    phi: Any,
    crank_ratio: Any,
    family: Family,
    row: Any,
    scale: Any,
    crankcase_pressure: Any,
    bore: Any,
    stroke: Any,
    mass: Any,
    speed: Any,
    friction_torque: Any,
    cylinders: Any,
    orders: Mapping[int, tuple[int, ...]],
    period: float,
) -> Any:
    """Torque in the shaft after each throw, from the last cylinder to the take-off at the first.

    Kakaitsas (2015), section 5.4: T_Z, T_(Z-1) = T_Z + ..., T_1 the whole engine's. Shape
    (..., cylinder, crank angle); throw i is entry i - 1, entries past an engine's own count hold
    NaN. Each cylinder bears an equal share of the friction.
    """
    counts = np.unique(np.asarray(cylinders)).astype(int)
    throws = int(counts.max())
    lever = piston_area(bore) * 0.5 * stroke
    moment = mass * (0.5 * stroke * speed) ** 2
    pieces = []
    for throw in range(throws):
        total: Any = np.nan
        for count in counts:
            if throw >= count:
                continue
            phase = phases_along_shaft(orders[int(count)], period)
            part: Any = 0.0
            for cylinder in range(throw, count):
                angle = phi + phase[cylinder]
                v = slider_crank.velocity(angle, crank_ratio)
                over = pressure(angle, family, row, scale) - crankcase_pressure
                part = part + lever * over * v
                part = part - moment * slider_crank.acceleration(angle, crank_ratio) * v
                part = part - friction_torque / count
            total = np.where(np.asarray(cylinders) == count, part, total)
        pieces.append(total)
    return np.stack(np.broadcast_arrays(*pieces), axis=-2)
