"""Two archives are compared: axes, quantities, the largest differences and where they are.

Both are read a range at a time: they may be larger than memory.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sweeps.base.dimensions import COMPARED, STATE
from sweeps.base.errors import SceneError, counted
from sweeps.decide.explore.attributes import members_of
from sweeps.running.archive.provenance import differences
from sweeps.running.reduce.ranges import ranges

if TYPE_CHECKING:
    import xarray as xr

NAMES = ("the first", "the second")  # Names of two archives whose files are not known


@dataclass(frozen=True)
class Difference:
    """How two archives differ in one quantity."""

    name: str
    units: str
    count: int = 0  # Number of values that were compared
    differing: int = 0  # Number of values that differ; two missing values (NaN) are the same
    only_one: int = 0  # Number of differing values that are a number in one archive only
    # Largest difference, and largest relative difference, over the greater of the two magnitudes;
    # 0 where no values differ.
    largest: float = 0.0
    relative: float = 0.0
    # Values of the axes at the largest difference, and at the largest relative difference.
    largest_at: dict[str, Any] = field(default_factory=dict)
    relative_at: dict[str, Any] = field(default_factory=dict)
    # Values of both archives at the largest difference, and at the largest relative difference.
    pair: tuple[float, float] = (math.nan, math.nan)
    relative_pair: tuple[float, float] = (math.nan, math.nan)
    # Values of the axes at the first value that is a number in one archive only.
    only_at: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Comparison:
    """The common quantities of two archives, and their differences."""

    # How axes differ, in words; empty where they are the same. Values that only one archive has are
    # not compared.
    axes: list[str]
    made: list[str]  # Other differences in how the archives were made, such as versions, in words
    only_first: list[str]  # Quantities that one archive alone has
    only_second: list[str]
    # Quantities that both archives have but with different axes or units, with the reason.
    not_compared: list[str]
    quantities: list[Difference]  # Quantities that both archives have
    names: tuple[str, str] = NAMES  # Names of the archives in texts

    @property
    def same(self) -> bool:
        """Whether axes and all values are the same."""
        return not self.others and not any(d.differing for d in self.quantities)

    @property
    def others(self) -> bool:
        """Whether one archive has anything that was not compared with the other."""
        return bool(self.axes or self.only_first or self.only_second or self.not_compared)

    def within(self, tolerance: float) -> bool:
        """Whether axes are the same, and all values up to a relative difference."""
        return not self.others and not any(
            d.only_one or d.relative > tolerance for d in self.quantities
        )


def compare(first: xr.Dataset, second: xr.Dataset, names: tuple[str, str] = NAMES) -> Comparison:
    """Compare two archives as `sweeps.open` or `sweeps.run` returns them.

    `names` are what they are called in words, such as their files.
    """
    first, second = (one.drop_vars(STATE, errors="ignore") for one in (first, second))
    own = [str(n) for n in first.data_vars]
    others = [str(n) for n in second.data_vars]
    axes, one, two = common_part(first, second, names)
    not_compared, quantities = [], []
    for name in own:
        if name not in others:
            continue
        why = unlike(one[name], two[name])
        if why:
            not_compared.append(f"{name}: {why}")
        else:
            quantities.append(_difference(name, one, two))
    return Comparison(
        axes,
        _made(first, second, names),
        [n for n in own if n not in others],
        [n for n in others if n not in own],
        not_compared,
        quantities,
        names,
    )


def common_part(
    first: xr.Dataset, second: xr.Dataset, names: tuple[str, str] = NAMES
) -> tuple[list[str], xr.Dataset, xr.Dataset]:
    """How axes differ, and both archives at the values that both have."""
    different: list[str] = []
    places: tuple[dict[str, Any], dict[str, Any]] = ({}, {})
    for dimension in dict.fromkeys((*first.dims, *second.dims)):
        name = str(dimension)
        if (name in first.dims) != (name in second.dims):
            different.append(f"{name}: only in {names[name not in first.dims]}")
            continue
        along = [_columns(dataset, name) for dataset in (first, second)]
        alike = first.sizes[name] == second.sizes[name] and len(along[0]) == len(along[1])
        if alike and all(map(np.array_equal, *along)):
            continue
        one, two = (_keys(dataset, name) for dataset in (first, second))
        where = {key: i for i, key in enumerate(two)}
        pairs = [(i, where[key]) for i, key in enumerate(one) if key in where]
        places[0][name] = np.array([i for i, _ in pairs], dtype=np.int64)
        places[1][name] = np.array([i for _, i in pairs], dtype=np.int64)
        if len(pairs) == len(one) == len(two):
            different.append(f"{name}: the same {counted(len(one), 'value')} in another order")
        else:
            different.append(
                f"{name}: {counted(len(pairs), 'value')} in both, of {len(one)} in {names[0]} and "
                f"{len(two)} in {names[1]}"
            )
    return different, first.isel(places[0]), second.isel(places[1])


def _keys(dataset: xr.Dataset, dimension: str) -> list[Any]:
    """Keys of the points of an axis: its values, its words, or all columns of designs."""
    along = _columns(dataset, dimension)
    if not along:
        return list(range(dataset.sizes[dimension]))
    if len(along) == 1:
        return list(along[0].tolist())
    return list(zip(*(column.tolist() for column in along), strict=True))


def _columns(dataset: xr.Dataset, dimension: str) -> list[npt.NDArray[Any]]:
    """Coordinates along an axis in the order of their names."""
    along = sorted(str(n) for n, c in dataset.coords.items() if c.dims == (dimension,))
    if len(along) > 1 and dimension in along and dataset[dimension].dtype.kind == "i":
        # Integers that only number the words or designs of an axis are no values to compare.
        along.remove(dimension)
    return [dataset[name].values for name in along]


def unlike(one: xr.DataArray, two: xr.DataArray) -> str:
    """Why values of two variables cannot be compared; empty where they can."""
    if set(one.dims) != set(two.dims):
        return f"over ({', '.join(map(str, one.dims))}) and over ({', '.join(map(str, two.dims))})"
    units = [str(v.attrs.get("units", "no single unit")) for v in (one, two)]
    if units[0] != units[1]:
        return f"in {units[0]} and in {units[1]}"
    return "" if one.size else "no axis point is in both archives"


def _difference(name: str, one: xr.Dataset, two: xr.Dataset) -> Difference:
    dims = [str(d) for d in one[name].dims]
    shape = [one.sizes[d] for d in dims]
    pairs = {"one": one[name].variable, "two": two[name].variable}
    units = str(one[name].attrs.get("units", ""))
    count = differing = only_one = 0
    largest: dict[str, Any] = {"largest": 0.0, "relative": 0.0}
    for begin, _, arrays in ranges(pairs, dims, shape):
        a, b = (np.asarray(arrays[key], dtype=np.float64) for key in ("one", "two"))
        missing = np.isnan(a) != np.isnan(b)
        unequal = (a != b) & ~(np.isnan(a) & np.isnan(b))
        count += a.size
        differing += int(unequal.sum())
        if missing.any() and not only_one:
            at = np.unravel_index(int(missing.argmax()), missing.shape)
            largest["only_at"] = _at(one, dims, begin, at)
        only_one += int(missing.sum())
        if not (unequal & ~missing).any():
            continue
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            gap = np.where(unequal & ~missing, np.abs(a - b), 0.0)
            over = np.where(gap > 0.0, gap / np.maximum(np.abs(a), np.abs(b)), 0.0)
        # An infinite difference of two values is infinite over their magnitudes too.
        over[np.isinf(gap)] = math.inf
        for key, values, pair in (("largest", gap, "pair"), ("relative", over, "relative_pair")):
            here = float(values.max())
            if here > largest[key]:
                largest[key] = here
                at = np.unravel_index(int(values.argmax()), values.shape)
                largest[f"{key}_at"] = _at(one, dims, begin, at)
                largest[pair] = (float(a[at]), float(b[at]))
    return Difference(name, units, count, differing, only_one, **largest)


def _at(dataset: xr.Dataset, dims: list[str], begin: tuple[int, ...], at: Any) -> dict[str, Any]:
    """Values of the axes at a place; words where an axis has some, otherwise the position."""
    place: dict[str, Any] = {}
    for dimension, first, offset in zip(dims, begin, at, strict=True):
        index = first + int(offset)
        words = [
            c for c in dataset.coords.values() if c.dims == (dimension,) and c.dtype.kind in "UOT"
        ]
        if words:
            place[dimension] = str(words[0].values[index])
        elif dimension in dataset.coords:
            place[dimension] = dataset[dimension].values[index].item()
        else:
            place[dimension] = index
    return place


def _made(first: xr.Dataset, second: xr.Dataset, names: tuple[str, str]) -> list[str]:
    """Differences in how the archives were made, by their attributes."""
    try:
        one, two = (json.loads(d.attrs["identity"]) for d in (first, second))
        return differences(one, two, words=(f"in {names[0]}", f"in {names[1]}"))
    except (KeyError, ValueError, TypeError, AttributeError):
        return []


def beside(
    first: xr.Dataset, second: xr.Dataset, labels: Sequence[str] = ("first", "second")
) -> xr.Dataset:
    """Put the quantities that two archives have in common beside each other.

    Parameters
    ----------
    first, second : Dataset
        Archives as `sweeps.open` or `sweeps.run` returns them. Nothing is read yet.
    labels : sequence of str
        What the two are called in legends.

    Returns
    -------
    Dataset
        The first archive's quantities by their names, the second's with `_compared` at the end of
        the name; attribute `compared` holds the labels as JSON. Attributes of the first that the
        second does not share are left out. Quantities over other axes or in another unit are too.
        An axis that only one of them has is cut at the value that the other has, if it is there.

    Raises
    ------
    SceneError
        Where no quantity is in both at some value of all its axes.

    Examples
    --------
    >>> both = beside(sweeps.open("a.nc"), sweeps.open("b.nc"), ("a", "b"))  # doctest: +SKIP
    >>> both.delta, both.delta_compared  # doctest: +SKIP
    """
    _, one, two = common_part(_at_the_value_of(first, second), _at_the_value_of(second, first))
    names = [
        str(name)
        for name in one.data_vars
        if name in two.data_vars and name != "status" and not unlike(one[name], two[name])
    ]
    if not names:
        raise SceneError(
            "nothing to draw: the archives have no common quantity at the same axis values"
        )
    kept = one[names]
    kept.attrs = {k: v for k, v in first.attrs.items() if second.attrs.get(k) == v}
    kept.attrs["compared"] = json.dumps(list(labels))
    dims = {name: kept[name].dims for name in names}
    return kept.assign({n + COMPARED: two[n].variable.transpose(*dims[n]) for n in names})


def _at_the_value_of(one: xr.Dataset, other: xr.Dataset) -> xr.Dataset:
    """Remove axes that the other archive does not have, at the value that it has."""
    given = members_of(other, "parameters")
    places = {}
    for dim in map(str, one.dims):
        if dim in other.dims or dim not in given or dim not in one.coords:
            continue
        near = np.flatnonzero(np.isclose(one[dim].values, given[dim], rtol=1e-9, atol=0.0))
        if near.size:
            places[dim] = int(near[0])
    return one.isel(places)
