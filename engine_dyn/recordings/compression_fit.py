"""The dead centre for which compression and expansion are those of a gas: a fit of its inputs.

The recorded pressure is compared with docs/method.md (130): before combustion a change of state
whose exponent falls a little as the gas gets hot, and which loses heat to the walls; behind
combustion a polytrope. Exponents, heat loss, pegging and compression ratio are not known exactly.
Each is an unknown of the fit with a mean and a standard deviation (`PRIORS`), so that what they
could explain enlarges the uncertainty of the shift.

Sources: least squares with prior knowledge as in any textbook of estimation; shape of the heat
loss after Woschni's formula (Heywood 1988, section 12.4, from memory). That a wrong dead centre
shows in the exponents of compression and expansion is in Heywood 1988, section 9.5, and Lancaster,
Krieger and Lienesch, Measurement and analysis of engine pressure data, SAE paper 750026, 1975 (both
from memory).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry, RecordedCycles
from engine_dyn.recordings.smoothing import noise
from engine_dyn.types import Booleans, Floats
from engine_dyn.units import BAR, DEGREE

STEP = 2.5 * DEGREE
"""Angle over which samples are averaged; neighbouring averages are taken as independent."""

MISFIT = 0.003
"""Standard deviation of ln p between gas and formula (judgement; see docs/measured_pressure.md)."""

LAST_END = -10.0 * DEGREE
"""Latest end of the compression in the fit [rad]: combustion begins after it."""

GAS_START, WALL = 380.0, 430.0
"""Temperatures of charge and walls [K], which enter only the shape of the heat loss."""


@dataclass(frozen=True)
class Priors:
    """Knowledge of the unknowns before the fit: mean and standard deviation of each."""

    # Ratio of specific heats of the charge at some 600 K [1].
    exponent: tuple[float, float] = (1.355, 0.015)
    # Rise of the ratio of specific heats over ln V [1], because the gas cools as it expands.
    exponent_slope: tuple[float, float] = (0.016, 0.012)
    # Angle before dead centre at which heat loss makes the motored pressure largest [rad].
    loss_angle: tuple[float, float] = (0.6 * DEGREE, 0.4 * DEGREE)
    # Exponent of the expansion [1]; late combustion lowers it, heat loss raises it.
    expansion_exponent: tuple[float, float] = (1.28, 0.05)
    # Standard deviation of the absolute pressure: a fraction of the pressure at the begin of
    # compression [1], and a constant [Pa].
    pegging: tuple[float, float] = (0.03, 0.02 * BAR)
    # ln of the true over the given clearance volume [1].
    clearance: tuple[float, float] = (0.0, 0.02)
    # Shift of the dead centre [rad], hardly known in advance.
    shift: tuple[float, float] = (0.0, 10.0 * DEGREE)


PRIORS = Priors()
"""Judgement: 1.37 to 1.395 for air and mixtures at 300 K, falling by 6e-5 to 1e-4 per kelvin;
loss angles of 0.3 to 1 degree; inlet pressure to 3 percent; compression ratio to 2 percent."""

UNKNOWN_RATIO = (11.0, 0.35)
"""Expected compression ratio less 1, and standard deviation of its ln, where no ratio is given."""


class Lines(NamedTuple):
    """Averages of ln p on compression and expansion."""

    # Averages: mean angle [rad], mean ln of p [Pa], and standard deviation of that mean; shape (n,)
    angle: Floats
    log_pressure: Floats
    deviation: Floats
    compression: Booleans  # Whether each average belongs to the compression; shape (n,)

    def until(self, end: float) -> Lines:
        """Points of the compression up to an angle, and of the expansion."""
        keep = ~self.compression | (self.angle <= end)
        return Lines._make(column[keep] for column in self)


class CompressionFit(NamedTuple):
    """Result of the fit; the uncertainties are standard ones."""

    # Angle by which the recorded pressure comes late, and its standard uncertainty [rad].
    shift: float
    shift_uncertainty: float
    # Pressure that is missing in the recording, and its standard uncertainty [Pa].
    pegging: float
    pegging_uncertainty: float
    clearance: float  # ln of the true over the given clearance volume [1]
    # Further fitted unknowns, as `Priors` names them.
    loss_angle: float
    exponent: float
    expansion_exponent: float
    misfit: float  # Sum of squares of residuals and of deviations from the priors
    excess: float  # Factor by which residuals exceed their expected size, at least 1
    end: float  # Last angle of the compression used for the fit [rad]


def lines_of(cycles: RecordedCycles) -> Lines:
    """Averages over 2.5 degrees of the mean cycle, valves or ports closed.

    Raises
    ------
    ValueError
        If samples are missing there, or pressures are not positive.
    """
    four = cycles.period == FOUR_STROKE
    compression = (-95.0 if four else -85.0) * DEGREE, LAST_END
    expansion = 65.0 * DEGREE, (105.0 if four else 95.0) * DEGREE
    p = cycles.mean
    error = float(noise(cycles).mean()) / math.sqrt(cycles.cycles)
    rows = []
    for which, (start, end) in ((True, compression), (False, expansion)):
        for middle in np.arange(start, end + 0.5 * STEP, STEP):
            at = np.abs(cycles.angle - middle) < 0.5 * STEP
            if not at.any():
                raise ValueError(
                    f"no sample within {0.5 * STEP / DEGREE:g} degree of {middle / DEGREE:g} "
                    "degree; the check of dead centre needs a step of 2.5 degree or less"
                )
            if not np.all(p[at] > 0.0):
                raise ValueError("pressure: must be positive (absolute) on the compression")
            deviation = error / float(p[at].mean()) / math.sqrt(at.sum())
            rows.append((cycles.angle[at].mean(), np.log(p[at]).mean(), deviation, which))
    angle, log_p, deviations, kinds = (np.array(column) for column in zip(*rows, strict=True))
    return Lines(angle, log_p, np.hypot(deviations, MISFIT), kinds.astype(bool))


def fitted_shift(
    lines: Lines, geometry: CylinderGeometry, priors: Priors = PRIORS, end: float | None = None
) -> CompressionFit:
    """Fit docs/method.md (130) by Gauss and Newton's method.

    Parameters
    ----------
    lines : Lines
        What was recorded.
    geometry : CylinderGeometry
        Without a compression ratio that is fitted too, within wide limits.
    priors : Priors
        What is known before.
    end : float, optional
        Last angle of the compression [rad]; found by the fit if not given.

    Returns
    -------
    CompressionFit
    """
    if geometry.compression_ratio is None:
        most_likely, deviation = UNKNOWN_RATIO
        geometry = geometry.with_compression_ratio(1.0 + most_likely)
        priors = replace(priors, clearance=(0.0, deviation))
    if end is not None:
        return _Fit(lines.until(end), geometry, priors).solved()
    # Ever longer compressions are fitted, until an average does not fit those before it.
    fits: list[CompressionFit] = []
    angles = lines.angle[lines.compression] - 0.5 * STEP
    # Possible ends of the fitted compression, from the earliest on: combustion begins there.
    for last in np.arange(-40.0 * DEGREE, LAST_END + 0.5 * STEP, STEP):
        one = _Fit(lines.until(last + 0.5 * STEP), geometry, priors).solved()
        noisy = 1.0 - (MISFIT / lines.deviation[np.searchsorted(angles, last)]) ** 2
        # Where one more averaged point makes the sum of squares rise by more than this, combustion
        # has begun, or the noise is large. The fit that ended three points earlier is taken then.
        most = 1.0 + 4.0 * noisy
        if fits and one.misfit - fits[-1].misfit > most:
            return fits[max(len(fits) - 3, 0)]
        fits.append(one)
    return fits[-1]


class _Fit:
    """Least-squares fit of one set of averages."""

    def __init__(self, lines: Lines, geometry: CylinderGeometry, priors: Priors) -> None:
        self.lines, self.geometry = lines, geometry
        self.compression = lines.compression
        share, constant = priors.pegging
        pegging = share * math.exp(lines.log_pressure[0]) + constant
        # Unknowns: errors of ln p at the begin of compression and the end of expansion, exponent,
        # its slope, loss angle, missing pressure, ln of the clearance, exponent of the expansion,
        # shift.
        self.means = np.array([0.0, 0.0, priors.exponent[0], priors.exponent_slope[0],
                               priors.loss_angle[0], 0.0, priors.clearance[0],
                               priors.expansion_exponent[0], priors.shift[0]])  # fmt: skip
        self.deviations = np.array([5.0, 5.0, priors.exponent[1], priors.exponent_slope[1],
                                    priors.loss_angle[1], pegging, priors.clearance[1],
                                    priors.expansion_exponent[1], priors.shift[1]])  # fmt: skip
        self.loss, self.loss_slope = self._loss()

    def _loss(self) -> tuple[Floats, Floats]:
        """Fall of ln p for a loss angle of one radian, and its slope: docs/method.md (131)."""
        geometry, angle = self.geometry, self.lines.angle[self.compression]
        grid = np.append(np.arange(angle[0], 0.0, 1.0 * DEGREE), 0.0)
        volume = geometry.volume(grid)
        pressure = (volume / volume[0]) ** -1.35
        temperature = GAS_START * pressure * volume / volume[0]
        rate = pressure**0.8 * temperature**-0.55 * (temperature - WALL) / (pressure * volume)
        top = np.array([-1e-4, 1e-4])
        bend = float(np.diff(geometry.volume_slope(top))[0]) / 2e-4 / float(volume[-1])
        rate *= 1.35 * bend / rate[-1]
        steps = 0.5 * (rate[1:] + rate[:-1]) * np.diff(grid)
        whole = np.concatenate([[0.0], np.cumsum(steps)])
        return np.interp(angle, grid, whole), np.interp(angle, grid, rate)

    def _residuals(self, unknowns: Floats) -> Floats:
        """Residuals of data and priors in standard deviations, for each row of unknowns."""
        u = unknowns[:, :, None]
        lines, geometry, comp = self.lines, self.geometry, self.compression
        clearance = geometry.clearance_volume * np.exp(u[:, 6])
        log_v = np.log(clearance + geometry.displaced(lines.angle - u[:, 8]))
        pressure = np.maximum(np.exp(lines.log_pressure) + u[:, 5], 1.0)
        measured = np.log(pressure) - np.where(comp, lines.log_pressure[0],
                                               lines.log_pressure[-1])  # fmt: skip
        middle = math.log(geometry.clearance_volume + 0.3 * geometry.swept_volume)
        x, start = log_v[:, comp], log_v[:, :1]
        model = np.empty_like(measured)
        bend = 0.5 * ((x - middle) ** 2 - (start - middle) ** 2)
        lost = u[:, 4] * (self.loss - u[:, 8] * self.loss_slope)
        model[:, comp] = u[:, 0] - u[:, 2] * (x - start) - u[:, 3] * bend - lost
        y, stop = log_v[:, ~comp], log_v[:, -1:]
        model[:, ~comp] = u[:, 1] - u[:, 7] * (y - stop)
        of_priors = (unknowns - self.means) / self.deviations
        return np.concatenate([(measured - model) / lines.deviation, of_priors], axis=1)

    def solved(self) -> CompressionFit:
        """The unknowns that make the sum of squares least."""
        unknowns = self.means.copy()
        steps = 1e-3 * np.maximum(self.deviations, 1e-12)
        for _ in range(10):
            probes = np.concatenate([[unknowns], unknowns + np.diag(steps),
                                     unknowns - np.diag(steps)])  # fmt: skip
            residuals = self._residuals(probes)
            count = len(unknowns)
            jacobian = (residuals[1 : count + 1] - residuals[count + 1 :]).T / (2.0 * steps)
            change = np.linalg.lstsq(jacobian, -residuals[0], rcond=None)[0]
            # Largest step of each unknown in one iteration, in its standard deviations: a step of
            # the shift by more than some degrees would leave the range of the tangent.
            most = np.array([1.0, 1.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 0.5])
            size = float(np.max(np.abs(change) / np.maximum(self.deviations, 1e-12) / most))
            unknowns = unknowns + change / max(size, 1.0)
            if np.all(np.abs(change) < 1e-3 * self.deviations):
                break
        rest = self._residuals(unknowns[None])[0]
        covariance = np.linalg.inv(jacobian.T @ jacobian)
        data = rest[: -len(unknowns)]
        excess = max(1.0, math.sqrt(float(data @ data) / max(len(data) - 4, 1)))
        return CompressionFit(
            shift=float(unknowns[8]),
            shift_uncertainty=math.sqrt(covariance[8, 8]) * excess,
            pegging=float(unknowns[5]),
            pegging_uncertainty=math.sqrt(covariance[5, 5]) * excess,
            clearance=float(unknowns[6]),
            loss_angle=float(unknowns[4]),
            exponent=float(unknowns[2]),
            expansion_exponent=float(unknowns[7]),
            misfit=float(rest @ rest),
            excess=excess,
            end=float(self.lines.angle[self.compression][-1]),
        )
