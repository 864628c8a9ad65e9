"""The inputs, methods and results of the solvers: one table of each.

Unit and meaning of inputs are those of their nodes: see `engine_dyn.parameters` and the subjects'
files of `engine_dyn.quantities`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.loads.laws import INPUTS, Field
from engine_dyn.types import Booleans, Floats, Integers

FRICTION_NAMES = (
    "boundary_friction", "mixed_friction", "hydrodynamic_friction", "skirt_friction",
    "ring_pressure",
)  # fmt: skip
"""Inputs of the friction over the stroke: levels of its parts [Pa], pressure of the rings."""

_OF_TABLES = (
    Field("crank_ratio"), Field("row"), Field("scale", quantity="pressure_scale"),
    Field("crankcase_pressure"), Field("offset_ratio", 0.0),
    *(Field(name, 0.0) for name in FRICTION_NAMES),
)  # fmt: skip
_OF_SPEED_ALONE = (
    Field("inertia"), Field("exponent", quantity="load_exponent"),
    Field("offset", quantity="load_offset"), Field("mean_torque", quantity="torque_mean"),
    Field("start_speed", 0.0),  # 0: the nominal speed
    Field("passes", 0.0),  # 0: until the cycle closes
    Field("start_angle", -math.pi),
)  # fmt: skip

FIELDS = tuple(
    field._replace(quantity=field.quantity or field.name)
    for field in (
        *_OF_TABLES, Field("bore"), Field("double_radius"),
        Field("mass", quantity="reciprocating_mass"), Field("speed"), Field("friction_torque"),
        Field("load_phase", 0.0), Field("load_scale", 1.0, "load_table_factor"),
        Field("torque_factor", 1.0), *INPUTS, *_OF_SPEED_ALONE,
    )
)  # fmt: skip
"""All inputs of the solvers."""

TABLE_NAMES = tuple(field.name for field in _OF_TABLES)
TABLE_QUANTITIES = tuple(field.quantity for field in FIELDS[: len(_OF_TABLES)])
"""Quantities on which the work tables depend, here and in the graph of quantities."""

DEFAULTS = {field.name: field.default for field in FIELDS if field.default is not None}
"""Default values of the inputs that have one."""

OF_SPEED_ALONE = tuple(field.name for field in _OF_SPEED_ALONE)
"""Inputs that do not affect the torque at nominal speed."""

NAMES_OF_QUANTITIES = {field.quantity: field.name for field in FIELDS}
"""Input of the solvers for each quantity of the graph that they take."""


class Method(NamedTuple):
    """One method."""

    # Name of the method in scenes and in `periodic_speed`, and its meaning in one line.
    name: str
    meaning: str
    # Whether the method repeats cycles from a start. It can then not solve for the load
    # coefficient, and its error does not decrease with more nodes.
    steps: bool = False
    # Laws of load and driver over speed that the method can solve (see `engine_dyn.loads.laws`);
    # empty: all laws.
    laws: tuple[str, ...] = ()
    over_angle: bool = True  # Whether the method can solve a load over an angle
    # Exponents of the load that the method can solve; empty: all. Others get status 4.
    exponents: tuple[float, ...] = ()
    in_batch: bool = False  # Whether the batch solver is tried first

    def can_solve(self, law: str, over_angle: bool) -> bool:
        """Whether it can solve this law over speed, with a load over an angle beside it or not."""
        return (not self.laws or law in self.laws) and (self.over_angle or not over_angle)


METHODS = (
    Method("auto", "the cheapest method that meets the tolerance", in_batch=True),
    Method(
        "thesis", "explicit Euler steps of one degree, as Kakaitsas (2015) prints them",
        steps=True, laws=("power_law",), over_angle=False,
    ),
    Method("newton", "Newton's method on the whole periodic curve"),
    Method(
        "closed", "closed form of the exponents 0 and 2", laws=("power_law",),
        exponents=(0.0, 2.0),
    ),
)  # fmt: skip
"""All methods, in the order of their codes in kernels."""

AUTO, THESIS, NEWTON, CLOSED = range(len(METHODS))

METHOD_NAMES = tuple(method.name for method in METHODS)

STEPPING = tuple(method.name for method in METHODS if method.steps)
"""Methods that repeat cycles from a start."""

INERTIA_MODELS = ("constant", "variable")  # Models of the inertia, in the order of their codes

DEVICES = ("cpu", "cuda")
"""Devices that can solve designs: the processor, or a GPU as far as `engine_dyn.card` can."""

CLOSURES = ("power_mean", "cycle_time")  # Meanings of the nominal speed, in order of their codes

POWER_MEAN, CYCLE_TIME = range(len(CLOSURES))


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
"""Scalar results of the periodic solution, in the order in which `store` takes them."""

SCALAR_NAMES = tuple(result.name for result in RESULTS)

CURVES = (
    Result("omega", r"\omega", "rad s-1", "crank speed over the cycle", "Kakaitsas eq. 3.1"),
    Result(
        "angular_acceleration", r"\epsilon", "rad s-2", "angular acceleration of the crank",
        "Kakaitsas eq. 4.1",
    ),
)  # fmt: skip
"""Results of the periodic solution over the crank angle."""

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
"""Difference of mean torque and constant load, over the torque's range, up to which the engine
idles: docs/method.md (67)."""

ROUNDING = 5e-16
"""Rounding error of a speed over the nominal speed, docs/solver.md (101) and docs/method.md
(105). The smaller delta is, the larger is its relative error by rounding."""

CANCELLED = 13.0
"""Factor on eta in the rounding error of speeds, docs/solver.md (101) and docs/method.md (105).
V is the sum of up to 24 squares that nearly cancel, each exact to some 5e-16, which makes 26 eta
times as much in q."""


class Results(NamedTuple):
    """Arrays of results, one entry a design."""

    # Row in `scalars` for each row of `RESULTS`, or -1 where the result is not wanted.
    wanted: Integers
    scalars: Floats  # Values of scalar results; shape (results, designs)
    status: npt.NDArray[np.int8]  # Codes of `engine_dyn.status`; shape (designs,)
    # Curves of speed and acceleration, without angles where not wanted; shape (designs, angles)
    omega: Floats
    acceleration: Floats
    # Designs that the batch solver left to the general solver: their second solution, for the
    # error, comes from the same solver. Empty where no error is wanted.
    deferred: Booleans
