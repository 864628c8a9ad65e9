"""The arrangement of an engine: throws, banks and cylinders, and what follows from them.

Angles are in radians, positive in the sense of rotation, seen along the shaft. With the crank angle
phi = 0 at the firing top dead centre of cylinder 1, a throw of angle d points phi + d away from the
direction of cylinder 1, and a bank of angle g lies g away from a common direction, so the cylinder
of bank g on throw d is at top dead centre where phi = g - g_1 - (d - d_1), modulo a turn: a throw
ahead in the sense of rotation fires earlier, a bank ahead later. In a four-stroke engine the firing
angle says which of the two turns it is.

The angle to add to phi to get a cylinder's own crank angle, from its own firing top dead centre, is
its *phase*, minus its firing angle. An offset e of the pin shifts the dead centres of equal throws
alike; throws of another radius, or to the other side of the crank's axis, then stand where their
dead centres fall at the firing angles, arcsin(e/(l + r)) of their own from the direction given
here. Articulated rods shift them too, but cannot be put right by the throw: see `cylinders.Member`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.geometry.firing_orders import CUSTOMARY_ORDERS as CUSTOMARY_ORDERS
from engine_dyn.geometry.firing_orders import customary_order as customary_order
from engine_dyn.given_numbers import given_array
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE

MOST_CYLINDERS = 24

TURN = 2.0 * math.pi

FOUR_STROKE = 2.0 * TURN
TWO_STROKE = TURN  # Crank angle of a two-stroke cycle [rad]

SAME_ANGLE = 0.01 * DEGREE
"""Difference of equal angles: files give sevenths and ninths of a turn with few digits."""


def firing_phases(cylinders: int, period: float) -> Any:
    """Angles [rad] to add to the engine's crank angle to get each cylinder's own, evenly spaced.

    In firing order: the cylinder that fires i-th reaches its top dead centre i Phi/Z later. Their
    order does not matter to the sum over all cylinders.
    """
    return -np.arange(cylinders) * (period / cylinders)


def symmetry(
    phases: npt.ArrayLike, period: float, weights: npt.ArrayLike | None = None,
    own_periods: npt.ArrayLike | None = None,
) -> int:  # fmt: skip
    """How often the cylinders repeat themselves within the cycle: n_s of docs/method.md (40).

    Parameters
    ----------
    phases : array_like, shape (Z,)
        Phase of each cylinder [rad].
    period : float
        Angle of the cycle [rad].
    weights : array_like, shape (Z,) or (Z, k), optional
        Further weights that tell cylinders apart (factor on the pressure, mass, crank radius);
        equal weights are equal bit for bit.
    own_periods : array_like, shape (Z,), optional
        Angle after which each cylinder repeats [rad], a part of the period.

    Returns
    -------
    int
        The largest n such that a shift by period/n maps the cylinders, with their weights, onto
        themselves: the sum over all cylinders has the period `period`/n. 1 if nothing repeats.
    """
    angle = np.asarray(phases, dtype=np.float64)
    count = len(angle)
    marks = np.zeros((count, 1)) if weights is None else np.asarray(weights, float)
    marks = marks.reshape(count, -1)
    periods = np.broadcast_to(period if own_periods is None else np.asarray(own_periods), count)
    for parts in range(count, 1, -1):
        # Such a shift maps cylinders onto each other in rings of `parts` cylinders.
        if count % parts == 0 and _repeats(angle, marks, periods, period / parts):
            return parts
    return 1


def _repeats(angle: Floats, marks: Floats, periods: Floats, shift: float) -> bool:
    """Whether a shift maps the cylinders onto themselves, one to one."""
    free = list(range(len(angle)))
    for phase, mark in zip(angle, marks, strict=True):
        for place, other in enumerate(free):
            apart = math.remainder(angle[other] - phase - shift, periods[other])
            if abs(apart) < SAME_ANGLE and np.array_equal(marks[other], mark):
                free.pop(place)
                break
        else:
            return False
    return True


def phase_sums(
    orders: npt.ArrayLike,
    phases: npt.ArrayLike,
    period: float,
    weights: npt.ArrayLike | None = None,
) -> Floats:
    """Length of the sum of the phase vectors of all cylinders, |sum w_k exp(i nu psi_k)|.

    What is left of harmonic nu of one cylinder's torque (or, for whole nu, of its inertia force
    along the cylinder, in one bank) when all act together: 0 where they cancel, Z where they add.

    Parameters
    ----------
    orders : array_like
        Harmonics per turn of the crank: multiples of 1/2 (four-stroke) or of 1 (two-stroke).
    phases : array_like, shape (Z,)
        Phase of each cylinder [rad].
    period : float
        Angle of the cycle [rad].
    weights : array_like, shape (Z,), optional
        Factor of each cylinder, 1 by default.

    Returns
    -------
    ndarray, shape of `orders`

    Raises
    ------
    ValueError
        For orders that are no harmonics of the cycle.
    """
    nu = np.asarray(orders, dtype=np.float64)
    multiples = nu * round(period / TURN)
    wrong = ~((multiples == np.rint(multiples)) & (nu > 0.0) & np.isfinite(nu))
    if wrong.any():
        raise ValueError(
            f"order = {nu[wrong].flat[0]:g}: must be a multiple of {TURN / period:g} above 0"
        )
    psi = np.asarray(phases, dtype=np.float64)
    factor = np.ones(len(psi)) if weights is None else np.asarray(weights, dtype=np.float64)
    length: Floats = np.abs((factor * np.exp(1j * nu[..., None] * psi)).sum(axis=-1))
    return length


@dataclass(frozen=True)
class Throw:
    """One crank pin.

    Attributes
    ----------
    angle : float
        Direction of the pin [rad], in the sense of rotation.
    position : float
        Place along the shaft from the free end, in distances of neighbouring throws [1].
    radius_factor : float
        Crank radius over the engine's [1].
    """

    angle: float
    position: float = 0.0
    radius_factor: float = 1.0


@dataclass(frozen=True)
class Cylinder:
    """One cylinder.

    Attributes
    ----------
    throw, bank : int
        Its place in the arrangement's `throws` and `banks`, from 0.
    firing_angle : float
        The engine's crank angle at its firing top dead centre [rad], 0 <= angle < period.
    """

    throw: int
    bank: int
    firing_angle: float


@dataclass(frozen=True)
class Arrangement:
    """Any crankshaft with its cylinders.

    Attributes
    ----------
    period : float
        Angle of the cycle [rad]: 4 pi (four-stroke) or 2 pi.
    throws : tuple of Throw
        Crank pins.
    banks : tuple of float
        Direction of each bank [rad], in the sense of rotation.
    cylinders : tuple of Cylinder
        In the order of their numbers, from 1.
    uneven : bool
        Says that uneven firing is meant.
    name : str
        Name for people.
    sides : tuple of float
        Factor on the engine's offset for each bank: 1, as of the bank of cylinder 1, or -1, to the
        other side of the crank's axis, as of the second bank of VR engines; empty: 1 for all.

    Raises
    ------
    ValueError
        One line with what is wrong, its value and what is allowed: numbers that are not finite, a
        throw or bank that does not exist, a cylinder 1 that does not fire at 0, a firing angle at
        which the throw does not stand at the bank, uneven firing that is not said to be meant.

    Notes
    -----
    Numbers of cylinders, throws and banks count from 1 in messages.
    """

    period: float
    throws: tuple[Throw, ...]
    banks: tuple[float, ...]
    cylinders: tuple[Cylinder, ...]
    uneven: bool = False
    name: str = ""
    sides: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what is no engine."""
        if self.period not in (TURN, 2.0 * TURN):
            raise ValueError(f"period = {self.period:g}: must be 2 pi or 4 pi")
        for what, known in (("throws", self.throws), ("banks", self.banks)):
            if not known:
                raise ValueError(f"{what}: none given; at least one is needed")
        if not self.cylinders:
            raise ValueError("cylinders: none given; at least one is needed")
        for number, throw in enumerate(self.throws, start=1):
            for field in ("angle", "position", "radius_factor"):
                given_array(f"throw {number}: {field}", getattr(throw, field), finite=True)
            if throw.radius_factor <= 0.0:
                raise ValueError(
                    f"throw {number}: radius_factor = {throw.radius_factor:g}: must be above 0"
                )
        for number, angle in enumerate(self.banks, start=1):
            given_array(f"bank {number}: angle", angle, finite=True)
        for number, cylinder in enumerate(self.cylinders, start=1):
            self._check_cylinder(number, cylinder)
        self._check_sides()
        if not self.uneven and not self.is_even:
            raise ValueError(
                f"firing intervals {_degrees(self.firing_intervals)} degree: uneven; if this is "
                "intended, set uneven = true"
            )

    def _check_cylinder(self, number: int, cylinder: Cylinder) -> None:
        for what, place, known in (
            ("throw", cylinder.throw, self.throws),
            ("bank", cylinder.bank, self.banks),
        ):
            if not 0 <= place < len(known):
                raise ValueError(
                    f"cylinder {number}: {what} = {place + 1}: must be a number from 1 to "
                    f"{len(known)}"
                )
        firing = cylinder.firing_angle
        given_array(f"cylinder {number}: firing_angle", firing, finite=True)
        if number == 1 and firing != 0.0:
            raise ValueError(
                f"cylinder 1: firing_angle = {_degrees(firing)} degree: must be 0, where the crank "
                "angle begins"
            )
        if not 0.0 <= firing < self.period:
            raise ValueError(
                f"cylinder {number}: firing_angle = {_degrees(firing)} degree: must be 0 or more "
                f"and below {_degrees(self.period)}"
            )
        first = self.cylinders[0]
        top = self.banks[cylinder.bank] - self.throws[cylinder.throw].angle
        top -= self.banks[first.bank] - self.throws[first.throw].angle
        if abs(math.remainder(firing - top, TURN)) > SAME_ANGLE:
            turn = " or that plus 360" if self.period > TURN else ""
            raise ValueError(
                f"cylinder {number}: firing_angle = {_degrees(firing)} degree: its throw is at top "
                f"dead centre at {_degrees(top % TURN)}{turn}"
            )

    def _check_sides(self) -> None:
        if not self.sides:
            return
        listed = ", ".join(f"{side:g}" for side in self.sides)
        if len(self.sides) != len(self.banks) or not set(self.sides) <= {1.0, -1.0}:
            raise ValueError(f"sides = {listed}: must be 1 or -1 for each of the banks")
        if self.sides[self.cylinders[0].bank] != 1.0:
            raise ValueError(f"sides = {listed}: must be 1 for the bank of cylinder 1")

    @cached_property
    def cylinder_sides(self) -> tuple[float, ...]:
        """Factor on the engine's offset of cylinders 1, 2, ... Z: see `sides`."""
        return tuple(self.sides[c.bank] if self.sides else 1.0 for c in self.cylinders)

    @cached_property
    def firing_angles(self) -> Floats:
        """Crank angle at the firing top dead centre of cylinders 1, 2, ... Z [rad]."""
        return np.array([cylinder.firing_angle for cylinder in self.cylinders])

    @cached_property
    def phases(self) -> Floats:
        """Angle to add to the engine's to get that of cylinders 1, 2, ... Z [rad]."""
        return 0.0 - self.firing_angles

    @cached_property
    def firing_order(self) -> tuple[int, ...]:
        """Numbers of the cylinders as they fire; those that fire together by their numbers."""
        order = np.argsort(self.firing_angles, kind="stable") + 1
        return tuple(int(cylinder) for cylinder in order)

    @cached_property
    def firing_intervals(self) -> Floats:
        """Angle from each firing to the next [rad], in firing order; their sum is the cycle."""
        return np.diff(np.sort(self.firing_angles), append=self.period)

    @cached_property
    def is_even(self) -> bool:
        """Whether the firings, or groups of equally many at once, are equally far apart."""
        moments = int((self.firing_intervals > SAME_ANGLE).sum())
        return symmetry(self.phases, self.period) == moments

    @cached_property
    def radius_factors(self) -> Floats:
        """Crank radius over the engine's, of cylinders 1, 2, ... Z."""
        return np.array([self.throws[cylinder.throw].radius_factor for cylinder in self.cylinders])

    def symmetry(self, weights: npt.ArrayLike | None = None) -> int:
        """How often torque repeats within the cycle: `symmetry`, with unequal radii and weights.

        `weights`, shape (Z,) or (Z, k), is what else tells cylinders apart.
        """
        marks = self.radius_factors[:, None]
        if weights is not None:
            more = np.asarray(weights, dtype=np.float64).reshape(len(self.cylinders), -1)
            marks = np.hstack([marks, more])
        return symmetry(self.phases, self.period, marks)

    def phase_sums(self, orders: npt.ArrayLike, weights: npt.ArrayLike | None = None) -> Floats:
        """Phase-vector sums of all cylinders, shape of `orders`: see `phase_sums`."""
        return phase_sums(orders, self.phases, self.period, weights)


def _degrees(angle: float | Floats | Sequence[float]) -> str:
    """Angles in degrees, as text for a message."""
    values = np.atleast_1d(np.asarray(angle, dtype=float)) / DEGREE
    return ", ".join(f"{round(float(value), 4):g}" for value in values)
