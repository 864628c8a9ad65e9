"""Kinematics with and without an offset: the closed triangle, derivatives, limits, dead centres."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from engine_dyn import acceleration, position, rod_angle, velocity
from engine_dyn.geometry.slider_crank import (
    angle_of_travel,
    crank_radius,
    dead_centres,
    offset_acceleration_at,
    offset_position_at,
    offset_velocity_at,
    sine_of_top,
    sum_of_angles,
)
from tests.support.differences import PHI, slope

pytestmark = pytest.mark.quick

CURVES: tuple[Callable[..., Any], ...] = (position, velocity, acceleration)
CASES = [
    (ratio, share * (1.0 / ratio - 1.0))
    for ratio in (0.01, 0.2, 1.0 / 3.0, 0.5, 0.8)
    for share in (-0.9, -0.1, 0.0, 0.02, 0.3, 0.9)
]
EACH = pytest.mark.parametrize(("ratio", "offset"), [*CASES, (0.9, 0.0)])


def height(theta: Any, ratio: float, offset: float) -> Any:
    """Piston pin above the crank's axis over the crank radius: the rod closes the triangle.

    Written for complex angles too.
    """
    return np.cos(theta) + np.sqrt(ratio**-2 - (np.sin(theta) - offset) ** 2)


@EACH
def test_the_rod_closes_the_triangle(ratio: float, offset: float) -> None:
    top = dead_centres(ratio, offset).top
    expected = height(top, ratio, offset) - height(top + PHI, ratio, offset)
    np.testing.assert_allclose(position(PHI, ratio, offset), expected, atol=4e-15 / ratio)
    sine = ratio * (np.sin(top + PHI) - offset)
    np.testing.assert_allclose(np.sin(rod_angle(PHI, ratio, offset)), sine, atol=1e-15)


@EACH
def test_each_is_the_derivative_of_the_one_before(ratio: float, offset: float) -> None:
    # Offsets near the limit make the rod nearly lie down: steep higher derivatives.
    scale = 1.0 / (1.0 - ratio * (1.0 + abs(offset)))
    for curve, derivative in pairwise(CURVES):
        found = slope(lambda phi, c=curve: c(phi, ratio, offset), PHI, 2e-4)
        np.testing.assert_allclose(
            found, derivative(PHI, ratio, offset), atol=1e-10 * max(scale, 1.0 / ratio) ** 2
        )


@pytest.mark.parametrize("ratio", [0.01, 0.2571428571428571, 0.9])
def test_without_offset_nothing_changes_by_a_bit(ratio: float) -> None:
    sine, cosine = np.sin(PHI), np.cos(PHI)
    root = np.sqrt(1.0 - (ratio * sine) ** 2)
    x = 2.0 * np.sin(0.5 * PHI) ** 2 + ratio * sine**2 / (1.0 + root)
    v = sine * (1.0 + ratio * cosine / root)
    bracket = cosine**2 - sine**2 + ratio**2 * (sine**2 * sine**2)
    b = cosine + ratio * bracket / (root * root * root)
    beta = np.arcsin(ratio * sine)
    for curve, plain in ((position, x), (velocity, v), (acceleration, b), (rod_angle, beta)):
        for given_offset in ((), (0.0,), (np.zeros(len(PHI)),)):
            assert curve(PHI, ratio, *given_offset).tobytes() == plain.tobytes()
        # Beside designs with an offset, too.
        both = curve(PHI[:, None], ratio, np.array([0.0, 0.01]))
        np.testing.assert_array_equal(both[:, 0], plain)


@EACH
def test_formulas_of_kernels(ratio: float, offset: float) -> None:
    top_sine = sine_of_top(ratio, offset)
    top_cosine = math.sqrt(1.0 - top_sine**2)
    for phi in PHI[::9]:
        sine, cosine = sum_of_angles(math.sin(phi), math.cos(phi), top_sine, top_cosine)
        versine = 1.0 - math.cos(phi)
        assert offset_position_at(
            sine, cosine, ratio, offset, versine, top_cosine
        ) == pytest.approx(position(phi, ratio, offset), rel=1e-12, abs=1e-15)
        v = offset_velocity_at(sine, cosine, ratio, offset)
        assert v == pytest.approx(velocity(phi, ratio, offset), rel=1e-11, abs=1e-13)
        b = offset_acceleration_at(sine, cosine, ratio, offset)
        assert b == pytest.approx(acceleration(phi, ratio, offset), rel=1e-11, abs=1e-11)


@EACH
def test_dead_centres(ratio: float, offset: float) -> None:
    centres = dead_centres(ratio, offset)
    # The slope of the height, by a complex step, vanishes where it is largest and least.
    for theta in (centres.top, centres.top + centres.bottom):
        assert height(theta + 1e-30j, ratio, offset).imag * 1e30 == pytest.approx(0.0, abs=1e-13)
    assert (height(PHI, ratio, offset) <= height(centres.top, ratio, offset) + 1e-12).all()
    # The classical stroke: crank and rod stretched and folded.
    rod = 1.0 / ratio
    stroke = math.sqrt((rod + 1.0) ** 2 - offset**2) - math.sqrt((rod - 1.0) ** 2 - offset**2)
    assert centres.stroke == pytest.approx(0.5 * stroke, rel=1e-12 / ratio)
    assert centres.stroke >= 1.0
    assert position(0.0, ratio, offset) == 0.0
    assert position(centres.bottom, ratio, offset) == pytest.approx(2.0 * centres.stroke, rel=1e-13)
    # Down with a positive velocity all the way to the bottom, then up.
    down = np.linspace(0.0, centres.bottom, 102)[1:-1]
    up = np.linspace(centres.bottom, 2.0 * np.pi, 102)[1:-1]
    assert (velocity(down, ratio, offset) > 0.0).all()
    assert (velocity(up, ratio, offset) < 0.0).all()
    assert (centres.bottom > np.pi) == (offset > 0.0)


@given(st.floats(0.01, 0.95), st.floats(-0.99, 0.99))
def test_the_other_side_is_the_mechanism_turned_backwards(ratio: float, share: float) -> None:
    offset = share * (1.0 / ratio - 1.0)
    assume(offset == 0.0 or abs(offset) > 1e-12)
    phi = np.linspace(-3.0, 3.0, 13)
    for curve, sign in zip(CURVES, (1.0, -1.0, 1.0), strict=True):
        there, mirrored = curve(phi, ratio, offset), sign * curve(-phi, ratio, -offset)
        np.testing.assert_allclose(there, mirrored, rtol=1e-9, atol=1e-12 * np.abs(there).max())
    centres, mirror = dead_centres(ratio, offset), dead_centres(ratio, -offset)
    assert centres.bottom + mirror.bottom == pytest.approx(2.0 * np.pi, rel=1e-12)
    assert centres.stroke == mirror.stroke


@pytest.mark.parametrize("offset", [0.0, 0.4])
def test_small_angles_lose_no_digits(offset: float) -> None:
    """x = b(0) phi^2/2 + O(phi^3)."""
    tiny = np.array([1e-6, 1e-9, 1e-150])
    expected = 0.5 * acceleration(0.0, 0.25, offset) * tiny**2
    np.testing.assert_allclose(position(tiny, 0.25, offset), expected, rtol=1e-6)


@given(st.floats(0.02, 0.9), st.floats(-0.98, 0.98))
def test_crank_radius_gives_the_stroke(half_over_rod: float, share: float) -> None:
    rod = 0.35
    half = half_over_rod * rod
    offset = share * (rod - half**2 / rod)
    radius = crank_radius(2.0 * half, rod, offset)
    assert 0.0 < radius <= half
    centres = dead_centres(radius / rod, offset / radius)
    assert 2.0 * radius * centres.stroke == pytest.approx(2.0 * half, rel=1e-9)


@pytest.mark.parametrize(("ratio", "offset"), [(0.25, 0.0), (0.5, 0.0), (0.3, 0.2), (0.35, -0.4)])
def test_angle_of_a_travel_is_the_inverse(ratio: float, offset: float) -> None:
    centres = dead_centres(ratio, offset)
    bottom, stroke = float(centres.bottom), 2.0 * float(centres.stroke)
    for low, high, down in ((0.0, bottom, True), (bottom - 2.0 * np.pi, 0.0, False)):
        phi = np.linspace(low, high, 1001)
        travel = np.clip(position(phi, ratio, offset), 0.0, stroke)
        found = angle_of_travel(travel, down, ratio, offset)
        # rounding of the travel, 1e-15, over the piston's velocity; its root at the dead centres
        slope = np.abs(velocity(phi, ratio, offset))
        limit = np.minimum(1e-15 / np.maximum(slope, 1e-300), 5e-8) * 5.0 + 1e-15
        assert np.all(np.abs(found - phi) < limit)
        back = position(found, ratio, offset)
        np.testing.assert_allclose(back, travel, rtol=0, atol=2e-15)
    both = angle_of_travel(1.0, [True, False], ratio, offset)
    assert both[0] > 0.0 > both[1]
    for wrong in (-1e-9, stroke + 1e-9, np.nan):
        with pytest.raises(ValueError, match="must be from 0 to the stroke"):
            angle_of_travel(wrong, True, ratio, offset)


@pytest.mark.parametrize(
    ("ratio", "offset", "message"),
    [
        (0.25, 3.0, r"offset = 3 crank radii: the crank cannot turn; .* here offset below 3$"),
        (0.5, -1.5, r"offset = -1\.5 crank radii: .* below 1$"),
        (0.25, math.nan, r"offset = nan crank radii"),
        (0.25, math.inf, r"offset = inf crank radii"),
        *((r, 0.0, rf"crank_ratio = {r:g}: must lie between 0 and 1") for r in (0.0, 1.0, -0.2)),
        *(
            (r, 0.0, rf"crank_ratio = {r:g}: must lie between 0 and 1")
            for r in (math.nan, math.inf)
        ),
    ],
)
def test_cranks_that_cannot_turn(ratio: float, offset: float, message: str) -> None:
    for curve in (position, velocity, acceleration, rod_angle):
        with pytest.raises(ValueError, match=message):
            curve([0.1, 0.2], ratio, offset)
        with pytest.raises(ValueError, match=message):
            curve(0.1, [[0.2], [ratio]], [0.0, offset])
    with pytest.raises(ValueError, match=message):
        dead_centres(ratio, offset)
