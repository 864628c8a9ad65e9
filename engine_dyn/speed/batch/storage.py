"""Results of a block of designs, from its state to where they are wanted."""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined, on_stack, wide_vectors
from engine_dyn.speed.batch.powers import exp_of, log_of
from engine_dyn.speed.batch.state import (
    CODE,
    DEFERRED,
    ENERGY_SCALE,
    ERROR,
    ITERATION_COUNT,
    LANES,
    LAW_SLOPE,
    MAX_SPEED,
    MEAN_SPEED,
    MIN_SPEED,
    SPEED,
)
from engine_dyn.speed.results import (
    DELTA,
    DELTA_ERROR,
    DELTA_MIDRANGE,
    ITERATIONS,
    LOAD_FACTOR,
    OMEGA_MAX,
    OMEGA_MEAN,
    OMEGA_MIN,
    SCALARS,
    Results,
)
from engine_dyn.status import CONVERGED
from engine_dyn.types import Floats, Integers

__all__ = ["CAREFUL", "SCALAR_ROWS", "note_deferred", "store_block"]

CAREFUL = 0.2
"""Fraction of the tolerance up to which the error of a design may be estimated: what the coarse
nodes miss is judged by the last term taken, which can be small by chance, and an error that is
asked for counts the difference SAFETY times. Half of the tolerance was tried: with other exponents
than 0 and 2, one design in seventy then had an error above 1e-7."""

SCALAR_ROWS = SCALARS * LANES


@inlined
def note_deferred(k: int, places: Integers, results: Results, state: Floats) -> bool:
    """Whether a lane's design is deferred; noted where that is asked for."""
    defers = state[CODE + k] == DEFERRED
    if results.deferred.size > 0:
        defers = defers or results.deferred[places[k]]
        results.deferred[places[k]] = defers
    return defers


@inlined
def store_block(
    count: int, loaded: bool, lanes: int, tolerance: float, state: Floats, places: Integers,
    results: Results,
) -> None:  # fmt: skip
    """Write the numbers of the first `count` lanes, but of those that are deferred.

    A speed that falls to nothing, or an error beyond what is allowed, defers a design too.
    """
    wide_vectors()
    rows = on_stack(SCALAR_ROWS)
    for k in range(lanes):
        code, error, nominal = state[CODE + k], state[ERROR + k], state[SPEED + k]
        scale = state[ENERGY_SCALE + k]
        nominal *= math.sqrt(scale)
        high, low = nominal * state[MAX_SPEED + k], nominal * state[MIN_SPEED + k]
        mean = nominal * state[MEAN_SPEED + k]
        exact = (low > 0.0) & (error <= CAREFUL * tolerance)
        code = DEFERRED if (code == CONVERGED) & (not exact) else code
        state[CODE + k] = code
        nothing = 0.0 if code == CONVERGED else math.nan
        rows[DELTA * LANES + k] = (high - low) / mean + nothing
        rows[DELTA_MIDRANGE * LANES + k] = 2.0 * (high - low) / (high + low) + nothing
        rows[OMEGA_MAX * LANES + k] = high + nothing
        rows[OMEGA_MIN * LANES + k] = low + nothing
        rows[OMEGA_MEAN * LANES + k] = mean + nothing
        # 1/mu = scale^(-alpha/2), and 1 where the scale is.
        factor = exp_of(-state[LAW_SLOPE + k] * log_of(scale - 1.0)) if loaded else 1.0
        rows[LOAD_FACTOR * LANES + k] = (factor if scale != 1.0 else 1.0) + nothing
        rows[DELTA_ERROR * LANES + k] = error + nothing
        rows[ITERATIONS * LANES + k] = state[ITERATION_COUNT + k] + nothing
    codes = state[CODE : CODE + LANES]
    for k in range(count):
        if codes[k] >= 0.0:
            results.status[places[k]] = int(codes[k])
    for result in range(SCALARS):
        row = results.wanted[result]
        if row < 0:
            continue
        found = rows[result * LANES : (result + 1) * LANES]
        written = results.scalars[row]
        for k in range(count):
            if codes[k] >= 0.0:
                written[places[k]] = found[k]
