"""Outcomes of a design: the codes that kernels return, and their names in archives.

docs/method.md section 13.3 says when each of them is given.
"""

from __future__ import annotations

CONVERGED = 0
STALLED = 1
NO_STEADY_STATE = 2
NOT_CONVERGED = 3
INVALID_INPUT = 4
TOLERANCE_NOT_MET = 5
PASSES_DONE = 6
TORQUE_NOT_REACHED = 7
FOLLOWED = 8
STOPPED = 9
NOT_STARTED = 10
RUNAWAY = 11

MEANINGS = (
    "converged",
    "stalled",
    "no_steady_state",
    "not_converged",
    "invalid_input",
    "tolerance_not_met",
    "passes_done",
    "torque_not_reached",
    "followed",
    "stopped",
    "not_started",
    "runaway",
)

OF_SPEED = MEANINGS[:TORQUE_NOT_REACHED]
"""Outcomes of designs whose load is given; those that hold a torque have the last one too."""

OF_STEADY = MEANINGS[:FOLLOWED]
"""All outcomes of designs whose speed repeats; those that follow are of speeds that do not."""

WITH_NUMBERS = (CONVERGED, TOLERANCE_NOT_MET, PASSES_DONE, FOLLOWED)
"""Outcomes whose designs have all numbers. Those of others are NaN; speeds that are followed in
time have those up to their end."""


def has_numbers(code: int) -> bool:
    """Whether a design with this outcome has all its numbers."""
    return code in WITH_NUMBERS
