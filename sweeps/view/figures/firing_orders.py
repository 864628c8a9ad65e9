"""Firing orders of an engine side by side: what each costs by every criterion."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.types import Booleans, Floats
from sweeps.base.dimensions import ARRANGEMENT, OF_ORDERS
from sweeps.view.figures.marks import MARKERS, shade
from sweeps.view.figures.sheet import Entries, NamedFigures, finish, new_sheet, x_label
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_ROWS, View
from sweeps.view.figures.wording import sentence, wrap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def order_names(view: View) -> list[str]:
    """Ranks and criteria of an archive of `engine-dyn firing-orders`."""
    if OF_ORDERS not in view.data.attrs or "firing_order" not in view.data.coords:
        return []
    by = json.loads(view.data.attrs[OF_ORDERS])["by"]
    criteria = [name for name in by if view.has(name) and ARRANGEMENT in view.array(name).dims]
    return (
        [*criteria, *(name for name in ("rank", "rank_sum") if view.has(name))] if criteria else []
    )


def firing_orders(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw a row of dots for each order; of very many, where those of practice lie."""
    view = study.view
    criteria = [name for name in names if name not in ("rank", "rank_sum")]
    if not criteria or "rank" not in names:
        return
    place = np.argsort(view.array("rank").values, kind="stable")
    orders = [str(text) for text in view.data["firing_order"].values[place]]
    builders = [str(text) for text in view.data["known_order"].values[place]]
    known = np.array([bool(text) for text in builders])
    values = {name: _worst(view, name)[place] for name in criteria}
    about = json.loads(view.data.attrs[OF_ORDERS])
    notes = [f"{about['orders']:,} orders, the best at the top" if len(orders) <= MOST_ROWS
             else f"{about['orders']:,} orders"]  # fmt: skip
    if about["computed"] < about["orders"]:
        notes[0] += f", {about['computed']:,} of them drawn at random"
    others = {d for name in criteria for d in view.array(name).dims if d != ARRANGEMENT}
    if others:
        notes.append(f"the worst value over {', '.join(sorted(map(str, others)))}")
    if len(orders) <= MOST_ROWS:
        yield _rows(view, criteria, values, orders, known, about, notes)
    else:
        yield _strips(view, criteria, values, orders, builders, notes)


def _worst(view: View, name: str) -> Floats:
    """Largest value of each order over all other axes; NaN where one is missing."""
    array = view.data[name]
    worst: Floats = array.max([d for d in array.dims if d != ARRANGEMENT], skipna=False).values
    return worst


def _rows(
    view: View, criteria: Sequence[str], values: dict[str, Floats], orders: Sequence[str],
    known: Booleans, about: dict[str, object], notes: list[str],
) -> tuple[str, Figure]:  # fmt: skip
    figure, panels = new_sheet(1, len(criteria), 0.9 + 0.17 * len(orders), sharey=True)
    rows = np.arange(len(orders))
    entries: Entries = {}
    for number, (panel, name) in enumerate(zip(panels, criteria, strict=True)):
        x = values[name]
        panel.hlines(rows, np.nanmin(x), x, color="#c8c8c8", linewidth=0.8)
        for text, some, face in (
            ("Engines with this order are known", known, shade(0.2)),
            ("No engine with this order is known", ~known, "white"),
        ):
            if some.any():
                (points,) = panel.plot(
                    x[some], rows[some], linestyle="none", marker="o", markersize=5.0,
                    markerfacecolor=face, markeredgecolor=shade(0.2),
                )  # fmt: skip
                entries.setdefault(text, points)
        panel.margins(x=0.12)
        panel.grid(visible=False, axis="y")
        panel.locator_params(axis="x", nbins=4)
        panel.tick_params("y", length=0.0, labelleft=number == 0)
        x_label(panel, view.label(name), 5.4 / len(criteria))
    panels[0].set_yticks(rows, orders)
    for tick, order in zip(panels[0].get_yticklabels(), orders, strict=True):
        if order == about["own_order"]:
            tick.set_fontweight("bold")
    panels[0].set_ylim(len(orders) - 0.4, -0.6)
    if about["own_order"] in orders:
        notes.append("the engine's own order is in bold")
    finished = finish(figure, "Firing orders", notes, entries, "", view.caption, below=True)
    return f"firing_orders{view.suffix}", finished


def _strips(
    view: View, criteria: Sequence[str], values: dict[str, Floats], orders: Sequence[str],
    builders: Sequence[str], notes: list[str],
) -> tuple[str, Figure]:  # fmt: skip
    known = np.array([bool(text) for text in builders])
    figure, panels = new_sheet(len(criteria), 1, 0.3 + 0.62 * len(criteria))
    entries: Entries = {}
    backwards = np.array([text.endswith("other way)") for text in builders])
    # Orders of known engines are marked, but not more than could be told apart, nor those that are
    # known only in the other sense of rotation, which give nearly the same results.
    named = np.flatnonzero(known & ~backwards)[:8]
    for panel, name in zip(panels, criteria, strict=True):
        x = values[name]
        (marks,) = panel.plot(
            x, np.zeros(x.size), linestyle="none", marker="|", markersize=16.0, color="#9a9a9a"
        )
        entries.setdefault("All orders", marks)
        for number, order in enumerate(named):
            (point,) = panel.plot(
                x[order], 0.0, linestyle="none", marker=MARKERS[number % len(MARKERS)],
                markersize=6.0, markerfacecolor=shade(number / max(len(named) - 1, 1)),
                markeredgecolor="black", markeredgewidth=0.5,
            )  # fmt: skip
            entries.setdefault(orders[order], point)
        _label_strip(panel, sentence(view.label(name)))
    finished = finish(figure, "Firing orders", notes, entries, "", view.caption)
    return f"firing_orders{view.suffix}", finished


def _label_strip(panel: Axes, text: str) -> None:
    panel.set_yticks([])
    panel.set_ylim(-1.0, 1.0)
    panel.spines["left"].set_visible(False)
    panel.margins(x=0.04)
    panel.set_title(wrap(text, 80))
