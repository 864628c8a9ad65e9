"""Room that a run needs in memory and on disk, checked before anything is computed."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from sweeps.base.errors import SceneError, counted, size_text
from sweeps.scene.plan.blocks import check_memory
from sweeps.scene.plan.plan import Plan

LARGEST_BLOCK = 64e6  # Bytes of the arrays of one block: larger blocks are not quicker

SMALLEST_BLOCK = 4e6

AT_ONCE = 4
"""Copies of a block's arrays at one time: common ones, one computed, one written, the kernels' own.
"""


def block_bytes(plan: Plan, memory: float | None) -> float:
    """Bytes that the arrays of one block may take, so that a run takes no more than `memory`."""
    given = [np.asarray(v.data).nbytes for v in plan.leaves.values() if v.dims]
    fixed = float(sum(given))
    limit = LARGEST_BLOCK
    if memory is not None:
        limit = min(limit, (memory - fixed) / AT_ONCE)
        smallest = min(SMALLEST_BLOCK, LARGEST_BLOCK)
        if limit < smallest:
            raise SceneError(
                f"{plan.name}: --memory {size_text(memory)}: {counted(plan.designs, 'design')} "
                f"with columns of {size_text(fixed)} need at least "
                f"{size_text(fixed + AT_ONCE * smallest)}"
            )
    check_memory(f"{plan.name}: {counted(plan.designs, 'design')}", fixed + AT_ONCE * limit)
    return limit


def archive_bytes(plan: Plan, *, single: bool = False) -> int:
    """Size of an archive's variables and coordinates, uncompressed."""
    total = plan.bytes_of_outputs(4 if single else 8)
    return total + 8 * sum(plan.sizes[d] for d in plan.scene.dimensions)


def check_disk(
    plan: Plan, output: Path, count: int, finished: int, *, single: bool = False
) -> bool:
    """Refuse what does not fit the disk, before anything is computed.

    `finished` of `count` blocks are on disk already; with `single`, results are in 32 bits.
    Returned is whether blocks and archive do not fit the disk together: each block then has to be
    deleted once it has been copied into the archive.
    """
    size = archive_bytes(plan, single=single)
    if count == 1:
        check_room(plan, output, size, size)
        return False
    missing = size * (count - finished) / count
    # Where blocks are deleted as they are copied, one block is on the disk twice. The archive takes
    # at most 3 % more than results and coordinates: see `netcdf.chunks_of`.
    check_room(plan, output, size, missing + (0.03 + 1.0 / count) * size)
    return size + missing > shutil.disk_usage(output.parent).free


def check_room(plan: Plan, output: Path, size: float, need: float) -> None:
    """Refuse an archive of this size where the `need` for room is greater than what is free."""
    free = shutil.disk_usage(output.parent).free
    if need > free:
        raise SceneError(
            f"{plan.name}: {counted(plan.designs, 'design')} make an archive of "
            f"{size_text(size)}; {size_text(free)} are free where {output} would be; request "
            "fewer points or fewer quantities"
        )
