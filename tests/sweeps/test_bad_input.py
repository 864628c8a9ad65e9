"""Every bad input: one clear line, exit status 2, no traceback, nothing written."""

import math
from pathlib import Path
from typing import Any

import click.testing
import numpy as np
import pytest

from sweeps.scene.reading import read_scene
from tests.support.commands import invoke
from tests.support.engine_files import compression, indicator_text, points
from tests.support.scenes import refusal

OUTPUT = '[output]\nquantities = ["delta"]\n'
AXES = "[axes]\ninertia = [1.0, 2.0]\n"


def scene(body: str = "", *, engine: str = "ntua", output: str = OUTPUT) -> str:
    return f'engine = "{engine}"\n{body}\n{output}'


# Texts of scenes, and what the message must name: key, value, what is allowed.
WHOLE: list[tuple[str, ...]] = [
    ("engine = \n" + OUTPUT, "line 1", "not TOML"),
    ('engine = "ntua"\n[axes', "line 2", "not TOML"),
    ("", "engine", "missing"),
    ('engin = "ntua"\n' + OUTPUT, "engin", "did you mean 'engine'"),
    (OUTPUT, "engine", "missing"),
    ('engine = "ntua"', "output", "missing", "quantities"),
    ("engine = 7\n" + OUTPUT, "engine = 7", "must be a string"),
    ("title = 1979-05-27\n" + scene(), "title", "must be a string"),
    (scene(engine="ntau"), "ntau", "did you mean 'ntua'", "diesel_105x137"),
    (scene(engine="mine.toml"), "mine.toml", "no such file"),
    (scene("[set]\nload = 37", engine="diesel_105x137"), "load = 37", "diesel_105x137", "percent"),
    (scene("[axes]\nspeed = [1500, 9000]", engine="diesel_105x137"), "speed = 9000", "rpm",
     "diesel_105x137"),
]  # fmt: skip
# Those of the tables of a scene that is right otherwise.
TABLES: list[tuple[str, ...]] = [
    # structure
    ("[set]\nload = 1\nload = 2", "line 4", "of load"),
    ("[axis]\ninertia = [1]", "axis", "did you mean 'axes'", "designs"),
    ('titel = "x"', "titel", "did you mean 'title'"),
    ("[title]\na = 1", "title", "must be a string"),
    ("set = 3", "set = 3", "table"),
    ("[[axes]]\ninertia = [1]", "axes", "table"),
    # keys
    ("[set]\nspeeed = 1", "[set] speeed", "did you mean 'speed'"),
    ("[axes]\nintertia = [1]", "[axes] intertia", "'inertia'"),
    ("[axes]\nInertia = [1]", "Inertia", "did you mean 'inertia'"),
    ("[set]\ndelta_wanted = 1", "did you mean 'wanted_delta'"),
    ("[set]\narrangement = 'inline 3'", "did you mean 'in-line 3'?"),
    ("[set]\narrangement = 'Flat 4'", "did you mean 'boxer 4'?"),
    ("[set]\narrangement = 'round 4'", "'parallel twin ANGLE'\n"),
    ("[set]\nrecip = 1", "recip", "'reciprocating_mass'"),
    ("[designs]\nintertia = [1]", "[designs] intertia", "'inertia'"),
    *((f"[set]\nbore_{wrong} = 0.1", f"[set] bore_{wrong}: unknown key; must be bore_N with a "
       "number N from 2 to 24") for wrong in ("0", "x", "1", "25")),
    ("[axes]\nshaft_torque_limit_coupling = [1]", "[axes] shaft_torque_limit_coupling: unknown "
     "key; must be shaft_torque_limit_N with a number N from 1 to"),
    *((f"[{table}]\n{key} = 1", f"[{table}] {key}: belongs at the top of the scene")
      for table in ("set", "axes") for key in ("shaft", "output", "title", "silenced_warnings")),
    ("[set]\nwanted_delta = 'generatr'", "'generatr'", "did you mean 'generator'?"),
    ("[set]\nwanted_delta = '0,004'", "'0,004'", "with a decimal point: 0.004\n"),
    ("[set]\ninertia = '2,5'", "'2,5'", "in kg m2 with a decimal point: 2.5\n"),
    ("[set]\nxyzzy = 1", "xyzzy", "unknown key", "engine-dyn list keys"),
    ("[set]\ndelta = 1", "delta", "unknown key: this is a computed quantity"),
    ("[axes]\npasses = [1]", "passes", "[solver]", "[designs]"),
    ('[axes]\nmethod = ["auto"]', "method", "[solver]"),
    ("[set]\ninertia = 2\n" + AXES, "inertia", "[set]", "[axes]"),
    ("[set]\ninertia = 2\n[designs]\ninertia = [1, 2]", "inertia", "[set]", "[designs]"),
    (AXES + "[designs]\ninertia = [1, 2]", "inertia", "[axes]", "[designs]"),
    ('[designs]\npasses = [1, 2]\ninertia = [1, 2]\n[solver]\nmethod="thesis"\npasses=3', "passes",
     "[designs]", "[solver]"),
    ("[set]\ncrank_ratio = 0.25\n[axes]\nrod_length = [0.3, 0.4]", "crank_ratio", "rod_length",
     "[set]", "[axes]"),
    # values
    ('[set]\ninertia = "2 kg m3"', "inertia = '2 kg m3'", "kg m2"),
    ('[axes]\ninertia = ["2"]', "inertia", "'2'", "number"),
    ("[set]\ninertia = true", "inertia = true", "number"),
    ("[axes]\ninertia = [1, true]", "inertia", "value 2", "true"),
    ("[set]\ninertia = [1, 2]", "inertia = [1, 2]", "not a list"),
    ("[axes]\ninertia = 2", "inertia = 2", "list", "[set]"),
    ("[set]\ninertia = nan", "inertia = nan", "finite"),
    ("[axes]\ninertia = [1, nan]", "inertia", "value 2", "nan"),
    ("[axes]\ninertia = [1, inf]", "inertia", "inf", "finite"),
    (f"[set]\ninertia = 1{'0' * 400}", "inertia", "finite"),
    ("[axes]\ninertia = [[1, 2]]", "inertia", "value 1", "[1, 2]"),
    ("[axes]\ninertia = []", "inertia = []", "no values"),
    ("[axes]\ninertia = [1, 2, 1.0]", "inertia", "duplicate value 1", "unique"),
    # ranges
    ("[set]\ncrank_ratio = 1", "crank_ratio = 1", "below 1"),
    ("[axes]\ncrank_ratio = [0.2, 1.2]", "crank_ratio = 1.2", "below 1"),
    ("[set]\ncrank_ratio = 0", "crank_ratio = 0", "above 0"),
    ("[set]\ncrank_ratio = -0.2", "crank_ratio = -0.2", "above 0"),
    ("[set]\nreciprocating_mass = -1", "reciprocating_mass = -1", "0 or more", "[kg]"),
    ("[set]\ninertia = -2", "inertia = -2", "above 0", "kg m2"),
    ("[axes]\ninertia = [0, 1]", "inertia = 0", "above 0"),
    ("[set]\nbore = -0.1", "bore = -0.1", "above 0", "[m]"),
    ("[set]\nstroke = 0", "stroke = 0", "above 0"),
    ("[set]\nspeed = 0", "speed = 0", "above 0", "rpm"),
    ("[axes]\nspeed = [-1200]", "speed = -1200", "above 0"),
    ("[set]\nload_exponent = -1", "load_exponent = -1", "0 or more"),
    ("[set]\ncrankcase_pressure = -1", "crankcase_pressure = -1", "0 or more", "bar"),
    ("[set]\ncylinders = 2.5", "cylinders = 2.5", "whole"),
    ("[set]\ncylinders = 0", "cylinders = 0", "from 1 to 24"),
    ("[axes]\ncylinders = [1, 25]", "cylinders = 25", "from 1 to 24"),
    ("[axes]\nload = [50, 95]", "load = 95", "0 to 90", "percent"),
    ("[set]\nload = -5", "load = -5", "0"),
    ("[designs]\nload = [50, 95]", "[designs] load = 95", "0 to 90"),
    ("[set]\nrod_length = 0.09", "rod_length = 0.09", "0.09 m"),
    ("[axes]\nrod_length = [0.1, 0.4]\nstroke = [0.18, 0.2]", "rod_length = 0.1", "half the stroke",
     "0.1 m"),
    ("[designs]\nrod_length = [0.35, 0.1]\nstroke = [0.18, 0.24]", "rod_length = 0.1", "0.12 m"),
    # ranges with start, stop, num
    ("[axes]\nspeed = {start = 1, stop = 2}", "speed", "num", "missing"),
    ("[axes]\nspeed = {start = 1, stop = 2, number = 3}", "number", "did you mean 'num'"),
    ("[axes]\nspeed = {start = 1, stop = 2, num = 0}", "num = 0", "from 2"),
    ("[axes]\nspeed = {start = 1, stop = 2, num = 2.5}", "num = 2.5", "whole"),
    ("[axes]\nspeed = {start = 1, stop = 2, num = 1e2}", "num = 100.0", "whole"),
    ("[axes]\nspeed = {start = 1, stop = 2, num = 1000000000000}", "num = 1000000000000",
     "10000000"),
    ("[axes]\nspeed = {start = 2, stop = 2, num = 3}", "start and stop", "2"),
    ('[axes]\nspeed = {start = "1", stop = 2, num = 3}', "start = '1'", "number"),
    ("[axes]\nspeed = {start = 1, stop = nan, num = 3}", "stop = nan"),
    ("[axes]\nspeed = {start = 1, stop = inf, num = 3}", "stop = inf"),
    ('[axes]\nspeed = {start = 0, stop = 2, num = 3, spacing = "log"}', "start = 0", "above 0",
     "log"),
    ('[axes]\nload_offset = {start = 1, stop = -2, num = 3, spacing = "log"}', "stop = -2",
     "above 0"),
    ('[axes]\nspeed = {start = 1, stop = 2, num = 3, spacing = "cubic"}', "spacing = 'cubic'",
     "linear", "log"),
    ("[axes]\ncrank_ratio = {start = 0.1, stop = 1.1, num = 3}", "crank_ratio = 1.1", "below 1"),
    ("[axes]\ncylinders = {start = 1, stop = 4, num = 3}", "cylinders = 2.5", "whole"),
    # designs
    ("[designs]\ninertia = [1, 2]\nspeed = [1000, 1100, 1200]", "speed has 3", "inertia has 2"),
    ('[designs]\ncase = ["a"]\ninertia = [1, 2]', "case", "inertia", "equally"),
    ('[designs]\ncase = ["a"]', "no column for a parameter"),
    ("[designs]\n", "no column for a parameter"),
    ("[designs]\ncase = [1, 2]\ninertia = [1, 2]", "case", "strings"),
    ("[designs]\ninertia = 2", "inertia = 2", "list"),
    ("[designs]\ninertia = []", "inertia = []", "no values"),
    ("[designs]\ninertia = [1, -2]", "[designs] inertia = -2", "above 0"),
    ("[designs]\ninertia = [1]\npasses = [1.5]", "passes = 1.5", "whole"),
    ('[designs]\nfile = "t.csv"\ninertia = [1]', "inertia", "file"),
    ("[designs]\nfile = 3", "file = 3", "path"),
    ('[designs]\nfile = "nowhere.csv"', "nowhere.csv", "no such file"),
    # solver
    ('[solver]\nmethod = "newtn"', "'newtn'", "did you mean 'newton'"),
    ("[solver]\nmethod = []", "method = []", "thesis"),
    ('[solver]\nmethod = ["auto", "auto"]', "duplicate 'auto'"),
    ("[solver]\nmethod = 3", "method = 3", "thesis"),
    ("[solver]\nmethod = [3]", "method", "thesis"),
    ('[solver]\ninertia_model = "varable"', "inertia_model", "'varable'",
     "did you mean 'variable'"),
    ('[solver]\nclosure = "mean"', "closure = 'mean'", "power_mean", "cycle_time"),
    ("[solver]\ntol = 1e-6", "tol", "did you mean 'tolerance'"),
    ("[solver]\ntolerance = 0", "tolerance = 0", "1e-12"),
    ("[solver]\ntolerance = -1e-6", "tolerance = -1e-06", "0.1"),
    ("[solver]\ntolerance = 2", "tolerance = 2", "0.1"),
    ("[solver]\ntolerance = 1e-20", "tolerance = 1e-20", "1e-12"),
    ('[solver]\ntolerance = "small"', "tolerance = 'small'", "number"),
    ("[solver]\ntolerance = nan", "tolerance = nan", "number"),
    ('[solver]\nmethod = "thesis"\nclosure = "cycle_time"', "cycle_time", "'thesis'", "newton"),
    ('[solver]\nmethod = ["newton", "thesis"]\nclosure = "cycle_time"', "cycle_time", "'thesis'"),
    ('[solver]\nmethod = "newton"\npasses = 3', "passes = 3", "'newton'", "thesis"),
    ('[solver]\nmethod = "thesis"\npasses = 0', "passes = 0", "1 or more"),
    ('[solver]\nmethod = "thesis"\npasses = 1.5', "passes = 1.5", "whole"),
    ('[solver]\nmethod = "thesis"\npasses = [1]', "passes = [1]", "list"),
    ('[solver]\nmethod = "thesis"\nstart_speed = 0', "start_speed = 0", "above 0", "rad"),
    # indicator and reference
    ('[axes]\nload = [0, 50]\n[indicator]\nfile = "good.csv"', "[axes] load", "[indicator]"),
    ('[designs]\nload = [0, 50]\n[indicator]\nfile = "good.csv"', "[designs] load", "[indicator]"),
    ('[indicator]\nfile = "none.csv"', "none.csv", "no such file"),
    ('[indicator]\nfile = "."', "indicator", "cannot be read"),
    ("[indicator]", "[indicator] file", "missing"),
    ('[indicator]\nfile = ""', "[indicator] file = ''", "CSV"),
    ('[reference]\nfile = "none.csv"', "none.csv", "no such file"),
]  # fmt: skip
# Those of [output].
OUTPUTS: list[tuple[str, ...]] = [
    ("[output]\nangle_step = 1", "quantities", "missing"),
    ('[output]\nquantities = ["delat"]', "'delat'", "did you mean 'delta'", "list quantities"),
    ('[output]\nquantities = ["delta", "omega", "delta"]', "duplicate 'delta'", "unique"),
    ("[output]\nquantities = []", "quantities = []", "empty"),
    ('[output]\nquantities = "delta"', "quantities = 'delta'", "list"),
    ("[output]\nquantities = [1]", "quantities", "list of strings"),
    ('[output]\nquantities = ["inertia"]', "'inertia'", "parameter"),
    (OUTPUT + 'fail_on = ["staled"]', "'staled'", "did you mean 'stalled'", "not_converged"),
    (OUTPUT + 'fail_on = ["converged"]', "'converged'", "stalled"),
    (OUTPUT + "angle_step = 0.7", "angle_step = 0.7", "720"),
    (OUTPUT + "angle_step = 0", "angle_step = 0", "720"),
    (OUTPUT + "angle_step = -1", "angle_step = -1", "720"),
    (OUTPUT + "angle_step = 1e-9", "angle_step = 1e-09", "0.01"),
    (OUTPUT + "angle_step = 720", "angle_step = 720", "90"),
]  # fmt: skip

SCENES = [
    *WHOLE,
    *((scene(text), *words) for text, *words in TABLES),
    *((scene(output=text), *words) for text, *words in OUTPUTS),
]


def one_line(result: click.testing.Result, *fragments: str) -> None:
    assert result.exit_code == 2, result.output
    assert result.stderr.count("\n") == 1
    assert "Traceback" not in result.output
    for fragment in fragments:
        assert fragment in result.stderr, result.stderr


def refused(folder: Path, text: str, *fragments: str) -> None:
    """Run a scene as a user would: it is refused, and how."""
    folder.joinpath("good.csv").write_text(indicator_text(points()))
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    before = sorted(folder.rglob("*"))
    output = folder / "new" / "out.nc"
    result = invoke("run", path, "-o", output)
    one_line(result, "scene.toml", *fragments)
    assert result.stdout == ""
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize("case", range(len(SCENES)))
def test_scene_is_refused_in_one_line(case: int, tmp_path: Path) -> None:
    text, *words = SCENES[case]
    refused(tmp_path, text, *words)


def replaced(line: int, text: str) -> str:
    """A good diagram with one of its lines, counted from 1, replaced."""
    lines = indicator_text(points()).splitlines()
    lines[line - 1] = text
    return "\n".join(lines) + "\n"


# Text of pressure.csv, and what the message must name.
DIAGRAMS: list[tuple[str, ...]] = [
    ("", "empty"),
    ("crank_angle_deg,pressure_bar\n", "no rows"),
    ("angle,pressure_bar\n0,1\n", "line 1", "crank_angle_deg", "angle"),
    ("0,1\n2,3\n", "angle_column", "cannot be determined", "column 1"),
    ("crank_angle_deg,pressure_bar,pressure_bar\n0,1,1\n", "line 1", "two columns"),
    ("crank_angle_deg;pressure_bar\n0;1\n", "crank angle", "not rise"),
    (replaced(10, "-346,high"), "line 10", "pressure_bar", "'high'"),
    (replaced(10, "-346,"), "line 10", "pressure_bar", "blank"),
    (replaced(10, "-346,nan"), "line 10", "pressure_bar", "'nan'", "finite"),
    (replaced(10, "inf,1"), "line 10", "crank_angle_deg", "'inf'"),
    (replaced(10, "-346,1_0"), "line 10", "'1_0'"),
    (replaced(10, "-346"), "line 10", "1 field,", "2"),
    (replaced(10, "-346,1,5"), "line 10", "3 fields", "2"),
    (replaced(10, '-346,"1'), "line 10"),
    (replaced(10, "-348,1"), "line 10", "-348"),
    (replaced(10, "-355,1"), "line 10", "-355"),
    (replaced(363, "400,1"), "line 363", "400", "360"),
    (replaced(10, "-346,0"), "line 10", "0 bar", "positive"),
    (replaced(10, "-346,-0.1"), "line 10", "-0.1 bar", "gauge"),
    (indicator_text([(a, 100.0 * p) for a, p in points()]), "line", "500 bar", "kilopascal"),
    (replaced(363, "360,3"), "-360", "360", "3 bar", "2 %"),
    (indicator_text([(a + 360.0, p) for a, p in points()]), "line", "362", "-360..360"),
    (indicator_text([(a, p) for a, p in points() if abs(a) <= 180.0]), "gap", "degrees"),
    (indicator_text(points(60.0)), "13 points", "16"),
    (indicator_text([(a, float(compression(np.array((a + 720.0) % 720.0 - 360.0))))
                     for a, _ in points()]),
     "line", "peak", "shifted by 360"),
]  # fmt: skip


@pytest.mark.parametrize("case", range(len(DIAGRAMS)))
def test_diagram_is_refused_with_its_line(case: int, tmp_path: Path) -> None:
    text, *words = DIAGRAMS[case]
    tmp_path.joinpath("pressure.csv").write_text(text)
    refused(tmp_path, scene('[indicator]\nfile = "pressure.csv"'), "pressure.csv", *words)


# Text of table.csv in [designs], and what the message must name.
DESIGN_TABLES: list[tuple[str, ...]] = [
    ("intertia\n1\n", "intertia", "did you mean 'inertia'"),
    ("case\na\n", "no column for a parameter"),
    ("inertia,speed\n1,1000\n2,-5\n", "line 3", "speed = -5", "above 0"),
    ("inertia,speed\n1,1000\n2,\n", "line 3", "speed", "blank"),
    ("inertia\n2 kg\n", "line 2", "'2 kg'", "number"),
    ("load\n50\n95\n", "load = 95", "0 to 90"),
    ("delta,status\n0.1,converged\n", "no column for a parameter"),  # Results are left out
    ("inertia,\n1,2\n", "line 1", "without a name"),
]  # fmt: skip


@pytest.mark.parametrize("case", range(len(DESIGN_TABLES)))
def test_table_of_designs_is_refused(case: int, tmp_path: Path) -> None:
    text, *words = DESIGN_TABLES[case]
    tmp_path.joinpath("table.csv").write_text(text)
    file = "table.csv" if "line" in words[0] else ""
    refused(tmp_path, scene('[designs]\nfile = "table.csv"'), file, *words)


TWO_DESIGNS = '[designs]\ncase = ["a", "b"]\ninertia = [1, 2]\n'
TWO_AXES = "[axes]\ninertia = [1, 2]\nspeed = [1000, 1100, 1200]\n"

# Body of the scene, text of published.csv, and what the message must name.
REFERENCES: list[tuple[str, ...]] = [
    (TWO_DESIGNS, "delta\n0.1\n", "1 row ", "2 designs"),
    (TWO_DESIGNS, "delta\n1\n2\n3\n", "3 rows", "2 designs"),
    (TWO_DESIGNS, "case,delta\nb,1\na,2\n", "line 2", "case = b", "'a'"),
    (TWO_DESIGNS, "inertia,delta\n1,1\n3,2\n", "line 3", "inertia = 3", "2"),
    (TWO_DESIGNS, "case\na\nb\n", "no column for a quantity"),
    (TWO_DESIGNS, "delat\n1\n2\n", "delat", "did you mean 'delta'"),
    (TWO_DESIGNS, "delta\n1\nx\n", "line 3", "delta", "'x'", "blank"),
    (AXES, "case,inertia,delta\na,1,1\n", "case", "no such labels"),
    (AXES, "inertia,delta\n1,1\n3,2\n", "line 3", "inertia = 3", "1, 2"),
    (TWO_AXES, "delta\n1\n2\n", "2 rows", "inertia", "speed"),
    (AXES, "inertia,delta\n1,1\n1,2\n", "line 3", "line 2"),
    (AXES, "inertia,speed,delta\n1,1300,1\n", "line 2", "speed = 1300", "1200"),
    ('[solver]\nmethod = ["newton", "auto"]\n', "method,delta\nthesis,1\n", "line 2",
     "method = 'thesis'", "newton"),
    ("[axes]\nspeed = [1000, 1100]\n" + TWO_DESIGNS, "speed,case,delta\n1000,c,1\n", "line 2",
     "matches 0", "case"),
]  # fmt: skip


@pytest.mark.parametrize("case", range(len(REFERENCES)))
def test_reference_is_refused(case: int, tmp_path: Path) -> None:
    body, text, *words = REFERENCES[case]
    tmp_path.joinpath("published.csv").write_text(text)
    refused(tmp_path, scene(body + '[reference]\nfile = "published.csv"'), "published.csv", *words)


def test_output_is_checked_before_anything_is_computed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: Any, **__: Any) -> None:
        raise AssertionError("must not be called")

    monkeypatch.setattr("sweeps.cli.running.writing", never)
    existing = tmp_path / "out.nc"
    existing.write_text("kept")
    one_line(invoke("run", "first", "-o", existing), "out.nc", "exists", "--overwrite")
    assert existing.read_text() == "kept"
    one_line(invoke("run", "first", "-o", tmp_path), str(tmp_path), "folder")
    assert list(tmp_path.iterdir()) == [existing]


ASKED = {"engine": "ntua", "output": {"quantities": ["delta"]}}
LOOP: list[Any] = []
LOOP.append(LOOP)


@pytest.mark.parametrize(
    ("given", "fragment"),
    [
        (None, "scene = None"),
        (3, "scene = 3"),
        (["a"], "must be a path"),
        ({1: 2}, "key 1"),
        ({}, "engine"),
        ({**ASKED, "set": {"inertia": None}}, "None"),
        ({**ASKED, "set": {"inertia": 1j}}, "inertia"),
        ({**ASKED, "axes": {"inertia": np.array([1.0, math.nan])}}, "inertia, value 2 = nan"),
        ({**ASKED, "axes": {"inertia": np.array([True, False])}}, "true"),
        ({**ASKED, "axes": {"inertia": LOOP}}, "nested"),
    ],
)
def test_python_callers_get_the_same_error(given: Any, fragment: str) -> None:
    assert fragment in refusal(given)


@pytest.mark.parametrize("count", [3, 5000])
@pytest.mark.parametrize("table", ["axes", "designs"])
def test_masked_values_are_refused(table: str, count: int) -> None:
    values = np.ma.masked_array(np.linspace(1.0, 2.0, count), np.arange(count) == 2)
    told = refusal({**ASKED, table: {"inertia": values}})
    assert told.startswith(f"scene: [{table}] inertia: value 3 is masked")
    read_scene({**ASKED, table: {"inertia": values[:2]}})  # nothing of it is masked
