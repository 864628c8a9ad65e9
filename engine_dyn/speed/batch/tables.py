"""From columns to the work of a block of designs."""

from __future__ import annotations

from engine_dyn.compilation import inlined
from engine_dyn.speed.batch.block import HALO, Curves, Table
from engine_dyn.speed.batch.weights import Weights
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.task import Task, is_plain
from engine_dyn.speed.work.columns import Columns
from engine_dyn.speed.work.parts import SQUARE
from engine_dyn.types import Floats

__all__ = ["fill_block"]

AT_ONCE = 8
"""Columns that are added in one loop; their number is a multiple of this."""


@inlined
def add_columns(columns: Floats, share: float, factor: Floats, curve: Floats) -> None:
    """Add a sum of columns (term, node) to a curve."""
    for t in range(0, factor.size, AT_ONCE):
        f0, f1, f2 = share * factor[t], share * factor[t + 1], share * factor[t + 2]
        f3, f4, f5 = share * factor[t + 3], share * factor[t + 4], share * factor[t + 5]
        f6, f7 = share * factor[t + 6], share * factor[t + 7]
        for i in range(curve.size):
            curve[i] += (
                f0 * columns[t, i] + f1 * columns[t + 1, i] + f2 * columns[t + 2, i]
                + f3 * columns[t + 3, i] + f4 * columns[t + 4, i] + f5 * columns[t + 5, i]
                + f6 * columns[t + 6, i] + f7 * columns[t + 7, i]
            )  # fmt: skip


@inlined
def add_moments(curve: Floats) -> None:
    """First moment of a curve in each interval, and what six nodes miss of its mean there.

    docs/method.md (72).
    """
    values, mean, moment, missed = curve[0], curve[1], curve[2], curve[3]
    nodes = values.size
    for i in range(nodes):
        before, behind = i - 1 if i > 0 else nodes - 1, i + 1 if i + 1 < nodes else 0
        after = behind + 1 if behind + 1 < nodes else 0
        inner, outer = values[behind] - values[i], values[after] - values[before]
        moment[i] = inner / 12.0 - (outer - 3.0 * inner) / 720.0
        first = before - 1 if before > 0 else nodes - 1
        last = after + 1 if after + 1 < nodes else 0
        sums = 802.0 * (values[i] + values[behind]) - 93.0 * (values[before] + values[after])
        missed[i] = mean[i] - (sums + 11.0 * (values[first] + values[last])) / 1440.0


@inlined
def fill_table(which: int, columns: Columns, designs: Designs, table: Table) -> None:
    """Work table of a design at the coarse nodes."""
    part, share, factor = designs.part, designs.share, designs.factor[which]
    for row in range(2):
        gas, square = table.gas[row], table.square[row]
        for i in range(gas.size):
            gas[i] = square[i] = 0.0
        for piece in range(part.shape[0]):
            if share[piece, which] != 0.0:
                add_columns(
                    columns.coarse[part[piece, which], row], share[piece, which], factor, gas
                )
        add_columns(columns.coarse[SQUARE, row], 1.0, factor, square)
    add_moments(table.gas)
    add_moments(table.square)


@inlined
def fill_lane(
    lane: int, which: int, task: Task, table: Table, weights: Weights, designs: Designs,
    curves: Curves,
) -> None:  # fmt: skip
    """X of one design, docs/method.md (55), and what it adds to the load's work, (70) and (71)."""
    gas, eta = designs.gas[which], designs.eta[which]
    of_mass, of_tilt = weights.of_mass[which], weights.of_tilt[which]
    p, v, mean_p, mean_v = table.gas[0], table.square[0], table.gas[1], table.square[1]
    tilt_p, tilt_v = table.gas[2], table.square[2]
    for i in range(p.size):
        curves.work[HALO + i, lane] = gas * p[i] - eta * v[i]
        mass, tilt = gas * mean_p[i] - eta * mean_v[i], gas * tilt_p[i] - eta * tilt_v[i]
        curves.drive[i, lane] = of_mass * mass + of_tilt * tilt
    if task.variable:
        for i in range(v.size):
            curves.inertia[i, lane] = 1.0 + eta * v[i]
    if not is_plain(task):
        missed_p, missed_v = table.gas[3], table.square[3]
        for i in range(p.size):
            curves.missed[i, lane] = gas * missed_p[i] - eta * missed_v[i]


@inlined
def fill_alike(
    first: int, task: Task, table: Table, weights: Weights, designs: Designs, curves: Curves
) -> None:
    """X of all designs of a block that have one table.

    The numbers are those of `fill_lane`; here loops over lanes are vectors: without this, one table
    takes twice as long.
    """
    end = first + curves.drive.shape[1]
    gas, eta = designs.gas[first:end], designs.eta[first:end]
    of_mass, of_tilt = weights.of_mass[first:end], weights.of_tilt[first:end]
    for i in range(curves.drive.shape[0]):
        work, p, v = curves.work[HALO + i], table.gas[0, i], table.square[0, i]
        for k in range(gas.size):
            work[k] = gas[k] * p - eta[k] * v
        drive, mean_p, mean_v = curves.drive[i], table.gas[1, i], table.square[1, i]
        tilt_p, tilt_v = table.gas[2, i], table.square[2, i]
        for k in range(gas.size):
            mass, tilt = gas[k] * mean_p - eta[k] * mean_v, gas[k] * tilt_p - eta[k] * tilt_v
            drive[k] = of_mass[k] * mass + of_tilt[k] * tilt
        if task.variable:
            inertia = curves.inertia[i]
            for k in range(gas.size):
                inertia[k] = 1.0 + eta[k] * v
        if not is_plain(task):
            missed, missed_p, missed_v = curves.missed[i], table.gas[3, i], table.square[3, i]
            for k in range(gas.size):
                missed[k] = gas[k] * missed_p - eta[k] * missed_v


@inlined
def fill_block(
    first: int, current: int, task: Task, columns: Columns, weights: Weights, designs: Designs,
    table: Table, curves: Curves,
) -> int:  # fmt: skip
    """X of the block of designs from `first` on.

    `table` has the work table of this number, -1 for none. Returns the number of that which it has
    afterwards.
    """
    lanes = curves.drive.shape[1]
    number = designs.table
    alike = number[first] == number[first + lanes - 1]
    for lane in range(1 if alike else lanes):
        which = first + lane
        if number[which] != current:
            fill_table(which, columns, designs, table)
        current = number[which]
        if not alike:
            fill_lane(lane, which, task, table, weights, designs, curves)
    if alike:
        fill_alike(first, task, table, weights, designs, curves)
    return current
