"""What the kernels of the batch solver take: designs, and the memory of a block of them.

A block is LANES designs side by side. An array of a block is (node, lane), so that loops over lanes
are vectors. Blocks are always full: the last is filled up with copies of its last design, so a
design has the same bits whatever lies beside it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from engine_dyn.speed.work.interpolation import weights_between
from engine_dyn.speed.work.summit import WINDOW
from engine_dyn.types import Booleans, Floats

__all__ = [
    "HALO",
    "LANES",
    "LEFT",
    "MANY",
    "MOST_TERMS",
    "SETTLED",
    "SOLVING",
    "Curves",
    "Lanes",
    "Scratch",
    "Table",
    "make_scratch",
]

LANES = 64
"""Designs of a block: so many that a loop over them outweighs its begin."""

HALO = 4
"""Coarse nodes that are repeated before and behind the period."""

MANY = 65536.0
"""More than there are coarse nodes."""

MOST_TERMS = 24
"""Most terms of the polynomial that stands for a law."""

SOLVING, SETTLED, LEFT = 1.0, 0.0, -1.0
"""States of a lane: passes go on, they are done, or the design is left to the general solver."""


class Table(NamedTuple):
    """Work table of one design, which the next one may have too.

    Attributes
    ----------
    gas, square : ndarray, shape (4, coarse node)
        P and V at the coarse nodes; their mean over the interval behind each, their first moment
        there, and what a cubic misses of the mean.
    fine : ndarray, shape (2, 4, fine node)
        What `Columns.fine` has, of P and of V, at the fine nodes that were asked for.
    known : ndarray of bool, shape (fine node,)
        Which these are.
    weights : ndarray, shape (stride, STENCIL)
        Weights of coarse nodes at the fine nodes of a coarse interval.
    """

    gas: Floats
    square: Floats
    fine: Floats
    known: Booleans
    weights: Floats


class Lanes(NamedTuple):
    """Numbers of each design of a block, shape (lanes,).

    Attributes
    ----------
    state
        `SOLVING`, `SETTLED` or `LEFT`.
    decay, of_mass, of_tilt, end, slope, beta
        As of `Weights`.
    start
        y at the first node; then what is left of it at each.
    mu, free
        Mean of F; 1 where it has to be found, 0 where the law does not depend on the speed.
    gain, shift
        What turns F - 1 into (F/mu - 1)/s.
    high, low
        Range of u at the nodes.
    centre, half
        Range of u in which a polynomial stands for the law: its centre, 1 over its half-width.
    scaled, force
        Numbers at one node.
    change, passes
        Largest change of the remainder in the last pass, and how many passes there were.
    total
        Sum over the nodes of what the closure or the mean speed needs.
    tops, bottoms
        Local extrema that may be the largest or the smallest u: `MANY` times their number, plus
        the sum of their nodes.
    """

    state: Floats
    decay: Floats
    of_mass: Floats
    of_tilt: Floats
    end: Floats
    slope: Floats
    beta: Floats
    start: Floats
    mu: Floats
    free: Floats
    gain: Floats
    shift: Floats
    high: Floats
    low: Floats
    centre: Floats
    half: Floats
    scaled: Floats
    force: Floats
    change: Floats
    passes: Floats
    total: Floats
    tops: Floats
    bottoms: Floats


class Curves(NamedTuple):
    """Curves of a block over the coarse nodes, shape (node, lane).

    `work` is X at the nodes and `drive` what it adds to the work of the load in the interval behind
    each; `missed` is what six nodes miss of its mean there. `inertia` is tau, `steep` F'/(s tau),
    `load` y, `rest` the remainder r of the law and `u` q - 1. Those from `steep` on have HALO nodes
    more on both sides.
    """

    drive: Floats
    missed: Floats
    inertia: Floats
    steep: Floats
    work: Floats
    load: Floats
    rest: Floats
    u: Floats


class Peaks(NamedTuple):
    """Largest u, and largest -u, of every lane.

    Attributes
    ----------
    windows : ndarray, shape (2, WINDOW, lanes)
        Values at coarse nodes around them.
    place : ndarray, shape (2, lanes)
        Where they are guessed to be, in coarse intervals from the highest node.
    ends : ndarray, shape (2, 5, lanes)
        Of the fine interval that holds them: values and slopes at both ends, and what the cubic
        through these misses in the middle.
    value, missed : ndarray, shape (2, lanes)
        Values, and how much they may miss.
    """

    windows: Floats
    place: Floats
    ends: Floats
    value: Floats
    missed: Floats


class Scratch(NamedTuple):
    """Memory of a block: curves, numbers of lanes, the law's polynomial, the table of a design.

    `values` is for the fit of the law; `width` is that of a fine interval [rad].
    """

    curves: Curves
    lanes: Lanes
    law: Floats
    table: Table
    peaks: Peaks
    values: Floats
    width: float


def make_scratch(coarse: int, fine: int, width: float) -> Scratch:
    """Memory for blocks whose period has so many coarse and fine nodes, of this width [rad]."""
    plain = [np.zeros((coarse, LANES)) for _ in range(3)]
    with_halo = [np.zeros((coarse + 2 * HALO, LANES)) for _ in range(5)]
    stride = fine // coarse
    table = Table(
        np.zeros((4, coarse)), np.zeros((4, coarse)), np.zeros((2, 4, fine)),
        np.zeros(fine, dtype=np.bool_),
        weights_between(stride),
    )  # fmt: skip
    return Scratch(
        Curves(*plain, *with_halo), Lanes(*(np.zeros(LANES) for _ in Lanes._fields)),
        np.zeros((MOST_TERMS, LANES)), table,
        Peaks(
            np.zeros((2, WINDOW, LANES)), np.zeros((2, LANES)), np.zeros((2, 5, LANES)),
            np.zeros((2, LANES)), np.zeros((2, LANES)),
        ),
        np.zeros(MOST_TERMS), width,
    )  # fmt: skip
