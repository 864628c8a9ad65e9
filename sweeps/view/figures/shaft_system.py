"""A shaft as it is handed in: its mass-elastic diagram, and the phase vectors of strong orders."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.base.errors import one_line
from sweeps.view.figures.arrangement import (
    arrangements_of,
    blank,
    circle,
    firing_notes,
    gathered,
    label,
    point,
)
from sweeps.view.figures.shaft_modes import CRITICAL, DISC, MODE, ORDER, SHAFT, SHAPE, SPEED
from sweeps.view.figures.sheet import GREY, NamedFigures, finish, multiples, new_sheet
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import View

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

INERTIA, STIFFNESS, RATIO = "system_inertia", "system_stiffness", "system_speed_ratio"
SUM = "mode_vector_sum"

LONGEST, SHORTEST = 2.5, 0.5
"""Lengths in medians of all at which a shaft is broken off, and from which it is to scale."""

WIDE, ROW = 6.4, 0.75
"""Width of the diagram, and distance of its rows, in inches."""

LARGEST = 0.34  # Radius of the largest disc in inches


def told_of(archive: xr.Dataset) -> dict[str, Any]:
    """What an archive says of the discs, shafts and gears of its shaft.

    Empty where it says nothing, or what is no tree of discs, which count from 1.
    """
    try:
        told = json.loads(archive.attrs.get("shaft") or "{}")
        pairs = [(first, second) for first, second in (*told["shafts"], *told["gears"])]
        named = [*told["throws"], told["flywheel"], told["free_end"]]
        group = list(range(len(pairs) + 2))
        for pair in (*pairs, *((one, one) for one in named)):
            if not all(type(one) is int and 0 < one < len(group) for one in pair):
                return {}
        for first, second in pairs:
            if group[first] == group[second]:
                return {}
            group = [group[first] if one == group[second] else one for one in group]
        held = told["dampers"], told["pendulums"]
        sound = all(type(one) is int and one >= 0 for one in held) and sum(held) <= len(pairs)
        for one in told["excitations"]:
            columns = [one["power"], one["speed"], one["mean"], *one["orders"], *one["amplitudes"]]
            sound &= np.isfinite(np.array(columns, dtype=float)).all()
    except (ValueError, TypeError, KeyError, RecursionError):
        return {}
    sizes = {"disc": len(pairs) + 1, "shaft": len(told["shafts"])}
    fits = all(archive.sizes.get(place, size) == size for place, size in sizes.items())
    return told if sound and fits else {}


def system_names(view: View) -> list[str]:
    """Inertias, stiffnesses and speed ratios, if all are there."""
    names = [INERTIA, STIFFNESS, RATIO]
    return names if all(map(view.has, names)) and told_of(view.data) else []


@dataclass
class _Places:
    """Places of discs in a diagram: along it, and the row; lines between them."""

    x: dict[int, float]
    row: dict[int, int]
    lines: list[tuple[int, int, int]]  # First and second disc, and number of the shaft; -1 of gears


def placed(told: Mapping[str, Any], length: Floats, held: int) -> _Places:
    """Lay out the tree of discs, which count from 0: the crankshaft first, branches below it.

    The last `held` discs are rings and pendulums, which stand above the disc that holds them.
    """
    discs = max(disc for pair in (*told["shafts"], *told["gears"]) for disc in pair)
    beside: dict[int, list[tuple[int, int]]] = {disc: [] for disc in range(discs)}
    pairs = [*enumerate(told["shafts"]), *((-1, pair) for pair in told["gears"])]
    for number, (first, second) in pairs:
        beside[first - 1].append((second - 1, number))
        beside[second - 1].append((first - 1, number))
    root = told["free_end"] - 1
    found = _Places({root: 0.0}, {root: 0}, [])

    def depth(disc: int, before: int) -> int:
        return 1 + max((depth(o, disc) for o, n in beside[disc] if o != before), default=0)

    todo, lowest = [root], 0
    while todo:
        disc = todo.pop()
        here, row = found.x[disc], found.row[disc]
        others = [(o, n) for o, n in beside[disc] if o not in found.x]
        for rank, (ring, number) in enumerate(o for o in others if o[0] >= discs - held):
            found.x[ring], found.row[ring] = here, 1 + rank
            found.lines.append((disc, ring, number))
        ahead = [one for one in others if one[0] < discs - held]
        # The longest branch of shafts goes on in the same row.
        ahead.sort(key=lambda one: (one[1] < 0, -depth(one[0], disc)))
        for rank, (other, number) in enumerate(ahead):
            straight = rank == 0 and number >= 0
            if not straight:
                lowest -= 1
            found.x[other] = here + (length[number] if number >= 0 else 0.0)
            found.row[other] = row if straight else lowest
            found.lines.append((disc, other, number))
        todo += [other for other, _ in reversed(ahead)]
    return found


def mass_elastic(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the system to scale: areas of discs by inertia, lengths by flexibility."""
    view = study.view.only(names, [DISC, SHAFT])
    told = told_of(view.data)
    inertia, stiffness, ratio = (view.numbers(name) for name in (INERTIA, STIFFNESS, RATIO))
    at_crank = inertia * ratio**2
    first = np.array([pair[0] - 1 for pair in told["shafts"]])
    with np.errstate(divide="ignore"):
        flexible = 1.0 / (stiffness * ratio[first] ** 2)
    held = told["dampers"] + told["pendulums"]
    own = flexible[: flexible.size - held]
    if not (np.isfinite(at_crank).all() and np.isfinite(own).all()):
        return
    scale = float(np.median(own)) if own.size else 1.0
    length = np.clip(flexible / scale, SHORTEST, LONGEST)
    places = placed(told, length, held)
    rows = [min(places.row.values()), max(places.row.values())]
    figure, (panel,) = new_sheet(1, 1, ROW * (rows[1] - rows[0]) + 1.3)
    inch = max(places.x.values(), default=1.0) / WIDE or 1.0 / WIDE
    _draw_lines(panel, places, told, flexible / scale, inch)
    _draw_discs(panel, places, told, at_crank, inch)
    panel.set_aspect("equal")
    panel.set_xlim(-0.45 * inch, (WIDE + 0.45) * inch)
    panel.set_ylim((ROW * rows[0] - 0.6) * inch, (ROW * rows[1] + 0.6) * inch)
    panel.axis("off")
    notes = [
        *view.notes(names), "areas of discs by inertia, lengths of shafts by flexibility, both at "
        "the speed of the crank; black or dotted: smaller than drawn; broken: longer than drawn",
    ]  # fmt: skip
    listed = view.data.coords["disc_name"].values
    caption = "; ".join(f"{i} {one_line(name, 40)}" for i, name in enumerate(listed, start=1))
    yield "mass_elastic", finish(figure, "Mass-elastic system", notes, caption=caption)


def _draw_lines(
    panel: Axes, places: _Places, told: Mapping[str, Any], length: Floats, inch: float
) -> None:
    """Draw shafts, what holds rings, and gears."""
    discs = len(places.x) - told["dampers"] - told["pendulums"]
    for first, second, number in places.lines:
        (x0, y0), (x1, y1) = (
            (places.x[disc], ROW * inch * places.row[disc]) for disc in (first, second)
        )
        if number < 0:
            panel.plot([x0, x1], [y0, y1], color="black", linewidth=1.0, linestyle=(0, (4, 2)))
            panel.text(x1 + 0.05 * inch, 0.5 * (y0 + y1), "gear", size=6.5, color=GREY, va="center")
            continue
        if second >= discs:
            panel.plot([x0, x1], [y0, y1], color="black", linewidth=0.9, linestyle=(0, (1, 1)))
            continue
        if y0 != y1:  # A branch leaves its disc downwards
            panel.plot([x0, x0], [y0, y1], color="black", linewidth=1.2)
        short = length[number] < SHORTEST
        panel.plot([x0, x1], [y1, y1], color="black", linewidth=1.2,
                   linestyle=(0, (1, 1.5)) if short else "-")  # fmt: skip
        middle = 0.5 * (x0 + x1)
        if length[number] > LONGEST:
            across, up = np.array([-0.03, 0.03]) * inch, np.array([-0.09, 0.09]) * inch
            for at in middle + across:
                panel.plot(at + across, y1 + up, color="black", linewidth=0.9)
        panel.text(middle, y1 + 0.11 * inch, str(number + 1), size=6.5, color=GREY, ha="center",
                   va="bottom")  # fmt: skip


def _draw_discs(
    panel: Axes, places: _Places, told: Mapping[str, Any], at_crank: Floats, inch: float
) -> None:
    """Draw discs by their roles, with numbers."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Circle

    radius = np.sqrt(at_crank / at_crank.max())
    # Neighbours of one row do not overlap, unless the discs would be very small.
    apart = [
        (places.x[b] - places.x[a]) / inch / (radius[a] + radius[b] + 0.05)
        for a, b, number in places.lines if number >= 0 and places.row[a] == places.row[b]
    ]  # fmt: skip
    radius = radius * np.clip(min(apart, default=LARGEST), 0.7 * LARGEST, LARGEST)
    geared = {a for a, b, number in places.lines if number < 0 and places.row[b] < places.row[a]}
    rings = range(len(places.x) - told["dampers"] - told["pendulums"], len(places.x))
    for disc, x in places.x.items():
        y, number = ROW * inch * places.row[disc], disc + 1
        small = radius[disc] < 0.03
        face, hatch = "white", ""
        if number in told["throws"]:
            face = "#b8cbe0"
        elif number == told["flywheel"]:
            face, hatch = "#d9d9d9", "////"
        elif disc in rings:
            face = "#f0dcb4"
        size = max(float(radius[disc]), 0.03)
        panel.add_patch(Circle(
            (x, y), size * inch, facecolor="black" if small else face, edgecolor="black",
            hatch=hatch, linewidth=0.8, zorder=3,
        ))  # fmt: skip
        above = disc in rings or disc in geared  # Below them is a line
        at = y + (1 if above else -1) * (size + 0.04) * inch
        panel.text(x, at, str(number), size=7.5, weight="bold", ha="center",
                   va="bottom" if above else "top", zorder=4)  # fmt: skip
    looks = [("throw", "#b8cbe0", told["throws"]), ("damper ring or pendulum", "#f0dcb4", rings),
             ("flywheel", "#d9d9d9", [1]), ("other disc", "white", [1])]  # fmt: skip
    handles = [
        Line2D([], [], linestyle="none", marker="o", markersize=6.5, markerfacecolor=face,
               color="black", label=text)
        for text, face, some in looks if len(some)
    ]  # fmt: skip
    panel.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, -0.02), ncols=4,
                 fontsize=7.0, handlelength=1.0, borderaxespad=0.0)  # fmt: skip


# ---- phase vectors -------------------------------------------------------------------------------


def phase_vector_names(view: View) -> list[str]:
    """Mode shapes and vector sums of engines whose cylinders and throws are known."""
    names = [SHAPE, SUM]
    known = all(map(view.has, names)) and told_of(view.data)
    return names if known and len(arrangements_of(view, _on_throws)) == 1 else []


def _on_throws(one: Mapping[str, Any]) -> bool:
    return "period" in one and len(one["throws"]) > 1


def phase_vectors(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the firing diagram of strong orders: phase vectors of the cylinders, and their sum."""
    view = study.view.only([*names, *([CRITICAL] if study.view.has(CRITICAL) else [])],
                           [MODE, ORDER, DISC])  # fmt: skip
    shape = view.array(SHAPE).transpose(MODE, DISC).values.astype(float)
    sums = view.array(SUM).transpose(MODE, ORDER).values.astype(float)
    (one,) = arrangements_of(view, _on_throws).values()
    throws = np.unique(np.asarray(one["positions"]), return_inverse=True)[1]
    discs = np.asarray(told_of(view.data)["throws"]) - 1
    if throws.max() >= discs.size:
        return
    shown = strongest(view, sums)
    if not shown:
        return
    sheet = multiples(len(shown), 0.2, 2.3, columns=min(len(shown), 3))
    for panel, (mode, order) in zip(sheet.panels, shown, strict=True):
        nu = view.numbers(ORDER)[order]
        angles = np.mod(nu * np.asarray(one["firing_angles"]), 360.0)
        _vectors(panel, angles, shape[mode, discs[throws]])
        met = ""
        if view.has(CRITICAL):
            critical = float(view.array(CRITICAL).transpose(MODE, ORDER).values[mode, order])
            met = f", {critical:.0f} rpm"
        said = f"order {nu:g}, mode {view.numbers(MODE)[mode]:g}{met}"
        panel.set_title(f"{said}\nvector sum {sums[mode, order]:.3g}")
    notes = [
        *view.notes(names), *firing_notes(one), "arrows: phase vectors of the cylinders, as long "
        "as their throw moves in the mode, clockwise; red: their sum over the number of cylinders",
    ]  # fmt: skip
    yield "phase_vectors", sheet.finish("Firing diagram of strong orders", notes, legend=False)


def strongest(view: View, sums: Floats) -> list[tuple[int, int]]:
    """Modes and orders of the six largest vector sums, with critical speeds within the speeds."""
    critical = np.full(sums.shape, np.nan)
    if view.has(CRITICAL):
        critical = view.array(CRITICAL).transpose(MODE, ORDER).values.astype(float)
    within = np.isfinite(sums)
    if SPEED in view.data.coords and view.numbers(SPEED).size > 1 and np.isfinite(critical).any():
        speed = view.numbers(SPEED)
        within &= (critical >= speed.min()) & (critical <= speed.max())
    found = [(int(i), int(j)) for i, j in np.argwhere(within)]
    found.sort(key=lambda place: -float(np.round(sums[place], 9)))
    return sorted(found[:6])


def _vectors(panel: Axes, angles: Floats, amplitudes: Floats) -> None:
    """Draw the star of one order in one mode, and the sum of its vectors."""
    blank(panel, 1.4)
    circle(panel, 1.0, linestyle=(0, (2, 2)), linewidth=0.6, edgecolor=GREY)
    size = np.abs(amplitudes)
    turned = np.where(amplitudes < 0.0, angles + 180.0, angles)
    for direction, members in gathered(turned):
        for place in members:
            _arrow(panel, point(direction, size[place]), "black", 0.9)
        label(panel, direction, 1.06, members)
    total = np.sum(amplitudes * np.exp(1j * np.radians(angles))) / amplitudes.size
    if abs(total) > 0.01:
        _arrow(panel, point(float(np.degrees(np.angle(total))), abs(total)), "#c1272d", 2.4)


def _arrow(panel: Axes, end: tuple[float, float], colour: str, width: float) -> None:
    panel.annotate("", end, (0.0, 0.0), arrowprops={
        "arrowstyle": "-|>", "color": colour, "shrinkA": 0.0, "shrinkB": 0.0, "linewidth": width,
    })  # fmt: skip
