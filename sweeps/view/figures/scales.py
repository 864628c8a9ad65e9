"""Labels, ticks and scales of the axes of a panel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from engine_dyn.types import Floats
from sweeps.base.numbers import digits_of
from sweeps.view.figures.sheet import room_scale, x_label
from sweeps.view.figures.views import StudyAxis
from sweeps.view.figures.wording import LEAST_SPAN, axis_label, typeset

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis


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


def _value_ticks(axis: Axis, values: Floats, log: bool, which: str, room: float) -> None:
    """Set ticks at the values of a short axis of `room` inches, otherwise at round numbers."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator

    places = np.sort(np.log(values) if log else values)
    span = float(np.ptp(places)) or 1.0
    digits = digits_of(values)
    texts = [typeset(value, digits) for value in values]
    size = max(0.07 * len(text) + 0.06 if which == "x" else 0.17 for text in texts)
    gaps = np.diff(places) / span * 0.88 * room
    if values.size <= 7 and not np.any(gaps < size):
        axis.set_major_locator(FixedLocator(list(values)))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(FuncFormatter(lambda value, _: typeset(value, digits)))
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
    plain = FuncFormatter(lambda value, _: typeset(value))
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


def whole_ticks(axes: Axes) -> None:
    """An abscissa that counts has its ticks at whole numbers."""
    from matplotlib.ticker import MaxNLocator

    axes.xaxis.set_major_locator(MaxNLocator(integer=True))


def degree_ticks(axes: Axes, variable: xr.Variable) -> None:
    """An ordinate in degrees has its ticks at parts of a turn, where it is long enough."""
    from matplotlib.ticker import MaxNLocator

    low, high = axes.get_ylim()
    if variable.attrs.get("units") == "degree" and high - low > 90.0:
        axes.yaxis.set_major_locator(MaxNLocator(9, steps=[1, 1.5, 3, 4.5, 9, 10]))


def free_scale(axes: Axes, values: Sequence[Floats], which: str = "y") -> None:
    """A logarithmic scale where positive values span more than a decade and a bit."""
    known = np.concatenate([v[np.isfinite(v)] for v in values]) if values else np.empty(0)
    if known.size and np.all(known > 0) and known.max() > 20 * known.min():
        set_log(axes, which)


def set_log(axes: Axes, which: str) -> None:
    """Make an axis of a panel logarithmic over what it shows."""
    (axes.set_xscale if which == "x" else axes.set_yscale)("log")
    low, high = axes.get_xlim() if which == "x" else axes.get_ylim()
    log_ticks(axes.xaxis if which == "x" else axes.yaxis, low, high)


def sensible_span(panels: Sequence[Axes], values: Sequence[Floats]) -> str:
    """Keep an ordinate from magnifying next to nothing; what a note says of a narrow one."""
    known = np.concatenate([np.ravel(v[np.isfinite(v)]) for v in values]) if values else np.empty(0)
    if not known.size or known.min() < 0 < known.max():
        return ""
    size, span = float(np.abs(known).max()), float(np.ptp(known))
    if not LEAST_SPAN * size < span < 0.02 * size or panels[0].get_yscale() != "linear":
        return ""
    if span >= 0.002 * size:
        return f"the vertical axis spans {typeset(100 * span / size, 2)} % of the values"
    middle = 0.5 * float(known.min() + known.max())
    for panel in panels:
        panel.set_ylim(middle - 0.005 * size, middle + 0.005 * size)
    return f"changes by {typeset(100 * span / size, 2)} % only; the vertical axis spans 1 %"


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
    # A level line is not flattened by the ordinate of other panels.
    spans = [span for span in map(np.ptp, known) if span > LEAST_SPAN * np.ptp(every)]
    return not spans or bool(np.median(spans) > 0.33 * np.ptp(every))


def crank_axis(axes: Axes, angle: xr.Variable, room: float, named: bool = True) -> None:
    """Crank angle with ticks at quarter or half turns and the dead centres by name."""
    from matplotlib.ticker import FixedLocator, FuncFormatter

    low, high = axes.get_xlim()
    zero = float(angle.attrs.get("zero_at", 0.0))  # Degrees from firing dead centre to angle 0
    four_stroke = high - low > 360 or low + zero >= 0
    per_degree = room * room_scale() / max(high - low, 1.0)
    gap = " " if 180 * per_degree > 0.62 else "\n"

    def text(value: float, _: object) -> str:
        number = typeset(value)
        if value % 180:
            return number
        if (value + zero) % 360:
            return f"{number}\nBDC"
        if (value + zero) % 720 or not four_stroke:
            return f"{number}\nTDC"
        return f"{number}\nfiring{gap}TDC"

    # A quarter turn needs some 0.45 inch for its number, next to the name of a dead centre
    step = next((s for s in (90, 180, 360) if s * per_degree > (0.42 if s == 90 else 0.5)), 360)
    first = np.ceil(low / step) * step
    axes.xaxis.set_major_locator(FixedLocator(list(np.arange(first, high + 1, step))))
    axes.xaxis.set_major_formatter(FuncFormatter(text))
    for value in np.arange(np.ceil(low / 180) * 180, high + 1, 180):
        axes.axvline(value, color="#b8b8b8", linewidth=0.6, zorder=0.5)
    if named:
        x_label(axes, axis_label(angle, "crank_angle"), room)
