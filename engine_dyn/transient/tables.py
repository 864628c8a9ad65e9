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
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from engine_dyn.geometry.cylinders import Cylinders, Member
from engine_dyn.given_numbers import given_number
from engine_dyn.pressure.diagram import Diagram, values_at
from engine_dyn.pressure.family import Family, own_diagrams
from engine_dyn.pressure.motored import motored
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

GAUSS = np.polynomial.legendre.leggauss(6)


class Tables(NamedTuple):
    """Curves of an engine for the kernels; pressures times velocities, over r omega."""

    period: float  # Angle of a cycle [rad]
    nodes: Floats  # Ends of the steps [rad], from 0 to the period; shape (steps + 1,)
    # Over piston area and crank radius of the engine: works [Pa rad] from the beginning of each
    # step to its points 1 to 4, shape (cylinders, rows, 4 steps), and torques [Pa] at all five.
    gas: Floats
    torques: Floats
    commands: Floats  # Command of each row [percent of load], ascending; shape (rows,)
    # Largest pressure [Pa] of each row, mean of the cylinders; shape (rows,).
    peaks: Floats
    # Sum over cylinders of f v^2 less its mean at the five points, and its slope over the angle;
    # shape (steps, 10).
    squares: Floats
    fires: Integers  # 1 where a cylinder fires at a node, else 0; shape (steps,)
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
        period = self.family.period
        members, crank = self.cylinders.members, (self.crank_ratio, self.offset_ratio)
        fire = [(-m.phase) % period for m in members]
        take = [(angle + self.command_angle) % period for angle in fire]
        early = [math.floor((angle + self.command_angle) / period + 1e-9) for angle in fire]
        nodes = _divided(np.array([*fire, *take]), np.array(fire), period, steps)
        count = len(nodes) - 1
        fires = np.zeros(count, dtype=np.int64)
        taken = np.zeros_like(fires)
        taken[[_node(nodes, angle) for angle in take]] = 1
        fires[[_node(nodes, angle) for angle in fire]] = 1
        loads, commands = self._load_axis()
        points = (nodes[:-1, None] + np.diff(nodes)[:, None] * np.array(POINTS)).ravel()
        gas, torques, peaks, squares = [], [], [], np.zeros((2, points.size))
        for member in members:
            diagrams = self._diagrams(member, loads)
            own = points + member.phase_of(*crank)
            torques.append(self._torques(member, diagrams, own))
            gas.append(self._works(member, diagrams, nodes).reshape(len(diagrams), -1))
            squares += member.square(own, *crank)
            peaks.append([diagram.peak for diagram in diagrams])
        even = np.arange(720) * (period / 720)
        mean = sum(float(np.mean(member.square(even, *crank)[0])) for member in members)
        squares[0] -= mean
        return Tables(
            period, nodes, np.array(gas), np.array(torques), commands, np.mean(peaks, axis=0),
            np.concatenate([one.reshape(count, 5) for one in squares], axis=1), fires,
            np.array([_node(nodes, angle) for angle in take], dtype=np.int64), taken,
            -np.array(early, dtype=np.int64), _back_to(nodes, np.array(fire), fires, period),
        )  # fmt: skip

    def _load_axis(self) -> tuple[Floats, Floats]:
        """Loads of the rows that burn, and commands of all rows."""
        given = self.family.loads
        pieces = [
            np.linspace(a, b, math.ceil((b - a) / self.row_step - 1e-9), endpoint=False)
            for a, b in pairwise(given)
        ]
        loads = np.concatenate([*pieces, given[-1:]])
        first = self.cylinders.members[0]
        period = self.family.period
        ends = [motored(self.family.at(given[0])), self.family.at(given[0])]
        ends += [self.family.at(given[1])] if given.size > 1 else []
        work = self._works(first, ends, np.array([0.0, period]))[:, 0, 3]
        if given.size > 1:
            slope = (work[2] - work[1]) / (given[1] - given[0])
            below = (work[1] - work[0]) / slope if slope > 0.0 < work[1] - work[0] else 0.0
        else:
            below = given[0]
        below = below if below > 0.0 else 100.0
        return loads, np.concatenate([[loads[0] - below], loads])

    def _diagrams(self, member: Member, loads: Floats) -> list[Diagram]:
        """Diagrams of the rows for one cylinder; a factor is that of docs/method.md (20)."""
        family = own_diagrams(self.family, member.diagram)
        rows = [family.at(float(load)) for load in loads]
        still = motored(family.at(float(loads[0])))
        factor = member.pressure_factor
        if isinstance(factor, tuple) or factor < 0.0:
            raise ValueError("firing patterns are not followed in time; give the missed firings")
        if not np.array_equal(still.angle, rows[0].angle):
            values, slopes = still(rows[0].angle), still.derivative(rows[0].angle)
            still = Diagram(rows[0].angle, values, slopes, still.period)
        if factor == 1.0:
            return [still, *rows]
        return [still, *(
            Diagram(
                one.angle, still.pressure + factor * (one.pressure - still.pressure),
                still.slope + factor * (one.slope - still.slope), one.period,
            )
            for one in rows
        )]  # fmt: skip

    def _torques(self, member: Member, diagrams: list[Diagram], own: Floats) -> Floats:
        """Torque [Pa] of each diagram at the cylinder's own angles, shape (rows, angles)."""
        crank = self.crank_ratio, self.offset_ratio
        pressure = np.empty((len(diagrams), own.size))
        values_at(diagrams, np.asarray(member.diagram_angle(own, *crank)), pressure)
        pressure -= self.crankcase_pressure
        pressure *= member.velocity(own, *crank) * member.area_factor
        return pressure

    def _works(self, member: Member, diagrams: list[Diagram], nodes: Floats) -> Floats:
        """Work [Pa rad] of diagrams from each node to the points behind it, (rows, steps, 4)."""
        period, crank = self.family.period, (self.crank_ratio, self.offset_ratio)
        phase = member.phase_of(*crank)
        width = np.diff(nodes)[:, None]
        wanted = np.append((nodes[:-1, None] + width * np.array(POINTS[:4])).ravel(), period)
        knots = (diagrams[0].angle - phase) % period
        edges = np.unique(np.concatenate([wanted, knots]))
        edges = edges[(edges >= 0.0) & (edges <= period)]
        half = 0.5 * np.diff(edges)[:, None]
        angle = (edges[:-1, None] + half * (1.0 + GAUSS[0])).ravel() + phase
        torque = self._torques(member, diagrams, angle)
        pieces = (torque.reshape(len(diagrams), -1, GAUSS[0].size) @ GAUSS[1]) * half[:, 0]
        sums = np.concatenate([np.zeros((len(diagrams), 1)), np.cumsum(pieces, axis=1)], axis=1)
        at = sums[:, np.searchsorted(edges, wanted)]
        begin, end = at[:, :-1].reshape(len(diagrams), -1, 4), at[:, 4::4]
        inner = begin[:, :, 1:] - begin[:, :, :1]
        return np.concatenate([inner, (end - begin[:, :, 0])[:, :, None]], axis=2)


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
    marks = np.concatenate([events, [0.0], fire - CLOSED, begin, end])
    ends = np.append(np.unique(np.round(marks / period % 1.0, 12) % 1.0), 1.0)
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
