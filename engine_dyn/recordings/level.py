"""Absolute pressure of sensors that measure changes alone, and how late a recorded pressure comes.

Pegging adds one constant to each cycle. Level and dead centre are also found together: a level that
is too high bends the compression over ln V as a late dead centre does, so one fit has both as
unknowns: docs/method.md (130), with a missing pressure of which nothing is known before. Of a
motored cycle the shift follows from its symmetry, which does not depend on the level.

Sources: those of `compression_fit` and of `dead_centre`; pegging: Randolph, Methods of processing
cylinder-pressure transducer signals to maximize data accuracy, SAE paper 900170, 1990 (inlet
pressure at bottom dead centre; polytropic compression); Brunt and Pond, Evaluation of techniques
for absolute cylinder pressure correction, SAE paper 970036, 1997 (cited from memory, not compared).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from engine_dyn.recordings.compression_fit import PRIORS, UNKNOWN_RATIO, fitted_shift, lines_of
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry, Finding, RecordedCycles
from engine_dyn.recordings.dead_centre import looks_motored, symmetric_shift
from engine_dyn.recordings.smoothing import shifted
from engine_dyn.types import Floats
from engine_dyn.units import BAR, DEGREE

LEVEL_PRIORS = replace(
    PRIORS, exponent=(1.335, 0.03), exponent_slope=(0.01, 0.012), pegging=(0.0, 10.0 * BAR)
)
"""Prior knowledge for a level: it is hardly known, and the exponent less than in `PRIORS`:
whether it falls as the gas gets hot changes the level by some hundredths of a bar."""

TOLD, ANGLE_TOLD = 0.035 * BAR, 0.15 * DEGREE
"""Largest standard uncertainties of a level that is reported to 0.05 bar, and of an angle that
is reported to 0.3 degree."""


@dataclass(frozen=True)
class Level:
    """Level and dead centre as a recording tells them; uncertainties are standard ones."""

    # Error of the recorded pressure's level [Pa] with its uncertainty: positive if too high.
    offset: float
    uncertainty: float
    # Angle by which the recorded pressure comes late [rad] with its uncertainty; negative: early.
    shift: float
    shift_uncertainty: float
    motored: bool  # Whether the shift follows from the symmetry of cycles in which nothing burns
    start: float  # Recorded pressure at the beginning of the compression, bottom dead centre [Pa]
    # Root mean square of the change of p dV/dphi over the cycle when level and dead centre are
    # corrected [W s/rad]: it shows which of both matters more.
    change: float
    shift_change: float

    @property
    def off(self) -> bool:
        """Whether the recorded pressure is surely not absolute."""
        return abs(self.offset) > max(3.0 * self.uncertainty, 0.1 * BAR)

    @property
    def inlet(self) -> float:
        """Absolute pressure at the beginning of the compression [Pa]."""
        return self.start - self.offset

    def corrected(self, cycles: RecordedCycles) -> RecordedCycles:
        """Return the cycles with absolute pressure; their angles stay."""
        return replace(cycles, pressure=cycles.pressure - self.offset)

    @property
    def text(self) -> str:
        """Level and dead centre with their uncertainties, the larger one first."""
        said = [(self.change, self._level_text), (self.shift_change, self.shift_text)]
        return "; ".join(text for _, text in sorted(said, key=lambda one: -one[0]))

    @property
    def finding(self) -> Finding:
        """Finding that the recorded pressure is not absolute."""
        return Finding(
            "level",
            f"{self._level_text}: recorded at bottom dead centre before compression are "
            f"{self.start / BAR:.2f} bar, and the compression is that of a gas from "
            f"{self.inlet / BAR:.2f} bar on",
            self.offset / BAR,
            "bar",
        )

    @property
    def _level_text(self) -> str:
        high = "high" if self.offset > 0.0 else "low"
        told = "" if self.uncertainty <= TOLD else "; to 0.05 bar it cannot be told"
        return (
            f"the pressure is {abs(self.offset) / BAR:.2f} bar too {high} (standard uncertainty "
            f"{self.uncertainty / BAR:.2f} bar{told})"
        )

    @property
    def shift_text(self) -> str:
        """How late the pressure comes, or that it cannot be told well."""
        late = "late" if self.shift > 0.0 else "early"
        sure = f"standard uncertainty {self.shift_uncertainty / DEGREE:.2g} degree"
        size = f"{abs(self.shift) / DEGREE:.1f} degree {late}"
        if self.motored and self.shift_uncertainty <= ANGLE_TOLD:
            return f"it comes {size} ({sure}; from the symmetry of the motored cycle)"
        why = "" if self.motored else "; a motored recording tells it"
        return f"dead centre cannot be told to 0.3 degree: it may come {size} ({sure}{why})"


def recorded_level(cycles: RecordedCycles, geometry: CylinderGeometry) -> Level:
    """Find level and dead centre of a recording that was not pegged.

    Parameters
    ----------
    cycles : RecordedCycles
        Pressure but for a constant that all cycles share.
    geometry : CylinderGeometry
        Its compression ratio is fitted too where it is not given.

    Raises
    ------
    ValueError
        Where samples are missing, or the compression is not that of a gas.
    """
    start = -float(peg_to_inlet(replace(cycles, pressure=cycles.mean[None]), 0.0).offset[0])
    known = geometry
    if known.compression_ratio is None:
        known = geometry.with_compression_ratio(1.0 + UNKNOWN_RATIO[0])
    # Every cylinder has more than this absolute pressure.
    lowest = 0.05 * BAR - float(cycles.mean.min())
    missing = max(float(peg_by_compression(cycles, known).offset.mean()), lowest)
    priors, motored = LEVEL_PRIORS, _is_motored(replace(cycles, pressure=cycles.pressure + missing))
    # Each fit starts from the level of the previous one, until the level changes by less than the
    # number below [Pa].
    for _ in range(20):
        moved = replace(cycles, pressure=cycles.pressure + missing)
        if motored:
            priors = replace(LEVEL_PRIORS, shift=symmetric_shift(moved)[:2])
        fit = fitted_shift(lines_of(moved), geometry, priors)
        before, missing = missing, max(missing + fit.pegging, lowest)
        if abs(missing - before) < 10.0:
            break
    else:
        raise ValueError("the compression is not that of a gas")
    # A level is not believed where the residuals exceed their expected size by more than the factor
    # below. Reasons are coarse steps of a digitised curve, leaks, or a recording of no engine.
    if fit.excess > 2.5:
        raise ValueError(
            f"compression and expansion differ from those of a gas {fit.excess:.2g} times as much "
            "as usual"
        )
    shift = priors.shift if motored else (fit.shift, fit.shift_uncertainty)
    moved = replace(moved, pressure=moved.mean[None])
    change, of_shift = _changes(moved, geometry, missing, shift[0])
    return Level(-missing, fit.pegging_uncertainty, *shift, motored, start, change, of_shift)


def _is_motored(absolute: RecordedCycles) -> bool:
    """Whether nothing burns: lost heat makes both sides differ, not added heat."""
    if not looks_motored(absolute):
        return False
    _, uncertainty, loss = symmetric_shift(absolute)
    # The loss angle of a motored cycle is above this limit. A smaller one, below 0 by more than its
    # uncertainty, shows that heat is added.
    return loss > min(-0.1 * DEGREE, -2.0 * uncertainty)


def _changes(
    absolute: RecordedCycles, geometry: CylinderGeometry, missing: float, shift: float
) -> tuple[float, float]:
    """Root mean squares of the changes of p dV/dphi by a level and by a shift."""
    slope = geometry.volume_slope(absolute.angle)
    moved = shifted(absolute, -shift).pressure[0] - absolute.pressure[0]

    def size(values: Floats) -> float:
        return math.sqrt(float(np.mean(values**2)))

    return size(missing * slope), size(moved * slope)


EXPONENT = 1.33
"""Polytropic exponent of a compression where no fit is made: 1.32 to 1.35 for spark-ignition
engines, 1.34 to 1.38 for diesel engines (judgement after Randolph 1990)."""


class Pegged(NamedTuple):
    """Cycles with absolute pressure."""

    cycles: RecordedCycles  # Recorded cycles with `offset` added
    offset: Floats  # Pressure that was added to each cycle [Pa]; shape (cycles,)
    uncertainty: Floats  # Standard uncertainty of each offset [Pa]; shape (cycles,)
    # Polytropic exponent [1], fitted or given; NaN where none is used; shape (cycles,)
    exponent: Floats


def _pegged(
    cycles: RecordedCycles, offset: Floats, uncertainty: Floats, exponent: Floats
) -> Pegged:
    moved = RecordedCycles(cycles.angle, cycles.pressure + offset[:, None], cycles.period)
    return Pegged(moved, offset, uncertainty, exponent)


def peg_to_inlet(
    cycles: RecordedCycles,
    inlet_pressure: float,
    angle: float = -math.pi,
    window: float = 10.0 * DEGREE,
    inlet_uncertainty: float = 0.0,
) -> Pegged:
    """Make the mean pressure around an angle that of the inlet, docs/method.md (125).

    Parameters
    ----------
    cycles : RecordedCycles
        Pressure but for a constant of each cycle.
    inlet_pressure : float
        Absolute pressure in the cylinder there [Pa].
    angle : float
        Where [rad]; bottom dead centre after the intake stroke by default.
    window : float
        Angle over which samples are averaged, half of it on either side [rad].
    inlet_uncertainty : float
        Standard uncertainty of `inlet_pressure` [Pa].

    Raises
    ------
    ValueError
        If no sample lies in the window.
    """
    away = np.abs((cycles.angle - angle + 0.5 * cycles.period) % cycles.period
                  - 0.5 * cycles.period)  # fmt: skip
    at = away <= 0.5 * window + 1e-9
    if not at.any():
        raise ValueError(
            f"no sample within {0.5 * window / DEGREE:g} degree of {angle / DEGREE:g} degree"
        )
    part = cycles.pressure[:, at]
    offset = inlet_pressure - part.mean(axis=1)
    spread = part.std(axis=1, ddof=1) / math.sqrt(part.shape[1]) if part.shape[1] > 1 else 0.0
    uncertainty = np.hypot(spread, inlet_uncertainty) * np.ones(cycles.cycles)
    return _pegged(cycles, offset, uncertainty, np.full(cycles.cycles, math.nan))


def peg_by_compression(
    cycles: RecordedCycles,
    geometry: CylinderGeometry,
    exponent: float | None = EXPONENT,
    interval: tuple[float, float] = (-100.0 * DEGREE, -40.0 * DEGREE),  # closed, not yet burning
    exponent_deviation: float = 0.02,
) -> Pegged:
    """Make the compression polytropic: least squares of p + dp = C V^-n, docs/method.md (126).

    Parameters
    ----------
    cycles : RecordedCycles
        Pressure but for a constant of each cycle.
    geometry : CylinderGeometry
        With its compression ratio.
    exponent : float, optional
        n [1]; None: fitted too, which asks for little noise and a long interval.
    interval : tuple of float
        First and last angle [rad], valves closed and before combustion.
    exponent_deviation : float
        Standard uncertainty of a given exponent [1]; enters that of the offset.

    Raises
    ------
    ValueError
        With fewer than five samples in the interval, without a compression ratio, or if no
        exponent from 1 to 1.7 fits.
    """
    at = (cycles.angle >= interval[0]) & (cycles.angle <= interval[1])
    if at.sum() < 5:
        raise ValueError(
            f"fewer than five samples between {interval[0] / DEGREE:g} and "
            f"{interval[1] / DEGREE:g} degree"
        )
    volume = geometry.volume(cycles.angle[at]) / geometry.swept_volume
    p = cycles.pressure[:, at]
    if exponent is None:
        fits = np.array([_fitted(volume, row) for row in p])
        if np.isnan(fits).any():
            raise ValueError(
                "no polytropic exponent between 1 and 1.7 fits the compression between "
                f"{interval[0] / DEGREE:g} and {interval[1] / DEGREE:g} degree"
            )
        return _pegged(cycles, fits[:, 0], fits[:, 1], fits[:, 2])
    offset, spread = _linear(volume, p, exponent)
    high, _ = _linear(volume, p, exponent + exponent_deviation)
    low, _ = _linear(volume, p, exponent - exponent_deviation)
    uncertainty = np.hypot(spread, 0.5 * (high - low))
    return _pegged(cycles, offset, uncertainty, np.full(cycles.cycles, exponent))


def _linear(volume: Floats, p: Floats, exponent: float) -> tuple[Floats, Floats]:
    """Offset of each cycle and its standard error, for one exponent."""
    x = volume**-exponent
    x = x - x.mean()
    square = (x**2).sum()
    factor = (p * x).sum(axis=1) / square
    mean = (volume**-exponent).mean()
    offset = factor * mean - p.mean(axis=1)
    rest = p - p.mean(axis=1, keepdims=True) - factor[:, None] * x
    variance = (rest**2).sum(axis=1) / (len(x) - 2)
    return offset, np.sqrt(variance * (1.0 / len(x) + mean**2 / square))


def _fitted(volume: Floats, p: Floats) -> tuple[float, float, float]:
    """Offset, standard error and exponent of one cycle by the Gauss-Newton method."""
    n = EXPONENT
    for _ in range(30):
        power = volume**-n
        columns = np.stack([power, -np.ones_like(power), -power * np.log(volume)], axis=1)
        # The third unknown is C dn: divided by C of the same solution, it is the step of n.
        solution, *_ = np.linalg.lstsq(columns, p, rcond=None)
        step = solution[2] / solution[0]
        n += float(np.clip(step, -0.1, 0.1))
        if not 1.0 < n < 1.7:
            return math.nan, math.nan, math.nan
        if abs(step) < 1e-9:
            break
    rest = p - columns @ solution
    variance = float(rest @ rest) / (len(p) - 3)
    covariance = np.linalg.inv(columns.T @ columns) * variance
    return float(solution[1]), math.sqrt(covariance[1, 1]), n
