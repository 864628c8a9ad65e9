"""Friction of the engine: mean effective pressure, mean torque, its shape over the crank angle.

Friction torque is positive and subtracted. A motored engine has the friction that its motored
diagram gives: `friction_mean_effective_pressure` with that diagram's p_max. Functions of components
take SI values, as numbers or arrays that broadcast, and give a mean effective pressure [Pa]. Their
law was fitted to warm spark-ignition car engines of the 1980s with oil of 10W-30, at some 1000 to
6000 rpm, and holds no pumping work; it is printed, with constants as here, in kPa, mm, rpm and m/s.

Sources
-------
Chen and Flynn, SAE paper 650733, 1965: mean effective pressure over p_max and piston speed.
Heywood, Internal Combustion Engine Fundamentals, McGraw-Hill 1988, ch. 13: regimes of lubrication,
friction as a sum of parts that grow with no, the first and the second power of speed. Rezeka and
Henein, SAE paper 840179, 1984: instantaneous friction of rings and skirt (forms as they are
usually quoted; the paper itself was not compared).

K. J. Patton, R. C. Nitschke and J. B. Heywood, Development and evaluation of a friction model for
spark-ignition engines, SAE paper 890836, 1989 (not seen): components of four-stroke engines. The
equations and constants were compared in three independent transcriptions, which agree: those of two
programs after D. Sandoval, An improved friction model for spark ignition engines, thesis, MIT 2002,
equations 7.a to 11 and table 4.2, and that of a third program.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from engine_dyn.geometry.slider_crank import velocity
from engine_dyn.given_numbers import given_number
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.types import Floats
from engine_dyn.units import BAR, RPM

PANELS = 180  # Number of intervals of a stroke over which means are taken


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
    """

    # Friction levels [Pa], one for each part of `FrictionShape`.
    boundary: Any
    mixed: Any
    hydrodynamic: Any
    skirt: Any
    ring: Any  # Pressure of the piston rings on the liner by their own tension

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
    return np.asarray(total / round(period / math.pi))


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
        """Torques of the four parts of friction, not scaled, shape (4, ...)."""
        angle = np.asarray(phi, dtype=np.float64)
        load = self.ring_pressure + diagram(angle) - crankcase_pressure
        return stacked_parts(load, velocity(angle, crank_ratio), np.sin(angle))


KILOPASCAL = 1e3

MM = 1e3  # Millimetres in a metre
ATMOSPHERE = 1.01325 * BAR  # Atmospheric pressure to which the intake pressure is related [Pa]

BOUNDARY_SPEED = 1000.0
"""Speed at which mixed-lubrication friction is twice that of a fast engine [rpm]."""


class ValveTrain(NamedTuple):
    """Constants of a kind of valve train, in kPa, mm and rpm."""

    number: int  # Number of the valve train in files
    flat: float  # Friction constant of a flat follower on the cam [kPa mm]; 0 for a roller
    roller: float  # Friction constant of a roller follower [kPa mm/rpm]; 0 for a flat one
    # Friction constants of the oscillating parts: in oil [kPa mm^0.5/rpm^0.5], and in mixed
    # lubrication [kPa].
    hydrodynamic: float
    mixed: float


VALVE_TRAINS: Mapping[str, ValveTrain] = MappingProxyType(
    {
        "ohv": ValveTrain(1, 400.0, 0.0, 0.5, 32.1),
        "sohc_finger_follower": ValveTrain(2, 600.0, 0.0, 0.2, 42.8),
        "sohc_rocker_arm": ValveTrain(3, 400.0, 0.0, 0.5, 21.4),
        "sohc_direct_acting": ValveTrain(4, 200.0, 0.0, 0.5, 10.7),
        "dohc_finger_follower": ValveTrain(5, 600.0, 0.0, 0.2, 25.8),
        "dohc_direct_acting": ValveTrain(6, 133.0, 0.0, 0.5, 10.7),
        "dohc_roller_finger_follower": ValveTrain(7, 0.0, 0.0227, 0.2, 25.8),
    }
)
"""Kinds of valve trains: one camshaft in the block (OHV), one in the head (SOHC) or two (DOHC).

Sandoval's table 4.2. Rollers of other kinds are left out: their constants are in one transcription
alone, or are misprinted.
"""


def _swept(bore: Any, stroke: Any, cylinders: Any) -> Any:
    """Bore squared times stroke, times the number of cylinders [mm3]."""
    return (MM * bore) ** 2 * (MM * stroke) * cylinders


def _mixed_lubrication(speed: Any) -> Any:
    """Factor of mixed lubrication over the speed: 1 + 1000/N."""
    return 1.0 + BOUNDARY_SPEED * RPM / speed


def crankshaft_seals(bore: Any, stroke: Any, cylinders: Any, journal_diameter: Any) -> Any:
    """Seals of the crankshaft: 1.22e5 D_b/(B^2 S n_c) kPa.

    docs/method.md (33). `bore`, `stroke` and `journal_diameter` (of a main journal) in [m];
    `cylinders` is their number.
    """
    return KILOPASCAL * 1.22e5 * (MM * journal_diameter) / _swept(bore, stroke, cylinders)


def _journal_bearings(
    bore: Any, stroke: Any, cylinders: Any, speed: Any, diameter: Any, width: Any, number: Any
) -> Any:
    """Oil films of journals: 3.03e-4 N D^3 L n/(B^2 S n_c) kPa."""
    across = MM * diameter
    sheared = (speed / RPM) * across * across * across * (MM * width) * number
    return KILOPASCAL * 3.03e-4 * sheared / _swept(bore, stroke, cylinders)


def main_bearings(
    bore: Any, stroke: Any, cylinders: Any, speed: Any, journal_diameter: Any, journal_width: Any,
    bearings: Any,
) -> Any:  # fmt: skip
    """Main bearings: films, and the oil that is pumped and churned (1.35e-10 D_b^2 N^2 n_b/n_c).

    docs/method.md (33). `speed` [rad/s]; `journal_diameter` and `journal_width` of a main journal
    [m]; `bearings` is the number of main bearings. The width is that of the bearing.

    Examples
    --------
    >>> from engine_dyn.units import RPM
    >>> round(main_bearings(0.1, 0.1, 1, 1000 * RPM, 0.05, 0.02, 2), 1)
    2190.7
    """
    turbulent = 1.35e-10 * (MM * journal_diameter) ** 2 * (speed / RPM) ** 2 * bearings / cylinders
    films = _journal_bearings(
        bore, stroke, cylinders, speed, journal_diameter, journal_width, bearings
    )
    return films + KILOPASCAL * turbulent


def crank_pin_bearings(
    bore: Any, stroke: Any, cylinders: Any, speed: Any, pin_diameter: Any, pin_width: Any
) -> Any:
    """Bearings of the rods on the crank pins, one for each cylinder: as films of main bearings.

    docs/method.md (34). `pin_diameter` [m]; `pin_width` is the width of one rod's bearing [m].
    """
    return _journal_bearings(bore, stroke, cylinders, speed, pin_diameter, pin_width, cylinders)


def skirt(bore: Any, piston_speed: Any) -> Any:
    """Skirts of the pistons: 294 S_p/B kPa.

    docs/method.md (34). `piston_speed` is the mean piston speed [m/s].
    """
    return KILOPASCAL * 294.0 * piston_speed / (MM * bore)


def rings(bore: Any, speed: Any) -> Any:
    """Piston rings by their own tension: 4.06e4 (1 + 1000/N)/B^2 kPa.

    docs/method.md (34). `speed` of the crank [rad/s].
    """
    return KILOPASCAL * 4.06e4 * _mixed_lubrication(speed) / (MM * bore) ** 2


def ring_gas_pressure(compression_ratio: Any, piston_speed: Any, intake_ratio: Any = 1.0) -> Any:
    """Piston rings, what gas adds: 6.89 (p_i/p_a) [0.088 r + 0.182 r^(1.33 - 0.0238 S_p)] kPa.

    docs/method.md (35). `compression_ratio` r [1], `piston_speed` [m/s], `intake_ratio` is the
    pressure of the intake over that of the atmosphere [1].
    """
    exponent = 1.33 - 2.38e-2 * piston_speed
    loading = 0.088 * compression_ratio + 0.182 * compression_ratio**exponent
    return KILOPASCAL * 6.89 * intake_ratio * loading


def valve_train(
    bore: Any, stroke: Any, cylinders: Any, speed: Any, kind: Any, lift: Any, valves: Any,
    camshaft_bearings: Any,
) -> Any:  # fmt: skip
    """Valve train: bearings and seals of the camshafts, followers, valves and what moves them.

    docs/method.md (36).

    Parameters
    ----------
    bore, stroke : array_like
        [m].
    cylinders : array_like
        Their number.
    speed : array_like
        Speed of the crank [rad/s].
    kind : array_like of int
        Number of a kind in `VALVE_TRAINS`.
    lift : array_like
        Largest lift of a valve [m].
    valves : array_like
        Number of valves of one cylinder.
    camshaft_bearings : array_like
        Number of bearings of all camshafts.
    """
    number = np.clip(np.nan_to_num(np.asarray(kind, dtype=float)), 1, len(VALVE_TRAINS))
    # The numbers of the kinds begin at 1, their rows of constants at 0.
    flat, roller, hydrodynamic, mixed = np.moveaxis(
        np.array([train[1:] for train in VALVE_TRAINS.values()])[number.astype(int) - 1], -1, 0
    )
    turns, high = speed / RPM, MM * lift
    camshafts = 244.0 * turns * camshaft_bearings / _swept(bore, stroke, cylinders) + 4.12
    followers = flat * _mixed_lubrication(speed) + roller * turns
    in_oil = hydrodynamic * high**1.5 * np.sqrt(turns) / (MM * bore)
    of_valves = (
        (followers + in_oil + mixed * _mixed_lubrication(speed) * high) * valves / (MM * stroke)
    )
    return KILOPASCAL * (camshafts + of_valves)


def auxiliaries(speed: Any) -> Any:
    """Oil pump, water pump and an alternator that does not charge, 6.23 + 5.22e-3 N - 1.79e-7 N^2.

    docs/method.md (37). `speed` of the crank [rad/s]; the law is printed in kPa.
    """
    turns = speed / RPM
    return KILOPASCAL * (6.23 + 5.22e-3 * turns - 1.79e-7 * turns**2)
