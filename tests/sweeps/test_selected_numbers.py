"""Numbers of axes in options: with units, and without them the same in all commands."""

from pathlib import Path

import numpy as np
import pytest

import sweeps
from sweeps.base.errors import SceneError
from tests.support.commands import ok, refused

BORES = [0.08, 0.1, 0.12]


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("select") / "a.nc"
    sweeps.stream(
        {"engine": "ntua", "axes": {"bore": BORES, "speed": [1200, 1500, 1800], "misfire": [0, 1]},
         "set": {"inertia": 12, "load": 50}, "output": {"quantities": ["delta", "imep"]},
         "silenced_warnings": ["all"]}, made,
    )  # fmt: skip
    return made


@pytest.mark.parametrize("bore", ["0.1", "100 mm", "1/10", "10cm"])
def test_a_number_means_the_same_in_every_command(bore: str, path: Path, tmp_path: Path) -> None:
    """Figures and tables show mm; archives, and numbers without a unit, have m."""
    with sweeps.open(path) as archive:
        right = archive.isel(bore=1, speed=1, misfire=0)
        expected, bore_there = float(right["delta"]), float(right["bore"])
        assert float(sweeps.nearest(archive, bore=bore)["bore"]) == bore_there
        drawn = archive.dyn.plot("numbers", select={"bore": bore}, quantities="delta")
        assert drawn
    select = ("--select", f"bore={bore},speed=157.1 rad/s,misfire=none")
    shown = ok("show", path, *select, "--quantities", "delta")
    assert f"{expected:.4g}" in shown and "at bore = 0.1000, speed = 1500, misfire = 0" in shown
    ok("export", path, "-o", tmp_path / "t.csv", *select, "--quantities", "delta", "--digits",
       "all")  # fmt: skip
    last = (tmp_path / "t.csv").read_text(encoding="utf-8").splitlines()[-1]
    assert float(last.split(",")[-1]) == expected
    best = ok("best", path, "--most", "delta", "--select", f"bore={bore},misfire=none",
              "--at-every", "speed")  # fmt: skip
    assert "bore = 100 mm" in best
    figures = tmp_path / "figures"
    assert "delta" in ok("plot", path, "-o", figures, "--only", "numbers", "--select",
                         f"bore={bore},misfire=none")  # fmt: skip
    assert "numbers" in ok("plot", path, "--list", *select[:1], f"bore={bore}", "--units",
                           "bore=in")  # fmt: skip


@pytest.mark.parametrize(
    ("select", "said"),
    [
        ("bore=84", "bore = 84 m: outside the axis, 0.08 to 0.12 m"),
        ("bore=10 rpm", "bore = '10 rpm': must be a number in m, or a number with a unit"),
        ("speed=fast", "speed = 'fast': must be a number in rpm"),
        ("speed=nan", "speed = 'nan': must be a number in rpm"),
        ("misfire=all", "misfire = 'all': must be a number"),
    ],
)
def test_a_refused_number_names_the_unit(select: str, said: str, path: Path) -> None:
    assert said in refused("show", path, "--select", select)
    assert said in refused("best", path, "--least", "delta", "--select", select)
    assert said.partition("m: ")[0] in refused("plot", path, "--select", select).replace(
        "84000 mm", "84 m"
    )


def test_numbers_of_numpy_are_numbers(path: Path) -> None:
    with sweeps.open(path) as archive:
        assert float(sweeps.nearest(archive, speed=np.int64(1500))["speed"]) == 1500.0
        assert float(sweeps.nearest(archive, bore=np.float32(0.1))["bore"]) == 0.1
        with pytest.raises(SceneError, match="bore = true: must be a number in m"):
            sweeps.nearest(archive, bore=True)


def test_new_points_have_units(path: Path, tmp_path: Path) -> None:
    longer = tmp_path / "longer.nc"
    longer.write_bytes(path.read_bytes())
    said = refused("extend", longer, "--axis", "bore=90, 110 rpm")
    assert "--axis bore = '90 rpm': must be a number in m" in said
    ok("extend", longer, "--axis", "bore=90, 110 mm")
    with sweeps.open(longer) as archive:
        assert archive["bore"].values == pytest.approx([0.08, 0.09, 0.1, 0.11, 0.12], rel=1e-12)


def test_hints_name_the_quantity_and_the_command_that_searches(path: Path, tmp_path: Path) -> None:
    said = refused("report", path, "-o", tmp_path / "r.html", "--units", "delta=rpm")
    assert "delta: unit 'rpm': cannot be used for a quantity in 1" in said
    said = refused("best", path, "--least", "inertia", "--at-every", "speed,misfire")
    assert "'inertia': not in the archive" in said and "`engine-dyn optimise` searches it" in said
