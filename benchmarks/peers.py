"""What a competent engineer would write instead: a compiled loop, SciPy, harmonic balance.

All have constant inertia. They solve for q = (omega/omega_n)^2 in the energy form, over one firing
period, constant parts of the torque tabulated or evaluated for each design as part of the work:

    dq/dphi = drive(phi) - kappa q^(alpha/2),      q(period) = q(0).

Shooting for the start is Newton with the tangent s = dq/dq(0) carried along; at alpha = 2 the
equation is linear, so that one step is exact, and at alpha = 0 the return map is the identity and
the level follows from the closure, the mean of log q being zero. Extremes come from a cubic Hermite
through nodes and slopes, the mean speed from the nodes. Harmonic balance shoots for nothing and has
the extremes of its Fourier series. Every solver runs on all threads asked for: compiled ones in
threads, those bound by Python in processes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from typing import Any

import numba
import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.problem import (
    CRANKCASE,
    CYCLE,
    LEVER,
    MOTORED,
    PRESSURE,
    RADIUS,
    Designs,
)
from engine_dyn.types import Floats
from oracle.spline import velocity

Solver = Callable[[Designs], Floats]

FAST = {"reassoc", "contract", "nsz", "arcp", "afn"}
compiled: Any = numba.njit(nogil=True, fastmath=FAST, error_model="numpy")
# Shooting ends at steps of the start this small, relative: the last one is applied all along the
# cycle by the tangent, which leaves its square, times a factor that is small here.
SMALL_STEP = 1e-5
MOST_SWEEPS = 8


@dataclass(frozen=True)
class Case:
    """One solver at one setting.

    `least` are the designs of a run at least: those in arrays need many at once.
    """

    series: str
    setting: str
    solve: Solver
    runs: int = 5
    least: int = 16
    exponents: tuple[float, ...] = ()  # the only ones it solves; none: all


def in_threads(work: Callable[[int, int], None], size: int, threads: int) -> None:
    """Call `work(begin, end)` on chunks of 0 .. size - 1, several a thread to even them out."""
    pieces = min(size, 4 * threads)
    edges = [size * i // pieces for i in range(pieces + 1)]
    if threads == 1:
        work(0, size)
        return
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, edges[:-1], edges[1:]))


class Processes:
    """Python-bound solvers in processes of their own, started once and warmed."""

    def __init__(self, count: int) -> None:
        self.count = count
        self.pool = ProcessPoolExecutor(count, mp_context=get_context("spawn"))
        # They import this file now, not in the first call of a solver.
        list(self.pool.map(steps_of, [360] * count, [1] * count))

    def __call__(self, solver: Solver, designs: Designs) -> Floats:
        """`solver` over chunks of the designs."""
        pieces = min(len(designs), 4 * self.count)
        chunks = [designs.take(slice(i, None, pieces)) for i in range(pieces)]
        delta = np.empty(len(designs))
        for i, part in enumerate(self.pool.map(solver, chunks)):
            delta[i::pieces] = part
        return delta

    def close(self) -> None:
        """End the processes."""
        self.pool.shutdown()


# Shared by all peers ------------------------------------------------------------------------------


@compiled
def hermite_extreme(y0: float, y1: float, d0: float, d1: float, sign: float) -> float:
    """Largest (or smallest) value of a cubic on 0..1 whose slopes at the ends differ in sign."""
    a = 6.0 * (y0 - y1) + 3.0 * (d0 + d1)
    b = 6.0 * (y1 - y0) - 4.0 * d0 - 2.0 * d1
    root = math.sqrt(max(b * b - 4.0 * a * d0, 0.0))
    # The root at which the slope changes from sign to -sign, in the form without cancellation.
    t = -2.0 * d0 / (b - sign * root) if b * sign <= 0.0 else (-b - sign * root) / (2.0 * a)
    t = min(max(t, 0.0), 1.0)
    cubic = y0 + t * (d0 + t * (3.0 * (y1 - y0) - 2.0 * d0 - d1 + t * (2.0 * (y0 - y1) + d0 + d1)))
    return max(cubic, y0, y1) if sign > 0.0 else min(cubic, y0, y1)


@compiled
def delta_of(q: Floats, slope: Floats, width: float) -> float:
    """Delta from q and dq/dphi at the nodes of a period (its end not repeated)."""
    nodes = q.size
    total = 0.0
    high = low = q[0]
    for j in range(nodes):
        total += math.sqrt(q[j])
        high, low = max(high, q[j]), min(low, q[j])
        right = j + 1 if j + 1 < nodes else 0
        # Every interval with an extreme inside: the largest node need not lie beside the largest.
        if slope[j] > 0.0 and slope[right] < 0.0:
            high = max(
                high, hermite_extreme(q[j], q[right], width * slope[j], width * slope[right], 1.0)
            )
        elif slope[j] < 0.0 and slope[right] > 0.0:
            low = min(
                low, hermite_extreme(q[j], q[right], width * slope[j], width * slope[right], -1.0)
            )
    return (math.sqrt(high) - math.sqrt(low)) * nodes / total


@compiled
def level_of(work: Floats) -> float:
    """Level c at which the mean of log(c + work) vanishes: alpha = 0."""
    level = 1.0 - work.min() if 1.0 + work.min() <= 0.0 else 1.0
    for _ in range(50):
        closing = slope = 0.0
        for j in range(work.size):
            value = level + work[j]
            closing += math.log(value)
            slope += 1.0 / value
        level -= closing / slope
        if abs(closing) < 1e-13 * work.size:
            break
    return level


def steps_of(nodes: int, cylinders: int) -> int:
    """Steps over a firing period, of `nodes` over the cycle; many cylinders need a few."""
    return max(nodes // cylinders, 24)


# Numba: a loop over designs -----------------------------------------------------------------------


@compiled
def loop(
    begin: int, end: int, sine: Floats, cosine: Floats, motored: Floats, burnt: Floats,
    ratio: Floats, mass: Floats, speed: Floats, inertia: Floats, friction: Floats,
    exponent: Floats, heat: Floats, cylinders: int, nodes: int, delta: Floats,
) -> None:  # fmt: skip
    """Designs begin .. end - 1; tables over the cycle hold nodes and midpoints."""
    period = 4.0 * math.pi / cylinders
    h = period / nodes
    gas, shape, drive = np.empty(2 * nodes + 1), np.empty(2 * nodes + 1), np.empty(2 * nodes + 1)
    q, slope, along = np.empty(nodes + 1), np.empty(nodes), np.empty(nodes)
    for i in range(begin, end):
        lam, burning = ratio[i], heat[i]
        mean_gas = 0.0
        for j in range(2 * nodes):
            g = s = 0.0
            for z in range(cylinders):
                at = j + 2 * nodes * z
                root = math.sqrt(1.0 - (lam * sine[at]) ** 2)
                v = sine[at] * (1.0 + lam * cosine[at] / root)
                b = cosine[at] + lam * (
                    cosine[at] ** 2 - sine[at] ** 2 + lam**2 * sine[at] ** 4
                ) / (root * root * root)
                g += (motored[at] + burning * burnt[at]) * v
                s += b * v
            gas[j], shape[j] = g, s
            mean_gas += g
        gas[2 * nodes], shape[2 * nodes] = gas[0], shape[0]
        mean_gas /= 2 * nodes
        scale = 2.0 / (inertia[i] * speed[i] ** 2)
        eta = mass[i] * RADIUS * RADIUS / inertia[i]
        kappa = scale * (LEVER * mean_gas - friction[i])
        half = 0.5 * exponent[i]
        a0, a1 = scale * LEVER, scale * friction[i]
        a2 = 2.0 * eta
        for j in range(2 * nodes + 1):
            drive[j] = a0 * gas[j] - a1 - a2 * shape[j]
        if half == 0.0:
            q[0] = 0.0
            for j in range(nodes):
                q[j + 1] = q[j] + h * (
                    (drive[2 * j] + 4.0 * drive[2 * j + 1] + drive[2 * j + 2]) / 6.0 - kappa
                )
            level = level_of(q[:nodes])
            for j in range(nodes):
                q[j] += level
        elif half == 1.0:
            # The load's decay is exact, what it acts on by Simpson's rule.
            whole, part = math.exp(-kappa * h), math.exp(-0.5 * kappa * h)
            b0, b1, b2 = h / 6.0 * whole, h / 1.5 * part, h / 6.0
            value = 0.0
            for j in range(nodes):
                value = whole * value + (
                    b0 * drive[2 * j] + b1 * drive[2 * j + 1] + b2 * drive[2 * j + 2]
                )
            value /= -math.expm1(-kappa * period)
            for j in range(nodes):
                q[j] = value
                value = whole * value + (
                    b0 * drive[2 * j] + b1 * drive[2 * j + 1] + b2 * drive[2 * j + 2]
                )
        else:
            start = 1.0
            for _ in range(MOST_SWEEPS):
                value, tangent = start, 1.0
                for j in range(nodes):
                    q[j], along[j] = value, tangent
                    p = _power(value, half)
                    k1 = drive[2 * j] - kappa * p
                    g1 = -kappa * half * p / value
                    u = value + 0.5 * h * k1
                    p = _power(u, half)
                    k2 = drive[2 * j + 1] - kappa * p
                    g2 = -kappa * half * p / u * (1.0 + 0.5 * h * g1)
                    u = value + 0.5 * h * k2
                    p = _power(u, half)
                    k3 = drive[2 * j + 1] - kappa * p
                    g3 = -kappa * half * p / u * (1.0 + 0.5 * h * g2)
                    u = value + h * k3
                    p = _power(u, half)
                    k4 = drive[2 * j + 2] - kappa * p
                    g4 = -kappa * half * p / u * (1.0 + h * g3)
                    value += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
                    tangent *= 1.0 + h / 6.0 * (g1 + 2.0 * (g2 + g3) + g4)
                step = (value - start) / (1.0 - tangent)
                start += step
                if abs(step) < SMALL_STEP * start:
                    break
            for j in range(nodes):
                q[j] += step * along[j]
        for j in range(nodes):
            slope[j] = drive[2 * j] - kappa * _power(q[j], half)
        delta[i] = delta_of(q[:nodes], slope, h)


@compiled
def _power(u: float, half: float) -> float:
    if half == 1.0:
        return u
    if half == 0.5:
        return math.sqrt(u)
    if half == 0.0:
        return 1.0
    return u**half


def numba_loop(nodes: int, threads: int) -> Solver:
    """The good hand-written loop with `nodes` steps over the cycle of one cylinder."""

    def solver(designs: Designs) -> Floats:
        z = designs.cylinders
        steps = steps_of(nodes, z)
        phi = np.arange(2 * steps * z) * CYCLE / (2 * steps * z)
        motored = MOTORED(phi)
        tables = np.sin(phi), np.cos(phi), motored - CRANKCASE, PRESSURE(phi) - motored
        columns = [getattr(designs, name) for name in Designs.COLUMNS]
        delta = np.empty(len(designs))

        def work(begin: int, end: int) -> None:
            loop(begin, end, *tables, *columns, z, steps, delta)

        in_threads(work, len(designs), threads)
        return delta

    return solver


# SciPy, one design after the other ----------------------------------------------------------------

_CHARGE, _COMPRESSION, _RATIO = PRESSURE.charge, PRESSURE.compression, PRESSURE.ratio
_POLYTROPIC, _BURN, _AFTER = PRESSURE.polytropic, PRESSURE.burn, PRESSURE.after
_BURN_ANGLE, _BURN_POWER = PRESSURE.burn_angle, 2 * PRESSURE.burn_order
_AFTER_ANGLE, _AFTER_POWER = PRESSURE.after_angle, 2 * PRESSURE.after_order

MEAN_PHI = np.arange(360) * CYCLE / 360
"""Equal steps integrate a smooth periodic torque to rounding: 2 degrees are enough here."""


@compiled
def right_side(phi: float, state: Floats, numbers: tuple[float, ...], cylinders: int) -> Floats:
    """dq/dphi and ds/dphi, compiled, because SciPy calls it thousands of times.

    `numbers` are ratio, gas, shape, friction, kappa, half and heat: the drive is the sum over the
    cylinders of gas (p - p_crankcase) v - shape b v, less friction, the load kappa q^half.
    """
    ratio, gas, shape, friction, kappa, half, heat = numbers
    drive = -friction
    for cylinder in range(cylinders):
        at = phi + cylinder * CYCLE / cylinders
        sine, cosine = math.sin(at), math.cos(at)
        volume = 1.0 + (_RATIO - 1.0) * math.sin(0.5 * at) ** 2
        compressed = (_RATIO / volume) ** _POLYTROPIC - 1.0
        bar = _CHARGE + _COMPRESSION * compressed * math.cos(0.25 * at) ** 8
        bar += heat * _BURN * math.cos(0.25 * (at - _BURN_ANGLE)) ** _BURN_POWER
        bar += heat * _AFTER * math.cos(0.25 * (at - _AFTER_ANGLE)) ** _AFTER_POWER
        root = math.sqrt(1.0 - ratio * ratio * sine * sine)
        v = sine * (1.0 + ratio * cosine / root)
        b = cosine + ratio * (cosine**2 - sine**2 + ratio**2 * sine**4) / root**3
        drive += (gas * (1e5 * bar - CRANKCASE) - shape * b) * v
    load = kappa * state[0] ** half if half > 0.0 else kappa
    return np.array([drive - load, -half * load / state[0] * state[1] if half > 0.0 else 0.0])


def scipy_ivp(designs: Designs, tolerance: float, whole: int) -> Floats:
    """DOP853, shooting for the start, one design after the other."""
    cylinders = designs.cylinders
    steps = steps_of(whole, cylinders)
    period = CYCLE / cylinders
    phi = np.arange(steps) * period / steps
    motored = MOTORED(MEAN_PHI) - CRANKCASE
    burnt = PRESSURE(MEAN_PHI) - MOTORED(MEAN_PHI)
    delta = np.empty(len(designs))
    for i in range(len(designs)):
        ratio, mass, speed, inertia, friction, exponent, heat = (
            float(getattr(designs, name)[i]) for name in Designs.COLUMNS
        )
        scale, half = 2.0 / (inertia * speed**2), 0.5 * exponent
        mean = float(np.mean(velocity(MEAN_PHI, ratio) * (motored + heat * burnt)))
        numbers = (ratio, scale * LEVER, 2.0 * mass * RADIUS**2 / inertia, scale * friction,
                   scale * (cylinders * LEVER * mean - friction), half, heat)  # fmt: skip

        def run(start: float, where: Floats | None, numbers: Any = numbers) -> Any:
            return solve_ivp(
                right_side, (0.0, period), [start, 1.0], method="DOP853", t_eval=where,
                args=(numbers, cylinders), rtol=tolerance, atol=tolerance, max_step=0.35,
            ).y  # fmt: skip

        start = 1.0
        for _ in range(MOST_SWEEPS if half > 0.0 else 0):
            end = run(start, None)[:, -1]
            step = (end[0] - start) / (1.0 - end[1])
            start += step
            if half == 1.0 or abs(step) < 0.1 * tolerance:
                break
        q = run(start, phi)[0]
        if half == 0.0:
            q += level_of(q - q[0]) - q[0]
        slope = np.array([right_side(*each, numbers, cylinders)[0]
                          for each in zip(phi, np.stack([q, q], axis=1), strict=True)])  # fmt: skip
        delta[i] = delta_of(q, slope, phi[1])
    return delta


# Harmonic balance: NumPy again, one FFT of the torque ---------------------------------------------

NODES_AT_ONCE = 20_000
"""Nodes of all designs of a block, whose arrays so stay in the caches."""

LEAST_NODES = 12
"""Over a firing period; the steps of other peers need more, see `steps_of`."""

DEGREE = 7
"""Of the Taylor polynomial of the Fourier series about a node."""


def harmonic_balance(designs: Designs, whole: int) -> Floats:
    """One division a harmonic: alpha = 2 and constant inertia, where the equation is linear.

    The torque at nodes, `whole` of them over the cycle of one cylinder, is transformed. Its zeroth
    harmonic is the mean torque, hence kappa; harmonic k of q is that of the drive over i k + kappa.
    The last harmonic is left out, because nodes do not tell its phase. The transform back gives q
    at the nodes, and their mean speed.

    Extremes are those of the Fourier series, not of the nodes, see `_refined`. What error remains
    is that of too few nodes, and it falls exponentially with their number.
    """
    z = designs.cylinders
    nodes = 2 * math.ceil(max(whole / z, LEAST_NODES) / 2)
    phi = np.arange(nodes * z) * CYCLE / (nodes * z)
    motored = MOTORED(phi)
    # Both revolutions of a cycle have the same kinematics, and pressures of their own.
    motored, burnt = (
        curve.reshape(2, -1) for curve in (motored - CRANKCASE, PRESSURE(phi) - motored)
    )
    sine, cosine = (curve(phi[: phi.size // 2]) for curve in (np.sin, np.cos))
    wave = 0.5j * z * np.arange(nodes // 2)
    at_nodes = 2.0 * np.exp(np.outer(phi[:nodes], wave))
    powers = [wave**order / math.factorial(order) for order in range(1, DEGREE + 1)]
    weights = [power.real + power.imag for power in powers]  # one of the two is zero
    delta = np.empty(len(designs))
    block = max(1, NODES_AT_ONCE // nodes)
    for begin in range(0, len(designs), block):
        some = designs.take(slice(begin, begin + block))
        column = {name: getattr(some, name)[:, None] for name in Designs.COLUMNS}
        ratio, scale = column["ratio"], 2.0 / (column["inertia"] * column["speed"] ** 2)
        root = np.sqrt(1.0 - (ratio * sine) ** 2)
        v = sine * (1.0 + ratio * cosine / root)
        b = cosine + ratio * (cosine**2 - sine**2 + ratio**2 * sine**4) / (root * root * root)
        b *= 2.0 * column["mass"] * RADIUS**2 / column["inertia"]
        gas = (scale * LEVER)[:, None] * (motored + column["heat"][:, None] * burnt)
        drive = ((gas - b[:, None]) * v[:, None]).reshape(len(some), z, nodes).sum(axis=1)
        waves = np.fft.rfft(drive, norm="forward")[:, :-1]
        waves[:, :1] -= scale * column["friction"]
        waves /= wave + waves[:, :1].real
        q = np.fft.irfft(waves, nodes, norm="forward")
        high, low = _refined(q, waves, at_nodes, weights, 0.5 * phi[1])
        mean = np.sqrt(q).mean(axis=1)
        delta[begin : begin + block] = (np.sqrt(high) - np.sqrt(low)) / mean
    return delta


def _refined(
    q: Floats, waves: Any, at_nodes: Any, weights: Sequence[Floats], reach: float
) -> tuple[Floats, Floats]:
    """Largest and smallest value of the Fourier series of each row, `q` at its nodes.

    Every node near which the series can pass the best node is refined: the largest node need not
    lie beside the largest value. The series is expanded about it, and Newton's steps on the slope
    of the polynomial find the extreme within `reach`, half the distance of two nodes.
    """
    high, low = q.max(axis=1), q.min(axis=1)
    beside = np.empty_like(q)
    np.add(q[:, :-2], q[:, 2:], out=beside[:, 1:-1])
    np.add(q[:, -2], q[:, 0], out=beside[:, -1])
    np.add(q[:, -1], q[:, 1], out=beside[:, 0])
    # A parabola through three nodes rises by at most an eighth of its second difference above the
    # middle one; twice that is allowed.
    bound = 1.5 * q - 0.25 * beside
    row, node = np.nonzero((bound >= high[:, None]) | (bound <= low[:, None]))
    terms = waves[row] * at_nodes[node]
    # No product of matrices: the threads of BLAS would be in the way of the other processes.
    parts = np.ascontiguousarray(terms.real), -np.ascontiguousarray(terms.imag)
    taylor = [np.einsum("ck,k->c", parts[i % 2], weight) for i, weight in enumerate(weights, 1)]
    step = np.zeros(row.size)
    for _ in range(3):
        slope, bend = np.zeros(row.size), np.zeros(row.size)
        for order in range(DEGREE, 0, -1):
            bend = bend * step + slope
            slope = slope * step + order * taylor[order - 1]
        step = np.clip(step - slope / bend, -reach, reach)
    value = np.zeros(row.size)
    for coefficient in reversed(taylor):
        value = (value + coefficient) * step
    value += q[row, node]
    np.maximum.at(high, row, value)
    np.minimum.at(low, row, value)
    return high, low


# All of them --------------------------------------------------------------------------------------


def cases(threads: int, processes: Processes, quick: bool) -> list[Case]:
    """All peers at several settings."""

    def alone(solver: Callable[..., Floats], **options: Any) -> Solver:
        """Bound by Python: in processes."""
        return partial(processes, partial(solver, **options))

    found = [
        Case("Numba loop", f"{n} steps", numba_loop(n, threads))
        for n in (90, 180, 360, 720, 1440, 2880)[:: 2 if quick else 1]
    ]
    found += [
        Case("Harmonic balance", f"{n} nodes", alone(harmonic_balance, whole=n),
             least=64 if quick else 2048, exponents=(2.0,))
        for n in ((96,) if quick else (64, 96, 112, 128, 180))
    ]  # fmt: skip
    found += [
        Case("SciPy solve_ivp", f"DOP853, {t:.0e}", alone(scipy_ivp, tolerance=t, whole=n), runs=3)
        for t, n in (((1e-6, 720),) if quick else ((1e-5, 360), (1e-7, 720), (1e-10, 2880)))
    ]
    return found
