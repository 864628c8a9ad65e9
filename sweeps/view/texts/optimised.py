"""Decisions as texts: the best design of an archive, and the result of a search for designs."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.status import MEANINGS, WITH_NUMBERS
from sweeps.base.dimensions import DESIGN, FOUND, STATUS, WORD_AXES
from sweeps.base.errors import counted, one_line
from sweeps.base.numbers import number_text
from sweeps.decide.explore.rows import Rows, rows
from sweeps.decide.explore.search import INERTIAS, Found, least_between
from sweeps.decide.optimise import ATTRIBUTE_OF_SEARCH
from sweeps.scene.conditions import PARTS, constraint, units_of
from sweeps.view.texts.tables import aligned, rows_text
from sweeps.view.texts.wording import Wording, everywhere, margin_of

if TYPE_CHECKING:
    import xarray as xr

MOST_ROWS = 10  # Largest number of rows below a decision


def best_text(
    archive: xr.Dataset, found: Found, quantities: Sequence[str] | None = None,
    units: str | None = None, width: int | None = None, *, python: bool = False,
) -> str:  # fmt: skip
    """Describe what `sweeps.best` found: the decision, its conditions, and at most ten rows.

    `archive` is the whole one, before it was cut. `quantities`, `units` and `width` are those of
    the table (`rows`, `rows_text`); what more could be shown is named by keywords if `python`.
    """
    say = Wording(archive, units)
    lines = decision_lines(archive, found, say)
    return "\n".join([*lines, _few_rows(found, say, quantities, width, python)])


def decision_lines(archive: xr.Dataset, found: Found, say: Wording) -> list[str]:
    """Lines on what `sweeps.best` found in an archive, and what decides it."""
    one, name = found.design, found.name
    value, worst = say.worst(one, name, found.least)
    fixed = say.fixed(archive, one, but=(name,))
    first = f"{'least' if found.least else 'most'} {name} = {say.number(name, value)}"
    if found.ranked:
        at = ", ".join(filter(None, (fixed, worst.removeprefix(" at "))))
        lines = [f"{first} at {at}" if at else first]
    else:
        lines = [f"{first}{worst}", *([f"  with {fixed}"] if fixed else [])]
    lines += say.conditions(one, found.conditions, found.at_every)
    return [*lines, *_of_how_many(found), *_near_the_grid(found, say)]


def _of_how_many(found: Found) -> list[str]:
    """Lines on the designs, or the cases, that the answer was taken from."""
    if not found.conditions and not found.at_every:
        lacking = f", {found.unsolved} of them without a result" if found.unsolved else ""
        what = counted(found.designs, "case" if found.cases else "design")
        return [f"of {what}{lacking}"] if found.designs > 1 else []
    alone = found.designs == 1 and ";" not in found.told
    lines = [] if alone else [one_line(found.told)]
    if found.cases and found.at_every and not found.least:
        lines.append(
            "no design to choose, so the smallest value over these axes counts; the largest is "
            "found without --at-every (at_every)"
        )
    return lines


def _near_the_grid(found: Found, say: Wording) -> list[str]:
    """A line on how near the least inertia of a grid is to what is needed."""
    name = found.name
    if not found.least or name not in INERTIAS or name not in found.place:
        return []
    between = least_between(found)
    if between is None:
        values = found.archive[name].values
        lightest = values.size > 1 and float(found.design[name]) == values.min()
        return ["the lightest of this archive; a lighter one may do"] if lightest else []
    needed, error = between
    digits = next((n for n, most in ((4, 1e-4), (3, 1e-3), (2, 1e-2)) if error <= most), 0)
    if not digits:
        return ["on the grid of this archive; a finer one may have a lighter design"]
    return [
        f"on the grid of this archive; interpolated between its values: "
        f"{say.number(name, needed, digits)}"
    ]


def _few_rows(
    found: Found, say: Wording, quantities: Sequence[str] | None, width: int | None, python: bool
) -> str:
    """The points of a design, the worst first, or the cases with the most or the least."""
    if found.ranked:
        one, key, largest = found.archive, found.name, not found.least
    else:
        one = _with_worst_parts(found, quantities or ())
        key, largest = _deciding(found, one)
    asked = [found.name, *(c.name for c in found.conditions), key]
    asked = [n for n in dict.fromkeys(asked) if n in one.data_vars]
    names: Sequence[str] | None = asked if found.ranked and asked else None
    if quantities:
        names = [*quantities, *(n for n in asked if n == key and n not in quantities)]
    sort = f"{'-' if largest else ''}{key}" if key else None

    def table(names: Sequence[str] | None) -> tuple[str, Rows]:
        shown = rows(one, quantities=names, limit=MOST_ROWS)
        if found.ranked or shown.number < shown.designs:  # Else the order is that of the axes
            shown = rows(one, quantities=names, sort=sort, limit=MOST_ROWS)
        few = without_repeats(shown)
        few = replace(few, fixed={}, designs=few.number, curves=(), several={}, elasticities=())
        text = rows_text(few, say.of_table(list(few.table)), width, python=python)
        if shown.number < shown.designs:
            order = f"with the {'largest' if largest else 'smallest'} {key}" if key else "in order"
            text += f"\nthe {shown.number} of {shown.designs:,} rows {order}"
        return text, shown

    text, shown = table(names)
    more = [n for several in shown.several.values() for n in several]
    if names is None and "\n\n" in text and asked:  # Several tables: only what the answer is about
        text, few = table([*asked, *(n for n in shown.table if n == STATUS)])
        more = [*(n for n in shown.table if n not in few.table), *more]
    if more:
        how = "quantities" if python else "--quantities"
        text += f"\nmore quantities ({how}): {', '.join(more)}"
    return text


def without_repeats(shown: Rows) -> Rows:
    """Rows that differ in a misfire or a word alone, as one row that lists these."""
    for key in [n for n in shown.given if n == "misfire" or n in WORD_AXES]:
        said = {
            name: [number_text(float(v)) if values.dtype.kind in "fiu" else str(v) for v in values]
            for name, values in shown.table.items()
        }
        groups: dict[tuple[str, ...], list[int]] = {}
        for row in range(shown.number):
            groups.setdefault(tuple(said[n][row] for n in said if n != key), []).append(row)
        first = [rows[0] for rows in groups.values()]
        table = {name: values[first] for name, values in shown.table.items()}
        if len(first) < shown.number:
            listed = [", ".join(said[key][i] for i in rows) for rows in groups.values()]
            table[key] = np.array(listed, dtype=object)
            units = {name: unit for name, unit in shown.units.items() if name != key}
            bands = {n: (low[first], high[first]) for n, (low, high) in shown.bands.items()}
            shown = replace(shown, table=table, units=units, bands=bands)
    return shown


def _with_worst_parts(found: Found, but: Sequence[str]) -> xr.Dataset:
    """The design, with the worst value of each quantity of parts that the search is about."""
    one = found.design
    largest = {c.name: c.above for c in found.conditions} | {found.name: found.least}
    for name, above in largest.items():
        over = tuple(i for i, d in enumerate(one[name].dims) if d in PARTS)
        if over and name not in but:
            left = [d for d in one[name].dims if d not in PARTS]
            values = (np.fmax if above else np.fmin).reduce(one[name].values, axis=over)
            one = one.drop_vars(name).assign({name: (left, values, one[name].attrs)})
    return one


def _deciding(found: Found, one: xr.Dataset) -> tuple[str, bool]:
    """Quantity whose worst points come first, and whether its largest values are the worst.

    It is that of the condition that is nearest to its limit, else what is optimised; "" where a
    design has only one point.
    """
    say = Wording(one)
    near = sorted(
        (margin_of(c, say.worst(one, c.name, c.above)[0]), number)
        for number, c in enumerate(found.conditions) if one[c.name].ndim
    )  # fmt: skip
    if near:
        condition = found.conditions[near[0][1]]
        return condition.name, condition.above
    return (found.name, found.least) if one[found.name].ndim else ("", False)


MOST_PLACES = 4  # Largest number of points without a result that are named

MOST_OF_FRONT = 12  # Largest number of designs of a front that are printed, spread over it


def optimised_text(archive: xr.Dataset) -> str:
    """Describe what `sweeps.optimise` returned: what was found, and how sure that is."""
    about: dict[str, Any] = json.loads(archive.attrs[ATTRIBUTE_OF_SEARCH])
    best = np.flatnonzero(archive[FOUND].values == 1)
    wanted = [("least", name) for name in about["least"]]
    wanted += [("most", name) for name in about["most"]]
    lines: list[str] = []
    if not best.size:
        lines += _nothing(archive, about)
    elif len(wanted) == 1:
        lines += _one(archive, int(best[0]), *wanted[0], about)
    else:
        lines += _front(archive, best, wanted, about)
    lines.append("")
    lines += _how(archive, about, len(wanted))
    return "\n".join(lines)


def _one(
    archive: xr.Dataset, design: int, kind: str, name: str, about: Mapping[str, Any]
) -> list[str]:
    """Lines on the best design: its parameters, and quantities that are optimised or limited."""
    one, say = archive.isel({DESIGN: design}), Wording(archive)
    value, place = say.worst(one, name, kind == "least")
    certain = {"": "best found: ", "inertia": "best found: "}.get(about["exact"], "")
    end = _end_of_range(value, about["over"].get(name))
    lines = [f"{certain}{kind} {name} = {say.number(name, value)}{place}{end}"]
    lines += [f"  {text}" for text in _parameters(archive, design, about, name)]
    conditions = [constraint(text, units_of(archive)) for text in about["within"]]
    lines += say.conditions(one, conditions, about["at_every"])
    left_out = _of_outcomes(one, say, about["not_counted"])
    return [*lines, *(f"left out (--not-counted, not_counted): {text}" for text in left_out)]


def _of_outcomes(one: xr.Dataset, say: Wording, words: Sequence[str]) -> list[str]:
    """How many points of a design have each of some outcomes, and where the first of them are."""
    if STATUS not in one:
        return []
    status, told = one[STATUS], []
    for word in words:
        places = np.argwhere(status.values == MEANINGS.index(word))
        if not len(places):
            continue
        dims = [str(d) for d in status.dims]
        named = [
            say.place(one, dict(zip(dims, map(int, place), strict=True)))
            for place in places[:MOST_PLACES]
        ]
        more = "; ..." if len(places) > MOST_PLACES else ""
        where = f" ({'; '.join(named)}{more})" if dims else ""
        told.append(f"{word}, {len(places)} of {counted(status.size, 'point')}{where}")
    return told


def _front(
    archive: xr.Dataset, front: np.ndarray, wanted: list[tuple[str, str]], about: Mapping[str, Any]
) -> list[str]:
    """Table of the front, the best in the first quantity first."""
    say = Wording(archive)
    worst = {
        name: [say.worst(archive.isel({DESIGN: int(i)}), name, kind == "least")[0] for i in front]
        for kind, name in wanted
    }
    kind, name = wanted[0]
    order = np.argsort(np.array(worst[name]) * (1.0 if kind == "least" else -1.0), kind="stable")
    picked = order
    if len(order) > MOST_OF_FRONT:
        picked = order[np.unique(np.linspace(0, len(order) - 1, MOST_OF_FRONT).round().astype(int))]
    keys = [key for key in about["over"] if key not in worst]
    heads = [f"{kind} {name}{say.bracket(name)}" for kind, name in wanted]
    heads += [f"{key}{say.bracket(key)}" for key in keys]
    rows = [
        [say.cell(name, worst[name][i]) for _, name in wanted]
        + [say.cell(key, archive[key].values[front[i]]) for key in keys]
        for i in picked
    ]
    table = [f"  {line}" for line in aligned([heads, *rows])]
    some = f", {len(picked)} of them" if len(picked) < len(front) else ""
    best = "" if about["exact"] not in ("", "inertia") else "best found: "
    first = f"{best}front of {counted(len(front), 'design')}{some}"
    limits = f" with {' and '.join(about['within'])}" if about["within"] else ""
    return [f"{first}{limits}{everywhere(about['at_every'])}", *table]


def _nothing(archive: xr.Dataset, about: Mapping[str, Any]) -> list[str]:
    """Reasons why no design was found."""
    needed = about.get("needed")
    of_delta = [n for c, n in zip(about["within"], about["alone"], strict=True) if "delta <" in c]
    if needed and not any(of_delta):
        say = Wording(archive)
        place = say.place(archive, needed["at"])
        some = "" if about["exact"].startswith("inverse") else " by the computed designs"
        return [
            f"no design: inertia = {say.number('inertia', needed['inertia'])} is needed{some}"
            f"{f' at {place}' if place else ''}, above {say.number('inertia', needed['most'])}, "
            "the end of the range that is searched (--over, over)"
        ]
    each = [f"{n} meet {c}" for c, n in zip(about["within"], about["alone"], strict=True)]
    if about["lacking"]:
        each.append(
            f"{about['lacking']} have no result at some point{_outcomes(archive)} (--not-counted "
            "leaves outcomes out)"
        )
    told = f": {'; '.join(each)}" if each else ""
    return [
        f"no design meets all conditions{everywhere(about['at_every'])}; of "
        f"{counted(about['designs'], 'design')}{told}"
    ]


def _outcomes(archive: xr.Dataset) -> str:
    """Outcomes without a result in an archive, in brackets."""
    if STATUS not in archive:
        return ""
    codes = np.unique(archive[STATUS].values)
    words = [MEANINGS[int(c)] for c in codes if 0 <= c < len(MEANINGS) and c not in WITH_NUMBERS]
    return f": {', '.join(words)}" if words else ""


def _how(archive: xr.Dataset, about: Mapping[str, Any], wanted: int) -> list[str]:
    """Lines on the way of the search, and on the trust in its result."""
    lines = []
    certain = {
        "inverse": "exact: the inertia follows from the limit of delta, and no other parameter "
        "varies",
        "inverse of all": "exact: every combination of the other parameters was computed, each "
        "with the least inertia, which follows from the limit of delta",
        "all": f"all {counted(about['designs'], 'design')} that are possible were computed, so "
        "there is no better one",
        "inertia": "the inertia of every design follows exactly from the limit of delta; the "
        "other parameters were searched, so a better design may exist",
        "": "the best of all computed designs; a better one may exist",
    }
    if about["fulfilling"] or about["exact"]:
        lines.append(certain[about["exact"]])
    at = f" at {counted(about['points'], 'point')} each" if about["points"] > 1 else ""
    some = about["fulfilling"] != 1
    verb = ("meet" if some else "meets") if about["within"] else "have" if some else "has"
    what = "the conditions" if about["within"] else "a result"
    met = f"{about['fulfilling']} {verb} {what}"
    lines.append(f"{counted(about['designs'], 'design')} computed{at}, {met}")
    if about["lacking"] and about["fulfilling"]:
        lines.append(f"{counted(about['lacking'], 'design')} without a result at some point")
    restarts = about["restarts"]
    if about.get("line"):
        evenly = f"{about['number']} designs evenly over the range (--designs, number)"
        lines.append(f"{evenly}, then ever finer beside the best")
    elif about["exact"] in ("", "inertia"):
        per = f"{about['generations']} generations of {about['number']} designs"
        searches = "1 search" if len(restarts) == 1 else f"{len(restarts)} searches"
        lines.append(f"{searches} of {per}, seed {about['seed']}")
        if wanted == 1:
            name, say = (about["least"] + about["most"])[0], Wording(archive)
            each = [
                "none" if one["best"] is None else say.number(name, one["best"][0], 6)
                for one in restarts
            ]
            lines.append(f"each found: {', '.join(each)}")
        else:
            each = [str(one["of_the_found"]) for one in restarts]
            lines.append(f"designs of the front by search: {', '.join(each)}")
    took = f"{about['seconds']:.2f} s, of which {about['computing']:.2f} s computing"
    if about["designs"] >= 100:
        rate = about["designs"] / about["seconds"]
        took += f"; {number_text(rate, 3)} designs a second"
    lines.append(took)
    if about["left_out"]:
        lines.append(f"not shown, because they are curves: {', '.join(about['left_out'])}")
    return lines


def _parameters(archive: xr.Dataset, design: int, about: Mapping[str, Any], told: str) -> list[str]:
    """Searched parameters of a design but for one; values at the end of their range are marked."""
    say = Wording(archive)
    return [
        f"{key} = {say.both(key, archive[key].values[design])}"
        f"{_end_of_range(archive[key].values[design], table)}"
        for key, table in about["over"].items() if key != told
    ]  # fmt: skip


def _end_of_range(value: Any, table: Any) -> str:
    """Words on a value that is at an end of the range that was searched."""
    if not isinstance(table, dict) or isinstance(value, str):
        return ""
    low, high = float(table["low"]), float(table["high"])
    near = 1e-3 * (high - low)
    if abs(float(value) - low) <= near:
        return ", the lower limit of its range"
    return ", the upper limit of its range" if abs(float(value) - high) <= near else ""
