"""Harmonics of the piston velocity and of its square, and works that are added up from them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from engine_dyn.geometry.kinematic_series import velocity_coefficients
from engine_dyn.geometry.slider_crank import velocity
from engine_dyn.geometry.velocity_harmonics import (
    FEW_TERMS,
    LARGEST_RATIO,
    MANY_TERMS,
    OFFSET_TERMS,
    curves_at,
    order_of,
    orders_of,
    samples_of,
    squares_of,
)
from engine_dyn.speed.batch.work_harmonics import (
    CENTRED_INTERVALS,
    INTERVAL_COUNT,
    images_of,
    interval_at,
    limits_of,
)

ANGLE = np.linspace(0.0, 2.0 * math.pi, 721)


def coefficients(terms: int, ratio: float) -> Any:
    """Sine coefficients by the sampling that lanes use, docs/method.md (110)."""
    sine, cosine, weights, _ = samples_of(terms)
    return np.append(1.0, ratio * weights @ (sine * cosine / np.sqrt(1.0 - (ratio * sine) ** 2)))


@pytest.mark.parametrize("terms", [FEW_TERMS, MANY_TERMS])
@pytest.mark.parametrize("fraction", [0.1, 0.5, 1.0])
def test_coefficients_are_those_of_the_series(terms: int, fraction: float) -> None:
    """Against Mosakowski's series, which shares nothing with the sampling."""
    ratio = fraction * LARGEST_RATIO[terms]
    orders = [order_of(term) for term in range(terms)]
    np.testing.assert_allclose(
        coefficients(terms, ratio), velocity_coefficients(orders, ratio), rtol=1e-9, atol=1e-15
    )


@pytest.mark.parametrize("terms", [FEW_TERMS, MANY_TERMS])
def test_the_largest_crank_ratio_is_resolved(terms: int) -> None:
    """The velocity integrates to the stroke; its square is the squared closed form."""
    ratio = LARGEST_RATIO[terms]
    sine, cosine = np.sin(ANGLE), np.cos(ANGLE)
    exact = sine * (1.0 + ratio * cosine / np.sqrt(1.0 - (ratio * sine) ** 2))
    velocity = coefficients(terms, ratio)
    squares = np.empty(2 * terms)
    squares_of(terms, 1, velocity, squares)
    orders = np.arange(1, 2 * terms + 1)
    summed = squares @ np.cos(np.multiply.outer(orders, ANGLE))
    wanted = exact**2 - np.mean(exact[:-1] ** 2)
    np.testing.assert_allclose(summed, wanted, atol=4e-10)
    with pytest.raises(AssertionError):  # one term less is not enough for half of that
        np.testing.assert_allclose(
            squares[:-6] @ np.cos(np.multiply.outer(orders[:-6], ANGLE)), wanted, atol=2e-10
        )


@pytest.mark.parametrize("offset", [0.01, -0.3, 0.5])
@pytest.mark.parametrize("fraction", [0.3, 1.0])
def test_terms_with_an_offset(offset: float, fraction: float) -> None:
    """Against the closed form, up to the largest crank ratio that they are used for."""
    largest = LARGEST_RATIO[OFFSET_TERMS]
    ratio = fraction * largest / (1.0 + largest * abs(offset))
    sine, _, weights, square_weights = samples_of(OFFSET_TERMS)
    angle = 2.0 * math.pi * np.arange(sine.size) / sine.size
    samples = velocity(angle, ratio, offset)
    exact = velocity(ANGLE, ratio, offset)
    summed = (weights @ samples) @ curves_at(ANGLE, *orders_of(OFFSET_TERMS, False))
    np.testing.assert_allclose(summed, exact, atol=4e-10)
    summed = (square_weights @ samples**2) @ curves_at(ANGLE, *orders_of(OFFSET_TERMS, True))
    np.testing.assert_allclose(summed, exact**2 - np.mean(exact[:-1] ** 2), atol=4e-10)


def test_intervals_of_crank_ratios() -> None:
    ratios = (0.0, 0.2, 0.21, 0.36, 0.45, 0.46, 0.8)
    assert [interval_at(x, 0.0) for x in ratios] == [0, 0, 1, 1, 2, 3, 4]
    assert [interval_at(x, 0.0) for x in (0.81, -0.1, math.nan)] == [-1, -1, -1]


def test_intervals_of_offsets_contain_what_lies_in_them() -> None:
    random = np.random.default_rng(3)
    numbers = set()
    for _ in range(300):
        ratio, offset = random.uniform(0.01, 0.5), random.uniform(-0.6, 0.6)
        number = interval_at(ratio, offset)
        numbers.add(number)
        if number < 0:
            assert ratio / (1.0 - ratio * abs(offset)) > 0.45 or abs(offset) > 0.5
        else:
            smallest, largest, farthest = limits_of(number)
            assert smallest <= ratio <= largest and 0.0 < abs(offset) <= farthest
    assert numbers == {-1, *range(CENTRED_INTERVALS, INTERVAL_COUNT)}


def test_images_of_even_and_repeated_curves() -> None:
    """One cylinder of four strokes has a quarter of its curves to add up; none where it is odd."""
    nodes = np.arange(8) * 4.0 * math.pi / 8
    width = nodes[1]
    curve = np.stack([np.cos(nodes), np.sin(nodes + width) - np.sin(nodes)], axis=1)
    node, interval = images_of(curve[None, :, :, None])
    assert node.tolist() == [0, 1, 2, 1, 0, 1, 2, 1]
    assert interval.tolist() == [0, 1, 1, 0, 0, 1, 1, 0]
    odd = np.stack([np.sin(0.5 * nodes), np.cos(0.5 * nodes)], axis=1)
    node, interval = images_of(odd[None, :, :, None])
    assert node.tolist() == interval.tolist() == list(range(8))
