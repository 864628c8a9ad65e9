"""What became of the designs, over two axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sweeps.base.dimensions import REDUCTION
from sweeps.view.figures.maps import cell_edges, hatch_cells, map_panels
from sweeps.view.figures.marks import LOST, LOST_OTHERWISE
from sweeps.view.figures.sheet import GREY, NamedFigures
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_PANELS, SOUND, View, facet_of, meanings_of
from sweeps.view.figures.wording import sentence


def outcome_names(view: View) -> list[str]:
    """The status, where there are two axes and some designs failed."""
    if not view.has("status") or len(_axes(view)) < 2 or REDUCTION in view.data.attrs:
        return []  # few of the designs were kept
    return [] if np.isin(view.array("status").values, SOUND).all() else ["status"]


def _axes(view: View) -> list[str]:
    return [dim for dim in view.axes(["status"]) if dim != "design"]


def outcomes_map(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the status of the designs over two axes."""
    from matplotlib.patches import Patch

    view = study.view
    axes = _axes(view)
    codes = view.array("status").values
    numeric = [dim for dim in axes if not view.axis(dim).words]
    pool = numeric if len(numeric) >= 2 else axes
    chosen = sorted(pool, key=lambda dim: -view.data.sizes[dim])[:2]
    along, up = (dim for dim in axes if dim in chosen)
    facet = facet_of(view, ["status"], (along, up))
    view = view.only(["status"], [along, up, facet])
    x, y, across = view.axis(along), view.axis(up), view.axis(facet)
    sheet, _ = map_panels(view, along, up, facet, 6.0)
    meanings = meanings_of(view.array("status"))
    for rank, code in enumerate(int(code) for code in np.unique(codes)):
        hatch = "" if code in SOUND else LOST.get(meanings.get(code, ""), LOST_OTHERWISE)[1]
        grey = str(0.97 - 0.09 * rank)
        for panel, place in zip(sheet.panels, across.picked(MOST_PANELS), strict=True):
            table = view.at("status", across.place(place)).transpose(up, along).values
            hatch_cells(panel, cell_edges(x), cell_edges(y), table == code, hatch, grey)
        text = f"{sentence(meanings.get(code, str(code)))} ({_fraction_text(codes == code)})"
        sheet.entries[text] = Patch(facecolor=grey, edgecolor=GREY, hatch=hatch, linewidth=0.5)
    notes = [*view.notes(["status"]), across.picked_text(MOST_PANELS)]
    title = f"Outcome of the designs over {x.called} and {y.called}"
    stem = "status" + (f"_by_{facet}" if facet else "")
    yield stem, sheet.finish(title, notes, view.caption)


def _fraction_text(where: NDArray[Any]) -> str:
    """Write a fraction of all designs in percent; a fraction near 0 as a count."""
    part = 100 * float(np.mean(where))
    return f"{part:.3g} %" if part >= 0.1 else f"{int(where.sum())} of {where.size}"
