"""A netCDF file is read once from end to end in a process of its own, before this one opens it.

The libraries of netCDF and HDF5 may run for ever on a damaged file, deaf to Ctrl-C, or end the
process. In a child with limits of time and memory that does no harm: only what the child has read
is opened here. Time alone is limited on Windows, which has no such limits, and on macOS, which
refuses one of memory.
"""

from __future__ import annotations

import errno
import math
import os
import signal
import subprocess
import sys
from pathlib import Path

from sweeps.errors import one_line

__all__ = ["MEMORY", "REFUSED", "SECONDS", "limit", "read_apart"]

SECONDS = 10.0
"""Time that reading may take, beside that for the bytes of the file."""

RATE = 10e6
"""Bytes a second that are read at least; compressed values are slower than others."""

MEMORY = 3 << 30
"""Bytes of addresses that the child may use; its libraries map some hundred megabytes."""

REFUSED = 65
"""Exit status of a child that says why the file is refused."""


def read_apart(path: Path) -> None:
    """Read a netCDF file in a process of its own, its metadata and all values.

    Raises
    ------
    OSError
        Where that fails, or does not end in time.
    """
    absolute = os.path.abspath(path)
    seconds = SECONDS + os.stat(absolute).st_size / RATE
    # No module may come from the working folder, which need not be the user's own. Freed memory is
    # overwritten, so that a library that uses it fails here and not later.
    words = [sys.executable, "-P", "-m", "sweeps.reading.netcdf_whole", absolute, str(seconds)]
    environment = {
        **os.environ, "OPENBLAS_NUM_THREADS": "1", "MALLOC_PERTURB_": "165",
        "PYTHONPATH": os.pathsep.join(p for p in sys.path if os.path.isabs(p)),
    }  # fmt: skip
    try:
        done = subprocess.run(
            words, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, timeout=3.0 * seconds, cwd=os.path.dirname(absolute),
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise _refusal(f"reading it takes longer than {3.0 * seconds:.0f} s") from None
    if done.returncode == REFUSED:
        raise _refusal(one_line(done.stdout.decode("utf-8", "replace"), 200))
    if done.returncode == -getattr(signal, "SIGXCPU", 0) and done.returncode:
        raise _refusal(f"reading it takes more than {seconds:.0f} s")
    if done.returncode:
        raise _refusal(f"reading it ends the process with status {done.returncode}")


def _refusal(reason: str) -> OSError:
    return OSError(errno.EINVAL, f"damaged: {reason}")


def limit(seconds: float, memory: int = MEMORY) -> None:
    """Limit what this process may take from now on; memory of 0 is not limited."""
    try:
        import resource
    except ImportError:  # Windows
        return
    for what, most in (
        (resource.RLIMIT_CPU, math.ceil(seconds)),
        (resource.RLIMIT_AS, memory or resource.RLIM_INFINITY),
        (resource.RLIMIT_CORE, 0),
    ):
        if sys.platform == "darwin" and what == resource.RLIMIT_AS:
            continue  # not run: macOS is said to refuse less than a process maps
        _, hard = resource.getrlimit(what)
        if most != resource.RLIM_INFINITY and hard != resource.RLIM_INFINITY:
            most = min(most, hard)
        resource.setrlimit(what, (most, hard))
