"""Figures of an archive as files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import xarray as xr

from sweeps.errors import SceneError, shown
from sweeps.figures.kinds import figures_of
from sweeps.figures.sheet import STYLE
from sweeps.figures.study import study_of
from sweeps.figures.wording import slug

__all__ = ["FORMATS", "draw"]

FORMATS = ("png", "svg", "pdf")


def draw(
    dataset: xr.Dataset,
    folder: str | Path,
    format: str = "png",
    *,
    select: Mapping[str, float | str] | None = None,
) -> list[Path]:
    """Draw every figure that an archive gives rise to.

    Parameters
    ----------
    dataset : xarray.Dataset
        An archive: axes of the study (or ``design``) and ``crank_angle`` as dimensions; variables
        with ``long_name``, ``units`` and, where there is one, ``symbol`` (text for matplotlib).
    folder : str or Path
        Where the files go; made if it is not there. Files of the same names are replaced.
    format : {"png", "svg", "pdf"}
        PNG has 300 dots per inch.
    select : mapping of str to float or str, optional
        Slices: values of axes that are not to be drawn along, the nearest one is taken (for an
        axis of words the word itself). Axes that a figure has no room for and that are not named
        here are cut at the nominal design, the middle value or the first word. Either way the
        slice is stated in the title.

    Returns
    -------
    list of Path
        The files, in the order in which they were drawn.

    Raises
    ------
    SceneError
        For an unknown format, and for an axis or a word in `select` that the archive lacks.
    """
    import matplotlib

    if format not in FORMATS:
        raise SceneError(f"format is {shown(format)}, allowed: {', '.join(FORMATS)}")
    study = study_of(dataset, select or {})
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    metadata = {"png": {"Software": None}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
    written: list[Path] = []
    with matplotlib.rc_context():
        matplotlib.rcdefaults()  # a person's own settings would break the layout
        matplotlib.rcParams.update(STYLE)  # type: ignore[arg-type]
        for stem, figure in figures_of(study):
            path = folder / f"{slug(stem)}.{format}"
            if path not in written:
                if path.is_symlink():  # it would lead the writing elsewhere
                    path.unlink()
                figure.savefig(path, metadata=metadata[format])
                written.append(path)
    return written
