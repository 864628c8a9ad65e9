"""Harmonics of the velocity against transforms of the curve with many points."""

import numpy as np
import pytest

from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.velocity_waves import by_highest_order, mean_square, velocity_waves

pytestmark = pytest.mark.quick

POINTS = 1 << 16
PHI = np.arange(POINTS) * (2.0 * np.pi / POINTS)


@pytest.mark.parametrize(
    ("ratio", "offset", "highest"),
    [(1e-6, 0.0, 24), (0.25, 0.0, 24), (0.33, 0.3, 24), (0.33, -0.3, 24), (0.4, 0.5, 96),
     (0.8, 0.0, 96), (0.99, 0.0, 384), (0.62, 0.6, 384)],
)  # fmt: skip
def test_waves_are_the_transform(ratio: float, offset: float, highest: int) -> None:
    ratios, offsets = np.array([ratio]), np.array([offset])
    ((most, designs),) = by_highest_order(ratios, offsets)
    assert (most, designs.tolist()) == (highest, [0])
    real, imaginary = velocity_waves(ratios, offsets, highest)
    exact = np.fft.fft(slider_crank.velocity(PHI, ratio, offset)) / POINTS
    found = real[0] + 1j * imaginary[0]
    assert found == pytest.approx(exact[: highest + 1], abs=1e-13)
    # what lies behind the highest order is nothing
    assert np.abs(exact[highest + 1 : POINTS // 2]).max() < 1e-14
    square = np.square(slider_crank.velocity(PHI, ratio, offset)).mean()
    assert float(mean_square(ratio, offset)) == pytest.approx(square, rel=1e-13)


def test_a_design_is_itself_among_others() -> None:
    rng = np.random.default_rng(2)
    ratio, offset = rng.uniform(0.1, 0.7, 200), rng.uniform(-0.3, 0.3, 200)
    seen = 0
    for highest, designs in by_highest_order(ratio, offset):
        whole = velocity_waves(ratio[designs], offset[designs], highest)
        for place in (0, designs.size // 2, designs.size - 1):
            here = designs[place : place + 1]
            alone = velocity_waves(ratio[here], offset[here], highest)
            assert all((a == w[place]).all() for a, w in zip(alone, whole, strict=True))
        seen += designs.size
    assert seen == 200


@pytest.mark.compiled  # Python raises where the compiled code gives NaN
def test_a_crank_that_cannot_turn_is_nan() -> None:
    ((highest, _),) = by_highest_order(np.array([0.7]), np.array([0.6]))
    real, imaginary = velocity_waves(np.array([0.7]), np.array([0.6]), highest)
    assert np.isnan(real[0, 1:]).all() and np.isnan(imaginary[0, 1:]).all()
