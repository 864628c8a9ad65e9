"""Inputs of designs, from a product of axes into the state of a block."""

from __future__ import annotations

from engine_dyn.compilation import inlined
from engine_dyn.speed.batch.scratch import BlockScratch
from engine_dyn.speed.batch.state import LANES
from engine_dyn.speed.fields import BORE, MEAN_TORQUE, OUTPUT
from engine_dyn.speed.product import Product, other_offsets_at
from engine_dyn.types import Floats, Integers

__all__ = ["take_common", "take_designs"]


@inlined
def take_common(product: Product, scratch: BlockScratch, state: Floats) -> int:
    """Inputs that all designs of a table share into the lanes; the others' fields into `varying`.

    Returns how many vary.
    """
    values, at, axes, varying = product.values, scratch.shared, product.other_axes, scratch.varying
    count = 0
    for field in range(BORE, MEAN_TORQUE + 1):
        varies = False
        for i in range(axes.size):
            varies = varies or product.strides[axes[i], field] != 0
        if varies:
            varying[count] = field
            count += 1
        else:
            row = (field - BORE) * LANES
            state[row : row + LANES] = values[at[field]]
    return count


@inlined
def take_designs(
    index: int, count: int, designs: int, fields: int, product: Product, scratch: BlockScratch,
    places: Integers, state: Floats,
) -> None:  # fmt: skip
    """Inputs of `count` designs from `index` on into the lanes; the last one fills what is over.

    Only of the first `fields` of `scratch.varying`, and the places of results. Designs along the
    last axis are a line: `scratch.at` is where the first of the line `scratch.line` lies, so that
    blocks of the same line need not ask again; along it an input is a stride apart or the same.
    """
    values, at, positions = product.values, scratch.at, product.positions
    axes = product.other_axes
    axis, size, first = 0, 1, 0
    if axes.size > 0:
        axis = axes[axes.size - 1]
        size, first = product.shape[axis], product.position_start[axis]
    k = 0
    while k < LANES:
        here = index % designs + min(k, count - 1)
        line = here // size
        digit = here - line * size
        if line != scratch.line[0]:
            other_offsets_at(line * size, scratch.varying[:fields], product, scratch.shared, at)
            scratch.line[0] = line
        run = min(size - digit, count - k) if k < count else LANES - k
        along = positions[first + digit : first + digit + run]
        for i in range(fields):
            field = scratch.varying[i]
            row = (field - BORE) * LANES + k
            here_of = state[row : row + run]
            stride = product.strides[axis, field]
            base = at[field] - stride * positions[first]
            if stride == 0:
                here_of[:] = values[base]
            elif k < count:
                for j in range(run):
                    here_of[j] = values[base + stride * along[j]]
            else:
                here_of[:] = values[base + stride * along[0]]
        if k < count:
            stride = product.strides[axis, OUTPUT]
            base = at[OUTPUT] - stride * positions[first]
            for j in range(run):
                places[k + j] = base + stride * along[j]
        k += run
