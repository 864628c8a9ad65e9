"""A synthetic engine speed, a wheel with errors of its teeth, and what its sensor gives.

Everything follows from a time over the angle in closed form, so that nothing is shared with the
code under test.
"""

from dataclasses import dataclass, field

import numpy as np

from engine_dyn.types import Floats
from oracle.teeth import SampledEngine as SampledEngine
from oracle.teeth import tooth_times as tooth_times
from oracle.teeth import write_times as write_times


@dataclass(frozen=True)
class TurningEngine:
    """An engine whose slowness 1/omega is a short Fourier series of the crank angle.

    Attributes
    ----------
    mean : float
        1/<1/omega> [rad/s].
    waves : dict
        Order of the crank's turn: relative amplitude and phase [rad] of its cosine.
    """

    mean: float = 310.0
    waves: dict[float, tuple[float, float]] = field(
        default_factory=lambda: {0.5: (0.02, 0.4), 1.0: (0.015, 1.0), 1.5: (0.01, -2.0),
                                 2.0: (0.008, 0.3), 3.0: (0.004, 2.0)}
    )  # fmt: skip

    def slowness(self, angle: Floats) -> Floats:
        """1/omega [s/rad]."""
        found = np.ones(np.shape(angle))
        for order, (size, phase) in self.waves.items():
            found = found + size * np.cos(order * angle + phase)
        return found / self.mean

    def speed(self, angle: Floats) -> Floats:
        return 1.0 / self.slowness(angle)

    def time(self, angle: Floats) -> Floats:
        """Integral of the slowness [s], 0 at angle 0."""
        found = np.array(angle, dtype=float)
        for order, (size, phase) in self.waves.items():
            found = found + size / order * (np.sin(order * angle + phase) - np.sin(phase))
        return found / self.mean


def random_errors(width: Floats, size: float, seed: int) -> Floats:
    """Relative errors of intervals whose widths still make a turn."""
    errors = size * np.random.default_rng(seed).standard_normal(width.size)
    return errors - np.sum(errors * width) / width.sum()


def noisy(times: Floats, size: float, rng: np.random.Generator) -> Floats:
    """The same from 0 on, with a random relative error of each interval."""
    steps = np.diff(times) * (1.0 + size * rng.standard_normal(times.size - 1))
    return np.concatenate([[0.0], np.cumsum(steps)])


def pulses(times: Floats, interval: float, samples: int, width: float, high: float = 5.0) -> Floats:
    """Smooth pulses centred a little after each time: they pass half their height at that time.

    `width` is the time from the lower to the upper level of an edge [s].
    """
    at = interval * np.arange(samples)
    half = 0.45 * np.min(np.diff(times))
    up = np.interp(at, times, np.arange(times.size), left=-1, right=times.size)
    place = np.clip(np.rint(up), 0, times.size - 1).astype(int)
    best = np.full(samples, -np.inf)
    for near in (-1, 0, 1):
        index = np.clip(place + near, 0, times.size - 1)
        rise = (at - times[index]) / width
        fall = (times[index] + half - at) / width
        best = np.maximum(best, np.minimum(rise, fall))
    return high * np.asarray(0.5 * (1.0 + np.tanh(2.0 * best)))
