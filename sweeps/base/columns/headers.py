"""Names and units of columns, from the rows of texts above the numbers."""

from __future__ import annotations

import re
from collections.abc import Sequence

from sweeps.base.columns.units import SECONDS, in_latin, is_angle_unit, is_pressure_level
from sweeps.base.errors import one_line

_UNIT_WORDS = {
    "", "-", "1", "deg", "°", "degree", "degrees", "°ca", "degca", "deg ca", "ca", "cad", "deg_ca",
    "degcrk", "°crk", "grad", "rad", "bar", "mbar", "bara", "barg", "bar abs", "kpa", "mpa", "hpa",
    "pa", "psi", "psia", "atm", "torr", "mmhg", "n/mm2", "n/mm^2", "n/m2", "kgf/cm2", "v", "mv",
    "volt", "rpm", "1/min", "min-1", "nm", "n m", "n", "kg",
    "mm", "m", "cm3", "c", "°c", "degc", "k", "kw", "%", "ppm", "g/s", "kg/h", "l", "dm3", "hz",
    "khz", "rad/s", "j", "kj", "j/deg", "a", "ma", "pc", "°kw", "kw°", "°crank", "ca°", *SECONDS,
    "lbfft", "lbft", "lb-ft", "ftlbf", "ftlb", "ft-lb", "ft-lbf", "lbfin", "lbin", "lb-in", "inlbf",
    "inlb", "in-lb", "lbf", "knm", "danm", "nmm", "kgfm", "kgm", "kn", "1/s", "r/min", "u/min",
    "kg/cm2", "kg/cm^2", "kgf/cm^2", "kn/m2", "inhg", "inh2o", "mmh2o", "cm3/s", "m/s", "w", "hp",
}  # fmt: skip
"""Texts that are units and no names, in lower case; blanks and signs of products may be left out
of them."""

LONGEST_HEAD = 300  # Characters of the head of a column that are looked at


TURNS = (360.0, 6.283185307179586, 1.0)  # Length of a turn in each unit of angles

RUN = 6  # Rows of numbers, one after the other, that make a table


def number_of(text: str, decimal: str = ".") -> float:
    """Convert a field to a number, or raise ValueError."""
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
    above, the numbers begin there: a text among numbers is no header. Rows directly above that
    have more columns, such as notes beside the first samples, belong to it where its numbers go
    on evenly from them. Where rows of numbers never have equally many, a column is blank at times.
    """
    widths = [_width(row, decimal) for row in rows]
    ends = range(max(len(widths) - RUN + 1, 0), len(widths))
    for place in range(ends.start):
        if len(set(widths[place : place + RUN])) == 1 and widths[place]:
            return _from_first(rows, widths, place, decimal)
    for place in range(ends.start):
        if min(widths[place : place + RUN]) > 1:
            return place, max(widths[place:])
    for place in ends:
        if len(set(widths[place:])) == 1 and widths[place]:
            return _from_first(rows, widths, place, decimal)
    return None


def _from_first(
    rows: Sequence[Sequence[str]], widths: Sequence[int], place: int, decimal: str
) -> tuple[int, int]:
    """First row of a table that some of its rows reveal, and the number of its columns."""
    width = widths[place]
    above = (i for i in range(place - 1) if widths[i] == widths[i + 1] == width)
    first = next(above, place)
    while first and _goes_on(rows[first - 1 : first + 2], width, decimal):
        first -= 1
    return first + _is_no_sample(rows[first : first + RUN], width, decimal), width


def _is_no_sample(rows: Sequence[Sequence[str]], width: int, decimal: str) -> bool:
    """Whether the first row of numbers holds channels or factors: angle or time goes back after it.

    An angle that begins again goes back by whole turns.
    """
    if len(rows) < RUN or width < 2 or _goes_on(rows[:3], width, decimal):
        return False
    for texts in zip(*(row[:width] for row in rows), strict=False):
        if all(is_number(text, decimal) for text in texts):
            first, second, *rest = (number_of(text.strip(), decimal) for text in texts)
            step = rest[0] - second
            even = all(
                abs(b - a - step) <= 0.2 * abs(step) > 0.0
                for a, b in zip([second, *rest[:-1]], rest, strict=True)
            )
            back = (first - second + step) * (1.0 if step > 0.0 else -1.0)
            turns = (back / turn for turn in TURNS if abs(step) < 0.1 * turn)
            again = any(abs(n - round(n)) < 0.5 * abs(step) / TURNS[0] for n in turns)
            if even and back > abs(step) and not again:
                return True
    return False


def _goes_on(rows: Sequence[Sequence[str]], width: int, decimal: str) -> bool:
    """Whether a column of the first of three rows rises or falls to the next ones evenly."""
    if len(rows) < 3 or _width(rows[0][:width], decimal) != width:
        return False
    for texts in zip(*(row[:width] for row in rows), strict=True):
        if all(is_number(text, decimal) for text in texts):
            before, here, after = (number_of(text.strip(), decimal) for text in texts)
            step = after - here
            if abs(here - before - step) <= 0.5 * abs(step) > 0.0:
                return True
    return False


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
    text = text[:LONGEST_HEAD]
    match = re.match(r"^(?P<name>.*?)\s*(?:\[(?P<a>[^\[\]]*)\]|\((?P<b>[^()]*)\))\s*$", text)
    if match is None:
        for pattern in (
            # Quantity over unit, as DIN 461 and ISO 80000-1 write heads of tables: "n/1/min".
            r"(?P<name>[^/]*[^/\s])\s*/\s*(?P<unit>\S.*)$",
            # Quantity and unit as in Russian tables: "давление, МПа".
            r"(?P<name>.*\S)\s*,\s*(?P<unit>\S.*)$",
        ):
            written = re.match(pattern, text.strip())
            if written is not None and _is_unit(written["unit"]):
                return written["name"], in_latin(written["unit"])
        return text.strip(), ""
    unit = match["a"] if match["a"] is not None else match["b"]
    if match["a"] is None and not _is_unit(unit):
        return text.strip(), ""  # A name such as "p (cylinder 1)" has no unit in parentheses
    return match["name"].strip(), in_latin(unit.strip())


def names_and_units(
    above: Sequence[Sequence[str]], width: int, sentences: bool = False, numbered: bool = False
) -> tuple[list[str], list[str]]:
    """Names and units of columns.

    Parameters
    ----------
    above : sequence of rows
        Rows above the numbers, the nearest last.
    width : int
        Number of columns. What stands to the right of them is no name.
    sentences : bool
        Whether rows that are longer are words of a sentence: blanks separate the columns.
    numbered : bool
        Whether the first column has the numbers of rows, which need no name.
    """
    names, units = [""] * width, [""] * width
    fitting: list[list[str]] = []
    alone = False
    for row in reversed(above[-12:]):
        fields = [text[:LONGEST_HEAD].strip().strip('"').lstrip("#%").strip() for text in row]
        while fields and not fields[-1]:
            fields.pop()
        if len(fields) > width and sentences:
            break
        key, labelled = fields[0].rstrip(": ") if fields else "", len(fields) > 1
        if labelled and re.fullmatch(
            r"comments?|kommentar|description|beschreibung|lengths?|länge|min(imum)?|max(imum)?|mean|"
            r"samples|type|typ|source|offset|factor|scale", key, re.I,
        ):  # fmt: skip
            continue
        # A word that announces names or units stands before them in a row.
        if labelled and re.fullmatch(
            r"(channel ?)?names?|(kanal)?namen?|kanal|channels?|bezeichnung|signal|"
            r"units?|einheit(en)?", key, re.I,
        ):  # fmt: skip
            fields = fields[1:] if len(fields) > width else ["", *fields[1:]]
        if len(fields) == width - 1 and numbered:  # Rows of numbers begin with their own number
            fields = ["", *fields]
        fields = fields[:width] + [""] * (width - len(fields))
        if all(is_number(text) for text in fields if text):
            continue
        filled = sum(map(bool, fields))
        one_unit = filled == 1 and bool(fields[-1]) and _are_units(fields)
        # A single word in a row above the numbers is a note
        if filled == 1 < width and not (alone or one_unit):
            alone = True
            continue
        if (width > 1 and filled < 2 and not one_unit) or (alone and not _are_names(fields, width)):
            break
        fitting.append(fields)
        if len(fitting) == 3:
            break
    if fitting and (_are_units(fitting[0]) or _seem_units(fitting, width)):
        units = ["" if _is_count(text) else _bare(text) for text in fitting.pop(0)]
    if fitting and not _are_units(fitting[0]):
        names = fitting[0]
    elif len(fitting) > 1:
        names = fitting[1]
    found_names, found_units = [], []
    for number, (text, unit) in enumerate(zip(names, units, strict=True), start=1):
        name, own = split_unit(text)
        found_names.append(one_line(name, 200) or f"column {number}")
        found_units.append(one_line(own or in_latin(unit), 60))
    return found_names, found_units


def _are_names(fields: Sequence[str], width: int) -> bool:
    """Whether a row has a name for each column; no name begins with a digit."""
    return len(fields) == width and all(text and not text[0].isdigit() for text in fields)


def _seem_units(fitting: Sequence[Sequence[str]], width: int) -> bool:
    """Whether the nearest row seems to hold units, some of them unknown, below a row of names."""
    nearest = [text for text in fitting[0] if text]
    return (
        len(fitting) > 1
        and _are_names(fitting[1], width)
        and len(set(fitting[1])) == width
        and any(_is_unit(_bare(text)) and not _is_count(text) for text in nearest)
        and (len(set(nearest)) < len(nearest) or any(map(_is_count, nearest)))
    )


def _is_count(text: str) -> bool:
    """Whether a field is a number that may stand in a row of units, where a column has no unit."""
    return text != "1" and (is_number(text) or is_number(text, ","))


def _is_unit(text: str) -> bool:
    plain = in_latin(text.strip()).lower()
    joined = re.sub(r"[ ·⋅*]", "", plain)
    level = is_pressure_level(plain)
    return level or plain in _UNIT_WORDS or joined in _UNIT_WORDS or is_angle_unit(plain)


def _bare(text: str) -> str:
    return text.strip("[]() \t")


def _are_units(fields: Sequence[str]) -> bool:
    """Whether a row holds units: all its texts are units, or stand in brackets."""
    filled = [text for text in fields if text]
    return bool(filled) and all(
        _is_unit(_bare(text)) or (text[0] in "[(" and text[-1] in ")]") for text in filled
    )
