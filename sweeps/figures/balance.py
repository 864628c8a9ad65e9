"""Shaking forces and moments over the crank angle, and the curve that their vector runs along."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.figures.marks import DASHES
from sweeps.figures.scales import comparable, crank_axis, left_labels, x_label, y_label
from sweeps.figures.sheet import (
    GREY,
    OWN_ORDINATES,
    WIDTH,
    Entries,
    NamedFigures,
    bare_panels,
    finish,
    grid_of,
    lowest_panels,
    new_sheet,
)
from sweeps.figures.study import Study
from sweeps.figures.views import View, key_text, pick, picked_text, stem_of
from sweeps.figures.wording import title_of, unit_in_brackets

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["shaking", "vector_names"]

VECTORS = {
    "force": ("reciprocating_force", "shaking_force", "shaking_force_first",
              "shaking_force_second"),
    "moment": ("reciprocating_moment", "shaking_moment", "shaking_moment_first",
               "shaking_moment_second"),
}  # fmt: skip
"""Before balancing, after it, and its first two orders."""
PARTS = (
    ("reciprocating_force_first", "Primary force", "#d1541b", DASHES[1]),
    ("reciprocating_force_second", "Secondary force", "#1b4f9c", DASHES[3]),
    ("throw_force", "Rotating masses", "#2f7d55", DASHES[2]),
    ("counterweight_force", "Counterweights", "#7b2d8b", DASHES[4]),
    ("shaking_force", "Sum with all orders", "#000000", "-"),
)  # fmt: skip
"""What the shaking force is made of: variable, label, colour and dashes; the sum is drawn with two
others."""

MOST_PANELS = 6

LOOKS: tuple[tuple[str, Any, float], ...] = (
    ("#9a9a9a", "-", 1.6),
    ("#000000", "-", 1.6),
    ("#d1541b", DASHES[1], 1.2),
    ("#1b4f9c", DASHES[3], 1.4),
)
"""Colour, dashes and width; lightness differs as well as hue."""

LABELS = ("Reciprocating masses alone", "After balancing", "First order after balancing",
          "Second order after balancing")  # fmt: skip
ALONE = ("Reciprocating masses alone", "Exact", "First order", "Second order")
"""Labels of a figure without the reciprocating masses alone."""

NOTHING = 1e-9
"""Fraction of the largest value of a figure below which a value is rounding."""

SMALLEST = 1e-6
"""N or N m, and kN; less is rounding of sums that cancel."""

LINE = 1e-3
"""Second singular value of a curve over its first, below which it is a line."""

Pair = tuple[Floats, Floats]

SIDES = ("Along cylinder 1", "Across")


def vector_names(view: View) -> list[str]:
    """Shaking forces and moments that are there with both components."""
    named = [*(name for names in VECTORS.values() for name in names), *(row[0] for row in PARTS)]
    return [name for name in dict.fromkeys(named) if _is_vector(view, name)]


def shaking(study: Study, vectors: Sequence[str]) -> NamedFigures:
    """Draw them over the crank angle and as hodographs: nominal, and along each axis.

    The parts of the shaking force have a figure of their own.
    """
    yield from _apart(study, [name for name, *_ in PARTS if name in vectors])
    for kind, names in VECTORS.items():
        present = [name for name in names if name in vectors]
        if not present:
            continue
        main = [name for name in names[:2] if name in present] or present
        view = study.view.only(present, ["direction"])
        axes = [(whole, axis) for whole, axis in study.along(main) if axis != "direction"]
        varied = [(w, axis) for w, axis in axes if axis is not None and w.varies(main, axis)]
        nothing = _nothing(view, present)
        if not nothing:
            yield f"{names[1]}_over_angle", _over_angle(view, present, names)
        for whole, along in varied:
            if _nothing(whole.only(main, [along, "direction"]), main):
                continue
            cases = "_cases" if along == "design" else ""
            yield (
                stem_of(f"{names[1]}_over_angle{cases}", whole, along),
                _each(whole, main, names, along, kind, hodograph=False),
            )
            if _in_a_plane(whole, main, along):
                yield (
                    stem_of(f"{names[1]}_polar{cases}", whole, along),
                    _each(whole, main, names, along, kind, hodograph=True),
                )
        if not varied and not nothing and _in_a_plane(view, main, None):
            yield f"{names[1]}_polar", _each(view, main, names, None, kind, hodograph=True)


def _apart(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the parts of the shaking force over one turn: nominal, and along each axis."""
    if len(set(names) - {"shaking_force"}) < 2:
        return
    axes = [(whole, along) for whole, along in study.along(names) if along != "direction"]
    for whole, along in axes or [(study.view, None)]:
        if _nothing(whole.only(names, [along, "direction"]), names):
            continue
        view = whole.only(names, [along, "direction"])
        axis = view.axis(along) if along else None
        places = _places(whole, along)
        rows, columns = grid_of(len(places))
        sides = [0] if len(places) > 1 else _sides_of(view, names)
        if len(places) == 1:
            rows, columns = len(sides), 1
        height = 0.5 + (1.75 if axis else 2.3) * rows
        figure, panels = new_sheet(rows, columns, height, sharex=True, sharey=True)
        entries: Entries = {}
        drawn = [(place, side) for place in places for side in sides]
        for panel, (place, side) in zip(panels, drawn, strict=False):
            for name, label, colour, dashes in PARTS:
                if name in names:
                    values = _components(view, name, place)[side]
                    look: dict[str, Any] = {"color": colour, "linestyle": dashes, "linewidth": 1.3}
                    (line,) = panel.plot(_angles(view), values, **look)
                    entries.setdefault(label, line)
            panel.set_title(axis.tag(place[axis.name]) if axis else SIDES[side])
        bare_panels(panels, len(drawn), columns)
        lowest = lowest_panels(panels, len(drawn), columns)
        for panel in panels[: len(drawn)]:
            _one_turn(panel, view, 6.3 / columns, panel in lowest)
        left_labels(panels, columns, _ordinate(view, names[0]), 1.5 if axis else 2.0)
        title = "Components of the shaking force"
        notes = [*view.notes(names), picked_text(axis, MOST_PANELS)]
        notes.append(f"{SIDES[0].lower()}" if axis else "")
        cases = "_cases" if along == "design" else ""
        yield (
            stem_of(f"shaking_force_parts{cases}", whole, along),
            finish(
                figure, f"{title} by {key_text(axis)}" if axis else title, notes, entries,
                caption=view.caption, below=True, spare=panels[len(drawn) :],
            ),
        )  # fmt: skip


def _sides_of(view: View, names: Sequence[str]) -> list[int]:
    """Sides on which something acts: along cylinder 1, across it."""
    pairs = [_components(view, name, {}) for name in names]
    sizes = [max(float(np.nanmax(np.abs(p[k]), initial=0.0)) for p in pairs) for k in (0, 1)]
    return [k for k in (0, 1) if sizes[k] > NOTHING * max(sizes)]


def _nothing(view: View, names: Sequence[str]) -> bool:
    """Whether all of it is zero, but for rounding."""
    known = [np.asarray(view.array(name).values, dtype=float) for name in names]
    return all(np.nanmax(np.abs(values), initial=0.0) < SMALLEST for values in known)


def _in_a_plane(whole: View, main: Sequence[str], along: str | None) -> bool:
    """Whether some curve of the vector is more than a line to and fro."""
    return any(
        not _is_line(*_components(whole.only(main, [along, "direction"]), name, place))
        for place in _places(whole, along)
        for name in main
    )


def _places(whole: View, along: str | None) -> list[dict[str, int]]:
    """Values of an axis that get a panel each."""
    if along is None:
        return [{}]
    axis = whole.axis(along)
    return [{along: index} for index in pick(axis.size, MOST_PANELS, axis.nominal)]


def _is_line(up: Floats, side: Floats) -> bool:
    """Whether a vector moves along one line, or not at all."""
    both = np.stack([up, side])
    both = both[:, np.isfinite(both).all(axis=0)]
    if not both.size or np.abs(both).max() < SMALLEST:
        return True
    sizes = np.linalg.svd(both, compute_uv=False)
    return bool(sizes[1] < LINE * sizes[0])


def _is_vector(view: View, name: str) -> bool:
    return view.has(name) and {"crank_angle", "direction"} <= set(view.array(name).dims)


def _components(view: View, name: str, index: Mapping[str, int]) -> tuple[Floats, Floats]:
    """Components along and across over one turn, closed by the first point."""
    array = view.array(name)
    array = array.isel({d: i for d, i in index.items() if d in array.dims})
    values = np.asarray(array.transpose("direction", "crank_angle").values, dtype=float)
    return np.append(values[0], values[0][0]), np.append(values[1], values[1][0])


def _angles(view: View) -> Floats:
    degrees = np.asarray(view.array("crank_angle").values, dtype=float)
    return np.append(degrees, 2.0 * degrees[-1] - degrees[-2] + 0.0)


def _look(name: str, names: Sequence[str], present: Sequence[str]) -> tuple[str, dict[str, Any]]:
    place = names.index(name)
    colour, dashes, width = LOOKS[place]
    labels = LABELS if names[0] in present else ALONE
    return labels[place], {"color": colour, "linestyle": dashes, "linewidth": width}


def _one_turn(panel: Axes, view: View, room: float, named: bool) -> None:
    low, high = float(_angles(view)[0]), float(_angles(view)[-1])
    panel.set_xlim(*((0.0, 360.0) if high - low > 360.0 else (low, high)))
    crank_axis(panel, view.array("crank_angle"), room, named=named)


def _over_angle(view: View, present: Sequence[str], names: Sequence[str]) -> Figure:
    """Both components of one design above each other; one that is zero is said."""
    pairs = {name: _components(view, name, {}) for name in present}
    sizes = [
        max(float(np.nanmax(np.abs(p[k]), initial=0.0)) for p in pairs.values()) for k in (0, 1)
    ]
    sides = [k for k in (0, 1) if sizes[k] > NOTHING * max(sizes)]
    figure, panels = new_sheet(len(sides), 1, 0.3 + 2.3 * len(sides), sharex=True, sharey=True)
    entries: Entries = {}
    x = _angles(view)
    for name in present:
        label, style = _look(name, names, present)
        for panel, side in zip(panels, sides, strict=True):
            (line,) = panel.plot(x, pairs[name][side], **style)
            entries.setdefault(label, line)
    zero = "" if len(sides) == 2 else f"{SIDES[1 - sides[0]].lower()}: zero"
    for panel, side in zip(panels, sides, strict=True):
        panel.set_title(SIDES[side])
        y_label(panel, _ordinate(view, present[0]), 2.0)
        _one_turn(panel, view, 4.6, panel is panels[-1])
    title = title_of(view.array(present[-1 if len(present) == 1 else 0]), present[0])
    what = "Shaking force" if names[0].endswith("force") else "Shaking moment"
    return finish(
        figure, f"{what} over one turn" if len(present) > 1 else title,
        [*view.notes(present), zero],
        entries if len(present) > 1 else None, caption=view.caption, below=True,
    )  # fmt: skip


def _ordinate(view: View, name: str) -> str:
    word = "Moment" if name.split("_")[1] == "moment" else "Force"
    return word + unit_in_brackets(view.array(name))


def _each(
    whole: View, main: Sequence[str], names: Sequence[str], along: str | None, kind: str, *,
    hodograph: bool,
) -> Figure:  # fmt: skip
    """A panel for each value of an axis: components over the angle, or the vector's curve."""
    view = whole.only(main, [along, "direction"])
    axis = view.axis(along) if along else None
    place = _places(whole, along)
    lines = [p for p in place if all(_is_line(*_components(view, n, p)) for n in main)]
    if hodograph:  # what moves along a line is read off the curves over the angle
        place = [p for p in place if p not in lines]
    picked = [p[along] if along else 0 for p in place]
    rows, columns = grid_of(len(picked))
    curves = _without_rounding([[_components(view, name, here) for name in main] for here in place])
    share = comparable([[np.concatenate(pair) for pair in panel] for panel in curves])
    together = share or not hodograph
    square = min(3.4 if len(picked) == 1 else 2.2, 6.0 / columns - 0.2)
    height = (square + 0.35) * rows + 0.3 if hodograph else 0.5 + 1.75 * rows
    wide = 0.9 + (square + (0.2 if share else 0.6)) * columns if hodograph else WIDTH
    figure, panels = new_sheet(rows, columns, height, width=wide, sharex=together, sharey=share)
    entries: Entries = {}
    for panel, index, pairs in zip(panels, picked, curves, strict=False):
        for name, (up, side) in zip(main, pairs, strict=True):
            label, style = _look(name, names, main)
            if hodograph:
                _hodograph(panel, up, side, label, style, view, entries)
                continue
            x = _angles(view)
            for values, word, dashes in ((up, SIDES[0], "-"), (side, SIDES[1], DASHES[1])):
                (line,) = panel.plot(x, values, **{**style, "linestyle": dashes})
                entries.setdefault(f"{label}, {word.lower()}" if len(main) > 1 else word, line)
        if axis is not None:
            nominal = " (nominal)" if index == axis.nominal else ""
            panel.set_title(axis.tag(index) + nominal)
        if hodograph:
            _square(panel, [c for one in (curves if share else [pairs]) for c in one])
            panel.locator_params(nbins=max(2, int(1.3 * square)))
    bare_panels(panels, len(picked), columns)
    lowest = lowest_panels(panels, len(picked), columns)
    room = 6.3 / columns
    for panel in panels[: len(picked)]:
        if not hodograph:
            _one_turn(panel, view, room, panel in lowest)
        elif panel in lowest:
            x_label(panel, f"Across{unit_in_brackets(view.array(main[0]))}", room)
    text = _ordinate(view, main[0])
    if hodograph:
        text = f"Along cylinder 1{unit_in_brackets(view.array(main[0]))}"
    left_labels(panels, columns, text, 1.5)
    notes = [*view.notes(main), picked_text(axis, MOST_PANELS), "" if share else OWN_ORDINATES]
    if hodograph:
        notes.append("each curve is the path of the vector's tip; dots at 0°")
        if lines and axis:
            said = ", ".join(axis.tag(p[axis.name]) for p in lines)
            notes.append(f"not drawn, because the vector stays on a line or is zero: {said}")
    title = f"Shaking {kind}" + (": hodograph" if hodograph else "")
    return finish(
        figure, f"{title} by {key_text(axis)}" if axis else title, notes,
        {} if hodograph and len(main) == 1 else entries, caption=view.caption, below=True,
        spare=panels[len(picked) :],
    )  # fmt: skip


def _without_rounding(curves: list[list[Pair]]) -> list[list[Pair]]:
    """The same with zeros in place of what is rounding beside the largest of all."""
    sizes = [np.nanmax(np.abs(v), initial=0.0) for panel in curves for pair in panel for v in pair]
    least = NOTHING * max(sizes)

    def clean(values: Floats) -> Floats:
        return np.where(np.abs(values) < least, 0.0, values)

    return [[(clean(up), clean(side)) for up, side in panel] for panel in curves]


def _hodograph(
    panel: Axes, up: Floats, side: Floats, label: str, style: dict[str, Any], view: View,
    entries: Entries,
) -> None:  # fmt: skip
    (line,) = panel.plot(side, up, **style)
    entries.setdefault(label, line)
    start = int(np.argmin(np.abs(_angles(view))))
    panel.plot(side[start], up[start], marker="o", color=style["color"], linestyle="none")


def _square(panel: Axes, curves: Sequence[tuple[Floats, Floats]]) -> None:
    """Equal scales on both axes, with the origin in the middle."""
    known = [np.abs(values[np.isfinite(values)]) for pair in curves for values in pair]
    most = max((float(values.max()) for values in known if values.size), default=1.0) or 1.0
    panel.set_xlim(-1.08 * most, 1.08 * most)
    panel.set_ylim(-1.08 * most, 1.08 * most)
    panel.set_aspect("equal", adjustable="box")
    for line in (panel.axhline, panel.axvline):
        line(0.0, color=GREY, linewidth=0.6, zorder=0.5)
