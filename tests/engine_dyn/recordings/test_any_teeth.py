"""Whatever stamps and signals come: turns that fit, or one line; warnings are errors."""

import numpy as np
import pytest

from engine_dyn.recordings.encoder import teeth_of_signal
from engine_dyn.recordings.teeth import find_turns
from engine_dyn.recordings.wheel import wheel_from_text
from tests.support.teeth import TurningEngine, tooth_times

WHEELS = [wheel_from_text(t) for t in ("60-2", "36-1", "36-2-1", "4-1", "1", "3", "12", "2-1")]


def some_times(generator: np.random.Generator) -> np.ndarray:
    """Times of a wheel's teeth, some of them lost, added, cut off, random, or of absurd size."""
    wheel = WHEELS[generator.integers(len(WHEELS))]
    times = tooth_times(TurningEngine(), wheel.width, int(generator.integers(1, 8)))
    kind = generator.integers(6)
    if kind == 0:
        return np.delete(times, generator.integers(0, times.size, generator.integers(0, 4)))
    if kind == 1:
        more = generator.uniform(times[0], times[-1], generator.integers(0, 5))
        return np.sort(np.append(times, more))
    if kind == 2:
        return np.cumsum(generator.exponential(1e-3, generator.integers(0, 300)))
    if kind == 3:
        return times * 10.0 ** generator.integers(-300, 300)
    return times[: generator.integers(0, times.size)] if kind == 4 else times


def some_signal(generator: np.random.Generator) -> np.ndarray:
    """Noise, squares, sines too fast for their samples, steps, gaps, and absurd sizes."""
    count, kind = int(generator.integers(0, 2000)), generator.integers(6)
    noise = generator.standard_normal(count)
    wave = np.sin(np.arange(count) * generator.uniform(0.01, 3.2))
    signals = (
        noise,
        np.sign(wave),
        noise * 10.0 ** generator.integers(-320, 308),
        np.round(noise),
        np.where(generator.random(count) < 0.01, np.nan, noise),
        wave,
    )
    return signals[kind]


@pytest.mark.parametrize("seed", range(8))
def test_any_times(seed: int) -> None:
    generator = np.random.default_rng(seed)
    for _ in range(60):
        times, wheel = some_times(generator), WHEELS[generator.integers(len(WHEELS))]
        try:
            found = find_turns(times, wheel)
        except ValueError as refused:
            assert "\n" not in str(refused)
            continue
        assert found.time.shape == (found.turn.size, wheel.teeth + 1)
        assert np.all(found.interval > 0.0) and np.all(np.diff(found.turn) > 0)
        angle = found.angle_at(np.linspace(times[0], times[-1], 50))
        assert np.all(np.diff(angle[np.isfinite(angle)]) > -1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_any_signals(seed: int) -> None:
    generator = np.random.default_rng(seed)
    for _ in range(25):
        try:
            found = teeth_of_signal(
                some_signal(generator), 1e-5, WHEELS[generator.integers(len(WHEELS))]
            )
        except ValueError as refused:
            assert "\n" not in str(refused)
            continue
        assert np.isfinite(found.teeth.speed).all()
