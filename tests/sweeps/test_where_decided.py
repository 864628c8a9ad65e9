"""Figures and the explorer begin at the point that decides the verdict of a report."""

import base64
import json
import re
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.text import Text

import sweeps
from sweeps.view.figures.drawing import figures
from sweeps.view.figures.options import options_of
from sweeps.view.figures.study import study_of
from tests.support.reports import any_archive

pytestmark = pytest.mark.compiled

QUIET = {"silenced_warnings": ["all"]}
AXES = {"inertia": [2.0, 6.0, 12.0], "load": [50.0, 75.0, 90.0], "misfire": [0, 1, 2],
        "speed": [1500.0, 1800.0, 2000.0]}  # fmt: skip


@pytest.fixture(scope="module")
def generator() -> xr.Dataset:
    return sweeps.run(
        engine="ntua", set={"cylinders": 6}, axes=AXES, output={"quantities": ["delta", "omega"]},
        **QUIET,
    )  # fmt: skip


def data_of(archive: xr.Dataset, folder: Path, **options: Any) -> tuple[dict[str, Any], str]:
    page = sweeps.report(archive, folder / "report.html", overwrite=True, **options).read_text()
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    assert found is not None
    return json.loads(found[1]), page


def test_the_lightest_wheel_that_holds_at_its_worst_point(
    generator: xr.Dataset, tmp_path: Path
) -> None:
    limit = float(generator["delta"].max(["load", "misfire", "speed"])[1]) * 1.01
    data, page = data_of(generator, tmp_path, target=f"delta <= {limit}")
    worst = generator["delta"].isel(inertia=1)
    at = np.unravel_index(int(np.argmax(worst.values)), worst.shape)
    expected = {"inertia": 1, **dict(zip(map(str, worst.dims), map(int, at), strict=True))}
    assert {d: data["start"][d] for d in AXES} == expected
    assert set(data["decides"]) == {*AXES}
    assert "It begins where the verdict is decided: inertia = 6 kg m²" in page


def test_where_none_holds_it_is_the_nearest_and_without_a_verdict_the_middle(
    generator: xr.Dataset, tmp_path: Path
) -> None:
    data, _ = data_of(generator, tmp_path, target="delta <= 1/100000")
    assert data["start"]["inertia"] == 2 and data["start"]["misfire"] > 0
    data, page = data_of(generator, tmp_path)
    assert data["decides"] == [] and "where the verdict" not in page.split("<script")[0]
    assert data["start"] == {"inertia": 1, "load": 1, "misfire": 0, "speed": 1, "crank_angle": 0}


def test_of_a_thinned_axis_the_point_is_kept(tmp_path: Path) -> None:
    archive = sweeps.run(
        engine="ntua", axes={"load": [50.0, 90.0], "speed": np.linspace(1200.0, 1800.0, 401),
                             "inertia": np.linspace(5.0, 20.0, 201)},
        output={"quantities": ["delta"]}, **QUIET,
    )  # fmt: skip
    limit = float(archive["delta"].max(["load", "speed"])[77])
    data, page = data_of(archive, tmp_path, target=f"delta <= {limit!r}", limit=1.6e6)
    assert f"inertia = {float(archive['inertia'][77]):.4g} kg" in page
    assert data["axes"]["inertia"]["count"] < 201
    values = np.frombuffer(base64.b64decode(data["columns"]["inertia"]["values"]), "<f8")
    assert values[data["start"]["inertia"]] == float(archive["inertia"][77])


def test_most_inertia_and_shafts_decide_too(tmp_path: Path) -> None:
    required = sweeps.run(
        engine="ntua", set={"cylinders": 6, "wanted_delta": 0.02},
        axes={"load": [50.0, 90.0], "misfire": [0, 1], "speed": [1500.0, 1800.0, 2000.0]},
        output={"quantities": ["inertia_required"]}, **QUIET,
    )  # fmt: skip
    data, _ = data_of(required, tmp_path)
    most = required["inertia_required"]
    at = np.unravel_index(int(np.nanargmax(most.values)), most.shape)
    assert data["start"] == dict(zip(map(str, most.dims), map(int, at), strict=True))


def test_of_a_shaft_the_resonance_between_two_speeds_decides(tmp_path: Path) -> None:
    """The stress is above its limit at 2168 rpm alone, of which 2000 rpm is the nearest speed."""
    speeds = [1000.0, 1500.0, 2000.0, 2500.0]
    shaft = sweeps.run(
        engine="diesel_105x137", shaft="diesel_105x137", set={"shaft_stress_limit_8": 58.0},
        axes={"speed": speeds, "misfire": [0, 4]},
        output={"quantities": ["shaft_stress_over_limit"]}, **QUIET,
    )  # fmt: skip
    data, page = data_of(shaft, tmp_path)
    assert "Above the limit in" in page
    expected = {"speed": 2, "misfire": 1, "shaft": 7}
    assert {d: data["start"][d] for d in expected} == expected


@pytest.mark.parametrize(
    ("target", "places"),
    [("delta <= 1/50", {"load": 90.0, "misfire": 1.0, "speed": 1500.0}), ("delta=1/50", None),
     ("delta >= 1/50", {"misfire": 0.0}), ("omega_max=160", {})],
)  # fmt: skip
def test_figures_stand_at_the_worst_of_the_default_design(
    generator: xr.Dataset, target: str, places: dict[str, float] | None
) -> None:
    archive = generator.assign(omega_max=generator["omega"].max("crank_angle"))
    view = study_of(archive, {}, options_of(target=target)).view
    part = archive["delta"].sel(inertia=6.0)
    worst = part.min() if ">" in target else part.max()
    if places == {}:  # Whether more or less of it is wanted is not said
        assert view.worst == {}
        return
    assert float(part.sel(view.worst)) == float(worst)
    assert (places or {}).items() <= view.worst.items()
    options = options_of(target=target, only="numbers", quantities="delta")
    drawn = figures(archive, options).values()
    assert any("(worst)" in text.get_text() for one in drawn for text in one.findobj(Text))


def test_any_archive_still_has_its_report(tmp_path: Path) -> None:
    for seed in range(5):
        data_of(any_archive(Random(seed)), tmp_path)
