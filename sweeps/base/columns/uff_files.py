"""Recordings in universal files (.uff, .unv), of which data sets 58 are read by pyuff."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from sweeps.base.columns.reading_choices import ReadingChoices
from sweeps.base.columns.recorded_columns import Column, Contents, check_size
from sweeps.base.errors import SceneError, counted, one_line
from sweeps.base.files.libraries import library, library_reading

__all__ = ["read"]

_MARK = re.compile(rb"    -1(?= *[\r\n]| *\Z)")
"""What a data set begins and ends with."""

_ABSCISSA = {17: ("time", "s"), 18: ("frequency", "Hz"), 20: ("order", "")}
"""Names and units of abscissas that have no labels, by their numbers in data set 58."""


def read(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a universal file: abscissa and ordinate of each data set 58.

    An abscissa that repeats the one before it is left out. Complex values are two columns,
    "amplitude" and "phase" [deg].

    Raises
    ------
    SceneError
        In one line.
    """
    del path, choices
    pyuff = library("pyuff", "pyuff", label)
    if len(_MARK.findall(data)) % 2:
        raise SceneError(f"{label}: truncated: a data set of it has no end")
    # pyuff reads from a path alone: one in memory is gone with this process, however it ends.
    with library_reading(label, "a UFF file"), os.fdopen(os.memfd_create("uff"), "wb") as file:
        file.write(data)
        file.flush()
        found = pyuff.UFF(f"/proc/self/fd/{file.fileno()}")
        kinds = found.get_set_types().tolist()
        if 58 not in kinds:
            has = f"data sets {sorted(set(kinds))}" if kinds else "no data set between lines of -1"
            raise SceneError(f"{label}: not a UFF file with data set 58 (functions): has {has}")
        check_size(0.0, 2 * kinds.count(58), label)
        columns: list[Column] = []
        for number in (n for n, kind in enumerate(kinds) if kind == 58):
            columns += _columns(found.read_sets(number), columns, f"{label}: data set {number + 1}")
            check_size(float(sum(c.values.size for c in columns)), len(columns), label)
    return Contents(columns)


def _columns(one: dict[str, Any], before: list[Column], where: str) -> Iterator[Column]:
    """Columns of one data set."""
    claimed, values, x = one["num_pts"], one["data"], one["x"]
    if not 0 < claimed <= min(len(values), len(x)):
        raise SceneError(f"{where}: damaged: claims {counted(claimed, 'value')}, has {len(values)}")
    kind = _ABSCISSA.get(one["abscissa_spec_data_type"], ("abscissa", ""))
    name = _label(one["abscissa_axis_lab"]) or kind[0]
    abscissa = Column(name, _label(one["abscissa_axis_units_lab"]) or kind[1], x[:claimed])
    last = next((c for c in reversed(before) if c.name == name), None)
    if last is None or not np.array_equal(last.values, abscissa.values):
        yield abscissa
    unit = _label(one["ordinate_axis_units_lab"])
    if np.iscomplexobj(values):
        yield Column("amplitude", unit, np.abs(values[:claimed]))
        yield Column("phase", "deg", np.degrees(np.angle(values[:claimed])))
    else:
        name = _label(one["ordinate_axis_lab"]) or _label(one["id1"]) or "ordinate"
        yield Column(name, unit, np.asarray(values[:claimed], np.float64))


def _label(text: str) -> str:
    """Return a text of the file; "" where it says that there is none."""
    line = one_line(text, 80)
    return "" if line.upper() == "NONE" else line
