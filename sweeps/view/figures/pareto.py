"""Pareto fronts: all designs over two quantities, and those that no other beats in both.

What beats what is the rule of `sweeps.base.fronts`, as in `sweeps.pareto`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn import status as outcome
from engine_dyn.types import Floats, Integers
from sweeps.base.dimensions import NOT_CHOSEN, REDUCTION
from sweeps.base.fronts import front_of, unbeaten
from sweeps.view.figures.marks import shade
from sweeps.view.figures.scales import free_scale, x_label, y_label
from sweeps.view.figures.searched_front import (
    MOST_POINTS,
    NAMED,
    is_searched,
    kept_fronts,
    kept_names,
    number_design,
    searched_fronts,
    searched_names,
    title_of_front,
)
from sweeps.view.figures.sheet import Entries, NamedFigures, finish, new_sheet
from sweeps.view.figures.study import Study, design_text, parameters_of
from sweeps.view.figures.views import MOST_LINES, View, is_words, pick

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LESS, MORE = 1.0, -1.0

GOALS: Mapping[str, float] = {
    "inertia": LESS, "flywheel_mass": LESS, "flywheel_inertia_required": LESS,
    "inertia_required": LESS, "delta": LESS, "brake_power": MORE, "bmep": MORE,
    "mechanical_efficiency": MORE, "displacement": LESS, "peak_pressure": LESS,
    "torque_irregularity": LESS, "shaking_force_max": LESS,
    "shaking_moment_max": LESS, "main_journal_load_max": LESS, "crank_pin_load_max": LESS,
    "piston_pin_load_max": LESS,
}  # fmt: skip
"""What an engineer wants less or more of; pairs are tried in this order."""

MOST_FIGURES = 2

LEAST_FRONT, LEAST_DESIGNS = 3, 10
"""Fewer designs are no front, and no choice."""

MOST_SHARE = 0.5
"""Of all designs: a greater front says only that the two follow from each other."""

MOST_AT_ONCE = 1_000_000
"""Designs that are read at one time."""

PARTS = ("main_bearing",)
"""Dimensions whose largest value counts."""


@dataclass(frozen=True)
class Front:
    """Two quantities of all designs, and the front.

    Attributes
    ----------
    points : ndarray, shape (2, n)
        Some of the designs, evenly taken.
    values : ndarray, shape (2, m)
        Those of the front, the best in the first quantity first.
    places : ndarray, shape (m,)
        Their numbers in the archive, over `dims`.
    dims : tuple of str
        Axes of the designs.
    count : int
        Designs with numbers.
    """

    points: Floats
    values: Floats
    places: Integers
    dims: tuple[str, ...]
    count: int


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
    """A view at one speed and load: axes that are not chosen with a design are cut."""
    return view.slice_at({dim: view.default(dim) for dim in NOT_CHOSEN if dim in view.data.sizes})


def _is_goal(view: View, name: str) -> bool:
    """Whether a name has one number for each design, and not the same in all."""
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
        found = front(view, pair)
        enough = found.count >= LEAST_DESIGNS and found.values.shape[1] >= LEAST_FRONT
        if asked or (enough and found.values.shape[1] <= MOST_SHARE * found.count):
            yield f"pareto_{pair[0]}_{pair[1]}", _figure(view, pair, found)
            drawn += 1
        if drawn == MOST_FIGURES:
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
    """Number of the first design of each slab along the first axis, and the values of both."""
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


def _figure(view: View, names: Sequence[str], found: Front) -> Figure:
    figure, (panel,) = new_sheet(1, 1, 3.6)
    entries: Entries = {}
    (points,) = panel.plot(
        *found.points, linestyle="none", marker="o", markersize=3.0, color="#b8b8b8",
        markeredgewidth=0.0, rasterized=True,
    )  # fmt: skip
    (line,) = panel.plot(
        *found.values, color=shade(0.15), marker="o", markersize=3.5, linewidth=1.4,
        drawstyle="steps-post", rasterized=found.places.size > 1000,
    )  # fmt: skip
    every = found.points.shape[1] == found.count
    entries["All designs" if every else "Some of the designs"] = points
    entries[f"Pareto front, {found.places.size} of {found.count} designs"] = line
    _named(panel, view, found, entries)
    x, y = found.points
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


def _named(panel: Axes, view: View, found: Front, entries: Entries) -> None:
    """Number some designs of the front; the legend has their axes."""
    shape = [view.data.sizes[dim] for dim in found.dims]
    for number, which in enumerate(pick(found.places.size, NAMED), start=1):
        at = np.unravel_index(int(found.places[which]), shape)
        said = []
        for dim, index in zip(found.dims, at, strict=True):
            if dim == "design" and "case" not in view.data.variables:
                said += [
                    design_text(view.data, key, int(index)) for key in parameters_of(view.data)
                ]
            else:
                said.append(view.axis(dim).tag(int(index)))
        number_design(panel, number, found.values[:, which], ", ".join(said), entries)
