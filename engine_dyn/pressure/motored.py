"""The pressure of a cylinder that does not burn, and of one that burns less or more.

A cylinder with factor f has p = p_motored + f (p - p_motored): 0 is a misfire with the valves at
work, 1 the diagram itself. A modelled cycle knows its motored diagram (`Diagram.motored`): the same
cycle without heat. For a measured one it is constructed:

- up to 50 degrees before firing dead centre, and in the gas exchange, as measured;
- around dead centre a polytropic change ln p = a - n ln(1 + k s (1 + lambda (1 - s))), with
  s = sin^2(phi/2) and lambda = 0.28 for any engine, fitted to the measured compression from 80 to
  30 degrees before dead centre (a and n by least squares, k = 3 to 40 the best), because combustion
  begins before dead centre; of modelled cycles it finds the motored peak to 2 percent;
- behind it the compression, mirrored about dead centre: no heat loss, no work;
- from 180 to 240 degrees (two-stroke: 90 to 120) going over to the measured gas exchange.

A cylinder whose valves stay shut (factor `SEALED`) compresses and expands the same charge in every
revolution: its pressure is the motored compression, mirrored about each dead centre. It does no net
work; heat and leaks are left out.

What that leaves out: heat and charge lost while motored, a fresh charge instead of a burnt one in
the next gas exchange.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.geometry.cylinder_means import mean_of_cylinders, value_of_sets
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount, Member
from engine_dyn.geometry.firing_sequence import SEALED, PressureFactor
from engine_dyn.periodic_spline import periodic_spline_slopes
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.pressure.diagram import Diagram, in_compression, values_at
from engine_dyn.pressure.family import Family, blend, largest_between, own_diagrams, peaks_between
from engine_dyn.pressure.point_checks import LARGEST_PRESSURE
from engine_dyn.types import Floats, Integers
from engine_dyn.units import DEGREE

FIT_TO, JOINED = 30.0 * DEGREE, 50.0 * DEGREE
RATIO = 0.28
SAMPLES = 121


def motored(diagram: Diagram) -> Diagram:
    """Diagram without combustion: the modelled cycle's own, or constructed (see the module).

    Raises
    ------
    ValueError
        One line, where the compression of a measured diagram is no polytropic change.
    """
    return diagram.motored() if diagram.motored is not None else _constructed(diagram)


def _constructed(diagram: Diagram) -> Diagram:
    phi = -np.linspace(80.0 * DEGREE, FIT_TO, SAMPLES)
    log_p = np.log(diagram(phi))
    best: tuple[float, Any, float] | None = None
    for k in np.geomspace(3.0, 40.0, 200):
        basis = np.stack([np.ones(SAMPLES), -np.log1p(k * _travel(phi))], axis=1)
        fitted = np.linalg.lstsq(basis, log_p, rcond=None)[0]
        miss = float(np.sqrt(((basis @ fitted - log_p) ** 2).mean()))
        if best is None or miss < best[0]:
            best = (miss, fitted, float(k))
    assert best is not None
    miss, (level, exponent), k = best
    # The points are no compression if ln p deviates from the fit by more than 0.05 (root mean
    # square), if the pressure rises by less than a factor of 1.5 (factors of 4 or 5 are usual), or
    # if the fit would be higher at dead centre than diagrams may be.
    rise = log_p[-1] - log_p[0]
    if miss > 0.05 or rise < math.log(1.5) or level > math.log(LARGEST_PRESSURE):
        raise ValueError(
            "the diagram has no compression line between 80 and 30 degrees before firing dead "
            "centre, from which a cylinder without combustion could be made; must be 1"
        )

    angle = diagram.angle
    before = -np.abs(angle)
    top = np.exp(level - exponent * np.log1p(k * _travel(angle)))
    # The measured compression up to the angle from which the fit takes over; after dead centre, the
    # mirror image of both.
    share = _step((np.abs(angle) - FIT_TO) / (JOINED - FIT_TO))
    compression = top ** (1.0 - share) * diagram(before) ** share
    if diagram.period == FOUR_STROKE:
        begin, end = 180.0 * DEGREE, 240.0 * DEGREE
    else:
        begin, end = 90.0 * DEGREE, 120.0 * DEGREE
    exchange = _step((angle - begin) / (end - begin))
    pressure = compression ** (1.0 - exchange) * diagram.pressure**exchange
    pressure = np.where(angle <= -JOINED, diagram.pressure, pressure)
    slope = periodic_spline_slopes(angle, pressure, diagram.period)
    return Diagram(angle, pressure, slope, diagram.period)


def _travel(phi: Floats) -> Floats:
    """Travel of the piston over the stroke, to first order in the crank ratio."""
    s = np.sin(0.5 * phi) ** 2
    return np.asarray(s * (1.0 + RATIO * (1.0 - s)))


def _step(u: Floats) -> Floats:
    """Smooth step from 0 to 1 between u = 0 and 1."""
    t = np.clip(u, 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


_motored: WeakKeyDictionary[Family, Family] = WeakKeyDictionary()
_rows: WeakKeyDictionary[Family, dict[tuple[int, float], Diagram]] = WeakKeyDictionary()


def over_cycles(
    at: Callable[[float], Any], angle: Any, factors: tuple[float, ...], period: float
) -> Any:
    """Pressure of a cylinder whose factor changes from cycle to cycle [Pa].

    Parameters
    ----------
    at : callable
        Pressure at these angles with a factor that all cycles have.
    angle : array_like
        The cylinder's own angle [rad]; cycles are around its firing dead centres, and the first is
        around 0.
    factors : tuple of float
        Of each cycle; the last is followed by the first.
    period : float
        Angle of a cycle [rad].
    """
    number = np.floor(np.asarray(angle) / period + 0.5).astype(np.int64) % len(factors)
    factor, motored_pressure = np.asarray(factors)[number], at(0.0)
    pressure = motored_pressure + factor * (at(1.0) - motored_pressure)
    return np.where(factor == SEALED, at(SEALED), pressure) if SEALED in factors else pressure


def pressures_of_rows(
    family: Family, rows: Integers, angle: Floats, factor: PressureFactor
) -> Floats:
    """Pressure [Pa] of some rows of the family at the same angles [rad], shape (rows, angles).

    `factor` is that of a cylinder on its pressure.
    """
    if isinstance(factor, tuple):
        one = partial(pressures_of_rows, family, rows, angle)
        return np.asarray(over_cycles(one, angle, factor, family.period))
    if isinstance(family, CycleTable):
        return family.sampled(rows, angle, factor)[0]
    pressure = np.empty((rows.size, angle.size))
    values_at([row_with_factor(family, row, factor) for row in rows.tolist()], angle, pressure)
    return pressure


def row_with_factor(family: Family, row: int, factor: float) -> Diagram:
    """Diagram of a row of the family for a cylinder with this factor on its pressure."""
    whole = family.row(row)
    if factor == 1.0:
        return whole
    if isinstance(family, CycleTable):
        pressures, slopes = family.at_knots(np.array([row]), factor)
        return Diagram(whole.angle, pressures[0], slopes[0], whole.period)
    known = _rows.setdefault(family, {})
    if (row, factor) not in known:
        if family not in _motored:
            _motored[family] = family.each(motored)
        base = _motored[family].row(row)
        pressure, slope = base.pressure, base.slope
        sealed = factor == SEALED
        if sealed or not np.array_equal(base.angle, whole.angle):
            pressure = base(in_compression(whole.angle) if sealed else whole.angle)
            slope = periodic_spline_slopes(whole.angle, pressure, whole.period)
        # A spline is linear in its values, so slopes are blended as pressures are.
        share = max(factor, 0.0)
        known[row, factor] = Diagram(
            whole.angle,
            pressure + share * (whole.pressure - pressure),
            slope + share * (whole.slope - slope),
            whole.period,
        )
    return known[row, factor]


def at_with_factor(family: Family, load: float, factor: float) -> Diagram:
    """Diagram at one load [percent], see `Family.at`, for a cylinder with this factor."""
    row, weight = family.locate(load)
    lower = row_with_factor(family, int(row), factor)
    if weight == 0.0:
        return lower
    return blend(lower, row_with_factor(family, int(row) + 1, factor), float(weight))


def peak_with_factor(place: npt.ArrayLike, family: Family, factor: float) -> Floats:
    """Return p_max [Pa] at each place of the family's table for a cylinder with this factor."""
    if factor == 1.0:
        return family.peak_between(place)
    if isinstance(family, CycleTable):
        return family.peaks(place, factor)
    return peaks_between(place, lambda row: row_with_factor(family, row, factor).pressure)


def largest_with_factor(place: npt.ArrayLike, family: Family, factor: float) -> Floats:
    """Largest pressure [Pa] at each place for a cylinder with this factor, between knots too."""
    if isinstance(family, CycleTable):
        return family.peaks(place, factor, between=True)
    return largest_between(place, lambda row: row_with_factor(family, row, factor))


def peak_of_cylinders(
    place: npt.ArrayLike, family: Family, cylinder_set: Any, by_count: CylindersByCount,
    reduced: Callable[..., Any], peak: Callable[[npt.ArrayLike, Family, float], Floats],
) -> Any:  # fmt: skip
    """Largest or mean p_max [Pa] of the cylinders of each design.

    Parameters
    ----------
    place : array_like
        Place of the diagram in the family's table.
    family : Family
        Diagrams.
    cylinder_set, by_count
        As of `cylinder_means.value_of_sets`.
    reduced : callable
        `np.max` or `np.mean`, over the cylinders and cycles.
    peak : callable
        `largest_with_factor` or `peak_with_factor`.
    """
    each: dict[tuple[float, int], Floats] = {}

    def of_engine(engine: Cylinders) -> Any:
        factors = engine.all_pressure_factors.tolist()
        keys = [(f, d) for d, own in zip(engine.diagrams, factors, strict=True) for f in own]
        for factor, diagram in keys:
            if (factor, diagram) not in each:
                own = own_diagrams(family, diagram)
                each[factor, diagram] = peak(place, own, factor)
        return reduced([each[key] for key in keys], axis=0)

    return value_of_sets(cylinder_set, by_count, of_engine)


def peak_by_displacement(
    place: npt.ArrayLike, family: Family, cylinder_set: Any, by_count: CylindersByCount,
    crank_ratio: Any, offset: Any,
) -> Any:  # fmt: skip
    """Mean p_max [Pa] of the cylinders of each design, by their shares in the displacement.

    A friction mean effective pressure that grows with p_max acts on the displacement of each
    cylinder. Arguments as of `peak_of_cylinders` and `cylinder_means.mean_displacement_ratio`.
    """

    def of_one(member: Member) -> Any:
        factors = member.pressure_factor
        each = factors if isinstance(factors, tuple) else (factors,)
        own = own_diagrams(family, member.diagram)
        mean = np.mean([peak_with_factor(place, own, factor) for factor in each], axis=0)
        return member.displacement(crank_ratio, offset) * mean

    whole = mean_of_cylinders(
        cylinder_set, by_count, lambda member: member.displacement(crank_ratio, offset)
    )
    return mean_of_cylinders(cylinder_set, by_count, of_one) / whole
