"""What numbers say that a figure need not: an axis again, another quantity again, the speed itself.

A figure of a quantity that equals an axis is the line y = x. Two quantities that are equal need one
figure. Largest, mean and smallest speeds over the nominal speed all look like the line through the
origin; only their deviation from it tells anything.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import xarray as xr

from engine_dyn.types import Floats
from engine_dyn.units import RPM
from sweeps.base.dimensions import PUBLISHED
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_READ, View
from sweeps.view.figures.wording import name_of, symbol_of

__all__ = ["deviations_of_speed", "repeats_an_axis", "without_twins"]

ALIKE = 1e-3
"""Relative difference up to which a quantity repeats an axis or another quantity."""

SPEED, MEAN_SPEED = "speed", "omega_mean"
PER_RPM = {"rpm": 1.0, "rad s-1": RPM}
"""Units of speeds, and what one revolution a minute is in them."""


def _values(view: View, name: str) -> Floats | None:
    """All values of a variable, or None where they are too many to look at."""
    array = view.array(name)
    return np.asarray(array.values, dtype=float) if array.size <= MOST_READ else None


def repeats_an_axis(view: View, name: str) -> bool:
    """Whether a variable holds the values of an axis again, such as a wanted delta that is met.

    So does the mean speed that is nearly the one nominal speed of all designs.
    """
    values, array = _values(view, name), view.array(name)
    if values is None or not np.isfinite(values).any():
        return False
    if name == MEAN_SPEED and not (SPEED in view.data.coords and view.data[SPEED].ndim):
        return _equal(values, np.full_like(values, np.nanmean(values)))
    for key, coordinate in view.data.coords.items():
        if key == name or not coordinate.dims or coordinate.dtype.kind not in "iuf":
            continue
        if coordinate.attrs.get("units") != array.attrs.get("units"):
            continue
        if set(coordinate.dims) <= set(array.dims):
            sizes = {dim: array.sizes[dim] for dim in array.dims}
            same = coordinate.variable.set_dims(sizes).transpose(*array.dims).values
            if np.ptp(np.asarray(same, dtype=float)) and _equal(values, same):
                return True
    return False


def _equal(one: Floats, other: Floats) -> bool:
    known = np.isfinite(one)
    size = np.abs(np.asarray(other, dtype=float)[known])
    return bool(np.all(np.abs(one - other)[known] <= ALIKE * size))


def without_twins(study: Study, names: Sequence[str]) -> tuple[Study, list[str]]:
    """Leave out variables that are equal to an earlier one, whose figures then say so."""
    view = study.view
    kept: list[str] = []
    said: dict[str, str] = {}
    for name in names:
        array, values = view.array(name), _values(view, name)
        twin = None
        for other in kept:
            beside = view.array(other)
            if beside.dims != array.dims or beside.attrs.get("units") != array.attrs.get("units"):
                continue
            others = _values(view, other)
            if values is None or others is None or not np.isfinite(values).any():
                continue
            if (np.isfinite(values) == np.isfinite(others)).all() and _equal(values, others):
                twin = other
                break
        if twin is None or view.published(name, everywhere=True):
            kept.append(name)
        else:
            text = f"{name_of(array, name)} {symbol_of(array)}".rstrip()
            said[twin] = f"{said[twin]}, {text}" if twin in said else f"the same: {text}"
    return _changed(study, lambda one: replace(one, twins={**one.twins, **said})), kept


def deviations_of_speed(study: Study, names: Sequence[str]) -> Study:
    """Put deviations in percent from the nominal speed in the place of speeds, where it varies."""
    names = [
        name
        for name in names
        if name.startswith("omega")
        and name not in study.view.options.targets
        and study.view.array(name).size <= MOST_READ
    ]
    return _changed(study, lambda view: _with_deviations(view, names)) if names else study


def _changed(study: Study, change: Callable[[View], View]) -> Study:
    """The same change to all views of a study."""
    return replace(
        study,
        view=change(study.view),
        base=tuple((parameter, change(view)) for parameter, view in study.base),
        aside=tuple((parameter, change(view), keys) for parameter, view, keys in study.aside),
    )


def _with_deviations(view: View, names: Sequence[str]) -> View:
    data = view.data
    if SPEED not in data.coords or not data.coords[SPEED].dims:
        return view
    nominal = data.coords[SPEED].variable
    new = {}
    for name in names:
        array = view.array(name)
        unit = PER_RPM.get(str(array.attrs.get("units")))
        if unit is None or not set(nominal.dims) <= set(array.dims):
            continue
        symbol = symbol_of(array).strip("$")
        letter = "n" if str(array.attrs["units"]) == "rpm" else r"\omega_n"
        attributes = {
            **array.attrs,
            "long_name": f"deviation of the {name_of(array, name)}, from the nominal speed",
            "common_name": "deviation of the crank speed from the nominal speed",
            "symbol": rf"${symbol}/{letter}-1$" if symbol else "",
            "units": "percent",
        }
        for key in (name, name + PUBLISHED):
            if key in data.data_vars and set(nominal.dims) <= set(view.array(key).dims):
                # named arrays line up by their dimensions
                ratio = view.array(key) / (nominal * unit)
                values = (100.0 * (ratio - 1.0)).transpose(*view.array(key).dims)
                new[key] = xr.Variable(values.dims, values.values, attributes)
    return replace(view, data=data.assign(new)) if new else view
