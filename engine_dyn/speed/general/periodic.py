"""The periodic solution of one design, and whether there is one.

`solve_one` chooses between the closed form, the iteration and Newton's method. The other functions
decide whether a solution exists and whether it is stable (docs/method.md chapter 11).
"""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import FLOOR, half_of, is_power, load_terms
from engine_dyn.speed.arguments import Choice
from engine_dyn.speed.general.newton import newton
from engine_dyn.speed.general.reduction import Design
from engine_dyn.speed.general.scratch import DTAU, DW, TAU, D, Scratch, W
from engine_dyn.speed.general.segments import (
    MOST_PASSES,
    POWERS,
    SEGMENTS,
    Q,
    iterate,
    place_of,
    solve_linear,
)
from engine_dyn.speed.general.stiff import follow_work
from engine_dyn.speed.methods import CLOSED, NEWTON, POWER_MEAN
from engine_dyn.speed.tables.work_tables import GAS_TORQUE, GAS_WORK, SQUARE, SQUARE_SLOPE
from engine_dyn.status import CONVERGED, NOT_CONVERGED, STALLED
from engine_dyn.types import Floats

__all__ = [
    "CERTAIN",
    "NEWTON_STEPS",
    "STRONG_LOAD",
    "fill_curve",
    "holds",
    "is_linear",
    "is_stiff",
    "must_stall",
    "pulls_back",
    "solve_one",
    "take_curve",
]

NEWTON_STEPS = 60
"""Largest number of Newton's steps."""

STRONG_LOAD = 1e-3
"""Limit of kappa times the width of an interval. Below it, the error of the two-point formula is
negligible. Above it, that error is estimated, docs/method.md (95), and linear equations are solved
without the formula, docs/method.md (78)."""

CERTAIN = 0.01
"""Margin by which the mean of docs/method.md (88) over nodes must exceed 1, because it stands for
an integral."""


@inlined
def fill_curve(design: Design, variable: bool, table: Floats, curve: Floats) -> None:
    """Fill in w, w', tau and tau' at the nodes: docs/method.md (20) to (22), (27) and (47)."""
    for j in range(table.shape[1]):
        curve[W, j] = design.gas * table[GAS_WORK, j]
        curve[DW, j] = design.gas * table[GAS_TORQUE, j]
        curve[TAU, j] = 1.0
        curve[DTAU, j] = 0.0
        if variable:
            curve[TAU, j] += design.eta * table[SQUARE, j]
            curve[DTAU, j] = design.eta * table[SQUARE_SLOPE, j]
        else:
            curve[W, j] -= design.eta * table[SQUARE, j]
            curve[DW, j] -= design.eta * table[SQUARE_SLOPE, j]


@inlined
def take_curve(design: Design, curve: Floats, records: Floats) -> None:
    """Copy the solution of a curve into the records."""
    nodes = curve.shape[1]
    for j in range(nodes):
        here = place_of(j, nodes // SEGMENTS)
        q = (1.0 + curve[D, j]) / curve[TAU, j]
        records[here + Q] = q
        records[here + POWERS], _, _ = load_terms(q, design.law)


@inlined
def must_stall(design: Design, variable: bool, period: float, table: Floats) -> bool:
    """Whether no periodic speed above zero exists, with the power mean as closure.

    docs/method.md (88). From the angle of the least work X on, the load takes at most the work of a
    whole period, kappa Phi, because the mean of F is 1. So q >= (X - min X - kappa Phi)/tau
    wherever that is positive. If the mean of F of this bound exceeds 1, there is no solution. The
    test saves all the steps that Newton's method would need before it gives up.
    """
    gas, eta = design.gas, design.eta
    inertia, masses = (eta, 0.0) if variable else (0.0, eta)
    nodes = table.shape[1]
    least, most = math.inf, -math.inf
    for j in range(nodes):
        work = gas * table[GAS_WORK, j] - masses * table[SQUARE, j]
        least = min(least, work)
        most = max(most, work)
    least += design.kappa * period
    # A bound below 1 cannot have a mean above 1, unless tau is small. This is the usual case.
    if most - least < 1.0:
        return False
    total = 0.0
    half = half_of(design.law)
    for j in range(nodes):
        work = gas * table[GAS_WORK, j] - masses * table[SQUARE, j] - least
        q = max(work / (1.0 + inertia * table[SQUARE, j]), FLOOR)
        if half > 0.0:
            total += math.exp(half * math.log(q)) - 1.0
        else:
            total += math.log(q)
    return total > CERTAIN * nodes


@inlined
def is_linear(choice: Choice) -> bool:
    """Whether the equation is linear with a constant coefficient, docs/method.md (61)."""
    linear = choice.kind == 2 and not choice.variable and choice.closure == POWER_MEAN
    return linear and choice.method != NEWTON


@inlined
def is_stiff(design: Design, width: float, choice: Choice) -> bool:
    """Whether a design is solved by `stiff`, docs/method.md (78).

    The solution is then a table in `Scratch.curve`.
    """
    return is_linear(choice) and design.kappa * width > STRONG_LOAD


@inlined
def solve_one(
    design: Design, width: float, choice: Choice, segments: int, scratch: Scratch
) -> tuple[int, int, float]:
    """Write the periodic solution of one design to the records; return outcome, iterations, mu."""
    nodes = scratch.table.shape[1]
    alone = choice.method == NEWTON or (
        choice.method == CLOSED and choice.kind != 0 and choice.variable
    )
    passes = 0
    possible = alone or choice.closure != POWER_MEAN or not is_power(design.law)
    if not possible and must_stall(design, choice.variable, width * nodes, scratch.table):
        return STALLED, 1, 1.0
    if not alone:
        if is_linear(choice):
            if is_stiff(design, width, choice):
                follow_work(
                    width, design.gas, design.eta, design.kappa, scratch.table, scratch.curve,
                    scratch.records,
                )  # fmt: skip
            else:
                solve_linear(
                    width, design.gas, design.eta, design.kappa, segments, scratch.records,
                    scratch.running,
                )  # fmt: skip
            return CONVERGED, 1, 1.0
        passes, mu = iterate(
            width, design.gas, design.eta, design.kappa, design.law, choice.kind,
            choice.variable, choice.closure, choice.iterated, segments,
            scratch.records, scratch.running,
        )  # fmt: skip
        if passes > 0:
            return CONVERGED, passes, mu
    fill_curve(design, choice.variable, scratch.table, scratch.curve)
    steps, mu, _, smallest = newton(
        design.kappa, design.law, choice.closure, width, nodes, scratch.curve[W],
        scratch.curve[DW], scratch.curve[TAU], scratch.curve[DTAU], scratch.curve[D],
        scratch.curve[5:], 1e-7, NEWTON_STEPS,
    )  # fmt: skip
    take_curve(design, scratch.curve, scratch.records)
    code = CONVERGED
    if steps < 0:
        code = NOT_CONVERGED if smallest > FLOOR else STALLED
    return code, abs(steps) + (0 if alone else MOST_PASSES), mu


@inlined
def holds(design: Design, variable: bool, table: Floats, records: Floats) -> bool:
    """Whether the solution is stable: whether small deviations decay, docs/method.md (87).

    A deviation of the energy changes in a period by the factor of docs/method.md (86). It always
    decays with a power law, and with a driver whose torque falls with the speed.
    """
    if is_power(design.law) or design.kappa == 0.0:
        return True
    nodes = table.shape[1]
    total = 0.0
    for j in range(nodes):
        _, first, _ = load_terms(records[place_of(j, nodes // SEGMENTS) + Q], design.law)
        total += first / (1.0 + design.eta * table[SQUARE, j] if variable else 1.0)
    return design.kappa * total > 0.0


@inlined
def pulls_back(design: Design) -> bool:
    """Whether load or driver oppose a deviation from the nominal speed: docs/method.md (86)."""
    if is_power(design.law) or design.kappa == 0.0:
        return True
    _, first, _ = load_terms(1.0, design.law)
    return design.kappa * first > 0.0
