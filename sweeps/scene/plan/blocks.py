"""Blocks: intermediate results stay small, however many designs a plan has.

A block is a range of positions along some axes of the scene. Where the intermediate arrays (columns
in SI units, friction, mean torque, curves that are only added up) would take more than `LIMIT`, the
plan is computed block by block into its outputs; otherwise in one piece. What depends on none of
the axes that are divided is computed once.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import psutil

from engine_dyn.quantities.graph import DIMENSIONS
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import SceneError, size_text

if TYPE_CHECKING:  # Archives are opened without loading the planner
    from sweeps.scene.plan.plan import Plan, Stage

Block = dict[str, slice]  # Range of positions along each divided axis

Results = dict[str, npt.NDArray[Any]]  # Arrays of some results of a block, by their names

LIMIT = 64e6  # Bytes of the intermediate arrays of a block

STEP = 64  # Long blocks have a multiple of this number of positions, so that chunks divide them


def divided(plan: Plan) -> tuple[dict[str, int], int]:
    """Axes that are divided, the most positions of each in a block, and bytes of all memory.

    These are the bytes of all outputs and of what a block is made from: where no axis is divided,
    of all arrays but the outputs that a kernel writes itself.
    """
    between = [s for s in plan.stages if s.node.make is not None or s.node.name not in plan.outputs]
    whole = sum(_bytes(plan, stage, {}) for stage in between)
    if whole <= LIMIT:
        return {}, plan.output_bytes + round(whole)
    lengths = lengths_within(plan, LIMIT)
    return lengths, plan.output_bytes + round(passing_bytes(plan, lengths))


def lengths_in_memory(plan: Plan) -> dict[str, int]:
    """Axes that are divided, as by `divided`, of a plan that is computed into arrays.

    Raises
    ------
    SceneError
        Where they are larger than memory, with the size and what is free.
    """
    lengths, need = divided(plan)
    if need > LIMIT:  # A need within the limit of one block is not checked
        largest = max(plan.stages, key=lambda s: s.size).node.name
        advice = f"; request fewer points or fewer quantities (largest: {largest})"
        check_memory(f"{plan.name}: {plan.designs} designs", need, advice)
    return lengths


def lengths_within(plan: Plan, limit: float) -> dict[str, int]:
    """Lengths as of `divided`; `limit` holds for all arrays of a block, also of its outputs."""
    lengths = dict(plan.sizes)
    reduce = plan.scene.reduce
    # Blocks have all values of these axes, because [reduce] judges designs at all of them.
    whole = () if reduce is None else reduce.at_every
    for dimension in (d for d in _in_order(plan) if d not in whole):
        if passing_bytes(plan, lengths) <= limit:
            break
        low, high = 1, lengths[dimension]
        while low < high:  # The search ends at the most positions that fit, or at one
            middle = (low + high + 1) // 2
            if passing_bytes(plan, {**lengths, dimension: middle}) <= limit:
                low = middle
            else:
                high = middle - 1
        # Blocks have equal sizes: a last one of a few designs would cost as much as the others.
        group = undivided(plan, dimension)
        low = max(low // group, 1) * group
        length = math.ceil(lengths[dimension] / math.ceil(lengths[dimension] / low))
        step = STEP if group == 1 else group
        if length > STEP or group > 1:
            length = min(math.ceil(length / step), low // step) * step
        lengths[dimension] = length
    return {d: n for d, n in lengths.items() if n < plan.sizes[d]}


def undivided(plan: Plan, dimension: str) -> int:
    """Positions that stay together: a group of Saltelli's design where it is reduced."""
    scene = plan.scene
    if scene.reduce is None or scene.sample is None or dimension != DESIGN:
        return 1
    return scene.sample.group


def check_memory(what: str, need: float, advice: str = "", share: float = 0.9) -> None:
    """Refuse what does not fit into a share of the free memory; `advice` ends the message."""
    free = psutil.virtual_memory().available
    if need > share * free:
        raise SceneError(
            f"{what} need {size_text(need)} of memory, {size_text(free)} are free{advice}"
        )


def block_count(plan: Plan, lengths: Mapping[str, int]) -> int:
    """Number of blocks."""
    return math.prod(math.ceil(plan.sizes[d] / length) for d, length in lengths.items())


def blocks(plan: Plan, lengths: Mapping[str, int]) -> Iterator[Block]:
    """Ranges of positions along the axes that are divided, block by block; `{}` if none is."""
    ranges = [
        [
            (dimension, slice(begin, min(begin + length, plan.sizes[dimension])))
            for begin in range(0, plan.sizes[dimension], length)
        ]
        for dimension, length in lengths.items()
    ]
    return (dict(combination) for combination in itertools.product(*ranges))


def index_of(dims: tuple[str, ...], block: Block) -> tuple[slice, ...]:
    """Index of a block in an array with these dimensions."""
    return tuple(block.get(d, slice(None)) for d in dims)


def shape_in(plan: Plan, dims: tuple[str, ...], block: Block) -> tuple[int, ...]:
    """Shape of the part of an array with these dimensions that lies in a block."""
    return tuple(block[d].stop - block[d].start if d in block else plan.sizes[d] for d in dims)


def aligned(array: Any, own: tuple[str, ...], dims: tuple[str, ...]) -> npt.NDArray[Any]:
    """Array with one axis for each of `dims`, of size 1 along those that are not its own.

    Its own dimensions are some of `dims`, in the same order.
    """
    lengths = dict(zip(own, np.shape(array), strict=True))
    return np.asarray(array).reshape([lengths.get(d, 1) for d in dims])


def belongs(block: Block, dims: tuple[str, ...]) -> bool:
    """Whether results with these dimensions are among those of a block.

    Results without an axis that is divided would be the same in several blocks: the first has them.
    """
    return all(part.start == 0 for d, part in block.items() if d not in dims)


def passing_bytes(plan: Plan, lengths: Mapping[str, int]) -> float:
    """Bytes of all arrays of one block, its part of the outputs included."""
    return sum(_bytes(plan, stage, lengths) for stage in plan.stages)


def _bytes(plan: Plan, stage: Stage, lengths: Mapping[str, int]) -> float:
    """Bytes that a stage needs beside its output."""

    def size(dims: tuple[str, ...]) -> int:
        return math.prod(lengths.get(d, plan.sizes[d]) for d in dims)

    if stage.node.kind == "stage":
        # A kernel gets packed inputs in SI units, without the points of its own curves.
        own = {name for name, dimension in DIMENSIONS.items() if not dimension.public}
        given = (n for n in stage.node.needs if n in plan.leaves and n not in own)
        dims = (plan.leaves[n].dims for n in given)
        return 16.0 * sum(size(d) for d in dims if d) + (stage.node.width - 8) * size(stage.axes)
    # During the evaluation of a formula, its result exists together with the terms of its sum.
    return stage.node.width * size(stage.dims) * (1 if stage.node.make is None else 3)


def _in_order(plan: Plan) -> list[str]:
    """Axes of the stages, those of tables first: divided there, no table is computed twice."""
    used = {d for stage in plan.stages for d in stage.dims}
    return sorted(used & set(plan.scene.dimensions), key=lambda d: (
        d not in plan.of_tables, plan.scene.dimensions.index(d)
    ))  # fmt: skip
