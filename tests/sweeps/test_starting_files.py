"""Files to start from and what describes files: new, schema --engine, info of scenes."""

import inspect
import json
import re
import tomllib
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sweeps
from engine_dyn.pressure.double_acting import OF_EFFECTIVE_PRESSURE
from engine_dyn.pressure.file_fields import MEANINGS
from sweeps.base.errors import SceneError
from sweeps.scene.engine.engine_files import catalogue, load_engine
from sweeps.scene.engine.modelled_diagrams import KINDS
from sweeps.scene.json_schema import engine_schema
from sweeps.scene.reading import read_scene
from tests.support.commands import invoke, ok, refused
from tests.support.engine_files import indicator_text, points
from tests.support.json_schemas import fits

SCHEMA = engine_schema()


BOXER = """
title = "Boxer four"
cycle = "four-stroke"
arrangement = "boxer 4"

[values]
bore = 0.080
stroke = 0.070
cylinders = 4
rod_length = 0.130
reciprocating_mass = 0.6
speed = 3000
cylinder_spacing = 0.040
crank_mass = 0.0
rod_mass = 0.4
rod_centre_of_gravity = 0.035
"""


def in_schema(raw: Any) -> bool:
    return fits(raw, SCHEMA, SCHEMA["$defs"])


def uncommented(text: str, *ways: int) -> str:
    """The template with its optional values and only these ways to a diagram."""
    head, *sections = re.split(r"(?m)^# --- ", text)
    kept = [head, *(s for i, s in enumerate(sections, start=1) if i in ways)]
    body = "".join(f"# {s}" if i else s for i, s in enumerate(kept))
    plain = re.sub(r"(?m)^# (?=(\w+ = |\[))", "", body)
    return re.sub(r"(?m)^(arrangement|firing_order) = .*$", "", plain)


def test_new_engine_is_a_data_sheet(tmp_path: Path) -> None:
    text = ok("new", "--engine")
    path = tmp_path / "mine.toml"
    assert "calibrate" in ok("new", "--engine", path)
    assert path.read_text("utf-8") == text
    assert in_schema(tomllib.loads(text))
    assert "exists" in refused("new", "--engine", path)
    with pytest.raises(
        SceneError, match=r"'delta' needs \[\[diagram\]\], .*`engine-dyn calibrate`"
    ):
        read_scene({"engine": str(path), "output": {"quantities": ["delta"]}})
    assert "diagram: missing" in refused("new", "--for", path)
    assert sweeps.calibrate(path).rated.power == pytest.approx(30.0, rel=1e-5)


def test_an_engine_without_a_diagram_gets_a_scene_of_its_balance(tmp_path: Path) -> None:
    engine = tmp_path / "boxer.toml"
    engine.write_text(BOXER)
    ok("new", "--for", engine, tmp_path / "balance.toml")
    ok("run", tmp_path / "balance.toml", "-o", tmp_path / "balance.nc")
    with sweeps.open(tmp_path / "balance.nc") as archive:
        assert (archive.shaking_moment_max.values > 0.0).all()
    ranked = sweeps.firing_orders(engine)
    assert "shaking_moment_max" in ranked and "torque_after_throw_range" not in ranked
    assert "shaking_moment_rms" in sweeps.firing_orders(engine, by="shaking_moment_rms")


@pytest.mark.parametrize("way", [2, 3], ids=["measured", "modelled"])
def test_other_ways_of_the_template_are_engines(way: int, tmp_path: Path) -> None:
    text = uncommented(ok("new", "--engine"), way, 4)
    (tmp_path / "pressure.csv").write_text(indicator_text(points()))
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    raw = tomllib.loads(text)
    assert "data_sheet" not in raw and len(raw["diagram"]) == 1
    assert in_schema(raw)
    engine = load_engine(path)
    assert engine.values["inertia"] == 0.25 and engine.sources
    assert read_scene({"engine": str(path), "output": {"quantities": ["delta"]}}).engine.values


@pytest.mark.parametrize("name", catalogue())
def test_a_scene_about_an_engine_reads(name: str, tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    ok("new", path, "--for", name)
    scene = read_scene(path)
    assert scene.engine.name == name
    (key,) = set(scene.axes) - {"load"}
    assert key == ("inertia" if name != "compressor_79x83" else "flywheel_inertia")
    assert scene.axes[key][8] == pytest.approx(scene.engine.values[key], rel=5e-3)
    assert scene.settings["speed"] == scene.engine.values["speed"]


@pytest.mark.parametrize(
    ("column", "last", "given"),
    [
        ("load_angle_deg", 360, {"load_exponent", "load_offset"}),
        ("speed_rpm", 2400, {"load_offset"}),
    ],
)
def test_usual_values_of_a_load_have_an_effect(
    column: str, last: int, given: set[str], tmp_path: Path
) -> None:
    text = re.sub(r"(?m)^load_(exponent|offset) = .*$", "", catalogue()["ntua"].read_text("utf-8"))
    (tmp_path / "engine.toml").write_text('load_table = "load.csv"\n' + text, "utf-8")
    rows = [f"{last * place // 8},{place % 8}" for place in range(9)]
    (tmp_path / "load.csv").write_text("\n".join([f"{column},torque_Nm", *rows, ""]))
    ok("new", tmp_path / "study.toml", "--for", tmp_path / "engine.toml")
    settings = read_scene(tmp_path / "study.toml").settings
    assert {key for key in settings if key.startswith("load_")} == given
    assert "no requested quantity depends on it" not in ok("plan", tmp_path / "study.toml")


@pytest.mark.parametrize("size", [0.5, 1.0, 2.0])
def test_an_inertia_that_the_file_lacks_is_usual_for_its_size(size: float, tmp_path: Path) -> None:
    text = catalogue()["ntua"].read_text("utf-8")
    for key, value in (("bore", 0.14), ("stroke", 0.18)):
        text = re.sub(rf"(?m)^{key} = .*$", f"{key} = {size * value}", text)
    (tmp_path / "engine.toml").write_text(re.sub(r"(?m)^inertia = .*$", "", text), "utf-8")
    ok("new", tmp_path / "study.toml", "--for", tmp_path / "engine.toml")
    inertia = read_scene(tmp_path / "study.toml").axes["inertia"]
    volume = np.pi / 4.0 * (size * 0.14) ** 2 * size * 0.18
    assert (inertia > 300.0 * volume ** (5 / 3)).all() and (inertia < 1e6 * volume ** (5 / 3)).all()
    told = invoke("plan", tmp_path / "study.toml")
    assert told.exit_code == 0
    assert "moment of inertia over" not in told.output


@pytest.mark.parametrize("over", [310.0, 590.0, 3e5, 0.99e6])
def test_an_unusual_inertia_is_not_reached_from_the_own_one(over: float, tmp_path: Path) -> None:
    volume = np.pi / 4.0 * 0.14**2 * 0.18
    own = float(f"{over * volume ** (5 / 3):.6g}")
    text = re.sub(r"(?m)^inertia = .*$", f"inertia = {own}", catalogue()["ntua"].read_text("utf-8"))
    (tmp_path / "engine.toml").write_text(text, "utf-8")
    ok("new", tmp_path / "study.toml", "--for", tmp_path / "engine.toml")
    inertia = read_scene(tmp_path / "study.toml").axes["inertia"]
    assert np.min(np.abs(inertia / own - 1.0)) < 5e-3  # The own one is a point of the axis
    assert inertia[0] >= 0.499 * own and inertia[-1] <= 4.01 * own
    told = invoke("plan", tmp_path / "study.toml")
    assert told.exit_code == 0 and "moment of inertia over" not in told.output
    loads = 2  # Those of the engine's diagrams above 0
    assert f"here {loads} x {inertia.size} designs" in (tmp_path / "study.toml").read_text("utf-8")


@pytest.mark.parametrize("kind", KINDS)
def test_what_the_reader_refuses_does_not_fit(kind: str) -> None:
    """Each number of a modelled cycle: its ends, beyond them, a text, an unknown key."""
    table = SCHEMA["$defs"]["".join(w.capitalize() for w in kind.split("_")) + "Diagram"]
    for key, field in KINDS[kind].fields.items():
        if key == "speed":
            continue  # the diagram's own, a parameter
        number = table["properties"][key]
        assert f"[{field.unit}]" in number["description"]
        for end, beyond in ((field.low, -1.0), (field.high, 1.0)):
            assert fits(end, number, SCHEMA["$defs"]) == field.ends
            assert not fits(end + beyond, number, SCHEMA["$defs"])
        assert not fits("1", number, SCHEMA["$defs"])
    needed = {"load": 100, "kind": kind}
    needed |= {k: 0.5 * (f.low + f.high) for k, f in KINDS[kind].fields.items() if k != "speed"}
    assert fits(needed, table, SCHEMA["$defs"])
    assert not fits({**needed, "haet": 1}, table, SCHEMA["$defs"])
    first = table["required"][2]
    assert not fits({k: v for k, v in needed.items() if k != first}, table, SCHEMA["$defs"])


def test_a_file_needs_neither_diagrams_nor_a_data_sheet() -> None:
    assert json.loads(ok("schema", "--engine")) == SCHEMA
    assert "axes" not in SCHEMA["properties"]
    for path in catalogue().values():
        assert in_schema(tomllib.loads(path.read_text("utf-8"))), path
    raw = tomllib.loads(catalogue()["ntua"].read_text("utf-8"))
    without = {k: v for k, v in raw.items() if k != "diagram"}
    sheet = {**without, "data_sheet": {"power": 10}}
    assert in_schema(without) and in_schema(sheet)
    for wrong in (
        {**sheet, "data_sheet": {"powr": 10}}, {**sheet, "data_sheet": {"cycle": {"heat": 10}}},
        {**raw, "values": {**raw["values"], "compression_ratio": 10}}, {**raw, "engine": "ntua"},
    ):  # fmt: skip
        assert not in_schema(wrong)


@pytest.mark.parametrize("kind", KINDS)
def test_a_class_says_the_units_of_files(kind: str) -> None:
    documentation = inspect.getdoc(KINDS[kind].cycle) or ""
    assert f'kind = "{kind}"' in documentation
    names = {item.name for item in fields(KINDS[kind].cycle)} - {"wall"}
    if kind == "double_acting_compressor":  # these are of the engine
        names -= set(OF_EFFECTIVE_PRESSURE)
    assert set(KINDS[kind].fields) == names
    for name, field in KINDS[kind].fields.items():
        assert f"{name} [{field.unit}]: {field.low:.6g} to {field.high:.6g}, " in documentation
        assert MEANINGS[name]
