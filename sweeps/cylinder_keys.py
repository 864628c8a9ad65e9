"""Keys that describe the cylinders one by one: what engine files and [set] of scenes give.

`arrangement` is a text, the others have one value a cylinder. They hold for engines of their own
number of cylinders; other numbers take the customary even-firing order in line.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from engine_dyn.arrangement import Arrangement, Cylinder, Throw
from engine_dyn.cylinders import LARGEST_FACTOR, SMALLEST_RADIUS, Cylinders, cylinders_of
from engine_dyn.layouts import arrangement_from_text
from engine_dyn.quantities import PARAMETERS
from sweeps.checks import mentioned, numbers
from sweeps.errors import SceneError, shown

__all__ = ["KEYS", "CylinderKeys", "read_keys", "resolve"]

DEGREE = math.pi / 180.0

KEYS: Mapping[str, str] = {
    "arrangement": "the engine's arrangement: a text such as 'V8 cross-plane' or 'in-line 4'",
    "firing_angles": "crank angle at which each cylinder fires: a list, the first 0 [degree]",
    "pressure_factor": "factor on the pressure above motored of each cylinder: a list of numbers "
    f"from 0 (misfire) to {LARGEST_FACTOR:g} [1]",
    "mass_factor": "factor on the reciprocating mass of each cylinder: a list of numbers from 0 to "
    f"{LARGEST_FACTOR:g} [1]",
    "radius_factor": "crank radius, and stroke, of each cylinder over that of cylinder 1: a list "
    f"of numbers from {SMALLEST_RADIUS:g} to {LARGEST_FACTOR:g}, the first 1 [1]",
}
"""Keys beside the parameters, with what they are and what is allowed."""


@dataclass(frozen=True)
class CylinderKeys:
    """Keys as given, checked by themselves; None where not given. Angles in degree."""

    arrangement: str | None = None
    firing_angles: tuple[float, ...] | None = None
    pressure_factor: tuple[float, ...] | None = None
    mass_factor: tuple[float, ...] | None = None
    radius_factor: tuple[float, ...] | None = None

    @property
    def given(self) -> dict[str, Any]:
        """Those that are given, by name."""
        return {key: getattr(self, key) for key in KEYS if getattr(self, key) is not None}


def read_keys(raw: Mapping[str, Any], where: str) -> CylinderKeys:
    """Read those of the keys that stand in a table.

    Raises
    ------
    SceneError
        For what is no text or no list of numbers.
    """
    found: dict[str, Any] = {}
    for key in KEYS:
        item = raw.get(key)
        if item is None:
            continue
        if key == "arrangement":
            if not isinstance(item, str):
                raise SceneError(f"{where}{key} = {shown(item)}: must be {KEYS[key]}")
            found[key] = item
        else:
            if not isinstance(item, list):
                raise SceneError(
                    f"{where}{key} = {shown(item)}: must be a list of numbers, one for each "
                    "cylinder"
                )
            found[key] = tuple(numbers(item, f"{where}{key}").tolist())
    return CylinderKeys(**found)


def resolve(keys: CylinderKeys, base: Cylinders, count: int, where: str) -> Cylinders:
    """Cylinders of an engine with `count` of them: `keys` over `base`, which has as many.

    Firing angles beside an arrangement must be possible with its throws; without one they mean an
    engine in line with a throw for each cylinder.

    Raises
    ------
    SceneError
        In one line: another number of cylinders, angles or factors that are not possible.
    """
    arrangement = base.arrangement
    try:
        if keys.arrangement is not None:
            arrangement = arrangement_from_text(keys.arrangement, base.period)
            found = len(arrangement.cylinders)
            if found != count:
                raise ValueError(
                    f"arrangement = '{keys.arrangement}': has {found} cylinders, the engine {count}"
                )
        if keys.firing_angles is not None:
            if len(keys.firing_angles) != count:
                raise ValueError(
                    f"firing_angles: {len(keys.firing_angles)} values for {count} cylinders: must "
                    "be one for each"
                )
            given = arrangement if keys.arrangement is not None else None
            try:
                arrangement = _with_angles(given, keys.firing_angles, base.period)
            except ValueError as error:
                raise ValueError(f"firing_angles: {error}") from None
        made = base
        if arrangement is not None and arrangement is not base.arrangement:
            made = cylinders_of(arrangement, base.pressure_factors, base.mass_factors)
        return made.with_factors(keys.pressure_factor, keys.mass_factor, keys.radius_factor)
    except ValueError as error:
        raise SceneError(f"{where}{mentioned(error)}") from None


def _with_angles(
    arrangement: Arrangement | None, degrees: tuple[float, ...], period: float
) -> Arrangement:
    """Arrangement whose cylinders fire at these angles."""
    angles = [degree * DEGREE for degree in degrees]
    if arrangement is not None:
        cylinders = tuple(
            replace(cylinder, firing_angle=angle)
            for cylinder, angle in zip(arrangement.cylinders, angles, strict=True)
        )
        return Arrangement(
            period, arrangement.throws, arrangement.banks, cylinders, True, arrangement.name
        )
    throws = tuple(Throw(-angle, float(i)) for i, angle in enumerate(angles))
    made = tuple(Cylinder(i, 0, angle) for i, angle in enumerate(angles))
    listed = ", ".join(f"{degree:g}" for degree in degrees)
    return Arrangement(period, throws, (0.0,), made, True, f"in-line, firing at {listed} degree")


assert not set(KEYS) & set(PARAMETERS)
