"""Extremes of the torque at nominal speed for arrays of designs."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.loads.driven_machine import NOTHING_DRIVEN, DrivenMachine, whole_ratio
from engine_dyn.pressure.family import Family
from engine_dyn.speed.batch.front import FEWEST_IN_LANES, REFINEMENTS
from engine_dyn.speed.batch.two_grid import CHUNK
from engine_dyn.speed.broadcasting import along_axes, cylinders_of, shape_of, without_unknown
from engine_dyn.speed.fields import DEFAULTS, OF_SPEED_ALONE
from engine_dyn.speed.general.segments import SEGMENTS
from engine_dyn.speed.packing import Packed, aligned, split
from engine_dyn.speed.pieces import Progress, run_pieces
from engine_dyn.speed.product import Product
from engine_dyn.speed.results import TORQUE_NAMES
from engine_dyn.speed.tables.load_over_angle import PLAIN_ROWS
from engine_dyn.speed.tables.node_counts import (
    fewest_nodes,
    fewest_nodes_of_load,
    repeats_of_load,
    row_map,
    rows_needed,
)
from engine_dyn.speed.tables.pressure_grid import Grid, make_grid
from engine_dyn.speed.tables.torque_extremes import extremes_of_torque
from engine_dyn.speed.tables.work_tables import TABLE_ROWS, steps_per_cycle
from engine_dyn.types import Floats, Integers

__all__ = ["torque_extremes"]

PIECES = math.lcm(SEGMENTS, max(REFINEMENTS) * CHUNK)
"""The number of nodes of a cycle is a multiple of this."""


@without_unknown
def torque_extremes(
    *,
    family: Family,
    wanted: Sequence[str],
    cylinders: Any = 1,
    cylinders_by_count: Mapping[int, Cylinders] | None = None,
    tolerance: float = 1e-6,
    threads: int | None = None,
    progress: Progress | None = None,
    driven: DrivenMachine = NOTHING_DRIVEN,
    **inputs: Any,
) -> dict[str, Any]:
    """Largest and smallest torque at nominal speed [N m] and energy swing [J] of every design.

    Arguments are those of `engine_dyn.speed.dispatch.solve`, without those that only the periodic
    speed needs; `wanted` are some of `TORQUE_NAMES`. The energy swing is the range of the work of
    the torque, less a load over angle of `driven`, less the mean.
    """
    inputs = {**DEFAULTS, **dict.fromkeys(OF_SPEED_ALONE, 0.0), **inputs}
    counts = np.asarray(cylinders, dtype=np.int64)
    shape = shape_of(*inputs.values(), counts)
    row = aligned(np.asarray(inputs["row"], dtype=float), len(shape))
    sets = aligned(counts, len(shape))
    period = family.period
    gear = np.zeros((1,) * len(shape))
    if driven.over_angle is not None:
        inputs["gear_ratio"] = whole_ratio(driven.over_angle, inputs["gear_ratio"], period)
        gear = aligned(inputs["gear_ratio"], len(shape))
    keys = [
        fewest_nodes(family, row, tolerance),
        repeats_of_load(driven.over_angle, gear, period),
        fewest_nodes_of_load(driven.over_angle, gear, period, tolerance),
        *along_axes(sets),
    ]
    names = [name for name in TORQUE_NAMES if name in wanted]
    scalars = np.empty((max(len(names), 1), int(np.prod(shape, dtype=np.int64))))
    places = np.array([names.index(n) if n in names else -1 for n in TORQUE_NAMES])
    packed = Packed.of(inputs, shape)
    for part in split(shape, keys):
        fewest, repeats, of_load = map(int, part.keys[:3])
        engine = cylinders_of(int(part.take(sets).flat[0]), period, cylinders_by_count)
        times = math.gcd(engine.symmetry, repeats)
        steps = steps_per_cycle(times, max(fewest, of_load), PIECES)
        rows = rows_needed(part.take(row))
        row_of = row_map(family, rows)
        grid = make_grid(family, rows, steps, engine.representatives_of(times))
        product = packed.product(part)

        job = partial(
            _extremes,
            product=product, row_of=row_of, width=period / steps, grid=grid, nodes=steps // times,
            wanted=places, scalars=scalars, over_angle=driven.angle_table,
        )  # fmt: skip
        cores = threads or os.cpu_count() or 1
        run_pieces(part.size, job, cores, progress, fewest=FEWEST_IN_LANES)
    return {name: scalars[i].reshape(shape) for i, name in enumerate(names)}


def _extremes(
    begin: int, end: int, *, product: Product, row_of: Integers, width: float,
    grid: Grid, nodes: int, wanted: Integers, scalars: Floats, over_angle: Floats,
) -> None:  # fmt: skip
    extremes_of_torque(
        begin, end, product, row_of, width, grid, wanted, scalars, over_angle,
        np.empty((TABLE_ROWS, nodes)), np.empty((4, nodes)), np.empty(grid.quadrature_sine.size),
        np.empty((PLAIN_ROWS, nodes)),
    )  # fmt: skip
