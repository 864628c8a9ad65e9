"""Figures of an archive, drawn from the Dataset alone: `draw` writes them, `kinds` lists them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sweeps.figures.files import draw

__all__ = ["draw"]


def __getattr__(name: str) -> Any:
    # Loaded when first used: one file of this package is imported without all the others.
    if name == "draw":
        from sweeps.figures.files import draw

        return draw
    raise AttributeError(f"module 'sweeps.figures' has no attribute {name!r}")
