"""Families over load and speed: rows, blends, the family over load as a limit, gaps."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from engine_dyn.pressure.diagram import Diagram, diagram_from_points
from engine_dyn.pressure.family import family_from_diagrams
from engine_dyn.pressure.family_grid import FamilyGrid, grid_from_diagrams

DEGREE = np.pi / 180.0
BAR = 1e5
RPM = np.pi / 30.0

LOADS, SPEEDS = (0.0, 50.0, 80.0), (1000.0, 1500.0, 3000.0)


def diagram(peak: float, at: float, step: float = 1.0) -> Diagram:
    """One hump with its peak [bar] at an angle [degree]."""
    count = round(720.0 / step)
    phi = (np.arange(count) - count // 2) * step * DEGREE
    p = BAR * (1.0 + (peak - 1.0) * np.exp(60.0 * (np.cos(0.5 * (phi - at * DEGREE)) - 1.0)))
    return diagram_from_points(phi, p)


def entries() -> list[tuple[float, float, Diagram]]:
    return [
        (load, speed * RPM, diagram(40.0 + 0.5 * load - 0.002 * speed, 4.0 + 0.002 * speed))
        for load in LOADS
        for speed in SPEEDS
    ]


@pytest.fixture(scope="module")
def grid() -> FamilyGrid:
    return grid_from_diagrams(entries())


def test_given_points_come_back_exactly(grid: FamilyGrid) -> None:
    for load, speed, given in entries():
        place = grid.locate(load, speed)
        assert float(place.over_load) == float(place.over_speed) == 0.0
        assert grid.at(load, speed) is grid.row(int(place.row))
        np.testing.assert_array_equal(grid.at(load, speed).pressure, given.pressure)
        assert grid.peak(load, speed) == given.peak


def test_over_speed_it_is_as_over_load() -> None:
    """The same two diagrams, once as loads and once as speeds, give the same row between."""
    low, high = diagram(40.0, 4.0), diagram(60.0, 9.0)
    over_speed = grid_from_diagrams([(50.0, 100.0, low), (50.0, 102.0, high)])
    over_load = family_from_diagrams([0.0, 1.0], [low, high])
    assert over_speed.speed_count == 2
    middle = over_speed.at(50.0, 101.0)
    np.testing.assert_allclose(middle.pressure, 0.5 * (low.pressure + high.pressure), rtol=1e-13)
    wide = grid_from_diagrams([(50.0, 100.0, low), (50.0, 104.0, high)])
    assert wide.speed_count == 3
    np.testing.assert_array_equal(wide.row(1).pressure, over_load.row(1).pressure)


def test_between_rows_it_is_linear_in_both(grid: FamilyGrid) -> None:
    place = grid.locate(30.1, 1208.0 * RPM)
    u, v, row = float(place.over_load), float(place.over_speed), int(place.row)
    assert 0.0 < u < 1.0
    assert 0.0 < v < 1.0
    expected: Any = 0.0
    for i, a in ((0, 1.0 - u), (place.along, u)):
        for j, b in ((0, 1.0 - v), (place.across, v)):
            expected = expected + a * b * grid.row(row + i + j).pressure
    np.testing.assert_allclose(grid.at(30.1, 1208.0 * RPM).pressure, expected, rtol=1e-14)


@pytest.mark.parametrize(
    ("load", "speed", "words"),
    [
        (90.0, 1500.0, "load 90 percent is not allowed: the engine's diagrams cover 0..80 percent"),
        (50.0, 999.0, "speed 999 rpm is not allowed: the engine's diagrams cover 1000..3000 rpm"),
        (50.0, np.nan, "speed nan rpm is not allowed"),
    ],
)
def test_outside(grid: FamilyGrid, load: float, speed: float, words: str) -> None:
    for ask in (grid.locate, grid.at, grid.peak):
        with pytest.raises(ValueError) as caught:
            ask(load, speed * RPM)
        assert words in str(caught.value)
    with pytest.raises(IndexError):
        grid.row(grid.row_count)


FULL = entries()
FIRST = FULL[0][2]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (FULL[:4] + FULL[5:], "no diagram for 50 percent at 1500 rpm: each of the 3 loads needs"),
        ([*FULL, FULL[0]], "two diagrams for 0 percent at 1000 rpm"),
        ([], "at least one diagram"),
        ([(-1.0, 100.0, FIRST)], "load -1 percent"),
        ([(1.0, 0.0, FIRST)], "speed 0 rpm"),
        ([(0.0, 100.0, FIRST), (0.0, 200.0, replace(FIRST, period=2.0 * np.pi))],
         "all four-stroke or all two-stroke"),
        ([(10.0, 1000.0 * RPM, diagram(50.0, -25.0)), (10.0, 2000.0 * RPM, diagram(50.0, 55.0))],
         "10 percent at 1000 rpm and 10 percent at 2000 rpm are 80"),
    ],
)  # fmt: skip
def test_gaps_and_other_faults(given: list[Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        grid_from_diagrams(given)
