"""What is said where a value that a command was given is not one of an axis."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from sweeps.base.axis_places import words_of
from sweeps.base.errors import SceneError, outside_axis
from sweeps.base.ratios import number_or_ratio
from sweeps.view.texts.tables import number_text

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["nearest_notes"]


def nearest_notes(archive: xr.Dataset, values: Mapping[str, float | str]) -> list[str]:
    """Lines about values of axes that the archive does not have, for which the nearest are taken.

    Numbers that look alike in a table, with its four digits, are the same. Words, and names that
    are no axes, are left to whoever cuts the archive.

    Parameters
    ----------
    archive : Dataset
        As `sweeps.open` returns it.
    values : mapping
        Values of axes, as `sweeps.nearest` takes them.

    Raises
    ------
    SceneError
        For numbers outside their axis.
    """
    notes = []
    words = words_of(archive)
    for name, value in values.items():
        if name in words or name not in archive.dims or name not in archive.coords:
            continue
        number = _number(value)
        axis = archive[name].values
        if not math.isfinite(number) or axis.dtype.kind not in "iuf":
            continue
        outside = outside_axis(number, axis)
        if outside:
            raise SceneError(f"{name} = {number:.12g}: {outside}")
        taken = float(axis[np.nanargmin(np.abs(axis - number))])
        if number_text(taken) != number_text(number):
            notes.append(
                f"{name} = {number:.12g} is not in the archive; the nearest value, "
                f"{number_text(taken)}, was taken"
            )
    return notes


def _number(value: float | str) -> float:
    """A value as a number; NaN for a word."""
    if isinstance(value, str):
        with contextlib.suppress(ValueError):
            return number_or_ratio(value)
        return math.nan
    return float(value)
