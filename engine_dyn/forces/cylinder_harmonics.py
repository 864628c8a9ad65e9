r"""Harmonics of one cylinder: of piston velocity, inertia torque and gas torque.

A periodic curve over the crank angle is its mean and its orders nu = 1/2, 1, 3/2, ... (four-stroke)
or 1, 2, ... (two-stroke), periods a turn of the crank:

    M(phi) = mean + sum_nu M_nu cos(nu phi + psi_nu) = mean + Re sum_nu C_nu exp(i nu phi),

amplitude M_nu = |C_nu| and phase psi_nu = arg C_nu. With phi = omega t this is the form that
programs for torsional vibration take (openTorsion: U exp(i omega t)). The complex numbers C_nu are
called harmonics here.

The velocity is a sum of few waves v_m exp(i m phi), see `velocity_waves`, so that

- of the velocity, C_nu = 2 v_nu;
- of the inertia torque -b v = -(v^2)'/2, C_nu = -i nu sum_m v_m v_(nu - m);
- of the gas torque p v, C_nu = sum_m v_m c_(nu - m) with the Fourier coefficients c of the pressure
  (`coefficients_of_rows`), which know neither crank ratio nor offset: those of a row serve all
  designs. The pressure is linear between two rows, and so are they.

Without offset the first two have closed forms, `kinematic_series`. Nothing depends on the
`angle_step` of a scene.

Source: Rakopoulos notes, harmonics of the tangential force.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.geometry import kinematic_series, slider_crank
from engine_dyn.geometry.firing_sequence import SEALED, PressureFactor
from engine_dyn.geometry.masses import AT_ONCE, by_highest_order, velocity_waves
from engine_dyn.pressure.curves import on_threads
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.motored import row_with_factor
from engine_dyn.types import Booleans, Complexes, Floats, Integers

ORDERS_AT_ONCE = 64  # Number of orders whose weights of knots are held at the same time

SERIES_UP_TO = 2.0
"""Largest z at which the integrals A and B are computed as power series, whose error is 1e-17;
above, closed forms lose one digit at most by subtracting nearly equal numbers."""

ROWS_OF_TILE = 16
"""Number of diagrams that the second-level cache holds together with the weights of an order."""


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
    """Angles of the knots of a family, with pressure and slope of some rows there."""
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
    # Values at the end of a step come from its length, not from the next knot: after the last
    # knot a period ends, where an order need not repeat.
    left = step * np.exp(-1j * orders[:, None] * angle) * (2.0 / period)
    right = left * np.exp(-1j * turn)
    of_pressure = left * even + np.roll(right * np.conj(even), 1, axis=1)
    of_slope = left * step * odd - np.roll(right * step * np.conj(odd), 1, axis=1)
    return np.stack([of_pressure.real, of_slope.real, of_pressure.imag, of_slope.imag], axis=1)


def _integrals(z: Floats) -> tuple[Complexes, Complexes]:
    """Integrals over t from 0 to 1 of exp(-i z t) with two weights.

    A(z) has the weight 1 - 3 t^2 + 2 t^3 of a knot's value, B(z) the weight t - 2 t^2 + t^3 of its
    slope, in the cubic between two knots.
    """
    low = np.where(z <= SERIES_UP_TO, z, 0.0)
    square = -(low**2)
    sums = np.zeros((4, *z.shape))  # real part and imaginary part over -z, of A and of B
    for n in reversed(range(28)):  # 28 terms of the power series in -i z
        # Integrals of t^n with the two weights.
        a = 1.0 / (n + 1) - 3.0 / (n + 3) + 2.0 / (n + 4)
        b = 1.0 / (n + 2) - 2.0 / (n + 3) + 1.0 / (n + 4)
        for one, integral in ((sums[n % 2], a), (sums[2 + n % 2], b)):
            one *= square
            one += integral / math.factorial(n)
    even, odd = sums[0] - 1j * low * sums[1], sums[2] - 1j * low * sums[3]
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
    """Coefficients of some rows, for the orders with weights that begin at `begin`."""
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


MOST = 1024  # Highest order of velocity and inertia torque of a slider-crank with an offset


def velocity_harmonics(orders: Any, crank_ratio: Any, offset: Any = 0.0) -> Any:
    """Harmonics of c/(r omega) [1]: -i gamma_nu without offset.

    Parameters
    ----------
    orders : array_like
        Orders above 0, along an axis on which the others have size 1; all broadcast.
    crank_ratio, offset : array_like
        lambda [1]; offset of the piston-pin line over the crank radius [1].

    Raises
    ------
    ValueError
        For an order that is not above 0, with an offset also above 1024; a crank ratio outside
        (0, 1).
    """
    return _of_smooth(
        _velocity_orders, kinematic_series.velocity_coefficients, orders, crank_ratio, offset
    )


def inertia_harmonics(orders: Any, crank_ratio: Any, offset: Any = 0.0) -> Any:
    """Harmonics of -b v, the inertia torque of one cylinder over m r^2 omega^2 [1].

    `orders` nu above 0, crank ratio lambda and offset over the crank radius broadcast, the orders
    along an axis of their own. Rakopoulos notes, Delta T_l.
    """
    return _of_smooth(
        _inertia_orders, kinematic_series.inertia_torque_coefficients, orders, crank_ratio, offset
    )


def _of_smooth(
    kernel_of: Any, coefficients: Any, orders: Any, crank_ratio: Any, offset: Any
) -> Any:
    """Harmonics of a curve that repeats every turn, by its series where there is no offset."""
    centred = np.asarray(offset) == 0.0
    series = -1j * coefficients(orders, crank_ratio) if centred.any() else None
    if centred.all():
        return series
    slider_crank.dead_centres(crank_ratio, offset)  # raises for cranks that cannot turn
    nu, shape, columns = _designs(
        kinematic_series.checked_orders(orders, MOST), crank_ratio, offset
    )
    result = np.empty((columns.shape[1], nu.size), dtype=np.complex128)
    whole = np.where(nu % 1.0 == 0.0, nu, 0.0).astype(np.int64)
    for highest, designs in by_highest_order(columns[0], columns[1]):
        for begin in range(0, designs.size, AT_ONCE):
            some = designs[begin : begin + AT_ONCE]
            waves = velocity_waves(columns[0, some], columns[1, some], highest)
            parts = np.empty((2, some.size, nu.size))
            kernel_of(*waves, whole, *parts)
            result[some] = parts[0] + 1j * parts[1]
    waved = _along_orders(result, orders, shape)
    return waved if series is None else np.where(centred, series, waved)


@kernel
def _velocity_orders(
    wave: Floats, quadrature: Floats, orders: Integers, real: Floats, imaginary: Floats
) -> None:
    """Harmonics 2 v_nu of each design's piston velocity; 0 marks an order without harmonics."""
    for design in range(wave.shape[0]):
        for i in range(orders.size):
            there = 0 < orders[i] < wave.shape[1]
            order = orders[i] if there else 0
            real[design, i] = 2.0 * wave[design, order] if there else 0.0
            imaginary[design, i] = 2.0 * quadrature[design, order] if there else 0.0


@kernel
def _inertia_orders(
    wave: Floats, quadrature: Floats, orders: Integers, real: Floats, imaginary: Floats
) -> None:
    """Harmonics -i nu sum_m v_m v_(nu - m) of the inertia torque; an order 0 has none."""
    highest = wave.shape[1] - 1
    for design in range(wave.shape[0]):
        w, q = wave[design], quadrature[design]
        for i in range(orders.size):
            nu = orders[i]
            one, other = 0.0, 0.0
            if nu > 0:
                for m in range(nu - highest, highest + 1):
                    a, b = _wave_at(w, q, m)
                    c, d = _wave_at(w, q, nu - m)
                    one += a * c - b * d
                    other += a * d + b * c
            real[design, i], imaginary[design, i] = nu * other, -nu * one


@inlined
def _wave_at(real: Floats, imaginary: Floats, order: int) -> tuple[float, float]:
    """Coefficient v_m of a velocity for any order m: v_-m is the conjugate of v_m."""
    return real[abs(order)], imaginary[abs(order)] if order >= 0 else -imaginary[abs(order)]


def gas_harmonics(
    orders: Any,
    crank_ratio: Any,
    offset: Any,
    row: Any,
    family: Family,
    period: float,
    pressure_factor: PressureFactor = 1.0,
    threads: int | None = 1,
) -> Complexes:
    """Harmonics of p c/(r omega) [Pa] of one cylinder, with the absolute pressure.

    Parameters
    ----------
    orders, crank_ratio, offset : array_like
        As in `velocity_harmonics`.
    row : array_like
        (Fractional) rows of the family's table, see `family.Family.locate`.
    family : Family
        Indicator diagrams.
    period : float
        Angle of the cycle [rad], that of the family.
    pressure_factor : float or tuple of float
        See `motored`; of each cycle where they differ. Orders are of all these cycles.
    threads : int, optional
        Largest number of threads; None: one for each processor.
    """
    if isinstance(pressure_factor, tuple):
        one = partial(gas_harmonics, orders, crank_ratio, offset, row, family, period,
                      threads=threads)  # fmt: skip
        return over_cycles(one, np.asarray(orders, dtype=float), pressure_factor, period)
    slider_crank.dead_centres(crank_ratio, offset)  # raises for cranks that cannot turn
    nu, shape, columns = _designs(orders, crank_ratio, offset, row)
    result = np.empty((columns.shape[1], nu.size), dtype=np.complex128)
    most = threads or os.cpu_count() or 1
    below = np.floor(columns[2]).astype(np.int64)
    for highest, designs in by_highest_order(columns[0], columns[1]):
        reached = _reached(nu, highest)
        order = designs[np.argsort(below[designs], kind="stable")]
        # Coefficients of 1024 diagrams are held at the same time.
        begins = np.flatnonzero(np.diff(below[order], prepend=-1))[::1024]
        for some in np.split(order, begins[1:]):
            _add_gas(some, columns, below, family, pressure_factor, highest, reached, most, result)
    return _along_orders(result, orders, shape)


def over_cycles(
    of: Callable[[float], Complexes], orders: Floats, factors: tuple[float, ...], period: float
) -> Complexes:
    """Harmonics over several cycles [Pa], from those over one cycle with each factor.

    Cycle n contributes exp(-i nu n Phi) times the integral over a cycle, of which the order need
    not be a multiple of its lowest; that integral is linear in the factor.
    """
    waves = [np.exp(-1j * orders * n * period) / len(factors) for n in range(len(factors))]
    burnt = sum(max(f, 0.0) * wave for f, wave in zip(factors, waves, strict=True))
    motored, sealed = (
        sum(wave for f, wave in zip(factors, waves, strict=True) if (f == SEALED) == shut)
        for shut in (False, True)
    )
    base = of(0.0)
    total = motored * base + burnt * (of(1.0) - base)
    return np.asarray(total + sealed * of(SEALED) if SEALED in factors else total)


def _reached(orders: Floats, highest: int) -> tuple[Floats, Integers, Booleans]:
    """Orders of the pressure that velocity waves combine with, and the index of each wave's.

    `place` is (nu, m) from m = -highest on; `turned` is True where nu - m is below 0, so that the
    coefficient is the conjugate.
    """
    wanted = orders[:, None] - np.arange(-highest, highest + 1)
    sizes, place = np.unique(np.abs(wanted), return_inverse=True)
    return sizes, place.reshape(wanted.shape), wanted < 0.0


def _add_gas(
    designs: Integers, columns: Floats, below: Integers, family: Family, factor: float,
    highest: int, reached: tuple[Floats, Integers, Booleans], threads: int, result: Complexes,
) -> None:  # fmt: skip
    """Fill in the gas harmonics of designs that share a few rows of the family."""
    sizes, place, turned = reached
    first, weight = below[designs], columns[2, designs] - below[designs]
    both = np.stack([first, first + (weight > 0.0)])
    rows = np.unique(both)
    of_rows = coefficients_of_rows(family, rows, sizes, factor, threads)
    both = np.searchsorted(rows, both)
    for begin in range(0, designs.size, AT_ONCE):
        here = slice(begin, begin + AT_ONCE)
        some, pair, share = designs[here], both[:, here], weight[here]
        parts = np.empty((2, some.size, place.shape[0]))

        def work(
            begin: int, end: int, some: Integers = some, pair: Integers = pair,
            share: Floats = share, parts: Floats = parts,
        ) -> None:  # fmt: skip
            mine = some[begin:end]
            waves = velocity_waves(columns[0, mine], columns[1, mine], highest)
            _gas_orders(begin, *waves, pair, share, *of_rows, place, turned, *parts)

        # 256 designs, each of which takes some 2 us, are worth a thread.
        on_threads(some.size, work, threads, 256)
        result[some] = parts[0] + 1j * parts[1]


@kernel
def _gas_orders(
    begin: int, wave: Floats, quadrature: Floats, rows: Integers, weight: Floats,
    row_real: Floats, row_imaginary: Floats, place: Integers, turned: Booleans, real: Floats,
    imaginary: Floats,
) -> None:  # fmt: skip
    """Harmonics sum_m v_m c_(nu - m) of the designs with velocity waves from `begin` on."""
    highest = wave.shape[1] - 1
    sizes = row_real.shape[1]
    one, other = np.empty(sizes), np.empty(sizes)
    for number in range(wave.shape[0]):
        design = begin + number
        share = weight[design]
        rest = 1.0 - share
        low, high = rows[0, design], rows[1, design]
        for i in range(sizes):
            one[i] = rest * row_real[low, i] + share * row_real[high, i]
            other[i] = rest * row_imaginary[low, i] + share * row_imaginary[high, i]
        w, q = wave[number], quadrature[number]
        for i in range(place.shape[0]):
            sum_real, sum_imaginary = 0.0, 0.0
            for m in range(1, highest + 1):
                # Terms v_m c_(nu - m) and conj(v_m) c_(nu + m) of the sum.
                down, up = place[i, highest + m], place[i, highest - m]
                sign = -1.0 if turned[i, highest + m] else 1.0
                a, b = one[down], sign * other[down]
                c, d = one[up], other[up]
                sum_real += w[m] * (a + c) + q[m] * (d - b)
                sum_imaginary += w[m] * (b + d) + q[m] * (a - c)
            real[design, i], imaginary[design, i] = sum_real, sum_imaginary


def _designs(orders: Any, *inputs: Any) -> tuple[Floats, tuple[int, ...], Floats]:
    """Orders as a row, the common shape of the other inputs, and these inputs as columns."""
    others = np.broadcast_arrays(*(np.asarray(one, dtype=float) for one in inputs))
    columns = np.stack([one.reshape(-1) for one in others])
    return kinematic_series.checked_orders(orders).reshape(-1), others[0].shape, columns


def _along_orders(values: Complexes, orders: Any, shape: tuple[int, ...]) -> Complexes:
    """Broadcast (designs, orders) to the shapes of both; designs have size 1 along the orders."""
    own = np.shape(orders)
    if values.shape[1] == 1:
        return np.array(np.broadcast_to(values.reshape(shape), np.broadcast_shapes(own, shape)))
    size = max(len(own), len(shape))
    along = next((i - len(own) for i, length in enumerate(own) if length > 1), -1)
    table = values.reshape(*(1,) * (size - len(shape)), *shape, values.shape[1])
    if table.shape[along - 1] != 1:
        raise ValueError("orders: must lie along an axis on which all other inputs have size 1")
    return np.moveaxis(table.squeeze(axis=along - 1), -1, along)
