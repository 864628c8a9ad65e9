"""Forced vibration of a shaft: orders and loads over the speed, torque over the cycle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from engine_dyn.types import Floats
from sweeps.view.figures.angle_lines import line_or_mark, set_cycle, trace
from sweeps.view.figures.marks import DASHES, LIMIT_LOOK, line_style
from sweeps.view.figures.options import with_angle_from_zero
from sweeps.view.figures.parameter_lines import (
    COMPUTED,
    ParameterPanel,
    line_figure,
    line_of,
    parameter_figure,
)
from sweeps.view.figures.scales import parameter_ticks
from sweeps.view.figures.shaft_modes import (
    CRITICAL,
    DISC,
    MODE,
    ORDER,
    PALE,
    SHAFT,
    SPEED,
    WIDE,
    at_largest,
    free_places,
    largest_along,
    part_of,
    part_text,
)
from sweeps.view.figures.sheet import GREY, OWN_ORDINATES, Entries, NamedFigures, multiples, rc
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MISFIRE, MOST_PANELS, StudyAxis, View, stem_of
from sweeps.view.figures.wording import symbol_of, typeset, with_unit, wrap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PARTS = {"shaft_torque": SHAFT, "shaft_stress": SHAFT, "disc_angle": DISC}
"""Quantities that have orders, and the dimension of the parts that they belong to."""

BORNE = (
    "shaft_torque_half_range", "shaft_stress_half_range", "shaft_twist_half_range",
    "disc_angle_half_range", "shaft_loss",
)  # fmt: skip
"""Loads and losses of shafts and discs; names of limits begin with the words before _half_range."""

HALF_RANGE = "_half_range"


def size_of(view: View, what: str) -> str:
    """Variable of the size of a torque or angle: its half range, or else its orders."""
    half, orders = what + HALF_RANGE, f"{what}_order"
    alike = view.has(half) and {*view.array(half).dims, ORDER} == {*view.array(orders).dims}
    return half if alike else orders


def at_most_loaded(view: View, what: str) -> View:
    """The shaft whose torque, or the disc whose angle, is the largest where other axes are cut."""
    used = [f"{what}_order", size_of(view, what)]
    return at_largest(view.only(used, [SPEED, PARTS[what], MISFIRE]), used[-1])


def cases(
    view: View, name: str, place: Mapping[str, int]
) -> tuple[StudyAxis, list[dict[str, int]]]:
    """The axis of misfires, and the places on it of none and of the worst cylinder."""
    if MISFIRE not in view.array(name).dims:
        return view.axis(None), [dict(place)]
    missing = view.numbers(MISFIRE) != 0.0
    sizes = np.where(missing, largest_along(view, name, MISFIRE, place), -1.0)
    shown = [*np.flatnonzero(~missing)[:1], *([np.argmax(sizes)] if missing.any() else [])]
    return view.axis(MISFIRE), [{**place, MISFIRE: int(index)} for index in shown]


def over_speed(view: View, name: str) -> bool:
    """Whether a variable of shafts or discs runs over the speed as an axis of numbers."""
    if not view.has(name) or SPEED not in view.array(name).dims or view.axis(SPEED).words:
        return False
    return view.data.sizes[SPEED] > 1


# ---- loads of shafts and discs -------------------------------------------------------------------


def limits_of(view: View, name: str) -> list[str]:
    """Variables of the limits of what a part bears."""
    what = name.removesuffix(HALF_RANGE)
    starts = (f"{what}_limit", f"{what.replace('shaft', 'propulsion')}_limit")
    return [str(other) for other in view.data.data_vars if str(other).startswith(starts)]


def shaft_load_names(view: View) -> list[str]:
    """Half ranges and losses of shafts and discs over the speed, and their limits."""
    present = [name for name in BORNE if over_speed(view, name)]
    return present + [limit for name in present for limit in limits_of(view, name)]


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
    """Figure with a panel for each shaft or disc: no misfire, the worst misfire, and the limits."""
    limits = limits_of(view, name)
    view = view.only([name, *limits], [SPEED, part, MISFIRE])
    parts, speed = view.axis(part), view.axis(SPEED)
    sizes = largest_along(view, name, part) if part else np.ones(1)
    limited = [any(_limit(view, one, parts.place(i)) is not None for one in limits)
               for i in range(parts.size)]  # fmt: skip
    least = 0.05 * sizes.max() if name == "shaft_loss" else 0.0
    ranked = sorted(np.flatnonzero(sizes > least), key=lambda i: (not limited[i], -sizes[i]))
    shown = [int(index) for index in sorted(ranked[:MOST_PANELS])] or [0]
    share = sizes[shown].max() <= 4.0 * sizes[shown].min()
    panels = []
    for index in shown:
        title, lines = parts.tag(index), []
        misfire, places = cases(view, name, parts.place(index))
        for place in places:
            text = misfire.heading(place) or COMPUTED
            healthy = not misfire or view.numbers(MISFIRE)[place[MISFIRE]] == 0.0
            if not healthy:
                title = f"{title}; {text.removeprefix('misfire of ')}"
                text = "worst cylinder misfiring, named above"
            lines.append(line_of(view, name, place, text, strong=healthy))
        worst = np.max([line.y for line in lines], axis=0)
        bounds = {limit: _limit(view, limit, parts.place(index)) for limit in limits}
        title = title if len(shown) == 1 else wrap(title, 34)
        panels.append(ParameterPanel(lines, title, partial(_draw_limits, view, bounds, worst)))
    symbol = symbol_of(view.array(name))  # Enough for a label, since the title has the long name
    left = f"{len(shown)} of {parts.size} {part}s shown, those of the largest values"
    return parameter_figure(
        view, speed, panels, [name], symbol + view.unit(name) if symbol else view.label(name),
        f"{view.title(name)} over the speed",
        [*view.notes([name]), left * (len(shown) < parts.size), "" if share else OWN_ORDINATES],
        each=1.75, share=bool(share), from_zero=True,
    )  # fmt: skip


def _draw_limits(
    view: View, bounds: Mapping[str, Floats | None], worst: Floats, panel: Axes, entries: Entries
) -> None:
    """Draw lines at the limits of a part, and shade the areas above them."""
    speed = view.axis(SPEED).values
    for rank, (limit, values) in enumerate(bounds.items()):
        if values is None:
            continue
        look = LIMIT_LOOK | {"linestyle": DASHES[(1, 3, 4)[rank % 3]]}
        entries[view.title(limit)] = panel.plot(speed, values, **look)[0]
        if "passing" not in limit and (worst > values).any():  # To bar does not help above those
            barred = "above the limit: barred"
            entries[barred] = panel.fill_between(
                speed, worst, values, where=worst > values, interpolate=True, color=PALE,
                linewidth=0.0, label=barred,
            )  # fmt: skip


def _limit(view: View, limit: str, place: Mapping[str, int]) -> Floats | None:
    """Limit of a part at every speed; None without one."""
    values = view.numbers(limit, place)
    known = view.at(limit, place).dims in ((), (SPEED,)) and np.isfinite(values).any()
    return np.broadcast_to(values, view.axis(SPEED).values.shape) if known else None


def _by_values(view: View, name: str, along: str) -> Figure:
    """Figure with lines for values of an axis, for the most loaded shaft or disc."""
    view = at_largest(view, name)
    misfire, places = cases(view, name, {})
    if misfire:
        view = replace(view, data=view.data.isel({MISFIRE: [place[MISFIRE] for place in places]}))
    return line_figure(view, [name], SPEED, along, MISFIRE if misfire else None)


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
    """Figure without misfire and with the worst: orders, half range, critical speeds."""
    name, size = f"{what}_order", size_of(view, what)
    speed, orders = view.axis(SPEED), view.numbers(ORDER)
    misfire, places = cases(view, size, {})
    sizes = np.max([largest_along(view, name, ORDER, place) for place in places], axis=0)
    strong = sorted(int(i) for i in np.argsort(-sizes, kind="stable")[:5] if sizes[i])
    sheet = multiples(len(places), 3.6, 0.0, sharex=True, sharey=True)
    wide = WIDE / sheet.columns
    for panel, place in zip(sheet.panels, places, strict=True):
        values = view.at(name, place).transpose(ORDER, SPEED).values.astype(float)
        others = [one for one in range(orders.size) if one not in strong]
        pale = panel.plot(speed.values, values[others].T, color=PALE, linewidth=0.6)
        for rank, one in enumerate(strong):
            style = line_style(rank, len(strong)) | {"markevery": max(speed.size // 8, 1)}
            (line,) = panel.plot(speed.values, values[one], **style)
            sheet.entries[f"order {typeset(orders[one])}"] = line
        if size != name:
            look: dict[str, Any] = {"color": rc("text.color"), "linewidth": 1.9}
            (line,) = panel.plot(speed.values, view.numbers(size, place), **look)
            sheet.entries["half range of their sum"] = line
        parameter_ticks(panel, speed, "x", wide)
        _critical_speeds(panel, view, strong, sizes, wide)
        panel.set_title(misfire.heading(place), pad=15.0)
    sheet.panels[0].set_ylim(bottom=0.0)
    sheet.entries.update({"other orders": pale[0]} if pale else {})
    sheet.label_x(speed.label, wide)
    sheet.label_y(f"{part_text(name).capitalize()}{view.unit(name)}", 2.8)
    met = "above: critical speeds, mode/order" if view.has(CRITICAL) else ""
    return sheet.finish(
        f"Orders of the {part_text(name)} over the speed", [*view.notes([name]), met], view.caption,
        below=len(places) > 1,
    )  # fmt: skip


def _critical_speeds(
    panel: Axes, view: View, strong: Sequence[int], sizes: Floats, wide: float
) -> None:
    """Mark, on the upper border, speeds at which strong orders meet modes, where there is room."""
    dims = set(view.array(CRITICAL).dims) if view.has(CRITICAL) else set()
    if not {MODE, ORDER} <= dims or SPEED in dims:
        return
    critical = view.only([CRITICAL], [MODE]).array(CRITICAL).transpose(MODE, ORDER).values
    low, high = float(view.axis(SPEED).values.min()), float(view.axis(SPEED).values.max())
    panel.set_xlim(low, high)
    met = [
        (float(of_mode[one]), f"{roman}/{typeset(view.numbers(ORDER)[one])}", sizes[one])
        for roman, of_mode in zip(("I", "II", "III", "IV", "V", "VI"), critical, strict=False)
        for one in strong
        if low <= of_mode[one] <= high
    ]
    speeds, weights = (np.array([one[i] for one in met]) for i in (0, 2))
    for speed in speeds:
        panel.axvline(speed, color="#888888", linewidth=0.7, linestyle=DASHES[3], zorder=1.2)
    for place in free_places((speeds - low) / (high - low), weights, 0.3 / wide):
        panel.text(
            speeds[place], 1.01, met[place][1], fontsize=6.5, ha="center", va="bottom",
            transform=panel.get_xaxis_transform(),
        )  # fmt: skip


# ---- the cycle -----------------------------------------------------------------------------------


def shaft_cycle_names(view: View) -> list[str]:
    """Phases of torque and angle whose amplitudes are there; these get other figures too."""
    pairs = [(f"{what}_phase", f"{what}_order") for what in PARTS]
    return [phase for phase, order in pairs if view.has(phase) and view.has(order)]


def shaft_cycles(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the sum of the orders over the cycle for the worst part at the worst speed."""
    for name in names:
        what = name.removesuffix("_phase")
        view = at_most_loaded(study.view, what)
        if SPEED in view.array(f"{what}_order").dims:
            size = largest_along(view, size_of(view, what), SPEED)
            view = view.slice_at({SPEED: int(np.argmax(size))})
        view = view.only([f"{what}_order", name], [MISFIRE])
        yield stem_of(f"{what}_cycle", view, None), _cycle(view, what)


def sum_of_orders(degrees: Floats, order: Floats, amplitude: Floats, phase: Floats) -> Floats:
    """Sum of amplitude cos(nu phi + phase) of some orders at crank angles; all in degrees."""
    angles = np.radians(np.multiply.outer(degrees, order) + phase)
    return np.asarray(np.sum(amplitude * np.cos(angles), axis=-1))


def _cycle(view: View, what: str) -> Figure:
    """Figure without misfire and with the worst: the sum, its half range, large orders."""
    name = f"{what}_order"
    misfire, places = cases(view, size_of(view, what), {})
    order = view.numbers(ORDER)
    sizes = np.max([np.nan_to_num(view.numbers(name, place)) for place in places], axis=0)
    large = sorted(np.argsort(-sizes, kind="stable")[:3])
    sheet = multiples(len(places), 0.6, 2.0, columns=1, sharex=True, sharey=True)
    for panel, place in zip(sheet.panels, places, strict=True):
        curves = {f"order {typeset(order[one])}": [one] for one in large}
        here = _over_angle(view, what, place, {"sum of all orders": [*range(order.size)], **curves})
        for rank, text in enumerate(map(str, here.data.data_vars)):
            style = line_style(rank, len(here.data.data_vars)) | {"marker": "", "linewidth": 0.8}
            if not rank:
                style |= {"color": rc("text.color"), "linewidth": 1.7, "zorder": 3}
            line_or_mark(panel, trace(here, text, {}), style, text, rank, sheet.entries)
        low, high = (float(end(here.numbers("sum of all orders"))) for end in (np.min, np.max))
        for end in (low, high):
            line = panel.axhline(end, color=GREY, linewidth=0.7, linestyle=DASHES[3])
            sheet.entries["largest and least value"] = line
        half = with_unit(view.array(name), 0.5 * (high - low))
        case = f"{misfire.heading(place)}: " if misfire else ""
        panel.set_title(f"{case}half range {half}")
    set_cycle(sheet.panels, here, 4.6, sheet.lowest)
    sheet.label_y(f"{part_text(name).capitalize()}{view.unit(name)}", 1.8)
    title = f"{part_text(name).capitalize()} over the cycle, the sum of its orders"
    return sheet.finish(title, view.notes([name]), view.caption, below=False)


def _over_angle(
    view: View, what: str, place: Mapping[str, int], parts: Mapping[str, list[int]]
) -> View:
    """Sums of some orders as curves over the crank angle, counted as in all figures."""
    order, amplitude, phase = (
        view.numbers(name, place) for name in (ORDER, f"{what}_order", f"{what}_phase")
    )
    turns = round(1.0 / np.diff(order, prepend=0.0).min())  # All orders repeat in so many turns
    cycle = 360.0 * turns
    # At this step a period of order 12 has 120 points.
    degrees = np.arange(-0.5 * cycle, 0.5 * cycle, 0.25)
    about = {"long_name": "crank angle", "symbol": r"$\varphi$", "units": "degree"}
    curves = {
        text: ("crank_angle", sum_of_orders(degrees, order[some], amplitude[some], phase[some]))
        for text, some in parts.items()
    }
    data = xr.Dataset(curves, coords={"crank_angle": ("crank_angle", degrees, about)})
    return replace(view, data=with_angle_from_zero(data, view.options))
