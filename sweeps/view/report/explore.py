"""The explorer of a report over a whole archive, in a notebook or served by Panel.

Only what is drawn is read: a line, a map of some cells, the curves of one design. The archive may
be larger than memory.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.status import MEANINGS
from sweeps.base.errors import SceneError, one_line
from sweeps.base.files.libraries import library
from sweeps.base.numbers import number_text
from sweeps.view.figures.wording import equal_lines
from sweeps.view.report import charts
from sweeps.view.report.charts import COLOURS, Specification
from sweeps.view.report.embedding import (
    choices_of,
    columns_along,
    described,
    is_list,
    is_words,
    text_of,
)
from sweeps.view.report.key_figures import views
from sweeps.view.texts.readable_units import converted
from sweeps.view.texts.tables import last_digits

if TYPE_CHECKING:
    import xarray as xr


Values = npt.NDArray[Any]

OF_CURVES = ("crank_angle", "order")

MOST_OPTIONS = 1000
"""Largest number of values of an axis whose slider shows the values themselves, not their
numbers."""

MOST_POINTS = 5000  # Largest number of points of a line


MOST_CELLS = 200  # Largest number of cells along a side of a map


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
    # Inline resources need no network; a slider counts only when it is let go.
    panel.extension(inline=True, throttled=True)
    if isinstance(archive, str | Path):
        from sweeps.decide.explore.opening import open as open_any

        archive = open_any(archive)
    return _Explorer(archive, units, panel).layout()


class _Explorer:
    """Widgets of an archive, and the figures that they draw."""

    def __init__(self, archive: xr.Dataset, units: str | None, panel: Any) -> None:
        self.archive, self.panel = archive, panel
        self.choices = choices_of(archive, units)
        self.page = described(archive, self.choices)
        self.names = [name for name in self.page.quantities if name != "status"]
        if not self.names:
            raise SceneError("explore: the archive has no numbers")
        self.columns = columns_along(archive, self.names)
        self.axes = {
            dim: self._slider(dim) for dim, axis in self.page.axes.items()
            if not axis["of_curves"] and axis["count"] > 1
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
        return str((self.page.columns.get(key) or self.page.quantities[key])["unit"])

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
        texts = [_text(v) for v in self.along(key, slice(None))]
        if len(set(texts)) < len(texts):
            texts = [f"{i + 1}: {text}" for i, text in enumerate(texts)]
        options = {text: i for i, text in enumerate(texts)}
        if own:
            return widgets.Select(label=label, options=options, value=0, width=250)
        return widgets.DiscreteSlider(label=label, options=options, value=size // 2, width=250)

    # ---- views -----------------------------------------------------------------------------------

    def layout(self) -> Any:
        """All of it below each other."""
        panel = self.panel
        single = [n for n in self.names if not set(self.archive[n].dims) & set(OF_CURVES)]
        parts = [self._numbers(single)] if single else []
        parts += [self._view(view) for view in views(self.page)]
        title = one_line(self.archive.attrs.get("title") or "Archive", 200)
        return panel.Column(
            panel.pane.Str(title, styles={"font-size": "18px", "font-weight": "600"}),
            panel.FlexBox(*self.axes.values()),
            panel.FlexBox(*parts),
        )

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
            values = {name: float(self.read(name, {})) for name in names}
            lasts = last_digits(values)
            for name, number in values.items():
                value = number_text(number, last=lasts.get(name))
                rows.append((name, value, self._unit(name), text_of(self.archive[name], name)))
            if "status" in self.archive:
                dims = self.archive["status"].dims
                code = int(self.archive["status"].isel({d: self.at().get(str(d), 0) for d in dims}))
                told = MEANINGS[code] if 0 <= code < len(MEANINGS) else str(code)
                rows.append(("outcome", told.replace("_", " "), "", ""))
            pane.object = pd.DataFrame(rows, columns=["quantity", "value", "unit", "meaning"])

        self._watched(list(self.axes.values()), update)
        return self.panel.Column(pane, name="numbers")

    def _view(self, view: Specification) -> Any:
        """Selectors above a figure; each option is a part of the figure's specification."""
        choices = [dict(choice["options"]) for choice in view["choices"]]
        selects = [
            self.panel.widgets.Select(
                label=choice["label"], options=[*options], width=155,
                value=choice["options"][choice["chosen"]][0],
            )
            for choice, options in zip(view["choices"], choices, strict=True)
        ]  # fmt: skip
        pane = self.panel.pane.Bokeh()

        def update() -> None:
            spec: Specification = {}
            for select, options in zip(selects, choices, strict=True):
                spec |= options[select.value]
            pane.object = self._drawn(view["kind"], spec)

        self._watched([*selects, *self.axes.values()], update)
        return self.panel.Column(self.panel.Row(*selects), pane, name=view["title"])

    def _drawn(self, kind: str, spec: Specification) -> Any:
        name, keys = spec["quantities"][0], [spec[side] for side in "xy" if side in spec]
        dims = self.archive[name].dims
        for key in keys:
            if self.page.columns[key]["dim"] not in dims:
                return charts.models().PreText(text=f"{name} does not depend on {key}.")
        if keys == keys[:1] * 2:
            return charts.models().PreText(text="Choose two different axes.")
        return (
            self._map(keys[0], keys[1], name)
            if kind == "map"
            else self._lines(spec, stems=kind == "stems")
        )

    def _figure(
        self, make: Any, heads: Sequence[str], axes: Mapping[str, list[Any]], **options: Any
    ) -> Any:
        """Make a figure; words along its axes become categories."""
        words = {
            f"{side}_range": list(dict.fromkeys(values))
            for side, values in axes.items() if values and isinstance(values[0], str)
        }  # fmt: skip
        made = make(width=520, sizing_mode="fixed", x_axis_label=heads[0], y_axis_label=heads[1],
                    **words, **options)  # fmt: skip
        return made, not words

    def _lines(self, spec: Specification, *, stems: bool) -> Any:
        names, key = spec["quantities"], spec["x"]
        dim, dims = self.page.columns[key]["dim"], self.archive[names[0]].dims
        index = self.thinned(dim, MOST_POINTS)
        x = self.along(key, index)
        heads = [
            self.head(key),
            self.head(names[0]) if len(names) == 1 else f"[{self._unit(names[0])}]",
        ]
        series: list[tuple[str, str, dict[str, Any]]] = [(name, name, {}) for name in names]
        lines = str(spec.get("lines"))
        if lines in dims and lines != dim:
            # All misfires are compared: mostly, those that are alike leave few lines.
            most = self.archive.sizes[lines] if lines == "misfire" else len(COLOURS)
            of_lines = self.thinned(lines, most)
            values = self.along(lines, of_lines)
            numbers = range(*of_lines.indices(self.archive.sizes[lines]))
            series = [
                (f"{lines} {_text(v)}", names[0], {lines: i})
                for i, v in zip(numbers, values, strict=True)
            ]
        loop = [spec[side] for side in ("right", "up") if side in spec]
        if loop:
            heads = [self.head(name) for name, _ in loop]
        made, numeric = self._figure(
            partial(charts.lines, len(series), stems=stems), heads, {} if loop else {"x": x}
        )
        made.match_aspect = bool(loop)
        for name in ("across", "up"):
            made.select_one({"name": name}).visible = bool(loop)
        joined = stems or (self.page.axes[dim]["joined"] and numeric)
        item = charts.models().LegendItem
        pairs = list(zip(made.renderers[::2], made.renderers[1::2], strict=True))
        drawn = []
        for _, name, place in series:
            values = [
                self.read(
                    one, {dim: index, **place} | ({} if at is None else {"direction": at}), [dim]
                )
                for one, at in loop or [(name, None)]
            ]
            if loop:  # The curve is closed
                values = [np.append(v, v[:1]) for v in values]
            drawn.append({"x": values[0] if loop else x, "y": values[-1]})
        told = dict(enumerate(label for label, _, _ in series))
        if lines == "misfire":
            told = dict(equal_lines(list(told.values()), [one["y"] for one in drawn]))
        pairs = [pairs[i] for i in told]
        for (i, label), (line, scatter) in zip(told.items(), pairs, strict=True):
            line.data_source.data = drawn[i]
            line.visible, scatter.visible = joined, stems or not joined
            line.name = scatter.name = one_line(label, 60)
            used = [r for r in (line, scatter) if r.visible]
            if len(series) > 1:
                made.legend.items.append(item(label=line.name, renderers=used))
        made.legend.ncols = 4
        made.select_one({"name": "hover"}).update(
            renderers=[line if joined else scatter for line, scatter in pairs],
            tooltips=[("", "$name"), (heads[0], "@x"), (heads[1], "@y{0.00000}")],
        )
        return made

    def _map(self, across: str, up: str, name: str) -> Any:
        one, other = (self.page.columns[key]["dim"] for key in (across, up))
        if one == other:
            index = self.thinned(one, MOST_POINTS)
            x, y = self.along(across, index), self.along(up, index)
            values = self.read(name, {one: index}, [one])
        else:
            places = {d: self.thinned(d, MOST_CELLS) for d in (one, other)}
            xs, ys = self.along(across, places[one]), self.along(up, places[other])
            values = self.read(name, places, [other, one]).reshape(-1)
            x, y = xs * len(ys), [v for v in ys for _ in xs]
        finite = values[np.isfinite(values)]
        low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
        heads = [self.head(key) for key in (across, up, name)]
        # On a linear scale, numbers over more than a decade would leave most of a map one colour.
        made, numeric = self._figure(
            charts.cells, heads, {"x": x, "y": y}, log=low > 0.0 and high / low > 20.0
        )
        bar, (quads, points) = made.select_one({"name": "bar"}), made.renderers[:2]
        bar.title = heads[2]
        bar.color_mapper.update(low=low, high=high)
        quads.visible = (
            one != other and numeric and bool(np.isfinite(x).all() and np.isfinite(y).all())
        )
        points.visible = not quads.visible
        points.glyph.update(marker="square", size=9, line_color=None)
        (left, right), (bottom, top) = (
            _edges(v, self.page.axes[dim]["joined"]) if quads.visible else (v, v)
            for v, dim in ((x, one), (y, other))
        )
        quads.data_source.data = {
            "x": x, "y": y, "left": left, "right": right, "bottom": bottom, "top": top,
            "value": values, "told": values,
        }  # fmt: skip
        made.select_one({"name": "hover"}).tooltips = [
            (heads[0], "@x"), (heads[1], "@y"), (heads[2], "@value{0.00000}"),
        ]  # fmt: skip
        return made


def _text(value: Any) -> str:
    return value if isinstance(value, str) else f"{value:.6g}"


def _edges(values: list[Any], joined: bool) -> tuple[list[float], list[float]]:
    """Edges of cells: half-way between their points, and no farther than these on a joined axis."""
    points = sorted(set(values))
    if len(points) < 2:
        middles = [points[0] - 0.5, points[0] + 0.5]
    else:
        inner = [(a + b) / 2.0 for a, b in pairwise(points)]
        ends = [points[0], points[-1]]
        if not joined:
            ends = [2.0 * ends[0] - inner[0], 2.0 * ends[1] - inner[-1]]
        middles = [ends[0], *inner, ends[1]]
    place = {value: i for i, value in enumerate(points)}
    return [middles[place[v]] for v in values], [middles[place[v] + 1] for v in values]
