"""What must hold for hostile input: taken, or refused in one line; nothing else is written."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click.testing

from benchmarks.fuzz.sandbox import sandbox
from sweeps.cli.main import main as command
from sweeps.errors import SceneError

__all__ = ["COUNTS", "in_one_line", "read_hostile", "refused_or_taken", "unchanged"]

COUNTS: Counter[str] = Counter()


def refused_or_taken(work: Callable[[], Any]) -> bool:
    """Do something with hostile input; whether it was taken.

    What is no refusal in one printable line goes up.
    """
    try:
        work()
    except SceneError as error:
        text = str(error)
        assert text.isprintable(), text
        assert 10 < len(text) < 5000, text
        COUNTS["refused"] += 1
        return False
    COUNTS["taken"] += 1
    return True


def read_hostile(name: str, data: bytes, read: Callable[[Path], Any]) -> bool:
    """Read hostile bytes as a file in the folder of scenes; whether they were taken."""
    path = sandbox() / "scenes" / name
    path.unlink(missing_ok=True)
    path.write_bytes(data)
    with unchanged(sandbox()):
        return refused_or_taken(lambda: read(path))


@contextmanager
def unchanged(*folders: Path) -> Iterator[None]:
    """Nothing in some folders may change."""
    before = _listing(folders)
    yield
    assert _listing(folders) == before, "something was written elsewhere"


def _listing(folders: tuple[Path, ...]) -> list[tuple[str, int, int]]:
    found = ((path, path.lstat()) for folder in folders for path in folder.rglob("*"))
    return sorted((str(path), s.st_size, s.st_mtime_ns) for path, s in found)


def in_one_line(*arguments: Any) -> None:
    """Run a command; where it refuses, in one line and with status 2."""
    result = click.testing.CliRunner().invoke(command, [str(a) for a in arguments])
    if result.exit_code not in (0, 2) and result.exception is not None:
        raise AssertionError(f"{arguments}: {result.exit_code}: {result.stderr}") from (
            result.exception
        )
    text = result.stderr + result.stdout
    assert "Traceback" not in text, text
    if result.exit_code == 2:
        last = result.stderr.rstrip("\n").splitlines()[-1]
        assert last.startswith(("engine-dyn: ", "Error: ")), result.stderr
        assert last.isprintable(), result.stderr
        own = [line for line in result.stderr.splitlines() if line.startswith("engine-dyn: ")]
        assert len(own) <= 1 and (not own or len(result.stderr.splitlines()) == 1), result.stderr
    COUNTS["taken" if result.exit_code == 0 else "refused"] += 1
