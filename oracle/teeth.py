"""Times at which the teeth of a wheel pass, from a time over the angle in closed form."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]


class Engine(Protocol):
    """What passes teeth."""

    def time(self, angle: Array) -> Array:
        """From the crank angle [rad] to the time [s]."""
        ...


class SampledEngine:
    """An engine whose speed over a cycle is known at some angles: a spline through 1/omega."""

    def __init__(self, angle: Array, omega: Array, period: float = 4.0 * np.pi) -> None:
        closed = np.append(angle, angle[0] + period)
        self.slow = CubicSpline(closed, 1.0 / np.append(omega, omega[0]), bc_type="periodic")
        self.work, self.period = self.slow.antiderivative(), period

    def speed(self, angle: Array) -> Array:
        """From the crank angle [rad] to the speed [rad/s]."""
        return np.asarray(1.0 / self.slow(angle))

    def time(self, angle: Array) -> Array:
        """Integral of the slowness [s] from the first of the angles."""
        cycle, within = np.divmod(np.asarray(angle) - self.slow.x[0], self.period)
        return np.asarray(self.work(within + self.slow.x[0]) + cycle * self.work(self.slow.x[-1]))


def tooth_times(
    engine: Engine, width: Array, turns: int, gap_angle: float = 0.0,
    errors: Array | float = 0.0,
) -> Array:  # fmt: skip
    """Times at which teeth pass, from the first tooth of the first turn, which starts a cycle."""
    within = np.cumsum(np.concatenate([[0.0], (width * (1.0 + errors))[:-1]]))
    angle = gap_angle + 2.0 * np.pi * np.arange(turns)[:, None] + within
    return engine.time(np.append(angle.ravel(), gap_angle + 2.0 * np.pi * turns))


def write_times(path: Path, times: Array) -> None:
    """A file of times of teeth."""
    path.write_text(
        "time [s]\n" + "\n".join(f"{one:.9f}" for one in times) + "\n", encoding="utf-8"
    )
