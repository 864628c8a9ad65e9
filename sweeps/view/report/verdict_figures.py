"""Figures of a verdict, with their numbers: a value over its parameter with the limit, Campbell."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Booleans, Floats
from sweeps.base.dimensions import DESIGN, NOT_CHOSEN, words_of
from sweeps.base.ratios import ratio_text
from sweeps.decide.explore.barred import Barred
from sweeps.scene.conditions import Constraint
from sweeps.view.figures.shaft_modes import sum_at
from sweeps.view.figures.wording import equal_lines
from sweeps.view.report import charts
from sweeps.view.texts.barred import case_text
from sweeps.view.texts.readable_units import converted

if TYPE_CHECKING:
    import xarray as xr

MOST_LINES = len(charts.COLOURS)

LARGEST_DRAWN = 1e30  # Numbers that are not below this in size are not drawn

HEADROOM = 0.1  # Share of an axis above its numbers: the name of a limit needs it

LIMIT = {"line_color": "#b00020", "line_dash": "dashed", "line_width": 2}


def _limit(made: Any, value: float, text: str) -> None:
    """Draw a line at a limit, with its name."""
    bokeh = charts.models()
    made.add_layout(bokeh.Span(dimension="width", location=value, **LIMIT))
    made.add_layout(bokeh.Label(
        x=6, x_units="screen", y=value, text=text, text_color=LIMIT["line_color"],
        text_font_size="12px", y_offset=2,
    ))  # fmt: skip


def _drawn(made: Any, x: Floats, series: list[tuple[str, Floats]], heads: tuple[str, str],
           points: bool = False) -> None:  # fmt: skip
    """Fill a figure of `charts.lines`."""
    bokeh = charts.models()
    lines, marks = made.renderers[::2], made.renderers[1::2]
    items = []
    for (name, y), line, mark in zip(series, lines, marks, strict=True):
        with np.errstate(over="ignore"):  # Larger numbers are infinite, and are not drawn
            line.data_source.data = {"x": x.astype(np.float32), "y": y.astype(np.float32)}
        line.name = mark.name = name
        mark.visible = points
        items.append(bokeh.LegendItem(label={"value": name}, renderers=[line]))
    made.select_one({"name": "legend"}).items = items if len(items) > 1 else []
    made.select_one({"name": "legend"}).ncols = 4
    made.select_one({"name": "hover"}).update(
        visible=True, renderers=list(lines),
        tooltips=[("", "$name"), (heads[0], "@x{0.[00]}"), (heads[1], "@y{0.[00000]}")],
    )  # fmt: skip


# ---- targets -------------------------------------------------------------------------------------


def target_figure(
    archive: xr.Dataset, condition: Constraint, choices: Mapping[str, str],
    found: Mapping[str, int],
) -> list[charts.Drawn]:  # fmt: skip
    """A quantity with its limit over the inertia, or another axis of numbers; none without one.

    A line for each misfire, or else each load and so on, at the worst of all else. Designs of a
    list are points. The design at the place `found` is marked, or among the lines.
    """
    data = archive[condition.name]
    named = {str(archive[home].dims[0]) for home in words_of(archive).values()}
    numbers = [
        str(d) for d in data.dims
        if d in archive.coords and d not in named and d not in (DESIGN, "misfire")
        and archive[d].dtype.kind in "fiu" and archive.sizes[d] > 1
    ]  # fmt: skip
    if DESIGN in data.dims and {*numbers} <= {*NOT_CHOSEN}:
        drawn = _list_figure(archive, condition, choices, found.get(DESIGN))
        if drawn or not numbers:
            return drawn
    if not numbers:
        return []
    inertias = [d for d in numbers if "inertia" in d]
    designs = [d for d in numbers if d not in NOT_CHOSEN]
    across = (inertias or designs or (["speed"] if "speed" in numbers else numbers))[0]
    others = [str(d) for d in data.dims if d != across and archive.sizes[d] > 1]
    ranked = [*(d for d in others if d == "misfire"), *(d for d in others if d in NOT_CHOSEN),
              *others]  # fmt: skip
    apart = next((d for d in ranked if d in archive.coords), None)
    left = [d for d in data.dims if d not in (across, apart)]
    worst = data.max(left) if condition.above else data.min(left)
    factor, unit = converted(str(data.attrs.get("units", "1")), choices.get(condition.name))
    values = worst.transpose(*([apart] if apart else []), across).values.astype(float) * factor
    values = values.reshape(-1, archive.sizes[across])
    values = np.where(np.abs(values) < LARGEST_DRAWN, values, np.nan)
    names = ["all"]
    if apart:
        names = [case_text(archive, {apart: _word(archive, apart, i)}) for i in range(len(values))]
    if apart == "misfire":
        alike = equal_lines(names, list(values))
        values, names = values[[i for i, _ in alike]], [said for _, said in alike]
    if len(values) > MOST_LINES:
        rank = np.where(np.isfinite(values), values, 0.0).max(axis=1)
        rank = rank if condition.above else -rank
        kept = sorted({
            found.get(str(apart), 0), *np.argsort(-rank, kind="stable")[: MOST_LINES - 1].tolist()
        })  # fmt: skip
        values, names = values[kept], [names[i] for i in kept]
    some: Booleans = np.asarray(np.isfinite(values).any(axis=1))
    values, names = values[some], [name for name, known in zip(names, some, strict=True) if known]
    if not names:
        return []
    x_factor, x_unit = converted(str(archive[across].attrs.get("units", "1")), choices.get(across))
    x = archive[across].values.astype(float) * x_factor
    if not (np.abs(x) < LARGEST_DRAWN).all():
        return []
    order = np.argsort(x)
    x, values = x[order], values[:, order]
    heads = (_head(across, x_unit), _head(condition.name, unit))
    log = bool((x > 0.0).all() and x[-1] > 8.0 * x[0] and np.nanmin(values) > 0.0)
    kind = "log" if log else "linear"
    made = charts.lines(
        len(names), x_axis_label=heads[0], y_axis_label=heads[1], x_axis_type=kind,
        y_axis_type=kind,
    )  # fmt: skip
    _drawn(made, x, list(zip(names, values, strict=True)), heads, points=x.size <= 60)
    limit = float(np.clip(condition.limit * factor, -LARGEST_DRAWN, LARGEST_DRAWN))
    _limit(made, limit, f"limit {condition.written or ratio_text(condition.limit)}")
    seen = [one for one in (*values[np.isfinite(values)], limit) if one > 0.0 or not log]
    low, high = min(seen), max(seen)
    pad = 0.05 * (high - low) or abs(high) or 1.0
    top = HEADROOM * (high - min(0.0, low)) or pad
    if log:
        for axis, (first, last) in ((made.xaxis[0], (x[0], x[-1])), (made.yaxis[0], (low, high))):
            axis.ticker = _round_numbers(first / 1.15, last * 1.15)
    made.y_range.update(
        **({"start": low / 1.15, "end": high * max(1.15, (high / low) ** HEADROOM)} if log
           else {"start": min(0.0, low) if low > 0 else low - pad, "end": high + top})
    )  # fmt: skip
    of = f"The worst over {', '.join(map(str, left))}." if left else ""
    note = f"{of} {'A line for each value of ' + apart + '.' if apart else ''}".strip()
    return [charts.Drawn(f"{condition.name} over {across}, with its limit", note, made)]


MOST_POINTS = 4000  # Largest number of designs of a list that are drawn

MEETING = ("meets it", "does not")


def _list_figure(
    archive: xr.Dataset, condition: Constraint, choices: Mapping[str, str], found: int | None
) -> list[charts.Drawn]:
    """A quantity with its limit over a column of a list of designs; none without such a column.

    The column is the inertia, or the first one of numbers that tells designs apart.
    """
    data = archive[condition.name]
    columns = [
        str(n) for n, c in archive.coords.items()
        if c.dims == (DESIGN,) and n not in (DESIGN, *NOT_CHOSEN) and c.dtype.kind in "fiu"
    ]  # fmt: skip
    across = next((n for n in columns if "inertia" in n), columns[0] if columns else "")
    if not across:
        return []
    number = data.sizes[DESIGN]
    every = -(-number // MOST_POINTS)
    some_of = np.union1d(np.arange(0, number, every), [] if found is None else [found]).astype(int)
    part = data.isel({DESIGN: some_of})
    left = [d for d in part.dims if d != DESIGN]
    worst = (part.max(left) if condition.above else part.min(left)).values.astype(float)
    x_factor, x_unit = converted(str(archive[across].attrs.get("units", "1")), choices.get(across))
    factor, unit = converted(str(data.attrs.get("units", "1")), choices.get(condition.name))
    x = archive[across].values[some_of].astype(float) * x_factor
    some = (np.abs(x) < LARGEST_DRAWN) & (np.abs(worst * factor) < LARGEST_DRAWN)
    if not some.any() or np.ptp(x[some]) == 0.0:
        return []
    heads = (_head(across, x_unit), _head(condition.name, unit))
    names = [*MEETING, *(["found"] if found is not None else [])]
    made = charts.lines(len(names), x_axis_label=heads[0], y_axis_label=heads[1])
    bokeh, items, marks = charts.models(), [], made.renderers[1::2]
    holds = condition.holds(worst)
    for name, mark, line, which in zip(
        names, marks, made.renderers[::2], (holds, ~holds, some_of == found), strict=False
    ):
        kept = some & which
        points = {"x": x[kept].astype(np.float32), "y": (worst * factor)[kept].astype(np.float32)}
        mark.data_source.data, mark.name = points, name
        mark.glyph.size = 12 if name == "found" else 4
        line.visible = False
        items.append(bokeh.LegendItem(label={"value": name}, renderers=[mark]))
    made.select_one({"name": "legend"}).items = items
    made.select_one({"name": "hover"}).update(
        visible=True, renderers=marks,
        tooltips=[("", "$name"), (heads[0], "@x{0.[000]}"), (heads[1], "@y{0.[00000]}")],
    )  # fmt: skip
    limit = float(np.clip(condition.limit * factor, -LARGEST_DRAWN, LARGEST_DRAWN))
    _limit(made, limit, f"limit {condition.written or ratio_text(condition.limit)}")
    seen = [*(worst * factor)[some], limit]
    pad = 0.05 * (max(seen) - min(seen)) or abs(limit) or 1.0
    made.y_range.update(start=min(seen) - pad, end=max(seen) + HEADROOM / 0.05 * pad)
    of = f", the worst over {', '.join(map(str, left))}" if left else ""
    note = f"A point for each design{of}"
    note += f"; 1 of {every} of {number:,} designs is drawn." if every > 1 else "."
    return [charts.Drawn(f"{condition.name} over {across}, with its limit", note, made)]


def _round_numbers(low: float, high: float) -> Any:
    """Ticks at 1, 2, 5, 10 and so on: a logarithmic axis has none of its own over a short range."""
    powers = np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1.0)
    every = np.ravel(10.0 ** powers[:, None] * np.array([1.0, 2.0, 5.0]))
    ticks = [float(f"{one:.3g}") for one in every if low <= one <= high]
    return charts.models().FixedTicker(ticks=ticks)


def _word(archive: xr.Dataset, dim: str, index: int) -> Any:
    words = [home for home in words_of(archive).values() if archive[home].dims == (dim,)]
    return str(archive[words[0]].values[index]) if words else float(archive[dim].values[index])


def _head(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


# ---- shafts --------------------------------------------------------------------------------------


def _shaded(made: Any, solved: Barred, case: Mapping[str, Any] | None) -> None:
    """Shade barred ranges: of one case, or of any."""
    bokeh = charts.models()
    for one in solved.ranges:
        if case is None or one.case == case:
            alpha = 0.15 if case is not None else 0.06
            made.add_layout(bokeh.BoxAnnotation(
                left=one.low, right=one.high, fill_color="#b00020", fill_alpha=alpha,
                level="underlay", line_color=None,
            ))  # fmt: skip


def barred_figure(archive: xr.Dataset, solved: Barred) -> list[charts.Drawn]:
    """The largest value over its limit over the speed, a line for each case, as it was solved."""
    rank = np.where(np.isfinite(solved.ratio), solved.ratio, -1.0).max(axis=0)
    kept = sorted({0, *np.argsort(-rank, kind="stable")[: MOST_LINES - 1].tolist()})
    series = [(case_text(archive, solved.cases[i]), solved.ratio[:, i]) for i in kept]
    heads = ("speed [rpm]", "value over its limit")
    made = charts.lines(len(series), x_axis_label=heads[0], y_axis_label=heads[1])
    _drawn(made, solved.solved, series, heads)
    _limit(made, 1.0, "limit")
    _shaded(made, solved, None)
    made.y_range.update(start=0.0, end=1.1 * max(1.0, float(rank.max())))
    made.x_range.update(start=solved.speeds[0], end=solved.speeds[1], range_padding=0.0)
    note = "The largest of all shafts and limits at each speed; barred ranges of all cases shaded."
    if len(kept) < len(solved.cases):
        note += f" {len(kept)} of {len(solved.cases)} cases are drawn, the worst ones."
    return [charts.Drawn("Stress or torque over its limit, over the speed", note, made)]


MODES = ("natural_frequency", "critical_speed", "mode_vector_sum")
"""Quantities that a Campbell diagram needs."""


def campbell_figure(
    modes: xr.Dataset, speeds: tuple[float, float], case: str, solved: Barred | None = None
) -> list[charts.Drawn]:
    """Natural frequencies over the speed, orders, and critical speeds by their vector sums.

    `modes` are of one case, named by `case`; they may change with the speed. Barred ranges are
    those of the first case of `solved`.
    """
    over = {"mode"}, {"mode", "order"}, {"mode", "order"}
    if not {"mode", "order"} <= {*modes.coords} or any(
        name not in modes or {*modes[name].dims} - {"speed"} != dims
        for name, dims in zip(MODES, over, strict=True)
    ):
        return []
    own = "speed" in modes["natural_frequency"].dims
    low, high = speeds
    speed = np.sort(modes["speed"].values.astype(float)) if own else np.array([low, high])
    frequency = modes["natural_frequency"].transpose("mode", ...)
    frequency = frequency.sortby("speed") if own else frequency
    critical = modes["critical_speed"].transpose(..., "mode", "order").values
    if critical.ndim > 2:
        return []
    orders, numbers = modes["order"].values.astype(float), modes["mode"].values
    along = modes["mode_vector_sum"].transpose(..., "mode", "order").values
    sums = np.reshape([
        sum_at(along[..., i, j], modes["speed"].values if along.ndim > 2 else speed, at)
        for (i, j), at in np.ndenumerate(critical)
    ], critical.shape)  # fmt: skip
    if not np.isfinite(sums).any():
        return []
    inside = (critical >= low) & (critical <= high) & (sums >= 0.3 * np.nanmax(sums))
    shown = sorted({*np.flatnonzero(inside.any(axis=1)).tolist(), 0})
    series = [
        (f"mode {numbers[i]}", np.broadcast_to(frequency.values[i], speed.shape).astype(float))
        for i in shown if np.isfinite(frequency.values[i]).all()
    ][:MOST_LINES]  # fmt: skip
    if not series:
        return []
    top = 1.15 * max(float(line.max()) for _, line in series)
    bokeh = charts.models()
    heads = ("speed [rpm]", "frequency [Hz]")
    made = charts.lines(len(series), x_axis_label=heads[0], y_axis_label=heads[1], height=420)
    _drawn(made, speed, series, heads)
    strong = np.flatnonzero(inside[shown].any(axis=0))
    lines = bokeh.ColumnDataSource({
        "x0": [0.0] * strong.size, "y0": [0.0] * strong.size,
        "x1": [high * 1.02] * strong.size, "y1": orders[strong] * high * 1.02 / 60.0,
    })  # fmt: skip
    made.add_glyph(lines, bokeh.Segment(
        x0="x0", y0="y0", x1="x1", y1="y1", line_color="#999", line_width=1,
    ))  # fmt: skip
    mode, order = (part[np.isin(np.nonzero(inside)[0], shown)] for part in np.nonzero(inside))
    points = bokeh.ColumnDataSource({
        "x": critical[mode, order], "y": critical[mode, order] * orders[order] / 60.0,
        "size": 5.0 + 13.0 * sums[mode, order] / np.nanmax(sums),
        "order": [f"{one:g}" for one in orders[order]], "mode": numbers[mode],
        "sum": sums[mode, order],
    })  # fmt: skip
    dots = made.add_glyph(points, bokeh.Scatter(
        x="x", y="y", size="size", fill_color="#b00020", line_color="white", fill_alpha=0.85,
    ))  # fmt: skip
    made.add_layout(bokeh.LabelSet(
        x="x", y="y", text="order", x_offset=8, y_offset=4, text_font_size="12px", source=points,
    ))  # fmt: skip
    made.add_tools(bokeh.HoverTool(visible=False, renderers=[dots], tooltips=[
        ("order", "@order"), ("mode", "@mode"), ("critical speed", "@x{0.0} rpm"),
        ("vector sum", "@sum{0.00}"),
    ]))  # fmt: skip
    if solved is not None:
        _shaded(made, solved, solved.cases[0])
    made.y_range.update(start=0.0, end=top)
    made.x_range.update(start=low, end=high, range_padding=0.0)
    note = (
        "Grey lines are orders; a point is the critical speed of an order and a mode, the larger "
        "the stronger the throws excite it (vector sum, from 0.3 of the strongest on)."
    )
    if own:
        note += " Natural frequencies change with the speed: straight between the archive's speeds."
    if case:
        note += f" Case: {case}{', whose barred ranges are shaded' if solved is not None else ''}."
    return [charts.Drawn("Campbell diagram: critical speeds", note, made)]
