"""Figures of an archive, drawn from the Dataset alone.

`figure` gives one kind in memory, `figures` all of them, `draw` writes files; `kinds` lists the
kinds, and `options` what can be chosen.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sweeps.view.figures.drawing import figure, figures, kinds_of
    from sweeps.view.figures.files import draw
    from sweeps.view.figures.options import Options, options_of

__all__ = ["Options", "draw", "figure", "figures", "kinds_of", "options_of"]

_PLACES = {
    "draw": "files", "figure": "drawing", "figures": "drawing", "kinds_of": "drawing",
    "Options": "options", "options_of": "options",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    # Loaded when first used: one file of this package is imported without all the others.
    if name in _PLACES:
        return getattr(import_module(f"sweeps.view.figures.{_PLACES[name]}"), name)
    raise AttributeError(f"module 'sweeps.view.figures' has no attribute {name!r}")
