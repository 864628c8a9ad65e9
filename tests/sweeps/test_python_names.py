"""What a person finds in `sweeps`, scenes by keywords, and objects of notebooks in them."""

import importlib
import inspect
import pydoc
from importlib.metadata import version

import numpy as np
import pandas as pd
import pint
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal

import sweeps
from engine_dyn.units import BAR
from sweeps.scene.keywords import OPTIONS, Tables, TablesButOutput
from sweeps.scene.toml_tables import SceneFile
from tests.support.scenes import refusal_of


def test_names_help_and_wrong_names() -> None:
    names = dir(sweeps)
    assert {"run", "open", "plan", "best", "Scene", "SceneError", "__version__"} <= set(names)
    assert not [name for name in names if not getattr(sweeps, name).__doc__]
    assert sweeps.__version__ == version("engine-dyn")
    text = pydoc.plain(pydoc.render_doc(sweeps))
    assert "run(" in text and "stream(" in text and "class Plan" in text
    assert f"VERSION\n    {sweeps.__version__}" in text
    with pytest.raises(
        AttributeError, match=r"'sweeps' has no attribute 'rum'; did you mean 'run'"
    ):
        sweeps.rum  # noqa: B018
    assert not hasattr(sweeps, "_ipython_display_")


def test_keywords_are_the_tables_of_a_scene() -> None:
    named = {*Tables.__annotations__, *TablesButOutput.__annotations__}
    assert named == set(SceneFile.model_fields)
    of_scenes = [
        sweeps.run, sweeps.plan, sweeps.read_scene, sweeps.stream, sweeps.measured, sweeps.identify,
        sweeps.follow_cycles, sweeps.cylinder_deviations, sweeps.optimise,
    ]  # fmt: skip
    options: set[str] = set()
    for function in of_scenes:
        parameters = set(inspect.signature(function).parameters)
        assert named < parameters, "help and completion have all tables"
        options |= parameters - named - {"scene"}
    assert set(OPTIONS) == options
    for name in sweeps.__all__:
        asked = getattr(getattr(sweeps, name), "__annotations__", {})
        assert ("scene" not in asked) or getattr(sweeps, name) in (*of_scenes, sweeps.Plan), name


def results() -> xr.Dataset:
    """A dataset that no kernel computed."""
    return xr.Dataset(
        {"delta": ("inertia", np.array([0.04, 0.02]))}, coords={"inertia": np.array([2.0, 4.0])}
    )


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: sweeps.run(), "scene = None: must be the path of a scene"),
        (lambda: sweeps.run("first", axis={}), "axis: unknown keyword; did you mean 'axes'"),
        (lambda: sweeps.run("first", thread=2), "thread: unknown keyword; did you mean 'threads'"),
        (lambda: sweeps.plan(sweeps.read_scene("first"), axes={}),
         "axes: a Scene cannot be changed"),
        (lambda: sweeps.measured(engine="ntua", output={"quantities": ["delta"]}),
         "scene: [measured]"),
        (lambda: sweeps.identify("first", vry=["inertia"]),
         "vry: unknown keyword; did you mean 'v"),
        (lambda: sweeps.stream("first"), "output is missing: must be the path"),
        (lambda: sweeps.stream("first", 3), "output = 3: must be the path"),
        (lambda: sweeps.stream("first", "a.nc", archive="b.nc"), "output = 'a.nc': must be the"),
        (lambda: sweeps.stream(output={}, engine="ntua"), "archive is missing"),
        (lambda: sweeps.open(3), "path = 3: must be the path of an archive or a list of them"),
        (lambda: sweeps.open([3]), "path = 3: must be the path of a file"),
        (lambda: sweeps.open_archive(3), "path = 3: must be the path of a file"),
        (lambda: sweeps.read_pressure(3), "path = 3: must be the path of a file"),
        (lambda: sweeps.calibrate(3), "engine = 3: must be the path of a file"),
        (lambda: sweeps.export(results(), 3), "path = 3: must be the path of a file"),
        (lambda: sweeps.export("a.nc", "a.csv"),
         "archive = 'a.nc': must be a dataset, as sweeps.r"),
        (lambda: sweeps.export(results(), "a.csv", quantities=3),
         "quantities = 3: must be a string"),
        (lambda: sweeps.best("a.nc", least="inertia"), "archive = 'a.nc': must be a dataset, as"),
        (lambda: sweeps.best(results(), least="inertia", within=3),
         "within = 3: must be a string or"),
        (lambda: sweeps.best(results(), least=3), "'3': not in the archive. Allowed: delta"),
        (lambda: sweeps.best(results(), least="delta", at_every=3),
         "at_every = 3: must be a string"),
        (lambda: sweeps.pareto(3, "inertia", "delta"), "archive = 3: must be a dataset"),
        (lambda: sweeps.nearest(3, inertia=2), "archive = 3: must be a dataset"),
        (lambda: sweeps.run("first", threads="x"), "threads = 'x': must be a whole number"),
        (lambda: sweeps.stream("first", "a.nc", threads=0), "threads = 0: must be a whole number"),
        (lambda: sweeps.run(results()), "scene: is a dataset; must be a path, a name"),
        (lambda: results().dyn.table(limit="x"), "limit = 'x': must be a whole number"),
        (lambda: results().dyn.table(select=3), "select = 3: must be values of axes"),
        (lambda: results().dyn.plot.numbers(select=3), "select 3: must be values of axes"),
        (lambda: results().dyn.plot.numbers(quantities="dleta"), "quantities 'dleta': the archive"),
        (lambda: results().dyn.plot.numbers(target=3), "target '3': must be QUANTITY=VALUE or"),
        (lambda: results().dyn.plot.numbers(size=3), "size 3: must be width and height"),
    ],
)  # fmt: skip
def test_wrong_arguments_are_named(call, said: str) -> None:
    sweeps.best  # noqa: B018  # as soon as there are datasets they have `dyn`
    assert refusal_of(call).startswith(said)


def test_tables_have_units_and_no_kind_is_both_errors() -> None:
    archive = results()
    archive["delta"].attrs["units"] = "1"
    table = archive.dyn.table(units={"delta": "percent"})
    assert table["delta"].to_numpy() == pytest.approx([4.0, 2.0])
    assert "unit 'kg'" in refusal_of(lambda: archive.dyn.table(units={"delta": "kg"}))
    plot = results().dyn.plot
    assert not hasattr(plot, "nope") and refusal_of(lambda: plot.nope()).startswith("figure 'nope'")


UNITS = pint.UnitRegistry()
ASKED = {"engine": "ntua", "output": {"quantities": ["delta"]}}
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
    axis = sweeps.read_scene(**ASKED, set=SET, axes={"inertia": values})
    column = sweeps.read_scene(**ASKED, set=SET, designs={"inertia": values})
    assert_allclose(axis.axes["inertia"], [2.0, 3.0], rtol=1e-15)
    assert_allclose(column.designs["inertia"], [2.0, 3.0], rtol=1e-15)


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
    scene = sweeps.read_scene(**ASKED, set=SET, designs=table)
    assert set(scene.designs) == {"inertia", "crank_ratio"}
    assert_array_equal(scene.designs["crank_ratio"], [0.25, 0.3])
    assert scene.labels == {}


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
    scene = sweeps.read_scene(**ASKED, set={"speed": 1500.0}, indicator=table)
    assert scene.indicator is not None
    assert_allclose(scene.indicator(np.radians(ANGLE)), PRESSURE * BAR, rtol=1e-6, atol=1.0)
    (name,) = [name for name in scene.files if "indicator" in name]
    assert scene.source["indicator"]["file"] == name == "indicator_given_in_python.csv"


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
        refusal_of(lambda: sweeps.read_scene(**{**ASKED, "set": SET, **tables}))
        .removeprefix("scene: ")
        .startswith(said)
    )


def test_paths_of_pages_stay() -> None:
    """Modules that pages named before they moved: the same objects, whichever name is first."""
    names = {
        "sweeps.accessor": "sweeps.view.accessor",
        "sweeps.exploring.shaft_extremes": "sweeps.decide.explore.shaft_extremes",
        "sweeps.exploring.torsion": "sweeps.decide.explore.torsion",
        "sweeps.figures": "sweeps.view.figures",
        "sweeps.reading.laboratory.evaluation": "sweeps.lab.pressure.evaluation",
    }
    for name, where in names.items():
        module = importlib.import_module(name)
        assert module is importlib.import_module(where), name
        assert module.__spec__ is not None and module.__spec__.name == where
    with pytest.raises(ModuleNotFoundError, match="nothing"):
        importlib.import_module("sweeps.exploring.nothing")
