"""The registry of units: a third of a second to make, so made once, when first asked for."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

__all__ = ["unit_registry"]


@lru_cache(maxsize=1)
def unit_registry() -> Any:
    """Return pint's registry as pint makes it; whoever defines units needs one of their own."""
    import pint

    return pint.UnitRegistry()
