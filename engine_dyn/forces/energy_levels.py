"""Energy that the flywheel takes up over the angle, and its levels where torque and load cross.

The excess energy is the work of the torque less the load, both less their means, see
docs/torque_diagrams.md. Its extremes lie among the crossings of both, and its range is the energy
swing, from which textbooks size flywheels (Khurmi and Gupta, Theory of Machines, chapter 16).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine_dyn.types import Floats

__all__ = ["MOST_CROSSINGS", "crossings", "excess_energy", "net_torque"]

MOST_CROSSINGS = 64
"""Crossings that are told of a design; further ones are left out."""

STEPS = 3
"""Newton steps behind a linear interpolation: the error is that of the polynomial then."""


def net_torque(torque: Any, load: Any) -> Floats:
    """Torque less load, without the mean, along the last axis [N m]."""
    net = np.asarray(torque, dtype=float) - np.asarray(load, dtype=float)
    return np.ascontiguousarray(net - net.mean(axis=-1, keepdims=True))


def excess_energy(net: Floats, step: float) -> Floats:
    """Integral over the angle of a torque without mean, itself without mean [J].

    `net` has equal steps [rad] of one period along its last axis. By the harmonics of the samples.

    Examples
    --------
    >>> angle = np.arange(0.0, 2.0 * np.pi, np.pi / 4)
    >>> excess_energy(np.cos(3 * angle), np.pi / 4).max().round(6)
    np.float64(0.333333)
    """
    samples = net.shape[-1]
    order = 2.0 * np.pi * np.fft.rfftfreq(samples, step)
    waves = np.fft.rfft(net, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        waves = np.where(order > 0.0, waves / (1j * order), 0.0)
    if samples % 2 == 0:
        waves[..., -1] = 0.0  # the samples do not tell the phase of this order
    return np.asarray(np.fft.irfft(waves, samples, axis=-1))


def crossings(net: Floats, first: float, step: float) -> tuple[Floats, Floats]:
    """Angles [rad] at which torque and load cross, and the excess energy there [J].

    Parameters
    ----------
    net : ndarray, shape (..., angle)
        As of `excess_energy`.
    first, step : float
        First angle, and the step to the next [rad].

    Returns
    -------
    angle, energy : ndarray, shape (..., MOST_CROSSINGS)
        In the order of the angles; NaN behind the last. Cubics through four samples.
    """
    rows = net.reshape(-1, net.shape[-1])
    energy = excess_energy(rows, step)
    above = rows > 0.0
    changes = above != np.roll(above, -1, axis=1)
    wide = min(MOST_CROSSINGS, rows.shape[1])
    place = np.argsort(~changes, axis=1, kind="stable")[:, :wide]
    a, b, c, d = (
        np.take_along_axis(np.roll(rows, -shift, axis=1), place, axis=1) for shift in (-1, 0, 1, 2)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        t = b / (b - c)
        for _ in range(STEPS):
            # The cubic through a, b, c, d at -1, 0, 1, 2.
            linear, square = c - a / 3.0 - b / 2.0 - d / 6.0, (a + c) / 2.0 - b
            cube = (d - a) / 6.0 + (b - c) / 2.0
            value = b + t * (linear + t * (square + t * cube))
            t = np.clip(t - value / (linear + t * (2.0 * square + 3.0 * t * cube)), 0.0, 1.0)
    e0, e1 = (
        np.take_along_axis(np.roll(energy, -shift, axis=1), place, axis=1) for shift in (0, 1)
    )
    m0, m1 = step * b, step * c
    level = e0 + t * (m0 + t * (3.0 * (e1 - e0) - 2.0 * m0 - m1 + t * (2.0 * (e0 - e1) + m0 + m1)))
    known = np.take_along_axis(changes, place, axis=1)
    found = np.full((2, len(rows), MOST_CROSSINGS), np.nan)
    found[0, :, :wide] = np.where(known, first + step * (place + t), np.nan)
    found[1, :, :wide] = np.where(known, level, np.nan)
    angle, at = found.reshape(2, *net.shape[:-1], MOST_CROSSINGS)
    return angle, at
