"""The shaft of an engine as people describe it: discs by name, and numbers that vary.

What is the same for all designs (names, what joins what, where the throws, the flywheel and the
load are) is a `Shaft`. Its numbers go by keys, such as `disc_inertia_3`, which scenes may vary;
they and a `Shaft` make a `ShaftSystem`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.torsion.dampers import Pendulum, pendulum
from engine_dyn.torsion.stress import shaft_stiffness
from engine_dyn.torsion.system import ShaftSystem, shaft_system
from engine_dyn.types import Floats

__all__ = ["MOST_DAMPERS", "MOST_GEARS", "MOST_OF_SCENE", "Shaft", "Table"]

MOST_OF_SCENE, MOST_GEARS, MOST_DAMPERS = 40, 8, 8
"""Most discs, gears and dampers of a shaft whose numbers have keys; shafts of ships have some 30
discs."""


class Table(NamedTuple):
    """Stiffness [N m/rad] of a coupling over the size of its mean torque [N m], which ascends."""

    torque: Floats
    stiffness: Floats


@dataclass(frozen=True, eq=False)
class Shaft:
    """What of a shaft is the same for all designs. Discs and shafts are numbered from 0.

    Parameters
    ----------
    discs : tuple of str
        Names of the discs; the rings of dampers and then the pendulums follow them.
    shafts : tuple of (int, int)
        Discs that each shaft joins; what holds rings and pendulums follows.
    shaft_names : tuple of str
        Their names.
    gears : tuple of (int, int)
        Discs in mesh.
    throws : tuple of int
        Disc of each throw of the engine, in the order along the shaft.
    flywheel, load, auxiliaries : int
        Discs on which they are.
    dampers, pendulums : int
        Their numbers.
    includes_reciprocating : bool
        Whether the inertia of a throw's disc includes the mean of its reciprocating masses.
    keys : tuple of str
        Parameters that give its numbers, as `engine_dyn.quantities.shaft_numbers` has them.
    alloy : frozenset of int
        Shafts of alloy steel, others are of carbon steel.
    tables : mapping of Table
        Stiffness of couplings that have it over their mean torque, by the number of the shaft.
    """

    discs: tuple[str, ...]
    shafts: tuple[tuple[int, int], ...]
    shaft_names: tuple[str, ...]
    gears: tuple[tuple[int, int], ...]
    throws: tuple[int, ...]
    flywheel: int
    load: int
    auxiliaries: int
    dampers: int
    pendulums: int
    includes_reciprocating: bool
    keys: tuple[str, ...]
    alloy: frozenset[int] = frozenset()
    tables: Mapping[int, Table] = field(default_factory=dict)

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

    def key_of(self, what: str, place: int) -> str:
        """Key of a number of a disc or shaft: `shaft_stiffness_2`, or `damper_stiffness_1`.

        Empty where there is none.
        """
        kind, quantity = what.split("_", 1)
        ring = place - (self.own_discs if kind == "disc" else self.own_shafts) + 1
        if ring < 1:
            return f"{what}_{place + 1}"
        # What damps the ring against its hub is a shaft's; nothing damps it against the frame.
        none = what == "disc_damping" or ring > self.dampers
        return "" if none else f"damper_{quantity}_{ring}"

    def along(self, what: str, values: Mapping[str, Any], default: float) -> list[Any]:
        """Values of all discs (`disc_inertia`) or shafts, `default` where none is given."""
        count = len(self.discs if what.startswith("disc_") else self.shafts)
        return [values.get(self.key_of(what, i), default) for i in range(count)]

    def of_tables(self, mean_torque: Any) -> Floats:
        """Stiffness of couplings by their tables, shape (..., S); NaN of all other shafts.

        Beyond the torques of a table it is unknown: 0. `mean_torque` has the shape (..., S).
        """
        size = np.abs(np.asarray(mean_torque, dtype=float))
        found = np.full(size.shape, np.nan)
        for place, table in self.tables.items():
            found[..., place] = np.interp(size[..., place], *table, left=0.0, right=0.0)
        return found

    def stiffnesses(self, values: Mapping[str, Any], of_tables: Any = np.nan) -> list[Any]:
        """Stiffness of each shaft [N m/rad], from its length and diameter where these are given.

        `of_tables` has that of couplings with a table along the last axis.
        """
        found = self.along("shaft_stiffness", values, np.nan)
        for place in self.tables:
            found[place] = np.asarray(of_tables)[..., place]
        for i, given in enumerate(found):
            number = i + 1
            if f"shaft_length_{number}" in values:
                found[i] = shaft_stiffness(
                    values[f"shaft_shear_modulus_{number}"], values[f"shaft_length_{number}"],
                    values[f"shaft_diameter_{number}"], values.get(f"shaft_bore_{number}", 0.0),
                )  # fmt: skip
            elif i >= self.own_shafts and not np.ndim(given) and np.isnan(given):
                found[i] = 0.0  # a ring in oil alone, or a pendulum
        return found

    def inertias(self, values: Mapping[str, Any], reciprocating: Any = 0.0) -> list[Any]:
        """Inertia of each disc [kg m2].

        `reciprocating`, of the masses of each throw along the last axis, is added.
        """
        found = self.along("disc_inertia", values, 0.0)
        if not self.includes_reciprocating:
            of_throws = np.asarray(reciprocating)
            for number, disc in enumerate(self.throws):
                found[disc] = found[disc] + of_throws[..., number]
        for place, made in enumerate(self.as_discs(values), len(found) - self.pendulums):
            found[place] = made.inertia
        return found

    def as_discs(self, values: Mapping[str, Any]) -> list[Pendulum]:
        """Return the pendulums as discs on shafts, see `dampers.pendulum`."""
        if not self.pendulums:
            return []
        ratios, found = self.speed_ratios(values), []
        for i, (carrier, _) in enumerate(self.shafts[self.first_pendulum :], 1):
            mass, distance, length = (
                values[f"pendulum_{what}_{i}"] for what in ("mass", "distance", "length")
            )
            found.append(pendulum(mass, distance, length, ratios[carrier]))
        return found

    def ratios(self, values: Mapping[str, Any]) -> list[Any]:
        """Speed of the second disc of each gear over that of the first."""
        return [values[f"shaft_gear_ratio_{i + 1}"] for i in range(len(self.gears))]

    def speed_ratios(self, values: Mapping[str, Any]) -> list[Any]:
        """Speed of each disc over that of the crank."""
        found: dict[int, Any] = {self.throws[0]: 1.0}
        links = [(pair, 1.0) for pair in self.shafts]
        links += list(zip(self.gears, self.ratios(values), strict=True))
        while len(found) < len(self.discs):
            for (first, second), ratio in links:
                if first in found:
                    found.setdefault(second, found[first] * ratio)
                elif second in found:
                    found[first] = found[second] / ratio
        return [found[disc] for disc in range(len(self.discs))]

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
            meshes=self.gears, ratios=stacked(self.ratios(values)) if self.gears else 1.0,
            crank=self.throws[0], loose=True,
        )  # fmt: skip


def _paths(start: int, links: Sequence[tuple[int, int]]) -> dict[int, list[int]]:
    """Discs on the way from one to each that links of two join to it, both ends included."""
    found = {start: [start]}
    reached = [start]
    for disc in reached:  # which grows
        for first, second in links:
            other = second if first == disc else first if second == disc else None
            if other is not None and other not in found:
                found[other] = [*found[disc], other]
                reached.append(other)
    return found


def stacked(values: list[Any]) -> Floats:
    """Numbers and arrays that broadcast, along a new last axis."""
    return np.stack(np.broadcast_arrays(*(np.asarray(v, dtype=float) for v in values)), axis=-1)
