"""Recordings whose formats other libraries read, read in a process of its own, within limits."""

from __future__ import annotations

import json

import numpy as np

from sweeps.base.columns.reading_choices import Format, ReadingChoices
from sweeps.base.columns.recorded_columns import Column, Contents
from sweeps.base.files.child_process import Limits, answer_apart

__all__ = ["read_apart"]

CHILD = "sweeps.base.columns.recording_child"
"""The module that reads them there."""

SECONDS, RATE = 30.0, 5e6
"""Time that reading may take on a busy machine, and bytes a second beside it."""

MEMORY, MEMORY_RATE, MOST_MEMORY = 3 << 28, 40, 6 << 30
"""Bytes of memory that it may take, beside so many for each byte of the file, and at most; the
libraries need a third of it."""


def read_apart(format: Format, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a recording, as the reader of its format finds them in another process.

    Raises
    ------
    SceneError
        In one line.
    """
    memory = min(MEMORY + MEMORY_RATE * len(data), MOST_MEMORY)
    limits = Limits(memory, SECONDS + len(data) / RATE)
    asked = json.dumps(
        [format, label, choices.model_dump(include=set(ReadingChoices.model_fields))]
    )
    answer = answer_apart(CHILD, asked, data, limits, label, f"a .{format} file")
    place = answer.index(b"\n") + 1
    columns = []
    for name, unit, shape, text in json.loads(answer[:place]):
        count = int(np.prod(shape))
        numbers = np.frombuffer(answer, np.float64, count, place).reshape(shape).copy()
        columns.append(Column(name, unit, numbers, text and (text[0], text[1])))
        place += numbers.nbytes
    return Contents(columns)
