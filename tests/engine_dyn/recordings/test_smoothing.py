"""Noise, smoothing and delays against signals in which they are known."""

import numpy as np
import pytest

from engine_dyn.recordings.cylinder_geometry import RecordedCycles
from engine_dyn.recordings.smoothing import noise, shifted, smooth, without_delay
from tests.support import recorded_engine as engine

DEGREE = engine.DEGREE


def waves(order: float, count: int = 2, step: float = 0.5) -> RecordedCycles:
    """A cosine of an order of the revolution, which the cycles continue."""
    angle = np.arange(-360.0, 360.0, step) * DEGREE
    return RecordedCycles(angle, np.tile(1e5 * np.cos(order * angle), (count, 1)))


@pytest.mark.parametrize("step", [0.2, 0.5, 1.0])
def test_the_noise_is_found_beside_combustion(step: float) -> None:
    found = noise(engine.cycles(step, 20, noise=5e3))
    assert found.mean() == pytest.approx(5e3, rel=0.05)


def test_noise_of_uneven_samples() -> None:
    rng = np.random.default_rng(4)
    angle = np.sort(rng.uniform(-360.0, 360.0, 1440)) * DEGREE
    p = 1e5 * np.cos(angle) + 2e3 * rng.standard_normal((20, 1440))
    assert noise(RecordedCycles(angle, p)).mean() == pytest.approx(2e3, rel=0.05)


@pytest.mark.parametrize(
    "options", [{}, {"width": 8 * DEGREE}, {"method": "low_pass", "highest_order": 40.0}]
)
def test_half_the_power_is_left_at_the_highest_order(options: dict) -> None:
    recorded = waves(20.0)
    order = smooth(recorded, engine.GEOMETRY, **options).highest_order
    at = waves(round(2 * order) / 2)
    after = smooth(at, engine.GEOMETRY, **options).cycles.pressure[:, 200:-200]
    kept = (after**2).mean() / (at.pressure[:, 200:-200] ** 2).mean()
    assert kept == pytest.approx(0.5, abs=0.06)


def test_nothing_is_delayed() -> None:
    recorded = waves(6.0, 3)
    for options in ({}, {"method": "low_pass", "highest_order": 40.0}):
        after = smooth(recorded, engine.GEOMETRY, **options).cycles.pressure[1]
        sine = np.sin(6.0 * recorded.angle)
        assert abs((after * sine).mean()) < 1e-4 * (after**2).mean() ** 0.5


def test_a_shift_of_cycles_in_a_row() -> None:
    # One long wave whose cycles differ: neighbours come from the cycle before.
    angle = np.arange(-360.0, 360.0, 0.5) * DEGREE
    whole = angle + 4.0 * np.pi * np.arange(4)[:, None]
    found = shifted(RecordedCycles(angle, np.sin(0.3 * whole)), 3.3 * DEGREE)
    expected = np.sin(0.3 * (whole - 3.3 * DEGREE))
    np.testing.assert_allclose(found.pressure[1:], expected[1:], atol=1e-8)
    np.testing.assert_allclose(found.pressure[0, 8:], expected[0, 8:], atol=1e-8)


def test_delay_and_lag_are_taken_out() -> None:
    # A first-order lag of a wave: y = cos(k phi - atan(k w T))/sqrt(1 + (k w T)^2), by hand.
    speed, lag, delay, order = 157.0, 1e-4, 2e-5, 10.0
    recorded = waves(order, 3, 0.2)
    product = order * speed * lag
    late = order * (recorded.angle - speed * delay) - np.arctan(product)
    wrong = RecordedCycles(
        recorded.angle, np.tile(1e5 * np.cos(late) / np.sqrt(1.0 + product**2), (3, 1))
    )
    found = without_delay(wrong, speed, delay, lag)
    np.testing.assert_allclose(found.pressure[1], recorded.pressure[1], atol=50.0)
    assert np.abs(wrong.pressure[1] - recorded.pressure[1]).max() > 1e4
