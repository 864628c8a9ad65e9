"""Facts in the attributes and dimensions of archives, whoever wrote them."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

from engine_dyn.quantities.graph import DIMENSIONS
from sweeps.base.dimensions import REDUCTION

if TYPE_CHECKING:
    import xarray as xr


def members_of(archive: xr.Dataset, key: str) -> dict[str, Any]:
    """Members of an attribute in JSON; none where it is something else."""
    try:
        members = json.loads(str(archive.attrs.get(key, "{}")))
    except (ValueError, RecursionError):
        return {}
    return members if isinstance(members, dict) else {}


def of_designs(archive: xr.Dataset) -> list[str]:
    """Variables with values of designs: of a reduced archive, those of the designs that it kept."""
    names = [str(name) for name in archive.data_vars]
    if REDUCTION not in archive.attrs:
        return names
    computed = members_of(archive, REDUCTION).get("quantities", [])
    return [name for name in names if name in computed]


def axes_of(archive: xr.Dataset) -> list[str]:
    """Dimensions of what was computed; of a reduced archive without those of its statistics."""
    if REDUCTION not in archive.attrs:
        return [str(d) for d in archive.sizes]
    left = members_of(archive, REDUCTION).get("left", [])
    used = {d for name in of_designs(archive) for d in archive[name].dims}
    return [str(d) for d in archive.sizes if d in used or d in left]


def dims_of_designs(archive: xr.Dataset) -> list[str]:
    """Dimensions along which designs differ, not values of one design."""
    return [d for d in axes_of(archive) if d not in (*DIMENSIONS, "interval", "tooth")]


def count_of_designs(archive: xr.Dataset, each: str = "designs") -> int:
    """Designs that an archive is about; of a reduced one all that were computed, or their "points".

    Designs that were judged at every speed have a point at each of the speeds.
    """
    about = members_of(archive, REDUCTION)
    known = about.get(each, about.get("designs"))
    if isinstance(known, int):
        return known
    return math.prod(archive.sizes[d] for d in dims_of_designs(archive))
