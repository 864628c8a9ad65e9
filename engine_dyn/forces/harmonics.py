r"""Orders of the torque: of gas, inertia and gravity, of one cylinder and of the whole engine.

The harmonics of one cylinder are those of `cylinder_harmonics`. A cylinder whose phase is psi_k
adds C_nu exp(i nu psi_k). Of equal cylinders the sum is C_nu times the sum of phase vectors: 0
where an order cancels, Z for the major orders. Cylinders may have pressures, masses and crank radii
of their own: on a throw of rho engine's radii, with a rod of the same length, the crank ratio is
rho lambda, and gas has rho, inertia rho^2 times the lever.

Source: Rakopoulos notes, harmonics of the tangential force.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.forces import torque
from engine_dyn.forces.cylinder_harmonics import (
    gas_harmonics,
    inertia_harmonics,
    over_cycles,
    velocity_harmonics,
)
from engine_dyn.forces.mechanism import GRAVITY, banks_of
from engine_dyn.forces.superposition import CrankTrain, along_shaft
from engine_dyn.geometry import kinematic_series, slider_crank
from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.geometry.cylinder_means import value_of_sets
from engine_dyn.geometry.cylinders import EQUAL, Cylinders, CylindersByCount, Member
from engine_dyn.loads.friction import StrokeFriction
from engine_dyn.pressure.family import Family, own_diagrams
from engine_dyn.types import Booleans, Complexes, Floats

WHOLE = 1e-6
"""Rounding by which an order may miss a multiple of a curve's lowest order, in parts of it."""

SAMPLES, SAMPLED_AT_ONCE = 2880, 256
"""Samples of two revolutions, a quarter of a degree apart; designs whose samples exist at once."""

CANCELLED = 1e-12
"""Fraction of the number of cylinders below which a sum of phase vectors is rounding."""


def phase_vectors(orders: Any, cylinders: Any, by_count: CylindersByCount) -> Complexes:
    """Sum of the phase vectors of all cylinders, sum_k exp(i nu psi_k).

    Its size says what is left of an order of equal cylinders: 0 where it cancels, Z for the major
    orders. What is only rounding is 0. See also `arrangement.phase_sums`.

    Parameters
    ----------
    orders : array_like
        Orders above 0; broadcasts.
    cylinders, by_count
        Number of cylinders (broadcasts), and the cylinders of each number.
    """
    return _by_count(lambda nu, engine: _vectors(nu, engine.members), orders, cylinders, by_count)


def throw_phase_vectors(
    orders: Any, cylinders: Any, by_count: CylindersByCount, throws: Any
) -> Complexes:
    """Sums of the phase vectors of the cylinders on each throw.

    `throws` are the numbers of the throws along the shaft, from 1, and broadcast; NaN past the
    last throw of an engine.
    """
    return _by_throw(_vectors, orders, cylinders, by_count, throws)


def first_mode_weights(engine: Cylinders) -> Floats:
    """Amplitudes of the throws in the first torsional mode of a uniform shaft.

    Equal throws an equal stretch of shaft apart, held at the take-off, the first throw: throw j
    of T moves by sin(j theta)/sin(T theta) with theta = pi/(2 T + 1), 1 at the last. Shape
    (T,). The chain of equal discs: derived here, and compared with the eigenvectors of its
    stiffness in the tests.
    """
    throws = len(along_shaft(engine))
    step = np.pi / (2 * throws + 1)
    return np.asarray(np.sin(step * np.arange(1, throws + 1)) / np.sin(step * throws))


def first_mode_phase_vectors(orders: Any, cylinders: Any, by_count: CylindersByCount) -> Complexes:
    """Sum of the phase vectors of all cylinders, each times the first mode's amplitude there.

    `orders` and cylinder sets broadcast; `first_mode_weights` gives the amplitudes. The sum shows
    how strongly an order excites the shaft's first torsional mode.
    """
    return _by_count(
        lambda nu, engine: _in_first_mode(_vectors, nu, engine), orders, cylinders, by_count
    )


def of_first_mode(
    part: Part, orders: Any, crank_ratio: Any, offset: Any, cylinders: Any,
    by_count: CylindersByCount,
) -> Complexes:  # fmt: skip
    """Harmonics of a part, summed with the first mode's amplitude at each throw as weight."""
    summed = _sum_of(part, crank_ratio, offset)
    return _by_count(
        lambda nu, engine: _in_first_mode(summed, nu, engine), orders, cylinders, by_count
    )


def _in_first_mode(
    summed: Callable[[Floats, tuple[Member, ...]], Any], nu: Floats, engine: Cylinders
) -> Any:
    total: Any = 0.0
    size: Any = 0.0
    for place, weight in zip(along_shaft(engine), first_mode_weights(engine), strict=True):
        each = weight * summed(nu, tuple(engine.members[i] for i in place))
        total, size = total + each, size + np.abs(each)
    return np.where(np.abs(total) < CANCELLED * size, 0.0, total)


Single = Callable[[Floats, Any, Any, Member], Any]
"""A cylinder's harmonics, from orders, its crank ratio and offset ratio, and its pressure."""


class Part(NamedTuple):
    """A part of the torque of one cylinder."""

    single: Single  # Harmonics of one cylinder without its factor `lever`: see `Single`
    # Factor on the harmonics of a cylinder. Where the cylinder's crank radius is rho times the
    # engine's, a force has rho times the lever; an acceleration is rho times as large besides. A
    # pressure acts on the cylinder's own piston area.
    lever: Callable[[Member], float]
    # The quantity of one cylinder over the cylinder's own crank angle; arguments are the angle, the
    # cylinder, the crank ratio, the offset ratio and the further inputs `more`. A cylinder with an
    # articulated rod gets its harmonics from samples of this curve.
    curve: Callable[..., Any]
    more: tuple[Any, ...] = ()  # Further arguments of `curve`, which broadcast


VELOCITY = Part(
    lambda nu, crank_ratio, offset, _: velocity_harmonics(nu, crank_ratio, offset),
    lambda m: m.area_factor * m.radius_factor,
    lambda angle, member, *crank: member.velocity(angle, *crank),
)
INERTIA = Part(
    lambda nu, crank_ratio, offset, _: inertia_harmonics(nu, crank_ratio, offset),
    lambda m: m.mass_factor * m.radius_factor**2,
    lambda angle, member, *crank: -0.5 * member.square(angle, *crank)[1],
)


def _where(there: Booleans, nu: Floats, of: Callable[[Floats], Complexes]) -> Complexes:
    """Harmonics of the orders that `there` marks; 0 of others, by firing patterns alone."""
    if not there.any():
        return 0.0 * of(nu)
    along = int(np.argmax(nu.shape)) - nu.ndim  # all orders lie along one axis
    each = there.reshape(-1)
    values = np.moveaxis(of(np.compress(each, nu, axis=along)), along, -1)
    result = np.zeros((*values.shape[:-1], each.size), dtype=np.complex128)
    result[..., each] = values
    return np.moveaxis(result, -1, along)


def gas_part(row: Any, family: Family, period: float, threads: int | None = 1) -> Part:
    """Part of the gas torque, of a family's `row` over a `period` [rad], by so many threads."""
    of_cycles: dict[tuple[Any, ...], Complexes] = {}

    def of_cycle(
        diagram: int, nu: Floats, crank_ratio: Any, offset: Any, factor: float
    ) -> Complexes:
        """Harmonics over one cycle, which the patterns of an engine have in common."""
        columns = (np.asarray(one, dtype=float) for one in (nu, crank_ratio, offset))
        key = (diagram, factor, *((one.shape, one.tobytes()) for one in columns))
        if key not in of_cycles:
            own = own_diagrams(family, diagram)
            of_cycles[key] = gas_harmonics(
                nu, crank_ratio, offset, row, own, period, factor, threads
            )
        return of_cycles[key]

    def single(nu: Floats, crank_ratio: Any, offset: Any, member: Member) -> Any:
        factor, diagram = member.pressure_factor, member.diagram

        def of(some: Floats) -> Complexes:
            if isinstance(factor, tuple):
                one = partial(of_cycle, diagram, some, crank_ratio, offset)
                return over_cycles(one, np.asarray(some, dtype=float), factor, period)
            own = own_diagrams(family, diagram)
            return gas_harmonics(some, crank_ratio, offset, row, own, period, factor, threads)

        cycles = len(factor) if isinstance(factor, tuple) else 1
        periods = np.asarray(nu) * cycles * period / (2.0 * np.pi)
        there = np.abs(periods - np.rint(periods)) < WHOLE
        return of(nu) if there.all() else _where(there, nu, of)

    def curve(angle: Floats, member: Member, crank_ratio: Any, offset: Any, place: Any) -> Any:
        at = member.diagram_angle(angle, crank_ratio, offset)
        own = own_diagrams(family, member.diagram)
        gas = torque.pressure(at, own, place, 1.0, member.pressure_factor)
        return gas * member.velocity(angle, crank_ratio, offset)

    return Part(single, lambda m: m.area_factor * m.radius_factor, curve, (row,))


def friction_part(gas: torque.GasPressure, friction: StrokeFriction, period: float) -> Part:
    """Return the part of the friction over the stroke, less its mean, see `torque`: of samples."""

    def curve(
        angle: Floats, member: Member, crank_ratio: Any, offset: Any, row: Any, scale: Any,
        crankcase: Any, *levels: Any,
    ) -> Any:  # fmt: skip
        train = CrankTrain(crank_ratio, 1.0, 1, period, offset)
        own = torque.GasPressure(gas.family, row, scale, crankcase)
        return torque.friction_of_cylinder(train, own, StrokeFriction(*levels))(angle, member)

    def single(nu: Floats, crank_ratio: Any, offset: Any, one: Member) -> Any:
        member = EQUAL._replace(pressure_factor=one.pressure_factor)
        periods = np.asarray(nu) * member.cycles * period / (2.0 * np.pi)
        return _where(
            np.abs(periods - np.rint(periods)) < WHOLE, np.asarray(nu),
            lambda some: _of_samples(part, some, member, crank_ratio, offset),
        )  # fmt: skip

    part = Part(single, lambda _: 1.0, curve, (*gas[1:], *friction))
    return part


def of_engine(
    part: Part, orders: Any, crank_ratio: Any, offset: Any, cylinders: Any,
    by_count: CylindersByCount,
) -> Complexes:  # fmt: skip
    """Harmonics of the sum of a part over all cylinders, each with its factors and crank radius.

    `orders` nu, crank ratio, offset ratio and cylinder sets broadcast; `by_count` has the cylinders
    of each set. Both ratios are over the engine's crank radius (rods are equally long).
    """
    summed = _sum_of(part, crank_ratio, offset)
    return _by_count(lambda nu, e: summed(nu, e.members), orders, cylinders, by_count)


def of_first(
    part: Part, orders: Any, crank_ratio: Any, offset: Any, cylinders: Any,
    by_count: CylindersByCount,
) -> Complexes:  # fmt: skip
    """Harmonics of a part of the torque of cylinder 1 alone; `orders` and ratios broadcast."""
    summed = _sum_of(part, crank_ratio, offset)
    return _by_count(lambda nu, e: summed(nu, e.members[:1]), orders, cylinders, by_count)


def of_throws(
    part: Part, orders: Any, crank_ratio: Any, offset: Any, cylinders: Any,
    by_count: CylindersByCount, throws: Any,
) -> Complexes:  # fmt: skip
    """Harmonics of a part, summed over each throw's cylinders; `throws` (from 1) broadcast."""
    return _by_throw(_sum_of(part, crank_ratio, offset), orders, cylinders, by_count, throws)


def gravity_harmonics(
    orders: Any,
    crank_ratio: Any,
    reciprocating_mass: Any,
    rotating_mass: Any,
    crank_radius: Any,
    cylinders: Any,
    by_count: CylindersByCount,
    offset: Any = 0.0,
    first_only: bool = False,
    throw_turning_mass: Any = 0.0,
    inclination: Any = 0.0,
    web_unbalance: Any = 0.0,
) -> Complexes:
    """Harmonics of the gravity torque [N m], as `mechanism.gravity_torque`.

    `first_only`: of cylinder 1 alone, with its share of its throw and without `web_unbalance`.
    """
    of_kind = {}
    for member in {m for engine in by_count.values() for m in engine.members}:
        kind = member.radius_factor, member.side
        if kind not in of_kind:
            own = member.own(np.asarray(crank_ratio), np.asarray(offset))
            of_kind[kind] = velocity_harmonics(orders, *own), slider_crank.dead_centres(*own).top

    def summed(nu: Floats, engine: Cylinders) -> Any:
        each = list(zip(engine.members, banks_of(engine), engine.throw_shares, strict=True))
        total: Any = 0.0
        for member, from_upright, share in each[:1] if first_only else each:
            bank = from_upright + inclination
            speed, top = of_kind[member.radius_factor, member.side]
            lean = np.where(nu == 1.0, -1j * np.exp(1j * (top + bank)), 0.0)
            along = member.mass_factor * np.cos(bank) * reciprocating_mass * speed
            turned = member.radius_factor * np.exp(1j * nu * member.phase)
            total = total + turned * (along + (rotating_mass + share * throw_turning_mass) * lean)
        most = len(each) * (reciprocating_mass + rotating_mass + throw_turning_mass)
        webs = 0.0 if first_only else web_unbalance
        first = -1j * np.exp(1j * (banks_of(engine)[0] + inclination))
        total = crank_radius * total + np.where(nu == 1.0, webs * first, 0.0)
        most = crank_radius * most + np.abs(webs)
        return np.where(np.abs(total) < CANCELLED * most, 0.0, total)

    return GRAVITY * _by_count(summed, orders, cylinders, by_count)


def of_curve(curve: Any, angle: Floats, order: Floats) -> Any:
    """Harmonics M_nu of a curve, M = mean + sum of Re M_nu exp(i nu phi), shape (..., order).

    `curve` has equal steps of its period along the last axis, at the angles `angle` [rad]; the
    orders belong to that period and lie below half of the samples.

    Examples
    --------
    >>> angle = np.arange(0.0, 2.0 * np.pi, np.pi / 8)
    >>> abs(of_curve(3.0 * np.sin(2.0 * angle), angle, np.array([1.0, 2.0]))).round(6)
    array([0., 3.])
    """
    waves = np.exp(-1j * np.multiply.outer(order, angle)) * (2.0 / angle.size)
    return np.einsum("...a,oa->...o", np.asarray(curve, dtype=float), waves)


def phase_of(harmonics: Any) -> Any:
    """Phase [rad] of harmonics, 0 where there is nothing."""
    phases = np.asarray(harmonics)
    return np.where(np.abs(phases) == 0.0, 0.0, np.angle(phases))


def _vectors(
    nu: Floats, members: tuple[Member, ...], lever: Callable[[Member], float] = lambda _: 1.0
) -> Any:
    total: Any = np.zeros(nu.shape, dtype=np.complex128)
    for member in members:
        total = total + lever(member) * np.exp(1j * nu * member.phase)
    return np.where(np.abs(total) < CANCELLED * len(members), 0.0, total)


def _sum_of(
    part: Part, crank_ratio: Any, offset: Any
) -> Callable[[Floats, tuple[Member, ...]], Any]:
    """Sum of a part over the cylinders; those of one pressure and one mechanism share harmonics."""
    known: dict[tuple[Any, ...], Any] = {}

    def summed(nu: Floats, members: tuple[Member, ...]) -> Any:
        total: Any = 0.0
        for member in (m for m in members if m.rod is not None):
            own = _of_samples(part, nu, member, crank_ratio, offset)
            total = total + own * np.exp(1j * nu * member.phase_of(crank_ratio, offset))
        members = tuple(m for m in members if m.rod is None)
        groups: dict[tuple[Any, ...], list[Member]] = {}
        for m in members:
            key = m.pressure_factor, m.diagram, m.radius_factor, m.side
            groups.setdefault(key, []).append(m)
        for key, alike in groups.items():
            if key not in known:
                known[key] = part.single(nu, *alike[0].own(crank_ratio, offset), alike[0])
            total = total + known[key] * _vectors(nu, tuple(alike), part.lever)
        return total

    return summed


def _of_samples(part: Part, nu: Floats, member: Member, crank_ratio: Any, offset: Any) -> Any:
    """Harmonics of a part over a cylinder's own angle, from equally spaced samples of its curve."""
    columns = np.broadcast_arrays(*map(np.asarray, (crank_ratio, offset, *part.more)))
    flat = [column.reshape(-1, 1).astype(float) for column in columns]
    angle: Floats = np.arange(SAMPLES * member.cycles, dtype=np.float64) * (FOUR_STROKE / SAMPLES)
    orders, which = np.unique(np.asarray(nu, dtype=np.float64), return_inverse=True)
    harmonics = np.empty((flat[0].size, orders.size), dtype=np.complex128)
    for begin in range(0, flat[0].size, SAMPLED_AT_ONCE):
        here = slice(begin, begin + SAMPLED_AT_ONCE)
        harmonics[here] = of_curve(
            part.curve(angle, member, *(column[here] for column in flat)), angle, orders
        )
    place, row = np.broadcast_arrays(
        which.reshape(nu.shape), np.arange(flat[0].size).reshape(columns[0].shape)
    )
    return harmonics[row, place]


def _by_count(
    summed: Callable[[Floats, Cylinders], Any], orders: Any, cylinders: Any,
    by_count: CylindersByCount,
) -> Complexes:  # fmt: skip
    nu = kinematic_series.checked_orders(orders)
    return np.asarray(value_of_sets(cylinders, by_count, lambda engine: summed(nu, engine)))


def _by_throw(
    summed: Callable[[Floats, tuple[Member, ...]], Any], orders: Any, cylinders: Any,
    by_count: CylindersByCount, throws: Any,
) -> Complexes:  # fmt: skip
    numbers = np.asarray(throws)
    total: Any = np.nan
    for number in np.unique(numbers).astype(int):

        def of_throw(nu: Floats, engine: Cylinders, number: int = number) -> Any:
            places = along_shaft(engine)
            if number > len(places):
                return np.full(nu.shape, np.nan)
            return summed(nu, tuple(engine.members[i] for i in places[number - 1]))

        total = np.where(numbers == number, _by_count(of_throw, orders, cylinders, by_count), total)
    return np.asarray(total)
