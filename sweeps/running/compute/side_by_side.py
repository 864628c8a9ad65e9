"""Several engines in one archive: each is computed as if it were alone, and put into its place.

What an engine does not have stays missing: numbers are NaN, and the outcome of a design whose
solution was not asked for, because its engine lacks what it needs, is `invalid_input`.

Firing patterns that repeat sooner than all of them together are computed over their own cycles in
the same way. Their curves repeat, and orders that do not belong to their period are 0.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.quantities.graph import DIMENSIONS
from engine_dyn.status import INVALID_INPUT
from engine_dyn.types import Integers
from sweeps.scene.plan.blocks import Block, Results, aligned, belongs, shape_in
from sweeps.scene.plan.plan import Part, Plan


def side_by_side(
    plan: Plan, block: Block, compute: Sequence[Callable[[Block], Results]],
    all_in_each: bool = False,
) -> Results:  # fmt: skip
    """Outputs of a block of a plan that has parts.

    `compute` gives, for each part, all outputs of one of its own blocks; for `all_in_each` see
    `Computation`.
    """
    every = {name: plan.dims(name) for name in plan.outputs}
    outputs = {n: dims for n, dims in every.items() if all_in_each or belongs(block, dims)}
    results: Results = {}
    for part, compute_block in zip(plan.parts, compute, strict=True):
        places = {
            d: _places(part, d, block.get(d, slice(0, plan.sizes[d])))
            for d in {d for dims in outputs.values() for d in dims} | block.keys()
        }
        if not all(places[d][0].size for d in block):
            continue  # no design of this part lies in the block
        own = {d: places[d][1] for d in block if d in part.plan.scene.dimensions}
        for name, values in compute_block(own).items():
            if name in outputs:
                if name not in results:
                    results[name] = _empty(plan, name, block, values.dtype)
                dims = outputs[name]
                here = np.ix_(*(places[d][0] for d in dims))
                own_values = aligned(values, part.plan.dims(name), dims)
                results[name][here] = _spread(own_values, part, dims)
    for name in outputs:
        if name not in results:
            results[name] = _empty(plan, name, block, np.int8 if name == "status" else np.float64)
    return results


def _spread(values: npt.NDArray[Any], part: Part, dims: tuple[str, ...]) -> npt.NDArray[Any]:
    """Results at all points of the whole plan, from those at a part's own points."""
    for axis, dimension in enumerate(dims):
        own = part.own.get(dimension)
        if own is not None:
            values = np.take(values, own, axis=axis)
            other = (own < 0).reshape([-1 if d == dimension else 1 for d in dims])
            if other.any():
                values = np.where(other & ~np.isnan(values), 0.0, values)
    return values


def _places(part: Part, dimension: str, within: slice) -> tuple[Integers, slice]:
    """Where a part has points in a range of positions: places in the range, and its own range."""
    if dimension in part.at:
        positions = np.array([part.at[dimension]])
    elif dimension == part.axis and part.rows is not None:
        positions = part.rows
    elif dimension in DIMENSIONS:
        positions = part.points.get(dimension, np.zeros(0, dtype=np.int64))
    else:
        return np.arange(within.stop - within.start), within
    begin, end = np.searchsorted(positions, [within.start, within.stop])
    return positions[begin:end] - within.start, slice(int(begin), int(end))


def _empty(plan: Plan, name: str, block: Block, kind: npt.DTypeLike) -> npt.NDArray[Any]:
    """Array of a block in which nothing is there yet."""
    fill = INVALID_INPUT if name == "status" else np.nan
    return np.full(shape_in(plan, plan.dims(name), block), fill, dtype=kind)
