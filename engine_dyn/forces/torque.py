"""Gas, inertia and total torque of the engine over crank angle, as curves.

Each function knows nothing of the others. All broadcast over designs, with the crank angle as the
last dimension. Torque is positive in the sense of rotation and is the whole engine's.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.cylinders import EQUAL, Cylinders, CylindersByCount, Member
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
    "superpose",
    "torque_after_throw",
]


MEANS_AT_ONCE = 64
"""Designs whose means of the friction are taken together: each has some thousand points."""


def piston_area(bore: Any) -> Any:
    """Area of the piston [m2]. Kakaitsas (2015), eq. 2.1."""
    return 0.25 * np.pi * bore**2


def pressure(phi: Any, family: Family, row: Any, scale: Any = 1.0, factor: float = 1.0) -> Floats:
    """Absolute cylinder pressure [Pa] at `phi` [rad] of the diagrams at (fractional) rows.

    `phi`, `row` and `scale` broadcast. See `indicator.Family.locate` for rows, `motored` for the
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
    counts = np.asarray(cylinders)
    total: Any = np.nan
    for count in np.unique(counts):
        factor = by_count[int(count)].pressure_factors[0]
        total = np.where(counts == count, pressure(phi, family, row, scale, factor), total)
    return total


def _velocity(phi: Any, crank_ratio: Any, offset: Any, member: Member) -> Any:
    """Piston velocity of a cylinder over the engine's crank radius and speed."""
    own = member.own(crank_ratio, offset)
    return member.radius_factor * slider_crank.velocity(phi, *own)


def _acceleration(phi: Any, crank_ratio: Any, offset: Any, member: Member) -> Any:
    """Piston acceleration of a cylinder over the engine's crank radius and speed squared."""
    own = member.own(crank_ratio, offset)
    return member.radius_factor * slider_crank.acceleration(phi, *own)


def superpose(
    curve: Callable[[Any, Member], Any],
    phi: Any,
    cylinders: Any,
    period: float,
    by_count: CylindersByCount | None = None,
) -> Any:
    """Sum of a cylinder's curve over all cylinders. Kakaitsas (2015), eqs. 5.1-5.3.

    The curve is evaluated at the shifted angles themselves, for a cylinder whose factors it may
    use; `cylinders` broadcasts with `phi`. They are keys of `by_count`, or numbers of evenly firing
    equal cylinders.
    """
    counts = np.asarray(cylinders)
    others = {z: c for z, c in (by_count or {}).items() if not c.plain and (counts == z).any()}
    total: Any = 0.0
    if not np.isin(counts, list(others)).all():
        numbers = counts.astype(float)
        for key, engine in (by_count or {}).items():
            numbers = np.where(counts == key, float(engine.count), numbers)
        for i in range(int(numbers.max())):
            term = curve(phi - i * period / numbers, EQUAL)
            total = total + (term if i == 0 else np.where(i < numbers, term, 0.0))
    for count, engine in others.items():
        whole = sum(curve(phi + member.phase, member) for member in engine.members)
        total = np.where(counts == count, whole, total)
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
    offset: Any = 0.0,
    by_count: CylindersByCount | None = None,
) -> Any:
    """Torque of the gas, (p - p_c) A r c/(r omega) [N m]. Kakaitsas (2015), eqs. 2.1, 2.4b, 2.6.

    Here and below, `stroke` is two crank radii where there is an offset, and `offset` that of the
    pin's line over the crank radius; `by_count` as in `superpose`.
    """

    def one(angle: Any, member: Member) -> Any:
        gas = pressure(angle, family, row, scale, member.pressure_factor)
        return (gas - crankcase_pressure) * _velocity(angle, crank_ratio, offset, member)

    return piston_area(bore) * 0.5 * stroke * superpose(one, phi, cylinders, period, by_count)


def inertia_torque(
    phi: Any,
    crank_ratio: Any,
    mass: Any,
    stroke: Any,
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

    return mass * (0.5 * stroke * speed) ** 2 * superpose(one, phi, cylinders, period, by_count)


def inertia_torque_actual(
    phi: Any,
    crank_ratio: Any,
    mass: Any,
    stroke: Any,
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

    return mass * (0.5 * stroke) ** 2 * superpose(one, phi, cylinders, period, by_count)


def friction_over_stroke(
    phi: Any,
    crank_ratio: Any,
    family: Family,
    row: Any,
    scale: Any,
    crankcase_pressure: Any,
    bore: Any,
    stroke: Any,
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
    return friction_torque + piston_area(bore) * 0.5 * stroke * varying


def _friction_of_one(
    crank_ratio: Any, family: Family, row: Any, scale: Any, crankcase_pressure: Any,
    shape: StrokeFriction, offset: Any,
) -> Callable[[Any, Member], Any]:  # fmt: skip
    """Friction of a cylinder less its mean, over piston area and crank radius [Pa]."""
    weights: dict[tuple[float, ...], Floats] = {}
    inputs = (crank_ratio, row, scale, crankcase_pressure, shape.ring, offset)

    def parts(angle: Any, member: Member, inputs: Any) -> Floats:
        ratio, row, scale, crankcase, ring, offset = inputs
        load = ring + pressure(angle, family, row, scale, member.pressure_factor) - crankcase
        speed = slider_crank.velocity(angle, *member.own(ratio, offset))
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
    stroke: Any,
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
    rubbing = None
    if shape is not None:
        rubbing = _friction_of_one(
            crank_ratio, family, row, scale, crankcase_pressure, shape, offset
        )
    counts = np.unique(np.asarray(cylinders)).astype(int)
    throws = max(by_count[int(count)].count for count in counts)
    lever = piston_area(bore) * 0.5 * stroke
    moment = mass * (0.5 * stroke * speed) ** 2
    pieces = []
    for throw in range(throws):
        total: Any = np.nan
        for count in counts:
            engine = by_count[int(count)]
            if throw >= len(_places(engine)):
                continue
            part: Any = 0.0
            for cylinder in (c for place in _places(engine)[throw:] for c in place):
                member = engine.members[cylinder]
                angle = phi + member.phase
                v = _velocity(angle, crank_ratio, offset, member)
                gas = pressure(angle, family, row, scale, member.pressure_factor)
                part = part + lever * (gas - crankcase_pressure) * v
                b = _acceleration(angle, crank_ratio, offset, member)
                part = part - moment * member.mass_factor * b * v
                part = part - friction_torque / engine.count
                if rubbing is not None:
                    part = part - lever * rubbing(angle, member)
            total = np.where(np.asarray(cylinders) == count, part, total)
        pieces.append(total)
    return np.stack(np.broadcast_arrays(*pieces), axis=-2)


def _places(engine: Cylinders) -> tuple[tuple[int, ...], ...]:
    places = engine.along_shaft
    if places is None:
        raise ValueError(f"{len(engine.members)} cylinders: their order along the shaft is unknown")
    return places
