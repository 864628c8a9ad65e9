"""Values of a block of designs before the solution: weights of the recurrence, and the work.

Weights are those along the coarse nodes; the work comes from the columns.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.loads.laws import LAWS, Form, law_of, load_terms, slope_and_sign
from engine_dyn.plain_arrays import plain
from engine_dyn.speed.batch.block import (
    HALO,
    LEFT,
    SOLVING,
    ColumnRows,
    Scratch,
    WorkTable,
    repeat_ends,
)
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.vectors import LANES, Rows, read, where, write
from engine_dyn.speed.work.columns import SQUARE
from engine_dyn.types import Floats


@inlined
def add_columns(part: int, coarse: Rows, table: WorkTable, curve: Rows, missed: Rows) -> None:
    """Add the columns of a part, times `table.share` and the factors."""
    shared, share = table.shared, read(table.share, 0)
    for t in range(len(shared)):
        write(shared, t, share * read(table.factor, t))
    for i in range(len(curve)):
        place = 2 * (part * len(curve) + i)
        value, rough = read(curve, i), read(missed, i)
        for t in range(len(shared)):
            factor = read(shared, t)
            value = value + factor * coarse[place, t]
            rough = rough + factor * coarse[place + 1, t]
        write(curve, i, value)
        write(missed, i, rough)


@inlined
def fill_work_table(block: int, columns: ColumnRows, designs: Designs, table: WorkTable) -> None:
    """Work tables of the designs of a block."""
    coarse, part, share, first = columns.coarse, designs.part, designs.share, block * LANES
    for t in range(len(table.factor)):
        for lane in range(LANES):
            table.factor[t, lane] = designs.factor[first + lane, t]
    for i in range(len(table.gas)):
        write(table.gas, i, 0.0)
        write(table.gas_missed, i, 0.0)
        write(table.square, i, 0.0)
        write(table.square_missed, i, 0.0)
    write(table.share, 0, 1.0)
    add_columns(SQUARE, coarse, table, table.square, table.square_missed)
    for piece in range(len(part)):
        # Designs with a common part are neighbours; all others get a factor of 0.
        begin = 0
        while begin < LANES:
            which, some, end = part[piece, first + begin], False, begin
            write(table.share, 0, 0.0)
            while end < LANES and part[piece, first + end] == which:
                table.share[0, end] = share[piece, first + end]
                some = some or share[piece, first + end] != 0.0
                end += 1
            if some:
                add_columns(which, coarse, table, table.gas, table.gas_missed)
            begin = end


@inlined
def fill_work(
    block: int, variable: bool, weights: Weights, designs: Designs, scratch: Scratch
) -> None:
    """X of a block, docs/method.md (55), what six nodes miss of it, and 1/tau.

    Designs whose variable inertia falls too low somewhere are left to the general solver.
    """
    table, curves, state = scratch.table, scratch.curves, read(weights.state, block)
    gas, eta = read(designs.gas, block), read(designs.eta, block)
    lightest = 1.0 + 0.0 * eta
    for i in range(len(table.gas)):
        v = eta * read(table.square, i)
        write(curves.work, HALO + i, gas * read(table.gas, i) - v)
        write(
            curves.missed, i, gas * read(table.gas_missed, i) - eta * read(table.square_missed, i)
        )
        if variable:
            lightest = np.minimum(1.0 + v, lightest)
            write(curves.light, i, 1.0 / (1.0 + v))
    repeat_ends(curves.work)
    if variable:
        # Where the least inertia is below 0.4 of its mean, the general solver takes the design.
        state = where(lightest > 0.4, state, LEFT)
    write(scratch.lanes.state, 0, state)


# Smallest beta [1/rad]; a design without a load has this one, as the limit of weak loads
TINY = 1e-11

LARGEST_STEP = 0.05
"""Largest beta times coarse interval: stronger loads are left to the general solver."""


class Weights(NamedTuple):
    """Numbers of each design, docs/solver.md (71) and (74), shape (designs,)."""

    slope: Floats  # Slope s of the law at the nominal speed
    beta: Floats  # Rate beta = kappa s [1/rad]
    # `SOLVING`, or `LEFT`: left to the general solver, for a load that rises steeply or a load that
    # drives
    state: Floats
    # Factor exp(-beta h) by which the remainder decays over an interval h between nodes, and the
    # weights of mean and first moment of the work in an interval.
    decay: Floats
    of_mass: Floats
    of_tilt: Floats
    end: Floats  # 1 - exp(-beta Phi_s), where Phi_s is the period


def weights_of(designs: Designs, form: Form, width: float, nodes: int) -> Weights:
    """Weights for coarse intervals of this width [rad], so many in a period."""
    if LAWS[form.kind].torque is None:
        slope, sign = np.empty(designs.kappa.size), np.empty(designs.kappa.size)
        _of_table(plain(designs), plain(form), slope, sign)
    else:
        slope, sign = slope_and_sign(designs.speed, designs.first, designs.second, form)
    with np.errstate(invalid="ignore"):
        weights = recurrence(designs.kappa, np.ascontiguousarray(slope), sign, width, nodes)
    return Weights._make(weights)


def recurrence(kappa: Any, slope: Any, sign: Any, width: float, nodes: int) -> tuple[Any, ...]:
    """Members of `Weights`, in its order, of arrays or of the numbers of one design.

    `sign` has that of the mean torque that the law needs. No load drives, no driver brakes, and
    both oppose deviations or do not depend on the speed.
    """
    step = kappa * slope * width
    solvable = (kappa * sign > 0.0) & (step >= 0.0) & (step <= LARGEST_STEP)
    x = where(solvable, np.maximum(step, TINY * width), TINY * width)
    square = x * x
    of_tilt = square * np.exp(-0.5 * x) * (1.0 + square * (0.025 + square / 4480.0))
    return (
        slope, x / width, where(solvable, SOLVING, LEFT), np.exp(-x), -np.expm1(-x), of_tilt,
        -np.expm1(-x * nodes),
    )  # fmt: skip


@inlined
def slope_of_design(
    speed: float, first: float, second: float, gear: float, form: Form
) -> tuple[float, float]:
    """F'(1) of a design, and a number with the sign of the mean torque that its law needs."""
    law, sign = law_of(speed, first, second, gear, form)
    return load_terms(1.0, law)[1], sign


@kernel
def _of_table(designs: Designs, form: Form, slope: Floats, sign: Floats) -> None:
    """Slope F'(1) of a table over speed, and the sign of the mean torque that it needs."""
    for i in range(slope.size):
        slope[i], sign[i] = slope_of_design(designs.speed[i], 0.0, 0.0, designs.gear[i], form)
