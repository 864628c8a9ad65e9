"""The inertia that gives a wanted coefficient of speed fluctuation, for every design of a sweep.

The root of log delta(Theta) - log delta_w is found over log Theta by secants, docs/method.md (91),
in a bracket that is halved where a secant leaves it. Each step solves all designs that are not
done, by the same function as a sweep.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn import status
from engine_dyn.speed import dispatch
from engine_dyn.types import Floats

Codes = npt.NDArray[np.int8]
Places = npt.NDArray[np.intp]

MOST_STEPS = 60
LONGEST_STEP = np.log(16.0)
SLOPES = -4.0, -0.25
"""Range of slopes of log delta over log Theta; a secant outside it is replaced by -1."""

_WHOLE = (
    "family", "closure", "cylinders_by_count", "threads", "driven", "general", "finer", "iterated",
    "card",
)  # fmt: skip
"""Arguments of `dispatch.solve` that hold for all designs together."""


class Required(NamedTuple):
    """Results of `solve_for_inertia`, in the shape that its arguments broadcast to."""

    inertia: Floats  # Moment of inertia [kg m2]; NaN where `status` is 1 to 4
    # Codes of `engine_dyn.status`: 1 and 4 where the wanted delta exceeds that of the lightest
    # engine that runs, 5 where delta misses it by more than the tolerance.
    status: Codes
    # Largest delta found below the wanted one; for a design that fails, the largest possible delta.
    largest: Floats
    lightest: Floats  # Inertia at which delta is `largest` [kg m2]


def solve_for_inertia(
    *, wanted_delta: Any, energy_swing: Any = None, tolerance: float = 1e-6,
    progress: Callable[[int], None] | None = None, **given: Any,
) -> Required:  # fmt: skip
    """Find the inertia that gives a wanted delta, for every design of a product of axes.

    Parameters
    ----------
    wanted_delta : array_like
        Coefficient of speed fluctuation wanted, above 0.
    energy_swing : array_like, optional
        Range of the work of the torque, less a load over angle and the mean [J], from which the
        search starts, docs/method.md (91). Without it, for a load over speed alone, it follows from
        the fluctuation with a large inertia.
    tolerance : float
        Relative error of delta aimed at.
    progress, **given
        As `dispatch.solve`, without `inertia`; `wanted` and `crank_angle` are not used.
    """
    whole = {name: given[name] for name in _WHOLE if name in given}
    columns: dict[str, Any] = {
        name: np.asarray(value)
        for name, value in given.items()
        if name not in (*_WHOLE, "wanted", "crank_angle")
    }
    if energy_swing is None:
        energy_swing = _swing_of_heavy(whole, columns)
    shape = np.broadcast_shapes(*map(np.shape, (wanted_delta, energy_swing, *columns.values())))

    def outcome(active: Places, inertia: Floats) -> tuple[Floats, Codes]:
        places: Any = active
        given: dict[str, Any] = {**columns, "inertia": inertia.reshape(shape)}
        # Unfinished designs are solved separately when no more than a quarter of all remains.
        if active.size <= 0.25 * math.prod(shape):
            places, along = slice(None), np.unravel_index(active, shape) if shape else ()
            given = {
                name: np.broadcast_to(one, shape)[along].reshape(-1) if one.ndim else one
                for name, one in given.items()
            }
        solution = dispatch.solve(wanted=("delta",), tolerance=tolerance, **whole, **given)
        return solution["delta"].reshape(-1)[places], solution["status"].reshape(-1)[places]

    def flat(value: Any) -> Floats:
        return np.array(np.broadcast_to(value, shape), dtype=float).reshape(-1)

    with np.errstate(divide="ignore", invalid="ignore"):
        start = flat(energy_swing) / (flat(wanted_delta) * flat(columns["speed"]) ** 2)
    required = search(outcome, start, flat(wanted_delta), tolerance, progress)
    return Required._make(array.reshape(shape) for array in required)


def _swing_of_heavy(whole: dict[str, Any], columns: dict[str, Any]) -> Floats:
    """Energy swing [J] from delta with a large inertia, docs/method.md (91); else an estimate."""
    area = 0.25 * np.pi * columns["bore"] ** 2
    radius, speed = 0.5 * columns["double_radius"], columns["speed"]
    # The energy swing is taken from the fluctuation with an inertia of 100 times that whose kinetic
    # energy is the work of one stroke under 100 bar and that of the reciprocating masses: delta is
    # then small, some 1e-3, and proportional to the swing.
    energy = 2.0 * radius * area * 1e7 + columns["mass"] * (radius * speed) ** 2
    heavy = 100.0 * energy / speed**2
    calm = {"exponent": 0.0, "inertia_model": "constant", "method": "auto", "inertia": heavy}
    solution = dispatch.solve(**{**whole, **columns, **calm, "wanted": ("delta",)})
    swing = solution["delta"] * heavy * speed**2
    return np.asarray(np.where(np.isfinite(swing), swing, energy), dtype=float)


def search(
    outcome: Callable[[Places, Floats], tuple[Floats, Codes]],
    start: Floats,
    goal: Floats,
    tolerance: float,
    progress: Callable[[int], None] | None = None,
) -> Required:
    """Find the inertia for each of some designs, from a function that solves them.

    `outcome` takes the numbers of the designs to solve and the inertias of all, and returns delta
    and status of those asked for. `start` is the inertia to begin with [kg m2] and `goal` the
    wanted delta, shape (designs,); the rest is as of `solve_for_inertia`.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        x, target = np.log(start), np.log(goal)
    state = np.where(np.isfinite(x), status.NOT_CONVERGED, status.INVALID_INPUT).astype(np.int8)
    active = np.flatnonzero(state == status.NOT_CONVERGED)
    # Ends of the bracket of ln Theta: `low` is too light (or delta too large), `high` too heavy.
    low, high = np.full(x.size, -np.inf), np.full(x.size, np.inf)
    low_code = np.full(x.size, status.CONVERGED, dtype=np.int8)
    high_miss, last_x, last_miss = np.full((3, x.size), np.nan)
    for _ in range(MOST_STEPS):
        if not active.size:
            break
        here = x[active]
        delta, code = outcome(active, np.exp(x))
        with np.errstate(divide="ignore", invalid="ignore"):
            miss = np.log(delta) - target[active]
            slope = (miss - last_miss[active]) / (here - last_x[active])
        runs = np.isin(code, status.WITH_NUMBERS)
        # More inertia helps where the engine stops within the cycle, and with variable inertia
        # where that of the reciprocating parts exceeds the given one.
        light = np.isin(code, (status.STALLED, status.INVALID_INPUT))
        number = runs & np.isfinite(miss)
        # A design without numbers that is not too light has none with any inertia.
        lost = ~number & ~light
        above, below = light | (number & (miss > 0.0)), number & (miss <= 0.0)
        low[active[above]] = np.maximum(low[active[above]], here[above])
        low_code[active[above]] = np.where(light, code, status.CONVERGED)[above]
        high[active[below]], high_miss[active[below]] = here[below], miss[below]
        last_x[active[number]], last_miss[active[number]] = here[number], miss[number]
        left, right, stops = low[active], high[active], low_code[active]
        # Delta must be within this fraction of the tolerance.
        done = number & (np.abs(miss) <= 0.1 * tolerance)
        # The bracket is as narrow as rounding: delta jumps by more than the tolerance there, or the
        # engine stops before delta is the wanted one.
        narrow = right - left <= 4e-16 * np.maximum(np.abs(here), 1.0)
        state[active] = np.select(
            [lost & runs, lost | done, narrow & (stops != status.CONVERGED), narrow],
            [np.int8(status.INVALID_INPUT), code, stops, np.int8(status.TOLERANCE_NOT_MET)],
            np.int8(status.NOT_CONVERGED),
        )
        slope = np.where(np.isfinite(slope) & (slope > SLOPES[0]) & (slope < SLOPES[1]), slope, -1)
        step = np.clip(-miss / slope, -LONGEST_STEP, LONGEST_STEP)
        after = here + np.where(light, 0.5 * LONGEST_STEP, step)
        # Where the engine stalls there is no slope to follow: the bracket is halved.
        halved = np.isfinite(left) & np.isfinite(right)
        halved &= (after <= left) | (after >= right) | light
        after[halved] = 0.5 * (left[halved] + right[halved])
        go = ~(lost | done | narrow)
        x[active[go]] = after[go]
        if progress is not None:
            progress(int(np.count_nonzero(~go)))
        active = active[go]
    # Designs that ran out of steps have the outcome of the light end of the bracket, if any.
    unfinished = (state == status.NOT_CONVERGED) & (low_code != status.CONVERGED)
    state[unfinished] = low_code[unfinished]
    inertia = np.where(np.isin(state, status.WITH_NUMBERS), np.exp(x), np.nan)
    return Required(inertia, state, np.exp(high_miss + target), np.exp(high))
