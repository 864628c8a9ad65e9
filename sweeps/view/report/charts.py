"""Figures of reports and of the explorer in notebooks, in Bokeh.

Each is made empty. A notebook fills their sources with what it reads of an archive; a page holds
them as JSON of `bokeh.embed`, and `program.js` fills them with what its numbers say.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sweeps.base.files.libraries import library

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8a6d3b")


MISSING = "#c8c8c8"
"""Colour of cells without a value."""


NAMED = {"lines": ("x", "y", "legend", "hover", "across", "up"), "map": ("x", "y", "hover")}
"""Parts of figures with names, by which the program of a page finds them."""

Specification = dict[str, Any]


def charts(figures: Sequence[Specification], views: Sequence[Specification]) -> dict[str, Any]:
    """Return figures of each kind that a page needs, as JSON of Bokeh, and their colours."""
    from bokeh.embed import json_item
    from bokeh.palettes import Viridis256

    made = {
        kind: cells() if kind == "map" else lines(stems=kind == "stems")
        for kind in {one["kind"] for one in (*figures, *views)}
    }
    return {
        "charts": {kind: json_item(figure) for kind, figure in made.items()},
        "named": {kind: NAMED.get(kind, NAMED["lines"]) for kind in made},
        "colours": Viridis256, "series": COLOURS, "missing": MISSING,
    }  # fmt: skip


@dataclass(frozen=True)
class Drawn:
    """A figure that is complete with its numbers."""

    title: str
    note: str
    figure: Any


def made_charts(drawn: Sequence[Drawn]) -> list[dict[str, Any]]:
    """Return complete figures as JSON of Bokeh, with their titles and notes."""
    from bokeh.embed import json_item

    return [{"title": one.title, "note": one.note, "chart": json_item(one.figure)} for one in drawn]


def models() -> Any:
    """Return Bokeh's models; without Bokeh, an error says how to install it."""
    return library("bokeh.models", "bokeh", "report", extra="report")


def _figure(height: int, **options: Any) -> Any:
    from bokeh.plotting import figure

    options = {"sizing_mode": "stretch_width"} | options
    made = figure(height=height, tools="pan,box_zoom,wheel_zoom,reset,save", active_scroll=None,
                  active_drag="box_zoom", toolbar_location="above", min_border_right=12,
                  outline_line_color="#bbb", **options)  # fmt: skip
    made.toolbar.logo = None
    # The page's own style sheet does not reach into a figure of Bokeh.
    hidden = models().InlineStyleSheet(css="@media print { :host { display: none; } }")
    made.toolbar.stylesheets = [hidden]
    for side, axis, grid in (
        ("x", made.xaxis[0], made.xgrid[0]),
        ("y", made.yaxis[0], made.ygrid[0]),
    ):
        axis.name, axis.axis_label_text_font_style, axis.axis_label_text_color = (
            side,
            "normal",
            "#333",
        )
        grid.grid_line_color = "#e5e5e5"
    return made


def lines(count: int = 1, *, stems: bool = False, height: int = 330, **options: Any) -> Any:
    """Return a figure of some series; each has a source (x, y), a line or stems, and points.

    They are its renderers, by turns. The legend, below, hides them.
    """
    bokeh = models()
    made = _figure(height, **options)
    for place in range(count):
        source = bokeh.ColumnDataSource({"x": [], "y": []})
        colour = COLOURS[place % len(COLOURS)]
        line = {"line_color": colour, "line_width": 2}
        if stems:
            made.add_glyph(source, bokeh.Segment(x0="x", y0={"value": 0.0}, x1="x", y1="y", **line))
        else:
            made.add_glyph(source, bokeh.Line(x="x", y="y", **line))
        made.add_glyph(
            source, bokeh.Scatter(x="x", y="y", size=7, line_color=colour, fill_color=colour)
        )
    legend = bokeh.Legend(
        name="legend", click_policy="hide", border_line_color=None, orientation="horizontal",
        label_text_font_size="12px", margin=2, padding=2, spacing=8, location="top_left",
    )  # fmt: skip
    made.add_layout(legend, "below")
    for name, along in (("across", "width"), ("up", "height")):  # Lines through the origin
        made.add_layout(
            bokeh.Span(name=name, dimension=along, location=0.0, line_color="#aaa", visible=False)
        )
    made.add_tools(bokeh.HoverTool(name="hover", visible=False))
    return made


def cells(*, log: bool = False, height: int = 380, **options: Any) -> Any:
    """Return a map: cells (left, right, bottom, top), points (x, y) and a mark, with their colours.

    The numbers are the column `value` of the first source, which cells and points share.
    """
    bokeh = models()
    made = _figure(height, **options)
    columns = ("x", "y", "left", "right", "bottom", "top", "value", "told")
    source = bokeh.ColumnDataSource({name: [] for name in columns})
    mark = bokeh.ColumnDataSource({"x": [], "y": []})
    scale = bokeh.LogColorMapper if log else bokeh.LinearColorMapper
    mapper = scale("Viridis256", nan_color=MISSING)
    of = {name: {"field": "value", "transform": mapper} for name in ("fill_color", "line_color")}
    sides = {name: name for name in ("left", "right", "bottom", "top")}
    made.add_glyph(source, bokeh.Quad(**sides, **of))
    made.add_glyph(source, bokeh.Scatter(x="x", y="y", size=6, **of))
    for colour, size, width in (("white", 16, 5), ("black", 14, 2)):
        cross = {"marker": "cross", "size": size, "line_color": colour, "line_width": width}
        made.add_glyph(mark, bokeh.Scatter(x="x", y="y", **cross))
    made.add_layout(bokeh.ColorBar(name="bar", color_mapper=mapper, width=14, padding=4), "right")
    made.add_tools(bokeh.HoverTool(name="hover", visible=False, renderers=made.renderers[:2]))
    return made
