"""The child process that reads a netCDF file from end to end: see `sweeps.reading.netcdf_child`."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sweeps.errors import one_line, size_text
from sweeps.reading.netcdf_child import MEMORY, REFUSED, limit
from sweeps.reading.netcdf_files import LARGEST_RATIO, check_chunks, opened_unchecked, slabs

__all__ = ["main", "read_all"]


def read_all(path: Path) -> None:
    """Read a netCDF file from end to end, as far as it may be read.

    Raises
    ------
    OSError, ValueError, RuntimeError and others
        As the library does.
    """
    size = path.stat().st_size
    with opened_unchecked(path) as file:
        variables = list(_variables(file))
        total = sum(_bytes_of(variable) for variable in variables)
        if total > LARGEST_RATIO * size:
            raise OSError(
                errno.EINVAL, f"variables of {size_text(total)} in a file of {size_text(size)}"
            )
        for variable in variables:
            variable.set_auto_maskandscale(False)
            item = _item_bytes(variable)
            check_chunks(variable, item, str(path))
            chunks = variable.chunking()
            if not isinstance(chunks, list) or not all(chunks):
                chunks = [1] * len(variable.shape)
            for place in slabs(variable.shape, tuple(chunks), item):
                variable[place if place else ...]


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


def main() -> None:
    """Read the file that the command line names, with the seconds it may take."""
    limit(float(sys.argv[2]))
    try:
        read_all(Path(sys.argv[1]))
        status, reason = 0, ""
    except MemoryError:
        status, reason = REFUSED, f"reading it takes more than {size_text(MEMORY)} of memory"
    except Exception as error:
        status, reason = REFUSED, one_line(getattr(error, "strerror", None) or error, 200)
    sys.stdout.write(reason)
    sys.stdout.flush()
    os._exit(status)  # the library may not survive its own end


if __name__ == "__main__":
    main()
