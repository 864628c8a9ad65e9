"""Values of a table that the lanes of a block share, or of tables that each lane has of its own."""

from __future__ import annotations

from engine_dyn.compilation import SQUARE_SIDE, formula, turn_eights, turn_fours, turn_pairs
from engine_dyn.speed.batch.own_curves import own_pair, own_pairs
from engine_dyn.speed.batch.state import FIRST_DIAGRAM, LANES, SECOND_DIAGRAM
from engine_dyn.speed.batch.two_grid import SQUARES, P
from engine_dyn.types import Floats, Integers

__all__ = [
    "SLOPES",
    "VALUES",
    "constant",
    "pair_at",
    "read_nodes",
    "read_pairs",
    "shared_value",
    "value_at",
]


@formula
def shared_value(table: Floats, node: int, field: int) -> float:
    """Value of a table that the lanes share, to be read before the loop over them."""
    if table.ndim == 2:
        return table[node, field]
    return 0.0


@formula
def value_at(table: Floats, common: float, node: int, field: int, k: int) -> float:
    """Value of a lane: what `shared` read, or that of its own table (node, field, lane).

    Which of both is known when this is compiled: Numba prunes the branch by the dimensions.
    """
    if table.ndim == 2:
        return common
    return table[node, field, k]


@formula
def constant(constants: Floats, index: int, k: int) -> float:
    """Return a constant of the lanes' table, or of a lane's own (constant, lane)."""
    if constants.ndim == 1:
        return constants[index]
    return constants[index, k]


VALUES, SLOPES = 0, 1
"""Places of pairs of fields of a fine node, one of P and the same of V; behind them are those of
the antiderivatives and of the middles."""


@formula
def read_pairs(
    count: int, pair: int, places: Integers, lanes: int, fine: Floats, mix: Floats, state: Floats,
    found: Floats,
) -> None:  # fmt: skip
    """Pairs of fields of every lane's fine node, `count` of them from `pair` on, as rows of lanes.

    `count`, a constant where this is called, is 1, 2 or 4: half the number of rows of `found`.
    """
    if fine.ndim == 2:
        for k in range(0, lanes, SQUARE_SIDE):
            if count == 1:
                turn_pairs(fine, 2 * pair, places, k, found)
            elif count == 2:
                turn_fours(fine, 2 * pair, places, k, found)
            else:
                turn_eights(fine, 2 * pair, places, k, found)
        return
    first, second = int(state[FIRST_DIAGRAM]), int(state[SECOND_DIAGRAM])  # the same for all lanes
    for i in range(count):
        gas, squares = found[2 * i * LANES :], found[(2 * i + 1) * LANES :]
        own_pairs(pair + i, places, lanes, first, second, fine, mix, gas, squares)


@formula
def read_nodes(fields: int, places: Integers, lanes: int, coarse: Floats, found: Floats) -> None:
    """Take P, V, P_MOMENT, V_MOMENT, WORK and SQUARES of every lane's coarse node: rows of lanes.

    `fields`, a constant where this is called, is 4, for the first four, or 8: rows of `found`.
    """
    if coarse.ndim == 2:
        for k in range(0, lanes, SQUARE_SIDE):
            if fields == 4:
                turn_fours(coarse, P, places, k, found)
            else:
                turn_eights(coarse, P, places, k, found)
        return
    for field in range(min(fields, SQUARES + 1)):
        row = found[field * LANES : (field + 1) * LANES]
        for k in range(lanes):
            row[k] = value_at(coarse, 0.0, places[k], field, k)


@formula
def pair_at(
    place: int, pair: int, k: int, fine: Floats, mix: Floats, state: Floats
) -> tuple[float, float]:
    """One of the pairs of a fine node; a lane with curves of its own adds them up."""
    if fine.ndim == 2:
        return fine[place, 2 * pair], fine[place, 2 * pair + 1]
    first, second = int(state[FIRST_DIAGRAM + k]), int(state[SECOND_DIAGRAM + k])
    return own_pair(place, pair, k, first, second, fine, mix)
