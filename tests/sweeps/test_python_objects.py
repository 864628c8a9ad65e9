"""Objects of a notebook in scenes: pandas, xarray, ranges, and quantities of pint."""

from pathlib import Path

import numpy as np
import pandas as pd
import pint
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal

import sweeps
from engine_dyn.units import BAR
from tests.support.scenes import refusal_of

UNITS = pint.UnitRegistry()
TABLES = {"engine": "ntua", "output": {"quantities": ["delta"]}}
SET = {"speed": 1500.0, "load": 90.0}
DESIGNS = pd.DataFrame({"inertia": [2.0, 3.0], "crank_ratio": [0.25, 0.3]})
WITH_UNITS = xr.DataArray([2.0, 3.0], dims="x", attrs={"units": "kg m2"})


@pytest.mark.parametrize(
    "values",
    [
        range(2, 4), pd.Series([2, 3]), pd.Series([2, 3], dtype=object), pd.Index([2.0, 3.0]),
        pd.Series([2, 3], dtype="Int64"), WITH_UNITS, np.array([2, 3], dtype=np.int16), (2, 3),
        UNITS.Quantity([2e4, 3e4], "kg cm^2"), [2 * UNITS.kg * UNITS.m**2, 3.0],
        WITH_UNITS.copy(data=UNITS.Quantity([2e3, 3e3], "g m^2")).drop_attrs(),
    ],
    ids=lambda values: type(values).__name__,
)  # fmt: skip
def test_axes_and_columns_are_objects(values: object) -> None:
    axis = sweeps.read_scene(**TABLES, set=SET, axes={"inertia": values})
    column = sweeps.read_scene(**TABLES, set=SET, designs={"inertia": values})
    assert_allclose(axis.axes["inertia"], [2.0, 3.0], rtol=1e-15)
    assert_allclose(column.designs["inertia"], [2.0, 3.0], rtol=1e-15)


def test_settings_and_ends_of_ranges_are_objects() -> None:
    ends = {"start": 2e4 * UNITS.kg * UNITS.cm**2, "stop": 3.0, "num": 2}
    scene = sweeps.read_scene(**TABLES, set=SET, axes={"inertia": ends})
    assert_allclose(scene.axes["inertia"], [2.0, 3.0], rtol=1e-15)
    drawn = {"number": 4, "seed": 1, "inertia": {"low": 2 * UNITS.kg * UNITS.m**2, "high": 3.0}}
    columns = sweeps.read_scene(**TABLES, set=SET, sample=drawn).designs
    assert len(columns["inertia"]) == 4 and columns["inertia"].min() >= 2.0
    # Settings are objects.
    given = {
        "speed": 25 * UNITS.turn / UNITS.s, "load": xr.DataArray(90), "inertia": np.float32(2),
        "bore": np.array(0.1),
    }  # fmt: skip
    settings = sweeps.read_scene(**TABLES, set=given).settings
    assert settings["speed"] == pytest.approx(1500.0, rel=1e-15)
    assert (settings["load"], settings["inertia"], settings["bore"]) == (90.0, 2.0, 0.1)
    # Revolutions are what a person means who writes 1/min; pint would take radians.
    given["speed"] = 1500 / UNITS.min
    assert sweeps.read_scene(**TABLES, set=given).settings["speed"] == 1500.0


@pytest.mark.parametrize(
    "table",
    [
        DESIGNS, DESIGNS.to_xarray(), DESIGNS.set_index("inertia"),
        DESIGNS.rename_axis(columns="parameter").to_xarray().to_dataarray("parameter"),
        DESIGNS.to_dict("list"), DESIGNS.to_dict("records"),
    ],
    ids=["DataFrame", "Dataset", "parameter as index", "DataArray", "dict", "rows"],
)  # fmt: skip
def test_designs_are_a_table(table: object) -> None:
    scene = sweeps.read_scene(**TABLES, set=SET, designs=table)
    assert set(scene.designs) == {"inertia", "crank_ratio"}
    assert_array_equal(scene.designs["crank_ratio"], [0.25, 0.3])
    assert scene.labels == {}


def test_texts_of_an_index_name_the_designs() -> None:
    scene = sweeps.read_scene(**TABLES, set=SET, designs=DESIGNS.set_axis(["light", "heavy"]))
    assert scene.labels == {"case": ("light", "heavy")}


def diagram() -> tuple[np.ndarray, np.ndarray]:
    angle = np.arange(-360.0, 360.0, 2.0)
    return angle, 1.0 + 60.0 * np.exp(-(((angle - 8.0) / 30.0) ** 2))


ANGLE, PRESSURE = diagram()
FRAME = pd.DataFrame({"crank_angle_deg": ANGLE, "pressure_bar": PRESSURE})
ARRAY = xr.DataArray(
    PRESSURE * BAR, dims="crank_angle", name="pressure", attrs={"units": "Pa"},
    coords={"crank_angle": ("crank_angle", ANGLE, {"units": "degree"})},
)  # fmt: skip


@pytest.mark.parametrize(
    "table",
    [
        FRAME, FRAME.set_index("crank_angle_deg"), pd.Series(PRESSURE, index=ANGLE),
        pd.Series(PRESSURE, index=pd.Index(ANGLE, name="crank_angle"), name="p_cyl [bar]"),
        ARRAY, ARRAY.to_dataset(), {"file": FRAME}, {"file": ARRAY, "shift": 0.0},
        FRAME.set_axis(["CA [deg]", "PCYL1 [bar]"], axis=1),
    ],
)  # fmt: skip
def test_indicator_is_a_table(table: object) -> None:
    scene = sweeps.read_scene(**TABLES, set={"speed": 1500.0}, indicator=table)
    assert scene.indicator is not None
    assert_allclose(scene.indicator(np.radians(ANGLE)), PRESSURE * BAR, rtol=1e-6, atol=1.0)
    (name,) = [name for name in scene.files if "indicator" in name]
    assert scene.source["indicator"]["file"] == name == "indicator_given_in_python.csv"


def test_indicator_is_a_pressure_that_was_read(tmp_path: Path) -> None:
    frame = pd.DataFrame({"CA [deg]": ANGLE, "p_1 [kPa]": PRESSURE * 100.0})
    frame.to_csv(tmp_path / "run.csv", index=False)
    recorded = sweeps.read_pressure(tmp_path / "run.csv", engine="ntua")
    scene = sweeps.read_scene(**TABLES, set={"speed": 1500.0}, indicator=recorded)
    assert scene.indicator is not None
    assert_allclose(scene.indicator(np.radians(ANGLE)), PRESSURE * BAR, rtol=1e-4)
    assert any("kPa" in note for note in scene.indicator_notes)


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"axes": {"inertia": pd.date_range("2020", periods=2)}}, "[axes] inertia: holds datetime"),
        ({"axes": {"inertia": DESIGNS}}, "[axes] inertia: a table of several columns"),
        ({"axes": DESIGNS}, "[axes]: is a DataFrame, which is only allowed as [designs]"),
        ({"axes": {"inertia": np.ones((2, 2))}}, "[axes] inertia: has 2 x 2 values"),
        ({"axes": {"inertia": WITH_UNITS.assign_attrs(units="g m2")}}, "[axes]: inertia: units"),
        ({"axes": {"inertia": [2 * UNITS.kg]}}, "[axes] inertia, value 1: is in kilogram; must be"),
        (
            {"axes": {"inertia": {"start": 2 * UNITS.m, "stop": 3.0, "num": 2}}},
            "[axes] inertia start: is in meter; must be in kg m2",
        ),
        ({"set": {"speed": 3 * UNITS.kg}}, "[set] speed: is in kilogram; must be in rpm"),
        ({"set": {"speed": pd.Series([1.0])}}, "[set] speed = [1.0]: must be a finite number"),
        ({"designs": DESIGNS.assign(inertia=[2.0, np.nan])}, "[designs] inertia, value 2 = nan"),
        ({"designs": DESIGNS.rename(columns={"inertia": 3})}, "[designs]: column 3: must be the"),
        ({"designs": pd.concat([DESIGNS, DESIGNS], axis=1)}, "[designs] inertia: two columns"),
        ({"designs": DESIGNS.to_xarray().expand_dims(x=2)}, "[designs]: a Dataset over"),
        ({"indicator": FRAME.astype(str)}, "[indicator] column 'crank_angle_deg': must be numbers"),
        ({"indicator": pd.DataFrame()}, "[indicator]: is empty; must have"),
        (
            {"indicator": pd.Series(PRESSURE)},
            "[indicator] indicator_given_in_python.csv: angle_column: cannot be determined from "
            "the columns",
        ),
        (
            {"indicator": ARRAY.drop_vars("crank_angle")},
            "[indicator] indicator_given_in_python.csv",
        ),
        ({"indicator": ARRAY.expand_dims(x=2)}, "[indicator]: over crank_angle, x; must be over"),
    ],
)
def test_wrong_objects_name_the_key(tables: dict[str, object], said: str) -> None:
    assert (
        refusal_of(lambda: sweeps.read_scene(**{**TABLES, "set": SET, **tables}))
        .removeprefix("scene: ")
        .startswith(said)
    )
