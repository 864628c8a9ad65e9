"""Answers of the kernels against those of the independent solver of oracle/spline.py."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine_dyn.status import (
    CONVERGED,
    INVALID_INPUT,
    NO_STEADY_STATE,
    NOT_CONVERGED,
    STALLED,
    TOLERANCE_NOT_MET,
)
from engine_dyn.types import Floats
from oracle import spline

QUANTITIES = ("delta", "omega_max", "omega_min", "omega_mean")
TOLERANCE = 1e-6

BORDER = 1e-3
"""Smallest (omega/omega_n)^2 below which running and stalled are told apart by a hair: the kernels
call a solution below 1e-6 a stall."""

CLEARLY = 0.01
"""Relative difference that is one, however doubtful the last digits of the solver."""

VERDICTS = ("agrees", "honest", "gave up", "border", "rounding", "unknown", "off", "outcome")
"""docs/stability/verdicts.csv says what they mean."""


def differing(found: dict[str, Any], other: dict[str, Any]) -> dict[str, Floats]:
    """Relative differences of the four quantities, and of the three speeds the largest."""
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        differs = {name: np.abs(found[name] / other[name] - 1.0) for name in QUANTITIES}
    differs["delta"] = np.where(
        (other["delta"] == 0.0) & (found["delta"] == 0.0), 0.0, differs["delta"]
    )
    return differs | {"speeds": np.max([differs[name] for name in QUANTITIES[1:]], axis=0)}


def judge(
    found: dict[str, Any], exact: spline.Solutions, nominal: Any
) -> tuple[Any, dict[str, Floats]]:
    """Verdict of each design, and relative differences of the quantities."""
    status, true = found["status"], exact.status
    differs = differing(found, vars(exact))
    with np.errstate(invalid="ignore"):
        worst = np.maximum(differs["delta"], differs["speeds"])
        small = (np.abs(found["delta"] - exact.delta) <= 1e-13) & (differs["speeds"] <= 1e-13)
        # Who claims to have seen a design run by a hair must have seen the hair.
        near = np.abs(exact.lowest) < BORDER
        near &= np.isnan(found["omega_min"]) | (found["omega_min"] < 0.1 * nominal)
        clearly = (worst > CLEARLY) & (status == CONVERGED)
        doubtful = (true == spline.CONVERGED) & (exact.doubt > 0.1 * TOLERANCE)
        either = np.maximum(differs["delta"], differs["omega_min"])
        honest = either <= np.maximum(found["delta_error"], TOLERANCE)
    runs, numbers = true == spline.CONVERGED, np.isin(status, (CONVERGED, TOLERANCE_NOT_MET))
    decided = true != spline.UNDECIDED

    def alike(code: int, other: int) -> Any:
        """Where one of both has an outcome, whether both have it."""
        return np.where((status == code) == (true == other), "agrees", "outcome")

    kind = np.select(
        [
            (status == NO_STEADY_STATE) | (true == spline.NO_STEADY_STATE),
            (status == INVALID_INPUT) | (true == spline.INVALID_INPUT),
            decided & (status == NOT_CONVERGED),
            (status == STALLED) & (true == spline.STALLED),
            (status == CONVERGED) & runs & (worst <= TOLERANCE),
            (status == TOLERANCE_NOT_MET) & runs & honest,
            numbers & runs & small,
            near & decided,
            (~decided | doubtful) & ~clearly,
            numbers & runs,
        ],
        [
            alike(NO_STEADY_STATE, spline.NO_STEADY_STATE),
            alike(INVALID_INPUT, spline.INVALID_INPUT),
            "gave up", "agrees", "agrees", "honest", "rounding", "border", "unknown", "off",
        ],
        "outcome",
    )  # fmt: skip
    return kind, differs
