"""Torque pulses on a disc at constant mean speed: the impacts of propeller blades on ice.

A pulse is half a sine, A sin(p t) with p = pi/duration. A mode with the root s answers it with

    int exp(s (t - u)) sin(p u) du = (p exp(s t) - p cos(p t) - s sin(p t))/(s^2 + p^2),

and afterwards with what the start and the end of the pulse leave behind, p exp(s t)/(s^2 + p^2)
each. So any sequence is exact at any time. Modes that swing count with their conjugates; those of
shafts with loss factors swing and decay with the same roots as in `modes.damped_modes`.

Rules for ships in ice (IACS UR I3, Machinery Requirements for Polar Class Ships; Finnish-Swedish
ice class rules) excite the shaft by such a sequence: half a sine for each blade while it turns
through the contact angle alpha_i, C_q Q_max sin(180 phi/alpha_i), blades 360/Z apart, C_q rising
linearly over the first turn and falling over the last one. That the impacts are half sines in a
sequence was compared with Batrak, Serdjuchenko and Tarasenko, Calculation of propulsion shafting
transient torsional vibration induced by ice impacts on the propeller blades. The numbers of the
rules, C_q, alpha_i, Q_max and the number of turns, were not found in print, and are to be given.
They also let the mean speed drop under the ice, which is left out here.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine_dyn.given_numbers import given_array
from engine_dyn.torsion.modes import checked_orders, modal_roots
from engine_dyn.torsion.system import ShaftSystem
from engine_dyn.types import Complexes, Floats

PERIODS, AT_ONCE = 24, 1 << 15
"""Samples in a period of the highest frequency, and how many are taken at once."""


class Pulses(NamedTuple):
    """A sequence of half sines."""

    start: Floats  # [s]; shape (n,)
    duration: Floats  # [s]
    torque: Floats  # Amplitude [N m]


def blade_impacts(
    speed: float, blades: int, torque: float, contact_angle: float, turns: float, *,
    ramp: float = 1.0, shift: float = 0.0,
) -> Pulses:  # fmt: skip
    """Impacts of all blades of a propeller during some turns.

    Parameters
    ----------
    speed : float
        Speed of the propeller [rad/s], above 0.
    blades : int
        Number of blades Z.
    torque : float
        Largest torque of one blade, C_q Q_max [N m]; below 0 where it brakes.
    contact_angle : float
        Angle alpha_i through which a blade turns in the ice [rad].
    turns : float
        Turns of the propeller in the ice.
    ramp : float
        Turns over which the torque rises at first and falls at last; an impact has the torque that
        belongs to its middle.
    shift : float
        Angle by which all impacts are late [rad]: a second block of ice is half a blade late.

    Examples
    --------
    >>> pulses = blade_impacts(10.0, 4, -1000.0, 0.5, 3.0)
    >>> print(pulses.start.size, pulses.torque[[0, 5, -1]].round(1), pulses.duration[0])
    12 [  -39.8 -1000.   -210.2] 0.05
    """
    for name, value in (
        ("speed", speed), ("blades", blades), ("contact_angle", contact_angle), ("turns", turns)
    ):  # fmt: skip
        if not 0.0 < value < np.inf:
            raise ValueError(f"{name} = {value}: must be above 0")
    angle = np.arange(int(np.ceil(turns * blades - 1e-9))) * 2.0 * np.pi / blades
    middle = (angle + 0.5 * contact_angle) / (2.0 * np.pi)
    part = np.minimum(middle, turns - middle) / ramp if ramp > 0.0 else np.ones(middle.size)
    return Pulses(
        (angle + shift) / speed, np.full(angle.size, contact_angle / speed),
        torque * np.clip(part, 0.0, 1.0),
    )  # fmt: skip


def pulse_response(
    system: ShaftSystem, disc: int, pulses: Pulses, *, until: float | None = None,
    steady: tuple[Any, Any, float] | None = None, angle: float = 0.0,
) -> dict[str, Any]:  # fmt: skip
    """Largest torque in each shaft during a sequence of pulses, from rest but for steady running.

    Parameters
    ----------
    system : ShaftSystem
        One design, without pendulums.
    disc : int
        Disc on which the pulses act, in the sense of its own rotation.
    pulses : Pulses
        They may overlap.
    until : float, optional
        End of what is looked at [s]; by default five periods of the lowest mode after the pulses.
    steady : tuple, optional
        Orders, harmonics (S, orders) of the torque in each shaft [N m], and speed of the crank
        [rad/s], of steady running, which the pulses come on top of.
    angle : float
        Angle of the crank at the time 0 [rad], for these.

    Returns
    -------
    dict
        "highest" and "lowest" torque in each shaft [N m], "largest", the greater size of both, and
        "time" of that [s]; shape (S,). Mean torques are not in them.
    """
    if system.shape:
        raise ValueError(f"system: designs of shape {system.shape}: must be one design")
    if disc not in range(system.node_of_disc.size):
        raise ValueError(f"disc = {disc}: must be from 0 to {system.node_of_disc.size - 1}")
    if system.speed_stiffness.any():
        raise ValueError("speed_stiffness: must be 0: the modes of pendulums follow the speed")
    start, duration, torque = (
        given_array(name, value, finite=True).reshape(-1)
        for name, value in zip(Pulses._fields, pulses, strict=True)
    )
    if not (duration > 0.0).all():
        raise ValueError("duration: must be above 0")
    roots, left, right = modal_roots(system, [disc], all_roots=True)
    twice = np.where(roots.imag > 0.1 * np.abs(roots), 2.0, 1.0)
    weight = twice[:, None] * left[:, 0, None] * right  # (roots, S)
    swinging = np.abs(roots)[(twice > 1.0) & (np.abs(weight) > 0.0).any(axis=-1)]
    fastest = max(swinging.max(initial=0.0), np.pi / duration.min())
    slowest = swinging.min(initial=fastest)
    if steady is not None:
        orders, harmonics = checked_orders(steady[0]), np.asarray(steady[1], dtype=complex)
        fastest = max(fastest, orders.max() * steady[2])
    end = float((start + duration).max() + 10.0 * np.pi / slowest) if until is None else until
    count = int(np.ceil(end * fastest * PERIODS / (2.0 * np.pi))) + 1
    times = np.linspace(0.0, end, count)
    response = _Response(roots, weight, start, duration, torque)
    extremes, place = np.zeros((2, weight.shape[-1])), np.zeros((2, weight.shape[-1]))
    for first in range(0, count, AT_ONCE):
        some = times[max(first - 2, 0) : first + AT_ONCE]
        values = response.at(some)
        if steady is not None:
            turning = np.exp(1j * orders * (steady[2] * some[:, None] + angle))
            values = values + (turning @ harmonics.T).real
        for side, sign in enumerate((1.0, -1.0)):
            top, when = _top(some, sign * values)
            better = top > extremes[side]
            extremes[side] = np.where(better, top, extremes[side])
            place[side] = np.where(better, when, place[side])
    highest, lowest = extremes[0], -extremes[1]
    return {
        "highest": highest, "lowest": lowest, "largest": extremes.max(axis=0),
        "time": np.where(extremes[0] >= extremes[1], *place),
    }  # fmt: skip


class _Response:
    """Torques in the shafts over time, after the starts and ends of all pulses in their order."""

    def __init__(
        self, roots: Complexes, weight: Complexes, start: Floats, duration: Floats, torque: Floats
    ) -> None:
        # A mode without damping may have the frequency of a pulse: it is moved by 3e-7.
        rates = np.pi / duration
        near = np.abs(roots**2 + rates[:, None] ** 2) < 1e-7 * rates[:, None] ** 2
        roots = np.where(near.any(axis=0), (1.0 + 3e-7) * roots, roots)
        self.roots, self.weight = roots, weight
        self.pulses = list(zip(start, duration, torque, strict=True))
        self.over = 1.0 / (roots**2 + rates[:, None] ** 2)
        left = torque[:, None] * rates[:, None] * self.over
        events = np.concatenate([start, start + duration])
        order = np.argsort(events, kind="stable")
        self.events, leaves = events[order], np.concatenate([left, left])[order]
        self.free = np.zeros((len(events) + 1, roots.size), dtype=complex)
        last = self.events[0]
        for i, (event, leave) in enumerate(zip(self.events, leaves, strict=True)):
            self.free[i + 1] = self.free[i] * np.exp(roots * (event - last)) + leave
            last = event

    def at(self, times: Floats) -> Floats:
        """Torques (times, S)."""
        place = np.searchsorted(self.events, times, side="right")
        since = times - self.events[np.maximum(place - 1, 0)]
        states = self.free[place] * np.exp(self.roots * since[:, None])
        for (start, duration, torque), over in zip(self.pulses, self.over, strict=True):
            within = (times >= start) & (times < start + duration)
            rate = np.pi / duration
            phase = rate * (times[within] - start)[:, None]
            forced = rate * np.cos(phase) + self.roots * np.sin(phase)
            states[within] -= torque * forced * over
        return np.asarray((states @ self.weight).real)


def _top(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Largest value along the first axis, by a parabola around the largest sample; its time."""
    place = values.argmax(axis=0)
    column = np.arange(values.shape[1])
    inner = np.clip(place, 1, len(times) - 2)
    before, most, after = (values[inner + i, column] for i in (-1, 0, 1))
    bend = before + after - 2.0 * most
    with np.errstate(divide="ignore", invalid="ignore"):
        moved = np.where((inner == place) & (bend < 0.0), 0.5 * (before - after) / bend, 0.0)
    top = np.where(inner == place, most - 0.25 * (before - after) * moved, values[place, column])
    return top, times[place] + moved * (times[1] - times[0])
