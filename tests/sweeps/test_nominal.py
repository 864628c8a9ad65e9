"""Changes from the nominal design, and units that are asked for in tables and descriptions."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sweeps
from sweeps.errors import SceneError
from sweeps.exploring.rows import rows
from tests.support.archives import run
from tests.support.commands import ok, refused

pytestmark = pytest.mark.compiled


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("nominal") / "grid.nc"
    scene: dict[str, Any] = {
        "engine": "ntua",  # its own values: 1200 rpm, 50 percent, 2 kg m2
        "axes": {"speed": [1000.0, 1200.0, 1500.0], "inertia": [1.0, 2.0]},
        "output": {"quantities": ["delta", "brake_power"]},
    }
    run(scene, path)
    return path


def test_nominal_is_the_engines_own_design(archive: Path) -> None:
    with sweeps.open(archive) as found:
        named = found.dyn.table(relative_to="nominal")
        given = found.dyn.table(relative_to={"speed": 1200.0, "inertia": 2.0})
    assert named.equals(given)
    own = named[(named["speed"] == 1200.0) & (named["inertia"] == 2.0)]
    assert own["delta"].item() == 0.0 and (named["delta"] != 0.0).sum() == 5
    assert "+" in ok("show", archive, "--relative-to", "nominal")
    # A grid without the engines value.
    with sweeps.open(archive) as found:
        part = found.isel(speed=[0, 2])
        with pytest.raises(SceneError, match="speed = 1200, the engine's own value, is not on"):
            rows(part, relative_to="nominal")
        without = found.assign_attrs(engine_values="{}")
        with pytest.raises(SceneError, match="the archive has no value of the engine for it"):
            rows(without, relative_to="nominal")


def test_nominal_is_the_design_of_this_name() -> None:
    found = sweeps.run(
        engine="ntua",
        designs={"case": ["light", "nominal"], "inertia": [1.0, 3.0]},
        output={"quantities": ["delta"]},
    )
    changes = rows(found, relative_to="nominal").table["delta"]
    assert changes[1] == 0.0 and changes[0] > 100.0
    with pytest.raises(SceneError, match="no design is named 'nominal'"):
        rows(found.isel(design=[0, 0]), relative_to="nominal")


def test_units_of_tables_and_descriptions(archive: Path, tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    ok("export", archive, "-o", table, "--units", "power=kW", "--head-units")
    plain = tmp_path / "plain.csv"
    ok("export", archive, "-o", plain, "--head-units")
    heads = table.read_text().splitlines()[0].split(",")
    assert "brake_power [kW]" in heads and "speed [rpm]" in heads
    column = heads.index("brake_power [kW]")
    kilowatts, watts = (
        np.loadtxt(path, delimiter=",", skiprows=1, usecols=column) for path in (table, plain)
    )
    assert kilowatts == pytest.approx(watts / 1000.0)
    assert " kW" in ok("info", archive, "--units", "power=kW") and " kW" not in ok("info", archive)
    wrong = ("export", archive, "-o", tmp_path / "x.csv", "--units", "power=kg")
    assert "unit 'kg': cannot be used for a quantity in W" in refused(*wrong)
    assert not (tmp_path / "x.csv").exists()
