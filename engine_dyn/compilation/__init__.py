"""The one room that imports Numba and llvmlite: how kernels are compiled and kept."""

from engine_dyn.compilation.by_type import by_type
from engine_dyn.compilation.cache import source_hash
from engine_dyn.compilation.decorators import formula, inlined, kernel
from engine_dyn.compilation.settings import (
    COMPILING,
    on_compiling,
    processor,
    processor_features,
    seconds_compiling,
    threading_layer,
)  # fmt: skip
from engine_dyn.compilation.stack import indices_on_stack, on_stack, rows_on_stack
from engine_dyn.compilation.vectors import (
    SQUARE_SIDE,
    turn_eights,
    turn_fours,
    turn_pairs,
    wide_vectors,
)

__all__ = [
    "COMPILING", "formula", "inlined", "kernel", "on_compiling", "processor", "processor_features",
    "seconds_compiling", "source_hash", "threading_layer",
    "SQUARE_SIDE", "by_type", "indices_on_stack", "on_stack", "rows_on_stack", "turn_eights",
    "turn_fours", "turn_pairs", "wide_vectors",
]  # fmt: skip
