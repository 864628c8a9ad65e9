"""Recordings in .mat files (versions 4 to 7), read by scipy; arrays of numbers alone."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from sweeps.base.columns.reading_choices import ReadingChoices
from sweeps.base.columns.recorded_columns import Column, Contents, check_size
from sweeps.base.errors import SceneError, one_line, size_text
from sweeps.base.files.libraries import library, library_reading

__all__ = ["read"]

MOST_INFLATED = 1 << 31
"""Bytes of all variables, which are compressed in the file."""

_COMPRESSED = 15  # miCOMPRESSED of the MAT-file format, version 5
_DEEPEST = 3


def read(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a .mat file: vectors, and matrices (cycles by samples or samples by cycles).

    Fields of structures are named "structure.field".

    Raises
    ------
    SceneError
        In one line.
    """
    del path, choices
    if data[:20].startswith(b"MATLAB 7.3") or data[512:516] == b"\x89HDF" or data[:4] == b"\x89HDF":
        raise SceneError(
            f"{label}: a .mat file of version 7.3; save it as version 7: "
            "save('file.mat', 'angle', 'pressure', '-v7')"
        )
    scipy_io = library("scipy.io", "scipy", label)
    with library_reading(label, "a .mat file of versions 4 to 7"):
        if data[:6] == b"MATLAB":
            _check_inflated(data, label)
        shapes = scipy_io.whosmat(io.BytesIO(data))
        total = sum(float(np.prod(shape, dtype=float)) for _, shape, _ in shapes)
        check_size(total, len(shapes), label)
        found = scipy_io.loadmat(io.BytesIO(data), squeeze_me=False, struct_as_record=True)
        columns = [c for name, value in found.items() if name[:2] != "__"
                   for c in _columns(name, value, 0)]  # fmt: skip
    if not columns:
        raise SceneError(f"{label}: no arrays of real numbers; must have angle and pressure")
    return Contents(columns)


def _check_inflated(data: bytes, label: str) -> None:
    """Refuse variables that inflate to more than may be read, before they are."""
    order = "<" if data[126:128] == b"IM" else ">"
    place, total = 128, 0
    while place + 8 <= len(data):
        kind, size = struct.unpack_from(f"{order}II", data, place)
        if kind == _COMPRESSED:
            stream = zlib.decompressobj()
            rest = data[place + 8 : place + 8 + size]
            while rest and not stream.eof:
                total += len(stream.decompress(rest, 1 << 24))
                rest = stream.unconsumed_tail
                if total > MOST_INFLATED:
                    raise SceneError(f"{label}: more than {size_text(MOST_INFLATED)} when inflated")
        place += 8 + size


def _columns(name: str, value: Any, depth: int) -> Iterator[Column]:
    """Arrays of numbers in a variable, also in the fields of a structure."""
    if not isinstance(value, np.ndarray) or not value.size:
        return
    if value.dtype.names and depth < _DEEPEST and value.size == 1:
        for key in value.dtype.names:
            yield from _columns(f"{name}.{key}", value.reshape(-1)[0][key], depth + 1)
    elif value.dtype.kind in "iuf" and value.ndim == 2 and value.size > 1:
        array = np.asarray(value, dtype=np.float64)
        yield Column(one_line(name, 200), "", array.reshape(-1) if 1 in array.shape else array)
