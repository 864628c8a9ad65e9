"""Designs in groups that have columns in common, and in pieces of one call of a kernel.

Designs are grouped by cylinders, box of crank ratio and offset, and repeats of a load; within a
group they are sorted by their diagram. What a design gets depends on its own inputs alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.geometry.cylinders import Cylinders, even_cylinders
from engine_dyn.loads.driven_machine import DrivenMachine, cycles_of, repeats_of
from engine_dyn.loads.laws import LAWS
from engine_dyn.pressure.family import Family
from engine_dyn.speed.designs import Chosen, Designs, Inputs, Needs, needs_of, reduced
from engine_dyn.speed.fields import TABLE_NAMES
from engine_dyn.speed.vectors import LANES
from engine_dyn.speed.work.boxes import box_of, boxes_of
from engine_dyn.speed.work.columns import (
    FEWEST_NODES,
    FIRST_GAS,
    Columns,
    Source,
    columns_of,
    nodes_of,
)
from engine_dyn.types import Integers

SLAB, PIECE, FEW = 1 << 18, 1 << 14, 1 << 13
"""Largest numbers of designs that are grouped at a time, that one call of a kernel solves, and
that are not divided among threads."""

MOST_PARTS, MOST_COLUMNS = 384, 3072
"""Diagrams, and columns times diagrams, that exist at a time: a few ten megabytes."""

ROUGHNESS, ROUGHEST = 20.0, 32
"""Largest error of the work at every other node, over the tolerance, docs/solver.md (62);
largest factor on the nodes because of a rough diagram."""

CRANK = ("crank_ratio", "offset_ratio")  # Inputs that determine the box of the crank


@dataclass(frozen=True)
class Call:
    """A piece whose columns are known: one call of a kernel."""

    piece: Piece
    needs: Needs
    columns: Columns

    def designs(self) -> Designs:
        """Reduced numbers of the designs, filled up to whole blocks with the last of them."""
        piece, size = self.piece, self.piece.size
        filled = np.minimum(np.arange(size + -size % LANES), size - 1)
        part, share = self.needs.part[:, filled], self.needs.share[:, filled]
        return reduced(
            piece.chosen.subset(filled), self.needs._replace(part=part, share=share),
            piece.source.box, float(self.columns.missed), LAWS[piece.grouping.driven.form.kind],
        )  # fmt: skip


@dataclass(frozen=True)
class Piece:
    """Designs of a group; their columns are made by the thread that solves them.

    `key` has the values of `Grouping.keys`; `finer` is the factor on the number of nodes with which
    those of `source` were chosen.
    """

    grouping: Grouping
    key: tuple[int, ...]
    chosen: Chosen
    source: Source
    finer: int

    @property
    def size(self) -> int:
        """Number of designs."""
        return self.chosen.places.size

    def calls(self) -> Iterator[Call]:
        """The designs with columns, divided where these are too many, or too rough for some."""
        needs = needs_of(self.chosen, self.source.torques, self.source.family.row_count)
        terms = max(len(self.source.box.degrees), MOST_COLUMNS // MOST_PARTS)
        most = MOST_COLUMNS // self.source.cylinders.cycles
        if needs.parts.number * terms > most and self.size > 1:
            for half in np.array_split(np.arange(self.size), 2):
                yield from replace(self, chosen=self.chosen.subset(half)).calls()
            return
        columns = columns_of(self.source, needs.parts)
        # The roughness of diagrams and loads determines a design's number of nodes; that of the
        # common curves and of friction does not.
        rough_parts = columns.rough > ROUGHNESS * self.grouping.tolerance
        rough_parts[:FIRST_GAS] = False
        rough_parts[needs.parts.first_rubbed : needs.parts.first_torque] = False
        rough = np.asarray(rough_parts[needs.part].any(axis=0))
        if not rough.any() or 2 * self.finer > ROUGHEST:
            yield Call(self, needs, columns)
            return
        coarse = self.source.nodes
        nodes = nodes_of(coarse.times, 2 * coarse.of_cycle, self.grouping.is_steep, coarse.cycles)
        closer = replace(self, source=replace(self.source, nodes=nodes), finer=2 * self.finer)
        yield from replace(closer, chosen=self.chosen.subset(rough)).calls()
        if not rough.all():
            yield from replace(self, chosen=self.chosen.subset(~rough)).calls()


@dataclass(frozen=True)
class Grouping:
    """Material of groups: arguments of `engine_dyn.speed.dispatch.solve`.

    `keys` are names of inputs, whole numbers, that are the same within a group, cylinders first:
    these may be others that have the same columns, unless `curves` over the angle are wanted.
    `piece` is the largest number of designs of a piece.
    """

    inputs: Inputs
    family: Family
    cylinders_by_count: Mapping[int, Cylinders] | None
    driven: DrivenMachine
    tolerance: float
    keys: tuple[str, ...]
    curves: bool = False
    piece: int = PIECE

    def cylinders_of(self, count: int) -> Cylinders:
        """Cylinders of a key."""
        cylinders = (self.cylinders_by_count or {}).get(count)
        return cylinders or even_cylinders(count, self.family.period)

    def turned(self, count: int) -> tuple[Cylinders, float]:
        """Cylinders that columns are made of, see `Cylinders.turned`."""
        own = self.cylinders_of(count)
        return (own, 0.0) if self.driven.over_angles else own.turned

    @cached_property
    def _first_alike(self) -> dict[int, int]:
        """First key with the same columns, for keys of cylinders that are not the first."""
        known: dict[Cylinders, int] = {}
        every = {} if self.curves else self.cylinders_by_count or {}
        return {n: first for n in every if (first := known.setdefault(self.turned(n)[0], n)) != n}

    @property
    def is_steep(self) -> bool:
        """Whether the torque over speed may be steep: it is a table, or that of a motor."""
        return self.driven.motor or self.driven.over_speed is not None

    def pieces(self, places: Integers | None, finer: int, alone: bool = False) -> Iterator[Piece]:
        """Designs at some flat places, or all, in groups and in pieces sorted by their diagram.

        `finer` is a factor on the number of nodes; where `alone`, each crank ratio and offset gets
        columns of its own, which miss nothing.
        """
        every = self.inputs.size if places is None else places.size
        names: tuple[str, ...] = TABLE_NAMES
        if self.driven.over_angles:  # the work of torques over angle depends on more inputs
            names += ("gear_ratio", "load_phase", "load_scale", "torque_factor", "bore")
            names += ("double_radius",)
        common = np.broadcast_shapes(*(self.inputs.arrays[name].shape for name in names))
        for begin in range(0, every, SLAB):
            slab = np.arange(begin, min(begin + SLAB, every))
            every_one = Chosen(self.inputs, slab if places is None else places[slab])
            for key, chosen, source in self._groups(every_one, finer, alone):
                # In a grid, designs that share a work table become neighbours.
                if 1 < math.prod(common) <= self.inputs.size // LANES:
                    chosen = chosen.subset(_order(chosen.places_in(common)))
                row = np.floor(chosen.take("row")).astype(np.int64)
                if row.size > 1:
                    order = _order(row)
                    chosen, row = chosen.subset(order), row[order]
                size, rows = chosen.places.size, 1 + int(np.count_nonzero(np.diff(row)))
                pairs = max(-(-size // (2 * self.piece)), rows // (2 * MOST_PARTS))
                # Groups of equal size, and an even number of them for two threads, save a third of
                # the time of 50,000 designs.
                whole = size <= FEW and rows <= MOST_PARTS
                for some in np.array_split(chosen.places, 1 if whole else 2 * pairs):
                    yield Piece(self, key, Chosen(self.inputs, some), source, finer)

    def _groups(
        self, chosen: Chosen, finer: int, alone: bool
    ) -> Iterator[tuple[tuple[int, ...], Chosen, Source]]:
        """Designs that share keys, box and repeats of the load; their cylinders first."""
        family, torques = self.family, self.driven.torques
        cycles = cycles_of(self.driven.over_angle, family.period)
        fewest = finer * FEWEST_NODES * max(1, round(family.period / FOUR_STROKE))
        keys = [*(chosen.take(name) for name in self.keys), self._repeats(chosen)]
        if self._first_alike:
            counts, place = np.unique(keys[0], return_inverse=True)
            keys[0] = np.array([self._first_alike.get(n, n) for n in counts.tolist()])[place]
        for (count, *others, repeats), same in _split(chosen, keys):
            cylinders, _ = self.turned(count)
            radius = max(cylinders.radius_factors)
            times = math.gcd(cylinders.symmetry, repeats * cylinders.cycles)
            nodes = nodes_of(times, fewest * cylinders.cycles, self.is_steep, cycles)
            ratio, offset = (same.take(name) for name in CRANK)
            # Phases of articulated rods depend on crank ratio and offset: each pair of these gets
            # columns of its own, without polynomials in between.
            boxes = boxes_of(ratio, offset, radius, alone or cylinders.articulated)
            for (number,), alike in _split(same, [boxes]):
                own_ratio, own_offset = (float(alike.take(name)[0]) for name in CRANK)
                box = box_of(number, own_ratio, own_offset, radius)
                yield (count, *others), alike, Source(family, cylinders, box, nodes, torques)

    def _repeats(self, chosen: Chosen) -> Integers:
        """Repetitions of each design's load and auxiliaries, see `cycles_of`; 0 with neither."""
        load, gear, period = self.driven.over_angle, chosen.take("gear_ratio"), self.family.period
        own = self.driven.auxiliaries
        times = 0 if own is None else own.repeats * cycles_of(load, period)
        repeats = 0 if load is None else repeats_of(load, gear, period)
        return np.asarray(np.gcd(repeats, times)).reshape(-1)


def _split(
    chosen: Chosen, keys: Sequence[npt.NDArray[Any]]
) -> Iterator[tuple[tuple[int, ...], Chosen]]:
    """Designs whose whole-number keys are equal; keys of size 1 hold for all designs."""
    number = np.zeros(1, dtype=np.int64)
    for key in keys:
        if key.size > 1:
            low = int(key.min())
            number = number * (int(key.max()) - low + 1) + (key - low)
    if (number == number[0]).all():
        yield tuple(int(key[0]) for key in keys), chosen
        return
    order = _order(number)
    edges = np.flatnonzero(np.diff(number[order])) + 1
    for part in np.split(order, edges):
        yield tuple(int(key[part[0] if key.size > 1 else 0]) for key in keys), chosen.subset(part)


def _order(number: Integers) -> Integers:
    """Sorting order of whole numbers from 0 on; small numbers are sorted by counting."""
    return np.argsort(number.astype(np.min_scalar_type(int(number.max()))), kind="stable")
