"""What a person finds in `sweeps`: names, help, types, and the tables of a scene as keywords."""

import inspect
import pydoc
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import sweeps
from sweeps.scene.keywords import OPTIONS, Tables, TablesButOutput
from sweeps.scene.toml_tables import SceneFile
from tests.support.scenes import asking, refusal_of
from tests.sweeps.processes import ROOT, python

TABLES = asking(["delta"], set={"speed": 1500.0, "load": 90.0})


def test_names_help_and_wrong_names() -> None:
    names = dir(sweeps)
    assert {"run", "open", "plan", "best", "Scene", "SceneError", "__version__"} <= set(names)
    assert not [name for name in names if not getattr(sweeps, name).__doc__]
    assert sweeps.__version__ == version("engine-dyn")
    # Help lists functions and their parameters.
    text = pydoc.plain(pydoc.render_doc(sweeps))
    assert "run(" in text and "stream(" in text and "class Plan" in text
    assert f"VERSION\n    {sweeps.__version__}" in text
    # Wrong name tells the nearest.
    with pytest.raises(
        AttributeError, match=r"'sweeps' has no attribute 'rum'; did you mean 'run'"
    ):
        sweeps.rum  # noqa: B018
    assert not hasattr(sweeps, "_ipython_display_")


def test_import_loads_nothing_heavy() -> None:
    heavy = {"numpy", "xarray", "pandas", "numba", "pydantic", "matplotlib", "netCDF4"}
    code = (
        "import sweeps, sys; dir(sweeps); print(*sys.modules)\n"
        "print(sweeps.figures.figure.__name__)"
    )
    done = python(code, check=True)
    modules, figure = done.stdout.splitlines()  # figures are there without another import
    assert not heavy & set(modules.split()) and figure == "figure"


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
    # Functions that take a scene take its tables.
    for name in sweeps.__all__:
        asked = getattr(getattr(sweeps, name), "__annotations__", {})
        assert ("scene" not in asked) or getattr(sweeps, name) in (*of_scenes, sweeps.Plan), name


def test_scene_of_keywords_is_that_of_the_dict() -> None:
    axes = {"inertia": [2.0, 4.0]}
    one = sweeps.read_scene(**TABLES, axes=axes)
    assert one.source == sweeps.read_scene({**TABLES, "axes": axes}).source
    assert sweeps.plan(**TABLES, axes=axes).designs == 2


def test_keywords_replace_tables_of_a_named_scene(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("designs.csv").write_text("inertia\n2\n3\n4\n", encoding="utf-8")
    scene = sweeps.read_scene("first", axes=None, designs={"file": "designs.csv"})
    assert list(scene.designs["inertia"]) == [2.0, 3.0, 4.0]
    assert scene.axes == {}
    assert scene.engine.name == sweeps.read_scene("first").engine.name
    with pytest.raises(sweeps.SceneError, match=r"first.toml with axes: \[axes\] inertai"):
        sweeps.read_scene("first", axes={"inertai": [1.0]})


@pytest.mark.compiled
def test_stream_takes_tables(tmp_path: Path) -> None:
    path = tmp_path / "out.nc"
    sweeps.stream(archive=path, **TABLES, axes={"inertia": [2.0, 4.0]})
    with sweeps.open(path) as archive:
        assert archive["delta"].dims == ("inertia",)


def test_scenes_and_plans_show_themselves_shortly() -> None:
    scene = sweeps.read_scene(**TABLES, axes={"inertia": range(1, 9)}, title="<b>bold</b>\n& more")
    plan = sweeps.plan(scene)
    assert repr(scene) == (
        "<Scene '<b>bold</b> & more': engine ntua; inertia (8), 8 designs; delta>"
    )
    assert repr(plan).startswith("<Plan of '<b>bold</b> & more': engine ntua; inertia (8), 8 des")
    for shown in (scene, plan):
        page = shown._repr_html_()
        assert "&lt;b&gt;bold&lt;/b&gt; &amp; more" in page and "<b>bold" not in page
        assert len(page) < 20_000
    assert "8 values from 1 to 8 kg m2" in scene._repr_html_()
    assert ">speed_solution<" in plan._repr_html_()


@pytest.mark.slow
def test_type_checkers_know_what_functions_return(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(
        "import sweeps\n"
        "reveal_type(sweeps.run('first', axes={'inertia': range(2, 4)}))\n"
        "reveal_type(sweeps.plan('first').designs)\n"
        "reveal_type(sweeps.__version__)\n"
        "sweeps.run(engin='ntua')\n"
    )
    pytest.importorskip("mypy")
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--follow-imports=silent", "--no-incremental",
         "--config-file", str(ROOT / "pyproject.toml"), str(program)],
        cwd=ROOT, capture_output=True, text=True,
    )  # fmt: skip
    kinds = re.findall(r'Revealed type is "([\w.]+)"', done.stdout)
    assert [kind.removeprefix("builtins.") for kind in kinds] == [
        "xarray.core.dataset.Dataset", "int", "str",
    ]  # fmt: skip
    assert 'Unexpected keyword argument "engin" for "run"' in done.stdout


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
        (lambda: results().dyn.plot.numbers(target=3), "target '3': must be QUANTITY=VALUE"),
        (lambda: results().dyn.plot.numbers(size=3), "size 3: must be width and height"),
    ],
)  # fmt: skip
def test_wrong_arguments_are_named(call, said: str) -> None:
    sweeps.best  # noqa: B018  # as soon as there are datasets they have `dyn`
    assert refusal_of(call).startswith(said)
