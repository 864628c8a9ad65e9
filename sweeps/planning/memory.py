"""Memory that a plan needs when it is computed into arrays, and whether the machine has it."""

from __future__ import annotations

import psutil

from sweeps.errors import SceneError, size_text
from sweeps.planning.blocks import LIMIT, divided
from sweeps.planning.plan import Plan

__all__ = ["lengths_in_memory", "memory_bytes"]


def memory_bytes(plan: Plan) -> int:
    """Bytes that exist at the same time at most: all outputs, and what a block is made from."""
    return divided(plan)[1]


def lengths_in_memory(plan: Plan) -> dict[str, int]:
    """Lengths of the blocks (see `divided`) of a plan that is computed into arrays.

    Raises
    ------
    SceneError
        Where they are larger than memory, with the size and what is free.
    """
    lengths, need = divided(plan)
    if need <= LIMIT:  # as much as a block may take: not worth asking
        return lengths
    free = psutil.virtual_memory().available
    if need > 0.9 * free:
        raise SceneError(
            f"{plan.name}: {plan.designs} designs need {size_text(need)} of memory, "
            f"{size_text(free)} are free; request fewer points or fewer quantities (largest: "
            f"{max(plan.stages, key=lambda s: s.size).node.name})"
        )
    return lengths
