"""The periodic crank speed of one design, through the same kernels as a sweep."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from engine_dyn import status
from engine_dyn.forces.torque import piston_area
from engine_dyn.geometry.arrangement import Arrangement, Cylinder, Throw
from engine_dyn.geometry.cylinders import Cylinders, cylinders_of, even_cylinders
from engine_dyn.geometry.slider_crank import crank_radius_of_ratio
from engine_dyn.loads.driven_machine import (
    NOTHING_DRIVEN,
    DrivenMachine,
    constant_load,
    motor_torque,
    repeats_of,
)
from engine_dyn.loads.friction import FrictionShape
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.pressure.family import Family, family_from_diagrams
from engine_dyn.speed import dispatch
from engine_dyn.speed.fields import FRICTION_NAMES
from engine_dyn.speed.mean_gas import mean_gas_torque
from engine_dyn.speed.methods import CLOSURES, INERTIA_MODELS, METHOD_NAMES
from engine_dyn.speed.results import SCALAR_NAMES
from engine_dyn.speed.torque import torque_extremes
from engine_dyn.types import Floats

__all__ = ["PeriodicSpeed", "energy_swing", "periodic_speed"]


@dataclass(frozen=True, eq=False)
class PeriodicSpeed:
    """Periodic crank speed of one design, SI units.

    Attributes
    ----------
    status : int
        Outcome, see `engine_dyn.status`; numbers are NaN for 1 to 4.
    delta : float
        Coefficient of speed fluctuation, (omega_max - omega_min)/omega_mean.
    delta_error : float
        Its estimated relative error, or that of `omega_min` where it is more.
    omega_max, omega_min, omega_mean : float
        Largest, smallest and mean (over crank angle) crank speed [rad/s].
    torque_mean : float
        Mean torque of the engine [N m].
    load_coefficient : float
        k of the load law a + k omega^alpha [N m s^alpha]; the factor on a load's table over speed;
        0 where a driver drives.
    driver_factor : float
        Factor on the driver's torque; 0 without one.
    iterations : int
        Cycles marched, or sweeps of the iteration.
    crank_angle, omega : ndarray
        Angles [rad] and the speed there [rad/s]; empty unless asked for.
    """

    status: int
    delta: float
    delta_error: float
    omega_max: float
    omega_min: float
    omega_mean: float
    torque_mean: float
    load_coefficient: float
    driver_factor: float
    iterations: int
    crank_angle: Floats
    omega: Floats


@lru_cache(maxsize=8)
def _family_of(diagram: Diagram) -> Family:
    """Family of one diagram, kept because a search asks for the same one again and again."""
    return family_from_diagrams([0.0], [diagram])


@lru_cache(maxsize=64)
def _mean_gas(diagram: Diagram, crank_ratio: float, offset: float, factor: float) -> float:
    """Mean gas torque of a cylinder, kept because many have the same and searches ask again."""
    return float(mean_gas_torque(crank_ratio, 0.0, _family_of(diagram), offset, factor))


def periodic_speed(
    diagram: Diagram,
    *,
    bore: float,
    stroke: float,
    crank_ratio: float,
    reciprocating_mass: float,
    inertia: float,
    speed: float,
    cylinders: int = 1,
    offset: float = 0.0,
    firing_angles: Sequence[float] | None = None,
    pressure_factor: Sequence[float] | None = None,
    mass_factor: Sequence[float] | None = None,
    radius_factor: Sequence[float] | None = None,
    friction_shape: FrictionShape | None = None,
    load_exponent: float = 2.0,
    load_offset: float = 0.0,
    friction_torque: float = 0.0,
    driven: DrivenMachine = NOTHING_DRIVEN,
    gear_ratio: float = 1.0,
    load_phase: float = 0.0,
    load_scale: float = 1.0,
    synchronous_speed: float | None = None,
    breakdown_slip: float | None = None,
    breakdown_torque: float = 1.0,
    crankcase_pressure: float = 101325.0,
    inertia_model: str = "constant",
    method: str = "auto",
    closure: str = "power_mean",
    tolerance: float = 1e-6,
    passes: int | None = None,
    start_speed: float | None = None,
    start_angle: float = -np.pi,
    crank_angle: npt.ArrayLike | None = None,
) -> PeriodicSpeed:
    """Find the periodic crank speed of one engine.

    Parameters
    ----------
    diagram : Diagram
        Absolute cylinder pressure over the cycle, see `diagram_from_points`.
    bore, stroke : float
        [m].
    crank_ratio : float
        Crank radius over rod length, in (0, 1).
    reciprocating_mass : float
        Per cylinder [kg].
    inertia : float
        Whole engine with its load [kg m2]; its cycle mean where `inertia_model` is "variable".
    speed : float
        Nominal crank speed [rad/s].
    cylinders : int
        How many; firing evenly unless `firing_angles` are given.
    offset : float
        Of the piston pin's line from the crank's axis [m], positive towards the side on which the
        crank pin goes down; with it, `stroke` is more than two crank radii.
    firing_angles : sequence of float, optional
        Crank angle at which each cylinder fires [rad], the first 0.
    pressure_factor, mass_factor : sequence of float, optional
        One a cylinder: f in p_motored + f (p - p_motored), see `pressure.motored`, and the factor
        on its reciprocating mass.
    radius_factor : sequence of float, optional
        Crank radius of each cylinder over the first's; their rods are equally long.
    friction_shape : FrictionShape, optional
        How the friction torque is spread over the stroke; constant over the cycle unless given.
    load_exponent, load_offset : float
        alpha and a [N m] of the load torque a + k omega^alpha.
    friction_torque : float
        Mean, positive, whole engine [N m].
    driven : DrivenMachine
        Load over angle, load over speed in place of omega^alpha, or a driver.
    gear_ratio, load_phase, load_scale : float
        Of a load over its own angle or speed: its speed over the crank's; its angle at firing dead
        centre [rad]; factor on a load over any angle.
    synchronous_speed, breakdown_slip, breakdown_torque : float, optional
        Of a driver that is an induction motor: [rad/s] of the crank, [1] and [N m] at the crank.
    crankcase_pressure : float
        Absolute [Pa].
    inertia_model : {"constant", "variable"}
        Theta and inertia torque at nominal speed (Kakaitsas 2015, eq. 3.1), or the exact equation
        of one degree of freedom (Eksergian).
    method : {"auto", "thesis", "picard", "newton", "closed"}
        "auto" takes the cheapest that meets the tolerance.
    closure : {"power_mean", "cycle_time"}
        What the nominal speed is: the power mean of order alpha of omega over angle, or the angle
        of a cycle over its time.
    tolerance : float
        Relative error of delta aimed at.
    passes, start_speed, start_angle
        For "thesis" and "picard": cycles to march (until closed if not given), from which speed
        [rad/s] (nominal if not given), at which angle [rad].
    crank_angle : array_like, optional
        Angles [rad] at which omega is wanted.

    Returns
    -------
    PeriodicSpeed

    Raises
    ------
    ValueError
        For a choice that does not exist or a value outside its physical range; a design that has
        no answer is no error but a status.
    """
    for name, value, known in (
        ("inertia_model", inertia_model, INERTIA_MODELS),
        ("method", method, METHOD_NAMES),
        ("closure", closure, CLOSURES),
    ):
        if value not in known:
            raise ValueError(f"{name} = {value!r}: must be one of {', '.join(known)}")
    positive = {"bore": bore, "stroke": stroke, "inertia": inertia, "speed": speed,
                "tolerance": tolerance}  # fmt: skip
    for name, number in positive.items():
        if not 0.0 < number < np.inf:
            raise ValueError(f"{name} = {number:g}: must be a positive number")
    for name, number in {
        "reciprocating_mass": reciprocating_mass, "load_exponent": load_exponent,
        "crankcase_pressure": crankcase_pressure,
    }.items():  # fmt: skip
        if not 0.0 <= number < np.inf:
            raise ValueError(f"{name} = {number:g}: must be zero or a positive number")
    if not 0.0 < crank_ratio < 1.0:
        raise ValueError(f"crank_ratio = {crank_ratio:g}: must lie between 0 and 1, both excluded")
    if cylinders != int(cylinders) or cylinders < 1:
        raise ValueError(f"cylinders = {cylinders}: must be a whole number from 1 on")
    if passes is not None and (passes != int(passes) or passes < 1):
        raise ValueError(f"passes = {passes}: must be a whole number from 1 on")
    if start_speed is not None and not 0.0 < start_speed < np.inf:
        raise ValueError(f"start_speed = {start_speed:g}: must be a positive number")
    if not math.isfinite(start_angle):
        raise ValueError(f"start_angle = {start_angle:g}: must be a finite number")
    if not all(map(math.isfinite, (load_offset, friction_torque, offset))):
        raise ValueError("load_offset, friction_torque and offset must be finite numbers")
    if closure == "cycle_time" and method in ("thesis", "picard"):
        raise ValueError(f"closure cycle_time: method {method} cannot solve for the load")

    if driven.motor:
        for name, given in (
            ("synchronous_speed", synchronous_speed), ("breakdown_slip", breakdown_slip),
            ("breakdown_torque", breakdown_torque),
        ):  # fmt: skip
            if given is None or not 0.0 < given < np.inf:
                raise ValueError(f"{name} = {given}: must be a positive number")
    gear = _gear(driven, gear_ratio, diagram.period)
    family = _family_of(diagram)
    engine = _cylinders(
        cylinders, diagram.period, firing_angles, pressure_factor, mass_factor, radius_factor
    )
    double_radius = 2.0 * float(crank_radius_of_ratio(stroke, crank_ratio, offset))
    offset_ratio = offset / (0.5 * double_radius)
    engine.check_turning(crank_ratio, offset_ratio)
    means = []
    for member in engine.members[:1] if engine.equal else engine.members:
        own = map(float, member.own(crank_ratio, offset_ratio))
        means.append(member.radius_factor * _mean_gas(diagram, *own, member.pressure_factor))
    mean_gas = sum(means) / len(means)
    lever = float(piston_area(bore)) * 0.5 * double_radius
    torque_mean = cylinders * lever * mean_gas - friction_torque
    angles = np.zeros(0) if crank_angle is None else np.asarray(crank_angle, dtype=float).ravel()
    constant = load_offset
    if driven.over_angle is not None:
        constant = constant_load(load_offset, driven.over_angle, gear, load_scale)
    result = dispatch.solve(
        family=family,
        driven=driven,
        gear_ratio=gear,
        load_phase=load_phase,
        load_scale=load_scale,
        synchronous_speed=synchronous_speed or 1.0,
        breakdown_slip=breakdown_slip or 1.0,
        wanted=(*SCALAR_NAMES, *(("omega",) if angles.size else ())),
        method=method,
        inertia_model=inertia_model,
        closure=closure,
        tolerance=tolerance,
        cylinders=cylinders,
        cylinders_by_count={cylinders: engine},
        crank_angle=angles,
        threads=1,
        crank_ratio=crank_ratio,
        row=0.0,
        scale=1.0,
        crankcase_pressure=crankcase_pressure,
        offset_ratio=offset_ratio,
        bore=bore,
        double_radius=double_radius,
        mass=reciprocating_mass,
        speed=speed,
        inertia=inertia,
        exponent=load_exponent,
        offset=constant,
        mean_torque=torque_mean,
        friction_torque=friction_torque,
        **_friction_levels(friction_shape, friction_torque, cylinders * lever),
        start_speed=0.0 if start_speed is None else start_speed,
        passes=0.0 if passes is None else float(passes),
        start_angle=start_angle,
    )
    code = int(result["status"])
    steps = float(result["iterations"])
    with np.errstate(over="ignore"):  # of huge exponents: k tends to zero
        shape = float(np.power(speed, load_exponent))
    if driven.over_speed is not None:
        shape = gear * float(driven.over_speed(gear * speed))
    elif driven.motor:
        shape = float(motor_torque(speed, synchronous_speed, breakdown_slip, breakdown_torque))
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = float(np.float64(float(result["load_factor"]) * (torque_mean - constant)) / shape)
    return PeriodicSpeed(
        status=code,
        delta=float(result["delta"]),
        delta_error=float(result["delta_error"]),
        omega_max=float(result["omega_max"]),
        omega_min=float(result["omega_min"]),
        omega_mean=float(result["omega_mean"]),
        torque_mean=torque_mean,
        load_coefficient=0.0 if driven.has_driver else factor,
        driver_factor=-factor if driven.has_driver else 0.0,
        iterations=int(steps) if status.has_numbers(code) else 0,
        crank_angle=angles,
        omega=result["omega"].reshape(-1) if angles.size else np.zeros(0),
    )


def energy_swing(
    diagram: Diagram,
    *,
    bore: float,
    stroke: float,
    crank_ratio: float,
    reciprocating_mass: float,
    speed: float,
    cylinders: int = 1,
    offset: float = 0.0,
    firing_angles: Sequence[float] | None = None,
    pressure_factor: Sequence[float] | None = None,
    mass_factor: Sequence[float] | None = None,
    radius_factor: Sequence[float] | None = None,
    driven: DrivenMachine = NOTHING_DRIVEN,
    gear_ratio: float = 1.0,
    load_phase: float = 0.0,
    load_scale: float = 1.0,
    friction_shape: FrictionShape | None = None,
    crankcase_pressure: float = 101325.0,
    friction_torque: float = 0.0,
    tolerance: float = 1e-6,
) -> float:
    """Range of the work of the torque at nominal speed, less a load over angle and the mean [J].

    Parameters as `periodic_speed`; friction has a part in it only where `friction_shape` says how
    it changes over the stroke.

    Raises
    ------
    ValueError
        For a friction torque that is not finite, an engine whose throws cannot turn, and a load
        that does not repeat with the cycle.
    """
    if not np.isfinite(friction_torque):
        raise ValueError(f"friction_torque = {friction_torque:g}: must be a finite number")
    double_radius = 2.0 * float(crank_radius_of_ratio(stroke, crank_ratio, offset))
    engine = _cylinders(
        cylinders, diagram.period, firing_angles, pressure_factor, mass_factor, radius_factor
    )
    engine.check_turning(crank_ratio, offset / (0.5 * double_radius))
    found = torque_extremes(
        family=_family_of(diagram),
        wanted=("energy_swing",),
        driven=driven,
        gear_ratio=_gear(driven, gear_ratio, diagram.period),
        load_phase=load_phase,
        load_scale=load_scale,
        cylinders=cylinders,
        cylinders_by_count={cylinders: engine},
        tolerance=tolerance,
        threads=1,
        crank_ratio=crank_ratio,
        row=0.0,
        scale=1.0,
        crankcase_pressure=crankcase_pressure,
        offset_ratio=offset / (0.5 * double_radius),
        bore=bore,
        double_radius=double_radius,
        mass=reciprocating_mass,
        speed=speed,
        friction_torque=friction_torque,
        **_friction_levels(
            friction_shape,
            friction_torque,
            cylinders * float(piston_area(bore)) * 0.5 * double_radius,
        ),
    )
    return float(found["energy_swing"])


def _friction_levels(
    shape: FrictionShape | None, friction_torque: float, lever: float
) -> dict[str, float]:
    """Inputs of a sweep that spread the friction over the stroke [Pa]; `lever` of all cylinders."""
    if shape is None:
        return {}
    shares = (shape.boundary, shape.mixed, shape.hydrodynamic, shape.skirt)
    level = friction_torque / lever
    levels = {n: s * level for n, s in zip(FRICTION_NAMES, shares, strict=False)}
    return {**levels, "ring_pressure": shape.ring_pressure}


def _gear(driven: DrivenMachine, gear_ratio: float, period: float) -> float:
    """Speed of a load's shaft over the crank's: 1 where the load is over the crank's own."""
    gear = gear_ratio if driven.geared else 1.0
    if not 0.0 < gear < np.inf:
        raise ValueError(f"gear_ratio = {gear:g}: must be a positive number")
    if driven.over_angle is not None:
        repeats_of(driven.over_angle, gear, period)  # refused where it does not repeat
    return gear


def _cylinders(count: int, period: float, *columns: Sequence[float] | None) -> Cylinders:
    """Cylinders with their firing angles and factors on pressure, mass and radius."""
    given = (None if column is None else tuple(map(float, column)) for column in columns)
    return _kept_cylinders(count, period, *given)


@lru_cache(maxsize=64)
def _kept_cylinders(
    count: int,
    period: float,
    firing_angles: tuple[float, ...] | None,
    pressure_factor: tuple[float, ...] | None,
    mass_factor: tuple[float, ...] | None,
    radius_factor: tuple[float, ...] | None,
) -> Cylinders:
    """As `_cylinders`, kept with what they know of themselves: searches ask again and again."""
    engine = even_cylinders(count, period)
    if firing_angles is not None:
        if len(firing_angles) != count:
            raise ValueError(
                f"firing_angles: {len(firing_angles)} values for {count} cylinders: must be one "
                "for each"
            )
        throws = tuple(Throw(-float(a), float(i)) for i, a in enumerate(firing_angles))
        each = tuple(Cylinder(i, 0, float(angle)) for i, angle in enumerate(firing_angles))
        engine = cylinders_of(Arrangement(period, throws, (0.0,), each, True))
    return engine.with_factors(pressure_factor, mass_factor, radius_factor)
