"""Memory that a plan needs when it is computed into arrays, and whether the machine has it."""

from __future__ import annotations

import psutil

from sweeps.errors import SceneError, size_text
from sweeps.planning.blocks import LIMIT, intermediate_bytes
from sweeps.planning.plan import Plan

__all__ = ["check_memory", "memory_bytes"]


def memory_bytes(plan: Plan) -> int:
    """Bytes that exist at the same time at most: all outputs, and what a block is made from."""
    return plan.output_bytes + round(intermediate_bytes(plan))


def check_memory(plan: Plan) -> None:
    """Refuse a scene larger than memory.

    Raises
    ------
    SceneError
        With the size and what is free.
    """
    need = memory_bytes(plan)
    if need <= LIMIT:  # as much as a block may take: not worth asking
        return
    free = psutil.virtual_memory().available
    if need > 0.9 * free:
        raise SceneError(
            f"{plan.name}: {plan.designs} designs need {size_text(need)} of memory, "
            f"{size_text(free)} are free; request fewer points or fewer quantities (largest: "
            f"{max(plan.stages, key=lambda s: s.size).node.name})"
        )
