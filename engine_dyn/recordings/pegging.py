"""Absolute pressure of sensors that measure changes alone: one constant is added to each cycle.

Sources: Randolph, Methods of processing cylinder-pressure transducer signals to maximize data
accuracy, SAE paper 900170, 1990 (inlet pressure at bottom dead centre; polytropic compression);
Brunt and Pond, Evaluation of techniques for absolute cylinder pressure correction, SAE paper
970036, 1997 (cited from memory, not compared).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from engine_dyn.recordings.cylinder_geometry import CylinderGeometry
from engine_dyn.recordings.recorded_cycles import RecordedCycles
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE

EXPONENT, EXPONENT_DEVIATION = 1.33, 0.02
"""Polytropic exponent of a compression and its standard deviation where it is not fitted: 1.32 to
1.35 of spark-ignition engines, 1.34 to 1.38 of diesel engines (judgement after Randolph 1990)."""

COMPRESSION = (-100.0 * DEGREE, -40.0 * DEGREE)  # Valves closed, not yet burning


class Pegged(NamedTuple):
    """Cycles with absolute pressure."""

    cycles: RecordedCycles  # The same with `offset` added
    offset: Floats  # Offset: what was added to each cycle [Pa]; shape (cycles,)
    uncertainty: Floats  # Standard uncertainty of each offset [Pa]; shape (cycles,)
    # Polytropic exponent [1], fitted or as given; NaN where none is used; shape (cycles,)
    exponent: Floats


def _pegged(
    cycles: RecordedCycles, offset: Floats, uncertainty: Floats, exponent: Floats
) -> Pegged:
    moved = RecordedCycles(cycles.angle, cycles.pressure + offset[:, None], cycles.period)
    return Pegged(moved, offset, uncertainty, exponent)


def peg_to_inlet(
    cycles: RecordedCycles,
    inlet_pressure: float,
    angle: float = -math.pi,
    window: float = 10.0 * DEGREE,
    inlet_uncertainty: float = 0.0,
) -> Pegged:
    """Make the mean pressure around an angle that of the inlet, docs/method.md (125).

    Parameters
    ----------
    cycles : RecordedCycles
        Pressure but for a constant of each cycle.
    inlet_pressure : float
        Absolute pressure in the cylinder there [Pa].
    angle : float
        Where [rad]; bottom dead centre after the intake stroke by default.
    window : float
        Angle over which samples are averaged, half of it on either side [rad].
    inlet_uncertainty : float
        Standard uncertainty of `inlet_pressure` [Pa].

    Raises
    ------
    ValueError
        If no sample lies in the window.
    """
    away = np.abs((cycles.angle - angle + 0.5 * cycles.period) % cycles.period
                  - 0.5 * cycles.period)  # fmt: skip
    at = away <= 0.5 * window + 1e-9
    if not at.any():
        raise ValueError(
            f"no sample within {0.5 * window / DEGREE:g} degree of {angle / DEGREE:g} degree"
        )
    part = cycles.pressure[:, at]
    offset = inlet_pressure - part.mean(axis=1)
    spread = part.std(axis=1, ddof=1) / math.sqrt(part.shape[1]) if part.shape[1] > 1 else 0.0
    uncertainty = np.hypot(spread, inlet_uncertainty) * np.ones(cycles.cycles)
    return _pegged(cycles, offset, uncertainty, np.full(cycles.cycles, math.nan))


def peg_by_compression(
    cycles: RecordedCycles,
    geometry: CylinderGeometry,
    exponent: float | None = EXPONENT,
    interval: tuple[float, float] = COMPRESSION,
    exponent_deviation: float = EXPONENT_DEVIATION,
) -> Pegged:
    """Make the compression polytropic: least squares of p + dp = C V^-n, docs/method.md (126).

    Parameters
    ----------
    cycles : RecordedCycles
        Pressure but for a constant of each cycle.
    geometry : CylinderGeometry
        With its compression ratio.
    exponent : float, optional
        n [1]; None: fitted too, which asks for little noise and a long interval.
    interval : tuple of float
        First and last angle [rad], valves closed and before combustion.
    exponent_deviation : float
        Standard uncertainty of a given exponent [1]; enters that of the offset.

    Raises
    ------
    ValueError
        With fewer than five samples in the interval, without a compression ratio, or if no
        exponent from 1 to 1.7 fits.
    """
    at = (cycles.angle >= interval[0]) & (cycles.angle <= interval[1])
    if at.sum() < 5:
        raise ValueError(
            f"fewer than five samples between {interval[0] / DEGREE:g} and "
            f"{interval[1] / DEGREE:g} degree"
        )
    volume = geometry.volume(cycles.angle[at]) / geometry.swept_volume
    p = cycles.pressure[:, at]
    if exponent is None:
        found = np.array([_fitted(volume, row) for row in p])
        if np.isnan(found).any():
            raise ValueError(
                "no polytropic exponent between 1 and 1.7 fits the compression between "
                f"{interval[0] / DEGREE:g} and {interval[1] / DEGREE:g} degree"
            )
        return _pegged(cycles, found[:, 0], found[:, 1], found[:, 2])
    offset, spread = _linear(volume, p, exponent)
    high, _ = _linear(volume, p, exponent + exponent_deviation)
    low, _ = _linear(volume, p, exponent - exponent_deviation)
    uncertainty = np.hypot(spread, 0.5 * (high - low))
    return _pegged(cycles, offset, uncertainty, np.full(cycles.cycles, exponent))


def _linear(volume: Floats, p: Floats, exponent: float) -> tuple[Floats, Floats]:
    """Offset of each cycle and its standard error, for one exponent."""
    x = volume**-exponent
    x = x - x.mean()
    square = (x**2).sum()
    factor = (p * x).sum(axis=1) / square
    mean = (volume**-exponent).mean()
    offset = factor * mean - p.mean(axis=1)
    rest = p - p.mean(axis=1, keepdims=True) - factor[:, None] * x
    variance = (rest**2).sum(axis=1) / (len(x) - 2)
    return offset, np.sqrt(variance * (1.0 / len(x) + mean**2 / square))


def _fitted(volume: Floats, p: Floats) -> tuple[float, float, float]:
    """Offset, its standard error and the exponent of one cycle by Gauss and Newton's method."""
    n = EXPONENT
    for _ in range(30):
        power = volume**-n
        columns = np.stack([power, -np.ones_like(power), -power * np.log(volume)], axis=1)
        # The third unknown is C dn: with the C of the same solution it is the step of n.
        solution, *_ = np.linalg.lstsq(columns, p, rcond=None)
        step = solution[2] / solution[0]
        n += float(np.clip(step, -0.1, 0.1))
        if not 1.0 < n < 1.7:
            return math.nan, math.nan, math.nan
        if abs(step) < 1e-9:
            break
    rest = p - columns @ solution
    variance = float(rest @ rest) / (len(p) - 3)
    covariance = np.linalg.inv(columns.T @ columns) * variance
    return float(solution[1]), math.sqrt(covariance[1, 1]), n
