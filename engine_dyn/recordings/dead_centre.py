"""Whether the recorded dead centre is the engine's, and how surely that is known.

Of fired cycles it is a suspicion, and of large shifts alone: exponents, pegging and compression
ratio enter, and explain smaller ones as well. Of a motored cycle it is a measurement: its largest
pressure lies 0.3 to 1 degree before dead centre, because heat and charge are lost (thermodynamic
loss angle).

Sources: Lancaster, Krieger and Lienesch, SAE paper 750026, 1975 (log p - log V as a check of the
phase); Stas, Thermodynamic determination of TDC in piston combustion engines, SAE paper 960610,
1996, and Tazerout, Le Corre and Rousseau, SAE paper 1999-01-1489 (motored cycles, symmetry; both
from memory, not compared); loss angles as makers of indicating systems state them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from engine_dyn.recordings.compression_fit import (
    GAS_START,
    PRIORS,
    WALL,
    Priors,
    fitted_shift,
    lines_of,
)
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry, RecordedCycles
from engine_dyn.recordings.heat_release import mean_pressures
from engine_dyn.recordings.smoothing import shifted
from engine_dyn.units import BAR, DEGREE

LOSS_ANGLE = (0.3 * DEGREE, 1.0 * DEGREE)
"""Range of angles before dead centre at which the pressure of a motored cycle is largest."""

PEAK_WINDOW = 8.0 * DEGREE

SYMMETRY = (10.0 * DEGREE, 70.0 * DEGREE)
"""Angles at which both sides of a motored cycle are compared, and its charge is still cold."""


@dataclass(frozen=True)
class DeadCentre:
    """The dead centre of fired cycles, as far as they tell it."""

    # Angle by which the recorded pressure comes late [rad], negative if early. Moving the pressure
    # by -shift corrects it.
    shift: float
    uncertainty: float  # Standard uncertainty of the shift [rad]
    suspected: bool  # Whether the shift is large and certain enough to be reported
    imep_of_tenth: float  # Change of imep if the pressure is moved 0.1 degree later [Pa]
    end: float  # Last angle of the compression that was used [rad]


@dataclass(frozen=True)
class MotoredDeadCentre:
    """The dead centre of motored cycles, as far as they tell it."""

    peak: float  # Angle of the largest pressure [rad]
    # Angle by which the recorded pressure comes late [rad]: from its symmetry, or from the peak and
    # the usual loss angle where `symmetry` is NaN.
    shift: float
    uncertainty: float
    # Shift and its uncertainty by the symmetry of the pressure about dead centre [rad]; NaN where
    # pressures are not positive.
    symmetry: float
    symmetry_uncertainty: float
    suspected: bool  # Whether the shift is more than 0.3 degree and two standard uncertainties
    imep_of_tenth: float  # Change of imep if the pressure is moved 0.1 degree later [Pa]


def imep_of_tenth(cycles: RecordedCycles, geometry: CylinderGeometry) -> float:
    """Change of the mean imep if the pressure is moved 0.1 degree later [Pa]."""
    mean = RecordedCycles(cycles.angle, cycles.mean[None], cycles.period)
    late, early = (
        mean_pressures(shifted(mean, sign * 0.1 * DEGREE), geometry).net[0] for sign in (1, -1)
    )
    return float(0.5 * (late - early))


def looks_motored(cycles: RecordedCycles) -> bool:
    """Whether nothing burns: the mean pressure falls as it rose, with its peak near dead centre."""
    peak = _peak(cycles)
    if math.isnan(peak) or abs(peak) > 5.0 * DEGREE:
        return False
    side = 40.0 * DEGREE
    before, behind = np.interp([peak - side, peak + side], cycles.angle, cycles.mean)
    # In a motored cycle, the pressure behind the peak exceeds that before by less than this factor.
    return bool(before > 0.0 and behind < 1.05 * before)


def _peak(cycles: RecordedCycles) -> float:
    """Angle of the largest mean pressure, by a cubic through the samples around the maximum."""
    p = cycles.mean
    top = cycles.angle[int(np.argmax(p))]
    for _ in range(3):  # in each round the window moves with the peak
        at = np.abs(cycles.angle - top) <= PEAK_WINDOW
        if at.sum() < 5:
            return math.nan
        x = (cycles.angle[at] - top) / PEAK_WINDOW
        cubic = np.polynomial.Polynomial.fit(x, p[at], 4, domain=[-1, 1]).deriv()
        roots = cubic.roots()
        real = roots[np.abs(roots.imag) < 1e-9].real
        real = real[np.abs(real) < 0.7]
        real = real[cubic.deriv()(real) < 0.0]
        if not real.size:
            return float(top)
        top = top + PEAK_WINDOW * float(real[np.argmin(np.abs(real))])
    return float(top)


def dead_centre_of_motored(cycles: RecordedCycles, geometry: CylinderGeometry) -> MotoredDeadCentre:
    """Dead centre from cycles without combustion, docs/method.md (132) and (133).

    Raises
    ------
    ValueError
        With too few samples around the peak.
    """
    peak = _peak(cycles)
    if math.isnan(peak):
        raise ValueError("fewer than five samples within 8 degree of the largest pressure")
    low, high = LOSS_ANGLE
    shift, uncertainty = peak + 0.5 * (low + high), (high - low) / math.sqrt(12.0)
    symmetry, symmetry_uncertainty, _ = symmetric_shift(cycles)
    if not math.isnan(symmetry):
        shift, uncertainty = symmetry, symmetry_uncertainty
    # Smaller shifts of motored cycles are not suspected.
    suspected = abs(shift) > max(0.3 * DEGREE, 2.0 * uncertainty)
    return MotoredDeadCentre(
        peak, shift, uncertainty, symmetry, symmetry_uncertainty, suspected,
        imep_of_tenth(cycles, geometry),
    )  # fmt: skip


def symmetric_shift(cycles: RecordedCycles) -> tuple[float, float, float]:
    """Shift of motored cycles, its standard uncertainty and the loss angle, docs/method.md (133).

    A level that is not absolute changes only the shape of the heat loss, and so the shift by some
    hundredths of a degree per 0.1 bar; the volume is not needed.

    Returns
    -------
    tuple of float
        [rad]; NaN where pressures are not positive.
    """
    side = np.arange(0.0, 95.0 * DEGREE + 0.5 * DEGREE, 1.0 * DEGREE)
    used = (side >= SYMMETRY[0]) & (side <= SYMMETRY[1])
    # Means over five degrees at every angle: the relation is linear, and noise averages out.
    window = np.linspace(-2.5 * DEGREE, 2.5 * DEGREE, 21)
    mean, peak = cycles.mean, _peak(cycles)
    shift = peak
    # Each step reduces the remaining shift by a factor of some hundred.
    for _ in range(4):
        behind, before = (
            np.interp(shift + sign * side[:, None] + window, cycles.angle, mean).mean(axis=1)
            for sign in (1.0, -1.0)
        )
        even, odd = 0.5 * (behind + before), 0.5 * (behind - before)
        if not np.all(even > 0.0):
            return math.nan, math.nan, math.nan
        temperature = GAS_START * (even / even[-1]) ** (1.0 - 1.0 / 1.35)
        rate = even**0.8 * temperature**-0.55 * (1.0 - WALL / temperature)
        steps = 0.5 * (rate[1:] + rate[:-1]) * np.diff(side)
        lost = even * np.concatenate([[0.0], np.cumsum(steps)]) / rate[0]
        slope = np.gradient(even, side)
        columns = -np.stack([slope, lost], axis=1)[used]
        solution, *_ = np.linalg.lstsq(columns, odd[used], rcond=None)
        shift += float(solution[0])
    rest = odd[used] - columns @ solution
    # Neighbouring samples are correlated: one in 5 degrees counts as independent.
    count = (SYMMETRY[1] - SYMMETRY[0]) / (5.0 * DEGREE)
    variance = float(rest @ rest) / (count - 2.0)
    scatter = math.sqrt(float(np.linalg.inv(columns.T @ columns)[0, 0]) * variance)
    loss = shift - peak
    # The loss angle is uncertain by the fraction below, because heat loss may have another shape
    # than docs/method.md (131).
    return shift, math.hypot(scatter, 0.2 * loss), loss


def dead_centre_of_fired(
    cycles: RecordedCycles, geometry: CylinderGeometry, priors: Priors = PRIORS
) -> DeadCentre:
    """Dead centre from compression and expansion of cycles with combustion, docs/method.md (130).

    Parameters
    ----------
    cycles : RecordedCycles
        Absolute pressure.
    geometry : CylinderGeometry
        Better with its compression ratio.
    priors : Priors
        How well exponents, pegging and compression ratio are known.

    Raises
    ------
    ValueError
        Where samples of compression or expansion are missing or pressures not positive.
    """
    lines = lines_of(cycles)
    best = fitted_shift(lines, geometry, priors)
    # A shift with a larger uncertainty is not suspected: the lines are too rough, or no engine's.
    known = best.shift_uncertainty <= 2.0 * DEGREE
    # Smaller shifts are not suspected: for one recorded engine they had the wrong sign.
    suspected = known and abs(best.shift) > 4.0 * DEGREE
    return DeadCentre(
        best.shift, best.shift_uncertainty, suspected, imep_of_tenth(cycles, geometry), best.end
    )


def text_of(centre: DeadCentre | MotoredDeadCentre, imep: float) -> str:
    """One line about a suspected shift; `imep` [Pa] is that of the cycles."""
    tenth = f"0.1 degree is worth {centre.imep_of_tenth / BAR:+.3g} bar"
    if imep > 0.0:
        tenth += f" ({100.0 * centre.imep_of_tenth / imep:+.1f} %)"
    tenth += " of imep"
    late = "late" if centre.shift > 0.0 else "early"
    size = f"{abs(centre.shift) / DEGREE:.1f} degree {late}"
    sure = f"standard uncertainty {centre.uncertainty / DEGREE:.1f}"
    if isinstance(centre, MotoredDeadCentre):
        loss = (centre.shift - centre.peak) / DEGREE
        return (
            f"the motored cycle comes {size} (standard uncertainty "
            f"{centre.uncertainty / DEGREE:.2g}): its largest pressure lies at "
            f"{centre.peak / DEGREE:+.2f} degree, {loss:.2f} degree before the middle of its two "
            f"sides; usual is {LOSS_ANGLE[0] / DEGREE:g} to {LOSS_ANGLE[1] / DEGREE:g}; {tenth}"
        )
    return (
        f"compression and expansion look as if the pressure came {size} ({sure}); without a "
        f"motored cycle this is a suspicion; {tenth}"
    )
