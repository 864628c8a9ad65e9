"""Patterns of toothed wheels."""

import numpy as np
import pytest

from engine_dyn.recordings.wheel import wheel_from_angles, wheel_from_text

DEGREES = np.pi / 180.0


@pytest.mark.parametrize(
    ("text", "teeth", "gaps"),
    [
        ("60-2", 58, [18.0]),
        ("36-1", 35, [20.0]),
        ("36-2-1", 33, [20.0, 30.0]),
        ("24", 24, []),
        ("1", 1, []),
        ("13 teeth, 2 missing, 16 teeth, 2 missing, 1 teeth, 2 missing", 30, [30.0, 30.0, 30.0]),
    ],
)
def test_patterns(text: str, teeth: int, gaps: list[float]) -> None:
    wheel = wheel_from_text(text)
    widths = wheel.width / DEGREES
    assert wheel.teeth == teeth
    assert widths.sum() == pytest.approx(360.0)
    assert sorted(widths[widths > widths.min() * 1.5]) == pytest.approx(gaps)
    assert widths[-1] == pytest.approx(widths.max())  # the first tooth follows the longest gap
    assert wheel.even == (not gaps)


def test_groups_of_36_2_1_follow_each_other() -> None:
    """33 teeth are groups of 17 and 16; the group that precedes the longer gap comes last."""
    wheel = wheel_from_text("36-2-1")
    long = np.flatnonzero(wheel.width > 15.0 * DEGREES)
    assert long.tolist() == [15, 32]
    same = wheel_from_text("17 teeth, 2 missing, 16 teeth, 1 missing")
    assert np.allclose(same.angle, wheel.angle)


def test_given_teeth_may_start_anywhere() -> None:
    wheel = wheel_from_angles(np.arange(100.0, 100.0 + 348.0, 6.0).tolist())
    assert np.allclose(wheel.angle, wheel_from_text("60-2").angle)
    turned = wheel_from_angles([0.0, 30.0, 200.0, 210.0])
    assert np.allclose(turned.width / DEGREES, [10.0, 150.0, 30.0, 170.0])


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


@pytest.mark.parametrize("angles", [[], [0.0, 0.0], [3.0, 2.0], [0.0, 360.0], [float("nan")]])
def test_no_lists_of_teeth(angles: list[float]) -> None:
    with pytest.raises(ValueError, match="wheel: "):
        wheel_from_angles(angles)
