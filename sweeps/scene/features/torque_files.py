"""The engine's torque over the crank angle from a file of a laboratory, in any of its units."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from engine_dyn.loads.torque_curves import (
    MOST_ORDERS,
    TorqueOverAngle,
    torque_of_harmonics,
    torque_over_angle,
)
from engine_dyn.units import DEGREE
from sweeps.base.checks import mentioned
from sweeps.base.columns.recorded_columns import Recording, named_column
from sweeps.base.columns.recording import read_recording
from sweeps.base.columns.units import angle_factor, is_angle_unit, unit_of_name
from sweeps.base.errors import SceneError, one_line, shown
from sweeps.base.files.numbers_with_units import number_with_unit

ORDER = "order"  # Name of the column that marks a table of orders

SPEED = "speed"  # Name of the column of the crank's speed in such a table [rpm]


def torque_of_file(
    path: Path, label: str, angle_column: str | int | None, torque_column: str | int | None,
    torque_unit: str | None, mean: float | None,
) -> TorqueOverAngle:  # fmt: skip
    """Torque through the points of a laboratory's file, or of the orders in it, in its own units.

    A file of more than two columns needs `angle_column` and `torque_column`, their names or
    numbers, and one that does not state it `torque_unit`. A table of orders needs the `mean` torque
    [N m]; points have their own.
    """
    recording = read_recording(path, label)
    if ORDER in recording.columns:
        if angle_column is not None or torque_column is not None:
            raise SceneError(
                f"{label}: angle_column, torque_column: not allowed with a table of orders"
            )
        if mean is None:
            raise SceneError(f"{label}: mean: missing; must be a number in N m: the mean torque")
        return _of_orders(recording, torque_unit, mean)
    if mean is not None:
        raise SceneError(f"{label}: mean: not allowed together with points, which have their own")
    angle, torque = _columns(recording, angle_column, torque_column)
    unit = recording.columns[angle].unit or unit_of_name(angle, "") or "deg"
    size = angle_factor(unit, recording.where(angle)) * DEGREE
    radians = size * recording.numbers(angle)
    values = _newton_metres(recording, torque, torque_unit)
    try:
        return torque_over_angle(radians, values)
    except ValueError as error:
        raise SceneError(f"{recording.where(angle)}, in {unit}: {mentioned(error)}") from None


def torques_of_file(
    path: Path, label: str, torque_unit: str | None, mean: float
) -> tuple[list[float], list[TorqueOverAngle]] | None:
    """Speeds [rpm] and torques of a table of orders; None of a file without orders.

    A table of one speed, or without a column of it, has no speeds and one torque.
    """
    recording = read_recording(path, label)
    if ORDER not in recording.columns:
        return None
    if SPEED not in recording.columns:
        return [], [_of_orders(recording, torque_unit, mean)]
    unit = recording.columns[SPEED].unit
    if unit not in ("", None, "rpm", "1/min", "min-1"):
        raise SceneError(f"{recording.where(SPEED)}, in {unit}: must be in rpm")
    of_rows = recording.numbers(SPEED)
    speeds = np.unique(of_rows).tolist()
    torques = [_of_orders(recording, torque_unit, mean, of_rows == speed) for speed in speeds]
    return speeds if len(speeds) > 1 else [], torques


def _of_orders(
    recording: Recording, torque_unit: str | None, mean: float, rows: Any = slice(None)
) -> TorqueOverAngle:
    """Torque of a table of orders: sine and cosine, or A and psi of A cos(order phi + psi)."""
    orders, columns = recording.numbers(ORDER)[rows].tolist(), recording.columns

    def torque(name: str) -> Any:
        unit = torque_unit or columns[name].unit or "N m"
        return _newton_metres(recording, name, unit)[rows]

    if {"sine", "cosine"} <= columns.keys():
        sine, cosine = torque("sine"), torque("cosine")
    elif {"amplitude", "phase"} <= columns.keys():
        unit = columns["phase"].unit or "deg"
        size = angle_factor(unit, recording.where("phase")) * DEGREE
        phase, amplitude = size * recording.numbers("phase")[rows], torque("amplitude")
        sine, cosine = -amplitude * np.sin(phase), amplitude * np.cos(phase)
    else:
        listed = one_line(", ".join(columns), 200)
        raise SceneError(
            f"{recording.label}: columns {listed}: orders need sine and cosine, or amplitude and "
            "phase"
        )
    if len(orders) > MOST_ORDERS or len(set(orders)) < len(orders):
        raise SceneError(
            f"{recording.label}: {len(orders)} orders, {len(set(orders))} of them different: must "
            f"be at most {MOST_ORDERS}, each once; --select takes the orders of one design"
        )
    pairs = zip(sine.tolist(), cosine.tolist(), strict=True)
    try:
        return torque_of_harmonics(mean, dict(zip(orders, pairs, strict=True)))
    except ValueError as error:
        raise SceneError(f"{recording.label}: {mentioned(error)}") from None


def _columns(
    recording: Recording, angle: str | int | None, torque: str | int | None
) -> tuple[str, str]:
    """Columns of angle and torque: as named, the other one of two, or by their units."""
    names = list(recording.columns)
    if len(names) != 2 and (angle is None or torque is None):
        listed = one_line(", ".join(names), 200)
        key = "angle_column" if angle is None else "torque_column"
        raise SceneError(f"{recording.label}: columns {listed}: {key} must say which one")
    of_angle = None if angle is None else named_column(recording, angle, "angle_column")
    of_torque = None if torque is None else named_column(recording, torque, "torque_column")
    if of_angle is not None and of_angle == of_torque:
        raise SceneError(f"{recording.where(of_angle)}: must not be both angle and torque")
    if of_angle is None and of_torque is None:
        turned = [is_angle_unit(recording.columns[n].unit or unit_of_name(n, "")) for n in names]
        return (names[1], names[0]) if turned == [False, True] else (names[0], names[1])
    return (
        of_angle or next(name for name in names if name != of_torque),
        of_torque or next(name for name in names if name != of_angle),
    )


def _newton_metres(recording: Recording, name: str, given: str | None) -> Any:
    """Values of a column of torque [N m]; its unit is given, stated, or at the end of its name."""
    text = given or recording.columns[name].unit
    if not text and "_" in name:
        text = name.rsplit("_", 1)[1]
    where = f"{recording.where(name)}, torque_unit"
    if not text:
        raise SceneError(f"{where}: missing; must be a unit such as 'N m' or 'kN m'")
    plain = text.strip().strip("[]()").strip()
    # Spellings of units of torque, in lower case, that are no units as they stand.
    spelled = {
        "nm": "N m", "n*m": "N m", "knm": "kN m", "kn*m": "kN m", "lbft": "lbf ft",
        "lb-ft": "lbf ft", "lb ft": "lbf ft", "ft-lb": "lbf ft", "kgm": "kgf m", "kgfm": "kgf m",
        "danm": "daN m", "nmm": "N mm", "lbin": "lbf in", "lbfft": "lbf ft", "lbfin": "lbf in",
    }  # fmt: skip
    unit = spelled.get(plain.lower(), plain)
    values = recording.numbers(name)
    try:
        return values * number_with_unit(f"1 {unit}", where, "N m")
    except SceneError:
        raise SceneError(f"{where} = {shown(text)}: must be a unit of torque, as 'kN m'") from None
