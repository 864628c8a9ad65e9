"""Throws, banks and cylinders: what follows from them, and what is refused."""

import math
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine_dyn.geometry.arrangement import Arrangement, Cylinder, Throw, phase_sums, symmetry
from engine_dyn.geometry.layouts import arrangement_from_text

TURN = 2.0 * math.pi
CYCLE = 2.0 * TURN
DEGREE = math.pi / 180.0


def degrees(*angles: float) -> list[float]:
    return [angle * DEGREE for angle in angles]


def four(**more: object) -> Arrangement:
    """An in-line four, written out."""
    given = {
        "period": CYCLE,
        "throws": tuple(Throw(a, i) for i, a in enumerate(degrees(0, 180, 180, 0))),
        "banks": (0.0,),
        "cylinders": tuple(Cylinder(i, 0, a) for i, a in enumerate(degrees(0, 540, 180, 360))),
        **more,
    }
    return Arrangement(**given)


def test_what_follows_from_an_in_line_four() -> None:
    engine = four()
    assert engine.firing_order == (1, 3, 4, 2)
    np.testing.assert_allclose(engine.firing_intervals, [math.pi] * 4, rtol=1e-14)
    np.testing.assert_allclose(engine.phases, degrees(0, -540, -180, -360), rtol=1e-14)
    assert engine.is_even
    assert engine.symmetry() == 4
    assert engine.symmetry([1, 1, 1, 0.9]) == 1
    assert engine.symmetry([1, 0.9, 0.9, 1]) == 2
    assert engine.symmetry([[1, 2], [1, 3], [1, 3], [1, 2]]) == 2


def slow_symmetry(phases: list[float], period: float, weights: list[float]) -> int:
    """Try every one-to-one map of the cylinders (obvious, and only for a few of them)."""
    best = 1
    for parts in range(2, len(phases) + 1):
        moved = [phase + period / parts for phase in phases]
        for order in permutations(range(len(phases))):
            if all(
                weights[i] == weights[k]
                and abs(np.exp(1j * TURN * (moved[i] - phases[k]) / period) - 1.0) < 1e-6
                for i, k in enumerate(order)
            ):
                best = parts
                break
    return best


@given(
    st.lists(st.sampled_from(range(8)), min_size=1, max_size=6),
    st.lists(st.sampled_from([1.0, 0.5]), min_size=6, max_size=6),
)
def test_symmetry_is_the_finest_shift_that_maps_all(places: list[int], marks: list[float]) -> None:
    phases = [place * CYCLE / 8 for place in places]
    weights = marks[: len(places)]
    assert symmetry(phases, CYCLE, weights) == slow_symmetry(phases, CYCLE, weights)


def test_phase_sums_of_two_cylinders_and_of_a_bank() -> None:
    """Of twins 2 |cos(nu apart/2)|; banks of a cross-plane V8 fire 90, 180, 270, 180 apart."""
    orders = np.arange(1, 25) / 2.0
    for crank in (180, 270, 360):
        sums = 2.0 * np.abs(np.cos(0.5 * orders * crank * DEGREE))
        twin = arrangement_from_text(f"parallel twin {crank}")
        np.testing.assert_allclose(twin.phase_sums(orders), sums, atol=1e-12)
    made = arrangement_from_text("V8 cross-plane")
    for bank in (0, 1):
        angles = [one.firing_angle for one in made.cylinders if one.bank == bank]
        gaps = np.diff(np.sort(angles), append=min(angles) + CYCLE)
        assert sorted(np.degrees(gaps).round().tolist()) == [90.0, 180.0, 180.0, 270.0]


def test_phase_sums_are_what_is_left_of_harmonics() -> None:
    rng = np.random.default_rng(1)
    phases, weights = rng.uniform(-CYCLE, 0.0, 5), rng.uniform(0.0, 1.0, 5)
    phi = np.arange(4096) * (CYCLE / 4096)

    def curve(at: np.ndarray) -> np.ndarray:
        return np.exp(np.sin(0.5 * at) + 0.3 * np.cos(1.5 * at))

    one = np.abs(np.fft.rfft(curve(phi)))
    together = sum(w * curve(phi + p) for w, p in zip(weights, phases, strict=True))
    all_of_them = np.abs(np.fft.rfft(together))
    orders = np.arange(1, 9) / 2.0
    np.testing.assert_allclose(
        phase_sums(orders, phases, CYCLE, weights), all_of_them[1:9] / one[1:9], rtol=1e-10
    )


def cylinders(*angles: float, throws: tuple[int, ...] = (0, 1, 2, 3)) -> tuple[Cylinder, ...]:
    return tuple(Cylinder(t, 0, a) for t, a in zip(throws, degrees(*angles), strict=True))


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"period": 3.0}, r"period = 3: must be 2 pi or 4 pi"),
        ({"throws": ()}, r"throws: none given"),
        ({"banks": ()}, r"banks: none given"),
        ({"cylinders": ()}, r"cylinders: none given"),
        ({"banks": (math.nan,)}, r"bank 1: angle = nan: must be a finite number"),
        ({"throws": (Throw(0.0, 0.0, -1.0),)}, r"throw 1: radius_factor = -1: must be above 0"),
        (
            {"throws": (Throw(0.0), Throw(math.inf))},
            r"throw 2: angle = inf: must be a finite number",
        ),
        (
            {"cylinders": cylinders(0, 540, 180, 360, throws=(0, 1, 2, 4))},
            r"cylinder 4: throw = 5: must be a number from 1 to 4",
        ),
        (
            {"cylinders": cylinders(180, 540, 180, 360)},
            r"cylinder 1: firing_angle = 180 degree: must be 0",
        ),
        (
            {"cylinders": cylinders(0, 540, 180, 720)},
            r"cylinder 4: firing_angle = 720 degree: must be 0 or more and below 720",
        ),
        (
            {"cylinders": cylinders(0, 540, 190, 360)},
            r"cylinder 3: firing_angle = 190 degree: its throw is at top dead centre at 180 or "
            r"that plus 360",
        ),
        (
            {"cylinders": cylinders(0, 540, 180, 0)},
            r"firing intervals 0, 180, 360, 180 degree: uneven; if this is intended, set uneven "
            r"= true",
        ),
    ],
)
def test_impossible_arrangements(more: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        four(**more)
    assert "\n" not in str(caught.value)
