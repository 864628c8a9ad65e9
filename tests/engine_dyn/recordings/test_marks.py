"""A mark beside a wheel: where the wheel is, whichever tooth the recording begins with."""

import numpy as np
import pytest

from engine_dyn.geometry.toothed_wheel import TURN, wheel_from_text
from engine_dyn.recordings.encoder import teeth_from_mark
from engine_dyn.recordings.teeth import find_turns
from engine_dyn.units import DEGREE
from tests.support.teeth import TurningEngine, tooth_times

ENGINE = TurningEngine(94.2)
TURNS = 12
FINE = np.linspace(0.0, TURN * (TURNS + 1), 100_001)
GAP = 40.0


def passing(degrees: float, every: int = 1, later: int = 0) -> np.ndarray:
    """Times at which the crank passes an angle, in every turn or every second one."""
    return ENGINE.time(degrees * DEGREE + TURN * np.arange(later, TURNS, every))


@pytest.mark.parametrize("cut", [0, 7, 75])
@pytest.mark.parametrize("mark", [0.0, 110.0, 345.0])
@pytest.mark.parametrize("text", ["60-2", "36-2-2-2", "360", "12"])
def test_first_tooth_and_its_angle(text: str, mark: float, cut: int) -> None:
    """Of teeth that are alike, the nearest to the mark is the first one."""
    wheel = wheel_from_text(text)
    times = tooth_times(ENGINE, wheel.width, TURNS, GAP * DEGREE)[cut:]
    found = teeth_from_mark(find_turns(times, wheel), times, passing(mark), mark * DEGREE, 2)
    assert not found.turn_known
    # the first tooth of each turn passes where it is said to be
    at = np.interp(found.teeth.time[:, 0], ENGINE.time(FINE), FINE) / DEGREE
    away = (at - found.angle / DEGREE + 180.0) % 360.0 - 180.0
    # between teeth the angle is a cubic through their times
    assert np.abs(away).max() < (0.3 if text == "12" else 0.02)
    alike = 360.0 / (wheel.teeth if wheel.even else wheel.symmetry)
    assert abs((at[0] - mark + 180.0) % 360.0 - 180.0) < 0.5 * alike + 0.3


@pytest.mark.parametrize("cut", [0, 7, 75])
@pytest.mark.parametrize("turn", [0, 1])
def test_a_mark_once_a_cycle_tells_the_turn(turn: int, cut: int) -> None:
    wheel = wheel_from_text("60-2")
    times = tooth_times(ENGINE, wheel.width, TURNS, GAP * DEGREE)[cut:]
    marks = passing(100.0, every=2, later=turn)
    teeth = find_turns(times, wheel)
    found = teeth_from_mark(teeth, times, marks, (100.0 + 360.0 * turn) * DEGREE, 2)
    assert found.turn_known
    assert found.angle / DEGREE == pytest.approx(GAP, abs=0.02)
    at = np.interp(found.teeth.time[:, 0], ENGINE.time(FINE), FINE)
    assert (np.floor(at / TURN) % 2 == found.teeth.turn % 2).all()


@pytest.mark.parametrize(
    ("marks", "said"),
    [
        (np.sort([*passing(10.0), *passing(190.0)]), "every 0.5 revolutions"),
        (passing(10.0)[:1], "passes 0 times"),
        (np.sort([*passing(10.0, 2), *passing(40.0, 2, 1)]), "degrees beside its mean place"),
    ],
)
def test_marks_that_are_none(marks: np.ndarray, said: str) -> None:
    wheel = wheel_from_text("60-2")
    times = tooth_times(ENGINE, wheel.width, TURNS, GAP * DEGREE)
    with pytest.raises(ValueError, match=said):
        teeth_from_mark(find_turns(times, wheel), times, marks, 0.0, 2)
