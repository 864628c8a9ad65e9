"""Scenes whose shaft is excited by given torques, and damped by mode or over the speed."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

import sweeps
from engine_dyn.units import DEGREE, RPM
from sweeps.base.errors import SceneError
from tests.support.scenes import refusal
from tests.support.shafts import dense
from tests.sweeps.test_shaft_scenes import changed, run

HALF = "shaft_torque_half_range"
DISCS = [300.0, 600.0, 500.0]


def engine(tmp_path: Path, harmonics: str, mean: float = 25e3) -> str:
    """An engine file with a torque in closed form."""
    path = tmp_path / f"torque{len(list(tmp_path.iterdir()))}.toml"
    path.write_text(
        'title = "A torque"\n[values]\ninertia = 900\nspeed = 420\nload_exponent = 0\n'
        f'load_offset = 0\n[[diagram]]\nkind = "torque"\nmean = {mean}\nharmonics = {harmonics}\n',
        encoding="utf-8",
    )
    return str(path)


def three(**more: Any) -> dict[str, Any]:
    """Throw, flywheel and propeller; what `more` gives replaces or joins it."""
    return {
        "reciprocating": "included",
        "discs": [
            {"name": "throw", "throw": 1, "inertia": DISCS[0], "damping": 200.0},
            {"name": "flywheel", "inertia": DISCS[1]},
            {"name": "propeller", "inertia": DISCS[2]},
        ],
        "shafts": [
            {"stiffness": 4e6, "loss_factor": 0.01},
            {"stiffness": 2e6, "loss_factor": 0.02},
        ],
        **more,
    }


def of_torque(path: str, quantities: list[str], shaft: dict[str, Any], **tables: Any) -> Any:
    tables.setdefault("set", {})
    return run(quantities, shaft=shaft, engine=path, **tables)


def test_a_given_torque_excites_the_shaft_at_its_throw(tmp_path: Path) -> None:
    path = engine(tmp_path, "[{ order = 3, sine = -8000 }, { order = 1, cosine = 500 }]")
    found = of_torque(
        path, ["shaft_torque_order", "shaft_torque_phase", HALF, "shaft_torque_mean"], three()
    )
    speed = 420.0 * RPM
    for order, torque in ((3.0, 8000j), (1.0, 500.0 + 0j)):
        forces = np.array([torque, 0.0, 0.0])
        _, want = dense(
            order * speed, forces, DISCS, [4e6, 2e6], loss_factor=[0.01, 0.02],
            disc_damping=[200.0, 0.0, 0.0],
        )  # fmt: skip
        one = found.sel(order=order)
        mine = one["shaft_torque_order"] * np.exp(1j * DEGREE * one["shaft_torque_phase"])
        assert_allclose(mine, want, rtol=1e-8)
    assert_allclose(found["shaft_torque_mean"], [-25e3, -25e3])


def of_cylinder(folder: Path, head: str = "firing_order = [1, 3, 2]") -> str:
    """An engine of three cylinders, each with the torque of a maker's table of orders."""
    rows = ["0.5,3000,200", "1.5,-1000,1700", "2,500,-700"]
    (folder / "table.csv").write_text("order,sine,cosine\n" + "\n".join(rows), encoding="utf-8")
    path = folder / "of_cylinder.toml"
    path.write_text(
        f'title = "A table"\ncycle = "four-stroke"\n{head}\n[values]\ncylinders = 3\n'
        "inertia = 115\nspeed = 420\nload_exponent = 0\nload_offset = 0\n"
        '[[diagram]]\nkind = "torque"\nof = "cylinder"\nmean = 2500\nfile = "table.csv"\n',
        encoding="utf-8",
    )
    return str(path)


def test_the_table_of_a_cylinder_excites_each_throw_in_step(tmp_path: Path) -> None:
    shaft = {
        "reciprocating": "included", "load_damping": 0.0,
        "discs": [*({"name": f"throw {i}", "throw": i, "inertia": 5.0} for i in (1, 2, 3)),
                  {"name": "flywheel", "inertia": 100.0, "damping": 30.0}],
        "shafts": [{"stiffness": 1e6, "loss_factor": 0.02}] * 3,
    }  # fmt: skip
    quantities = ["shaft_torque_order", "shaft_torque_phase", "shaft_torque_mean", "torque"]
    path = of_cylinder(tmp_path)
    found = of_torque(path, quantities, shaft)
    fires = np.radians([0.0, 480.0, 240.0])
    table = {0.5: 200.0 - 3000j, 1.5: 1700.0 + 1000j, 2.0: -700.0 - 500j}
    angle = np.radians(found.crank_angle.values)[:, None] - fires
    torque = np.full(angle.shape, 2500.0)
    for order in found.order.values:
        wave = table.get(order, 0.0)
        torque = torque + (wave * np.exp(1j * order * angle)).real
        forces = np.append(wave * np.exp(-1j * order * fires), 0.0)
        _, want = dense(
            order * 420.0 * RPM, forces, [5.0, 5.0, 5.0, 100.0], [1e6] * 3,
            loss_factor=[0.02] * 3, disc_damping=[0.0, 0.0, 0.0, 30.0],
        )  # fmt: skip
        one = found.sel(order=order)
        mine = one["shaft_torque_order"] * np.exp(1j * DEGREE * one["shaft_torque_phase"])
        assert_allclose(mine, want, rtol=1e-8, atol=1e-6)
    assert_allclose(found["torque"], torque.sum(axis=1), atol=1e-5)
    assert_allclose(found["shaft_torque_mean"], [-2500.0, -5000.0, -7500.0])
    with pytest.raises(SceneError, match="cylinders: the engine of_cylinder gives the torque of"):
        sweeps.run(engine=path, set={"cylinders": 4}, output={"quantities": ["delta"]})
    whole = engine(tmp_path, "[{ order = 3, sine = -8000 }]")
    with pytest.raises(SceneError, match="shaft: has 3 throws, but the engine torque"):
        of_torque(whole, ["natural_frequency"], shaft)
    unknown = of_cylinder(tmp_path, "")
    text = Path(unknown).read_text(encoding="utf-8").replace("cylinders = 3", "cylinders = 13")
    Path(unknown).write_text(text, encoding="utf-8")
    with pytest.raises(SceneError, match="firing_order: missing"):
        sweeps.run(engine=unknown, output={"quantities": ["delta"]})


def test_an_excitation_on_the_throw_is_a_part_of_the_engines_torque(tmp_path: Path) -> None:
    both = engine(
        tmp_path, "[{ order = 3, sine = -8000 }, { order = 2, amplitude = 700, phase = 40 }]"
    )
    one = engine(tmp_path, "[{ order = 3, sine = -8000 }]", 20e3)
    other = {
        "on": "throw",
        "mean": 5e3,
        "harmonics": [{"order": 2, "amplitude": 700.0, "phase": 40.0}],
    }
    quantities = [HALF, "delta_elastic", "shaft_loss", "shaft_torque_mean", "shaft_torque_order"]
    want = of_torque(both, quantities, three())
    found = of_torque(one, quantities, three(excitations=[other]))
    for name in quantities:
        assert_allclose(found[name], want[name], rtol=1e-8, atol=1e-6)
    # Over its own angle, which begins elsewhere
    other = {
        **other,
        "phase": 30.0,
        "harmonics": [{"order": 2, "amplitude": 700.0, "phase": -20.0}],
    }
    assert_allclose(of_torque(one, [HALF], three(excitations=[other]))[HALF], want[HALF], rtol=1e-8)


def test_the_order_of_a_gear_mesh_is_that_of_the_dense_solution(tmp_path: Path) -> None:
    mesh = {"on": "flywheel", "mean": 0, "harmonics": [{"order": 187, "amplitude": 900}]}
    path = engine(tmp_path, "[{ order = 3, sine = -1e-7 }]")
    found = of_torque(path, [HALF], three(excitations=[mesh]))
    _, want = dense(
        187.0 * 420.0 * RPM, np.array([0.0, 900.0, 0.0]), DISCS, [4e6, 2e6],
        loss_factor=[0.01, 0.02], disc_damping=[200.0, 0.0, 0.0],
    )  # fmt: skip
    assert_allclose(found[HALF], np.abs(want), rtol=2e-3)


def test_a_factor_scales_an_excitation_and_all_are_superposed() -> None:
    blades = {
        "on": "propeller", "name": "blades", "mean": -800.0, "power": 2, "reference_speed": 1500,
        "harmonics": [{"order": 5, "amplitude": 90.0, "phase": 10.0}],
    }  # fmt: skip
    quantities = ["shaft_torque_order", "shaft_torque_phase", HALF, "shaft_torque_mean"]
    found = run(
        quantities, shaft=changed(excitations=[blades]),
        axes={"excitation_factor_1": [0, 1, 3], "speed": [1200, 2400]}, set={},
    )  # fmt: skip
    plain = run(quantities, shaft=changed(), axes={"speed": [1200, 2400]}, set={})
    none = found.sel(excitation_factor_1=0)
    for name in quantities:
        assert_allclose(none[name], plain[name], rtol=1e-12)
    torque = found["shaft_torque_order"] * np.exp(1j * DEGREE * found["shaft_torque_phase"])
    added = torque - torque.sel(excitation_factor_1=0)
    assert_allclose(
        added.sel(excitation_factor_1=3), 3.0 * added.sel(excitation_factor_1=1), atol=1e-6
    )
    there = np.abs(added.sel(excitation_factor_1=1)).max("shaft").transpose("speed", "order")
    # Behind the gear of ratio -0.4, order 5 of the propeller is order 2 of the crank.
    assert (there.sel(order=2.0) > 1.0).all() and (there.drop_sel(order=2.0) < 1e-6).all()
    # The mean flows on its own shaft alone: the load, here the same disc, takes up the rest.
    assert_allclose(
        found["shaft_torque_mean"].sel(excitation_factor_1=3), none["shaft_torque_mean"]
    )


def test_what_does_not_keep_step_adds_to_half_ranges() -> None:
    def blades(order: float) -> dict[str, Any]:
        return {"on": "propeller", "mean": 0.0, "harmonics": [{"order": order, "cosine": 200.0}]}

    quantities = [HALF, "shaft_torque_order", "shaft_loss"]
    plain = run(quantities, shaft=changed())
    # Order 4 of the propeller is 1.6 of the crank, which no four-stroke cycle has.
    drifting = run(quantities, shaft=changed(excitations=[blades(4.0)]))
    assert_allclose(drifting["shaft_torque_order"], plain["shaft_torque_order"], rtol=1e-12)
    assert (drifting[HALF] > plain[HALF]).all() and (
        drifting["shaft_loss"] >= plain["shaft_loss"]
    ).all()
    # Of many gear ratios, each is what it is alone.
    ratios = [-0.4, -0.375, -0.5]
    many = run(
        quantities, shaft=changed(excitations=[blades(4.0)]), axes={"shaft_gear_ratio_1": ratios}
    )
    for ratio in ratios:
        alone = run(quantities, shaft=changed(excitations=[blades(4.0)], gears__0__ratio=ratio))
        assert_allclose(many[HALF].sel(shaft_gear_ratio_1=ratio), alone[HALF], rtol=1e-12)


def test_a_table_over_the_speed_and_a_file_of_orders(tmp_path: Path) -> None:
    rows = [(1200, 2.0, 60.0, 10.0), (1200, 3.0, 20.0, 0.0), (2000, 2.0, 90.0, 10.0)]
    text = "speed,order,amplitude,phase\n" + "\n".join(",".join(map(str, r)) for r in rows)
    (tmp_path / "orders.csv").write_text(text, encoding="utf-8")
    of_file = {"on": "flywheel", "mean": 5.0, "file": str(tmp_path / "orders.csv")}
    over_speed = [
        {"speed": speed, "mean": 5.0, "harmonics": [
            {"order": order, "amplitude": size, "phase": phase}
            for at, order, size, phase in rows if at == speed]}
        for speed in (1200, 2000)
    ]  # fmt: skip
    tables = {"on": "flywheel", "over_speed": over_speed}
    quantities = [HALF, "torsion_status", "shaft_torque_mean"]
    axes = {"speed": [1200, 1600, 2000, 2100]}
    found = [
        run(quantities, shaft=changed(excitations=[one]), axes=axes, set={})
        for one in (of_file, tables)
    ]
    assert_array_equal(found[0][HALF], found[1][HALF])
    assert found[0]["torsion_status"].values.tolist() == [0, 0, 0, 4]
    assert np.isnan(found[0][HALF].sel(speed=2100)).all()
    one = (tmp_path / "one.csv", {**of_file, "file": str(tmp_path / "one.csv")})
    one[0].write_text("\n".join(text.split("\n")[:3]), encoding="utf-8")
    plain = {"on": "flywheel", "mean": 5.0, "harmonics": over_speed[0]["harmonics"]}
    of_one, of_plain = (
        run([HALF], shaft=changed(excitations=[given])) for given in (one[1], plain)
    )
    assert_array_equal(of_one[HALF], of_plain[HALF])  # One speed holds for all
    # Between the speeds of the table: the mean of both
    middle = {"on": "flywheel", "mean": 5.0, "harmonics": [
        {"order": 2, "amplitude": 75.0, "phase": 10.0},
        {"order": 3, "amplitude": 10.0}]}  # fmt: skip
    alone = run([HALF], shaft=changed(excitations=[middle]), set={"speed": 1600})
    assert_allclose(found[0][HALF].sel(speed=1600), alone[HALF], rtol=1e-9)


@pytest.mark.parametrize("kind", ["csv", "uff"])
def test_orders_of_an_archive_are_an_excitation(tmp_path: Path, kind: str) -> None:
    """Export of an engine's orders, on the throw of another engine: both engines add up."""
    from tests.support.commands import ok

    path = engine(tmp_path, "[{ order = 3, sine = -8000 }, { order = 1, cosine = 500 }]")
    made = sweeps.run(
        engine=path, output={"quantities": ["torque_order", "torque_phase", "order_frequency"]}
    )
    made.to_netcdf(tmp_path / "a.nc")
    ok("export", tmp_path / "a.nc", "--orders", "torque", "-o", tmp_path / f"orders.{kind}")
    second = {"on": "throw", "mean": 25e3, "file": str(tmp_path / f"orders.{kind}")}
    found = of_torque(path, [HALF], three(excitations=[second]))
    twice = of_torque(path, [HALF], three(), set={"torque_factor": 2.0})
    assert_allclose(found[HALF], twice[HALF], rtol=1e-7)


# --- damping --------------------------------------------------------------------------------------


def test_modes_have_the_damping_that_is_given(tmp_path: Path) -> None:
    path = engine(tmp_path, "[{ order = 3, sine = -8000 }]")
    free = three(modal_damping=[0.01, 0.03], load_damping=0.0)
    free["discs"][0].pop("damping")
    for piece in free["shafts"]:
        piece.pop("loss_factor")
    found = of_torque(path, ["damping_ratio", "modal_damping_ratio", HALF], free)
    for name in ("damping_ratio", "modal_damping_ratio"):
        assert_allclose(found[name], [0.01, 0.03], rtol=1e-9)
    undamped = ["natural_frequency", "mode_torque", "critical_speed", "system_stiffness"]
    without = {key: value for key, value in free.items() if key != "modal_damping"}
    modes, bare = (of_torque(path, undamped, shaft) for shaft in (free, without))
    for name in undamped:
        assert_array_equal(modes[name], bare[name])
    magnified = {**free, "modal_magnifier": [50.0, 1.0 / 0.06]}
    magnified.pop("modal_damping")
    assert_allclose(of_torque(path, [HALF], magnified)[HALF], found[HALF], rtol=1e-12)
    varied = of_torque(path, ["damping_ratio"], free, axes={"modal_damping_2": [0.03, 0.2]})
    assert_allclose(varied["damping_ratio"].sel(modal_damping_2=0.2), [0.01, 0.2], rtol=1e-9)
    one = of_torque(path, ["damping_ratio"], {**free, "modal_damping": 0.02})
    assert_allclose(one["damping_ratio"], [0.02, 0.02], rtol=1e-9)


@pytest.mark.parametrize("blades", [5, 4], ids=["in step", "drifting"])
def test_response_with_damped_modes_and_excitations_is_where_a_motion_ends(
    tmp_path: Path, blades: int
) -> None:
    """The whole way of a scene beside DOP853 in time, from rest until all modes have settled.

    C = J V diag(2 zeta omega) V^T J of the three coordinates that the gear leaves.
    """
    inertia, stiffness = np.array([5.0, 20.0, 1.0, 4.0, 30.0]), np.array([9e4, 5e4, 6e4])
    ratio, zeta, speed = -0.4, [0.04, 0.06], 900.0
    shaft = {
        "reciprocating": "included", "load_damping": 0.0, "modal_damping": zeta,
        "discs": [
            {"name": name, "inertia": own}
            for name, own in zip(
                ("throw", "flywheel", "pinion", "wheel", "propeller"), inertia, strict=True
            )
        ],
        "shafts": [
            *({"stiffness": k} for k in stiffness[:2]),
            {"between": ["wheel", "propeller"], "stiffness": stiffness[2]},
        ],
        "gears": [{"between": ["pinion", "wheel"], "ratio": ratio}],
        "excitations": [
            {"on": "propeller", "mean": -90.0, "power": 2, "reference_speed": 600,
             "harmonics": [{"order": blades, "amplitude": 300.0, "phase": 20.0}]},
            {"on": "flywheel", "mean": 0.0, "harmonics": [{"order": 2, "cosine": 150.0}]},
        ],
    }  # fmt: skip
    shaft["discs"][0]["throw"] = 1
    path = engine(tmp_path, "[{ order = 3, sine = -800 }, { order = 1, cosine = 500 }]", 100.0)
    quantities = ["shaft_torque_order", "shaft_torque_phase", HALF]
    found = of_torque(path, quantities, shaft, set={"speed": speed})

    # Coordinates: throw, flywheel, pinion, propeller; the wheel turns with the pinion.
    mass = np.diag([5.0, 20.0, 1.0 + ratio**2 * 4.0, 30.0])
    twist = np.array([[-1.0, 1.0, 0.0, 0.0], [0.0, -1.0, 1.0, 0.0], [0.0, 0.0, -ratio, 1.0]])
    stiff = twist.T @ (stiffness[:, None] * twist)
    squares, shapes = eigh(stiff, mass)
    rates = 2.0 * np.array([0.0, *zeta, zeta[-1]]) * np.sqrt(np.maximum(squares, 0.0))
    damping = mass @ shapes @ np.diag(rates) @ shapes.T @ mass
    omega = speed * RPM

    def motion(time: float, state: Any) -> Any:
        phi = omega * time
        # The propeller turns the other way: its own sense is that of the torque.
        own = abs(ratio) * phi
        size = 300.0 * (speed / 600.0) ** 2
        acts = np.array([
            800.0 * math.cos(3.0 * phi + 0.5 * math.pi) + 500.0 * math.cos(phi),
            150.0 * math.cos(2.0 * phi), 0.0,
            -size * math.cos(blades * own + math.radians(20.0)),
        ])  # fmt: skip
        rate = np.linalg.solve(mass, acts - stiff @ state[:4] - damping @ state[4:])
        return np.concatenate([state[4:], rate])

    cycles = 5  # After which order 1.6 repeats as well
    period, count = cycles * 4.0 * math.pi / omega, 4000
    slowest = 0.5 * rates[squares > 1e-6 * squares[-1]].min()
    begin = math.ceil(25.0 / slowest / period) * period
    times = begin + np.arange(count) * (period / count)
    moved = solve_ivp(
        motion, (0.0, times[-1]), np.zeros(8), "DOP853", times, rtol=1e-9, atol=1e-12
    ).y
    torque = stiffness[:, None] * (twist @ moved[:4])
    torque -= torque.mean(axis=1, keepdims=True)
    if blades == 4:  # Drifting, it meets the largest and the least of all else at some time
        lines = np.fft.rfft(torque, axis=1) * (2.0 / count)
        place = round(blades * abs(ratio) * 2 * cycles)
        drifting = np.abs(lines[:, place])
        lines[:, place] = 0.0
        torque = np.fft.irfft(lines * (0.5 * count), n=count, axis=1)
        assert drifting.min() > 1.0
    else:
        drifting = np.zeros(3)
    scale = np.abs(torque).max(axis=1)
    harmonics = np.fft.rfft(torque, axis=1) * (2.0 / count)
    mine = found["shaft_torque_order"] * np.exp(1j * DEGREE * found["shaft_torque_phase"])
    for order in (1.0, 2.0, 3.0):
        want = harmonics[:, round(order * 2 * cycles)]
        assert (np.abs(mine.sel(order=order) - want) < 1e-6 * scale).all()
    half = 0.5 * np.ptp(torque, axis=1) + drifting
    assert_allclose(found[HALF], half, rtol=1e-3)  # What half ranges are stated to


def test_a_magnifier_of_a_shaft_is_one_over_its_loss_factor() -> None:
    want = run([HALF], shaft=changed(shafts__6__loss_factor=0.125))
    found = run([HALF], shaft=changed(shafts__6__loss_factor=None, shafts__6__magnifier=8.0))
    assert_array_equal(found[HALF], want[HALF])


def test_damping_over_the_speed_is_read_at_each_speed() -> None:
    table = {"speed": [1000.0, 2000.0], "damping": [1.0, 5.0]}
    shaft = changed(discs__9__damping_over_speed=table, shafts__7__damping_over_speed=table)
    quantities = [HALF, "damping_ratio", "torsion_status", "natural_frequency"]
    found = run(quantities, shaft=shaft, axes={"speed": [1500, 2500]}, set={})
    plain = changed(discs__9__damping=3.0, shafts__7__damping=3.0)
    want = run([HALF, "damping_ratio"], shaft=plain, set={"speed": 1500})
    for name in want:
        if name in quantities:
            assert_allclose(found[name].sel(speed=1500), want[name], rtol=1e-12)
    assert found["torsion_status"].values.tolist() == [0, 4]
    assert np.isnan(found[HALF].sel(speed=2500)).all()
    assert "speed" not in found["natural_frequency"].dims


BLADES: dict[str, Any] = {"on": "propeller", "mean": 0.0, "harmonics": [{"order": 5, "sine": 9.0}]}
TABLE: dict[str, Any] = {"speed": [1000, 2000], "damping": [1, 5]}


@pytest.mark.parametrize(
    ("shaft", "match"),
    [
        (changed(excitations=[{**BLADES, "on": "propellor"}]), "on = 'propellor': no such"),
        (changed(excitations=[{**BLADES, "power": 2}]), "reference_speed: missing; power and"),
        (changed(excitations=[{**BLADES, "reference_speed": 2}]), "power: missing; power and"),
        (changed(excitations=[{**BLADES, "over_speed": [{**TABLE}]}]), "over_speed"),
        (changed(excitations=[{**BLADES, "over_speed": [
            {"speed": s, "mean": 0, "harmonics": []} for s in (1, 2)]}]),
         "number 1 (mean|harmonics): not allowed together with over_speed"),
        (changed(excitations=[{"on": "propeller", "over_speed": [
            {"speed": s, "mean": 0, "harmonics": []} for s in (2, 1)]}]), "must ascend"),
        (changed(excitations=[{**BLADES, "harmonics": [{"order": 2}]}]), "or amplitude"),
        (changed(excitations=[{**BLADES, "harmonics": [
            {"order": 2, "sine": 1, "amplitude": 2}]}]), "both amplitude and sine or cosine"),
        (changed(excitations=[{**BLADES, "harmonics": [
            {"order": 2, "sine": 1, "phase": 2}]}]), "phase: has no effect without amplitude"),
        (changed(excitations=[{**BLADES, "harmonics": [
            {"order": 257, "sine": 1}]}]), "order = 257: must be above 0 and at most 256"),
        (changed(excitations=[{"on": "propeller"}]), "mean: missing"),
        (changed(excitations=[{**BLADES, "factor": -1}]), "factor = -1: must be"),
        (changed(excitations=[BLADES] * 9), "excitations"),
        (changed(excitations=[{**BLADES, "name": "a"}] * 2), "'a' is given twice"),
        (changed(excitations=[{"on": "wheel", "mean": 0, "file": "no.csv"}]), "no.csv"),
        (changed(excitations=[{**BLADES, "file": "no.csv"}]), "has both file and harmonics"),
        (changed(modal_damping=[]), "modal_damping: 0 numbers: must be 1 to 12"),
        (changed(modal_damping=-0.1), "modal_damping number 1 = -0.1: must be"),
        (changed(modal_damping=[0.1, 1.0]), "modal_damping number 2 = 1: must be"),
        (changed(modal_damping=0.1, modal_magnifier=9), "both modal_damping and modal_magnifier"),
        (changed(modal_magnifier=[9, 0.5]), "modal_magnifier number 2 = 0.5: must be above 0.5"),
        (changed(excitations=[BLADES] * 9), "excitations = .* a list of at most 8 tables"),
        (changed(shafts__7__torque_over_twist={"twist": [0.0, 1.0], "torque": [0.0]}),
         "torque_over_twist torque = .* one for each twist"),
        (changed(shafts__6__magnifier=5.0), "number 7: has both loss_factor and magnifier"),
        (changed(shafts__7__magnifier=0.0), "number 8 magnifier"),
        (changed(discs__0__damping_over_speed=TABLE), "both damping and damping_over_speed"),
        (changed(discs__9__damping_over_speed={"speed": [2, 1], "damping": [1, 1]}), "ascend"),
        (changed(discs__9__damping_over_speed={"speed": [1, 2], "damping": [1]}), "damping"),
        (changed(discs__9__damping_over_speed={"speed": [1, 2, 3], "damping": [1, 2]}), "equally"),
        (changed(discs__9__damping_over_speed={"speed": [1, 2], "damping": [1, -1]}), "0 or more"),
    ],
)  # fmt: skip
def test_bad_tables_are_refused(shaft: Any, match: str) -> None:
    with pytest.raises(SceneError, match=match) as error:
        run([HALF], shaft=shaft)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("quantity", "more", "match"),
    [
        ("shaft_loss", {"modal_damping": 0.02}, "to none of which modal_damping belongs"),
        ("damper_heat_per_area", {"modal_damping": 0.02, "dampers": [
            {"on": "throw 1", "inertia": 0.1, "damping": 20.0, "surface": 0.2}]}, "modal_damping"),
        ("damped_critical_speed", {"discs__9__damping_over_speed": TABLE}, "damping_over_speed"),
    ],
)  # fmt: skip
def test_what_the_damping_does_not_tell_is_refused(
    quantity: str, more: dict[str, Any], match: str
) -> None:
    assert match in refusal(
        {"engine": "diesel_105x137", "shaft": changed(**more),
         "output": {"quantities": [quantity]}}
    )  # fmt: skip


@pytest.mark.parametrize(
    ("key", "match"),
    [
        ("excitation_factor_2", "there is no excitation number 2; the shaft has 1 excitation"),
        ("modal_damping_2", "there is no damped mode number 2; the shaft has 1 damped mode"),
        ("disc_damping_10", "disc 10 has damping_over_speed"),
    ],
)
def test_keys_without_their_part_are_refused(key: str, match: str) -> None:
    shaft = changed(excitations=[BLADES], modal_damping=0.1, discs__9__damping_over_speed=TABLE)
    with pytest.raises(SceneError, match=match):
        run([HALF], shaft=shaft, axes={key: [0.1, 0.2]})
