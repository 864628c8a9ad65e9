"""Runs of the command, each in a process forked from one that has imported and compiled everything.

python -m benchmarks.faults.server, started by `Server` with the layer before libc. It reads one
request a line (JSON) and answers with the exit status of each: negative for a signal, as
`subprocess` has it, and `None` for a run that did not end in time.
"""

from __future__ import annotations

import atexit
import ctypes
import errno
import json
import os
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace, TracebackType
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[2]

LAYER = Path(__file__).with_name("layer.c")

BLOCK = 3e4
"""Bytes of a block at most: a few blocks of few designs."""

PATIENCE = 60.0
"""Seconds after which a run is taken for one that does not end."""

FAULTS = {"short": -1, "kill": -2, "kill after": -3, "full": -4}
"""Faults that are no errors; see layer.c."""


class Unavailable(Exception):
    """What is needed is not there; the message says what."""


def built(folder: Path) -> Path:
    """Compile the layer.

    Raises
    ------
    Unavailable
        Where that is not possible on this machine.
    """
    compiler = shutil.which("gcc")
    if compiler is None or not sys.platform.startswith("linux"):
        raise Unavailable("fault injection needs Linux and gcc")
    path = folder / "layer.so"
    done = subprocess.run(
        [compiler, "-shared", "-fPIC", "-O1", "-o", str(path), str(LAYER), "-ldl"],
        capture_output=True, text=True,
    )  # fmt: skip
    if done.returncode:
        raise Unavailable(f"the layer does not compile here: {done.stderr.strip()[:300]}")
    return path


class Outcome(NamedTuple):
    """What became of one run."""

    status: int | None  # of its exit; negative: the signal that ended it; None: it did not end
    output: str
    errors: str
    calls: list[str]  # below its folder: "open /out.nc.partial/lock", and so on
    hit: str  # the call that failed; empty where none did
    done: list[int]  # blocks that were reported finished


class Server:
    """The forking process; a context."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="faults-")
        self.folder = Path(self._folder.name).resolve()

    def __enter__(self) -> Server:
        layer = built(self.folder)
        environment = {
            **os.environ, "LD_PRELOAD": str(layer), "PYTHONPATH": str(ROOT),
            # Threads of OpenMP do not survive a fork.
            "NUMBA_THREADING_LAYER": "workqueue", "NUMBA_NUM_THREADS": "1",
        }  # fmt: skip
        self._process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.faults.server", str(layer)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment, cwd=ROOT,
        )  # fmt: skip
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:  # fmt: skip
        self._process.communicate()
        self._folder.cleanup()

    def run(
        self, arguments: Sequence[str], folder: Path, *, call: int = 0, fault: str = "",
        shadows: Path | None = None,
    ) -> Outcome:  # fmt: skip
        """Run the command in a folder, with a fault at the n-th call; 0: with none."""
        for name in ("out", "err", "calls", "done"):
            (self.folder / name).unlink(missing_ok=True)
        number = FAULTS[fault] if fault in FAULTS else getattr(errno, fault) if fault else 0
        request = {
            "arguments": arguments, "folder": str(folder), "call": call, "fault": number,
            "shadows": "" if shadows is None else str(shadows), "beside": str(self.folder),
        }  # fmt: skip
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        status = json.loads(self._process.stdout.readline())
        lines = [line.split(" ", 1)[1] for line in self._text("calls").splitlines()]
        hits = [line.removesuffix(" HIT") for line in lines if line.endswith(" HIT")]
        return Outcome(
            status, self._text("out"), self._text("err"),
            [line.removesuffix(" HIT") for line in lines], hits[0] if hits else "",
            [int(word) for word in self._text("done").split()],
        )  # fmt: skip

    def _text(self, name: str) -> str:
        path = self.folder / name
        return path.read_text(errors="replace") if path.exists() else ""


# --- in the process itself ----------------------------------------------------------------------


def _warm() -> None:
    """Import and compile all that the scenarios need, and stop the clocks that archives show."""
    import datetime

    import sweeps
    from benchmarks.faults.scenarios import SCENE
    from sweeps.cli import exits, files, main, running  # noqa: F401
    from sweeps.running.archive.partial import Partial
    from sweeps.running.compute import limits
    from sweeps.running.join import extend, merge  # noqa: F401

    limits.LARGEST_BLOCK = BLOCK
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "scene.toml"
        path.write_text(SCENE)
        sweeps.stream(path, Path(name) / "out.nc", threads=1)
    still: Any = SimpleNamespace(
        perf_counter=lambda: 0.0, strftime=lambda *_: "2000-01-01T00:00:00Z", gmtime=lambda: None
    )
    sys.modules["sweeps.running.compute.into_archive"].time = still  # type: ignore[attr-defined]

    class Still(datetime.datetime):
        @classmethod
        def now(cls, tz: Any = None) -> Any:
            return cls(2000, 1, 1, tzinfo=tz)

    sys.modules["sweeps.running.archive.provenance"].datetime = Still  # type: ignore[attr-defined]
    commands: Any = running
    commands._command_line = lambda *_: "engine-dyn"
    write = Partial.write

    def reported(self: Partial, number: int, arrays: Any) -> int:
        size = write(self, number, arrays)
        with open(_beside / "done", "a") as stream:
            stream.write(f"{number} ")
        return size

    Partial.write = reported  # type: ignore[method-assign]


_beside = Path()


def _child(request: dict[str, Any], layer: Any) -> int:
    """Run the command with the layer counting."""
    global _beside
    from sweeps.cli.main import main

    _beside = Path(request["beside"])
    for number, name in ((0, os.devnull), (1, _beside / "out"), (2, _beside / "err")):
        handle = os.open(name, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
        os.dup2(handle, number)
        os.close(handle)
    os.chdir(request["folder"])
    begin = (request["folder"], request["shadows"], str(_beside / "calls"))
    layer.faults_begin(
        *(text.encode() for text in begin), ctypes.c_long(request["call"]), request["fault"]
    )
    try:
        main(request["arguments"], prog_name="engine-dyn")
    except SystemExit as error:
        return error.code if isinstance(error.code, int) else 1
    return 0


def _end(status: int) -> None:
    """End a child as Python would, less the second that it takes to free its memory.

    Libraries do what they do at the end of a process, such as closing files.
    """
    threading._shutdown()  # type: ignore[attr-defined]
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    ctypes.CDLL(None).exit(status)


def _waited(process: int) -> int | None:
    """Exit status of a child; None where it had to be killed."""
    handle = os.pidfd_open(process)
    try:
        in_time, _, _ = select.select([handle], [], [], PATIENCE)
    finally:
        os.close(handle)
    if not in_time:
        os.kill(process, signal.SIGKILL)
    _, status = os.waitpid(process, 0)
    return os.waitstatus_to_exitcode(status) if in_time else None


def serve(library: str) -> int:
    """Answer requests until there are no more."""
    layer = ctypes.CDLL(library)
    layer.faults_begin.argtypes = [ctypes.c_char_p] * 3 + [ctypes.c_long, ctypes.c_int]
    _warm()
    while line := sys.stdin.readline():
        request = json.loads(line)
        process = os.fork()
        if not process:
            _end(_child(request, layer))
        print(json.dumps(_waited(process)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(serve(sys.argv[1]))
