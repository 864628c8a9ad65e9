"""What became of the designs, over two axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sweeps.figures.maps import cell_edges, hatch_cells
from sweeps.figures.marks import LOST, LOST_OTHERWISE
from sweeps.figures.scales import parameter_ticks, x_label, y_label
from sweeps.figures.sheet import (
    GREY,
    Entries,
    NamedFigures,
    bare_panels,
    finish,
    grid_of,
    lowest_panels,
    new_sheet,
)
from sweeps.figures.study import Study
from sweeps.figures.views import (
    MOST_PANELS,
    SOUND,
    View,
    facet_of,
    key_text,
    meanings_of,
    pick,
    picked_text,
)
from sweeps.figures.wording import sentence


def outcome_names(view: View) -> list[str]:
    """The status, where there are two axes and some designs failed."""
    if not view.has("status") or len(_axes(view)) < 2:
        return []
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
    x, y = view.axis(along), view.axis(up)
    across = view.axis(facet) if facet else None
    places = pick(across.size, MOST_PANELS, across.nominal) if across else [0]
    rows, columns = grid_of(len(places))
    height = 3.9 if rows * columns == 1 else 0.6 + 1.85 * rows
    figure, panels = new_sheet(rows, columns, height, sharex=True, sharey=True)
    meanings = meanings_of(view.array("status"))
    present = [int(code) for code in np.unique(codes)]
    hatches = {
        code: "" if code in SOUND else LOST.get(meanings.get(code, ""), LOST_OTHERWISE)[1]
        for code in present
    }
    greys = {code: str(0.97 - 0.09 * rank) for rank, code in enumerate(present)}
    room = 6.0 / columns
    for panel, place in zip(panels, places, strict=False):
        array = view.array("status")
        array = array.isel({facet: place}) if facet else array
        table = array.transpose(up, along).values
        panel.grid(False)
        panel.spines[:].set_visible(True)
        for code in present:
            hatch_cells(
                panel, cell_edges(x), cell_edges(y), table == code, hatches[code], greys[code]
            )
        parameter_ticks(panel, x, "x", room)
        parameter_ticks(panel, y, "y", 0.7 * height / rows)
        panel.set_xlim(*cell_edges(x)[[0, -1]].tolist())
        panel.set_ylim(*cell_edges(y)[[0, -1]].tolist())
        if across:
            panel.set_title(across.tag(place))
    bare_panels(panels, len(places), columns)
    for panel in lowest_panels(panels, len(places), columns):
        x_label(panel, x.label, room)
    for panel in panels[::columns]:
        y_label(panel, y.label, height / rows * 0.75)
    entries: Entries = {
        f"{sentence(meanings.get(code, str(code)))} ({_fraction_text(codes == code)})": Patch(
            facecolor=greys[code], edgecolor=GREY, hatch=hatches[code], linewidth=0.5
        )
        for code in present
    }
    notes = [*view.notes(["status"]), picked_text(across, MOST_PANELS)]
    title = f"Outcome of the designs over {key_text(x)} and {key_text(y)}"
    stem = "status" + (f"_by_{facet}" if facet else "")
    yield stem, finish(figure, title, notes, entries, caption=view.caption, below=True)


def _fraction_text(where: NDArray[Any]) -> str:
    """Write a fraction of all designs in percent; a fraction near 0 as a count."""
    part = 100 * float(np.mean(where))
    return f"{part:.3g} %" if part >= 0.1 else f"{int(where.sum())} of {where.size}"
