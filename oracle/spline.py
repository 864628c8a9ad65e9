"""The periodic crank speed of many designs for the tabulated diagram itself: NumPy, to rounding.

`solution` integrates a pressure in closed form; here the pressure is the cubic spline through its
points, which is what the packages promise to solve.  Symbols are those of `solution`: with
``energy = Theta omega_n^2 / 2``, ``u = (omega/omega_n)^2 = 1 + d``, ``theta = Theta(phi)/Theta``,

    ``u theta = 1 + w(phi) + s(phi)``,   ``s' = -kappa (u^(alpha/2) - 1)``,   s periodic.

* The cycle is cut at every knot of the spline (of every cylinder), and where a piece is wide once
  more: on a piece the pressure is a cubic and all else analytic.  The gas work is integrated by
  Gauss-Legendre formulas of eight points, the load term by collocation at Radau's four points
  (order 7, L-stable: a stiff load needs no small steps).
* All pieces are solved together by Newton's method, the sum of their equations being the closure,
  so that a weak load is as well conditioned as any other.  Whatever the start, the load law
  continued below u = 0 without load has exactly one periodic solution, because load only grows
  with speed; the design runs if and only if that is positive.
* ``cycle_time``: a solution with another speed than the nominal one is that of ``power_mean`` with
  ``kappa`` and ``w`` divided by ``rise``; the cycle's time falls with ``rise``.
* Extremes are roots of the exact slope, by bisection.

Everything is kept as a difference from the nominal speed, so that even a delta of 1e-15 has its
digits.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from . import solution
from .solution import CYCLE, IDLE

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Pressure = Callable[[int, Any], Any]

# Of arrays of crank ratios too.
velocity: Callable[..., Array] = solution.velocity
acceleration: Callable[..., Array] = solution.acceleration

CONVERGED, STALLED, NO_STEADY_STATE, UNDECIDED, INVALID_INPUT = range(5)

FLOOR = 1e-9
"""Below this u the load law is continued by its tangent (its powers have no slope at zero)."""

WIDEST = math.radians(0.5)
COARSER = 8
"""Pieces taken together for the start, by implicit Euler."""

BATCH = 24

NEARLY = 0.02
"""Below this u the powers of the closure are sharp."""

ROUNDING = 4e-16

STIFF = 0.05
FINER = 8


@dataclass(frozen=True)
class Designs:
    """Columns of designs, each of one length; SI units.

    ``row`` names the pressure, between whole rows blended linearly; ``surplus`` is the mean torque
    less the load's offset [N m], friction included.
    """

    row: Array
    scale: Array
    crankcase: Array
    crank_ratio: Array
    bore: Array
    stroke: Array
    mass: Array
    inertia: Array
    speed: Array
    exponent: Array
    surplus: Array
    cylinders: Integers
    variable: NDArray[np.bool_]
    cycle_time: NDArray[np.bool_]

    def __len__(self) -> int:
        return self.row.size

    def take(self, index: Any) -> Designs:
        """The designs at `index`."""
        columns: dict[str, Any] = {f.name: getattr(self, f.name)[index] for f in fields(self)}
        return replace(self, **columns)

    @staticmethod
    def of(**columns: Any) -> Designs:
        """Broadcast columns to one length."""
        arrays = np.broadcast_arrays(*(np.asarray(v) for v in columns.values()))
        named = zip(columns, (np.atleast_1d(a).copy() for a in arrays), strict=True)
        return Designs(**dict(named))


@dataclass(frozen=True)
class Solutions:
    """Columns of results, NaN where `status` is not CONVERGED.

    ``lowest`` is the smallest u of the continued problem: how far a design is from stalling.
    ``mean_gas_torque`` [N m] is the whole engine's.  ``least_inertia`` is the smallest
    Theta(phi)/Theta, ``torque_range`` [N m] that of the torque at nominal speed.  ``doubt`` is the
    relative difference of delta between the last two subdivisions where there were two (infinite
    where it has none), or what rounding of the work may leave of it: a strong load follows a work
    that is far more than the kinetic energy.
    """

    status: Integers
    delta: Array
    omega_max: Array
    omega_min: Array
    omega_mean: Array
    load_factor: Array
    lowest: Array
    mean_gas_torque: Array
    least_inertia: Array
    torque_range: Array
    doubt: Array


# Formulas -----------------------------------------------------------------------------------------


def gauss(points: int) -> tuple[Array, Array]:
    """Abscissae and weights of Gauss and Legendre on [0, 1]."""
    x, weight = legendre.leggauss(points)
    return 0.5 * (x + 1.0), 0.5 * weight


def radau(points: int) -> Array:
    """Radau's abscissae on (0, 1], the end included: roots of P_n - P_(n-1)."""
    polynomial = np.zeros(points + 1)
    polynomial[-1], polynomial[-2] = 1.0, -1.0
    roots = np.sort(legendre.legroots(polynomial).real)
    for _ in range(3):  # Newton, for the last digits
        slope = legendre.legval(roots, legendre.legder(polynomial))
        roots = roots - legendre.legval(roots, polynomial) / slope
    roots[-1] = 1.0
    return np.asarray(0.5 * (roots + 1.0))


def antiderivatives(nodes: Array) -> Array:
    """Coefficients, rising powers of t, of the integral from 0 of each Lagrange polynomial."""
    count = nodes.size
    found = np.zeros((count, count + 1))
    for k in range(count):
        others = np.delete(nodes, k)
        basis = np.polynomial.polynomial.polyfromroots(others) / np.prod(nodes[k] - others)
        found[k] = np.polynomial.polynomial.polyint(basis)
    return found


def powers_of(t: Array, count: int) -> Array:
    """Powers 0 .. count - 1 of t along a new last axis."""
    return np.asarray(t[..., None] ** np.arange(count))


POINTS, WEIGHTS = gauss(8)
WORK = antiderivatives(POINTS)
STAGES = radau(4)
LOAD = antiderivatives(STAGES)
EULER = np.ones(1)


# One batch: designs of one number of cylinders, inertia model and closure -------------------------


def pieces_of(knots: Array, cylinders: int, widest: float) -> Array:
    """Edges of the pieces of a firing period, its end included."""
    period = CYCLE / cylinders
    folded: Array = np.sort(np.mod(knots, period))
    folded = folded[np.append(True, np.diff(folded) > 1e-9)]
    if folded[-1] > period + folded[0] - 1e-9:
        folded = folded[:-1]
    ends = np.append(folded, folded[0] + period)
    edges = [
        np.linspace(a, b, max(1, math.ceil((b - a) / widest - 1e-9)), endpoint=False)
        for a, b in pairwise(ends)
    ]
    return np.append(np.concatenate(edges), ends[-1])


@dataclass
class Batch:
    """Curves of a batch, arrays (design, piece, point)."""

    designs: Designs
    pressure: Pressure
    edges: Array

    def __post_init__(self) -> None:
        d, self.width = self.designs, np.diff(self.edges)
        radius = 0.5 * d.stroke
        energy = 0.5 * d.inertia * d.speed**2
        throw = d.mass * radius**2
        self.count = int(d.cylinders[0])
        self.variable = bool(d.variable[0])
        self.period = CYCLE / self.count
        self.lever = 0.25 * math.pi * d.bore**2 * radius
        self.gas = (self.lever / energy)[:, None, None]
        self.eta = (throw / d.inertia)[:, None, None]
        self.moment = throw * d.speed**2
        self.half = 0.5 * d.exponent[:, None, None]
        self.kappa = (d.surplus / energy)[:, None, None]
        at = self.edges[:-1, None] + self.width[:, None] * POINTS
        shape = (len(d), *at.shape)
        torque, square = (a.reshape(shape) for a in self.shapes(at.reshape(1, -1)))
        means = (torque * WEIGHTS * self.width[:, None]).sum(axis=(1, 2)) / self.period
        squares = (square * WEIGHTS * self.width[:, None]).sum(axis=(1, 2)) / self.period
        self.mean, self.mean_square = means[:, None, None], squares[:, None, None]
        self.rates = torque - self.mean
        parts = self.width * (self.rates @ WEIGHTS)
        begins = np.cumsum(parts, axis=1) - parts
        self.begins = begins - begins.mean(axis=1, keepdims=True)

    def shapes(self, phi: Array) -> tuple[Array, Array]:
        """Sums over cylinders of (p - p_c) v and of v^2 at angles (design, any) or (1, any)."""
        d = self.designs
        ratio = d.crank_ratio[:, None]
        torque = np.zeros((len(d), phi.shape[1]))
        square = np.zeros_like(torque)
        low = np.floor(d.row).astype(np.int64)
        share = (d.row - low)[:, None]
        for i in range(self.count):
            angle = phi + i * self.period
            v = velocity(angle, ratio)
            gas = np.zeros_like(torque)
            for rows, weight in ((low, 1.0 - share), (low + 1, share)):
                used = weight[:, 0] > 0.0
                for row in np.unique(rows[used]):
                    mine = used & (rows == row)
                    values = self.pressure(int(row), angle[mine] if len(phi) > 1 else angle)
                    gas[mine] += weight[mine] * values
            torque += (d.scale[:, None] * gas - d.crankcase[:, None]) * v
            square += v * v
        return torque, square

    def slopes(self, phi: Array) -> Array:
        """Sum over cylinders of 2 v b, the slope of the sum of v^2, at angles (design, any)."""
        ratio = self.designs.crank_ratio[:, None]
        total = np.zeros_like(phi)
        for i in range(self.count):
            angle = phi + i * self.period
            total += 2.0 * velocity(angle, ratio) * acceleration(angle, ratio)
        return total

    def curves(self, stages: Array) -> tuple[Array, Array]:
        """W and theta - 1 at the stages of every piece."""
        work = self.begins[:, :, None] + self.width[:, None] * (
            self.rates @ (WORK @ powers_of(stages, POINTS.size + 1).T)
        )
        w = self.gas * work
        at = self.edges[:-1, None] + self.width[:, None] * stages
        ratio = self.designs.crank_ratio[:, None, None]
        square = np.zeros_like(w)
        for i in range(self.count):
            square += velocity(at + i * self.period, ratio) ** 2
        square -= self.mean_square
        if self.variable:
            return w, self.eta * square
        return w - self.eta * square, np.zeros_like(w)


def load_law(d: Array, half: Array) -> tuple[Array, Array]:
    """u^half - 1 and its slope for u = 1 + d, continued by its tangent below FLOOR."""
    base = np.maximum(d, FLOOR - 1.0)
    value = np.expm1(half * np.log1p(base))
    slope = half * (value + 1.0) / (1.0 + base)
    return value + slope * (d - base), slope


def closing_law(d: Array, half: Array, kind: str) -> tuple[Array, Array]:
    """Density whose mean must vanish and its slope; "time" is that of u^(-1/2)."""
    if kind == "power":
        return load_law(d, half)
    base = np.maximum(d, FLOOR - 1.0)
    if kind == "log":
        value, slope = np.log1p(base), 1.0 / (1.0 + base)
    else:
        value = -np.expm1(-0.5 * np.log1p(base))
        slope = 0.5 * (1.0 - value) / (1.0 + base)
    return value + slope * (d - base), slope


@dataclass
class Solved:
    """Newton's result: s at the begin of each piece and at its stages, whether it converged."""

    begin: Array
    stage: Array
    good: NDArray[np.bool_]
    load: Array


def newton(
    batch: Batch, width: Array, w: Array, bent: Array, stages: Array, rise: Array, kind: str,
    begin: Array, stage: Array, most: int,
) -> Solved:  # fmt: skip
    """Collocation at `stages` on the pieces `width`; start `begin`, `stage`.

    `w` and `bent` (theta - 1) are at the stages; `rise` (design, 1, 1) divides kappa and w.
    """
    count = len(batch.designs)
    antiderivative = antiderivatives(stages) @ powers_of(stages, stages.size + 1).T
    matrix = antiderivative.T  # stage j takes sum_k matrix[j, k] f_k
    weights = matrix[-1]
    h = width[None, :, None]
    kappa = batch.kappa / rise
    kappa = np.where(batch.half > 0.0, kappa, 0.0)
    theta = 1.0 + bent
    single = stages.size == 1
    shares = h * weights / width.sum()
    good = np.zeros(count, dtype=bool)
    f = np.zeros_like(stage)
    last = np.full(count, np.inf)
    for _ in range(most):
        d = (w / rise + stage - bent) / theta
        law, law_slope = load_law(d, batch.half)
        f, g = -kappa * law, -kappa * law_slope / theta
        closing, closing_slope = closing_law(d, batch.half, kind)
        closing_slope = np.asarray(closing_slope / theta)
        residual = begin[:, :, None] + h * (f @ matrix.T) - stage
        grown: Array
        moved: Array
        if single:
            below = 1.0 - h * g
            grown, moved = 1.0 / below, residual / below
        else:
            local = np.eye(stages.size) - h[..., None] * matrix * g[:, :, None, :]
            right = np.stack([np.ones_like(residual), residual], axis=-1)
            solved = np.linalg.solve(local, right)
            grown, moved = np.asarray(solved[..., 0]), np.asarray(solved[..., 1])
        after = np.roll(begin, -1, axis=1)
        jump = stage[:, :, -1] - after + moved[:, :, -1]
        factor = grown[:, :, -1]
        grow, shift = np.ones(count), np.zeros(count)
        grows, shifts = np.empty_like(begin), np.empty_like(begin)
        for i in range(width.size):
            grows[:, i], shifts[:, i] = grow, shift
            shift = factor[:, i] * shift + jump[:, i]
            grow = factor[:, i] * grow
        # The sum of all equations is the closure; where a cycle forgets its start, the last
        # equation itself says it with more digits.
        total = (shares * closing_slope * grown * grows[:, :, None]).sum(axis=(1, 2))
        missed = (shares * (closing + closing_slope * (moved + grown * shifts[:, :, None]))).sum(
            axis=(1, 2)
        )
        periodic = (grow < 0.5) & (kind == "power")
        with np.errstate(divide="ignore", invalid="ignore"):
            start = np.where(periodic, shift / (1.0 - grow), -missed / total)
        change_begin = grows * start[:, None] + shifts
        change = grown * change_begin[:, :, None] + moved
        change = np.where(good[:, None, None] | ~np.isfinite(change), 0.0, change)
        change_begin = np.where(good[:, None] | ~np.isfinite(change_begin), 0.0, change_begin)
        begin = begin + change_begin
        stage = stage + change
        span = np.ptp(d, axis=(1, 2)) + np.abs(batch.kappa / rise)[:, 0, 0] * 1e-3
        # Newton squares the error; where it creeps along a steep slope, changes are small too.
        most_changed = np.abs(change).max(axis=(1, 2))
        shrinks = (most_changed <= 0.1 * last) | (np.abs(missed) <= 1e-13)
        good |= np.isfinite(start) & (most_changed <= 1e-8 * span + 1e-300) & shrinks
        last = most_changed
        if good.all():
            # One more for those that ended first.
            d = (w / rise + stage - bent) / theta
            f = -kappa * load_law(d, batch.half)[0]
            break
    return Solved(begin, stage, good, f)


def level_of(w: Array, bent: Array, half: Array, kind: str, shares: Array) -> tuple[Array, Array]:
    """Constant s at which the closure holds, and by how much it is passed where u reaches zero.

    The mean grows with s: Newton inside a bracket.  If it is passed there is no such s.
    """
    theta = 1.0 + bent
    shape = (-1, 1, 1)

    def mean(level: Array) -> tuple[Array, Array]:
        d = (w - bent + level.reshape(shape)) / theta
        value, slope = closing_law(d, half, kind)
        return (shares * value).sum(axis=(1, 2)), (shares * slope / theta).sum(axis=(1, 2))

    low = (FLOOR * theta - 1.0 - w).max(axis=(1, 2))
    high = (bent - w).max(axis=(1, 2))
    excess = mean(low)[0]
    stalled = excess > 0.0
    level = np.maximum(low + 1e-3 * (high - low), 0.0 * low)
    level = np.where((level > low) & (level < high), level, 0.5 * (low + high))
    for _ in range(200):
        value, slope = mean(level)
        low, high = np.where(value > 0.0, low, level), np.where(value > 0.0, level, high)
        step = -value / slope
        new = level + step
        inside = (new >= low) & (new <= high)
        new = np.where(inside, new, 0.5 * (low + high))
        moved = np.abs(new - level)
        level = new
        if np.all((moved <= 1e-15 * (high - low + np.abs(level))) | stalled):
            break
    return level, excess


def start_of(batch: Batch, w: Array, bent: Array, rise: Array) -> tuple[Array, Array]:
    """Start for `newton` by implicit Euler on coarse pieces, and the smallest u there."""
    pieces = batch.width.size
    ends = np.unique(np.append(np.arange(COARSER, pieces, COARSER), pieces))
    begins = np.concatenate([[0], ends[:-1]])
    width = np.add.reduceat(batch.width, begins)
    at_end = slice(None), ends - 1, slice(-1, None)
    coarse_w, coarse_bent = w[at_end], bent[at_end]
    # From where the closure holds without load.
    level, _ = level_of(
        coarse_w / rise, coarse_bent, batch.half, "power", (width / width.sum())[None, :, None]
    )
    begin = np.repeat(level[:, None], width.size, axis=1)
    found = newton(
        batch, width, coarse_w, coarse_bent, EULER, rise, "power", begin, begin[:, :, None], 250
    )
    lowest = ((coarse_w / rise + found.stage - coarse_bent) / (1.0 + coarse_bent)).min(axis=(1, 2))
    knots = np.append(0.0, np.cumsum(width))
    fine = np.cumsum(batch.width) - batch.width
    values = np.append(found.begin, found.begin[:, :1], axis=1)
    start = np.array([np.interp(fine, knots, row) for row in values])
    return start, 1.0 + lowest


def solve_batch(designs: Designs, pressure: Pressure, edges: Array) -> Solutions:
    """Solve designs of one number of cylinders, inertia model and closure."""
    batch = Batch(designs, pressure, edges)
    count = len(designs)
    ones = np.ones((count, 1, 1))
    w, bent = batch.curves(STAGES)
    nan = np.full(count, np.nan)
    status = np.full(count, CONVERGED)
    torque_range = _torque_range(batch)
    least = 1.0 + bent.min(axis=(1, 2))
    if batch.variable:
        least = _least_inertia(batch, bent)
    surplus = np.where(np.abs(designs.surplus) <= IDLE * torque_range, 0.0, designs.surplus)
    status[surplus < 0.0] = NO_STEADY_STATE
    status[least <= 0.0] = INVALID_INPUT
    batch.kappa = np.maximum(surplus, 0.0)[:, None, None] * batch.kappa / np.where(
        designs.surplus == 0.0, 1.0, designs.surplus
    )[:, None, None]  # fmt: skip
    bent = np.where((status == INVALID_INPUT)[:, None, None], 0.0, bent)
    free = (batch.kappa == 0.0) | (batch.half == 0.0)
    timed = bool(designs.cycle_time[0])

    # Parts whose closure differs are solved apart.
    kinds = np.where(
        free[:, 0, 0] & timed, "time",
        np.where(batch.half[:, 0, 0] == 0.0, "log",
                 np.where(batch.kappa[:, 0, 0] == 0.0, "idle", "power")),
    )  # fmt: skip
    begin = np.zeros((count, edges.size - 1))
    stage = np.zeros(w.shape)
    load = np.zeros(w.shape)
    lowest = np.full(count, np.nan)
    rise = ones.copy()
    for kind in np.unique(kinds):
        mine = np.flatnonzero((kinds == kind) & (status == CONVERGED))
        if mine.size == 0:
            continue
        part = _part(batch, mine)
        if kind != "power":
            got = _without_load(part, w[mine], bent[mine], str(kind).replace("idle", "power"))
        elif timed:
            got = _with_time(part, w[mine], bent[mine])
        else:
            got = _at_nominal(part, w[mine], bent[mine])
        begin[mine], stage[mine], load[mine] = got.begin, got.stage, got.load
        status[mine], lowest[mine], rise[mine] = got.status, got.lowest, got.rise

    result = {name: nan.copy() for name in ("delta", "omega_max", "omega_min", "omega_mean")}
    load_factor, doubt = nan.copy(), np.zeros(count)
    mine = np.flatnonzero(status == CONVERGED)
    if mine.size:
        part = _part(batch, mine)
        r = rise[mine]
        d = (w[mine] / r + stage[mine] - bent[mine]) / (1.0 + bent[mine])
        high, low = (
            _extreme(part, d, r, begin[mine], load[mine], sign) for sign in (1.0, -1.0)
        )  # fmt: skip
        lowest[mine] = (1.0 + low) * r[:, 0, 0]
        stalled = low <= -1.0 + FLOOR
        low = np.maximum(low, -1.0 + FLOOR)
        weights = LOAD @ np.ones(STAGES.size + 1)
        shares = batch.width[None, :, None] * weights / batch.period
        root = np.expm1(0.5 * np.log1p(np.maximum(d, FLOOR - 1.0)))
        mean = 1.0 + (shares * root).sum(axis=(1, 2))
        nominal = designs.speed[mine] * np.sqrt(r[:, 0, 0])
        span = (high - low) / (np.sqrt(1.0 + high) + np.sqrt(1.0 + low))
        for name, value in (
            ("delta", span / mean),
            ("omega_max", nominal * np.sqrt(1.0 + high)),
            ("omega_min", nominal * np.sqrt(1.0 + low)),
            ("omega_mean", nominal * mean),
        ):
            result[name][mine] = np.where(stalled, np.nan, value)
        load_factor[mine] = np.where(free[mine, 0, 0], 1.0, r[:, 0, 0] ** -batch.half[mine, 0, 0])
        status[mine[stalled]] = STALLED
        with np.errstate(divide="ignore", invalid="ignore"):
            lost = ROUNDING * np.ptp(w[mine] / r, axis=(1, 2)) / (high - low)
        doubt[mine] = np.nan_to_num(lost)
    return Solutions(
        status=status, load_factor=load_factor, lowest=lowest,
        mean_gas_torque=batch.lever * batch.mean[:, 0, 0], least_inertia=least,
        torque_range=torque_range, doubt=doubt, **result,
    )  # fmt: skip


@dataclass
class Found:
    """A part's solution; `rise` is (omega/omega_n)^2 of the speed that is its unit."""

    begin: Array
    stage: Array
    load: Array
    status: Integers
    lowest: Array
    rise: Array


def _part(batch: Batch, mine: Integers) -> Batch:
    """Some designs of a batch."""
    part = object.__new__(Batch)
    part.__dict__.update(batch.__dict__)
    part.designs = batch.designs.take(mine)
    for name in ("gas", "eta", "half", "kappa", "mean", "mean_square", "rates", "begins", "lever",
                 "moment"):  # fmt: skip
        setattr(part, name, getattr(batch, name)[mine])
    return part


def _deepest(w: Array, bent: Array, rise: Array) -> Array:
    """How low u can be at all: no lower than the work takes it. Below, Newton has gone astray."""
    swing = np.ptp(w / rise, axis=(1, 2)) + 1.0
    return np.asarray(-2.0 * swing / (1.0 + bent).min(axis=(1, 2)))


def _clearly_stalled(
    batch: Batch, w: Array, bent: Array, lowest: Array, rise: Array
) -> NDArray[np.bool_]:
    """Whether implicit Euler on coarse pieces leaves no doubt."""
    step = COARSER * batch.width.max() * (batch.kappa / rise)[:, 0, 0]
    clear = (lowest < -1.0) & (step < 0.2) & (lowest > _deepest(w, bent, rise))
    return np.asarray(clear)


def _fine(batch: Batch, w: Array, bent: Array, rise: Array, start: Array) -> tuple[Solved, Array]:
    """Collocation from a start at the begins of the pieces; the smallest u at the stages."""
    stage = np.repeat(start[:, :, None], STAGES.size, axis=2)
    found = newton(batch, batch.width, w, bent, STAGES, rise, "power", start, stage, 60)
    if not found.good.all():
        # Implicit Euler on the same pieces first, which converges from anywhere.
        end = slice(None), slice(None), slice(-1, None)
        euler = newton(
            batch,
            batch.width,
            w[end],
            bent[end],
            EULER,
            rise,
            "power",
            start,
            start[:, :, None],
            400,
        )
        stage = np.repeat(euler.stage, STAGES.size, axis=2)
        again = newton(batch, batch.width, w, bent, STAGES, rise, "power", euler.begin, stage, 120)
        failed = ~found.good
        for name in ("begin", "stage", "good", "load"):
            getattr(found, name)[failed] = getattr(again, name)[failed]
    d = (w / rise + found.stage - bent) / (1.0 + bent)
    lowest = 1.0 + d.min(axis=(1, 2))
    found.good &= lowest > _deepest(w, bent, rise)
    return found, lowest


def _without_load(batch: Batch, w: Array, bent: Array, kind: str) -> Found:
    """Only the closure is left: no load, or one that does not depend on the speed."""
    count = len(batch.designs)
    weights = LOAD @ np.ones(STAGES.size + 1)
    shares = batch.width[None, :, None] * weights / batch.period
    level, excess = level_of(w, bent, batch.half, kind, shares)
    stage = np.broadcast_to(level[:, None, None], w.shape)
    d = (w + stage - bent) / (1.0 + bent)
    return Found(
        stage[:, :, 0], stage, np.zeros_like(w), np.where(excess > 0.0, STALLED, CONVERGED),
        np.where(excess > 0.0, -excess, 1.0 + d.min(axis=(1, 2))), np.ones((count, 1, 1)),
    )  # fmt: skip


def _at_nominal(batch: Batch, w: Array, bent: Array) -> Found:
    rise = np.ones((len(batch.designs), 1, 1))
    start, coarse = start_of(batch, w, bent, rise)
    status = np.full(len(batch.designs), CONVERGED)
    status[_clearly_stalled(batch, w, bent, coarse, rise)] = STALLED
    lowest = coarse
    begin, stage, load = start.copy(), np.zeros_like(w), np.zeros_like(w)
    left = np.flatnonzero(status == CONVERGED)
    if left.size:
        part = _part(batch, left)
        found, low = _fine(part, w[left], bent[left], rise[left], start[left])
        begin[left], stage[left], load[left], lowest[left] = (
            found.begin, found.stage, found.load, low,
        )  # fmt: skip
        status[left[low <= FLOOR]] = STALLED
        status[left[~found.good]] = UNDECIDED
    return Found(begin, stage, load, status, lowest, rise)


def _with_time(batch: Batch, w: Array, bent: Array) -> Found:
    """Find the rise at which a cycle takes as long as at nominal speed, by bracketing."""
    count = len(batch.designs)
    low, high = np.full(count, -np.inf), np.full(count, np.inf)
    at_low = np.full(count, np.inf)  # log of the cycle's time there
    x = np.zeros(count)
    best = Found(
        np.zeros(w.shape[:2]), np.zeros_like(w), np.zeros_like(w), np.full(count, UNDECIDED),
        np.full(count, np.nan), np.ones((count, 1, 1)),
    )  # fmt: skip
    last_x, last_y = np.full(count, np.nan), np.full(count, np.nan)
    open_ = np.ones(count, dtype=bool)
    weights = LOAD @ np.ones(STAGES.size + 1)
    shares = batch.width[None, :, None] * weights / batch.period
    for _ in range(80):
        mine = np.flatnonzero(open_)
        if mine.size == 0:
            break
        part, rise = _part(batch, mine), np.exp(x[mine])[:, None, None]
        start, coarse = start_of(part, w[mine], bent[mine], rise)
        y = np.full(mine.size, np.inf)
        run = np.flatnonzero(~_clearly_stalled(part, w[mine], bent[mine], coarse, rise))
        failed = np.zeros(mine.size, dtype=bool)
        if run.size:
            found, least = _fine(
                _part(part, run), w[mine[run]], bent[mine[run]], rise[run], start[run]
            )
            d = (w[mine[run]] / rise[run] + found.stage - bent[mine[run]]) / (1.0 + bent[mine[run]])
            running = found.good & (least > 1e-6)
            time = -0.5 * np.log1p(np.maximum(d, FLOOR - 1.0))
            mean = (shares * np.expm1(time)).sum(axis=(1, 2))
            y[run] = np.where(running, np.log1p(mean) - 0.5 * x[mine[run]], np.inf)
            failed[run] = ~found.good
            to = mine[run]
            best.begin[to], best.stage[to], best.load[to] = found.begin, found.stage, found.load
            best.lowest[to] = least * np.exp(x[to])
            best.rise[to] = rise[run]
        done = np.abs(y) <= 1e-14
        best.status[mine[done]] = CONVERGED
        above = y > 0.0
        low[mine[above]], at_low[mine[above]] = x[mine[above]], y[above]
        high[mine[~above]] = x[mine[~above]]
        with np.errstate(invalid="ignore", divide="ignore"):
            secant = x[mine] - y * (x[mine] - last_x[mine]) / (y - last_y[mine])
        fixed = x[mine] + 2.0 * y
        new = np.where(np.isfinite(secant), secant, fixed)
        inside = (new > low[mine]) & (new < high[mine]) & np.isfinite(new)
        middle = np.where(
            np.isinf(high[mine]), low[mine] + 0.5 + np.abs(low[mine]),
            np.where(np.isinf(low[mine]), high[mine] - 0.5 - np.abs(high[mine]),
                     0.5 * (low[mine] + high[mine])),
        )  # fmt: skip
        new = np.where(inside, new, middle)
        last_x[mine], last_y[mine] = x[mine], np.where(np.isfinite(y), y, np.nan)
        narrow = high[mine] - low[mine] <= 1e-13 * (1.0 + np.abs(low[mine]))
        steady = np.abs(new - x[mine]) <= 1e-15 * (1.0 + np.abs(x[mine]))
        with np.errstate(invalid="ignore"):
            settled = (narrow | steady) & (np.abs(y) < 1e-9)
        best.status[mine[settled]] = CONVERGED
        wall = np.isinf(at_low[mine]) & (high[mine] - low[mine] <= 1e-5)
        best.status[mine[wall & ~done]] = STALLED
        stop = done | settled | wall | failed | (np.abs(x[mine]) > 120.0)
        x[mine] = np.where(stop, x[mine], new)
        open_[mine[stop]] = False
    return best


def _evaluate(
    batch: Batch, phi: Array, rise: Array, begin: Array, load: Array
) -> tuple[Array, Array]:
    """D and its slope at angles (design, any) within the period of `batch.edges`."""
    period = batch.period
    inside = np.mod(phi - batch.edges[0], period) + batch.edges[0]
    piece = np.clip(np.searchsorted(batch.edges, inside, side="right") - 1, 0, batch.width.size - 1)
    t = (inside - batch.edges[piece]) / batch.width[piece]
    rows = np.arange(len(batch.designs))[:, None]
    width = batch.width[piece]
    rates = batch.rates[rows, piece]
    work = batch.begins[rows, piece] + width * ((rates @ WORK) * powers_of(t, POINTS.size + 1)).sum(
        axis=-1
    )
    s = begin[rows, piece] + width * (
        (load[rows, piece] @ LOAD) * powers_of(t, STAGES.size + 1)
    ).sum(axis=-1)
    gas, eta, half, r = (a[:, :, 0] for a in (batch.gas, batch.eta, batch.half, rise))
    kappa = np.where(half > 0.0, batch.kappa[:, :, 0], 0.0)
    torque, square = batch.shapes(inside)
    turn = eta * batch.slopes(inside)
    bent = eta * (square - batch.mean_square[:, :, 0])
    w, slope = gas * work, gas * (torque - batch.mean[:, :, 0])
    if batch.variable:
        theta = 1.0 + bent
        d = (w / r + s - bent) / theta
        slope = slope / r - kappa / r * load_law(d, half)[0] - (1.0 + d) * turn
        return d, slope / theta
    d = (w - bent) / r + s
    return d, (slope - turn) / r - kappa / r * load_law(d, half)[0]


def _extreme(batch: Batch, d: Array, rise: Array, begin: Array, load: Array, sign: float) -> Array:
    """Largest (sign 1) or smallest (-1) d: the best of several local ones, by bisection."""
    count = len(batch.designs)
    signed = sign * d.reshape(count, -1)
    places = batch.edges[:-1, None] + batch.width[:, None] * STAGES
    places = places.ravel()
    local = (signed >= np.roll(signed, 1, axis=1)) & (signed >= np.roll(signed, -1, axis=1))
    ranked = np.where(local, signed, -np.inf)
    candidates = min(4, signed.shape[1])
    top = np.argpartition(-ranked, candidates - 1, axis=1)[:, :candidates]
    size = places.size
    before = places[(top - 1) % size] - np.where(top == 0, batch.period, 0.0)
    after = places[(top + 1) % size] + np.where(top == size - 1, batch.period, 0.0)
    best = signed.max(axis=1)
    low, high = before, after
    _, at_low = _evaluate(batch, low, rise, begin, load)
    _, at_high = _evaluate(batch, high, rise, begin, load)
    crossing = (sign * at_low > 0.0) & (sign * at_high < 0.0)
    for _ in range(34):
        middle = 0.5 * (low + high)
        _, slope = _evaluate(batch, middle, rise, begin, load)
        ahead = sign * slope > 0.0
        low = np.where(ahead, middle, low)
        high = np.where(ahead, high, middle)
    value, _ = _evaluate(batch, 0.5 * (low + high), rise, begin, load)
    found = np.where(crossing, sign * value, -np.inf).max(axis=1)
    return np.asarray(sign * np.maximum(best, found))


def _least_inertia(batch: Batch, bent: Array) -> Array:
    """Smallest Theta(phi)/Theta, at a root of its slope."""
    count = len(batch.designs)
    flat = bent.reshape(count, -1)
    places = (batch.edges[:-1, None] + batch.width[:, None] * STAGES).ravel()
    at = flat.argmin(axis=1)
    low, high = places[at] - batch.width.max(), places[at] + batch.width.max()
    low, high = low[:, None], high[:, None]
    for _ in range(40):
        middle = 0.5 * (low + high)
        ahead = batch.slopes(middle) < 0.0
        low, high = np.where(ahead, middle, low), np.where(ahead, high, middle)
    square = np.zeros_like(low)
    for i in range(batch.count):
        angle = 0.5 * (low + high) + i * batch.period
        square += velocity(angle, batch.designs.crank_ratio[:, None]) ** 2
    refined = (batch.eta[:, :, 0] * (square - batch.mean_square[:, :, 0]))[:, 0]
    return np.asarray(1.0 + np.minimum(refined, flat.min(axis=1)))


def _torque_range(batch: Batch) -> Array:
    """Range of the torque at nominal speed [N m], from samples of some tenths of a degree."""
    at = (batch.edges[:-1, None] + batch.width[:, None] * POINTS).ravel()
    shape = np.zeros((len(batch.designs), at.size))
    ratio = batch.designs.crank_ratio[:, None]
    for i in range(batch.count):
        angle = at + i * batch.period
        shape -= velocity(angle, ratio) * acceleration(angle, ratio)
    torque = batch.lever[:, None] * batch.rates.reshape(len(batch.designs), -1)
    return np.asarray(np.ptp(torque + batch.moment[:, None] * shape, axis=1))


# All of them --------------------------------------------------------------------------------------


def solve(
    designs: Designs, pressure: Pressure, knots: Array, splits: int = 1, batch: int = BATCH
) -> Solutions:
    """Solve every design.

    Parameters
    ----------
    designs : Designs
    pressure : callable
        ``pressure(row, phi)`` [Pa], of period 4 pi, a cubic between neighbouring knots.
    knots : ndarray
        Angles [rad] within one cycle.
    splits : int
        Into how many pieces each piece is cut once more.  Designs that nearly stall, whose inertia
        nearly vanishes, or whose load is stiff over a piece anywhere in the cycle, are solved again
        with pieces `FINER` times as short.
    batch : int
        Designs solved together, for speed.
    """
    found = _solve(designs, pressure, knots, splits, batch)
    nearly = (found.lowest > -1.0) & (found.lowest < NEARLY)
    thin = designs.variable & (found.least_inertia < NEARLY)
    stiff = _stiffness(designs, found) * WIDEST / splits > STIFF
    again = np.isin(found.status, (CONVERGED, STALLED, UNDECIDED))
    again &= nearly | ((stiff | thin) & ~(found.lowest < -1.0)) | (found.status == UNDECIDED)
    mine = np.flatnonzero(again)
    if mine.size:
        some = designs.take(mine)
        finer = _solve(some, pressure, knots, FINER * splits, max(1, batch // FINER))
        with np.errstate(invalid="ignore"):
            doubt = np.abs(found.delta[mine] / finer.delta - 1.0)
        for name in (f.name for f in fields(Solutions)):
            getattr(found, name)[mine] = getattr(finer, name)
        doubt = np.maximum(np.where(np.isfinite(doubt), doubt, np.inf), finer.doubt)
        found.doubt[mine] = np.where(np.isnan(doubt), np.inf, doubt)
    return found


def _stiffness(designs: Designs, found: Solutions) -> Array:
    """Bound of kappa dF/du / theta over the cycle [1/rad]; where none runs, at the asked speed.

    Where the inertia nearly vanishes the speed peaks, and a load that is weak in the mean is not.
    """
    energy = 0.5 * designs.inertia * designs.speed**2
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        steep = designs.exponent * np.abs(designs.surplus) / energy
        high, low = (
            (speed / designs.speed) ** (designs.exponent - 2.0)
            for speed in (found.omega_max, found.omega_min)
        )
        theta = np.where(designs.variable, found.least_inertia, 1.0)
        local = steep * found.load_factor * np.maximum(high, low) / theta
    return np.where(found.status == CONVERGED, local, steep)


def _solve(
    designs: Designs, pressure: Pressure, knots: Array, splits: int, batch: int
) -> Solutions:
    size = len(designs)
    result = {f.name: np.full(size, np.nan) for f in fields(Solutions)}
    status = np.full(size, UNDECIDED)
    keys = np.stack(
        [designs.cylinders, designs.variable.astype(int), designs.cycle_time.astype(int)], axis=1
    )
    for key in np.unique(keys, axis=0):
        mine = np.flatnonzero((keys == key).all(axis=1))
        edges = pieces_of(knots, int(key[0]), WIDEST)
        if splits > 1:
            share = np.arange(splits) / splits
            inner = (edges[:-1, None] + np.diff(edges)[:, None] * share).ravel()
            edges = np.append(inner, edges[-1])
        for first in range(0, mine.size, batch):
            some = mine[first : first + batch]
            with np.errstate(all="ignore"):
                got = solve_batch(designs.take(some), pressure, edges)
            for name, array in result.items():
                array[some] = getattr(got, name)
            status[some] = got.status
    return Solutions(**{**result, "status": status})
