"""Working memory of the batch solver."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from engine_dyn.speed.batch.state import LANES, PAD, Block
from engine_dyn.speed.batch.two_grid import CHUNK, TwoGrid, make_two_grid
from engine_dyn.speed.fields import INPUTS
from engine_dyn.speed.tables.work_tables import TABLE_ROWS
from engine_dyn.types import Floats, Integers

__all__ = ["BlockScratch", "make_block", "make_block_scratch"]


class BlockScratch(NamedTuple):
    """Working memory of one thread for blocks of designs.

    Attributes
    ----------
    table, middles, rates : ndarray
        As of `engine_dyn.speed.general.scratch.Scratch`.
    at, shared : ndarray of int
        As there.
    places : ndarray of int, shape (LANES,)
        Where the results of each lane go.
    varying : ndarray of int
        Inputs that differ between the designs of a table.
    line : ndarray of int, shape (1,)
        Which line of designs `at` belongs to, see `take_designs`.
    cached : ndarray of int, shape (2,)
        Which designs `table` and `two_grid` belong to, and which the points of curves: the place of
        the table in the product, -1 of none.
    two_grid : TwoGrid
        The coarse and the fine grid of the table.
    """

    table: Floats
    middles: Floats
    rates: Floats
    at: Integers
    shared: Integers
    places: Integers
    varying: Integers
    line: Integers
    cached: Integers
    two_grid: TwoGrid


def make_block_scratch(nodes: int, steps: int, refinement: int) -> BlockScratch:
    """Working memory for designs with `nodes` nodes a period and `steps` in the whole grid.

    Each coarse interval of `two_grid` has `refinement` nodes.
    """
    return BlockScratch(
        table=np.empty((TABLE_ROWS, nodes)),
        middles=np.empty((4, nodes)),
        rates=np.empty(6 * steps),
        at=np.zeros(INPUTS, dtype=np.int64),
        shared=np.zeros(INPUTS, dtype=np.int64),
        places=np.zeros(LANES, dtype=np.int64),
        varying=np.zeros(INPUTS, dtype=np.int64),
        line=np.zeros(1, dtype=np.int64),
        cached=np.full(2, -1, dtype=np.int64),
        two_grid=make_two_grid(nodes, refinement),
    )


def aligned(size: int) -> Floats:
    """Zeros that begin with a line of the cache: else most wide loads and stores reach into two."""
    memory = np.zeros(size + 8)
    return memory[-(memory.ctypes.data // 8) % 8 :][:size]


def make_block(nodes: int, iterated: bool) -> Block:
    """Memory for a block with `nodes` coarse nodes a period, whose form is `iterated` or not."""
    rows = (nodes + 2 * PAD) * LANES
    return Block(
        state=np.empty(0),
        deviations=aligned(rows),
        remainders=aligned(rows if iterated else 0),
        changes=aligned(rows if iterated else 0),
        maxima=aligned(nodes // CHUNK * LANES),
        minima=aligned(nodes // CHUNK * LANES),
        chosen=np.zeros(LANES, dtype=np.int64),
    )
