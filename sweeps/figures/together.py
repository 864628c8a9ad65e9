"""Several variables of one kind in one panel: forces of the mechanism and the like."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from sweeps.figures.marks import line_style, lost_handle, mark_lost
from sweeps.figures.scales import comparable, left_labels
from sweeps.figures.sheet import (
    OWN_ORDINATES,
    Entries,
    NamedFigures,
    bare_panels,
    finish,
    grid_of,
    lowest_panels,
    new_sheet,
)
from sweeps.figures.study import Study
from sweeps.figures.traces import over_angle, set_cycle, trace
from sweeps.figures.views import View, key_text, pick, picked_text, stem_of
from sweeps.figures.wording import title_of, unit_in_brackets

if TYPE_CHECKING:
    from matplotlib.axes import Axes


GROUPS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "piston_forces": (
        "Forces on the piston", "Force", ("gas_force", "inertia_force", "piston_force")
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
        f"{name}_parts": (
            f"{title} of gas and masses over piston area", "Reduced force",
            (f"gas_{name}", f"inertia_{name}", name),
        )
        for name, title in (
            ("piston_pressure", "Forces"), ("wall_pressure", "Wall thrust"),
            ("rod_pressure", "Rod force"), ("tangential_pressure", "Tangential force"),
            ("radial_pressure", "Radial force"),
        )
    },
}  # fmt: skip
"""What is drawn in one panel: file, title, ordinate and variables."""


def grouped_names(view: View) -> list[str]:
    """Variables of which at least two of one group are there."""
    return [name for stem in GROUPS for name in _members(view, stem)]


def groups(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw each group of which at least two variables are there."""
    for stem, (title, ordinate, _) in GROUPS.items():
        members = _members(study.view, stem)
        if members:
            yield from _group_figures(study, stem, title, ordinate, members)


def _members(view: View, stem: str) -> list[str]:
    names = [name for name in GROUPS[stem][2] if over_angle(view, name)]
    return names if len(names) > 1 else []


def _group_figures(
    study: Study, stem: str, title: str, ordinate: str, names: Sequence[str]
) -> NamedFigures:
    """Several variables in one panel, and in small multiples along each axis."""
    for whole, along in study.along(names):
        if along is not None and not whole.varies(names, along):
            continue
        view = whole.only(names, [along])
        axis = view.axis(along) if along else None
        picked = pick(axis.size, 6, axis.nominal) if axis else [0]
        rows, columns = grid_of(len(picked))
        places = [{along: index} if along else {} for index in picked]
        share = comparable([[trace(view, n, place)[1] for n in names] for place in places])
        height = 0.5 + 1.75 * rows if axis else 3.3
        figure, panels = new_sheet(rows, columns, height, sharex=True, sharey=share)
        entries: Entries = {}
        for panel, place in zip(panels, places, strict=False):
            _lines(panel, view, names, place, entries)
            if axis:
                panel.set_title(axis.tag(place[axis.name]))
        bare_panels(panels, len(picked), columns)
        lowest = lowest_panels(panels, len(picked), columns)
        set_cycle(panels[: len(picked)], view, (6.3 if axis else 4.6) / columns, lowest)
        label = ordinate + unit_in_brackets(view.array(names[0]))
        left_labels(panels, columns, label, 1.5 if axis else 2.8)
        notes = [*view.notes(names), picked_text(axis, 6), "" if share else OWN_ORDINATES]
        yield (
            stem_of(stem, view, along),
            finish(
                figure, f"{title} by {key_text(axis)}" if axis else title, notes, entries,
                caption=view.caption, below=axis is not None, spare=panels[len(picked) :],
            ),
        )  # fmt: skip


def _lines(
    panel: Axes, view: View, names: Sequence[str], place: Mapping[str, int], entries: Entries
) -> None:
    for rank, name in enumerate(names):
        x, y, lost = trace(view, name, place)
        style = line_style(rank, len(names)) | {"marker": ""}
        label = title_of(view.array(name), name)
        if lost:
            mark_lost(panel, lost, style["color"], rank)
            entries.setdefault(f"{label}: {lost}", lost_handle(lost, style["color"]))
        else:
            (line,) = panel.plot(x, y, **style)
            entries.setdefault(label, line)
