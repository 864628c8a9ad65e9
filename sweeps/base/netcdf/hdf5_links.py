"""Whether a netCDF-4 file leads to other files: HDF5 can store values and variables elsewhere.

It is asked by the process that reads a file first (`sweeps.base.netcdf.netcdf_whole`), which a
damaged file may end here.

The netCDF library silently follows external links, external storage and virtual datasets to any
file, so a file of somebody else could be made to expose private data. netCDF offers no way to
detect this, so HDF5 itself is asked, in the copy that netCDF4 has loaded; where that copy is not
found, the check is skipped.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

__all__ = ["external_member", "follows_indexes"]

MOST_MEMBERS = 1000  # Variables, dimensions and groups that a file may have

_HARD_LINK, _SOFT_LINK, _VIRTUAL = 0, 1, 3

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
        return ""  # not HDF5, or damaged: netCDF says so
    found: list[str] = []
    try:
        _look(library, file, found, [MOST_MEMBERS])
    finally:
        library.H5Fclose(file)
    return found[0] if found else ""


def follows_indexes() -> bool:
    """Whether `external_member` can do its work here."""
    return _library() is not None


def _look(library: Any, file: int, found: list[str], left: list[int]) -> None:
    """Add the first member that is stored elsewhere, of any group; groups may be nested."""
    groups = [b"/"]

    def each(parent: int, name: bytes, about: Any, _: Any) -> int:
        kind = about[0]
        left[0] -= 1
        if kind not in (_HARD_LINK, _SOFT_LINK) or left[0] < 0:
            found.append(name.decode("utf-8", "replace"))
            return 1
        member = library.H5Gopen2(parent, name, 0)
        if member >= 0:
            library.H5Gclose(member)
            # One that holds itself is met again under a longer name, until none is left.
            groups.append(here + name + b"/")
        elif _dataset_is_external(library, parent, name):
            found.append(name.decode("utf-8", "replace"))
        return 1 if found else 0

    call = _EACH(each)
    while groups and not found:
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
        library.H5Dget_storage_size(dataset)  # which is the sum over all chunks
        return library.H5Pget_layout(made) == _VIRTUAL or library.H5Pget_external_count(made) > 0
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
    """Declare the functions that are used; hid_t has 64 bits since HDF5 1.10."""
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
    # Failures are handled here; HDF5 would print a traceback of its own.
    library.H5Eset_auto2.argtypes = [number, ctypes.c_void_p, ctypes.c_void_p]
    library.H5Eset_auto2(0, None, None)
    return library
