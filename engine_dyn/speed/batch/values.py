"""Values of a table that the lanes of a block share, or of tables that each lane has of its own."""

from __future__ import annotations

from engine_dyn.compilation import formula
from engine_dyn.types import Floats

__all__ = ["constant", "shared_value", "value_at"]


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
