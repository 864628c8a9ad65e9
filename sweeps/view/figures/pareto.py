"""Pareto fronts: of all designs over two objectives, of searches, and those that [reduce] kept."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn import status as outcome
from engine_dyn.types import Booleans, Floats, Integers
from sweeps.base.dimensions import DESIGN, FOUND, FULFILLING, NOT_CHOSEN, RANK, REDUCTION
from sweeps.base.fronts import front_of, unbeaten
from sweeps.view.figures.marks import shade
from sweeps.view.figures.scales import free_scale
from sweeps.view.figures.sheet import Entries, NamedFigures, finish, new_sheet, rc, x_label, y_label
from sweeps.view.figures.study import Study, design_text, parameters_of
from sweeps.view.figures.views import MOST_LINES, View, is_words, pick
from sweeps.view.figures.wording import middle_of_sentence, name_of, wrap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NAMED = 5  # Largest number of designs of a front that the legend names

# Largest number of designs that are drawn besides a front, which is drawn whole
MOST_POINTS = 20_000

MOST_AT_ONCE = 1_000_000  # Largest number of designs that are read at one time


def is_searched(view: View) -> bool:
    """Whether the archive is one of a search, with the design or the front that it found."""
    return "optimisation" in view.data.attrs and {FOUND, FULFILLING} <= set(view.data.variables)


def searched_names(view: View) -> list[str]:
    """Quantities that a search was to make small or large, if it found a front of two or more."""
    about = _about(view)
    wanted = [n for n in (*about["least"], *about["most"]) if n in view.data.variables]
    front = np.asarray(view.data[FOUND].values) == 1
    return wanted if len(wanted) > 1 and front.sum() > 1 else []


def searched_fronts(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw what was found, over each two of the names."""
    view = study.view
    best = np.flatnonzero(view.data[FOUND].values == 1)
    for pair in combinations(names, 2):
        yield f"pareto_{pair[0]}_{pair[1]}", _searched_figure(view, pair, _about(view), best)


def kept_names(view: View) -> list[str]:
    """Quantities of the fronts that a reduced archive kept."""
    wanted = [n for _, about in _kept(view) for n in (*about["least"], *about["most"])]
    return [*dict.fromkeys(wanted)]


def kept_fronts(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the fronts that a reduced archive kept, over each two of the names."""
    for number, (best, about) in enumerate(_kept(study.view)):
        own = [name for name in (*about["least"], *about["most"]) if name in names]
        for pair in combinations(own, 2):
            stem = f"pareto_{pair[0]}_{pair[1]}" + (f"_{number + 1}" if number else "")
            yield stem, _searched_figure(study.view, pair, about, best)


def _kept(view: View) -> Iterator[tuple[Integers, dict[str, Any]]]:
    """Places of the designs of each kept front, and its optimised quantities."""
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
    about: dict[str, Any] = json.loads(view.data.attrs["optimisation"])
    return about


def _worst(view: View, name: str, less: bool) -> Floats:
    """Value that counts for each design: the worst one over all points and bearings."""
    array = view.array(name).astype(float)
    rest = [d for d in array.dims if d != DESIGN]
    worst = array.max(rest, skipna=True) if less else array.min(rest, skipna=True)
    return np.asarray(worst.values)


def _searched_figure(
    view: View, pair: Sequence[str], about: dict[str, Any], best: Integers
) -> Figure:
    values = np.array([_worst(view, name, name in about["least"]) for name in pair])
    best = best[np.argsort(values[0, best], kind="stable")]
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
    front = f"Best found: front of {best.size:,} designs"
    third = [name for name in (*about["least"], *about["most"]) if name not in pair]
    if len(third) == 1:  # The front is an area, and its colours tell what is gained across it
        coloured = _worst(view, third[0], third[0] in about["least"])[best]
        area = entries[front] = panel.scatter(
            values[0, best], values[1, best], c=coloured, s=5.0, cmap="viridis", linewidths=0.0,
            rasterized=best.size > 1000, zorder=2.5,
        )  # fmt: skip
        bar = figure.colorbar(area, ax=panel, aspect=28, pad=0.02)
        bar.set_label(wrap(_wanted_label(view, third[0], about), 36))
    else:
        # Marks of more than 100 designs would hide the line of the front.
        (entries[front],) = panel.plot(
            *values[:, best], color=shade(0.15), markersize=3.0, linewidth=1.2,
            marker="" if two and best.size > 100 else "o",
            linestyle="-" if two else "none", drawstyle="steps-post", rasterized=best.size > 1000,
        )  # fmt: skip
    common = _named_designs(view, about, best, values, entries, panel)
    for axis, name in enumerate(pair):
        (x_label, y_label)[axis](panel, _wanted_label(view, name, about), (4.5, 3.2)[axis])
    free_scale(panel, [values[1, known]])
    conditions = ", ".join(about["within"]).replace("<=", "\N{LESS-THAN OR EQUAL TO}")
    conditions = conditions.replace(">=", "\N{GREATER-THAN OR EQUAL TO}")
    every = f" at every {' and '.join(about['at_every'])}" if about["at_every"] else ""
    notes = [*view.notes(pair), f"with {conditions}{every}" if conditions else "",
             about.get("text", ""), *common]  # fmt: skip
    return finish(figure, title_of_front(view, pair), notes, entries)


def _wanted_label(view: View, name: str, about: Mapping[str, Any]) -> str:
    return f"{view.label(name)}, {'less' if name in about['least'] else 'more'} is better"


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
    """Groups of designs off the front: text of the legend, their places, and a colour."""
    if FULFILLING not in view.data:  # The archive kept no designs off the front
        return
    fulfilling = view.data[FULFILLING].values == 1
    if conditions and (known & ~fulfilling).any():
        yield "Designs that fail a condition", np.flatnonzero(known & ~fulfilling), "#e6cfc4"
    if fulfilling.any():
        text = "Designs that meet all conditions" if conditions else "All designs"
        yield text, np.flatnonzero(known & fulfilling), "#a9a9a9"


def _named_designs(
    view: View, about: dict[str, Any], best: Integers, values: Floats, entries: Entries,
    panel: Axes,
) -> list[str]:  # fmt: skip
    """Number some designs of the front; return the values that the whole front shares."""
    keys = [key for key in about["over"] if key in view.data.variables
            and key not in (*about["least"], *about["most"])]  # fmt: skip
    common = [key for key in keys if len(np.unique(view.data[key].values[best])) == 1]
    differ = [key for key in keys if key not in common]
    for number, design in enumerate(best[pick(best.size, NAMED)] if differ else best[:0], start=1):
        text = ", ".join(design_text(view.data, key, int(design)) for key in differ)
        number_design(panel, number, values[:, design], text, entries)
    return [design_text(view.data, key, int(best[0])) for key in common]


LESS, MORE = 1.0, -1.0

GOALS: Mapping[str, float] = {
    "inertia": LESS, "flywheel_mass": LESS, "flywheel_inertia_required": LESS,
    "inertia_required": LESS, "delta": LESS, "brake_power": MORE, "bmep": MORE,
    "mechanical_efficiency": MORE, "displacement": LESS, "peak_pressure": LESS,
    "torque_irregularity": LESS, "shaking_force_max": LESS,
    "shaking_moment_max": LESS, "main_journal_load_max": LESS, "crank_pin_load_max": LESS,
    "piston_pin_load_max": LESS,
}  # fmt: skip
"""Quantities that an engineer wants small or large; pairs are tried in this order."""

PARTS = ("main_bearing",)  # Dimensions along which only the largest value of a quantity counts


@dataclass(frozen=True)
class Front:
    """Two quantities of all designs, and the front."""

    points: Floats  # Both quantities of some of the designs, evenly taken, shape (2, n)
    values: Floats  # Both quantities of the front, the best in the first one first, shape (2, m)
    places: Integers  # Flat indices of the designs of the front, over `dims`
    dims: tuple[str, ...]  # Axes of the designs
    count: int  # Number of designs with numbers


def pareto_names(view: View) -> list[str]:
    """Quantities that one wants less or more of, and columns of designs; or two that are asked for.

    An axis is taken only when it is asked for: over a grid, the front of what falls along an axis
    is that line again. A list of designs that differ from a nominal one in one parameter each is no
    choice either, nor is one of designs at several speeds. Of a search it is what was wanted of it,
    and so it is of the fronts that [reduce] kept.
    """
    asked = view.options.quantities
    if is_searched(view) and not asked:
        return searched_names(view)
    if REDUCTION in view.data.attrs and not asked:
        return kept_names(view)
    if len(asked) != 2:
        if view.nominal or not set(NOT_CHOSEN).isdisjoint(parameters_of(view.data)):
            return []
        view = _of_choices(view)
    wanted = asked if len(asked) == 2 else [name for name in GOALS if name not in view.data.sizes]
    names = [name for name in wanted if _is_goal(view, name)]
    return names if len(names) > 1 else []


def _of_choices(view: View) -> View:
    """View at one speed and load: axes that do not belong to a design are cut."""
    return view.slice_at({dim: view.default(dim) for dim in NOT_CHOSEN if dim in view.data.sizes})


def _is_goal(view: View, name: str) -> bool:
    """Whether a variable has one number for each design, and differs between designs."""
    if name not in view.data.variables:
        return False
    array = view.array(name)
    if is_words(array) or array.dtype.kind not in "iuf":
        return False
    axes = [str(dim) for dim in array.dims if dim not in PARTS]
    if not axes or {"crank_angle", "order", "throw", "bay", "cylinder"} & set(array.dims):
        return False
    some = {dim: pick(size, MOST_LINES) for dim, size in array.sizes.items()}
    values = np.asarray(array.isel(some).values, dtype=float)
    known = values[np.isfinite(values)]
    return known.size > 0 and bool(np.ptp(known) > view.least_span(name) * np.abs(known).max())


def paretos(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the fronts of pairs that pull against each other, at most a few."""
    if is_searched(study.view) and not study.view.options.quantities:
        yield from searched_fronts(study, names)
        return
    if REDUCTION in study.view.data.attrs and not study.view.options.quantities:
        yield from kept_fronts(study, names)
        return
    drawn = 0
    asked = len(study.view.options.quantities) == 2
    view = study.view if asked else _of_choices(study.view)
    for pair in combinations(names, 2):
        of_pair = front(view, pair)
        # Less than ten designs, or three on the front, leave no choice; a front of most designs
        # only shows that the two quantities follow from each other.
        enough = of_pair.count >= 10 and of_pair.values.shape[1] >= 3
        if asked or (enough and of_pair.values.shape[1] <= 0.5 * of_pair.count):
            yield f"pareto_{pair[0]}_{pair[1]}", _figure(view, pair, of_pair)
            drawn += 1
        if drawn == 2:
            return


def front(view: View, names: Sequence[str]) -> Front:
    """Find the front of two names over all designs, a slab of the archive at a time."""
    signs = np.array([[GOALS.get(name, LESS)] for name in names])
    used = {dim for name in names for dim in view.array(name).dims if dim not in PARTS}
    dims = tuple(str(dim) for dim in view.data.sizes if dim in used)
    total = int(np.prod([view.data.sizes[dim] for dim in dims]))
    step = max(1, -(-total // MOST_POINTS))
    best, places = np.empty((2, 0)), np.empty(0, dtype=np.int64)
    some, count = [np.empty((2, 0))], 0
    for first, values in _slabs(view, names, dims):
        known = np.flatnonzero(np.isfinite(values).all(axis=0))
        pairs = signs * values[:, known]
        count += known.size
        some.append(values[:, known][:, (known + first) % step == 0])
        candidates = unbeaten(best, pairs)
        both = np.hstack([best, pairs[:, candidates]])
        kept = front_of(*both)
        best, places = both[:, kept], np.concatenate([places, known[candidates] + first])[kept]
    return Front(np.hstack(some), signs * best, places, dims, count)


def _slabs(view: View, names: Sequence[str], dims: Sequence[str]) -> Iterator[tuple[int, Floats]]:
    """Number of the first design of each slab along the first axis, and both quantities' values."""
    sizes = {dim: view.data.sizes[dim] for dim in dims}
    status = view.array("status") if "status" in view.data.variables else None
    if status is not None and not set(status.dims) <= set(dims):
        status = None
    inner = int(np.prod(list(sizes.values())[1:]))
    rows = max(1, MOST_AT_ONCE // inner)
    for begin in range(0, sizes[dims[0]], rows):
        part = {dims[0]: slice(begin, begin + rows)}
        shape = sizes | {dims[0]: min(rows, sizes[dims[0]] - begin)}
        values = []
        for name in names:
            array = view.at(name, part).astype(float)
            for dim in PARTS:
                if dim in array.dims:
                    array = array.max(dim)
            values.append(array.set_dims(shape).transpose(*dims).values.reshape(-1))
        if status is not None:
            codes = view.at("status", part)
            good = np.isin(
                codes.set_dims(shape).transpose(*dims).values.reshape(-1), outcome.WITH_NUMBERS
            )
            values = [np.where(good, one, np.nan) for one in values]
        yield begin * inner, np.array(values)


def _figure(view: View, names: Sequence[str], of_pair: Front) -> Figure:
    figure, (panel,) = new_sheet(1, 1, 3.6)
    entries: Entries = {}
    (points,) = panel.plot(
        *of_pair.points, linestyle="none", marker="o", markersize=3.0, color="#b8b8b8",
        markeredgewidth=0.0, rasterized=True,
    )  # fmt: skip
    (line,) = panel.plot(
        *of_pair.values, color=shade(0.15), marker="o", markersize=3.5, linewidth=1.4,
        drawstyle="steps-post", rasterized=of_pair.places.size > 1000,
    )  # fmt: skip
    every = of_pair.points.shape[1] == of_pair.count
    entries["All designs" if every else "Some of the designs"] = points
    entries[f"Pareto front, {of_pair.places.size} of {of_pair.count} designs"] = line
    _named(panel, view, of_pair, entries)
    x, y = of_pair.points
    free_scale(panel, [x], "x")
    free_scale(panel, [y])
    x_label(panel, _label(view, names[0]), 4.5)
    y_label(panel, _label(view, names[1]), 3.2)
    title = title_of_front(view, names)
    return finish(figure, title, view.notes(names), entries, caption=view.caption)


def _label(view: View, name: str) -> str:
    more = GOALS.get(name, LESS) == MORE
    part = ", largest" if set(PARTS) & set(view.array(name).dims) else ""
    return f"{view.label(name)}{part}, {'more' if more else 'less'} is better"


def _named(panel: Axes, view: View, of_pair: Front, entries: Entries) -> None:
    """Number some designs of the front; the legend has their axes."""
    shape = [view.data.sizes[dim] for dim in of_pair.dims]
    for number, which in enumerate(pick(of_pair.places.size, NAMED), start=1):
        at = np.unravel_index(int(of_pair.places[which]), shape)
        said = []
        for dim, index in zip(of_pair.dims, at, strict=True):
            if dim == "design" and "case" not in view.data.variables:
                said += [
                    design_text(view.data, key, int(index)) for key in parameters_of(view.data)
                ]
            else:
                said.append(view.axis(dim).tag(int(index)))
        number_design(panel, number, of_pair.values[:, which], ", ".join(said), entries)
