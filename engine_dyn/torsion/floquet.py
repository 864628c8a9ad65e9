r"""Whether a periodic vibration with couplings that are not linear lasts.

A disturbance exp(i alpha tau) sum_m p_m exp(i m tau) of the twists, with m of both signs, meets the
slope of each coupling along its motion, k + s(tau), and the receptances rho of the linear system at
the orders m + alpha:

    F(alpha) p = 0,    F_mn = delta_mn - rho_(m + alpha) s_(m-n).

The linear system, F = 1, is stable: all poles of det F are those of rho. So by Nyquist's criterion
det F turns once round 0, while alpha goes from -1/2 to 1/2, for each multiplier outside the unit
circle. As F(-alpha) = conj F(alpha), half of the way tells: half turns up to alpha = 1/2. At
alpha = 0 a fold changes the sign of det F, at 1/2 a doubling of the period. Loss factors need no
form in time. Harmonics where rho s is small do not enter. Source: Hill's determinant; the
criterion in place of its roots is derived here.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine_dyn.torsion.forced import forced_response
from engine_dyn.torsion.system import ShaftSystem
from engine_dyn.types import Booleans, Complexes, Floats, Integers

COARSE, FINE = 17, 257
"""Numbers of values of alpha: the first, and the last, if the angle of det F still jumps."""

NEAR = 1e-4  # The first alpha, in place of 0, where order 0 has no receptance


def receptance(system: ShaftSystem, shafts: Any, orders: Floats, speed: Any) -> Complexes:
    """Twist of shaft c [rad] under 1 N m and its opposite at the two sides of shaft d.

    Shape (..., C, C, orders), with c before d.
    """
    torque = np.array([[1.0], [-1.0]]) * np.ones(orders.size)
    stiff = complex_stiffness(system, shafts, orders, speed)
    columns = [
        forced_response(
            system, orders, speed, system.shafts[shaft].tolist(), torque, wanted=("torque",)
        )["torque"][..., shafts, :]
        / stiff
        for shaft in shafts
    ]
    return np.stack(columns, axis=-2)


def complex_stiffness(system: ShaftSystem, shafts: Any, orders: Floats, speed: Any) -> Complexes:
    """Stiffness k (1 + i eta) + i nu omega c of shafts in their own turns [N m/rad].

    Shape (..., C, orders).
    """
    nodes = system.node_of_shaft[shafts]
    own = system.shaft_factor[..., shafts] ** 2
    real, viscous = (own * v[..., nodes] for v in (system.stiffness, system.damping))
    lag = system.loss_factor[..., nodes]
    w = orders * np.asarray(speed)[..., None, None]
    return np.asarray((real * (1.0 + 1j * lag))[..., None] + 1j * w * viscous[..., None])


def unstable(
    system: ShaftSystem, shafts: Any, speed: Floats, base: float, slope: Floats, origin: Floats,
    stick: Floats, unknowns: Integers,
) -> Booleans:  # fmt: skip
    """Whether small disturbances of the motions of some cases grow.

    Arguments as of `harmonic_balance.Motion` and `Laws`; `base` is the order of the period's first
    harmonic. NaN and systems that are linear at all times count as stable.
    """
    open_cases = np.abs(slope).max(axis=(1, 2, 3)) > 0.0
    turns, count = np.zeros(slope.shape[0]), COARSE
    while count <= FINE and open_cases.any():
        alpha = np.maximum(np.linspace(0.0, 0.5, count), NEAR)
        which = np.flatnonzero(open_cases)
        most = int(unknowns[which].max())
        m = np.arange(-most, most + 1)
        nu = base * (m + alpha[:, None])
        own = system.of(which)
        rho = receptance(own, shafts, np.abs(nu).ravel(), speed[which])
        rho = np.where(nu.ravel() < 0.0, rho.conj(), rho).reshape(*rho.shape[:3], *nu.shape)
        for place, case in enumerate(which):
            largest = np.abs(slope[case, :, 0]).max() + stick[case].max()
            kept = slice(most - unknowns[case], most + unknowns[case] + 1)
            of_case = rho[place][..., kept]
            if largest * np.abs(of_case).sum(axis=1).max() < 1.0:  # the gain of the loop is small
                open_cases[case] = False
                continue
            angle = np.angle(
                _determinant(of_case, alpha, m[kept], slope[case], origin[case], stick[case])
            )
            jumps = np.angle(np.exp(1j * np.diff(angle)))
            turns[case] = jumps.sum() / np.pi
            open_cases[case] = np.abs(jumps).max() > 1.0
        count = 2 * count - 1
    return np.asarray(np.rint(np.abs(turns)) > 0.0)


def _determinant(
    rho: Complexes, alpha: Floats, m: Integers, slope: Floats, origin: Floats, stick: Floats
) -> Complexes:
    """Unit numbers with the angles of det F at each alpha; `rho` has the shape (C, C, alpha, m)."""
    couplings, _, size = slope.shape
    width = m.size
    matrix = np.tile(np.eye(couplings * width, dtype=np.complex128), (alpha.size, 1, 1))
    for d in range(couplings):
        grip, since = stick[d] * slope[d, 1], origin[d]
        harmonics = np.fft.fft(slope[d, 0] + grip) / size
        changes = np.tile(harmonics[(m[:, None] - m) % size], (alpha.size, 1, 1))
        # A slider that moves within the period holds what it held where the twist turned last.
        starts = np.flatnonzero(np.diff(since, prepend=np.nan))
        moves = (since >= size - 1.0).any()
        for first, end in zip(starts, [*starts[1:], size], strict=True):
            if since[first] < 0.0 or not moves:
                continue
            at, tau = (2.0 * np.pi / size * v for v in (since[first] - size, np.arange(first, end)))
            column = np.exp(-1j * m[:, None] * tau) @ (
                grip[first:end, None] * np.exp(-1j * (tau[:, None] - at) * alpha)
            )
            changes -= column.T[:, :, None] * np.exp(1j * m * at) / size
        for c in range(couplings):
            rows, columns = (slice(i * width, (i + 1) * width) for i in (c, d))
            matrix[:, rows, columns] -= rho[c, d][:, :, None] * changes
    return np.asarray(np.linalg.slogdet(matrix)[0])
