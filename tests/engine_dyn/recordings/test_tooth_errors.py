"""Errors of teeth: what can be told from the speed, and what can not."""

import numpy as np
import pytest

from engine_dyn.geometry.toothed_wheel import wheel_from_text
from engine_dyn.recordings.measured_speed import (
    cycles_of_turns,
    find_gap_angle,
    fluctuation,
    orders_of_samples,
)
from engine_dyn.recordings.teeth import find_turns
from engine_dyn.recordings.tooth_errors import (
    coasting_speed,
    orders_without_wheel,
    speed_through_wheel,
    tooth_errors,
)
from tests.support.teeth import TurningEngine, random_errors, tooth_times

ENGINE = TurningEngine()
WHEEL = wheel_from_text("60-2")
ERRORS = random_errors(WHEEL.width, 0.007, 1)
GAP = 0.7
CYCLE = 4.0 * np.pi
ANGLE = -2.0 * np.pi + CYCLE / 720 * np.arange(720)


def raw_cycles(engine: TurningEngine = ENGINE, cycles: int = 5, gap: float = GAP) -> np.ndarray:
    times = tooth_times(engine, WHEEL.width, 2 * cycles, gap, ERRORS)
    return cycles_of_turns(find_turns(times, WHEEL), 2)


def test_computed_speed_through_the_wheel_is_the_raw_speed() -> None:
    seen = speed_through_wheel(ANGLE, ENGINE.speed(ANGLE), WHEEL, GAP, CYCLE, ERRORS)
    assert np.allclose(seen, raw_cycles().mean(axis=0), rtol=1e-10)


def test_errors_are_found_with_the_true_speed() -> None:
    raw = raw_cycles().mean(axis=0)
    model = speed_through_wheel(ANGLE, ENGINE.speed(ANGLE), WHEEL, GAP, CYCLE)
    found = tooth_errors(raw.reshape(2, -1), model.reshape(2, -1), WHEEL)
    # the model is averaged between nominal places: of second order in the errors' sums
    assert np.max(np.abs(found.error - ERRORS)) < 0.05 * np.std(ERRORS)
    assert np.sum(found.error * WHEEL.width) == pytest.approx(0.0, abs=1e-12)


def test_half_orders_do_not_know_of_errors() -> None:
    """Equation (110): the difference of both turns is the same with a perfect wheel."""
    perfect = cycles_of_turns(find_turns(tooth_times(ENGINE, WHEEL.width, 4, GAP), WHEEL), 2).mean(
        axis=0
    )
    with_errors, _ = orders_without_wheel(raw_cycles().mean(axis=0).reshape(2, -1), WHEEL)
    without, _ = orders_without_wheel(perfect.reshape(2, -1), WHEEL)
    assert np.std(with_errors) > 0.01
    assert np.max(np.abs(with_errors - without)) < 0.03 * np.std(with_errors)


def test_a_coasting_run_gives_the_errors() -> None:
    """Without torques that change over the turn; time is a polynomial of the angle here."""

    def time_at(angle: np.ndarray) -> np.ndarray:
        return angle / 300.0 + 2e-6 * angle**2 + 1e-9 * angle**3

    places = np.cumsum(np.concatenate([[0.0], (WHEEL.width * (1.0 + ERRORS))[:-1]]))
    angle = np.append((2.0 * np.pi * np.arange(30)[:, None] + places).ravel(), 60.0 * np.pi)
    teeth = find_turns(time_at(angle), WHEEL)
    found = tooth_errors(teeth.speed, coasting_speed(teeth), WHEEL)
    assert np.max(np.abs(found.error - ERRORS)) < 2e-5
    with pytest.raises(ValueError, match="3 turns; must be at least 4"):
        coasting_speed(find_turns(time_at(angle[: 3 * 58 + 1]), WHEEL))


def test_uncertainty_of_errors_is_their_spread() -> None:
    """Over 300 draws of noisy recordings, errors over their uncertainty have a spread near 1."""
    generator = np.random.default_rng(7)
    model = speed_through_wheel(ANGLE, ENGINE.speed(ANGLE), WHEEL, GAP, CYCLE).reshape(2, -1)
    shown = model / (1.0 + ERRORS)
    ratios = []
    for _ in range(60):
        noise = 0.002 * generator.standard_normal((8, *shown.shape))
        found = tooth_errors(shown * np.exp(noise), np.broadcast_to(model, noise.shape), WHEEL)
        ratios.append((found.error - ERRORS) / found.uncertainty)
    # Student's t with 7 degrees of freedom has the standard deviation sqrt(7/5)
    assert np.std(ratios) == pytest.approx(np.sqrt(7.0 / 5.0), rel=0.1)


def test_corrected_fluctuation_is_the_true_one() -> None:
    raw = raw_cycles(cycles=20)
    model = speed_through_wheel(ANGLE, ENGINE.speed(ANGLE), WHEEL, GAP, CYCLE)
    noisy = raw * np.exp(0.002 * np.random.default_rng(2).standard_normal(raw.shape))
    errors = tooth_errors(noisy.mean(axis=0).reshape(2, -1), model.reshape(2, -1), WHEEL)
    true = (model.max() - model.min()) / model.mean()
    found = fluctuation(noisy, errors)
    assert abs(found.delta - true) < 3.0 * found.uncertainty
    assert fluctuation(raw).delta > true + 0.005  # raw, errors are in it
    assert found.of_cycles > found.delta  # noise of single cycles
    assert np.isnan(fluctuation(raw[:1]).uncertainty)


def test_the_gap_is_found_where_the_curves_are_most_alike() -> None:
    """Of two recordings of one wheel, which begin with the first and with the second turn."""
    times = tooth_times(ENGINE, WHEEL.width, 11, GAP, ERRORS)
    raw = [
        cycles_of_turns(find_turns(part, WHEEL), 2).mean(axis=0)
        for part in (times, times[WHEEL.teeth :])
    ]
    speed = np.broadcast_to(ENGINE.speed(ANGLE), (2, ANGLE.size))
    found = find_gap_angle(np.array(raw), ANGLE, speed, WHEEL, CYCLE)
    assert found.angle == pytest.approx(GAP, abs=0.5 * np.pi / 180.0)
    assert found.turn.tolist() == [0, 1]
    assert found.correlation[[0, 1], [0, 1]] == pytest.approx([0.93, 0.93], abs=0.04)
    known = find_gap_angle(np.array(raw), ANGLE, speed, WHEEL, CYCLE, GAP + 2.0 * np.pi)
    assert known.angle == pytest.approx(GAP)
    assert known.turn.tolist() == [0, 1]


def test_orders_of_means_between_teeth_are_those_of_the_speed() -> None:
    middle = (
        GAP + np.concatenate([WHEEL.angle, WHEEL.angle + 2 * np.pi]) + 0.5 * np.tile(WHEEL.width, 2)
    )
    width = np.tile(WHEEL.width, 2)
    given = {0.5: (3.0, 0.4), 2.0: (1.5, -1.0), 6.0: (0.4, 2.0)}
    means = 300.0 + sum(
        size * (np.sin(order * (middle + width / 2) + phase)
                - np.sin(order * (middle - width / 2) + phase)) / order / width
        for order, (size, phase) in given.items()
    )  # fmt: skip
    orders = 0.5 * np.arange(1, 13)
    amplitude, phase = orders_of_samples(means, middle, width, orders)
    for order, size, angle in zip(orders, amplitude, phase, strict=True):
        expected = given.get(float(order), (0.0, 0.0))
        assert size == pytest.approx(expected[0], abs=1e-9)
        if expected[0]:
            assert angle == pytest.approx(expected[1], abs=1e-9)
