"""Figures of an archive, drawn from the Dataset alone.

`figure` gives one kind in memory, `figures` all of them, `draw` writes files; `kinds` lists the
kinds, and `options` what can be chosen.
"""

from sweeps.view.figures.drawing import draw, figure, figures, kinds_of
from sweeps.view.figures.options import Options, options_of

__all__ = ["Options", "draw", "figure", "figures", "kinds_of", "options_of"]
