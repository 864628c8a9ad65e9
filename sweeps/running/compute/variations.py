"""Elasticities and bands: what the results of changed designs, and of draws, are combined to.

Derivatives are central differences for three steps h, h/4 and h/16. Two of them at a time are
extrapolated to the step zero (L. F. Richardson 1911): D(h) = D + a h^2 gives
D = D(h/4) + (D(h/4) - D(h))/15.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn import status
from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.quantities.node import Node
from engine_dyn.types import Floats
from sweeps.base.dimensions import ELASTICITY, EXPLAINED, FAILED_DRAWS, HIGH, LOW, SHARE
from sweeps.scene.model import Scene
from sweeps.scene.plan.blocks import Block, Results, aligned, index_of
from sweeps.scene.plan.plan import Plan
from sweeps.scene.plan.variations import (
    AGREE,
    DIFFER,
    ENDINGS,
    KIND,
    ONE_SIDE,
    QUANTILES,
    RATIO,
    STEPS,
    UNKNOWN,
    Variation,
    changed_values,
    step_unit,
)


@dataclass(frozen=True)
class Derivative:
    """Derivatives of one result, arrays of one shape."""

    # Derivative, from both sides where they are known, and an estimate of its error.
    value: Floats
    error: Floats
    # Changes of the result for a smaller and for a larger value of the parameter.
    below: Floats
    above: Floats
    kind: npt.NDArray[np.int8]  # Number of a word in `sweeps.scene.plan.variations.KINDS`


def derivative(
    middle: Floats, sides: Sequence[tuple[Floats, Floats]], steps: Sequence[Floats]
) -> Derivative:
    """Derivative of a result from its values at `STEPS` below and above.

    Parameters
    ----------
    middle : ndarray
        The result.
    sides : sequence of (ndarray, ndarray)
        For each step the result below and above; NaN where there is none.
    steps : sequence of ndarray
        The steps, each `RATIO` times as large as the next.
    """
    # Results have relative errors of some 1e-9 that do not vary smoothly from one design to the
    # next; difference quotients divide them by the step.
    noise = [1e-9 * np.abs(middle) / step for step in steps]
    central = [(up - down) / (2.0 * h) for (down, up), h in zip(sides, steps, strict=True)]
    below = [(middle - down) / h for (down, _), h in zip(sides, steps, strict=True)]
    above = [(up - middle) / h for (_, up), h in zip(sides, steps, strict=True)]

    with np.errstate(invalid="ignore"):
        coarse, fine = (_extrapolated(central[k], central[k + 1], 2) for k in (0, 1))
        errors = [
            np.abs(one - central[k + 1]) + noise[k + 1] for k, one in enumerate((coarse, fine))
        ]
        first = errors[0] <= errors[1]  # False where the larger steps leave the allowed range
        value, error = np.where(first, coarse, fine), np.where(first, errors[0], errors[1])
        down, up = (_extrapolated(side[1], side[2], 1) for side in (below, above))
        down_error, up_error = (
            np.abs(one - side[2]) + noise[2] for one, side in ((down, below), (up, above))
        )
        largest = np.maximum(np.abs(down), np.abs(up))
        # Derivatives on both sides are kept apart where they differ by more than 1 %.
        differ = np.abs(up - down) > 0.01 * largest + 6.0 * noise[2]

    kind = np.full(np.shape(middle), AGREE, dtype=np.int8)
    kind[differ] = DIFFER
    value = np.where(differ, 0.5 * (down + up), value)
    error = np.where(differ, 0.5 * (down_error + up_error), error)
    one_side = ~np.isfinite(value) & (np.isfinite(down) | np.isfinite(up))
    kind[one_side] = ONE_SIDE
    has_up = np.isfinite(up)
    value = np.where(one_side, np.where(has_up, up, down), value)
    error = np.where(one_side, np.where(has_up, up_error, down_error), error)
    kind[~np.isfinite(value)] = UNKNOWN
    return Derivative(value, error, down, up, kind)


def _extrapolated(coarse: Floats, fine: Floats, order: int) -> Floats:
    """Richardson's extrapolation of differences with an error of one order in the step."""
    return fine + (fine - coarse) / (RATIO**order - 1.0)


def elasticities_of(
    plan: Plan, variation: Variation, block: Block, results: Results, others: Sequence[Results]
) -> Results:
    """All variables of elasticities in a block, from its results and those of the changed plans."""
    elasticities: Results = {}
    count = 2 * len(STEPS)
    for quantity in variation.quantities:
        if quantity not in results:  # The first block alone has what depends on no divided axis
            continue
        middle = results[quantity]
        for ending in ENDINGS:
            kind = np.int8 if ending == KIND else np.float64
            elasticities[quantity + ending] = np.zeros(
                (*middle.shape, len(variation.keys)), dtype=kind
            )
        for place, key in enumerate(variation.keys):
            leaf, dims = plan.leaves[key], plan.dims(quantity)
            if not set(leaf.dims) <= set(dims):
                continue  # The parameter varies along an axis on which this result does not depend
            changed = [other[quantity] for other in others[place * count : (place + 1) * count]]
            values = aligned(np.asarray(leaf.data)[index_of(leaf.dims, block)], leaf.dims, dims)
            here = _of_parameter(plan.scene, PARAMETERS[key], values, middle, changed)
            here["_derivative"] /= plan.computed[quantity].node.si
            for ending, one in here.items():
                elasticities[quantity + ending][..., place] = one
    return elasticities


def _of_parameter(
    scene: Scene, node: Node, values: Floats, middle: Floats, changed: Sequence[Floats]
) -> dict[str, npt.NDArray[Any]]:
    """Variables of one quantity by one parameter, by their endings."""
    # `changed` are the results at the changed values, in the order of `changed_values`.
    unit, relative = step_unit(node, values)
    steps = [np.broadcast_to(step * unit, middle.shape) for step in STEPS]
    sides = [
        np.where(allowed, result, np.nan)
        for (_, allowed), result in zip(changed_values(scene, node, values), changed, strict=True)
    ]
    got = derivative(middle, list(zip(sides[::2], sides[1::2], strict=True)), steps)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.where(relative & (middle != 0.0), values / middle, np.nan)
    return {
        ELASTICITY: got.value * scale,
        f"{ELASTICITY}_error": got.error * np.abs(scale),
        f"{ELASTICITY}_below": got.below * scale,
        f"{ELASTICITY}_above": got.above * scale,
        KIND: got.kind,
        "_derivative": got.value,
    }


def bands_of(variation: Variation, results: Results, others: Sequence[Results]) -> Results:
    """All variables of bands in a block, from the results of its draws."""
    assert variation.draws is not None
    bands: Results = {}
    for name in variation.quantities:
        if name not in results:  # The result depends on no divided axis: the first block has it
            continue
        values = np.stack([draw[name] for draw in others])
        bands[name + LOW], bands[name + HIGH] = _quantiles(values)
        bands[name + EXPLAINED], bands[name + SHARE] = shares(variation.draws, values)
    if "status" in results:
        failed = [~np.isin(draw["status"], status.WITH_NUMBERS) for draw in others]
        bands[FAILED_DRAWS] = np.sum(failed, axis=0).astype(float)
    return bands


def _quantiles(values: Floats) -> tuple[Floats, Floats]:
    """Ends of the band of the draws that have numbers; NaN without any."""
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
    # The largest value is subtracted from the others, so that their differences stay accurate.
    level = np.where(known, results, 0.0).max(axis=0)
    size = np.where(np.abs(level) > 0.0, np.abs(level), 1.0)
    count, total, squares = (np.zeros(results.shape[1]) for _ in range(3))
    sums, crossed = (np.zeros((results.shape[1], many)) for _ in range(2))
    products = np.zeros((results.shape[1], many, many))
    # Draws are added one after the other: the bits of a design do not depend on its block.
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
    # A variance below 1e-20 times the square of the largest value is rounding.
    enough = (count > many + 2) & (variance > 1e-20)
    slope = np.zeros_like(crossed)
    if enough.any():
        # Draws without a number are left out: a parameter with one value among the others has no
        # slope. Eigenvalues of the covariance below 1e-10 times the largest are rounding.
        inverse = np.linalg.pinv(covariance[enough], rcond=1e-10, hermitian=True)
        slope[enough] = (inverse @ crossed[enough][..., None])[..., 0]
    whole = np.where(enough, variance, 1.0)[:, None]
    share = slope**2 * np.einsum("mii->mi", covariance) / whole
    explained = (slope * crossed).sum(axis=1) / whole[:, 0]
    share[count == 0.0], explained[count == 0.0] = np.nan, np.nan
    return explained.reshape(shape), share.reshape(*shape, many)
