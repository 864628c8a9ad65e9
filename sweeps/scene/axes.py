"""Parameters of [set] and [axes]: single values, lists, and ranges of start, stop and num."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.quantities.node import Node
from engine_dyn.quantities.parameters import SOLVER_COLUMNS
from engine_dyn.types import Floats
from sweeps.base.checks import check_range, check_structure, known_key, number, numbers
from sweeps.base.dimensions import ENGINE, INERTIA_MODEL, LABELS, METHOD
from sweeps.base.errors import SceneError, counted, one_line, shown
from sweeps.base.files.regular_files import referred
from sweeps.scene import cylinders, firing_patterns
from sweeps.scene.engine.cylinder_keys import CYLINDER_KEYS, CylinderKeys
from sweeps.scene.features import KEYS_OF_SET
from sweeps.scene.toml_tables import LARGEST_AXIS, DesignTable, Range, SceneFile
from sweeps.scene.whole_keys import check_of_designs
from sweeps.scene.word_keys import WordKey

MOST_VALUES = 2 * LARGEST_AXIS  # Largest number of values of all axes of one scene together

_ONE_ENGINE = "an engine of the catalogue or the path of an engine file"

_AT_THE_TOP = frozenset(SceneFile.model_fields) - PARAMETERS.keys()

WORD_KEYS: Mapping[str, WordKey] = {
    one.name: one
    for one in (
        cylinders.KEY,
        firing_patterns.KEY,
        WordKey(
            ENGINE, _ONE_ENGINE, "a list of engines of the catalogue or paths of engine files",
            {"type": "string", "minLength": 1, "description": _ONE_ENGINE},
        ),
    )
}  # fmt: skip
"""Keys of axes of words by name; `engine_choices` reads engines before these."""


def read_settings(raw: Mapping[str, Any], name: str) -> dict[str, float]:
    """Read and check the parameters of [set], but for keys of cylinders and of features."""
    values: dict[str, float] = {}
    for key, item in raw.items():
        if key in CYLINDER_KEYS or key in KEYS_OF_SET or key in WORD_KEYS:
            continue
        node = _parameter(key, "set", name)
        where = f"{name}: [set] {key}"
        values[key] = number(item, where, node)
        check_range(values[key], where, node)
    return values


def read_axes(
    raw: Mapping[str, Any], keys: CylinderKeys, name: str
) -> tuple[dict[str, Floats | tuple[str, ...]], dict[str, tuple[Any, ...]]]:
    """Read and check [axes]; `keys` are those of [set] that an axis of arrangements excludes.

    Returned are the values of every axis in the order of the file, numbers or names of words, and
    what the words stand for along each axis of `WORD_KEYS` that there is.
    """
    axes: dict[str, Floats | tuple[str, ...]] = {}
    words: dict[str, tuple[Any, ...]] = {}
    for key, item in raw.items():
        word = WORD_KEYS.get(key)
        if word is not None and word.read is not None:
            words[key] = word.read(item, keys, name)
            axes[key] = tuple(map(word.name_of, words[key]))
        else:
            axes[key] = _axis(key, item, name)
        total = sum(len(values) for values in axes.values())
        if total > MOST_VALUES:
            raise SceneError(
                f"{name}: [axes] {key}: {total} values together with the previous axes; must be "
                f"at most {MOST_VALUES} together"
            )
    return axes, words


def _parameter(key: str, table: str, name: str) -> Node:
    """Parameter that a key of [set] or [axes] names."""
    check_of_designs(key, f"{name}: [{table}] {key}", "" if table == "set" else f"[{table}]")
    if key in SOLVER_COLUMNS:
        raise SceneError(f"{name}: [{table}] {key}: must be in [solver] or a column of [designs]")
    if key in (METHOD, INERTIA_MODEL):
        raise SceneError(f"{name}: [{table}] {key}: belongs in [solver]; a list makes it an axis")
    if key in _AT_THE_TOP:
        raise SceneError(
            f"{name}: [{table}] {key}: belongs at the top of the scene, above the tables, or in a "
            f"table of its own; not in [{table}]"
        )
    node = known_key(key, f"{name}: [{table}]", without=SOLVER_COLUMNS)
    assert node is not None  # Without `also`, `known_key` returns a parameter
    return node


def _axis(key: str, raw: Any, name: str) -> Floats:
    """One axis: a list, or a range with start, stop, num and spacing."""
    node = _parameter(key, "axes", name)
    where = f"{name}: [axes] {key}"
    if isinstance(raw, dict):
        ends = {end: number(raw[end], f"{where} {end}", node) for end in ("start", "stop")
                if isinstance(raw.get(end), str)}  # fmt: skip
        values = _range({**raw, **ends}, where)
    elif isinstance(raw, list | np.ndarray):
        values = numbers(raw, where, node)
    else:
        raise SceneError(
            f"{where} = {shown(raw)}: must be a list, or a table with start, stop, num and "
            "optionally spacing = 'log'; a single value belongs in [set]"
        )
    check_range(values, where, node)
    ordered = np.sort(values)
    twice = ordered[1:][ordered[1:] == ordered[:-1]]
    if twice.size:
        raise SceneError(f"{where}: duplicate value {twice[0]:.12g}; axis values must be unique")
    return values


def _range(raw: dict[str, Any], where: str) -> Floats:
    """Values of start/stop/num."""
    given = check_structure(Range, raw, where)
    ends = (("start", given.start), ("stop", given.stop))
    for end, value in ends:
        number(value, f"{where} {end}")
    if given.start == given.stop:
        raise SceneError(
            f"{where}: start and stop are both {given.start:g}; they must differ (a single value "
            "belongs in [set])"
        )
    if given.spacing == "linear":
        return np.linspace(given.start, given.stop, given.num)
    for end, value in ends:
        if value <= 0.0:
            raise SceneError(f"{where} {end} = {value:g}: must be above 0 with spacing = 'log'")
    return np.geomspace(given.start, given.stop, given.num)


def read_designs_table(raw: Mapping[str, Any] | None, name: str, base: Path) -> DesignTable:
    """Read and check [designs]: columns of numbers, and labels."""
    columns: dict[str, Floats] = {}
    labels: dict[str, tuple[str, ...]] = {}
    if raw is None:
        return DesignTable(columns, labels)
    if "file" in raw:
        return _designs_from_file(raw, name, base)
    for key, item in raw.items():
        where = f"{name}: [designs] {key}"
        if key not in LABELS:
            check_of_designs(key, where, "[designs]")
        node = known_key(key, f"{name}: [designs]", LABELS)
        if node is None:
            labels[key] = _labels(item, where)
            continue
        columns[key] = numbers(item, where, node)
        check_range(columns[key], where, node)
    _check_lengths({**columns, **labels}, name)
    return DesignTable(columns, labels)


def _labels(raw: Any, where: str) -> tuple[str, ...]:
    if not isinstance(raw, list) or not raw or not all(isinstance(item, str) for item in raw):
        raise SceneError(f"{where} = {shown(raw)}: must be a list of strings, one for each design")
    return tuple(one_line(item) for item in raw)


def _check_lengths(columns: Mapping[str, Any], name: str) -> None:
    if not set(columns) - {LABELS[0]}:
        raise SceneError(
            f"{name}: [designs] has no column for a parameter; at least one is needed, such as "
            "inertia = [1.0, 2.0]"
        )
    lengths = {key: len(values) for key, values in columns.items()}
    first, expected = next(iter(lengths.items()))
    for key, length in lengths.items():
        if length != expected:
            raise SceneError(
                f"{name}: [designs] {key} has {counted(length, 'value')}, {first} has {expected}: "
                "lists of [designs] must be equally long"
            )


def _designs_from_file(raw: Mapping[str, Any], name: str, base: Path) -> DesignTable:
    """Designs in [designs] file = "table.csv", whose columns are named as keys."""
    file = raw["file"]
    if not isinstance(file, str) or not file:
        raise SceneError(
            f"{name}: [designs] file = {shown(file)}: must be a string: the path of a CSV, netCDF "
            "or Parquet file"
        )
    for key in raw:
        if key != "file":
            raise SceneError(
                f"{name}: [designs] {key}: not allowed together with file, which contains all "
                "columns"
            )
    path = referred(base, file, f"{name}: [designs] file")
    from sweeps.scene.design_files.design_files import read_designs

    table = read_designs(path, f"{name}: [designs] {file}")
    _check_lengths({**table.columns, **table.labels}, name)
    return table
