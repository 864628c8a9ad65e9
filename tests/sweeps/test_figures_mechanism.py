"""Figures of forces, orders and bearing loads, from datasets made here."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

from sweeps.figures.polar import polar_names
from sweeps.figures.views import View
from tests.support.figures import assert_inside, plates, variable, words

ANGLES = np.arange(-360.0, 360.0, 10.0)
PHI = np.radians(ANGLES)


def mechanism(speeds: Any = (1000.0, 2000.0)) -> xr.Dataset:
    """A study over speed: forces, orders, loads of two engines' journals."""
    speed = np.asarray(speeds)
    push = 1e4 * np.exp(-(PHI**2)) - speed[:, None] * np.cos(PHI)
    journals = np.stack([push * np.sin(PHI), push * np.cos(PHI), np.full_like(push, np.nan)], 1)
    order = np.arange(1, 13) / 2
    size = 100.0 / order + 0.01 * speed[:, None]
    curve = ("speed", "crank_angle")
    journal = ("speed", "main_bearing", "crank_angle")
    return xr.Dataset(
        {
            "gas_force": variable("crank_angle", push[0] + 50.0, "force of the gas, x", "N", "P_g"),
            "piston_force": variable(curve, push, "force on the piston", "N", "P"),
            "crank_pin_radial": variable(curve, -push * np.cos(PHI), "load of the crank pin", "N"),
            "crank_pin_tangential": variable(
                curve, push * np.sin(PHI), "load of the crank pin across the crank", "N"),
            "piston_pin_side": variable("crank_angle", 0.2 * push[0], "load across", "N"),
            "piston_pin_down": variable("crank_angle", push[0] * np.cos(PHI), "load along", "N"),
            "main_journal_x": variable(journal, journals, "sideways load, right", "N", "F_{H,x}"),
            "main_journal_y": variable(journal, -journals, "upward load, up", "N", "F_{H,y}"),
            "main_journal_load_max": variable(
                ("speed", "main_bearing"), np.abs(journals).max(axis=2), "largest load", "N"),
            "torque_order": variable(("speed", "order"), size, "amplitude of the orders", "N m"),
            "phase_vector_sum": variable("order", (order % 3 == 0) * 6.0, "sum of phases", "1"),
        },
        coords={
            "speed": variable("speed", speed, "nominal crank speed", "rpm", "n"),
            "main_bearing": variable("main_bearing", [1, 2, 3], "main journal", "1", "j"),
            "order": variable("order", order, "order", "1", r"\nu"),
            "crank_angle": variable("crank_angle", ANGLES, "crank angle", "degree", r"\varphi"),
        },
    )  # fmt: skip


@pytest.fixture(scope="module")
def found() -> dict[str, Any]:
    return plates(mechanism(), laid_out=True)


def test_forces_of_one_group_share_their_panels(found: dict[str, Any]) -> None:
    assert set(found) == {
        "piston_forces_speed", "crank_pin_polar_tangential_radial_speed",
        "piston_pin_polar_side_down", "main_journal_polar_x_y_speed", "torque_order_speed",
        "phase_vector_sum", "main_journal_load_max_main_bearing",
    }  # fmt: skip
    for stem, figure in found.items():
        assert_inside(stem, figure, apart="polar" not in stem)
    figure = found["piston_forces_speed"]
    assert len(figure.axes) == 2  # one for each speed
    assert "Force of the gas $P_g$" in words(figure) and "Force (N)" in words(figure)
    one, other = (line.get_ydata() for line in figure.axes[0].lines if len(line.get_xdata()) > 10)
    assert len(one) and other[0] == other[-1]  # closed: the first point again at the end
    # Without its partner each is a curve like any other.
    alone = mechanism()[["crank_pin_radial"]]
    assert polar_names(View(alone)) == []
    assert "crank_pin_radial_speed" in plates(alone)
    assert "piston_force_speed" in plates(mechanism()[["piston_force"]])


def test_polar_diagrams_have_one_scale(found: dict[str, Any]) -> None:
    for stem in ("crank_pin_polar_tangential_radial_speed", "piston_pin_polar_side_down"):
        panel = found[stem].axes[0]
        box = panel.get_window_extent()
        across = np.ptp(panel.get_xlim()) / box.width
        up = np.ptp(panel.get_ylim()) / box.height
        assert across == pytest.approx(up, rel=1e-6)
        # everything is inside, and so is the origin
        for line in panel.lines:
            if line.get_marker() == "o":
                x, y = line.get_data()
                assert (np.abs(x - np.mean(panel.get_xlim())) <= np.ptp(panel.get_xlim()) / 2).all()
                assert (np.abs(y - np.mean(panel.get_ylim())) <= np.ptp(panel.get_ylim()) / 2).all()
    data, drawn = mechanism(), found["crank_pin_polar_tangential_radial_speed"]
    line = next(one for one in drawn.axes[0].lines if len(one.get_xdata()) == ANGLES.size + 1)
    assert line.get_xdata()[:-1] == pytest.approx(data["crank_pin_tangential"].values[0])
    assert line.get_ydata()[:-1] == pytest.approx(data["crank_pin_radial"].values[0])
    said = words(drawn)
    assert "Polar diagram of the load of the crank pin by speed" in said
    assert "in axes that turn with the crank; a mark every 30° of crank" in said
    down = found["piston_pin_polar_side_down"]
    assert down.axes[0].yaxis_inverted() and "0°" in words(down)


def test_each_journal_has_a_panel_and_none_is_missed(found: dict[str, Any]) -> None:
    single = plates(mechanism().isel(speed=0))
    for figure in (found["main_journal_polar_x_y_speed"], single["main_journal_polar_x_y"]):
        titles = [panel.get_title(loc="left") for panel in figure.axes if panel.get_visible()]
        assert titles == ["$j$ = 1", "$j$ = 2", "$j$ = 3"]
        assert len(figure.axes[2].lines) == 2  # only the axes of coordinates
    assert "no value" not in words(found["main_journal_load_max_main_bearing"]).lower()
    # Points without a line from one bearing to the next.
    (line,) = single["main_journal_load_max_main_bearing"].axes[0].get_lines()
    assert line.get_linestyle() == "None"


def orders_of(panel: Any) -> list[np.ndarray]:
    """Where the bars of each value stand."""
    return [
        np.array([bar.get_x() + 0.5 * bar.get_width() for bar in bars]) for bars in panel.containers
    ]


def test_orders_are_bars_at_their_order(found: dict[str, Any]) -> None:
    figure = found["torque_order_speed"]
    panel = figure.axes[0]
    one, other = orders_of(panel)  # of each speed
    assert one == pytest.approx(np.arange(1, 13) / 2)
    assert other == pytest.approx(one)
    behind, before = (bars[0].get_width() for bars in panel.containers)
    assert before < behind < 0.5  # so that both are seen, and no order touches the next
    assert "Order" in words(figure)
    (single,) = orders_of(found["phase_vector_sum"].axes[0])
    sums = mechanism()["phase_vector_sum"].values
    assert single == pytest.approx(np.arange(1, 13)[sums > 0] / 2)
    # Many values have a panel each.
    data = mechanism()[["torque_order"]].isel(speed=[0, 0, 0, 1])
    data["speed"] = ("speed", [1000.0, 1200.0, 1400.0, 1600.0], data["speed"].attrs)
    figure = plates(data)["torque_order_speed"]
    assert [len(panel.containers) for panel in figure.axes] == [1, 1, 1, 1]
    assert "rpm" in figure.axes[0].get_title(loc="left")


def test_of_what_is_not_there_nothing_is_drawn() -> None:
    data = mechanism()[["torque_order"]]
    size = np.array(data["torque_order"].values)
    data["torque_order"][:] = np.where(data["order"] % 1 == 0, size, 0.0)
    attrs = {"long_name": "phase of the orders", "units": "degree"}
    phases = np.where(data["order"] % 1 == 0, 90.0, 0.0) * np.ones(size.shape)
    data["torque_phase"] = (data["torque_order"].dims, phases, attrs)
    found = plates(data)
    assert len(orders_of(found["torque_order_speed"].axes[0])[0]) == 6
    assert len(found["torque_phase"].axes[0].lines[0].get_xdata()) == 6
    assert not found["torque_phase"].axes[0].containers  # a phase has no bar
    data["torque_order"][:] = 0.0
    assert not [name for name in plates(data) if name.startswith("torque_order")]


def test_two_directions_are_points_without_a_line() -> None:
    forces = variable(("case", "direction"), [[9.0, 0.0], [0.5, 0.6]], "force", "N")
    words = variable("case", ["four", "six"], "engine", "1")
    data = xr.Dataset(
        {"force": forces},
        coords={"direction": variable("direction", [0.0, 90.0], "direction", "degree"),
                "case": words},
    )  # fmt: skip
    (line,) = plates(data.isel(case=0))["force_direction"].axes[0].get_lines()
    assert line.get_linestyle() == "None" and len(line.get_xdata()) == 2
    assert {"force_case"} == {name for name in plates(data) if name.startswith("force")}


def test_more_axes_are_cut_or_faceted() -> None:
    data = mechanism()
    wider = xr.concat([data, data * 1.1], dim="load", data_vars="all", coords="minimal")
    wider = wider.assign_coords(
        load=variable("load", [50.0, 100.0], "load", "percent", "L"), speed=data["speed"]
    )
    for name in data.data_vars:
        wider[name].attrs = data[name].attrs
    found = plates(wider)
    assert "torque_order_speed" in found and "torque_order_load" in found
    assert len([p for p in found["torque_order_speed"].axes if p.get_visible()]) == 2
    assert len(found["crank_pin_polar_tangential_radial_speed"].axes) >= 2
