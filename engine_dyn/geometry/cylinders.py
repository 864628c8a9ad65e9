"""The cylinders of an engine, as phase, gas pressure and mass tell them apart, and as they repeat.

Torque is a sum over cylinders. Where their arrangement repeats n times in the cycle, it has the
period Phi/n and is the sum over Z/n of them, the *representatives*, each folded at that period.
Evenly firing equal cylinders have one representative, cylinder 1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.arrangement import (
    FOUR_STROKE,
    TURN,
    Arrangement,
    customary_order,
    firing_phases,
    symmetry,
)
from engine_dyn.geometry.articulated_rod import ArticulatedRod
from engine_dyn.geometry.firing_sequence import (
    SEALED,
    PressureFactor,
    checked_pattern,
    cycles_of_pattern,
    shortest,
)
from engine_dyn.geometry.layouts import in_line
from engine_dyn.given_numbers import given_array
from engine_dyn.types import Floats


class Member(NamedTuple):
    """One cylinder.

    Notes
    -----
    `angle` is the cylinder's own, from its own top dead centre; crank ratio and offset over the
    crank radius are the engine's. What is returned is over the engine's crank radius and speed.
    """

    phase: float  # Angle to add to the engine's crank angle for the cylinder's own [rad]
    # Factor f in p = p_motored + f (p - p_motored) [1]: 1 as in the diagram, 0 without combustion,
    # `SEALED` where the valves stay shut. Where cycles differ, a factor for each, the first for the
    # cycle around the cylinder's own angle 0.
    pressure_factor: PressureFactor
    mass_factor: float  # Reciprocating mass of the cylinder over the engine's [1]
    # Crank radius, and stroke, of the cylinder over the engine's; rods are equally long [1].
    radius_factor: float = 1.0
    # Factor on the engine's offset [1]: -1 where the cylinder's bank lies to the other side of the
    # crank's axis than cylinder 1 (VR engines).
    side: float = 1.0
    # Articulated rod, where the cylinder has one; its crank radius is then the engine's.
    rod: ArticulatedRod | None = None
    bore_factor: float = 1.0  # Bore of the cylinder over the engine's [1]
    # Number of the cylinder whose own diagrams it has, see `family.own_diagrams`; 0: the engine's.
    diagram: int = 0

    @property
    def area_factor(self) -> float:
        """Piston area of the cylinder over the engine's [1]."""
        return self.bore_factor**2

    @property
    def cycles(self) -> int:
        """Cycles after which its pressure repeats."""
        return len(self.pressure_factor) if isinstance(self.pressure_factor, tuple) else 1

    def own(self, crank_ratio: Any, offset: Any) -> OwnCrank:
        """Crank ratio and offset over the cylinder's own crank radius, from those of the engine.

        Rods and offset are the engine's. Each cylinder's angle counts from its own dead centre,
        which the offset shifts by arcsin(e/(l + r)): throws of another radius stand where their
        dead centres fall at the firing angles.
        """
        radius = self.radius_factor
        return OwnCrank(crank_ratio * radius, self.side * offset / radius)

    def phase_of(self, crank_ratio: Any, offset: Any) -> Any:
        """Angle to add to the engine's to get the own one [rad].

        That of an articulated rod differs from `phase` by some degrees: cylinders on one pin have
        their dead centres where the rods put them.
        """
        return self.phase if self.rod is None else self.phase - self.rod.top(crank_ratio, offset)

    def diagram_angle(self, angle: Any, crank_ratio: Any, offset: Any) -> Any:
        """Angle at which the cylinder takes the pressure from its diagram [rad].

        The own one; with an articulated rod that of the master at the same part of the stroke.
        """
        return angle if self.rod is None else self.rod.diagram_angle(angle, crank_ratio, offset)

    def position(self, angle: Any, crank_ratio: Any, offset: Any) -> Any:
        """Piston travel from top dead centre."""
        if self.rod is not None:
            return self.rod.position(angle, crank_ratio, offset)
        return self.radius_factor * slider_crank.position(angle, *self.own(crank_ratio, offset))

    def velocity(self, angle: Any, crank_ratio: Any, offset: Any) -> Any:
        """Piston velocity."""
        if self.rod is not None:
            return self.rod.velocity(angle, crank_ratio, offset)
        return self.radius_factor * slider_crank.velocity(angle, *self.own(crank_ratio, offset))

    def acceleration(self, angle: Any, crank_ratio: Any, offset: Any) -> Any:
        """Piston acceleration at constant speed."""
        if self.rod is not None:
            return self.rod.acceleration(angle, crank_ratio, offset)
        return self.radius_factor * slider_crank.acceleration(angle, *self.own(crank_ratio, offset))

    def square(self, angle: Any, crank_ratio: Any, offset: Any) -> tuple[Any, Any]:
        """Kinetic energy over m r^2 omega^2/2, and its slope: f v^2 and 2 f v b.

        With an articulated rod, with that of the mass at its knuckle pin beyond the crank pin's.
        """
        v = self.velocity(angle, crank_ratio, offset)
        b = self.acceleration(angle, crank_ratio, offset)
        square, slope = self.mass_factor * v * v, 2.0 * self.mass_factor * v * b
        if self.rod is None:
            return square, slope
        knuckle, turn = self.rod.knuckle_square(angle, crank_ratio, offset)
        return square + self.rod.knuckle_mass * knuckle, slope + self.rod.knuckle_mass * turn

    def bottom(self, crank_ratio: Any, offset: Any) -> Any:
        """Own angle at bottom dead centre [rad]."""
        if self.rod is not None:
            return self.rod.bottom(crank_ratio, offset)
        return slider_crank.dead_centres(*self.own(crank_ratio, offset)).bottom

    def stroke(self, crank_ratio: Any, offset: Any) -> Any:
        """Stroke over two of the engine's crank radii [1]."""
        if self.rod is not None:
            return self.rod.stroke(crank_ratio, offset)
        own = self.own(crank_ratio, offset)
        return self.radius_factor * slider_crank.dead_centres(*own).stroke

    def displacement(self, crank_ratio: Any, offset: Any) -> Any:
        """Displacement over the engine's piston area and two of its crank radii [1]."""
        return self.area_factor * self.stroke(crank_ratio, offset)


class OwnCrank(NamedTuple):
    """Crank radius over rod length, and offset over crank radius, of one cylinder [1]."""

    crank_ratio: Any
    offset: Any


EQUAL = Member(0.0, 1.0, 1.0)  # Cylinder 1 of an engine whose cylinders are equal
SMALLEST_RADIUS = 0.1  # Smallest crank radius of a throw, over the engine's

LARGEST_FACTOR = 2.0
"""Largest factor on pressure rise or mass: beyond twice the others' it is another engine."""


@dataclass(frozen=True)
class Cylinders:
    """The cylinders of one engine."""

    # Crank angle after which everything repeats [rad]: a cycle, or several with a firing pattern.
    period: float
    # Cylinders by their numbers, which count the firings where no firing order is known.
    members: tuple[Member, ...]
    arrangement: Arrangement | None = None  # Throws and banks of the engine, where they are known
    cycles: int = 1  # Number of cycles in the period

    @cached_property
    def symmetry(self) -> int:
        """How often torque repeats within the cycle: n_s of docs/method.md (40)."""
        phases, marks = [m.phase for m in self.members], [m[1:] for m in self.members]
        numbers, own = [marks.index(mark) for mark in marks], map(self._own_period, self.members)
        return symmetry(phases, self.period, numbers, list(own))

    @cached_property
    def representatives(self) -> tuple[Member, ...]:
        """Cylinders of which all others are copies, shifted by multiples of the period."""
        return self.representatives_of(self.symmetry)

    def representatives_of(self, times: int) -> tuple[Member, ...]:
        """Representatives where less repeats: `times` is a divisor of the symmetry.

        docs/method.md (40) sums over them.
        """
        free, representatives = list(self.members), []
        while free:
            first = free.pop(0)
            own = self._own_period(first)
            representatives.append(first)
            for k in range(1, times):
                place = first.phase + k * self.period / times
                alike = [member for member in free if member[1:] == first[1:]]
                free.remove(min(alike, key=lambda m: abs(math.remainder(m.phase - place, own))))
        return tuple(representatives)

    def _own_period(self, member: Member) -> float:
        """Crank angle after which the pressure of one cylinder repeats [rad]."""
        return self.period / self.cycles * member.cycles

    @cached_property
    def turned(self) -> tuple[Cylinders, float]:
        """The same cylinders with another angle 0, and that angle's own phase [rad].

        Torque at an angle is that of the former at the sum of both. Engines that differ by where
        their angle begins get the same cylinders, bit for bit: those of whose equal cylinders one
        or another does not burn. Phases are rounded to some 1e-14 of their period.
        """
        if self.plain:
            return Cylinders(self.period, self.members, cycles=self.cycles), 0.0
        marks = [member[1:] for member in self.members]
        rarest = min(marks, key=lambda mark: (marks.count(mark), repr(mark)))

        def seen_from(origin: Member) -> tuple[Member, ...]:
            members = []
            for member in self.members:
                own = self._own_period(member)
                part = round((member.phase - origin.phase) / own % 1.0, 14) % 1.0
                members.append(member._replace(phase=part * own))
            return tuple(sorted(members, key=repr))

        members, phase = min(
            ((seen_from(one), one.phase) for one in self.members if one[1:] == rarest),
            key=lambda image: repr(image[0]),
        )
        return Cylinders(self.period, members, cycles=self.cycles), phase

    @property
    def count(self) -> int:
        """Number of cylinders."""
        return len(self.members)

    def without(self, number: int) -> Cylinders:
        """Return the same cylinders, `number` (from 1) of which does not burn; 0: all do."""
        if number == 0:
            return self
        factors = list(self.pressure_factors)
        factors[number - 1] = 0.0
        return self.with_factors(pressure_factor=tuple(factors))

    def with_pattern(self, pattern: Sequence[float]) -> Cylinders:
        """Return the same cylinders, firing by a pattern.

        Parameters
        ----------
        pattern : sequence of float
            For each firing in the order in which the cylinders fire, beginning with cylinder 1, the
            factor on its pressure (times the cylinder's own); it repeats without end. 1 fires, 0
            does not burn, `SEALED` has its valves shut.

        Raises
        ------
        ValueError
            One line, where the pattern is empty, has other numbers, or repeats after more than
            `firing_sequence.MOST_CYCLES` cycles.

        Examples
        --------
        Every third firing of a four-cylinder engine is left out: all repeats after three cycles,
        and the torque after three firings.

        >>> import math
        >>> four = even_cylinders(4, 4.0 * math.pi).with_pattern([1.0, 1.0, 0.0])
        >>> four.cycles, four.symmetry, four.members[0].pressure_factor
        (3, 4, (1.0, 1.0, 0.0))
        """
        wanted, count = shortest(checked_pattern(pattern)), len(self.members)
        cycles = cycles_of_pattern(len(wanted), count)
        fires = sorted(range(count), key=lambda i: (-self.members[i].phase % self.period, i))
        members = list(self.members)
        for place, i in enumerate(fires):
            own = self.pressure_factors[i]
            each = [wanted[(n * count + place) % len(wanted)] for n in range(cycles)]
            factors = shortest(tuple(f if f == SEALED else f * own for f in each))
            one = factors[0] if len(factors) == 1 else factors
            members[i] = members[i]._replace(pressure_factor=one)
        # A cylinder that has the pressures of cylinder 1 some cycles later becomes its copy: it
        # gets the factors of cylinder 1, and a phase that is later by these cycles.
        first = members[0].pressure_factor
        for i, member in enumerate(members):
            these = member.pressure_factor
            if isinstance(these, tuple) and isinstance(first, tuple):
                same_as = [n for n in range(len(these)) if these[n:] + these[:n] == first]
                if same_as:
                    phase = member.phase - same_as[0] * self.period
                    members[i] = member._replace(phase=phase, pressure_factor=first)
        return Cylinders(self.period * cycles, tuple(members), self.arrangement, cycles)

    def firing_at(self, number: int, angle: float) -> Cylinders:
        """Return the same cylinders, `number` (from 1) of which fires at another angle [rad].

        Its throw turns with it.

        Raises
        ------
        ValueError
            For cylinder 1, angles outside the cycle, a throw that other cylinders are on.
        """
        if number == 1:
            raise ValueError("cylinder 1 fires at 0, where the crank angle begins")
        members, made = list(self.members), self.arrangement
        members[number - 1] = members[number - 1]._replace(phase=-angle)
        if made is not None:
            mine = made.cylinders[number - 1]
            others = [i + 1 for i, c in enumerate(made.cylinders) if c.throw == mine.throw]
            if len(others) > 1:
                listed = " and ".join(map(str, others))
                raise ValueError(
                    f"cylinders {listed} are on one throw: cylinder {number} must have its own"
                )
            throws, cylinders = list(made.throws), list(made.cylinders)
            throw = throws[mine.throw]
            turned = throw.angle - (angle - mine.firing_angle)
            throws[mine.throw] = replace(throw, angle=turned % TURN)
            cylinders[number - 1] = replace(mine, firing_angle=angle)
            made = replace(made, throws=tuple(throws), cylinders=tuple(cylinders), uneven=True)
        return Cylinders(self.period, tuple(members), made)

    @cached_property
    def plain(self) -> bool:
        """Whether they fire evenly, one at a time, and are equal."""
        return self.representatives == (EQUAL,)

    @cached_property
    def even(self) -> bool:
        """Whether they fire evenly, whatever else differs."""
        return self.arrangement is None or self.arrangement.is_even

    @cached_property
    def pressure_factors(self) -> tuple[float, ...]:
        """Factor on the pressure of each cylinder, in the first cycle of a pattern."""
        return tuple(self.all_pressure_factors[:, 0].tolist())

    @cached_property
    def all_pressure_factors(self) -> Floats:
        """Factor on the pressure of each cylinder in each cycle, shape (cylinder, cycle)."""
        factors = [member.pressure_factor for member in self.members]
        every = [f if isinstance(f, tuple) else (f,) for f in factors]
        return np.array([f * (self.cycles // len(f)) for f in every], dtype=np.float64)

    @cached_property
    def mass_factors(self) -> tuple[float, ...]:
        """Factor on the reciprocating mass of each cylinder."""
        return tuple(member.mass_factor for member in self.members)

    @cached_property
    def radius_factors(self) -> tuple[float, ...]:
        """Factor on the crank radius of each cylinder."""
        return tuple(member.radius_factor for member in self.members)

    @cached_property
    def diagrams(self) -> tuple[int, ...]:
        """`Member.diagram` of each cylinder."""
        return tuple(member.diagram for member in self.members)

    @cached_property
    def several_makes(self) -> bool:
        """Whether bores differ, or cylinders have diagrams of their own."""
        return {(member.bore_factor, member.diagram) for member in self.members} != {(1.0, 0)}

    @cached_property
    def throw_shares(self) -> tuple[float, ...]:
        """Share of each cylinder in its throw [1]: 1 over the number of rods on the pin.

        1 where no throws are known: each cylinder then has its own.
        """
        if self.arrangement is None:
            return (1.0,) * len(self.members)
        throws = [cylinder.throw for cylinder in self.arrangement.cylinders]
        return tuple(1.0 / throws.count(throw) for throw in throws)

    @cached_property
    def own_pins(self) -> bool:
        """Whether each cylinder has a throw of its own."""
        return set(self.throw_shares) == {1.0}

    @cached_property
    def equal_throws(self) -> bool:
        """Whether all strokes are the engine's: crank radii are, and no rod hangs on another."""
        return set(self.radius_factors) == {1.0} and not self.articulated

    @cached_property
    def articulated(self) -> bool:
        """Whether rods hang on master rods."""
        return any(member.rod is not None for member in self.members)

    @cached_property
    def both_sides(self) -> bool:
        """Whether cylinders lie to both sides of the crank's axis."""
        return len({member.side for member in self.members}) > 1

    def check_turning(self, crank_ratio: npt.ArrayLike, offset: npt.ArrayLike = 0.0) -> None:
        """Refuse throws that do not turn: |e| + r must be below the rod's length on each.

        Articulated rods must be longer than |e| + r and the knuckle pin's distance together.

        `crank_ratio` and `offset`, over the crank radius, are the engine's and broadcast.

        Raises
        ------
        ValueError
            One line that begins with `radius_factor` or `articulated_rods`.
        """
        largest = max(self.radius_factors)
        ratio, offset_ratio = np.asarray(crank_ratio, dtype=float), np.abs(offset)
        for rod in dict.fromkeys(member.rod for member in self.members if member.rod):
            least = 1.0 + rod.radius + offset_ratio
            if not (rod.rod(ratio) > least).all():
                raise ValueError(
                    f"articulated_rods: a rod of {np.min(rod.rod(ratio)):g} crank radii with its "
                    f"knuckle pin at {rod.radius:g}: must be longer than {np.max(least):g}, crank "
                    "radius, knuckle radius and offset together"
                )
        stuck = ~(ratio * (largest + offset_ratio) < 1.0)
        if stuck.any():
            ratio, offset_ratio = np.broadcast_arrays(ratio, offset_ratio)
            here, apart = ratio[stuck].flat[0], offset_ratio[stuck].flat[0]
            with_offset = f" and an offset of {apart:g} crank radii" if apart else ""
            raise ValueError(
                f"radius_factor = {largest:g}: with crank_ratio = {here:g}{with_offset} the crank "
                f"cannot turn; must be below {1.0 / here - apart:g}"
            )

    @cached_property
    def along_shaft(self) -> tuple[tuple[int, ...], ...] | None:
        """Places of the cylinders (from 0) at each place of the shaft; None where unknown."""
        if self.arrangement is None:
            return None
        throws = self.arrangement.throws
        positions = [throws[c.throw].position for c in self.arrangement.cylinders]
        return tuple(
            tuple(i for i, where in enumerate(positions) if where == position)
            for position in sorted(set(positions))
        )

    def with_factors(
        self,
        pressure_factor: tuple[float, ...] | None = None,
        mass_factor: tuple[float, ...] | None = None,
        radius_factor: tuple[float, ...] | None = None,
    ) -> Cylinders:
        """Return the same cylinders with other factors, those of None kept; see `cylinders_of`.

        Cylinders on one throw have one radius, and that of cylinder 1 is the engine's.
        """
        count = len(self.members)
        factors = []
        for name, values, own in (
            ("pressure_factor", pressure_factor, self.pressure_factors),
            ("mass_factor", mass_factor, self.mass_factors),
            ("radius_factor", radius_factor, self.radius_factors),
        ):
            taken = own if values is None else tuple(given_array(name, values).reshape(-1).tolist())
            if len(taken) != count:
                raise ValueError(
                    f"{name}: {len(taken)} values for {count} cylinders: must be one for each"
                )
            for number, value in enumerate(taken, start=1):
                if not (math.isfinite(value) and 0.0 <= value <= LARGEST_FACTOR):
                    raise ValueError(
                        f"{name}, value {number} = {value:g}: must be a number from 0 to "
                        f"{LARGEST_FACTOR:g}"
                    )
            factors.append(taken)
        if self.articulated and set(factors[2]) != {1.0}:
            raise ValueError("radius_factor: not allowed together with articulated rods")
        members = tuple(
            member._replace(pressure_factor=f, mass_factor=m, radius_factor=r)
            for member, f, m, r in zip(self.members, *factors, strict=True)
        )
        return Cylinders(self.period, members, self._with_radii(factors[2]))

    def with_makes(
        self, bore_factors: Sequence[float] | None = None, diagrams: Sequence[int] | None = None
    ) -> Cylinders:
        """Return the same cylinders with other bores over the engine's, or diagrams.

        See `Member`; what is None is kept.
        """
        bores = [member.bore_factor for member in self.members]
        each = zip(self.members, bore_factors or bores, diagrams or self.diagrams, strict=True)
        members = tuple(m._replace(bore_factor=f, diagram=d) for m, f, d in each)
        return replace(self, members=members)

    def _with_radii(self, radii: tuple[float, ...]) -> Arrangement | None:
        """Arrangement in which cylinders have these crank radii over the engine's."""
        if min(radii) < SMALLEST_RADIUS:
            number = radii.index(min(radii)) + 1
            raise ValueError(
                f"radius_factor, value {number} = {min(radii):g}: must be a number from "
                f"{SMALLEST_RADIUS:g} to {LARGEST_FACTOR:g}"
            )
        if radii[0] != 1.0:
            raise ValueError(
                f"radius_factor, value 1 = {radii[0]:g}: must be 1, the engine's stroke is that of "
                "cylinder 1"
            )
        if self.arrangement is None or radii == tuple(self.arrangement.radius_factors):
            return self.arrangement
        of_throw: dict[int, float] = {}
        for number, cylinder in enumerate(self.arrangement.cylinders, start=1):
            radius = of_throw.setdefault(cylinder.throw, radii[number - 1])
            if radius != radii[number - 1]:
                raise ValueError(
                    f"radius_factor, value {number} = {radii[number - 1]:g}: must be {radius:g} as "
                    f"of the other cylinders on throw {cylinder.throw + 1}"
                )
        throws = tuple(
            replace(throw, radius_factor=of_throw.get(number, throw.radius_factor))
            for number, throw in enumerate(self.arrangement.throws)
        )
        return replace(self.arrangement, throws=throws)

    @cached_property
    def are_equal(self) -> bool:
        """Whether all factors are 1."""
        return {member[1:] for member in self.members} == {EQUAL[1:]}

    @property
    def solved(self) -> str:
        """The part of the cycle that is solved, and why, in words."""
        whole = "whole cycle" if self.cycles == 1 else f"all {self.cycles} cycles"
        parts = Fraction(self.cycles, self.symmetry)
        part = whole
        if self.symmetry > 1:
            part = f"{parts} Phi" if self.cycles > 1 else f"Phi/{self.symmetry}"
        if len(self.members) == 1:
            return part
        firing = "even firing" if self.even else "uneven firing"
        return f"{part}, {firing}{'' if self.are_equal else ', unequal cylinders'}"


CylindersByCount = Mapping[int, Cylinders]
"""Cylinders of each set, by the number of cylinders where designs differ in nothing else."""


@lru_cache(maxsize=64)
def even_cylinders(count: int, period: float, order: tuple[int, ...] | None = None) -> Cylinders:
    """Evenly firing equal cylinders in line; in the customary order, if there is one, unless given.

    Throws are known where the order is; a cycle of three revolutions or more has none.
    """
    if order is None and period in (TURN, FOUR_STROKE):
        order = customary_order(count, two_stroke=period == TURN)
    if order is not None:
        first = order.index(1)  # the crank angle is 0 where cylinder 1 fires
        return cylinders_of(in_line(count, (*order[first:], *order[:first]), period))
    return Cylinders(
        period, tuple(Member(float(p), 1.0, 1.0) for p in firing_phases(count, period))
    )


def cylinders_of(
    arrangement: Arrangement,
    pressure_factor: tuple[float, ...] | None = None,
    mass_factor: tuple[float, ...] | None = None,
) -> Cylinders:
    """Cylinders of an arrangement, with factors on pressure and mass (1 unless given).

    Raises
    ------
    ValueError
        One line, for a wrong number of factors, or values that are no factor.
    """
    radii = arrangement.radius_factors.tolist()
    each = zip(arrangement.phases.tolist(), radii, arrangement.cylinder_sides, strict=True)
    members = tuple(Member(phase, 1.0, 1.0, radius, side) for phase, radius, side in each)
    engine = Cylinders(arrangement.period, members, arrangement)
    return engine.with_factors(pressure_factor, mass_factor)
