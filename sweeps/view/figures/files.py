"""Figures of an archive as files."""

from __future__ import annotations

import secrets
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

import xarray as xr

from sweeps.base.errors import SceneError, shown
from sweeps.view.figures.drawing import drawing
from sweeps.view.figures.options import Options

__all__ = ["FORMATS", "draw"]

FORMATS = ("png", "svg", "pdf")


def draw(
    dataset: xr.Dataset,
    folder: str | Path,
    format: str = "png",
    *,
    select: Mapping[str, float | str] | None = None,
    options: Options | None = None,
) -> list[Path]:
    """Draw every figure that an archive gives rise to.

    Parameters
    ----------
    dataset : xarray.Dataset
        An archive: axes of the study (or ``design``) and ``crank_angle`` as dimensions; variables
        with ``long_name``, ``units`` and, where there is one, ``symbol`` (text for matplotlib).
    folder : str or Path
        Where the files go; made if it is not there. Files of the same names are replaced when all
        figures are written; where that fails, nothing is left.
    format : {"png", "svg", "pdf"}
        PNG has 300 dots per inch.
    select : mapping of str to float or str, optional
        Slices: values of axes that are not to be drawn along, the nearest one is taken (for an
        axis of words the word itself). Axes that a figure has no room for and that are not named
        here are cut at the nominal design, the middle value or the first word. Either way the
        slice is stated in the title.
    options : Options, optional
        Kinds, style, size, crank angle and targets; `select` replaces its slices.

    Returns
    -------
    list of Path
        The files, in the order in which they were drawn.

    Raises
    ------
    SceneError
        For an unknown format or kind, for options that do not fit, and for an axis or a word in
        `select` that the archive lacks, or a number outside its axis.
    """
    if format not in FORMATS:
        raise SceneError(f"format is {shown(format)}, allowed: {', '.join(FORMATS)}")
    options = options or Options()
    if select is not None:
        options = replace(options, select=select)
    folder = Path(folder)
    metadata = {"png": {"Software": None}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
    with drawing(dataset, options) as figures, _together(folder) as unfinished:
        for stem, figure in figures:
            path = folder / f"{stem}.{format}"
            if path not in unfinished:
                unfinished[path] = folder / f".{path.name}.{secrets.token_hex(4)}.part"
                figure.savefig(unfinished[path], format=format, metadata=metadata[format])
    return list(unfinished)


@contextmanager
def _together(folder: Path) -> Iterator[dict[Path, Path]]:
    """Files that get their names when all of them are written; else none is left.

    A link of such a name is replaced: followed, it would lead the writing elsewhere.
    """
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    unfinished: dict[Path, Path] = {}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield unfinished
        for path, part in unfinished.items():
            part.replace(path)
    except BaseException:
        for part in unfinished.values():
            part.unlink(missing_ok=True)
        with suppress(OSError):  # another program's files keep it
            for path in missing:
                path.rmdir()
        raise
