"""What any true answer satisfies: checks of every design, without solving it.

docs/stability/rules.csv says what each rule is.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.stress.shapes import MARGIN, Bounds
from engine_dyn.status import (
    CONVERGED,
    INVALID_INPUT,
    NO_STEADY_STATE,
    NOT_CONVERGED,
    STALLED,
    TOLERANCE_NOT_MET,
)
from engine_dyn.types import Booleans
from oracle.solution import IDLE

CYCLE = 4.0 * math.pi
ROUNDING = 1e-8
"""Of ratios of speeds in relations that hold exactly."""

VANISHING = 1e-4
"""Relative band about the inertia that just vanishes, which the tables do not decide."""


def check_answers(found: dict[str, Any], tolerance: float = 1e-6) -> dict[str, Booleans]:
    """Masks of designs that break a rule which needs their results alone, whatever the engine."""
    status = found["status"]
    numbers = np.isin(status, (CONVERGED, TOLERANCE_NOT_MET))
    broken: dict[str, Booleans] = {}
    broken["outcome"] = ~np.isin(
        status,
        (CONVERGED, STALLED, NO_STEADY_STATE, NOT_CONVERGED, INVALID_INPUT, TOLERANCE_NOT_MET),
    )
    results = [array for name, array in found.items() if name != "status"]
    broken["numbers"] = np.any([np.isfinite(array) != numbers for array in results], axis=0)
    good = numbers & ~broken["numbers"]

    high, low, mean = found["omega_max"], found["omega_min"], found["omega_mean"]
    tiny = 1.0 + 1e-12
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        broken["order"] = good & ~((low > 0.0) & (low <= mean * tiny) & (mean <= high * tiny))
        delta = (high - low) / mean
        middle = 2.0 * (high - low) / (high + low)
        # Of nearly equal speeds the difference has few digits.
        digits = 1e-12 * delta + 8e-16
        broken["delta"] = good & ~(
            (np.abs(found["delta"] - delta) <= digits)
            & (np.abs(found["delta_midrange"] - middle) <= digits)
        )
        missed = status == TOLERANCE_NOT_MET
        error = found.get("delta_error", np.where(missed, math.inf, 0.0))  # unless it was asked for
        broken["tolerance"] = good & ((error > tolerance) != missed)
    return broken


def check(
    columns: dict[str, npt.NDArray[Any]], closure: str, bounds: Bounds, found: dict[str, Any],
    tolerance: float = 1e-6,
) -> dict[str, Booleans]:  # fmt: skip
    """Masks of designs that break a rule; all arrays of one length."""
    status = found["status"]
    broken = check_answers(found, tolerance)
    numbers = np.isin(status, (CONVERGED, TOLERANCE_NOT_MET))
    good = numbers & ~broken["numbers"]
    high, low, mean = found["omega_max"], found["omega_min"], found["omega_mean"]
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        delta = (high - low) / mean
        nominal, exponent = columns["speed"], columns["exponent"]
        # Squares of many cylinders cancel, each good to some 2e-16.
        eta = columns["mass"] * (0.5 * columns["stroke"]) ** 2 / columns["inertia"]
        slack = ROUNDING + 1e-6 * delta + 2e-16 * columns["cylinders"] * eta
        between = (low <= nominal * (1.0 + slack)) & (high >= nominal * (1.0 - slack))
        if closure == "cycle_time":
            side = mean >= nominal * (1.0 - slack)
        else:
            side = (mean - nominal) * np.sign(1.0 - exponent) >= -slack * nominal
            side |= (exponent == 1.0) & (np.abs(mean - nominal) <= slack * nominal)
        broken["closure"] = good & ~(between & side)

        factor = found["load_factor"]
        surplus = columns["mean_torque"] - columns["offset"]
        idle = np.abs(surplus) <= IDLE * bounds.torque_most
        if closure == "cycle_time":
            least, most = (high / nominal) ** -exponent, (low / nominal) ** -exponent
            wide = 1.0 + 1e-6 + 1e-6 * exponent * delta
            fits = (factor >= least / wide) & (factor <= most * wide)
        else:
            fits = np.abs(factor - 1.0) <= tolerance
        broken["load"] = good & ~(fits | idle)

    # Kinetic energy over an arc: gas work less what the load takes more or less than its mean,
    # which is at most the surplus over a firing period.
    inertia = columns["inertia"]
    taken = np.abs(surplus) * CYCLE / columns["cylinders"]
    variable = columns["variable"]
    least_theta = np.where(variable, 1.0 + eta * bounds.least_square, 1.0)
    most_theta = np.where(variable, 1.0 + eta * bounds.most_square, 1.0)
    masses = np.where(variable, 0.0, 0.5 * bounds.mass_swing * nominal**2)
    most_swing = (1.0 + MARGIN) * (bounds.gas_swing + masses)
    least_swing = np.abs(bounds.gas_swing - masses) - MARGIN * (bounds.gas_swing + masses)
    with np.errstate(invalid="ignore", over="ignore"):
        widest = 0.5 * inertia * (most_theta * high**2 - least_theta * low**2)
        narrowest = 0.5 * inertia * (least_theta * high**2 - most_theta * low**2)
        # What the tables of Theta(phi) miss, most where many cylinders leave it nearly constant.
        missed = MARGIN * (most_theta - least_theta) + 1e-13 * eta * columns["cylinders"]
        digits = (1e-14 + missed) * inertia * high**2
        broken["energy"] = good & ~(
            (widest >= (1.0 - 1e-5) * (least_swing - taken) - digits)
            & (narrowest <= (1.0 + 1e-5) * (most_swing + taken) + digits)
        )

    # Outcomes.
    limit = 1.0 + eta * bounds.least_square
    band = VANISHING * eta * np.abs(bounds.least_square)
    vanishes = variable & (limit < -band)
    stays = ~variable | (limit > band)
    broken["inertia"] = ((status == INVALID_INPUT) & stays) | ((status != INVALID_INPUT) & vanishes)
    below = surplus < -IDLE * bounds.torque_most
    steady = surplus > -IDLE * bounds.torque_least
    broken["idle"] = ((status == NO_STEADY_STATE) & steady) | (
        (status != NO_STEADY_STATE) & below & stays
    )
    # Somewhere the speed is the asked one; nowhere is it less by more than swing and load take.
    energy = 0.5 * inertia * nominal**2
    left = least_theta - (most_swing + taken) / energy
    broken["no false stall"] = (
        (status == STALLED) & (left > 1e-4 * most_theta) & stays & (surplus >= 0.0)
    )
    return broken
