"""Searches of archives that hold what [reduce] kept: the designs of the search that was asked then.

Of the n best designs under conditions, the first that fulfils more conditions is the best of all
that do, as long as there is one among them; a front under other conditions is another front.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sweeps.base.checks import names_given
from sweeps.base.dimensions import DESIGN, RANK, REDUCTION
from sweeps.base.errors import SceneError
from sweeps.scene.conditions import Constraint

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["OF_KEPT", "kept_for"]

OF_KEPT = "; these are the designs that [reduce] kept, and not all"
"""End of the message where none of them fulfils more conditions."""


def kept_for(
    archive: xr.Dataset, wanted: Sequence[tuple[str, float]], conditions: Sequence[Constraint],
    at_every: str | Sequence[str], *, front: bool,
) -> tuple[xr.Dataset, str]:  # fmt: skip
    """Designs that answer a search, and what was found when they were kept.

    An archive that holds all designs comes back as it is, with an empty text.

    Raises
    ------
    SceneError
        Where [reduce] kept no designs that answer it.
    """
    if REDUCTION not in archive.attrs:
        return archive, ""
    about = json.loads(archive.attrs[REDUCTION])
    axes = names_given(at_every, "at_every")
    asked = {str(condition) for condition in conditions}
    for number, kept in enumerate(about["kept"]):
        within = set(kept["within"])
        same = [tuple(pair) for pair in kept["wanted"]] == [*wanted]
        enough = asked == within if front else asked >= within
        if not (same and enough and front == (kept["number"] == 0)):
            continue
        if set(axes) != set(about["at_every"]):
            continue
        if not kept["found"]:
            raise SceneError(kept["text"])
        return _designs(archive, number), "" if asked > within else kept["text"]
    name = "front" if front else "best"
    everywhere = f" at every {' and '.join(about['at_every'])}" if about["at_every"] else ""
    told = "; ".join(kept["asked"] + everywhere for kept in about["kept"]) or "no designs"
    raise SceneError(
        f"{name}: the archive was reduced, and kept {told}; another search needs a run whose "
        "[reduce] asks for it"
    )


def _designs(archive: xr.Dataset, number: int) -> xr.Dataset:
    """Designs that a search kept, and their results alone."""
    places = np.flatnonzero(archive[RANK].values[number])
    results = [n for n, v in archive.data_vars.items() if DESIGN in v.dims and n != RANK]
    found = archive[results].isel({DESIGN: places})
    return found.drop_vars("search", errors="ignore")
