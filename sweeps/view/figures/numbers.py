"""Variables with one number for each design: which figure each of them gets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sweeps.view.figures.cases import case_chart, family_figure, family_panels, scatter
from sweeps.view.figures.lines import COUNTED, line_figure
from sweeps.view.figures.maps import map_figure
from sweeps.view.figures.plain_numbers import deviations_of_speed, repeats_an_axis, without_twins
from sweeps.view.figures.sheet import NamedFigures
from sweeps.view.figures.study import Study, parameters_of
from sweeps.view.figures.views import (
    MOST_READ,
    MOST_ROWS,
    NO_VALUE,
    View,
    facet_of,
    is_words,
    stem_of,
)

ON_COMMON_AXES = {
    "omega_extremes": ("omega_max", "omega_mean", "omega_min"),
    "torque_extremes": ("torque_max", "torque_mean", "torque_min"),
}
"""Variables that share a figure if they depend on the same axes, by the name of its file."""

MAIN = ("delta",)
"""What a study is made for: it is drawn against each of its axes, even where there is a map."""

UNIT_CHANGES = {"load_coefficient": "load_exponent"}
"""A variable whose unit depends on a parameter: it is not drawn along that parameter."""

WHOLE = (*COUNTED, "cylinders", "passes", "truncation")
"""Dimensions of whole numbers: there is nothing between them that a map could show."""

DIRECTION = "direction"
"""Two directions of one vector: no axis to draw along where there is another."""

FEWEST_OF_MAP = 5
"""Values of an axis below which lines show more than a map."""


def says_something(view: View, name: str) -> bool:
    """Whether a figure of a number shows more than a line of ``engine-dyn show``.

    What is the same in all designs does not, nor what repeats an axis or the nominal speed.
    """
    return not _is_level(view, name) and not repeats_an_axis(view, name)


def numbers(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw variables that are numbers and say something: points, maps, small multiples of these."""
    study, names = without_twins(deviations_of_speed(study, names), names)
    for stem, group in _groups(study.view, names):
        axes = study.view.axes(group)
        if "design" in axes:
            yield from _over_designs(study, stem, group, axes)
            continue
        view = study.view
        mixed = UNIT_CHANGES.get(group[0], "")
        if mixed in axes:
            view = view.slice_at({mixed: view.default(mixed)})
            axes.remove(mixed)
        if len(axes) == 1:
            yield f"{stem}_{axes[0]}", line_figure(view, group, axes[0])
        elif axes:
            for name in group:
                yield from _study_figures(view, name)


def _is_level(view: View, name: str) -> bool:
    """Whether one number says all of a variable: it has no axis, or none does anything to it.

    So does "no value", where there is none and no design failed.
    """
    axes, array = view.axes([name]), view.array(name)
    if not axes:
        return True
    if array.size <= MOST_READ and not np.isfinite(np.asarray(array.values, dtype=float)).any():
        return bool((view.outcomes(name, array, {}) == NO_VALUE).all())
    return all(view.idle([name], dim) for dim in axes)


def _groups(view: View, names: Sequence[str]) -> list[tuple[str, list[str]]]:
    """Variables that share axes, by the name of their figure; all others alone."""
    groups: list[tuple[str, list[str]]] = []
    taken: set[str] = set()
    for stem, members in ON_COMMON_AXES.items():
        found = [name for name in members if name in names]
        alike = {(view.array(n).dims, view.array(n).attrs.get("units")) for n in found}
        if len(found) > 1 and len(alike) == 1:
            groups.append((stem, found))
            taken |= set(found)
    return groups + [(name, [name]) for name in names if name not in taken]


def _study_figures(view: View, name: str) -> NamedFigures:
    """A number over the axes of a study: line, map, or small multiples of them."""
    idle = [dim for dim in view.axes([name]) if view.idle([name], dim)]
    axes = [dim for dim in view.axes([name]) if dim not in idle]
    numbers = [dim for dim in axes if not view.axis(dim).words]
    wide = [d for d in numbers if view.data.sizes[d] >= FEWEST_OF_MAP and d not in WHOLE]
    stem = name
    if len(wide) >= 2:
        # the two longest, in the order of the archive
        chosen = sorted(wide, key=lambda dim: -view.data.sizes[dim])[:2]
        along, up = (dim for dim in axes if dim in chosen)
        facet = facet_of(view, [name], (along, up))
        stem += f"_map_{along}_{up}" + (f"_by_{facet}" if facet else "")
        yield stem + view.suffix, map_figure(view, name, along, up, facet)
        if name not in MAIN:
            return
        for dim in wide:
            over = min((d for d in axes if d != dim), key=lambda d: view.data.sizes[d])
            yield f"{name}_{dim}{view.suffix}", line_figure(view, [name], dim, over)
        return
    pool = [dim for dim in numbers if dim != DIRECTION] or axes
    along = max(
        pool,
        key=lambda d: (d in COUNTED, d not in (*WHOLE, DIRECTION), view.data.sizes[d]),
    )
    second = facet_of(view, [name], (along,))
    facet = facet_of(view, [name], (along, second)) if second else None
    stem += f"_{along}" + (f"_by_{facet}" if facet else "")
    yield stem + view.suffix, line_figure(view, [name], along, second, facet)
    for dim in numbers if name in MAIN else ():
        if dim != along and view.data.sizes[dim] > 2:
            yield f"{name}_{dim}{view.suffix}", line_figure(view, [name], dim, along)


def _over_designs(
    study: Study, stem: str, group: Sequence[str], axes: Sequence[str]
) -> NamedFigures:
    """Variables over a list of designs: along each parameter that has a family."""
    if len(axes) > 1:
        for view in [view for _, view in study.base] or [study.view]:
            for name in group:
                yield from _study_figures(view, name)
        return
    if study.base:
        if group[0] in MAIN:
            for parameter, view in study.base:
                yield stem_of(group[0], view, parameter), family_figure(study, group[0], parameter)
        else:
            families = [
                (p, view)
                for p, view in study.base
                if p != UNIT_CHANGES.get(group[0]) and view.varies(group, p)
            ]
            if len(families) == 1:
                ((parameter, view),) = families
                yield stem, line_figure(view, group, parameter)
            elif families:
                yield stem, family_panels(study.view, group, families)
    if not study.base or (group[0] in MAIN and study.apart):
        size = study.view.data.sizes["design"]
        parameters = [
            key for key in parameters_of(study.view.data) if not is_words(study.view.array(key))
        ]
        few = size <= MOST_ROWS or not parameters
        figure = case_chart(study.view, group) if few else scatter(study.view, group, parameters)
        yield f"{stem}_cases", figure
