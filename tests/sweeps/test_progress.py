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


def printed(rows: int, columns: int, times: int, monkeypatch: pytest.MonkeyPatch) -> str:
    """What a bar writes on a terminal of this size until its count stands there so often.

    The terminal is the process's stderr, since tqdm asks only standard streams for their size.
    """
    monkeypatch.setattr(progress, "FIRST", 0.1)
    monkeypatch.setattr(progress, "BEAT", 0.05)
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
    os.set_blocking(ours, False)
    text = ""

    def read() -> str:
        with contextlib.suppress(BlockingIOError):
            return os.read(ours, 100_000).decode(errors="replace")
        return ""

    with os.fdopen(theirs, "w") as terminal:
        monkeypatch.setattr("sys.stderr", terminal)
        with progress_bar(total=10, file=terminal) as bar:
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


@pytest.mark.parametrize("size", [(0, 0), (0, 100), (24, 0), (24, 80)])
def test_a_bar_goes_on_while_nothing_is_counted(
    size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    text = printed(*size, 3, monkeypatch)
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


def test_blocks_are_counted_where_no_kernel_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    counts: list[int] = []
    bars = progress.progress_bar

    def counted(**options: object) -> object:
        bar = bars(**options)
        bar.update = counts.append
        return bar

    monkeypatch.setattr(progress, "progress_bar", counted)
    sweeps.run(
        engine="ntua",
        axes={"crank_ratio": [0.2, 0.25, 0.3]},
        output={"quantities": ["mean_piston_speed"]},
        progress=True,
    )
    assert sum(counts) == 3
