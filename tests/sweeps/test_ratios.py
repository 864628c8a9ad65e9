"""Fractions such as 1/200 where a ratio is wanted, and numbers with units."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sweeps.base.errors import SceneError
from sweeps.base.files.numbers_with_units import factor_between, number_with_unit
from sweeps.base.ratios import number_or_ratio
from sweeps.scene.reading import read_scene
from tests.support.scenes import refusal


def scene(**tables):
    return {"engine": "ntua", "output": {"quantities": ["inertia_required"]}, **tables}


@pytest.mark.parametrize("text", ["1/0", "1/", "/200", "1/2/3", "x", "", "1_0/2", "1e308/1e-308"])
def test_refused(text):
    with pytest.raises(ValueError):
        number_or_ratio(text)


def test_scene_reads_them_everywhere():
    assert read_scene(scene(set={"wanted_delta": "1/200"})).settings["wanted_delta"] == 1 / 200
    axis = read_scene(scene(axes={"wanted_delta": ["1/100", 0.005, "pump"]})).axes["wanted_delta"]
    assert_array_equal(axis, [1 / 100, 0.005, 1 / 30])
    ends = {"start": "1/300", "stop": "1/100", "num": 3}
    axis = read_scene(scene(axes={"wanted_delta": ends})).axes["wanted_delta"]
    assert_allclose(axis, np.linspace(1 / 300, 1 / 100, 3), rtol=1e-15)
    column = read_scene(scene(designs={"wanted_delta": ["1/100", 0.005]})).designs["wanted_delta"]
    assert_array_equal(column, [1 / 100, 0.005])


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"set": {"wanted_delta": "1/0"}}, "wanted_delta = '1/0': must be a finite number"),
        ({"set": {"wanted_delta": "5/2"}}, "wanted_delta = 2.5: must be a finite number above 0"),
        ({"set": {"speed": "3000/2"}}, "speed = '3000/2': must be a finite number in rpm without"),
        ({"set": {"cylinders": "8/2"}}, "cylinders = '8/2': must be a finite number without"),
        ({"axes": {"speed": {"start": "1/2", "stop": 2.0, "num": 2}}}, "must be a finite number"),
    ],
)
def test_only_ratios(tables, words):
    assert words in refusal(scene(**tables))


@pytest.mark.parametrize(
    ("raw", "unit", "value"),
    [
        (36.4, "kW", 36.4), ("36.4", "kW", 36.4), (" 36.4kW ", "kW", 36.4),
        ("3.64e4 W", "kW", 36.4), ("50 hp", "kW", 50 * 0.745699872),
        ("50 PS", "kW", 50 * 0.73549875), ("2700rpm", "rpm", 2700.0), ("2700/min", "rpm", 2700.0),
        ("2700 1/min", "rpm", 2700.0), ("2700 min-1", "rpm", 2700.0), ("45 Hz", "rpm", 2700.0),
        ("45/s", "rpm", 2700.0), ("45 rev/s", "rpm", 2700.0), ("282.7433388 rad/s", "rpm", 2700.0),
        ("7.5 MPa", "bar", 75.0), ("1087.78 psi", "bar", 75.0), ("76.48 kgf/cm2", "bar", 75.0),
        ("245 g/kWh", "g/kWh", 245.0), ("245 g/kW/h", "g/kWh", 245.0),
        ("0.403 lb/hp/h", "g/kWh", 245.0),
    ],
)  # fmt: skip
def test_is_understood(raw: Any, unit: str, value: float) -> None:
    assert number_with_unit(raw, "--x", unit) == pytest.approx(value, rel=1e-3)


@pytest.mark.parametrize(
    ("given", "wanted", "factor"),
    [
        ("1/min", "rpm", 1.0), ("Hz", "rpm", 60.0), ("rad s-1", "1/min", 30.0 / math.pi),
        ("rad s-1", "Hz", 0.5 / math.pi), ("1/min", "rad s-1", None), ("rpm", "Hz", None),
        ("rad s-1", "1/m", None), ("rad2 s-1", "rpm", None),
    ],
)  # fmt: skip
def test_what_has_no_angle_counts_turns_beside_a_speed(
    given: str, wanted: str, factor: float | None
) -> None:
    assert factor_between(given, wanted) == (factor and pytest.approx(factor, rel=1e-14))


@pytest.mark.parametrize(
    "raw",
    [
        "", "kW", "36,4 kW", "36.4 kg", "nan", "inf kW", "1e999 kW", math.nan, math.inf, True, None,
        [36.4], "9**9**9 W", "36.4 kW; import os", "36.4 __import__('os')", "٣٦ kW", "36.4 kW" * 99,
        "36.4 " + "k" * 10**6, "1" * 10**6, "36.4 W**9**9", "20 degC",
    ],
)  # fmt: skip
def test_is_refused_in_one_line(raw: Any) -> None:
    with pytest.raises(SceneError, match=r"--x = .*: must be a number in kW") as error:
        number_with_unit(raw, "--x", "kW")
    assert len(str(error.value)) < 300
