"""Fits of modelled cycles to what engines publish: power, largest pressure, fuel consumption.

A cycle is a frozen dataclass of `engine_dyn.pressure`; a fit returns it with one field changed, or
two that belong together. All SI. The catalogue (tools/calibrate_catalogue.py) and
`sweeps.lab.speed.calibration` share these functions. docs/method.md (134) to (138).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.geometry import slider_crank
from engine_dyn.loads.friction import friction_mean_effective_pressure, mean_piston_speed
from engine_dyn.pressure.compressor import CompressorCycle
from engine_dyn.pressure.first_law import FourStrokeCycle, TwoStrokeCycle, tabulate
from engine_dyn.units import BAR, RPM
from sweeps.base.errors import SceneError


class NotReached(ValueError):
    """A goal that no value of the free number reaches; `least` and `most` can be reached."""

    def __init__(self, least: float, most: float) -> None:
        super().__init__(f"between {least:g} and {most:g}")
        self.least, self.most = least, most


class Friction(NamedTuple):
    """Numbers of the friction mean effective pressure, SI; docs/method.md (30)."""

    constant: float
    peak_pressure: float
    piston_speed: float
    piston_speed_square: float
    mean_piston_speed: float
    auxiliaries: float = 0.0


def friction_of(values: Mapping[str, float], period: float) -> Friction:
    """Friction of an engine file's [values], at its own speed."""
    speed = values["speed"] * RPM
    volume = 0.25 * math.pi * values["bore"] ** 2 * values["stroke"] * values["cylinders"]
    return Friction(
        values["friction_constant"] * BAR,
        values["friction_peak_pressure"],
        values["friction_mean_piston_speed"] * BAR,
        values.get("friction_mean_piston_speed_square", 0.0) * BAR,
        mean_piston_speed(values["stroke"], speed),
        values.get("auxiliary_torque", 0.0) * period / volume,
    )


def indicated_mean_pressure(cycle: Any) -> float:
    """Indicated mean effective pressure of the whole cycle, gas exchange with it [Pa]."""
    angle, pressure = cycle.points()
    return _indicated(cycle, angle, pressure)


def _indicated(cycle: Any, angle: Any, pressure: Any) -> float:
    offset = cycle.offset_ratio
    speed = slider_crank.velocity(angle, cycle.crank_ratio, offset)
    work = 0.5 * cycle.period * float((pressure * speed).mean())
    if offset == 0.0:
        return work
    return work / float(slider_crank.dead_centres(cycle.crank_ratio, offset).stroke)


def brake_mean_pressure(cycle: Any, friction: Friction) -> float:
    """Brake mean effective pressure [Pa]: indicated less friction."""
    angle, pressure = cycle.points()
    lost = friction_mean_effective_pressure(
        friction.constant, friction.peak_pressure, friction.piston_speed, pressure.max(),
        friction.mean_piston_speed, friction.piston_speed_square,
    )  # fmt: skip
    return _indicated(cycle, angle, pressure) - float(lost) - friction.auxiliaries


def root(function: Callable[[float], float], low: float, high: float, **how: float) -> float:
    """Zero of a function by Brent's method; SceneError if scipy, which is optional, is missing."""
    try:
        from scipy.optimize import brentq
    except ImportError:
        raise SceneError(
            "calibrate needs the package scipy: pip install 'engine-dyn[lab]'"
        ) from None
    return float(brentq(function, low, high, **how))


def solved(
    make: Callable[[float], Any], friction: Friction, goal: float, low: float, high: float,
    tolerance: float,
) -> Any:  # fmt: skip
    """Cycle, made by a number between two, that has a brake mean effective pressure [Pa].

    NotReached has the mean pressures at both ends.
    """

    def miss(number: float) -> float:
        return brake_mean_pressure(make(number), friction) - goal

    ends = miss(low), miss(high)
    if not min(ends) <= 0.0 <= max(ends):
        raise NotReached(min(ends) + goal, max(ends) + goal)
    return make(root(miss, low, high, xtol=tolerance))


# --- the charge ----------------------------------------------------------------------------------


def trapped_mass(cycle: FourStrokeCycle) -> float:
    """Mass in the cylinder when it has closed, over the swept volume [kg/m3]; method.md (135)."""
    values = {item.name: getattr(cycle, item.name) for item in fields(cycle)}
    pressure = float(tabulate(FourStrokeCycle, values).trapped_pressure)
    volume = float(cycle.volume(cycle.intake_closing))
    # 287 J/(kg K) is the gas constant of air.
    return pressure * volume / (287.0 * cycle.charge_temperature)


def with_charge(
    cycle: FourStrokeCycle, intake: float, heat_of_charge: float, exhaust: float | None = None
) -> FourStrokeCycle:
    """Return the cycle with an intake pressure [Pa], and the heat of what it then traps.

    A kilogram of the charge releases `heat_of_charge` [J/kg]; `exhaust` is the exhaust pressure
    [Pa] where it follows the intake's.
    """
    empty = replace(
        cycle,
        intake_pressure=intake,
        exhaust_pressure=cycle.exhaust_pressure if exhaust is None else exhaust,
        heat=0.0,
    )
    return replace(empty, heat=heat_of_charge * trapped_mass(empty))


# --- the largest pressure ------------------------------------------------------------------------


def peak_by_start(fitted: Callable[[float], Any], peak: float, starts: Sequence[float]) -> Any:
    """Cycle with a largest pressure [Pa], by the start of its combustion.

    `fitted` gives the cycle with a start [rad], fitted to its power, or raises NotReached. Of the
    `starts` that are tried, ascending, two enclose the solution, which is as late as possible.

    Raises
    ------
    NotReached
        With the least and the largest peak that can be reached; with NaN where the power cannot be
        made with any start.
    """

    def peak_at(start: float) -> float:
        try:
            return float(fitted(start).points()[1].max())
        except NotReached:
            return math.nan

    peaks = np.array([peak_at(start) for start in starts])
    above = peaks >= peak
    for i in range(len(starts) - 1, 0, -1):
        if np.isfinite(peaks[i - 1 : i + 1]).all() and above[i] != above[i - 1]:
            start = root(lambda s: peak_at(s) - peak, starts[i - 1], starts[i], xtol=1e-7)
            return fitted(start)
    known = peaks[np.isfinite(peaks)]
    raise NotReached(*((known.min(), known.max()) if known.size else (math.nan, math.nan)))


# --- two-stroke engines and compressors ----------------------------------------------------------


def heated(cycle: TwoStrokeCycle, friction: Friction, goal: float, ratio: float) -> TwoStrokeCycle:
    """Return the cycle with a compression ratio and the heat that makes a mean pressure."""
    changed = replace(cycle, compression_ratio=ratio)

    def miss(heat: float) -> float:
        return brake_mean_pressure(replace(changed, heat=heat), friction) - goal

    return replace(changed, heat=root(miss, 0.5 * goal, 4.0 * goal, xtol=10.0))


def peak_of_two_stroke(
    cycle: TwoStrokeCycle, friction: Friction, goal: float, peak: float
) -> TwoStrokeCycle:
    """Return the cycle whose heat and compression ratio make a mean and a largest pressure."""

    def too_high(ratio: float) -> float:
        return float(heated(cycle, friction, goal, ratio).points()[1].max()) - peak

    return heated(cycle, friction, goal, root(too_high, 8.0, 30.0, xtol=1e-6))


def compressor_of_pressures(cycle: CompressorCycle, goal: float, peak: float) -> CompressorCycle:
    """Return the cycle whose clearance and delivery make a mean and a largest pressure [Pa]."""

    def with_clearance(changed: CompressorCycle) -> CompressorCycle:
        def miss(clearance: float) -> float:
            made = replace(changed, clearance_ratio=clearance)
            angle, pressure = made.points()
            work = float((pressure * slider_crank.velocity(angle, made.crank_ratio)).mean())
            return -math.pi * work - goal

        return replace(changed, clearance_ratio=root(miss, 0.01, 0.08, xtol=1e-9))

    def too_high(delivery: float) -> float:
        made = with_clearance(replace(cycle, delivery_pressure=delivery))
        return float(made.points()[1].max()) - peak

    outlet = root(too_high, 0.85 * peak, peak, xtol=1.0)
    return with_clearance(replace(cycle, delivery_pressure=outlet))
