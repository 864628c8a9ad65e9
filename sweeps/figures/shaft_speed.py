"""Vibration of a shaft over the speed: its orders, and what its parts bear, lose and may bear."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.figures.lines import draw_points, line_figure, line_of
from sweeps.figures.marks import DASHES, line_style
from sweeps.figures.multiples import multiples
from sweeps.figures.scales import parameter_ticks
from sweeps.figures.shaft_modes import (
    CRITICAL,
    DISC,
    MODE,
    ORDER,
    PALE,
    SPEED,
    WIDE,
    free_places,
)
from sweeps.figures.sheet import OWN_ORDINATES, Entries, NamedFigures, rc
from sweeps.figures.study import Study
from sweeps.figures.targets import LOOK, target_lines
from sweeps.figures.views import MISFIRE, MOST_PANELS, View, stem_of
from sweeps.figures.wording import number_text, symbol_of, wrap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHAFT = "shaft"
PARTS = {"shaft_torque": SHAFT, "disc_angle": DISC}
"""What has orders, and the dimension of the parts that have it."""

BORNE = (
    "shaft_torque_half_range", "shaft_stress_half_range", "shaft_twist_half_range",
    "disc_angle_half_range", "shaft_loss",
)  # fmt: skip
"""What each part bears or loses; a variable of a limit is called by the part before _half_range."""

HALF_RANGE = "_half_range"

LEAST_LOSS = 0.05
"""Share of the largest loss below which a shaft is left out: dampers and couplings remain."""

ALIKE = 4.0
"""Ratio of the largest values of panels up to which they share one ordinate."""

MOST_ORDERS = 5
"""Orders that are told apart."""

ROMAN = ("I", "II", "III", "IV", "V", "VI")


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


def size_of(view: View, what: str) -> str:
    """What tells how large a torque or angle is: its half range, or else its orders."""
    half, orders = what + HALF_RANGE, f"{what}_order"
    alike = view.has(half) and {*view.array(half).dims, ORDER} == {*view.array(orders).dims}
    return half if alike else orders


def at_most_loaded(view: View, what: str) -> View:
    """The shaft whose torque, or the disc whose angle, is the largest where other axes are cut."""
    used = [f"{what}_order", size_of(view, what)]
    return at_largest(view.only(used, [SPEED, PARTS[what], MISFIRE]), used[-1])


def part_text(name: str) -> str:
    """What of a part a variable is, in one word."""
    return name.split("_")[1]


def with_worst_misfire(view: View, name: str, place: Mapping[str, int] | None = None) -> list[int]:
    """Places along the axis of misfires: the engine as it should run, and the worst cylinder."""
    cylinder = view.numbers(MISFIRE)
    sizes = np.where(cylinder == 0.0, -1.0, largest_along(view, name, MISFIRE, place))
    worst = [int(np.argmax(sizes))] if (cylinder != 0.0).any() else []
    return [int(i) for i in np.flatnonzero(cylinder == 0.0)[:1]] + worst


def over_speed(view: View, name: str) -> bool:
    """Whether a variable of shafts or discs runs over the speed as an axis of numbers."""
    if not view.has(name) or SPEED not in view.array(name).dims or view.axis(SPEED).words:
        return False
    return view.data.sizes[SPEED] > 1


# ---- what shafts and discs bear ------------------------------------------------------------------


def limits_of(view: View, name: str) -> list[str]:
    """Variables of the limits of what a part bears."""
    start = f"{name.removesuffix(HALF_RANGE)}_limit"
    return [str(other) for other in view.data.data_vars if str(other).startswith(start)]


def shaft_load_names(view: View) -> list[str]:
    """Half ranges and losses of shafts and discs over the speed, and their limits."""
    found = [name for name in BORNE if over_speed(view, name)]
    return found + [limit for name in found for limit in limits_of(view, name)]


def shaft_loads(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw what each part bears over the speed, and of the worst part along each other axis."""
    for name in (name for name in BORNE if name in names):
        part = part_of(study.view, name)
        for view, along in study.views_by_axis([name]):
            if along == SPEED:
                yield stem_of(name, view, along), _by_part(view, name, part)
            elif along not in (None, part, MISFIRE) and SPEED in view.array(name).dims:
                yield stem_of(name, view, along), _by_values(view, name, str(along))


def _by_part(view: View, name: str, part: str | None) -> Figure:
    """A panel for each shaft or disc: without misfire, with the worst one, and the limits."""
    limits = limits_of(view, name)
    view = view.only([name, *limits], [SPEED, part, MISFIRE])
    parts, speed = view.axis(part), view.axis(SPEED)
    sizes = largest_along(view, name, part) if part else np.ones(1)
    least = LEAST_LOSS * sizes.max() if name == "shaft_loss" else 0.0
    ranked = [int(i) for i in np.argsort(-sizes, kind="stable") if sizes[i] > least]
    shown = sorted(ranked[:MOST_PANELS]) or [0]
    share = sizes[shown].max() <= ALIKE * sizes[shown].min()
    base, each = (0.5, 1.75) if len(shown) > 1 else (3.3, 0.0)
    sheet = multiples(len(shown), base, each, sharex=True, sharey=share)
    for panel, index in zip(sheet.panels, shown, strict=True):
        place = parts.place(index)
        title = parts.tag(index)
        lines = []
        for which in with_worst_misfire(view, name, place) if misfires(view, name) else [None]:
            here, text, strong = place, "computed", True
            if which is not None:
                here, strong = {**place, MISFIRE: which}, view.numbers(MISFIRE)[which] == 0.0
                text = "no misfire" if strong else "worst cylinder misfiring, named above"
                title += "" if strong else f"; cylinder {view.axis(MISFIRE).words[which]}"
            lines.append(line_of(view, name, here, text, strong=strong))
        draw_points(panel, speed, lines, sheet.entries)
        _limit_lines(panel, view, limits, place, sheet.entries)
        target_lines(panel, view, [name], sheet.entries)
        parameter_ticks(panel, speed, "x", 5.0 / sheet.columns)
        panel.set_title(wrap(title, 34) if len(shown) > 1 else title)
    for panel in sheet.panels:
        panel.set_ylim(bottom=0.0)  # which ends the search for a scale, that panels may share
    sheet.label_x(speed.label, 5.0 / sheet.columns)
    sheet.label_y(_short_label(view, name), 1.5 if len(shown) > 1 else 2.8)
    left = f"{len(shown)} of {parts.size} {part}s shown, those of the largest values"
    notes = [*view.notes([name]), left if len(shown) < parts.size else ""]
    return sheet.finish(
        f"{view.title(name)} over the speed", [*notes, "" if share else OWN_ORDINATES],
        view.caption, legend=list(sheet.entries) != ["computed"], below=len(shown) > 1,
    )  # fmt: skip


def _by_values(view: View, name: str, along: str) -> Figure:
    """Lines for the values of an axis, for the part that bears most: no misfire, and the worst."""
    view = at_largest(view, name)
    if misfires(view, name):
        keep = with_worst_misfire(view, name)
        view = replace(view, data=view.data.isel({MISFIRE: keep}))
    facet = MISFIRE if misfires(view, name) else None
    return line_figure(view, [name], SPEED, along, facet)


def misfires(view: View, name: str) -> bool:
    """Whether misfires of cylinders are an axis of a variable."""
    return MISFIRE in view.array(name).dims


def _short_label(view: View, name: str) -> str:
    """Symbol and unit, or the whole label where there is no symbol: titles have the name."""
    symbol = symbol_of(view.array(name))
    return f"{symbol}{view.unit(name)}" if symbol else view.label(name)


def _limit_lines(
    panel: Axes, view: View, limits: Sequence[str], place: Mapping[str, int], entries: Entries
) -> None:
    """Limits over the speed, or the same at every speed."""
    speed = view.axis(SPEED).values
    for rank, limit in enumerate(limits):
        found = view.at(limit, place)
        if found.dims in ((), (SPEED,)) and np.isfinite(found.values.astype(float)).any():
            values = np.broadcast_to(found.values.astype(float), speed.shape)
            look = LOOK | {"linestyle": DASHES[(1, 3, 4)[rank % 3]], "linewidth": 1.3}
            entries.setdefault(view.title(limit), panel.plot(speed, values, **look)[0])


# ---- orders --------------------------------------------------------------------------------------


def shaft_order_names(view: View) -> list[str]:
    """Amplitudes of orders of torque and angle over the speed."""
    return [f"{what}_order" for what in PARTS if over_speed(view, f"{what}_order")]


def shaft_orders(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the strongest orders over the speed, below their half range, for the worst part."""
    for name in names:
        what = name.removesuffix("_order")
        for whole, along in study.views_by_axis([name]):
            if along == SPEED:
                view = at_most_loaded(whole, what)
                yield stem_of(name, view, SPEED), _orders_over_speed(view, what)


def _orders_over_speed(view: View, what: str) -> Figure:
    """A panel without misfire and one with the worst: orders, half range, critical speeds."""
    name, size = f"{what}_order", size_of(view, what)
    speed, orders = view.axis(SPEED), view.numbers(ORDER)
    misfire = view.axis(MISFIRE) if misfires(view, name) else view.axis(None)
    shown = with_worst_misfire(view, size) if misfire else [0]
    places = [misfire.place(index) for index in shown]
    sizes = np.max([largest_along(view, name, ORDER, place) for place in places], axis=0)
    strong = sorted(int(i) for i in np.argsort(-sizes, kind="stable")[:MOST_ORDERS] if sizes[i])
    sheet = multiples(len(shown), 3.6, 0.0, sharex=True, sharey=True)
    wide = WIDE / sheet.columns
    for panel, place, index in zip(sheet.panels, places, shown, strict=True):
        values = view.at(name, place).transpose(ORDER, SPEED).values.astype(float)
        for one in range(orders.size):
            if one not in strong:
                (line,) = panel.plot(speed.values, values[one], color=PALE, linewidth=0.6)
                sheet.entries.setdefault("other orders", line)
        for rank, one in enumerate(strong):
            style = line_style(rank, len(strong)) | {"markevery": max(speed.size // 8, 1)}
            (line,) = panel.plot(speed.values, values[one], **style)
            sheet.entries[f"order {number_text(orders[one])}"] = line
        if size != name:
            look: dict[str, Any] = {"color": rc("text.color"), "linewidth": 1.9}
            (line,) = panel.plot(speed.values, view.numbers(size, place), **look)
            sheet.entries["half range of their sum"] = line
        parameter_ticks(panel, speed, "x", wide)
        _critical_speeds(panel, view, strong, sizes, wide)
        panel.set_title(misfire.tag(index) if misfire else "", pad=15.0)
    sheet.panels[0].set_ylim(bottom=0.0)
    sheet.entries["other orders"] = sheet.entries.pop("other orders", line)
    sheet.label_x(speed.label, wide)
    sheet.label_y(f"{part_text(name).capitalize()}{view.unit(name)}", 2.8)
    met = "above: critical speeds, mode/order" if view.has(CRITICAL) else ""
    return sheet.finish(
        f"Orders of the {part_text(name)} over the speed", [*view.notes([name]), met], view.caption,
        below=len(shown) > 1,
    )  # fmt: skip


def _critical_speeds(
    panel: Axes, view: View, strong: Sequence[int], sizes: Floats, wide: float
) -> None:
    """Mark on the upper border where strong orders meet modes, as far as there is room."""
    if not view.has(CRITICAL) or set(view.only([CRITICAL], [MODE]).array(CRITICAL).dims) != {
        MODE,
        ORDER,
    }:
        return
    critical = view.only([CRITICAL], [MODE]).array(CRITICAL).transpose(MODE, ORDER).values
    low, high = float(view.axis(SPEED).values.min()), float(view.axis(SPEED).values.max())
    panel.set_xlim(low, high)
    met = [
        (float(critical[mode, one]), f"{ROMAN[mode]}/{number_text(view.numbers(ORDER)[one])}", one)
        for mode in range(min(len(critical), len(ROMAN)))
        for one in strong
        if low <= critical[mode, one] <= high
    ]
    speeds = np.array([speed for speed, _, _ in met])
    for speed in speeds:
        panel.axvline(speed, color="#888888", linewidth=0.7, linestyle=DASHES[3], zorder=1.2)
    weights = np.array([sizes[one] for _, _, one in met])
    for place in free_places((speeds - low) / (high - low), weights, 0.3 / wide):
        panel.text(
            speeds[place], 1.01, met[place][1], fontsize=6.5, ha="center", va="bottom",
            transform=panel.get_xaxis_transform(),
        )  # fmt: skip
