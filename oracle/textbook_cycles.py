"""Ideal cycles that textbooks give with all inputs: a closed form and one integral.

Both stand over pressure and volume at the start of the compression, at bottom dead centre, with
constant gamma, no loss, and a piston whose way is a cosine.
"""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

GAMMA = 1.4


class Textbook(NamedTuple):
    """Largest pressure, mean effective pressure, efficiency."""

    largest: float
    mean: float
    efficiency: float


def otto(ratio: float, heat: float) -> Textbook:
    """Air-standard cycle of constant volume, in closed form (Heywood, section 5.4.1)."""
    efficiency = 1.0 - ratio ** (1.0 - GAMMA)
    largest = ratio**GAMMA + (GAMMA - 1.0) * heat * ratio
    return Textbook(largest, efficiency * heat * ratio / (ratio - 1.0), efficiency)


def finite_release(
    ratio: float, heat: float, start: float, duration: float, form: float
) -> Textbook:
    """Finite heat release (Ferguson and Kirkpatrick, Internal Combustion Engines, ch. 2).

    dp/dtheta = (-gamma p dV/dtheta + (gamma - 1) Q dx/dtheta)/V with V = 1 + (r - 1)/2 (1 - cos),
    over its value at bottom dead centre, and Wiebe's x with factor 5 and exponent form + 1; start
    and duration in degrees.
    """
    begin, size, power = math.radians(start), math.radians(duration), form + 1.0

    def rates(theta: float, y: ArrayLike) -> list[float]:
        (pressure, _) = np.asarray(y)
        volume = (1.0 + 0.5 * (ratio - 1.0) * (1.0 - math.cos(theta))) / ratio
        growth = 0.5 * (ratio - 1.0) * math.sin(theta) / ratio
        time = max(theta - begin, 0.0) / size
        burning = 5.0 * power * time ** (power - 1.0) * math.exp(-5.0 * time**power) / size
        rate = (-GAMMA * pressure * growth + (GAMMA - 1.0) * heat * burning) / volume
        return [rate, pressure * growth]

    y, largest = np.array([1.0, 0.0]), 1.0
    for low, high in pairwise([-math.pi, begin, begin + 0.25 * size, begin + size, math.pi]):
        run = solve_ivp(
            rates, (low, high), y, method="DOP853", rtol=1e-12, atol=1e-12,
            t_eval=np.linspace(low, high, 20001),
        )  # fmt: skip
        y, largest = run.y[:, -1], max(largest, float(run.y[0].max()))
    return Textbook(largest, float(y[1]) * ratio / (ratio - 1.0), float(y[1]) / heat)
