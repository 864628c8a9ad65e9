"""Tables of the documentation as CSV files, which lie beside their page."""

from __future__ import annotations

import csv
import io
import re


def rows_of(text: str) -> list[list[str]]:
    """Cells of a Markdown table: the heads, then each row."""
    lines = [line[2:-2].split(" | ") for line in text.strip().splitlines()]
    return [[cell.strip() for cell in line] for line in (lines[0], *lines[2:])]


def as_csv(text: str) -> str:
    """The same table as a CSV file; names stand in it without marks."""
    file = io.StringIO()
    csv.writer(file, lineterminator="\n").writerows(
        [re.sub(r"`|\*\*", "", cell) for cell in row] for row in rows_of(text)
    )
    return file.getvalue()
