"""Couplings whose torque is not in proportion to their twist: tables, clearance, dry friction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from engine_dyn.given_numbers import given_array
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

    def table(self, stiffness: float = 1.0) -> tuple[Floats, Floats]:
        """Twist and torque of all points, after checks; without a table those of a stiffness."""
        if self.twist is None and self.torque is None:
            line = np.array([-1.0, 0.0, 1.0])
            return line, stiffness * line
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

    @property
    def stiffness(self) -> Floats:
        """Slope of each piece of the table [N m/rad]."""
        twist, torque = self.table()
        return np.asarray(np.diff(torque) / np.diff(twist))

    def points(self, stiffness: float, clearance: float) -> tuple[Floats, Floats]:
        """Twist and torque of all points of one case, with its clearance."""
        twist, torque = self.table(stiffness)
        if not clearance:
            return twist, torque
        gap, below, above = 0.5 * clearance, twist < 0.0, twist > 0.0
        return (
            np.concatenate([twist[below] - gap, [-gap, gap], twist[above] + gap]),
            np.concatenate([torque[below], [0.0, 0.0], torque[above]]),
        )

    def numbers(self) -> list[Floats]:
        """Clearance, and torque and stiffness of the friction, after checks."""
        values = []
        for name in ("clearance", "friction_torque", "friction_stiffness"):
            value = given_array(name, getattr(self, name), finite=True)
            if (value < 0.0).any():
                raise ValueError(f"{name} = {value[value < 0.0].flat[0]:g}: must not be below 0")
            values.append(value)
        if np.any((values[1] > 0.0) & (values[2] == 0.0)):
            raise ValueError("friction_stiffness = 0: must be above 0 beside a friction_torque")
        return values


def linearised(coupling: Coupling, mean_torque: Any, stiffness: Any = 1.0) -> tuple[Floats, Floats]:
    """Stiffness [N m/rad] at a mean torque [N m], and mean twist [rad].

    Without a table the stiffness is that of its shaft. Where the mean torque is 0, with clearance,
    it is that of contact.
    """
    mean = given_array("mean_torque", mean_torque)
    slope, at = np.asarray(stiffness), mean / stiffness
    if coupling.twist is not None:
        twist, torque = coupling.table()
        place = np.clip(np.searchsorted(torque, mean, side="right") - 1, 0, torque.size - 2)
        slope = coupling.stiffness[place]
        at = twist[place] + (mean - torque[place]) / slope
    return slope, at + np.sign(mean) * 0.5 * given_array("clearance", coupling.clearance)


def departure(
    coupling: Coupling, mean_torque: Any, half_range: Any, stiffness: Any = 1.0
) -> Floats:
    """How far a coupling's torque departs from its linear form, over the half range [1].

    The largest difference over the twists that the linear form has at that half range, and what
    friction adds to it. 0 where a linear response holds as it is.

    Parameters
    ----------
    coupling : Coupling
        Its table, clearance and friction.
    mean_torque, half_range : array_like
        Of the linear response [N m]; they broadcast.
    stiffness : array_like
        Of its shaft [N m/rad], where it has no table.
    """
    slope, rest = linearised(coupling, mean_torque, stiffness)
    half = given_array("half_range", half_range)
    change = (half / slope)[..., None] * np.linspace(-1.0, 1.0, 65)
    gap = 0.5 * given_array("clearance", coupling.clearance)[..., None]
    x = rest[..., None] + change
    x = x - np.clip(x, -gap, gap)
    own = x * np.asarray(stiffness)[..., None]
    if coupling.twist is not None:
        twist, torque = coupling.table()
        place = np.clip(np.searchsorted(twist, x, side="right") - 1, 0, twist.size - 2)
        own = torque[place] + coupling.stiffness[place] * (x - twist[place])
    linear = given_array("mean_torque", mean_torque)[..., None] + slope[..., None] * change
    friction = given_array("friction_torque", coupling.friction_torque)
    held = np.minimum(friction, coupling.friction_stiffness * np.abs(change[..., -1]))
    apart = np.abs(own - linear).max(axis=-1) + held
    return np.asarray(np.where(half == 0.0, 0.0, apart / np.where(half == 0.0, 1.0, half)))
