"""Figures that tests draw: all of an archive, what is written on them, and labelled variables."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

from sweeps.view.figures.kinds import figures_of
from sweeps.view.figures.sheet import STYLE
from sweeps.view.figures.study import study_of


@contextmanager
def style() -> Iterator[None]:
    """The style in which the package draws."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        yield


def plates(data: xr.Dataset, select: Any = None, laid_out: bool = False) -> dict[str, Figure]:
    """All figures of an archive by name, not written."""
    with style():
        found = dict(figures_of(study_of(data, select or {})))
        for figure in found.values() if laid_out else ():
            figure.canvas.draw()
    return found


def plain(text: str) -> str:
    """A text whose hard spaces, between a number and its unit, are ordinary ones."""
    return text.replace("\N{NO-BREAK SPACE}", " ")


def texts(figure: Figure) -> list[str]:
    """Everything written on a figure, with ordinary spaces."""
    return [plain(t.get_text()) for t in figure.findobj(Text) if t.get_visible() and t.get_text()]


def words(figure: Figure) -> str:
    """The same as one text, without line breaks."""
    return " | ".join(texts(figure)).replace("\n", " ")


def assert_filled(stem: str, figure: Figure) -> None:
    """No panel of a figure that is laid out is empty, and every log axis has two numbers or more.

    Lines across a panel, such as at zero, fill none; marks and texts that say why a curve is
    missing do.
    """
    for panel in (axes for axes in figure.axes if axes.get_visible() and axes.axison):
        curves = [line for line in panel.get_lines() if _has_points(line)]
        more = [*panel.collections, *panel.patches, *panel.images, *panel.texts, *panel.artists]
        assert curves or more, f"{stem}: a panel without anything in it"
        for axis in (panel.xaxis, panel.yaxis):
            if axis.get_scale() == "linear":
                continue
            shared = panel._shared_axes[axis.axis_name].get_siblings(panel)
            numbers = max(len(_numbers(getattr(one, f"{axis.axis_name}axis"))) for one in shared)
            assert numbers >= 2, f"{stem}: a logarithmic axis with {numbers} numbers"


def _has_points(line: Line2D) -> bool:
    """Whether a line has numbers in the units of its panel, or marks."""
    marked = str(line.get_marker()) not in ("", " ", "None", "none")
    spread = line.get_transform() == line.axes.transData
    values = np.asarray(line.get_ydata(), dtype=float)
    return (marked or spread) and bool(np.isfinite(values).any())


def _numbers(axis: Any) -> list[str]:
    """Numbers that can be read at the ticks of an axis."""
    low, high = sorted(axis.get_view_interval())
    ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
    # The second label of a tick is on the other side, as those of a scale of colours.
    labels = [(tick.get_loc(), one) for tick in ticks for one in (tick.label1, tick.label2)]
    return [
        label.get_text()
        for place, label in labels
        if low <= place <= high and label.get_visible() and label.get_text()
    ]


def assert_inside(stem: str, figure: Figure, apart: bool = True) -> None:
    """Nothing is written outside a figure that is laid out, nor has a legend anything in its box.

    `apart` is False where panels of equal scale reach into the empty edge of the legend's box.
    """
    assert_filled(stem, figure)
    renderer, page = figure.canvas.get_renderer(), figure.bbox
    panels = [axes for axes in figure.axes if axes.get_visible() and axes.axison]
    boxes = [panel.get_tightbbox(renderer) for panel in panels]
    legends = [legend.get_window_extent(renderer) for legend in figure.legends]
    titles = [text.get_window_extent(renderer) for text in figure.texts]
    for box in (*boxes, *legends, *titles):
        assert box.x0 >= -1 and box.y0 >= -1, stem
        assert box.x1 <= page.x1 + 1 and box.y1 <= page.y1 + 1, stem
    for legend in legends if apart else ():
        for box in (*boxes, *titles):
            beside = legend.x0 >= box.x1 - 1 or legend.x1 <= box.x0 + 1
            assert beside or legend.y0 >= box.y1 - 1 or legend.y1 <= box.y0 + 1, stem


def variable(dims: Any, values: Any, name: str, units: str, symbol: str = "") -> Any:
    """A variable of a dataset, with its name, unit and symbol."""
    attributes = {"long_name": name, "units": units}
    return (dims, values, attributes | ({"symbol": f"${symbol}$"} if symbol else {}))
