"""Nodes of the kinematic series: see `engine_dyn.geometry.kinematic_series`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from engine_dyn.geometry import kinematic_series
from engine_dyn.quantities.node import Node

MOSAKOWSKI = "Mosakowski"
NOTES = "Rakopoulos notes"


def _centred(offset_ratio: Any, what: str) -> None:
    if np.any(offset_ratio):
        raise ValueError(
            f"{what} is that of a centred mechanism; pin_offset and crank_offset must add up to 0"
        )


def _coefficients(function: Callable[..., Any], what: str) -> Callable[..., Any]:
    def make(order: Any, crank_ratio: Any, offset_ratio: Any) -> Any:
        _centred(offset_ratio, what)
        return function(order, crank_ratio)

    return make


def _mean_position(crank_ratio: Any, offset_ratio: Any) -> Any:
    _centred(offset_ratio, "position_mean")
    return kinematic_series.mean_position(crank_ratio)


def _truncated(function: Callable[..., Any], what: str) -> Callable[..., Any]:
    def make(crank_angle: Any, crank_ratio: Any, truncation: Any, offset_ratio: Any) -> Any:
        _centred(offset_ratio, what)
        return function(crank_angle, crank_ratio, truncation)

    return make


def _truncation_error(derivative: int, what: str) -> Callable[..., Any]:
    def make(crank_ratio: Any, truncation: Any, offset_ratio: Any) -> Any:
        _centred(offset_ratio, what)
        return kinematic_series.truncation_error(crank_ratio, truncation, derivative)

    return make


NODES: tuple[Node, ...] = (
    Node(
        "position_coefficient", r"a_\nu", "1",
        "coefficients of cos(nu phi) in the reduced piston travel",
        f"{MOSAKOWSKI} eq. 7 (A = -a), {NOTES}",
        make=_coefficients(kinematic_series.position_coefficients, "position_coefficient"),
    ),
    Node(
        "velocity_coefficient", r"\gamma_\nu", "1",
        "coefficients of sin(nu phi) in the reduced piston velocity",
        f"{MOSAKOWSKI} eq. 5, {NOTES}",
        make=_coefficients(kinematic_series.velocity_coefficients, "velocity_coefficient"),
    ),
    Node(
        "acceleration_coefficient", r"\beta_\nu", "1",
        "coefficients of cos(nu phi) in the reduced piston acceleration",
        f"{MOSAKOWSKI} eq. 6, {NOTES}",
        make=_coefficients(kinematic_series.acceleration_coefficients, "acceleration_coefficient"),
    ),
    Node(
        "inertia_torque_coefficient", r"\Delta T_\nu", "1",
        "coefficients of sin(nu phi) in the reduced inertia torque, over m r^2 omega^2, one "
        "cylinder", f"{NOTES}, Delta T_l", make=_coefficients(
            kinematic_series.inertia_torque_coefficients, "inertia_torque_coefficient"
        ),
    ),
    Node(
        "position_mean", "a_0", "1", "mean of the reduced piston travel over a turn",
        f"{NOTES}, a0", make=_mean_position,
    ),
    Node(
        "position_truncated", r"\tilde x/r", "1", "reduced piston travel by the truncated series",
        f"{MOSAKOWSKI} eqs. 9, 17", kind="curve",
        make=_truncated(kinematic_series.truncated_position, "position_truncated"),
    ),
    Node(
        "velocity_truncated", r"\tilde c/(r\omega)", "1",
        "reduced piston velocity by the truncated series", f"{MOSAKOWSKI} eqs. 12, 17",
        kind="curve", make=_truncated(kinematic_series.truncated_velocity, "velocity_truncated"),
    ),
    Node(
        "acceleration_truncated", r"\tilde b/(r\omega^2)", "1",
        "reduced piston acceleration by the truncated series", f"{MOSAKOWSKI} eqs. 13, 18",
        kind="curve",
        make=_truncated(kinematic_series.truncated_acceleration, "acceleration_truncated"),
    ),
    Node(
        "position_truncation_error", r"\Delta x/s", "1",
        "truncation error of the travel, largest error over the stroke",
        f"after {MOSAKOWSKI} eq. 16", make=_truncation_error(0, "position_truncation_error"),
    ),
    Node(
        "velocity_truncation_error", r"\Delta c/c_{max}", "1",
        "truncation error of the velocity, largest error over largest velocity",
        f"after {MOSAKOWSKI} eq. 16", make=_truncation_error(1, "velocity_truncation_error"),
    ),
    Node(
        "acceleration_truncation_error", r"\Delta b/b_{max}", "1",
        "truncation error of the acceleration, largest error over largest acceleration",
        f"{MOSAKOWSKI} eq. 16", make=_truncation_error(2, "acceleration_truncation_error"),
    ),
)  # fmt: skip
