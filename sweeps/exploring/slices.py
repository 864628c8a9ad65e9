"""Slices of archives, nearest to values of their axes."""

from __future__ import annotations

import contextlib
import math
from typing import TYPE_CHECKING

import numpy as np

from sweeps.checks import check_dataset
from sweeps.errors import SceneError, not_known, shown
from sweeps.ratios import number_or_ratio

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["nearest", "words_of"]


def nearest(archive: xr.Dataset, **values: float | str) -> xr.Dataset:
    """Slice of an archive, nearest to values of its axes.

    Parameters
    ----------
    archive : Dataset
        As `open` or `run` returns it.
    **values : float or str
        A value of each axis to be cut, in the units of the archive, a fraction such as "1/200", or
        a word of an axis of words, or its number: `nearest(archive, load=50, method="newton")`. Of
        equally near values the first is taken. Designs may also be named, `case="B"`,
        `engine="ntua"`: where several have that label, all of them stay.

    Returns
    -------
    Dataset
        With the coordinates of what was taken.

    Raises
    ------
    SceneError
        For a name that is no axis, and for values that are neither numbers nor words of the axis.

    Examples
    --------
    >>> import sweeps
    >>> archive = sweeps.run(
    ...     engine="ntua",
    ...     axes={"inertia": [5, 20, 40], "speed": [1200, 1500]},
    ...     output={"quantities": ["delta", "torque_mean"]},
    ... )
    >>> one = sweeps.nearest(archive, inertia=18, speed=1510)
    >>> float(one.inertia), float(one.speed)
    (20.0, 1500.0)
    """
    check_dataset(archive)
    places: dict[str, list[int]] = {}
    labelled: set[str] = set()
    for name, value in values.items():
        dimension, found = _places_of(archive, name, value)
        both_labels = name != dimension and dimension in labelled
        if dimension in places and not both_labels:
            raise SceneError(
                f"{name}: the axis {dimension} is selected twice; give one value of it"
            )
        if both_labels:
            found = [place for place in found if place in places[dimension]]
            if not found:
                raise SceneError(
                    f"{name} = {shown(value)}: no design has this value together with the others"
                )
        if name != dimension:
            labelled.add(dimension)
        places[dimension] = found
    return archive.isel({d: found[0] if len(found) == 1 else found for d, found in places.items()})


def words_of(archive: xr.Dataset) -> dict[str, str]:
    """Coordinates of words: by which name a value of each is given."""
    return {
        str(name).removesuffix("_name") if f"{coordinate.dims[0]}_name" == name else str(name): str(
            name
        )
        for name, coordinate in archive.coords.items()
        if coordinate.ndim == 1 and coordinate.dtype.kind in "UOT"
    }


def _places_of(archive: xr.Dataset, name: str, value: float | str) -> tuple[str, list[int]]:
    """Dimension, and the places along it: one, or those of all designs of this label."""
    words = words_of(archive)
    if name in words:
        texts = [str(text) for text in archive[words[name]].values]
        own = archive[name].values if name in archive.dims and name in archive.coords else None
        numbers = own.tolist() if own is not None and own.dtype.kind in "iuf" else []
        if value in numbers:  # discs and shafts have both
            return name, [numbers.index(value)]
        if value not in texts:
            known = list(dict.fromkeys(texts))
            raise SceneError(f"{name} = {shown(value)}: unknown{not_known(str(value), known)}")
        found = [place for place, text in enumerate(texts) if text == value]
        return str(archive[words[name]].dims[0]), found
    axes = [str(d) for d in archive.dims if d in archive.coords]
    if name not in axes:
        known = [*words, *(a for a in axes if a not in words)]
        raise SceneError(f"{name}: not an axis of the archive{not_known(name, known)}")
    if isinstance(value, str):
        with contextlib.suppress(ValueError):
            value = number_or_ratio(value)
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        raise SceneError(f"{name} = {shown(value)}: must be a finite number")
    if not math.isfinite(value):
        raise SceneError(f"{name} = {value}: must be a finite number")
    return name, [int(np.argmin(np.abs(archive[name].values - value)))]
