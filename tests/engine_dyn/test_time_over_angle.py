"""Time and angle of a speed that repeats, against motions that are known as functions of time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from engine_dyn.time_over_angle import (
    angle_deviation,
    cycle_time,
    deviation_harmonics,
    duration,
    extremes,
)

OMEGA = 157.0
"""Mean speed [rad/s]."""

PERIOD = 4.0 * np.pi


def known_motion(samples: int, swings: dict[float, tuple[float, float]]) -> tuple[np.ndarray, ...]:
    """Angles, speeds there and times of phi(t) = Omega t + sum A cos(nu Omega t + psi)."""
    angle = -0.5 * PERIOD + PERIOD / samples * np.arange(samples)

    def swing(x: float, slope: bool = False) -> float:
        return sum(
            -a * nu * np.sin(nu * x + psi) if slope else a * np.cos(nu * x + psi)
            for nu, (a, psi) in swings.items()
        )

    uniform = np.array(
        [brentq(lambda x: x + swing(x) - phi, phi - 1.0, phi + 1.0, xtol=1e-14) for phi in angle]  # noqa: B023
    )
    speed = OMEGA * (1.0 + np.array([swing(x, slope=True) for x in uniform]))
    return angle, speed, uniform / OMEGA


@pytest.mark.parametrize("samples", [144, 720])
def test_a_swing_over_the_time_comes_back(samples: int) -> None:
    """One order in time has an amplitude, and extremes, that need no calculation."""
    angle, speed, time = known_motion(samples, {2.0: (0.01, 0.3)})
    found = angle_deviation(speed, PERIOD)
    assert found == pytest.approx(angle - OMEGA * time, abs=1e-12)
    assert cycle_time(speed, PERIOD) == pytest.approx(PERIOD / OMEGA, rel=1e-13)
    least, largest = extremes(found, 1.0 - OMEGA / speed, PERIOD / samples)
    assert (least, largest) == pytest.approx((-0.01, 0.01), rel=1e-5)
    orders = np.arange(1, 9) / 2.0
    expected = np.where(orders == 2.0, 0.01 * np.exp(0.3j), 0.0)
    assert deviation_harmonics(found, speed, angle, orders) == pytest.approx(expected, abs=1e-12)


def test_orders_of_a_sum_are_those_over_the_time() -> None:
    swings = {0.5: (0.02, 1.0), 1.0: (0.005, -2.0), 3.0: (0.001, 0.0)}
    angle, speed, _ = known_motion(720, swings)
    found = deviation_harmonics(angle_deviation(speed, PERIOD), speed, angle, np.array([0.5, 1, 2]))
    expected = [0.02 * np.exp(1j), 0.005 * np.exp(-2j), 0.0]
    assert found == pytest.approx(np.array(expected), abs=1e-12)


@pytest.mark.parametrize(
    ("begin", "end"), [(-180.0, 0.0), (20.3, 47.9), (300.0, -340.0), (-720.0, 500.0), (10.0, 10.0)]
)
def test_durations_are_integrals_of_the_slowness(begin: float, end: float) -> None:
    def speed(phi: float) -> float:
        return OMEGA * (1.0 + 0.1 * np.cos(0.5 * phi + 1.0) + 0.05 * np.sin(2.0 * phi))

    angle = -0.5 * PERIOD + PERIOD / 720 * np.arange(720)
    found = duration(speed(angle), angle[0], np.radians(begin), np.radians(end), PERIOD)
    last = end
    while last <= begin:
        last += 720.0
    while last > begin + 720.0:
        last -= 720.0
    expected = quad(lambda phi: 1.0 / speed(phi), *np.radians([begin, last]), epsabs=1e-13)[0]
    assert found == pytest.approx(expected, rel=1e-11)
