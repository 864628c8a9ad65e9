"""The registry of units: a third of a second to make, so made once, when first asked for."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

__all__ = ["unit_registry"]


@lru_cache(maxsize=1)
def unit_registry() -> Any:
    """Return pint's registry, which also knows PS and CV of engines, and a revolution as rev."""
    import pint

    registry: Any = pint.UnitRegistry()
    registry.define("metric_hp = metric_horsepower = PS = ps = CV")
    registry.define("@alias revolution = rev")
    return registry
