"""Tables of modelled cycles: rows made in batches are those that families make one by one."""

import math
from typing import Any

import numpy as np
import pytest

from engine_dyn.pressure.cycle_table import CycleTable, ModelledDiagram
from engine_dyn.pressure.family import family_from_diagrams
from engine_dyn.pressure.family_grid import grid_from_diagrams
from engine_dyn.pressure.first_law import FourStrokeCycle
from engine_dyn.pressure.motored import peak_with_factor, row_with_factor
from engine_dyn.units import DEGREE
from tests.support.cycles import SPARK, WALL, built

BAR = 1e5
LOADS = [30.0, 60.0, 100.0]
STARTS = np.array([-30.0, -18.0, -5.0]) * DEGREE
HEATS = np.array([9.0, 12.0, 14.0]) * BAR


def cycles(speed: float = 1800.0) -> list[ModelledDiagram]:
    values = {**SPARK, **WALL["woschni"], "speed": speed}
    return [
        ModelledDiagram(built(FourStrokeCycle, values, intake_pressure=p), 0.5)
        for p in (0.5, 0.7, 0.95)
    ]


def changed(number: int) -> dict[str, float]:
    return {"combustion_start": float(STARTS[number]), "heat": float(HEATS[number])}


@pytest.fixture
def table() -> CycleTable:
    own = family_from_diagrams(LOADS, [one() for one in cycles()])
    return CycleTable.of(own, cycles(), {"combustion_start": STARTS, "heat": HEATS})


def families() -> list[Any]:
    return [family_from_diagrams(LOADS, [one(**changed(i)) for one in cycles()]) for i in range(3)]


def test_rows_are_those_of_each_family(table: CycleTable) -> None:
    """Given diagrams to the bit; between them to what rounding leaves of the spline."""
    rows = table.own.row_count
    for number, family in enumerate(families()):
        for row in (0, 7, 60, 101, rows - 1):
            found, expected = table.row(number * rows + row), family.row(row)
            given = row in (0, 60, rows - 1)
            np.testing.assert_allclose(
                found.pressure, expected.pressure, rtol=0.0 if given else 1e-13
            )
            largest = np.abs(expected.slope).max()
            np.testing.assert_allclose(
                found.slope, expected.slope, atol=0.0 if given else 1e-11 * largest
            )


def test_bits_do_not_depend_on_what_is_made_together(table: CycleTable) -> None:
    rows = np.array([0, 3, 60, 200, 290, 405, 422])
    whole = table.curves(rows)
    for chosen in (rows[::-1], rows[2:3], rows[[1, 5]]):
        alone = table.emptied()
        alone.use_threads(1)
        found = alone.curves(chosen)
        places = np.searchsorted(rows, chosen)
        np.testing.assert_array_equal(
            found.pressure[found.rows], whole.pressure[whole.rows[places]]
        )
        np.testing.assert_array_equal(found.slope[found.rows], whole.slope[whole.rows[places]])


def test_a_cylinder_that_burns_less(table: CycleTable) -> None:
    place = table.row_of(1, np.add(*table.locate(np.array([45.2, 60.0]))))
    family = families()[1]
    family = family_from_diagrams(
        LOADS,
        [
            type(d)(
                d.angle, d.pressure, d.slope, d.period,
                lambda c=c: c(combustion_start=float(STARTS[1]), heat=0.0),
            )
            for d, c in zip(family.diagrams, cycles(), strict=True)
        ],
    )  # fmt: skip
    expected = peak_with_factor(np.add(*family.locate(np.array([45.2, 60.0]))), family, 0.4)
    np.testing.assert_allclose(peak_with_factor(place, table, 0.4), expected, rtol=1e-9)
    row = int(place[1])
    found = row_with_factor(table, row, 0.4)
    own = row_with_factor(family, 60, 0.4)
    np.testing.assert_allclose(found.pressure, own.pressure, rtol=1e-12)


def test_diagrams_over_speed() -> None:
    speeds = np.array([1000.0, 1800.0]) * math.pi / 30.0
    of_speeds = [cycles(1000.0)[:2], cycles(1800.0)[:2]]

    def grid(**changes: float) -> Any:
        return grid_from_diagrams(
            [
                (load, float(speed), one(**changes))
                for speed, column in zip(speeds, of_speeds, strict=True)
                for load, one in zip(LOADS[:2], column, strict=True)
            ]
        )

    turning = np.array([1000.0, 1234.5, 1800.0]) * math.pi / 30.0
    in_order = [one for column in of_speeds for one in column]
    table = CycleTable.of(
        grid().at_speeds(turning), in_order, {"combustion_start": STARTS, "heat": HEATS}
    )
    for number in range(3):
        own = grid(**changed(number)).at_speeds(turning)
        for load, speed in ((30.0, 0), (44.4, 1), (60.0, 1), (51.0, 2)):
            place = own.place(load, turning[speed])
            found = table.peak_between(table.row_of(number, place))
            np.testing.assert_allclose(found, own.peak_between(place), rtol=1e-9)


def test_what_is_no_cycle_touches_no_other(table: CycleTable) -> None:
    heats = np.array([9.0, 150.0, 14.0]) * BAR
    mixed = CycleTable.of(table.own, table.cycles, {"combustion_start": STARTS, "heat": heats})
    place = mixed.row_of(np.arange(3), np.add(*mixed.locate(41.3)))
    assert mixed.known(place).tolist() == [True, False, True]
    assert np.isfinite(mixed.peak_between(place)).all()
    assert mixed.peak_between(place)[0] == table.peak_between(place[:1])[0]
    assert "heat = 150 bar: must be lower; the gas would become hotter" in mixed.refusal(1)
    assert not mixed.diagrams_known(np.array([1])).any()
