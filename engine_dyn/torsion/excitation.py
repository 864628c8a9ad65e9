r"""Torques that act on a shaft besides the engine's: propellers, gear meshes, machines beside it.

An excitation is a torque on a disc over the disc's own angle theta = |i| phi + theta_0, positive in
the sense in which the disc turns,

    T = (omega/omega_r)^p (a_0 + sum of Re C_nu exp(i nu theta)),

with a_0 and C_nu by straight lines between the speeds of a table, where there is one. If each
nu |i| is an order of the engine's cycle, the excitation keeps step with the engine and adds to the
engine's orders, with its phase. If not, as that of the blades of a geared propeller, it drifts
against the engine: at some time the extremes of both meet, so the extremes of the sum are the sums
of the extremes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from engine_dyn.loads.driven_machine import harmonics_of_load
from engine_dyn.loads.torque_curves import (
    HIGHEST_ORDER,
    REVOLUTION,
    WHOLE,
    TorqueOverAngle,
    highest_order,
)
from engine_dyn.torsion.system import ShaftSystem
from engine_dyn.types import Booleans, Floats

SMALL = 1e-6  # Part of the largest harmonic below which an order of an excitation does not count


@dataclass(frozen=True, eq=False)
class Excitation:
    """A torque on a disc over the disc's own angle, positive in the sense in which it turns.

    Examples
    --------
    >>> from engine_dyn.loads.torque_curves import torque_of_harmonics
    >>> propeller = Excitation("propeller", 2, (torque_of_harmonics(-1e3, {4: (0.0, 50.0)}),),
    ...                        power=2.0, reference_speed=10.0)
    >>> print(propeller.mean(20.0), propeller.orders)
    -4000.0 [4.]
    """

    name: str
    disc: int  # Number of the disc, from 0
    # The torque; of a table one for each of `speeds`, those of the crank [rad/s], ascending.
    torques: tuple[TorqueOverAngle, ...]
    speeds: Floats = field(default_factory=lambda: np.empty(0))
    power: float = 0.0  # p
    reference_speed: float = 1.0  # omega_r, of the crank [rad/s]
    phase: float = 0.0  # theta_0: own angle at firing dead centre of cylinder 1 [rad]

    @property
    def highest_order(self) -> float:
        """Highest order, of the disc's own turns, with a hundredth of the largest amplitude."""
        return max(highest_order(torque) for torque in self.torques)

    @property
    def period(self) -> float:
        """Own angle after which the torque repeats, whole revolutions [rad]."""
        turns = (round(torque.period / REVOLUTION) for torque in self.torques)
        return math.lcm(*turns) * REVOLUTION

    @cached_property
    def _series(self) -> tuple[Floats, Any]:
        """Orders of the disc's own turns that count, and C_nu of each torque [N m]."""
        turns = round(self.period / REVOLUTION)
        orders = np.arange(1, round(HIGHEST_ORDER * turns) + 1) / turns
        each = np.array([harmonics_of_load(t, orders, self.period) for t in self.torques])
        size = np.abs(each).max(axis=0)
        counting = size > SMALL * size.max(initial=0.0)
        return orders[counting], each[:, counting]

    @property
    def within(self) -> float:
        """Return a speed of the crank at which the torque is known [rad/s]."""
        return float(self.speeds[0]) if self.speeds.size else self.reference_speed

    @property
    def orders(self) -> Floats:
        """Orders of the disc's own turns."""
        return self._series[0]

    def in_step(self, ratio: Any, cycle: float) -> Booleans:
        """Whether it repeats with a cycle [rad] of the crank, for the disc's speed ratio i."""
        times = np.abs(np.asarray(ratio, dtype=float))[..., None] * self.orders * cycle / REVOLUTION
        return np.asarray(
            (np.abs(times - np.rint(times)) <= WHOLE * np.maximum(times, 1.0)).all(axis=-1)
        )

    def mean(self, speed: Any) -> Any:
        """Mean torque on the disc, in its sense of rotation [N m]; NaN beyond a table's speeds."""
        means = np.array([[torque.mean] for torque in self.torques])
        return self._at(means, speed)[..., 0]

    def own_harmonics(self, speed: Any) -> Any:
        """C_nu of `orders`, over the angle from firing dead centre [N m]; shape (..., orders)."""
        return self._at(self._series[1] * np.exp(1j * self.orders * self.phase), speed)

    def harmonics(self, orders: Floats, speed: Any, ratio: Any) -> Any:
        """Harmonics at `orders` of the crank of an excitation that is in step, (..., orders).

        `orders` are all multiples of the first, and reach up to those that count.
        """
        own, size = self.own_harmonics(speed), np.abs(np.asarray(ratio, dtype=float))
        place = np.rint(size[..., None] * self.orders / orders[0]).astype(np.int64) - 1
        own, place = np.broadcast_arrays(own, place)
        # What lies beyond the orders goes to one more place, which is left out.
        place = np.where((place >= 0) & (place < orders.size), place, orders.size)
        found = np.zeros((*own.shape[:-1], orders.size + 1), dtype=np.complex128)
        np.put_along_axis(found, place, own, axis=-1)
        return found[..., :-1]

    def _at(self, table: Any, speed: Any) -> Any:
        """Values of the torques, shape (speeds, values), at speeds of the crank (..., values)."""
        omega = np.asarray(speed, dtype=float)
        scale = ((omega / self.reference_speed) ** self.power)[..., None]
        if not self.speeds.size:
            return scale * table[0]
        before = np.clip(np.searchsorted(self.speeds, omega) - 1, 0, self.speeds.size - 2)
        low, high = self.speeds[before], self.speeds[before + 1]
        part = ((omega - low) / (high - low))[..., None]
        # Speeds are in rad/s, and those of the table were in rpm
        known = (part >= -WHOLE) & (part <= 1.0 + WHOLE)
        between = (1.0 - part) * table[before] + part * table[before + 1]
        return scale * np.where(known, between, np.nan)


def add_drifting(
    response: Mapping[str, Any], system: ShaftSystem, excitation: Excitation, factor: Any,
    speed: Any, ratio: Any, **asked: Any,
) -> dict[str, Any]:  # fmt: skip
    """Response to an engine's torques and to an excitation that drifts against them.

    Extremes and losses add up; harmonics are those of the engine's orders alone.

    Parameters
    ----------
    response : mapping
        Of `forced_response`, to all else.
    system : ShaftSystem
        The shafts.
    excitation : Excitation
        What drifts.
    factor : array_like
        On its torque, 0 of designs in which it does not drift.
    speed, ratio : array_like
        Of the crank [rad/s]; of the disc over the crank's.
    **asked
        `twist`, `speed_of` and `threads` of `forced_response`.

    Returns
    -------
    dict
        As `response`.
    """
    from engine_dyn.torsion.forced import forced_response  # kernels, which few scenes need here

    size = np.abs(np.asarray(ratio, dtype=float))
    # The orders are those of the disc, to whose turns the stiffness of pendulums is referred, too.
    turned = replace(system, speed_stiffness=system.speed_stiffness / np.square(size)[..., None])
    torque = np.asarray(np.sign(ratio) * factor)[..., None] * excitation.own_harmonics(speed)
    wanted = [name for name in response if name.endswith(("_extremes", "_loss"))]
    more = forced_response(
        turned, excitation.orders, speed * size, [excitation.disc], torque[..., None, :],
        wanted=wanted, period=excitation.period, **asked,
    )  # fmt: skip
    if "speed_extremes" in more:
        more["speed_extremes"] = more["speed_extremes"] * size[..., None, None]
    total = {name: response[name] + more[name] for name in wanted}
    return {**response, **total, "status": np.maximum(response["status"], more["status"])}
