"""Sizes of a search unless others are given; nothing is imported, so that help is quick."""

from __future__ import annotations

__all__ = ["DESIGNS", "GENERATIONS", "RESTARTS"]

DESIGNS, GENERATIONS, RESTARTS = 1024, 30, 3
"""Designs of a generation, generations of a search, and searches from new first designs."""
