"""Recordings in Parquet files, read by pyarrow."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from sweeps.base.columns.headers import split_unit
from sweeps.base.columns.reading_choices import ReadingChoices
from sweeps.base.columns.recorded_columns import Column, Contents, check_size
from sweeps.base.errors import one_line
from sweeps.base.files.libraries import library, library_reading

__all__ = ["read"]


def read(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a Parquet file; units stand in the metadata of a field, or in its name.

    Raises
    ------
    SceneError
        In one line.
    """
    del path, choices
    pa = library("pyarrow", "pyarrow", label)
    pq = library("pyarrow.parquet", "pyarrow", label)
    with library_reading(label, "a Parquet file"), pq.ParquetFile(io.BytesIO(data)) as file:
        fields = [
            field
            for field in file.schema_arrow
            if pa.types.is_integer(field.type) or pa.types.is_floating(field.type)
        ]
        check_size(float(file.metadata.num_rows) * len(fields), len(fields), label)
        columns = []
        for field in fields:
            column = file.read(columns=[field.name]).column(0)
            values = column.to_numpy().astype(np.float64)
            stated = (field.metadata or {}).get(b"units", b"").decode("utf-8", "replace")
            name, unit = split_unit(field.name)
            columns.append(Column(one_line(name, 200), one_line(stated or unit, 60), values))
    return Contents(columns)
