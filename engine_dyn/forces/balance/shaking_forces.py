"""Shaking forces and moments of the running gear: over the crank angle, by orders, and at most.

The equations stand in the package's description. Besides, masses of counterweights and of the one
counter-rotating shaft, for one cylinder, and whether a moment hangs on the distance of the banks.

Source: T. Asgari et al. (2019), eqs. 9, 12 and 13.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from engine_dyn.forces.balance.lines import (
    Ellipse,
    Lines,
    acceleration_harmonics,
    default_bank_offset,
    direction_of,
    ellipse_of,
    lines_of,
)
from engine_dyn.forces.balance.revolution import (
    MOTION,
    TURN_SAMPLES,
    forces_at,
    largest_of,
    least_mean_square,
    least_peak,
    lines_array,
    mean_squares_of,
    turns,
)
from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.arrangement import SAME_ANGLE, TURN
from engine_dyn.geometry.cylinder_means import value_of_sets
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount
from engine_dyn.given_numbers import check_above_zero
from engine_dyn.types import Complexes, Floats, Integers

CHUNK = 2048  # Largest number of designs whose samples are held at a time

_ARRAYS = (
    "crank_ratio", "offset", "crank_radius", "reciprocating_mass", "turning_mass",
    "throw_turning_mass", "shaft", "pair", "couple", "spacing", "bank_offset", "speed", "cylinders",
    "webs", "web_couple",
)  # fmt: skip
"""Attributes of `RunningGear` that broadcast against each other."""


@dataclass(frozen=True, eq=False)
class RunningGear:
    """Masses in motion of engines at constant speed; arrays broadcast against each other.

    Attributes
    ----------
    crank_ratio, crank_radius : array_like
        lambda [1], r [m].
    reciprocating_mass : array_like
        Reciprocating mass of one cylinder [kg].
    speed : array_like
        Speed of the crank [rad/s].
    by_count : mapping of int to Cylinders
        Cylinders of each set: of each number of them where no more differs between designs.
    cylinders : array_like of int, optional
        Which set; the only one unless given.
    offset : array_like
        Offset of the pin's line over the crank radius [1].
    turning_mass : array_like
        Rotating mass of one cylinder that the counterweights leave, at the crank radius
        [kg]; negative where they also balance reciprocating mass.
    throw_turning_mass : array_like
        Mass of one throw that they leave, on which rods may share the pin [kg].
    shaft : array_like
        Unbalance (mass times radius) of a shaft that turns backwards with the crank's speed, in
        the middle of the engine, against the backward first order [kg m].
    pair : array_like
        Unbalance of each of two shafts at twice the speed, one turning forwards and one backwards,
        against the second order [kg m].
    couple : array_like
        Unbalance times distance of two opposed weights on a shaft that turns backwards with the
        crank's speed, against the backward moment of first order [kg m2].
    spacing : array_like
        Distance of neighbouring throws [m]; for moments.
    bank_offset : array_like, optional
        How far each bank stands behind the one before, along the shaft [m]: for rods side by side
        on a pin, and for the two throws of a boxer's pair. See `lines.default_bank_offset`.
    webs, web_couple : array_like
        Unbalance of the counterweights on the webs [kg m], and that times the distance from the
        middle of the crank [kg m2], both complex: see `engine_dyn.quantities.features.web_weights`.

    Notes
    -----
    Balance shafts stand as they should: opposite to the order that they are against. Where that
    vanishes, their weights point away from cylinder 1 at phi = 0.
    """

    crank_ratio: Any
    crank_radius: Any
    reciprocating_mass: Any
    speed: Any
    by_count: CylindersByCount
    cylinders: Any = None
    offset: Any = 0.0
    turning_mass: Any = 0.0
    throw_turning_mass: Any = 0.0
    shaft: Any = 0.0
    pair: Any = 0.0
    couple: Any = 0.0
    spacing: Any = np.nan
    bank_offset: Any = None
    webs: Any = 0.0
    web_couple: Any = 0.0

    def __post_init__(self) -> None:
        """Take the only set of cylinders, and the usual distance of banks, where none is given."""
        if self.cylinders is None:
            if len(self.by_count) != 1:
                raise ValueError("cylinders: must be given where by_count has several")
            object.__setattr__(self, "cylinders", next(iter(self.by_count)))
        if self.bank_offset is None:
            usual = default_bank_offset(self.spacing, self.cylinders, self.by_count)
            object.__setattr__(self, "bank_offset", usual)

    # Vectors over the crank angle.

    def force(self, phi: Any) -> Complexes:
        """Shaking force at the crank angles `phi` [rad], N; broadcasts with the attributes."""
        return self._scaled(self._sum(phi, moment=False))

    def moment(self, phi: Any) -> Complexes:
        """Shaking moment about the middle of the crank, N m: see the module."""
        return self._scaled(self._sum(phi, moment=True))

    def reciprocating(self) -> RunningGear:
        """Return the same engine without anything but its reciprocating masses."""
        return replace(
            self, turning_mass=0.0, throw_turning_mass=0.0, shaft=0.0, pair=0.0, couple=0.0,
            webs=0.0, web_couple=0.0,
        )  # fmt: skip

    def force_of_order(self, order: int, phi: Any) -> Complexes:
        """One order of the shaking force over the crank angle, N."""
        return self._of_order(order, phi, moment=False)

    def moment_of_order(self, order: int, phi: Any) -> Complexes:
        """One order of the shaking moment over the crank angle, N m."""
        return self._of_order(order, phi, moment=True)

    # Single orders.

    def force_orders(self, orders: Any) -> tuple[Complexes, Complexes]:
        """Forward and backward amplitude of orders of the shaking force, N; `orders` broadcasts."""
        forward, backward = self._orders(orders, moment=False)
        return self._scaled(forward), self._scaled(backward)

    def moment_orders(self, orders: Any) -> tuple[Complexes, Complexes]:
        """Forward and backward amplitude of orders of the shaking moment, N m."""
        forward, backward = self._orders(orders, moment=True)
        return self._scaled(forward), self._scaled(backward)

    def force_ellipse(self, orders: Any) -> Ellipse:
        """Ellipses of orders of the shaking force, N and rad."""
        return ellipse_of(*self.force_orders(orders), self._scaled(self._rounding(moment=False)))

    def moment_ellipse(self, orders: Any) -> Ellipse:
        """Ellipses of orders of the shaking moment, N m and rad."""
        return ellipse_of(*self.moment_orders(orders), self._scaled(self._rounding(moment=True)))

    # Results for a revolution.

    def force_max(self) -> Floats:
        """Largest shaking force of a revolution, exact to 1e-9 of it, N."""
        return self._each(lambda gear: gear._of_turn(largest_of, moment=False))

    def moment_max(self) -> Floats:
        """Largest shaking moment of a revolution, exact to 1e-9 of it, N m."""
        return self._each(lambda gear: gear._of_turn(largest_of, moment=True))

    def force_rms(self) -> Floats:
        """Root of the mean square of the shaking force over a revolution, N."""
        return self._each(lambda gear: gear._of_turn(mean_squares_of, moment=False, root=True))

    def moment_rms(self) -> Floats:
        """Root of the mean square of the shaking moment over a revolution, N m."""
        return self._each(lambda gear: gear._of_turn(mean_squares_of, moment=True, root=True))

    def turning_force(self) -> Any:
        """Centrifugal force of all that turns with the crank, N."""
        return self._scaled(np.abs(self._without_rounding(self._turning(moment=False), False)))

    def turning_moment(self) -> Any:
        """Moment about the middle of the crank of all that turns with it, N m."""
        return self._scaled(np.abs(self._without_rounding(self._turning(moment=True), True)))

    # Counterweights that would balance the force.

    def shaft_required(self) -> Floats:
        """Unbalance of the shaft that cancels the backward first order of the force [kg m]."""
        _, backward = self.reciprocating()._orders(1.0, moment=False)
        return np.abs(backward)

    def pair_required(self) -> Floats:
        """Unbalance of each shaft of the pair that leaves least of the second order [kg m].

        Nothing is left where forward and backward second order are equal: engines in line, and
        others with forces along one line.
        """
        forward, backward = self.reciprocating()._orders(2.0, moment=False)
        return 0.125 * (np.abs(forward) + np.abs(backward))

    def couple_required(self) -> Floats:
        """Unbalance times distance that cancels the backward moment of first order [kg m2]."""
        _, backward = self.reciprocating()._orders(1.0, moment=True)
        return np.abs(backward)

    def best_fraction(self, norm: str = "rms", across_weight: float = 1.0) -> Floats:
        """Fraction c of the reciprocating mass that counterweights best balance, 0 to 1.

        The shafts stay, the rotating masses are balanced; the force alone counts, exactly.

        Parameters
        ----------
        norm : str
            "rms": least mean square over a revolution, in closed form. "peak": least largest
            force of 720 samples (c is exact to 1e-4).
        across_weight : float
            Factor on the component across cylinder 1: how much worse it is than that along it.

        Returns
        -------
        ndarray
            NaN where counterweights do not change the force, since those of all throws cancel.
        """
        if norm not in ("rms", "peak"):
            raise ValueError(f"norm = {norm!r}: must be 'rms' or 'peak'")
        without = replace(self, turning_mass=0.0, throw_turning_mass=0.0, webs=0.0)
        if norm == "peak":
            return without._each(lambda gear: gear._least_peak(across_weight))
        forward, backward = without._orders(1.0, moment=False)
        weights = without._counterweights()
        shape = np.broadcast_shapes(*(np.shape(getattr(self, name)) for name in _ARRAYS))
        best = least_mean_square(forward, backward, weights, across_weight)
        return np.array(np.broadcast_to(best, shape))[()]

    # Implementation: all quantities below are in kg m, or kg m2 for moments.

    def _scaled(self, value: Any) -> Any:
        return value * np.square(np.asarray(self.speed, dtype=float))

    def _per_count(self, value: Callable[[Lines, Floats], Any], moment: bool) -> Any:
        """Take a sum over the cylinders, weighted with their levers, for each set of cylinders."""

        def with_weights(weights: Callable[[Lines], Floats]) -> Any:
            def of_engine(engine: Cylinders) -> Any:
                lines = lines_of(engine)
                return value(lines, weights(lines))

            return value_of_sets(self.cylinders, self.by_count, of_engine)

        if not moment:
            return with_weights(lambda lines: np.ones_like(lines.place))
        total = with_weights(lambda lines: lines.place) * self.spacing
        if np.any(self.bank_offset):
            total = total + with_weights(lambda lines: lines.bank) * self.bank_offset
        return total

    def _rounding(self, moment: bool) -> Any:
        mass = np.abs(np.asarray(self.reciprocating_mass)) * self.crank_radius
        # A sum below 1e-9 of the sum of all cylinders' sizes is rounding.
        return 1e-9 * mass * self._per_count(lambda _, weight: np.abs(weight).sum(), moment)

    def _sum(self, phi: Any, moment: bool) -> Any:
        angle = np.asarray(phi, dtype=float)
        ratio, offset_ratio = np.asarray(self.crank_ratio), np.asarray(self.offset)

        def reciprocating(lines: Lines, weight: Floats) -> Any:
            total: Any = 0.0
            for psi, gamma, factor, radius, side, w in zip(
                lines.phase, lines.direction, lines.mass_factor, lines.radius, lines.side, weight,
                strict=True,
            ):  # fmt: skip
                own = radius * ratio, side * offset_ratio / radius
                b = slider_crank.acceleration(angle + psi, *own)
                total = total + (w * factor * radius * np.exp(1j * gamma)) * b
            return total

        total = self.crank_radius * self.reciprocating_mass * self._per_count(reciprocating, moment)
        forward, backward = np.exp(1j * angle), np.exp(-1j * angle)
        total = total + self._turning(moment) * forward
        first, second = self._shafts(moment)
        total = total + first * backward
        for amplitude, turning in zip(second, (forward**2, backward**2), strict=True):
            total = total + amplitude * turning
        return self._without_rounding(total, moment)

    def _without_rounding(self, vector: Any, moment: bool) -> Any:
        return np.where(np.abs(vector) < self._least(moment), 0.0, vector)

    def _least(self, moment: bool) -> Any:
        """Size below which a sum over the cylinders is rounding."""
        mass = np.abs(self.reciprocating_mass) + np.abs(self.turning_mass)
        mass = mass + np.abs(self.throw_turning_mass)
        weights = self._per_count(lambda _, weight: np.abs(weight).sum(), moment)
        of_webs = np.abs(self.web_couple if moment else self.webs)
        # A vector sum below 1e-13 of the sum of all sizes is rounding.
        return 1e-13 * (mass * self.crank_radius * weights + of_webs)

    def _turning(self, moment: bool) -> Any:
        """Amplitude of the force or moment of the masses that turn with the crank."""
        ratio, offset_ratio = np.asarray(self.crank_ratio), np.asarray(self.offset)

        def turning(lines: Lines, weight: Floats) -> Any:
            pins = weight * lines.radius * np.exp(1j * (lines.direction + lines.phase))
            if not offset_ratio.any():
                return pins.sum()
            total: Any = 0.0
            for *own, alike in lines.kinds(ratio, offset_ratio):
                top = slider_crank.dead_centres(*own).top
                total = total + pins[alike].sum() * np.exp(1j * np.asarray(top))
            return total

        def throws(lines: Lines, weight: Floats) -> Any:
            return turning(lines, weight * lines.throw_share)

        rods = np.asarray(self.turning_mass) * self._per_count(turning, moment)
        if np.any(self.throw_turning_mass):
            rods = rods + np.asarray(self.throw_turning_mass) * self._per_count(throws, moment)
        return rods * self.crank_radius + (self.web_couple if moment else self.webs)

    def _waves(self, order: Any, moment: bool) -> tuple[Any, Any]:
        """Forward and backward amplitude of the reciprocating masses."""
        nu = np.asarray(order, dtype=float)
        ratio, offset_ratio = np.asarray(self.crank_ratio), np.asarray(self.offset)
        mass = 0.5 * np.asarray(self.crank_radius) * self.reciprocating_mass

        def wave(sense: float) -> Callable[[Lines, Floats], Any]:
            def total(lines: Lines, weight: Floats) -> Any:
                vector = np.exp(1j * (lines.direction + sense * nu[..., None] * lines.phase))
                share = weight * lines.mass_factor * lines.radius * vector
                sum_of_counts: Any = 0.0
                for *own, alike in lines.kinds(ratio, offset_ratio):
                    harmonic = acceleration_harmonics(nu, *own)
                    harmonic = harmonic if sense > 0.0 else np.conj(harmonic)
                    sum_of_counts = sum_of_counts + harmonic * share[..., alike].sum(axis=-1)
                return sum_of_counts

            return total

        forward, backward = (self._per_count(wave(sense), moment) for sense in (1.0, -1.0))
        return mass * forward, mass * backward

    def _shafts(self, moment: bool) -> tuple[Any, tuple[Any, Any]]:
        """Amplitudes of balance shafts: backward first order; forward and backward second order."""
        rounding = self._rounding(moment)
        first = self.couple if moment else self.shaft
        pair = 0.0 if moment else self.pair
        against: Any = 0.0
        second: tuple[Any, Any] = (0.0, 0.0)
        if np.any(first):
            against = -np.asarray(first) * direction_of(self._waves(1.0, moment)[1], rounding)
        if np.any(pair):
            forward, backward = self._waves(2.0, moment)
            second = (
                -4.0 * np.asarray(pair) * direction_of(forward, rounding),
                -4.0 * np.asarray(pair) * direction_of(backward, rounding),
            )
        return against, second

    def _orders(self, orders: Any, moment: bool) -> tuple[Any, Any]:
        nu = np.asarray(orders, dtype=float)
        forward, backward = self._waves(nu, moment)
        first, second = self._shafts(moment)
        forward = forward + np.where(nu == 1.0, self._turning(moment), 0.0)
        forward = forward + np.where(nu == 2.0, second[0], 0.0)
        backward = backward + np.where(nu == 1.0, first, 0.0)
        backward = backward + np.where(nu == 2.0, second[1], 0.0)
        return (self._without_rounding(forward, moment), self._without_rounding(backward, moment))

    def _of_order(self, order: int, phi: Any, moment: bool) -> Any:
        forward, backward = self._orders(float(order), moment)
        angle = order * np.asarray(phi, dtype=float)
        return self._scaled(forward * np.exp(1j * angle) + backward * np.exp(-1j * angle))

    def _each(self, value: Callable[[RunningGear], Floats]) -> Floats:
        """Compute a number for each design; `value` gets CHUNK designs at a time, as rows."""
        given = [np.asarray(getattr(self, name)) for name in _ARRAYS]
        asked = np.broadcast_shapes(*(array.shape for array in given))
        shape = asked or (1,)
        spread = [np.broadcast_to(array, shape) for array in given]
        result = np.empty(shape)
        size = result.size
        for begin in range(0, size, CHUNK):
            places = np.unravel_index(np.arange(begin, min(begin + CHUNK, size)), shape)
            columns = [array[places].reshape(-1, 1) for array in spread]
            named: dict[str, Any] = dict(zip(_ARRAYS, columns, strict=True))
            result[places] = value(replace(self, **named))
        return result.reshape(asked)[()]

    def _of_turn(self, fill: Any, *, moment: bool, root: bool = False) -> Floats:
        """Number (or its root) that a kernel finds of the vectors of each design of a column."""
        numbers = np.empty(np.shape(self.speed)[0])
        for designs, motion, lines in self._engines(moment):
            result = np.empty(designs.size)
            fill(motion, lines, turns(TURN_SAMPLES), result)
            numbers[designs] = np.sqrt(result) if root else result
        return np.asarray(self._scaled(numbers[:, None])[:, 0])

    def _least_peak(self, across_weight: float) -> Floats:
        """Balanced fraction of the smallest peak force, for each design of a column."""
        best, turn = np.empty(np.shape(self.speed)[0]), turns(2 * TURN_SAMPLES)
        weights = np.broadcast_to(self._counterweights(), (best.size, 1))[:, 0]
        for designs, motion, lines in self._engines(moment=False):
            x, y = np.empty((2, designs.size, turn.shape[1]))
            forces_at(motion, lines, turn, x, y)
            best[designs] = least_peak(x, y, weights[designs], turn, across_weight)
        return best

    def _engines(self, moment: bool) -> Iterator[tuple[Integers, Floats, Floats]]:
        """Designs of a column, one engine after the other: places, numbers and lines of force."""
        first, second = self._shafts(moment)
        waves = (self._turning(moment), first, *second)
        numbers = (
            self.crank_ratio, self.offset, np.asarray(self.crank_radius) * self.reciprocating_mass,
            self.spacing if moment else 1.0, self.bank_offset if moment else 0.0,
            self._least(moment), *(part(wave) for wave in waves for part in (np.real, np.imag)),
        )  # fmt: skip
        counts = np.asarray(self.cylinders)[:, 0]
        motion = np.empty((MOTION, counts.size))
        for row, values in zip(motion, numbers, strict=True):
            row[:] = np.broadcast_to(values, (counts.size, 1))[:, 0]
        for count in np.unique(counts):
            designs = np.flatnonzero(counts == count)
            lines = lines_array(lines_of(self.by_count[int(count)]), moment=moment)
            yield designs, np.ascontiguousarray(motion[:, designs]), lines

    def _counterweights(self) -> Any:
        """Force that a balanced fraction of 1 adds; 0 where the forces of all throws cancel."""
        gear = replace(
            self, turning_mass=-np.asarray(self.reciprocating_mass), throw_turning_mass=0.0,
            webs=0.0,
        )  # fmt: skip
        amplitude = gear._turning(moment=False)
        return np.where(np.abs(amplitude) > gear._rounding(moment=False), amplitude, 0.0)


def running_gear(
    cylinders: Cylinders, crank_ratio: Any, crank_radius: Any, reciprocating_mass: Any, speed: Any,
    **more: Any,
) -> RunningGear:  # fmt: skip
    """Return the running gear of one engine's cylinders; `more` as `RunningGear`.

    Raises
    ------
    ValueError
        For a radius, speed or spacing that is not above 0, negative masses.
    """
    check_above_zero(crank_radius=crank_radius, speed=speed)
    if "spacing" in more:
        check_above_zero(spacing=more["spacing"])
    mass = np.asarray(reciprocating_mass, dtype=float)
    if not (mass >= 0.0).all():
        raise ValueError(f"reciprocating_mass = {mass.min():g}: must be 0 or more")
    lines_of(cylinders)
    return RunningGear(
        crank_ratio, crank_radius, reciprocating_mass, speed,
        {len(cylinders.members): cylinders}, **more,
    )  # fmt: skip


def unbalanced_mass(fraction: Any, reciprocating_mass: Any, rotating_mass: Any) -> Any:
    """Mass at the crank pin that a counterweight balances [kg]: c m_1 + m_2. Asgari, eq. 9."""
    check_fraction(fraction)
    return fraction * np.asarray(reciprocating_mass) + rotating_mass


def counterweight_mass(unbalanced: Any, crank_radius: Any, radius: Any) -> Any:
    """Counterweight [kg] whose centre of gravity lies at `radius` [m]: M R/b. Asgari, eq. 12.

    Raises
    ------
    ValueError
        For a radius that is not above 0.
    """
    check_above_zero(radius=radius)
    return np.asarray(unbalanced) * crank_radius / radius


def balance_shaft_mass(
    fraction: Any, reciprocating_mass: Any, crank_radius: Any, radius: Any
) -> Any:
    """Mass [kg] of the one counter-rotating shaft of Asgari, eq. 13: (1 - c) R m / R_shaft.

    For one cylinder it cancels the first order along the cylinder whatever c is, and leaves
    (1 - 2 c) m R omega^2 sin(phi) across it: both vanish only at c = 0.5.

    Raises
    ------
    ValueError
        For a radius that is not above 0, or a fraction outside 0 to 1.
    """
    check_fraction(fraction)
    check_above_zero(radius=radius)
    return (1.0 - np.asarray(fraction)) * crank_radius * reciprocating_mass / radius


def check_fraction(fraction: Any) -> None:
    """Refuse fractions outside 0 to 1, with a ValueError."""
    values = np.asarray(fraction, dtype=float)
    wrong = ~((values >= 0.0) & (values <= 1.0))
    if wrong.any():
        raise ValueError(f"fraction = {values[wrong].flat[0]:g}: must be from 0 to 1")


@lru_cache(maxsize=256)
def hangs_on_bank_offset(engine: Cylinders, order: int | None = None) -> bool:
    """Whether an engine's moment is nothing but that of the distance of its banks.

    Without it the moment would be 0, however far the throws are apart. Rods of a star work in one
    plane.

    Parameters
    ----------
    engine : Cylinders
        With known throws.
    order : int, optional
        One order of the moment; otherwise the whole.
    """
    made = engine.arrangement
    if made is None or len(made.banks) == 1 or _is_star(made.banks):
        return False

    def moment(spacing: float, bank_offset: float) -> float:
        gear = running_gear(engine, 0.25, 1.0, 1.0, 1.0, spacing=spacing, bank_offset=bank_offset)
        return float(gear.moment_max() if order is None else gear.moment_ellipse(order).major)

    # A moment below 1e-3 of one cylinder's inertia force times the distance of throws counts as
    # zero: V12 engines keep 3e-4 of sixth order.
    return moment(1.0, 0.0) < 1e-3 < moment(1e-12, 1.0)


def _is_star(banks: tuple[float, ...]) -> bool:
    angles = np.sort(np.remainder(banks, TURN))
    gaps = np.diff(angles, append=angles[0] + TURN)
    return len(banks) > 2 and bool((np.abs(gaps - TURN / len(banks)) < SAME_ANGLE).all())
