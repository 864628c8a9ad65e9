"""Every bad input: one clear line, exit status 2, no traceback, nothing written."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click.testing
import numpy as np
import pytest
import xarray as xr

from sweeps.cli.main import main
from sweeps.errors import SceneError
from sweeps.scene.reading import read_scene
from tests.support.commands import invoke
from tests.support.engine_files import compression, indicator_text, points

OUTPUT = '[output]\nquantities = ["delta"]\n'
AXES = "[axes]\ninertia = [1.0, 2.0]\n"


def scene(body: str = "", *, engine: str = "ntua", output: str = OUTPUT) -> str:
    return f'engine = "{engine}"\n{body}\n{output}'


def designs(body: str) -> str:
    return scene(f"[designs]\n{body}")


# Text of the scene, and what the message must name: key, value, what is allowed.
SCENES: dict[str, tuple[str, tuple[str, ...]]] = {
    # structure
    "syntax": ("engine = \n" + OUTPUT, ("line 1", "not TOML")),
    "syntax at the end": ('engine = "ntua"\n[axes', ("line 2", "not TOML", "[axes")),
    "key twice in TOML": (scene("[set]\nload = 1\nload = 2"), ("line 4", "load = 2")),
    "empty file": ("", ("engine", "missing")),
    "unknown table": (scene("[axis]\ninertia = [1]"), ("axis", "did you mean 'axes'", "designs")),
    "unknown top key": (scene('titel = "x"'), ("titel", "did you mean 'title'")),
    "misspelt engine key": ('engin = "ntua"\n' + OUTPUT, ("engin", "did you mean 'engine'")),
    "no engine": (OUTPUT, ("engine", "missing")),
    "no output": ('engine = "ntua"', ("output", "missing", "quantities")),
    "no quantities": (scene(output="[output]\nangle_step = 1"), ("quantities", "missing")),
    "table for a value": (scene("[title]\na = 1"), ("title", "must be a string")),
    "value for a table": (scene("set = 3"), ("set = 3", "table")),
    "array of tables": (scene("[[axes]]\ninertia = [1]"), ("axes", "table")),
    "engine not a text": ("engine = 7\n" + OUTPUT, ("engine = 7", "must be a string")),
    "date for a text": ("title = 1979-05-27\n" + scene(), ("title", "must be a string")),
    # engines
    "unknown engine": (scene(engine="ntau"), ("ntau", "did you mean 'ntua'", "diesel_105x137")),
    "missing engine file": (scene(engine="mine.toml"), ("mine.toml", "no such file")),
    # keys
    "unknown set key": (scene("[set]\nspeeed = 1"), ("[set] speeed", "did you mean 'speed'")),
    "unknown axis": (scene("[axes]\nintertia = [1]"), ("[axes] intertia", "'inertia'")),
    "capitals": (scene("[axes]\nInertia = [1]"), ("Inertia", "did you mean 'inertia'")),
    "order of words": (scene("[set]\ndelta_wanted = 1"), ("did you mean 'wanted_delta'",)),
    "inline": (scene("[set]\narrangement = 'inline 3'"), ("did you mean 'in-line 3'?",)),
    "flat": (scene("[set]\narrangement = 'Flat 4'"), ("did you mean 'boxer 4'?",)),
    "nothing near": (scene("[set]\narrangement = 'round 4'"), ("'parallel twin ANGLE'\n",)),
    "beginning of a key": (scene("[set]\nrecip = 1"), ("recip", "'reciprocating_mass'")),
    "unknown column": (designs("intertia = [1]"), ("[designs] intertia", "'inertia'")),
    "word nothing is near": (
        scene("[set]\nxyzzy = 1"),
        ("xyzzy", "unknown key", "engine-dyn list keys"),
    ),
    "quantity as a key": (
        scene("[set]\ndelta = 1"),
        ("delta", "unknown key: this is a computed quantity"),
    ),
    "solver key in axes": (scene("[axes]\npasses = [1]"), ("passes", "[solver]", "[designs]")),
    "method in axes": (scene('[axes]\nmethod = ["auto"]'), ("method", "[solver]")),
    "set and axes": (scene("[set]\ninertia = 2\n" + AXES), ("inertia", "[set]", "[axes]")),
    "set and designs": (
        scene("[set]\ninertia = 2\n[designs]\ninertia = [1, 2]"),
        ("inertia", "[set]", "[designs]"),
    ),
    "axes and designs": (
        scene(AXES + "[designs]\ninertia = [1, 2]"),
        ("inertia", "[axes]", "[designs]"),
    ),
    "solver and designs": (
        scene('[designs]\npasses = [1, 2]\ninertia = [1, 2]\n[solver]\nmethod="thesis"\npasses=3'),
        ("passes", "[designs]", "[solver]"),
    ),
    "two rods": (
        scene("[set]\ncrank_ratio = 0.25\n[axes]\nrod_length = [0.3, 0.4]"),
        ("crank_ratio", "rod_length", "[set]", "[axes]"),
    ),
    # values
    "unit in a text": (scene('[set]\ninertia = "2 kg m2"'), ("inertia = '2 kg m2'", "kg m2")),
    "number in a text": (scene('[axes]\ninertia = ["2"]'), ("inertia", "'2'", "number")),
    "truth value": (scene("[set]\ninertia = true"), ("inertia = true", "number")),
    "truth value on an axis": (
        scene("[axes]\ninertia = [1, true]"),
        ("inertia", "value 2", "true"),
    ),
    "list in set": (scene("[set]\ninertia = [1, 2]"), ("inertia = [1, 2]", "not a list")),
    "number as an axis": (scene("[axes]\ninertia = 2"), ("inertia = 2", "list", "[set]")),
    "nan in set": (scene("[set]\ninertia = nan"), ("inertia = nan", "finite")),
    "nan on an axis": (scene("[axes]\ninertia = [1, nan]"), ("inertia", "value 2", "nan")),
    "infinity": (scene("[axes]\ninertia = [1, inf]"), ("inertia", "inf", "finite")),
    "huge integer": (scene(f"[set]\ninertia = 1{'0' * 400}"), ("inertia", "finite")),
    "nested list": (scene("[axes]\ninertia = [[1, 2]]"), ("inertia", "value 1", "[1, 2]")),
    "empty axis": (scene("[axes]\ninertia = []"), ("inertia = []", "no values")),
    "duplicate": (
        scene("[axes]\ninertia = [1, 2, 1.0]"),
        ("inertia", "duplicate value 1", "unique"),
    ),
    # ranges
    "lambda 1": (scene("[set]\ncrank_ratio = 1"), ("crank_ratio = 1", "below 1")),
    "lambda 1.2": (scene("[axes]\ncrank_ratio = [0.2, 1.2]"), ("crank_ratio = 1.2", "below 1")),
    "lambda 0": (scene("[set]\ncrank_ratio = 0"), ("crank_ratio = 0", "above 0")),
    "lambda negative": (scene("[set]\ncrank_ratio = -0.2"), ("crank_ratio = -0.2", "above 0")),
    "mass negative": (
        scene("[set]\nreciprocating_mass = -1"),
        ("reciprocating_mass = -1", "0 or more", "[kg]"),
    ),
    "inertia negative": (scene("[set]\ninertia = -2"), ("inertia = -2", "above 0", "kg m2")),
    "inertia zero": (scene("[axes]\ninertia = [0, 1]"), ("inertia = 0", "above 0")),
    "bore negative": (scene("[set]\nbore = -0.1"), ("bore = -0.1", "above 0", "[m]")),
    "stroke zero": (scene("[set]\nstroke = 0"), ("stroke = 0", "above 0")),
    "speed zero": (scene("[set]\nspeed = 0"), ("speed = 0", "above 0", "rpm")),
    "speed negative": (scene("[axes]\nspeed = [-1200]"), ("speed = -1200", "above 0")),
    "exponent negative": (scene("[set]\nload_exponent = -1"), ("load_exponent = -1", "0 or more")),
    "crankcase negative": (
        scene("[set]\ncrankcase_pressure = -1"),
        ("crankcase_pressure = -1", "0 or more", "bar"),
    ),
    "cylinders not whole": (scene("[set]\ncylinders = 2.5"), ("cylinders = 2.5", "whole")),
    "cylinders 0": (scene("[set]\ncylinders = 0"), ("cylinders = 0", "from 1 to 24")),
    "cylinders 25": (scene("[axes]\ncylinders = [1, 25]"), ("cylinders = 25", "from 1 to 24")),
    "load above": (scene("[axes]\nload = [50, 95]"), ("load = 95", "0 to 90", "percent")),
    "load negative": (scene("[set]\nload = -5"), ("load = -5", "0")),
    "load above in designs": (designs("load = [50, 95]"), ("[designs] load = 95", "0 to 90")),
    "one diagram": (
        scene("[set]\nload = 37", engine="diesel_105x137"),
        ("load = 37", "diesel_105x137", "percent"),
    ),
    "speed beyond the diagram": (
        scene("[axes]\nspeed = [1500, 9000]", engine="diesel_105x137"),
        ("speed = 9000", "rpm", "diesel_105x137"),
    ),
    "rod shorter than the crank": (
        scene("[set]\nrod_length = 0.09"),
        ("rod_length = 0.09", "0.09 m"),
    ),
    "rod shorter than a crank": (
        scene("[axes]\nrod_length = [0.1, 0.4]\nstroke = [0.18, 0.2]"),
        ("rod_length = 0.1", "half the stroke", "0.1 m"),
    ),
    "rod shorter in a design": (
        designs("rod_length = [0.35, 0.1]\nstroke = [0.18, 0.24]"),
        ("rod_length = 0.1", "0.12 m"),
    ),
    # ranges with start, stop, num
    "range without num": (
        scene("[axes]\nspeed = {start = 1, stop = 2}"),
        ("speed", "num", "missing"),
    ),
    "range misspelt": (
        scene("[axes]\nspeed = {start = 1, stop = 2, number = 3}"),
        ("number", "did you mean 'num'"),
    ),
    "range of no values": (
        scene("[axes]\nspeed = {start = 1, stop = 2, num = 0}"),
        ("num = 0", "from 2"),
    ),
    "range with part of a value": (
        scene("[axes]\nspeed = {start = 1, stop = 2, num = 2.5}"),
        ("num = 2.5", "whole"),
    ),
    "range beyond bounds": (
        scene("[axes]\nspeed = {start = 1, stop = 2, num = 1000000000000}"),
        ("num = 1000000000000", "10000000"),
    ),
    "range of a point": (
        scene("[axes]\nspeed = {start = 2, stop = 2, num = 3}"),
        ("start and stop", "2"),
    ),
    "range from a text": (
        scene('[axes]\nspeed = {start = "1", stop = 2, num = 3}'),
        ("start = '1'", "number"),
    ),
    "range to nan": (scene("[axes]\nspeed = {start = 1, stop = nan, num = 3}"), ("stop = nan",)),
    "range to infinity": (
        scene("[axes]\nspeed = {start = 1, stop = inf, num = 3}"),
        ("stop = inf",),
    ),
    "log from 0": (
        scene('[axes]\nspeed = {start = 0, stop = 2, num = 3, spacing = "log"}'),
        ("start = 0", "above 0", "log"),
    ),
    "log to less than 0": (
        scene('[axes]\nload_offset = {start = 1, stop = -2, num = 3, spacing = "log"}'),
        ("stop = -2", "above 0"),
    ),
    "unknown spacing": (
        scene('[axes]\nspeed = {start = 1, stop = 2, num = 3, spacing = "cubic"}'),
        ("spacing = 'cubic'", "linear", "log"),
    ),
    "range out of range": (
        scene("[axes]\ncrank_ratio = {start = 0.1, stop = 1.1, num = 3}"),
        ("crank_ratio = 1.1", "below 1"),
    ),
    "range of parts of cylinders": (
        scene("[axes]\ncylinders = {start = 1, stop = 4, num = 3}"),
        ("cylinders = 2.5", "whole"),
    ),
    # designs
    "unequal lists": (
        designs("inertia = [1, 2]\nspeed = [1000, 1100, 1200]"),
        ("speed has 3", "inertia has 2"),
    ),
    "unequal labels": (designs('case = ["a"]\ninertia = [1, 2]'), ("case", "inertia", "equally")),
    "labels alone": (designs('case = ["a"]'), ("no column for a parameter",)),
    "no columns": (designs(""), ("no column for a parameter",)),
    "labels not texts": (designs("case = [1, 2]\ninertia = [1, 2]"), ("case", "strings")),
    "single value in designs": (designs("inertia = 2"), ("inertia = 2", "list")),
    "empty designs": (designs("inertia = []"), ("inertia = []", "no values")),
    "value in designs": (designs("inertia = [1, -2]"), ("[designs] inertia = -2", "above 0")),
    "passes not whole": (designs("inertia = [1]\npasses = [1.5]"), ("passes = 1.5", "whole")),
    "file and columns": (designs('file = "t.csv"\ninertia = [1]'), ("inertia", "file")),
    "file not a text": (designs("file = 3"), ("file = 3", "path")),
    "missing table": (designs('file = "nowhere.csv"'), ("nowhere.csv", "no such file")),
    # solver
    "unknown method": (scene('[solver]\nmethod = "newtn"'), ("'newtn'", "did you mean 'newton'")),
    "no methods": (scene("[solver]\nmethod = []"), ("method = []", "thesis")),
    "method twice": (scene('[solver]\nmethod = ["auto", "auto"]'), ("duplicate 'auto'",)),
    "method a number": (scene("[solver]\nmethod = 3"), ("method = 3", "thesis")),
    "method a list of numbers": (scene("[solver]\nmethod = [3]"), ("method", "thesis")),
    "unknown model": (
        scene('[solver]\ninertia_model = "varable"'),
        ("inertia_model", "'varable'", "did you mean 'variable'"),
    ),
    "unknown closure": (
        scene('[solver]\nclosure = "mean"'),
        ("closure = 'mean'", "power_mean", "cycle_time"),
    ),
    "unknown solver key": (scene("[solver]\ntol = 1e-6"), ("tol", "did you mean 'tolerance'")),
    "tolerance 0": (scene("[solver]\ntolerance = 0"), ("tolerance = 0", "1e-12")),
    "tolerance negative": (scene("[solver]\ntolerance = -1e-6"), ("tolerance = -1e-06", "0.1")),
    "tolerance absurd": (scene("[solver]\ntolerance = 2"), ("tolerance = 2", "0.1")),
    "tolerance unreachable": (scene("[solver]\ntolerance = 1e-20"), ("tolerance = 1e-20", "1e-12")),
    "tolerance a text": (scene('[solver]\ntolerance = "small"'), ("tolerance = 'small'", "number")),
    "tolerance nan": (scene("[solver]\ntolerance = nan"), ("tolerance = nan", "number")),
    "closure of thesis": (
        scene('[solver]\nmethod = "thesis"\nclosure = "cycle_time"'),
        ("cycle_time", "'thesis'", "newton"),
    ),
    "closure of one of several": (
        scene('[solver]\nmethod = ["newton", "thesis"]\nclosure = "cycle_time"'),
        ("cycle_time", "'thesis'"),
    ),
    "passes without a stepping method": (
        scene('[solver]\nmethod = "newton"\npasses = 3'),
        ("passes = 3", "'newton'", "thesis"),
    ),
    "passes 0": (scene('[solver]\nmethod = "thesis"\npasses = 0'), ("passes = 0", "1 or more")),
    "passes in parts": (
        scene('[solver]\nmethod = "thesis"\npasses = 1.5'),
        ("passes = 1.5", "whole"),
    ),
    "passes a list": (scene('[solver]\nmethod = "thesis"\npasses = [1]'), ("passes = [1]", "list")),
    "start speed 0": (
        scene('[solver]\nmethod = "thesis"\nstart_speed = 0'),
        ("start_speed = 0", "above 0", "rad"),
    ),
    # output
    "unknown quantity": (
        scene(output='[output]\nquantities = ["delat"]'),
        ("'delat'", "did you mean 'delta'", "list quantities"),
    ),
    "quantity twice": (
        scene(output='[output]\nquantities = ["delta", "omega", "delta"]'),
        ("duplicate 'delta'", "unique"),
    ),
    "quantities empty": (scene(output="[output]\nquantities = []"), ("quantities = []", "empty")),
    "quantities a text": (
        scene(output='[output]\nquantities = "delta"'),
        ("quantities = 'delta'", "list"),
    ),
    "quantity a number": (
        scene(output="[output]\nquantities = [1]"),
        ("quantities", "list of strings"),
    ),
    "parameter as a quantity": (
        scene(output='[output]\nquantities = ["inertia"]'),
        ("'inertia'", "parameter"),
    ),
    "unknown outcome": (
        scene(output=OUTPUT + 'fail_on = ["staled"]'),
        ("'staled'", "did you mean 'stalled'", "not_converged"),
    ),
    "converged as a failure": (
        scene(output=OUTPUT + 'fail_on = ["converged"]'),
        ("'converged'", "stalled"),
    ),
    "step that does not divide": (
        scene(output=OUTPUT + "angle_step = 0.7"),
        ("angle_step = 0.7", "720"),
    ),
    "step 0": (scene(output=OUTPUT + "angle_step = 0"), ("angle_step = 0", "720")),
    "step negative": (scene(output=OUTPUT + "angle_step = -1"), ("angle_step = -1", "720")),
    "step tiny": (scene(output=OUTPUT + "angle_step = 1e-9"), ("angle_step = 1e-09", "0.01")),
    "step of a cycle": (scene(output=OUTPUT + "angle_step = 720"), ("angle_step = 720", "90")),
    # indicator and reference
    "indicator and load": (
        scene('[axes]\nload = [0, 50]\n[indicator]\nfile = "good.csv"'),
        ("[axes] load", "[indicator]"),
    ),
    "indicator and loads of designs": (
        scene('[designs]\nload = [0, 50]\n[indicator]\nfile = "good.csv"'),
        ("[designs] load", "[indicator]"),
    ),
    "missing indicator": (scene('[indicator]\nfile = "none.csv"'), ("none.csv", "no such file")),
    "indicator a folder": (scene('[indicator]\nfile = "."'), ("indicator", "cannot be read")),
    "indicator without a file": (scene("[indicator]"), ("[indicator] file", "missing")),
    "indicator file empty": (scene('[indicator]\nfile = ""'), ("[indicator] file = ''", "CSV")),
    "missing reference": (scene('[reference]\nfile = "none.csv"'), ("none.csv", "no such file")),
}

EXTRA: dict[str, tuple[str, tuple[str, ...]]] = {}


def refused(folder: Path, text: str, fragments: tuple[str, ...], file: str = "scene.toml") -> str:
    """Run a scene as a user would; return the message after checking how it was refused."""
    folder.joinpath("good.csv").write_text(indicator_text(points()))
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    before = sorted(folder.rglob("*"))
    output = folder / "new" / "out.nc"
    result = click.testing.CliRunner().invoke(main, ["run", str(path), "-o", str(output)])
    assert result.exit_code == 2, result.output
    message = result.stderr
    assert message.count("\n") == 1, message
    assert "Traceback" not in result.output
    assert result.stdout == ""
    assert file in message
    for fragment in fragments:
        assert fragment in message, message
    assert sorted(folder.rglob("*")) == before
    return message


@pytest.mark.parametrize("case", SCENES)
def test_scene_is_refused_in_one_line(case: str, tmp_path: Path) -> None:
    refused(tmp_path, *SCENES[case])


def replaced(line: int, text: str) -> str:
    """A good diagram with one of its lines, counted from 1, replaced."""
    lines = indicator_text(points()).splitlines()
    lines[line - 1] = text
    return "\n".join(lines) + "\n"


# Text of pressure.csv, and what the message must name.
DIAGRAMS: dict[str, tuple[str, tuple[str, ...]]] = {
    "empty": ("", ("empty",)),
    "header alone": ("crank_angle_deg,pressure_bar\n", ("no rows",)),
    "other header": ("angle,pressure_bar\n0,1\n", ("line 1", "crank_angle_deg", "angle")),
    "no header": ("0,1\n2,3\n", ("angle_column", "cannot be determined", "column 1")),
    "column twice": (
        "crank_angle_deg,pressure_bar,pressure_bar\n0,1,1\n",
        ("line 1", "two columns"),
    ),
    "semicolons, one row": ("crank_angle_deg;pressure_bar\n0;1\n", ("crank angle", "not rise")),
    "a word": (replaced(10, "-346,high"), ("line 10", "pressure_bar", "'high'")),
    "a blank": (replaced(10, "-346,"), ("line 10", "pressure_bar", "blank")),
    "nan": (replaced(10, "-346,nan"), ("line 10", "pressure_bar", "'nan'", "finite")),
    "infinity": (replaced(10, "inf,1"), ("line 10", "crank_angle_deg", "'inf'")),
    "underscore": (replaced(10, "-346,1_0"), ("line 10", "'1_0'")),
    "short row": (replaced(10, "-346"), ("line 10", "1 field,", "2")),
    "decimal commas": (replaced(10, "-346,1,5"), ("line 10", "3 fields", "2")),
    "broken quotes": (replaced(10, '-346,"1'), ("line 10",)),
    "angle again": (replaced(10, "-348,1"), ("line 10", "-348")),
    "angle back": (replaced(10, "-355,1"), ("line 10", "-355")),
    "angle outside": (replaced(363, "400,1"), ("line 363", "400", "360")),
    "pressure 0": (replaced(10, "-346,0"), ("line 10", "0 bar", "positive")),
    "gauge pressure": (replaced(10, "-346,-0.1"), ("line 10", "-0.1 bar", "gauge")),
    "in kilopascal": (
        indicator_text([(a, 100.0 * p) for a, p in points()]),
        ("line", "500 bar", "kilopascal"),
    ),
    "ends apart": (replaced(363, "360,3"), ("-360", "360", "3 bar", "2 %")),
    "from 0 to 720": (
        indicator_text([(a + 360.0, p) for a, p in points()]),
        ("line", "362", "-360..360"),
    ),
    "half a cycle": (
        indicator_text([(a, p) for a, p in points() if abs(a) <= 180.0]),
        ("gap", "degrees"),
    ),
    "too few": (indicator_text(points(60.0)), ("13 points", "16")),
    "shifted": (
        indicator_text(
            [
                (a, float(compression(np.array(a + 360.0 if a < 0.0 else a - 360.0))))
                for a, _ in points()
            ]
        ),
        ("line", "peak", "shifted by 360"),
    ),
}


@pytest.mark.parametrize("case", DIAGRAMS)
def test_diagram_is_refused_with_its_line(case: str, tmp_path: Path) -> None:
    text, fragments = DIAGRAMS[case]
    tmp_path.joinpath("pressure.csv").write_text(text)
    refused(tmp_path, scene('[indicator]\nfile = "pressure.csv"'), ("pressure.csv", *fragments))


def test_diagram_that_is_no_text_is_refused(tmp_path: Path) -> None:
    tmp_path.joinpath("pressure.csv").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(range(256)))
    refused(tmp_path, scene('[indicator]\nfile = "pressure.csv"'), ("pressure.csv", "not a text"))


# Text of table.csv in [designs], and what the message must name.
TABLES: dict[str, tuple[str, tuple[str, ...]]] = {
    "unknown column": ("intertia\n1\n", ("intertia", "did you mean 'inertia'")),
    "no parameter": ("case\na\n", ("no column for a parameter",)),
    "outside": ("inertia,speed\n1,1000\n2,-5\n", ("line 3", "speed = -5", "above 0")),
    "blank": ("inertia,speed\n1,1000\n2,\n", ("line 3", "speed", "blank")),
    "a unit": ("inertia\n2 kg\n", ("line 2", "'2 kg'", "number")),
    "load": ("load\n50\n95\n", ("load = 95", "0 to 90")),
    "a quantity": ("inertia,delta\n1,0.1\n", ("delta", "unknown key")),
    "nameless column": ("inertia,\n1,2\n", ("line 1", "without a name")),
}


@pytest.mark.parametrize("case", TABLES)
def test_table_of_designs_is_refused(case: str, tmp_path: Path) -> None:
    text, fragments = TABLES[case]
    tmp_path.joinpath("table.csv").write_text(text)
    refused(
        tmp_path,
        designs('file = "table.csv"'),
        ("table.csv" if "line" in fragments[0] else "", *fragments),
    )


TWO_DESIGNS = '[designs]\ncase = ["a", "b"]\ninertia = [1, 2]\n'
TWO_AXES = "[axes]\ninertia = [1, 2]\nspeed = [1000, 1100, 1200]\n"

# Body of the scene, text of published.csv, and what the message must name.
REFERENCES: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "too few rows": (TWO_DESIGNS, "delta\n0.1\n", ("1 row ", "2 designs")),
    "too many rows": (TWO_DESIGNS, "delta\n1\n2\n3\n", ("3 rows", "2 designs")),
    "label out of order": (TWO_DESIGNS, "case,delta\nb,1\na,2\n", ("line 2", "case = b", "'a'")),
    "value out of order": (
        TWO_DESIGNS,
        "inertia,delta\n1,1\n3,2\n",
        ("line 3", "inertia = 3", "2"),
    ),
    "no quantity": (TWO_DESIGNS, "case\na\nb\n", ("no column for a quantity",)),
    "unknown column": (TWO_DESIGNS, "delat\n1\n2\n", ("delat", "did you mean 'delta'")),
    "not a number": (TWO_DESIGNS, "delta\n1\nx\n", ("line 3", "delta", "'x'", "blank")),
    "labels of none": (AXES, "case,inertia,delta\na,1,1\n", ("case", "no such labels")),
    "axis not there": (AXES, "inertia,delta\n1,1\n3,2\n", ("line 3", "inertia = 3", "1, 2")),
    "no axis column": (TWO_AXES, "delta\n1\n2\n", ("2 rows", "inertia", "speed")),
    "point twice": (AXES, "inertia,delta\n1,1\n1,2\n", ("line 3", "line 2")),
    "other setting": (AXES, "inertia,speed,delta\n1,1300,1\n", ("line 2", "speed = 1300", "1200")),
    "other word": (
        '[solver]\nmethod = ["newton", "auto"]\n',
        "method,delta\nthesis,1\n",
        ("line 2", "method = 'thesis'", "newton"),
    ),
    "row fits no design": (
        "[axes]\nspeed = [1000, 1100]\n" + TWO_DESIGNS,
        "speed,case,delta\n1000,c,1\n",
        ("line 2", "matches 0", "case"),
    ),
}


@pytest.mark.parametrize("case", REFERENCES)
def test_reference_is_refused(case: str, tmp_path: Path) -> None:
    body, text, fragments = REFERENCES[case]
    tmp_path.joinpath("published.csv").write_text(text)
    refused(
        tmp_path,
        scene(body + '[reference]\nfile = "published.csv"'),
        ("published.csv", *fragments),
    )


# --- the command's own arguments ----------------------------------------------------------------


def one_line(result: click.testing.Result, *fragments: str) -> None:
    assert result.exit_code == 2, result.output
    assert result.stderr.count("\n") == 1
    assert "Traceback" not in result.output
    for fragment in fragments:
        assert fragment in result.stderr


@pytest.mark.parametrize("command", ["run", "plan"])
def test_missing_scene(command: str, tmp_path: Path) -> None:
    more = ["-o", tmp_path / "out.nc"] if command == "run" else []
    one_line(invoke(command, "thesiss", *more), "thesiss", "did you mean 'thesis'", "no such file")
    one_line(invoke(command, tmp_path, *more), str(tmp_path), "cannot be read")
    one_line(invoke(command, tmp_path / "a.toml", *more), "a.toml", "no such file")
    assert list(tmp_path.iterdir()) == []


def test_scene_that_is_no_text(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(b"\xff\xfe\x00")
    one_line(invoke("plan", path), "scene.toml", "not a text file")


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
    one_line(invoke("run", "first", "-o", existing / "x.nc"), "x.nc", "cannot be written")
    one_line(invoke("run", "first", "-o", "/proc/nowhere/x.nc"), "x.nc", "cannot be written")
    one_line(invoke("run", "first", "-o", tmp_path / ("x" * 300)), "cannot be written")
    assert list(tmp_path.iterdir()) == [existing]


def test_a_scene_does_not_overwrite_itself(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(scene())
    one_line(invoke("run", path, "-o", path, "--overwrite"), "scene itself")
    assert path.read_text() == scene()


@pytest.mark.parametrize("command", ["plot", "info"])
def test_no_archive(command: str, tmp_path: Path) -> None:
    text = tmp_path / "text.nc"
    text.write_text("this is no netCDF file")
    one_line(invoke(command, tmp_path / "none.nc"), "none.nc", "no such file")
    one_line(invoke(command, "a" * 5000), "no such file")
    one_line(invoke(command, text), "text.nc", "not a netCDF archive")
    one_line(invoke(command, tmp_path), "not a file")
    foreign = tmp_path / "foreign.nc"
    xr.Dataset({"a": ("x", [1.0, 2.0])}).to_netcdf(foreign, engine="netcdf4")
    one_line(invoke(command, foreign), "foreign.nc", "not an archive")
    short = tmp_path / "short.nc"
    short.write_bytes(foreign.read_bytes()[:1000])
    one_line(invoke(command, short), "short.nc", "not a netCDF archive")
    assert sorted(tmp_path.iterdir()) == [foreign, short, text]


def test_click_refuses_with_status_2(tmp_path: Path) -> None:
    out = tmp_path / "out.nc"
    assert invoke("run", "first").exit_code == 2
    assert invoke("run", "first", "-o", out, "--threads", "0").exit_code == 2
    assert invoke("run", "first", "-o", out, "--thread").exit_code == 2
    assert invoke("list", "quantity").exit_code == 2
    assert invoke("rnu").exit_code == 2
    assert list(tmp_path.iterdir()) == []


def test_new_refuses_an_existing_file(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text("mine")
    one_line(invoke("new", path), "scene.toml", "exists")
    one_line(invoke("new", path / "x"), "cannot be written")
    assert path.read_text() == "mine"


# --- from Python --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "fragment"),
    [
        (None, "scene = None"),
        (3, "scene = 3"),
        (["a"], "must be a path"),
        ({1: 2}, "key 1"),
        ({}, "engine"),
        ({"engine": "ntua", "output": {"quantities": ["delta"]}, "set": {"inertia": None}}, "None"),
        (
            {"engine": "ntua", "output": {"quantities": ["delta"]}, "set": {"inertia": 1j}},
            "inertia",
        ),
        (
            {
                "engine": "ntua",
                "output": {"quantities": ["delta"]},
                "axes": {"inertia": np.array([1.0, math.nan])},
            },
            "inertia, value 2 = nan",
        ),
        (
            {
                "engine": "ntua",
                "output": {"quantities": ["delta"]},
                "axes": {"inertia": np.array([True, False])},
            },
            "true",
        ),
    ],
)
def test_python_callers_get_the_same_error(given: Any, fragment: str) -> None:
    with pytest.raises(SceneError) as caught:
        read_scene(given)
    assert fragment in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("count", [3, 5000])
@pytest.mark.parametrize("table", ["axes", "designs"])
def test_masked_values_are_refused(table: str, count: int) -> None:
    values = np.ma.masked_array(np.linspace(1.0, 2.0, count), np.arange(count) == 2)
    scene = {"engine": "ntua", table: {"inertia": values}, "output": {"quantities": ["delta"]}}
    with pytest.raises(SceneError, match=rf"^scene: \[{table}\] inertia: value 3 is masked"):
        read_scene(scene)
    read_scene({**scene, table: {"inertia": values[:2]}})  # nothing of it is masked


def test_a_list_in_itself_is_refused() -> None:
    loop: list[Any] = []
    loop.append(loop)
    with pytest.raises(SceneError, match="nested"):
        read_scene(
            {"engine": "ntua", "axes": {"inertia": loop}, "output": {"quantities": ["delta"]}}
        )
