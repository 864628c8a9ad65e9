r"""Steady vibration of a shaft system in which some couplings are not linear.

The torque of a coupling is a table over its twist (stages of arc springs, progressive rubber),
behind a clearance (backlash), beside dry friction: a spring k_f in series with a slider that holds
F (Jenkins). The mean torque sets the mean twist: the mean of the torque over the cycle is that
torque. The rest is linear and is condensed exactly: with the linear system's twist l under what
excites, and rho under a torque and its opposite at the two sides of a coupling,

    delta_h = l_h + rho_h (f(delta) - k delta)_h

for each harmonic h of the cycle, with the stiffness k of the linear system in place of f, and for
h = 0 with l = T/k and rho = -1/k. Any k gives the same motion; only a loss factor acts on k itself.
`forced_response` derives everything else with f - k delta as torques at the two sides.

Two steps find it. First, the excitation grows from 0 while time is integrated, in modes of the
linear system, exactly but for u = f - k delta, which is straight within a step. A small disturbance
must die out and the motion repeat every cycle: so it lasts. A loss factor is taken there as
viscous damping at the strongest order. Second, Newton's method balances the harmonics, with u
from N samples of the twist (alternating frequency and time: Cameron and Griffin, 1989; Krack and
Gross, Harmonic Balance for Nonlinear Vibration Problems), with N and with 2 N samples, until the
two differ by less than the tolerance in torque and twist. That difference is the error that is
stated: corners of the torque leave an error that halving the step divides by four.

With two-sided harmonics s_p of the change of slope s = df/d delta - k, a change dr_n of the twist
delta = Re sum r_m exp(i m tau) changes u by du_m = dr_n s_(m-n) + conj(dr_n) s_(m+n), m, n >= 1.
Where friction sticks since tau_o, d u(tau) = k_f (d delta(tau) - d delta(tau_o)). Harmonics where
|rho s| stays below `BEYOND` are no unknowns: r_m = l_m + rho u_m converges by itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.given_numbers import check_above_zero, given_array
from engine_dyn.speed.mechanisms import Progress, map_on_threads
from engine_dyn.status import (
    CONVERGED,
    INVALID_INPUT,
    NO_STEADY_STATE,
    NOT_CONVERGED,
    TOLERANCE_NOT_MET,
)
from engine_dyn.torsion.contact import REPEATS, Laws, Steps, march, torques
from engine_dyn.torsion.couplings import Coupling
from engine_dyn.torsion.forced import forced_response
from engine_dyn.torsion.modes import checked_orders, coordinates
from engine_dyn.torsion.system import ShaftSystem
from engine_dyn.types import Complexes, Floats, Integers

LEAST_HARMONICS, MOST_HARMONICS = 64, 8192
"""Harmonics with which a case begins, and with which it ends if it does not meet the tolerance."""

FINER = 1024  # Largest number of harmonics with which a case begins

BEYOND = 0.1  # Largest |rho| times change of slope of harmonics that are no unknowns

MOST_UNKNOWNS = 1000  # Largest number of unknowns of a case

LEFT = 1e-4  # Largest size of the last step of a solution, which is part of its error

LEAST_STEPS, MOST_STEPS = 512, 32768  # of a cycle in time

ANOTHER = 0.25  # Difference from the motion in time, over its range, that makes it another motion


class _Case(NamedTuple):
    """One case; C couplings."""

    system: ShaftSystem
    shafts: list[int]  # Shaft of each coupling
    laws: Laws
    gap: Floats  # Half of the clearance [rad]; shape (C,)
    bounded: Any  # Whether a coupling has a table, which the motion may leave; shape (C,)
    rest: Floats  # Twist at the mean torque [rad]; shape (C,)
    mean: Floats  # Mean torque [N m]; shape (C,)
    speed: float
    base: float  # Order of the first harmonic of the cycle
    throws: Sequence[int]
    whole: Integers  # Harmonic of each order that excites
    torque: Complexes


class _Condensed(NamedTuple):
    """The linear system as its couplings see it; harmonics 0 .. M along the last axis."""

    linear: Complexes  # l, shape (C, M + 1)
    receptance: Complexes  # rho, shape (C, C, M + 1)
    stiffness: Complexes  # k (1 + i eta) + i w c, and 0 for h = 0; shape (C, M + 1)


class _Motion(NamedTuple):
    """A motion; harmonics have the shape (C, M + 1), samples (C, N) with N = 4 M."""

    twist: Complexes
    excess: Complexes  # Harmonics of u
    delta: Floats  # Samples of the twist [rad]
    torque: Floats  # Samples of the torque, with damping [N m]
    extremes: Floats  # Least and largest torque; shape (C, 2)
    left: float  # Size of the last step over that of the twist


def nonlinear_response(
    system: ShaftSystem,
    couplings: Sequence[Coupling],
    orders: Any,
    speed: Any,
    throws: Sequence[int],
    torque: Any,
    mean_torque: Any,
    *,
    wanted: Sequence[str] = ("angle", "torque"),
    period: float = 4.0 * math.pi,
    tolerance: float = 1e-3,
    threads: int | None = 1,
    progress: Progress | None = None,
    **more: Any,
) -> dict[str, Any]:
    """Steady torsional vibration with couplings that are not linear.

    Where several motions are possible, that which comes from rest as the excitation grows.

    Parameters
    ----------
    system : ShaftSystem
        The shafts; those of the couplings have a stiffness above 0, that of the linear form, on
        which their loss factors act. `linearised` gives it.
    couplings : sequence of Coupling
        One for a shaft at most.
    mean_torque : array_like
        In each shaft [N m], shape (..., S), of `system.mean_torques`.
    tolerance : float
        Largest error of the couplings' torques and twists, over their half ranges.
    orders, speed, throws, torque, wanted, period, threads, progress, more
        As of `forced_response`; its `kept` and `factors` are not taken.

    Returns
    -------
    dict
        Results as of `forced_response`. For each coupling: "coupling_extremes", least and largest
        torque [N m] with all parts and the mean, (..., C, 2); "coupling_mean_twist" [rad],
        (..., C); "contact", a number of `couplings.CONTACTS`, (..., C), -1 without numbers.
        "error", (...), of torques and twists over their half ranges. "status", (...): as of
        `forced_response`, and `no_steady_state` where the motion does not repeat every cycle,
        `not_converged` without a solution, `tolerance_not_met`, and `invalid_input` where a twist
        leaves a table.

    Raises
    ------
    ValueError
        One line.
    """
    places = [coupling.shaft for coupling in couplings]
    _check(system, places, tolerance)
    nu, mean = checked_orders(orders), given_array("mean_torque", mean_torque)
    given, omega = np.asarray(torque, dtype=np.complex128), given_array("speed", speed)
    if given.shape[-2:] != (len(throws), nu.size):
        raise ValueError(
            f"torque: shape {given.shape}: must end with {len(throws)} throws and {nu.size} orders"
        )
    if mean.shape[-1:] != system.node_of_shaft.shape:
        raise ValueError(
            f"mean_torque: shape {mean.shape}: must end with {system.node_of_shaft.size} shafts"
        )
    base = 2.0 * math.pi / period
    whole = np.rint(nu / base).astype(np.int64)
    broken = np.abs(nu / base - whole) > 1e-9 * whole
    if broken.any():
        raise ValueError(f"orders: {nu[broken][0]:g}: must have whole periods in the cycle")
    numbers = [coupling.numbers() for coupling in couplings]
    shape = np.broadcast_shapes(
        system.shape, omega.shape, given.shape[:-2], mean.shape[:-1],
        *(value.shape for line in numbers for value in line),
    )  # fmt: skip
    count = math.prod(shape)

    def flat(values: Any, own: int = 0) -> Any:
        ends = values.shape[values.ndim - own :]
        return np.broadcast_to(values, (*shape, *ends)).reshape(count, *ends)

    cases, omega, given = system.mapped(lambda one: flat(one, 1)), flat(omega), flat(given, 2)
    mean, lines = flat(mean, 1)[:, places], [[flat(one) for one in line] for line in numbers]
    bounded = np.array([coupling.twist is not None for coupling in couplings])
    like = forced_response(
        cases.of(0), nu, 1.0, throws, 0.0 * given[0], wanted=wanted, period=period, **more
    )
    ends = {"status": (), "error": (), "contact": (len(places),)}
    ends |= {"coupling_extremes": (len(places), 2), "coupling_mean_twist": (len(places),)}
    ends |= {name: like[name].shape for name in wanted}
    results = {
        name: np.full((count, *end), np.nan, dtype=like[name].dtype if name in wanted else None)
        for name, end in ends.items()
    }
    results["contact"][:] = -1

    def solve(i: int) -> int:
        one, own = cases.of(i), [[float(value[i]) for value in line] for line in lines]
        laws, gap = _laws(one, couplings, own), 0.5 * np.array([line[0] for line in own])
        case = _Case(
            one, places, laws, gap, bounded, _rest(laws, mean[i]), mean[i], float(omega[i]), base,
            throws, whole, given[i],
        )  # fmt: skip
        for name, value in _solved(case, tolerance, wanted, more).items():
            results[name][i] = value
        return 1

    for done in map_on_threads(solve, range(count), threads):
        if progress:
            progress(done)
    kinds = {"status": np.int8, "contact": np.int64}
    return {
        name: value.reshape((*shape, *ends[name])).astype(kinds.get(name, value.dtype))
        for name, value in results.items()
    }


def _check(system: ShaftSystem, places: Sequence[int], tolerance: float) -> None:
    count = system.node_of_shaft.size
    for number, place in enumerate(places):
        if not 0 <= place < count:
            raise ValueError(
                f"couplings[{number}] shaft = {place}: must be a shaft, from 0 to {count - 1}"
            )
        if place in places[:number]:
            raise ValueError(f"couplings[{number}] shaft = {place}: has a coupling already")
        node = system.node_of_shaft[place]
        if system.speed_stiffness[..., node].any() or not (system.stiffness[..., node] > 0).all():
            raise ValueError(
                f"stiffness[{place}]: must be above 0, that of the coupling's linear form"
            )
    if not places:
        raise ValueError("couplings: must be at least one; otherwise take forced_response")
    if system.modal_damping.shape[-1]:
        raise ValueError(
            "modal_damping: must not be given: a motion that is not linear has no modes"
        )
    check_above_zero(tolerance=tolerance)


def _laws(
    system: ShaftSystem, couplings: Sequence[Coupling], numbers: Sequence[Sequence[float]]
) -> Laws:
    """Tables of all couplings of one case, with their clearance, and their friction."""
    places = [coupling.shaft for coupling in couplings]
    stiffness = system.stiffness[system.node_of_shaft[places]] * system.shaft_factor[places] ** 2
    points = [
        one.points(float(k), line[0])
        for one, k, line in zip(couplings, stiffness, numbers, strict=True)
    ]
    slopes = [np.diff(torque) / np.diff(twist) for twist, torque in points]
    twists, torque_points = (np.concatenate(values) for values in zip(*points, strict=True))
    _, friction, stick = np.array(numbers).T
    return Laws(
        np.cumsum([0, *(twist.size for twist, _ in points)]), twists, torque_points,
        np.concatenate([np.append(slope, slope[-1]) for slope in slopes]),
        stiffness, np.ascontiguousarray(friction), np.ascontiguousarray(stick),
    )  # fmt: skip


def _rest(laws: Laws, mean: Floats) -> Floats:
    """Twist of each coupling under its mean torque alone [rad]; NaN where that is not known."""
    twist = np.full(mean.shape, np.nan)
    for c in np.flatnonzero(np.isfinite(mean)):
        table = slice(laws.first[c], laws.first[c + 1])
        points, torque, slope = (v[table] for v in (laws.twist, laws.torque, laws.slope))
        place = int(np.clip(np.searchsorted(torque, mean[c]), 1, torque.size - 1)) - 1
        place += int(slope[place] == 0.0)  # Without mean torque, at one end of the clearance
        twist[c] = points[place] + (mean[c] - torque[place]) / slope[place]
    return twist


def _solved(
    case: _Case, tolerance: float, wanted: Sequence[str], more: dict[str, Any]
) -> dict[str, Any]:
    """All results of one case, or its status alone."""
    laws, couplings = case.laws, len(case.shafts)
    if not (np.isfinite(case.torque).all() and np.isfinite(case.mean).all()):
        return {"status": INVALID_INPUT}
    condensed = _condensed(case, FINER)
    if not all(np.isfinite(values).all() for values in condensed):
        return {"status": NO_STEADY_STATE}
    steepest = np.maximum.reduceat(laws.slope, laws.first[:-1])
    steepest = steepest + np.where(laws.friction > 0.0, laws.stick, 0.0)
    twists, repeats = _marched(case, condensed, steepest)
    if twists is None or not repeats:
        return {"status": NOT_CONVERGED if twists is None else NO_STEADY_STATE}
    changes = np.maximum(steepest, laws.stiffness)[:, None]
    answers = np.flatnonzero((np.abs(condensed.receptance) * changes > BEYOND).any(axis=(0, 1)))
    unknowns = min(int(answers.max(initial=1)), (MOST_UNKNOWNS // couplings - 1) // 2)
    most = max(LEAST_HARMONICS, 1.25 * unknowns, int(case.whole.max(initial=1)))
    harmonics = 2 ** math.ceil(math.log2(most))
    start = _harmonics(twists, harmonics)
    error, before = np.inf, None
    while True:
        if harmonics >= condensed.linear.shape[1]:
            condensed = _condensed(case, harmonics)
        own = _Condensed(*(values[..., : harmonics + 1] for values in condensed))
        motion = _balanced(laws, own, start, unknowns)
        if not motion.left < LEFT:
            return {"status": NOT_CONVERGED}
        if before is not None:
            error = motion.left + _difference(motion, before)
        if error <= tolerance or 2 * harmonics > MOST_HARMONICS:
            break
        start, before, harmonics = (
            np.pad(motion.twist, [(0, 0), (0, harmonics)]),
            motion,
            2 * harmonics,
        )
    apart = np.abs(_samples(start, twists.shape[1]) - twists).max()
    if apart > ANOTHER * np.ptp(twists, axis=1).max() > 0.0:
        return {"status": NOT_CONVERGED}
    ends = laws.twist[laws.first[:-1]], laws.twist[laws.first[1:] - 1]
    outside = (motion.delta.min(axis=1) < ends[0]) | (motion.delta.max(axis=1) > ends[1])
    if (case.bounded & outside).any():
        return {"status": INVALID_INPUT}
    return {
        "status": CONVERGED if error <= tolerance else TOLERANCE_NOT_MET, "error": error,
        "coupling_extremes": motion.extremes, "coupling_mean_twist": motion.twist[:, 0].real,
        "contact": _contact(case.gap, motion.delta), **_response(case, motion, error, wanted, more),
    }  # fmt: skip


def _acting(case: _Case, harmonics: int) -> Complexes:
    """Harmonics of what excites, from 1 on."""
    acting = np.zeros((len(case.throws), harmonics), dtype=complex)
    acting[:, case.whole - 1] = case.torque
    return acting


def _condensed(case: _Case, harmonics: int) -> _Condensed:
    """The linear system as the couplings see it."""
    system, shafts, k = case.system, case.shafts, case.laws.stiffness
    nu = case.base * np.arange(1.0, harmonics + 1)
    nodes = system.node_of_shaft[shafts]
    viscous = system.shaft_factor[shafts] ** 2 * system.damping[nodes]
    stiff = (k * (1.0 + 1j * system.loss_factor[nodes]))[:, None]
    stiff = stiff + 1j * case.speed * nu * viscous[:, None]
    pair = np.array([[1.0], [-1.0]]) * np.ones(nu.size)
    acting: list[tuple[Sequence[int], Any]] = [(case.throws, _acting(case, harmonics))]
    acting += [(system.shafts[shaft].tolist(), pair) for shaft in shafts]
    linear, *receptance = (
        forced_response(system, nu, case.speed, *one, wanted=("torque",))["torque"][shafts] / stiff
        for one in acting
    )
    still = np.diag(-1.0 / k)[..., None]
    return _Condensed(
        np.concatenate([(case.mean / k)[:, None], linear], axis=-1),
        np.concatenate([still, np.stack(receptance, axis=1)], axis=-1),
        np.concatenate([0.0 * stiff[:, :1], stiff], axis=-1),
    )


def _harmonics(samples: Floats, most: int) -> Complexes:
    """Harmonics 0 .. `most` of a real signal, Re sum r_m exp(i m tau), from samples of a period."""
    lines = np.fft.rfft(samples)[..., : most + 1] * (2.0 / samples.shape[-1])
    lines[..., 0] *= 0.5
    return np.pad(lines, [(0, 0), (0, most + 1 - lines.shape[-1])])


def _samples(harmonics: Complexes, count: int) -> Floats:
    """Samples of a real signal at some places of the period; the inverse of `_harmonics`."""
    lines = 0.5 * count * harmonics[..., : count // 2]
    lines[..., 0] *= 2.0
    return np.fft.irfft(lines, count)


def _marched(case: _Case, condensed: _Condensed, steepest: Floats) -> tuple[Floats | None, bool]:
    """Twists of the couplings over a cycle after many, and whether they repeat.

    None where the couplings are so stiff that a cycle would need too many steps.
    """
    system, laws, nodes = case.system, case.laws, case.system.node_of_shaft[case.shafts]
    modes = coordinates(system, case.speed)
    twist = (modes.twist[:, nodes] / system.shaft_factor[case.shafts]).T
    cycle = 2.0 * math.pi / (case.base * case.speed)
    fastest = math.sqrt(float((steepest * (twist**2).sum(axis=1)).max()))
    least = max(LEAST_STEPS, 4 * int(case.whole.max(initial=1)), 2.0 * cycle * fastest)
    count = 2 ** math.ceil(math.log2(least))
    if count > MOST_STEPS:
        return None, False
    # State: omega q and q' of the modes.
    size = modes.omega.size
    strongest = 1 + int(np.abs(condensed.linear[:, 1:]).max(axis=0).argmax())
    matrix, acting = np.zeros((2 * size, 2 * size)), np.zeros((2 * size, len(nodes)))
    matrix[:size, size:] = np.diag(modes.omega)
    matrix[size:, :size] = -np.diag(modes.omega)
    lag = modes.lost / (strongest * case.base * case.speed)
    matrix[size:, size:] = -modes.viscous - lag
    acting[size:] = -twist.T
    free, early, late = _step(matrix, acting, cycle / count)
    over = np.divide(1.0, modes.omega, out=np.zeros(size), where=modes.omega > 0.0)
    seen = np.concatenate([twist * over, 0.0 * twist], axis=1)
    excess = case.mean - laws.stiffness * case.rest
    state = np.concatenate([-(excess @ twist) * over, np.zeros(size)])
    vibrating = condensed.linear.copy()
    vibrating[:, 0] = 0.0
    twists = np.zeros((len(nodes), count))
    change = march(
        laws, Steps(free, early, late, seen, seen @ late), condensed.linear[:, 0].real.copy(),
        _samples(vibrating, count), state, twists,
    )  # fmt: skip
    return twists, change < 10.0 * REPEATS


def _step(matrix: Floats, acting: Floats, time: float) -> tuple[Floats, Floats, Floats]:
    """Make x' = matrix x + acting u over a time, with u straight: parts of x, u and u's change.

    By the exponential of one matrix (Van Loan, 1978): a series of a part of the time, squared.
    """
    size, inputs = acting.shape
    whole = np.zeros((size + 2 * inputs, size + 2 * inputs))
    whole[:size, :size], whole[:size, size : size + inputs] = matrix * time, acting * time
    whole[size : size + inputs, size + inputs :] = np.eye(inputs)
    halvings = max(0, math.ceil(math.log2(max(np.abs(whole).sum(axis=1).max(), 1e-9))) + 1)
    part = whole / 2.0**halvings
    term = total = np.eye(len(whole))
    for power in range(1, 19):
        term = term @ part / power
        total = total + term
    for _ in range(halvings):
        total = total @ total
    free, early, late = np.split(total[:size], [size, size + inputs], axis=1)
    return np.ascontiguousarray(free), np.ascontiguousarray(early), np.ascontiguousarray(late)


def _balanced(laws: Laws, condensed: _Condensed, start: Complexes, unknowns: int) -> _Motion:
    """Motion that balances the harmonics, by Newton's method from a start."""
    twist, rho = start.copy(), condensed.receptance
    couplings, harmonics = twist.shape[0], twist.shape[1] - 1
    count, width = 4 * harmonics, 2 * unknowns + 1
    torque, slope, grip = (np.empty((couplings, count)) for _ in range(3))
    origin = np.empty((couplings, count), dtype=np.int64)
    scale = max(
        float(np.linalg.norm(condensed.linear[:, 1:])), float(np.linalg.norm(twist)), 1e-300
    )
    moved, damped = np.inf, 1.0
    for _ in range(60):
        delta = _samples(twist, count)
        torques(laws, delta, torque, slope, grip, origin)
        excess = _harmonics(torque - laws.stiffness[:, None] * delta, harmonics)
        if moved <= 1e-11:
            break
        gap = twist - condensed.linear - np.einsum("cdm,dm->cm", rho, excess)
        matrix = np.eye(couplings * width)
        changes = slope + laws.stick[:, None] * grip - laws.stiffness[:, None]
        for d in range(couplings):
            columns = _columns(changes[d], laws.stick[d], grip[d], origin[d], unknowns)
            for c in range(couplings):
                block = rho[c, d, : unknowns + 1, None] * columns
                matrix[c * width : (c + 1) * width, d * width : (d + 1) * width] -= _real(block)
        step = np.linalg.solve(
            matrix, np.concatenate([_real(one) for one in gap[:, : unknowns + 1]])
        )
        whole = step.reshape(couplings, width)
        change = gap.copy()
        change[:, 0], change[:, 1 : unknowns + 1] = (
            whole[:, 0],
            whole[:, 1::2] + 1j * whole[:, 2::2],
        )
        went, moved = moved, float(np.linalg.norm(change)) / scale
        # Friction turns from sample to sample in small jumps, between which steps may swing.
        damped = max(0.5 * damped, 0.1) if moved > 0.7 * went else min(2.0 * damped, 1.0)
        twist -= damped * change
    with_damping = (condensed.stiffness - laws.stiffness[:, None]) * twist
    with_damping[:, 0] = 0.0
    torque += _samples(with_damping, count)
    extremes = np.array(
        [_extremes(laws, c, delta[c], torque[c], slope[c]) for c in range(couplings)]
    )
    return _Motion(twist, excess, delta, torque, extremes, moved)


def _real(values: Complexes) -> Floats:
    """Harmonics along the first axis as real parts, of 0, and real and imaginary parts, of 1 on."""
    rows = np.empty((2 * len(values) - 1, *values.shape[1:]))
    rows[0], rows[1::2], rows[2::2] = values[0].real, values[1:].real, values[1:].imag
    return rows


def _columns(
    changes: Floats, stick: float, grip: Floats, origin: Integers, unknowns: int
) -> Complexes:
    """Change of harmonics 0 .. U of u by r_0 and the real and imaginary parts of r_1 .. r_U."""
    count, m = changes.size, np.arange(unknowns + 1)
    s = np.fft.fft(changes) / count
    columns = np.empty((unknowns + 1, 2 * unknowns + 1), dtype=complex)
    down, up = s[m[:, None] - m[1:]], s[m[:, None] + m[1:]]
    columns[:, 0], columns[:, 1::2], columns[:, 2::2] = 2.0 * s[m], down + up, 1j * (down - up)
    for since in np.unique(origin[origin > -2]):
        held = np.flatnonzero(origin == since)
        column = grip[held] @ np.exp(-2j * np.pi / count * np.outer(held, m))
        turned = np.exp(2j * np.pi / count * since * m) if since >= 0 else (m == 0) + 0j
        row = _real(turned.conj()[:, None])[:, 0]
        columns -= (2.0 / count * stick) * np.outer(column, row)
    columns[0] *= 0.5
    return columns


def _extremes(
    laws: Laws, c: int, delta: Floats, torque: Floats, slope: Floats
) -> tuple[float, float]:
    """Least and largest torque of a coupling: of samples, in corners, and between samples."""
    after, torque_after, slope_after = (np.roll(v, -1) for v in (delta, torque, slope))
    found = [_top(torque), -_top(-torque)]
    for corner in laws.twist[laws.first[c] + 1 : laws.first[c + 1] - 1]:
        cells = (delta - corner) * (after - corner) < 0.0
        before, beyond = (corner - delta)[cells], (after - corner)[cells]
        there = torque[cells] + slope[cells] * before
        # Friction and damping run straight from sample to sample.
        rest = torque_after[cells] - slope_after[cells] * beyond - there
        found += (there + before / (before + beyond) * rest).tolist()
    return min(found), max(found)


def _top(values: Floats) -> float:
    """Largest value, where it is smooth by a parabola through the three largest samples."""
    place = int(values.argmax())
    outer, before, top, after, last = (values[(place + i) % values.size] for i in range(-2, 3))
    bend = 2.0 * top - before - after
    beside = min(2.0 * before - outer - top, 2.0 * after - top - last)
    return float(top + 0.125 * (after - before) ** 2 / bend if beside > 0.5 * bend > 0.0 else top)


def _difference(motion: _Motion, before: _Motion) -> float:
    """Largest change of torque or twist, over half of its range, from half as many samples."""
    largest = 0.0
    for one, other in ((motion.delta, before.delta), (motion.torque, before.torque)):
        half = 0.5 * np.ptp(one, axis=-1)
        change = np.abs(one[:, ::2] - other).max(axis=-1)
        if one is motion.torque:
            change = np.maximum(change, np.abs(motion.extremes - before.extremes).max(axis=-1))
        # What hardly vibrates counts by the largest of all values.
        least = max(1e-9 * float(np.abs(one).max()), 1e-300)
        largest = max(largest, float((change / np.maximum(half, least)).max()))
    return largest


def _contact(gap: Floats, delta: Floats) -> Integers:
    """Which sides of each coupling touch, see `couplings.CONTACTS`."""
    above, below = (delta > gap[:, None]).any(axis=-1), (delta < -gap[:, None]).any(axis=-1)
    inside = (np.abs(delta) <= gap[:, None]).any(axis=-1)
    contact = np.where(above & below, 2, np.where(~above & ~below, 3, inside))
    return np.asarray(np.where(gap > 0.0, contact, 0))


def _response(
    case: _Case, motion: _Motion, error: float, wanted: Sequence[str], more: dict[str, Any]
) -> dict[str, Any]:
    """What `forced_response` has of the whole system, with what its couplings do besides."""
    harmonics = motion.excess.shape[1] - 1
    acting = np.repeat(motion.excess[:, 1:], 2, axis=0)
    acting[1::2] *= -1.0
    discs = [*case.throws, *case.system.shafts[case.shafts].ravel().tolist()]
    nu = case.base * np.arange(1.0, harmonics + 1)
    response = forced_response(
        case.system, nu, case.speed, discs, np.concatenate([_acting(case, harmonics), acting]),
        wanted=wanted, kept=case.whole - 1, period=2.0 * math.pi / case.base, **more,
    )  # fmt: skip
    for name in wanted:
        match name:
            case "torque":
                response[name][case.shafts] += motion.excess[:, case.whole]
            case "torque_extremes":
                response[name][case.shafts, :2] = motion.extremes - case.mean[:, None]
                response[name][case.shafts, 2] = error * 0.5 * np.ptp(motion.extremes, axis=-1)
            case "shaft_loss":
                work = (motion.excess * motion.twist.conj())[:, 1:].imag
                response[name][case.shafts] += 0.5 * case.speed * (work * nu).sum(axis=-1)
    return {name: response[name] for name in wanted}
