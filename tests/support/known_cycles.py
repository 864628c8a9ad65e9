"""Speed of an engine whose cycles all do a known work, and times of teeth.

Only the pressure of the mean cycle, with and without combustion, comes from the package. Mechanism,
equation of motion, clock and wheel are its own: the energy follows from Crank and Nicolson's rule
for the linear equation T' = M - 2 k T/Theta of a load k omega^2.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from engine_dyn.types import Floats

PERIOD = 4.0 * np.pi
DEGREE = np.pi / 180.0
PITCH = 6.0 * DEGREE
TEETH = np.arange(58) * PITCH
"""Of a wheel 60-2, from the first one after the gap."""


@dataclass(frozen=True)
class KnownEngine:
    """Measures in m, kg and kg m2; angles at which the cylinders fire in degrees."""

    bore: float
    stroke: float
    rod: float
    mass: float
    inertia: float
    firing: tuple[float, ...] = (0.0, 540.0, 180.0, 360.0)

    def slope(self, angle: Floats) -> Floats:
        """dx/dphi of the piston towards the crank [m]."""
        radius = 0.5 * self.stroke
        sine, cosine = np.sin(angle), np.cos(angle)
        return np.asarray(
            radius * sine + radius**2 * sine * cosine / np.sqrt(self.rod**2 - (radius * sine) ** 2)
        )


def speed_of(
    engine: KnownEngine, angle: Floats, fired: Floats, motored: Floats, factors: Floats,
    mean_speed: float,
) -> tuple[Floats, Floats, float]:  # fmt: skip
    """Crank angles from -period/2 on, the speed there, and the load coefficient.

    Parameters
    ----------
    angle, fired, motored : ndarray, shape (samples,)
        Pressure of a cylinder over its cycle from -period/2 on.
    factors : ndarray, shape (cycles, cylinders)
        On the pressure above the motored one; a cycle of a cylinder is that whose firing dead
        centre is at its firing angle behind that of cylinder 1.
    mean_speed : float
        At the beginning; the load takes the mean torque of factors of 1 there [rad/s].
    """
    step, count = 0.25 * DEGREE, len(factors)
    fine = np.arange(round(count * PERIOD / step) + 1) * step - 0.5 * PERIOD
    area = 0.25 * np.pi * engine.bore**2
    torque, normal, theta = np.zeros(fine.size), np.zeros(fine.size), np.zeros(fine.size)
    for number, firing in enumerate(np.radians(engine.firing)):
        own = (fine - firing + 0.5 * PERIOD) % PERIOD - 0.5 * PERIOD
        cycle = np.floor((fine - firing + 0.5 * PERIOD) / PERIOD + 1e-9).astype(int)
        factor = factors[np.clip(cycle, 0, count - 1), number]
        base, extra = (np.interp(own, angle, p, period=PERIOD) for p in (motored, fired - motored))
        lever = area * engine.slope(own)
        torque += (base - 101325.0 + factor * extra) * lever
        normal += (base - 101325.0 + extra) * lever
        theta += engine.mass * engine.slope(own) ** 2
    one = round(PERIOD / step)
    theta += engine.inertia - theta[:one].mean()
    load = float(normal[:one].mean()) / mean_speed**2
    energy = np.empty(fine.size)
    energy[0] = 0.5 * theta[0] * mean_speed**2
    fading = load / theta  # of T' = M - 2 fading T
    middle = 0.5 * step * (torque[1:] + torque[:-1])
    for place in range(fine.size - 1):
        energy[place + 1] = (energy[place] * (1.0 - step * fading[place]) + middle[place]) / (
            1.0 + step * fading[place + 1]
        )
    return fine, np.sqrt(2.0 * energy / theta), load


def tooth_times(
    fine: Floats, omega: Floats, gap_angle: float, *, errors: float, passage: float, seed: int
) -> Floats:
    """Times at which teeth pass from the gap's angle on [s].

    `errors` of the places of teeth, the same in every turn, and of their passages, new in each, in
    shares of a pitch.
    """
    rng = np.random.default_rng(seed)
    clock = CubicSpline(fine, 1.0 / omega).antiderivative()
    turns = int((fine[-1] - gap_angle - 0.01) // (2.0 * np.pi))
    places = TEETH + errors * PITCH * rng.standard_normal(TEETH.size)
    at = gap_angle + 2.0 * np.pi * np.arange(turns)[:, None] + places
    at = np.append(at.ravel(), gap_angle + 2.0 * np.pi * turns + places[0])
    return np.asarray(clock(at + passage * PITCH * rng.standard_normal(at.size)))
