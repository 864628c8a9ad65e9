"""How kernels are compiled and kept. Besides, only arrays, vectors and the card import Numba."""

from engine_dyn.compilation.cache import formula, inlined, kernel, source_hash
from engine_dyn.compilation.settings import (
    COMPILING,
    on_compiling,
    processor,
    processor_features,
    seconds_compiling,
)

__all__ = [
    "COMPILING", "formula", "inlined", "kernel", "on_compiling", "processor", "processor_features",
    "seconds_compiling", "source_hash",
]  # fmt: skip
