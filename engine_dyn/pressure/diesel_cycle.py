"""A modelled four-stroke diesel cycle: the indicator diagram of an engine that prints none.

One zone, first law with effective polytropic exponents, double Wiebe heat release, blow-down and
gas exchange as a relaxation to the pressures of the manifolds. Every transition is smooth, so that
a cubic spline through points at 0.5 degree follows the curve.

Sources
-------
Heywood, Internal Combustion Engine Fundamentals, McGraw-Hill 1988: first law, eq. 9.25; Wiebe
function, eq. 9.30. Wiebe, Brennverlauf und Kreisprozess von Verbrennungsmotoren, Verlag Technik
1970 (the function itself in his book of 1962). Watson, Pilley and Marzouk, SAE paper 800029, 1980:
diesel heat release as the sum of a premixed and a diffusion part. Miyamoto, Chikahisa, Murayama
and Sawyer, SAE paper 850107, 1985: both parts as Wiebe functions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike

from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.geometry.slider_crank import dead_centres, position, velocity
from engine_dyn.given_numbers import given_number
from engine_dyn.pressure.diagram import table_angles
from engine_dyn.pressure.file_fields import FileField, documented, file_units
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE

# Wiebe's constant for a duration that ends when 99.9 % have burnt (Heywood: a = 5 and 6.9 occur).
WIEBE = math.log(1000.0)

# Largest step of the integration. Its sixth-order error is below rounding, except in the step in
# which a combustion starts: some 1e-8 of the pressure there.
LARGEST_STEP = 0.125 * DEGREE
FILE_FIELDS: dict[str, FileField] = {
    "compression_ratio": FileField("1", 1.5, 40.0),
    "crank_ratio": FileField("1", 0.0, 1.0),
    "intake_pressure": FileField("bar", 0.0, 20.0),
    "exhaust_pressure": FileField("bar", 0.0, 20.0),
    "intake_loss": FileField("bar", 0.0, 10.0, ends=True),
    "exhaust_loss": FileField("bar", 0.0, 10.0, ends=True),
    "compression_exponent": FileField("1", 1.0, 5.0 / 3.0),
    "expansion_exponent": FileField("1", 1.0, 5.0 / 3.0),
    "heat": FileField("bar", 0.0, 200.0, ends=True),
    "premixed_share": FileField("1", 0.0, 1.0, ends=True),
    "premixed_start": FileField("degree", -90.0, 90.0),
    # A shorter combustion would fall between the integration points of a step.
    "premixed_duration": FileField("degree", 1.0, 180.0),
    # With an exponent below 1 the rate of heat release has a corner that no spline follows.
    "premixed_form": FileField("1", 1.0, 10.0, ends=True),
    "diffusion_start": FileField("degree", -90.0, 90.0),
    "diffusion_duration": FileField("degree", 1.0, 270.0),
    "diffusion_form": FileField("1", 1.0, 10.0, ends=True),
    "intake_closing": FileField("degree", -180.0, -45.0),
    "exhaust_opening": FileField("degree", 45.0, 180.0),
    "valve_ramp": FileField("degree", 0.0, 90.0),
    "valve_lag": FileField("degree", 0.5, 45.0),
    "offset_ratio": FileField("1", -10.0, 10.0),
}
"""Fields of the Diesel cycle in engine files."""

FILE_UNITS = file_units(FILE_FIELDS)
"""Unit in which an engine file gives each field, and its size in SI."""


@documented("diesel_cycle", FILE_FIELDS)
@dataclass(frozen=True)
class DieselCycle:
    """Parameters of the modelled cycle, in SI units and radians.

    The pressure p(phi) over crank angle solves

        p' = c (-n p V'/V + (n - 1) Q'/V) - (1 - c) (p - p_m) / valve_lag,

    where c(phi) is 1 while the valves are closed and 0 while one is open, with a smooth ramp
    between; the first bracket is the first law of one zone of ideal gas (Heywood eq. 9.25) with an
    effective exponent n(phi), which contains the heat loss and goes from its compression to its
    expansion value with the burnt fraction; the second lets the pressure relax to p_m, which the
    open manifold and the loss in its valve make: intake_pressure - intake_loss v^2 in the intake
    stroke and exhaust_pressure + exhaust_loss v^2 in the exhaust stroke, v being the piston's
    velocity over the crank pin's. Volumes are taken over the swept volume, so nothing depends on
    the bore.
    """

    compression_ratio: float  # Largest over smallest cylinder volume [1]
    crank_ratio: float  # Crank radius over rod length [1]
    # Absolute pressures of the intake and exhaust manifolds at the valves [Pa].
    intake_pressure: float
    exhaust_pressure: float
    # Pressure difference across an open valve while the piston is as fast as the crank pin [Pa].
    intake_loss: float
    exhaust_loss: float
    # Effective polytropic exponents of compression and expansion [1].
    compression_exponent: float
    expansion_exponent: float
    heat: float  # Heat released per cycle over the swept volume [Pa = J/m3]; 0 is a motored engine
    premixed_share: float  # Fraction of the heat that the premixed combustion releases, 0..1
    # Wiebe function of the premixed part: start [rad], duration to 99.9 % [rad] and form exponent m
    # [1]; the rate grows like (phi - start)^m.
    premixed_start: float
    premixed_duration: float
    premixed_form: float
    # Start, duration and form exponent of the diffusion part, as for the premixed part.
    diffusion_start: float
    diffusion_duration: float
    diffusion_form: float
    # Angle at which the intake is fully closed [rad, in the compression stroke], and at which the
    # exhaust begins to open [rad, in the expansion stroke].
    intake_closing: float
    exhaust_opening: float
    # Angle over which a valve closes or opens, and half the angle of the change from exhaust to
    # intake manifold around gas exchange dead centre [rad].
    valve_ramp: float
    # Angle in which the difference to the manifold pressure falls to 1/e with an open valve [rad].
    valve_lag: float
    # Offset of the piston pin's line over the crank radius [1]; 0 by default. With an offset,
    # speeds are taken over half the stroke.
    offset_ratio: float = 0.0

    def __post_init__(self) -> None:
        """Refuse values that are no cycle; ValueError names field, value and what is allowed."""
        for item in fields(self):
            value = given_number(item.name, getattr(self, item.name))
            if not math.isfinite(value):
                raise ValueError(f"{item.name} = {value}: must be a finite number")
        for name, field in FILE_FIELDS.items():
            if name in ("intake_loss", "exhaust_loss", "offset_ratio"):
                continue  # the limit of this field depends on other fields: it is checked below
            low, high, value = field.low * field.size, field.high * field.size, getattr(self, name)
            if not (low <= value <= high if field.ends else low < value < high):
                raise ValueError(self._refusal(name, field.allowed))
        if not self.crank_ratio * (1.0 + abs(self.offset_ratio)) < 1.0:
            raise ValueError(
                self._refusal(
                    "offset_ratio", "such that the crank turns: with the crank radius below the rod"
                )
            )
        for name, largest in (
            ("intake_loss", 0.5 * self.intake_pressure),
            ("exhaust_loss", 0.5 * self.exhaust_pressure),
        ):
            if not 0.0 <= getattr(self, name) <= largest:
                field = FILE_FIELDS[name]._replace(high=largest / FILE_FIELDS[name].size)
                raise ValueError(self._refusal(name, field.allowed))
        if self.intake_closing >= min(self.premixed_start, self.diffusion_start):
            raise ValueError(self._refusal("intake_closing", "before the combustion starts"))

    def _refusal(self, name: str, allowed: str) -> str:
        value, field = getattr(self, name), FILE_FIELDS[name]
        return f"{name} = {value / field.size:.6g}{field.words}: must be {allowed}"

    def motored(self) -> DieselCycle:
        """Return the cycle without combustion: no heat, no burnt gas to change the exponent."""
        return replace(self, heat=0.0, expansion_exponent=self.compression_exponent)

    def volume(self, phi: ArrayLike) -> Floats:
        """Cylinder volume over the swept volume [1] at crank angles [rad]."""
        travel = position(phi, self.crank_ratio, self.offset_ratio) / self._half_stroke
        return np.asarray(1.0 / (self.compression_ratio - 1.0) + 0.5 * travel, dtype=np.float64)

    @property
    def _half_stroke(self) -> float:
        """Half the stroke over the crank radius."""
        if self.offset_ratio == 0.0:
            return 1.0
        return float(dead_centres(self.crank_ratio, self.offset_ratio).stroke)

    def burnt_fraction(self, phi: ArrayLike) -> Floats:
        """Part of the heat released by each crank angle [rad, -pi..pi], 0..1 (double Wiebe)."""
        early, late, share = self._wiebe_arguments(np.asarray(phi, dtype=np.float64))
        fast = -np.expm1(-WIEBE * early ** (self.premixed_form + 1.0))
        slow = -np.expm1(-WIEBE * late ** (self.diffusion_form + 1.0))
        return np.asarray(share * fast + (1.0 - share) * slow, dtype=np.float64)

    def burning_rate(self, phi: ArrayLike) -> Floats:
        """Return the derivative of `burnt_fraction` [1/rad]."""
        early, late, share = self._wiebe_arguments(np.asarray(phi, dtype=np.float64))

        def rate(t: Floats, form: float, duration: float) -> Floats:
            peak = WIEBE * (form + 1.0) / duration
            return np.asarray(peak * t**form * np.exp(-WIEBE * t ** (form + 1.0)))

        fast = rate(early, self.premixed_form, self.premixed_duration)
        slow = rate(late, self.diffusion_form, self.diffusion_duration)
        return np.asarray(share * fast + (1.0 - share) * slow, dtype=np.float64)

    def exponent(self, phi: ArrayLike) -> Floats:
        """Effective polytropic exponent [1] at crank angles [rad, -pi..pi]."""
        change = self.expansion_exponent - self.compression_exponent
        return self.compression_exponent + change * self.burnt_fraction(phi)

    def closed(self, phi: ArrayLike) -> Floats:
        """1 where the valves are closed, 0 where one is open [rad, -pi..pi], smooth between."""
        angle = np.asarray(phi, dtype=np.float64)
        closing = _smooth_step((angle - self.intake_closing) / self.valve_ramp + 1.0)
        opening = _smooth_step((angle - self.exhaust_opening) / self.valve_ramp)
        return np.asarray(closing * (1.0 - opening), dtype=np.float64)

    def points(self, step_degrees: float = 0.5) -> tuple[Floats, Floats]:
        """Tabulate the cycle for a Diagram.

        The equation is linear in p, so it is integrated with its integrating factor, by Gauss's
        three points in steps of at most 0.125 degree; the periodic start follows in closed form.

        Parameters
        ----------
        step_degrees : float
            Step of the table [degree]; 720 must be a multiple of it. 0.5 by default.

        Returns
        -------
        angle, pressure : ndarray, shape (720 / step_degrees,)
            Crank angle [rad] from -2 pi, end excluded, and absolute pressure [Pa].

        Raises
        ------
        ValueError
            If the step does not divide the cycle or is over 10 degrees.
        """
        count = table_angles(FOUR_STROKE, step_degrees).size
        step = 4.0 * math.pi / count
        fine = math.ceil(step / LARGEST_STEP)
        h = step / fine
        # Start in the middle of the intake stroke, where the pressure is that of the manifold.
        first = -round(0.75 * count / 2.0)
        start = (first + np.arange(count * fine) / fine) * step
        nodes = start[:, None] + h * np.array([0.5 - _ROOT / 10.0, 0.5, 0.5 + _ROOT / 10.0])
        decay, source = self._coefficients(nodes)
        within = np.einsum("iq,pq->ip", h * decay, _GAUSS_INNER)
        factor = np.exp(np.einsum("iq,q->i", -h * decay, _GAUSS_WEIGHTS))
        # Contribution of the source at each Gauss node to the pressure at the interval's end.
        growth = np.exp(within) * factor[:, None] * source
        gain = np.einsum("iq,q->i", growth, h * _GAUSS_WEIGHTS)
        coarse_factor, coarse_gain = np.ones(count), np.zeros(count)
        for i in range(fine):
            coarse_factor *= factor[i::fine]
            coarse_gain = coarse_gain * factor[i::fine] + gain[i::fine]
        factors, gains = coarse_factor.tolist(), coarse_gain.tolist()
        whole, product = 0.0, 1.0
        for f, g in zip(factors, gains, strict=True):
            whole, product = whole * f + g, product * f
        p = whole / (1.0 - product)
        pressure = np.empty(count)
        for i, (f, g) in enumerate(zip(factors, gains, strict=True)):
            pressure[i] = p
            p = p * f + g
        # The table begins in the intake stroke: it is rotated to begin at -2 pi.
        angle = np.arange(-(count // 2), count - count // 2) * np.float64(step)
        return angle, np.roll(pressure, first + count // 2)

    def _wiebe_arguments(self, angle: Floats) -> tuple[Floats, Floats, float]:
        """Reduced times of both combustions, 0 before they start, and the share of the first."""
        early = np.maximum(angle - self.premixed_start, 0.0) / self.premixed_duration
        late = np.maximum(angle - self.diffusion_start, 0.0) / self.diffusion_duration
        # After four durations nothing is left to burn, and large powers would overflow.
        return np.minimum(early, 4.0), np.minimum(late, 4.0), self.premixed_share

    def _coefficients(self, phi: Floats) -> tuple[Floats, Floats]:
        """Coefficients of p' = -decay p + source at angles from -3/2 pi to 5/2 pi."""
        shut = self.closed(phi)
        volume = self.volume(phi)
        n = self.exponent(phi)
        reduced = velocity(phi, self.crank_ratio, self.offset_ratio) / self._half_stroke
        speed = np.asarray(reduced, dtype=np.float64)
        growth = 0.5 * speed
        change = _smooth_step(0.5 * ((phi - 2.0 * math.pi) / self.valve_ramp + 1.0))
        share = np.where(phi < 0.0, 1.0, change)
        intake = self.intake_pressure - self.intake_loss * speed**2
        exhaust = self.exhaust_pressure + self.exhaust_loss * speed**2
        manifold = exhaust + (intake - exhaust) * share
        decay = shut * n * growth / volume + (1.0 - shut) / self.valve_lag
        source = shut * (n - 1.0) * self.heat * self.burning_rate(phi) / volume
        source = source + (1.0 - shut) * manifold / self.valve_lag
        return decay, source


def _smooth_step(u: Floats) -> Floats:
    """Smooth step from 0 at u = 0 to 1 at u = 1, with two derivatives zero at both ends."""
    t = np.clip(u, 0.0, 1.0)
    return np.asarray(t**3 * (10.0 + t * (6.0 * t - 15.0)), dtype=np.float64)


# Gauss-Legendre on 0..1 with three nodes: nodes, weights, and the integrals of the quadratic
# through the nodes from 0 to each node (Butcher's table of the sixth-order Gauss method).
_ROOT = math.sqrt(15.0)
_GAUSS_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0
_GAUSS_INNER = np.array(
    [
        [5.0 / 36.0, 2.0 / 9.0 - _ROOT / 15.0, 5.0 / 36.0 - _ROOT / 30.0],
        [5.0 / 36.0 + _ROOT / 24.0, 2.0 / 9.0, 5.0 / 36.0 - _ROOT / 24.0],
        [5.0 / 36.0 + _ROOT / 30.0, 2.0 / 9.0 + _ROOT / 15.0, 5.0 / 36.0],
    ]
)
