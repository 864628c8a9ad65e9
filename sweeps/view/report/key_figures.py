"""Which figures a report shows above its explorer, and which ones are in it."""

from __future__ import annotations

from typing import Any

from sweeps.base.dimensions import POLAR
from sweeps.view.report.charts import Specification
from sweeps.view.report.embedding import Embedded

FIRST_QUANTITIES = ("delta", "inertia_required", "flywheel_inertia_required", "torque_irregularity",
                    "torque_max", "torque_range", "shaking_force_max", "shaking_moment_max",
                    "crank_pin_load_max", "main_journal_load_max", "omega_max",
                    "largest_speed_fall", "longest_recovery_time", "largest_speed_rise",
                    "time_to_start")  # fmt: skip
"""Quantities with one number for each design that are drawn first; others follow."""


MOST_CURVES = 8  # Largest number of curves of one figure


NAMED = 60  # Largest number of designs of a list whose names stand along an axis


def starting_places(page: Embedded) -> dict[str, int]:
    """Where figures and explorer begin: at the verdict, or the middle, the first of lists."""
    middle = {
        dim: 0
        if axis["list"] or axis["named_by"] or not axis["of_designs"] or dim == "misfire"
        else axis["count"] // 2
        for dim, axis in page.axes.items()
    }
    return {**middle, **page.start}


def key_figures(page: Embedded) -> list[Specification]:
    """Return what the page shows first: a kind of charts.py, quantities and axes of each figure."""
    figures = [*_numbers(page), *_maps(page), *_curves(page, "crank_angle"),
               *_polar(page), *_curves(page, "order")]  # fmt: skip
    for figure in figures:
        used = {figure.get("lines"), *(page.columns[figure[k]]["dim"] for k in "xy" if k in figure)}
        used |= {"direction"} if "up" in figure else set()
        figure["cut"] = list(dict.fromkeys(
            d for n in figure["quantities"] for d in page.quantities[n]["dims"]
            if d not in used and page.axes[d]["count"] > 1 and not page.axes[d]["of_curves"]
        ))  # fmt: skip
    return figures


def _varying(page: Embedded, name: str) -> list[str]:
    """Dimensions of designs along which a quantity varies, numbers and long ones first."""
    axes = page.axes
    dims = [
        d for d in page.quantities[name]["dims"]
        if not axes[d]["of_curves"] and axes[d]["count"] > 1
    ]  # fmt: skip
    return sorted(
        dims, key=lambda d: (not axes[d]["of_designs"], axes[d]["named_by"] == d, -axes[d]["count"])
    )


def _is_curve(page: Embedded, name: str) -> bool:
    return any(page.axes[d]["of_curves"] for d in page.quantities[name]["dims"])


def _single(page: Embedded) -> list[str]:
    """Quantities without curves, the most wanted first."""
    names = [
        n for n in page.quantities
        if n not in page.flat | {"status"} and not n.endswith("_published") and _varying(page, n)
        and not _is_curve(page, n)
    ]  # fmt: skip
    return sorted(names, key=lambda n: FIRST_QUANTITIES.index(n) if n in FIRST_QUANTITIES else 99)


def _has_lines(page: Embedded, dim: str) -> bool:
    """Whether lines for the values of a dimension can be told apart."""
    axis = page.axes[dim]
    return not axis["list"] or (axis["named_by"] is not None and axis["count"] <= MOST_CURVES)


def _across(page: Embedded, dim: str) -> str:
    """The column along an axis: names if few, and a column of numbers for a list of designs."""
    axis = page.axes[dim]
    if axis["named_by"] and axis["count"] <= NAMED:
        return str(axis["named_by"])
    if not axis["list"]:
        return dim
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
            "kind": "lines", "quantities": [name, *others_too], "label": name,
            "x": _across(page, dims[0]),
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
        pairs = [d for d in dims if not page.axes[d]["list"] and not _is_part(page, d)][:2]
        lists = [d for d in dims if page.axes[d]["list"] and page.axes[d]["count"] > NAMED]
        if len(pairs) < 2 and lists:
            pairs = [c for c in page.axes[lists[0]]["columns"] if "values" in page.columns[c]][:2]
        if len(pairs) == 2:
            title = f"{_sentence(page.quantities[name]['title'])}, map"
            return [{"kind": "map", "quantities": [name], "x": pairs[0], "y": pairs[1],
                     "title": title}]  # fmt: skip
    return []


def _is_part(page: Embedded, dim: str) -> bool:
    """Whether a dimension counts cylinders, shafts or other parts: nothing lies between them."""
    axis = page.axes[dim]
    return dim == "misfire" or not (axis["of_designs"] or axis["joined"])


def _curves(page: Embedded, over: str) -> list[Specification]:
    """Figures of the speed at several designs, and of quantities with one unit together."""
    if over not in page.axes or page.axes[over]["count"] < 2:
        return []
    names = [
        n for n, q in page.quantities.items()
        if over in q["dims"] and not (over == "order" and "crank_angle" in q["dims"])
        # A standard deviation, drawn next to its mean, would be a line at zero
        and n not in page.flat and not n.endswith("_std")
    ]  # fmt: skip
    kind = _kind(over)
    figures: list[Specification] = []
    if "omega" in names and _varying(page, "omega"):
        names.remove("omega")
        figures.append({"kind": kind, "quantities": ["omega"], "x": over,
                        "lines": _compared(page, "omega")[0],
                        "title": _sentence(page.quantities["omega"]["title"])})  # fmt: skip
    groups: dict[tuple[str, bool], list[str]] = {}
    for name in names:  # A torque and a moment on the engine's mounts are apart, both in N m
        groups.setdefault((page.quantities[name]["unit"], "moment" in name), []).append(name)
    for (unit, moments), group in sorted(
        groups.items(), key=lambda item: (item[0] != ("N m", False), -len(item[1]))
    ):
        if len(figures) >= 4:
            break
        title = _sentence(page.quantities[group[0]]["title"])
        if len(group) > 1:
            words = {
                "N m": "Moments" if moments else "Torques", "kN": "Forces", "rpm": "Speeds",
                "bar": "Pressures",
            }  # fmt: skip
            few = ", ".join(name.replace("_", " ") for name in group)
            other = "Curves" if over == "crank_angle" else "Orders"
            title = words.get(unit, _sentence(few) if len(group) <= 3 else other)
        if over == "order":
            title += " over the order" if title != "Orders" else ""
        alone = _compared(page, group[0])[:1] if len(group) == 1 else []
        # Orders of more than four designs would hide each other.
        if over == "order" and alone and page.axes[alone[0]]["count"] > 4:
            alone = []
        figures.append({"kind": kind, "quantities": group[:MOST_CURVES], "x": over,
                        "lines": alone[0] if alone else None, "title": title})  # fmt: skip
    return figures


def _compared(page: Embedded, name: str) -> list[str]:
    """Dimensions whose values may be lines of one figure, those with a few names first."""
    axes = page.axes
    return sorted(
        _varying(page, name),
        key=lambda d: not (axes[d]["named_by"] and axes[d]["count"] <= MOST_CURVES),
    )


def _kind(over: str) -> str:
    return "stems" if over == "order" else "lines"


def paths(page: Embedded) -> list[Specification]:
    """Forces whose two components can be drawn against each other: to the right, and up."""
    result: list[Specification] = []
    for name, quantity in page.quantities.items():
        if "crank_angle" not in quantity["dims"]:
            continue
        if name in page.planes:
            title = f"{_sentence(quantity['title'])}, locus over the cycle"
            result.append(_path(title, [name, 0], [name, 1]))
        for (right, up), said in POLAR.items():
            load = name.removesuffix(f"_{right}")
            other = f"{load}_{up}"
            if load != name and _same_dims(page, name, other):
                title = f"Locus of the load: {load.replace('_', ' ')}, {said}"
                result.append(_path(title, [name, None], [other, None]))
    return result


def _path(title: str, right: list[Any], up: list[Any]) -> Specification:
    return {"kind": "lines", "quantities": [right[0]], "x": "crank_angle", "right": right,
            "up": up, "title": title}  # fmt: skip


def _polar(page: Embedded) -> list[Specification]:
    return [
        {**path, "lines": next(iter(_compared(page, path["quantities"][0])), None)}
        for path in paths(page)[:2]
    ]


def _sentence(title: str) -> str:
    return title[:1].upper() + title[1:]


# ---- explorer ------------------------------------------------------------------------------------


def views(page: Embedded) -> list[Specification]:
    """Return the figures of the explorer: their kind, title and selectors.

    An option of a selector is its text and what it says of the figure.
    """
    names = [n for n in page.quantities if n != "status"]
    varied = [n for n in names if _varying(page, n) and not _is_curve(page, n)]
    result = [*_views_of_numbers(page, varied)]
    for over in ("crank_angle", "order"):
        if over in page.axes and page.axes[over]["count"] > 1:
            curves = [n for n in names if over in page.quantities[n]["dims"]]
            result += _views_of_curves(page, curves, over)
    loops = paths(page)
    if loops:
        others = _dims(page, [loop["quantities"][0] for loop in loops])
        options = [
            (loop["title"], {k: v for k, v in loop.items() if k != "title"}) for loop in loops
        ]
        result.append(_view("Path of a force over the cycle", "lines", [
            _choice("path", options), _each(page, [d for d in others if d != "direction"]),
        ]))  # fmt: skip
    return result


def _view(title: str, kind: str, choices: list[Specification]) -> Specification:
    return {"title": title, "kind": kind, "choices": choices}


def _choice(label: str, options: list[tuple[str, Specification]], text: str = "") -> Specification:
    """A selector; the option with a text is chosen at first, or the first one."""
    chosen = [told for told, _ in options].index(text) if text else 0
    return {"label": label, "options": options, "chosen": chosen}


def _quantity(page: Embedded, names: list[str]) -> tuple[str, Specification]:
    """The selector of a quantity; it begins with the quantity of the figures above."""
    varied = [n for n in names if _varying(page, n)]
    wanted = [n for n in (*_single(page), "omega", "delta", *varied, *names) if n in names]
    options = [(name, {"quantities": [name]}) for name in names]
    return wanted[0], _choice("quantity", options, wanted[0])


def _keys_of(label: str, side: str, keys: list[str], first: str) -> Specification:
    return _choice(label, [(key, {side: key}) for key in keys], first)


def _each(page: Embedded, dims: list[str], first: str = "") -> Specification:
    none = ("no other axis", {"lines": None})
    return _choice("a line for each", [none, *((dim, {"lines": dim}) for dim in dims)], first)


def _dims(page: Embedded, names: list[str]) -> list[str]:
    return list(dict.fromkeys(d for n in names for d in _varying(page, n)))


def _keys(page: Embedded, name: str) -> list[str]:
    """Axes and columns as abscissas of a quantity, the most useful first."""
    keys = []
    for dim in _varying(page, name):
        axis = page.axes[dim]
        own = [] if axis["list"] and axis["named_by"] not in (None, dim) else [dim]
        columns = [
            key for key in axis["columns"]
            if "values" in page.columns[key] or axis["count"] <= NAMED
        ]  # fmt: skip
        keys += [_across(page, dim), *own, *columns]
    return list(dict.fromkeys(keys))


def _views_of_numbers(page: Embedded, varied: list[str]) -> list[Specification]:
    if not varied:
        return []
    name, quantity = _quantity(page, varied)
    keys = list(dict.fromkeys(k for n in varied for k in _keys(page, n)))
    over = _keys(page, name)[0]
    dims = [
        d for d in _dims(page, varied) if not page.axes[d]["list"] or page.axes[d]["named_by"]
    ]  # fmt: skip
    lines = [
        d for d in _compared(page, name) if d != page.columns[over]["dim"] and _has_lines(page, d)
    ]  # fmt: skip
    result = [_view("Numbers over an axis", "lines", [
        quantity, _keys_of("over", "x", keys, over), _each(page, dims, next(iter(lines), "")),
    ])]  # fmt: skip

    def of_maps(name: str) -> list[str]:
        return [
            key for key in _keys(page, name)
            if ("values" in page.columns[key] or not page.axes[page.columns[key]["dim"]]["list"])
            and not _is_part(page, page.columns[key]["dim"])
        ]  # fmt: skip

    maps = [n for n in varied if len(of_maps(n)) > 1]
    if maps:
        name, quantity = _quantity(page, maps)
        keys = list(dict.fromkeys(k for n in maps for k in of_maps(n)))
        shown = next((figure for figure in _maps(page) if figure["quantities"] == [name]), None)
        across, up = (shown["x"], shown["y"]) if shown else of_maps(name)[:2]
        result.append(_view("Map over two axes", "map", [
            quantity, _keys_of("across", "x", keys, across), _keys_of("up", "y", keys, up),
        ]))  # fmt: skip
    return result


def _views_of_curves(page: Embedded, curves: list[str], over: str) -> list[Specification]:
    if not curves:
        return []
    groups: dict[str, list[str]] = {}
    for name in curves:
        groups.setdefault(page.quantities[name]["unit"], []).append(name)
    told = {
        unit: (f"all {len(names)}" if len(names) > 1 else names[0])
        + (f" in {unit}" if unit else "")
        for unit, names in groups.items()
    }
    options = [(told[u], {"quantities": names, "x": over}) for u, names in groups.items()]
    kind, word = _kind(over), over.replace("_", " ")
    title = "Curves of this design" if over == "crank_angle" else "Orders of this design"
    result = [_view(title, kind, [_choice("quantities", options, told.get("N m", ""))])]
    dims = _dims(page, curves)
    if dims:
        name, quantity = _quantity(page, curves)
        for _, option in quantity["options"]:
            option["x"] = over
        lines = next(iter(_compared(page, name)), dims[0])
        result.append(_view(f"One quantity over the {word}, several designs", kind, [
            quantity, _keys_of("a line for each", "lines", dims, lines),
        ]))  # fmt: skip
    return result
