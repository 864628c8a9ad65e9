"""Variables with one number for each design: along parameters, case by case, or scattered."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from engine_dyn.types import Floats
from engine_dyn.units import RPM
from sweeps.base.dimensions import COUNTED, PUBLISHED, REDUCTION
from sweeps.base.naming import DESCRIPTION
from sweeps.view.figures.maps import map_figure
from sweeps.view.figures.marks import doubt_look, line_style, lost_handle, lost_look, target_lines
from sweeps.view.figures.parameter_lines import (
    COMPUTED,
    Line,
    common_label,
    draw_points,
    line_figure,
    line_of,
    mark_outcomes,
    told_apart,
)
from sweeps.view.figures.scales import (
    comparable,
    free_scale,
    log_ticks,
    parameter_ticks,
    sensible_span,
)
from sweeps.view.figures.sheet import (
    GREY,
    OWN_ORDINATES,
    Entries,
    NamedFigures,
    finish,
    multiples,
    new_sheet,
    x_label,
)
from sweeps.view.figures.study import Study, design_text, parameters_of
from sweeps.view.figures.views import (
    MOST_PANELS,
    MOST_READ,
    MOST_ROWS,
    NO_VALUE,
    View,
    facet_of,
    is_log,
    is_words,
    pick,
    stem_of,
)
from sweeps.view.figures.wording import HARD_SPACE, name_of, sentence, symbol_of, typeset

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def family_figure(study: Study, name: str, parameter: str) -> Figure:
    """One variable against one parameter, with the families that lie elsewhere."""
    view = dict(study.base)[parameter]
    elsewhere = [
        (other, keys)
        for key, other, keys in study.elsewhere
        # Words, such as names of arrangements, have no place on a common axis of numbers
        if key == parameter and not view.axis(parameter).words
    ]
    more = [
        line_of(other, name, {}, other.fixed["design"], x=other.axis(parameter).values)
        for other, _ in elsewhere
    ]
    apart = dict.fromkeys(key for _, keys in elsewhere for key in keys)
    tags = [design_text(study.view.data, key, 0) for key in apart]
    text = f"{', '.join(tags)} (nominal)" if more else COMPUTED
    view = replace(view, others=tuple(text for text in view.others if text not in tags))
    return line_figure(view, [name], parameter, more=more, text=text)


def _lines_of(view: View, group: Sequence[str]) -> list[Line]:
    """A line for each variable, with its name where there are several."""
    several = len(group) > 1
    names = {name: view.title(name) if several else COMPUTED for name in group}
    return [line_of(view, name, {}, text) for name, text in names.items()]


def family_panels(view: View, group: Sequence[str], families: Sequence[tuple[str, View]]) -> Figure:
    """Small multiples: the same variables along one parameter after the other."""
    shown = families[:MOST_PANELS]
    lines = [_lines_of(family, group) for _, family in shown]
    ordinates = [[line.y for line in some] for some in lines]
    every = [y for each in ordinates for y in each]
    share = comparable(ordinates)
    sheet = multiples(len(shown), 0.0, 2.05, sharey=share)
    for panel, (parameter, family), some in zip(sheet.panels, shown, lines, strict=True):
        draw_points(panel, family.axis(parameter), some, sheet.entries)
        target_lines(panel, family, group, sheet.entries)
    for panel, (parameter, family), own in zip(sheet.panels, shown, ordinates, strict=True):
        axis = family.axis(parameter)
        free_scale(panel, every if share else own)
        parameter_ticks(panel, axis, "x", 5.4 / sheet.columns)
        x_label(panel, axis.label, 5.4 / sheet.columns)
    label = common_label(view, group)
    sheet.label_y(label, 1.5)
    span = sensible_span(sheet.panels, every) if share else OWN_ORDINATES
    return sheet.finish(
        f"{label.split(HARD_SPACE)[0]}, one parameter varied at a time",
        [*view.notes(group), span], f"Nominal: {', '.join(view.others)}",
        legend=told_apart(sheet.entries),
    )  # fmt: skip


def case_chart(view: View, group: Sequence[str]) -> Figure:
    """Unrelated designs: a row for each."""
    axis = view.axis("design")
    rows = [axis.tag(i) if axis.words else typeset(axis.values[i]) for i in range(axis.size)]
    picked = pick(axis.size, MOST_ROWS)
    figure, (panel,) = new_sheet(1, 1, 0.7 + 0.2 * len(picked))
    entries: Entries = {}
    for rank, line in enumerate(_lines_of(view, group)):
        style = line_style(rank, len(group)) | {"linestyle": "none"}
        y = np.arange(len(picked))
        (drawn,) = panel.plot(line.y[picked], y, **style)
        entries[line.text] = drawn
        if line.published is not None and np.isfinite(line.published).any():
            look = {"markersize": 8, "markerfacecolor": "none", "color": style["color"]}
            (rings,) = panel.plot(line.published[picked], y, "o", **look)
            entries.setdefault("Published", rings)
        for why in sorted({str(said) for said in line.outcomes if said}):
            if why == NO_VALUE and axis.name in COUNTED:
                continue  # An engine with fewer parts has no such part
            places = np.flatnonzero(line.outcomes[picked] == why)
            if np.isfinite(line.y[picked][places]).any():
                panel.plot(line.y[picked][places], places, **doubt_look(9.0))
                continue
            left = panel.get_yaxis_transform()
            panel.plot(np.full(places.size, 0.01), places, transform=left, **lost_look(why, GREY))
            entries.setdefault(sentence(why), lost_handle(why))
    target_lines(panel, view, group, entries, upright=True)
    panel.set_yticks(range(len(picked)), [rows[i] for i in picked])
    panel.set_ylim(len(picked) - 0.5, -0.5)
    label = common_label(view, group)
    x_label(panel, label, 4.5)
    notes = [*view.notes(group), axis.picked_text(MOST_ROWS)]
    title = f"{label.split(HARD_SPACE)[0]}, case by case"
    return finish(figure, title, notes, entries if told_apart(entries) else {})


def scatter(view: View, group: Sequence[str], parameters: Sequence[str]) -> Figure:
    """Many unrelated designs: the variable against each parameter."""
    shown = parameters[:MOST_PANELS]
    sheet = multiples(len(shown), 0.0, 2.05, sharey=True)
    entries = sheet.entries
    size = view.data.sizes["design"]
    picked = pick(size, 5000)
    lines = _lines_of(view, group)
    for panel, parameter in zip(sheet.panels, shown, strict=True):
        x = view.numbers(parameter)[picked]
        for rank, line in enumerate(lines):
            y, colour = line.y[picked], line_style(rank, len(lines))["color"]
            (dots,) = panel.plot(x, y, ".", color=colour, markersize=2.5, rasterized=True)
            entries.setdefault(line.text, dots)
            for text, handle in mark_outcomes(panel, (x, y, line.outcomes[picked]), 4.0).items():
                entries.setdefault(text, handle)
        target_lines(panel, view, group, entries)
        known = np.unique(x[np.isfinite(x)])
        if is_log(known):
            panel.set_xscale("log")
            log_ticks(panel.xaxis, known[0], known[-1])
        free_scale(panel, [line.y for line in lines])
        x_label(panel, view.label(parameter), 5.4 / sheet.columns)
    label = common_label(view, group)
    sheet.label_y(label, 1.6)
    notes = view.notes(group)
    if len(picked) < size:
        notes.append(f"{len(picked)} of {size} designs shown")
    which = "designs that were kept" if REDUCTION in view.data.attrs else "all designs"
    return sheet.finish(f"{label.split(HARD_SPACE)[0]}, {which}", notes, legend=told_apart(entries))


def _values(view: View, name: str) -> Floats | None:
    """All values of a variable, or None where they are too many to compare."""
    array = view.array(name)
    return np.asarray(array.values, dtype=float) if array.size <= MOST_READ else None


def repeats_an_axis(view: View, name: str) -> bool:
    """Whether a variable holds the values of an axis again, such as a wanted delta that is met.

    So does the mean speed that is nearly the one nominal speed of all designs.
    """
    values, array = _values(view, name), view.array(name)
    if values is None or not np.isfinite(values).any():
        return False
    if name == "omega_mean" and not ("speed" in view.data.coords and view.data["speed"].ndim):
        return _equal(values, np.full_like(values, np.nanmean(values)))
    for key, coordinate in view.data.coords.items():
        if key == name or not coordinate.dims or coordinate.dtype.kind not in "iuf":
            continue
        if coordinate.attrs.get("units") != array.attrs.get("units"):
            continue
        if set(coordinate.dims) <= set(array.dims):
            sizes = {dim: array.sizes[dim] for dim in array.dims}
            same = coordinate.variable.set_dims(sizes).transpose(*array.dims).values
            if np.ptp(np.asarray(same, dtype=float)) and _equal(values, same):
                return True
    return False


def _equal(one: Floats, other: Floats) -> bool:
    known = np.isfinite(one)
    size = np.abs(np.asarray(other, dtype=float)[known])
    return bool(np.all(np.abs(one - other)[known] <= 1e-3 * size))


def without_equals(study: Study, names: Sequence[str]) -> tuple[Study, list[str]]:
    """Leave out variables that are equal to an earlier one, whose figures then say so."""
    view = study.view
    kept: list[str] = []
    said: dict[str, str] = {}
    for name in names:
        array, values = view.array(name), _values(view, name)
        equal = None
        for other in kept:
            earlier = view.array(other)
            if earlier.dims != array.dims or earlier.attrs.get("units") != array.attrs.get("units"):
                continue
            others = _values(view, other)
            if values is None or others is None or not np.isfinite(values).any():
                continue
            if (np.isfinite(values) == np.isfinite(others)).all() and _equal(values, others):
                equal = other
                break
        if equal is None or view.published(name, everywhere=True):
            kept.append(name)
        else:
            text = f"{name_of(array, name)} {symbol_of(array)}".rstrip()
            said[equal] = f"{said[equal]}, {text}" if equal in said else f"the same: {text}"
    return _changed(study, lambda one: replace(one, equals={**one.equals, **said})), kept


def deviations_of_speed(study: Study, names: Sequence[str]) -> Study:
    """Put deviations in percent from the nominal speed in the place of speeds, where it varies."""
    names = [
        name
        for name in names
        if name.startswith("omega")
        and name not in study.view.options.targets
        and study.view.array(name).size <= MOST_READ
    ]
    return _changed(study, lambda view: _with_deviations(view, names)) if names else study


def _changed(study: Study, change: Callable[[View], View]) -> Study:
    """Study with one change to all its views."""
    return replace(
        study,
        view=change(study.view),
        base=tuple((parameter, change(view)) for parameter, view in study.base),
        elsewhere=tuple(
            (parameter, change(view), keys) for parameter, view, keys in study.elsewhere
        ),
    )


def _with_deviations(view: View, names: Sequence[str]) -> View:
    data = view.data
    if "speed" not in data.coords or not data.coords["speed"].dims:
        return view
    nominal = data.coords["speed"].variable
    new = {}
    for name in names:
        array = view.array(name)
        # One revolution a minute in each unit of speeds.
        unit = {"rpm": 1.0, "rad s-1": RPM}.get(str(array.attrs.get("units")))
        if unit is None or not set(nominal.dims) <= set(array.dims):
            continue
        symbol = symbol_of(array).strip("$")
        letter = "n" if str(array.attrs["units"]) == "rpm" else r"\omega_n"
        attributes = {
            **array.attrs,
            DESCRIPTION: f"deviation of the {name_of(array, name)}, from the nominal speed",
            "common_name": "deviation of the crank speed from the nominal speed",
            "symbol": rf"${symbol}/{letter}-1$" if symbol else "",
            "units": "percent",
        }
        for key in (name, name + PUBLISHED):
            if key in data.data_vars and set(nominal.dims) <= set(view.array(key).dims):
                ratio = view.array(key) / (nominal * unit)  # xarray pairs dimensions by name
                values = (100.0 * (ratio - 1.0)).transpose(*view.array(key).dims)
                new[key] = xr.Variable(values.dims, values.values, attributes)
    return replace(view, data=data.assign(new)) if new else view


MAIN = ("delta",)  # Main results of a study, drawn along each axis even where there is a map

UNIT_CHANGES = {"load_coefficient": "load_exponent"}
"""Variables whose unit depends on a parameter, along which they are not drawn."""


def says_something(view: View, name: str) -> bool:
    """Whether a figure of a number shows more than a line of ``engine-dyn show``.

    What is the same in all designs does not, nor what repeats an axis or the nominal speed.
    """
    return not _is_level(view, name) and not repeats_an_axis(view, name)


def numbers(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw variables that are numbers and say something: points, maps, small multiples of these."""
    study, names = without_equals(deviations_of_speed(study, names), names)
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
    """Whether one number describes a variable: it has no axis, or no axis has an effect."""
    # Where all values are missing though no design failed, "no value" describes the variable.
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
    for what in ("omega", "torque"):
        stem, members = f"{what}_extremes", [f"{what}_{end}" for end in ("max", "mean", "min")]
        present = [name for name in members if name in names]
        alike = {(view.array(n).dims, view.array(n).attrs.get("units")) for n in present}
        if len(present) > 1 and len(alike) == 1:
            groups.append((stem, present))
            taken |= set(present)
    return groups + [(name, [name]) for name in names if name not in taken]


def _study_figures(view: View, name: str) -> NamedFigures:
    """A number over the axes of a study: line, map, or small multiples of them."""
    idle = [dim for dim in view.axes([name]) if view.idle([name], dim)]
    axes = [dim for dim in view.axes([name]) if dim not in idle]
    numbers = [dim for dim in axes if not view.axis(dim).words]
    # Over an axis of few values lines show more than a map, and a map would colour the room between
    # whole numbers, where no design lies.
    whole = (*COUNTED, "cylinders", "passes", "truncation")
    wide = [
        d for d in numbers if view.data.sizes[d] >= 5 and d not in whole and view.axis(d).joined
    ]
    stem = name
    if len(wide) >= 2:
        # The two longest axes, in the order of the archive
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
    pool = [dim for dim in numbers if dim != "direction"] or axes
    along = max(
        pool, key=lambda d: (d in COUNTED, d not in (*whole, "direction"), view.data.sizes[d])
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
    """Figures over a list of designs, along each parameter that has a family."""
    data = study.view.data
    parameters = [key for key in parameters_of(data) if not is_words(study.view.array(key))]
    many = data.sizes["design"] > MOST_ROWS and bool(parameters)
    if len(axes) > 1 and many and not study.base:
        for name in group:
            for view in study.view.slices([name], ["design"]):
                yield f"{name}_cases{view.suffix}", scatter(view, [name], parameters)
        return
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
        figure = scatter(study.view, group, parameters) if many else case_chart(study.view, group)
        yield f"{stem}_cases", figure
