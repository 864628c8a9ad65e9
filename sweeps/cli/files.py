"""Files as commands use them: outputs that can be written, archives that can be read."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sweeps.base.errors import NAMED_BADLY, SceneError, one_line
from sweeps.cli.exits import FAILURE, end, tell

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.scene.model import Scene


def files_of(scene: Scene) -> Iterator[Path]:
    """Files that a scene is made of, as far as they are on this disk; the scene itself first."""
    if scene.path is not None:
        yield scene.path
    yield from map(Path, scene.files)
    table = (scene.source.get("designs") or {}).get("file")
    if isinstance(table, str):
        yield Path(scene.folder) / table
    if scene.measured is not None:
        yield from scene.measured.paths


def check_output(path: Path, overwrite: bool, *inputs: Path) -> None:
    """Refuse, before anything is computed, an output that could not be written or is an input.

    It may exist if `overwrite`; the first of the `inputs` is what the user named.
    """
    try:
        str(path.absolute()).encode()
    except UnicodeEncodeError:
        raise SceneError(f"{path}: the name must be UTF-8, or netCDF cannot write it") from None
    try:
        if path.is_dir():
            raise SceneError(f"{path}: is a folder; -o must name a file")
        if path.exists():
            if not path.is_file():
                raise SceneError(f"{path}: is a pipe or a device; -o must name a file")
            for given in inputs:
                if given.exists() and path.samefile(given):
                    what = "the scene itself" if given == inputs[0] else "read by the scene"
                    raise SceneError(f"{path}: is {what}; -o must name another file")
        if os.path.lexists(path) and not overwrite:
            raise SceneError(f"{path}: exists; use --overwrite to replace it")
        _check_name(path)
        _check_near(path.parent, path, *(given.parent for given in inputs))
        _try_writing(path.parent)
    except SceneError:
        raise
    except (OSError, ValueError) as error:
        raise not_written(path, error) from None


OTHER_FORMATS = {
    "engine-dyn export writes tables": (".csv", ".xlsx", ".parquet", ".mat"),
    "engine-dyn report writes pages": (".html",),
    "engine-dyn plot draws figures": (".png", ".pdf", ".svg"),
    "archives end in .nc": (".json", ".toml", ".txt"),
}
"""Endings of files that are no archives, with what the user may have wanted."""


def check_archive_output(path: Path, overwrite: bool, *inputs: Path) -> None:
    """Refuse what `check_output` refuses, and the ending of another format than netCDF."""
    check_output(path, overwrite, *inputs)
    for meant, endings in OTHER_FORMATS.items():
        if path.suffix.lower() in endings:
            raise SceneError(f"{path}: -o must name another file, such as out.nc; {meant}")


def same_file(one: Path, other: Path) -> bool:
    """Whether two paths are of one file that exists."""
    try:
        return one.samefile(other)
    except (OSError, ValueError):  # A file does not exist, or no file can have such a name
        return False


def check_folder(folder: Path) -> None:
    """Refuse, before anything is computed, a folder in which no file could be written."""
    try:
        if folder.exists() and not folder.is_dir():
            raise SceneError(f"{folder}: is a file; -o must name a folder for the figures")
        _check_name(folder)
        _check_near(folder.parent, folder)
        _try_writing(folder)
    except SceneError:
        raise
    except (OSError, ValueError) as error:
        raise not_written(folder, error) from None


def _check_name(path: Path) -> None:
    """Raise OSError for a name that no file can have; Python 3.14 calls such a file absent."""
    with suppress(FileNotFoundError, NotADirectoryError):
        path.lstat()


def _check_near(folder: Path, path: Path, *homes: Path) -> None:
    """Refuse missing folders of `path` that are more likely a slip of the pen than meant.

    Any number of them is made below the current folder, that of the input, the user's own and that
    of temporary files; elsewhere one, but none at the root of the file system.
    """
    missing = [one for one in (folder.resolve(), *folder.resolve().parents) if not one.exists()]
    if not missing:
        return
    above = missing[-1].parent
    near = [home.resolve() for home in (Path(), Path.home(), Path(tempfile.gettempdir()), *homes)]
    single = len(missing) == 1 and above != above.parent
    if not single and not any(above.is_relative_to(home) for home in near):
        raise SceneError(
            f"{path}: the folder {missing[-1]} does not exist; make it first, or name a folder "
            "below the current one"
        )


def _try_writing(folder: Path) -> None:
    """Write a file in a folder, or in the nearest one above it that exists, and remove it."""
    while not folder.exists():
        folder = folder.parent
    # Permissions are not enough: a file system can be read-only even for the owner of the folder.
    with tempfile.TemporaryFile(dir=folder):
        pass


def not_written(path: Path, error: Exception) -> SceneError:
    """Return the error that says why a file cannot be written."""
    reason = getattr(error, "strerror", None) or error
    return SceneError(f"{path}: cannot be written ({one_line(reason)})")


@contextmanager
def writing(output: Path) -> Iterator[None]:
    """Tell how the writing of an output failed, or where it was stopped."""
    from sweeps.running.compute.options import Stopped

    try:
        yield
    except Stopped as error:
        end(one_line(error, 2000), FAILURE)
    except OSError as error:
        if error.errno in NAMED_BADLY:
            raise not_written(output, error) from None
        # A folder, or a file next to the output, may be the one that could not be written.
        what = error.filename if isinstance(error.filename, str) else ""
        named = f"{one_line(what, 300)}: " if what not in ("", str(output)) else ""
        reason = one_line(error.strerror or error, 200)
        end(f"{output}: cannot be written ({named}{reason})", FAILURE)


def write_archive(dataset: xr.Dataset, output: Path | None, overwrite: bool) -> None:
    """Write what was computed, where an output is given."""
    from sweeps.running.archive.netcdf import write

    if output is not None:
        with writing(output):
            write(dataset, output, overwrite=overwrite)


@contextmanager
def opened(path: Path) -> Iterator[xr.Dataset]:
    """Open an archive for reading; whatever fails while it is open is told as its fault."""
    from sweeps.decide.explore.opening import open as open_any

    with open_any(path) as dataset, _blamed(path):
        yield dataset


@contextmanager
def opened_to_print(path: Path) -> Iterator[xr.Dataset]:
    """Open an archive as `opened` does, without xarray."""
    from sweeps.running.archive.stored_dataset import stored_dataset

    with stored_dataset(path) as dataset, _blamed(path):
        yield dataset


@contextmanager
def _blamed(path: Path) -> Iterator[None]:
    """Report errors in a block as faults of an archive."""
    # Archives of other programs, or damaged ones, may hold anything under names of quantities.
    try:
        yield
    except (SceneError, MemoryError, click.exceptions.Exit):
        raise
    except Exception as error:
        if isinstance(error, OSError) and (error.errno or 0) > 0:
            raise  # Errors of netCDF itself have numbers below 0
        raise SceneError(
            f"{path}: cannot be read as an archive of `run`: {type(error).__name__}: "
            f"{one_line(error, 200)} (--debug shows where)"
        ) from error


def check_slices(dataset: xr.Dataset, *given: Mapping[str, float | str]) -> None:
    """Say which values of axes are not in an archive, so that the nearest ones are taken.

    A value outside its axis is refused.
    """
    from sweeps.view.texts.tables import nearest_notes

    for values in given:
        for note in nearest_notes(dataset, values):
            tell(note, err=True)
