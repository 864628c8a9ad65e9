"""Fit one free pressure curve of the NTUA engine to all of Kakaitsas's rows at 50 % load.

Is there one curve that gives all rows? What the engine `ntua` gives for most of them is a
prediction; the pressure of `ntua_all_rows`, which is written here, is a fit. The curve is the
modelled one plus a periodic cubic spline with a knot every 10 degrees, found by least squares: each
printed number (`aims`) has the tolerance that its digits leave, and the correction is held small
(`allowed`) and smooth (`ROUGHNESS`).

Run it from the project's root after tools/calibrate_ntua.py: `python tools/fit_ntua_rows.py`. It is
deterministic and writes the table of points beside `ntua_all_rows.toml`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from calibrate_ntua import central_differences, one_pass, targets, torque
from pages import csv_text
from scipy.interpolate import CubicSpline
from thesis_study import (
    TORQUES,
    diagram_of,
    printed,
    printed_rows,
    range_of,
    range_of_delta,
    thesis_scene,
)

from engine_dyn import Diagram, diagram_from_points
from engine_dyn.types import Floats
from engine_dyn.units import BAR, DEGREE, RPM
from sweeps.scene.engine.engine_files import catalogue

LOAD = 50
POINTS = catalogue()["ntua_all_rows"].with_name("ntua_all_rows_pressure.csv")

KNOTS = np.arange(-360.0, 360.0, 10.0)
"""Crank angles [degree] at which the correction has a value of its own."""

ROUGHNESS = 0.005
"""Usual second derivative of the correction [bar/degree^2]. With 0.003 the row of four cylinders
stays 0.18 % off, with 0.01 the expansion gets a second wave; between them little changes."""

BLOW_DOWN = (130.0, 200.0)
"""Crank angles [degree] between which the pressure depends on unknown valves."""

CYLINDERS = (1, 2, 4, 6, 8)
SHARP = 0.2
"""Width [N m] within which two extremes that tie both count, so that steps do not jump."""

STEPS = 14


def allowed(pressure: Floats) -> Floats:
    """Usual size of the correction [bar] at the knots: 5 % of the pressure, 1 bar at blow-down."""
    first, last = BLOW_DOWN
    return np.where((first <= KNOTS) & (last >= KNOTS), 1.0, 0.05 * pressure)


def designs() -> list[dict[str, Any]]:
    """Designs of the scene `thesis` at this load."""
    columns = thesis_scene()["designs"]
    rows = (dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True))
    return [row for row in rows if row["load"] == LOAD]


def aims() -> list[tuple[str, float, float]]:
    """Names of the printed numbers, their values, and how far off they may be.

    A quarter of what the printed digits leave, or 0.02 % for extremes of the torque.
    """
    found = []
    for row in designs():
        case = row["case"]
        low, high = range_of_delta(printed_rows()[case])
        aim = printed(case, "delta")
        found.append((f"delta, {case}", aim, max(0.25 * (high - low), 2e-5 * aim)))
    for count in CYLINDERS:
        case = "nominal" if count == 1 else f"{count} cylinders"
        for quantity in TORQUES:
            low, high = range_of(printed_rows()[case][quantity])
            aim = printed(case, quantity)
            found.append((f"{quantity}, {case}", aim, max(0.25 * (high - low), 2e-4 * aim)))
    goals = targets()[LOAD]
    for name, place, tolerance in (("p_max", 0, 0.002), ("p_min", 5, 0.01), ("mean", 1, 0.05)):
        found.append((name, float(goals[place]), tolerance))
    return found


def computed(diagram: Diagram, sharp: float = SHARP) -> Floats:
    """The same numbers of a diagram; `sharp` = 0 takes extremes as they are."""
    names = ("cylinders", "crank_ratio", "reciprocating_mass", "inertia", "load_exponent", "passes",
             "start_speed")  # fmt: skip
    found = [
        one_pass(
            diagram,
            speed=row["speed"] * RPM,
            start_angle=row["start_angle"] * DEGREE,
            **{name: row[name] for name in names},
        ).delta
        for row in designs()
    ]
    for count in CYLINDERS:
        total = torque(diagram, count, 6.67)
        highest, lowest = _largest(total, sharp), -_largest(-total, sharp)
        found += [highest / float(total.mean()), highest - lowest]
    mean = float(torque(diagram, 1, 6.67).mean())
    return np.array([*found, diagram.peak / BAR, diagram.pressure.min() / BAR, mean])


def _largest(values: Floats, sharp: float) -> float:
    """Largest value; values within `sharp` of it count as well (logarithm of a sum)."""
    top = float(values.max())
    if sharp == 0.0:
        return top
    return top + sharp * math.log(float(np.exp((values - top) / sharp).sum()))


def splines(degrees: Floats) -> Floats:
    """Values of the periodic spline that is 1 at one knot and 0 at the others, by columns."""
    ends = np.append(KNOTS, 360.0)
    units = np.vstack([np.eye(len(KNOTS)), np.eye(len(KNOTS))[:1]])
    return np.asarray(CubicSpline(ends, units, bc_type="periodic")(degrees), dtype=np.float64)


def fit() -> tuple[Floats, Floats, Floats]:
    """Find the correction that gives the rows.

    Gauss-Newton steps; of the curves that they pass, the one with the least sum of squares counts,
    because the largest torque of two cylinders changes from one crest to another.

    Returns
    -------
    degrees : ndarray
    pressure, correction : ndarray
        In bar.
    """
    base = diagram_of("ntua")
    degrees = np.rad2deg(base.angle)
    own = base.pressure / BAR
    shapes = splines(degrees)
    step = KNOTS[1] - KNOTS[0]
    identity = np.eye(len(KNOTS))
    second = np.roll(identity, 1, 1) - 2.0 * identity + np.roll(identity, -1, 1)
    size = np.diag(1.0 / allowed(np.interp(KNOTS, degrees, own)))
    prior = np.vstack([second / step**2 / ROUGHNESS, size])
    _, wanted, tolerances = (np.array(column) for column in zip(*aims(), strict=True))

    def figures(values: Floats) -> Floats:
        return computed(diagram_from_points(base.angle, (own + shapes @ values) * BAR))

    values = np.zeros(len(KNOTS))
    best, least = values, math.inf
    for number in range(STEPS):
        off = (figures(values) - wanted) / tolerances
        squares = float(np.sum((prior @ values) ** 2) + np.sum(off**2))
        if squares < least:
            best, least = values, squares
        jacobian = central_differences(figures, values) / tolerances[:, None]
        found = np.linalg.lstsq(
            np.vstack([prior, jacobian]), -np.concatenate([prior @ values, off]), rcond=None
        )[0]
        values = values + (1.0 if number < 2 else 0.5) * found
    correction = shapes @ best
    return degrees, own + correction, correction


HEAD = """\
# Cylinder pressure of the engine ntua_all_rows. Written by tools/fit_ntua_rows.py; change that.
# Not measured and not printed: the modelled cycle of ntua at 50 % load plus a correction that is
# fitted to Kakaitsas's rows at that load (see the script and docs/validation.md).
"""


def main() -> None:
    degrees, pressure, correction = fit()
    points = [(f"{a:.1f}", f"{p:.5f}") for a, p in zip(degrees, pressure, strict=True)]
    text = HEAD + csv_text([("crank_angle_deg", "pressure_bar"), *points])
    POINTS.write_text(text, encoding="utf-8")
    diagram = diagram_from_points(np.deg2rad(degrees), np.round(pressure, 5) * BAR)
    before, after = computed(diagram_of("ntua"), 0.0), computed(diagram, 0.0)
    for (name, aim, _), own, found in zip(aims(), before, after, strict=True):
        print(
            f"{name:32s} printed {aim:11.5f}  ntua {100 * (own / aim - 1):+7.3f} %"
            f"  fitted {100 * (found / aim - 1):+7.3f} %"
        )
    print(f"correction from {correction.min():+.3f} to {correction.max():+.3f} bar")


if __name__ == "__main__":
    main()
