"""How far an order moves a disc of the elastic shaft from where the rigid shaft would move it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from engine_dyn.torsion.modes import checked_orders
from engine_dyn.torsion.system import ShaftSystem
from engine_dyn.types import Floats

__all__ = ["elastic_over_rigid"]


def elastic_over_rigid(
    system: ShaftSystem, orders: Any, speed: Any, throws: Sequence[int], torque: Any, disc: int
) -> Floats:
    """Angle of a disc over that of the rigid shaft, without damping, shape (speeds, orders).

    K theta - omega^2 J theta = U against -omega^2 sum(J) theta = sum(U). At low orders and speeds
    it is 1; at a natural frequency it is infinite.

    Parameters
    ----------
    system : ShaftSystem
        One design.
    orders : array_like
        nu.
    speed : array_like
        Of the crank [rad/s].
    throws : sequence of int
        Disc on which each torque acts.
    torque : array_like of complex
        Its harmonics in any unit, shape (throws, orders); an order whose sum is 0 gives NaN.
    disc : int
        Disc whose angle is compared, referred to the crank.
    """
    nu, given = checked_orders(orders), np.asarray(torque, dtype=complex)
    square = (np.ravel(speed)[:, None] * nu) ** 2
    acting = np.zeros((system.parent.size, nu.size), dtype=complex)
    for throw, at in enumerate(throws):
        acting[system.node_of_disc[at]] += system.ratio[at] * given[throw]
    rigid = -acting.sum(axis=0) / (square * system.inertia.sum())
    torques = list(acting)
    dynamic = [g - square * j for g, j in zip(system.ground_stiffness, system.inertia, strict=True)]
    with np.errstate(divide="ignore", invalid="ignore"):  # an order meets a frequency exactly
        for node in range(system.parent.size - 1, 0, -1):
            parent, stiff = system.parent[node], system.stiffness[node]
            pivot = stiff + dynamic[node]
            dynamic[parent] = dynamic[parent] + stiff * dynamic[node] / pivot
            torques[parent] = torques[parent] + stiff * torques[node] / pivot
        angle = [torques[0] / dynamic[0]]
        for node in range(1, system.parent.size):
            stiff = system.stiffness[node]
            turned = torques[node] + stiff * angle[system.parent[node]]
            angle.append(turned / (stiff + dynamic[node]))
        return np.asarray(np.abs(angle[system.node_of_disc[disc]] / rigid))
