"""Inputs of designs, from a product of axes into the state of a block."""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined
from engine_dyn.speed.batch.own_curves import Lanes
from engine_dyn.speed.batch.scratch import BlockScratch
from engine_dyn.speed.batch.state import LANES
from engine_dyn.speed.fields import (
    BORE,
    CRANK_RATIO,
    CRANKCASE_PRESSURE,
    DOUBLE_RADIUS,
    LOAD_SCALE,
    LOAD_SQUARE,
    OFFSET_RATIO,
    OUTPUT,
    ROW,
    SCALE,
)
from engine_dyn.speed.product import Product, add_offsets, offsets_at, take_offsets, varies
from engine_dyn.types import Floats, Integers

__all__ = ["take_common", "take_designs", "take_sorted", "take_unvarying"]


@inlined
def take_common(product: Product, scratch: BlockScratch, state: Floats) -> int:
    """Inputs that all designs of a table share into the lanes; the others' fields into `varying`.

    Behind them the place of the results. Returns how many inputs vary.
    """
    values, at, axes, varying = product.values, scratch.shared, product.other_axes, scratch.varying
    count = 0
    for field in range(BORE, LOAD_SQUARE + 1):
        varies = False
        for i in range(axes.size):
            varies = varies or product.strides[axes[i], field] != 0
        if varies:
            varying[count] = field
            count += 1
        else:
            row = (field - BORE) * LANES
            state[row : row + LANES] = values[at[field]]
    varying[count] = OUTPUT
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
            asked = scratch.varying[: fields + 1]
            take_offsets(asked, scratch.shared, at)
            add_offsets(line * size, axes, asked, product, at)
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


@inlined
def take_unvarying(product: Product, scratch: BlockScratch, state: Floats) -> int:
    """Inputs that no axis changes into the lanes; the others' fields into `scratch.varying`.

    Returns how many vary, the place of the results among them. Of thirty inputs, few vary.
    """
    at, shared, varying = scratch.at, scratch.shared, scratch.varying
    offsets_at(0, product.table_axes, product, product.value_start, shared)
    offsets_at(0, product.other_axes, product, shared, at)
    count = 0
    for field in range(product.strides.shape[1]):
        if varies(field, product):
            varying[count] = field
            count += 1
        elif BORE <= field <= LOAD_SQUARE:
            row = (field - BORE) * LANES
            state[row : row + LANES] = product.values[at[field]]
    return count


@inlined
def take_sorted(
    begin: int, order: Integers, designs: int, fields: int, diagram: int, loaded: bool,
    product: Product, scratch: BlockScratch, state: Floats, inputs: Lanes,
) -> None:  # fmt: skip
    """Inputs of designs in any order into the lanes; the last one fills what is over.

    `order` are their places behind `begin`, `fields` are as `take_unvarying` counts them. `inputs`
    get what their curves are added up by, between the diagrams `diagram` and the one behind it, and
    with a load over angle where they are `loaded`.
    """
    values, at, varying = product.values, scratch.at, scratch.varying[:fields]
    for k in range(LANES):
        index = begin + order[min(k, order.size - 1)]
        take_offsets(varying, product.value_start, at)
        add_offsets(index // designs, product.table_axes, varying, product, at)
        add_offsets(index % designs, product.other_axes, varying, product, at)
        for i in range(varying.size):
            field = varying[i]
            if BORE <= field <= LOAD_SQUARE:
                state[(field - BORE) * LANES + k] = values[at[field]]
        scratch.places[k] = at[OUTPUT]
        weight, scale = values[at[ROW]] - diagram, values[at[SCALE]]
        inputs.ratios[k] = values[at[CRANK_RATIO]]
        inputs.before[k] = scale * (1.0 - weight)
        inputs.behind[k] = scale * weight
        inputs.crankcase[k] = values[at[CRANKCASE_PRESSURE]]
        inputs.offsets[k] = values[at[OFFSET_RATIO]]
        if loaded:
            lever = 0.125 * math.pi * values[at[BORE]] ** 2 * values[at[DOUBLE_RADIUS]]
            inputs.loads[k] = values[at[LOAD_SCALE]] / lever
