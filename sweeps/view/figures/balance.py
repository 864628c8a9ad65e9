"""Shaking forces and moments over the crank angle, and the curve that their vector runs along."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.view.figures.angle_lines import set_cycle
from sweeps.view.figures.marks import DASHES
from sweeps.view.figures.scales import comparable
from sweeps.view.figures.sheet import (
    GREY,
    OWN_ORDINATES,
    Multiples,
    NamedFigures,
    columns_for,
    multiples,
)
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import StudyAxis, View, stem_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

VECTORS = {
    "force": ("reciprocating_force", "shaking_force", "shaking_force_first",
              "shaking_force_second"),
    "moment": ("reciprocating_moment", "shaking_moment", "shaking_moment_first",
               "shaking_moment_second"),
}  # fmt: skip
"""Vectors before and after balancing, and the first two orders of the latter."""
PARTS: dict[str, tuple[str, str, Any]] = {
    "reciprocating_force_first": ("Primary force", "#d1541b", DASHES[1]),
    "reciprocating_force_second": ("Secondary force", "#1b4f9c", DASHES[3]),
    "throw_force": ("Rotating masses", "#2f7d55", DASHES[2]),
    "counterweight_force": ("Counterweights", "#7b2d8b", DASHES[4]),
    "shaking_force": ("Sum with all orders", "#000000", "-"),
}
"""Parts of the shaking force: label, colour and dashes; their sum is drawn with two or more."""

MOST_PANELS = 6

NOTHING = 1e-9  # Fraction of the largest value of a figure below which a value is only rounding

SMALLEST = 1e-6
"""Forces and moments, in N and N m or kN, below which sums that cancel are only rounding."""


Pair = tuple[Floats, Floats]  # Components of a vector along and across cylinder 1, over one turn

Line = tuple[str, Floats, dict[str, Any]]
"""A line: its text in the legend, its ordinates and its look."""

Looks = Mapping[str, tuple[str, dict[str, Any]]]
"""Text of the legend and look of the line of each variable."""

SIDES = ("Along cylinder 1", "Across")


def vector_names(view: View) -> list[str]:
    """Shaking forces and moments that are there with both components."""
    named = dict.fromkeys([*VECTORS["force"], *VECTORS["moment"], *PARTS])
    over = {"crank_angle", "direction"}
    return [name for name in named if view.has(name) and over <= set(view.array(name).dims)]


def shaking(study: Study, vectors: Sequence[str]) -> NamedFigures:
    """Draw them over the crank angle and as hodographs: nominal, and along each axis.

    The parts of the shaking force have a figure of their own.
    """
    yield from _parts(study, [name for name in PARTS if name in vectors])
    for kind, names in VECTORS.items():
        present = [name for name in names if name in vectors]
        if present:
            yield from _vector(study, kind, names, present)


def _vector(study: Study, kind: str, names: Sequence[str], present: Sequence[str]) -> NamedFigures:
    """Figures of the shaking force, or of the moment."""
    base = names[1]
    main = [name for name in names[:2] if name in present] or present
    view = study.view.only(present, ["direction"])
    nothing = _nothing(view, present)
    if not nothing:
        looks = {name: _look(name, names, present) for name in present}
        title = f"Shaking {kind} over one turn" if len(present) > 1 else view.title(present[0])
        yield f"{base}_over_angle", _by_side(view, looks, title)
    varied = [
        (whole, along)
        for whole, along in study.views_by_axis(main)
        if along not in (None, "direction") and whole.varies(main, along)
    ]
    for whole, along in varied:
        view = whole.only(main, [along, "direction"])
        if _nothing(view, main):
            continue
        cases = "_cases" if along == "design" else ""
        drawn = _components_along(view, view.axis(along), main, names, kind)
        yield stem_of(f"{base}_over_angle{cases}", whole, along), drawn
        if _in_a_plane(view, main, along):
            drawn = _hodographs(view, main, names, along, kind)
            yield stem_of(f"{base}_polar{cases}", whole, along), drawn
    if not varied and not nothing and _in_a_plane(view, main, None):
        yield f"{base}_polar", _hodographs(view, main, names, None, kind)


def _parts(study: Study, names: Sequence[str]) -> NamedFigures:
    """Figures of the parts of the shaking force over one turn: nominal, and along each axis."""
    if len(set(names) - {"shaking_force"}) < 2:
        return
    looks = {
        name: (label, {"color": colour, "linestyle": dashes, "linewidth": 1.3})
        for name, (label, colour, dashes) in PARTS.items()
        if name in names
    }
    axes = [(whole, along) for whole, along in study.views_by_axis(names) if along != "direction"]
    for whole, along in axes or [(study.view, None)]:
        view = whole.only(names, [along, "direction"])
        if _nothing(view, names):
            continue
        axis = view.axis(along)
        title = "Components of the shaking force"
        figure = _parts_along(view, axis, looks, title) if axis else _by_side(view, looks, title)
        cases = "_cases" if along == "design" else ""
        yield stem_of(f"shaking_force_parts{cases}", whole, along), figure


def _parts_along(view: View, axis: StudyAxis, looks: Looks, title: str) -> Figure:
    """Parts along cylinder 1, a panel for each value of an axis."""
    drawn = []
    for index in axis.picked(MOST_PANELS):
        lines = _lines(view, looks, {axis.name: index}, 0)
        drawn.append((axis.tag(index) + axis.mark(index), lines))
    sheet = _over_turn(view, drawn, 0.5, 1.75)
    sheet.label_y(_ordinate(view, next(iter(looks))), 1.5)
    notes = [*view.notes(looks), axis.picked_text(MOST_PANELS), SIDES[0].lower()]
    return sheet.finish(axis.by(title), notes, view.caption)


def _by_side(view: View, looks: Looks, title: str) -> Figure:
    """Both components of one design above each other; a note says which one is zero."""
    sides = _sides_of(view, list(looks))
    drawn = [(SIDES[side], _lines(view, looks, {}, side)) for side in sides]
    sheet = _over_turn(view, drawn, 0.3, 2.3, columns=1)
    sheet.label_y(_ordinate(view, next(iter(looks))), 2.0)
    zero = [f"{word.lower()}: zero" for side, word in enumerate(SIDES) if side not in sides]
    return sheet.finish(title, [*view.notes(looks), *zero], view.caption, legend=len(looks) > 1)


def _lines(view: View, looks: Looks, place: Mapping[str, int], side: int) -> list[Line]:
    """Lines of one component of each variable at a place."""
    return [
        (label, _components(view, name, place)[side], look) for name, (label, look) in looks.items()
    ]


def _components_along(
    view: View, axis: StudyAxis, main: Sequence[str], names: Sequence[str], kind: str
) -> Figure:
    """Both components over the angle, a panel for each value of an axis."""
    shown = axis.picked(MOST_PANELS)
    curves = _curves(view, main, [{axis.name: index} for index in shown])
    share = comparable([[np.concatenate(pair) for pair in panel] for panel in curves])
    drawn = []
    for index, pairs in zip(shown, curves, strict=True):
        lines: list[Line] = []
        for name, pair in zip(main, pairs, strict=True):
            label, look = _look(name, names, main)
            for values, word, dashes in zip(pair, SIDES, DASHES[:2], strict=True):
                text = f"{label}, {word.lower()}" if len(main) > 1 else word
                lines.append((text, values, look | {"linestyle": dashes}))
        drawn.append((axis.tag(index) + axis.mark(index), lines))
    sheet = _over_turn(view, drawn, 0.5, 1.75, share=share)
    sheet.label_y(_ordinate(view, main[0]), 1.5)
    notes = [*view.notes(main), axis.picked_text(MOST_PANELS), "" if share else OWN_ORDINATES]
    return sheet.finish(axis.by(f"Shaking {kind}"), notes, view.caption)


def _hodographs(
    view: View, main: Sequence[str], names: Sequence[str], along: str | None, kind: str
) -> Figure:
    """Paths of the vector's tip, a panel for each value of an axis with more than a line."""
    axis = view.axis(along)
    places = [axis.place(index) for index in axis.picked(MOST_PANELS)]
    lines = [p for p in places if all(_is_line(*_components(view, n, p)) for n in main)]
    # A vector that keeps its direction has a straight line as path, which another figure shows: its
    # size over the crank angle.
    places = [p for p in places if p not in lines]
    curves = _curves(view, main, places)
    share = comparable([[np.concatenate(pair) for pair in panel] for panel in curves])
    columns = columns_for(len(places))
    square = min(3.4 if len(places) == 1 else 2.2, 6.0 / columns - 0.2)
    wide = 0.9 + (square + (0.2 if share else 0.6)) * columns
    sheet = multiples(len(places), 0.3, square + 0.35, width=wide, sharex=share, sharey=share)
    start = int(np.argmin(np.abs(_angles(view))))
    for panel, place, pairs in zip(sheet.panels, places, curves, strict=True):
        for name, (up, side) in zip(main, pairs, strict=True):
            label, look = _look(name, names, main)
            (line,) = panel.plot(side, up, **look)
            sheet.entries.setdefault(label, line)
            panel.plot(side[start], up[start], marker="o", color=look["color"], linestyle="none")
        panel.set_title(axis.heading(place))
        _square(panel, [pair for one in (curves if share else [pairs]) for pair in one])
        panel.locator_params(nbins=max(2, int(1.3 * square)))
    unit = view.unit(main[0])
    sheet.label_x(f"{SIDES[1]}{unit}", 6.3 / columns)
    sheet.label_y(f"{SIDES[0]}{unit}", 1.5)
    notes = [*view.notes(main), axis.picked_text(MOST_PANELS), "" if share else OWN_ORDINATES,
             "each curve is the path of the vector's tip; dots at 0°"]  # fmt: skip
    if lines and axis:
        said = ", ".join(axis.tag(place[axis.name]) for place in lines)
        notes.append(f"not drawn, because the vector stays on a line or is zero: {said}")
    title = axis.by(f"Shaking {kind}: hodograph")
    return sheet.finish(title, notes, view.caption, legend=len(main) > 1)


def _over_turn(
    view: View, drawn: Sequence[tuple[str, Sequence[Line]]], base: float, each: float, *,
    columns: int | None = None, share: bool = True,
) -> Multiples:  # fmt: skip
    """Panels over one turn of the crank, each with its title and its lines."""
    sheet = multiples(len(drawn), base, each, columns=columns, sharex=True, sharey=share)
    x = _angles(view)
    for panel, (title, lines) in zip(sheet.panels, drawn, strict=True):
        for label, values, look in lines:
            (line,) = panel.plot(x, values, **look)
            sheet.entries.setdefault(label, line)
        panel.set_title(title)
    set_cycle(sheet.panels, view, 6.3 / sheet.columns, sheet.lowest, one_turn=True)
    return sheet


def _sides_of(view: View, names: Sequence[str]) -> list[int]:
    """Sides on which a vector acts: along cylinder 1, across it."""
    pairs = [_components(view, name, {}) for name in names]
    sizes = [max(float(np.nanmax(np.abs(p[k]), initial=0.0)) for p in pairs) for k in (0, 1)]
    return [k for k in (0, 1) if sizes[k] > NOTHING * max(sizes)]


def _nothing(view: View, names: Sequence[str]) -> bool:
    """Whether all values are zero, but for rounding."""
    return all(np.nanmax(np.abs(view.numbers(n)), initial=0.0) < SMALLEST for n in names)


def _in_a_plane(view: View, main: Sequence[str], along: str | None) -> bool:
    """Whether some curve of the vector is more than a line to and fro."""
    axis = view.axis(along)
    return any(
        not _is_line(*_components(view, name, axis.place(index)))
        for index in axis.picked(MOST_PANELS)
        for name in main
    )


def _is_line(up: Floats, side: Floats) -> bool:
    """Whether a vector moves along one line, or not at all."""
    both = np.stack([up, side])
    both = both[:, np.isfinite(both).all(axis=0)]
    if not both.size or np.abs(both).max() < SMALLEST:
        return True
    sizes = np.linalg.svd(both, compute_uv=False)
    # The ratio of the singular values separates a line from a loop.
    return bool(sizes[1] < 1e-3 * sizes[0])


def _components(view: View, name: str, index: Mapping[str, int]) -> Pair:
    """Components along and across over one turn, closed by the first point."""
    array = view.at(name, index).transpose("direction", "crank_angle")
    along, across = np.asarray(array.values, dtype=float)
    return np.append(along, along[0]), np.append(across, across[0])


def _curves(
    view: View, names: Sequence[str], places: Sequence[Mapping[str, int]]
) -> list[list[Pair]]:
    """Components of each variable at each place, without values that are rounding."""
    return _without_rounding([[_components(view, n, place) for n in names] for place in places])


def _angles(view: View) -> Floats:
    degrees = view.numbers("crank_angle")
    return np.append(degrees, 2.0 * degrees[-1] - degrees[-2] + 0.0)


def _look(name: str, names: Sequence[str], present: Sequence[str]) -> tuple[str, dict[str, Any]]:
    """Label and look of a vector, by its place among `names`; lightness differs as well as hue."""
    label, exact, colour, dashes, width = (
        ("Reciprocating masses alone", "", "#9a9a9a", "-", 1.6),
        ("After balancing", "Exact", "#000000", "-", 1.6),
        ("First order after balancing", "First order", "#d1541b", DASHES[1], 1.2),
        ("Second order after balancing", "Second order", "#1b4f9c", DASHES[3], 1.4),
    )[names.index(name)]
    look = {"color": colour, "linestyle": dashes, "linewidth": width}
    return label if names[0] in present else exact, look


def _ordinate(view: View, name: str) -> str:
    word = "Moment" if name.split("_")[1] == "moment" else "Force"
    return word + view.unit(name)


def _without_rounding(curves: list[list[Pair]]) -> list[list[Pair]]:
    """Curves with zeros for values that are rounding, by the largest value of all curves."""
    sizes = [np.nanmax(np.abs(v), initial=0.0) for panel in curves for pair in panel for v in pair]
    least = NOTHING * max(sizes)

    def clean(values: Floats) -> Floats:
        return np.where(np.abs(values) < least, 0.0, values)

    return [[(clean(up), clean(side)) for up, side in panel] for panel in curves]


def _square(panel: Axes, curves: Sequence[Pair]) -> None:
    """Give both axes equal scales, with the origin in the middle."""
    known = [np.abs(values[np.isfinite(values)]) for pair in curves for values in pair]
    most = max((float(values.max()) for values in known if values.size), default=1.0) or 1.0
    panel.set_xlim(-1.08 * most, 1.08 * most)
    panel.set_ylim(-1.08 * most, 1.08 * most)
    panel.set_aspect("equal", adjustable="box")
    for line in (panel.axhline, panel.axvline):
        line(0.0, color=GREY, linewidth=0.6, zorder=0.5)
