"""Archives for programs that read no netCDF: CSV, Parquet and Excel; curves as UFF and FMU.

A table has a row for each design, or for each design and crank angle; it is written a range of
rows at a time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sweeps.base.checks import a_path, check_dataset
from sweeps.base.errors import SceneError, one_line
from sweeps.base.files.libraries import library
from sweeps.decide.explore.attributes import of_designs
from sweeps.decide.explore.columns import (
    check_one_table,
    chosen_quantities,
    columns_of,
    dims_of,
    in_words,
    words_for_numbers,
)
from sweeps.decide.explore.excel import LONGEST, check_rows, not_computed, unit_of, workbook
from sweeps.decide.explore.fmu import functional_mockup_unit
from sweeps.decide.explore.order_table import COLUMNS, CONVENTION, order_table
from sweeps.decide.explore.universal_files import universal_file
from sweeps.running.archive import netcdf as archives
from sweeps.running.reduce.ranges import ranges

if TYPE_CHECKING:
    import xarray as xr

ROWS = 1 << 18  # Rows that are written at a time, about


@dataclass(frozen=True)
class Exported:
    """The choice of results for an exported table.

    Attributes
    ----------
    rows : int
        Number of rows, the header not counted; of curves, of points.
    columns : tuple of str
        Axes first, then columns of designs, then quantities.
    left_out : tuple of str
        Quantities that are not in it: curves, unless they were asked for; in a .uff file, those of
        designs without values.
    """

    rows: int
    columns: tuple[str, ...]
    left_out: tuple[str, ...]


def export(
    archive: xr.Dataset, path: str | Path, *, quantities: str | Sequence[str] | None = None,
    orders: str | None = None, overwrite: bool = False, head_units: bool = False,
) -> Exported:  # fmt: skip
    """Write an archive as a table, or its curves for other programs.

    Axes come first and the last varies fastest, then columns of designs, then quantities, all in
    the units of the archive; words and outcomes are texts. A missing number is an empty
    field of a CSV file or a sheet and NaN in Parquet, where each column also has its unit (metadata
    `units`). An Excel file has units in its second row, and sheets of axes, assumptions and
    provenance.
    A universal file (.uff) has a data set 58 for each curve of each design, an FMU (.fmu) the
    curves of one design as outputs over the crank angle; see docs/archives.md.
    The file is complete or does not exist.

    Parameters
    ----------
    archive : Dataset
        As `sweeps.open` or `sweeps.run` returns it; it may be larger than memory.
    path : str or Path
        The file; its extension, .csv, .parquet, .xlsx, .uff or .fmu, says which format.
    quantities : str or sequence of str, optional
        Those to write; if not given, all that have one number for each design. With a curve, such
        as omega over crank_angle, there is a row for each of its points. In .uff and .fmu, curves
        alone; if not given, all over the crank angle.
    orders : str, optional
        In place of quantities: what to write the orders of, such as "torque", of which the archive
        has `torque_order` and `torque_phase`, beside `order_frequency`. There is a row for each
        order, with frequency, amplitude, phase, real and imaginary part; a CSV file begins with
        lines (#) that state the convention of the phase. A .uff file has them as complex values.
    overwrite : bool
        Replace an older file.
    head_units : bool
        Write units into the heads of a CSV file: ``omega_max [rad s-1]``.

    Raises
    ------
    SceneError
        For another extension, quantities or orders that the archive does not have or that do not
        fit into one table or no curves, several designs in an FMU, or a file that exists; for a
        format whose library is not installed, and more rows than a sheet has.
    OSError
        Where the table cannot be written.

    Examples
    --------
    >>> import sweeps
    >>> archive = sweeps.run(
    ...     engine="ntua",
    ...     axes={"inertia": [5, 20, 40], "speed": [1200, 1500]},
    ...     output={"quantities": ["delta", "torque_mean"]},
    ... )
    >>> sweeps.export(archive, "table.csv", quantities="delta").rows
    6
    >>> with open("table.csv") as file:
    ...     print(file.readline().strip())
    inertia,speed,delta
    """
    path = a_path(path, "path")
    check_dataset(archive)
    opener = check_format(path)
    if path.exists() and not overwrite:
        raise SceneError(f"{path}: exists and is not overwritten")
    if head_units and path.suffix.lower() != ".csv":
        raise SceneError(f"{path}: has units of its own; head_units is for .csv")
    if orders is not None and quantities is not None:
        raise SceneError("quantities: not allowed together with orders")
    if path.suffix.lower() in CURVES:
        with archives.replaced(path) as partial:
            return Exported(*opener(partial, archive, quantities, orders))
    if orders is not None:
        archive, quantities = order_table(archive, orders), COLUMNS
    names = chosen_quantities(archive, quantities)
    check_one_table(archive, names)
    dims = dims_of(archive, names)
    shape = [archive.sizes[d] for d in dims]
    columns = columns_of(archive, dims, names)
    left_out = [] if quantities else [n for n in of_designs(archive) if n not in names]
    if path.suffix.lower() == ".xlsx":
        check_rows(math.prod(shape), path)
    written = {_head(n, v) if head_units else n: v for n, v in columns.items()}
    words = words_for_numbers(written)
    rows = 0
    with archives.replaced(path) as partial, opener(partial, written, archive) as put:
        for _, extent, arrays in ranges(written, dims, shape, 8.0 * ROWS, in_order=True):
            table = {n: np.broadcast_to(a, extent).reshape(-1) for n, a in arrays.items()}
            for name, meant in words.items():
                table[name] = in_words(table[name], meant)
            put(table)
            rows += len(next(iter(table.values())))
    return Exported(rows, tuple(columns), tuple(left_out))


def _head(name: str, variable: xr.Variable) -> str:
    unit = unit_of(variable)
    return f"{name} [{unit}]" if unit else name


def check_format(path: Path) -> Callable[..., Any]:
    """Return the function that writes files with this extension.

    Raises
    ------
    SceneError
        For an unknown extension, and for a format whose library is not installed.
    """
    kind = path.suffix.lower()
    known = {**FORMATS, **CURVES}
    if kind not in known:
        raise SceneError(f"{path}: must end in {' or '.join(known)}")
    if kind in _NEEDS:
        module, package, extra = _NEEDS[kind]
        library(module, package, str(path), extra)
    return known[kind]


# --- formats --------------------------------------------------------------------------------------

Put = Callable[[Mapping[str, Any]], None]


@contextmanager
def _csv(path: Path, columns: Mapping[str, xr.Variable], archive: xr.Dataset) -> Iterator[Put]:
    import pandas as pd

    with path.open("w", encoding="utf-8", newline="") as stream:
        stream.writelines(f"# {line}\n" for line in archive.attrs.get(CONVENTION, "").splitlines())
        heads = [not_computed(one_line(name)) for name in columns]
        pd.DataFrame(columns=heads).to_csv(stream, index=False, lineterminator="\n")

        def put(table: Mapping[str, Any]) -> None:
            texts = {name: _not_computed(values) for name, values in table.items()}
            pd.DataFrame(texts).to_csv(stream, index=False, header=False, lineterminator="\n")

        yield put


def _not_computed(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Names of designs, of which no spreadsheet takes any for a formula; numbers as they are."""
    if values.dtype.kind not in "UOT":
        return values
    names, places = np.unique(values.astype(str), return_inverse=True)
    safe = [not_computed(one_line(name, LONGEST)) for name in names.tolist()]
    return np.array(safe, dtype=object)[places.reshape(values.shape)]


@contextmanager
def _parquet(path: Path, columns: Mapping[str, xr.Variable], archive: xr.Dataset) -> Iterator[Put]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    words = words_for_numbers(columns)

    def field(name: str, variable: xr.Variable) -> Any:
        is_text = name in words or variable.dtype.kind in "UOT"
        kind = pa.string() if is_text else pa.from_numpy_dtype(variable.dtype)
        about = {
            key: str(variable.attrs[key]) for key in ("units", "long_name") if key in variable.attrs
        }
        return pa.field(name, kind, metadata=about)

    schema = pa.schema([field(name, variable) for name, variable in columns.items()])
    with pq.ParquetWriter(path, schema) as writer:

        def put(table: Mapping[str, Any]) -> None:
            arrays = [pa.array(table[f.name], f.type, from_pandas=False) for f in schema]
            writer.write_table(pa.table(arrays, schema=schema))

        yield put


FORMATS: Mapping[str, Callable[..., Any]] = {
    ".csv": _csv,
    ".parquet": _parquet,
    ".xlsx": workbook,
}
"""The function that writes each format, by the extension of its files."""

CURVES: Mapping[str, Callable[..., Any]] = {
    ".uff": universal_file,
    ".fmu": functional_mockup_unit,
}
"""The same for files of curves, which are no tables."""

_NEEDS = {
    ".parquet": ("pyarrow.parquet", "pyarrow", "parquet"),
    ".xlsx": ("openpyxl", "openpyxl", "excel"),
    ".uff": ("pyuff", "pyuff", "exchange"),
    ".fmu": ("pythonfmu", "pythonfmu", "exchange"),
}
"""Module, package and extra of ours that a format needs."""
