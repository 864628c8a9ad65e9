"""What all designs of an engine have in common over the crank angle, at the points of its steps.

The cycle is divided where a cylinder fires or takes its command, and between these evenly. For each
step and cylinder, the table has the work of the gas from the step's beginning to its points, for
each row of the load axis; inertia is there as the sum of f v^2 of docs/method.md chapter 7. Works
are exact for the diagrams' splines but for Gauss's formula between their knots.

Load axis: fuel commands in percent of load. Its first row is the engine without combustion; between
it and the family's lowest load the command is extended so that the work over the cycle grows as it
does at the low end of the family.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.geometry.cylinders import Cylinders, Member
from engine_dyn.given_numbers import given_number
from engine_dyn.pressure.diagram import Diagram, values_at
from engine_dyn.pressure.family import Family, own_diagrams
from engine_dyn.pressure.motored import at_with_factor, motored
from engine_dyn.transient.lobatto import POINTS
from engine_dyn.types import Floats, Integers

STEPS = 36
"""Steps a cycle at least: 20 degrees of a four-stroke cycle, half of it near firings."""

ROW_STEP = 2.5
"""Percent of load between rows: the work between them is linear to 5e-4 (12 % with 50 percent)."""

BURNING = (0.35, 0.7)
"""Angles before and after a firing [rad] between which steps are half as long."""

CLOSED = math.pi
"""Angle before a firing [rad] back to which a cylinder that stops may be turned by its charge."""

GAUSS = np.polynomial.legendre.leggauss(4)


class Tables(NamedTuple):
    """Curves of an engine for the kernels; pressures times velocities, over r omega."""

    period: float  # Angle of a cycle [rad]
    nodes: Floats  # Ends of the steps [rad], from 0 to the period; shape (steps + 1,)
    # Over piston area and crank radius of the engine: works [Pa rad] of the pressure in each
    # cylinder from the beginning of each step to its points 1 to 4, shape (cylinders, rows,
    # 4 steps), and torques [Pa] at all five; the same of the crankcase pressure on all pistons.
    gas: Floats
    torques: Floats
    crankcase_gas: Floats
    crankcase_torques: Floats
    commands: Floats  # Command of each row [percent of load], ascending; shape (rows,)
    # Largest pressure [Pa] of each row, mean of the cylinders; shape (rows,).
    peaks: Floats
    # Sum over cylinders of f v^2 less its mean at the five points, and its slope over the angle;
    # shape (steps, 10).
    squares: Floats
    fires: Integers  # 1 where a cylinder fires at a node, else 0; shape (steps,)
    firings: int  # Sum of these
    # Node at which each cylinder takes its command; shape (cylinders,).
    takes: Integers
    taken: Integers  # 1 where a cylinder takes it at a node, else 0; shape (steps,)
    # Cycles by which that lies before the cycle of the firing; shape (cylinders,).
    early: Integers
    # First step to which the shaft may turn back from each; shape (steps,).
    back_to: Integers

    @property
    def cylinders(self) -> int:
        """Number of cylinders."""
        return len(self.gas)


@dataclass(frozen=True, eq=False)
class TransientEngine:
    """An engine, of which tables are made; keywords of `transient_engine`.

    Examples
    --------
    >>> import math
    >>> from engine_dyn.geometry.cylinders import even_cylinders
    >>> from engine_dyn.transient import transient_engine
    >>> from sweeps.scene.engine.engine_files import load_engine
    >>> engine = transient_engine(
    ...     load_engine("ntua").family, even_cylinders(4, 4.0 * math.pi), crank_ratio=0.257
    ... )
    >>> engine.cylinders.count
    4
    """

    family: Family
    cylinders: Cylinders
    crank_ratio: float
    offset_ratio: float
    crankcase_pressure: float
    command_angle: float
    row_step: float
    _made: dict[int, Tables] = field(default_factory=dict, init=False, repr=False)

    def tables(self, steps: int) -> Tables:
        """Tables with at least so many steps a cycle, made when they are first asked for."""
        if steps not in self._made:
            self._made[steps] = self._make(steps)
        return self._made[steps]

    def _make(self, steps: int) -> Tables:
        crank = self.crank_ratio, self.offset_ratio
        shared, makes, places = _shared(
            self.family, self.cylinders, self.command_angle, self.row_step, steps,
            crank if self.cylinders.articulated else (0.0, 0.0),
        )  # fmt: skip
        made = [_curves(make, crank) for make in makes]
        each = [[np.roll(one, turn, axis=-2) for one in made[make]] for make, turn in places]
        gas, torques, squares, slopes, travels, velocities = zip(*each, strict=True)
        rows = len(gas[0])
        works = np.sum(gas, axis=0)[:, :, 3].sum(axis=1)
        below = self.crankcase_pressure * np.sum(travels, axis=0)
        return Tables(
            gas=np.array(gas).reshape(len(gas), rows, -1),
            torques=np.array(torques).reshape(len(gas), rows, -1),
            crankcase_gas=(below[:, 1:] - below[:, :1]).ravel(),
            crankcase_torques=self.crankcase_pressure * np.sum(velocities, axis=0).ravel(),
            commands=self._commands(shared["loads"], works),
            squares=np.concatenate([np.sum(squares, axis=0), np.sum(slopes, axis=0)], axis=1),
            **{name: value for name, value in shared.items() if name in Tables._fields},
        )

    def _commands(self, loads: Floats, works: Floats) -> Floats:
        """Commands of all rows, from the loads of those that burn and the works of all."""
        given, below = self.family.loads, self.family.loads[0]
        if given.size > 1:
            gained = works[1] - works[0]
            slope = (works[1 + np.searchsorted(loads, given[1])] - works[1]) / (given[1] - given[0])
            below = gained / slope if slope > 0.0 < gained else 0.0
        return np.concatenate([[loads[0] - (below if below > 0.0 else 100.0)], loads])


class _Make(NamedTuple):
    """Cylinders that are alike, at the angles of one of them; pressures of each row."""

    member: Member
    angle: Floats  # Own angles at the points of steps [rad], shape (steps, 5)
    pressure: Floats  # [Pa] there, shape (rows, steps, 5)
    fine: Floats  # Own angles of Gauss's formula [rad]
    weighted: Floats  # Pressures there times weights [Pa rad], shape (rows, angles)
    first: Integers  # Place in these of each point of the steps but the last


def _curves(make: _Make, crank: tuple[float, float]) -> tuple[Floats, ...]:
    """Works, torques, f v^2 less its mean, its slope, travels and velocities at the points."""
    member, angle = make.member, make.angle
    fine = make.weighted * (member.area_factor * member.velocity(make.fine, *crank))
    parts = np.add.reduceat(fine, make.first, axis=1).reshape(len(fine), -1, 4)
    velocity = member.area_factor * member.velocity(angle, *crank)
    square, slope = member.square(angle, *crank)
    # Its harmonics fall by the crank ratio: equal samples find the mean to rounding.
    mean = np.mean(member.square(np.arange(64) * (2.0 * math.pi / 64), *crank)[0])
    travel = member.area_factor * member.position(angle, *crank)
    return parts.cumsum(axis=2), make.pressure * velocity, square - mean, slope, travel, velocity


@lru_cache(maxsize=4)
def _shared(
    family: Family, cylinders: Cylinders, command_angle: float, row_step: float, steps: int,
    crank: tuple[float, float],
) -> tuple[dict[str, Any], list[_Make], list[tuple[int, int]]]:  # fmt: skip
    """What engines of different crank ratios share; the crank matters for articulated rods alone.

    Tables by their names and the loads of rows that burn; makes of cylinders; for each cylinder its
    make and the steps by which it fires later.
    """
    period = family.period
    fire = [(-m.phase) % period for m in cylinders.members]
    take = [(angle + command_angle) % period for angle in fire]
    early = [math.floor((angle + command_angle) / period + 1e-9) for angle in fire]
    nodes = _divided(np.array([*fire, *take]), np.array(fire), period, steps)
    width = np.diff(nodes)
    fires, taken = np.zeros((2, width.size), dtype=np.int64)
    takes = np.array([_node(nodes, angle) for angle in take], dtype=np.int64)
    fired = [_node(nodes, angle) for angle in fire]
    taken[takes] = fires[fired] = 1
    pieces = [
        np.linspace(a, b, math.ceil((b - a) / row_step - 1e-9), endpoint=False)
        for a, b in pairwise(family.loads)
    ]
    loads = np.concatenate([*pieces, family.loads[-1:]])
    makes: list[_Make] = []
    begins: list[int] = []
    places, peaks = [], []
    for member, first in zip(cylinders.members, fired, strict=True):
        alike = (
            known for known, (make, begin) in enumerate(zip(makes, begins, strict=True))
            if make.member[1:] == member[1:]
            and np.allclose(width, np.roll(width, first - begin), rtol=0.0, atol=1e-9)
        )  # fmt: skip
        known = next(alike, len(makes))
        if known == len(makes):
            begins.append(first)
            diagrams = _diagrams(family, member, loads)
            makes.append(_make_of(member, diagrams, nodes, crank))
            peaks.append([diagram.peak for diagram in diagrams])
        places.append((known, first - begins[known]))
    shared = {
        "period": period, "nodes": nodes, "fires": fires, "takes": takes, "taken": taken,
        "firings": int(fires.sum()),
        "peaks": np.mean([peaks[known] for known, _ in places], axis=0), "loads": loads,
        "early": -np.array(early, dtype=np.int64),
        "back_to": _back_to(nodes, np.array(fire), fires, period),
    }  # fmt: skip
    return shared, makes, places


def _diagrams(family: Family, member: Member, loads: Floats) -> list[Diagram]:
    """Diagrams of the rows for one cylinder; a factor is that of docs/method.md (20)."""
    own, factor = own_diagrams(family, member.diagram), member.pressure_factor
    if isinstance(factor, tuple) or factor < 0.0:
        raise ValueError("firing patterns are not followed in time; give the missed firings")
    rows = [at_with_factor(own, float(load), factor) for load in loads]
    still = motored(own.at(float(loads[0])))
    if not np.array_equal(still.angle, rows[0].angle):
        values, slopes = still(rows[0].angle), still.derivative(rows[0].angle)
        still = Diagram(rows[0].angle, values, slopes, still.period)
    return [still, *rows]


def _make_of(
    member: Member, diagrams: list[Diagram], nodes: Floats, crank: tuple[float, float]
) -> _Make:
    """Pressures of a cylinder at the points of steps, and for Gauss's formula between knots."""
    period, phase = diagrams[0].period, member.phase_of(*crank)
    points = nodes[:-1, None] + np.diff(nodes)[:, None] * np.array(POINTS)

    def pressures(own: Floats) -> Floats:
        found = np.empty((len(diagrams), own.size))
        values_at(diagrams, np.asarray(member.diagram_angle(own, *crank)).ravel(), found)
        return found.reshape(len(diagrams), *own.shape)

    wanted = points[:, :4].ravel()
    edges = np.unique(np.concatenate([wanted, (diagrams[0].angle - phase) % period, [period]]))
    half = 0.5 * np.diff(edges)[:, None]
    fine = (edges[:-1, None] + half * (1.0 + GAUSS[0])).ravel() + phase
    weighted = pressures(fine) * (half * GAUSS[1]).ravel()
    first = GAUSS[0].size * np.searchsorted(edges, wanted)
    return _Make(member, points + phase, pressures(points + phase), fine, weighted, first)


def transient_engine(
    family: Family, cylinders: Cylinders, *, crank_ratio: float, offset_ratio: float = 0.0,
    crankcase_pressure: float = 101325.0, command_angle: float = -2.0 * math.pi,
    row_step: float = ROW_STEP,
) -> TransientEngine:  # fmt: skip
    """Engine whose designs are followed in time; they share its diagrams and crank ratio.

    Parameters
    ----------
    family : Family
        Diagrams over load, absolute pressures [Pa].
    cylinders : Cylinders
        Their firing angles and how they differ.
    crank_ratio : float
        Crank radius over rod length.
    offset_ratio : float
        Offset of the pin's line over crank radius.
    crankcase_pressure : float
        Absolute [Pa].
    command_angle : float
        Angle [rad], from its firing dead centre, at which a cylinder takes the fuel command that it
        keeps for its cycle: -2 pi for a mixture that is drawn in, some -0.26 (-15 degrees) for
        injection. At least one cycle before, at most 0.
    row_step : float
        Percent of load between the rows of the family.

    Raises
    ------
    ValueError
        For values outside their range; cylinders with a firing pattern; diagrams without a
        compression, from which no cycle without combustion can be made.

    Examples
    --------
    The first command is the engine without combustion: the governor can go down to it.

    >>> import math
    >>> from engine_dyn.geometry.cylinders import even_cylinders
    >>> from engine_dyn.transient import transient_engine
    >>> from sweeps.scene.engine.engine_files import load_engine
    >>> engine = transient_engine(
    ...     load_engine("ntua").family, even_cylinders(6, 4.0 * math.pi), crank_ratio=0.257,
    ...     command_angle=math.radians(-15.0), row_step=30.0,
    ... )
    >>> engine.tables(36).commands.round(1)
    array([-16.4,   0. ,  25. ,  50. ,  70. ,  90. ])
    """
    angle = given_number("command_angle", command_angle, finite=True)
    if not -family.period <= angle <= 0.0:
        raise ValueError(
            f"command_angle = {angle:g} rad: must lie from {-family.period:g} (a cycle before the "
            "firing) to 0"
        )
    step = given_number("row_step", row_step, finite=True)
    if not 0.1 <= step <= 100.0:
        raise ValueError(f"row_step = {step:g} percent: must lie from 0.1 to 100")
    cylinders.check_turning(crank_ratio, offset_ratio)
    if cylinders.cycles > 1:
        raise ValueError("firing patterns are not followed in time; give the missed firings")
    return TransientEngine(
        family, cylinders, given_number("crank_ratio", crank_ratio),
        given_number("offset_ratio", offset_ratio),
        given_number("crankcase_pressure", crankcase_pressure), angle, step,
    )  # fmt: skip


def _divided(events: Floats, fire: Floats, period: float, steps: int) -> Floats:
    """Nodes: events, and between them steps of at most a `steps`-th of the period.

    They are half as long while a cylinder burns: the pressure changes most there.
    """
    begin, end = fire - BURNING[0], fire + BURNING[1]
    marks = np.concatenate([[0.0], events, fire - CLOSED, begin, end]) / period % 1.0
    ends = np.append(marks[np.unique(np.round(marks, 12) % 1.0, return_index=True)[1]], 1.0)
    pieces = []
    for a, b in pairwise(ends):
        after = (0.5 * (a + b) * period - begin) % period
        burns = bool((after < BURNING[0] + BURNING[1]).any())
        count = max(1, math.ceil((b - a) * steps * (2 if burns else 1) - 1e-6))
        pieces.append(np.linspace(a, b, count, endpoint=False))
    return np.concatenate([*pieces, [1.0]]) * period


def _node(nodes: Floats, angle: float) -> int:
    """Node at an angle that is one of the events."""
    apart = np.abs(nodes - angle)
    return int(np.argmin(np.minimum(apart, nodes[-1] - apart)[:-1]))


def _back_to(nodes: Floats, fire: Floats, fires: Integers, period: float) -> Integers:
    """First step to which the shaft may turn back from each step.

    Not over a firing, and not beyond the half turn before the next one, where valves are open.
    """
    first = np.empty(len(nodes) - 1, dtype=np.int64)
    last = 0
    for n in range(len(first)):
        last = n if fires[n] else last
        ahead = float(((fire - nodes[n] - 1e-9) % period).min()) + 1e-9
        open_at = nodes[n] + ahead - CLOSED
        first[n] = max(last, int(np.searchsorted(nodes, open_at - 1e-9)))
    return np.minimum(first, np.arange(len(first)))
