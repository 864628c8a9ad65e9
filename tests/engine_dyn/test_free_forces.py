"""Orders, pins, free forces and moments of layouts against a table, by sums over the cylinders."""

import cmath
import csv
import math
from pathlib import Path

import numpy as np
import pytest

from engine_dyn.forces import balance
from engine_dyn.forces.balance import RunningGear, running_gear
from engine_dyn.geometry.arrangement import FOUR_STROKE, TURN
from engine_dyn.geometry.cylinders import cylinders_of
from engine_dyn.geometry.firing_orders import (
    BOXER_ORDERS,
    IN_LINE_ORDERS,
    TWO_STROKE_BOXER_ORDERS,
    TWO_STROKE_IN_LINE_ORDERS,
    VEE_ORDERS,
    VR_ORDERS,
    KnownOrder,
)
from engine_dyn.geometry.layouts import arrangement_from_text

TABLE = Path(__file__).parents[1] / "reference" / "free_forces_and_moments.csv"
PAGE = Path(__file__).parents[2] / "docs" / "layouts.md"
SHOWN = PAGE.with_suffix(".csv")
RADIUS, MASS, SPEED, RATIO, SPACING = 0.05, 0.8, 100.0, 0.28, 0.11
UNIT = MASS * RADIUS * SPEED**2
A2 = float(balance.acceleration_harmonics(2.0, RATIO).real)  # the table's lambda, exact
DIGITS = 6e-5
"""Half of the table's last digit, and a little."""

Row = dict[str, str]


def rows() -> list[Row]:
    lines = TABLE.read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


ROWS = rows()
EACH = pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row['layout']}, {row['cycle']}")


def cylinders_of_row(row: Row) -> list[tuple[float, int, int, float]]:
    """Direction [rad], bank, place along the shaft and firing angle [rad] of cylinders 1, 2, ..."""
    order = [int(number) for number in row["order"].split("-")]
    count = len(order)
    intervals = [math.radians(float(word)) for word in row["intervals"].split()]
    firing, angle = {}, 0.0
    for step, number in enumerate(order):
        firing[number] = angle
        angle += intervals[step % len(intervals)]
    assert math.degrees(angle) == pytest.approx(float(row["cycle"]))
    banks = [math.radians(float(word)) for word in row["banks"].split()]
    banks = banks or [math.tau * number / count for number in range(count)]
    in_bank = count // len(banks)
    bank_and_place = {
        "line": lambda k: (0, k),
        "banks": lambda k: (k // in_bank, k % in_bank),
        "alternate": lambda k: (k % 2, k // 2),
        "in turns": lambda k: (k % 2, k),
        "radial": lambda k: (k, 0),
        "two-row": lambda k: (k, k % 2),
    }[row["numbering"]]
    found = []
    for k in range(count):
        bank, place = bank_and_place(k)
        found.append((banks[bank], bank, place, firing[k + 1]))
    return found


def pins_of_row(row: Row) -> list[float]:
    """Direction of each cylinder's pin [degree]: its bank's, less the angle at which it fires."""
    return [math.degrees(bank - firing) for bank, _, _, firing in cylinders_of_row(row)]


def halves(row: Row, nu: int, moment: bool) -> tuple[float, float]:
    """Parts of an order that turn forward and backward, from sums over the cylinders."""
    cylinders = cylinders_of_row(row)
    places = [place for _, _, place, _ in cylinders]
    middle, offset = 0.5 * (min(places) + max(places)), float(row["bank_offset"])
    forward = backward = 0j
    for direction, bank, place, firing in cylinders:
        lever = place - middle + offset * (bank - 0.5) if moment else 1.0
        forward += 0.5 * lever * cmath.exp(1j * (direction - nu * firing))
        backward += 0.5 * lever * cmath.exp(1j * (direction + nu * firing))
    return abs(forward), abs(backward)


def printed(text: str) -> tuple[float, float]:
    """Parts that turn forward and backward of an entry such as '2.1213 1.2247 forward'."""
    if text == "0":
        return 0.0, 0.0
    *numbers, sense = text.split()
    largest = float(numbers[0])
    if sense == "line":
        return 0.5 * largest, 0.5 * largest
    smallest = float(numbers[1]) if len(numbers) > 1 else largest
    larger, smaller = 0.5 * (largest + smallest), 0.5 * (largest - smallest)
    return (larger, smaller) if sense == "forward" else (smaller, larger)


COLUMNS = [
    ("first_force", 1, False), ("first_moment", 1, True), ("second_force", 2, False),
    ("second_moment", 2, True),
]  # fmt: skip


def period_of(row: Row) -> float:
    return FOUR_STROKE if row["cycle"] == "720" else TURN


def gear(row: Row, turning_mass: float = 0.0) -> RunningGear:
    engine = cylinders_of(arrangement_from_text(row["layout"], period_of(row)))
    return running_gear(
        engine, RATIO, RADIUS, MASS, SPEED,
        spacing=SPACING, bank_offset=SPACING * float(row["bank_offset"]), turning_mass=turning_mass,
    )  # fmt: skip


@EACH
def test_the_table_is_the_sum_over_the_cylinders(row: Row) -> None:
    for column, nu, moment in COLUMNS:
        assert halves(row, nu, moment) == pytest.approx(printed(row[column]), abs=DIGITS), column
    for column, moment in (("first_force_left", False), ("first_moment_left", True)):
        assert halves(row, 1, moment)[1] == pytest.approx(float(row[column]), abs=DIGITS), column


@EACH
def test_a_layout_is_the_engine_of_the_table(row: Row) -> None:
    """Order, evenness and the pins: bank angle less firing angle, split in the right sense."""
    made = arrangement_from_text(row["layout"], period_of(row))
    order = tuple(int(number) for number in row["order"].split("-"))
    assert made.firing_order == order
    assert made.is_even == (len({word for word in row["intervals"].split() if word != "0"}) == 1)
    for cylinder, pin in zip(made.cylinders, pins_of_row(row), strict=True):
        angle = math.degrees(made.throws[cylinder.throw].angle)
        assert math.remainder(angle - pin, 360.0) == pytest.approx(0.0, abs=1e-6)
    widest = 0.0
    for one in made.throws:
        for other in made.throws:
            if one.position == other.position:
                widest = max(widest, abs(math.remainder(one.angle - other.angle, math.tau)))
    assert math.degrees(widest) == pytest.approx(float(row["split"]), abs=1e-6)


@EACH
def test_shaking_forces_are_those_of_the_table(row: Row) -> None:
    phi = np.linspace(0.0, math.tau, 721)
    found = gear(row)
    for column, nu, moment in COLUMNS:
        forward, backward = printed(row[column])
        scale = UNIT * (SPACING if moment else 1.0) * (A2 if nu == 2 else 1.0)
        ellipse = found.moment_ellipse(float(nu)) if moment else found.force_ellipse(float(nu))
        assert ellipse.major / scale == pytest.approx(forward + backward, abs=2 * DIGITS), column
        assert ellipse.minor / scale == pytest.approx(abs(forward - backward), abs=2 * DIGITS), (
            column
        )
        curve = found.moment_of_order(nu, phi) if moment else found.force_of_order(nu, phi)
        # The sense: the area that the vector sweeps is positive where more turns with the shaft.
        swept = float((np.conj(curve[:-1]) * curve[1:]).imag.sum()) / scale**2
        turned = forward**2 - backward**2
        assert swept == pytest.approx(math.tau * nu * turned, rel=1e-3, abs=1e-2), column


@EACH
def test_counterweights_leave_what_turns_backward(row: Row) -> None:
    found = gear(row, turning_mass=-0.5 * MASS)
    force = found.force_ellipse(1.0).major / UNIT
    moment = found.moment_ellipse(1.0).major / (UNIT * SPACING)
    assert force == pytest.approx(float(row["first_force_left"]), abs=DIGITS)
    assert moment == pytest.approx(float(row["first_moment_left"]), abs=DIGITS)


def vee_texts(known: dict[int, tuple[KnownOrder, ...]]) -> set[str]:
    """Layouts of V engines that need no order, of each bank angle that is one."""
    return {
        f"V{count} {angle:g} {pins}-pin {entry.crank}".strip()
        for count, entries in known.items()
        for entry in entries
        for angle, pins in entry.built
        if angle is not None
    }


def test_every_layout_that_needs_no_order_is_in_the_table() -> None:
    known = {
        FOUR_STROKE: {
            *(f"in-line {count}" for count in IN_LINE_ORDERS),
            *(f"boxer {count}" for count in BOXER_ORDERS),
            *vee_texts(VEE_ORDERS),
            *(f"VR{count} 15" for count in VR_ORDERS),
        },
        TURN: {
            *(f"in-line {count}" for count in TWO_STROKE_IN_LINE_ORDERS),
            *(f"boxer {count}" for count in TWO_STROKE_BOXER_ORDERS),
        },
    }
    for period, texts in known.items():
        listed = [
            arrangement_from_text(row["layout"], period).name
            for row in ROWS
            if period_of(row) == period
        ]
        for text in texts:
            assert arrangement_from_text(text, period).name in listed, text


def test_a_refusal_names_what_needs_no_order() -> None:
    with pytest.raises(ValueError, match="without an order: 'V10 90 shared-pin', 'V10 90 split"):
        arrangement_from_text("V10 72")
    with pytest.raises(ValueError, match=r"such as 1-2-4-6-8-9-7-5-3$"):
        arrangement_from_text("in-line 9")
    assert arrangement_from_text("in-line 9 1-2-4-6-8-9-7-5-3").is_even


def test_the_page_of_layouts_has_the_table() -> None:
    assert f":file: {SHOWN.name}\n" in PAGE.read_text(encoding="utf-8")
    lines = list(csv.reader(SHOWN.read_text(encoding="utf-8").splitlines()))
    for row in ROWS:
        name = row["layout"] + (" (two-stroke)" if row["cycle"] == "360" else "")
        alternate = " alternate" if row["numbering"] == "alternate" else ""
        cells = [
            name, row["order"] + alternate, row["split"], row["first_force"], row["first_moment"],
            row["second_force"], row["second_moment"],
            f"{row['first_force_left']}, {row['first_moment_left']}",
        ]  # fmt: skip
        assert cells in lines, name
