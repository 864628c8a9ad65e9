"""From inputs that broadcast to the reduced designs that kernels take, and results written back."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.compilation import inlined
from engine_dyn.given_numbers import distinct_combinations
from engine_dyn.loads.laws import Form, LawFacts
from engine_dyn.loads.torque_curves import TorqueOverAngle
from engine_dyn.speed.fields import CANCELLED, CURVE_NAMES, FRICTION_NAMES, ROUNDING, Results
from engine_dyn.speed.work.boxes import Box
from engine_dyn.speed.work.columns import (
    ATMOSPHERE,
    FIRST_GAS,
    FRICTION_PARTS,
    UNIT,
    Parts,
    RubbedDiagram,
)
from engine_dyn.speed.work.interpolation import BEFORE, STENCIL, lagrange_weights
from engine_dyn.status import INVALID_INPUT
from engine_dyn.types import Booleans, Floats, Integers


def codes(names: tuple[str, ...], value: Any) -> Integers:
    """Places of words among the known names."""
    words = np.asarray(value)
    numbers = np.array([names.index(word) for word in words.flat], dtype=np.int64)
    return numbers.reshape(words.shape)


def take_unknown(inputs: dict[str, Any]) -> Booleans:
    """Designs without a diagram, whose `scale` is NaN; it and what follows from it become numbers.

    Kernels do not look for NaN: they solve these designs with another diagram, and what they find
    goes with `discard`.
    """
    unknown = np.isnan(inputs["scale"])
    if unknown.any():
        inputs["scale"] = np.where(unknown, 1.0, inputs["scale"])
        # Both torques follow from the diagram, and are NaN without one.
        for name in inputs.keys() & {"mean_torque", "friction_torque"}:
            inputs[name] = np.nan_to_num(inputs[name])
    return np.asarray(unknown)


def discard(results: dict[str, Any], unknown: Booleans) -> dict[str, Any]:
    """Results without those of designs without a diagram, which have the status "invalid input"."""
    if unknown.any():
        for name, array in results.items():
            here = unknown[..., None] if name in CURVE_NAMES else unknown
            lost = INVALID_INPUT if name == "status" else np.nan
            np.copyto(array, lost, where=here, casting="unsafe")
    return results


LEVELS = FRICTION_NAMES[:FRICTION_PARTS]
"""Friction levels over the stroke, in the order of the parts of `StrokeFriction`."""

ROWS_TOGETHER = 16
"""Ratio of rows up to which columns are made for whole groups of rows, where designs lie between
rows of the family: later designs find them made, which saves a quarter of the time of a million
designs with sampled loads."""


class Designs(NamedTuple):
    """Reduced numbers of some designs, docs/method.md (22), (49) and (51).

    Attributes
    ----------
    gas, eta, kappa : ndarray, shape (designs,)
        g [1/Pa], eta [1] and kappa [1/rad].
    unsure : ndarray, shape (designs,)
        Error of the speed over the nominal one by rounding and by the columns.
    speed, first, second, gear : ndarray, shape (designs,)
        Nominal speed [rad/s], and the numbers of the law over speed, see `laws.law_of`.
    factor : ndarray, shape (designs, term)
        Factors of the columns: Chebyshev polynomials of crank ratio and offset.
    table : ndarray of int, shape (designs,)
        Number of the work table; designs that follow each other may have the same.
    part, share : ndarray, shape (pieces, designs)
        Parts of the columns whose sum, each times its share, is the work P, docs/method.md (50).
    target : ndarray of int, shape (designs,)
        Where the results go.
    """

    gas: Floats
    eta: Floats
    kappa: Floats
    unsure: Floats
    speed: Floats
    first: Floats
    second: Floats
    gear: Floats
    factor: Floats
    table: Integers
    part: Integers
    share: Floats
    target: Integers


@dataclass(frozen=True)
class Inputs:
    """Inputs of all designs, arrays that broadcast to `shape`, each with all its axes."""

    arrays: Mapping[str, npt.NDArray[Any]]
    shape: tuple[int, ...]

    @classmethod
    def of(cls, inputs: Mapping[str, Any]) -> Inputs:
        """Give all inputs as many axes as the shape has that they broadcast to."""
        shape = np.broadcast_shapes(*map(np.shape, inputs.values()))
        arrays = {n: np.array(one, copy=None, ndmin=len(shape)) for n, one in inputs.items()}
        return cls(arrays, shape)

    @cached_property
    def size(self) -> int:
        """Number of designs."""
        return math.prod(self.shape)


@dataclass(frozen=True)
class Chosen:
    """Inputs of some designs."""

    inputs: Inputs
    places: Integers

    def places_in(self, shape: tuple[int, ...]) -> Integers:
        """Flat places of the designs in an array of a shape that broadcasts to that of all."""
        places, stride, step = np.zeros(1, dtype=np.int64), 1, 1
        for length, own in zip(self.inputs.shape[::-1], shape[::-1], strict=True):
            if own > 1:
                places = places + self.places // stride % length * step
                step *= own
            stride *= length
        return places

    def take(self, name: str) -> npt.NDArray[Any]:
        """Values of an input, shape (designs,), or (1,) where all have the same."""
        array = self.inputs.arrays[name]
        if array.size == 1:
            return array.reshape(1)
        if array.size == self.inputs.size:
            return array.reshape(-1)[self.places]
        return np.asarray(array.reshape(-1)[self.places_in(array.shape)])

    def lever(self) -> Floats:
        """Piston area times crank radius [m3], as `take`."""
        area: Floats = 0.25 * math.pi * self.take("bore") ** 2
        return area * (0.5 * self.take("double_radius"))

    def distinct(self, *names: str) -> tuple[Floats, Integers]:
        """Different combinations of some inputs, (combination, input), and that of each design."""
        return distinct_combinations(*map(self.take, names))

    def subset(self, which: Integers | Booleans | slice) -> Chosen:
        """Some of these designs."""
        return Chosen(self.inputs, self.places[which])


class Needs(NamedTuple):
    """Parts of columns that some designs need; `part` and `share` are as of `Designs`."""

    parts: Parts
    part: Integers
    share: Floats


def needs_of(chosen: Chosen, torques: Sequence[TorqueOverAngle | None], row_count: int) -> Needs:
    """Parts of columns that some designs need: diagrams, friction and torques where there are.

    `torques` are those of `DrivenMachine.torques`; the family has `row_count` rows.
    """
    row, scale = chosen.take("row").astype(np.float64), chosen.take("scale")
    low = np.floor(row).astype(np.int64)
    weight = row - low
    rows = np.unique(np.concatenate([low, low + (weight > 0.0)]))
    between = weight.any()
    if between:
        groups = ROWS_TOGETHER * np.unique(rows // ROWS_TOGETHER)
        whole = (groups[:, None] + np.arange(ROWS_TOGETHER)).reshape(-1)
        whole = whole[whole < row_count]
        rows = whole if whole.size <= 1.25 * rows.size else rows
    parts, place = Parts(rows), FIRST_GAS + np.searchsorted(rows, low)
    shares: list[tuple[Any, Any]] = [(place, scale * (1.0 - weight))]
    if between:
        shares.append((place + (weight > 0.0), scale * weight))
    shares.append((UNIT, scale * ATMOSPHERE - chosen.take("crankcase_pressure")))
    if any(chosen.take(name).any() for name in LEVELS):
        table, number = chosen.distinct("row", "scale", "crankcase_pressure", "ring_pressure")
        parts = parts._replace(rubbed=tuple(RubbedDiagram(*one) for one in table.tolist()))
        first = parts.first_rubbed + FRICTION_PARTS * number
        shares += [(first + i, np.maximum(chosen.take(name), 0.0)) for i, name in enumerate(LEVELS)]
    load, *others = torques
    if load is not None:
        table, number = chosen.distinct("gear_ratio", "load_phase")
        parts = parts._replace(torques=tuple((0, gear, phase) for gear, phase in table.tolist()))
        shares.append((parts.first_torque + number, chosen.take("load_scale") / chosen.lever()))
    for which, factor in enumerate((-chosen.take("torque_factor"), np.ones(1)), start=1):
        if others[which - 1] is not None:
            parts = parts._replace(torques=(*parts.torques, (which, 1.0, 0.0)))
            shares.append((parts.number - 1, factor / chosen.lever()))
    part = np.empty((len(shares), chosen.places.size), dtype=np.int64)
    share = np.empty(part.shape)
    for i, (which, factor) in enumerate(shares):
        part[i], share[i] = which, factor
    return Needs(parts, part, share)


def reduced(chosen: Chosen, needs: Needs, box: Box, missed: float, law: LawFacts) -> Designs:
    """Reduced numbers of some designs, docs/method.md (22), (49) and (51).

    Results go to their places among all designs. `missed` is what the columns miss of V.
    """
    speed, inertia, lever = chosen.take("speed"), chosen.take("inertia"), chosen.lever()
    radius = 0.5 * chosen.take("double_radius")
    energy = 0.5 * inertia * speed * speed
    eta = chosen.take("mass") * radius * radius / inertia
    surplus = chosen.take("mean_torque") - chosen.take("offset")
    first, second, *_ = (*(chosen.take(name) for name in law.numbers), 0.0, 0.0)

    def whole(value: Any) -> Floats:
        return np.ascontiguousarray(np.broadcast_to(value, chosen.places.shape), dtype=np.float64)

    crank = whole(chosen.take("crank_ratio")), whole(chosen.take("offset_ratio"))
    same = np.stack([*crank, *needs.part, *needs.share])
    changes = (same[:, 1:] != same[:, :-1]).any(axis=0)
    return Designs(
        gas=whole(lever / energy),
        eta=whole(eta),
        kappa=whole(surplus / energy),
        unsure=whole(ROUNDING * (1.0 + CANCELLED * eta) + missed * eta),
        speed=whole(speed),
        first=whole(first),
        second=whole(second),
        gear=whole(chosen.take("gear_ratio")),
        factor=box.factors(*crank),
        table=np.concatenate([[0], np.cumsum(changes)]),
        part=needs.part,
        share=needs.share,
        target=np.ascontiguousarray(chosen.places),
    )


PLACES = 2.0**26  # Parts of an interval between nodes to which angles within it are rounded


class Angles(NamedTuple):
    """Where curves are wanted: the node at or before each angle, and weights of those around it.

    Shapes (angle,) and (angle, STENCIL); nodes are the fine ones of a period.
    """

    node: Integers
    weight: Floats


def angles_of(angles: Floats, width: float, nodes: int) -> Angles:
    """Where angles [rad] lie among nodes of this width [rad]."""
    if not angles.size:  # no curve was asked for
        return Angles(np.zeros(0, dtype=np.int64), np.zeros((0, STENCIL)))
    place = np.mod(angles, width * nodes) / width
    # Rounded, so that angles a period apart have the same place.
    place = np.rint(place * PLACES) / PLACES
    node = np.floor(place)
    return Angles(node.astype(np.int64) % nodes, lagrange_weights(place - node))


@inlined
def store(
    target: int, high: float, low: float, mean: float, span: float, mu: float, error: float,
    passes: float, wanted: Integers, scalars: Floats,
) -> None:  # fmt: skip
    """Write one design's numbers, docs/method.md (1). Speeds are in rad/s, `span` is their range.

    `wanted` and `scalars` are as of `Results`. The load factor 1/mu is that of docs/method.md (52).
    """
    values = (span / mean, 2.0 * span / (high + low), high, low, mean, 1.0 / mu, error, passes)
    for result in range(len(values)):
        if wanted[result] >= 0:
            scalars[wanted[result], target] = values[result]


@inlined
def store_nothing(target: int, code: int, results: Results) -> None:
    """Write NaN for a design that has no numbers, and its outcome."""
    results.status[target] = code
    for i in range(len(results.wanted)):
        if results.wanted[i] >= 0:
            results.scalars[results.wanted[i], target] = math.nan
    for curve in (results.omega, results.acceleration):
        for i in range(curve.shape[1]):
            curve[target, i] = math.nan


@inlined
def store_curves(
    target: int, nominal: float, q: Floats, rate: Floats, angles: Angles, results: Results
) -> None:
    """Write speed and angular acceleration of a design at the wanted angles.

    `q` and its slope `rate` are those at the fine nodes. The angular acceleration is half of
    omega_n^2 q', because omega domega/dphi is domega/dt.
    """
    nodes = len(q)
    for i in range(len(angles.node)):
        node = angles.node[i]
        value, slope = q[node], rate[node]
        if angles.weight[i, BEFORE] != 1.0:  # the angle lies between nodes
            value = slope = 0.0
            for j in range(STENCIL):
                there = node + j - BEFORE
                there += nodes if there < 0 else (-nodes if there >= nodes else 0)
                value += angles.weight[i, j] * q[there]
                slope += angles.weight[i, j] * rate[there]
        if results.omega.shape[1] > 0:
            results.omega[target, i] = nominal * math.sqrt(max(value, 0.0))
        if results.acceleration.shape[1] > 0:
            results.acceleration[target, i] = 0.5 * nominal * nominal * slope


class Task(NamedTuple):
    """Arguments of `dispatch.solve` as kernels take them.

    `method` and `closure` are codes of `engine_dyn.speed.fields`, `variable` says whether the
    inertia varies over the crank angle, `tolerance` is the relative error of delta aimed at,
    `iterated` the error over the range of q that iterations may leave, and curves are wanted at
    `angles`.
    """

    method: int
    variable: bool
    closure: int
    tolerance: float
    iterated: float
    form: Form
    angles: Angles
