"""Polar diagrams: one component of a load against the other over the cycle."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.base.dimensions import POLAR
from sweeps.view.figures.angle_lines import over_angle, trace
from sweeps.view.figures.marks import line_style
from sweeps.view.figures.sheet import WIDTH, Entries, NamedFigures, columns_for, multiples, rc
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_PANELS, StudyAxis, View, facet_of, stem_of
from sweeps.view.figures.wording import name_of, typeset

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D


MARKED = 30.0  # Degrees between the marks of a polar diagram


def polar_names(view: View) -> list[str]:
    """Both components of each load that has them over the crank angle."""
    return [name for _, *pair in _loads(view) for name in pair]


def _loads(view: View) -> list[tuple[str, str, str]]:
    """Loads with both components over the crank angle: file, to the right, and upwards."""
    loads = []
    for name in map(str, view.data.data_vars):
        for right, up in POLAR:
            load = name.removesuffix(f"_{right}")
            other = f"{load}_{up}"
            if load != name and over_angle(view, name) and view.has(other):
                loads.append((f"{load}_polar_{right}_{up}", name, other))
    return loads


def polar_diagrams(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw one component of each load against the other over the cycle."""
    for stem, *components in _loads(study.view):
        views = study.views_by_axis(components)
        # Journals always have a panel each.
        others = [(view, axis) for view, axis in views if axis != "main_bearing"]
        for whole, along in others or [(views[0][0], None)]:
            if along is None or whole.varies(components, along):
                yield stem_of(stem, whole, along), _polar_figure(whole, components, along)


def _polar_figure(view: View, names: Sequence[str], along: str | None) -> Figure:
    right, up = names
    facet = "main_bearing" if "main_bearing" in view.array(right).dims else None
    if facet is None and along is not None:
        facet = facet_of(view, names, [along])
    view = view.only(names, [along, facet]).with_values(names, facet)
    axis, across = view.axis(along), view.axis(facet)
    shown = across.picked(MOST_PANELS)
    columns = columns_for(len(shown))
    for_legend = 2.0 if axis and not across else 0.0
    room = (WIDTH - 1.05 - for_legend) / columns - (0.2 if across else 0.0)
    most = 2.6 if across else 4.6
    (left, low), (width, height) = _frame(view, names, room / most)
    wide = min(room, most * width / height)
    tall = wide * height / width
    size = WIDTH if columns > 2 else wide * columns + 1.05 + for_legend
    sheet = multiples(len(shown), 0.4, tall + 0.3, width=size, sharex=True, sharey=True)
    for panel, index in zip(sheet.panels, shown, strict=True):
        ends = (low, low + height)
        panel.set_xlim(left, left + width)
        panel.set_ylim(*(ends[::-1] if up.endswith("_down") else ends))
        _loops(panel, view, names, across.place(index), axis, height, sheet.entries)
        panel.axhline(0.0, color="#8a8a8a", linewidth=0.6, zorder=0.5)
        panel.axvline(0.0, color="#8a8a8a", linewidth=0.6, zorder=0.5)
        panel.set_aspect("equal", adjustable="box")
        panel.locator_params("x", nbins=max(2, int(1.4 * wide)))
        panel.locator_params("y", nbins=max(3, int(1.8 * tall)))
        panel.set_title(across.tag(index))
    sheet.label_x(view.label(right), 6.3 / columns if across else wide)
    sheet.label_y(view.label(up), tall)
    axes_said = next(said for pair, said in POLAR.items() if right.endswith(f"_{pair[0]}"))
    notes = [
        *view.notes(names), axis.picked_text(), across.picked_text(MOST_PANELS),
        axes_said, f"a mark every {MARKED:g}° of crank angle",
        "angles at the first curve" if axis else "",
    ]  # fmt: skip
    return sheet.finish(
        axis.by(f"Polar diagram of the {_common(view, names)}"), notes, view.caption,
        legend=bool(axis), legend_title=axis.label, below=bool(across),
    )  # fmt: skip


def _loops(
    panel: Axes, view: View, names: Sequence[str], place: Mapping[str, int],
    axis: StudyAxis, height: float, entries: Entries,
) -> None:  # fmt: skip
    """Draw a curve for each value of an axis; the first curve shows the angles."""
    values = axis.picked()
    loops = [_closed_once(view, names, {**place, **axis.place(value)}) for value in values]
    for rank, (value, loop) in enumerate(zip(values, loops, strict=True)):
        if loop is None:  # An engine with fewer journals has no such journal
            continue
        style = line_style(rank, len(values))
        # A curve is the wider, the more later curves lie on top of it, so that all are visible.
        later = sum(_coincide(loop, other, height) for other in loops[rank + 1 :])
        style["linewidth"] = 1.2 + 1.5 * later
        entries.setdefault(axis.text(value) + axis.mark(value), _draw_loop(panel, loop, style))
    for rank, loop in [(r, loop) for r, loop in enumerate(loops) if loop is not None][:1]:
        colour = line_style(rank, len(values))["color"]
        _write_angles(panel, loop, colour, apart=(0.09 if place else 0.06) * height)


def _frame(
    view: View, names: Sequence[str], ratio: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Lower left corner and size of a frame for all curves and zero, with one scale."""
    # The frame is widened towards `ratio`, width over height of the room, so that the axes fill the
    # page.
    ranges = []
    for name in names:
        values = view.numbers(name)
        known = values[np.isfinite(values)]
        ranges.append((min(known.min(initial=0.0), 0.0), max(known.max(initial=0.0), 0.0)))
    spans = [1.15 * (high - low) or 1.0 for low, high in ranges]
    least = min(ratio, 1.0)
    size = (max(spans[0], least * spans[1]), max(spans[1], 0.6 * spans[0]))
    middles = [0.5 * (low + high) for low, high in ranges]
    return (middles[0] - 0.5 * size[0], middles[1] - 0.5 * size[1]), size


def _common(view: View, names: Sequence[str]) -> str:
    """Words that the names of two components share, at their beginning or end."""
    words = [name_of(view.array(name), name).split() for name in names]
    for turn in (1, -1):
        pairs = zip(words[0][::turn], words[1][::turn], strict=False)
        same = [one for one, _ in itertools.takewhile(lambda pair: pair[0] == pair[1], pairs)]
        if same:
            return " ".join(same[::turn])
    return " and ".join(names)


@dataclass(frozen=True)
class _Loop:
    """One closed curve, crank angles and both components; repetitions are left out."""

    angle: Floats
    x: Floats
    y: Floats


def _closed_once(view: View, names: Sequence[str], place: Mapping[str, int]) -> _Loop | None:
    """A curve without the parts of the cycle in which it repeats itself."""
    angle, x, lost = trace(view, names[0], place)
    _, y, _ = trace(view, names[1], place)
    if lost:
        return None
    count = x.size - 1
    size = float(np.nanmax(np.hypot(x, y), initial=0.0))
    for parts in (12, 10, 8, 6, 5, 4, 3, 2):
        if count % parts:
            continue
        step = count // parts
        turned = np.hypot(np.roll(x[:-1], step) - x[:-1], np.roll(y[:-1], step) - y[:-1])
        # A curve repeats itself if one part differs from the next by at most 0.2 % of the largest
        # load.
        if np.all(turned <= 2e-3 * size):
            return _Loop(angle[: step + 1], x[: step + 1], y[: step + 1])
    return _Loop(angle, x, y)


def _coincide(one: _Loop, other: _Loop | None, height: float) -> bool:
    """Whether a large part of a curve lies on another one."""
    if other is None:
        return False
    step = max(1, other.x.size // 180)
    far = np.hypot(
        one.x[::step, None] - other.x[None, ::step], one.y[::step, None] - other.y[None, ::step]
    )
    return bool(np.mean(far.min(axis=1) < 0.01 * height) > 0.25)


def _draw_loop(panel: Axes, loop: _Loop, style: dict[str, Any]) -> Line2D:
    """Draw one closed curve with marks along it."""
    (line,) = panel.plot(loop.x, loop.y, **(style | {"marker": ""}))
    marks = _marks(loop, MARKED)
    panel.plot(
        loop.x[marks], loop.y[marks], linestyle="none", marker="o", markersize=2.2,
        color=style["color"],
    )  # fmt: skip
    return line


def _marks(loop: _Loop, every: float) -> Any:
    return np.flatnonzero(
        np.isclose((loop.angle[:-1] + 0.5 * every) % every, 0.5 * every, atol=1e-6)
    )


def _write_angles(panel: Axes, loop: _Loop, colour: Any, *, apart: float) -> None:
    """Write the angles of the dead centres and of the quarters between them next to a curve."""
    from matplotlib.patheffects import withStroke

    x, y, angle = loop.x, loop.y, loop.angle
    middle = (float(np.mean(x[:-1])), float(np.mean(y[:-1])))
    upward = -1.0 if panel.yaxis_inverted() else 1.0
    halo = [withStroke(linewidth=1.5, foreground=rc("axes.facecolor"))]
    written: list[tuple[float, float]] = []
    for mark in _marks(loop, 90.0):
        here = (float(x[mark]), float(y[mark]))
        if any(np.hypot(here[0] - u, here[1] - v) < apart for u, v in written):
            continue
        written.append(here)
        # The text stands to the side of the curve that is away from its middle.
        before, after = (mark - 1) % (x.size - 1), (mark + 1) % (x.size - 1)
        sideways, above = float(y[after] - y[before]), float(x[before] - x[after])
        outward = sideways * (here[0] - middle[0]) + above * (here[1] - middle[1])
        sign = 1.0 if outward > 0.0 else -1.0
        sideways, above = sign * sideways, sign * upward * above
        far = float(np.hypot(sideways, above)) or 1.0
        panel.annotate(
            f"{typeset(angle[mark])}°", here, textcoords="offset points",
            xytext=(6.0 * sideways / far, 6.0 * above / far),
            ha="left" if sideways > 0.3 * far else "right" if sideways < -0.3 * far else "center",
            va="bottom" if above > 0.3 * far else "top" if above < -0.3 * far else "center",
            fontsize=6.5, color=colour, path_effects=halo,
        )  # fmt: skip
