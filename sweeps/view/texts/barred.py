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
from sweeps.decide.explore.barred import Barred, BarredRange, Peak
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
         f"{peak.largest:.3g}", f"{peak.at:.5g}", cause_text(peak)]
        for number, peak in enumerate(one.peaks)
    ]  # fmt: skip


def cases_text(found: Barred) -> str:
    """How many of the cases that have a result have barred ranges."""
    number = len({str(one.case) for one in found.ranges})
    known = sum(1 for worst in found.worst if worst[1])
    of = " with a result" if known < len(found.cases) else ""
    return f"{number} of {counted(known, 'case')}{of}"


def _together(found: Barred) -> list[BarredRange]:
    """Ranges of speed that are barred in any case, on any shaft."""
    joined: list[BarredRange] = []
    for one in sorted(found.ranges, key=lambda one: one.low):
        if not joined or one.low > joined[-1].high:
            joined.append(one)
            continue
        last = joined[-1]
        low = min(last.low_between, one.low_between)  # An open end is infinite
        if (one.high, one.high_between) > (last.high, last.high_between):
            joined[-1] = replace(last, high=one.high, high_between=one.high_between)
        joined[-1] = replace(joined[-1], low_between=low)
    return joined


def _of_all_cases(archive: xr.Dataset, found: Barred) -> list[str]:
    """Sentences on the speeds that are barred in any case, and on those of the archive."""
    joined = _together(found)
    if not joined:
        return []
    said = []
    if len(joined) < len(found.ranges):
        ranges = ", ".join(range_text(one) for one in joined)
        said = [f"barred in any case, on any shaft: {ranges} rpm"]
    inside = [
        f"{speed:g}" for speed in archive["speed"].values.tolist()
        if any(one.low <= speed <= one.high for one in joined)
    ]  # fmt: skip
    own = f"{_some(inside, 12, ', ')} rpm {'are' if inside[1:] else 'is'}" if inside else "none is"
    return [*said, f"of the archive's own {archive.sizes['speed']} speeds {own} in a barred range"]


def customary_range(archive: xr.Dataset, one: BarredRange) -> tuple[float, float] | None:
    """Barred range of IACS UR M68 about a critical speed of a propulsion shaft [rpm].

    None for other limits, without a rated speed, without a critical speed, and from 0.8 of the
    rated speed on.
    """
    rated = members_of(archive, "parameters").get("rated_speed")
    if not isinstance(rated, int | float) or not one.quantity.startswith("propulsion"):
        return None
    if rated <= 0.0:
        return None
    low, high = barred_range(one.critical_speed, rated)
    return (float(low), float(high)) if math.isfinite(low) else None


HEADS = ("case", "barred, rpm", "on", "limit of", "largest over limit", "at rpm", "cause")


def notes(archive: xr.Dataset, found: Barred) -> list[str]:
    """Sentences on cases without a barred speed, on how sure edges are, and what is not known."""
    low, high = found.speeds
    barred = [one.case for one in found.ranges]
    free = [
        (case, worst) for case, worst in zip(found.cases, found.worst, strict=True)
        if case not in barred and worst[1]
    ]  # fmt: skip
    said = []
    for one in found.ranges:
        customary = customary_range(archive, one)
        if customary is not None:
            low_end, high_end = customary
            said.append(
                f"{range_text(one)} rpm of {one_line(one.place, 60)} "
                f"({case_text(archive, one.case)}): IACS UR M68 bars {low_end:.1f} to "
                f"{high_end:.1f} rpm about {one.critical_speed:.5g} rpm, 16 n/(18 - lambda) to "
                "(18 - lambda) n/16; all that is above the limit must be within"
            )
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
    said += _of_all_cases(archive, found)
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
        ]  # fmt: skip
        table = [[HEADS[i] for i in kept], *([row[i] for i in kept] for row in rows)]
        left = [n for n, i in enumerate(kept) if HEADS[i] in ("case", "on", "limit of", "cause")]
        lines += [*(f"  {line}" for line in aligned(table, left))]
    solved = (
        f"solved at {found.solved.size:,} speeds between {low:g} and {high:g} rpm; the archive has "
        f"{archive.sizes['speed']} of them"
    )
    return "\n".join([*lines, *notes(archive, found), solved])
