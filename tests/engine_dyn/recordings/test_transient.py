"""Recorded cycles as an initial-value problem, against SciPy's integrator."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from engine_dyn import status
from engine_dyn.pressure.diagram import diagram_from_points
from engine_dyn.recordings.cylinder_geometry import RecordedCycles
from engine_dyn.recordings.transient import (
    TorqueTrain,
    close_train,
    fit_train,
    follow_train,
    train_of_cycles,
)
from engine_dyn.speed.api import periodic_speed

CYCLES = 12
LENGTH = CYCLES * 4.0 * np.pi
SIZES = 1.0 + 0.1 * np.random.default_rng(1).standard_normal(CYCLES)


def torque_at(angle):
    """Expansion and compression of a four-stroke cycle, of another size in each; smooth."""
    phase = np.mod(angle, 4.0 * np.pi)
    size = SIZES[np.minimum(angle // (4.0 * np.pi), CYCLES - 1).astype(int)]
    return 8.0 + 120.0 * size * (
        np.exp(-(((phase - 5.0) / 0.8) ** 2)) - 0.4 * np.exp(-(((phase - 3.5) / 0.6) ** 2))
    )


def inertia_at(angle):
    return 0.02 + 0.003 * np.cos(2.0 * np.asarray(angle))


def train_of(exponent: float, steps_a_degree: float = 1.0) -> TorqueTrain:
    steps = round(CYCLES * 720 * steps_a_degree)
    angle = LENGTH / (2 * steps) * np.arange(2 * steps + 1)
    return TorqueTrain(torque_at(angle), inertia_at(angle), LENGTH / steps, exponent, 2.0)


def integrated(train: TorqueTrain, start: float, coefficient: float) -> np.ndarray:
    def slope(angle, energy):
        omega = np.sqrt(2.0 * energy / inertia_at(angle))
        return torque_at(np.asarray(angle)) - 2.0 - coefficient * omega**train.exponent

    found = solve_ivp(
        slope, (0.0, LENGTH), [0.5 * float(inertia_at(0.0)) * start**2], method="DOP853",
        rtol=1e-12, atol=1e-9, max_step=0.1, t_eval=np.minimum(train.angle, LENGTH),
    )  # fmt: skip
    return np.sqrt(2.0 * found.y[0] / inertia_at(train.angle))


@pytest.mark.parametrize(("exponent", "coefficient"), [(0.0, 20.0), (1.0, 0.06), (2.7, 3e-6)])
def test_speed_is_that_of_an_independent_integrator(exponent: float, coefficient: float) -> None:
    train = train_of(exponent)
    found = follow_train(train, 300.0, coefficient)
    assert found.status == status.CONVERGED
    assert np.max(np.abs(found.speed / integrated(train, 300.0, coefficient) - 1.0)) < 1e-8


def test_errors_fall_with_the_fourth_power_of_the_step() -> None:
    exact = integrated(train_of(2.0, 0.1), 300.0, 2e-4)[-1]
    errors = [
        abs(follow_train(train_of(2.0, steps), 300.0, 2e-4).speed[-1] - exact)
        for steps in (0.1, 0.2)
    ]
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.4)


def test_derivatives_are_those_of_differences() -> None:
    train = train_of(1.4)
    found = follow_train(train, 300.0, 0.006)
    up, down = follow_train(train, 300.01, 0.006), follow_train(train, 299.99, 0.006)
    assert np.allclose(found.by_start, (up.speed - down.speed) / 0.02, atol=1e-6)
    up, down = follow_train(train, 300.0, 0.0060001), follow_train(train, 300.0, 0.0059999)
    difference = (up.speed - down.speed) / 2e-7
    assert np.allclose(found.by_coefficient, difference, atol=1e-6 * np.abs(difference).max())


def test_memory_is_the_formula_of_constant_torque() -> None:
    """With M = a + k omega^2 the speed stays; s = exp(-2 k phi/Theta)."""
    steps, k = 500, 2e-4
    train = TorqueTrain(
        np.full(2 * steps + 1, k * 300.0**2), np.full(2 * steps + 1, 0.02), 0.05, 2.0
    )
    found = follow_train(train, 300.0, k)
    assert np.allclose(found.speed, 300.0, rtol=1e-13)
    assert found.memory == pytest.approx(np.exp(-2.0 * k * steps * 0.05 / 0.02), rel=1e-9)


def test_first_speed_and_load_are_found_from_measured_speeds() -> None:
    train = train_of(2.0)
    true = follow_train(train, 310.0, 1.9e-4)
    edges = np.linspace(0.0, LENGTH, 12 * 116 + 1)
    clock = np.concatenate(
        [[0.0], np.cumsum(0.5 * train.step * (1.0 / true.speed[1:] + 1.0 / true.speed[:-1]))]
    )
    measured = np.diff(edges) / np.diff(np.interp(edges, train.angle, clock))
    measured[100:140] = np.nan  # a lost turn
    found = fit_train(train, edges, measured)
    assert found.status == status.CONVERGED
    # the clock here is of trapezoids, which differ from the integral by some 1e-6
    assert found.start_speed == pytest.approx(310.0, rel=1e-5)
    assert found.load_coefficient == pytest.approx(1.9e-4, rel=1e-4)


def test_first_and_last_cycle_determine_both() -> None:
    train = train_of(1.0)
    edges = 4.0 * np.pi * np.arange(CYCLES + 1)
    wanted = np.full(CYCLES, np.nan)
    wanted[0], wanted[-1] = 305.0, 298.0
    found = fit_train(train, edges, wanted)
    assert found.status == status.CONVERGED
    slow = 1.0 / found.speed.astype(float)
    for cycle, speed in ((0, 305.0), (CYCLES - 1, 298.0)):
        part = slow[720 * cycle : 720 * (cycle + 1) + 1]
        mean = train.step * (part.sum() - 0.5 * (part[0] + part[-1]))  # periodic but for little
        assert 4.0 * np.pi / mean == pytest.approx(speed, rel=1e-5)


def test_a_closed_train_repeats_at_its_mean_speed() -> None:
    train = train_of(2.0)
    closed = close_train(train, 300.0)
    assert closed.status == status.CONVERGED
    assert closed.speed[-1] == pytest.approx(closed.speed[0], rel=1e-10)
    assert np.mean(closed.speed[:-1]) == pytest.approx(300.0, rel=1e-6)
    again = follow_train(train, closed.start_speed, closed.load_coefficient)
    assert np.array_equal(again.speed, closed.speed)


def test_a_train_that_stalls_says_so() -> None:
    found = follow_train(train_of(1.0), 50.0, 2.0)
    assert found.status == status.STALLED
    assert np.isnan(found.speed[-1])
    assert found.speed[0] == 50.0


SIZES_OF_ENGINE = {"bore": 0.1, "stroke": 0.12, "crank_ratio": 0.28, "reciprocating_mass": 1.2}


def recorded(cycles: int, samples: int = 1440) -> RecordedCycles:
    """The same cycle again and again: compression, a burning, expansion; 1 bar otherwise."""
    angle = -2.0 * np.pi + 4.0 * np.pi / samples * np.arange(samples)
    pressure = 1e5 * (
        1.0 + 30.0 * np.exp(-((angle / 0.5) ** 2)) + 35.0 * np.exp(-(((angle - 0.4) / 0.5) ** 2))
    )
    return RecordedCycles(angle, np.tile(pressure, (cycles, 1)))


@pytest.mark.parametrize("firing_angles", [[0.0], [0.0, np.pi]])
def test_equal_cycles_in_a_row_are_the_periodic_solution(firing_angles: list[float]) -> None:
    """From its speed and load coefficient, the speed comes back to itself cycle after cycle."""
    cycles = recorded(4)
    periodic = periodic_speed(
        diagram_from_points(cycles.angle, cycles.pressure[0]),
        inertia=1.0, speed=150.0, cylinders=len(firing_angles), firing_angles=firing_angles,
        inertia_model="variable", friction_torque=20.0, tolerance=1e-9, crank_angle=cycles.angle,
        **SIZES_OF_ENGINE,
    )  # fmt: skip
    train = train_of_cycles(
        [cycles] * len(firing_angles), inertia=1.0, firing_angles=firing_angles,
        friction_torque=20.0, **SIZES_OF_ENGINE,
    )  # fmt: skip
    found = follow_train(train, float(periodic.omega[0]), periodic.load_coefficient)
    whole = np.tile(periodic.omega, 4)[::2][: found.speed.size]
    assert np.max(np.abs(found.speed / whole - 1.0)) < 1e-6
    closed = close_train(train, float(periodic.omega.mean()))
    assert closed.load_coefficient == pytest.approx(periodic.load_coefficient, rel=2e-3)
