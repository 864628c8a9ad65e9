"""A nine-cylinder radial with master and articulated rods, as points at fixed distances.

It knows nothing of the project's formulas: the points are found by Newton's method at every crank
angle, slopes over the angle are those of their Fourier series, and torques follow from virtual work
and from the kinetic energy.
"""

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from engine_dyn.forces import torque
from engine_dyn.forces.superposition import CrankTrain
from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.geometry.cylinders import Cylinders, cylinders_of
from engine_dyn.geometry.layouts import arrangement_from_text
from engine_dyn.geometry.master_rods import with_rods
from engine_dyn.pressure.diagram import diagram_from_points
from engine_dyn.pressure.family import family_from_diagrams

COUNT, RADIUS, ROD, KNUCKLE, BORE = 9, 0.0873, 0.342, 0.068, 0.1556
OFFSET, MASS, KNUCKLE_MASS, SPEED, CRANKCASE = 0.004, 4.0, 1.1, 230.0, 1e5
RATIO, E = RADIUS / ROD, OFFSET / RADIUS
STEPS = 720
THETA = np.arange(STEPS) * (math.tau / STEPS)
AREA = 0.25 * math.pi * BORE**2


def engine(angles: Any = None, length: Any = None, text: str = f"radial {COUNT}") -> Cylinders:
    plain = cylinders_of(arrangement_from_text(text))
    return with_rods(plain, KNUCKLE / RADIUS, KNUCKLE_MASS / MASS, angles, length)


# --- the mechanism of points ---------------------------------------------------------------------


class Points(NamedTuple):
    """Heights of the pistons along their cylinders, and knuckle pins as complex numbers.

    Real parts are along cylinder 1, imaginary ones a right angle ahead in the sense of rotation;
    over the angle of the crank to cylinder 1. The master has no knuckle pin: its crank pin.
    """

    heights: np.ndarray
    knuckles: np.ndarray


def solved(start: np.ndarray, lengths: np.ndarray, sides: Any) -> np.ndarray:
    """Newton's method on the distances of points, with differences for slopes."""
    x = start.copy()
    for _ in range(30):
        misses = sides(x) - lengths
        if np.abs(misses).max() < 1e-15:
            break
        step = 1e-7
        slopes = np.stack(
            [
                (sides(x + step * row) - sides(x - step * row)) / (2 * step)
                for row in np.eye(x.size)
            ],
            axis=1,
        )
        x = x - np.linalg.solve(slopes, misses)
    return x


def mechanism(angles: np.ndarray, rods: np.ndarray) -> Points:
    """All positions; `angles` of the knuckle pins from the master rod, lengths of the rods [m]."""
    banks = np.arange(COUNT) * (math.tau / COUNT)
    heights, knuckles = np.empty((COUNT, STEPS)), np.empty((COUNT, STEPS), dtype=complex)
    for i, theta in enumerate(THETA):
        pin = RADIUS * np.exp(1j * theta)
        rod = np.array([ROD])
        (top,) = solved(rod, rod, lambda x, pin=pin: abs(x + 1j * OFFSET - pin))
        heights[0, i], knuckles[0, i] = top, pin
        master = top + 1j * OFFSET
        for k in range(1, COUNT):
            line = np.exp(1j * banks[k])
            far = math.sqrt(ROD**2 + KNUCKLE**2 - 2 * ROD * KNUCKLE * math.cos(angles[k]))

            def sides(
                x: np.ndarray, line: complex = line, pin: complex = pin, master: complex = master
            ) -> np.ndarray:
                knuckle, piston = x[0] + 1j * x[1], (x[2] + 1j * OFFSET) * line
                return np.abs([knuckle - pin, knuckle - master, piston - knuckle])

            guess = pin + KNUCKLE * (master - pin) / ROD * np.exp(1j * angles[k])
            start = np.array([guess.real, guess.imag, rods[k] + 0.5 * KNUCKLE])
            x = solved(start, np.array([KNUCKLE, far, rods[k]]), sides)
            heights[k, i], knuckles[k, i] = x[2], x[0] + 1j * x[1]
    return Points(heights, knuckles)


@cache
def points(case: str) -> Points:
    given = CASES[case]
    angles, length = given
    own = np.arange(COUNT) * (math.tau / COUNT) if angles is None else np.array(angles)
    rods = np.full(COUNT, ROD - KNUCKLE if length is None else length * RADIUS)
    return mechanism(own, rods)


CASES: dict[str, tuple[Any, Any]] = {
    "customary": (None, None),
    "own angles and length": (
        [0.0, *(k * math.tau / COUNT + 0.02 * math.sin(2 * k) for k in range(1, COUNT))], 3.3,
    ),
}  # fmt: skip


def slope(curve: np.ndarray, times: int = 1) -> np.ndarray:
    """Slope of a curve over a revolution, by its Fourier series."""
    waves = 1j * np.fft.fftfreq(STEPS, 1.0 / STEPS)
    found = np.fft.ifft(np.fft.fft(curve) * waves**times)
    return found if np.iscomplexobj(curve) else found.real


def between(curve: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """A curve over a revolution between its samples, by its Fourier series."""
    orders = np.arange(60)
    waves = np.fft.rfft(curve)[:60] * (2.0 / STEPS)
    waves[0] *= 0.5
    return (waves[:, None] * np.exp(1j * orders[:, None] * theta)).real.sum(axis=0)


def dead_centre(curve: np.ndarray, near: float) -> float:
    """Angle at which a height has no slope."""
    rate = slope(curve)
    return float(brentq(lambda t: between(rate, np.array([t]))[0], near - 0.3, near + 0.3,
                        xtol=1e-14))  # fmt: skip


def top_of_first(case: str) -> float:
    return dead_centre(points(case).heights[0], 0.0)


def over_phi(case: str, curve: np.ndarray) -> np.ndarray:
    """A curve over the crank's angle, from top dead centre of cylinder 1 on, over a revolution."""
    return between(curve, THETA + top_of_first(case))


def made(case: str) -> Cylinders:
    return engine(*CASES[case])


def train(cylinders: Cylinders) -> CrankTrain:
    return CrankTrain(RATIO, 2 * RADIUS, COUNT, FOUR_STROKE, E, {COUNT: cylinders})


def kinetic(case: str) -> np.ndarray:
    """Inertia of pistons and knuckle masses over the angle, less that of these on the crank pin."""
    found = points(case)
    pistons = MASS * slope(found.heights) ** 2
    knuckles = KNUCKLE_MASS * (np.abs(slope(found.knuckles[1:])) ** 2 - RADIUS**2)
    return pistons.sum(axis=0) + knuckles.sum(axis=0)


# --- gas -----------------------------------------------------------------------------------------


def diagram() -> Any:
    degrees = np.arange(-360.0, 360.0)
    volume = 1.0 + 5.5 * 0.5 * (1.0 - np.cos(np.radians(degrees)))
    burnt = 30.0 * np.exp(-(((degrees - 15.0) / 25.0) ** 2))
    pressure = 1e5 * ((6.5 / volume) ** 1.3 + burnt)
    return family_from_diagrams([100.0], [diagram_from_points(np.radians(degrees), pressure)])


def master_angle(share: float, down: bool) -> float:
    """Angle from top dead centre at which the master has a share of its stroke, by bisection."""

    def height(theta: float) -> float:
        return RADIUS * math.cos(theta) + math.sqrt(
            ROD**2 - (RADIUS * math.sin(theta) - OFFSET) ** 2
        )

    top = math.asin(OFFSET / (ROD + RADIUS))
    bottom = math.pi + math.asin(OFFSET / (ROD - RADIUS))
    wanted = height(top) - share * (height(top) - height(bottom))
    ends = (top, bottom) if down else (bottom - math.tau, top)
    if share <= 0.0 or share >= 1.0:
        return (ends[0] if (share <= 0.0) == down else ends[1]) - top
    return float(brentq(lambda t: height(t) - wanted, *ends, xtol=1e-15)) - top


def gas_of_points(case: str) -> np.ndarray:
    """Gas torque over two revolutions by virtual work, each piston's pressure by its volume."""
    found, family = points(case), diagram()
    fires = made(case).arrangement
    assert fires is not None
    total = np.zeros(2 * STEPS)
    for k in range(COUNT):
        bank = k * math.tau / COUNT
        top, bottom = (dead_centre(found.heights[k], bank + turn) for turn in (0.0, math.pi))
        high, low = between(found.heights[k], np.array([top, bottom]))
        height = np.tile(over_phi(case, found.heights[k]), 2)
        speed = np.tile(over_phi(case, slope(found.heights[k])), 2)
        # The revolution of the cycle follows from the firing angle of a plain rod.
        phi = np.arange(2 * STEPS) * (math.tau / STEPS)
        shift = math.remainder(top - top_of_first(case) - fires.firing_angles[k], math.tau)
        own = phi - (fires.firing_angles[k] + shift)
        turns = np.floor(own / math.tau)
        down = own - math.tau * turns < bottom - top
        share = (high - height) / (high - low)
        at = np.array([master_angle(s, bool(d)) for s, d in zip(share, down, strict=True)])
        at = at + math.tau * np.where(down, turns, turns + 1)
        total += (torque.pressure(at, family, 0.0) - CRANKCASE) * AREA * -speed
    return total
