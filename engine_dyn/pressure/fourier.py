r"""Fourier coefficients of periodic cubic splines, such as indicator diagrams: exact integrals.

    c_nu = 2/Phi int p(phi) exp(-i nu phi) dphi

over one cycle, for any order nu. Between two knots the spline is Hermite's cubic, so that the
integral is linear in the pressures and slopes at the knots; their weights hang on the angles of the
knots and the order alone. With z = nu h and step h, the weights of the left knot are h A(z) and
h^2 B(z) times exp(-i nu phi),

    A(z) = int_0^1 (1 - 3 t^2 + 2 t^3) exp(-i z t) dt,
    B(z) = int_0^1 (t - 2 t^2 + t^3) exp(-i z t) dt,

and those of the right knot, by symmetry, h conj(A) and -h^2 conj(B) times exp(-i nu (phi + h)).
"""

from __future__ import annotations

import math

import numpy as np

from engine_dyn.compilation import kernel
from engine_dyn.pressure.curves import on_threads
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.motored import row_with_factor
from engine_dyn.types import Complexes, Floats, Integers

__all__ = ["coefficients_of_rows"]

ORDERS_AT_ONCE = 64
"""Orders whose weights exist at the same time."""

SERIES_UP_TO, TERMS = 2.0, 28
"""Up to this z the integrals A and B are power series of so many terms, which leave 1e-17; above,
closed forms, whose differences of near numbers then cost one digit at most."""

ROWS_OF_TILE = 16
"""Diagrams that the second-level cache holds beside the weights of an order."""


def coefficients_of_rows(
    family: Family, rows: Integers, orders: Floats, factor: float = 1.0, threads: int = 1
) -> tuple[Floats, Floats]:
    """Real and imaginary part of c_nu [Pa] of rows of a family, shape (rows, orders).

    Parameters
    ----------
    family : Family
        Diagrams.
    rows : ndarray of int64, shape (R,)
        Rows of its table, each once.
    orders : ndarray, shape (F,)
        Orders nu, 0 or more.
    factor : float
        Of a cylinder on its pressure: see `motored`.
    threads : int
        Largest number of threads.
    """
    angle, pressure, slope = _knots(family, rows, factor)
    real, imaginary = np.empty((2, rows.size, orders.size))
    for begin in range(0, orders.size, ORDERS_AT_ONCE):
        here = slice(begin, begin + ORDERS_AT_ONCE)
        weights = weights_of_knots(angle, family.period, orders[here])

        def work(first: int, last: int, begin: int = begin, weights: Floats = weights) -> None:
            _add_up(first, last, begin, pressure, slope, weights, real, imaginary)

        on_threads(rows.size, work, threads)
    return real, imaginary


def _knots(family: Family, rows: Integers, factor: float) -> tuple[Floats, Floats, Floats]:
    """Angles of the knots, and pressure and slope of rows there."""
    if isinstance(family, CycleTable):
        pressure, slope = family.at_knots(rows, factor)
        return family.angle, pressure, slope
    diagrams = [row_with_factor(family, row, factor) for row in rows.tolist()]
    return (
        diagrams[0].angle, np.stack([d.pressure for d in diagrams]),
        np.stack([d.slope for d in diagrams]),
    )  # fmt: skip


def weights_of_knots(angle: Floats, period: float, orders: Floats) -> Floats:
    """Weights of pressures and slopes at knots, shape (orders, 4, knots).

    The rows are the real weights of pressure and slope, and the imaginary ones.
    """
    step = np.diff(angle, append=angle[0] + period)
    turn = orders[:, None] * step
    even, odd = _integrals(turn)
    # The angle behind the last knot is a period on, of which an order need not be a part.
    left = step * np.exp(-1j * orders[:, None] * angle) * (2.0 / period)
    right = left * np.exp(-1j * turn)
    of_pressure = left * even + np.roll(right * np.conj(even), 1, axis=1)
    of_slope = left * step * odd - np.roll(right * step * np.conj(odd), 1, axis=1)
    return np.stack([of_pressure.real, of_slope.real, of_pressure.imag, of_slope.imag], axis=1)


def _integrals(z: Floats) -> tuple[Complexes, Complexes]:
    """A(z) and B(z) of the module."""
    low = np.where(z <= SERIES_UP_TO, z, 0.0)
    even, odd = np.zeros(z.shape, dtype=np.complex128), np.zeros(z.shape, dtype=np.complex128)
    for n in reversed(range(TERMS)):
        # moments of t^n, over n!, in powers of -i z
        a = 1.0 / (n + 1) - 3.0 / (n + 3) + 2.0 / (n + 4)
        b = 1.0 / (n + 2) - 2.0 / (n + 3) + 1.0 / (n + 4)
        even = even * (-1j * low) + a / math.factorial(n)
        odd = odd * (-1j * low) + b / math.factorial(n)
    if (z <= SERIES_UP_TO).all():
        return even, odd
    high = np.where(z > SERIES_UP_TO, z, 1.0) * 1j
    end = np.exp(-high)
    moments = [(1.0 - end) / high]
    for n in (1, 2, 3):
        moments.append((n * moments[-1] - end) / high)
    zeroth, first, second, third = moments
    return (
        np.where(z > SERIES_UP_TO, zeroth - 3.0 * second + 2.0 * third, even),
        np.where(z > SERIES_UP_TO, first - 2.0 * second + third, odd),
    )


@kernel
def _add_up(
    first: int, last: int, begin: int, pressure: Floats, slope: Floats, weights: Floats,
    real: Floats, imaginary: Floats,
) -> None:  # fmt: skip
    """Coefficients of some rows, for the orders from `begin` on that have weights."""
    knots = pressure.shape[1]
    for tile in range(first, last, ROWS_OF_TILE):
        for order in range(weights.shape[0]):
            of_order = weights[order]
            for row in range(tile, min(tile + ROWS_OF_TILE, last)):
                p, s = pressure[row], slope[row]
                one, other = 0.0, 0.0
                for i in range(knots):
                    one += p[i] * of_order[0, i] + s[i] * of_order[1, i]
                    other += p[i] * of_order[2, i] + s[i] * of_order[3, i]
                real[row, begin + order], imaginary[row, begin + order] = one, other
