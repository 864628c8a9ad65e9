"""What a competent engineer would write instead, one function (or a pair) a peer.

All solve for q = (omega/omega_n)^2 in the energy form, over one firing period, constant parts of
the torque tabulated or evaluated for each design as part of the work:

    dq/dphi = drive(phi) - kappa q^(alpha/2),      q(period) = q(0).

Shooting for the start is Newton with the tangent s = dq/dq(0) carried along; at alpha = 2 the
equation is linear, so that one step is exact, and at alpha = 0 the return map is the identity and
the level follows from the closure, the mean of log q being zero. Extremes come from a cubic Hermite
through nodes and slopes, the mean speed from the nodes. Harmonic balance shoots for nothing and has
the extremes of its Fourier series. Every solver runs on all threads asked for: compiled ones in
threads, those bound by Python in processes.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from typing import Any

import numba
import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_bvp, solve_ivp

from benchmarks.problem import (
    BORE,
    CRANKCASE,
    CYCLE,
    LEVER,
    MOTORED,
    PRESSURE,
    RADIUS,
    STROKE,
    Designs,
    kinematics,
    pressure_of,
)
from engine_dyn.types import Floats

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

    `least` and `most` bound the designs of a run: those in arrays need many at once. `scenes`: it
    is shown in the factorial scenes too.
    """

    series: str
    setting: str
    solve: Solver
    runs: int = 5
    least: int = 16
    most: int = 1_000_000
    scenes: bool = False
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
def level_of(work: Floats, theta: Floats) -> float:
    """Level c at which the mean of log((c + work)/theta) vanishes: alpha = 0."""
    level = 1.0 - work.min() if 1.0 + work.min() <= 0.0 else 1.0
    for _ in range(50):
        closing = slope = 0.0
        for j in range(work.size):
            value = level + work[j]
            closing += math.log(value / theta[j])
            slope += 1.0 / value
        level -= closing / slope
        if abs(closing) < 1e-13 * work.size:
            break
    return level


_P = PRESSURE


@compiled
def pressure_at(phi: float, heat: float) -> float:
    """The closed-form pressure [Pa], for right-hand sides that are called angle by angle."""
    volume = 1.0 + (_P_RATIO - 1.0) * math.sin(0.5 * phi) ** 2
    bar = _P_COMPRESSION * ((_P_RATIO / volume) ** _P_POLYTROPIC - 1.0) * math.cos(0.25 * phi) ** 8
    bar += heat * _P_BURN * math.cos(0.25 * (phi - _P_BURN_ANGLE)) ** (2 * _P_BURN_ORDER)
    bar += heat * _P_AFTER * math.cos(0.25 * (phi - _P_AFTER_ANGLE)) ** (2 * _P_AFTER_ORDER)
    return 1e5 * (_P_CHARGE + bar)


_P_CHARGE, _P_COMPRESSION, _P_RATIO, _P_POLYTROPIC = (
    _P.charge, _P.compression, _P.ratio, _P.polytropic,
)  # fmt: skip
_P_BURN, _P_BURN_ANGLE, _P_BURN_ORDER = _P.burn, _P.burn_angle, _P.burn_order
_P_AFTER, _P_AFTER_ANGLE, _P_AFTER_ORDER = _P.after, _P.after_angle, _P.after_order


@dataclass(frozen=True)
class Coefficients:
    """Of dq/dphi for designs of constant inertia and one number of cylinders, one column each.

    drive = sum over the cylinders of gas (p - p_crankcase) v - shape b v, less friction;
    `heat` is the factor on the combustion's part of p.
    """

    ratio: Floats
    gas: Floats
    shape: Floats
    friction: Floats
    kappa: Floats
    half: Floats
    heat: Floats
    cylinders: int

    NUMBERS = ("ratio", "gas", "shape", "friction", "kappa", "heat")

    @property
    def period(self) -> float:
        """Angle between two firings [rad]."""
        return CYCLE / self.cylinders

    def take(self, index: Any) -> Coefficients:
        """The designs at `index`."""
        columns: dict[str, Any] = {n: getattr(self, n)[index] for n in (*self.NUMBERS, "half")}
        return Coefficients(**columns, cylinders=self.cylinders)


MEAN_PHI = np.arange(360) * CYCLE / 360
"""Equal steps integrate a smooth periodic torque to rounding: 2 degrees are enough here."""
MEAN_MOTORED = MOTORED(MEAN_PHI) - CRANKCASE
MEAN_BURNT = PRESSURE(MEAN_PHI) - MOTORED(MEAN_PHI)


def coefficients(designs: Designs) -> Coefficients:
    """Reduced parameters, with the mean torque by quadrature."""
    if designs.variable:
        raise ValueError("this peer is written for constant inertia")
    v, _ = kinematics(MEAN_PHI, designs.ratio[:, None])
    scale = 2.0 / (designs.inertia * designs.speed**2)
    mean = (v @ MEAN_MOTORED + designs.heat * (v @ MEAN_BURNT)) / MEAN_PHI.size
    return Coefficients(
        ratio=designs.ratio,
        gas=scale * LEVER,
        shape=2.0 * designs.mass * RADIUS**2 / designs.inertia,
        friction=scale * designs.friction,
        kappa=scale * (designs.cylinders * LEVER * mean - designs.friction),
        half=0.5 * designs.exponent,
        heat=designs.heat,
        cylinders=designs.cylinders,
    )


def drives(c: Coefficients, phi: Floats) -> Floats:
    """Drive of every design at the angles, shape (designs, angles)."""
    total = np.repeat(-c.friction[:, None], phi.size, axis=1)
    for cylinder in range(c.cylinders):
        angle = phi + cylinder * c.period
        v, b = kinematics(angle, c.ratio[:, None])
        pressure = pressure_of(angle, c.heat[:, None]) - CRANKCASE
        total += (c.gas[:, None] * pressure - c.shape[:, None] * b) * v
    return np.asarray(total)


@compiled
def drive_at(
    phi: float, ratio: float, gas: float, shape: float, friction: float, heat: float,
    cylinders: int,
) -> float:  # fmt: skip
    """Drive of one design at one angle."""
    total = -friction
    for cylinder in range(cylinders):
        angle = phi + cylinder * CYCLE / cylinders
        sine, cosine = math.sin(angle), math.cos(angle)
        root = math.sqrt(1.0 - (ratio * sine) ** 2)
        v = sine * (1.0 + ratio * cosine / root)
        b = cosine + ratio * (cosine**2 - sine**2 + ratio**2 * sine**4) / root**3
        total += (gas * (pressure_at(angle, heat) - CRANKCASE) - shape * b) * v
    return total


def finish(c: Coefficients, i: int, phi: Floats, q: Floats, drive: Floats) -> float:
    """Delta of design i from q at nodes over the cycle; at alpha = 0 q is shifted to its level."""
    if c.half[i] == 0.0:
        q = q + level_of(q, np.ones_like(q))
    slope = drive - c.kappa[i] * q ** c.half[i]
    return float(delta_of(q, slope, phi[1]))


# Numba: a loop over designs -----------------------------------------------------------------------


@compiled
def loop(
    begin: int, end: int, sine: Floats, cosine: Floats, motored: Floats, burnt: Floats,
    ratio: Floats, mass: Floats, speed: Floats, inertia: Floats, friction: Floats,
    exponent: Floats, heat: Floats, cylinders: int, variable: bool, lever: float, radius: float,
    nodes: int, share: bool, delta: Floats,
) -> None:  # fmt: skip
    """Designs begin .. end - 1; tables over the cycle hold nodes and midpoints.

    `share`: torque shapes of the design before are kept if crank ratio and load are the same, as
    one would do in a factorial scene.
    """
    period = 4.0 * math.pi / cylinders
    h = period / nodes
    gas, shape, square = np.empty(2 * nodes + 1), np.empty(2 * nodes + 1), np.empty(2 * nodes + 1)
    drive, theta, bend = np.empty(2 * nodes + 1), np.ones(2 * nodes + 1), np.zeros(2 * nodes + 1)
    q, slope, along = np.empty(nodes + 1), np.empty(nodes), np.empty(nodes)
    last = last_heat = -1.0
    mean_gas = mean_square = 0.0
    for i in range(begin, end):
        lam, burning = ratio[i], heat[i]
        if not share or lam != last or burning != last_heat:
            last, last_heat = lam, burning
            mean_gas = mean_square = 0.0
            for j in range(2 * nodes):
                g = s = w = 0.0
                for z in range(cylinders):
                    at = j + 2 * nodes * z
                    root = math.sqrt(1.0 - (lam * sine[at]) ** 2)
                    v = sine[at] * (1.0 + lam * cosine[at] / root)
                    b = cosine[at] + lam * (
                        cosine[at] ** 2 - sine[at] ** 2 + lam**2 * sine[at] ** 4
                    ) / (root * root * root)
                    g += (motored[at] + burning * burnt[at]) * v
                    s += b * v
                    w += v * v
                gas[j], shape[j], square[j] = g, s, w
                mean_gas += g
                mean_square += w
            gas[2 * nodes], shape[2 * nodes], square[2 * nodes] = gas[0], shape[0], square[0]
            mean_gas /= 2 * nodes
            mean_square /= 2 * nodes
        scale = 2.0 / (inertia[i] * speed[i] ** 2)
        eta = mass[i] * radius * radius / inertia[i]
        kappa = scale * (lever * mean_gas - friction[i])
        half = 0.5 * exponent[i]
        a0, a1 = scale * lever, scale * friction[i]
        a2 = 0.0 if variable else 2.0 * eta
        for j in range(2 * nodes + 1):
            drive[j] = a0 * gas[j] - a1 - a2 * shape[j]
        if variable:
            for j in range(2 * nodes + 1):
                theta[j] = 1.0 + eta * (square[j] - mean_square)
                bend[j] = 2.0 * eta * shape[j]
        if half == 0.0:
            q[0] = 0.0
            for j in range(nodes):
                q[j + 1] = q[j] + h * (
                    (drive[2 * j] + 4.0 * drive[2 * j + 1] + drive[2 * j + 2]) / 6.0 - kappa
                )
            level = level_of(q[:nodes], theta[: 2 * nodes : 2])
            for j in range(nodes):
                q[j] += level
        elif half == 1.0 and not variable:
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
                    t0, tm, t1 = theta[2 * j], theta[2 * j + 1], theta[2 * j + 2]
                    u = value / t0
                    p = _power(u, half)
                    k1 = drive[2 * j] - kappa * p
                    g1 = -kappa * half * p / (u * t0)
                    x = value + 0.5 * h * k1
                    u = x / tm
                    p = _power(u, half)
                    k2 = drive[2 * j + 1] - kappa * p
                    g2 = -kappa * half * p / (u * tm) * (1.0 + 0.5 * h * g1)
                    x = value + 0.5 * h * k2
                    u = x / tm
                    p = _power(u, half)
                    k3 = drive[2 * j + 1] - kappa * p
                    g3 = -kappa * half * p / (u * tm) * (1.0 + 0.5 * h * g2)
                    x = value + h * k3
                    u = x / t1
                    p = _power(u, half)
                    k4 = drive[2 * j + 2] - kappa * p
                    g4 = -kappa * half * p / (u * t1) * (1.0 + h * g3)
                    value += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
                    tangent *= 1.0 + h / 6.0 * (g1 + 2.0 * (g2 + g3) + g4)
                step = (value - start) / (1.0 - tangent)
                start += step
                if abs(step) < SMALL_STEP * start:
                    break
            for j in range(nodes):
                q[j] += step * along[j]
        for j in range(nodes):
            u = q[j] / theta[2 * j]
            slope[j] = (drive[2 * j] - kappa * _power(u, half) - u * bend[2 * j]) / theta[2 * j]
            q[j] = u
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


def steps_of(nodes: int, cylinders: int) -> int:
    """Steps over a firing period, of `nodes` over the cycle; many cylinders need a few."""
    return max(nodes // cylinders, 24)


def numba_loop(nodes: int, threads: int, share: bool = False) -> Solver:
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
            loop(begin, end, *tables, *columns, z, designs.variable, LEVER, RADIUS, steps, share,
                 delta)  # fmt: skip

        in_threads(work, len(designs), threads)
        return delta

    return solver


# NumPy: steps in Python, designs in arrays --------------------------------------------------------


def numpy_steps(whole: int, threads: int, block: int = 1000) -> Solver:
    """Runge-Kutta steps (exact decay at alpha = 2) over arrays of designs of one exponent."""

    def some(designs: Designs) -> Floats:
        c = coefficients(designs)
        half = float(c.half[0])
        kappa = c.kappa
        nodes = steps_of(whole, c.cylinders)
        phi = np.arange(2 * nodes) * c.period / (2 * nodes)
        h = c.period / nodes
        drive = np.ascontiguousarray(drives(c, phi).T)
        q = np.empty((nodes, len(designs)))
        value = np.ones(len(designs))
        simpson = drive[::2] + 4.0 * drive[1::2] + np.roll(drive[::2], -1, axis=0)
        if half == 0.0:
            q[0] = 0.0
            np.cumsum(h * (simpson[:-1] / 6.0 - kappa), axis=0, out=q[1:])
            level = np.ones(len(designs))
            for _ in range(6):
                level -= np.log(level + q).sum(axis=0) / (1.0 / (level + q)).sum(axis=0)
            q += level
        elif half == 1.0:
            decay, part = np.exp(-kappa * h), np.exp(-0.5 * kappa * h)
            work = h / 6.0 * (decay * drive[::2] + 4.0 * part * drive[1::2]
                              + np.roll(drive[::2], -1, axis=0))  # fmt: skip
            value = np.zeros(len(designs))
            for j in range(nodes):
                value = decay * value + work[j]
            value /= -np.expm1(-kappa * c.period)
            for j in range(nodes):
                q[j] = value
                value = decay * value + work[j]
        else:
            start, along = np.ones(len(designs)), np.empty_like(q)
            for _ in range(MOST_SWEEPS):
                value, tangent = start.copy(), np.ones(len(designs))
                for j in range(nodes):
                    q[j], along[j] = value, tangent
                    d0, dm, d1 = drive[2 * j], drive[2 * j + 1], drive[(2 * j + 2) % (2 * nodes)]
                    value, tangent = _step(np, value, tangent, d0, dm, d1, kappa, half, h)
                step = (value - start) / (1.0 - tangent)
                start += step
                if np.abs(step / start).max() < SMALL_STEP:
                    break
            q += step * along
        slope = drive[::2] - kappa * q**half
        return _numpy_delta(q, slope, h)

    def solver(designs: Designs) -> Floats:
        delta = np.empty(len(designs))
        parts = []
        for exponent in np.unique(designs.exponent):
            index = np.flatnonzero(designs.exponent == exponent)
            parts += [index[i : i + block] for i in range(0, index.size, block)]

        def work(begin: int, end: int) -> None:
            for index in parts[begin:end]:
                delta[index] = some(designs.take(index))

        in_threads(work, len(parts), threads)
        return delta

    return solver


def _step(
    np_: Any, value: Any, tangent: Any, d0: Any, dm: Any, d1: Any, kappa: Any, half: float, h: float
) -> tuple[Any, Any]:
    """One classical Runge-Kutta step of q and its tangent, for NumPy and JAX alike."""

    def rate(q: Any, drive: Any) -> tuple[Any, Any]:
        power = q if half == 1.0 else np_.sqrt(q) if half == 0.5 else q**half
        load = kappa * power
        return drive - load, -half * load / q

    k1, g1 = rate(value, d0)
    k2, g2 = rate(value + 0.5 * h * k1, dm)
    g2 = g2 * (1.0 + 0.5 * h * g1)
    k3, g3 = rate(value + 0.5 * h * k2, dm)
    g3 = g3 * (1.0 + 0.5 * h * g2)
    k4, g4 = rate(value + h * k3, d1)
    g4 = g4 * (1.0 + h * g3)
    return (
        value + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4),
        tangent * (1.0 + h / 6.0 * (g1 + 2.0 * (g2 + g3) + g4)),
    )


def _numpy_delta(q: Floats, slope: Floats, width: float) -> Floats:
    """`delta_of` for columns of designs."""
    after = np.roll(slope, -1, axis=0)
    found = []
    for sign in (1.0, -1.0):
        extreme = (sign * q).max(axis=0)
        left, column = np.nonzero((sign * slope > 0.0) & (sign * after < 0.0))
        y0, y1 = q[left, column], q[(left + 1) % len(q), column]
        d0, d1 = width * slope[left, column], width * after[left, column]
        a, b = 6.0 * (y0 - y1) + 3.0 * (d0 + d1), 6.0 * (y1 - y0) - 4.0 * d0 - 2.0 * d1
        root = np.sqrt(np.maximum(b * b - 4.0 * a * d0, 0.0))
        with np.errstate(divide="ignore", invalid="ignore"):
            far, near = (-b - sign * root) / (2.0 * a), -2.0 * d0 / (b - sign * root)
        t = np.clip(np.where(b * sign <= 0.0, near, far), 0.0, 1.0)
        bend = 3.0 * (y1 - y0) - 2.0 * d0 - d1
        value = y0 + t * (d0 + t * (bend + t * (2.0 * (y0 - y1) + d0 + d1)))
        np.maximum.at(extreme, column, sign * value)
        found.append(sign * extreme)
    return np.asarray((np.sqrt(found[0]) - np.sqrt(found[1])) / np.sqrt(q).mean(axis=0))


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

    Raises
    ------
    ValueError
        Another exponent, or variable inertia.
    """
    if designs.variable or np.any(designs.exponent != 2.0):
        raise ValueError("harmonic balance is written for exponent 2 and constant inertia")
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


# JAX ----------------------------------------------------------------------------------------------


def jax_scan(whole: int, threads: int, block: int = 256) -> Solver:
    """`lax.scan` over Runge-Kutta steps, compiled by XLA, blocks of designs on all threads."""
    jax: Any = importlib.import_module("jax")
    jnp = jax.numpy

    def some(
        half: float, cylinders: int, ratio: Any, gas: Any, shape: Any, friction: Any, kappa: Any,
        heat: Any,
    ) -> Any:  # fmt: skip
        """Columns of `block` designs."""
        nodes, period = steps_of(whole, cylinders), CYCLE / cylinders
        h = period / nodes
        drive = -friction
        for cylinder in range(cylinders):
            phi = np.arange(2 * nodes) * period / (2 * nodes) + cylinder * period
            motored = MOTORED(phi)
            pressure = (motored - CRANKCASE)[:, None] + heat * (PRESSURE(phi) - motored)[:, None]
            sine, cosine = np.sin(phi), np.cos(phi)
            root = jnp.sqrt(1.0 - (ratio * sine[:, None]) ** 2)
            v = sine[:, None] * (1.0 + ratio * cosine[:, None] / root)
            b = cosine[:, None] + ratio * (
                (cosine**2 - sine**2)[:, None] + ratio**2 * (sine**4)[:, None]
            ) / (root**3)
            drive = drive + (gas * pressure - shape * b) * v
        inputs = (drive[::2], drive[1::2], jnp.roll(drive[::2], -1, axis=0))
        if half == 0.0:
            simpson = h * ((inputs[0] + 4.0 * inputs[1] + inputs[2]) / 6.0 - kappa)
            q = jnp.cumsum(simpson, axis=0) - simpson
            level = jnp.ones_like(kappa)
            for _ in range(6):
                level = level - jnp.log(level + q).sum(axis=0) / (1.0 / (level + q)).sum(axis=0)
            q = q + level
        elif half == 1.0:
            fading, part = jnp.exp(-kappa * h), jnp.exp(-0.5 * kappa * h)
            work = h / 6.0 * (fading * inputs[0] + 4.0 * part * inputs[1] + inputs[2])

            def decay(value: Any, gain: Any) -> Any:
                return fading * value + gain, value

            end, _ = jax.lax.scan(decay, jnp.zeros_like(kappa), work, unroll=8)
            _, q = jax.lax.scan(decay, end / -jnp.expm1(-kappa * period), work, unroll=8)
        else:

            def march(carry: Any, row: Any) -> Any:
                return _step(jnp, carry[0], carry[1], row[0], row[1], row[2], kappa, half, h), carry

            start = jnp.ones_like(kappa)
            for _ in range(3):  # from a start this near three steps are always enough
                (end, tangent), (q, along) = jax.lax.scan(
                    march, (start, jnp.ones_like(kappa)), inputs, unroll=8
                )
                step = (end - start) / (1.0 - tangent)
                start = start + step
            q = q + step * along
        return q, inputs[0] - kappa * q**half

    by_xla = jax.jit(some, static_argnums=(0, 1))

    def solver(designs: Designs) -> Floats:
        c = coefficients(designs)
        h = c.period / steps_of(whole, c.cylinders)
        delta = np.empty(len(designs))
        parts = []
        for half in np.unique(c.half):
            index = np.flatnonzero(c.half == half)
            parts += [(float(half), index[i : i + block]) for i in range(0, index.size, block)]

        def work(begin: int, end: int) -> None:
            with jax.enable_x64(True):
                for half, index in parts[begin:end]:
                    filled = np.resize(index, block)  # one shape, one compilation
                    columns = [getattr(c, name)[filled] for name in c.NUMBERS]
                    q, slope = by_xla(half, c.cylinders, *columns)
                    found = _numpy_delta(np.asarray(q), np.asarray(slope), h)
                    delta[index] = found[: index.size]

        in_threads(work, len(parts), threads)
        return delta

    return solver


# SciPy --------------------------------------------------------------------------------------------


@compiled
def right_side(
    phi: float, state: Floats, ratio: float, gas: float, shape: float, friction: float,
    kappa: float, heat: float, half: float, cylinders: int,
) -> Floats:  # fmt: skip
    """The value q and its tangent; compiled, because SciPy calls it thousands of times."""
    load = kappa * state[0] ** half if half > 0.0 else kappa
    out = np.empty(2)
    out[0] = drive_at(phi, ratio, gas, shape, friction, heat, cylinders) - load
    out[1] = -half * load / state[0] * state[1] if half > 0.0 else 0.0
    return out


def _scipy_ivp(designs: Designs, tolerance: float, nodes: int) -> Floats:
    c = coefficients(designs)
    nodes = steps_of(nodes, c.cylinders)
    phi = np.arange(nodes) * c.period / nodes
    drive = drives(c, phi)
    delta = np.empty(len(designs))
    for i in range(len(designs)):
        numbers = (*(getattr(c, name)[i] for name in c.NUMBERS), c.half[i], c.cylinders)

        def run(start: float, where: Floats | None, numbers: Any = numbers) -> Any:
            return solve_ivp(
                right_side, (0.0, c.period), [start, 1.0], method="DOP853", t_eval=where,
                args=numbers, rtol=tolerance, atol=tolerance, max_step=0.35,
            )  # fmt: skip

        start = 0.0
        if c.half[i] > 0.0:
            start = 1.0
            for _ in range(MOST_SWEEPS):
                end = run(start, None).y[:, -1]
                step = (end[0] - start) / (1.0 - end[1])
                start += step
                if c.half[i] == 1.0 or abs(step) < 0.1 * tolerance:
                    break
        delta[i] = finish(c, i, phi, run(start, phi).y[0], drive[i])
    return delta


def _scipy_bvp(designs: Designs, tolerance: float, mesh: int, nodes: int) -> Floats:
    c = coefficients(designs)
    nodes = steps_of(nodes, c.cylinders)
    phi = np.arange(nodes) * c.period / nodes
    drive = drives(c, phi)
    delta = np.empty(len(designs))
    guess = np.linspace(0.0, c.period, mesh)
    for i in range(len(designs)):
        half, kappa = c.half[i], c.kappa[i]
        one = c.take([i])

        if half == 0.0:
            # Any level is periodic: the closure takes the place of the boundary condition.
            def slope(
                x: Floats, y: Floats, one: Any = one, kappa: float = kappa, half: float = half
            ) -> Floats:
                return np.vstack([drives(one, x)[0] - kappa, np.log(y[0])])

            def ends(left: Floats, right: Floats) -> Floats:
                return np.array([left[1], right[1]])

            start = np.vstack([np.ones(mesh), np.zeros(mesh)])
            jacobian: Any = None
        else:

            def slope(
                x: Floats, y: Floats, one: Any = one, kappa: float = kappa, half: float = half
            ) -> Floats:
                return drives(one, x) - kappa * y**half

            def jacobian(x: Floats, y: Floats, kappa: float = kappa, half: float = half) -> Floats:
                return (-half * kappa * y ** (half - 1.0))[None]

            def ends(left: Floats, right: Floats) -> Floats:
                return right - left

            start = np.ones((1, mesh))
        found = solve_bvp(
            slope, ends, guess, start, fun_jac=jacobian, tol=tolerance, max_nodes=20000
        )
        q = found.sol(phi)[0]
        delta[i] = finish(c, i, phi, q - q.mean() if half == 0.0 else q, drive[i])
    return delta


# numbalsoda ---------------------------------------------------------------------------------------


def numba_lsoda(tolerance: float, nodes: int, threads: int) -> Solver:
    """LSODA from inside a compiled loop over designs."""
    package: Any = importlib.import_module("numbalsoda")
    lsoda, signature = package.lsoda, package.lsoda_sig

    @numba.cfunc(signature)
    def slope(phi: float, state: Any, out: Any, data: Any) -> None:
        load, half, cylinders = data[4], data[6], int(data[7])
        if half == 1.0:
            load *= state[0]
        elif half == 0.5:
            load *= math.sqrt(state[0])
        elif half > 0.0:
            load *= state[0] ** half
        drive = drive_at(phi, data[0], data[1], data[2], data[3], data[5], cylinders)
        out[0] = drive - load
        out[1] = 0.0
        if half > 0.0:
            out[1] = -half * load / state[0] * state[1]

    address = slope.address

    @numba.njit(nogil=True)
    def march(
        begin: int, end: int, phi: Floats, coarse: Floats, data: Floats, delta: Floats
    ) -> None:
        nodes = phi.size - 1
        state, one = np.empty(2), np.ones(nodes)
        q, rate = np.empty(nodes), np.empty(nodes)
        for i in range(begin, end):
            kappa, half = data[i, 4], data[i, 6]
            start = 1.0
            for _ in range(MOST_SWEEPS if half > 0.0 else 0):
                state[0], state[1] = start, 1.0
                run, _ = lsoda(address, state, coarse, data[i], rtol=tolerance, atol=tolerance)
                step = (run[-1, 0] - start) / (1.0 - run[-1, 1])
                start += step
                if half == 1.0 or abs(step) < 0.1 * tolerance:
                    break
            state[0], state[1] = start, 1.0
            run, _ = lsoda(address, state, phi, data[i], rtol=tolerance, atol=tolerance)
            q[:] = run[:nodes, 0]
            if half == 0.0:
                q += level_of(q, one)
            for j in range(nodes):
                drive = drive_at(
                    phi[j], data[i, 0], data[i, 1], data[i, 2], data[i, 3], data[i, 5],
                    int(data[i, 7]),
                )  # fmt: skip
                rate[j] = drive - kappa * q[j] ** half
            delta[i] = delta_of(q, rate, phi[1])

    def solver(designs: Designs) -> Floats:
        c = coefficients(designs)
        columns = [*(getattr(c, name) for name in c.NUMBERS), c.half]
        data = np.stack([*columns, np.full(len(designs), float(c.cylinders))], axis=1)
        phi = np.linspace(0.0, c.period, steps_of(nodes, c.cylinders) + 1)
        # LSODA would step over the combustion: it is stopped every 20 degrees in the first sweeps
        # too.
        coarse = np.linspace(0.0, c.period, 36 // c.cylinders + 2)
        delta = np.empty(len(designs))
        in_threads(lambda a, b: march(a, b, phi, coarse, data, delta), len(designs), threads)
        return delta

    return solver


# heyoka -------------------------------------------------------------------------------------------


def heyoka_batch(tolerance: float, nodes: int, threads: int) -> Solver:
    """Taylor series of the differential equation, a batch of designs as SIMD lanes."""
    hy: Any = importlib.import_module("heyoka")
    batch = int(hy.recommended_simd_size())
    made: dict[tuple[float, int, int], Any] = {}

    def integrator(half: float, cylinders: int) -> Any:
        # Powers as products: the series of a general power divides by its base, which is zero here.
        def raised(base: Any, order: int) -> Any:
            if order == 1:
                return base
            lower = raised(base, order // 2)
            return lower * lower * base if order % 2 else lower * lower

        ratio, gas, shape, friction, kappa, heat = (hy.par[i] for i in range(6))
        p = PRESSURE

        def drive_of(angle: Any) -> Any:
            sine, cosine = hy.sin(angle), hy.cos(angle)
            root = hy.sqrt(1.0 - raised(ratio * sine, 2))
            v = sine * (1.0 + ratio * cosine / root)
            b = cosine + ratio * (
                1.0 - 2.0 * raised(sine, 2) + ratio * ratio * raised(sine, 4)
            ) / raised(root, 3)
            volume = 1.0 + (p.ratio - 1.0) * raised(hy.sin(0.5 * angle), 2)
            compressed = (p.ratio / volume) ** p.polytropic - 1.0
            bar = p.compression * compressed * raised(hy.cos(0.25 * angle), 8)
            for height, shift, order in (
                (p.burn, p.burn_angle, p.burn_order),
                (p.after, p.after_angle, p.after_order),
            ):
                bar += heat * height * raised(hy.cos(0.25 * (angle - shift)), 2 * order)
            return (gas * (1e5 * (p.charge + bar) - CRANKCASE) - shape * b) * v

        drive = -1.0 * friction
        for cylinder in range(cylinders):
            drive += drive_of(hy.time + cylinder * CYCLE / cylinders)
        q, s = hy.make_vars("q", "s")
        load = kappa * q**half if half > 0.0 else kappa
        system = [(q, drive - load)]
        state = np.ones((1, batch))
        if half > 0.0:
            system.append((s, -half * load / q * s))
            state = np.ones((2, batch))
        return hy.taylor_adaptive_batch(
            system, state, pars=np.zeros((6, batch)), tol=tolerance, compact_mode=True
        )

    def some(
        solver: Any, c: Coefficients, phi: Floats, index: npt.NDArray[np.int64], half: float
    ) -> Floats:
        grid = np.repeat(phi[:, None], batch, axis=1)
        filled = np.resize(index, batch)
        for row, name in enumerate(c.NUMBERS):
            solver.pars[row] = getattr(c, name)[filled]
        start = np.zeros(batch) if half == 0.0 else np.ones(batch)
        if half > 0.0:
            for _ in range(MOST_SWEEPS):
                solver.set_time(0.0)
                solver.state[0], solver.state[1] = start, 1.0
                solver.propagate_until(c.period)
                step = (solver.state[0] - start) / (1.0 - solver.state[1])
                start = start + step
                if half == 1.0 or np.abs(step).max() < 0.1 * tolerance:
                    break
        solver.set_time(0.0)
        solver.state[0] = start
        if half > 0.0:
            solver.state[1] = 1.0
        result = solver.propagate_grid(grid)
        return np.asarray(result[-1] if isinstance(result, tuple) else result)[:, 0, : index.size]

    def solver(designs: Designs) -> Floats:
        c = coefficients(designs)
        delta = np.empty(len(designs))
        parts = []
        for half in np.unique(c.half):
            index = np.flatnonzero(c.half == half)
            parts += [(float(half), index[i : i + batch]) for i in range(0, index.size, batch)]
        steps, z = steps_of(nodes, c.cylinders), c.cylinders
        phi = np.arange(steps) * c.period / steps
        halves = sorted({half for half, _ in parts})
        for half in halves:
            if (half, z, 0) not in made:
                made[half, z, 0] = integrator(half, z)
                for thread in range(1, 4 * threads):
                    made[half, z, thread] = made[half, z, 0].__deepcopy__({})

        edges: dict[int, int] = {}

        def work(begin: int, end: int) -> None:
            thread = edges.setdefault(begin, len(edges))
            for half, index in parts[begin:end]:
                q = some(made[half, z, thread], c, phi, index, half)
                chosen = c.take(index)
                drive = drives(chosen, phi)
                for lane in range(index.size):
                    delta[index[lane]] = finish(
                        chosen, lane, phi, np.ascontiguousarray(q[:, lane]), drive[lane]
                    )

        in_threads(work, len(parts), threads)
        return delta

    return solver


# Diffrax ------------------------------------------------------------------------------------------


def diffrax_adaptive(tolerance: float, nodes: int, threads: int, block: int = 64) -> Solver:
    """Dopri8 with adaptive steps, a block of designs under `vmap`."""
    jax: Any = importlib.import_module("jax")
    diffrax: Any = importlib.import_module("diffrax")
    jnp = jax.numpy
    p = PRESSURE

    def drive_of(angle: Any, numbers: Any) -> Any:
        """Of one cylinder, without friction."""
        ratio, gas, shape, heat = numbers[0], numbers[1], numbers[2], numbers[5]
        sine, cosine = jnp.sin(angle), jnp.cos(angle)
        root = jnp.sqrt(1.0 - (ratio * sine) ** 2)
        v = sine * (1.0 + ratio * cosine / root)
        b = cosine + ratio * (cosine**2 - sine**2 + ratio**2 * sine**4) / root**3
        volume = 1.0 + (p.ratio - 1.0) * jnp.sin(0.5 * angle) ** 2
        bar = (
            p.charge
            + p.compression
            * ((p.ratio / volume) ** p.polytropic - 1.0)
            * jnp.cos(0.25 * angle) ** 8
        )
        bar += heat * p.burn * jnp.cos(0.25 * (angle - p.burn_angle)) ** (2 * p.burn_order)
        bar += heat * p.after * jnp.cos(0.25 * (angle - p.after_angle)) ** (2 * p.after_order)
        return (gas * (1e5 * bar - CRANKCASE) - shape * b) * v

    def one(half: float, cylinders: int, numbers: Any) -> Any:
        period = CYCLE / cylinders
        phi = np.linspace(0.0, period, steps_of(nodes, cylinders) + 1)

        def slope(angle: Any, state: Any, _: Any) -> Any:
            load = numbers[4] * state[0] ** half if half else numbers[4]
            drive = -numbers[3]
            for cylinder in range(cylinders):
                drive = drive + drive_of(angle + cylinder * period, numbers)
            return jnp.stack([drive - load, -half * load / state[0] * state[1]])

        def run(start: Any, saved: Any) -> Any:
            return diffrax.diffeqsolve(
                diffrax.ODETerm(slope), diffrax.Dopri8(), 0.0, period, None,
                jnp.stack([start, jnp.ones_like(start)]), saveat=saved, max_steps=4096,
                stepsize_controller=diffrax.PIDController(
                    rtol=tolerance, atol=tolerance, dtmax=0.35
                ),
            ).ys  # fmt: skip

        start = jnp.ones_like(numbers[4])
        for _ in range(0 if half == 0.0 else 1 if half == 1.0 else 3):
            end = run(start, diffrax.SaveAt(t1=True))[-1]
            start = start + (end[0] - start) / (1.0 - end[1])
        q = run(start, diffrax.SaveAt(ts=jnp.asarray(phi)))[:-1, 0]
        return q

    by_xla = jax.jit(
        lambda half, cylinders, numbers: jax.vmap(partial(one, half, cylinders))(numbers),
        static_argnums=(0, 1),
    )

    def solver(designs: Designs) -> Floats:
        c = coefficients(designs)
        steps = steps_of(nodes, c.cylinders)
        phi = np.linspace(0.0, c.period, steps + 1)
        drive = drives(c, phi[:-1])
        numbers = np.stack([getattr(c, name) for name in c.NUMBERS], axis=1)
        delta = np.empty(len(designs))
        parts = []
        for half in np.unique(c.half):
            index = np.flatnonzero(c.half == half)
            parts += [(float(half), index[i : i + block]) for i in range(0, index.size, block)]

        def work(begin: int, end: int) -> None:
            with jax.enable_x64(True):
                for half, index in parts[begin:end]:
                    q = np.asarray(by_xla(half, c.cylinders, numbers[np.resize(index, block)]))
                    for lane, i in enumerate(index):
                        # A torque load: the level comes from the closure alone.
                        row = q[lane] - 1.0 if half == 0.0 else q[lane]
                        delta[i] = finish(c, i, phi, np.ascontiguousarray(row), drive[i])

        in_threads(work, len(parts), threads)
        return delta

    return solver


# The thesis's procedure ---------------------------------------------------------------------------


def _python_euler(designs: Designs, most_cycles: int) -> Floats:
    """Explicit Euler at one degree in lists and `math`, cycle after cycle; NaN if it never closes.

    As Kakaitsas (2015) runs it: until the speed at the end is that at the start within 1e-6 rad/s.
    """
    area, radius = 0.25 * math.pi * BORE**2, 0.5 * STROKE
    delta = np.empty(len(designs))
    width = CYCLE / 720.0
    pressures = [float(p) for p in PRESSURE(np.radians(np.arange(-360.0, 360.0)))]
    for i in range(len(designs)):
        ratio, mass, speed, inertia, friction, alpha, _ = (
            float(getattr(designs, name)[i]) for name in Designs.COLUMNS
        )
        torque = []
        for j in range(720):
            phi = math.radians(j - 360.0)
            sine, cosine = math.sin(phi), math.cos(phi)
            root = math.sqrt(1.0 - (ratio * sine) ** 2)
            v = sine * (1.0 + ratio * cosine / root)
            b = cosine + ratio * (cosine**2 - sine**2 + ratio**2 * sine**4) / root**3
            force = (pressures[j] - CRANKCASE) * area - mass * radius * speed**2 * b
            torque.append(force * radius * v - friction)
        k = sum(torque) / 720.0 / speed**alpha
        omega = speed
        delta[i] = math.nan
        for _ in range(most_cycles):
            first = high = low = omega
            total = 0.0
            for moment in torque:
                total += omega
                omega += width * (moment - k * omega**alpha) / (inertia * omega)
                if omega > high:
                    high = omega
                elif omega < low:
                    low = omega
            if abs(omega - first) < 1e-6:
                delta[i] = (high - low) * 720.0 / total
                break
    return delta


# All of them --------------------------------------------------------------------------------------


def cases(threads: int, processes: Processes, quick: bool) -> tuple[list[Case], list[str]]:
    """Peers that are here, and a line about each that is not."""
    many, some = (64, 64) if quick else (2048, 256)
    found = [
        Case("Numba loop", f"{n} steps", numba_loop(n, threads), scenes=True)
        for n in (90, 180, 360, 720, 1440, 2880)[:: 2 if quick else 1]
    ]
    found += [
        Case("Numba loop, shared tables", f"{n} steps", numba_loop(n, threads, True), scenes=True)
        for n in (90, 180, 360, 720, 1440, 2880)[:: 2 if quick else 1]
    ]
    found += [
        Case("NumPy steps", f"{n} steps", numpy_steps(n, threads), runs=3, least=many)
        for n in ((360,) if quick else (180, 360, 720, 1440))
    ]
    found += [
        Case("Harmonic balance", f"{n} nodes",
             partial(processes, partial(harmonic_balance, whole=n)), least=many, exponents=(2.0,))
        for n in ((96,) if quick else (64, 96, 112, 128, 180))
    ]  # fmt: skip
    for tolerance, nodes in ((1e-6, 720),) if quick else ((1e-5, 360), (1e-7, 720), (1e-10, 2880)):
        solver = partial(_scipy_ivp, tolerance=tolerance, nodes=nodes)
        found.append(
            Case("SciPy solve_ivp", f"DOP853, {tolerance:.0e}", partial(processes, solver), runs=3)
        )
    for tolerance, mesh, nodes in ((1e-4, 91, 720), (1e-6, 181, 1440))[: 1 if quick else 2]:
        solver = partial(_scipy_bvp, tolerance=tolerance, mesh=mesh, nodes=nodes)
        found.append(
            Case("SciPy solve_bvp", f"tol {tolerance:.0e}", partial(processes, solver), runs=3)
        )
    euler = partial(_python_euler, most_cycles=300 if quick else 3000)
    # At exponent 0 Euler never closes: it would only be timed running into its limit.
    found.append(
        Case("Euler in Python", "1 degree", partial(processes, euler), runs=1, least=8, most=40,
             exponents=(1.0, 1.6, 2.0))
    )  # fmt: skip
    taylor = ((1e-7, 720),) if quick else ((1e-6, 360), (1e-8, 720), (1e-11, 2880))
    dopri = () if quick else ((1e-5, 360), (1e-7, 720), (1e-9, 1440))
    lsoda = ((1e-9, 720),) if quick else ((1e-8, 360), (1e-9, 720), (1e-11, 1440))
    absent = []
    optional: list[tuple[str, str, str, Callable[[], list[Case]]]] = [
        ("jax", "JAX scan", "", lambda: [
            Case("JAX scan", f"{n} steps", jax_scan(n, threads), runs=3, least=many)
            for n in ((360,) if quick else (180, 360, 720, 1440))
        ]),
        ("diffrax", "Diffrax", "", lambda: [
            Case("Diffrax", f"Dopri8, {t:.0e}", diffrax_adaptive(t, n, threads), runs=3, least=some)
            for t, n in dopri
        ]),
        ("heyoka", "heyoka", " (wheels for Linux only)", lambda: [
            Case("heyoka", f"batch, {t:.0e}", heyoka_batch(t, n, threads), runs=3, least=some)
            for t, n in taylor
        ]),
        ("numbalsoda", "numbalsoda", " (its build needs a Fortran compiler)", lambda: [
            Case("numbalsoda", f"LSODA, {t:.0e}", numba_lsoda(t, n, threads), runs=3)
            for t, n in lsoda
        ]),
    ]  # fmt: skip
    for module, series, why, make in optional:
        try:
            importlib.import_module(module)
        except (ImportError, OSError):
            absent.append(f"{series}: not installed here{why}")
        else:
            found += make()
    return found, absent
