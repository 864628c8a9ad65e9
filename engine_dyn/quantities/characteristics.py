"""Nodes of speed characteristics: see `engine_dyn.loads.characteristic`."""

from __future__ import annotations

from typing import Any

from engine_dyn.quantities.node import Node
from engine_dyn.units import RPM

__all__ = ["NODES", "PARAMETERS"]


def _parameter(name: str, symbol: str, unit: str, long_name: str, source: str, **more: Any) -> Node:
    return Node(name, symbol, unit, long_name, source, kind="parameter", **more)


PARAMETERS = (
    _parameter(
        "rated_power", "N_{max}", "W", "power of the speed characteristic at rated speed",
        "Power units, lecture 18", low=0.0,
    ),
    _parameter(
        "rated_speed", "n_{max}", "rpm", "rated speed of the speed characteristic",
        "Power units, lecture 18", low=0.0, si=RPM,
    ),
    _parameter(
        "characteristic_share", "s", "1", "share of the characteristic's torque", "this project",
        low=0.0, low_included=True, make=lambda: 1.0,
    ),
)  # fmt: skip

_RATED = ("characteristic", "speed", "rated_power", "rated_speed")

NODES = (
    Node(
        "characteristic_power", "N_e", "W", "power of the speed characteristic, all of it",
        "Power units, lecture 18", needs=_RATED,
        make=lambda characteristic, speed, rated_power, rated_speed: characteristic.power(
            speed, rated_power, rated_speed
        ),
    ),
    Node(
        "characteristic_torque", "M_e", "N m", "torque of the speed characteristic, all of it",
        "Power units, lecture 18", needs=_RATED,
        make=lambda characteristic, speed, rated_power, rated_speed: characteristic.torque(
            speed, rated_power, rated_speed
        ),
    ),
    Node(
        "characteristic_load", "L", "percent",
        "load whose diagram gives the share of the characteristic's torque", "this project",
        needs=("load",), make=lambda load: load,
    ),
)  # fmt: skip
