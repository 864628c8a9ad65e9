"""Lines at values that a caller aims at: `Options.targets`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from sweeps.view.figures.sheet import Entries
from sweeps.view.figures.views import StudyAxis, View
from sweeps.view.figures.wording import name_of, symbol_of, unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LOOK: dict[str, Any] = {"color": "#c1272d", "linestyle": (0, (7, 2)), "linewidth": 1.1}


def target_text(view: View, name: str, text: str) -> str:
    """What a legend calls a target: ``Target δ = 1/200``."""
    variable = view.array(name)
    unit = unit_text(str(variable.attrs.get("units", "")))
    return f"Target {symbol_of(variable) or name_of(variable, name)} = {text} {unit}".rstrip()


def target_lines(
    panel: Axes, view: View, names: Sequence[str], entries: Entries, *, upright: bool = False
) -> None:
    """Lines over a panel at the targets of what its ordinate (`upright`: its abscissa) shows."""
    for name in names:
        for text, value in view.options.targets.get(name, ()):
            draw = panel.axvline if upright else panel.axhline
            entries.setdefault(target_text(view, name, text), draw(value, zorder=1.5, **LOOK))


def target_places(panel: Axes, view: View, axis: StudyAxis, entries: Entries) -> None:
    """Lines at the targets of the axis that a panel runs along."""
    if not axis.words and axis.name in view.options.targets:
        target_lines(panel, view, [axis.name], entries, upright=True)
