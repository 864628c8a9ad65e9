"""Published against computed values, as a table for people."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from sweeps.base.dimensions import PUBLISHED

if TYPE_CHECKING:
    import xarray as xr

LABEL_WIDTH = 24
NUMBER_WIDTH = 11
PERCENT_WIDTH = 9
MOST_ROWS = 400

_COLUMN = 2 * NUMBER_WIDTH + PERCENT_WIDTH + 1  # Width of one quantity with the blank in front


def text(dataset: xr.Dataset) -> str:
    """Table of published against computed values, row by row, differences in percent.

    Rows are the designs or points of the axes that the variables `<quantity>_published` belong to;
    where the computed values have further axes (a list of methods, for example), each of their
    points has a row. Quantities stand side by side as far as 120 columns go.
    """
    names = [str(name) for name in dataset.data_vars if str(name).endswith(PUBLISHED)]
    quantities = [name.removesuffix(PUBLISHED) for name in names]
    compared = [quantity for quantity in quantities if quantity in dataset]
    lines: list[str] = []
    for group in _groups(dataset, compared):
        lines += [*_table(dataset, group), ""]
    left_out = [quantity for quantity in quantities if quantity not in dataset]
    if left_out:
        lines.append(f"Published but not requested in [output] quantities: {', '.join(left_out)}")
    return "\n".join(lines).rstrip()


def _groups(dataset: xr.Dataset, quantities: list[str]) -> Iterator[list[str]]:
    """Groups of quantities that share a table: with the same rows, as many as fit on a line."""
    fit = (120 - LABEL_WIDTH) // _COLUMN
    by_rows: dict[tuple[Hashable, ...], list[str]] = {}
    for quantity in quantities:
        by_rows.setdefault(_dimensions(dataset, quantity), []).append(quantity)
    for group in by_rows.values():
        for start in range(0, len(group), fit):
            yield group[start : start + fit]


def _dimensions(dataset: xr.Dataset, quantity: str) -> tuple[Hashable, ...]:
    """Dimensions of the published or the computed values, in the archive's order."""
    used = {*dataset[quantity].dims, *dataset[quantity + PUBLISHED].dims}
    return tuple(dimension for dimension in dataset.sizes if dimension in used)


def _table(dataset: xr.Dataset, quantities: list[str]) -> list[str]:
    dimensions = _dimensions(dataset, quantities[0])
    sizes = tuple(dataset.sizes[dimension] for dimension in dimensions)
    pairs = []
    for quantity in quantities:
        published = _over_all_dimensions(dataset[quantity + PUBLISHED], dimensions, dataset.sizes)
        computed = _over_all_dimensions(dataset[quantity], dimensions, dataset.sizes)
        pairs.append((published, computed))

    units = [dataset[q].attrs.get("units", "") for q in quantities]
    heads = [f"{q} [{u}]" if u else q for q, u in zip(quantities, units, strict=True)]
    lines = [
        " " * LABEL_WIDTH
        + "".join(f" {_shortened(head, _COLUMN - 1):>{_COLUMN - 1}}" for head in heads),
        " " * LABEL_WIDTH
        + (
            f" {'published':>{NUMBER_WIDTH}}{'computed':>{NUMBER_WIDTH}}{'diff.':>{PERCENT_WIDTH}}"
            * len(quantities)
        ),
    ]
    worst: list[tuple[float, str]] = [(0.0, "")] * len(quantities)
    rows = 0
    for place in np.ndindex(*sizes):
        values = [(float(p[place]), float(c[place])) for p, c in pairs]
        if all(math.isnan(published) for published, _ in values):
            continue
        label = _label(dataset, dimensions, place)
        for i, pair in enumerate(values):
            difference = _difference(*pair)
            if abs(difference) > abs(worst[i][0]):
                worst[i] = (difference, label)
        rows += 1
        if rows <= MOST_ROWS:
            head = f"{_shortened(label, LABEL_WIDTH):<{LABEL_WIDTH}}"
            lines.append((head + "".join(map(_cells, values))).rstrip())
    if rows > MOST_ROWS:
        lines.append(f"... and {rows - MOST_ROWS} more rows")
    lines += [
        f"largest difference of {quantity}: {_percent(difference)} ({label or 'the only row'})"
        for quantity, (difference, label) in zip(quantities, worst, strict=True)
        if difference
    ]
    return lines


def _over_all_dimensions(
    values: xr.DataArray, dimensions: tuple[Hashable, ...], sizes: Mapping[Hashable, int]
) -> np.ndarray:
    """Values over all the dimensions of a table, repeated along those that they lack."""
    own = [d for d in dimensions if d in values.dims]
    ordered = values.values.transpose([values.dims.index(d) for d in own])
    whole = ordered[tuple(slice(None) if d in own else None for d in dimensions)]
    return np.broadcast_to(whole, [sizes[d] for d in dimensions])


def _label(dataset: xr.Dataset, dimensions: tuple[Hashable, ...], place: tuple[int, ...]) -> str:
    """Name of a row: the words along a dimension if any, otherwise its value."""
    parts = []
    for dimension, index in zip(dimensions, place, strict=True):
        words = [
            coordinate
            for name, coordinate in dataset.coords.items()
            if name != dimension
            and coordinate.dims == (dimension,)
            and coordinate.dtype.kind in "UOT"
        ]
        if words:
            parts.append(str(words[0].values[index]))
        else:
            value = dataset[dimension].values[index] if dimension in dataset.coords else index
            parts.append(f"{dimension} {value:g}")
    return ", ".join(parts)


def _difference(published: float, computed: float) -> float:
    """Difference in percent of the published value; 0 where it cannot be computed."""
    if math.isnan(published) or not math.isfinite(computed) or published == 0.0:
        return 0.0
    return 100.0 * (computed - published) / abs(published)


def _percent(difference: float) -> str:
    """Difference with its sign, without one if it rounds to zero."""
    text = f"{difference:+.2f}"
    return f"{text[1:] if float(text) == 0.0 else text} %"


def _cells(values: tuple[float, float]) -> str:
    published, computed = values
    if math.isnan(published):
        return " " * _COLUMN
    result = f"{computed:.6g}" if math.isfinite(computed) else "none"
    percent = ""
    if math.isfinite(computed) and published != 0.0:
        percent = _percent(_difference(published, computed))
    return f" {published:>{NUMBER_WIDTH}.6g}{result:>{NUMBER_WIDTH}}{percent:>{PERCENT_WIDTH}}"


def _shortened(label: str, width: int) -> str:
    return label if len(label) <= width else label[: width - 2] + ".."
