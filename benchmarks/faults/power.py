"""What a failure of the power leaves: files as they were at their last fsync, or later.

The layer keeps shadows of what was synced. A file system may have written more than that, so there
are three rules: `drop` loses all that was not synced, names in folders too; `names` keeps every
name, but of the files only what was synced (so a renamed file that was not synced is empty);
`mixed` decides for each name and each file by lot.
"""

from __future__ import annotations

import os
import random
import shutil
from collections.abc import Callable
from pathlib import Path

RULES = ("drop", "names", "mixed")


def all_synced(folder: Path, shadows: Path) -> None:
    """Note a folder, and all that is in it, as synced."""
    shutil.rmtree(shadows, ignore_errors=True)
    shadows.mkdir()
    for path in (folder, *folder.rglob("*")):
        inode = path.stat().st_ino
        if path.is_dir():
            lines = (
                f"{p.stat().st_ino} {'d' if p.is_dir() else 'f'} {p.name}" for p in path.iterdir()
            )
            (shadows / f"{inode}.list").write_text("".join(f"{line}\n" for line in lines))
        else:
            shutil.copy(path, shadows / f"{inode}.data")
            os.link(path, shadows / f"{inode}.live")


def lose(folder: Path, shadows: Path, rule: str, seed: int) -> None:
    """Put a folder into the state that a failure of the power would leave."""
    chance = random.Random(seed)
    keep: dict[str, Callable[[], bool]] = {
        "drop": lambda: False, "names": lambda: True, "mixed": lambda: chance.random() < 0.5,
    }  # fmt: skip
    after = folder.with_name(f"{folder.name}.after")
    after.mkdir()
    _rebuild(folder, folder.stat().st_ino, shadows, after, rule, keep[rule])
    shutil.rmtree(folder)
    after.rename(folder)


def _rebuild(
    now: Path | None, inode: int, shadows: Path, to: Path, rule: str, keep: Callable[[], bool]
) -> None:
    """Make a folder from what was synced of it, and what is there now."""
    synced = _listed(shadows / f"{inode}.list")
    current = {} if now is None else {
        p.name: (p.stat().st_ino, "d" if p.is_dir() else "f") for p in now.iterdir()
    }  # fmt: skip
    for name in sorted(synced.keys() | current.keys()):
        old, new = synced.get(name), current.get(name)
        chosen = new if old != new and keep() else old
        if chosen is None:
            continue
        number, kind = chosen
        if kind == "d":
            (to / name).mkdir()
            there = now / name if now is not None and chosen == new else None
            _rebuild(there, number, shadows, to / name, rule, keep)
            continue
        data, live = shadows / f"{number}.data", shadows / f"{number}.live"
        if rule == "mixed" and keep() and live.exists():
            data = live
        (to / name).write_bytes(data.read_bytes() if data.exists() else b"")


def _listed(path: Path) -> dict[str, tuple[int, str]]:
    if not path.exists():
        return {}
    lines = (line.split(" ", 2) for line in path.read_text().splitlines())
    return {name: (int(inode), kind) for inode, kind, name in lines}
