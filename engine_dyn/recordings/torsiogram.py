"""Orders of the vibration of a disc from its recorded speed: what a torsiograph shows.

The angle of a disc is phi + theta, with the steady rotation phi of the crank and
theta = sum of a cos(nu phi + psi). Over some cycles phi is a parabola of the time, so that a slow
run-up may be recorded too; parabola and orders are fitted together by least squares.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from engine_dyn.types import Floats

TURN = 2.0 * np.pi


class Torsiogram(NamedTuple):
    """Orders of the angle of a disc at each speed; shapes (speeds,), (speeds, orders)."""

    speed: Floats  # Mean speed [rad/s]
    amplitude: Floats  # [rad]
    phase: Floats  # psi [rad]; NaN where the dead centre is not known


def torsiogram(
    time: Floats, speed: Floats, orders: Floats, *, period: float = 2.0 * TURN, cycles: int = 8,
    dead_centre: float | None = None,
) -> Torsiogram:  # fmt: skip
    """Orders of the angle of a disc that turns as fast as the crank, from its speed over the time.

    Parameters
    ----------
    time, speed : ndarray, shape (n,)
        Times, ascending [s], and speed of the disc [rad/s].
    orders : ndarray
        Orders of the crank's turns, multiples of one order a cycle.
    period : float
        Angle of a cycle [rad].
    cycles : int
        Number of cycles over which each value is taken.
    dead_centre : float, optional
        A time of firing dead centre of cylinder 1 [s], from which phases count.

    Raises
    ------
    ValueError
        In one line, for a recording that is too short or has too few samples.
    """
    time, speed, orders = (np.asarray(one, dtype=float) for one in (time, speed, orders))
    if time.ndim != 1 or time.shape != speed.shape or not (np.diff(time) > 0.0).all():
        raise ValueError("time, speed: must be equally many, and times must ascend")
    if not np.isfinite(speed).all():
        raise ValueError("speed: must be finite")
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(time)
    angle = np.concatenate([[0.0], np.cumsum(steps)])
    count = int(angle[-1] / (period * cycles))
    if count < 1:
        raise ValueError(f"speed: the recording has less than {cycles} cycles")
    edges = np.searchsorted(angle, period * cycles * np.arange(count + 1))
    if np.diff(edges).min() < 4.0 * orders.max() * period / TURN * cycles:
        raise ValueError(f"speed: has too few samples for order {orders.max():g}; 4 a period")
    means, values, rotations = [], [], []
    for first, last in itertools.pairwise(edges):
        part = slice(first, last + 1)
        middle = 0.5 * (time[first] + time[last - 1])
        own, goal = time[part] - middle, angle[part]
        powers = np.stack([own**0, own, own**2], axis=-1)
        rotation, *_ = np.linalg.lstsq(powers, goal, rcond=None)
        for _ in range(3):
            waves = np.exp(1j * np.multiply.outer(powers @ rotation, orders))
            found, *_ = np.linalg.lstsq(
                np.hstack([powers, waves.real, -waves.imag]), goal, rcond=None
            )
            rotation = found[:3]
        means.append(rotation[1])
        values.append(found[3 : 3 + orders.size] + 1j * found[3 + orders.size :])
        rotations.append((middle, rotation))
    harmonics = np.array(values)
    phase = np.full(harmonics.shape, np.nan)
    if dead_centre is not None:
        middle, rotation = min(rotations, key=lambda one: abs(one[0] - dead_centre))
        own = dead_centre - middle
        zero = rotation @ np.array([1.0, own, own**2])
        phase = np.angle(harmonics * np.exp(1j * orders * zero))
    return Torsiogram(np.array(means), np.abs(harmonics), phase)
