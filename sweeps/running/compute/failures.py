"""The end of a run that is interrupted, or whose disk or workers fail."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from sweeps.base.errors import NAMED_BADLY, one_line, size_text
from sweeps.running.archive.partial import Partial
from sweeps.running.compute.cluster import Lost
from sweeps.running.compute.options import Stopped


def remove_folder(folder: Partial, output: Path) -> None:
    """Remove the folder of an archive that is finished; `Stopped` where that is not possible."""
    try:
        folder.remove()
    except OSError as error:
        raise Stopped(
            f"{output}: is complete, but {folder.path} cannot be removed "
            f"({one_line(error.strerror or error, 200)})"
        ) from None


@contextmanager
def stopped_by_failures(output: Path, remains: Callable[[], str]) -> Iterator[None]:
    """Raise `Stopped` where what is done here is interrupted, or the disk or the workers fail.

    `remains` says what is left of the run, and how to go on.
    """
    try:
        yield
    except KeyboardInterrupt:
        raise Stopped(f"interrupted; {remains()}") from None
    except Lost as error:
        raise Stopped(f"{error}; {remains()}") from None
    # Where a disk fails, netCDF4 raises one of these errors.
    except (OSError, RuntimeError, AttributeError) as error:
        # Errors of netCDF do not tell whether the disk is to blame.
        of_disk = isinstance(error, OSError) and error.errno not in NAMED_BADLY
        if not of_disk and "NetCDF" not in str(error):
            raise
        reason = one_line(getattr(error, "strerror", None) or error, 200)
        with suppress(OSError):
            reason += f"; {size_text(shutil.disk_usage(output.parent).free)} are free"
        raise Stopped(f"{output}: cannot be written ({reason}); {remains()}") from None
