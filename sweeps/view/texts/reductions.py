"""Results of [reduce] over all designs, as tables: statistics, counts within limits, searches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps.base.dimensions import REDUCTION
from sweeps.base.errors import one_line
from sweeps.base.numbers import last_digit, number_texts
from sweeps.decide.explore.attributes import count_of_designs, members_of
from sweeps.view.texts.readable_units import factor
from sweeps.view.texts.tables import aligned

if TYPE_CHECKING:
    import xarray as xr

LONGEST = 300


def outcomes_of_all(dataset: xr.Dataset) -> dict[str, int]:
    """Count the designs of each outcome that a reduced archive tells; {} where none can fail."""
    if "outcomes" not in dataset:
        return {}
    array = dataset["outcomes"]
    counts = array.values.sum(axis=tuple(i for i, d in enumerate(array.dims) if d != "outcome"))
    return dict(zip(map(str, dataset["outcome"].values), map(int, counts), strict=True))


def at_points(dataset: xr.Dataset) -> str:
    """Text on the points of the designs, where designs are judged at every one of several."""
    points = count_of_designs(dataset, "points")
    return f" at {points:,} points" if points > count_of_designs(dataset) else ""


def counts_within(dataset: xr.Dataset) -> list[tuple[str, int]]:
    """Each condition that designs, or their points, were counted by, and how many fulfil it."""
    if "designs_within" not in dataset:
        return []
    array = dataset["designs_within"]
    counts = array.values.sum(axis=tuple(i for i, d in enumerate(array.dims) if d != "condition"))
    return list(zip(map(str, dataset["condition"].values), map(int, counts), strict=True))


def searches(dataset: xr.Dataset) -> list[tuple[str, str]]:
    """Each search: the words that asked for it, and its result."""
    kept = members_of(dataset, REDUCTION).get("kept", [])
    return [(one["asked"], f"{one['found']:,} kept; {one['text']}") for one in kept]


def statistics_table(
    dataset: xr.Dataset, chosen: Mapping[str, str]
) -> tuple[list[str], list[list[str]]]:
    """Heads and rows of a table with a row for each quantity, in the units that are `chosen`.

    Where statistics leave axes, a cell has the smallest and the largest value along these.
    """
    keys = ["mean", "deviation", "smallest", "largest"]
    shares = np.atleast_1d(dataset["quantile"].values) if "quantile" in dataset else np.empty(0)
    picked = np.unique(np.linspace(0, shares.size - 1, 7).round().astype(int))
    picked = picked[: shares.size]
    heads = ["quantity", "unit", *keys, *(f"{100 * shares[i]:g} %" for i in picked), "values"]
    rows = []
    for name in members_of(dataset, REDUCTION).get("statistics", []):
        if f"{name}_mean" not in dataset:
            continue
        stored = str(dataset[f"{name}_mean"].attrs.get("units", "1"))
        unit = chosen.get(name, chosen.get(f"{name}_mean", stored))
        times = factor(stored, unit)
        numbers = [times * dataset[f"{name}_{key}"].values for key in keys]
        quantiles = times * dataset[f"{name}_quantile"].values
        quantiles = quantiles.reshape(-1, shares.size)
        numbers += [quantiles[:, i] for i in picked]
        last = last_digit(numbers[keys.index("smallest")], numbers[keys.index("largest")], 3)
        cells = [_extent(one, last) for one in numbers]
        count = f"{int(dataset[f'{name}_count'].values.sum()):,}"
        rows.append([name, "" if unit == "1" else one_line(unit, 40), *cells, count])
    return heads, rows


def _extent(values: Any, last: int | None) -> str:
    """A number, or the smallest and the largest of several."""
    known = values[np.isfinite(values)]
    if not known.size:
        return "-"
    ends = number_texts([float(known.min()), float(known.max())], last)
    return " to ".join(dict.fromkeys(ends))


def reduction_lines(dataset: xr.Dataset, chosen: Mapping[str, str]) -> list[str]:
    """Lines of a text about all of it."""
    lines = []
    within = counts_within(dataset)
    if within:
        points = f"{count_of_designs(dataset, 'points'):,}"
        lines += ["", f"{'points' if at_points(dataset) else 'designs'} within limits"]
        lines += [f"  {condition}: {n:,} of {points}" for condition, n in within]
    searched = searches(dataset)
    if searched:
        lines += ["", "searches"]
        lines += [f"  {n}. {asked}: {one_line(text, LONGEST)}"
                  for n, (asked, text) in enumerate(searched, start=1)]  # fmt: skip
    heads, rows = statistics_table(dataset, chosen)
    if rows:
        about = members_of(dataset, REDUCTION)
        over = ", ".join(about.get("over", [])) or "nothing"
        left = ", ".join(about.get("left", []))
        lines += [
            "",
            f"statistics over {over}" + (f"; from where to where along {left}" * bool(left)),
        ]
        lines += [f"  {line}" for line in aligned([heads, *rows], left=[0, 1])]
    indices = ", ".join(members_of(dataset, REDUCTION).get("indices", {}))
    if indices:
        lines.append(f"  Sobol' indices of {indices}: engine-dyn sensitivities")
    return lines
