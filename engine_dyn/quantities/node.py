"""Nodes and dimensions, from which the graph of parameters and quantities is made.

At the end stands the arithmetic that nodes share where plain operators would not do.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from inspect import CO_VARARGS, CO_VARKEYWORDS
from typing import Any

import numpy as np

from engine_dyn.parameters import PARAMETERS

EXTREMES = {
    "largest": "the largest value",
    "smallest": "the smallest value",
    "above": "the largest value, at least 0",
    "below": "the size of the smallest value, 0 where none is below 0",
    "size": "the largest size, of a vector with components in a right angle",
    "range": "the difference of the largest and the smallest value",
    "half_range": "half of the range",
    "over_mean": "the range over the mean",
    "over_middle": "the range over the mean of the largest and the smallest value",
    "of_cycles": "the range of each cycle over the mean of the curve",
    "reversal": "the smaller over the larger one of the sizes to either side of 0",
}
"""Kinds of extremes of curves, with their words (see `Node.extreme_of`)."""


@dataclass(frozen=True)
class Dimension:
    """A dimension that quantities have beside the axes of a scene."""

    # Name, symbol, unit and meaning, as of nodes; the node that holds the values has the same name.
    name: str
    symbol: str
    unit: str
    long_name: str
    si: float = 1.0  # SI value of the unit in files
    whole: bool = False  # Whether the dimension's values are whole numbers
    public: bool = True  # Whether quantities of archives have the dimension


@dataclass(frozen=True)
class Node:
    """A parameter, a stage or a quantity.

    Raises
    ------
    ValueError
        For a kind of extreme that is none of `EXTREMES`.
    """

    # Name in scenes and files; symbol of the literature (mathtext without dollars); unit of files
    # as UDUNITS reads it; one line of meaning; author and equation.
    name: str
    symbol: str
    unit: str
    long_name: str
    source: str = ""
    # Names of the nodes that `make` takes; unless given, the names of its arguments.
    needs: tuple[str, ...] = ()
    # Dimensions of the node that its needs lack: see `engine_dyn.quantities.graph.DIMENSIONS`.
    adds: tuple[str, ...] = ()
    # Dimensions of the needs that the node lacks: `make` sums over them. The needs have them as
    # axes, in the order of `engine_dyn.quantities.graph.DIMENSIONS`.
    removes: tuple[str, ...] = ()
    # Function that computes the node from its needs, in SI units, broadcasting. Its arguments are
    # the needs, by name and in any order. That of a stage also takes `wanted` (the `gives` that
    # are used), `threads` and `progress`, and returns a dict.
    make: Callable[..., Any] | None = None
    si: float = 1.0  # SI value of the unit in files
    # "parameter", "constant" (handed over whole, no axes), "value" (few numbers, broadcast),
    # "curve" (over crank angle), "stage" (a kernel that gives several results at once).
    kind: str = "value"
    gives: tuple[str, ...] = ()  # Names of a stage's results
    # Words of `engine_dyn.quantities.graph`: the variant holds for scenes that have all of them;
    # empty: for any scene.
    when: str = ""
    # Quantity with the outcome of the stage's designs, which archives hold beside its results;
    # empty: the stage cannot fail.
    outcome: str = ""
    # Range of a parameter in file units: `low_included`, `high_included` say whether its ends are
    # allowed, `whole` that only whole numbers are, `even` that only even ones are.
    low: float = -math.inf
    high: float = math.inf
    low_included: bool = False
    high_included: bool = False
    whole: bool = False
    even: bool = False
    # Value of a parameter in file units where neither scene nor engine gives it. A value outside
    # the range means that there is none (`passes` = 0: until the cycle closes).
    unless_given: float | None = None
    public: bool = True  # Whether scenes may ask for the node
    # Names that scenes may write for values of a parameter, in file units.
    named: tuple[tuple[str, float], ...] = ()
    # Meanings of the numbers 0, 1, 2 ..., for a quantity that is a verdict; one word each.
    meanings: tuple[str, ...] = ()
    throws: bool = False  # Whether the node needs the places of the engine's throws
    # Bytes of one value and of the arrays that `make` holds meanwhile, for the size of blocks of
    # designs; for a stage, bytes of a design beyond inputs and results.
    width: int = 8
    # Whether `make` also takes `threads`, the largest number of threads; None for one a processor.
    threaded: bool = False
    on_card: bool = False  # Whether `make` also takes `device`, one of `fields.DEVICES`
    # Kinds of numbers of the scene's shaft, such as `disc_inertia`, that the node also needs;
    # `make` takes the existing ones by name, `disc_inertia_1` and so on.
    of_shaft: tuple[str, ...] = ()
    # Quantities that archives also hold where this node is computed, because warnings refer to
    # their results.
    beside: tuple[str, ...] = ()
    # Curve whose extreme the node is, and its kind, one of `EXTREMES`. An extreme is found between
    # the curve's points, and does not depend on their distance.
    extreme_of: tuple[str, str] | None = None

    def __post_init__(self) -> None:
        if not self.needs and self.make is not None:
            object.__setattr__(self, "needs", _arguments(self.make))
        if self.extreme_of is not None and self.extreme_of[1] not in EXTREMES:
            raise ValueError(f"node {self.name!r}: no extreme is called {self.extreme_of[1]!r}")


def parameter(
    name: str, symbol: str, unit: str, long_name: str, source: str, **more: Any
) -> Node:  # fmt: skip
    """Return a key of scenes and engine files."""
    return Node(name, symbol, unit, long_name, source, kind="parameter", **more)


def given(name: str, **more: Any) -> Node:
    """Return the key of scenes and engine files that is one of `engine_dyn.parameters`."""
    one = PARAMETERS[name]
    return parameter(
        name, one.symbol, one.unit, one.meaning, one.source, si=one.si, low=one.low, high=one.high,
        low_included=one.at_least is not None, high_included=one.at_most is not None,
        whole=one.whole, even=one.even, named=one.named, unless_given=one.unless_given, **more,
    )  # fmt: skip


def hidden(
    name: str, unit: str, long_name: str, make: Callable[..., Any], needs: tuple[str, ...] = (),
    **more: Any,
) -> Node:  # fmt: skip
    """Return a node that scenes cannot ask for, made on the way to others."""
    return Node(name, "", unit, long_name, needs=needs, make=make, public=False, **more)


def formula(function: Callable[..., Any], *needs: str) -> dict[str, Any]:
    """Return the keywords of a node whose `function` takes its needs in this order."""
    return {"needs": needs, "make": lambda **given: function(*(given[need] for need in needs))}


def variants(node: Node, makes: Mapping[str, Callable[..., Any]]) -> tuple[Node, ...]:
    """Return a node for each of some `when`, with what makes it in scenes that have its words."""
    return tuple(replace(node, when=when, make=make) for when, make in makes.items())


def _arguments(make: Any, *, optional: bool = False) -> tuple[str, ...]:
    """Names of the nodes that a function takes: its arguments, less those that are no nodes."""
    code = getattr(make, "__code__", None)
    if code is None:
        return ()
    names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
    last = code.co_argcount - len(make.__defaults__ or ())
    given = {*names[last : code.co_argcount], *(make.__kwdefaults__ or ())}
    without = {"wanted", "threads", "progress"} | (set() if optional else given)
    return tuple(name for name in names if name not in without)


def check_needs(nodes: Mapping[str, Sequence[Node]]) -> None:
    """Check that what nodes need is there, and that what they are made from takes it by name.

    Raises
    ------
    ValueError
        In one line, for a name in `needs` that no node has, and for arguments of `make` that are
        not the needs.
    """
    known = {*nodes, *(result for same in nodes.values() for node in same for result in node.gives)}
    for node in (node for same in nodes.values() for node in same):
        for need in node.needs:
            if need not in known:
                near = difflib.get_close_matches(need, known, 1)
                hint = f"; did you mean {near[0]!r}?" if near else ""
                raise ValueError(f"node {node.name!r} needs {need!r}, which no node has{hint}")
        make: Any = node.make
        code = getattr(make, "__code__", None)
        if code is None or code.co_flags & (CO_VARARGS | CO_VARKEYWORDS):
            continue
        lacking = {*_arguments(make)} - {*node.needs}
        beyond = {*node.needs} - {*_arguments(make, optional=True)}
        if lacking or beyond:
            what = f"takes {sorted(lacking)}, not among its needs" if lacking else (
                f"does not take {sorted(beyond)}, which are among its needs"
            )  # fmt: skip
            raise ValueError(f"node {node.name!r}: make {what}")


def balance_of(plus: Any, minus: Any) -> Any:
    """Difference of two torques or pressures; what is only inexact is 0 (the engine idles)."""
    plus, minus = np.asarray(plus), np.asarray(minus)
    difference = plus - minus
    # With a centred mechanism, the piston velocities in the mean gas torque, and so the torque, are
    # exact to this fraction of `minus`, docs/solver.md (58).
    return np.where(np.abs(difference) <= 1e-10 * np.abs(minus), 0.0, difference)


def quotient(numerator: Any, denominator: Any) -> Any:
    """Quotient; NaN where the denominator is 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(denominator == 0.0, np.nan, np.divide(numerator, denominator))


def power(base: Any, exponent: Any) -> Any:
    """Power whose bits do not depend on how designs are cut into blocks.

    Along a loop with one exponent, NumPy squares where that is 2, takes the root where it is 0.5,
    and calls `pow` elsewhere: the last digit would depend on the shape of the arrays.
    """
    result = base**exponent
    # NumPy's loops differ for these two exponents; 0 and 1 have the same bits with each loop.
    for special, function in ((2.0, np.square), (0.5, np.sqrt)):
        if np.any(exponent == special):
            result = np.where(exponent == special, function(base), result)
    return result


def product(**factors: Any) -> Any:
    """Product of all needs of a node."""
    return math.prod(factors.values())
