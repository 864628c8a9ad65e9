"""Objects of a notebook as values of a scene: pandas, xarray, range, and quantities of pint.

They become lists, arrays and texts before a scene is read, so that whatever is read further on is
the same for a file and for a notebook.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np

from engine_dyn.quantities.graph import PARAMETERS
from sweeps.base.dimensions import DESIGN, LABELS
from sweeps.base.errors import SceneError, one_line, shown
from sweeps.base.files.numbers_with_units import magnitude


@runtime_checkable
class _RecordedPressure(Protocol):
    """A pressure that `sweeps.read_pressure` has read."""

    recorded: Mapping[str, Any]

    def text(self, *, cycles: bool = False) -> str:
        """CSV of the diagram."""
        ...


def plain_objects(raw: Mapping[str, Any], name: str) -> tuple[dict[str, Any], dict[str, str]]:
    """Return the tables of a scene without objects of pandas, xarray and pint.

    Returned are the tables with lists, arrays and numbers, and the texts of CSV files that they
    name in place of objects. Messages begin with `name`, the scene, and name the key.
    """
    tables = dict(raw)
    if tables.get("designs") is not None:
        tables["designs"] = _designs(tables["designs"], f"{name}: [designs]")
    for table in ("set", "axes", "designs", "sample"):
        if _is_table(tables.get(table)):
            raise SceneError(
                f"{name}: [{table}]: is a {type(tables[table]).__name__}, which is only allowed "
                "as [designs]; must be a dict of columns, such as "
                f"{{'inertia': table['inertia']}}"
            )
        if isinstance(tables.get(table), Mapping):
            tables[table] = {
                key: _values(item, f"{name}: [{table}] {one_line(key, 60)}", key)
                for key, item in tables[table].items()
            }
    given = tables.get("indicator")
    if not isinstance(given, Mapping) or _is_table(given):
        given = {"file": given}
    text = _text(given.get("file"), f"{name}: [indicator]", tables)
    if text is None:
        return tables, {}
    called = "indicator_given_in_python.csv"  # Name that the object has as a file
    tables["indicator"] = {**given, "file": called}
    return tables, {called: text}


def _is(value: Any, package: str, *classes: str) -> bool:
    """Whether a value is of a class of pandas, xarray or pint, importing none of them."""
    module = sys.modules.get(package)
    return any(isinstance(value, getattr(module, c, ())) for c in classes) if module else False


def _is_table(value: Any) -> bool:
    return _is(value, "pandas", "DataFrame", "Series") or _is(
        value, "xarray", "DataArray", "Dataset"
    )


def _values(item: Any, where: str, key: Any) -> Any:
    """Value or values of one key; pandas and xarray as arrays, quantities in the key's unit."""
    node = PARAMETERS.get(key) if isinstance(key, str) else None
    if isinstance(item, Mapping) and not _is_table(item):  # The ends of a range may have units
        return {
            k: v if isinstance(v, Mapping) else _values(v, f"{where} {one_line(k, 60)}", key)
            for k, v in item.items()
        }
    if _is(item, "xarray", "DataArray"):
        if node is not None:
            from sweeps.scene.design_files.design_columns import check_units

            check_units(key, node, item.attrs.get("units"), where.removesuffix(f" {key}"))
        item = item.data if hasattr(item.data, "magnitude") else item.values
    if _is(item, "pandas", "Series") and item.dtype.kind == "O":
        item = item.tolist()
    if isinstance(item, list | tuple) and any(map(_has_unit, set(map(type, item)))):
        return [
            _values(one, f"{where}, value {i}", key) if _has_unit(one) else one
            for i, one in enumerate(item, start=1)
        ]
    if _has_unit(item):
        if node is None:
            return item
        return magnitude(item, where, node.unit)
    if isinstance(item, range):
        return list(item)
    if _is(item, "pandas", "DataFrame") or _is(item, "xarray", "Dataset"):
        raise SceneError(f"{where}: a table of several columns; must be one column")
    if _is(item, "pandas", "Series", "Index"):
        item = item.to_numpy()
    if isinstance(item, np.ndarray):
        if item.dtype.kind in "mM":
            raise SceneError(f"{where}: holds {item.dtype}; must be numbers")
        if item.ndim > 1:
            size = " x ".join(map(str, item.shape))
            raise SceneError(f"{where}: has {size} values; must have one dimension")
    return item


def _has_unit(value: Any) -> bool:
    """Whether a value, or one of the values of a class, is a quantity of pint."""
    return hasattr(value, "magnitude") and hasattr(value, "to")


def _designs(given: Any, where: str) -> Any:
    """Columns of [designs], in the order of the table."""
    if _is(given, "xarray", "DataArray"):
        if given.ndim == 2:
            # One dimension has the names of the columns as words.
            words = [d for d in given.dims if d in given.coords and given[d].dtype.kind in "UOT"]
            if len(words) != 1:
                raise SceneError(
                    f"{where}: a DataArray of two dimensions; one dimension must have the names "
                    "of parameters"
                )
            given = given.to_dataset(dim=words[0])
        elif given.name is None:
            raise SceneError(f"{where}: a DataArray without a name; its name must be a parameter")
        else:
            given = given.to_dataset()
    if _is(given, "xarray", "Dataset"):
        if len(given.dims) != 1:
            raise SceneError(
                f"{where}: a Dataset over {', '.join(map(str, given.dims)) or 'no dimension'}; "
                "must have one dimension, the designs"
            )
        wanted = (*PARAMETERS, *LABELS)
        beside = [n for n in given.coords if n in wanted and given[n].dims == tuple(given.dims)]
        return {str(n): given[n] for n in (*beside, *given.data_vars)}
    if _is(given, "pandas", "Series"):
        given = given.to_frame()
    if isinstance(given, list) and given and all(isinstance(row, Mapping) for row in given):
        import pandas as pd

        given = pd.DataFrame(given)
    if not _is(given, "pandas", "DataFrame"):
        return given
    known = [n for n in given.index.names if n in PARAMETERS or n in LABELS]
    if known:
        given = given.reset_index(known)
    elif (
        len(given.index) and all(isinstance(item, str) for item in given.index)
        and LABELS[0] not in given and DESIGN not in given.index.names
    ):  # fmt: skip
        given = given.set_axis(given.index.rename(LABELS[0])).reset_index()
    for column in given.columns:
        if not isinstance(column, str):
            raise SceneError(
                f"{where}: column {shown(column)}: must be the name of a parameter, such as inertia"
            )
    twice = given.columns[given.columns.duplicated()]
    if len(twice):
        raise SceneError(f"{where} {one_line(twice[0], 60)}: two columns of this name")
    return {column: given[column] for column in given.columns}


def _text(given: Any, where: str, tables: Mapping[str, Any]) -> str | None:
    """Text of the CSV file of a table, or of a pressure that was read; None for other objects."""
    if _is_table(given):
        return _csv(given, where)
    if isinstance(given, _RecordedPressure):
        asked = (tables.get(table) for table in ("axes", "designs"))
        cycles = any("recorded_cycle" in one for one in asked if isinstance(one, Mapping))
        return given.text(cycles=cycles)
    return None


def _csv(given: Any, where: str) -> str:
    """Table of a recording as the text of a CSV file: heads with units, all digits of numbers."""
    pressure = "pressure [bar]"
    units: dict[str, str] = {}
    if _is(given, "xarray", "DataArray"):
        given = given.to_dataset(name=given.name or pressure)
    if _is(given, "xarray", "Dataset"):
        if len(given.dims) > 1:
            raise SceneError(
                f"{where}: over {', '.join(map(str, given.dims))}; must be over the angle alone"
            )
        told = {
            str(name): variable.attrs.get("units") for name, variable in given.variables.items()
        }
        units = {name: str(unit) for name, unit in told.items() if unit not in (None, "1")}
        without = not set(given.dims) <= set(given.coords)
        given = given.to_dataframe().reset_index(drop=True) if without else given.to_dataframe()
    elif _is(given, "pandas", "Series"):
        given = given.to_frame(pressure if given.name is None else given.name)
    # An index that merely counts rows is no angle.
    if given.index.name is not None or not _is(given.index, "pandas", "RangeIndex"):
        angle = "crank_angle [degree]" if given.index.name is None else given.index.name
        given = given.set_axis(given.index.rename(angle)).reset_index()
    if not given.size:
        raise SceneError(f"{where}: is empty; must have the pressure over the crank angle")
    heads = []
    for column in given.columns:
        if given[column].dtype.kind not in "iuf":
            raise SceneError(f"{where} column {shown(column)}: must be numbers")
        unit = units.get(str(column))
        head = f"{column} [{unit}]" if unit else str(column)
        heads.append(one_line(head, 200).replace(",", " ").replace('"', " "))
    return str(given.to_csv(index=False, header=heads, lineterminator="\n"))
