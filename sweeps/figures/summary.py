"""Single numbers as a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sweeps.figures.sheet import finish, new_sheet
from sweeps.figures.views import MOST_ROWS, View, same_over
from sweeps.figures.wording import name_of, number_text, sentence, symbol_of, with_unit, wrap

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def summary_table(view: View, names: Sequence[str]) -> Figure:
    """Single numbers as a table, with those that are the same in all designs."""
    listed = list(names)[:MOST_ROWS]
    figure, panels = new_sheet(1, 1, 0.3 + 0.2 * len(listed))
    panel = panels[0]
    panel.axis("off")
    panel.set(xlim=(0, 1), ylim=(len(listed) + 0.5, -0.7))
    alike = [name for name in listed if view.axes([name])]
    for row, name in enumerate(listed):
        variable = view.only([name], ()).array(name)
        value = float(variable.values)
        if np.isfinite(value):
            said = with_unit(variable, value)
        else:
            said = str(view.outcomes(name, variable, {}))
        beside = _published_number(view, name)
        if beside is not None:
            said += f" (published: {number_text(beside)})"
        cells = [
            wrap(sentence(name_of(variable, name)), 70).split("\n")[0],
            symbol_of(variable),
            said,
        ]
        for x, text in zip((0.0, 0.62, 0.74), cells, strict=True):
            panel.text(x, row, text, va="center")
        panel.axhline(row + 0.5, color="#dcdcdc", linewidth=0.5)
    notes = []
    if alike:
        these = ", ".join(symbol_of(view.array(n)) or name_of(view.array(n), n) for n in alike)
        notes.append(f"{these}: {same_over(view.axes(alike))}")
    return finish(figure, "Summary", [*view.notes(listed), *notes], caption=view.caption)


def _published_number(view: View, name: str) -> float | None:
    """What is published beside a number: one value, of whichever design."""
    other = view.published(name, everywhere=True)
    if other is None:
        return None
    values = np.asarray(view.array(other).values, dtype=float)
    known = np.unique(values[np.isfinite(values)])
    return float(known[0]) if known.size == 1 else None
