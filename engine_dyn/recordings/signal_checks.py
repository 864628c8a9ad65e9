"""Checks of recorded pressure that speak: what is wrong with a signal, before it is believed.

`examine` makes all of them; each finding is one line that names the place, the number and what is
usual. Ranges without a source are judgement.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator

import numpy as np

from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.recordings.compression_fit import PRIORS, Priors
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry, Finding, RecordedCycles
from engine_dyn.recordings.dead_centre import (
    dead_centre_of_fired,
    dead_centre_of_motored,
    looks_motored,
    text_of,
)
from engine_dyn.recordings.heat_release import mean_pressures, peak_pressures, polytropic_exponent
from engine_dyn.recordings.level import LEVEL_PRIORS, Level
from engine_dyn.recordings.smoothing import noise
from engine_dyn.types import Booleans, Floats
from engine_dyn.units import BAR, DEGREE

LARGEST = 1e10  # Pressure [Pa] beyond which a value is invalid

LEAST_SAMPLES = 16

MOST_DRIFT = 0.05 * BAR
"""Change of the inlet pressure from the first to the last cycle that counts as drift."""


def examine(
    cycles: RecordedCycles,
    geometry: CylinderGeometry,
    *,
    motored: bool | None = None,
    priors: Priors = PRIORS,
    silenced: Collection[str] = (),
    level: Level | None = None,
) -> list[Finding]:
    """Look at a recording with every check.

    Parameters
    ----------
    cycles : RecordedCycles
        Best before smoothing; one cycle or many. Absolute pressure, unless `level` is given.
    geometry : CylinderGeometry
        Of the cylinder; without its compression ratio the dead centre is judged less surely.
    motored : bool, optional
        Whether nothing burns; found from the pressure if not given.
    priors : Priors
        How well pegging and compression ratio are known.
    silenced : collection of str
        Names in `engine_dyn.plausibility.usual_ranges.RECORDING_CHECKS` that are left out.
    level : Level, optional
        Of a recording that was not pegged (`engine_dyn.recordings.level.recorded_level`): the level
        is judged too, and the checks of exponents and dead centre are made at the right one.

    Returns
    -------
    list of Finding
        Empty where nothing is found; `str` makes a line of each. The level stands before the dead
        centre where it changes the torque more.
    """
    useless = _useless(cycles)
    if useless is not None:
        return [] if useless.check in silenced else [useless]
    findings: list[Finding] = []
    for check in (_gaps, _clipped, _noisy, _coarse, _drifting, _gas_exchange):
        findings += check(cycles, geometry)
    if level is not None:
        cycles, motored, priors = level.corrected(cycles), level.motored, LEVEL_PRIORS
        if level.off:
            findings.append(level.finding)
    if motored is None:
        motored = looks_motored(cycles)
    try:
        findings += _exponents(cycles, geometry)
        findings += _dead_centre(cycles, geometry, motored, priors)
    except ValueError as error:
        findings.append(Finding("dead_centre", f"not judged: {error}", math.nan))
    if level is not None and level.shift_change > level.change:
        findings.sort(key=lambda one: one.check == "level")
    return [one for one in findings if one.check not in silenced]


def _useless(cycles: RecordedCycles) -> Finding | None:
    """Finding for signals with nothing to judge: no numbers, no samples, or no change."""
    bad = ~(np.abs(cycles.pressure) < LARGEST)
    if bad.any():
        cycle, sample = (int(i) for i in np.argwhere(bad)[0])
        return Finding(
            "missing",
            f"{bad.sum()} of {bad.size} pressures are not numbers, the first in cycle {cycle + 1} "
            f"at {cycles.angle[sample] / DEGREE:.6g} degree; no other check is made",
            float(bad.sum()),
        )
    count = len(cycles.angle)
    if count < LEAST_SAMPLES:
        text = f"a cycle has {count} samples; at least {LEAST_SAMPLES} are needed for the checks"
        return Finding("samples", text, count)
    if np.ptp(cycles.mean) <= 0.0:
        text = f"the pressure is {cycles.mean[0] / BAR:.6g} bar over the whole cycle"
        return Finding("constant", text, 0.0)
    return None


def _gaps(cycles: RecordedCycles, geometry: CylinderGeometry) -> Iterator[Finding]:
    """Finding for samples that are missing from the grid."""
    angle = cycles.angle
    steps = np.diff(angle, append=angle[0] + cycles.period)
    usual = float(np.median(steps))
    widest = int(np.argmax(steps))
    # Samples are missing where a step of the grid exceeds the usual step by more than the factor
    # below.
    if steps[widest] > 3.0 * usual:
        yield Finding(
            "gap",
            f"no samples from {angle[widest] / DEGREE:.6g} to "
            f"{(angle[widest] + steps[widest]) / DEGREE:.6g} degree; the usual step is "
            f"{usual / DEGREE:.4g} degree",
            float(steps[widest] / DEGREE), "degree",
        )  # fmt: skip


def _clipped(cycles: RecordedCycles, geometry: CylinderGeometry) -> Iterator[Finding]:
    """Finding for a plateau at an extreme pressure, beyond which the curve would go on."""
    p = cycles.pressure
    distinct = np.unique(p)
    resolution = float(np.diff(distinct).min()) if len(distinct) > 1 else 0.0
    rough = max(resolution, float(noise(cycles).mean()))
    for name, extreme, sign in (("largest", p.max(), 1.0), ("smallest", p.min(), -1.0)):
        worst, count = (0, 0, 0), 0
        for row, curve in enumerate(p):
            start, length = _longest_run(curve == extreme)
            # A clipped sensor gives a run of equal extreme samples, at least as many as the number
            # below.
            if length < 3:
                continue
            # Beyond the plateau of a clipped sensor the curve would rise further, by more than the
            # factor below times a step of the converter or the noise's standard deviation.
            if _beyond(sign * curve, start, length) > 5.0 * rough:
                count += 1
                worst = max(worst, (length, row, start))
        if count:
            length, row, start = worst
            at = cycles.angle[start] / DEGREE
            yield Finding(
                "clipped",
                f"{length} samples from {at:.6g} degree on are exactly the {name} pressure, "
                f"{extreme / BAR:.6g} bar (cycle {row + 1}; {count} of {cycles.cycles} cycles); "
                "is the range of the sensor or amplifier too small?",
                float(length),
            )


def _longest_run(same: Booleans) -> tuple[int, int]:
    """First sample and length of the longest run of a closed cycle."""
    if same.all() or not same.any():
        return 0, len(same) if same.all() else 0
    begin = int(np.argmin(same))  # from a change on, so that no run wraps around
    turned = np.roll(same, -begin)
    edges = np.diff(np.concatenate([[0], turned.astype(np.int8), [0]]))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    longest = int(np.argmax(ends - starts))
    return int(starts[longest] + begin) % len(same), int(ends[longest] - starts[longest])


def _beyond(curve: Floats, start: int, length: int) -> float:
    """Height above a plateau of a parabola that has the slopes at both ends."""
    count = len(curve)
    if length >= count - 6:
        return 0.0

    def slope(first: int, last: int) -> float:
        return float(curve[last % count] - curve[first % count]) / (last - first)

    rise = slope(start - 3, start - 1)
    fall = -slope(start + length, start + length + 2)
    if rise <= 0.0 or fall <= 0.0:
        return 0.0
    return 0.5 * (length + 1) * rise * fall / (rise + fall)


def _noisy(cycles: RecordedCycles, geometry: CylinderGeometry) -> Iterator[Finding]:
    """Finding for noise that is large for the range of the pressure."""
    size = float(noise(cycles).mean())
    span = float(np.ptp(cycles.mean))
    # Limit on the noise's standard deviation over the range of the pressure; up to 0.003 is usual.
    if span > 0.0 and size > 0.005 * span:
        yield Finding(
            "noise",
            f"the standard deviation of the noise is {size / BAR:.3g} bar, "
            f"{100.0 * size / span:.2f} % of the range; usual is up to 0.3 %; smooth, or average "
            "over cycles",
            size / BAR, "bar",
        )  # fmt: skip


def _coarse(cycles: RecordedCycles, geometry: CylinderGeometry) -> Iterator[Finding]:
    """Finding for too few samples: every second one gives other results."""
    mean = RecordedCycles(cycles.angle, cycles.mean[None], cycles.period)
    half = RecordedCycles(mean.angle[::2], mean.pressure[:, ::2], mean.period)
    gross = abs(float(mean_pressures(mean, geometry).gross[0]))
    # The gross mean pressure of every engine is above this fraction of the pressure's range.
    gross = max(gross, 1e-6 * float(np.ptp(mean.pressure)))
    work = float(mean_pressures(half, geometry).net[0] - mean_pressures(mean, geometry).net[0])
    peak = float(peak_pressures(half)[0][0] / peak_pressures(mean)[0][0] - 1.0)
    # Noise alone changes imep and peak when samples are left out: three standard deviations of this
    # change are allowed.
    size = float(noise(cycles).mean()) / math.sqrt(cycles.cycles)
    free = 3.0 * size / math.sqrt(len(half.angle))
    # There are too few samples if, when every second one is left out, imep changes by more than
    # 0.5 % of its gross value, or the largest pressure by more than 1 %.
    if abs(work) - free > 0.005 * gross:
        said, value = f"imep by {100.0 * work / gross:+.1f} %", work / gross
    elif abs(peak) - 3.0 * size / float(mean.pressure.max()) > 0.01:
        said, value = f"the largest pressure by {100.0 * peak:+.1f} %", peak
    else:
        return
    step = cycles.period / len(cycles.angle) / DEGREE
    yield Finding(
        "samples",
        f"leaving out every second sample changes {said}: a step of {step:.3g} degree is too "
        "long, so higher orders are aliased onto lower ones; usual is 0.1 to 1 degree",
        value,
    )


def _drifting(cycles: RecordedCycles, geometry: CylinderGeometry) -> Iterator[Finding]:
    """Finding for a pressure level that moves from cycle to cycle."""
    count = cycles.cycles
    if count < 3:
        return
    start = -math.pi if cycles.period == FOUR_STROKE else -100.0 * DEGREE
    at = np.abs(cycles.angle - start) <= 10.0 * DEGREE
    if not at.any():
        return
    level = cycles.pressure[:, at].mean(axis=1)
    number = np.arange(count) - 0.5 * (count - 1)
    slope = float((number * level).sum() / (number**2).sum())
    rest = level - level.mean() - slope * number
    error = math.sqrt(float((rest**2).sum()) / max(count - 2, 1) / float((number**2).sum()))
    change = slope * (count - 1)
    if abs(change) > MOST_DRIFT and abs(slope) > 3.0 * error:
        yield Finding(
            "drift",
            f"the pressure around {start / DEGREE:.0f} degree moves by {change / BAR:+.3g} bar "
            f"from the first to the last of {count} cycles; usual is up to "
            f"{MOST_DRIFT / BAR:g} bar; peg each cycle",
            change / BAR, "bar",
        )  # fmt: skip


def _gas_exchange(cycles: RecordedCycles, geometry: CylinderGeometry) -> Iterator[Finding]:
    """Finding for compression in the revolution of a four-stroke engine's gas exchange."""
    if cycles.period != FOUR_STROKE:
        return
    above = (cycles.mean - cycles.mean.min()) / BAR
    far = np.abs(cycles.angle) > 270.0 * DEGREE
    high, most = float(above[far].max(initial=0.0)), float(above.max())
    # Fraction of the firing compression's pressure rise that the rise at the dead centre of gas
    # exchange, where valves are open, may reach.
    if high > 0.5 * most:
        yield Finding(
            "gas_exchange",
            f"the pressure rises by {high:.3g} bar near the dead centre of gas exchange, by "
            f"{most:.3g} bar near the firing one; is this a two-stroke engine, or one revolution "
            "of each cycle alone?",
            high,
            "bar",
        )


def _exponents(cycles: RecordedCycles, geometry: CylinderGeometry) -> Iterator[Finding]:
    """Finding for exponents of compression and expansion that no gas has."""
    if geometry.compression_ratio is None:
        return
    four = cycles.period == FOUR_STROKE
    mean = RecordedCycles(cycles.angle, cycles.mean[None], cycles.period)
    # Heywood 1988, section 9.5: exponents of 1.3 (+-0.05) in spark-ignition engines; wider for
    # diesel engines, late combustion and heat loss.
    for name, (start, end), (low, high) in (
        ("compression_exponent", (-95.0 if four else -85.0, -40.0), (1.24, 1.42)),
        ("expansion_exponent", (65.0, 105.0 if four else 95.0), (1.1, 1.5)),
    ):
        value = float(polytropic_exponent(mean, geometry, start * DEGREE, end * DEGREE).value[0])
        if not low <= value <= high:
            yield Finding(
                name,
                f"the exponent from {start:g} to {end:g} degree is {value:.3f}; usual is {low:g} "
                f"to {high:g}; is the pressure absolute, the dead centre or the compression ratio "
                f"({geometry.compression_ratio:g}) wrong?",
                value,
            )


def _dead_centre(
    cycles: RecordedCycles, geometry: CylinderGeometry, motored: bool, priors: Priors
) -> Iterator[Finding]:
    """Finding for a dead centre that differs from the engine's."""
    imep = float(mean_pressures(cycles, geometry).net.mean())
    centre = (
        dead_centre_of_motored(cycles, geometry)
        if motored
        else dead_centre_of_fired(cycles, geometry, priors)
    )
    if centre.suspected:
        yield Finding("dead_centre", text_of(centre, imep), centre.shift / DEGREE, "degree")
