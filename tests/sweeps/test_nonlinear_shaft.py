"""Scenes whose couplings are not linear: integration in time, energy, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

import sweeps
from engine_dyn.units import DEGREE, RPM
from tests.support.scenes import refusal

ENGINE = """
cycle = "four-stroke"
[values]
cylinders = 1
speed = 700
load_exponent = 0
load_offset = 0
[[diagram]]
kind = "torque"
mean = 60
harmonics = [{ order = 0.5, cosine = 5.0 }, { order = 2, cosine = 40.0, sine = 8.0 }]
"""

NAMES = ["shaft_torque_nonlinear", "coupling_contact", "nonlinear_error", "shaft_torque_mean",
         "shaft_torque_half_range", "coupling_departure"]  # fmt: skip

STAGES = {"twist": [0.0, 1.0, 3.0, 20.0], "torque": [0.0, 20.0, 140.0, 2000.0]}


@pytest.fixture
def engine(tmp_path: Path) -> str:
    path = tmp_path / "torque.toml"
    path.write_text(ENGINE)
    return str(path)


def shaft_of(**coupling: Any) -> dict[str, Any]:
    return {
        "reciprocating": "included", "flywheel": "engine", "load_damping": 0.0,
        "discs": [{"name": "engine", "throw": 1, "inertia": 0.1},
                  {"name": "machine", "inertia": 0.25, "damping": 1.5}],
        "shafts": [{"damping": 2.0, "diameter": 0.04, **coupling}],
    }  # fmt: skip


def scene(engine: str, coupling: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"engine": engine, "shaft": shaft_of(**coupling), "silenced_warnings": ["all"],
            "output": {"quantities": NAMES}, **more}  # fmt: skip


def run(engine: str, coupling: dict[str, Any], **more: Any) -> xr.Dataset:
    return sweeps.run(**scene(engine, coupling, **more))


def in_time(law: Any, speed: float, cycles: int = 40, friction: tuple[float, float] | None = None,
            ) -> tuple[float, Any]:  # fmt: skip
    """Half range of the torque of two discs, and their twist over a cycle, by DOP853."""
    omega, cycle = speed * RPM, 4.0 * np.pi / (speed * RPM)
    limit, stick = friction or (0.0, 0.0)

    def torque(state: Any) -> Any:
        twist, turn = state[0], state[2] - state[1]
        return law(twist) + 2.0 * turn + state[3]

    def rates(time: float, state: Any) -> Any:
        phi = omega * time
        acting = 60.0 + 5.0 * np.cos(0.5 * phi) + 40.0 * np.cos(2.0 * phi) + 8.0 * np.sin(2.0 * phi)
        inside, turn = torque(state), state[2] - state[1]
        slips = abs(state[3]) >= limit and state[3] * turn > 0.0
        return [turn, (acting + inside) / 0.1, (-60.0 - 1.5 * state[2] - inside) / 0.25,
                0.0 if slips else stick * turn]  # fmt: skip

    def go(state: Any, times: Any = None) -> Any:
        return solve_ivp(rates, (0.0, cycle), state, "DOP853", times, rtol=1e-8, atol=1e-10,
                         max_step=cycle / 400.0).y  # fmt: skip

    state = np.array([-0.05, 0.0, 0.0, 0.0])
    for _ in range(cycles):
        state = go(state)[:, -1]
    found = go(state, np.arange(4096) * cycle / 4096)
    return 0.5 * float(np.ptp(torque(found))), found[0]


def stages(twist: Any) -> Any:
    points = np.array(STAGES["twist"]) * DEGREE
    return np.sign(twist) * np.interp(np.abs(twist), points, STAGES["torque"])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("coupling", "law", "friction", "contact", "speed"),
    [
        ({"torque_over_twist": STAGES}, stages, None, None, 1200.0),
        ({"stiffness": 2000.0, "clearance": 1.0},
         lambda x: 2000.0 * (x - np.clip(x, -0.5 * DEGREE, 0.5 * DEGREE)), None, 1.0, 900.0),
        ({"stiffness": 2000.0, "friction_torque": 15.0, "friction_stiffness": 6000.0},
         lambda x: 2000.0 * x, (15.0, 6000.0), None, 1200.0),
    ],
    ids=["stages", "clearance", "friction"],
)  # fmt: skip
def test_a_scene_gives_the_motion_in_time(
    engine: str,
    coupling: dict[str, Any],
    law: Any,
    friction: Any,
    contact: float | None,
    speed: float,
) -> None:
    found = run(engine, coupling, set={"speed": speed})
    assert found.nonlinear_status == 0
    half, twist = in_time(law, speed, friction=friction)
    assert found.nonlinear_error < 1e-3
    assert float(found.shaft_torque_nonlinear[0]) == pytest.approx(half, rel=2e-3)
    assert float(found.coupling_departure[0]) > 0.1
    assert abs(float(found.shaft_torque_half_range[0]) / half - 1.0) > 0.02
    if contact is None:
        assert np.isnan(found.coupling_contact[0])
    else:
        assert found.coupling_contact[0] == contact
        assert twist.max() > -0.5 * DEGREE


def test_numbers_that_change_nothing_give_the_linear_response(engine: str) -> None:
    """No clearance, and friction that always sticks; the stiffness is the table's slope."""
    line = {"twist": [-60.0, 0.0, 60.0], "torque": [-2000.0, 0.0, 2000.0]}
    k = 2000.0 / (60.0 * DEGREE)
    linear = run(engine, {"stiffness": k, "clearance": 0.0}, axes={"speed": [800.0, 1500.0]})
    tabled = run(engine, {"torque_over_twist": line}, axes={"speed": [800.0, 1500.0]})
    for one in (linear, tabled):
        assert (one.nonlinear_status == 0).all()
        np.testing.assert_allclose(one.coupling_departure, 0.0, atol=1e-9)
        np.testing.assert_allclose(
            one.shaft_torque_nonlinear, one.shaft_torque_half_range, rtol=2e-3
        )
    np.testing.assert_allclose(
        tabled.shaft_torque_half_range, linear.shaft_torque_half_range, rtol=1e-9
    )


@pytest.mark.compiled
def test_clearance_and_friction_are_swept(engine: str) -> None:
    coupling = {"stiffness": 2000.0, "friction_torque": 0.0, "friction_stiffness": 6000.0}
    found = run(engine, coupling, set={"speed": 1200.0},
                axes={"shaft_clearance_1": [0.0, 1.0, 2.0],
                      "shaft_friction_torque_1": [0.0, 15.0]})  # fmt: skip
    assert (found.nonlinear_status == 0).all()
    torque = found.shaft_torque_nonlinear.transpose(..., "shaft")
    assert torque.shape == (3, 2, 1)
    assert (abs(torque[:, 1] / torque[:, 0] - 1.0) > 0.05).all()
    # Without clearance there is no contact to tell.
    assert np.isnan(found.coupling_contact.sel(shaft_clearance_1=0.0)).all()


def test_a_mean_torque_beyond_the_table_is_invalid(engine: str) -> None:
    short = {"twist": [0.0, 1.0], "torque": [0.0, 20.0]}
    found = run(engine, {"torque_over_twist": short}, set={"speed": 1200.0})
    assert found.nonlinear_status == found.torsion_status == 4
    assert np.isnan(found.shaft_torque_nonlinear).all()


def test_whoever_asks_for_linear_results_is_told(engine: str) -> None:
    said = scene(engine, {"stiffness": 2000.0, "clearance": 1.0}, set={"speed": 1200.0})
    said |= {"silenced_warnings": [], "output": {"quantities": ["shaft_torque_half_range"]}}
    with pytest.warns(UserWarning, match="linear_coupling: shaft 1"):
        sweeps.run(**said)


@pytest.mark.parametrize(
    ("coupling", "message"),
    [
        ({"stiffness": 1.0, "torque_over_twist": STAGES},
         "has both stiffness and torque_over_twist; give one of them"),
        ({"torque_over_twist": {"twist": [0.0, 2.0, 1.0], "torque": [0.0, 1.0, 2.0]}},
         "torque_over_twist twist = [0.0, 2.0, 1.0]: must ascend"),
        ({"torque_over_twist": {"twist": [0.0, 1.0, 2.0], "torque": [0.0, 2.0, 2.0]}},
         "torque_over_twist torque = [0.0, 2.0, 2.0]: must ascend"),
        ({"torque_over_twist": {"twist": [0.0, 1.0], "torque": [0.0, 1.0, 2.0]}},
         "torque_over_twist: has 2 twists and 3 torques; must be equally many"),
        ({"torque_over_twist": {"twist": [0.0, 1.0], "torque": [1.0, 2.0]}},
         "torque_over_twist: must have the torque 0 at the twist 0"),
        ({"torque_over_twist": {"twist": [0.0], "torque": [0.0]}}, "torque_over_twist"),
        ({"stiffness": 1.0, "clearance": -1.0}, "clearance = -1"),
        ({"stiffness": 1.0, "friction_torque": 1.0}, "shaft_friction_torque_1: needs"),
        ({"stiffness": 1.0, "friction_stiffness": 1.0}, "shaft_friction_stiffness_1: needs"),
        ({"stiffness": 1.0, "friction_torque": -1.0, "friction_stiffness": 1.0},
         "friction_torque = -1"),
        ({"stiffness": 1.0, "friction_torque": 1.0, "friction_stiffness": 0.0},
         "friction_stiffness = 0"),
        ({"stiffness": 1.0}, "needs a coupling that is not linear"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused(engine: str, coupling: dict[str, Any], message: str) -> None:
    assert message in refusal(scene(engine, coupling, set={"speed": 1200.0}))


def test_modes_have_no_damping_of_their_own(engine: str) -> None:
    given = scene(engine, {"stiffness": 2e3, "clearance": 1.0}, set={"speed": 1200.0})
    given["shaft"]["modal_damping"] = 0.02
    given["output"] = {"quantities": ["shaft_torque_nonlinear"]}
    assert "needs the damping of each shaft in place of modal_damping" in refusal(given)
