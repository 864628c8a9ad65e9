"""The arrangement of the cylinders, drawn from the attribute ``arrangement`` of an archive.

On the left the crankshaft seen along its axis as cylinder 1 fires, with throws and banks, the sense
of rotation clockwise; on the right the firing star: the directions of the firings where one turn of
the star is one cycle.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.view.figures.sheet import GREY, NamedFigures, finish, new_sheet
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_PANELS, View
from sweeps.view.figures.wording import HARD_SPACE, number_text, sentence, slug

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SAME = 0.5
"""Degrees within which directions are drawn as one."""

PIN, BLOCK, TOP = 1.0, 1.9, 2.7
"""Distances from the shaft in crank radii of cylinder 1: its pin, both ends of a cylinder."""


def arrangements_of(
    view: View, usable: Callable[[Mapping[str, Any]], bool]
) -> dict[str, Mapping[str, Any]]:
    """Those arrangements that an archive describes and that can be drawn, by the ending of a file.

    Where there are several, the ending names the engine or, for one engine, the arrangement.
    """
    described = json.loads(view.data.attrs.get("arrangement") or "[]")
    listed = [described] if isinstance(described, dict) else described
    found: dict[str, Mapping[str, Any]] = {}
    for number, one in enumerate(listed, start=1):
        if usable(one):
            ending = f"_{slug(called(one))}" if len(listed) > 1 else ""
            found[f"{ending}_{number}" if ending in found else ending] = one
    return dict(itertools.islice(found.items(), MOST_PANELS))


def called(one: Mapping[str, Any]) -> str:
    """Name of an arrangement, with its engine where the archive has several."""
    name, engine = str(one["name"]), str(one.get("engine", ""))
    return f"{engine}, {name}" if engine else name


def firing_notes(one: Mapping[str, Any]) -> list[str]:
    """Firing order, and the intervals between the firings."""
    angles = np.asarray(one["firing_angles"])
    order = np.argsort(angles, kind="stable")
    gaps = np.diff(np.sort(angles), append=angles.min() + one["period"])
    steps = [_degrees(gap) for gap in gaps]
    even = len(set(steps)) == 1
    intervals = f"every{HARD_SPACE}{steps[0]}" if even else f"intervals {', '.join(steps)}"
    return [f"firing order {'-'.join(str(i + 1) for i in order)}", intervals]


def has_banks(one: Mapping[str, Any]) -> bool:
    """Whether there are two cylinders or more on known throws and banks."""
    return "period" in one and len(one["throws"]) > 1


def arrangements(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw a figure for each arrangement that the archive describes."""
    for suffix, one in arrangements_of(study.view, has_banks).items():
        figure, (view, star) = new_sheet(1, 2, 3.3)
        _end_view(view, one)
        _firing_star(star, one)
        view.set_title("end view as cylinder 1 fires")
        star.set_title(f"firing star, one turn is {number_text(one['period'])}°")
        drawn = finish(figure, sentence(called(one)), firing_notes(one))
        yield f"arrangement{suffix}", drawn


def _end_view(panel: Axes, one: Mapping[str, Any]) -> None:
    """Throws and banks, angles clockwise, the middle of the banks above."""
    throws = np.asarray(one["throws"])
    banks = np.asarray(one["banks"]) - _middle(np.asarray(one["banks"]))
    radii = np.asarray(one.get("radius_factor", np.ones(len(throws))))
    silent = {i for i, factor in enumerate(one["pressure_factor"]) if factor == 0.0}
    blank(panel, TOP + 0.6)
    circle(panel, PIN, linestyle=(0, (2, 2)), linewidth=0.6, edgecolor=GREY)
    for angle, members in gathered(banks):
        _cylinder(panel, angle, all(i in silent for i in members))
        label(panel, angle, TOP + 0.12, members)
    circle(panel, 0.3, linewidth=1.0, facecolor="white", edgecolor="black", zorder=3)
    # Pins at cylinder 1's firing: a throw stands its own angle away from that of cylinder 1.
    standing = banks[0] + throws - throws[0]
    draw_throws(panel, standing, radii, [[i] for i in range(len(throws))], 0.22)
    sense(panel, 0.62)


def _firing_star(panel: Axes, one: Mapping[str, Any]) -> None:
    """Directions of the firings over the cycle."""
    angles = np.asarray(one["firing_angles"]) * 360.0 / one["period"]
    silent = {i for i, factor in enumerate(one["pressure_factor"]) if factor == 0.0}
    blank(panel, 1.32)
    circle(panel, 1.0, linestyle=(0, (2, 2)), linewidth=0.6, edgecolor=GREY)
    found = sorted(gathered(angles))
    for angle, members in found:
        x, y = point(angle, 1.0)
        missing = all(i in silent for i in members)
        arrow = {
            "arrowstyle": "-|>", "color": GREY if missing else "black", "shrinkA": 0.0,
            "shrinkB": 0.0, "linewidth": 1.2, "linestyle": (0, (3, 2)) if missing else "-",
        }  # fmt: skip
        panel.annotate("", (x, y), (0.0, 0.0), arrowprops=arrow)
        label(panel, angle, 1.06, members, weight="bold")
    if len(found) > 1:
        following = [*found[1:], (found[0][0] + 360.0, [])]
        for (here, _), (after, _) in zip(found, following, strict=True):
            x, y = point(0.5 * (here + after), 0.72)
            gap = _degrees((after - here) * one["period"] / 360.0)
            panel.text(x, y, gap, ha="center", va="center", color=GREY, size=6.5)


def draw_throws(
    panel: Axes, angles: Floats, radii: Floats, cylinders: Sequence[list[int]], beyond: float
) -> None:
    """Draw throws seen along the shaft, those at one place once, and their cylinders beyond."""
    for radius in np.unique(radii):
        here = np.flatnonzero(radii == radius)
        for angle, places in gathered(angles[here]):
            x, y = point(angle, radius)
            panel.plot([0.0, x], [0.0, y], color="black", linewidth=2.2, zorder=2)
            panel.plot([x], [y], "o", color="white", markeredgecolor="black", markersize=7.0)
            members = sorted(i for place in places for i in cylinders[here[place]])
            label(panel, angle, radius + beyond, members, weight="bold")


def _middle(banks: Any) -> float:
    """Direction [degree] that is drawn upwards; flat engines lie."""
    turned = np.exp(1j * np.radians(np.unique(banks)))
    if abs(turned.sum()) > 1e-6:
        return float(np.degrees(np.angle(turned.sum())))
    return float(banks[0]) + (90.0 if len(turned) == 2 else 0.0)


def gathered(angles: Iterable[float]) -> Iterator[tuple[float, list[int]]]:
    """Directions [degree] and the places that have them."""
    left = dict(enumerate(float(angle) for angle in angles))
    while left:
        angle = next(iter(left.values()))
        members = [i for i, a in left.items() if abs((a - angle + 180.0) % 360.0 - 180.0) < SAME]
        yield angle, members
        for i in members:
            left.pop(i)


def point(angle: float, radius: float) -> tuple[float, float]:
    """Point at an angle [degree] clockwise from above."""
    turned = np.radians(angle)
    return float(radius * np.sin(turned)), float(radius * np.cos(turned))


def _cylinder(panel: Axes, angle: float, silent: bool) -> None:
    """Liner of one bank, open towards the crank, and the line that its pistons move on."""
    out, across = np.array(point(angle, 1.0)), np.array(point(angle + 90.0, 1.0))
    line = np.stack([0.0 * out, TOP * out])
    panel.plot(*line.T, color=GREY, linewidth=0.5, linestyle=(0, (8, 2, 1, 2)), zorder=0)
    half = 0.45 * across
    liner = np.stack([BLOCK * out - half, TOP * out - half, TOP * out + half, BLOCK * out + half])
    panel.plot(*liner.T, color="black", linewidth=1.2, linestyle=(0, (3, 2)) if silent else "-")


def circle(panel: Axes, radius: float, **style: Any) -> None:
    """Draw a circle about the shaft."""
    from matplotlib.patches import Circle

    panel.add_patch(Circle((0.0, 0.0), radius, **{"facecolor": "none", **style}))


def label(panel: Axes, angle: float, radius: float, members: list[int], **style: Any) -> None:
    """Write the numbers of cylinders at an angle [degree] and a distance from the shaft."""
    x, y = point(angle, radius)
    names = [str(i + 1) for i in members]
    # A long list in two rows.
    half = len(names) if len(names) <= 4 else -(-len(names) // 2)
    text = ",\n".join(", ".join(row) for row in (names[:half], names[half:]) if row)
    aside, above = point(angle, 1.0)
    panel.text(
        x, y, text, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5},
        size=7.5, linespacing=1.0, zorder=4,
        ha="center" if abs(aside) < 0.3 else "left" if aside > 0.0 else "right",
        va="center" if abs(above) < 0.3 else "bottom" if above > 0.0 else "top", **style,
    )  # fmt: skip


def sense(panel: Axes, radius: float) -> None:
    """Arrow in the sense of rotation, between two throws."""
    begin, end = point(-60.0, radius), point(-5.0, radius)
    panel.annotate(
        "", end, begin,
        arrowprops={"arrowstyle": "->", "connectionstyle": "arc3,rad=-0.27", "color": GREY,
                    "linewidth": 0.9},
    )  # fmt: skip


def blank(panel: Axes, room: float) -> None:
    """Make a square panel without axes, so many crank radii to each side."""
    panel.set_aspect("equal")
    panel.set_xlim(-room, room)
    panel.set_ylim(-room, room)
    panel.axis("off")


def _degrees(angle: float) -> str:
    return f"{number_text(round(float(angle), 2))}°"
