"""Scenes whose speed is followed in time, against the functions of Python and each other."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import sweeps
from engine_dyn.geometry.cylinders import even_cylinders
from engine_dyn.pressure.motored import motored
from engine_dyn.status import CONVERGED, FOLLOWED, INVALID_INPUT, STOPPED
from engine_dyn.transient import ISO_8528_5_G2, follow_designs, kept, transient_engine
from engine_dyn.units import RPM
from sweeps.running.compute import into_archive
from sweeps.running.compute.options import Options
from sweeps.scene.engine.engine_files import load_engine
from sweeps.scene.plan.forecast import text
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from sweeps.view.report.page import page
from sweeps.view.texts.archives import archive_text
from tests.support.scenes import asking, computed, refusal

STEPS = [{"time": 0.5, "torque": 900.0}, {"time": 3.0, "torque": 0.0}]
SET: dict[str, Any] = {
    "set": {"cylinders": 6, "speed": 1500.0, "inertia": 8.0, "reciprocating_mass": 6.67},
    "solver": {"method": "transient"},
    "transient": {
        "cycles": 80, "command_angle": -15.0, "load_steps": STEPS, "limits": "ISO 8528-5 G2",
        "load_law": "power", "start_command": 17.0,
    },
    "governor": {
        "gain": 8.0, "integral": 16.0, "actuator_lag": 0.05, "lowest_command": -20.0,
    },
}  # fmt: skip
LIMITS = {"fall": 10.0, "rise": 10.0, "band": 2.0, "recovery": 5.0}
JUDGED = ("speed_fall", "speed_rise", "recovery_time", "limits_kept", "transient_delta")


def changed(**tables: Any) -> dict[str, Any]:
    """Tables of that set with others put over them; None takes a key away."""
    made = dict(SET)
    for name, table in tables.items():
        if name != "output":
            both = {**SET.get(name, {}), **table} if isinstance(table, dict) else table
            table = {k: v for k, v in both.items() if v is not None} if both else None
        made[name] = table
    return {name: table for name, table in made.items() if table is not None}


def commands(*steps: tuple[float, float], start_command: float | None = None) -> dict[str, Any]:
    """Tables in which no governor gives the fuel commands, but these, each from a time on."""
    given = [{"time": time, "command": command} for time, command in steps]
    transient = {"command_steps": given, "start_command": start_command}
    return {"governor": None, "transient": transient}


@pytest.mark.compiled
def test_a_scene_gives_what_the_functions_give() -> None:
    engine = load_engine("ntua")
    bore, stroke, ratio = (engine.values[name] for name in ("bore", "stroke", "crank_ratio"))
    speed = 1500.0 * RPM
    area = 0.25 * math.pi * bore**2
    torque = 6 * area * stroke / (4.0 * math.pi)
    made = transient_engine(
        engine.family, even_cylinders(6, 4.0 * math.pi), crank_ratio=ratio,
        command_angle=math.radians(-15.0), crankcase_pressure=1.01325e5,
    )  # fmt: skip
    gains = np.array([4.0, 8.0, 16.0])
    found = follow_designs(
        made, 80, load=([0.5, 0.5, 3.0, 3.0], [0.0, 900.0, 900.0, 0.0]), marks=[0.5, 3.0],
        speed=speed, start_speed=speed, start_command=17.0, inertia=8.0,
        reciprocating_inertia=6.67 * (0.5 * stroke) ** 2, lever=0.5 * area * stroke,
        load_exponent=-1.0, friction_constant=0.137e5 * torque, friction_peak_share=0.005 * torque,
        friction_linear=0.142e5 * stroke / math.pi * torque, governed=1.0, reference_speed=speed,
        gain=100.0 * gains, integral_gain=1600.0, actuator_lag=0.05, lowest_command=-20.0,
        highest_command=90.0,
    )  # fmt: skip
    scene = changed(axes={"governor_gain": gains.tolist()}, governor={"gain": None})
    here = computed((*JUDGED, "transient_end_speed", "transient_error"), **scene)
    assert here.status.values.tolist() == [FOLLOWED] * 3
    for name, expected in {
        "transient_end_speed": found.cycles["speed_end"] / RPM, "transient_delta": found.delta,
        "recovery_time": found.marks["recovery_time"],
        "limits_kept": kept(found, speed, ISO_8528_5_G2).all(axis=1),
        "speed_fall": 100.0 / speed * np.maximum(
            found.marks["speed_before"] - found.marks["speed_lowest"], 0.0
        ),
    }.items():  # fmt: skip
        np.testing.assert_allclose(here[name].values, expected, rtol=1e-9, atol=1e-9)
    assert (here.transient_error < 1e-6).all()
    assert here.speed_fall.dims == ("governor_gain", "load_change")


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("cylinders", "more"),
    [(1, {}), (6, {}), (3, {"misfire": 2.0}), (3, {"pressure_factor_2": 0.8})],
)
def test_a_constant_load_ends_in_the_periodic_solution(
    cylinders: int, more: dict[str, float]
) -> None:
    # The friction of the periodic solution is that of the nominal speed
    own = {"cylinders": cylinders, "load": 50.0, "load_exponent": 2.0, "inertia": 4.0,
           "friction_mean_piston_speed": 0.0, **more}  # fmt: skip
    periodic = changed(
        set=own, transient=None, governor=None,
        solver={"method": "auto", "inertia_model": "variable", "tolerance": 1e-9},
    )  # fmt: skip
    steady = computed(("delta", "omega_mean", "load_torque_nominal"), **periodic)
    torque = float(steady.load_torque_nominal)
    followed = changed(
        set=own, governor=None,
        transient={"load_steps": [{"time": 0.0, "torque": torque}], "limits": None, "cycles": 400,
                   "start_command": 50.0, "load_law": "exponent"},
    )  # fmt: skip
    last = computed(("transient_delta", "transient_mean_speed"), **followed).isel(run_cycle=-1)
    assert float(last.transient_delta) == pytest.approx(float(steady.delta), rel=1e-6)


@pytest.mark.compiled
def test_blocks_threads_and_order_of_designs_change_no_bit(tmp_path: Path) -> None:
    draw = np.random.default_rng(3).uniform
    designs = {
        "inertia": draw(4.0, 12.0, 9).tolist(), "governor_gain": draw(2.0, 16.0, 9).tolist(),
        "crank_ratio": draw(0.2, 0.3, 9).tolist(), "cylinders": [6, 4, 6, 4, 6, 6, 3, 6, 6],
        "transient_command_angle": [-15.0, -360.0, -10.0] * 3,
    }  # fmt: skip
    scene = asking(
        JUDGED, "ntua", **changed(designs=designs, governor={"gain": None},
                                  set={"cylinders": None, "inertia": None},
                                  transient={"command_angle": None}),
    )  # fmt: skip
    whole = sweeps.run(scene, threads=1)
    several = sweeps.run(scene, threads=3)
    xr.testing.assert_identical(whole.drop_attrs(), several.drop_attrs())
    turned = {key: values[::-1] for key, values in designs.items()}
    back = sweeps.run({**scene, "designs": turned}, threads=2)
    for name in JUDGED:
        np.testing.assert_array_equal(back[name].values[::-1], whole[name].values)


@pytest.mark.compiled
def test_designs_that_cannot_be_are_an_outcome() -> None:
    designs = {"inertia": [8.0, 1e-9, 8.0, 8.0], "governor_lowest_command": [-20.0, -20.0, 95.0, 0],
               "transient_step_factor": [1.0, 1.0, 1.0, 10.0]}  # fmt: skip
    scene = changed(designs=designs, set={"inertia": None}, governor={"lowest_command": None})
    found = computed(("speed_fall",), **scene)
    assert found.status.values.tolist() == [
        FOLLOWED, INVALID_INPUT, INVALID_INPUT, STOPPED,
    ]  # fmt: skip
    assert np.isfinite(found.speed_fall[0]).all() and np.isnan(found.speed_fall[1]).all()
    told = text(make_plan(read_scene(asking(("speed_fall",), "ntua", **scene))))
    line = "governor_lowest_command = 95: must be at most governor_highest_command, 90 (status 4)"
    assert f"not followed: 1 of 4 designs: {line}" in told


@pytest.mark.compiled
def test_no_command_lies_beyond_the_last_diagram() -> None:
    scene = changed(axes={"transient_start_command": [90.0, 90.5]},
                    transient={"start_command": None}, governor=None)  # fmt: skip
    found = computed(("speed_fall",), **scene)
    assert found.status.values.tolist() == [FOLLOWED, INVALID_INPUT]
    told = text(make_plan(read_scene(asking(("speed_fall",), "ntua", **scene))))
    line = "transient_start_command = 90.5: must be at most 90, the load of the last diagram"
    assert f"not followed: 1 of 2 designs: {line}" in told


@pytest.mark.compiled
def test_stopping_is_a_failure_unless_the_fuel_was_cut(tmp_path: Path) -> None:
    designs = {"transient_step_factor": [1.0, 10.0, 0.0], "transient_fuel_cut": [99.0, 99.0, 1.0]}
    scene = asking(
        ("limits_kept", "largest_speed_fall", "cycles_to_stop", "delta"), "ntua",
        **changed(designs=designs, transient={"cycles": 300}),
    )  # fmt: skip
    scene["output"]["fail_on"] = ["stopped"]
    done = into_archive.run(make_plan(read_scene(scene)), tmp_path / "a.nc", Options())
    assert done.outcomes == {"followed": 2, "stopped": 1}
    archive = sweeps.open(tmp_path / "a.nc")
    assert archive.status.values.tolist() == [FOLLOWED, STOPPED, FOLLOWED]
    assert (archive.periodic_status == CONVERGED).all()
    assert ", kept 2 " in archive_text(archive, str(tmp_path / "a.nc"))
    assert np.isfinite(archive.cycles_to_stop.values).tolist() == [False, False, True]
    best = sweeps.best(archive, most="transient_step_factor", within="limits_kept >= 0")
    assert float(best.transient_step_factor) == 1.0


@pytest.mark.compiled
def test_droop_settles_where_its_definition_says() -> None:
    steps = [{"time": 0.5, "torque": 500.0}, {"time": 8.0, "torque": 900.0}]
    scene = changed(governor={"droop": 4.0}, set={"inertia": 12.0},
                    transient={"load_steps": steps, "cycles": 200})  # fmt: skip
    found = computed(("settled_speed", "transient_command"), **scene)
    commands = found.transient_command.isel(run_cycle=[95, -1]).values
    # Without load the governor holds 1500 / 0.96 rpm; at command 100, 4 percent less
    expected = 1500.0 / 0.96 * (1.0 - 0.04 * 0.01 * commands)
    np.testing.assert_allclose(found.settled_speed.values, expected, rtol=2e-4)


@pytest.mark.compiled
def test_a_run_down_takes_the_cycles_that_its_energy_lasts() -> None:
    none = dict.fromkeys(
        ("friction_constant", "friction_peak_pressure", "friction_mean_piston_speed"), 0.0
    )
    scene = changed(
        set={**none, "inertia": 40.0, "auxiliary_torque": 400.0, "load": 0.0}, governor=None,
        transient={"cycles": 300, "load_steps": None, "limits": None, "start_command": 0.0,
                   "start_speed": 1500.0, "fuel_cut": 0.0},
    )  # fmt: skip
    found = computed(("cycles_to_stop",), **scene)
    # Each cycle takes the work of the torque, and that of a diagram without combustion
    engine = load_engine("ntua")
    bore, stroke, ratio = (engine.values[name] for name in ("bore", "stroke", "crank_ratio"))
    phi = np.linspace(0.0, 4.0 * math.pi, 28801)
    travel = 0.5 * stroke * (1.0 - np.cos(phi) + (1.0 - np.sqrt(1.0 - (ratio * np.sin(phi)) ** 2))
                             / ratio)  # fmt: skip
    pressure = motored(engine.family.at(0.0))(phi)
    gas = 0.25 * math.pi * bore**2 * np.sum(0.5 * (pressure[1:] + pressure[:-1]) * np.diff(travel))
    lasts = 0.5 * 40.0 * (1500.0 * RPM) ** 2 / (4.0 * math.pi * 400.0 - 6.0 * gas)
    assert float(found.cycles_to_stop) == pytest.approx(lasts, abs=1.0)


@pytest.mark.compiled
def test_a_report_leads_with_the_limits_of_changes_of_load() -> None:
    axes = {"inertia": [4.0, 8.0, 12.0], "transient_step_factor": [0.5, 10.0]}
    asked = ("limits_kept", "largest_speed_fall", "longest_recovery_time")
    followed = changed(axes=axes, set={"inertia": None}, transient={"cycles": 100})
    written = page(computed(asked, **followed))
    verdict = written[written.index('id="verdict"') : written.index('id="computed"')]
    for part in ("least inertia = 4", "3 of 6 designs fulfil limits_kept", "largest speed fall",
                 "stopped, 3 of 6 points"):  # fmt: skip
        assert part in verdict, part
    assert "margin" not in verdict and "at the limit" not in verdict
    rigid, steady = "followed in time is that of a rigid crankshaft", "Friction is a mean effective"
    assert rigid in written and steady in written
    assert 'id="followed"' not in written  # Neither cycles nor points were asked for
    both = ("transient_time", "transient_mean_speed")
    over_time = page(computed(both, **changed(axes={"inertia": [4.0, 8.0]}, set={"inertia": None})))
    assert 'alt="transient cycles inertia"' in over_time
    periodic = page(computed(("delta",), axes={"inertia": [4.0, 8.0]}))
    assert rigid not in periodic and steady in periodic


@pytest.mark.compiled
def test_a_sample_is_reduced_as_it_is_followed() -> None:
    sample = {"number": 64, "governor_gain": {"low": 4.0, "high": 16.0}}
    reduce = {"quantiles": [0.5], "best": [{"least": "largest_speed_fall", "number": 2}]}
    scene = changed(sample=sample, reduce=reduce, governor={"gain": None})
    reduced = computed(("largest_speed_fall", "limits_kept"), **scene)
    whole = computed(("largest_speed_fall",), **changed(sample=sample, governor={"gain": None}))
    assert float(reduced.largest_speed_fall_quantile.squeeze()) == pytest.approx(
        float(np.quantile(whole.largest_speed_fall, 0.5)), rel=1e-2
    )


@pytest.mark.compiled
def test_a_change_that_is_hardly_seen_is_not_kept() -> None:
    """Half a cycle behind the change, nobody knows whether the speed recovers."""
    steps = [{"time": 1.0, "torque": 300.0}, {"time": 6.37, "torque": 100.0}]
    found = computed(("recovery_time", "limits_kept"), **changed(transient={"load_steps": steps}))
    assert np.isfinite(found.recovery_time).values.tolist() == [True, False]
    assert float(found.limits_kept) == 0.0


@pytest.mark.compiled
def test_percents_of_load_are_those_of_the_engine_whose_cylinders_all_burn() -> None:
    steps = [{"time": 0.5, "load": 40.0}]
    axes = {"misfire": [0.0, 2.0], "pressure_factor_4": [1.0, 0.8]}
    found = computed(
        ("full_load_torque", "transient_load", "settled_speed", "transient_command"),
        **changed(axes=axes, transient={"load_steps": steps, "load_law": "exponent", "cycles": 120,
                                        "start_command": None}),
    )  # fmt: skip
    whole = computed(("torque_mean",), set={**SET["set"], "load": 90.0})  # the last diagram
    assert found.full_load_torque.dims == ()
    assert float(found.full_load_torque) == pytest.approx(float(whole.torque_mean), rel=1e-12)
    loads = found.transient_load.isel(run_cycle=-1)
    np.testing.assert_allclose(loads, 0.4 * float(whole.torque_mean), rtol=1e-12)
    np.testing.assert_allclose(found.settled_speed, 1500.0, rtol=1e-3)
    # The other cylinders burn more for the same load
    command = found.transient_command.isel(run_cycle=-1).values
    assert command[0, 0] < command[0, 1] < command[1, 0] < command[1, 1]


@pytest.mark.compiled
def test_a_load_that_drives_the_engine_begins_without_fuel() -> None:
    """Extended below the diagrams, its command would lie below all that are allowed."""
    steps = [{"time": 0.0, "torque": -20e3}]
    more = {"load_steps": steps, "start_command": None, "load_law": "torque", "cycles": 3}
    scene = changed(transient=more, set={"inertia": 1e4})
    found = computed(("transient_fuel", "status"), **scene)
    assert float(found.status) == FOLLOWED
    assert (found.transient_fuel < 0.0).all()


@pytest.mark.compiled
def test_a_change_of_load_is_judged_until_the_fuel_is_cut() -> None:
    steps = [{"time": 0.5, "torque": 300.0}, {"time": 5.0, "torque": 0.0}]
    cuts = {"transient_fuel_cut": [99.0, 4.0, 0.2]}
    asked = ("speed_fall", "recovery_time", "settled_speed", "largest_speed_fall",
             "longest_recovery_time", "limits_kept")  # fmt: skip
    found = computed(asked, **changed(axes=cuts, transient={"load_steps": steps, "cycles": 100}))
    assert float(found.speed_fall[1, 0]) == pytest.approx(float(found.speed_fall[0, 0]), rel=1e-9)
    # The band lies around the last speed before the cut, which is settled but for 1e-5
    recovery = found.recovery_time.values
    assert recovery[1, 0] == pytest.approx(recovery[0, 0], rel=1e-3)
    assert float(found.settled_speed[1, 0]) == pytest.approx(1500.0, rel=1e-3)
    # What follows the cut is no change that a governor could answer
    assert np.isnan(found.speed_fall[1, 1]) and np.isnan(found.speed_fall[2]).all()
    assert found.limits_kept.values[:2].tolist() == [1.0, 1.0] and np.isnan(found.limits_kept[2])
    assert float(found.largest_speed_fall[1]) == float(found.speed_fall[1, 0])
    assert float(found.longest_recovery_time[1]) == float(found.recovery_time[1, 0])
    assert np.isnan(found.largest_speed_fall[2])


@pytest.mark.compiled
def test_one_design_that_an_engine_does_not_allow_stops_no_other() -> None:
    """So many firings within the dead time that outputs on their way have no room."""
    scene = changed(
        axes={"firing_angle_2": [240.0, 0.001]}, governor={"dead_time": 1.0},
        set={"cylinders": 3, "firing_angles": [0.0, 240.0, 480.0]},
        transient={"load_steps": [{"time": 1.0, "torque": 100.0}]},
    )  # fmt: skip
    found = computed(("status", "limits_kept"), **scene)
    assert found.status.values[1] == INVALID_INPUT != found.status.values[0]
    assert np.isnan(found.limits_kept.values[1])


@pytest.mark.compiled
def test_a_search_replaces_the_number_of_a_table() -> None:
    scene = asking(("largest_speed_fall",), "ntua", **changed())
    found = sweeps.optimise(
        scene, least="largest_speed_fall", over="governor_gain = 12 to 16", number=8, generations=1,
        restarts=1,
    )  # fmt: skip
    assert 12.0 <= float(found.governor_gain.min()) <= float(found.governor_gain.max()) <= 16.0


@pytest.mark.parametrize(
    ("tables", "says"),
    [
        ({"solver": None}, "[transient]: needs [solver] method = 'transient'"),
        ({"transient": None}, "[solver] method = 'transient': needs a table [transient]"),
        ({"transient": None, "solver": None}, "[governor]: has no effect without a table"),
        ({"solver": {"method": ["auto", "transient"]}}, "'transient' stands alone"),
        ({"transient": {"cycles": None}}, "[transient] cycles: missing"),
        ({"transient": {"command_angle": None}}, "command_angle: missing; must be the angle from"),
        ({"transient": {"cycles": 0}}, "[transient] cycles = 0: must be a whole number from 1"),
        ({"transient": {"load_steps": STEPS[::-1]}}, "must not lie before the end of the one befo"),
        ({"transient": {"load_steps": [{"time": -1.0, "load": 1.0}]}}, "time = -1: must be a num"),
        ({"transient": {"load_steps": [{"time": 1.0}]}}, "has none of them; must have one of"),
        ({"transient": {"load_steps": [{"time": 1.0, "load": 1.0, "power": 1.0}]}}, "has load and"),
        ({"transient": {"load_steps": [STEPS[0], {"time": 2.0, "load": 1.0}]}}, "others torque;"),
        ({"transient": {"load_steps": [{"time": 90.0, "load": 1.0}]}}, "they last 6.4 s at"),
        ({"transient": {"duration": 1.0}}, "duration = 1 s: a load at 3 s lies behind it"),
        ({"transient": {"duration": 0.0}}, "[transient] duration = 0"),
        ({"transient": {"boost_lag": -1.0}}, "[transient] boost_lag = -1: must be"),
        ({"transient": {"record": [5, 2]}}, "record = [5, 2]: must be two cycles from 1 to 80"),
        ({"transient": {"missed": [{"cycle": 3, "cylinder": 7}]}}, "cylinder 7: must be a"),
        ({"transient": {"missed": [{"cycle": 99, "cylinder": 1}]}}, "cycle 99 lies behind"),
        ({"transient": {"limits": "ISO 8528-5 G9"}}, "limits = 'ISO 8528-5 G9': must be 'ISO"),
        ({"transient": {"limits": None}}, "'limits_kept' needs [transient] limits"),
        ({"transient": {"load_steps": None}}, "needs [transient] load_steps or load_file"),
        ({"transient": {"load_file": "x.csv"}}, "has both load_steps and load_file"),
        ({"transient": {"load_file": "x.csv", "load_steps": None}}, "x.csv: no such file"),
        ({"transient": {"command_steps": [{"time": 0.0, "command": 50.0}]}}, "not allowed"),
        (commands((0.0, 20.0), (0.3, 90.5)), "command 90.5: must be at most 90, the load of the l"),
        (commands((0.0, -1001.0)), "command = -1001: must be a number in percent of load, at leas"),
        ({"governor": {"highest_command": 95.0}}, "governor_highest_command = 95: must be at most"),
        ({"transient": {"start_command": 95.0}}, "start_command = 95: must be at most 90, the loa"),
        ({"governor": {"gain": None, "integral": None}}, "a governor needs gain or integral"),
        ({"governor": {"gain": -1.0}}, "[governor] gain = -1: must be"),
        ({"governor": {"actuator_lag": -0.1}}, "[governor] actuator_lag = -0.1: must be"),
        ({"governor": {"gian": 1.0}}, "gian"),
        ({"transient": {"command_angle": -600.0}}, "command_angle = -600: must be"),
        ({"starter": {"torque": 300.0}}, "starter_torque: needs starter_speed, the speed at which"),
        ({"starter": {"speed": 300.0}}, "starter_speed: needs starter_torque, the torque of the"),
        ({"transient": {"start_speed": 0.0}}, "start_speed = 0: must be above 0 without a starter"),
        ({"governor": {"sampling_time": 1e-5}}, "sampling_time = 1e-05: must be 0 or at least 0.0"),
        ({"governor": {"lowest_command": 95.0}}, "lowest_command = 95: must be at most governor_"),
        ({"set": {"load_exponent": 12.0}, "transient": {"load_law": "exponent"}},
         "load_exponent = 12: must be at least -1 and at most 10"),
        ({"governor": {"lowest_command": None, "highest_command": 20.0},
          "axes": {"governor_lowest_command": [30.0, 40.0]}},
         "governor_lowest_command = 30: must be at most governor_highest_command, 20"),
        (commands((0.0, 20.0), (99.0, 50.0)), "they last 6.4 s at nominal speed, and the command"),
        ({"transient": {"duration": 4.0, "missed": [{"cycle": 79, "cylinder": 1}]}},
         "cycle 79 lies behind duration = 4 s, in which the engine makes some 50 cycles"),
        (commands((0.0, 20.0), start_command=17.0),
         "start_command: not allowed together with command_steps"),
        ({"transient": {"fuel_cut": 99.0}}, "transient_fuel_cut = 99: lies behind the end of the"),
        ({"clutch": {"time": 99.0, "inertia": 2.0}}, "clutch_time = 99: lies behind the end of th"),
        ({"clutch": {"speed": 2.0}}, "clutch_speed: needs clutch_time and clutch_inertia"),
        ({"transient": {"limits": LIMITS | {"x": 1.0}}}, "[transient] limits x: unknown key"),
        ({"transient": {"limits": LIMITS | {"recovery": -1.0}}},
         "limits recovery = -1: must be a number in s, above 0"),
        ({"transient": {"limits": {"fall": 10.0}}}, "[transient] limits rise: missing; must be a"),
        ({"transient": {"limits": 5.0}}, "limits = 5: must be 'ISO 8528-5 G2', or a table"),
        ({"set": {"governor_gain": 5.0}}, "governor_gain is in both [set] and [governor]; give"),
        ({"axes": {"governor_gain": [5.0, 6.0]}}, "in both [axes] and [governor]; give it in one"),
        ({"sample": {"number": 4, "governor_gain": {"low": 4.0, "high": 6.0}}},
         "governor_gain is in both [sample] and [governor]; give it in one place"),
        ({"transient": {"missed": 2 * [{"cycle": 7, "cylinder": 1}]}}, "cylinder 1 is given twice"),
        ({"solver": {"passes": 3}}, "passes = 3: has no effect with method 'transient'"),
        ({"output": {"quantities": ["cycles_to_stop"]}}, "needs [transient] fuel_cut, from which"),
        ({"clutch": {"inertia": 1.0}}, "clutch_inertia: needs clutch_time, the time at which"),
        ({"output": {"quantities": ["run_speed"]}}, "'run_speed' needs [transient] record"),
        ({"reduce": {"quantiles": [0.5]}, "output": {"quantities": ["speed_fall"]}}, "one number"),
    ],
)  # fmt: skip
def test_bad_input_is_refused_in_one_line(tables: dict[str, Any], says: str) -> None:
    scene = asking(tables.get("output", {}).get("quantities", ["limits_kept"]), "ntua",
                   **{k: v for k, v in changed(**tables).items() if k != "output"})  # fmt: skip
    if "reduce" in tables:
        with pytest.raises(sweeps.SceneError, match="one number for each design"):
            sweeps.plan(scene)
        return
    assert says in refusal(scene)


def test_a_load_over_time_comes_from_a_file(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    Path("load.csv").write_text("time_s,power_W\n0,0\n1,0\n1,90e3\n3,100e3\n")
    scene = changed(transient={"load_file": "load.csv", "load_steps": None, "load_law": None})
    Path("ramp.csv").write_text("time_s,power_W\n0,0\n2,0\n4,90e3\n5,95e3\n6,95e3\n7,0\n")
    scene["transient"]["load_file"] = "ramp.csv"
    part = sweeps.read_scene(asking(("speed_fall",), "ntua", **scene)).engine.parts["transient"]
    assert part.marks.tolist() == [2.0, 6.0]  # Where it begins to change
    scene["transient"]["load_file"] = "load.csv"
    part = sweeps.read_scene(asking(("speed_fall",), "ntua", **scene)).engine.parts["transient"]
    assert (part.of_load, part.law, part.load.time.tolist()) == ("power", "power", [0, 1, 1, 3])
    assert part.marks.tolist() == [1.0]  # A step, and a ramp at once
    Path("load.csv").write_text("time_s,power_W\n0,0\n2,0\n1,9\n")
    assert "load.csv: line 4: time_s must not descend" in refusal(
        asking(("speed_fall",), "ntua", **scene)
    )
    Path("load.csv").write_text("time,power_W\n0,0\n")
    assert "must be time_s and one of" in refusal(asking(("speed_fall",), "ntua", **scene))
    Path("load.csv").write_text("time_s,power_W\n-1,0\n1,9\n")
    assert "load.csv: line 2: time_s = -1: must be 0 or more" in refusal(
        asking(("speed_fall",), "ntua", **scene)
    )


def test_what_an_engine_does_not_have_is_asked_for() -> None:
    scene = changed(transient={"start_command": None})
    said = refusal(asking(("speed_fall",), "b112", **{**scene, "set": {"speed": 1500.0}}))
    assert "[transient] start_command: missing; engine b112 has diagrams for one load" in said
    scene = changed(**commands((1.0, 80.0)), set={"cylinders": None})
    plan = make_plan(read_scene(asking(("speed_fall",), "b112", **scene)))
    assert "transient_start_command" not in plan.scene.given
    scene = changed(transient={"command_angle": -300.0}, set={"cylinders": None})
    said = refusal(asking(("speed_fall",), "marine_80x345", **scene))
    assert "command_angle = -300 degree: must be at least -270" in said
