"""Slider-crank and masses: derivatives, symmetry, limits, printed numbers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import engine_dyn
from engine_dyn import arrangement, friction, masses
from engine_dyn.slider_crank import acceleration_at, jerk_at, position_at, velocity_at

PHI = np.linspace(-7.0, 7.0, 401)
RATIOS = st.floats(1e-6, 0.95)


@given(ratio=RATIOS)
def test_velocity_and_acceleration_are_derivatives(ratio: float) -> None:
    h = 1e-4
    x = [engine_dyn.position(PHI + s * h, ratio) for s in (-2, -1, 1, 2)]
    v = [engine_dyn.velocity(PHI + s * h, ratio) for s in (-2, -1, 1, 2)]
    weights = np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * h)
    bound = 1e-9 / (1.0 - ratio) ** 4
    np.testing.assert_allclose(weights @ np.array(x), engine_dyn.velocity(PHI, ratio), atol=bound)
    np.testing.assert_allclose(
        weights @ np.array(v), engine_dyn.acceleration(PHI, ratio), atol=bound
    )


@given(ratio=RATIOS)
def test_symmetry_and_dead_centres(ratio: float) -> None:
    np.testing.assert_allclose(
        engine_dyn.position(PHI, ratio), engine_dyn.position(-PHI, ratio), atol=1e-14
    )
    np.testing.assert_allclose(
        engine_dyn.velocity(PHI, ratio), -engine_dyn.velocity(-PHI, ratio), atol=1e-14
    )
    assert engine_dyn.position(0.0, ratio) == 0.0
    assert engine_dyn.position(np.pi, ratio) == pytest.approx(2.0, abs=1e-15)
    # Kakaitsas eq. 1.8 at the dead centres: 1 + lambda and -(1 - lambda)
    assert engine_dyn.acceleration(0.0, ratio) == pytest.approx(1.0 + ratio)
    assert engine_dyn.acceleration(np.pi, ratio) == pytest.approx(-1.0 + ratio)


def test_long_rod_gives_a_cosine() -> None:
    np.testing.assert_allclose(engine_dyn.position(PHI, 1e-9), 1.0 - np.cos(PHI), atol=1e-9)
    np.testing.assert_allclose(engine_dyn.velocity(PHI, 1e-9), np.sin(PHI), atol=1e-9)
    np.testing.assert_allclose(engine_dyn.acceleration(PHI, 1e-9), np.cos(PHI), atol=2e-9)


def test_mosakowski_forms_agree() -> None:
    """Eqs. 1 to 3, measured from the crank's axis and towards top dead centre."""
    for ratio in (0.2, 0.5, 0.9):
        s, c = np.sin(PHI), np.cos(PHI)
        root = np.sqrt(1.0 - (ratio * s) ** 2)
        travel = c + root / ratio
        np.testing.assert_allclose(
            engine_dyn.position(PHI, ratio), 1.0 + 1.0 / ratio - travel, atol=1e-13
        )
        speed = -(s + 0.5 * ratio * np.sin(2.0 * PHI) / root)
        np.testing.assert_allclose(engine_dyn.velocity(PHI, ratio), -speed, atol=1e-13)
        bracket = c + ratio * np.cos(2.0 * PHI) / root
        bracket += 0.25 * ratio**3 * np.sin(2.0 * PHI) ** 2 / root**3
        np.testing.assert_allclose(engine_dyn.acceleration(PHI, ratio), bracket, atol=1e-12)


def test_kernel_formulas_are_the_same() -> None:
    h = 1e-4
    for ratio in (0.05, 0.3, 0.8):
        for phi in (-2.0, 0.0, 0.4, 1.6, 3.0):
            s, c = np.sin(phi), np.cos(phi)
            assert position_at(s, c, ratio) == pytest.approx(
                engine_dyn.position(phi, ratio), abs=1e-15
            )
            assert velocity_at(s, c, ratio) == pytest.approx(
                engine_dyn.velocity(phi, ratio), abs=1e-15
            )
            assert acceleration_at(s, c, ratio) == pytest.approx(
                engine_dyn.acceleration(phi, ratio), abs=1e-14
            )
            ends = engine_dyn.acceleration(np.array([phi - h, phi + h]), ratio)
            assert jerk_at(s, c, ratio) == pytest.approx((ends[1] - ends[0]) / (2 * h), abs=1e-5)


@pytest.mark.parametrize("ratio", [0.0, 1.0, -0.1, np.nan, 2.0])
def test_impossible_crank_ratio_is_refused(ratio: float) -> None:
    for function in (engine_dyn.position, engine_dyn.velocity, engine_dyn.acceleration):
        with pytest.raises(ValueError, match="crank_ratio"):
            function(0.1, ratio)


def test_rod_angle() -> None:
    beta = engine_dyn.rod_angle(PHI, 0.3)
    np.testing.assert_allclose(np.sin(beta), 0.3 * np.sin(PHI), atol=1e-15)


def test_masses_of_the_thesis_and_of_b112() -> None:
    """Kakaitsas section 4.1 and 5.2.3; Asgari et al., section 2. Printed to two or three digits."""
    assert masses.rod_mass_at_piston(6.33, 0.094, 0.35) == pytest.approx(1.70, abs=5e-3)
    assert masses.reciprocating_mass(4.97, 6.33, 0.094, 0.35) == pytest.approx(6.67, abs=5e-3)
    assert masses.rotating_mass(1.0, 6.33, 0.094, 0.35) == pytest.approx(5.63, abs=5e-3)
    assert masses.reciprocating_mass(4.97, 6.33, 0.094, 0.30) == pytest.approx(6.95, abs=5e-3)
    assert masses.reciprocating_mass(4.97, 6.33, 0.094, 0.45) == pytest.approx(6.29, abs=5e-3)
    rod = 0.033923 + 0.083577
    assert masses.rod_mass_at_crank(0.625, 0.033923, rod) == pytest.approx(0.445, abs=5e-4)
    assert masses.rod_mass_at_piston(0.625, 0.033923, rod) == pytest.approx(0.180, abs=5e-4)
    assert masses.crank_mass_at_pin(1.233, 0.028706, 0.0355) == pytest.approx(0.997, abs=5e-4)


def test_mean_square_velocity_limits() -> None:
    """1/2 for a long rod; 1/2 + lambda^2/8 to second order."""
    assert masses.mean_square_velocity(1e-6) == pytest.approx(0.5, abs=1e-9)
    assert masses.mean_square_velocity(0.01) == pytest.approx(0.5 + 0.01**2 / 8.0, abs=1e-8)


def test_friction_of_the_thesis() -> None:
    """Table 5.2 at 50 % load: 32.776 N m from p_max = 65.408 bar (eqs. 3.8, 3.9)."""
    speed = friction.mean_piston_speed(0.18, 1200 * np.pi / 30)
    assert speed == pytest.approx(7.2)
    fmep = friction.friction_mean_effective_pressure(0.137e5, 0.005, 0.142e5, 65.408e5, speed)
    volume = np.pi / 4 * 0.14**2 * 0.18
    assert friction.friction_torque(fmep, volume, 4 * np.pi) == pytest.approx(32.776, abs=5e-4)


def test_customary_orders_are_permutations_with_even_phases() -> None:
    for count, order in arrangement.CUSTOMARY_ORDERS.items():
        assert sorted(order) == list(range(1, count + 1))
        phases = arrangement.phases_along_shaft(order, 4 * np.pi)
        assert phases[0] == 0.0
        np.testing.assert_allclose(
            np.sort(phases), np.sort(arrangement.firing_phases(count, 4 * np.pi))
        )
    assert arrangement.customary_order(9) is None
