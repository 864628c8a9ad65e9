"""Extremes over the cycle, between samples, and the bound on their error."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine_dyn.torsion.forced import forced_response
from engine_dyn.torsion.synthesis import least_torque
from engine_dyn.torsion.system import (
    ALLOY_STEEL,
    propulsion_shaft_limits,
    shaft_stiffness,
    shaft_system,
    shear_stress,
)

FINE = np.linspace(0.0, 4.0 * np.pi, 120_001)


def extremes_of(orders: np.ndarray, harmonics: np.ndarray, period: float) -> np.ndarray:
    """Extremes of a curve, as the torque of a shaft whose second disc does not move."""
    system = shaft_system([1.0, 1e30], 1e18)
    # Far below resonance: the shaft's torque is that on the light disc.
    found = forced_response(
        system, orders, 1e-3, [0], -harmonics[None, :], wanted=("torque_extremes",), period=period
    )
    return found["torque_extremes"][0]


@given(st.integers(1, 24), st.sampled_from([2.0, 4.0]), st.integers(0, 2**32 - 1))
def test_extremes_are_within_their_bound(highest: int, turns: float, seed: int) -> None:
    draw = np.random.default_rng(seed)
    orders = np.arange(1, highest + 1) * 2.0 / turns
    values = draw.normal(size=(2, highest))
    harmonics = (values[0] + 1j * values[1]) * orders ** -draw.uniform(0.0, 2.0)
    curve = (harmonics @ np.exp(1j * np.outer(orders, FINE))).real
    least, most, bound = extremes_of(orders, harmonics, turns * np.pi)
    assert abs(most - curve.max()) <= bound + 1e-5 * np.ptp(curve)
    assert abs(least - curve.min()) <= bound + 1e-5 * np.ptp(curve)
    assert abs(0.5 * (most - least) - 0.5 * np.ptp(curve)) <= 1e-3 * 0.5 * np.ptp(curve)


def test_order_of_the_orders_does_not_matter() -> None:
    orders = np.array([0.5, 1.0, 1.5, 2.0, 4.5])
    harmonics = np.array([3.0, 2.0j, -1.0, 0.5 + 1j, 2.0])
    mixed = [3, 0, 4, 2, 1]
    np.testing.assert_allclose(
        extremes_of(orders[mixed], harmonics[mixed], 4.0 * np.pi),
        extremes_of(orders, harmonics, 4.0 * np.pi), rtol=1e-12,
    )  # fmt: skip


def test_a_coupling_reverses_where_it_vibrates_more_than_it_carries() -> None:
    """The diesel's coupling behind the flywheel side carries 900 N m, and swings by more."""
    extremes = np.array([[-700.0, 1000.0, 1.0]] * 4)
    found = least_torque([900.0, 600.0, -900.0, -1100.0], *extremes.T[:2])
    np.testing.assert_array_equal(found, [200.0, -100.0, -100.0, 100.0])


def test_round_shafts() -> None:
    """The shaft of Friswell's Example 9.6.3, 2.5 m x 200 mm; stress is G d/2 times the twist."""
    assert shaft_stiffness(68e9, 2.5, 0.2) == pytest.approx(4272566.009, rel=1e-9)
    stiffness = shaft_stiffness(8e10, 1.0, 0.1, 0.06)
    assert shear_stress(stiffness * 0.01, 0.1, 0.06) == pytest.approx(8e10 * 0.05 * 0.01)


@pytest.mark.parametrize(
    ("diameter", "values"),
    [
        (0.1, (85.8, 76.0, 52.3, 42.0, 88.9)), (0.2, (80.0, 71.0, 48.8, 39.2, 83.0)),
        (0.4, (75.1, 66.6, 45.8, 36.7, 77.9)), (0.6, (72.5, 64.3, 44.2, 35.5, 75.2)),
    ],
)  # fmt: skip
def test_limits_of_propulsion_shafts(diameter: float, values: tuple[float, ...]) -> None:
    """IACS UR M68 evaluated by another program for 600 MPa, integral flanges [N/mm2]."""
    ratio = np.array([0.3, 0.5, 0.8, 0.9, 1.0, 1.05])
    continuous, passing = propulsion_shaft_limits(ratio, diameter, 600e6, 1.0)
    np.testing.assert_allclose(
        continuous[[0, 1, 2, 3, 4]] / 1e6, [*values[:4], values[3]], atol=0.051
    )
    assert continuous[5] == continuous[4]  # The end of the range belongs to it
    assert np.isnan(propulsion_shaft_limits(1.06, diameter, 600e6, 1.0)[0])
    assert passing[2] / 1e6 == pytest.approx(values[4], abs=0.051)
    assert np.isnan(passing[3:]).all()
    # M68.3: more strength counts nothing, of carbon steel above 600 MPa, of alloy steel above 800.
    np.testing.assert_array_equal(
        propulsion_shaft_limits(ratio, diameter, 900e6, 1.0)[0], continuous
    )
    alloy = propulsion_shaft_limits(ratio, diameter, [[700e6], [900e6]], 1.0, ALLOY_STEEL)[0]
    np.testing.assert_allclose(alloy[0], continuous * 860.0 / 760.0)
    np.testing.assert_allclose(alloy[1], continuous * 960.0 / 760.0)
    keyed = propulsion_shaft_limits(0.5, diameter, 600e6, 0.6)
    assert keyed[0] == pytest.approx(0.6 * continuous[1])
    assert keyed[1] == pytest.approx(1.7 * keyed[0] / np.sqrt(0.6))
