"""Units that people read: of tables, heads and reports. Archives keep theirs."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from sweeps.base.dimensions import PUBLISHED
from sweeps.base.errors import SceneError, not_known, shown
from sweeps.base.files.numbers_with_units import factor_between

READABLE: Mapping[str, str] = {
    "rad s-1": "rpm", "W": "kW", "N": "kN", "J": "kJ", "m": "mm", "cm3": "l",
}  # fmt: skip
"""Units of tables for people, by the units of archives that they replace."""

SHOWN = {
    "1": "", "percent": "%", "degree": "°", "kg m2": "kg m²", "kg m-3": "kg/m³", "m s-1": "m/s",
    "rad s-1": "rad/s", "rad s-2": "rad/s²", "m3": "m³",
}  # fmt: skip
"""Spellings of units in tables."""


@lru_cache(maxsize=200)
def factor(unit: str, wanted: str) -> float:
    """Return the factor from a unit to a wanted one; SceneError where this is none of its kind."""
    size = 1.0 if unit == wanted else factor_between(unit, wanted)
    if size is None and (not wanted or factor_between(wanted, wanted) is None):
        raise SceneError(f"unit {shown(wanted)}: must be a unit such as kW, rpm, MPa or N*m")
    if size is None:
        raise SceneError(
            f"unit {shown(wanted)}: cannot be used for a quantity in {SHOWN.get(unit, unit) or '1'}"
        )
    return size


def unit_choices(text: str | None, known: Mapping[str, str]) -> dict[str, str]:
    """Units of columns that a person wants, from ``power=kW,speed=rpm``.

    Columns that nobody names are in readable units; ``archive`` keeps those that are `known`.
    SceneError refuses names that are no columns, units that do not fit, and texts of another form.
    """
    if text == "archive":
        return {}
    readable = {name: READABLE[unit] for name, unit in known.items() if unit in READABLE}
    return readable | asked_units(text, known)


def asked_units(text: str | None, known: Mapping[str, str]) -> dict[str, str]:
    """Return the units that a text names; as `unit_choices`, without units that nobody named."""
    asked: dict[str, str] = {}
    for item in [] if text in (None, "archive") else str(text).split(","):
        name, sign, wanted = (part.strip() for part in item.partition("="))
        if not sign or not wanted:
            raise SceneError(
                f"--units {shown(text)}: must be NAME=UNIT, several with commas, or archive"
            )
        # A name also stands for longer names that end with it: power for brake_power.
        meant = [n for n in known if n == name or n.endswith(f"_{name}")]
        if name not in known and not meant:
            raise SceneError(f"--units {name}: no column{not_known(name, known)}")
        for one in meant:
            try:
                factor(known[one], wanted)  # Refused before anything is printed
            except SceneError as error:
                raise SceneError(f"{one}: {error}") from None
            asked[one] = wanted
    return asked


def readable_of_archive(text: str | None, variables: Mapping[Any, Any]) -> dict[str, str]:
    """Return readable units of an archive's variables, or those that a text names.

    ``archive`` keeps all as they are; otherwise as `asked_of_archive`.
    """
    if text == "archive":
        return {}
    known = {str(name): str(v.attrs.get("units", "")) for name, v in variables.items()}
    readable = {name: READABLE[unit] for name, unit in known.items() if unit in READABLE}
    return readable | asked_of_archive(text, variables)


def asked_of_archive(text: str | None, variables: Mapping[Any, Any]) -> dict[str, str]:
    """Return the units that a text names, as `asked_units`, for published values too."""
    known = {str(name): str(v.attrs.get("units", "")) for name, v in variables.items()}
    computed = {name: unit for name, unit in known.items() if not name.endswith(PUBLISHED)}
    asked: dict[str, str] = {}
    for name, wanted in asked_units(text, computed).items():
        alike = [one for one in (name, name + PUBLISHED) if known.get(one) == known[name]]
        asked |= dict.fromkeys(alike, wanted)
    return asked


def converted(unit: str, choice: str | None) -> tuple[float, str]:
    """Factor on a number, and how its unit is written."""
    wanted = choice or unit
    return factor(unit, wanted), SHOWN.get(wanted, wanted)
