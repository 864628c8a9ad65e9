"""Stiff shafts beside soft ones, equal branches and discs without mass, against fractions.

    python -m tests.engine_dyn.torsion.test_numbers_far_apart 10000

looks at so many random systems.
"""

from __future__ import annotations

import sys
from fractions import Fraction

import numpy as np
import pytest

from engine_dyn.status import CONVERGED, NO_STEADY_STATE
from engine_dyn.torsion.forced import forced_response
from engine_dyn.torsion.modes import (
    critical_speeds,
    elastic_over_rigid,
    modal_damping,
    natural_modes,
)
from engine_dyn.torsion.shaft import pendulum
from engine_dyn.torsion.system import shaft_system
from tests.support.exact_shafts import exact_response, modes_below, random_system

WITHIN = Fraction(1, 10**9)


def check_modes(number: int, seed: int) -> int:
    """Check the frequencies and shapes of random systems; the number of modes."""
    random, count = np.random.default_rng(seed), 0
    for _ in range(number):
        system = random_system(random, 8)
        modes = natural_modes(system)
        free = int(not system.ground_stiffness.any())
        assert modes.omega.size == system.parent.size - free
        for place, omega in enumerate(modes.omega, start=free):
            low, high = ((Fraction(omega) * (1 + off)) ** 2 for off in (-WITHIN, WITHIN))
            assert modes_below(system, low) <= place < modes_below(system, high), (system, omega)
        largest = np.abs(modes.shape).max(axis=-1)
        np.testing.assert_allclose(largest, 1.0, rtol=1e-8)
        # Each mode's energy of position is that of motion, a stiff shaft's too.
        twist = modes.twist**2 @ system.stiffness
        held = modes.shape[:, np.argsort(system.node_of_disc)] ** 2 @ system.ground_stiffness
        np.testing.assert_allclose(twist + held, modes.omega**2 * modes.modal_inertia, rtol=1e-8)
        count += modes.omega.size
    return count


def check_response(number: int, seed: int) -> int:
    """Check angles and torques under torques on all discs; the number of resonances."""
    random, resonances = np.random.default_rng(seed), 0
    for _ in range(number):
        damped = bool(random.random() < 0.5)
        system = random_system(random, 5, damped)
        nodes, child = system.parent.size, int(random.integers(1, system.parent.size))
        omega = [
            10.0 ** random.uniform(0.0, 5.0),
            float(np.sqrt(system.stiffness[child] / system.inertia[child])),  # a branch alone
            float(natural_modes(system).omega[0] * (1.0 + 10.0 ** random.uniform(-6.0, -3.0))),
        ][int(random.integers(0, 3))]
        torque = random.normal(size=nodes) + 1j * random.normal(size=nodes)
        found = forced_response(
            system, [1.0], omega, range(nodes), torque[system.node_of_disc][:, None]
        )
        if found["status"] == NO_STEADY_STATE:  # equal branches, or one with a held hub
            gap = np.abs(natural_modes(system).omega / omega - 1.0).min()
            assert gap < 1e-9
            resonances += 1
            continue
        angle, shaft = exact_response(system, omega, torque)
        for value, exact in (
            (found["angle"][:, 0], angle[system.node_of_disc]),
            (found["torque"][:, 0], (shaft[system.node_of_shaft] * system.shaft_factor)),
        ):
            np.testing.assert_allclose(value, exact, atol=1e-6 * np.abs(exact).max(), rtol=0.0)
    return resonances


@pytest.mark.compiled
def test_frequencies_of_random_systems_are_exact() -> None:
    assert check_modes(150, 7) > 500


@pytest.mark.compiled
def test_responses_of_random_systems_are_exact() -> None:
    assert check_response(100, 8) < 10


@pytest.mark.parametrize("stiff", [1e6, 1e12, 1e18, 1e20, 1e30])
def test_a_rigid_shaft_makes_one_disc_of_two(stiff: float) -> None:
    """omega^2 = k (J_1 + J_2)/(J_1 J_2) of the soft shaft, J_1 that of both discs."""
    made = shaft_system([0.004, 0.09, 0.04], [stiff, 500.0], loss_factor=[0.5, 0.1])
    modes = natural_modes(made)
    expected = np.sqrt(500.0 * 0.134 / (0.094 * 0.04))
    assert modes.omega[0] == pytest.approx(expected, rel=2e3 / stiff + 1e-12)
    assert modal_damping(made, modes)[0] == pytest.approx(0.05, rel=1e4 / stiff + 1e-9)
    ratio = elastic_over_rigid(made, [1.0], [50.0], [0], [[1.0 + 0.0j]], 1)
    # Disc b under a torque on a: theta (J_b' (w^2) - k* w^2 J_c/(k* - w^2 J_c)) = -U.
    own = 0.094 + 0.04 / (1.0 - 2500.0 * 0.04 / (500.0 * (1.0 + 0.1j)))
    assert ratio[0, 0] == pytest.approx(0.134 / abs(own), rel=1e4 / stiff + 1e-9)


def test_critical_speeds_with_a_pendulum_beside_a_rigid_shaft() -> None:
    one = pendulum(0.4, 0.09, 0.01)
    found = [
        critical_speeds(
            shaft_system([*discs, 4.0, one.inertia], [*stiff, 2e4, 0.0], shafts,
                         speed_stiffness=[0.0] * (len(shafts) - 1) + [one.speed_stiffness]),
            [1.0, 3.0, 4.5],
        )
        for discs, stiff, shafts in (
            ([0.7], [], [(0, 1), (0, 2)]),
            ([0.5, 0.2], [1e20], [(0, 1), (1, 2), (1, 3)]),
        )
    ]  # fmt: skip
    known = np.isfinite(found[0]).sum(axis=-1)
    for row, count in enumerate(known):
        np.testing.assert_allclose(found[1][row, :count], found[0][row, :count], rtol=1e-9)


def test_what_does_not_resonate_converges_beside_a_rigid_shaft() -> None:
    """An absorber at its own frequency, with a torque on it, behind a rigid shaft."""
    system = shaft_system([0.5, 0.2, 0.02], [1e22, 2e4])
    speed = float(np.sqrt(2e4 / 0.02))
    found = forced_response(system, [1.0], speed, [0, 2], np.array([[100.0], [30.0]]))
    assert found["status"] == CONVERGED
    angle, shaft = exact_response(system, speed, [100.0, 0.0, 30.0])
    np.testing.assert_allclose(found["angle"][:, 0], angle, rtol=1e-9)
    np.testing.assert_allclose(found["torque"][:, 0], shaft[1:], rtol=1e-9)


if __name__ == "__main__":
    print(check_modes(int(sys.argv[1]), 1), "frequencies")
    print(check_response(int(sys.argv[1]) // 5, 2), "resonances")
