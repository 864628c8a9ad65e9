"""Balance: shaking forces and moments of any arrangement, counterweights, balance shafts.

What the inertia of the running gear does to the engine's frame at constant speed. Vectors across
the shaft are complex numbers: the real axis points outwards along cylinder 1, the imaginary one a
right angle further in the sense of rotation. At the crank angle phi a cylinder whose own crank
angle is phi + psi and whose axis lies gamma from that of cylinder 1 adds

    m r omega^2 b(phi + psi) e^(i gamma)               its reciprocating mass, b reduced, exact
    m_u r omega^2 e^(i (gamma + phi + psi + theta_T))  what is left at its crank pin

where m_u is the rotating mass less the counterweight's, both at the crank radius, and theta_T the
crank's angle at top dead centre (0 without offset). The two-mass rod has the rod's mass and centre
of gravity, so these forces are exact. A moment is the same sum, each force times its distance z
from the middle of the crank, positive away from the free end: its real part acts in the plane of
shaft and cylinder 1. The moment about the shaft is that of the torque, and not meant here.

Each order nu of the sum turns forwards and backwards, F_nu e^(i nu phi) + B_nu e^(-i nu phi): an
ellipse with the semi-axes |F| + |B| and ||F| - |B||. Counterweights change F_1 alone; a shaft that
turns backwards with the crank's speed changes B_1, a pair at twice that speed F_2 and B_2.

Sources: T. Asgari et al. (2019), eqs. 1 to 13 (one cylinder, two orders); Power units, lecture 18.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.geometry import kinematic_series, slider_crank
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount
from engine_dyn.types import Complexes, Floats

__all__ = [
    "Best",
    "Ellipse",
    "RunningGear",
    "acceleration_harmonics",
    "balance_shaft_mass",
    "best_balance",
    "counterweight_mass",
    "running_gear",
    "unbalanced_mass",
]


SAMPLES = 1024
"""Of a revolution, for harmonics: those up to half of it; the trapezoidal rule leaves rounding."""

TURN_SAMPLES = 360
"""Of a revolution, to look for the largest force."""

FINER, ROUNDS = 8, 3
"""The neighbourhood of the largest sample is sampled again, so much finer, so often; a parabola
ends it. Left of the largest force are 1e-9 of it."""

CHUNK = 2048
"""Designs whose samples exist at a time."""

_ARRAYS = (
    "crank_ratio", "offset", "crank_radius", "reciprocating_mass", "turning_mass", "shaft", "pair",
    "couple", "spacing", "bank_offset", "speed", "cylinders",
)  # fmt: skip
"""Attributes of `RunningGear` that broadcast."""

GOLDEN = 0.5 * (5.0**0.5 - 1.0)

MOST_CUTS = 60
"""Of parabolas; each is one that was not known, some ten are met."""

ENOUGH = 1e-12
"""Part of the largest square that a parabola not yet known may have more."""

CANCELLED = 1e-13
"""Share of the forces of all cylinders, each for itself, below which their sum is but rounding."""

NOTHING = 1e-9
"""Share of one cylinder's force, times the cylinders, that is rounding."""


# --- one cylinder's numbers -----------------------------------------------------------------------


def unbalanced_mass(fraction: Any, reciprocating_mass: Any, rotating_mass: Any) -> Any:
    """Mass at the crank pin that a counterweight balances [kg]: c m_1 + m_2. Asgari, eq. 9."""
    _check_fraction(fraction)
    return fraction * np.asarray(reciprocating_mass) + rotating_mass


def counterweight_mass(unbalanced: Any, crank_radius: Any, radius: Any) -> Any:
    """Counterweight [kg] whose centre of gravity lies at `radius` [m]: M R/b. Asgari, eq. 12.

    Raises
    ------
    ValueError
        For a radius that is not above 0.
    """
    _check_above_zero("radius", radius)
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
    _check_fraction(fraction)
    _check_above_zero("radius", radius)
    return (1.0 - np.asarray(fraction)) * crank_radius * reciprocating_mass / radius


def _check_fraction(fraction: Any) -> None:
    values = np.asarray(fraction, dtype=float)
    wrong = ~((values >= 0.0) & (values <= 1.0))
    if wrong.any():
        raise ValueError(f"fraction = {values[wrong].flat[0]:g}: must be from 0 to 1")


def _check_above_zero(name: str, value: Any) -> None:
    values = np.asarray(value, dtype=float)
    wrong = ~((values > 0.0) & np.isfinite(values))
    if wrong.any():
        raise ValueError(f"{name} = {values[wrong].flat[0]:g}: must be above 0")


def acceleration_harmonics(
    orders: npt.ArrayLike, crank_ratio: npt.ArrayLike, offset: npt.ArrayLike = 0.0
) -> Complexes:
    """Complex amplitudes of the reduced piston acceleration, b = Re sum c_nu e^(i nu phi).

    Parameters
    ----------
    orders : array_like
        Periods a revolution, above 0 and up to 512; what is no whole number has the amplitude 0.
    crank_ratio, offset : array_like
        As `slider_crank.acceleration`; all three broadcast.

    Returns
    -------
    ndarray
        Exact in lambda. Without offset they are real, 1 for the first order and 0 for the other
        odd ones.

    Raises
    ------
    ValueError
        For an order that is not above 0, or above 512.
    """
    nu = kinematic_series.checked_orders(orders, SAMPLES // 2)
    whole = nu == np.rint(nu)
    ratio, beside = np.broadcast_arrays(
        np.asarray(crank_ratio, dtype=float), np.asarray(offset, dtype=float)
    )
    if not beside.any():
        among = np.where(whole, nu, 1.0)
        found_here = kinematic_series.acceleration_coefficients(among, ratio)
        return np.where(whole, found_here, 0.0).astype(np.complex128)
    phi = np.arange(SAMPLES) * (2.0 * np.pi / SAMPLES)
    b = slider_crank.acceleration(phi, ratio[..., None], beside[..., None])
    found: Complexes = np.fft.rfft(b, axis=-1) * (2.0 / SAMPLES)
    place = np.where(whole, nu, 0.0).astype(np.int64)
    shape = np.broadcast_shapes(place.shape, ratio.shape)
    table = found.reshape(-1, SAMPLES // 2 + 1)
    row = np.broadcast_to(np.arange(table.shape[0]).reshape(ratio.shape), shape)
    return np.where(np.broadcast_to(whole, shape), table[row, np.broadcast_to(place, shape)], 0.0)


class Lines(NamedTuple):
    """The cylinders as lines of force, from 1 to Z.

    Attributes
    ----------
    phase : ndarray
        Angle to add to the engine's to get the cylinder's own [rad].
    direction : ndarray
        Angle of the cylinder's axis from that of cylinder 1 [rad].
    place : ndarray
        Distance from the middle of the crank, in distances of neighbouring throws [1].
    bank : ndarray
        Number of the bank less the mean of first and last: each stands one offset of the banks
        further along the shaft [1].
    mass_factor : ndarray
        Reciprocating mass over the engine's [1].
    radius : ndarray
        Crank radius over the engine's; rods are equally long [1].
    """

    phase: Floats
    direction: Floats
    place: Floats
    bank: Floats
    mass_factor: Floats
    radius: Floats


@lru_cache(maxsize=64)
def lines_of(engine: Cylinders) -> Lines:
    """Lines of force of an engine.

    Raises
    ------
    ValueError
        Where its throws are not known.
    """
    made = engine.arrangement
    if made is None:
        raise ValueError(f"{len(engine.members)} cylinders: no throws are known")
    banks, throws = np.array(made.banks), np.array([t.position for t in made.throws])
    number = np.array([c.bank for c in made.cylinders])
    direction = banks[number]
    place = throws[[c.throw for c in made.cylinders]] - 0.5 * (throws.min() + throws.max())
    return Lines(
        made.phases, direction - direction[0], place, number - 0.5 * (len(banks) - 1),
        np.array(engine.mass_factors, dtype=float), made.radius_factors,
    )  # fmt: skip


class Ellipse(NamedTuple):
    """What a vector of one order runs along.

    Attributes
    ----------
    major, minor : ndarray
        Semi-axes.
    inclination : ndarray
        Angle of the long axis from cylinder 1 [rad], above -pi/2 and up to pi/2; 0 for a circle.
    """

    major: Any
    minor: Any
    inclination: Any


# --- the running gear -----------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class RunningGear:
    """Masses in motion of engines at constant speed; arrays broadcast against each other.

    Attributes
    ----------
    crank_ratio, crank_radius : array_like
        lambda [1], r [m].
    reciprocating_mass : array_like
        Of one cylinder [kg].
    speed : array_like
        Of the crank [rad/s].
    by_count : mapping of int to Cylinders
        Cylinders of each set: of each number of them where no more differs between designs.
    cylinders : array_like of int, optional
        Which set; the only one unless given.
    offset : array_like
        Of the pin's line over the crank radius [1].
    turning_mass : array_like
        What the counterweights leave of the rotating mass of one cylinder, at the crank radius
        [kg]; negative where they also balance reciprocating mass.
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
    bank_offset : array_like
        How far each bank stands behind the one before, along the shaft [m]: for rods side by side
        on a pin, and for the two throws of a boxer's pair.

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
    shaft: Any = 0.0
    pair: Any = 0.0
    couple: Any = 0.0
    spacing: Any = np.nan
    bank_offset: Any = 0.0

    def __post_init__(self) -> None:
        """Take the only set of cylinders where none is given."""
        if self.cylinders is None:
            if len(self.by_count) != 1:
                raise ValueError("cylinders: must be given where by_count has several")
            object.__setattr__(self, "cylinders", next(iter(self.by_count)))

    # vectors over the crank angle

    def force(self, phi: Any) -> Complexes:
        """Shaking force at the crank angles `phi` [rad], N; broadcasts with the attributes."""
        return self._scaled(self._sum(phi, moment=False))

    def moment(self, phi: Any) -> Complexes:
        """Shaking moment about the middle of the crank, N m: see the module."""
        return self._scaled(self._sum(phi, moment=True))

    def reciprocating(self) -> RunningGear:
        """Return the same engine without anything but its reciprocating masses."""
        return replace(self, turning_mass=0.0, shaft=0.0, pair=0.0, couple=0.0)

    def force_of_order(self, order: int, phi: Any) -> Complexes:
        """One order of the shaking force over the crank angle, N."""
        return self._of_order(order, phi, moment=False)

    def moment_of_order(self, order: int, phi: Any) -> Complexes:
        """One order of the shaking moment over the crank angle, N m."""
        return self._of_order(order, phi, moment=True)

    # orders

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
        return _ellipse(*self.force_orders(orders), self._scaled(self._rounding(moment=False)))

    def moment_ellipse(self, orders: Any) -> Ellipse:
        """Ellipses of orders of the shaking moment, N m and rad."""
        return _ellipse(*self.moment_orders(orders), self._scaled(self._rounding(moment=True)))

    # numbers of a revolution

    def force_max(self) -> Floats:
        """Largest shaking force of a revolution, exact to 1e-9 of it, N."""
        return self._each(_largest, moment=False)

    def moment_max(self) -> Floats:
        """Largest shaking moment of a revolution, exact to 1e-9 of it, N m."""
        return self._each(_largest, moment=True)

    def force_rms(self) -> Floats:
        """Root of the mean square of the shaking force over a revolution, N."""
        return self._each(_root_mean_square, moment=False)

    def moment_rms(self) -> Floats:
        """Root of the mean square of the shaking moment over a revolution, N m."""
        return self._each(_root_mean_square, moment=True)

    # what would balance it

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
        _check_norm(norm)
        find = _best_rms if norm == "rms" else _best_peak
        gear = replace(self, turning_mass=0.0)
        return gear._each(lambda part: find(part, across_weight), moment=False)

    # how it is done: everything below is in kg m, or kg m2 for moments

    def _scaled(self, value: Any) -> Any:
        return value * np.square(np.asarray(self.speed, dtype=float))

    def _per_count(self, value: Callable[[Lines, Floats], Any], moment: bool) -> Any:
        """Take a sum over the cylinders, for each set of them, weighted with their levers."""

        def with_weights(weights: Callable[[Lines], Floats]) -> Any:
            counts = np.asarray(self.cylinders)
            total: Any = None
            for count in np.unique(counts):
                lines = lines_of(self.by_count[int(count)])
                here = value(lines, weights(lines))
                total = here if total is None else np.where(counts == count, here, total)
            return total

        if not moment:
            return with_weights(lambda lines: np.ones_like(lines.place))
        total = with_weights(lambda lines: lines.place) * self.spacing
        if np.any(self.bank_offset):
            total = total + with_weights(lambda lines: lines.bank) * self.bank_offset
        return total

    def _rounding(self, moment: bool) -> Any:
        mass = np.abs(np.asarray(self.reciprocating_mass)) * self.crank_radius
        return NOTHING * mass * self._per_count(lambda _, weight: np.abs(weight).sum(), moment)

    def _sum(self, phi: Any, moment: bool) -> Any:
        angle = np.asarray(phi, dtype=float)
        ratio, beside = np.asarray(self.crank_ratio), np.asarray(self.offset)

        def reciprocating(lines: Lines, weight: Floats) -> Any:
            total: Any = 0.0
            for psi, gamma, factor, radius, w in zip(
                lines.phase, lines.direction, lines.mass_factor, lines.radius, weight, strict=True
            ):
                b = slider_crank.acceleration(angle + psi, radius * ratio, beside / radius)
                total = total + (w * factor * radius * np.exp(1j * gamma)) * b
            return total

        total = self.crank_radius * self.reciprocating_mass * self._per_count(
            reciprocating, moment
        )  # fmt: skip
        forward, backward = np.exp(1j * angle), np.exp(-1j * angle)
        total = total + self._turning(moment) * forward
        first, second = self._shafts(moment)
        total = total + first * backward
        for amplitude, turning in zip(second, (forward**2, backward**2), strict=True):
            total = total + amplitude * turning
        return self._without_rounding(total, moment)

    def _without_rounding(self, vector: Any, moment: bool) -> Any:
        mass = np.abs(self.reciprocating_mass) + np.abs(self.turning_mass)
        weights = self._per_count(lambda _, weight: np.abs(weight).sum(), moment)
        least = CANCELLED * mass * self.crank_radius * weights
        return np.where(np.abs(vector) < least, 0.0, vector)

    def _turning(self, moment: bool) -> Any:
        """Amplitude of what turns with the crank."""
        ratio, beside = np.asarray(self.crank_ratio), np.asarray(self.offset)

        def turning(lines: Lines, weight: Floats) -> Any:
            pins = weight * lines.radius * np.exp(1j * (lines.direction + lines.phase))
            if not beside.any():
                return pins.sum()
            total: Any = 0.0
            for radius in np.unique(lines.radius):
                top = slider_crank.dead_centres(radius * ratio, beside / radius).top
                total = total + pins[lines.radius == radius].sum() * np.exp(1j * np.asarray(top))
            return total

        mass = np.asarray(self.turning_mass) * self.crank_radius
        return mass * self._per_count(turning, moment)

    def _waves(self, order: Any, moment: bool) -> tuple[Any, Any]:
        """Forward and backward amplitude of the reciprocating masses."""
        nu = np.asarray(order, dtype=float)
        ratio, beside = np.asarray(self.crank_ratio), np.asarray(self.offset)
        mass = 0.5 * np.asarray(self.crank_radius) * self.reciprocating_mass

        def turned(sense: float) -> Callable[[Lines, Floats], Any]:
            def total(lines: Lines, weight: Floats) -> Any:
                vector = np.exp(1j * (lines.direction + sense * nu[..., None] * lines.phase))
                share = weight * lines.mass_factor * lines.radius * vector
                found: Any = 0.0
                for radius in np.unique(lines.radius):
                    harmonic = acceleration_harmonics(nu, radius * ratio, beside / radius)
                    harmonic = harmonic if sense > 0.0 else np.conj(harmonic)
                    found = found + harmonic * share[..., lines.radius == radius].sum(axis=-1)
                return found

            return total

        return mass * self._per_count(turned(1.0), moment), mass * self._per_count(
            turned(-1.0), moment
        )

    def _shafts(self, moment: bool) -> tuple[Any, tuple[Any, Any]]:
        """Amplitudes of the shafts: backward first order; forward and backward second order."""
        rounding = self._rounding(moment)
        first = self.couple if moment else self.shaft
        pair = 0.0 if moment else self.pair
        against: Any = 0.0
        second: tuple[Any, Any] = (0.0, 0.0)
        if np.any(first):
            against = -np.asarray(first) * _sense(self._waves(1.0, moment)[1], rounding)
        if np.any(pair):
            forward, backward = self._waves(2.0, moment)
            second = (
                -4.0 * np.asarray(pair) * _sense(forward, rounding),
                -4.0 * np.asarray(pair) * _sense(backward, rounding),
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
        return (
            self._without_rounding(forward, moment), self._without_rounding(backward, moment)
        )  # fmt: skip

    def _of_order(self, order: int, phi: Any, moment: bool) -> Any:
        forward, backward = self._orders(float(order), moment)
        angle = order * np.asarray(phi, dtype=float)
        return self._scaled(forward * np.exp(1j * angle) + backward * np.exp(-1j * angle))

    def _each(self, value: Callable[[_Part], Floats], moment: bool) -> Floats:
        """Compute a number of every design, so many at a time."""
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
            gear = replace(self, **named)
            result[places] = value(_Part(gear, moment))
        return result.reshape(asked)[()]


class _Part:
    """Some designs, one in a row, with what is asked of their vectors."""

    def __init__(self, gear: RunningGear, moment: bool) -> None:
        self.gear, self.moment = gear, moment

    def at(self, phi: npt.NDArray[Any]) -> Complexes:
        """Vectors at angles of shape (angles,) or (designs, angles)."""
        return np.asarray(self.gear._scaled(self.gear._sum(phi, self.moment)), dtype=complex)

    def samples(self, count: int) -> Complexes:
        """Vectors at `count` angles of a revolution."""
        found = self.at(np.arange(count) * (2.0 * np.pi / count))
        return np.broadcast_to(found, (np.shape(self.gear.speed)[0], count))

    def counterweights(self, count: int) -> Complexes:
        """What a fraction of 1 adds, at the same angles."""
        gear = replace(
            self.gear, turning_mass=-np.asarray(self.gear.reciprocating_mass), shaft=0.0, pair=0.0,
            couple=0.0,
        )  # fmt: skip
        amplitude = gear._scaled(gear._turning(self.moment))
        size = np.abs(amplitude) > gear._scaled(gear._rounding(self.moment))
        phi = np.arange(count) * (2.0 * np.pi / count)
        return np.where(size, amplitude, 0.0) * np.exp(1j * phi)


def _largest(part: _Part) -> Floats:
    step = 2.0 * np.pi / TURN_SAMPLES
    square = np.abs(part.samples(TURN_SAMPLES)) ** 2
    left, right = np.roll(square, 1, axis=1), np.roll(square, -1, axis=1)
    # The highest sample may stand beside the second highest crest: parabolas tell them apart.
    crest = np.where((square >= left) & (square >= right), _top(left, square, right), -1.0)
    centre = np.argmax(crest, axis=1)[:, None] * step
    for _ in range(ROUNDS):
        step /= FINER
        angles = centre + step * np.arange(-FINER, FINER + 1)
        square = np.abs(part.at(angles)) ** 2
        place = np.argmax(square, axis=1)[:, None]
        centre = np.take_along_axis(angles, place, axis=1)
    near = np.abs(part.at(centre + step * np.array([-1.0, 0.0, 1.0]))) ** 2
    return np.sqrt(_top(near[:, 0], near[:, 1], near[:, 2]))


def _top(left: Floats, middle: Floats, right: Floats) -> Floats:
    """Top of the parabola through three points, of which the middle one is the highest."""
    bend = 2.0 * middle - left - right
    with np.errstate(divide="ignore", invalid="ignore"):
        above = (right - left) ** 2 / (8.0 * bend)
    return middle + np.where(bend > 0.0, np.minimum(above, middle), 0.0)


def _root_mean_square(part: _Part) -> Floats:
    return np.sqrt((np.abs(part.samples(TURN_SAMPLES)) ** 2).mean(axis=1))


def _sense(amplitude: Any, rounding: Any) -> Any:
    """Direction of an amplitude as a complex number of length 1; 1 where there is none."""
    size = np.abs(amplitude)
    there = size > rounding
    return np.where(there, amplitude / np.where(there, size, 1.0), 1.0)


def _ellipse(forward: Any, backward: Any, rounding: Any) -> Ellipse:
    one, other = np.abs(forward), np.abs(backward)
    turned = forward * backward
    there = (one > rounding) & (other > rounding)
    angle = 0.5 * np.angle(np.where(there, turned, 1.0))
    # Rounding must not make -90 degrees of 90.
    angle = np.where(angle <= -0.5 * np.pi + 1e-9, angle + np.pi, angle)
    return Ellipse(one + other, np.abs(one - other), angle)


# --- the best balance -----------------------------------------------------------------------------


class Best(NamedTuple):
    """What balances best.

    Attributes
    ----------
    fraction : float
        c of the reciprocating mass that counterweights balance [1].
    shaft : float
        Unbalance of the counter-rotating shaft [kg m].
    residual : float
        What is left, in the norm asked for [N].
    """

    fraction: float
    shaft: float
    residual: float


def best_balance(
    gear: RunningGear, norm: str = "rms", across_weight: float = 1.0, shaft: bool = True
) -> Best:
    """Find the counterweights, and the counter-rotating shaft, that leave least of the force.

    Parameters
    ----------
    gear : RunningGear
        One design. Its rotating masses count as balanced; its pair of second order stays.
    norm : str
        "rms" or "peak", over a revolution.
    across_weight : float
        Factor on the component across cylinder 1.
    shaft : bool
        Look for a shaft as well; else that of `gear` stays.

    Raises
    ------
    ValueError
        For an unknown norm, or more than one design.
    """
    _check_norm(norm)
    one = replace(gear, turning_mass=0.0, shaft=0.0 if shaft else gear.shaft)
    part = _Part(_single(one), moment=False)
    count = 4 * TURN_SAMPLES
    rest, weights = part.samples(count), part.counterweights(count)
    against, _ = replace(part.gear, shaft=1.0)._shafts(moment=False)
    turning = np.exp(-1j * np.arange(count) * (2.0 * np.pi / count))
    shafts = np.asarray(part.gear._scaled(against)) * turning

    def left(fraction: Floats, unbalance: Floats) -> Floats:
        vector = rest + fraction[:, None] * weights + unbalance[:, None] * shafts
        return _norm(vector, norm, across_weight)

    most = 2.0 * float(np.max(part.gear.shaft_required())) if shaft else 0.0

    def best_shaft(fraction: Floats) -> Floats:
        if most == 0.0:
            return np.zeros_like(fraction)
        return _golden(lambda s: left(fraction, s), 0.0, most, len(fraction))

    if not np.any(weights):
        fraction = np.zeros(1)  # counterweights cancel: any fraction is as good
    else:
        fraction = _golden(lambda c: left(c, best_shaft(c)), 0.0, 1.0, 1)
    unbalance = best_shaft(fraction)
    kept = unbalance if shaft else np.broadcast_to(np.asarray(gear.shaft, dtype=float), (1,))
    return Best(float(fraction[0]), float(kept[0]), float(left(fraction, unbalance)[0]))


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
    _check_above_zero("crank_radius", crank_radius)
    _check_above_zero("speed", speed)
    if "spacing" in more:
        _check_above_zero("spacing", more["spacing"])
    mass = np.asarray(reciprocating_mass, dtype=float)
    if not (mass >= 0.0).all():
        raise ValueError(f"reciprocating_mass = {mass.min():g}: must be 0 or more")
    lines_of(cylinders)
    return RunningGear(
        crank_ratio, crank_radius, reciprocating_mass, speed,
        {len(cylinders.members): cylinders}, **more,
    )  # fmt: skip


def _check_norm(norm: str) -> None:
    if norm not in ("rms", "peak"):
        raise ValueError(f"norm = {norm!r}: must be 'rms' or 'peak'")


def _single(gear: RunningGear) -> RunningGear:
    columns: dict[str, Any] = {
        name: np.asarray(getattr(gear, name)).reshape(-1, 1) for name in _ARRAYS
    }
    for name, column in columns.items():
        if column.size != 1:
            raise ValueError(f"{name}: {column.size} values; must be one design")
    return replace(gear, **columns)


def _norm(vector: Complexes, norm: str, across_weight: float) -> Floats:
    square = vector.real**2 + across_weight**2 * vector.imag**2
    return np.sqrt(square.mean(axis=1) if norm == "rms" else square.max(axis=1))


def _best_rms(part: _Part, across_weight: float) -> Floats:
    rest, weights = part.samples(TURN_SAMPLES), part.counterweights(TURN_SAMPLES)

    def product(one: Complexes, other: Complexes) -> Floats:
        return np.mean(
            one.real * other.real + across_weight**2 * one.imag * other.imag, axis=1
        )  # fmt: skip

    size = product(weights, weights)
    there = size > 0.0
    fraction = -product(rest, weights) / np.where(there, size, 1.0)
    return np.where(there, np.clip(fraction, 0.0, 1.0), np.nan)


def _best_peak(part: _Part, across_weight: float) -> Floats:
    """Fraction that leaves the least largest force: where the highest of parabolas is lowest.

    At each angle |R + c G|^2 is a parabola in c. From the highest ones at both ends of a bracket,
    the lowest point of the two is what the bracket may have at best; there another one is higher,
    or that is it (cutting planes, of parabolas). Each step finds one more of finitely many.
    """
    count = 2 * TURN_SAMPLES
    rest, weights = part.samples(count), part.counterweights(count)
    parabolas = np.stack([
        one.real * other.real + across_weight**2 * (one.imag * other.imag)
        for one, other in ((rest, rest), (rest, weights), (weights, weights))
    ])  # fmt: skip
    there = parabolas[2].any(axis=1)
    fraction = np.full(len(rest), np.nan)
    active = np.flatnonzero(there)
    ends = np.zeros(active.size), np.ones(active.size)
    low, high = (_highest(parabolas[:, active], end) for end in ends)
    below, above = ends
    for _ in range(MOST_CUTS):
        if not active.size:
            break
        here = np.clip(_lowest_of_two(low, high), below, above)
        known = np.maximum(_value(low, here), _value(high, here))
        new = _highest(parabolas[:, active], here)
        fraction[active] = here
        go = _value(new, here) > known * (1.0 + ENOUGH)
        rises = new[1] + here * new[2] > 0.0
        low, high = np.where(rises, low, new), np.where(rises, new, high)
        below, above = np.where(rises, below, here), np.where(rises, here, above)
        active, low, high = active[go], low[:, go], high[:, go]
        below, above = below[go], above[go]
    return fraction


def _highest(parabolas: Floats, fraction: Floats) -> Floats:
    """Parabolas (square, half its slope, bend at 0) that are highest at a fraction, by design."""
    place = np.argmax(_value(parabolas, fraction[:, None]), axis=1)
    return np.asarray(np.take_along_axis(parabolas, place[None, :, None], axis=2)[..., 0])


def _value(parabola: Floats, fraction: Floats) -> Floats:
    square, slope, bend = parabola
    return np.asarray(square + fraction * (2.0 * slope + fraction * bend))


def _lowest_of_two(one: Floats, other: Floats) -> Floats:
    """Where the higher of two parabolas is lowest: at the foot of one of them, or where they meet.

    They meet once between their feet, as each is higher at the foot of the other.
    """
    foot, foot_of_other = (-p[1] / np.where(p[2] > 0.0, p[2], np.inf) for p in (one, other))
    square, slope, bend = one - other
    root = np.sqrt(np.maximum(slope * slope - bend * square, 0.0))
    # Both roots of bend c^2 + 2 slope c + square, without the difference of near numbers.
    turned = -(slope + np.copysign(root, slope))
    with np.errstate(divide="ignore", invalid="ignore"):
        roots = square / turned, turned / bend
    left, right = np.minimum(foot, foot_of_other), np.maximum(foot, foot_of_other)
    meets = np.where((roots[0] >= left) & (roots[0] <= right), roots[0], roots[1])
    meets = np.where(np.isfinite(meets), meets, 0.5 * (left + right))
    higher = _value(one, foot) >= _value(other, foot)
    other_higher = _value(other, foot_of_other) >= _value(one, foot_of_other)
    return np.where(higher, foot, np.where(other_higher, foot_of_other, meets))


def _golden(value: Callable[[Floats], Floats], low: float, high: float, count: int) -> Floats:
    """Where convex functions, one for each of `count` designs, are least, to 1e-6 of the range."""
    below, above = np.full(count, low), np.full(count, high)
    for _ in range(32):
        width = above - below
        one, other = above - GOLDEN * width, below + GOLDEN * width
        falls = value(one) > value(other)
        below, above = np.where(falls, one, below), np.where(falls, above, other)
    return 0.5 * (below + above)
