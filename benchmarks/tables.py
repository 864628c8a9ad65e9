"""Numbers and tables of the documents that are made here, CSV files and Markdown; TOML."""

from __future__ import annotations

import csv
import json
import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any


def number(value: float, digits: int = 2) -> str:
    """A count or rate with two digits and thousands marked."""
    if not math.isfinite(value):
        return "-"
    if value == 0.0:
        return "0"
    rounded = float(f"{value:.{digits - 1}e}")
    return f"{rounded:,.0f}" if abs(rounded) >= 10.0 else f"{rounded:g}"


def small(value: float) -> str:
    """An error."""
    return "-" if not math.isfinite(value) else f"{value:.1e}"


def span(seconds: float) -> str:
    """A time in the unit that suits it."""
    if not math.isfinite(seconds):
        return "-"
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("µs", 1e6)):
        if seconds * factor >= 1.0:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def rows(head: Sequence[str], body: Sequence[Sequence[str]], right: bool = True) -> list[str]:
    """A table in Markdown; all but the first column to the right unless told otherwise."""
    marks = ["---"] + ["---:" if right else "---"] * (len(head) - 1)
    return ["| " + " | ".join(line) + " |" for line in (head, marks, *body)]


def save(
    path: Path, head: Sequence[str], body: Iterable[Sequence[str]], marks: bool = False
) -> None:
    """Write a table as a file; its cells have no marks unless told otherwise."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        unwanted = "" if marks else r"`|\*"
        writer.writerows([re.sub(unwanted, "", cell) for cell in row] for row in (head, *body))


def read(path: Path) -> list[dict[str, str]]:
    """Rows of a file; none where it was not written."""
    if not path.is_file():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


# TOML --------------------------------------------------------------------------------------------


def toml_text(tree: dict[str, Any]) -> str:
    """TOML of a tree; tables are inline ones."""
    return "".join(f"{_key(key)} = {_value(value)}\n" for key, value in tree.items())


def _key(key: str) -> str:
    return json.dumps(key).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, int) and abs(value) > 10**300:
        return hex(value) if value > 0 else "-1" + "0" * 400
    return str(value)
