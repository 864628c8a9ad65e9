"""Small multiples: the panels of a figure in rows, their labels, and the legend that they share."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from sweeps.view.figures.scales import x_label, y_label
from sweeps.view.figures.sheet import WIDTH, Entries, finish, new_sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Multiples:
    """Small multiples of one figure.

    Attributes
    ----------
    figure : Figure
        It holds the panels.
    panels : list of Axes
        Those that are drawn, by rows.
    spare : list of Axes
        Those that are left over in the last row: hidden, or the place of the legend.
    columns : int
        Panels of a row.
    entries : dict
        Of the legend.
    """

    figure: Figure
    panels: list[Axes]
    spare: list[Axes]
    columns: int
    entries: Entries = field(default_factory=dict)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return -(-len(self.panels) // self.columns)

    @property
    def lowest(self) -> list[Axes]:
        """The panels with none below them."""
        return self.panels[-self.columns :]

    def label_x(self, text: str, width: float) -> None:
        """Label the abscissas of the lowest panels, each so many inches wide."""
        for panel in self.lowest:
            x_label(panel, text, width)

    def label_y(self, text: str, height: float) -> None:
        """Label the ordinates of the first column, each so many inches tall."""
        for panel in self.panels[:: self.columns]:
            y_label(panel, text, height)

    def finish(
        self, title: str, notes: Iterable[str], caption: str = "", *, legend: bool = True,
        legend_title: str = "", below: bool = True,
    ) -> Figure:  # fmt: skip
        """Finish the figure with `sheet.finish`, without its legend if not `legend`."""
        entries = self.entries if legend else {}
        return finish(self.figure, title, notes, entries, legend_title, caption, below, self.spare)


def columns_for(count: int) -> int:
    """Panels in a row of small multiples."""
    return count if count <= 3 else 2 if count == 4 else 3


def multiples(
    count: int, base: float, each: float, *, columns: int | None = None, width: float = WIDTH,
    **share: Any,
) -> Multiples:  # fmt: skip
    """Begin a figure of `count` panels, `base` inches tall and `each` inches more for every row."""
    columns = columns or columns_for(count)
    rows = -(-count // columns)
    figure, panels = new_sheet(rows, columns, base + each * rows, width=width, **share)
    for panel in panels[count:]:
        panel.set_visible(False)
    for panel in panels[count - columns : count]:
        panel.tick_params(labelbottom=True)
    return Multiples(figure, panels[:count], panels[count:], columns)
