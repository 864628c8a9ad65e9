"""Sizing of a flywheel: rules, the triangular torque, the energy swing, and the exact inertia.

Sources are T. Asgari et al. (2019), section 3, methods 1 (eqs. 14 to 18) and 2 (eqs. 19 to 31), and
A. Kakaitsas (2015), sections 3.2.1 and 3.2.2. By the latter, the inertia of the flywheel is that
for the wanted delta less the inertia of engine and load.

Energy that the flywheel takes up over the angle, and its levels where torque and load cross.

The excess energy is the work of the torque less the load, both less their means, see
docs/torque_diagrams.md. Its extremes lie among the crossings of both, and its range is the energy
swing, from which textbooks size flywheels (Khurmi and Gupta, Theory of Machines, chapter 16).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.given_numbers import check_above_zero, given_array, given_number
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.types import Floats

RIM_SPEEDS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {"cast iron": (25.0, 30.0), "steel": (40.0, 45.0)}
)
"""Usual rim speed of each material [m/s], from and to. Asgari, eq. 14."""

DENSITIES: Mapping[str, float] = MappingProxyType({"cast iron": 7200.0, "steel": 7850.0})
"""Usual densities [kg/m3]: handbook values of grey cast iron and of steel."""

DIAMETER_OVER_STROKE = 2.0, 3.0  # Usual mean diameter over stroke, from and to. Asgari, eq. 16.

SHARE_OF_INERTIA = 0.8, 0.9
"""Usual inertia of the flywheel over that of all rotating parts, from and to. Asgari, eq. 18. The
paper says "without the flywheel", but computes 0.09/0.11 with it."""

ADMISSIBLE: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "pump": (1 / 30, 1 / 20),
        "generator": (1 / 300, 1 / 150),
        "ship": (1 / 10, 1 / 3),
        "idling vehicle": (1 / 6, 1 / 6),
        "road vehicle": (0.02, 0.03),
    }
)
"""Admissible coefficient of speed fluctuation of each application, from and to. Kakaitsas, section
3.2.1; road vehicle: Power units, lecture 18."""

VERDICTS = ("within", "below", "above")
"""Meanings of the numbers 0, 1 and 2 of a verdict on a value and its usual range."""


# --- the shaft beside the flywheel ----------------------------------------------------------------


def inertia_behind(inertia: Any, in_front: Any) -> Any:
    """Inertia on the flywheel's side of a cut through the shaft [kg m2]: all less that in front.

    Parameters
    ----------
    inertia : array_like
        Inertia of engine, flywheel and load at the crank [kg m2].
    in_front : array_like
        Inertia of the running gear, as its cycle mean, and of the auxiliaries [kg m2].

    Returns
    -------
    ndarray
        NaN where the running gear alone has more than all of it, which no engine has.

    Examples
    --------
    >>> round(float(inertia_behind(2.0, 0.25)), 6)
    1.75
    """
    rest = np.asarray(inertia, dtype=float) - in_front
    return np.where(rest >= 0.0, rest, np.nan)


def shaft_torque(load_torque: Any, inertia: Any, angular_acceleration: Any) -> Any:
    """Torque that a rigid shaft transmits to the flywheel [N m], positive where it drives it.

    Newton's law for flywheel and load, which turn with the crank: M_F = M_L + Theta_F eps, with
    eps the angular acceleration. By the equation of motion, docs/method.md (21) and (27), it equals
    the torque of the engine less what accelerates the inertia in front of the cut.

    Parameters
    ----------
    load_torque : array_like
        Torque of the load less that of a driver, both of which act behind the cut [N m].
    inertia : array_like
        Inertia of flywheel and load at the crank [kg m2].
    angular_acceleration : array_like
        [rad/s2].

    Examples
    --------
    >>> float(shaft_torque(100.0, 2.0, -30.0))
    40.0
    """
    return load_torque + inertia * angular_acceleration


# --- Asgari's method 1 ----------------------------------------------------------------------------


def verdict(value: Any, low: Any, high: Any) -> Any:
    """Whether values lie in a usual range: the numbers of `VERDICTS`, NaN where there is no value.

    The ends belong to the range. Asgari, eqs. 14, 16 and 18.

    Examples
    --------
    >>> verdict([42.4, 30.0, 50.0], 40.0, 45.0).tolist()
    [0.0, 1.0, 2.0]
    """
    value = np.asarray(value, dtype=float)
    verdicts = np.where(value < low, 1.0, np.where(value > high, 2.0, 0.0))
    return np.where(np.isnan(value), np.nan, verdicts)


def rim_speed(outer_diameter: Any, speed: Any) -> Any:
    """Speed of the rim [m/s] at a crank speed [rad/s]: pi D n/60 with n in rpm. Asgari, eq. 15.

    Raises
    ------
    ValueError
        Here and below: for a value that is not above 0.
    """
    check_above_zero(outer_diameter=outer_diameter, speed=speed)
    return 0.5 * np.asarray(outer_diameter) * speed


def largest_diameter(limit: Any, speed: Any) -> Any:
    """Outer diameter [m] at which the rim has its largest speed [m/s]. Asgari, eqs. 14, 15."""
    check_above_zero(limit=limit, speed=speed)
    return 2.0 * np.asarray(limit) / speed


def mean_diameter(outer_diameter: Any, inner_diameter: Any) -> Any:
    """Mean diameter of a ring [m]. Asgari, eq. 17."""
    _check_ring(outer_diameter, inner_diameter)
    return 0.5 * (np.asarray(outer_diameter) + inner_diameter)


class MethodOne(NamedTuple):
    """Results of Asgari's method 1.

    Attributes
    ----------
    rim_speed, mean_diameter, diameter_over_stroke, share_of_inertia : float
        [m/s], [m], [1], [1].
    speed_is_usual, diameter_is_usual, inertia_is_usual : bool
        Whether they lie in the ranges of eqs. 14, 16 and 18.
    """

    rim_speed: float
    mean_diameter: float
    diameter_over_stroke: float
    share_of_inertia: float
    speed_is_usual: bool
    diameter_is_usual: bool
    inertia_is_usual: bool


def method_one(
    *, outer_diameter: float, inner_diameter: float, stroke: float, speed: float,
    flywheel_inertia: float, inertia: float, material: str = "steel",
) -> MethodOne:  # fmt: skip
    """Check a flywheel by Asgari's method 1; lengths [m], crank speed [rad/s], inertia [kg m2].

    `inertia` is that of all rotating parts, the flywheel among them.

    Raises
    ------
    ValueError
        For an unknown material, diameters that make no ring, values that are not above 0.
    """
    if material not in RIM_SPEEDS:
        raise ValueError(f"material = {material!r}: must be one of {', '.join(RIM_SPEEDS)}")
    _check_ring(outer_diameter, inner_diameter)
    check_above_zero(stroke=stroke, speed=speed, flywheel_inertia=flywheel_inertia, inertia=inertia)
    rim = float(rim_speed(outer_diameter, speed))
    mean = float(mean_diameter(outer_diameter, inner_diameter))
    over, fraction = mean / stroke, flywheel_inertia / inertia
    low, high = RIM_SPEEDS[material]
    return MethodOne(
        rim, mean, over, fraction, low <= rim <= high,
        DIAMETER_OVER_STROKE[0] <= over <= DIAMETER_OVER_STROKE[1],
        SHARE_OF_INERTIA[0] <= fraction <= SHARE_OF_INERTIA[1],
    )  # fmt: skip


# --- Asgari's method 2 ----------------------------------------------------------------------------


class Triangle(NamedTuple):
    """The triangular torque: a triangle over the expansion, and 0 over the other strokes.

    Attributes
    ----------
    work : ndarray
        Work of a cycle [J]. Eqs. 20, 21.
    expansion_work : ndarray
        Work of the expansion [J], three halves of that of the cycle, because the compression takes
        a third of it. Eq. 24.
    torque_max : ndarray
        Height of the triangle over half a turn [N m]. Eq. 25.
    torque_mean : ndarray
        Mean torque over the cycle [N m]. Eq. 26.
    torque_excess : ndarray
        Largest torque less the mean [N m]. Eq. 27.
    base : ndarray
        Angle over which the torque is above the mean [rad]. Eq. 28.
    energy_swing : ndarray
        Area of the triangle above the mean [J]. Eq. 29.
    inertia : ndarray
        Inertia for the wanted fluctuation [kg m2]. Eq. 30.
    """

    work: Any
    expansion_work: Any
    torque_max: Any
    torque_mean: Any
    torque_excess: Any
    base: Any
    energy_swing: Any
    inertia: Any


def triangular_torque(
    power: Any, speed: Any, delta: Any, period: float = 4.0 * math.pi
) -> Triangle:
    """Estimate the inertia of one cylinder's flywheel from its power. Asgari, eqs. 19 to 30.

    Parameters
    ----------
    power : array_like
        [W].
    speed : array_like
        Speed of the crank [rad/s].
    delta : array_like
        Coefficient of speed fluctuation wanted.
    period : float
        Angle of the cycle [rad].

    Raises
    ------
    ValueError
        For a value that is not above 0.
    """
    check_above_zero(power=power, speed=speed, delta=delta, period=period)
    work = np.asarray(power) * period / speed
    expansion = 1.5 * work
    top, mean = 2.0 * expansion / math.pi, work / period
    excess = top - mean
    base = excess / top * math.pi
    swing = 0.5 * excess * base
    return Triangle(
        work, expansion, top, mean, excess, base, swing, energy_swing_inertia(swing, delta, speed)
    )


def energy_swing_inertia(energy_swing: Any, delta: Any, speed: Any) -> Any:
    """Inertia [kg m2] from the energy swing [J]: Delta W/(delta omega^2), docs/method.md (91).

    Asgari, eq. 30. It is exact in the limit of small delta, where the load torque does not follow
    the fluctuation of the speed, and where mean and nominal speed are equal.
    """
    check_above_zero(delta=delta, speed=speed)
    return given_array("energy_swing", energy_swing) / (
        np.asarray(delta) * np.square(np.asarray(speed, float))
    )


# --- flywheel as a ring ---------------------------------------------------------------------------


def ring_mass(inertia: Any, outer_diameter: Any, inner_diameter: Any) -> Any:
    """Mass of a ring [kg] with that inertia [kg m2]: 2 I/(R_1^2 + R_2^2). Asgari, eq. 31.

    Raises
    ------
    ValueError
        For diameters that make no ring.
    """
    _check_ring(outer_diameter, inner_diameter)
    square = np.square(np.asarray(outer_diameter, float)) + np.square(np.asarray(inner_diameter))
    return 8.0 * given_array("inertia", inertia) / square


def ring_inertia(mass: Any, outer_diameter: Any, inner_diameter: Any) -> Any:
    """Inertia of a ring [kg m2] about its axis. Asgari, eq. 31."""
    _check_ring(outer_diameter, inner_diameter)
    square = np.square(np.asarray(outer_diameter, float)) + np.square(np.asarray(inner_diameter))
    return given_array("mass", mass) * square / 8.0


def ring_thickness(mass: Any, outer_diameter: Any, inner_diameter: Any, density: Any) -> Any:
    """Thickness [m] of a ring of that mass [kg] and density [kg/m3] along the shaft.

    Raises
    ------
    ValueError
        For diameters that make no ring, a density that is not above 0.
    """
    _check_ring(outer_diameter, inner_diameter)
    check_above_zero(density=density)
    square = np.square(np.asarray(outer_diameter, float)) - np.square(np.asarray(inner_diameter))
    return given_array("mass", mass) / (np.asarray(density) * 0.25 * math.pi * square)


# --- flywheel as a thin rim -----------------------------------------------------------------------


def rim_speed_at_stress(stress: Any, density: Any) -> Any:
    """Speed of a thin rim [m/s] with that hoop stress [Pa]: sqrt(sigma/rho). Khurmi, chapter 16.

    Raises
    ------
    ValueError
        Here and below: for a stress, density, diameter or ratio that is not above 0.
    """
    check_above_zero(stress=stress, density=density)
    return np.sqrt(np.asarray(stress) / density)


def rim_stress(mean_diameter: Any, speed: Any, density: Any) -> Any:
    """Hoop stress [Pa] of a thin rim that turns freely [rad/s]: rho v^2, arms left out."""
    check_above_zero(mean_diameter=mean_diameter, speed=speed, density=density)
    return density * np.square(0.5 * np.asarray(mean_diameter) * speed)


def rim_mass(inertia: Any, mean_diameter: Any) -> Any:
    """Mass [kg] of a thin rim of that inertia [kg m2]: I/(D/2)^2."""
    check_above_zero(mean_diameter=mean_diameter)
    return 4.0 * given_array("inertia", inertia) / np.square(np.asarray(mean_diameter, float))


def rim_thickness(mass: Any, mean_diameter: Any, density: Any, width_over_thickness: Any) -> Any:
    """Radial thickness [m] of a rectangular rim, whose section is m/(pi D rho).

    NaN where it is not below the mean diameter, which no rim has.
    """
    check_above_zero(
        mean_diameter=mean_diameter, density=density, width_over_thickness=width_over_thickness
    )
    section = given_array("mass", mass) / (math.pi * np.asarray(mean_diameter) * density)
    with np.errstate(invalid="ignore"):  # the mass is negative where no rim is needed
        thickness = np.sqrt(section / width_over_thickness)
    return np.where(thickness < mean_diameter, thickness, np.nan)


def _check_ring(outer: Any, inner: Any) -> None:
    wide, narrow = np.broadcast_arrays(
        given_array("flywheel_outer_diameter", outer), given_array("flywheel_inner_diameter", inner)
    )
    wrong = ~((narrow >= 0.0) & (wide > narrow) & np.isfinite(wide))
    if wrong.any():
        raise ValueError(
            f"flywheel_outer_diameter = {wide[wrong].flat[0]:g} m with flywheel_inner_diameter = "
            f"{narrow[wrong].flat[0]:g} m: the outer must be larger than the inner"
        )


# --- the exact inertia ----------------------------------------------------------------------------


@dataclass(frozen=True)
class RequiredInertia:
    """The inertia that gives a wanted delta, and estimates of it.

    Attributes
    ----------
    inertia : float
        Inertia of the whole engine with its load [kg m2].
    delta : float
        Coefficient of speed fluctuation with that inertia.
    energy_swing : float
        Range of the work of the torque, less a load over angle and the mean [J].
    by_energy_swing, by_triangle : float
        Estimates [kg m2]; that by the triangle is NaN without brake power.
    status : int
        Code of `engine_dyn.status`: 0, or 5 where delta misses the wanted one by more than the
        tolerance, as it does by rounding for the smallest delta.
    """

    inertia: float
    delta: float
    energy_swing: float
    by_energy_swing: float
    by_triangle: float
    status: int

    @property
    def energy_swing_error(self) -> float:
        """Relative error of the estimate by the energy swing."""
        return self.by_energy_swing / self.inertia - 1.0


def required_inertia(diagram: Diagram, wanted_delta: float, **engine: Any) -> RequiredInertia:
    """Find the inertia of one engine that gives a wanted coefficient of speed fluctuation.

    Parameters
    ----------
    diagram : Diagram
        Absolute cylinder pressure over the cycle.
    wanted_delta : float
        Coefficient of speed fluctuation.
    **engine
        As `engine_dyn.periodic_speed`, without `inertia`.

    Raises
    ------
    ValueError
        Where no inertia gives it, with what the lightest engine that runs has; for values outside
        their range.
    """
    # These imports load the kernels, which the other functions of this module do not need.
    from engine_dyn.speed.api import energy_swing, periodic_speed
    from engine_dyn.speed.required import search
    from engine_dyn.status import MEANINGS, has_numbers

    wanted_delta = given_number("wanted_delta", wanted_delta)
    check_above_zero(wanted_delta=wanted_delta)
    if "inertia" in engine:
        raise ValueError("inertia: not allowed together with wanted_delta, which determines it")

    def outcome(_: Any, inertia: Any) -> tuple[Any, Any]:
        one = periodic_speed(diagram, inertia=float(inertia[0]), **engine)
        return np.array([one.delta]), np.array([one.status], dtype=np.int8)

    speed = given_number("speed", engine["speed"])
    tolerance = given_number("tolerance", engine.get("tolerance", 1e-6))
    of_torque = {name: value for name, value in engine.items() if name in {
        "bore", "stroke", "crank_ratio", "reciprocating_mass", "speed", "cylinders", "offset",
        "firing_angles", "pressure_factor", "mass_factor", "radius_factor", "bore_factor",
        "diagrams", "crankcase_pressure", "friction_shape", "friction_torque", "tolerance",
        "driven", "gear_ratio", "load_phase", "load_scale",
    }}  # fmt: skip
    swing = energy_swing(diagram, **of_torque)
    estimate = float(energy_swing_inertia(swing, wanted_delta, speed))
    outcomes = search(outcome, np.array([estimate]), np.array([wanted_delta]), tolerance)
    code = int(outcomes.status[0])
    if not has_numbers(code):
        reason = f"the periodic speed has the outcome '{MEANINGS[code]}'"
        if np.isfinite(outcomes.lightest[0]):
            reason = (
                f"the lightest engine that runs has delta = {outcomes.largest[0]:.4g}, with "
                f"{outcomes.lightest[0]:.4g} kg m2"
            )
        raise ValueError(f"wanted_delta = {wanted_delta:g}: no inertia gives it; {reason}")
    inertia = float(outcomes.inertia[0])
    solved = periodic_speed(diagram, inertia=inertia, **engine)
    power = solved.torque_mean * speed
    triangle = math.nan
    if power > 0.0:
        triangle = float(triangular_torque(power, speed, wanted_delta, diagram.period).inertia)
    return RequiredInertia(inertia, solved.delta, swing, estimate, triangle, code)


MOST_CROSSINGS = 64  # Largest number of crossings of torque and load reported for a design


def net_torque(torque: Any, load: Any) -> Floats:
    """Torque less load, without the mean, along the last axis [N m]."""
    net = np.asarray(torque, dtype=float) - np.asarray(load, dtype=float)
    return np.ascontiguousarray(net - net.mean(axis=-1, keepdims=True))


def excess_energy(net: Floats, step: float) -> Floats:
    """Integral over the angle of a torque without mean, itself without mean [J].

    `net` has equal steps [rad] of one period along its last axis. By the harmonics of the samples.

    Examples
    --------
    >>> angle = np.arange(0.0, 2.0 * np.pi, np.pi / 4)
    >>> excess_energy(np.cos(3 * angle), np.pi / 4).max().round(6)
    np.float64(0.333333)
    """
    samples = net.shape[-1]
    order = 2.0 * np.pi * np.fft.rfftfreq(samples, step)
    waves = np.fft.rfft(net, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        waves = np.where(order > 0.0, waves / (1j * order), 0.0)
    if samples % 2 == 0:
        waves[..., -1] = 0.0  # samples do not determine the phase of the highest order
    return np.asarray(np.fft.irfft(waves, samples, axis=-1))


def crossings(net: Floats, first: float, step: float) -> tuple[Floats, Floats]:
    """Angles [rad] at which torque and load cross, and the excess energy there [J].

    Parameters
    ----------
    net : ndarray, shape (..., angle)
        As of `excess_energy`.
    first, step : float
        First angle, and the step to the next [rad].

    Returns
    -------
    angle, energy : ndarray, shape (..., MOST_CROSSINGS)
        In the order of the angles; NaN behind the last. Cubics through four samples.
    """
    rows = net.reshape(-1, net.shape[-1])
    energy = excess_energy(rows, step)
    above = rows > 0.0
    changes = above != np.roll(above, -1, axis=1)
    wide = min(MOST_CROSSINGS, rows.shape[1])
    place = np.argsort(~changes, axis=1, kind="stable")[:, :wide]
    a, b, c, d = (
        np.take_along_axis(np.roll(rows, -shift, axis=1), place, axis=1) for shift in (-1, 0, 1, 2)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        t = b / (b - c)
        # Newton steps after a linear interpolation leave only the polynomial's own error.
        for _ in range(3):
            # The cubic passes through a, b, c, d at -1, 0, 1, 2.
            linear, square = c - a / 3.0 - b / 2.0 - d / 6.0, (a + c) / 2.0 - b
            cube = (d - a) / 6.0 + (b - c) / 2.0
            value = b + t * (linear + t * (square + t * cube))
            t = np.clip(t - value / (linear + t * (2.0 * square + 3.0 * t * cube)), 0.0, 1.0)
    e0, e1 = (
        np.take_along_axis(np.roll(energy, -shift, axis=1), place, axis=1) for shift in (0, 1)
    )
    m0, m1 = step * b, step * c
    level = e0 + t * (m0 + t * (3.0 * (e1 - e0) - 2.0 * m0 - m1 + t * (2.0 * (e0 - e1) + m0 + m1)))
    known = np.take_along_axis(changes, place, axis=1)
    places = np.full((2, len(rows), MOST_CROSSINGS), np.nan)
    places[0, :, :wide] = np.where(known, first + step * (place + t), np.nan)
    places[1, :, :wide] = np.where(known, level, np.nan)
    angle, at = places.reshape(2, *net.shape[:-1], MOST_CROSSINGS)
    return angle, at
