"""Mean gas torques of many crank ratios, from the means of pressures times harmonics."""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined, kernel, on_stack
from engine_dyn.geometry.velocity_harmonics import FEW_TERMS, LARGEST_RATIO, MANY_TERMS
from engine_dyn.speed.tables.work_tables import mean_rate
from engine_dyn.types import Floats, Integers

__all__ = ["mean_gas_of_harmonics", "means_of_diagrams"]

FEW_RATIO = LARGEST_RATIO[FEW_TERMS]
MOST_SAMPLES = 3 * MANY_TERMS // 2


@kernel
def means_of_diagrams(
    pressures: Floats, sines: Floats, rows: Integers, rates: Floats, means: Floats
) -> None:
    """Mean over angle of p sin(k phi) for every term, docs/method.md (49) and (112).

    `pressures` are (diagram, point) at the quadrature points of half intervals, `sines` (term,
    point). `means` (row of the family, term) gets those of `rows`; `rates` (point) is scratch.
    """
    for i in range(rows.size):
        for term in range(sines.shape[0]):
            for place in range(rates.size):
                rates[place] = pressures[i, place] * sines[term, place]
            means[rows[i], term] = mean_rate(rates)


@inlined
def mean_at(
    ratio: float, sine: Floats, cosine: Floats, weights: Floats, samples: Floats, first: Floats,
    second: Floats, weight: float,
) -> float:  # fmt: skip
    """Mean of p v at one crank ratio, between two diagrams."""
    for i in range(sine.size):
        lean = ratio * sine[i]
        samples[i] = sine[i] * cosine[i] / math.sqrt(1.0 - lean * lean)
    total = (1.0 - weight) * first[0] + weight * second[0]
    for term in range(weights.shape[0]):
        factor = 0.0
        for i in range(sine.size):
            factor += weights[term, i] * samples[i]
        mean = (1.0 - weight) * first[term + 1] + weight * second[term + 1]
        total += ratio * factor * mean
    return total


@kernel
def mean_gas_of_harmonics(
    ratio: Floats, row: Floats, means: Floats, sine: Floats, cosine: Floats, weights: Floats,
    more_sine: Floats, more_cosine: Floats, more_weights: Floats, result: Floats,
) -> None:  # fmt: skip
    """Mean over angle of p c/(r omega) [Pa], one cylinder, for paired crank ratios and rows.

    `means` as of `means_of_diagrams`; the other arrays as of
    `velocity_harmonics.weights_of_samples`, for few and for many terms.
    """
    samples = on_stack(MOST_SAMPLES)
    for i in range(ratio.size):
        whole = int(math.floor(row[i]))
        weight = row[i] - whole
        first = means[whole]
        second = means[whole + 1] if weight > 0.0 else first
        if ratio[i] <= FEW_RATIO:
            result[i] = mean_at(ratio[i], sine, cosine, weights, samples, first, second, weight)
        else:
            result[i] = mean_at(
                ratio[i], more_sine, more_cosine, more_weights, samples, first, second, weight
            )
