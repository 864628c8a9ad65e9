"""The steady cycle where the torque over speed is stiff: integrate in time order until it repeats.

Nothing is shared with the package.  The equation is that of `solution`,

    ``de/dphi = w'(phi) - kappa (F(u) - 1)``,   ``u = e / theta(phi)``,

integrated with SciPy's Radau, an implicit formula that damps whatever dies out within a step, so
that it does not matter how stiff the load is.  A single cycle ends where the steady one does
wherever deviations shrink.  Cycles from a lower start never cross those from a higher one, because
the equation is of first order; so starts from far above and from below find the highest and the
lowest steady cycle, and there is none between them and standstill where all cycles end there.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]

STANDSTILL = 1e-6
"""(omega/omega_n)^2 below which the machine stands."""

FASTEST = 1e7
"""Energy over the nominal one above which the machine runs away."""

CYCLES = 60


@dataclass(frozen=True)
class Cycle:
    """The last cycle of those followed.

    ``closed`` tells whether it repeats; ``lowest``, ``highest`` and ``mean`` are of omega/omega_n;
    ``decay`` is the logarithm of the factor by which a deviation grows in it, ``time`` is its time
    over that at the nominal speed.
    """

    closed: bool
    stands: bool
    lowest: float = math.nan
    highest: float = math.nan
    mean: float = math.nan
    decay: float = math.nan
    time: float = math.nan
    cycles: int = 0

    @property
    def delta(self) -> float:
        """Coefficient of speed fluctuation."""
        return (self.highest - self.lowest) / self.mean


@dataclass(frozen=True)
class Stiff:
    """One equation: ``work_rate`` is ``w'``, ``law`` gives F and dF/du, ``theta`` the inertia."""

    work_rate: Callable[[Any], Any]
    kappa: float
    law: Callable[[Any], tuple[Any, Any]]
    period: float
    theta: Callable[[Any], Any] = lambda phi: np.ones_like(np.asarray(phi, dtype=float))
    mu: float = 1.0


def follow(
    problem: Stiff, start: float = 1.0, relative: float = 1e-10, most: int = CYCLES,
    widest: float = math.pi / 45.0, closed: float = 1e-9,
) -> Cycle:  # fmt: skip
    """Follow cycles from ``u = start`` at angle 0 until one repeats, or the machine stands.

    Where deviations shrink slowly, the next cycle starts where this shrinking leads to.
    """
    value = start * float(problem.theta(0.0))

    def rate(phi: float, e: Array) -> Array:
        force, _ = problem.law(e / problem.theta(phi))
        return np.asarray(problem.work_rate(phi) - problem.kappa * (force / problem.mu - 1.0))

    def slope(phi: float, e: Array) -> Array:
        theta = problem.theta(phi)
        _, first = problem.law(e / theta)
        return np.asarray([-problem.kappa / problem.mu * first / theta]).reshape(1, 1)

    def standing(phi: float, e: Array) -> float:
        return float(e[0] / problem.theta(phi) - STANDSTILL)

    def running(phi: float, e: Array) -> float:
        return float(e[0] - FASTEST)

    standing.terminal = running.terminal = True  # type: ignore[attr-defined]  # SciPy's way
    if value <= STANDSTILL:
        return Cycle(False, True)
    for cycle in range(1, most + 1):
        found = solve_ivp(
            rate, (0.0, problem.period), [value], method="Radau", jac=slope, rtol=relative,
            atol=1e-3 * relative, max_step=widest, dense_output=True, events=(standing, running),
        )  # fmt: skip
        if found.status != 0:
            return Cycle(False, bool(found.t_events[0].size), cycles=cycle)
        end = float(found.y[0, -1])
        this = _of(problem, found, cycle)
        factor = math.exp(min(this.decay, 0.0))
        step = (end - value) / (1.0 - factor) if factor < 1.0 else end - value
        if factor < 1.0 and abs(step) <= closed * (1.0 + end):
            return this
        value = value + step if abs(step) <= 0.3 * value and factor < 0.9999 else end
    return Cycle(False, False, cycles=most)


def after(problem: Stiff, start: float, relative: float = 1e-11) -> float:
    """(omega/omega_n)^2 after ``period``, from ``start`` at angle 0."""

    def rate(phi: float, e: Array) -> Array:
        force, _ = problem.law(e / problem.theta(phi))
        return np.asarray(problem.work_rate(phi) - problem.kappa * (force / problem.mu - 1.0))

    found = solve_ivp(
        rate, (0.0, problem.period), [start * float(problem.theta(0.0))], method="Radau",
        rtol=relative, atol=1e-3 * relative,
    )  # fmt: skip
    return float(found.y[0, -1] / problem.theta(problem.period))


def _of(problem: Stiff, found: Any, cycles: int) -> Cycle:
    """Extremes from samples, and again from closer ones there; means by the trapezoidal rule."""
    count = 20 * round(problem.period / math.radians(1.0))
    width = problem.period / count
    phi = np.arange(count) * width

    def speed_at(angle: Any) -> Array:
        place = np.mod(angle, problem.period)
        return np.asarray(np.sqrt(found.sol(place)[0] / problem.theta(place)))

    def highest(sign: float) -> float:
        top = phi[int(np.argmax(sign * speed))]
        return _peak(sign * speed_at(top + np.linspace(-width, width, 201)))

    speed = speed_at(phi)
    _, first = problem.law(speed**2)
    decay = -problem.kappa / problem.mu * float(np.mean(first / problem.theta(phi)))
    return Cycle(
        True, False, -highest(-1.0), highest(1.0), float(np.mean(speed)), decay * problem.period,
        float(np.mean(1.0 / speed)), cycles,
    )  # fmt: skip


def _peak(values: Array) -> float:
    """Largest value of the parabola through the largest sample and its neighbours."""
    top = min(max(int(np.argmax(values)), 1), values.size - 2)
    left, here, right = values[top - 1 : top + 2]
    bend = left - 2.0 * here + right
    peak = here - (right - left) ** 2 / (8.0 * bend) if bend < 0.0 else here
    return float(max(peak, np.max(values)))
