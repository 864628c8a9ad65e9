"""Firing orders and phases of in-line engines."""

import numpy as np
import pytest

from engine_dyn.geometry.arrangement import (
    CUSTOMARY_ORDERS,
    MOST_CYLINDERS,
    customary_order,
    firing_phases,
)
from engine_dyn.geometry.cylinders import even_cylinders
from engine_dyn.geometry.firing_orders import TWO_STROKE_IN_LINE_ORDERS
from engine_dyn.types import Floats

CYCLE = 4.0 * np.pi


def phases_along_shaft(count: int) -> Floats:
    """Phases of cylinders 1, 2, ... of an in-line engine with the customary order."""
    return np.array([member.phase for member in even_cylinders(count, CYCLE).members])


def test_orders_of_the_thesis() -> None:
    """Kakaitsas (2015), section 5.4."""
    assert CUSTOMARY_ORDERS[6] == (1, 5, 3, 6, 2, 4)
    assert CUSTOMARY_ORDERS[8] == (1, 5, 2, 6, 8, 4, 7, 3)


@pytest.mark.parametrize("count", range(9, MOST_CYLINDERS + 1))
def test_no_order_is_made_up(count: int) -> None:
    assert customary_order(count) is None
    assert customary_order(count, two_stroke=True) is None


@pytest.mark.parametrize("count", range(1, 8))
def test_two_stroke_engines_have_orders_of_their_own(count: int) -> None:
    """Four-stroke orders turned by half the angles make cranks with large free moments."""
    order = customary_order(count, two_stroke=True)
    assert order == TWO_STROKE_IN_LINE_ORDERS[count][0].order
    made = even_cylinders(count, 0.5 * CYCLE).arrangement
    assert made is not None and made.firing_order == order


@pytest.mark.parametrize("count", range(1, 9))
def test_phases_along_the_shaft_are_the_firings_in_another_order(count: int) -> None:
    order = CUSTOMARY_ORDERS[count]
    along = phases_along_shaft(count)
    np.testing.assert_array_equal(np.sort(along), np.sort(firing_phases(count, CYCLE)))
    # The cylinder that fires i-th is at its dead centre when the crank has turned i Phi/Z.
    for place, cylinder in enumerate(order):
        assert place * CYCLE / count + along[cylinder - 1] == pytest.approx(0.0, abs=1e-12)
