"""Free vibration without and with damping: natural frequencies, shapes, and how orders excite them.

The referred system is K a = omega_m^2 J a. With y = J^(1/2) a it is the symmetric eigenproblem of
J^(-1/2) K J^(-1/2). Where nothing holds a part of the system (the whole of it, unless there are
springs to the frame; a ring that only a viscous damper joins) it turns freely: these modes have the
frequency 0, their number follows from the tree, and they are left out. The first mode is the first
elastic one. Where the frequencies spread so far that eigenvalues lose the low ones, they come from
`graded`. Besides: how far an order moves a disc of the elastic shaft from where the rigid shaft
would move it.

With damping, they are complex eigenvalues of the same system:
(s^2 J + s C + K + i eta K) a = 0 in the coordinates q of the modes without damping, those of parts
that nothing holds among them: a = sum q_m a_m with sum J a_m^2 = 1 leaves

    s^2 q + s C_m q + (omega^2 + i H) q = 0,    C_m = sum c (twist)(twist)^T + ...,

whose state (omega q, s q) has numbers no larger than the frequencies. So rigid shafts and light
discs are as far from soft modes as without damping. A mode has the natural frequency |s|, at which
its response lags by a quarter, swings freely at Im s, and its damping ratio is -Re s/|s|. Loss
factors mean a lag only for exp(+i omega t): of each pair, the root with Im s > 0 counts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.given_numbers import given_array
from engine_dyn.torsion.graded import critical_squares, graded_modes, modes_below
from engine_dyn.torsion.system import ShaftSystem, matrices
from engine_dyn.types import Booleans, Complexes, Floats, Integers


class Modes(NamedTuple):
    """Elastic modes, from the lowest; NaN where a design has fewer than others."""

    omega: Floats  # Natural frequencies [rad/s]; shape (..., m)
    # Amplitude of each disc, as it turns itself and not referred through gears, over that of the
    # disc of unit amplitude; shape (..., m, N)
    shape: Floats
    # Modal inertia sum J a^2 [kg m2], referred to the disc of unit amplitude; shape (..., m)
    modal_inertia: Floats
    # Referred amplitude of each node less that of its parent. It is computed by itself: for stiff
    # shafts a difference of two amplitudes would be less exact. 0 for node 0; shape (..., m, M)
    twist: Floats

    @property
    def frequency(self) -> Floats:
        """Natural frequencies [Hz]."""
        return np.asarray(self.omega / (2.0 * np.pi))


def natural_modes(system: ShaftSystem, speed: Any = 0.0, unit: int | None = None) -> Modes:
    """Natural frequencies and mode shapes.

    Parameters
    ----------
    system : ShaftSystem
        Losses and damping are left out.
    speed : array_like
        Speed of the crank [rad/s], which stiffens pendulums; broadcasts with the designs.
    unit : int, optional
        Disc of unit amplitude, not finite where that disc does not move; by default the disc that
        moves most in each mode, the first of several that move as much.
    """
    if unit is not None and not 0 <= unit < system.node_of_disc.size:
        raise ValueError(f"unit = {unit}: must be a disc, from 0 to {system.node_of_disc.size - 1}")
    squares, amplitude, twist = elastic_modes(system, speed)
    shape = amplitude[..., system.node_of_disc] * system.ratio[..., None, :]
    size = np.abs(shape)
    if unit is None:
        # Amplitudes that differ by less than this fraction count as equally large.
        most = size >= (1.0 - 1e-9) * size.max(axis=-1, keepdims=True)
        place = most.argmax(axis=-1)
    else:
        place = np.full(shape.shape[:-1], unit)
    with np.errstate(divide="ignore", invalid="ignore"):
        over = 1.0 / np.take_along_axis(shape, place[..., None], axis=-1)
        # A disc that moves less than the rounding of eigenvectors stands still.
        moves = size > 1e-12 * size.max(axis=-1, keepdims=True)
        shape = np.where(moves, shape * over, 0.0 * np.abs(over))
        return Modes(np.sqrt(squares), shape, over[..., 0] ** 2, twist * over)


def elastic_modes(system: ShaftSystem, speed: Any) -> tuple[Floats, Floats, Floats]:
    """Squares of the frequencies, and, with sum J a^2 = 1, angles and twists of the nodes."""
    inertia, stiffness, *_ = matrices(system, speed)
    free = free_parts(system, speed)
    root = np.sqrt(inertia)
    squares, vectors = np.linalg.eigh(stiffness / (root[..., :, None] * root[..., None, :]))
    largest = squares[..., -1]
    angle = np.swapaxes(vectors / root[..., :, None], -1, -2)
    count = squares.shape[-1] - int(free.min())
    squares = _from_first_elastic(squares, free)[..., :count]
    angle = _from_first_elastic(angle, free)[..., :count, :]
    twist = angle - angle[..., np.maximum(system.parent, 0)]
    if count:
        # Eigenvalues have ten digits up to this ratio of the largest to the least omega^2.
        wide = ~(largest < 1e6 * squares[..., 0]) & (free < inertia.shape[-1])
        own = (
            np.broadcast_to(values, inertia.shape)[wide]
            for values in (inertia, system.stiffness_at(speed), system.ground_stiffness)
        )
        # Contiguous, for which alone the kernel is compiled.
        modes = [np.ascontiguousarray(values[wide]) for values in (squares, angle, twist)]
        if modes[0].size:
            graded_modes(system.parent, *own, *modes)
        squares[wide], angle[wide], twist[wide] = modes
    return squares, angle, twist


def free_vectors(system: ShaftSystem, speed: Any) -> tuple[Floats, Floats]:
    """Angles and twists of the nodes where a part that nothing holds turns, with sum J a^2 = 1.

    Shape (..., parts, M), with as many parts as the design with most of them has; those beyond are
    0. A twist differs from 0 only where a damper or nothing joins two parts.
    """
    joins = system.stiffness_at(speed) > 0.0
    held = np.broadcast_to(system.ground_stiffness, joins.shape) > 0.0
    first = np.broadcast_to(np.arange(system.parent.size), joins.shape).copy()
    for node in range(1, system.parent.size):
        first[..., node] = np.where(joins[..., node], first[..., system.parent[node]], node)
    belongs = first[..., None, :] == np.arange(system.parent.size)[:, None]
    free = belongs.any(axis=-1) & ~(belongs & held[..., None, :]).any(axis=-1)
    inertia = (belongs * system.inertia[..., None, :]).sum(axis=-1)
    scale = np.where(free, 1.0 / np.sqrt(np.where(free, inertia, 1.0)), 0.0)
    angle = belongs * scale[..., None]
    parts = int(free.sum(axis=-1).max(initial=0))
    last = np.argsort(~free, axis=-1, kind="stable")[..., :parts, None]
    angle = np.take_along_axis(angle, last, axis=-2)
    return angle, angle - angle[..., np.maximum(system.parent, 0)]


def free_parts(system: ShaftSystem, speed: Any) -> Integers:
    """Number of parts of each design that nothing holds."""
    angle, _ = free_vectors(system, speed)
    return np.asarray(np.count_nonzero(angle.any(axis=-1), axis=-1))


def count_below(system: ShaftSystem, omega: float) -> int:
    """Number of modes below a frequency [rad/s] at rest, those of free parts among them."""
    stiffness = system.stiffness_at(0.0)
    numbers = system.inertia, stiffness, system.ground_stiffness, system.speed_stiffness
    scratch = np.empty(system.parent.size)
    return int(modes_below(system.parent, numbers, math.inf, omega**2, scratch))


def _from_first_elastic(values: Floats, free: Integers) -> Floats:
    """Modes (the axis behind the designs) from the first elastic mode on, then NaN."""
    least = int(free.min())
    if least == free.max():
        return values[(*(slice(None),) * free.ndim, slice(least, None))]
    count = values.shape[free.ndim]
    place = free[..., None] + np.arange(count)
    index = np.minimum(place, count - 1).reshape(*place.shape, *(1,) * (values.ndim - place.ndim))
    missing = (place >= count).reshape(index.shape)
    return np.where(missing, np.nan, np.take_along_axis(values, index, axis=free.ndim))


def zero_crossings(system: ShaftSystem, modes: Modes) -> Floats:
    """Where in each shaft a mode has a node: the part of the way from its first disc; else NaN.

    Shape (..., m, S). A node on a disc is counted in one of its shafts.
    """
    first, second = (modes.shape[..., system.shafts[:, side]] for side in (0, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        place = first / (first - second)
    return np.where((first > 0.0) != (second > 0.0), place, np.nan)


def mode_torques(system: ShaftSystem, modes: Modes, speed: Any = 0.0) -> Floats:
    """Torque in each shaft per radian of unit amplitude [N m/rad]; shape (..., m, S).

    These are the torques of a Holzer table, with the sign of the twist of the shaft's two discs.
    """
    referred = system.stiffness_at(speed)[..., None, :] * modes.twist
    return np.asarray(system.shaft_factor[..., None, :] * referred[..., system.node_of_shaft])


def critical_speeds(system: ShaftSystem, orders: Any) -> Floats:
    """Speeds of the crank [rad/s] at which an order meets a natural frequency, omega_m/nu.

    Parameters
    ----------
    system : ShaftSystem
        A pendulum's stiffness follows the speed: with omega = nu Omega it belongs to the inertia,
        K a = omega^2 (J - K_s/nu^2) a.
    orders : array_like
        Orders, above 0.

    Returns
    -------
    ndarray, shape (..., orders, m)
        Rising; NaN where a design has fewer. Without pendulums, mode m is at its place.
    """
    nu = checked_orders(orders)
    if not system.speed_stiffness.any():
        return np.asarray(natural_modes(system).omega[..., None, :] / nu[:, None])
    own = (
        np.ascontiguousarray(values).reshape(-1, system.parent.size)
        for values in (system.inertia, system.stiffness, system.ground_stiffness)
    )
    following = np.ascontiguousarray(system.speed_stiffness).reshape(-1, system.parent.size)
    squares = np.empty((len(following), nu.size, system.parent.size))
    critical_squares(system.parent, *own, following, nu, squares)
    return np.sqrt(squares).reshape(*system.shape, *squares.shape[1:]) / nu[:, None]


def modal_damping(system: ShaftSystem, modes: Modes, speed: Any = 0.0) -> Floats:
    """Damping ratio zeta [1] of each mode, from the losses of its undamped shape.

    zeta = (sum eta k (twist)^2 + omega a^T C a)/(2 omega^2 J_m): half the loss factor where all
    shafts have the same. For small damping; no mode of a heavily damped ring.
    """
    discs = np.unique(system.node_of_disc, return_index=True)[1]  # one disc of each node
    angle = modes.shape[..., discs] / system.ratio[..., None, discs]
    stiffness = system.stiffness_at(speed) * system.loss_factor
    lost = np.einsum("...mn,...n->...m", modes.twist**2, stiffness)
    viscous = np.einsum("...mn,...n->...m", modes.twist**2, system.damping)
    viscous = viscous + np.einsum("...mn,...n->...m", angle**2, system.disc_damping)
    with np.errstate(divide="ignore", invalid="ignore"):  # a mode may not move disc 1
        of_parts = 0.5 * (lost + modes.omega * viscous) / (modes.omega**2 * modes.modal_inertia)
    return np.asarray(of_parts + given_damping(system, modes.omega.shape[-1]))


def given_damping(system: ShaftSystem, count: int) -> Any:
    """Damping ratio that a system has for each of some elastic modes, 0 where none is given."""
    given = system.modal_damping
    if not given.shape[-1]:
        return 0.0
    return given[..., np.minimum(np.arange(count), given.shape[-1] - 1)]


def checked_orders(orders: Any) -> Floats:
    """Orders along one axis, checked."""
    nu = given_array("orders", orders, finite=True).reshape(-1)
    if not (nu > 0.0).all():
        raise ValueError(f"orders: {nu[~(nu > 0.0)][0]:g}: must be above 0")
    return nu


def elastic_over_rigid(
    system: ShaftSystem, orders: Any, speed: Any, throws: Sequence[int], torque: Any, disc: int
) -> Floats:
    """Size of a disc's angle over that of the rigid shaft, shape (speeds, orders).

    The response of the system with its damping, against -omega^2 sum(J) theta = sum(U). At low
    orders and speeds it is 1; without damping, it is infinite at a natural frequency.

    Parameters
    ----------
    system : ShaftSystem
        One design.
    orders : array_like
        nu.
    speed : array_like
        Speed of the crank [rad/s].
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
    torques, omega = list(acting), np.sqrt(square)
    dynamic = [
        g - square * j + 1j * omega * c
        for g, j, c in zip(
            system.ground_stiffness, system.inertia, system.disc_damping, strict=True
        )
    ]
    stiffness = [
        k * (1.0 + 1j * eta) + 1j * omega * c
        for k, eta, c in zip(system.stiffness, system.loss_factor, system.damping, strict=True)
    ]
    with np.errstate(divide="ignore", invalid="ignore"):  # an order may meet a frequency exactly
        for node in range(system.parent.size - 1, 0, -1):
            parent, stiff = system.parent[node], stiffness[node]
            pivot = stiff + dynamic[node]
            dynamic[parent] = dynamic[parent] + stiff * dynamic[node] / pivot
            torques[parent] = torques[parent] + stiff * torques[node] / pivot
        angle = [torques[0] / dynamic[0]]
        for node in range(1, system.parent.size):
            stiff = stiffness[node]
            turned = torques[node] + stiff * angle[system.parent[node]]
            angle.append(turned / (stiff + dynamic[node]))
        return np.asarray(np.abs(angle[system.node_of_disc[disc]] / rigid))


class DampedModes(NamedTuple):
    """Modes that swing, from the lowest natural frequency; NaN past the last."""

    # Modulus |s| and imaginary part Im s of the eigenvalues [rad/s]; shape (..., m)
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
    # A pendulum has infinite inertia at its own order: it is detuned by 1e-9.
    inertia = (1.0 + 1e-9) * np.eye(size) - following / nu[:, None, None] ** 2
    lower = np.linalg.solve(inertia, state.matrix[..., None, size:, :])
    upper = np.broadcast_to(state.matrix[..., None, :size, :], lower.shape)
    both = np.concatenate([upper, lower], axis=-2)
    roots = _swinging(both, state.lowest[..., None], system.parent.size)
    return np.asarray(np.abs(roots) / nu[:, None])


class _State(NamedTuple):
    """State matrix of (omega q, q'), coordinates q, lowest undamped frequency, modes above 0."""

    matrix: Complexes
    omega: Floats
    angle: Floats
    twist: Floats
    lowest: Floats
    above: int


class Coordinates(NamedTuple):
    """Free parts and elastic modes as coordinates, with sum J a^2 = 1, and their damping."""

    omega: Floats  # Frequency of each undamped mode [rad/s], 0 of free parts; shape (..., n)
    angle: Floats  # Angle of each node in each coordinate; shape (..., n, M)
    twist: Floats  # Angle of each node against its parent
    viscous: Floats  # Viscous damping between coordinates [1/s]; shape (..., n, n)
    lost: Floats  # Loss factor times stiffness [1/s2]
    free: int  # Number of free parts, which come first


def coordinates(system: ShaftSystem, speed: Any, spread: float = 1e8) -> Coordinates:
    """Return the coordinates in which inertia is 1 and stiffness omega^2.

    Modes of more than `spread` times the lowest frequency are left out: eigenvalues with all of
    them have eight digits of the lowest one up to the default.
    """
    squares, angle, twist = elastic_modes(system, speed)
    left = ~(squares < spread**2 * squares[..., :1])[..., None]
    omega = np.where(left[..., 0], 0.0, np.sqrt(squares))
    own, between = free_vectors(system, speed)
    angle = np.concatenate([own, np.where(left, 0.0, angle)], axis=-2)
    twist = np.concatenate([between, np.where(left, 0.0, twist)], axis=-2)
    viscous = _form(twist, system.damping) + _form(angle, system.disc_damping)
    given = 2.0 * given_damping(system, omega.shape[-1]) * omega
    free = own.shape[-2]
    places = np.arange(omega.shape[-1]) + free
    viscous[..., places, places] += given
    omega = np.concatenate([np.zeros(own.shape[:-1]), omega], axis=-1)
    lost = _form(twist, system.stiffness_at(speed) * system.loss_factor)
    return Coordinates(omega, angle, twist, viscous, lost, free)


def _state(system: ShaftSystem, speed: Any) -> _State:
    omega, angle, twist, viscous, lost, free = coordinates(system, speed)
    elastic = omega[..., free:]
    lowest = elastic[..., :1] if elastic.shape[-1] else np.zeros((*omega.shape[:-1], 1))
    over = np.divide(1.0, omega, out=np.zeros(omega.shape), where=omega > 0.0)[..., None, :]
    size = omega.shape[-1]
    matrix = np.zeros((*omega.shape[:-1], 2 * size, 2 * size), dtype=np.complex128)
    diagonal = omega[..., None] * np.eye(size)
    matrix[..., :size, size:] = diagonal
    matrix[..., size:, :size] = -(diagonal + 1j * lost * over)
    matrix[..., size:, size:] = -viscous
    return _State(matrix, omega, angle, twist, lowest, elastic.shape[-1])


def _form(vectors: Floats, weight: Floats) -> Floats:
    """Sum over components of weight times products of vectors."""
    return np.asarray(np.einsum("...in,...n,...jn->...ij", vectors, weight, vectors))


def _swinging(matrix: Complexes, lowest: Floats, count: int) -> Complexes:
    """Oscillating eigenvalues, by their size; NaN past the last one."""
    roots = np.linalg.eigvals(matrix)
    roots = np.where(_swings(roots, lowest), roots, np.nan)
    order = np.argsort(np.abs(roots), axis=-1)[..., :count]
    return np.asarray(np.take_along_axis(roots, order, axis=-1))


def _swings(roots: Any, lowest: Floats) -> Booleans:
    """Whether an eigenvalue is that of a mode that swings, and the one of its pair that counts.

    A mode with a damping ratio above 0.995 decays before it swings; the root of a freely turning
    part is rounding.
    """
    length = np.abs(roots)
    return np.asarray((roots.imag > 0.1 * length) & (length > 1e-6 * lowest))


def modal_roots(
    system: ShaftSystem, discs: Sequence[int], *, all_roots: bool = False
) -> tuple[Complexes, Complexes, Complexes]:
    """Eigenvalues s, how torques on discs excite their modes, and what these twist the shafts by.

    With q' = s q + left U the torques in the shafts are the sum of right q over all eigenvalues,
    whatever the torques U are over time.

    Parameters
    ----------
    system : ShaftSystem
        Without pendulums.
    discs : sequence of int
        Discs on which torques act.
    all_roots : bool
        Also modes that do not swing; else, and of conjugates always, only those with Im s > 0.

    Returns
    -------
    tuple of ndarray
        s (..., m) by its size, left (..., m, discs) and right (..., m, S); past the last one NaN,
        and 0 with `all_roots`, and 0.
    """
    state = _state(system, 0.0)
    size = state.omega.shape[-1]
    matrix = state.matrix if state.matrix.imag.any() else state.matrix.real
    roots, vectors = np.linalg.eig(matrix)
    rows = np.linalg.inv(vectors)[..., size:]
    known, count = _swings(roots, state.lowest), state.above
    if all_roots:
        known, count = known | (np.abs(roots.imag) <= 0.1 * np.abs(roots)), 2 * size
    order = np.argsort(np.where(known, np.abs(roots), np.inf), axis=-1)[..., :count]
    known = np.take_along_axis(known, order, axis=-1)
    roots = np.take_along_axis(roots, order, axis=-1)
    acting = state.angle[..., system.node_of_disc[discs]] * system.ratio[..., None, discs]
    left = np.matmul(np.take_along_axis(rows, order[..., None], axis=-2), acting)
    twist = state.twist[..., system.node_of_shaft]
    over = np.divide(1.0, state.omega, out=np.zeros(state.omega.shape), where=state.omega > 0.0)
    elastic = system.stiffness * (1.0 + 1j * system.loss_factor)
    held, slowed = (
        (values[..., system.node_of_shaft] * system.shaft_factor)[..., None, :]
        for values in (elastic, system.damping)
    )
    torque = np.concatenate([held * twist * over[..., None], slowed * twist], axis=-2)
    shape = np.take_along_axis(vectors, order[..., None, :], axis=-1).swapaxes(-1, -2)
    left, right = (np.where(known[..., None], v, 0.0) for v in (left, np.matmul(shape, torque)))
    return np.where(known, roots, 0.0 if all_roots else np.nan), left, right
