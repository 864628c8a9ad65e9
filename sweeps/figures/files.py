"""Figures of an archive, drawn from the Dataset alone.

Nothing here knows an engine or computes physics: a variable is drawn by its dimensions, and what
is written beside it comes from its attributes (``long_name``, ``symbol``, ``units``).

=====================  ==========================================================================
a variable over        is drawn as
=====================  ==========================================================================
nothing                a row of the table ``summary``, and so what is the same in all designs
one axis               points joined by lines
two axes               a map with labelled contours, or lines where an axis is words, short, or
                       whole numbers such as those of cylinders
more axes              small multiples of these; what is left is cut at one slice, which is stated
``crank_angle``        curves, one line per value of one axis; two components of a load against
                       each other, as a polar diagram
``order``              stems, side by side for the values of one axis
attribute              throws, banks and the firing star, where an arrangement is described
``arrangement``
``design``             the list of designs is taken apart into families, see
                       `sweeps.figures.views.families_of`
=====================  ==========================================================================

An axis along which nothing changes is named in the note and not drawn: what differs by less than
the solver's tolerance, or than ticks can say, is the same (`sweeps.figures.views.View.idle`).

Designs without an answer (``status``) are hatched in maps and marked on the frame in curves, and
the legend names the outcome; they are never drawn as numbers.

matplotlib is imported inside functions, and always as `Figure` on the Agg canvas: pyplot keeps
figures alive and picks a backend for the whole process, which a library must not do.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import xarray as xr

from sweeps.errors import SceneError, shown
from sweeps.figures.arrangement import arrangements
from sweeps.figures.balance import VECTORS, shaking
from sweeps.figures.curves import (
    COMPONENTS,
    KINEMATICS,
    curve_figure,
    cylinders,
    indicator_diagrams,
    kinematics,
    over_angle,
    torque_and_speed,
    torque_components,
)
from sweeps.figures.mechanism import drawn_together, order_figure, polar_diagrams, polar_names
from sweeps.figures.numbers import all_numbers, outcomes_map
from sweeps.figures.published import published
from sweeps.figures.sheet import STYLE, Plates
from sweeps.figures.views import PUBLISHED, RUNNING, Study, stem_of, study_of
from sweeps.figures.wording import slug

__all__ = ["FORMATS", "draw"]

FORMATS = ("png", "svg", "pdf")
# Families away from the nominal design that get curves of their own: a grid of designs has many.
MOST_ASIDES = 4


def _plates(study: Study) -> Plates:
    """All figures of an archive, named; nothing is drawn for what is not there."""
    view = study.view
    yield from arrangements(study)
    yield from kinematics(study)
    yield from indicator_diagrams(study)
    yield from torque_components(study)
    yield from torque_and_speed(study)
    yield from cylinders(study)
    yield from shaking(study)
    drawn: set[str] = {"status"}
    grouped, together = drawn_together(study)
    yield from together
    yield from polar_diagrams(study)
    drawn |= grouped | {name for _, *pair in polar_names(view) for name in pair}
    if any(over_angle(view, name) for name in COMPONENTS):
        drawn |= {name for name in (*COMPONENTS, "torque", "load_torque") if view.has(name)}
    drawn |= {name for name in (*KINEMATICS, "pressure", *VECTORS) if over_angle(view, name)}
    both = all(over_angle(view, name) for name in ("torque", "omega"))
    shown = {"torque", "load_torque", "omega"} if both else set()  # in torque_and_speed
    names = [str(name) for name in view.data.data_vars if view.has(str(name))]
    rest = [n for n in names if n not in drawn and not n.endswith(PUBLISHED)]
    curves = [name for name in rest if set(view.array(name).dims) & set(RUNNING)]
    for name in curves:
        figure = order_figure if "order" in view.array(name).dims else curve_figure
        for whole, along in study.along([name]):
            if along is None and name in shown:
                continue
            yield stem_of(name, whole, along), figure(whole, name, along)
        if "design" not in view.array(name).dims or len(study.aside) > MOST_ASIDES:
            continue
        for parameter, aside, _ in study.aside:
            if aside.varies([name], parameter):
                yield stem_of(name, aside, parameter), figure(aside, name, parameter)
    yield from all_numbers(study, [name for name in rest if name not in curves])
    yield from outcomes_map(study)
    yield from published(study)


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
        for stem, figure in _plates(study):
            path = folder / f"{slug(stem)}.{format}"
            if path not in written:
                if path.is_symlink():  # it would lead the writing elsewhere
                    path.unlink()
                figure.savefig(path, metadata=metadata[format])
                written.append(path)
    return written
