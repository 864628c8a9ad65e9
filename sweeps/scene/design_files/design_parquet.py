"""Tables of designs from Parquet files, which need pyarrow."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import SceneError, one_line
from sweeps.base.files.regular_files import check_rows, opened_file, reading
from sweeps.scene.design_files.design_columns import (
    ROWS,
    DesignColumns,
    check_kind,
    check_units,
    known_columns,
    take_numbers,
)

__all__ = ["read_design_parquet"]


def read_design_parquet(path: Path, name: str) -> DesignColumns:
    """Read the columns of a Parquet file."""
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise SceneError(
            f"{name}: Parquet needs pyarrow, which is not installed: pip install "
            "'engine-dyn[parquet]'"
        ) from None

    def is_text(kind: Any) -> bool:
        return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind))

    what = "a table of designs (Parquet)"
    with reading(name, what, "a Parquet file", pa.ArrowException):
        opened_file(path).close()  # its error says more than that of the library
        labels = [f.name for f in pq.read_schema(path) if is_text(f.type)]
        # Texts stay a dictionary, because runs of long texts would fill the memory.
        file = pq.ParquetFile(path, read_dictionary=labels)
    with file, reading(name, what, "a sound Parquet file", pa.ArrowException):
        schema = file.schema_arrow
        index = _index_of_pandas(schema.metadata)
        fields = [f for f in schema if not (f.name in index or f.name == DESIGN)]
        nodes = known_columns([f.name for f in fields], name, "column")
        if len(nodes) < len(fields):
            raise SceneError(f"{name}: two columns have the same name; each name once")
        columns = DesignColumns(name, nodes)
        for f in fields:
            plain: Any = np.dtype(object)
            if pa.types.is_integer(f.type) or pa.types.is_floating(f.type):
                plain = np.dtype(f.type.to_pandas_dtype())
            elif is_text(f.type.value_type if pa.types.is_dictionary(f.type) else f.type):
                plain = str
            check_kind(f.name, nodes[f.name], plain, str(f.type), name)
            units = (f.metadata or {}).get(b"units")
            check_units(f.name, nodes[f.name], units.decode() if units else None, name)
        if not nodes or not file.metadata.num_rows:
            lacks = "rows" if nodes else "columns"
            raise SceneError(f"{name}: no {lacks}; expected a table of designs (Parquet)")
        check_rows(file.metadata.num_rows, len(nodes), name)
        for key, node in nodes.items():
            begin = 0
            # Column by column, so that only one column of a group of rows is in memory.
            for batch in file.iter_batches(batch_size=ROWS, columns=[key]):
                values = batch.column(0)
                values.validate(full=True)  # places of texts, and lengths, are as the file says
                if node is None:
                    columns.take(key, _labels_of(values))
                else:
                    missing = np.asarray(values.is_null().to_numpy(zero_copy_only=False))
                    is_texts = pa.types.is_dictionary(values.type)
                    numbers = (
                        _labels_of(values) if is_texts else values.to_numpy(zero_copy_only=False)
                    )
                    take_numbers(columns, key, numbers, missing, begin)
                begin += batch.num_rows
            if begin != file.metadata.num_rows:
                raise SceneError(
                    f"{name}: column {key} has {begin} of {file.metadata.num_rows} rows; the file "
                    "is damaged"
                )
    return columns


def _labels_of(values: Any) -> list[str]:
    """Texts of a dictionary column; missing values become empty texts."""
    texts = [one_line(text or "") for text in values.dictionary.to_pylist()]
    return ["" if place is None else texts[place] for place in values.indices.to_pylist()]


def _index_of_pandas(metadata: Mapping[bytes, bytes] | None) -> set[str]:
    """Columns that are only the index of a data frame."""
    try:
        found = json.loads((metadata or {}).get(b"pandas", b"{}")).get("index_columns", [])
    except (ValueError, AttributeError, RecursionError):
        return set()
    if not isinstance(found, list):
        return set()
    return {item for item in found if isinstance(item, str) and item.startswith("__index")}
