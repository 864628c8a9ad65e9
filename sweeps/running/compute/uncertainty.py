"""Bands of results over draws of uncertain values, and what they come from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from engine_dyn import status
from engine_dyn.types import Floats
from sweeps.base.dimensions import EXPLAINED, FAILED_DRAWS, HIGH, LOW, SHARE
from sweeps.scene.plan.blocks import Block, Results
from sweeps.scene.plan.plan import Plan
from sweeps.scene.plan.variations import QUANTILES, Variation


def bands_of(
    plan: Plan, variation: Variation, block: Block, results: Results, others: Sequence[Results]
) -> Results:
    """All variables of bands in a block, from the results of its draws."""
    del plan, block  # as for elasticities, which need them
    assert variation.draws is not None
    bands: Results = {}
    for name in variation.quantities:
        if name not in results:  # it depends on no axis that is divided: the first block has it
            continue
        values = np.stack([draw[name] for draw in others])
        bands[name + LOW], bands[name + HIGH] = _quantiles(values)
        bands[name + EXPLAINED], bands[name + SHARE] = shares(variation.draws, values)
    if "status" in results:
        failed = [~np.isin(draw["status"], status.WITH_NUMBERS) for draw in others]
        bands[FAILED_DRAWS] = np.sum(failed, axis=0).astype(float)
    return bands


def _quantiles(values: Floats) -> tuple[Floats, Floats]:
    """Ends of the band of the draws that have numbers; NaN where none has."""
    known = np.isfinite(values)
    ends = np.full((2, *values.shape[1:]), np.nan)
    some = known.any(axis=0)
    if known.all():
        ends[...] = np.quantile(values, QUANTILES, axis=0)
    elif some.any():
        filled = np.where(known, values, np.nan)
        ends[:, some] = np.nanquantile(filled[:, some], QUANTILES, axis=0)
    return ends[0], ends[1]


def shares(draws: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Shares of the variance of results by a linear regression on the draws.

    Parameters
    ----------
    draws : ndarray, shape (n, k)
        Values of the parameters, drawn independently of each other.
    values : ndarray, shape (n, ...)
        Results; draws without a number are left out.

    Returns
    -------
    explained : ndarray, shape (...)
        The coefficient of determination: 1 where the results are linear.
    share : ndarray, shape (..., k)
        Of each parameter: the square of its standardised regression coefficient.
    """
    shape, many = values.shape[1:], draws.shape[1]
    results = values.reshape(len(values), -1)
    deviation = draws.std(axis=0)
    places = (draws - draws.mean(axis=0)) / np.where(deviation > 0.0, deviation, 1.0)
    known = np.isfinite(results)
    level = np.where(known, results, 0.0).max(axis=0)  # differences of large numbers stay accurate
    size = np.where(np.abs(level) > 0.0, np.abs(level), 1.0)
    count, total, squares = (np.zeros(results.shape[1]) for _ in range(3))
    sums, crossed = (np.zeros((results.shape[1], many)) for _ in range(2))
    products = np.zeros((results.shape[1], many, many))
    # One draw after the other: the bits of a design do not depend on how many are in a block.
    for place, result, is_known in zip(places, results, known, strict=True):
        weight = is_known.astype(float)
        y = np.where(is_known, (result - level) / size, 0.0)
        count += weight
        total += y
        squares += y * y
        sums += weight[:, None] * place
        crossed += y[:, None] * place
        products += weight[:, None, None] * np.outer(place, place)
    number = np.maximum(count, 1.0)[:, None]
    mean, means = total[:, None] / number, sums / number
    variance = squares / number[:, 0] - mean[:, 0] ** 2
    covariance = products / number[..., None] - means[:, :, None] * means[:, None, :]
    crossed = crossed / number - mean * means
    # A variance below this share of the largest value's square is rounding.
    enough = (count > many + 2) & (variance > 1e-20)
    slope = np.zeros_like(crossed)
    if enough.any():
        # Where draws without a number leave only one value of a parameter, it has no slope.
        # Smaller eigenvalues of the covariance, as shares of the largest, are rounding.
        inverse = np.linalg.pinv(covariance[enough], rcond=1e-10, hermitian=True)
        slope[enough] = (inverse @ crossed[enough][..., None])[..., 0]
    whole = np.where(enough, variance, 1.0)[:, None]
    share = slope**2 * np.einsum("mii->mi", covariance) / whole
    explained = (slope * crossed).sum(axis=1) / whole[:, 0]
    share[count == 0.0], explained[count == 0.0] = np.nan, np.nan
    return explained.reshape(shape), share.reshape(*shape, many)
