r"""Steady response of a shaft system to each order of the torques, by elimination along the tree.

For each order nu, with w = nu omega, node i has the dynamic stiffness Z_i = g - w^2 J + i w c and
the torque U_i. Its parent p, over k* = k (1 + i eta) + i w c_r, feels

    theta_i = (U_i + k* theta_p)/(k* + Z_i),
    Z_p += k* Z_i/(k* + Z_i),        U_p += k* U_i/(k* + Z_i),

stiffnesses in series. From the ends to the root, theta_0 = U_0/Z_0, and back with the twist

    theta_i - theta_p = (U_i - Z_i theta_p)/(k* + Z_i).

Holzer's table in complex numbers, for trees, without modes and without assumptions on damping.
Neither form subtracts what is nearly equal: stiff shafts cost no digits. Only k* + Z_i = 0 does,
where a branch alone resonates (an undamped absorber at its own frequency, a pendulum at its own
order) though the system does not. Such designs are rare; they are solved again with pivoting. An
undamped system at a natural frequency has no steady state, and that is its status.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.given_numbers import given_array
from engine_dyn.speed.pieces import Progress, run_on_threads
from engine_dyn.status import CONVERGED, NO_STEADY_STATE
from engine_dyn.torsion.modes import checked_orders
from engine_dyn.torsion.synthesis import Synthesis, extremes_of, synthesis
from engine_dyn.torsion.system import ShaftSystem
from engine_dyn.types import Complexes, Floats, Integers

__all__ = ["RESULTS", "forced_response", "largest_order", "misfiring"]

RESULTS = {
    "angle": "harmonics of the angle of each disc [rad], (..., N, orders)",
    "torque": "harmonics of the torque in each shaft [N m], (..., S, orders)",
    "angle_extremes": "least and largest angle of each disc over the cycle, bound on the error of "
    "both [rad], (..., N, 3)",
    "torque_extremes": "the same of the torque in each shaft [N m], (..., S, 3)",
    "twist_extremes": "the same of the angle between the discs of each pair [rad], (..., P, 3)",
    "shaft_loss": "mean power lost in each shaft, coupling or damper [W], (..., S)",
    "frame_loss": "mean power lost between all discs and the frame [W], (...)",
}
"""What can be asked for."""

SMALL = 1e-4
"""Where |k* + Z| is this part of its terms, four digits are lost: solved again with pivoting."""

NEAR_RESONANCE = 1e-11
"""Least |1 - omega_m^2/w^2| (the loss factor, if larger) that leaves a steady state."""

AT_ONCE = 256
"""Designs that a thread takes at once."""


class _Tree(NamedTuple):
    """Referred values, shape (designs, M); node 0 is the root."""

    parent: Integers
    inertia: Floats
    disc_damping: Floats
    ground_stiffness: Floats
    stiffness: Floats
    loss_factor: Floats
    damping: Floats
    speed_stiffness: Floats


class _Cases(NamedTuple):
    """Cases to be solved: lines of the tables, speed [rad/s], torques.

    `gas` and `mass` have shape (lines, T, 2, V), real and imaginary parts; the torque is gas +
    omega^2 mass. `throw_ratio`, (designs, T), refers it to the crank.
    """

    design: Integers
    gas_line: Integers
    mass_line: Integers
    speed: Floats
    throw_node: Integers
    throw_ratio: Floats
    gas: Floats
    mass: Floats
    orders: Floats


class _Places(NamedTuple):
    """Node and ratio of each disc, node and factor of each shaft, pairs of discs."""

    node_of_disc: Integers
    ratio: Floats
    node_of_shaft: Integers
    factor: Floats
    pairs: Integers


class _Found(NamedTuple):
    """Results, empty where not asked for; `doubtful` are cases that lost digits."""

    angle: Floats
    torque: Floats
    angle_extremes: Floats
    torque_extremes: Floats
    twist_extremes: Floats
    shaft_loss: Floats
    frame_loss: Floats
    doubtful: Integers


class _Piece(NamedTuple):
    begin: int
    end: int

    @property
    def size(self) -> int:
        return self.end - self.begin


def forced_response(
    system: ShaftSystem,
    orders: Any,
    speed: Any,
    throws: Sequence[int],
    torque: Any,
    mass_torque: Any = 0.0,
    *,
    wanted: Sequence[str] = ("angle", "torque"),
    twist: Sequence[tuple[int, int]] = (),
    period: float = 4.0 * math.pi,
    threads: int | None = 1,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Steady torsional vibration under the orders of torques on some discs.

    The designs of `system`, `speed` and the axes of the torques before (throw, order) broadcast;
    `...` below is the shape of all of them.

    Parameters
    ----------
    system : ShaftSystem
        The shafts.
    orders : array_like
        nu, above 0, along one axis.
    speed : array_like
        omega of the crank [rad/s], above 0.
    throws : sequence of int
        Disc on which each torque acts.
    torque : array_like of complex
        Harmonics of the torque on each of them [N m], shape (..., T, orders), of
        `forces.harmonics.of_throws`.
    mass_torque : array_like of complex
        The part that grows with the square of the speed, over omega^2 [kg m2]; it is added.
    wanted : sequence of str
        Names of `RESULTS`.
    twist : sequence of (int, int)
        Pairs of discs for `twist_extremes`: second less first.
    period : float
        Angle of the cycle [rad], for extremes.
    threads : int, optional
        Largest number of threads; None: one for each processor.
    progress : callable, optional
        Is told numbers of cases done.

    Returns
    -------
    dict
        What was wanted, and "status", shape (...): `no_steady_state` where an order meets a
        natural frequency of an undamped system. Results of that order, and extremes and losses of
        the case, are then NaN.

    Raises
    ------
    ValueError
        One line: an unknown name, or numbers that do not fit.
    """
    unknown = [name for name in wanted if name not in RESULTS]
    if unknown:
        raise ValueError(f"wanted: {unknown[0]!r}: must be of {', '.join(RESULTS)}")
    nu = checked_orders(orders)
    omega = given_array("speed", speed, finite=True)
    if not (omega > 0.0).all():
        raise ValueError(f"speed: {omega[~(omega > 0.0)].flat[0]:g}: must be above 0")
    discs = system.node_of_disc.size
    for name, numbers in (("throws", throws), ("twist", np.ravel(twist))):
        outside = [number for number in numbers if number not in range(discs)]
        if outside:
            raise ValueError(f"{name}: {outside[0]}: must be a disc, from 0 to {discs - 1}")
    gas = _torques("torque", torque, len(throws), nu.size)
    mass = _torques("mass_torque", mass_torque, len(throws), nu.size)
    shape = np.broadcast_shapes(system.shape, omega.shape, gas.shape[:-3], mass.shape[:-3])
    at_throws = np.asarray(throws, dtype=np.int64)
    ratio = _lines(system.ratio)
    cases = _Cases(
        _numbers(system.shape, shape), _numbers(gas.shape[:-3], shape),
        _numbers(mass.shape[:-3], shape), np.broadcast_to(omega, shape).flatten(),
        system.node_of_disc[at_throws], np.ascontiguousarray(ratio[:, at_throws]),
        gas.reshape(-1, *gas.shape[-3:]), mass.reshape(-1, *mass.shape[-3:]), nu,
    )  # fmt: skip
    tree = _Tree(system.parent, *(_lines(getattr(system, name)) for name in _Tree._fields[1:]))
    places = _Places(
        system.node_of_disc, ratio, system.node_of_shaft, _lines(system.shaft_factor),
        np.asarray(twist, dtype=np.int64).reshape(-1, 2),
    )  # fmt: skip
    extremes = any(name.endswith("extremes") for name in wanted)
    table = synthesis(nu if extremes else nu[:0], period)
    count, shafts = cases.speed.size, system.node_of_shaft.size
    sizes = {
        "angle": (discs, nu.size, 2), "torque": (shafts, nu.size, 2), "angle_extremes": (discs, 3),
        "torque_extremes": (shafts, 3), "twist_extremes": (len(places.pairs), 3),
        "shaft_loss": (shafts,), "frame_loss": (),
    }  # fmt: skip
    found = _Found(
        *(np.empty((count if name in wanted else 0, *size)) for name, size in sizes.items()),
        np.zeros(count, dtype=np.int64),
    )
    which, none = np.arange(count), np.empty((0, system.parent.size, 2, nu.size))

    def solve(piece: _Piece) -> None:
        some = which[piece.begin : piece.end]
        _respond(some, none, tree, cases, places, table, found)

    pieces = (_Piece(i, min(i + AT_ONCE, count)) for i in range(0, count, AT_ONCE))
    run_on_threads(pieces, solve, threads or os.cpu_count() or 1, progress)
    status = np.full(count, CONVERGED, dtype=np.int8)
    for case in np.flatnonzero(found.doubtful):
        known, resonant = _with_pivoting(tree, cases, int(case))
        status[case] = NO_STEADY_STATE if resonant else CONVERGED
        _respond(which[case : case + 1], known, tree, cases, places, table, found)
    results: dict[str, Any] = {"status": status.reshape(shape)}
    for name in wanted:
        values = getattr(found, name)
        values = values.view(np.complex128)[..., 0] if name in ("angle", "torque") else values
        results[name] = values.reshape(*shape, *values.shape[1:])
    return results


def _torques(name: str, given: Any, throws: int, orders: int) -> Floats:
    """Real and imaginary parts, shape (..., T, 2, V)."""
    values = np.asarray(given, dtype=np.complex128)
    if values.ndim == 0 and values == 0.0:
        values = np.zeros((throws, orders), dtype=np.complex128)
    if values.shape[-2:] != (throws, orders):
        raise ValueError(
            f"{name}: shape {values.shape}: must end with {throws} throws and {orders} orders"
        )
    return np.stack([values.real, values.imag], axis=-2)


def _lines(values: Floats) -> Floats:
    """Designs along one axis."""
    return np.ascontiguousarray(values.reshape(-1, values.shape[-1]))


def _numbers(own: tuple[int, ...], shape: tuple[int, ...]) -> Integers:
    """Line of each case in a table over the axes `own`."""
    lines = np.arange(math.prod(own)).reshape(own)
    return np.broadcast_to(lines, shape).flatten()


@kernel
def _respond(
    which: Integers, known: Floats, tree: _Tree, cases: _Cases, places: _Places, table: Synthesis,
    found: _Found,
) -> None:  # fmt: skip
    """Solve some cases, or, with angles of the nodes in `known`, derive results from these."""
    nodes, orders = tree.parent.size, cases.orders.size
    angle, twist, stiff = (
        np.empty((nodes, 2, orders)), np.empty((nodes, 2, orders)), np.empty((nodes, 2, orders)),
    )  # fmt: skip
    w, lost, one = np.empty(orders), np.empty(orders), np.empty((2, orders))
    sums, curve = np.empty((6, table.cosine.shape[1])), np.empty(4 * table.cosine.shape[1] + 2)
    for number in range(which.size):
        case = which[number]
        for v in range(orders):
            w[v] = cases.orders[v] * cases.speed[case]
            lost[v] = 0.0
        _set_up(case, w, tree, cases, angle, twist, stiff)
        if known.shape[0] > 0:
            for node in range(nodes):
                parent = max(tree.parent[node], 0)
                for part in range(2):
                    for v in range(orders):
                        angle[node, part, v] = known[number, node, part, v]
                        twist[node, part, v] = (
                            known[number, node, part, v] - known[number, parent, part, v]
                        )
        else:
            _eliminate(tree.parent, angle, twist, stiff, lost)
            for v in range(orders):
                if lost[v] > 0.0:
                    found.doubtful[case] = 1
        _of_discs(case, w, tree, cases, places, angle, one, table, sums, curve, found)
        _of_shafts(case, w, cases, places, twist, stiff, one, table, sums, curve, found)


@inlined
def _set_up(
    case: int, w: Floats, tree: _Tree, cases: _Cases, dynamic: Floats, torque: Floats, stiff: Floats
) -> None:
    """Z and U of each node, and k* of the shaft to its parent."""
    design, square = cases.design[case], cases.speed[case] ** 2
    for node in range(tree.parent.size):
        inertia, ground = tree.inertia[design, node], tree.ground_stiffness[design, node]
        own, damping = tree.disc_damping[design, node], tree.damping[design, node]
        stiffness = tree.stiffness[design, node] + square * tree.speed_stiffness[design, node]
        loss = tree.loss_factor[design, node] * stiffness
        z, u, k = dynamic[node], torque[node], stiff[node]
        for v in range(w.size):
            z[0, v] = ground - w[v] * w[v] * inertia
            z[1, v] = w[v] * own
            k[0, v] = stiffness
            k[1, v] = loss + w[v] * damping
            u[0, v] = u[1, v] = 0.0
    gas, mass = cases.gas_line[case], cases.mass_line[case]
    for throw in range(cases.throw_node.size):
        u, ratio = torque[cases.throw_node[throw]], cases.throw_ratio[design, throw]
        for part in range(2):
            for v in range(w.size):
                u[part, v] += ratio * (
                    cases.gas[gas, throw, part, v] + square * cases.mass[mass, throw, part, v]
                )


@inlined
def _eliminate(
    parents: Integers, dynamic: Floats, torque: Floats, stiff: Floats, lost: Floats
) -> None:
    """Turn Z into the angle of each node, and U into its twist against the parent.

    On the way up, Z becomes Z/(k* + Z), and U becomes U/(k* + Z). `lost` is set for orders that
    lost digits.
    """
    orders = lost.size
    scale = stiff[0, 0]  # nothing is above the root: sum of the squares of what adds up there
    for v in range(orders):
        scale[v] = dynamic[0, 0, v] ** 2 + dynamic[0, 1, v] ** 2
    for node in range(parents.size - 1, 0, -1):
        z, u, k = dynamic[node], torque[node], stiff[node]
        for v in range(orders):
            a, b = k[0, v] + z[0, v], k[1, v] + z[1, v]
            square = a * a + b * b
            terms = k[0, v] ** 2 + k[1, v] ** 2 + z[0, v] ** 2 + z[1, v] ** 2
            lost[v] += 1.0 if square < SMALL**2 * terms else 0.0
            over = 1.0 / square
            x, y = (z[0, v] * a + z[1, v] * b) * over, (z[1, v] * a - z[0, v] * b) * over
            p, q = (u[0, v] * a + u[1, v] * b) * over, (u[1, v] * a - u[0, v] * b) * over
            z[0, v], z[1, v], u[0, v], u[1, v] = x, y, p, q
        above, force = dynamic[parents[node]], torque[parents[node]]
        for v in range(orders):
            above[0, v] += k[0, v] * z[0, v] - k[1, v] * z[1, v]
            above[1, v] += k[0, v] * z[1, v] + k[1, v] * z[0, v]
            force[0, v] += k[0, v] * u[0, v] - k[1, v] * u[1, v]
            force[1, v] += k[0, v] * u[1, v] + k[1, v] * u[0, v]
        if parents[node] == 0:
            for v in range(orders):
                scale[v] += (k[0, v] ** 2 + k[1, v] ** 2) * (z[0, v] ** 2 + z[1, v] ** 2)
    z, u = dynamic[0], torque[0]
    for v in range(orders):
        over = 1.0 / (z[0, v] ** 2 + z[1, v] ** 2)
        lost[v] += 1.0 if over * scale[v] > SMALL**-2 else 0.0
        x = (u[0, v] * z[0, v] + u[1, v] * z[1, v]) * over
        y = (u[1, v] * z[0, v] - u[0, v] * z[1, v]) * over
        z[0, v], z[1, v] = x, y
        u[0, v] = u[1, v] = 0.0
    for node in range(1, parents.size):
        z, u, above = dynamic[node], torque[node], dynamic[parents[node]]
        for v in range(orders):
            u[0, v] -= z[0, v] * above[0, v] - z[1, v] * above[1, v]
            u[1, v] -= z[0, v] * above[1, v] + z[1, v] * above[0, v]
            z[0, v] = above[0, v] + u[0, v]
            z[1, v] = above[1, v] + u[1, v]


@inlined
def _of_discs(
    case: int, w: Floats, tree: _Tree, cases: _Cases, places: _Places, angle: Floats, one: Floats,
    table: Synthesis, sums: Floats, curve: Floats, found: _Found,
) -> None:  # fmt: skip
    """Results of the discs, from the angles of the nodes."""
    design = cases.design[case]
    if found.angle.size + found.angle_extremes.size:
        for disc in range(places.node_of_disc.size):
            node, ratio = places.node_of_disc[disc], places.ratio[design, disc]
            for part in range(2):
                for v in range(w.size):
                    one[part, v] = ratio * angle[node, part, v]
            if found.angle.size:
                for v in range(w.size):
                    found.angle[case, disc, v, 0] = one[0, v]
                    found.angle[case, disc, v, 1] = one[1, v]
            if found.angle_extremes.size:
                extremes_of(one[0], one[1], table, sums, curve, found.angle_extremes[case, disc])
    if found.frame_loss.size:
        found.frame_loss[case] = 0.0
        for node in range(angle.shape[0]):
            loss = 0.0
            for v in range(w.size):
                loss += w[v] ** 2 * (angle[node, 0, v] ** 2 + angle[node, 1, v] ** 2)
            found.frame_loss[case] += 0.5 * tree.disc_damping[design, node] * loss
    for number in range(places.pairs.shape[0] if found.twist_extremes.size else 0):
        first, second = places.pairs[number, 0], places.pairs[number, 1]
        back, forth = places.ratio[design, first], places.ratio[design, second]
        start, end = places.node_of_disc[first], places.node_of_disc[second]
        for part in range(2):
            for v in range(w.size):
                one[part, v] = forth * angle[end, part, v] - back * angle[start, part, v]
        extremes_of(one[0], one[1], table, sums, curve, found.twist_extremes[case, number])


@inlined
def _of_shafts(
    case: int, w: Floats, cases: _Cases, places: _Places, twist: Floats, stiff: Floats, one: Floats,
    table: Synthesis, sums: Floats, curve: Floats, found: _Found,
) -> None:  # fmt: skip
    """Results of the shafts, from the twist of each node against its parent."""
    design = cases.design[case]
    if found.torque.size + found.torque_extremes.size + found.shaft_loss.size == 0:
        return
    for shaft in range(places.node_of_shaft.size):
        node, factor = places.node_of_shaft[shaft], places.factor[design, shaft]
        k, turned = stiff[node], twist[node]
        for v in range(w.size):
            one[0, v] = factor * (k[0, v] * turned[0, v] - k[1, v] * turned[1, v])
            one[1, v] = factor * (k[0, v] * turned[1, v] + k[1, v] * turned[0, v])
        if found.torque.size:
            for v in range(w.size):
                found.torque[case, shaft, v, 0] = one[0, v]
                found.torque[case, shaft, v, 1] = one[1, v]
        if found.torque_extremes.size:
            extremes_of(one[0], one[1], table, sums, curve, found.torque_extremes[case, shaft])
        if found.shaft_loss.size:
            loss = 0.0
            for v in range(w.size):
                loss += w[v] * k[1, v] * (turned[0, v] ** 2 + turned[1, v] ** 2)
            found.shaft_loss[case, shaft] = 0.5 * loss


def _with_pivoting(tree: _Tree, cases: _Cases, case: int) -> tuple[Floats, bool]:
    """Angles of the nodes of a case, shape (1, M, 2, V), and whether an order meets a resonance.

    B = J^(-1/2) (K* + i w C - w^2 J) J^(-1/2)/w^2 has the eigenvalues omega_m^2/w^2 - 1 if nothing
    damps: of one that is nothing but rounding, there is no steady state.
    """
    design, speed = cases.design[case], cases.speed[case]
    inertia, own, ground, stiffness, eta, damping, following = (line[design] for line in tree[1:])
    parts = cases.gas[cases.gas_line[case]] + speed**2 * cases.mass[cases.mass_line[case]]
    forces = cases.throw_ratio[design][:, None] * (parts[:, 0] + 1j * parts[:, 1])
    nodes, orders = inertia.size, cases.orders.size
    found = np.full((1, nodes, 2, orders), np.nan)
    resonant = False
    for v, w in enumerate(cases.orders * speed):
        stiff = (stiffness + speed**2 * following) * (1.0 + 1j * eta) + 1j * w * damping
        matrix = np.diag(ground - w**2 * inertia + 1j * w * own)
        for node, parent in enumerate(tree.parent[1:].tolist(), 1):
            ends = np.array([node, parent])
            matrix[np.ix_(ends, ends)] += stiff[node] * np.array([[1.0, -1.0], [-1.0, 1.0]])
        scale = w * np.sqrt(inertia)
        sizes = np.abs(np.linalg.eigvals(matrix / (scale[:, None] * scale)))
        if sizes.min() <= max(NEAR_RESONANCE, 4.0 * np.finfo(float).eps * sizes.max()):
            resonant = True
            continue
        force = np.zeros(nodes, dtype=np.complex128)
        np.add.at(force, cases.throw_node, forces[:, v])
        solved = np.linalg.solve(matrix, force)
        found[0, :, 0, v], found[0, :, 1, v] = solved.real, solved.imag
    return found, resonant


def misfiring(torque: Any, change: Any, throws: Sequence[int]) -> Complexes:
    """Torques on the throws with each cylinder misfiring in turn, for `forced_response`.

    The response is linear in the torques, so these are just more of them: the elimination of one
    more right-hand side costs as much as to superpose the unit responses of the throws.

    Parameters
    ----------
    torque : array_like of complex
        Harmonics on each throw with all cylinders firing, shape (..., T, orders).
    change : array_like of complex
        Harmonics of each cylinder's motored torque less its firing torque, shape (..., Z, orders).
    throws : sequence of int
        Number of the throw of each cylinder, from 0.

    Returns
    -------
    ndarray of complex, shape (..., Z, T, orders)
    """
    each = np.asarray(change, dtype=np.complex128)
    at = np.eye(np.shape(torque)[-2])[np.asarray(throws)]  # (Z, T)
    return np.asarray(np.asarray(torque)[..., None, :, :] + at[..., None] * each[..., None, :])


def largest_order(harmonics: Any, orders: Any, speed: Any = None) -> tuple[Any, ...]:
    """Largest amplitude of a single order, and that order; with speeds, the largest over them too.

    Parameters
    ----------
    harmonics : array_like of complex
        Orders along the last axis; with `speed`, the speeds along the first. NaN is left out.
    orders : array_like
        nu.
    speed : array_like, optional
        Speeds of the first axis [rad/s].

    Returns
    -------
    tuple of ndarray
        Amplitude, order and, with `speed`, the speed.
    """
    size = np.abs(np.asarray(harmonics))
    known = np.where(np.isnan(size), -1.0, size)
    if speed is not None:
        known = np.moveaxis(known, 0, -2).reshape(*known.shape[1:-1], -1)
    place = known.argmax(axis=-1)
    most = np.take_along_axis(known, place[..., None], axis=-1)[..., 0]
    most = np.where(most < 0.0, np.nan, most)
    at_order = np.asarray(orders)[place % np.size(orders)]
    if speed is None:
        return most, at_order
    return most, at_order, np.asarray(speed)[place // np.size(orders)]
