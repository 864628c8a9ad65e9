"""Root mean square and mean over the cycle, by formula and as nodes of the graph."""

import math

import numpy as np
import pytest

from engine_dyn.quantities.curve_extremes import curve_mean, root_mean_square

ANGLE = np.arange(0.0, 4.0 * math.pi, 4.0 * math.pi / 720)


def test_of_a_sum_of_waves_it_is_parseval() -> None:
    curve = 3.0 + 2.0 * np.cos(ANGLE) - 5.0 * np.sin(1.5 * ANGLE + 0.3)
    assert root_mean_square(curve) == pytest.approx(math.sqrt(9.0 + 2.0 + 12.5), rel=1e-14)
    assert curve_mean(curve) == pytest.approx(3.0, rel=1e-13)


def test_a_constant_and_a_lost_curve() -> None:
    assert root_mean_square(-2.5) == 2.5
    assert curve_mean(-2.5) == -2.5
    assert root_mean_square(np.full((3, 1), -2.0)).tolist() == [2.0, 2.0, 2.0]
    assert np.isnan(root_mean_square([[1.0, np.nan], [1.0, 1.0]])).tolist() == [True, False]
