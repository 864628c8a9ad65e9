"""Comma-separated tables: a header of names, rows of texts that remember their line."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path

from sweeps.catalogue import PACKAGE
from sweeps.errors import SceneError, counted, one_line, plain_number, shown
from sweeps.reading.guards import regular_bytes

__all__ = [
    "Table",
    "find_header",
    "keep",
    "kept",
    "kept_files",
    "parse_rows",
    "read_table",
    "read_text",
    "reading",
    "referred",
    "with_line",
]

_FILES: ContextVar[_Kept | None] = ContextVar("_FILES", default=None)

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
        try:
            value = plain_number(text)
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


def with_line(message: str, table: Table) -> str:
    """`point 7: ...` becomes `file, line 9: ...`, because people see lines."""
    found = re.match(r"point (\d+): (.*)", message)
    if found is None:
        return f"{table.name}: {message}"
    return f"{table.name}, line {table.lines[int(found.group(1)) - 1]}: {found.group(2)}"


@contextmanager
def reading(name: str, what: str, kind: str = "", *errors: type[Exception]) -> Iterator[None]:
    """Word the failures of opening and reading a file.

    Parameters
    ----------
    name : str
        The file as messages should call it.
    what : str
        What it should be.
    kind : str
        What a file that is there and cannot be read is not, such as "a netCDF file".
    *errors : exception types
        What else a library raises for such a file.

    Raises
    ------
    SceneError
        For a file that is missing or unreadable.
    """
    # ValueError: a null character in the name.
    failures: tuple[type[Exception], ...] = (OSError, ValueError, *errors)
    try:
        yield
    except SceneError:
        raise
    except FileNotFoundError:
        raise SceneError(f"{name}: no such file; expected {what}") from None
    except failures as error:
        reason = one_line(getattr(error, "strerror", None) or error, 200)
        if kind and not isinstance(error, PermissionError | IsADirectoryError):
            raise SceneError(f"{name}: not {kind} ({reason})") from None
        raise SceneError(f"{name}: cannot be read ({reason}); expected {what}") from None


@dataclass(frozen=True)
class _Kept:
    """Files that were read, whether others may be, and the folder of the scene."""

    files: dict[str, bytes]
    closed: bool
    home: Path | None = None


@contextmanager
def kept_files(
    given: Mapping[str, bytes] | None = None, home: Path | None = None
) -> Iterator[dict[str, bytes]]:
    """Keep the texts that are read inside, by name.

    With `given`, they come from there and from no disk: that is how an archive is read again.
    `home` is the folder of the scene.
    """
    held = _Kept(dict(given or {}), given is not None, home)
    token = _FILES.set(held)
    try:
        yield held.files
    finally:
        _FILES.reset(token)


def kept(path: Path) -> bool | None:
    """Whether a file is among those given; None where files are read from the disk."""
    held = _FILES.get()
    return None if held is None or not held.closed else _name(path) in held.files


def keep(files: Mapping[str, bytes]) -> None:
    """Add files that were read before."""
    held = _FILES.get()
    if held is not None:
        held.files.update(files)


def referred(base: Path, text: str, where: str) -> Path:
    """Path of a file that a scene or an engine file names.

    A relative one starts from the folder of the file that names it, and stays in that folder or
    the scene's, also through links: who runs a scene of somebody else does not want it to look
    elsewhere, as archives hold what was read.

    Raises
    ------
    SceneError
        Where it leads out of them.
    """
    path = base / text
    held = _FILES.get()
    given = held is not None and held.closed  # no disk is read
    if given or Path(text).is_absolute() or base.is_relative_to(PACKAGE):
        return path
    homes = [base] if held is None or held.home is None else [base, held.home]
    try:
        real = path.resolve()
        inside = any(real.is_relative_to(home.resolve()) for home in homes)
    except (OSError, ValueError, RuntimeError):  # a null character, links in a circle
        return path  # opening it says what is wrong
    if not inside:
        raise SceneError(
            f"{where} = {shown(text, 300)}: leads out of the folder of the file that names it; "
            f"must be inside, or the whole path, {one_line(real, 300)}"
        )
    return path


def _name(path: Path) -> str:
    """What a file is kept as; those of the package by the place that they have in it."""
    if path.is_relative_to(PACKAGE):
        return path.relative_to(PACKAGE.parent).as_posix()
    return str(path)


def _bytes(path: Path) -> bytes:
    held = _FILES.get()
    if held is None:
        return regular_bytes(path)
    name = _name(path)
    if held.closed:
        if name not in held.files:
            raise FileNotFoundError(name)
        return held.files[name]
    data = held.files[name] = regular_bytes(path)
    return data


def read_text(path: Path, name: str, what: str) -> str:
    """Return the text of a UTF-8 file (a byte order mark at its start is dropped).

    Raises
    ------
    SceneError
        For a file that is missing, unreadable or not text; `what` says what it should be.
    """
    with reading(name, what):
        data = _bytes(path)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SceneError(
            f"{name}: not a text file in UTF-8 (byte {error.start}); expected {what}"
        ) from None


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
    found = find_header(read_text(path, name, what), name, needed=needed)
    if found is None:
        raise SceneError(f"{name}: empty; expected {what}")
    header, rest, line = found
    rows, lines = parse_rows(rest, name, line, header)
    if not rows:
        raise SceneError(f"{name}: a header but no rows; expected {what}")
    return Table(name, header, rows, lines)


def find_header(
    text: str, name: str, first: int = 1, needed: Sequence[str] = ()
) -> tuple[tuple[str, ...], str, int] | None:
    """Names of the columns, what follows their line, and the number of the line that it starts on.

    None where there are only comments and blank lines. `first` is the number of the first line.
    """
    start, number = 0, first
    while start < len(text):
        end = _LINE_END.search(text, start)
        stop, after = (end.start(), end.end()) if end else (len(text), len(text))
        fields = _fields(text[start:stop], name, number)
        if fields is not None:
            _check_header(fields, name, number, needed)
            return fields, text[after:], number + 1
        start, number = after, number + 1
    return None


def parse_rows(
    text: str, name: str, first: int, header: tuple[str, ...]
) -> tuple[tuple[tuple[str, ...], ...], tuple[int, ...]]:
    """Fields of every row and the line that each stands on; `first` is that of the first line.

    Raises
    ------
    SceneError
        With the line: rows that are too short or too long, broken quotes.
    """
    rows: list[tuple[str, ...]] = []
    lines: list[int] = []
    for number, line in enumerate(_LINE_END.split(text), start=first):
        fields = _fields(line, name, number)
        if fields is None:
            continue
        if len(fields) != len(header):
            raise SceneError(
                f"{name}, line {number}: {counted(len(fields), 'field')}, must be {len(header)} "
                f"({one_line(', '.join(header), 200)})"
            )
        rows.append(fields)
        lines.append(number)
    return tuple(rows), tuple(lines)


def _fields(line: str, name: str, number: int) -> tuple[str, ...] | None:
    """Fields of one line, none of a comment or a blank one."""
    if not line.strip() or line.lstrip().startswith("#"):
        return None
    try:
        return tuple(field.strip() for field in next(csv.reader([line], strict=True)))
    except (csv.Error, StopIteration) as error:
        raise SceneError(
            f"{name}, line {number}: {one_line(error)}; fields are separated by commas"
        ) from None


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
