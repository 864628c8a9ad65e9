"""Reading what a laboratory recorded, by the format that is given or the ending of the file's name.

A format is one module with a function that reads columns, a word of `reading_choices.Format`, and a
row of the table here.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from sweeps.base.columns import (
    fixed_width,
    matlab_files,
    mdf_files,
    netcdf_tables,
    parquet_tables,
    spreadsheets,
    tdms_files,
    text_tables,
    uff_files,
    wav_files,
)
from sweeps.base.columns.reading_choices import Format, ReadingChoices
from sweeps.base.columns.recorded_columns import Column, Contents, Recording, recording_of
from sweeps.base.columns.recordings_apart import read_apart
from sweeps.base.errors import SceneError, shown
from sweeps.base.files.referred_files import file_bytes
from sweeps.base.files.regular_files import reading

__all__ = ["KINDS", "SUFFIXES", "Column", "Recording", "read_recording"]

Reader = Callable[[Path, bytes, str, ReadingChoices], Contents]

MOST_BYTES = 1 << 30
"""Bytes of a recording."""


class _Kind(NamedTuple):
    """What reads columns and the line of the first sample, endings of files, choices that count.

    A reader that hands a file to a library runs `apart`, in a process with limits.
    """

    read: Reader
    suffixes: tuple[str, ...] = ()
    choices: tuple[str, ...] = ()
    apart: bool = False


KINDS: Mapping[Format, _Kind] = {
    "text": _Kind(
        text_tables.read,
        (".csv", ".txt", ".asc", ".dat", ".tsv", ".lvm", ".msl"),
        ("separator", "decimal", "encoding"),
    ),
    "fixed_width": _Kind(fixed_width.read, (), ("decimal", "encoding")),
    "xlsx": _Kind(spreadsheets.read, (".xlsx", ".xlsm"), ("sheet",)),
    "mat": _Kind(matlab_files.read, (".mat",), apart=True),
    "tdms": _Kind(tdms_files.read, (".tdms",), ("group",), apart=True),
    "mf4": _Kind(mdf_files.read, (".mf4", ".mdf"), ("group",), apart=True),
    "netcdf": _Kind(netcdf_tables.read, (".nc", ".nc4")),
    "parquet": _Kind(parquet_tables.read, (".parquet",), apart=True),
    "wav": _Kind(wav_files.read, (".wav",), apart=True),
    "uff": _Kind(uff_files.read, (".uff", ".unv"), apart=True),
}

SUFFIXES: Mapping[str, Format] = {
    suffix: format for format, kind in KINDS.items() for suffix in kind.suffixes
}
"""Formats by the endings of files that tell them."""


def read_recording(
    path: Path, label: str | None = None, choices: ReadingChoices | None = None
) -> Recording:
    """Read the columns of a laboratory's file.

    Parameters
    ----------
    path : Path
        A file that ends with one of `SUFFIXES`, a text of any ending, or one of the format that
        is chosen.
    label : str, optional
        The file as messages should call it; its path if not given.
    choices : ReadingChoices, optional
        Format, separator, decimal mark, sheet or group, where they are not to be guessed.

    Raises
    ------
    SceneError
        In one line: a file that is missing, of another kind or version, damaged, protected by a
        password or too large; a library that is not installed.
    """
    name = str(path) if label is None else label
    chosen = choices or ReadingChoices()
    suffix = Path(path).suffix.lower()
    with reading(name, "a recording of a laboratory"):
        data = file_bytes(Path(path), MOST_BYTES)
    if not data:
        raise SceneError(f"{name}: empty; expected a recording of a laboratory")
    text = text_tables.is_text(data)
    format = chosen.format or SUFFIXES.get(suffix) or ("text" if text else None)
    if format is None:
        old = " (save it as .xlsx)" if suffix == ".xls" else ""
        raise SceneError(
            f"{name}: is no text, and must end with one of {', '.join(SUFFIXES)}{old}, or have its "
            f"format given: {', '.join(KINDS)}"
        )
    try:
        if KINDS[format].apart:
            contents = read_apart(format, data, name, chosen)
        else:
            contents = KINDS[format].read(Path(path), data, name, chosen)
    except SceneError as error:
        if chosen.format is not None or text == (format in ("text", "uff")):
            raise
        others = "format = 'text'" if text else f"its format: {', '.join(KINDS)}"
        raise SceneError(f"{error}; if the ending of its name is wrong, give {others}") from None
    remarks = tuple(
        f"{key} = {shown(getattr(chosen, key))}: does nothing, the file is read as {format}"
        for key in ReadingChoices.model_fields
        if getattr(chosen, key) is not None and key not in ("format", *KINDS[format].choices)
    )
    sha256 = hashlib.sha256(data).hexdigest()
    return replace(recording_of(name, sha256, contents), remarks=remarks)
