"""Comma-separated tables: a header of names, rows of texts that remember their line."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sweeps.errors import SceneError, counted, one_line, shown

__all__ = ["Table", "read_table", "read_text"]

# As editors count lines; str.splitlines would also break at form feeds and the like.
_LINE_END = re.compile(r"\r\n|\r|\n")


@dataclass(frozen=True)
class Table:
    """A CSV file as texts.

    Attributes
    ----------
    name : str
        The file as messages call it.
    header : tuple of str
        Column names, unique.
    rows : tuple of tuple of str
        Fields without surrounding blanks, each row as long as the header.
    lines : tuple of int
        Line of the file that each row stands on, from 1.
    """

    name: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]

    def texts(self, column: str) -> tuple[str, ...]:
        """Fields of one column."""
        place = self.header.index(column)
        return tuple(row[place] for row in self.rows)

    def numbers(self, column: str, *, blanks: bool = False) -> list[float]:
        """Return one column as finite numbers, a blank field as NaN where blanks are allowed.

        Raises
        ------
        SceneError
            For anything else, with the line.
        """
        return [
            self._number(column, text, line, blanks)
            for text, line in zip(self.texts(column), self.lines, strict=True)
        ]

    def _number(self, column: str, text: str, line: int, blanks: bool) -> float:
        if blanks and not text:
            return math.nan
        # float() would take 1_000 and the digits of other scripts.
        if text.isascii() and "_" not in text:
            try:
                value = float(text)
            except ValueError:
                pass
            else:
                if math.isfinite(value):
                    return value
        what = shown(text) if text else "a blank field"
        also = " or blank" if blanks else ""
        raise SceneError(
            f"{self.name}, line {line}: {column} = {what}: must be a finite number{also}"
        )


def read_text(path: Path, name: str, what: str) -> str:
    """Return the text of a UTF-8 file (a byte order mark at its start is dropped).

    Raises
    ------
    SceneError
        For a file that is missing, unreadable or not text; `what` says what it should be.
    """
    try:
        return path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SceneError(
            f"{name}: not a text file in UTF-8 (byte {error.start}); expected {what}"
        ) from None
    except FileNotFoundError:
        raise SceneError(f"{name}: no such file; expected {what}") from None
    except (OSError, ValueError) as error:  # ValueError: a null character in the name
        reason = getattr(error, "strerror", None) or error
        raise SceneError(f"{name}: cannot be read ({one_line(reason)}); expected {what}") from None


def read_table(path: Path, name: str, what: str, needed: Sequence[str] = ()) -> Table:
    """Read a CSV file: comma-separated, a header line, `#` comments and blank lines skipped.

    Parameters
    ----------
    path : Path
        The file.
    name : str
        The file as messages should call it.
    what : str
        What the file should be, for messages.
    needed : sequence of str
        Columns that must be there; others are kept.

    Raises
    ------
    SceneError
        With the line: no header, repeated or missing columns, rows that are too short or too
        long, broken quotes, no rows.
    """
    header: tuple[str, ...] | None = None
    rows: list[tuple[str, ...]] = []
    lines: list[int] = []
    for number, line in enumerate(_LINE_END.split(read_text(path, name, what)), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            fields = tuple(field.strip() for field in next(csv.reader([line], strict=True)))
        except (csv.Error, StopIteration) as error:
            raise SceneError(
                f"{name}, line {number}: {one_line(error)}; fields are separated by commas"
            ) from None
        if header is None:
            header = fields
            _check_header(header, name, number, needed)
        elif len(fields) != len(header):
            raise SceneError(
                f"{name}, line {number}: {counted(len(fields), 'field')}, must be {len(header)} "
                f"({one_line(', '.join(header), 200)})"
            )
        else:
            rows.append(fields)
            lines.append(number)
    if header is None:
        raise SceneError(f"{name}: empty; expected {what}")
    if not rows:
        raise SceneError(f"{name}: a header but no rows; expected {what}")
    return Table(name, header, tuple(rows), tuple(lines))


def _check_header(header: tuple[str, ...], name: str, line: int, needed: Sequence[str]) -> None:
    seen: set[str] = set()
    for column in header:
        if not column:
            raise SceneError(f"{name}, line {line}: a column without a name")
        if column in seen:
            raise SceneError(f"{name}, line {line}: two columns are named {shown(column)}")
        seen.add(column)
    for column in needed:
        if column not in seen:
            found = one_line(", ".join(header), 200)
            raise SceneError(
                f"{name}, line {line}: no column '{column}' (found: {found}); "
                f"needed: {', '.join(needed)}, separated by commas"
            )
