"""What a study decides, at the top of its report: limits, worst values, margins, which case.

Limits are the targets of the report and, of shafts, those of stress and torque. A shaft's verdict
between the speeds of an archive is solved; where that would take long, the report says so and names
the command that does it, and gives no verdict.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.quantities.graph import DIMENSIONS
from engine_dyn.types import Floats, Integers
from sweeps.base.dimensions import NOT_CHOSEN, REDUCTION, words_of
from sweeps.base.errors import SceneError, counted, one_line
from sweeps.base.ratios import ratio_text
from sweeps.decide.explore.barred import Barred, barred_ranges, points_of
from sweeps.decide.explore.shaft_extremes import OVER_LIMITS, PLACES, Worst, worst_of_shaft
from sweeps.scene.conditions import Constraint, check_name, conditions_of, units_of
from sweeps.view.report.charts import Drawn
from sweeps.view.report.html import listed, paragraph, table, text, value_text
from sweeps.view.report.verdict_figures import barred_figure, campbell_figure, target_figure
from sweeps.view.texts.barred import HEADS, case_text, notes, range_cells
from sweeps.view.texts.readable_units import converted
from sweeps.view.texts.tables import number_text

if TYPE_CHECKING:
    import xarray as xr

MOST_SOLVED = 50_000  # Largest number of points that a report solves, speeds times cases; some 5 s

MOST_VALUES = 20_000_000  # Largest number of values of a target that a report judges

MOST_DESIGNS = 12  # Largest number of designs in the table of a target

REQUIRED = ("inertia_required", "flywheel_inertia_required")
"""Quantities of which the largest over all cases is what the engine needs."""


_MODES = ("natural_frequency", "critical_speed", "mode_vector_sum")
"""Quantities that a Campbell diagram needs."""


@dataclass
class Verdict:
    """The section of a report, and its figures; both empty where nothing is limited."""

    html: str = ""
    figures: list[Drawn] = field(default_factory=list)


def verdict(archive: xr.Dataset, targets: Sequence[str], choices: Mapping[str, str]) -> Verdict:
    """Judge the limits of an archive.

    `targets` are conditions such as "delta <= 1/250". SceneError refuses names that the archive
    does not have, and a reduced archive.
    """
    found = Verdict()
    conditions = conditions_of(targets, units_of(archive))
    if conditions and REDUCTION in archive.attrs:
        raise SceneError(
            "target: the archive was reduced and holds no designs; give `within` in [reduce]"
        )
    for condition in conditions:
        check_name(archive, condition.name)
        _target(found, archive, condition, choices)
    if REDUCTION not in archive.attrs:
        for name in (n for n in REQUIRED if n in archive and archive[n].size <= MOST_VALUES):
            found.html += _required(archive, name, choices)
        if any(name in archive for name in OVER_LIMITS):
            _shaft(found, archive)
        elif archive.sizes.get("speed", 0) > 1 and archive["speed"].dtype.kind in "iuf":
            # Without limits there is no verdict, but a figure, of the first design.
            speed = archive["speed"].values.astype(float)
            named = [n for n in _MODES if n in archive]
            modes = archive[named]
            first = {d: 0 for d in modes.dims if d not in ("mode", "order")}
            ends = float(speed.min()), float(speed.max())
            found.figures += campbell_figure(archive, modes.isel(first), ends)
    return found


# ---- targets -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Judged:
    """The worst value of a quantity for each design over all speeds, loads, misfires and parts."""

    sizes: dict[str, int]  # Dimensions that tell designs apart
    others: dict[str, int]  # Dimensions over which the worst counts
    worst: Floats  # Worst value of each design
    at: Integers  # Place of the worst value over the other dimensions, flat
    lacking: Integers  # Number of places of each design without a value, where others have one
    nowhere: int  # Number of places at which no design has a value, which do not count
    points: int  # Number of all places

    def place(self, design: int) -> dict[str, int]:
        """Place of a design along the dimensions that tell designs apart."""
        return _place(self.sizes, design)

    def where(self, design: int) -> dict[str, int]:
        """Place of the worst value of a design."""
        return _place(self.others, int(self.at[design]))


def _place(sizes: Mapping[str, int], flat: int) -> dict[str, int]:
    return {
        d: int(i) for d, i in zip(sizes, np.unravel_index(flat, [*sizes.values()]), strict=True)
    } if sizes else {}  # fmt: skip


def _judged(archive: xr.Dataset, condition: Constraint) -> _Judged:
    data = archive[condition.name]
    if data.size > MOST_VALUES:
        raise SceneError(
            f"target: {condition.name} has {data.size:,} values, at most {MOST_VALUES:,} are "
            "judged in a report; engine-dyn best reads more"
        )
    # Speeds and other points of work, and parts of the engine, are no designs.
    others = {str(d): n for d, n in data.sizes.items() if d in NOT_CHOSEN or d in DIMENSIONS}
    sizes = {str(d): n for d, n in data.sizes.items() if d not in others}
    values = data.transpose(*sizes, *others).values.astype(float)
    flat = values.reshape(math.prod(sizes.values()), -1)
    nowhere = ~np.isfinite(flat).any(axis=0)
    sign = 1.0 if condition.above else -1.0
    known = np.where(np.isfinite(flat), sign * flat, -np.inf)
    at = known.argmax(axis=1)
    worst = sign * known[np.arange(len(flat)), at]
    return _Judged(
        sizes, others, np.where(np.isfinite(worst), worst, np.nan), at,
        (~np.isfinite(flat[:, ~nowhere])).sum(axis=1), int(nowhere.sum()), nowhere.size,
    )  # fmt: skip


def _target(
    found: Verdict, archive: xr.Dataset, condition: Constraint, choices: Mapping[str, str]
) -> None:
    """Add the verdict on one condition: how many designs meet it, and each one's worst value."""
    judged = _judged(archive, condition)
    limit = condition.limit
    holds = condition.holds(judged.worst) & (judged.lacking == 0)
    sign = 1.0 if condition.above else -1.0
    margin = sign * (limit - judged.worst) / abs(limit) if limit else np.full(holds.size, np.nan)
    said = _lead(archive, condition, judged, holds, margin, choices)
    shown = _shown(holds, sign * (limit - judged.worst))
    heads = [*(_head(archive, d, choices) for d in judged.sizes), "worst", "at", "margin", ""]
    rows = []
    for i in shown:
        verdict = "holds" if holds[i] else "does not hold"
        if judged.lacking[i]:
            verdict = f"{judged.lacking[i]} without a result"
        rows.append([
            *(_cell(archive, d, p, choices) for d, p in judged.place(i).items()),
            _value(archive, condition, judged.worst[i], choices),
            _at(archive, judged.where(i), choices),
            f"{100.0 * margin[i]:+.3g} %" if np.isfinite(margin[i]) else "", verdict,
        ])  # fmt: skip
    parts = [f"<h3>{_text(condition, archive)}</h3>", said]
    if judged.nowhere and judged.nowhere < judged.points:
        parts.append(paragraph(
            f"Not counted: {judged.nowhere} of the {judged.points} points (speeds, loads, "
            "misfires, parts), at which no design has a value; see the outcomes."
        ))  # fmt: skip
    if _may_resonate(archive, condition.name):
        parts.append(paragraph(
            "This is said of the archive's own speeds alone: a resonance may lie between two of "
            "them. Where the shaft has a stress_limit or torque_limit, engine-dyn barred looks "
            "there.", "verdict",
        ))  # fmt: skip
    parts.append(table(heads, rows, range(len(judged.sizes))))
    if len(shown) < judged.worst.size:
        parts.append(paragraph(
            f"{len(shown)} of {counted(judged.worst.size, 'design')}, those next to the limit.",
            "note",
        ))  # fmt: skip
    found.html += "".join(parts)
    found.figures += target_figure(archive, condition, choices)


def _may_resonate(archive: xr.Dataset, name: str) -> bool:
    """Whether a quantity is of a shaft that vibrates, over several speeds."""
    dims = archive[name].dims
    elastic = not {*PLACES}.isdisjoint(map(str, dims)) or name == "delta_elastic"
    return elastic and "speed" in dims


def _text(condition: Constraint, archive: xr.Dataset) -> str:
    unit = converted(units_of(archive)(condition.name) or "1", None)[1]
    return text(str(condition) if condition.written else f"{condition} {unit}".rstrip())


def _lead(
    archive: xr.Dataset, condition: Constraint, judged: _Judged, holds: Any, margin: Floats,
    choices: Mapping[str, str],
) -> str:  # fmt: skip
    """The sentence that decides: the least inertia that holds, or how many designs hold."""

    def told(i: int) -> str:
        at = _at(archive, judged.where(i), choices)
        left = f", margin {100.0 * margin[i]:.3g} %" if np.isfinite(margin[i]) else ""
        value = _value(archive, condition, judged.worst[i], choices)
        return f"worst {value}{f' at {at}' if at else ''}{left}"

    number = judged.worst.size
    if not np.isfinite(judged.worst).any():
        return paragraph("No design has a value.", "verdict")
    if number == 1:
        word = "It holds" if holds[0] else "It does not hold"
        lack = f"; {judged.lacking[0]} without a result" if judged.lacking[0] else ""
        return paragraph(f"{word}: {told(0)}{lack}.", "verdict")
    key = next((d for d in judged.sizes if d in ("inertia", "flywheel_inertia")), None)
    best = int(np.nanargmin(np.where(condition.above, 1.0, -1.0) * judged.worst))
    if not holds.any():
        which = _at(archive, judged.place(best), choices)
        return paragraph(
            f"No design of {number} meets it; the nearest has {which}: {told(best)}.", "verdict"
        )
    if key is None:
        return paragraph(f"{holds.sum()} of {counted(number, 'design')} meet it.", "verdict")
    axis = [*judged.sizes].index(key)
    places = np.unravel_index(np.arange(number), [*judged.sizes.values()])[axis]
    inertias = archive[key].values[places]
    least = int(np.argmin(np.where(holds, inertias, np.inf)))
    lighter = np.unique(inertias[inertias < inertias[least]])
    near = f"; the next lighter one, {lighter[-1]:.4g}, does not" if lighter.size else ""
    which = _at(archive, judged.place(least), choices)
    return paragraph(
        f"The least inertia of the archive that meets it: {which}{near}; {told(least)}. "
        f"{holds.sum()} of {counted(number, 'design')} meet it.",
        "verdict",
    )


def _shown(holds: Any, left: Floats) -> list[int]:
    """Designs of the table: all, or those whose worst value lies next to the limit."""
    every = np.arange(left.size)
    if every.size <= MOST_DESIGNS:
        return every.tolist()
    size = np.where(np.isfinite(left), np.abs(left), np.inf)
    both = [every[mask][np.argsort(size[mask], kind="stable")[: MOST_DESIGNS // 2]]
            for mask in (holds, ~holds)]  # fmt: skip
    return sorted(np.concatenate(both).tolist())


def _head(archive: xr.Dataset, dim: str, choices: Mapping[str, str]) -> str:
    if dim not in archive.coords:
        return dim
    unit = converted(str(archive[dim].attrs.get("units", "1")), choices.get(dim))[1]
    return f"{dim} [{unit}]" if unit and dim not in words_of(archive) else dim


def _cell(archive: xr.Dataset, dim: str, index: int, choices: Mapping[str, str]) -> str:
    """A value along an axis without its unit, or the name of a design."""
    if dim not in archive.coords or dim in words_of(archive) or dim == "design":
        return _at(archive, {dim: index}, choices)
    factor, _ = converted(str(archive[dim].attrs.get("units", "1")), choices.get(dim))
    return number_text(float(archive[dim].values[index]) * factor)


def _at(archive: xr.Dataset, place: Mapping[str, int], choices: Mapping[str, str]) -> str:
    """A place along some axes in words."""
    words, texts = words_of(archive), []
    for dim, index in place.items():
        columns = [n for n, home in words.items() if archive[home].dims == (dim,)]
        home = words[columns[0]] if columns else dim
        if home not in archive.coords:
            texts.append(f"{dim} {index + 1}")
            continue
        value = archive[home].values[index]
        if dim == "misfire":
            texts.append("all cylinders fire" if value == 0 else f"misfire {value:g}")
            continue
        if dim == "wanted_delta":
            texts.append(f"{dim} {ratio_text(float(value))}")
            continue
        said = value_text(archive[home], value, choices.get(dim))
        texts.append(said if columns else f"{dim} {said}")
    return ", ".join(texts)


def _value(
    archive: xr.Dataset, condition: Constraint, value: float, choices: Mapping[str, str]
) -> str:
    if 0.0 < value < 0.5 and ratio_text(condition.limit).startswith("1/"):
        return f"1/{number_text(1.0 / value)}"
    return value_text(archive[condition.name], value, choices.get(condition.name))


def _required(archive: xr.Dataset, name: str, choices: Mapping[str, str]) -> str:
    """The largest inertia that any case needs, for each wanted delta and design."""
    data = archive[name]
    dims = [str(d) for d in data.dims]
    points = [d for d in dims if d in NOT_CHOSEN and d != "wanted_delta"]
    own = [d for d in dims if d not in points]
    values = data.transpose(*own, *points).values.astype(float)
    rows = []
    known = np.isfinite(values).any(axis=tuple(range(len(own), values.ndim)))
    for place in np.argwhere(known)[:MOST_DESIGNS].tolist():
        one = values[tuple(place)]
        flat = int(np.nanargmax(one))
        at = dict(zip(points, map(int, np.unravel_index(flat, one.shape)), strict=True))
        said = value_text(data, float(one.ravel()[flat]), choices.get(name))
        rows.append([_at(archive, dict(zip(own, place, strict=True)), choices), said,
                     _at(archive, at, choices)])  # fmt: skip
    if not rows:
        return ""
    meaning = one_line(data.attrs.get("long_name", name), 200)
    lead = f"Needed in every case: {rows[0][1]}, which {rows[0][2] or 'the design'} needs."
    parts = [f"<h3>{name}</h3>", paragraph(lead, "verdict") if len(rows) == 1 else ""]
    parts.append(paragraph(f"{meaning}.", "note"))
    if rows[1:]:
        parts.append(table(("", "needed in every case", "the case that needs it"), rows))
    if known.sum() > len(rows):
        parts.append(paragraph(f"The first {len(rows)} of {known.sum():,} are shown.", "note"))
    return "".join(parts)


# ---- shafts --------------------------------------------------------------------------------------


def _shaft(found: Verdict, archive: xr.Dataset) -> None:
    """Add the barred speeds of a shaft, or why there is no verdict on them."""
    found.html += "<h3>Limits of the shaft</h3>"
    file = one_line(archive.encoding.get("source") or "ARCHIVE", 200)
    command = f"engine-dyn barred {file}"
    try:
        number = points_of(archive)
        if number > MOST_SOLVED:
            raise SceneError(f"{number:,} points would be solved")
        solved = barred_ranges(archive)
    except SceneError as error:
        found.html += "".join(_unsolved(archive, command, one_line(error, 300)))
        return
    found.html += "".join(_barred(archive, solved))
    found.figures += [*barred_figure(archive, solved),
                      *campbell_figure(archive, solved.modes, solved.speeds, solved)]  # fmt: skip


def _barred(archive: xr.Dataset, solved: Barred) -> Iterator[str]:
    low, high = solved.speeds
    if solved.ranges:
        worst = max(solved.ranges, key=lambda one: one.largest)
        cases = [dict(case) for case in {str(one.case): one.case for one in solved.ranges}.values()]
        case = f", {case_text(archive, worst.case)}" if solved.cases[1:] else ""
        yield paragraph(
            f"Above the limit in {len(cases)} of {counted(len(solved.cases), 'case')}: up to "
            f"{worst.largest:.3g} times, {worst.place}{case}, at {worst.at:.5g} rpm.",
            "verdict",
        )
        rows = [range_cells(archive, one) for one in solved.ranges]
        yield table(HEADS, rows, (1, 4, 5))
    elif any(worst[1] for worst in solved.worst):
        yield paragraph(f"Within the limit from {low:g} to {high:g} rpm.", "verdict")
    yield listed([
        *notes(archive, solved),
        f"solved at {counted(solved.solved.size, 'speed')} between those of the archive",
    ])  # fmt: skip


def _unsolved(archive: xr.Dataset, command: str, why: str) -> Iterator[str]:
    """The worst value at the archive's own points, which says nothing about what lies between."""
    worst: list[Worst] = [
        one for one in worst_of_shaft(archive)
        if one.quantity in OVER_LIMITS and np.isfinite(one.value)
    ]  # fmt: skip
    if not worst:
        yield paragraph("No shaft has a limit.")
        return
    one = max(worst, key=lambda one: one.value)
    at = ", ".join(f"{k} {v:g}" for k, v in one.at.items() if isinstance(v, int | float))
    if one.value > 1.0:
        yield paragraph(f"Above the limit: {one.value:.3g} times, {one.place}, at {at}.", "verdict")
    else:
        yield paragraph(
            f"No verdict: at the points of the archive the largest is {one.value:.3g} of its "
            f"limit, {one.place}, at {at}; a resonance may lie between two of its speeds.",
            "verdict",
        )
    yield paragraph(f"Which speeds are barred was not solved here ({why}); {command} does it.")
