"""Crank train with its forces at one crank angle, to scale, and their course over the cycle.

The parts stand where Kakaitsas's eqs. 1.1 to 1.3 put them: the pin at the crank radius r, the rod
of length r/lambda at the archive's angle beta, or at sin(beta) = lambda sin(phi) without offsets.
The crank turns clockwise. The forces are those of the archive, drawn where they act (Kakaitsas eqs.
2.1 to 2.19):

=====================  ===========================================================================
gas force P_g          on the piston, towards the crank where positive
inertia force P_l      on the piston, towards the crank where positive
rod force S            on the crank pin along the rod, away from the piston in compression
wall thrust N          on the wall, to the side away from the pin that goes down
tangential force T     on the crank pin, in the sense of rotation
radial force R         on the crank pin, towards the shaft
=====================  ===========================================================================

so that S is the sum of T and R at the pin, and of P_g + P_l and the wall's reaction at the piston.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.base.errors import SceneError
from sweeps.view.figures.angle_lines import over_angle, set_cycle, trace
from sweeps.view.figures.sheet import GREY, Entries, NamedFigures, finish, new_sheet, rc, y_label
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import View
from sweeps.view.figures.wording import symbol_of, typeset, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FORCES: dict[str, tuple[str, Any]] = {
    "gas_force": ("#d1541b", (0, (6, 1.5))),
    "inertia_force": ("#1b4f9c", (0, (4, 1.2, 1, 1.2))),
    "rod_force": ("#000000", "-"),
    "wall_thrust": ("#7b2d8b", (0, (1.2, 1))),
    "tangential_force": ("#2f7d55", (0, (9, 3))),
    "radial_force": ("#8a6d00", (0, (3, 1, 1, 1, 1, 1))),
}
"""Colour and dashes for each force."""

LONGEST = 1.9  # Length of the longest arrow in crank radii

PISTON = 0.5  # Half height of the piston in crank radii


@dataclass(frozen=True)
class Mechanism:
    """Places in crank radii, x to the side where the pin goes down, y away from the shaft."""

    angle: float  # Crank angle [degree] after firing dead centre
    pin: Floats
    wrist: Floats  # Position of the piston pin
    half_bore: float


def train_force_names(view: View) -> list[str]:
    """Forces of one cylinder, if the tangential one is there with one on the piston."""
    names = [name for name in FORCES if over_angle(view, name)]
    known = "tangential_force" in names and len(names) > 2 and "crank_ratio" in _given(view)
    return names if known and _rod_known(view) else []


def _given(view: View) -> dict[str, float]:
    """Parameters with one value in all designs, and those of this slice."""
    given = json.loads(view.data.attrs.get("parameters", "{}"))
    for name in ("crank_ratio", "bore", "stroke"):
        if name in view.data.variables and view.array(name).ndim == 0:
            given[name] = float(view.array(name).values)
        elif name in view.data.variables:
            given.setdefault(name, float(np.ravel(view.array(name).values)[0]))
    return {str(key): float(value) for key, value in given.items()}


def _rod_known(view: View) -> bool:
    """Whether the rod's angle is in the archive, or follows from the crank ratio alone."""
    given = _given(view)
    offset = given.get("pin_offset", 0.0) or given.get("crank_offset", 0.0)
    return over_angle(view, "rod_angle") or not offset


def crank_train(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the crank train of the nominal design at one crank angle.

    That is the angle that the options ask for, otherwise that of the largest tangential force.
    """
    rod = ["rod_angle"] if over_angle(study.view, "rod_angle") else []
    view = study.view.only([*names, *rod], ())
    unit = view.array("tangential_force").attrs.get("units")
    names = [name for name in names if view.array(name).attrs.get("units") == unit]
    angle, tangential, lost = trace(view, "tangential_force", {})
    if lost:
        return
    at = chosen_angle(view, angle, tangential)
    said = f"{typeset(round(float(angle[at]), 2))}°"
    figure, (left, right) = new_sheet(1, 2, 4.6, width_ratios=(5, 8))
    curves = {name: trace(view, name, {}) for name in names}
    values = {name: float(y[at]) for name, (_, y, _) in curves.items()}
    _drawing(left, mechanism(view, at), values, {n: symbol_of(view.array(n)) for n in names})
    _scale(left, view, values)
    entries: Entries = {}
    for name, (x, y, _) in curves.items():
        colour, dashes = FORCES[name]
        (line,) = right.plot(x, y, color=colour, linestyle=dashes, linewidth=1.2)
        value = with_unit(view.array(name), float(f"{values[name]:.3g}"))
        entries[f"{view.title(name)}: {value}"] = line
    right.axhline(0.0, color=GREY, linewidth=0.6)
    right.axvline(angle[at], color=rc("text.color"), linewidth=1.0)
    right.set_title(f"over the cycle, {said} marked")
    set_cycle([right], view, 3.6, [right])
    y_label(right, "Force in cylinder 1" + view.unit("tangential_force"), 3.7)
    why = "" if view.options.at is not None else "at the largest tangential force"
    title, notes = f"Crank train with its forces at {said} crank angle", [*view.notes(names), why]
    drawn = finish(figure, title, notes, entries, caption=view.caption, below=True)
    yield "crank_train" + view.suffix, drawn


def chosen_angle(view: View, angle: Floats, tangential: Floats) -> int:
    """Place of the crank angle that is drawn: the one asked for, else of the largest force."""
    asked = view.options.at
    if asked is None:
        return int(np.argmax(np.abs(tangential[:-1])))
    low, high = float(angle[0]), float(angle[-1])
    if not low <= asked <= high:
        raise SceneError(f"at {asked:g}: the crank angle is from {low:g} to {high:g} degrees here")
    return int(np.argmin(np.abs(angle - asked)))


def mechanism(view: View, at: int) -> Mechanism:
    """Find the places of the parts at one point of the crank angle."""
    given = _given(view)
    zero = float(view.array("crank_angle").attrs.get("zero_at", 0.0))
    angle = trace(view, "tangential_force", {})[0][at] + zero
    phi = np.radians(angle)
    if over_angle(view, "rod_angle"):
        beta = np.radians(trace(view, "rod_angle", {})[1][at])
    else:
        beta = np.arcsin(given["crank_ratio"] * np.sin(phi))
    pin = np.array([np.sin(phi), np.cos(phi)])
    wrist = pin + np.array([-np.sin(beta), np.cos(beta)]) / given["crank_ratio"]
    bore, stroke = given.get("bore", 0.0), given.get("stroke", 0.0)
    return Mechanism(float(angle), pin, wrist, bore / stroke if stroke > 0.0 else 0.8)


def directions(place: Mechanism) -> dict[str, tuple[Floats, Floats]]:
    """Where each force acts and its direction where it is positive, of unit length."""
    rod = place.pin - place.wrist
    down, sideways = np.array([0.0, -1.0]), np.array([-1.0, 0.0])
    turned = np.radians(place.angle)
    head = place.wrist + np.array([0.0, PISTON])
    return {
        "gas_force": (head - np.array([0.5 * place.half_bore, 0.0]), down),
        "inertia_force": (head + np.array([0.5 * place.half_bore, 0.0]), down),
        "rod_force": (place.pin, rod / np.hypot(*rod)),
        "wall_thrust": (place.wrist, sideways),
        "tangential_force": (place.pin, np.array([np.cos(turned), -np.sin(turned)])),
        "radial_force": (place.pin, -place.pin),
    }


def _drawing(
    panel: Axes, place: Mechanism, values: dict[str, float], symbols: dict[str, str]
) -> None:
    """Draw liner, piston, rod and crank, and an arrow for each force."""
    from matplotlib.patches import Circle, Rectangle

    (px, py), (wx, wy), half = place.pin, place.wrist, place.half_bore
    top = wy - py + 1.0 + PISTON + 0.15  # Top of the liner, just above the piston's highest place
    for side in (-half, half):
        panel.plot([wx + side] * 2, [top - 2.0 - 1.7 * PISTON, top], color=GREY, linewidth=2.0,
                   zorder=1)  # fmt: skip
    panel.add_patch(
        Rectangle((wx - 0.97 * half, wy - PISTON), 1.94 * half, 2.0 * PISTON, facecolor="#eeeeee",
                  edgecolor="black", linewidth=0.8, zorder=2)
    )  # fmt: skip
    panel.add_patch(Circle((0.0, 0.0), 1.0, facecolor="none", edgecolor=GREY, linewidth=0.6,
                           linestyle=(0, (2, 2))))  # fmt: skip
    panel.plot([0.0, px], [0.0, py], color="#b5b5b5", linewidth=6.0, zorder=2)
    panel.plot([px, wx], [py, wy], color="#cfcfcf", linewidth=5.0, zorder=3)
    for x, y, radius in ((0.0, 0.0, 0.16), (px, py, 0.11), (wx, wy, 0.1)):
        panel.add_patch(Circle((x, y), radius, facecolor="white", edgecolor="black", zorder=4))
    panel.plot([wx, wx], [-1.1, top], color=GREY, linewidth=0.5, linestyle=(0, (8, 2, 1, 2)),
               zorder=0)  # fmt: skip
    largest = _largest(values)
    for name, (start, direction) in directions(place).items():
        # The arrow of a force below 2 % of the largest would be a head alone.
        if name in values and abs(values[name]) > 0.02 * largest:
            vector = LONGEST * values[name] / largest * direction
            if name == "wall_thrust":  # The thrust is drawn outside the liner, where it is visible
                start = start + np.sign(vector[0]) * np.array([half, 0.0])
            elif name in ("gas_force", "inertia_force") and vector[1] < 0.0:
                start = start - vector  # The arrow of a force that presses on the piston ends on it
            _arrow(panel, name, start, vector, symbols[name])
    panel.set_aspect("equal")
    panel.margins(x=0.1, y=0.02)
    panel.axis("off")


def _largest(values: dict[str, float]) -> float:
    return max(abs(value) for value in values.values()) or 1.0


def _arrow(panel: Axes, name: str, start: Floats, vector: Floats, symbol: str) -> None:
    """Draw a force as an arrow with its symbol."""
    from matplotlib.patheffects import withStroke

    end = start + vector
    look = {"arrowstyle": "-|>", "color": FORCES[name][0], "linewidth": 1.8, "shrinkA": 0.0,
            "shrinkB": 0.0, "mutation_scale": 9.0}  # fmt: skip
    panel.annotate("", tuple(end), tuple(start), arrowprops=look, zorder=6)
    along = vector / np.hypot(*vector)
    pressing = name in ("gas_force", "inertia_force") and vector[1] < 0.0
    # The symbol of a force that presses on the piston stands beside its arrow, any other beyond the
    # tip; that of the radial force, whose tip is among the rods, stands beside the tip.
    place = start + 0.5 * vector + np.array([0.16, 0.0]) if pressing else end + 0.25 * along
    if name == "radial_force":
        place = end + 0.3 * np.array([-along[1], along[0]])
    panel.update_datalim([start, end, place])  # Text outside the limits would not be drawn
    panel.annotate(
        symbol, tuple(place), color=FORCES[name][0], fontsize=8.0, va="center", zorder=7,
        ha="left" if pressing else "center",
        path_effects=[withStroke(linewidth=2.0, foreground="white")],
    )  # fmt: skip


def _scale(panel: Axes, view: View, values: dict[str, float]) -> None:
    """Draw a bar for a round force below the crank, to the scale of all arrows."""
    largest = _largest(values)
    power = 10.0 ** np.floor(np.log10(largest))
    length = max(step * power for step in (0.5, 1.0, 2.0, 5.0) if step * power <= 0.8 * largest)
    half = 0.5 * LONGEST * length / largest
    panel.plot([-half, half], [-1.4, -1.4], color=GREY, linewidth=1.0, marker="|", markersize=5.0)
    said = with_unit(view.array("tangential_force"), length)
    panel.text(0.0, -1.6, said, ha="center", va="top", color=GREY, fontsize=7.0)
    panel.update_datalim([(0.0, -1.8)])
    panel.autoscale_view()
