"""Archives with attributes, variables or bytes changed."""

from __future__ import annotations

import json
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
from hypothesis import strategies as st

from benchmarks.fuzz.binary_tables import ATTRIBUTES, KEYS, add_variables, hostile_variables
from benchmarks.fuzz.changes import as_json, changed, cut_up
from benchmarks.fuzz.checking import in_one_line, refused_or_taken, unchanged
from benchmarks.fuzz.sandbox import names, sandbox
from sweeps.archive import netcdf
from sweeps.archive.contents import part_of, plan_of, read_contents
from sweeps.archive.labels import label
from sweeps.exploring import opening
from sweeps.planning.plan import make_plan
from sweeps.planning.shards import shard
from sweeps.scene.reading import read_scene

__all__ = ["archives", "check_archive", "check_figures", "good_archive", "write_archive"]

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
    plan = make_plan(read_scene(_SMALL))
    if part:
        plan = shard(plan, 1, 3)
    shapes = {name: tuple(plan.sizes[d] for d in plan.dims(name)) for name in plan.outputs}
    results = {name: 1.0 + np.indices(shape).sum(0) for name, shape in shapes.items()}
    results["status"] = np.zeros(shapes["status"], "i1")
    path = sandbox() / "good.nc"
    netcdf.write(label(plan, results, seconds=1.0), path, overwrite=True)
    data = path.read_bytes()
    path.unlink()
    return data


@cache
def _attributes_of_archive(part: bool) -> dict[str, Any]:
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
                others += [changed(tree, names()).map(as_json)] * 4
    return st.one_of(others)


def archives() -> st.SearchStrategy[Any]:
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
            ATTRIBUTES | st.tuples(st.just("rename"), st.sampled_from(KEYS)),
        ),
        max_size=3,
    )
    return st.one_of(
        st.tuples(st.just("attributes"), st.booleans().flatmap(attribute)),
        st.tuples(st.just("attributes"), st.booleans().flatmap(attribute)),
        st.tuples(st.just("variables"), st.tuples(hostile_variables, of_variable)),
        st.tuples(st.just("bytes"), cut_up(good_archive())),
    )


def write_archive(path: Path, example: tuple[str, Any]) -> None:
    kind, content = example
    path.unlink(missing_ok=True)
    if kind == "bytes":
        path.write_bytes(content)
        return
    path.write_bytes(good_archive(content[0] if kind == "attributes" else False))
    refused = suppress(AttributeError, RuntimeError, TypeError, OSError, ValueError, LookupError)
    with netCDF4.Dataset(path, "r+") as file:
        if kind == "attributes":
            for name, value in content[1]:
                with refused:
                    file.delncattr(name)
                    if value is not None:
                        file.setncattr(name, value)
            return
        add_variables(file, content[0])
        for name, (attribute, value) in content[1]:
            with refused:
                if attribute != "rename":
                    file[name].setncattr(attribute, value)
                # The library cannot close a file with a variable named as a dimension.
                elif value not in file.dimensions:
                    file.renameVariable(name, value)


def check_archive(example: tuple[str, Any]) -> None:
    """Whatever reads archives, but figures: they take long."""
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
        ("info", path), ("show", path), ("compare", path, other), ("compare", other, path),
        ("export", path, "-o", table, "--overwrite"),
        ("merge", path, other, "-o", merged, "--overwrite"),
    ):  # fmt: skip
        in_one_line(*arguments)


def check_figures(example: tuple[str, Any]) -> None:
    home = sandbox()
    path = home / "scenes" / "mutated.nc"
    write_archive(path, example)
    with unchanged(home / "scenes", home / "outside"):
        in_one_line("plot", path, "-o", home / "out" / "figures", "--format", "svg")
