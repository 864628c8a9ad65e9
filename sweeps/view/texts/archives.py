"""Content of an archive or of an interrupted run as a text: axes, quantities, provenance."""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.quantities.graph import DIMENSIONS, UNLESS_GIVEN
from engine_dyn.status import MEANINGS, PASSES_DONE
from sweeps.base.dimensions import REDUCTION, STATE
from sweeps.base.errors import as_name, counted, one_line, size_text
from sweeps.base.naming import meaning_of
from sweeps.base.numbers import last_digit, number_text, number_texts
from sweeps.decide.explore.attributes import axes_of, count_of_designs, of_designs
from sweeps.running.archive.partial import Partial
from sweeps.running.reduce.ranges import ranges
from sweeps.view.texts.key_texts import unit_text, with_word
from sweeps.view.texts.readable_units import factor, readable_of_archive
from sweeps.view.texts.reductions import at_points, outcomes_of_all, reduction_lines
from sweeps.view.texts.tables import aligned, last_digits, without_rounding

if TYPE_CHECKING:
    import xarray as xr


def interrupted_run(path: Path) -> Path | None:
    """Return the folder of an interrupted run, if `path` is one or is an archive not yet there."""
    try:
        here = Partial(path) if path.exists() else Partial.of(path)
        if here.path.is_dir() and here.header() is None:
            here = here.adding()
        return here.path if here.path.is_dir() and here.header() is not None else None
    except (OSError, ValueError):
        return None


def interrupted_text(path: Path) -> str:
    """Describe an unfinished run: what is finished of it, and who computes it or how to go on."""
    here = Partial(path)
    about = here.header() or {}
    output = shlex.quote(str(path.parent / about["output"]))
    what, again = f"run of {about['output']}", f"engine-dyn run SCENE -o {output} --resume"
    if about["output"] == here.added.name:
        what, again = "extension of an archive", "the same command"
    writer = here.writer()
    state = f"{what}, which is being computed now by {writer}" if writer else f"interrupted {what}"
    lines = [
        f"{path}: {'an' if state[0] in 'ei' else 'a'} {state}",
        f"  title: {about['title']}",
        f"  designs: {about['designs']}",
        f"  finished: {len(here.finished())} of {counted(about['blocks'], 'block')}",
        f"  started: {about['started']}",
        f"  command line: {one_line(about['command_line'], LONGEST_LINE)}",
    ]
    if not writer:
        lines.append(f"  to go on: {one_line(about.get('resume_command', again), LONGEST_LINE)}")
    return "\n".join(map(as_name, lines))


PASSES = "result after the requested number of cycles, not a steady state"
"""Words for designs that were solved for a number of cycles, by [solver] `passes`."""

# Largest number of values of a quantity that are read to find the smallest and largest one
MOST_READ = 2_000_000

LONGEST_LINE = 1000  # Largest number of characters of a printed line of an attribute


def archive_text(
    dataset: xr.Dataset, name: str, *, provenance: bool = False, units: str | None = None
) -> str:
    """Describe an archive, opened from the file `name`: its outcomes, axes and quantities.

    With `provenance` all attributes are told too: assumptions, parameters, versions, hashes of
    files. Units are those of tables, or `units`, such as ``"power=hp,speed=rad/s"`` or
    ``"archive"``. SceneError refuses names that are no quantities, and units that do not fit.
    """
    chosen = readable_of_archive(units, dataset.variables)
    lines = [f"{as_name(name)}: {one_line(dataset.attrs.get('title', ''))}".rstrip(": ")]
    head = (_engine_line(dataset), _size_line(dataset, name), _run_line(dataset))
    lines += [f"  {line}" for line in head if line]
    counts = outcome_counts(dataset)
    if counts:
        lines += [
            "",
            "outcomes",
            *(f"  {outcome}: {n}{explained(outcome)}" for outcome, n in counts.items()),
        ]
    warned = str(dataset.attrs.get("warnings", "")).splitlines()
    if warned:
        lines += ["", "warnings", *(f"  {one_line(line, LONGEST_LINE)}" for line in warned)]
    if REDUCTION in dataset.attrs:
        lines += reduction_lines(dataset, chosen)
    axes = axes_of(dataset)
    lines += ["", "axes"] if axes else []
    for dimension in axes:
        size = dataset.sizes[dimension]
        lines.append(f"  {dimension} ({size}): {_axis_text(dataset, dimension, chosen)}")
        columns = [
            f"{n}{unit_text(chosen.get(str(n)) or c.attrs.get('units', '1'))}"
            for n, c in dataset.coords.items()
            if c.dims == (dimension,) and n != dimension and c.dtype.kind not in "UOT"
        ]
        if columns:
            lines.append(f"    columns that vary along it: {', '.join(columns)}")
    kept = " of the designs that were kept" if REDUCTION in dataset.attrs else ""
    told = _quantity_lines(dataset, chosen)
    lines += ["", f"quantities{kept}", *told] if told else []
    told_of_cycles = recorded_cycle_lines(dataset, chosen)
    if told_of_cycles:
        lines += ["", "spread over the recorded cycles", *(f"  {x}" for x in told_of_cycles)]
    lines += ["", "provenance"]
    if not provenance:
        lines.append("  engine-dyn info --provenance shows assumptions, parameters, versions")
        return "\n".join(lines)
    for key, value in dataset.attrs.items():
        if key == "parameters":
            lines += _parameter_lines(dataset, value)
        elif key not in ("title", "warnings"):
            lines += _attribute_lines(str(key), value)
    return "\n".join(lines)


def _quantity_lines(dataset: xr.Dataset, chosen: Mapping[str, str]) -> list[str]:
    """Lines with each quantity and its value, or its range."""
    rows = []
    alike: dict[tuple[str, ...], dict[str, Any]] = {}
    for name in of_designs(dataset):
        data = dataset[name]
        if data.dtype.kind == "f" and not _is_long(data):
            unit = str(data.attrs.get("units", "1"))
            values = factor(unit, chosen.get(name, unit)) * data.values
            alike.setdefault(tuple(map(str, data.dims)), {})[name] = values
    lasts = {name: last for one in alike.values() for name, last in last_digits(one).items()}
    for name in of_designs(dataset):
        data = dataset[name]
        over = ", ".join(str(d) for d in data.dims)
        parts = [
            one_line(meaning_of(data.attrs)),
            f"over {over}, {size_text(data.nbytes)}" if over else "",
        ]
        extent = _extent_text(data, chosen.get(name), lasts.get(name))
        rows.append((name, extent, "; ".join(p for p in parts if p)))
    lines = [f"  {line}" for line in aligned(rows, left=[0, 1, 2])] if rows else []
    if any(_is_long(data) for data in dataset.data_vars.values()):
        lines.append(
            f"  not read: the ranges of quantities of more than {MOST_READ:,} values; "
            "engine-dyn best finds the smallest and the largest"
        )
    return lines


def _is_long(data: xr.DataArray) -> bool:
    """Whether a quantity has too many values to read them for its range."""
    return data.dtype.kind == "f" and data.size > MOST_READ


def _extent_text(data: xr.DataArray, wanted: str | None, last: int | None) -> str:
    """The value, or the smallest and the largest, with the unit; nothing for words and codes."""
    if data.dtype.kind != "f" or not data.size:
        return ""
    if "flag_meanings" in data.attrs and not _is_long(data):
        words = str(data.attrs["flag_meanings"]).split()
        counts = ((word, int((data.values == code).sum())) for code, word in enumerate(words))
        return ", ".join(f"{word} {number}" for word, number in counts if number) or "no value"
    units = data.attrs.get("units", "no single unit")
    times = factor(str(units), wanted) if wanted else 1.0
    units = one_line(wanted or units, 60)
    unit = "" if units == "1" else f" {units}"
    if _is_long(data):
        return f"not read{unit and f' [{units}]'}"
    values = without_rounding(data.values, str(units))
    if np.isnan(values).all():
        return "no value"
    low, high = times * float(np.nanmin(values)), times * float(np.nanmax(values))
    return " to ".join(dict.fromkeys(number_texts([low, high], last))) + unit


def recorded_cycle_lines(dataset: xr.Dataset, chosen: Mapping[str, str] | None = None) -> list[str]:
    """Mean, standard deviation and coefficient of variation of single values over `recorded_cycle`.

    Of archives with many other designs there are too many to tell; none are told then. Some
    quantities may be told in units that are chosen; others are in those of tables.
    """
    chosen = readable_of_archive(None, dataset.variables) if chosen is None else chosen
    lines = []
    cycle = "recorded_cycle"
    for name, data in dataset.data_vars.items():
        if cycle not in data.dims or data.dtype.kind != "f":
            continue
        others = [d for d in data.dims if d != cycle]
        if set(others) & set(DIMENSIONS) or data.size > 12 * dataset.sizes[cycle]:
            continue
        unit = str(data.attrs.get("units", "1"))
        wanted = chosen.get(str(name), unit)
        times, unit = factor(unit, wanted), wanted
        each = np.moveaxis(times * data.values, data.dims.index(cycle), -1)
        for place in np.ndindex(each.shape[:-1]):
            values = each[place][np.isfinite(each[place])]
            if values.size < 2:
                continue
            mean, spread = float(values.mean()), float(values.std(ddof=1))
            at = ", ".join(
                f"{d} {_told(dataset[d].values[i])}"
                for d, i in zip(others, place, strict=True)
                if d in dataset.coords
            )
            middle = number_text(mean, last=last_digit(mean, mean + spread, 2))
            parts = [
                f"{name}{f' at {at}' if at else ''}: {middle} ± {number_text(spread)}",
                f"({100.0 * spread / abs(mean):.1f} %)" if mean else "",
                "" if unit == "1" else unit,
            ]
            low, high = number_texts([float(values.min()), float(values.max())])
            told = " ".join(part for part in parts if part)
            lines.append(f"{told}, {low} to {high}; {values.size} cycles")
    return lines


def _told(value: Any) -> str:
    """Text of a number, or of a word on an axis of words."""
    return number_text(float(value)) if isinstance(value, np.number) else one_line(value, 60)


def outcome_counts(dataset: xr.Dataset) -> dict[str, int]:
    """Count the designs of each outcome, in the order of the codes; {} without a status."""
    if REDUCTION in dataset.attrs:
        return outcomes_of_all(dataset)
    if "status" not in dataset:
        return {}
    codes = dataset.variables["status"]
    dims = [str(d) for d in codes.dims]
    counts = np.zeros(len(MEANINGS), dtype=np.int64)
    for _, _, read in ranges({"status": codes}, dims, codes.shape, 1_000_000):
        # Ranges are counted one by one: counting makes an index of eight bytes out of each code.
        counts += np.bincount(read["status"].reshape(-1), minlength=len(MEANINGS))
    by_outcome = {name: int(n) for name, n in zip(MEANINGS, counts, strict=True) if n}
    return of_all_designs(by_outcome, count_of_designs(dataset))


def explained(outcome: str) -> str:
    """Meaning in brackets of an outcome whose name does not tell it."""
    return f" ({PASSES})" if outcome == MEANINGS[PASSES_DONE] else ""


def of_all_designs(counts: Mapping[str, int], designs: int) -> dict[str, int]:
    """Outcomes of all designs: along an axis that changes none, one stands for several designs."""
    each, rest = divmod(designs, sum(counts.values()) or 1)
    return {name: n * each if each and not rest else n for name, n in counts.items()}


def _size_line(dataset: xr.Dataset, name: str) -> str:
    """Line on the size of an archive, in numbers and on disk, and on its storage."""
    results = [v for name, v in dataset.data_vars.items() if name != STATE]
    numbers = {str(v.dtype) for v in results if v.dtype.kind == "f"}
    levels = [v.encoding.get("complevel", 0) for v in results]
    reduced = " reduced" if REDUCTION in dataset.attrs else ""
    parts = [
        counted(count_of_designs(dataset), "design") + at_points(dataset) + reduced,
        f"{size_text(sum(v.nbytes for v in results))} of results",
        *sorted(numbers),
        f"compression {max(levels)}" if any(levels) else "not compressed",
        f"{size_text(Path(name).stat().st_size)} on disk",
    ]
    return ", ".join(parts)


def _engine_line(dataset: xr.Dataset) -> str:
    """Line on the engine, or the several engines, of an archive."""
    name, title = (str(dataset.attrs.get(key, "")) for key in ("engine", "engine_title"))
    if not name or title.startswith("engines "):
        return one_line(title, LONGEST_LINE)
    return one_line(f"engine {name}: {title}".rstrip(": "), LONGEST_LINE)


def _run_line(dataset: xr.Dataset) -> str:
    """Line on the run that made an archive: version, date, time, part and command."""
    made = str(dataset.attrs.get("history", "")).splitlines()
    version = _version(dataset)
    words = [f"computed with engine-dyn {version}"] if version else []
    if made:
        when, _, what = made[-1].partition(": ")
        words.append(f"{'joined ' * (' joined ' in what)}on {one_line(when, 60)}")
    if "seconds" in dataset.attrs:
        words.append(f"computed in {one_line(dataset.attrs['seconds'], 30)} s")
    text = ", ".join(words).replace(", on ", " on ", 1)
    if "command_line" in dataset.attrs:
        text += f", by {one_line(dataset.attrs['command_line'], LONGEST_LINE)}"
    return "; ".join(part for part in (text.removeprefix(", "), _part_text(dataset)) if part)


def _version(dataset: xr.Dataset) -> str:
    """Version that computed the numbers of an archive; empty where it is not stated."""
    try:
        return one_line(json.loads(dataset.attrs["identity"])["versions"]["engine-dyn"], 60)
    except (KeyError, ValueError, TypeError, AttributeError, RecursionError):
        return ""


def _part_text(dataset: xr.Dataset) -> str:
    """Text on the shard of a sweep that an archive is; empty for a whole sweep."""
    try:
        part = json.loads(dataset.attrs["part"])
        number, count = (int(text) for text in part["shard"].split("/"))
        return f"part {number} of {count}, cut along {one_line(part['axis'], 60)}"
    except (KeyError, ValueError, TypeError, AttributeError, RecursionError):
        return ""


def _parameter_lines(dataset: xr.Dataset, value: object) -> list[str]:
    """Parameters of an archive: those that engine and scene give, then the neutral ones."""
    try:
        members = json.loads(str(value))
        scene = json.loads(dataset.attrs["scene"])
        given = set(json.loads(dataset.attrs["engine_values"]))
        given.update(key for table in scene.values() if isinstance(table, dict) for key in table)
        left = {
            k: v for k, v in members.items() if k not in given and v == UNLESS_GIVEN.get(k, 0.0)
        }
    # The archive is of several engines, or of another program.
    except (KeyError, ValueError, TypeError, AttributeError, RecursionError):
        return _attribute_lines("parameters", value)
    rest = {name: number for name, number in members.items() if name not in left}
    lines = _attribute_lines("parameters", json.dumps(rest)) if rest else ["  parameters:"]
    neutral = ", ".join(f"{name} {number_text(float(number))}" for name, number in left.items())
    return [*lines, f"    not given, so neutral: {neutral}"] if neutral else lines


def _attribute_lines(key: str, value: object) -> list[str]:
    """Lines of an attribute; JSON has a line for each of its members, an empty text none."""
    if isinstance(value, str) and not value:
        return []
    if isinstance(value, str) and value.startswith("{"):
        about = ""
        try:
            members = json.loads(value)
            if key == "input_files":  # Hashes stand for the texts of files, which are long
                members = {name: f"sha256 {f['sha256']}" for name, f in members["files"].items()}
                about = (
                    " (hash of each text as it was used: of a laboratory's file, of the CSV that "
                    "was made of it; the hash of the raw file is in indicator_notes)"
                )
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            members = {}
        if members:
            if key in ("parameters", "engine_values"):
                members = {name: with_word(name, item) for name, item in members.items()}
            texts = {
                name: item if isinstance(item, str) else json.dumps(item, ensure_ascii=False)
                for name, item in members.items()
            }
            rows = [f"    {name}: {one_line(text, LONGEST_LINE)}" for name, text in texts.items()]
            return [f"  {key}{about}:", *rows]
    return [f"  {key}: {one_line(value, LONGEST_LINE)}"]


def _axis_text(dataset: xr.Dataset, dimension: str, chosen: Mapping[str, str]) -> str:
    """Values along one dimension: words, or the numbers with their unit."""
    words = [
        coordinate
        for coordinate in dataset.coords.values()
        if coordinate.dims == (dimension,) and coordinate.dtype.kind in "UOT"
    ]
    if words:
        return one_line(", ".join(str(word) for word in words[0].values), 100)
    if dimension not in dataset.coords:
        return ""
    coordinate = dataset[dimension]
    unit = str(coordinate.attrs.get("units", "1"))
    wanted = chosen.get(dimension, unit)
    whole = coordinate.dtype.kind in "iu" and unit == wanted
    values = [
        f"{value:d}" if whole else f"{factor(unit, wanted) * value:g}"
        for value in coordinate.values[[0, 1, -1] if coordinate.size > 8 else slice(None)]
    ]
    listed = ", ".join(values) if coordinate.size <= 8 else "{}, {} ... {}".format(*values)
    return listed + unit_text(wanted) + (_load_text(dataset) if dimension == "load" else "")


def _load_text(dataset: xr.Dataset) -> str:
    """What the values of an axis `load` are, with the torque that each has, if it is there."""
    text = "; names of diagrams, not shares of the torque"
    torque = dataset["torque_mean"] if "torque_mean" in dataset.data_vars else None
    if torque is None or torque.dims != ("load",) or torque.size > 8:
        return text
    return f"{text}, which is {', '.join(number_texts(torque.values.tolist()))} N m"
