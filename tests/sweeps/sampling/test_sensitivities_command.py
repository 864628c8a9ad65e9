"""The command `sensitivities` and its figure, and tornado diagrams."""

from pathlib import Path

import numpy as np
import pytest

import sweeps
from sweeps.view.figures.drawing import figure, figures
from sweeps.view.figures.options import options_of
from tests.support.archives import run
from tests.support.commands import ok, refused

pytestmark = pytest.mark.compiled

SCENE = {
    "engine": "ntua",
    "sample": {"method": "saltelli", "number": 256, "inertia": {"low": 1.0, "high": 3.0},
        "speed": {"low": 1000.0, "high": 1500.0}, "rod_length": {"low": 0.3, "high": 0.4}},
    "axes": {"load": [30.0, 50.0]},
    "output": {"quantities": ["delta"]},
}  # fmt: skip


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sensitivities") / "study.nc"
    run(SCENE, path)
    return path


def test_the_command_prints_and_writes(archive: Path, tmp_path: Path) -> None:
    output = tmp_path / "indices.nc"
    text = ok("sensitivities", archive, "-o", output)
    lines = [line.split() for line in text.splitlines()]
    assert ["at", "load", "=", "30", "%"] in lines and ["at", "load", "=", "50", "%"] in lines
    assert "Saltelli's design" in text
    with sweeps.open(output) as found, sweeps.open(archive) as dataset:
        expected = sweeps.sensitivities(dataset)
        assert np.array_equal(found.delta_total, expected.delta_total)
        first = next(line for line in lines if line and line[0] == "inertia")
        assert first[4] == f"{float(found.delta_total.isel(load=0).sel(parameter='inertia')):.3f}"
        drawn = figure(found, "sensitivities")
        lengths = sorted(bar.get_width() for bar in drawn.axes[0].patches)
        at = [float(v) for k in ("first", "total") for v in found[f"delta_{k}"].isel(load=0)]
        assert np.allclose(lengths, sorted(at))
        stems = set(figures(found, options_of(only="sensitivities")))
        assert stems == {"sensitivities_delta_load_30", "sensitivities_delta_load_50"}
    assert "holds Sobol' indices already" in refused("sensitivities", output)
    assert "exists; use --overwrite" in refused("sensitivities", archive, "-o", output)


def test_bars_are_the_elasticities_of_the_nominal_design() -> None:
    archive = sweeps.run(
        engine="ntua",
        set={"load": 50.0},
        axes={"speed": [1200.0, 1500.0]},
        output={"quantities": ["delta_elasticity"]},
    )
    drawn = figure(archive, "tornado")
    (panel,) = drawn.axes
    lengths = np.array([bar.get_width() for bar in panel.patches])
    values = archive.delta_elasticity.sel(speed=1200.0).values
    largest = values[np.argsort(-np.abs(np.nan_to_num(values)))]
    assert np.array_equal(lengths, largest[: lengths.size])
    assert lengths.size >= 5 and np.abs(lengths[-1]) >= 1e-3 * np.abs(lengths[0])
    labels = [text.get_text().replace("\n", " ") for text in panel.get_yticklabels()]
    assert labels[0] in ("Cylinder bore", "Nominal crank speed")
    both = {
        line.get_marker(): line.get_xdata() for line in panel.lines if line.get_marker() in "<>"
    }
    at_row = archive.sel(speed=1200.0, parameter="load")
    assert both["<"] == pytest.approx([float(at_row.delta_elasticity_below)])
    assert both[">"] == pytest.approx([float(at_row.delta_elasticity_above)])
    assert "in % for 1 % of the parameter" in panel.get_xlabel()
