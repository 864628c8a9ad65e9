"""A number with a unit, as a person writes it: "36.4 kW", "2700 rpm", "75bar", or a plain number.

Units are those of pint's registry. Only the unit goes to pint, never an expression: "9**9**9 W" of
a stranger would otherwise be computed.
"""

from __future__ import annotations

import math
import re
from functools import lru_cache
from typing import Any

from sweeps.base import array_libraries
from sweeps.base.errors import SceneError, one_line, shown

_OF_TURNS = ("radian", "degree", "revolution", "turn", "rpm", "rps")


def number_with_unit(raw: Any, where: str, unit: str) -> float:
    """Return a number in `unit`; a plain number is already in it.

    Parameters
    ----------
    raw : str or float
        "36.4 kW", "36.4" or 36.4.
    where : str
        Beginning of messages, such as "--power".
    unit : str
        As pint writes it, "kW", "rpm", "bar", "g/kWh", or as archives do, "kg m2", "1".

    Raises
    ------
    SceneError
        For a text that is no number with a unit, a unit of something else or of apparent power, or
        a unit where pint is not installed.
    """
    if isinstance(raw, int | float) and not isinstance(raw, bool):
        return _finite(float(raw), raw, where, unit)
    pattern = re.compile(
        r"\s*([+-]?(?:\d{1,30}\.?\d{0,30}|\.\d{1,30})(?:[eE][+-]?\d{1,3})?)\s*", re.ASCII
    )
    match = pattern.match(raw) if isinstance(raw, str) else None
    if match is None:
        raise SceneError(f"{where} = {shown(raw)}: {_wanted(unit)}")
    # Characters that people write in units, and how pint has them
    typed = str.maketrans({"²": "2", "³": "3", "·": "*", "%": "percent"})
    number, text = float(match[1]), raw[match.end() :].strip().translate(typed)
    if text:
        number *= _factor(text, raw, where, unit)
    return _finite(number, raw, where, unit)


def _factor(text: str, raw: str, where: str, unit: str) -> float:
    """Size of a unit that a person wrote, in `unit`."""
    if text == unit:
        return 1.0
    apparent = (
        "is apparent power; must be a power in W: engine power = kVA x power factor / generator "
        "efficiency"
    )
    if (
        unit in ("kW", "W")
        and re.fullmatch(r"[kM]?VA", text, flags=re.ASCII | re.IGNORECASE) is not None
    ):
        raise SceneError(f"{where} = {shown(raw)}: {apparent}")
    if (
        re.fullmatch(r"[A-Za-z][A-Za-z_ ./*^-]{0,30}\d?|1?/[a-z]{1,10}", text, flags=re.ASCII)
        is None
    ):
        raise SceneError(f"{where} = {shown(raw)}: {_wanted(unit)}")
    try:
        registry = unit_registry()
    except ImportError:
        raise SceneError(
            f"{where} = {shown(raw)}: units need the package pint (pip install 'engine-dyn[lab]'); "
            f"without it, give a plain number in {unit}"
        ) from None
    try:
        text = re.sub(r"([a-z])(-?\d)$", r"\1^\2", f"1{text}" if text.startswith("/") else text)
        given = registry.Quantity(1.0, registry.parse_units(text))
        if "volt" in str(given.units) and unit in ("kW", "W"):
            raise SceneError(f"{where} = {shown(raw)}: {apparent}")
        of_turns = any(word in str(given.units) for word in _OF_TURNS)
        if unit == "rpm" and not of_turns:
            # pint counts radians where a unit names no turns: 2700/min would be 430 rpm.
            return float(given.to("1/minute").magnitude)
        if of_turns != (unit == "rad s-1") and unit in ("rad s-1", "Hz", "min-1"):
            raise ValueError  # pint takes 1/s and rad/s for equal
        if registry.Quantity(0.0, given.units).to(_for_pint(unit)).magnitude:
            raise ValueError  # No factor converts a scale of temperature such as degrees Celsius
        return float(given.to(_for_pint(unit)).magnitude)
    except SceneError:
        raise
    except Exception:  # pint raises errors of its own, of Python's tokenizer and of arithmetic
        raise SceneError(f"{where} = {shown(raw)}: {_wanted(unit)}") from None


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


@lru_cache(maxsize=1)
def unit_registry() -> Any:
    """Return pint's registry, which also knows PS and CV of engines, and a revolution as rev."""
    array_libraries.let_in("pint")
    import pint

    registry: Any = pint.UnitRegistry()
    registry.define("metric_hp = metric_horsepower = PS = ps = CV")
    registry.define("@alias revolution = rev")
    return registry
