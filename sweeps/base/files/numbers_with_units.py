"""A number with a unit, as a person writes it: "36.4 kW", "2700 rpm", "75bar", or a plain number.

All files, options and conditions read their units here, by one table. It needs no library: a scene
must be read wherever the package runs, and pint takes a third of a second to load.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

from sweeps.base.errors import SceneError, one_line, shown

_OF_TURNS = ("radian", "degree", "revolution", "turn", "rpm", "rps")

_BASES = ("kg", "m", "s", "rad", "K", "V")
"""Units that the others are made of. Angles count as a dimension: 1/s is none of rad/s."""

_MADE_OF: dict[str, tuple[float, str]] = {
    "g": (1e-3, "kg"), "t": (1e3, "kg"), "lb": (0.45359237, "kg"),
    "in": (0.0254, "m"), "inch": (0.0254, "m"), "ft": (0.3048, "m"), "l": (1e-3, "m3"),
    "L": (1e-3, "m3"), "cc": (1e-6, "m3"), "second": (1.0, "s"), "seconds": (1.0, "s"),
    "min": (60.0, "s"), "h": (3600.0, "s"),
    "radian": (1.0, "rad"), "deg": (math.pi / 180.0, "rad"), "degree": (1.0, "deg"),
    "degrees": (1.0, "deg"), "°": (1.0, "deg"), "rev": (2.0 * math.pi, "rad"),
    "revolution": (1.0, "rev"), "turn": (1.0, "rev"), "rpm": (1.0, "rev min-1"),
    "rps": (1.0, "rev s-1"), "Hz": (1.0, "s-1"), "N": (1.0, "kg m s-2"), "kgf": (9.80665, "N"),
    "lbf": (0.45359237 * 9.80665, "N"), "Nm": (1.0, "N m"), "Pa": (1.0, "N m-2"),
    "bar": (1e5, "Pa"), "atm": (101325.0, "Pa"), "psi": (1.0, "lbf in-2"), "J": (1.0, "N m"),
    "W": (1.0, "J s-1"), "Wh": (1.0, "W h"), "hp": (550.0, "lbf ft s-1"), "PS": (75.0, "kgf m s-1"),
    "ps": (1.0, "PS"), "CV": (1.0, "PS"), "pascal": (1.0, "Pa"), "kp": (1.0, "kgf"),
    "at": (1.0, "kgf cm-2"), "torr": (1.0 / 760.0, "atm"), "mmHg": (133.322387415, "Pa"),
    "inHg": (25.4, "mmHg"), "percent": (0.01, ""), "%": (0.01, ""),
}  # fmt: skip
"""Other units, each as a factor on units that stand above or among the bases."""

_PREFIXES = {
    "da": 10.0, "h": 100.0, "k": 1e3, "M": 1e6, "G": 1e9, "d": 0.1, "c": 0.01, "m": 1e-3,
    "u": 1e-6, "µ": 1e-6, "n": 1e-9,
}  # fmt: skip

_WITH_PREFIX = (
    "g", "m", "s", "rad", "l", "L", "Hz", "N", "Nm", "Pa", "bar", "J", "W", "Wh", "V", "pascal",
)  # fmt: skip

_NUMBER = r"[+-]?(?:\d{1,30}\.?\d{0,30}|\.\d{1,30})(?:[eE][+-]?\d{1,3})?"

PATTERN = rf"^\s*{_NUMBER}\s*(?:1?/\s*)?[A-Za-z°%µ].{{0,40}}$"
"""Texts that may be a number with a unit."""


class _Unit(NamedTuple):
    """Size in the bases, and the power of each base."""

    size: float
    powers: tuple[int, ...]


@lru_cache(maxsize=500)
def _unit_of(text: str) -> _Unit | None:
    """Return a unit such as "kg m2", "N*m/rad", "1/min"; None for a text that is none."""
    plain = re.sub(r"^1?\s*/\s*", "/", text.strip())
    for sign, word in zip("²³·", ("2", "3", "*"), strict=True):
        plain = plain.replace(sign, word)
    size, powers = 1.0, [0] * len(_BASES)
    # A sign between units, a word, and its power
    term = re.compile(r"\s*([*/. -]?)\s*([A-Za-zµ°%]{1,12})(?:(?:\^|\*\*)?(-?[1-4]))?", re.ASCII)
    place = 0
    while place < len(plain):
        match = term.match(plain, place)
        one = None if match is None else _word(match[2])
        if match is None or one is None:
            return None
        power = int(match[3] or 1) * (-1 if match[1] == "/" else 1)
        size *= one.size**power
        powers = [total + power * each for total, each in zip(powers, one.powers, strict=True)]
        place = match.end()
    return _Unit(size, tuple(powers))


def _word(word: str) -> _Unit | None:
    """A single word of a unit, with or without a prefix."""
    if word in _BASES:
        return _Unit(1.0, tuple(int(word == base) for base in _BASES))
    if word in _MADE_OF:
        factor, made_of = _MADE_OF[word]
        inside = _unit_of(made_of)
        return None if inside is None else _Unit(factor * inside.size, inside.powers)
    for prefix, factor in _PREFIXES.items():
        rest = word.removeprefix(prefix)
        if rest != word and rest in _WITH_PREFIX and (inside := _word(rest)) is not None:
            return _Unit(factor * inside.size, inside.powers)
    return None


def factor_between(given: str, wanted: str) -> float | None:
    """Return the factor from one unit to another; None for texts that are no units of one kind."""
    one, other = (_unit_of("" if unit == "1" else unit) for unit in (given, wanted))
    if one is None or other is None:
        return None
    angle = _BASES.index("rad")
    difference = [a - b for a, b in zip(one.powers, other.powers, strict=True)]
    turns = difference.pop(angle)
    if any(difference):
        return None
    if turns and 0 in (one.powers[angle], other.powers[angle]) and (
        wanted == "rpm" or given == "rad s-1"
    ):  # fmt: skip
        # Beside a speed, what has no angle counts turns: 2700/min are given, or wanted.
        return one.size / other.size * (2.0 * math.pi) ** -turns
    if turns and not (one.powers[angle] == 0 and other.powers[0] and "rad" in wanted):
        return None  # A stiffness may be in N m, which is per radian
    return one.size / other.size


def with_unit_of_last(texts: Sequence[str]) -> list[str]:
    """Give numbers without a unit the one behind the last: 80, 90 mm are both in mm."""
    unit = re.sub(rf"^\s*{_NUMBER}\s*", "", texts[-1])
    return [
        f"{text} {unit}" if re.fullmatch(rf"\s*{_NUMBER}\s*", text, re.ASCII) else text
        for text in texts
    ]


def number_with_unit(raw: Any, where: str, unit: str) -> float:
    """Return a number in `unit`; a plain number is already in it.

    Parameters
    ----------
    raw : str or float
        "36.4 kW", "36.4" or 36.4.
    where : str
        Beginning of messages, such as "--power".
    unit : str
        As people write it, "kW", "rpm", "bar", "g/kWh", or as archives do, "kg m2", "1".

    Raises
    ------
    SceneError
        For a text that is no number with a unit, a unit of something else or of apparent power.
    """
    if isinstance(raw, int | float) and not isinstance(raw, bool):
        return _finite(float(raw), raw, where, unit)
    match = re.match(rf"\s*({_NUMBER})\s*", raw, re.ASCII) if isinstance(raw, str) else None
    if match is None:
        raise SceneError(f"{where} = {shown(raw)}: {_wanted(unit)}")
    number, text = float(match[1]), raw[match.end() :].strip()
    if text and text != unit:
        if unit in ("kW", "W") and re.fullmatch(r"[kM]?VA", text, re.ASCII | re.IGNORECASE):
            raise SceneError(
                f"{where} = {shown(raw)}: is apparent power; must be a power in W: engine power = "
                "kVA x power factor / generator efficiency"
            )
        factor = factor_between(text, unit) if len(text) <= 40 else None
        if factor is None:
            raise SceneError(f"{where} = {shown(raw)}: {_wanted(unit)}")
        number *= factor
    return _finite(number, raw, where, unit)


def magnitude(quantity: Any, where: str, unit: str) -> Any:
    """Return what a quantity of pint is in a unit of scenes; other kinds are refused."""
    given = str(quantity.units)
    if unit == "rpm" and not any(word in given for word in _OF_TURNS):
        wanted = "1/minute"  # In rpm, pint would count radians
    else:
        wanted = _for_pint(unit)
    try:
        return quantity.to(wanted).magnitude
    except Exception:  # pint raises errors of its own
        allowed = "without a unit" if unit == "1" else f"in {unit}"
        raise SceneError(f"{where}: is in {one_line(given, 60)}; must be {allowed}") from None


def _for_pint(unit: str) -> str:
    """A unit of an archive, `kg m2`, as pint reads it."""
    if unit == "1":
        return "dimensionless"
    return re.sub(r"([A-Za-z])(-?\d)", r"\1**\2", unit).replace(" ", "*")


def _finite(number: float, raw: Any, where: str, unit: str) -> float:
    if not math.isfinite(number):
        raise SceneError(f"{where} = {shown(raw)}: {_wanted(unit)}")
    return number


def _wanted(unit: str) -> str:
    if unit == "1":
        return "must be a number without a unit, or in percent, such as 0.5 %"
    return f"must be a number in {unit}, or a number with a unit, such as 10 {unit}"
