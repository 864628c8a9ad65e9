"""Friction of the engine as a mean effective pressure and as a constant torque."""

from __future__ import annotations

from typing import Any

__all__ = ["friction_mean_effective_pressure", "friction_torque", "mean_piston_speed"]


def mean_piston_speed(stroke: Any, speed: Any) -> Any:
    """Mean piston speed [m/s] from stroke [m] and crank speed [rad/s]: s n/30."""
    return stroke * speed / 3.141592653589793


def friction_mean_effective_pressure(
    constant: Any, peak_pressure_share: Any, piston_speed_share: Any, peak_pressure: Any, speed: Any
) -> Any:
    """Friction mean effective pressure [Pa]: a + b p_max + c c_m.

    Kakaitsas (2015), eq. 3.9, the form of Chen and Flynn (SAE 650733). `constant` [Pa],
    `peak_pressure_share` [1], `piston_speed_share` [Pa s/m], `peak_pressure` absolute [Pa],
    `speed` the mean piston speed [m/s].
    """
    return constant + peak_pressure_share * peak_pressure + piston_speed_share * speed


def friction_torque(friction_pressure: Any, displacement: Any, period: Any) -> Any:
    """Mean friction torque [N m], positive, to be subtracted: fmep V_h/Phi. Kakaitsas, eq. 3.8.

    `displacement` is the whole engine's [m3]; `period` the cycle's angle Phi (4 pi four-stroke).
    """
    return friction_pressure * displacement / period
