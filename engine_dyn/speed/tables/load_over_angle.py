"""The work of a load over angle is subtracted from the work of the gas.

The table of the gas is common to many designs, which multiply it by their lever, so the load is
divided by that lever first. The integral of the load's spline is known, so its work at the nodes
and in the middles is exact.
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
"""Rows of scratch: of the gas alone the work, the torque, the middle and the torque with its mean;
the work of the load; the tilt of the gas alone."""


@inlined
def work_at(theta: float, load: Floats) -> tuple[float, float]:
    """Work and torque of a load without its mean, docs/method.md (37).

    `load` is `TorqueOverAngle.table`.
    """
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
    """Copy the rows of a table that a load changes."""
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
    """Subtract the load from the gas in the table, docs/method.md (35), (36) and (43).

    The load's angle is `ratio` times the crank's, plus `phase`. Work is the same at both shafts;
    the torque at the crank is `ratio` times the load's. `lever` is that of the gas: piston area
    times crank radius. Middle and tilt are those of docs/method.md (52).
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
