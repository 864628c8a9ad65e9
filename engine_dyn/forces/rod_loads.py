r"""Loads in the direction of the piston rod at the crosshead pin, and their reversal.

The *combined rod load* is the gas load and the inertia of everything that reciprocates on the
piston's side of the crosshead pin: piston, piston rod, crosshead and the pin (API Standard 618, 5th
edition). The connecting rod's reciprocating share, which `mechanism.P` has besides, loads the pin
from the other side. Compression of the rod is positive. Without weight and friction.

The bush of the pin gets oil only while the load changes its direction. API 618, paragraph 6.6.4,
asks that the reversal lasts at least 15 degrees of the crank angle and that the largest reversed
load is at least 3 percent of the largest in the other direction.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.compilation import kernel
from engine_dyn.forces import torque
from engine_dyn.forces.samples import largest, sample_angles
from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount, Member
from engine_dyn.pressure.family import Family
from engine_dyn.types import Floats, Integers

EXTREMES = np.dtype(
    [
        (name, np.float64)
        for name in ("gas_compression", "gas_tension", "compression", "tension", "reversal",
                     "ratio")
    ]
)  # fmt: skip
"""Largest compression and tension of the gas load and of the combined rod load [N], 0 where there
is none, and the reversal's duration [rad] and ratio."""


def rod_load_extremes(
    numbers: Mapping[str, Any], family: Family, by_count: CylindersByCount, period: float
) -> npt.NDArray[Any]:
    """Extremes and reversal of the rod loads, the worst of all cylinders.

    Parameters
    ----------
    numbers : mapping of array_like
        Numbers that broadcast over the designs: "crank_ratio", "double_radius" [m], "offset_ratio",
        "bore" [m], "row", "pressure_scale", "crankcase_pressure" [Pa], "piston_mass" [kg], "speed"
        [rad/s] and "cylinder_set".
    family : Family
        Diagrams; of double-acting cylinders, of the effective pressure.
    by_count : mapping
        Cylinders of each set.
    period : float
        Angle of the cycle [rad].

    Returns
    -------
    ndarray of dtype EXTREMES
        Shape of all numbers broadcast. Largest loads are found between samples (`samples`); where
        the load changes its direction, it is a straight line between them.
    """
    columns = dict(zip(numbers, np.broadcast_arrays(*numbers.values()), strict=True))
    shape = columns["cylinder_set"].shape
    flat = {name: column.reshape(-1) for name, column in columns.items()}
    result = np.empty(flat["cylinder_set"].size, dtype=EXTREMES)
    phi = sample_angles(period, family)
    # The loads that are held at once take 16 MB.
    at_once = max(1, (1 << 21) // phi.size)
    for number in np.unique(flat["cylinder_set"]).astype(int).tolist():
        mine = np.flatnonzero(flat["cylinder_set"] == number)
        for begin in range(0, mine.size, at_once):
            some = mine[begin : begin + at_once]
            one = {name: column[some][:, None] for name, column in flat.items()}
            worst = _worst(one, phi, by_count[number], family, period)
            for name, values in zip(EXTREMES.names or (), worst, strict=True):
                result[name][some] = values
    return result.reshape(shape)


def _worst(
    one: Mapping[str, Any], phi: Floats, engine: Cylinders, family: Family, period: float
) -> list[Floats]:
    """Extremes of designs along the first axis, in the order of `EXTREMES`."""
    extremes = []
    for member in dict.fromkeys(member._replace(phase=0.0) for member in engine.members):
        gas = _load(one, phi, member, family, 0.0)
        load = _load(one, phi, member, family, 1.0)
        reversed_for = np.empty(len(load))
        _fill_reversals(load, reversed_for)
        ends = []
        for values, moved in ((gas, 0.0), (load, 1.0)):

            def curve(
                which: Integers, angle: Floats, moved: float = moved, member: Member = member
            ) -> Floats:
                some = {name: column[which] for name, column in one.items()}
                return _load(some, angle[:, None], member, family, moved)[:, 0]

            for sign in (1.0, -1.0):  # largest compression and tension; 0 where there is none
                ends.append(np.maximum(largest(values, phi, curve, sign)[0], 0.0))
        highest = np.maximum(*ends[2:])
        ratio = np.minimum(*ends[2:]) / np.where(highest > 0.0, highest, 1.0)
        extremes.append((*ends, reversed_for * period / phi.size, ratio))
    return [
        (np.min if name in ("reversal", "ratio") else np.max)(values, axis=0)
        for name, values in zip(EXTREMES.names or (), zip(*extremes, strict=True), strict=True)
    ]


def _load(
    one: Mapping[str, Any], phi: Floats, member: Member, family: Family, moved: float
) -> Floats:
    """Load of a cylinder of designs along the first axis [N], with a part of its inertia."""
    gas = torque.pressure(phi, family, one["row"], one["pressure_scale"], member.pressure_factor)
    gas = (gas - one["crankcase_pressure"]) * torque.piston_area(one["bore"])
    if moved == 0.0:
        return np.asarray(gas)
    own = member.own(one["crank_ratio"], one["offset_ratio"])
    mass = one["piston_mass"] * member.mass_factor * member.radius_factor
    inertia = mass * 0.5 * one["double_radius"] * one["speed"] ** 2
    return np.asarray(gas - inertia * slider_crank.acceleration(phi, *own))


@kernel
def _fill_reversals(load: Floats, result: Floats) -> None:
    """Fill in the shorter of the longest stretches of compression and of tension, in samples."""
    designs, count = load.shape
    for design in range(designs):
        force = load[design]
        first = -1
        for i in range(count):
            if (force[i] > 0.0) != (force[i - 1] > 0.0):
                first = i
                break
        longest_up, longest_down, last = 0.0, 0.0, 0.0
        if first >= 0:
            for k in range(count + 1):
                i = (first + k) % count
                before, here = force[i - 1], force[i]
                if (here > 0.0) == (before > 0.0):
                    continue
                place = first + k - 1.0 + before / (before - here)
                if k > 0:
                    if before > 0.0:
                        longest_up = max(longest_up, place - last)
                    else:
                        longest_down = max(longest_down, place - last)
                last = place
        known = math.isfinite(force[0])
        result[design] = min(longest_up, longest_down) if known else math.nan
