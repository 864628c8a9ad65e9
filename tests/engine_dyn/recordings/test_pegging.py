"""Absolute pressure from the inlet and from the compression, against known offsets."""

import numpy as np
import pytest

from engine_dyn.recordings.cylinder_geometry import RecordedCycles
from engine_dyn.recordings.level import peg_by_compression, peg_to_inlet
from tests.support import recorded_engine as engine

DEGREE = engine.DEGREE
ANGLE = np.arange(-360.0, 360.0, 1.0) * DEGREE


def polytropic(
    exponent: float, offset: float, noise: float = 0.0, count: int = 1
) -> RecordedCycles:
    """p V^n = const on both sides of dead centre, less an offset."""
    v = engine.volume(ANGLE)
    p = 1e5 * (v.max() / v) ** exponent - offset
    rng = np.random.default_rng(3)
    return RecordedCycles(ANGLE, p + noise * rng.standard_normal((count, len(p))))


@pytest.mark.parametrize("given", [1.33, None])
def test_an_offset_is_found(given: float | None) -> None:
    found = peg_by_compression(polytropic(1.33, 7e4), engine.GEOMETRY, given)
    np.testing.assert_allclose(found.offset, 7e4, rtol=1e-6)
    np.testing.assert_allclose(found.exponent, 1.33, rtol=1e-6)
    np.testing.assert_allclose(found.cycles.pressure, polytropic(1.33, 0.0).pressure, rtol=1e-6)


def test_the_uncertainty_covers_noise_and_exponent() -> None:
    found = peg_by_compression(polytropic(1.33, 7e4, 2e3, 400), engine.GEOMETRY, None)
    z = (found.offset - 7e4) / found.uncertainty
    assert 0.85 < z.std() < 1.15  # 400 normal values: a standard error of 0.035
    assert abs(z.mean()) < 0.2
    # A wrong exponent moves the offset by as much as its deviation says.
    wrong = peg_by_compression(
        polytropic(1.35, 7e4), engine.GEOMETRY, 1.33, exponent_deviation=0.02
    )
    assert abs(wrong.offset[0] - 7e4) == pytest.approx(wrong.uncertainty[0], rel=0.1)


def test_each_cycle_gets_the_inlet_pressure() -> None:
    base = engine.cycles(1.0, 3)
    drifting = base.pressure + np.array([[0.0], [2e4], [-5e4]])
    recorded = RecordedCycles(base.angle, drifting)
    found = peg_to_inlet(recorded, 0.98e5, inlet_uncertainty=1e3)
    np.testing.assert_allclose(np.diff(found.offset), [-2e4, 7e4], rtol=1e-9)
    at = np.argmin(np.abs(base.angle + np.pi))
    np.testing.assert_allclose(found.cycles.pressure[:, at], 0.98e5, rtol=1e-3)
    assert np.all(found.uncertainty >= 1e3)


def test_the_window_wraps_around_the_end_of_the_cycle() -> None:
    p = np.where(np.abs(ANGLE) > 358.5 * DEGREE, 3.0, 1.0)[None]
    found = peg_to_inlet(RecordedCycles(ANGLE, p), 10.0, -2.0 * np.pi, 2.0 * DEGREE)
    assert found.offset[0] == pytest.approx(7.0)
