"""Inertia force of engines with master and articulated rods: what plain radials do not have."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine_dyn.forces.balance.lines import lines_of
from engine_dyn.geometry.cylinder_means import value_of_sets
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount
from engine_dyn.types import Complexes

__all__ = ["inertia_force", "inertia_force_of_order"]

SAMPLES = 360
"""Of a revolution, for single orders."""


def inertia_force(
    phi: Any, crank_ratio: Any, crank_radius: Any, mass: Any, speed: Any, cylinder_set: Any,
    by_count: CylindersByCount, offset: Any = 0.0,
) -> Complexes:  # fmt: skip
    """Force of the reciprocating masses on the frame [N], real along cylinder 1.

    m r omega^2 (f b exp(i g) - mu k'' exp(i g)) of each cylinder in the direction g, with its
    reduced acceleration b, and the acceleration k'' of its knuckle pin, with a mass of mu m, beyond
    that of the crank pin; the imaginary part is a right angle ahead in the sense of rotation.
    Derived here.

    Parameters
    ----------
    phi : array_like
        Crank angle [rad]; all arrays broadcast.
    crank_ratio, offset : array_like
        lambda, and offset over the crank radius [1].
    crank_radius, mass, speed : array_like
        [m], of one cylinder [kg], [rad/s].
    cylinder_set, by_count
        As of `value_of_sets`.
    """

    def of_engine(engine: Cylinders) -> Any:
        total: Any = 0.0
        for member, direction in zip(engine.members, lines_of(engine).direction, strict=True):
            angle = phi + member.phase_of(crank_ratio, offset)
            one = member.mass_factor * member.acceleration(angle, crank_ratio, offset)
            if member.rod is not None:
                knuckle = member.rod.knuckle_acceleration(angle, crank_ratio, offset)
                one = one - member.rod.knuckle_mass * knuckle
            total = total + one * np.exp(1j * direction)
        return total

    whole: Complexes = value_of_sets(cylinder_set, by_count, of_engine)
    return mass * crank_radius * speed**2 * whole


def inertia_force_of_order(order: int, phi: Any, *motion: Any) -> Complexes:
    """One order of `inertia_force` over the crank angle [N]; `motion` as there."""
    turn = np.arange(SAMPLES) * (2.0 * np.pi / SAMPLES)
    force = inertia_force(turn, *motion)
    wave = np.exp(1j * order * turn)
    forward, backward = (
        np.mean(force * one, axis=-1, keepdims=True) for one in (np.conj(wave), wave)
    )
    angle = order * np.asarray(phi, dtype=float)
    found: Complexes = forward * np.exp(1j * angle) + backward * np.exp(-1j * angle)
    return found
