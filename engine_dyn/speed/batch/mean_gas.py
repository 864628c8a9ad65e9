"""Mean gas torques of many crank ratios and offsets, from samples of the piston velocity.

The mean of a pressure times the velocity is linear in the velocity, and this is its Fourier series
through TURN_SAMPLES samples: orders from half as many on are 5e-10 at a crank ratio of 0.8. So the
mean is a sum of samples, times factors that depend on the pressure alone: docs/method.md (122).
"""

from __future__ import annotations

import math

from engine_dyn.compilation import kernel, on_stack, wide_vectors
from engine_dyn.geometry.slider_crank import offset_velocity_at, sine_of_top, turned
from engine_dyn.geometry.velocity_harmonics import TURN_SAMPLES
from engine_dyn.speed.tables.work_tables import mean_rate
from engine_dyn.types import Floats, Integers

__all__ = ["mean_gas_of_samples", "means_of_diagrams"]


@kernel
def means_of_diagrams(
    pressures: Floats, curves: Floats, rows: Integers, rates: Floats, means: Floats
) -> None:
    """Mean over angle of the pressure times given curves, docs/method.md (49).

    `pressures` are (diagram, point) at the quadrature points of half intervals, `curves` (curve,
    point). `means` (row of the family, curve) gets those of `rows`; `rates` (point) is scratch.
    """
    for i in range(rows.size):
        for curve in range(curves.shape[0]):
            for place in range(rates.size):
                rates[place] = pressures[i, place] * curves[curve, place]
            means[rows[i], curve] = mean_rate(rates)


@kernel
def mean_gas_of_samples(
    ratio: Floats, offset: Floats, row: Floats, means: Floats, sine: Floats,
    cosine: Floats, result: Floats,
) -> None:  # fmt: skip
    """Mean over angle of p c/(r omega) [Pa], one cylinder.

    `ratio`, `offset` over the crank radius and `row` of the family are those of each design.
    `means` (row, sample) are the factors on samples of the velocity at the angles with this `sine`
    and `cosine`, see `means_of_diagrams`.
    """
    wide_vectors()
    products = on_stack(TURN_SAMPLES)
    for i in range(ratio.size):
        whole = int(math.floor(row[i]))
        weight = row[i] - whole
        first = means[whole]
        second = means[whole + 1] if weight > 0.0 else first
        top = sine_of_top(ratio[i], offset[i])
        upright = math.sqrt(1.0 - top * top)
        for j in range(TURN_SAMPLES):
            s, c = turned(sine[j], cosine[j], top, upright)
            factor = (1.0 - weight) * first[j] + weight * second[j]
            products[j] = factor * offset_velocity_at(s, c, ratio[i], offset[i])
        for half in (32, 16, 8, 4, 2, 1):
            for j in range(half):
                products[j] += products[half + j]
        result[i] = products[0]
