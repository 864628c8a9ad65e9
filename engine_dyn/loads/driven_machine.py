"""Driven machines and drivers: what acts on the crankshaft besides an engine, by its torque curves.

A load may depend on the crank angle or on the angle of its own shaft, theta = i phi + theta_0,
where the gear ratio i is the speed of that shaft over the crank's. At the crank its torque is i
times that at its own shaft, because the power is the same. The same holds for a load over the speed
of its own shaft. A load or a driver over speed has a shape, and the balance of the cycle finds the
factor on it (`load_coefficient`, `driver_factor`), as it finds k of a + k omega^alpha. A machine
whose mean torque is negative has a steady state where a driver's torque makes up for it.

Sources
-------
Load torque over angle and over speed: Kakaitsas (2015), section 3.1. Torque of an induction motor
over slip: Kloss's formula, as textbooks of electrical machines give it (his paper of 1908 was not
compared).
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.loads.laws import LAWS, Form, slip_torque
from engine_dyn.loads.torque_curves import (
    ALIKE,
    REVOLUTION,
    WHOLE,
    TorqueOverAngle,
    TorqueOverSpeed,
)


@dataclass(frozen=True, eq=False)
class DrivenMachine:
    """Loads and drivers of the crankshaft besides a + k omega^alpha; none unless given.

    Attributes
    ----------
    over_angle : TorqueOverAngle, optional
        Load that depends on an angle.
    load_over_speed : TorqueOverSpeed, optional
        Shape of the load over speed, in place of omega^alpha.
    driver_over_speed : TorqueOverSpeed, optional
        Shape of the driver's torque.
    motor : bool
        Whether the driver is an induction motor, see `motor_torque`. The motor's numbers are inputs
        of each design.
    load_law : str
        Law of the load over speed where there is neither table nor driver, one of
        `engine_dyn.loads.laws.LOAD_LAWS`; its numbers belong to designs.
    engine_torque : TorqueOverAngle, optional
        Torque of an engine that is given in place of its pressure, over the crank angle.
    auxiliaries : TorqueOverAngle, optional
        Torque of the engine's auxiliaries over the crank angle, whose period is the cycle; its mean
        is part of the friction.
    throw_torques : tuple of TorqueOverAngle
        Parts of the engine's torque on the throws along the shaft, where it has several.
    """

    over_angle: TorqueOverAngle | None = None
    load_over_speed: TorqueOverSpeed | None = None
    driver_over_speed: TorqueOverSpeed | None = None
    motor: bool = False
    load_law: str = "power_law"
    engine_torque: TorqueOverAngle | None = None
    auxiliaries: TorqueOverAngle | None = None
    throw_torques: tuple[TorqueOverAngle, ...] = ()

    @property
    def torques(self) -> tuple[TorqueOverAngle | None, ...]:
        """Torques over an angle: of the load, of the engine, and of its auxiliaries."""
        return self.over_angle, self.engine_torque, self.auxiliaries

    @property
    def over_angles(self) -> bool:
        """Whether any torque is over an angle."""
        return any(torque is not None for torque in self.torques)

    @property
    def over_speed(self) -> TorqueOverSpeed | None:
        """The table over speed, of the load or of the driver."""
        return self.load_over_speed or self.driver_over_speed

    @property
    def geared(self) -> bool:
        """Whether a load is over the angle or the speed of its own shaft."""
        of_angle, of_speed = self.over_angle, self.load_over_speed
        return bool((of_angle and of_angle.own_angle) or (of_speed and of_speed.own_speed))

    @property
    def has_driver(self) -> bool:
        """Whether something drives."""
        return self.motor or self.driver_over_speed is not None

    @property
    def law(self) -> str:
        """Name of the law over speed, see `engine_dyn.loads.laws.LAWS`."""
        if self.motor:
            return "motor"
        return self.load_law if self.over_speed is None else "table"

    @property
    def power_law(self) -> bool:
        """Whether the load over speed is a + k omega^alpha."""
        return self.law == "power_law"

    @property
    def plain(self) -> bool:
        """Whether there is nothing but a + k omega^alpha."""
        return self.power_law and not self.over_angles

    @cached_property
    def form(self) -> Form:
        """Form of the law over speed, as kernels take it."""
        curve, table = self.over_speed, np.zeros((3, 0))
        if curve is not None:
            table = np.stack([curve.speed, curve.torque, curve.slope])
        kind, sign = [law.name for law in LAWS].index(self.law), -1.0 if self.has_driver else 1.0
        return Form(kind, sign, curve is not None and curve.own_speed, table)


NOTHING_DRIVEN = DrivenMachine()


def constant_load(
    load_offset: Any, over_angle: TorqueOverAngle, gear_ratio: Any, load_scale: Any
) -> Any:
    """Mean over the cycle of the load torque at the crank that does not depend on the speed [N m].

    docs/method.md (42). `gear_ratio` is 1 for a load over the crank angle.
    """
    return load_offset + load_scale * gear_ratio * over_angle.mean


def load_over_angle(
    crank_angle: Any, over_angle: TorqueOverAngle, gear_ratio: Any, load_phase: Any, load_scale: Any
) -> Any:
    """Load torque at the crank at crank angles [N m], docs/method.md (42); see `constant_load`."""
    return load_scale * gear_ratio * over_angle(gear_ratio * crank_angle + load_phase)


def harmonics_of_load(
    over_angle: TorqueOverAngle, orders: Any, cycle: float, gear_ratio: Any = 1.0,
    load_phase: Any = 0.0,
) -> Any:  # fmt: skip
    """Harmonics C of T(i phi + theta_0) = mean + sum of Re C_nu exp(i nu phi), at the load's shaft.

    Order nu of the crank is harmonic nu period/(2 pi i) of the torque; where that is not whole,
    there is nothing. Arguments as of `load_over_angle`, `cycle` that of the engine [rad], which a
    load over its own angle repeats with; all broadcast with `orders`.

    Examples
    --------
    >>> from engine_dyn.loads.torque_curves import torque_of_harmonics
    >>> pump = torque_of_harmonics(30.0, {2: (10.0, 0.0)}, own_angle=True)
    >>> abs(harmonics_of_load(pump, np.array([0.5, 1.0]), 4.0 * np.pi, 0.5)).round(9)
    array([ 0., 10.])
    """
    turns = round(over_angle.period / REVOLUTION)
    # Harmonics follow from 8192 samples of a revolution.
    samples = 8192 * turns
    curve = over_angle(np.arange(samples) * (over_angle.period / samples))
    of_torque = np.fft.rfft(curve) * (2.0 / samples)
    harmonic = np.asarray(orders) * turns / whole_ratio(over_angle, gear_ratio, cycle)
    whole = np.rint(harmonic)
    there = (np.abs(harmonic - whole) < ALIKE * np.maximum(whole, 1.0)) & (whole < of_torque.size)
    harmonics = np.where(there, of_torque[np.where(there, whole, 0.0).astype(np.int64)], 0.0)
    return harmonics * np.exp(1j * whole * np.asarray(load_phase) / turns)


def motor_torque(
    omega: Any, synchronous_speed: Any, breakdown_slip: Any, breakdown_torque: Any = 1.0
) -> Any:
    """Torque of an induction motor [N m], Kloss: M/M_b = 2/(s/s_b + s_b/s), s = 1 - omega/omega_s.

    docs/method.md (46). Speeds are those of the crank [rad/s]; above the synchronous speed the
    machine brakes.
    """
    return breakdown_torque * slip_torque(omega, synchronous_speed, breakdown_slip)[0]


def synchronous_speed(speed: Any, motor_slip: Any, motor_gear_ratio: Any = 1.0) -> Any:
    """Synchronous speed of a motor [rad/s], at its own shaft, whose slip at nominal speed is given.

    docs/method.md (46). `motor_gear_ratio` is the speed of that shaft over the crank's; `speed` is
    the crank's.
    """
    return motor_gear_ratio * (speed / (1.0 - motor_slip))


def whole_ratio(over_angle: TorqueOverAngle | None, gear_ratio: npt.ArrayLike, cycle: float) -> Any:
    """Gear ratios with which the load repeats exactly with the cycle: 0.333333 becomes a third."""
    if over_angle is None or not over_angle.own_angle:
        return np.asarray(gear_ratio, dtype=float)
    repeats = repeats_of(over_angle, gear_ratio, cycle)
    return repeats * (over_angle.period / (cycle * over_angle.repeats))


def cycles_of(over_angle: TorqueOverAngle | None, cycle: float) -> int:
    """After how many cycles [rad] of the engine a load repeats together with it: 1 as a rule.

    More for a load over the crank angle whose period is no part of the cycle.
    """
    if over_angle is None or over_angle.own_angle:
        return 1
    return _repeats_over_crank(over_angle, cycle).denominator


def _repeats_over_crank(over_angle: TorqueOverAngle, cycle: float) -> Fraction:
    """Exact number of repetitions of a load over the crank angle within a cycle [rad]."""
    turns = (round(angle / REVOLUTION) for angle in (cycle, over_angle.period))
    return over_angle.repeats * Fraction(*turns)


def repeats_of(over_angle: TorqueOverAngle, gear_ratio: npt.ArrayLike, cycle: float) -> Any:
    """How often a load repeats within the cycle [rad], for gear ratios of the load's own angle.

    Over the crank angle, how often it repeats within `cycles_of` cycles.

    Raises
    ------
    ValueError
        For a ratio with which the load does not repeat with the cycle.
    """
    if not over_angle.own_angle:
        return np.asarray(_repeats_over_crank(over_angle, cycle).numerator)
    ratio = np.asarray(gear_ratio, dtype=float)
    turns = ratio * cycle / over_angle.period * over_angle.repeats
    whole = np.round(turns)
    bad = (np.abs(turns - whole) > WHOLE * np.maximum(turns, 1.0)) | (whole < 1.0)
    if bad.any():
        step = over_angle.period / cycle / over_angle.repeats
        raise ValueError(
            f"gear_ratio = {float(ratio[bad].flat[0]):g}: must be a multiple of {step:g}, so that "
            "the load repeats with the cycle"
        )
    return whole.astype(np.int64)
