"""Whatever stamps come: turns that fit, or one line; warnings are errors."""

import numpy as np
import pytest

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
