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
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from engine_dyn.geometry.slider_crank import velocity
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.types import Floats
from engine_dyn.units import BAR, RPM

__all__ = [
    "FrictionShape",
    "auxiliary_torque",
    "friction_mean_effective_pressure",
    "friction_parts",
    "friction_torque",
    "mean_parts",
    "mean_piston_speed",
    "tabulated_auxiliary_torque",
]


PANELS = 180
"""Panels of a stroke over which means are taken."""


def mean_piston_speed(stroke: Any, speed: Any) -> Any:
    """Mean piston speed [m/s] from stroke [m] and crank speed [rad/s]: s n/30."""
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

    Chen and Flynn (SAE 650733); Kakaitsas (2015), eq. 3.9, without the square. `constant` [Pa],
    `peak_pressure_share` [1], `piston_speed_share` [Pa s/m], `peak_pressure` absolute [Pa], of the
    motored diagram for a motored engine, `speed` the mean piston speed [m/s],
    `piston_speed_square_share` [Pa s2/m2].
    """
    linear = constant + peak_pressure_share * peak_pressure + piston_speed_share * speed
    return linear + piston_speed_square_share * speed**2


def friction_torque(friction_pressure: Any, displacement: Any, period: Any) -> Any:
    """Mean friction torque [N m], positive, to be subtracted: fmep V_h/Phi. Kakaitsas, eq. 3.8.

    `displacement` is the whole engine's [m3]; `period` the cycle's angle Phi (4 pi four-stroke).
    """
    return friction_pressure * displacement / period


def auxiliary_torque(
    constant: Any, speed: Any, speed_share: Any = 0.0, speed_square_share: Any = 0.0
) -> Any:
    """Torque of the auxiliaries [N m], positive, to be subtracted: a + b omega + c omega^2.

    `constant` [N m], `speed` of the crank [rad/s], `speed_share` [N m s], `speed_square_share`
    [N m s2].
    """
    return constant + (speed_share + speed_square_share * speed) * speed


def tabulated_auxiliary_torque(speeds: ArrayLike, torques: ArrayLike, speed: ArrayLike) -> Any:
    """Torque of the auxiliaries [N m] from a table over crank speed, linear in between.

    Parameters
    ----------
    speeds, torques : array_like, shape (K,)
        Crank speeds [rad/s], strictly ascending, and torques [N m], 0 or more.
    speed : array_like
        Speeds [rad/s] within the table.

    Raises
    ------
    ValueError
        For tables of other lengths, speeds that do not ascend, negative torques, and a speed that
        the table does not cover.
    """
    given, torque = np.asarray(speeds, dtype=np.float64), np.asarray(torques, dtype=np.float64)
    if given.ndim != 1 or given.shape != torque.shape or given.size == 0:
        raise ValueError(
            f"{given.size} speeds and {torque.size} torques of auxiliaries: must be equally many"
        )
    if not np.isfinite(given).all() or (np.diff(given) <= 0.0).any():
        raise ValueError("speeds of the auxiliaries' torques: must ascend strictly")
    if not (torque >= 0.0).all():
        bad = float(torque[~(torque >= 0.0)][0])
        raise ValueError(f"auxiliary torque = {bad:g} N m: must be 0 or more")
    wanted = np.asarray(speed, dtype=np.float64)
    slack = 1e-12 * float(given[-1])
    outside = ~((wanted >= given[0] - slack) & (wanted <= given[-1] + slack))
    if outside.any():
        value = float(wanted[outside].flat[0]) / RPM
        raise ValueError(
            f"speed = {value:g} rpm: must be within the table of the auxiliaries' torques, "
            f"{given[0] / RPM:g} to {given[-1] / RPM:g} rpm"
        )
    return np.interp(wanted, given, torque)


def friction_parts(load: ArrayLike, speed: ArrayLike, sine: ArrayLike) -> Floats:
    """Torques of the four branches of `FrictionShape`, not scaled, shape (4, ...).

    `load` on the rings [Pa], `speed` of the piston over r omega, `sine` of the cylinder's angle.
    """
    fast = np.abs(np.asarray(speed, dtype=np.float64))
    dry = np.maximum(load, 0.0) * fast
    slow = 1.0 - np.abs(np.asarray(sine, dtype=np.float64))
    return np.stack(np.broadcast_arrays(dry, dry * slow, np.sqrt(dry) * fast, fast * fast))


def mean_parts(parts: Callable[[Floats], Floats], period: float) -> Floats:
    """Cycle means of `friction_parts`, a function of the cylinder's angle [rad], shape (4, ...).

    Means are taken stroke by stroke with Gauss's points; the angle is stretched so that the roots
    of the piston's speed at dead centre do not matter.
    """
    node, weight = np.polynomial.legendre.leggauss(5)
    t = ((np.arange(PANELS)[:, None] + 0.5 * (node + 1.0)) / PANELS).reshape(-1)
    share = np.tile(0.5 * weight / PANELS, PANELS)
    place = t**3 * (10.0 + t * (6.0 * t - 15.0))
    stretch = 30.0 * (t * (1.0 - t)) ** 2
    total: Any = 0.0
    for stroke in range(round(period / math.pi)):
        total = total + parts((stroke + place) * math.pi) @ (share * stretch)
    means: Floats = total / round(period / math.pi)
    return means


@dataclass(frozen=True)
class FrictionShape:
    """How one cylinder's friction torque is spread over the crank angle; its cycle mean is 1.

    With u = |c/(r omega)| and the load on a ring N = ring_pressure + p - p_crankcase (0 where that
    is below 0: nothing presses a ring that is lifted), the torque of a friction force is force
    times u. The branches of the Stribeck curve give four forces, each
    scaled to the cycle mean of its share:

        boundary        N                    the coefficient of friction is constant,
        mixed           N (1 - |sin phi|)    it falls as speed builds up,
        hydrodynamic    sqrt(N u)            it grows like sqrt(u/N),
        skirt           u                    shear of a film of given thickness;

    after Rezeka and Henein (1984), as usually quoted;
    what is left of 1 is constant: bearings, valve gear, auxiliaries. Times the mean friction
    torque, the shape is the torque M_fr(phi), whose mean is unchanged whatever the shares.

    Attributes
    ----------
    boundary, mixed, hydrodynamic, skirt : float
        Shares of the mean friction [1], 0 or more, together at most 1.
    ring_pressure : float
        Pressure of the rings on the liner by their own tension [Pa].
    """

    boundary: float
    mixed: float
    hydrodynamic: float
    skirt: float
    ring_pressure: float

    def __post_init__(self) -> None:
        """Refuse shares that are none; ValueError names field, value and what is allowed."""
        for name in ("boundary", "mixed", "hydrodynamic", "skirt"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} = {getattr(self, name):g}: must be between 0 and 1")
        if self.rest < -1e-12:
            raise ValueError(
                "boundary + mixed + hydrodynamic + skirt = "
                f"{1.0 - self.rest:g}: must be at most 1 together"
            )
        if not 0.0 < self.ring_pressure < 100.0 * BAR:
            raise ValueError(
                f"ring_pressure = {self.ring_pressure / BAR:g} bar: must be between 0 and 100 bar"
            )

    @property
    def rest(self) -> float:
        """Share of the friction that is constant over the cycle."""
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
        return np.asarray(self.rest + np.tensordot(weights, parts, axes=1))

    def weights(self, crank_ratio: float, diagram: Diagram, crankcase_pressure: float) -> Floats:
        """Share over cycle mean of each of the four parts, shape (4,)."""
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
        return friction_parts(load, velocity(angle, crank_ratio), np.sin(angle))
