"""Idler gears: inertia and friction at the crankshaft, against the same given by other keys."""

from __future__ import annotations

from typing import Any

import pytest

import sweeps
from sweeps.base.errors import SceneError
from tests.support.scenes import asking

GEARS = [
    {"inertia": 0.02, "ratio": -1.5, "friction_torque": 0.8},
    {"inertia": 0.3, "ratio": 0.5},
    {"inertia": 0.001, "ratio": 2.0, "friction_torque": 0.25},
]
INERTIA = 0.02 * 1.5**2 + 0.3 * 0.5**2 + 0.001 * 2.0**2
FRICTION = 0.8 * 1.5 + 0.25 * 2.0
"""Sums of i^2 J and of |i| T, by hand: the kinetic energy and the power of each gear."""

ASKED = ["delta", "load_coefficient", "omega_max"]


def single(names: list[str], **tables: Any) -> dict[str, float]:
    """Results of one design."""
    found = sweeps.run(asking(names, output={"angle_step": 10.0}, **tables))
    return {name: found[name].item() for name in names}


@pytest.mark.parametrize(
    ("own", "given"),
    [
        ({"inertia": 1.2}, {"inertia": 1.2 + INERTIA}),
        ({"flywheel_inertia": 0.9}, {"flywheel_inertia": 0.9 + INERTIA}),
        ({"flywheel_inertia": 0.9, "load_inertia": 0.2, "gear_ratio": 2.0},
         {"flywheel_inertia": 0.9, "load_inertia": 0.2 + INERTIA / 4.0, "gear_ratio": 2.0}),
    ],
)  # fmt: skip
def test_gears_are_inertia_and_a_constant_load(own: dict[str, Any], given: dict[str, Any]) -> None:
    common = {"load_offset": 1.5, "load_exponent": 2.0}
    gears = single(ASKED, set={**common, **own}, idler_gears=GEARS)
    plain = single(ASKED, set={**common, **given, "load_offset": 1.5 + FRICTION})
    without = single(ASKED, set={**common, **own})
    for name in ASKED:
        assert gears[name] == pytest.approx(plain[name], rel=1e-12)
    assert gears["delta"] < 0.999 * without["delta"]


def test_their_numbers_are_quantities_and_zero_without_them() -> None:
    names = ["idler_gear_inertia", "idler_gear_friction_torque"]
    wanted = {names[0]: INERTIA, names[1]: FRICTION}
    assert single(names, idler_gears=GEARS) == pytest.approx(wanted)
    assert single(names) == dict.fromkeys(names, 0.0)


def test_a_flywheel_for_a_wanted_delta_is_smaller_by_their_inertia() -> None:
    names = ["inertia_required", "flywheel_inertia_required"]
    wanted = {"wanted_delta": 0.02}
    gears = single(names, set=wanted, idler_gears=GEARS)
    plain = single(names, set={**wanted, "load_offset": FRICTION})
    assert gears["inertia_required"] == pytest.approx(plain["inertia_required"], rel=1e-9)
    less = plain["flywheel_inertia_required"] - gears["flywheel_inertia_required"]
    assert less == pytest.approx(INERTIA, rel=1e-7)


def test_torques_of_the_shaft_behind_the_flywheel_bear_them() -> None:
    names = ["flywheel_shaft_torque", "load_shaft_torque"]
    parts = {"flywheel_inertia": 0.9, "load_inertia": 0.2}
    more = {**parts, "load_inertia": 0.2 + INERTIA, "load_offset": FRICTION}
    asked = {"output": {"angle_step": 10.0}}
    gears = sweeps.run(asking(names, set=parts, idler_gears=GEARS, **asked))
    plain = sweeps.run(asking(names, set=more, **asked))
    for name in names:
        assert gears[name].values == pytest.approx(plain[name].values, rel=1e-9, abs=1e-9)


def test_elasticities_vary_what_is_given() -> None:
    names = ["delta_elasticity"]
    own = {"inertia": 1.2, "load_offset": 1.5}
    gears = sweeps.run(asking(names, set=own, idler_gears=GEARS))
    plain = sweeps.run(asking(names, set={"inertia": 1.2 + INERTIA, "load_offset": 1.5 + FRICTION}))
    of = {"parameter": "inertia"}
    share = 1.2 / (1.2 + INERTIA)  # d ln y / d ln x goes with x
    found, whole = (run["delta_elasticity"].sel(of).item() for run in (gears, plain))
    assert found == pytest.approx(share * whole, rel=1e-4)


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"idler_gears": [{"inertia": 0.1, "ratio": 0.0}]},
         r"scene: \[\[idler_gears\]\] number 1 ratio = 0: must not be 0"),
        ({"idler_gears": GEARS, "shaft": "diesel_105x137"},
         r"scene: \[\[idler_gears\]\]: not allowed together with a shaft"),
        ({"idler_gears": [{"ratio": 1.0}]}, r"\[idler_gears\] number 1 inertia: missing"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(tables: dict[str, Any], said: str) -> None:
    with pytest.raises(SceneError, match=said):
        sweeps.read_scene(asking(["delta"], **tables))
