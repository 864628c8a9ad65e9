"""Gas, inertia and total torque of the engine over crank angle, as curves.

Each function knows nothing of the others. All broadcast over designs, with the crank angle as the
last dimension. Torque is positive in the sense of rotation and is the whole engine's.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.forces.superposition import CrankTrain, along_shaft
from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.cylinder_means import value_of_sets
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount, Member
from engine_dyn.geometry.firing_sequence import PressureFactor
from engine_dyn.loads.friction import StrokeFriction, mean_parts, stacked_parts
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.pressure.diagram import values_of_each
from engine_dyn.pressure.family import Family, own_diagrams
from engine_dyn.pressure.motored import over_cycles, pressures_of_rows, row_with_factor
from engine_dyn.types import Floats

MEANS_AT_ONCE = 64
"""Designs whose mean frictions are computed together: each has some thousand points."""


def piston_area(bore: Any) -> Any:
    """Area of the piston [m2]. Kakaitsas (2015), eq. 2.1."""
    return 0.25 * np.pi * bore**2


def pressure(
    phi: Any, family: Family, row: Any, scale: Any = 1.0, factor: PressureFactor = 1.0
) -> Floats:
    """Absolute cylinder pressure [Pa] at `phi` [rad] of the diagrams at (fractional) rows.

    `phi`, `row` and `scale` broadcast. See `family.Family.locate` for rows, `motored` for the
    factor of a cylinder.
    """
    if isinstance(factor, tuple):
        one = partial(pressure, phi, family, row, scale)
        return np.asarray(over_cycles(one, phi, factor, family.period))
    if isinstance(family, CycleTable):
        return np.asarray(family.pressures(phi, row, factor) * scale)
    angle, place = np.asarray(phi, float), np.asarray(row, float)
    below = np.floor(place)
    weight, first = place - below, below.astype(np.int64)
    rows = np.unique(np.concatenate([first.reshape(-1), np.ceil(place).astype(np.int64).ravel()]))
    common = angle.size == (angle.shape[-1] if angle.ndim else 1)
    if common and place.shape[-1:] in ((), (1,)):  # all designs have the same angles
        table = pressures_of_rows(family, rows, angle.reshape(-1), factor)
        at = np.searchsorted(rows, first.reshape(-1))
        after = np.minimum(at + (weight.reshape(-1) > 0.0), rows.size - 1)
        share = weight.reshape(-1, 1)
        result = (1.0 - share) * table[at] + share * table[after]
        return result.reshape(np.broadcast_shapes(angle.shape, place.shape)) * scale
    angle, at, weight = np.broadcast_arrays(angle, np.searchsorted(rows, first), weight)
    known = [row_with_factor(family, index, factor) for index in rows.tolist()]
    result = (1.0 - weight) * values_of_each(known, at, angle)
    between = weight > 0.0
    if between.any():
        share = weight[between]
        result[between] += share * values_of_each(known, at[between] + 1, angle[between])
    return np.asarray(result * scale)


def pressure_of_first(
    phi: Any, family: Family, row: Any, scale: Any, cylinders: Any, by_count: CylindersByCount
) -> Any:
    """Pressure in cylinder 1 of engines whose cylinders differ: see `pressure`."""

    def of_first(engine: Cylinders) -> Any:
        first = engine.members[0]
        own = own_diagrams(family, first.diagram)
        return pressure(phi + first.phase, own, row, scale, first.pressure_factor)

    return value_of_sets(cylinders, by_count, of_first)


class GasPressure(NamedTuple):
    """Pressure in the cylinders of designs, from their diagrams; arrays broadcast."""

    family: Family  # Indicator diagrams of the engine
    row: Any  # (Fractional) row of the family's table, see `family.Family.locate`
    scale: Any  # Factor on the pressure of the diagram [1]
    crankcase: Any  # Absolute pressure under the piston, in the crankcase [Pa]

    def difference(self, phi: Any, member: Member, train: CrankTrain) -> Any:
        """Pressure in a cylinder less that in the crankcase, p - p_c [Pa].

        It acts on the engine's piston area: that of a cylinder with another bore is multiplied by
        the factor on the area.
        """
        angle = member.diagram_angle(phi, train.crank_ratio, train.offset)
        family = own_diagrams(self.family, member.diagram)
        gas = pressure(angle, family, self.row, self.scale, member.pressure_factor)
        difference = gas - self.crankcase
        return difference if member.bore_factor == 1.0 else member.area_factor * difference


def gas_torque(phi: Any, train: CrankTrain, bore: Any, gas: GasPressure) -> Any:
    """Torque of the gas, (p - p_c) A r c/(r omega) [N m].

    docs/method.md (28); Kakaitsas (2015), eqs. 2.1, 2.4b, 2.6. Here and below, `phi` is the crank
    angle [rad], `bore` in [m].
    """

    def one(angle: Any, member: Member) -> Any:
        return gas.difference(angle, member, train) * train.velocity(angle, member)

    return piston_area(bore) * 0.5 * train.double_radius * train.superpose(one, phi)


def reciprocating_inertia(phi: Any, train: CrankTrain, mass: Any) -> Any:
    """Moment of inertia of the reciprocating masses at the crank, m r^2 sum v^2 [kg m2].

    docs/method.md (20); Kakaitsas (2015), eq. 3.2, with the reduced velocity v of each piston and
    the mass of one cylinder [kg].
    """
    squares = train.superpose(lambda angle, member: train.square(angle, member)[0], phi)
    return mass * (0.5 * train.double_radius) ** 2 * squares


def inertia_torque(phi: Any, train: CrankTrain, mass: Any, speed: Any) -> Any:
    """Torque of the reciprocating masses at constant speed, -m r^2 omega^2 b v [N m].

    docs/method.md (24); Kakaitsas (2015), eqs. 2.12, 2.13, 3.3, with reduced acceleration b and
    velocity v; `mass` of one cylinder [kg], `speed` of the crank [rad/s].
    """
    slopes = train.superpose(lambda angle, member: -0.5 * train.square(angle, member)[1], phi)
    return mass * (0.5 * train.double_radius * speed) ** 2 * slopes


def inertia_torque_actual(
    phi: Any, train: CrankTrain, mass: Any, omega: Any, acceleration: Any
) -> Any:
    """Torque of the reciprocating masses at the solved speed and angular acceleration [N m].

    -m r^2 v (omega^2 b + epsilon v), docs/method.md (12) and (26): minus the rate, over angle, of
    the kinetic energy m r^2 v^2 omega^2/2 (Eksergian's equation). `mass` of one cylinder
    [kg]; omega [rad/s] and epsilon [rad/s2] over the crank angle.
    """

    def one(angle: Any, member: Member) -> Any:
        square, slope = train.square(angle, member)
        return -0.5 * omega**2 * slope - acceleration * square

    return mass * (0.5 * train.double_radius) ** 2 * train.superpose(one, phi)


def friction_over_stroke(
    phi: Any, train: CrankTrain, bore: Any, gas: GasPressure, friction_torque: Any,
    friction: StrokeFriction,
) -> Any:  # fmt: skip
    """Friction torque over crank angle [N m], positive, to be subtracted.

    docs/method.md (32). `friction_torque` is its mean [N m]; see `friction.FrictionShape` for the
    parts of `friction`.
    """
    varying = train.superpose(friction_of_cylinder(train, gas, friction), phi)
    return friction_torque + piston_area(bore) * 0.5 * train.double_radius * varying


def friction_of_cylinder(
    train: CrankTrain, gas: GasPressure, friction: StrokeFriction,
    known: dict[tuple[Any, ...], Floats] | None = None,
) -> Callable[[Any, Member], Any]:  # fmt: skip
    """Friction of a cylinder less its mean, over piston area and crank radius [Pa]."""
    weights = {} if known is None else known
    inputs = (train.crank_ratio, gas.row, gas.scale, gas.crankcase, friction.ring, train.offset)

    def parts(angle: Any, member: Member, inputs: Any) -> Floats:
        crank_ratio, row, scale, crankcase, ring, offset = inputs
        load = ring + pressure(angle, gas.family, row, scale, member.pressure_factor) - crankcase
        speed = slider_crank.velocity(angle, *member.own(crank_ratio, offset))
        return stacked_parts(load, speed, np.sin(angle))

    def means(member: Member) -> Floats:
        columns = np.broadcast_arrays(*(np.asarray(one, dtype=float) for one in inputs))
        distinct, number = np.unique(
            np.stack([c.reshape(-1) for c in columns]), axis=1, return_inverse=True
        )
        averages = np.empty((4, distinct.shape[1]))
        for begin in range(0, distinct.shape[1], MEANS_AT_ONCE):
            here = slice(begin, begin + MEANS_AT_ONCE)
            of_these = [row[here, None] for row in distinct]
            averages[:, here] = mean_parts(
                lambda angle: parts(angle, member, of_these),  # noqa: B023
                gas.family.period * member.cycles,
            )
        return averages[:, number.reshape(-1)].reshape(4, *columns[0].shape)

    def one(angle: Any, member: Member) -> Any:
        key = tuple(member[1:])
        if key not in weights:
            mean = means(member)
            weights[key] = np.where(mean > 0.0, mean, np.inf)
        each = parts(angle, member, inputs)
        return sum(
            level * (part / mean - 1.0)
            for level, part, mean in zip(friction.levels, each, weights[key], strict=True)
        )

    return one


def torque_after_throw(
    phi: Any, train: CrankTrain, bore: Any, gas: GasPressure, mass: Any, speed: Any,
    friction_torque: Any, friction: StrokeFriction | None = None,
    weights: dict[tuple[Any, ...], Floats] | None = None,
) -> Any:  # fmt: skip
    """Torque in the shaft after each throw, from the last throw to the take-off at the first.

    Kakaitsas (2015), section 5.4: T_Z, T_(Z-1) = T_Z + ..., T_1 the whole engine's. Shape
    (..., cylinder, crank angle); throw i along the shaft, with all cylinders on it, is entry i - 1,
    and entries past an engine's own throws hold NaN. Each cylinder bears an equal part of the mean
    friction torque, over its own stroke where `friction` is given. `train` needs its `by_count`.
    `weights` keeps what the friction's means over the cycle give, for further calls.
    """
    assert train.by_count is not None
    varying = None if friction is None else friction_of_cylinder(train, gas, friction, weights)
    sets = np.unique(np.asarray(train.cylinders)).astype(int)
    throws = max(len(along_shaft(train.by_count[int(number)])) for number in sets)
    lever = piston_area(bore) * 0.5 * train.double_radius
    moment = mass * (0.5 * train.double_radius * speed) ** 2

    @cache  # the sums of several throws contain the same cylinder
    def of_cylinder(engine: Cylinders, cylinder: int) -> tuple[Any, ...]:
        """Torque of gas, masses, mean friction and friction over the stroke."""
        member = engine.members[cylinder]
        angle = phi + train.phase_of(member)
        torque = (
            lever * gas.difference(angle, member, train) * train.velocity(angle, member),
            -0.5 * moment * train.square(angle, member)[1],
            -friction_torque / engine.count,
        )
        return torque if varying is None else (*torque, -lever * varying(angle, member))

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

    pieces = [
        value_of_sets(train.cylinders, train.by_count, partial(behind, throw))
        for throw in range(throws)
    ]
    return np.stack(np.broadcast_arrays(*pieces), axis=-2)
