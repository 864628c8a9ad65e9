"""Pressure over volume or travel: there and back again, and loops that are refused."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

import sweeps
from engine_dyn.geometry import slider_crank
from sweeps.lab.pressure.reading import read_pressure
from tests.support.scenes import refusal_of, write_scene

NAMES = "volume_cm3,pressure_bar\n"


@pytest.fixture(scope="module")
def ntua() -> Any:
    return sweeps.run(
        {"engine": "ntua", "output": {"quantities": [
            "pressure", "cylinder_volume", "position", "delta", "imep", "displacement"]}}
    )  # fmt: skip


def rows(*columns: Any) -> str:
    return "\n".join(",".join(f"{v!r}" for v in row) for row in zip(*columns, strict=True)) + "\n"


def lists(data: Any, *names: str) -> list[list[float]]:
    return [data[name].values.tolist() for name in names]


@pytest.mark.parametrize("rolled", [0, 77, 180, 360, 541])
def test_from_angle_to_volume_and_back(ntua: Any, tmp_path: Path, rolled: int) -> None:
    """The same points come back: the inverse of the travel is exact, wherever the loop begins."""
    volume, pressure = (np.roll(v, rolled).tolist() for v in lists(
        ntua, "cylinder_volume", "pressure"))  # fmt: skip
    path = tmp_path / "loop.csv"
    path.write_text(NAMES + rows(volume, pressure))
    found = read_pressure(path, volume_column="volume_cm3", engine="ntua").mean
    # at the dead centres the angle goes as the root of the volume: 1e-16 of it are 1e-8
    assert np.degrees(found.angle) == pytest.approx(ntua.crank_angle.values, abs=3e-6)
    assert found.pressure[0] == pytest.approx(ntua.pressure.values * 1e5, rel=1e-12)


def test_a_scene_takes_the_loop(ntua: Any, tmp_path: Path) -> None:
    (tmp_path / "loop.csv").write_text(NAMES + rows(*lists(ntua, "cylinder_volume", "pressure")))
    (tmp_path / "points.csv").write_text(
        "crank_angle_deg,pressure_bar\n" + rows(*lists(ntua, "crank_angle", "pressure"))
    )
    found = {}
    for name, keys in (("loop", {"volume_column": 1}), ("points", {})):
        table = {"file": f"{name}.csv", **keys}
        found[name] = sweeps.run(write_scene(tmp_path, ["delta", "imep"], indicator=table))
    for name in ("delta", "imep"):
        assert float(found["loop"][name]) == pytest.approx(float(found["points"][name]), rel=1e-7)
    notes = found["loop"].attrs["indicator_notes"]
    assert "pressure over volume: crank angles of 720 points" in str(notes)


@pytest.mark.parametrize(
    ("engine", "column", "scale", "unit"),
    [("ntua", "x/s [%]", 100.0, None), ("ntua", "x [mm]", 180.0, None), ("ntua", "x", 1.0, None),
     ("marine_80x345", "travel", 345.0, "cm")],
)  # fmt: skip
def test_from_angle_to_travel_and_back(
    tmp_path: Path, engine: str, column: str, scale: float, unit: str | None
) -> None:
    data = sweeps.run({"engine": engine, "output": {"quantities": ["pressure", "position"]}})
    travel = (0.5 * scale * data["position"].values).tolist()
    path = tmp_path / "loop.csv"
    path.write_text(f"{column},p [bar]\n" + rows(travel, *lists(data, "pressure")))
    more = {} if unit is None else {"travel_unit": unit}
    # By number, and by its name as it stands in the file, unit and all.
    for wanted in (1, column):
        read = read_pressure(path, travel_column=wanted, engine=engine, **more)
        assert np.degrees(read.mean.angle) == pytest.approx(data.crank_angle.values, abs=3e-6)
        assert read.mean.period == pytest.approx(2 * math.pi if engine != "ntua" else 4 * math.pi)


def test_points_that_are_even_in_travel(ntua: Any, tmp_path: Path) -> None:
    """Coarse at the dead centres: imep and delta are as near as the spline through the points."""
    ratio, count = 0.09 / 0.35, 400
    parts = np.linspace(0.0, 1.0, count + 1)

    def angle_at(part: float) -> float:  # going down, by bisection
        if part in (0.0, 1.0):
            return math.pi * part
        return float(
            brentq(lambda phi: slider_crank.position(phi, ratio) - 2.0 * part, 0.0, math.pi,
                   xtol=1e-14)
        )  # fmt: skip

    down = np.array([angle_at(float(part)) for part in parts])
    half = np.concatenate([-down[::-1], down[1:]])[:-1]  # from bottom to just before bottom
    angles = np.concatenate([half - 2.0 * math.pi, half])[count:]
    angles = np.concatenate([angles, half[:count] + 2.0 * math.pi])  # -360 to 360 degrees
    grid = np.radians(ntua.crank_angle.values)
    closed = np.append(ntua.pressure.values, ntua.pressure.values[0])
    exact = CubicSpline(np.append(grid, 2.0 * math.pi), closed, bc_type="periodic")
    travel = 0.5 * slider_crank.position(angles, ratio)
    pressure = exact(angles)
    path = tmp_path / "loop.csv"
    path.write_text("x,p_bar\n" + rows(travel.tolist(), pressure.tolist()))
    scene = {"engine": "ntua", "indicator": {"file": str(path), "travel_column": "x"}}
    found = sweeps.run({**scene, "output": {"quantities": ["pressure", "delta", "imep"]}})
    # the spline through these points, by another library
    through = CubicSpline(
        np.append(angles, angles[0] + 4.0 * math.pi), np.append(pressure, pressure[0]),
        bc_type="periodic",
    )  # fmt: skip
    wanted = through((grid - angles[0]) % (4.0 * math.pi) + angles[0])
    assert found["pressure"].values == pytest.approx(wanted, abs=1e-6)
    # What it misses, integrated over the volume, bounds the error of work and speed.
    fine = np.linspace(-2.0 * math.pi, 2.0 * math.pi, 20001)
    missed = np.abs(through(fine) - exact(fine)) * np.abs(slider_crank.velocity(fine, ratio))
    work = float(missed.mean()) * 4.0 * math.pi * 0.5  # bar, over the swept volume
    assert work < 0.05
    assert float(found["imep"]) == pytest.approx(float(ntua["imep"]), abs=work)
    energy = work * 1e5 * float(ntua["displacement"])
    # omega_max - omega_min changes by the energy over Theta omega, on each side
    limit = 2.0 * energy / (2.0 * (40.0 * math.pi) ** 2)
    assert float(found["delta"]) == pytest.approx(float(ntua["delta"]), abs=limit)


def loop(folder: Path, travel: Any, pressure: Any, *more: Any, head: str = "x,p_bar") -> Path:
    path = folder / "loop.csv"
    columns = [np.asarray(column).tolist() for column in (travel, pressure, *more)]
    path.write_text(head + "\n" + rows(*columns))
    return path


ANGLE = np.radians(np.arange(-360.0, 360.0, 4.0))
TRAVEL = 0.5 * slider_crank.position(ANGLE, 0.25)
PRESSURE = 1.0 + 40.0 * np.exp(-((ANGLE / 0.5) ** 2)) + 3.0 * np.exp(-(((ANGLE - 0.6) / 0.5) ** 2))


def changed(at: int, value: float) -> list[float]:
    values = TRAVEL.tolist()
    values[at] = value
    return values


@pytest.mark.parametrize(
    ("travel", "keys", "message"),
    [
        (TRAVEL, {"travel_column": "y"}, r"travel_column = 'y': no such column"),
        (TRAVEL, {"travel_column": "x [mm]"}, r"travel_column = 'x \[mm\]': no such column"),
        (TRAVEL, {"volume_column": 1}, r"travel_column: only one of them"),
        (TRAVEL, {"angle_column": 1}, r"travel_column and angle_column: only one of them"),
        (TRAVEL, {"zero": "BDC"}, r"travel_column and zero: only one of them"),
        (TRAVEL, {"crank_ratio": None}, r"travel_column: needs crank_ratio, or an engine"),
        (TRAVEL, {"travel_unit": "mm"}, r"column 'x': in mm: needs an engine with its stroke"),
        (TRAVEL, {"travel_unit": "bar"}, r"column 'x': unit 'bar'; must have travel_unit out of 1"),
        (TRAVEL * 2.0, {}, r"line 47, column 'x': lies at 2 of the stroke .* must be from 0 to 1"),
        (changed(20, 0.9), {}, r"line 2\d, column 'x': turns back at 0.\d+ of the stroke; must "),
        (TRAVEL * 0.9, {}, r"turns back at 0.9 of the stroke; must rise on to within 0.02"),
        (TRAVEL[:90], {}, r"passes 2 dead centres; must be 4 in the order of the strokes"),
        (np.full(40, 0.5), {}, r"column 'x': the piston does not move"),
        (TRAVEL, {"stroke_column": 2},
         r"line 47, column 'p_bar': '1': must be one of 1 \(intake\)"),
    ],
)  # fmt: skip
def test_loops_that_are_refused(
    tmp_path: Path, travel: Any, keys: dict[str, Any], message: str
) -> None:
    path = loop(tmp_path, np.asarray(travel).tolist(), PRESSURE[: len(travel)].tolist())
    given = {"travel_column": "x", "crank_ratio": 0.25, **keys}
    line = refusal_of(
        lambda: read_pressure(
            path, **{key: value for key, value in given.items() if value is not None}
        )
    )
    assert re.search(message, line)
    assert "loop.csv" in line


def test_strokes_and_points_that_are_refused(tmp_path: Path) -> None:
    strokes = np.repeat([1, 2, 4, 3], 45)
    path = loop(tmp_path, TRAVEL, PRESSURE, strokes.tolist(), head="x,p_bar,stroke")
    keys = {"travel_column": "x", "stroke_column": "stroke", "crank_ratio": 0.25}
    with pytest.raises(sweeps.SceneError, match="exhaust follows compression; must be expansion"):
        read_pressure(path, **keys)
    strokes = np.repeat([2, 3, 4, 1], 45)
    path = loop(tmp_path, TRAVEL, PRESSURE, strokes.tolist(), head="x,p_bar,stroke")
    with pytest.raises(sweeps.SceneError, match=r"of the stroke; must fall in compression"):
        read_pressure(path, **keys)
    path = loop(tmp_path, TRAVEL, PRESSURE, ["in"] * 180, head="x,p_bar,stroke")
    with pytest.raises(sweeps.SceneError, match=r"must be one of 1 \(intake\), 2 \(compression\)"):
        read_pressure(path, **keys)
    with pytest.raises(sweeps.SceneError, match=r"must be one of 2 \(compression\), 3 \(expans"):
        read_pressure(path, **keys, two_stroke=True)
    travel, pressure = TRAVEL.tolist(), PRESSURE.tolist()
    travel.insert(100, travel[100])
    pressure.insert(100, pressure[100] + 5.0)
    path = loop(tmp_path, travel, pressure)
    with pytest.raises(sweeps.SceneError, match="at one piston position near crank angle"):
        read_pressure(path, travel_column="x", crank_ratio=0.25)
    keep = ~((np.degrees(ANGLE) > 60.0) & (np.degrees(ANGLE) < 100.0))
    path = loop(tmp_path, TRAVEL[keep], PRESSURE[keep])
    with pytest.raises(sweeps.SceneError, match=r"line 108, column 'x': the crank turns by 40 deg"):
        read_pressure(path, travel_column="x", crank_ratio=0.25)
