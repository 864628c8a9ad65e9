"""From inputs that broadcast to the reduced designs that kernels take."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.loads.laws import LawFacts
from engine_dyn.speed.results import CANCELLED, ROUNDING
from engine_dyn.speed.work.boxes import Box
from engine_dyn.speed.work.columns import ATMOSPHERE
from engine_dyn.speed.work.parts import FIRST_GAS, FRICTION_PARTS, UNIT, Parts, RubbedDiagram
from engine_dyn.types import Booleans, Floats, Integers

__all__ = [
    "LEVELS",
    "Chosen",
    "Designs",
    "Inputs",
    "Needs",
    "needs_of",
    "parts_of_designs",
    "reduced",
]

LEVELS = ("boundary_friction", "mixed_friction", "hydrodynamic_friction", "skirt_friction")
"""Levels of the friction over the stroke, in the order of the parts of `StrokeFriction`."""


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
    def of(cls, inputs: Mapping[str, Any], shape: tuple[int, ...]) -> Inputs:
        """Give all inputs as many axes as `shape` has."""
        arrays = {}
        for name, value in inputs.items():
            array = np.asarray(value)
            arrays[name] = array.reshape((1,) * (len(shape) - array.ndim) + array.shape)
        return cls(arrays, shape)

    @property
    def size(self) -> int:
        """Number of designs."""
        return math.prod(self.shape)

    def at(self, places: Integers) -> Chosen:
        """Return the designs at some flat places."""
        return Chosen(self, places)


@dataclass(frozen=True)
class Chosen:
    """Inputs of some designs."""

    inputs: Inputs
    places: Integers

    @cached_property
    def _along(self) -> tuple[Integers, ...]:
        shape = self.inputs.shape
        return tuple(np.unravel_index(self.places, shape)) if shape else ()

    def take(self, name: str) -> npt.NDArray[Any]:
        """Values of an input, shape (designs,), or (1,) where all have the same."""
        array = self.inputs.arrays[name]
        if array.size == 1:
            return array.reshape(1)
        if array.size == self.inputs.size:
            return array.reshape(-1)[self.places]
        index = [
            here if size > 1 else 0 for here, size in zip(self._along, array.shape, strict=True)
        ]
        return np.asarray(array[tuple(index)])

    def full(self, name: str) -> npt.NDArray[Any]:
        """Values of an input, shape (designs,)."""
        return np.broadcast_to(self.take(name), self.places.shape)

    def has(self, name: str) -> bool:
        """Whether an input is other than 0 for any of them."""
        return bool((self.take(name) != 0.0).any())

    def subset(self, which: Integers | Booleans | slice) -> Chosen:
        """Some of these designs."""
        return Chosen(self.inputs, self.places[which])


def _distinct(chosen: Chosen, names: tuple[str, ...]) -> tuple[Floats, Integers]:
    """Different combinations of some inputs, (combination, input), and that of each design."""
    values = [chosen.take(name).astype(np.float64) for name in names]
    table = np.stack(np.broadcast_arrays(*values), axis=1)
    if len(table) == 1:
        return table, np.zeros(chosen.places.size, dtype=np.int64)
    found, number = np.unique(table, axis=0, return_inverse=True)
    return found, number.reshape(-1)


def _floor_of_rows(chosen: Chosen) -> tuple[Integers, Floats]:
    """Row of the family at or before each design's diagram, and the weight of the next one."""
    row = chosen.take("row").astype(np.float64)
    low = np.floor(row)
    return low.astype(np.int64), row - low


class Needs(NamedTuple):
    """Parts of columns that some designs need, and which of them each design has.

    `rubbed` and `load` are numbers among `Parts.rubbed` and `Parts.loads`.
    """

    parts: Parts
    rubbed: Integers
    load: Integers


def needs_of(chosen: Chosen, over_angle: bool) -> Needs:
    """Parts of columns that some designs need."""
    low, weight = _floor_of_rows(chosen)
    rows = np.unique(np.concatenate([low, low + (weight > 0.0)]))
    nothing = np.zeros(0, dtype=np.int64)
    rubbed: tuple[RubbedDiagram, ...] = ()
    loads: tuple[tuple[float, float], ...] = ()
    of_rubbed = of_load = nothing
    if any(chosen.has(name) for name in LEVELS):
        found, of_rubbed = _distinct(
            chosen, ("row", "scale", "crankcase_pressure", "ring_pressure")
        )
        rubbed = tuple(RubbedDiagram(*one) for one in found.tolist())
    if over_angle:
        found, of_load = _distinct(chosen, ("gear_ratio", "load_phase"))
        loads = tuple((gear, phase) for gear, phase in found.tolist())
    return Needs(Parts(rows, rubbed, loads), of_rubbed, of_load)


def parts_of_designs(chosen: Chosen, needs: Needs) -> tuple[Integers, ...]:
    """Parts of the columns that tell how many nodes each design needs."""
    low, weight = _floor_of_rows(chosen)
    place = FIRST_GAS + np.searchsorted(needs.parts.rows, low)
    found = [place, place + (weight > 0.0)]
    if needs.parts.loads:
        found.append(needs.parts.first_load + needs.load)
    return tuple(found)


def _pieces(chosen: Chosen, needs: Needs, lever: Floats) -> tuple[Integers, Floats]:
    """Parts of the columns of each design, and their shares, shape (pieces, designs)."""
    parts = needs.parts
    low, weight = _floor_of_rows(chosen)
    scale = chosen.take("scale")
    place = FIRST_GAS + np.searchsorted(parts.rows, low)
    found = [(place, scale * (1.0 - weight))]
    if weight.any():
        found.append((place + (weight > 0.0), scale * weight))
    found.append((np.array([UNIT]), scale * ATMOSPHERE - chosen.take("crankcase_pressure")))
    if parts.rubbed:
        first = parts.first_rubbed + FRICTION_PARTS * needs.rubbed
        found += [(first + i, np.maximum(chosen.take(name), 0.0)) for i, name in enumerate(LEVELS)]
    if parts.loads:
        found.append((parts.first_load + needs.load, chosen.take("load_scale") / lever))
    part = np.empty((len(found), chosen.places.size), dtype=np.int64)
    share = np.empty(part.shape)
    for i, (which, factor) in enumerate(found):
        part[i], share[i] = which, factor
    return part, share


def _factors(degrees: Integers, place: Sequence[Floats]) -> Floats:
    """Chebyshev polynomials of both places, docs/method.md (58), shape (designs, term)."""
    found = np.ones((place[0].size, len(degrees)))
    for side, x in enumerate(place):
        before, now = np.ones(x.size), x
        for degree in range(1, int(degrees[:, side].max()) + 1):
            found[:, degrees[:, side] == degree] *= now[:, None]
            before, now = now, 2.0 * x * now - before
    return found


def reduced(chosen: Chosen, needs: Needs, box: Box, missed: float, law: LawFacts) -> Designs:
    """Reduced numbers of some designs, docs/method.md (22), (49) and (51).

    Results go to their places among all designs. `missed` is what the columns miss of V.
    """
    speed, inertia = chosen.take("speed"), chosen.take("inertia")
    radius = 0.5 * chosen.take("double_radius")
    lever = 0.25 * math.pi * chosen.take("bore") ** 2 * radius
    energy = 0.5 * inertia * speed * speed
    part, share = _pieces(chosen, needs, lever)
    numbers = [chosen.take(name) for name in law.numbers] + [np.zeros(1)] * 2
    surplus = chosen.take("mean_torque") - chosen.take("offset")
    eta = chosen.take("mass") * radius * radius / inertia

    def whole(value: Any) -> Floats:
        return np.ascontiguousarray(np.broadcast_to(value, chosen.places.shape), dtype=np.float64)

    ratio, offset = chosen.take("crank_ratio"), chosen.take("offset_ratio")
    place = [whole(side) for side in box.place(ratio, offset)]
    same = np.stack([*place, *part, *share])
    changes = (same[:, 1:] != same[:, :-1]).any(axis=0)
    return Designs(
        gas=whole(lever / energy),
        eta=whole(eta),
        kappa=whole(surplus / energy),
        unsure=whole(ROUNDING * (1.0 + CANCELLED * eta) + missed * eta),
        speed=whole(speed),
        first=whole(numbers[0]),
        second=whole(numbers[1]),
        gear=whole(chosen.take("gear_ratio")),
        factor=_factors(box.degrees, place),
        table=np.concatenate([[0], np.cumsum(changes)]),
        part=part,
        share=share,
        target=np.ascontiguousarray(chosen.places),
    )
