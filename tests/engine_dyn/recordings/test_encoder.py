"""Teeth in sampled signals and time stamps: found at their places, faults named in one line."""

import numpy as np
import pytest

from engine_dyn.geometry.toothed_wheel import wheel_from_text
from engine_dyn.recordings.encoder import teeth_of_signal
from engine_dyn.recordings.teeth import find_turns
from tests.support.teeth import TurningEngine, pulses, random_errors, tooth_times

ENGINE = TurningEngine()
INTERVAL = 1e-5
TURNS = 12


def signal_of(text: str = "60-2", *, turns: int = TURNS, edge: float = 1e-4, start: float = 0.0021):
    wheel = wheel_from_text(text)
    times = tooth_times(ENGINE, wheel.width, turns) + start
    samples = int((times[-1] + 0.0015) / INTERVAL)
    return wheel, times, pulses(times, INTERVAL, samples, edge)


@pytest.mark.parametrize("text", ["60-2", "36-1", "36-2-1", "12"])
def test_teeth_are_found_between_samples(text: str) -> None:
    wheel, times, signal = signal_of(text)
    found = teeth_of_signal(signal, INTERVAL, wheel, threshold=2.5, edge="rising")
    exact = times[: TURNS * wheel.teeth].reshape(TURNS, wheel.teeth)
    assert found.teeth.turn.tolist() == list(range(TURNS))
    assert found.teeth.faults == ()
    # a hundredth of a sample: 0.03 % of a pitch of 60 at 3000 rpm
    assert np.max(np.abs(found.teeth.time[:, :-1] - exact)) < 0.01 * INTERVAL


def test_a_weak_tooth_needs_a_low_threshold() -> None:
    """As inductive sensors show the first tooth after a gap."""
    wheel, times, signal = signal_of()
    at = INTERVAL * np.arange(signal.size)
    for start in times[:-1].reshape(TURNS, wheel.teeth)[:, 0]:
        here = (at > start - 1e-4) & (at < start + 2e-4)
        signal[here] *= 0.18
    found = teeth_of_signal(signal, INTERVAL, wheel)
    assert found.crossings.threshold < 0.18 * 5.0
    assert len(found.teeth.turn) >= TURNS - 1
    assert found.teeth.faults == ()


def test_noise_changes_times_by_what_the_slope_allows() -> None:
    wheel, times, signal = signal_of()
    noise = 0.02
    rough = signal + noise * np.random.default_rng(3).standard_normal(signal.size)
    found = teeth_of_signal(rough, INTERVAL, wheel, threshold=2.5, edge="rising")
    exact = times[: TURNS * wheel.teeth].reshape(TURNS, wheel.teeth)
    # the edge rises with 5 V tanh'(0) = 5 V/1e-4 s; the cubic passes noise on with up to 9/8
    expected = noise / (5.0 / 1e-4)
    assert 0.5 * expected < np.std(found.teeth.time[:, :-1] - exact) < 1.3 * expected


@pytest.mark.parametrize(
    ("signal", "said"),
    [
        (np.zeros(1000), "is constant at 0"),
        (np.zeros(10), "10 samples"),
        (np.append(np.ones(1000), np.nan), "sample 1001 is not a number"),
        (np.sin(np.linspace(0.0, 30.0, 1000)), "fewer than 59 pulses"),
        (np.ones((10, 100)), "samples"),
    ],
)
def test_signals_without_teeth(signal: np.ndarray, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        teeth_of_signal(signal, 1e-5, wheel_from_text("60-2"))


UNEVEN = "13 teeth, 2 missing, 16 teeth, 2 missing, 1 teeth, 2 missing"
"""One of the wheels that are called 36-2-2-2."""

SIX_GROUPS = "5 teeth, 1 missing, " * 5 + "5 teeth, 2 missing"
FIVE_GROUPS = "8 teeth, 1 missing, " * 4 + "8 teeth, 2 missing"
TEN_GROUPS = "3 teeth, 1 missing, " * 9 + "3 teeth, 2 missing"
"""All groups but one are alike."""


def stamps(text: str = "60-2") -> np.ndarray:
    return tooth_times(ENGINE, wheel_from_text(text).width, TURNS)


@pytest.mark.parametrize("doubled", [False, True])
def test_a_doubled_or_missed_tooth_costs_its_turn_and_is_named(doubled: bool) -> None:
    times, place = stamps(), 5 * 58 + 20
    if doubled:
        faulty = np.insert(times, place + 1, 0.6 * times[place] + 0.4 * times[place + 1])
    else:
        faulty = np.delete(times, place)
    found = find_turns(faulty, wheel_from_text("60-2"))
    assert found.turn.tolist() == [n for n in range(TURNS) if n != 5]
    (fault,) = found.faults
    assert "turn 6" in fault
    assert ("1 pulse too many" if doubled else "1 tooth missed") in fault
    assert not doubled or "pulse 21 is followed after 0." in fault


@pytest.mark.parametrize(
    ("real", "given", "said"),
    [
        ("36-1", "60-2", 'found: wheel = "36-1"'),
        ("60-2", "36-1", 'found: wheel = "60-2"'),
        ("60-2-2", "60-2", 'found: wheel = "60-2-2"'),
        ("36-2-2-2", "36-2-1", 'found: wheel = "36-2-2-2"'),
        (UNEVEN, "36-2-2-2", f'found: wheel = "{UNEVEN}"'),
        ("60-2", "58", "has no gap"),
        ("60", "60-2", "without a gap"),
        ("36-2-1", "36-1", 'wheel = "16 teeth, 1 missing, 17 teeth, 2 missing"'),
        (SIX_GROUPS, "60-2", f'wheel = "{SIX_GROUPS}"'),
        (FIVE_GROUPS, "36-1", f'wheel = "{FIVE_GROUPS}"'),
        (TEN_GROUPS, "40-1", f'wheel = "{TEN_GROUPS}"'),
        ("36-1", "36-2", 'found: wheel = "36-1"'),
        ("60-1", "60-2", 'found: wheel = "60-1"'),
    ],
)
def test_a_wrong_pattern_is_refused_with_what_was_found(real: str, given: str, said: str) -> None:
    with pytest.raises(ValueError, match=said) as refused:
        find_turns(stamps(real), wheel_from_text(given))
    assert "\n" not in str(refused.value)
    if "wheel = " in said:  # what is found is right
        text = str(refused.value).partition('"')[2].partition('"')[0]
        turns = find_turns(stamps(real), wheel_from_text(text))
        assert len(turns.turn) >= TURNS - 1
        # whole cycles of the series last 4 pi / mean
        cycles = turns.time[2:, 0] - turns.time[:-2, 0]
        assert np.allclose(cycles, 4.0 * np.pi / ENGINE.mean, rtol=1e-9)


def test_a_reversed_wheel_is_refused_as_such() -> None:
    """Only where the pattern is not symmetric can the sense be seen from one sensor."""
    wheel = wheel_from_text("36-2-1")
    backwards = tooth_times(ENGINE, wheel.reversed.width, TURNS)
    with pytest.raises(ValueError, match="in reverse"):
        find_turns(backwards, wheel)
    assert len(find_turns(backwards, wheel.reversed).turn) == TURNS


@pytest.mark.parametrize(
    ("times", "said"),
    [
        ([0.0, 1.0, 1.0, 2.0], "number 3 "),
        ([0.0, 1.0], "needs 59"),
        ([0.0, float("inf")], "numbers"),
    ],
)
def test_times_that_are_none(times: list[float], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        find_turns(np.array(times), wheel_from_text("60-2"))


def test_crank_angle_at_any_time() -> None:
    wheel = wheel_from_text("60-2")
    errors = random_errors(wheel.width, 0.007, 6)
    gap = 1.9
    times = tooth_times(ENGINE, wheel.width, TURNS, gap, errors)
    times = np.delete(times, 3 * 58 + 5)
    found = find_turns(times, wheel)
    angle = np.linspace(gap + 0.01, gap + 2 * np.pi * TURNS - 0.01, 5000)
    back = found.angle_at(ENGINE.time(angle), gap, errors)
    lost = (angle > gap + 6 * np.pi) & (angle < gap + 8 * np.pi)
    assert np.isnan(back[lost]).all()
    # cubic Hermite with parabolic slopes over the gap of 18 degrees: errors of 0.01 degree
    assert np.max(np.abs(back - angle)[~lost]) < 0.02 * np.pi / 180.0
    assert np.isnan(found.angle_at(np.array([times[0] - 1e-6, times[-1] + 1e-6]))).all()
