"""Couplings whose torque is not in proportion to their twist: tables, clearance, dry friction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine_dyn.given_numbers import given_array
from engine_dyn.torsion.harmonic_balance import Laws, Motion
from engine_dyn.torsion.system import ShaftSystem
from engine_dyn.types import Floats

CONTACTS = ("keeps_contact", "lifts_off", "rattles", "floats")
"""What a coupling with clearance does: touch one side always or at times, both sides, or none."""


@dataclass(frozen=True, eq=False)
class Coupling:
    """A coupling whose torque is not in proportion to its twist.

    Numbers broadcast with the designs.
    """

    shaft: int  # Number of its shaft, whose stiffness is that of the linear form
    # Twist [rad] and torque [N m], ascending. Tables from 0 on are odd. Without them, the shaft's
    # stiffness acts.
    twist: Any = None
    torque: Any = None
    clearance: Any = 0.0  # Angle between the two sides' contacts, in which no torque acts [rad]
    # Torque of dry friction, beside all of that [N m], and the stiffness with which it sticks
    # [N m/rad].
    friction_torque: Any = 0.0
    friction_stiffness: Any = 0.0

    def table(self) -> tuple[Floats, Floats]:
        """Twist and torque of all points, after checks; (-1, 0, 1) without a table."""
        if self.twist is None and self.torque is None:
            line = np.array([-1.0, 0.0, 1.0])
            return line, line
        twist, torque = (
            given_array(name, value, finite=True)
            for name, value in (("twist", self.twist), ("torque", self.torque))
        )
        if twist.ndim != 1 or twist.size < 2 or twist.shape != torque.shape:
            raise ValueError(
                f"torque: {torque.size} values over {twist.size} of twist: must be as many, at "
                "least 2"
            )
        for name, values in (("twist", twist), ("torque", torque)):
            if not (np.diff(values) > 0.0).all():
                place = int(np.argmin(np.diff(values) > 0.0)) + 1
                raise ValueError(
                    f"{name}[{place}] = {values[place]:g}: must be above the value before, "
                    f"{values[place - 1]:g}"
                )
        if twist[0] == 0.0 and torque[0] == 0.0:
            return np.concatenate([-twist[:0:-1], twist]), np.concatenate([-torque[:0:-1], torque])
        through_zero = twist[0] < 0.0 < twist[-1] and np.interp(0.0, twist, torque) == 0.0
        if np.any(self.clearance) and not through_zero:
            raise ValueError("torque: must be 0 at a twist of 0, which clearance is around")
        return twist, torque


def linearised(coupling: Coupling, mean_torque: Any) -> tuple[Floats, Floats]:
    """Stiffness [N m/rad] at a mean torque [N m] by the coupling's table, and mean twist [rad].

    Where the mean torque is 0, with clearance, the stiffness is that of contact.
    """
    twist, torque = coupling.table()
    mean = given_array("mean_torque", mean_torque)
    place = np.clip(np.searchsorted(torque, mean, side="right") - 1, 0, torque.size - 2)
    slope = (np.diff(torque) / np.diff(twist))[place]
    at = twist[place] + (mean - torque[place]) / slope
    return slope, at + np.sign(mean) * 0.5 * given_array("clearance", coupling.clearance)


def departure(coupling: Coupling, mean_torque: Any, half_range: Any) -> Floats:
    """How far a coupling's torque departs from its linear form, over the half range [1].

    The largest difference over the twists that the linear form has at that half range, and what
    friction adds to it. 0 where a linear response holds as it is.

    Parameters
    ----------
    coupling : Coupling
        With a table.
    mean_torque, half_range : array_like
        Of the linear response [N m]; they broadcast.
    """
    stiffness, rest = linearised(coupling, mean_torque)
    half = given_array("half_range", half_range)
    twist, torque = coupling.table()
    slope = np.diff(torque) / np.diff(twist)
    change = (half / stiffness)[..., None] * np.linspace(-1.0, 1.0, 65)
    gap = 0.5 * given_array("clearance", coupling.clearance)[..., None]
    x = rest[..., None] + change
    x = x - np.clip(x, -gap, gap)
    place = np.clip(np.searchsorted(twist, x, side="right") - 1, 0, slope.size - 1)
    own = torque[place] + slope[place] * (x - twist[place])
    linear = given_array("mean_torque", mean_torque)[..., None] + stiffness[..., None] * change
    friction = given_array("friction_torque", coupling.friction_torque)
    held = np.minimum(friction, coupling.friction_stiffness * np.abs(change[..., -1]))
    apart = np.abs(own - linear).max(axis=-1) + held
    return np.divide(apart, half, out=np.zeros(np.broadcast(apart, half).shape), where=half > 0.0)


def numbers_of(coupling: Coupling) -> list[Floats]:
    """Clearance, and torque and stiffness of the friction, after checks."""
    values = []
    for name in ("clearance", "friction_torque", "friction_stiffness"):
        value = given_array(name, getattr(coupling, name), finite=True)
        if (value < 0.0).any():
            raise ValueError(f"{name} = {value[value < 0.0].flat[0]:g}: must not be below 0")
        values.append(value)
    if np.any((values[1] > 0.0) & (values[2] == 0.0)):
        raise ValueError("friction_stiffness = 0: must be above 0 beside a friction_torque")
    return values


def laws_of(system: ShaftSystem, couplings: Sequence[Coupling], numbers: Any) -> Laws:
    """Tables of all couplings one after the other, with their clearance; and their numbers."""
    places = [coupling.shaft for coupling in couplings]
    stiffness = system.stiffness[:, system.node_of_shaft[places]]
    stiffness = stiffness * system.shaft_factor[:, places] ** 2
    clearance, friction, stick = (np.stack(value, axis=-1) for value in zip(*numbers, strict=True))
    columns: list[tuple[Floats, Floats, Floats]] = []
    first = [0]
    for c, coupling in enumerate(couplings):
        twist, torque = coupling.table()
        gap = 0.5 * clearance[:, c, None]
        if gap.any():
            below, above = twist < 0.0, twist > 0.0
            side = np.repeat([-1.0, 1.0], [below.sum() + 1, above.sum() + 1])
            twist = np.concatenate([twist[below], [0.0, 0.0], twist[above]])
            torque = np.concatenate([torque[below], [0.0, 0.0], torque[above]])
        else:
            side = np.zeros(twist.size)
        points = twist + gap * side
        values = torque * (stiffness[:, c, None] if coupling.twist is None else np.ones_like(gap))
        length, slope = np.diff(points), np.zeros(points.shape)
        np.divide(np.diff(values), length, out=slope[:, :-1], where=length > 0.0)
        slope[:, -1] = slope[:, -2]
        for place in np.flatnonzero((length == 0.0).any(axis=0)):  # a clearance of 0
            slope[:, place] = np.where(length[:, place] > 0.0, slope[:, place], slope[:, place - 1])
        columns.append((points, values, slope))
        first.append(first[-1] + twist.size)
    points, values, slope = (np.concatenate(v, axis=-1) for v in zip(*columns, strict=True))
    return Laws(np.array(first), points, values, slope, stiffness, friction, stick)


def rest_twists(laws: Laws, mean: Floats) -> Floats:
    """Twist of each coupling under its mean torque alone; both have the shape (cases, C)."""
    twist = np.zeros(mean.shape)
    for case, c in np.argwhere(mean != 0.0):
        table = slice(laws.first[c], laws.first[c + 1])
        points, torque, slope = (v[case, table] for v in (laws.twist, laws.torque, laws.slope))
        place = int(np.clip(np.searchsorted(torque, mean[case, c]), 1, torque.size - 1)) - 1
        place += int(slope[place] == 0.0)
        twist[case, c] = points[place] + (mean[case, c] - torque[place]) / slope[place]
    return twist


def torque_extremes(laws: Laws, motion: Motion) -> Floats:
    """Least and largest torque of the couplings, (cases, C, 2): between samples, and in corners."""
    extremes = np.empty((*motion.samples.shape[:2], 2))
    for case, c in np.ndindex(*extremes.shape[:2]):
        table = slice(laws.first[c], laws.first[c + 1])
        points, values, slope = (v[case, table] for v in (laws.twist, laws.torque, laws.slope))
        here, torque = motion.samples[case, c, :2]
        after, grip = np.roll(here, -1), motion.slope[case, c, 1]
        place = np.clip(np.searchsorted(points, here, side="right") - 1, 0, points.size - 2)
        # Friction and damping run straight from sample to sample.
        rest = torque - values[place] - slope[place] * (here - points[place])
        most = [torque]
        for corner in range(1, points.size - 1):
            cells = np.flatnonzero((here - points[corner]) * (after - points[corner]) < 0.0)
            part = (points[corner] - here[cells]) / (after[cells] - here[cells])
            most.append(values[corner] + rest[cells] + part * (np.roll(rest, -1) - rest)[cells])
        # Away from corners, by a parabola through three samples.
        bent = (place != np.roll(place, -1)) | (grip != np.roll(grip, -1))
        before, following = np.roll(torque, 1), np.roll(torque, -1)
        bend = 2.0 * torque - before - following
        turns = (torque - before) * (following - torque) <= 0.0
        turns &= ~bent & ~np.roll(bent, 1) & (bend != 0.0)
        most.append(
            (torque + 0.125 * (following - before) ** 2 / np.where(turns, bend, 1.0))[turns]
        )
        every = np.concatenate(most)
        extremes[case, c] = every.min(), every.max()
    return extremes
