"""Forces of the mechanism together, orders as stems, loads of bearings as polar diagrams."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.figures.curves import _set_cycle, _trace, over_angle
from sweeps.figures.sheet import (
    OWN_ORDINATES,
    WIDTH,
    Entries,
    Plates,
    bare_panels,
    comparable,
    degree_ticks,
    finish,
    grid_of,
    left_labels,
    line_style,
    lost_handle,
    lowest_panels,
    mark_lost,
    new_sheet,
    x_label,
    y_label,
)
from sweeps.figures.views import (
    MOST_LINES,
    MOST_PANELS,
    Study,
    StudyAxis,
    View,
    facet_of,
    key_text,
    pick,
    picked_text,
    stem_of,
)
from sweeps.figures.wording import axis_label, name_of, number_text, title_of, unit_in_brackets

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["TOGETHER", "drawn_together", "order_figure", "polar_diagrams", "polar_names"]

TOGETHER: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "piston_forces": (
        "Forces on the piston", "Force", ("gas_force", "inertia_force", "piston_force")
    ),
    "mechanism_forces": (
        "Forces of the mechanism", "Force",
        ("wall_thrust", "rod_force", "tangential_force", "radial_force"),
    ),
    "mechanism_pressures": (
        "Forces of the mechanism over the area of the piston", "Reduced force",
        ("piston_pressure", "wall_pressure", "rod_pressure", "tangential_pressure",
         "radial_pressure"),
    ),
    "shortened_acceleration": (
        "Acceleration, exact and by the shortened series,", "Reduced acceleration",
        ("acceleration", "acceleration_truncated"),
    ),
}  # fmt: skip
"""What is drawn in one panel: file, title, ordinate and variables."""

POLAR = {
    ("tangential", "radial"): "in axes that turn with the crank",
    ("x", "y"): "in axes of the engine",
    ("side", "down"): "in axes of the engine",
}
"""Endings of two variables that are the components of one load: to the right, and up."""

NOTHING = 1e-9
"""Of the largest order of a figure; nothing is drawn for what is less."""

MARKED = 30.0
"""Degrees between the marks of a polar diagram; the dead centres are written beside it."""


def drawn_together(study: Study) -> tuple[set[str], Plates]:
    """Variables that stand in figures of several, and these figures."""
    groups = []
    for stem, (title, ordinate, members) in TOGETHER.items():
        names = [name for name in members if over_angle(study.view, name)]
        if len(names) > 1:
            groups.append((stem, title, ordinate, names))
    plates = (plate for group in groups for plate in _several(study, *group))
    return {name for *_, names in groups for name in names}, plates


def _several(study: Study, stem: str, title: str, ordinate: str, names: Sequence[str]) -> Plates:
    """Several variables in one panel, and in small multiples along each axis."""
    for whole, along in study.along(names):
        if along is not None and not whole.varies(names, along):
            continue
        view = whole.only(names, [along])
        axis = view.axis(along) if along else None
        picked = pick(axis.size, 6, axis.nominal) if axis else [0]
        rows, columns = grid_of(len(picked))
        places = [{along: index} if along else {} for index in picked]
        share = comparable(
            [[_trace(view, n, place, "crank_angle")[1] for n in names] for place in places]
        )
        height = 0.5 + 1.75 * rows if axis else 3.3
        figure, panels = new_sheet(rows, columns, height, sharex=True, sharey=share)
        entries: Entries = {}
        for panel, place in zip(panels, places, strict=False):
            _lines(panel, view, names, place, entries)
            if axis:
                panel.set_title(axis.tag(place[axis.name]))
        bare_panels(panels, len(picked), columns)
        lowest = lowest_panels(panels, len(picked), columns)
        _set_cycle(panels[: len(picked)], view, (6.3 if axis else 4.6) / columns, lowest)
        label = ordinate + unit_in_brackets(view.array(names[0]))
        left_labels(panels, columns, label, 1.5 if axis else 2.8)
        notes = [*view.notes(names), picked_text(axis, 6), "" if share else OWN_ORDINATES]
        yield (
            stem_of(stem, view, along),
            finish(
                figure, f"{title} by {key_text(axis)}" if axis else title, notes, entries,
                caption=view.caption, below=axis is not None, spare=panels[len(picked) :],
            ),
        )  # fmt: skip


def _lines(
    panel: Axes, view: View, names: Sequence[str], place: Mapping[str, int], entries: Entries
) -> None:
    for rank, name in enumerate(names):
        x, y, lost = _trace(view, name, place, "crank_angle")
        style = line_style(rank, len(names)) | {"marker": ""}
        label = title_of(view.array(name), name)
        if lost:
            mark_lost(panel, lost, style["color"], rank)
            entries.setdefault(f"{label}: {lost}", lost_handle(lost, style["color"]))
        else:
            (line,) = panel.plot(x, y, **style)
            entries.setdefault(label, line)


# Orders -------------------------------------------------------------------------------------------


def order_figure(view: View, name: str, along: str | None) -> Figure:
    """Orders as stems, side by side for the values of one axis; facets for another."""
    from matplotlib.ticker import MaxNLocator

    facet = facet_of(view, [name], [along]) if along else None
    view = view.only([name], [along, facet])
    axis = view.axis(along) if along else None
    across = view.axis(facet) if facet else None
    shown = pick(across.size, MOST_PANELS, across.nominal) if across else [0]
    picked = pick(axis.size, MOST_LINES, axis.nominal) if axis else [0]
    rows, columns = grid_of(len(shown))
    values = [
        [_order_values(view, name, {**_at(across, i), **_at(axis, j)}) for j in picked]
        for i in shown
    ]
    share = comparable(values)
    height = 0.5 + 1.75 * rows if across else 3.3
    figure, panels = new_sheet(rows, columns, height, sharex=True, sharey=share)
    orders = np.asarray(view.data.variables["order"].values, dtype=float)
    angles = view.array(name).attrs.get("units") == "degree"
    least = NOTHING * max(float(np.nanmax(np.abs(y), initial=0.0)) for v in values for y in v)
    there = [np.abs(y) > least for v in values for y in v]
    drawn = orders[np.any(there, axis=0)]
    room = float(np.min(np.diff(drawn if drawn.size > 1 else orders), initial=1.0))
    entries: Entries = {}
    for panel, index, stems in zip(panels, shown, values, strict=False):
        any_drawn = False
        for rank, (value, y) in enumerate(zip(picked, stems, strict=True)):
            text = axis.text(value) if axis else title_of(view.array(name), name)
            style = line_style(rank, len(picked), axis is not None and value == axis.nominal)
            shift = room * 0.7 * ((rank + 0.5) / len(picked) - 0.5)
            known = np.isfinite(y)
            if angles:  # of what is not there, the phase is 0
                known &= _has_amplitude(view, name, {**_at(across, index), **_at(axis, value)})
            else:
                known &= np.abs(y) > least
                panel.vlines(
                    orders[known] + shift, 0.0, y[known], color=style["color"], linewidth=1.3
                )
            any_drawn |= bool(known.any())
            (points,) = panel.plot(
                orders[known] + shift, y[known], linestyle="none", color=style["color"],
                marker=style["marker"], markersize=3.5, markerfacecolor=style["markerfacecolor"],
            )  # fmt: skip
            if np.isfinite(y).any():
                entries.setdefault(text, points)
        if not any_drawn:
            panel.text(0.5, 0.6, "zero at every order", transform=panel.transAxes, ha="center")
        panel.axhline(0.0, color="black", linewidth=0.6)
        if angles:
            degree_ticks(panel, view.array(name))
        panel.set_xlim(orders[0] - 0.5, orders[-1] + 0.5)
        panel.xaxis.set_major_locator(MaxNLocator(integer=True))
        if across:
            panel.set_title(across.tag(index))
    bare_panels(panels, len(shown), columns)
    for panel in lowest_panels(panels, len(shown), columns):
        x_label(panel, axis_label(view.data.variables["order"], "order"), 6.3 / columns)
    label = axis_label(view.array(name), name)
    left_labels(panels, columns, label, 1.5 if across else 2.8)
    title = title_of(view.array(name), name)
    notes = [*view.notes([name]), picked_text(axis), picked_text(across, MOST_PANELS)]
    return finish(
        figure, f"{title} by {key_text(axis)}" if axis else title,
        [*notes, "" if share else OWN_ORDINATES], entries if axis else None,
        axis.label if axis else "", view.caption, below=across is not None,
        spare=panels[len(shown) :] if across else (),
    )  # fmt: skip


def _has_amplitude(view: View, name: str, place: Mapping[str, int]) -> Any:
    """Where a phase belongs to something: its amplitude, if the archive has it, is not 0."""
    other = name.removesuffix("_phase") + "_order"
    if other == name or not view.has(other):
        return True
    size = np.abs(_order_values(view, other, place))
    return size > NOTHING * np.nanmax(size, initial=0.0)


def _at(axis: StudyAxis | None, index: int) -> dict[str, int]:
    return {axis.name: index} if axis else {}


def _order_values(view: View, name: str, place: Mapping[str, int]) -> Floats:
    array = view.array(name)
    array = array.isel({dim: i for dim, i in place.items() if dim in array.dims})
    return np.asarray(array.values, dtype=float)


# Polar diagrams -----------------------------------------------------------------------------------


def polar_names(view: View) -> list[tuple[str, str, str]]:
    """Loads with both components over the crank angle: its name, to the right, and up."""
    found = []
    for name in map(str, view.data.data_vars):
        for right, up in POLAR:
            load = name.removesuffix(f"_{right}")
            other = f"{load}_{up}"
            if load != name and over_angle(view, name) and view.has(other):
                found.append((f"{load}_polar_{right}_{up}", name, other))
    return found


def polar_diagrams(study: Study) -> Plates:
    """One component of a load against the other over the cycle."""
    for stem, right, up in polar_names(study.view):
        names = [right, up]
        found = study.along(names)
        # a panel for each journal, whatever else there is
        beside = [pair for pair in found if pair[1] != "main_bearing"] or [(found[0][0], None)]
        for whole, along in beside:
            if along is not None and not whole.varies(names, along):
                continue
            yield stem_of(stem, whole, along), _polar_figure(whole, names, along)


def _polar_figure(view: View, names: Sequence[str], along: str | None) -> Figure:
    right, up = names
    facet = "main_bearing" if "main_bearing" in view.array(right).dims else None
    if facet is None and along is not None:
        facet = facet_of(view, names, [along])
    view = view.only(names, [along, facet])
    axis = view.axis(along) if along else None
    across = view.axis(facet) if facet else None
    shown = pick(across.size, MOST_PANELS, across.nominal) if across else [0]
    picked = pick(axis.size, MOST_LINES, axis.nominal) if axis else [0]
    rows, columns = grid_of(len(shown))
    (left, low), (width, height) = _frame(view, names)
    wide = min(6.1 / columns - 0.15, 3.0 if across else 4.6, 4.6 * width / height)
    tall = wide * height / width
    size = WIDTH if columns > 2 else wide * columns + 1.0
    share = {"sharex": True, "sharey": True}
    figure, panels = new_sheet(rows, columns, (tall + 0.25) * rows + 0.4, width=size, **share)
    entries: Entries = {}
    for panel, index in zip(panels, shown, strict=False):
        ends = (low, low + height)
        panel.set_xlim(left, left + width)
        panel.set_ylim(*(ends[::-1] if up.endswith("_down") else ends))
        for rank, value in enumerate(picked):
            place = {**_at(across, index), **_at(axis, value)}
            text = axis.text(value) if axis else ""
            style = line_style(rank, len(picked), axis is not None and value == axis.nominal)
            _loop(panel, view, names, place, style, text, entries, apart=0.06 * height)
        panel.axhline(0.0, color=GUIDE, linewidth=0.6, zorder=0.5)
        panel.axvline(0.0, color=GUIDE, linewidth=0.6, zorder=0.5)
        panel.set_aspect("equal", adjustable="box")
        panel.locator_params("x", nbins=max(2, int(1.6 * wide)))
        if across:
            panel.set_title(across.tag(index))
    bare_panels(panels, len(shown), columns)
    for panel in lowest_panels(panels, len(shown), columns):
        x_label(panel, axis_label(view.array(right), right), 6.3 / columns if across else wide)
    for panel in panels[::columns]:
        y_label(panel, axis_label(view.array(up), up), tall)
    axes_said = next(said for pair, said in POLAR.items() if right.endswith(f"_{pair[0]}"))
    title = f"Polar diagram of the {_common(view, names)}"
    notes = [
        *view.notes(names), picked_text(axis), picked_text(across, MOST_PANELS),
        axes_said, f"a mark every {MARKED:g}° of crank angle",
    ]  # fmt: skip
    return finish(
        figure, f"{title} by {key_text(axis)}" if axis else title, notes,
        entries if axis else None, axis.label if axis else "", view.caption,
        below=across is not None, spare=panels[len(shown) :] if across else (),
    )  # fmt: skip


def _frame(view: View, names: Sequence[str]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Lower left corner and size of a frame for all curves, zero included, of one scale."""
    ranges = []
    for name in names:
        values = np.asarray(view.array(name).values, dtype=float)
        known = values[np.isfinite(values)]
        ranges.append((min(known.min(initial=0.0), 0.0), max(known.max(initial=0.0), 0.0)))
    spans = [1.15 * (high - low) or 1.0 for low, high in ranges]
    size = (max(spans[0], 0.6 * spans[1]), max(spans[1], 0.6 * spans[0]))
    middles = [0.5 * (low + high) for low, high in ranges]
    return (middles[0] - 0.5 * size[0], middles[1] - 0.5 * size[1]), size


GUIDE = "#8a8a8a"


def _common(view: View, names: Sequence[str]) -> str:
    """What the names of two components have in common, at their beginning or end."""
    words = [name_of(view.array(name), name).split() for name in names]
    for turn in (1, -1):
        pairs = zip(words[0][::turn], words[1][::turn], strict=False)
        same = [one for one, _ in itertools.takewhile(lambda pair: pair[0] == pair[1], pairs)]
        if same:
            return " ".join(same[::turn])
    return " and ".join(names)


def _loop(
    panel: Axes, view: View, names: Sequence[str], place: Mapping[str, int],
    style: dict[str, Any], text: str, entries: Entries, *, apart: float,
) -> None:  # fmt: skip
    """One closed curve, with marks along it, and the dead centres by their angle."""
    from matplotlib.patheffects import withStroke

    angle, x, lost = _trace(view, names[0], place, "crank_angle")
    _, y, _ = _trace(view, names[1], place, "crank_angle")
    if lost:  # padded to the engine with most journals
        return
    (line,) = panel.plot(x, y, **(style | {"marker": ""}))
    marks = np.flatnonzero(np.isclose(angle[:-1] % MARKED, 0.0, atol=1e-6))
    panel.plot(
        x[marks], y[marks], linestyle="none", marker="o", markersize=2.2, color=style["color"]
    )
    if text:
        entries.setdefault(text, line)
    middle = (float(np.mean(x[:-1])), float(np.mean(y[:-1])))
    upward = -1.0 if panel.yaxis_inverted() else 1.0
    halo = [withStroke(linewidth=1.5, foreground="white")]
    written: list[tuple[float, float]] = []
    for mark in marks:
        here = (float(x[mark]), float(y[mark]))
        crowded = any(np.hypot(here[0] - u, here[1] - v) < apart for u, v in written)
        if crowded or text or not np.isclose(angle[mark] % 90.0, 0.0, atol=1e-6):
            continue
        written.append(here)
        # across the curve, away from its middle
        before, after = (mark - 1) % (x.size - 1), (mark + 1) % (x.size - 1)
        aside, above = float(y[after] - y[before]), float(x[before] - x[after])
        outward = aside * (here[0] - middle[0]) + above * (here[1] - middle[1])
        sign = 1.0 if outward > 0.0 else -1.0
        aside, above = sign * aside, sign * upward * above
        far = float(np.hypot(aside, above)) or 1.0
        panel.annotate(
            f"{number_text(angle[mark])}°", here, textcoords="offset points",
            xytext=(6.0 * aside / far, 6.0 * above / far),
            ha="left" if aside > 0.3 * far else "right" if aside < -0.3 * far else "center",
            va="bottom" if above > 0.3 * far else "top" if above < -0.3 * far else "center",
            fontsize=6.5, color=style["color"], path_effects=halo,
        )  # fmt: skip
