"""Patterns of toothed wheels, those that look the same after a part of a turn, and any stamps."""

import re

import numpy as np
import pytest

from engine_dyn.geometry.toothed_wheel import Wheel, wheel_from_angles, wheel_from_text
from engine_dyn.recordings.measured_speed import find_gap_angle
from engine_dyn.recordings.teeth import find_turns
from tests.support.teeth import TurningEngine, tooth_times

DEGREES = np.pi / 180.0


@pytest.mark.parametrize(
    ("text", "teeth", "gaps", "symmetry", "mirrored"),
    [
        ("60-2", 58, [18.0], 1, True),
        ("36-1", 35, [20.0], 1, True),
        ("36-2-1", 33, [20.0, 30.0], 1, False),
        ("24", 24, [], 1, True),
        ("1", 1, [], 1, True),
        ("720", 720, [], 1, True),
        ("36-2-2-2", 30, [30.0] * 3, 3, True),
        ("60-2-2", 56, [18.0] * 2, 2, True),
        ("10 teeth, 2 missing, 10 teeth, 2 missing, 10 teeth, 1 missing", 30, None, 1, True),
        ("13 teeth, 2 missing, 16 teeth, 2 missing, 1 teeth, 2 missing", 30, [30.0] * 3, 1, False),
    ],
)
def test_patterns(
    text: str, teeth: int, gaps: list[float] | None, symmetry: int, mirrored: bool
) -> None:
    wheel = wheel_from_text(text)
    widths = wheel.width / DEGREES
    assert (wheel.teeth, wheel.symmetry, wheel.mirrored) == (teeth, symmetry, mirrored)
    assert widths.sum() == pytest.approx(360.0)
    assert widths[-1] == pytest.approx(widths.max())  # the first tooth follows the longest gap
    if gaps is not None:
        assert sorted(widths[widths > widths.min() * 1.5]) == pytest.approx(gaps)
        assert wheel.even == (not gaps)


def test_reversed_wheels() -> None:
    single = wheel_from_text("60-2")
    assert np.allclose(single.reversed.width, single.width)
    double = wheel_from_text("36-2-1")
    assert not np.allclose(double.reversed.width, double.width)
    assert np.allclose(double.reversed.reversed.width, double.width)


@pytest.mark.parametrize(
    "text",
    ["", "sixty", "60/2", "2-2", "60-0", "-5", "60-", "0 teeth, 1 missing", "9999-1", "3-1-1-1"],
)
def test_no_patterns(text: str) -> None:
    with pytest.raises(ValueError, match="wheel: ") as refused:
        wheel_from_text(text)
    assert "\n" not in str(refused.value)


# ---- turns of symmetric wheels

ENGINE = TurningEngine(mean=94.0)
TURNS = 24
JITTER = 1e-5  # s
GROUPS = [0.0, 10.0, 20.0, 120.0, 130.0, 140.0, 240.0, 250.0, 260.0]
WHEELS = [wheel_from_text("36-2-2-2"), wheel_from_text("36-2-2"), wheel_from_angles(GROUPS)]


def with_jitter(wheel: Wheel, seed: int = 1) -> np.ndarray:
    times = tooth_times(ENGINE, wheel.width, TURNS)
    return times + np.random.default_rng(seed).normal(0.0, JITTER, times.size)


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


# ---- whatever stamps come: turns that fit, or one line; warnings are errors

ANY = [wheel_from_text(t) for t in ("60-2", "36-1", "36-2-1", "4-1", "1", "3", "12", "2-1")]


def some_times(generator: np.random.Generator) -> np.ndarray:
    """Times of a wheel's teeth, some of them lost, added, cut off, random, or of absurd size."""
    wheel = ANY[generator.integers(len(ANY))]
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
        times, wheel = some_times(generator), ANY[generator.integers(len(ANY))]
        try:
            found = find_turns(times, wheel)
        except ValueError as refused:
            assert "\n" not in str(refused)
            continue
        assert found.time.shape == (found.turn.size, wheel.teeth + 1)
        assert np.all(found.interval > 0.0) and np.all(np.diff(found.turn) > 0)
        angle = found.angle_at(np.linspace(times[0], times[-1], 50))
        assert np.all(np.diff(angle[np.isfinite(angle)]) > -1e-9)


def repeating_wheels(count: int) -> list[tuple[list[tuple[int, int]], int]]:
    """Groups of teeth with the number missing after each, and how often they make a turn."""
    generator = np.random.default_rng(7)
    found = []
    while len(found) < count:
        groups = [
            (int(generator.integers(5, 24)), int(generator.integers(1, 4)))
            for _ in range(generator.integers(1, 4))
        ]
        groups += [(1, 1)] * int(generator.integers(0, 2))
        found.append((groups, int(generator.integers(1, 4))))
    return found


def test_a_pattern_that_is_suggested_is_that_of_a_whole_turn() -> None:
    engine = TurningEngine(waves={0.5: (0.004, 0.3), 1.0: (0.003, 1.0)})
    pasted = 0
    for groups, turns in repeating_wheels(120):
        pitches = turns * sum(map(sum, groups))
        runs = ", ".join(f"{teeth} teeth, {missing} missing" for teeth, missing in turns * groups)
        times = tooth_times(engine, wheel_from_text(runs).width, 8)
        wrong = wheel_from_text(f"{pitches}-4")
        try:
            find_turns(times, wrong)
        except ValueError as refused:
            text = re.search(r'found: wheel = "([^"]+)"', str(refused))
            if text is None:
                continue
            found = find_turns(times, wheel_from_text(text[1]))
            speed = 2.0 * np.pi * len(found.time) / np.sum(found.time[:, -1] - found.time[:, 0])
            assert speed == pytest.approx(310.0, rel=0.01), (runs, text[1])
            pasted += 1
    assert pasted > 100
