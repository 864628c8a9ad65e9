"""How kernels are compiled and kept. Besides, only arrays, vectors and the card import Numba."""

from engine_dyn.compilation.cache import (
    COMPILING,
    formula,
    inlined,
    kernel,
    on_compiling,
    processor,
    processor_features,
    seconds_compiling,
    source_hash,
)

__all__ = [
    "COMPILING", "formula", "inlined", "kernel", "on_compiling", "processor", "processor_features",
    "seconds_compiling", "source_hash",
]  # fmt: skip
