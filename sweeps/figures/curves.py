"""Curves over the crank angle: one line for each value of an axis, and the thesis's figures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from engine_dyn import status as outcome
from engine_dyn.types import Floats
from sweeps.figures.sheet import (
    DASHES,
    OWN_ORDINATES,
    WIDTH,
    Entries,
    Plates,
    bare_panels,
    comparable,
    crank_axis,
    finish,
    grid_of,
    left_labels,
    line_style,
    log_ticks,
    lost_handle,
    lowest_panels,
    mark_lost,
    new_sheet,
    no_ordinate,
    x_label,
    y_label,
)
from sweeps.figures.views import (
    FROM_SPEED,
    MOST_LINES,
    MOST_PANELS,
    NO_VALUE,
    RUNNING,
    Study,
    StudyAxis,
    View,
    facet_of,
    key_text,
    pick,
    picked_text,
    stem_of,
)
from sweeps.figures.wording import axis_label, symbol_of, title_of, unit_in_brackets

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


KINEMATICS = ("position", "velocity", "acceleration")
COMPONENTS = ("gas_torque", "inertia_torque", "friction_torque")
LOAD_LAW = ("load_exponent", "load_offset")
# Colour, dashes and width of each torque, in all figures; lightness differs as well as hue.
TORQUES: dict[str, tuple[str, Any, float]] = {
    "torque": ("#000000", "-", 1.6),
    "gas_torque": ("#d1541b", (0, (6, 1.5)), 1.2),
    "inertia_torque": ("#1b4f9c", (0, (4, 1.2, 1, 1.2)), 1.2),
    "friction_torque": ("#c79a1e", (0, (1.2, 1)), 1.4),
    "load_torque": ("#2f7d55", (0, (3, 1, 1, 1, 1, 1)), 1.6),
}
PADDED = {"cylinder", "main_bearing"}
"""Dimensions that are as long as the longest engine needs."""

DEVIATION = "Deviation from the mean over the cycle (%)"


def _cycle(view: View) -> tuple[float, float]:
    """First and last angle of the cycle; the last is the first again."""
    degrees = np.asarray(view.array("crank_angle").values, dtype=float)
    step = degrees[1] - degrees[0] if degrees.size > 1 else 0.0
    return float(degrees[0]), float(degrees[-1] + step)


def _trace(
    view: View, name: str, index: Mapping[str, int], running: str
) -> tuple[Floats, Floats, str]:
    """One curve: abscissa, ordinate, and the outcome if there is no curve.

    Over the crank angle it is closed by its first point, unless the design is a number of passes
    from a starting angle: there the gap between end and start stays open.
    """
    array = view.array(name)
    array = array.isel({dim: i for dim, i in index.items() if dim in array.dims})
    x = np.asarray(view.data.variables.get(running, np.arange(array.size)), dtype=float)
    y = np.asarray(array.values, dtype=float)
    if not np.isfinite(y).any():
        said = view.outcomes(name, array, index)
        return x, y, str(said[0]) if y.size else NO_VALUE
    if running != "crank_angle" or x.size < 3:
        return x, y, ""
    period = round((x[-1] - x[0]) + (x[1] - x[0]), 6)
    if period % 360 == 0:
        x, y = np.append(x, x[0] + period), np.append(y, y[0])
        start = _start_angle(view, index) if name.startswith(FROM_SPEED) else None
        if start is not None:
            place = int(np.searchsorted(x, (start - x[0]) % period + x[0]))
            if 0 < place < x.size - 1:
                x, y = np.insert(x, place, x[place]), np.insert(y, place, np.nan)
    return x, y, ""


def _start_angle(view: View, index: Mapping[str, int]) -> float | None:
    """Where a curve that was not run to a closed cycle begins."""
    found = []
    for name in ("status", "start_angle"):
        if name not in view.data.variables:
            return None
        array = view.array(name)
        array = array.isel({dim: i for dim, i in index.items() if dim in array.dims})
        if array.ndim or not np.isfinite(float(array.values)):
            return None
        found.append(float(array.values))
    return found[1] if found[0] == outcome.PASSES_DONE else None


def running_of(view: View, name: str) -> str:
    """Return the dimension that a variable's curves run along."""
    dims = view.array(name).dims
    return next(dim for dim in RUNNING if dim in dims)


def draw_curves(
    axes: Axes,
    view: View,
    name: str,
    axis: StudyAxis | None,
    fixed: Mapping[str, int],
    entries: Entries,
    change: Callable[[Floats], Floats] | None = None,
) -> list[Floats]:
    """Lines of one variable, one per (picked) value of an axis; the ordinates are returned."""
    running = running_of(view, name)
    picked = pick(axis.size, MOST_LINES, axis.nominal) if axis else [0]
    drawn = []
    cell = axes.get_subplotspec()
    width = WIDTH / (cell.get_gridspec().ncols if cell else 1)
    for rank, index in enumerate(picked):
        place = {**fixed, axis.name: index} if axis else fixed
        x, y, lost = _trace(view, name, place, running)
        text = axis.text(index) if axis else title_of(view.array(name), name)
        nominal = axis is not None and index == axis.nominal
        if nominal:
            text += " (nominal)"
        style = line_style(rank, len(picked), nominal)
        if lost:
            padded = lost == NO_VALUE and PADDED & set(view.array(name).dims)
            if not padded:  # to the longest engine
                mark_lost(axes, lost, style["color"], rank)
                entries.setdefault(f"{text}: {lost}", lost_handle(lost, style["color"]))
            continue
        if len(picked) == 1 and running == "crank_angle":
            style["marker"] = ""
        if x.size > 40:
            step = max(x.size // (8 if width > 3 else 4), 1)
            style["markevery"] = (rank * step // len(picked) + step // 16, step)
        (line,) = axes.plot(x, change(y) if change else y, **style)
        entries.setdefault(text, line)
        drawn.append(y)
    if not drawn:
        no_ordinate(axes)
    if running == "crank_angle":
        axes.set_xlim(*_cycle(view))
    return drawn


def curve_figure(view: View, name: str, along: str | None) -> Figure:
    """One variable over the crank angle (or order): a line per value of one axis, and facets."""
    facet = facet_of(view, [name], [along]) if along else None
    view = view.only([name], [along, facet])
    axis = view.axis(along) if along else None
    running = running_of(view, name)
    entries: Entries = {}
    notes = [*view.notes([name]), picked_text(axis)]
    label = axis_label(view.array(name), name)
    if facet:
        across = view.axis(facet)
        picked = pick(across.size, MOST_PANELS, across.nominal)
        rows, columns = grid_of(len(picked))
        room, height = 6.3 / columns, 1.4
        traces = [
            [
                _trace(view, name, {facet: i, along or "": j}, running)[1]
                for j in pick(axis.size if axis else 1, MOST_LINES)
            ]
            for i in picked
        ]
        change = None
        if any(_far_apart(lines) for lines in traces):
            change, label = _deviation, DEVIATION
            traces = [[_deviation(line) for line in lines] for lines in traces]
        share = comparable(traces)
        figure, panels = new_sheet(rows, columns, 0.5 + 1.75 * rows, sharex=True, sharey=share)
        for panel, index in zip(panels, picked, strict=False):
            draw_curves(panel, view, name, axis, {facet: index}, entries, change)
            panel.set_title(across.tag(index))
        notes.append("" if share else OWN_ORDINATES)
        notes.append(picked_text(across, MOST_PANELS))
        bare_panels(panels, len(picked), columns)
        lowest = lowest_panels(panels, len(picked), columns)
    else:
        figure, panels = new_sheet(1, 1, 3.3)
        room, height = 5.0, 2.8
        drawn = draw_curves(panels[0], view, name, axis, {}, entries)
        if _far_apart(drawn):
            figure, panels = new_sheet(2, 1, 4.9, sharex=True)
            height, entries = 2.2, {}
            draw_curves(panels[0], view, name, axis, {}, entries)
            draw_curves(panels[1], view, name, axis, {}, {}, _deviation)
            y_label(panels[1], DEVIATION, height)
        lowest = list(panels[-1:])
    for panel in lowest:
        _running_axis(panel, view, running, room)
    for panel in panels[: len(picked) if facet else None]:
        if panel not in lowest and running == "crank_angle":
            crank_axis(panel, view.array(running), room, named=False)
    if facet:
        left_labels(panels, columns, label, height)
    else:
        y_label(panels[0], label, height)
    title = title_of(view.array(name), name)
    return finish(
        figure,
        f"{title} by {key_text(axis)}" if axis else title,
        notes,
        entries if axis else None,
        axis.label if axis else "",
        view.caption,
        below=bool(facet),
        spare=panels[len(picked) :] if facet else (),
    )


def _running_axis(axes: Axes, view: View, running: str, room: float) -> None:
    if running == "crank_angle" and running in view.data.variables:
        crank_axis(axes, view.array(running), room)
    else:
        variable = view.data.variables.get(running, xr.Variable((), 0.0))
        x_label(axes, axis_label(variable, running), room)


def _far_apart(curves: Sequence[Floats]) -> bool:
    """Whether lines lie so far apart that their own swings can hardly be seen."""
    curves = [curve[np.isfinite(curve)] for curve in curves]
    curves = [curve for curve in curves if curve.size]
    if len(curves) < 2 or not all(curve.min() > 0 for curve in curves):
        return False
    means = [float(curve.mean()) for curve in curves]
    swings = [float(np.ptp(curve)) for curve in curves]
    return max(means) - min(means) > 1.5 * max(swings) > 0


def _deviation(values: Floats) -> Floats:
    known = np.isfinite(values)
    known[-1] = False  # the first value again
    mean = values[known].mean() if known.any() else np.nan
    return np.asarray(100 * (values / mean - 1))


def over_angle(view: View, name: str) -> bool:
    """Whether there is a variable of this name over the crank angle."""
    return view.has(name) and "crank_angle" in view.array(name).dims


def _set_cycle(panels: Iterable[Axes], view: View, room: float, lowest: Sequence[Axes]) -> None:
    """The whole cycle on each panel, named below the lowest ones."""
    for panel in panels:
        panel.set_xlim(*_cycle(view))
        crank_axis(panel, view.array("crank_angle"), room, named=panel in lowest)


def _stacked(
    study: Study,
    names: Sequence[str],
    base: str,
    title: str,
    panels_of: Sequence[str],
    adjust: Callable[[Sequence[Axes], View], None],
) -> Plates:
    """Panels above each other with one crank angle, and a line for each value of an axis."""
    found = study.along(names)
    for whole, along in found:
        view = whole.only(names, [along])
        axis = view.axis(along) if along else None
        figure, panels = new_sheet(len(panels_of), 1, 0.5 + 1.6 * len(panels_of), sharex=True)
        entries: Entries = {}
        for panel, name in zip(panels, panels_of, strict=True):
            draw_curves(panel, view, name, axis, {}, entries)
            y_label(panel, axis_label(view.array(name), name), 1.6)
        _set_cycle(panels, view, 5.0, panels[-1:])
        adjust(panels, view)
        heading = f"{title} by {key_text(axis)}" if axis else title
        notes = [*view.notes(names), picked_text(axis)]
        legend = axis.label if axis else ""
        yield (
            stem_of(base, view, along, len(found) == 1),
            finish(figure, heading, notes, entries if axis else {}, legend, view.caption),
        )


def kinematics(study: Study) -> Plates:
    """Reduced position, velocity and acceleration over one turn."""
    names = [name for name in KINEMATICS if over_angle(study.view, name)]

    def one_turn(panels: Sequence[Axes], view: View) -> None:
        low, high = panels[-1].get_xlim()
        if high - low > 360:  # the second turn repeats the first
            panels[-1].set_xlim(0, 360)
            for panel in panels:
                crank_axis(panel, view.array("crank_angle"), 5.0, named=panel is panels[-1])

    if names:
        title = "Motion of the slider-crank"
        yield from _stacked(study, names, "kinematics", title, names, one_turn)


def indicator_diagrams(study: Study) -> Plates:
    """Pressure over the crank angle, with a linear and a logarithmic ordinate."""

    def logarithmic(panels: Sequence[Axes], view: View) -> None:
        values = view.array("pressure").values
        known = values[np.isfinite(values)]
        if known.size and known.min() > 0:
            panels[1].set_yscale("log")
            low, high = panels[1].get_ylim()
            log_ticks(panels[1].yaxis, low, high)

    if over_angle(study.view, "pressure"):
        panels = ["pressure", "pressure"]
        title = "Indicator diagrams"
        yield from _stacked(study, ["pressure"], "indicator_diagrams", title, panels, logarithmic)


def _torque_lines(
    panel: Axes, view: View, names: Sequence[str], index: Mapping[str, int], entries: Entries
) -> None:
    """Torques in their own colours; friction is drawn as it acts, against the rotation."""
    for name in names:
        variable = view.array(name)
        colour, dashes, width = TORQUES[name]
        sign = -1.0 if name == "friction_torque" else 1.0
        label = ("\N{MINUS SIGN}" if sign < 0 else "") + title_of(variable, name)
        style: dict[str, Any] = {"color": colour, "linestyle": dashes, "linewidth": width}
        if "crank_angle" in variable.dims:
            x, y, lost = _trace(view, name, index, "crank_angle")
        else:
            array = variable.isel({d: i for d, i in index.items() if d in variable.dims})
            x = np.asarray(view.array("crank_angle").values[[0, -1]], dtype=float)
            y = np.full(2, float(array.values))
            lost = "" if np.isfinite(y[0]) else str(view.outcomes(name, array, index))
        if lost:
            mark_lost(panel, lost, colour)
            entries.setdefault(f"{label}: {lost}", lost_handle(lost, colour))
        else:
            (line,) = panel.plot(x, sign * y, **style)
            entries.setdefault(label, line)


def torque_components(study: Study) -> Plates:
    """Gas, inertia and friction torque with their sum: nominal, and along each axis."""
    if not any(over_angle(study.view, name) for name in COMPONENTS):
        return
    sums = [name for name in (*COMPONENTS, "torque") if study.view.has(name)]
    load = [name for name in ("load_torque",) if over_angle(study.view, name)]
    title = "Components of the torque"
    view = study.view.only(sums, ())
    figure, panels = new_sheet(1, 1, 3.3)
    entries: Entries = {}
    _torque_lines(panels[0], view, sums, {}, entries)
    _set_cycle(panels, view, 4.6, panels)
    y_label(panels[0], "Torque" + unit_in_brackets(view.array(sums[0])), 2.8)
    notes = view.notes(sums)
    yield "torque_components", finish(figure, title, notes, entries, caption=view.caption)
    for whole, along in study.along([*sums, *load]):
        if along is None:
            continue
        if whole.varies(sums, along):
            yield _components_along(whole, [*sums, *load], along, title)
        elif load and along in LOAD_LAW:
            yield _load_law(whole, sums, along, title)


def _components_along(
    whole: View, names: Sequence[str], along: str, title: str
) -> tuple[str, Figure]:
    """Small multiples: one panel of components for each value of an axis."""
    view = whole.only(names, [along])
    axis = view.axis(along)
    picked = pick(axis.size, 6, axis.nominal)
    rows, columns = grid_of(len(picked))
    traced = [name for name in names if over_angle(view, name)]
    share = comparable(
        [[_trace(view, name, {along: i}, "crank_angle")[1] for name in traced] for i in picked]
    )
    figure, panels = new_sheet(rows, columns, 0.5 + 1.75 * rows, sharex=True, sharey=share)
    entries: Entries = {}
    for panel, index in zip(panels, picked, strict=False):
        _torque_lines(panel, view, names, {along: index}, entries)
        panel.set_title(axis.tag(index) + (" (nominal)" if index == axis.nominal else ""))
    bare_panels(panels, len(picked), columns)
    lowest = lowest_panels(panels, len(picked), columns)
    _set_cycle(panels[: len(picked)], view, 6.3 / columns, lowest)
    left_labels(panels, columns, "Torque" + unit_in_brackets(view.array(names[0])), 1.5)
    notes = [*view.notes(names), picked_text(axis, 6)]
    if not share:
        notes.append(OWN_ORDINATES)
    stem = stem_of("torque_components", view, along)
    title = f"{title} by {key_text(axis)}"
    spare = panels[len(picked) :]
    return stem, finish(
        figure, title, notes, entries, caption=view.caption, below=True, spare=spare
    )


def _load_law(whole: View, sums: Sequence[str], along: str, title: str) -> tuple[str, Figure]:
    """Where only the load torque changes: components once, load torque for each value."""
    view = whole.only([*sums, "load_torque"], [along])
    axis = view.axis(along)
    figure, panels = new_sheet(2, 1, 4.9, sharex=True)
    entries: Entries = {}
    _torque_lines(panels[0], view, sums, {along: axis.nominal or 0}, entries)
    lines: Entries = {}
    draw_curves(panels[1], view, "load_torque", axis, {}, lines)
    _set_cycle(panels, view, 4.6, panels[-1:])
    y_label(panels[0], "Torque" + unit_in_brackets(view.array(sums[0])), 2.0)
    y_label(panels[1], axis_label(view.array("load_torque"), "load_torque"), 2.0)
    panels[0].set_title(f"the same for every {key_text(axis)}")
    for text, line in lines.items():
        sign = "" if axis.words else f"{symbol_of(axis.variable) or key_text(axis)} = "
        entries[f"Load torque, {sign}{text}"] = line
    notes = [*view.notes([*sums, "load_torque"]), picked_text(axis)]
    stem = stem_of("torque_components", view, along)
    return stem, finish(
        figure, f"{title} by {key_text(axis)}", notes, entries, caption=view.caption
    )


def torque_and_speed(study: Study) -> Plates:
    """Total torque, load torque and, on the other side, the speed that comes of them."""
    names = ["torque", "load_torque", "omega"]
    if not all(over_angle(study.view, name) for name in ("torque", "omega")):
        return
    names = [name for name in names if over_angle(study.view, name)]
    view = study.view.only(names, ())
    figure, panels = new_sheet(1, 1, 3.3)
    left = panels[0]
    right = left.twinx()
    entries: Entries = {}
    torques = [name for name in names if name != "omega"]
    _torque_lines(left, view, torques, {}, entries)
    x, torque, _ = _trace(view, "torque", {}, "crank_angle")
    if "load_torque" in names:
        # the load may have a gap where the passes start: interpolated for the shading alone
        angle, load, lost = _trace(view, "load_torque", {}, "crank_angle")
        if not lost:
            known = np.isfinite(load)
            load = np.interp(x, angle[known], load[known])
            above = left.fill_between(
                x, torque, load, where=torque > load, interpolate=True, color="#d9d9d9", linewidth=0
            )
            below = left.fill_between(
                x,
                torque,
                load,
                where=torque < load,
                interpolate=True,
                facecolor="white",
                edgecolor="#bdbdbd",
                hatch="////",
                linewidth=0,
            )
            entries["Excess of work: speed rises"] = above
            entries["Lack of work: speed falls"] = below
    x, speed, lost = _trace(view, "omega", {}, "crank_angle")
    label = title_of(view.array("omega"), "omega") + " (right)"
    if lost:
        mark_lost(left, lost)
        entries[f"{label}: {lost}"] = lost_handle(lost)
        right.set_yticks([])
    else:
        (line,) = right.plot(x, speed, color="#7b2d8b", linestyle=(0, (3, 1)), linewidth=1.6)
        entries[label] = line
        right.margins(y=0.15)
    right.grid(False)
    right.spines["right"].set_visible(True)
    _set_cycle(panels, view, 4.4, panels)
    y_label(left, "Torque" + unit_in_brackets(view.array("torque")), 2.8)
    y_label(right, axis_label(view.array("omega"), "omega"), 2.8)
    notes = view.notes(names)
    yield (
        "torque_and_speed",
        finish(
            figure,
            "Torque, load torque and speed",
            notes,
            entries,
            caption=view.caption,
            below=True,
        ),
    )


def cylinders(study: Study) -> Plates:
    """Engines of different numbers of cylinders: torque beside speed, a row for each."""
    names = [name for name in ("torque", "omega") if over_angle(study.view, name)]
    if len(names) < 2:
        return
    for whole, along in study.along(names):
        if along != "cylinders":
            continue
        view = whole.only(names, [along])
        axis = view.axis(along)
        picked = pick(axis.size, 6, axis.nominal)
        figure, panels = new_sheet(
            len(picked), 2, 0.8 + 1.15 * len(picked), sharex=True, sharey="col"
        )
        entries: Entries = {}
        for row, index in enumerate(picked):
            for panel, name in zip(panels[2 * row :], names, strict=False):
                x, y, lost = _trace(view, name, {along: index}, "crank_angle")
                panel.set_title(axis.tag(index) + (f": {lost}" if lost else ""))
                if lost:
                    mark_lost(panel, lost)
                    continue
                panel.plot(x, y, color="black", linewidth=1.1)
                mean = float(np.nanmean(y[:-1]))
                line = panel.axhline(mean, color="#c05a1c", linewidth=0.9, linestyle=DASHES[1])
                entries["Mean over the cycle"] = line
        _set_cycle(panels, view, 3.0, panels[-2:])
        for panel, name in zip(panels[:2], names, strict=True):
            text = axis_label(view.array(name), name)
            panel.set_title(f"{text}\n{panel.get_title(loc='left')}", linespacing=1.5)
        notes = [*view.notes(names), picked_text(axis, 6)]
        title = "Torque and speed for different numbers of cylinders"
        yield (
            stem_of("cylinders", view, None),
            finish(figure, title, notes, entries, caption=view.caption, below=True),
        )
