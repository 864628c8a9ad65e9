"""How lines and points look, the marks of designs without an answer, and lines at targets."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.view.figures.sheet import GREY, Entries
from sweeps.view.figures.views import LIMITED, NO_VALUE, StudyAxis, View
from sweeps.view.figures.wording import name_of, symbol_of, unit_text

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

MARKERS = ("o", "s", "^", "D", "v", "P", "X", "h")
DASHES: tuple[Any, ...] = (
    "-",
    (0, (6, 1.5)),
    (0, (4, 1.2, 1, 1.2)),
    (0, (1.2, 1)),
    (0, (3, 1, 1, 1, 1, 1)),
    (0, (9, 3)),
    (0, (2.5, 2)),
    (0, (5, 1, 1, 1, 1, 1, 1, 1)),
)
LOST: dict[str, tuple[str, str]] = {
    "stalled": ("x", "////"),
    "stopped": ("x", "////"),
    "not started": ("+", "...."),
    "no steady state": ("+", "...."),
    "not converged": ("v", "\\\\\\\\"),
    "invalid input": ("*", "xxxx"),
    NO_VALUE: ("|", "++++"),
}
"""Marker and hatching of a design without an answer, by its outcome."""

LOST_OTHERWISE = ("<", "oo")  # Marker and hatching of a design whose outcome is not listed


def shade(position: float) -> Any:
    """Colours from dark to light, so that grey print keeps their order."""
    import matplotlib

    return matplotlib.colormaps["viridis"](0.82 * position)


def line_style(index: int, count: int, strong: bool = False) -> dict[str, Any]:
    """Line number `index` of `count`: lightness, dashes and marker all differ."""
    return {
        "color": shade(index / max(count - 1, 1) if count > 1 else 0.15),
        "linestyle": DASHES[index % len(DASHES)],
        "marker": MARKERS[index % len(MARKERS)],
        "linewidth": 1.9 if strong else 1.2,
        "markerfacecolor": "white" if index % 2 else None,
    }


def lost_handle(why: str, colour: Any = GREY) -> Artist:
    """Mark of a legend for designs without an answer."""
    from matplotlib.lines import Line2D

    return Line2D([], [], **lost_look(why, colour))


def lost_look(why: str, colour: Any) -> dict[str, Any]:
    """Marks of designs without an answer, by their outcome."""
    return {
        "linestyle": "none",
        "marker": LOST.get(why, LOST_OTHERWISE)[0],
        "markersize": 6.0,
        "color": colour,
        "markerfacecolor": "none",
    }


def mark_lost(panel: Axes, why: str, colour: Any = GREY, rank: int = 0) -> None:
    """A mark in the corner of a panel whose curve is missing."""
    panel.plot([0.04 + 0.05 * rank], [0.95], transform=panel.transAxes, **lost_look(why, colour))


def lost_points(panel: Axes, x: Floats, why: str, colour: Any = GREY) -> None:
    """Marks on the lower border for designs without an answer."""
    panel.plot(
        x,
        np.zeros(x.size),
        clip_on=False,
        zorder=5,
        transform=panel.get_xaxis_transform(),
        rasterized=x.size > 200,
        **lost_look(why, colour),
    )


def doubt_look(size: float = 4.0) -> dict[str, Any]:
    """Marks of designs that missed the tolerance."""
    return {
        "linestyle": "none",
        "marker": "s",
        "markersize": size,
        "markerfacecolor": "none",
        "markeredgecolor": "black",
        "markeredgewidth": 0.6,
    }


TARGET_LOOK: dict[str, Any] = {"color": "#c1272d", "linestyle": (0, (7, 2)), "linewidth": 1.1}


LIMIT_LOOK: dict[str, Any] = TARGET_LOOK | {"linestyle": DASHES[1], "linewidth": 1.3}
"""Look of the limit of what a panel shows; of several, the first."""

MEAN_LOOK: dict[str, Any] = {"color": "#c05a1c", "linestyle": DASHES[1], "linewidth": 1.1}
"""Look of a mean over the cycle, in all figures."""


def target_text(view: View, name: str, text: str) -> str:
    """Text of the legend for a target: ``Target δ = 1/200``."""
    variable = view.array(name)
    unit = unit_text(str(variable.attrs.get("units", "")))
    return f"Target {symbol_of(variable) or name_of(variable, name)} = {text} {unit}".rstrip()


def targets_of(view: View, name: str) -> list[tuple[str, float, dict[str, Any]]]:
    """Text, value and look of each target of a variable, and of the limit of a ratio to it."""
    limits = [("Limit", 1.0, LIMIT_LOOK)] if name.endswith(LIMITED) else []
    targets = view.options.targets.get(name, ())
    return limits + [(target_text(view, name, text), v, TARGET_LOOK) for text, v in targets]


def target_lines(
    panel: Axes, view: View, names: Sequence[str], entries: Entries, *, upright: bool = False
) -> None:
    """Lines over a panel at the targets of what its ordinate (`upright`: its abscissa) shows."""
    draw = panel.axvline if upright else panel.axhline
    for text, value, look in (one for name in names for one in targets_of(view, name)):
        entries.setdefault(text, draw(value, zorder=1.5, **look))


def target_places(panel: Axes, view: View, axis: StudyAxis, entries: Entries) -> None:
    """Lines at the targets of the axis that a panel runs along."""
    if not axis.words and axis.name in view.options.targets:
        target_lines(panel, view, [axis.name], entries, upright=True)
