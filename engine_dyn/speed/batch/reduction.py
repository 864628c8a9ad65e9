"""From the inputs of a block of designs to the numbers of its equation."""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined, wide_vectors
from engine_dyn.speed.batch.closures import alias_of_mean, constant_without_load
from engine_dyn.speed.batch.forms import CONSTANT_LOAD, VARIABLE_INERTIA, Form, Inertia
from engine_dyn.speed.batch.levels import ALIAS_P, ALIAS_V, ALIASED, LARGEST_STEP, PP, PV, VV
from engine_dyn.speed.batch.powers import loss_of
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
    HALF_EXPONENT,
    INERTIA,
    ITERATION_COUNT,
    KAPPA,
    LAST_CHANGE,
    MASS,
    MEAN_SQUARE,
    MEAN_TORQUE,
    MEAN_WEIGHT,
    OFFSET,
    P_WEIGHT,
    P_WORK_WEIGHT,
    PERIOD_FACTOR,
    REMAINDER_WEIGHT,
    RUNNING,
    RUNNING_WEIGHT,
    SHIFT,
    SLOPE_DOUBT,
    SPEED,
    SPEED_ALIAS,
    V_WEIGHT,
    V_WORK_WEIGHT,
)
from engine_dyn.speed.batch.values import constant
from engine_dyn.types import Floats

__all__ = ["LARGEST_ALIAS", "LARGEST_HALF", "NO_LOAD", "SMALLEST_HALF", "reduce_inputs"]

NO_LOAD = 1e-30
"""Smallest kappa: its solution is that without load to rounding, and nothing divides by zero."""

LARGEST_ALIAS = 1e-3
"""Largest share of a table that the coarse level may see wrongly; of usual ones it is 1e-4."""

SMALLEST_HALF, LARGEST_HALF = 1e-4, 8.0
"""Range of a: below it the closure -mean(r)/a loses its digits, above it `exp_of` does not hold."""


@inlined
def reduce_inputs(
    form: Form, inertia: Inertia, step: float, nodes: int, swing_shape: float,
    least_square: float, idle: float, no_steady_state: float, invalid: float, constants: Floats,
    lanes: int, state: Floats,
) -> None:  # fmt: skip
    """Reduced parameters, weights of the recurrence and a first level, from the inputs in `s`."""
    wide_vectors()
    variable = len(inertia) == VARIABLE_INERTIA
    free = len(form) == CONSTANT_LOAD
    for k in range(lanes):
        radius = 0.5 * state[DOUBLE_RADIUS + k]
        lever = 0.25 * math.pi * state[BORE + k] * state[BORE + k] * radius
        throw = state[MASS + k] * radius * radius
        square = state[SPEED + k] * state[SPEED + k]
        # Divisions take as long as ten multiplications: one for two.
        inverse = 1.0 / (state[INERTIA + k] * square * state[ENERGY_SCALE + k])
        per_energy = 2.0 * inverse
        surplus = state[MEAN_TORQUE + k] - state[OFFSET + k]
        swing = idle * (lever * state[GAS_TORQUE_RANGE + k] + throw * square * swing_shape)
        g = lever * per_energy
        eta = throw * (inverse * square)
        if variable:  # the inertia has no energy scale
            eta *= state[ENERGY_SCALE + k]
        half = 0.5 * state[EXPONENT + k] if not free else 0.0
        a = half if not free else 1.0
        kappa = surplus * per_energy if not free else 0.0
        per_half = 1.0 / a
        kappa = kappa if kappa > NO_LOAD else NO_LOAD
        code = 0.0
        code = DEFERRED if surplus <= swing else code
        code = no_steady_state if surplus < -swing else code
        x = a * kappa * step
        # Not `x > ...`: what is no number is deferred as well.
        code = code if x <= LARGEST_STEP or code != 0.0 else DEFERRED
        code = invalid if variable and 1.0 + eta * least_square <= 0.0 else code
        code = code if SMALLEST_HALF <= a <= LARGEST_HALF or code != 0.0 else DEFERRED
        code = code if constant(constants, ALIASED, k) <= LARGEST_ALIAS or code != 0.0 else DEFERRED
        kappa = kappa if x <= LARGEST_STEP else LARGEST_STEP / step * per_half
        x = x if x <= LARGEST_STEP else LARGEST_STEP
        loss = loss_of(x)
        # 1 - d^N by doubling of expm1
        whole = -loss_of(x * nodes / 64.0)
        for _ in range(6):
            whole *= 2.0 + whole
        square_of_step = 1.0 + x * x / 12.0
        inverse = 1.0 / (square_of_step * whole)
        bent = inverse * whole
        decay = 1.0 - loss
        rho = 0.5 * loss * per_half
        state[CODE + k] = code
        state[GAS_FACTOR + k] = g
        state[ETA + k] = eta
        state[KAPPA + k] = kappa
        state[HALF_EXPONENT + k] = a
        state[BETA + k] = a * kappa
        state[DECAY + k] = decay
        state[P_WORK_WEIGHT + k] = bent * g * loss / step
        state[V_WORK_WEIGHT + k] = bent * eta * loss / step
        state[P_WEIGHT + k] = bent * g
        state[V_WEIGHT + k] = bent * eta
        state[REMAINDER_WEIGHT + k] = rho + kappa * step * x / 6.0
        state[RUNNING_WEIGHT + k] = rho * (1.0 + decay)
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
        state[SLOPE_DOUBT + k] = 4.0 * (1.0 + half * half) * loose
        cross, last = (half, half + 1.0) if variable else (half - 1.0, half - 1.0)
        state[CLOSURE_CONSTANT + k] = cross * pv - 0.5 * ((half - 1.0) * pp + last * vv)
        state[MEAN_WEIGHT + k] = kappa * step * x / 6.0
        state[FROZEN + k] = 0.0
        state[ITERATION_COUNT + k] = 1.0
        state[CLOSURE_STEP + k] = 0.0
        state[LAST_CHANGE + k] = 1e300
    for k in range(lanes):
        g, eta, a = state[GAS_FACTOR + k], state[ETA + k], state[HALF_EXPONENT + k]
        if constants.ndim == 2:
            linear = g * constants[ALIAS_P, k] - eta * constants[ALIAS_V, k]
            state[CLOSURE_ALIAS + k] = linear if free else 0.0
            state[SPEED_ALIAS + k] = 0.5 * linear
        else:
            # Exponent 0 has the logarithm for its power, and a = 1.
            state[CLOSURE_ALIAS + k] = alias_of_mean(a, free, variable, free, g, eta, constants) / a
            state[SPEED_ALIAS + k] = alias_of_mean(0.5, False, variable, True, g, eta, constants)
    if len(form) == CONSTANT_LOAD:
        for k in range(lanes):
            state[CLOSURE_CONSTANT + k] = constant_without_load(
                variable, state[GAS_FACTOR + k], state[ETA + k], constants, k
            )
