"""Reading what a laboratory recorded, by the format that is given or the ending of the file's name.

A format is a function that reads columns (`formats`, `text_tables`), a word of `options.Format`,
and a row of the table here. Formats that other libraries read are read in a process of its own,
within limits: this module, run as a program.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sweeps.base.columns.formats import (
    read_mat,
    read_mdf,
    read_netcdf,
    read_parquet,
    read_tdms,
    read_uff,
    read_wav,
    read_xlsx,
)
from sweeps.base.columns.options import Format, ReadingChoices
from sweeps.base.columns.recorded_columns import Column, Contents, Recording, recording_of
from sweeps.base.columns.text_tables import is_text, read_fixed_width, read_text
from sweeps.base.errors import SceneError, shown
from sweeps.base.files.child_process import Limits, answer_apart, answering
from sweeps.base.files.regular_files import file_bytes, reading

__all__ = ["KINDS", "SUFFIXES", "Column", "Recording", "read_apart", "read_recording"]


class _Kind(NamedTuple):
    """A format: its reader, the endings of its files, and the choices that count."""

    # A reader that uses another library runs `apart`, in a process with limits.

    read: Callable[[Path, bytes, str, ReadingChoices], Contents]
    suffixes: tuple[str, ...] = ()
    choices: tuple[str, ...] = ()
    apart: bool = False


KINDS: Mapping[Format, _Kind] = {
    "text": _Kind(
        read_text,
        (".csv", ".txt", ".asc", ".dat", ".tsv", ".lvm", ".msl"),
        ("separator", "decimal", "encoding"),
    ),
    "fixed_width": _Kind(read_fixed_width, (), ("decimal", "encoding")),
    "xlsx": _Kind(read_xlsx, (".xlsx", ".xlsm"), ("sheet",)),
    "mat": _Kind(read_mat, (".mat",), apart=True),
    "tdms": _Kind(read_tdms, (".tdms",), ("group",), apart=True),
    "mf4": _Kind(read_mdf, (".mf4", ".mdf"), ("group",), apart=True),
    "netcdf": _Kind(read_netcdf, (".nc", ".nc4")),
    "parquet": _Kind(read_parquet, (".parquet",), apart=True),
    "wav": _Kind(read_wav, (".wav",), apart=True),
    "uff": _Kind(read_uff, (".uff", ".unv"), apart=True),
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
        data = file_bytes(Path(path))
    if not data:
        raise SceneError(f"{name}: empty; expected a recording of a laboratory")
    text = is_text(data)
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


SECONDS, RATE = 30.0, 5e6
"""Seconds that reading may take on a busy machine, besides one for each so many bytes."""

CHILD = __name__  # Module that is started as the process that reads

MEMORY, MEMORY_RATE, MOST_MEMORY = 3 << 28, 40, 6 << 30
"""Bytes of memory that the reading process may take (its libraries need a third of them), how many
more for each byte of the file, and the most."""


def read_apart(format: Format, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a recording, as the reader of its format finds them in another process."""
    memory = min(MEMORY + MEMORY_RATE * len(data), MOST_MEMORY)
    limits = Limits(memory, SECONDS + len(data) / RATE)
    asked = json.dumps(
        [format, label, choices.model_dump(include=set(ReadingChoices.model_fields))]
    )
    answer = answer_apart(CHILD, asked, data, limits, label, f"a .{format} file")
    place = answer.index(b"\n") + 1
    listed, *notes = json.loads(answer[:place])
    columns = []
    for name, unit, shape, text in listed:
        count = int(np.prod(shape))
        numbers = np.frombuffer(answer, np.float64, count, place).reshape(shape).copy()
        columns.append(Column(name, unit, numbers, text and (text[0], text[1])))
        place += numbers.nbytes
    first_line, said, marks = notes
    return Contents(columns, first_line, tuple(said), tuple(marks))


def _answer() -> list[bytes]:
    """Names, units, shapes and first texts of columns, and notes, in a line; then the values."""
    format, label, chosen = json.loads(sys.argv[1])
    data = sys.stdin.buffer.read()
    contents = KINDS[format].read(Path(label), data, label, ReadingChoices(**chosen))
    columns, *notes = contents
    listed = [(c.name, c.unit, c.values.shape, c.text) for c in columns]
    head = json.dumps([listed, *notes]) + "\n"
    return [head.encode(), *(np.asarray(c.values, np.float64).tobytes() for c in columns)]


if __name__ == "__main__":
    answering(_answer)
