"""Diagrams of single cylinders: [[diagram]] with `cylinder`, beside those of all others.

All cylinders have diagrams for the same loads, so that a load lies at one place in every table.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.geometry.slider_crank import crank_radius_of_ratio
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.family_grid import FamilyGrid
from sweeps.base.errors import SceneError, shown

CYLINDER = "cylinder"  # Key of a [[diagram]]

OF_CYLINDER_ALONE = "the number of the cylinder that it belongs to; default: all without their own"
"""Meaning of the key."""


def taken_cylinder(rest: dict[str, Any], count: int, where: str) -> int:
    """Take the number of its cylinder out of a [[diagram]] of an engine with `count`; 0: of all.

    Raises
    ------
    SceneError
        For anything but the number of a cylinder, and together with a speed.
    """
    if CYLINDER not in rest:
        return 0
    given = rest.pop(CYLINDER)
    if isinstance(given, bool) or given not in range(1, count + 1):
        raise SceneError(
            f"{where} {CYLINDER} = {shown(given)}: must be the number of one of the engine's "
            f"cylinders, from 1 to {count}"
        )
    if "speed" in rest:
        raise SceneError(f"{where} {CYLINDER}: not allowed together with speed")
    return int(given)


def values_of_cylinder(
    values: Mapping[str, float], number: int, cylinders: Cylinders | None
) -> Mapping[str, float]:
    """[values] of an engine as they are for the diagram of a cylinder: its own bore and stroke."""
    own = dict(values)
    if f"bore_{number}" in values:
        own["bore"] = values[f"bore_{number}"]
    if cylinders is None or not {"stroke", "crank_ratio"} <= values.keys():
        return own
    member, ratio = cylinders.members[number - 1], values["crank_ratio"]
    if member.radius_factor != 1.0:
        offset = values.get("pin_offset", 0.0) + values.get("crank_offset", 0.0)
        radius = float(crank_radius_of_ratio(values["stroke"], ratio, offset))
        own["stroke"] = 2.0 * radius * float(member.stroke(ratio, offset / radius))
        own["crank_ratio"] = ratio * member.radius_factor
    return own


def by_cylinder(numbers: Sequence[int], count: int, name: str) -> dict[int, list[int]]:
    """Places of the diagrams by the numbers of their cylinders, 0 for those without their own.

    Where every cylinder has its own, those of cylinder 1 stand for the engine's, at 0.

    Raises
    ------
    SceneError
        Where a cylinder has no diagram.
    """
    places: dict[int, list[int]] = {}
    for place, number in enumerate(numbers):
        places.setdefault(number, []).append(place)
    if 0 not in places and numbers:
        missing = [number for number in range(1, count + 1) if number not in places]
        if missing:
            raise SceneError(
                f"{name}: [[diagram]]: cylinder {missing[0]} has none; must have its own, or there "
                f"must be one without {CYLINDER}, for all cylinders without their own"
            )
        places[0] = places.pop(1)
    return places


def joined(
    family: Family | FamilyGrid, own: Mapping[int, Family | FamilyGrid], name: str
) -> Family | FamilyGrid:
    """Family of an engine with those of single cylinders, by their numbers.

    Raises
    ------
    SceneError
        For other loads than the engine's, and diagrams over the speed.
    """
    if not own:
        return family
    families: dict[int, Family] = {}
    for number, one in own.items():
        if not isinstance(family, Family) or not isinstance(one, Family):
            raise SceneError(
                f"{name}: [[diagram]] speed: not allowed where cylinders have diagrams of their own"
            )
        if one.loads.tolist() != family.loads.tolist():
            loads, others = (", ".join(f"{v:g}" for v in f.loads) for f in (one, family))
            raise SceneError(
                f"{name}: [[diagram]] of cylinder {number}: has the loads {loads}; must have those "
                f"of the other cylinders, {others}"
            )
        families[number] = one
    assert isinstance(family, Family)
    return replace(family, of_cylinders=families)


def with_diagrams(cylinders: Cylinders, numbers: Sequence[int]) -> Cylinders:
    """Cylinders of an engine, of which those with these numbers have diagrams of their own."""
    own = [number if number in numbers else 0 for number in range(1, cylinders.count + 1)]
    return cylinders.with_makes(diagrams=own)
