"""Barred speeds of a shaft as texts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from engine_dyn.torsion.system import barred_range
from sweeps.base.errors import counted, one_line
from sweeps.base.numbers import number_text
from sweeps.decide.explore.attributes import members_of
from sweeps.decide.explore.barred import PROPULSION, Barred, BarredRange, Peak
from sweeps.view.texts.readable_units import converted
from sweeps.view.texts.tables import aligned

if TYPE_CHECKING:
    import xarray as xr

MISFIRE = "misfire"


def case_text(archive: xr.Dataset, case: Mapping[str, Any]) -> str:
    """A case in words: the cylinder that misfires, values of other axes with their units."""
    texts = []
    for key, value in case.items():
        if not isinstance(value, int | float):
            texts.append(one_line(value, 60))
            continue
        if key == MISFIRE:
            texts.append("all cylinders fire" if value == 0 else f"misfire {value:g}")
            continue
        unit = archive[key].attrs.get("units", "1") if key in archive.coords else "1"
        texts.append(f"{key} {number_text(float(value))} {converted(unit, None)[1]}".rstrip())
    return ", ".join(texts) or "all"


def limit_text(quantity: str) -> str:
    """What a limit is of: "stress", "torque" or "propulsion stress"."""
    return quantity.removeprefix("shaft_").removesuffix("_over_limit").replace("_", " ")


def range_text(one: BarredRange) -> str:
    """The edges of a range; in parentheses one where speeds end and the range may go on."""
    low, high = (f"{edge:.1f}".removesuffix(".0") for edge in (one.low, one.high))
    low = low if math.isfinite(one.low_between[0]) else f"({low})"
    high = high if math.isfinite(one.high_between[1]) else f"({high})"
    return f"{low} to {high}"


def cause_text(one: Peak) -> str:
    """Order and mode of a peak."""
    order = f"order {one.order:g}"
    if not one.mode:
        return f"{order}, no critical speed near"
    return f"{order}, mode {one.mode} (critical at {one.critical_speed:.5g} rpm)"


def range_rows(archive: xr.Dataset, one: BarredRange) -> list[list[str]]:
    """Rows of a table, one for each peak: case, range, shaft, limit, largest, where, cause.

    What all peaks share stands in the first row alone.
    """
    shared = [
        case_text(archive, one.case), range_text(one), one_line(one.place, 60),
        limit_text(one.quantity),
    ]  # fmt: skip
    return [
        [*(shared if not number else [""] * len(shared)),
         f"{peak.largest:.3g}", _or_nothing(peak.over_passing), f"{peak.at:.5g}",
         cause_text(peak)]
        for number, peak in enumerate(one.peaks)
    ]  # fmt: skip


def shaft_rows(archive: xr.Dataset, found: Barred) -> tuple[list[str], list[list[str]]]:
    """Heads and rows of a table, a row for each shaft and limit, healthy and with misfires."""
    groups: dict[str, list[BarredRange]] = {"": [*found.ranges]}
    if any(MISFIRE in case for case in found.cases):
        groups = {
            "all cylinders fire": [one for one in found.ranges if not one.case[MISFIRE]],
            "one cylinder misfires": [one for one in found.ranges if one.case[MISFIRE]],
        }
    heads = ["on", "limit of"]
    for name in groups:
        heads += [f"{name}: barred, rpm".removeprefix(": "), "largest over limit"]
    rows = []
    for place, quantity in dict.fromkeys((one.place, one.quantity) for one in found.ranges):
        row = [one_line(place, 60), limit_text(quantity)]
        own: list[BarredRange] = []
        for group in groups.values():
            of_group = [one for one in group if (one.place, one.quantity) == (place, quantity)]
            row += ([", ".join(map(range_text, _together(of_group))),
                     f"{max(one.largest for one in of_group):.3g}"]
                    if of_group else ["none", ""])  # fmt: skip
            own += of_group
        worst = max(own, key=lambda one: one.largest)
        of_case = f"{case_text(archive, worst.case)}: " if found.cases[1:] else ""
        rows.append([*row, _or_nothing(_over_passing(worst)),
                     f"{of_case}{worst.at:.5g} rpm, {cause_text(worst.peaks[0])}"])  # fmt: skip
    return [*heads, PASSING, "worst"], rows


def _or_nothing(ratio: float) -> str:
    return f"{ratio:.3g}" if math.isfinite(ratio) else ""


def cases_text(found: Barred) -> str:
    """How many of the cases that have a result have barred ranges."""
    number = len({str(one.case) for one in found.ranges})
    known = sum(1 for worst in found.worst if worst[1])
    of = " with a result" if known < len(found.cases) else ""
    return f"{number} of {counted(known, 'case')}{of}"


def _together(ranges: Sequence[BarredRange]) -> list[BarredRange]:
    """Ranges of speed that are barred in any case, on any shaft."""
    joined: list[BarredRange] = []
    for one in sorted(ranges, key=lambda one: one.low):
        if not joined or one.low > joined[-1].high:
            joined.append(one)
            continue
        last = joined[-1]
        low = min(last.low_between, one.low_between)  # An open end is infinite
        if (one.high, one.high_between) > (last.high, last.high_between):
            joined[-1] = replace(last, high=one.high, high_between=one.high_between)
        joined[-1] = replace(joined[-1], low_between=low)
    return joined


def union_text(ranges: Sequence[BarredRange]) -> str:
    """Speeds that lie in any of some ranges."""
    return ", ".join(range_text(one) for one in _together(ranges)) + " rpm"


def summary(archive: xr.Dataset, found: Barred) -> list[str]:
    """Sentences on the speeds that are barred in any case, and on what IACS UR M68 says of them."""
    if not found.ranges:
        return []
    said = [f"barred in any case, on any shaft: {union_text(found.ranges)}"]
    by_speed: dict[str, list[BarredRange]] = {}
    for one in found.ranges:
        if one.quantity == PROPULSION:
            by_speed.setdefault(f"{one.critical_speed:.5g}", []).append(one)
    return said + [_of_rule(archive, ranges) for ranges in by_speed.values()]


def _of_rule(archive: xr.Dataset, ranges: Sequence[BarredRange]) -> str:
    """What IACS UR M68 says of ranges about one critical speed.

    Its M68.6 has the limit for passing, up to 0.8 of the rated speed, and permits no barred range
    in normal running above.
    """
    whole, first = _together(ranges), ranges[0]
    about = f"about {first.critical_speed:.5g} rpm" if first.mode else "no critical speed near"
    said = [f"IACS UR M68, {about}: above its limit {union_text(ranges)}"]
    customary = customary_range(archive, first)
    if customary is not None:
        low, high = customary
        inside = low <= whole[0].low and whole[-1].high <= high
        beyond = "which holds all of that" if inside else "and what is above the limit beyond that"
        said.append(f"it bars {low:.1f} to {high:.1f} rpm, {beyond}")
    rated = _rated(archive)
    over = [one.over_passing for each in ranges for one in each.peaks]
    if (rated and max(one.high for one in whole) > 0.8 * rated) or not all(
        map(math.isfinite, over)
    ):
        said.append("it permits no barred range above 0.8 of the rated speed in normal running")
    worst = max(ranges, key=_over_passing)
    if math.isfinite(_over_passing(worst)):
        where = ", ".join([one_line(worst.place, 60), case_text(archive, worst.case)])
        said.append(f"{passing_text(_over_passing(worst))} ({where})")
    return "; ".join(said)


def _over_passing(one: BarredRange) -> float:
    return max((p.over_passing for p in one.peaks if math.isfinite(p.over_passing)),
               default=-math.inf)  # fmt: skip


def passing_text(ratio: float) -> str:
    """Whether a range may be passed quickly, by its stress over the limit for that."""
    if ratio <= 1.0:
        return f"below the limit for passing, {ratio:.3g} of it"
    return f"{ratio:.3g} times the limit for passing: barring does not suffice"


def _of_own_speeds(archive: xr.Dataset, found: Barred) -> list[str]:
    """Which of the archive's own speeds are barred."""
    if not found.ranges:
        return []
    inside = [
        f"{speed:g}" for speed in archive["speed"].values.tolist()
        if any(one.low <= speed <= one.high for one in found.ranges)
    ]  # fmt: skip
    own = f"{_some(inside, 12, ', ')} rpm {'are' if inside[1:] else 'is'}" if inside else "none is"
    return [f"of the archive's own {archive.sizes['speed']} speeds {own} in a barred range"]


def _rated(archive: xr.Dataset) -> float:
    """Rated speed of an archive [rpm]; 0 where it has none, or several."""
    rated = members_of(archive, "parameters").get("rated_speed")
    return float(rated) if isinstance(rated, int | float) and rated > 0.0 else 0.0


def customary_range(archive: xr.Dataset, one: BarredRange) -> tuple[float, float] | None:
    """Barred range of IACS UR M68 about a critical speed of a propulsion shaft [rpm].

    From 16 n/(18 - lambda) to (18 - lambda) n/16, lambda = n/n0. None for other limits, without a
    rated speed n0, without a critical speed n, and from 0.8 of the rated speed on.
    """
    rated = _rated(archive)
    if not rated or one.quantity != PROPULSION:
        return None
    low, high = barred_range(one.critical_speed, rated)
    return (float(low), float(high)) if math.isfinite(low) else None


PASSING = "over that for passing"

HEADS = ("case", "barred, rpm", "on", "limit of", "largest over limit", PASSING, "at rpm", "cause")


def notes(archive: xr.Dataset, found: Barred) -> list[str]:
    """Sentences on cases without a barred speed, on how sure edges are, and what is not known."""
    low, high = found.speeds
    barred = [one.case for one in found.ranges]
    free = [
        (case, worst) for case, worst in zip(found.cases, found.worst, strict=True)
        if case not in barred and worst[1]
    ]  # fmt: skip
    said = []
    if free:
        case, (value, place, speed) = max(free, key=lambda item: item[1][0])
        names = _some([case_text(archive, one) for one, _ in free])
        of_case = f" ({names})" if found.cases[1:] and barred else ""
        which = f", {case_text(archive, case)}" if free[1:] else ""
        said.append(
            f"no speed is barred between {low:g} and {high:g} rpm{of_case}: the largest is "
            f"{value:.3g} of its limit, {one_line(place, 60)}{which}, at {speed:.5g} rpm"
        )
    if found.step:
        said.append(
            f"each edge lies between two speeds that were solved, at most {found.step:.2g} rpm "
            "apart: above the limit at one, not at the other"
        )
    if any(
        math.isinf(one.low_between[0]) or math.isinf(one.high_between[1]) for one in found.ranges
    ):
        said.append(
            "in parentheses: the archive has no results beyond this speed, and the range may go on"
        )
    said += _of_own_speeds(archive, found)
    for case, worst, number, why in zip(
        found.cases, found.worst, found.without, found.outcomes, strict=True
    ):
        told = f" ({why})" if why else ""
        if not worst[1]:
            said.append(
                f"{case_text(archive, case)}: no result at any speed{told}, so that nothing is "
                "known of it"
            )
        elif number:
            said.append(
                f"{case_text(archive, case)}: {number} of {counted(found.solved.size, 'speed')} "
                f"without a result{told}, about which nothing is said"
            )
    if MISFIRE not in archive.coords:
        said.append("misfires are not in the archive: misfire = [0, 1, ...] in [axes] tries them")
    return said


def _some(names: Sequence[str], most: int = 8, comma: str = "; ") -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return comma.join(names[:most]) + more


def barred_text(archive: xr.Dataset, found: Barred) -> str:
    """Describe what `barred_ranges` found: a line for each range, and how sure it is."""
    low, high = found.speeds
    lines = []
    if found.ranges:
        lines = [counted(len(found.ranges), "barred range")]
        if found.cases[1:]:
            lines[0] += f" in {cases_text(found)}"
        rows = [row for one in found.ranges for row in range_rows(archive, one)]
        kept = [
            i for i, head in enumerate(HEADS)
            if not (head == "case" and not found.cases[1:])
            and not (head == "limit of" and not found.quantities[1:])
            and not (head == PASSING and PROPULSION not in found.quantities)
        ]  # fmt: skip
        table = [[HEADS[i] for i in kept], *([row[i] for i in kept] for row in rows)]
        left = [n for n, i in enumerate(kept) if HEADS[i] in ("case", "on", "limit of", "cause")]
        lines += [*(f"  {line}" for line in aligned(table, left))]
    solved = (
        f"solved at {found.solved.size:,} speeds between {low:g} and {high:g} rpm; the archive has "
        f"{archive.sizes['speed']} of them"
    )
    return "\n".join([*lines, *summary(archive, found), *notes(archive, found), solved])
