"""The child process that reads recordings: see `sweeps.base.columns.recordings_apart`."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

from sweeps.base.columns.reading_choices import ReadingChoices
from sweeps.base.columns.recording import KINDS
from sweeps.base.files.child_process import answering


def _answer() -> list[bytes]:
    """Names, units, shapes and first texts of the columns in a line, then their values."""
    format, label, chosen = json.loads(sys.argv[1])
    data = sys.stdin.buffer.read()
    columns = KINDS[format].read(Path(label), data, label, ReadingChoices(**chosen)).columns
    listed = [(c.name, c.unit, c.values.shape, c.text) for c in columns]
    head = json.dumps(listed) + "\n"
    return [head.encode(), *(np.asarray(c.values, np.float64).tobytes() for c in columns)]


if __name__ == "__main__":
    answering(_answer)
