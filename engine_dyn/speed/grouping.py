"""Designs in groups that have columns in common, and in pieces of one call of a kernel.

Designs are grouped by cylinders, box of crank ratio and offset, and repeats of a load; within a
group they are sorted by their diagram. What a design gets depends on its own inputs alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.loads.driven_machine import DrivenMachine, repeats_of
from engine_dyn.loads.laws import LAWS
from engine_dyn.pressure.family import Family
from engine_dyn.speed.broadcasting import cylinders_of
from engine_dyn.speed.designs import (
    Chosen,
    Designs,
    Inputs,
    Needs,
    needs_of,
    parts_of_designs,
    reduced,
)
from engine_dyn.speed.vectors import LANES
from engine_dyn.speed.work.boxes import ALONE, Box, box_of, boxes_of
from engine_dyn.speed.work.columns import FEWEST_NODES, Columns, Source, columns_of, nodes_of
from engine_dyn.types import Booleans, Integers

__all__ = ["Grouping", "Work"]

SLAB, PIECE = 1 << 18, 1 << 14
"""Designs that are grouped at a time, and those of one call of a kernel at most."""

MOST_PARTS = 3072
"""Columns times diagrams that exist at a time: a few ten megabytes."""

ROUGHNESS, ROUGHEST = 20.0, 32
"""Times the tolerance that every other node may miss of the work between them, docs/method.md (62);
largest factor on the nodes because of a rough diagram."""


@dataclass(frozen=True)
class Work:
    """Designs whose columns are known: one call of a kernel."""

    chosen: Chosen
    needs: Needs
    source: Source
    columns: Columns
    driven: DrivenMachine

    @property
    def size(self) -> int:
        """Number of designs."""
        return self.chosen.places.size

    def designs(self) -> Designs:
        """Reduced numbers of the designs, filled up to whole blocks with the last of them."""
        size = self.size + -self.size % LANES

        def filled(numbers: Integers) -> Integers:
            last = np.repeat(numbers[-1:], size - numbers.size)
            return np.concatenate([numbers, last]) if numbers.size else numbers

        needs = self.needs._replace(rubbed=filled(self.needs.rubbed), load=filled(self.needs.load))
        whole = Chosen(self.chosen.inputs, filled(self.chosen.places))
        return reduced(
            whole, needs, self.source.box, float(self.columns.missed), LAWS[self.driven.form.kind]
        )


@dataclass(frozen=True)
class Grouping:
    """What groups are made of.

    Attributes
    ----------
    inputs : Inputs
        Of all designs.
    family : Family
        Indicator diagrams.
    cylinders_by_count : mapping or None
        Cylinders of each key.
    driven : DrivenMachine
        Load over angle.
    tolerance : float
        Relative error aimed at, from which the number of nodes follows.
    keys : tuple of str
        Inputs, whole numbers, that are the same within a group.
    """

    inputs: Inputs
    family: Family
    cylinders_by_count: Mapping[int, Cylinders] | None
    driven: DrivenMachine
    tolerance: float
    keys: tuple[str, ...]

    @property
    def _is_steep(self) -> bool:
        """Whether the torque over speed may be steep: it is a table, or that of a motor."""
        return self.driven.motor or self.driven.over_speed is not None

    def works(self, places: Integers | None, finer: int, alone: bool = False) -> Iterator[Work]:
        """Designs at some flat places, or all, in groups and pieces, with their columns.

        `finer` is a factor on the number of nodes; where `alone`, each crank ratio and offset gets
        columns of its own, which miss nothing.
        """
        size = self.inputs.size if places is None else places.size
        for begin in range(0, size, SLAB):
            end = min(begin + SLAB, size)
            slab = np.arange(begin, end) if places is None else places[begin:end]
            for chosen, source in self._groups(self.inputs.at(slab), finer, alone):
                yield from self._pieces(chosen, source, finer)

    def _groups(self, chosen: Chosen, finer: int, alone: bool) -> Iterator[tuple[Chosen, Source]]:
        """Designs that have cylinders, method, model, box and repeats of the load in common."""
        keys = [chosen.take(name) for name in self.keys]
        load = self.driven.over_angle
        if load is not None:
            keys.append(np.asarray(repeats_of(load, chosen.take("gear_ratio"), self.family.period)))
        for same in _split(chosen, keys):
            cylinders = cylinders_of(
                int(same.take("cylinders").flat[0]), self.family.period, self.cylinders_by_count
            )
            radius = max(cylinders.radius_factors)
            ratio, offset = same.take("crank_ratio"), same.take("offset_ratio")
            box = np.full(1, ALONE) if alone else boxes_of(ratio, offset, radius)
            repeats = 0
            if load is not None:
                gear = same.take("gear_ratio").flat[:1]
                repeats = int(np.asarray(repeats_of(load, gear, self.family.period)).flat[0])
            nodes = nodes_of(
                math.gcd(cylinders.symmetry, repeats), finer * FEWEST_NODES, self._is_steep
            )
            source = Source(self.family, cylinders, box_of(0), nodes, load)
            for alike in _split(same, [box]):
                ratio, offset = alike.take("crank_ratio"), alike.take("offset_ratio")
                mine = boxes_of(ratio, offset, radius).flat[0]
                if not alone and mine != ALONE:
                    yield alike, replace(source, box=box_of(int(mine), radius))
                    continue
                # No box has such cranks: each gets columns of its own.
                pair = np.stack(
                    np.broadcast_arrays(alike.full("crank_ratio"), alike.full("offset_ratio"))
                )
                _, numbers = np.unique(pair, axis=1, return_inverse=True)
                for one in _split(alike, [numbers.reshape(-1)]):
                    own = (
                        float(one.take(name).flat[0]) for name in ("crank_ratio", "offset_ratio")
                    )
                    yield one, replace(source, box=Box(*((side, 0.0) for side in own)))

    def _pieces(self, chosen: Chosen, source: Source, finer: int) -> Iterator[Work]:
        """A group in pieces that are sorted by their diagram, with the columns of each."""
        row = chosen.take("row")
        if row.size > 1:
            low = np.floor(row).astype(np.int64)
            chosen = chosen.subset(
                np.argsort(low.astype(np.min_scalar_type(int(low.max()))), kind="stable")
            )
        most = max(1, MOST_PARTS // len(source.box.degrees))
        waiting = [
            chosen.subset(slice(begin, begin + PIECE))
            for begin in range(0, chosen.places.size, PIECE)
        ]
        while waiting:
            piece = waiting.pop(0)
            needs = needs_of(piece, source.load is not None)
            size = piece.places.size
            if needs.parts.number > most and size > 1:
                waiting[:0] = [
                    piece.subset(slice(None, size // 2)),
                    piece.subset(slice(size // 2, None)),
                ]
                continue
            columns = columns_of(source, needs.parts)
            rough = _is_rough(piece, needs, columns.rough > ROUGHNESS * self.tolerance)
            if rough.any() and 2 * finer <= ROUGHEST:
                fewest = 2 * source.nodes.number * source.nodes.times
                closer = replace(source, nodes=nodes_of(source.nodes.times, fewest, self._is_steep))
                yield from self._pieces(piece.subset(rough), closer, 2 * finer)
                if rough.all():
                    continue
                piece = piece.subset(~rough)
                needs = needs_of(piece, source.load is not None)
                columns = columns_of(source, needs.parts)
            yield Work(piece, needs, source, columns, self.driven)


def _split(chosen: Chosen, keys: Sequence[npt.NDArray[Any]]) -> Iterator[Chosen]:
    """Designs whose keys, whole numbers, are the same; keys of size 1 are those of all."""
    number: Any = None
    for key in keys:
        if key.size == 1:
            continue
        low = int(key.min())
        span = int(key.max()) - low + 1
        number = key - low if number is None else number * span + (key - low)
    if number is None or (number == number[0]).all():
        yield chosen
        return
    # Small whole numbers are sorted by counting.
    order = np.argsort(number.astype(np.min_scalar_type(int(number.max()))), kind="stable")
    edges = np.flatnonzero(np.diff(number[order])) + 1
    for part in np.split(order, edges):
        yield chosen.subset(part)


def _is_rough(chosen: Chosen, needs: Needs, rough: Booleans) -> Booleans:
    """Which designs have a part that the nodes do not resolve."""
    found = np.zeros(chosen.places.size, dtype=np.bool_)
    for part in parts_of_designs(chosen, needs):
        found |= rough[part]
    return found
