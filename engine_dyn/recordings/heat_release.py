"""Work, heat and exponents of recorded cycles.

Sources: Heywood, Internal Combustion Engine Fundamentals, McGraw-Hill 1988: gross, net and pumping
work, section 2.4; apparent net heat release, eq. 9.27; polytropic exponents from log p - log V,
section 9.5 (cited from memory).

Values, integrals and noise of curves are those of the cubic through four neighbouring samples,
which may be unevenly spaced. All of it is linear in the samples, so that weights are found once for
a grid and serve every cycle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry, RecordedCycles
from engine_dyn.types import Floats, Integers
from engine_dyn.units import DEGREE

GAMMA = 1.35  # Ratio of specific heats if none is given: between unburnt and burnt gas


class MeanPressures(NamedTuple):
    """Indicated mean effective pressures of each cycle [Pa], shape (cycles,)."""

    net: Floats  # Mean pressure over the whole cycle
    gross: Floats  # Mean pressure over compression and expansion; equals `net` for two strokes
    pumping: Floats  # Mean pressure over the gas exchange, mostly negative; 0 for two strokes


def mean_pressures(cycles: RecordedCycles, geometry: CylinderGeometry) -> MeanPressures:
    """Work of the gas over the swept volume, docs/method.md (122).

    The pressure between four samples is their cubic. The compression ratio is not needed.
    """

    def over(start: float, end: float) -> Floats:
        weights = work_weights(cycles.angle, cycles.period, geometry.volume_slope, start, end)
        return np.asarray((cycles.pressure * weights).sum(axis=1) / geometry.swept_volume)

    half = 0.5 * cycles.period
    if cycles.period != FOUR_STROKE:
        net = over(-half, half)
        return MeanPressures(net, net, np.zeros_like(net))
    gross = over(-math.pi, math.pi)
    pumping = over(-half, -math.pi) + over(math.pi, half)
    return MeanPressures(gross + pumping, gross, pumping)


def peak_pressures(cycles: RecordedCycles) -> tuple[Floats, Floats]:
    """Largest pressure [Pa] and its angle [rad] of each cycle, by a parabola of three samples."""
    rows, top = np.arange(cycles.cycles), np.argmax(cycles.pressure, axis=1)
    count = len(cycles.angle)
    left, right = (top - 1) % count, (top + 1) % count
    before = (cycles.angle[top] - cycles.angle[left]) % cycles.period
    after = (cycles.angle[right] - cycles.angle[top]) % cycles.period
    highest = cycles.pressure[rows, top]
    up = (cycles.pressure[rows, right] - highest) / after
    down = (highest - cycles.pressure[rows, left]) / before
    bend = (up - down) / (before + after)
    slope = (up * before + down * after) / (before + after)
    step = np.where(bend < 0.0, -0.5 * slope / np.where(bend < 0.0, bend, -1.0), 0.0)
    step = np.clip(step, -before, after)
    return highest + step * (slope + bend * step), cycles.angle[top] + step


def coefficient_of_variation(values: Floats) -> float:
    """Standard deviation over the mean [1]; NaN of fewer than two values, or if the mean is 0."""
    mean = float(np.mean(values))
    return float(np.std(values, ddof=1)) / mean if len(values) > 1 and mean else math.nan


class Exponent(NamedTuple):
    """A polytropic exponent [1] of each cycle and its standard error, shape (cycles,)."""

    value: Floats
    uncertainty: Floats


def polytropic_exponent(
    cycles: RecordedCycles, geometry: CylinderGeometry, start: float, end: float
) -> Exponent:
    """Slope of -ln p over ln V between two angles [rad] by least squares, docs/method.md (124).

    Raises
    ------
    ValueError
        With fewer than four samples between the angles, with pressures there that are not
        positive, or without a compression ratio.
    """
    at = (cycles.angle >= start) & (cycles.angle <= end)
    if at.sum() < 4:
        raise ValueError(
            f"fewer than four samples between {start / DEGREE:g} and {end / DEGREE:g} degree"
        )
    log_v = np.log(geometry.volume(cycles.angle[at]))
    part = cycles.pressure[:, at]
    if not np.all(part > 0.0):
        raise ValueError("pressure: must be positive (absolute) on compression and expansion")
    log_p = np.log(part)
    x = log_v - log_v.mean()
    square = (x**2).sum()
    value = -(log_p * x).sum(axis=1) / square
    rest = log_p - log_p.mean(axis=1, keepdims=True) + value[:, None] * x
    spread = np.sqrt((rest**2).sum(axis=1) / (len(x) - 2) / square)
    return Exponent(value, spread)


@dataclass(frozen=True, eq=False)
class HeatRelease:
    """Apparent net heat release of cycles: the heat of combustion less that lost to the walls."""

    angle: Floats  # Angles of the closed cylinder [rad]; shape (n,)
    rate: Floats  # Rate of heat release dQ/dphi [J/rad]; shape (cycles, n)
    heat: Floats  # Integral of the rate from the first angle on [J]; shape (cycles, n)


def heat_release(
    cycles: RecordedCycles,
    geometry: CylinderGeometry,
    gamma: float | Floats = GAMMA,
    start: float = -120.0 * DEGREE,
    end: float = 120.0 * DEGREE,
) -> HeatRelease:
    """Apparent net heat release by the first law of one zone, docs/method.md (123).

    Parameters
    ----------
    cycles : RecordedCycles
        Absolute pressure.
    geometry : CylinderGeometry
        With its compression ratio.
    gamma : float or ndarray, shape (samples,)
        Ratio of specific heats [1]: one number, or one for each sample of `cycles`.
    start, end : float
        Between which the cylinder is closed [rad].

    Raises
    ------
    ValueError
        If gamma is not above 1, no samples lie between the angles, or the compression ratio is not
        known.
    """
    ratio = np.broadcast_to(np.asarray(gamma, dtype=float), cycles.angle.shape)
    if not np.all(ratio > 1.0):
        raise ValueError(f"gamma = {float(ratio.min()):g}: must be above 1")
    at = (cycles.angle >= start) & (cycles.angle <= end)
    if at.sum() < 2:
        raise ValueError(f"no samples between {start / DEGREE:g} and {end / DEGREE:g} degree")
    angle, ratio = cycles.angle[at], ratio[at]
    volume, slope = geometry.volume(angle), geometry.volume_slope(angle)
    p, rise = cycles.pressure[:, at], slopes(cycles)[:, at]
    rate = (ratio * p * slope + volume * rise) / (ratio - 1.0)
    steps = 0.5 * np.diff(angle) * (rate[:, 1:] + rate[:, :-1])
    heat = np.concatenate([np.zeros((cycles.cycles, 1)), np.cumsum(steps, axis=1)], axis=1)
    return HeatRelease(angle, rate, heat)


_GAUSS = np.polynomial.legendre.leggauss(4)


def _lagrange(nodes: Floats, at: Floats) -> Floats:
    """Weights, shape (..., n), of values at nodes in the polynomial at places, shape (...)."""
    count = nodes.shape[-1]
    weights = np.ones(nodes.shape)
    for i in range(count):
        for j in range(count):
            if i != j:
                weights[..., i] *= (at - nodes[..., j]) / (nodes[..., i] - nodes[..., j])
    return weights


def _around(angle: Floats, period: float, places: Sequence[int]) -> tuple[Floats, Integers]:
    """Angles and indices of samples at some places, counted from each sample."""
    count = len(angle)
    index = np.arange(count)[:, None] + np.array(places)
    turns = np.floor_divide(index, count)
    index = index - count * turns
    return angle[index] + period * turns, index


def work_weights(
    angle: Floats, period: float, slope_of: Callable[[Floats], Floats], start: float, end: float
) -> Floats:
    """Weights w for which sum(w p) is the integral of p V' from `start` to `end`.

    Parameters
    ----------
    angle : ndarray, shape (n,)
        Grid of the pressure [rad].
    period : float
        Of the cycle [rad].
    slope_of : callable
        V' at angles.
    start, end : float
        Within one period of each other [rad].

    Returns
    -------
    ndarray, shape (n,)
    """
    nodes, index = _around(angle, period, (-1, 0, 1, 2))
    weights = np.zeros(len(angle))
    for turn in (-1.0, 0.0, 1.0):
        low = np.clip(nodes[:, 1] + turn * period, start, end)
        high = np.clip(nodes[:, 2] + turn * period, start, end)
        half = 0.5 * (high - low)
        if not half.any():
            continue
        for place, share in zip(*_GAUSS, strict=True):
            at = 0.5 * (low + high) + half * place
            part = (share * half * slope_of(at))[:, None]
            np.add.at(weights, index, part * _lagrange(nodes, at - turn * period))
    return weights


def slopes(cycles: RecordedCycles) -> Floats:
    """dp/dphi [Pa/rad] at each sample, by the parabola through it and its neighbours."""
    angle, period, p = cycles.angle, cycles.period, cycles.pressure
    after = np.diff(angle, append=angle[0] + period)
    before = np.roll(after, 1)
    up = (np.roll(p, -1, axis=1) - p) / after
    return np.asarray((up * before + np.roll(up, 1, axis=1) * after) / (before + after))


def delayed(cycles: RecordedCycles, angle: float) -> Floats:
    """Pressure of the same cycles `angle` [rad] later, shape (cycles, samples).

    Cycles follow each other; before the first and behind the last one they repeat themselves.
    """
    count = len(cycles.angle)
    places = cycles.angle - angle
    turns = np.floor((places - cycles.angle[0]) / cycles.period)
    inside = places - turns * cycles.period
    first = np.searchsorted(cycles.angle, inside, side="right") - 1
    offsets = first[:, None] + np.arange(-1, 3)
    over = np.floor_divide(offsets, count)
    nodes = cycles.angle[offsets - over * count] + cycles.period * over
    weights = _lagrange(nodes, inside)
    which = np.arange(cycles.cycles)[:, None, None] + over + turns[:, None].astype(int)
    # A neighbouring cycle that was not recorded is replaced by the cycle itself.
    own = np.arange(cycles.cycles)[:, None, None]
    which = np.where((which < 0) | (which >= cycles.cycles), own, which)
    values = cycles.pressure[which, offsets - over * count]
    return np.asarray((values * weights).sum(axis=-1))


def misfit_of_neighbours(cycles: RecordedCycles) -> Floats:
    """Difference of each sample from the cubic through two neighbours on either side.

    Divided by the root of the sum of the squared weights: of independent noise it has the standard
    deviation of the noise. Shape (cycles, samples).
    """
    nodes, index = _around(cycles.angle, cycles.period, (-2, -1, 1, 2))
    weights = _lagrange(nodes, cycles.angle)
    misfit = cycles.pressure.copy()
    for k in range(4):
        misfit -= weights[:, k] * cycles.pressure[:, index[:, k]]
    return np.asarray(misfit / np.sqrt(1.0 + (weights**2).sum(axis=1)))
