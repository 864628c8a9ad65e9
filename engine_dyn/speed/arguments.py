"""One part of a sweep, as solvers take it.

`Problem` is the part in Python; `Choice` and `Curves` are what kernels take of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.pressure.family import Family
from engine_dyn.speed.product import Product
from engine_dyn.speed.results import Results
from engine_dyn.speed.tables.pressure_grid import Grid, make_grid
from engine_dyn.types import Floats, Integers

__all__ = ["ANY_EXPONENT", "Choice", "Curves", "Problem", "kind_of_law"]

ANY_EXPONENT, MOTOR, LINEAR_SQUARE, OTHER_LAW = 3, 4, 5, 6
"""Kinds of law (see `Choice`): exponents other than 0, 1 and 2, and laws that are no power."""


def kind_of_law(law: str) -> int:
    """Kind of a law that is no power of the speed, see `Choice`."""
    return {"motor": MOTOR, "linear_square": LINEAR_SQUARE}.get(law, OTHER_LAW)


class Choice(NamedTuple):
    """What all designs of a part have in common, as kernels take it.

    Attributes
    ----------
    method : int
        Code of `engine_dyn.speed.methods`.
    kind : int
        Class of the law over speed: 0, 1 or 2 for these exponents, `ANY_EXPONENT` for any other,
        else as of `kind_of_law`.
    variable : bool
        Whether the inertia varies over the crank angle.
    closure : int
        POWER_MEAN or CYCLE_TIME.
    tolerance : float
        Relative error of delta aimed at.
    iterated : float
        Error that iterations may leave, relative to the range of q.
    """

    method: int
    kind: int
    variable: bool
    closure: int
    tolerance: float
    iterated: float


class Curves(NamedTuple):
    """Where curves are wanted, as kernels take it.

    For each angle: the node before it, the fraction of the interval from there, and its place among
    the samples of the thesis's method.
    """

    node: Integers
    fraction: Floats
    sample: Floats


class AngleLoad(NamedTuple):
    """A load over angle that is the same for all designs but for its scale.

    Attributes
    ----------
    table : ndarray
        `TorqueOverAngle.table`.
    gear_ratio, phase : float
        The load's angle is the crank's times `gear_ratio`, plus `phase` [rad].
    """

    table: Floats
    gear_ratio: float
    phase: float


@dataclass(frozen=True)
class Problem:
    """One part of a sweep, whose designs one kernel call can treat alike.

    Attributes
    ----------
    size : int
        Number of designs.
    family : Family
        Indicator diagrams.
    cylinders : Cylinders
        The engine's cylinders.
    choice : Choice
        What all designs have in common.
    product : Product
        Inputs of the designs.
    rows, row_of : ndarray of int
        Rows of the family that the tables need, and the place among them of each row of the family.
    nodes : int
        Nodes of a table, which covers one period of the torque.
    repeats : int
        Periods of the torque in a cycle.
    width : float
        Angle between two nodes [rad].
    angles : ndarray
        Angles [rad] at which curves are wanted; empty where none are.
    results : Results
        Where the results go.
    load : AngleLoad or None
        Load over angle that is common to all designs, for the batch solver.
    threads : int
        Threads at most.
    last : bool
        Whether no more nodes are tried where these miss the tolerance.
    """

    size: int
    family: Family
    cylinders: Cylinders
    choice: Choice
    product: Product
    rows: Integers
    row_of: Integers
    nodes: int
    repeats: int
    width: float
    angles: Floats
    results: Results
    load: AngleLoad | None
    threads: int
    last: bool

    @cached_property
    def grid(self) -> Grid:
        """Pressure at the nodes; made when it is first needed."""
        members = self.cylinders.representatives_of(self.repeats)
        return make_grid(self.family, self.rows, self.nodes * self.repeats, members)

    @property
    def points(self) -> int:
        """Nodes of a cycle, of all representative cylinders."""
        members = self.cylinders.representatives_of(self.repeats)
        return self.nodes * self.repeats * len(members)

    @property
    def designs_of_table(self) -> int:
        """Number of designs that have a table in common."""
        return int(np.prod(self.product.shape[self.product.other_axes], dtype=np.int64))
