"""Names and units of columns, from the rows of texts above the numbers."""

from __future__ import annotations

import re
from collections.abc import Sequence

from sweeps.errors import one_line
from sweeps.reading.laboratory.units import SECONDS, is_angle_unit

__all__ = ["is_number", "names_and_units", "number_of", "split_unit", "start_of_numbers"]

_UNIT_WORDS = {
    "", "-", "1", "deg", "°", "degree", "degrees", "°ca", "degca", "deg ca", "ca", "cad", "deg_ca",
    "degcrk", "°crk", "grad", "rad", "bar", "mbar", "bara", "barg", "bar abs", "kpa", "mpa", "hpa",
    "pa", "psi", "psia", "atm", "torr", "mmhg", "n/mm2", "n/mm^2", "n/m2", "kgf/cm2", "v", "mv",
    "volt", "rpm", "1/min", "min-1", "nm", "n m", "n", "kg",
    "mm", "m", "cm3", "c", "°c", "degc", "k", "kw", "%", "ppm", "g/s", "kg/h", "l", "dm3", "hz",
    "khz", "rad/s", "j", "kj", "j/deg", "a", "ma", "pc", "°kw", "kw°", "°crank", "ca°", *SECONDS,
}  # fmt: skip
"""Texts that are units and no names, in lower case."""

_IN_BRACKETS = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<a>[^\[\]]*)\]|\((?P<b>[^()]*)\))\s*$")

_OVER_UNIT = re.compile(r"^(?P<name>[^/]*[^/\s])\s*/\s*(?P<unit>\S.*)$")
"""Quantity over unit, as DIN 461 and ISO 80000-1 write heads of tables: "p/bar", "n/1/min"."""


def number_of(text: str, decimal: str = ".") -> float:
    """Convert a field to a number.

    Raises
    ------
    ValueError
        For a text that is no number.
    """
    if not text.isascii() or "_" in text or (decimal == "," and "." in text):
        raise ValueError(text)
    return float(text.replace(",", ".") if decimal == "," else text)


def is_number(text: str, decimal: str = ".") -> bool:
    """Whether a field is a number."""
    try:
        number_of(text.strip(), decimal)
    except ValueError:
        return False
    return True


def start_of_numbers(rows: Sequence[Sequence[str]], decimal: str = ".") -> tuple[int, int] | None:
    """Find where the numbers begin: the row (from 0) and how many columns they have.

    That is the first row of numbers (blank fields between them allowed) that only such rows of as
    many columns follow, five of them or all that there are. Where two such rows in a row stand
    above, the numbers begin there: a text among numbers is no header.
    """
    widths = [_width(row, decimal) for row in rows]
    for place, width in enumerate(widths):
        following = widths[place : place + 6]
        if width and all(other == width for other in following):
            above = (i for i in range(place - 1) if widths[i] == widths[i + 1] == width)
            return next(above, place), width
    return None


def _width(row: Sequence[str], decimal: str) -> int:
    """Number of columns of a row of numbers; 0 for any other row."""
    fields = list(row)
    while fields and not fields[-1].strip():
        fields.pop()
    filled = [text for text in fields if text.strip()]
    if not filled:
        return 0
    # One field may hold a label or a time of day; most must be numbers.
    good = sum(is_number(text, decimal) for text in filled)
    return len(fields) if good and len(filled) - good <= (len(filled) - 1) // 2 else 0


def split_unit(text: str) -> tuple[str, str]:
    """Split "p1 [bar]", "Angle (deg)" or "p/bar" into name and unit; "" where there is none."""
    found = _IN_BRACKETS.match(text)
    if found is None:
        over = _OVER_UNIT.match(text.strip())
        if over is None or not _is_unit(over["unit"]):
            return text.strip(), ""
        return over["name"], over["unit"]
    unit = found["a"] if found["a"] is not None else found["b"]
    if found["a"] is None and not _is_unit(unit):
        return text.strip(), ""  # "p (cylinder 1)"
    return found["name"].strip(), unit.strip()


def names_and_units(above: Sequence[Sequence[str]], width: int) -> tuple[list[str], list[str]]:
    """Names and units of columns.

    Parameters
    ----------
    above : sequence of rows
        Rows above the numbers, the nearest last.
    width : int
        Number of columns.
    """
    names, units = [""] * width, [""] * width
    fitting: list[list[str]] = []
    alone = False
    for row in reversed(above[-12:]):
        fields = [text.strip().strip('"').lstrip("#%").strip() for text in row]
        while len(fields) > width and not fields[-1]:
            fields.pop()
        if not any(fields):
            continue
        filled = sum(map(bool, fields))
        one_unit = filled == 1 and len(fields) == width and _are_units(fields)
        if filled == 1 < width and not (alone or one_unit):  # a word between names and numbers
            alone = True
            continue
        if (
            len(fields) > width
            or (width > 1 and filled < 2 and not one_unit)
            or (alone and not _are_names(fields, width))
        ):
            break
        fitting.append(fields + [""] * (width - len(fields)))
        if len(fitting) == 3:
            break
    if fitting and (_are_units(fitting[0]) or _seem_units(fitting, width)):
        units = [_bare(text) for text in fitting.pop(0)]
    if fitting and not _are_units(fitting[0]):
        names = fitting[0]
    elif len(fitting) > 1:
        names = fitting[1]
    found_names, found_units = [], []
    for number, (text, unit) in enumerate(zip(names, units, strict=True), start=1):
        name, own = split_unit(text)
        found_names.append(one_line(name, 200) or f"column {number}")
        found_units.append(one_line(own or unit, 60))
    return found_names, found_units


def _are_names(fields: Sequence[str], width: int) -> bool:
    """Whether a row has a name for each column; a text that begins with a digit is none."""
    return len(fields) == width and all(text and not text[0].isdigit() for text in fields)


def _seem_units(fitting: Sequence[Sequence[str]], width: int) -> bool:
    """Whether the nearest row holds units with unknown ones among them, below a row of names."""
    nearest = [text for text in fitting[0] if text]
    return (
        len(fitting) > 1
        and _are_names(fitting[1], width)
        and len(set(fitting[1])) == width
        and any(_is_unit(_bare(text)) for text in nearest)
        and len(set(nearest)) < len(nearest)
    )


def _is_unit(text: str) -> bool:
    return text.strip().lower() in _UNIT_WORDS or is_angle_unit(text)


def _bare(text: str) -> str:
    return text.strip("[]() \t")


def _are_units(fields: Sequence[str]) -> bool:
    """Whether a row holds units: all its texts are units, or stand in brackets."""
    filled = [text for text in fields if text]
    return bool(filled) and all(
        _is_unit(_bare(text)) or (text[0] in "[(" and text[-1] in ")]") for text in filled
    )
