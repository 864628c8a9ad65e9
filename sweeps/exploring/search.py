"""Archives are read as one, lazily; designs are found in them: nearest, best, the Pareto front.

What searches an archive reads it a range at a time: it may be larger than memory.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.status import MEANINGS, has_numbers
from engine_dyn.types import Floats, Integers
from sweeps.archive.netcdf import open_archive, slabs
from sweeps.errors import SceneError, counted, not_known, one_line, plain_number, shown
from sweeps.reading.netcdf_files import check_file, opened_archive

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.joining.merge import Parts

__all__ = ["Constraint", "best", "constraint", "nearest", "open", "pareto", "ranges"]

RANGE = 8e6
"""Bytes of each variable that are searched at a time, about."""

FRONT = "front"
"""Dimension along which the designs of a Pareto front lie."""


def open(path: str | Path | Sequence[str | Path]) -> xr.Dataset:  # the name that a person looks for
    """Open an archive, or several of one scene as one; variables are read when used.

    Parameters
    ----------
    path : str, Path, or sequence of them
        An archive that `run` wrote; or all shards of a scene, or archives that differ in the values
        of one axis. These become one dataset, as `engine-dyn merge` would write it, without reading
        any results. What several of them hold is read from the first that has it; whether they
        agree is what `merge` checks.

    Returns
    -------
    Dataset
        It holds the files open until it is closed.

    Raises
    ------
    SceneError
        Where a file is missing, is no archive that `run` wrote, or does not belong to the others.
    """
    if isinstance(path, str | Path):
        return _opened(Path(path))
    paths = [Path(p) for p in path]
    if not paths:
        raise SceneError("open: no archive; must be a path or a list of at least one")
    if len(paths) == 1:
        return _opened(paths[0])
    for each in paths:
        check_file(each)
    from sweeps.joining.merge import together  # which brings the whole planner

    return _joined(together(paths))


def _opened(path: Path) -> xr.Dataset:
    with opened_archive(path):  # looks at it before anything is read
        pass
    try:
        return open_archive(path)
    except Exception as error:  # attributes that xarray takes as orders are of any kind
        reason = getattr(error, "strerror", None) or error
        raise SceneError(f"{path}: not a netCDF archive ({one_line(reason, 200)})") from None


# --- several archives as one ----------------------------------------------------------------------


def _joined(parts: Parts) -> xr.Dataset:
    """One dataset of several archives, whose variables are read where they lie."""
    from xarray.core import indexing

    from sweeps.archive.labels import dataset_of
    from sweeps.running.into_archive import Options

    labels = parts.labels(Options(single=parts.archives[0].single))
    sources: list[xr.Dataset] = []

    def close() -> None:
        for source in sources:
            source.close()

    try:
        for archive in parts.archives:
            sources.append(_opened(archive.path))
        data: dict[str, Any] = {}
        for name in parts.plan.outputs:
            dims = labels.variables[name].dims
            for archive, source in zip(parts.archives, sources, strict=True):
                if name not in source or source[name].dims != dims:
                    raise SceneError(f"{archive.path}: has no {name} over ({', '.join(dims)})")
            variables = [source[name].variable for source in sources]
            if parts.axis in dims:
                lazy = _backend_array(variables, dims.index(parts.axis), parts.places)
                data[name] = indexing.LazilyIndexedArray(lazy)
            elif dims:
                every = np.arange(variables[0].shape[0])
                data[name] = indexing.LazilyIndexedArray(_backend_array(variables[:1], 0, [every]))
            else:
                data[name] = variables[0].values
        joined = dataset_of(labels, data)
    except BaseException:
        close()
        raise
    joined.set_close(close)
    return joined


def _backend_array(variables: Sequence[xr.Variable], along: int, places: Sequence[Integers]) -> Any:
    """Variables of several files as one array that xarray reads when it is used.

    xarray's own way to join files is dask, which need not be installed.
    """
    from xarray.backends import BackendArray
    from xarray.core import indexing

    size = 1 + max(int(here.max()) for here in places)
    owner = np.full(size, -1)
    place = np.zeros(size, dtype=np.int64)
    for number in reversed(range(len(places))):  # the first that has a point
        owner[places[number]] = number
        place[places[number]] = np.arange(len(places[number]))
    kind = variables[0].dtype
    dims = variables[0].dims

    class Joined(BackendArray):
        dtype = kind
        shape = tuple(size if i == along else n for i, n in enumerate(variables[0].shape))

        def __getitem__(self, key: Any) -> Any:
            return indexing.explicit_indexing_adapter(
                key, self.shape, indexing.IndexingSupport.OUTER, _read
            )

    def _read(key: tuple[Any, ...]) -> npt.NDArray[Any]:
        # Whole numbers take a dimension away, and come last.
        ranges = [np.arange(n)[k] for n, k in zip(Joined.shape, key, strict=True)]
        points = np.atleast_1d(ranges[along])
        values = np.empty(
            [len(points) if i == along else np.size(r) for i, r in enumerate(ranges)], dtype=kind
        )
        others = {
            d: k if isinstance(k, slice) else np.atleast_1d(k)
            for i, (d, k) in enumerate(zip(dims, key, strict=True))
            if i != along
        }
        for number, variable in enumerate(variables):
            mine = np.flatnonzero(owner[points] == number)
            if mine.size:
                here = _slice_of(place[points[mine]])
                inside: tuple[Any, ...] = (slice(None),) * along + (mine,)
                values[inside] = variable.isel({**others, dims[along]: here}).values
        return values[tuple(0 if np.ndim(r) == 0 else slice(None) for r in ranges)]

    return Joined()


def _slice_of(places: Integers) -> Any:
    """Return places that follow each other as a range: a file reads that far more quickly."""
    if (np.diff(places) == 1).all():
        return slice(int(places[0]), int(places[-1]) + 1)
    return places


# --- slices ---------------------------------------------------------------------------------------


def nearest(archive: xr.Dataset, **values: float | str) -> xr.Dataset:
    """Slice of an archive, nearest to values of its axes.

    Parameters
    ----------
    archive : Dataset
        As `open` or `run` returns it.
    **values : float or str
        A value of each axis to be cut, in the units of the archive, or a word of an axis of words:
        `nearest(archive, load=50, method="newton")`. Of equally near values the first is taken;
        a design is also told by its name, `case="B"`.

    Returns
    -------
    Dataset
        With the coordinates of what was taken.

    Raises
    ------
    SceneError
        For what is no axis, no number, or no word of the axis.
    """
    places: dict[str, int] = {}
    for name, value in values.items():
        dimension, place = _place_of(archive, name, value)
        if dimension in places:
            raise SceneError(f"{name}: the axis {dimension} is cut twice; give one value of it")
        places[dimension] = place
    return archive.isel(places)


def words_of(archive: xr.Dataset) -> dict[str, str]:
    """Coordinates of words: by which name a value of each is given."""
    return {
        str(name).removesuffix("_name") if f"{coordinate.dims[0]}_name" == name else str(name): str(
            name
        )
        for name, coordinate in archive.coords.items()
        if coordinate.ndim == 1 and coordinate.dtype.kind in "UOT"
    }


def _place_of(archive: xr.Dataset, name: str, value: float | str) -> tuple[str, int]:
    words = words_of(archive)
    if name in words:
        texts = [str(text) for text in archive[words[name]].values]
        if value not in texts:
            raise SceneError(f"{name} = {shown(value)}: unknown{not_known(str(value), texts)}")
        return str(archive[words[name]].dims[0]), texts.index(str(value))
    axes = [str(d) for d in archive.dims if d in archive.coords]
    if name not in axes:
        known = [*words, *(a for a in axes if a not in words)]
        raise SceneError(f"{name}: not an axis of the archive{not_known(name, known)}")
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        raise SceneError(f"{name} = {shown(value)}: must be a finite number")
    if not math.isfinite(value):
        raise SceneError(f"{name} = {value}: must be a finite number")
    return name, int(np.argmin(np.abs(archive[name].values - value)))


# --- designs --------------------------------------------------------------------------------------

_COMPARISONS: Mapping[str, Callable[[Any, Any], Any]] = {
    "<=": operator.le,
    ">=": operator.ge,
    "<": operator.lt,
    ">": operator.gt,
}


@dataclass(frozen=True)
class Constraint:
    """One condition on designs.

    Attributes
    ----------
    name : str
        A quantity or an axis.
    sign : str
        One of <=, >=, <, >.
    limit : float
        In the units of the archive.
    """

    name: str
    sign: str
    limit: float

    def __str__(self) -> str:
        return f"{self.name} {self.sign} {self.limit:.6g}"

    def holds(self, values: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
        """Where it does; never for NaN."""
        return np.asarray(_COMPARISONS[self.sign](values, self.limit))


def constraint(text: str) -> Constraint:
    """Read a condition such as "delta <= 1/150".

    Raises
    ------
    SceneError
        For anything but a name, a sign, and a number or a fraction of two.
    """
    found = re.fullmatch(r"\s*(\w+)\s*(<=|>=|<|>)\s*([^/\s]+)\s*(?:/\s*([^/\s]+)\s*)?", text)
    try:
        if found is None:
            raise ValueError
        limit = plain_number(found[3]) / plain_number(found[4] or "1")
        if not math.isfinite(limit):
            raise ValueError
    except (ValueError, ZeroDivisionError):
        raise SceneError(
            f"condition {shown(text)}: must be a name, one of <= >= < >, and a number, such as "
            "'delta <= 1/150'"
        ) from None
    return Constraint(found[1], found[2], limit)


def best(
    archive: xr.Dataset, *, least: str | None = None, most: str | None = None,
    within: str | Sequence[str] = (),
) -> xr.Dataset:  # fmt: skip
    """Find the design with the least, or most, of a quantity, under conditions.

    Parameters
    ----------
    archive : Dataset
        As `open` or `run` returns it; it may be larger than memory.
    least, most : str
        A quantity or an axis; one of the two.
    within : str or sequence of str
        Conditions such as "delta <= 1/150", all of which must hold.

    Returns
    -------
    Dataset
        The archive at that design; the first of several. Axes on which none of the names depends
        stay. Designs that failed are none.

    Raises
    ------
    SceneError
        For names that the archive has not or that have more than one value a design, and where no
        design fulfils the conditions.
    """
    if (least is None) == (most is None):
        raise SceneError("best: needs one of least and most")
    name, sign = (least, 1.0) if least is not None else (str(most), -1.0)
    conditions = _conditions(within)
    found, smallest = -1, math.inf
    search = _Search(archive, [name], conditions)
    for places, (values,) in search.designs():
        here = int(np.argmin(sign * values))
        if found < 0 or sign * values[here] < smallest:
            found, smallest = int(places[here]), sign * float(values[here])
    if found < 0:
        raise SceneError(search.nothing())
    at = np.unravel_index(found, search.shape)
    return archive.isel({d: int(i) for d, i in zip(search.dims, at, strict=True)})


def pareto(
    archive: xr.Dataset, first: str, second: str, *, most: str | Sequence[str] = (),
    within: str | Sequence[str] = (),
) -> xr.Dataset:  # fmt: skip
    """Pareto front of two quantities: the designs that no other beats in both.

    Parameters
    ----------
    archive : Dataset
        As `open` or `run` returns it; it may be larger than memory.
    first, second : str
        Quantities or axes, of which less is better.
    most : str or sequence of str
        Those of the two of which more is better.
    within : str or sequence of str
        Conditions such as "delta <= 1/150", all of which must hold.

    Returns
    -------
    Dataset
        The archive at these designs, along a new dimension `front`, the best in `first` first.
        Designs that are equal in both are all in it. Axes on which none of the names depends stay.

    Raises
    ------
    SceneError
        As `best`.
    """
    import xarray as xr

    if first == second:
        raise SceneError(f"pareto: {first} stands there twice; needs two quantities")
    largest = [most] if isinstance(most, str) else list(most)
    for name in largest:
        if name not in (first, second):
            raise SceneError(f"pareto: most = {shown(name)}: must be {first} or {second}")
    signs = [-1.0 if name in largest else 1.0 for name in (first, second)]
    search = _Search(archive, [first, second], _conditions(within))
    front = np.empty((2, 0))
    found = np.empty(0, dtype=np.int64)
    for places, values in search.designs():
        here = np.array([s * v for s, v in zip(signs, values, strict=True)])
        left = _unbeaten(front, here)
        both = np.hstack([front, here[:, left]])
        kept = front_of(*both)
        front, found = both[:, kept], np.concatenate([found, places[left]])[kept]
    if not found.size:
        raise SceneError(search.nothing())
    if not search.shape:
        return archive.expand_dims(FRONT)
    at = np.unravel_index(found, search.shape)
    return archive.isel({d: xr.Variable((FRONT,), i) for d, i in zip(search.dims, at, strict=True)})


def front_of(first: npt.NDArray[Any], second: npt.NDArray[Any]) -> Integers:
    """Positions of the pairs that no other is below in one number and not above in the other.

    In order of the first number, equal ones as they come. Sorting takes O(n log n), the rest O(n).
    Source: Kung, Luccio and Preparata (1975), On finding the maxima of a set of vectors, section 2.
    """
    order = np.lexsort((second, first))
    if not order.size:
        return order
    one, other = first[order], second[order]
    below = np.minimum.accumulate(np.concatenate([[math.inf], other[:-1]]))
    # Of pairs that are equal, which follow each other, all are what the first is.
    new = np.concatenate([[True], (np.diff(one) != 0.0) | (np.diff(other) != 0.0)])
    kept = (other < below)[np.flatnonzero(new)][np.cumsum(new) - 1]
    return np.asarray(order[kept], dtype=np.int64)


def _unbeaten(front: Floats, pairs: Floats) -> npt.NDArray[np.bool_]:
    """Which pairs no pair of a front is below in the second number, and not above in the first.

    Quicker than sorting them: the second number falls along a front.
    """
    if not front.size:
        return np.ones(pairs.shape[1], dtype=bool)
    before = np.searchsorted(front[0], pairs[0], side="right") - 1
    return np.asarray((before < 0) | (pairs[1] <= front[1][before]))


def _conditions(within: str | Sequence[str]) -> list[Constraint]:
    return [constraint(text) for text in ([within] if isinstance(within, str) else within)]


class _Search:
    """All designs of an archive with the values of some names, a range at a time."""

    def __init__(
        self, archive: xr.Dataset, names: Sequence[str], conditions: Sequence[Constraint]
    ) -> None:
        self.names = list(names)
        self.conditions = list(conditions)
        known = [*self.names, *(c.name for c in self.conditions)]
        for name in known:
            _check_name(archive, name)
        self.variables = {name: archive[name].variable for name in known}
        used = {d for v in self.variables.values() for d in v.dims}
        if "status" in archive and used.issuperset(archive["status"].dims):
            # What failed has no numbers anyway, but those of the axes.
            self.variables["status"] = archive["status"].variable
        self.dims = tuple(str(d) for d in archive.dims if d in used)
        self.shape = tuple(archive.sizes[d] for d in self.dims)
        self.alone = [0] * len(self.conditions)
        self.solved = 0

    def designs(self) -> Iterator[tuple[Integers, list[npt.NDArray[Any]]]]:
        """Places of the designs that fulfil all conditions, and their values of the names."""
        for begin, extent, arrays in ranges(self.variables, self.dims, self.shape):
            good = np.ones(extent, dtype=bool)
            for name in self.variables:
                if name == "status":
                    good &= np.isin(arrays[name], _WITH_NUMBERS)
                else:
                    good &= np.isfinite(arrays[name])
            self.solved += int(good.sum())
            kept = good.copy()
            for number, condition in enumerate(self.conditions):
                holds = good & condition.holds(arrays[condition.name])
                self.alone[number] += int(holds.sum())
                kept &= holds
            if kept.any():
                yield (
                    self._places(kept, begin),
                    [np.broadcast_to(arrays[n], extent)[kept].reshape(-1) for n in self.names],
                )

    def _places(self, kept: npt.NDArray[np.bool_], begin: tuple[int, ...]) -> Integers:
        """Return numbers of designs in the whole."""
        inside = np.flatnonzero(kept)
        if not kept.shape:
            return inside
        at = np.unravel_index(inside, kept.shape)
        whole = tuple(i + b for i, b in zip(at, begin, strict=True))
        return np.asarray(np.ravel_multi_index(whole, self.shape), dtype=np.int64)

    def nothing(self) -> str:
        """Why there is no design, in words."""
        told = f"{counted(self.solved, 'design')} of {math.prod(self.shape)} with numbers"
        if not self.conditions:
            return f"no design has a value of {' and '.join(self.names)}"
        each = ", ".join(f"{c} by {n}" for c, n in zip(self.conditions, self.alone, strict=True))
        return f"no design fulfils all conditions; of {told}, {each}"


_WITH_NUMBERS = [code for code in range(len(MEANINGS)) if has_numbers(code)]


def _check_name(archive: xr.Dataset, name: str) -> None:
    """Check that a name has one number a design."""
    from engine_dyn.quantities.graph import DIMENSIONS

    known = [str(n) for n, v in archive.variables.items() if v.dtype.kind in "iuf"]
    if name not in known:
        raise SceneError(f"{shown(name)}: not in the archive{not_known(name, known)}")
    curve = [str(d) for d in archive[name].dims if d in DIMENSIONS]
    if curve:
        raise SceneError(
            f"{name}: not one number a design, it is over {', '.join(curve)}; take one first, such "
            f"as its largest with .max('{curve[0]}'), or cut it with sweeps.nearest"
        )


def ranges(
    variables: Mapping[str, xr.Variable], dims: Sequence[str], shape: Sequence[int],
    limit: float = RANGE, *, in_order: bool = False,
) -> Iterator[tuple[tuple[int, ...], tuple[int, ...], dict[str, npt.NDArray[Any]]]]:  # fmt: skip
    """Read variables over some dimensions, a range at a time.

    Ranges are whole chunks of the file, or, `in_order`, follow each other as the values do.

    Yields
    ------
    tuple
        Where the range begins, its lengths, and the values of each variable, which broadcast to
        them.
    """
    chunks = (1,) * len(shape) if in_order else _chunks(variables, dims, shape)
    for place in slabs(tuple(shape), chunks, 8, limit):
        inside = dict(zip(dims, place, strict=True))
        arrays = {}
        for name, variable in variables.items():
            own = {d: s for d, s in inside.items() if d in variable.dims}
            read = variable.isel(own)
            order = [d for d in dims if d in variable.dims]
            full = tuple(slice(None) if d in variable.dims else None for d in dims)
            arrays[name] = read.transpose(*order).values[full]
        begin = tuple(s.start for s in place)
        yield begin, tuple(s.stop - s.start for s in place), arrays


def _chunks(
    variables: Mapping[str, xr.Variable], dims: Sequence[str], shape: Sequence[int]
) -> tuple[int, ...]:
    """Chunks in which the largest variable is stored, so that none is read twice."""
    largest = max(variables.values(), key=lambda v: v.size)
    stored = largest.encoding.get("chunksizes") or (1,) * largest.ndim
    chunk = dict(zip(largest.dims, stored, strict=True)) if len(stored) == largest.ndim else {}
    return tuple(max(1, min(int(chunk.get(d, 1)), n)) for d, n in zip(dims, shape, strict=True))
