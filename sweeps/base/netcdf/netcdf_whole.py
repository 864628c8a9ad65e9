"""The child process that reads netCDF files: see `sweeps.base.netcdf.netcdf_child`.

A file is read from end to end. Of an archive, which says so by its attribute `scene`, the results
are left out but for the first chunk of each: they may be many gigabytes, and their damage is told
when they are used. HDF5 has followed the indexes of their chunks (`sweeps.base.netcdf.hdf5_links`).
"""

from __future__ import annotations

import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import Any

from sweeps.base.errors import one_line, size_text
from sweeps.base.netcdf.hdf5_links import external_member, follows_indexes
from sweeps.base.netcdf.netcdf_child import OPENED
from sweeps.base.netcdf.netcdf_files import DAMAGE, LARGEST_RATIO, slabs

__all__ = ["main", "read_all"]


class _Refused(Exception):
    """What the library would take, but not this project."""


def read_all(path: Path, seconds: float, whole: bool, opened: Callable[[], object]) -> None:
    """Read a netCDF file, as far as it may be read.

    Parameters
    ----------
    path : Path
        The file.
    seconds : float
        Time that this may take, of the processor.
    whole : bool
        Whether the results of an archive are read too.
    opened : function
        Called before values are read, which may take more memory.

    Raises
    ------
    OSError, ValueError, RuntimeError and others
        As the library does.
    """
    import netCDF4

    _limit(seconds)
    name = external_member(path)
    if name:
        raise _Refused(
            f"'{one_line(name, 60)}' is stored outside the file, or held endlessly, perhaps by "
            "itself"
        )
    with netCDF4.Dataset(path) as file:
        variables = list(_variables(file))
        spared = not whole and "scene" in file.ncattrs() and follows_indexes()
        size, total = path.stat().st_size, sum(_bytes_of(variable) for variable in variables)
        if total > LARGEST_RATIO * size:
            raise _Refused(
                f"damaged: variables of {size_text(total)} in a file of {size_text(size)}"
            )
        opened()
        for variable in variables:
            variable.set_auto_maskandscale(False)
            chunks = variable.chunking()
            if not isinstance(chunks, list) or not all(chunks):
                chunks = [1] * len(variable.shape)
            first = spared and getattr(variable.dtype, "kind", "") in ("i", "u", "f")
            item = _item_bytes(variable)
            with suppress(*DAMAGE) if first else nullcontext():
                for place in slabs(variable.shape, tuple(chunks), item, 0.0 if first else None):
                    variable[place if place else ...]
                    if first:
                        break


def _variables(group: Any) -> Iterator[Any]:
    """Variables of all groups, when their attributes are read."""
    for owner in (group, *group.variables.values()):
        for name in owner.ncattrs():
            owner.getncattr(name)
    yield from group.variables.values()
    for inner in group.groups.values():
        yield from _variables(inner)


def _item_bytes(variable: Any) -> int:
    return int(getattr(variable.dtype, "itemsize", 16)) or 1


def _bytes_of(variable: Any) -> int:
    total = _item_bytes(variable)
    for length in variable.shape:
        total *= int(length)
    return total


def _limit(seconds: float) -> None:
    """Limit the time of the processor that this process may take from now on."""
    try:
        import resource
    except ImportError:  # Windows
        return
    most = math.ceil(time.process_time() + seconds)
    for what, soft in ((resource.RLIMIT_CPU, most), (resource.RLIMIT_CORE, 0)):
        _, hard = resource.getrlimit(what)
        resource.setrlimit(
            what, (soft if hard == resource.RLIM_INFINITY else min(soft, hard), hard)
        )


def _reason(path: Path, seconds: float, whole: bool, opened: Callable[[], object]) -> str:
    """Why a file is refused; "" where it is not."""
    try:
        read_all(path, seconds, whole, opened)
    except _Refused as error:
        return str(error)
    except MemoryError:
        return "damaged: there is not enough memory to read it"
    except Exception as error:
        return f"damaged: {one_line(getattr(error, 'strerror', None) or error, 200)}"
    return ""


def main() -> None:
    """Read the files that come as lines, each with the seconds it may take; answer in lines."""
    answers = os.fdopen(os.dup(1), "w", encoding="ascii")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # the libraries may print

    def answer(line: str) -> None:
        answers.write(line)
        answers.flush()

    for line in sys.stdin:
        path, seconds, whole = json.loads(line)
        answer(json.dumps(_reason(Path(path), seconds, whole, lambda: answer(OPENED))) + "\n")
    os._exit(0)  # the library may not survive its own end


if __name__ == "__main__":
    main()
