"""Reduction of rod and throw, inertia of the running gear."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from engine_dyn.geometry import masses
from oracle import solution

POSITIVE = st.floats(0.01, 100.0)


@given(POSITIVE, st.floats(0.0, 1.0), POSITIVE)
def test_rod_keeps_mass_and_centre_of_gravity(mass: float, share: float, length: float) -> None:
    centre = share * length
    piston = masses.rod_mass_at_piston(mass, centre, length)
    crank = masses.rod_mass_at_crank(mass, centre, length)
    assert piston + crank == pytest.approx(mass, rel=1e-14)
    assert piston * length == pytest.approx(mass * centre, rel=1e-14)
    total = masses.reciprocating_mass(2.0, mass, centre, length) + masses.rotating_mass(
        3.0, mass, centre, length
    )
    assert total == pytest.approx(mass + 5.0, rel=1e-14)


@pytest.mark.parametrize(("rod", "printed"), [(0.35, 6.67), (0.30, 6.95), (0.45, 6.29)])
def test_masses_of_the_thesis(rod: float, printed: float) -> None:
    """Kakaitsas (2015), tables 4.1 and 5.3: piston 4.97 kg, rod 6.33 kg, 94 mm from the big end."""
    assert masses.reciprocating_mass(4.97, 6.33, 0.094, rod) == pytest.approx(printed, abs=0.005)
    assert masses.rotating_mass(1.0, 6.33, 0.094, 0.35) == pytest.approx(5.63, abs=0.005)


@pytest.mark.parametrize(
    ("ratio", "offset"),
    [*((ratio, 0.0) for ratio in (1e-6, 0.1, 0.25, 0.5, 0.8, 0.95, 0.99)), (0.33, -0.3),
     (0.4, 0.5), (0.62, 0.6)],
)  # fmt: skip
def test_mean_square_velocity(ratio: float, offset: float) -> None:
    def square(phi: float) -> float:
        return float(solution.velocity(phi, ratio, offset)) ** 2

    exact = quad(square, 0.0, 2.0 * np.pi, epsabs=0.0, epsrel=1e-13, limit=500)[0] / (2.0 * np.pi)
    # The other formula of the velocity loses the digits of 1/lambda squared.
    assert masses.mean_square_velocity(ratio, offset) == pytest.approx(exact, rel=1e-12)


def test_engine_inertia_is_twice_the_kinetic_energy_at_unit_speed() -> None:
    radius, ratio = 0.09, 0.2571
    phi = np.arange(1440) * (4.0 * np.pi / 1440)
    for count in (1, 3, 8):
        energy = 0.0
        for i in range(count):
            v = solution.velocity(phi - i * 4.0 * np.pi / count, ratio)
            energy = energy + 0.5 * (6.67 * (radius * v) ** 2 + 5.63 * radius**2)
        found = masses.engine_inertia(6.67, 5.63, radius, ratio, count)
        assert found == pytest.approx(2.0 * energy.mean(), rel=1e-12)
    counts = masses.engine_inertia(6.67, 5.63, radius, ratio, np.array([1, 2]))
    assert counts[1] == 2.0 * counts[0]


def test_a_load_behind_a_gear_counts_with_the_square_of_its_ratio() -> None:
    assert masses.inertia_of_parts(1.0, 2.0, 3.0, 4.0, gear_ratio=3.0) == 42.0
