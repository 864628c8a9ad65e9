"""Columns: the parts of the work curves of all designs that share cylinders, box and diagrams.

The reduced work w(phi) = g P(phi) - eta V(phi) of gas, friction over the stroke, load over angle
and masses, docs/method.md (50) and (54), is a short sum of columns: docs/solver.md chapter 8. They
are tabulated once, for each diagram and for what all diagrams have in common. Cylinders that
differ, misfire, offsets and friction are dealt with here and nowhere else.

Sums of products are those of `np.einsum`, whose terms are added in an order that neither the number
of processors nor that of threads changes, as it does in products of matrices (`@`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.compilation import kernel
from engine_dyn.geometry.cylinders import Cylinders, Member
from engine_dyn.geometry.slider_crank import velocity
from engine_dyn.loads.friction import stacked_parts
from engine_dyn.loads.torque_curves import TorqueOverAngle
from engine_dyn.pressure.family import Family, own_diagrams, remembered
from engine_dyn.pressure.motored import pressures_of_rows
from engine_dyn.speed.work.boxes import DEGREE, Box
from engine_dyn.speed.work.interpolation import BEFORE, MEAN_BY_PAIRS, STENCIL, weights_between
from engine_dyn.types import Booleans, Floats, Integers

UNIT, SQUARE, FIRST_GAS = 0, 1, 2
"""Places of the parts that all columns have, and of the first diagram: work of a pressure of 1,
and squared velocity."""

FRICTION_PARTS = 4
"""Parts of friction: boundary, mixed, hydrodynamic and skirt, see `engine_dyn.loads.friction`."""


class RubbedDiagram(NamedTuple):
    """Inputs of the friction over the stroke: the diagram between two rows, and pressures [Pa].

    `row` is a place in the table of the family, `scale` the factor on the pressure.
    """

    row: float
    scale: float
    crankcase: float
    ring: float


class Parts(NamedTuple):
    """Subjects of columns: rows of the family, friction over the stroke, torques over angle.

    `rows` ascend, friction has `FRICTION_PARTS` parts for each of `rubbed`, and `torques` over an
    angle are that of the load or of the engine, see `DrivenMachine.torques`, with a gear ratio and
    a phase [rad].
    """

    rows: Integers
    rubbed: tuple[RubbedDiagram, ...] = ()
    torques: tuple[tuple[int, float, float], ...] = ()

    @property
    def first_rubbed(self) -> int:
        """Place of the first part of friction."""
        return FIRST_GAS + self.rows.size

    @property
    def first_torque(self) -> int:
        """Place of the first torque over an angle."""
        return self.first_rubbed + FRICTION_PARTS * len(self.rubbed)

    def is_load(self, part: Integers) -> Booleans:
        """Whether places of parts are those of loads over angle."""
        loads = sum(which == 0 for which, _, _ in self.torques)
        return (part >= self.first_torque) & (part < self.first_torque + loads)

    @property
    def number(self) -> int:
        """Number of parts."""
        return self.first_torque + len(self.torques)


FEWEST_NODES = 720
"""Least number of nodes of a cycle: one a degree, the step of most measured diagrams."""

FEWEST_COARSE = 60  # Smallest number of coarse nodes of a period

WIDE, NARROW, STEEP = 5, 4, 3
"""Fine intervals of a coarse one, where there are many and few, and where the torque answers
steeply to the speed, as a motor's: the error falls with the fifth power of the width."""


class Nodes(NamedTuple):
    """Nodes of a period of torque and load.

    Attributes
    ----------
    number, stride : int
        How many, and fine intervals of a coarse one.
    times : int
        How often the engine's own torque repeats in its cycle, or in the cycles of its firing
        pattern, as far as that is used.
    cycles : int
        Such repeats in the period: above 1 where the load needs longer than the engine.
    """

    number: int
    stride: int
    times: int
    cycles: int = 1

    @property
    def of_engine(self) -> int:
        """Nodes of one of the engine's repeats."""
        return self.number // self.cycles

    @property
    def of_cycle(self) -> int:
        """Nodes of the engine's cycle."""
        return self.of_engine * self.times

    def width(self, cycle: float) -> float:
        """Width of a fine interval, where the engine's cycle is `cycle` [rad]."""
        return cycle / self.of_cycle


def nodes_of(times: int, fewest: int, steep: bool = False, cycles: int = 1) -> Nodes:
    """Nodes of a period, with `fewest` in the engine's cycle; arguments as of `Nodes`.

    Laws that are `steep` have narrower coarse intervals.
    """
    each = -(-fewest // times)
    stride = WIDE if each >= FEWEST_COARSE * WIDE else NARROW
    stride = STEEP if steep else stride
    coarse = max(-(-each // stride), FEWEST_COARSE)
    coarse += coarse * stride % 2  # even, so that every other node shows whether all suffice
    return Nodes(coarse * stride * cycles, stride, times, cycles)


ATMOSPHERE = 101325.0  # Pressure [Pa] under the piston that the columns of the gas contain

SAME_PLACE = 1e-9  # Fraction of an interval by which rounding may displace a phase

VALUE, SLOPE, MIDDLE, BETWEEN = range(4)  # Values of each part in `Columns.fine`


class Columns(NamedTuple):
    """Tables of columns, as kernels take them.

    Attributes
    ----------
    fine : ndarray, shape (part, node, 4, term)
        At the fine nodes: `VALUE`, the work, or the squared velocity, without its mean; `SLOPE`;
        `MIDDLE`, what a cubic through both misses in the middle of the interval behind; `BETWEEN`,
        what a polynomial through coarse nodes misses of the integral.
    coarse : ndarray, shape (part, coarse node, 2, term)
        The work at the coarse nodes, and what six of them miss of its mean over the coarse interval
        behind each, docs/solver.md (72).
    mean : ndarray, shape (part, term)
        Mean torque; 0 where a part has none.
    degrees : ndarray, shape (term, 2)
        Degrees of each column's Chebyshev polynomials in crank ratio and offset.
    rough : ndarray, shape (part,)
        What every other node misses of the work between them, over its range.
    jagged : ndarray, shape (part,)
        By how much the work rises between coarse nodes above what their values tell.
    missed : ndarray, shape ()
        What polynomials in crank ratio and offset miss of the squared velocity, about.
    width : float
        Of a fine interval [rad].
    """

    fine: Floats
    coarse: Floats
    mean: Floats
    degrees: Integers
    rough: Floats
    jagged: Floats
    missed: Floats
    width: float


@dataclass(frozen=True)
class Source:
    """Common values of the columns of some designs besides the parts that are wanted.

    `torques` over an angle are those of `DrivenMachine.torques`.
    """

    family: Family
    cylinders: Cylinders
    box: Box
    nodes: Nodes
    torques: tuple[TorqueOverAngle | None, ...] = ()

    @property
    def width(self) -> float:
        """Width of a fine interval [rad]."""
        return self.nodes.width(self.cylinders.period)

    @property
    def members(self) -> tuple[Member, ...]:
        """Cylinders that are added up, with the phases that articulated rods of the box have."""
        members = self.cylinders.representatives_of(self.nodes.times)
        if not self.cylinders.articulated:
            return members
        crank = self.box.ratio[0], self.box.offset[0]
        return tuple(m._replace(phase=float(m.phase_of(*crank))) for m in members)


def columns_of(source: Source, parts: Parts) -> Columns:
    """Columns of some parts, known from earlier or made now.

    Places of parts are those of `UNIT`, `SQUARE` and `Parts`.
    """
    torques = tuple(map(id, source.torques)) if parts.torques else ()
    key = (
        "columns", source.members, source.box, source.nodes, torques, parts.rows.tobytes(),
        parts.rubbed, parts.torques,
    )  # fmt: skip
    made = remembered(source.family, key, lambda: _make(source, parts))
    return Columns._make((*made, source.width))


def _make(source: Source, parts: Parts) -> tuple[Any, ...]:
    """Arrays from which `Columns` is made."""
    terms, nodes = len(source.box.degrees), source.nodes.of_engine
    work, halves, rates = curves = np.zeros((3, parts.number, terms, nodes))
    _add_gas(source, parts.rows, curves)
    places = range(parts.first_rubbed, parts.first_torque, FRICTION_PARTS)
    for place, diagram in zip(places, parts.rubbed, strict=True):
        for member in source.members:
            _add_friction(source, diagram, member, curves[:, place : place + FRICTION_PARTS])
    mean = cumulate(work, halves, rates, source.width)
    # Friction has no mean here: the mean friction torque contains it.
    mean[parts.first_rubbed : parts.first_torque] = 0.0
    _add_square(source, curves[:, SQUARE])
    if source.nodes.cycles > 1:
        work, halves, rates = np.tile(curves, source.nodes.cycles)
    angle = np.arange(source.nodes.number) * source.width
    for place, (which, gear, phase) in enumerate(parts.torques, start=parts.first_torque):
        torque, theta = source.torques[which], gear * angle + phase
        assert torque is not None
        done, within = (torque.work(theta + h) for h in (0.0, 0.5 * gear * source.width))
        work[place, 0], halves[place, 0] = done.mean() - done, done.mean() - within
        rates[place, 0] = gear * (torque.mean - torque(theta))
    stride, whole = source.nodes.stride, source.nodes.number
    # Made by NumPy, which requests large memory pages, and not by the kernel, which does not: to
    # fill these takes a quarter less time.
    fine = np.empty((parts.number, whole, 4, terms))
    coarse = np.empty((parts.number, whole // stride, 2, terms))
    arrange(work, halves, rates, source.width, weights_between(stride), fine, coarse)
    in_the_middle = np.cos(0.5 * np.pi * source.box.degrees).prod(axis=1)  # middle of the box
    middle = np.asarray(np.einsum("t,ptn->pn", in_the_middle, work))
    return (
        fine, coarse, mean, source.box.degrees, _roughness(middle), _jaggedness(middle, stride),
        _missed(source.box, work[SQUARE]),
    )  # fmt: skip


def _missed(box: Box, columns: Floats) -> Floats:
    """Error of a box's polynomials: the ratio of the last degrees, continued by one degree.

    Where cylinders nearly balance each other, it is not small against the curve. An offset's error
    is not counted: docs/limits.md.
    """
    total = box.degrees[:, 0] if box.offset[1] == 0.0 else np.zeros(len(columns))
    before, last = (np.abs(columns[total == n]).sum(axis=0).max() for n in (DEGREE - 2, DEGREE - 1))
    return np.asarray(last * last / before if before > 0.0 else 0.0)


def _roughness(curve: Floats) -> Floats:
    """Error of the work by every other node, over its range: docs/solver.md (62)."""
    even, odd = curve[:, ::2], curve[:, 1::2]
    guess = sum(
        weight * (np.roll(even, back, axis=1) + np.roll(even, -1 - back, axis=1))
        for back, weight in enumerate((150.0 / 256.0, -25.0 / 256.0, 3.0 / 256.0))
    )
    swing = np.maximum(np.ptp(curve, axis=1), 1e-300)
    return np.asarray(np.abs(guess - odd).max(axis=1) / swing)


def _jaggedness(curve: Floats, stride: int) -> Floats:
    """Rise or fall of the work between coarse nodes above a smooth curve: docs/solver.md (95)."""
    nodes = curve[:, ::stride]
    after = np.roll(nodes, -1, axis=1)
    chord = nodes[..., None] + (after - nodes)[..., None] * (np.arange(stride) / stride)
    rise = curve.reshape(chord.shape) - chord
    bend = 2.0 * nodes - np.roll(nodes, 1, axis=1) - after
    largest = np.zeros(len(curve))
    for sign in (1.0, -1.0):
        allowed = 0.25 * np.maximum(sign * bend, 0.0)
        allowed = np.maximum(allowed, np.roll(allowed, -1, axis=1))
        np.maximum(largest, ((sign * rise).max(axis=2) - allowed).max(axis=1), out=largest)
    return largest


class _Velocity(NamedTuple):
    """Velocity of one cylinder over its cycle as columns, times its radius: (term, point).

    `inside` is at the quadrature points, `at_node` at the nodes; `square` and `slope` are of its
    square times the factor on the mass, at the nodes; `square_between` is in the middles.
    """

    inside: Floats
    at_node: Floats
    square: Floats
    slope: Floats
    square_between: Floats


def _angles(member: Member, nodes: Nodes, period: float) -> tuple[Floats, Floats]:
    """Quadrature points and nodes of a cycle, in the cylinder's own angle [rad]."""
    node: Floats = np.arange(nodes.of_cycle, dtype=np.float64)
    inside: Floats = (node + POINTS[:, None]).reshape(-1) * nodes.width(period)
    return inside + member.phase, node * nodes.width(period) + member.phase


@lru_cache(maxsize=64)
def _velocity_of(member: Member, box: Box, nodes: Nodes, period: float) -> _Velocity:
    """Velocity of a cylinder as columns."""
    inside, at_node = _angles(member, nodes, period)
    crank = tuple(side[:, None] for side in box.samples.T)
    between = at_node + 0.5 * nodes.width(period)
    curves = (
        member.velocity(inside, *crank), member.velocity(at_node, *crank),
        *member.square(at_node, *crank), member.square(between, *crank)[0],
    )  # fmt: skip
    return _Velocity(*(np.einsum("ts,sn->tn", box.transform, curve) for curve in curves))


def mean_weights(member: Member, box: Box, period: float) -> tuple[Floats, Floats]:
    """Angles of a cycle's pressures, and weights of these in the mean of p v, (term, angle)."""
    nodes = Nodes(FEWEST_NODES, WIDE, 1)
    angle, _ = _angles(member, nodes, period)
    each = np.repeat(WEIGHTS, FEWEST_NODES) / FEWEST_NODES
    angle = member.diagram_angle(angle, box.ratio[0], box.offset[0])
    return angle, each * _velocity_of(member, box, nodes, period).inside


def _folded(curves: Floats, nodes: Nodes) -> Floats:
    """Sum over the periods of a cycle, along the last axis."""
    shape = *curves.shape[:-1], nodes.times, nodes.of_engine
    return np.asarray(curves.reshape(shape).sum(axis=-2))


def _add_square(source: Source, curves: Floats) -> None:
    """Add V, the squared velocity less its mean, docs/method.md (20), and docs/solver.md (57)."""
    for member in source.members:
        own = _velocity_of(member, source.box, source.nodes, source.cylinders.period)
        for total, curve in zip(curves, (own.square, own.square_between, own.slope), strict=True):
            total += _folded(curve, source.nodes)
    # The squares of many cylinders nearly add up to a constant, whose rounding would remain in the
    # mean: it is subtracted first.
    curves[:2] -= curves[0, :, :1].copy()
    curves[:2] -= (curves[0] + 2.0 * curves[1]).mean(axis=1, keepdims=True) / 3.0


def _add_gas(source: Source, rows: Integers, curves: Floats) -> None:
    """Add the mean torque of intervals, and at nodes, of a pressure of 1 and of each diagram.

    The second curve gets the first half of each interval. Cylinders whose phases differ by whole
    intervals have the same torque.
    """
    step, nodes = source.width, source.nodes.of_engine
    total = curves[:, : FIRST_GAS + rows.size]
    for member in source.members:
        whole = math.floor(member.phase / step + SAME_PLACE)
        rest, whole = member.phase - whole * step, whole % nodes
        rest = rest if rest > SAME_PLACE * step else 0.0
        first = member._replace(phase=rest, mass_factor=1.0, bore_factor=1.0)
        key = "gas", first, source.box, source.nodes, rows.tobytes()
        make = partial(_gas_of, source, rows, first)
        (own,) = remembered(source.family, key, make) if len(source.members) > 1 else make()
        if member.bore_factor != 1.0:
            own = member.area_factor * own
        total[..., : nodes - whole] += own[..., whole:]
        total[..., nodes - whole :] += own[..., :whole]


def _gas_of(source: Source, rows: Integers, member: Member) -> tuple[Floats, ...]:
    """Torque that `_add_gas` adds for one cylinder, (curve, part, term, node)."""
    inside, at_node = _angles(member, source.nodes, source.cylinders.period)
    speed = _velocity_of(member, source.box, source.nodes, source.cylinders.period)
    half = inside.size // 2
    early, late = (np.ascontiguousarray(part) for part in np.split(speed.inside, [half], axis=1))
    weights, one = WEIGHTS[: WEIGHTS.size // 2], np.ones(1)
    terms, nodes = len(source.box.degrees), source.nodes.of_engine
    work, halves, rates = curves = np.zeros((3, FIRST_GAS + rows.size, terms, nodes))

    def add(pressure: Floats, here: slice) -> None:
        add_products(pressure, 0, early, weights, halves[here])
        add_products(pressure, half, late, weights, work[here])
        add_products(pressure, inside.size, speed.at_node, one, rates[here])

    add(np.ones((1, inside.size + at_node.size)), slice(UNIT, UNIT + 1))
    angle = np.concatenate([inside, at_node])
    angle = member.diagram_angle(angle, source.box.ratio[0], source.box.offset[0])
    family = own_diagrams(source.family, member.diagram)
    pressure = pressures_of_rows(family, rows, angle, member.pressure_factor)
    add(pressure, slice(FIRST_GAS, None))
    curves[:, FIRST_GAS:] -= ATMOSPHERE * curves[:, UNIT : UNIT + 1]
    work += halves
    return (curves,)


def _add_friction(source: Source, diagram: RubbedDiagram, member: Member, curves: Floats) -> None:
    """Subtract each part of a cylinder's friction over its mean: docs/method.md (32), (50)."""
    inside, at_node = _angles(member, source.nodes, source.cylinders.period)
    ratio, offset = (side[:, None] for side in member.own(*source.box.samples.T))
    shapes, low = [], math.floor(diagram.row)
    part = diagram.row - low
    for angle in (inside, at_node):
        rows = np.array([low, low + (part > 0.0)])
        one, other = pressures_of_rows(source.family, rows, angle, member.pressure_factor)
        pressure = diagram.scale * ((1.0 - part) * one + part * other)
        load = diagram.ring + pressure - diagram.crankcase
        shapes.append(stacked_parts(load, velocity(angle, ratio, offset), np.sin(angle)))
    of_points = np.repeat(WEIGHTS, at_node.size) / at_node.size
    mean = np.einsum("psq,q->ps", shapes[0], of_points)[..., None]
    # A part of the friction has a mean of 0 where the piston rings are always lifted: its torque is
    # 0.
    shapes = [np.where(mean > 0.0, -shape / np.where(mean > 0.0, mean, 1.0), 0.0)
              for shape in shapes]  # fmt: skip
    points = shapes[0].reshape(*shapes[0].shape[:-1], WEIGHTS.size, -1)
    half = WEIGHTS.size // 2
    whole = np.einsum("q,psqn->psn", WEIGHTS, points)
    first = np.einsum("q,psqn->psn", WEIGHTS[:half], points[:, :, :half])
    for target, shape in zip(curves, (whole, first, shapes[1]), strict=True):
        target += np.einsum("ts,psn->ptn", source.box.transform, _folded(shape, source.nodes))


_GAUSS = 0.5 + np.array([-1.0, 0.0, 1.0]) * math.sqrt(0.15)
POINTS = np.concatenate([0.5 * _GAUSS, 0.5 + 0.5 * _GAUSS])
WEIGHTS = np.tile([5.0, 8.0, 5.0], 2) / 36.0
"""Quadrature of an interval of width 1, docs/solver.md (56): Gauss's three points on each half."""


@kernel
def add_products(
    pressure: Floats, begin: int, velocity: Floats, weights: Floats, total: Floats
) -> None:
    """Add weight times pressure times velocity at the points of every interval, folded.

    `pressure` (row, point) from `begin` on and `velocity` (term, point) have the first point of all
    intervals of the cycle, then the second one, and so on; `total` is (row, term, node). The cycle
    is folded at the period of so many intervals as there are nodes.
    """
    rows, terms, nodes = total.shape
    steps = velocity.shape[1] // weights.size
    for row in range(rows):
        for term in range(terms):
            sums = total[row, term]
            for point in range(weights.size):
                weight = weights[point]
                for first in range(point * steps, (point + 1) * steps, nodes):
                    here = pressure[row, begin + first : begin + first + nodes]
                    speed = velocity[term, first : first + nodes]
                    for i in range(nodes):
                        sums[i] += weight * here[i] * speed[i]


@kernel
def cumulate(sums: Floats, halves: Floats, rates: Floats, width: float) -> Floats:
    """Turn mean torques of intervals into the work at nodes and between, docs/method.md (50).

    All are (part, term, node): `sums` has the mean torque of each interval, and gets the work at
    the node before it, without its mean; `halves` has what the first half of each adds to that, and
    gets the work in its middle; `rates` has the torque at the nodes, and loses its mean, which is
    returned, (part, term). `width` is that of an interval [rad].
    """
    parts, terms, nodes = sums.shape
    mean = np.empty((parts, terms))
    for part in range(parts):
        for term in range(terms):
            work, half, rate = sums[part, term], halves[part, term], rates[part, term]
            level = 0.0
            for i in range(nodes):
                level += work[i] / nodes
            done = total = 0.0
            for i in range(nodes):
                rise = work[i] - level
                work[i], half[i] = done, done + (half[i] - 0.5 * level) * width
                rate[i] -= level
                done += rise * width
                # Simpson's rule, as for the means over coarse intervals.
                total += (work[i] + 2.0 * half[i]) / (3.0 * nodes)
            for i in range(nodes):
                work[i] -= total
                half[i] -= total
            mean[part, term] = level
    return mean


@kernel
def arrange(
    work: Floats, halves: Floats, rates: Floats, width: float, weights: Floats, fine: Floats,
    coarse: Floats,
) -> None:  # fmt: skip
    """Put the work in the order in which solvers read it, `fine` and `coarse` of `columns.Columns`.

    What is missed of the middles is docs/solver.md (60), of the integral of the work (63), and of
    its mean over a coarse interval (72). `width` is that of an interval [rad]; `weights` are those
    of `weights_between`.
    """
    parts, terms, nodes = work.shape
    stride, wide = weights.shape[0], nodes // weights.shape[0]
    integral, missed = np.empty(nodes + 1), np.empty(wide)
    # Integral and work at the coarse nodes, extended by half a stencil at both ends.
    sparse, around = np.empty(wide + STENCIL), np.empty(wide + STENCIL)
    for part in range(parts):
        for term in range(terms):
            y, half, slope = work[part, term], halves[part, term], rates[part, term]
            total = 0.0
            for i in range(nodes):
                after = i + 1 if i + 1 < nodes else 0
                cubic = 0.5 * (y[i] + y[after]) + 0.125 * width * (slope[i] - slope[after])
                fine[part, i, 0, term], fine[part, i, 1, term] = y[i], slope[i]
                fine[part, i, 2, term], integral[i] = half[i] - cubic, total
                total += (y[i] + 4.0 * half[i] + y[after]) / 6.0  # Simpson's rule, exact for cubics
            integral[nodes] = total  # nearly 0, as the work less its mean is summed
            for c in range(wide + STENCIL):
                turn = (c - BEFORE + wide) // wide - 1
                node = (c - BEFORE - turn * wide) * stride
                sparse[c], around[c] = integral[node] + turn * total, y[node]
            # All intervals in one loop: twice as fast as one interval after the other.
            for place in range(stride):
                for c in range(wide):
                    missed[c] = integral[c * stride + place]
                for m in range(STENCIL):
                    for c in range(wide):
                        missed[c] -= weights[place, m] * sparse[c + m]
                for c in range(wide):
                    fine[part, c * stride + place, 3, term] = width * missed[c]
            for c in range(wide):
                at = c + BEFORE
                mean = (sparse[at + 1] - sparse[at]) / stride
                for m in range(len(MEAN_BY_PAIRS)):
                    mean -= MEAN_BY_PAIRS[m] * (around[at - m] + around[at + 1 + m])
                coarse[part, c, 0, term], coarse[part, c, 1, term] = around[at], mean
