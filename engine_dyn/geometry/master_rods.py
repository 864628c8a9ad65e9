"""Master and articulated rods of an engine: which rods hang on which, from their measures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from engine_dyn.geometry.arrangement import TURN
from engine_dyn.geometry.articulated_rod import ArticulatedRod
from engine_dyn.geometry.cylinders import LARGEST_FACTOR, Cylinders


def with_rods(
    engine: Cylinders,
    radius: Sequence[float] | float,
    knuckle_mass: Sequence[float] | float,
    angles: Sequence[float] | None = None,
    length: Sequence[float] | float | None = None,
) -> Cylinders:
    """Return the same cylinders with master and articulated rods.

    Parameters
    ----------
    engine : Cylinders
        Whose throws are known and equal.
    radius : float or sequence of float
        Distance of each cylinder's knuckle pin from the crank pin over the crank radius [1]; 0
        for the master of each throw. A number is that of all but the first cylinder of each
        throw; 0 means plain rods.
    knuckle_mass : float or sequence of float
        Mass at each knuckle pin over the engine's reciprocating mass [1].
    angles : sequence of float, optional
        Direction of each knuckle pin from the master rod's axis [rad], 0 for masters; by
        default that of the cylinder from the master's.
    length : float or sequence of float, optional
        Length of each articulated rod over the crank radius [1]; by default that of the master
        rod less the distance of the knuckle pin.

    Raises
    ------
    ValueError
        One line: throws that are not known, another number of values, values outside their
        range, a throw without exactly one master, throws that are not equal.
    """
    made, count = engine.arrangement, engine.count
    if made is None:
        raise ValueError("the throws must be known: give an arrangement")
    if set(engine.radius_factors) != {1.0} or engine.both_sides:
        raise ValueError("not allowed together with radius_factor or a VR engine")
    on_throw = [cylinder.throw for cylinder in made.cylinders]
    first = [on_throw.index(throw) == k for k, throw in enumerate(on_throw)]
    radii = _each("radius", radius, LARGEST_FACTOR, first)
    is_master = [one == 0.0 for one in radii]
    masses = _each("knuckle_mass", knuckle_mass, LARGEST_FACTOR, is_master)
    # Articulated rods are at most a hundred crank radii long.
    lengths = _each("length", 0.0 if length is None else length, 100.0, is_master)
    if angles is not None and len(angles) != count:
        raise ValueError(f"angles: {len(angles)} values for {count} cylinders")
    if not any(radii):
        if np.any(radius):
            raise ValueError("radius: no cylinders share a throw, so that no rod hangs on another")
        plain = tuple(member._replace(rod=None) for member in engine.members)
        return replace(engine, members=plain)
    members = list(engine.members)
    for throw in set(on_throw):
        here = [k for k in range(count) if on_throw[k] == throw]
        masters = [k for k in here if is_master[k]]
        if len(masters) != 1 or radii[0] != 0.0:
            listed = ", ".join(str(k + 1) for k in here)
            raise ValueError(
                f"radius: must be 0 for one of the cylinders {listed} of throw {throw + 1}, "
                "the master (cylinder 1 is one), and above 0 for the others"
            )
        master = made.banks[made.cylinders[masters[0]].bank]
        for k in here:
            bank = math.remainder(made.banks[made.cylinders[k].bank] - master, TURN)
            bank = round(bank, 12)  # so that equal rods are equal in spite of rounding errors
            angle = bank if angles is None else float(angles[k])
            rod = ArticulatedRod(radii[k], angle, bank, lengths[k], masses[k])
            members[k] = members[k]._replace(rod=None if k == masters[0] else rod)
    return replace(engine, members=tuple(members))


def _each(
    name: str, value: Sequence[float] | float, high: float, masters: Sequence[bool]
) -> list[float]:
    """A value for each cylinder; a number holds for all but the masters, which get 0."""
    if np.ndim(value) == 0:
        number = float(np.asarray(value))
        return _each(name, [0.0 if one else number for one in masters], high, masters)
    numbers = [float(one) for one in np.asarray(value, dtype=float)]
    if len(numbers) != len(masters):
        raise ValueError(f"{name}: {len(numbers)} values for {len(masters)} cylinders")
    for place, one in enumerate(numbers, start=1):
        if not 0.0 <= one <= high:
            raise ValueError(f"{name}, value {place} = {one:g}: must be from 0 to {high:g}")
    return numbers
