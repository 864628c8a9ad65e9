"""What acts on the rigid engine acts on the elastic shaft: in the stiff limit both have one delta.

With a heavy flywheel both are the same linear problem; a torque that the shaft lacks would show.
"""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

import sweeps
from engine_dyn.units import RPM
from tests.support.scenes import refusal

ENGINE = "diesel_105x137"

Change = dict[str, Any]

WAVES = [{"order": 1.0, "sine": 500.0}, {"order": 2.0, "sine": 300.0, "cosine": 200.0}]

ACTING: dict[str, Change] = {
    "gas and masses": {},
    "load over the crank angle": {"set": {"load_table": {
        "mean": 50.0, "angle": "crank", "harmonics": WAVES}}},
    "load over its own angle, geared and turned": {"set": {
        "load_table": {"mean": 50.0, "angle": "load", "harmonics": WAVES},
        "gear_ratio": 1.5, "load_phase": 50.0, "load_table_factor": 0.8}},
    "load over three turns": {"set": {"load_table": {
        "mean": 50.0, "angle": "crank",
        "harmonics": [{"order": 1.0 / 3.0, "sine": 400.0}, *WAVES]}}},
    "auxiliaries": {"auxiliaries": [
        {"ratio": 0.5, "phase": 20.0, "mean": 40.0, "harmonics": [{"order": 6, "sine": 300.0}]},
        {"mean": 5.0, "harmonics": [{"order": 1, "cosine": 100.0}]}]},
    "friction over the stroke": {"set": {
        "friction_boundary": 0.2, "friction_mixed": 0.2, "friction_hydrodynamic": 0.3,
        "friction_skirt": 0.1, "ring_pressure": 2.0, "friction_constant": 3.0}},
    "a misfire": {"set": {"misfire": 3}},
    "an offset": {"set": {"pin_offset": 0.004}},
    "a weak and a light cylinder": {"set": {"pressure_factor_2": 0.8, "mass_factor_4": 0.9}},
    "a throw of its own radius": {"set": {"radius_factor_5": 0.97}},
    "a firing pattern": {"axes": {"firing_pattern": ["110"]}},
    "a driver": {"set": {"motor_synchronous_speed": 1550.0, "motor_breakdown_torque": 3000.0,
        "motor_breakdown_slip": 0.2,
        "load_table": {"mean": 1500.0, "angle": "crank", "harmonics": WAVES}}},
    "a load over speed": {"set": {"load_linear": 1.0, "load_square": 0.01}},
    "a closure by time": {"solver": {"closure": "cycle_time"}},
}  # fmt: skip
"""All that scenes may put on the crankshaft, each as a change of the scene."""


def joined(*changes: Change) -> Change:
    scene: Change = {}
    for change in changes:
        for key, value in change.items():
            scene[key] = {**scene.get(key, {}), **value} if isinstance(value, dict) else value
    return scene


def shaft_of(throws: int, stiffness: float, flywheel: float) -> dict[str, Any]:
    return {
        "reciprocating": "included",
        "discs": [
            {"name": "pulley", "inertia": 0.02},
            *({"name": f"throw {i}", "throw": i, "inertia": 0.02} for i in range(1, throws + 1)),
            {"name": "flywheel", "inertia": flywheel},
            {"name": "pinion", "inertia": 0.02},
            {"name": "wheel", "inertia": 0.1},
            {"name": "load", "inertia": 1.0},
        ],
        "shafts": [
            *({"stiffness": stiffness} for _ in range(throws + 2)),
            {"between": ["wheel", "load"], "stiffness": stiffness},
        ],
        "gears": [{"between": ["pinion", "wheel"], "ratio": -0.6}],
    }


def deltas(
    change: Change, engine: str = ENGINE, throws: int = 6, heavy: float = 150.0, **more: Any
) -> xr.Dataset:  # fmt: skip
    scene = joined({"set": {"speed": 1500.0, "load": 100.0}}, change)
    if "load" not in scene["set"] or engine != ENGINE:
        scene["set"].pop("load", None)
    return sweeps.run(
        engine=engine, shaft=shaft_of(throws, 1e13, heavy), silenced_warnings=["all"],
        output={"quantities": ["delta", "delta_elastic"], **more.pop("output", {})}, **scene,
        **more,
    )  # fmt: skip


def check(found: xr.Dataset) -> None:
    rigid, elastic = np.ravel(found.delta), np.ravel(found.delta_elastic)
    assert np.isfinite(rigid).all() and (rigid > 0.0).all()
    np.testing.assert_allclose(elastic, rigid, rtol=2e-3)


@pytest.mark.parametrize("name", ACTING)
def test_each_thing_that_acts(name: str) -> None:
    check(deltas(ACTING[name]))


LOADS = [name for name in ACTING if name.startswith(("load ", "a driver"))]

EXCLUDED = [
    set(LOADS), {"a driver", "a load over speed"}, {"a firing pattern", "a misfire"},
    {"a firing pattern", "load over three turns"},
]  # fmt: skip
"""Things of which a scene may give one."""


def may_stand(group: list[str], name: str) -> bool:
    return not any(name in some and some.intersection(group) for some in EXCLUDED)


def groups_of_all_pairs() -> list[list[str]]:
    """Few groups such that each pair that may stand together is in one of them."""
    pairs = [
        pair for pair in itertools.combinations(ACTING, 2) if may_stand([pair[0]], pair[1])
    ]  # fmt: skip
    found: list[list[str]] = []
    while pairs:
        group = list(pairs[0])
        for name in sorted(ACTING, key=lambda one: -sum(one in pair for pair in pairs)):
            if name not in group and may_stand(group, name):
                group.append(name)
        found.append(group)
        pairs = [pair for pair in pairs if not set(pair) <= set(group)]
    return found


@pytest.mark.parametrize("group", groups_of_all_pairs(), ids=", ".join)
def test_things_that_act_together(group: list[str]) -> None:
    check(deltas(joined(*(ACTING[name] for name in group))))


@pytest.mark.parametrize(
    ("engine", "throws"),
    [("marine_80x345", 7), ("v8_cross_plane_93x86", 4), ("boxer_twin_101x70", 1),
     ("compressor_79x83", 1), ("ntua", 1), ("parallel_twin_270", 2)],
)  # fmt: skip
def test_other_engines(engine: str, throws: int) -> None:
    """Two-stroke, shared pins, opposed pistons, a driven compressor."""
    heavy = 1e6 if engine.startswith("marine") else 150.0
    check(deltas({}, engine=engine, throws=throws, heavy=heavy))


def test_a_pulsating_load_twists_the_coupling() -> None:
    """Four discs as first-order equations, followed by SciPy until they repeat.

    The engine's own torque is taken out: of two loads the difference is linear.
    """
    discs = [("pulley", 0.05), ("throw 1", 0.1), ("flywheel", 1.5), ("generator", 2.0)]
    stiffness, damping = [2e5, 4e5, 1.2e4], [20.0, 20.0, 15.0]
    shaft: dict[str, Any] = {
        "reciprocating": "included", "load_damping": 3.0,
        "discs": [{"name": name, "inertia": inertia} for name, inertia in discs],
        "shafts": [{"stiffness": k, "damping": c} for k, c in zip(stiffness, damping, strict=True)],
    }  # fmt: skip
    shaft["discs"][1]["throw"] = 1
    waves = [{"order": 1, "sine": 50.0}, {"order": 2, "sine": 40.0}]
    names = ["shaft_torque_order", "shaft_torque_phase"]

    def harmonics(*load: Change) -> Any:
        table = {"load_table": {"mean": 5.0, "angle": "load", "harmonics": list(load)}}
        found = sweeps.run(
            engine="ntua", shaft=shaft, silenced_warnings=["all"], set={"speed": 1000.0, **table},
            output={"quantities": names, "highest_order": 3},
        )  # fmt: skip
        phase = np.radians(found.shaft_torque_phase.values)
        return found.shaft_torque_order.values * np.exp(1j * phase)

    found = harmonics(*waves) - harmonics({"order": 1, "sine": 1e-12})
    omega, inertia = 1000.0 * RPM, np.array([inertia for _, inertia in discs])

    def shafts(state: Any) -> Any:
        angle, speed = state[:4], state[4:]
        return np.array(stiffness) * np.diff(angle) + np.array(damping) * np.diff(speed)

    def motion(time: float, state: Any) -> Any:
        inside = shafts(state)
        torque = np.diff(inside, prepend=0.0, append=0.0)
        torque[3] -= 50.0 * math.sin(omega * time) + 40.0 * math.sin(2.0 * omega * time)
        torque[3] -= 3.0 * state[7]
        return np.concatenate([state[4:], torque / inertia])

    turn = 2.0 * math.pi / omega
    times = 80.0 * turn + np.arange(360) * (turn / 360.0)
    solved = solve_ivp(motion, (0.0, times[-1]), np.zeros(8), "LSODA", times, rtol=1e-9, atol=1e-12)
    curves = np.array([shafts(state) for state in solved.y.T]).T
    expected = np.fft.rfft(curves, axis=-1)[:, 1:3] / 180.0
    np.testing.assert_allclose(found[:, [1, 3]], expected, atol=1e-3 * np.abs(expected).max())


def test_auxiliaries_act_where_they_are_named() -> None:
    cam = [{"ratio": 0.5, "mean": 80.0, "harmonics": [{"order": 6, "sine": 300.0}]}]

    def found(**more: Any) -> xr.Dataset:
        return sweeps.run(
            engine=ENGINE, shaft={**shaft_of(6, 1e6, 2.0), **more}, silenced_warnings=["all"],
            set={"speed": 1500.0}, auxiliaries=cam,
            output={"quantities": ["shaft_torque_order", "shaft_torque_mean"]},
        )  # fmt: skip

    bare = sweeps.run(
        engine=ENGINE, shaft=shaft_of(6, 1e6, 2.0), silenced_warnings=["all"],
        set={"speed": 1500.0}, output={"quantities": ["shaft_torque_order", "shaft_torque_mean"]},
    )  # fmt: skip
    free, pulley, last = found(), found(auxiliaries="pulley"), found(auxiliaries="throw 6")
    xr.testing.assert_identical(free.drop_attrs(), pulley.drop_attrs())
    # The shaft of the pulley carries the mean of the cam shaft at the crank, half of it at 6.
    assert float(free.shaft_torque_mean[0] - bare.shaft_torque_mean[0]) == pytest.approx(40.0)
    assert float(last.shaft_torque_mean[0]) == pytest.approx(0.0, abs=1e-9)
    swing = [one.shaft_torque_order.sel(order=3.0) for one in (bare, free, last)]
    assert float(abs(swing[1] - swing[0])[0]) > 50.0 > 5.0 * float(abs(swing[2] - swing[0])[0])
    said = refusal({
        "engine": ENGINE, "shaft": {**shaft_of(6, 1e6, 2.0), "auxiliaries": "pully"},
        "output": {"quantities": ["delta"]},
    })  # fmt: skip
    assert "auxiliaries = 'pully': no such disc; did you mean 'pulley'" in said


def test_what_cannot_act_is_refused_by_name(tmp_path: Path) -> None:
    tmp_path.joinpath("torque.toml").write_text(
        'cycle = "four-stroke"\n[values]\ncylinders = 1\nspeed = 800\nload_exponent = 1\n'
        'load_offset = 0\n[[diagram]]\nkind = "torque"\nmean = 20\n'
        "harmonics = [{ order = 1, cosine = 50.0 }]\n"
    )
    said = refusal({
        "engine": str(tmp_path / "torque.toml"), "shaft": shaft_of(1, 1e6, 2.0),
        "output": {"quantities": ["throw_torque_order"]},
    })  # fmt: skip
    assert "'throw_torque_order' needs the pressure in the cylinders" in said


def test_orders_of_a_fast_load_above_those_of_diagrams_act() -> None:
    """Order 20 of a load at eight times the crank's speed is order 160 of the crank."""

    def half_ranges(**more: Any) -> xr.DataArray:
        waves = [{"order": 20.0, "sine": 900.0}]
        found = sweeps.run(
            engine=ENGINE, shaft=shaft_of(6, 1e7, 2.0), silenced_warnings=["all"],
            set={"speed": 1500.0, "load": 100.0, "gear_ratio": 8.0,
                 "load_table": {"mean": 5.0, "angle": "load", "harmonics": waves}},
            output={"quantities": ["shaft_torque_half_range"], **more},
        )  # fmt: skip
        return found.shaft_torque_half_range

    stored = half_ranges(highest_order=160.0)
    np.testing.assert_array_equal(half_ranges(), stored)
