"""A pass through a range of speeds in time: modes that meet an order, and the largest torque.

`passing` has the equations. Q' = -d Q + G, d' = i nu alpha, of each pair of a mode and an order is
solved at samples of the time that lie close where the pair changes fast; the half range is taken
where it may be the largest.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.torsion.synthesis import Synthesis, extremes_of
from engine_dyn.types import Complexes, Floats, Integers

ZONE, SUBSTEP = 25.0, 0.3
"""|d|^2/beta below which steps are taken, and their largest length times sqrt(beta)."""

NODES = 17
"""Number of speeds at which the smooth part is known; between them it is cubic."""

PEAK, BEAT, LEAST, MOST = 0.25, 0.35, 64, 1 << 15
"""Distance of samples: over the width of a peak in time; as phase of a beat; their numbers."""

CLOSE, CLOSEST, FINER = 0.98, 0.995, 4
"""Part of the largest sample from which samples are finer, by which factor, and from which finer
ones a parabola is laid through peaks."""


class Passes(NamedTuple):
    """Passes C, and pairs of a mode and an order; those of pass c from first[c] to first[c + 1]."""

    start: Floats  # Speeds of the crank [rad/s], (C,)
    end: Floats
    duration: Floats  # [s], (C,)
    # Steady torques at the nodes P, without the pairs [N m], (C, P, S, real and imaginary part, V)
    smooth: Floats
    first: Integers  # (C + 1,)
    order: Integers  # Place of the order of each pair
    root: Complexes  # s
    force: Complexes  # G at the nodes, (pairs, P)
    torque: Complexes  # tau, (pairs, S)
    share: Floats  # Largest torque of a pair over that of all pairs; 0 of those left out


@kernel
def largest_torques(
    passes: Passes, nu: Floats, table: Synthesis, samples: float, found: Floats
) -> None:
    """Fill in the largest half range and its speed of each shaft, (2, passes, S)."""
    shafts, orders, quarter = passes.smooth.shape[2], nu.size, table.quarters[-1]
    scratch = _Scratch(
        np.empty((2, orders)), np.empty(orders), np.empty(orders), np.empty((6, quarter)),
        np.empty(3),
    )  # fmt: skip
    last, times, best = np.empty((2, orders)), np.empty(MOST), np.empty(shafts)
    for case in range(passes.start.size):
        count = _sampled(case, passes, nu, samples, times)
        pairs = passes.first[case + 1] - passes.first[case]
        states = np.empty((count + 1, pairs), dtype=np.complex128)
        _follow(case, passes, nu, times, count, states)
        bound, moved = np.empty(count), np.empty(count)
        fine, own = np.empty(FINER * count), np.full((shafts, FINER * count), -1.0)
        for step in range(count):
            for i in range(FINER):
                later = times[min(step + 1, count - 1)]
                fine[FINER * step + i] = times[step] + i / FINER * (later - times[step])
        speed = (passes.end[case] - passes.start[case]) / passes.duration[case]
        for shaft in range(shafts):
            # The half range is no more than the sum of amplitudes, and changes by no more than the
            # sum of their changes: few samples need more than that.
            last[:] = 0.0
            for step in range(count):
                _torque(case, passes, shaft, times[step], states[step], scratch.line)
                bound[step], moved[step] = 0.0, 0.0
                for v in range(orders):
                    real, imaginary = scratch.line[0, v], scratch.line[1, v]
                    bound[step] += math.sqrt(real**2 + imaginary**2)
                    moved[step] += math.sqrt(
                        (real - last[0, v]) ** 2 + (imaginary - last[1, v]) ** 2
                    )
                    last[0, v], last[1, v] = real, imaginary
            best[shaft], first = 0.0, int(np.argmax(bound))
            for way in (1, -1):
                step, at_most = first, bound[first]
                while 0 <= step < count:
                    if at_most >= CLOSE * best[shaft]:
                        at_most = _half_range(
                            case, passes, shaft, table, times[step], states[step], scratch
                        )
                        own[shaft, FINER * step] = at_most
                        best[shaft] = max(best[shaft], at_most)
                    step += way
                    if 0 <= step < count:
                        at_most += moved[step] if way > 0 else moved[step + 1]
                        at_most = min(at_most, bound[step])
        for step in range(count - 1):
            for i in range(FINER * step + 1, FINER * step + FINER):
                known = False  # Whether Q of the pairs at this time is
                for shaft in range(shafts):
                    beside = max(own[shaft, FINER * step], own[shaft, FINER * step + FINER])
                    if beside < CLOSE * best[shaft]:
                        continue
                    if not known:
                        _moved(case, passes, nu, times[step], fine[i], states[step], states[count])
                        known = True
                    own[shaft, i] = _half_range(
                        case, passes, shaft, table, fine[i], states[count], scratch
                    )
        for shaft in range(shafts):
            line = own[shaft]
            top = int(np.argmax(line))
            most, place = line[top], fine[top]
            for i in range(1, FINER * (count - 1)):
                if line[i] >= CLOSEST * line[top] and line[i - 1] <= line[i] >= line[i + 1]:
                    away = _peak(
                        fine[i - 1] - fine[i], fine[i + 1] - fine[i], line[i] - line[i - 1],
                        line[i] - line[i + 1],
                    )  # fmt: skip
                    step, time = (i if away >= 0.0 else i - 1) // FINER, fine[i] + away
                    _moved(case, passes, nu, times[step], time, states[step], states[count])
                    value = _half_range(case, passes, shaft, table, time, states[count], scratch)
                    if value > most:
                        most, place = value, time
            found[0, case, shaft] = most
            found[1, case, shaft] = passes.start[case] + speed * place


class _Scratch(NamedTuple):
    """Memory for the harmonics of one shaft and their extremes."""

    line: Floats
    size: Floats
    weight: Floats
    sums: Floats
    extremes: Floats


@kernel
def recorded(passes: Passes, nu: Floats, samples: float) -> tuple[Floats, Floats]:
    """Times of samples of the first pass, and the harmonics of the torques, (steps, S, 2, V)."""
    times = np.empty(MOST)
    count = _sampled(0, passes, nu, samples, times)
    states = np.empty((count, passes.order.size), dtype=np.complex128)
    _follow(0, passes, nu, times, count, states)
    lines = np.empty((count, passes.smooth.shape[2], 2, nu.size))
    for step in range(count):
        for shaft in range(lines.shape[1]):
            _torque(0, passes, shaft, times[step], states[step], lines[step, shaft])
    return times[:count].copy(), lines


@inlined
def _half_range(
    case: int, passes: Passes, shaft: int, table: Synthesis, time: float, states: Complexes,
    scratch: _Scratch,
) -> float:  # fmt: skip
    """Half range of the torque in a shaft over the cycle, with the orders as they are at a time."""
    line, extremes = scratch.line, scratch.extremes
    _torque(case, passes, shaft, time, states, line)
    extremes_of(line[0], line[1], table, scratch.size, scratch.weight, scratch.sums, extremes)
    return 0.5 * (extremes[1] - extremes[0])


@inlined
def _peak(back: float, forth: float, rise: float, fall: float) -> float:
    """Top of the parabola through 0 and two points beside it, lower by `rise` and by `fall`."""
    bend = rise * forth - fall * back
    return 0.5 * (rise * forth**2 - fall * back**2) / bend if bend > 0.0 else 0.0


@inlined
def _moved(
    case: int, passes: Passes, nu: Floats, time: float, later: float, states: Complexes,
    moved: Complexes,
) -> None:  # fmt: skip
    """Fill in Q of all pairs of a pass at a later time, from those at a time."""
    duration = passes.duration[case]
    alpha = (passes.end[case] - passes.start[case]) / duration
    for number in range(states.size):
        pair = passes.first[case] + number
        order, q = nu[passes.order[pair]], states[number]
        if passes.share[pair] > 0.0:
            turn = 1j * order * alpha
            d = 1j * order * (passes.start[case] + alpha * time) - passes.root[pair]
            q = _stepped(q, d, turn, passes.force[pair], time, later - time, duration)
        moved[number] = q


@inlined
def _stepped(
    q: complex, d: complex, turn: complex, values: Complexes, time: float, h: float,
    duration: float,
) -> complex:  # fmt: skip
    """Q of a pair after a time h, in as many steps as it needs; d is that before them."""
    parts = max(math.ceil(h * math.sqrt(abs(turn)) / SUBSTEP), 1)
    for part in range(parts):
        middle = (part + 0.5) / parts * h
        force, slope, bend = _force(values, time + middle, duration)
        q = advanced(q, d + turn * middle, turn, h / parts, force, slope, bend)
    return q


@inlined
def _sampled(case: int, passes: Passes, nu: Floats, samples: float, times: Floats) -> int:
    """Fill in the times of samples; their number."""
    duration = passes.duration[case]
    alpha = (passes.end[case] - passes.start[case]) / duration
    coarse = 1.0 / samples
    while True:
        count, time = 0, 0.0
        while count < times.size:
            times[count] = time
            count += 1
            if time >= duration:
                return count
            step = duration / LEAST
            for pair in range(passes.first[case], passes.first[case + 1]):
                share = passes.share[pair]
                if share == 0.0:
                    continue
                order = nu[passes.order[pair]]
                beta, damping = order * abs(alpha), max(-passes.root[pair].real, 0.0)
                meets = (passes.root[pair].imag / order - passes.start[case]) / alpha
                beside, width = abs(time - meets), 1.0 / math.sqrt(beta)
                broad = math.sqrt((damping / beta) ** 2 + beside**2)
                step = min(step, PEAK * max(broad, width) / math.sqrt(share))
                # The free vibration, of the start and of the resonance
                away = damping**2 + (beta * meets) ** 2
                left = min(beta / away, 1.0) * math.exp(-damping * time)
                if 0.0 <= meets < time:
                    left = max(left, math.exp(-damping * beside))
                if beside > width and left > 0.0:
                    step = min(step, BEAT / (beta * beside * math.sqrt(share * left)))
            # The ends are approached: the largest value may be close to them.
            near = max(min(time, 0.5 * (duration - time)), 1e-3 * duration)
            step = min(coarse * step, near)
            time = duration if time + 1.01 * step > duration else time + step
        coarse *= 2.0


@inlined
def _follow(
    case: int, passes: Passes, nu: Floats, times: Floats, count: int, states: Complexes
) -> None:
    """Fill in Q of the pairs of a pass at its times; 0 for those left out."""
    first, duration = passes.first[case], passes.duration[case]
    alpha = (passes.end[case] - passes.start[case]) / duration
    for number in range(states.shape[1]):
        pair = first + number
        if passes.share[pair] == 0.0:
            states[:, number] = 0.0
            continue
        turn, values = 1j * nu[passes.order[pair]] * alpha, passes.force[pair]
        before = 1j * nu[passes.order[pair]] * passes.start[case] - passes.root[pair]
        beta = abs(turn)
        force, slope, bend = _force(values, 0.0, duration)
        q = force / before
        states[0, number] = q
        free = q - _adiabatic(before, turn, force, slope, bend)
        inside = abs(before) ** 2 < ZONE * beta
        for step in range(1, count):
            h = times[step] - times[step - 1]
            after = before + turn * h
            now = abs(after) ** 2 < ZONE * beta
            force, slope, bend = _force(values, times[step], duration)
            quiet = _adiabatic(after, turn, force, slope, bend)
            crossed = before.imag * after.imag < 0.0 and before.real**2 < ZONE * beta
            if inside or now or crossed:
                if not inside:
                    then = _force(values, times[step - 1], duration)
                    q = free + _adiabatic(before, turn, then[0], then[1], then[2])
                q = _stepped(q, before, turn, values, times[step - 1], h, duration)
                free = q - quiet
            else:
                free *= np.exp(-0.5 * (before + after) * h)
                q = quiet + free
            inside = now
            states[step, number] = q
            before = after


@inlined
def _adiabatic(d: complex, turn: complex, force: complex, slope: complex, bend: complex) -> complex:
    """Solution of Q' = -d Q + G that follows d, `turn` its derivative."""
    over = 1.0 / d
    first = (force * turn * over - slope) * over**2
    second = ((3.0 * force * turn * over - 3.0 * slope) * turn * over + bend) * over**3
    return force * over + first + second


@inlined
def advanced(
    q: complex, d: complex, turn: complex, h: float, force: complex, slope: complex, bend: complex
) -> complex:
    """Q after a step h of Q' = -d Q + G; d, G and its derivatives are those in the middle."""
    y = d * h
    half = np.exp(-0.5 * y)
    decay = half * half
    if y.real**2 + y.imag**2 < 0.25:
        square = y * y
        # Of sinh(y/2)/(y/2) and its first two derivatives
        series = 1 / 1920 + square * (1 / 322560 + square / 92897280)
        zeroth = h * half * (1.0 + square * (1 / 24 + square * series))
        series = 1 / 480 + square * (1 / 53760 + square / 11612160)
        first = h * h * half * y * (1 / 12 + square * series)
        series = 1 / 160 + square * (1 / 10752 + square / 1658880)
        second = h**3 * half * (1 / 12 + square * series)
    else:
        zeroth = (1.0 - decay) / d
        first = (0.5 * h * (1.0 + decay) - zeroth) / d
        second = (0.25 * h * h * (1.0 - decay) - 2.0 * first) / d
    moved = force * (zeroth + 0.5 * turn * second) + slope * first + 0.5 * bend * second
    return decay * q + np.exp(-0.125 * turn * h * h) * moved


@inlined
def _weights(time: float, duration: float) -> tuple[int, float]:
    """First of four nodes around a time, and the place of the time from there in nodes."""
    place = (NODES - 1) * time / duration
    first = min(max(int(place) - 1, 0), NODES - 4)
    return first, place - first


@inlined
def _force(values: Complexes, time: float, duration: float) -> tuple[complex, complex, complex]:
    """G and its first two derivatives over time, by the cubic through four nodes."""
    first, s = _weights(time, duration)
    a, b, c, d = values[first], values[first + 1], values[first + 2], values[first + 3]
    scale = (NODES - 1) / duration
    # Newton's form with divided differences over nodes 0 to 3
    one, two, three = b - a, 0.5 * (c - 2.0 * b + a), (d - 3.0 * c + 3.0 * b - a) / 6.0
    value = a + s * (one + (s - 1.0) * (two + (s - 2.0) * three))
    slope = one + (2.0 * s - 1.0) * two + (3.0 * s * s - 6.0 * s + 2.0) * three
    bend = 2.0 * two + (6.0 * s - 6.0) * three
    return value, slope * scale, bend * scale**2


@inlined
def _torque(
    case: int, passes: Passes, shaft: int, time: float, states: Complexes, line: Floats
) -> None:
    """Fill in the harmonics of the torque in a shaft at a time."""
    first, s = _weights(time, passes.duration[case])
    a, b = -(s - 1.0) * (s - 2.0) * (s - 3.0) / 6.0, 0.5 * s * (s - 2.0) * (s - 3.0)
    c, d = -0.5 * s * (s - 1.0) * (s - 3.0), s * (s - 1.0) * (s - 2.0) / 6.0
    near = passes.smooth[case, first : first + 4, shaft]
    for part in range(2):
        for v in range(line.shape[1]):
            line[part, v] = (
                a * near[0, part, v] + b * near[1, part, v]
                + c * near[2, part, v] + d * near[3, part, v]
            )  # fmt: skip
    for number in range(states.size):
        pair = passes.first[case] + number
        value = passes.torque[pair, shaft] * states[number]
        line[0, passes.order[pair]] += value.real
        line[1, passes.order[pair]] += value.imag
