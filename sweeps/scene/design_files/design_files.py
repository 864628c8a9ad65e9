"""Tables of designs from files: the format is inferred from the file extension.

A format is one module with a function that reads a file into `DesignColumns`, and one row of the
table `_READERS`. Columns are in the units of scenes; a file that states its units must state those.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from engine_dyn.types import Floats
from sweeps.base.errors import SceneError
from sweeps.scene.design_files.design_columns import DesignColumns
from sweeps.scene.design_files.design_csv import read_design_csv
from sweeps.scene.design_files.design_netcdf import read_design_netcdf
from sweeps.scene.design_files.design_parquet import read_design_parquet
from sweeps.scene.design_files.design_xlsx import read_design_xlsx

__all__ = ["SUFFIXES", "read_designs"]

_READERS: dict[str, Callable[[Path, str], DesignColumns]] = {
    ".csv": read_design_csv,
    ".txt": read_design_csv,
    ".nc": read_design_netcdf,
    ".nc4": read_design_netcdf,
    ".parquet": read_design_parquet,
    ".xlsx": read_design_xlsx,
}

SUFFIXES = tuple(_READERS)


def read_designs(path: Path, name: str) -> tuple[dict[str, Floats], dict[str, tuple[str, ...]]]:
    """Read the table of [designs] file.

    Parameters
    ----------
    path : Path
        A file that ends with one of `SUFFIXES`.
    name : str
        The file as messages should call it.

    Returns
    -------
    columns, labels : dict
        Numbers of parameters in the units of files, within their physical range, and texts.

    Raises
    ------
    SceneError
        In one line: an unknown extension; a file that is missing or not of its kind; columns that
        are unknown, not numeric, of other units or along more than one dimension; missing values
        and values outside their range, with line or row.
    """
    read = _READERS.get(path.suffix.lower())
    if read is None:
        raise SceneError(f"{name}: must end with one of {', '.join(SUFFIXES)}")
    return read(path, name).whole()
