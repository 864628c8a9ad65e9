"""Scenes, engine files and CSV tables with members or bytes changed."""

from __future__ import annotations

import tomllib
from typing import Any

from hypothesis import strategies as st

from benchmarks.fuzz.changes import changed, cut_up
from benchmarks.fuzz.checking import read_hostile, refused_or_taken
from benchmarks.fuzz.sandbox import DESIGNS, DRIVER, LOAD, PRESSURE, PUBLISHED, names, sandbox
from benchmarks.tables import toml_text
from sweeps.catalogue import ENGINES
from sweeps.planning.forecast import text
from sweeps.planning.plan import make_plan
from sweeps.presenting.engines import engine_text
from sweeps.reading.engine_files import load_engine
from sweeps.scene.reading import read_scene

__all__ = ["check_engine", "check_scene", "check_table", "tables", "texts"]


def texts(files: dict[str, bytes]) -> st.SearchStrategy[bytes]:
    """Files of TOML with members or bytes changed."""
    trees = [tomllib.loads(data.decode()) for data in files.values()]
    members = st.sampled_from(trees).flatmap(lambda tree: changed(tree, names()))
    written = members.map(lambda tree: toml_text(tree).encode("utf-8", "replace"))
    return written | st.sampled_from(list(files.values())).flatmap(cut_up)


def plan_of(scene: Any) -> str:
    """What `engine-dyn plan` says of a scene."""
    return text(make_plan(read_scene(scene)))


def check_scene(data: bytes) -> None:
    read_hostile("mutated.toml", data, plan_of)


def check_engine(data: bytes) -> None:
    if read_hostile("mutated.toml", data, lambda path: engine_text(load_engine(path))):
        engine = str(sandbox() / "scenes" / "mutated.toml")
        scene = {"engine": engine, "output": {"quantities": ["delta", "imep"]}}
        refused_or_taken(lambda: plan_of(scene))


_TABLES: dict[str, tuple[bytes, dict[str, Any]]] = {
    "indicator": ((ENGINES / PRESSURE).read_bytes(), {"indicator": {"file": "mutated.csv"}}),
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
"""Sound tables, and what names them in a scene."""


def tables() -> st.SearchStrategy[tuple[str, bytes]]:
    return st.sampled_from(list(_TABLES)).flatmap(
        lambda kind: st.tuples(st.just(kind), cut_up(_TABLES[kind][0]))
    )


def in_scene(data: bytes, scene: dict[str, Any], read: Any) -> bool:
    """Read a scene that names a hostile table; whether it was taken."""
    (sandbox() / "scenes" / "mutated.csv").write_bytes(data)
    return read_hostile("mutated.toml", toml_text(scene).encode("utf-8", "replace"), read)


def check_table(example: tuple[str, bytes]) -> None:
    kind, data = example
    scene = {"engine": "ntua", "output": {"quantities": ["delta"]}, **_TABLES[kind][1]}
    in_scene(data, scene, plan_of)
