"""The torsional calculation as it is handed in: Holzer tables, figures, report, torsiogram."""

import json
import re
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from sweeps.base.errors import SceneError
from sweeps.decide.explore.barred import BarredRange, Peak
from sweeps.view.figures.drawing import Options, figures
from sweeps.view.figures.shaft_system import placed
from sweeps.view.report.page import page
from sweeps.view.texts.barred import customary_range
from tests.sweeps.test_shaft_scenes import GEARED, run

pytestmark = pytest.mark.compiled

POUND_INCH = 0.1129848  # N m
PSI = 6.894757e-3  # MPa

OF_SYSTEM = ["system_inertia", "system_stiffness", "system_speed_ratio"]


def test_a_printed_holzer_table_comes_back() -> None:
    # Malychevitch, Diesel crankshaft vibration, 25 March 1939, Table II, in lb in and psi. Sums of
    # numbers of three digits: to a hundredth of the largest, stresses (J of one digit) to two.
    stiffness = np.array([13.7, 13.7, 12.8, 13.7, 13.7, 10.7]) * 1e6 * POUND_INCH
    shaft = {
        "reciprocating": "included",
        "discs": [
            *({"name": f"t{i}", "throw": i, "inertia": 0.22 * POUND_INCH} for i in range(1, 7)),
            {"name": "flywheel", "inertia": 10.0 * POUND_INCH},
        ],
        "shafts": [{"stiffness": one, "diameter": 0.0762} for one in stiffness.tolist()],
    }
    found = run(["natural_frequency", "mode_shape", "mode_torque", "mode_stress"], shaft)
    assert float(found.natural_frequency[1]) * 60.0 == pytest.approx(51500, abs=50)
    shape = found.mode_shape.values[1] / found.mode_shape.values[1, 0]
    assert_allclose(shape, [1.0, 0.5336, -0.1824, -0.8581, -1.0880, -0.8092, 0.0309], atol=0.001)
    torque = np.array([6.40, 9.81, 8.65, 3.15, -3.82, -8.99]) * 1e6 * POUND_INCH * np.pi / 180.0
    assert_allclose(-found.mode_torque.values[1], torque, atol=0.01 * torque.max())
    stress = np.array([20850, 32000, 28300, 10500, -12420, -29000]) * PSI
    assert_allclose(-found.mode_stress.values[1], stress, atol=0.02 * stress.max())


def test_torques_of_a_mode_hold_the_inertias_also_behind_gears_and_with_a_ring() -> None:
    names = [*OF_SYSTEM, "natural_frequency", "mode_shape", "mode_torque", "mode_stress"]
    found = run(names, GEARED)
    told = json.loads(found.attrs["shaft"])
    ratio, inertia = found.system_speed_ratio.values, found.system_inertia.values
    assert float(ratio[-2]) == -0.4 and told["dampers"] == 1
    for mode in range(4):
        omega = 2.0 * np.pi * float(found.natural_frequency[mode])
        shape = found.mode_shape.values[mode]
        shape = shape / shape[told["free_end"] - 1]
        net = np.radians(inertia * omega**2 * shape)
        net[9] -= np.radians(100.0 * shape[9])  # The propeller's spring to the ground
        for (first, second), torque in zip(
            told["shafts"], found.mode_torque.values[mode], strict=True
        ):
            net[first - 1] += torque
            net[second - 1] -= torque
        # What is left on pinion and wheel is the force of their teeth.
        ((pinion, wheel),) = told["gears"]
        assert net[pinion - 1] + ratio[wheel - 1] * net[wheel - 1] == pytest.approx(0.0, abs=1e-5)
        net[[pinion - 1, wheel - 1]] = 0.0
        assert_allclose(net, 0.0, atol=1e-7 * np.abs(found.mode_torque.values[mode]).max())
    assert_allclose(found.system_stiffness.values[-1], 1e4)


def test_stresses_of_orders_belong_to_their_torques() -> None:
    found = run(
        ["shaft_stress_order", "shaft_torque_order", "shaft_stress_half_range",
         "shaft_torque_half_range"],
        set={}, axes={"speed": [1500, 2000], "shaft_diameter_3": [0.08, 0.09]},
    )  # fmt: skip
    one = found.shaft_stress_order / found.shaft_torque_order
    both = found.shaft_stress_half_range / found.shaft_torque_half_range
    dims = ("speed", "shaft_diameter_3", "shaft")
    known = np.broadcast_to(both.transpose(*dims).values[..., None], one.shape)
    assert_allclose(one.transpose(*dims, "order").values, known)


def test_phase_vectors_of_the_firing_diagram_sum_to_the_vector_sums() -> None:
    found = run(["mode_shape", "mode_vector_sum", "critical_speed"],
                set={}, axes={"speed": [1000, 2500]})  # fmt: skip
    one = json.loads(found.attrs["arrangement"])
    throws = np.unique(one["positions"], return_inverse=True)[1]
    discs = np.array(json.loads(found.attrs["shaft"])["throws"]) - 1
    vectors = np.exp(1j * np.radians(np.multiply.outer(found.order.values, one["firing_angles"])))
    sums = np.abs(vectors @ found.mode_shape.values[:, discs[throws]].T)
    assert_allclose(sums.T, found.mode_vector_sum.values, atol=1e-9)
    drawn = figures(found, Options(only=("phase_vectors",)))["phase_vectors"]
    titles = [panel.get_title(loc="left") for panel in drawn.axes]
    assert "order 6, mode 1, 2166 rpm\nvector sum 3.43" in titles


def test_the_diagram_has_branches_below_and_rings_above() -> None:
    found = run(OF_SYSTEM, GEARED)
    told = json.loads(found.attrs["shaft"])
    places = placed(told, np.ones(len(told["shafts"])), 1)
    names = [str(name) for name in found.disc_name.values]
    row = {name: places.row[i] for i, name in enumerate(names)}
    assert set(places.x) == set(range(len(names)))
    assert row["wheel"] == row["propeller"] == -1 and row["flywheel"] == 0 and row[names[-1]] == 1
    x = {name: places.x[i] for i, name in enumerate(names)}
    assert x["wheel"] == x["pinion"] and x["propeller"] == x["wheel"] + 1.0
    drawn = figures(found, Options(only=("mass_elastic",)))["mass_elastic"]
    areas = sorted(float(patch.get_radius()) ** 2 for patch in drawn.axes[0].patches)
    at_crank = found.system_inertia.values * found.system_speed_ratio.values**2
    # The largest are to scale; small ones are drawn as dots.
    assert areas[-2] / areas[-1] == pytest.approx(np.sort(at_crank)[-2] / at_crank.max())


@pytest.fixture(scope="module")
def handed_in() -> xr.Dataset:
    archive = sweeps.run("torsion_hand_in")
    return archive.isel(speed=slice(0, None, 4), misfire=[0, 3])


def test_the_report_of_the_scene_has_all_that_is_handed_in(handed_in: xr.Dataset) -> None:
    pytest.importorskip("bokeh")
    written = page(handed_in, limit=3e6)
    assert len(written.encode()) < 3e6 and "No quantity varies" not in written
    part = written.partition('<section id="torsion">')[2].partition("</section>")[0]
    titles = re.findall(r'<h3 class="part">(\d)\. ([^<]*)</h3>', part)
    assert [int(number) for number, _ in titles] == [1, 2, 3, 4, 5, 6, 7]
    assert titles[0][1] == "The system" and titles[-1][1] == "Free end of the crankshaft"
    drawn = re.findall(r'<img class="drawn" alt="([^"]*)" src="data:image/svg\+xml,([^"]*)"', part)
    alike = [alt for alt, _ in drawn]
    assert [alike[i] for i in (0, 1, 2, 3)] == [
        "mass elastic", "mode shapes", "campbell", "phase vectors"
    ]  # fmt: skip
    assert all(unquote(svg).startswith("<svg") for _, svg in drawn) and len(drawn) >= 9
    mode = re.search(r"<h4>Mode 3: ([\d.]+) Hz</h4>(.*?)</table>", part, re.S)
    assert mode is not None and float(mode[1]) == pytest.approx(216.6, abs=0.1)
    # Holzer table: the shaft before the flywheel has the largest torque of this mode
    row = re.search(r"<tr><td>8 throw 6</td>(.*?)</tr>", mode[2])
    assert row is not None
    cells = re.findall(r"<td[^>]*>([^<]*)</td>", row[1])
    torque = float(handed_in.mode_torque.values[2, 7])
    assert cells[3] == "8 throw 6 - flywheel" and float(cells[4]) == pytest.approx(torque, rel=1e-3)
    assert "propeller blades" in part and "4: 150, 8: 40" in part


def test_a_report_without_some_quantities_lacks_the_parts_that_need_them(
    handed_in: xr.Dataset,
) -> None:
    pytest.importorskip("bokeh")
    written = page(handed_in[["shaft_torque_half_range"]])
    titles = re.findall(r'<h3 class="part">\d\. ([^<]*)</h3>', written)
    assert titles == ["The system", "Stresses and torques", "Couplings and dampers"]


def test_names_of_an_archive_stay_texts_in_its_pictures(handed_in: xr.Dataset) -> None:
    pytest.importorskip("bokeh")
    bad = '"></svg><script>alert(1)</script>'
    names = handed_in.disc_name.values.astype(object).copy()
    names[0] = bad
    archive = handed_in[[*OF_SYSTEM, "mode_shape"]].assign_coords(disc_name=("disc", names))
    written = page(archive)
    assert "<script>alert" not in written
    for svg in re.findall(r'src="data:image/svg\+xml,([^"]*)"', written):
        assert "<script>" not in unquote(svg)


def test_unequal_cylinders_spread_the_stress() -> None:
    pytest.importorskip("bokeh")
    archive = run(
        ["shaft_stress_half_range"], set={}, axes={"speed": [1500, 2100]},
        sample={"number": 8, "seed": 1, "pressure_factor_1": {"low": 0.8, "high": 1.2}},
    )  # fmt: skip
    written = page(archive)
    assert "over 8 draws of pressure_factor_1" in written and "<th>shaft</th>" in written


def test_the_customary_width_of_a_barred_range() -> None:
    # A two-stroke plant with its critical speed of order 5: worked by hand
    one = BarredRange(
        "propulsion_stress_over_limit", "shaft", {}, 62.0, 70.0, (61.9, 62.0), (70.0, 70.1),
        (Peak(1.2, 66.0, 5.0, 1, 66.016),),
    )  # fmt: skip
    archive = xr.Dataset(attrs={"parameters": json.dumps({"rated_speed": 99.0})})
    assert customary_range(archive, one) == pytest.approx((60.94, 71.52), abs=0.005)
    assert customary_range(xr.Dataset(), one) is None


# ---- torsiograms ---------------------------------------------------------------------------------

DAMPED = {"engine": "diesel_105x137", "shaft": "diesel_105x137_damper"}

ANGLES = ["disc_angle_order", "disc_angle_phase"]


def recorded(folder: Path, found: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Tables [measured] of the pulley in a run-up by 27 rpm a second, made of its orders."""
    time = np.arange(0.0, 12.0, 1.0 / 20_000.0)
    first, rise = 1200.0 * np.pi / 30.0, 27.0 * np.pi / 30.0
    angle = 1.0 + first * time + 0.5 * rise * time**2
    theta = np.radians(found.disc_angle_order) * np.exp(1j * np.radians(found.disc_angle_phase))
    at, theta = (first + rise * time) * 30.0 / np.pi, theta.isel(disc=0)
    swing = sum(
        (np.interp(at, found.speed, theta.sel(order=order)) * np.exp(1j * order * angle)).real
        for order in found.order.values
    )
    own = angle + swing
    speed = np.gradient(own, time) * 30.0 / np.pi
    pitch = 2.0 * np.pi / 60.0
    teeth = np.arange(np.ceil(own[0] / pitch), own[-1] / pitch)
    teeth = np.interp(pitch * teeth[teeth % 60 < 58], own, time)
    np.savetxt(folder / "teeth.csv", teeth, header="time [s]", comments="")
    for name, head, column in (
        ("time", "time [s]", time), ("angle", "crank angle [deg]", np.degrees(own))
    ):  # fmt: skip
        table = np.column_stack([column, speed])[::5]
        np.savetxt(folder / f"{name}.csv", table, delimiter=",", header=f"{head},speed [rpm]",
                   comments="")  # fmt: skip
    tables: dict[str, dict[str, Any]] = {
        "teeth": {"kind": "teeth", "wheel": "60-2", "gap_angle": 0.0},
        "angle": {"kind": "speed"},
        "time": {"kind": "speed", "time_column": 1, "angle_shift": float(np.degrees(own[0]))},
    }
    common = {"disc": "pulley", "part_cycles": 8}
    return {
        name: {"file": str(folder / f"{name}.csv"), **common, **table}
        for name, table in tables.items()
    }


def test_a_torsiogram_has_the_orders_that_made_it(tmp_path: Path) -> None:
    found = sweeps.run(**DAMPED, axes={"speed": list(range(1150, 1601, 10))},
                       output={"quantities": ANGLES})  # fmt: skip
    for table in recorded(tmp_path, found).values():
        beside = sweeps.measured(**DAMPED, output={"quantities": ["delta"]}, measured=table)
        # The measured speed is that of each part of the run-up
        assert beside.sizes["recording"] == 16
        assert_allclose(beside.speed.values[[0, -2]], [1212.0, 1482.0], rtol=2e-3)
        assert float(beside.correlation.min()) > 0.9999
        strong = beside.disc_angle_order > 0.02
        assert int(strong.sum()) > 150
        ratio = beside.disc_angle_measured_order / beside.disc_angle_order
        assert float(np.abs(ratio - 1.0).where(strong).max()) < 0.02
        turned = (beside.disc_angle_measured_phase - beside.disc_angle_phase + 180.0) % 360.0
        assert float(np.abs(turned - 180.0).where(strong).max()) < 2.0
        # Amplitudes over the disc's own angle are those of the archive but for their square
        at_crank = found.disc_angle_order.isel(disc=0).interp(speed=beside.speed.values)
        near = np.abs(beside.disc_angle_order.values / at_crank.values - 1.0)[1:-1]
        assert near[at_crank.values[1:-1] > 0.1].max() < 0.05
    pytest.importorskip("bokeh")
    part = page(found, torsiogram=beside).partition("Measured torsiogram</h3>")[2]
    assert 'alt="torsiogram"' in part
    row = re.search(r'<tr><td class="number">6</td>(.*?)</tr>', part)
    assert row is not None
    cells = [float(cell) for cell in re.findall(r">([^<]+)</td>", row[1])]
    assert cells[0] == pytest.approx(cells[2], rel=0.02) and abs(cells[3]) < 2.0
    for wrong, archive, match in (
        (found, found, "must be what `measured` makes"),
        (beside.assign_attrs(disc="hub"), found, "disc 'hub': the archive has no such disc"),
    ):
        with pytest.raises(SceneError, match=match):
            page(archive, torsiogram=wrong)


def test_stiffness_and_damping_come_back_from_a_torsiogram(tmp_path: Path) -> None:
    speeds = [1500, 1700, 1900]
    true = {"damper_damping_1": 70.0, "shaft_stiffness_8": 1.8e6}
    found = sweeps.run(**DAMPED, set=true, axes={"speed": speeds}, output={"quantities": ANGLES})
    theta = np.radians(found.disc_angle_order) * np.exp(1j * np.radians(found.disc_angle_phase))
    phi = np.radians(np.arange(-360.0, 720.0 * 12 - 360.0, 0.5))
    waves = np.exp(1j * np.multiply.outer(found.order.values, phi))
    noise = np.random.default_rng(1)
    files = []
    for rpm, own in zip(speeds, theta.isel(disc=0).values, strict=True):
        speed = rpm * (1.0 + ((1j * found.order.values * own) @ waves).real)
        speed *= 1.0 + 3e-4 * noise.standard_normal(phi.size)
        files.append(str(tmp_path / f"{rpm}.csv"))
        table = np.column_stack([np.degrees(phi + (own @ waves).real), speed])
        np.savetxt(files[-1], table, delimiter=",", header="crank angle [deg],speed [rpm]",
                   comments="")  # fmt: skip
    fit = sweeps.identify(
        **DAMPED, output={"quantities": ["delta"]}, axes={"speed": speeds}, vary=list(true),
        measured={"file": files, "kind": "speed", "disc": "pulley", "at": {"speed": speeds}},
        predict=False,
    )  # fmt: skip
    assert_allclose(fit.value, list(true.values()), rtol=3e-3)
    assert fit.attrs["likelihood_of_noise"] > 0.01


@pytest.mark.parametrize(
    ("wrong", "match"),
    [
        ({"disc": "hub"}, r"\[measured\] disc = 'hub': no such disc"),
        ({"disc": "propeller"}, "disc = 'propeller': must turn with the crank, without gears"),
        ({"part_cycles": 1}, "part_cycles = 1: must be a whole number from 2"),
        ({"angle_column": 1, "time_column": 1}, "time_column and angle_column: only one of them"),
        ({"time_column": 1}, "line 3: times must ascend throughout"),
    ],
)  # fmt: skip
def test_a_torsiogram_that_does_not_fit_is_refused(
    tmp_path: Path, wrong: dict[str, Any], match: str
) -> None:  # fmt: skip
    (tmp_path / "back.csv").write_text("time [s],speed [rpm]\n0,1000\n0,1000\n1,1000\n")
    table = {"file": str(tmp_path / "back.csv"), "kind": "speed", "disc": "throw 1", **wrong}
    with pytest.raises(SceneError, match=match):
        sweeps.measured(engine="diesel_105x137", shaft=GEARED, output={"quantities": ["delta"]},
                        measured=table)  # fmt: skip
    with pytest.raises(SceneError, match=r"disc: the engine has no shaft"):
        sweeps.measured(
            engine="ntua",
            output={"quantities": ["delta"]},
            measured=table
            | {"disc": "pulley", "part_cycles": 2, "angle_column": None, "time_column": None},
        )
