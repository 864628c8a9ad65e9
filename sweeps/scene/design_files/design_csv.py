"""Tables of designs from CSV files: fast where a piece of the file is plain, careful elsewhere."""

from __future__ import annotations

import csv
import io
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from sweeps.base.checks import check_range, is_ratio, outside
from sweeps.base.errors import SceneError
from sweeps.base.files.csv_tables import CsvTable, find_header, parse_rows
from sweeps.base.files.regular_files import opened_file, reading
from sweeps.scene.design_files.design_columns import DesignColumns, known_columns

PIECE = 1 << 20
"""Approximate number of bytes of a CSV file that are parsed at a time; line by line this takes
fifty times as much memory."""

LONGEST_LINE = 1 << 20  # Largest number of bytes of one line


def read_design_csv(path: Path, name: str) -> DesignColumns:
    """Read comma-separated columns: fast where a piece is plain, line by line where it is not."""
    what = "a table of designs (CSV)"
    columns: DesignColumns | None = None
    header: tuple[str, ...] = ()
    first, offset, rows = 1, 0, 0
    for piece in _pieces(path, name, what):
        body, line = piece, first
        if columns is None:
            found = find_header(_decoded(piece, name, what, offset), name, first)
            if found is None:
                first, offset = first + _line_ends(piece), offset + len(piece)
                continue
            header, rest, line = found
            columns = DesignColumns(name, known_columns(list(header), name, "column"))
            body = rest.encode()
        elif not body.isascii():  # the fast parser takes bytes, which must be text
            _decoded(body, name, what, offset)
        rows += _take_csv(columns, header, body, line)
        first, offset = first + _line_ends(piece), offset + len(piece)
    if columns is None:
        raise SceneError(f"{name}: empty; expected {what}")
    if not rows:
        raise SceneError(f"{name}: a header but no rows; expected {what}")
    return columns


def _pieces(path: Path, name: str, what: str) -> Iterator[bytes]:
    """Parts of a file that end where lines end; without a byte order mark."""
    with reading(name, what), opened_file(path) as stream:
        if stream.read(3) != b"\xef\xbb\xbf":
            stream.seek(0)
        while piece := stream.read(PIECE):
            if not piece.endswith(b"\n"):
                piece += (rest := stream.readline(LONGEST_LINE))
                if len(rest) == LONGEST_LINE:
                    raise SceneError(f"{name}: a line of more than {LONGEST_LINE} bytes")
            yield piece


def _decoded(piece: bytes, name: str, what: str, offset: int) -> str:
    try:
        return piece.decode()
    except UnicodeDecodeError as error:
        raise SceneError(
            f"{name}: not a text file in UTF-8 (byte {offset + error.start}); expected {what}"
        ) from None


def _line_ends(piece: bytes) -> int:
    """Number of line ends, as editors count them."""
    if b"\r" not in piece:
        return piece.count(b"\n")
    return piece.count(b"\n") + piece.count(b"\r") - piece.count(b"\r\n")


def _take_csv(columns: DesignColumns, header: tuple[str, ...], body: bytes, first: int) -> int:
    """Append the rows of one piece, which starts on line `first`; return their number."""
    numbers = [key for key, node in columns.nodes.items() if node is not None]
    labels = [key for key in header if key not in numbers]
    frame = _parsed(body, header, labels)
    if frame is not None and not any(
        outside(frame[key], node).any() for key, node in columns.nodes.items() if node is not None
    ):
        for key in header:
            columns.take(key, frame[key])
        return len(frame[header[0]])
    # The fast parser refused the piece: read it line by line, and say what is wrong.
    rows, lines = parse_rows(body.decode(), columns.name, first, header)
    table = CsvTable(columns.name, header, rows, lines)
    for key in header:
        node = columns.nodes[key]
        if node is None:
            columns.take(key, table.texts(key))
            continue
        values = np.array(table.numbers(key, ratios=is_ratio(node)), dtype=np.float64)
        bad = np.flatnonzero(outside(values, node))
        if bad.size:
            check_range(values[bad[0]], f"{columns.name}, line {lines[bad[0]]}: {key}", node)
        columns.take(key, values)
    return len(rows)


def _parsed(body: bytes, header: tuple[str, ...], labels: list[str]) -> dict[str, Any] | None:
    """Columns of a piece of plain CSV; None for anything that pandas might read differently."""
    if not body:
        return None
    if not labels:
        if body.translate(None, b"0123456789+-.eE, \t\r\n"):
            return None
    elif any(mark in body for mark in (b'"', b"#", b"\0")):
        return None
    if (b"\r" in body and body.count(b"\r") != body.count(b"\r\n")) or body.isspace():
        return None
    import pandas as pd

    # Up to pandas 3.0, the default converter may err in the last digit; the exact one costs little.
    old = tuple(int(part) for part in pd.__version__.split(".")[:2]) < (3, 1)
    options: dict[str, Any] = {"float_precision": "round_trip"} if old else {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            frame = pd.read_csv(
                io.BytesIO(body),
                header=None,
                names=list(header),
                dtype={key: object if key in labels else np.float64 for key in header},
                index_col=False,
                na_filter=False,
                quoting=csv.QUOTE_NONE,
                engine="c",
                **options,
            )
    except (ValueError, Warning):  # also pandas' own errors
        return None
    commas = int(np.count_nonzero(np.frombuffer(body, dtype=np.uint8) == ord(",")))
    if commas != len(frame) * (len(header) - 1):
        return None  # rows too long or too short
    columns: dict[str, Any] = {}
    for key in header:
        if key in labels:
            columns[key] = [str(text).strip() for text in frame[key]]
            continue
        # A copy, because a column of the frame would keep the whole frame alive.
        columns[key] = values = np.array(frame[key], dtype=np.float64)
        # Beside labels, the words true and false would pass for numbers.
        if not np.isfinite(values).all() or (labels and ((values == 0) | (values == 1)).all()):
            return None
    return columns
