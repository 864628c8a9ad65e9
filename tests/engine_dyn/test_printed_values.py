"""Printed formulas and numbers of the sources, against the functions."""

from __future__ import annotations

import numpy as np
import pytest

import engine_dyn
from engine_dyn.geometry import masses
from engine_dyn.loads import friction

PHI = np.linspace(-7.0, 7.0, 401)


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


def test_friction_of_the_thesis() -> None:
    """Table 5.2 at 50 % load: 32.776 N m from p_max = 65.408 bar (eqs. 3.8, 3.9)."""
    speed = friction.mean_piston_speed(0.18, 1200 * np.pi / 30)
    assert speed == pytest.approx(7.2)
    fmep = friction.friction_mean_effective_pressure(0.137e5, 0.005, 0.142e5, 65.408e5, speed)
    volume = np.pi / 4 * 0.14**2 * 0.18
    assert friction.friction_torque(fmep, volume, 4 * np.pi) == pytest.approx(32.776, abs=5e-4)
