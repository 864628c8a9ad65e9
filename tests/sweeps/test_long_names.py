"""Long names, which plots of xarray write beside axes: short enough to be seen whole."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.text import Text

from engine_dyn.quantities.graph import ALL_QUANTITIES, DIMENSIONS, NODES, PARAMETERS
from sweeps.base.dimensions import WORD_AXES
from sweeps.base.naming import DESCRIPTION, LONGEST_NAME, meaning_of, named, renamed
from tests.support.scenes import computed

NAMED = {name: NODES[name] for name in (*ALL_QUANTITIES, *PARAMETERS, *DIMENSIONS)}


def written(attributes: dict[str, Any]) -> str:
    """What xarray writes beside an axis."""
    return f"{attributes['long_name']} [{attributes['units']}]"


def test_every_quantity_and_axis_has_a_name_of_one_line() -> None:
    long, lost = [], []
    for name, variants in NAMED.items():
        for node in variants:
            about = named(name, node.long_name, node.unit)
            if len(f"{about['long_name']} [{node.unit}]") > LONGEST_NAME:
                long.append((name, about))
            if meaning_of(about) != node.long_name:
                lost.append(name)
    assert not long and not lost
    for axis in WORD_AXES.values():
        assert len(named(axis.name, axis.long_name)["long_name"]) <= LONGEST_NAME - len(" [1]")


def test_no_two_quantities_have_the_same_long_name() -> None:
    names: dict[str, str] = {}
    for name in ALL_QUANTITIES:
        node = ALL_QUANTITIES[name]
        label = named(name, node.long_name, node.unit)["long_name"]
        assert names.setdefault(label, name) == name, label


def cut(figure: Figure, text: Text) -> bool:
    figure.canvas.draw()
    box, page = text.get_window_extent(), figure.bbox
    return not (box.x0 >= 0 and box.y0 >= 0 and box.x1 <= page.width and box.y1 <= page.height)


@pytest.mark.parametrize("word", ["wanted", "ggggg", "gas torque"])
def test_a_plot_of_xarray_shows_names_of_this_length_whole(word: str) -> None:
    from matplotlib import pyplot

    name = " ".join([word] * 10)[: LONGEST_NAME - len(" [1]")].strip()
    about = {"long_name": name, "units": "1"}
    values = 1000.0 * np.arange(6.0)
    line = xr.DataArray(values, {"x": ("x", values, about)}, "x", "line", about)
    sheet = xr.DataArray(
        values[:, None] * values, {"x": ("x", values, about), "y": ("y", values, about)},
        ("y", "x"), "sheet", about,
    )  # fmt: skip
    for array in (line, sheet / 1000.0):
        figure = pyplot.figure()
        array.plot()
        labels = [axis.label for one in figure.axes for axis in (one.xaxis, one.yaxis)]
        shown = [label for label in labels if label.get_text()]
        assert len(shown) == 1 + array.ndim
        assert [label.get_text() for label in shown if cut(figure, label)] == []
        pyplot.close(figure)


def test_archives_have_short_names_and_whole_meanings() -> None:
    archive = computed(
        ("delta", "gas_torque", "torque_order"), axes={"inertia": [1.0, 2.0]},
        designs={"case": ["short", "long"], "rod_length": [0.3, 0.4]},
        solver={"method": ["auto", "thesis"], "passes": 2},
    )  # fmt: skip
    for name, variable in archive.variables.items():
        assert len(written(dict(variable.attrs))) <= LONGEST_NAME, name
    assert archive["delta"].attrs["long_name"] == "speed fluctuation"
    said = "coefficient of speed fluctuation (cyclic irregularity)"
    assert archive["delta"].attrs[DESCRIPTION] == said


def test_what_is_made_from_a_variable_has_both_names() -> None:
    about = renamed(named("gas_torque", "gas torque, all cylinders", "N m"), "largest {}")
    assert about["long_name"] == "largest gas torque"
    assert about[DESCRIPTION] == "largest gas torque, all cylinders"
    assert renamed({"units": "1"}, "largest {}") == {"units": "1"}
    assert meaning_of({}, "delta") == "delta"
    foreign = {"description": np.arange(3.0), "long_name": np.float64(2.0)}
    assert meaning_of(foreign, "delta") == "delta"
