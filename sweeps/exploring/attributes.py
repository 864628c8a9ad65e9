"""What the attributes and dimensions of archives say, whoever wrote them."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from engine_dyn.quantities.graph import DIMENSIONS

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["dims_of_designs", "members_of"]


def members_of(archive: xr.Dataset, key: str) -> dict[str, Any]:
    """Members of an attribute in JSON; none where it is something else."""
    try:
        found = json.loads(str(archive.attrs.get(key, "{}")))
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def dims_of_designs(archive: xr.Dataset) -> list[str]:
    """Dimensions along which designs differ, not values of one design."""
    return [str(d) for d in archive.sizes if d not in (*DIMENSIONS, "interval", "tooth")]
