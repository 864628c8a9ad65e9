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
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from sweeps.running.archive import provenance

ROOT = Path(__file__).resolve().parents[1]

PROGRAM = Path(sys.executable).with_name("engine-dyn")

CPUS = os.cpu_count() or 1


def settings(
    name: str, doc: str | None, arguments: Sequence[str] | None, **known: Any
) -> argparse.Namespace:
    """Read a command line; a setting is known by its default.

    Parameters
    ----------
    name, doc : str
        Name of the command, and what it says of itself.
    arguments : sequence of str, optional
        The command line, unless it is that of the process.
    **known
        Settings by name. False: a switch. A list: some of its members, None where not given. A
        type: a value of that type, None where not given. Else the default, of its type.
        `output` is `-o` too.
    """
    parser = argparse.ArgumentParser(
        prog=f"python -m benchmarks {name}".strip(), description=doc,
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


def campaign(
    name: str, doc: str | None, arguments: Sequence[str], work: Callable[..., dict[str, Any]],
    among: str | Path | None = None, **known: Any,
) -> int:  # fmt: skip
    """Run a campaign in a folder of its own, and write what it found into a file of figures.

    Parameters
    ----------
    name, doc, arguments, **known
        See `settings`; `output` is the file, docs/reliability/NAME.json unless given.
    work : callable
        From a folder and the settings to figures. Their "wrong" is what should not be: a list of
        lines, or a count.
    among : path, optional
        Where the folder of temporary files is made.

    Returns
    -------
    int
        The exit status: 1 where something was wrong.
    """
    file = ROOT / "docs" / "reliability" / f"{name.replace('-', '_')}.json"
    given = settings(name, doc, arguments, **known, output=file)
    with temporary_files_apart(among) as folder:
        found = work(Path(folder), given)
    about = {
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "system": f"{sys.platform}, {CPUS} processors",
        "python": platform.python_version(),
        "versions": {name: provenance.version(name) for name in provenance.PACKAGES},
    }
    text = json.dumps({**about, **found}, indent=1, ensure_ascii=False)
    given.output.parent.mkdir(parents=True, exist_ok=True)
    given.output.write_text(text + "\n", encoding="utf-8")
    print(f"{text}\n{given.output}")
    return 1 if found["wrong"] else 0
