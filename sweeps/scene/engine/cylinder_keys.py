"""Keys of engine files and of [set] that describe the cylinders one by one.

`arrangement` is a text for a customary arrangement, or a table of throws, banks and cylinders; the
other keys have one value for each cylinder. They hold for engines with that number of cylinders;
other numbers have the customary even-firing order in line.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from pydantic import Field

from engine_dyn.geometry.arrangement import MOST_CYLINDERS, Arrangement, Cylinder, Throw
from engine_dyn.geometry.cylinders import LARGEST_FACTOR, SMALLEST_RADIUS, Cylinders, cylinders_of
from engine_dyn.geometry.layouts import arrangement_from_text, not_covered
from engine_dyn.geometry.master_rods import with_rods
from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.units import DEGREE
from sweeps.base.checks import Strict, check_structure, mentioned, numbers
from sweeps.base.errors import SceneError, shown

CYLINDER_KEYS: Mapping[str, str] = {
    "arrangement": "the engine's arrangement: a string such as 'V8 cross-plane' or 'in-line 4', "
    "or a table of throws, banks and cylinders",
    "firing_angles": "crank angle at which each cylinder fires: a list, the first 0 [degree]; "
    "[0, 405] with the arrangement 'V2 45', [0, 270] of a parallel twin",
    "pressure_factor": "factor on the combustion pressure (pressure above motored) of each "
    f"cylinder: a list of numbers from 0 (misfire) to {LARGEST_FACTOR:g} [1]",
    "mass_factor": "factor on the reciprocating mass of each cylinder: a list of numbers from 0 to "
    f"{LARGEST_FACTOR:g} [1]",
    "radius_factor": "crank radius (and stroke) of each cylinder over that of cylinder 1: a list "
    f"of numbers from {SMALLEST_RADIUS:g} to {LARGEST_FACTOR:g}, the first 1 [1]",
    "articulated_rods": "a table of the rods that hang on master rods: radius and knuckle_mass, "
    "and angles and length where these are not customary",
}
"""Keys that describe the cylinders, with meaning and allowed values."""


class ThrowTable(Strict):
    """One crank pin of an arrangement that is described in full."""

    angle: float = Field(description="a number, the direction of the crank pin [degree]")
    position: float | None = Field(
        default=None,
        ge=-100.0,
        le=100.0,
        description="a number from -100 to 100, the place along the shaft from the free end in "
        "cylinder spacings",
    )
    radius_factor: float = Field(
        default=1.0, description="a number, the crank radius over that of cylinder 1"
    )


class CylinderTable(Strict):
    """One cylinder of an arrangement that is described in full; numbers count from 1."""

    throw: int = Field(description="the number of one of the throws, from 1")
    bank: int = Field(default=1, description="the number of one of the banks, from 1")
    firing_angle: float = Field(description="a number, the crank angle at which it fires [degree]")


class ArrangementTable(Strict):
    """Any crankshaft, described in full: throws, banks and cylinders; angles in degree."""

    name: str | None = Field(default=None, description="a string: its usual name")
    throws: list[ThrowTable] = Field(
        description=f"a list of 1 to {MOST_CYLINDERS} tables with angle, and position and "
        "radius_factor where these are not customary",
        min_length=1,
        max_length=MOST_CYLINDERS,
    )
    banks: list[float] = Field(
        default=[0.0],
        description=f"a list of 1 to {MOST_CYLINDERS} directions of the banks [degree]",
        min_length=1,
        max_length=MOST_CYLINDERS,
    )
    sides: list[float] | None = Field(
        default=None,
        description="a list of 1 or -1 for each bank: the side of the crank's axis to which "
        "crank_offset moves it, 1 that of cylinder 1's bank, -1 the other, as in VR engines",
    )
    cylinders: list[CylinderTable] = Field(
        description=f"a list of 1 to {MOST_CYLINDERS} tables with throw, bank and firing_angle",
        min_length=1,
        max_length=MOST_CYLINDERS,
    )
    firing_order: list[int] | None = Field(
        default=None, description="a list of cylinder numbers in the order in which they fire"
    )
    uneven: bool = Field(
        default=False, description="true or false: whether uneven firing is intended"
    )


class RodTable(Strict):
    """Rods that hang on master rods; lengths over the crank radius."""

    radius: float | list[float] = Field(
        description="a number, or one for each cylinder, 0 for the master of each throw: distance "
        "of the knuckle pin from the crank pin over the crank radius; 0: plain rods"
    )
    knuckle_mass: float | list[float] = Field(
        description="a number, or one for each cylinder: mass at each knuckle pin (lower end of "
        "the articulated rod, with the pin) over the reciprocating mass of a cylinder; 0: it moves "
        "as the crank pin"
    )
    angles: list[float] | None = Field(
        default=None,
        description="a list of the directions of the knuckle pins from the master rod [degree], 0 "
        "for masters; default: those of the cylinders from the master's",
    )
    length: float | list[float] | None = Field(
        default=None,
        description="a number, or one for each cylinder: length of the articulated rod over the "
        "crank radius; default: the master rod's less radius",
    )


@dataclass(frozen=True)
class CylinderKeys:
    """Keys as given, checked by themselves; None where not given. Angles in degree."""

    arrangement: str | ArrangementTable | None = None
    firing_angles: tuple[float, ...] | None = None
    pressure_factor: tuple[float, ...] | None = None
    mass_factor: tuple[float, ...] | None = None
    radius_factor: tuple[float, ...] | None = None
    articulated_rods: RodTable | None = None

    @property
    def given(self) -> dict[str, Any]:
        """The keys that are given, by name."""
        return {key: getattr(self, key) for key in CYLINDER_KEYS if getattr(self, key) is not None}


def read_cylinder_keys(raw: Mapping[str, Any], where: str) -> CylinderKeys:
    """Read the keys of cylinders that a table has: arrangement, rods and lists of numbers."""
    given: dict[str, Any] = {}
    for key in CYLINDER_KEYS:
        item = raw.get(key)
        if item is None:
            continue
        if key == "arrangement":
            given[key] = read_arrangement(item, f"{where}{key}")
        elif key == "articulated_rods":
            if not isinstance(item, Mapping):
                raise SceneError(f"{where}{key} = {shown(item)}: must be {CYLINDER_KEYS[key]}")
            given[key] = check_structure(RodTable, item, f"{where}{key}")
        else:
            if not isinstance(item, list):
                raise SceneError(
                    f"{where}{key} = {shown(item)}: must be a list of numbers, one for each "
                    "cylinder"
                )
            unit = "degree" if key == "firing_angles" else "1"
            given[key] = tuple(numbers(item, f"{where}{key}", unit=unit).tolist())
    return CylinderKeys(**given)


def read_arrangement(raw: Any, where: str) -> str | ArrangementTable:
    """Read an arrangement as given: a text, or a table that describes it."""
    if isinstance(raw, str):
        return raw
    if not isinstance(raw, Mapping):
        raise SceneError(f"{where} = {shown(raw)}: must be {CYLINDER_KEYS['arrangement']}")
    return check_structure(ArrangementTable, raw, where)


def arrangement_of(given: str | ArrangementTable, period: float) -> Arrangement:
    """Arrangement of a text or of a table.

    Raises
    ------
    ValueError
        In one line that begins with `arrangement`, for an arrangement that no engine can have.
    """
    if isinstance(given, str):
        try:
            return arrangement_from_text(given, period)
        except ValueError as error:
            meant = "" if not_covered(given) else _meant(given, period)
            raise ValueError(f"{error}{meant}") from None
    try:
        return _described(given, period)
    except ValueError as error:
        raise ValueError(f"arrangement: {error}") from None


def _meant(text: str, period: float) -> str:
    """Hint "; did you mean 'in-line 3'?" for a text that is nearly an arrangement."""
    parts = re.match(r"([a-z][a-z -]*+)(\d.*+)$", text.strip().lower())
    if parts is None:
        return ""
    kind = parts[1].rstrip(" -")
    understood = ("in-line", "boxer", "radial", "parallel twin", "v", "vr", "w")
    near = difflib.get_close_matches(kind, understood, n=1, cutoff=0.6)
    # Other names of arrangements, and the words that are understood
    other_words = {
        "i": "in-line", "l": "in-line", "r": "in-line", "row": "in-line", "straight": "in-line",
        "flat": "boxer", "opposed": "boxer", "h": "boxer", "star": "radial",
    }  # fmt: skip
    word = other_words.get(kind, near[0] if near else "")
    meant = f"{word.upper()}{parts[2]}" if word in ("v", "vr", "w") else f"{word} {parts[2]}"
    try:
        arrangement_from_text(meant, period)
    except ValueError:
        return ""
    return f"; did you mean '{meant}'?"


def _described(given: ArrangementTable, period: float) -> Arrangement:
    """Arrangement that a table describes."""
    throws = tuple(
        Throw(
            throw.angle * DEGREE,
            float(place) if throw.position is None else throw.position,
            throw.radius_factor,
        )
        for place, throw in enumerate(given.throws)
    )
    cylinders = tuple(
        Cylinder(one.throw - 1, one.bank - 1, one.firing_angle * DEGREE) for one in given.cylinders
    )
    banks = tuple(angle * DEGREE for angle in given.banks)
    sides = tuple(given.sides or ())
    made = Arrangement(period, throws, banks, cylinders, given.uneven, name_of(given), sides)
    for what, known, used in (
        ("throw", throws, {one.throw for one in cylinders}),
        ("bank", banks, {one.bank for one in cylinders}),
    ):
        empty = sorted(set(range(len(known))) - used)
        if empty:
            raise ValueError(f"{what} {empty[0] + 1}: has no cylinder; needs at least one")
    order = made.firing_order if given.firing_order is None else tuple(given.firing_order)
    numbers_of_all = list(range(1, len(cylinders) + 1))
    if sorted(order) != numbers_of_all:
        raise ValueError(
            f"firing_order = {list(order)}: must name each of the cylinders 1 to "
            f"{len(cylinders)} once"
        )
    fires = [made.firing_angles[number - 1] for number in order]
    if fires != sorted(fires):
        follows = "-".join(map(str, made.firing_order))
        raise ValueError(
            f"firing_order = {list(order)}: the firing angles give {follows}; both must agree"
        )
    return made


def name_of(given: str | ArrangementTable) -> str:
    """Name of an arrangement, for people and as a coordinate of an axis of arrangements."""
    if isinstance(given, str):
        return given
    if given.name is not None:
        return given.name
    banks = f", {len(given.banks)} banks" if len(given.banks) > 1 else ""
    return f"{len(given.cylinders)} cylinders on {len(given.throws)} throws{banks}"


def cylinders_of_keys(keys: CylinderKeys, base: Cylinders, count: int, where: str) -> Cylinders:
    """Cylinders of an engine with `count` of them: `keys` over `base`, which has as many.

    Firing angles beside an arrangement must be possible with its throws; without one they mean an
    engine in line with a throw for each cylinder.

    Raises
    ------
    SceneError
        In one line, for another number of cylinders and for impossible angles or factors.
    """
    arrangement = base.arrangement
    try:
        if keys.arrangement is not None:
            arrangement = arrangement_of(keys.arrangement, base.period)
            arranged = len(arrangement.cylinders)
            if arranged != count:
                raise ValueError(
                    f"arrangement = '{name_of(keys.arrangement)}': has {arranged} cylinders, the "
                    f"engine {count}"
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
            made = made.with_makes(diagrams=base.diagrams)
            if base.articulated and keys.articulated_rods is None:
                raise ValueError(
                    "arrangement: the engine has articulated_rods, which must be given with "
                    "another one"
                )
        made = made.with_factors(keys.pressure_factor, keys.mass_factor, keys.radius_factor)
        if (rods := keys.articulated_rods) is None:
            return made
        angles = None if rods.angles is None else [degree * DEGREE for degree in rods.angles]
        try:
            return with_rods(made, rods.radius, rods.knuckle_mass, angles, rods.length)
        except ValueError as error:
            raise ValueError(f"articulated_rods: {error}") from None
    except ValueError as error:
        raise SceneError(f"{where}{mentioned(error)}") from None


def _with_angles(
    arrangement: Arrangement | None, degrees: tuple[float, ...], period: float
) -> Arrangement:
    """Arrangement whose cylinders fire at given angles."""
    angles = [degree * DEGREE for degree in degrees]
    if arrangement is not None:
        cylinders = tuple(
            replace(cylinder, firing_angle=angle)
            for cylinder, angle in zip(arrangement.cylinders, angles, strict=True)
        )
        return replace(arrangement, cylinders=cylinders, uneven=True)
    throws = tuple(Throw(-angle, float(i)) for i, angle in enumerate(angles))
    made = tuple(Cylinder(i, 0, angle) for i, angle in enumerate(angles))
    listed = ", ".join(f"{degree:g}" for degree in degrees)
    return Arrangement(period, throws, (0.0,), made, True, f"in-line, firing at {listed} degree")


assert not set(CYLINDER_KEYS) & set(PARAMETERS)
