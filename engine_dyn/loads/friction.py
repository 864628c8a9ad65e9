"""Friction of the engine: mean effective pressure, mean torque, its shape over the crank angle.

Friction torque is positive and subtracted. A motored engine has the friction that its motored
diagram gives: `friction_mean_effective_pressure` with that diagram's p_max.

Sources
-------
Chen and Flynn, SAE paper 650733, 1965: mean effective pressure over p_max and piston speed.
Heywood, Internal Combustion Engine Fundamentals, McGraw-Hill 1988, ch. 13: regimes of lubrication,
friction as a sum of parts that grow with no, the first and the second power of speed. Rezeka and
Henein, SAE paper 840179, 1984: instantaneous friction of rings and skirt (forms as they are
usually quoted; the paper itself was not compared).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from engine_dyn.geometry.slider_crank import velocity
from engine_dyn.given_numbers import given_number
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.types import Floats
from engine_dyn.units import BAR

__all__ = [
    "FrictionShape",
    "StrokeFriction",
    "friction_mean_effective_pressure",
    "friction_torque",
    "mean_parts",
    "mean_piston_speed",
    "stacked_parts",
]


PANELS = 180
"""Panels of a stroke over which means are taken."""


def mean_piston_speed(stroke: Any, speed: Any) -> Any:
    """Mean piston speed [m/s], c_m of docs/method.md (30), from stroke [m] and crank speed."""
    return stroke * speed / 3.141592653589793


def friction_mean_effective_pressure(
    constant: Any,
    peak_pressure_share: Any,
    piston_speed_share: Any,
    peak_pressure: Any,
    speed: Any,
    piston_speed_square_share: Any = 0.0,
) -> Any:
    """Friction mean effective pressure [Pa]: a + b p_max + c c_m + d c_m^2.

    docs/method.md (30); Chen and Flynn (SAE 650733); Kakaitsas (2015), eq. 3.9, without the square.
    `constant` [Pa], `peak_pressure_share` [1], `piston_speed_share` [Pa s/m], `peak_pressure`
    absolute [Pa], of the motored diagram for a motored engine, `speed` the mean piston speed [m/s],
    `piston_speed_square_share` [Pa s2/m2].
    """
    linear = constant + peak_pressure_share * peak_pressure + piston_speed_share * speed
    return linear + piston_speed_square_share * speed**2


def friction_torque(friction_pressure: Any, displacement: Any, period: Any) -> Any:
    """Mean friction torque [N m], positive, to be subtracted: fmep V_h/Phi.

    docs/method.md (30); Kakaitsas (2015), eq. 3.8. `displacement` is the whole engine's [m3];
    `period` the cycle's angle Phi (4 pi four-stroke).
    """
    return friction_pressure * displacement / period


class StrokeFriction(NamedTuple):
    """Friction that varies over the stroke: levels of its four parts, all [Pa].

    docs/method.md (32). A level is the mean torque of its part, for one cylinder, over piston area
    and crank radius. Kernels take numbers, curves take arrays that broadcast.

    Attributes
    ----------
    boundary, mixed, hydrodynamic, skirt : array_like
        Levels of the parts of `FrictionShape`.
    ring : array_like
        Pressure of the rings on the liner by their own tension.
    """

    boundary: Any
    mixed: Any
    hydrodynamic: Any
    skirt: Any
    ring: Any

    @property
    def levels(self) -> tuple[Any, Any, Any, Any]:
        """Levels of the four parts."""
        return self.boundary, self.mixed, self.hydrodynamic, self.skirt


def stacked_parts(load: ArrayLike, speed: ArrayLike, sine: ArrayLike) -> Floats:
    """Torques of the four parts of `FrictionShape`, not scaled, shape (4, ...).

    docs/method.md (31): N u, N u (1 - |sin(phi)|), sqrt(N u) u and u^2, with u = |c/(r omega)|.

    Parameters
    ----------
    load : array_like
        N, the pressure on the rings [Pa]; a negative one lifts them and counts as 0.
    speed : array_like
        c/(r omega) of the piston [1].
    sine : array_like
        Sine of the cylinder's own crank angle [1].
    """
    fast = np.abs(speed)
    dry = np.maximum(load, 0.0) * fast
    parts = dry, dry * (1.0 - np.abs(sine)), np.sqrt(dry) * fast, fast * fast
    return np.stack(np.broadcast_arrays(*parts))


def mean_parts(parts: Callable[[Floats], Floats], period: float) -> Floats:
    """Cycle means of `stacked_parts`, a function of the cylinder's angle [rad], shape (4, ...).

    The means of docs/method.md (32). They are taken stroke by stroke at Gauss's points. The angle
    is stretched, so that the square roots of the piston's speed at the dead centres do not lower
    the order of the quadrature.
    """
    node, weight = np.polynomial.legendre.leggauss(5)
    t = ((np.arange(PANELS)[:, None] + 0.5 * (node + 1.0)) / PANELS).reshape(-1)
    weights = np.tile(0.5 * weight / PANELS, PANELS)
    place = t**3 * (10.0 + t * (6.0 * t - 15.0))
    stretch = 30.0 * (t * (1.0 - t)) ** 2
    total: Any = 0.0
    for stroke in range(round(period / math.pi)):
        at_points = parts((stroke + place) * math.pi)
        total = total + np.einsum("...q,q->...", at_points, weights * stretch)
    means: Floats = total / round(period / math.pi)
    return means


@dataclass(frozen=True)
class FrictionShape:
    """How one cylinder's friction torque is spread over the crank angle; its cycle mean is 1.

    With u = |c/(r omega)| and the load on a ring N = ring_pressure + p - p_crankcase (0 where the
    sum is negative, because the ring is lifted), the torque of a friction force is force times u.
    The branches of the Stribeck curve give four forces, each scaled so that its cycle mean is the
    fraction given for it:

        boundary        N                    the coefficient of friction is constant,
        mixed           N (1 - |sin phi|)    it falls as speed builds up,
        hydrodynamic    sqrt(N u)            it grows like sqrt(u/N),
        skirt           u                    shear of a film of given thickness;

    docs/method.md (31) and (32), after Rezeka and Henein (1984), as usually quoted. The remainder
    of the friction is constant: bearings, valve gear, auxiliaries. The shape times the mean
    friction torque is the torque M_fr(phi); its mean does not depend on the fractions.

    Attributes
    ----------
    boundary, mixed, hydrodynamic, skirt : float
        Fractions of the mean friction [1], 0 or more, together at most 1.
    ring_pressure : float
        Pressure of the rings on the liner by their own tension [Pa].
    """

    boundary: float
    mixed: float
    hydrodynamic: float
    skirt: float
    ring_pressure: float

    def __post_init__(self) -> None:
        """Refuse wrong fractions; ValueError names field, value and what is allowed."""
        for name in ("boundary", "mixed", "hydrodynamic", "skirt"):
            fraction = given_number(name, getattr(self, name))
            if not 0.0 <= fraction <= 1.0:
                raise ValueError(f"{name} = {fraction:g}: must be between 0 and 1")
        if self.rest < -1e-12:
            raise ValueError(
                "boundary + mixed + hydrodynamic + skirt = "
                f"{1.0 - self.rest:g}: must be at most 1 together"
            )
        if not 0.0 < given_number("ring_pressure", self.ring_pressure) < 100.0 * BAR:
            raise ValueError(
                f"ring_pressure = {self.ring_pressure / BAR:g} bar: must be above 0 and below 100 "
                "bar"
            )

    @property
    def rest(self) -> float:
        """Fraction of the friction that is constant over the cycle."""
        return 1.0 - (self.boundary + self.mixed + self.hydrodynamic + self.skirt)

    def __call__(
        self, phi: ArrayLike, crank_ratio: float, diagram: Diagram, crankcase_pressure: float
    ) -> Floats:
        """Friction torque over its cycle mean [1] at crank angles [rad].

        Parameters
        ----------
        phi : array_like
            Crank angles of this cylinder [rad], 0 at its firing top dead centre.
        crank_ratio : float
            Crank radius over rod length [1].
        diagram : Diagram
            Its indicator diagram, absolute pressure.
        crankcase_pressure : float
            Absolute pressure under the piston [Pa].
        """
        weights = self.weights(crank_ratio, diagram, crankcase_pressure)
        parts = self._parts(phi, crank_ratio, diagram, crankcase_pressure)
        return np.asarray(self.rest + np.einsum("p,p...->...", weights, parts))

    def weights(self, crank_ratio: float, diagram: Diagram, crankcase_pressure: float) -> Floats:
        """Fraction over cycle mean of each of the four parts, docs/method.md (32), shape (4,)."""
        means = mean_parts(
            lambda phi: self._parts(phi, crank_ratio, diagram, crankcase_pressure), diagram.period
        )
        return np.array([self.boundary, self.mixed, self.hydrodynamic, self.skirt]) / means

    def _parts(
        self, phi: ArrayLike, crank_ratio: float, diagram: Diagram, crankcase_pressure: float
    ) -> Floats:
        """Torques of the four branches, not scaled, shape (4, ...)."""
        angle = np.asarray(phi, dtype=np.float64)
        load = self.ring_pressure + diagram(angle) - crankcase_pressure
        return stacked_parts(load, velocity(angle, crank_ratio), np.sin(angle))
