"""Results of searches for designs, as texts."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps.base.dimensions import DESIGN, FOUND
from sweeps.base.errors import counted, one_line
from sweeps.base.ratios import ratio_text
from sweeps.decide.explore.rows import fixed_of, rows
from sweeps.decide.optimise import ATTRIBUTE_OF_SEARCH
from sweeps.running.reduce.every_point import TEXT
from sweeps.scene.conditions import Constraint, constraint, units_of
from sweeps.view.texts.readable_units import converted
from sweeps.view.texts.tables import aligned, number_text, rows_text

if TYPE_CHECKING:
    import xarray as xr


def best_text(
    archive: xr.Dataset, design: xr.Dataset, quantities: Sequence[str] | None = None,
    units: str | None = None, width: int | None = None, within: Sequence[str] = (),
) -> str:  # fmt: skip
    """Describe what `sweeps.best` found in an archive: its conditions with units, and a table.

    `quantities`, `units` and `width` are those of the table (`rows`, `rows_text`), `within` are the
    conditions of the search.
    """
    place = fixed_of(archive, design)
    lines = [one_line(design.attrs[TEXT])] if TEXT in design.attrs else []
    if within:
        lines.append(f"conditions: {', '.join(_condition(text, archive) for text in within)}")
    shown = rows(design, quantities=quantities, limit=50)
    shown = replace(shown, fixed={**place, **shown.fixed})
    lines.append(rows_text(shown, units, width))
    return "\n".join(lines)


def _condition(text: str, archive: xr.Dataset) -> str:
    """A condition with the unit of its limit."""
    units = units_of(archive)
    condition = constraint(text, units)
    _, unit = converted(units(condition.name) or "", None)
    return str(condition) if condition.written else f"{condition} {unit}".rstrip()


MOST_OF_FRONT = 12  # Largest number of designs of a front that are printed, spread over it


def optimised_text(archive: xr.Dataset) -> str:
    """Describe what `sweeps.optimise` returned: what was found, and how sure that is."""
    about: dict[str, Any] = json.loads(archive.attrs[ATTRIBUTE_OF_SEARCH])
    best = np.flatnonzero(archive[FOUND].values == 1)
    wanted = [("least", name) for name in about["least"]]
    wanted += [("most", name) for name in about["most"]]
    lines: list[str] = []
    if not best.size:
        lines += _nothing(about)
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
    one = archive.isel({DESIGN: design})
    value, place = _worst(one, name, kind == "least")
    certain = {"": "best found: ", "inertia": "best found: "}.get(about["exact"], "")
    lines = [f"{certain}{kind} {name} = {_with_unit(archive, name, value)}{place}"]
    lines += [f"  {text}" for text in _parameters(archive, design, about, name)]
    if about["within"]:
        lines.append(f"conditions{_everywhere(about)}, each with its worst value:")
    for text in about["within"]:
        condition = constraint(text, units_of(archive))
        value, place = _worst(one, condition.name, condition.above)
        lines.append(f"  {text}: {_value(condition, archive, value)}{place}")
    return lines


def _front(
    archive: xr.Dataset, front: np.ndarray, wanted: list[tuple[str, str]], about: Mapping[str, Any]
) -> list[str]:
    """Table of the front, the best in the first quantity first."""
    worst = {
        name: [_worst(archive.isel({DESIGN: int(i)}), name, kind == "least")[0] for i in front]
        for kind, name in wanted
    }
    kind, name = wanted[0]
    order = np.argsort(np.array(worst[name]) * (1.0 if kind == "least" else -1.0), kind="stable")
    picked = order
    if len(order) > MOST_OF_FRONT:
        picked = order[np.unique(np.linspace(0, len(order) - 1, MOST_OF_FRONT).round().astype(int))]
    keys = [key for key in about["over"] if key not in worst]
    heads = [f"{kind} {name}{_bracket(archive, name)}" for kind, name in wanted]
    heads += [f"{key}{_bracket(archive, key)}" for key in keys]
    rows = [
        [number_text(worst[name][i]) for _, name in wanted]
        + [_cell(archive[key].values[front[i]]) for key in keys]
        for i in picked
    ]
    table = [f"  {line}" for line in aligned([heads, *rows])]
    some = f", {len(picked)} of them" if len(picked) < len(front) else ""
    best = "" if about["exact"] not in ("", "inertia") else "best found: "
    first = f"{best}front of {counted(len(front), 'design')}{some}"
    limits = f" with {' and '.join(about['within'])}" if about["within"] else ""
    return [f"{first}{limits}{_everywhere(about)}", *table]


def _nothing(about: Mapping[str, Any]) -> list[str]:
    """Reasons why no design was found."""
    each = [f"{n} meet {c}" for c, n in zip(about["within"], about["alone"], strict=True)]
    if about["lacking"]:
        each.append(
            f"{about['lacking']} have no result at some point, such as an engine at idle (see the "
            "outcomes, and --not-counted)"
        )
    told = f": {'; '.join(each)}" if each else ""
    return [
        f"no design meets all conditions{_everywhere(about)}; of "
        f"{counted(about['designs'], 'design')}{told}"
    ]


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
    if about["exact"] in ("", "inertia"):
        per = f"{about['generations']} generations of {about['number']} designs"
        searches = "1 search" if len(restarts) == 1 else f"{len(restarts)} searches"
        lines.append(f"{searches} of {per}, seed {about['seed']}")
        if wanted == 1:
            name = (about["least"] + about["most"])[0]
            each = [
                "none" if one["best"] is None else _with_unit(archive, name, one["best"][0], 6)
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


def _worst(one: xr.Dataset, name: str, largest: bool) -> tuple[float, str]:
    """The worst value of a name over the points of one design, and its place."""
    array = one[name]
    values = np.asarray(array.values, dtype=float)
    if not values.ndim:
        return float(values), ""
    if not np.isfinite(values).any():
        return math.nan, ""
    flat = int(np.nanargmax(values) if largest else np.nanargmin(values))
    place = np.unravel_index(flat, values.shape)
    said = []
    for dim, index in zip(map(str, array.dims), place, strict=True):
        words = f"{dim}_name"
        home = words if words in one.coords else dim
        at = one[home].values[index] if home in one.coords else index
        said.append(
            f"{dim} = {_cell(at)}{_bracket(one, home, ' {}') if home in one.coords else ''}"
        )
    return float(values[place]), f" at {', '.join(said)}"


def _parameters(archive: xr.Dataset, design: int, about: Mapping[str, Any], told: str) -> list[str]:
    """Searched parameters of a design but for one; values at the end of their range are marked."""
    texts = []
    for key, table in about["over"].items():
        if key == told:
            continue
        value = archive[key].values[design]
        text = f"{key} = {_cell(value)}{_bracket(archive, key, ' {}')}"
        if isinstance(table, dict) and not isinstance(value, str):
            low, high = float(table["low"]), float(table["high"])
            near = 1e-3 * (high - low)
            if abs(float(value) - low) <= near:
                text += ", the lower limit of its range"
            elif abs(float(value) - high) <= near:
                text += ", the upper limit of its range"
        texts.append(text)
    return texts


def _value(condition: Constraint, archive: xr.Dataset, value: float) -> str:
    if 0.0 < value < 0.1 and ratio_text(condition.limit).startswith("1/"):
        return f"1/{number_text(1.0 / value, 5)}"
    return _with_unit(archive, condition.name, value)


def _everywhere(about: Mapping[str, Any]) -> str:
    return f" at every {' and '.join(about['at_every'])}" if about["at_every"] else ""


def _with_unit(archive: xr.Dataset, name: str, value: float, digits: int = 4) -> str:
    return f"{number_text(value, digits)}{_bracket(archive, name, ' {}')}"


def _bracket(archive: xr.Dataset, name: str, form: str = " [{}]") -> str:
    unit = str(archive[name].attrs.get("units", "1"))
    return "" if unit == "1" else form.format(unit)


def _cell(value: Any) -> str:
    return one_line(value, 60) if isinstance(value, str) else number_text(float(value))
