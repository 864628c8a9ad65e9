"""A load over angle among the work of a design: it joins the work of the gas.

Both are torques over the crank angle; gas work comes from a table that designs share, times a
lever, and the load's is subtracted over that lever. Its spline has an exact integral, so work at
the nodes and in the middles is exact.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined
from engine_dyn.loads.piecewise_cubic import piece_at
from engine_dyn.speed.tables.work_tables import (
    GAS_TORQUE,
    GAS_WORK,
    GAS_WORK_MIDDLE,
    GAS_WORK_TILT,
    TORQUE,
)
from engine_dyn.types import Floats

__all__ = ["PLAIN_ROWS", "join_load", "keep_gas", "work_at"]


PLAIN_ROWS = 6
"""Rows of scratch: the gas alone (work, torque, middle, torque with its mean), the load, and the
tilt of the gas."""


@inlined
def work_at(theta: float, load: Floats) -> tuple[float, float]:
    """Work and torque of a load without its mean; `load` as `TorqueOverAngle.table`."""
    angle, torque, slope, work = load[0], load[1], load[2], load[3]
    last = angle.size - 1
    period = angle[last] - angle[0]
    turns = (theta - angle[0]) / period
    place = angle[0] + (turns - math.floor(turns)) * period
    low, step, t, y0, m0, c, d = piece_at(place, angle, torque, slope)
    value = y0 + t * (m0 + t * (c + t * d))
    done = step * t * (y0 + t * (m0 / 2.0 + t * (c / 3.0 + t * d / 4.0)))
    return work[low] + done, value


@inlined
def keep_gas(table: Floats, plain: Floats) -> None:
    """Keep the rows of a table that loads join."""
    for j in range(table.shape[1]):
        plain[0, j] = table[GAS_WORK, j]
        plain[1, j] = table[GAS_TORQUE, j]
        plain[2, j] = table[GAS_WORK_MIDDLE, j]
        plain[3, j] = table[TORQUE, j]
        plain[5, j] = table[GAS_WORK_TILT, j]


@inlined
def join_load(
    factor: float, ratio: float, phase: float, lever: float, width: float, load: Floats,
    plain: Floats, table: Floats,
) -> None:  # fmt: skip
    """Gas less load in the table: the load's angle is ratio times the crank's, plus phase.

    Work is the same at both shafts, the torque at the crank is `ratio` times the load's. `lever`
    is that of the gas: piston area times crank radius.
    """
    nodes = table.shape[1]
    weight = factor / lever
    mean = 0.0
    for j in range(nodes):
        work, torque = work_at(ratio * (j * width) + phase, load)
        plain[4, j] = work
        mean += work
        table[GAS_TORQUE, j] = plain[1, j] - weight * ratio * torque
        table[TORQUE, j] = plain[3, j] - weight * ratio * torque
    mean /= nodes
    for j in range(nodes):
        after = j + 1 if j + 1 < nodes else 0
        middle, turning = work_at(ratio * ((j + 0.5) * width) + phase, load)
        slope = (plain[1, j] - table[GAS_TORQUE, j]) - (plain[1, after] - table[GAS_TORQUE, after])
        cubic = weight * 0.5 * (plain[4, j] + plain[4, after]) + 0.125 * width * slope
        table[GAS_WORK_MIDDLE, j] = plain[2, j] - (weight * middle - cubic)
        ends = (plain[1, j] - table[GAS_TORQUE, j]) + (plain[1, after] - table[GAS_TORQUE, after])
        steep = weight * 1.5 * (plain[4, after] - plain[4, j]) - 0.25 * width * ends
        table[GAS_WORK_TILT, j] = plain[5, j] - (weight * ratio * width * turning - steep)
        table[GAS_WORK, j] = plain[0, j] - weight * (plain[4, j] - mean)
