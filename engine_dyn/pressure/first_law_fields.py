"""Fields of the cycles by the first law: units in files, ranges, and what is not a cycle."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.pressure.file_fields import FileField, file_units
from engine_dyn.pressure.first_law_formulas import POLYTROPIC, WOSCHNI
from engine_dyn.types import Floats

WALLS = ("adiabatic", "polytropic", "woschni")
"""Models of the heat that goes to the walls."""


_GAS = {
    "compression_ratio": FileField("1", 1.5, 40.0),
    "crank_ratio": FileField("1", 0.0, 1.0),
    "intake_pressure": FileField("bar", 0.0, 20.0),
    "exhaust_pressure": FileField("bar", 0.0, 20.0),
    "charge_temperature": FileField("K", 200.0, 700.0),
    "heat": FileField("bar", 0.0, 200.0, ends=True),
    "combustion_start": FileField("degree", -90.0, 90.0),
    "combustion_duration": FileField("degree", 2.0, 270.0),
    # Below 1 the rate of heat release has a corner that no spline follows.
    "combustion_form": FileField("1", 1.0, 10.0, ends=True),
    "valve_ramp": FileField("degree", 2.0, 90.0),
    "valve_lag": FileField("degree", 0.5, 45.0),
}
_FURTHER = {
    "offset_ratio": FileField("1", -10.0, 10.0),
    "premixed_share": FileField("1", 0.0, 1.0, ends=True),
    "premixed_start": FileField("degree", -90.0, 90.0),
    "premixed_duration": FileField("degree", 2.0, 180.0),
    "premixed_form": FileField("1", 1.0, 10.0, ends=True),
    "wiebe_factor": FileField("1", 1.0, 20.0),
    "gamma_300": FileField("1", 1.0, 5.0 / 3.0, ends=True),
    "gamma_slope": FileField("K-1", 0.0, 3e-4, ends=True),
}
_OF_WALL = {
    POLYTROPIC: {
        "compression_exponent": FileField("1", 1.0, 5.0 / 3.0),
        "expansion_exponent": FileField("1", 1.0, 5.0 / 3.0),
    },
    WOSCHNI: {
        "wall_temperature": FileField("K", 200.0, 1200.0),
        "wall_factor": FileField("1", 0.0, 10.0, ends=True),
        "bore": FileField("m", 0.0, 3.0),
        "stroke": FileField("m", 0.0, 6.0),
        "speed": FileField("rpm", 0.0, 30000.0),
    },
}
_VALVES = {
    "intake_loss": FileField("bar", 0.0, 10.0, ends=True),
    "exhaust_loss": FileField("bar", 0.0, 10.0, ends=True),
    "intake_closing": FileField("degree", -180.0, -45.0),
    "exhaust_opening": FileField("degree", 45.0, 180.0),
}
_PORTS = {
    "exhaust_opening": FileField("degree", 45.0, 180.0),
    "scavenge_opening": FileField("degree", 45.0, 180.0),
    "exhaust_closing": FileField("degree", -180.0, -45.0),
}
FIELDS_OF_WALL: Mapping[str, tuple[str, ...]] = {
    word: tuple(_OF_WALL.get(code, ())) for code, word in enumerate(WALLS)
}
"""Fields that one model of the walls needs, and no other takes."""

_WALL_FIELDS = {name: item for part in _OF_WALL.values() for name, item in part.items()}


FOUR_STROKE_FIELDS: Mapping[str, FileField] = {**_GAS, **_FURTHER, **_WALL_FIELDS, **_VALVES}
"""Fields of a FourStrokeCycle in engine files."""
TWO_STROKE_FIELDS: Mapping[str, FileField] = {**_GAS, **_FURTHER, **_WALL_FIELDS, **_PORTS}
"""Fields of a TwoStrokeCycle in engine files."""
FOUR_STROKE_UNITS = file_units(FOUR_STROKE_FIELDS)
"""Unit in which an engine file gives each number of a FourStrokeCycle, and its size in SI."""
TWO_STROKE_UNITS = file_units(TWO_STROKE_FIELDS)
"""The same of a TwoStrokeCycle."""


def wall_code(wall: str) -> int:
    """Place of a model of the walls in WALLS; ValueError for a word that is not one of them."""
    if wall not in WALLS:
        allowed = ", ".join(f"'{word}'" for word in WALLS)
        raise ValueError(f"wall = {wall!r}: must be one of {allowed}")
    return WALLS.index(wall)


def refusals(period: float, columns: Mapping[str, Floats], wall: int) -> Iterator[Any]:
    """Find values that are not a cycle: where (an array), and a function of the place that says it.

    `period` tells a four-stroke cycle from a two-stroke one; `wall` is the place in WALLS.
    """
    four = period == FOUR_STROKE
    units = FOUR_STROKE_UNITS if four else TWO_STROKE_UNITS
    ranges = {**_GAS, **_FURTHER, **(_VALVES if four else _PORTS), **_OF_WALL.get(wall, {})}

    def said(name: str, allowed: str) -> Any:
        unit, size = units[name]
        words = "" if unit == "1" else f" {unit}"

        def message(place: int) -> str:
            value = float(columns[name].reshape(-1)[place])
            if not math.isfinite(value):
                return f"{name} = {value}: must be a finite number"
            return f"{name} = {value / size:.6g}{words}: must be {allowed}"

        return message

    for name, item in ranges.items():
        low, high, ends, size = item.low, item.high, item.ends, item.size
        value = columns[name]
        within = (value >= low * size) & (value <= high * size)
        if not ends:
            within &= (value != low * size) & (value != high * size)
        if name == "exhaust_closing":
            within |= np.isnan(value)
        yield ~within, said(name, item.allowed)

    offset, ratio = columns["offset_ratio"], columns["crank_ratio"]
    yield (
        ~(ratio * (1.0 + np.abs(offset)) < 1.0),
        said("offset_ratio", "such that the crank turns: with the crank radius below the rod"),
    )
    closing, opening = closing_angle(period, columns), columns["exhaust_opening"]
    starts = [columns["combustion_start"]]
    starts.append(np.where(columns["premixed_share"] > 0.0, columns["premixed_start"], starts[0]))
    last = "intake_closing" if four else "scavenge_opening"
    if not four:
        yield (
            columns["scavenge_opening"] <= opening,
            said("scavenge_opening", "after exhaust_opening"),
        )
        last = "exhaust_opening"
    else:
        for name, source in (
            ("intake_loss", "intake_pressure"),
            ("exhaust_loss", "exhaust_pressure"),
        ):
            yield columns[name] > 0.5 * columns[source], said(name, f"at most half of {source}")
    for name, start in zip(("combustion_start", "premixed_start"), starts, strict=True):
        yield start <= closing, said(name, f"after the cylinder has closed ({last})")
        yield start >= opening, said(name, "before exhaust_opening")
    ramp = columns["valve_ramp"]
    room = period + closing - opening
    yield (
        2.0 * ramp > room,
        said("valve_ramp", "at most half the time for which the cylinder is open"),
    )


def closing_angle(period: float, columns: Mapping[str, Floats]) -> Floats:
    """Angle [rad] at which the cylinder has closed."""
    if period == FOUR_STROKE:
        return columns["intake_closing"]
    exhaust = columns["exhaust_closing"]
    exhaust = np.where(np.isnan(exhaust), -columns["exhaust_opening"], exhaust)
    return np.asarray(np.maximum(exhaust, -columns["scavenge_opening"]))
