"""Tables of designs in netCDF and Parquet, of hostile variables or with bytes changed."""

from __future__ import annotations

import datetime
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from hypothesis import strategies as st

from benchmarks.fuzz.changes import cut_up
from benchmarks.fuzz.checking import read_hostile
from benchmarks.fuzz.sandbox import sandbox
from sweeps.reading.design_files import read_designs

__all__ = ["ATTRIBUTES", "KEYS", "add_variables", "binary_tables", "check_binary_table",
           "hostile_variables"]  # fmt: skip

KEYS = ["bore", "stroke", "case", "design", "speed", "Bore", "delta", "x", "passes"]
_TYPES = ["f8", "f4", "i4", "i8", "u1", "S1", "str", "compound", "vlen", "enum", "opaque"]
ATTRIBUTES: st.SearchStrategy[tuple[str, Any]] = st.tuples(
    st.sampled_from(
        ["units", "scale_factor", "add_offset", "valid_range", "missing_value", "coordinates",
         "long_name", "symbol", "comment", "calendar", "flag_values", "flag_meanings", "dtype",
         "_Unsigned", "bounds", "grid_mapping", "valid_max"]
    ),
    st.one_of(
        st.sampled_from(["m", "rpm", "", "days since 0001-01-01", "$\\frac{$", "x\x1b[2J", "true"]),
        st.floats(), st.integers(-5, 5), st.lists(st.floats(), min_size=1, max_size=3),
    ),
)  # fmt: skip

hostile_variables = st.lists(
    st.tuples(
        st.sampled_from(KEYS),
        st.sampled_from(_TYPES),
        st.lists(st.sampled_from(["design", "n", "huge", "none"]), max_size=2, unique=True),
        st.sampled_from([None, 1, 10**3, 10**9]),
        st.lists(ATTRIBUTES, max_size=2),
    ),
    min_size=1,
    max_size=4,
    unique_by=lambda v: v[0],
)


def add_variables(file: Any, variables: list[Any]) -> None:
    """Define hostile variables in a netCDF file; what the library refuses is left out."""
    for name, size in (("n", 3), ("huge", 10**11), ("none", 0), ("design", 3)):
        if name not in file.dimensions:
            file.createDimension(name, size)
    types: dict[str, Any] = {
        "str": str,
        "compound": lambda: file.createCompoundType(np.dtype([("a", "f8")]), "pair"),
        "vlen": lambda: file.createVLType("f8", "ragged"),
        "enum": lambda: file.createEnumType("i1", "state", {"a": 0, "b": 1}),
        "opaque": lambda: file.createVLType("i1", "bytes"),
    }
    for name, kind, dims, chunk, attributes in variables:
        if name in file.variables:
            continue
        with suppress(RuntimeError, ValueError, TypeError, OSError, LookupError):
            found = types.get(kind, kind)
            found = found() if callable(found) and found is not str else found
            lengths = [file.dimensions[d].size for d in dims]
            sizes = [min(chunk or 1000, max(n, 1)) for n in lengths]
            more = {"chunksizes": sizes, "zlib": kind != "str"} if dims else {}
            made = file.createVariable(name, found, tuple(dims), **more)
            for attribute, value in attributes:
                with suppress(AttributeError, TypeError, RuntimeError, ValueError, OSError):
                    made.setncattr(attribute, value)
            if "huge" not in dims and kind in ("f8", "f4", "i4", "i8", "u1"):
                made[...] = np.arange(1, 1 + int(np.prod(lengths))).reshape(lengths)


@cache
def good_tables() -> dict[str, bytes]:
    """A sound table of designs of each binary kind."""
    home = sandbox()
    with netCDF4.Dataset(home / "good.nc", "w") as file:
        add_variables(file, [("bore", "f8", ["n"], None, [("units", "m")])])
    table = pa.table({"bore": [0.1, 0.11], "case": ["a", "b"]})
    pq.write_table(table, home / "good.parquet")
    found = {s: (home / f"good{s}").read_bytes() for s in (".nc", ".parquet")}
    for suffix in found:
        (home / f"good{suffix}").unlink()
    return found


def _parquet_columns() -> st.SearchStrategy[list[tuple[str, str, Any]]]:
    kinds = ["double", "int64", "string", "list", "struct", "timestamp", "decimal", "bool",
             "binary", "null", "dictionary", "float16", "uint64", "map"]  # fmt: skip
    column = st.tuples(
        st.sampled_from(KEYS),
        st.sampled_from(kinds),
        st.sampled_from([None, b"m", b"furlong", b"\xff\xfe", b'{"index_columns": 3}', b"["]),
    )
    return st.lists(column, min_size=1, max_size=3)


def write_parquet(path: Path, columns: list[tuple[str, str, Any]]) -> None:
    values: dict[str, Any] = {
        "double": pa.array([0.1, 0.2]), "int64": pa.array([1, 2]), "string": pa.array(["a", None]),
        "list": pa.array([[1.0], [2.0]]), "struct": pa.array([{"a": 1.0}, {"a": 2.0}]),
        "timestamp": pa.array([datetime.datetime(2026, 1, 1)] * 2), "bool": pa.array([True, False]),
        "decimal": pa.array([1, 2]).cast(pa.decimal128(20)), "binary": pa.array([b"\xff", b"a"]),
        "null": pa.nulls(2), "dictionary": pa.array(["a", "b"]).dictionary_encode(),
        "float16": pa.array(np.array([0.1, 0.2], dtype=np.float16)),
        "uint64": pa.array([2**64 - 1, 1], pa.uint64()),
        "map": pa.array([[("a", 1)], []], pa.map_(pa.string(), pa.int64())),
    }  # fmt: skip
    fields = [
        pa.field(n, values[k].type, metadata={"units": m} if m else None) for n, k, m in columns
    ]
    about = next((m for _, _, m in columns if m and m[:1] in b"{["), None)
    schema = pa.schema(fields, metadata={"pandas": about} if about else None)
    pq.write_table(pa.Table.from_arrays([values[k] for _, k, _ in columns], schema=schema), path)


def binary_tables() -> st.SearchStrategy[tuple[str, Any]]:
    return st.one_of(
        st.tuples(st.just(".nc"), hostile_variables),
        st.tuples(st.just(".parquet"), _parquet_columns()),
        st.sampled_from(sorted(good_tables())).flatmap(
            lambda suffix: st.tuples(st.just(suffix), cut_up(good_tables()[suffix]))
        ),
    )


def check_binary_table(example: tuple[str, Any]) -> None:
    suffix, content = example
    if not isinstance(content, bytes):
        path = sandbox() / f"written{suffix}"
        if suffix == ".nc":
            with netCDF4.Dataset(path, "w") as file:
                add_variables(file, content)
        else:
            write_parquet(path, content)
        content = path.read_bytes()
        path.unlink()
    read_hostile(f"mutated{suffix}", content, lambda path: read_designs(path, "mutated"))
