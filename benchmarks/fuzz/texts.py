"""Scenes, engine files and CSV tables with members or bytes changed."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

from benchmarks.fuzz.changes import changed, cut_up
from benchmarks.fuzz.checking import refused_or_taken, unchanged
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


def _read_scene(path: Path) -> Any:
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


def tables() -> st.SearchStrategy[tuple[str, bytes]]:
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
