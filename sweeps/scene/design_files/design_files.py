"""Tables of designs from files: the format is inferred from the file extension.

A format is a function that reads a file into `DesignColumns`, and one row of the table `_READERS`.
Columns are in the units of scenes; a file that states its units must state those, but for heads of
CSV files with units, "speed [rad s-1]", which are converted. Results among the columns are left
out, so that what `export` writes is a table of designs. CSV is read fast where a piece of the file
is plain, line by line elsewhere.
"""

from __future__ import annotations

import csv
import io
import json
import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sweeps.base.checks import check_range, is_ratio, outside
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import SceneError, one_line
from sweeps.base.files.csv_tables import find_header, rows_below
from sweeps.base.files.regular_files import (
    check_rows,
    opened_file,
    reading,
    regular_bytes,
    text_of_bytes,
)
from sweeps.base.files.sheets import sheets
from sweeps.base.netcdf.netcdf_files import TEXT_REFERENCE, check_chunks, opened_table
from sweeps.scene.design_files.design_columns import (
    ROWS,
    DesignColumns,
    check_kind,
    check_units,
    factor_of,
    is_result,
    known_columns,
    name_and_unit,
    take_numbers,
)
from sweeps.scene.toml_tables import DesignTable

MOST = 1 << 28  # Largest number of bytes of a file with designs

PIECE = 1 << 20
"""Bytes of a CSV file that are parsed at a time; line by line this takes fifty times as much
memory."""

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
            start = find_header(text_of_bytes(piece, name, what, offset), name, first)
            if start is None:
                first, offset = first + _line_ends(piece), offset + len(piece)
                continue
            heads, rest, line = start
            header, columns = _columns_of(heads, name)
            body = rest.encode()
        elif not body.isascii():  # The fast parser may accept bytes that are no text
            text_of_bytes(body, name, what, offset)
        rows += _take_csv(columns, header, body, line)
        first, offset = first + _line_ends(piece), offset + len(piece)
    if columns is None:
        raise SceneError(f"{name}: empty; expected {what}")
    if not rows:
        raise SceneError(f"{name}: a header but no rows; expected {what}")
    return columns


def _columns_of(heads: tuple[str, ...], name: str) -> tuple[tuple[str, ...], DesignColumns]:
    """Names of all columns of a file, and those that are parameters or labels, by their heads."""
    parts = [name_and_unit(head) for head in heads]
    header = tuple(key for key, _ in parts)
    if len({*header}) < len(header):
        twice = next(key for place, key in enumerate(header) if key in header[:place])
        raise SceneError(f"{name}: two columns are {twice}; each column has its own name")
    used = [key for key in header if not is_result(key)]
    nodes = known_columns(used, name, "column")
    units = {key: unit for key, unit in parts if key in nodes}
    factors = {key: factor_of(key, nodes[key], unit, name) for key, unit in units.items()}
    results = [key for key in header if key not in nodes]
    return header, DesignColumns(
        name, nodes, {k: f for k, f in factors.items() if f != 1.0}, results
    )


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


def _line_ends(piece: bytes) -> int:
    """Number of line ends, as editors count them."""
    if b"\r" not in piece:
        return piece.count(b"\n")
    return piece.count(b"\n") + piece.count(b"\r") - piece.count(b"\r\n")


def _take_csv(columns: DesignColumns, header: tuple[str, ...], body: bytes, first: int) -> int:
    """Append the rows of one piece, which starts on line `first`; return their number."""
    frame = _parsed(body, header, columns)
    if frame is not None and not any(
        outside(frame[key], node).any() for key, node in columns.nodes.items() if node is not None
    ):
        for key in columns.nodes:
            columns.take(key, frame[key])
        return len(frame[next(iter(columns.nodes))])
    # The fast parser refused the piece: the slow one reads it line by line, and finds the fault.
    table = rows_below(header, body.decode(), columns.name, first)
    for key, node in columns.nodes.items():
        if node is None:
            columns.take(key, table.texts(key))
            continue
        values = np.array(table.numbers(key, ratios=is_ratio(node)), dtype=np.float64)
        values *= columns.factors.get(key, 1.0)
        bad = np.flatnonzero(outside(values, node))
        if bad.size:
            check_range(values[bad[0]], f"{columns.name}, line {table.lines[bad[0]]}: {key}", node)
        columns.take(key, values)
    return len(table.rows)


def _parsed(body: bytes, header: tuple[str, ...], of_table: DesignColumns) -> dict[str, Any] | None:
    """Columns of a piece of plain CSV; None for anything that pandas might read differently."""
    if not body or not of_table.nodes:
        return None
    labels = [key for key, node in of_table.nodes.items() if node is None]
    words = bool(labels) or len(of_table.nodes) < len(header)  # Results may be words too
    if not words:
        if body.translate(None, b"0123456789+-.eE, \t\r\n"):
            return None
    elif any(mark in body for mark in (b'"', b"#", b"\0")):
        return None
    if (b"\r" in body and body.count(b"\r") != body.count(b"\r\n")) or body.isspace():
        return None
    import pandas as pd

    # In the versions of pandas below, the default converter may err in the last digit; the exact
    # one costs little.
    old = tuple(int(part) for part in pd.__version__.split(".")[:2]) < (3, 1)
    options: dict[str, Any] = {"float_precision": "round_trip"} if old else {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            frame = pd.read_csv(
                io.BytesIO(body),
                header=None,
                names=list(header),
                usecols=list(of_table.nodes),
                dtype={key: object if key in labels else np.float64 for key in of_table.nodes},
                index_col=False,
                na_filter=False,
                quoting=csv.QUOTE_NONE,
                engine="c",
                **options,
            )
    except (ValueError, Warning):  # pandas' own errors are ValueErrors too
        return None
    commas = int(np.count_nonzero(np.frombuffer(body, dtype=np.uint8) == ord(",")))
    if commas != len(frame) * (len(header) - 1):
        return None  # The rows are too long or too short
    columns: dict[str, Any] = {}
    for key in of_table.nodes:
        if key in labels:
            columns[key] = [str(text).strip() for text in frame[key]]
            continue
        # A copy, because a column of the frame would keep the whole frame alive.
        columns[key] = values = np.array(frame[key], dtype=np.float64)
        # Next to labels, pandas would take the words true and false for 1 and 0.
        if not np.isfinite(values).all() or (words and ((values == 0) | (values == 1)).all()):
            return None
        values *= of_table.factors.get(key, 1.0)
    return columns


def read_design_parquet(path: Path, name: str) -> DesignColumns:
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
        opened_file(path).close()  # The error of the opening says more than the library's
        labels = [f.name for f in pq.read_schema(path) if is_text(f.type)]
        # Texts stay indices of a dictionary, because many equal long texts would fill the memory.
        file = pq.ParquetFile(path, read_dictionary=labels)
    with file, reading(name, what, "a sound Parquet file", pa.ArrowException):
        schema = file.schema_arrow
        index = _index_of_pandas(schema.metadata)
        fields = [f for f in schema if not (f.name in index or is_result(f.name))]
        nodes = known_columns([f.name for f in fields], name, "column")
        if len(nodes) < len(fields):
            raise SceneError(f"{name}: two columns have the same name; each name once")
        results = [f.name for f in schema if is_result(f.name)]
        columns = DesignColumns(name, nodes, results=results)
        for f in fields:
            plain: Any = np.dtype(object)
            if pa.types.is_integer(f.type) or pa.types.is_floating(f.type):
                plain = np.dtype(f.type.to_pandas_dtype())
            elif is_text(f.type.value_type if pa.types.is_dictionary(f.type) else f.type):
                plain = str
            check_kind(f.name, nodes[f.name], plain, str(f.type), name)
            units = (f.metadata or {}).get(b"units")
            check_units(f.name, nodes[f.name], units.decode() if units else None, name)
        if not nodes or not file.metadata.num_rows:
            lacks = "rows" if nodes else "columns"
            raise SceneError(f"{name}: no {lacks}; expected a table of designs (Parquet)")
        check_rows(file.metadata.num_rows, len(nodes), name)
        for key, node in nodes.items():
            begin = 0
            # Columns are read one by one, so that only one column of a group of rows is in memory.
            for batch in file.iter_batches(batch_size=ROWS, columns=[key]):
                values = batch.column(0)
                values.validate(full=True)  # The file may claim wrong places of texts
                if node is None:
                    columns.take(key, _labels_of(values))
                else:
                    missing = np.asarray(values.is_null().to_numpy(zero_copy_only=False))
                    is_texts = pa.types.is_dictionary(values.type)
                    numbers = (
                        _labels_of(values) if is_texts else values.to_numpy(zero_copy_only=False)
                    )
                    take_numbers(columns, key, numbers, missing, begin)
                begin += batch.num_rows
            if begin != file.metadata.num_rows:
                raise SceneError(
                    f"{name}: column {key} has {begin} of {file.metadata.num_rows} rows; the file "
                    "is damaged"
                )
    return columns


def _labels_of(values: Any) -> list[str]:
    """Texts of a dictionary column; missing values become empty texts."""
    texts = [one_line(text or "") for text in values.dictionary.to_pylist()]
    return ["" if place is None else texts[place] for place in values.indices.to_pylist()]


def _index_of_pandas(metadata: Mapping[bytes, bytes] | None) -> set[str]:
    """Columns that are only the index of a data frame."""
    try:
        indices = json.loads((metadata or {}).get(b"pandas", b"{}")).get("index_columns", [])
    except (ValueError, AttributeError, RecursionError):
        return set()
    if not isinstance(indices, list):
        return set()
    return {item for item in indices if isinstance(item, str) and item.startswith("__index")}


def read_design_netcdf(path: Path, name: str) -> DesignColumns:
    """Read the one-dimensional variables of a netCDF file, or the designs of an archive."""
    with opened_table(path, name, "a table of designs (netCDF)") as file:
        variables = _variables_of_table(file, name)
        nodes = known_columns(list(variables), name, "variable")
        results = [key for key in file.variables if is_result(key)]
        columns = DesignColumns(name, nodes, results=results)
        (dimension,) = {v.dimensions for v in variables.values()}
        count = len(file.dimensions[dimension[0]])
        if not count:
            raise SceneError(f"{name}: no rows along '{dimension[0]}'; at least one is needed")
        check_rows(count, len(variables), name)
        for key, node in nodes.items():
            variable = variables[key]
            check_kind(key, node, variable.dtype, str(variable.datatype), name)
            check_units(key, node, getattr(variable, "units", None), name)
            check_chunks(variable, getattr(variable.dtype, "itemsize", TEXT_REFERENCE), name)
            for begin in range(0, count, ROWS):
                values = variable[begin : begin + ROWS]
                if node is None:
                    columns.take(key, [str(text).strip() for text in values])
                    continue
                missing = np.ma.getmaskarray(values)
                take_numbers(columns, key, np.ma.getdata(values), missing, begin)
    return columns


def _variables_of_table(file: Any, name: str) -> dict[str, Any]:
    """Variables of a table, all along the same single dimension."""
    # Besides its designs, an archive holds results, and axes that multiply the designs.
    archive = "scene" in file.ncattrs() and DESIGN in file.dimensions
    variables = {
        key: variable
        for key, variable in file.variables.items()
        if not is_result(key) and not (archive and (variable.dimensions != (DESIGN,)))
    }  # fmt: skip
    if not variables:
        listed = one_line(", ".join(file.variables) or "none", 200)
        raise SceneError(
            f"{name}: no variable is named as a parameter; found: {listed}; allowed: see "
            "`engine-dyn list keys`"
        )
    # Unknown names are refused before wrong shapes
    known_columns(list(variables), name, "variable")
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


def read_design_xlsx(path: Path, name: str) -> DesignColumns:
    """Read columns: names in the first row, and units in the second where it holds texts alone."""
    what = "a table of designs (.xlsx)"
    with reading(name, what):
        data = regular_bytes(path, MOST)
    (rows,) = sheets(data, name, first=True).values()
    if len(rows) < 2:
        raise SceneError(f"{name}: no rows; expected {what}, with names in its first row")
    keys = ["" if cell is None else str(cell).strip() for cell in rows[0]]
    used = [place for place, key in enumerate(keys) if not is_result(key)]
    names = [keys[place] for place in used]
    if "" in names or len({*names}) < len(names):
        raise SceneError(
            f"{name}: row 1: a name is missing or given twice; each column has its own"
        )
    nodes = known_columns(names, name, "column")
    columns = DesignColumns(name, nodes, results=[key for key in keys if is_result(key)])
    body = rows[1:]
    numbers = [place for place, key in zip(used, names, strict=True) if nodes[key] is not None]
    units = numbers and all(isinstance(_cell(body[0], place), str | None) for place in numbers)
    if units:
        for place in numbers:
            check_units(keys[place], nodes[keys[place]], _cell(body[0], place), name)
        body = body[1:]
    check_rows(len(body), len(names), name)
    if not body:
        raise SceneError(f"{name}: no rows; expected {what}")
    for place, key in zip(used, names, strict=True):
        values = [_cell(row, place) for row in body]
        if nodes[key] is None:
            columns.take(key, ["" if value is None else str(value) for value in values])
            continue
        missing = np.array([value is None for value in values])
        for row, value in enumerate(values, start=1):
            if not (value is None or type(value) in (int, float)):
                kind = str if isinstance(value, str) else object
                check_kind(key, nodes[key], kind, str(value), f"{name}, row {row}")
        if any(isinstance(value, str) for value in values):
            given = np.array(values, dtype=object)
        else:
            given = np.array([np.nan if value is None else float(value) for value in values])
        take_numbers(columns, key, given, missing, 0)
    return columns


def _cell(row: list[Any], place: int) -> Any:
    value = row[place] if place < len(row) else None
    return None if value == "" else value


_READERS: dict[str, Callable[[Path, str], DesignColumns]] = {
    ".csv": read_design_csv,
    ".txt": read_design_csv,
    ".nc": read_design_netcdf,
    ".nc4": read_design_netcdf,
    ".parquet": read_design_parquet,
    ".xlsx": read_design_xlsx,
}


def read_designs(path: Path, name: str) -> DesignTable:
    """Read the table of [designs] file; `name` is the file as messages call it.

    Refused, with line or row,
    are unknown extensions, files that are missing or not of their kind, columns that are unknown,
    not numeric, of other units or along more than one dimension, missing values, and values outside
    their range.
    """
    read = _READERS.get(path.suffix.lower())
    suffixes = tuple(_READERS)
    if read is None:
        raise SceneError(f"{name}: must end with one of {', '.join(suffixes)}")
    return read(path, name).whole()
