r"""Free vibration with damping: complex eigenvalues of the same system.

(s^2 J + s C + K + i eta K) a = 0 in the coordinates q of the modes without damping, those of parts
that nothing holds among them: a = sum q_m a_m with sum J a_m^2 = 1 leaves

    s^2 q + s C_m q + (omega^2 + i H) q = 0,    C_m = sum c (twist)(twist)^T + ...,

whose state (omega q, s q) has numbers no larger than the frequencies. So rigid shafts and light
discs are as far from soft modes as in `modes`. A mode has the natural frequency |s|, at which its
response lags by a quarter, swings freely at Im s, and its damping ratio is -Re s/|s|. Loss factors
mean a lag only for exp(+i omega t): of each pair, the root with Im s > 0 counts.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine_dyn.torsion.modes import checked_orders, elastic_modes, free_vectors
from engine_dyn.torsion.system import ShaftSystem
from engine_dyn.types import Complexes, Floats


class DampedModes(NamedTuple):
    """Modes that swing, from the lowest natural frequency; NaN past the last."""

    # |s| and Im s [rad/s]; shape (..., m)
    omega: Floats
    swing: Floats
    ratio: Floats  # Damping ratio -Re s/|s| [1]; shape (..., m)


def damped_modes(system: ShaftSystem, speed: Any = 0.0) -> DampedModes:
    """Complex modes of a system, as many as `modes.natural_modes` has.

    Parameters
    ----------
    system : ShaftSystem
        Its loss factors and damping may have any size.
    speed : array_like
        Speed of the crank [rad/s], which stiffens pendulums.
    """
    state = _state(system, speed)
    roots = _swinging(state.matrix, state.lowest, state.above)
    return DampedModes(np.abs(roots), roots.imag, -roots.real / np.abs(roots))


def damped_critical_speeds(system: ShaftSystem, orders: Any) -> Floats:
    """Speeds of the crank [rad/s] at which an order meets the |s| of a mode, (..., orders, m).

    The stiffness of pendulums, K_s over the square of the speed, is that at the speed s/(i nu): it
    belongs to the inertia, J - K_s/nu^2, as in `modes.critical_speeds`.
    """
    nu = checked_orders(orders)
    if not system.speed_stiffness.any():
        return np.asarray(damped_modes(system).omega[..., None, :] / nu[:, None])
    state = _state(system, 0.0)
    size = state.matrix.shape[-1] // 2
    following = _form(state.twist, system.speed_stiffness)[..., None, :, :]
    # At its own order a pendulum has an infinite inertia: it is detuned by 1e-9.
    inertia = (1.0 + 1e-9) * np.eye(size) - following / nu[:, None, None] ** 2
    lower = np.linalg.solve(inertia, state.matrix[..., None, size:, :])
    upper = np.broadcast_to(state.matrix[..., None, :size, :], lower.shape)
    both = np.concatenate([upper, lower], axis=-2)
    roots = _swinging(both, state.lowest[..., None], system.parent.size)
    return np.asarray(np.abs(roots) / nu[:, None])


class _State(NamedTuple):
    """State matrix, twists of its coordinates, lowest frequency without damping, modes above 0."""

    matrix: Complexes
    twist: Floats
    lowest: Floats
    above: int


def _state(system: ShaftSystem, speed: Any) -> _State:
    squares, angle, twist = elastic_modes(system, speed)
    lowest = squares[..., :1] if squares.shape[-1] else np.zeros((*squares.shape[:-1], 1))
    # Eight digits hold modes up to 1e8 times the lowest; those beyond have no part in them.
    left = ~(squares < 1e8**2 * lowest)[..., None]
    omega = np.where(left[..., 0], 0.0, np.sqrt(squares))
    own, between = free_vectors(system, speed)
    angle = np.concatenate([own, np.where(left, 0.0, angle)], axis=-2)
    twist = np.concatenate([between, np.where(left, 0.0, twist)], axis=-2)
    omega = np.concatenate([np.zeros(own.shape[:-1]), omega], axis=-1)
    viscous = _form(twist, system.damping) + _form(angle, system.disc_damping)
    lost = _form(twist, system.stiffness_at(speed) * system.loss_factor)
    over = np.divide(1.0, omega, out=np.zeros(omega.shape), where=omega > 0.0)[..., None, :]
    size = omega.shape[-1]
    matrix = np.zeros((*omega.shape[:-1], 2 * size, 2 * size), dtype=np.complex128)
    diagonal = omega[..., None] * np.eye(size)
    matrix[..., :size, size:] = diagonal
    matrix[..., size:, :size] = -(diagonal + 1j * lost * over)
    matrix[..., size:, size:] = -viscous
    return _State(matrix, twist, np.sqrt(lowest), squares.shape[-1])


def _form(vectors: Floats, weight: Floats) -> Floats:
    """Sum of weight times products of vectors."""
    return np.asarray(np.einsum("...in,...n,...jn->...ij", vectors, weight, vectors))


def _swinging(matrix: Complexes, lowest: Floats, count: int) -> Complexes:
    """Eigenvalues that swing, by their size; NaN past the last."""
    roots = np.linalg.eigvals(matrix)
    length = np.abs(roots)
    # A mode that is damped more, above 0.995, dies before it swings; the root of a part that turns
    # freely is rounding.
    swings = (roots.imag > 0.1 * length) & (length > 1e-6 * lowest)
    roots = np.where(swings, roots, np.nan)
    order = np.argsort(np.abs(roots), axis=-1)[..., :count]
    return np.asarray(np.take_along_axis(roots, order, axis=-1))
