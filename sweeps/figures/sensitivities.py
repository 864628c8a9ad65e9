"""Sobol' indices as bars, the most important parameter at the top."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sweeps.dimensions import PARAMETER
from sweeps.figures.marks import shade
from sweeps.figures.scales import x_label
from sweeps.figures.sheet import Entries, NamedFigures, finish, new_sheet
from sweeps.figures.study import Study
from sweeps.figures.tornado import parameter_texts
from sweeps.figures.views import View

FIRST, TOTAL, CONFIDENCE, CONDITIONAL = "_first", "_total", "_confidence", "_conditional"

MOST_BARS = 14

TEXTS = {FIRST: "First-order index: by itself", TOTAL: "Total index: with all interactions"}


def index_names(view: View) -> list[str]:
    """Indices and what belongs to them: `engine-dyn sensitivities` writes them."""
    if "sensitivity_method" not in view.data.attrs:
        return []
    return [str(name) for name in view.data.data_vars]


def sensitivities(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw first-order and total indices of each quantity, with their confidence intervals."""
    for name in names:
        quantity, found, ending = name.partition(FIRST)
        if not found or ending not in ("", CONDITIONAL):
            continue
        kinds = [k for k in (FIRST, TOTAL) if f"{quantity}{k}{ending}" in names]
        kept = [n for n in names if n.startswith(quantity)]
        view = study.view.only(kept, [PARAMETER])
        values = {k: view.array(f"{quantity}{k}{ending}").values for k in kinds}
        order = np.argsort(-values[kinds[-1]], kind="stable")[:MOST_BARS]
        figure, (panel,) = new_sheet(1, 1, 1.1 + 0.36 * order.size)
        rows = np.arange(order.size)
        height = 0.8 / len(kinds)
        entries: Entries = {}
        for number, kind in enumerate(kinds):
            half = f"{quantity}{kind}{CONFIDENCE}{ending}"
            bars = panel.barh(
                rows + (number - 0.5 * (len(kinds) - 1)) * height, values[kind][order],
                height=0.9 * height, color=shade((0.65, 0.25)[number]),
                xerr=view.array(half).values[order] if half in names else None,
                error_kw={"linewidth": 0.9, "capsize": 2.0},
            )  # fmt: skip
            entries[TEXTS[kind]] = bars.patches[0]
        panel.axvline(0.0, color="black", linewidth=0.8)
        panel.set_yticks(rows, parameter_texts(view, order))
        panel.invert_yaxis()
        panel.tick_params(axis="y", length=0.0)
        panel.grid(visible=False, axis="y")
        x_label(panel, "Share of the variance", 5.0)
        notes = list(view.notes([name]))
        if ending:
            notes.append("only designs with results: more than 1 % failed")
        left_out = values[kinds[0]].size - order.size
        if left_out:
            notes.append(f"{left_out} more parameters have smaller indices")
        said = str(view.array(name).attrs.get("long_name", "")).partition(" of the ")[2]
        what = said.removesuffix(", only designs with results") or quantity
        title = f"Sobol' indices of the {what}"
        drawn = finish(figure, title, notes, entries, "", view.caption, below=True)
        yield f"sensitivities_{quantity}{view.suffix}", drawn
