"""Several variables of one kind in one panel: forces of the mechanism and the like."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.view.figures.multiples import multiples
from sweeps.view.figures.scales import comparable
from sweeps.view.figures.sheet import OWN_ORDINATES, Entries, NamedFigures
from sweeps.view.figures.study import Study
from sweeps.view.figures.traces import draw_lines, over_angle, set_cycle, trace
from sweeps.view.figures.views import View, stem_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_PANELS = 6

GROUPS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "piston_forces": (
        "Forces on the piston", "Force", ("gas_force", "inertia_force", "piston_force")
    ),
    "rod_loads": (
        "Rod loads", "Load, compression positive",
        ("gas_force", "crosshead_inertia_load", "combined_rod_load"),
    ),
    "mechanism_forces": (
        "Forces of the mechanism", "Force",
        ("wall_thrust", "rod_force", "tangential_force", "radial_force"),
    ),
    "mechanism_pressures": (
        "Forces of the mechanism over piston area", "Reduced force",
        ("piston_pressure", "wall_pressure", "rod_pressure", "tangential_pressure",
         "radial_pressure"),
    ),
    "shortened_acceleration": (
        "Acceleration, exact and by the truncated series,", "Reduced acceleration",
        ("acceleration", "acceleration_truncated"),
    ),
    **{
        f"{name}_parts": (
            f"{title} of gas and masses", "Force", (f"gas_{name}", f"inertia_{name}", name)
        )
        for name, title in (
            ("wall_thrust", "Wall thrust"), ("rod_force", "Rod force"),
            ("tangential_force", "Tangential force"), ("radial_force", "Radial force"),
        )
    },
    **{
        f"{name}_pressure_parts": (
            f"{title} of gas and masses over piston area", "Reduced force",
            (f"gas_{name}_pressure", f"inertia_{name}_pressure", f"{name}_pressure"),
        )
        for name, title in (
            ("piston", "Forces"), ("wall", "Wall thrust"), ("rod", "Rod force"),
            ("tangential", "Tangential force"), ("radial", "Radial force"),
        )
    },
}  # fmt: skip
"""What is drawn in one panel: file, title, ordinate and variables."""

REVERSING = ("combined_rod_load",)
"""Loads whose reversal is marked."""


def grouped_names(view: View) -> list[str]:
    """Variables of which at least two of one group are there."""
    return [name for stem in GROUPS for name in _members(view, stem)]


def groups(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw each group of which at least two variables are there, along each axis."""
    for stem, (title, ordinate, _) in GROUPS.items():
        members = _members(study.view, stem)
        for whole, along in study.views_by_axis(members) if members else ():
            if along is None or whole.varies(members, along):
                figure = together(whole, members, along, title, ordinate)
                yield stem_of(stem, whole, along), figure


def _members(view: View, stem: str) -> list[str]:
    names = [name for name in GROUPS[stem][2] if over_angle(view, name)]
    return names if len(names) > 1 else []


def together(
    whole: View, names: Sequence[str], along: str | None, title: str, ordinate: str,
    look: Callable[[str], dict[str, Any]] | None = None,
) -> Figure:  # fmt: skip
    """Several variables over the crank angle in one panel, or in one for each value of an axis."""
    view = whole.only(names, [along])
    axis = view.axis(along)
    places = [axis.place(index) for index in axis.picked(MOST_PANELS)]
    curves = [name for name in names if over_angle(view, name)]
    share = comparable([[trace(view, name, place)[1] for name in curves] for place in places])
    base, each = (0.5, 1.75) if axis else (3.3, 0.0)
    sheet = multiples(len(places), base, each, sharex=True, sharey=share)
    for panel, place in zip(sheet.panels, places, strict=True):
        draw_lines(panel, view, names, place, sheet.entries, look)
        for name in REVERSING:
            if name in curves:
                _shade_reversal(panel, view.title(name), trace(view, name, place), sheet.entries)
        panel.set_title(axis.heading(place))
    set_cycle(sheet.panels, view, (6.3 if axis else 4.6) / sheet.columns, sheet.lowest)
    sheet.label_y(ordinate + view.unit(names[0]), 1.5 if axis else 2.8)
    notes = [*view.notes(names), axis.picked_text(MOST_PANELS), "" if share else OWN_ORDINATES]
    return sheet.finish(axis.by(title), notes, view.caption, below=bool(axis))


def _shade_reversal(
    panel: Axes, title: str, curve: tuple[Floats, Floats, str], entries: Entries
) -> None:
    """Shade the angles at which a load has the direction that it has for fewer of them."""
    x, load, _ = curve
    pushing = load > 0.0
    if pushing.all() or not pushing.any():
        return
    reversed_there = pushing if pushing[:-1].mean() < 0.5 else ~pushing
    entries[f"{title}: reversed"] = panel.fill_between(
        x, 0.0, np.where(reversed_there, load, 0.0), color="#d9d9d9", linewidth=0.0, zorder=0
    )
