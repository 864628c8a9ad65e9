"""A process that reads each netCDF file in a fork of itself, before the child of a command does.

To start a child again after every file that it refuses takes a fifth of a second. This process has
loaded no more than reading needs, so that a fork of it is cheap.
"""

from __future__ import annotations

import atexit
import json
import os
import signal
import sys
import time
from contextlib import suppress
from functools import cache
from pathlib import Path
from subprocess import Popen

import psutil

from sweeps.base.files.child_process import started
from sweeps.base.netcdf.netcdf_child import OPENING
from sweeps.base.netcdf.netcdf_whole import follows_indexes, read_all

__all__ = ["read_in_fork"]

SECONDS = 0.5
"""Seconds of the processor that a fork may read a file."""


def read_in_fork(path: Path, whole: bool) -> None:
    """Read a file in a fork; OSError where that could not."""
    process = _process(os.getpid())
    assert process.stdin and process.stdout
    with suppress(BrokenPipeError):
        process.stdin.write(json.dumps([str(path), whole]) + "\n")
        process.stdin.flush()
    answer = process.stdout.readline()
    if not answer:
        raise EOFError("the process whose forks read files has ended")
    if answer != "0\n":
        raise OSError(22, "damaged: a fork could not read it")


@cache
def _process(owner: int) -> Popen[str]:
    """Return the process whose forks read files for this one."""
    process = started("benchmarks.fuzz.forks", encoding="ascii")
    atexit.register(_end, process, owner)
    return process


def _end(process: Popen[str], owner: int) -> None:
    if owner == os.getpid():
        with process:  # waits for it, when its input is closed
            process.kill()


def _status(path: Path, whole: bool) -> int:
    """Status of a fork that reads a file: 0 where it could."""
    most = psutil.Process().memory_info().rss + OPENING
    child = os.fork()
    if not child:
        status = 1
        try:
            read_all(path, SECONDS, whole, lambda: None)
            status = 0
        finally:
            os._exit(status)
    watched = psutil.Process(child)
    while not (ended := os.waitpid(child, os.WNOHANG))[0]:
        time.sleep(0.002)
        if watched.memory_info().rss > most:
            os.kill(child, signal.SIGKILL)
    return ended[1]


def main() -> None:
    """Read the files that come as lines; answer the status of each fork."""
    answers = os.fdopen(os.dup(1), "w", encoding="ascii")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # the libraries may print
    follows_indexes()  # loads them, so that forks need not
    for line in sys.stdin:
        path, whole = json.loads(line)
        print(_status(Path(path), whole), file=answers, flush=True)


if __name__ == "__main__":
    main()
