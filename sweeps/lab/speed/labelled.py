"""Results of measuring as labelled datasets: (dimensions, values, unit, meaning) by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Booleans, Floats
from engine_dyn.units import DEGREE
from sweeps.base.naming import named

if TYPE_CHECKING:
    import xarray as xr


def labelled_dataset(
    data: Mapping[str, Any], coordinates: Mapping[str, Any], attributes: Mapping[str, Any],
    dtype: type | None = None,
) -> xr.Dataset:  # fmt: skip
    """Dataset of variables, all of one type where it is given, and coordinates.

    The unit is None where there is no single one. Coordinates may also have attributes in place of
    unit and meaning.
    """
    import xarray as xr

    def labelled(
        name: str, dims: Any, values: Any, unit: str | None, meaning: str
    ) -> tuple[Any, Any, Any]:
        about = named(name, meaning, unit)
        return dims, values, about | ({} if unit is None else {"units": unit})

    made = {name: labelled(name, *one) for name, one in data.items()}
    dataset = xr.Dataset(
        {name: (dims, np.asarray(v, dtype), about) for name, (dims, v, about) in made.items()},
        {name: labelled(name, *one) if len(one) == 4 else one for name, one in coordinates.items()},
        attributes,
    )
    for coordinate in dataset.coords.values():
        coordinate.encoding["_FillValue"] = None
    return dataset


def of_recordings(labels: Sequence[str]) -> dict[str, Any]:
    """Coordinates of recordings."""
    numbers = np.arange(len(labels), dtype=np.int32)
    return {
        "recording": ("recording", numbers, "1", "number of the recording"),
        "file": ("recording", np.array(labels, dtype=object), "1", "recording"),
    }


def of_intervals(middle: Floats, width: Floats, used: Booleans, used_for: str) -> dict[str, Any]:
    """Coordinates of the intervals between teeth, in the order of their angles [rad]."""
    text = f"whether the interval is used {used_for} (1)"
    return {
        "interval": ("interval", middle / DEGREE, "degree",
                     "crank angle in the middle of the interval between teeth"),
        "interval_width": ("interval", width / DEGREE, "degree",
                           "width of the interval between teeth"),
        "interval_used": ("interval", used.astype(np.int8), "1", text),
    }  # fmt: skip
