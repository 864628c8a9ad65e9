"""The periodic crank speed of one design, and its energy swing, by the kernels of sweeps.

The keywords are checked and grouped in `engine_dyn.speed.keywords`.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from engine_dyn import status
from engine_dyn.given_numbers import given_array, given_number
from engine_dyn.loads.driven_machine import NOTHING_DRIVEN, DrivenMachine
from engine_dyn.loads.friction import FrictionShape
from engine_dyn.plausibility.judgement import ImplausibleWarning, implausible
from engine_dyn.plausibility.usual_ranges import MOST_DELTA
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.speed import dispatch
from engine_dyn.speed.fields import SCALAR_NAMES
from engine_dyn.speed.keywords import (
    LOAD_EXPONENT,
    CylinderGroup,
    Engine,
    Load,
    Solver,
    check_keywords,
    check_positive,
)
from engine_dyn.speed.torque import torque_extremes
from engine_dyn.types import Floats


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
        Its estimated relative error, or that of `omega_min` where it is larger.
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
        Number of cycles, or of passes of the iteration.
    crank_angle, omega : ndarray
        Angles [rad] and the speed there [rad/s]; empty unless asked for.

    Examples
    --------
    >>> import engine_dyn
    >>> import numpy as np
    >>> degrees = np.arange(-360, 360)
    >>> bar = 1.0 + 45.0 * np.exp(-(((degrees - 10) / 35) ** 2))
    >>> diagram = engine_dyn.diagram_from_points(np.radians(degrees), 1e5 * bar)
    >>> engine = {"bore": 0.1, "stroke": 0.12, "crank_ratio": 0.25, "reciprocating_mass": 1.5}
    >>> found = engine_dyn.periodic_speed(diagram, **engine, inertia=1.0, speed=150.0)
    >>> bool(found.omega_min < found.omega_mean < found.omega_max)
    True
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


def periodic_speed(
    diagram: Diagram, *, bore: float, stroke: float, crank_ratio: float, reciprocating_mass: float,
    inertia: float, speed: float, cylinders: int = 1, offset: float = 0.0,
    firing_angles: Sequence[float] | None = None, pressure_factor: Sequence[float] | None = None,
    mass_factor: Sequence[float] | None = None, radius_factor: Sequence[float] | None = None,
    bore_factor: Sequence[float] | None = None, diagrams: Mapping[int, Diagram] | None = None,
    firing_pattern: Sequence[float] | None = None,
    friction_shape: FrictionShape | None = None, load_exponent: float | None = None,
    load_linear: float = 0.0, load_square: float = 0.0, load_offset: float = 0.0,
    friction_torque: float = 0.0, driven: DrivenMachine = NOTHING_DRIVEN, gear_ratio: float = 1.0,
    load_phase: float = 0.0, load_scale: float = 1.0, synchronous_speed: float | None = None,
    breakdown_slip: float | None = None, breakdown_torque: float = 1.0,
    crankcase_pressure: float = 101325.0, inertia_model: str = "constant", method: str = "auto",
    closure: str = "power_mean", tolerance: float = 1e-6, passes: int | None = None,
    start_speed: float | None = None, start_angle: float = -np.pi,
    crank_angle: npt.ArrayLike | None = None,
) -> PeriodicSpeed:  # fmt: skip
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
        Crank angle at which each cylinder fires [rad], the first 0. Without them they fire evenly,
        in the customary order of in-line engines, such as 1-3-4-2; see docs/layouts.md.
    pressure_factor, mass_factor : sequence of float, optional
        One a cylinder, in the order of their numbers, whatever the order of firing: f in p_motored
        + f (p - p_motored), see `pressure.motored`, and the factor on its reciprocating mass.
    radius_factor : sequence of float, optional
        Crank radius of each cylinder over the first's; their rods are equally long.
    bore_factor : sequence of float, optional
        Bore of each cylinder over the first's, as of the stages of a compressor; `bore_N` of
        engine files over `bore`.
    diagrams : mapping of int to Diagram, optional
        Diagrams of single cylinders in place of `diagram`, by their numbers from 1; [[diagram]]
        with `cylinder` of engine files.
    firing_pattern : sequence of float, optional
        Which firings happen, in sequence and over as many cycles as it takes to repeat: see
        `Cylinders.with_pattern`. The speed then has the period of all these cycles.
    friction_shape : FrictionShape, optional
        How the friction torque is spread over the stroke; constant over the cycle unless given.
    load_exponent, load_offset : float
        alpha (2 unless given) and a [N m] of the load torque a + k omega^alpha.
    load_linear, load_square : float
        b [N m s] and c [N m s2] of the load torque a + k (b omega + c omega^2), in place of
        `load_exponent`: 0 or more; where one of them is more than 0, this law holds.
    friction_torque : float
        Mean, whole engine [N m], 0 or more: what drives is a driver or a negative `load_offset`.
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
    method : {"auto", "thesis", "newton", "closed"}
        "auto" takes the cheapest method that meets the tolerance.
    closure : {"power_mean", "cycle_time"}
        What the nominal speed is: the power mean of order alpha of omega over angle, or the angle
        of a cycle over its time; docs/method.md (64) and (66).
    tolerance : float
        Relative error of delta aimed at.
    passes, start_speed, start_angle
        For "thesis": the number of cycles (until the cycle closes if not given), the
        speed [rad/s] (nominal if not given) and the angle [rad] at which they start.
    crank_angle : array_like, optional
        Angles [rad] at which omega is wanted.

    Returns
    -------
    PeriodicSpeed

    Raises
    ------
    ValueError
        For a choice that does not exist or a value outside its physical range. A design without a
        solution is no error; its status says why.

    Warns
    -----
    ImplausibleWarning
        For values that engines do not have, which often are in another unit; see
        `engine_dyn.implausible`, which looks at arrays. Once where they are all meant so:
        ``warnings.simplefilter("ignore", engine_dyn.ImplausibleWarning)``.

    Examples
    --------
    >>> import engine_dyn
    >>> import numpy as np
    >>> degrees = [-360, -300, -240, -180, -135, -90, -60, -45, -30, -15, 0, 10, 20, 30, 45, 60]
    >>> bar = [1, 1, 1, 1, 1.2, 2.2, 4.3, 7.1, 14, 28, 48, 56, 46, 32, 18, 11]
    >>> degrees += [75, 90, 120, 150, 180, 240, 300]
    >>> bar += [7.5, 5.5, 3.6, 2.3, 1.2, 1, 1]
    >>> diagram = engine_dyn.diagram_from_points(np.radians(degrees), 1e5 * np.array(bar))
    >>> engine = {"bore": 0.1, "stroke": 0.12, "crank_ratio": 0.25, "reciprocating_mass": 1.5}
    >>> found = engine_dyn.periodic_speed(
    ...     diagram, **engine, inertia=1.0, speed=150.0, crank_angle=np.radians([0, 180])
    ... )
    >>> found.status
    0
    >>> round(found.delta, 3)
    0.037
    >>> found.omega.round(1)
    array([146.2, 151.7])

    Two cylinders, of which the second has a smaller bore and burns half as much:

    >>> weak = engine_dyn.diagram_from_points(np.radians(degrees), 0.5e5 * np.array(bar))
    >>> found = engine_dyn.periodic_speed(
    ...     diagram, **engine, inertia=1.0, speed=150.0, cylinders=2, bore_factor=[1.0, 0.9],
    ...     diagrams={2: weak},
    ... )
    >>> round(found.delta, 3)
    0.033
    """
    solver = Solver(inertia_model, method, closure, tolerance, passes, start_speed, start_angle)
    solver.check_names()
    inertia = given_number("inertia", inertia)
    check_keywords(inertia=inertia)
    load = Load(
        driven, LOAD_EXPONENT if load_exponent is None else load_exponent, load_offset, gear_ratio,
        load_phase, load_scale, synchronous_speed, breakdown_slip, breakdown_torque, load_linear,
        load_square,
    )  # fmt: skip
    if load.load_linear or load.load_square:
        if load_exponent is not None:
            raise ValueError(
                "load_exponent: not allowed together with load_linear or load_square; give one law"
            )
        load = replace(load, driven=replace(driven, load_law="linear_square"))
    engine = Engine(
        diagram, bore, stroke, crank_ratio, reciprocating_mass, speed, offset,
        CylinderGroup(cylinders, firing_angles, pressure_factor, mass_factor, radius_factor,
                      bore_factor, firing_pattern, diagrams),
        friction_shape, friction_torque, crankcase_pressure,
    )  # fmt: skip
    engine.check()
    load.check()
    solver.check()
    angles = np.zeros(0)
    if crank_angle is not None:
        angles = given_array("crank_angle", crank_angle, finite=True).ravel()
    unusual = implausible(
        diagram, driven=driven.has_driver, bore=engine.bore, stroke=engine.stroke,
        crank_ratio=engine.crank_ratio, reciprocating_mass=engine.reciprocating_mass,
        inertia=inertia, speed=engine.speed, cylinders=cylinders, offset=engine.offset,
        crankcase_pressure=engine.crankcase_pressure, friction_torque=engine.friction_torque,
        load_exponent=load.load_exponent, load_offset=load.load_offset,
        start_speed=solver.start_speed or 0.0,
    )  # fmt: skip
    for one in unusual:
        warnings.warn(str(one), ImplausibleWarning, stacklevel=2)
    solution = _solve(engine, load, solver, inertia, angles)
    if solution.delta > MOST_DELTA:
        warnings.warn(
            f"delta: coefficient of speed fluctuation is {solution.delta:.3g}; usual is 0 to "
            f"{MOST_DELTA:g}", ImplausibleWarning, stacklevel=2,
        )  # fmt: skip
    return solution


def _solve(
    engine: Engine, load: Load, solver: Solver, inertia: float, angles: Floats
) -> PeriodicSpeed:
    """Solve one design; the load coefficient follows from docs/method.md (52)."""
    driven, gear = load.driven, load.gear(engine.diagram.period)
    torque_mean, constant = engine.torque_mean, load.constant(gear)
    result = dispatch.solve(
        family=engine.family, driven=driven, method=solver.method,
        wanted=(*SCALAR_NAMES, "omega") if angles.size else SCALAR_NAMES,
        inertia_model=solver.inertia_model, closure=solver.closure, tolerance=solver.tolerance,
        cylinders=engine.group.cylinders,
        cylinders_by_count={engine.group.cylinders: engine.cylinders}, crank_angle=angles,
        threads=1, inertia=inertia, offset=constant, mean_torque=torque_mean, **engine.inputs(),
        **load.inputs(gear), **solver.inputs(),
    )  # fmt: skip
    scalars = {name: float(result[name]) for name in SCALAR_NAMES}
    code = int(result["status"])
    shape = load.torque_at_nominal(engine.speed, gear)
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = float(np.float64(scalars["load_factor"] * (torque_mean - constant)) / shape)
    return PeriodicSpeed(
        status=code,
        **{n: scalars[n] for n in ("delta", "delta_error", "omega_max", "omega_min", "omega_mean")},
        torque_mean=torque_mean,
        load_coefficient=0.0 if driven.has_driver else factor,
        driver_factor=-factor if driven.has_driver else 0.0,
        iterations=int(scalars["iterations"]) if status.has_numbers(code) else 0,
        crank_angle=angles,
        omega=result["omega"].reshape(-1) if angles.size else np.zeros(0),
    )


def energy_swing(
    diagram: Diagram, *, bore: float, stroke: float, crank_ratio: float, reciprocating_mass: float,
    speed: float, cylinders: int = 1, offset: float = 0.0,
    firing_angles: Sequence[float] | None = None, pressure_factor: Sequence[float] | None = None,
    mass_factor: Sequence[float] | None = None, radius_factor: Sequence[float] | None = None,
    bore_factor: Sequence[float] | None = None, diagrams: Mapping[int, Diagram] | None = None,
    driven: DrivenMachine = NOTHING_DRIVEN, gear_ratio: float = 1.0, load_phase: float = 0.0,
    load_scale: float = 1.0, friction_shape: FrictionShape | None = None,
    crankcase_pressure: float = 101325.0, friction_torque: float = 0.0, tolerance: float = 1e-6,
) -> float:  # fmt: skip
    """Range of the work of the torque at nominal speed, less a load over angle and the mean [J].

    Keywords mean the same, in the same units, as those of `periodic_speed` with their names.
    Friction matters only where `friction_shape` says how it changes over the stroke.

    Raises
    ------
    ValueError
        For a value outside its physical range, an engine whose throws cannot turn, and a load that
        does not repeat with the cycle.
    """
    engine = Engine(
        diagram, bore, stroke, crank_ratio, reciprocating_mass, speed, offset,
        CylinderGroup(cylinders, firing_angles, pressure_factor, mass_factor, radius_factor,
                      bore_factor, diagrams=diagrams),
        friction_shape, friction_torque, crankcase_pressure,
    )  # fmt: skip
    engine.check()
    tolerance = given_number("tolerance", tolerance)
    check_positive(tolerance=tolerance)
    load = Load(driven, gear_ratio=gear_ratio, load_phase=load_phase, load_scale=load_scale)
    torques = torque_extremes(
        family=engine.family, wanted=("energy_swing",), driven=driven, cylinders=cylinders,
        cylinders_by_count={cylinders: engine.cylinders}, tolerance=tolerance, threads=1,
        **engine.inputs(), **load.inputs(load.gear(diagram.period)),
    )  # fmt: skip
    return float(torques["energy_swing"])
