"""The worst of a shaft's vibration over speeds, misfires and other axes, and barred speeds."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps.base.arguments import check_dataset
from sweeps.base.errors import SceneError

if TYPE_CHECKING:
    import xarray as xr

PLACES = ("disc", "shaft")  # Dimensions that tell the parts of a shaft apart

OVER_LIMITS = (
    "shaft_stress_over_limit", "shaft_torque_over_limit", "propulsion_stress_over_limit",
)  # fmt: skip
"""Quantities that are above 1 where speeds are barred."""

NEEDED = (
    "ask for one in [output], of a [shaft] with stress_limit or torque_limit and over an axis speed"
)
"""What an archive without any of `OVER_LIMITS` lacks."""

LEAST = ("shaft_torque_min",)  # Quantities whose lowest value is the worst


@dataclass(frozen=True)
class Worst:
    """The worst value of a quantity on one disc or shaft, and where it is."""

    quantity: str
    unit: str  # Unit that the archive has for the quantity
    place: str  # Name of the disc or shaft with the worst value
    value: float  # The worst value: the lowest one of `shaft_torque_min`, otherwise the largest
    # Values of the other axes at the worst value, such as speed, misfire and, for amplitudes, order
    at: Mapping[str, Any]

    def worse_than(self, other: Worst) -> bool:
        """Whether this is worse than another value of the same quantity."""
        return self.value < other.value if self.quantity in LEAST else self.value > other.value


@dataclass(frozen=True)
class BarredSpeeds:
    """Speeds between which a quantity is over its limit on one shaft."""

    # Name of the quantity that is above its limit, and name of the shaft.
    quantity: str
    place: str
    # Ends of the range [rpm]: where straight lines between the archive's values cross the limit, or
    # the outermost speed above the limit if no value lies beyond.
    low: float
    high: float
    largest: float  # Largest ratio of value to limit within the range


def limited_by(archive: xr.Dataset) -> list[str]:
    """Quantities of an archive that are above 1 where speeds are barred, if they are numbers."""
    return [n for n in OVER_LIMITS if n in archive and archive[n].dtype.kind in "fiu"]


def worst_of_shaft(archive: xr.Dataset) -> list[Worst]:
    """Worst value of each quantity on each disc and shaft over all other axes of an archive.

    Raises
    ------
    SceneError
        If the archive has no such quantities.

    Examples
    --------
    >>> import sweeps
    >>> from sweeps.decide.explore.shaft_extremes import worst_of_shaft
    >>> archive = sweeps.run(
    ...     engine="diesel_105x137",
    ...     shaft="diesel_105x137",
    ...     axes={"speed": [1800, 2170, 2400]},
    ...     output={"quantities": ["shaft_torque_half_range"]},
    ... )
    >>> worst = max(worst_of_shaft(archive), key=lambda one: one.value)
    >>> worst.place, round(worst.value, -2), worst.at["speed"]
    ('throw 4 - throw 5', 8300.0, 2170.0)
    """
    check_dataset(archive)
    extremes = []
    if not (quantities := _quantities_of_places(archive)):
        raise SceneError("archive: has no quantities of discs or shafts")
    for name, data in quantities.items():
        place = next(d for d in PLACES if d in data.dims)
        sign = -1.0 if name in LEAST else 1.0
        for number in range(data.sizes[place]):
            part = data.isel({place: number})
            values = np.where(np.isnan(part.values), -np.inf, sign * part.values)
            if not np.isfinite(values).any():
                continue
            where = np.unravel_index(values.argmax(), values.shape)
            at = {
                str(d): archive[d].values[i].item()
                for d, i in zip(part.dims, where, strict=True) if d in archive.coords
            }  # fmt: skip
            called = str(archive[f"{place}_name"].values[number])
            value = float(part.values[where])
            extremes.append(Worst(name, str(data.attrs.get("units", "")), called, value, at))
    return extremes


def barred_speeds(archive: xr.Dataset) -> list[BarredSpeeds]:
    """Ranges of speed in which stresses or torques are over their limits, at the worst of all else.

    Raises
    ------
    SceneError
        If the archive has no axis of speed, or nothing over a limit was asked for.
    """
    check_dataset(archive)
    names = limited_by(archive)
    if not names:
        raise SceneError(f"archive: has none of {', '.join(OVER_LIMITS)}; {NEEDED}")
    barred = []
    for name in names:
        data = archive[name]
        if "speed" not in data.dims:
            raise SceneError(f"archive: {name}: has no axis of speed; give one in [axes]")
        worst = data.max([d for d in data.dims if d not in ("speed", "shaft")])
        order = np.argsort(archive["speed"].values)
        speed = archive["speed"].values[order]
        for number, called in enumerate(archive["shaft_name"].values):
            values = worst.isel(shaft=number).values[order]
            for first, end in ranges_above(values):
                low, _ = crossing(speed, values, first - 1, first)
                high, _ = crossing(speed, values, end, end - 1)
                most = values[first:end].max()
                barred.append(BarredSpeeds(name, str(called), low, high, most))
    return barred


def ranges_above(values: Any) -> Iterator[tuple[int, int]]:
    """First place, and that behind the last, of each range in which values are above 1."""
    over = np.nan_to_num(values, nan=0.0) > 1.0
    change = np.diff(np.concatenate([[False], over, [False]]).astype(int))
    yield from zip(*(np.flatnonzero(change == side).tolist() for side in (1, -1)), strict=True)


def crossing(speed: Any, values: Any, outside: int, inside: int) -> tuple[float, float]:
    """Where the line between two neighbours crosses 1, and the speed of the one outside.

    Where there is no such neighbour with a value, that inside, and an infinite speed.
    """
    at = float(speed[inside])
    if not 0 <= outside < speed.size or not np.isfinite(values[outside]):
        return at, math.copysign(math.inf, outside - inside)
    other = float(speed[outside])
    part = (1.0 - values[outside]) / (values[inside] - values[outside])
    return float(other + part * (at - other)), other


def has_places(archive: xr.Dataset) -> bool:
    """Whether `worst_of_shaft` finds quantities of discs or shafts that have names."""
    return bool(_quantities_of_places(archive))


def _quantities_of_places(archive: xr.Dataset) -> dict[str, xr.DataArray]:
    # Variables over discs or shafts none of whose values is the worst
    not_worst = ("shaft_stress_limit", "shaft_torque_limit", "shaft_torque_mean", "mode_shape",
                 "mode_node", "mode_torque", "mode_stress", "system_inertia", "system_stiffness",
                 "system_speed_ratio", "propulsion_stress_limit", "propulsion_stress_limit_passing",
                 "disc_angle_largest_order", "shaft_torque_largest_order", "coupling_contact",
                 "coupling_departure", "speed_in_passing",
                 "shaft_stress_limit_in_passing")  # fmt: skip
    return {
        str(name): data for name, data in archive.data_vars.items()
        if any(place in data.dims and f"{place}_name" in archive.coords for place in PLACES)
        and name not in not_worst and not str(name).endswith("_phase")
        and data.dtype.kind in "fiu"
    }  # fmt: skip
