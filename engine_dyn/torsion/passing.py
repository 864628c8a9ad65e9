r"""Largest torque in each shaft while the speed of the crank passes from one value to another.

The speed changes at a constant rate, omega(t) = omega_0 + alpha t, and order nu of the torques
acts as F_nu(omega(t)) exp(i nu phi(t)), phi' = omega. In the complex modes of the system, roots s,
its part of mode and order is Q(t) exp(i nu phi(t)) with

    Q' = -d(t) Q + G(t),    d = i nu omega(t) - s,    d' = i nu alpha.

Constant omega leaves the steady response G/d. While d changes slowly against itself, beta =
nu |alpha| << |d|^2, Q follows it as

    A = G/d + (G d' - G' d)/d^3 + (3 G d'^2 - 3 G' d' d + G'' d^2)/d^5,

and what a resonance leaves behind swings freely, X exp(-int d). Within |d|^2 < 25 beta, a step
h from u = -h/2 to h/2 around its middle, there with d_m, is exact for exp(-int d) and takes G(u)
exp(d' u^2/2) as a polynomial:

    Q(h/2) = exp(-d_m h) Q(-h/2) + exp(-d_m h/2 - d' h^2/8) int exp(d_m u) (1 + d' u^2/2) G(u) du,

which is of fourth order in h. Only modes of positive frequency meet a resonance. All else is
nearly steady at each speed: what a mode and an order add that do not meet between one width of the
ramp below it and one above it, and for which beta < `QUASI` |d|^2 all the way. The torque in a
shaft is then the steady response of all of these, smooth over the speed, with the first two terms
of A, and tau Q of each other pair; near an undamped resonance nothing large is subtracted. It is
finite in passing, whatever the damping.

The half range at a time is that of the cycle with the orders as they are at this time: the torque
over time stays within the extremes of that cycle. The ramp starts from steady running.

Source of the problem: F. M. Lewis, Vibration during acceleration through a critical speed, Trans.
ASME 54 (1932), APM-54-24. For one undamped mode the largest magnifier is 1.1706 omega_m
sqrt(pi/(2 beta)) = 3.68 sqrt(q), with his q = f_m^2/(change of frequency a second).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.given_numbers import given_array
from engine_dyn.speed.mechanisms import Progress, map_on_threads
from engine_dyn.status import CONVERGED, NO_STEADY_STATE, NOT_CONVERGED
from engine_dyn.torsion.forced import forced_response, lines_of
from engine_dyn.torsion.modes import checked_orders, modal_roots
from engine_dyn.torsion.ramp import NODES, Passes, largest_torques, recorded
from engine_dyn.torsion.synthesis import synthesis
from engine_dyn.torsion.system import ShaftSystem
from engine_dyn.types import Complexes, Floats, Integers

QUASI, FAINT = 1e-3, 3e-5
"""beta/|d|^2 below which a pair may be taken as steady, and the torque of a pair that is left out,
over the largest of all pairs in each shaft."""

SWIFT, LONGEST = 0.05, 1e6
"""beta/(nu omega + omega_m)^2 above which nothing follows the speed nearly steadily, and widths of
a resonance, 1/sqrt(beta), that a pass may last."""

AT_ONCE, HARMONICS = 64, 1 << 14
"""Largest numbers of cases that a thread takes at once, and of their harmonics at one speed."""


class AtNodes(NamedTuple):
    """Harmonics that follow no power of the speed, at the speeds of `node_speeds`."""

    torque: Any  # [N m]; shape (..., NODES, T, orders)


def node_speeds(start: Any, end: Any) -> Floats:
    """Speeds from `start` to `end` between which torques are cubic; shape (..., NODES)."""
    first, last = (np.asarray(speed, dtype=float)[..., None] for speed in (start, end))
    return np.asarray(first + (last - first) * np.linspace(0.0, 1.0, NODES))


class History(NamedTuple):
    """A pass over time, of one design."""

    time: Floats  # From the start of the ramp [s]; shape (steps,)
    speed: Floats  # Of the crank [rad/s]; shape (steps,)
    torque: Complexes  # Harmonics of the torque in each shaft [N m]; shape (steps, S, orders)


def passing(
    system: ShaftSystem,
    orders: Any,
    start: Any,
    end: Any,
    rate: Any,
    throws: Sequence[int],
    torque: Any,
    factors: Sequence[Any] | None = None,
    powers: Sequence[float] | None = None,
    *,
    period: float = 4.0 * math.pi,
    samples: float = 1.0,
    threads: int | None = 1,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Largest half range of the torque in each shaft between two speeds, and where it is.

    The designs of `system`, `start`, `end`, `rate` and the axes of the torques before (throw,
    order) broadcast; `...` below is the shape of all of them.

    Parameters
    ----------
    system : ShaftSystem
        The shafts, without pendulums: their modes follow the speed.
    orders : array_like
        nu, above 0, along one axis.
    start, end : array_like
        Speeds of the crank [rad/s], above 0: from steady running at the first to the second,
        upwards or downwards. What happens after the second is not looked at.
    rate : array_like
        Change of speed over time [rad/s2], above 0.
    throws : sequence of int
        Disc on which each torque acts.
    torque : array_like of complex, or AtNodes
        Harmonics of the torque on each of them [N m], shape (..., T, orders).
    factors : sequence of array_like, optional
        With them, `torque` is a sequence of as many, whose sum acts, each times its factor.
    powers : sequence of float, optional
        Power of the speed [rad/s] for each of them: 2 for inertia torques over omega^2.
    period : float
        Angle of the cycle [rad].
    samples : float
        Factor on the number of samples, to see what remains between them.
    threads, progress
        As of `forced.forced_response`.

    Returns
    -------
    dict
        "half_range" [N m] and "speed" [rad/s] at which it is, shape (..., S); "status", shape
        (...): `no_steady_state` where the pass starts at a natural frequency of an undamped system,
        `not_converged` where the ramp is so fast that the speed changes a lot within a vibration,
        or lasts so long that it is not followed.

    Notes
    -----
    The error is about 1e-3 of the half range: samples of the pass with a parabola through the
    largest ones, and what is taken as steady. It grows to some 1e-2 of ramps that are nearly too
    fast.

    Examples
    --------
    >>> from engine_dyn.torsion.system import shaft_system
    >>> two = shaft_system([10.0, 10.0], [1e6], loss_factor=0.01)  # resonance at 447 rad/s
    >>> found = passing(two, [6.0], 60.0, 90.0, [5.0, 50.0], [0], [[1000.0]])
    >>> print(found["half_range"][:, 0].round(-2), found["speed"][:, 0].round(1))
    [32700. 15100.] [76.1 80.2]
    """
    passes, shape = _passes(system, orders, start, end, rate, throws, torque, factors, powers)
    nu, count = passes.orders, math.prod(shape)
    table = synthesis(nu, period)
    found = np.full((2, count, system.node_of_shaft.size), np.nan)
    at_once = max(min(AT_ONCE, HARMONICS // max(nu.size * found.shape[-1], 1)), 1)
    status = np.full(count, CONVERGED, dtype=np.int8)

    def solve(some: Integers) -> int:
        made, outcome = _prepared(passes, some)
        extremes = np.full((2, some.size, found.shape[-1]), np.nan)
        largest_torques(made, nu, table, samples, extremes)
        found[:, some] = np.where(outcome[:, None] == CONVERGED, extremes, np.nan)
        status[some] = outcome
        return some.size

    pieces = (np.arange(i, min(i + at_once, count)) for i in range(0, count, at_once))
    for done in map_on_threads(solve, pieces, threads):
        if progress:
            progress(done)
    values = found.reshape((2, *shape, -1))
    return {"half_range": values[0], "speed": values[1], "status": status.reshape(shape)}


def passing_history(
    system: ShaftSystem, orders: Any, start: float, end: float, rate: float,
    throws: Sequence[int], torque: Any, factors: Sequence[Any] | None = None,
    powers: Sequence[float] | None = None, *, samples: float = 1.0,
) -> History:  # fmt: skip
    """Orders of the torques over the time of one pass, at the samples that `passing` takes."""
    passes, shape = _passes(system, orders, start, end, rate, throws, torque, factors, powers)
    if math.prod(shape) != 1:
        raise ValueError(f"designs: shape {shape}: must be one design")
    made, _ = _prepared(passes, np.arange(1))
    times, lines = recorded(made, passes.orders, samples)
    speed = made.start + (made.end - made.start) * times / made.duration
    return History(times, speed, lines[:, :, 0] + 1j * lines[:, :, 1])


class _Given(NamedTuple):
    """What was given: lines of designs, and the line of each case in them."""

    system: ShaftSystem  # Along one axis
    design: Integers
    orders: Floats
    ramp: Floats  # Start, end, rate; shape (3, cases)
    throws: list[int]
    parts: list[tuple[Complexes, Integers, Floats, float]]


def _passes(
    system: ShaftSystem, orders: Any, start: Any, end: Any, rate: Any, throws: Sequence[int],
    torque: Any, factors: Sequence[Any] | None, powers: Sequence[float] | None,
) -> tuple[_Given, tuple[int, ...]]:  # fmt: skip
    """All passes, after checks, and the shape of the axes over which they vary."""
    nu = checked_orders(orders)
    if system.speed_stiffness.any():
        raise ValueError(
            "speed_stiffness: must be 0: the modes of a shaft with pendulums follow the speed, and "
            "its passing is not computed"
        )
    ramp = []
    for name, value in (("start", start), ("end", end), ("rate", rate)):
        values = given_array(name, value, finite=True)
        if not (values > 0.0).all():
            raise ValueError(f"{name}: {values[~(values > 0.0)].flat[0]:g}: must be above 0")
        ramp.append(values)
    if np.any(np.equal(*np.broadcast_arrays(*ramp[:2]))):
        raise ValueError("end: must differ from start")
    each = [torque] if factors is None else list(torque)
    scales = [given_array("factors", factor) for factor in factors or (1.0,)]
    exponents = list(powers or [0.0] * len(each))
    for name, some in (("factors", scales), ("powers", exponents)):
        if len(some) != len(each):
            raise ValueError(f"{name}: {len(some)}: must be as many as torques, {len(each)}")
    tables = [_table(one, (len(throws), nu.size)) for one in each]
    axes = [v.shape[: -3 if many else -2] for many, v in tables]
    shape = np.broadcast_shapes(
        system.shape, *(v.shape for v in ramp), *(v.shape for v in scales), *axes
    )
    parts = []
    for (many, given), own, scale, power in zip(tables, axes, scales, exponents, strict=True):
        rows = given.reshape((-1, NODES if many else 1, *given.shape[-2:]))
        factor = np.broadcast_to(scale, shape).flatten()
        parts.append((rows, lines_of(own, shape), factor, power))
    return _Given(
        system.along_one_axis(), lines_of(system.shape, shape), nu,
        np.stack([np.broadcast_to(v, shape).flatten() for v in ramp]), list(throws), parts,
    ), shape  # fmt: skip


def _table(torque: Any, own: tuple[int, int]) -> tuple[bool, Complexes]:
    """Whether a torque is given at each node, and its harmonics, after checks."""
    many = isinstance(torque, AtNodes)
    ends = (NODES, *own) if many else own
    harmonics = np.asarray(torque.torque if many else torque, dtype=np.complex128)
    if harmonics.shape[-len(ends) :] != ends:
        raise ValueError(
            f"torque: shape {harmonics.shape}: must end with {', '.join(map(str, ends))}, throws "
            "and orders, before them the nodes if it is `AtNodes`"
        )
    return many, harmonics


def _prepared(given: _Given, some: Integers) -> tuple[Passes, Integers]:
    """Numbers of some cases for the kernel, and their outcomes; what has none follows no pair."""
    start, end, rate = given.ramp[:, some]
    lines, design = np.unique(given.design[some], return_inverse=True)
    at = node_speeds(start, end)
    alpha, apart = np.copysign(rate, end - start), (end - start) / (NODES - 1)
    torque: Any = 0.0
    for values, line, factor, power in given.parts:
        scale = (factor[some, None] * at**power)[..., None, None]
        torque = torque + scale * values[line[some]]
    # The torques (cases, nodes, T, V), and their second derivatives over the speed
    acting = np.stack([torque, _bent(torque, apart)])
    root, left, right = (
        values[design] for values in modal_roots(given.system.of(lines), given.throws)
    )
    force = np.matmul(left[:, None], acting)  # (2, cases, nodes, modes, V)
    # Which pairs are followed in time
    nu, width = given.orders, np.abs(end - start)[:, None, None]
    beta = nu * rate[:, None, None]
    place = root.imag[..., None] / nu
    low, high = (f(start, end)[:, None, None] for f in (np.minimum, np.maximum))
    beside = np.maximum(np.maximum(low - place, place - high), 0.0)
    least = np.hypot(root.real[..., None], nu * beside)
    met = np.isfinite(least) & ((beside <= width) | (beta > QUASI * least**2))
    with np.errstate(divide="ignore"):  # a mode without damping
        longest = np.minimum(1.0 / least, 3.0 / np.sqrt(beta))
    most = np.abs(force[0]).max(axis=1) * np.where(met, longest, 0.0)
    sizes = most[..., None] * np.abs(right)[:, :, None, :]
    largest = sizes.max(axis=(1, 2), keepdims=True)
    share = np.divide(sizes, largest, out=np.zeros(sizes.shape), where=largest > 0.0).max(axis=-1)
    share[share < FAINT] = 0.0
    hasty = np.sqrt(beta.max(axis=2)[:, 0]) * np.abs(end - start) / rate > LONGEST
    opposite = nu * low + np.abs(root.imag)[..., None]  # Of the roots that no order meets
    swift = beta > SWIFT * opposite**2
    if swift.any():
        beyond = (np.abs(force[0]).max(axis=1) / opposite)[..., None] * np.abs(right)[:, :, None, :]
        beyond = np.nan_to_num(beyond)  # Modes that there are not
        whole_torque = np.maximum(largest, beyond.max(axis=(1, 2), keepdims=True))
        hasty |= (swift & (beyond > 1e-2 * whole_torque).any(axis=-1)).any(axis=(1, 2))
    share[hasty] = 0.0
    case, mode, order = np.nonzero(met)
    meeting, own = force[:, case, :, mode, order].swapaxes(0, 1), root[case, mode]
    # A node close to a resonance without damping moves a little: little is left of the difference
    # of two large torques, and what remains without the pairs is smooth.
    gap = np.abs(1j * at[case] - (own / nu[order])[:, None])
    close = np.zeros(at.shape, dtype=bool)
    np.logical_or.at(close, case, gap < 1e-3 * np.abs(apart)[case, None])
    at = np.where(close, at + 2e-3 * apart[:, None], at)
    # It lags by -i alpha/(2 nu) (2 H' F' + H'' F) of the steady H F, derivatives over the speed.
    whole = given.system.of(given.design[some][:, None])
    response = forced_response(whole, nu, at, given.throws, acting, wanted=("torque",))
    over = 1.0 / (1j * nu[order, None] * at[case] - own[:, None])
    steady = np.zeros(force.shape, dtype=np.complex128)
    steady[:, case, :, mode, order] = (meeting * over).swapaxes(0, 1)
    rest, of_bent = response["torque"] - np.matmul(right[:, None].swapaxes(-1, -2), steady)
    rest = rest - 0.5j * alpha[:, None, None, None] / nu * (_bent(rest, apart) - of_bent)
    smooth = np.stack([rest.real, rest.imag], axis=3)
    first = np.searchsorted(case, np.arange(some.size + 1))
    at_start = np.abs(1j * nu * start[:, None, None] - root[..., None])
    bad = ((at_start < 1e-9 * np.abs(root)[..., None]) & (most > 0.0)).any(axis=(1, 2))
    bad |= (response["status"] != CONVERGED).any(axis=(0, 2))
    outcome = np.where(hasty, NOT_CONVERGED, np.where(bad, NO_STEADY_STATE, CONVERGED))
    # Contiguous, whatever the number of cases: kernels are compiled anew for arrays that are not.
    return Passes(*map(np.ascontiguousarray, (
        start, end, np.abs(end - start) / rate, smooth, first, order, own, meeting[0],
        right[case, mode], share[case, mode, order],
    ))), outcome  # fmt: skip


def _bent(values: Complexes, apart: Floats) -> Complexes:
    """Second derivatives (C, P, ...) over nodes `apart`, by the parabola through neighbours."""
    inner = values[:, 2:] - 2.0 * values[:, 1:-1] + values[:, :-2]
    ends = 2.0 * inner[:, [0, -1]] - inner[:, [1, -2]]
    result = np.concatenate([ends[:, :1], inner, ends[:, 1:]], axis=1)
    return np.asarray(result / apart[(..., *(None,) * (values.ndim - 1))] ** 2)
