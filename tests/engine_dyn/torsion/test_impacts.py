"""Torque pulses, against exact cases and an integration."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from engine_dyn.torsion.forced import forced_response
from engine_dyn.torsion.impacts import Pulses, blade_impacts, pulse_response
from engine_dyn.torsion.synthesis import half_range
from engine_dyn.torsion.system import barred_range, matrices, shaft_system

THREE: dict[str, Any] = {"inertia": [2.0, 3.0, 10.0], "stiffness": [4e5, 6e5]}


@pytest.mark.parametrize("damping", [[0.0, 0.0], [30.0, 20.0], [30.0, 2e6]])
@pytest.mark.parametrize("contact", [1.2, 2.5], ids=["apart", "overlapping"])
def test_impacts_are_those_of_an_integration(damping: list[float], contact: float) -> None:
    system = shaft_system(**THREE, damping=damping)
    pulses = blade_impacts(30.0, 4, -2e4, contact, 2.0)
    inertia, stiffness, _, damper = matrices(system)
    matrix = np.block(
        [[np.zeros((3, 3)), np.eye(3)], [-stiffness / inertia[:, None], -damper / inertia[:, None]]]
    )

    def slope(time: float, now: Any) -> Any:
        since = time - pulses.start
        acts = (since >= 0.0) & (since < pulses.duration)
        torque = pulses.torque * np.sin(np.pi * since / pulses.duration)
        return matrix @ now + np.array([0, 0, 0, 0, 0, torque[acts].sum() / inertia[2]])

    end = 0.45
    times = np.linspace(0.0, end, 4001)
    found = solve_ivp(
        slope, (0.0, end), np.zeros(6), "Radau", times, jac=matrix, rtol=1e-8, atol=1e-12,
        max_step=2e-3,
    ).y  # fmt: skip
    torque = np.array(
        [
            system.shaft_factor[i] * (
                system.stiffness[i + 1] * (found[i + 1] - found[i])
                + damping[i] * (found[i + 4] - found[i + 3])
            )
            for i in range(2)
        ]
    )  # fmt: skip
    mine = pulse_response(system, 2, pulses, until=end)
    size = np.abs(torque).max(axis=1)
    assert (np.abs(mine["highest"] - torque.max(axis=1)) < 1e-3 * size).all()
    assert (np.abs(mine["lowest"] - torque.min(axis=1)) < 1e-3 * size).all()
    assert mine["largest"] == pytest.approx(size, rel=1e-3)


def test_a_short_pulse_leaves_its_momentum_in_the_free_vibration() -> None:
    """An impulse I on disc 2 of two: torque amplitude k (I/J_2)/omega; energy is kept."""
    system = shaft_system([4.0, 1.0], [1e4])
    omega, impulse = math.sqrt(1e4 * 1.25), 3.0
    duration = 1e-4
    pulse = Pulses(
        np.array([0.0]), np.array([duration]), np.array([0.5 * np.pi * impulse / duration])
    )
    found = pulse_response(system, 1, pulse, until=0.1)
    assert found["largest"][0] == pytest.approx(1e4 * impulse / omega, rel=1e-4)


def test_a_pulse_at_the_frequency_of_an_undamped_mode_is_finite() -> None:
    """Half a sine of resonance ends with pi/2 times its static torque: -t cos(wt)/2 w at pi/w."""
    system = shaft_system([1e9, 1.0], [1e4])
    pulse = Pulses(np.array([0.1]), np.array([np.pi / 100.0]), np.array([7.0]))
    found = pulse_response(system, 1, pulse)
    assert found["largest"][0] == pytest.approx(7.0 * np.pi / 2.0, rel=1e-4)


def test_steady_running_adds_its_half_range() -> None:
    system, orders = shaft_system(**THREE, damping=[30.0, 20.0]), np.array([1.5, 3.0])
    steady = forced_response(
        system, orders, 90.0, [0], [[300.0, 200.0j]], wanted=("torque", "torque_extremes")
    )
    nothing = Pulses(np.array([0.0]), np.array([0.1]), np.array([0.0]))
    found = pulse_response(
        system, 2, nothing, until=0.3, steady=(orders, steady["torque"], 90.0), angle=1.0
    )
    both = 0.5 * (found["highest"] - found["lowest"])
    assert both == pytest.approx(half_range(steady["torque_extremes"]), rel=1e-3)


def test_a_sequence_has_the_impacts_of_all_blades() -> None:
    pulses = blade_impacts(10.0, 5, 800.0, 0.6, 4.0, shift=0.2)
    assert pulses.start == pytest.approx((0.2 + np.arange(20) * 2.0 * np.pi / 5) / 10.0)
    assert pulses.torque.max() == 800.0
    rising, falling = pulses.torque[:5], pulses.torque[-5:]
    assert np.diff(rising) == pytest.approx(160.0)
    assert np.diff(falling) == pytest.approx(-160.0)


@pytest.mark.parametrize("speed", [30.0, 79.0])
def test_the_barred_range_surrounds_the_critical_speed(speed: float) -> None:
    low, high = barred_range(speed, 100.0)
    assert low * high == pytest.approx(speed**2)
    assert high / speed == pytest.approx((18.0 - speed / 100.0) / 16.0)
    assert np.isnan(barred_range(81.0, 100.0)[0])


def test_wrong_input_is_named() -> None:
    system, one = shaft_system(**THREE), np.ones(1)
    with pytest.raises(ValueError, match="turns = 0: must be above 0"):
        blade_impacts(1.0, 4, 1.0, 0.5, 0)
    with pytest.raises(ValueError, match="disc = 3: must be from 0 to 2"):
        pulse_response(system, 3, Pulses(one, one, one))
    with pytest.raises(ValueError, match="duration: must be above 0"):
        pulse_response(system, 0, Pulses(one, 0.0 * one, one))
    designs = shaft_system(np.ones((2, 3)), [1.0, 1.0])
    with pytest.raises(ValueError, match="must be one design"):
        pulse_response(designs, 0, Pulses(one, one, one))
