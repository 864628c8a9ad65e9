"""Values as a report writes them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sweeps.base.errors import one_line
from sweeps.view.texts.readable_units import converted

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FIRST_ROWS", "value_text"]

FIRST_ROWS = 20
"""Designs that are shown of many."""


def value_text(variable: xr.Variable | xr.DataArray, value: Any, choice: str | None) -> str:
    """Return a number with its unit, or a word."""
    if variable.dtype.kind not in "fiub":
        return one_line(value, 60)
    factor, unit = converted(str(variable.attrs.get("units", "1")), choice)
    return f"{float(value) * factor:.6g} {one_line(unit, 30)}".rstrip()
