"""Tables of designs from netCDF files: one-dimensional variables, or the designs of an archive."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from engine_dyn.quantities.graph import ALL_QUANTITIES
from sweeps.base.dimensions import DESIGN, PUBLISHED
from sweeps.base.errors import SceneError, one_line
from sweeps.base.files.regular_files import check_rows
from sweeps.base.netcdf.netcdf_files import TEXT_REFERENCE, check_chunks, opened_table
from sweeps.scene.design_files.design_columns import (
    ROWS,
    DesignColumns,
    check_kind,
    check_units,
    known_columns,
    take_numbers,
)

__all__ = ["read_design_netcdf"]


def read_design_netcdf(path: Path, name: str) -> DesignColumns:
    """Read the one-dimensional variables of a netCDF file, or the designs of an archive."""
    with opened_table(path, name, "a table of designs (netCDF)") as file:
        variables = _variables_of_table(file, name)
        nodes = known_columns(list(variables), name, "variable")
        columns = DesignColumns(name, nodes)
        (dimension,) = {v.dimensions for v in variables.values()}
        count = len(file.dimensions[dimension[0]])
        if not count:
            raise SceneError(f"{name}: no rows along '{dimension[0]}'; at least one is needed")
        check_rows(count, len(variables), name)
        for key, node in nodes.items():
            variable = variables[key]
            check_kind(key, node, variable.dtype, str(variable.datatype), name)
            check_units(key, node, getattr(variable, "units", None), name)
            check_chunks(variable, getattr(variable.dtype, "itemsize", TEXT_REFERENCE), name)
            for begin in range(0, count, ROWS):
                values = variable[begin : begin + ROWS]
                if node is None:
                    columns.take(key, [str(text).strip() for text in values])
                    continue
                missing = np.ma.getmaskarray(values)
                take_numbers(columns, key, np.ma.getdata(values), missing, begin)
    return columns


def _variables_of_table(file: Any, name: str) -> dict[str, Any]:
    """Variables that are columns: along one dimension, all along the same."""
    # Beside its designs, an archive holds results, and axes that the designs are multiplied with.
    archive = "scene" in file.ncattrs() and DESIGN in file.dimensions
    variables = {
        key: variable
        for key, variable in file.variables.items()
        if key != DESIGN and not (archive and (variable.dimensions != (DESIGN,)))
        and key.removesuffix(PUBLISHED) not in ALL_QUANTITIES
    }  # fmt: skip
    if not variables:
        found = one_line(", ".join(file.variables) or "none", 200)
        raise SceneError(
            f"{name}: no variable is named as a parameter; found: {found}; allowed: see "
            "`engine-dyn list keys`"
        )
    known_columns(list(variables), name, "variable")  # an unknown name is told before a wrong shape
    first, expected = "", ""
    for key, variable in variables.items():
        if variable.ndim != 1:
            along = f"({', '.join(variable.dimensions)})" if variable.ndim else "none"
            raise SceneError(
                f"{name}: variable {key}: has dimensions {along}; must have one, the designs"
            )
        if first and variable.dimensions[0] != expected:
            raise SceneError(
                f"{name}: variable {key}: along '{variable.dimensions[0]}', {first} along "
                f"'{expected}'; all must be along one dimension, the designs"
            )
        first, expected = key, variable.dimensions[0]
    return variables
