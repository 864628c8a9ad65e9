"""Torque of auxiliaries over their own angle: mean, curve, orders, delta, bad input."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from engine_dyn.loads.auxiliaries import Auxiliary, over_crank
from engine_dyn.loads.driven_machine import torque_of_harmonics, torque_over_angle
from tests.support.scenes import asking, computed, refusal

pytestmark = pytest.mark.compiled

FOUR = "si_four_87x101"
CAM = {"ratio": 0.5, "phase": 30.0, "mean": 4.0,
       "harmonics": [{"order": 4, "sine": 12.0}, {"order": 8, "cosine": -3.0}]}  # fmt: skip
PUMP = {"ratio": 1.5, "mean": 2.0, "harmonics": [{"order": 1, "cosine": 5.0}]}


def at_crank(phi: Any) -> Any:
    """Torque of both at the crank, written out."""
    cam, pump = 0.5 * phi + np.radians(30.0), 1.5 * phi
    of_cam = 0.5 * (4.0 + 12.0 * np.sin(4.0 * cam) - 3.0 * np.cos(8.0 * cam))
    return of_cam + 1.5 * (2.0 + 5.0 * np.cos(pump))


def test_the_sum_is_exact() -> None:
    """Of closed forms, and of splines whose knots lie elsewhere."""
    cam = torque_of_harmonics(4.0, {4: (12.0, 0.0), 8: (0.0, -3.0)})
    pump = torque_of_harmonics(2.0, {1: (0.0, 5.0)})
    both = over_crank([Auxiliary(cam, 0.5, np.radians(30.0)), Auxiliary(pump, 1.5)], 4.0 * np.pi)
    phi = np.random.default_rng(1).uniform(-20.0, 20.0, 1000)
    assert_allclose(both(phi), at_crank(phi), atol=1e-8)
    assert both.mean == pytest.approx(5.0, rel=1e-12)
    assert both.repeats == 1
    assert over_crank([Auxiliary(cam, 0.5)], 4.0 * np.pi).repeats == 4
    theta = np.arange(0.1, 2.0 * np.pi, 0.3)
    rough = torque_over_angle(theta, np.random.default_rng(2).uniform(0.0, 9.0, theta.size))
    given = [Auxiliary(rough, 2.0, -1.0), Auxiliary(rough, 0.5, 7.0)]
    summed = over_crank(given, 4.0 * np.pi)
    expected = sum(one.ratio * one.torque(one.ratio * phi + one.phase) for one in given)
    assert_allclose(summed(phi), expected, atol=1e-9)
    assert summed.mean == pytest.approx(2.5 * rough.mean, rel=1e-9)


def test_excess_energy_by_hand(tmp_path: Path) -> None:
    """A torque in closed form of 25 - 8 sin(3 phi) kN m with a valve train at half speed."""
    (tmp_path / "mine.toml").write_text(
        'cycle = "four-stroke"\n[values]\ninertia = 900\nspeed = 420\nload_exponent = 0\n'
        'load_offset = 0\n[[diagram]]\nkind = "torque"\nmean = 25e3\n'
        "harmonics = [{ order = 3, sine = -8e3 }]\n"
    )
    cam = {"ratio": 0.5, "mean": 400.0, "harmonics": [{"order": 4, "sine": 6e3}]}
    names = ["delta", "energy_swing", "torque_mean", "brake_power", "torque_max", "torque_order"]
    found = computed(
        names, engine=str(tmp_path / "mine.toml"), auxiliaries=[cam], output={"highest_order": 6}
    )
    # At the crank the cam takes 200 + 3000 sin(2 phi), so the excess has the work
    # 8000/3 cos(3 phi) + 1500 cos(2 phi), extreme where its slope vanishes:
    # sin(phi) [8000 (4 c^2 - 1) + 6000 c] = 0 with c = cos(phi).
    c = np.concatenate([[1.0, -1.0], np.roots([32e3, 6e3, -8e3])])
    work = 8e3 / 3.0 * (4.0 * c**3 - 3.0 * c) + 1500.0 * (2.0 * c**2 - 1.0)
    swing = work.max() - work.min()
    assert float(found["energy_swing"]) == pytest.approx(swing, rel=1e-9)
    assert float(found["torque_mean"]) == pytest.approx(24.8e3, rel=1e-12)
    omega = 420 * np.pi / 30.0
    assert float(found["brake_power"]) == pytest.approx(24.8e3 * omega, rel=1e-12)
    assert float(found["delta"]) == pytest.approx(swing / (900.0 * omega**2), rel=1e-3)
    # Exact: the square of the speed follows the work, with the nominal speed as geometric mean.
    phi = np.linspace(0.0, 2.0 * np.pi, 200001)
    square = 2.0 / 900.0 * (8e3 / 3.0 * np.cos(3.0 * phi) + 1500.0 * np.cos(2.0 * phi))
    start = omega**2
    for _ in range(50):
        start *= omega**2 / np.exp(np.log(start + square[:-1]).mean())
    speeds = np.sqrt(start + 2.0 / 900.0 * np.array([work.max(), work.min()]))
    assert float(found["delta"]) == pytest.approx((speeds[0] - speeds[1]) / omega, rel=1e-6)
    torque = 24.8e3 - 8e3 * np.sin(3.0 * phi) - 3e3 * np.sin(2.0 * phi)
    assert float(found["torque_max"]) == pytest.approx(torque.max(), rel=1e-8)
    orders = found["torque_order"].sel(order=[1.0, 2.0, 3.0, 4.0])
    assert_allclose(orders, [0.0, 3e3, 8e3, 0.0], atol=1e-6)


NAMES = [
    "delta", "omega_max", "energy_swing", "torque", "torque_mean", "torque_max", "torque_min",
    "friction_torque", "instantaneous_friction_torque", "torque_order", "load_torque",
]  # fmt: skip


@pytest.mark.parametrize(
    ("more", "tables"),
    [
        ({"speed": 1500.0}, {}),
        ({"speed": 1500.0, "friction_skirt": 0.4, "friction_boundary": 0.3, "ring_pressure": 1.0},
         {"solver": {"inertia_model": "variable"}}),
    ],
)  # fmt: skip
def test_auxiliaries_are_part_of_the_torque(more: dict[str, Any], tables: dict[str, Any]) -> None:
    """The same torque as a load over angle leaves the speed as it is: both are subtracted."""
    given = {"set": more, **tables, "output": {"angle_step": 1.0, "highest_order": 8}}
    with_both = computed(NAMES, engine=FOUR, auxiliaries=[CAM, PUMP], **given)
    without = computed(NAMES, engine=FOUR, **given)
    phi = np.radians(with_both["crank_angle"].values)
    taken = at_crank(phi)
    change = without["torque"] - with_both["torque"]
    assert_allclose(change, taken, atol=1e-8)
    for name in ("friction_torque", "torque_mean"):
        assert abs(float(with_both[name] - without[name])) == pytest.approx(5.0, rel=1e-9)
    more_friction = (
        with_both["instantaneous_friction_torque"] - without["instantaneous_friction_torque"]
    )
    assert_allclose(more_friction, taken, atol=1e-8)
    assert float(with_both["torque_max"]) == pytest.approx(
        float(with_both["torque"].max()), rel=1e-3
    )
    wave = np.fft.rfft(taken) * 2.0 / taken.size
    assert float(with_both["torque_order"].sel(order=1.5) - without["torque_order"].sel(order=1.5)
                 ) == pytest.approx(float(np.abs(wave[3])), rel=1e-9)  # fmt: skip
    # A load of the same torque, over the crank angle.
    harmonics = [
        {"order": 2, "sine": 6.0 * np.cos(np.radians(120.0)),
         "cosine": 6.0 * np.sin(np.radians(120.0))},
        {"order": 4, "sine": 1.5 * np.sin(np.radians(240.0)),
         "cosine": -1.5 * np.cos(np.radians(240.0))},
        {"order": 1.5, "cosine": 7.5},
    ]  # fmt: skip
    load = {**given, "set": {**more, "load_table": {"mean": 5.0, "harmonics": harmonics}}}
    as_load = computed(NAMES, engine=FOUR, **load)
    for name in ("delta", "omega_max", "energy_swing"):
        assert float(with_both[name]) == pytest.approx(float(as_load[name]), rel=1e-7)
        assert abs(float(with_both[name] / without[name]) - 1.0) > 1e-5
    assert_allclose(with_both["load_torque"] + 5.0, as_load["load_torque"].mean()
                               + (with_both["load_torque"] - with_both["load_torque"].mean()),
                               atol=0.02)  # fmt: skip


def test_beside_a_geared_load_over_angle() -> None:
    given: dict[str, Any] = {"set": {"speed": 2000.0, "gear_ratio": 1.5}}
    load = {"mean": 20.0, "angle": "load", "harmonics": [{"order": 1, "sine": 15.0}]}
    given["set"]["load_table"] = load
    both = computed(["delta", "energy_swing"], engine=FOUR, auxiliaries=[PUMP], **given)
    # Both have the order 3/2: 22.5 sin + 7.5 cos.
    load = {"mean": 22.0, "angle": "load",
            "harmonics": [{"order": 1, "sine": 15.0, "cosine": 5.0}]}  # fmt: skip
    given["set"]["load_table"] = load
    one = computed(["delta", "energy_swing"], engine=FOUR, **given)
    for name in ("delta", "energy_swing"):
        assert float(both[name]) == pytest.approx(float(one[name]), rel=1e-7)


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ([{**CAM, "ratio": 0.3}], "[[auxiliaries]] number 1 ratio = 0.3: must be a multiple of"),
        ([CAM, {**CAM, "ratio": -1.0}], "[[auxiliaries]] number 2: ratio = -1: must be a number"),
        ([{**CAM, "phase": 999.0}], "phase = 999: must be a number in degree"),
        ([{**CAM, "speed": 1.0}], "speed: unknown"),
        ([{"ratio": 0.5, "mean": 3.0}], "number 1 file, harmonics or areas: missing"),
        ([{"ratio": 0.5, "harmonics": []}], "number 1 mean: missing; must be a number in N m"),
        ([{**CAM, "kind": "points"}], "kind = 'points': must be 'torque'"),
        ([{"file": "none.csv"}], "none.csv"),
        ([], "auxiliaries = []: must be tables [[auxiliaries]]"),
    ],
)  # fmt: skip
def test_bad_input(tables: Any, message: str) -> None:
    assert message in refusal(asking(["delta"], engine=FOUR, auxiliaries=tables))


def test_a_method_that_cannot() -> None:
    scene = asking(["delta"], auxiliaries=[CAM], solver={"method": "thesis"})
    assert "with load_table, a driver, [[auxiliaries]] or a torque" in refusal(scene)
