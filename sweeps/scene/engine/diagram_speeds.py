"""The key `speeds` of a [[diagram]]: from which to which speed it holds.

A diagram that was recorded, or fitted, at one speed is that of other speeds in part alone: valve
timing, combustion and throttling change. Outside, `plan` and `run` warn.
"""

from __future__ import annotations

from collections.abc import MutableMapping
from typing import Any

from engine_dyn.quantities.graph import PARAMETERS
from sweeps.base.checks import check_range, number
from sweeps.base.errors import SceneError, shown

SPEEDS = "speeds"

MEANING = "lowest and highest speed [rpm] for which the diagram holds; outside, plan and run warn"


def read_speeds(rest: MutableMapping[str, Any], where: str) -> tuple[float, float] | None:
    """Take the lowest and the highest speed [rpm] out of a [[diagram]]; None where it has none.

    Raises
    ------
    SceneError
        If it is no such pair, or given together with `speed`, which makes a grid over speed.
    """
    given = rest.pop(SPEEDS, None)
    if given is None:
        return None
    if not isinstance(given, list) or len(given) != 2:
        raise SceneError(
            f"{where} {SPEEDS} = {shown(given)}: must be a list of two numbers in rpm: the lowest "
            "and the highest speed for which the diagram holds"
        )
    if "speed" in rest:
        raise SceneError(
            f"{where}: has both speed, for a grid over speed, and {SPEEDS}: give one of them"
        )
    node = PARAMETERS["speed"]
    low, high = (
        number(value, f"{where} {SPEEDS} number {i}", node)
        for i, value in enumerate(given, start=1)
    )
    for i, value in enumerate((low, high), start=1):
        check_range(value, f"{where} {SPEEDS} number {i}", node)
    if low > high:
        raise SceneError(f"{where} {SPEEDS} = [{low:g}, {high:g}]: must ascend")
    return low, high
