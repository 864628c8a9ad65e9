"""Sections of a report: words and tables about what an archive holds, and where designs failed."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.status import MEANINGS, has_numbers
from sweeps.base.dimensions import NONLINEAR_STATUS, PASSING_STATUS, REDUCTION, TORSION_STATUS
from sweeps.base.errors import one_line
from sweeps.base.naming import meaning_of
from sweeps.decide.explore.attributes import (
    axes_of,
    count_of_designs,
    dims_of_designs,
    members_of,
    of_designs,
)
from sweeps.decide.explore.columns import columns_of
from sweeps.running.reduce.ranges import ranges
from sweeps.view.figures.transient_run import RUN_NAMES
from sweeps.view.report.html import (
    FIRST_ROWS,
    details,
    listed,
    paragraph,
    preformatted,
    table,
    value_text,
)
from sweeps.view.report.key_results import Choices, results
from sweeps.view.report.model_limits import features_of, model_limits
from sweeps.view.report.shaft_calculation import calculation, drawn
from sweeps.view.texts.archives import PASSES, outcome_counts
from sweeps.view.texts.key_texts import with_word
from sweeps.view.texts.readable_units import converted
from sweeps.view.texts.reductions import at_points

if TYPE_CHECKING:
    import xarray as xr


@dataclass
class Failures:
    """Designs without numbers: a table of the first ones, and where they are on each axis.

    A row of `where` has the name of an axis or column, from where to where failed designs and all
    designs go, and how many failed at each value.
    """

    head: list[str]
    first: list[list[str]] = field(default_factory=list)
    where: list[tuple[str, str, str, str]] = field(default_factory=list)


def failures(archive: xr.Dataset, choices: Mapping[str, str]) -> Failures:
    """Find the designs that failed, reading a range at a time."""
    import xarray as xr

    status = archive["status"]
    dims = [str(d) for d in status.dims]
    columns = {n: v for n, v in columns_of(archive, dims, ["status"]).items() if v.ndim}
    if "status" not in columns:  # The archive has one design
        columns["status"] = xr.Variable(("design",), status.values[np.newaxis])
        dims = ["design"]
    sizes = {d: columns["status"].sizes[d] for d in dims}
    given = [n for n in columns if n != "status"]
    failed = Failures([*given, "outcome"])
    with_numbers = np.array([has_numbers(code) for code in range(256)])
    spans = {n: [np.inf, -np.inf, np.inf, -np.inf] for n in given if columns[n].dtype.kind in "fiu"}
    # Failed designs are not counted along axes of more than 24 values.
    counts = {d: np.zeros(n, dtype=np.int64) for d, n in sizes.items() if n <= 24}
    for begin, extent, read in ranges(columns, dims, [*sizes.values()]):
        codes = np.broadcast_to(read["status"], extent).astype(np.uint8)
        lost = ~with_numbers[codes]
        for name, span in spans.items():
            _widen(span, np.broadcast_to(read[name], extent), lost)
        for axis, dim in enumerate(dims):
            if dim in counts:
                others = tuple(i for i in range(len(dims)) if i != axis)
                counts[dim][begin[axis] : begin[axis] + extent[axis]] += lost.sum(axis=others)
        for flat in np.flatnonzero(lost)[: FIRST_ROWS - len(failed.first)]:
            at = np.unravel_index(flat, extent)
            texts = [
                value_text(columns[n], np.broadcast_to(read[n], extent)[at], choices.get(n))
                for n in given
            ]
            code = int(codes[at])
            why = MEANINGS[code] if code < len(MEANINGS) else str(code)
            failed.first.append([*texts, why.replace("_", " ")])
    for name in given:
        variable, choice = columns[name], choices.get(name)
        at_each = _counted(variable, counts, sizes, choice) if name in dims else ""
        lost_span, both = ("", "")
        if name in spans and name != "design":
            span = spans[name]
            lost_span, both = (_span(variable, part, choice) for part in (span[:2], span[2:]))
        if at_each or lost_span:
            failed.where.append((name, lost_span, both, at_each))
    return failed


def _counted(
    variable: xr.Variable, counts: Mapping[str, npt.NDArray[np.int64]], sizes: Mapping[str, int],
    choice: str | None,
) -> str:  # fmt: skip
    """Number of failed designs at each value of an axis with failures."""
    dim = str(variable.dims[0])
    if dim not in counts or sizes[dim] < 2:
        return ""
    of_each = int(np.prod([n for d, n in sizes.items() if d != dim]))
    told = (
        f"{value_text(variable, value, choice)}: {n:,} of {of_each:,}"
        for value, n in zip(variable.values, counts[dim], strict=True)
        if n
    )
    return "; ".join(told)


def _widen(span: list[float], values: npt.NDArray[Any], lost: npt.NDArray[np.bool_]) -> None:
    for place, part in ((0, values[lost]), (2, values)):
        if part.size and np.isfinite(part).any():
            span[place] = min(span[place], float(np.nanmin(part)))
            span[place + 1] = max(span[place + 1], float(np.nanmax(part)))


def _span(variable: xr.Variable, span: Sequence[float], choice: str | None) -> str:
    low, high = span
    if not low <= high:
        return "no value"
    one, other = value_text(variable, low, choice), value_text(variable, high, choice)
    return one if low == high else f"{one} to {other}"


MOST_LINES = 500  # Largest number of warnings, assumptions or parameters that are listed

FEW = 12  # Largest number of values of an axis that are all listed

OUTCOMES: Mapping[str, str] = {
    "converged": "steady state found with the requested accuracy",
    "stalled": "the crankshaft would stop within the cycle: too little inertia for this torque "
    "and load",
    "no_steady_state": "torque and load do not balance at any speed in the range searched",
    "not_converged": "no solution was found",
    "invalid_input": "the input values do not describe a possible engine",
    "tolerance_not_met": "result found, but less accurate than requested",
    "passes_done": PASSES,
    "torque_not_reached": "no diagram of the engine gives the torque that is held",
    "followed": "the speed was followed to the end, or to standstill after the fuel was cut",
    "stopped": "the engine stopped while it had fuel; numbers are those up to then",
    "not_started": "the speed at which the engine has started was not reached",
    "runaway": "the speed passed three times the nominal one",
}
"""Meanings of the outcomes of designs."""


def _members(table_of: Mapping[str, Any], head: str = "") -> Iterator[tuple[str, str]]:
    """Names and texts of members; members of tables within them have their full names."""
    for key, value in table_of.items():
        name = f"{head}{key}"
        if isinstance(value, dict) and not head:
            yield from _members(value, f"{name}: ")
        else:
            yield name, value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


def _limited(lines: Sequence[Any], what: str) -> tuple[Sequence[Any], str]:
    """The first of many lines, and a note on the number of all."""
    if len(lines) <= MOST_LINES:
        return lines, ""
    return lines[:MOST_LINES], paragraph(
        f"{MOST_LINES} of {len(lines):,} {what} are listed.", "note"
    )


# ---- what was computed ---------------------------------------------------------------------------


def computed(archive: xr.Dataset, choices: Choices) -> str:
    """Engine and scene in words, the axes, the quantities."""
    attrs = archive.attrs
    facts: list[tuple[str, str]] = []
    engine = one_line(attrs.get("engine", ""), 200)
    title = one_line(attrs.get("engine_title", ""), 400)
    if engine or title:
        facts.append(
            ("engine", f"{title} ({engine})" if title and engine not in title else title or engine)
        )
    names = [one_line(a["name"], 100) for a in _arrangements(archive) if a.get("name")]
    if names:
        facts.append(("arrangement", ", ".join(dict.fromkeys(names))))
    varying = dims_of_designs(archive)
    over = f", over {', '.join(varying)}" if varying else ""
    if REDUCTION in archive.attrs:
        over = (
            f"{at_points(archive)} together{', of which some are kept' * bool(of_designs(archive))}"
        )
    facts.append(("designs", f"{count_of_designs(archive):,}{over}"))
    solver = members_of(archive, "solver")
    if solver:
        said = "; ".join(
            f"{k.replace('_', ' ')} {', '.join(map(str, v)) if isinstance(v, list) else v}"
            for k, v in solver.items()
        )
        if "transient" in members_of(archive, "scene"):
            said = f"speed followed in time; what repeats: {said}"
        facts.append(("solution", said.replace("_", " ")))
    given = members_of(archive, "scene").get("set")
    if isinstance(given, dict) and given:
        facts.append(("set by the scene", ", ".join(_setting(k, v) for k, v in given.items())))
    for name, coordinate in archive.coords.items():
        if coordinate.ndim == 0:
            value = value_text(coordinate, coordinate.values[()], choices.get(str(name)))
            facts.append((str(name), value))
    made = str(attrs.get("history", "")).splitlines()
    if made:
        facts.append(("computed", made[-1].replace(": ", ", ", 1)))
    parts = [table(("", ""), facts)]
    dims = axes_of(archive)
    axes = [_axis_row(archive, d, choices) for d in dims]
    if axes:
        parts += ["<h3>Axes</h3>", table(("axis", "meaning", "number", "values"), axes, (2,))]
    columns = [(str(n), meaning_of(c.attrs), str(c.dims[0]),
                _values_text(c, choices.get(str(n)))) for n, c in archive.coords.items()
               if c.ndim == 1 and c.dims[0] in dims
               and n not in (c.dims[0], f"{c.dims[0]}_name")]  # fmt: skip
    if columns:
        head = ("column", "meaning", "along", "values")
        parts.append(details("Columns of designs", table(head, columns)))
    quantities = [
        (name, _unit(v, choices.get(str(name))), _meaning(v),
         ", ".join(map(str, v.dims)) or "one number", v.attrs.get("references", ""))
        for name, v in archive[of_designs(archive)].data_vars.items()
    ]  # fmt: skip
    shown = table(("quantity", "unit", "meaning", "over", "source"), quantities)
    count = f"{len(quantities)} quantities" if len(quantities) != 1 else "1 quantity"
    return "".join([*parts, details(count, shown) if quantities else ""])


def _arrangements(archive: xr.Dataset) -> list[dict[str, Any]]:
    """Arrangements of the cylinders of one engine, or of several."""
    try:
        described = json.loads(str(archive.attrs.get("arrangement", "{}")))
    except (ValueError, RecursionError):
        return []
    return [
        a
        for a in (described if isinstance(described, list) else [described])
        if isinstance(a, dict)
    ]


def _meaning(variable: xr.DataArray) -> str:
    """What a quantity is, and the engines that do not have it."""
    said = (meaning_of(variable.attrs), variable.attrs.get("comment"))
    return "; ".join(str(part) for part in said if part)


def _setting(key: str, value: Any) -> str:
    unit = PARAMETERS[key].unit if key in PARAMETERS else ""
    number = f"{value:.6g}" if isinstance(value, int | float) else one_line(value, 80)
    return f"{one_line(key, 60)} {number} {converted(unit, None)[1]}".strip()


def _unit(variable: xr.Variable | xr.DataArray, choice: str | None) -> str:
    if variable.dtype.kind not in "fiu" or "flag_meanings" in variable.attrs:
        return ""
    return converted(str(variable.attrs.get("units", "1")), choice)[1]


def _values_text(coordinate: xr.DataArray, choice: str | None) -> str:
    """Text of the values along an axis: all, or the ends."""
    values = coordinate.values
    if not len(values):
        return "none"
    if coordinate.dtype.kind not in "fiu":
        words = list(dict.fromkeys(one_line(v, 60) for v in values[:10_000]))
        return ", ".join(words[:FEW]) + (", ..." if len(words) > FEW else "")
    factor, unit = converted(str(coordinate.attrs.get("units", "1")), choice)
    distinct = np.unique(values) * factor
    if len(distinct) <= FEW:
        told = ", ".join(f"{v:.6g}" for v in distinct)
    else:
        told = f"{distinct[0]:.6g} to {distinct[-1]:.6g}"
    return f"{told} {unit}".rstrip()


def _axis_row(archive: xr.Dataset, dim: str, choices: Choices) -> tuple[Any, ...]:
    size = f"{archive.sizes[dim]:,}"
    if dim not in archive.coords:
        return dim, "", size, ""
    coordinate = archive[dim]
    meaning = meaning_of(coordinate.attrs)
    words = f"{dim}_name"
    if words in archive.coords and archive[words].dims == (dim,):
        coordinate = archive[words]
        meaning = meaning_of(archive[words].attrs)
    told = _values_text(coordinate, choices.get(dim)) if dim != "design" else ""
    return dim, meaning, size, told


# ---- outcomes, warnings, assumptions -------------------------------------------------------------


OF_A_SHAFT = (TORSION_STATUS, NONLINEAR_STATUS, PASSING_STATUS)
"""Outcomes of the vibration of a shaft."""


def outcomes(archive: xr.Dataset, choices: Choices) -> str:
    """How many designs had which outcome, and where the others failed."""
    counts = outcome_counts(archive)
    if not counts:
        others = ", ".join(name for name in OF_A_SHAFT if name in archive)
        return paragraph(
            f"The speed is not solved; what has no number has its outcome in {others}."
            if others else
            "No design can fail, because these quantities need no solution of the speed."
        )  # fmt: skip
    all_of_them = sum(counts.values())
    body = [
        (
            name.replace("_", " "),
            f"{n:,}",
            f"{100.0 * n / all_of_them:.3g} %",
            OUTCOMES.get(name, ""),
        )
        for name, n in counts.items()
    ]
    parts = [table(("outcome", "designs", "share", "meaning"), body, (1, 2))]
    failed = sum(n for name, n in counts.items() if not has_numbers(MEANINGS.index(name)))
    if not failed:
        return "".join([*parts, paragraph("Every design has a result.")])
    if REDUCTION in archive.attrs:
        return "".join([*parts, paragraph("Which designs failed is not in a reduced archive.")])
    places = failures(archive, choices)
    parts += [
        "<h3>Where designs failed</h3>",
        table(
            ("axis or column", "designs without a result", "all designs", "failed"), places.where
        ),
        "<h3>Designs without a result</h3>" if failed <= FIRST_ROWS
        else f"<h3>{FIRST_ROWS} of {failed:,} designs without a result</h3>",
        table(places.head, places.first),
    ]  # fmt: skip
    return "".join(parts)


def warned(archive: xr.Dataset, choices: Choices) -> str:
    """Warnings that the archive holds."""
    lines = str(archive.attrs.get("warnings", "")).splitlines()
    if not lines:
        return paragraph("All values are within the ranges usual for engines.")
    shown, more = _limited(lines, "warnings")
    return listed(shown) + more


def assumed(archive: xr.Dataset, choices: Choices) -> str:
    """Values that the sources of the engine do not give, and all parameters."""
    assumptions, more = _limited(
        list(_members(members_of(archive, "engine_assumed"))), "assumptions"
    )
    parts = (
        [paragraph("These values are assumed, because the sources of the engine do not give them."),
         table(("assumed", "why"), assumptions), more]
        if assumptions
        else [paragraph("No value of the engine is marked as assumed.")]
    )  # fmt: skip
    parameters = {k: with_word(k, v) for k, v in members_of(archive, "parameters").items()}
    given, more = _limited(list(_members(parameters)), "parameters")
    if given:
        body = [(key, value, *_about(key)) for key, value in given]
        shown = table(("parameter", "value", "unit", "meaning"), body, (1,)) + more
        parts.append(details("Values of all parameters that do not vary", shown))
    return "".join(parts)


def _about(key: str) -> tuple[str, str]:
    """Unit and meaning of a parameter."""
    node = PARAMETERS.get(key)
    return ("", "") if node is None else ("" if node.unit == "1" else node.unit, node.long_name)


def limited(archive: xr.Dataset, choices: Choices) -> str:
    """Limits of the model that apply to what was computed."""
    limits = model_limits(
        members_of(archive, REDUCTION).get("quantities", [str(n) for n in archive.data_vars]),
        features_of(archive, _arrangements(archive)),
    )
    return (
        listed(limits) if limits else paragraph("No model limits are known for these quantities.")
    )


# ---- provenance ----------------------------------------------------------------------------------


def provenance(archive: xr.Dataset, choices: Choices) -> str:
    """Versions, the command, hashes of files, the scene."""
    told_elsewhere = {
        "title", "warnings", "engine_assumed", "parameters", "scene", "identity", "input_files",
        "references", "engine", "engine_title", "indicator_diagrams", "arrangement", "shaft",
        "solver", "engine_values", REDUCTION,
    }  # fmt: skip
    body = [(key, value) for key, value in archive.attrs.items() if key not in told_elsewhere]
    parts = [table(("", ""), body[:MOST_LINES])]
    files = members_of(archive, "input_files").get("files")
    if isinstance(files, dict) and files:
        hashes = [(n, f.get("sha256", "") if isinstance(f, dict) else "") for n, f in files.items()]
        shown, more = _limited(hashes, "files")
        told = table(("file", "sha256"), shown) + more
        parts.append(details("Files that were read, and their hashes", told))
    scene = members_of(archive, "scene")
    if scene:
        written = json.dumps(scene, indent=2, ensure_ascii=False)
        parts.append(details("The scene", preformatted(written)))
    return "".join(parts)


def cited(archive: xr.Dataset, choices: Choices) -> str:
    """How to cite the program, and the sources of the engine."""
    source = one_line(archive.attrs.get("source", "engine-dyn").partition(":")[0], 60)
    commit = one_line(archive.attrs.get("git_commit", ""), 60)
    cite = (
        f"engine-dyn contributors: {source}. Dynamics of reciprocating engines, swept over many "
        "designs into labelled archives"
    )
    parts = [paragraph(f"{cite}{f' (commit {commit})' if commit else ''}.")]
    lines = [line for line in str(archive.attrs.get("references", "")).splitlines() if line.strip()]
    if lines:
        shown, more = _limited(lines, "sources")
        parts += [paragraph("Sources of the engine data:"), listed(shown), more]
    return "".join(parts)


# ---- speed that does not repeat ------------------------------------------------------------------

MOST_POINTS, LARGEST = 50_000, 2_000_000
"""Points of a line, and characters of figures; larger ones would leave no room for numbers."""


def followed(archive: xr.Dataset, choices: Choices) -> str:
    """Speed over the time as `engine-dyn plot` draws it, where the archive has every design."""
    points = max(archive.sizes.get(dim, 0) for dim in ("run_cycle", "run_point"))
    if not points or REDUCTION in archive.attrs:
        return ""
    written = "".join(drawn(archive, RUN_NAMES, "transient_run")) if points <= MOST_POINTS else ""
    if points > MOST_POINTS or len(written) > LARGEST:
        return paragraph(f"Runs of {points:,} points are drawn by engine-dyn plot, not here.")
    return written


SECTIONS: Mapping[str, Sequence[tuple[str, str, Callable[[Any, Choices], str]]]] = {
    "before": (
        ("computed", "What was computed", computed),
        ("results", "Key results", results),
        ("followed", "Speed over the time", followed),
        ("torsion", "Torsional vibration", calculation),
    ),
    "after": (
        ("outcomes", "Outcomes, and where designs failed", outcomes),
        ("warnings", "Warnings", warned),
        ("assumptions", "Assumptions", assumed),
        ("limits", "Limits of the model", limited),
        ("provenance", "Provenance", provenance),
        ("cite", "How to cite", cited),
    ),
}
"""Sections before and after the figures: identifiers in the page, titles and makers, which return
nothing where there is nothing to say."""
