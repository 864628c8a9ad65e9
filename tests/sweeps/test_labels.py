"""A label means itself, whatever number it looks like: in every command and function."""

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import pyuff
import xarray as xr

import sweeps
import sweeps.view.accessor
from sweeps.base.errors import SceneError
from sweeps.cli.main import main
from sweeps.decide.explore.rows import rows
from sweeps.decide.explore.torsion import QUANTITIES, excitation
from sweeps.running.archive.netcdf import write
from sweeps.view.figures.study import study_of
from tests.support.commands import ok, refused

pytestmark = pytest.mark.compiled

LABELS = ("110", "1", "-1", "1e3", "1000", "01", "1.0", "1/2", "nan", "#1", "2")
PATTERNS = ("110", "1", "10")
BOTH = [("case", label) for label in LABELS] + [("firing_pattern", word) for word in PATTERNS]


@pytest.fixture(scope="module")
def archive() -> xr.Dataset:
    return sweeps.run(
        engine="si_four_87x101",
        silenced_warnings=["all"],
        axes={"firing_pattern": list(PATTERNS)},
        designs={"case": list(LABELS), "inertia": [0.3 + 0.1 * i for i in range(len(LABELS))]},
        output={"quantities": ["delta", "omega", *QUANTITIES], "angle_step": 10,
                "highest_order": 2},
    )  # fmt: skip


@pytest.fixture(scope="module")
def path(archive: xr.Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("labels") / "labelled.nc"
    write(archive, path)
    return path


def expected(archive: xr.Dataset, name: str, label: str) -> xr.Dataset:
    """The part that has the label, found without any of our functions."""
    if name == "case":
        return archive.isel(design=LABELS.index(label))
    return archive.isel(firing_pattern=PATTERNS.index(label))


def one_design(name: str, label: str) -> dict[str, str]:
    return {"case": "1e3", "firing_pattern": "10", name: label}


def cut(archive: xr.Dataset, select: dict[str, str]) -> xr.Dataset:
    for name, label in select.items():
        archive = expected(archive, name, label)
    return archive


@pytest.mark.parametrize(("name", "label"), BOTH)
def test_functions_take_the_label_first(archive: xr.Dataset, name: str, label: str) -> None:
    right = expected(archive, name, label)
    xr.testing.assert_identical(sweeps.nearest(archive, **{name: label}), right)
    xr.testing.assert_identical(archive.dyn.nearest(**{name: label}), right)
    drawn = study_of(archive, {name: label}).view.data
    assert set(drawn["delta"].values.ravel()) == set(right["delta"].values.ravel())
    table = rows(archive, select={name: label}, quantities="delta", limit=99).table["delta"]
    np.testing.assert_array_equal(table, right["delta"].values.ravel())
    select = one_design(name, label)
    one = cut(archive, select)
    change = archive.dyn.table(quantities="delta", relative_to=select, limit=99)["delta"]
    np.testing.assert_allclose(
        change, 100.0 * (archive["delta"].values / one["delta"].item() - 1.0).ravel()
    )
    torque = one["throw_torque_order"].transpose("throw", "order").values
    taken = excitation(archive, [0, 1, 2, 3], **select)
    np.testing.assert_array_equal(taken.amplitude, torque)


@pytest.mark.parametrize(("name", "number", "label"), [
    ("case", 110, "110"), ("case", 1, "1"), ("case", 1000.0, "1000"), ("case", 1.0, "1.0"),
    ("firing_pattern", 1, "1"), ("firing_pattern", np.int64(10), "10"),
    ("firing_pattern", "#1", "110"), ("firing_pattern", "#3", "10"), ("case", "#1", "#1"),
    ("case", "#2", "1"),
])  # fmt: skip
def test_numbers_are_the_labels_written_so_and_positions_have_a_form_of_their_own(
    archive: xr.Dataset, name: str, number: Any, label: str
) -> None:
    right = expected(archive, name, label)
    xr.testing.assert_identical(sweeps.nearest(archive, **{name: number}), right)


@pytest.mark.parametrize("value", [0, 2, 3, 100, "=110", "1e0", "#0", "#4", "+1", True, 1.5])
def test_what_is_no_label_is_refused_and_not_offered_again(archive: xr.Dataset, value: Any) -> None:
    with pytest.raises(SceneError) as error:
        sweeps.nearest(archive, firing_pattern=value)
    assert f"did you mean '{value}'" not in str(error.value)
    with pytest.raises(SceneError):
        study_of(archive, {"firing_pattern": value})


def selects() -> set[str]:
    """Commands that take values of axes."""
    return {
        name
        for name, command in main.commands.items()
        if any("--select" in parameter.opts for parameter in command.params)
    }


@pytest.mark.parametrize(("name", "label"), BOTH)
def test_commands_take_the_label_first(
    path: Path, archive: xr.Dataset, name: str, label: str, tmp_path: Path
) -> None:
    assert selects() == {"show", "export", "plot", "best", "barred"}
    select = one_design(name, label)
    one = cut(archive, select)
    option = ",".join(f"{key}={value}" for key, value in select.items())
    told = ok("show", path, "--select", option, "--quantities", "delta")
    assert f"{float(one['delta']):.4g}" in told
    told = ok("show", path, "--relative-to", option, "--limit", "99", "--quantities", "delta")
    (base,) = [line.split() for line in told.splitlines() if line.split()[-1:] == ["0"]]
    assert (base[0], base[3]) == (select["firing_pattern"], select["case"])
    told = ok("best", path, "--least", "delta", "--select", option)
    assert f"{float(one['delta']):.4g}" in told
    ok("export", path, "--select", option, "--quantities", "omega", "-o", tmp_path / "o.csv")
    table = pd.read_csv(tmp_path / "o.csv")
    np.testing.assert_allclose(table["omega"], one["omega"].values, rtol=1e-9)  # ten digits
    ok("export", path, "--select", option, "--quantities", "omega", "-o", tmp_path / "o.uff")
    data = pyuff.UFF(str(tmp_path / "o.uff")).read_sets(0)
    np.testing.assert_allclose(data["data"], one["omega"].values, rtol=1e-6)


def test_other_formats_and_figures_take_the_label(
    path: Path, archive: xr.Dataset, tmp_path: Path
) -> None:
    option = "case=1,firing_pattern=1"
    one = cut(archive, {"case": "1", "firing_pattern": "1"})
    ok("export", path, "--select", option, "--quantities", "omega", "-o", tmp_path / "o.fmu")
    with zipfile.ZipFile(tmp_path / "o.fmu") as fmu:
        (inside,) = [n for n in fmu.namelist() if n.endswith("table.json")]
        curves = json.loads(fmu.read(inside))["curves"]
    np.testing.assert_allclose(curves["omega"]["values"], one["omega"].values)
    ok("export", path, "--select", option, "--quantities", "delta", "-o", tmp_path / "o.xlsx")
    table = pd.read_excel(tmp_path / "o.xlsx", sheet_name="results", skiprows=[1])
    np.testing.assert_allclose(table["delta"], float(one["delta"]))
    ok("plot", path, "--select", option, "--only", "curves", "-o", tmp_path / "figures")
    line = refused("plot", path, "--select", "firing_pattern=2", "-o", tmp_path / "more")
    assert "unknown" in line


def test_labels_of_two_archives_meet_by_what_is_written(archive: xr.Dataset) -> None:
    from sweeps.decide.explore.compare import compare

    turned = archive.isel(firing_pattern=[1, 2], design=slice(None, None, -1))
    found = compare(archive, turned)
    assert all(difference.differing == 0 for difference in found.quantities)
    assert any(difference.count for difference in found.quantities)
