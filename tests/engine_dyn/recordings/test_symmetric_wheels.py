"""Wheels that look the same after a part of a turn: their turns are counted on from one group."""

import numpy as np
import pytest

from engine_dyn.recordings.measured_speed import find_gap_angle
from engine_dyn.recordings.teeth import find_turns
from engine_dyn.recordings.wheel import Wheel, wheel_from_angles, wheel_from_text
from tests.support.teeth import TurningEngine, tooth_times

ENGINE = TurningEngine(mean=94.0)
TURNS = 24
JITTER = 1e-5  # s
GROUPS = [0.0, 10.0, 20.0, 120.0, 130.0, 140.0, 240.0, 250.0, 260.0]
WHEELS = [wheel_from_text("36-2-2-2"), wheel_from_text("36-2-2"), wheel_from_angles(GROUPS)]


def with_jitter(wheel: Wheel, seed: int = 1) -> np.ndarray:
    times = tooth_times(ENGINE, wheel.width, TURNS)
    return times + np.random.default_rng(seed).normal(0.0, JITTER, times.size)


@pytest.mark.parametrize(
    ("text", "symmetry", "mirrored"),
    [
        ("36-2-2-2", 3, True),
        ("60-2-2", 2, True),
        ("60-2", 1, True),
        ("36-2-1", 1, False),
        ("720", 1, True),
        ("10 teeth, 2 missing, 10 teeth, 2 missing, 10 teeth, 1 missing", 1, True),
        ("13 teeth, 2 missing, 16 teeth, 2 missing, 1 teeth, 2 missing", 1, False),
    ],
)
def test_symmetry(text: str, symmetry: int, mirrored: bool) -> None:
    wheel = wheel_from_text(text)
    assert wheel.symmetry == symmetry
    assert wheel.mirrored == mirrored


@pytest.mark.parametrize("wheel", WHEELS, ids=lambda wheel: wheel.text)
def test_every_turn_begins_with_the_same_tooth(wheel: Wheel) -> None:
    times = with_jitter(wheel)
    apart = wheel.teeth // wheel.symmetry
    for begin in (1, apart + 1, 7):
        found = find_turns(times[begin:], wheel)
        first = -(-begin // apart) * apart
        assert found.first == first - begin
        assert found.faults == ()
        assert np.array_equal(
            found.time[:, 0], times[first : times.size - wheel.teeth : wheel.teeth]
        )


@pytest.mark.parametrize("wheel", WHEELS, ids=lambda wheel: wheel.text)
def test_a_fault_does_not_change_the_first_tooth(wheel: Wheel) -> None:
    times = with_jitter(wheel)
    for damaged in (
        np.delete(times, 5 * wheel.teeth + 1),
        np.sort(np.append(times, times[7 * wheel.teeth + 1 : 7 * wheel.teeth + 3].mean())),
    ):
        found = find_turns(damaged, wheel)
        assert len(found.turn) == TURNS - 1
        assert len(found.faults) == 1
        assert np.isin(found.time[:, 0], times[:: wheel.teeth]).all()


def test_the_first_tooth_may_be_given() -> None:
    wheel = WHEELS[0]
    times = with_jitter(wheel)
    for first in (20, 20 + 5 * 30, times.size - 11):
        found = find_turns(times, wheel, first)
        assert np.isin(found.time[:, 0], times[first % 30 :: 30]).all()
        assert len(found.turn) >= TURNS - 1
    with pytest.raises(ValueError, match=r"pulse 24 is not the first of a group.*pulse 21 is one"):
        find_turns(times, wheel, 23)
    with pytest.raises(ValueError, match="pulse 999; must be 1 to 721"):
        find_turns(times, wheel, 998)
    even = wheel_from_text("36")
    assert find_turns(tooth_times(ENGINE, even.width, 5), even, 40).first == 4


def test_a_wheel_that_is_the_same_in_reverse_is_not_refused() -> None:
    """Which of its longest gaps is called the last is another one in reverse."""
    wheel = wheel_from_text("10 teeth, 2 missing, 10 teeth, 2 missing, 10 teeth, 1 missing")
    for seed in range(10):
        assert len(find_turns(with_jitter(wheel, seed), wheel).turn) >= TURNS - 1


def test_recordings_that_begin_with_other_groups_are_put_in_order() -> None:
    wheel, gap = WHEELS[0], np.deg2rad(50.0)
    angle = np.deg2rad(np.arange(-360.0, 360.0))
    engines = [TurningEngine(waves={0.5: (0.02, one), 1.0: (0.015, 1.0)}) for one in (0.4, 2.0)]
    raw = []
    for engine, late in zip(engines, (0, 20), strict=True):
        times = tooth_times(engine, wheel.width, 3, gap)[late : late + 61]
        raw.append(np.tile(wheel.width, 2) / np.diff(times))
    speeds = np.array([engine.speed(angle) for engine in engines])
    known = find_gap_angle(np.array(raw), angle, speeds, wheel, 4 * np.pi, gap, groups=3)
    free = find_gap_angle(np.array(raw), angle, speeds, wheel, 4 * np.pi, groups=3)
    for found in (known, free):
        assert found.angle == pytest.approx(gap, abs=np.deg2rad(0.5))
        assert found.late.tolist() == [0, 20]
        assert np.allclose(found.start, gap + np.deg2rad([0.0, 240.0]), atol=np.deg2rad(0.5))
        for engine, row in zip(engines, found.from_first_tooth(raw), strict=True):
            times = tooth_times(engine, wheel.width, 2, gap)
            assert np.allclose(row, np.tile(wheel.width, 2) / np.diff(times))
