"""Scenes: what is read from them, and that nothing but a SceneError ever comes of reading."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from engine_dyn.geometry.arrangement import MOST_CYLINDERS
from engine_dyn.loads.laws import MOTOR_KEYS
from engine_dyn.quantities.each_cylinder import OF_CYLINDER
from engine_dyn.quantities.graph import PARAMETERS, QUANTITIES
from engine_dyn.quantities.parameters import CYCLE_KEYS, SOLVER_COLUMNS, STROKE_SHARES
from engine_dyn.quantities.shaft_numbers import OF_SHAFT
from engine_dyn.speed.fields import METHOD_NAMES
from sweeps.base.checks import outside
from sweeps.base.errors import SceneError
from sweeps.scene.model import Scene
from sweeps.scene.reading import built_in_scenes, read_scene
from sweeps.scene.toml_tables import FAILURES
from sweeps.scene.variants import OF_EXTREMES
from tests.support.scenes import (
    GENERATING_SET,
    IN_PASSING,
    NOT_OF_AN_ENGINE,
    OF_TRANSIENTS,
    refusal,
)
from tests.support.shafts import passing_shaft, shaft_with


def scene(**tables: Any) -> dict[str, Any]:
    return {"engine": "ntua", "output": {"quantities": ["delta"]}, **tables}


def read(text: str, folder: Path) -> Scene:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return read_scene(path)


HEAD = 'engine = "ntua"\n'
OUTPUT = '[output]\nquantities = ["delta"]\n'


def test_smallest_scene_is_one_design_with_the_defaults_of_the_contract() -> None:
    read = read_scene(scene())
    assert (read.dimensions, read.axes, read.designs, read.settings) == ((), {}, {}, {})
    assert (read.methods, read.inertia_models) == (("auto",), ("constant",))
    assert (read.closure, read.tolerance, read.angle_step) == ("power_mean", 1e-6, 1.0)
    assert (read.passes, read.start_speed, read.start_angle) == (None, None, None)
    assert (read.quantities, read.fail_on) == (("delta",), ())
    assert (read.indicator, read.reference, read.path) == (None, None, None)
    assert read.engine.name == "ntua" and read.engine.title in read.title
    assert read_scene(scene(title="two\nlines")).title == "two lines"
    assert read_scene(read) is read
    for step in (1, 0.1, 0.25, 0.5, 2, 7.2, 90, 720 / 7000):  # which divide the cycle
        output = {"quantities": ["omega"], "angle_step": step, "fail_on": list(FAILURES)}
        read = read_scene(scene(output=output, solver={"method": list(METHOD_NAMES)}))
        assert (read.angle_step, read.fail_on) == (step, FAILURES)
        assert read.axes["method"] == METHOD_NAMES


def test_ranges_are_linear_or_logarithmic_and_keep_their_ends() -> None:
    axes = {
        "inertia": {"start": 0.5, "stop": 12.0, "num": 24, "spacing": "log"},
        "speed": {"start": 2000, "stop": 1000, "num": 5},
        "load": {"start": 0, "stop": 90, "num": 3, "spacing": "linear"},
    }
    read = read_scene(scene(axes=axes))
    inertia = np.asarray(read.axes["inertia"])
    assert (inertia[0], inertia[-1], len(inertia)) == (0.5, 12.0, 24)
    assert_allclose(inertia[1:] / inertia[:-1], (12.0 / 0.5) ** (1.0 / 23.0), rtol=1e-12)
    assert_array_equal(read.axes["speed"], [2000, 1750, 1500, 1250, 1000])
    assert_array_equal(read.axes["load"], [0, 45, 90])


def test_python_values_read_like_those_of_a_file(tmp_path: Path) -> None:
    text = HEAD + "[set]\nload = 50\n[axes]\ninertia = [1, 2.5]\ncylinders = [1, 4]\n" + OUTPUT
    from_file = read(text, tmp_path)
    for inertia, load in [
        (np.array([1.0, 2.5]), np.int32(50)),
        ((1, 2.5), 50.0),
        ([np.float32(1), np.float64(2.5)], np.float32(50)),
    ]:
        axes = {"inertia": inertia, "cylinders": np.array([1, 4])}
        from_dict = read_scene(scene(set={"load": load}, axes=axes))
        for key, values in from_file.axes.items():
            assert_array_equal(from_dict.axes[key], values)
        assert from_dict.settings == from_file.settings
        json.dumps(from_dict.source)


@pytest.mark.parametrize("name", built_in_scenes())
def test_source_says_the_scene_again(name: str) -> None:
    once = read_scene(name)
    assert once.title and once.path is not None and once.path.stem == name
    raw = json.loads(json.dumps(once.source))
    raw.pop("reference", None)  # its path is relative to the scene's file
    again = read_scene(raw)
    assert again.dimensions == once.dimensions
    assert again.quantities == once.quantities
    for key, values in {**once.axes, **once.designs}.items():
        assert_array_equal({**again.axes, **again.designs}[key], values)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_table_of_designs(tmp_path: Path, mark: str, end: str) -> None:
    lines = ["# source", "case, inertia ,speed", "", "a,1.5,1e3", '"b, c", 2 ,1100']
    data = mark + end.join(lines) + end
    tmp_path.joinpath("table.csv").write_bytes(data.encode())
    result = read(HEAD + '[designs]\nfile = "table.csv"\n' + OUTPUT, tmp_path)
    assert result.labels == {"case": ("a", "b, c")}
    assert_array_equal(result.designs["inertia"], [1.5, 2.0])
    assert_array_equal(result.designs["speed"], [1000.0, 1100.0])


TRIANGLE = [(angle, 30.0 - abs(angle) / 12.5) for angle in range(-360, 360, 5)]


@pytest.mark.slow
def test_every_parameter_may_be_set_and_every_quantity_asked_for(tmp_path: Path) -> None:
    engine = read_scene(scene()).engine
    for key, node in PARAMETERS.items():
        value = engine.values.get(key, 0.01 if key.endswith("_offset") else max(1.0, node.low))
        if outside(np.array([value]), node).any() and np.isfinite(node.high):
            value = 0.5 * (node.low + node.high)
        if key == "flywheel_density":
            value = 7850.0
        if key in SOLVER_COLUMNS:
            raw = scene(solver={"method": "thesis", key: value})
        elif key == "rod_length":
            raw = scene(set={key: 0.35})
        elif key in CYCLE_KEYS:
            raw = scene(engine="si_four_87x101", set={key: 5.0})
        elif key in MOTOR_KEYS:  # one alone is no motor
            other = "motor_synchronous_speed" if key == "motor_slip" else "motor_slip"
            raw = scene(set={k: 0.5 for k in MOTOR_KEYS if k != other})
        elif key in STROKE_SHARES:
            raw = scene(set={key: 0.5, "ring_pressure": 1.0})
        elif key in OF_CYLINDER:
            raw = scene(set={key: value, "cylinders": MOST_CYLINDERS})
        elif key in OF_SHAFT or key.startswith("load_damping"):
            more = {key.replace("tensile_strength", "shape_factor"): 1.0}  # which the limit needs
            more = more if "tensile_strength" in key else {}
            if key.startswith("shaft_friction"):  # Dry friction has both
                more = {
                    key.replace("torque", "stiffness"): 1.0,
                    key.replace("stiffness", "torque"): 1.0,
                }
            raw = scene(set={key: value, **more}, shaft=shaft_with(key))
        elif key in ("passing_start", "passing_end", "speed_ramp"):
            raw = scene(set={key: value}, shaft=passing_shaft(1))
        elif key in OF_EXTREMES:  # of an engine whose torque is given
            (tmp_path / "torque.toml").write_text(
                "[values]\ninertia = 1\nload_exponent = 1\nload_offset = 0\n[[diagram]]\n"
                'kind = "torque"\nmean = 9\nharmonics = []'
            )
            raw = scene(engine=str(tmp_path / "torque.toml"), set={key: value})
        elif key == "recorded_cycle":
            (tmp_path / "run.csv").write_text(
                "crank_angle_deg,pressure_bar,cycle_1_bar\n"
                + "".join(f"{angle},{p},{p}\n" for angle, p in TRIANGLE)
            )
            raw = scene(indicator={"file": str(tmp_path / "run.csv")}, set={key: value})
        else:
            raw = scene(set={key: value})
        read_scene(raw)
        if node.whole:
            with pytest.raises(SceneError, match=r"whole|even|one of"):
                read_scene(scene(designs={key: [1.5]}))
    for quantity in QUANTITIES:
        given = {**NOT_OF_AN_ENGINE, "shaft": passing_shaft(1)} if quantity in IN_PASSING else {}
        given = given or (GENERATING_SET if quantity in OF_TRANSIENTS else NOT_OF_AN_ENGINE)
        read_scene(scene(output={"quantities": [quantity]}, **given))


TWO = '[designs]\ncase = ["a", "b"]\ninertia = [1, 2]\n'
THREE_AXES = (
    "[axes]\nload = [0, 50]\ninertia = {start = 1, stop = 2, num = 4}\nspeed = [1000, 1100]\n"
)
NAN = math.nan


@pytest.mark.parametrize(
    ("body", "table", "dimensions", "columns"),
    [
        (TWO, "# Author 1999\ncase,inertia,speed,delta,omega_max\na,1,1200,0.1,\nb,2,1200,,130\n",
         ("design",), {"delta": [0.1, NAN], "omega_max": [NAN, 130.0]}),
        (THREE_AXES, "speed,inertia,delta\n1100,1.3333333,3\n1000,2,4\n", ("inertia", "speed"),
         {"delta": [[NAN, NAN], [NAN, 3.0], [NAN, NAN], [4.0, NAN]]}),
        (TWO + "[axes]\nspeed = [1000, 1100]\n", "case,speed,delta\nb,1000,1\na,1100,2\n",
         ("design", "speed"), {"delta": [[NAN, 2.0], [1.0, NAN]]}),
        (TWO + "[axes]\nspeed = [1000, 1100]\n", "speed,delta\n1100,2\n", ("speed",),
         {"delta": [NAN, 2.0]}),
        ('[solver]\nmethod = ["newton", "thesis"]\n', "method,delta\nthesis,2\n", ("method",),
         {"delta": [NAN, 2.0]}),
        ("", "delta\n0.1\n", (), {"delta": 0.1}),
    ],
    ids=["designs", "axes", "axis and label", "axis beside designs", "words", "a single design"],
)  # fmt: skip
def test_published_values_stand_where_their_columns_say(
    body: str, table: str, dimensions: tuple[str, ...], columns: dict[str, Any], tmp_path: Path
) -> None:
    tmp_path.joinpath("published.csv").write_text(table)
    text = HEAD + body + '[reference]\nfile = "published.csv"\n' + OUTPUT
    reference = read(text, tmp_path).reference
    assert reference is not None
    assert reference.dimensions == dimensions
    assert set(reference.columns) == set(columns)
    for name, values in columns.items():
        assert_array_equal(reference.columns[name], values)


def test_the_thesis_has_both_tables_with_every_printed_row() -> None:
    read = read_scene("thesis")
    reference = read.reference
    assert reference is not None
    assert reference.dimensions == ("design",)
    assert len(read.labels["case"]) == 22
    assert read.settings == {"crankcase_pressure": 0.0}
    columns = reference.columns
    # (3.6) from the printed omegas; the printed deltas are cut.
    swing = (columns["omega_max"] - columns["omega_min"]) / columns["omega_mean"]
    assert_allclose(columns["delta"], swing, atol=6e-6)
    for quantity in ("delta", "omega_max", "omega_min", "omega_mean"):
        assert np.isfinite(columns[quantity]).all()
    assert np.isfinite(columns["torque_ratio"]).sum() == 5
    assert np.isfinite(columns["torque_range"]).sum() == 5
    assert np.isfinite(columns["friction_torque"]).sum() == 3
    single = read.designs["cylinders"] == 1
    assert single.sum() == 16
    assert set(read.designs["passes"][single]) == {1.0}
    assert set(read.designs["start_angle"][single]) == {-180.0}
    assert set(read.designs["start_angle"][~single]) == {0.0}
    # omega_n is cut to 0.1 rad/s.
    nominal = read.designs["speed"][single] * math.pi / 30.0
    assert (np.abs(read.designs["start_speed"][single] - nominal) < 0.1).all()


scene_words = [key for name in built_in_scenes() for key in read_scene(name).source]
more_words = ["case", "file", "start", "stop", "num", "spacing", "log", "method", "tolerance"]
words = st.sampled_from([*PARAMETERS, *QUANTITIES, *METHOD_NAMES, *scene_words, *more_words, ""])
leaves = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8), words,
    st.binary(max_size=4),
)  # fmt: skip
values = st.recursive(
    leaves,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(words | st.text(max_size=5), inner, max_size=4)
    ),
    max_leaves=12,
)
parameters = st.dictionaries(words | st.text(max_size=5), values, max_size=4)
scenes = st.fixed_dictionaries(
    {},
    optional={
        "title": values, "engine": st.just("ntua") | values, "surprise": values,
        **{table: parameters | values for table in ("set", "axes", "designs", "indicator",
                                                    "solver", "reference")},
        "output": st.just({"quantities": ["delta"]}) | parameters | values,
    },
)  # fmt: skip

quick = settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.too_slow])


def reads_or_refuses(raw: Any) -> None:
    try:
        result = read_scene(raw)
    except SceneError as error:
        assert "\n" not in str(error)
        assert str(error)
    else:
        assert isinstance(result, Scene)
        json.dumps(result.source, allow_nan=False)


@pytest.mark.slow
@settings(quick, max_examples=600)
@given(scenes | values)
def test_anything_is_read_or_refused(raw: Any) -> None:
    reads_or_refuses(raw)


@quick
@given(st.sampled_from(list(PARAMETERS)), values)
def test_any_value_of_any_key_is_read_or_refused(key: str, value: Any) -> None:
    for table in ("set", "axes", "designs", "solver"):
        reads_or_refuses(scene(**{table: {key: value}}))


@settings(quick, suppress_health_check=list(HealthCheck))
@given(st.text(max_size=60))
def test_any_text_is_read_or_refused(tmp_path: Path, text: str) -> None:
    for name, content in [
        ("scene.toml", text),
        ("pressure.csv", "crank_angle_deg,pressure_bar\n" + text),
    ]:
        tmp_path.joinpath(name).write_bytes(content.encode("utf-8", "surrogatepass"))
    reads_or_refuses(str(tmp_path / "scene.toml"))
    path = tmp_path / "with.toml"
    path.write_text(HEAD + '[indicator]\nfile = "pressure.csv"\n' + OUTPUT)
    reads_or_refuses(path)


@pytest.mark.parametrize(
    ("engine", "order", "lowest"),
    [("ntua", 2.3, "0.5"), ("ntua", 2.25, "0.5"), ("marine_80x345", 2.5, "1")],
)
def test_the_highest_order_is_one_of_the_cycle(engine: str, order: float, lowest: str) -> None:
    raw = scene(engine=engine, output={"quantities": ["delta"], "highest_order": order})
    wanted = f"highest_order = {order}: must be a multiple of {lowest}, the lowest order"
    assert wanted in refusal(raw)
    raw["output"]["highest_order"] = round(order)
    assert read_scene(raw).highest_order == round(order)
