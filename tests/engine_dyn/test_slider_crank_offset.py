"""Kinematics with an offset cylinder: closed triangle, derivatives, dead centres, limits."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import brentq, minimize_scalar

from engine_dyn import acceleration, position, rod_angle, velocity
from engine_dyn.geometry.slider_crank import (
    crank_radius,
    dead_centres,
    offset_acceleration_at,
    offset_position_at,
    offset_velocity_at,
    sine_of_top,
    sum_of_angles,
    velocity_and_slopes_at,
)
from tests.support.differences import PHI, slope

CASES = [
    (ratio, share * (1.0 / ratio - 1.0))
    for ratio in (0.01, 0.2, 1.0 / 3.0, 0.5, 0.8)
    for share in (-0.9, -0.1, 0.02, 0.3, 0.9)
]


def height(theta: Any, ratio: float, offset: float) -> Any:
    """Piston pin above the crank's axis over the crank radius: the rod closes the triangle.

    Written for complex angles too.
    """
    return np.cos(theta) + np.sqrt(ratio**-2 - (np.sin(theta) - offset) ** 2)


def top_of(ratio: float, offset: float) -> float:
    """Top dead centre, searched for: where the height is largest."""
    found = minimize_scalar(
        lambda theta: -height(theta, ratio, offset),
        bounds=(-0.5 * math.pi, 0.5 * math.pi),
        method="bounded",
        options={"xatol": 1e-12},
    )
    # The bracket of a minimum is good to 1e-8; the zero of the slope, by a complex step, to 1e-15.
    near = float(found.x)
    return float(
        brentq(
            lambda t: height(t + 1e-30j, ratio, offset).imag, near - 1e-3, near + 1e-3, xtol=1e-16
        )
    )


# --- the existing results -----------------------------------------------------------------------


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


# --- against independent evaluations ------------------------------------------------------------


@pytest.mark.parametrize(("ratio", "offset"), CASES)
def test_position_is_the_way_from_the_highest_point(ratio: float, offset: float) -> None:
    top = top_of(ratio, offset)
    expected = height(top, ratio, offset) - height(top + PHI, ratio, offset)
    np.testing.assert_allclose(position(PHI, ratio, offset), expected, atol=4e-15 / ratio)


@pytest.mark.parametrize(("ratio", "offset"), CASES)
def test_each_is_the_derivative_of_the_one_before(ratio: float, offset: float) -> None:
    # Offsets near the limit make the rod nearly lie down: steep higher derivatives.
    scale = 1.0 / (1.0 - ratio * (1.0 + abs(offset)))
    pairs: list[tuple[Callable[..., Any], Callable[..., Any]]] = [
        (position, velocity),
        (velocity, acceleration),
    ]
    for curve, derivative in pairs:
        found = slope(lambda phi, c=curve: c(phi, ratio, offset), PHI, 2e-4)  # type: ignore[misc]
        np.testing.assert_allclose(
            found, derivative(PHI, ratio, offset), atol=1e-10 * max(scale, 1.0 / ratio) ** 2
        )


@pytest.mark.parametrize(("ratio", "offset"), CASES)
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
        jerk = slope(lambda angle: acceleration(angle, ratio, offset), phi, 1e-4)
        size = max(abs(acceleration(PHI, ratio, offset)).max(), 1.0)
        together = velocity_and_slopes_at(sine, cosine, ratio, offset)
        assert together[0] == pytest.approx(v, rel=1e-13, abs=1e-15)
        assert together[1] == pytest.approx(b, rel=1e-12, abs=1e-13 * size)
        assert together[2] == pytest.approx(jerk, rel=1e-6, abs=1e-8 * size)


# --- dead centres, stroke, work -----------------------------------------------------------------


@pytest.mark.parametrize(("ratio", "offset"), CASES)
def test_dead_centres(ratio: float, offset: float) -> None:
    centres = dead_centres(ratio, offset)
    assert centres.top == pytest.approx(top_of(ratio, offset), abs=1e-14)
    # The classical stroke, in lengths: crank and rod stretched and folded.
    r, e = 1.0, offset
    l = 1.0 / ratio  # noqa: E741
    stroke = math.sqrt((l + r) ** 2 - e**2) - math.sqrt((l - r) ** 2 - e**2)
    assert centres.stroke == pytest.approx(stroke / (2.0 * r), rel=1e-12 / ratio)
    assert centres.stroke >= 1.0
    assert position(0.0, ratio, offset) == 0.0
    assert position(centres.bottom, ratio, offset) == pytest.approx(2.0 * centres.stroke, rel=1e-13)
    for angle in (0.0, centres.bottom):
        assert velocity(angle, ratio, offset) == pytest.approx(0.0, abs=1e-13 / ratio)
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
    np.testing.assert_allclose(
        position(phi, ratio, offset), position(-phi, ratio, -offset), rtol=1e-9, atol=1e-12
    )
    there, mirrored = dead_centres(ratio, offset), dead_centres(ratio, -offset)
    assert there.bottom + mirrored.bottom == pytest.approx(2.0 * np.pi, rel=1e-12)
    assert there.stroke == mirrored.stroke


def test_small_angles_lose_no_digits() -> None:
    """x = b(0) phi^2/2 + O(phi^3)."""
    tiny = np.array([1e-6, 1e-9, 1e-150])
    expected = 0.5 * acceleration(0.0, 0.25, 0.4) * tiny**2
    np.testing.assert_allclose(position(tiny, 0.25, 0.4), expected, rtol=1e-6)


def test_rod_stands_more_upright_while_the_piston_is_pushed_down() -> None:
    down = np.linspace(0.3, 2.8, 26)
    for crank_ratio in (0.2, 0.33):
        assert (
            np.abs(rod_angle(down, crank_ratio, 0.2)) < np.abs(rod_angle(down, crank_ratio))
        ).mean() > 0.9
        assert np.abs(rod_angle(down, crank_ratio, 0.2)).max() < np.arcsin(crank_ratio)
        assert np.abs(rod_angle(down, crank_ratio, -0.2)).max() > np.arcsin(crank_ratio)


@given(st.floats(0.02, 0.9), st.floats(-0.98, 0.98))
def test_crank_radius_gives_the_stroke(half_over_rod: float, share: float) -> None:
    rod = 0.35
    half = half_over_rod * rod
    offset = share * (rod - half**2 / rod)
    radius = crank_radius(2.0 * half, rod, offset)
    assert 0.0 < radius <= half
    centres = dead_centres(radius / rod, offset / radius)
    assert 2.0 * radius * centres.stroke == pytest.approx(2.0 * half, rel=1e-9)


@pytest.mark.parametrize(
    ("ratio", "offset", "message"),
    [
        (0.25, 3.0, r"offset = 3 crank radii: the crank cannot turn; .* here offset below 3$"),
        (0.5, -1.5, r"offset = -1\.5 crank radii: .* below 1$"),
        (0.25, math.nan, r"offset = nan crank radii"),
        (0.25, math.inf, r"offset = inf crank radii"),
        (1.5, 0.0, r"crank_ratio = 1\.5: must lie between 0 and 1"),
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


def test_strokes_that_no_crank_gives() -> None:
    with pytest.raises(ValueError, match=r"stroke = 0\.8 m: must lie between 0 and twice"):
        crank_radius([0.1, 0.8], 0.35, 0.0)
    with pytest.raises(
        ValueError, match=r"offset = -0\.34 m: the crank cannot turn; must be below"
    ):
        crank_radius(0.18, 0.35, [0.0, -0.34])
