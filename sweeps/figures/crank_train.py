"""Crank train with its forces at one crank angle, to scale, and their course over the cycle.

Position of the parts (Kakaitsas eqs. 1.1 to 1.3), pin at the crank radius r, rod of length r/lambda:
with the rod angle beta of the archive, or sin(beta) = lambda sin(phi) without offsets. The crank
turns clockwise. Forces are those of the archive, drawn where they act (Kakaitsas eqs. 2.1 to 2.19):

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
from sweeps.figures.scales import y_label
from sweeps.figures.sheet import GREY, Entries, NamedFigures, finish, new_sheet
from sweeps.figures.study import Study
from sweeps.figures.traces import over_angle, set_cycle, trace
from sweeps.figures.views import View
from sweeps.figures.wording import number_text, title_of, unit_in_brackets, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TANGENTIAL = "tangential_force"

FORCES: dict[str, tuple[str, Any]] = {
    "gas_force": ("#d1541b", (0, (6, 1.5))),
    "inertia_force": ("#1b4f9c", (0, (4, 1.2, 1, 1.2))),
    "rod_force": ("#000000", "-"),
    "wall_thrust": ("#7b2d8b", (0, (1.2, 1))),
    TANGENTIAL: ("#2f7d55", (0, (9, 3))),
    "radial_force": ("#8a6d00", (0, (3, 1, 1, 1, 1, 1))),
}
"""Colour and dashes of each force."""

LONGEST = 1.5
"""Crank radii of the longest arrow."""

SHORTEST = 0.02
"""Share of the longest force below which no arrow is drawn."""

PISTON = 0.5
"""Half height of the piston in crank radii."""


@dataclass(frozen=True)
class Mechanism:
    """Places in crank radii, x to the side where the pin goes down, y away from the shaft."""

    angle: float  # of the crank [degree] after firing dead centre
    pin: Floats
    wrist: Floats  # piston pin
    half_bore: float


def train_force_names(view: View) -> list[str]:
    """Forces of one cylinder, if the tangential one is there with one on the piston."""
    names = [name for name in FORCES if over_angle(view, name)]
    known = TANGENTIAL in names and len(names) > 2 and "crank_ratio" in _given(view)
    return names if known and _rod_known(view) else []


def _given(view: View) -> dict[str, float]:
    """Parameters that are the same in all designs, and those of this slice."""
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
    """Draw the crank train at the angle of the largest tangential force, of the nominal design."""
    rod = ["rod_angle"] if over_angle(study.view, "rod_angle") else []
    view = study.view.only([*names, *rod], ())
    angle, tangential, lost = trace(view, TANGENTIAL, {})
    if lost:
        return
    at = int(np.argmax(np.abs(tangential)))
    figure, (left, right) = new_sheet(1, 2, 4.4, width_ratios=(3, 4))
    values = {name: float(trace(view, name, {})[1][at]) for name in names}
    _drawing(left, mechanism(view, at), values)
    entries: Entries = {}
    for name in names:
        colour, dashes = FORCES[name]
        x, y, _ = trace(view, name, {})
        (line,) = right.plot(x, y, color=colour, linestyle=dashes, linewidth=1.2)
        said = with_unit(view.array(name), float(f"{values[name]:.3g}"))
        entries[f"{title_of(view.array(name), name)}: {said}"] = line
    right.axhline(0.0, color=GREY, linewidth=0.6)
    right.axvline(angle[at], color="black", linewidth=1.0)
    set_cycle([right], view, 3.3, [right])
    y_label(right, "Force in cylinder 1" + unit_in_brackets(view.array(TANGENTIAL)), 3.5)
    right.set_title(f"at {number_text(round(float(angle[at]), 2))}°, the line")
    left.set_title("forces to scale")
    notes = [*view.notes(names), "at the largest tangential force"]
    yield (
        "crank_train" + view.suffix,
        finish(
            figure, f"Crank train at {number_text(round(float(angle[at]), 2))}° crank angle",
            notes, entries, caption=view.caption, below=True,
        ),
    )  # fmt: skip


def mechanism(view: View, at: int) -> Mechanism:
    """Find the places of the parts at one point of the crank angle."""
    given = _given(view)
    zero = float(view.array("crank_angle").attrs.get("zero_at", 0.0))
    angle = trace(view, TANGENTIAL, {})[0][at] + zero
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
    down, aside = np.array([0.0, -1.0]), np.array([-1.0, 0.0])
    turned = np.radians(place.angle)
    head = place.wrist + np.array([0.0, PISTON])
    return {
        "gas_force": (head + np.array([-0.35 * place.half_bore, 0.0]), down),
        "inertia_force": (head + np.array([0.35 * place.half_bore, 0.0]), down),
        "rod_force": (place.pin, rod / np.hypot(*rod)),
        "wall_thrust": (place.wrist, aside),
        TANGENTIAL: (place.pin, np.array([np.cos(turned), -np.sin(turned)])),
        "radial_force": (place.pin, -place.pin),
    }


def _drawing(panel: Axes, place: Mechanism, values: dict[str, float]) -> None:
    """Draw liner, piston, rod and crank, and an arrow for each force."""
    from matplotlib.patches import Circle, Rectangle

    (px, py), (wx, wy), half = place.pin, place.wrist, place.half_bore
    top, low = place.wrist[1] - place.pin[1] + 1.0 + PISTON + 0.3, wy - PISTON
    for side in (-half, half):
        panel.plot([wx + side] * 2, [max(low - 1.2, 1.2), max(top, wy + PISTON + 0.2)],
                   color=GREY, linewidth=2.0, zorder=1)  # fmt: skip
    panel.add_patch(
        Rectangle((wx - 0.97 * half, low), 1.94 * half, 2.0 * PISTON, facecolor="#eeeeee",
                  edgecolor="black", linewidth=0.8, zorder=2)
    )  # fmt: skip
    panel.add_patch(Circle((0.0, 0.0), 1.0, facecolor="none", edgecolor=GREY, linewidth=0.6,
                           linestyle=(0, (2, 2))))  # fmt: skip
    panel.plot([0.0, px], [0.0, py], color="#777777", linewidth=5.0, zorder=2)
    panel.plot([px, wx], [py, wy], color="#aaaaaa", linewidth=4.0, zorder=3)
    for x, y, radius in ((0.0, 0.0, 0.16), (px, py, 0.11), (wx, wy, 0.1)):
        panel.add_patch(Circle((x, y), radius, facecolor="white", edgecolor="black", zorder=4))
    panel.axvline(wx, color=GREY, linewidth=0.5, linestyle=(0, (8, 2, 1, 2)), zorder=0)
    largest = max(abs(value) for value in values.values()) or 1.0
    for name, (start, direction) in directions(place).items():
        if name in values and abs(values[name]) > SHORTEST * largest:
            _arrow(panel, name, start, LONGEST * values[name] / largest * direction)
    panel.set_aspect("equal")
    panel.margins(0.12)
    panel.axis("off")


def _arrow(panel: Axes, name: str, start: Floats, vector: Floats) -> None:
    """Draw a force as an arrow; one that presses on the piston ends on it."""
    end = start + vector
    if name in ("gas_force", "inertia_force") and vector[1] < 0.0:
        start, end = start - vector, start
    look = {"arrowstyle": "-|>", "color": FORCES[name][0], "linewidth": 1.6, "shrinkA": 0.0,
            "shrinkB": 0.0, "mutation_scale": 9.0}  # fmt: skip
    panel.annotate("", end, start, arrowprops=look, zorder=6)
    panel.update_datalim([start, end])
