"""Recordings in netCDF files: variables of numbers along one or two dimensions."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sweeps.base.columns.reading_choices import ReadingChoices
from sweeps.base.columns.recorded_columns import Column, Contents, check_size
from sweeps.base.errors import one_line
from sweeps.base.netcdf.netcdf_files import check_chunks, opened_table

__all__ = ["read"]


def read(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a netCDF file.

    Raises
    ------
    SceneError
        In one line.
    """
    del data, choices
    with opened_table(path, label, "a recording of a laboratory (netCDF)") as file:
        variables = {
            name: variable
            for name, variable in file.variables.items()
            if variable.ndim in (1, 2) and getattr(variable.dtype, "kind", "") in "iuf"
        }
        total = sum(float(np.prod(v.shape, dtype=float)) for v in variables.values())
        check_size(total, len(variables), label)
        columns = []
        for name, variable in variables.items():
            check_chunks(variable, variable.dtype.itemsize, label)
            values = np.ma.filled(np.ma.asarray(variable[...], np.float64), np.nan)
            unit = one_line(getattr(variable, "units", ""), 60)
            columns.append(Column(one_line(name, 200), unit, values))
    return Contents(columns)
