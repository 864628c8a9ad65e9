"""Searches for designs: the exact inverse where there is one, else scans and generations.

`space.py` says what may vary, `task.py` what is wanted of a scene, `evaluation.py` computes and
judges designs, and `optimise.py` looks for better ones, or has the exact inverse.
"""

from __future__ import annotations

__all__ = ["ATTRIBUTE_OF_SEARCH", "DESIGNS", "EVENLY", "GENERATIONS", "RESTARTS"]

# These stand in a file that imports nothing, so that help, and texts on archives, are quick.
ATTRIBUTE_OF_SEARCH = "optimisation"
"""Attribute of the archive of a search: its task and its settings, as JSON."""

DESIGNS, GENERATIONS, RESTARTS, EVENLY = 1024, 30, 3, 257
"""Designs of a generation, generations of a search, searches from new first designs, and designs
of the first generation where one number is searched for one quantity."""
