"""[designs] of a scene: parameters that vary together, as lists or as columns of a file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from engine_dyn.types import Floats
from sweeps.base.checks import check_range, known_key, numbers
from sweeps.base.dimensions import LABELS
from sweeps.base.errors import SceneError, counted, one_line, shown
from sweeps.base.files.regular_files import referred

__all__ = ["read_designs_table"]


def read_designs_table(
    raw: Mapping[str, Any] | None, name: str, base: Path
) -> tuple[dict[str, Floats], dict[str, tuple[str, ...]]]:
    """Read [designs]: columns of numbers, and labels.

    Raises
    ------
    SceneError
        For unknown keys, values that are no numbers or outside their range, unequal lengths.
    """
    columns: dict[str, Floats] = {}
    labels: dict[str, tuple[str, ...]] = {}
    if raw is None:
        return columns, labels
    if "file" in raw:
        return _designs_from_file(raw, name, base)
    for key, item in raw.items():
        where = f"{name}: [designs] {key}"
        node = known_key(key, f"{name}: [designs]", LABELS)
        if node is None:
            labels[key] = _labels(item, where)
            continue
        columns[key] = numbers(item, where, node)
        check_range(columns[key], where, node)
    _check_lengths({**columns, **labels}, name)
    return columns, labels


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


def _designs_from_file(
    raw: Mapping[str, Any], name: str, base: Path
) -> tuple[dict[str, Floats], dict[str, tuple[str, ...]]]:
    """[designs] file = "table.csv": its columns are named as keys."""
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

    columns, labels = read_designs(path, f"{name}: [designs] {file}")
    _check_lengths({**columns, **labels}, name)
    return columns, labels
