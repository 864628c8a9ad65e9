"""Cylinders, throws and strokes, drawn from the attribute ``arrangement`` of an archive."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from engine_dyn.types import Floats
from sweeps.view.figures.scales import crank_axis
from sweeps.view.figures.sheet import GREY, NamedFigures, finish, new_sheet
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_PANELS, View
from sweeps.view.figures.wording import HARD_SPACE, sentence, slug, typeset

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BLOCK, TOP = 1.9, 2.7
"""Distances of the ends of a cylinder from the shaft, in crank radii of cylinder 1."""


def arrangements_of(
    view: View, usable: Callable[[Mapping[str, Any]], bool]
) -> dict[str, Mapping[str, Any]]:
    """Arrangements that an archive describes and that can be drawn, by the ending of a file.

    Where there are several, the ending names the engine or, for one engine, the arrangement.
    """
    described = json.loads(view.data.attrs.get("arrangement") or "[]")
    listed = [described] if isinstance(described, dict) else described
    by_ending: dict[str, Mapping[str, Any]] = {}
    for number, one in enumerate(listed, start=1):
        if usable(one):
            ending = f"_{slug(called(one))}" if len(listed) > 1 else ""
            by_ending[f"{ending}_{number}" if ending in by_ending else ending] = one
    return dict(itertools.islice(by_ending.items(), MOST_PANELS))


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
        star.set_title(f"firing star, one turn is {typeset(one['period'])}°")
        yield f"arrangement{suffix}", finish(figure, sentence(called(one)), firing_notes(one))


def _end_view(panel: Axes, one: Mapping[str, Any]) -> None:
    """Draw throws and banks, angles clockwise, with the middle of the banks upwards."""
    throws = np.asarray(one["throws"])
    banks = np.asarray(one["banks"]) - _middle(np.asarray(one["banks"]))
    radii = np.asarray(one.get("radius_factor", np.ones(len(throws))))
    silent = {i for i, factor in enumerate(one["pressure_factor"]) if factor == 0.0}
    bores = np.asarray(one.get("bore_factor", np.ones(len(throws))))
    blank(panel, TOP + 0.6)
    circle(panel, 1.0, linestyle=(0, (2, 2)), linewidth=0.6, edgecolor=GREY)
    for angle, members in gathered(banks):
        wide = float(bores[members].max() / bores.max())
        _cylinder(panel, angle, all(i in silent for i in members), wide)
        label(panel, angle, TOP + 0.12, members)
    circle(panel, 0.3, linewidth=1.0, facecolor="white", edgecolor="black", zorder=3)
    # As cylinder 1 fires, its pin stands on the line of its bank; the others are turned from there.
    standing = banks[0] + throws - throws[0]
    draw_throws(panel, standing, radii, [[i] for i in range(len(throws))], 0.22)
    sense(panel, 0.62)


def _firing_star(panel: Axes, one: Mapping[str, Any]) -> None:
    """Draw the directions of the firings over the cycle."""
    angles = np.asarray(one["firing_angles"]) * 360.0 / one["period"]
    silent = {i for i, factor in enumerate(one["pressure_factor"]) if factor == 0.0}
    blank(panel, 1.32)
    circle(panel, 1.0, linestyle=(0, (2, 2)), linewidth=0.6, edgecolor=GREY)
    firings = sorted(gathered(angles))
    for angle, members in firings:
        x, y = point(angle, 1.0)
        missing = all(i in silent for i in members)
        arrow = {
            "arrowstyle": "-|>", "color": GREY if missing else "black", "shrinkA": 0.0,
            "shrinkB": 0.0, "linewidth": 1.2, "linestyle": (0, (3, 2)) if missing else "-",
        }  # fmt: skip
        panel.annotate("", (x, y), (0.0, 0.0), arrowprops=arrow)
        label(panel, angle, 1.06, members, weight="bold")
    if len(firings) > 1:
        following = [*firings[1:], (firings[0][0] + 360.0, [])]
        for (here, _), (after, _) in zip(firings, following, strict=True):
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
        # Directions within half a degree are drawn as one.
        members = [i for i, a in left.items() if abs((a - angle + 180.0) % 360.0 - 180.0) < 0.5]
        yield angle, members
        for i in members:
            left.pop(i)


def point(angle: float, radius: float) -> tuple[float, float]:
    """Point at an angle [degree] clockwise from above."""
    turned = np.radians(angle)
    return float(radius * np.sin(turned)), float(radius * np.cos(turned))


def _cylinder(panel: Axes, angle: float, silent: bool, wide: float) -> None:
    """Draw the liner of one bank, open towards the crank, and the line that its pistons move on.

    `wide` is its bore over the largest one.
    """
    out, across = np.array(point(angle, 1.0)), np.array(point(angle + 90.0, 1.0))
    line = np.stack([0.0 * out, TOP * out])
    panel.plot(*line.T, color=GREY, linewidth=0.5, linestyle=(0, (8, 2, 1, 2)), zorder=0)
    half = 0.45 * wide * across
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
    half = len(names) if len(names) <= 4 else -(-len(names) // 2)  # A long list has two rows
    text = ",\n".join(", ".join(row) for row in (names[:half], names[half:]) if row)
    sideways, above = point(angle, 1.0)
    panel.text(
        x, y, text, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5},
        size=7.5, linespacing=1.0, zorder=4,
        ha="center" if abs(sideways) < 0.3 else "left" if sideways > 0.0 else "right",
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
    return f"{typeset(round(float(angle), 2))}°"


WEB, JOURNAL = 0.14, 0.2
"""Half thickness of the webs along the shaft and half height of the journals, in crank radii."""

PITCH = 2.0  # Distance of two throws in crank radii: the drawing is not to scale along the shaft


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
        notes.append(f"counterweights for the fraction {typeset(fraction)}")
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
"""A throw: place along the shaft, angle [degree] from the upright, radius, and its cylinders."""


def _throws(one: Mapping[str, Any]) -> list[Throw]:
    """Throws with each crank pin once; rods on one pin share a throw."""
    angles = np.asarray(one["throws"], dtype=float)
    radii = np.asarray(one.get("radius_factor", np.ones(angles.size)), dtype=float)
    places = np.asarray(one["positions"], dtype=float)
    pins = []
    for place in np.unique(places):
        here = np.flatnonzero(places == place)
        for radius in np.unique(radii[here]):
            same = here[radii[here] == radius]
            for angle, members in gathered(angles[same] - angles[0]):
                pins.append((float(place), angle, float(radius), [int(same[i]) for i in members]))
    return pins


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
            # Throws towards the viewer are darker than those behind the shaft.
            shade = "#d9d9d9" if nearer else "#f2f2f2"
            for web in (begin + WEB, begin + wide + 3.0 * WEB):
                _web(panel, web, height, shade, fraction)
            _box(panel, begin + 2.0 * WEB, begin + 2.0 * WEB + wide, height, 0.16, zorder=3.0,
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


Look = dict[str, Any]

COMPRESSION: Look = {"facecolor": "#c9d6e8", "edgecolor": "black"}
EXCHANGE: Look = {"facecolor": "white", "edgecolor": "black"}

DRIVEN = (("expansion, suction", EXCHANGE), ("compression, delivery", COMPRESSION))
"""Strokes of a compressor from its top dead centre on."""


def has_strokes(one: Mapping[str, Any]) -> bool:
    """Whether two cylinders or more fire in a known cycle."""
    return len(one.get("firing_angles", ())) > 1 and one.get("period") in (360.0, 720.0)


def strokes(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the strokes of all cylinders, the first to fire above; a figure for each engine."""
    view = study.view
    for suffix, one in arrangements_of(view, has_strokes).items():
        firing = np.asarray(one["firing_angles"], dtype=float)
        order = np.argsort(firing, kind="stable")
        figure, (panel,) = new_sheet(1, 1, 0.7 + 0.26 * firing.size)
        angle, low, zero = _range(view, one["period"])
        panel.set_xlim(low, low + one["period"])
        for row, cylinder in enumerate(order):
            fires = one["pressure_factor"][cylinder] != 0.0
            _strokes_of_cylinder(
                panel, row, firing[cylinder] - zero, low, _strokes_of(view, one), fires
            )
        panel.set_ylim(firing.size - 0.45, -0.55)
        panel.set_yticks(range(firing.size), [f"cylinder {i + 1}" for i in order])
        panel.tick_params("y", left=False)
        panel.grid(False)
        crank_axis(panel, angle, 5.6)
        title = f"Strokes of the cylinders, {called(one)}"
        yield f"strokes{suffix}", finish(figure, title, firing_notes(one))


def _strokes_of(view: View, one: Mapping[str, Any]) -> Sequence[tuple[str, Look]]:
    """Names of the strokes from firing dead centre on."""
    power = {"facecolor": "#e8b08f", "edgecolor": "black"}
    if one["period"] == 720.0:
        return (("power", power), ("exhaust", EXCHANGE), ("intake", EXCHANGE),
                ("compression", COMPRESSION))  # fmt: skip
    if "motor_breakdown_torque" in json.loads(view.data.attrs.get("parameters", "{}")):
        return DRIVEN
    return (("expansion, gas exchange", power), ("gas exchange, compression", COMPRESSION))


def _range(view: View, period: float) -> tuple[xr.Variable, float, float]:
    """Crank angle with its attributes, its beginning, and the place of its zero after firing."""
    angle = view.data.variables.get("crank_angle")
    if angle is None:
        said = {"long_name": "crank angle", "symbol": r"$\varphi$", "units": "degree"}
        return xr.Variable((), 0.0, said), -0.5 * period, 0.0
    values: Floats = np.asarray(angle.values, dtype=float)
    return angle, float(values[0]), float(angle.attrs.get("zero_at", 0.0))


def _strokes_of_cylinder(
    panel: Any, row: int, firing: float, low: float, named: Sequence[tuple[str, Look]], fires: bool
) -> None:
    """Draw one cylinder's strokes; a stroke across the ends of the axis has two parts."""
    period = 180.0 * len(named)
    missing_look = {"facecolor": "white", "edgecolor": "#999999", "hatch": "////"}
    for number, (text, look) in enumerate(named):
        if number == 0 and not fires:
            text, look = "no firing", missing_look
        start = (firing + 180.0 * number - low) % period + low
        parts = [(start, min(start + 180.0, low + period))]
        if start + 180.0 > low + period + 1e-6:
            parts.append((low, start + 180.0 - period))
        for begin, end in parts:
            panel.barh(row, end - begin, left=begin, height=0.7, linewidth=0.7, **look)
        begin, end = max(parts, key=lambda part: part[1] - part[0])
        if end - begin > 0.09 * period:
            panel.text(
                0.5 * (begin + end), row, text, ha="center", va="center", fontsize=6.5,
                color=GREY if look is missing_look else "black",
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8}
                if look is missing_look else None,
            )  # fmt: skip
        if number == 0 and fires and named is not DRIVEN:
            panel.plot([start], [row - 0.35], marker="v", markersize=4.5, color="#8c2d04",
                       clip_on=False, zorder=6)  # fmt: skip
