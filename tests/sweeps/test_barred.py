"""Barred speeds that are solved between the speeds of an archive, and verdicts of reports."""

from __future__ import annotations

import html
import tomllib
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal

import sweeps
from engine_dyn.status import MEANINGS
from sweeps import SceneError
from sweeps.decide.explore.barred import Barred, _outcomes, barred_ranges
from sweeps.running.archive.netcdf import write
from sweeps.view.report import verdict as verdicts
from sweeps.view.report.page import page
from sweeps.view.report.verdict_figures import MODES, campbell_figure
from sweeps.view.texts.barred import barred_text
from sweeps.view.texts.reductions import reduction_lines
from tests.support.commands import ok, refused

ENGINE = "diesel_105x137"
STRESS, TORQUE = "shaft_stress_over_limit", "shaft_torque_over_limit"


def archive_of(
    shaft: str, quantity: str, limit: dict[str, float], speeds: list[float], **more: Any
) -> xr.Dataset:
    return sweeps.run(
        engine=ENGINE, shaft=shaft, set=limit, axes={"speed": speeds, **more},
        output={"quantities": [quantity]},
    )  # fmt: skip


@pytest.fixture(scope="module")
def diesel() -> xr.Dataset:
    """The diesel whose stress is 1.23 times its limit at 2168 rpm, and below it at all others."""
    limit = {"shaft_stress_limit_8": 58.0}
    return archive_of(ENGINE, STRESS, limit, [1000, 1500, 2000, 2500], misfire=[0, 4])


@pytest.fixture(scope="module")
def solved(diesel: xr.Dataset) -> Barred:
    return barred_ranges(diesel, threads=1)


def _agrees(archive: xr.Dataset, found: Barred, quantity: str, dense: xr.Dataset) -> None:
    """Ranges are where the values of an archive with many speeds are above 1."""
    names = list(archive["shaft_name"].values)
    for case in found.cases:
        values = dense[quantity].sel(misfire=case["misfire"])
        for shaft, name in enumerate(names):
            own = [one for one in found.ranges if one.case == case and one.place == name]
            inside = np.zeros(dense.speed.size, bool)
            for one in own:
                inside |= (dense.speed.values >= one.low) & (dense.speed.values <= one.high)
            over = np.nan_to_num(values.isel(shaft=shaft).values, nan=0.0) > 1.0
            assert_array_equal(inside, over, err_msg=f"{case} {name}")


def _dense(found: Barred) -> list[float]:
    """Speeds a tenth of a rpm apart near edges, but not at them, and 5 rpm apart elsewhere."""
    near = np.arange(-1.0, 1.0, 0.1) + 0.05
    edges = np.array([edge for one in found.ranges for edge in (one.low, one.high)])
    low, high = found.speeds
    speeds = np.concatenate([np.arange(low, high, 5.0), np.ravel(edges[:, None] + near)])
    return np.unique(speeds[(speeds > low) & (speeds < high)]).tolist()


def test_edges_are_those_of_many_speeds(diesel: xr.Dataset, solved: Barred) -> None:
    # Every computed speed that is 0.05 rpm or more from an edge is on the side that it should be.
    assert len(solved.cases) == len(solved.ranges) == 2
    assert float(diesel[STRESS].max()) < 1.0  # The archive's own speeds show nothing
    _agrees(diesel, solved, STRESS, archive_of(
        ENGINE, STRESS, {"shaft_stress_limit_8": 58.0}, _dense(solved), misfire=[0, 4],
    ))  # fmt: skip
    for one in solved.ranges:
        assert (one.order, one.mode) == (6.0, 1)
        assert one.critical_speed == pytest.approx(2165.84, abs=0.01)
        for edge, (low, high) in ((one.low, one.low_between), (one.high, one.high_between)):
            assert low < edge < high and high - low < 0.11
    healthy = solved.ranges[0]
    assert healthy.largest == pytest.approx(1.231, abs=0.001)
    assert healthy.at == pytest.approx(2168.0, abs=1.0)


def test_the_coupling_of_a_generator_set_is_barred_by_a_misfire_alone() -> None:
    limit, speeds = {"shaft_torque_limit_9": 600.0}, [1000.0, 2200.0]
    shaft = "diesel_105x137_generator_set"
    archive = archive_of(shaft, TORQUE, limit, speeds, misfire=[0, 1])
    found = barred_ranges(archive)
    assert {one.case["misfire"] for one in found.ranges} == {1.0}
    assert [(one.order, one.mode) for one in found.ranges] == [(1.0, 1), (0.5, 1)]
    assert found.ranges[0].low_between[0] == -np.inf and found.ranges[0].low == 1000.0
    assert found.ranges[1].high_between[1] == np.inf and found.ranges[1].high == 2200.0
    _agrees(archive, found, TORQUE, archive_of(
        shaft, TORQUE, limit, _dense(found), misfire=[0, 1]
    ))  # fmt: skip
    said = barred_text(archive, found)
    assert "(1000) to 11" in said and "the range may go on" in said
    assert "no speed is barred between 1000 and 2200 rpm (all cylinders fire)" in said


def test_every_peak_of_a_range_has_its_cause_and_all_cases_their_union() -> None:
    """Peaks of orders 1 and 0.5 that one range joins, as the limit is low."""
    limit, shaft = {"shaft_torque_limit_9": 250.0}, "diesel_105x137_generator_set"
    archive = archive_of(shaft, TORQUE, limit, [1000.0, 1500.0, 2200.0], misfire=[0, 1])
    found = barred_ranges(archive)
    (joined,) = (one for one in found.ranges if one.peaks[1:])
    assert {(one.order, one.mode) for one in joined.peaks} == {(1.0, 1), (0.5, 1)}
    place, case = list(archive["shaft_name"].values).index(joined.place), [0, 1]
    dense = archive_of(shaft, TORQUE, limit, [peak.at for peak in joined.peaks], misfire=case)
    values = dense[TORQUE].sel(misfire=1).isel(shaft=place).values
    assert_allclose(values, [peak.largest for peak in joined.peaks], rtol=1e-9)
    assert joined.largest == joined.peaks[0].largest > joined.peaks[1].largest
    said = barred_text(archive, found)
    for peak in joined.peaks:
        assert f"order {peak.order:g}, mode 1 (critical at {peak.critical_speed:.5g} rpm)" in said
    assert "of the archive's own 3 speeds 1000, 1500, 2200 rpm are in a barred range" in said


def test_ranges_of_all_cases_are_joined(diesel: xr.Dataset, solved: Barred) -> None:
    low, high = min(one.low for one in solved.ranges), max(one.high for one in solved.ranges)
    said = barred_text(diesel, solved)
    assert f"barred in any case, on any shaft: {low:.1f} to {high:.1f} rpm" in said
    assert "of the archive's own 4 speeds none is in a barred range" in said


def test_a_case_without_a_result_is_not_counted_as_good(diesel: xr.Dataset, solved: Barred) -> None:
    reached = np.where(diesel.misfire.values == 4, MEANINGS.index("torque_not_reached"), 0)
    lost = diesel.assign(status=("misfire", reached))
    why = [_outcomes(lost, {"misfire": place}) for place in range(2)]
    assert why == ["", "torque_not_reached"]
    found = replace(
        solved, ranges=solved.ranges[:1], worst=(solved.worst[0], (-np.inf, "", np.nan)),
        without=(0, solved.solved.size), outcomes=tuple(why),
    )  # fmt: skip
    said = barred_text(diesel, found)
    assert "1 barred range in 1 of 1 case with a result" in said
    assert "misfire 4: no result at any speed (torque_not_reached)" in said


def test_a_peak_narrower_than_the_steps_is_found() -> None:
    undamped = {f"shaft_loss_factor_{i}": 1e-6 for i in range(1, 9)}
    undamped |= {f"disc_damping_{i}": 0.0 for i in range(3, 9)}
    peak = archive_of(ENGINE, TORQUE, {**undamped, "shaft_torque_limit_8": 1e3},
                      [2165.0, 2165.83605, 2166.0, 2167.0])  # fmt: skip
    ratio = peak[TORQUE].isel(shaft=7).values
    assert ratio[[0, 2, 3]].max() < 0.95 * ratio[1]  # Whole numbers of rpm lie beside the peak
    limit = {**undamped, "shaft_torque_limit_8": 1e3 * 0.97 * float(ratio[1])}
    found = barred_ranges(archive_of(ENGINE, TORQUE, limit, [2000.0, 2300.0]))
    assert len(found.ranges) == 1 and found.ranges[0].mode == 1
    assert found.ranges[0].low < 2165.836 < found.ranges[0].high
    assert found.ranges[0].high - found.ranges[0].low < 0.5


def test_designs_with_names_and_a_part_of_an_archive() -> None:
    archive = sweeps.run(
        engine=ENGINE, shaft="diesel_105x137_damper", set={"shaft_stress_limit_8": 40.0},
        axes={"speed": [1900, 2500], "misfire": [0, 4]},
        designs={"case": ["none", "oil"], "damper_inertia_1": [0.1, 0.05],
                 "damper_damping_1": [0.0, 30.0], "damper_stiffness_1": [0.0, 0.0],
                 "damper_loss_factor_1": [0.0, 0.0]},
        output={"quantities": [STRESS]},
    )  # fmt: skip
    found = barred_ranges(archive)
    assert len(found.cases) == 4 and {one.case["case"] for one in found.ranges} == {"none"}
    part = barred_ranges(sweeps.nearest(archive, case="none", misfire=4))
    (whole,) = (one for one in found.ranges if one.case["misfire"] == 4)
    assert (part.ranges[0].low, part.ranges[0].high) == pytest.approx((whole.low, whole.high), 1e-6)


def test_what_cannot_be_told_is_refused_in_one_line(diesel: xr.Dataset) -> None:
    for archive, why in (
        (diesel.drop_vars(STRESS), "has none of shaft_stress_over_limit"),
        (diesel.isel(speed=0), "two speeds or more"),
        (diesel.where(diesel[STRESS] < 0.0), "no shaft has a limit"),
        (diesel.drop_attrs(), "does not have the scene"),
    ):
        with pytest.raises(SceneError, match=why) as error:
            barred_ranges(archive)
        assert "\n" not in str(error.value)


def test_the_command_says_ranges_cases_and_causes(diesel: xr.Dataset, tmp_path: Path) -> None:
    path = tmp_path / "shaft.nc"
    write(diesel, path)
    said = ok("barred", path)
    assert "2 barred ranges in 2 of 2 cases" in said
    assert "2110.5 to 2217.5" in said and "misfire 4" in said
    assert "order 6, mode 1 (critical at 2165.8 rpm)" in said
    write(diesel.drop_vars(STRESS), tmp_path / "none.nc")
    lacking = refused("barred", tmp_path / "none.nc")
    assert "none.nc: has none of shaft_stress_over_limit" in lacking and "stress_limit" in lacking
    assert "2 barred ranges" not in ok("barred", path, "--select", "misfire=4")
    for options in (
        ["--select", "speed=2000"],
        ["--select", "mode=2"],
        ["--select", "order=2"],
        ["--select", "misfire=9"],
        ["--threads", "0"],
    ):
        assert options[1].partition("=")[0] in refused("barred", path, *options)


def test_it_stands_beside_the_other_functions(diesel: xr.Dataset, solved: Barred) -> None:
    assert sweeps.barred_ranges is barred_ranges
    assert diesel.dyn.barred_ranges(threads=1).ranges == solved.ranges
    with pytest.raises(SceneError, match="archive = 'first': must be"):
        sweeps.barred_ranges("first")


@pytest.mark.parametrize(
    ("shape", "rated", "said"),
    [(0.55, 3600.0, "below the limit for passing"), (0.25, 3600.0, "barring does not suffice"),
     (0.55, 2400.0, "it permits no barred range above 0.8 of the rated speed")],
)  # fmt: skip
def test_ranges_of_propulsion_shafts_are_held_against_the_limit_for_passing(
    shape: float, rated: float, said: str
) -> None:
    pytest.importorskip("bokeh")
    path = Path(str(resources.files("sweeps.catalogue"))) / "shafts" / f"{ENGINE}.toml"
    shaft: dict[str, Any] = tomllib.loads(path.read_text(encoding="utf-8"))["shaft"]
    shaft["shafts"][7] |= {"tensile_strength": 600.0, "shape_factor": shape}
    archive = sweeps.run(
        engine=ENGINE, shaft=shaft, axes={"speed": [2050, 2300], "misfire": [0, 4]},
        set={"rated_speed": rated}, output={"quantities": ["propulsion_stress_over_limit"]},
        silenced_warnings=["all"],
    )  # fmt: skip
    found = barred_ranges(archive)
    assert len(found.ranges) >= 2
    for one in found.ranges:
        # IACS UR M68: tau_T = 1.7 tau_C / sqrt(c_K), up to 0.8 of the rated speed
        expected = one.largest * np.sqrt(shape) / 1.7 if one.at <= 0.8 * rated else np.nan
        assert one.peaks[0].over_passing == pytest.approx(expected, rel=1e-9, nan_ok=True)
    rule = [line for line in barred_text(archive, found).split("\n") if "UR M68" in line]
    assert len(rule) == 1 and said in rule[0]
    verdict = verdicts.verdict(archive, [], [], None).html
    first, second = verdict.split("</p>")[:2]
    assert "Barred in any case, on any shaft: " in first and said in second
    assert verdict.count("IACS") == 1 and "<details>" in verdict
    assert verdict.partition("<details>")[0].count("<tr>") == 2  # Heads and one shaft


# ---- reports -------------------------------------------------------------------------------------


def test_a_report_solves_between_speeds_or_gives_no_verdict(
    diesel: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("bokeh")
    told = page(diesel)
    assert "Above the limit in 2 of 2 cases: up to 1.26 times" in told
    assert told.index('id="verdict"') < told.index('id="computed"')
    target = page(diesel, target="shaft_stress_over_limit <= 1")
    assert "said of the archive's own speeds alone" in html.unescape(target)
    assert "The limits of the shaft below are solved between them" in target
    assert "Campbell diagram: critical speeds" in told and "No speed is barred" not in told
    monkeypatch.setattr(verdicts, "MOST_SOLVED", 10)
    told = page(diesel)
    assert "No verdict: at the points of the archive" in told and "engine-dyn barred" in told


def test_a_report_on_a_shaft_without_limits_has_a_campbell_diagram() -> None:
    pytest.importorskip("bokeh")
    names = ["shaft_torque_half_range", "natural_frequency", "critical_speed", "mode_vector_sum"]
    archive = sweeps.run(
        engine=ENGINE, shaft=ENGINE, axes={"speed": [1000, 2500]}, output={"quantities": names}
    )
    told = page(archive)
    assert "Campbell diagram" in told and 'id="verdict"' not in told
    assert "Campbell diagram: critical speeds" not in page(archive.drop_vars("mode_vector_sum"))


@pytest.fixture(scope="module")
def pendulum() -> dict[str, Any]:
    """The diesel's shaft with a pendulum on its flywheel, whose modes change with the speed."""
    path = Path(str(resources.files("sweeps.catalogue"))) / "shafts" / f"{ENGINE}.toml"
    shaft: dict[str, Any] = tomllib.loads(path.read_text(encoding="utf-8"))["shaft"]
    one = {"on": "flywheel", "mass": 6.0, "distance": 0.12, "length": 0.03}
    return {**shaft, "pendulums": [one]}


@pytest.mark.parametrize(
    ("axes", "limited"),
    [
        ({}, False), ({"misfire": [0, 1]}, True),
        ({"pendulum_mass_1": [3.0, 6.0]}, False), ({"pendulum_mass_1": [3.0, 6.0]}, True),
    ],
)  # fmt: skip
def test_modes_that_change_with_the_speed_are_drawn(
    pendulum: dict[str, Any], axes: dict[str, Any], limited: bool
) -> None:
    pytest.importorskip("bokeh")
    names = [STRESS if limited else "shaft_torque_half_range", *MODES]
    archive = sweeps.run(
        engine=ENGINE, shaft=pendulum, axes={**axes, "speed": [2500, 1000, 2000]},
        set={"shaft_stress_limit_8": 58.0}, output={"quantities": names},
        silenced_warnings=["all"],
    )  # fmt: skip
    first = archive.isel({d: 0 for d in axes})
    drawn = verdicts.verdict(archive, [], [], None).figures[-1]
    assert drawn.title.startswith("Campbell") and "change with the speed" in drawn.note
    assert ("Case:" in drawn.note) == bool(axes)
    line = drawn.figure.renderers[0].data_source.data
    frequency = first["natural_frequency"].isel(mode=0).sortby("speed")
    assert_allclose(line["x"], [1000.0, 2000.0, 2500.0])
    assert_allclose(line["y"], frequency.values, rtol=1e-6)
    assert line["y"][-1] > 2.0 * line["y"][0]
    assert "Campbell" in page(archive)
    if "pendulum_mass_1" not in axes:  # Else the figure is of the shaft's own mass
        lines = archive.dyn.plot("campbell")["campbell"].axes[0].lines
        levels = [np.interp(line["x"], *one.get_data()) for one in lines]
        assert any(np.allclose(level, frequency.values, rtol=1e-6) for level in levels)


def test_modes_of_other_dimensions_are_not_drawn(diesel: xr.Dataset, solved: Barred) -> None:
    pytest.importorskip("bokeh")
    assert campbell_figure(solved.modes, solved.speeds, "")
    for name in MODES:
        one = solved.modes[name]
        for other in (one.expand_dims(x=2), one.isel(mode=0, drop=True)):
            assert campbell_figure(solved.modes.assign({name: other}), solved.speeds, "") == []
        assert campbell_figure(solved.modes.drop_vars(name), solved.speeds, "") == []
    assert campbell_figure(solved.modes * np.nan, solved.speeds, "") == []


@pytest.fixture(scope="module")
def shaft_with_modes() -> xr.Dataset:
    return sweeps.run(
        engine=ENGINE, shaft=ENGINE, axes={"speed": [1000, 1500, 2500], "misfire": [0, 4]},
        set={"shaft_stress_limit_8": 58.0}, output={"quantities": [STRESS, *MODES]},
    )  # fmt: skip


def _with(name: str, values: Any) -> Any:
    """A change of an archive: other values of a coordinate, or one value of a variable."""

    def changed(archive: xr.Dataset) -> xr.Dataset:
        one = archive[name]
        if name in archive.coords:
            return archive.drop_vars(name).assign_coords({name: (one.dims, values, one.attrs)})
        return archive.assign({name: (one.dims, np.full(one.shape, values), one.attrs)})

    return changed


def _shaped(change: Any) -> Any:
    """A change of an archive: other dimensions of the stress over its limit."""
    return lambda archive: archive.drop_vars(STRESS).assign({STRESS: change(archive[STRESS])})


def _unit(unit: Any) -> Any:
    def changed(archive: xr.Dataset) -> xr.Dataset:
        changed = archive.copy()
        changed[STRESS] = archive[STRESS].assign_attrs(units=unit)
        return changed

    return changed


TIMES = np.array([1, 2, 3], "datetime64[ns]")

HOSTILE: dict[str, Any] = {
    **{f"unit {unit!r:.12}": _unit(unit)
       for unit in ("furlong", "", 3, "\x1b[31m\n<script>", "x" * 5000, "9**9**9")},
    **{f"all {value!r}": _with(STRESS, value)
       for value in (np.nan, np.inf, -np.inf, 1e308, -1.0, True, "a", TIMES[0])},
    **{f"speeds {values[1]!r}": _with("speed", values)
       for values in ([1e3, np.nan, 2e3], [1e3, np.inf, 2e3], [-1e3, 0.0, 1e300], [1e3, 1e3, 1e3],
                      ["a", "b", "c"], TIMES)},
    "misfires a": _with("misfire", ["a", "b"]),
    "misfires nan": _with("misfire", [np.nan, 0.5]),
    "no speed": _shaped(lambda one: one.isel(speed=0, drop=True)),
    "no shaft": _shaped(lambda one: one.isel(shaft=0, drop=True)),
    "no dimension": _shaped(lambda one: one.isel(shaft=0, speed=0, misfire=0, drop=True)),
    "another dimension": _shaped(lambda one: one.expand_dims(zoo=3)),
    "crank angles": _shaped(lambda one: one.expand_dims(crank_angle=4)),
    **{f"without {name}": lambda archive, name=name: archive.drop_vars(name)
       for name in ("speed", "misfire", "shaft_name", "mode", "order")},
    **{f"empty {dim}": lambda archive, dim=dim: archive.isel({dim: []})
       for dim in ("speed", "misfire", "shaft", "mode", "order")},
    "without shaft_name, scene": lambda archive: (
        archive.drop_vars("shaft_name").assign_attrs(scene="")
    ),
    **{f"scene {text!r:.12}": lambda archive, text=text: archive.assign_attrs(scene=text)
       for text in ("", "{", "[]", "null", '{"axes": 3}')},
}  # fmt: skip


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_limits_are_taken_or_refused_in_one_line(
    shaft_with_modes: xr.Dataset, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("bokeh")
    changed = HOSTILE[kind](shaft_with_modes)
    found: list[Barred | SceneError] = []

    def once(archive: xr.Dataset) -> Barred:
        """Barred ranges of the archive; reports ask for them too."""
        assert archive is changed
        if not found:
            try:
                found.append(barred_ranges(archive, threads=1))
            except SceneError as error:
                found.append(error)
        if isinstance(found[0], SceneError):
            raise found[0]
        return found[0]

    monkeypatch.setattr(verdicts, "barred_ranges", once)
    doors: list[Any] = [lambda: page(changed, target=f"{STRESS} <= 1"), lambda: once(changed)]
    for door in doors:
        try:
            door()
        except SceneError as error:
            assert "\n" not in str(error) and len(str(error)) < 1000
            if door is doors[0]:
                assert "Explorer" in page(changed)  # Only the target was refused


def test_a_hostile_file_is_reported_by_the_command(
    shaft_with_modes: xr.Dataset, tmp_path: Path
) -> None:
    pytest.importorskip("bokeh")
    for number, kind in enumerate(("all nan", "no shaft", "speeds 0.0")):
        path = tmp_path / f"{number}.nc"
        write(HOSTILE[kind](shaft_with_modes), path)
        ok("report", path, "-o", path.with_suffix(".html"))
        assert "archive: " in refused("barred", path)


def test_a_report_tells_which_designs_meet_a_target() -> None:
    pytest.importorskip("bokeh")
    archive = sweeps.run(
        engine="ntua",
        axes={"inertia": [4, 12, 16, 20], "load": [50, 90], "speed": [1200, 1500]},
        output={"quantities": ["delta"]},
    )
    told = page(archive, target="delta <= 1/50")
    best = sweeps.best(archive, least="inertia", within="delta <= 1/50", at_every=["load", "speed"])
    assert float(best.inertia) == 16.0
    assert "delta over inertia, with its limit" in told
    for target, why in (("delta <= few", "delta"), ("swing <= 1", "swing"), ("delta", "must be a")):
        with pytest.raises(SceneError, match=why):
            page(archive, target=target)
    assert 'id="verdict"' not in page(archive)
    with pytest.raises(SceneError, match="not_counted is only used with target"):
        page(archive, not_counted="stalled")


TARGET = "delta <= 1/50"


def _sample(**reduce: Any) -> xr.Dataset:
    return sweeps.run(
        engine="ntua", sample={"number": 300, "inertia": {"low": 1.0, "high": 12.0},
                               "rod_length": {"low": 0.3, "high": 0.4}},
        output={"quantities": ["delta", "omega_max"]}, **({"reduce": reduce} if reduce else {}),
    )  # fmt: skip


def test_a_report_names_the_lightest_designs_of_a_list() -> None:
    pytest.importorskip("bokeh")
    archive = _sample()
    best = sweeps.best(archive, least="inertia", within=TARGET)
    found = verdicts.verdict(archive, [TARGET], [], None)
    said = html.unescape(found.html)
    number = int((archive.delta <= 1 / 50).sum())
    assert f"least inertia = {float(best.inertia):#.4g} kg m²" in said
    assert f"{number} of 300 designs fulfil delta <= 1/50" in said
    assert f"rod_length = {1e3 * float(best.rod_length):#.4g} mm" in said
    assert "those with the least inertia that hold" in said and "does not hold" not in said
    assert "<th>at</th>" not in found.html  # No column without a text
    (drawn,) = found.figures
    assert drawn.title == "delta over inertia, with its limit"
    meets, fails, one = (one.data_source.data["y"] for one in drawn.figure.renderers[1::2])
    assert one == np.float32(best.delta)
    assert (len(meets), len(fails)) == (number, 300 - number)
    assert meets.max() <= 1 / 50 < fails.min()


def test_a_report_judges_several_targets_together() -> None:
    pytest.importorskip("bokeh")
    archive, other = _sample(), "omega_max <= 1206.9 rpm"
    both = (archive.delta <= 1 / 50) & (archive.omega_max <= 1206.9 * np.pi / 30.0)
    assert 0 < int(both.sum()) < int((archive.delta <= 1 / 50).sum())
    said = html.unescape(verdicts.verdict(archive, [TARGET, other], [], None).html)
    assert "All 2 targets" in said and f"{int(both.sum())} of 300 designs fulfil" in said
    light = float(archive.inertia.where(both).min())
    assert f"least inertia = {light:#.4g} kg m²" in said.partition("<h3>delta")[0]


def test_a_report_judges_the_designs_that_a_reduced_archive_kept() -> None:
    pytest.importorskip("bokeh")
    every = _sample()
    reduced = _sample(within=[TARGET], best=[{"least": "delta", "number": 40}],
                      front=[{"of": ["inertia", "delta"]}])  # fmt: skip
    said = html.unescape(verdicts.verdict(reduced, [TARGET], [], None).html)
    kept = reduced.sizes["design"]
    assert f"judged here are the {kept} designs that its searches kept, of 300" in said
    assert f"Of all 300, {int((every.delta <= 1 / 50).sum())} meet delta <= 1/50" in said
    # A front of inertia and delta has the lightest design of all that meets a limit of delta.
    best = sweeps.best(every, least="inertia", within=TARGET)
    assert f"least inertia = {float(best.inertia):#.4g} kg m²" in said
    assert "delta over inertia, with its limit" in page(reduced, target=TARGET)
    with pytest.raises(SceneError, match="kept no designs"):
        page(_sample(within=[TARGET]), target=TARGET)


def test_designs_at_every_speed_are_not_their_points() -> None:
    """Three numbers: all designs, all their points of work, and the designs that were kept."""
    pytest.importorskip("bokeh")
    scene = {
        "engine": "ntua", "axes": {"speed": [1000, 1500]}, "output": {"quantities": ["delta"]},
        "sample": {"number": 300, "inertia": {"low": 1.0, "high": 30.0}},
    }  # fmt: skip
    every = sweeps.run(**scene)
    one = {"within": TARGET, "least": "inertia", "number": 5}
    asked = {"within": [TARGET], "over": "design", "at_every": ["speed"],
             "front": [{"of": ["inertia", "delta"]}]}  # fmt: skip
    reduced = sweeps.run(**scene, reduce={**asked, "best": [one]})
    points, designs = (
        int(n.sum()) for n in (every.delta <= 0.02, (every.delta <= 0.02).all("speed"))
    )
    assert 0 < 2 * designs < points < 600
    assert f"points within limits\n  {TARGET}: {points} of 600" in "\n".join(
        reduction_lines(reduced, {})
    )
    found = verdicts.verdict(reduced, [TARGET], [], None)
    said = html.unescape(found.html)
    kept = reduced.sizes["design"]
    assert (
        f"the {kept} designs that its searches kept, of 300. Of all: {designs} of 300 designs"
        in said
    )
    assert f" of {kept} kept designs fulfil {TARGET} at every speed" in said
    (drawn,) = found.figures
    assert drawn.title == "delta over inertia, with its limit"
    best = sweeps.best(every, least="inertia", within=TARGET, at_every="speed")
    source = drawn.figure.renderers[-1].data_source.data
    assert source["x"] == np.float32(best.inertia) and source["y"] == np.float32(best.delta.max())
    front = sweeps.run(**scene, reduce=asked)  # No search counted the designs of the condition
    said = html.unescape(verdicts.verdict(front, [TARGET], [], None).html)
    assert f"Of all 600 points, {points} meet {TARGET}" in said
