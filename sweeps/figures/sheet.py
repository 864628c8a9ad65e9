"""The style of all figures, and the parts that every figure is put together from."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from engine_dyn.types import Floats
from sweeps.figures.views import LEAST_SPAN, NO_VALUE, StudyAxis
from sweeps.figures.wording import axis_label, digits_of, number_text, wrap

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend


# One style for all figures, for the 7 inch width of two journal columns; sizes in points.
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
    "svg.hashsalt": "engine-dyn",  # the same archive gives the same file
}
WIDTH = 7.0
GREY = "#555555"
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "h")
DASHES: tuple[Any, ...] = (
    "-",
    (0, (6, 1.5)),
    (0, (4, 1.2, 1, 1.2)),
    (0, (1.2, 1)),
    (0, (3, 1, 1, 1, 1, 1)),
    (0, (9, 3)),
    (0, (2.5, 2)),
    (0, (5, 1, 1, 1, 1, 1, 1, 1)),
)
# Marker and hatching of a design without an answer, by its outcome.
LOST: dict[str, tuple[str, str]] = {
    "stalled": ("x", "////"),
    "no steady state": ("+", "...."),
    "not converged": ("v", "\\\\\\\\"),
    "invalid input": ("*", "xxxx"),
    NO_VALUE: ("|", "++++"),
}
LOST_OTHERWISE = ("<", "oo")
OWN_ORDINATES = "each panel has its own ordinate"
Entries = dict[str, "Artist"]  # of a legend: text and what it explains
Plates = Iterator[tuple[str, "Figure"]]  # name of the file without its ending, and the figure


def new_sheet(
    rows: int, columns: int, height: float, *, width: float = WIDTH, **share: Any
) -> tuple[Figure, list[Axes]]:
    """A figure on the Agg canvas with its panels, as a flat list by rows."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    layout = ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.06)
    figure = Figure(figsize=(width, height), layout=layout)
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(rows, columns, squeeze=False, **share).ravel())


def grid_of(count: int) -> tuple[int, int]:
    """Rows and columns for small multiples."""
    columns = count if count <= 3 else 2 if count == 4 else 3
    return -(-count // columns), columns


def _widen(panel: Axes) -> None:
    """Show values that are equal but for rounding as equal."""
    low, high = panel.get_ylim()
    size = max(abs(low), abs(high))
    if panel.get_yscale() == "linear" and 0.0 <= high - low < LEAST_SPAN * size:
        middle = 0.5 * (low + high)
        panel.set_ylim(middle - 0.05 * size, middle + 0.05 * size)


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
    """Title, slices and the like below it, legend outside the data, caption.

    The figure grows by what they take, so that the panels keep their size. The legend goes to
    the right, below the panels, or into the room of panels that are not used.
    """
    for panel in figure.axes:
        _widen(panel)
    width, height = figure.get_size_inches()
    head = [(line, 9.5, "black") for line in wrap(title, int(width * 13.5)).split("\n")]
    said = "; ".join(note for note in notes if note)
    head += [(line, 8.0, GREY) for line in wrap(said, int(width * 16)).split("\n") if line]
    foot = [(line, 7.0, GREY) for line in wrap(caption, int(width * 18)).split("\n") if line]
    leading = 1.4 / 72
    top = 0.06 + sum(size * leading for _, size, _ in head)
    bottom = 0.04 + sum(size * leading for _, size, _ in foot)

    aside = under = 0.0
    legend = _legend(figure, entries or {}, legend_title, below) if entries else None
    cell = _cell(spare[0], width, height) if spare else (0.0, 0.0)
    if legend is not None and spare:
        # in one column it may fit where a panel is missing
        narrow = _legend(figure, entries or {}, legend_title, False, 22)
        if all(size < room for size, room in zip(_inches(figure, narrow), cell, strict=True)):
            legend.remove()
            legend = narrow
            spare[0].set_visible(True)
            spare[0].axis("off")
            legend.set_loc("upper left")
            legend.set_bbox_to_anchor((0, 0, 1, 1), transform=spare[0].transAxes)
        else:
            narrow.remove()
            cell = (0.0, 0.0)
    if legend is not None and not any(cell):
        wide, tall = _inches(figure, legend)
        aside, under = (0.0, tall) if below else (wide, 0.0)
        height = height + tall if below else max(height, tall)
    height += top + bottom
    figure.set_figheight(height)
    bounds = (
        0.0,
        (bottom + under) / height,
        1 - aside / width,
        1 - (top + bottom + under) / height,
    )
    figure.get_layout_engine().set(rect=bounds)  # type: ignore[call-arg, union-attr]
    if legend is not None and (aside or under):
        legend.set_loc("upper right" if aside else "lower left")
        legend.set_bbox_to_anchor((0, bottom / height, 1, 1 - (top + bottom) / height))
    for lines, start in ((head, 1 - 0.05 / height), (foot, bottom / height)):
        place = start
        for text, size, colour in lines:
            figure.text(0.07 / width, place, text, size=size, color=colour, va="top")
            place -= size * leading / height
    return figure


def _legend(
    figure: Figure, entries: Mapping[str, Artist], title: str, below: bool, most: int = 27
) -> Legend:
    """A legend of the figure that the layout does not know of; of up to three columns below."""
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


def shade(position: float) -> Any:
    """Colours from dark to light, so that grey print keeps their order."""
    import matplotlib

    return matplotlib.colormaps["viridis"](0.82 * position)


def line_style(index: int, count: int, strong: bool = False) -> dict[str, Any]:
    """Line number `index` of `count`: lightness, dashes and marker all differ."""
    return {
        "color": shade(index / max(count - 1, 1) if count > 1 else 0.15),
        "linestyle": DASHES[index % len(DASHES)],
        "marker": MARKERS[index % len(MARKERS)],
        "linewidth": 1.9 if strong else 1.2,
        "markerfacecolor": "white" if index % 2 else None,
    }


def lost_handle(why: str, colour: Any = GREY) -> Artist:
    """What a legend shows for designs without an answer."""
    from matplotlib.lines import Line2D

    return Line2D([], [], **lost_look(why, colour))


def lost_look(why: str, colour: Any) -> dict[str, Any]:
    """Marks of designs without an answer, by their outcome."""
    return {
        "linestyle": "none",
        "marker": LOST.get(why, LOST_OTHERWISE)[0],
        "markersize": 6.0,
        "color": colour,
        "markerfacecolor": "none",
    }


def mark_lost(panel: Axes, why: str, colour: Any = GREY, rank: int = 0) -> None:
    """A mark in the corner of a panel whose curve is missing."""
    panel.plot([0.04 + 0.05 * rank], [0.95], transform=panel.transAxes, **lost_look(why, colour))


def lost_points(panel: Axes, x: Floats, why: str, colour: Any = GREY) -> None:
    """Marks on the lower border for designs without an answer."""
    panel.plot(
        x,
        np.zeros(x.size),
        clip_on=False,
        zorder=5,
        transform=panel.get_xaxis_transform(),
        rasterized=x.size > 200,
        **lost_look(why, colour),
    )


def doubt_look(size: float = 4.0) -> dict[str, Any]:
    """Marks of designs that missed the tolerance."""
    return {
        "linestyle": "none",
        "marker": "s",
        "markersize": size,
        "markerfacecolor": "none",
        "markeredgecolor": "black",
        "markeredgewidth": 0.6,
    }


def no_ordinate(panel: Axes) -> None:
    """Where nothing could be drawn there are no numbers to read off."""
    panel.tick_params("y", left=False, labelleft=False)
    panel.grid(False, axis="y")


def y_label(axes: Axes, text: str, height: float) -> None:
    """Label of a panel `height` inches tall, broken to fit."""
    axes.set_ylabel(wrap(text, max(14, int(height * 16))))


def left_labels(panels: Sequence[Axes], columns: int, text: str, height: float) -> None:
    """Label the ordinates of the first column of small multiples."""
    for panel in panels[::columns]:
        y_label(panel, text, height)


def x_label(axes: Axes, text: str, width: float) -> None:
    """Label of a panel `width` inches wide, broken to fit."""
    axes.set_xlabel(wrap(text, max(14, int(width * 15.5))))


def _value_ticks(axis: Axis, values: Floats, log: bool, which: str, room: float) -> None:
    """Ticks at the values of a short axis of `room` inches, at round numbers otherwise."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator

    places = np.sort(np.log(values) if log else values)
    span = float(np.ptp(places)) or 1.0
    digits = digits_of(values)
    texts = [number_text(value, digits) for value in values]
    size = max(0.07 * len(text) + 0.06 if which == "x" else 0.17 for text in texts)
    gaps = np.diff(places) / span * 0.88 * room
    if values.size <= 7 and not np.any(gaps < size):
        axis.set_major_locator(FixedLocator(list(values)))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(FuncFormatter(lambda value, _: number_text(value, digits)))
    elif log:
        log_ticks(axis, float(values.min()), float(values.max()), few=room < 2)
    elif np.all(values == np.round(values)) and span < 50:
        axis.set_major_locator(MaxNLocator(integer=True))


def log_ticks(axis: Axis, low: float, high: float, few: bool = False) -> None:
    """Ticks at 1, 2, 5 where a decade or two are shown, written as plain numbers."""
    from matplotlib.ticker import (
        FuncFormatter,
        LogFormatterMathtext,
        LogLocator,
        MaxNLocator,
        NullFormatter,
        NullLocator,
    )

    decades = np.log10(high / low)
    plain = FuncFormatter(lambda value, _: number_text(value))
    if decades < 0.7:
        axis.set_major_locator(MaxNLocator(4 if few else 6))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(plain)
    else:
        axis.set_major_locator(
            LogLocator(subs=(1.0,) if decades > (1.6 if few else 3) else (1.0, 2.0, 5.0))
        )
        axis.set_minor_locator(LogLocator(subs=np.arange(1.0, 10.0).tolist()))
        axis.set_major_formatter(plain if decades < 5 else LogFormatterMathtext())
        axis.set_minor_formatter(NullFormatter())


def parameter_ticks(axes: Axes, axis: StudyAxis, which: str, room: float) -> None:
    """Scale and ticks of a panel along an axis of the study, `room` inches long."""
    line = axes.xaxis if which == "x" else axes.yaxis
    if axis.words:
        line.set_ticks(list(axis.values), list(axis.words))
        if which == "x" and sum(len(word) + 2 for word in axis.words) > room * 14:
            axes.tick_params("x", labelrotation=35)
            for label in axes.get_xticklabels():
                label.set(ha="right", rotation_mode="anchor")
        (axes.set_xlim if which == "x" else axes.set_ylim)(-0.5, axis.size - 0.5)
        return
    if axis.log:
        (axes.set_xscale if which == "x" else axes.set_yscale)("log")
    _value_ticks(line, axis.values, axis.log, which, room)


def free_scale(axes: Axes, values: Sequence[Floats]) -> None:
    """A logarithmic ordinate where positive values span more than a decade and a bit."""
    known = np.concatenate([v[np.isfinite(v)] for v in values]) if values else np.empty(0)
    if known.size and np.all(known > 0) and known.max() > 20 * known.min():
        axes.set_yscale("log")
        low, high = axes.get_ylim()
        log_ticks(axes.yaxis, low, high)


def degree_ticks(axes: Axes, variable: xr.Variable) -> None:
    """An ordinate in degrees has its ticks at parts of a turn, where it is long enough."""
    from matplotlib.ticker import MaxNLocator

    low, high = axes.get_ylim()
    if variable.attrs.get("units") == "degree" and high - low > 90.0:
        axes.yaxis.set_major_locator(MaxNLocator(9, steps=[1, 1.5, 3, 4.5, 9, 10]))


def comparable(panels: Sequence[Sequence[Floats]]) -> bool:
    """Whether panels can have one ordinate without being flattened by the widest of them."""
    known = [
        values[np.isfinite(values)]
        for values in (np.concatenate([np.ravel(y) for y in panel]) for panel in panels)
    ]
    known = [values for values in known if values.size]
    if not known:
        return True
    every = np.concatenate(known)
    if every.min() > 0 and every.max() > 20 * every.min():
        known, every = [np.log(values) for values in known], np.log(every)
    # a level line needs no ordinate of its own
    spans = [span for span in map(np.ptp, known) if span > LEAST_SPAN * np.ptp(every)]
    return not spans or bool(np.median(spans) > 0.33 * np.ptp(every))


def crank_axis(axes: Axes, angle: xr.Variable, room: float, named: bool = True) -> None:
    """Crank angle with ticks at quarter or half turns and the dead centres by name."""
    from matplotlib.ticker import FixedLocator, FuncFormatter

    low, high = axes.get_xlim()
    four_stroke = high - low > 360 or low >= 0
    per_degree = room / max(high - low, 1.0)
    gap = " " if 180 * per_degree > 0.62 else "\n"

    def text(value: float, _: object) -> str:
        number = number_text(value)
        if value % 180:
            return number
        if value % 360:
            return f"{number}\nBDC"
        if value % 720 or not four_stroke:
            return f"{number}\nTDC"
        return f"{number}\nfiring{gap}TDC"

    # a quarter turn needs some 0.45 inch for its number beside the name of a dead centre
    step = next((s for s in (90, 180, 360) if s * per_degree > (0.42 if s == 90 else 0.5)), 360)
    first = np.ceil(low / step) * step
    axes.xaxis.set_major_locator(FixedLocator(list(np.arange(first, high + 1, step))))
    axes.xaxis.set_major_formatter(FuncFormatter(text))
    for value in np.arange(np.ceil(low / 180) * 180, high + 1, 180):
        axes.axvline(value, color="#b8b8b8", linewidth=0.6, zorder=0.5)
    if named:
        x_label(axes, axis_label(angle, "crank_angle"), room)


def bare_panels(panels: Iterable[Axes], count: int, columns: int) -> None:
    """Hide the panels that are left over, and give the ones above them their tick labels."""
    listed = list(panels)
    for number, panel in enumerate(listed):
        if number >= count:
            panel.set_visible(False)
        elif number + columns >= count:
            panel.tick_params(labelbottom=True)


def lowest_panels(panels: Iterable[Axes], count: int, columns: int) -> list[Axes]:
    """Return the panels with none below them, of `count` small multiples."""
    return [p for number, p in enumerate(panels) if count - columns <= number < count]
