"""Reports: one HTML file, its numbers, its limits, hostile archives."""

import base64
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal

import sweeps
from sweeps.base.errors import SceneError
from sweeps.base.numbers import number_text
from sweeps.view.report.model_limits import features_of, model_limits
from sweeps.view.report.page import page
from tests.support.commands import ok, refused
from tests.support.reports import SCENE, alike, hostile, large

pytestmark = pytest.mark.compiled


class Tags(HTMLParser):
    """Elements of a page with their attributes, and its text."""

    def __init__(self, written: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.feed(written)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.words.append(data)


def data_of(written: str) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', written, re.S)
    assert found is not None
    return dict(json.loads(found[1]))


def numbers_of(quantity: dict[str, Any]) -> np.ndarray:
    kind = {"f4": "<f4", "u1": "u1"}[quantity["type"]]
    return np.frombuffer(base64.b64decode(quantity["data"]), kind).reshape(quantity["shape"])


def section(written: str, key: str) -> str:
    return written.partition(f'<section id="{key}">')[2].partition("</section>")[0]


@pytest.fixture(scope="module")
def archive() -> xr.Dataset:
    return sweeps.run(SCENE)


@pytest.fixture(scope="module")
def written(archive: xr.Dataset) -> str:
    return page(archive)


def test_a_report_has_every_section_and_number_and_asks_for_nothing(
    written: str, archive: xr.Dataset
) -> None:
    assert not [a for t, a in Tags(written).found if t in ("img", "iframe", "object", "base")]
    links = [a.get(k) or "" for _, a in Tags(written).found for k in ("src", "href", "action")]
    assert all(link.startswith(("#", "data:,")) for link in links if link)
    assert "default-src 'none'" in written
    keys = [a["id"] for t, a in Tags(written).found if t == "section"]
    assert keys == [
        "computed", "results", "pictures", "explore", "outcomes", "warnings", "assumptions",
        "limits", "provenance", "cite",
    ]  # fmt: skip
    assert "Single-cylinder four-stroke diesel" in section(written, "computed")
    assert "load_offset" in section(written, "assumptions")
    assert "without torsional vibration" in section(written, "limits")
    assert "Kakaitsas" in section(written, "cite")
    assert "All values of the archive are in this page" in section(written, "explore")
    found = data_of(written)
    quantities = found["quantities"]
    assert set(quantities) == {str(n) for n in archive.data_vars}
    assert_allclose(numbers_of(quantities["delta"]), archive.delta, rtol=1e-7)
    assert_allclose(numbers_of(quantities["omega"]), archive.omega * 30.0 / np.pi, rtol=1e-6)
    assert quantities["omega"]["unit"] == "rpm"
    assert_array_equal(numbers_of(quantities["status"]), archive.status)
    inertia = np.frombuffer(base64.b64decode(found["columns"]["inertia"]["values"]), "<f8")
    assert_array_equal(inertia, archive.inertia)
    drawn = {(f["kind"], f["x"]) for f in found["figures"]}
    assert drawn == {("lines", "inertia"), ("map", "inertia"), ("lines", "crank_angle"),
                     ("lines", "load")}  # fmt: skip
    assert set(found["charts"]) == {"lines", "map"}  # Bokeh's figures, for all of these
    lost = int((archive.status == 1).sum())
    assert 0 < lost < archive.status.size
    told = section(written, "outcomes")
    assert f'<td>stalled</td><td class="number">{lost}</td>' in told
    assert "<td>inertia</td><td>0.05 kg m²</td><td>0.05 kg m² to 5 kg m²</td>" in told
    assert f"<td>0.05 kg m²: {lost} of 3</td>" in told
    assert told.count("<td>stalled</td>") == 1 + lost


@pytest.mark.parametrize("inertias", [2, 5], ids=["few", "many"])
def test_uncertain_numbers_have_their_bands(inertias: int) -> None:
    archive = sweeps.run(
        engine="b112",
        axes={"inertia": np.linspace(0.1, 0.2, inertias)},
        uncertainty={"number": 16},
        output={"quantities": ["delta"]},
    )
    told = section(page(archive), "results")
    largest = int(archive.delta_share.mean("inertia").argmax("uncertain_parameter"))
    mostly = str(archive.uncertain_parameter.values[largest])
    for row in range(inertias):
        value, low, high = (
            number_text(float(archive[name][row])) for name in ("delta", "delta_low", "delta_high")
        )
        assert f"{value} ({low} to {high})" in told
    assert f"mostly from {mostly}" in told and "In brackets: 95 %" in told
    assert "delta_low" not in told  # the table has it, the extremes leave it out


@pytest.mark.parametrize("limit", [1.7e6, 2.5e6])
def test_a_limit_is_kept_and_what_is_left_out_is_told(limit: float) -> None:
    archive = large()
    text = page(archive, limit=limit)
    assert 0.6 * (limit - 1.6e6) + 1.5e6 < len(text.encode()) <= limit
    assert "Some values of the archive were left out" in section(text, "explore")
    found = data_of(text)
    omega = found["quantities"]["omega"]
    numbers = numbers_of(omega)
    columns = found["columns"]
    where = {}
    for dim in omega["dims"]:
        values = np.frombuffer(base64.b64decode(columns[dim]["values"]), "<f8")
        if dim in omega["at"]:
            values = values[np.frombuffer(base64.b64decode(omega["at"][dim]), "<i4")]
        where[dim] = values
    assert_allclose(numbers, archive.omega.sel(where), rtol=1e-6)
    assert_allclose(numbers_of(found["quantities"]["delta"]), archive.delta, rtol=1e-6)
    size = 20_000
    names = [f"Κινητήρας {i} {'long ' * 15}" for i in range(size)]
    named = xr.Dataset({"delta": ("design", np.ones(size))}, {"case": ("design", names)})
    assert 0.8 * limit < len(page(named, limit=limit).encode()) <= limit
    with pytest.raises(SceneError, match=r"limit 1 MB: must be 1\.\d+ MB or more"):
        page(archive, limit=1e6)
    assert "<h3>delta &lt;= 1/50</h3>" in page(archive, target="delta=1/50")
    with pytest.raises(SceneError, match="must say which side is wanted"):
        page(archive, target="omega=100")


def test_texts_of_archives_are_texts() -> None:
    written = page(hostile())
    expected = Tags(page(large(3, 4)))
    found = Tags(written)
    usual = {tag for tag, _ in expected.found} | {"details", "summary", "pre"}
    assert {tag for tag, _ in found.found} <= usual
    assert [a for t, a in found.found if t == "script"] == [
        a for t, a in expected.found if t == "script"
    ]
    assert not [a for _, a in found.found if any(key.startswith("on") for key in a)]
    assert "window.broken" in "".join(found.words)


def test_the_command_writes_a_report(archive: xr.Dataset, tmp_path: Path) -> None:
    path, output = tmp_path / "map.nc", tmp_path / "map.html"
    archive.to_netcdf(path)
    said = ok("report", path, "-o", output, "--units", "brake_power=hp")
    assert said.startswith(f"{output}: 1.") and "MB" in said
    found = data_of(output.read_text(encoding="utf-8"))
    assert found["quantities"]["brake_power"]["unit"] == "hp"
    assert "exists" in refused("report", path, "-o", output)
    ok("report", path, "-o", output, "--overwrite", "-q")
    assert "must be .html" in refused("report", path, "-o", tmp_path / "map.pdf")
    assert "--limit much" in refused("report", path, "-o", output, "--overwrite", "--limit", "much")
    assert "cannot be used for a quantity" in refused("report", path, "-o", output, "--overwrite",
                                     "--units", "delta=kW")  # fmt: skip
    assert sweeps.report(path, tmp_path / "again.html") == tmp_path / "again.html"


@pytest.mark.parametrize(
    ("engine", "scene", "told", "not_told"),
    [
        ("b112", {}, "rigid crankshaft", "articulated|radial engine|misfiring|1980s|two-stroke"),
        ("b112", {"axes": {"misfire": [0, 1]}}, "misfiring cylinder", "articulated"),
        (
            "diesel_105x137",
            {
                "shaft": "diesel_105x137",
                "axes": {"speed": [1000, 2000]},
                "output": {"quantities": ["shaft_torque_half_range"]},
            },
            "secondary resonance",
            "stiffness depends on the torque|Rods on one pin|articulated",
        ),
        (
            "ntua",
            {"set": {"cylinders": 5, "arrangement": "radial 5"}},
            "articulated_rods give those",
            "misfiring",
        ),
    ],
)
def test_limits_are_those_that_apply(
    engine: str, scene: dict[str, Any], told: str, not_told: str
) -> None:
    output = {"output": {"quantities": ["delta"]}} | scene
    limits = section(page(sweeps.run(engine=engine, **output)), "limits")
    assert told in limits
    assert not re.search(not_told, limits)


def test_limits_of_articulated_rods_and_of_couplings_over_torque(archive: xr.Dataset) -> None:
    rods = {"throws": [0.0] * 3, "positions": [0.0] * 3, "banks": [0.0, 120.0, 240.0]}
    assert features_of(archive, [rods]) >= {"radial", "shared_pins"}
    master = features_of(archive, [{**rods, "articulated_rods": []}])
    assert "articulated_rods" in master and "radial" not in master
    told = " ".join(model_limits(["torque", "shaft_torque_half_range"], master))
    assert "flange of the master rod" in told and "act on the crank pin itself" not in told
    coupling = '{"shafts": [{"stiffness_over_torque": {}}]}'
    features = features_of(archive.assign_attrs(scene=coupling), [])
    assert "stiffness of the mean torque" in " ".join(
        model_limits(["shaft_torque_half_range"], features)
    )


def test_a_verdict_stands_in_place_of_some_designs_of_many() -> None:
    axes = {"inertia": np.linspace(5.0, 20.0, 35).tolist(), "speed": [1200.0, 1500.0]}
    archive = sweeps.run(engine="ntua", axes=axes, output={"quantities": ["delta"]})
    assert "of 70 designs, those with the smallest delta" in page(archive)
    assert "of 70 designs, those" not in page(archive, target="delta <= 1/50")


def test_rows_that_differ_in_the_misfire_alone_are_one() -> None:
    told = page(alike(2))
    assert told.count("<td>1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12</td>") == 2
    assert len(re.findall(r"<td[^>]*>0\.0[34]", told.partition("Smallest and largest")[0])) == 2
