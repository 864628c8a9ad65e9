"""The style of all figures, and the sheet of one: panels, labels, title, notes, legend, caption."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from sweeps.base.errors import SceneError
from sweeps.view.figures.wording import LEAST_SPAN, wrap

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

STYLE: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "mathtext.fontset": "dejavusans",
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "legend.fontsize": 7.5,
    "legend.title_fontsize": 7.5,
    "figure.titlesize": 9.5,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.titlelocation": "left",
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 6),
    "axes.formatter.use_mathtext": True,
    "grid.color": "#dcdcdc",
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.2,
    "lines.markersize": 4.0,
    "lines.markeredgewidth": 0.8,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4,
    "ytick.minor.width": 0.4,
    "legend.frameon": False,
    "legend.handlelength": 3.0,
    "hatch.linewidth": 0.5,
    "savefig.dpi": 300,
    "svg.hashsalt": "engine-dyn",  # With a fixed salt the same archive gives the same file
}
"""Style of all figures, for the 7 inch width of two journal columns; sizes in points."""

WIDTH = 7.0

GREY = "#555555"
OWN_ORDINATES = "each panel has its own scale"
Entries = dict[str, "Artist"]  # Entries of a legend: each text, and its line or mark

NamedFigures = Iterator[tuple[str, "Figure"]]
"""Names of the files without extension, each with its figure."""


@dataclass(frozen=True)
class Setting:
    """Subject, size and panel of all figures that are drawn at one time."""

    subject: str = ""  # Engine and speed, at the beginning of the second line of each figure
    inches: tuple[float, float] | None = None  # Width and height; by default from the panels
    ax: Axes | None = None  # Panel of another program's figure, in place of a new sheet


_SETTING: ContextVar[Setting] = ContextVar("setting")
_PLAIN = Setting()


@contextmanager
def drawn_with(setting: Setting, style: Mapping[str, Any]) -> Iterator[None]:
    """Draw with this setting and style; a person's own settings of matplotlib do not matter."""
    import matplotlib

    token = _SETTING.set(setting)
    try:
        with matplotlib.rc_context():
            matplotlib.rcdefaults()  # A user's own settings would break the layout
            settings: Any = matplotlib.rcParams
            settings.update({**STYLE, **style})
            yield
    finally:
        _SETTING.reset(token)


def room_scale() -> float:
    """Width of the figures over the customary one, for texts that are broken to fit."""
    inches = _SETTING.get(_PLAIN).inches
    return inches[0] / WIDTH if inches else 1.0


def y_label(axes: Axes, text: str, height: float) -> None:
    """Label of a panel `height` inches tall, broken to fit."""
    axes.set_ylabel(wrap(text, max(14, int(height * 16))))


def x_label(axes: Axes, text: str, width: float) -> None:
    """Label of a panel `width` inches wide, broken to fit."""
    axes.set_xlabel(wrap(text, max(14, int(width * room_scale() * 15.5))))


def no_ordinate(panel: Axes) -> None:
    """Where nothing could be drawn there are no numbers to read off.

    A panel of a row with one ordinate may have the numbers of all.
    """
    if len(panel.get_shared_y_axes().get_siblings(panel)) > 1:
        return
    panel.tick_params("y", left=False, labelleft=False)
    panel.grid(False, axis="y")


def new_sheet(
    rows: int, columns: int, height: float, *, width: float = WIDTH, **share: Any
) -> tuple[Figure, list[Axes]]:
    """A figure on the Agg canvas with its panels, as a flat list by rows."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    setting = _SETTING.get(_PLAIN)
    if setting.ax is not None:
        if rows * columns > 1:
            raise SceneError(
                f"ax: this figure has {rows * columns} panels and needs a figure of its own; call "
                "without ax"
            )
        return _figure_around(setting.ax), [setting.ax]
    layout = ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.06)
    figure = Figure(figsize=setting.inches or (width, height), layout=layout)
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(rows, columns, squeeze=False, **share).ravel())


def finish(
    figure: Figure,
    title: str,
    notes: Iterable[str] = (),
    entries: Mapping[str, Artist] | None = None,
    legend_title: str = "",
    caption: str = "",
    below: bool = False,
    spare: Sequence[Axes] = (),
) -> Figure:
    """Write what stands around the panels, outside the data; all figures are finished here.

    The figure grows by the room that this takes, so that the panels keep their size. `title` is the
    first line, `notes` are the second (slices and the like; empty ones are left out), `caption`
    stands below the panels. The legend of the `entries`, with the name of their axis as its title,
    goes to the right of the panels or `below` them, or in the place of `spare` panels if it fits
    there.
    """
    setting = _SETTING.get(_PLAIN)
    said = "; ".join(note for note in (setting.subject, *notes) if note)
    if setting.ax is not None:
        return _finish_panel(setting.ax, title, entries or {}, legend_title)
    for panel in figure.axes:
        _widen(panel)
    width, height = figure.get_size_inches()
    heads, notes_size, small = _points("figure.titlesize"), _points("axes.labelsize"), 7.0
    ink = rc("text.color")
    head = [(line, heads, ink) for line in wrap(title, int(width * 128 / heads)).split("\n")]
    lines = wrap(said, int(width * 128 / notes_size)).split("\n")
    pale = GREY if ink in ("black", "k", "#000000") else ink  # Grey is invisible on dark paper
    head += [(line, notes_size, pale) for line in lines if line]
    foot = [(line, small, pale) for line in wrap(caption, int(width * 18)).split("\n") if line]
    top = 0.06 + sum(_line_height(text, size) for text, size, _ in head)
    bottom = 0.04 + sum(_line_height(text, size) for text, size, _ in foot)

    if setting.inches and not spare:
        # A legend next to the panels of a narrow figure would leave them no room.
        below = below or width < 5.0
    legend, wide, tall = _placed_legend(figure, entries or {}, legend_title, below, spare)
    at_right, under = (0.0, tall) if below else (wide, 0.0)
    if setting.inches is None:
        height = (height + tall if below else max(height, tall)) + top + bottom
        figure.set_figheight(height)
    bounds = (
        0.0,
        (bottom + under) / height,
        1 - at_right / width,
        max(1 - (top + bottom + under) / height, 0.2),
    )
    figure.get_layout_engine().set(rect=bounds)  # type: ignore[call-arg, union-attr]
    if setting.inches is not None:
        _wrap_ordinates(figure, height - top - bottom - under)
    if legend is not None and (at_right or under):
        legend.set_loc("upper right" if at_right else "lower left")
        legend.set_bbox_to_anchor((0, bottom / height, 1, 1 - (top + bottom) / height))
    for texts, start in ((head, 1 - 0.05 / height), (foot, bottom / height)):
        place = start
        for text, size, colour in texts:
            figure.text(0.07 / width, place, text, size=size, color=colour, va="top")
            place -= _line_height(text, size) / height
    return figure


def _line_height(text: str, points: float) -> float:
    """Height of a line around the panels in inches, from its top, which an accent raises."""
    return (1.65 if r"\hat" in text else 1.4) * points / 72


def _wrap_ordinates(figure: Figure, height: float) -> None:
    """Break the labels of the ordinates at the final height of the panels."""
    for panel in figure.axes:
        place = panel.get_subplotspec()
        rows = place.get_gridspec().nrows if place else 1
        text = panel.get_ylabel().replace("\n", " ")
        panel.set_ylabel(wrap(text, max(14, int((0.8 * height / rows - 0.3) * 16))))


def _finish_panel(
    panel: Axes, title: str, entries: Mapping[str, Artist], legend_title: str
) -> Figure:
    """Add title and legend to a panel in another program's figure, and leave its layout."""
    figure = _figure_around(panel)
    width = panel.get_window_extent().width / figure.dpi
    panel.set_title(wrap(title, max(20, int(width * 15))), loc="left")
    if entries:
        texts = [wrap(text, 27) for text in entries]
        panel.legend(list(entries.values()), texts, title=wrap(legend_title, 27) or None)
    return figure


def _figure_around(panel: Axes) -> Figure:
    figure = panel.get_figure(root=True)
    if figure is None:
        raise SceneError("ax: must be a panel of a figure")
    return figure


def rc(name: str) -> Any:
    """A setting of matplotlib as it holds now."""
    import matplotlib

    settings: Any = matplotlib.rcParams
    return settings[name]


def _points(name: str) -> float:
    """Size of letters, which may be a word, in points."""
    from matplotlib.font_manager import FontProperties

    return float(FontProperties(size=rc(name)).get_size_in_points())


def _widen(panel: Axes) -> None:
    """Widen the ordinate of values that are equal but for rounding, so that they look equal."""
    low, high = panel.get_ylim()
    size = max(abs(low), abs(high))
    if panel.get_yscale() == "linear" and 0.0 <= high - low < LEAST_SPAN * size:
        middle = 0.5 * (low + high)
        panel.set_ylim(middle - 0.05 * size, middle + 0.05 * size)


def _placed_legend(
    figure: Figure, entries: Mapping[str, Artist], title: str, below: bool, spare: Sequence[Axes]
) -> tuple[Legend | None, float, float]:
    """The legend, and the inches that it needs outside the panels: 0 in the place of a panel."""
    if not entries:
        return None, 0.0, 0.0
    legend = _legend(figure, entries, title, below)
    if spare:
        # In one column the legend may fit into the place of a missing panel.
        narrow = _legend(figure, entries, title, False, 22)
        cell = _cell(spare[0], *figure.get_size_inches())
        if all(size < room for size, room in zip(_inches(figure, narrow), cell, strict=True)):
            legend.remove()
            spare[0].set_visible(True)
            spare[0].axis("off")
            narrow.set_loc("upper left")
            narrow.set_bbox_to_anchor((0, 0, 1, 1), transform=spare[0].transAxes)
            return narrow, 0.0, 0.0
        narrow.remove()
    return legend, *_inches(figure, legend)


def _legend(
    figure: Figure, entries: Mapping[str, Artist], title: str, below: bool, most: int = 27
) -> Legend:
    """A legend outside the layout engine; below the panels it has up to three columns."""
    texts = [wrap(text, most) for text in entries]
    columns = min(len(texts), 3) if below else 1
    while True:
        legend = figure.legend(
            list(entries.values()),
            texts,
            title=wrap(title, most) or None,
            ncols=columns,
            alignment="left",
            borderaxespad=0.3,
        )
        legend.get_title().set_multialignment("left")
        legend.set_in_layout(False)
        if columns == 1 or _inches(figure, legend)[0] < figure.get_figwidth():
            return legend
        legend.remove()
        columns -= 1


def _inches(figure: Figure, legend: Legend) -> tuple[float, float]:
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    box = legend.get_window_extent(renderer)
    return box.width / figure.dpi + 0.1, box.height / figure.dpi + 0.1


def _cell(panel: Axes, width: float, height: float) -> tuple[float, float]:
    """Inches that a panel of small multiples has, less some margin."""
    place = panel.get_subplotspec()
    if place is None:
        return 0.0, 0.0
    grid = place.get_gridspec()
    return width / grid.ncols - 0.4, height / grid.nrows - 0.3


@dataclass(frozen=True)
class Multiples:
    """Small multiples: the panels of a figure by rows, and the entries of its legend."""

    figure: Figure
    panels: list[Axes]
    spare: list[Axes]  # Panels left over in the last row, hidden or the place of the legend
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
