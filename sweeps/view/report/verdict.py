"""What a study decides, at the top of its report: limits, worst values, margins, which case.

Limits are the targets of the report and, of shafts, those of stress and torque. A shaft's verdict
between the speeds of an archive is solved; where that would take long, the report says so and names
the command that does it, and gives no verdict.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.status import MEANINGS
from engine_dyn.types import Booleans, Floats
from sweeps.base.dimensions import DESIGN, NOT_CHOSEN, REDUCTION
from sweeps.base.errors import SceneError, counted, one_line, shown
from sweeps.base.naming import meaning_of
from sweeps.base.numbers import number_text
from sweeps.decide.explore.attributes import count_of_designs, members_of, of_designs
from sweeps.decide.explore.barred import Barred, barred_ranges, points_of
from sweeps.decide.explore.search import INERTIAS, search_best
from sweeps.decide.explore.shaft_extremes import (
    OVER_LIMITS,
    PLACES,
    Worst,
    has_places,
    limited_by,
    worst_of_shaft,
)
from sweeps.running.reduce.every_point import KEPT, EveryPoint
from sweeps.scene.conditions import PARTS, Constraint, check_name, conditions_of, units_of
from sweeps.view.report.charts import Drawn
from sweeps.view.report.html import details, filled, listed, paragraph, table, text
from sweeps.view.report.verdict_figures import MODES, barred_figure, campbell_figure, target_figure
from sweeps.view.texts.barred import (
    HEADS,
    case_text,
    cases_text,
    notes,
    range_rows,
    shaft_rows,
    summary,
)
from sweeps.view.texts.optimised import decision_lines
from sweeps.view.texts.readable_units import converted
from sweeps.view.texts.reductions import at_points, counts_within
from sweeps.view.texts.wording import REQUIRED, Wording, margin_of

if TYPE_CHECKING:
    import xarray as xr

MOST_SOLVED = 50_000  # Largest number of points that a report solves, speeds times cases; some 5 s

MOST_VALUES = 20_000_000  # Largest number of values of a target that a report judges

MOST_DESIGNS = 12  # Largest number of designs in the table of a target


KEPT_LIMITS = "limits_kept"
"""Verdict on changes of load, judged also where no target is given."""

OF_LIMITS = ("largest_speed_fall", "largest_speed_rise", "longest_recovery_time")
"""Quantities that it is made of."""


@dataclass
class Verdict:
    """The section of a report, and its figures; all empty where nothing is limited."""

    html: str = ""
    figures: list[Drawn] = field(default_factory=list)
    at: Mapping[str, int] = field(default_factory=dict)  # Place of the point that decides
    design: Mapping[str, int] = field(default_factory=dict)  # Place of the design found last

    def decided_by(
        self, archive: xr.Dataset, place: Mapping[str, int], conditions: Sequence[Constraint]
    ) -> None:
        """Keep the point of a design that is nearest to a limit, unless one is known."""
        points = []
        for one in conditions if not self.at else ():
            data = archive[one.name].isel(place, missing_dims="ignore")
            values = np.atleast_1d(data.values.astype(float))
            if np.isfinite(values).any():
                at = np.unravel_index(np.nanargmax(values if one.above else -values), values.shape)
                worst = dict(zip(map(str, data.dims), map(int, at), strict=False))
                points.append((margin_of(one, float(values[at])), {**place, **worst}))
        if points:
            self.at = min(points, key=lambda point: point[0])[1]


def verdict(
    archive: xr.Dataset, targets: Sequence[str], not_counted: Sequence[str], units: str | None
) -> Verdict:
    """Judge the limits of an archive.

    `targets` are conditions such as "delta <= 1/250", judged as by `best`, which takes the outcomes
    `not_counted`; `units` are those of numbers. Of a reduced archive the designs that it kept are
    judged. SceneError refuses names that the archive does not have.
    """
    found, say = Verdict(), Wording(archive, units)
    if not targets and KEPT_LIMITS in archive and archive[KEPT_LIMITS].size <= MOST_VALUES:
        targets = [f"{KEPT_LIMITS} >= 1"]
    if not_counted and not targets:
        raise SceneError("report: not_counted is only used with target")
    if targets:
        _targets(found, archive, targets, not_counted, say)
    if REDUCTION not in archive.attrs:
        for name in (n for n in REQUIRED if n in archive and archive[n].size <= MOST_VALUES):
            found.html += _required(archive, name, say)
            found.decided_by(archive, {}, conditions_of([f"{name} <= 1"], units_of(archive)))
        if limited_by(archive):
            _shaft(found, archive)
        elif archive.sizes.get("speed", 0) > 1 and archive["speed"].dtype.kind in "iuf":
            # Without limits there is no verdict, but a figure, of the first design.
            speed = archive["speed"].values.astype(float)
            modes = archive[[n for n in MODES if n in archive]]
            first = {d: 0 for d in modes.dims if d not in ("mode", "order", "speed")}
            modes, ends = modes.isel(first), (float(speed.min()), float(speed.max()))
            found.figures += campbell_figure(modes, ends, say.fixed(archive, modes))
            lacking = [name for name in MODES if name not in archive]
            if lacking and not {"mode", "disc", "shaft"}.isdisjoint(map(str, archive.dims)):
                told = f"A Campbell diagram needs {', '.join(lacking)} among the quantities."
                found.html += paragraph(told, "note")
    return found


# ---- targets -------------------------------------------------------------------------------------


def _condition(target: str) -> str:
    """A target as a condition: with the "=" of figures, delta is limited from above."""
    equal = re.fullmatch(r"\s*+(\w++)\s*+=([^<>=]++)", target)
    if equal is None:
        return target
    name, limit = equal[1], equal[2].strip()
    if name != "delta":
        raise SceneError(
            f"target {shown(target)}: must say which side is wanted: '{name} <= {limit}' or "
            f"'{name} >= {limit}'"
        )
    return f"{name} <= {limit}"


def _targets(
    found: Verdict, archive: xr.Dataset, targets: Sequence[str], not_counted: Sequence[str],
    say: Wording,
) -> None:  # fmt: skip
    """Add the verdict on all targets together, and on each by itself."""
    targets = [_condition(target) for target in targets]
    conditions = conditions_of(targets, units_of(archive))
    if REDUCTION in archive.attrs:
        archive, told = _kept(archive, conditions)
        found.html += paragraph(told)
        say = Wording(archive, say.units)
    for condition in conditions:
        check_name(archive, condition.name)
        size = archive[condition.name].size
        if size > MOST_VALUES:
            raise SceneError(
                f"target: {condition.name} has {size:,} values, at most {MOST_VALUES:,} are "
                "judged in a report; engine-dyn best reads more"
            )
    if conditions[1:]:
        points = _points(archive, conditions)
        search = _search(archive, conditions, points, not_counted)
        for _ in search.judged():
            pass  # Designs are counted while they are read
        lines = _lines(found, archive, search, targets, say)
        found.html += f"<h3>All {len(conditions)} targets</h3>"
        found.html += paragraph(lines[0], "verdict") + listed(lines[1:])
    for target, condition in zip(targets, conditions, strict=True):
        _target(found, archive, target, condition, not_counted, say)


def _kept(archive: xr.Dataset, conditions: Sequence[Constraint]) -> tuple[xr.Dataset, str]:
    """The designs that a reduced archive kept, and what is known of the others."""
    every, kept = count_of_designs(archive), archive[of_designs(archive)]
    if not kept.data_vars or not kept.sizes.get(DESIGN, 0):
        raise SceneError(
            "target: the archive was reduced and kept no designs; a report judges those that "
            "[[reduce.best]] or [[reduce.front]] keep"
        )
    kept.attrs = {key: value for key, value in kept.attrs.items() if key != REDUCTION}
    kept.attrs[KEPT] = ""  # So that texts say that designs are kept ones
    number, about = kept.sizes[DESIGN], members_of(archive, REDUCTION)
    told = {tuple(one["within"]): one["text"] for one in about["kept"]}
    asked = [one for one in map(str, conditions) if (one,) in told]
    counts = [f" Of all: {told[(one,)]}." for one in asked]
    what = f"{count_of_designs(archive, 'points'):,}{' points' * bool(at_points(archive))}"
    counts += [
        f" Of all {what}, {n:,} meet {one}." for one, n in counts_within(archive)
        if one in map(str, conditions) and one not in asked
    ]  # fmt: skip
    return kept, (
        f"The archive was reduced: judged here {'is' if number == 1 else 'are'} the {number:,} "
        f"design{'s' * (number != 1)} that its searches kept, of {every:,}.{''.join(counts)}"
    )


def _search(
    archive: xr.Dataset, conditions: Sequence[Constraint], points: Sequence[str],
    not_counted: Sequence[str],
) -> EveryPoint:  # fmt: skip
    """All designs, judged at all their points; the worst value is that of the first condition."""
    wanted = [(conditions[0].name, 1.0 if conditions[0].above else -1.0)]
    outcomes = not_counted if points else ()
    return EveryPoint(archive, wanted, conditions, points, outcomes, choosing=False)


def _target(
    found: Verdict, archive: xr.Dataset, target: str, condition: Constraint,
    not_counted: Sequence[str], say: Wording,
) -> None:  # fmt: skip
    """Add the verdict on one condition: what `best` says of it, and the designs next to it."""
    sign = 1.0 if condition.above else -1.0
    search = _search(archive, [condition], _points(archive, [condition]), not_counted)
    size = tuple(search.sizes[d] for d in search.own)
    left, holds, lacking = np.empty(size), np.empty(size, bool), np.empty(size, int)
    for place, designs in search.judged():
        left[place] = sign * condition.limit - designs.worst[0]
        holds[place], lacking[place] = designs.fulfilling, designs.lacking
    found.design = {}
    lines = _lines(found, archive, search, [target], say)
    words = "flag_meanings" in archive[condition.name].attrs  # Without worst values and margins
    beside = [n for n in OF_LIMITS if n in archive and {*archive[n].dims} <= {*search.own}]
    if words:
        lines = [
            line for line in lines if not line.strip().startswith(("conditions", condition.name))
        ]
        design = archive.isel(found.design) if found.design else None
        lines += [f"its {n.replace('_', ' ')} {_value(design[n], say)}" for n in beside
                  if design is not None]  # fmt: skip
    away = np.where(np.isfinite(left) & (holds | ~holds.any()), np.abs(left), np.inf)
    nearest = map(int, np.unravel_index(away.argmin(), size)) if size else ()
    found.decided_by(archive, dict(zip(search.own, nearest, strict=True)), [condition])
    found.html += f"<h3>{text(say.condition(condition))}</h3>"
    found.html += paragraph(lines[0], "verdict") + (listed(lines[1:]) if lines[1:] else "")
    if _may_resonate(archive, condition.name):
        limited = condition.name in limited_by(archive)
        found.html += paragraph(
            "This is said of the archive's own speeds alone: a resonance may lie between two of "
            "them. " + ("The limits of the shaft below are solved between them, so that a value "
            "there may be larger." if limited else "Where the shaft has a stress_limit or "
            "torque_limit, engine-dyn barred looks there."), "verdict",
        )  # fmt: skip
    rows = []
    inertia = _inertia(archive, search.own)
    which = "those next to the limit"
    shown = _shown(holds.ravel(), left.ravel())
    if words and inertia and left.size > MOST_DESIGNS and holds.any():
        weights = archive[inertia].broadcast_like(archive[condition.name]).transpose(*search.own)
        lightest = np.argsort(weights.values, axis=None, kind="stable")
        shown = lightest[holds.ravel()[lightest]][:MOST_DESIGNS].tolist()
        which = f"those with the least {inertia} that hold"
    elif search.own == [DESIGN] and inertia and left.size > MOST_DESIGNS and holds.any():
        # In a list, those next to the limit differ in nothing that decides.
        lightest = np.argsort(archive[inertia].values, kind="stable")
        shown = lightest[holds[lightest]][:MOST_DESIGNS].tolist()
        which = f"those with the least {inertia} that hold"
    for i in shown:
        at = np.unravel_index(i, size) if size else ()
        one = archive.isel(dict(zip(search.own, map(int, at), strict=True)))
        value, worst = say.worst(one, condition.name, condition.above)
        number = int(lacking[at])
        verdict = "holds" if holds[at] else "does not hold"
        if number and not holds[at]:
            verdict = f"does not hold: {counted(number, 'point')} without a result"
            first = _first_lacking(one, condition.name, search.codes)
            verdict += f", first at {say.place(one, first)}" if first else ""
        known = np.isfinite(value)
        if words:
            rows.append([say.design(archive, one), verdict, *(_value(one[n], say) for n in beside)])
            continue
        rows.append([
            say.design(archive, one), verdict, say.value(condition, value) if known else "",
            say.margin(condition, value) if known else "", worst.removeprefix(" at "),
        ])  # fmt: skip
    if words:
        head, numbers = [n.replace("_", " ") for n in beside], [*range(2, 2 + len(beside))]
    else:
        head, numbers = ["worst", "margin", "at"], [2]
    found.html += filled(("design", "verdict", *head), rows, numbers)
    if len(shown) < left.size:
        found.html += paragraph(f"{len(shown)} of {counted(left.size, 'design')}, {which}.", "note")
    if not words:
        found.figures += target_figure(archive, condition, say.choices, found.design)


def _value(one: xr.DataArray, say: Wording) -> str:
    """A number of a design with its unit."""
    factor, unit = converted(str(one.attrs.get("units", "1")), say.choices.get(str(one.name)))
    value = factor * float(one)
    return f"{number_text(value)} {unit}" if np.isfinite(value) else "no value"


def _points(archive: xr.Dataset, conditions: Sequence[Constraint]) -> list[str]:
    """Axes that are not chosen with a design: speeds and other points of work, misfires."""
    dims = dict.fromkeys(str(d) for one in conditions for d in archive[one.name].dims)
    return [d for d in dims if d in NOT_CHOSEN]


def _inertia(archive: xr.Dataset, own: Sequence[str]) -> str:
    """The axis or column of the inertia of designs, if any."""
    found = (n for n in INERTIAS if n in archive.coords and archive[n].ndim)
    return next((n for n in found if {*archive[n].dims} <= {*own}), "")


def _lines(
    verdict: Verdict, archive: xr.Dataset, search: EveryPoint, targets: Sequence[str], say: Wording
) -> list[str]:
    """What decides, in the words of `best`: the design of least inertia, or with the best value."""
    if not search.fulfilling:
        return [search.nothing()]
    conditions = search.conditions
    if search.designs == 1:
        one = archive.isel(dict.fromkeys(search.own, 0))
        held = "It holds." if len(conditions) == 1 else "All hold."
        return [held, *say.conditions(one, conditions, search.asked)[1:], *search.missing()]
    inertia = _inertia(archive, search.own)
    if search.cases or not (inertia or len(conditions) == 1):
        return [search.text()]
    above = conditions[0].above
    wanted = {"least" if inertia or above else "most": inertia or conditions[0].name}
    not_counted = [MEANINGS[code] for code in search.codes]
    try:
        found = search_best(
            archive.assign_attrs(), **wanted, within=targets, at_every=search.asked,
            not_counted=not_counted,
        )  # fmt: skip
    except SceneError:  # Each design has a speed of its own, so that none is chosen
        return [search.text()]
    verdict.decided_by(archive, found.place, conditions)
    verdict.design = found.place
    return decision_lines(archive, found, say)


def _first_lacking(one: xr.Dataset, name: str, not_counted: Sequence[int]) -> dict[str, int]:
    """The first point of a design without a value, but for outcomes that do not count."""
    lacking = one[name].isnull()
    lacking = lacking.all([d for d in lacking.dims if d in PARTS])
    if "status" in one and {*one["status"].dims} <= {*lacking.dims}:
        lacking &= ~one["status"].isin(not_counted)
    if not lacking.ndim or not lacking.any():
        return {}
    at = np.unravel_index(int(lacking.values.argmax()), lacking.shape)
    return dict(zip(map(str, lacking.dims), map(int, at), strict=True))


def _may_resonate(archive: xr.Dataset, name: str) -> bool:
    """Whether a quantity is of a shaft that vibrates, over several speeds."""
    dims = archive[name].dims
    elastic = not {*PLACES}.isdisjoint(map(str, dims)) or name == "delta_elastic"
    return elastic and "speed" in dims


def _shown(holds: Booleans, left: Floats) -> list[int]:
    """Designs of the table: all, or those whose worst value lies next to the limit."""
    every = np.arange(left.size)
    if every.size <= MOST_DESIGNS:
        return every.tolist()
    size = np.where(np.isfinite(left), np.abs(left), np.inf)
    both = [every[mask][np.argsort(size[mask], kind="stable")[: MOST_DESIGNS // 2]]
            for mask in (holds, ~holds)]  # fmt: skip
    return sorted(np.concatenate(both).tolist())


def _required(archive: xr.Dataset, name: str, say: Wording) -> str:
    """The largest inertia that any case needs, for each wanted delta and design."""
    data = archive[name]
    points = [str(d) for d in data.dims if d in NOT_CHOSEN and d != "wanted_delta"]
    own = [str(d) for d in data.dims if d not in points]
    rows = []
    number = math.prod(data.sizes[d] for d in own)
    for flat in range(min(number, MOST_DESIGNS)):
        place = np.unravel_index(flat, [data.sizes[d] for d in own]) if own else ()
        one = archive.isel(dict(zip(own, map(int, place), strict=True)))
        value, at = say.worst(one, name, largest=True)
        lacking = int((~np.isfinite(one[name].values)).sum())
        cases = counted(one[name].size, "case")
        needed = f"of {cases}" + (f", {lacking} of them without a result" if lacking else "")
        known = say.number(name, value) if np.isfinite(value) else ""
        rows.append([say.design(archive, one), known, at.removeprefix(" at "), needed])
    if not any(row[1] for row in rows):
        return ""
    parts = [f"<h3>{text(name)}</h3>"]
    if len(rows) == 1:
        _, most, worst, cases = rows[0]
        lead = f"most {name} = {most}{f' at {worst}' if worst else ''}, {cases}"
        parts.append(paragraph(lead, "verdict"))
    parts.append(paragraph(f"{one_line(meaning_of(data.attrs, name), 200)}.", "note"))
    if rows[1:]:
        heads = ("", "needed in every case", "the case that needs most", "")
        parts.append(table(heads, rows, (1,)))
    if number > MOST_DESIGNS:
        parts.append(paragraph(f"The first {MOST_DESIGNS} of {number:,} are shown.", "note"))
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
    worst = int(np.argmax([value if place else -1.0 for value, place, _ in solved.worst]))
    _, part, speed = solved.worst[worst]
    dims = dict.fromkeys(str(d) for name in solved.quantities for d in archive[name].dims)
    others = [d for d in dims if d not in ("speed", "shaft")]
    at = np.unravel_index(worst, [archive.sizes[d] for d in others]) if others else ()
    near = int(np.abs(archive["speed"].values - speed).argmin())
    names = archive["shaft_name"].values.tolist() if "shaft_name" in archive else [part]
    shaft = names.index(part) if part else 0
    place = dict(zip(others, map(int, at), strict=True))
    found.at = found.at or {**place, "speed": near, "shaft": shaft}
    case = case_text(archive, solved.cases[0]) if solved.cases[0] else ""
    found.figures += [*barred_figure(archive, solved),
                      *campbell_figure(solved.modes, solved.speeds, case, solved)]  # fmt: skip


def _barred(archive: xr.Dataset, solved: Barred) -> Iterator[str]:
    low, high = solved.speeds
    if solved.ranges:
        for said in summary(archive, solved):
            yield paragraph(f"{said[0].upper()}{said[1:]}.", "verdict")
        worst = max(solved.ranges, key=lambda one: one.largest)
        case = f", {case_text(archive, worst.case)}" if solved.cases[1:] else ""
        yield paragraph(
            f"Above the limit in {cases_text(solved)}: up to "
            f"{worst.largest:.3g} times, {worst.place}{case}, at {worst.at:.5g} rpm."
        )
        heads, of_shafts = shaft_rows(archive, solved)
        yield filled(heads, of_shafts, _numbers(heads))
        rows = [row for one in solved.ranges for row in range_rows(archive, one)]
        if len(rows) > len(of_shafts):
            number = counted(len(solved.ranges), "range")
            yield details(f"Each case and peak: {number}", filled(HEADS, rows, _numbers(HEADS)))
    elif any(worst[1] for worst in solved.worst):
        lacking = sum(1 for worst in solved.worst if not worst[1])
        some = f", but for {counted(lacking, 'case')} without a result" if lacking else ""
        yield paragraph(f"Within the limit from {low:g} to {high:g} rpm{some}.", "verdict")
    yield listed([
        *notes(archive, solved),
        f"solved at {counted(solved.solved.size, 'speed')} between those of the archive",
    ])  # fmt: skip


def _numbers(heads: Sequence[str]) -> list[int]:
    return [i for i, head in enumerate(heads) if "over" in head or "rpm" in head]


def _unsolved(archive: xr.Dataset, command: str, why: str) -> Iterator[str]:
    """The worst value at the archive's own points, which says nothing about what lies between."""
    worst: list[Worst] = [
        one for one in (worst_of_shaft(archive) if has_places(archive) else [])
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
