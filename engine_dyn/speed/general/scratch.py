"""Working memory of the general solver, one set for each thread."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from engine_dyn.speed.fields import INPUTS
from engine_dyn.speed.general.cycles import SAMPLE_ROWS
from engine_dyn.speed.general.segments import make_records
from engine_dyn.speed.tables.load_over_angle import PLAIN_ROWS
from engine_dyn.speed.tables.work_tables import TABLE_ROWS
from engine_dyn.types import Floats, Integers

__all__ = ["D", "DTAU", "DW", "Scratch", "TAU", "W", "make_scratch"]


class Scratch(NamedTuple):
    """Working memory of one thread.

    Attributes
    ----------
    table : ndarray, shape (TABLE_ROWS, nodes)
        Table of work of the present design.
    plain : ndarray, shape (PLAIN_ROWS, nodes)
        Rows of the table that a load over angle changes, as they are without the load.
    middles, rates : ndarray
        Memory for building a table.
    records, running : ndarray
        Solution at the nodes, by segments (see `segments`).
    curve : ndarray, shape (TABLE_ROWS, nodes)
        The rows W to D and those of Newton's method, or the table of a stiff load.
    sampled : ndarray, shape (SAMPLE_ROWS, samples)
        Curves of the thesis's method.
    at, shared : ndarray of int
        Places of the inputs of a design, and of those that all designs of a table share.
    """

    table: Floats
    plain: Floats
    middles: Floats
    rates: Floats
    records: Floats
    running: Floats
    curve: Floats
    sampled: Floats
    at: Integers
    shared: Integers


def make_scratch(nodes: int, steps: int, samples: int) -> Scratch:
    """Working memory for designs with `nodes` nodes a period and `steps` in the whole grid."""
    records, running = make_records(nodes)
    return Scratch(
        table=np.empty((TABLE_ROWS, nodes)),
        plain=np.empty((PLAIN_ROWS, nodes)),
        middles=np.empty((4, nodes)),
        rates=np.empty(6 * steps),
        records=records,
        running=running,
        curve=np.empty((TABLE_ROWS, nodes)),
        sampled=np.empty((SAMPLE_ROWS, samples)),
        at=np.zeros(INPUTS, dtype=np.int64),
        shared=np.zeros(INPUTS, dtype=np.int64),
    )


W, DW, TAU, DTAU, D = range(5)
"""Rows of `Scratch.curve`: w, w', tau, tau' and e - 1 (see `newton`); the other rows are scratch of
Newton's method."""
