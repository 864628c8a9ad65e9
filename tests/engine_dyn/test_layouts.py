"""Customary arrangements against facts of textbooks and service manuals."""

import math

import numpy as np
import pytest

from engine_dyn.geometry.arrangement import Arrangement, customary_order
from engine_dyn.geometry.cylinders import even_cylinders
from engine_dyn.geometry.firing_orders import (
    in_line_order_by_rule,
)
from engine_dyn.geometry.layouts import arrangement_from_text, vee, w_engine

TURN = 2.0 * math.pi
CYCLE = 2.0 * TURN
DEGREE = math.pi / 180.0


def in_degrees(values: object) -> list[float]:
    return [round(float(v), 6) for v in np.degrees(np.asarray(values, dtype=float))]


def throws_of(engine: Arrangement) -> list[float]:
    return in_degrees([throw.angle for throw in engine.throws])


@pytest.mark.parametrize("period", [CYCLE, TURN])
@pytest.mark.parametrize("count", range(1, 8))
def test_even_engines_have_the_customary_order(count: int, period: float) -> None:
    """The cylinder that fires i-th is at its dead centre when the crank has turned i Phi/Z."""
    made, order = even_cylinders(count, period), customary_order(count, two_stroke=period == TURN)
    assert made.arrangement is not None and order is not None
    assert made.arrangement.firing_order == order
    for place, cylinder in enumerate(order):
        turned = place * period / count
        assert turned + made.members[cylinder - 1].phase == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("count", range(2, 17, 2))
def test_split_pins_fire_any_order_evenly_at_any_angle(count: int) -> None:
    """An even number of cylinders in the order of two in-line engines, one behind the other."""
    one = in_line_order_by_rule(count // 2)
    order = [number for pair in zip(one, one, strict=True) for number in pair]
    order[1::2] = [number + count // 2 for number in one]
    for angle in (15.0, 60.0, 90.0, 120.0):
        split = vee(count, angle * DEGREE, "split", order, "banks")
        assert split.firing_order == tuple(order)
        assert split.is_even
        assert split.symmetry() == count
    # with banks 720/Z degrees apart split pins stand together
    shared = vee(count, min(CYCLE / count, math.pi), "shared", order, "banks")
    assert len(shared.throws) == count // 2
    assert shared.is_even == (count > 2)


def test_w_engines() -> None:
    """Napier Lion: three banks of four 60 degrees apart, flat crank, even firing.

    The banks of the Isotta-Fraschini Asso 750 are 40 degrees apart. Their orders are not known
    here; what fires evenly on such shafts shows the angles.
    """
    order = (1, 11, 7, 3, 12, 8, 4, 10, 6, 2, 9, 5)
    lion = w_engine(12, [60 * DEGREE, 0.0, -60 * DEGREE], order=order)
    assert lion.firing_order == order
    assert lion.is_even
    assert throws_of(lion) == [0.0, 180.0, 180.0, 0.0]
    asso = w_engine(
        18, [40 * DEGREE, 0.0, -40 * DEGREE],
        order=(1, 17, 11, 5, 15, 9, 3, 18, 12, 6, 14, 8, 2, 16, 10, 4, 13, 7),
    )  # fmt: skip
    assert asso.is_even
    assert len(asso.throws) == 6
    four_banks = np.radians([36.0, 21.0, -21.0, -36.0]).tolist()
    split = w_engine(12, four_banks, "split", (1, 4, 7, 10, 3, 6, 9, 12, 2, 5, 8, 11))
    assert split.is_even


@pytest.mark.parametrize(
    ("text", "order"),
    [
        ("In-line 4  1-2-4-3", (1, 2, 4, 3)),
        ("V8 cross-plane", (1, 8, 4, 3, 6, 5, 7, 2)),
        ("V8 cross-plane 1-5-4-8-6-3-7-2", (1, 5, 4, 8, 6, 3, 7, 2)),
        ("V8 flat-plane", (1, 5, 3, 7, 4, 8, 2, 6)),
        ("V8 90 1-8-7-2-6-5-4-3", (1, 8, 7, 2, 6, 5, 4, 3)),
        ("V6 60 split-pin 1-2-3-4-5-6", (1, 2, 3, 4, 5, 6)),
        ("V6 90", (1, 6, 5, 4, 3, 2)),
        ("V6 90 split-pin alternate", (1, 6, 5, 4, 3, 2)),
        ("boxer 4 alternate", (1, 3, 2, 4)),
        ("W3 60,0,-60 1-3-2", (1, 3, 2)),
        ("VR4 13 1-3-4-2", (1, 3, 4, 2)),
        ("V6 60 split-pin alternate 1-4-3-6-5-2", (1, 4, 3, 6, 5, 2)),
        ("boxer 4 alternate 1-3-2-4", (1, 3, 2, 4)),
    ],
)
def test_texts(text: str, order: tuple[int, ...]) -> None:
    assert arrangement_from_text(text).firing_order == order


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "must be one of 'in-line N'"),
        ("in-line x", "'x' must be a number of cylinders"),
        ("in-line 100", "cylinders = 100: must be a whole number from 1 to 99"),
        ("in-line 13", "must be given: cylinders 1 to 13, such as 1-2-4-6-8-10-12-13-11-9-7"),
        ("in-line 4 1-3-4", "order 1-3-4: must name each of the cylinders 1 to 4 once"),
        ("in-line 4 2-1-3-4", "beginning with 1"),
        ("in-line 4 five", "'five' is not understood; allowed here: an order such as 1-3-4-2"),
        ("V6 75 splitpin", "'splitpin' is not understood; allowed here: .* shared-pin, split-pin"),
        ("radial 9 twin-row", "'twin-row' is not understood; allowed here: two-row"),
        ("V6", "the bank angle is missing, such as 'V6 90'"),
        ("V7 60", "cylinders = 7: must be an even number; a table of throws, banks and cyl"),
        ("VR6", "the bank angle is missing, such as 'VR6 15'"),
        ("VR2 15", "VR: cylinders = 2: must be a whole number from 3 to 99"),
        ("VR6 60", "VR6: bank angle = 60 degree: must be above 0 and at most 45"),
        ("VR6 15 split-pin", "'split-pin' is not understood; allowed here: one angle, an order"),
        ("VR4 13", "no firing order is known for this layout, so it must be given: cylinders 1 t"),
        ("Wankel 2", "Wankel engines are not covered"),
        ("opposed-piston 6", "opposed pistons are not covered"),
        ("free piston", "free-piston engines are not covered"),
        ("axial 5", "axial engines are not covered"),
        ("V6 200", "bank angle = 200 degree: must be above 0 and at most 180"),
        ("V6 sixty", "'sixty' must be an angle in degrees"),
        (
            "V6 72 split-pin alternate",
            "no firing order is known for this layout, so it must be given",
        ),
        ("V8 90", "must say cross-plane or flat-plane"),
        ("V6 60 cross-plane", "allowed for four-stroke V8 engines only"),
        ("V8 cross-plane 1-5-3-7-4-8-2-6", "makes a flat-plane crank"),
        ("V8 90 1-2-3-4-5-6-7-8", "shared pins and this bank angle fire"),
        ("boxer 3", "must be an even number"),
        ("boxer 6 1-2-4-3-5-6", "the pistons of cylinders 1 and 4 do not move in opposition"),
        ("W12 60", "1 bank angles: must be two or more"),
        ("W12 60,0,-60 1-2-3-4-5-6-7-8-9-10-11-12", "shared pins and these banks fire"),
        ("radial 6", "cylinders = 6: must be an odd number, 3 or more, in each row"),
        ("parallel twin 400", "crank = 400 degree: must be above 0 and at most 360"),
    ],
)
def test_texts_that_are_no_engine(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        arrangement_from_text(text)
    assert str(caught.value).startswith(f"arrangement = '{text}': ")
    assert "\n" not in str(caught.value)
