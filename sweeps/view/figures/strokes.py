"""Strokes of the cylinders over the crank angle, in firing order.

A cylinder's own angle counts from its firing dead centre: the power stroke follows it, the
compression precedes it. The strokes end at the dead centres; when valves and ports open is not in
an archive.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from engine_dyn.types import Floats
from sweeps.view.figures.arrangement import arrangements_of, called, firing_notes
from sweeps.view.figures.scales import crank_axis
from sweeps.view.figures.sheet import GREY, NamedFigures, finish, new_sheet
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import View

TURN = 180.0
"""Degrees of a stroke."""

Look = dict[str, Any]

POWER: Look = {"facecolor": "#e8b08f", "edgecolor": "black"}
COMPRESSION: Look = {"facecolor": "#c9d6e8", "edgecolor": "black"}
EXCHANGE: Look = {"facecolor": "white", "edgecolor": "black"}
MISSING: Look = {"facecolor": "white", "edgecolor": "#999999", "hatch": "////"}

FOUR = (("power", POWER), ("exhaust", EXCHANGE), ("intake", EXCHANGE), ("compression", COMPRESSION))
TWO = (("expansion, gas exchange", POWER), ("gas exchange, compression", COMPRESSION))
DRIVEN = (("expansion, suction", EXCHANGE), ("compression, delivery", COMPRESSION))
"""Strokes from a cylinder's firing dead centre on; of a compressor, from its top dead centre."""


def has_strokes(one: Mapping[str, Any]) -> bool:
    """Whether two cylinders or more fire in a known cycle."""
    return len(one.get("firing_angles", ())) > 1 and one.get("period") in (360.0, 720.0)


def strokes(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the strokes of all cylinders, the first to fire above; a figure for each engine."""
    view = study.view
    for suffix, one in arrangements_of(view, has_strokes).items():
        firing = np.asarray(one["firing_angles"], dtype=float)
        order = np.argsort(firing, kind="stable")
        figure, (panel,) = new_sheet(1, 1, 0.7 + 0.26 * firing.size)
        angle, low, zero = _range(view, one["period"])
        panel.set_xlim(low, low + one["period"])
        for row, cylinder in enumerate(order):
            fires = one["pressure_factor"][cylinder] != 0.0
            _bars(panel, row, firing[cylinder] - zero, low, _strokes_of(view, one), fires)
        panel.set_ylim(firing.size - 0.45, -0.55)
        panel.set_yticks(range(firing.size), [f"cylinder {i + 1}" for i in order])
        panel.tick_params("y", left=False)
        panel.grid(False)
        crank_axis(panel, angle, 5.6)
        title = f"Strokes of the cylinders, {called(one)}"
        yield f"strokes{suffix}", finish(figure, title, firing_notes(one))


def _strokes_of(view: View, one: Mapping[str, Any]) -> Sequence[tuple[str, Look]]:
    """Names of the strokes from firing dead centre on."""
    if one["period"] == 720.0:
        return FOUR
    given = json.loads(view.data.attrs.get("parameters", "{}"))
    return DRIVEN if "motor_breakdown_torque" in given else TWO


def _range(view: View, period: float) -> tuple[xr.Variable, float, float]:
    """Crank angle with its attributes, where it begins, and where its zero is after firing."""
    angle = view.data.variables.get("crank_angle")
    if angle is None:
        said = {"long_name": "crank angle", "symbol": r"$\varphi$", "units": "degree"}
        return xr.Variable((), 0.0, said), -0.5 * period, 0.0
    values: Floats = np.asarray(angle.values, dtype=float)
    return angle, float(values[0]), float(angle.attrs.get("zero_at", 0.0))


def _bars(
    panel: Any, row: int, firing: float, low: float, named: Sequence[tuple[str, Look]], fires: bool
) -> None:
    """Draw one cylinder's strokes; those that the ends of the axis cut are in two parts."""
    period = TURN * len(named)
    for number, (text, look) in enumerate(named):
        if number == 0 and not fires:
            text, look = "no firing", MISSING
        start = (firing + TURN * number - low) % period + low
        parts = [(start, min(start + TURN, low + period))]
        if start + TURN > low + period + 1e-6:
            parts.append((low, start + TURN - period))
        for begin, end in parts:
            panel.barh(row, end - begin, left=begin, height=0.7, linewidth=0.7, **look)
        begin, end = max(parts, key=lambda part: part[1] - part[0])
        if end - begin > 0.09 * period:
            panel.text(
                0.5 * (begin + end), row, text, ha="center", va="center", fontsize=6.5,
                color=GREY if look is MISSING else "black",
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8}
                if look is MISSING else None,
            )  # fmt: skip
        if number == 0 and fires and named is not DRIVEN:
            panel.plot([start], [row - 0.35], marker="v", markersize=4.5, color="#8c2d04",
                       clip_on=False, zorder=6)  # fmt: skip
