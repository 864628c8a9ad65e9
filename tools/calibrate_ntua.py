"""Calibrate the modelled indicator diagrams of the NTUA engine and write its catalogue file.

Kakaitsas (2015) measured the diagrams but prints none. The modelled cycle is fitted to the few
figures that the thesis prints (`measure_50`, `measure_0`, `measure_90`); zero mean torque at idle
is an inference. Everything else in its tables is a prediction. As found by reproducing the thesis,
its torques hold the absolute pressure on the piston, omega_n is cut to 0.1 rad/s, and a row of one
cylinder is one pass of explicit Euler at 1 degree from bottom dead centre: the fit does the same.

Of all parameters that meet the figures, those are taken that lie closest to what is usual (value
and spread in tools/ntua_usual.csv), closest in the sum of squares of deviation over spread. The
figures are met exactly; docs/validation.md says what that leaves open.

Run it from the project's root: `python tools/calibrate_ntua.py`. It is deterministic; the fitted
numbers are rounded to 6 decimals, but for the heat at 0 % load, which makes the mean torque at idle
exactly zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pages import csv_rows, with_numbers
from thesis_study import CUT_SPEED, SPEEDS, other_numbers, printed

from engine_dyn import Diagram, diagram_from_points, family_from_diagrams, periodic_speed
from engine_dyn.forces.superposition import CrankTrain
from engine_dyn.forces.torque import GasPressure, gas_torque, inertia_torque
from engine_dyn.geometry.masses import reciprocating_mass
from engine_dyn.loads import friction
from engine_dyn.pressure.diesel_cycle import FILE_UNITS, DieselCycle
from engine_dyn.speed.api import PeriodicSpeed
from engine_dyn.types import Floats
from engine_dyn.units import BAR, RPM
from sweeps.scene.engine.engine_files import catalogue, load_engine

Parameters = dict[str, float]
Usual = Mapping[str, tuple[float, float]]
Measure = Callable[[Diagram], Floats]

PERIOD = 4.0 * math.pi
STEP = 0.5  # degree between points of the tabulated diagrams
DECIMALS = 6

OWN = load_engine("ntua").values
"""Values of the thesis's engine: Kakaitsas, Table 4.1 and section 4.1; friction by (3.9)."""

OMEGA = OWN["speed"] * RPM
MASS = float(
    reciprocating_mass(
        OWN["piston_mass"],
        OWN["rod_mass"],
        OWN["rod_centre_of_gravity"],
        0.5 * OWN["stroke"] / OWN["crank_ratio"],
    )
)
"""Reciprocating mass [kg], 6.67 in the thesis."""

DISPLACEMENT = 0.25 * math.pi * OWN["bore"] ** 2 * OWN["stroke"]

# Parameters that are not varied: otherwise the figures would leave even more open.
FIXED: Parameters = {
    "crank_ratio": OWN["crank_ratio"],
    "premixed_form": 2.0,
    "valve_ramp": 40.0,
    "valve_lag": 8.0,
}
USUAL = csv_rows(Path(__file__).with_name("ntua_usual.csv"))
"""Usual values and spreads of the varied parameters."""


def friction_of(diagram: Diagram, speed: float = OMEGA) -> float:
    """Friction torque [N m] of a cylinder with a diagram's p_max, (3.8) and (3.9)."""
    fmep = friction.friction_mean_effective_pressure(
        OWN["friction_constant"] * BAR,
        OWN["friction_peak_pressure"],
        OWN["friction_mean_piston_speed"] * BAR,
        diagram.peak,
        friction.mean_piston_speed(OWN["stroke"], speed),
    )
    return float(friction.friction_torque(fmep, DISPLACEMENT, PERIOD))


def peak_pressure(torque: float) -> float:
    """Solve (3.8) and (3.9) for p_max [bar] of a friction torque [N m] at 1200 rpm."""
    moving = OWN["friction_mean_piston_speed"] * friction.mean_piston_speed(OWN["stroke"], OMEGA)
    fmep = torque * PERIOD / DISPLACEMENT / BAR
    return float((fmep - OWN["friction_constant"] - moving) / OWN["friction_peak_pressure"])


def one_pass(diagram: Diagram, **changes: Any) -> PeriodicSpeed:
    """Return the speed as the thesis computes it: one pass from the cut omega_n at BDC.

    `changes` are other keywords of `periodic_speed`.
    """
    given: dict[str, Any] = {
        "speed": OMEGA,
        "cylinders": 1,
        "crank_ratio": OWN["crank_ratio"],
        "reciprocating_mass": MASS,
        "inertia": OWN["inertia"],
        "load_exponent": OWN["load_exponent"],
        "passes": 1,
        "start_speed": CUT_SPEED,
        "start_angle": -math.pi,
        **changes,
    }
    return periodic_speed(
        diagram,
        bore=OWN["bore"],
        stroke=OWN["stroke"],
        friction_torque=given["cylinders"] * friction_of(diagram, given["speed"]),
        crankcase_pressure=0.0,
        method="thesis",
        **given,
    )


def torque(diagram: Diagram, cylinders: int = 1, mass: float = MASS) -> Floats:
    """Total torque [N m] at 1 degree, 1200 rpm, absolute pressure on the piston."""
    phi = np.deg2rad(np.arange(-360.0, 360.0))
    family = family_from_diagrams([0.0], [diagram])
    train = CrankTrain(OWN["crank_ratio"], OWN["stroke"], cylinders, PERIOD)
    gas = gas_torque(phi, train, OWN["bore"], GasPressure(family, 0.0, 1.0, 0.0))
    inertia = inertia_torque(phi, train, mass, OMEGA)
    return np.asarray(gas + inertia - cylinders * friction_of(diagram), dtype=np.float64)


def diagram_of(parameters: Mapping[str, float]) -> Diagram:
    """Make the diagram of parameters in file units, as an engine file's reader does."""
    values = {n: parameters[n] * size for n, (_, size) in FILE_UNITS.items() if n in parameters}
    return diagram_from_points(*DieselCycle(**values).points(STEP))


def measure_50(diagram: Diagram) -> Floats:
    """Figures of the fit at 50 % load: bar, N m, N m, N m, rad/s, bar."""
    total, speed = torque(diagram), one_pass(diagram)
    return np.array(
        [
            diagram.peak / BAR,
            speed.torque_mean,
            total.max(),
            total.max() - total.min(),
            speed.omega_max - speed.omega_min,
            diagram.pressure.min() / BAR,
        ]
    )


def measure_0(diagram: Diagram) -> Floats:
    """Figures of the fit at 0 % load: bar, N m, rad/s three times."""
    # On its way to zero the mean torque may be negative, and no load k omega^2 balances that.
    speed = one_pass(diagram, load_offset=one_pass(diagram).torque_mean)
    omegas = [speed.omega_max, speed.omega_min, speed.omega_mean]
    return np.array([diagram.peak / BAR, speed.torque_mean, *omegas])


def measure_90(diagram: Diagram) -> Floats:
    """Figures of the fit at 90 % load: bar, rad/s three times."""
    speed = one_pass(diagram)
    return np.array([diagram.peak / BAR, speed.omega_max, speed.omega_min, speed.omega_mean])


MEASURES: dict[int, Measure] = {50: measure_50, 0: measure_0, 90: measure_90}


def targets() -> dict[int, Floats]:
    """Return the printed figures in the order of the measures."""
    other = other_numbers()
    p_max = {load: peak_pressure(other[f"friction_torque_{load}"]) for load in MEASURES}
    mean = other["load_coefficient"] * CUT_SPEED**2
    # Section 5.2.5 has the smallest speed with one digit more than the tables.
    swing = printed("nominal", "omega_max") - other["omega_min"]
    largest, span = (printed("nominal", name) for name in ("torque_ratio", "torque_range"))
    lowest = p_max[50] / other["pressure_ratio"]
    idle, most = ([printed(f"load {load}", name) for name in SPEEDS] for load in (0, 90))
    return {
        50: np.array([p_max[50], mean, largest * mean, span, swing, lowest]),
        0: np.array([p_max[0], 0.0, *idle]),
        90: np.array([p_max[90], *most]),
    }


def together(usual: Usual, fixed: Mapping[str, float], place: Floats) -> Parameters:
    """Parameters at a place measured in spreads from the usual values."""
    found = dict(fixed)
    for (name, (value, spread)), units in zip(usual.items(), place, strict=True):
        found[name] = value + spread * float(units)
    # Both parts of the combustion start at the same angle.
    found["diffusion_start"] = found["premixed_start"]
    return found


def central_differences(figures: Callable[[Floats], Floats], place: Floats) -> Floats:
    """Change of each figure per unit of each parameter."""
    half = 1e-3
    columns = [
        (figures(place + half * unit) - figures(place - half * unit)) / (2.0 * half)
        for unit in np.eye(len(place))
    ]
    return np.stack(columns, axis=1)


def closest(
    usual: Usual, fixed: Mapping[str, float], measure: Measure, target: Floats
) -> tuple[Parameters, Floats]:
    """Find the parameters closest to the usual ones that meet the figures.

    Least |z| subject to F(z) = target, z in spreads: with the Jacobian J of F, each step takes the
    point of least norm on the linearised constraints, J z' = J z - (F - target). Its fixed point
    meets the figures with z in the row space of J, which is Lagrange's condition.

    Returned are the parameters, and the deviation of each varied one in spreads.

    Raises
    ------
    RuntimeError
        If it does not converge.
    """

    def off(at: Floats) -> Floats:
        return measure(diagram_of(together(usual, fixed, at))) - target

    place = np.zeros(len(usual))
    for _ in range(80):
        here, jacobian = off(place), central_differences(off, place)
        step = np.linalg.lstsq(jacobian, jacobian @ place - here, rcond=None)[0] - place
        largest = float(np.abs(step).max())
        place = place + min(1.0, 0.7 / max(largest, 1e-12)) * step
        if largest < 1e-8:
            return together(usual, fixed, place), place
    raise RuntimeError("the fit does not converge")


def varied_and_fixed(load: int, own: Mapping[str, float]) -> tuple[Usual, Mapping[str, float]]:
    """Say what is varied at a load, and what is held; `own` are the parameters found at 50 %."""
    if load == 50:
        return {r["parameter"]: (float(r["usual"]), float(r["spread"])) for r in USUAL}, FIXED
    usual = {
        r["parameter"]: (float(r[f"usual at {load}"] or own[r["parameter"]]), float(spread))
        for r in USUAL
        if (spread := r["spread with load"])
    }
    return usual, {name: value for name, value in own.items() if name not in usual}


def rounded(parameters: Mapping[str, float]) -> Parameters:
    """Parameters to the decimals of the file; the crank ratio is the engine's own."""
    found = {name: round(value, DECIMALS) for name, value in parameters.items()}
    found["crank_ratio"] = OWN["crank_ratio"]
    return found


def with_no_torque(parameters: Mapping[str, float]) -> Parameters:
    """Change the heat until the mean torque is zero to rounding (secant method)."""
    found = dict(parameters)

    def mean(heat: float) -> float:
        return one_pass(diagram_of({**found, "heat": heat})).torque_mean

    before, heat = found["heat"], found["heat"] * (1.0 + 1e-6)
    mean_before, mean_here = mean(before), mean(heat)
    for _ in range(20):
        if abs(mean_here) < 1e-12 or mean_here == mean_before:
            break
        before, heat = heat, heat - mean_here * (heat - before) / (mean_here - mean_before)
        mean_before, mean_here = mean_here, mean(heat)
    found["heat"] = heat
    return found


def calibrate() -> dict[int, Parameters]:
    """Parameters of the cycle in file units for each load [percent]; prints what they meet."""
    found: dict[int, Parameters] = {}
    for load, measure in MEASURES.items():
        usual, fixed = varied_and_fixed(load, found.get(50, {}))
        exact, place = closest(usual, fixed, measure, targets()[load])
        found[load] = rounded(exact) if load else with_no_torque(rounded(exact))
        print(f"{load} % load, fitted:")
        for pair in zip(targets()[load], measure(diagram_of(found[load])), strict=True):
            print("  printed {:12.5f}  fitted {:12.5f}".format(*pair))
        for (name, (value, spread)), units in zip(usual.items(), place, strict=True):
            print(
                f"  {name:21s} {found[load][name]:12.6f} {FILE_UNITS[name][0]:7s}"
                f" usual {value:9.4f} +- {spread:g}: {units:+.2f} spreads"
            )
    return found


def engine_file(found: Mapping[int, Parameters]) -> str:
    """Text of the catalogue file with these parameters in full precision."""
    head, *parts = catalogue()["ntua"].read_text(encoding="utf-8").split("[[diagram]]\n")
    made = [
        with_numbers(part, {key: repr(value) for key, value in found[load].items()})
        for load, part in zip(sorted(found), parts, strict=True)
    ]
    return "[[diagram]]\n".join([head, *made])


if __name__ == "__main__":
    text = engine_file(calibrate())
    catalogue()["ntua"].write_text(text, encoding="utf-8")
