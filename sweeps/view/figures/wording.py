"""Words, numbers and units as figures print them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from pathlib import PureWindowsPath

import numpy as np
import xarray as xr

from engine_dyn.types import Floats
from sweeps.base.errors import printable
from sweeps.base.naming import meaning_of
from sweeps.base.numbers import DIGITS, number_text

HARD_SPACE = "\N{NO-BREAK SPACE}"  # Space that no line break replaces, as before a unit
EN_DASH = "\N{EN DASH}"
LEAST_SPAN = 1e-6
"""Relative difference below which values are drawn as equal: ticks could not show it."""


def unit_text(units: str) -> str:
    """Units as they are printed: ``rad s-1`` becomes rad/s, ``kg m2`` gets its superscript.

    Powers may be written ``m2``, ``m^2`` or ``m**2``, as UDUNITS reads them. A dimensionless unit
    (``1``) is empty, and what is not a product of powers stays as it came.
    """
    units = units.strip()
    if units in ("", "1"):
        return ""
    special = {"percent": "%", "degree": "\N{DEGREE SIGN}", "degrees": "\N{DEGREE SIGN}"}
    over: list[str] = []
    under: list[str] = []
    sign = 1
    for part in re.findall(r"/|(?:\*\*|[^\s/*.]|\.(?=\d))+", units):
        if part == "/":
            sign = -1
            continue
        match = re.fullmatch(r"([^\d\s^*+-]+)(?:\^|\*\*)?([-+]?\d{1,9}(?:\.\d+)?)?", part)
        if match is None or not match[1].strip("()"):
            return plain_text(units)
        power = sign * float(match[2] or 1)
        sign = 1
        name = special.get(match[1], plain_text(match[1]))
        (over if power > 0 else under).append(name + _power(abs(power)))
    if not under:
        return " ".join(over)
    below = " ".join(under)
    return (" ".join(over) or "1") + "/" + (below if len(under) == 1 else f"({below})")


def axis_label(variable: xr.Variable, key: str) -> str:
    """Label of an axis: long name (up to its first comma), symbol, unit: ``Engine speed n (rpm)``.

    The attributes are all optional; `key`, the name in the archive, stands for a missing long name,
    and a dash for the unit of a number without one.
    """
    return title_of(variable, key) + unit_in_brackets(variable)


def title_of(variable: xr.Variable, key: str) -> str:
    """Long name and symbol, without the unit."""
    return f"{sentence(name_of(variable, key))} {symbol_of(variable)}".rstrip()


def _power(power: float) -> str:
    if power == 1:
        return ""
    if power == int(power):
        return "".join("\N{SUPERSCRIPT ZERO}¹²³⁴⁵⁶⁷⁸⁹"[int(digit)] for digit in str(int(power)))
    return f"$^{{{power:g}}}$"


def plain_text(text: str) -> str:
    """Text that is not mathematics: a dollar sign must not start a formula.

    What steers a terminal is escaped: matplotlib prints the letters that a font lacks.
    """
    return HARD_SPACE.join(map(printable, text.split(HARD_SPACE))).replace("$", r"\$")


def typeset(value: float, digits: int = DIGITS) -> str:
    """A number as figures set it: `number_text` with a minus sign and a power of ten."""
    if not np.isfinite(value):
        return EN_DASH
    text, exponent, power = number_text(float(value), digits, zeros=False).partition("e")
    text = text.replace("-", "\N{MINUS SIGN}")
    return text + rf"$\times 10^{{{int(power)}}}$" if exponent else text


def shorten(text: str, most: int = 40) -> str:
    """A label of at most `most` characters; its end is kept, since cases often differ there."""
    text = " ".join(text.split())
    if len(text) > most:
        tail = most // 3
        text = text[: most - tail - 1].rstrip() + "\N{HORIZONTAL ELLIPSIS}" + text[-tail:].lstrip()
    # matplotlib leaves labels that begin with an underscore out of legends
    return plain_text(f" {text}" if text.startswith("_") else text) or "(no name)"


def file_label(path: str) -> str:
    """Name of a recording on figures: its file, without the folder and the ending."""
    return shorten(PureWindowsPath(path).stem)  # A Windows path knows the separators of all systems


def wrap(text: str, most: int) -> str:
    """Break lines at spaces, never inside a formula or a bracket."""
    lines: list[str] = []
    room = 0
    for word in re.findall(r"(?:(?<!\\)\$[^$]*\$|\([^()]*\)|[^ ])+", text):
        size = len(re.sub(r"\\[a-zA-Z]+", "x", re.sub(r"[${}^_]", "", word)))
        if lines and size + 1 <= room:
            lines[-1] += " " + word
            room -= size + 1
        else:
            lines.append(word)
            room = most - size
    return "\n".join(lines)


def sentence(text: str) -> str:
    """First letter as a capital, unless the first word is a symbol such as mN or pH."""
    return text[:1].upper() + text[1:] if text[:2].islower() else text


def name_of(variable: xr.Variable, key: str) -> str:
    """What it is up to its first comma, without brackets: the file keeps what they explain."""
    name = re.sub(r" \([^()]*\)", "", meaning_of(variable.attrs))
    name = name.split(",")[0].strip()
    return plain_text(name or key.replace("_", " "))


def symbol_of(variable: xr.Variable) -> str:
    """The symbol if matplotlib can set it, else nothing."""
    symbol = str(variable.attrs.get("symbol", "")).strip()
    if len(symbol) > 200 or not symbol.isprintable():
        return ""
    return symbol if "$" not in symbol or _can_be_set(symbol) else ""


@cache
def _can_be_set(formula: str) -> bool:
    from matplotlib.mathtext import MathTextParser

    try:
        MathTextParser("path").parse(formula)
    except (ValueError, RuntimeError):
        return False
    return True


def unit_in_brackets(variable: xr.Variable) -> str:
    """Unit in brackets, a dash for dimensionless, nothing where the file gives no units."""
    if "units" not in variable.attrs:
        return ""
    return f"{HARD_SPACE}({unit_text(str(variable.attrs['units'])) or EN_DASH})"


def middle_of_sentence(text: str) -> str:
    """A name as it stands within a sentence."""
    return text[:1].lower() + text[1:] if text[1:2].islower() else text


def value_text(variable: xr.Variable, key: str, value: float, digits: int = DIGITS) -> str:
    """One value of a parameter: symbol = number unit."""
    said = with_unit(variable, value, digits)
    # No line break comes between a symbol, its number and the unit
    return f"{symbol_of(variable) or name_of(variable, key)}{HARD_SPACE}={HARD_SPACE}{said}"


def with_unit(variable: xr.Variable, value: float, digits: int = DIGITS) -> str:
    """A number and its unit."""
    unit = unit_text(str(variable.attrs.get("units", "")))
    space = "" if unit in ("", "\N{DEGREE SIGN}") else HARD_SPACE
    return f"{typeset(value, digits)}{space}{unit.replace(' ', HARD_SPACE)}"


def slug(text: str) -> str:
    """A part of a file name."""
    return re.sub(r"[^A-Za-z0-9_.+-]+", "_", text).strip("_.") or "x"


def equal_lines(names: Sequence[str], lines: Sequence[Floats]) -> list[tuple[int, str]]:
    """The first of lines that lie on each other within their width, and the names of all."""
    values = np.array(lines)
    known = values[np.isfinite(values)]
    if not known.size:
        return list(enumerate(names))
    width = 2e-3 * min(1.0, float(np.ptp(known) / (np.abs(known).max() or 1.0)))
    near = np.isclose(values[:, None], values, rtol=width, atol=0.0, equal_nan=True).all(-1)
    said = []
    for first in np.unique(near.argmax(axis=1)).tolist():
        group = np.flatnonzero(near.argmax(axis=1) == first).tolist()
        words = [names[first], *(names[i].removeprefix("misfire ") for i in group[1:])]
        run = words[0][-1].isdigit() and len(group) > 2 and group[-1] - first == len(group) - 1
        said.append((first, f"{words[0]} to {words[-1]}" if run else ", ".join(words)))
    return said
