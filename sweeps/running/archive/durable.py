"""Names in folders that survive a loss of power.

Syncing a file makes its contents last, not its name: that is in its folder, which must be synced
too; and the name of a new folder is in the folder above it.
"""

from __future__ import annotations

import contextlib
import errno
import os
from pathlib import Path

__all__ = ["made_folder", "sync_folder"]

_NO_SUCH_THING = (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)
"""What file systems say that cannot sync folders, some of the network among them."""


def made_folder(path: Path) -> None:
    """Make a folder that may exist, and those above it, so that their names last."""
    if path.is_dir():
        return
    if path.parent != path:
        made_folder(path.parent)
    path.mkdir(exist_ok=True)
    sync_folder(path.parent)


def sync_folder(path: Path) -> None:
    """Make the names in a folder last, where the system can do that.

    Raises
    ------
    OSError
        Where it can, but failed: the names may be lost.
    """
    if not hasattr(os, "O_DIRECTORY"):
        return
    try:
        handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    except PermissionError:  # a folder that one may write to, but not read
        return
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in _NO_SUCH_THING:
            raise
    finally:
        with contextlib.suppress(OSError):  # nothing is lost by this
            os.close(handle)
