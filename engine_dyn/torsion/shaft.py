"""The shaft of an engine as people describe it: discs by name, and numbers that vary.

What is the same for all designs (names, what joins what, where the throws, the flywheel and the
load are) is a `Shaft`. Its numbers go by keys, such as `disc_inertia_3`, which scenes may vary;
they and a `Shaft` make a `ShaftSystem`.

A damper's ring on a hub is a disc, and what holds it a shaft: with viscous damping alone
(Houdaille), with stiffness and loss factor (rubber), or with both. Here is what makes a pendulum a
disc on a shaft, and what cylinders put on the discs of their throws besides the orders of the
torque (`engine_dyn.forces.harmonics.of_throws`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from engine_dyn.forces.superposition import along_shaft
from engine_dyn.geometry.cylinder_means import mean_square, value_of_sets
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount, Member
from engine_dyn.pressure.family import Family
from engine_dyn.torsion.couplings import Coupling, linearised
from engine_dyn.torsion.system import ShaftSystem, shaft_stiffness, shaft_system
from engine_dyn.types import Floats

if TYPE_CHECKING:
    from engine_dyn.torsion.excitation import Excitation

MOST_OF_SCENE, MOST_GEARS, MOST_DAMPERS, MOST_EXCITATIONS, MOST_MODES = 40, 8, 8, 8, 12
"""Largest numbers of discs, gears, dampers, excitations and damped modes whose values have keys;
ships' shafts have some 30 discs."""


class Table(NamedTuple):
    """Stiffness [N m/rad] of a coupling over the size of its mean torque [N m], which ascends."""

    torque: Floats
    stiffness: Floats


class OverSpeed(NamedTuple):
    """Damping [N m s/rad] over the speed of the crank [rad/s], which ascends."""

    speed: Floats
    damping: Floats


@dataclass(frozen=True, eq=False)
class Shaft:
    """Names and places of a shaft, the same for all designs; discs and shafts count from 0."""

    # Names of the discs; rings of dampers and then pendulums follow.
    discs: tuple[str, ...]
    # Two discs that each shaft joins; connections of rings and pendulums follow.
    shafts: tuple[tuple[int, int], ...]
    shaft_names: tuple[str, ...]  # Names of the shafts
    gears: tuple[tuple[int, int], ...]  # Two discs of each pair of gears in mesh
    throws: tuple[int, ...]  # Disc of each throw of the engine, along the shaft
    # Discs on which flywheel, load and auxiliaries are.
    flywheel: int
    load: int
    auxiliaries: int
    # Numbers of dampers and of pendulums.
    dampers: int
    pendulums: int
    # Whether the inertia of a throw's disc includes the mean of its reciprocating masses.
    includes_reciprocating: bool
    # Names of the shaft's parameters, as `engine_dyn.quantities.shaft_numbers` has them.
    keys: tuple[str, ...]
    alloy: frozenset[int] = frozenset()  # Shafts of alloy steel; others are of carbon steel
    # Couplings whose stiffness depends on their mean torque, by the number of the shaft: over the
    # torque, or by their torque over the twist.
    tables: Mapping[int, Table | Coupling] = field(default_factory=dict)
    # Torques besides those of engine, load and auxiliaries.
    excitations: tuple[Excitation, ...] = ()
    modes: int = 0  # Number of modes whose damping is given
    # Damping [N m s/rad] over the speed of the crank [rad/s], by the key that it replaces.
    damping_over_speed: Mapping[str, OverSpeed] = field(default_factory=dict)

    @property
    def own_discs(self) -> int:
        """Number of discs that are neither ring nor pendulum."""
        return len(self.discs) - self.dampers - self.pendulums

    @property
    def own_shafts(self) -> int:
        """Number of shafts that hold neither ring nor pendulum."""
        return self.first_pendulum - self.dampers

    @property
    def first_pendulum(self) -> int:
        """Number of the shaft that holds the first pendulum, or the number of shafts."""
        return len(self.shafts) - self.pendulums

    @property
    def free_end(self) -> int:
        """Disc at the end of the crankshaft that is neither that of the flywheel nor the load's."""
        own = [pair for pair in self.shafts if max(pair) < self.own_discs]
        links = [*own, *self.gears]
        from_flywheel = _paths(self.flywheel, links)
        last = max(self.throws, key=lambda throw: len(from_flywheel[throw]))
        paths = _paths(last, links)
        taken = {disc for end in (self.flywheel, self.load) for disc in paths[end][1:]}
        free = _paths(last, [pair for pair in own if taken.isdisjoint(pair)])
        return max(sorted(free), key=lambda disc: len(free[disc]))

    def turns_with_crank(self, disc: int) -> bool:
        """Whether shafts without gears join a disc to the crankshaft."""
        return disc in _paths(self.throws[0], self.shafts)

    def key_of(self, what: str, place: int) -> str:
        """Key of a number of a disc or shaft: `shaft_stiffness_2`, or `damper_stiffness_1`.

        Empty where there is none.
        """
        kind, quantity = what.split("_", 1)
        ring = place - (self.own_discs if kind == "disc" else self.own_shafts) + 1
        if ring < 1:
            return f"{what}_{place + 1}"
        # A damper's ring is damped by the shaft between it and its hub, not against the frame. The
        # disc and the shaft of a pendulum have no keys.
        none = what == "disc_damping" or ring > self.dampers
        return "" if none else f"damper_{quantity}_{ring}"

    def along(self, what: str, values: Mapping[str, Any], default: float) -> list[Any]:
        """Values of all discs (`disc_inertia`) or shafts, `default` where none is given."""
        count = len(self.discs if what.startswith("disc_") else self.shafts)
        return [values.get(self.key_of(what, i), default) for i in range(count)]

    def of_tables(self, mean_torque: Any) -> Floats:
        """Stiffness of couplings by their tables, shape (..., S); NaN of all other shafts.

        Beyond the torques of a table, and where the torque is NaN, it is unknown: 0. `mean_torque`
        has the shape (..., S).
        """
        size = np.abs(np.asarray(mean_torque, dtype=float))
        stiffness = np.full(size.shape, np.nan)
        for place, table in self.tables.items():
            if isinstance(table, Coupling):
                mean = np.asarray(mean_torque)[..., place]
                least, *_, largest = table.table()[1]
                known = linearised(table, mean)[0] * ((mean >= least) & (mean <= largest))
            else:
                known = np.interp(size[..., place], *table, left=0.0, right=0.0)
            stiffness[..., place] = np.nan_to_num(known)
        return stiffness

    def couplings(self, values: Mapping[str, Any]) -> list[Coupling]:
        """Couplings that are not linear: with a torque over the twist, clearance or friction."""
        found = []
        for place in range(self.own_shafts):
            table = self.tables.get(place)
            numbers = {
                name: values[key]
                for name in ("clearance", "friction_torque", "friction_stiffness")
                if (key := f"shaft_{name}_{place + 1}") in values
            }
            if isinstance(table, Coupling):
                found.append(replace(table, **numbers))
            elif numbers:
                found.append(Coupling(place, **numbers))
        return found

    def dampings(self, speed: Any) -> dict[str, Floats]:
        """Damping by its tables at a speed [rad/s], by key; NaN beyond the speeds of a table."""
        return {
            key: np.asarray(np.interp(speed, *table, left=np.nan, right=np.nan))
            for key, table in self.damping_over_speed.items()
        }

    def stiffnesses(self, values: Mapping[str, Any], of_tables: Any = np.nan) -> list[Any]:
        """Stiffness of each shaft [N m/rad], from its length and diameter where these are given.

        `of_tables` has that of couplings with a table along the last axis.
        """
        stiffness = self.along("shaft_stiffness", values, np.nan)
        for place in self.tables:
            stiffness[place] = np.asarray(of_tables)[..., place]
        for i, given in enumerate(stiffness):
            number = i + 1
            if f"shaft_length_{number}" in values:
                stiffness[i] = shaft_stiffness(
                    values[f"shaft_shear_modulus_{number}"], values[f"shaft_length_{number}"],
                    values[f"shaft_diameter_{number}"], values.get(f"shaft_bore_{number}", 0.0),
                )  # fmt: skip
            elif i >= self.own_shafts and not np.ndim(given) and np.isnan(given):
                stiffness[i] = 0.0  # a damper's ring in oil alone, or a pendulum
        return stiffness

    def inertias(self, values: Mapping[str, Any], reciprocating: Any = 0.0) -> list[Any]:
        """Inertia of each disc [kg m2].

        `reciprocating`, of the masses of each throw along the last axis, is added.
        """
        inertia = self.along("disc_inertia", values, 0.0)
        if not self.includes_reciprocating:
            of_throws = np.asarray(reciprocating)
            for number, disc in enumerate(self.throws):
                inertia[disc] = inertia[disc] + of_throws[..., number]
        for place, made in enumerate(self.as_discs(values), len(inertia) - self.pendulums):
            inertia[place] = made.inertia
        return inertia

    def as_discs(self, values: Mapping[str, Any]) -> list[Pendulum]:
        """Return the pendulums as discs on shafts, see `pendulum`."""
        if not self.pendulums:
            return []
        ratios, rows = self.speed_ratios(values), []
        for i, (carrier, _) in enumerate(self.shafts[self.first_pendulum :], 1):
            mass, distance, length = (
                values[f"pendulum_{what}_{i}"] for what in ("mass", "distance", "length")
            )
            rows.append(pendulum(mass, distance, length, ratios[carrier]))
        return rows

    def excitation_factors(self, values: Mapping[str, Any]) -> list[Any]:
        """Return the factor on the torque of each excitation."""
        count = len(self.excitations)
        return [values.get(f"excitation_factor_{i + 1}", 1.0) for i in range(count)]

    def ratios(self, values: Mapping[str, Any]) -> list[Any]:
        """Speed of the second disc of each gear over that of the first."""
        return [values[f"shaft_gear_ratio_{i + 1}"] for i in range(len(self.gears))]

    def speed_ratios(self, values: Mapping[str, Any]) -> list[Any]:
        """Speed of each disc over that of the crank."""
        ratios: dict[int, Any] = {self.throws[0]: 1.0}
        links = [(pair, 1.0) for pair in self.shafts]
        links += list(zip(self.gears, self.ratios(values), strict=True))
        while len(ratios) < len(self.discs):
            for (first, second), ratio in links:
                if first in ratios:
                    ratios.setdefault(second, ratios[first] * ratio)
                elif second in ratios:
                    ratios[first] = ratios[second] / ratio
        return [ratios[disc] for disc in range(len(self.discs))]

    def inertia(self, values: Mapping[str, Any], reciprocating: Any = 0.0) -> Any:
        """Sum of i^2 J of all discs [kg m2]: what a rigid shaft has, at the crank."""
        pairs = zip(self.speed_ratios(values), self.inertias(values, reciprocating), strict=True)
        return sum(ratio**2 * inertia for ratio, inertia in pairs)

    def paths(self, values: Mapping[str, Any]) -> ShaftSystem:
        """Return a system with its gears alone, of equal discs and shafts: where torques flow."""
        ones = [1.0] * len(self.discs), [1.0] * len(self.shafts)
        ratios = stacked(self.ratios(values)) if self.gears else 1.0
        return shaft_system(
            *ones, self.shafts, meshes=self.gears, ratios=ratios, crank=self.throws[0]
        )

    def system(
        self, values: Mapping[str, Any], reciprocating: Any = 0.0, flywheel_excess: Any = 0.0,
        load_damping: Any = 0.0, of_tables: Any = np.nan,
    ) -> ShaftSystem:  # fmt: skip
        """Return the system of these numbers.

        Parameters
        ----------
        values : mapping
            Numbers by their keys, SI; they broadcast.
        reciprocating : array_like
            As of `inertias`.
        flywheel_excess : array_like
            What the flywheel has beyond its disc, at the crank [kg m2].
        load_damping : array_like
            Of the load against the frame, at the crank [N m s/rad].
        of_tables : array_like
            As of `stiffnesses`.
        """
        ratios = self.speed_ratios(values)
        inertia = self.inertias(values, reciprocating)
        if np.any(flywheel_excess):
            added = flywheel_excess / ratios[self.flywheel] ** 2
            inertia[self.flywheel] = inertia[self.flywheel] + added
        damping = self.along("disc_damping", values, 0.0)
        damping[self.load] = damping[self.load] + load_damping / ratios[self.load] ** 2
        return shaft_system(
            stacked(inertia), stacked(self.stiffnesses(values, of_tables)), self.shafts,
            speed_stiffness=stacked(
                [0.0] * self.first_pendulum
                + [made.speed_stiffness for made in self.as_discs(values)]
            ),
            loss_factor=stacked(self.along("shaft_loss_factor", values, 0.0)),
            damping=stacked(self.along("shaft_damping", values, 0.0)),
            disc_damping=stacked(damping),
            ground_stiffness=stacked(self.along("disc_ground_stiffness", values, 0.0)),
            modal_damping=stacked(
                [values.get(f"modal_damping_{i + 1}", 0.0) for i in range(self.modes)]
            ) if self.modes else (),
            meshes=self.gears, ratios=stacked(self.ratios(values)) if self.gears else 1.0,
            crank=self.throws[0], loose=True,
        )  # fmt: skip


def _paths(start: int, links: Sequence[tuple[int, int]]) -> dict[int, list[int]]:
    """Discs on the way from a start to each disc that pairwise links join to it, ends included."""
    paths = {start: [start]}
    reached = [start]
    for disc in reached:  # the list grows during the loop
        for first, second in links:
            other = second if first == disc else first if second == disc else None
            if other is not None and other not in paths:
                paths[other] = [*paths[disc], other]
                reached.append(other)
    return paths


def stacked(values: list[Any]) -> Floats:
    """Numbers and arrays that broadcast, along a new last axis."""
    return np.stack(np.broadcast_arrays(*(np.asarray(v, dtype=float) for v in values)), axis=-1)


class Pendulum(NamedTuple):
    """A centrifugal pendulum as a disc on a shaft."""

    inertia: Any  # Inertia of the disc [kg m2]
    speed_stiffness: Any  # Stiffness of the shaft over the square of the crank's speed [kg m2]
    order: Any  # Order to which the pendulum is tuned, of its carrier's turns [1]
    swing: Any  # Swing of the pendulum on its carrier over the twist of the shaft [1]


def pendulum(mass: Any, distance: Any, length: Any, ratio: Any = 1.0) -> Pendulum:
    r"""Small swings of a pendulum that the centrifugal force holds.

    With its suspension at R from the shaft, a pendulum of length r that swings by psi moves
    s = (R + r) theta + r psi along its path: kinetic energy m s'^2/2. To second order it comes
    closer to the shaft by R r psi^2/(2 (R + r)), in the centrifugal field
    the potential m R r Omega^2 psi^2/2. With chi = s/(R + r), that is the energy of a disc of
    inertia m (R + r)^2 at the angle chi on a shaft of stiffness m (R + r)^2 n^2 Omega^2,
    n^2 = R/r. At order nu, carrier and pendulum together have the inertia
    m (R + r)^2/(1 - nu^2/n^2): Thomson, Theory of Vibration, section 5.7. The mass is a point, or
    does not turn on the carrier (two suspensions); then its own inertia is the carrier's.

    Parameters
    ----------
    mass : array_like
        Mass of all pendulums on the carrier [kg].
    distance, length : array_like
        R and r [m].
    ratio : array_like
        Speed of the carrier over that of the crank [1].
    """
    inertia = mass * (distance + length) ** 2
    square = distance / length
    return Pendulum(inertia, inertia * square * ratio**2, square**0.5, 1.0 + square)


def reciprocating_inertia_of_throws(
    reciprocating_mass: Any, crank_radius: Any, crank_ratio: Any, offset: Any, cylinder_set: Any,
    by_count: CylindersByCount, throws: Any,
) -> Any:  # fmt: skip
    """Cycle mean of the inertia of the reciprocating masses of each throw [kg m2].

    m r^2 sum f_m f_r^2 mean (c/(r omega))^2 over the cylinders of a throw: see
    `masses.engine_inertia`. `throws` are numbers of throws from 1, and broadcast; NaN past the
    last one. Other arguments as of `cylinder_means.engine_inertia_of_cylinders`.
    """

    def of_one(member: Member) -> Any:
        return mean_square(member, crank_ratio, offset)

    moment = reciprocating_mass * crank_radius**2
    return moment * _of_throws(of_one, cylinder_set, by_count, throws)


def mean_torques_of_throws(
    lever: Any, crank_ratio: Any, offset: Any, row: Any, family: Family, friction_torque: Any,
    cylinder_set: Any, by_count: CylindersByCount, throws: Any,
) -> Any:  # fmt: skip
    """Mean torque on each throw [N m]: that of the gas, less each cylinder's share of the friction.

    Parameters
    ----------
    lever : array_like
        Crank radius times piston area times the factor on the diagram [m3].
    crank_ratio, offset, row, family
        As of `engine_dyn.speed.torque.mean_gas_torque`.
    friction_torque : array_like
        Mean, of the whole engine [N m]; all cylinders have the same part of it.
    cylinder_set, by_count, throws
        As of `reciprocating_inertia_of_throws`.
    """
    from engine_dyn.speed.torque import mean_gas_of_member

    known: dict[Member, Any] = {}

    def of_one(member: Member) -> Any:
        key = member._replace(phase=0.0, mass_factor=1.0)
        if key not in known:
            known[key] = mean_gas_of_member(member, crank_ratio, offset, row, family)
        return known[key]

    friction = value_of_sets(cylinder_set, by_count, lambda engine: 1.0 / engine.count)
    pistons = _of_throws(lambda _: 1.0, cylinder_set, by_count, throws)
    gas = _of_throws(of_one, cylinder_set, by_count, throws)
    return lever * gas - friction_torque * friction * pistons


def _of_throws(
    of_one: Callable[[Member], Any], cylinder_set: Any, by_count: CylindersByCount, throws: Any
) -> Any:
    """Sum of a value over the cylinders of each throw."""
    numbers = np.asarray(throws)
    total: Any = np.nan
    for number in np.unique(numbers).astype(int):

        def of_engine(engine: Cylinders, number: int = number) -> Any:
            places = along_shaft(engine)
            if number > len(places):
                return np.nan
            return sum(of_one(engine.members[i]) for i in places[number - 1])

        total = np.where(numbers == number, value_of_sets(cylinder_set, by_count, of_engine), total)
    return total
