"""Key results of a report: designs as a table, smallest and largest numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.quantities.graph import DIMENSIONS
from sweeps.base.dimensions import EXPLAINED, HIGH, LOW, REDUCTION, SHARE
from sweeps.base.errors import SceneError, one_line
from sweeps.base.numbers import number_texts
from sweeps.decide.explore.attributes import members_of
from sweeps.decide.explore.columns import columns_of
from sweeps.decide.explore.rows import Rows, rows
from sweeps.decide.explore.shaft_extremes import OVER_LIMITS
from sweeps.running.reduce.ranges import ranges
from sweeps.view.report.html import FIRST_ROWS, details, listed, paragraph, table, text, value_text
from sweeps.view.texts.archives import recorded_cycle_lines
from sweeps.view.texts.optimised import without_repeats
from sweeps.view.texts.readable_units import converted
from sweeps.view.texts.reductions import at_points, counts_within, searches, statistics_table
from sweeps.view.texts.tables import OF_BANDS, meaning, number_cells

if TYPE_CHECKING:
    import xarray as xr


Choices = Mapping[str, str]

MOST_ROWS = 60  # Largest number of designs of an archive that are all in one table


def results(archive: xr.Dataset, choices: Choices, *, judged: bool = False) -> str:
    """Designs as a table; of many the smallest and largest numbers and where they are.

    Some of many designs are listed too, unless a verdict has `judged` them and lists those that
    count.
    """
    parts = _reduced(archive, choices) if REDUCTION in archive.attrs else []
    archive = archive.drop_vars([n for n, v in archive.data_vars.items() if not v.size])
    try:
        shown = rows(archive, limit=MOST_ROWS)
    except SceneError:  # No quantity has one number for each design
        shown = None
    if shown is not None and not set(shown.units) - set(shown.given):
        shown = None  # Designs without a number, such as those of a shaft, whose parts have numbers
    if shown is not None and shown.designs <= MOST_ROWS:
        parts.append(_rows_table(without_repeats(shown), choices))
    several = shown is None or shown.designs > 1
    extremes = [*_extremes(archive, choices)] if several and REDUCTION not in archive.attrs else []
    if extremes:
        head = ("quantity", "unit", "smallest", "at", "largest", "at")
        parts += ["<h3>Smallest and largest</h3>", table(head, extremes, (2, 4))]
    judged |= any(name in archive for name in OVER_LIMITS)
    if shown is not None and shown.designs > MOST_ROWS and not judged:
        order = "delta" if "delta" in shown.table and REDUCTION not in archive.attrs else None
        first = rows(archive, limit=FIRST_ROWS, sort=order)
        which = "with the smallest delta" if order else "in the order of the archive"
        which = "that the first search found best" if REDUCTION in archive.attrs else which
        parts += [f"<h3>{FIRST_ROWS} of {shown.designs:,} designs, those {which}</h3>",
                  _rows_table(without_repeats(first), choices)]  # fmt: skip
    told = recorded_cycle_lines(archive, choices)
    if told:
        parts += ["<h3>Spread over the recorded cycles</h3>", listed(told)]
    if not parts and "shaft_name" in archive.coords:
        return ""  # The section on torsional vibration has the results
    return "".join(parts) or paragraph("No quantity has one number per design.")


def _reduced(archive: xr.Dataset, choices: Choices) -> list[str]:
    """Results over all designs: statistics, counts within limits, searches."""
    parts = []
    heads, lines = statistics_table(archive, choices)
    if lines:
        left = ", ".join(members_of(archive, REDUCTION).get("left", []))
        along = f", from where to where along {left}" if left else ""
        parts += [f"<h3>Statistics of all designs{text(along)}</h3>",
                  table(heads, lines, range(2, len(heads)))]  # fmt: skip
    within = [(condition, f"{n:,}") for condition, n in counts_within(archive)]
    if within:
        what = "points" if at_points(archive) else "designs"
        head = f"<h3>{what.capitalize()} within limits</h3>"
        parts += [head, table(("condition", what), within, (1,))]
    searched = searches(archive)
    if searched:
        parts += ["<h3>Searches</h3>", table(("searched for", "found"), searched)]
    return parts


def _rows_table(shown: Rows, choices: Choices) -> str:
    """A row for each design, its name first; with few designs a row for each quantity."""
    names = [n for n in shown.table if n not in shown.units and n in shown.given]
    given = [n for n in shown.given if n not in names and not (names and n == "design")]
    order = [*names, *given, *(n for n in shown.table if n not in shown.given)]
    cells: dict[str, Sequence[str]] = {}
    units: dict[str, str] = {}
    for name in order:
        if name in shown.units:
            cells[name], units[name] = number_cells(shown, name, choices.get(name))
        else:
            units[name] = ""
            cells[name] = [one_line(value, 80).replace("_", " " if name == "status" else "_")
                           for value in shown.table[name]]  # fmt: skip
    # Up to three designs are columns, with a row for each quantity.
    if shown.number <= 3:
        lines = [(name, *cells[name], units[name], meaning(shown, name)) for name in order]
        numbers = list(range(1, 1 + shown.number))
        head = [f"design {i}" for i in numbers] if shown.number > 1 else [""]
        bands = paragraph(f"{OF_BANDS.capitalize()}.", "note") if shown.bands else ""
        return table(("", *head, "", ""), lines, numbers) + bands
    same = {n: cells[n][0] for n in order if n not in names and len(set(cells[n])) == 1}
    left = [n for n in order if n not in same]
    head = [f"{n} [{units[n]}]" if units[n] else n for n in left]
    numbers = [i for i, n in enumerate(left) if n in shown.units]
    body = table(head, zip(*(cells[n] for n in left), strict=True), numbers)
    if shown.bands:
        mostly = "; ".join(f"{n} mostly from {parameter}" for n, parameter in shown.mainly.items())
        body += paragraph(f"{OF_BANDS.capitalize()}: {mostly}.", "note")
    if len(same) > 5:
        lines = [(n, value, units[n], shown.texts.get(n, "")) for n, value in same.items()]
        return body + details("The same in all of these rows", table(("", "", "", ""), lines, (1,)))
    told = ", ".join(f"{n} {value} {units[n]}".rstrip() for n, value in same.items())
    return body + (paragraph(f"The same in all of these rows: {told}.", "note") if told else "")


def _extremes(archive: xr.Dataset, choices: Choices) -> Iterator[tuple[str, ...]]:
    """Smallest and largest value of each quantity with single numbers, and their places."""
    for name, data in archive.data_vars.items():
        if "flag_meanings" in data.attrs:
            continue
        if data.dtype.kind not in "fiu" or not data.ndim or not data.size:
            continue
        if set(data.dims) & set(DIMENSIONS) or _of_a_band(archive, str(name)):
            continue
        ends = _lowest_and_highest(data.variable)
        if ends is None:
            yield str(name), "", "no value", "", "no value", ""
            continue
        (low, low_at), (high, high_at) = ends
        if low == high:
            continue
        factor, unit = converted(str(data.attrs.get("units", "1")), choices.get(str(name)))
        least, most = number_texts([low * factor, high * factor])
        yield (
            str(name), unit, least, _where(archive, data, low_at, choices),
            most, _where(archive, data, high_at, choices),
        )  # fmt: skip


def _of_a_band(archive: xr.Dataset, name: str) -> bool:
    """Whether a variable is the uncertainty of a quantity, with which the table shows it."""
    return any(
        name.endswith(ending) and name.removesuffix(ending) + SHARE in archive
        for ending in (LOW, HIGH, EXPLAINED)
    )


Place = tuple[int, ...]


def _lowest_and_highest(
    variable: xr.Variable,
) -> tuple[tuple[float, Place], tuple[float, Place]] | None:
    dims = [str(d) for d in variable.dims]
    best: list[tuple[float, Place]] = []
    for begin, extent, read in ranges({"one": variable}, dims, variable.shape, in_order=True):
        values = np.broadcast_to(read["one"], extent).astype(float)
        if not np.isfinite(values).any():
            continue
        values[~np.isfinite(values)] = np.nan
        for sign in (0, 1):
            flat = int(np.nanargmax(values) if sign else np.nanargmin(values))
            inside = np.unravel_index(flat, extent)
            place = tuple(int(b + i) for b, i in zip(begin, inside, strict=True))
            value = float(values.reshape(-1)[flat])
            if len(best) == sign:
                best.append((value, place))
            elif (value > best[1][0]) if sign else (value < best[0][0]):
                best[sign] = (value, place)
    return (best[0], best[1]) if best else None


def _where(archive: xr.Dataset, data: xr.DataArray, place: Place, choices: Choices) -> str:
    """Name of a design, or the values of its axes."""
    inside = dict(zip((str(d) for d in data.dims), place, strict=True))
    here = {
        n: v.isel({d: inside[str(d)] for d in v.dims})
        for n, v in columns_of(archive, list(inside), []).items()
        if v.ndim
    }
    named = [n for n, v in here.items() if v.dtype.kind not in "fiub"]
    told = [n for n in here if n in named or (n in inside and not (named and n == "design"))]
    if not named:
        told = list(here)
    return ", ".join(
        f"{n} {value_text(here[n], here[n].values[()], choices.get(n))}" for n in told[:8]
    )
