"""What an interrupted run has finished, as a text."""

from __future__ import annotations

import shlex
from pathlib import Path

from sweeps.base.errors import as_name, counted, one_line
from sweeps.running.archive.partial import Partial

__all__ = ["interrupted_run", "interrupted_text"]

LONGEST_LINE = 1000
"""Characters of a command line that is printed."""


def interrupted_run(path: Path) -> Path | None:
    """Return the folder of an interrupted run, if `path` is one or is an archive not yet there."""
    try:
        here = Partial(path) if path.exists() else Partial.of(path)
        if here.path.is_dir() and here.header() is None:
            here = here.adding()
        return here.path if here.path.is_dir() and here.header() is not None else None
    except (OSError, ValueError):
        return None


def interrupted_text(path: Path) -> str:
    """Describe an unfinished run: what is finished of it, and who computes it or how to go on."""
    here = Partial(path)
    about = here.header() or {}
    output = shlex.quote(str(path.parent / about["output"]))
    what, again = f"run of {about['output']}", f"engine-dyn run SCENE -o {output} --resume"
    if about["output"] == here.added.name:
        what, again = "extension of an archive", "the same command"
    writer = here.writer()
    state = f"{what}, which is being computed now by {writer}" if writer else f"interrupted {what}"
    lines = [
        f"{path}: {'an' if state[0] in 'ei' else 'a'} {state}",
        f"  title: {about['title']}",
        f"  designs: {about['designs']}",
        f"  finished: {len(here.finished())} of {counted(about['blocks'], 'block')}",
        f"  started: {about['started']}",
        f"  command line: {one_line(about['command_line'], LONGEST_LINE)}",
    ]
    if not writer:
        lines.append(f"  to go on: {one_line(about.get('resume_command', again), LONGEST_LINE)}")
    return "\n".join(map(as_name, lines))
