"""Works, heat release and exponents against cycles in which they are known."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from engine_dyn.geometry.arrangement import TWO_STROKE
from engine_dyn.recordings.cylinder_geometry import RecordedCycles
from engine_dyn.recordings.heat_release import (
    heat_release,
    mean_pressures,
    peak_pressures,
    polytropic_exponent,
)
from tests.support import recorded_engine as engine

DEGREE = engine.DEGREE


def test_volume_is_that_of_the_triangle() -> None:
    angle = np.linspace(-7.0, 7.0, 101)
    np.testing.assert_allclose(engine.GEOMETRY.volume(angle), engine.volume(angle), rtol=1e-12)
    slope = (engine.volume(angle + 1e-6) - engine.volume(angle - 1e-6)) / 2e-6
    np.testing.assert_allclose(engine.GEOMETRY.volume_slope(angle), slope, atol=1e-10)


def smooth_pressure(angle: np.ndarray) -> np.ndarray:
    """A closed curve with a peak, of which no formula for the work is needed."""
    return 1e5 * (
        1.0 + 30.0 * np.exp(-12.0 * (1.0 - np.cos(0.5 * angle - 0.1))) + 0.2 * np.sin(0.5 * angle)
    )


@pytest.mark.parametrize("even", [True, False])
def test_works_are_the_integrals(even: bool) -> None:
    if even:
        angle = np.arange(-360.0, 360.0, 1.0) * DEGREE
    else:
        rng = np.random.default_rng(2)
        angle = np.sort(rng.uniform(-360.0, 360.0, 1500)) * DEGREE
    found = mean_pressures(RecordedCycles(angle, smooth_pressure(angle)[None]), engine.GEOMETRY)

    def work(start: float, end: float) -> float:
        value, _ = quad(
            lambda phi: float(smooth_pressure(phi) * engine._slope(phi)), start, end, limit=200
        )
        return value / engine.SWEPT

    gross = work(-math.pi, math.pi)
    pumping = work(-2.0 * math.pi, -math.pi) + work(math.pi, 2.0 * math.pi)
    assert found.gross[0] == pytest.approx(gross, rel=2e-6)
    assert found.pumping[0] == pytest.approx(pumping, rel=2e-5)
    assert found.net[0] == pytest.approx(gross + pumping, rel=2e-6)


def test_a_two_stroke_cycle_has_no_pumping() -> None:
    angle = np.arange(-180.0, 180.0, 1.0) * DEGREE
    recorded = RecordedCycles(angle, np.full((2, 360), 1e5), TWO_STROKE)
    found = mean_pressures(recorded, engine.GEOMETRY)
    np.testing.assert_allclose(found.net, 0.0, atol=1e-6)
    np.testing.assert_array_equal(found.pumping, 0.0)


def test_the_heat_that_burns_is_found() -> None:
    recorded = engine.cycles(0.5, heat=1500.0, gamma=1.36, fall=0.0, loss=0.0)
    found = heat_release(recorded, engine.GEOMETRY, 1.36)
    np.testing.assert_allclose(found.heat[0], 1500.0 * engine.burnt(found.angle), atol=3.0)
    assert found.rate.shape == found.heat.shape == (1, len(found.angle))


def test_the_loss_to_the_walls_is_missing_in_the_net_heat() -> None:
    recorded = engine.cycles(0.5, heat=1500.0, gamma=1.36, fall=0.0, loss=5.0)
    found = heat_release(recorded, engine.GEOMETRY, 1.36)
    p = engine.pressure(found.angle, gamma=1.36, fall=0.0, loss=5.0)
    pv = p * engine.volume(found.angle) / (1e5 * engine.volume(engine.CLOSES))
    excess = np.maximum(pv - 1.0, 0.0) * (p / 1e5) ** 0.7
    lost = 5.0 * float(np.sum(0.5 * (excess[1:] + excess[:-1]) * np.diff(found.angle)))
    burnt = 1500.0 * float(engine.burnt(found.angle[-1]) - engine.burnt(found.angle[0]))
    assert lost > 100.0
    assert found.heat[0, -1] == pytest.approx(burnt - lost, abs=4.0)


def test_exponents_of_an_adiabatic_cycle() -> None:
    recorded = engine.cycles(1.0, gamma=1.37, fall=0.0, loss=0.0)
    compression = polytropic_exponent(recorded, engine.GEOMETRY, -100 * DEGREE, -20 * DEGREE)
    expansion = polytropic_exponent(recorded, engine.GEOMETRY, 80 * DEGREE, 120 * DEGREE)
    assert compression.value[0] == pytest.approx(1.37, abs=1e-5)
    assert expansion.value[0] == pytest.approx(1.37, abs=1e-4)
    with pytest.raises(ValueError, match="fewer than four samples"):
        polytropic_exponent(recorded, engine.GEOMETRY, 0.0, 0.01)


def test_the_standard_error_of_an_exponent() -> None:
    recorded = engine.cycles(1.0, 300, noise=2e3, loss=0.0)
    found = polytropic_exponent(recorded, engine.GEOMETRY, -60 * DEGREE, -20 * DEGREE)
    assert found.value.std() == pytest.approx(found.uncertainty.mean(), rel=0.25)


def test_peaks_between_samples() -> None:
    angle = np.arange(-360.0, 360.0, 2.0) * DEGREE
    tops = np.array([0.13, -0.021, 0.2])
    p = 5e6 - 1e7 * (angle - tops[:, None]) ** 2
    value, place = peak_pressures(RecordedCycles(angle, p))
    np.testing.assert_allclose(place, tops, atol=1e-12)
    np.testing.assert_allclose(value, 5e6, rtol=1e-12)
