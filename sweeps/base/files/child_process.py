"""Processes of their own, in which foreign files are read: limits of time and memory end them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

import psutil

from sweeps.base.errors import SceneError, size_text

REFUSED = b"refused "  # Beginning of an answer that says why a file is refused


@dataclass
class Limits:
    """Bytes and seconds that a process may take, and why it was ended; "" where it was not."""

    most: int
    seconds: float
    ended_for: str = ""


def started(module: str, *arguments: str, encoding: str | None = None) -> subprocess.Popen[str]:
    """Start a module of ours as a process; its input and output are bytes without an encoding."""
    # No module may come from the working folder, which need not be the user's own. Freed memory is
    # overwritten, so that a library that goes on using it fails in the child process, and not later
    # in this one.
    environment = {
        **os.environ, "OPENBLAS_NUM_THREADS": "1", "MALLOC_PERTURB_": "165",
        "PYTHONPATH": os.pathsep.join(p for p in sys.path if os.path.isabs(p)),
    }  # fmt: skip
    return subprocess.Popen(
        [sys.executable, "-P", "-m", module, *arguments], env=environment,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        cwd=os.path.abspath(os.sep), encoding=encoding,
    )  # fmt: skip


@contextmanager
def watched(process: subprocess.Popen[str], limits: Limits) -> Iterator[None]:
    """Kill a process that takes more than its limits, which may grow meanwhile."""
    done = threading.Event()
    watch = threading.Thread(target=_watch, args=(process, limits, done))
    watch.start()
    try:
        yield
    finally:
        done.set()
        watch.join()


def _watch(process: subprocess.Popen[str], limits: Limits, done: threading.Event) -> None:
    last = time.monotonic() + limits.seconds
    with suppress(psutil.Error):
        seen = psutil.Process(process.pid)
        while not done.wait(0.01):  # Seconds between two looks at the memory of the child
            if time.monotonic() > last:
                limits.ended_for = f"longer than {limits.seconds:.0f} s"
            elif seen.memory_info().rss > limits.most:
                limits.ended_for = f"more than {size_text(limits.most)} of memory"
            if limits.ended_for:
                process.kill()
                return


def answer_apart(
    module: str, asked: str, data: bytes, limits: Limits, label: str, kind: str
) -> bytes:
    """Return what a module of ours, which calls `answering`, answers about a file.

    `asked` is the module's one argument, and `data` the file, which it gets as its input. The
    process may take `limits` beside twice the size of the file. `label` and `kind` are the file and
    its kind in messages, such as "an .xlsx file". What the module refuses, and a process that
    exceeds the limits or ends, is a `SceneError`.
    """
    process = started(module, asked)
    limits.most += 2 * len(data)
    with process, watched(process, limits):
        try:
            answer, _ = process.communicate(data)  # type: ignore[arg-type, unused-ignore]
        finally:
            process.kill()
    if limits.ended_for:
        raise SceneError(f"{label}: not {kind} to be read: it takes {limits.ended_for}")
    if not answer:
        raise SceneError(f"{label}: not {kind}, or a damaged one: reading it ends the process")
    made: bytes = answer  # type: ignore[assignment, unused-ignore]
    if made.startswith(REFUSED):
        raise SceneError(json.loads(made[len(REFUSED) :]))
    return made


def answering(answer: Callable[[], Iterable[bytes]]) -> None:
    """Write the parts of an answer, or why there is none, and nothing that libraries print."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    try:
        parts = answer()
    except SceneError as error:
        parts = [REFUSED, json.dumps(str(error)).encode()]
    for part in parts:
        answers.write(part)
    answers.close()
