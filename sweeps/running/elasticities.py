"""Differences of the results of changed designs: derivatives, elasticities and their errors.

They are central differences for three steps h, h/4 and h/16. Two of them at a time are extrapolated
to the step zero (L. F. Richardson 1911): D(h) = D + a h^2 gives D = D(h/4) + (D(h/4) - D(h))/15.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.types import Floats
from sweeps.dimensions import ELASTICITY
from sweeps.planning.blocks import Block, along
from sweeps.planning.elasticities import (
    AGREE,
    DIFFER,
    ENDINGS,
    KIND,
    ONE_SIDE,
    RATIO,
    STEPS,
    UNKNOWN,
    Changed,
)
from sweeps.planning.plan import Plan
from sweeps.scene.known_values import Value

__all__ = ["Derivative", "Results", "derivative", "differences"]

Results = dict[str, npt.NDArray[Any]]

NOISE = 1e-9
"""Relative errors of results that do not vary smoothly from one design to the next."""

DIFFERENCE = 0.01
"""Relative difference of the derivatives on both sides from which they are told apart."""


@dataclass(frozen=True)
class Derivative:
    """Derivatives of one result, arrays of one shape.

    Attributes
    ----------
    value, error : ndarray
        The derivative, of both sides where they are known, and an estimate of its error.
    below, above : ndarray
        Where the parameter decreases, and where it increases.
    kind : ndarray of int
        `sweeps.planning.elasticities.KINDS`.
    """

    value: Floats
    error: Floats
    below: Floats
    above: Floats
    kind: npt.NDArray[np.int8]


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
    noise = [NOISE * np.abs(middle) / step for step in steps]
    central = [(up - down) / (2.0 * h) for (down, up), h in zip(sides, steps, strict=True)]
    below = [(middle - down) / h for (down, _), h in zip(sides, steps, strict=True)]
    above = [(up - middle) / h for (_, up), h in zip(sides, steps, strict=True)]

    with np.errstate(invalid="ignore"):
        coarse, fine = (_extrapolated(central[k], central[k + 1], 2) for k in (0, 1))
        errors = [
            np.abs(one - central[k + 1]) + noise[k + 1] for k, one in enumerate((coarse, fine))
        ]
        first = errors[0] <= errors[1]  # False where the larger steps leave what is allowed
        value, error = np.where(first, coarse, fine), np.where(first, errors[0], errors[1])
        down, up = (_extrapolated(side[1], side[2], 1) for side in (below, above))
        down_error, up_error = (
            np.abs(one - side[2]) + noise[2] for one, side in ((down, below), (up, above))
        )
        largest = np.maximum(np.abs(down), np.abs(up))
        differ = np.abs(up - down) > DIFFERENCE * largest + 6.0 * noise[2]

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
    """Richardson's extrapolation of differences whose error begins with this power of the step."""
    return fine + (fine - coarse) / (RATIO**order - 1.0)


def differences(
    plan: Plan,
    chosen: Sequence[Block],
    computed: Callable[[Plan], Iterator[tuple[Block, Results]]],
) -> Iterator[Callable[[Results], Results]]:
    """Yield, for each block, a function that returns its elasticities, given its results.

    `computed` computes the chosen blocks of a plan. Those of all changed plans are computed side by
    side, so that no more than a block of any exists at a time.
    """
    assert plan.elasticities is not None
    running = [
        (one, [tuple(computed(side) for side in pair) for pair in one.plans])
        for one in plan.elasticities.changed
    ]
    for block in chosen:

        def of_block(results: Results, block: Block = block) -> Results:
            changed = [
                (one, [tuple(next(side)[1] for side in pair) for pair in pairs])
                for one, pairs in running
            ]
            return _of_block(plan, block, results, changed)

        yield of_block


def _of_block(
    plan: Plan,
    block: Block,
    results: Results,
    changed: Sequence[tuple[Changed, list[tuple[Results, ...]]]],
) -> Results:
    """All variables of the elasticities in a block."""
    assert plan.elasticities is not None
    found: Results = {}
    for quantity in plan.elasticities.quantities:
        if quantity not in results:  # it depends on no axis that is cut: the first block has it
            continue
        dims, middle = plan.dims(quantity), results[quantity]
        for ending in ENDINGS:
            kind = np.int8 if ending == KIND else np.float64
            found[quantity + ending] = np.empty((*middle.shape, len(changed)), dtype=kind)
        for place, (one, pairs) in enumerate(changed):
            if not set(one.value.dims) <= set(dims):
                # The parameter varies along an axis on which this result does not depend.
                for ending in ENDINGS:
                    found[quantity + ending][..., place] = 0
                continue
            sides = [
                tuple(
                    np.where(_aligned(possible, dims, block), side[quantity], np.nan)
                    for side, possible in zip(pair, one.possible[step], strict=True)
                )
                for step, pair in enumerate(pairs)
            ]
            here = _variables(plan, quantity, middle, sides, one, block)
            for ending, values in here.items():
                found[quantity + ending][..., place] = values
    return found


def _variables(
    plan: Plan, quantity: str, middle: Floats, sides: Sequence[tuple[Floats, ...]], one: Changed,
    block: Block,
) -> dict[str, npt.NDArray[Any]]:  # fmt: skip
    """Variables of one quantity by one parameter, by their endings."""
    dims = plan.dims(quantity)
    unit = _aligned(one.unit, dims, block)
    steps = [np.broadcast_to(step * unit, middle.shape) for step in STEPS]
    got = derivative(middle, [(pair[0], pair[1]) for pair in sides], steps)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.where(
            _aligned(one.relative, dims, block) & (middle != 0.0),
            _aligned(one.value, dims, block) / middle,
            np.nan,
        )
    (si,) = (stage.node.si for stage in plan.stages if stage.node.name == quantity)
    return {
        ELASTICITY: got.value * scale,
        f"{ELASTICITY}_error": got.error * np.abs(scale),
        f"{ELASTICITY}_below": got.below * scale,
        f"{ELASTICITY}_above": got.above * scale,
        KIND: got.kind,
        "_derivative": got.value / si,
    }


def _aligned(value: Value, dims: tuple[str, ...], block: Block) -> npt.NDArray[Any]:
    """Values of a block, with one axis for each of `dims`."""
    data = np.asarray(value.data)[along(value.dims, block)] if value.dims else value.data
    shape = [1] * len(dims)
    for dimension, size in zip(value.dims, np.shape(data), strict=True):
        shape[dims.index(dimension)] = size
    return np.reshape(data, shape)
