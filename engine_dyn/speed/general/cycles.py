"""What the two methods that repeat cycles need, for one design.

These methods reproduce printed numbers and serve for comparison. Here are the samples that method
`thesis` steps through, its run for one design, and the outcome of both methods.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from engine_dyn.compilation import inlined, rows_on_stack
from engine_dyn.geometry.slider_crank import (
    acceleration_at,
    offset_acceleration_at,
    offset_velocity_at,
    sine_of_top,
    turned,
    velocity_at,
)
from engine_dyn.loads.friction import (
    level_over_mean_at,
    stroke_friction_parts_at,
    varies_at,
)
from engine_dyn.speed.fields import (
    BORE,
    DOUBLE_RADIUS,
    EXPONENT,
    FRICTION_TORQUE,
    INERTIA,
    MASS,
    OFFSET,
    PASSES,
    SPEED,
    START_ANGLE,
    START_SPEED,
)
from engine_dyn.speed.general.euler import step_cycles
from engine_dyn.speed.general.picard import MOST_CYCLES
from engine_dyn.speed.tables.work_tables import Blend
from engine_dyn.status import CONVERGED, NOT_CONVERGED, PASSES_DONE, STALLED, TOLERANCE_NOT_MET
from engine_dyn.types import Floats, Integers

__all__ = ["SAMPLE_ROWS", "Samples", "outcome", "run_euler", "sample_shapes"]


class Samples(NamedTuple):
    """Pressure and angle of every cylinder at the samples of the thesis's method.

    `pressure` is (diagram, cylinder, sample), sine and cosine are (cylinder, sample); `masses` and
    `radii` have the factors on the mass and the crank radius of each cylinder.
    """

    pressure: Floats
    sine: Floats
    cosine: Floats
    masses: Floats
    radii: Floats


SAMPLE_ROWS = 9
GAS_SHAPE, MASS_SHAPE, SQUARES, SQUARES_SLOPE, TORQUES, THETA, THETA_SLOPE, SPEEDS, RATES = range(
    SAMPLE_ROWS
)


@inlined
def sample_shapes(
    ratio: float, offset: float, blend: Blend, samples: Samples, sampled: Floats
) -> None:
    """Sums over cylinders at each sample, docs/method.md (33).

    These are (p - p_c) v, -b v, v^2 less its mean, and 2 v b. From the first, the friction over the
    stroke is subtracted, less its mean over the samples.
    """
    cylinders, count = samples.sine.shape
    plain = offset == 0.0
    for i in range(cylinders):
        plain = plain and samples.masses[i] == 1.0 and samples.radii[i] == 1.0
    mean = 0.0
    for j in range(count):
        gas = shape = square = slope = 0.0
        for i in range(cylinders):
            pressure = sample_of(blend, samples, i, j)
            if plain:
                v = velocity_at(samples.sine[i, j], samples.cosine[i, j], ratio)
                b = acceleration_at(samples.sine[i, j], samples.cosine[i, j], ratio)
                gas += (pressure - blend.crankcase) * v
                shape -= b * v
                square += v * v
                slope += 2.0 * v * b
                continue
            radius = samples.radii[i]
            own_ratio, own_offset = ratio * radius, offset / radius
            top = sine_of_top(own_ratio, own_offset)
            s, c = turned(samples.sine[i, j], samples.cosine[i, j], top, math.sqrt(1.0 - top * top))
            v = radius * offset_velocity_at(s, c, own_ratio, own_offset)
            b = samples.masses[i] * radius * offset_acceleration_at(s, c, own_ratio, own_offset)
            gas += (pressure - blend.crankcase) * v
            shape -= b * v
            square += samples.masses[i] * v * v
            slope += 2.0 * v * b
        sampled[GAS_SHAPE, j] = gas
        sampled[MASS_SHAPE, j] = shape
        sampled[SQUARES, j] = square
        sampled[SQUARES_SLOPE, j] = slope
        mean += square
    mean /= count
    for j in range(count):
        sampled[SQUARES, j] -= mean
    if varies_at(blend.friction):
        for i in range(cylinders):
            subtract_stroke_friction(ratio, offset, blend, samples, i, sampled)


@inlined
def sample_of(blend: Blend, samples: Samples, cylinder: int, place: int) -> float:
    """Pressure of a blend in one cylinder at one sample."""
    return blend.scale * (
        (1.0 - blend.weight) * samples.pressure[blend.first, cylinder, place]
        + blend.weight * samples.pressure[blend.second, cylinder, place]
    )


@inlined
def subtract_stroke_friction(
    ratio: float, offset: float, blend: Blend, samples: Samples, cylinder: int, sampled: Floats
) -> None:
    """Subtract the friction of one cylinder, less its mean, from the gas: docs/method.md (32)."""
    friction, count = blend.friction, samples.sine.shape[1]
    radius = samples.radii[cylinder]
    own_ratio, own_offset = ratio * radius, offset / radius
    top = sine_of_top(own_ratio, own_offset)
    upright = math.sqrt(1.0 - top * top)
    parts = rows_on_stack(4 * count)
    for j in range(count):
        sine = samples.sine[cylinder, j]
        s, c = turned(sine, samples.cosine[cylinder, j], top, upright)
        load = friction.ring + sample_of(blend, samples, cylinder, j) - blend.crankcase
        found = stroke_friction_parts_at(
            load, offset_velocity_at(s, c, own_ratio, own_offset), sine
        )
        for k in range(4):
            parts[k * count + j] = found[k]
    levels = friction.boundary, friction.mixed, friction.hydrodynamic, friction.skirt
    for k in range(4):
        part = parts[k * count : (k + 1) * count]
        mean = 0.0
        for j in range(count):
            mean += part[j] / count
        for j in range(count):
            sampled[GAS_SHAPE, j] -= level_over_mean_at(levels[k], mean) * (part[j] - mean)


@inlined
def run_euler(
    values: Floats, at: Integers, idle: bool, variable: bool, period: float, sampled: Floats
) -> tuple[int, bool, bool, float, float, float]:
    """Method `thesis` for the design whose inputs lie at `at`: docs/method.md (27) and (83).

    The rows SPEEDS and RATES get the last cycle. The coefficient k follows from the mean of the
    samples, as in the thesis. Returns what `euler.step_cycles` returns.
    """
    count = sampled.shape[1]
    speed = values[at[SPEED]]
    radius = 0.5 * values[at[DOUBLE_RADIUS]]
    lever = 0.25 * math.pi * values[at[BORE]] ** 2 * radius
    moving = values[at[MASS]] * radius * radius  # m r^2
    mean = 0.0
    for j in range(count):
        gas = lever * sampled[GAS_SHAPE, j] - values[at[FRICTION_TORQUE]]
        inertia = moving * speed * speed * sampled[MASS_SHAPE, j]
        mean += gas + inertia
        if variable:
            sampled[TORQUES, j] = gas
            sampled[THETA, j] = values[at[INERTIA]] + moving * sampled[SQUARES, j]
            sampled[THETA_SLOPE, j] = moving * sampled[SQUARES_SLOPE, j]
        else:
            sampled[TORQUES, j] = gas + inertia
            sampled[THETA, j] = values[at[INERTIA]]
            sampled[THETA_SLOPE, j] = 0.0
    surplus = 0.0 if idle else mean / count - values[at[OFFSET]]
    first = int(round(values[at[START_ANGLE]] / period * count)) + count // 2
    return step_cycles(
        sampled[TORQUES],
        sampled[THETA],
        sampled[THETA_SLOPE],
        count,
        period / count,
        values[at[OFFSET]],
        surplus / speed ** values[at[EXPONENT]],
        values[at[EXPONENT]],
        start_speed(values, at),
        first % count,
        int(values[at[PASSES]]),
        MOST_CYCLES,
        sampled[SPEEDS],
        sampled[RATES],
    )


@inlined
def start_speed(values: Floats, at: Integers) -> float:
    """Speed at which the cycles start: the nominal one unless given [rad/s]."""
    given = values[at[START_SPEED]]
    return given if given > 0.0 else values[at[SPEED]]


@inlined
def outcome(stalled: bool, passes: int, closed: bool, error: float, tolerance: float) -> int:
    """Status of a design whose cycles were repeated."""
    if stalled:
        return STALLED
    if passes > 0:
        return PASSES_DONE
    if not closed:
        return NOT_CONVERGED
    return CONVERGED if error <= tolerance else TOLERANCE_NOT_MET
