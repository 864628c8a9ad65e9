"""The pressure grid: diagrams evaluated at the nodes and quadrature points of work tables."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.geometry.cylinders import EQUAL, Member
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.pressure.diagram import values_at
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.memory import remembered
from engine_dyn.pressure.motored import row_with_factor
from engine_dyn.types import Floats, Integers

__all__ = [
    "END_WEIGHT",
    "GAUSS_POINTS",
    "HALVES_POINTS",
    "MIDDLE_WEIGHT",
    "Grid",
    "angles_of_cycle",
    "make_grid",
    "steps_of",
]

_THIRD = math.sqrt(0.15)
GAUSS_POINTS = (0.5 - _THIRD, 0.5, 0.5 + _THIRD)
END_WEIGHT, MIDDLE_WEIGHT = 5.0 / 18.0, 8.0 / 18.0
"""Three-point Gauss-Legendre quadrature on [0, 1], docs/method.md (49)."""

HALVES_POINTS = 6
"""Quadrature points of both halves of an interval. Arrays have the first of all intervals of a
cylinder's cycle, then the second ones, and so on, so that loops over intervals become vectors."""


class Grid(NamedTuple):
    """Pressure of some diagrams at the nodes, the middles and the quadrature points of a cycle.

    Arrays are (diagram, point). Sine and cosine are those of the same points. The points of the
    representative cylinders follow each other, each at its own angles and pressure; `masses` and
    `radii` have the factors on the mass and the crank radius of each cylinder.
    """

    at_node: Floats
    slope_at_node: Floats
    at_middle: Floats
    at_quadrature: Floats
    node_sine: Floats
    node_cosine: Floats
    middle_sine: Floats
    middle_cosine: Floats
    quadrature_sine: Floats
    quadrature_cosine: Floats
    masses: Floats
    radii: Floats


@inlined
def steps_of(grid: Grid) -> int:
    """Nodes of a cycle."""
    return grid.node_sine.size // grid.masses.size


def make_grid(
    family: Family, rows: Integers, steps: int, members: tuple[Member, ...] = (EQUAL,)
) -> Grid:
    """Evaluate the diagrams `rows` of a family on a grid of `steps` intervals, from phi = 0 on.

    `members` are the representative cylinders. The pressures of the last few grids of a family are
    kept: several numbers of cylinders have the same, and so have the blocks of a sweep.
    """
    turns = [_turns(family.period, steps, member.phase) for member in members]
    pressures = remembered(
        family, ("grid", rows.tobytes(), steps, members),
        lambda: _joined([_pressures(family, rows, steps, member) for member in members], axis=1),
    )  # fmt: skip
    masses = np.array([member.mass_factor for member in members])
    radii = np.array([member.radius_factor for member in members])
    return Grid(*(*pressures, *_joined(turns, axis=0), masses, radii))


def _pressures(family: Family, rows: Integers, steps: int, member: Member) -> tuple[Floats, ...]:
    """Pressure at the nodes, its slope there, pressure at middles and quadrature points.

    All of one cylinder, (row, point).
    """
    node, middle, quadrature = angles_of_cycle(family.period, steps, member.phase)
    factor = member.pressure_factor
    if isinstance(family, CycleTable):
        at_nodes = family.sampled(rows, node, factor, slopes=True)
        others = (family.sampled(rows, angle, factor)[0] for angle in (middle, quadrature))
        return *at_nodes, *others
    diagrams = [row_with_factor(family, row, factor) for row in rows.tolist()]
    asked = ((node, False), (node, True), (middle, False), (quadrature, False))
    found = tuple(np.empty((rows.size, angle.size)) for angle, _ in asked)
    for out, (angle, slopes) in zip(found, asked, strict=True):
        values_at(diagrams, angle, out, slopes)
    return found


def _joined(of_members: list[tuple[Floats, ...]], axis: int) -> tuple[Floats, ...]:
    """Arrays of all members: those of one kind follow each other."""
    if len(of_members) == 1:
        return of_members[0]
    return tuple(np.concatenate(one, axis=axis) for one in zip(*of_members, strict=True))


def angles_of_cycle(period: float, steps: int, phase: float) -> tuple[Floats, Floats, Floats]:
    """Nodes, middles and quadrature points of a cycle, in the angle of a cylinder of this phase."""
    width = period / steps
    node: Floats = np.arange(steps, dtype=np.float64) * width
    offsets = np.array([half + 0.5 * point for half in (0.0, 0.5) for point in GAUSS_POINTS])
    quadrature: Floats = (node + offsets[:, None] * width).reshape(-1)
    middle: Floats = np.asarray(node + 0.5 * width)
    return node + phase, middle + phase, quadrature + phase


@lru_cache(maxsize=16)
def _turns(period: float, steps: int, phase: float) -> tuple[Floats, ...]:
    """Sine and cosine of the nodes, the middles and the quadrature points."""
    return tuple(
        f(angle) for angle in angles_of_cycle(period, steps, phase) for f in (np.sin, np.cos)
    )
