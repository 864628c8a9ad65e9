"""Reading what a laboratory recorded: the reader is picked by the ending of the file's name."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

from sweeps.errors import SceneError
from sweeps.reading.laboratory import (
    matlab_files,
    mdf_files,
    netcdf_tables,
    parquet_tables,
    spreadsheets,
    tdms_files,
    text_tables,
)
from sweeps.reading.laboratory.reading_choices import ReadingChoices
from sweeps.reading.laboratory.recorded_columns import Column, Recording, recording_of
from sweeps.reading.referred_files import file_bytes
from sweeps.reading.regular_files import reading

__all__ = ["SUFFIXES", "Column", "Recording", "read_recording"]

Reader = Callable[[Path, bytes, str, ReadingChoices], tuple[list[Column], int | None]]

MOST_BYTES = 1 << 30
"""Bytes of a recording."""

_READERS: dict[str, Reader] = {
    **dict.fromkeys((".csv", ".txt", ".asc", ".dat", ".tsv"), text_tables.read),
    **dict.fromkeys((".xlsx", ".xlsm"), spreadsheets.read),
    ".mat": matlab_files.read,
    ".tdms": tdms_files.read,
    **dict.fromkeys((".mf4", ".mdf"), mdf_files.read),
    **dict.fromkeys((".nc", ".nc4"), netcdf_tables.read),
    ".parquet": parquet_tables.read,
}
"""By the ending of a file's name: what reads its columns and the line of the first sample."""

SUFFIXES = tuple(_READERS)


def read_recording(
    path: Path, label: str | None = None, choices: ReadingChoices | None = None
) -> Recording:
    """Read the columns of a laboratory's file.

    Parameters
    ----------
    path : Path
        A file that ends with one of `SUFFIXES`.
    label : str, optional
        The file as messages should call it; its path if not given.
    choices : ReadingChoices, optional
        Separator, decimal mark, sheet or group, where they are not to be guessed.

    Raises
    ------
    SceneError
        In one line: a file that is missing, of another kind or version, damaged, protected by a
        password or too large; a library that is not installed.
    """
    name = str(path) if label is None else label
    read = _READERS.get(Path(path).suffix.lower())
    if read is None:
        old = " (save it as .xlsx)" if Path(path).suffix.lower() == ".xls" else ""
        raise SceneError(f"{name}: must end with one of {', '.join(SUFFIXES)}{old}")
    with reading(name, "a recording of a laboratory"):
        data = file_bytes(Path(path), MOST_BYTES)
    if not data:
        raise SceneError(f"{name}: empty; expected a recording of a laboratory")
    columns, first_line = read(Path(path), data, name, choices or ReadingChoices())
    return recording_of(name, hashlib.sha256(data).hexdigest(), columns, first_line)
