"""Smooth the digitised indicator diagram of the catalogue engine `diesel_105x137`.

Its file says why, and between which angles. A cubic smoothing spline goes through all points,
weighed with the error of each: that in pressure and that in angle times the slope of the spline,
added as squares. It is as stiff as these errors allow: the squares of the deviations, each over its
error, have the mean 1. Where the combustion raises the pressure the error is only that of rounding
to a step; outside, the points are held. A smoothing spline is a cubic between its points, so the
spline through the written points, which the engine uses, is the smoothing spline.

Run it from the project's root: `python tools/smooth_digitised.py`. It is deterministic.
"""

from __future__ import annotations

import math

import numpy as np
from pages import ROOT, csv_rows, csv_text, write
from scipy.interpolate import BSpline, make_smoothing_spline
from scipy.optimize import brentq

from engine_dyn.types import Booleans, Floats

ENGINES = ROOT / "sweeps" / "catalogue" / "engines"
DIGITISED = ENGINES / "diesel_105x137_digitised.csv"
SMOOTHED = ENGINES / "diesel_105x137_pressure.csv"

ANGLE_STEP = 0.61  # degree between digitised points
PRESSURE_STEP = 0.155  # bar between digitised pressures
SMOOTHED_FROM, SMOOTHED_TO = -30.0, 60.0  # degree: range of smoothing
RISE_FROM, RISE_TO = -3.0, 8.0  # degree: from the end of compression to the peak
ROUNDING = 1.0 / math.sqrt(12.0)  # standard error of a number rounded to a step, in steps
HELD = 1e-3  # bar: error of points that are held, a thousandth of the others
REPETITIONS = 30
HEAD = """\
# Cylinder pressure of one cycle of a six-cylinder diesel engine 105/137 mm at full load.
# Written by tools/smooth_digitised.py; change that, not this.
# Smoothed between -30 and 60 degrees within the error of the digitising; elsewhere the points are
# those of diesel_105x137_digitised.csv, which says where they come from (see NOTICE).
# The ends, the same angle, differ by 0.155 bar, one step of the digitising; readers average them.
"""


def main() -> None:
    """Write the smoothed points."""
    angle, pressure = digitised()
    smoothed, _ = smoothed_points(angle, pressure)
    points = [(f"{a:.6f}", f"{p:.6f}") for a, p in zip(angle, smoothed, strict=True)]
    text = HEAD + csv_text([("crank_angle_deg", "pressure_bar"), *points])
    write({SMOOTHED: text})


def digitised() -> tuple[Floats, Floats]:
    """Return angles [degree] and pressures [bar] as they were digitised, shape (K,) each."""
    rows = csv_rows(DIGITISED)
    angle, pressure = np.array([list(row.values()) for row in rows], dtype=np.float64).T
    return angle, pressure


def smoothed_points(angle: Floats, pressure: Floats) -> tuple[Floats, Floats]:
    """Return the smoothed pressures [bar], and the errors [bar] of the points that are smoothed.

    Points are in degrees and bar, as `digitised` returns them. Where nothing is smoothed, the
    pressure is exactly the given one.
    """
    inside = _inside(angle)
    rise = (angle > RISE_FROM) & (angle < RISE_TO)
    steps = np.where(rise, ROUNDING, 1.0)
    slope = np.gradient(pressure, angle)
    for _ in range(REPETITIONS):
        error = np.where(inside, steps * np.hypot(PRESSURE_STEP, ANGLE_STEP * slope), HELD)
        spline = _stiffest(angle, pressure, error, inside)
        slope = spline(angle, 1)
    return np.where(inside, spline(angle), pressure), error[inside]


def _inside(angle: Floats) -> Booleans:
    return (angle > SMOOTHED_FROM) & (angle < SMOOTHED_TO)


def _stiffest(angle: Floats, pressure: Floats, error: Floats, inside: Booleans) -> BSpline:
    """Return the smoothing spline whose deviations are as large as the errors."""

    def spline(exponent: float) -> BSpline:
        return make_smoothing_spline(angle, pressure, w=error**-2.0, lam=10.0**exponent)

    def excess(exponent: float) -> float:
        deviation = (spline(exponent)(angle) - pressure) / error
        return float((deviation[inside] ** 2).mean() - 1.0)

    return spline(brentq(excess, -6.0, 6.0, xtol=1e-10))


if __name__ == "__main__":
    main()
