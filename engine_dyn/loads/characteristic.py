"""Speed characteristics: power and torque over speed, and the load whose diagram gives them.

Power units, lecture 18: N_e = N_max x [A + C x - x^2] with x = n/n_max, and M = N_e/omega. The
lecture writes 9550 N_e/n, with kW and rpm; its 9550 is 30000/pi = 9549.3, rounded. In all four sets
A + C = 2, so that N_e(n_max) = N_max.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.types import Floats

__all__ = ["CHARACTERISTICS", "PROPELLER", "Characteristic", "load_for_torque"]


@dataclass(frozen=True)
class Characteristic:
    """A curve of power over speed, as a polynomial of x = n/n_max.

    Attributes
    ----------
    constant, linear, square : float
        Coefficients of N_e/(N_max x) = constant + linear x + square x^2.
    source : str
        Author and equation.
    """

    constant: float
    linear: float
    square: float
    source: str

    def power(self, speed: Any, rated_power: Any, rated_speed: Any) -> Any:
        """Power [W] at crank speeds [rad/s]; arguments broadcast.

        Raises
        ------
        ValueError
            For a rated power or speed that is not above 0.
        """
        return self.torque(speed, rated_power, rated_speed) * np.asarray(speed, dtype=float)

    def torque(self, speed: Any, rated_power: Any, rated_speed: Any) -> Any:
        """Torque [N m] at crank speeds [rad/s], also at standstill; errors as `power`."""
        for name, value in (("rated_power", rated_power), ("rated_speed", rated_speed)):
            number = np.asarray(value, dtype=float)
            if not (number > 0.0).all():
                bad = number[~(number > 0.0)].flat[0]
                raise ValueError(f"{name} = {bad:g}: must be above 0")
        x = np.asarray(speed, dtype=float) / rated_speed
        relative = self.constant + x * (self.linear + x * self.square)
        return np.asarray(rated_power) / rated_speed * relative

    @property
    def largest_torque(self) -> tuple[float, float]:
        """Speed over rated speed at which the torque is largest, and that over the rated one."""
        x = -0.5 * self.linear / self.square
        return x, self.constant + x * (self.linear + x * self.square)


def _lecture(a: float, c: float) -> Characteristic:
    return Characteristic(a, c, -1.0, "Power units, lecture 18")


PROPELLER = Characteristic(0.0, 0.0, 1.0, "Kakaitsas section 3.2: torque over omega squared")
"""Fixed-pitch propeller: power over the cube of the speed."""

CHARACTERISTICS: Mapping[str, Characteristic] = MappingProxyType(
    {
        "spark ignition": _lecture(1.00, 1.00),
        "diesel": _lecture(0.87, 1.13),
        "pre-chamber diesel": _lecture(0.60, 1.40),
        "swirl-chamber diesel": _lecture(0.70, 1.30),
        "propeller": PROPELLER,
    }
)
"""Curves by name; "diesel" has an undivided combustion chamber."""

MOST_STEPS = 60

SAME = 1e-9
"""Relative difference by which a torque may lie beyond those of the diagrams, which is rounding."""


def load_for_torque(
    torque_of: Callable[[Floats], Any], loads: npt.ArrayLike, wanted: npt.ArrayLike
) -> Floats:
    """Load [percent] at which the brake torque is what is wanted, for every element.

    Parameters
    ----------
    torque_of : callable
        Torque [N m] of loads, in the shape of `wanted`; it rises with the load.
    loads : array_like
        Loads of the given diagrams, ascending: between each two of them is a bracket.
    wanted : array_like
        [N m].

    Returns
    -------
    ndarray
        Shape of `wanted`; NaN where the diagrams do not reach it. The root is found to rounding, by
        regula falsi (the Illinois form) in the first bracket that contains it.
    """
    goal = np.asarray(wanted, dtype=np.float64)
    knots = np.asarray(loads, dtype=np.float64)
    miss = [np.asarray(torque_of(np.full(goal.shape, load))) - goal for load in knots]
    slack = SAME * np.abs(goal)
    found = np.full(goal.shape, np.nan)
    for load, here in ((knots[-1], miss[-1]), (knots[0], miss[0])):
        found = np.where(np.abs(here) <= slack, load, found)
    low, high = np.full(goal.shape, np.nan), np.full(goal.shape, np.nan)
    below, above = np.full(goal.shape, np.nan), np.full(goal.shape, np.nan)
    for left, right, one, other in zip(knots, knots[1:], miss, miss[1:], strict=False):
        holds = np.isnan(low) & (one <= 0.0) & (other >= 0.0)
        low, high = np.where(holds, left, low), np.where(holds, right, high)
        below, above = np.where(holds, one, below), np.where(holds, other, above)
    todo = np.isnan(found) & np.isfinite(low)
    side = np.zeros(goal.shape)
    for _ in range(MOST_STEPS):
        if not todo.any():
            break
        with np.errstate(divide="ignore", invalid="ignore"):
            load = (low * above - high * below) / (above - below)
        load = np.where(np.isfinite(load), np.clip(load, low, high), 0.5 * (low + high))
        here = np.asarray(torque_of(np.where(todo, load, knots[0]))) - goal
        done = todo & ((np.abs(here) <= 1e-13 * np.abs(goal)) | (high - low <= 1e-13 * high))
        found = np.where(done, load, found)
        todo = todo & ~done
        # The value at an end that stays twice is halved, so that the other end moves too.
        down, up = todo & (here > 0.0), todo & (here <= 0.0)
        below = np.where(down & (side < 0.0), 0.5 * below, below)
        above = np.where(up & (side > 0.0), 0.5 * above, above)
        high, above = np.where(down, load, high), np.where(down, here, above)
        low, below = np.where(up, load, low), np.where(up, here, below)
        side = np.where(down, -1.0, np.where(up, 1.0, side))
    return np.where(todo, 0.5 * (low + high), found)
