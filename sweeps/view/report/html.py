"""Pieces of HTML: whatever an archive says goes through `text`."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from sweeps.base.errors import one_line, printable
from sweeps.view.texts.readable_units import converted

if TYPE_CHECKING:
    import xarray as xr


def text(value: object, limit: int = 1000) -> str:
    """Return a text on one line, in which nothing is markup."""
    return html.escape(one_line(value, limit), quote=True)


def paragraph(value: object, kind: str = "") -> str:
    """Return a paragraph; `kind` is a class of the style sheet."""
    return f'<p class="{kind}">{text(value)}</p>' if kind else f"<p>{text(value)}</p>"


def listed(values: Iterable[object]) -> str:
    """Return a list of lines."""
    return "<ul>" + "".join(f"<li>{text(value)}</li>" for value in values) + "</ul>"


def preformatted(value: str, limit: int = 20_000) -> str:
    """Return a text with its line ends."""
    cut = value if len(value) <= limit else value[: limit - 3] + "..."
    return f"<pre>{html.escape(printable(cut))}</pre>"


def details(title: str, inside: str) -> str:
    """Return what is folded until it is asked for."""
    return f"<details><summary>{text(title)}</summary>{inside}</details>"


def table(
    head: Sequence[str], rows: Iterable[Sequence[object]], numbers: Sequence[int] = ()
) -> str:
    """Return a table in a box in which it scrolls; `numbers` are places of columns of numbers."""

    def cell(tag: str, place: int, value: object) -> str:
        kind = ' class="number"' if place in numbers else ""
        return f"<{tag}{kind}>{text(value)}</{tag}>"

    parts = ['<div class="scroll" tabindex="0"><table>']
    if any(head):
        parts += ["<thead><tr>", *(cell("th", i, h) for i, h in enumerate(head)), "</tr></thead>"]
    parts.append("<tbody>")
    for row in rows:
        parts += ["<tr>", *(cell("td", i, value) for i, value in enumerate(row)), "</tr>"]
    return "".join((*parts, "</tbody></table></div>"))


def filled(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """Return a table, as `table`, without the columns that are empty."""
    kept = [i for i in range(len(head)) if any(row[i] for row in rows)]
    return table(
        [head[i] for i in kept], [[row[i] for i in kept] for row in rows],
        [place for place, i in enumerate(kept) if i in numbers],
    )  # fmt: skip


FIRST_ROWS = 20  # Number of first designs that are shown if there are too many for all


def value_text(variable: xr.Variable | xr.DataArray, value: Any, choice: str | None) -> str:
    """Return a number with its unit, or a word."""
    if variable.dtype.kind not in "fiub":
        return one_line(value, 60)
    factor, unit = converted(str(variable.attrs.get("units", "1")), choice)
    return f"{float(value) * factor:.6g} {one_line(unit, 30)}".rstrip()
