"""A rotor against the grid: a published example, and its motion followed in time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from engine_dyn import time_over_angle as grid

KUNDUR = {"K_S": 1.123 * 0.995 / 0.95 * np.cos(np.radians(49.92)), "H": 3.5, "S": 2220e6, "f": 60.0}
"""P. Kundur, Power System Stability and Control (1994), example 12.2: synchronising torque in units
of the rated one per radian, E' E_B/X_T cos delta_0 (printed: 0.757), inertia constant [s], apparent
power [VA] and frequency [Hz]. Printed are the natural frequency 6.387 rad/s, 1.0165 Hz, and for the
damping torque K_D = 10 the damping ratio 0.112; that of the data, which are rounded, is 6.3864."""


@pytest.mark.parametrize("pole_pairs", [1, 2, 30])
def test_natural_frequency_and_damping_of_a_published_example(pole_pairs: int) -> None:
    speed = 2.0 * np.pi * KUNDUR["f"] / pole_pairs
    inertia = 2.0 * KUNDUR["H"] * KUNDUR["S"] / speed**2
    stiffness = grid.torque_from_power(KUNDUR["K_S"] * KUNDUR["S"], pole_pairs, speed)
    natural = grid.natural_frequency(inertia, stiffness)
    assert natural == pytest.approx(6.387, abs=1e-3)
    assert natural / (2.0 * np.pi) == pytest.approx(1.0165, abs=1.5e-4)
    damping = 10.0 * KUNDUR["S"] / speed**2
    assert grid.damping_ratio(inertia, stiffness, damping) == pytest.approx(0.112, abs=5e-4)


def test_the_swing_is_that_of_the_motion_followed_in_time() -> None:
    speed, inertia, stiffness, damping = 50.0, 12.0, 4000.0, 130.0
    orders = np.arange(1, 9) / 2.0
    torque = np.array([90.0, 40.0j, 0.0, 700.0 - 300.0j, 0.0, 0.0, 0.0, 250.0j])
    period = 4.0 * np.pi

    def motion(t: float, state: np.ndarray) -> list[float]:
        acting = (torque * np.exp(1j * orders * speed * t)).real.sum()
        return [state[1], (acting - damping * state[1] - stiffness * state[0]) / inertia]

    cycle = period / speed
    settled = solve_ivp(motion, (0.0, 25.0 * cycle), [0.0, 0.0], rtol=1e-10, atol=1e-14)
    times = np.linspace(0.0, cycle, 4001)
    last = solve_ivp(motion, (0.0, cycle), settled.y[:, -1], t_eval=times, rtol=1e-10, atol=1e-14)
    angle = grid.angle_harmonics(torque, orders, speed, inertia, stiffness, damping)
    found = grid.sum_of_orders(angle, orders, speed * times)
    assert found == pytest.approx(last.y[0], abs=1e-8)
    assert grid.half_range(angle, orders, period) == pytest.approx(
        0.5 * np.ptp(last.y[0]), rel=1e-5
    )
    power = speed * (stiffness * last.y[0] + damping * last.y[1])
    harmonics = grid.power_harmonics(angle, orders, speed, stiffness, damping)
    assert grid.sum_of_orders(harmonics, orders, speed * times) == pytest.approx(power, abs=1e-2)
    assert grid.half_range(harmonics, orders, period) == pytest.approx(
        0.5 * np.ptp(power), rel=1e-5
    )


def test_amplification_is_that_of_the_textbooks() -> None:
    """1/|1 - (nu_0/nu)^2| without damping; 1/(2 zeta) at resonance; infinite without damping."""
    speed, inertia = 10.0, 3.0
    stiffness = inertia * (0.5 * speed) ** 2  # the natural order is 1/2
    orders = np.array([0.25, 1.0, 2.0])
    expected = [1.0 / 3.0, 4.0 / 3.0, 16.0 / 15.0]
    assert grid.amplification(orders, speed, inertia, stiffness, 0.0) == pytest.approx(expected)
    damping = 0.1 * inertia * 0.5 * speed  # zeta = 0.05
    assert grid.amplification(0.5, speed, inertia, stiffness, damping) == pytest.approx(10.0)
    assert grid.amplification(np.array(0.5), speed, inertia, stiffness, 0.0) == np.inf


def test_the_nearest_order_is_one_that_is_excited() -> None:
    orders = np.arange(1, 7) / 2.0
    natural = np.array([[0.1], [0.9], [1.4]])
    assert list(grid.nearest_order(orders, natural, np.ones(6))) == [0.5, 1.0, 1.5]
    torque = np.where(orders % 1.5 == 0.0, 100.0j, 1e-3)
    assert list(grid.nearest_order(orders, natural, torque)) == [1.5, 1.5, 1.5]
    assert np.isnan(grid.nearest_order(orders, np.nan, torque))
    assert grid.nearness(0.2, 1.5, np.array([1.5, 1.25, 1.2])) == pytest.approx([np.inf, 1.0, 0.8])
