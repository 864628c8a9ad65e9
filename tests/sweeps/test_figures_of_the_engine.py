"""Strokes, crank star and train, order map, and a shaft that twists: what is drawn."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import QuadMesh
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

import sweeps
from engine_dyn.status import STALLED
from sweeps.base.errors import SceneError
from sweeps.view.figures.crank_train import directions, mechanism
from sweeps.view.figures.drawing import figure, figures
from sweeps.view.figures.options import options_of
from sweeps.view.figures.shaft_modes import (
    crossings,
    joined_neighbours,
    zero_crossings,
)
from sweeps.view.figures.shaft_response import sum_of_orders
from sweeps.view.figures.study import study_of
from tests.support.figures import assert_inside, plates, variable, words

FOUR = {
    "name": "in-line 4", "period": 720.0, "firing_angles": [0.0, 540.0, 180.0, 360.0],
    "throws": [0.0, 180.0, 180.0, 0.0], "positions": [0.0, 1.0, 2.0, 3.0], "banks": [0.0] * 4,
    "pressure_factor": [1.0] * 4, "radius_factor": [1.0] * 4,
}  # fmt: skip
TWO = FOUR | {
    "name": "in-line 2", "period": 360.0, "firing_angles": [0.0, 180.0], "throws": [0.0, 180.0],
    "positions": [0.0, 1.0], "banks": [0.0] * 2, "pressure_factor": [1.0] * 2,
    "radius_factor": [1.0] * 2,
}  # fmt: skip
ONE = {key: value[:1] if isinstance(value, list) else value for key, value in FOUR.items()}
RATIO, AREA, MASS = 0.3, 0.005, 2.0


def engine(described: Any = FOUR, **parameters: float) -> xr.Dataset:
    """An archive that describes its cylinders, over crank angle, order and speed."""
    half = (described["period"] if isinstance(described, dict) else 720.0) / 2.0
    angles = np.arange(-half, half, 2.0)
    speed, order = np.array([1000.0, 2000.0, 3000.0, 4000.0]), np.arange(0.5, 6.5, 0.5)
    return xr.Dataset(
        {
            "torque_order": variable(
                ("speed", "order"), speed[:, None] * (order == 2.0) + 500.0 * (order == 4.0),
                "amplitude of the torque", "N m",
            )
        },
        coords={
            "speed": variable("speed", speed, "engine speed", "rpm", "n"),
            "order": variable("order", order, "order", "1"),
            "crank_angle": variable("crank_angle", angles, "crank angle", "degree"),
        },
        attrs={"arrangement": json.dumps(described), "parameters": json.dumps(parameters)},
    )  # fmt: skip


def cylinder(**more: float) -> xr.Dataset:
    """Forces of one cylinder without offsets, by Kakaitsas's formulas."""
    angles = np.arange(-360.0, 360.0, 1.0)
    phi = np.radians(angles)
    beta = np.arcsin(RATIO * np.sin(phi))
    gas = 1e6 * AREA * np.exp(-((phi - 0.2) ** 2) * 8.0)
    inertia = -MASS * 300.0 * (np.cos(phi) + RATIO * np.cos(2.0 * phi))
    piston = gas + inertia
    rod = piston / np.cos(beta)
    curves = {
        "gas_force": (gas, "P_g"),
        "inertia_force": (inertia, "P_l"),
        "rod_force": (rod, "S"),
        "wall_thrust": (piston * np.tan(beta), "N"),
        "tangential_force": (rod * np.sin(phi + beta), "T"),
        "radial_force": (rod * np.cos(phi + beta), "R"),
    }
    return xr.Dataset(
        {
            name: variable("crank_angle", values, name.replace("_", " "), "N", symbol)
            for name, (values, symbol) in curves.items()
        },
        coords={"crank_angle": variable("crank_angle", angles, "crank angle", "degree")},
        attrs={"parameters": json.dumps({"crank_ratio": RATIO, "bore": 0.1, **more})},
    )  # fmt: skip


def bars(drawn: Figure, row: int) -> list[tuple[float, float, str]]:
    """Bars of one row: begin, end, and the colour of the face."""
    patches = [p for p in drawn.axes[0].patches if isinstance(p, Rectangle)]
    here = [p for p in patches if abs(p.get_y() + 0.5 * p.get_height() - row) < 0.1]
    found = [(p.get_x(), p.get_x() + p.get_width(), str(p.get_facecolor())) for p in here]
    return sorted(found)


def test_strokes_of_cylinders() -> None:
    drawn = figure(engine(), "strokes")
    panel = drawn.axes[0]
    ticks = [label.get_text() for label in panel.get_yticklabels()]
    assert ticks == ["cylinder 1", "cylinder 3", "cylinder 4", "cylinder 2"]
    # firings at 0, 180, 360 (the same as -360) and 540 (-180) of cylinder 1's angle
    power = bars(drawn, 0)[2][2]
    for row, fires in enumerate((0.0, 180.0, -360.0, -180.0)):
        here = [(begin, end) for begin, end, colour in bars(drawn, row) if colour == power]
        assert here == [(fires, fires + 180.0)]
    assert "firing order 1-3-4-2" in words(drawn)
    assert words(drawn).count("compression") == 4
    drawn = figure(engine(), "strokes", options_of(angle="0..720", zero="bdc"))
    # 0 is the bottom dead centre before compression: cylinder 1 fires at 180
    assert bars(drawn, 0)[1] == (180.0, 360.0, power)
    assert drawn.axes[0].get_xlim() == (0.0, 720.0)
    assert bars(drawn, 1)[2] == (360.0, 540.0, power)
    shifted = FOUR | {"firing_angles": [0.0, 90.0, 300.0, 450.0]}
    drawn = figure(engine(shifted), "strokes")
    for row in range(4):
        covered = bars(drawn, row)
        assert covered[0][0] == -360.0 and covered[-1][1] == 360.0
        assert sum(end - begin for begin, end, _ in covered) == pytest.approx(720.0)
    assert len(bars(drawn, 2)) == 5
    drawn = figure(engine(TWO), "strokes")
    assert [(b, e) for b, e, _ in bars(drawn, 0)] == [(-180.0, 0.0), (0.0, 180.0)]
    assert "exhaust" not in words(drawn)
    silent = figure(engine(FOUR | {"pressure_factor": [1.0, 0.0, 1.0, 1.0]}), "strokes")
    assert words(silent).count("no firing") == 1
    assert words(silent).count("power") == 3


def test_throws_of_the_crank_star() -> None:
    throws = [0.0, 120.0, 240.0, 240.0]
    drawn = figure(engine(FOUR | {"throws": throws}), "crank_star")
    side = drawn.axes[0]
    numbers = {t.get_text(): t.get_position()[1] for t in side.texts if t.get_weight() == "bold"}
    assert set(numbers) == {"1", "2", "3", "4"}
    # beyond the pin, on the side where it stands
    assert numbers["1"] == pytest.approx(1.0 + 0.24)
    for name in "234":
        assert numbers[name] == pytest.approx(-0.5 - 0.24)
    journals = [t.get_text() for t in side.texts if t.get_weight() != "bold"]
    assert journals == ["1", "2", "3", "4", "5"]
    star = {t.get_text() for t in drawn.axes[1].texts if t.get_text()}
    assert star == {"1", "2", "3, 4"}
    vee = FOUR | {"throws": [0.0, 0.0, 180.0, 180.0], "positions": [0.0, 0.0, 1.0, 1.0]}
    side = figure(engine(vee), "crank_star").axes[0]
    assert [t.get_text() for t in side.texts if t.get_weight() == "bold"] == ["1, 2", "3, 4"]
    plain = figure(engine(), "crank_star")
    drawn = figure(engine(counterweight_fraction=0.5), "crank_star")
    assert len(drawn.axes[0].patches) == len(plain.axes[0].patches) + 8
    assert "counterweights for the fraction 0.5" in words(drawn)
    assert "counterweights" not in words(plain)


def places(data: xr.Dataset, at: int) -> Any:
    view = study_of(data, {}).view
    return mechanism(view, at), {str(n): float(data[n].values[at]) for n in data.data_vars}


@pytest.mark.parametrize("degrees", [-300.0, -40.0, 25.0, 110.0, 200.0])
def test_the_forces_of_the_drawing_are_in_balance(degrees: float) -> None:
    place, force = places(cylinder(), int(degrees + 360.0))
    vectors = {n: force[n] * direction for n, (_, direction) in directions(place).items()}
    size = max(abs(value) for value in force.values())
    # the rod is as long as the crank ratio says, and the piston stands on the cylinder's line
    assert np.hypot(*(place.pin - place.wrist)) == pytest.approx(1.0 / RATIO)
    assert place.wrist[0] == pytest.approx(0.0, abs=1e-12)
    pin = vectors["tangential_force"] + vectors["radial_force"]
    assert vectors["rod_force"] == pytest.approx(pin, abs=1e-9 * size)
    on_piston = vectors["gas_force"] + vectors["inertia_force"] - vectors["wall_thrust"]
    assert vectors["rod_force"] == pytest.approx(on_piston, abs=1e-9 * size)


def test_arrows_of_the_crank_train_and_its_angle() -> None:
    data = cylinder()
    drawn = figure(data, "crank_train", options_of(at=25))
    arrows = [
        (np.subtract(a.xy, a.xyann), a) for a in drawn.axes[0].texts
        if getattr(a, "arrow_patch", None) is not None
    ]  # fmt: skip
    lengths = sorted(float(np.hypot(*vector)) for vector, _ in arrows)
    forces = sorted(abs(float(data[name].sel(crank_angle=25.0))) for name in data.data_vars)
    assert np.array(lengths) / lengths[-1] == pytest.approx(np.array(forces) / forces[-1])
    panel = drawn.axes[0]
    symbols = [a for a in panel.texts if a.get_text() and hasattr(a, "xyann")]
    assert len(symbols) == len(arrows)
    for x, y in (symbol.xy for symbol in symbols):  # others are not written
        assert panel.viewLim.contains(x, y)
    assert "at 25° crank angle" in words(drawn)
    data = cylinder()
    largest = float(data["tangential_force"].idxmax())
    assert f"at {largest:g}° crank angle" in words(figure(data, "crank_train"))
    turned = figure(data, "crank_train", options_of(angle="0..720", zero="bdc"))
    assert f"at {largest + 180.0:g}° crank angle" in words(turned)


@pytest.mark.parametrize(
    ("data", "kind", "options", "said"),
    [
        (engine(ONE), "strokes", {}, "not available for this archive; it needs two cylinders or"),
        (cylinder(pin_offset=0.001), "crank_train", {},
         "crank_train: not available for this archive; it needs tangential_force"),
        (cylinder(), "crank_train", {"at": 400},
         "at 400: the crank angle is from -360 to 360 degrees"),
        (cylinder(), "crank_train", {"at": "top"}, "at 'top': must be a crank angle in degrees"),
        (engine().isel(speed=[0, 1]), "order_map", {}, "three speeds or more"),
    ],
    ids=["one cylinder", "offsets", "outside the cycle", "no angle", "two speeds"],
)  # fmt: skip
def test_figures_that_cannot_be(data: xr.Dataset, kind: str, options: Any, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        figure(data, kind, options_of(**options))


def test_an_order_map_shows_small_orders_beside_large_ones() -> None:
    speed, order = np.array([1000.0, 2000.0, 4000.0]), np.array([1.0, 1.5, 3.0])
    sizes = np.outer([1.0, 2.0, 3.0], [1000.0, -1.0, 0.0])
    sizes[1] = np.nan
    data = xr.Dataset(
        {"torque_order": variable(("speed", "order"), sizes, "amplitude", "N m"),
         "status": ("speed", np.array([0, STALLED, 0]), {"flag_values": [0, STALLED],
                                                         "flag_meanings": "converged stalled"})},
        coords={"speed": variable("speed", speed, "speed", "rpm"), "order": order},
    )  # fmt: skip
    drawn = figure(data, "order_map")
    panel = drawn.axes[0]
    (mesh,) = (one for one in panel.collections if isinstance(one, QuadMesh))
    colours = np.ma.filled(mesh.get_array(), np.nan)
    np.testing.assert_array_equal(colours[:, [0, 2, 4]], np.where(sizes == 0, np.nan, abs(sizes)))
    assert np.isnan(colours[:, [1, 3]]).all()
    assert isinstance(mesh.norm, LogNorm) and (mesh.norm.vmin, mesh.norm.vmax) == (1.0, 3000.0)
    middle = mesh.get_coordinates()[0].reshape(-1, 2, 2)[:, :, 0].mean(axis=1)
    np.testing.assert_allclose(middle, order)
    assert panel.get_ylim() == (1000.0, 4000.0) and panel.get_xlim() == (0.75, 1.75)
    assert "Stalled" in words(drawn)


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


def test_parts_without_a_limit_have_no_panel_and_the_limit_is_a_line() -> None:
    data = shaft((0.0, 1.0)).drop_vars("mode_vector_sum")
    half = shaft((0.0, 1.0))["shaft_torque_half_range"].values / 2000.0
    half[:, :, 1] = np.nan  # The ring's shaft has no limit
    data["shaft_torque_over_limit"] = variable(
        ("speed", "misfire", "shaft"), half, "torque over its limit", "1"
    )
    data["damping_ratio"] = variable("mode", [0.01, 0.03], "damping ratio", "1")
    found = plates(data, laid_out=True)
    for stem, one in found.items():
        assert_inside(stem, one)
    over = found["shaft_torque_over_limit_speed_by_shaft"]
    (panel,) = over.axes
    assert "1 of 2 values of shaft without numbers left out" in words(over)
    levels = [line for line in panel.get_lines() if list(line.get_ydata()) == [1.0, 1.0]]
    assert len(levels) == 1 and "Limit" in words(over)
    # Nothing lies between two modes, and without vector sums the diagram says what is missing.
    (points,) = found["damping_ratio_mode"].axes[0].get_lines()
    assert points.get_linestyle() == "None"
    assert "mode_vector_sum to [output] quantities" in words(found["campbell"])
    assert "mode_vector_sum" not in words(plates(shaft())["campbell"])


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


def test_frequencies_of_orders_are_drawn_only_where_asked_for() -> None:
    data = engine()
    hertz = data["speed"].variable / 60.0 * data["order"].variable
    data["order_frequency"] = variable(("speed", "order"), hertz.values, "frequency", "Hz")
    assert not [name for name in plates(data) if "frequency" in name]
    asked = figures(data, options_of(quantities="order_frequency"))
    assert [name for name in asked if "frequency" in name]


@pytest.mark.compiled
def test_an_archive_of_a_scene_gets_them_all() -> None:
    data = sweeps.run(
        engine="diesel_105x137",
        shaft="diesel_105x137_generator_set",
        axes={"speed": [1400.0, 1600.0, 2166.0], "misfire": [0, 3]},
        output={"quantities": [
            "natural_frequency", "mode_shape", "mode_vector_sum", "critical_speed",
            "damped_critical_speed", "shaft_torque_order", "shaft_torque_phase",
            "shaft_torque_half_range", "shaft_loss",
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
    assert "damped_critical_speed_map" not in found
    for stem, one in found.items():
        assert_inside(stem, one)
    # what is summed here is what the archive has by its own way
    total = np.asarray(line(found["shaft_torque_cycle"], "sum of all orders").get_ydata())
    largest = float(data.shaft_torque_half_range.isel(misfire=0).max())
    assert 0.5 * np.ptp(total) == pytest.approx(largest, rel=1e-3)
