"""Tables of designs from files: CSV, netCDF or Parquet, by the ending of their name.

Tables have millions of rows: columns are read as arrays, piece by piece, and a row is looked at by
itself only to say what is wrong with it. Columns are in the units of scenes; where a file says its
units, they must be those.
"""

from __future__ import annotations

import csv
import io
import json
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.quantities.graph import QUANTITIES
from engine_dyn.quantities.node import Node
from engine_dyn.types import Floats
from sweeps.checks import allowed, check_range, known_key, outside
from sweeps.errors import SceneError, counted, one_line, shown
from sweeps.reading.guards import TEXT_REFERENCE, check_chunks, check_rows, netcdf, opened_file
from sweeps.reading.tables import Table, find_header, parse_rows, reading

__all__ = ["LABELS", "SUFFIXES", "read_designs"]


LABELS = ("case",)
"""Columns that hold texts and name the designs."""

PIECE = 1 << 24
"""Bytes of a CSV file that are parsed at a time, about."""

ODD_PIECE = 1 << 20
"""Bytes that are parsed at a time where something is odd: it takes fifty times as many."""

LONGEST_LINE = 1 << 20
"""Bytes of a line of a CSV file."""

ROWS = 1 << 18
"""Rows of a netCDF or Parquet file that are read at a time."""

DESIGN = "design"

_OF_NUMBERS = b"0123456789+-.eE, \t\r\n"

_SPELLINGS = {
    "": "1", "-": "1", "dimensionless": "1", "%": "percent", "deg": "degree", "degrees": "degree",
    "rad/s": "rad s-1", "bar s/m": "bar s m-1", "min-1": "rpm", "1/min": "rpm",
}  # fmt: skip
"""Other ways to write the units of scenes."""


@dataclass
class _Columns:
    """Columns as they are read, piece by piece."""

    name: str
    nodes: Mapping[str, Node | None]
    pieces: dict[str, list[Floats]] = field(default_factory=dict)
    texts: dict[str, list[str]] = field(default_factory=dict)

    def take(self, key: str, values: Any) -> None:
        """Append a piece of a column: numbers, or the texts of labels."""
        if self.nodes[key] is None:
            self.texts.setdefault(key, []).extend(one_line(text) for text in values)
        else:
            self.pieces.setdefault(key, []).append(values)

    def whole(self) -> tuple[dict[str, Floats], dict[str, tuple[str, ...]]]:
        """Columns of numbers and of labels; the pieces are given up."""
        numbers = {}
        for key in [key for key, node in self.nodes.items() if node is not None]:
            numbers[key] = np.concatenate(self.pieces.pop(key))
        return numbers, {key: tuple(texts) for key, texts in self.texts.items()}


def read_designs(path: Path, name: str) -> tuple[dict[str, Floats], dict[str, tuple[str, ...]]]:
    """Read the table of [designs] file.

    Parameters
    ----------
    path : Path
        A file that ends with one of `SUFFIXES`.
    name : str
        The file as messages should call it.

    Returns
    -------
    columns, labels : dict
        Numbers of parameters in the units of files, within their physical range, and texts.

    Raises
    ------
    SceneError
        In one line: another ending; a file that is missing or not of its kind; columns that are
        unknown, not numeric, of other units or along more than one dimension; missing values and
        values outside their range, with line or row.
    """
    read = _READERS.get(path.suffix.lower())
    if read is None:
        raise SceneError(f"{name}: must end with one of {', '.join(SUFFIXES)}")
    return read(path, name).whole()


def _known(keys: Iterator[str] | list[str], name: str, what: str) -> dict[str, Node | None]:
    return {key: known_key(key, f"{name}: {what}", LABELS) for key in keys}


# --- CSV ----------------------------------------------------------------------------------------


def _read_csv(path: Path, name: str) -> _Columns:
    """Read comma-separated columns: fast where a piece is plain, line by line where it is not."""
    what = "a table of designs (CSV)"
    columns: _Columns | None = None
    header: tuple[str, ...] = ()
    first, offset, rows = 1, 0, 0
    for piece in _pieces(path, name, what):
        body = piece
        if columns is None:
            found = find_header(_decoded(piece, name, what, offset), name, first)
            if found is None:
                first, offset = first + _line_ends(piece), offset + len(piece)
                continue
            header, rest, line = found
            columns = _Columns(name, _known(list(header), name, "column"))
            body = rest.encode()
            rows += _take_csv(columns, header, body, line)
        else:
            # Only what the fast way does not understand needs to be text.
            if not body.isascii():
                _decoded(body, name, what, offset)
            rows += _take_csv(columns, header, body, first)
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


def _take_csv(columns: _Columns, header: tuple[str, ...], body: bytes, first: int) -> int:
    """Append the rows of one piece, whose first line is line `first`; how many there were."""
    numbers = [key for key, node in columns.nodes.items() if node is not None]
    labels = [key for key in header if key not in numbers]
    frame = _parsed(body, header, labels)
    if frame is not None and not any(
        outside(frame[key], node).any() for key, node in columns.nodes.items() if node is not None
    ):
        for key in header:
            columns.take(key, frame[key])
        return len(frame[header[0]])
    if len(body) > 2 * ODD_PIECE:
        return sum(_take_csv(columns, header, part, line) for part, line in _smaller(body, first))
    # Something is odd: slowly and carefully, and in words.
    rows, lines = parse_rows(body.decode(), columns.name, first, header)
    table = Table(columns.name, header, rows, lines)
    for key in header:
        node = columns.nodes[key]
        if node is None:
            columns.take(key, table.texts(key))
            continue
        values = np.array(table.numbers(key), dtype=np.float64)
        bad = np.flatnonzero(outside(values, node))
        if bad.size:
            check_range(values[bad[0]], f"{columns.name}, line {lines[bad[0]]}: {key}", node)
        columns.take(key, values)
    return len(rows)


def _smaller(body: bytes, first: int) -> Iterator[tuple[bytes, int]]:
    """Parts of a piece that end where lines end, and the number of the first line of each."""
    begin = 0
    while begin < len(body):
        end = body.find(b"\n", begin + ODD_PIECE) + 1 or len(body)
        part = body[begin:end]
        yield part, first
        first, begin = first + _line_ends(part), end


def _parsed(body: bytes, header: tuple[str, ...], labels: list[str]) -> dict[str, Any] | None:
    """Columns of a piece of plain CSV; None for all that pandas might read otherwise than we do."""
    if not body:
        return None
    if not labels:
        if body.translate(None, _OF_NUMBERS):
            return None
    elif any(mark in body for mark in (b'"', b"#", b"\0")):
        return None
    if (b"\r" in body and body.count(b"\r") != body.count(b"\r\n")) or body.isspace():
        return None
    import pandas as pd

    # Up to 3.0, the default converter may be off by the last digit; the exact one costs little.
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
        # A copy: a column of the frame would keep all of it.
        columns[key] = values = np.array(frame[key], dtype=np.float64)
        # Beside labels, the words true and false would pass for numbers.
        if not np.isfinite(values).all() or (labels and ((values == 0) | (values == 1)).all()):
            return None
    return columns


# --- netCDF -------------------------------------------------------------------------------------


def _read_netcdf(path: Path, name: str) -> _Columns:
    """Read the one-dimensional variables of a netCDF file, or the designs of an archive."""
    what = "a table of designs (netCDF)"
    with reading(name, what, "a netCDF file", RuntimeError, AttributeError):
        opened_file(path).close()  # says more than the library would
        file = netcdf(path)
    with (
        file,
        warnings.catch_warnings(),
        reading(name, what, "a sound netCDF file", RuntimeError, Warning),
    ):
        warnings.simplefilter("error")  # the library only warns of attributes that it leaves out
        variables = _variables_of_table(file, name)
        nodes = _known(list(variables), name, "variable")
        columns = _Columns(name, nodes)
        (dimension,) = {v.dimensions for v in variables.values()}
        count = len(file.dimensions[dimension[0]])
        if not count:
            raise SceneError(f"{name}: no rows along '{dimension[0]}'; at least one is needed")
        check_rows(count, len(variables), name)
        for key, node in nodes.items():
            variable = variables[key]
            _check_kind(key, node, variable.dtype, str(variable.datatype), name)
            _check_units(key, node, getattr(variable, "units", None), name)
            check_chunks(variable, getattr(variable.dtype, "itemsize", TEXT_REFERENCE), name)
            for begin in range(0, count, ROWS):
                values = variable[begin : begin + ROWS]
                if node is None:
                    columns.take(key, [str(text).strip() for text in values])
                    continue
                missing = np.ma.getmaskarray(values)
                _take_numbers(columns, key, np.ma.getdata(values), missing, begin)
    return columns


def _variables_of_table(file: Any, name: str) -> dict[str, Any]:
    """Variables that are columns: along one dimension, all along the same."""
    # What an archive holds beside its designs: results, and axes that multiply with the designs.
    archive = "scene" in file.ncattrs() and DESIGN in file.dimensions
    variables = {
        key: variable
        for key, variable in file.variables.items()
        if key != DESIGN and not (archive and (variable.dimensions != (DESIGN,)))
        and key.removesuffix("_published") not in QUANTITIES
    }  # fmt: skip
    if not variables:
        found = one_line(", ".join(file.variables) or "none", 200)
        raise SceneError(
            f"{name}: no variable of a parameter; found: {found}; `engine-dyn list keys` shows them"
        )
    _known(list(variables), name, "variable")  # the wrong name first, then its shape
    first, expected = "", ""
    for key, variable in variables.items():
        if variable.ndim != 1:
            along = f"({', '.join(variable.dimensions)})" if variable.ndim else "none"
            raise SceneError(
                f"{name}: variable {key}: has dimensions {along}; must have one, the designs"
            )
        if first and variable.dimensions[0] != expected:
            raise SceneError(
                f"{name}: variable {key}: along '{variable.dimensions[0]}', {first} along "
                f"'{expected}'; all must be along one dimension, the designs"
            )
        first, expected = key, variable.dimensions[0]
    return variables


# --- Parquet ------------------------------------------------------------------------------------


def _read_parquet(path: Path, name: str) -> _Columns:
    """Read the columns of a Parquet file."""
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise SceneError(
            f"{name}: Parquet needs pyarrow, which is not installed: pip install "
            "'engine-dyn[parquet]'"
        ) from None

    def is_text(kind: Any) -> bool:
        return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind))

    what = "a table of designs (Parquet)"
    with reading(name, what, "a Parquet file", pa.ArrowException):
        opened_file(path).close()  # says more than the library would
        labels = [f.name for f in pq.read_schema(path) if f.name in LABELS and is_text(f.type)]
        # Of labels each text once: run lengths of long ones would fill the memory.
        file = pq.ParquetFile(path, read_dictionary=labels)
    with file, reading(name, what, "a sound Parquet file", pa.ArrowException):
        schema = file.schema_arrow
        index = _index_of_pandas(schema.metadata)
        fields = [f for f in schema if not (f.name in index or f.name == DESIGN)]
        nodes = _known([f.name for f in fields], name, "column")
        if len(nodes) < len(fields):
            raise SceneError(f"{name}: two columns have the same name; each name once")
        columns = _Columns(name, nodes)
        for f in fields:
            plain: Any = np.dtype(object)
            if pa.types.is_integer(f.type) or pa.types.is_floating(f.type):
                plain = np.dtype(f.type.to_pandas_dtype())
            elif is_text(f.type.value_type if pa.types.is_dictionary(f.type) else f.type):
                plain = str
            _check_kind(f.name, nodes[f.name], plain, str(f.type), name)
            units = (f.metadata or {}).get(b"units")
            _check_units(f.name, nodes[f.name], units.decode() if units else None, name)
        if not nodes or not file.metadata.num_rows:
            lacks = "rows" if nodes else "columns"
            raise SceneError(f"{name}: no {lacks}; expected a table of designs (Parquet)")
        check_rows(file.metadata.num_rows, len(nodes), name)
        for key, node in nodes.items():
            begin = 0
            # One after the other: of a group of rows, only one column is in memory.
            for batch in file.iter_batches(batch_size=ROWS, columns=[key]):
                values = batch.column(0)
                if node is None:
                    columns.take(key, _labels_of(values))
                else:
                    missing = np.asarray(values.is_null().to_numpy(zero_copy_only=False))
                    numbers = values.to_numpy(zero_copy_only=False)
                    _take_numbers(columns, key, numbers, missing, begin)
                begin += batch.num_rows
    return columns


def _labels_of(values: Any) -> list[str]:
    """Texts of a column that is kept as a dictionary; those of missing values are empty."""
    texts = [one_line(text or "") for text in values.dictionary.to_pylist()]
    return ["" if place is None else texts[place] for place in values.indices.to_pylist()]


def _index_of_pandas(metadata: Mapping[bytes, bytes] | None) -> set[str]:
    """Columns that are only the index of a data frame."""
    try:
        found = json.loads((metadata or {}).get(b"pandas", b"{}")).get("index_columns", [])
    except (ValueError, AttributeError, RecursionError):
        return set()
    if not isinstance(found, list):
        return set()
    return {item for item in found if isinstance(item, str) and item.startswith("__index")}


# --- what netCDF and Parquet share --------------------------------------------------------------


def _check_kind(key: str, node: Node | None, kind: Any, shown_as: str, name: str) -> None:
    """Check that labels are texts and parameters are numbers."""
    letter = "U" if kind is str else getattr(kind, "kind", "O")
    text, numeric = letter in "US", letter in "iuf"
    if (node is None and not text) or (node is not None and not numeric):
        what = "texts" if node is None else "numbers"
        raise SceneError(f"{name}: {key}: holds {shown(shown_as)}; must be {what}")


def _check_units(key: str, node: Node | None, units: Any, name: str) -> None:
    """Refuse other units: a conversion that nobody sees is a source of errors."""
    if node is None or units is None:
        return
    words = " ".join(str(units).replace("**", "").replace("^", "").replace("*", " ").split())
    if _SPELLINGS.get(words, words) != node.unit:
        raise SceneError(f"{name}: {key}: units are {shown(str(units))}; must be '{node.unit}'")


def _take_numbers(
    columns: _Columns, key: str, values: Any, missing: npt.NDArray[np.bool_], begin: int
) -> None:
    """Append numbers of a column from row `begin` on, all there and within their range."""
    node = columns.nodes[key]
    assert node is not None
    numbers = np.array(values, dtype=np.float64)
    missing = missing | np.isnan(numbers)
    if missing.any():
        row = begin + int(np.argmax(missing)) + 1
        raise SceneError(
            f"{columns.name}, row {row}: {key}: missing ({counted(int(missing.sum()), 'value')} "
            f"among the rows {begin + 1} to {begin + numbers.size}); must be {allowed(node)}"
        )
    bad = np.flatnonzero(outside(numbers, node))
    if bad.size:
        row = begin + int(bad[0]) + 1
        check_range(numbers[bad[0]], f"{columns.name}, row {row}: {key}", node)
    columns.take(key, numbers)


_READERS: dict[str, Callable[[Path, str], _Columns]] = {
    ".csv": _read_csv,
    ".txt": _read_csv,
    ".nc": _read_netcdf,
    ".nc4": _read_netcdf,
    ".parquet": _read_parquet,
}

SUFFIXES = tuple(_READERS)
