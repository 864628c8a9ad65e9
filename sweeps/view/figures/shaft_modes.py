"""Modes of a shaft that twists: their shapes along the shaft, and where orders meet them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.view.figures.marks import DASHES, line_style, shade
from sweeps.view.figures.scales import parameter_ticks
from sweeps.view.figures.sheet import Entries, NamedFigures, finish, new_sheet, rc, x_label, y_label
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import View, stem_of
from sweeps.view.figures.wording import typeset, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MODE, SHAFT, DISC, ORDER, SPEED = "mode", "shaft", "disc", "order", "speed"
SHAPE, CRITICAL = "mode_shape", "critical_speed"

PALE = "#bbbbbb"
"""Colour of the lines of orders that are not strong."""

HERTZ = {"rpm": 1.0 / 60.0, "rad s-1": 0.5 / np.pi, "rad/s": 0.5 / np.pi}
"""Frequency of order 1 over the speed, by the unit of the speed."""

LARGEST = 130.0  # Area in square points of the mark of the largest vector sum

LABELLED = 0.1  # Share of the largest vector sum from which the speed of a crossing is written

WIDE, TALL = 4.7, 3.4
"""Width and height of the panel of a Campbell diagram in inches, without its labels."""


def part_of(view: View, name: str) -> str | None:
    """The dimension of a variable that counts shafts or discs; None where one was selected."""
    return next((part for part in (SHAFT, DISC) if part in view.array(name).dims), None)


def largest_along(
    view: View, name: str, dim: str, place: Mapping[str, int] | None = None
) -> Floats:
    """Largest size of a variable for each place along a dimension; 0 where there is no number."""
    array = view.at(name, place or {}).transpose(dim, ...)
    sizes = np.abs(np.asarray(array.values, dtype=float)).reshape(array.shape[0], -1)
    return np.asarray(np.nanmax(sizes, axis=1, initial=0.0))


def at_largest(view: View, name: str) -> View:
    """The slice of that shaft or disc in which a variable is the largest."""
    part = part_of(view, name)
    if part is None:
        return view
    place = int(np.argmax(largest_along(view, name, part)))
    said = f"{view.axis(part).tag(place)}, where the {part_text(name)} is the largest"
    sliced = view.slice_at({part: place})
    return replace(sliced, fixed={**sliced.fixed, part: said})


def part_text(name: str) -> str:
    """The second word of a variable's name, such as torque or stress."""
    return name.split("_")[1]


def mode_shape_names(view: View) -> list[str]:
    """Mode shapes and nodes."""
    if not (view.has(SHAPE) and {MODE, DISC} <= set(view.array(SHAPE).dims)):
        return []
    return [name for name in (SHAPE, "mode_node") if view.has(name)]


def mode_shapes(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the shapes of the first modes along the shaft.

    A line joins only neighbours on the abscissa that a shaft joins. Rings of dampers and branches
    stand by themselves at their own place in the list of discs: beside the disc that they belong to
    there is no room for a second name.
    """
    view = study.view.only([SHAPE, *_known(study.view, "natural_frequency")], [MODE, DISC])
    figure, (panel,) = new_sheet(1, 1, 3.3)
    entries: Entries = {}
    shapes = view.array(SHAPE).transpose(MODE, DISC).values.astype(float)
    finite = [number for number, shape in enumerate(shapes) if np.isfinite(shape).all()]
    shown = finite[:3]  # Strong orders seldom reach higher modes
    joined = joined_neighbours(view, shapes.shape[1])
    for rank, number in enumerate(shown):
        shape = shapes[number] / np.abs(shapes[number]).max()
        style = line_style(rank, len(shown))
        broken = np.flatnonzero(~joined) + 1
        drawn = (np.insert(one, broken, np.nan) for one in (np.arange(1.0 * shape.size), shape))
        (line,) = panel.plot(*drawn, **style)
        entries[mode_text(view, number)] = line
        nodes = zero_crossings(shape, joined)
        (marks,) = panel.plot(
            nodes, np.zeros(nodes.size), color=style["color"], linestyle="none", marker="o",
            markersize=8.0, markerfacecolor="none",
        )  # fmt: skip
        if nodes.size:
            entries["node"] = entries.pop("node", marks)  # The mark of nodes is last in the legend
    panel.axhline(0.0, color=rc("text.color"), linewidth=0.6)
    parameter_ticks(panel, view.axis(DISC), "x", 5.0)
    y_label(panel, f"Amplitude over the largest of the mode{view.unit(SHAPE)}", 2.8)
    few = f"{len(shown)} of {len(finite)} modes shown" if len(shown) < len(finite) else ""
    title, notes = "Mode shapes of the shaft", [*view.notes([SHAPE]), few]
    done = finish(figure, title, notes, entries, caption=view.caption)
    yield stem_of("mode_shapes", view, None), done


def _known(view: View, *names: str) -> list[str]:
    return [name for name in names if view.has(name)]


def joined_neighbours(view: View, discs: int) -> np.ndarray:
    """For each disc but the last: whether a shaft joins it with the next one of the list."""
    told = json.loads(view.data.attrs.get("shaft") or "{}")
    pairs = {tuple(sorted(pair)) for pair in told.get("shafts", ())}
    return np.array([not told or (one, one + 1) in pairs for one in range(1, discs)], dtype=bool)


def zero_crossings(shape: Floats, joined: np.ndarray) -> Floats:
    """Where a shape does not move: places between joined neighbours of different signs."""
    first, second = shape[:-1], shape[1:]
    at = np.flatnonzero(joined & (first * second < 0.0))
    return np.asarray(at + first[at] / (first[at] - second[at]))


def mode_text(view: View, number: int, name: str = "natural_frequency") -> str:
    """A mode with its frequency, where the archive has it."""
    text = f"mode {typeset(view.numbers(MODE)[number])}"
    if not view.has(name) or view.array(name).dims != (MODE,):
        return text
    array = view.array(name)
    return f"{text}: {with_unit(array, float(array.values[number]))}"


def drawn_frequency(view: View) -> str:
    """Frequencies over which the Campbell diagram is: damped ones where the archive has them."""
    damped = "damped_natural_frequency"
    return damped if view.has(damped) else "natural_frequency"


def campbell_names(view: View) -> list[str]:
    """Natural frequencies, critical speeds and vector sums, where speed is an axis.

    Frequencies that follow an axis of the study are left to other figures too.
    """
    data, name = view.data, drawn_frequency(view)
    if not (view.has(name) and ORDER in data.coords and data.sizes.get(SPEED, 1) > 1):
        return []
    known = data.variables[SPEED].attrs.get("units") in HERTZ if SPEED in data.coords else False
    if not known or view.array(name).attrs.get("units") != "Hz":
        return []
    alone = set(view.array(name).dims) <= {MODE, SPEED}
    return _known(
        view, *([name] if alone else []), CRITICAL, "damped_critical_speed", "mode_vector_sum"
    )


def campbell(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw natural frequencies and orders over the speed, with their crossings.

    Vector sums are those of undamped shapes, and are left out beside damped modes.
    """
    drawn_name = drawn_frequency(study.view)
    damped = drawn_name == "damped_natural_frequency"
    used = _known(study.view, drawn_name, *([] if damped else ["mode_vector_sum"]))
    view = study.view.only(used, [MODE, SPEED])
    speed, orders = view.axis(SPEED), view.numbers(ORDER)
    slopes = orders * HERTZ[str(speed.variable.attrs["units"])]
    modes = view.array(drawn_name).transpose(..., MODE).values.astype(float)
    levels = np.broadcast_to(np.atleast_2d(modes), (speed.size, modes.shape[-1])).T
    if not np.isfinite(levels).any():
        return
    sums = None
    if "mode_vector_sum" in used:
        sums = view.array("mode_vector_sum").transpose(..., MODE, ORDER).values
    crossed = crossings(speed.values, levels, slopes)
    low, high = float(speed.values.min()), float(speed.values.max())
    met = [levels[mode].max() for mode, _, _ in crossed]
    top = 1.15 * max(met) if met else 1.15 * min(np.nanmin(levels), slopes.max() * high)
    sizes = [
        1.0 if sums is None else sum_at(sums[..., mode, order], speed.values, at)
        for mode, order, at in crossed
    ]
    largest = max(sizes, default=1.0) or 1.0
    strength = np.zeros(orders.size)
    for (_, order, _), size in zip(crossed, sizes, strict=True):
        strength[order] = max(strength[order], size / largest)

    figure, (panel,) = new_sheet(1, 1, 4.0)
    entries: Entries = {}
    for order, slope in enumerate(slopes):
        strong = bool(strength[order] >= LABELLED)
        look: dict[str, Any] = {"color": rc("text.color"), "linewidth": 0.9, "alpha": 0.75}
        look |= {} if strong else {"linewidth": 0.5, "alpha": 0.3}
        panel.plot([low, high], [slope * low, slope * high], zorder=1.5, **look)
    for mode, level in enumerate(levels):
        if np.nanmin(level, initial=np.inf) < top:
            style = {"color": shade(0.3 * mode), "linestyle": DASHES[mode % len(DASHES)]}
            (line,) = panel.plot(speed.values, level, linewidth=1.6, **style)
            entries[mode_text(view, mode, drawn_name)] = line
    panel.set_xlim(low, high)
    panel.set_ylim(0.0, top)
    _label_rays(panel, orders, slopes, strength)
    _mark_crossings(panel, crossed, levels, speed.values, np.asarray(sizes) / largest)
    x_label(panel, speed.label, 5.0)
    y_label(panel, f"Frequency{view.unit(drawn_name)}", 3.4)
    which = "of damped modes" if damped else "without damping"
    notes = [*view.notes(used), f"natural frequencies {which}", "rays are orders"]
    if crossed and sums is None and not damped:
        alike = "all crossings look alike: for their strength add mode_vector_sum to "
        notes.append(f"{alike}[output] quantities")
    if crossed:
        area = f", area by the vector sum: here {typeset(largest, 3)}"
        entries["crossing" + area * ("mode_vector_sum" in used)] = panel.scatter(
            [], [], s=LARGEST, **_mark()
        )
    drawn = finish(figure, "Campbell diagram of the shaft", notes, entries, caption=view.caption)
    yield stem_of("campbell", view, None), drawn


def sum_at(sums: Floats, speeds: Floats, at: float) -> float:
    """A vector sum at a speed: one number, or one at each of some speeds, straight between them."""
    if not sums.ndim:
        return float(sums)
    order = np.argsort(speeds)
    return float(np.interp(at, speeds[order], sums[order]))


def crossings(speeds: Floats, levels: Floats, slopes: Floats) -> list[tuple[int, int, float]]:
    """Where orders meet modes: mode, order and speed, straight between the speeds of the axis."""
    met = []
    for mode, level in enumerate(levels):
        for order, slope in enumerate(slopes):
            gap = slope * speeds - level
            rises = (gap[:-1] <= 0.0) & (gap[1:] >= 0.0) & (np.diff(gap) > 0.0)
            for one in np.flatnonzero(rises)[:1]:
                ends = slice(one, one + 2)
                met.append((mode, order, float(np.interp(0.0, gap[ends], speeds[ends]))))
    return met


def free_places(places: Floats, by: Floats, gap: float) -> list[int]:
    """Places on a line that get a label: the largest first, each `gap` from all others."""
    kept: list[int] = []
    for one in np.argsort(-by, kind="stable"):
        if all(abs(places[one] - places[other]) >= gap for other in kept):
            kept.append(int(one))
    return sorted(kept)


def _label_rays(panel: Axes, orders: Floats, slopes: Floats, strength: Floats) -> None:
    """Write the number of each order where its ray leaves the panel, if there is room."""
    (low, high), (_, top) = panel.get_xlim(), panel.get_ylim()
    right = np.flatnonzero(slopes * high <= top)
    above = np.flatnonzero((slopes * high > top) & (slopes * low < top))
    for rays, places, room, at_right in (
        (right, slopes[right] * high / top, 0.13 / TALL, True),
        (above, (top / slopes[above] - low) / (high - low), 0.26 / WIDE, False),
    ):
        for one in free_places(places, strength[rays] + 1e-6 * (orders[rays] % 1 == 0), room):
            at = (1.008, float(places[one])) if at_right else (float(places[one]), 1.01)
            panel.text(
                *at, typeset(orders[rays[one]]), fontsize=6.5, alpha=0.75,
                transform=panel.transAxes, va="center" if at_right else "bottom",
                ha="left" if at_right else "center",
            )  # fmt: skip


def _mark() -> dict[str, Any]:
    colours = {"facecolor": rc("axes.facecolor"), "edgecolor": rc("text.color")}
    return {**colours, "linewidth": 0.9, "zorder": 3}


def _mark_crossings(
    panel: Axes, crossed: Sequence[tuple[int, int, float]], levels: Floats, speeds: Floats,
    shares: Floats,
) -> None:  # fmt: skip
    """Draw marks as large as the vector sums, with the speeds of strong orders that have room."""
    low, high = panel.get_xlim()
    for mode in sorted({mode for mode, _, _ in crossed}):
        own = [number for number, one in enumerate(crossed) if one[0] == mode]
        met = np.array([crossed[number][2] for number in own])
        y = np.interp(met, speeds, levels[mode])
        panel.scatter(met, y, s=np.maximum(LARGEST * shares[own], 4.0), clip_on=False, **_mark())
        places = (met - low) / (high - low)
        for one in free_places(places, shares[own], 0.36 / WIDE):
            side = "left" if places[one] < 0.04 else "right" if places[one] > 0.96 else "center"
            if shares[own][one] >= LABELLED:
                panel.annotate(
                    typeset(round(met[one])), (met[one], y[one]), (0, 8), fontsize=7.0,
                    textcoords="offset points", ha=side, va="bottom", zorder=4,
                    bbox={**_mark(), "edgecolor": "none", "pad": 0.5, "alpha": 0.8},
                )  # fmt: skip
