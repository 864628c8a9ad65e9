"""The explorer of whole archives: widgets move, and what is drawn changes."""

from importlib.util import find_spec
from typing import Any

import lazy_loader
import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from sweeps.view.report.explore import explore
from tests.support.reports import SCENE, alike

panel = lazy_loader.load("panel")  # takes a second or two, which other tests need not wait for

pytestmark = [
    pytest.mark.compiled,
    pytest.mark.skipif(find_spec("panel") is None, reason="panel is not installed"),
]


@pytest.fixture(scope="module")
def archive() -> xr.Dataset:
    return sweeps.run(SCENE)


def part(layout: Any, name: str) -> Any:
    return next(c for c in layout.select(panel.Column) if c.name == name)


def axis(layout: Any, label: str) -> Any:
    return next(w for w in layout.select(panel.widgets.Widget) if w.label == label)


def drawn(layout: Any, name: str) -> list[dict[str, Any]]:
    """Data of each line of a figure, or of the cells and the mark of a map."""
    found = part(layout, name).select(panel.pane.Bokeh)[0].object
    return [r.data_source.data for r in found.renderers[::2]]


def test_curves_follow_the_sliders(archive: xr.Dataset) -> None:
    layout = archive.dyn.explore()
    inertia, load = axis(layout, "inertia [kg m²]"), axis(layout, "load [%]")
    assert list(inertia.options) == ["0.05", "2", "3", "5"]
    for i, j in ((0, 1), (2, 3), (1, 2)):
        load.value, inertia.value = i, j
        torque, gas = drawn(layout, "Curves of this design")
        at = {"load": i, "inertia": j}
        assert_allclose(torque["y"], _of(archive.torque, at))
        assert_allclose(gas["y"], _of(archive.gas_torque, at))
        assert_allclose(torque["x"], archive.crank_angle)
        lines = drawn(layout, "Numbers over an axis")
        assert_allclose([line["y"] for line in lines], archive.delta)
        table = part(layout, "numbers").select(panel.pane.DataFrame)[0].object
        told = dict(zip(table["quantity"], table["value"], strict=True))
        assert float(told["delta"]) == pytest.approx(float(archive.delta[i, j]), rel=1e-3)
        assert told["outcome"] == "converged"
    inertia.value = 0
    table = part(layout, "numbers").select(panel.pane.DataFrame)[0].object
    assert list(table["value"])[-1] == "stalled" and "-" in list(table["value"])


def _of(data: xr.DataArray, at: dict[str, int]) -> xr.DataArray:
    return data.isel({d: i for d, i in at.items() if d in data.dims})


def test_selectors_draw_other_quantities_in_readable_units(archive: xr.Dataset) -> None:
    layout = explore(archive, units="brake_power=hp")
    axis(layout, "load [%]").value = axis(layout, "inertia [kg m²]").value = 0
    choices = part(layout, "Numbers over an axis").select(panel.widgets.Select)
    choices[0].value, choices[2].value = "omega_max", "no other axis"
    (line,) = drawn(layout, "Numbers over an axis")
    assert_allclose(line["y"], archive.omega_max.isel(load=0) * 30.0 / np.pi)
    choices[2].value = "load"
    lines = drawn(layout, "Numbers over an axis")
    for place, line in enumerate(lines):
        wanted = archive.omega_max.isel(load=place) * 30.0 / np.pi
        assert_allclose(line["y"], wanted)
    assert len(lines) == 3
    choices[2].value = "no other axis"
    choices[1].value = "load"
    (line,) = drawn(layout, "Numbers over an axis")
    assert_allclose(line["x"], archive["load"])
    group = part(layout, "Curves of this design").select(panel.widgets.Select)[0]
    group.value = "omega in rpm"
    (speed,) = drawn(layout, "Curves of this design")
    assert_allclose(speed["y"], archive.omega.isel(load=0, inertia=0) * 30.0 / np.pi)
    cells, _ = drawn(layout, "Map over two axes")
    at = {"inertia": cells["x"][5], "load": cells["y"][5]}
    assert cells["value"][5] == archive.delta.sel(at)
    part(layout, "Map over two axes").select(panel.widgets.Select)[1].value = "load"
    found = part(layout, "Map over two axes").select(panel.pane.Bokeh)[0].object
    assert "Choose two different axes" in found.text


def test_misfires_that_are_alike_are_one_line() -> None:
    layout = explore(alike(20))
    choices = part(layout, "Numbers over an axis").select(panel.widgets.Select)
    choices[1].value, choices[2].value = "speed", "misfire"
    figure = part(layout, "Numbers over an axis").select(panel.pane.Bokeh)[0].object
    (legend,) = (one for one in figure.below if hasattr(one, "items"))
    assert [one.label.value for one in legend.items] == ["misfire 0", "misfire 1 to 12"]
