"""Gas, inertia and total torque of the engine over crank angle, as curves.

Each function knows nothing of the others. All broadcast over designs, with the crank angle as the
last dimension. Torque is positive in the sense of rotation and is the whole engine's.

The functions take many parameters, each by itself: any of them may vary between designs, and the
graph of quantities hands each node over under its name.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from engine_dyn.forces.superposition import along_shaft, superpose
from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.cylinder_means import value_of_sets
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount, Member
from engine_dyn.loads.friction import StrokeFriction, mean_parts, stacked_parts
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.motored import row_with_factor
from engine_dyn.types import Floats

__all__ = [
    "friction_over_stroke",
    "gas_torque",
    "inertia_torque",
    "inertia_torque_actual",
    "piston_area",
    "pressure",
    "pressure_of_first",
    "torque_after_throw",
]


MEANS_AT_ONCE = 64
"""Designs whose means of the friction are taken together: each has some thousand points."""


def piston_area(bore: Any) -> Any:
    """Area of the piston [m2]. Kakaitsas (2015), eq. 2.1."""
    return 0.25 * np.pi * bore**2


def pressure(phi: Any, family: Family, row: Any, scale: Any = 1.0, factor: float = 1.0) -> Floats:
    """Absolute cylinder pressure [Pa] at `phi` [rad] of the diagrams at (fractional) rows.

    `phi`, `row` and `scale` broadcast. See `family.Family.locate` for rows, `motored` for the
    factor of a cylinder.
    """
    phi, row = np.broadcast_arrays(np.asarray(phi, float), np.asarray(row, float))
    result = np.empty(phi.shape)
    for value in np.unique(row):
        here = row == value
        first = int(np.floor(value))
        weight = value - first
        curve = (1.0 - weight) * row_with_factor(family, first, factor)(phi[here])
        if weight > 0.0:
            curve += weight * row_with_factor(family, first + 1, factor)(phi[here])
        result[here] = curve
    return result * scale


def pressure_of_first(
    phi: Any, family: Family, row: Any, scale: Any, cylinders: Any, by_count: CylindersByCount
) -> Any:
    """Pressure in cylinder 1 of engines whose cylinders have unequal factors: see `pressure`."""

    def of_first(engine: Cylinders) -> Any:
        return pressure(phi, family, row, scale, engine.pressure_factors[0])

    return value_of_sets(cylinders, by_count, of_first)


def _velocity(phi: Any, crank_ratio: Any, offset: Any, member: Member) -> Any:
    """Piston velocity of a cylinder over the engine's crank radius and speed."""
    own = member.own(crank_ratio, offset)
    return member.radius_factor * slider_crank.velocity(phi, *own)


def _acceleration(phi: Any, crank_ratio: Any, offset: Any, member: Member) -> Any:
    """Piston acceleration of a cylinder over the engine's crank radius and speed squared."""
    own = member.own(crank_ratio, offset)
    return member.radius_factor * slider_crank.acceleration(phi, *own)


def gas_torque(
    phi: Any,
    crank_ratio: Any,
    family: Family,
    row: Any,
    scale: Any,
    crankcase_pressure: Any,
    bore: Any,
    double_radius: Any,
    cylinders: Any,
    period: float,
    offset: Any = 0.0,
    by_count: CylindersByCount | None = None,
) -> Any:
    """Torque of the gas, (p - p_c) A r c/(r omega) [N m]. Kakaitsas (2015), eqs. 2.1, 2.4b, 2.6.

    Here and below, `double_radius` is 2 r [m], the stroke of an engine without offset; `offset` is
    that of the pin's line over the crank radius [1]; `by_count` as in `superpose`.
    """

    def one(angle: Any, member: Member) -> Any:
        gas = pressure(angle, family, row, scale, member.pressure_factor)
        return (gas - crankcase_pressure) * _velocity(angle, crank_ratio, offset, member)

    return (
        piston_area(bore) * 0.5 * double_radius * superpose(one, phi, cylinders, period, by_count)
    )


def inertia_torque(
    phi: Any,
    crank_ratio: Any,
    mass: Any,
    double_radius: Any,
    speed: Any,
    cylinders: Any,
    period: float,
    offset: Any = 0.0,
    by_count: CylindersByCount | None = None,
) -> Any:
    """Torque of the reciprocating masses at constant `speed` [rad/s]: -m r^2 omega^2 b v [N m].

    Kakaitsas (2015), eqs. 2.12, 2.13, 3.3, with reduced acceleration b and velocity v.
    """

    def one(angle: Any, member: Member) -> Any:
        v = _velocity(angle, crank_ratio, offset, member)
        return -_acceleration(angle, crank_ratio, offset, member) * v * member.mass_factor

    return (
        mass * (0.5 * double_radius * speed) ** 2 * superpose(one, phi, cylinders, period, by_count)
    )


def inertia_torque_actual(
    phi: Any,
    crank_ratio: Any,
    mass: Any,
    double_radius: Any,
    omega: Any,
    acceleration: Any,
    cylinders: Any,
    period: float,
    offset: Any = 0.0,
    by_count: CylindersByCount | None = None,
) -> Any:
    """Torque of the reciprocating masses at the solved speed and angular acceleration [N m].

    -m r^2 v (omega^2 b + epsilon v): minus the rate, over angle, of the kinetic energy
    m r^2 v^2 omega^2/2 (Eksergian's equation for one degree of freedom).
    """

    def one(angle: Any, member: Member) -> Any:
        v = _velocity(angle, crank_ratio, offset, member)
        b = _acceleration(angle, crank_ratio, offset, member)
        return -v * (omega**2 * b + acceleration * v) * member.mass_factor

    return mass * (0.5 * double_radius) ** 2 * superpose(one, phi, cylinders, period, by_count)


def friction_over_stroke(
    phi: Any,
    crank_ratio: Any,
    family: Family,
    row: Any,
    scale: Any,
    crankcase_pressure: Any,
    bore: Any,
    double_radius: Any,
    friction_torque: Any,
    shape: StrokeFriction,
    cylinders: Any,
    period: float,
    offset: Any = 0.0,
    by_count: CylindersByCount | None = None,
) -> Any:
    """Friction torque over crank angle [N m], positive, to be subtracted; its mean is given.

    Parameters as `gas_torque`; see `friction.FrictionShape`.
    """
    one = _friction_of_one(crank_ratio, family, row, scale, crankcase_pressure, shape, offset)
    varying = superpose(one, phi, cylinders, period, by_count)
    return friction_torque + piston_area(bore) * 0.5 * double_radius * varying


def _friction_of_one(
    crank_ratio: Any, family: Family, row: Any, scale: Any, crankcase_pressure: Any,
    shape: StrokeFriction, offset: Any,
) -> Callable[[Any, Member], Any]:  # fmt: skip
    """Friction of a cylinder less its mean, over piston area and crank radius [Pa]."""
    weights: dict[tuple[float, ...], Floats] = {}
    inputs = (crank_ratio, row, scale, crankcase_pressure, shape.ring, offset)

    def parts(angle: Any, member: Member, inputs: Any) -> Floats:
        crank_ratio, row, scale, crankcase, ring, offset = inputs
        load = ring + pressure(angle, family, row, scale, member.pressure_factor) - crankcase
        speed = slider_crank.velocity(angle, *member.own(crank_ratio, offset))
        return stacked_parts(load, speed, np.sin(angle))

    def means(member: Member) -> Floats:
        columns = np.broadcast_arrays(*(np.asarray(one, dtype=float) for one in inputs))
        distinct, number = np.unique(
            np.stack([c.reshape(-1) for c in columns]), axis=1, return_inverse=True
        )
        found = np.empty((4, distinct.shape[1]))
        for begin in range(0, distinct.shape[1], MEANS_AT_ONCE):
            here = slice(begin, begin + MEANS_AT_ONCE)
            of_these = [row[here, None] for row in distinct]
            found[:, here] = mean_parts(
                lambda angle: parts(angle, member, of_these),  # noqa: B023
                family.row(0).period,
            )
        return found[:, number.reshape(-1)].reshape(4, *columns[0].shape)

    def one(angle: Any, member: Member) -> Any:
        key = tuple(member[1:])
        if key not in weights:
            mean = means(member)
            weights[key] = np.where(mean > 0.0, mean, np.inf)
        each = parts(angle, member, inputs)
        return sum(
            level * (part / mean - 1.0)
            for level, part, mean in zip(shape.levels, each, weights[key], strict=True)
        )

    return one


def torque_after_throw(
    phi: Any,
    crank_ratio: Any,
    family: Family,
    row: Any,
    scale: Any,
    crankcase_pressure: Any,
    bore: Any,
    double_radius: Any,
    mass: Any,
    speed: Any,
    friction_torque: Any,
    cylinders: Any,
    by_count: CylindersByCount,
    offset: Any = 0.0,
    shape: StrokeFriction | None = None,
) -> Any:
    """Torque in the shaft after each throw, from the last cylinder to the take-off at the first.

    Kakaitsas (2015), section 5.4: T_Z, T_(Z-1) = T_Z + ..., T_1 the whole engine's. Shape
    (..., cylinder, crank angle); throw i along the shaft, with all cylinders on it, is entry i - 1,
    entries past an engine's own throws hold NaN. Each cylinder bears an equal share of the
    friction, over its own stroke where it has a `shape`.
    """
    stroke_friction = None
    if shape is not None:
        stroke_friction = _friction_of_one(
            crank_ratio, family, row, scale, crankcase_pressure, shape, offset
        )
    sets = np.unique(np.asarray(cylinders)).astype(int)
    throws = max(by_count[int(number)].count for number in sets)
    lever = piston_area(bore) * 0.5 * double_radius
    moment = mass * (0.5 * double_radius * speed) ** 2

    def of_cylinder(engine: Cylinders, cylinder: int) -> tuple[Any, ...]:
        """Torque of gas, masses, mean friction and friction over the stroke."""
        member = engine.members[cylinder]
        angle = phi + member.phase
        v = _velocity(angle, crank_ratio, offset, member)
        gas = pressure(angle, family, row, scale, member.pressure_factor)
        b = _acceleration(angle, crank_ratio, offset, member)
        found = (
            lever * (gas - crankcase_pressure) * v,
            -moment * member.mass_factor * b * v,
            -friction_torque / engine.count,
        )
        if stroke_friction is None:
            return found
        return (*found, -lever * stroke_friction(angle, member))

    def behind(throw: int, engine: Cylinders) -> Any:
        """Torque of all cylinders from a throw (from 0) on; NaN past the last one."""
        places = along_shaft(engine)
        if throw >= len(places):
            return np.nan
        total: Any = 0.0
        for cylinder in (c for place in places[throw:] for c in place):
            for part in of_cylinder(engine, cylinder):
                total = total + part
        return total

    pieces = [value_of_sets(cylinders, by_count, partial(behind, throw)) for throw in range(throws)]
    return np.stack(np.broadcast_arrays(*pieces), axis=-2)
