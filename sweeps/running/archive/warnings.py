"""Plausibility warnings in archives: those of what is given, and those of results as they are put.

They are one attribute, `warnings`, of a line each; it is empty where nothing is implausible.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.plausibility.judgement import Implausible
from engine_dyn.plausibility.usual_ranges import RESULT_CHECKS, Check
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import counted, one_line

ATTRIBUTE = "warnings"


def lines_of(path: Path) -> list[str]:
    """Lines of an archive that this process has just written."""
    from sweeps.base.netcdf.netcdf_files import opened_archive

    with opened_archive(path, own=True) as file:
        return str(file.getncattr(ATTRIBUTE)).splitlines() if ATTRIBUTE in file.ncattrs() else []


def of_results(lines: Iterable[str]) -> list[str]:
    """The lines that are about results."""
    names = tuple(f"{check.name}: " for check in RESULT_CHECKS)
    return [line for line in lines if line.startswith(names)]


@dataclass
class _Outside:
    """Results of one quantity outside their usual range, as far as they are counted."""

    check: Check
    count: int = 0
    worst: float = 0.0
    far: float = -math.inf
    place: tuple[int, ...] = ()


class Watch:
    """Looks at results while they are put into an archive or a dataset.

    Parameters
    ----------
    lines : iterable of str
        Those about what is given.
    checks : mapping
        Ranges of results, by their names.
    sizes : mapping
        Names and lengths of the dimensions of each of these results.
    axes : mapping
        Unit and values along dimensions.
    """

    def __init__(
        self,
        lines: Iterable[str],
        checks: Mapping[str, Check],
        sizes: Mapping[str, Mapping[str, int]],
        axes: Mapping[str, tuple[str, npt.NDArray[Any]]],
    ) -> None:
        self._lines = tuple(lines)
        self._seen = {name: _Outside(check) for name, check in checks.items()}
        self._sizes = sizes
        self._axes = axes

    def look(self, name: str, place: tuple[Any, ...], values: npt.NDArray[Any]) -> None:
        """Look at some values of a variable, in the units of files; `place` is their range."""
        seen = self._seen.get(name)
        if seen is None or not values.size:
            return
        low, high = seen.check.low, seen.check.high
        # fmin and fmax ignore NaN, the results of failed designs, and need no array of truth
        # values.
        least, most = float(np.fmin.reduce(values, None)), float(np.fmax.reduce(values, None))
        if not (least < low or most > high):
            return
        with np.errstate(invalid="ignore"):
            seen.count += int(np.count_nonzero(values < low) + np.count_nonzero(values > high))
        for value, far in ((least, low - least), (most, most - high)):
            if far > seen.far:
                index = np.unravel_index(int(np.argmax(values == value)), values.shape)
                starts = [s.start or 0 for s in place] if place else [0] * len(index)
                seen.place = tuple(s + int(i) for s, i in zip(starts, index, strict=True))
                seen.far, seen.worst = far, value

    def text(self) -> str:
        """The attribute: all lines of the archive."""
        lines = list(self._lines)
        for name, seen in self._seen.items():
            if seen.count:
                size = math.prod(self._sizes[name].values())
                one = Implausible(seen.check, seen.worst, (), "", name, seen.count, size)
                lines.append(one.text(self._where(name, seen, size)))
        return "\n".join(lines)

    def _where(self, name: str, seen: _Outside, size: int) -> str:
        """Number of designs outside, and the worst of them by its values along the axes."""
        if size == 1:
            return ""
        at = []
        for dimension, index in zip(self._sizes[name], seen.place, strict=True):
            if dimension == DESIGN:
                at.append(f"design {index + 1}")
            elif dimension in self._axes:
                unit, values = self._axes[dimension]
                value = values[index]
                shown = one_line(value) if isinstance(value, str) else f"{value:.6g}"
                at.append(f"{dimension} = {shown} {unit}".rstrip())
        return f"{seen.count} of {counted(size, 'value')}, the worst at {', '.join(at)}"
