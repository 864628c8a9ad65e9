"""Recordings in .wav files, as sound cards make them of a sensor; read by scipy."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from sweeps.base.columns.reading_choices import ReadingChoices
from sweeps.base.columns.recorded_columns import Column, Contents, check_size
from sweeps.base.errors import SceneError
from sweeps.base.files.libraries import library, library_reading

__all__ = ["read"]


def read(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a .wav file: the time, which follows from its sample rate, and its channels.

    Raises
    ------
    SceneError
        In one line.
    """
    del path, choices
    wavfile = library("scipy.io.wavfile", "scipy", label)
    with library_reading(label, "a .wav file"):
        rate, samples = wavfile.read(io.BytesIO(data))
        samples = samples.reshape(len(samples), -1)
        count, channels = samples.shape
        check_size(float(count) * (channels + 1), channels + 1, label)
        if not rate > 0:
            raise SceneError(f"{label}: sample rate {rate}; must be more than 0")
        time = np.arange(count) / rate
        columns = [Column("time", "s", time)]
        for place, values in enumerate(samples.T, start=1):
            columns.append(Column(f"channel {place}", "", values.astype(np.float64)))
    return Contents(columns)
