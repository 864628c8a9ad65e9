"""Drift of a recorded speed: run-ups whose repeating part is known in closed form."""

import numpy as np
import pytest

from engine_dyn.geometry.toothed_wheel import wheel_from_text
from engine_dyn.recordings.measured_speed import cycles_of_turns, steady_cycles, steady_turns
from engine_dyn.recordings.teeth import find_turns
from tests.support.teeth import TurningEngine, tooth_times

TURN = 2.0 * np.pi


def times_of(wheel: str, turns: float, ratio: float, waves: dict[float, tuple[float, float]]):
    """Times of teeth of an engine whose squared speed rises evenly, beside what repeats."""
    width = wheel_from_text(wheel).width
    angle = np.concatenate([[0.0], np.cumsum(np.resize(width, int(turns * width.size)))])
    fine = np.linspace(0.0, angle[-1], 200_001)
    level = 20.0 * np.sqrt(np.linspace(1.0, ratio**2, fine.size))
    speed = level * (1.0 + sum(a * np.cos(n * fine + b) for n, (a, b) in waves.items()))
    time = np.concatenate([[0.0], np.cumsum(0.5 * (1 / speed[1:] + 1 / speed[:-1]) * fine[1])])
    return np.interp(angle, fine, time)


def delta(cycles: np.ndarray) -> float:
    mean = cycles.mean(axis=0)
    return float(np.ptp(mean) / mean.mean())


@pytest.mark.parametrize("wheel", ["24", "36-1", "60-2"])
@pytest.mark.parametrize("turns", [2.0, 2.4, 3.7, 5.0, 12.3])
@pytest.mark.parametrize("ratio", [0.5, 1.1, 1.5, 150.0 / 63.0])
def test_delta_of_a_run_up_is_that_of_what_repeats(wheel: str, turns: float, ratio: float) -> None:
    waves = {0.5: (0.02, 0.3), 1.0: (0.03, 1.0), 2.0: (0.06, -0.5)}
    found = find_turns(times_of(wheel, turns, ratio, waves), wheel_from_text(wheel))
    still = find_turns(times_of(wheel, turns, 1.0, waves), wheel_from_text(wheel))
    steady, right = steady_turns(found, 2), delta(cycles_of_turns(still, 2))
    assert delta(steady.cycles) == pytest.approx(right, rel=0.06)
    assert steady.drift is not None
    raw = delta(cycles_of_turns(found, 2))
    assert abs(delta(steady.cycles) - right) < 0.3 * abs(raw - right) + 1e-3 * right
    assert steady.drift.last / steady.drift.first == pytest.approx(ratio, rel=0.05)
    assert np.allclose(
        steady.cycles.mean(axis=1), cycles_of_turns(found, 2).mean(axis=1), rtol=0.03
    )


@pytest.mark.parametrize("wheel", ["24", "36-1", "60-2"])
@pytest.mark.parametrize("turns", [2, 3, 8])
def test_a_steady_speed_keeps_its_bits(wheel: str, turns: int) -> None:
    times = tooth_times(TurningEngine(), wheel_from_text(wheel).width, turns)
    teeth = find_turns(times, wheel_from_text(wheel))
    found = steady_turns(teeth, 2)
    assert found.drift is None
    assert np.array_equal(found.cycles, cycles_of_turns(teeth, 2))


def test_speeds_over_the_angle_drift_as_well() -> None:
    angle = np.linspace(0.0, 6.0 * TURN, 3 * 720, endpoint=False)
    shape = 1.0 + 0.02 * np.cos(0.5 * angle) + 0.05 * np.cos(2.0 * angle + 0.4)
    width = np.full(720, 2.0 * TURN / 720)
    right = delta(shape.reshape(3, -1))
    for ratio in (0.6, 1.02, 1.8):
        cycles = (shape * 90.0 * np.sqrt(np.linspace(1.0, ratio**2, angle.size))).reshape(3, -1)
        for part in (cycles, cycles[:1]):
            assert delta(steady_cycles(part, width).cycles) == pytest.approx(right, rel=0.03)
    assert steady_cycles(shape.reshape(3, -1), width).drift is None
