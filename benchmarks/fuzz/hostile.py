"""Hostile input: how sound trees and bytes are changed, where it lies, and what must hold for it.

It is taken, or refused in one line, and nothing else is written.
"""

from __future__ import annotations

import copy
import datetime
import json
import os
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import click.testing
from hypothesis import strategies as st

from engine_dyn.quantities.graph import PARAMETERS, QUANTITIES
from sweeps.base.errors import SceneError
from sweeps.catalogue import ENGINES, SCENES
from sweeps.cli.main import main as command
from sweeps.scene.engine.cylinder_keys import CYLINDER_KEYS
from sweeps.scene.toml_tables import SceneFile

# How it is changed --------------------------------------------------------------------------------

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
def changed(draw: st.DrawFn, tree: Any) -> Any:
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
        name = draw(st.sampled_from(NAMES))
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
            # Three times 120 levels can still be written by `toml_text`; TOKENS go deeper.
            for _ in range(draw(st.sampled_from([1, 7, 9, 120]))):
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


def as_json(tree: Any) -> str:
    return json.dumps(tree, default=str)


# Where it lies -----------------------------------------------------------------------------------

PRESSURE = "diesel_105x137_pressure.csv"

FILES = {path.name: path.read_bytes() for path in Path(__file__).with_name("files").iterdir()}
"""A scene with every table, and what it names."""


@cache
def sandbox() -> Path:
    """A folder of scenes with files that they name, good and bad; beside it what is private."""
    home = Path(tempfile.mkdtemp(prefix="engine-dyn-fuzz-"))
    outside, inside = home / "outside", home / "scenes"
    outside.mkdir()
    inside.mkdir()
    (home / "out").mkdir()
    (home / "secret.csv").write_bytes(FILES["designs.csv"])
    (outside / "precious.txt").write_text("precious")
    pressure = (ENGINES / PRESSURE).read_bytes()
    files = {
        **FILES, "pressure.csv": pressure, PRESSURE: pressure,
        "engine.toml": engines()["diesel_105x137"],
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
    return {"all tables": FILES["scene.toml"], **built_in}


NAMES = (*WORDS, *PARAMETERS, *CYLINDER_KEYS, *SceneFile.model_fields, *QUANTITIES, "file", "kind")
"""Keys that a hostile tree may have."""


# What must hold -----------------------------------------------------------------------------------

COUNTS: Counter[str] = Counter()


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


def read_hostile(name: str, data: bytes, read: Callable[[Path], Any]) -> bool:
    """Read hostile bytes as a file in the folder of scenes; whether they were taken."""
    path = sandbox() / "scenes" / name
    path.unlink(missing_ok=True)
    path.write_bytes(data)
    with unchanged(sandbox()):
        return refused_or_taken(lambda: read(path))


@contextmanager
def unchanged(*folders: Path) -> Iterator[None]:
    """Nothing in some folders may change."""
    before = _listing(folders)
    yield
    assert _listing(folders) == before, "something was written elsewhere"


def _listing(folders: tuple[Path, ...]) -> list[tuple[str, int, int]]:
    found = ((path, path.lstat()) for folder in folders for path in folder.rglob("*"))
    return sorted((str(path), s.st_size, s.st_mtime_ns) for path, s in found)


def in_one_line(*arguments: Any) -> None:
    """Run a command; where it refuses, in one line and with status 2."""
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
