"""Archives are opened, one or several as one; variables are read when used."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.types import Integers
from sweeps.base.arguments import a_path, check_dataset
from sweeps.base.dimensions import STATE, selected_places
from sweeps.base.errors import SceneError, one_line, shown
from sweeps.base.netcdf.netcdf_files import check_file, opened_archive
from sweeps.base.netcdf.netcdf_files import untrusted as apart_first
from sweeps.running.archive.netcdf import open_archive

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.running.join.places import Joined


def open(  # It shadows the built-in `open`, because users look for this name
    path: str | Path | Sequence[str | Path], *, untrusted: bool = False
) -> xr.Dataset:
    """Open an archive, or several of one scene as one; variables are read when used.

    Parameters
    ----------
    path : str, Path, or sequence of them
        An archive that `run` wrote; or all shards of a scene, or archives that differ in the values
        of one axis. These become one dataset, as `engine-dyn merge` would write it, without reading
        any results. What several of them hold is read from the first that has it; whether they
        agree is what `merge` checks.
    untrusted : bool
        Read all results too in a process of limited time and memory before a file is opened here,
        as is done anyway with all else that it holds.

    Returns
    -------
    Dataset
        It holds the files open until it is closed.

    Raises
    ------
    SceneError
        Where a file is missing, is no archive that `run` wrote, or does not belong to the others;
        later, where values that are used are damaged.

    Examples
    --------
    >>> import sweeps
    >>> done = sweeps.stream("first", "first.nc")
    >>> with sweeps.open("first.nc") as archive:
    ...     print(dict(archive.sizes))
    {'load': 3, 'inertia': 25}
    """
    with apart_first(untrusted):
        return _open(path)


def _open(path: str | Path | Sequence[str | Path]) -> xr.Dataset:
    if isinstance(path, str | Path):
        return _opened(Path(path))
    if not isinstance(path, Iterable):
        raise SceneError(f"path = {shown(path)}: must be the path of an archive or a list of them")
    paths = [a_path(each, "path") for each in path]
    if not paths:
        raise SceneError("open: no archive; must be a path or a list of at least one")
    if len(paths) == 1:
        return _opened(paths[0])
    for each in paths:
        check_file(each)
    from sweeps.running.archive.contents import read_contents

    # This module is imported late, since it loads all of the planning.
    from sweeps.running.join.places import find_places

    return _opened_as_one(find_places([read_contents(path) for path in paths]))


def _opened(path: Path) -> xr.Dataset:
    with opened_archive(path):  # Entering this context checks the file
        pass
    try:
        archive = open_archive(path)
        if STATE in archive:
            del archive[STATE]  # Only `merge` can read the state of a reduction
        return archive
    except MemoryError:
        raise
    except Exception as error:  # Attributes that xarray interprets may hold values of any type
        reason = getattr(error, "strerror", None) or error
        raise SceneError(f"{path}: not a netCDF archive ({one_line(reason, 200)})") from None


def _opened_as_one(joined: Joined) -> xr.Dataset:
    """Several archives as one dataset, whose variables stay in their files until they are read."""
    from xarray.core import indexing

    from sweeps.running.archive.labels import dataset_of
    from sweeps.running.archive.warnings import ATTRIBUTE, of_results

    labels = joined.labels()
    sources: list[xr.Dataset] = []

    def close() -> None:
        for source in sources:
            source.close()

    try:
        for archive in joined.archives:
            sources.append(_opened(archive.path))
        data: dict[str, Any] = {}
        for name in joined.plan.outputs:
            dims = labels.variables[name].dims
            for archive, source in zip(joined.archives, sources, strict=True):
                if name not in source or source[name].dims != dims:
                    raise SceneError(f"{archive.path}: has no {name} over ({', '.join(dims)})")
            variables = [source[name].variable for source in sources]
            if joined.axis in dims:
                lazy = _backend_array(variables, dims.index(joined.axis), joined.places)
                data[name] = indexing.LazilyIndexedArray(lazy)
            elif dims:
                every = np.arange(variables[0].shape[0])
                data[name] = indexing.LazilyIndexedArray(_backend_array(variables[:1], 0, [every]))
            else:
                data[name] = variables[0].values
        dataset = dataset_of(labels, data)
        lines = [str(source.attrs.get(ATTRIBUTE, "")).splitlines() for source in sources]
        about_results = dict.fromkeys(line for each in lines for line in of_results(each))
        dataset.attrs[ATTRIBUTE] = "\n".join([*labels.warnings, *about_results])
    except BaseException:
        close()
        raise
    dataset.set_close(close)
    return dataset


def _backend_array(variables: Sequence[xr.Variable], along: int, places: Sequence[Integers]) -> Any:
    """Variables of several files as one array that xarray reads when it is used."""
    # xarray itself joins files by dask, which need not be installed.
    from xarray.backends import BackendArray
    from xarray.core import indexing

    size = 1 + max(int(here.max()) for here in places)
    owner = np.full(size, -1)
    place = np.zeros(size, dtype=np.int64)
    for number in reversed(range(len(places))):  # Where archives overlap, the first one counts
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
        # A whole number in an index removes its dimension, which is done last, on return.
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
    """Consecutive places as a slice, which a file reads far more quickly; others as they are."""
    if (np.diff(places) == 1).all():
        return slice(int(places[0]), int(places[-1]) + 1)
    return places


def nearest(archive: xr.Dataset, **values: float | str) -> xr.Dataset:
    """Slice of an archive, nearest to values of its axes.

    Parameters
    ----------
    archive : Dataset
        As `open` or `run` returns it.
    **values : float or str
        A value of each axis to be cut, in the units of the archive, with a unit ("110 kW"), a
        fraction such as "1/200", or a word of an axis of words: `nearest(archive, load=50,
        method="newton")`. Of equally near values the first is taken. A word that looks like a
        number means itself: of the firing patterns "1" and "110", 1 is the first and 110 the
        second, wherever they stand; ``"#2"`` is the second place of an axis of words. Designs may
        also be named, `case="B"`, `engine="ntua"`: where several have that label, all of them stay.

    Returns
    -------
    Dataset
        With the coordinates of what was taken.

    Raises
    ------
    SceneError
        For a name that is no axis, and for values that are neither numbers nor words of the axis.

    Examples
    --------
    >>> import sweeps
    >>> archive = sweeps.run("first")
    >>> one = sweeps.nearest(archive, inertia=11.8, load=45)
    >>> float(one["inertia"]), float(one["load"])
    (12.0, 50.0)
    """
    check_dataset(archive)
    places = selected_places(archive, values)
    return archive.isel(
        {d: chosen[0] if len(chosen) == 1 else chosen for d, chosen in places.items()}
    )
