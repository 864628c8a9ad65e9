"""The report as one HTML file."""

from __future__ import annotations

import importlib.resources
import json
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

from sweeps.base.arguments import names_given
from sweeps.base.errors import SceneError, one_line, size_text
from sweeps.base.files.libraries import library
from sweeps.decide.explore.attributes import of_designs
from sweeps.decide.explore.shaft_extremes import PLACES
from sweeps.running.archive.netcdf import replaced
from sweeps.view.report.charts import charts, made_charts
from sweeps.view.report.embedding import Embedded, choices_of, embedded
from sweeps.view.report.html import listed, paragraph, text
from sweeps.view.report.key_figures import key_figures, starting_places, views
from sweeps.view.report.key_results import results
from sweeps.view.report.sections import SECTIONS
from sweeps.view.report.shaft_calculation import calculation, check_torsiogram
from sweeps.view.report.verdict import verdict
from sweeps.view.texts.wording import Wording

if TYPE_CHECKING:
    import xarray as xr


LIMIT = 20e6  # Largest number of bytes of a report by default

SPARE = 50e3  # Bytes reserved for names and shapes of the numbers in the page

LEAST_ROOM = 10e3  # Smallest number of bytes for the numbers themselves


def report(
    archive: str | Path | xr.Dataset, path: str | Path, *, limit: float = LIMIT,
    units: str | None = None, target: str | Sequence[str] = (),
    not_counted: str | Sequence[str] = (), torsiogram: xr.Dataset | None = None,
    overwrite: bool = False,
) -> Path:  # fmt: skip
    """Write a report on an archive: one HTML file that needs no network.

    It begins with the verdict where something is limited: by a target, or by the limits of a shaft,
    which is solved between the speeds of the archive. It tells what was computed, shows tables,
    figures that can be zoomed and an explorer with a slider for every axis, and lists outcomes,
    warnings, assumptions and limits of the model.

    Parameters
    ----------
    archive : str, Path or Dataset
        An archive that `run` wrote, or what `sweeps.run` or `sweeps.open` returned. It may be
        larger than memory.
    path : str or Path
        The file to write.
    limit : float
        Bytes of the file. Numbers are embedded as float32, and fewer of them where there is no room
        for all; the report says which.
    units : str, optional
        ``power=kW,speed=rpm``: units of columns; `archive` for those of the archive.
    target : str or sequence of str
        Conditions such as "delta <= 1/250", as `best` takes them: the report says which designs
        meet them at every speed, load and misfire, and draws a line at each limit. A point without
        a result meets none.
    not_counted : str or sequence of str
        Outcomes such as "no_steady_state" (of an engine at idle) whose points are left out, as
        `best` takes them.
    torsiogram : Dataset, optional
        Of `sweeps.measured` with a `disc`: a part of the calculation of the shaft.
    overwrite : bool
        Replace the file if it exists.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    SceneError
        For units and targets that do not fit, a limit that is too small, a file that exists, and
        where Bokeh is not installed.

    Examples
    --------
    >>> import sweeps
    >>> archive = sweeps.run(
    ...     engine="ntua",
    ...     axes={"inertia": [5, 20, 40], "speed": [1200, 1500]},
    ...     output={"quantities": ["delta", "torque_mean"]},
    ... )
    >>> sweeps.report(archive, "report.html").name
    'report.html'
    """
    path = Path(path)
    if path.exists() and not overwrite:
        raise SceneError(f"{path}: exists and is not overwritten")
    how: dict[str, Any] = {"limit": limit, "units": units, "target": target,
                           "not_counted": not_counted, "torsiogram": torsiogram}  # fmt: skip
    if isinstance(archive, str | Path):
        from sweeps.decide.explore.opening import open as open_any

        with open_any(archive) as dataset:
            written = page(dataset, **how)
    else:
        written = page(archive, **how)
    with replaced(path) as partial:
        partial.write_text(written, encoding="utf-8", errors="replace")
    return path


def page(
    archive: xr.Dataset, *, limit: float = LIMIT, units: str | None = None,
    target: str | Sequence[str] = (), not_counted: str | Sequence[str] = (),
    torsiogram: xr.Dataset | None = None,
) -> str:  # fmt: skip
    """Return the report as a text of HTML; SceneError as `report`."""
    library("bokeh.models", "bokeh", "report", extra="report")
    choices = choices_of(archive, units)
    outcomes = names_given(not_counted, "not_counted")
    judged = verdict(archive, names_given(target, "target"), outcomes, units)
    if torsiogram is not None:
        check_torsiogram(archive, torsiogram)
    given = {results: partial(results, judged=bool(judged.html)),
             calculation: partial(calculation, torsiogram=torsiogram)}  # fmt: skip
    made_sections = {
        place: [(key, title, html) for key, title, make in content
                if (html := given.get(make, make)(archive, choices))]
        for place, content in SECTIONS.items()
    }  # fmt: skip
    parts = {
        place: "".join(
            f'<section id="{key}"><h2>{title}</h2>{html}</section>' for key, title, html in content
        )
        for place, content in made_sections.items()
    }
    if judged.html:
        parts["before"] = _VERDICT.substitute(html=judged.html) + parts["before"]
    title = one_line(archive.attrs.get("title") or "Report", 300)
    code = _code()
    made = made_charts(judged.figures)
    sizes = (*parts.values(), code, _json({"made": made}))
    used = sum(len(part.encode(errors="replace")) for part in sizes)
    room = limit - used - SPARE
    if room < LEAST_ROOM:
        least = 1.01 * (used + SPARE + LEAST_ROOM)
        raise SceneError(
            f"limit {size_text(limit)}: must be {size_text(least)} or more; the texts, tables and "
            " program of this report need this much, with room for a few numbers"
        )
    archive = archive[of_designs(archive)]  # Of a reduced archive, the designs that it kept
    template = Template(_resource("page.html"))
    # What belongs to parts and modes of a shaft is drawn in its section.
    apart = any(key == "torsion" for key, *_ in made_sections["before"])
    nothing = paragraph(
        "What belongs to the shaft is drawn in its section." if apart else
        "No quantity varies, so there is nothing to draw."
    )  # fmt: skip
    place = Wording(archive, units).place(archive, judged.at)
    begins = paragraph(f"It begins where the verdict is decided: {place}.") if place else ""
    tries = 0
    while True:
        content = embedded(archive, choices, room, judged.at)
        figures, explored = key_figures(content), views(content)
        if apart:
            figures = [one for one in figures if not _of_shaft(archive, one["quantities"])]
        data = {**content.json(), "made": made, "figures": figures, "views": explored,
                "start": starting_places(content),
                "decides": [*content.start], **charts(figures, explored)}  # fmt: skip
        written = template.substitute(
            title=text(title), style=_resource("page.css"), code=code, data=_json(data),
            before=parts["before"], after=parts["after"], left=begins + _left(content),
            figures="" if figures or made else nothing,
            contents=_contents(bool(judged.html), made_sections),
        )  # fmt: skip
        over = len(written.encode(errors="replace")) - limit
        if over <= 0 or room < 1.0:
            return written
        # Names of designs may take more room than `SPARE`. What is drawn does not shrink with the
        # numbers: where that is why, small steps would lead on for minutes.
        tries += 1
        room *= 0.97 * room / (room + over) if tries < 10 else 0.5


def _of_shaft(archive: xr.Dataset, names: Sequence[str]) -> bool:
    dims = {str(d) for name in names if name in archive for d in archive[name].dims}
    return bool(dims & {*PLACES, "mode", "throw"})


_VERDICT = Template('<section id="verdict"><h2>Verdict</h2>$html</section>')


def _contents(judged: bool, made: Mapping[str, Sequence[tuple[str, str, str]]]) -> str:
    entries = [
        *([("verdict", "Verdict", "")] if judged else []), *made["before"],
        ("pictures", "Figures", ""), ("explore", "Explorer", ""), *made["after"],
    ]  # fmt: skip
    return "".join(f'<a href="#{key}">{title}</a>' for key, title, _ in entries)


def _left(content: Embedded) -> str:
    """Sentences about values of the archive that are not in the page."""
    if not content.quantities:
        return paragraph("The archive has no numbers to explore.")
    said = "Numbers have seven digits."
    if not content.left_out:
        return paragraph(f"All values of the archive are in this page. {said}", "note")
    return paragraph(f"{said} Some values of the archive were left out:", "note") + listed(
        content.left_out
    )


def _json(data: Mapping[str, Any]) -> str:
    """JSON that cannot end the element that contains it."""
    written = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return written.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _code() -> str:
    """Program of BokehJS, and our own."""
    resources = library("bokeh.resources", "bokeh", "report", extra="report")
    inline = resources.Resources(mode="inline", components=["bokeh"])
    scripts = [*inline.js_raw, _resource("program.js")]
    return "".join(f"<script>\n{script}\n</script>\n" for script in scripts)


def _resource(name: str) -> str:
    return importlib.resources.files(__package__).joinpath(name).read_text(encoding="utf-8")
