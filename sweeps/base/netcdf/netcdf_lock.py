"""The lock around netCDF's library, which crashes where two threads use it at once."""

from __future__ import annotations

import sys
import threading
from typing import Any

__all__ = ["netcdf_library"]


class _Library:
    """A lock that a thread may take several times, and that can be copied and pickled.

    It includes the lock that xarray has for files which others open by it. xarray reads attributes
    without any lock: so what is opened here by xarray is opened with this lock held, and has it as
    its own.
    """

    def __init__(self) -> None:
        self._own = threading.RLock()
        self._times = 0
        self._of_xarray: Any = None

    def __reduce__(self) -> str:
        return "netcdf_library"  # there is one in each process

    def acquire(self, blocking: bool = True) -> bool:
        """Take the lock; False where another thread has it and one does not wait."""
        if not self._own.acquire(blocking):
            return False
        if not self._times:
            # Whoever reads by xarray has imported it; to import it here would cost half a second.
            backend = sys.modules.get("xarray.backends.netCDF4_")
            self._of_xarray = getattr(backend, "NETCDF4_PYTHON_LOCK", None)
            if self._of_xarray is not None and not self._of_xarray.acquire(blocking):
                self._own.release()
                return False
        self._times += 1
        return True

    def release(self) -> None:
        """Give the lock back."""
        self._times -= 1
        if not self._times and self._of_xarray is not None:
            self._of_xarray.release()
        self._own.release()

    def __enter__(self) -> None:
        self.acquire()

    def __exit__(self, *_: object) -> None:
        self.release()


netcdf_library = _Library()  # Held while a thread uses netCDF4; a context
