"""Crank star with the side view of the crankshaft, as cylinder 1 is at its dead centre.

Both are drawn from the attribute ``arrangement`` of an archive: angles and places of the throws,
and the radii over that of cylinder 1. Seen from the side, a throw at the angle theta from the
upright stands r cos(theta) above the shaft. The star is drawn as seen from cylinder 1, turning
clockwise; the side view is from the right of the star. Journals stand between the throws.
Counterweights are drawn opposite to each throw where the archive gives their fraction.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps.view.figures.arrangement import (
    arrangements_of,
    blank,
    called,
    circle,
    draw_throws,
    gathered,
    sense,
)
from sweeps.view.figures.sheet import GREY, NamedFigures, finish, new_sheet
from sweeps.view.figures.study import Study
from sweeps.view.figures.wording import number_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WEB, JOURNAL, PIN = 0.14, 0.2, 0.16
"""Half thickness of the webs along the shaft, half heights of journals and pins, in crank radii."""

PITCH = 2.0
"""Distance of two throws in crank radii: the drawing is not to scale along the shaft."""

NEAR, FAR = "#d9d9d9", "#f2f2f2"
"""Throws towards the viewer, and away."""


def has_throws(one: Mapping[str, Any]) -> bool:
    """Whether there are two cylinders or more on known throws."""
    return len(one.get("throws", ())) > 1


def crank_stars(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw side view and star of the throws, a figure for each arrangement."""
    given = json.loads(study.view.data.attrs.get("parameters", "{}"))
    fraction = given.get("counterweight_fraction", 0.0)
    notes = ["the crank of cylinder 1 up", "take-off at cylinder 1",
             "side view from the right of the star, throws to its left are lighter"]  # fmt: skip
    if fraction:
        notes.append(f"counterweights for the fraction {number_text(fraction)}")
    for suffix, one in arrangements_of(study.view, has_throws).items():
        throws = _throws(one)
        long = PITCH * len({place for place, *_ in throws}) + 1.0
        widths = (max(long, 4.4), max(3.4, 0.33 * long))
        figure, (side, star) = new_sheet(1, 2, 2.7, width_ratios=widths)
        _side_view(side, throws, fraction)
        _star(star, throws)
        side.set_title("side view, not to scale along the shaft")
        star.set_title("crank star")
        yield f"crank_star{suffix}", finish(figure, f"Crankshaft, {called(one)}", notes)


Throw = tuple[float, float, float, list[int]]
"""Place along the shaft, angle [degree] from the upright, radius, and its cylinders."""


def _throws(one: Mapping[str, Any]) -> list[Throw]:
    """Every crank pin once; rods that share a pin share a throw."""
    angles = np.asarray(one["throws"], dtype=float)
    radii = np.asarray(one.get("radius_factor", np.ones(angles.size)), dtype=float)
    places = np.asarray(one["positions"], dtype=float)
    found = []
    for place in np.unique(places):
        here = np.flatnonzero(places == place)
        for radius in np.unique(radii[here]):
            same = here[radii[here] == radius]
            for angle, members in gathered(angles[same] - angles[0]):
                found.append((float(place), angle, float(radius), [int(same[i]) for i in members]))
    return found


def _side_view(panel: Axes, throws: Sequence[Throw], fraction: float) -> None:
    """Draw the shaft from the side: journals, webs and pins at their heights."""
    places = sorted({place for place, *_ in throws})
    middle = {place: PITCH * (number + 0.5) for number, place in enumerate(places)}
    end = PITCH * len(places)
    for number in range(len(places) + 1):
        x = PITCH * number
        _box(panel, x - 0.3, x + 0.3, 0.0, JOURNAL, zorder=2.0)
        panel.plot([x - 0.3, x + 0.3], [-0.45, -0.45], color=GREY, linewidth=1.0)
        panel.text(x, -0.55, str(number + 1), ha="center", va="top", color=GREY, size=6.5)
    panel.axhline(0.0, color=GREY, linewidth=0.5, linestyle=(0, (8, 2, 1, 2)), zorder=0)
    for place, x in middle.items():
        here = [throw for throw in throws if throw[0] == place]
        wide = (PITCH - 0.6 - 2.0 * WEB * (len(here) + 1)) / len(here)
        begin = x - 0.5 * PITCH + 0.3
        for _, angle, radius, members in here:
            height = radius * np.cos(np.radians(angle))
            nearer = np.sin(np.radians(angle)) > -1e-6
            shade = NEAR if nearer else FAR
            for web in (begin + WEB, begin + wide + 3.0 * WEB):
                _web(panel, web, height, shade, fraction)
            _box(panel, begin + 2.0 * WEB, begin + 2.0 * WEB + wide, height, PIN, zorder=3.0,
                 facecolor=shade)  # fmt: skip
            above = height >= -1e-6
            panel.text(
                begin + 2.0 * WEB + 0.5 * wide, height + (0.24 if above else -0.24),
                ", ".join(str(i + 1) for i in members), weight="bold", size=7.5,
                ha="center", va="bottom" if above else "top", zorder=4,
            )  # fmt: skip
            begin += wide + 2.0 * WEB
    panel.set_xlim(-0.6, end + 0.6)
    panel.set_ylim(-1.65, 1.65)
    panel.set_aspect("equal")
    panel.axis("off")


def _web(panel: Axes, x: float, height: float, shade: str, fraction: float) -> None:
    """Draw one web from journal to pin, and its counterweight on the other side."""
    low, high = sorted((0.0, height))
    _box(panel, x - WEB, x + WEB, 0.5 * (low + high), 0.5 * (high - low) + JOURNAL, zorder=2.5,
         facecolor=shade)  # fmt: skip
    if fraction:
        _box(panel, x - 1.3 * WEB, x + 1.3 * WEB, -0.7 * height, 0.25, zorder=2.6,
             facecolor="#8a8a8a")  # fmt: skip


def _box(panel: Axes, left: float, right: float, middle: float, half: float, **style: Any) -> None:
    from matplotlib.patches import Rectangle

    look: dict[str, Any] = {"facecolor": "white", "edgecolor": "black", "linewidth": 0.8} | style
    panel.add_patch(Rectangle((left, middle - half), right - left, 2.0 * half, **look))


def _star(panel: Axes, throws: Sequence[Throw]) -> None:
    """Draw the throws seen along the shaft, those at one angle once."""
    blank(panel, 1.65)
    circle(panel, 1.0, linestyle=(0, (2, 2)), linewidth=0.6, edgecolor=GREY)
    circle(panel, 0.2, linewidth=1.0, facecolor="white", edgecolor="black", zorder=3)
    angles, radii = (np.array([throw[part] for throw in throws]) for part in (1, 2))
    draw_throws(panel, angles, radii, [members for *_, members in throws], 0.2)
    sense(panel, 0.55)
