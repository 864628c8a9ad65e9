"""The periodic speed of a block of designs at its coarse nodes: docs/solver.md chapter 10.

With q = (omega/omega_n)^2 = 1 + u, X = g P - eta V, tau = 1, or 1 + eta V where the inertia varies,
and beta = kappa s,

    u tau = X - y,      y' + beta y = beta (X + r),      r = (F/mu - 1)/s - u tau,

where y, the work of the load, is periodic, and s is the slope of F. One pass solves this for the
remainder r of the pass before.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.polynomial.chebyshev import cheb2poly

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import Form, is_proportional, law_of, load_terms, slope_of
from engine_dyn.speed.batch.block import (
    HALO,
    LEFT,
    MOST_TERMS,
    SETTLED,
    SOLVING,
    Curves,
    Lanes,
    Scratch,
    repeat_ends,
)
from engine_dyn.speed.batch.work_table import Weights
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.fields import CYCLE_TIME
from engine_dyn.speed.vectors import LANES, Rows, any_of, read, where, write
from engine_dyn.speed.work.boxes import chebyshev_matrix
from engine_dyn.types import Floats

SIZES = (4, 6, 8, 10, 12, 14, 16, 20, MOST_TERMS)
"""Numbers of polynomial terms to try, the first at once where a law is proportional to q."""

REACHES = tuple(1.0 / math.cosh(math.log(1e8) / (size - 3)) for size in SIZES)
"""Largest relative half-width of the range for each number of terms: terms of a power of the
speed decrease by 1/(z + sqrt(z^2 - 1)), where z is 1 over that half-width."""


def _tables() -> tuple[Floats, Floats]:
    """Points, and matrices from values at the points to coefficients of powers."""
    points = np.zeros((len(SIZES), MOST_TERMS))
    powers = np.zeros((len(SIZES), MOST_TERMS, MOST_TERMS))
    polynomials = np.zeros((MOST_TERMS, MOST_TERMS))  # Coefficients of T_0, T_1, ..., each a row
    for degree in range(MOST_TERMS):
        polynomials[degree, : degree + 1] = cheb2poly([0.0] * degree + [1.0])
    for i, size in enumerate(SIZES):
        angle = (np.arange(size) + 0.5) * np.pi / size
        points[i, :size] = np.cos(angle)
        powers[i, :size, :size] = polynomials[:size, :size].T @ chebyshev_matrix(angle)
    return points, powers


_POINTS, _POWERS = _tables()


@inlined
def fit_laws(
    block: int, closure: int, form: Form, designs: Designs, lanes: Lanes, law: Rows, values: Rows
) -> int:
    """Polynomials for F - 1 over the range of u of each lane that is solved, and somewhat beyond.

    `law` (power, lane) gets their coefficients over (u - centre) half. Where a law does not depend
    on the speed, `free` is 0, it is that of the closure, docs/method.md (65) and (66). Lanes for
    which no polynomial is good enough are left. Returns how many terms the longest has. `values` is
    scratch.
    """
    low, high, state = read(lanes.low, 0), read(lanes.high, 0), read(lanes.state, 0)
    # The polynomial's range is wider than that of u = (omega/omega_n)^2 - 1 by 0.3 of it on both
    # sides, and has a half-width of at least 0.01.
    centre, half = 0.5 * (low + high), np.maximum((0.5 + 0.3) * (high - low), 0.01)
    # Designs whose q = (omega/omega_n)^2 falls below 0.04 are left to the general solver.
    solving = (state > 0.0) & (1.0 + centre - half > 0.04)
    write(lanes.centre, 0, centre)
    write(lanes.half, 0, 1.0 / half)
    write(lanes.terms, 0, 0.0)
    write(lanes.state, 0, where(state > 0.0, where(solving, SOLVING, LEFT), state))
    for n in range(MOST_TERMS):
        write(law, n, 0.0)
    for i in range(len(SIZES)):
        size, some = SIZES[i], False
        for k in range(LANES):
            middle = 1.0 + lanes.centre[0, k]
            enough = size == MOST_TERMS or REACHES[i] * middle * lanes.half[0, k] >= 1.0
            enough = enough or is_proportional(designs.first[block, k], form)
            if lanes.state[0, k] == SOLVING and lanes.terms[0, k] == 0.0 and enough:
                some, lanes.terms[0, k] = True, size
                one, _ = law_of(
                    designs.speed[block, k], designs.first[block, k], designs.second[block, k],
                    designs.gear[block, k], form,
                )  # fmt: skip
                if lanes.free[0, k] == 0.0 and not slope_of(one)[1]:
                    lanes.state[0, k] = LEFT
                for m in range(size):
                    q = middle + _POINTS[i, m] / lanes.half[0, k]
                    if lanes.free[0, k] > 0.0:
                        values[m, k] = load_terms(q, one)[0] - 1.0
                    elif closure == CYCLE_TIME:  # its slope over q is 1 at q = 1
                        values[m, k] = 2.0 - 2.0 / math.sqrt(q)
                    else:
                        values[m, k] = math.log(q)
        if some:
            tried = read(lanes.terms, 0) >= size
            good = fit_values(i, tried, law, values)
            write(lanes.terms, 0, where(tried, where(good, size, 0.0), read(lanes.terms, 0)))
    longest = 0
    for k in range(LANES):
        longest = max(longest, int(lanes.terms[0, k]))
        if lanes.state[0, k] == SOLVING and lanes.terms[0, k] == 0.0:
            lanes.state[0, k] = LEFT
    return longest


@inlined
def fit_values(number: int, tried: Any, law: Rows, values: Rows) -> Any:
    """Coefficients of powers from values at so many points; returns where they are good enough."""
    size, first = SIZES[number], read(values, 0)
    least, most, last, total = first, first, 0.0 * first, 0.0 * first
    for n in range(size):
        here = read(values, n)
        least, most = np.minimum(here, least), np.maximum(here, most)
        last, total = total, 0.0 * first
        for m in range(size):
            total = total + _POWERS[number, n, m] * read(values, m)
        write(law, n, where(tried, total, read(law, n)))
    # The Chebyshev polynomial T_n begins with 2^(n - 1) x^n: the last two coefficients of such
    # polynomials are smaller by this factor than those of powers.
    missed = np.abs(total) + 2.0 * np.abs(last)
    # The last coefficients may reach 1e-10 of the range of the law.
    return missed * 0.5 ** (size - 2) <= 1e-10 * (most - least)


MOST_PASSES = 40  # Largest number of passes; designs that need more are left to the general solver

ROUNDING = 2e-15
"""Change of the remainder r between two iterations that is only rounding; r is defined above."""


@inlined
def run_load(decay: Any, of_mass: Any, of_tilt: Any, drive: Rows, curves: Curves) -> Any:
    """Solve y' + beta y = beta (X + r) from y = 0 on, docs/solver.md (70) and (72).

    `drive` is X + r. Returns y behind the period.
    """
    missed, load = curves.missed, curves.load
    a, b = read(drive, HALO - 2), read(drive, HALO - 1)
    c, d, e = read(drive, HALO), read(drive, HALO + 1), read(drive, HALO + 2)
    y = 0.0 * decay
    write(load, HALO, y)
    for i in range(len(missed)):
        f = read(drive, HALO + i + 3)
        # Mean over the interval by six nodes (`MEAN_BY_PAIRS`), and first moment by four.
        sums = 802.0 * (c + d) - 93.0 * (b + e) + 11.0 * (a + f)
        inner = d - c
        moment = inner * (63.0 / 720.0) - (e - b) * (1.0 / 720.0)
        y = decay * y + of_mass * (sums * (1.0 / 1440.0) + read(missed, i)) + of_tilt * moment
        write(load, HALO + i + 1, y)
        a, b, c, d, e = b, c, d, e, f
    return y


@inlined
def close_period(variable: bool, start: Any, decay: Any, curves: Curves) -> tuple[Any, Any]:
    """Add the start that makes y periodic, docs/solver.md (74), and find u; return its range."""
    high, low = 0.0 * start - 1e300, 0.0 * start + 1e300
    for i in range(len(curves.missed)):
        y = read(curves.load, HALO + i) + start
        start = start * decay
        u = read(curves.work, HALO + i) - y
        if variable:
            u = u * read(curves.light, i)
        write(curves.load, HALO + i, y)
        write(curves.u, HALO + i, u)
        high, low = np.maximum(u, high), np.minimum(u, low)
    return high, low


@inlined
def law_at(t: Any, terms: int, law: Rows) -> tuple[Any, Any]:
    """Polynomial of the law, and its slope."""
    value = read(law, terms - 1)
    slope = 0.0 * value
    for n in range(terms - 2, -1, -1):
        slope = slope * t + value
        value = value * t + read(law, n)
    return value, slope


@inlined
def fill_drive(
    terms: int, law: Rows, going: Any, mu: Any, lanes: Lanes, drive: Rows, curves: Curves
) -> Any:
    """X + r = (F/mu - 1)/s + y at the nodes of lanes that go on, docs/solver.md (68).

    `drive` is that of the pass before. Returns by how much it changes.
    """
    centre, half = read(lanes.centre, 0), read(lanes.half, 0)
    gain = 1.0 / (mu * read(lanes.slope, 0))
    shift, change = (1.0 - mu) * gain, 0.0 * mu
    for i in range(len(curves.missed)):
        force, _ = law_at((read(curves.u, HALO + i) - centre) * half, terms, law)
        old = read(drive, HALO + i)
        new = where(going, force * gain + shift + read(curves.load, HALO + i), old)
        change = np.maximum(np.abs(new - old), change)
        write(curves.drive, HALO + i, new)
    repeat_ends(curves.drive)
    return change


@inlined
def add_missed(
    variable: bool, terms: int, law: Rows, going: Any, lanes: Lanes, curves: Curves
) -> None:
    """Turn what six nodes miss of the mean of X into what they miss of that of X + r.

    Over an interval r changes with X by F'/(s tau) - 1, which is smooth: docs/solver.md (73).
    """
    centre, half, slope = read(lanes.centre, 0), read(lanes.half, 0), read(lanes.slope, 0)
    nodes = len(curves.missed)
    before = 0.0 * slope
    for i in range(nodes):
        _, steep = law_at((read(curves.u, HALO + i) - centre) * half, terms, law)
        steep = steep * half / slope
        if variable:
            steep = steep * read(curves.light, i)
        steep = where(going, steep, 1.0)
        write(curves.steep, i, steep)
        if i > 0:
            write(curves.missed, i - 1, 0.5 * (before + steep) * read(curves.missed, i - 1))
        before = steep
    mean = 0.5 * (before + read(curves.steep, 0))
    write(curves.missed, nodes - 1, mean * read(curves.missed, nodes - 1))


@inlined
def begin_rest(
    block: int, linear: bool, closure: int, form: Form, designs: Designs, scratch: Scratch
) -> int:
    """Polynomials of the laws of a block; returns how many terms the longest has.

    Where the equation is linear if the law is proportional to q, such designs are done. A law that
    does not depend on the speed is that of the closure, docs/method.md (65) and (66).
    """
    lanes = scratch.lanes
    for k in range(LANES):
        proportional = is_proportional(designs.first[block, k], form)
        if lanes.state[0, k] == SOLVING and linear and proportional:
            lanes.state[0, k] = SETTLED
        lanes.free[0, k] = 1.0
        if lanes.slope[0, k] == 0.0:
            lanes.free[0, k], lanes.slope[0, k] = 0.0, 1.0
    return fit_laws(block, closure, form, designs, lanes, scratch.law, scratch.values)


@inlined
def lateness(curves: Curves) -> Any:
    """Mean of omega_n/omega - 1 at the nodes, docs/solver.md (77).

    The mean of X is 0; what it is over the coarse nodes is taken away again.
    """
    total = 0.0 * read(curves.u, HALO)
    nodes = len(curves.missed)
    for i in range(nodes):
        slow = 1.0 / np.sqrt(1.0 + read(curves.u, HALO + i))
        total = total + (slow - 1.0 + 0.5 * read(curves.work, HALO + i))
    return total / nodes


@inlined
def settle_lanes(tolerance: float, going: Any, last: Any, change: Any, lanes: Lanes) -> bool:
    """End the lanes that hardly change any more, or left their range; whether any go on.

    Changes shrink by a factor from pass to pass, so the last two tell what all further ones add up
    to. After the first pass, and where they do not shrink, that is taken for as much as the change.
    """
    high, low = read(lanes.high, 0), read(lanes.low, 0)
    centre, state = read(lanes.centre, 0), read(lanes.state, 0)
    span, reach = high - low, np.maximum(high - centre, centre - low)
    fits = (reach * read(lanes.half, 0) <= 1.0) & (span < 1e300) & (span >= 0.0)
    # The ratio of a change to the one before is taken as at least 0.1: one change may be small by
    # chance.
    shrinks = np.maximum(change / np.maximum(last, ROUNDING), 0.1)
    shrinks = where(change < last, shrinks, 0.5)
    ahead = change * shrinks / (1.0 - shrinks)
    done = where(change <= ROUNDING, SETTLED, where(ahead <= tolerance * span, SETTLED, SOLVING))
    state = where(going, where(fits, done, LEFT), state)
    write(lanes.state, 0, state)
    write(lanes.passes, 0, read(lanes.passes, 0) + where(going, 1.0, 0.0 * span))
    return any_of(state > 0.0)


@inlined
def solve_curves(
    block: int, variable: bool, closure: int, tolerance: float, form: Form, weights: Weights,
    designs: Designs, scratch: Scratch,
) -> None:  # fmt: skip
    """Solve a block, whose X is in `scratch`.

    Lanes end in the states `SETTLED` or `LEFT`. `tolerance` is the error that the passes may leave,
    over the range of u.
    """
    lanes, curves, law = scratch.lanes, scratch.curves, scratch.law
    decay, end = read(weights.decay, block), read(weights.end, block)
    of_mass, of_tilt = read(weights.of_mass, block), read(weights.of_tilt, block)
    write(lanes.slope, 0, read(weights.slope, block))
    write(lanes.passes, 0, 1.0)
    drive = curves.work  # X + r, where r is 0 at first
    # The number of terms is known after the first pass; had it 0 as its first value, the compiler
    # would make each function that takes it twice.
    timed, terms, mu = closure == CYCLE_TIME, len(law), 0.0 * decay + 1.0
    going, change, last = decay > 0.0, 0.0 * decay, 0.0 * decay
    # Each function is called at one place only, because the compiler copies it to each.
    for number in range(MOST_PASSES + 1):
        if number > 0:
            late = 0.0 * mu
            if timed:
                late = 2.0 * read(lanes.free, 0) * read(lanes.slope, 0) * lateness(curves)
                late = where(going, late, 0.0)
                mu = mu + late
            change = fill_drive(terms, law, going, mu, lanes, drive, curves)
            drive = curves.drive
            change = np.maximum(np.abs(late), change)
        behind = run_load(decay, of_mass, of_tilt, drive, curves)
        high, low = close_period(variable, behind / end, decay, curves)
        write(lanes.high, 0, high)
        write(lanes.low, 0, low)
        if number == 0:
            linear = not (variable or timed)
            terms = begin_rest(block, linear, closure, form, designs, scratch)
            going = read(lanes.state, 0) > 0.0
            if terms == 0:
                for i in range(len(curves.steep)):
                    write(curves.steep, i, 1.0)
                for j in range(len(curves.drive)):
                    write(curves.drive, j, read(curves.work, j))
                break
            add_missed(variable, terms, law, going, lanes, curves)
        else:
            if not settle_lanes(tolerance, going, last, change, lanes):
                break
            going = read(lanes.state, 0) > 0.0
            if not timed:  # with a given cycle time, mu and r change in turns
                last = change
    write(lanes.mu, 0, mu)
    for k in range(LANES):
        if lanes.state[0, k] == SOLVING:
            lanes.state[0, k] = LEFT
