"""Strokes, crank star, crank train and waterfall: what is drawn, from datasets made here."""

import json
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from sweeps.errors import SceneError
from sweeps.figures.crank_train import directions, mechanism
from sweeps.figures.drawing import figure
from sweeps.figures.options import options_of
from sweeps.figures.study import study_of
from tests.support.figures import variable, words

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
    begin, end, colour = bars(drawn, 0)[1]
    assert (begin, end) == (180.0, 360.0)
    assert drawn.axes[0].get_xlim() == (0.0, 720.0)
    assert bars(drawn, 1)[2] == (360.0, 540.0, colour)
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
    assert "at 25° crank angle" in words(drawn)
    data = cylinder()
    largest = float(data["tangential_force"].idxmax())
    assert f"at {largest:g}° crank angle" in words(figure(data, "crank_train"))
    turned = figure(data, "crank_train", options_of(angle="0..720", zero="bdc"))
    assert f"at {largest + 180.0:g}° crank angle" in words(turned)


def test_the_stems_of_a_waterfall_stand_on_their_speeds_to_one_scale() -> None:
    data = engine()
    panel = figure(data, "waterfall").axes[0]
    stems = [(p.get_x() + 0.5 * p.get_width(), p.get_y(), p.get_height()) for p in panel.patches]
    per_unit = {(order, speed): height for order, speed, height in stems}
    assert set(per_unit) == {
        (order, speed) for order in (2.0, 4.0) for speed in (1000.0, 2000.0, 3000.0, 4000.0)
    }
    scale = per_unit[2.0, 4000.0] / 4000.0
    for (order, speed), height in per_unit.items():
        amplitude = float(data["torque_order"].sel(speed=speed, order=order))
        assert height == pytest.approx(scale * amplitude)
    assert "2000 N m" in words(figure(data, "waterfall"))


@pytest.mark.parametrize(
    ("data", "kind", "options", "said"),
    [
        (engine(ONE), "strokes", {}, "not available for this archive; it needs two cylinders or"),
        (cylinder(pin_offset=0.001), "crank_train", {},
         "crank_train: not available for this archive; it needs tangential_force"),
        (cylinder(), "crank_train", {"at": 400},
         "at 400: the crank angle is from -360 to 360 degrees"),
        (cylinder(), "crank_train", {"at": "top"}, "at 'top': must be a crank angle in degrees"),
        (engine().isel(speed=[0, 1]), "waterfall", {}, "three speeds or more"),
    ],
    ids=["one cylinder", "offsets", "outside the cycle", "no angle", "two speeds"],
)  # fmt: skip
def test_figures_that_cannot_be(data: xr.Dataset, kind: str, options: Any, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        figure(data, kind, options_of(**options))
