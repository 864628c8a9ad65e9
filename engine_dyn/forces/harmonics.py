r"""Orders of the torque: of gas, inertia and gravity, of one cylinder and of the whole engine.

A periodic curve over the crank angle is its mean and its orders nu = 1/2, 1, 3/2, ... (four-stroke)
or 1, 2, ... (two-stroke), periods a turn of the crank:

    M(phi) = mean + sum_nu M_nu cos(nu phi + psi_nu) = mean + Re sum_nu C_nu exp(i nu phi),

amplitude M_nu = |C_nu| and phase psi_nu = arg C_nu. With phi = omega t this is the form that
programs for torsional vibration take (openTorsion: U exp(i omega t)). The complex numbers C_nu are
called harmonics here.

- Inertia and gravity: in closed form, `kinematic_series`; with an offset from 2048 points of a
  turn, which for smooth periodic curves holds rounding.
- Gas: the pressure is a cubic between the knots of its diagram and the velocity is smooth, so Gauss
  quadrature of six nodes on pieces of at most 2 degrees (shorter for high orders) leaves about
  1e-13 of the largest pressure. Nothing depends on the `angle_step` of a scene. The pressure is
  linear between two rows of a family, and so are its harmonics: a table for each row and crank
  ratio serves all designs.

A cylinder whose phase is psi_k adds C_nu exp(i nu psi_k). Of equal cylinders the sum is C_nu times
the sum of phase vectors: 0 where an order cancels, Z for the major orders. Cylinders may have
pressures, masses and crank radii of their own: on a throw of rho engine's radii, with a rod of the
same length, the crank ratio is rho lambda, and gas has rho, inertia rho^2 times the lever.

Source: Rakopoulos notes, harmonics of the tangential force.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.compilation import kernel, on_stack
from engine_dyn.forces.mechanism import GRAVITY, banks_of
from engine_dyn.forces.superposition import along_shaft
from engine_dyn.geometry import kinematic_series, slider_crank
from engine_dyn.geometry.arrangement import TURN
from engine_dyn.geometry.cylinder_means import value_of_sets
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount, Member
from engine_dyn.geometry.slider_crank import offset_velocity_at, sine_of_top, turned
from engine_dyn.pressure.curves import on_threads
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.motored import row_with_factor
from engine_dyn.types import Complexes, Floats, Integers

__all__ = [
    "INERTIA",
    "VELOCITY",
    "Part",
    "gas_harmonics",
    "gas_part",
    "gravity_harmonics",
    "inertia_harmonics",
    "of_engine",
    "of_first",
    "of_throws",
    "phase_of",
    "phase_vectors",
    "throw_phase_vectors",
    "velocity_harmonics",
]


LONGEST_PIECE = TURN / 180.0
MOST_TURN_OF_PIECE = 1.0
"""Of the highest order within a piece [rad]."""

NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
ORDERS_AT_ONCE, RATIOS_AT_ONCE = 64, 256
MANY_RATIOS = 64
"""More crank ratios than that are taken from the series of the velocity."""
DESIGNS_AT_ONCE, POINTS_OF_PIECE = 128, 512
MOST_KEPT = 4_000_000
"""Values of waves that are kept from one diagram to the next."""

SMOOTH = 2048
"""Points of a turn for the harmonics of smooth curves."""

CANCELLED = 1e-12
"""Sums of phase vectors below this part of the number of cylinders are nothing but rounding."""


def velocity_harmonics(orders: Any, crank_ratio: Any, offset: Any = 0.0) -> Any:
    """Harmonics of c/(r omega) [1]: -i gamma_nu without offset.

    Parameters
    ----------
    orders : array_like
        Orders above 0, along an axis on which the others have size 1; all broadcast.
    crank_ratio, offset : array_like
        lambda [1]; offset of the pin's line over the crank radius [1].

    Raises
    ------
    ValueError
        For an order that is not above 0, with an offset also above 1024; a crank ratio outside
        (0, 1).
    """
    if not np.any(offset):
        return -1j * kinematic_series.velocity_coefficients(orders, crank_ratio)
    return _of_smooth(slider_crank.velocity, orders, crank_ratio, offset)


def inertia_harmonics(orders: Any, crank_ratio: Any, offset: Any = 0.0) -> Any:
    """Harmonics of -b v, the inertia torque of one cylinder over m r^2 omega^2 [1].

    Parameters as `velocity_harmonics`. Rakopoulos notes, Delta T_l.
    """
    if not np.any(offset):
        return -1j * kinematic_series.inertia_torque_coefficients(orders, crank_ratio)

    def curve(phi: Any, crank_ratio: Any, offset_ratio: Any) -> Any:
        v = slider_crank.velocity(phi, crank_ratio, offset_ratio)
        return -v * slider_crank.acceleration(phi, crank_ratio, offset_ratio)

    return _of_smooth(curve, orders, crank_ratio, offset)


def _of_smooth(curve: Callable[..., Any], orders: Any, crank_ratio: Any, offset: Any) -> Complexes:
    """Harmonics of a curve that repeats every turn; half orders have none."""
    nu, shape, columns = _designs(
        kinematic_series.checked_orders(orders, SMOOTH // 2), crank_ratio, offset
    )
    phi = np.arange(SMOOTH) * (TURN / SMOOTH)
    result = np.zeros((columns.shape[1], nu.size), dtype=np.complex128)
    whole = nu % 1.0 == 0.0
    places = np.rint(nu[whole]).astype(int)
    pairs, which = _distinct(columns)
    for begin in range(0, pairs.shape[1], RATIOS_AT_ONCE):
        some = pairs[:, begin : begin + RATIOS_AT_ONCE, None]
        found = np.fft.rfft(curve(phi, some[0], some[1]), axis=-1) * (2.0 / SMOOTH)
        mine = np.flatnonzero((which >= begin) & (which < begin + some.shape[1]))
        result[np.ix_(mine, whole)] = found[which[mine] - begin][:, places]
    return _along_orders(result, orders, shape)


def _designs(orders: Any, *inputs: Any) -> tuple[Floats, tuple[int, ...], Floats]:
    """Orders in a row; shape of the other inputs together, and these as columns."""
    others = np.broadcast_arrays(*(np.asarray(one, dtype=float) for one in inputs))
    columns = np.stack([one.reshape(-1) for one in others])
    return kinematic_series.checked_orders(orders).reshape(-1), others[0].shape, columns


def _along_orders(values: Complexes, orders: Any, shape: tuple[int, ...]) -> Complexes:
    """Give (designs, orders) the shape of both broadcast; designs have size 1 along the orders."""
    own = np.shape(orders)
    if values.shape[1] == 1:
        return np.array(np.broadcast_to(values.reshape(shape), np.broadcast_shapes(own, shape)))
    size = max(len(own), len(shape))
    along = next((i - len(own) for i, length in enumerate(own) if length > 1), -1)
    table = values.reshape(*(1,) * (size - len(shape)), *shape, values.shape[1])
    if table.shape[along - 1] != 1:
        raise ValueError("orders: must stand along an axis on which all else has size 1")
    return np.moveaxis(table.squeeze(axis=along - 1), -1, along)


def _distinct(columns: Floats) -> tuple[Floats, Any]:
    """Different columns, and which of them each one is."""
    found, which = np.unique(columns, axis=1, return_inverse=True)
    return found, which.reshape(-1)


def gas_harmonics(
    orders: Any,
    crank_ratio: Any,
    offset: Any,
    row: Any,
    family: Family,
    period: float,
    pressure_factor: float = 1.0,
) -> Complexes:
    """Harmonics of p c/(r omega) [Pa] of one cylinder, with the absolute pressure.

    Parameters
    ----------
    orders, crank_ratio, offset : array_like
        As in `velocity_harmonics`.
    row : array_like
        (Fractional) rows of the family's table, see `family.Family.locate`.
    family : Family
        Indicator diagrams.
    period : float
        Angle of the cycle [rad].
    pressure_factor : float
        See `motored`.
    """
    nu, shape, columns = _designs(orders, crank_ratio, offset, row)
    first = np.floor(columns[2]).astype(int)
    weight = columns[2] - first
    result = np.zeros((columns.shape[1], nu.size), dtype=np.complex128)
    waves = _Waves(nu, period)
    if isinstance(family, CycleTable):
        waves.of_rows(family, columns, first, weight, pressure_factor, result)
        return _along_orders(result, orders, shape)
    needed = {*np.unique(first).tolist(), *np.unique(first[weight > 0.0] + 1).tolist()}
    for index in sorted(needed):
        diagram = row_with_factor(family, index, pressure_factor)
        share = np.where(first == index, 1.0 - weight, np.where(first + 1 == index, weight, 0.0))
        here = np.flatnonzero(share)
        if not columns[1].any():
            ratios, which = np.unique(columns[0, here], return_inverse=True)
            if ratios.size > MANY_RATIOS:
                table = waves.of_series(diagram, ratios)
                result[here] += share[here, None] * table[:, which].T
                continue
        pairs, which = _distinct(columns[:2, here])
        for begin in range(0, pairs.shape[1], RATIOS_AT_ONCE):
            some = pairs[:, begin : begin + RATIOS_AT_ONCE]
            table = waves.table(diagram, some)
            chosen = np.flatnonzero((which >= begin) & (which < begin + some.shape[1]))
            mine = here[chosen]
            result[mine] += share[mine, None] * table[:, which[chosen] - begin].T
    return _along_orders(result, orders, shape)


class _Waves:
    """Cosine and sine at the nodes of a diagram, kept for the next one with the same knots."""

    def __init__(self, orders: Floats, period: float) -> None:
        self.orders, self.period = orders, period
        self.knots: Floats | None = None
        self.kept: list[tuple[Floats, Floats]] = []

    def table(self, diagram: Diagram, pairs: Floats) -> Complexes:
        """Harmonics for each order and each pair of crank ratio and offset."""
        work = self._work(diagram)
        velocity = slider_crank.velocity(self.phi, pairs[0][:, None], pairs[1][:, None])
        return self._transform(work * velocity)

    def of_series(self, diagram: Diagram, ratios: Floats) -> Complexes:
        """Harmonics for each order and each crank ratio, without offset.

        The velocity is a sum of few sines, whose coefficients alone know the crank ratio.
        """
        root = math.sqrt((1.0 - ratios.max()) * (1.0 + ratios.max()))
        falls = math.log(kinematic_series.REMAINDER) / math.log((1.0 - root) / (1.0 + root))
        orders = np.array([1.0, *(2.0 * np.arange(1, math.ceil(falls) + 2))])
        sines = self._transform(self._work(diagram) * np.sin(orders[:, None] * self.phi))
        gamma = kinematic_series.velocity_coefficients(orders[:, None], ratios)
        return np.asarray(sines @ gamma)

    def of_rows(
        self, family: CycleTable, columns: Floats, row: Integers, weight: Floats, factor: float,
        result: Complexes,
    ) -> None:  # fmt: skip
        """Harmonics of designs that have diagrams of their own, by a kernel.

        `columns` are crank ratio and offset of each; `row` and `weight` tell its two rows.
        """
        self._take_nodes(family.angle)
        family.curves(np.concatenate([row, row[weight > 0.0] + 1]))  # all at once
        size = self.orders.size
        angle = self.orders[:, None] * self.phi
        waves = np.cos(angle), np.sin(angle)
        turn = np.sin(self.phi), np.cos(self.phi)
        for begin in range(0, row.size, DESIGNS_AT_ONCE):
            here = slice(begin, begin + DESIGNS_AT_ONCE)
            place = (row[here] + weight[here])[:, None]
            pressure = family.pressures(self.phi, place, factor)
            real, imaginary = np.zeros((2, pressure.shape[0], size))
            ratio, offset = (np.ascontiguousarray(column[here]) for column in columns[:2])

            def work(
                first: int, last: int, pressure: Floats = pressure, ratio: Floats = ratio,
                offset: Floats = offset, real: Floats = real, imaginary: Floats = imaginary,
            ) -> None:  # fmt: skip
                mine = slice(first, last)
                _transform_rows(
                    pressure[mine], ratio[mine], offset[mine], *turn, self.weight, *waves,
                    real[mine], imaginary[mine],
                )  # fmt: skip

            on_threads(pressure.shape[0], work, family.threads)
            result[here] = (2.0 / self.period) * (real - 1j * imaginary)

    def _take_nodes(self, knots: Floats) -> None:
        """Nodes and weights between some knots."""
        if self.knots is None or not np.array_equal(knots, self.knots):
            self.knots, self.kept = knots, []
            self.phi, self.weight = _nodes(knots, float(self.orders.max()), self.period)

    def _work(self, diagram: Diagram) -> Floats:
        """Pressure times weights at the nodes."""
        self._take_nodes(diagram.angle)
        return np.asarray(self.weight * np.asarray(diagram(self.phi)) * (2.0 / self.period))

    def _transform(self, curves: Floats) -> Complexes:
        """Harmonics of curves over the nodes, (orders, curves)."""
        weighted = np.ascontiguousarray(curves.T)
        # Products of real matrices: complex ones would copy the real factor.
        pieces = [(cosine @ weighted, sine @ weighted) for cosine, sine in self._pieces()]
        return np.concatenate([one - 1j * other for one, other in pieces])

    def _pieces(self) -> Iterator[tuple[Floats, Floats]]:
        if self.kept:
            yield from self.kept
            return
        keep = self.orders.size * self.phi.size <= MOST_KEPT
        for begin in range(0, self.orders.size, ORDERS_AT_ONCE):
            angle = self.orders[begin : begin + ORDERS_AT_ONCE, None] * self.phi
            wave = np.cos(angle), np.sin(angle)
            if keep:
                self.kept.append(wave)
            yield wave


@kernel
def _transform_rows(
    pressure: Floats, ratio: Floats, offset: Floats, sine: Floats, cosine: Floats, weight: Floats,
    cosines: Floats, sines: Floats, real: Floats, imaginary: Floats,
) -> None:  # fmt: skip
    """Add up pressure times velocity times waves, for every design and order.

    Piece by piece of the cycle, so that the waves of a piece stay in the cache; the sums of a
    design do not depend on the others.
    """
    work = on_stack(POINTS_OF_PIECE)
    for begin in range(0, weight.size, POINTS_OF_PIECE):
        count = min(POINTS_OF_PIECE, weight.size - begin)
        for design in range(ratio.size):
            top = sine_of_top(ratio[design], offset[design])
            upright = math.sqrt(1.0 - top * top)
            for i in range(count):
                s, c = turned(sine[begin + i], cosine[begin + i], top, upright)
                velocity = offset_velocity_at(s, c, ratio[design], offset[design])
                work[i] = pressure[design, begin + i] * weight[begin + i] * velocity
            for order in range(cosines.shape[0]):
                one, other = 0.0, 0.0
                for i in range(count):
                    one += work[i] * cosines[order, begin + i]
                    other += work[i] * sines[order, begin + i]
                real[design, order] += one
                imaginary[design, order] += other


def _nodes(knots: Floats, highest: float, period: float) -> tuple[Floats, Floats]:
    """Nodes and weights of Gauss quadrature over one cycle, on the pieces of the spline."""
    step = np.diff(knots, append=knots[0] + period)
    longest = min(LONGEST_PIECE, MOST_TURN_OF_PIECE / highest)
    parts = np.ceil(step / longest).astype(int)
    size = np.repeat(step / parts, parts)
    number = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    begin = np.repeat(knots, parts) + number * size
    phi = begin[:, None] + 0.5 * size[:, None] * (1.0 + NODES)
    return phi.reshape(-1), (0.5 * size[:, None] * WEIGHTS).reshape(-1)


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
    return _by_count(
        lambda nu, engine: _vectors(nu, engine.members), orders, cylinders, by_count
    )  # fmt: skip


def throw_phase_vectors(
    orders: Any, cylinders: Any, by_count: CylindersByCount, throws: Any
) -> Complexes:
    """Sums of the phase vectors of the cylinders on each throw.

    `throws` are the numbers of the throws along the shaft, from 1, and broadcast; NaN past the
    last throw of an engine.
    """
    return _by_throw(_vectors, orders, cylinders, by_count, throws)


Single = Callable[[Floats, Any, Any, float], Any]
"""Harmonics of a cylinder, of orders, crank ratio, offset ratio and its factor on the pressure."""


class Part(NamedTuple):
    """A part of the torque of one cylinder.

    Attributes
    ----------
    single : callable
        Its harmonics, over the lever of the cylinder: see `Single`.
    lever : callable
        What a cylinder multiplies them with. On a throw of rho engine's radii the force has rho
        times the lever, and the acceleration is rho times as large besides.
    """

    single: Single
    lever: Callable[[Member], float]


VELOCITY = Part(
    lambda nu, crank_ratio, offset, _: velocity_harmonics(nu, crank_ratio, offset),
    lambda m: m.radius_factor,
)
INERTIA = Part(
    lambda nu, crank_ratio, offset, _: inertia_harmonics(nu, crank_ratio, offset),
    lambda m: m.mass_factor * m.radius_factor**2,
)


def gas_part(row: Any, family: Family, period: float) -> Part:
    """Return the part of the gas; parameters as `gas_harmonics`."""

    def single(nu: Floats, crank_ratio: Any, offset: Any, factor: float) -> Any:
        return gas_harmonics(nu, crank_ratio, offset, row, family, period, factor)

    return Part(single, lambda m: m.radius_factor)


def of_engine(
    part: Part, orders: Any, crank_ratio: Any, offset: Any, cylinders: Any,
    by_count: CylindersByCount,
) -> Complexes:  # fmt: skip
    """Harmonics of the sum of a part over all cylinders, each with its factors and crank radius.

    Parameters as `velocity_harmonics` and `phase_vectors`; crank ratio and offset are those of the
    engine's crank radius (rods are equally long).
    """

    def summed(nu: Floats, engine: Cylinders) -> Any:
        return _summed(part, nu, engine.members, crank_ratio, offset)

    return _by_count(summed, orders, cylinders, by_count)


def of_first(
    part: Part, orders: Any, crank_ratio: Any, offset: Any, cylinders: Any,
    by_count: CylindersByCount,
) -> Complexes:  # fmt: skip
    """As `of_engine`, of cylinder 1 alone."""

    def summed(nu: Floats, engine: Cylinders) -> Any:
        return _summed(part, nu, engine.members[:1], crank_ratio, offset)

    return _by_count(summed, orders, cylinders, by_count)


def of_throws(
    part: Part, orders: Any, crank_ratio: Any, offset: Any, cylinders: Any,
    by_count: CylindersByCount, throws: Any,
) -> Complexes:  # fmt: skip
    """As `of_engine`, of the cylinders on each throw; `throws` as `throw_phase_vectors`."""

    def summed(nu: Floats, members: tuple[Member, ...]) -> Any:
        return _summed(part, nu, members, crank_ratio, offset)

    return _by_throw(summed, orders, cylinders, by_count, throws)


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
) -> Complexes:
    """Harmonics of the gravity torque [N m], as `mechanism.gravity_torque`.

    `first_only`: of cylinder 1 alone.
    """
    of_radius = {}
    for radius in {m.radius_factor for engine in by_count.values() for m in engine.members}:
        own = radius * np.asarray(crank_ratio), np.asarray(offset) / radius
        of_radius[radius] = velocity_harmonics(orders, *own), slider_crank.dead_centres(*own).top

    def summed(nu: Floats, engine: Cylinders) -> Any:
        pairs = list(zip(engine.members, banks_of(engine), strict=True))
        total: Any = 0.0
        for member, bank in pairs[:1] if first_only else pairs:
            speed, top = of_radius[member.radius_factor]
            lean = np.where(nu == 1.0, -1j * np.exp(1j * (top + bank)), 0.0)
            along = member.mass_factor * np.cos(bank) * reciprocating_mass * speed
            turned = member.radius_factor * np.exp(1j * nu * member.phase)
            total = total + turned * (along + rotating_mass * lean)
        most = len(pairs) * (reciprocating_mass + rotating_mass)
        return np.where(np.abs(total) < CANCELLED * most, 0.0, total)

    return GRAVITY * crank_radius * _by_count(summed, orders, cylinders, by_count)


def phase_of(harmonics: Any) -> Any:
    """Phase [rad] of harmonics, 0 where there is nothing."""
    found = np.asarray(harmonics)
    return np.where(np.abs(found) == 0.0, 0.0, np.angle(found))


def _vectors(
    nu: Floats, members: tuple[Member, ...], lever: Callable[[Member], float] = lambda _: 1.0
) -> Any:
    total: Any = np.zeros(nu.shape, dtype=np.complex128)
    for member in members:
        total = total + lever(member) * np.exp(1j * nu * member.phase)
    return np.where(np.abs(total) < CANCELLED * len(members), 0.0, total)


def _summed(
    part: Part, nu: Floats, members: tuple[Member, ...], crank_ratio: Any, offset: Any
) -> Any:
    """Sum over cylinders: those of one pressure and one crank radius share their harmonics."""
    total: Any = 0.0
    for factor, radius in sorted({(m.pressure_factor, m.radius_factor) for m in members}):
        alike = tuple(
            m for m in members if (m.pressure_factor, m.radius_factor) == (factor, radius)
        )
        one = part.single(nu, *alike[0].own(crank_ratio, offset), factor)
        total = total + one * _vectors(nu, alike, part.lever)
    return total


def _on_throw(engine: Cylinders, number: int) -> tuple[Member, ...]:
    places = along_shaft(engine)
    return tuple(engine.members[i] for i in places[number - 1]) if number <= len(places) else ()


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
            members = _on_throw(engine, number)
            return summed(nu, members) if members else np.full(nu.shape, np.nan)

        here = _by_count(of_throw, orders, cylinders, by_count)
        total = np.where(numbers == number, here, total)
    return np.asarray(total)
