"""The state of a block of designs: the one table of its rows.

A block is LANES designs, which are solved side by side as SIMD lanes. Its state is one flat array
of floats. Every row of the table below holds one number of each design: that of lane k of row ETA
is ``state[ETA + k]``. Most equations are those of docs/method.md, section 14.2.
"""

from __future__ import annotations

from typing import NamedTuple

from engine_dyn.compilation import formula
from engine_dyn.types import Floats, Integers

LANES = 32
"""Designs of a block, a power of two. Several vectors: what one waits for is done for another, and
a loop's start and end count less. 64 are 3 to 5 % faster still, with twice the memory."""

PAD = 2
"""Rows beside the first and the last coarse node: the period again."""

MOST_NODES = 1024
"""Most coarse nodes of a period, before they are rounded up."""

DEFERRED = -1.0
"""Code of a design that is deferred to the general solver. Other codes are the outcomes of
`engine_dyn.status`."""


class Row(NamedTuple):
    """One row of the state.

    Attributes
    ----------
    name : str
        Name of its constant below.
    unit : str
        SI unit.
    meaning : str
        One line.
    equation : int
        Number of its equation there; 0 where there is none.
    """

    name: str
    unit: str
    meaning: str
    equation: int


_ROWS: list[Row] = []


def _row(name: str, unit: str, meaning: str, equation: int = 0) -> int:
    """Add a row to the table and return the place of its first lane."""
    _ROWS.append(Row(name, unit, meaning, equation))
    return (len(_ROWS) - 1) * LANES


# Inputs, in the order of `engine_dyn.speed.fields`; a test compares both.
BORE = _row("BORE", "m", "diameter of the cylinder")
DOUBLE_RADIUS = _row("DOUBLE_RADIUS", "m", "two crank radii")
MASS = _row("MASS", "kg", "reciprocating mass of a cylinder")
SPEED = _row("SPEED", "rad/s", "nominal speed omega_n")
INERTIA = _row("INERTIA", "kg m2", "moment of inertia Theta")
EXPONENT = _row("EXPONENT", "1", "exponent alpha of the load")
OFFSET = _row("OFFSET", "N m", "load torque that does not depend on the speed")
MEAN_TORQUE = _row("MEAN_TORQUE", "N m", "mean torque over the cycle")
SYNCHRONOUS_SPEED = _row("SYNCHRONOUS_SPEED", "rad/s", "synchronous speed of the driving motor")
BREAKDOWN_SLIP = _row("BREAKDOWN_SLIP", "1", "slip of the driving motor at its largest torque")
LOAD_LINEAR = _row("LOAD_LINEAR", "N m s", "b of the load k (b omega + c omega^2)")
LOAD_SQUARE = _row("LOAD_SQUARE", "N m s2", "c of the load k (b omega + c omega^2)")

# Reduced parameters.
GAS_FACTOR = _row("GAS_FACTOR", "1/Pa", "g, from the work P of the gas to energy", 47)
ETA = _row("ETA", "1", "eta, from V to energy", 47)
KAPPA = _row("KAPPA", "1/rad", "kappa, strength of the load", 47)
LAW_SLOPE = _row("LAW_SLOPE", "1", "a = F'(1), alpha/2 of a power; 1 for exponent 0", 98)
BETA = _row("BETA", "1/rad", "beta = a kappa", 98)
CODE = _row("CODE", "1", "outcome so far; DEFERRED where it is left to the general solver")
BEYOND_SERIES = _row(
    "BEYOND_SERIES", "1", "1 where |u| is beyond SERIES_RANGE: by roots, not series", 105
)
CLOSURE_STEP = _row(
    "CLOSURE_STEP", "1", "last step of the closure: what u tau is still to be moved by", 115
)

KEPT_SIZE = len(_ROWS) * LANES
"""Numbers of the rows up to here, which curves over the crank angle need."""

LAW_BEND = _row("LAW_BEND", "1", "second derivative of F over the first, at q = 1", 115)
LAW_TWIST = _row("LAW_TWIST", "1", "third derivative of F over the first, at q = 1", 115)
SENSE = _row("SENSE", "1", "sign that the law needs of the mean torque; 0 where it has none")
LAW_RISE = _row("LAW_RISE", "1", "n of a law that is a rational function of the speed", 123)
LAW_LINEAR = _row("LAW_LINEAR", "1", "m of it", 123)
LAW_SQUARE = _row("LAW_SQUARE", "1", "l of it", 123)

MEAN_SQUARE = _row("MEAN_SQUARE", "1", "mean of X^2, X = g P - eta V", 98)
ENERGY_SCALE = _row(
    "ENERGY_SCALE", "1", "rho, scale of the energies on the way to a cycle time", 77
)
SCALE_MOVES = _row("SCALE_MOVES", "1", "1 where that scale is not yet found")

# Inputs that belong to tables and to curves from harmonics.
GAS_TORQUE_RANGE = _row("GAS_TORQUE_RANGE", "Pa", "range of the gas torque over the lever A r")
FIRST_DIAGRAM = _row("FIRST_DIAGRAM", "1", "place in the works of the diagram before the design's")
SECOND_DIAGRAM = _row("SECOND_DIAGRAM", "1", "the same of the diagram behind")

# Weights of the recurrence over the coarse nodes, x = beta H.
DECAY = _row("DECAY", "1", "d = exp(-x)", 99)
P_WEIGHT = _row("P_WEIGHT", "1/Pa", "weight of P at the node itself: g/(1 + x^2/12)", 99)
V_WEIGHT = _row("V_WEIGHT", "1", "weight of V at the node itself: eta/(1 + x^2/12)", 99)
P_WORK_WEIGHT = _row(
    "P_WORK_WEIGHT", "1/(Pa rad)", "weight of the integral of P: (1 - d)/H times that", 99
)
V_WORK_WEIGHT = _row("V_WORK_WEIGHT", "1/rad", "weight of the integral of V: the same", 99)
PERIOD_FACTOR = _row(
    "PERIOD_FACTOR", "1", "1/(1 - d^N), from the end of a period that starts at 0 to its start", 113
)
REMAINDER_WEIGHT = _row("REMAINDER_WEIGHT", "1", "weight of r at the node itself", 100)
RUNNING_WEIGHT = _row("RUNNING_WEIGHT", "1", "weight of the running sum of r", 100)
EULER_NEAR = _row("EULER_NEAR", "1", "weight of r at the neighbours, kappa H 82/1440", 101)
EULER_FAR = _row("EULER_FAR", "1", "weight of r at the next nodes, kappa H 11/1440", 101)

# What the coarse nodes see wrongly, and the constant of the closure.
CLOSURE_ALIAS = _row(
    "CLOSURE_ALIAS",
    "1",
    "mean of q^a/a, or of log q, over the fine less that over the coarse nodes",
    114,
)
SPEED_ALIAS = _row("SPEED_ALIAS", "1", "the same of sqrt(q)", 114)
CLOSURE_CONSTANT = _row("CLOSURE_CONSTANT", "1", "constant of the closure in u tau", 115)
SLOPE_DOUBT = _row("SLOPE_DOUBT", "1", "what is not known of the slope of the closure's step", 115)

# The linear part of the solution.
PERIOD_END = _row(
    "PERIOD_END", "1", "end of the recurrence over a period from 0, driven by the work", 113
)
RUNNING = _row("RUNNING", "1", "the recurrence's value while it runs over the nodes", 99)
SHIFT = _row(
    "SHIFT",
    "1",
    "what is taken off u tau at all nodes: less the constant, and the mean of the corrections",
    100,
)
NODE_MAX = _row("NODE_MAX", "1", "largest u of the coarse nodes")
NODE_MIN = _row("NODE_MIN", "1", "smallest u of the coarse nodes")
MEAN_SPEED = _row("MEAN_SPEED", "1", "mean speed over nominal; before, the sum of sqrt(q) - 1")

# Exponent 0, which needs no recurrence.
Q_PRODUCT = _row("Q_PRODUCT", "1", "product of q over the coarse nodes", 116)
INVERSE_SUM = _row("INVERSE_SUM", "1", "sum of 1/(q tau) over the coarse nodes", 116)
SPEED_SUM = _row("SPEED_SUM", "1", "sum of 1/(sqrt(q) tau) over the coarse nodes", 116)

# The iteration of the nonlinear remainder r.
REMAINDER_START = _row(
    "REMAINDER_START", "1", "start of the recurrence that r, or its change, drives", 113
)
REMAINDER_END = _row("REMAINDER_END", "1", "end of that recurrence over a period from 0", 113)
REMAINDER_SUM = _row("REMAINDER_SUM", "1", "sum of r over the coarse nodes")
PREDICTED_SUM = _row(
    "PREDICTED_SUM", "1", "half of what that changes by in the next pass, to first order"
)
CHANGE = _row("CHANGE", "1", "largest change of r, of this pass or the next one's to first order")
LAST_CHANGE = _row("LAST_CHANGE", "1", "the same of the pass before")
BY_SERIES = _row("BY_SERIES", "1", "1 where this pass takes r by series")
BY_ROOTS = _row("BY_ROOTS", "1", "1 where this pass takes r by roots and powers")
SHIFT_CHANGE = _row("SHIFT_CHANGE", "1", "what SHIFT changes by in the next pass")
FROZEN = _row("FROZEN", "1", "1 where u does not change any more")
ITERATION_COUNT = _row("ITERATION_COUNT", "1", "number of passes")
CYCLE_TIME = _row(
    "CYCLE_TIME", "1", "mean of 1/sqrt(q): time of the cycle over the nominal one", 59
)

# The search for the extremes between the nodes.
LOAD_RISE = _row(
    "LOAD_RISE",
    "1",
    "most that the load's part of u rises above its chord between coarse nodes",
    117,
)
LARGEST_INVERSE = _row("LARGEST_INVERSE", "1", "largest 1/tau; 1 with constant inertia", 117)
MAX_NODE = _row("MAX_NODE", "1", "first coarse node beside which the maximum can be")
MIN_NODE = _row("MIN_NODE", "1", "the same of the minimum")
MAX_LAST_CHUNK = _row("MAX_LAST_CHUNK", "1", "last chunk of coarse nodes where the maximum can be")
MIN_LAST_CHUNK = _row("MIN_LAST_CHUNK", "1", "the same of the minimum")
MAX_COUNT = _row("MAX_COUNT", "1", "number of coarse nodes beside which the maximum can be")
MIN_COUNT = _row("MIN_COUNT", "1", "the same of the minimum")
MAX_RIPPLE = _row("MAX_RIPPLE", "1", "what ripple of the torque may hide of the maximum, in u")
MIN_RIPPLE = _row("MIN_RIPPLE", "1", "the same of the minimum")
MAX_TILT = _row("MAX_TILT", "1", "largest tilt of u where the maximum can be", 55)
MIN_TILT = _row("MIN_TILT", "1", "the same of the minimum", 55)
EXTREME = _row("EXTREME", "1", "extreme of u that has been found so far", 91)
EXTREME_ERROR = _row("EXTREME_ERROR", "1", "what it may miss", 93)

# Results.
MAX_SPEED = _row("MAX_SPEED", "1", "largest speed over nominal")
MIN_SPEED = _row("MIN_SPEED", "1", "smallest speed over nominal")
ERROR = _row("ERROR", "1", "estimate of the relative error of delta", 93)

ROWS = tuple(_ROWS)
"""All rows, in the order of their places."""

STATE_SIZE = len(ROWS) * LANES
"""Numbers of the state of a block."""


class Block(NamedTuple):
    """Memory of a block of designs; one a thread is used again for all of its blocks.

    Rows of LANES numbers one after the other. Those of nodes have PAD more before the first and
    behind the last one; without a form that is iterated, `remainders` and `changes` are empty.

    Attributes
    ----------
    state : ndarray
        The rows of `ROWS`.
    deviations : ndarray
        u = q - 1 at each coarse node.
    remainders : ndarray
        r at each coarse node, docs/method.md (98).
    changes : ndarray
        What the remainders change by from one pass to the next.
    maxima, minima : ndarray
        Largest and smallest u of each chunk of coarse nodes; later bounds of u beside them.
    chosen : ndarray of int
        The coarse node beside which each lane is searched.
    """

    state: Floats
    deviations: Floats
    remainders: Floats
    changes: Floats
    maxima: Floats
    minima: Floats
    chosen: Integers


@formula
def with_state(state: Floats, memory: Block) -> Block:
    """Memory of a block with a state of zeros on the stack of the kernel that calls this.

    The compiler then knows that nothing else lies there: 3 to 10 % faster than a state in `memory`.
    """
    for i in range(STATE_SIZE):
        state[i] = 0.0
    return Block(
        state, memory.deviations, memory.remainders, memory.changes, memory.maxima, memory.minima,
        memory.chosen,
    )  # fmt: skip
