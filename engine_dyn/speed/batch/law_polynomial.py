"""A polynomial that stands for the law of a design in the range of its speeds.

The law is asked at Chebyshev points only, whatever law it is; the passes of a block then evaluate
polynomials, which are vectors over its designs. docs/solver.md (76).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import Form, is_proportional, law_of, load_terms, slope_of
from engine_dyn.speed.batch.block import LEFT, MOST_TERMS, SOLVING, Lanes
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.methods import CYCLE_TIME
from engine_dyn.speed.vectors import LANES, Rows, read, where, write
from engine_dyn.speed.work.boxes import chebyshev_matrix
from engine_dyn.types import Floats

__all__ = ["fit_laws"]

SIZES = (4, 6, 8, 10, 12, 14, 16, 20, MOST_TERMS)
"""Numbers of terms that are tried, the first at once where a law is proportional to q."""

REACHES = tuple(1.0 / math.cosh(math.log(1e8) / (size - 3)) for size in SIZES)
"""Largest half-width of the range, over its centre, with which each number is tried: terms of a
power of the speed fall by 1/(z + sqrt(z^2 - 1)), where z is 1 over that half-width."""

MARGIN = 0.3
"""Part of the range of u by which the range of the polynomial is wider on both sides."""

NARROWEST = 0.01
"""Least half-width of that range."""

SLOWEST = 0.04
"""Least q of that range: slower designs are left to the general solver."""

WITHIN = 1e-10
"""Largest of the last coefficients, over the range of the law."""


def _tables() -> tuple[Floats, Floats]:
    """Points, and matrices from values there to coefficients of powers."""
    points = np.zeros((len(SIZES), MOST_TERMS))
    powers = np.zeros((len(SIZES), MOST_TERMS, MOST_TERMS))
    for i, size in enumerate(SIZES):
        angle = (np.arange(size) + 0.5) * np.pi / size
        points[i, :size] = np.cos(angle)
        matrix = chebyshev_matrix(angle)
        for column in range(size):
            found = np.polynomial.chebyshev.cheb2poly(matrix[:, column])
            powers[i, : len(found), column] = found
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
    centre, half = 0.5 * (low + high), np.maximum((0.5 + MARGIN) * (high - low), NARROWEST)
    solving = (state > 0.0) & (1.0 + centre - half > SLOWEST)
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
                    elif closure == CYCLE_TIME:  # with the slope 1 at q = 1
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
    # T_n begins with 2^(n - 1) x^n: so much smaller are the last two Chebyshev coefficients.
    missed = np.abs(total) + 2.0 * np.abs(last)
    return missed * 0.5 ** (size - 2) <= WITHIN * (most - least)
