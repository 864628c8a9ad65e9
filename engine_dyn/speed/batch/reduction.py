"""From the inputs of a block of designs to the numbers of its equation."""

from __future__ import annotations

import math

from engine_dyn.compilation import formula, inlined, wide_vectors
from engine_dyn.speed.arguments import MOTOR
from engine_dyn.speed.batch.closures import (
    alias_of_mean,
    constant_without_load,
    terms_of_power,
)
from engine_dyn.speed.batch.forms import (
    CONSTANT_LOAD,
    RATIONAL,
    VARIABLE_INERTIA,
    Form,
    Inertia,
)
from engine_dyn.speed.batch.powers import loss_of
from engine_dyn.speed.batch.rational import (
    fill_linear_square,
    fill_motor,
    terms_of_rational,
)
from engine_dyn.speed.batch.state import (
    BETA,
    BORE,
    CLOSURE_ALIAS,
    CLOSURE_CONSTANT,
    CLOSURE_STEP,
    CODE,
    DECAY,
    DEFERRED,
    DOUBLE_RADIUS,
    ENERGY_SCALE,
    ETA,
    EULER_FAR,
    EULER_NEAR,
    EXPONENT,
    FROZEN,
    GAS_FACTOR,
    GAS_TORQUE_RANGE,
    INERTIA,
    ITERATION_COUNT,
    KAPPA,
    LAST_CHANGE,
    LAW_BEND,
    LAW_LINEAR,
    LAW_RISE,
    LAW_SLOPE,
    LAW_SQUARE,
    LAW_TWIST,
    MASS,
    MEAN_SQUARE,
    MEAN_TORQUE,
    OFFSET,
    P_WEIGHT,
    P_WORK_WEIGHT,
    PERIOD_FACTOR,
    REMAINDER_WEIGHT,
    RUNNING,
    RUNNING_WEIGHT,
    SENSE,
    SHIFT,
    SLOPE_DOUBT,
    SPEED,
    SPEED_ALIAS,
    V_WEIGHT,
    V_WORK_WEIGHT,
)
from engine_dyn.speed.batch.two_grid import ALIAS_P, ALIAS_V, ALIASED, LARGEST_STEP, PP, PV, VV
from engine_dyn.speed.batch.values import constant
from engine_dyn.speed.results import IDLE
from engine_dyn.status import NO_STEADY_STATE
from engine_dyn.types import Floats

__all__ = ["LARGEST_ALIAS", "LARGEST_SLOPE", "NO_LOAD", "SMALLEST_SLOPE", "reduce_inputs"]

NO_LOAD = 1e-30
"""Smallest kappa: its solution is that without load to rounding, and nothing divides by zero."""

LARGEST_ALIAS = 1e-3
"""Largest share of a table that the coarse grid may see wrongly; of usual ones it is 1e-4."""

SMALLEST_SLOPE, LARGEST_SLOPE = 1e-4, 8.0
"""Range of a: below it the closure -mean(r)/a loses its digits, above it `exp_of` does not hold,
which takes the powers."""


@formula
def gain_of_period(x: float, nodes: int) -> float:
    """Return d^N - 1 for d = exp(-x), docs/method.md (113): a series, doubled six times."""
    gain = -loss_of(x * nodes / 64.0)
    for _ in range(6):
        gain *= 2.0 + gain
    return gain


@formula
def first_constant(variable: bool, bend: float, pp: float, pv: float, vv: float) -> float:
    """Constant of the closure to second order, docs/method.md (115).

    From the means of (g P)^2, g P eta V and (eta V)^2.
    """
    cross, last = (bend + 1.0, bend + 2.0) if variable else (bend, bend)
    return cross * pv - 0.5 * (bend * pp + last * vv)


@inlined
def fill_law(form: Form, kind: int, lanes: int, state: Floats) -> None:
    """Fill the rows of the law over speed, and SENSE, the sign of the mean torque that it needs."""
    wide_vectors()
    if len(form) == RATIONAL:
        if kind == MOTOR:
            fill_motor(lanes, state)
        else:
            fill_linear_square(lanes, state)
        return
    for k in range(lanes):
        a = 0.5 * state[EXPONENT + k] if len(form) != CONSTANT_LOAD else 1.0
        b2, b3, _ = terms_of_power(a)
        state[LAW_SLOPE + k] = a
        state[LAW_BEND + k] = 2.0 * b2
        state[LAW_TWIST + k] = 6.0 * b3
        state[SENSE + k] = 1.0


@inlined
def reduce_inputs(
    form: Form, inertia: Inertia, kind: int, step: float, nodes: int, shape: float,
    least_square: float, invalid: float, constants: Floats, lanes: int, state: Floats,
) -> None:  # fmt: skip
    """Reduced parameters, weights of the recurrence and a first constant, from the inputs.

    `kind` is that of `Choice`; `shape`, `least_square` and `invalid` are as of `block.solve_block`;
    `step` is the width H of a coarse interval [rad], `nodes` is their number in a period.
    """
    wide_vectors()
    variable = len(inertia) == VARIABLE_INERTIA
    constant_load = len(form) == CONSTANT_LOAD
    fill_law(form, kind, lanes, state)
    for k in range(lanes):
        radius = 0.5 * state[DOUBLE_RADIUS + k]
        lever = 0.25 * math.pi * state[BORE + k] * state[BORE + k] * radius
        throw = state[MASS + k] * radius * radius
        square = state[SPEED + k] * state[SPEED + k]
        # Divisions take as long as ten multiplications: one for two.
        inverse = 1.0 / (state[INERTIA + k] * square * state[ENERGY_SCALE + k])
        per_energy = 2.0 * inverse
        surplus = state[MEAN_TORQUE + k] - state[OFFSET + k]
        swing = IDLE * (lever * state[GAS_TORQUE_RANGE + k] + throw * square * shape)
        g = lever * per_energy
        eta = throw * (inverse * square)
        if variable:  # the inertia has no energy scale
            eta *= state[ENERGY_SCALE + k]
        a = state[LAW_SLOPE + k]
        if len(form) == RATIONAL:
            surplus *= state[SENSE + k]
        kappa = surplus * per_energy if not constant_load else 0.0
        per_slope = 1.0 / a
        kappa = kappa if kappa > NO_LOAD else NO_LOAD
        code = 0.0
        code = DEFERRED if surplus <= swing else code
        code = float(NO_STEADY_STATE) if surplus < -swing else code
        x = a * kappa * step
        # Not `x > ...`: what is no number is deferred as well.
        code = code if x <= LARGEST_STEP or code != 0.0 else DEFERRED
        code = invalid if variable and 1.0 + eta * least_square <= 0.0 else code
        largest = LARGEST_SLOPE if len(form) != RATIONAL else math.inf
        code = code if SMALLEST_SLOPE <= a <= largest or code != 0.0 else DEFERRED
        code = code if constant(constants, ALIASED, k) <= LARGEST_ALIAS or code != 0.0 else DEFERRED
        kappa = kappa if x <= LARGEST_STEP else LARGEST_STEP / step * per_slope
        x = x if x <= LARGEST_STEP else LARGEST_STEP
        loss = loss_of(x)
        whole = gain_of_period(x, nodes)
        square_of_step = 1.0 + x * x / 12.0
        inverse = 1.0 / (square_of_step * whole)
        linear_factor = inverse * whole
        decay = 1.0 - loss
        state[CODE + k] = code
        state[GAS_FACTOR + k] = g
        state[ETA + k] = eta
        state[KAPPA + k] = kappa
        state[BETA + k] = a * kappa
        state[DECAY + k] = decay
        state[P_WORK_WEIGHT + k] = linear_factor * g * loss / step
        state[V_WORK_WEIGHT + k] = linear_factor * eta * loss / step
        state[P_WEIGHT + k] = linear_factor * g
        state[V_WEIGHT + k] = linear_factor * eta
        state[REMAINDER_WEIGHT + k] = kappa * step * (0.5 - x / 12.0 * (1.0 - x * x / 60.0))
        state[RUNNING_WEIGHT + k] = kappa * step * decay
        state[EULER_NEAR + k] = kappa * step * (82.0 / 1440.0)
        state[EULER_FAR + k] = kappa * step * (11.0 / 1440.0)
        state[PERIOD_FACTOR + k] = -inverse * square_of_step
        state[SHIFT + k] = 0.0
        state[RUNNING + k] = 0.0
        pp = g * g * constant(constants, PP, k)
        pv = g * eta * constant(constants, PV, k)
        vv = eta * eta * constant(constants, VV, k)
        state[MEAN_SQUARE + k] = pp - 2.0 * pv + vv
        loose = state[MEAN_SQUARE + k] + (vv if variable else 0.0)
        bend = state[LAW_BEND + k]
        doubt = (1.0 + bend) * (1.0 + bend)
        if len(form) == RATIONAL:
            doubt += abs(state[LAW_TWIST + k])
        state[SLOPE_DOUBT + k] = 4.0 * (1.0 + doubt) * loose
        state[CLOSURE_CONSTANT + k] = first_constant(variable, bend, pp, pv, vv)
        state[FROZEN + k] = 0.0
        state[ITERATION_COUNT + k] = 1.0
        state[CLOSURE_STEP + k] = 0.0
        state[LAST_CHANGE + k] = 1e300
    for k in range(lanes):
        g, eta, a = state[GAS_FACTOR + k], state[ETA + k], state[LAW_SLOPE + k]
        if constants.ndim == 2:
            linear = g * constants[ALIAS_P, k] - eta * constants[ALIAS_V, k]
            state[CLOSURE_ALIAS + k] = linear if constant_load else 0.0
            state[SPEED_ALIAS + k] = 0.5 * linear
        else:
            if len(form) == RATIONAL:
                b2, b3, b4 = terms_of_rational(
                    state[LAW_RISE + k], state[LAW_LINEAR + k], state[LAW_SQUARE + k]
                )
            else:
                # Exponent 0 has the logarithm for its power.
                b2, b3, b4 = terms_of_power(a if not constant_load else 0.0)
            state[CLOSURE_ALIAS + k] = alias_of_mean(
                b2, b3, b4, variable, constant_load, g, eta, constants
            )
            b2, b3, b4 = terms_of_power(0.5)
            state[SPEED_ALIAS + k] = 0.5 * alias_of_mean(
                b2, b3, b4, variable, True, g, eta, constants
            )
    if len(form) == CONSTANT_LOAD:
        for k in range(lanes):
            state[CLOSURE_CONSTANT + k] = constant_without_load(
                variable, state[GAS_FACTOR + k], state[ETA + k], constants, k
            )
