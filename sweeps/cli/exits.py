"""How a command ends: its exit status, and one line on stderr for each failure."""

from __future__ import annotations

import functools
import importlib.metadata
import os
import re
import sys
import traceback
from collections.abc import Callable, Iterable
from typing import Any, NoReturn

import click

from sweeps.base.errors import SceneError, as_name, no_laboratory, one_line, printable

FAILURE, BAD_INPUT, DESIGNS_FAILED = 1, 2, 3

LONGEST_MESSAGE = 2000  # Largest number of characters of a message about bad input


def say(text: object, *, err: bool = False) -> None:
    """Print a text, parts of which may come from files: what steers a terminal is escaped."""
    click.echo(printable(str(text)), err=err)


def tell(line: object, *, err: bool = False) -> None:
    """Print one line, whatever names of files are in it: line ends in them are escaped too."""
    click.echo(as_name(line), err=err)


def terminal_width() -> int:
    """Characters of a line of the terminal.

    Where the output is no terminal, those that the variable COLUMNS tells, else as many as a row
    needs: programs that read a table find each row on one line.
    """
    import shutil

    if sys.stdout.isatty():
        return shutil.get_terminal_size().columns
    told = os.environ.get("COLUMNS", "")
    return int(told) if re.fullmatch(r"[1-9][0-9]{0,5}", told) else 100_000


def open_closed_streams() -> None:
    """Give the null device to every standard stream that the caller has closed.

    The next file that is opened would get its number, and messages of libraries would be written
    into an archive; Python itself has no object for such a stream, so that printing fails.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            # The new handle gets the lowest free number, which is that of the closed stream.
            os.open(os.devnull, os.O_RDWR)
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(number, "w" if number else "r", closefd=False))


def warn(lines: Iterable[str]) -> None:
    """Print plausibility warnings on stderr, one line each."""
    for line in lines:
        tell(f"warning: {line}", err=True)


def announce_compiling(quiet: bool) -> None:
    """Print one line when kernels must be compiled, which takes a while; nothing if `quiet`."""
    from engine_dyn.compilation import COMPILING, on_compiling

    on_compiling(lambda: None if quiet else click.echo(COMPILING, err=True))


def end(message: str, exit_status: int) -> NoReturn:
    """Print one line on stderr and exit."""
    tell(f"engine-dyn: {message}", err=True)
    sys.exit(exit_status)


def guarded(function: Callable[..., Any]) -> Callable[..., Any]:
    """Turn the exceptions of a command into one line on stderr and an exit status."""

    @click.option("--debug", is_flag=True, help="Show the traceback of a failure.")
    @functools.wraps(function)
    def command(*args: Any, debug: bool, **options: Any) -> None:
        try:
            os.getcwd()
        except OSError:
            end("the current folder no longer exists; change to another folder", BAD_INPUT)
        try:
            function(*args, **options)
        except (click.ClickException, click.exceptions.Exit, click.Abort, BrokenPipeError):
            raise
        except KeyboardInterrupt:
            end("interrupted; nothing was written", FAILURE)
        except Exception as error:
            if debug:
                traceback.print_exc()
            end(*_message_and_status(error))

    return command


def _message_and_status(error: Exception) -> tuple[str, int]:
    if isinstance(error, SceneError):
        text = one_line(error, sys.maxsize)
        if len(text) > LONGEST_MESSAGE:  # The reason stands at the end of a message
            text = f"{text[: LONGEST_MESSAGE // 2]}...{text[-LONGEST_MESSAGE // 2 :]}"
        return text, BAD_INPUT
    missing = no_laboratory(error) if isinstance(error, ModuleNotFoundError) else None
    if missing is not None:
        return missing, FAILURE
    if isinstance(error, MemoryError):
        reason = one_line(error, 200)
        return f"out of memory{f' ({reason})' if reason else ''}", FAILURE
    return f"failed: {type(error).__name__}: {one_line(error)} (--debug shows where)", FAILURE


NAMESAKE = "sweeps"  # Name in the package index of another package, by Weights & Biases

_PAGE = "see 'Another package named sweeps' on the page 'Install'"


def replaced() -> str:
    """One line where `import sweeps` gives another package's module, or none; otherwise empty."""
    module = sys.modules["sweeps"]  # Importing it would make this file depend on all its modules
    if "read_scene" in getattr(module, "__all__", ()):
        return ""
    what = f"another package's, {module.__file__}" if module.__file__ else "gone"
    return (
        f"engine-dyn's module sweeps is {what}: packages '{NAMESAKE}' and 'engine-dyn' exclude "
        f"each other. Run: pip uninstall {NAMESAKE}, then install engine-dyn with "
        f"--force-reinstall; {_PAGE}"
    )


def replacing() -> str:
    """One line where this package has replaced the module of the other one; otherwise empty."""
    try:
        other = importlib.metadata.distribution(NAMESAKE)
    except importlib.metadata.PackageNotFoundError:
        return ""
    return (
        f"package '{NAMESAKE}' {other.version} is installed beside engine-dyn, and both install a "
        "module sweeps: that package no longer works here, and uninstalling it breaks engine-dyn; "
        f"{_PAGE}"
    )
