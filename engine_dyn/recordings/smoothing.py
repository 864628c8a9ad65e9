"""Noise of recorded pressure, smoothing, thinning, and delays of the measuring chain.

Smoothing needs scipy (`pip install 'engine-dyn[lab]'`); the rest does not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from engine_dyn.recordings.cylinder_geometry import CylinderGeometry, RecordedCycles
from engine_dyn.recordings.heat_release import (
    delayed,
    mean_pressures,
    misfit_of_neighbours,
    peak_pressures,
    slopes,
)
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE


def noise(cycles: RecordedCycles) -> Floats:
    """Standard deviation of the noise of each cycle [Pa], docs/method.md (127).

    From what each sample differs from the cubic through its four neighbours: what varies over a
    few samples counts as noise, steps of a converter too. The median keeps combustion out of it.
    """
    # The factor is the standard deviation of a normal distribution over the median of its absolute
    # values.
    return np.asarray(1.4826 * np.median(np.abs(misfit_of_neighbours(cycles)), axis=1))


def even_step(cycles: RecordedCycles) -> float | None:
    """Step of the grid [rad] where it is even over the whole cycle; None where it is not."""
    step = cycles.period / len(cycles.angle)
    steps = np.diff(cycles.angle, append=cycles.angle[0] + cycles.period)
    return step if np.all(np.abs(steps - step) < 1e-3 * step) else None


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Smoothed cycles, and what the smoothing does to them."""

    cycles: RecordedCycles  # The smoothed cycles
    # Order of the revolution whose power is halved (-3 dB); higher orders are lost.
    highest_order: float
    # Mean standard deviation of the noise before and after smoothing [Pa].
    noise_before: float
    noise_after: float
    # Mean changes of imep and of the largest pressure by smoothing [Pa].
    imep_change: float
    peak_change: float


def smooth(
    cycles: RecordedCycles,
    geometry: CylinderGeometry,
    method: str = "savitzky_golay",
    *,
    width: float = 4.0 * DEGREE,
    degree: int = 3,
    highest_order: float = 60.0,
) -> Smoothed:
    """Smooth cycles and tell what it costs, docs/method.md (128).

    Parameters
    ----------
    cycles : RecordedCycles
        On an even grid.
    geometry : CylinderGeometry
        For the imep; the compression ratio is not needed.
    method : {"savitzky_golay", "low_pass"}
        Polynomial of `degree` over a window of `width` [rad] around each sample; or Butterworth's
        filter of fourth order that lets pass orders of the revolution up to `highest_order`,
        forward and backward, so that nothing is delayed.

    Raises
    ------
    ValueError
        For another method, an uneven grid, a window of fewer samples than the polynomial needs, or
        an order above what the grid can hold.
    ImportError
        Without scipy.
    """
    step = even_step(cycles)
    if step is None:
        raise ValueError("angle: must be evenly spaced to be smoothed")
    if method == "savitzky_golay":
        pressure, order = _savitzky_golay(cycles, step, width, degree)
    elif method == "low_pass":
        pressure, order = _low_pass(cycles, step, highest_order), highest_order
    else:
        raise ValueError(f"method = {method!r}: must be savitzky_golay or low_pass")
    after = RecordedCycles(cycles.angle, pressure, cycles.period)

    def change(of: Callable[[RecordedCycles], Floats]) -> float:
        return float(np.mean(of(after) - of(cycles)))

    return Smoothed(
        after,
        order,
        float(noise(cycles).mean()),
        float(noise(after).mean()),
        change(lambda c: mean_pressures(c, geometry).net),
        change(lambda c: peak_pressures(c)[0]),
    )


def _joined(cycles: RecordedCycles, margin: int) -> Floats:
    """All cycles one after the other; at both ends the outer cycle is repeated."""
    first, last = cycles.pressure[0], cycles.pressure[-1]
    before = np.resize(first[::-1], margin)[::-1]
    return np.concatenate([before, cycles.pressure.ravel(), np.resize(last, margin)])


def _savitzky_golay(
    cycles: RecordedCycles, step: float, width: float, degree: int
) -> tuple[Floats, float]:
    from scipy.signal import savgol_coeffs, savgol_filter

    samples = 2 * round(0.5 * width / step) + 1
    if samples <= degree or samples > len(cycles.angle) // 4:
        raise ValueError(
            f"width = {width / DEGREE:g} degree: has {samples} samples; must have more than "
            f"degree = {degree}, and less than a quarter of the cycle's {len(cycles.angle)}"
        )
    curve = savgol_filter(_joined(cycles, samples), samples, degree)[samples:-samples]
    weights = savgol_coeffs(samples, degree)
    # Response of the symmetric window, a sum of cosines, down to half the power.
    orders = np.linspace(0.0, math.pi / step, 4001)
    places = np.arange(samples) - samples // 2
    response = np.cos(np.outer(orders * step, places)) @ weights
    below = np.flatnonzero(response**2 < 0.5)
    order = float(orders[below[0]]) if below.size else float(orders[-1])
    return np.asarray(curve).reshape(cycles.pressure.shape), order


def _low_pass(cycles: RecordedCycles, step: float, order: float) -> Floats:
    from scipy.signal import butter, sosfiltfilt

    most = math.pi / step
    if not 0.0 < order < most:
        raise ValueError(f"highest_order = {order:g}: must be above 0 and below {most:g}, which "
                         "the grid can hold")  # fmt: skip
    # After both passes the power is 1/(1 + (order/corner)^8)^2, which is a half at the order.
    corner = min(order * (math.sqrt(2.0) - 1.0) ** (-1.0 / 8.0), 0.999 * most)
    sections = butter(4, corner / most, output="sos")
    margin = len(cycles.angle)
    curve = sosfiltfilt(sections, _joined(cycles, margin), padlen=0)[margin:-margin]
    return np.asarray(curve).reshape(cycles.pressure.shape)


def thinned(cycles: RecordedCycles, every: int) -> RecordedCycles:
    """Keep every so many samples; smooth before, or noise and higher orders fold down.

    Raises
    ------
    ValueError
        Unless `every` is 1 or more and leaves at least 36 samples of each cycle.
    """
    if every < 1 or len(cycles.angle) // every < 36:
        raise ValueError(f"every = {every}: must be 1 or more and leave 36 samples of each cycle")
    return RecordedCycles(cycles.angle[::every], cycles.pressure[:, ::every], cycles.period)


def shifted(cycles: RecordedCycles, angle: float) -> RecordedCycles:
    """Return the cycles with their pressure moved `angle` [rad] later, on the same angles."""
    return RecordedCycles(cycles.angle, delayed(cycles, angle), cycles.period)


def without_delay(
    cycles: RecordedCycles, speed: float, delay: float = 0.0, time_constant: float = 0.0
) -> RecordedCycles:
    """Take out what the measuring chain delays, docs/method.md (129).

    Parameters
    ----------
    speed : float
        Crank speed [rad/s].
    delay : float
        Time by which the signal comes late [s].
    time_constant : float
        Of a first-order lag (sensor, amplifier) [s]; taking it out amplifies noise: smooth before.

    Raises
    ------
    ValueError
        Of times that are negative, and of a speed that is not above 0.
    """
    if not speed > 0.0:
        raise ValueError(f"speed = {speed:g} rad/s: must be above 0")
    for name, value in (("delay", delay), ("time_constant", time_constant)):
        if not 0.0 <= value < math.inf:
            raise ValueError(f"{name} = {value:g} s: must be 0 or more")
    corrected = shifted(cycles, -speed * delay) if delay else cycles
    if time_constant:
        raised = corrected.pressure + speed * time_constant * slopes(corrected)
        corrected = RecordedCycles(corrected.angle, raised, corrected.period)
    return corrected
