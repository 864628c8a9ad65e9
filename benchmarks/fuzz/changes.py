"""How sound texts, tables and bytes are made hostile: strategies of hypothesis."""

from __future__ import annotations

import copy
import datetime
import json
from collections.abc import Iterator
from typing import Any

from hypothesis import strategies as st

__all__ = ["WORDS", "changed", "cut_up", "as_json"]

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
