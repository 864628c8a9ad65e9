"""Figures that a report shows above its explorer."""

from __future__ import annotations

from typing import Any

from sweeps.view.figures.polar import POLAR
from sweeps.view.report.embedding import Embedded

Specification = dict[str, Any]

FIRST_QUANTITIES = ("delta", "inertia_required", "flywheel_inertia_required", "torque_irregularity",
                    "torque_max", "torque_range", "shaking_force_max", "shaking_moment_max",
                    "crank_pin_load_max", "main_journal_load_max", "omega_max")  # fmt: skip
"""Quantities with one number for each design that are drawn first; others follow."""


MOST_CURVES = 8  # Most curves of one figure


NAMED = 60  # Most designs of a list whose names stand along an axis


def starting_places(page: Embedded) -> dict[str, int]:
    """Where the figures cut and the explorer begins: in the middle, of lists at the first."""
    return {
        dim: 0 if axis["list"] or axis["named_by"] or not axis["of_designs"] else axis["count"] // 2
        for dim, axis in page.axes.items()
    }


def key_figures(page: Embedded) -> list[Specification]:
    """Return what `drawing.js` draws: a kind, quantities, axes and places for each figure."""
    at = starting_places(page)
    figures = [*_numbers(page), *_maps(page), *_curves(page, "crank_angle"),
               *_polar(page), *_curves(page, "order")]  # fmt: skip
    for figure in figures:
        figure["at"] = at
        names = figure.get("quantities") or [figure["quantity"]]
        used = {figure.get("lines"), figure.get("over"), "direction"}
        used |= {page.columns[k]["dim"] for k in (figure.get("x"), figure.get("y")) if k}
        fixed = [d for n in names for d in page.quantities[n]["dims"]
                 if d not in used and page.axes[d]["count"] > 1
                 and not page.axes[d]["of_curves"]]  # fmt: skip
        figure["cut"] = list(dict.fromkeys(fixed))
    return figures


def _varying(page: Embedded, name: str) -> list[str]:
    """Dimensions of designs along which a quantity goes, numbers and long ones first."""
    axes = page.axes
    dims = [
        d for d in page.quantities[name]["dims"]
        if not axes[d]["of_curves"] and axes[d]["count"] > 1
    ]  # fmt: skip
    return sorted(
        dims, key=lambda d: (not axes[d]["of_designs"], axes[d]["named_by"] == d, -axes[d]["count"])
    )


def _single(page: Embedded) -> list[str]:
    """Quantities without curves, the most wanted first."""
    names = [
        n for n, q in page.quantities.items()
        if n not in page.flat | {"status"} and not n.endswith("_published") and _varying(page, n)
        and not any(page.axes[d]["of_curves"] for d in q["dims"])
    ]  # fmt: skip
    return sorted(names, key=lambda n: FIRST_QUANTITIES.index(n) if n in FIRST_QUANTITIES else 99)


def _has_lines(page: Embedded, dim: str) -> bool:
    """Whether lines for the values of a dimension can be told apart."""
    axis = page.axes[dim]
    return not axis["list"] or (axis["named_by"] is not None and axis["count"] <= MOST_CURVES)


def _across(page: Embedded, dim: str) -> str:
    """The column along an axis; for a list of designs their names, or a column of numbers."""
    axis = page.axes[dim]
    if not axis["list"]:
        return dim
    if axis["named_by"] and axis["count"] <= NAMED:
        return str(axis["named_by"])
    numbers = [c for c in axis["columns"] if "values" in page.columns[c]]
    return str(numbers[0]) if numbers else dim


def _numbers(page: Embedded) -> list[Specification]:
    figures = []
    for name in _single(page)[:3]:
        dims = _varying(page, name)
        others = [d for d in dims[1:] if _has_lines(page, d)]
        published = f"{name}_published"
        others_too = [published] if _same_dims(page, name, published) else []
        figures.append({
            "kind": "numbers", "quantities": [name, *others_too], "x": _across(page, dims[0]),
            "lines": others[0] if others and not others_too else None,
            "title": _sentence(page.quantities[name]["title"]),
        })  # fmt: skip
    return figures


def _same_dims(page: Embedded, name: str, other: str) -> bool:
    if other not in page.quantities:
        return False
    return set(page.quantities[name]["dims"]) == set(page.quantities[other]["dims"])


def _maps(page: Embedded) -> list[Specification]:
    for name in _single(page)[:1]:
        dims = _varying(page, name)
        pairs = [d for d in dims if not page.axes[d]["list"]][:2]
        lists = [d for d in dims if page.axes[d]["list"] and page.axes[d]["count"] > NAMED]
        if len(pairs) < 2 and lists:
            pairs = [c for c in page.axes[lists[0]]["columns"] if "values" in page.columns[c]][:2]
        if len(pairs) == 2:
            title = f"{_sentence(page.quantities[name]['title'])}, map"
            return [{"kind": "map", "quantity": name, "x": pairs[0], "y": pairs[1], "title": title}]
    return []


def _curves(page: Embedded, over: str) -> list[Specification]:
    """Speed at several designs, and quantities with the same unit in one figure."""
    if over not in page.axes or page.axes[over]["count"] < 2:
        return []
    names = [
        n for n, q in page.quantities.items()
        if over in q["dims"] and not (over == "order" and "crank_angle" in q["dims"])
        and n not in page.flat
    ]  # fmt: skip
    figures: list[Specification] = []
    if "omega" in names and _varying(page, "omega"):
        names.remove("omega")
        figures.append({"kind": "curves", "quantities": ["omega"], "over": over,
                        "lines": _compared(page, "omega")[0],
                        "title": _sentence(page.quantities["omega"]["title"])})  # fmt: skip
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(page.quantities[name]["unit"], []).append(name)
    for unit, group in sorted(groups.items(), key=lambda item: (item[0] != "N m", -len(item[1]))):
        if len(figures) >= 3:
            break
        title = _sentence(page.quantities[group[0]]["title"])
        if len(group) > 1:
            kind = {"N m": "Torques", "kN": "Forces", "rpm": "Speeds", "bar": "Pressures"}
            few = ", ".join(name.replace("_", " ") for name in group)
            other = "Curves" if over == "crank_angle" else "Orders"
            title = kind.get(unit, _sentence(few) if len(group) <= 3 else other)
        if over == "order":
            title += " over the order" if title != "Orders" else ""
        alone = _compared(page, group[0])[:1] if len(group) == 1 else []
        # Orders of more designs would hide each other.
        if over == "order" and alone and page.axes[alone[0]]["count"] > 4:
            alone = []
        figures.append({"kind": "curves", "quantities": group[:MOST_CURVES], "over": over,
                        "lines": alone[0] if alone else None, "title": title})  # fmt: skip
    return figures


def _compared(page: Embedded, name: str) -> list[str]:
    """Dimensions whose values may be lines of one figure: first those of a few names."""
    axes = page.axes
    return sorted(
        _varying(page, name),
        key=lambda d: not (axes[d]["named_by"] and axes[d]["count"] <= MOST_CURVES),
    )


def paths(page: Embedded) -> list[Specification]:
    """Forces whose two components can be drawn against each other: to the right, and up."""
    result: list[Specification] = []
    for name, quantity in page.quantities.items():
        if "crank_angle" not in quantity["dims"]:
            continue
        if name in page.planes:
            title = f"{_sentence(quantity['title'])}, locus over the cycle"
            result.append({"title": title, "right": [name, 0], "up": [name, 1]})
        for (right, up), said in POLAR.items():
            load = name.removesuffix(f"_{right}")
            other = f"{load}_{up}"
            if load != name and _same_dims(page, name, other):
                title = f"Locus of the load: {load.replace('_', ' ')}, {said}"
                result.append({"title": title, "right": [name, None], "up": [other, None]})
    return result


def _polar(page: Embedded) -> list[Specification]:
    figures = []
    for path in paths(page)[:2]:
        name = path["right"][0]
        lines = next(iter(_compared(page, name)), None)
        figures.append({"kind": "polar", "quantities": [name], "lines": lines, **path})
    return figures


def _sentence(title: str) -> str:
    return title[:1].upper() + title[1:]
