"""Pareto fronts of searches (`engine-dyn optimise`), and those that [reduce] kept."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Booleans, Floats, Integers
from sweeps.base.dimensions import DESIGN, FOUND, FULFILLING, RANK, REDUCTION
from sweeps.view.figures.marks import shade
from sweeps.view.figures.scales import free_scale, x_label, y_label
from sweeps.view.figures.sheet import Entries, NamedFigures, finish, new_sheet, rc
from sweeps.view.figures.study import Study, design_text, parameters_of
from sweeps.view.figures.views import View, pick
from sweeps.view.figures.wording import middle_of_sentence, name_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NAMED = 5
"""Designs of a front that the legend names."""

MOST_MARKS = 100
"""Designs of a front that are marked on its line; more of them would hide it."""

MOST_POINTS = 20_000
"""Designs that are drawn; what was found is drawn whole."""


def is_searched(view: View) -> bool:
    """Whether the archive is one of a search, with the design or the front that it found."""
    columns = {FOUND, FULFILLING}
    return "optimisation" in view.data.attrs and columns <= set(view.data.variables)


def searched_names(view: View) -> list[str]:
    """What less or more was wanted of, where that is two names or more and a front was found."""
    about = _about(view)
    wanted = [n for n in (*about["least"], *about["most"]) if n in view.data.variables]
    front = np.asarray(view.data[FOUND].values) == 1
    return wanted if len(wanted) > 1 and front.sum() > 1 else []


def searched_fronts(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw what was found, over each two of the names."""
    view = study.view
    found = np.flatnonzero(view.data[FOUND].values == 1)
    for pair in combinations(names, 2):
        yield f"pareto_{pair[0]}_{pair[1]}", _figure(view, pair, _about(view), found)


def kept_names(view: View) -> list[str]:
    """What less or more was wanted of by the fronts that a reduced archive kept."""
    wanted = [n for _, about in _kept(view) for n in (*about["least"], *about["most"])]
    return [*dict.fromkeys(wanted)]


def kept_fronts(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the fronts that a reduced archive kept, over each two of the names."""
    for number, (found, about) in enumerate(_kept(study.view)):
        own = [name for name in (*about["least"], *about["most"]) if name in names]
        for pair in combinations(own, 2):
            stem = f"pareto_{pair[0]}_{pair[1]}" + (f"_{number + 1}" if number else "")
            yield stem, _figure(study.view, pair, about, found)


def _kept(view: View) -> Iterator[tuple[Integers, dict[str, Any]]]:
    """Places of the designs of each front that was kept, and what was wanted of it."""
    if DESIGN not in view.data.dims or RANK not in view.data:
        return
    asked = json.loads(view.data.attrs[REDUCTION])
    over = parameters_of(view.data)
    for one, ranks in zip(asked["kept"], np.atleast_2d(view.data[RANK].values), strict=True):
        if one["number"] == 0 and one["found"] > 1:
            least, most = ([n for n, s in one["wanted"] if s == sign] for sign in (1.0, -1.0))
            yield np.flatnonzero(ranks), {**asked, **one, "least": least, "most": most,
                                          "over": over}  # fmt: skip


def _about(view: View) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(view.data.attrs["optimisation"])
    return found


def _worst(view: View, name: str, less: bool) -> Floats:
    """The value of each design that counts: the worst one over all points and bearings."""
    array = view.array(name).astype(float)
    rest = [d for d in array.dims if d != DESIGN]
    worst = array.max(rest, skipna=True) if less else array.min(rest, skipna=True)
    return np.asarray(worst.values)


def _figure(view: View, pair: Sequence[str], about: dict[str, Any], found: Integers) -> Figure:
    values = np.array([_worst(view, name, name in about["least"]) for name in pair])
    found = found[np.argsort(values[0, found], kind="stable")]
    known = np.isfinite(values).all(axis=0)
    two = len(about["least"]) + len(about["most"]) == 2
    figure, (panel,) = new_sheet(1, 1, 3.6)
    entries: Entries = {}
    for text, some, colour in _others(view, known, bool(about["within"])):
        (points,) = panel.plot(
            *values[:, some[:: -(-some.size // MOST_POINTS)]], linestyle="none", marker="o",
            markersize=2.5, color=colour, markeredgewidth=0.0, rasterized=True,
        )  # fmt: skip
        entries[text] = points
    (line,) = panel.plot(
        *values[:, found], color=shade(0.15), markersize=3.0, linewidth=1.2,
        marker="" if two and found.size > MOST_MARKS else "o",
        linestyle="-" if two else "none", drawstyle="steps-post", rasterized=found.size > 1000,
    )  # fmt: skip
    entries[f"Best found: front of {found.size} designs"] = line
    common = _named(view, about, found, values, entries, panel)
    for axis, name in enumerate(pair):
        label = f"{view.label(name)}, "
        label += "less is better" if name in about["least"] else "more is better"
        (x_label, y_label)[axis](panel, label, (4.5, 3.2)[axis])
    free_scale(panel, [values[1, known]])
    conditions = ", ".join(about["within"]).replace("<=", "\N{LESS-THAN OR EQUAL TO}")
    conditions = conditions.replace(">=", "\N{GREATER-THAN OR EQUAL TO}")
    every = f" at every {' and '.join(about['at_every'])}" if about["at_every"] else ""
    notes = [*view.notes(pair), f"with {conditions}{every}" if conditions else "", *common]
    # the caption is about one design
    return finish(figure, title_of_front(view, pair), notes, entries)


def number_design(panel: Axes, number: int, here: Floats, text: str, entries: Entries) -> None:
    """Number a design of a front; the legend says which one it is."""
    panel.annotate(
        str(number), tuple(here), textcoords="offset points", xytext=(4, 4), fontsize=8.0,
        weight="bold", zorder=7,
    )  # fmt: skip
    (handle,) = panel.plot(
        [], [], linestyle="none", marker=f"${number}$", markersize=6.0, color=rc("text.color")
    )
    entries[text if text not in entries else f"{text} ({number})"] = handle


def title_of_front(view: View, names: Sequence[str]) -> str:
    """Title of the front of two quantities."""
    first, second = (middle_of_sentence(name_of(view.array(name), name)) for name in names)
    return f"Pareto front of {first} and {second}"


def _others(view: View, known: Booleans, conditions: bool) -> Iterator[tuple[str, Integers, str]]:
    """Designs beside the front: what the legend calls them, their places, and a colour."""
    if FULFILLING not in view.data:  # none of them were kept
        return
    fulfilling = view.data[FULFILLING].values == 1
    if conditions and (known & ~fulfilling).any():
        yield "Designs that fail a condition", np.flatnonzero(known & ~fulfilling), "#e6cfc4"
    if fulfilling.any():
        text = "Designs that meet all conditions" if conditions else "All designs"
        yield text, np.flatnonzero(known & fulfilling), "#a9a9a9"


def _named(
    view: View, about: dict[str, Any], found: Integers, values: Floats, entries: Entries,
    panel: Axes,
) -> list[str]:  # fmt: skip
    """Number some designs of the front; return what the whole front has in common."""
    keys = [key for key in about["over"] if key in view.data.variables
            and key not in (*about["least"], *about["most"])]  # fmt: skip
    common = [key for key in keys if len(np.unique(view.data[key].values[found])) == 1]
    differ = [key for key in keys if key not in common]
    chosen = found[pick(found.size, NAMED)] if differ else found[:0]
    for number, design in enumerate(chosen, start=1):
        text = ", ".join(design_text(view.data, key, int(design)) for key in differ)
        number_design(panel, number, values[:, design], text, entries)
    return [design_text(view.data, key, int(found[0])) for key in common]
