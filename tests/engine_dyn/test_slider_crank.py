"""Kinematics: derivatives, limits, symmetry, singular places, and a second derivation."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine_dyn import acceleration, position, rod_angle, velocity
from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.slider_crank import acceleration_at, position_at, velocity_at
from oracle import solution
from tests.support.differences import PHI, slope

pytestmark = pytest.mark.quick

RATIOS = (0.01, 0.2, 0.2571428571428571, 1.0 / 3.0, 0.6, 0.9)
CURVES = (position, velocity, acceleration)


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize(("curve", "derivative"), [(position, velocity), (velocity, acceleration)])
def test_each_is_the_derivative_of_the_one_before(
    curve: Callable[..., Any], derivative: Callable[..., Any], ratio: float
) -> None:
    # The difference misses h^4/30 of a fifth derivative, at 0.9 some 1e4: 1e-9 with h = 1e-3.
    found = slope(lambda phi: curve(phi, ratio), PHI, 1e-3)
    np.testing.assert_allclose(found, derivative(PHI, ratio), atol=1e-8)


@pytest.mark.parametrize("ratio", RATIOS)
def test_formulas_of_kernels_are_the_same(ratio: float) -> None:
    for phi in PHI[::7]:
        sine, cosine = math.sin(phi), math.cos(phi)
        # 1 - cos(phi) rounds where the array's form does not.
        assert position_at(sine, cosine, ratio) == pytest.approx(position(phi, ratio), abs=1e-15)
        assert velocity_at(sine, cosine, ratio) == pytest.approx(velocity(phi, ratio), rel=1e-13)
        assert acceleration_at(sine, cosine, ratio) == pytest.approx(
            acceleration(phi, ratio), rel=1e-13, abs=1e-15
        )


@pytest.mark.parametrize("ratio", RATIOS)
def test_a_second_derivation_gives_the_same(ratio: float) -> None:
    for curve, other in zip(
        CURVES, (solution.position, solution.velocity, solution.acceleration), strict=True
    ):
        # The other one subtracts two rods: it loses the digits of 1/lambda.
        np.testing.assert_allclose(curve(PHI, ratio), other(PHI, ratio), atol=1e-15 / ratio + 1e-13)


@pytest.mark.parametrize("ratio", RATIOS)
def test_triangle_of_crank_and_rod_closes(ratio: float) -> None:
    beta = rod_angle(PHI, ratio)
    np.testing.assert_allclose(np.sin(beta) / ratio, np.sin(PHI), atol=1e-15)
    axis = np.cos(PHI) + np.cos(beta) / ratio  # from the crank's axis to the pin
    np.testing.assert_allclose(1.0 + 1.0 / ratio - axis, position(PHI, ratio), atol=1e-13)


@pytest.mark.parametrize("ratio", RATIOS)
def test_dead_centres(ratio: float) -> None:
    assert position(0.0, ratio) == 0.0
    assert position(np.pi, ratio) == pytest.approx(2.0, rel=1e-15)
    assert velocity(0.0, ratio) == 0.0
    assert velocity(np.pi, ratio) == pytest.approx(0.0, abs=1e-15)
    assert acceleration(0.0, ratio) == pytest.approx(1.0 + ratio, rel=1e-15)
    assert acceleration(np.pi, ratio) == pytest.approx(ratio - 1.0, rel=1e-14)
    assert rod_angle(0.5 * np.pi, ratio) == pytest.approx(math.asin(ratio), rel=1e-15)


def test_small_angles_lose_no_digits() -> None:
    tiny = np.array([1e-3, 1e-6, 1e-9, 1e-150])
    np.testing.assert_allclose(position(tiny, 0.25), 0.5 * 1.25 * tiny**2, rtol=1e-6)
    np.testing.assert_allclose(position(tiny[1:], 0.25), 0.5 * 1.25 * tiny[1:] ** 2, rtol=1e-12)


@given(st.floats(-20.0, 20.0), st.floats(1e-6, 0.999))
def test_symmetry_and_range(phi: float, ratio: float) -> None:
    assert position(-phi, ratio) == position(phi, ratio)
    assert velocity(-phi, ratio) == -velocity(phi, ratio)
    assert acceleration(-phi, ratio) == acceleration(phi, ratio)
    assert 0.0 <= position(phi, ratio) <= 2.0 + 1e-15
    assert position(phi + 2.0 * np.pi, ratio) == pytest.approx(position(phi, ratio), abs=1e-13)
    # Down for half a turn, up for the other.
    assert velocity(phi, ratio) * math.sin(phi) >= 0.0


def test_shapes() -> None:
    for curve in (*CURVES, rod_angle):
        assert isinstance(curve(0.3, 0.25), np.float64)
        assert curve([0.1, 0.2, 0.3], 0.25).shape == (3,)
        assert curve(np.zeros((4, 1)), [0.2, 0.3]).shape == (4, 2)
        assert curve(0.3, [[0.2], [0.3]]).shape == (2, 1)
        assert curve(np.zeros(0), 0.25).shape == (0,)
        assert curve(1, 0.25) == curve(1.0, 0.25)


@pytest.mark.parametrize("ratio", [0.0, 1.0, -0.2, 1.5, math.nan, math.inf])
def test_impossible_crank_ratios_are_refused(ratio: float) -> None:
    for curve in (*CURVES, rod_angle):
        with pytest.raises(ValueError, match=r"crank_ratio = .*must lie between 0 and 1"):
            curve(0.3, ratio)
        with pytest.raises(ValueError, match="crank_ratio"):
            curve([0.1, 0.2], [0.25, ratio])


@pytest.mark.parametrize(("ratio", "offset"), [(0.25, 0.0), (0.5, 0.0), (0.3, 0.2), (0.35, -0.4)])
def test_angle_of_a_travel_is_the_inverse(ratio: float, offset: float) -> None:
    centres = slider_crank.dead_centres(ratio, offset)
    bottom, stroke = float(centres.bottom), 2.0 * float(centres.stroke)
    for low, high, down in ((0.0, bottom, True), (bottom - 2.0 * np.pi, 0.0, False)):
        phi = np.linspace(low, high, 1001)
        travel = np.clip(slider_crank.position(phi, ratio, offset), 0.0, stroke)
        found = slider_crank.angle_of_travel(travel, down, ratio, offset)
        # rounding of the travel, 1e-15, over the piston's velocity; its root at the dead centres
        slope = np.abs(slider_crank.velocity(phi, ratio, offset))
        limit = np.minimum(1e-15 / np.maximum(slope, 1e-300), 5e-8) * 5.0 + 1e-15
        assert np.all(np.abs(found - phi) < limit)
        back = slider_crank.position(found, ratio, offset)
        np.testing.assert_allclose(back, travel, rtol=0, atol=2e-15)
    both = slider_crank.angle_of_travel(1.0, [True, False], ratio, offset)
    assert both[0] > 0.0 > both[1]
    for wrong in (-1e-9, stroke + 1e-9, np.nan):
        with pytest.raises(ValueError, match="must be from 0 to the stroke"):
            slider_crank.angle_of_travel(wrong, True, ratio, offset)
