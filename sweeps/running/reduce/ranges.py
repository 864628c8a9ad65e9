"""Archives are read a range at a time: they may be larger than memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from sweeps.running.archive.netcdf import slabs

if TYPE_CHECKING:
    import xarray as xr

RANGE = 8e6  # Bytes of each variable that are read at a time


def ranges(
    variables: Mapping[str, xr.Variable], dims: Sequence[str], shape: Sequence[int],
    limit: float = RANGE, *, in_order: bool = False,
    parts: Mapping[str, Callable[[npt.NDArray[Any], tuple[int, ...]], npt.NDArray[Any]]]
    | None = None,
) -> Iterator[tuple[tuple[int, ...], tuple[int, ...], dict[str, npt.NDArray[Any]]]]:  # fmt: skip
    """Read variables over some dimensions, a range at a time.

    Ranges consist of complete chunks of the file or, with `in_order`, follow the order of the
    values. `parts` says of variables that have further dimensions what makes one number of the
    values along these, such as ``np.fmax.reduce``.

    Yields
    ------
    tuple
        Where the range begins, its lengths, and the values of each variable, which broadcast to
        them.
    """
    chunks = (1,) * len(shape) if in_order else chunks_of(variables, dims, shape)
    for place in slabs(tuple(shape), chunks, 8, limit):
        inside = dict(zip(dims, place, strict=True))
        arrays = {}
        for name, variable in variables.items():
            own = {d: s for d, s in inside.items() if d in variable.dims}
            order = [d for d in dims if d in variable.dims]
            inner = [d for d in variable.dims if d not in dims]
            full = tuple(slice(None) if d in variable.dims else None for d in dims)
            axes = [variable.dims.index(d) for d in (*order, *inner)]
            values = variable.isel(own).values.transpose(axes)
            if inner and parts and name in parts:
                values = parts[name](values, tuple(range(len(order), values.ndim)))
            arrays[name] = values[full]
        begin = tuple(s.start for s in place)
        yield begin, tuple(s.stop - s.start for s in place), arrays


def chunks_of(
    variables: Mapping[str, xr.Variable], dims: Sequence[str], shape: Sequence[int]
) -> tuple[int, ...]:
    """Chunks in which the largest variable is stored, so that none is read twice."""
    largest = max(variables.values(), key=lambda v: v.size)
    stored = largest.encoding.get("chunksizes") or (1,) * largest.ndim
    chunk = dict(zip(largest.dims, stored, strict=True)) if len(stored) == largest.ndim else {}
    return tuple(max(1, min(int(chunk.get(d, 1)), n)) for d, n in zip(dims, shape, strict=True))
