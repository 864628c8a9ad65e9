"""What the uncertainty of a result comes from: shares of the uncertain values, as bars."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sweeps.dimensions import EXPLAINED, HIGH, LOW, SHARE, UNCERTAIN
from sweeps.errors import counted
from sweeps.figures.marks import shade
from sweeps.figures.scales import x_label
from sweeps.figures.sheet import NamedFigures, finish, new_sheet
from sweeps.figures.study import Study
from sweeps.figures.tornado import MOST_BARS, parameter_texts
from sweeps.figures.views import View
from sweeps.figures.wording import (
    middle_of_sentence,
    name_of,
    number_text,
    value_text,
    with_unit,
)

__all__ = ["share_names", "uncertain_values"]


LEAST = 0.005
"""Share of the variance below which a bar could not be seen."""

STRAIGHT = 0.9
"""Share that straight lines explain, below which the figure says so: the bars tell little then."""


def share_names(view: View) -> list[str]:
    """Shares of the uncertain values in the variance of results."""
    variables = view.data.variables
    return [
        str(name)
        for name in view.data.data_vars
        if UNCERTAIN in variables[name].dims and str(name).endswith(SHARE)
    ]


def uncertain_values(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw for each result, at the nominal design, which uncertain values its band is due to."""
    for name in names:
        quantity = name.removesuffix(SHARE)
        beside = [quantity + end for end in ("", LOW, HIGH, EXPLAINED)]
        view = study.view.only([name, *beside], [UNCERTAIN])
        shares = view.array(name).values
        if not (shares >= LEAST).any():
            continue
        order = np.argsort(-np.nan_to_num(shares), kind="stable")
        order = order[np.nan_to_num(shares)[order] >= LEAST][:MOST_BARS]
        figure, (panel,) = new_sheet(1, 1, 1.1 + 0.3 * order.size)
        rows = np.arange(order.size)
        panel.barh(rows, 100.0 * shares[order], height=0.62, color=shade(0.35))
        panel.set_yticks(rows, parameter_texts(view, order, UNCERTAIN))
        panel.grid(visible=False, axis="y")
        panel.invert_yaxis()
        panel.tick_params(axis="y", length=0.0)
        panel.set_xlim(left=0.0)
        x_label(panel, "Share of the variance (%)", 5.0)
        value, low, high, explained = (float(view.array(one).values) for one in beside)
        of = view.array(quantity)
        ends = f"95 % range {number_text(low)} to {with_unit(of, high)}"
        notes = [*view.notes([name]), value_text(of, quantity, value), ends]
        if explained < STRAIGHT:
            notes.append(f"straight lines explain only {100.0 * explained:.0f} % of the variance")
        left_out = shares.size - order.size
        if left_out:
            notes.append(f"{counted(left_out, 'more value')} with a smaller share")
        what = middle_of_sentence(name_of(of, quantity))
        title = f"Uncertainty of the {what}: what it comes from"
        finished = finish(figure, title, notes, {}, "", view.caption)
        yield f"uncertainty_{quantity}{view.suffix}", finished
