"""Several engines in one archive: each is computed as if it were alone, and put into its place.

What an engine does not have stays missing: numbers are NaN, and the outcome of a design whose
solution was not asked for, because its engine lacks what it needs, is `invalid_input`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.quantities.graph import DIMENSIONS
from engine_dyn.status import INVALID_INPUT
from sweeps.dimensions import DESIGN
from sweeps.planning.blocks import Block, holds
from sweeps.planning.plan import Part, Plan

__all__ = ["computed_side_by_side"]

Results = dict[str, npt.NDArray[Any]]
Computing = Callable[[Plan, Mapping[str, int], Iterable[Block]], Iterator[tuple[Block, Results]]]


def computed_side_by_side(
    plan: Plan, lengths: Mapping[str, int], chosen: Iterable[Block], compute: Computing
) -> Iterator[tuple[Block, Results]]:
    """Compute some blocks of a plan that has parts; see `sweeps.running.in_memory.computed`.

    `compute` computes blocks of the plan of one part, all outputs in each of them.
    """
    running = [_Running(part, lengths, compute) for part in plan.parts]
    for block in chosen:
        found: Results = {}
        for one in running:
            here = _block_of(one.part, block, plan)
            if here is None:
                continue
            results = one.compute(here)
            for name in list(results):
                dims = plan.dims(name)
                if name in plan.outputs and holds(block, dims):
                    values = results.pop(name)
                    if name not in found:
                        found[name] = _empty(plan, name, block, values.dtype)
                    _put(found[name], values, one.part, name, block, plan)
        for name in plan.outputs:
            if name not in found and holds(block, plan.dims(name)):
                kind = np.dtype(np.int8 if name == "status" else np.float64)
                found[name] = _empty(plan, name, block, kind)
        yield block, found


class _Running:
    """A part while its blocks are computed: what no block changes is computed once."""

    def __init__(self, part: Part, lengths: Mapping[str, int], compute: Computing) -> None:
        self.part = part
        own = {d: n for d, n in lengths.items() if d in part.plan.scene.dimensions}
        self.next: deque[Block] = deque()
        self.results = compute(part.plan, own, self._chosen())

    def _chosen(self) -> Iterator[Block]:
        while True:
            yield self.next.popleft()

    def compute(self, block: Block) -> Results:
        """Outputs of one block."""
        self.next.append(block)
        return next(self.results)[1]


def _block_of(part: Part, block: Block, plan: Plan) -> Block | None:
    """The part's own block in a block of all; None where it does not lie in it."""
    own: Block = {}
    for dimension, place in block.items():
        if dimension in part.at:
            if not place.start <= part.at[dimension] < place.stop:
                return None
        elif dimension == DESIGN and part.rows is not None:
            begin, end = np.searchsorted(part.rows, [place.start, place.stop])
            if begin == end:
                return None
            if DESIGN in part.plan.scene.dimensions:
                own[DESIGN] = slice(int(begin), int(end))
        elif dimension in part.plan.scene.dimensions:
            own[dimension] = place
    del plan
    return own


def _empty(plan: Plan, name: str, block: Block, kind: np.dtype[Any]) -> npt.NDArray[Any]:
    """Array of a block in which nothing is there yet."""
    places = (block.get(d, slice(0, plan.sizes[d])) for d in plan.dims(name))
    shape = tuple(place.stop - place.start for place in places)
    return np.full(shape, INVALID_INPUT if name == "status" else np.nan, dtype=kind)


def _put(
    target: npt.NDArray[Any], values: npt.NDArray[Any], part: Part, name: str, block: Block,
    plan: Plan,
) -> None:  # fmt: skip
    """Put the results of a part into its place."""
    dims, own = plan.dims(name), part.plan.dims(name)
    places: list[Any] = []
    for dimension, size in zip(dims, target.shape, strict=True):
        begin = block[dimension].start if dimension in block else 0
        if dimension in part.at:
            places.append(np.array([part.at[dimension] - begin]))
        elif dimension == DESIGN and part.rows is not None:
            rows = part.rows - begin
            places.append(rows[(rows >= 0) & (rows < size)])
        elif dimension in DIMENSIONS:
            places.append(part.points[dimension])
        else:
            places.append(np.arange(size))
    shape = [1] * len(dims)
    for dimension, size in zip(own, values.shape, strict=True):
        shape[dims.index(dimension)] = size
    slices = [_as_slice(place) for place in places]
    shaped = values.reshape(shape)
    if all(place is not None for place in slices):
        target[tuple(slices)] = shaped
    else:
        target[np.ix_(*places)] = shaped


def _as_slice(places: npt.NDArray[Any]) -> slice | None:
    """Range of positions; None where they do not follow each other."""
    first, count = int(places[0]), len(places)
    follows = int(places[-1]) - first == count - 1 and (np.diff(places) == 1).all()
    return slice(first, first + count) if follows else None
