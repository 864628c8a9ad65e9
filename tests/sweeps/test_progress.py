"""Progress bars: on any terminal, soon, and going on while nothing is done."""

import contextlib
import fcntl
import os
import pty
import struct
import termios
import time

import pytest

import sweeps
from sweeps.running.compute import progress, reduced
from sweeps.running.compute.progress import progress_bar

HANG = 30
"""Seconds."""


def printed(columns: int, times: int, monkeypatch: pytest.MonkeyPatch) -> str:
    """What a bar writes on a terminal of so many columns until its count stands there so often."""
    monkeypatch.setattr(progress, "FIRST", 0.1)
    monkeypatch.setattr(progress, "BEAT", 0.05)
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    os.set_blocking(ours, False)
    text = ""

    def read() -> str:
        with contextlib.suppress(BlockingIOError):
            return os.read(ours, 100_000).decode(errors="replace")
        return ""

    with os.fdopen(theirs, "w") as terminal, progress_bar(total=10, file=terminal) as bar:
        bar.update(3)
        ends = time.monotonic() + HANG
        while text.count("3/10") < times and time.monotonic() < ends:
            time.sleep(0.02)
            text += read()
    os.set_blocking(ours, True)
    with contextlib.suppress(OSError):  # of a terminal whose other end is closed, when all is read
        while piece := os.read(ours, 100_000):
            text += piece.decode(errors="replace")
    os.close(ours)
    return text


@pytest.mark.parametrize("columns", [0, 80])
def test_a_bar_goes_on_while_nothing_is_counted(
    columns: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = printed(columns, 3, monkeypatch)
    assert text.count("3/10") >= 3
    assert text.endswith("\r") and not text.split("\r")[-2].strip()  # nothing is left of it


@pytest.mark.compiled
def test_a_reduction_counts_within_its_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    counts: list[int] = []
    bars = reduced.progress_bar

    def counted(**options: object) -> object:
        bar = bars(**options)
        update = bar.update
        bar.update = lambda n=1: (counts.append(n), update(n))
        return bar

    monkeypatch.setattr(reduced, "progress_bar", counted)
    sweeps.run(
        engine="ntua",
        axes={"inertia": [0.5 + 0.001 * i for i in range(3000)], "load": [30, 60, 90]},
        output={"quantities": ["delta"]},
        reduce={},
        progress=True,
    )
    assert sum(counts) == 9000 and sum(n > 0 for n in counts) > 1
