"""Firing orders that a crankshaft allows, against brute force and against other formulas."""

import itertools
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from engine_dyn.forces import harmonics
from engine_dyn.geometry.arrangement import TURN, Arrangement
from engine_dyn.geometry.cylinders import cylinders_of
from engine_dyn.geometry.layouts import arrangement_from_text, in_line
from engine_dyn.geometry.possible_orders import (
    CRANKS,
    count_orders,
    known_order_of,
    numbered_from_other_end,
    possible_orders,
    turning_other_way,
)

ORDERS = 0.5 * np.arange(1, 13)


def names(text: str, crank: str) -> list[str]:
    return [one.arrangement.name for one in possible_orders(arrangement_from_text(text), crank)]


def throws_of(order: tuple[int, ...]) -> tuple[int, ...]:
    """Dead centre of cylinders 1, 2, ... of an even in-line engine, in firing intervals."""
    count = len(order)
    half = count // 2 if count % 2 == 0 else None
    places = [order.index(cylinder) for cylinder in range(1, count + 1)]
    return tuple(place % half if half else 2 * place % count for place in places)


def brute_force(count: int, crank: str) -> set[tuple[int, ...]]:
    """Orders of an even four-stroke in-line engine, by trying all permutations."""
    everything = {(1, *rest) for rest in itertools.permutations(range(2, count + 1))}
    if crank == "any":
        return everything
    own = throws_of(in_line(count).firing_order)
    turn = count // 2 if count % 2 == 0 else count
    allowed = {own} | ({tuple(-place % turn for place in own)} if crank != "own" else set())
    return {order for order in everything if throws_of(order) in allowed}


@pytest.mark.parametrize("crank", CRANKS)
@pytest.mark.parametrize("count", range(1, 8))
def test_in_line_engines_have_the_orders_of_brute_force(count: int, crank: str) -> None:
    found = possible_orders(in_line(count), crank)
    orders = [one.arrangement.firing_order for one in found]
    assert len(set(orders)) == len(orders) == count_orders(in_line(count), crank)
    assert set(orders) == brute_force(count, crank)
    assert all(one.arrangement.is_even for one in found)


def test_counts_that_can_be_derived_by_hand() -> None:
    """Each pair of pistons in step but that of cylinder 1 may fire either way: 2^(Z/2-1)."""
    assert names("in-line 4", "either-hand") == ["1-2-4-3", "1-3-4-2"]
    counts = {
        "in-line 6": (4, 8, 120), "in-line 8": (8, 16, 5040), "V8 cross-plane": (8, 16, 48),
        "V8 flat-plane": (8, 8, 24), "boxer 6": (4, 8, 8), "radial 9": (1, 1, 1),
        "in-line 12 1-7-5-11-3-9-6-12-2-8-4-10": (32, 64, math.factorial(11)),
        "W12 60,0,-60 1-11-7-3-12-8-4-10-6-2-9-5": (32, 32, 96),
    }  # fmt: skip
    for text, expected in counts.items():
        engine = arrangement_from_text(text)
        assert tuple(count_orders(engine, crank) for crank in CRANKS) == expected, text


@pytest.mark.parametrize(
    "text",
    ["in-line 6", "V8 cross-plane", "V6 60 split-pin", "V6 90 shared-pin", "boxer 6",
     "parallel twin 270", "V10 90 split-pin", "W12 60,0,-60 1-11-7-3-12-8-4-10-6-2-9-5"],
)  # fmt: skip
def test_what_stays_of_the_engine(text: str) -> None:
    engine = arrangement_from_text(text)
    intervals = np.sort(engine.firing_intervals)
    found = possible_orders(engine, "any")
    assert len(found) == count_orders(engine, "any")
    assert sum(
        one.own_crank and one.arrangement.firing_order == engine.firing_order for one in found
    ) == 1  # fmt: skip
    for one in found:
        made = one.arrangement
        assert made.banks == engine.banks
        assert_allclose(np.sort(made.firing_intervals), intervals, atol=1e-9)
        assert made.firing_angles[0] == 0.0
        same = [
            abs(math.remainder(a.angle - b.angle, TURN)) < 1e-9
            for a, b in zip(made.throws, engine.throws, strict=True)
        ]
        assert all(same) == one.own_crank


@pytest.mark.parametrize("text", ["in-line 5", "in-line 6", "V8 cross-plane", "boxer 6"])
def test_other_end_and_other_way_are_among_the_orders_and_their_own_inverse(text: str) -> None:
    engine = arrangement_from_text(text)
    orders = {one.arrangement.firing_order for one in possible_orders(engine, "either-hand")}
    for one in possible_orders(engine, "either-hand"):
        for turned in (numbered_from_other_end, turning_other_way):
            other = turned(one.arrangement)
            assert other is not None
            assert other.firing_order in orders
            again = turned(other)
            assert again is not None
            assert again.firing_order == one.arrangement.firing_order


def vector_sums(made: Arrangement, weights: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Phase vector sums in real arithmetic, from the order and the firing angles alone."""
    angles = np.array(made.firing_angles)
    cosines = (weights[places] * np.cos(ORDERS[:, None] * angles)).sum(axis=1)
    sines = (weights[places] * np.sin(ORDERS[:, None] * angles)).sum(axis=1)
    return np.asarray(np.hypot(cosines, sines))


def eigenvector(throws: int) -> np.ndarray:
    """First mode of equal discs on equal springs, the first one held by one more spring."""
    stiffness = 2.0 * np.eye(throws) - np.eye(throws, k=1) - np.eye(throws, k=-1)
    stiffness[-1, -1] = 1.0
    mode = np.linalg.eigh(stiffness)[1][:, 0]
    return np.asarray(mode / mode[-1])


@pytest.mark.parametrize(("text", "throws"), [("in-line 6", 6), ("V8 cross-plane", 4)])
def test_phase_vector_sums_of_all_orders(text: str, throws: int) -> None:
    engine = arrangement_from_text(text)
    places = np.arange(throws) if throws == 6 else np.repeat(np.arange(throws), 2)
    if throws == 4:
        numbering = [engine.throws[one.throw].position for one in engine.cylinders]
        places = np.array(numbering, dtype=int)
    mode, equal = eigenvector(throws), np.ones(throws)
    for one in possible_orders(engine, "any"):
        cylinders = cylinders_of(one.arrangement)
        by_count = {7: cylinders}
        found = harmonics.first_mode_phase_vectors(ORDERS, 7, by_count)
        expected = vector_sums(one.arrangement, mode, places)
        assert_allclose(np.abs(found), expected, atol=1e-12)
        assert_allclose(harmonics.first_mode_weights(cylinders), mode, atol=1e-12)
        whole = np.abs(harmonics.phase_vectors(ORDERS, 7, by_count))
        assert_allclose(whole, vector_sums(one.arrangement, equal, places), atol=1e-12)
        turned = turning_other_way(one.arrangement)
        assert turned is not None
        backwards = harmonics.first_mode_phase_vectors(ORDERS, 7, {7: cylinders_of(turned)})
        assert_allclose(np.abs(backwards), expected, atol=1e-12)


def test_orders_of_practice_are_found() -> None:
    known = known_order_of(arrangement_from_text("in-line 6"))
    assert known is not None
    assert known[0].order == (1, 5, 3, 6, 2, 4)
    assert known[1] == ""
    found = {
        one.arrangement.name: known_order_of(one.arrangement)
        for one in possible_orders(arrangement_from_text("V8 cross-plane"), "own")
    }
    sources = {name: entry[0].source for name, entry in found.items() if entry}
    assert sources["1-8-7-2-6-5-4-3"].startswith("General Motors LS")
    assert sources["1-8-4-3-6-5-7-2"].startswith("Chevrolet small block")
    assert found["1-5-7-3-6-8-4-2"] is None
    assert known_order_of(arrangement_from_text("radial 9")) is None
