"""Where the designs of an archive failed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.status import MEANINGS, has_numbers
from sweeps.decide.explore.columns import columns_of
from sweeps.running.reduce.ranges import ranges
from sweeps.view.report.wording import FIRST_ROWS, value_text

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Failures", "failures"]

MOST_COUNTED = 24
"""Values of an axis at each of which failed designs are counted."""

GOOD = np.array([has_numbers(code) for code in range(256)])


@dataclass
class Failures:
    """Designs without numbers.

    Attributes
    ----------
    head : list of str
        Of the table of the first designs.
    first : list of list of str
        Their axes, columns and outcomes.
    where : list of tuple of str
        For each axis and column: its name, from where to where failed designs and all designs go,
        and how many failed at each value.
    """

    head: list[str]
    first: list[list[str]] = field(default_factory=list)
    where: list[tuple[str, str, str, str]] = field(default_factory=list)


def failures(archive: xr.Dataset, choices: Mapping[str, str]) -> Failures:
    """Find the designs that failed, reading a range at a time.

    Parameters
    ----------
    archive : Dataset
        With a status.
    choices : mapping of str
        Units of columns.
    """
    import xarray as xr

    status = archive["status"]
    dims = [str(d) for d in status.dims]
    columns = {n: v for n, v in columns_of(archive, dims, ["status"]).items() if v.ndim}
    if "status" not in columns:  # one design
        columns["status"] = xr.Variable(("design",), status.values[np.newaxis])
        dims = ["design"]
    sizes = {d: columns["status"].sizes[d] for d in dims}
    given = [n for n in columns if n != "status"]
    found = Failures([*given, "outcome"])
    spans = {n: [np.inf, -np.inf, np.inf, -np.inf] for n in given if _is_number(columns[n])}
    counts = {d: np.zeros(n, dtype=np.int64) for d, n in sizes.items() if n <= MOST_COUNTED}
    for begin, extent, read in ranges(columns, dims, [*sizes.values()]):
        codes = np.broadcast_to(read["status"], extent).astype(np.uint8)
        lost = ~GOOD[codes]
        for name, span in spans.items():
            _widen(span, np.broadcast_to(read[name], extent), lost)
        for axis, dim in enumerate(dims):
            if dim in counts:
                others = tuple(i for i in range(len(dims)) if i != axis)
                counts[dim][begin[axis] : begin[axis] + extent[axis]] += lost.sum(axis=others)
        for flat in np.flatnonzero(lost)[: FIRST_ROWS - len(found.first)]:
            at = np.unravel_index(flat, extent)
            texts = [
                value_text(columns[n], np.broadcast_to(read[n], extent)[at], choices.get(n))
                for n in given
            ]
            code = int(codes[at])
            why = MEANINGS[code] if code < len(MEANINGS) else str(code)
            found.first.append([*texts, why.replace("_", " ")])
    for name in given:
        variable, choice = columns[name], choices.get(name)
        at_each = _counted(variable, counts, sizes, choice) if name in dims else ""
        lost_span, both = ("", "")
        if name in spans and name != "design":
            span = spans[name]
            lost_span, both = (_span(variable, part, choice) for part in (span[:2], span[2:]))
        if at_each or lost_span:
            found.where.append((name, lost_span, both, at_each))
    return found


def _is_number(variable: xr.Variable) -> bool:
    return variable.dtype.kind in "fiu"


def _counted(
    variable: xr.Variable, counts: Mapping[str, npt.NDArray[np.int64]], sizes: Mapping[str, int],
    choice: str | None,
) -> str:  # fmt: skip
    """How many designs failed at each value of an axis at which some did."""
    dim = str(variable.dims[0])
    if dim not in counts or sizes[dim] < 2:
        return ""
    of_each = int(np.prod([n for d, n in sizes.items() if d != dim]))
    told = (
        f"{value_text(variable, value, choice)}: {n:,} of {of_each:,}"
        for value, n in zip(variable.values, counts[dim], strict=True)
        if n
    )
    return "; ".join(told)


def _widen(span: list[float], values: npt.NDArray[Any], lost: npt.NDArray[np.bool_]) -> None:
    for place, part in ((0, values[lost]), (2, values)):
        if part.size and np.isfinite(part).any():
            span[place] = min(span[place], float(np.nanmin(part)))
            span[place + 1] = max(span[place + 1], float(np.nanmax(part)))


def _span(variable: xr.Variable, span: Sequence[float], choice: str | None) -> str:
    low, high = span
    if not low <= high:
        return "no value"
    one, other = value_text(variable, low, choice), value_text(variable, high, choice)
    return one if low == high else f"{one} to {other}"
