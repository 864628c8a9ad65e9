"""Tables of designs from the first sheet of .xlsx files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import SceneError
from sweeps.base.files.regular_files import check_rows, reading, regular_bytes
from sweeps.base.files.sheets import sheets
from sweeps.scene.design_files.design_columns import (
    DesignColumns,
    check_kind,
    check_units,
    known_columns,
    take_numbers,
)

__all__ = ["read_design_xlsx"]

MOST = 1 << 28
"""Bytes of a file."""


def read_design_xlsx(path: Path, name: str) -> DesignColumns:
    """Read columns: names in the first row, and units in the second where it holds texts alone."""
    what = "a table of designs (.xlsx)"
    with reading(name, what):
        data = regular_bytes(path, MOST)
    (rows,) = sheets(data, name, first=True).values()
    if len(rows) < 2:
        raise SceneError(f"{name}: no rows; expected {what}, with names in its first row")
    keys = ["" if cell is None else str(cell).strip() for cell in rows[0]]
    used = [place for place, key in enumerate(keys) if key != DESIGN]
    names = [keys[place] for place in used]
    if "" in names or len({*names}) < len(names):
        raise SceneError(
            f"{name}: row 1: a name is missing or given twice; each column has its own"
        )
    nodes = known_columns(names, name, "column")
    columns = DesignColumns(name, nodes)
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
