"""Recordings in .mf4 and .mdf files (ASAM MDF), read by asammdf; no formula of a file is run."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.base.columns.reading_choices import ReadingChoices
from sweeps.base.columns.recorded_columns import Column, Contents, check_size
from sweeps.base.errors import SceneError, not_known, one_line, shown
from sweeps.base.files.libraries import library, library_reading

__all__ = ["read"]

_NONE = {4: (0,), 3: (65535,)}
_LINEAR = {4: (1,), 3: (0,)}


def read(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of an MDF file: the channels of its largest group, or of the one that is wanted.

    The channel of times is a column. Linear conversions are applied; a channel with a formula or a
    table is left out.

    Raises
    ------
    SceneError
        In one line.
    """
    del path
    asammdf = library("asammdf", "asammdf", label)
    with library_reading(label, "an MDF file"):
        file = asammdf.MDF(io.BytesIO(data))
        try:
            number = _group(file, choices.group, label)
            group = file.groups[number]
            cycles = int(group.channel_group.cycles_nr)
            check_size(float(cycles) * len(group.channels), len(group.channels), label)
            if cycles > 1040 * len(data):
                raise SceneError(f"{label}: damaged: claims {cycles:.3g} samples")
            columns = []
            for index in range(len(group.channels)):
                signal = file.get(group=number, index=index, raw=True)
                values = _values(signal, int(str(file.version)[0]))
                if values is not None:
                    name, unit = one_line(signal.name, 200), one_line(signal.unit or "", 60)
                    columns.append(Column(name, unit, values))
        finally:
            file.close()
    return Contents(columns)


def _group(file: Any, wanted: str | None, label: str) -> int:
    """Number of the group that is wanted; of the one with the most samples if none is."""
    if not file.groups:
        raise SceneError(f"{label}: has no channels")
    names = [str(getattr(g.channel_group, "acq_name", "") or "") for g in file.groups]
    if wanted is not None:
        if wanted in names:
            return names.index(wanted)
        if re.fullmatch(r"[0-9]{1,9}", wanted) and int(wanted) < len(names):
            return int(wanted)
        raise SceneError(f"{label}: group {shown(wanted)}: not found{not_known(wanted, names)}")
    sizes = [int(group.channel_group.cycles_nr) for group in file.groups]
    return sizes.index(max(sizes))


def _values(signal: Any, version: int) -> Floats | None:
    """Values of a channel; None where they are no numbers, or follow from them by a formula."""
    raw = signal.samples
    if raw.dtype.kind not in "iuf" or raw.ndim != 1:
        return None
    values = np.asarray(raw, dtype=np.float64)
    conversion = signal.conversion
    key = 4 if version >= 4 else 3
    if conversion is None or conversion.conversion_type in _NONE[key]:
        return values
    if conversion.conversion_type in _LINEAR[key]:
        return np.asarray(float(conversion.a) * values + float(conversion.b))
    return None
