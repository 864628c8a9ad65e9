"""Figures of the cycle, forces, orders and bearing loads, from datasets made here."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from sweeps.view.figures.bearing_loads import (
    bearing_load_names,
    bearing_loads,
    bearing_pressure_names,
    bearing_pressures,
)
from sweeps.view.figures.cycle_curves import load_curve_names, load_curves
from sweeps.view.figures.polar import polar_names
from sweeps.view.figures.study import Study, study_of
from sweeps.view.figures.turning_moment import turning, turning_moment, turning_names
from sweeps.view.figures.views import View
from tests.support.figures import assert_inside, plates, style, variable, words

ANGLES = np.arange(-360.0, 360.0, 1.0)
PHI = np.radians(ANGLES)


def cycle(loads: tuple[float, ...] = (50.0, 100.0)) -> xr.Dataset:
    """Torque of a sine about a mean that follows the load, with a load torque that wavers."""
    load = np.asarray(loads)[:, None]
    curve = ("load", "crank_angle")
    return xr.Dataset(
        {
            "torque": variable(curve, load * (1.0 + 3.0 * np.sin(PHI)), "torque", "N m"),
            "load_torque": variable(
                curve, load * (1.0 + 0.1 * np.sin(2.0 * PHI)), "load torque", "N m"
            ),
            "omega": variable(curve, 100.0 - 0.01 * load * np.cos(PHI), "speed", "rad s-1"),
            "pressure": variable(curve, 1.0 + load * np.exp(-(PHI**2)), "pressure", "bar"),
        },
        coords={
            "load": variable("load", np.asarray(loads), "engine load", "percent"),
            "crank_angle": variable("crank_angle", ANGLES, "crank angle", "degree"),
        },
    )


def bearings() -> xr.Dataset:
    speed = np.array([1000.0, 2000.0, 3000.0])
    journals = np.stack([speed, 2.0 * speed, np.full(3, np.nan)], axis=1)
    of_journals = ("speed", "main_bearing")
    return xr.Dataset(
        {
            "crank_pin_load_max": variable("speed", 5e3 - speed, "largest load", "N"),
            "crank_pin_load_mean": variable("speed", 0.5 * speed, "mean load", "N"),
            "main_journal_load_max": variable(of_journals, journals, "largest load", "N"),
            "main_journal_load_mean": variable(of_journals, 0.4 * journals, "mean load", "N"),
        },
        coords={
            "speed": variable("speed", speed, "engine speed", "rpm"),
            "main_bearing": variable("main_bearing", [1, 2, 3], "main journal", "1"),
        },
    )


def drawn(kind: object, names: object, study: Study) -> dict[str, Figure]:
    with style():
        return dict(kind(study, names(study.view)))


def test_areas_of_unlike_swings_are_those_of_adaptive_integration() -> None:
    from scipy.integrate import quad
    from scipy.optimize import brentq

    def excess(phi: float) -> float:
        return 40.0 * np.sin(phi) + 70.0 * np.sin(2.0 * phi + 0.4) + 25.0 * np.cos(0.5 * phi)

    closed = np.append(ANGLES, 360.0)
    torque = np.array([excess(phi) for phi in np.radians(closed)])
    found = turning(closed, torque, np.zeros_like(torque))
    signs = np.flatnonzero(np.diff(np.sign(torque)))
    zeros = [brentq(excess, *np.radians(closed[[i, i + 1]])) for i in signs]
    inside = [quad(excess, *pair)[0] for pair in pairwise(zeros)]
    assert found.areas[:-1] == pytest.approx(inside, rel=1e-3)
    # over a closed cycle of mean zero, all areas sum to nothing
    assert found.areas.sum() == pytest.approx(0.0, abs=1e-9)
    levels = np.cumsum([0.0, *inside])
    assert found.swing == pytest.approx(np.ptp(levels), rel=1e-3)


def test_a_load_torque_that_balances_bounds_the_areas_else_the_mean() -> None:
    study = study_of(cycle(), {"load": 100.0})
    figure = drawn(turning_moment, turning_names, study)["turning_moment"]
    torque, resistance = figure.axes[0].lines[:2]
    angle = np.radians(resistance.get_xdata())
    # both curves are straight between the degrees of the archive
    assert resistance.get_ydata() == pytest.approx(
        100.0 * (1.0 + 0.1 * np.sin(2.0 * angle)), abs=2e-3
    )
    assert torque.get_ydata() == pytest.approx(100.0 * (1.0 + 3.0 * np.sin(angle)), abs=0.02)
    # 3 sin less 0.1 sin of twice the angle, from 0 to pi: 2 * 3, the other gives nothing
    assert "W = 600 J" in words(figure)
    energy = figure.axes[1].lines[0].get_ydata()
    assert np.ptp(energy) == pytest.approx(600.0, rel=1e-3)
    assert "+600" in words(figure) and "\N{MINUS SIGN}600" in words(figure)
    # A load torque that does not balance gives way to the mean.
    data = cycle()
    data["load_torque"] = data["load_torque"] * 0.5
    figure = drawn(turning_moment, turning_names, study_of(data, {"load": 100.0}))["turning_moment"]
    assert figure.axes[0].lines[1].get_ydata() == pytest.approx(100.0)
    assert "Mean torque" in words(figure)


def test_curves_by_load() -> None:
    data = cycle((0.0, 50.0, 100.0))
    figure = drawn(load_curves, load_curve_names, study_of(data, {}))["load_curves"]
    names = ("pressure", "torque", "load_torque", "omega")
    assert len(figure.axes) == len(names)
    for panel, name in zip(figure.axes, names, strict=True):
        lines = [line for line in panel.lines if len(line.get_xdata()) > 10]
        assert len(lines) == 3
        for line, values in zip(lines, data[name].values, strict=True):
            assert line.get_ydata()[:-1] == pytest.approx(values)
    assert "Curves of the cycle by load" in words(figure)
    # Torque of the masses stands beside that of the gas where it is one curve.
    data = cycle((0.0, 50.0, 100.0))
    data["gas_torque"] = data["torque"] * 1.5
    masses = 20.0 * np.sin(2.0 * PHI)
    data["inertia_torque"] = variable("crank_angle", masses, "torque of the masses", "N m")
    figure = drawn(load_curves, load_curve_names, study_of(data, {}))["load_curves"]
    lines = [line for line in figure.axes[1].lines if len(line.get_xdata()) > 10]
    assert len(lines) == 4
    assert lines[-1].get_ydata()[:-1] == pytest.approx(masses)
    assert "torque of the masses" in words(figure).lower()
    data["inertia_torque"] = data["torque"] * 0.1  # another one at each load
    figure = drawn(load_curves, load_curve_names, study_of(data, {}))["load_curves"]
    assert len([line for line in figure.axes[1].lines if len(line.get_xdata()) > 10]) == 3
    # Speeds far apart are drawn as deviations from their means.
    data = cycle().rename(load="speed")
    data["omega"] = data["omega"] + xr.DataArray([0.0, 100.0], dims="speed")
    panel = drawn(load_curves, load_curve_names, study_of(data, {}))["speed_curves"].axes[-1]
    low, high = panel.get_ylim()
    # a hundredth of the load in rad/s, over a mean of 100 and of 200
    assert -0.8 < low < -0.5 and 0.5 < high < 0.8
    assert "(%)" in panel.get_ylabel() and "rad" not in panel.get_ylabel()


def test_of_the_journals_the_most_loaded_is_drawn() -> None:
    data = bearings()
    study = study_of(data, {})
    figure = drawn(bearing_loads, bearing_load_names, study)["bearing_loads_speed"]
    lines = figure.axes[0].lines
    expected = [
        data["crank_pin_load_max"].values, data["crank_pin_load_mean"].values,
        data["main_journal_load_max"].values[:, 1], data["main_journal_load_mean"].values[:, 1],
    ]  # fmt: skip
    assert [list(line.get_ydata()) for line in lines] == [list(values) for values in expected]
    assert "main journal 2, the most loaded: largest load" in words(figure)
    assert figure.axes[0].get_ylim()[0] == 0.0
    assert figure.axes[0].get_ylim()[1] > 6000.0
    data = data.rename({name: str(name).replace("load", "pressure") for name in data.data_vars})
    assert not bearing_load_names(study_of(data, {}).view)
    found = drawn(bearing_pressures, bearing_pressure_names, study_of(data, {}))
    figure = found["bearing_pressures_speed"]
    assert len(figure.axes[0].lines) == 4
    assert figure.axes[0].get_ylabel().startswith("Pressure of the bearing")
    assert "main journal 2, the most loaded: largest pressure" in words(figure)


COARSE = np.arange(-360.0, 360.0, 10.0)


def mechanism(speeds: Any = (1000.0, 2000.0)) -> xr.Dataset:
    """A study over speed: forces, orders, loads of two engines' journals."""
    speed, phi = np.asarray(speeds), np.radians(COARSE)
    push = 1e4 * np.exp(-(phi**2)) - speed[:, None] * np.cos(phi)
    journals = np.stack([push * np.sin(phi), push * np.cos(phi), np.full_like(push, np.nan)], 1)
    order = np.arange(1, 13) / 2
    size = 100.0 / order + 0.01 * speed[:, None]
    curve = ("speed", "crank_angle")
    journal = ("speed", "main_bearing", "crank_angle")
    return xr.Dataset(
        {
            "gas_force": variable("crank_angle", push[0] + 50.0, "force of the gas, x", "N", "P_g"),
            "piston_force": variable(curve, push, "force on the piston", "N", "P"),
            "crank_pin_radial": variable(curve, -push * np.cos(phi), "load of the crank pin", "N"),
            "crank_pin_tangential": variable(
                curve, push * np.sin(phi), "load of the crank pin across the crank", "N"),
            "piston_pin_side": variable("crank_angle", 0.2 * push[0], "load across", "N"),
            "piston_pin_down": variable("crank_angle", push[0] * np.cos(phi), "load along", "N"),
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
            "crank_angle": variable("crank_angle", COARSE, "crank angle", "degree", r"\varphi"),
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


def orders_of(panel: Any) -> list[np.ndarray]:
    """Where the bars of each value stand."""
    return [
        np.array([bar.get_x() + 0.5 * bar.get_width() for bar in bars]) for bars in panel.containers
    ]


def test_orders_are_bars_at_their_order(found: dict[str, Any]) -> None:
    figure = found["torque_order_speed"]
    panel = figure.axes[0]
    one, other = orders_of(panel)  # of each speed
    assert 0.5 * (one + other) == pytest.approx(np.arange(1, 13) / 2)
    widths = [bar.get_width() for bars in panel.containers for bar in bars]
    assert other - one == pytest.approx(widths[0])  # side by side
    assert 2.0 * max(widths) < 0.5  # no order touches the next
    assert "Order" in words(figure)
    (single,) = orders_of(found["phase_vector_sum"].axes[0])
    sums = mechanism()["phase_vector_sum"].values
    assert single == pytest.approx(np.arange(1, 13)[sums > 0] / 2)
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
