"""The results of the speed solution: the one table of their names, units, meanings and places."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.types import Booleans, Floats, Integers


class Result(NamedTuple):
    """One result of the speed solution: what a node of `engine_dyn.quantities` has of it."""

    name: str
    symbol: str
    unit: str
    long_name: str
    source: str


RESULTS = (
    Result(
        "delta", r"\delta", "1", "coefficient of speed fluctuation (cyclic irregularity)",
        "Kakaitsas eq. 3.6",
    ),
    Result(
        "delta_midrange", r"\delta_{mid}", "1",
        "coefficient of speed fluctuation (cyclic irregularity) over the mid-range speed",
        "Kakaitsas eq. 3.7, Asgari 19",
    ),
    Result("omega_max", r"\omega_{max}", "rad s-1", "largest crank speed", "Kakaitsas eq. 3.6"),
    Result("omega_min", r"\omega_{min}", "rad s-1", "smallest crank speed", "Kakaitsas eq. 3.6"),
    Result(
        "omega_mean", r"\omega_m", "rad s-1", "mean crank speed over crank angle",
        "Kakaitsas eq. 3.6",
    ),
    Result(
        "load_factor", "", "1", "load coefficient over its value at nominal speed",
        "closure cycle_time",
    ),
    Result(
        "delta_error", r"\Delta\delta/\delta", "1",
        "estimated relative error of the coefficient of speed fluctuation",
        "against a solution with more nodes, or that of omega_min where it is more; thesis: "
        "against the periodic solution",
    ),
    Result("iterations", "i", "1", "number of cycles computed, or of iterations", "this project"),
)  # fmt: skip
"""Scalar results of the periodic solution, in the order in which `store` has their values."""

SCALAR_NAMES = tuple(result.name for result in RESULTS)

CURVES = (
    Result("omega", r"\omega", "rad s-1", "crank speed over the cycle", "Kakaitsas eq. 3.1"),
    Result(
        "angular_acceleration", r"\epsilon", "rad s-2", "angular acceleration of the crank",
        "Kakaitsas eq. 4.1",
    ),
)  # fmt: skip
"""Results over the crank angle."""

CURVE_NAMES = tuple(result.name for result in CURVES)

TORQUE_RESULTS = (
    Result(
        "torque_max", "M_{max}", "N m", "largest torque at nominal speed", "Kakaitsas section 5.4"
    ),
    Result(
        "torque_min", "M_{min}", "N m", "smallest torque at nominal speed", "Kakaitsas section 5.4"
    ),
    Result(
        "energy_swing", r"\Delta W", "J",
        "energy swing, range of the work of the torque about its mean, minus any load over angle",
        "Asgari method 2",
    ),
)  # fmt: skip
"""Results of the torque at nominal speed, in the order of their places."""

TORQUE_NAMES = tuple(result.name for result in TORQUE_RESULTS)

COMPARED = ("delta", "omega_min")  # Results whose difference between two solutions gives the error

IDLE = 1e-9
"""If mean torque and constant load differ by no more than this fraction of the torque's range, the
engine idles: docs/method.md (67)."""

ROUNDING = 5e-16
"""Error by rounding of a speed over the nominal speed, docs/solver.md (101) and
docs/method.md (105). The smaller delta is, the larger is its relative error by this."""

CANCELLED = 13.0
"""Factor on eta in the rounding of speeds, docs/solver.md (101) and docs/method.md (105). V
is the sum of up to 24 squares that nearly cancel, each exact to some 5e-16, which makes 26 eta
times as much in q."""


class Results(NamedTuple):
    """Arrays of results, one entry a design."""

    # For each row of `RESULTS`, its row in `scalars`, or -1 where it is not wanted.
    wanted: Integers
    scalars: Floats  # ; shape (results, designs)
    status: npt.NDArray[np.int8]  # Codes of `engine_dyn.status`; shape (designs,)
    # The second axis is empty where they are not wanted; shape (designs, angles)
    omega: Floats
    acceleration: Floats
    # Marks the designs that the batch solver left to the general solver: the solution with more
    # nodes, for the error, then comes from the same solver. Empty where no error is wanted.
    deferred: Booleans
