"""Lines over the crank angle: closed curves, and the axis below them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn import status as outcome
from engine_dyn.types import Floats
from sweeps.base.dimensions import COUNTED
from sweeps.view.figures.marks import line_style, lost_handle, mark_lost, target_lines
from sweeps.view.figures.scales import crank_axis, set_log
from sweeps.view.figures.sheet import WIDTH, Entries, multiples, no_ordinate, rc, y_label
from sweeps.view.figures.views import FROM_SPEED, NO_VALUE, StudyAxis, View
from sweeps.view.figures.wording import with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FRICTION = "friction_torque"


def over_angle(view: View, name: str) -> bool:
    """Whether there is a variable of this name over the crank angle."""
    return view.has(name) and "crank_angle" in view.array(name).dims


def trace(view: View, name: str, index: Mapping[str, int]) -> tuple[Floats, Floats, str]:
    """One curve over the crank angle: abscissa, ordinate, and the outcome if there is no curve.

    It is closed by its first point. A design that is computed for a number of passes from a
    starting angle is not periodic: there the gap between end and start stays open.
    """
    array = view.at(name, index)
    if "crank_angle" not in array.dims:  # A value without crank angle is the same at every angle
        x, y = view.numbers("crank_angle")[[0, -1]], np.full(2, float(array.values))
        return x, y, "" if np.isfinite(y[0]) else str(view.outcomes(name, array, index))
    x = np.asarray(view.data.variables.get("crank_angle", np.arange(array.size)), dtype=float)
    y = np.asarray(array.values, dtype=float)
    if not np.isfinite(y).any():
        return x, y, str(view.outcomes(name, array, index)[0]) if y.size else NO_VALUE
    if x.size < 3:
        return x, y, ""
    zero = float(view.array("crank_angle").attrs.get("zero_at", 0.0)) if x.size else 0.0
    period = round((x[-1] - x[0]) + (x[1] - x[0]), 6)
    if period % 360 == 0:
        x, y = np.append(x, x[0] + period), np.append(y, y[0])
        start = _start_angle(view, index) if name.startswith(FROM_SPEED) else None
        if start is not None:
            place = int(np.searchsorted(x, (start - zero - x[0]) % period + x[0]))
            if 0 < place < x.size - 1:
                x, y = np.insert(x, place, x[place]), np.insert(y, place, np.nan)
    return x, y, ""


def _start_angle(view: View, index: Mapping[str, int]) -> float | None:
    """Angle at which a curve begins that was not solved as a closed cycle."""
    values = []
    for name in ("status", "start_angle"):
        if name not in view.data.variables:
            return None
        array = view.at(name, index)
        if array.ndim or not np.isfinite(float(array.values)):
            return None
        values.append(float(array.values))
    return values[1] if values[0] == outcome.PASSES_DONE else None


def draw_curves(
    axes: Axes, view: View, name: str, axis: StudyAxis, fixed: Mapping[str, int] | None = None,
    entries: Entries | None = None, change: Callable[[Floats], Floats] | None = None,
    log: bool = False,
) -> list[Floats]:  # fmt: skip
    """Lines of one variable, one for each picked value of an axis; the ordinates are returned.

    They are of the slice at `fixed`, after a `change`, and over a logarithmic ordinate if `log`.
    """
    fixed, entries = fixed or {}, {} if entries is None else entries
    places = axis.picked()
    drawn = []
    cell = axes.get_subplotspec()
    width = WIDTH / (cell.get_gridspec().ncols if cell else 1)
    for rank, index in enumerate(places):
        place = {**fixed, **axis.place(index)}
        x, y, lost = trace(view, name, place)
        nominal = axis.mark(index)
        text = (axis.text(index) if axis else view.title(name)) + nominal
        style = line_style(rank, len(places), bool(nominal))
        if not (lost or fixed):
            text += _rms_text(view, name, place)
        if lost == NO_VALUE and {*COUNTED} & set(view.array(name).dims):
            continue  # The engine has no such part: arrays have room for engines with more parts
        if len(places) == 1:
            style["marker"] = ""
        if x.size > 40:
            step = max(x.size // (8 if width > 3 else 4), 1)
            style["markevery"] = (rank * step // len(places) + step // 16, step)
        shown = change(y) if change and not lost else y
        line_or_mark(axes, (x, shown, lost), style, text, rank, entries)
        if not lost:
            drawn.append(y)
    if not drawn:
        no_ordinate(axes)
    elif change is None:
        target_lines(axes, view, [name], entries)
    if log:
        set_log(axes, "y")
    axes.set_xlim(*_cycle(view))
    return drawn


def draw_lines(
    panel: Axes, entries: Entries, view: View, names: Sequence[str], index: Mapping[str, int],
    look: Callable[[str], dict[str, Any]] | None = None,
) -> None:  # fmt: skip
    """Lines of several variables, in their own looks or told apart by their rank.

    Friction, which is positive, is drawn as it acts: against the rotation.
    """
    for rank, name in enumerate(names):
        x, y, lost = trace(view, name, index)
        style = look(name) if look else line_style(rank, len(names)) | {"marker": ""}
        label = view.title(name)
        if name == FRICTION:
            label, y = f"\N{MINUS SIGN}{label}", -y
        line_or_mark(panel, (x, y, lost), style, label, rank, entries)


def line_or_mark(
    panel: Axes, curve: tuple[Floats, Floats, str], style: dict[str, Any], text: str, rank: int,
    entries: Entries,
) -> None:  # fmt: skip
    """Draw a curve of `trace`, or a mark in the corner that says why there is none."""
    x, y, lost = curve
    if lost:
        mark_lost(panel, lost, style["color"], rank)
        entries.setdefault(f"{text}: {lost}", lost_handle(lost, style["color"]))
    else:
        (line,) = panel.plot(x, y, **style)
        entries.setdefault(text, line)


def torque_look(name: str) -> dict[str, Any]:
    """Colour, dashes and width of each torque, the same in all figures."""
    # Lightness differs as well as hue; the colour that is empty is that of text.
    torques = {
        "torque": ("", "-", 1.6),
        "gas_torque": ("#d1541b", (0, (6, 1.5)), 1.2),
        "inertia_torque": ("#1b4f9c", (0, (4, 1.2, 1, 1.2)), 1.2),
        FRICTION: ("#c79a1e", (0, (1.2, 1)), 1.4),
        "load_torque": ("#2f7d55", (0, (3, 1, 1, 1, 1, 1)), 1.6),
    }
    colour, dashes, width = torques[name]
    return {"color": colour or rc("text.color"), "linestyle": dashes, "linewidth": width}


def _rms_text(view: View, name: str, place: Mapping[str, int]) -> str:
    """Text of the root mean square of a curve, where the archive has it."""
    if not view.has(name + "_rms"):
        return ""
    array = view.at(name + "_rms", place)
    if array.ndim or not np.isfinite(float(array.values)):
        return ""
    return f", rms {with_unit(array, float(array.values))}"


def _cycle(view: View) -> tuple[float, float]:
    """First and last angle of the cycle; the last point equals the first."""
    degrees = view.numbers("crank_angle")
    step = degrees[1] - degrees[0] if degrees.size > 1 else 0.0
    return float(degrees[0]), float(degrees[-1] + step)


def set_cycle(
    panels: Iterable[Axes], view: View, room: float, lowest: Sequence[Axes], one_turn: bool = False
) -> None:
    """The whole cycle on each panel, or one turn where the second is the same, named below."""
    low, high = _cycle(view)
    limits = (0.0, 360.0) if one_turn and high - low > 360.0 else (low, high)
    for panel in panels:
        panel.set_xlim(*limits)
        crank_axis(panel, view.array("crank_angle"), room, named=panel in lowest)


@dataclass(frozen=True)
class AnglePanel:
    """A panel over the crank angle: what draws its lines, its own ordinate, and its title."""

    draw: Callable[..., object]
    ordinate: str = ""
    title: str = ""


def angle_figure(
    view: View, panels: Sequence[AnglePanel], title: str, notes: Iterable[str], *,
    size: tuple[float, float], room: float, columns: int | None = None, share: bool | str = False,
    ordinate: str = "", tall: float = 0.0, one_turn: bool = False, **around: Any,
) -> Figure:  # fmt: skip
    """Draw panels, by rows, that share the crank angle.

    `size` are the inches of height without the rows and of each row, `room` those of the width of
    a row, `tall` those of a panel for the label of its ordinate; `ordinate` labels the first
    column where panels have no label of their own. `around` goes to `Multiples.finish`.
    """
    sheet = multiples(len(panels), *size, columns=columns, sharex=True, sharey=share)
    for panel, content in zip(sheet.panels, panels, strict=True):
        content.draw(panel, entries=sheet.entries)
        if content.title:
            panel.set_title(content.title)
        if content.ordinate:
            y_label(panel, content.ordinate, tall)
    set_cycle(sheet.panels, view, room / sheet.columns, sheet.lowest, one_turn)
    if ordinate:
        sheet.label_y(ordinate, tall)
    return sheet.finish(title, notes, view.caption, **around)


def load_at(view: View, x: Floats) -> Floats | None:
    """The load torque at crank angles; None where there is none.

    It may have a gap where the passes start, over which it is interpolated.
    """
    angle, load, lost = trace(view, "load_torque", {})
    known = np.isfinite(load)
    return None if lost else np.interp(x, angle[known], load[known])


def shade_work(panel: Axes, x: Floats, torque: Floats, load: Floats, entries: Entries) -> None:
    """Shade the areas between torque and load: the work that the rotating masses take and give."""
    for text, where, look in (
        ("Excess of work: speed rises", torque > load, {"color": "#d9d9d9"}),
        ("Deficit of work: speed falls", torque < load,
         {"facecolor": "white", "edgecolor": "#bdbdbd", "hatch": "////"}),
    ):  # fmt: skip
        style: dict[str, Any] = {"linewidth": 0, **look}
        entries[text] = panel.fill_between(x, torque, load, where=where, interpolate=True, **style)
