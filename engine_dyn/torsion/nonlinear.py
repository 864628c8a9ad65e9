r"""Steady vibration of a shaft system in which some couplings are not linear.

The torque of a coupling is a table over its twist (stages of arc springs, progressive rubber),
behind a clearance (backlash), beside dry friction. The mean torque sets the mean twist: the mean of
the torque over the cycle is that torque. The rest is linear and is condensed exactly: with the
linear system's twist l under what excites, and rho under a torque and its opposite at the two sides
of a coupling,

    delta_h = l_h + rho_h (f(delta) - k delta)_h

for each harmonic h of the cycle, with the stiffness k of the linear system in place of f. Any k
gives the same motion; only a loss factor acts on k itself. `harmonic_balance` solves this, and
`forced_response` derives everything else with f - k delta as torques at the two sides.

Clearance and friction have corners. So each case is solved with N samples a cycle and with 2 N,
until the two differ by less than the tolerance in torque and twist. That difference is the error
that is stated: halving the step divides it by two at least. Then `floquet` tells whether small
disturbances die out; if not, the motion jumps elsewhere, or repeats after several cycles only.
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
    WITH_NUMBERS,
)
from engine_dyn.torsion.couplings import (
    Coupling,
    laws_of,
    numbers_of,
    rest_twists,
    torque_extremes,
)
from engine_dyn.torsion.floquet import complex_stiffness, receptance, unstable
from engine_dyn.torsion.forced import forced_response
from engine_dyn.torsion.harmonic_balance import (
    BEYOND,
    FROM_LINEAR,
    FROM_REST,
    KNOWN,
    Balance,
    Laws,
    Motion,
    periodic_motions,
)
from engine_dyn.torsion.marching import marched
from engine_dyn.torsion.modes import checked_orders
from engine_dyn.torsion.system import ShaftSystem
from engine_dyn.types import Complexes, Floats, Integers

LEAST_HARMONICS, MOST_HARMONICS = 64, 4096
"""Harmonics with which a case begins, and with which it ends if it does not meet the tolerance."""

MARCHED = 3
WAYS = ("from_rest", "from_linear", "from_start", "from_time")
"""Where a motion comes from: it grows from small ones with what excites, or from the linear one
with what is not linear; it goes on from a start that is given; it is left after many cycles."""

FINER = 1024  # Largest number of harmonics with which a case begins

NOTHING = 1e-12  # Harmonics of the torques below this part of the largest do not excite

AT_ONCE = 16  # Number of cases that a thread takes at once


class _Block(NamedTuple):
    """Cases along one axis whose motions have the same period, a part of the cycle."""

    system: ShaftSystem
    speed: Floats
    torque: Complexes
    mean: Floats  # Mean torque of each coupling; shape (cases, C)
    laws: Laws
    clearance: Floats  # of each coupling [rad]; shape (cases, C)
    start: Complexes  # Harmonics of the cycle of a neighbour's twist, or none: (cases, C, 0)

    def some(self, which: Any) -> _Block:
        """Some of the cases."""
        laws = self.laws
        own = Laws(laws.first, *(values[which] for values in laws[1:]))
        return _Block(
            self.system.of(which), self.speed[which],
            self.torque[which], self.mean[which], own, self.clearance[which], self.start[which],
        )  # fmt: skip


class _Task(NamedTuple):
    """What all cases have in common."""

    shafts: list[int]  # Shaft of each coupling
    bounded: list[bool]  # Whether a coupling has a table, which the motion may leave
    throws: Sequence[int]
    harmonic: Integers  # Harmonic of the cycle of each order
    base: float  # Order of the first harmonic of the cycle
    tolerance: float
    wanted: tuple[str, ...]
    more: dict[str, Any]  # Other arguments of `forced_response`
    kept: Integers
    stored: int  # Number of harmonics of "coupling_twist"


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
    twist: Sequence[tuple[int, int]] = (),
    speed_of: Sequence[int] = (),
    kept: Any = None,
    period: float = 4.0 * math.pi,
    tolerance: float = 1e-3,
    start: Any = None,
    threads: int | None = 1,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Steady torsional vibration with couplings that are not linear.

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
    start : array_like of complex, optional
        "coupling_twist" of neighbours, such as of the next lower speed: their motion is followed
        where it goes on. Otherwise the motion is that which grows from small ones.
    orders, speed, throws, torque, wanted, twist, speed_of, kept, period, threads, progress
        As of `forced_response`.

    Returns
    -------
    dict
        Results as of `forced_response`. For each coupling, with C along the last axis but as
        noted: "coupling_extremes", least and largest torque [N m] with all parts and the mean,
        (..., C, 2); "coupling_mean_twist" [rad]; "contact", a number of `couplings.CONTACTS`;
        "clearance_share" and "slip_share", parts of the time without contact, and in which
        friction slips; "coupling_twist", harmonics of the twist from 0 on [rad], (..., C, H).
        "error", (...), of torques and twists over their half ranges; "way", (...), a number of
        `WAYS`, or -1 where the linear system has no steady state. "status", (...): as of
        `forced_response`, and `no_steady_state` where small disturbances grow, `not_converged`
        without a solution, `tolerance_not_met`, and `invalid_input` where a twist leaves a table.

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
    whole = np.rint(nu * period / (2.0 * math.pi)).astype(np.int64)
    broken = np.abs(nu * period / (2.0 * math.pi) - whole) > 1e-9 * whole
    if broken.any():
        raise ValueError(f"orders: {nu[broken][0]:g}: must have whole periods in the cycle")
    numbers = [numbers_of(coupling) for coupling in couplings]
    begun = None if start is None else np.asarray(start, dtype=np.complex128)
    shape = np.broadcast_shapes(
        system.shape, omega.shape, given.shape[:-2], mean.shape[:-1],
        *(value.shape for line in numbers for value in line),
    )  # fmt: skip
    count = math.prod(shape)

    def flat(values: Any, own: int = 0) -> Any:
        ends = values.shape[values.ndim - own :]
        return np.broadcast_to(values, (*shape, *ends)).reshape(count, *ends)

    cases = system.mapped(lambda values: flat(values, 1))
    numbers = [[flat(value) for value in line] for line in numbers]
    every = _Block(
        cases, flat(omega), flat(given, 2), flat(mean, 1)[:, places],
        laws_of(cases, couplings, numbers), np.stack([line[0] for line in numbers], axis=-1),
        np.empty((count, len(places), 0), dtype=complex) if begun is None else flat(begun, 2),
    )  # fmt: skip
    task = _Task(
        places, [coupling.twist is not None for coupling in couplings], throws, whole,
        2.0 * math.pi / period, tolerance, tuple(wanted),
        {"twist": twist, "speed_of": speed_of},
        np.arange(nu.size) if kept is None else np.asarray(kept, dtype=np.int64),
        max(LEAST_HARMONICS, int(whole.max(initial=1))) + 1,
    )  # fmt: skip
    size = np.abs(every.torque).max(axis=-2, initial=0.0)
    acts = size > NOTHING * size.max(axis=-1, keepdims=True, initial=0.0)
    parts = np.array([int(np.gcd.reduce(whole[line])) or 1 for line in acts], dtype=np.int64)
    jobs = []
    for part in np.unique(parts):
        same = np.flatnonzero(parts == part)
        jobs += [(same[i : i + AT_ONCE], int(part)) for i in range(0, same.size, AT_ONCE)]
    results: dict[str, Any] = {}

    def solve(job: tuple[Integers, int]) -> Any:
        return _solved(every.some(job[0]), task, job[1], job[0])

    for found in map_on_threads(solve, jobs, threads):
        for which, values in found:
            for name, value in values.items():
                if name not in results:
                    none = -1 if value.dtype.kind == "i" else np.nan
                    results[name] = np.full((count, *value.shape[1:]), none, dtype=value.dtype)
                results[name][which] = value
        if progress:
            progress(len(np.unique(np.concatenate([which for which, _ in found]))))
    for name, value in results.items():
        if name not in {"status", "error", "way"}:
            lost = ~np.isin(results["status"], WITH_NUMBERS)
            value[lost] = -1 if value.dtype.kind == "i" else np.nan
    return {name: value.reshape((*shape, *value.shape[1:])) for name, value in results.items()}


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
    check_above_zero(tolerance=tolerance)


_Found = list[tuple[Integers, dict[str, Any]]]
"""Numbers of cases, and their results."""


def _solved(block: _Block, task: _Task, part: int, numbers: Integers) -> _Found:
    """Results of the cases of a block; those without a lasting motion are marched from rest."""
    first, found, again = _first_harmonics(block, task, part), [], []
    for harmonics in np.unique(first):
        same = np.flatnonzero(first == harmonics)
        found += _solve(block.some(same), task, part, numbers[same], int(harmonics))
    for which, values in found:
        lost = ~np.isin(values["status"], (*WITH_NUMBERS, INVALID_INPUT)) & (values["way"] >= 0)
        for number in which[lost]:
            one = block.some(np.flatnonzero(numbers == number))
            twist, repeats = _marched(one, task)
            if twist is None:
                continue
            if not repeats:
                values["status"][which == number] = NO_STEADY_STATE
                continue
            one, harmonics = one._replace(start=twist), int(_first_harmonics(one, task, 1)[0])
            own = _solve(one, task, 1, np.array([number]), harmonics, MARCHED)
            again += [pair for pair in own if pair[1]["status"][0] in WITH_NUMBERS]
    return found + again


def _marched(block: _Block, task: _Task) -> tuple[Complexes | None, bool]:
    """Twists of one case after many cycles from rest, and whether they repeat."""
    system = block.system
    force = np.zeros((system.parent.size, int(task.harmonic.max(initial=0)) + 1), dtype=complex)
    for throw, disc in enumerate(task.throws):
        own = system.ratio[0, disc] * block.torque[0, throw]
        np.add.at(force[system.node_of_disc[disc]], task.harmonic, own)
    return marched(
        system, task.shafts, block.laws, float(block.speed[0]), block.mean, force, task.base
    )


def _first_harmonics(block: _Block, task: _Task, part: int) -> Integers:
    """Number of harmonics with which each case begins: those that excite and those that answer."""
    orders = task.base * part * np.arange(1.0, FINER + 1)
    rho = np.abs(receptance(block.system, task.shafts, orders, block.speed)).max(axis=1)
    laws = block.laws
    steepest = np.maximum.reduceat(laws.slope, laws.first[:-1], axis=1)
    steepest = steepest + np.where(laws.friction > 0.0, laws.stick, 0.0)
    answers = (rho * np.maximum(steepest, laws.stiffness)[..., None] > BEYOND).any(axis=1)
    last = FINER - answers[:, ::-1].argmax(axis=1)
    last = np.where(answers.any(axis=1), last, 0)
    excited = max(int(task.harmonic.max(initial=1)) / part, LEAST_HARMONICS)
    most = np.maximum(np.minimum(1.25 * last, FINER), excited)
    return np.asarray(2 ** np.ceil(np.log2(most)), dtype=np.int64)


def _solve(
    block: _Block, task: _Task, part: int, numbers: Integers, harmonics: int, given: int = KNOWN
) -> _Found:
    """Results of the cases of a block, with more and more harmonics.

    `given` is `MARCHED` where nothing but the start counts.
    """
    results = []
    before: Motion | None = None
    while True:
        balance, resonant = _condensed(block, task, part, harmonics)
        motion = _motions(block, part, balance, resonant, before, given)
        _add_damping(block, task, part, motion)
        error = (
            np.full(numbers.size, np.inf) if before is None else _error(block.laws, motion, before)
        )
        status = np.where(motion.solved > 0, CONVERGED, NOT_CONVERGED)
        status = np.where(resonant, NO_STEADY_STATE, status)
        unknown = ~resonant & ~np.isfinite(balance.linear).all(axis=(1, 2))
        status = np.where(unknown, INVALID_INPUT, status)
        if given == MARCHED and before is None and not motion.solved.all() and harmonics < FINER:
            harmonics *= 2
            continue
        last = 2 * harmonics > MOST_HARMONICS
        done = (error <= task.tolerance) | (status != CONVERGED) | last
        if done.any():
            status = np.where((status == CONVERGED) & (error > task.tolerance), TOLERANCE_NOT_MET,
                              status)  # fmt: skip
            found = _results(
                block.some(done), task, part, harmonics, _of(motion, done), status[done],
                error[done],
            )  # fmt: skip
            results.append((numbers[done], found))
        if done.all():
            return results
        block, numbers, before = block.some(~done), numbers[~done], _of(motion, ~done)
        harmonics *= 2


def _of(motion: Motion, which: Any) -> Motion:
    return Motion(*(values[which] for values in motion))


def _condensed(block: _Block, task: _Task, part: int, harmonics: int) -> tuple[Balance, Any]:
    """The linear system as the couplings see it, and the cases in which it resonates."""
    shafts, system, speed = task.shafts, block.system, block.speed
    orders = task.base * part * np.arange(1.0, harmonics + 1)
    cases, couplings = speed.size, len(shafts)
    excited = task.harmonic % part == 0
    response = forced_response(
        system, task.base * task.harmonic[excited], speed, task.throws,
        block.torque[..., excited], wanted=("torque",),
    )  # fmt: skip
    stiff = complex_stiffness(system, shafts, task.base * task.harmonic[excited], speed)
    linear = np.zeros((cases, couplings, harmonics + 1), dtype=np.complex128)
    linear[..., task.harmonic[excited] // part] = response["torque"][..., shafts, :] / stiff
    linear[..., 0] = block.mean / block.laws.stiffness
    rho = np.zeros((cases, couplings, couplings, harmonics + 1), dtype=np.complex128)
    rho[..., 1:] = receptance(system, shafts, orders, speed)
    for c in range(couplings):
        rho[:, c, c, 0] = -1.0 / block.laws.stiffness[:, c]
    wave = np.exp(0.5j * np.pi * np.arange(4 * harmonics) / harmonics)
    return Balance(linear, rho, wave), response["status"] != CONVERGED


def _motions(
    block: _Block, part: int, balance: Balance, resonant: Any, before: Motion | None, given: int
) -> Motion:
    """Solve a block, from the solution with fewer harmonics, a neighbour's, or the mean twists."""
    cases, couplings, width = balance.linear.shape
    twist, size = np.zeros(balance.linear.shape, dtype=np.complex128), balance.wave.size
    motion = Motion(
        twist, np.zeros_like(twist), np.zeros((cases, couplings, 3, size)),
        np.zeros((cases, couplings, 2, size)), np.zeros((cases, couplings, size)),
        np.zeros(cases, dtype=np.int64), np.zeros(cases, dtype=np.int64), np.zeros(cases),
        np.zeros(cases, dtype=np.int64),
    )  # fmt: skip
    alive = np.flatnonzero(~resonant & np.isfinite(balance.linear).all(axis=(1, 2)))
    motion.way[:] = given if before is None else before.way
    motion.way[resonant] = -1
    if before is not None:
        twist[..., : before.twist.shape[-1]] = before.twist
    elif block.start.shape[-1]:
        start = block.start[..., ::part][..., :width]
        twist[..., : start.shape[-1]] = np.nan_to_num(start)
    if before is not None or block.start.shape[-1]:
        periodic_motions(alive, block.laws, balance, motion, KNOWN)
        alive = alive[motion.solved[alive] == 0]
    for way in () if given == MARCHED else (FROM_REST, FROM_LINEAR):
        twist[alive] = 0.0 if way == FROM_REST else balance.linear[alive]
        if way == FROM_REST:
            twist[alive, :, 0] = rest_twists(block.laws, block.mean)[alive]
        motion.way[alive] = way
        periodic_motions(alive, block.laws, balance, motion, way)
        alive = alive[motion.solved[alive] == 0]
    return motion


def _add_damping(block: _Block, task: _Task, part: int, motion: Motion) -> None:
    """Add to the torque at the samples what the damping of the linear form has."""
    harmonics = motion.twist.shape[-1] - 1
    orders = task.base * part * np.arange(1.0, harmonics + 1)
    stiff = complex_stiffness(block.system, task.shafts, orders, block.speed)
    lines = np.zeros_like(motion.twist)
    lines[..., 1:] = (stiff - block.laws.stiffness[..., None]) * motion.twist[..., 1:]
    motion.samples[:, :, 1] += 2.0 * harmonics * np.fft.irfft(lines, 4 * harmonics)


def _error(laws: Laws, motion: Motion, before: Motion) -> Floats:
    """Largest change of torque or twist, over half of its range, from half as many samples."""
    values = motion.samples[:, :, :2]
    change = np.abs(values[..., ::2] - before.samples[:, :, :2]).max(axis=-1)
    largest = np.abs(torque_extremes(laws, motion) - torque_extremes(laws, before)).max(axis=-1)
    change[..., 1] = np.maximum(change[..., 1], largest)
    half = 0.5 * np.ptp(values, axis=-1)
    # What hardly vibrates counts by the largest of all values.
    least = 1e-9 * np.abs(values).max(axis=(1, 3), keepdims=True)[..., 0]
    error = (change / np.maximum(half, np.maximum(least, 1e-300))).max(axis=(1, 2))
    return np.asarray(error + motion.left)


def _results(
    block: _Block, task: _Task, part: int, harmonics: int, motion: Motion, status: Any,
    error: Floats,
) -> dict[str, Any]:  # fmt: skip
    """All results of some cases."""
    shafts, system, speed, laws = task.shafts, block.system, block.speed, block.laws
    orders = task.base * part * np.arange(1.0, harmonics + 1)
    growing = unstable(
        system, shafts, speed, task.base * part, motion.slope, motion.origin,
        np.where(laws.friction > 0.0, laws.stick, 0.0), motion.unknowns,
    )  # fmt: skip
    status = np.where(growing & np.isin(status, WITH_NUMBERS), NO_STEADY_STATE, status)
    delta = motion.samples[:, :, 0]
    half = 0.5 * block.clearance
    inside = (np.abs(delta) <= half[..., None]) & (half[..., None] > 0.0)
    above, below = (delta > half[..., None]).any(-1), (delta < -half[..., None]).any(-1)
    contact = np.where(above & below, 2, np.where(~above & ~below, 3, inside.any(-1)))
    for c in np.flatnonzero(task.bounded):
        ends = laws.twist[:, [laws.first[c], laws.first[c + 1] - 1], None]
        outside = ((delta[:, c] < ends[:, 0]) | (delta[:, c] > ends[:, 1])).any(axis=-1)
        status = np.where(outside & np.isin(status, WITH_NUMBERS), INVALID_INPUT, status)
    extremes = torque_extremes(laws, motion)
    results = {
        "status": status.astype(np.int8), "way": motion.way, "error": error,
        "coupling_extremes": extremes,
        "coupling_mean_twist": motion.twist[..., 0].real,
        "contact": np.where(half > 0.0, contact, 0).astype(np.int64),
        "clearance_share": inside.mean(axis=-1),
        "slip_share": ((motion.slope[:, :, 1] < 0.5) & (laws.friction > 0.0)[..., None]).mean(-1),
        "coupling_twist": _harmonics_of_cycle(motion.twist, part, task.stored),
    }  # fmt: skip
    sides = [disc for shaft in shafts for disc in system.shafts[shaft].tolist()]
    acting = np.zeros((speed.size, len(task.throws) + len(sides), harmonics), dtype=complex)
    excited = task.harmonic % part == 0
    acting[:, : len(task.throws), task.harmonic[excited] // part - 1] = block.torque[..., excited]
    acting[:, len(task.throws) :: 2] = motion.excess[..., 1:]
    acting[:, len(task.throws) + 1 :: 2] = -motion.excess[..., 1:]
    response = forced_response(
        system, orders, speed, [*task.throws, *sides], acting, wanted=task.wanted,
        period=2.0 * np.pi / (task.base * part), **task.more,
    )  # fmt: skip
    for name in task.wanted:
        value = response[name]
        match name:
            case "torque":
                value[:, shafts] += motion.excess[..., 1:]
            case "torque_extremes":
                value[:, shafts, :2] = extremes - block.mean[..., None]
                value[:, shafts, 2] = error[:, None] * 0.5 * np.ptp(extremes, axis=-1)
            case "shaft_loss":
                work = (motion.excess * motion.twist.conj())[..., 1:].imag
                value[:, shafts] += 0.5 * speed[:, None] * (work * orders).sum(axis=-1)
        if name in {"angle", "torque"}:
            value = _harmonics_of_cycle(value, part, task.harmonic.max(initial=0) + 1, 1)
            value = value[..., task.harmonic[task.kept]]
        results[name] = value
    return results


def _harmonics_of_cycle(values: Complexes, part: int, count: int, first: int = 0) -> Complexes:
    """The first harmonics of the cycle, from 0 on, from those of a part of it, from `first` on."""
    whole = np.zeros((*values.shape[:-1], count), dtype=np.complex128)
    places = part * np.arange(first, first + values.shape[-1])
    there = places < count
    whole[..., places[there]] = values[..., there]
    return whole
