"""Numbers of an archive as they lie in a report: float32 in base64, fewer of them where needed.

Single numbers of designs and curves are thinned apart, because a curve has hundreds of numbers for
each design. An axis keeps every n-th value; of a list of designs a sample is kept, because a list
may be a grid written out, and every n-th row of it may be the same speed.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.quantities.graph import DIMENSIONS
from engine_dyn.status import MEANINGS
from sweeps.base.dimensions import COUNTED, words_of
from sweeps.base.errors import SceneError, one_line
from sweeps.base.naming import meaning_of
from sweeps.running.reduce.ranges import ranges
from sweeps.view.texts.readable_units import converted, unit_choices
from sweeps.view.texts.tables import last_digits

if TYPE_CHECKING:
    import xarray as xr


Places = npt.NDArray[np.int64]


ROUNDING = 1e-8
"""Variation, relative to the largest number, up to which a quantity is taken for constant."""

LONGEST_WORD = 120  # Largest number of characters of a name in the page


@dataclass
class Embedded:
    """Axes, columns and quantities that a page draws from, as `program.js` reads them."""

    axes: dict[str, dict[str, Any]] = field(default_factory=dict)
    columns: dict[str, dict[str, Any]] = field(default_factory=dict)
    quantities: dict[str, dict[str, Any]] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)  # Sentences on values left out of the page
    flat: set[str] = field(
        default_factory=set
    )  # Quantities that vary by rounding alone, or in words
    planes: set[str] = field(default_factory=set)  # Quantities that vary in two directions
    start: dict[str, int] = field(default_factory=dict)  # Where the verdict is decided

    def json(self) -> dict[str, Any]:
        """All of it, and the words of outcomes."""
        return {
            "axes": self.axes,
            "columns": self.columns,
            "quantities": self.quantities,
            "outcomes": [word.replace("_", " ") for word in MEANINGS],
        }


def choices_of(archive: xr.Dataset, units: str | None) -> dict[str, str]:
    """Return the units that axes, columns and quantities are shown in.

    SceneError refuses units that do not fit, in words that hold for the command and for Python.
    """
    known = {
        str(name): str(variable.attrs.get("units", "1"))
        for name, variable in archive.variables.items()
        if variable.dtype.kind in "fiu" and "flag_meanings" not in variable.attrs
    }
    try:
        return unit_choices(units, known)
    except SceneError as error:
        raise SceneError(str(error).removeprefix("--")) from None


def text_of(variable: xr.Variable | xr.DataArray, name: str) -> str:
    """What a variable is, or its name."""
    return one_line(meaning_of(variable.attrs, name), LONGEST_WORD)


def embedded(
    archive: xr.Dataset, choices: Mapping[str, str], room: float, at: Mapping[str, int]
) -> Embedded:
    """Read what a page of so many bytes can hold of an archive, in the units that are chosen.

    Of axes the places `at` are kept, except of curves. The archive may be larger than memory.
    """
    page = Embedded()
    names = [str(n) for n, v in archive.data_vars.items() if v.dtype.kind in "fiub" and v.size > 0]
    for name in [str(n) for n in archive.data_vars if str(n) not in names]:
        page.left_out.append(f"{one_line(name, 60)} is left out, because it has no numbers.")
    numbers = [n for n in names if not set(archive[n].dims) & {"crank_angle", "order"}]
    curves = [n for n in names if n not in numbers]
    columns = columns_along(archive, names)
    budget = room / (4.0 * 4.0 / 3.0)  # A float32 takes 16/3 bytes in base64
    share = 0.6 if curves else 1.0  # Curves get the rest of the room
    numbers, counts = _thinned(archive, numbers, columns, budget * share, page)
    places = {dim: _places(archive, dim, count) for dim, count in counts.items()}
    for dim in places.keys() & at.keys():
        page.start[dim] = int(np.abs(places[dim] - at[dim]).argmin())
        places[dim][page.start[dim]] = at[dim]
    used = _cost(archive, numbers, columns, counts)
    of_curves = _places_of_curves(archive, curves, places, budget - used, page)
    for dim, picked in of_curves.items():
        places.setdefault(dim, picked)
    for dim, picked in places.items():
        page.axes[dim] = _axis(archive, dim, len(picked), columns)
        if len(picked) < archive.sizes[dim]:
            page.left_out.append(_thinned_text(archive, dim, picked))
    for key, (dim, variable) in columns.items():
        if dim in places:
            page.columns[key] = _column(variable, key, places[dim], choices.get(key))
    spans: dict[str, tuple[float, float]] = {}
    kept: dict[tuple[str, ...], dict[str, Any]] = {}  # Numbers by the axes that they depend on
    for name in (n for n in names if n in numbers or n in curves):
        variable = archive[name].variable
        own = of_curves if name in curves else places
        picked_by = {str(d): own[str(d)] for d in variable.dims}
        values = _read(variable, picked_by)
        spans[name] = _span(values)
        if name in numbers and name != "status":
            times, _ = converted(str(variable.attrs.get("units", "1")), choices.get(name))
            kept.setdefault(tuple(picked_by), {})[name] = times * values
        if "direction" in variable.dims and _in_plane(values, variable.dims.index("direction")):
            page.planes.add(name)
        page.quantities[name] = _quantity(
            variable, values, name, picked_by, places, choices.get(name)
        )
    for alike in kept.values():
        for name, last in last_digits(alike).items():
            page.quantities[name]["last"] = last
    # Words are not drawn as numbers
    page.flat = _flat(page, spans) | {n for n in names if "flag_meanings" in archive[n].attrs}
    page.left_out += _coarser_text(archive, of_curves, places)
    return page


def described(archive: xr.Dataset, choices: Mapping[str, str]) -> Embedded:
    """Return axes, columns and quantities of a whole archive, without their numbers."""
    page = Embedded()
    names = [str(n) for n, v in archive.data_vars.items() if v.dtype.kind in "fiu" and v.size > 0]
    columns = columns_along(archive, names)
    for dim in dict.fromkeys(dim for dim, _ in columns.values()):
        page.axes[dim] = _axis(archive, dim, archive.sizes[dim], columns)
    for key, (_, variable) in columns.items():
        kind = "words" if is_words(variable) else "values"
        page.columns[key] = {**_about(variable, key, choices.get(key)), kind: None}
    for name in names:
        variable = archive[name].variable
        page.quantities[name] = _about(variable, name, choices.get(name))
        if "direction" in variable.dims and archive.sizes["direction"] > 1:
            page.planes.add(name)
    return page


def columns_along(archive: xr.Dataset, names: Sequence[str]) -> dict[str, tuple[str, xr.Variable]]:
    """Return what tells the values along each dimension: its own values, columns of designs."""
    words = words_of(archive)
    columns: dict[str, tuple[str, xr.Variable]] = {}
    for dim in dict.fromkeys(str(d) for n in names for d in archive[n].dims):
        home = words.get(dim, dim)
        if home in archive.coords:
            columns[dim] = (dim, archive[home].variable)
        else:
            import xarray as xr

            columns[dim] = (dim, xr.Variable((dim,), np.arange(archive.sizes[dim])))
        for name, coordinate in archive.coords.items():
            if coordinate.dims == (dim,) and str(name) not in (dim, home):
                columns[str(name)] = (dim, coordinate.variable)
    return columns


def is_list(archive: xr.Dataset, dim: str) -> bool:
    """Return whether a dimension is a list of designs, whose numbers mean nothing."""
    return dim == "design" or dim not in archive.coords


def is_words(variable: xr.Variable) -> bool:
    """Return whether a variable holds texts, or times, which are shown as texts."""
    return variable.dtype.kind not in "fiub"


def _cost(
    archive: xr.Dataset, names: Sequence[str], columns: Mapping[str, tuple[str, xr.Variable]],
    counts: Mapping[str, int],
) -> float:  # fmt: skip
    """Size of the numbers to be stored, counted in float32."""
    cost = 0.0
    for name in names:
        share = 0.25 if name == "status" else 1.0
        cost += share * math.prod(counts[str(d)] for d in archive[name].dims)
    for dim, variable in columns.values():
        # A word takes about as much room as six numbers.
        cost += counts.get(dim, 0) * (6 if is_words(variable) else 2)
    return cost


def _thinned(
    archive: xr.Dataset, names: Sequence[str], columns: Mapping[str, tuple[str, xr.Variable]],
    budget: float, page: Embedded, counts: Mapping[str, int] | None = None,
) -> tuple[list[str], dict[str, int]]:  # fmt: skip
    """Number of values of each dimension that have room, and the quantities that do."""
    kept = list(names)
    while True:
        used = dict.fromkeys(str(d) for n in kept for d in archive[n].dims)
        start = {d: (counts or {}).get(d, archive.sizes[d]) for d in used}
        lows = {d: _low(archive, d, start[d], columns) for d in used}
        now = dict(start)
        if "crank_angle" in now and _cost(archive, kept, columns, now) > budget:
            # A screen shows no more than about 361 points of a curve.
            now["crank_angle"] = min(now["crank_angle"], 361)
        while _cost(archive, kept, columns, now) > budget:
            free = [d for d in now if now[d] > lows[d]]
            if not free:
                break
            # Designs are thinned before the crank angle while they have more than 1/12 of its
            # points.
            widest = max(free, key=lambda d: now[d] / (12.0 if d == "crank_angle" else 1))
            now[widest] = max(lows[widest], _fewer(start[widest], now[widest], archive, widest))
        if _cost(archive, kept, columns, now) <= budget or not kept:
            return kept, now
        # The quantities that were asked for first come first in an archive; outcomes stay.
        last = next((n for n in reversed(kept) if n not in ("status", "delta")), kept[-1])
        kept.remove(last)
        page.left_out.append(
            f"{last} is left out, because it does not fit; a larger --limit makes room."
        )


def _fewer(size: int, count: int, archive: xr.Dataset, dim: str) -> int:
    """The next smaller number of values that can be kept."""
    if is_list(archive, dim):
        return int(0.9 * count)
    step = math.ceil(size / count) + 1
    return math.ceil(size / step)


def _low(
    archive: xr.Dataset, dim: str, count: int, columns: Mapping[str, tuple[str, xr.Variable]]
) -> int:
    """Least number of values of a dimension that are kept."""
    words = dim in columns and is_words(columns[dim][1])
    if dim in (*COUNTED, "direction", "order") or (words and archive.sizes[dim] <= 50):
        return count
    return min(count, 121 if dim == "crank_angle" else 2)


def _places(archive: xr.Dataset, dim: str, count: int) -> Places:
    return _chosen(archive.sizes[dim], count, sample=is_list(archive, dim))


def _chosen(size: int, count: int, *, sample: bool) -> Places:
    """Places of some values out of a number of them: evenly, or a sample with both ends."""
    if count >= size:
        return np.arange(size)
    if sample and count > 2:
        inner = np.random.default_rng(0).choice(size - 2, count - 2, replace=False, shuffle=False)
        return np.concatenate([[0], 1 + np.sort(inner), [size - 1]])
    return np.arange(0, size, math.ceil(size / max(count, 1)))


def _places_of_curves(
    archive: xr.Dataset, curves: list[str], places: Mapping[str, Places], room: float,
    page: Embedded,
) -> dict[str, Places]:  # fmt: skip
    """Values along the dimensions of curves, out of those of single numbers."""
    if not curves:
        return {}
    counts = {dim: len(picked) for dim, picked in places.items()}
    columns = {  # Columns of dimensions that single numbers do not have, such as the crank angle
        key: value
        for key, value in columns_along(archive, curves).items()
        if value[0] not in places
    }
    kept, now = _thinned(archive, curves, columns, room, page, counts)
    curves[:] = kept
    of_curves = {}
    for dim, count in now.items():
        if dim in places:
            own = _chosen(len(places[dim]), count, sample=is_list(archive, dim))
            of_curves[dim] = places[dim][own]
        else:
            of_curves[dim] = _places(archive, dim, count)
    return of_curves


def _axis(
    archive: xr.Dataset, dim: str, count: int,
    columns: Mapping[str, tuple[str, xr.Variable]],
) -> dict[str, Any]:  # fmt: skip
    own = [key for key, (of, _) in columns.items() if of == dim and key != dim]
    names = [key for key in (dim, *own) if key in columns and is_words(columns[key][1])]
    part = dim in ("misfire", "cylinders") or (dim in DIMENSIONS and DIMENSIONS[dim].whole)
    return {
        "size": archive.sizes[dim],
        "count": count,
        "list": is_list(archive, dim),
        "columns": own,
        "named_by": names[0] if names else None,
        "of_curves": dim in ("crank_angle", "order"),
        "of_designs": dim not in DIMENSIONS,
        # Nothing lies between designs of a list, words, parts, modes and orders.
        "joined": not (part or names or dim == "order" or is_list(archive, dim)),
    }


def _about(variable: xr.Variable, name: str, choice: str | None) -> dict[str, Any]:
    """Description of a column or quantity in a page, without its numbers."""
    dims = [str(d) for d in variable.dims]
    about = {"dim": dims[0] if dims else "", "dims": dims, "title": text_of(variable, name)}
    if is_words(variable) or name == "status":
        return {**about, "unit": ""}
    unit = converted(str(variable.attrs.get("units", "1")), choice)[1]
    return {**about, "unit": one_line(unit, 40)}


def _column(variable: xr.Variable, key: str, places: Places, choice: str | None) -> dict[str, Any]:
    about, read = _about(variable, key, choice), variable[_index(places)].values
    if is_words(variable):
        return {**about, "words": [one_line(text, LONGEST_WORD) for text in read]}
    factor, _ = converted(str(variable.attrs.get("units", "1")), choice)
    return {**about, "values": _base64(read * factor, "<f8")}


def _span(values: npt.NDArray[Any]) -> tuple[float, float]:
    """Smallest and largest number; (0, 0) without any."""
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)


def _in_plane(values: npt.NDArray[Any], axis: int) -> bool:
    """Whether components in the first two directions both vary."""
    if values.shape[axis] < 2:
        return False
    widths = [high - low for low, high in (_span(values.take(i, axis)) for i in (0, 1))]
    return min(widths) > ROUNDING * max(widths)


def _flat(page: Embedded, spans: Mapping[str, tuple[float, float]]) -> set[str]:
    """Quantities whose variation is only rounding, compared with all quantities of their unit."""
    largest: dict[str, float] = {}
    for name, (low, high) in spans.items():
        unit = page.quantities[name]["unit"]
        size = max(abs(low), abs(high))
        key = unit or name  # Numbers without a unit are not compared with each other
        largest[key] = max(largest.get(key, 0.0), size)
    return {
        name for name, (low, high) in spans.items()
        if high - low <= ROUNDING * largest[page.quantities[name]["unit"] or name]
    }  # fmt: skip


def _quantity(
    variable: xr.Variable, read: npt.NDArray[Any], name: str, places: Mapping[str, Places],
    of_axes: Mapping[str, Places], choice: str | None,
) -> dict[str, Any]:  # fmt: skip
    about = {
        **_about(variable, name, choice),
        "shape": list(read.shape),
        "at": {
            d: _base64(np.searchsorted(of_axes[d], picked), "<i4")
            for d, picked in places.items()
            if len(picked) < len(of_axes[d])
        },
    }
    if name == "status":
        return {**about, "type": "u1", "data": _base64(read, "u1")}
    factor, _ = converted(str(variable.attrs.get("units", "1")), choice)
    return {**about, "type": "f4", "data": _base64(read * factor, "<f4")}


def _base64(values: npt.NDArray[Any], kind: str) -> str:
    with np.errstate(over="ignore", invalid="ignore"):  # Some archives have numbers beyond float32
        stored = np.ascontiguousarray(values).astype(kind)
    return base64.b64encode(stored.tobytes()).decode("ascii")


def _index(places: Places) -> slice | Places:
    """Places as a slice where possible, which a file reads faster."""
    if len(places) < 2:
        return slice(int(places[0]), int(places[0]) + 1) if len(places) else slice(0, 0)
    steps = np.diff(places)
    if (steps == steps[0]).all():
        return slice(int(places[0]), int(places[-1]) + 1, int(steps[0]))
    return places


def _read(variable: xr.Variable, places: Mapping[str, Places]) -> npt.NDArray[Any]:
    """Read the values at some places; memory holds these, and a range of the others."""
    dims = [str(d) for d in variable.dims]
    index = [_index(places[d]) for d in dims]
    if variable.nbytes <= 64e6:
        values = variable.values
        for axis, own in enumerate(index):
            values = values[(slice(None),) * axis + (own,)]
        return values
    # A few designs of a list are read one by one, many in ranges.
    if math.prod(len(own) for own in index if not isinstance(own, slice)) <= 3000:
        return variable.isel(dict(zip(dims, index, strict=True))).values
    shape = tuple(variable.sizes[d] for d in dims)
    result = np.empty(tuple(len(places[d]) for d in dims), variable.dtype)
    for begin, extent, arrays in ranges({"one": variable}, dims, shape):
        inside, into = [], []
        for dim, first, length in zip(dims, begin, extent, strict=True):
            low, high = np.searchsorted(places[dim], [first, first + length])
            inside.append(places[dim][low:high] - first)
            into.append(slice(low, high))
        result[tuple(into)] = arrays["one"][np.ix_(*inside)]
    return result


def _thinned_text(archive: xr.Dataset, dim: str, places: Places) -> str:
    few, all_of_them = f"{len(places):,}", f"{archive.sizes[dim]:,}"
    if is_list(archive, dim):
        return f"{few} of {all_of_them} designs are in this page: a random sample."
    return f"{few} of {all_of_them} values of {one_line(dim, 60)} are in this page."


def _coarser_text(
    archive: xr.Dataset, of_curves: Mapping[str, Places], places: Mapping[str, Places]
) -> list[str]:
    """Sentences about axes along which curves have fewer values than single numbers."""
    return [
        f"Curves are in this page at {len(picked):,} of {archive.sizes[dim]:,} "
        f"{'designs' if is_list(archive, dim) else f'values of {one_line(dim, 60)}'}; the nearest "
        "one is drawn and named."
        for dim, picked in of_curves.items()
        if len(picked) < len(places[dim])
    ]
