"""Hostile files by the thousand: whatever reads files takes them, or refuses them in one line.

`python -m benchmarks.fuzz --seconds 600` runs every target for its share of the time, each in a
process of its own with limited memory, and prints how many inputs it made, how many of them were
taken and refused, and what went wrong. Where atheris is installed (`pip install atheris`) its
coverage leads the inputs, else hypothesis draws them. What went wrong is made small by
hypothesis and printed; the process ends with 1. tests/sweeps/test_hostile.py runs the same targets,
each with some inputs that are the same every time.
"""

from __future__ import annotations

import argparse
import atexit
import copy
import datetime
import importlib
import inspect
import json
import os
import pkgutil
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any, NoReturn

import click.testing
import numpy as np
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

from sweeps.catalogue import ENGINES, PACKAGE, SCENES
from sweeps.errors import SceneError

__all__ = ["MEMORY", "TARGETS", "main", "refused_or_taken"]

ROOT = Path(__file__).resolve().parents[1]

MEMORY = 8 << 30
"""Bytes of addresses that a process of the campaign may use: libraries map two or three alone."""

LONGEST = 60
"""Seconds of the processor that one input may take; where it waits, ten times that of the clock."""

COUNTS: Counter[str] = Counter()

SCENE = """\
title = "All tables"
engine = "ntua"

[set]
load = 50
pressure_factor = [1.0, 1.0, 1.0, 0.0, 1.0, 1.0]
load_table = "load.csv"

[axes]
speed = [1000.0, 1200.0]
inertia = { start = 1.0, stop = 9.0, num = 3, spacing = "log" }

[designs]
case = ["one", "two"]
bore = [0.14, 0.15]

[solver]
method = ["auto", "newton"]
inertia_model = "variable"
closure = "power_mean"
tolerance = 1e-6

[output]
quantities = ["delta", "omega", "imep"]
angle_step = 2
highest_order = 6
fail_on = ["stalled"]

[reference]
file = "published.csv"
"""

PRESSURE = "diesel_105x137_pressure.csv"

LOAD = "load_angle_deg,torque_Nm\n0,10\n90,20\n180,15\n270,5\n360,10\n"
DRIVER = "speed_rpm,torque_Nm\n0,100\n1500,90\n3000,10\n"
PUBLISHED = "case,speed,inertia,delta\none,1000,1,0.01\ntwo,1200,9,\n"
DESIGNS = "case,bore,stroke\nfirst,0.1,0.12\nsecond,0.11,0.13\n"

WORDS = [
    "", " ", "a" * 5000, "../secret.csv", "../../../../etc/passwd", "/etc/passwd", "/dev/zero",
    "/dev/stdin", "fifo", "loop.csv", "outside.csv", "folder.csv", "zero.csv", "missing.csv",
    "http://localhost:1/x.csv", "https://localhost:1/x.nc", "dap4://localhost:1/x.nc",
    "file:///etc/passwd", "s3://bucket/key.parquet", "table.csv.gz", "x\0y", "\x1b[2J", "\u202e",
    "\ud800".encode("utf-8", "replace").decode(), "e\u0301", "é", "🙂", "{0}", "%s%n", "$(id)",
    "`id`", "pressure.csv", "load.csv", "driver.csv", "published.csv", "designs.csv", "ntua",
    "b112", "engine.toml", "scene.toml", "nan", "inf", "1e400", "1_000", "0x10", "١",
    "V8 flat-plane", "in-line 4", "delta", "omega", "speed", "design", "status", "case",
    "__class__", "\\frac{",
]  # fmt: skip

NUMBERS: list[Any] = [
    0, 1, -1, 2, 3, 1e-320, 1e308, -1e308, 1e-9, 0.5, 2.5, 7, 100, 10**6, 10**7, 10**12, 2**31,
    2**63, 2**64, 10**400, -(10**400), float("nan"), float("inf"), -float("inf"), -0.0, True, False,
]  # fmt: skip

RANGES: list[Any] = [
    {"start": 0.5, "stop": 2.0, "num": 10**12},
    {"start": 0.5, "stop": 2.0, "num": 10**7},
    {"start": -1e308, "stop": 1e308, "num": 5},
    {"start": 1e-320, "stop": 1e308, "num": 9, "spacing": "log"},
    {"start": 0.1, "stop": 0.1 + 1e-16, "num": 50},
    {"start": 1, "stop": 2, "num": 2.0},
    {"start": 1, "stop": 2, "num": True},
]

TOKENS = [
    b"", b"\0", b"\xff", b"\xef\xbb\xbf", b"\r", b"\r\n", b"\n", b"\t", b",", b'"', b"'", b"#",
    b"=", b"[", b"]", b"{", b"}", b"[[", b"]]", b".", b"-", b"+", b"e", b"nan", b"inf", b"1e400",
    b"true",
    b"1979-05-27T07:32:00Z", b"0x" + b"f" * 400, b"9" * 5000, b"[" * 3000, b"a." * 2000, b"a\n",
    "é".encode(), "\u2028".encode(), "x".encode("utf-16"), b"'''", b'"""', b"\\u0000", b"\\ud800",
    b"<!ENTITY", b"1;2", b"\x1a", b"," * 5000, b"0.0\n" * 3000,
]  # fmt: skip


# --- what is made ---------------------------------------------------------------------------------

hostile: st.SearchStrategy[Any] = st.recursive(
    st.one_of(
        st.sampled_from(NUMBERS),
        st.sampled_from(WORDS),
        st.sampled_from([copy.deepcopy(r) for r in RANGES]),
        st.floats(),
        st.integers(-5, 2000),
        st.text(max_size=8),
        st.just(datetime.date(2026, 1, 2)),
    ),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(WORDS), inner),
    max_leaves=6,
)


def places(tree: Any, here: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of all members of tables and lists."""
    members = tree.items() if isinstance(tree, dict) else enumerate(tree)
    for key, item in members:
        yield (*here, key)
        if isinstance(item, dict | list):
            yield from places(item, (*here, key))


@st.composite
def changed(draw: st.DrawFn, tree: Any, words: tuple[str, ...]) -> Any:
    """A tree with some members replaced, removed, renamed or added."""
    tree = copy.deepcopy(tree)
    for _ in range(draw(st.integers(1, 3))):
        all_places = list(places(tree))
        if not all_places:
            break
        *parents, last = draw(st.sampled_from(all_places))
        inner = tree
        for part in parents:
            inner = inner[part]
        kind = draw(st.sampled_from(["replace", "replace", "remove", "rename", "add", "deepen"]))
        name = draw(st.sampled_from(words))
        if kind == "remove":
            del inner[last]
        elif kind == "rename" and isinstance(inner, dict):
            inner[name] = inner.pop(last)
        elif kind == "add" and isinstance(inner, dict):
            inner[name] = copy.deepcopy(draw(hostile))
        elif kind == "add":
            inner.append(copy.deepcopy(draw(hostile)))
        elif kind == "deepen":
            item = inner[last]
            for _ in range(draw(st.sampled_from([1, 7, 9, 300]))):
                item = [item] if draw(st.booleans()) else {"a": item}
            inner[last] = item
        else:
            inner[last] = copy.deepcopy(draw(hostile))
    return tree


@st.composite
def cut_up(draw: st.DrawFn, data: bytes) -> bytes:
    """Bytes with some of them flipped, removed, doubled or replaced."""
    for _ in range(draw(st.integers(1, 4))):
        begin = draw(st.integers(0, len(data)))
        length = draw(st.sampled_from([0, 1, 2, 8, 50, 1000, len(data)]))
        kind = draw(st.sampled_from(["token", "flip", "double", "bytes"]))
        part = data[begin : begin + length]
        if kind == "flip" and begin < len(data):
            part = bytes([data[begin] ^ (1 << draw(st.integers(0, 7)))])
            length = 1
        elif kind == "double":
            part, length = part * 2, len(part)
        elif kind == "bytes":
            part = draw(st.binary(max_size=20))
        else:
            part = draw(st.sampled_from(TOKENS))
        data = data[:begin] + part + data[begin + length :]
    return data


def toml_text(tree: dict[str, Any], prefix: str = "") -> str:
    """TOML of a tree; lists and tables inside others as inline ones."""
    lines = [f"{_key(k)} = {_value(v)}" for k, v in tree.items() if not _is_table(v, prefix)]
    for key, value in tree.items():
        if _is_table(value, prefix):
            rows = value if isinstance(value, list) else [value]
            marks = "[[{}]]" if isinstance(value, list) else "[{}]"
            for row in rows:
                lines += ["", marks.format(_key(key)), toml_text(row, "inside")]
    return "\n".join(lines) + "\n"


def _is_table(value: Any, prefix: str) -> bool:
    if prefix:
        return False
    rows = isinstance(value, list) and bool(value) and all(isinstance(v, dict) for v in value)
    return rows or isinstance(value, dict)


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


# --- what must hold -------------------------------------------------------------------------------


def refused_or_taken(work: Callable[[], Any]) -> bool:
    """Do something with hostile input; whether it was taken.

    What is no refusal in one printable line goes up.
    """
    try:
        work()
    except SceneError as error:
        text = str(error)
        assert text.isprintable(), text
        assert 10 < len(text) < 5000, text
        COUNTS["refused"] += 1
        return False
    COUNTS["taken"] += 1
    return True


@contextmanager
def unchanged(folder: Path) -> Iterator[None]:
    """Nothing in a folder may change."""
    before = _listing(folder)
    yield
    assert _listing(folder) == before, "something was written elsewhere"


def _listing(folder: Path) -> list[tuple[str, int, int]]:
    return sorted(
        (str(p), s.st_size, s.st_mtime_ns) for p in folder.rglob("*") for s in [p.lstat()]
    )


@cache
def sandbox() -> Path:
    """A folder of scenes with files that they name, good and bad; beside it what is private."""
    home = Path(tempfile.mkdtemp(prefix="engine-dyn-fuzz-"))
    atexit.register(shutil.rmtree, home, ignore_errors=True)
    outside, inside = home / "outside", home / "scenes"
    outside.mkdir()
    inside.mkdir()
    (home / "out").mkdir()
    (home / "secret.csv").write_text(DESIGNS)
    (outside / "precious.txt").write_text("precious")
    pressure = (ENGINES / PRESSURE).read_bytes()
    files = {
        "pressure.csv": pressure, PRESSURE: pressure, "load.csv": LOAD.encode(),
        "driver.csv": DRIVER.encode(), "published.csv": PUBLISHED.encode(),
        "designs.csv": DESIGNS.encode(), "engine.toml": engines()["diesel_105x137"],
        "scene.toml": SCENE.encode(),
    }  # fmt: skip
    for path in SCENES.glob("*.csv"):
        files[path.name] = path.read_bytes()
    for name, data in files.items():
        (inside / name).write_bytes(data)
    (inside / "folder.csv").mkdir()
    (inside / "loop.csv").symlink_to("loop.csv")
    (inside / "outside.csv").symlink_to("../secret.csv")
    (inside / "zero.csv").symlink_to("/dev/zero")
    if hasattr(os, "mkfifo"):
        os.mkfifo(inside / "fifo")
    return home


@cache
def engines() -> dict[str, bytes]:
    return {p.stem: p.read_bytes() for p in sorted(ENGINES.glob("*.toml"))}


@cache
def scenes() -> dict[str, bytes]:
    built_in = {p.stem: p.read_bytes() for p in sorted(SCENES.glob("*.toml"))}
    return {"all tables": SCENE.encode(), **built_in}


@cache
def names() -> tuple[str, ...]:
    from engine_dyn.quantities.graph import PARAMETERS, QUANTITIES
    from sweeps.reading.cylinder_keys import CYLINDER_KEYS
    from sweeps.scene.toml_tables import SceneFile

    return (
        *WORDS,
        *PARAMETERS,
        *CYLINDER_KEYS,
        *SceneFile.model_fields,
        *QUANTITIES,
        "file",
        "kind",
    )


# --- scenes, engines, tables ----------------------------------------------------------------------


def _texts(files: dict[str, bytes]) -> st.SearchStrategy[bytes]:
    """Files of TOML with members or bytes changed."""
    trees = [tomllib.loads(data.decode()) for data in files.values()]
    members = st.sampled_from(trees).flatmap(lambda tree: changed(tree, names()))
    written = members.map(lambda tree: toml_text(tree).encode("utf-8", "replace"))
    return written | st.sampled_from(list(files.values())).flatmap(cut_up)


def _read_scene(path: Path) -> Any:
    from sweeps.planning.forecast import text
    from sweeps.planning.plan import make_plan
    from sweeps.scene.reading import read_scene

    plan = make_plan(read_scene(path))
    text(plan)
    return plan


def check_scene(data: bytes) -> None:
    home = sandbox()
    path = home / "scenes" / "mutated.toml"
    path.write_bytes(data)
    with unchanged(home):
        refused_or_taken(lambda: _read_scene(path))


def check_engine(data: bytes) -> None:
    from sweeps.presenting.engines import engine_text
    from sweeps.reading.engine_files import load_engine

    home = sandbox()
    path = home / "scenes" / "mutated.toml"
    path.write_bytes(data)
    with unchanged(home):
        if refused_or_taken(lambda: engine_text(load_engine(path))):
            scene = {"engine": str(path), "output": {"quantities": ["delta", "imep"]}}
            refused_or_taken(lambda: _read_scene(scene))  # type: ignore[arg-type]


_TABLES: dict[str, tuple[bytes, dict[str, Any]]] = {
    "indicator": (b"", {"indicator": {"file": "mutated.csv"}}),
    "load": (LOAD.encode(), {"set": {"load_table": "mutated.csv"}}),
    "driver": (DRIVER.encode(), {"set": {"driver_table": "mutated.csv"}}),
    "designs": (DESIGNS.encode(), {"designs": {"file": "mutated.csv"}}),
    "reference": (
        PUBLISHED.encode(),
        {
            "axes": {"speed": [1000, 1200], "inertia": [1, 9]},
            "designs": {"case": ["one", "two"], "bore": [0.14, 0.15]},
            "reference": {"file": "mutated.csv"},
        },
    ),
}


def _tables() -> st.SearchStrategy[tuple[str, bytes]]:
    def of(kind: str) -> st.SearchStrategy[tuple[str, bytes]]:
        data = _TABLES[kind][0] or (ENGINES / PRESSURE).read_bytes()
        return st.tuples(st.just(kind), cut_up(data))

    return st.sampled_from(list(_TABLES)).flatmap(of)


def check_table(example: tuple[str, bytes]) -> None:
    kind, data = example
    home = sandbox()
    folder = home / "scenes"
    (folder / "mutated.csv").write_bytes(data)
    scene = {"engine": "ntua", "output": {"quantities": ["delta"]}, **_TABLES[kind][1]}
    path = folder / "mutated.toml"
    path.write_text(toml_text(scene))
    with unchanged(home):
        refused_or_taken(lambda: _read_scene(path))


# --- netCDF and Parquet tables --------------------------------------------------------------------

_KEYS = ["bore", "stroke", "case", "design", "speed", "Bore", "delta", "x", "passes"]
_TYPES = ["f8", "f4", "i4", "i8", "u1", "S1", "str", "compound", "vlen", "enum", "opaque"]
_ATTRIBUTES: st.SearchStrategy[tuple[str, Any]] = st.tuples(
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

_variables = st.lists(
    st.tuples(
        st.sampled_from(_KEYS),
        st.sampled_from(_TYPES),
        st.lists(st.sampled_from(["design", "n", "huge", "none"]), max_size=2, unique=True),
        st.sampled_from([None, 1, 10**3, 10**9]),
        st.lists(_ATTRIBUTES, max_size=2),
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
    import netCDF4
    import pyarrow as pa
    import pyarrow.parquet as pq

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
        st.sampled_from(_KEYS),
        st.sampled_from(kinds),
        st.sampled_from([None, b"m", b"furlong", b"\xff\xfe", b'{"index_columns": 3}', b"["]),
    )
    return st.lists(column, min_size=1, max_size=3)


def write_parquet(path: Path, columns: list[tuple[str, str, Any]]) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

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


def _binary_tables() -> st.SearchStrategy[tuple[str, Any]]:
    return st.one_of(
        st.tuples(st.just(".nc"), _variables),
        st.tuples(st.just(".parquet"), _parquet_columns()),
        st.sampled_from(sorted(good_tables())).flatmap(
            lambda suffix: st.tuples(st.just(suffix), cut_up(good_tables()[suffix]))
        ),
    )


def check_binary_table(example: tuple[str, Any]) -> None:
    import netCDF4

    from sweeps.reading.design_files import read_designs

    suffix, content = example
    path = sandbox() / "scenes" / f"mutated{suffix}"
    path.unlink(missing_ok=True)
    if isinstance(content, bytes):
        path.write_bytes(content)
    elif suffix == ".nc":
        with netCDF4.Dataset(path, "w") as file:
            add_variables(file, content)
    else:
        write_parquet(path, content)
    with unchanged(sandbox()):
        refused_or_taken(lambda: read_designs(path, "mutated"))


# --- archives -------------------------------------------------------------------------------------

_SMALL = {
    "title": "small",
    "engine": "diesel_105x137",
    "axes": {"speed": [1500, 1600, 1700], "inertia": [1.0, 2.0]},
    "solver": {"method": ["auto", "newton"]},
    "output": {"quantities": ["delta", "omega", "imep", "gas_torque"], "angle_step": 30},
}


@cache
def good_archive(part: bool = False) -> bytes:
    """An archive whose numbers nobody computed."""
    from sweeps.archive import netcdf
    from sweeps.archive.labels import label
    from sweeps.planning.plan import make_plan
    from sweeps.planning.shards import shard
    from sweeps.scene.reading import read_scene

    plan = make_plan(read_scene(_SMALL))
    if part:
        plan = shard(plan, 1, 3)
    results = {}
    for name in plan.outputs:
        shape = tuple(plan.sizes[d] for d in plan.dims(name))
        results[name] = (
            np.zeros(shape, "i1") if name == "status" else 1.0 + np.indices(shape).sum(0)
        )
    path = sandbox() / "good.nc"
    netcdf.write(label(plan, results, seconds=1.0), path, overwrite=True)
    data = path.read_bytes()
    path.unlink()
    return data


@cache
def _attributes_of_archive(part: bool) -> dict[str, Any]:
    import netCDF4

    path = sandbox() / "good.nc"
    path.write_bytes(good_archive(part))
    with netCDF4.Dataset(path) as file:
        found = {n: file.getncattr(n) for n in file.ncattrs()}
    path.unlink()
    return found


def _json_or_text(value: Any) -> st.SearchStrategy[Any]:
    """An attribute changed: its JSON, where it is some, its text, its type."""
    others: list[st.SearchStrategy[Any]] = [
        st.sampled_from(["", "{}", "[]", "null", "[" * 100_000, '{"a":' * 5000, "NaN", "1e999"]),
        st.floats(), st.integers(-9, 9), st.lists(st.floats(), min_size=1, max_size=3),
    ]  # fmt: skip
    if isinstance(value, str):
        cut = cut_up(value.encode("utf-8", "replace")).map(
            lambda data: data.decode("utf-8", "replace").replace("\0", "")
        )
        others.append(cut)
        with suppress(ValueError):
            tree = json.loads(value)
            if isinstance(tree, dict):
                others += [changed(tree, names()).map(_as_json)] * 4
    return st.one_of(others)


def _as_json(tree: Any) -> str:
    return json.dumps(tree, default=str)


def _archives() -> st.SearchStrategy[Any]:
    def attribute(part: bool) -> st.SearchStrategy[Any]:
        known = _attributes_of_archive(part)
        likely = [n for n in ("scene", "identity", "input_files", "part") if n in known] * 4
        one = st.sampled_from([*known, *likely]).flatmap(
            lambda n: st.tuples(st.just(n), st.none() | _json_or_text(known[n]))
        )
        return st.tuples(st.just(part), st.lists(one, min_size=1, max_size=2))

    of_variable = st.lists(
        st.tuples(
            st.sampled_from(["delta", "speed", "method_name", "status", "omega", "crank_angle"]),
            _ATTRIBUTES | st.tuples(st.just("rename"), st.sampled_from(_KEYS)),
        ),
        max_size=3,
    )
    return st.one_of(
        st.tuples(st.just("attributes"), st.booleans().flatmap(attribute)),
        st.tuples(st.just("attributes"), st.booleans().flatmap(attribute)),
        st.tuples(st.just("variables"), st.tuples(_variables, of_variable)),
        st.tuples(st.just("bytes"), cut_up(good_archive())),
    )


def write_archive(path: Path, example: tuple[str, Any]) -> None:
    import netCDF4

    kind, content = example
    path.unlink(missing_ok=True)
    if kind == "bytes":
        path.write_bytes(content)
        return
    path.write_bytes(good_archive(content[0] if kind == "attributes" else False))
    with netCDF4.Dataset(path, "r+") as file:
        if kind == "attributes":
            for name, value in content[1]:
                with suppress(AttributeError, RuntimeError, TypeError, OSError, ValueError):
                    file.delncattr(name)
                    if value is not None:
                        file.setncattr(name, value)
            return
        add_variables(file, content[0])
        for name, (attribute, value) in content[1]:
            with suppress(
                AttributeError, RuntimeError, TypeError, OSError, ValueError, KeyError, IndexError
            ):
                if attribute == "rename":
                    file.renameVariable(name, value)
                else:
                    file[name].setncattr(attribute, value)


def check_archive(example: tuple[str, Any]) -> None:
    """Whatever reads archives, but figures: they take long."""
    from sweeps.archive.contents import part_of, plan_of, read_contents
    from sweeps.exploring import opening

    home = sandbox()
    path, other = home / "scenes" / "mutated.nc", home / "scenes" / "other.nc"
    write_archive(path, example)
    other.write_bytes(good_archive())
    with unchanged(home):
        refused_or_taken(lambda: part_of(old := read_contents(path), plan_of(old)))
        refused_or_taken(lambda: opening.open([other, path]).close())
    table = home / "out" / "table.csv"
    merged = home / "out" / "merged.nc"
    for arguments in (
        ("info", path), ("compare", path, other), ("compare", other, path),
        ("export", path, "-o", table, "--overwrite"),
        ("merge", path, other, "-o", merged, "--overwrite"),
    ):  # fmt: skip
        in_one_line(*arguments)


def check_figures(example: tuple[str, Any]) -> None:
    home = sandbox()
    path = home / "scenes" / "mutated.nc"
    write_archive(path, example)
    with unchanged(home / "scenes"), unchanged(home / "outside"):
        in_one_line("plot", path, "-o", home / "out" / "figures", "--format", "svg")


# --- interrupted runs -----------------------------------------------------------------------------

_PLAIN = {
    "engine": "diesel_105x137",
    "axes": {
        "speed": {"start": 1000, "stop": 2000, "num": 40},
        "stroke": {"start": 0.1, "stop": 0.2, "num": 40},
    },
    "output": {"quantities": ["mean_piston_speed"]},
}


@cache
def good_partial() -> dict[str, bytes]:
    """Files of an interrupted run that needs no compiled kernel."""
    from sweeps.archive.partial import Partial
    from sweeps.planning.plan import make_plan
    from sweeps.running import into_archive, limits
    from sweeps.running.options import Options, Stopped
    from sweeps.scene.reading import read_scene

    output = sandbox() / "out" / "interrupted.nc"
    write, count = Partial.write, [0]

    def until(self: Partial, *arguments: Any) -> int:
        count[0] += 1
        if count[0] > 3:
            raise KeyboardInterrupt
        return write(self, *arguments)

    largest = limits.LARGEST_BLOCK
    limits.LARGEST_BLOCK = 4e3
    Partial.write = until  # type: ignore[assignment, method-assign]
    try:
        with suppress(Stopped):
            into_archive.run(make_plan(read_scene(_PLAIN)), output, Options())
    finally:
        limits.LARGEST_BLOCK = largest
        Partial.write = write  # type: ignore[method-assign]
    folder = Partial.of(output)
    found = {p.name: p.read_bytes() for p in folder.path.iterdir() if p.name != "lock"}
    folder.remove()
    return found


def _partials() -> st.SearchStrategy[Any]:
    files = good_partial()
    header = json.loads(files["run.json"])
    blocks = [n for n in files if n != "run.json"]
    return st.one_of(
        changed(header, names()).map(lambda tree: ("run.json", _as_json(tree).encode())),
        cut_up(files["run.json"]).map(lambda data: ("run.json", data)),
        st.sampled_from(blocks).flatmap(
            lambda n: st.tuples(st.just(n), cut_up(files[n]).map(_with_right_hash))
        ),
        st.tuples(
            st.sampled_from([*files, "archive.nc", "lock", "run.json.new", "block-000004.bin.new"]),
            st.sampled_from(["link", "loop", "pipe", "folder"]),
        ),
    )


def _with_right_hash(data: bytes) -> bytes:
    """A damaged block that somebody signed."""
    import hashlib

    first, _, rest = data.partition(b"\n")
    return first[: first.rfind(b" ") + 1] + hashlib.sha256(rest).hexdigest().encode() + b"\n" + rest


def check_partial(example: tuple[str, Any]) -> None:
    from sweeps.archive.partial import Partial
    from sweeps.planning.plan import make_plan
    from sweeps.running import into_archive
    from sweeps.running.options import Options, Stopped
    from sweeps.scene.reading import read_scene

    home = sandbox()
    output = home / "out" / "interrupted.nc"
    folder = Partial.of(output).path
    _remove(folder)
    output.unlink(missing_ok=True)
    folder.mkdir()
    for name, data in good_partial().items():
        (folder / name).write_bytes(data)
    name, content = example
    if isinstance(content, bytes):
        (folder / name).write_bytes(content)
    else:
        (folder / name).unlink(missing_ok=True)
        if content == "pipe":
            os.mkfifo(folder / name)
        elif content == "folder":
            (folder / name).mkdir()
        else:
            (folder / name).symlink_to(
                home / "outside" / "precious.txt" if content == "link" else name
            )
    with unchanged(home / "outside"), unchanged(home / "scenes"):
        in_one_line("info", folder)
        plan = make_plan(read_scene(_PLAIN))
        try:
            taken = refused_or_taken(lambda: into_archive.run(plan, output, Options(resume=True)))
        except (Stopped, OSError) as error:
            # A folder or a link in a circle where a file must be: the command words it.
            assert content in ("folder", "loop", "pipe", "link"), error
            taken = False
    if taken:
        import netCDF4

        with netCDF4.Dataset(output) as file:
            values = file["mean_piston_speed"][...]
        speed, stroke = np.linspace(1000, 2000, 40), np.linspace(0.1, 0.2, 40)
        expected = np.multiply.outer(speed, stroke) / 30.0
        # Blocks with other numbers and the right hash were written by somebody who may.
        if not (isinstance(content, bytes) and name.startswith("block")):
            np.testing.assert_allclose(values, expected, rtol=1e-12)


def _remove(path: Path) -> None:
    """Remove a folder of one or two levels."""
    if path.is_symlink() or not path.is_dir():
        path.unlink(missing_ok=True)
        return
    for inner in path.iterdir():
        _remove(inner)
    path.rmdir()


# --- the command line -----------------------------------------------------------------------------


def in_one_line(*arguments: Any) -> None:
    """Run a command; where it refuses, in one line and with status 2."""
    from sweeps.cli.main import main as command

    result = click.testing.CliRunner().invoke(command, [str(a) for a in arguments])
    if result.exit_code not in (0, 2) and result.exception is not None:
        raise AssertionError(f"{arguments}: {result.exit_code}: {result.stderr}") from (
            result.exception
        )
    text = result.stderr + result.stdout
    assert "Traceback" not in text, text
    if result.exit_code == 2:
        last = result.stderr.rstrip("\n").splitlines()[-1]
        assert last.startswith(("engine-dyn: ", "Error: ")), result.stderr
        assert last.isprintable(), result.stderr
        own = [line for line in result.stderr.splitlines() if line.startswith("engine-dyn: ")]
        assert len(own) <= 1 and (not own or len(result.stderr.splitlines()) == 1), result.stderr
    COUNTS["taken" if result.exit_code == 0 else "refused"] += 1


def _command_lines() -> st.SearchStrategy[list[str]]:
    home = sandbox()
    folder = home / "scenes"
    (folder / "good.nc").write_bytes(good_archive())
    here = [name for name in (*WORDS, "good.nc", "n" * 300) if "/" not in name]
    paths = [str(folder / name) for name in (*here, "d/" * 3000)]
    word = st.sampled_from([*paths, *WORDS]).map(lambda w: w.replace("\0", "")) | st.text(
        max_size=12
    ).map(lambda w: w.replace("\0", "").encode("utf-8", "replace").decode())
    # No run starts: nothing here is both a sound scene and a place to write.
    output = st.sampled_from(
        [str(home / "outside" / "precious.txt" / "out.nc"), str(folder), "/dev/null", "/dev/full",
         str(folder / "fifo"), str(folder / "loop.csv"), str(folder / ("n" * 300)),
         str(folder / ("d/" * 3000) / "out.nc"), str(folder / "good.nc"), ""]
    )  # fmt: skip
    good = str(folder / "good.nc")
    return st.one_of(
        st.tuples(st.sampled_from(["info", "plan"]), word).map(list),
        st.tuples(st.just("run"), word, st.just("-o"), output).map(list),
        st.tuples(st.just("run"), st.just("first"), st.just("-o"), output).map(list),
        st.tuples(st.just("export"), st.just(good), st.just("-o"), output | word,
                  st.just("--quantities"), word).map(list),
        st.tuples(st.just("extend"), st.just(good), st.just("--axis"),
                  word | word.map(lambda w: f"inertia={w}")).map(list).filter(
                      lambda words: not any(c.isdigit() for c in words[-1])),
        st.tuples(st.just("plot"), st.just(good), st.just("-o"), output, st.just("--select"),
                  word | word.map(lambda w: f"speed={w}")).map(list),
        st.tuples(st.just("compare"), st.just(good), word, st.just("--tolerance"), word).map(list),
        st.tuples(st.just("merge"), word, st.just(good), st.just("-o"), output).map(list),
        st.tuples(st.just("rerun"), word, st.just("-o"), output).map(list),
        st.tuples(st.just("run"), st.just("first"), st.just("-o"), output, st.just("--overwrite"),
                  st.just("--shard"), word).map(list),
        st.tuples(st.just("run"), st.just("first"), st.just("-o"), output, st.just("--memory"),
                  word).map(list),
        st.tuples(st.just("new"), output).map(list),
    )  # fmt: skip


def check_command_line(arguments: list[str]) -> None:
    with unchanged(sandbox()):
        in_one_line(*arguments)


# --- campaigns ------------------------------------------------------------------------------------

TARGETS: dict[str, tuple[Callable[[], st.SearchStrategy[Any]], Callable[[Any], None]]] = {
    "scene": (lambda: _texts(scenes()), check_scene),
    "engine": (lambda: _texts(engines()), check_engine),
    "table": (_tables, check_table),
    "binary table": (_binary_tables, check_binary_table),
    "archive": (_archives, check_archive),
    "figures": (_archives, check_figures),
    "partial": (_partials, check_partial),
    "command line": (_command_lines, check_command_line),
}


def campaign(name: str, seconds: float, number: int) -> None:
    """Run one target in this process; ends it."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    make, check = TARGETS[name]
    strategy = make()
    end = time.monotonic() + seconds

    def timed(example: Any) -> None:
        COUNTS["inputs"] += 1
        signal.alarm(10 * LONGEST)
        signal.setitimer(signal.ITIMER_PROF, LONGEST)
        try:
            check(example)
        finally:
            signal.alarm(0)
            signal.setitimer(signal.ITIMER_PROF, 0)

    @settings(
        max_examples=25, deadline=None, database=None, derandomize=False,
        suppress_health_check=list(HealthCheck), print_blob=True,
    )  # fmt: skip
    @given(strategy)
    def test(example: Any) -> None:
        timed(example)

    def too_slow(*_: Any) -> NoReturn:
        raise TimeoutError(f"more than {LONGEST} s")

    signal.signal(signal.SIGALRM, too_slow)
    signal.signal(signal.SIGPROF, too_slow)
    try:
        atheris = _atheris()
        if atheris is not None:
            _led(atheris, test.hypothesis.fuzz_one_input, seconds, number)  # type: ignore[attr-defined]
        while time.monotonic() < end:
            seed(number)(test)()
            number += 1
    finally:
        print(json.dumps(COUNTS), flush=True)


def _atheris() -> Any:
    try:
        return importlib.import_module("atheris")
    except ImportError:
        return None


def _led(atheris: Any, one: Callable[[bytes], Any], seconds: float, number: int) -> None:
    """Inputs that coverage leads; returns when the time is over."""
    for found in pkgutil.walk_packages([str(PACKAGE)], "sweeps."):
        if found.name == "sweeps.__main__":
            continue
        module = importlib.import_module(found.name)
        for item in vars(module).values():
            if inspect.isfunction(item) and item.__module__ == module.__name__:
                atheris.instrument_func(item)

    class Over(BaseException):
        pass

    end = time.monotonic() + seconds

    def until(data: bytes) -> None:
        if time.monotonic() > end:
            print(json.dumps(COUNTS), flush=True)
            os._exit(0)
        one(data)

    arguments = ["fuzz", f"-seed={number}", "-max_len=8192", "-len_control=0", "-rss_limit_mb=0"]
    atheris.Setup(arguments, until, internal_libfuzzer=True)
    atheris.Fuzz()


def main() -> None:
    """Run every target in a process of its own."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=600.0, help="for all targets together")
    parser.add_argument("--target", choices=list(TARGETS), action="append")
    parser.add_argument("--seed", type=int, default=None)
    parser.add_argument("--here", action="store_true", help="in this process")
    given_ = parser.parse_args()
    chosen = given_.target or list(TARGETS)
    number = random.SystemRandom().randrange(2**31) if given_.seed is None else given_.seed
    share = given_.seconds / len(chosen)
    if given_.here:
        campaign(chosen[0], share, number)
        return
    failed = []
    print(f"seed {number}, {'atheris' if _atheris() else 'hypothesis'}", flush=True)
    for name in chosen:
        words = [sys.executable, "-m", "benchmarks.fuzz", "--here", "--target", name]
        words += ["--seconds", str(share), "--seed", str(number)]
        done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT)
        counts = (done.stdout.splitlines() or ["{}"])[-1]
        print(f"{name}: {counts}", flush=True)
        if done.returncode:
            failed.append(name)
            print(f"{name}: ended with {done.returncode}\n{done.stderr[-6000:]}", flush=True)
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
