"""Families over load and speed: rows, blends, the family over load as a limit, gaps."""

from typing import Any

import numpy as np
import pytest

from engine_dyn.pressure.diagram import Diagram, diagram_from_points
from engine_dyn.pressure.family import family_from_diagrams
from engine_dyn.pressure.family_grid import SPEED_STEP, FamilyGrid, grid_from_diagrams

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


def test_at_a_given_speed_it_is_the_family_over_load(grid: FamilyGrid) -> None:
    family = family_from_diagrams(LOADS, [d for _, s, d in entries() if s == 1500.0 * RPM])
    for load in (0.0, 12.3, 50.0, 79.9):
        np.testing.assert_array_equal(
            grid.at(load, 1500.0 * RPM).pressure, family.at(load).pressure
        )


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


def test_peaks_move_without_two_humps(grid: FamilyGrid) -> None:
    curve = grid.at(65.0, 2000.0 * RPM)
    inside = curve.pressure[np.abs(curve.angle) < 60.0 * DEGREE]
    turns = np.sum(np.diff(np.sign(np.diff(inside))) != 0)
    assert turns == 1
    assert curve.peak_angle / DEGREE == pytest.approx(8.0, abs=0.2)
    corners = [grid.peak(load, s * RPM) for load in (50.0, 80.0) for s in (1500.0, 3000.0)]
    assert min(corners) < curve.peak < max(corners)


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


def test_rows_are_close_together(grid: FamilyGrid) -> None:
    assert grid.speed_count == 1 + round(0.5 / SPEED_STEP) + round(1.0 / SPEED_STEP)
    assert grid.row_count == grid.speed_count * 161
    speeds = np.linspace(1000.0, 3000.0, 57) * RPM
    loads = np.linspace(0.0, 80.0, 31)[:, None]
    place = grid.locate(loads, speeds)
    assert place.row.shape == (31, 57)
    assert (place.row >= 0).all()
    assert (place.row < grid.row_count).all()
    last = grid.locate(80.0, 3000.0 * RPM)
    assert int(last.row) == grid.row_count - 1


def test_order_does_not_matter(grid: FamilyGrid) -> None:
    other = grid_from_diagrams(entries()[::-1])
    np.testing.assert_array_equal(
        other.at(33.0, 2222.0 * RPM).pressure, grid.at(33.0, 2222.0 * RPM).pressure
    )


def test_other_knots_are_brought_together() -> None:
    mixed = entries()
    mixed[4] = (*mixed[4][:2], diagram(60.0, 7.0, step=0.5))
    made = grid_from_diagrams(mixed)
    assert len(made.row(0).angle) == 2880


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


def test_one_speed_alone() -> None:
    one = grid_from_diagrams([e for e in entries() if e[1] == 1000.0 * RPM])
    with pytest.raises(ValueError, match="the engine has diagrams for 1000 rpm alone"):
        one.at(50.0, 1001.0 * RPM)


def test_gaps_and_other_faults() -> None:
    full = entries()
    with pytest.raises(ValueError) as caught:
        grid_from_diagrams(full[:4] + full[5:])
    assert str(caught.value) == (
        "no diagram for 50 percent at 1500 rpm: each of the 3 loads needs one at each of the 3 "
        "speeds"
    )
    with pytest.raises(ValueError, match="two diagrams for 0 percent at 1000 rpm"):
        grid_from_diagrams([*full, full[0]])
    with pytest.raises(ValueError, match="at least one diagram"):
        grid_from_diagrams([])
    with pytest.raises(ValueError, match="load -1 percent"):
        grid_from_diagrams([(-1.0, 100.0, full[0][2])])
    with pytest.raises(ValueError, match="speed 0 rpm"):
        grid_from_diagrams([(1.0, 0.0, full[0][2])])
    other = Diagram(full[0][2].angle, full[0][2].pressure, full[0][2].slope, 2.0 * np.pi)
    with pytest.raises(ValueError, match="all four-stroke or all two-stroke"):
        grid_from_diagrams([(0.0, 100.0, full[0][2]), (0.0, 200.0, other)])
    with pytest.raises(
        ValueError, match=r"10 percent at 1000 rpm and 10 percent at 2000 rpm are 80"
    ):
        grid_from_diagrams(
            [(10.0, 1000.0 * RPM, diagram(50.0, -25.0)), (10.0, 2000.0 * RPM, diagram(50.0, 55.0))]
        )
