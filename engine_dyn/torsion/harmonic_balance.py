r"""Periodic twists of couplings that are not linear, by harmonic balance: the compiled part.

The twist of coupling c is delta_c(tau) = Re sum_m r_cm exp(i m tau), m = 0 .. M, sampled at N = 4 M
points of the period. The coupling's torque there exceeds that of its linear form by
D_c = f_c(delta_c) - k_c delta_c, without the linear form's damping. With the response l of the
linear system and the twist rho_cd of coupling c under a unit torque and its opposite at the two
sides of d,

    G_cm = r_cm - lambda l_cm - sum_d rho_cdm D_dm = 0,

for m = 0 with l_c0 = T_c/k_c of the mean torque T and rho_cc0 = -1/k_c: the mean of f is T. Where
f is linear, D = 0. The factor lambda on what excites is 1 at the end.

Harmonics up to U are unknowns of Newton's method. Beyond, where |rho| times the largest change of
slope stays below `BEYOND`, r_m = l_m + rho D_m converges by itself, and each step of Newton's
method takes it along: no harmonic that the samples hold is left out.

With two-sided harmonics s_p of the change of slope s = df/d delta - k, a change dr_n adds

    dD_m = dr_n s_(m-n) + conj(dr_n) s_(m+n),    m, n >= 1,

A table of the torque has corners, and samples see them in jumps. So where the twist runs through a
corner between two samples a and b, at the part u of the way, both get their part of what the corner
takes from the chord, -1/2 ds |b - a| u (1 - u), with the weights 1 - u and u: the sums over the
samples are then smooth in r, and exact to the second power of the step.

Dry friction is a spring k_f in series with a slider that holds the torque F (Jenkins). From sample
to sample the spring adds k_f times the change of the twist, cut at +-F, with the corner treated as
before; two periods make it periodic. It sticks again where the twist turns, at the vertex tau_o of
the parabola through three samples: dD = k_f (d delta(tau) - d delta(tau_o)) until it slips, one
more product of a column and a row for each time that it sticks.

From lambda = 0 the curve of solutions is followed by its arc length (Keller), also where it turns
back, to the first solution of lambda = 1: the motion that grows from small ones at this speed. A
step counts if its corrections contract. Where that fails, lambda is put on D in place of l: the
motion that comes from the linear one. Sources: Krack and Gross, Harmonic Balance
for Nonlinear Vibration Problems; Cameron and Griffin (1989), for samples in time.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.types import Complexes, Floats, Integers

BEYOND = 0.1  # Largest |rho| times change of slope of harmonics that are no unknowns

MOST_UNKNOWNS = 900  # Largest number of unknowns of a case

LEFT = 1e-4  # Largest size of the last step of a solution, which is part of its error

FROM_REST, FROM_LINEAR, KNOWN = 0, 1, 2
"""Where a solution comes from: from no excitation, from the linear system, or what is given."""

STEPS = 30, 100
"""Largest numbers of steps along the first two curves of solutions."""

# Part of the stiffness that Newton's method, not the torque, has in the clearance, where otherwise
# no mean torque would tell the mean twist.
SLACK = 1e-6


class Laws(NamedTuple):
    """Couplings of all cases; C of them.

    Points of coupling c are those from `first[c]` to before `first[c + 1]` of P; the ends go on
    straight. A clearance is a piece without slope.
    """

    first: Integers
    twist: Floats  # rad, ascending; shape (cases, P)
    torque: Floats  # N m; shape (cases, P)
    slope: Floats  # from each point to the next [N m/rad]; shape (cases, P)
    stiffness: Floats  # that of the linear form [N m/rad]; shape (cases, C)
    friction: Floats  # torque F of the slider [N m]; shape (cases, C)
    stick: Floats  # stiffness k_f of the spring before it [N m/rad]; shape (cases, C)


class Balance(NamedTuple):
    """Cases; the last axis has the harmonics 0 .. M."""

    linear: Complexes  # l, shape (cases, C, M + 1)
    receptance: Complexes  # rho, shape (cases, C, C, M + 1)
    wave: Complexes  # exp(2 pi i j/N), shape (N,)


class Motion(NamedTuple):
    """What is found of each case, shape (cases, C, ...)."""

    twist: Complexes  # r; a start before, shape (cases, C, M + 1)
    excess: Complexes  # D, shape (cases, C, M + 1)
    # delta and f at the samples [rad, N m], and f with what corners take; shape (cases, C, 3, N)
    samples: Floats
    # s at the samples, without friction's part, and that over k_f; shape (cases, C, 2, N)
    slope: Floats
    # Where friction has stuck since, in samples, from N on in this period; -1 from the mean twist,
    # -2 does not stick; shape (cases, C, N)
    origin: Floats
    unknowns: Integers  # U, shape (cases,)
    solved: Integers  # 1 if so; shape (cases,)
    left: Floats  # Size of the last step over that of the linear twist; shape (cases,)
    way: Integers  # Where the solution comes from; shape (cases,)


class _Scratch(NamedTuple):
    """Arrays of one case with n = C (2 U + 1) unknowns, and the way on which it is."""

    gap: Complexes  # G, shape (C, M + 1)
    drive: Complexes  # Derivative of -G by lambda, shape (C, M + 1)
    change: Complexes  # s_p, shape (C, 2 U + 1)
    columns: Complexes  # dD, shape (U + 1, 2 U + 1)
    matrix: Floats  # Jacobian, with lambda and the tangent; shape (n + 1, n + 1)
    right: Floats  # shape (n + 1,)
    tangent: Floats  # shape (n + 1,)
    before: Complexes  # twists before a step, shape (C, M + 1)
    work: Complexes  # shape (N,)


@inlined
def fourier(values: Complexes, wave: Complexes) -> None:
    """Replace N values, a power of two, by sum_j values_j exp(2 pi i j m/N)."""
    size, j = values.size, 0
    for i in range(1, size):
        bit = size >> 1
        while j & bit:
            j ^= bit
            bit >>= 1
        j ^= bit
        if i < j:
            values[i], values[j] = values[j], values[i]
    half = 1
    while half < size:
        step = size // (2 * half)
        for start in range(0, size, 2 * half):
            for k in range(half):
                one, other = values[start + k], values[start + k + half] * wave[k * step]
                values[start + k], values[start + k + half] = one + other, one - other
        half *= 2


@inlined
def _torques(
    laws: Laws, case: int, c: int, samples: Floats, slope: Floats, grip: Floats, origin: Floats
) -> None:
    """Fill in torque f, change of slope s, and friction's grip and origin, of a twist."""
    delta, torque, weighted = samples[0], samples[1], samples[2]
    first, last = laws.first[c], laws.first[c + 1] - 2
    points, rise = laws.twist[case], laws.slope[case]
    k, size, place = laws.stiffness[case, c], delta.size, first
    for i in range(size + 1):
        x, before = delta[i if i < size else 0], place
        while place > first and x < points[place]:
            place -= 1
        while place < last and x >= points[place + 1]:
            place += 1
        if i < size:
            torque[i] = laws.torque[case, place] + rise[place] * (x - points[place])
            weighted[i] = 0.0
            slope[i] = (rise[place] if rise[place] > 0.0 else SLACK * k) - k
            grip[i], origin[i] = 0.0, -2.0
        if i == 0:
            continue
        j, way = i if i < size else 0, x - delta[i - 1]
        for corner in range(min(before, place) + 1, max(before, place) + 1):
            u = (points[corner] - delta[i - 1]) / way
            bend = math.copysign(0.5, way) * (rise[corner] - rise[corner - 1])
            lost = bend * way * u * (1.0 - u)
            weighted[i - 1] -= (1.0 - u) * lost
            weighted[j] -= u * lost
            slope[i - 1] += bend * (1.0 - u) * (1.0 - 3.0 * u)
            slope[j] += bend * u * (2.0 - 3.0 * u)
    if laws.friction[case, c] > 0.0:
        _friction(laws.friction[case, c], laws.stick[case, c], samples, grip, origin)
    for i in range(size):
        weighted[i] += torque[i]


@inlined
def _friction(limit: float, stick: float, samples: Floats, grip: Floats, origin: Floats) -> None:
    """Add friction to the torque, and fill in its grip and origin."""
    delta, torque, weighted = samples[0], samples[1], samples[2]
    size, at, slips = delta.size, -1.0, False
    held = stick * (delta[0] - delta.mean())
    for i in range(2 * size + 1):
        j = i % size
        before, start = j - 1 if j else size - 1, held
        way = delta[j] - delta[before]
        counts = i > size
        if i > 0 and slips and way * held < 0.0:
            # The twist turned near the sample before.
            earlier = delta[before - 1 if before else size - 1]
            bend, rise = 2.0 * delta[before] - earlier - delta[j], 0.5 * (delta[j] - earlier)
            part = min(max(rise / bend, -1.0), 1.0) if bend != 0.0 else 0.0
            at, slips = i - 1 + part, False
            turned = delta[before] + 0.5 * rise * part
            if counts and part < 0.0:
                torque[before] += stick * (delta[before] - turned)
                grip[before], origin[before] = 1.0, at
            held += stick * (delta[j] - turned)
        elif i > 0:
            held += stick * way
        if abs(held) > limit:
            if counts and not slips:
                # It begins to slip at the part u of the way.
                full = held - start
                u = min(max((math.copysign(limit, held) - start) / full, 0.0), 1.0)
                lost = -0.5 * full * u * (1.0 - u)
                weighted[before] -= (1.0 - u) * lost
                weighted[j] -= u * lost
                grip[before] -= 0.5 * (1.0 - u) * (1.0 - 3.0 * u)
                grip[j] -= 0.5 * u * (2.0 - 3.0 * u)
                origin[j] = at
            held, slips = math.copysign(limit, held), True
        if size <= i < 2 * size:
            torque[j] += held
            if not slips:
                grip[j] += 1.0
                origin[j] = at


@inlined
def _evaluate(
    laws: Laws, balance: Balance, motion: Motion, case: int, way: int, part: float,
    scratch: _Scratch,
) -> None:  # fmt: skip
    """Fill in samples, D, harmonics of the change of slope, G and its drive, of a twist."""
    gap, drive, change, work = scratch.gap, scratch.drive, scratch.change, scratch.work
    couplings, harmonics = gap.shape
    size, wave = work.size, balance.wave
    for c in range(couplings):
        delta, weighted = motion.samples[case, c, 0], motion.samples[case, c, 2]
        slope, grip = motion.slope[case, c, 0], motion.slope[case, c, 1]
        k, stick = laws.stiffness[case, c], laws.stick[case, c]
        work[:] = 0.0
        work[:harmonics] = motion.twist[case, c]
        fourier(work, wave)
        for i in range(size):
            delta[i] = work[i].real
        _torques(laws, case, c, motion.samples[case, c], slope, grip, motion.origin[case, c])
        # Both are real: one transform serves the two.
        for i in range(size):
            work[i] = complex(weighted[i] - k * delta[i], -slope[i] - stick * grip[i])
        fourier(work, wave)
        for m in range(harmonics):
            back = np.conj(work[size - m if m else 0])
            motion.excess[case, c, m] = np.conj(work[m] + back) / size
        motion.excess[case, c, 0] *= 0.5
        for p in range(change.shape[1]):
            back = np.conj(work[size - p if p else 0])
            change[c, p] = np.conj(0.5j * (work[p] - back)) / size
    for c in range(couplings):
        for m in range(harmonics):
            linear, excess = balance.linear[case, c, m], 0j
            for d in range(couplings):
                excess += balance.receptance[case, c, d, m] * motion.excess[case, d, m]
            if way == FROM_REST and m > 0:
                drive[c, m], rest = linear, excess
            elif way == FROM_REST:
                drive[c, m], rest = 0j, linear + excess
            else:
                drive[c, m], rest = excess, linear
            gap[c, m] = motion.twist[case, c, m] - rest - part * drive[c, m]


@inlined
def _jacobian(
    laws: Laws, balance: Balance, motion: Motion, case: int, share: float, scratch: _Scratch
) -> None:
    """Fill in dG of the unknowns: r_0, real and imaginary part of r_1, r_2 ... of each coupling.

    `share` is the factor on D.
    """
    change, matrix, columns = scratch.change, scratch.matrix, scratch.columns
    couplings, size = change.shape[0], balance.wave.size
    most = (columns.shape[1] - 1) // 2
    width = 2 * most + 1
    row, column = np.empty(width), np.empty(most + 1, dtype=np.complex128)
    matrix[:] = 0.0
    for d in range(couplings):
        s = change[d]
        for m in range(most + 1):
            line = columns[m]
            line[0] = 2.0 * s[m] if m else s[0]
            for n in range(1, most + 1):
                down = s[m - n] if m >= n else np.conj(s[n - m])
                line[2 * n - 1] = down + s[m + n] if m else down.real
                line[2 * n] = 1j * (down - s[m + n]) if m else -down.imag
        origin, grip = motion.origin[case, d], motion.slope[case, d, 1]
        i = 0 if laws.friction[case, d] > 0.0 else size
        while i < size:
            since = origin[i]
            column[:] = 0.0
            while i < size and origin[i] == since:
                for m in range(most + 1 if grip[i] != 0.0 else 0):
                    column[m] -= grip[i] * np.conj(balance.wave[(i * m) % size])
                i += 1
            row[:] = 0.0
            row[0] = 1.0
            angle = since * 2.0 * math.pi / size
            for n in range(1, most + 1 if since >= 0.0 else 1):
                row[2 * n - 1], row[2 * n] = math.cos(n * angle), -math.sin(n * angle)
            for m in range(most + 1 if since != -2.0 else 0):
                scale = column[m] * laws.stick[case, d] * (2.0 if m else 1.0) / size
                for n in range(width):
                    columns[m, n] += scale * row[n]
        for c in range(couplings):
            for m in range(most + 1):
                rho, at = share * balance.receptance[case, c, d, m], c * width + 2 * m
                for n in range(width):
                    value = rho * columns[m, n]
                    if m:
                        matrix[at - 1, d * width + n] = -value.real
                        matrix[at, d * width + n] = -value.imag
                    else:
                        matrix[at, d * width + n] = -value.real
    for i in range(couplings * width):
        matrix[i, i] += 1.0


@inlined
def _solve(matrix: Floats, right: Floats) -> None:
    """Replace a right side by the solution; row operations with pivots."""
    size = right.size
    for i in range(size):
        pivot = i
        for j in range(i + 1, size):
            if abs(matrix[j, i]) > abs(matrix[pivot, i]):
                pivot = j
        if pivot != i:
            for n in range(i, size):
                matrix[i, n], matrix[pivot, n] = matrix[pivot, n], matrix[i, n]
            right[i], right[pivot] = right[pivot], right[i]
        over, line = 1.0 / matrix[i, i], matrix[i]
        for j in range(i + 1, size):
            factor = matrix[j, i] * over
            if factor != 0.0:
                below = matrix[j]
                for n in range(i + 1, size):
                    below[n] -= factor * line[n]
                right[j] -= factor * right[i]
    for i in range(size - 1, -1, -1):
        value = right[i]
        for n in range(i + 1, size):
            value -= matrix[i, n] * right[n]
        right[i] = value / matrix[i, i]


@inlined
def _bordered(
    laws: Laws, balance: Balance, motion: Motion, case: int, way: int, part: float, scale: float,
    scratch: _Scratch,
) -> None:  # fmt: skip
    """Jacobian with the column of lambda and the tangent as its last row."""
    _jacobian(laws, balance, motion, case, 1.0 if way == FROM_REST else part, scratch)
    matrix, inner = scratch.matrix, scratch.right.size - 1
    couplings, width = scratch.change.shape
    for c in range(couplings):
        for n in range(width):
            value = -scratch.drive[c, (n + 1) // 2]
            matrix[c * width + n, inner] = value.real if n == 0 or n % 2 == 1 else value.imag
    for n in range(inner):
        matrix[inner, n] = scratch.tangent[n] / scale**2
    matrix[inner, inner] = scratch.tangent[inner]


@inlined
def _move(twist: Complexes, step: Floats, beyond: Complexes, factor: float) -> float:
    """Add a step of the unknowns, and `factor` times a change of the others; sum of squares."""
    couplings, harmonics = twist.shape
    width, size = (step.size - 1) // couplings, 0.0
    for c in range(couplings):
        for m in range(harmonics):
            at = c * width + 2 * m
            if m == 0:
                change = complex(step[at], 0.0)
            elif 2 * m < width:
                change = complex(step[at - 1], step[at])
            else:
                change = factor * beyond[c, m]
            twist[c, m] += change
            size += change.real**2 + change.imag**2
    return size


@inlined
def _correct(
    laws: Laws, balance: Balance, motion: Motion, case: int, way: int, part: float, scale: float,
    damped: float, scratch: _Scratch,
) -> tuple[float, float]:  # fmt: skip
    """A part of one step of Newton's method; lambda after it, and the size of the whole step.

    It stays at right angles to the tangent, whose last number belongs to lambda.
    """
    _evaluate(laws, balance, motion, case, way, part, scratch)
    _bordered(laws, balance, motion, case, way, part, scale, scratch)
    right = scratch.right
    couplings, width = scratch.change.shape
    for c in range(couplings):
        for n in range(width):
            value = -scratch.gap[c, (n + 1) // 2]
            right[c * width + n] = value.real if n == 0 or n % 2 == 1 else value.imag
    right[-1] = 0.0
    _solve(scratch.matrix, right)
    for n in range(right.size):
        right[n] *= damped
    size = _move(motion.twist[case], right, scratch.gap, -damped)
    return part + right[-1], math.sqrt(size / scale**2 + right[-1] ** 2) / damped


@inlined
def _follow(
    laws: Laws, balance: Balance, motion: Motion, case: int, way: int, scale: float,
    scratch: _Scratch,
) -> bool:  # fmt: skip
    """Follow the curve of solutions from lambda = 0 to 1; whether it gets there."""
    twist, right, tangent = motion.twist[case], scratch.right, scratch.tangent
    part, distance, steps = 0.0, math.nan, 0
    tangent[:] = 0.0
    tangent[-1] = 1.0
    most = STEPS[0] if way == FROM_REST else STEPS[1]
    while steps < most:
        # The curve's tangent, on the side of the one before.
        _evaluate(laws, balance, motion, case, way, part, scratch)
        _bordered(laws, balance, motion, case, way, part, scale, scratch)
        right[:] = 0.0
        right[-1] = 1.0
        _solve(scratch.matrix, right)
        length = right[-1] ** 2
        for n in range(right.size - 1):
            length += (right[n] / scale) ** 2
        for n in range(right.size):
            tangent[n] = right[n] / math.sqrt(length)
        if not math.isfinite(length):
            return False
        if math.isnan(distance):
            distance = 1.0 / tangent[-1]
        scratch.before[:] = twist
        start, accepted, last = part, False, False
        while not accepted and not last:
            steps += 1
            last = part + distance * tangent[-1] >= 1.0
            along = (1.0 - part) / tangent[-1] if last else distance
            part = 1.0 if last else part + along * tangent[-1]
            for n in range(right.size):
                right[n] = along * tangent[n]
            _move(twist, right, scratch.drive, right[-1])
            if last:
                tangent[:] = 0.0
                tangent[-1] = 1.0
            went = 0.5 * along
            corrections = 0
            while corrections < 12:
                corrections += 1
                part, moved = _correct(laws, balance, motion, case, way, part, scale, 1.0, scratch)
                accepted = moved < max(1e-6, 1e-3 * along)
                if accepted or not moved < went:
                    break
                went = moved
            if accepted and last:
                return True
            if accepted:
                distance *= 2.0 if corrections <= 4 else 1.0
            else:
                distance, part = 0.4 * along, start
                twist[:] = scratch.before
                if distance < 1e-7 or steps >= most:
                    return False
                # The drive belongs to the point at which the step begins.
                _evaluate(laws, balance, motion, case, way, part, scratch)
    return False


@inlined
def _unknowns(laws: Laws, balance: Balance, case: int) -> int:
    """Number of harmonics that are unknowns."""
    couplings, harmonics = balance.linear.shape[1:]
    most = 1
    for d in range(couplings):
        steepest = 0.0
        for place in range(laws.first[d], laws.first[d + 1] - 1):
            steepest = max(steepest, laws.slope[case, place])
        if laws.friction[case, d] > 0.0:
            steepest += laws.stick[case, d]
        changes = max(steepest - laws.stiffness[case, d], laws.stiffness[case, d])
        for c in range(couplings):
            for m in range(most + 1, harmonics):
                if abs(balance.receptance[case, c, d, m]) * changes > BEYOND:
                    most = m
    return min(most, (MOST_UNKNOWNS // couplings - 1) // 2)


@kernel
def periodic_motions(
    cases: Integers, laws: Laws, balance: Balance, motion: Motion, way: int
) -> None:
    """Solve cases from the twist given in `motion`, in one of three ways."""
    couplings, harmonics = balance.linear.shape[1:]
    for case in cases:
        most = _unknowns(laws, balance, case)
        width = 2 * most + 1
        inner = couplings * width
        scratch = _Scratch(
            np.empty((couplings, harmonics), dtype=np.complex128),
            np.empty((couplings, harmonics), dtype=np.complex128),
            np.empty((couplings, width), dtype=np.complex128),
            np.empty((most + 1, width), dtype=np.complex128),
            np.empty((inner + 1, inner + 1)), np.empty(inner + 1), np.empty(inner + 1),
            np.empty((couplings, harmonics), dtype=np.complex128),
            np.empty(balance.wave.size, dtype=np.complex128),
        )  # fmt: skip
        motion.unknowns[case], motion.solved[case] = most, 0
        scale = 0.0
        for c in range(couplings):
            for m in range(1, harmonics):
                scale += abs(balance.linear[case, c, m]) ** 2
        scale = math.sqrt(scale) if scale > 0.0 else 1.0
        if way != KNOWN and not _follow(laws, balance, motion, case, way, scale, scratch):
            continue
        scratch.tangent[:] = 0.0
        scratch.tangent[-1] = 1.0
        moved, damped = 1.0, 1.0
        for _ in range(60):
            went = moved
            _, moved = _correct(laws, balance, motion, case, FROM_REST, 1.0, scale, damped, scratch)
            if not moved > 1e-11:
                break
            # Friction turns from sample to sample in small jumps, between which steps may swing.
            damped = max(0.5 * damped, 0.1) if moved > 0.7 * went else min(2.0 * damped, 1.0)
        _evaluate(laws, balance, motion, case, FROM_REST, 1.0, scratch)
        motion.left[case] = moved
        motion.solved[case] = 1 if moved < LEFT else 0
