"""Figures of an archive in memory and as files: one kind, or all that the archive gives."""

from __future__ import annotations

import json
import secrets
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from sweeps.base.errors import SceneError, not_known, shown
from sweeps.view.figures.kinds import KINDS, Kind, figures_of, taken_by_kinds
from sweeps.view.figures.options import Options
from sweeps.view.figures.sheet import NamedFigures, Setting, drawn_with
from sweeps.view.figures.study import study_of
from sweeps.view.figures.wording import HARD_SPACE, plain_text, shorten, slug, typeset

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def figure(
    dataset: xr.Dataset, kind: str, options: Options | None = None, ax: Axes | None = None
) -> Figure:
    """Draw one figure of a kind.

    Parameters
    ----------
    dataset : xarray.Dataset
        An archive.
    kind : str
        Its name in `sweeps.view.figures.kinds.KINDS`, such as ``torque_and_speed``.
    options : Options, optional
        Style, size, crank angle, targets, slices; from
        `sweeps.view.figures.options.options_of`.
    ax : matplotlib.axes.Axes, optional
        Draw into this panel of a figure of your own. Title and legend go into the panel; notes and
        size are left out. Only for figures of one panel.

    Returns
    -------
    matplotlib.figure.Figure
        The first figure of the kind (`figures` gives all); that of `ax` if it is given. It does
        not belong to pyplot: a notebook shows it, ``savefig`` writes it.

    Raises
    ------
    SceneError
        For a kind that is not known or that the archive does not give, for `ax` where there are
        several panels, and for options that do not fit the archive.

    Examples
    --------
    >>> figure(archive, "torque_and_speed").savefig("torque.png")  # doctest: +SKIP
    """
    with drawing(dataset, replace(options or Options(), only=(kind,)), ax) as named:
        _, drawn = next(named, ("", None))
        if drawn is None:
            raise SceneError(_missing(kind))
        if ax is None:
            drawn.canvas.draw()  # It makes the ticks now, while the style holds
    return drawn


def figures(dataset: xr.Dataset, options: Options | None = None) -> dict[str, Figure]:
    """Draw all figures of an archive, or those of some kinds.

    Parameters
    ----------
    dataset : xarray.Dataset
        An archive.
    options : Options, optional
        ``only`` chooses kinds.

    Returns
    -------
    dict of str to matplotlib.figure.Figure
        By the names that their files would have, without extension, in the order of the kinds.

    Raises
    ------
    SceneError
        As `figure`.
    """
    drawn_figures: dict[str, Figure] = {}
    with drawing(dataset, options or Options()) as named:
        for stem, drawn in named:
            if stem not in drawn_figures:
                drawn.canvas.draw()
                drawn_figures[stem] = drawn
    return drawn_figures


@contextmanager
def drawing(
    dataset: xr.Dataset, options: Options, ax: Axes | None = None
) -> Iterator[NamedFigures]:
    """Figures of an archive by the names of their files, to be used while their style holds."""
    check_kinds(dataset, options.only, options)
    study = study_of(dataset, options.select, options)
    with drawn_with(Setting(_subject(dataset), options.inches, ax), options.style):
        yield ((slug(stem), drawn) for stem, drawn in figures_of(study, options.only))


def kinds_of(dataset: xr.Dataset, options: Options | None = None) -> list[tuple[Kind, list[str]]]:
    """Every kind with the variables of an archive that it draws; no variables: it draws nothing.

    Slices of the options may take from a kind the axis that it needs.
    """
    options = options or Options()
    return taken_by_kinds(study_of(dataset, options.select, options))


def check_kinds(dataset: xr.Dataset, only: Sequence[str], options: Options) -> None:
    """Raise `SceneError` for kinds that are not known, and for those that an archive lacks."""
    known = [kind.name for kind in KINDS]
    for name in only:
        if name not in known:
            raise SceneError(f"figure {shown(name)}: no such kind{not_known(name, known)}")
    absent = [
        kind.name
        for kind, names in (kinds_of(dataset, options) if only else ())
        if kind.name in only and not names
    ]
    if absent:
        raise SceneError(_missing(absent[0]))


def _missing(name: str) -> str:
    needs = next(kind.needs for kind in KINDS if kind.name == name)
    return f"figure {name}: not available for this archive; it needs {needs}"


def _subject(dataset: xr.Dataset) -> str:
    """Engine and speed, where the archive has one of each."""
    parts = []
    several = {"engine", "arrangement", "cylinders"} & {*dataset.dims, *dataset.coords}
    engine = str(dataset.attrs.get("engine") or "")
    title = str(dataset.attrs.get("engine_title") or "").split(" (")[0].rstrip(".")
    if several or not title:  # The title of an engine states its number of cylinders, which varies
        title = f"Engine {engine}" if engine and "engine" not in several else ""
    count, own = _one(dataset, "cylinders"), _one(dataset, "cylinders", "engine_values")
    if not several and count and own and count != own:
        title = f"Engine {engine} with {count:g} cylinder{'s' if count > 1 else ''}"
    if title:
        parts.append(shorten(title, 90))
    speed = _one(dataset, "speed")
    if speed > 0 and "speed" not in dataset.coords:
        parts.append(f"{typeset(speed)}{HARD_SPACE}rpm")
    return plain_text("; ".join(parts)) if parts else ""


def _one(dataset: xr.Dataset, name: str, of: str = "parameters") -> float:
    """A parameter with one value in the whole archive, or the engine's own; 0 without it."""
    try:
        value: Any = json.loads(dataset.attrs[of])[name]
        return float(value)
    except (KeyError, TypeError, ValueError):
        return 0.0


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
    formats = ("png", "svg", "pdf")
    if format not in formats:
        raise SceneError(f"format is {shown(format)}, allowed: {', '.join(formats)}")
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
    """Files that get their names when all of them are written; otherwise all are removed."""
    # A link with the name of a figure is replaced: the file that it leads to must not be written.
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
        with suppress(OSError):  # A folder with files of another program stays
            for path in missing:
                path.rmdir()
        raise


def kinds_text(dataset: xr.Dataset, options: Options | None = None) -> str:
    """List what `plot --only` can draw of an archive, and what the other kinds need."""
    kinds = kinds_of(dataset, options)
    wide = max(len(kind.name) for kind, _ in kinds)
    given = [f"  {kind.name:{wide}}  {kind.shows}" for kind, names in kinds if names]
    absent = [f"  {kind.name:{wide}}  needs {kind.needs}" for kind, names in kinds if not names]
    lines = (
        ["figures available for this archive:", *given]
        if given
        else ["no figures available for this archive"]
    )
    return "\n".join([*lines, "", "not available for this archive:", *absent] if absent else lines)
