"""Figures of a shaft that twists: modes, Campbell diagram, orders, loads, torque over the cycle;
what is drawn, from datasets made here."""

from __future__ import annotations

import json
from itertools import combinations
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import sweeps
from sweeps.figures.drawing import figure
from sweeps.figures.options import options_of
from sweeps.figures.shaft_modes import crossings, free_places, joined_neighbours, zero_crossings
from sweeps.figures.shaft_response import sum_of_orders
from sweeps.figures.study import study_of
from tests.support.figures import assert_inside, plates, variable, words

SPEED = np.linspace(1000.0, 2000.0, 21)
ORDER = np.arange(0.5, 6.5, 0.5)
DISCS = ("crank", "flywheel", "ring")
SHAFTS = ("crank - flywheel", "crank - ring")
FREQUENCY = np.array([75.0, 400.0])
"""Order 3 meets the first at 1500 rpm; no order meets the second."""

LARGE = {2.5: 2.0, 3.0: 9.0, 4.0: 1.0}
"""Orders whose amplitudes in the flywheel's shaft are large, at every speed."""


def shaft(misfire: tuple[float, ...] = (0.0, 1.0, 2.0)) -> xr.Dataset:
    """A crank with a flywheel, and the ring of a damper on it; cylinder 2 is the worst to misfire.

    Torque and loss of the ring's shaft are a tenth of those of the other.
    """
    resonance = 1.0 / np.hypot(1.0 - (SPEED / 1500.0) ** 2, 0.1)
    missing = np.array([1.0 + (0.0, 0.1, 0.5)[int(number)] for number in misfire])
    amplitude = np.array([LARGE.get(float(nu), 0.1) for nu in ORDER])
    part = np.array([1.0, 0.1])
    orders = np.einsum("i,j,k,l->ijkl", resonance, missing, part, amplitude)
    half = 14.0 * np.einsum("i,j,k->ijk", resonance, missing, part)
    over, along = ("speed", "misfire", "shaft"), ("speed", "misfire", "shaft", "order")
    sums = np.where(ORDER % 3.0 == 0.0, 2.0, 0.5)
    shapes = np.array([[1.0, -0.25, 3.0], [1.0, -1.0, 0.2]])
    data = xr.Dataset(
        {
            "natural_frequency": variable("mode", FREQUENCY, "natural frequency", "Hz"),
            "mode_shape": variable(("mode", "disc"), shapes, "mode shape", "1"),
            "critical_speed": variable(
                ("mode", "order"), 60.0 * FREQUENCY[:, None] / ORDER, "critical speed", "rpm"
            ),
            "mode_vector_sum": variable(
                ("mode", "order"), np.stack([sums, sums]), "vector sum", "1"
            ),
            "shaft_torque_order": variable(along, orders, "orders of the torque", "N m", "T"),
            "shaft_torque_phase": variable(
                along, np.full(orders.shape, 30.0), "phase of the orders", "degree"
            ),
            "shaft_torque_half_range": variable(over, half, "half range", "N m", "T"),
            "shaft_stress_half_range": variable(over, half / 2.0, "stress", "MPa", "s"),
            "shaft_loss": variable(over, half**2, "power lost", "W", "P"),
            "shaft_stress_limit": variable("shaft", [50.0, np.nan], "limit of the stress", "MPa"),
        },
        coords={
            "speed": variable("speed", SPEED, "engine speed", "rpm"),
            "misfire": variable("misfire", list(misfire), "misfiring cylinder", "1"),
            "order": variable("order", ORDER, "order", "1"),
            "mode": variable("mode", [1, 2], "mode", "1"),
            "disc": variable("disc", [1, 2, 3], "disc", "1"),
            "shaft": variable("shaft", [1, 2], "shaft", "1"),
            "disc_name": variable("disc", list(DISCS), "name of the disc", "1"),
            "shaft_name": variable("shaft", list(SHAFTS), "name of the shaft", "1"),
        },
        attrs={"shaft": json.dumps({"shafts": [[1, 2], [1, 3]], "gears": []})},
    )
    return data


@pytest.fixture(scope="module")
def drawn() -> dict[str, Figure]:
    return plates(shaft(), laid_out=True)


def line(figure: Figure, text: str, panel: int = 0) -> Any:
    """The line of a panel that looks as the legend's entry of a text."""
    (legend,) = figure.legends
    found = [t.get_text().replace("\n", " ") for t in legend.get_texts()]
    look = legend.get_lines()[found.index(text)]
    return next(
        one
        for one in figure.axes[panel].lines
        if one.get_color() == look.get_color() and one.get_linewidth() == look.get_linewidth()
    )


def test_variables_of_the_shaft_get_their_own_figures_alone(drawn: dict) -> None:
    assert set(drawn) == {
        "mode_shapes", "campbell", "shaft_torque_order_speed", "shaft_torque_half_range_speed",
        "shaft_stress_half_range_speed", "shaft_loss_speed", "shaft_torque_cycle",
        "shaft_torque_order_waterfall",
    }  # fmt: skip
    for stem, one in drawn.items():
        assert_inside(stem, one)
    # The loss of the ring is a hundredth of that of the flywheel, and left out.
    assert len(drawn["shaft_loss_speed"].axes) == 1
    assert "1 of 2 shafts shown" in words(drawn["shaft_loss_speed"])
    found = plates(shaft(), {"speed": 1500.0})
    assert {"mode_shapes", "shaft_torque_cycle"} <= set(found)
    assert not any(stem.endswith("_speed") or stem == "campbell" for stem in found)


def test_shapes_nodes_and_marks_of_modes(drawn: dict) -> None:
    assert joined_neighbours(study_of(shaft(), {}).view, 3).tolist() == [True, False]
    panel = drawn["mode_shapes"].axes[0]
    first, node = panel.lines[:2]
    assert first.get_xdata() == pytest.approx([0.0, 1.0, np.nan, 2.0], nan_ok=True)
    assert first.get_ydata() == pytest.approx([1.0 / 3.0, -0.25 / 3.0, np.nan, 1.0], nan_ok=True)
    assert node.get_xdata() == pytest.approx([0.8])  # from 1 to -1/4 on the way to the flywheel
    assert [label.get_text() for label in panel.get_xticklabels()] == list(DISCS)
    assert "mode 1: 75 Hz" in words(drawn["mode_shapes"])
    # Free discs of 2 and 6 kg m2: the shape is 1, -J1/J2; the node is nearer to the larger one.
    joined = np.array([True])
    assert zero_crossings(np.array([1.0, -2.0 / 6.0]), joined) == pytest.approx([6.0 / (2.0 + 6.0)])
    assert zero_crossings(np.array([1.0, -1.0]), ~joined).size == 0
    one = drawn["campbell"]
    panel = one.axes[0]
    marks = panel.collections[0]
    met = {round(60.0 * 75.0 / order): size for order, size in ((3.0, 1.0), (2.5, 0.25))}
    areas = dict(zip(marks.get_offsets()[:, 0].round(), marks.get_sizes(), strict=True))
    assert {speed: area / max(areas.values()) for speed, area in areas.items()} == pytest.approx(
        met | {1286: 0.25, 1125: 0.25, 1000: 0.25}
    )
    assert "1500" in words(one) and "mode 1: 75 Hz" in words(one) and "mode 2" not in words(one)


def test_orders_meet_modes_where_their_frequencies_are_equal() -> None:
    speeds = np.array([1000.0, 1500.0, 2400.0])
    level = np.full((1, 3), 100.0)
    found = crossings(speeds, level, np.array([2.0, 2.5, 4.0, 6.0, 7.0]) / 60.0)
    # n = 60 f / nu; order 2.5 meets the mode at the last speed, order 6 at the first
    assert found == [(0, 1, pytest.approx(2400.0)), (0, 2, pytest.approx(1500.0)),
                     (0, 3, pytest.approx(1000.0))]  # fmt: skip
    rising = 50.0 + 0.02 * np.array([[1000.0, 1500.0, 2400.0]])
    # 4 n / 60 = 50 + 0.02 n
    (only,) = crossings(speeds, rising, np.array([4.0 / 60.0]))
    assert only[2] == pytest.approx(50.0 / (4.0 / 60.0 - 0.02))


def test_labels_of_many_crossings_lie_apart() -> None:
    # orders 6 to 12 meet 200 Hz between 1000 and 2000 rpm, those of 11.5 and 12 at 1043 and 1000
    order = np.arange(0.5, 12.5, 0.5)
    data = shaft()[["natural_frequency", "speed"]].drop_dims("misfire", errors="ignore")
    data["natural_frequency"] = variable("mode", [200.0, 900.0], "natural frequency", "Hz")
    data["mode_vector_sum"] = variable(("mode", "order"), np.ones((2, 24)), "vector sum", "1")
    data = data.assign_coords(order=variable("order", order, "order", "1"))
    one = plates(data, laid_out=True)["campbell"]
    panel, renderer = one.axes[0], one.canvas.get_renderer()  # type: ignore[attr-defined]
    assert len(panel.collections[0].get_offsets()) == 13
    boxes = [text.get_window_extent(renderer) for text in panel.texts]
    speeds = [int(text.get_text()) for text in panel.texts if float(text.get_text()) > 100.0]
    assert 5 <= len(speeds) < 13 and set(speeds) <= {round(12000.0 / nu) for nu in order}
    assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))
    places, sizes = np.array([0.0, 0.1, 0.2, 0.5]), np.array([1.0, 3.0, 2.0, 0.1])
    assert free_places(places, sizes, 0.15) == [1, 3]


def test_orders_and_half_ranges_over_the_speed(drawn: dict) -> None:
    one = drawn["shaft_torque_order_speed"]
    said = words(one)
    assert "crank - flywheel, where the torque is the largest" in said
    assert "no misfire" in said and "misfire of cylinder 2" in said and "cylinder 1" not in said
    assert "I/3" in said and "II/" not in said
    middle = 10  # 1500 rpm, where the resonance is 10 high
    for panel, factor in ((0, 1.0), (1, 1.5)):
        assert line(one, "order 3", panel).get_ydata()[middle] == pytest.approx(90.0 * factor)
        half = line(one, "half range of their sum", panel).get_ydata()
        assert half[middle] == pytest.approx(140.0 * factor)
        assert one.axes[panel].get_ylim()[1] > 210.0
    one = drawn["shaft_stress_half_range_speed"]
    assert [panel.get_title(loc="left") for panel in one.axes] == [
        "crank - flywheel; cylinder 2", "crank - ring; cylinder 2"
    ]  # fmt: skip
    healthy, worst, limit = (one.axes[0].lines[place].get_ydata() for place in range(3))
    assert [healthy[10], worst[10], limit[10]] == pytest.approx([70.0, 105.0, 50.0])
    assert len(one.axes[1].lines) == 2  # without limit
    barred = one.axes[0].collections
    assert len(barred) == 1 and not one.axes[1].collections
    heights = barred[0].get_paths()[0].vertices[:, 1]
    assert heights.min() == pytest.approx(50.0) and heights.max() > 100.0
    assert "Limit of the stress" in words(one)


def test_another_shaft_is_drawn_where_it_is_selected() -> None:
    found = plates(shaft(), {"shaft": "crank - ring", "misfire": 0.0})
    one = found["shaft_torque_order_speed"]
    assert line(one, "order 3").get_ydata()[10] == pytest.approx(9.0)
    assert "where the torque" not in words(one)
    assert found["shaft_stress_half_range_speed"].axes[0].lines[0].get_ydata()[10] == 7.0


def test_values_of_a_design_axis_are_lines_of_the_most_loaded_shaft() -> None:
    damping = xr.DataArray([1.0, 2.0, 4.0], dims="damping")
    data = shaft()[["shaft_torque_half_range"]] / damping
    data = data.assign_coords(damping=variable("damping", damping.values, "damping", "1"))
    found = plates(data.transpose("damping", ...))
    assert set(found) == {"shaft_torque_half_range_damping", "shaft_torque_half_range_speed"}
    one = found["shaft_torque_half_range_damping"]
    assert [panel.get_title(loc="left") for panel in one.axes] == [
        "no misfire", "misfire of cylinder 2"
    ]  # fmt: skip
    assert [panel.lines[1].get_ydata()[10] for panel in one.axes] == pytest.approx([70.0, 105.0])


def test_orders_sum_to_their_closed_form() -> None:
    # cos(phi) + cos(2 phi) lies between -9/8 and 2
    degrees = np.arange(-360.0, 360.0, 0.25)
    total = sum_of_orders(degrees, np.array([1.0, 2.0]), np.ones(2), np.zeros(2))
    assert [total.min(), total.max()] == pytest.approx([-9.0 / 8.0, 2.0], abs=1e-5)
    late = sum_of_orders(degrees, np.array([3.0]), np.array([2.0]), np.array([-90.0]))
    assert late == pytest.approx(2.0 * np.sin(np.radians(3.0 * degrees)))


def test_the_cycle_is_drawn_at_the_worst_speed_with_its_half_range() -> None:
    data = shaft((0.0,)).isel(misfire=0, drop=True)
    only = (data.order == 3.0) * 1.0
    data["shaft_torque_order"] = (data.shaft_torque_order * only).assign_attrs(
        data.shaft_torque_order.attrs
    )
    found = figure(data, "shaft_cycle", options_of(zero="bdc", angle="0..720"))
    said = words(found)
    assert "1500" in said and "half range 90 N m" in said
    total = line(found, "sum of all orders")
    # 90 cos(3 phi + 30 degree) with phi counted from 180 degrees later
    angle = np.asarray(total.get_xdata())
    assert (angle[0], angle[-1]) == (0.0, 720.0)
    assert total.get_ydata() == pytest.approx(
        90.0 * np.cos(np.radians(3.0 * (angle - 180.0) + 30.0)), abs=1e-9
    )


@pytest.mark.compiled
def test_an_archive_of_a_scene_gets_them_all() -> None:
    data = sweeps.run(
        engine="diesel_105x137",
        shaft="diesel_105x137_generator_set",
        axes={"speed": [1400.0, 1600.0, 2166.0], "misfire": [0, 3]},
        output={"quantities": [
            "natural_frequency", "mode_shape", "mode_vector_sum", "critical_speed",
            "shaft_torque_order", "shaft_torque_phase", "shaft_torque_half_range", "shaft_loss",
            "disc_angle_order", "disc_angle_phase", "disc_angle_half_range",
        ]},
        silenced_warnings=["all"],
    )  # fmt: skip
    assert json.loads(data.attrs["shaft"])["shafts"][:2] == [[1, 2], [2, 3]]
    found = plates(data, laid_out=True)
    assert {
        "mode_shapes", "campbell", "shaft_torque_order_speed", "disc_angle_order_speed",
        "shaft_torque_half_range_speed", "disc_angle_half_range_speed", "shaft_loss_speed",
        "shaft_torque_cycle", "disc_angle_cycle",
    } <= set(found)  # fmt: skip
    for stem, one in found.items():
        assert_inside(stem, one)
    # what is summed here is what the archive has by its own way
    total = np.asarray(line(found["shaft_torque_cycle"], "sum of all orders").get_ydata())
    largest = float(data.shaft_torque_half_range.isel(misfire=0).max())
    assert 0.5 * np.ptp(total) == pytest.approx(largest, rel=1e-3)
