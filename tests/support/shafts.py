"""Shafts of known response, and a slow solution that shares no code with `engine_dyn.torsion`."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.linalg import null_space

__all__ = ["DIESEL", "DIESEL_NODES", "DIESEL_ORDERS", "DIESEL_SPEED", "dense", "diesel_torques"]

DIESEL: dict[str, Any] = {
    "inertia": [0.017, 0.009, 0.0467, 0.0327, 0.0467, 0.0467, 0.0327, 0.0487, 2.075],
    "stiffness": [1.106e6, 1.631e6, 1.253e6, 1.253e6, 1.678e6, 1.253e6, 1.253e6, 1.976e6],
    "loss_factor": 0.035,
    "disc_damping": [0.0, 0.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 0.0],
}
"""Six-cylinder diesel 105 x 137: pulley, gear train, six throws, flywheel. Mendes, Meirelles,
Zampieri (2008), doi:10.1243/14644193JMBD126, Fig. 4, and damping, as in openTorsion's
examples/ICE_example.py (MIT licence, copyright (c) 2020 Sampo Laine, Urho Hakonen)."""

DIESEL_NODES = range(2, 8)
DIESEL_SPEED = 2165.0 * np.pi / 30.0

# Torque of gas and reciprocating masses on throw 1 at full load and that speed, amplitude [N m] and
# phase [degree], of the catalogue's engine diesel_105x137 (pressure from the same example).
_THROW_1 = np.array([
    [0.5, 427.378353, -44.36566575], [1, 670.6453124, -75.19333842],
    [1.5, 532.0547574, -86.64782037], [2, 183.9749805, -100.4852321],
    [2.5, 402.7815103, -97.80566926], [3, 188.0028726, -110.2922534],
    [3.5, 281.237812, -104.1354041], [4, 210.3754126, -108.9415263],
    [4.5, 185.0138845, -109.097355], [5, 152.2254407, -111.9065734],
    [5.5, 118.3760497, -114.7947537], [6, 93.47888538, -116.8924445],
    [6.5, 71.78575776, -118.5943858], [7, 55.69469696, -117.8673741],
    [7.5, 45.15694544, -118.554109], [8, 35.45032126, -118.4532749],
    [8.5, 27.2966604, -119.6422017], [9, 21.57739493, -121.425739],
    [9.5, 15.69002259, -126.8317632], [10, 11.87685253, -133.075701],
    [10.5, 9.670811356, -137.5465043], [11, 9.066894697, -143.9553476],
    [11.5, 8.79408191, -148.6920575], [12, 7.999563137, -152.9155265],
])  # fmt: skip

DIESEL_ORDERS = _THROW_1[:, 0]


def diesel_torques() -> Any:
    """Harmonics on the throws, shape (6, 24), of the firing order 1-5-3-6-2-4."""
    first = _THROW_1[:, 1] * np.exp(1j * np.radians(_THROW_1[:, 2]))
    delay = np.radians([0.0, 480.0, 240.0, 600.0, 120.0, 360.0])
    return first * np.exp(-1j * DIESEL_ORDERS * delay[:, None])


def dense(
    omega: float,
    torque: Any,
    inertia: Sequence[float],
    stiffness: Sequence[float],
    shafts: Sequence[tuple[int, int]] | None = None,
    loss_factor: Any = 0.0,
    damping: Any = 0.0,
    disc_damping: Any = 0.0,
    ground_stiffness: Any = 0.0,
    meshes: Sequence[tuple[int, int]] = (),
    ratios: Sequence[float] = (),
) -> tuple[Any, Any]:
    """Angles of the discs and torques of the shafts under `torque` on the discs at omega.

    Gears are constraints, ratio theta_first - theta_second = 0: the angles lie in their null space.
    """
    count = len(inertia)
    pairs = list(zip(range(count), range(1, count), strict=False)) if shafts is None else shafts
    k = np.asarray(stiffness) * (1.0 + 1j * np.asarray(loss_factor)) + 1j * omega * np.asarray(
        damping
    )
    twist = np.zeros((len(pairs), count))
    for number, (first, second) in enumerate(pairs):
        twist[number, first], twist[number, second] = -1.0, 1.0
    own = np.broadcast_to(
        np.asarray(ground_stiffness) + 1j * omega * np.asarray(disc_damping), count
    )
    matrix = np.diag(own - omega**2 * np.asarray(inertia)) + twist.T @ (k[:, None] * twist)
    mesh = np.zeros((len(meshes), count))
    for number, (first, second) in enumerate(meshes):
        mesh[number, first], mesh[number, second] = ratios[number], -1.0
    free = null_space(mesh) if len(meshes) else np.eye(count)
    angle = free @ np.linalg.solve(free.T @ matrix @ free, free.T @ np.asarray(torque))
    return angle, k * (twist @ angle)
