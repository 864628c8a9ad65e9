r"""Reduction of rod and crank throw to two masses; inertia of the running gear.

Complex harmonics of the reduced piston velocity, with any offset, for arrays of designs.

    v(phi) = c/(r omega) = sum_m v_m exp(i m phi),  v_-m = conj(v_m),  v_0 = 0

by the discrete Fourier transform of equally spaced samples, docs/method.md (9). The rod's angle has
its singularities where sin(theta) = e/r +- 1/lambda, so that v_m falls off as rho^-m at least, with
s = 1/lambda - |e/r| and rho = s + sqrt(s^2 - 1). A design has as many harmonics as bring that to
rounding; how many hangs on the design alone. The acceleration is the slope of v, b_m = i m v_m.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.compilation import kernel
from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.slider_crank import (
    offset_velocity_at,
    sine_of_top,
    sum_of_angles,
    velocity,
)
from engine_dyn.types import Floats, Integers


def rod_mass_at_piston(rod_mass: Any, rod_centre_of_gravity: Any, rod_length: Any) -> Any:
    """Part of the rod's mass that reciprocates with the piston pin [kg].

    `rod_centre_of_gravity` is the distance from the big end [m]. Two conditions: same mass, same
    centre of gravity. docs/method.md (19); Kakaitsas (2015), eq. 2.9.
    """
    return rod_mass * rod_centre_of_gravity / rod_length


def rod_mass_at_crank(rod_mass: Any, rod_centre_of_gravity: Any, rod_length: Any) -> Any:
    """Part of the rod's mass that turns with the crank pin [kg].

    docs/method.md (19); Kakaitsas (2015), eq. 2.9.
    """
    return rod_mass * (1.0 - rod_centre_of_gravity / rod_length)


def reciprocating_mass(
    piston_mass: Any, rod_mass: Any, rod_centre_of_gravity: Any, rod_length: Any
) -> Any:
    """Piston with pin and rings plus the rod's reciprocating part [kg].

    docs/method.md (19); Kakaitsas (2015), eq. 2.10. With the rod's mass and the distance of its
    centre of gravity from the big end kept, the split follows the rod's length (Kakaitsas, section
    5.2.3).
    """
    return piston_mass + rod_mass_at_piston(rod_mass, rod_centre_of_gravity, rod_length)


def rotating_mass(
    crank_mass: Any, rod_mass: Any, rod_centre_of_gravity: Any, rod_length: Any,
    throws_per_cylinder: Any = 1.0,
) -> Any:  # fmt: skip
    """Mass of one cylinder that turns, at the crank radius [kg]: throw and the rod's turning part.

    Where rods share a pin, a cylinder has its share of the throw: `throws_per_cylinder`.
    docs/method.md (19); Kakaitsas (2015), eq. 2.11, with a throw for each cylinder.
    """
    rod = rod_mass_at_crank(rod_mass, rod_centre_of_gravity, rod_length)
    return throws_per_cylinder * crank_mass + rod


def crank_mass_at_pin(throw_mass: Any, throw_radius: Any, crank_radius: Any) -> Any:
    """Throw of given mass and centre of gravity, reduced to the crank radius [kg].

    The centrifugal force is the same: docs/method.md section 3.1; Kakaitsas (2015), eq. 2.15.
    """
    return throw_mass * throw_radius / crank_radius


def mean_square_velocity(crank_ratio: npt.ArrayLike, offset: npt.ArrayLike = 0.0) -> Any:
    """Mean of (c/(r omega))^2 over a revolution [1], for any shape of `crank_ratio`.

    `offset` is that of the piston pin's line over the crank radius, and broadcasts.

    The term of docs/method.md (23); exact to rounding up to a crank ratio of 0.996.

    Raises
    ------
    ValueError
        If a crank ratio lies outside (0, 1), or an offset does not let the crank turn.
    """
    slider_crank.dead_centres(crank_ratio, offset)  # raises for cranks that cannot turn
    return mean_square(crank_ratio, offset)[()]


def inertia_of_parts(
    engine_inertia: Any, auxiliary_inertia: Any, flywheel_inertia: Any, load_inertia: Any,
    gear_ratio: Any = 1.0,
) -> Any:  # fmt: skip
    """Inertia of engine and load at the crank [kg m2]: engine + auxiliaries + flywheel + i^2 load.

    docs/method.md (23); Kakaitsas (2015), eqs. 3.1 and 3.2. The gear ratio i is the load's speed
    over the crank's, and the load's inertia is that at its own shaft: the kinetic energy is equal.
    """
    return engine_inertia + auxiliary_inertia + flywheel_inertia + gear_ratio**2 * load_inertia


def engine_inertia(
    reciprocating_mass: Any,
    rotating_mass: Any,
    crank_radius: Any,
    crank_ratio: Any,
    cylinders: Any,
    offset: Any = 0.0,
) -> Any:
    """Cycle mean of the running gear's inertia [kg m2]: Z (m r^2 mean (c/(r omega))^2 + m_r r^2).

    docs/method.md (23); Kakaitsas (2015), eq. 3.2, without the auxiliaries. The reciprocating part
    is its mean, also over cylinders of unequal mass. `offset` is over the crank radius.
    """
    reciprocating = reciprocating_mass * mean_square_velocity(crank_ratio, offset)
    return cylinders * crank_radius**2 * (reciprocating + rotating_mass)


HIGHEST = (24, 96, 384)
"""Highest orders of the velocity's series: they suffice up to crank ratios of 0.45, 0.93 and
0.996 without offset. Above, the last neglects less than rho^-384."""

AT_ONCE = 4096  # Number of designs whose harmonics are held at the same time


def by_highest_order(crank_ratio: Floats, offset: Floats) -> Iterator[tuple[int, Integers]]:
    """Numbers of harmonics, and the places of the designs that need so many.

    `crank_ratio`, lambda [1], and `offset`, that of the pin's line over the crank radius [1], are
    flat arrays.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = 1.0 / crank_ratio - np.abs(offset)
        rho = reach + np.sqrt(reach * reach - 1.0)
        # A highest order is enough where the harmonics above it are below rounding.
        enough = [rho ** -float(most) <= 1e-15 for most in HIGHEST[:-1]]
    first = np.select([*enough, np.isnan(rho)], [*range(len(enough)), 0], len(enough))
    for number, most in enumerate(HIGHEST):
        designs = np.flatnonzero(first == number)
        if designs.size:
            yield most, designs


def velocity_waves(crank_ratio: Floats, offset: Floats, highest: int) -> tuple[Floats, Floats]:
    """Real and imaginary part of v_m of the orders 0 to `highest`, shape (designs, orders).

    Crank ratios lambda and offsets over the crank radius are flat arrays. NaN: no crank can turn.
    """
    real, imaginary = np.empty((2, crank_ratio.size, highest + 1))
    _transform(crank_ratio, offset, *_waves(highest), real, imaginary)
    return real, imaginary


@cache
def _waves(highest: int) -> tuple[Floats, Floats]:
    """Sine and cosine of every order at the angles of the samples, shape (order, sample)."""
    samples = 8 * highest // 3
    angle = np.outer(np.arange(highest + 1), np.arange(samples)) % samples
    return np.sin(angle * (2.0 * np.pi / samples)), np.cos(angle * (2.0 * np.pi / samples))


def mean_square(crank_ratio: npt.ArrayLike, offset: npt.ArrayLike) -> Floats:
    """Mean of v^2 over a revolution [1]; the arguments broadcast.

    The mean of equally spaced samples, twice as many as a design has harmonics: what they leave out
    falls off as rho^-m too, and lies far below rounding. By NumPy, because commands that solve
    nothing ask for it, and Numba takes half a second to import.
    """
    ratio, e = np.broadcast_arrays(
        np.asarray(crank_ratio, dtype=np.float64), np.asarray(offset, dtype=np.float64)
    )
    ratios, offsets, result = ratio.reshape(-1), e.reshape(-1), np.empty(ratio.size)
    for highest, designs in by_highest_order(ratios, offsets):
        angle = np.linspace(0.0, 2.0 * np.pi, 2 * highest, endpoint=False)
        for begin in range(0, designs.size, AT_ONCE):
            some = designs[begin : begin + AT_ONCE]
            v = velocity(angle, ratios[some, np.newaxis], offsets[some, np.newaxis])
            result[some] = (v * v).mean(axis=1)
    return result.reshape(ratio.shape)


@kernel
def _transform(
    ratio: Floats, offset: Floats, sine: Floats, cosine: Floats, real: Floats, imaginary: Floats
) -> None:
    """Harmonics of each design, from samples at angles whose sines and cosines are given."""
    samples = sine.shape[1]
    sampled = np.empty(samples)
    for design in range(ratio.size):
        lamda, e = ratio[design], offset[design]
        top = sine_of_top(lamda, e)
        upright = math.sqrt(1.0 - top * top)
        for i in range(samples):
            s, c = sum_of_angles(sine[1, i], cosine[1, i], top, upright)
            sampled[i] = offset_velocity_at(s, c, lamda, e) / samples
        real[design, 0] = imaginary[design, 0] = 0.0
        for order in range(1, real.shape[1]):
            one, other = 0.0, 0.0
            for i in range(samples):
                one += sampled[i] * cosine[order, i]
                other -= sampled[i] * sine[order, i]
            real[design, order], imaginary[design, order] = one, other
