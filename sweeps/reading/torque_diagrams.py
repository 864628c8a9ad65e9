"""[[diagram]] of kind 'torque': the engine's torque over the crank angle in place of pressure.

It is given as points or orders of a file, in closed form, or as areas between crossings with the
mean line.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from engine_dyn.loads.driven_machine import (
    MOST_REVOLUTIONS,
    REVOLUTION,
    TorqueOverAngle,
    torque_of_harmonics,
    torque_over_angle,
)
from engine_dyn.units import DEGREE
from sweeps.checks import Strict, check_structure, mentioned
from sweeps.errors import SceneError, one_line, shown
from sweeps.reading.laboratory.columns import named_column
from sweeps.reading.laboratory.recorded_columns import Recording
from sweeps.reading.laboratory.recording import read_recording
from sweeps.reading.laboratory.units import angle_factor, is_angle_unit, unit_of_name
from sweeps.reading.numbers_with_units import number_with_unit
from sweeps.reading.referred_files import referred

__all__ = ["Harmonic", "TorqueDiagram", "harmonics_of", "read_torque_diagram"]

LOBE = 36
"""Intervals between two crossings into which an area is divided."""

BALANCE = 1e-3
"""Part of the largest area by which the areas of a cycle may fail to add up to zero."""

MOST_ORDERS = 200
"""Of a torque in closed form."""

_TORQUE_UNITS = {"nm": "N m", "n*m": "N m", "knm": "kN m", "kn*m": "kN m", "lbft": "lbf ft",
                 "lb-ft": "lbf ft", "lb ft": "lbf ft", "ft-lb": "lbf ft", "kgm": "kgf m",
                 "kgfm": "kgf m"}  # fmt: skip
"""Spellings of units of torque, in lower case, that pint reads otherwise."""


class Harmonic(Strict):
    """One order of a torque in closed form."""

    order: float = Field(description="a number above 0: oscillations in a revolution")
    sine: float = Field(default=0.0, description="a number in N m: the factor of its sine")
    cosine: float = Field(default=0.0, description="a number in N m: the factor of its cosine")


class TorqueDiagram(Strict):
    """[[diagram]] with kind = 'torque': one of `file`, `harmonics` and `areas`."""

    kind: str
    file: str | None = Field(
        default=None,
        description="a string: the path of a file with angle and torque, or with a table of orders",
    )
    angle_column: str | int | None = Field(
        default=None, description="the name or number of the column of the crank angle"
    )
    torque_column: str | int | None = Field(
        default=None, description="the name or number of the column of the torque"
    )
    torque_unit: str | None = Field(
        default=None, description="a string: the unit of the torque, such as 'kN m'"
    )
    mean: float | None = Field(default=None, description="a number in N m: the mean torque")
    harmonics: list[Harmonic] | None = Field(
        default=None, description="a list of tables with order, sine and cosine",
        max_length=MOST_ORDERS,
    )  # fmt: skip
    areas: list[float] | None = Field(
        default=None, min_length=2, max_length=1000,
        description="a list of areas in J between the torque and its mean, in sequence, those "
        "below it negative",
    )  # fmt: skip
    crossings: list[float] | None = Field(
        default=None,
        description="a list of crank angles in degrees at which the areas begin, and the last ends",
    )
    revolutions: int | None = Field(
        default=None, ge=1, le=MOST_REVOLUTIONS,
        description="a whole number: revolutions that equally wide areas take together",
    )  # fmt: skip


ORDER = "order"
"""The column that tells a table of orders."""

_BESIDE = {
    "file": ("angle_column", "torque_column", "torque_unit", "mean"),
    "harmonics": ("mean",),
    "areas": ("mean", "crossings", "revolutions"),
}
"""Ways to give the torque, and the keys that belong to each."""


def read_torque_diagram(table: Mapping[str, Any], where: str, folder: Path) -> TorqueOverAngle:
    """Read the torque of a [[diagram]] table of kind 'torque'.

    Parameters
    ----------
    table : mapping
        The whole table.
    where : str
        What messages begin with.
    folder : Path
        Where the path of a file starts from.

    Raises
    ------
    SceneError
        In one line, for keys that do not go together and what is no torque.
    """
    given = check_structure(TorqueDiagram, dict(table), where)
    ways = [way for way in _BESIDE if getattr(given, way) is not None]
    if len(ways) != 1:
        both = " and ".join(ways)
        said = f"has both {both}" if ways else "file, harmonics or areas: missing"
        raise SceneError(f"{where} {said}: give one of {', '.join(_BESIDE)}")
    for key in {key for keys in _BESIDE.values() for key in keys} - {*_BESIDE[ways[0]]}:
        if getattr(given, key) is not None:
            raise SceneError(f"{where} {key}: not allowed together with {ways[0]}")
    if ways[0] != "file" and given.mean is None:
        raise SceneError(f"{where} mean: missing; must be a number in N m: the mean torque")
    try:
        if given.file is not None:
            return _of_file(given, where, folder)
        if given.harmonics is not None:
            return harmonics_of(given.harmonics, float(given.mean or 0.0))
        return _of_areas(given)
    except ValueError as error:
        raise SceneError(f"{where}: {mentioned(error)}") from None


def harmonics_of(given: list[Harmonic], mean: float, own_angle: bool = False) -> TorqueOverAngle:
    """Torque in closed form; see `torque_of_harmonics` for what is refused."""
    orders = [one.order for one in given]
    twice = next((order for order in orders if orders.count(order) > 1), None)
    if twice is not None:
        raise ValueError(f"order = {twice:g}: given twice; must be given once")
    return torque_of_harmonics(mean, {o.order: (o.sine, o.cosine) for o in given}, own_angle)


def _of_areas(given: TorqueDiagram) -> TorqueOverAngle:
    """Torque whose areas between crossings with its mean are given; each is a squared sine.

    The energy at the crossings, and so its swing, depends on the areas alone, see
    docs/torque_diagrams.md.
    """
    areas, mean = np.array(given.areas), float(given.mean or 0.0)
    if abs(areas.sum()) > BALANCE * np.abs(areas).max():
        raise ValueError(f"areas add up to {areas.sum():.6g} J: must add up to 0 over a cycle")
    if given.crossings is None:
        revolutions = given.revolutions or 1
        edges = np.linspace(0.0, 360.0 * revolutions, len(areas) + 1)
    else:
        edges = np.array(given.crossings)
        if given.revolutions is not None:
            raise ValueError("revolutions: not allowed together with crossings")
        if len(edges) != len(areas) + 1:
            raise ValueError(
                f"crossings: {len(edges)} angles for {len(areas)} areas: must be one more"
            )
        back = next((b for a, b in pairwise(edges.tolist()) if b <= a), None)
        if back is not None:
            raise ValueError(f"crossings: {back:g} degrees: must ascend")
        revolutions = round((edges[-1] - edges[0]) / 360.0)
        if revolutions < 1 or abs(edges[-1] - edges[0] - 360.0 * revolutions) > 1e-6:
            raise ValueError(
                f"crossings cover {edges[-1] - edges[0]:g} degrees: must cover whole revolutions"
            )
    edges = edges * DEGREE
    part = np.arange(LOBE) / LOBE
    width = np.diff(edges)[:, None]
    height = 2.0 * (areas - areas.mean())[:, None] / width
    angle = (edges[:-1, None] + width * part).reshape(-1)
    torque = mean + (height * np.sin(math.pi * part) ** 2).reshape(-1)
    slope = (height * math.pi / width * np.sin(2.0 * math.pi * part)).reshape(-1)
    return TorqueOverAngle(angle, torque, slope, revolutions * REVOLUTION)


def _of_file(given: TorqueDiagram, where: str, folder: Path) -> TorqueOverAngle:
    """Torque through the points of a laboratory's file, in its own units."""
    path = referred(folder, str(given.file), f"{where} file")
    recording = read_recording(path, f"{where} {given.file}")
    if ORDER in recording.columns:
        return _of_orders(given, where, recording)
    if given.mean is not None:
        raise SceneError(f"{where} mean: not allowed together with file, unless it has orders")
    angle = _column(recording, given.angle_column, "angle_column", 0)
    torque = _column(recording, given.torque_column, "torque_column", 1)
    unit = recording.columns[angle].unit or unit_of_name(angle, "") or "deg"
    size = angle_factor(unit, recording.where(angle)) * DEGREE
    return torque_over_angle(
        size * recording.numbers(angle), _newton_metres(recording, torque, given.torque_unit)
    )


def _of_orders(given: TorqueDiagram, where: str, recording: Recording) -> TorqueOverAngle:
    """Torque of a table of orders: sine and cosine, or A and psi of A cos(order phi + psi)."""
    if given.mean is None:
        raise SceneError(f"{where} mean: missing; must be a number in N m: the mean torque")
    for key in ("angle_column", "torque_column"):
        if getattr(given, key) is not None:
            raise SceneError(f"{where} {key}: not allowed together with a table of orders")
    orders = recording.numbers(ORDER)
    if len(orders) > MOST_ORDERS:
        raise SceneError(f"{recording.label}: {len(orders)} orders; at most {MOST_ORDERS}")

    def torque(name: str) -> Any:
        unit = given.torque_unit or recording.columns[name].unit or "N m"
        return _newton_metres(recording, name, unit)

    if {"sine", "cosine"} <= recording.columns.keys():
        sine, cosine = torque("sine"), torque("cosine")
    elif {"amplitude", "phase"} <= recording.columns.keys():
        stated = recording.columns["phase"].unit or "deg"
        phase = recording.numbers("phase") * DEGREE
        phase *= angle_factor(stated, recording.where("phase"))
        amplitude = torque("amplitude")
        sine, cosine = -amplitude * np.sin(phase), amplitude * np.cos(phase)
    else:
        listed = one_line(", ".join(recording.columns), 200)
        raise SceneError(
            f"{recording.label}: columns {listed}: orders need sine and cosine, or amplitude and "
            "phase"
        )
    columns = (orders.tolist(), sine.tolist(), cosine.tolist())
    rows = [Harmonic(order=o, sine=a, cosine=b) for o, a, b in zip(*columns, strict=True)]
    return harmonics_of(rows, given.mean)


def _column(recording: Recording, wanted: str | int | None, key: str, place: int) -> str:
    """Column of the angle or the torque: the one that is named, or that of two in its place."""
    if wanted is not None:
        return named_column(recording, wanted, key)
    names = list(recording.columns)
    if len(names) != 2:
        listed = one_line(", ".join(names), 200)
        raise SceneError(f"{recording.label}: columns {listed}: {key} must say which one")
    of_angle = [is_angle_unit(recording.columns[n].unit or unit_of_name(n, "")) for n in names]
    return names[place] if of_angle != [False, True] else names[1 - place]


def _newton_metres(recording: Recording, name: str, given: str | None) -> Any:
    """Values of a column of torque [N m]; its unit is given, stated, or at the end of its name."""
    text = given or recording.columns[name].unit
    if not text and "_" in name:
        text = name.rsplit("_", 1)[1]
    where = f"{recording.where(name)}, torque_unit"
    if not text:
        raise SceneError(f"{where}: missing; must be a unit such as 'N m' or 'kN m'")
    plain = text.strip().strip("[]()").strip()
    unit = _TORQUE_UNITS.get(plain.lower(), plain)
    try:
        return recording.numbers(name) * number_with_unit(f"1 {unit}", where, "N m")
    except SceneError as error:
        if "pint" in str(error):
            raise
        raise SceneError(f"{where} = {shown(text)}: must be a unit of torque, as 'kN m'") from None
