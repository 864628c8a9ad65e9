"""Recordings in files that other libraries read, each imported when a file of its kind is read.

.xlsx; .mat (versions 4 to 7, scipy); .mf4 and .mdf (asammdf; no formula of a file is run); netCDF;
Parquet (pyarrow); .tdms (npTDMS); .uff and .unv (data sets 58, pyuff); .wav (scipy).
"""

from __future__ import annotations

import io
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.base.columns.headers import names_and_units, split_unit, start_of_numbers
from sweeps.base.columns.options import ReadingChoices
from sweeps.base.columns.recorded_columns import Column, Contents, check_size
from sweeps.base.errors import SceneError, counted, not_known, one_line, shown
from sweeps.base.files.libraries import library, library_reading
from sweeps.base.files.sheets import sheets
from sweeps.base.netcdf.netcdf_files import opened_table


def read_xlsx(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a sheet, and its first row.

    Without `choices.sheet` that is the first one with a table of numbers, or one whose table is far
    longer.
    """
    del path
    sheet_rows = sheets(data, label, choices.sheet)
    head = 200  # Rows that are searched for names and units
    starts = {
        title: start_of_numbers(_sheet_texts(rows[:head])) for title, rows in sheet_rows.items()
    }
    tables = {title: start for title, start in starts.items() if start is not None}
    # Sheets that are named in a message
    names = ", ".join(f"'{one_line(title, 60)}'" for title in list(sheet_rows)[:20])
    if not tables:
        where = f"of the sheet {names}" if len(sheet_rows) == 1 else f"of any sheet: {names}"
        raise SceneError(f"{label}: no table of numbers in the first {head} rows {where}")
    lengths = {title: len(sheet_rows[title]) - start[0] for title, start in tables.items()}
    taken = first = next(iter(tables))
    longest = max(lengths, key=lengths.__getitem__)
    # The first table may be a summary, and a far longer one behind it the recording.
    if lengths[longest] > 10 * lengths[first]:
        taken = longest
    said = []
    if len(sheet_rows) > 1:
        said = [f"sheet '{one_line(taken, 60)}' of {names} read (sheet takes another one)"]
    first_row, width = tables[taken]
    wider = sum(len(row) > width for row in sheet_rows[taken][first_row:])
    if wider:
        said.append(f"values right of the table in {counted(wider, 'row')} left out")
    return _sheet_columns(sheet_rows[taken], tables[taken], label)._replace(said=tuple(said))


def _sheet_texts(rows: list[list[Any]]) -> list[list[str]]:
    return [["" if value is None else str(value) for value in row] for row in rows]


def _sheet_columns(rows: list[list[Any]], start: tuple[int, int], label: str) -> Contents:
    first, width = start
    body = rows[first:]
    check_size(float(len(body)) * width, width, label)
    names, units = names_and_units(_sheet_texts(rows[:first]), width)
    columns = []
    for place, (name, unit) in enumerate(zip(names, units, strict=True)):
        values = np.full(len(body), np.nan)
        text: tuple[int, str] | None = None
        for number, row in enumerate(body):
            value = row[place] if place < len(row) else None
            if isinstance(value, int | float) and not isinstance(value, bool):
                values[number] = float(value) if abs(value) < 1e300 else np.nan
            elif value is not None and text is None:
                text = (number, one_line(value, 60))
        if not np.isnan(values).all():
            columns.append(Column(name, unit, values, text))
    return Contents(columns, first + 1)


def read_mat(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a .mat file: vectors, and matrices (cycles by samples or samples by cycles).

    Fields of structures are named "structure.field".
    """
    del path, choices
    if data[:20].startswith(b"MATLAB 7.3") or data[512:516] == b"\x89HDF" or data[:4] == b"\x89HDF":
        raise SceneError(
            f"{label}: a .mat file of version 7.3; save it as version 7: "
            "save('file.mat', 'angle', 'pressure', '-v7')"
        )
    scipy_io = library("scipy.io", "scipy", label)
    with library_reading(label, "a .mat file of versions 4 to 7"):
        shapes = scipy_io.whosmat(io.BytesIO(data))
        total = sum(float(np.prod(shape, dtype=float)) for _, shape, _ in shapes)
        check_size(total, len(shapes), label)
        variables = scipy_io.loadmat(io.BytesIO(data), squeeze_me=False, struct_as_record=True)
        columns = [c for name, value in variables.items() if name[:2] != "__"
                   for c in _matlab_columns(name, value, 0)]  # fmt: skip
    if not columns:
        raise SceneError(f"{label}: no arrays of real numbers; must have angle and pressure")
    return Contents(columns)


def _matlab_columns(name: str, value: Any, depth: int) -> Iterator[Column]:
    """Arrays of numbers in a variable, also in the fields of a structure."""
    if not isinstance(value, np.ndarray) or not value.size:
        return
    if value.dtype.names and depth < 3 and value.size == 1:
        for key in value.dtype.names:
            yield from _matlab_columns(f"{name}.{key}", value.reshape(-1)[0][key], depth + 1)
    elif value.dtype.kind in "iuf" and value.ndim == 2 and value.size > 1:
        array = np.asarray(value, dtype=np.float64)
        yield Column(one_line(name, 200), "", array.reshape(-1) if 1 in array.shape else array)


def read_mdf(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of an MDF file: the channels of its largest group, or of the one that is wanted.

    The channel of times is a column. Linear conversions are applied; a channel with a formula or a
    table is left out.
    """
    del path
    asammdf = library("asammdf", "asammdf", label)
    with library_reading(label, "an MDF file"):
        file = asammdf.MDF(io.BytesIO(data))
        try:
            number = _mdf_group(file, choices.group, label)
            group = file.groups[number]
            cycles = int(group.channel_group.cycles_nr)
            check_size(float(cycles) * len(group.channels), len(group.channels), label)
            if cycles > 1040 * len(data):
                raise SceneError(f"{label}: damaged: claims {cycles:.3g} samples")
            columns = []
            for index in range(len(group.channels)):
                signal = file.get(group=number, index=index, raw=True)
                values = _mdf_values(signal, int(str(file.version)[0]))
                if values is not None:
                    name, unit = one_line(signal.name, 200), one_line(signal.unit or "", 60)
                    columns.append(Column(name, unit, values))
        finally:
            file.close()
    return Contents(columns)


def _mdf_group(file: Any, wanted: str | None, label: str) -> int:
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


def _mdf_values(signal: Any, version: int) -> Floats | None:
    """Values of a channel; None where they are no numbers or a formula computes them."""
    raw = signal.samples
    if raw.dtype.kind not in "iuf" or raw.ndim != 1:
        return None
    values = np.asarray(raw, dtype=np.float64)
    conversion = signal.conversion
    key = 4 if version >= 4 else 3
    if conversion is None or conversion.conversion_type == {4: 0, 3: 65535}[key]:
        return values
    if conversion.conversion_type == {4: 1, 3: 0}[key]:  # A linear conversion
        return np.asarray(float(conversion.a) * values + float(conversion.b))
    return None


def read_netcdf(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a netCDF file."""
    del data, choices
    with opened_table(path, label, "a recording of a laboratory (netCDF)") as file:
        variables = {
            name: variable
            for name, variable in file.variables.items()
            if variable.ndim in (1, 2) and getattr(variable.dtype, "kind", "") in "iuf"
        }
        total = sum(float(np.prod(v.shape, dtype=float)) for v in variables.values())
        check_size(total, len(variables), label)
        columns = []
        for name, variable in variables.items():
            values = np.ma.filled(np.ma.asarray(variable[...], np.float64), np.nan)
            unit = one_line(getattr(variable, "units", ""), 60)
            columns.append(Column(one_line(name, 200), unit, values))
    return Contents(columns)


def read_parquet(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a Parquet file; units stand in the metadata of a field, or in its name."""
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


def read_tdms(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a .tdms file: the channels of its one group, or of the group that is wanted.

    A channel with a sampling interval (`wf_increment`) and no channel of time beside it brings the
    column "time" [s].
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
        if claimed > 8.0 * len(data):  # Each value takes at least one bit
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
        columns += _tdms_time(channels, columns)
    return Contents(columns)


def _tdms_time(channels: list[tuple[str, Any]], columns: list[Column]) -> list[Column]:
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


def read_uff(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a universal file: abscissa and ordinate of each data set 58.

    An abscissa that repeats the one before it is left out. Complex values are two columns,
    "amplitude" and "phase" [deg].
    """
    del path, choices
    pyuff = library("pyuff", "pyuff", label)
    # Lines of -1 stand at the beginning and at the end of each data set of a UFF file.
    if len(re.findall(rb"    -1(?= *[\r\n]| *\Z)", data)) % 2:
        raise SceneError(f"{label}: truncated: a data set of it has no end")
    # pyuff reads only from a path. A file in memory leaves nothing on the disk, however this
    # process ends.
    with library_reading(label, "a UFF file"), os.fdopen(os.memfd_create("uff"), "wb") as file:
        file.write(data)
        file.flush()
        uff = pyuff.UFF(f"/proc/self/fd/{file.fileno()}")
        kinds = uff.get_set_types().tolist()
        if 58 not in kinds:
            has = f"data sets {sorted(set(kinds))}" if kinds else "no data set between lines of -1"
            raise SceneError(f"{label}: not a UFF file with data set 58 (functions): has {has}")
        check_size(0.0, 2 * kinds.count(58), label)
        columns: list[Column] = []
        for number in (n for n, kind in enumerate(kinds) if kind == 58):
            columns += _uff_columns(
                uff.read_sets(number), columns, f"{label}: data set {number + 1}"
            )
            check_size(float(sum(c.values.size for c in columns)), len(columns), label)
    return Contents(columns)


def _uff_columns(one: dict[str, Any], before: list[Column], where: str) -> Iterator[Column]:
    """Columns of one data set."""
    claimed, values, x = one["num_pts"], one["data"], one["x"]
    if not 0 < claimed <= min(len(values), len(x)):
        raise SceneError(f"{where}: damaged: claims {counted(claimed, 'value')}, has {len(values)}")
    # Names and units of abscissas that have no labels, by their numbers in data set 58
    abscissas = {17: ("time", "s"), 18: ("frequency", "Hz"), 20: ("order", "")}
    kind = abscissas.get(one["abscissa_spec_data_type"], ("abscissa", ""))
    name = _uff_label(one["abscissa_axis_lab"]) or kind[0]
    abscissa = Column(name, _uff_label(one["abscissa_axis_units_lab"]) or kind[1], x[:claimed])
    last = next((c for c in reversed(before) if c.name == name), None)
    if last is None or not np.array_equal(last.values, abscissa.values):
        yield abscissa
    unit = _uff_label(one["ordinate_axis_units_lab"])
    if np.iscomplexobj(values):
        yield Column("amplitude", unit, np.abs(values[:claimed]))
        yield Column("phase", "deg", np.degrees(np.angle(values[:claimed])))
    else:
        name = _uff_label(one["ordinate_axis_lab"]) or _uff_label(one["id1"]) or "ordinate"
        yield Column(name, unit, np.asarray(values[:claimed], np.float64))


def _uff_label(text: str) -> str:
    """Return a text of the file; "" where it says that there is none."""
    line = one_line(text, 80)
    return "" if line.upper() == "NONE" else line


def read_wav(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a .wav file: the time, which follows from its sample rate, and its channels."""
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
