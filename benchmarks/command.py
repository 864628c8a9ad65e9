"""What every command of this folder needs: its settings, its log, and its figures.

Figures of reliability are one file of JSON for each command, docs/reliability/NAME.json.
tools/reliability.py reads them; every part says when it was made, with which versions.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from sweeps.archive import provenance

__all__ = ["ROOT", "log", "part_file", "processor", "settings", "temporary_files_apart",
           "versions", "write_part"]  # fmt: skip

ROOT = Path(__file__).resolve().parents[1]

PROGRAM = Path(sys.executable).with_name("engine-dyn")

CPUS = os.cpu_count() or 1


def settings(
    module: str, doc: str | None, arguments: Sequence[str] | None = None, **known: Any
) -> argparse.Namespace:
    """Read a command line; a setting is known by its default.

    Parameters
    ----------
    module, doc : str
        Name of the command, and what it says of itself.
    arguments : sequence of str, optional
        The command line, unless it is that of the process.
    **known
        Settings by name. False: a switch. A list: some of its members, None where not given. A
        type: a value of that type, None where not given. Else the default, of its type.
        `output` is `-o` too.
    """
    parser = argparse.ArgumentParser(
        prog=f"python -m {module}", description=doc,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    for name, default in known.items():
        flags = ["--" + name.replace("_", "-")] + ["-o"] * (name == "output")
        if default is False:
            parser.add_argument(*flags, action="store_true")
        elif isinstance(default, list):
            parser.add_argument(*flags, action="extend", nargs="+", choices=default, metavar="NAME")
        elif isinstance(default, type):
            parser.add_argument(*flags, type=default)
        else:
            # A Path's own class depends on the system.
            kind = Path if isinstance(default, Path) else type(default)
            parser.add_argument(*flags, type=kind, default=default, help=f"default: {default}")
    return parser.parse_args(arguments)


def log(words: str) -> None:
    """Say what goes on."""
    print(f"{time.strftime('%H:%M:%S')}  {words}", file=sys.stderr, flush=True)


@contextmanager
def temporary_files_apart(among: str | Path | None = None) -> Iterator[str]:
    """Keep temporary files of this process, and of all that it starts, in a folder that is removed.

    Processes that are killed leave theirs behind. `among` is where the folder is made.
    """
    before, named = tempfile.tempdir, os.environ.get("TMPDIR")
    with tempfile.TemporaryDirectory(dir=among, ignore_cleanup_errors=True) as folder:
        tempfile.tempdir = os.environ["TMPDIR"] = folder
        try:
            yield folder
        finally:
            tempfile.tempdir = before
            del os.environ["TMPDIR"]
            os.environ.update({} if named is None else {"TMPDIR": named})


# Figures ------------------------------------------------------------------------------------------


def processor() -> str:
    """Name of the processor."""
    cpus = Path("/proc/cpuinfo")
    lines = cpus.read_text("utf-8").splitlines() if cpus.is_file() else []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor() or platform.machine())


def versions(*names: str) -> str:
    """Versions of Python and of packages; those that are not installed are left out."""
    found = [f"Python {platform.python_version()}"]
    for name in names:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    return ", ".join(found)


def part_file(name: str) -> Path:
    """Where the figures of a command lie."""
    return ROOT / "docs" / "reliability" / f"{name}.json"


def write_part(path: Path, figures: dict[str, Any]) -> None:
    """Write figures, with the day, the machine and the versions that they belong to."""
    about = {
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "system": f"{sys.platform}, {CPUS} processors",
        "python": platform.python_version(),
        "versions": {name: provenance.version(name) for name in provenance.PACKAGES},
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps({**about, **figures}, indent=1, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")
