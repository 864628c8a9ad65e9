"""A decision comes first: the value, where it is decided, what is left to the limits, few rows."""

import html
import re
from typing import Any

import numpy as np
import pytest
import xarray as xr

import sweeps
from sweeps.base.errors import SceneError
from sweeps.base.numbers import number_text
from sweeps.decide.explore.search import least_between, search_best
from sweeps.decide.optimise import optimise as optimising
from sweeps.view.figures.wording import equal_lines
from sweeps.view.report.verdict import verdict
from sweeps.view.texts.optimised import best_text, decision_lines, optimised_text
from sweeps.view.texts.wording import Wording
from tests.support.commands import ok, refused

INERTIA = np.geomspace(1.0, 16.0, 9)
LOADS, SPEEDS = [50.0, 100.0], [1500.0, 1800.0, 2000.0, 2200.0, 2400.0, 2600.0]


def swing(load: Any, speed: Any) -> Any:
    return 0.04 * (load / 100.0) * (1500.0 / speed) ** 2


@pytest.fixture
def archive() -> xr.Dataset:
    """Delta in inverse proportion to the inertia, but for its square; a stress of three shafts."""
    inertia, load, speed = np.meshgrid(INERTIA, LOADS, SPEEDS, indexing="ij")
    delta = swing(load, speed) / inertia * (1.0 + 0.05 / inertia**2)
    stress = np.stack([load * 0.1, load * 0.3 + speed / 1e6, np.full(load.shape, np.nan)], -1)
    dims = ("inertia", "load", "speed")
    return xr.Dataset(
        {
            "delta": (dims, delta, {"units": "1"}),
            "brake_power": (dims[1:], load[0] * speed[0], {"units": "W"}),
            "stress": ((*dims, "shaft"), stress, {"units": "MPa"}),
        },
        {
            "inertia": ("inertia", INERTIA, {"units": "kg m2"}),
            "load": ("load", LOADS, {"units": "percent"}),
            "speed": ("speed", SPEEDS, {"units": "rpm"}),
            "shaft": [1, 2, 3],
            "shaft_name": ("shaft", ["pulley - throw 1", "throw 1 - flywheel", "ring"]),
        },
    )


EVERY: dict[str, Any] = {"at_every": ["load", "speed"]}


def text_of(archive: xr.Dataset, units: str | None = None, **asked: Any) -> list[str]:
    return best_text(archive, search_best(archive, **asked), units=units).splitlines()


def test_the_decision_comes_first(archive: xr.Dataset) -> None:
    lines = text_of(archive, least="inertia", within="delta <= 1/100", **EVERY)
    assert lines[:5] == [
        "least inertia = 5.657 kg m²",
        "conditions at every load and speed, each with its worst value:",
        "  delta <= 1/100: 1/141.2 at load = 100 %, speed = 1500 rpm, a margin of 29 %",
        "4 of 9 designs fulfil delta <= 1/100 at every load and speed",
        "on the grid of this archive; interpolated between its values: 4.01 kg m²",
    ]
    table = lines[7:17]
    assert table[0].split()[:2] == ["100", "1500"]  # The worst point first, ten of twelve
    assert "the 10 of 12 rows with the largest delta" in lines
    assert table[-1].split()[:2] == ["50", "2200"]
    assert lines[-1] == "more quantities (--quantities): stress"


def test_all_points_of_a_design_are_in_the_order_of_their_axes(archive: xr.Dataset) -> None:
    few = archive.isel(load=[1], speed=[0, 1, 2])
    within = ["delta <= 1/100", "brake_power >= 1e5", "speed <= 5000"]
    lines = text_of(few, least="inertia", within=within, **EVERY)
    (points,) = (line for line in lines if line.startswith(" speed"))
    assert points.split() == ["speed", "1500", "1800", "2000", "rpm"]


def test_units_and_several_conditions(archive: xr.Dataset) -> None:
    asked = {"within": ["brake_power >= 50000", "inertia <= 4"], **EVERY}
    lines = text_of(archive, least="delta", units="brake_power=hp", **asked)
    assert lines[0] == "least delta = 0.01003 at load = 100 %, speed = 1500 rpm"
    assert lines[1] == "  with inertia = 4 kg m²"
    assert lines[3].startswith(
        "  brake_power >= 67.0511 hp (50000 W: no unit was given): 100.6 hp at load = 50 %"
    )
    assert lines[4] == "  inertia <= 4 kg m²: 4 kg m², at the limit"
    with pytest.raises(SceneError, match="--units bar: no column"):
        text_of(archive, least="delta", units="bar=W", **asked)


def test_the_largest_that_any_case_needs(archive: xr.Dataset) -> None:
    """Where there is no design to choose, `most` asks for the largest value of all cases."""
    needed = archive.drop_vars(["stress", "brake_power"]).isel(inertia=0, drop=True)
    needed = needed.rename(delta="inertia_required")
    assert float(sweeps.best(needed, most="inertia_required")["speed"]) == 1500.0
    lines = text_of(needed, most="inertia_required")
    assert lines[0].startswith("most inertia_required = 0.04200 at load = 100 %, speed = 1500 rpm")
    aimed = needed.assign_attrs(parameters='{"wanted_delta": 0.004}')
    first = text_of(aimed, most="inertia_required")[0]
    assert first.endswith("load = 100 %, speed = 1500 rpm, wanted_delta = 1/250")
    assert lines[1] == "of 12 cases" and lines[-1].startswith("the 10 of 12 rows with the largest")
    assert text_of(needed, least="inertia_required")[0].endswith("load = 50 %, speed = 2600 rpm")
    (hint,) = [t for t in text_of(needed, most="inertia_required", **EVERY) if "no design" in t]
    assert "the largest is found without --at-every" in hint
    columns = needed.stack(design=["load", "speed"]).reset_index("design")
    assert float(sweeps.best(columns, most="inertia_required")["load"]) == 100.0
    chosen = columns.assign_coords(stroke=("design", np.arange(12.0)))
    with pytest.raises(SceneError, match=r"^speed: each design has its own"):
        sweeps.best(chosen, most="inertia_required", within="load >= 50")


def test_of_parts_the_worst_counts_and_is_named(archive: xr.Dataset) -> None:
    asked = {"within": ["stress <= 31 MPa", "inertia >= 2"], **EVERY}
    lines = text_of(archive, least="inertia", **asked)
    assert lines[2] == (
        "  stress <= 31 MPa: 30.00 MPa at load = 100 %, speed = 2600 rpm, "
        "shaft = throw 1 - flywheel, a margin of 3.2 %"
    )
    with pytest.raises(SceneError, match="stress <= 30 MPa"):
        sweeps.best(archive, least="inertia", within="stress <= 30 MPa", **EVERY)
    front = sweeps.pareto(archive, "inertia", "stress", **EVERY)
    assert front["inertia"].values.tolist() == [1.0]
    with pytest.raises(SceneError, match="varies over order"):
        sweeps.best(archive.rename(shaft="order"), least="stress", **EVERY)


def test_a_limit_between_values_of_the_grid(archive: xr.Dataset) -> None:
    """The inertia with which delta is at the limit, within the error that is said."""
    for limit in np.geomspace(0.0026, 0.04, 12).tolist():
        asked = {"least": "inertia", "within": f"delta <= {limit!r}", **EVERY}
        between = least_between(search_best(archive, **asked))
        assert between is not None
        needed, error = between
        exact = max(np.roots([limit, -0.04, 0.0, -0.04 * 0.05]).real)
        assert abs(needed / exact - 1.0) <= error < 2e-2


@pytest.mark.parametrize(
    "asked",
    [
        {"most": "inertia", "within": "delta <= 1/100"},
        {"least": "delta", "within": "inertia <= 3"},
        {"least": "inertia", "within": ["delta <= 1/100", "stress <= 1 GPa"]},
        {"least": "inertia", "within": ["delta <= 1/100", "inertia >= 2"]},
        {"least": "inertia", "within": "delta <= 1/2"},
    ],
)
def test_nothing_is_said_between_values_that_do_not_decide(
    archive: xr.Dataset, asked: dict[str, Any]
) -> None:
    assert least_between(search_best(archive, **asked, **EVERY)) is None


def test_a_lighter_design_without_a_result_tells_nothing(archive: xr.Dataset) -> None:
    archive["delta"][3] = np.nan
    found = search_best(archive, least="inertia", within="delta <= 1/50", **EVERY)
    assert float(found.design["inertia"]) == pytest.approx(4.0)
    assert least_between(found) is None


ENGINES: list[dict[str, Any]] = [
    {"engine": "ntua", "axes": {"load": [50, 90], "speed": [1200, 1500]}},
    {"engine": "si_four_87x101", "set": {"speed": 1500}, "axes": {"misfire": [0, 1]}},
]


@pytest.mark.compiled
@pytest.mark.parametrize("scene", ENGINES, ids=lambda scene: scene["engine"])
def test_interpolated_is_the_exact_inertia(scene: dict[str, Any]) -> None:
    """Within the error that is said, and twice the tolerance of the computed delta."""
    quiet = {**scene, "silenced_warnings": ["all"]}
    axes = scene["axes"]
    grid = sweeps.run(
        **{**quiet, "axes": {"inertia": np.geomspace(1.0, 40.0, 12), **axes}},
        output={"quantities": ["delta"]},
    )
    asked: dict[str, Any] = {"least": "inertia", "within": "delta <= 1/60"}
    between = least_between(search_best(grid, **asked, at_every=list(axes)))
    assert between is not None and between[1] < 1e-2
    exact = sweeps.optimise(**quiet, **asked, over="inertia = 1 to 40")
    inertia = float(exact["inertia"].item())
    assert abs(between[0] / inertia - 1.0) <= between[1] + 4e-6


@pytest.mark.compiled
def test_a_range_that_is_too_small_says_what_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without pymoo: no search could find a lighter design."""

    def missing(module: str) -> Any:
        raise SceneError("needs pymoo, which is not installed")

    monkeypatch.setattr(optimising, "_pymoo", missing)
    scene: dict[str, Any] = {**ENGINES[0], "silenced_warnings": ["all"], "least": "inertia"}
    exact = sweeps.optimise(**scene, within="delta <= 1/60", over="inertia = 1 to 40")
    short = sweeps.optimise(**scene, within="delta <= 1/60", over="inertia = 1 to 5")
    least = number_text(float(exact["inertia"].item()))
    needed = f"inertia = {least} kg m² is needed at load = 90 %, speed"
    text = optimised_text(short)
    assert text.startswith(f"no design: {needed}") and "above 5 kg m²" in text
    assert not short["found"].values.any() and short.sizes["design"] == 1
    other = sweeps.optimise(**scene, within=["delta <= 1/60", "imep >= 50"],
                            over="inertia = 1 to 40")  # fmt: skip
    said = optimised_text(other)
    assert "1 meet delta <= 1/60; 0 meet imep >= 50" in said and "is needed" not in said
    whole = sweeps.optimise(**scene, within="delta <= 1/60",
                            over=["inertia = 1 to 5", "cylinders = 1, 2"])  # fmt: skip
    assert "is needed at" in optimised_text(whole)


def verdict_of(archive: xr.Dataset, target: str, not_counted: str = "") -> str:
    """The verdict of a report as a text, a line for each paragraph."""
    told = verdict(archive, [target], [not_counted] if not_counted else [], None).html
    return html.unescape(re.sub(r"<[^>]*>", "", re.sub(r"</(p|li|tr|h3)>", "\n", told)))


@pytest.mark.parametrize(
    "target", ["delta <= 1/100", "delta < 0.0123456789", "stress <= 32 MPa", "delta <= 1/1000"]
)
@pytest.mark.parametrize("failed", [(), (3, 1, 0), (slice(None), 0, 0)])
@pytest.mark.parametrize("not_counted", ["", "no_steady_state"])
def test_the_verdict_of_a_report_is_what_best_says(
    archive: xr.Dataset, target: str, failed: Any, not_counted: str
) -> None:
    pytest.importorskip("bokeh")
    status = np.zeros(archive["delta"].shape, np.int8)
    status[failed] = 2 if failed else 0
    archive["status"] = (archive["delta"].dims, status)
    archive["delta"] = archive["delta"].where(archive["status"] == 0)
    told = verdict_of(archive, target, not_counted)
    try:
        found = search_best(
            archive, least="inertia", within=target, **EVERY, not_counted=not_counted or ()
        )
    except SceneError as error:
        assert str(error) in told and "holds\n" not in told
        return
    said = decision_lines(archive, found, Wording(archive))
    assert set(map(str.strip, said)) <= set(map(str.strip, told.splitlines()))


def test_a_failed_point_meets_no_target_and_is_named(archive: xr.Dataset) -> None:
    """Neither one that failed in every design nor one that was not computed at all."""
    pytest.importorskip("bokeh")
    limit = "delta <= 1/100"
    assert "4 of 9 designs fulfil" in verdict_of(archive, limit)
    archive["delta"][:, 0, 5] = np.nan
    archive["delta"][7, 1, 2] = np.nan
    told = verdict_of(archive, limit)
    assert "no value, 10 of 108 points" in told
    assert "2 points without a result, first at load = 50 %, speed = 2600 rpm" in told
    assert told.count("does not hold") == 9
    with pytest.raises(SceneError, match="no value, 10 of 108 points"):
        sweeps.best(archive, least="inertia", within=limit, **EVERY)
    one = archive.isel(inertia=[8])
    assert "It holds." not in verdict_of(one, limit)
    assert verdict_of(one.isel(speed=slice(0, 4)), limit).split("\n")[1] == "It holds."
    with pytest.raises(SceneError, match="no status"):
        verdict_of(archive, limit, "no_steady_state")


def test_what_every_case_needs_names_the_cases_that_failed(archive: xr.Dataset) -> None:
    pytest.importorskip("bokeh")
    needed = archive[["delta"]].isel(inertia=0, drop=True).rename(delta="inertia_required")
    needed["inertia_required"].attrs["units"] = "kg m2"
    needed["inertia_required"][0, 3] = np.nan
    told = html.unescape(verdict(needed, [], [], None).html)
    first, of = text_of(needed, most="inertia_required")[:2]
    assert f"{first}, {of}" in told and of == "of 12 cases, 1 of them without a result"


@pytest.mark.compiled
def test_designs_with_speeds_of_their_own_are_judged_and_none_is_chosen() -> None:
    pytest.importorskip("bokeh")
    designs = {"speed": [1200, 1500], "stroke": [0.15, 0.14]}
    archive = sweeps.run(engine="ntua", designs=designs, output={"quantities": ["delta"]},
                         silenced_warnings=["all"])  # fmt: skip
    assert "2 of 2 designs fulfil delta <= 1/10\n" in verdict_of(archive, "delta <= 1/10")


@pytest.mark.compiled
def test_the_command_and_python_say_the_same(
    tmp_path: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "first.nc"
    ok("run", "first", "-o", path)
    said = ok("best", path, "--least", "inertia", "--within", "delta <= 1/50", "--at-every", "load")
    with sweeps.open(path) as opened:
        opened.dyn.show_best(least="inertia", within="delta <= 1/50", at_every="load")
    printed = capsys.readouterr().out  # Tables have the width of what they are printed on
    assert printed.splitlines()[:5] == said.splitlines()[:5]
    assert said.startswith("least inertia = 12 kg m²\n")
    why = refused("best", path, "--least", "inertia", "--within", "delta <= 1/50")
    assert why.startswith("engine-dyn: load: a design works at all values of it")


def test_a_shaft_study_without_vector_sums_says_what_its_campbell_diagram_needs() -> None:
    coordinates = {"mode": [1, 2], "speed": ("speed", [1000.0, 2000.0], {"units": "rpm"})}
    shaft = xr.Dataset({"natural_frequency": ("mode", [50.0, 90.0])}, coordinates)
    needs = "A Campbell diagram needs critical_speed, mode_vector_sum among the quantities."
    assert needs in verdict(shaft, [], [], None).html
    assert not verdict(shaft.drop_dims("mode"), [], [], None).html


def test_a_name_stands_for_the_values_of_a_design() -> None:
    labels = ("design", ["light", "heavy"])
    archive = xr.Dataset(
        {"delta": ("design", [0.02, 0.01])},
        {"design": [0, 1], "case": labels, "stroke": ("design", [0.1, 0.2])},
    )
    assert Wording(archive).design(archive, archive.isel(design=1)) == "case = heavy"
    alike = archive.assign_coords(case=("design", ["heavy", "heavy"]))  # Tells nothing apart
    said = Wording(alike).design(alike, alike.isel(design=1))
    assert "stroke = 0.2" in said and "case = heavy" in said


def test_lines_that_lie_on_each_other_are_one() -> None:
    names = ["all cylinders fire", *(f"misfire {i}" for i in range(1, 5))]
    low, high = np.array([0.01, np.nan]), np.array([0.05, 0.04])
    assert equal_lines(names, [low, *4 * [high]]) == [(0, names[0]), (1, "misfire 1 to 4")]
    apart = [low, high, 1.01 * high, high * 1.0001, 1.01 * high]
    assert [said for _, said in equal_lines(names, apart)] == [
        names[0], "misfire 1, 3", "misfire 2, 4",
    ]  # fmt: skip
    assert [i for i, _ in equal_lines(names[:2], [1500.0 + low, 1500.0 + high])] == [0, 1]
