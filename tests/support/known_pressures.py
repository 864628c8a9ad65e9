"""Pressure of a four-stroke engine in closed form, whose level and dead centre are known.

Nothing of the package is used: the charge is compressed along p V^n from the inlet pressure, burns
by a Wiebe function in place, and leaves. Expansion follows the same polytrope, so a cycle in which
nothing burns mirrors itself.
"""

from dataclasses import dataclass

import numpy as np

from engine_dyn.types import Floats

SPENT = 150.0
"""Where the exhaust opens, degrees; 60 degrees later the pressure is that of the inlet."""


@dataclass(frozen=True)
class KnownPressure:
    """Numbers of a cycle; pressures in bar, angles in degrees."""

    ratio: float = 16.0
    exponent: float = 1.34
    inlet: float = 1.0
    rise: float = 0.6
    start: float = -6.0
    duration: float = 65.0
    crank_ratio: float = 0.27

    def volume(self, degrees: Floats) -> Floats:
        """Over the clearance volume."""
        angle = np.radians(degrees)
        lean = np.sqrt(1.0 - (self.crank_ratio * np.sin(angle)) ** 2)
        travel = 0.5 * (1.0 - np.cos(angle) + (1.0 - lean) / self.crank_ratio)
        return np.asarray(1.0 + (self.ratio - 1.0) * travel)

    def __call__(self, degrees: Floats) -> Floats:
        """Absolute pressure [bar] at crank angles, 0 is firing dead centre."""
        at = (np.asarray(degrees, float) + 360.0) % 720.0 - 360.0
        burnt = -np.expm1(-6.9 * (np.clip(at - self.start, 0.0, None) / self.duration) ** 2)
        closed = (self.ratio / self.volume(at)) ** self.exponent * (1.0 + self.rise * burnt)
        end = (self.ratio / self.volume(np.array([SPENT]))) ** self.exponent * (1.0 + self.rise)
        leaving = 1.0 + (end - 1.0) * np.cos(0.5 * np.pi * (at - SPENT) / 60.0) ** 2
        inside = np.where(at < SPENT, closed, np.where(at < SPENT + 60.0, leaving, 1.0))
        return np.asarray(self.inlet * np.where(at < -180.0, 1.0, inside))

    def recorded(
        self, offset: float, late: float, *, cycles: int = 1, noise: float = 0.0, step: float = 0.5
    ) -> tuple[Floats, Floats]:
        """Angles from -360 degrees on, and cycles of pressure [bar] as a sensor records them."""
        angle = np.arange(-360.0, 360.0 - 1e-9, step)
        rng = np.random.default_rng(7)
        scatter = noise * rng.standard_normal((cycles, len(angle)))
        return angle, self(angle - late) + offset + scatter
