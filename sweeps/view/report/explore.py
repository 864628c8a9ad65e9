"""The explorer of a report over a whole archive, in a notebook or served by Panel.

Only what is drawn is read: a line, a map of some cells, the curves of one design. The archive may
be larger than memory.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.quantities.graph import DIMENSIONS
from engine_dyn.status import MEANINGS
from sweeps.base.errors import SceneError, one_line
from sweeps.base.files.libraries import library
from sweeps.view.report.embedding import choices_of, columns_along, is_list, is_words, text_of
from sweeps.view.texts.readable_units import converted
from sweeps.view.texts.tables import number_text

if TYPE_CHECKING:
    import xarray as xr


Values = npt.NDArray[Any]

OF_CURVES = ("crank_angle", "order")

MOST_OPTIONS = 1000
"""Most values of an axis whose slider shows the values themselves, not their numbers."""

MOST_POINTS = 5000  # Most points of a line


COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8a6d3b")


def explore(archive: str | Path | xr.Dataset, *, units: str | None = None) -> Any:
    """Return an explorer of an archive: sliders of its axes, numbers, a line, a map, curves.

    Parameters
    ----------
    archive : str, Path or Dataset
        An archive that `run` wrote, or what `sweeps.run` or `sweeps.open` returned. A file stays
        open; only what is drawn is read of it.
    units : str, optional
        ``power=kW,speed=rpm``: units of columns; `archive` for those of the archive.

    Returns
    -------
    panel.Column
        A notebook shows it; ``panel.serve`` serves it to a browser.

    Raises
    ------
    SceneError
        For units that do not fit, an archive without numbers, and where Panel is not installed.

    Examples
    --------
    >>> explore("first.nc")  # doctest: +SKIP
    """
    panel = library("panel", "panel", "explore", extra="explore")
    # The notebook then needs no network; a slider counts only where it is let go.
    panel.extension(inline=True, throttled=True)
    if isinstance(archive, str | Path):
        from sweeps.decide.explore.opening import open as open_any

        archive = open_any(archive)
    return _Explorer(archive, units, panel).layout()


class _Explorer:
    """Widgets of an archive, and what they draw."""

    def __init__(self, archive: xr.Dataset, units: str | None, panel: Any) -> None:
        self.archive, self.panel = archive, panel
        self.names = [
            str(n) for n, v in archive.data_vars.items()
            if v.dtype.kind in "fiu" and v.size and n != "status"
        ]  # fmt: skip
        if not self.names:
            raise SceneError("explore: the archive has no numbers")
        self.columns = columns_along(archive, self.names)
        self.choices = choices_of(archive, units)
        self.axes = {
            d: self._slider(d) for d in dict.fromkeys(dim for dim, _ in self.columns.values())
            if d not in OF_CURVES and archive.sizes[d] > 1
        }  # fmt: skip

    # ---- reading ---------------------------------------------------------------------------------

    def at(self) -> dict[str, int]:
        """Where the sliders are."""
        return {dim: int(slider.value) for dim, slider in self.axes.items()}

    def read(self, name: str, index: Mapping[str, Any], order: Sequence[str] = ()) -> Values:
        """Numbers of a quantity in the units of the page; what has no index is at the sliders."""
        data = self.archive[name]
        inside = {d: index.get(str(d), self.at().get(str(d), 0)) for d in data.dims}
        read = data.isel(inside).transpose(*order).values.astype(float)
        return np.asarray(read * self._converted(name)[0])

    def along(self, key: str, index: slice) -> list[Any]:
        """Values of an axis or of a column of designs."""
        variable = self.columns[key][1][index]
        if is_words(variable):
            return [one_line(text, 80) for text in variable.values]
        return list(np.asarray(variable.values * self._converted(key)[0], dtype=float))

    def _converted(self, key: str) -> tuple[float, str]:
        variable = self.columns[key][1] if key in self.columns else self.archive[key].variable
        return converted(str(variable.attrs.get("units", "1")), self.choices.get(key))

    def _here(self, key: str, place: int) -> str:
        return _text(self.along(key, slice(place, place + 1))[0])

    def head(self, key: str) -> str:
        """A name with its unit."""
        unit = self._unit(key)
        return f"{one_line(key, 60)} [{unit}]" if unit else one_line(key, 60)

    def _unit(self, key: str) -> str:
        if key in self.columns and is_words(self.columns[key][1]):
            return ""
        return one_line(self._converted(key)[1], 30)

    def thinned(self, dim: str, most: int) -> slice:
        """Every n-th place of an axis, so that there are at most `most`."""
        size = self.archive.sizes[dim]
        return slice(0, size, max(1, -(-size // most)))

    # ---- widgets ---------------------------------------------------------------------------------

    def _slider(self, dim: str) -> Any:
        widgets, size = self.panel.widgets, self.archive.sizes[dim]
        own = [k for k, (of, v) in self.columns.items() if of == dim and is_words(v)]
        label = "design" if is_list(self.archive, dim) else self.head(dim)
        if size > MOST_OPTIONS:
            return widgets.IntSlider(label=f"{label}, number", start=0, end=size - 1, width=250)
        key = dim if dim in own else (own or [dim])[0]
        values = self.along(key, slice(None))
        texts = [_text(v) for v in values]
        if len(set(texts)) < len(texts):
            texts = [f"{i + 1}: {text}" for i, text in enumerate(texts)]
        options = {text: i for i, text in enumerate(texts)}
        if own:
            return widgets.Select(label=label, options=options, value=0, width=250)
        return widgets.DiscreteSlider(label=label, options=options, value=size // 2, width=250)

    def _select(self, name: str, options: Sequence[str], value: str | None = None) -> Any:
        first = value if value in options else options[0]
        return self.panel.widgets.Select(label=name, options=list(options), value=first,
                                         width=155)  # fmt: skip

    def _varying(self, name: str) -> list[str]:
        dims = [str(d) for d in self.archive[name].dims if str(d) in self.axes]
        return sorted(dims, key=lambda d: (d in DIMENSIONS, -self.archive.sizes[d]))

    def _keys(self, name: str) -> list[str]:
        """Axes and columns along which a quantity can be drawn; numbers of lists last."""
        dims = self._varying(name)
        keys = [k for d in dims for k, (of, _) in self.columns.items() if of == d]
        return sorted(keys, key=lambda k: k in dims and is_list(self.archive, k))

    # ---- views -----------------------------------------------------------------------------------

    def layout(self) -> Any:
        """All of it below each other."""
        panel = self.panel
        single = [n for n in self.names if not set(self.archive[n].dims) & set(OF_CURVES)]
        varied = [n for n in single if self._varying(n)]
        views = []
        if single:
            views.append(self._numbers(single))
        if varied:
            views.append(self._line(varied))
        maps = [n for n in varied if len(self._numeric(n)) > 1]
        if maps:
            views.append(self._map(maps))
        for over in OF_CURVES:
            curves = [n for n in self.names if over in self.archive[n].dims]
            if curves and self.archive.sizes[over] > 1:
                views.append(self._curves(curves, over))
        title = one_line(self.archive.attrs.get("title") or "Archive", 200)
        return panel.Column(
            panel.pane.Str(title, styles={"font-size": "18px", "font-weight": "600"}),
            panel.FlexBox(*self.axes.values()),
            panel.FlexBox(*views),
        )

    def _numeric(self, name: str) -> list[str]:
        return [
            k for k in self._keys(name)
            if not is_words(self.columns[k][1]) or k in self.axes
        ]  # fmt: skip

    def _watched(self, widgets: Sequence[Any], update: Callable[[], None]) -> None:
        update()
        for widget in widgets:
            widget.param.watch(lambda *_: update(), "value")

    def _numbers(self, names: list[str]) -> Any:
        import pandas as pd

        pane = self.panel.pane.DataFrame(pd.DataFrame(), index=False, max_height=400)

        def update() -> None:
            here = self.at()
            rows = [
                (key, self._here(key, here[of]), self._unit(key), text_of(variable, key))
                for key, (of, variable) in self.columns.items()
                if of in here and (key != of or self.archive.sizes[of] > MOST_OPTIONS)
            ]
            for name in names:
                value = number_text(float(self.read(name, {})))
                rows.append((name, value, self._unit(name), text_of(self.archive[name], name)))
            if "status" in self.archive:
                dims = self.archive["status"].dims
                code = int(self.archive["status"].isel({d: self.at().get(str(d), 0) for d in dims}))
                told = MEANINGS[code] if 0 <= code < len(MEANINGS) else str(code)
                rows.append(("outcome", told.replace("_", " "), "", ""))
            pane.object = pd.DataFrame(rows, columns=["quantity", "value", "unit", "meaning"])

        self._watched(list(self.axes.values()), update)
        return self.panel.Column(pane, name="numbers")

    def _line(self, names: list[str]) -> Any:
        start = "delta" if "delta" in names else names[0]
        keys = list(dict.fromkeys(k for n in names for k in self._keys(n)))
        quantity = self._select("quantity", names, start)
        over = self._select("over", keys, self._keys(start)[0])
        others = [d for d in self.axes if self.archive.sizes[d] <= MOST_OPTIONS]
        each = self._select("a line for each", ["no other axis", *others])
        pane = self.panel.pane.Bokeh()

        def update() -> None:
            name, key, lines = quantity.value, over.value, each.value
            dim, dims = self.columns[key][0], self.archive[name].dims
            if dim not in dims:
                pane.object = _message(f"{name} does not depend on {key}")
                return
            index = self.thinned(dim, MOST_POINTS)
            places: list[tuple[str, dict[str, Any]]] = [(name, {})]
            if lines in dims and lines != dim:
                of_lines = self.thinned(lines, len(COLOURS))
                values = self.along(lines, of_lines)
                numbers = range(*of_lines.indices(self.archive.sizes[lines]))
                places = [
                    (f"{lines} {_text(v)}", {lines: i})
                    for i, v in zip(numbers, values, strict=True)
                ]
            curves = {
                label: self.read(name, {dim: index, **place}, [dim]) for label, place in places
            }
            draw_line = not is_words(self.columns[key][1]) and not is_list(self.archive, dim)
            pane.object = _lines(
                self.head(key), self.head(name), self.along(key, index), curves, line=draw_line
            )

        self._watched([quantity, over, each, *self.axes.values()], update)
        return self.panel.Column(self.panel.Row(quantity, over, each), pane, name="line")

    def _map(self, names: list[str]) -> Any:
        start = "delta" if "delta" in names else names[0]
        keys = list(dict.fromkeys(k for n in names for k in self._numeric(n)))
        quantity = self._select("quantity", names, start)
        across = self._select("across", keys, self._numeric(start)[0])
        up = self._select("up", keys, self._numeric(start)[1])
        pane = self.panel.pane.Bokeh()

        def update() -> None:
            name = quantity.value
            one, other = (self.columns[k.value][0] for k in (across, up))
            if across.value == up.value or not {one, other} <= set(self.archive[name].dims):
                pane.object = _message("Choose two different axes that the quantity depends on")
                return
            if one == other:
                index = self.thinned(one, MOST_POINTS)
                x, y = self.along(across.value, index), self.along(up.value, index)
                values = self.read(name, {one: index}, [one])
            else:
                cells = {d: self.thinned(d, 200) for d in (one, other)}
                xs, ys = self.along(across.value, cells[one]), self.along(up.value, cells[other])
                values = self.read(name, cells, [other, one]).reshape(-1)
                x, y = xs * len(ys), [v for v in ys for _ in xs]
            heads = (self.head(across.value), self.head(up.value), self.head(name))
            pane.object = _map(heads, x, y, values, cells=one != other)

        self._watched([quantity, across, up, *self.axes.values()], update)
        return self.panel.Column(self.panel.Row(quantity, across, up), pane, name="map")

    def _curves(self, names: list[str], over: str) -> Any:
        groups: dict[str, list[str]] = {}
        for name in names:
            groups.setdefault(self._converted(name)[1] or name, []).append(name)
        start = next((g for g in ("N m", "rpm") if g in groups), next(iter(groups)))
        group = self._select("in", list(groups), start)
        pane = self.panel.pane.Bokeh()
        x = self.along(over, slice(None))

        def update() -> None:
            curves = {n: self.read(n, {over: slice(None)}, [over]) for n in groups[group.value]}
            label = self.head(next(iter(curves))) if len(curves) == 1 else f"[{group.value}]"
            pane.object = _lines(self.head(over), label, x, curves, line=over == "crank_angle")

        self._watched([group, *self.axes.values()], update)
        return self.panel.Column(group, pane, name=over)


def _text(value: Any) -> str:
    return value if isinstance(value, str) else f"{value:.6g}"


# ---- figures -------------------------------------------------------------------------------------


def _models() -> Any:
    return library("bokeh.models", "bokeh", "explore", extra="explore")


def _figure(x: str, y: str, **options: Any) -> Any:
    from bokeh.plotting import figure

    made = figure(width=520, height=330, x_axis_label=x, y_axis_label=y,
                  tools="pan,box_zoom,wheel_zoom,reset,save", **options)  # fmt: skip
    made.toolbar.logo = None
    return made


def _message(text: str) -> Any:
    return _models().PreText(text=text)


def _ranged(options: dict[str, Any], name: str, values: list[Any]) -> None:
    """Words along an axis need to be known to it."""
    if values and isinstance(values[0], str):
        options[name] = list(dict.fromkeys(values))


def _lines(
    x_head: str, y_head: str, x: list[Any], curves: Mapping[str, Values], *, line: bool
) -> Any:
    """Curves over one axis, with a legend that hides them."""
    models = _models()

    options: dict[str, Any] = {}
    _ranged(options, "x_range", x)
    made = _figure(x_head, y_head, **options)
    for place, (name, values) in enumerate(curves.items()):
        source = models.ColumnDataSource({"x": x, "y": values})
        colour = COLOURS[place % len(COLOURS)]
        label = {"legend_label": one_line(name, 60)} if len(curves) > 1 else {}
        if line:
            drawn = made.line("x", "y", source=source, color=colour, line_width=2, **label)
        else:
            drawn = made.scatter("x", "y", source=source, color=colour, size=6, **label)
        tips = [(x_head, "@x"), (one_line(name, 60), "@y{0.00000}")]
        made.add_tools(models.HoverTool(renderers=[drawn], tooltips=tips, visible=False))
    if len(curves) > 1:
        made.legend.click_policy = "hide"
        made.legend.ncols = 4
        made.add_layout(made.legend[0], "below")
    return made


def _edges(values: list[Any]) -> tuple[list[float], list[float]]:
    """Where cells begin and end: half-way between their points."""
    points = sorted(set(values))
    if len(points) < 2:
        middles = [points[0] - 0.5, points[0] + 0.5]
    else:
        inner = [(a + b) / 2.0 for a, b in pairwise(points)]
        middles = [2.0 * points[0] - inner[0], *inner, 2.0 * points[-1] - inner[-1]]
    place = {value: i for i, value in enumerate(points)}
    return [middles[place[v]] for v in values], [middles[place[v] + 1] for v in values]


def _map(
    heads: tuple[str, str, str], x: list[Any], y: list[Any], values: Values, *, cells: bool
) -> Any:
    """One number over two axes in colours: cells of a grid, or points."""
    x_head, y_head, head = heads
    models = _models()

    options: dict[str, Any] = {}
    _ranged(options, "x_range", x)
    _ranged(options, "y_range", y)
    made = _figure(x_head, y_head, **options)
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    # Where numbers go over more than a decade, most of a map would have one colour.
    scale = models.LogColorMapper if low > 0.0 and high / low > 20.0 else models.LinearColorMapper
    mapper = scale("Viridis256", low=low, high=high, nan_color="#c8c8c8")
    fill = {"field": "value", "transform": mapper}
    source = models.ColumnDataSource({"x": x, "y": y, "value": values})
    if cells and not options and np.isfinite(x).all() and np.isfinite(y).all():
        for name, (left, right) in (("x", _edges(x)), ("y", _edges(y))):
            source.data[f"{name}_low"], source.data[f"{name}_high"] = left, right
        drawn = made.quad(left="x_low", right="x_high", bottom="y_low", top="y_high",
                          source=source, fill_color=fill, line_color=fill)  # fmt: skip
    else:
        drawn = made.scatter("x", "y", source=source, marker="square", size=9, line_color=None,
                             fill_color=fill)  # fmt: skip
    tips = [(x_head, "@x"), (y_head, "@y"), (head, "@value{0.00000}")]
    made.add_tools(models.HoverTool(renderers=[drawn], tooltips=tips, visible=False))
    made.add_layout(models.ColorBar(color_mapper=mapper, title=head), "right")
    return made
