"""Two archives in one chart: what is put beside each other, and what is drawn."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from sweeps.errors import SceneError
from sweeps.exploring.beside import beside
from sweeps.figures.drawing import figures
from sweeps.figures.options import options_of
from tests.support.archives import run
from tests.support.commands import invoke, ok
from tests.support.figures import variable, words
from tests.support.scenes import TO_JOIN

ANGLES = np.arange(-360.0, 360.0, 5.0)
PHI = np.radians(ANGLES)


def study(factor: float = 1.0, inertia: Any = (1.0, 2.0, 4.0), **given: float) -> xr.Dataset:
    heavy = np.asarray(inertia)
    return xr.Dataset(
        {
            "delta": variable("inertia", factor * 0.1 / heavy, "fluctuation", "1"),
            "torque": variable("crank_angle", 200.0 * factor * np.sin(PHI), "torque", "N m"),
            "torque_order": variable("order", factor * np.array([8.0, 4.0]), "orders", "N m"),
            "imep": variable((), 5.0 * factor, "mean pressure", "bar"),
            "fmep": variable((), 1.0, "friction", "bar"),
        },
        coords={
            "inertia": variable("inertia", heavy, "moment of inertia", "kg m2"),
            "order": variable("order", [0.5, 1.0], "order", "1"),
            "crank_angle": variable("crank_angle", ANGLES, "crank angle", "degree"),
        },
        attrs={"engine_title": "Engine of a test", "parameters": json.dumps(given)},
    )


def drawn(both: xr.Dataset) -> dict[str, Any]:
    return figures(both, options_of(only="compared"))


def test_both_archives_and_their_difference_are_drawn() -> None:
    plates = drawn(beside(study(), study(1.05), ("old", "new")))
    assert set(plates) == {
        "compared_delta_inertia", "compared_torque", "compared_torque_order", "compared_numbers",
    }  # fmt: skip
    upper, lower = plates["compared_delta_inertia"].axes
    one, two = (line.get_ydata() for line in upper.lines)
    assert one == pytest.approx([0.1, 0.05, 0.025])
    assert two == pytest.approx([0.105, 0.0525, 0.02625])
    assert lower.lines[0].get_ydata() == pytest.approx([5.0, 5.0, 5.0])
    said = words(plates["compared_delta_inertia"])
    assert "Fluctuation: old and new" in said and "difference: new less old" in said
    # Curves through zero differ by a share of their largest value.
    upper, lower = plates["compared_torque"].axes
    one, two = (line.get_ydata()[:-1] for line in upper.lines[:2])
    assert one == pytest.approx(200.0 * np.sin(PHI)) and two == pytest.approx(1.05 * one)
    assert lower.lines[0].get_ydata()[:-1] == pytest.approx(5.0 * np.sin(PHI))
    assert lower.get_ylabel().replace("\n", " ") == "Difference (% of the largest)"
    upper, lower = plates["compared_torque_order"].axes
    assert [bar.get_height() for bar in upper.patches] == [8.0, 4.0, 8.4, 4.2]
    assert [bar.get_height() for bar in lower.patches] == pytest.approx(
        [5.0, 2.5]
    )  # % of the largest
    (bar,) = plates["compared_numbers"].axes[0].patches  # friction is the same
    assert bar.get_width() == pytest.approx(5.0)
    assert "5 → 5.25 bar (+5 %)" in words(plates["compared_numbers"])


def test_only_what_both_have_is_compared() -> None:
    plates = drawn(beside(study(), study(1.05, inertia=(0.5, 1.0, 4.0))))
    line = plates["compared_delta_inertia"].axes[0].lines[1]
    assert list(line.get_xdata()) == [1.0, 4.0]
    assert line.get_ydata() == pytest.approx([0.105, 0.02625])
    # Where one has no axis, the other is cut at its value.
    single = study(1.05).isel(inertia=1).drop_vars("inertia")
    single.attrs["parameters"] = json.dumps({"inertia": 2.0})
    both = beside(study(), single)
    assert float(both["delta"]) == pytest.approx(0.05)
    assert float(both["delta_compared"]) == pytest.approx(0.0525)
    with pytest.raises(SceneError, match="no common quantity"):
        beside(study()[["delta"]], study()[["imep"]])


@pytest.mark.compiled
def test_the_command_draws_what_differs(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(TO_JOIN)
    run(scene, tmp_path / "a.nc")
    with xr.open_dataset(tmp_path / "a.nc") as opened:
        other = opened.load()
    other["delta"] = other["delta"] * 1.02
    other.to_netcdf(tmp_path / "b.nc")
    text = ok("compare", tmp_path / "a.nc", tmp_path / "b.nc", "--figures", tmp_path / "out")
    paths = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert paths and all(name.startswith("compared_delta_") for name in paths)
    assert all(name in text for name in paths)
    same = invoke("compare", tmp_path / "a.nc", tmp_path / "a.nc", "--figures", tmp_path / "none")
    assert same.exit_code == 0
    assert "nothing to draw: both archives have the same values" in same.output
