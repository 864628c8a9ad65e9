"""Units of columns as laboratories write them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import NamedTuple

from sweeps.base.errors import SceneError, shown
from sweeps.base.files.numbers_with_units import factor_between

ANGLES = {
    "°": 1.0, "deg": 1.0, "degree": 1.0, "degrees": 1.0, "grad": 1.0, "°ca": 1.0, "degca": 1.0,
    "deg ca": 1.0, "deg_ca": 1.0, "ca": 1.0, "cad": 1.0, "°kw": 1.0, "kw°": 1.0, "degcrk": 1.0,
    "°crk": 1.0, "°crank": 1.0, "ca deg": 1.0, "ca°": 1.0, "degc a": 1.0,
    "rad": 57.29577951308232, "radian": 57.29577951308232, "radians": 57.29577951308232,
    "rev": 360.0, "turn": 360.0, "revolution": 360.0, "revolutions": 360.0, "u": 360.0,
}  # fmt: skip
"""Degrees in each unit of angles; `grad` is German for degree, and not the gon."""

_OF_DEAD_CENTRE = re.compile(
    r"(?P<plain>.+?)(?<![ _])[ _]++(?:a|after |(?P<before>b|before ))t\.?d\.?c\.?f?", re.I
)
"""Angles after or before top dead centre, "f" for firing."""

SECONDS = {
    "": 1.0, "s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6,
    "ns": 1e-9, "min": 60.0,
}  # fmt: skip
"""Seconds in each unit of times."""

_FOREIGN = {
    "град": "deg", "градус": "deg", "градусы": "deg", "гр": "deg", "°пкв": "deg", "градпкв": "deg",
    "гпкв": "deg", "рад": "rad", "бар": "bar", "мпа": "MPa", "кпа": "kPa", "гпа": "hPa", "па": "Pa",
    "атм": "atm", "кгс/см2": "kgf/cm2", "кгс/см²": "kgf/cm2", "в": "V", "мв": "mV", "с": "s",
    "сек": "s", "мс": "ms", "мкс": "us", "об/мин": "rpm", "мин-1": "rpm", "н·м": "N m", "нм": "N m",
    "н*м": "N m", "кн·м": "kN m", "кнм": "kN m", "度": "deg", "°曲轴转角": "deg", "弧度": "rad",
    "巴": "bar", "兆帕": "MPa", "千帕": "kPa", "百帕": "hPa", "帕": "Pa", "伏": "V", "伏特": "V",
    "秒": "s", "毫秒": "ms", "微秒": "us", "转/分": "rpm", "轉/分": "rpm", "回転/分": "rpm",
    "牛米": "N m", "牛·米": "N m", "千牛米": "kN m", "도": "deg", "초": "s", "바": "bar",
}  # fmt: skip
"""Units in other scripts, in lower case and without blanks and full stops."""

_GAUGE = re.compile(r"^(bar|mbar|kpa|mpa|psi|pa)\s*[\s_(\[]?(g|gauge|rel|ü|relative)[)\]]?$", re.I)
_ABSOLUTE = re.compile(r"^(bar|mbar|kpa|mpa|psi|pa)\s*[\s_(\[]?(a|abs|absolute)\.?[)\]]?$", re.I)


class PressureUnit(NamedTuple):
    """A unit of pressure, or of the voltage that stands for one.

    `factor` is its value [Pa], of a voltage [V]; `gauge` says that the ambient pressure is to be
    added.
    """

    factor: float
    gauge: bool
    voltage: bool


def in_latin(text: str) -> str:
    """Return a unit in Latin letters; as it is where it is none of another script."""
    return text if text.isascii() else _FOREIGN.get(re.sub(r"[\s.]", "", text.lower()), text)


def angle_factor(text: str, label: str) -> float:
    """Degrees of a unit of angles; any other unit is refused."""
    degrees = _angle(text)
    if degrees is None:
        raise SceneError(f"{label}: unit {shown(text)}: must be one of deg, rad, rev")
    return degrees


def is_angle_unit(text: str) -> bool:
    """Whether a text is a unit of angles."""
    return _angle(text) is not None


def _angle(text: str) -> float | None:
    """Degrees of a unit of angles such as "deg" or "deg ATDC"; below 0 for "deg BTDC"."""
    match = _OF_DEAD_CENTRE.fullmatch(text.strip())
    plain, before = (text.strip(), None) if match is None else (match["plain"], match["before"])
    size = ANGLES.get(plain.lower())
    return -size if size is not None and before else size


def is_pressure_level(text: str) -> bool:
    """Whether a text is a unit of gauge or absolute pressures, such as "kPa g" or "bar abs"."""
    return any(pattern.match(text.strip()) for pattern in (_GAUGE, _ABSOLUTE))


def counts_before(name: str) -> bool:
    """Whether the name of an angle, such as "CAD BTDC", says that it falls towards dead centre."""
    match = _OF_DEAD_CENTRE.fullmatch(name.strip())
    return match is not None and match["before"] is not None


def is_time_name(name: str) -> bool:
    """Whether a column is called a time, with or without a unit, as in "time_us"."""
    time = re.compile(
        r"(t|times?|zeit|time ?stamp|elapsed time|abs(olute)? ?time|x_value|"
        r"время|时间|時間|temps|tiempo)"
        rf"([_ ]({'|'.join(unit for unit in SECONDS if unit)}))?",
        re.I,
    )
    return time.fullmatch(name.strip()) is not None


def stated_unit(unit: str, name: str, units: Iterable[str]) -> str:
    """Unit that a file states for a column, in lower case; or one at the end of the column's name.

    `unit` is as stated, with or without brackets, and "" where it is not. A `name` such as
    "time_us" may end with one of `units`.
    """
    plain = unit.strip().strip("[]()").strip().lower()
    last = re.split("[_ ]", name.strip())[-1].lower()
    return last if not plain and last in units else plain


@lru_cache(maxsize=100)
def pressure_unit(text: str) -> PressureUnit | None:
    """Return what a text means as a unit of pressure or voltage; None where it means neither."""
    plain, gauge = text.strip(), False
    for pattern in (_GAUGE, _ABSOLUTE):
        match = pattern.match(plain)
        if match is not None:
            plain, gauge = match[1], pattern is _GAUGE
    plain = re.sub(r"(?<=[a-z])(?:\^|\*\*)?([23])\b", r"**\1", plain.replace("·", "*"))
    plain = plain.replace("²", "**2")
    allowed = re.compile(r"[A-Za-zµ]{1,24}(?:\*\*[1-3])?(?:[/*][A-Za-zµ]{1,24}(?:\*\*[1-3])?)?")
    spellings = {
        "kpa": "kPa", "mpa": "MPa", "hpa": "hPa", "pa": "Pa", "bar": "bar", "mbar": "mbar",
        "psi": "psi", "atm": "atm", "torr": "torr", "mmhg": "mmHg", "v": "V", "mv": "mV",
        "volt": "V", "volts": "V", "at": "at",
    }  # fmt: skip
    for name in (plain, spellings.get(plain.lower(), "")):
        if allowed.fullmatch(name) is None:
            continue
        for unit in ("Pa", "V"):
            factor = factor_between(name, unit)
            if factor is not None:
                return PressureUnit(factor, gauge and unit == "Pa", unit == "V")
    return None


def unit_of_name(name: str, label: str) -> str:
    """Return the unit at the end of a name such as "pressure_bar" or "p1 kPa"; "" without one."""
    match = re.search(r"[_\s]([A-Za-z°]{1,12})$", name)
    if match is None:
        return ""
    last = match[1]
    if last.lower() in ANGLES or last.lower() in ("bar", "kpa", "mpa", "psi", "pa", "mbar", "hpa"):
        return last
    return ""
