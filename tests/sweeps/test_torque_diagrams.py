"""Torque over the angle: given, of auxiliaries, and its coefficient of irregularity."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from engine_dyn.loads.torque_curves import torque_of_harmonics, torque_over_angle
from engine_dyn.quantities.features.auxiliaries import Auxiliary, over_crank
from sweeps.view.report.page import page
from tests.support.scenes import asking, computed, refusal

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
    file = folder / "engine.toml"
    file.write_text(ENGINE + diagram, encoding="utf-8")
    found: xr.Dataset = sweeps.run(
        {"engine": str(file), "output": {"quantities": quantities}, **scene}
    )
    return found


def test_a_report_says_that_the_torque_is_given(tmp_path: Path) -> None:
    told = page(posed(tmp_path, CLOSED, ["delta", "torque", "energy_swing"]))
    assert "The torque of the engine is given" in told and "rigid crankshaft" in told
    for other in ("The pressure is given", "modelled by two masses", "Friction is a mean"):
        assert other not in told
    assert "Two-stroke engines are solved" not in told


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


@pytest.mark.parametrize("crossings", ["", "crossings = [0, 70, 190, 250, 360]"])
def test_areas_give_the_swing_of_their_levels(tmp_path: Path, crossings: str) -> None:
    areas = "mean = 400\nareas = [300, -500, 420, -220]\n"
    found = posed(tmp_path, areas + crossings, ["energy_swing", "torque_mean", "crossing_energy"])
    assert found.energy_swing == pytest.approx(500.0, rel=1e-4)  # levels 300, -200, 220, 0
    assert found.torque_mean == pytest.approx(400.0, rel=1e-9)
    levels = np.sort(found.crossing_energy.dropna("crossing").values)
    assert_allclose(np.diff(levels), [200.0, 220.0, 80.0], rtol=2e-3)


def test_areas_rounded_in_print_are_evened_out_and_it_is_said(tmp_path: Path) -> None:
    """They miss zero by 1.5 of 260: each gives up a quarter of it."""
    areas = "mean = 400\nareas = [70, -60, 60.5, -69]\nrounded = true\n"
    found = posed(tmp_path, areas, ["energy_swing"])
    assert found.energy_swing == pytest.approx(70.0 - 1.5 / 4.0, rel=1e-4)
    said = found.attrs["warnings"]
    assert "areas: add up to 1.5 J, 0.58 percent" in said and "evenly" in said
    exact = posed(tmp_path, areas.replace("60.5", "59"), ["energy_swing"])
    assert exact.energy_swing == pytest.approx(70.0, rel=1e-4)
    assert not exact.attrs["warnings"]
    auxiliary = {"mean": 1.0, "areas": [7.0, -6.0, 6.05, -6.9], "rounded": True}
    driving = posed(tmp_path, CLOSED, ["delta"], auxiliaries=[auxiliary])
    assert "[[auxiliaries]] areas: add up to 0.15 J" in driving.attrs["warnings"]


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
        ("mean = 1\nharmonics = [{order = 3}]", "order = 3: sine, cosine: missing"),
        ("mean = 1\nharmonics = [{order = 2, sine = 1}, {order = 3}]", "order = 3: sine, cosine"),
        ("mean = 1\nharmonics = [{order = -1}]", "order = -1: must be above 0 and at most 256"),
        (
            "mean = 1\nharmonics = [{order = 0.015625, sine = 1}, {order = 65, sine = 1}]",
            "order = 65: has more than 4096 periods in the 64 revolutions",
        ),
        ("mean = 1\nharmonics = [{sine = 1}]", "order: missing"),
        ("mean = 1\nareas = [130, -128.5]", "to at most 2.58 J with rounded = true"),
        ("mean = 1\nareas = [130, -127]\nrounded = true", "at most 2.57 J .1 percent of the sum"),
        ("mean = 1\nharmonics = []\nrounded = true", "rounded: not allowed together with"),
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
        (
            {"set": {"load_table": {"mean": 1, "harmonics": [{"order": 3}]}}},
            "order = 3: sine, cosine: missing",
        ),
        ({"set": {"torque_factor": -1}}, "torque_factor = -1"),
        ({"set": {"largest_speed": 400, "smallest_speed": 300}}, "has both|give one of them"),
        ({"solver": {"method": "thesis"}}, "method = 'thesis': supports only the load law"),
    ],
)
def test_scene_that_does_not_fit(tmp_path: Path, scene: dict[str, Any], message: str) -> None:
    asked = scene.pop("output", {"quantities": ["delta"]})["quantities"]
    with pytest.raises(sweeps.SceneError, match=message):
        posed(tmp_path, CLOSED, asked, **scene)


BORE, RADIUS, ROD = 0.14, 0.09, 0.35  # of the NTUA engine, m
MASS = 6.67  # kg
STEP = 0.05  # degree


def run(quantities: list[str], step: float = 1.0, **tables: Any) -> Any:
    output = {"quantities": quantities, "angle_step": step}
    return sweeps.run({"engine": "ntua", "output": output, **tables})


def indicated_torque(pressure: np.ndarray, degrees: np.ndarray, rpm: float, count: int) -> Any:
    """Torque of gas and reciprocating masses of engines that fire evenly, by virtual work.

    The piston's place is that of the triangle of crank and rod; its velocity and acceleration are
    differences, so that nothing is shared with the package but the pressure.
    """
    phi, h = np.radians(degrees), 1e-4

    def place(angle: Any) -> Any:
        return RADIUS * np.cos(angle) + np.sqrt(ROD**2 - (RADIUS * np.sin(angle)) ** 2)

    first = (place(phi + h) - place(phi - h)) / (2.0 * h)
    second = (place(phi + h) - 2.0 * place(phi) + place(phi - h)) / h**2
    omega = rpm * np.pi / 30.0
    force = 0.25 * np.pi * BORE**2 * (pressure - 1.01325) * 1e5 + MASS * omega**2 * second
    one = -force * first
    return sum(np.roll(one, k * one.size // count) for k in range(count))


def test_it_is_over_the_mean_indicated_torque() -> None:
    """Power units, lecture 18: mu = (M_i max - M_i min)/M_i mean, index i without friction."""
    axes = {"load": [0, 2, 50], "speed": [700, 1500], "cylinders": [1, 4]}
    setting = {"reciprocating_mass": MASS}
    found = run(
        ["torque_irregularity", "torque_irregularity_brake", "torque_range", "torque_mean",
         "friction_torque", "pressure"],
        STEP, axes=axes, set=setting,
    )  # fmt: skip
    degrees = found["crank_angle"].values
    for place in np.ndindex(3, 2, 2):
        here = found.isel(dict(zip(axes, place, strict=True)))
        count, rpm = int(here["cylinders"]), float(here["speed"])
        curve = indicated_torque(here["pressure"].values, degrees, rpm, count)
        mean = float(curve.mean())
        assert mean == pytest.approx(float(here["torque_mean"] + here["friction_torque"]), rel=1e-4)
        mu = np.ptp(curve) / mean
        assert float(here["torque_irregularity"]) == pytest.approx(mu, rel=1e-4), place
    brake = found["torque_range"] / found["torque_mean"]
    assert_allclose(found["torque_irregularity_brake"], brake, rtol=1e-14)
    # Friction makes the difference, most of it where there is little else.
    ratio = abs(found["torque_irregularity_brake"] / found["torque_irregularity"])
    assert (ratio > 1.1).all()
    assert float(ratio.sel(load=2, speed=1500, cylinders=1)) > 2.0


FOUR = "si_four_87x101"
CAM = {"ratio": 0.5, "phase": 30.0, "mean": 4.0,
       "harmonics": [{"order": 4, "sine": 12.0}, {"order": 8, "cosine": -3.0}]}  # fmt: skip
PUMP = {"ratio": 1.5, "mean": 2.0, "harmonics": [{"order": 1, "cosine": 5.0}]}


def test_auxiliaries_are_no_part_of_the_indicated_torque() -> None:
    plain = computed(["torque_irregularity", "torque_irregularity_brake"], "diesel_105x137")
    found = computed(
        ["torque_irregularity", "torque_irregularity_brake"], "diesel_105x137",
        auxiliaries=[{"ratio": 0.5, "mean": 5.0, "harmonics": [{"order": 4, "sine": 90.0}]}],
    )  # fmt: skip
    assert_allclose(found.torque_irregularity, plain.torque_irregularity, rtol=1e-12)
    assert found.torque_irregularity_brake > 1.001 * plain.torque_irregularity_brake


def at_crank(phi: Any) -> Any:
    """Torque of both at the crank, written out."""
    cam, pump = 0.5 * phi + np.radians(30.0), 1.5 * phi
    of_cam = 0.5 * (4.0 + 12.0 * np.sin(4.0 * cam) - 3.0 * np.cos(8.0 * cam))
    return of_cam + 1.5 * (2.0 + 5.0 * np.cos(pump))


def test_the_sum_is_exact() -> None:
    """Of closed forms, and of splines whose knots lie elsewhere."""
    cam = torque_of_harmonics(4.0, {4: (12.0, 0.0), 8: (0.0, -3.0)})
    pump = torque_of_harmonics(2.0, {1: (0.0, 5.0)})
    both = over_crank([Auxiliary(cam, 0.5, np.radians(30.0)), Auxiliary(pump, 1.5)], 4.0 * np.pi)
    phi = np.random.default_rng(1).uniform(-20.0, 20.0, 1000)
    assert_allclose(both(phi), at_crank(phi), atol=1e-8)
    assert both.mean == pytest.approx(5.0, rel=1e-12)
    assert both.repeats == 1
    assert over_crank([Auxiliary(cam, 0.5)], 4.0 * np.pi).repeats == 4
    theta = np.arange(0.1, 2.0 * np.pi, 0.3)
    rough = torque_over_angle(theta, np.random.default_rng(2).uniform(0.0, 9.0, theta.size))
    given = [Auxiliary(rough, 2.0, -1.0), Auxiliary(rough, 0.5, 7.0)]
    summed = over_crank(given, 4.0 * np.pi)
    expected = sum(one.ratio * one.torque(one.ratio * phi + one.phase) for one in given)
    assert_allclose(summed(phi), expected, atol=1e-9)
    assert summed.mean == pytest.approx(2.5 * rough.mean, rel=1e-9)


def test_excess_energy_by_hand(tmp_path: Path) -> None:
    """A torque in closed form of 25 - 8 sin(3 phi) kN m with a valve train at half speed."""
    (tmp_path / "mine.toml").write_text(
        'cycle = "four-stroke"\n[values]\ninertia = 900\nspeed = 420\nload_exponent = 0\n'
        'load_offset = 0\n[[diagram]]\nkind = "torque"\nmean = 25e3\n'
        "harmonics = [{ order = 3, sine = -8e3 }]\n"
    )
    cam = {"ratio": 0.5, "mean": 400.0, "harmonics": [{"order": 4, "sine": 6e3}]}
    names = ["delta", "energy_swing", "torque_mean", "brake_power", "torque_max", "torque_order"]
    found = computed(
        names, engine=str(tmp_path / "mine.toml"), auxiliaries=[cam], output={"highest_order": 6}
    )
    # At the crank the cam takes 200 + 3000 sin(2 phi), so the excess has the work
    # 8000/3 cos(3 phi) + 1500 cos(2 phi), extreme where its slope vanishes:
    # sin(phi) [8000 (4 c^2 - 1) + 6000 c] = 0 with c = cos(phi).
    c = np.concatenate([[1.0, -1.0], np.roots([32e3, 6e3, -8e3])])
    work = 8e3 / 3.0 * (4.0 * c**3 - 3.0 * c) + 1500.0 * (2.0 * c**2 - 1.0)
    swing = work.max() - work.min()
    assert float(found["energy_swing"]) == pytest.approx(swing, rel=1e-9)
    assert float(found["torque_mean"]) == pytest.approx(24.8e3, rel=1e-12)
    omega = 420 * np.pi / 30.0
    assert float(found["brake_power"]) == pytest.approx(24.8e3 * omega, rel=1e-12)
    assert float(found["delta"]) == pytest.approx(swing / (900.0 * omega**2), rel=1e-3)
    # Exact: the square of the speed follows the work, with the nominal speed as geometric mean.
    phi = np.linspace(0.0, 2.0 * np.pi, 200001)
    square = 2.0 / 900.0 * (8e3 / 3.0 * np.cos(3.0 * phi) + 1500.0 * np.cos(2.0 * phi))
    start = omega**2
    for _ in range(50):
        start *= omega**2 / np.exp(np.log(start + square[:-1]).mean())
    speeds = np.sqrt(start + 2.0 / 900.0 * np.array([work.max(), work.min()]))
    assert float(found["delta"]) == pytest.approx((speeds[0] - speeds[1]) / omega, rel=1e-6)
    torque = 24.8e3 - 8e3 * np.sin(3.0 * phi) - 3e3 * np.sin(2.0 * phi)
    assert float(found["torque_max"]) == pytest.approx(torque.max(), rel=1e-8)
    orders = found["torque_order"].sel(order=[1.0, 2.0, 3.0, 4.0])
    assert_allclose(orders, [0.0, 3e3, 8e3, 0.0], atol=1e-6)


NAMES = [
    "delta", "omega_max", "energy_swing", "torque", "torque_mean", "torque_max", "torque_min",
    "friction_torque", "instantaneous_friction_torque", "torque_order", "load_torque",
]  # fmt: skip


@pytest.mark.parametrize(
    ("more", "tables"),
    [
        ({"speed": 1500.0}, {}),
        ({"speed": 1500.0, "friction_skirt": 0.4, "friction_boundary": 0.3, "ring_pressure": 1.0},
         {"solver": {"inertia_model": "variable"}}),
    ],
)  # fmt: skip
def test_auxiliaries_are_part_of_the_torque(more: dict[str, Any], tables: dict[str, Any]) -> None:
    """The same torque as a load over angle leaves the speed as it is: both are subtracted."""
    given = {"set": more, **tables, "output": {"angle_step": 1.0, "highest_order": 8}}
    with_both = computed(NAMES, engine=FOUR, auxiliaries=[CAM, PUMP], **given)
    without = computed(NAMES, engine=FOUR, **given)
    phi = np.radians(with_both["crank_angle"].values)
    taken = at_crank(phi)
    change = without["torque"] - with_both["torque"]
    assert_allclose(change, taken, atol=1e-8)
    for name in ("friction_torque", "torque_mean"):
        assert abs(float(with_both[name] - without[name])) == pytest.approx(5.0, rel=1e-9)
    more_friction = (
        with_both["instantaneous_friction_torque"] - without["instantaneous_friction_torque"]
    )
    assert_allclose(more_friction, taken, atol=1e-8)
    assert float(with_both["torque_max"]) == pytest.approx(
        float(with_both["torque"].max()), rel=1e-3
    )
    wave = np.fft.rfft(taken) * 2.0 / taken.size
    assert float(with_both["torque_order"].sel(order=1.5) - without["torque_order"].sel(order=1.5)
                 ) == pytest.approx(float(np.abs(wave[3])), rel=1e-9)  # fmt: skip
    # A load of the same torque, over the crank angle.
    harmonics = [
        {"order": 2, "sine": 6.0 * np.cos(np.radians(120.0)),
         "cosine": 6.0 * np.sin(np.radians(120.0))},
        {"order": 4, "sine": 1.5 * np.sin(np.radians(240.0)),
         "cosine": -1.5 * np.cos(np.radians(240.0))},
        {"order": 1.5, "cosine": 7.5},
    ]  # fmt: skip
    load = {**given, "set": {**more, "load_table": {"mean": 5.0, "harmonics": harmonics}}}
    as_load = computed(NAMES, engine=FOUR, **load)
    for name in ("delta", "omega_max", "energy_swing"):
        assert float(with_both[name]) == pytest.approx(float(as_load[name]), rel=1e-7)
        assert abs(float(with_both[name] / without[name]) - 1.0) > 1e-5
    assert_allclose(with_both["load_torque"] + 5.0, as_load["load_torque"].mean()
                               + (with_both["load_torque"] - with_both["load_torque"].mean()),
                               atol=0.02)  # fmt: skip


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ([{**CAM, "ratio": 0.3}], "[[auxiliaries]] number 1 ratio = 0.3: must be a multiple of"),
        ([CAM, {**CAM, "ratio": -1.0}], "[[auxiliaries]] number 2: ratio = -1: must be a number"),
        ([{**CAM, "phase": 999.0}], "phase = 999: must be a number in degree"),
        ([{**CAM, "speed": 1.0}], "speed: unknown"),
        ([{"ratio": 0.5, "mean": 3.0}], "number 1 file, harmonics or areas: missing"),
        ([{"ratio": 0.5, "harmonics": []}], "number 1 mean: missing; must be a number in N m"),
        ([{**CAM, "kind": "points"}], "kind = 'points': must be 'torque'"),
        ([{"file": "none.csv"}], "none.csv"),
        ([], "auxiliaries = []: must be tables [[auxiliaries]]"),
    ],
)  # fmt: skip
def test_bad_input(tables: Any, message: str) -> None:
    assert message in refusal(asking(["delta"], engine=FOUR, auxiliaries=tables))
