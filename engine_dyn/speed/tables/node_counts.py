"""How many nodes a cycle needs, and which rows of a family its tables are made from."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from engine_dyn.compilation import kernel
from engine_dyn.loads.driven_machine import TorqueOverAngle, repeats_of
from engine_dyn.loads.friction import FRICTIONLESS
from engine_dyn.pressure.curves import on_threads
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.pressure.family import Family, family_from_diagrams
from engine_dyn.pressure.family_grid import FamilyAtSpeeds, FamilyStack
from engine_dyn.pressure.memory import remembered
from engine_dyn.speed.tables.pressure_grid import Grid, make_grid
from engine_dyn.speed.tables.work_tables import (
    FEWEST_NODES,
    GAS_WORK,
    GAS_WORK_MIDDLE,
    GAS_WORK_TILT,
    MOST_NODES,
    QUINTIC,
    TABLE_ROWS,
    Blend,
    bounds_of,
    build,
)
from engine_dyn.types import Booleans, Floats, Integers

__all__ = [
    "fewest_nodes",
    "fewest_nodes_of_load",
    "may_be",
    "repeats_of_load",
    "row_map",
    "rows_needed",
]

ROWS_AT_ONCE = 256
"""Rows whose samples exist at a time."""


def may_be(value: Any) -> bool:
    """Whether an input may be other than 0 in the sweep.

    An array counts even if all its values are 0, because a block of a sweep must not decide by its
    own values.
    """
    return np.ndim(value) > 0 or float(value) != 0.0


def rows_needed(row: Floats) -> Integers:
    """Rows of the family between which the (fractional) rows lie."""
    flat = row.ravel()
    if flat.size == 1:
        return np.array(sorted({math.floor(flat[0]), math.ceil(flat[0])}))
    seen = np.zeros(int(np.ceil(flat.max())) + 1, dtype=np.bool_)
    seen[np.floor(flat).astype(np.int64)] = True
    seen[np.ceil(flat).astype(np.int64)] = True
    return np.flatnonzero(seen)


def row_map(family: Family, rows: Integers) -> Integers:
    """Place of each row of the family among `rows`, -1 for those that are not there."""
    table = np.full(family.row_count + 1, -1, dtype=np.int64)
    table[rows] = np.arange(len(rows))
    return table


def fewest_nodes(family: Family, row: Floats, tolerance: float) -> Integers:
    """Nodes of a cycle for each (fractional) row: as many as its own two diagrams need.

    Over load and speed, or where cycles differ, rows vary along several axes, of which `split`
    allows one. All rows then have as many nodes as the roughest of all given diagrams needs.
    """
    over_speed = isinstance(family, FamilyAtSpeeds | FamilyStack)
    if isinstance(family, CycleTable) and family.several_axes:
        return np.full((1,) * row.ndim, _nodes_of_examples(family, tolerance))
    needed = rows_needed(row)
    if isinstance(family, CycleTable):
        found = _nodes_of_rows(family, needed, tolerance)
        below, above = np.floor(row).astype(np.int64), np.ceil(row).astype(np.int64)
        places = np.searchsorted(needed, below), np.searchsorted(needed, above)
        return np.maximum(found[places[0]], found[places[1]])
    used = family.diagrams if over_speed else [family.row(i) for i in needed.tolist()]
    nodes = [_nodes_of_diagram(diagram, tolerance) for diagram in used]
    if over_speed or row.size == 1:
        return np.full((1,) * row.ndim, max(nodes))
    counts = np.zeros(family.row_count + 1, dtype=np.int64)
    counts[needed] = nodes
    below, above = np.floor(row).astype(np.int64), np.ceil(row).astype(np.int64)
    return np.maximum(counts[below], counts[above])


def repeats_of_load(load: TorqueOverAngle | None, gear: Floats, period: float) -> Integers:
    """How often a load over angle repeats within the cycle.

    0 where there is none, because the greatest common divisor of 0 and the engine's symmetry is the
    symmetry.
    """
    if load is None:
        return np.zeros((1,) * gear.ndim, dtype=np.int64)
    return np.broadcast_to(repeats_of(load, gear, period), gear.shape)


def fewest_nodes_of_load(
    load: TorqueOverAngle | None, gear: Floats, period: float, tolerance: float
) -> Integers:
    """Nodes of a cycle that a load over angle needs, for each gear ratio."""
    if load is None:
        return np.zeros((1,) * gear.ndim, dtype=np.int64)
    found = np.empty(gear.shape, dtype=np.int64)
    for ratio in np.unique(gear):
        found[gear == ratio] = nodes_of_load(load, float(ratio), period, tolerance)
    return found


def nodes_of_load(load: TorqueOverAngle, ratio: float, period: float, tolerance: float) -> int:
    """Nodes of a cycle that a load over angle needs: the first condition of docs/method.md (56)."""
    steps = FEWEST_NODES
    while steps < MOST_NODES:
        count = max(int(np.ceil(steps * load.period / (ratio * period))), 4)
        step = load.period / count
        here = load.angle[0] + np.arange(count) * step
        work, torque = load.work(here), load(here) - load.mean
        cubic = 0.5 * (work + np.roll(work, -1)) + 0.125 * step * (torque - np.roll(torque, -1))
        missed = np.abs(load.work(here + 0.5 * step) - cubic).max()
        if missed <= 30.0 * tolerance * np.ptp(work):
            break
        steps *= 2
    return steps


_examples: WeakKeyDictionary[CycleTable, dict[float, int]] = WeakKeyDictionary()


def _nodes_of_examples(family: CycleTable, tolerance: float) -> int:
    """Nodes that the roughest of a table's examples needs."""
    known = _examples.setdefault(family, {})
    if tolerance not in known:
        # Not among the rows that the table keeps, which are those of the sweep's blocks.
        table = family.emptied()
        table.use_threads(family.threads)
        rows = table.examples()
        pieces = np.array_split(rows, -(-rows.size // ROWS_AT_ONCE))
        known[tolerance] = max(int(_nodes_of_rows(table, p, tolerance).max()) for p in pieces)
    return known[tolerance]


def _nodes_of_rows(family: CycleTable, rows: Integers, tolerance: float) -> Integers:
    """As `_nodes_of_diagram`, of rows of a table."""

    def find() -> tuple[Integers, ...]:
        nodes = np.full(rows.size, MOST_NODES)
        coarse, steps = np.arange(rows.size), FEWEST_NODES
        while steps < MOST_NODES and coarse.size:
            grid = make_grid(family, rows[coarse], steps)
            enough = np.empty(coarse.size, dtype=np.bool_)

            def work(begin: int, end: int) -> None:
                resolved(
                    begin, end, family.period / steps, tolerance, grid,  # noqa: B023
                    np.empty((TABLE_ROWS, steps)), np.empty((4, steps)),  # noqa: B023
                    np.empty(6 * steps), enough,  # noqa: B023
                )  # fmt: skip

            on_threads(coarse.size, work, family.threads)
            nodes[coarse[enough]] = steps
            coarse = coarse[~enough]
            steps *= 2
        return (nodes,)

    return remembered(family, ("nodes", rows.tobytes(), tolerance), find)[0]


@kernel
def resolved(
    begin: int, end: int, width: float, tolerance: float, grid: Grid, table: Floats,
    middles: Floats, rates: Floats, enough: Booleans,
) -> None:  # fmt: skip
    """Whether the nodes of a grid are enough for each of its diagrams, see `_nodes_of_diagram`."""
    for row in range(begin, end):
        blend = Blend(row, row, 0.0, 1.0, 0.0, FRICTIONLESS)
        build(0.3, 0.0, blend, width, grid, table, middles, rates)
        low, high = bounds_of(table[GAS_WORK])
        least, most = bounds_of(table[GAS_WORK_MIDDLE])
        falling, rising = bounds_of(table[GAS_WORK_TILT])
        swing = high - low
        within = max(-least, most) <= 30.0 * tolerance * swing
        enough[row] = within and 2.0 * QUINTIC * max(-falling, rising) <= tolerance * swing


@lru_cache(maxsize=4096)
def _nodes_of_diagram(diagram: Diagram, tolerance: float) -> int:
    """Nodes of a cycle for one diagram: doubled until a cubic through them misses little.

    docs/method.md (56), for the work of one cylinder at a crank ratio of 0.3, at the middle of the
    worst interval. The extremes use the middles too and seldom lie in the worst interval, so the
    threshold is above the tolerance. What is missed beyond the middles, which is much only for
    rough diagrams, is at most the tolerance. Each design's own error decides about its status.
    """
    family = family_from_diagrams([0.0], [diagram])
    steps = FEWEST_NODES
    while steps < MOST_NODES:
        table = np.empty((TABLE_ROWS, steps))
        grid = make_grid(family, np.array([0]), steps)
        build(
            0.3, 0.0, Blend(0, 0, 0.0, 1.0, 0.0, FRICTIONLESS), diagram.period / steps, grid, table,
            np.empty((4, steps)), np.empty(6 * steps),
        )  # fmt: skip
        swing = np.ptp(table[GAS_WORK])
        beyond = 2.0 * QUINTIC * np.abs(table[GAS_WORK_TILT]).max()
        within = np.abs(table[GAS_WORK_MIDDLE]).max() <= 30.0 * tolerance * swing
        if within and beyond <= tolerance * swing:
            break
        steps *= 2
    return steps
