"""Tornado diagrams: elasticities of a result, the largest at the top."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from engine_dyn.types import Floats, Integers
from sweeps.dimensions import ELASTICITY, PARAMETER
from sweeps.figures.marks import shade
from sweeps.figures.scales import x_label
from sweeps.figures.sheet import Entries, NamedFigures, finish, new_sheet
from sweeps.figures.study import Study
from sweeps.figures.views import View
from sweeps.figures.wording import name_of, sentence, symbol_of, wrap

ENDINGS = (ELASTICITY, *(f"{ELASTICITY}_{end}" for end in ("error", "below", "above", "kind")))
"""Endings of the variables that one diagram shows, or that belong to it."""

DERIVATIVE = "_derivative"

MOST_BARS = 14
"""Parameters of one diagram; those that move the result least are left out, and counted."""

LEAST = 1e-3
"""Share of the largest elasticity below which a bar could not be seen."""

SIDES_DIFFER = 1
"""What `<quantity>_elasticity_kind` says where both sides differ."""


def tornado_names(view: View) -> list[str]:
    """Elasticities and what belongs to them."""
    variables = view.data.variables
    return [
        str(name)
        for name in view.data.data_vars
        if PARAMETER in variables[name].dims and str(name).endswith((*ENDINGS, DERIVATIVE))
    ]


def tornados(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the elasticities of each result at the nominal design."""
    for name in names:
        if not name.endswith(ELASTICITY):
            continue
        kept = [found for found in names if found.startswith(name)]
        view = study.view.only(kept, [PARAMETER])
        values = view.array(name).values
        shown = _largest_first(values)
        if shown.size == 0:
            continue
        quantity = name.removesuffix(ELASTICITY)
        figure, (panel,) = new_sheet(1, 1, 1.1 + 0.3 * shown.size)
        rows = np.arange(shown.size)
        panel.barh(rows, values[shown], height=0.62, color=shade(0.35))
        entries: Entries = {}
        bent = view.array(f"{name}_kind").values[shown] == SIDES_DIFFER
        for side, marker in (("below", "<"), ("above", ">")):
            if bent.any():
                (marks,) = panel.plot(
                    view.array(f"{name}_{side}").values[shown][bent], rows[bent],
                    linestyle="none", marker=marker, markersize=5.0, color="black",
                )  # fmt: skip
                change = "falls" if side == "below" else "rises"
                entries[f"Where the parameter {change}, if different"] = marks
        panel.axvline(0.0, color="black", linewidth=0.8)
        panel.set_yticks(rows, parameter_texts(view, shown))
        panel.grid(visible=False, axis="y")
        panel.invert_yaxis()
        panel.tick_params(axis="y", length=0.0)
        panel.margins(x=0.08)
        of = study.view.array(quantity)
        x_label(panel, f"Change of {symbol_of(of) or quantity} in % for 1 % of the parameter", 5.0)
        notes = view.notes([name])
        left_out = int(np.isfinite(values).sum()) - shown.size
        if left_out:
            notes.append(f"{left_out} more parameters have almost no effect")
        title = f"Elasticities of the {name_of(of, quantity)}"
        finished = finish(figure, title, notes, entries, "", view.caption, below=True)
        yield f"tornado_{quantity}{view.suffix}", finished


def parameter_texts(view: View, places: Integers, along: str = PARAMETER) -> list[str]:
    """What parameters are, without what explains them, for the ordinate of a chart of bars."""
    texts = view.data[f"{along}_long_name"].values[places]
    return [wrap(sentence(str(text).split(",")[0]), 34) for text in texts]


def _largest_first(values: Floats) -> Integers:
    """Places of the elasticities that can be seen, the largest first."""
    sizes = np.where(np.isfinite(values), np.abs(values), -1.0)
    order = np.argsort(-sizes, kind="stable")
    seen = sizes[order] > LEAST * max(sizes.max(initial=0.0), 0.0)
    return order[seen][:MOST_BARS]
