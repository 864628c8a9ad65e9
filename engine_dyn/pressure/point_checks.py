"""Whether tabulated points are an indicator diagram: units, order, coverage, phase.

Messages speak in degrees and bar, because people read them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from engine_dyn.geometry.arrangement import FOUR_STROKE, TWO_STROKE
from engine_dyn.given_numbers import given_array, given_number
from engine_dyn.periodic_spline import wrapped
from engine_dyn.types import Floats
from engine_dyn.units import BAR, DEGREE

# Smallest number of points; distance from firing dead centre within which gaps between points must
# be narrow, because the pressure changes steeply there; angles between which the peak must lie.
MINIMUM_POINTS = 16
NEAR_FIRING = 60.0 * DEGREE
PEAK_FROM, PEAK_TO = -30.0 * DEGREE, 60.0 * DEGREE
ENDS_TOLERANCE = 0.02
SMALLEST_PEAK, LARGEST_PRESSURE = 0.01 * BAR, 500.0 * BAR

SLACK = 1e-7
"""Fraction of the cycle within which angles are the same: single precision errs by 2e-8."""


def checked_points(angle: ArrayLike, pressure: ArrayLike, period: float) -> tuple[Floats, Floats]:
    """Points of a diagram as arrays, both ends of the cycle joined; see `diagram_from_points`.

    Raises
    ------
    ValueError
        One line that names the place, the value and what is allowed.
    """
    period = given_number("period", period)
    if not (math.isclose(period, FOUR_STROKE) or math.isclose(period, TWO_STROKE)):
        raise ValueError(f"period {degrees(period)} degrees is not allowed: it must be 720 or 360")
    phi = given_array("crank angle", angle).copy()
    p = given_array("pressure", pressure).copy()
    if phi.ndim != 1 or p.ndim != 1 or len(phi) != len(p):
        raise ValueError(
            f"crank angles of shape {phi.shape} and pressures of shape {p.shape}: "
            "both must be lists of the same length"
        )
    if len(phi) < MINIMUM_POINTS:
        raise ValueError(f"{len(phi)} points are too few: at least {MINIMUM_POINTS} are needed")
    _check_values(phi, p, period)
    phi, p = _join_ends(phi, p, period)
    _check_coverage(phi, period)
    _check_phase(phi, p, period)
    return phi, p


def _check_values(phi: Floats, p: Floats, period: float) -> None:
    """Refuse points that are wrong by themselves or by their order."""
    half = period / 2.0
    slack = SLACK * period
    bad = np.flatnonzero(~(np.isfinite(phi) & np.isfinite(p)))
    if bad.size:
        i = int(bad[0])
        raise ValueError(
            f"point {i + 1}: crank angle {degrees(phi[i])} degrees, pressure {bars(p[i])} bar: "
            "both must be finite numbers"
        )
    bad = np.flatnonzero((phi < -half - slack) | (phi > half + slack))
    if bad.size:
        i = int(bad[0])
        raise ValueError(
            f"point {i + 1}: crank angle {degrees(phi[i])} degrees is outside "
            f"{degrees(-half)}..{degrees(half)} (0 is firing top dead centre)"
        )
    bad = np.flatnonzero(np.diff(phi) <= 0.0)
    if bad.size:
        i = int(bad[0]) + 1
        raise ValueError(
            f"point {i + 1}: crank angle {degrees(phi[i])} degrees after {degrees(phi[i - 1])}: "
            "angles must be strictly ascending"
        )
    bad = np.flatnonzero(p <= 0.0)
    if bad.size:
        i = int(bad[0])
        raise ValueError(
            f"point {i + 1}: pressure {bars(p[i])} bar at {degrees(phi[i])} degrees: "
            "absolute pressure must be positive (is it gauge pressure?)"
        )
    top = int(np.argmax(p))
    if p[top] > LARGEST_PRESSURE:
        raise ValueError(
            f"point {top + 1}: pressure {bars(p[top])} bar at {degrees(phi[top])} degrees is above "
            f"{bars(LARGEST_PRESSURE)} bar{_unit_hint(p)}"
        )
    if p[top] < SMALLEST_PEAK:
        raise ValueError(
            f"point {top + 1}: the largest pressure is {bars(p[top])} bar: must be at least "
            f"{bars(SMALLEST_PEAK)} bar (are the pressures in bar or MPa? They must be in pascal)"
        )
    # Megapascals that are taken for bar show as a lowest pressure of about 0.1 bar. The ratio of
    # the largest to the lowest pressure tells such an engine from a pump.
    low = float(p.min())
    if 0.05 * BAR <= low < 0.15 * BAR and 15.0 * low <= p[top] <= 35.0 * BAR:
        raise ValueError(
            f"lowest pressure {bars(low)} bar, largest {bars(p[top])} bar: no cylinder with such "
            "a compression reaches so low a pressure (it looks like megapascal)"
        )


def _unit_hint(p: Floats) -> str:
    """Name the unit that the values probably had: gas exchange happens near one atmosphere."""
    low = float(p.min()) / BAR
    if 50.0 <= low <= 400.0:
        return " (it looks like kilopascal)"
    if 7.0 <= low < 50.0:
        return " (it looks like psi)"
    if low >= 2e4:
        return " (it looks like pascal)"
    return ""


def _join_ends(phi: Floats, p: Floats, period: float) -> tuple[Floats, Floats]:
    """Merge both ends of the cycle into one point, with the mean of their pressures."""
    half = period / 2.0
    slack = SLACK * period
    at_start = abs(phi[0] + half) <= slack
    at_end = abs(phi[-1] - half) <= slack
    if at_start:
        phi[0] = -half
    if not at_end:
        return phi, p
    if not at_start:
        # The file has the end of the cycle only: it stands for the same angle one period earlier.
        return np.concatenate(([-half], phi[:-1])), np.concatenate(([p[-1]], p[:-1]))
    differ = abs(p[0] - p[-1])
    largest = float(p.max())
    if differ > ENDS_TOLERANCE * largest:
        raise ValueError(
            f"pressure {bars(p[0])} bar at {degrees(-half)} degrees and {bars(p[-1])} bar at "
            f"{degrees(half)}, which is the same angle: they differ by {bars(differ)} bar, "
            f"allowed is 2 % of the peak, {bars(ENDS_TOLERANCE * largest)} bar"
        )
    p[0] = 0.5 * (p[0] + p[-1])
    return phi[:-1], p[:-1]


def _check_coverage(phi: Floats, period: float) -> None:
    """Refuse gaps too wide for a spline to bridge."""
    step = np.diff(phi, append=phi[0] + period)
    end = phi + step
    near = (phi < NEAR_FIRING) & (end > -NEAR_FIRING)
    # A gap across the end of the cycle ends in the next cycle.
    near |= (phi < NEAR_FIRING + period) & (end > period - NEAR_FIRING)
    slack = SLACK * period
    for allowed, where, part in (
        (60.0 * DEGREE, np.full(len(phi), True), ""),
        (15.0 * DEGREE, near, f" within {degrees(NEAR_FIRING)} degrees of firing"),
    ):
        wide = np.flatnonzero(where & (step > allowed + slack))
        if wide.size:
            i = int(wide[np.argmax(step[wide])])
            until = wrapped(end[i], period)
            raise ValueError(
                f"no pressure between {degrees(phi[i])} and {degrees(until)} degrees: "
                f"a gap of {degrees(step[i])} degrees, allowed are {degrees(allowed)}{part}"
            )


def _check_phase(phi: Floats, p: Floats, period: float) -> None:
    """Refuse a peak away from firing dead centre, or no compression before it."""
    top = int(np.argmax(p))
    place = float(phi[top])
    if not PEAK_FROM <= place <= PEAK_TO:
        hint = ""
        for shift in (360.0, 180.0):
            for sign in (-1.0, 1.0):
                moved = float(wrapped(place + sign * shift * DEGREE, period))
                fits = PEAK_FROM <= moved <= PEAK_TO
                if not hint and fits and shift * DEGREE < period:
                    hint = f" (the diagram looks shifted by {shift:.0f} degrees)"
        raise ValueError(
            f"point {top + 1}: the peak, {bars(p[top])} bar, is at {degrees(place)} degrees, "
            f"allowed is {degrees(PEAK_FROM)}..{degrees(PEAK_TO)}: "
            f"0 must be firing top dead centre{hint}"
        )
    early, late = (-120.0, -20.0) if math.isclose(period, FOUR_STROKE) else (-80.0, -20.0)
    before, after = np.interp(np.array([early, late]) * DEGREE, phi, p, period=period)
    if after <= before:
        raise ValueError(
            f"pressure {bars(before)} bar at {early:g} degrees and {bars(after)} bar at {late:g}: "
            "it must rise through the compression; 0 must be firing top dead centre and angles "
            "must grow with rotation"
        )


def degrees(value: ArrayLike) -> str:
    """Return an angle [rad] in degrees, for a message."""
    return f"{float(np.asarray(value)) / DEGREE:.6g}"


def bars(value: ArrayLike) -> str:
    """Return a pressure [Pa] in bar, for a message."""
    return f"{float(np.asarray(value)) / BAR:.6g}"
