"""How scenes and plans show themselves in a notebook: one line, and a small table in HTML."""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from engine_dyn.quantities.graph import PARAMETERS
from sweeps.base.errors import one_line

FEW = 4  # Largest number of names in a list


def named_some(names: Iterable[str], few: int = FEW) -> str:
    """Return "delta, torque and 3 more"."""
    listed = list(names)
    more = f" and {len(listed) - few} more" if len(listed) > few else ""
    return ", ".join(listed[:few]) + more


def html_tables(
    head: str, rows: Sequence[tuple[str, str]], columns: Mapping[str, Sequence[str]] | None = None
) -> str:
    """Return a head, a table of names and texts, and a table of columns as HTML; all is escaped."""
    cell = 'style="text-align: left; vertical-align: top; padding-right: 1em"'
    lines = [f"<div><p><b>{html.escape(one_line(head))}</b></p>", "<table><tbody>"]
    for name, text in rows:
        lines.append(
            f"<tr><th {cell}>{html.escape(one_line(name))}</th>"
            f"<td {cell}>{html.escape(one_line(text))}</td></tr>"
        )
    lines.append("</tbody></table>")
    if columns:
        heads = "".join(f"<th {cell}>{html.escape(name)}</th>" for name in columns)
        lines.append(f"<table><thead><tr>{heads}</tr></thead><tbody>")
        for row in zip(*columns.values(), strict=True):
            cells = "".join(f"<td {cell}>{html.escape(one_line(text))}</td>" for text in row)
            lines.append(f"<tr>{cells}</tr>")
        lines.append("</tbody></table>")
    return "\n".join([*lines, "</div>"])


def unit_after(key: str) -> str:
    """Return " kg m2" for a parameter; nothing for one without a unit."""
    unit = PARAMETERS[key].unit if key in PARAMETERS else "1"
    return "" if unit in ("", "1") else f" {unit}"


def ends(values: Any) -> str:
    """Return a few values as they are, of more from where to where."""
    if not isinstance(values, np.ndarray):
        return named_some(map(str, values))
    different = np.unique(values)
    if len(different) <= FEW:
        return ", ".join(f"{value:.6g}" for value in dict.fromkeys(values.tolist()))
    return f"{len(different)} values from {different[0]:.6g} to {different[-1]:.6g}"
