"""Built-in scenes of speeds that do not repeat, and their figures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import LineCollection, PolyCollection

import sweeps
from engine_dyn.status import FOLLOWED, MEANINGS, STOPPED
from sweeps.view.figures.drawing import figure
from sweeps.view.figures.options import options_of
from sweeps.view.figures.views import View
from tests.support.commands import ok
from tests.support.figures import assert_filled, assert_inside, plates, variable, words

INERTIA = np.array([2.0, 3.0, 4.0, 5.0, 6.0])
GAIN = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
LIMITS = {"fall": 10.0, "rise": 12.0, "band": 1.5, "recovery": 5.0, "changes": [1.0, 3.0, 4.5]}


def run(**attributes: Any) -> xr.Dataset:
    """Cycles and recorded points over the inertia; the lightest design stops in cycle 31."""
    cycle, point = np.arange(1, 61), np.arange(1, 722)
    mean = 1500.0 - 200.0 * np.exp(-((cycle - 20) ** 2) / 50.0) / INERTIA[:, None]
    mean[0, 30:] = np.nan
    angle = 2.0 * (point - 1.0)
    speed = 1500.0 + 30.0 * np.cos(np.radians(3.0 * angle)) / INERTIA[:, None]
    status = np.where(INERTIA == 2.0, STOPPED, FOLLOWED).astype(float)
    flags = {"flag_values": np.arange(len(MEANINGS)), "flag_meanings": " ".join(MEANINGS)}
    over, along, change = ("inertia", "run_cycle"), ("inertia", "run_point"), "load_change"
    return xr.Dataset(
        {
            "transient_time": variable(over, 0.08 * cycle + 0.0 * mean, "time", "s", "t"),
            "transient_mean_speed": variable(over, mean, "mean speed", "rpm", "n"),
            "transient_lowest_speed": variable(over, mean - 9.0, "lowest speed", "rpm"),
            "transient_highest_speed": variable(over, mean + 9.0, "highest speed", "rpm"),
            "transient_command": variable(over, 0.05 * mean, "fuel command", "percent", "y"),
            # The fuel is cut at 4 s: the last change is not judged
            "speed_before_change": variable(change, [1500.0, 1460.0, np.nan], "before", "rpm"),
            "settled_speed": variable(change, [1460.0, 1500.0, np.nan], "settled", "rpm"),
            "run_angle": variable(along, angle + 0.0 * speed, "angle", "degree"),
            "run_speed": variable(along, speed, "speed", "rpm", "n"),
            "status": ("inertia", status, {"long_name": "outcome", **flags}),
        },
        coords={"inertia": variable("inertia", INERTIA, "moment of inertia", "kg m2")},
        attrs={"parameters": json.dumps({"speed": 1500, "transient_fuel_cut": 4}), **attributes},
    )  # fmt: skip


def test_a_run_is_drawn_over_the_time_with_band_and_limits() -> None:
    found = plates(run(transient_limits=json.dumps(LIMITS)), laid_out=True)
    assert list(found)[:2] == ["transient_cycles_inertia", "transient_phase_inertia"]
    for stem, drawn in found.items():
        assert_inside(stem, drawn)
        assert_filled(stem, drawn)
    drawn = found["transient_cycles_inertia"]
    speed, command = drawn.axes
    for text in ("Speed over the time by inertia", "4 of 5 values of inertia shown", "Stopped",
                 "Recovery band around", "Limit of fall or rise from"):  # fmt: skip
        assert text in words(drawn)
    assert len([one for one in command.get_lines() if len(one.get_xdata()) > 1]) == 4
    # Each change from its beginning to the next one or the fuel cut, about the speeds that count
    across = {
        (*one.get_xdata(), *np.round(one.get_ydata(), 6)) for one in speed.get_lines()
        if len(one.get_xdata()) == 2
    }  # fmt: skip
    assert across >= {(1.0, 3.0, 1350.0, 1350.0), (1.0, 3.0, 1680.0, 1680.0),
                      (3.0, 4.0, 1310.0, 1310.0), (3.0, 4.0, 1640.0, 1640.0)}  # fmt: skip
    bands = [one.get_paths()[0].get_extents() for one in speed.collections
             if isinstance(one, PolyCollection) and one.get_zorder() == 0]  # fmt: skip
    assert {tuple(np.round(one.get_points().ravel(), 6)) for one in bands if one.width > 0.0} == {
        (1.0, 1448.75, 3.0, 1471.25), (3.0, 1488.75, 4.0, 1511.25)}  # fmt: skip
    ends = [one for one in speed.get_lines() if one.get_marker() == "x"]
    assert [float(one.get_xdata()[0]) for one in ends] == pytest.approx([0.08 * 30])
    assert len([one for one in speed.collections if one.get_alpha() == 0.22]) == 4
    assert "Limit of fall" not in words(plates(run())["transient_cycles_inertia"])


def test_two_turns_are_drawn_over_the_crank_angle() -> None:
    drawn = plates(run())["transient_phase_inertia"]
    assert [panel.get_title(loc="left") for panel in drawn.axes] == [
        "Turns 1 and 2",
        "Turns 3 and 4",
    ]
    for panel in drawn.axes:
        for line, inertia in zip(panel.get_lines(), (2.0, 3.0, 5.0, 6.0), strict=True):
            x, y = (np.asarray(data, dtype=float) for data in line.get_data())
            assert (x[0], x[-1]) == (0.0, 720.0)
            np.testing.assert_allclose(y, 1500.0 + 30.0 * np.cos(np.radians(3.0 * x)) / inertia)


def test_other_archives_have_no_such_figure() -> None:
    alone = run()[["transient_mean_speed", "run_speed", "status"]]
    assert plates(alone) == {}
    with pytest.raises(sweeps.SceneError, match="it needs run_speed over run_time, or"):
        figure(alone, "transient_run")


def limits_map() -> xr.Dataset:
    """Designs keep the limits above a line; delta depends on the inertia alone."""
    over = ("inertia", "governor_gain")
    fall = 30.0 / (INERTIA[:, None] * np.sqrt(GAIN))
    return xr.Dataset(
        {
            "largest_speed_fall": variable(over, fall, "fall of the speed", "percent"),
            "limits_kept": (over, (fall <= 4.0).astype(float),
                            {"long_name": "limits", "flag_values": [0, 1],
                             "flag_meanings": "exceeded kept"}),
            "delta": variable("inertia", 0.02 / INERTIA, "delta", "1", r"\delta"),
        },
        coords={"inertia": variable("inertia", INERTIA, "moment of inertia", "kg m2"),
                "governor_gain": variable("governor_gain", GAIN, "gain", "1")},
    )  # fmt: skip


def test_a_map_has_the_border_of_the_limits_and_the_lightest_design() -> None:
    drawn = figure(limits_map(), "numbers", options_of(quantities="largest_speed_fall"))
    panel = drawn.axes[0]
    (border,) = (one for one in panel.collections if type(one) is LineCollection)
    kept = limits_map().limits_kept.values.T == 1.0
    changes = np.sum(kept[:, 1:] != kept[:, :-1]) + np.sum(kept[1:] != kept[:-1])
    assert len(border.get_segments()) == changes > 0
    (star,) = (one for one in panel.get_lines() if one.get_marker() == "*")
    inertia, gain = star.get_data()
    lightest = INERTIA[kept.any(axis=0)].min()
    assert set(np.atleast_1d(inertia)) == {lightest}
    assert set(np.atleast_1d(gain)) == set(GAIN[kept[:, lightest == INERTIA].ravel()])
    with_target = figure(limits_map(), "numbers", options_of(
        quantities="largest_speed_fall", target="delta <= 1/200"))  # fmt: skip
    borders = [one for one in with_target.axes[0].collections if type(one) is LineCollection]
    assert len(borders) == 2 and "1/200" in words(with_target)
    place = {float(x) for piece in borders[1].get_segments() for x in piece[:, 0]}
    assert place == {3.5}  # Between the cells of 3 and 4 kg m2


def test_two_runs_are_compared_cycle_by_cycle() -> None:
    data = run()[["transient_mean_speed"]].isel(inertia=1, drop=True)
    data["transient_mean_speed_compared"] = 1.01 * data.transient_mean_speed
    drawn = plates(data)["compared_transient_mean_speed"]
    for line in drawn.axes[0].get_lines():
        np.testing.assert_array_equal(line.get_xdata(), np.arange(60))
    share = np.asarray(drawn.axes[1].get_lines()[0].get_ydata(), dtype=float)
    assert share.max() == pytest.approx(1.0)


def test_a_lost_design_says_why() -> None:
    data = run()
    data["largest_speed_fall"] = ("inertia", np.where(INERTIA == 2.0, np.nan, INERTIA))
    array = data["largest_speed_fall"].variable
    said = View(data).outcomes("largest_speed_fall", array, {}).tolist()
    assert said == ["stopped", "", "", "", ""]


@pytest.mark.compiled
def test_recorded_points_end_where_the_shaft_first_turns_back() -> None:
    found = sweeps.run(
        {
            "engine": "ntua", "set": {"cylinders": 4, "speed": 1200, "inertia": 6.0},
            "solver": {"method": "transient"}, "starter": {"speed": 300.0},
            "axes": {"starter_torque": [120.0, 300.0]},
            "transient": {"cycles": 4, "start_speed": 0.0, "command_angle": -15.0,
                          "fuel_from": 80.0, "record": [1, 4],
                          "load_steps": [{"time": 0.1, "torque": 50.0, "ramp": 0.2}]},
            "governor": {"gain": 4.0},
            "output": {"quantities": ["run_time", "run_speed", "transient_end_time",
                                      "transient_time", "transient_load"]},
        }
    )  # fmt: skip
    weak, strong = found.run_time.values
    assert np.isfinite(strong).all() and (np.diff(strong) > 0.0).all()
    assert 10 < np.isfinite(weak).sum() < 180 and (np.diff(weak[np.isfinite(weak)]) > 0.0).all()
    assert np.nanmax(weak) < float(found.transient_end_time[0])  # It swings to rest after that
    assert float(np.nanmin(found.run_speed[0])) >= 0.0
    ends = found.transient_time.values[1]
    np.testing.assert_allclose(
        found.transient_load.values[1], 50.0 * np.clip((ends - 0.1) / 0.2, 0.0, 1.0)
    )


@pytest.mark.slow
@pytest.mark.compiled
def test_the_scene_gives_the_flywheels_that_it_states(tmp_path: Path) -> None:
    archive = tmp_path / "step.nc"
    ok("run", "load_step", "-o", archive)
    for condition, least in (("limits_kept >= 1", "6"), ("delta <= 1/200", "5")):
        told = ok("best", archive, "--least", "inertia", "--within", condition)
        assert f"least inertia = {least} kg m" in told
    data = xr.load_dataset(archive)
    limits = json.loads(data.attrs["transient_limits"])
    assert limits.pop("changes") == [1.0, 11.0]
    assert limits == pytest.approx({key: LIMITS[key] for key in limits})
    kept = data.limits_kept.values == 1.0
    assert data.governor_gain.values[kept[np.flatnonzero(kept.any(axis=1))[0]]].tolist() == [32.0]
    assert (data.status.values[kept] == FOLLOWED).all()


@pytest.mark.slow
@pytest.mark.compiled
def test_built_in_scenes_say_what_happens() -> None:
    start = sweeps.run("start_and_stop")
    names = [MEANINGS[int(code)] for code in start.status.values]
    assert names == ["not_started", *["followed"] * 4]
    assert (np.diff(start.time_to_start.values[1:]) < 0.0).all()
    idle = sweeps.run("idle_dispersion").cycle_speed_variation.sel(inertia=4.0)
    assert int(np.argmin(idle.values)) == 2 and float(idle[-1]) > 5.0 * float(idle[2])
