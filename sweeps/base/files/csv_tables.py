"""CSV files as texts: a header of unique column names and rows that remember their line.

Every CSV file that a scene or an engine file names is read here, tables of designs, which may have
millions of rows, in pieces (`sweeps.scene.design_files`). Texts of laboratories share `fields`.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sweeps.base.errors import SceneError, counted, one_line, plain_number, shown
from sweeps.base.files.regular_files import read_text
from sweeps.base.ratios import number_or_ratio

# Lines are counted as editors do; str.splitlines would also break at form feeds and the like.
_LINE_END = re.compile(r"\r\n|\r|\n")

BLANKS = r"\s+"  # Separator of columns with blanks between them, as pandas takes it


@dataclass(frozen=True)
class CsvTable:
    """A CSV file as texts."""

    name: str  # The file as messages call it
    header: tuple[str, ...]  # Unique column names
    rows: tuple[tuple[str, ...], ...]  # Fields without surrounding blanks, as many as in the header
    lines: tuple[int, ...]  # Line number of each row in the file, from 1

    def texts(self, column: str) -> tuple[str, ...]:
        """Fields of one column."""
        place = self.header.index(column)
        return tuple(row[place] for row in self.rows)

    def numbers(self, column: str, *, blanks: bool = False, ratios: bool = False) -> list[float]:
        """Return one column as finite numbers, a blank field as NaN where blanks are allowed.

        With `ratios`, fractions such as 1/200 are numbers too.

        Raises
        ------
        SceneError
            For anything else, with the line.
        """
        return [
            self._number(column, text, line, blanks, ratios)
            for text, line in zip(self.texts(column), self.lines, strict=True)
        ]

    def _number(self, column: str, text: str, line: int, blanks: bool, ratios: bool) -> float:
        if blanks and not text:
            return math.nan
        try:
            value = number_or_ratio(text) if ratios else plain_number(text)
        except ValueError:
            pass
        else:
            if math.isfinite(value):
                return value
        what = shown(text) if text else "a blank field"
        also = " or a fraction such as 1/200" if ratios else ""
        also += " or blank" if blanks else ""
        raise SceneError(
            f"{self.name}, line {line}: {column} = {what}: must be a finite number{also}"
        )


def with_line(message: str, table: CsvTable) -> str:
    """Turn `point 7: ...` into `file, line 9: ...`, because editors show lines."""
    match = re.match(r"point (\d+): (.*)", message)
    if match is None:
        return f"{table.name}: {message}"
    return f"{table.name}, line {table.lines[int(match.group(1)) - 1]}: {match.group(2)}"


def read_csv(path: Path, name: str, what: str, needed: Sequence[str] = ()) -> CsvTable:
    """Read a CSV file: comma-separated, a header line, `#` comments and blank lines skipped.

    `name` and `what` are the file as messages call it, and the kind that is expected. Columns
    `needed` must be there; others are kept. Refused, with the line, are a missing header, repeated
    or missing columns, rows that are too short or too long, broken quotes, and a file without rows.
    """
    return csv_of_text(read_text(path, name, what), name, what, needed)


def csv_of_text(text: str, name: str, what: str, needed: Sequence[str] = ()) -> CsvTable:
    """Return the table of a text, as `read_csv` does of a file."""
    start = find_header(text, name, needed=needed)
    if start is None:
        raise SceneError(f"{name}: empty; expected {what}")
    header, rest, line = start
    table = rows_below(header, rest, name, line)
    if not table.rows:
        raise SceneError(f"{name}: a header but no rows; expected {what}")
    return table


def find_header(
    text: str, name: str, first: int = 1, needed: Sequence[str] = ()
) -> tuple[tuple[str, ...], str, int] | None:
    """Return the column names, the text after their line, and the number of its first line.

    None where there are only comments and blank lines. `first` is the number of the first line of
    `text`.
    """
    start, number = 0, first
    while start < len(text):
        end = _LINE_END.search(text, start)
        stop, after = (end.start(), end.end()) if end else (len(text), len(text))
        header = _row(text[start:stop], name, number)
        if header is not None:
            _check_header(header, name, number, needed)
            return header, text[after:], number + 1
        start, number = after, number + 1
    return None


def rows_below(header: tuple[str, ...], text: str, name: str, first: int) -> CsvTable:
    """Return the table of a header and the rows below it, which begin on line `first`.

    Rows that are too short or too long, and broken quotes, are refused with the line.
    """
    rows: list[tuple[str, ...]] = []
    lines: list[int] = []
    for number, line in enumerate(_LINE_END.split(text), start=first):
        row = _row(line, name, number)
        if row is None:
            continue
        if len(row) != len(header):
            raise SceneError(
                f"{name}, line {number}: {counted(len(row), 'field')}, must be {len(header)}"
            )
        rows.append(row)
        lines.append(number)
    return CsvTable(name, header, tuple(rows), tuple(lines))


def fields(line: str, separator: str = ",", *, strict: bool = False) -> list[str]:
    """Fields of one line; where its quotes are broken, it is cut at each separator.

    With `strict`, such a line raises ValueError.
    """
    if separator == BLANKS:
        return line.split()
    try:
        return next(csv.reader([line], delimiter=separator, strict=strict), [])
    # A null character and a separator of two characters raise these too
    except (csv.Error, TypeError) as error:
        if strict:
            raise ValueError(str(error)) from None
        return line.split(separator)


def _row(line: str, name: str, number: int) -> tuple[str, ...] | None:
    """Fields of one line; None for comments and blank lines."""
    if not line.strip() or line.lstrip().startswith("#"):
        return None
    try:
        return tuple(field.strip() for field in fields(line, strict=True))
    except ValueError as error:
        raise SceneError(
            f"{name}, line {number}: {one_line(error)}; fields are separated by commas"
        ) from None


def _check_header(header: tuple[str, ...], name: str, line: int, needed: Sequence[str]) -> None:
    # Any file may be named: the message must not show the content of a file that is not ours.
    for number, column in enumerate(header, start=1):
        if not column:
            raise SceneError(f"{name}, line {line}: a column without a name")
        if column in header[: number - 1]:
            first = header.index(column) + 1
            raise SceneError(
                f"{name}, line {line}: two columns, {first} and {number}, have one name"
            )
    for column in needed:
        if column not in header:
            raise SceneError(
                f"{name}, line {line}: no column '{column}'; "
                f"needed: {', '.join(needed)}, separated by commas"
            )
