"""Turning-moment diagram: torque and resistance, areas of excess, and the levels of energy.

The work that the torque M does beyond the resistance goes into the rotating masses (Kakaitsas
eq. 3.2, figure 3.2; Asgari et al., method 2)::

    E(phi) = integral of (M - M_R) dphi,   W = max E - min E

The resistance M_R is the archive's load torque where that curve is there and balances the torque
over the cycle; otherwise it is the mean torque, as in text-books. Between two crossings of M and
M_R lies an area of excess or of lack, whose size is the work given to the masses or taken from
them. The energy is at its least and at its largest at a crossing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.types import Floats
from sweeps.view.figures.angle_lines import (
    load_at,
    over_angle,
    set_cycle,
    shade_work,
    torque_look,
    trace,
)
from sweeps.view.figures.marks import MEAN_LOOK, lost_handle, mark_lost
from sweeps.view.figures.sheet import GREY, Entries, NamedFigures, finish, new_sheet, y_label
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import View
from sweeps.view.figures.wording import HARD_SPACE, typeset

if TYPE_CHECKING:
    from matplotlib.axes import Axes

JOULES = {"N m": 1.0, "kN m": 1e3, "MN m": 1e6, "ft lbf": 1.3558179483, "lbf ft": 1.3558179483}
"""Joules of a torque of one over an angle of one radian, by the torque's unit."""

MEAN_TORQUE = "Mean torque"


@dataclass(frozen=True)
class Turning:
    """Areas between torque and resistance, and the energy that they sum to."""

    angle: Floats  # Angles of the closed curve [degree], including the crossings
    torque: Floats  # Torque [N m]
    resistance: Floats  # Resistance [N m]
    energy: Floats  # Work of the excess torque since the angle where it is least [J]
    crossings: np.ndarray  # Indices of the crossings in these arrays
    areas: Floats  # Work from each crossing to the next [J]; after the last one to the first

    @property
    def swing(self) -> float:
        """Range of the energy [J]."""
        return float(np.ptp(self.energy))


def turning(angle: Floats, torque: Floats, resistance: Floats) -> Turning:
    """Find the crossings of two closed curves of one mean, the areas between them, and the energy.

    The angles [degree] rise, and the last point is the first one again. Between points both curves
    [N m] are straight, as they are drawn.
    """
    excess = torque - resistance
    before = np.flatnonzero(excess[:-1] * excess[1:] < 0.0)
    share = excess[before] / (excess[before] - excess[before + 1])
    places = angle[before] + share * np.diff(angle)[before]
    every = np.union1d(angle, places)
    curve, resisting = np.interp(every, angle, torque), np.interp(every, angle, resistance)
    rest = curve - resisting
    rest[np.isin(every, places)] = 0.0
    steps = 0.5 * (rest[1:] + rest[:-1]) * np.diff(np.radians(every))
    energy = np.concatenate([[0.0], np.cumsum(steps)])
    crossings = np.flatnonzero(rest[:-1] == 0.0)
    levels = energy[crossings]
    areas = np.diff(levels, append=levels[:1] + energy[-1]) if crossings.size else levels
    return Turning(every, curve, resisting, energy - energy.min(), crossings, areas)


def turning_names(view: View) -> list[str]:
    """Torque in a unit whose work is known and, where it is a curve, the load torque."""
    if not over_angle(view, "torque") or _torque_unit(view) not in JOULES:
        return []
    return [name for name in ("torque", "load_torque") if over_angle(view, name)]


def _torque_unit(view: View) -> str:
    return str(view.array("torque").attrs.get("units", "N m")).replace("*", " ")


def turning_moment(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the turning-moment diagram of the nominal design."""
    view = study.view.only(names, ())
    figure, (upper, lower) = new_sheet(2, 1, 5.2, sharex=True, height_ratios=(3, 2))
    entries: Entries = {}
    notes, unit = view.notes(names), "J"
    x, torque, lost = trace(view, "torque", {})
    if lost:
        mark_lost(upper, lost)
        entries[lost] = lost_handle(lost)
    else:
        resistance, text = _resistance(view, names, x, torque)
        diagram = turning(x, torque, resistance)
        joules = JOULES[_torque_unit(view)]
        diagram = replace(diagram, energy=joules * diagram.energy, areas=joules * diagram.areas)
        unit = _unit(diagram.swing)[1]
        notes.append(f"areas in {unit}")
        _areas(upper, diagram, entries, text, view.title("torque"))
        _levels(lower, diagram, entries)
    set_cycle((upper, lower), view, 5.0, [lower])
    y_label(upper, "Torque" + view.unit("torque"), 2.7)
    y_label(lower, f"Energy above its minimum{HARD_SPACE}({unit})", 1.8)
    title = "Turning-moment diagram"
    drawn = finish(figure, title, notes, entries, caption=view.caption, below=True)
    yield "turning_moment" + view.suffix, drawn


def _resistance(view: View, names: Sequence[str], x: Floats, torque: Floats) -> tuple[Floats, str]:
    """The load torque if it balances the torque over the cycle, otherwise the mean torque."""
    mean = float(np.mean(torque[:-1]))
    load = load_at(view, x) if "load_torque" in names else None
    if load is not None and abs(np.mean(load[:-1]) - mean) <= 1e-3 * np.ptp(torque):
        load = load + (mean - np.mean(load[:-1]))  # Differences of the means would add up
        return load, view.title("load_torque")
    return np.full(x.size, mean), MEAN_TORQUE


def _areas(panel: Axes, diagram: Turning, entries: Entries, text: str, label: str) -> None:
    """Draw torque and resistance with the areas between them and their sizes."""
    x, torque, resistance = diagram.angle, diagram.torque, diagram.resistance
    (line,) = panel.plot(x, torque, **torque_look("torque"))
    mean = text == MEAN_TORQUE
    (other,) = panel.plot(x, resistance, **(MEAN_LOOK if mean else torque_look("load_torque")))
    entries |= {label: line, text: other}
    shade_work(panel, x, torque, resistance, entries)
    sizes = np.abs(diagram.areas)
    written = np.argsort(-sizes)[:16]
    for number in written[sizes[written] >= 0.04 * diagram.swing]:
        _write_area(panel, diagram, int(number))


def _write_area(panel: Axes, diagram: Turning, number: int) -> None:
    """Write the size of one area at its middle, or beyond its tip where it is too flat."""
    from matplotlib.patheffects import withStroke

    start = diagram.crossings[number]
    last = number + 1 == diagram.crossings.size
    parts = [(start, diagram.angle.size), (0, diagram.crossings[0] + 1)] if last else []
    parts = parts or [(start, diagram.crossings[number + 1] + 1)]
    first, end = max(parts, key=lambda part: diagram.angle[part[1] - 1] - diagram.angle[part[0]])
    rest = np.abs(diagram.torque - diagram.resistance)[first:end]
    if rest.sum() == 0.0:
        return
    middle = float(np.average(diagram.angle[first:end], weights=rest))
    height = float(np.interp(middle, diagram.angle, diagram.torque - diagram.resistance))
    level = float(np.interp(middle, diagram.angle, diagram.resistance))
    area = diagram.areas[number]
    narrow = diagram.angle[end - 1] - diagram.angle[first] < 50.0
    flat = abs(height) < (0.16 if narrow else 0.07) * np.ptp(diagram.torque)
    panel.annotate(
        f"{'+' if area > 0 else ''}{_energy_text(area, diagram.swing, False)}",
        (middle, level + (1.0 if flat else 0.4) * height), textcoords="offset points",
        xytext=(0.0, np.copysign(3.0, height) if flat else 0.0), ha="center",
        va=("bottom" if height > 0.0 else "top") if flat else "center", fontsize=6.5, zorder=6,
        rotation=90 if narrow and not flat else 0,
        path_effects=[withStroke(linewidth=2.0, foreground="white")],
    )  # fmt: skip


def _levels(panel: Axes, diagram: Turning, entries: Entries) -> None:
    """Draw the running energy, its levels at the crossings, and the swing between the outermost."""
    x, energy = diagram.angle, diagram.energy / _unit(diagram.swing)[0]
    (line,) = panel.plot(x, energy, color="#1b4f9c", linewidth=1.4)
    (points,) = panel.plot(
        x[diagram.crossings], energy[diagram.crossings], "o", color="#1b4f9c", markersize=4.0,
        markerfacecolor="white",
    )  # fmt: skip
    entries["Energy of the rotating masses"] = line
    entries["Energy at an intersection"] = points
    low, high = _extremes(diagram)
    swing = diagram.swing / _unit(diagram.swing)[0]
    for level in (0.0, swing):
        panel.axhline(level, color=GREY, linewidth=0.7, linestyle=(0, (4, 3)))
    place = 0.5 * (low + high)  # The arrow has most room there
    arrow = {"arrowstyle": "<->", "shrinkA": 0.0, "shrinkB": 0.0, "linewidth": 1.0}
    panel.annotate("", (place, swing), (place, 0.0), arrowprops=arrow)
    panel.set_title(
        f"Largest swing of the energy ΔW = {_energy_text(diagram.swing, diagram.swing)}"
    )
    panel.margins(y=0.12)


def _extremes(diagram: Turning) -> tuple[float, float]:
    """Angles of the largest energy and of the least one that is next to it."""
    high = int(np.argmax(diagram.energy))
    lowest = np.flatnonzero(diagram.energy <= 1e-6 * diagram.swing)
    low = lowest[np.argmin(np.abs(diagram.angle[lowest] - diagram.angle[high]))]
    return float(diagram.angle[low]), float(diagram.angle[high])


def _unit(swing: float) -> tuple[float, str]:
    """Unit in which an energy swing is a readable number, in J, and its name."""
    return (1e3, "kJ") if swing >= 1e4 else (1.0, "J")


def _energy_text(energy: float, swing: float, named: bool = True) -> str:
    """Part of an energy swing, with as many digits as are readable next to an area."""
    factor, unit = _unit(swing)
    value = energy / factor
    text = typeset(round(value) if abs(value) >= 100.0 else float(f"{value:.3g}"))
    return f"{text} {unit}" if named else text
