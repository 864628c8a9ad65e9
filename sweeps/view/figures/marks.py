"""How lines and points look, and the marks of designs without an answer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.view.figures.sheet import GREY
from sweeps.view.figures.views import NO_VALUE

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
    "no steady state": ("+", "...."),
    "not converged": ("v", "\\\\\\\\"),
    "invalid input": ("*", "xxxx"),
    NO_VALUE: ("|", "++++"),
}
"""Marker and hatching of a design without an answer, by its outcome."""

LOST_OTHERWISE = ("<", "oo")
"""The same for an outcome that is not listed."""


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
    """What a legend shows for designs without an answer."""
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
