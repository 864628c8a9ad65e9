"""Inputs of the kernels of the batch solver: the memory of a block of designs.

A block is LANES designs side by side, see `vectors`. An array of a block is (node, lane). Blocks
are always full: the last is filled up with copies of its last design, so a design has the same bits
whatever lies beside it.
"""

from __future__ import annotations

from itertools import accumulate, chain, islice, pairwise
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.plain_arrays import plain
from engine_dyn.speed.vectors import LANES, Rows, new_plain, new_rows, read, rows_of, write
from engine_dyn.speed.work.columns import Columns
from engine_dyn.speed.work.interpolation import weights_between
from engine_dyn.types import Floats, Integers

HALO = 4  # Coarse nodes repeated before and behind the period

MANY = 65536.0  # Counts a candidate in one sum with its node's number, which is always less

MOST_TERMS = 24  # Largest number of terms of the polynomial that replaces a load law

SOLVING, SETTLED, LEFT = 1.0, 0.0, -1.0
"""States of a lane: passes continue, passes are done, or the general solver takes the design."""


class ColumnRows(NamedTuple):
    """Columns as the kernels of the batch solver take them, see `Columns`."""

    fine: Floats  # Work at the fine nodes, with further values: `KINDS` for each node
    coarse: Floats  # Work at the coarse nodes, and error of its interval means by six nodes
    jagged: Floats  # Rise of the work between coarse nodes above a smooth curve


class WorkTable(NamedTuple):
    """Work tables of the designs of a block, which the next block may have too."""

    # Work of the pressure P and squared velocity V at the coarse nodes.
    gas: Rows
    square: Rows
    # Errors of the means of P and V over the interval that follows each coarse node, estimated
    # from six nodes.
    gas_missed: Rows
    square_missed: Rows
    # Factors by which a design sums its columns of work, which are polynomials in crank ratio and
    # offset.
    factor: Rows
    # Scratch: shares of a torque's part, and the shares times the factors.
    share: Rows
    shared: Rows
    # Fine table of P, then of V, for one design, as `Columns.fine`, where it was asked for.
    fine: Floats
    known: Integers  # Number of the work table that `fine` belongs to, -1 for none
    mixed: Floats  # Scratch: columns of the pressure P of a design
    weights: Floats  # Weights of coarse nodes at the fine nodes of a coarse interval


class Lanes(NamedTuple):
    """Numbers of each design of a block, shape (1, lane)."""

    state: Rows  # `SOLVING`, `SETTLED` or `LEFT`
    # Slope of the load law at the nominal speed, 1 where it does not depend on the speed; `free` is
    # 0 there, else 1.
    slope: Rows
    free: Rows
    mu: Rows  # Mean of the load law F
    # Highest and lowest u = (omega/omega_n)^2 - 1 at the nodes.
    high: Rows
    low: Rows
    # Range of u in which a polynomial replaces the load law: its centre, 1 over its half-width.
    centre: Rows
    half: Rows
    terms: Rows  # Number of the polynomial's terms; 0 for none
    passes: Rows  # Number of passes that were needed
    mean: Rows  # Mean of omega/omega_n
    # Local extrema that may be the largest or the smallest u: `MANY` times their number, plus the
    # sum of their nodes.
    tops: Rows
    bottoms: Rows


class Curves(NamedTuple):
    """Curves of a block over the coarse nodes, shape (node, lane).

    `missed` is what six nodes miss of the mean of X + r over the interval behind, `light` is 1/tau,
    `steep` F'/(s tau), `work` X, `load` y, `drive` X + r and `u` q - 1. Those from `work` on have
    HALO nodes more on both sides.
    """

    missed: Rows
    light: Rows
    steep: Rows
    work: Rows
    load: Rows
    drive: Rows
    u: Rows


class Peaks(NamedTuple):
    """Largest u, and largest -u, of every lane, and how they are searched."""

    # Fine node that is examined, and the nodes between which the search continues.
    node: Rows
    start: Rows
    end: Rows
    # Largest u and largest -u, and how much they may miss.
    value: Rows
    missed: Rows
    # Largest rise of u = (omega/omega_n)^2 - 1 between coarse nodes above its values at them
    hidden: Rows
    step: Rows  # Step to the next node; at first 1 where there is a node to begin at, else 0
    # Values at `node`: those of `WorkTable.fine`, then the load, X and r by polynomials through
    # coarse nodes, and the steepness F'/(s tau).
    seen: Rows


class Scratch(NamedTuple):
    """Memory of a block: curves, numbers of lanes, the law's polynomial, the table of a design.

    `values` is for the fit of the law; `width` is that of a fine interval [rad], of which there are
    `size`.
    """

    curves: Curves
    lanes: Lanes
    law: Rows
    table: WorkTable
    peaks: Peaks
    values: Rows
    width: float
    size: int


def column_rows(columns: Columns) -> ColumnRows:
    """Columns in rows."""
    terms = len(columns.degrees)
    return ColumnRows(
        plain(columns.fine.reshape(-1, terms)), plain(columns.coarse.reshape(-1, terms)),
        plain(columns.jagged[None]),
    )  # fmt: skip


def row_numbers(coarse: int, kinds: int, terms: int) -> tuple[list[int], ...]:
    """Numbers of rows of work table, curves, lanes and peaks, of each as far as they are reals."""
    return (
        [coarse] * 4 + [terms, 1, terms], [coarse] * 3 + [coarse + 2 * HALO] * 4,
        [1] * len(Lanes._fields), [2, 2, 1, 1, 2 * kinds + 4],
    )  # fmt: skip


def make_scratch(columns: Columns) -> Scratch:
    """Memory of a block."""
    _, fine, kinds, terms = columns.fine.shape
    coarse = columns.coarse.shape[1]
    table, curves, lanes, peaks = lengths = row_numbers(coarse, kinds, terms)
    ends = list(accumulate([*chain(*lengths), MOST_TERMS], initial=0))
    all_rows = new_rows(ends[-1])
    rows: Any = iter([all_rows[begin:end] for begin, end in pairwise(ends)])
    whole = [rows_of(np.zeros(LANES, dtype=np.int64)) for _ in range(3)]
    of_table = (
        *islice(rows, len(table)), new_plain(fine, 2 * kinds),
        plain(np.full((1, fine), -1)), new_plain(kinds, terms),
        plain(weights_between(fine // coarse)),
    )  # fmt: skip
    return Scratch(
        table=WorkTable._make(of_table), curves=Curves._make(islice(rows, len(curves))),
        lanes=Lanes._make(islice(rows, len(lanes))),
        peaks=Peaks._make((*whole, *islice(rows, len(peaks)))), law=next(rows),
        values=new_rows(MOST_TERMS), width=columns.width, size=fine,
    )  # fmt: skip


@inlined
def repeat_ends(curve: Rows) -> None:
    """Repeat a curve before and behind the period."""
    nodes = len(curve) - 2 * HALO
    for i in range(HALO):
        write(curve, i, read(curve, nodes + i))
        write(curve, HALO + nodes + i, read(curve, HALO + i))
