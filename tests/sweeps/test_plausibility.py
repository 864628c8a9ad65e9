"""Plausibility warnings of scenes: which mistakes are noticed, and where the lines are kept."""

import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import engine_dyn
import sweeps
from engine_dyn.plausibility.usual_ranges import CHECKS, check_of_cylinder
from engine_dyn.quantities.each_cylinder import OF_CYLINDER
from sweeps.base.errors import SceneError
from sweeps.scene.engine.engine_files import catalogue
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.plan.plausibility import plausibility_warnings
from sweeps.scene.reading import built_in_scenes, read_scene
from tests.support.commands import invoke
from tests.support.mistakes import MISTAKES, Mistake
from tests.support.scenes import write_scene

DOCUMENT = Path(__file__).resolve().parents[2] / "docs" / "plausibility.md"

NOT_NOTICED = {
    "inertia in lb ft2", "GD2 for inertia", "heat in MPa",
    "start of combustion in radians", "diagram in MPa, charged engine",
}  # fmt: skip
"""Values that another engine may have."""


def told_of(scene: Any) -> tuple[str, ...]:
    return plausibility_warnings(make_plan(read_scene(scene)))


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.text)
def test_typical_mistakes_are_noticed(mistake: Mistake, tmp_path: Path) -> None:
    try:
        lines = told_of(mistake.scene(tmp_path))
    except SceneError as refusal:
        lines = (str(refusal),)
    assert bool(lines) == (mistake.text not in NOT_NOTICED), lines
    assert all("\n" not in line for line in lines)
    # One mistake is one line: what follows from it is not told again.
    assert len(lines) <= 1, lines


def test_the_pitch_of_bores_is_not_that_of_a_boxers_throws(tmp_path: Path) -> None:
    keys = {"bore": 0.08, "stroke": 0.07, "cylinders": 4, "rod_length": 0.13, "speed": 3000,
            "reciprocating_mass": 0.6, "rod_mass": 0.4, "rod_centre_of_gravity": 0.035,
            "crank_mass": 0.0}  # fmt: skip
    for spacing, warned in ((0.04, False), (0.09, True), (0.113, True)):
        path = tmp_path / "boxer.toml"
        lines = [f"{key} = {value}" for key, value in {**keys, "cylinder_spacing": spacing}.items()]
        head = 'title = "Boxer"\ncycle = "four-stroke"\narrangement = "boxer 4"\n[values]\n'
        path.write_text(head + "\n".join(lines))
        told = told_of({"engine": str(path), "output": {"quantities": ["shaking_moment_max"]}})
        assert any("cylinder_spacing" in line for line in told) == warned


def test_most_mistakes_are_noticed_and_the_others_documented() -> None:
    texts = [mistake.text for mistake in MISTAKES]
    assert len(set(texts)) == len(texts) >= 34
    assert set(texts) >= NOT_NOTICED
    assert len(texts) - len(NOT_NOTICED) >= 30 / 34 * len(texts)
    document = DOCUMENT.read_text(encoding="utf-8")
    for text in NOT_NOTICED:
        assert f"- {text}" in document, text


@pytest.mark.parametrize(
    ("text", "asked"),
    [
        ("bore in inches", "is bore in inches?"), ("bore in cm", "is bore in cm?"),
        ("inertia in kg cm2", "is inertia in kg cm2?"), ("inertia in g m2", "is inertia in g m2?"),
        ("speed in 1/s", "is speed in 1/s?"), ("speed in rad/s", "is speed in rad/s?"),
        ("crankcase pressure in kPa", "is crankcase_pressure in kPa?"),
        ("crankcase pressure over the atmosphere", "is crankcase_pressure a gauge pressure?"),
        ("load as a share of 1", "is load a share of 1, not percent?"),
        ("rated power in kW", "is rated_power in kW?"),
        ("diagram 20 degrees late", "is the diagram's angle late?"),
    ],
)  # fmt: skip
def test_the_unit_that_fits_is_asked_about(text: str, asked: str, tmp_path: Path) -> None:
    (mistake,) = (m for m in MISTAKES if m.text == text)
    (line,) = told_of(mistake.scene(tmp_path))
    assert asked in line


@pytest.mark.parametrize("name", catalogue())
def test_engines_of_the_catalogue_are_usual(name: str) -> None:
    quantities = ["delta", "bmep", "rotating_mass", "rod_torque_error", "peak_pressure"]
    assert told_of({"engine": name, "output": {"quantities": quantities}}) == ()


@pytest.mark.parametrize("name", built_in_scenes())
def test_built_in_scenes_tell_of_nothing(name: str) -> None:
    scene = read_scene(name)
    assert told_of(scene) == ()
    # What a scene silences it would tell of, and its file says why.
    raw = {**scene.source, "silenced_warnings": []}
    raw.pop("reference", None)
    told = {line.partition(":")[0] for line in told_of(raw)}
    assert told == set(scene.silenced_warnings)
    for line in built_in_scenes()[name].read_text().splitlines():
        if line.startswith("silenced_warnings"):
            assert "#" in line


SCENE: dict[str, Any] = {
    "engine": "ntua", "axes": {"inertia": [1.5, 2.0, 2e4, 3e4], "speed": [1000, 1200]},
    "output": {"quantities": ["delta", "bmep"]},
}  # fmt: skip


def test_python_warns_once_and_results_are_looked_at() -> None:
    with pytest.warns(engine_dyn.ImplausibleWarning) as caught:
        found = sweeps.run(SCENE)
    lines = found.attrs["warnings"].splitlines()
    assert [str(w.message) for w in caught] == lines
    assert {w.filename for w in caught} == {__file__}
    assert lines[0].startswith("inertia: ")
    assert "4 of 8 designs" in lines[0]
    assert "given by" not in lines[0]
    assert len(lines) == 1
    light = {**SCENE, "axes": {"inertia": [0.2, 0.25, 0.3, 2.0], "speed": [1500, 1800, 2000]}}
    found = sweeps.run(light)
    delta = found["delta"].values
    large = delta > 0.5
    assert large.any()
    (line,) = (x for x in found.attrs["warnings"].splitlines() if x.startswith("delta"))
    worst = np.unravel_index(np.nanargmax(delta), delta.shape)
    inertia, speed = (float(found[d][i]) for d, i in zip(("inertia", "speed"), worst, strict=True))
    at = f"{large.sum()} of 12 values, the worst at inertia = {inertia:g} kg m2, speed = {speed:g}"
    assert at in line


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (["inertai"], r"silenced_warnings: 'inertai': no such check; did you mean 'inertia'\?"),
        ("inertia", r"silenced_warnings = 'inertia': must be a list of names"),
        ([1], r"silenced_warnings number 1 = 1: must be a list of names|silenced_warnings.*= 1"),
    ],
)
def test_silenced_warnings_are_names_of_checks(given: Any, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        read_scene({**SCENE, "silenced_warnings": given})


@pytest.mark.slow
def test_archives_keep_the_lines_whatever_way_they_are_made(tmp_path: Path) -> None:
    asked, axes = (
        SCENE["output"]["quantities"],
        {"inertia": [0.25, 2.0, 2e4], "speed": [1500, 2000]},
    )
    more = {**axes, "inertia": [0.25, 2.0, 2e4, 3e4]}
    scene = write_scene(tmp_path, asked, axes=more)
    whole = tmp_path / "whole.nc"
    done = _done("run", scene, "-o", whole)
    lines = _lines(whole)
    assert [line.partition(":")[0] for line in lines] == ["inertia", "delta"]
    assert _told(done.stderr) == lines
    # Before anything is computed: those of results come last.
    again = tmp_path / "again.nc"
    assert _told(_done("rerun", whole, "-o", again).stderr) == lines
    assert _lines(again) == lines
    parts = [tmp_path / f"part{i}.nc" for i in (1, 2)]
    for i, part in enumerate(parts, start=1):
        _done("run", scene, "-o", part, "--shard", f"{i}/2")
    merged = tmp_path / "merged.nc"
    assert _told(_done("merge", *parts, "-o", merged).stderr) == lines
    assert _lines(merged) == lines
    with sweeps.open(parts) as opened:
        assert [x.partition(":")[0] for x in opened.attrs["warnings"].splitlines()] == [
            "inertia", "delta",
        ]  # fmt: skip
    with pytest.warns(engine_dyn.ImplausibleWarning):
        assert list(sweeps.stream(scene, tmp_path / "stream.nc").warnings) == lines
    assert _lines(tmp_path / "stream.nc") == lines
    extended = tmp_path / "extended.nc"
    _done("run", write_scene(tmp_path / "less.toml", asked, axes=axes), "-o", extended)
    assert _lines(extended) != lines
    assert _told(_done("extend", extended, "--axis", "inertia=30000").stderr) == lines
    assert _lines(extended) == lines
    if sys.platform != "win32":
        spread = tmp_path / "spread.nc"
        assert _told(_done("run", scene, "-o", spread, "--scheduler", "local:1").stderr) == lines
        assert _lines(spread) == lines
    assert _done("run", scene, "-o", again, "--overwrite", "-q").stderr == ""
    assert _told(_done("plan", scene).stderr) == lines[:1]


def _done(*arguments: str | Path) -> Any:
    result = invoke(*arguments)
    assert result.exit_code == 0, result.output
    return result


def _lines(path: Path) -> list[str]:
    with sweeps.open(path) as archive:
        return str(archive.attrs["warnings"]).splitlines()


def _told(stderr: str) -> list[str]:
    start = "warning: "
    return [x.removeprefix(start) for x in stderr.splitlines() if x.startswith(start)]


@pytest.mark.parametrize(
    ("set_", "axes", "said"),
    [
        ({}, {}, None),
        ({"speed": 2000.0}, {}, None),
        ({"speed": 1000.0}, {}, "speed = 1000 rpm; the diagrams of engine mine hold for 1200 to"),
        ({}, {"speed": [1100.0, 1500.0, 2700.0]}, "2 of 3 speeds, this is the worst"),
        # Between loads of 30 and 100 percent, both diagrams are used; at 30 percent one.
        ({"load": 30.0, "speed": 2450.0}, {}, None),
        ({"load": 60.0, "speed": 2450.0}, {}, "hold for 1200 to 2400 rpm"),
    ],
)
def test_diagrams_are_used_where_they_hold(
    set_: dict[str, float], axes: dict[str, list[float]], said: str | None, tmp_path: Path
) -> None:
    text = (catalogue()["si_four_87x101"]).read_text("utf-8")
    head, low, high = re.sub(r"^speeds = .*\n", "", text, flags=re.M).split("[[diagram]]\n")
    text = "[[diagram]]\n".join(
        [re.sub("^speed = .*", "speed = 2000", head, flags=re.M).replace("si_four_87x101", "mine"),
         f"speeds = [1000, 2500]\n{low}", f"speeds = [1200, 2400]\n{high}"]
    )  # fmt: skip
    (tmp_path / "mine.toml").write_text(text, "utf-8")
    scene = {"engine": str(tmp_path / "mine.toml"), "set": set_, "axes": axes,
             "output": {"quantities": ["delta"]}}  # fmt: skip
    lines = [line for line in told_of(scene) if line.startswith("diagram_speeds")]
    assert (len(lines) == 1 and said in lines[0]) if said else lines == []
    assert told_of({**scene, "output": {"quantities": ["shaking_force_max"]}}) == ()
    assert told_of({**scene, "silenced_warnings": ["diagram_speeds"]}) == ()


@pytest.mark.parametrize(
    ("given", "asked"),
    [
        ({"cylinders": 2, "bore_2": 5.6}, "is bore_2 in inches?"),
        ({"cylinders": 4, "held_power": 38.0}, "is held_power in kW?"),
        ({"cylinders": 4, "held_power": 0.0}, ""),  # Idling is no mistake
    ],
)
def test_keys_of_one_cylinder_and_powers_are_asked_about(
    given: dict[str, float], asked: str
) -> None:
    lines = plausibility_warnings(make_plan(read_scene({
        "engine": "ntua", "set": given, "output": {"quantities": ["delta"]},
    })))  # fmt: skip
    assert len(lines) == bool(asked), lines
    assert all(asked in line for line in lines)


def test_checks_of_cylinders_are_those_of_the_plain_keys() -> None:
    numbered = {key: check_of_cylinder(key) for key in OF_CYLINDER}
    plain = {check.name for check in CHECKS if check.needs == (check.name,)}
    for key, check in numbered.items():
        assert (check is not None) == (key.rpartition("_")[0] in plain), key
    assert numbered["bore_2"] is not None
