"""Engines posed by their torque over the crank angle, from scenes and engine files."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from sweeps.reading.engine_files import load_engine
from tests.support.commands import ok, refused

pytestmark = pytest.mark.compiled

ENGINE = """
title = "25 - 8 sin(3 theta) kN m"
[values]
inertia = 900
speed = 420
load_exponent = 0
load_offset = 0
[[diagram]]
kind = "torque"
"""
CLOSED = "mean = 25e3\nharmonics = [{order = 3, sine = -8e3}]"
LOAD = {"mean": 25e3, "harmonics": [{"order": 1, "sine": 4.2e3}]}


def posed(folder: Path, diagram: str, quantities: list[str], **scene: Any) -> xr.Dataset:
    """Results of a scene on an engine with this diagram."""
    file = folder / "engine.toml"
    file.write_text(ENGINE + diagram, encoding="utf-8")
    found: xr.Dataset = sweeps.run(
        {"engine": str(file), "output": {"quantities": quantities}, **scene}
    )
    return found


def test_constant_load(tmp_path: Path) -> None:
    found = posed(
        tmp_path, CLOSED,
        ["delta", "energy_swing", "energy_fluctuation", "delta_energy_swing", "torque_mean",
         "brake_power", "torque_max", "torque_min", "torque"],
    )  # fmt: skip
    assert found.delta == pytest.approx(0.0030634, rel=2e-5)
    assert found.energy_swing == pytest.approx(5333.333, rel=1e-6)
    assert found.energy_fluctuation == pytest.approx(5333.333 / (2 * np.pi * 25e3), rel=1e-6)
    assert found.delta_energy_swing == pytest.approx(5333.333 / (900 * 44**2), rel=1e-3)
    assert (found.torque_mean, found.torque_max, found.torque_min) == pytest.approx(
        (25e3, 33e3, 17e3), rel=1e-8
    )
    assert found.brake_power == pytest.approx(25e3 * 14 * np.pi, rel=1e-9)
    assert_allclose(found.torque, 25e3 - 8e3 * np.sin(3 * np.radians(found.crank_angle)), rtol=1e-9)


def test_load_in_closed_form_and_its_crossings(tmp_path: Path) -> None:
    found = posed(
        tmp_path, CLOSED, ["delta", "energy_swing", "crossing_angle", "crossing_energy"],
        set={"load_table": LOAD},
    )  # fmt: skip
    assert found.delta == pytest.approx(0.0078882, rel=2e-5)
    assert found.energy_swing == pytest.approx(13733.333, rel=1e-6)
    # 8 sin(3 theta) + 4.2 sin(theta) = 0: theta = 0, 180 degrees, and sin^2(theta) = 28.2/32.
    steep = np.degrees(np.arcsin(np.sqrt(28.2 / 32.0)))
    angles = [-180.0, steep - 180.0, -steep, 0.0, steep, 180.0 - steep]
    assert_allclose(found.crossing_angle[:6], angles, atol=1e-6)
    energy = 8e3 / 3.0 * np.cos(3 * np.radians(angles)) + 4.2e3 * np.cos(np.radians(angles))
    assert_allclose(found.crossing_energy[:6], energy, atol=1e-3)
    assert np.isnan(found.crossing_angle[6:]).all()


def test_load_over_three_revolutions(tmp_path: Path) -> None:
    load = {"mean": 0.0, "harmonics": [{"order": 1 / 3, "sine": 4.2e3}]}
    found = posed(
        tmp_path, CLOSED, ["energy_swing", "omega", "delta"],
        set={"load_table": load}, axes={"load_exponent": [0, 2]},
    )  # fmt: skip
    assert found.crank_angle.size == 3 * 360
    theta = np.linspace(0.0, 6.0 * np.pi, 100_001)
    work = 8.0 / 3.0 * np.cos(3.0 * theta) + 12.6 * np.cos(theta / 3.0)
    assert found.energy_swing == pytest.approx(1e3 * np.ptp(work), rel=1e-6)
    each = found.omega.max("crank_angle") - found.omega.min("crank_angle")
    assert_allclose(each / found.omega.mean("crank_angle"), found.delta, rtol=1e-3)


def test_four_revolutions_and_a_stated_cycle(tmp_path: Path) -> None:
    half = "mean = 100.0\nharmonics = [{order = 0.25, cosine = 50.0}]"
    found = posed(tmp_path, half, ["energy_swing", "energy_fluctuation"])
    assert found.energy_swing == pytest.approx(2 * 50.0 / 0.25, rel=1e-6)
    assert found.energy_fluctuation == pytest.approx(400.0 / (8 * np.pi * 100.0), rel=1e-6)
    stated = tmp_path / "stated.toml"
    stated.write_text('cycle = "four-stroke"\n' + ENGINE + CLOSED)
    assert load_engine(stated, tmp_path).period == pytest.approx(4.0 * np.pi)


@pytest.mark.parametrize("crossings", ["", "crossings = [0, 70, 190, 250, 360]"])
def test_areas_give_the_swing_of_their_levels(tmp_path: Path, crossings: str) -> None:
    areas = "mean = 400\nareas = [300, -500, 420, -220]\n"
    found = posed(tmp_path, areas + crossings, ["energy_swing", "torque_mean", "crossing_energy"])
    assert found.energy_swing == pytest.approx(500.0, rel=1e-4)  # levels 300, -200, 220, 0
    assert found.torque_mean == pytest.approx(400.0, rel=1e-9)
    levels = np.sort(found.crossing_energy.dropna("crossing").values)
    assert_allclose(np.diff(levels), [200.0, 220.0, 80.0], rtol=2e-3)


def test_orders_are_those_of_the_closed_form(tmp_path: Path) -> None:
    closed = "mean = 9.0\nharmonics = [{order = 0.5, cosine = 4}, {order = 3, sine = -8}]"
    found = posed(tmp_path, closed, ["torque_order", "torque_phase"])
    amplitude, phase = (found[name].sel(order=[0.5, 1.0, 3.0]) for name in found.data_vars
                        if name != "status")  # fmt: skip
    assert_allclose(amplitude, [4.0, 0.0, 8.0], atol=1e-9)
    assert_allclose(phase[[0, 2]], [0.0, 90.0], atol=1e-7)


@pytest.mark.parametrize(
    ("name", "text", "more"),
    [
        ("a.csv", "angle [deg];torque [kN m]\n{rows}", ""),
        ("b.csv", "torque_kNm,crank_angle_rad\n{turned}", ""),
        ("c.txt", "t\tphi\tM\n{three}", 'angle_column = "phi"\ntorque_column = "M"\n'
         'torque_unit = "kN m"'),
    ],
)  # fmt: skip
def test_file_in_any_unit(tmp_path: Path, name: str, text: str, more: str) -> None:
    pytest.importorskip("pint")
    theta = np.arange(0.0, 360.0, 1.0)
    torque = 25.0 - 8.0 * np.sin(3.0 * np.radians(theta))
    rows = "\n".join(f"{a:g};{t:.9f}" for a, t in zip(theta, torque, strict=True))
    turned = "\n".join(f"{t:.9f},{a:.12f}" for a, t in zip(np.radians(theta), torque, strict=True))
    three = "\n".join(f"{a / 2520:.6f}\t{a:g}\t{t:.9f}" for a, t in zip(theta, torque, strict=True))
    (tmp_path / name).write_text(text.format(rows=rows, turned=turned, three=three))
    found = posed(tmp_path, f'file = "{name}"\n{more}', ["energy_swing", "torque_mean"])
    assert found.energy_swing == pytest.approx(5333.333, rel=1e-5)
    assert found.torque_mean == pytest.approx(25e3, rel=1e-7)


@pytest.mark.parametrize(
    ("head", "rows", "more", "message"),
    [
        ("crank_angle_deg,torque_Nm", "60,1\n75,1\n90,nan", "", "'torque_Nm', line 5: a bla"),
        ("crank_angle_deg,torque_Nm", "90,1e308", "", "column 'torque_Nm', line 3: 1e.308: must"),
        ("crank_angle_deg,torque_Nm", "-1,1", "", "column 'crank_angle_deg', in deg: point 2: an"),
        ("crank_angle_rad,torque_Nm", "90,1", "", "column 'crank_angle_rad', in rad: point 2: an"),
        ("crank_angle_deg,torque_bar", "90,1", "", "torque_unit = 'bar': must be a unit of torq"),
        ("phi,M", "90,1", "torque_column = 1\nangle_column = 1", "must not be both angle and torq"),
        # The other of two columns is the torque.
        ("M_Nm,phi", "90,1", "angle_column = 'phi'", "column 'phi', in deg: point 3: an"),
    ],
)  # fmt: skip
def test_no_torque_in_the_file(
    tmp_path: Path, head: str, rows: str, more: str, message: str
) -> None:
    pytest.importorskip("pint")
    later = [f"{phi},0" for phi in range(120, 361, 30)]
    (tmp_path / "bad.csv").write_text("\n".join([head, "0,0", rows, *later]))
    with pytest.raises(sweeps.SceneError, match=message) as refused:
        posed(tmp_path, f'file = "bad.csv"\n{more}', ["delta"])
    assert str(refused.value).count("[[diagram]]") == 1


def test_factor_is_an_axis_and_the_inertia_follows(tmp_path: Path) -> None:
    found = posed(
        tmp_path, CLOSED, ["inertia_required", "inertia_energy_swing", "torque_mean"],
        set={"wanted_delta": 0.0030634}, axes={"torque_factor": [0.5, 1.0]},
    )  # fmt: skip
    assert_allclose(found.torque_mean, [12.5e3, 25e3], rtol=1e-9)
    assert_allclose(found.inertia_required, [450.0, 900.0], rtol=5e-5)
    assert_allclose(found.inertia_energy_swing, [450.0, 900.0], rtol=5e-5)


@pytest.mark.parametrize(("key", "extreme"), [("largest_speed", "omega_max"),
                                              ("smallest_speed", "omega_min")])  # fmt: skip
@pytest.mark.parametrize("more", [{"inertia": 20.0}, {"wanted_delta": 0.2}])
def test_an_extreme_in_place_of_the_nominal_speed(
    tmp_path: Path, key: str, extreme: str, more: dict[str, float]
) -> None:
    found = posed(
        tmp_path, CLOSED, [extreme, "delta", "brake_power"], set={key: 400.0, **more},
        axes={"load_exponent": [0, 2]},
    )  # fmt: skip
    assert_allclose(found[extreme], 400.0 * np.pi / 30.0, rtol=1e-9)
    assert (found.status == 0).all()
    assert (found.brake_power / 25e3 != pytest.approx(400.0 * np.pi / 30.0, rel=0.01)).all()
    if "wanted_delta" in more:
        assert_allclose(found.delta, 0.2, rtol=1e-6)


def test_known_swing_and_coefficient_of_energy(tmp_path: Path) -> None:
    file = tmp_path / "bare.toml"
    file.write_text('cycle = "two-stroke"\n[values]\ncylinders = 1\n')
    found = sweeps.run({
        "engine": str(file),
        "set": {"speed": 150, "inertia": 5000, "given_energy_swing": 56e3, "rated_power": 300e3,
                "given_energy_fluctuation": 0.1},
        "output": {"quantities": ["delta_of_given_swing", "delta_of_energy_fluctuation",
                                  "swing_of_energy_fluctuation"]},
    })  # fmt: skip
    omega = 5.0 * np.pi
    assert found.delta_of_given_swing == pytest.approx(56e3 / (5000 * omega**2), rel=1e-12)
    swing = 0.1 * 300e3 * 60.0 / 150.0  # the work of a revolution
    assert found.swing_of_energy_fluctuation == pytest.approx(swing, rel=1e-12)
    assert found.delta_of_energy_fluctuation == pytest.approx(swing / (5000 * omega**2), rel=1e-12)


@pytest.mark.parametrize(
    ("diagram", "message"),
    [
        ("", "file, harmonics or areas: missing: give one of file, harmonics, areas"),
        ("mean = 1\nharmonics = []\nareas = [1, -1]", "has both harmonics and areas: give one of"),
        ("harmonics = []", "mean: missing; must be a number in N m: the mean torque"),
        ("mean = 1\nharmonics = [{order = 3}, {order = 3}]", "order = 3: given twice"),
        ("mean = 1\nharmonics = [{order = -1}]", "order = -1: must be above 0 and at most 64"),
        ("mean = 1\nharmonics = [{sine = 1}]", "order: missing"),
        ("mean = 1\nareas = [3, -2]", "areas add up to 1 J: must add up to 0 over a cycle"),
        ("mean = 1\nareas = [3, -3]\ncrossings = [0, 100]", "2 angles for 2 areas: must be one"),
        ("mean = 1\nareas = [3, -3]\ncrossings = [0, 90, 80]", "crossings: 80 degrees: must asc"),
        ("mean = 1\nareas = [3, -3]\ncrossings = [0, 90, 300]", "cover 300 degrees: must cover"),
        ("mean = 1\nareas = [3, -3]\ncrossings = [0, 1, 36000]", "whole revolutions, 64 at most"),
        ("mean = 1\nareas = [1e308, -1e308]", "areas number 1 = 1e.308 J over 180 degrees: the"),
        ("mean = 1\nareas = [3, -3]\ncrossings = [0, 1e-300, 360]", "must be at most 1e.12 N m"),
        ("mean = 1\nareas = [3]", "a list of 2 to 1000 areas in J"),
        ("mean = 1\nharmonics = [{order = 0.3333}]", "the nearest that does is 1/3, 0.333333"),
        ("mean = 1\nharmonics = []\ncrossings = [0, 360]", "crossings: not allowed together with"),
        ("mean = 1\nharmonics = []\nload = 50", "load"),
        ('file = "none.csv"', "none.csv"),
        (CLOSED + '\n[[diagram]]\nkind = "torque"', "must be the only"),
        (CLOSED + "\n[pressure_scale]\nspeed = [1, 2]\nscale = [1, 1]", "the file gives a torque"),
    ],
)
def test_no_torque(tmp_path: Path, diagram: str, message: str) -> None:
    with pytest.raises(sweeps.SceneError, match=message) as refused:
        posed(tmp_path, diagram, ["delta"])
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("scene", "message"),
    [
        ({"output": {"quantities": ["gas_torque"]}}, "needs the pressure in the cylinders"),
        ({"output": {"quantities": ["imep"]}}, "needs the pressure in the cylinders"),
        ({"set": {"load_table": {"mean": 1}}}, "load_table: harmonics: missing"),
        ({"set": {"load_table": {"mean": 1, "harmonics": [], "angle": "shaft"}}}, "angle"),
        ({"set": {"torque_factor": -1}}, "torque_factor = -1"),
        ({"set": {"largest_speed": 400, "smallest_speed": 300}}, "has both|give one of them"),
        ({"solver": {"method": "thesis"}}, "method = 'thesis': supports only the load law"),
    ],
)
def test_scene_that_does_not_fit(tmp_path: Path, scene: dict[str, Any], message: str) -> None:
    asked = scene.pop("output", {"quantities": ["delta"]})["quantities"]
    with pytest.raises(sweeps.SceneError, match=message):
        posed(tmp_path, CLOSED, asked, **scene)


def test_cycle_that_does_not_fit(tmp_path: Path) -> None:
    file = tmp_path / "engine.toml"
    two = CLOSED.replace("order = 3", "order = 0.5")
    file.write_text('cycle = "two-stroke"\n' + ENGINE + two)
    with pytest.raises(sweeps.SceneError, match="the torque repeats after 720 degrees; must be"):
        load_engine(file, tmp_path)


def test_commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("engine.toml").write_text(ENGINE + CLOSED)
    assert "of the engine: torque over the crank angle, 360 degrees" in ok("info", "engine.toml")
    ok("new", "--for", "engine.toml", "scene.toml")
    scene = tomllib.loads(Path("scene.toml").read_text())
    assert list(scene["axes"]) == ["inertia"]
    assert "work over the angle of the torque that is given" in ok("plan", "scene.toml")
    assert "converged 25" in ok("run", "scene.toml", "-o", "out.nc")
    Path("scene.toml").write_text('engine = "engine.toml"\n[output]\nquantities = ["bmep"]')
    assert "needs" in refused("run", "scene.toml", "-o", "other.nc")
