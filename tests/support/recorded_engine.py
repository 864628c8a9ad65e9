"""Recorded cycles made without the package's own cycles and geometry: what they contain is known.

One cylinder of 100 x 120 mm. Its closed part follows from the first law with Wiebe's combustion, a
heat loss and a ratio of specific heats that falls with the temperature, integrated by scipy.
"""

import functools
import math
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from engine_dyn.recordings.cylinder_geometry import CylinderGeometry, RecordedCycles

BORE, STROKE, ROD, RATIO = 0.1, 0.12, 0.21, 16.0
GEOMETRY = CylinderGeometry(BORE, STROKE, 0.5 * STROKE / ROD, RATIO)
AREA = math.pi * BORE**2 / 4.0
SWEPT = AREA * STROKE
DEGREE = math.pi / 180.0
CLOSES, OPENS = -140.0 * DEGREE, 130.0 * DEGREE


def volume(angle: Any) -> Any:
    """Volume [m3] from the triangle of crank and rod."""
    crank = 0.5 * STROKE
    travel = crank + ROD - crank * np.cos(angle) - np.sqrt(ROD**2 - (crank * np.sin(angle)) ** 2)
    return SWEPT / (RATIO - 1.0) + AREA * travel


def _slope(angle: float) -> float:
    return float((volume(angle + 1e-5) - volume(angle - 1e-5)) / 2e-5)


def burnt(angle: Any, start: float = -8.0, duration: float = 60.0) -> Any:
    """Burnt fraction, Wiebe's function with the exponent 1.2 [1]; angles [rad], degrees."""
    part = np.clip((np.asarray(angle) / DEGREE - start) / duration, 0.0, None)
    return 1.0 - np.exp(-6.9 * part**2.2)


def pressure(
    angle: Any,
    heat: float = 1500.0,
    gamma: float = 1.376,
    fall: float = 0.028,
    loss: float = 4.0,
    inlet: float = 1e5,
) -> Any:
    """Pressure [Pa] at crank angles [rad] of a four-stroke cycle.

    `heat` [J] burns; `loss` [J per radian] goes to the walls while the cylinder is closed, in
    proportion to the excess of p V over its value at the start and to p^0.7. The ratio of specific
    heats falls from `gamma` by `fall` for each time that p V, and so the temperature, rises by its
    first value.
    """
    grid, closed = _closed(heat, gamma, fall, loss, inlet)
    angle = np.asarray(angle, dtype=float)
    found = np.interp(angle, grid, closed)
    exhaust = 1.05 * inlet + (closed[-1] - 1.05 * inlet) * np.exp(-(angle - OPENS) / (8.0 * DEGREE))
    found = np.where(angle > OPENS, exhaust, found)
    return np.where(angle < CLOSES, inlet, found)


@functools.cache
def _closed(heat: float, gamma: float, fall: float, loss: float, inlet: float) -> tuple[Any, Any]:
    """Angles of the closed part and the pressures there; integrated once for the same numbers."""
    grid = np.linspace(CLOSES, OPENS, 2701)

    def change(phi: float, p: Any) -> Any:
        step = 1e-5
        burning = heat * float(burnt(phi + step) - burnt(phi - step)) / (2.0 * step)
        work = p[0] * volume(phi) / (inlet * volume(CLOSES))
        lost = loss * max(work - 1.0, 0.0) * (p[0] / inlet) ** 0.7
        ratio = gamma - fall * (work - 1.0)
        rise = (ratio - 1.0) * (burning - lost) - ratio * p[0] * _slope(phi)
        return [rise / volume(phi)]

    solution = solve_ivp(
        change, (CLOSES, OPENS), [inlet], t_eval=grid, rtol=1e-9, atol=1.0, max_step=0.5 * DEGREE
    )
    return grid, solution.y[0]


def cycles(
    step: float = 0.5, count: int = 1, shift: float = 0.0, noise: float = 0.0, seed: int = 1,
    **values: float,
) -> RecordedCycles:  # fmt: skip
    """Cycles on a grid of `step` degrees, `shift` degrees late, with noise [Pa]."""
    angle = np.arange(-360.0, 360.0 - 1e-9, step) * DEGREE
    late = (angle - shift * DEGREE + 2.0 * math.pi) % (4.0 * math.pi) - 2.0 * math.pi
    one = pressure(late, **values)
    rng = np.random.default_rng(seed)
    return RecordedCycles(angle, one + noise * rng.standard_normal((count, len(angle))))
