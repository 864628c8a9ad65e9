"""The one room that imports Numba and llvmlite: how kernels are compiled and kept.

Importing it changes nothing for other people's Numba code.
"""

from engine_dyn.compilation.announcing import COMPILING, on_compiling, seconds_compiling
from engine_dyn.compilation.by_type import by_type
from engine_dyn.compilation.cache import own_cache, source_hash
from engine_dyn.compilation.decorators import FAST_MATH, formula, inlined, kernel
from engine_dyn.compilation.settings import processor, processor_features, threading_layer
from engine_dyn.compilation.stack import indices_on_stack, on_stack, rows_on_stack
from engine_dyn.compilation.vectors import (
    SQUARE_SIDE,
    turn_eights,
    turn_fours,
    turn_pairs,
    wide_vectors,
)

__all__ = [
    "COMPILING",
    "FAST_MATH",
    "SQUARE_SIDE",
    "by_type",
    "formula",
    "indices_on_stack",
    "inlined",
    "kernel",
    "on_compiling",
    "on_stack",
    "own_cache",
    "processor",
    "processor_features",
    "rows_on_stack",
    "seconds_compiling",
    "source_hash",
    "threading_layer",
    "turn_eights",
    "turn_fours",
    "turn_pairs",
    "wide_vectors",
]
