"""Scenes of VR engines: opposite offsets of the banks, by name and as a table."""

import numpy as np
import pytest

from engine_dyn.geometry.layouts import arrangement_from_text
from engine_dyn.units import DEGREE
from tests.support.scenes import asking, computed, refusal

ENGINE = "v6_96x81"
SET = {"arrangement": "VR6 15", "crank_offset": 0.0125}


def table(sides: list[float]) -> dict[str, object]:
    """The arrangement written out."""
    made = arrangement_from_text("VR6 15")
    return {
        "throws": [{"angle": float(one.angle / DEGREE)} for one in made.throws],
        "banks": [0.0, -15.0],
        "sides": sides,
        "cylinders": [
            {"throw": c.throw + 1, "bank": c.bank + 1, "firing_angle": c.firing_angle / DEGREE}
            for c in made.cylinders
        ],
    }


def test_stages_and_curves_have_the_offset_of_each_bank() -> None:
    names = ("torque", "torque_max", "torque_mean", "torque_order", "delta")
    here = computed(names, ENGINE, set=SET, output={"angle_step": 0.25})
    curve = here["torque"].values
    assert float(here["torque_max"]) == pytest.approx(curve.max(), rel=1e-5)
    assert float(here["torque_mean"]) == pytest.approx(curve.mean(), rel=1e-6)
    third = 2.0 * abs(np.fft.rfft(curve)[6]) / curve.size
    assert float(here["torque_order"].sel(order=3.0)) == pytest.approx(third, rel=1e-5)
    # Three firings of one bank follow on three of the other: the cycle does not repeat sooner.
    first = 2.0 * abs(np.fft.rfft(curve)[1]) / curve.size
    assert first > 1e-5 * third
    same = computed(("delta",), ENGINE, set={**SET, "arrangement": "in-line 6 1-5-3-6-2-4"})
    assert float(here["delta"]) != pytest.approx(float(same["delta"]), rel=1e-6)


def test_a_table_says_the_sides() -> None:
    text = computed(("delta",), ENGINE, set=SET)
    written = computed(("delta",), ENGINE, set={**SET, "arrangement": table([1.0, -1.0])})
    assert float(written["delta"]) == pytest.approx(float(text["delta"]), rel=1e-12)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"pin_offset": 0.001}, "pin_offset: must be 0 where banks lie to both sides"),
        ({"arrangement": table([1.0])}, "arrangement: sides = 1: must be 1 or -1 for each"),
        ({"arrangement": "VR6 60"}, "VR6: bank angle = 60 degree: must be above 0 and at most 45"),
        ({"crank_offset": 0.2}, "the crank cannot turn"),
    ],
)
def test_given_wrong(given: dict[str, object], message: str) -> None:
    line = refusal(asking(("delta",), ENGINE, set={**SET, **given}))
    assert message in line


def test_the_roll_moment_is_that_of_single_cylinders_to_either_side() -> None:
    """Of one cylinder with the offset of its bank, moved to where each fires."""
    names = ("roll_moment", "torque", "roll_moment_order")
    mounts = [{"lateral": -0.3}, {"lateral": 0.3}]
    whole = computed(names, ENGINE, set=SET, mounts=mounts)
    inertia = whole["roll_moment"].values + whole["torque"].values
    made = arrangement_from_text("VR6 15")
    expected = np.zeros(inertia.size)
    for side, cylinder in zip(made.cylinder_sides, made.cylinders, strict=True):
        single = {"cylinders": 1, "crank_offset": side * SET["crank_offset"]}
        one = computed(names, ENGINE, set=single, mounts=mounts)
        curve = one["roll_moment"].values + one["torque"].values
        expected += np.roll(curve, round(cylinder.firing_angle / DEGREE))
    assert np.abs(expected).max() > 1.0
    assert inertia == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())
