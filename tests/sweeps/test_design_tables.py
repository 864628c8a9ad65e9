"""Tables of designs from files: the same columns whatever the format, and what is refused."""

from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import sweeps
from sweeps.base import checks
from sweeps.base.errors import SceneError, one_line
from sweeps.base.files.csv_tables import find_header, rows_below
from sweeps.running.archive import netcdf
from sweeps.scene.design_files import design_files
from sweeps.scene.design_files.design_files import read_designs
from sweeps.scene.plan import forecast
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from tests.support import commands

COLUMNS = {
    "inertia": [1.5, 2.0, 0.1 + 0.2], "speed": [1000, 1100, 1e3 / 3.0], "cylinders": [1, 2, 4],
}  # fmt: skip
CASES = ["a", "b c", "ünder"]


def write(path: Path, columns: dict[str, Any], units: dict[str, str] | None = None) -> Path:
    """A table in the format of its name."""
    if path.suffix == ".parquet":
        fields = [
            pa.field(key, pa.array(values).type, metadata={"units": (units or {}).get(key, "")})
            if key in (units or {})
            else pa.field(key, pa.array(values).type)
            for key, values in columns.items()
        ]
        pq.write_table(pa.table([pa.array(v) for v in columns.values()], pa.schema(fields)), path)
    elif path.suffix in (".nc", ".nc4"):
        data = {key: ("row", np.array(values)) for key, values in columns.items()}
        dataset = xr.Dataset(data)
        for key, unit in (units or {}).items():
            dataset[key].attrs["units"] = unit
        dataset.to_netcdf(path, engine="netcdf4")
    elif path.suffix == ".xlsx":
        book = openpyxl.Workbook(write_only=True)
        sheet = book.create_sheet("designs")
        sheet.append(list(columns))
        if units:
            sheet.append([units.get(key) for key in columns])
        for row in zip(*columns.values(), strict=True):
            sheet.append([None if value is None or value != value else value for value in row])
        book.save(path)
    else:
        rows = zip(*columns.values(), strict=True)
        lines = [",".join(columns), *(",".join(map(str, row)) for row in rows)]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def refused(path: Path, *fragments: str) -> None:
    """As a Python function and as a command: one line, status 2."""
    scene = path.parent / "scene.toml"
    scene.write_text(
        f'engine = "ntua"\n[designs]\nfile = "{path.name}"\n[output]\nquantities = ["delta"]\n'
    )
    with pytest.raises(SceneError) as caught:
        read_scene(scene)
    told = commands.refused("plan", scene)
    for fragment in (path.name, *fragments):
        assert fragment in str(caught.value)
        assert fragment in told


FORMATS = ["table.csv", "table.TXT", "table.nc", "table.nc4", "table.parquet", "table.xlsx"]


@pytest.mark.parametrize("name", FORMATS)
def test_the_same_columns_from_every_format(name: str, tmp_path: Path) -> None:
    path = write(tmp_path / name, {"case": CASES, **COLUMNS})
    columns, labels, _ = read_designs(path, name)
    assert labels == {"case": tuple(CASES)}
    assert list(columns) == list(COLUMNS)
    for key, values in COLUMNS.items():
        # Excel has 15 digits.
        precision = 1e-15 if name == "table.xlsx" else 0.0
        assert_allclose(columns[key], np.array(values, dtype=float), rtol=precision)
        assert columns[key].dtype == np.float64


@pytest.mark.parametrize("name", ["table.csv", "table.nc", "table.parquet"])
def test_tables_longer_than_a_piece(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(design_files, "PIECE", 100)
    monkeypatch.setattr(design_files, "ROWS", 7)
    values = np.linspace(1.0, 2.0, 100)
    path = write(tmp_path / name, {"inertia": values, "load": values * 40.0})
    columns, *_ = read_designs(path, name)
    assert_array_equal(columns["inertia"], values)
    assert_array_equal(columns["load"], values * 40.0)
    values[90] = -1.0
    path = write(tmp_path / name, {"inertia": values})
    where = "line 92" if name.endswith("csv") else "row 91"
    refused(path, where, "inertia = -1", "above 0")


def test_an_archive_gives_its_designs_again(tmp_path: Path) -> None:
    scene = {
        "engine": "ntua",
        "designs": {"case": ["x", "y"], "inertia": [1.5, 2.5], "load": [50, 60]},
        "axes": {"speed": [1000, 1200]},
        "output": {"quantities": ["delta", "mean_piston_speed", "imep"]},
    }
    netcdf.write(sweeps.run(scene), tmp_path / "first.nc")
    again = read_scene({**scene, "designs": {"file": str(tmp_path / "first.nc")}})
    assert again.labels == {"case": ("x", "y")}
    assert {key: values.tolist() for key, values in again.designs.items()} == {
        "inertia": [1.5, 2.5],
        "load": [50.0, 60.0],
    }


@pytest.mark.parametrize("name", ["table.nc", "table.parquet", "table.xlsx"])
def test_units_are_those_of_scenes_or_refused(name: str, tmp_path: Path) -> None:
    columns = {"inertia": [1.0, 2.0], "start_speed": [100.0, 101.0], "load": [50.0, 60.0]}
    units = {"inertia": "kg m^2", "start_speed": "rad/s", "load": "%"}
    path = write(tmp_path / name, columns, units)
    assert list(read_designs(path, name)[0]) == list(columns)
    write(path, {"stroke": [180.0]}, {"stroke": "mm"})
    refused(path, "stroke", "'mm'", "must be 'm'")


@pytest.mark.parametrize("name", ["table.csv", "table.nc", "table.parquet", "table.xlsx"])
def test_what_every_format_refuses(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    refused(path, "no such file")
    path.mkdir()
    refused(path, "cannot be read")
    path.rmdir()
    kind = "not a " if name != "table.csv" else "not a text file"
    path.write_bytes(b"\x89\xff\x00\x01 neither" * 10)
    refused(path, kind)
    write(path, {"intertia": [1.0]})
    refused(path, "intertia", "did you mean 'inertia'")
    write(path, {"case": ["a"]})
    with pytest.raises(SceneError, match="no column for a parameter"):
        read_scene(
            {"engine": "ntua", "designs": {"file": str(path)}, "output": {"quantities": ["delta"]}}
        )
    write(path, {"inertia": ["one", "two"]})
    refused(path, "inertia", "kg m2" if name == "table.xlsx" else "number")  # row 2 may be units
    write(path, {"inertia": [1.0, "two"] if name == "table.xlsx" else ["one", "two"]})
    refused(path, "inertia", "number")
    write(path, {"inertia": [1.0, 2.0], "cylinders": [1.0, 2.5]})
    refused(path, "2.5", "whole number", "line 3" if name == "table.csv" else "row 2")
    write(path, {"inertia": np.array([])})
    refused(path, "no rows")


@pytest.mark.parametrize("name", ["table.nc", "table.parquet", "table.xlsx"])
def test_missing_values_are_refused_with_their_row(name: str, tmp_path: Path) -> None:
    path = write(tmp_path / name, {"inertia": [1.0, 2.0, np.nan], "speed": [1e3, 1e3, 1e3]})
    refused(path, "row 3", "inertia", "missing")
    if name != "table.nc":
        write(path, {"inertia": [1.0, None, 2.0]})
    else:
        with netCDF4.Dataset(path, "w") as file:
            file.createDimension("n", 3)
            file.createVariable("inertia", "f8", ("n",))[0] = 1.0
    refused(path, "row 2", "inertia", "missing")


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("t.csv", {}), ("t.csv", {"head_units": True}), ("t.csv", {"quantities": "status"}),
        ("t.parquet", {}), ("t.xlsx", {}),
    ],
)  # fmt: skip
def test_what_export_writes_is_a_table_of_designs(
    name: str, options: dict[str, Any], tmp_path: Path
) -> None:
    """Parameters come back, and results are left out."""
    scene: dict[str, Any] = {
        "engine": "ntua",
        "designs": {"case": ["x", "y, z"], "inertia": [1.5, 0.1 + 0.2], "load": [50, 60]},
        "axes": {"speed": [1000, 1200], "misfire": [0, 1]},
        "output": {"quantities": ["delta", "omega_max", "imep"]},
        "silenced_warnings": ["all"],
    }
    found = sweeps.run(scene)
    assert np.isnan(found["delta"]).any()  # A blank field
    rows = sweeps.export(found, tmp_path / name, **options).rows
    columns, labels, _ = read_designs(tmp_path / name, name)
    assert sorted(columns) == ["inertia", "load", "misfire", "speed"]
    assert len(labels["case"]) == rows == columns["speed"].size == 8
    values = {n: found[n].broadcast_like(found["delta"]).values.ravel() for n in columns}
    digits = 1e-15 if name == "t.xlsx" else 0.0  # Excel has 15 digits
    for key, value in values.items():
        assert_allclose(columns[key], value, rtol=digits)
    again = sweeps.run({**scene, "designs": {"file": str(tmp_path / name)}, "axes": {}})
    assert_allclose(again["delta"].values, found["delta"].values.ravel(), rtol=10.0 * digits)


@pytest.mark.parametrize("slow", [False, True])
def test_heads_of_csv_files_may_have_other_units(
    slow: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(design_files, "PIECE", 50)
    heads = ["speed [rad/s]", "stroke [mm]", "inertia[kg m2]", "held_power [kW]", "load [%]",
             "reciprocating_mass [g]", "torque_mean [N m]", "status"]  # fmt: skip
    row = "100,180,2.5,30,50,6670,12,converged"
    rows = [row] * 20 + (["# a comment"] if slow else [])
    path = tmp_path / "t.csv"
    path.write_text("\n".join([",".join(heads), *rows, row]) + "\n", encoding="utf-8")
    columns, *_ = read_designs(path, "t.csv")
    expected = {"speed": 100.0 * 30.0 / np.pi, "stroke": 0.18, "inertia": 2.5, "held_power": 3e4,
                "load": 50.0, "reciprocating_mass": 6.67}  # fmt: skip
    assert list(columns) == list(expected)
    for key, value in expected.items():
        assert_allclose(columns[key], np.full(21, value), rtol=1e-15)


@pytest.mark.parametrize(
    ("head", "says"),
    [
        ("speed [furlong]", "speed: units are 'furlong'; must be 'rpm', or another of its kind"),
        ("speed [bar]", "speed: units are 'bar'; must be 'rpm', or another of its kind"),
        ("speed [9**9**9]", "speed: units are '9**9**9'; must be 'rpm', or another of its kind"),
        ("speed [degC]", "speed: units are 'degC'; must be 'rpm', or another of its kind"),
        ("speed [\u202e\x07]", "speed: units are"),
        ("crank_ratio [m]", "crank_ratio: units are 'm'; must be without a unit"),
        ("case [m]", "case: holds texts, which have no unit"),
        ("speeed [rpm]", "column speeed: unknown key; did you mean 'speed'?"),
        ("speed []", "column speed []: unknown key; did you mean 'speed'?"),
        (f"speed [{'x' * 1000}]", "unknown key"),
        ("inertia [g m2]", "two columns are inertia; each column has its own name"),
        ("held_power [kVA]", "held_power: units are 'kVA'; must be 'W', or another of its kind"),
        ("stroke [mm]", "line 3: stroke = -0.18: must be a finite number above 0 [m]"),
    ],
)
def test_heads_with_bad_units_are_refused_in_one_line(head: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(f"{head},inertia\n1,2\n-180,2\n", encoding="utf-8")
    refused(path, says)


def test_a_file_of_results_alone_has_no_parameter(tmp_path: Path) -> None:
    for text in ("delta\n0.1\n", "delta,status\n0.1,converged\n", "design,delta\n0,0.1\n"):
        (tmp_path / "t.csv").write_text(text, encoding="utf-8")
        scene = {"engine": "ntua", "designs": {"file": str(tmp_path / "t.csv")},
                 "output": {"quantities": ["delta"]}}  # fmt: skip
        with pytest.raises(SceneError, match=r"\[designs\] has no column for a parameter"):
            read_scene(scene)


FIELDS = st.one_of(
    st.floats(1e-3, 1e6).map(repr),
    st.sampled_from(
        ["", " 1.5 ", "1_000", "True", "true", "FALSE", "inf", "nan", "NA", "1e400", "0x10", "1d5",
         "5.", ".5", "+1", "-1", "1,2", '"1.5"', '"1,5"', "#", "1 # x", "\t2", "1e", "٣", "1\xa0",
         "1\x0b", "\x0c1", "1\r", "00012", "9" * 400, "1." + "0" * 400 + "1", "x\0y", '"'],
    ),
)  # fmt: skip


def carefully(text: str) -> Any:
    """Numbers of the columns by the careful reader alone, or its message."""
    try:
        found = find_header(text, "t")
        assert found is not None
        header, rest, line = found
        table = rows_below(header, rest, "t", line)
        if not table.rows:
            return "a header but no rows"
        columns = {}
        for key in header:
            if key == "case":
                columns[key] = [one_line(text) for text in table.texts(key)]
                continue
            columns[key] = table.numbers(key)
            for value, number in zip(columns[key], table.lines, strict=True):
                checks.check_range(value, f"t, line {number}: {key}", checks.PARAMETERS[key])
        return columns
    except SceneError as error:
        return str(error)


@given(
    header=st.sampled_from(["inertia", "inertia,load_offset", "case,inertia", "inertia,case"]),
    rows=st.lists(st.lists(FIELDS, min_size=1, max_size=2), min_size=1, max_size=4),
    end=st.sampled_from(["\n", "\r\n", "\n\n", "\n  \n"]),
)
def test_both_ways_read_the_same(
    tmp_path_factory: pytest.TempPathFactory, header: str, rows: list[list[str]], end: str
) -> None:
    text = header + end + end.join(",".join(row) for row in rows) + end
    path = tmp_path_factory.mktemp("csv") / "t.csv"
    path.write_bytes(text.encode())
    expected = carefully(text)
    try:
        columns, labels, _ = read_designs(path, "t")
    except SceneError as error:
        # Which of several faults is named first may differ: by column here, by line there.
        assert isinstance(expected, str), f"{error} for {text!r}"
    else:
        found = {
            **{k: v.tolist() for k, v in columns.items()},
            **{k: list(v) for k, v in labels.items()},
        }
        assert found == expected, repr(text)


def test_numbers_are_read_to_the_last_digit(tmp_path: Path) -> None:
    random = np.random.default_rng(5)
    values = np.exp(random.uniform(-69.0, 69.0, 20000))  # 1e-30 to 1e30
    texts = [repr(float(v)) for v in values]
    texts += [f"{v:.25e}" for v in values[:5000]] + ["9007199254740993", "2.2250738585072011e-29"]
    path = tmp_path / "table.csv"
    path.write_text("torque_factor\n" + "\n".join(texts) + "\n")
    columns, *_ = read_designs(path, "table.csv")
    assert_array_equal(columns["torque_factor"], [float(t) for t in texts])


def test_columns_of_results_are_named(tmp_path: Path) -> None:
    (tmp_path / "table.csv").write_text("inertia,delta,status\n1.0,0.01,0\n2.0,0.02,0\n")
    given = {"file": str(tmp_path / "table.csv")}
    scene = read_scene(engine="ntua", designs=given, output={"quantities": ["delta"]})
    assert (
        forecast.text(make_plan(scene)).count("[designs] file: results, left out: delta, status")
        == 1
    )
