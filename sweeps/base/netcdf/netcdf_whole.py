"""The child process that reads netCDF files: see `sweeps.base.netcdf.netcdf_child`.

A file is read from end to end. Of an archive, which says so by its attribute `scene`, the results
are left out but for the first chunk of each: they may be many gigabytes, and their damage is told
when they are used.

HDF5 can store values and variables in other files: external links, external storage and virtual
datasets, which the netCDF library follows silently, so a file of somebody else could be made to
expose private data. netCDF offers no way to detect this, so HDF5 itself is asked, in the copy that
netCDF4 has loaded, and follows the indexes of all chunks; where that copy is not found, the check
is skipped.
"""

from __future__ import annotations

import ctypes
import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext, suppress
from functools import cache
from pathlib import Path
from typing import Any

from sweeps.base.errors import one_line, size_text
from sweeps.base.netcdf.netcdf_child import OPENED
from sweeps.base.netcdf.netcdf_files import DAMAGE, LARGEST_RATIO, slabs


class _Refused(Exception):
    """A file that the library would accept, but this project does not."""


def read_all(path: Path, seconds: float, whole: bool, opened: Callable[[], object]) -> None:
    """Read a netCDF file, as far as it may be read; errors are those of the library.

    Reading may take `seconds` of the processor. `whole` says whether the results of an archive are
    read too; `opened` is called before values are read, which may take more memory.
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
        size = path.stat().st_size
        total = sum(math.prod(map(int, v.shape), start=_item_bytes(v)) for v in variables)
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
    """Variables of all groups; their attributes are read."""
    for owner in (group, *group.variables.values()):
        for name in owner.ncattrs():
            owner.getncattr(name)
    yield from group.variables.values()
    for inner in group.groups.values():
        yield from _variables(inner)


def _item_bytes(variable: Any) -> int:
    return int(getattr(variable.dtype, "itemsize", 16)) or 1


def _limit(seconds: float) -> None:
    """Limit the processor time that this process may take from now on."""
    try:
        import resource
    except ImportError:  # Windows has no such limits
        return
    most = math.ceil(time.process_time() + seconds)
    for what, soft in ((resource.RLIMIT_CPU, most), (resource.RLIMIT_CORE, 0)):
        _, hard = resource.getrlimit(what)
        resource.setrlimit(
            what, (soft if hard == resource.RLIM_INFINITY else min(soft, hard), hard)
        )


def _reason(path: Path, seconds: float, whole: bool, opened: Callable[[], object]) -> str:
    """Reason why a file is refused; "" where it is read."""
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
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # Text that libraries print leads nowhere

    def answer(line: str) -> None:
        answers.write(line)
        answers.flush()

    for line in sys.stdin:
        path, seconds, whole = json.loads(line)
        answer(json.dumps(_reason(Path(path), seconds, whole, lambda: answer(OPENED))) + "\n")
    os._exit(0)  # An ordinary exit could crash in the library


MOST_MEMBERS = 1000  # Variables, dimensions and groups that a file may have

_EACH = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.c_int64, ctypes.c_char_p, ctypes.POINTER(ctypes.c_int), ctypes.c_void_p
)


def external_member(path: Path) -> str:
    """Name of the first variable that is stored outside a file; empty where there is none.

    The index of the chunks of each variable is followed to its end.
    """
    library = _library()
    if library is None:
        return ""
    file = library.H5Fopen(os.fsencode(os.path.abspath(path)), 0, 0)
    if file < 0:
        return ""  # A file that is not HDF5, or damaged, is refused by netCDF itself
    members: list[str] = []
    try:
        _look(library, file, members, [MOST_MEMBERS])
    finally:
        library.H5Fclose(file)
    return members[0] if members else ""


def follows_indexes() -> bool:
    """Whether `external_member` can do its work here."""
    return _library() is not None


def _look(library: Any, file: int, members: list[str], left: list[int]) -> None:
    """Add the first member of any group that is stored in another file; groups may be nested."""
    groups = [b"/"]

    def each(parent: int, name: bytes, about: Any, _: Any) -> int:
        kind = about[0]
        left[0] -= 1
        if kind not in (0, 1) or left[0] < 0:  # The link is neither a hard nor a soft one
            members.append(name.decode("utf-8", "replace"))
            return 1
        member = library.H5Gopen2(parent, name, 0)
        if member >= 0:
            library.H5Gclose(member)
            # A group that contains itself is met again and again under longer names, until
            # `MOST_MEMBERS` members are counted.
            groups.append(here + name + b"/")
        elif _dataset_is_external(library, parent, name):
            members.append(name.decode("utf-8", "replace"))
        return 1 if members else 0

    call = _EACH(each)
    while groups and not members:
        here = groups.pop()
        group = library.H5Gopen2(file, here, 0)
        if group < 0:
            continue
        try:
            library.H5Literate(group, 0, 2, ctypes.byref(ctypes.c_uint64(0)), call, None)
        finally:
            library.H5Gclose(group)


def _dataset_is_external(library: Any, parent: int, name: bytes) -> bool:
    dataset = library.H5Dopen2(parent, name, 0)
    if dataset < 0:
        return False
    made = library.H5Dget_create_plist(dataset)
    try:
        library.H5Dget_storage_size(dataset)  # A damaged index of chunks shows here
        virtual = library.H5Pget_layout(made) == 3
        return virtual or library.H5Pget_external_count(made) > 0
    finally:
        library.H5Pclose(made)
        library.H5Dclose(dataset)


@cache
def _library() -> Any:
    """HDF5 library that netCDF4 has loaded; None where it is not found."""
    import netCDF4

    home = Path(netCDF4.__file__).parent
    places = (home.parent / "netCDF4.libs", home / ".dylibs", home.parent / "netcdf4.libs")
    names = [p for folder in places for p in sorted(folder.glob("*hdf5*")) if "_hl" not in p.name]
    try:
        mapped = Path("/proc/self/maps").read_text(errors="replace").splitlines()
        names += [
            Path(line.split(maxsplit=5)[5]) for line in mapped
            if "hdf5" in line and ".so" in line and "_hl" not in line
        ]  # fmt: skip
    except OSError:
        pass
    for name in names:
        try:
            return _typed(ctypes.CDLL(str(name)))
        except (OSError, AttributeError):
            continue
    return None


def _typed(library: Any) -> Any:
    """Declare the functions of HDF5 that are used; hid_t has 64 bits since HDF5 1.10."""
    number, text = ctypes.c_int64, ctypes.c_char_p
    iterate: list[Any] = [number, ctypes.c_int, ctypes.c_int, ctypes.c_void_p, _EACH]
    functions: dict[str, tuple[Any, list[Any]]] = {
        "H5Fopen": (number, [text, ctypes.c_uint, number]),
        "H5Gopen2": (number, [number, text, number]),
        "H5Dopen2": (number, [number, text, number]),
        "H5Dget_create_plist": (number, [number]),
        "H5Dget_storage_size": (ctypes.c_uint64, [number]),
        "H5Pget_layout": (ctypes.c_int, [number]),
        "H5Pget_external_count": (ctypes.c_int, [number]),
        **{name: (ctypes.c_int, [number]) for name in ("H5Fclose", "H5Gclose")},
        **{name: (ctypes.c_int, [number]) for name in ("H5Dclose", "H5Pclose")},
    }
    for name, (result, arguments) in functions.items():
        function: Callable[..., Any] = getattr(library, name)
        function.restype, function.argtypes = result, arguments  # type: ignore[attr-defined]
    new = "H5Literate1" if hasattr(library, "H5Literate1") else "H5Literate"
    library.H5Literate = getattr(library, new)
    library.H5Literate.restype = ctypes.c_int
    library.H5Literate.argtypes = [*iterate, ctypes.c_void_p]
    library.H5open()
    # Failures are handled here; HDF5 would print a traceback.
    library.H5Eset_auto2.argtypes = [number, ctypes.c_void_p, ctypes.c_void_p]
    library.H5Eset_auto2(0, None, None)
    return library


if __name__ == "__main__":
    main()
