"""What a search refuses, in one line and before anything is computed."""

from typing import Any

import pytest

import sweeps
from sweeps.decide.optimise import evaluation, optimise
from sweeps.decide.optimise.space import read_space
from tests.support.scenes import refusal_of

BASE: dict[str, Any] = {
    "engine": "ntua", "set": {"load": 50.0}, "axes": {"speed": [1200.0, 1500.0]}, "least": "delta",
    "over": "inertia = 2 to 8",
}  # fmt: skip

WRONG: list[tuple[Any, ...]] = [
    ({"least": ()}, "neither least nor most is given"),
    ({"least": "dleta"}, "'dleta': not computed; did you mean 'delta'?"),
    ({"within": "shaft_stress <= 1"}, "'shaft_stress': not computed"),
    ({"least": "torque"},
     "torque: not one number per design, because it varies over crank_angle, so it cannot be "
     "minimised or limited; use torque_max"),
    ({"within": "omega <= 10"}, "omega: not one number per design"),
    ({"least": "status"}, "status: an outcome cannot be"),
    ({"least": ["delta", "delta"]}, "delta is given twice"),
    ({"most": "delta"}, "delta is given twice"),
    ({"least": ["delta", "speed"]},
     "speed: is an axis of the scene, at whose every value the conditions must hold; search "
     "it instead"),
    ({"within": "stroke <= 0.2"}, "stroke: this parameter is not searched; searched are inertia"),
    ({"over": ["inertia = 2 to 8", "arrangement = in-line 1 | in-line 2"], "least": "arrangement"},
     "arrangement: its values are words, which cannot be minimised or maximised"),
    ({"least": "imep"}, "imep: does not depend on any searched parameter: inertia"),
    ({"least": "shaking_moment_max"}, "'shaking_moment_max' needs cylinder_"),
    ({"within": "delta = 1"}, "condition 'delta = 1': must be a name"),
    ({"not_counted": "idle"}, "not counted: 'idle': unknown"),
    ({"over": None}, "scene: nothing to search: the scene has no [sample]"),
    ({"over": "inertia = 2 to 2"}, "over inertia: low = 2 and high = 2"),
    ({"over": "inertia = 8 to 2"}, "over inertia: low = 8 and high = 2: low must be"),
    ({"over": "inertia = -1 to 2"}, "over inertia low = -1: must be a finite number"),
    ({"over": "inertia = 2"}, "over inertia = [2]: must have at least two values"),
    ({"over": "inertia = two to 8"}, "over 'inertia = two to 8': must be 'inertia ="),
    ({"over": "inertai = 2 to 8"}, "over inertai: unknown key; did you mean"),
    ({"over": "delta = 1 to 2"}, "over delta: unknown key: this is a computed"),
    ({"over": "inertia"},
     "over 'inertia': not in [sample] of scene; give a range to search it too, such as "
     "'inertia = 0.2 to 5'"),
    ({"over": ["inertia = 2 to 8", "inertia = 3 to 8"]}, "over inertia: given twice"),
    ({"over": "speed = 1000 to 2000"}, "over speed: is an axis of the scene"),
    ({"over": 3}, "over = 3: must be"),
    ({"over": "arrangement = in-line 2"},
     "over arrangement = ['in-line 2']: must have at least two values"),
    ({"designs": {"inertia": [1.0, 2.0]}}, "scene: [designs]: not allowed with optimise"),
    ({"number": 4}, "optimise: number = 4: must be a whole number from 8"),
    ({"generations": 0}, "optimise: generations = 0: must be a whole number"),
    ({"restarts": 1.5}, "optimise: restarts = 1.5: must be a whole number"),
    ({"seed": -1}, "optimise: seed = -1: must be a whole number from 0"),
    ({"number": 1_000_000, "generations": 1000, "most": "omega_max"},
     "optimise: number x generations x restarts = 3000000000: must be at most 16777216"),
    ({"wihtin": "delta <= 1"}, "wihtin: unknown keyword; did you mean"),
]  # fmt: skip


@pytest.fixture(autouse=True)
def _nothing_is_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: Any, **__: Any) -> None:
        raise AssertionError("computed")

    monkeypatch.setattr(evaluation, "compute", never)
    monkeypatch.setattr(optimise, "compute", never)


@pytest.mark.parametrize(("changed", "expected"), WRONG)
def test_bad_input_is_told_in_one_line(changed: dict[str, Any], expected: str) -> None:
    assert expected in refusal_of(lambda: sweeps.optimise(**{**BASE, **changed}))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("inertia = 0.2 to 5", {"inertia": {"low": 0.2, "high": 5}}),
        ("inertia=0.2..5 log", {"inertia": {"low": 0.2, "high": 5, "spacing": "log"}}),
        ("crank_ratio = 1/5 to 1/3", {"crank_ratio": {"low": 0.2, "high": 1 / 3}}),
        ("cylinders = 2, 4,6", {"cylinders": [2, 4, 6]}),
        ("cylinders = 2 to 6", {"cylinders": {"low": 2, "high": 6}}),
        ("arrangement = in-line 4| W6 0,90 ", {"arrangement": ["in-line 4", "W6 0,90"]}),
        ("stroke, bore", {"stroke": [0.1, 0.2], "bore": {"low": 0.1, "high": 0.2}}),
    ],
)
def test_ranges_in_place(text: str, expected: dict[str, Any]) -> None:
    sample = {"number": 4, "stroke": [0.1, 0.2], "bore": {"low": 0.1, "high": 0.2}}
    assert read_space(text, {"sample": sample}, "scene").tables == expected
