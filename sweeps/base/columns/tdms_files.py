"""Recordings in .tdms files (LabVIEW), read by npTDMS."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from sweeps.base.columns.reading_choices import ReadingChoices
from sweeps.base.columns.recorded_columns import Column, Contents, check_size
from sweeps.base.errors import SceneError, not_known, one_line
from sweeps.base.files.libraries import library, library_reading

__all__ = ["read"]


def read(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a .tdms file: the channels of its one group, or of the group that is wanted.

    A channel with a sampling interval (`wf_increment`) and no channel of time beside it brings the
    column "time" [s].

    Raises
    ------
    SceneError
        In one line.
    """
    del path
    nptdms = library("nptdms", "npTDMS", label)
    with library_reading(label, "a .tdms file"), nptdms.TdmsFile.open(io.BytesIO(data)) as file:
        groups = {group.name: group for group in file.groups() if len(group.channels())}
        if choices.group is not None and choices.group not in groups:
            raise SceneError(
                f"{label}: group '{choices.group}': not found{not_known(choices.group, groups)}"
            )
        chosen = groups if choices.group is None else {choices.group: groups[choices.group]}
        channels = [(g, c) for g, group in chosen.items() for c in group.channels()]
        claimed = float(sum(len(channel) for _, channel in channels))
        check_size(claimed, len(channels), label)
        if claimed > 8.0 * len(data):  # a value has a bit at least
            raise SceneError(f"{label}: damaged: claims {claimed:.3g} values")
        columns = []
        for group_name, channel in channels:
            kind = channel.dtype
            if kind is None or kind.kind not in "iuf" or not len(channel):
                continue
            name = channel.name if len(chosen) == 1 else f"{group_name}/{channel.name}"
            unit = channel.properties.get("unit_string", channel.properties.get("Unit", ""))
            values = np.asarray(channel[:], dtype=np.float64)
            columns.append(Column(one_line(name, 200), one_line(unit, 60), values))
        columns += _time(channels, columns)
    return Contents(columns)


def _time(channels: list[tuple[str, Any]], columns: list[Column]) -> list[Column]:
    """Times of samples, where the file states an interval and no channel of times."""
    if any(column.name.lower() in ("time", "zeit", "t") for column in columns):
        return []
    for _, channel in channels:
        step = channel.properties.get("wf_increment")
        if isinstance(step, float) and step > 0.0 and len(channel):
            start = float(channel.properties.get("wf_start_offset", 0.0))
            times = np.arange(len(channel), dtype=np.float64)
            return [Column("time", "s", np.asarray(start + step * times))]
    return []
