"""netCDF files are read in a process of their own before this one opens them.

The libraries of netCDF and HDF5 may run for ever on a damaged file, deaf to Ctrl-C, take all memory
or end the process. In a child with limits of time and memory that does no harm: only what the child
has read is opened here. Its memory is watched from here: where the system refused it some, the
libraries would hide that, take the file, and fill the memory of this process in turn.

No file is spared, whatever its header says. Archives with a seal of whoever wrote them, opened
without a child, would be the other way. But whoever forges an archive forges a seal without a
secret; a secret must be kept in a place of its own, and is not there on the next computer; and to
find damage, all bytes must be read. The child is simpler, and as cheap: it is started once and
stays, so that every file but the first costs some milliseconds. Of an archive's
results it reads the first chunk of each, and all of them with `--untrusted`
(`sweeps.base.netcdf.netcdf_whole`).
"""

from __future__ import annotations

import atexit
import errno
import json
import os
import signal
import threading
from contextlib import suppress
from pathlib import Path

import psutil

from sweeps.base.errors import one_line
from sweeps.base.files.child_process import Limits, started, watched

SECONDS = 10.0  # Seconds that reading may take, besides those for the bytes of the file

# Smallest speed of reading that is waited for [bytes/s]; compressed values are read more slowly
# than others
RATE = 10e6

OPENING = 1 << 29
"""Bytes of memory that the child may take to open a file and its attributes, besides eight times
the size of the file; its libraries need a fifth of it."""

MEMORY = 3 << 30  # Bytes of memory that the child process may take to read values

OPENED = "opened\n"  # Line of the child process before it reads the values of a file


class _Child:
    """A process that reads the files whose paths it gets."""

    def __init__(self) -> None:
        self.owner = os.getpid()
        self.files = 0
        self.limits = Limits(0, 0.0)
        self.process = started("sweeps.base.netcdf.netcdf_whole", encoding="ascii")

    def read(self, path: str, size: int, whole: bool) -> str | None:
        """Let it read a file; why that is refused, "" where it is not, None where it ends."""
        process = self.process
        seconds = _seconds(size)
        assert process.stdin and process.stdout
        self.files += 1
        limits = self.limits = Limits(OPENING + 8 * size, 3.0 * seconds)
        with suppress(psutil.Error):
            limits.most += psutil.Process(process.pid).memory_info().rss
        with watched(process, limits):
            try:
                process.stdin.write(json.dumps([path, seconds, whole]) + "\n")
                process.stdin.flush()
                answer = process.stdout.readline()
                if answer == OPENED:
                    limits.most += MEMORY
                    answer = process.stdout.readline()
            except OSError:  # The child has ended
                answer = ""
        return str(json.loads(answer)) if answer else None

    def end(self) -> int:
        """End it; its exit status."""
        process = self.process
        assert process.stdin and process.stdout
        process.kill()
        status = process.wait()
        process.stdout.close()
        with suppress(OSError):  # Closing writes what the child has not taken
            process.stdin.close()
        return status


_children: list[_Child] = []
"""The child of this process, and the children of the processes that it was forked from."""

_LOCK = threading.Lock()


def _renew() -> None:
    """Make a new lock after a fork: a thread that no longer exists may have held the old one."""
    global _LOCK
    _LOCK = threading.Lock()


if hasattr(os, "register_at_fork"):  # Windows has no forks
    os.register_at_fork(after_in_child=_renew)


def start() -> None:
    """Start the child if there is none, so that it is ready when a file is to be read."""
    with _LOCK:
        _child()


def read_apart(path: Path, whole: bool = False) -> None:
    """Read a netCDF file in a process of its own: its metadata, and values.

    `whole` says whether the results of an archive are read too. Raises OSError where reading fails,
    or does not end in time.
    """
    absolute = os.path.abspath(path)
    with _LOCK:
        reason = _answer(absolute, os.stat(absolute).st_size, whole)
    if reason:
        raise OSError(errno.EINVAL, one_line(reason, 200))


def _child() -> _Child:
    """The child of this process."""
    if not _children or _children[-1].owner != os.getpid():
        _children.append(_Child())
    return _children[-1]


def _answer(path: str, size: int, whole: bool) -> str:
    """Reason why a file is refused; "" where it is read."""
    child = _child()
    reason = None
    try:
        reason = child.read(path, size, whole)
    finally:
        if reason != "":  # A refused file may have done harm to the child
            _children.remove(child)
            status = child.end()
    if reason is not None:
        return reason
    if status == -getattr(signal, "SIGXCPU", 0) and status:
        return f"damaged: reading it takes more than {_seconds(size):.0f} s"
    if child.limits.ended_for:
        return f"damaged: reading it takes {child.limits.ended_for}"
    if child.files > 1:  # The child was ended while it waited, or an earlier file did harm to it
        return _answer(path, size, whole)
    return f"damaged: reading it ends the process with status {status}"


def _seconds(size: int) -> float:
    """Seconds that reading a file of a size may take."""
    return SECONDS + size / RATE


@atexit.register
def _end() -> None:
    while _children:
        child = _children.pop()
        if child.owner == os.getpid():
            child.end()
