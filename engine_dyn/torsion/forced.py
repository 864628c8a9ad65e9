r"""Steady response of a shaft system to each order of the torques, by elimination along the tree.

For each order nu, with w = nu omega, node i has the dynamic stiffness Z_i = g - w^2 J + i w c and
the torque U_i. Its parent p, over k* = k (1 + i eta) + i w c_r, feels

    theta_i = (U_i + k* theta_p)/(k* + Z_i),
    Z_p += k* Z_i/(k* + Z_i),        U_p += k* U_i/(k* + Z_i),

stiffnesses in series. From the ends to the root, theta_0 = U_0/Z_0, and back with the twist

    theta_i - theta_p = (U_i - Z_i theta_p)/(k* + Z_i).

Holzer's table in complex numbers, for trees, without modes and without assumptions on damping.
Neither form subtracts what is nearly equal: stiff shafts cost no digits. Where k* + Z_i = 0, a
branch alone resonates and holds its parent, though the system does not resonate: an undamped
absorber at its own frequency, a pendulum at its own order. It is then detuned by `DETUNED`, and its
parent turns by as little. That costs no digits elsewhere, unless torques act on the branch. Such
cases are rare; they are solved again in modes, each of which keeps its own digits (`graded`). An
undamped system at a natural frequency has no steady state, and that is its status.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.given_numbers import given_array
from engine_dyn.speed.mechanisms import Progress, map_on_threads
from engine_dyn.status import CONVERGED, NO_STEADY_STATE
from engine_dyn.torsion.modes import checked_orders, coordinates
from engine_dyn.torsion.synthesis import Synthesis, extremes_of, synthesis
from engine_dyn.torsion.system import ShaftSystem, along_one_axis
from engine_dyn.types import Booleans, Floats, Integers

RESULTS = {
    "angle": "harmonics of the angle of each disc [rad], (..., N, orders)",
    "torque": "harmonics of the torque in each shaft [N m], (..., S, orders)",
    "angle_extremes": "least and largest angle of each disc over the cycle, bound on the error of "
    "both [rad], (..., N, 3)",
    "torque_extremes": "the same of the torque in each shaft [N m], (..., S, 3)",
    "twist_extremes": "the same of the angle between the discs of each pair [rad], (..., P, 3)",
    "speed_extremes": "the same of the speed of each disc of `speed_of`, over that of the crank, "
    "without its mean [1], (..., D, 3)",
    "shaft_loss": "mean power lost in each shaft, coupling or damper [W], (..., S)",
    "frame_loss": "mean power lost between all discs and the frame [W], (...)",
}
"""Results that can be asked for, by name."""

DETUNED = 1e-12  # Smallest |k* + Z| over (|k*|^2 + |Z|^2)^(1/2); nearer to 0 it is raised

# Where |k* + Z| is below this fraction of (|k*|^2 + |Z|^2)^(1/2), the sum has lost six digits by
# cancellation, which matters where torques act on what is behind the shaft
SMALL = 1e-6

AT_ONCE, FEW = 1024, 64  # Numbers of cases that a thread takes at once, and in modes


class _Tree(NamedTuple):
    """Tree of nodes with referred values, shape (designs, M); node 0 is the root.

    Kernels take the nodes from `nodes`, not from a range: LLVM from 17 on would test once for all
    nodes whether rows of arrays overlap, find that they do, and compute order by order, which takes
    twice as long.
    """

    nodes: Integers
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

    The torque of a case is the sum over its parts P of factor (cases, P) times the harmonics at
    line (cases, P) of `harmonics` (lines, T, 2, V), real and imaginary parts. `throw_ratio`,
    (designs, T), refers it to the crank. Harmonics of the results are of the orders at `kept`.
    """

    design: Integers
    speed: Floats
    throw_node: Integers
    throw_ratio: Floats
    line: Integers
    factor: Floats
    harmonics: Floats
    orders: Floats
    kept: Integers


class _Signals(NamedTuple):
    """Results that are wanted of a case, as lines of harmonics: first angles, then torques.

    An angle is the second node's, times its ratio, less the first's; `ratios` has the shape
    (designs, A, 2). From line `speeds` on, speeds are wanted too. A torque is that of the shaft
    above a node, times its factor. `stored` and `swung` are lines of which harmonics and extremes
    are wanted.
    """

    nodes: Integers
    ratios: Floats
    speeds: int
    shafts: Integers
    factor: Floats
    stored: Integers
    swung: Integers


class _Found(NamedTuple):
    """Results, empty where not asked for; `doubtful` marks cases that lost digits."""

    harmonics: Floats
    extremes: Floats
    shaft_loss: Floats
    frame_loss: Floats
    doubtful: Integers


def forced_response(
    system: ShaftSystem,
    orders: Any,
    speed: Any,
    throws: Sequence[int],
    torque: Any,
    factors: Sequence[Any] | None = None,
    *,
    wanted: Sequence[str] = ("angle", "torque"),
    twist: Sequence[tuple[int, int]] = (),
    speed_of: Sequence[int] = (),
    kept: Any = None,
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
        `forces.harmonics.of_throws`. What is NaN gives NaN.
    factors : sequence of array_like, optional
        With them, `torque` is a sequence of as many such arrays, whose sum acts, each times its
        factor: designs that share harmonics keep one copy of these.
    wanted : sequence of str
        Names of `RESULTS`.
    twist : sequence of (int, int)
        Pairs of discs for `twist_extremes`: second less first.
    speed_of : sequence of int
        Discs for `speed_extremes`.
    kept : array_like of int, optional
        Places of the orders that "angle" and "torque" have; all, unless given. All orders enter
        extremes and losses.
    period : float
        Angle of the cycle [rad], for extremes.
    threads : int, optional
        Largest number of threads; None: one for each processor.
    progress : callable, optional
        Is told numbers of cases done.

    Returns
    -------
    dict
        The results that were wanted, and "status", shape (...): `no_steady_state` where an order
        meets a natural frequency of an undamped system. Results of that order, and extremes and
        losses of the case, are then NaN.

    Raises
    ------
    ValueError
        One line: an unknown name, or numbers that do not fit.
    """
    unknown = [name for name in wanted if name not in RESULTS]
    if unknown:
        raise ValueError(f"wanted: {unknown[0]!r}: must be of {', '.join(RESULTS)}")
    discs = system.node_of_disc.size
    for name, numbers in (("throws", throws), ("twist", np.ravel(twist))):
        outside = [number for number in numbers if number not in range(discs)]
        if outside:
            raise ValueError(f"{name}: {outside[0]}: must be a disc, from 0 to {discs - 1}")
    cases, shape = _cases(system, orders, speed, throws, torque, factors, kept)
    designs = system.along_one_axis()
    tree = _Tree(
        np.arange(designs.parent.size), *(getattr(designs, name) for name in _Tree._fields[1:])
    )
    signals, lines = _signals(system, wanted, twist, speed_of)
    table = synthesis(cases.orders[: None if signals.swung.size else 0], period)
    count, orders = cases.speed.size, cases.orders.size
    responses = _Found(
        np.empty((count, signals.stored.size, cases.kept.size, 2)),
        np.empty((count, signals.swung.size, 3)),
        np.empty((count if "shaft_loss" in wanted else 0, system.node_of_shaft.size)),
        np.empty(count if "frame_loss" in wanted else 0),
        np.zeros(count, dtype=np.int64),
    )
    which, none = np.arange(count), np.empty((0, 2, system.parent.size, 2, orders))

    modal = bool(system.modal_damping.shape[-1])
    resonant = np.zeros(count, dtype=bool)

    def solve(some: Integers, by_modes: bool = modal) -> int:
        known = none
        if by_modes:
            known, resonant[some] = _in_modes(designs, cases, some)
        _respond(some, known, tree, cases, signals, table, responses)
        return some.size

    at_once = FEW if modal else AT_ONCE
    pieces = (which[i : i + at_once] for i in range(0, count, at_once))
    for done in map_on_threads(solve, pieces, threads):
        if progress:
            progress(done)
    doubtful = np.flatnonzero(responses.doubtful)
    for i in range(0, doubtful.size, FEW):
        solve(doubtful[i : i + FEW], by_modes=True)
    status = np.where(resonant, NO_STEADY_STATE, CONVERGED).astype(np.int8)
    results: dict[str, Any] = {"status": status.reshape(shape)}
    values: Any
    for name in wanted:
        if name == "shaft_loss":
            values = responses.shaft_loss[:, system.node_of_shaft - 1]
        elif name == "frame_loss":
            values = responses.frame_loss
        elif name.endswith("extremes"):
            values = responses.extremes[:, lines[name]]
        else:
            values = responses.harmonics[:, lines[name]].view(np.complex128)[..., 0]
        results[name] = values.reshape((*shape, *values.shape[1:]))
    return results


def _cases(
    system: ShaftSystem, orders: Any, speed: Any, throws: Sequence[int], torque: Any,
    factors: Sequence[Any] | None, kept: Any,
) -> tuple[_Cases, tuple[int, ...]]:  # fmt: skip
    """All cases, and the shape of the axes over which they vary."""
    nu = checked_orders(orders)
    omega = given_array("speed", speed, finite=True)
    if not (omega > 0.0).all():
        raise ValueError(f"speed: {omega[~(omega > 0.0)].flat[0]:g}: must be above 0")
    each = [torque] if factors is None else torque
    parts = [_torques(part, len(throws), nu.size) for part in each]
    scales = [given_array("factors", factor) for factor in factors or (1.0,)]
    if len(scales) != len(parts):
        raise ValueError(f"factors: {len(scales)}: must be as many as torques, {len(parts)}")
    axes = (a.shape[: a.ndim - own] for own, some in ((3, parts), (0, scales)) for a in some)
    shape = np.broadcast_shapes(system.shape, omega.shape, *axes)
    at_throws = np.asarray(throws, dtype=np.int64)
    tables = [along_one_axis(part, 3) for part in parts]
    first = np.cumsum([0, *(len(table) for table in tables)])
    lines = [lines_of(p.shape[:-3], shape) + i for p, i in zip(parts, first[:-1], strict=True)]
    return _Cases(
        lines_of(system.shape, shape), np.broadcast_to(omega, shape).flatten(),
        system.node_of_disc[at_throws], along_one_axis(system.ratio[..., at_throws]),
        np.stack(lines, axis=-1),
        np.stack([np.broadcast_to(scale, shape).flatten() for scale in scales], axis=-1),
        np.concatenate(tables), nu,
        np.arange(nu.size) if kept is None else np.asarray(kept, dtype=np.int64),
    ), shape  # fmt: skip


def _signals(
    system: ShaftSystem,
    wanted: Sequence[str],
    twist: Sequence[tuple[int, int]],
    speed_of: Sequence[int],
) -> tuple[_Signals, dict[str, slice]]:
    """Lines of harmonics that results need, and the place of each result among its kind."""
    discs, ratio = system.node_of_disc, along_one_axis(system.ratio)
    pairs = np.asarray(twist, dtype=np.int64).reshape(-1, 2)
    turning = np.asarray(speed_of, dtype=np.int64)
    sizes = {
        "angle": discs.size, "twist": len(pairs), "speed": turning.size,
        "torque": system.node_of_shaft.size,
    }  # fmt: skip
    sizes = {
        kind: size if {kind, f"{kind}_extremes"} & set(wanted) else 0
        for kind, size in sizes.items()
    }
    alone = [np.arange(sizes["angle"]), turning[: sizes["speed"]]]
    own, moving = (np.repeat(some[:, None], 2, axis=1) for some in alone)
    ends = np.concatenate([own, pairs[: sizes["twist"]], moving])
    ratios = ratio[:, ends]
    ratios[:, : len(own), 0] = ratios[:, len(ends) - len(moving) :, 0] = 0.0
    first = dict(zip(sizes, np.cumsum([0, *sizes.values()]).tolist(), strict=False))
    kinds: tuple[list[int], list[int]] = [], []
    places = {}
    for name in wanted:
        kind = name.removesuffix("_extremes")
        if kind in sizes:
            lines = kinds[name != kind]
            places[name] = slice(len(lines), len(lines) + sizes[kind])
            lines += range(first[kind], first[kind] + sizes[kind])
    stored, swung = (np.array(lines, dtype=np.int64) for lines in kinds)
    shafts = system.node_of_shaft[: sizes["torque"]]
    return _Signals(
        discs[ends], np.ascontiguousarray(ratios), first["speed"], shafts,
        along_one_axis(system.shaft_factor), stored, swung,
    ), places  # fmt: skip


def _torques(given: Any, throws: int, orders: int) -> Floats:
    """Real and imaginary parts of given torques, shape (..., T, 2, V)."""
    values = np.asarray(given, dtype=np.complex128)
    if values.shape[-2:] != (throws, orders):
        raise ValueError(
            f"torque: shape {values.shape}: must end with {throws} throws and {orders} orders"
        )
    return np.stack([values.real, values.imag], axis=-2)


def lines_of(own: tuple[int, ...], shape: tuple[int, ...]) -> Integers:
    """Line of each case in a table over the axes `own`."""
    lines = np.arange(math.prod(own)).reshape(own)
    return np.broadcast_to(lines, shape).flatten()


@kernel
def _respond(
    which: Integers, known: Floats, tree: _Tree, cases: _Cases, signals: _Signals,
    table: Synthesis, results: _Found,
) -> None:  # fmt: skip
    """Solve some cases; or derive results from known angles and twists of the nodes in `known`."""
    nodes, orders, quarter = tree.parent.size, cases.orders.size, table.quarters[-1]
    w, lost = np.empty(orders), np.empty(orders)
    angle, twist = np.empty((nodes, 2, orders)), np.empty((nodes, 2, orders))
    stiff = np.empty((nodes, 2, orders))
    lines = np.empty((signals.nodes.shape[0] + signals.shafts.size, 2, orders))
    size, weight = np.empty(orders), np.empty(orders)
    sums = np.empty((6, quarter))
    for number in range(which.size):
        case = which[number]
        design = cases.design[case]
        for v in range(orders):
            w[v] = cases.orders[v] * cases.speed[case]
            lost[v] = 0.0
        _set_up(case, w, tree, cases, angle, twist, stiff)
        if known.shape[0] == 0:
            _eliminate(tree, angle, twist, stiff, lost)
            for v in range(orders):
                if lost[v] > 0.0:
                    results.doubtful[case] = 1
        else:
            angle[:], twist[:] = known[number, 0], known[number, 1]
        _to_lines(design, signals, cases.orders, angle, twist, stiff, lines)
        for i in range(signals.stored.size):
            line = lines[signals.stored[i]]
            for v in range(cases.kept.size):
                results.harmonics[case, i, v, 0] = line[0, cases.kept[v]]
                results.harmonics[case, i, v, 1] = line[1, cases.kept[v]]
        for i in range(signals.swung.size):
            line = lines[signals.swung[i]]
            extremes_of(line[0], line[1], table, size, weight, sums, results.extremes[case, i])
        if results.shaft_loss.size > 0:
            for shaft in range(results.shaft_loss.shape[1]):
                k, turned, loss = stiff[shaft + 1], twist[shaft + 1], 0.0
                for v in range(orders):
                    loss += w[v] * k[1, v] * (turned[0, v] ** 2 + turned[1, v] ** 2)
                results.shaft_loss[case, shaft] = 0.5 * loss
        if results.frame_loss.size > 0:
            total = 0.0
            for node in tree.nodes:
                loss = 0.0
                for v in range(orders):
                    loss += w[v] ** 2 * (angle[node, 0, v] ** 2 + angle[node, 1, v] ** 2)
                total += 0.5 * tree.disc_damping[design, node] * loss
            results.frame_loss[case] = total


@inlined
def _set_up(
    case: int, w: Floats, tree: _Tree, cases: _Cases, dynamic: Floats, torque: Floats, stiff: Floats
) -> None:
    """Fill in impedance Z and torque U of nodes, and stiffness k* of shafts to the parents."""
    design, square = cases.design[case], cases.speed[case] ** 2
    for node in tree.nodes:
        inertia, ground = tree.inertia[design, node], tree.ground_stiffness[design, node]
        own, damping = tree.disc_damping[design, node], tree.damping[design, node]
        stiffness = tree.stiffness[design, node] + square * tree.speed_stiffness[design, node]
        loss = tree.loss_factor[design, node] * stiffness
        z, k = dynamic[node], stiff[node]
        k[0, :], torque[node] = stiffness, 0.0
        for v in range(w.size):
            z[0, v] = ground - w[v] * w[v] * inertia
            z[1, v] = w[v] * own
            k[1, v] = loss + w[v] * damping
    for which in range(cases.line.shape[1]):
        harmonics = cases.harmonics[cases.line[case, which]]
        for throw in range(cases.throw_node.size):
            u = torque[cases.throw_node[throw]]
            scale = cases.throw_ratio[design, throw] * cases.factor[case, which]
            for part in range(2):
                for v in range(w.size):
                    u[part, v] += scale * harmonics[throw, part, v]


@inlined
def _eliminate(tree: _Tree, dynamic: Floats, torque: Floats, stiff: Floats, lost: Floats) -> None:
    """Turn Z into the angle of each node, and U into its twist against the parent.

    On the way up, Z becomes Z/(k* + Z), and U becomes U/(k* + Z). `lost` marks orders that lost
    digits.
    """
    orders = lost.size
    scale = stiff[0, 0]  # sum of squares of all terms of the root's Z; its k* is not needed
    for v in range(orders):
        scale[v] = dynamic[0, 0, v] ** 2 + dynamic[0, 1, v] ** 2
    for node in tree.nodes[:0:-1]:
        z, u, k = dynamic[node], torque[node], stiff[node]
        for v in range(orders):
            a, b = k[0, v] + z[0, v], k[1, v] + z[1, v]
            square = a * a + b * b
            terms = k[0, v] ** 2 + k[1, v] ** 2 + z[0, v] ** 2 + z[1, v] ** 2
            lost[v] += u[0, v] ** 2 + u[1, v] ** 2 if square < SMALL**2 * terms else 0.0
            held = square < DETUNED**2 * terms
            a = DETUNED * (k[0, v] + k[1, v]) if held else a
            b = 0.0 if held else b
            over = 1.0 / (a * a + b * b)
            x, y = (z[0, v] * a + z[1, v] * b) * over, (z[1, v] * a - z[0, v] * b) * over
            p, q = (u[0, v] * a + u[1, v] * b) * over, (u[1, v] * a - u[0, v] * b) * over
            z[0, v], z[1, v], u[0, v], u[1, v] = x, y, p, q
        above, force = dynamic[tree.parent[node]], torque[tree.parent[node]]
        for v in range(orders):
            above[0, v] += k[0, v] * z[0, v] - k[1, v] * z[1, v]
            above[1, v] += k[0, v] * z[1, v] + k[1, v] * z[0, v]
            force[0, v] += k[0, v] * u[0, v] - k[1, v] * u[1, v]
            force[1, v] += k[0, v] * u[1, v] + k[1, v] * u[0, v]
        if tree.parent[node] == 0:
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
    for node in tree.nodes[1:]:
        z, u, above = dynamic[node], torque[node], dynamic[tree.parent[node]]
        for v in range(orders):
            u[0, v] -= z[0, v] * above[0, v] - z[1, v] * above[1, v]
            u[1, v] -= z[0, v] * above[1, v] + z[1, v] * above[0, v]
            z[0, v] = above[0, v] + u[0, v]
            z[1, v] = above[1, v] + u[1, v]


@inlined
def _to_lines(
    design: int, signals: _Signals, nu: Floats, angle: Floats, twist: Floats, stiff: Floats,
    lines: Floats,
) -> None:  # fmt: skip
    """Fill in the harmonics of the requested angles, speeds and torques."""
    angles, orders = signals.nodes.shape[0], lines.shape[2]
    for i in range(angles):
        start, end, line = angle[signals.nodes[i, 0]], angle[signals.nodes[i, 1]], lines[i]
        back, forth = signals.ratios[design, i, 0], signals.ratios[design, i, 1]
        for part in range(2):
            for v in range(orders):
                line[part, v] = forth * end[part, v] - back * start[part, v]
        if i >= signals.speeds:
            for v in range(orders):
                line[0, v], line[1, v] = -nu[v] * line[1, v], nu[v] * line[0, v]
    for i in range(signals.shafts.size):
        k, turned, line = stiff[signals.shafts[i]], twist[signals.shafts[i]], lines[angles + i]
        factor = signals.factor[design, i]
        for v in range(orders):
            line[0, v] = factor * (k[0, v] * turned[0, v] - k[1, v] * turned[1, v])
            line[1, v] = factor * (k[0, v] * turned[1, v] + k[1, v] * turned[0, v])


def _in_modes(designs: ShaftSystem, cases: _Cases, some: Integers) -> tuple[Floats, Booleans]:
    """Angles and twists of the nodes, (cases, 2, M, 2, V), from all modes.

    Given damping of modes joins all nodes, which no elimination along the tree can. Besides,
    whether an order of a case meets an undamped mode.
    """
    design, speed = cases.design[some], cases.speed[some]
    modes = coordinates(designs.of(design), speed, spread=math.inf)
    w = cases.orders * speed[:, None]
    parts = np.einsum("cp,cptrv->ctrv", cases.factor[some], cases.harmonics[cases.line[some]])
    torque = cases.throw_ratio[design][..., None] * (parts[:, :, 0] + 1j * parts[:, :, 1])
    force = np.einsum("cmt,ctv->cvm", modes.angle[..., cases.throw_node], torque)
    impedance = modes.viscous[:, None] * (1j * w[..., None, None]) + 1j * modes.lost[:, None]
    places = np.arange(modes.omega.shape[-1])
    impedance[..., places, places] += modes.omega[:, None] ** 2 - w[..., None] ** 2
    least = np.abs(impedance[..., places, places])
    # Natural frequencies are known to some ten digits: nearer to one than that, and with a damping
    # as small, the amplitude has no bound.
    meets = (least <= 1e-9 * w[..., None] ** 2).any(axis=-1)
    impedance[meets] = np.eye(places.size)
    answer = np.linalg.solve(impedance, force[..., None])[..., 0]
    answer[meets] = np.nan
    known = [np.einsum("cvm,cmn->cnv", answer, of) for of in (modes.angle, modes.twist)]
    return np.stack([np.stack([one.real, one.imag], axis=-2) for one in known], axis=1), (
        meets.any(axis=-1)
    )
