"""Arrangement, offset and unequal cylinders in scenes and engine files."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import sweeps
from engine_dyn import PeriodicSpeed, periodic_speed
from engine_dyn.geometry.layouts import arrangement_from_text
from engine_dyn.loads.friction import FrictionShape
from engine_dyn.quantities.graph import QUANTITIES
from sweeps.base.errors import SceneError
from sweeps.scene.engine.engine_files import load_engine
from sweeps.scene.plan.forecast import text as plan_text
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from tests.support.engine_files import POINTS, VALUES, modelled, written
from tests.support.scenes import APART, NOT_OF_AN_ENGINE, computed, refusal, refusal_of
from tests.support.shafts import complete_shaft

DELTA = ("delta", "omega_max", "omega_min", "torque_max", "torque_mean")
MEAN = ("torque_mean", "imep", "bmep", "fmep", "displacement", "brake_power", "peak_pressure")


def run(engine: str | Path = "ntua", quantities: tuple[str, ...] = DELTA, **tables: Any) -> Any:
    return computed(quantities, str(engine), **tables)


def scene(engine: str | Path = "ntua", **tables: Any) -> dict[str, Any]:
    return {"engine": str(engine), **tables, "output": {"quantities": ["delta"]}}


def planned(engine: str | Path = "ntua", **tables: Any) -> str:
    return plan_text(make_plan(read_scene(scene(engine, **tables))))


def alone(here: Any, **more: Any) -> PeriodicSpeed:
    """One design of a scene of `ntua` through `periodic_speed`, which an oracle checks."""
    engine = load_engine("ntua", Path())
    values = engine.values
    given = {
        "speed": values["speed"] * np.pi / 30.0, "cylinders": int(values["cylinders"]),
        "crankcase_pressure": 1e5 * values["crankcase_pressure"], "reciprocating_mass": 6.67,
        **{name: values[name] for name in ("bore", "stroke", "crank_ratio", "inertia")}, **more,
    }  # fmt: skip
    friction = float(here["friction_torque"])
    return periodic_speed(engine.family.at(values["load"]), friction_torque=friction, **given)


def vee(places: int) -> dict[str, Any]:
    """A V engine of two rods on each pin that fires evenly: a table of throws and cylinders."""
    step = 360.0 / places
    free = set(range(2 * places))
    cylinders = []
    for throw in range(places):
        for bank in (1, 2):  # banks 2 steps apart, throws 1; the second dead centre where free
            top = (2 * (bank - 1) - throw) % places
            fires = top if top in free else top + places
            free.remove(fires)
            cylinders.append({"throw": throw + 1, "bank": bank, "firing_angle": step * fires})
    throws = [{"angle": step * throw} for throw in range(places)]
    return {"banks": [-step, step], "throws": throws, "cylinders": cylinders}


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("count", "arrangement"),
    [(18, "radial 18 two-row"), (20, vee(10)), (24, vee(12)), (17, None), (23, None)],
    ids=str,
)
def test_engines_of_17_to_24_cylinders(count: int, arrangement: Any) -> None:
    """Even firing leaves orders that are multiples of Z/2, of all cylinders in step."""
    given = {} if arrangement is None else {"arrangement": arrangement}
    names = ["torque", "torque_order", "cylinder_torque_order", "delta", "energy_swing"]
    scene = {
        "engine": "ntua", "set": {"cylinders": count, "inertia": 20.0, **given},
        "output": {"quantities": names, "highest_order": 1.5 * count, "angle_step": 0.5},
    }  # fmt: skip
    found = sweeps.run(scene)
    one = sweeps.run({**scene, "set": {"cylinders": 1}})
    order = found["order"].values
    left = order % (0.5 * count) == 0.0
    all_in_step = count * found["cylinder_torque_order"].values
    assert_allclose(found["torque_order"].values[left], all_in_step[left], rtol=1e-9)
    assert np.abs(found["torque_order"].values[~left]).max() < 1e-9 * all_in_step.max()
    assert left.sum() == 3
    if 1440 % count == 0:
        alone = one["torque"].values
        whole = sum(np.roll(alone, k * 1440 // count) for k in range(count))
        assert_allclose(found["torque"].values, whole, atol=1e-9 * np.abs(alone).max())
    # A shaft of so much inertia gains the work between its extremes: delta = W/(Theta omega^2).
    swing = float(found["energy_swing"]) / (20.0 * (1200.0 * np.pi / 30.0) ** 2)
    assert float(found["delta"]) == pytest.approx(swing, rel=0.02)


def written_out(text: str, period: float = 4.0 * np.pi) -> dict[str, Any]:
    """Table of an arrangement that a text stands for."""
    made = arrangement_from_text(text, period)
    return {
        "name": made.name,
        "banks": [float(np.degrees(b)) for b in made.banks],
        "throws": [
            {"angle": float(np.degrees(t.angle)), "position": float(t.position)}
            for t in made.throws
        ],
        "cylinders": [
            {"throw": c.throw + 1, "bank": c.bank + 1,
             "firing_angle": float(np.degrees(c.firing_angle))}
            for c in made.cylinders
        ],
        "uneven": made.uneven,
        "firing_order": list(made.firing_order),
    }  # fmt: skip


@pytest.mark.parametrize(
    "text",
    ["in-line 1", "in-line 6 1-5-3-6-2-4", "V8 cross-plane", "V6 60 split-pin", "V2 45", "boxer 4",
     "W12 60,0,-60 1-11-7-3-12-8-4-10-6-2-9-5", "radial 9", "parallel twin 270"],
)  # fmt: skip
def test_a_text_and_its_table_are_the_same_engine(text: str) -> None:
    table = written_out(text)
    count = len(table["cylinders"])
    by_text, by_table = (
        read_scene(scene(set={"cylinders": count, "arrangement": given})).own_cylinders
        for given in (text, table)
    )
    assert by_text is not None and by_table is not None
    assert by_table.along_shaft == by_text.along_shaft
    assert by_table.symmetry == by_text.symmetry
    for one, other in zip(by_text.members, by_table.members, strict=True):
        assert one == pytest.approx(other, abs=1e-13)


# A V4 whose pairs of pins stand 28 degrees apart: no text says it.
V4: dict[str, Any] = {
    "name": "V4", "banks": [0, 76],
    "throws": [{"angle": 0}, {"angle": 28}, {"angle": 180}, {"angle": 208, "radius_factor": 0.9}],
    "cylinders": [
        {"throw": 1, "bank": 1, "firing_angle": 0}, {"throw": 2, "bank": 2, "firing_angle": 408},
        {"throw": 3, "bank": 1, "firing_angle": 180}, {"throw": 4, "bank": 2, "firing_angle": 588},
    ],
    "uneven": True,
}  # fmt: skip


@pytest.mark.compiled
def test_a_crankshaft_that_is_written_out(tmp_path: Path) -> None:
    """In a scene, along an axis and in an engine file: as its angles and radii say."""
    asked = ("delta", "torque_mean", "shaking_moment_max")
    shaft = {"cylinder_spacing": 0.2}
    found = run(set={"cylinders": 4, "arrangement": V4, **shaft}, quantities=asked)
    kept = json.loads(found.attrs["arrangement"])
    assert kept["name"] == "V4"
    assert kept["throws"] == [0.0, 28.0, 180.0, 208.0]
    assert kept["radius_factor"] == [1.0, 1.0, 1.0, 0.9]
    angles = {"firing_angles": [0, 408, 180, 588], "radius_factor": [1, 1, 1, 0.9]}
    in_line = run(set={"cylinders": 4, **angles}, quantities=asked[:2])
    for name in asked[:2]:
        assert float(found[name]) == pytest.approx(float(in_line[name]), rel=1e-12)

    closer = {**V4, "name": "pairs in one place", "throws": [
        {**throw, "position": i // 2} for i, throw in enumerate(V4["throws"])
    ]}  # fmt: skip
    several = run(
        set={"cylinders": 4, **shaft}, axes={"arrangement": [V4, "in-line 4", closer]},
        quantities=asked,
    )  # fmt: skip
    assert several["arrangement_name"].values.tolist() == ["V4", "in-line 4", "pairs in one place"]
    assert several["delta"].values[0] == several["delta"].values[2] == found["delta"].values
    moments = several["shaking_moment_max"].values
    assert moments[0] == found["shaking_moment_max"].values
    assert moments[2] < 0.5 * moments[0]

    lines = ["[arrangement]", f"banks = {V4['banks']}", "uneven = true"]
    for key in ("throws", "cylinders"):
        rows = (", ".join(f"{k} = {v}" for k, v in row.items()) for row in V4[key])
        lines.append(f"{key} = [{', '.join(f'{{ {row} }}' for row in rows)}]")
    body = VALUES.replace("cylinders = 2", "cylinders = 4")
    path = written(tmp_path, body + modelled() + "\n" + "\n".join(lines) + "\n")
    own = load_engine(path, Path()).own_cylinders
    assert own is not None and own.arrangement is not None
    assert own.arrangement.name == "4 cylinders on 4 throws, 2 banks"
    assert own.radius_factors == (1.0, 1.0, 1.0, 0.9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"uneven": False},
         "intervals 180, 228, 180, 132 degree: uneven; if this is intended, set"),
        ({"banks": [0]}, "cylinder 2: bank = 2: must be a number from 1 to 1"),
        ({"banks": [0, "a"]}, r"\[banks\] number 2 = 'a': must be a list of 1 to 24 directions"),
        ({"banks": []}, r"banks = \[\]: must be a list of 1 to 24 directions"),
        ({"banks": [0, 80]}, "firing_angle = 408 degree: its throw is at top dead centre at 52 or"),
        ({"throws": [{"angle": 0}] * 25}, "must be a list of 1 to 24 tables with angle"),
        ({"throws": V4["throws"][:3]}, "cylinder 4: throw = 4: must be a number from 1 to 3"),
        ({"throws": [*V4["throws"], {"angle": 9}]}, "throw 5: has no cylinder; needs at least"),
        ({"throws": [{"angle": 0, "position": 1e308}]},
         r"number 1 position = 1e\+308: must be a num"),
        ({"throws": [{"angel": 0}]}, r"number 1 angel: unknown key; did you mean 'angle'"),
        ({"cylinders": [{"throw": 1}]}, "number 1 firing_angle: missing; must be a number, the"),
        ({"firing_order": [1, 3, 2, 2]}, "must name each of the cylinders 1 to 4 once"),
        ({"firing_order": [1, 2, 3, 4]}, "the firing angles give 1-3-2-4; both must agree"),
        ({"order": [1, 2, 3, 4]}, "order: unknown table or key"),
    ],
)  # fmt: skip
def test_crankshafts_that_are_none(change: dict[str, Any], message: str) -> None:
    told = refusal(scene(set={"cylinders": 4, "arrangement": {**V4, **change}}))
    assert re.match(rf"scene: \[set\] arrangement: .*{message}", told)


@pytest.mark.compiled
def test_two_stroke_engines(tmp_path: Path) -> None:
    """The cycle is one turn: two cylinders fire evenly 180 degrees apart."""
    angle = np.arange(-180.0, 180.0)
    half = np.sin(np.radians(angle) / 2.0) ** 2
    shut = np.abs(angle) < 110.0
    bar = np.where(shut, 1.1 * (0.78 / (0.06 + 0.94 * half)) ** 1.3, 1.1)
    bar = np.maximum(bar, 1.1) + 30.0 * np.exp(-(((angle - 20.0) / 20.0) ** 2))
    rows = "\n".join(f"{a:g},{p:.6f}" for a, p in zip(angle, bar, strict=True))
    path = written(tmp_path, VALUES.replace("four-stroke", "two-stroke") + POINTS)
    (tmp_path / "pressure.csv").write_text(f"crank_angle_deg,pressure_bar\n{rows}\n")
    even = run(path)
    assert even["status"] == 0
    assert run(path, set={"firing_angles": [0, 180]})["delta"].values == even["delta"].values
    assert "2 cylinders: whole cycle, uneven firing" in planned(
        path, set={"firing_angles": [0, 90]}
    )
    missing = run(path, MEAN, set={"pressure_factor": [1, 0]})
    # Mirrored, the compression does no work.
    share = float(missing["imep"] / run(path, MEAN)["imep"])
    assert share == pytest.approx(0.5, rel=1e-3)
    with pytest.raises(SceneError, match="firing_angle = 360 degree: must be 0 or more and below"):
        run(path, set={"firing_angles": [0, 360]})


@pytest.mark.compiled
@pytest.mark.parametrize("engine", ["ntua", "diesel_105x137"])
def test_a_misfire(engine: str) -> None:
    """Modelled and measured diagrams: a cylinder less, and its friction and gas exchange more."""
    whole = run(engine, MEAN, set={"cylinders": 4})
    missing = run(engine, MEAN, set={"cylinders": 4, "pressure_factor": [1, 1, 0, 1]})
    share = float(missing["imep"] / whole["imep"])
    assert 0.70 < share < 0.75
    assert float(missing["peak_pressure"]) == float(whole["peak_pressure"])
    assert float(missing["fmep"]) < float(whole["fmep"])
    # The mean torque is that of the mean effective pressures.
    for found in (whole, missing):
        pressure = 1e5 * float(found["imep"] - found["fmep"])
        torque = pressure * float(found["displacement"]) / (4.0 * np.pi)
        assert float(found["torque_mean"]) == pytest.approx(torque, rel=1e-12)
    none = run(engine, MEAN, set={"cylinders": 4, "pressure_factor": [0] * 4})
    assert -0.1 * float(whole["imep"]) < float(none["imep"]) < 0.0


@pytest.mark.compiled
def test_every_quantity_of_an_unequal_engine_with_offset() -> None:
    # The series of the motion are those of a centred mechanism; no characteristic is followed.
    series = (
        "position_", "velocity_", "acceleration_", "inertia_torque_coefficient",
        "inertia_pressure_order", "characteristic_power", "characteristic_torque",
    )  # fmt: skip
    names = tuple(name for name in QUANTITIES if not name.startswith(series) and name not in APART)
    found = run(
        quantities=names,
        axes={"pin_offset": [-0.002, 0.0, 0.01]},
        set={"cylinders": 4, "pressure_factor": [1, 1, 0, 1], "mass_factor": [1, 1, 1.1, 1],
             **NOT_OF_AN_ENGINE["set"]},
        shaft=complete_shaft(4), mounts=NOT_OF_AN_ENGINE["mounts"],
    )  # fmt: skip
    for name in names:
        # Counterweights of four throws in line cancel: no fraction is better than another.
        expected = not name.startswith("best_fraction")
        finite = np.isfinite(found[name])
        if not {"shaft", "crossing"}.isdisjoint(finite.dims):
            # Not each shaft has a node or a diameter, and crossings are few.
            finite = finite.any([d for d in ("mode", "shaft", "crossing") if d in finite.dims])
        assert finite.all() == expected, name
    assert "pin_offset" not in found["fmep"].dims


OTHERS = (*DELTA, "imep", "peak_pressure", "gas_torque", "torque_after_throw", "omega")


@pytest.mark.compiled
def test_arrangements_and_misfires_as_axes() -> None:
    """Each design is the engine whose [set] has these cylinders, bit for bit."""
    texts = ["V4 90", "in-line 4", "boxer 4"]
    asked: dict[str, Any] = {"output": {"quantities": list(OTHERS), "angle_step": 10.0}}
    found = sweeps.run(
        {"engine": "ntua", "axes": {"misfire": [0, 2], "inertia": [3.0, 6.0], "arrangement": texts},
         "set": {"cylinders": 4, "mass_factor": [1.0, 1.1, 1.0, 1.0]}, **asked}
    )  # fmt: skip
    assert found["delta"].dims == ("misfire", "inertia", "arrangement")
    assert found["imep"].dims == ("misfire",) or found["imep"].dims == ("misfire", "arrangement")
    assert list(found["arrangement_name"].values) == texts
    assert [one["name"].split()[0] for one in json.loads(found.attrs["arrangement"])] == [
        "V4", "in-line", "boxer",
    ]  # fmt: skip
    for place, text in enumerate(texts):
        for misfire, factors in ((0, [1, 1, 1, 1]), (2, [1, 0, 1, 1])):
            keys = {"arrangement": text, "pressure_factor": factors, "cylinders": 4}
            alone = sweeps.run(
                {"engine": "ntua", "axes": {"inertia": [3.0, 6.0]},
                 "set": {**keys, "mass_factor": [1.0, 1.1, 1.0, 1.0]}, **asked}
            )  # fmt: skip
            for name in OTHERS:
                where = {"misfire": misfire, "arrangement": place}
                here = found[name].sel({k: v for k, v in where.items() if k in found[name].dims})
                if "throw" in here.dims:  # as many as the engine with most of them has
                    here = here.dropna("throw", how="all")
                assert_array_equal(here, alone[name], name)


@pytest.mark.compiled
def test_unequal_throws_and_friction_through_a_scene() -> None:
    shares = {"friction_boundary": 0.2, "friction_mixed": 0.1, "friction_hydrodynamic": 0.4,
              "friction_skirt": 0.1}  # fmt: skip
    radii = [1.0, 0.9, 1.2]
    found = run(
        quantities=(*DELTA, "friction_torque", "displacement", "imep", "torque", "energy_swing",
                    "instantaneous_friction_torque", "torque_after_throw", "mean_piston_speed"),
        axes={"speed": [900.0, 1300.0], "ring_pressure": [1.2, 2.0]},
        set={"cylinders": 3, "radius_factor": radii, "reciprocating_mass": 6.67, **shares},
    )  # fmt: skip
    for speed in (900.0, 1300.0):
        for ring in (1.2, 2.0):
            here = found.sel(speed=speed, ring_pressure=ring)
            one = alone(
                here, speed=speed * np.pi / 30.0, cylinders=3, radius_factor=radii,
                firing_angles=np.radians([0.0, 480.0, 240.0]),
                friction_shape=FrictionShape(0.2, 0.1, 0.4, 0.1, 1e5 * ring),
            )  # fmt: skip
            assert float(here["delta"]) == pytest.approx(one.delta, rel=1e-9)
            assert float(here["torque_mean"]) == pytest.approx(one.torque_mean, rel=1e-12)
    values = load_engine("ntua", Path()).values
    area = 0.25 * np.pi * values["bore"] ** 2
    stroke = values["stroke"] * np.mean(radii)
    assert float(found["displacement"]) == pytest.approx(3.0 * area * stroke, rel=1e-12)
    assert_allclose(found["mean_piston_speed"], stroke * found["speed"] / 30.0)
    # Torque times angle is the work of the mean pressures.
    work = (found["torque_mean"] + found["friction_torque"]) * 4.0 * np.pi
    assert_allclose(work, 1e5 * found["imep"] * found["displacement"], rtol=1e-12)
    friction = found["instantaneous_friction_torque"]
    assert (friction > 0.0).all()
    assert (friction.max("crank_angle") > 2.0 * friction.min("crank_angle")).all()
    of_curves = friction.mean("crank_angle") / found["friction_torque"]
    assert_allclose(of_curves, 1.0, rtol=1e-3)
    assert_allclose(found["torque"].max("crank_angle"), found["torque_max"], rtol=1e-3)
    assert_allclose(found["torque_after_throw"].isel(throw=0), found["torque"], atol=1e-9)


@pytest.mark.compiled
def test_offset_through_a_scene_is_that_of_one_design() -> None:
    found = run(
        quantities=(*DELTA, "friction_torque"),
        axes={"pin_offset": [0.0, 0.01], "crank_offset": [0.0, -0.004, 0.02]},
        set={"reciprocating_mass": 6.67},
    )
    for pin in (0.0, 0.01):
        for crank in (0.0, -0.004, 0.02):
            here = found.sel(pin_offset=pin, crank_offset=crank)
            one = alone(here, offset=pin + crank)
            assert float(here["delta"]) == pytest.approx(one.delta, rel=1e-12)
            assert float(here["torque_mean"]) == pytest.approx(one.torque_mean, rel=1e-12)
    plain = run(set={"reciprocating_mass": 6.67})
    centred = found.sel(pin_offset=0.0, crank_offset=0.0)
    for name in DELTA:
        assert centred[name].values == plain[name].values


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        # arrangements
        ({"set": {"arrangement": "V7 60"}}, r"\[set\] arrangement = 'V7 60': .* even number"),
        ({"set": {"arrangement": 4}}, r"\[set\] arrangement = 4: must be the engine's arrangement"),
        ({"set": {"arrangement": "in-line 4"}}, "has 4 cylinders, the engine 1"),
        # The word is near "radial", which it does not mean.
        ({"set": {"arrangement": "axial 5", "cylinders": 5}},
         r"^scene: \[set\] arrangement = 'axial 5': axial engines are not covered(?!.*you mean)"),
        ({"set": {"cylinders": 2, "firing_angles": [0.0]}}, "firing_angles: 1 values for 2 cyl"),
        ({"set": {"cylinders": 2, "firing_angles": 180}}, "must be a list of numbers, one for"),
        ({"set": {"cylinders": 2, "firing_angles": [10, 180]}}, "firing_angle = 10 degree: must"),
        ({"set": {"cylinders": 2, "firing_angles": [0, 720]}}, "0 or more and below 720"),
        ({"set": {"cylinders": 2, "firing_angles": [0, "x"]}}, r"\[set\] firing_angles, value 2"),
        ({"set": {"cylinders": 2, "arrangement": "V2 90", "firing_angles": [0, 180]}},
         "cylinder 2: firing_angle = 180 degree: its throw is at top dead centre at "),
        ({"axes": {"arrangement": []}}, r"\[axes\] arrangement = \[\]: must be a list of strings"),
        ({"axes": {"arrangement": [4]}}, "must be a list of strings such as 'V8 flat-plane'"),
        ({"axes": {"arrangement": ["in-line 1", "in-line 1"]}}, "duplicate 'in-line 1'"),
        ({"set": {"cylinders": 4}, "axes": {"arrangement": [V4, V4]}}, "or have different names"),
        ({"set": {"cylinders": 4}, "axes": {"arrangement": ["boxer 2"]}},
         r"\[axes\] arrangement = 'boxer 2': has 2 cylinders, the engine 4"),
        ({"axes": {"arrangement": ["in-line 1"]}, "set": {"arrangement": "in-line 1"}},
         "not allowed together with arrangement in"),
        ({"axes": {"arrangement": ["in-line 2"], "cylinders": [1, 2]}},
         "not allowed together with several numbers of cylinders"),
        ({"designs": {"arrangement": [3]}}, r"\[designs\] arrangement = \[3\]: must be a list"),
        ({"designs": {"arrangement": ["V7 60"]}}, "arrangement = 'V7 60': .* an even number"),
        # unequal cylinders
        ({"set": {"pressure_factor": [1, 1]}}, "pressure_factor: 2 values for 1 cylinders"),
        ({"set": {"pressure_factor": [-1]}}, "pressure_factor, value 1 = -1: must be a number"),
        ({"set": {"mass_factor": []}}, "no values; at least one is needed"),
        ({"axes": {"mass_factor": [1, 2]}}, r"\[axes\] mass_factor: must be in \[set\]"),
        ({"axes": {"cylinders": [2, 4]}, "set": {"mass_factor": [1, 1, 2]}},
         "mass_factor: is for 3 cylinders, which the scene does not have; must be for one of"),
        ({"set": {"misfire": 2}}, r"\[set\] misfire = 2: must be the number of one of 1 cyl"),
        ({"axes": {"misfire": [0, 3], "cylinders": [2, 4]}}, "misfire = 3: .* one of 2 cyl"),
        ({"designs": {"misfire": [3, 3], "cylinders": [4, 2]}}, "misfire = 3: .* one of 2 cyl"),
        ({"set": {"misfire": 0.5}}, "misfire = 0.5: must be a whole number"),
        # parameters of single cylinders
        ({"set": {"pressure_factor_2": 0.0}}, "pressure_factor_2: must be of one of the 1 cylind"),
        ({"axes": {"mass_factor_1": [2.5]}}, r"\[axes\] mass_factor_1 = 2.5: .* from 0 to 2"),
        ({"set": {"firing_angle_1": 10}}, "firing_angle_1: unknown key"),
        ({"set": {"mass_factor_25": 1}}, "mass_factor_25: unknown key"),
        ({"set": {"cylinders": 2, "arrangement": "V2 60"}, "axes": {"firing_angle_2": [90]}},
         r"\[axes\] firing_angle_2: cylinders 1 and 2 are on one throw: cylinder 2 must"),
        ({"axes": {"cylinders": [2, 3], "mass_factor_2": [0.9]}},
         r"\[axes\] mass_factor_2: not allowed together with several numbers of cylinders"),
        ({"axes": {"pressure_factor": [1, 0]}}, "pressure_factor_2 and so on"),
        ({"axes": {"firing_angles": [0, 90]}}, "firing_angle_2 and so on"),
        # radii
        ({"set": {"cylinders": 2, "radius_factor": [0.9, 1.0]}}, "value 1 = 0.9: must be 1, the"),
        ({"set": {"cylinders": 2, "radius_factor": [1.0, 0.05]}}, "value 2 = 0.05: .* 0.1 to 2"),
        ({"set": {"cylinders": 2, "radius_factor": [1.0, 2.5]}}, "value 2 = 2.5: .* 0 to 2"),
        ({"set": {"cylinders": 2, "arrangement": "V2 90", "radius_factor": [1.0, 0.9]}},
         "value 2 = 0.9: must be 1 as of the other cylinders on throw 1"),
        ({"set": {"cylinders": 2, "radius_factor": [1, 1.9], "pin_offset": 0.155}},
         r"pin_offset: radius_factor = 1.9: with crank_ratio = 0.257143 and an offset of 2\.\d+ "
         r"crank radii the crank cannot turn; must be below 1\."),
        ({"set": {"cylinders": 2, "radius_factor": [1, 1.9]}, "axes": {"crank_ratio": [0.55]}},
         r"\[set\] radius_factor = 1.9: with crank_ratio = 0.55 the crank cannot turn; must be "
         "below 1.8"),
        ({"set": {"cylinders": 2}, "axes": {"radius_factor_2": [1, 2], "crank_ratio": [0.6]}},
         r"\[axes\] radius_factor = 2: with crank_ratio = 0.6 the crank cannot turn"),
        # friction over the stroke, offset
        ({"set": {"friction_skirt": 0.6}, "axes": {"friction_mixed": [0.2, 0.5]}},
         "friction_skirt = 1.1 in one design: the sum must be at most 1"),
        ({"set": {"friction_boundary": 0.3}}, "needs ring_pressure .* engine ntua does not give"),
        ({"set": {"friction_boundary": -0.3}}, "friction_boundary = -0.3: must be"),
        ({"set": {"pin_offset": 0.3}}, r"\[set\] pin_offset: offset = 0.3 m: the crank cannot"),
        ({"axes": {"crank_offset": [0.0, -0.4]}}, r"\[axes\] crank_offset: .* cannot turn"),
        ({"axes": {"pin_offset": [0.0, 0.4]}}, r"\[axes\] pin_offset: .* cannot turn"),
        ({"designs": {"rod_length": [0.35, 0.12], "pin_offset": [0.0, 0.08]}},
         r"\[designs\] pin_offset: .* cannot turn"),
    ],
)  # fmt: skip
def test_one_line_for_what_is_wrong(tables: dict[str, Any], message: str) -> None:
    assert re.search(message, refusal(scene(**tables)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("[values]", "firing_order = [1, 2]\nfiring_angles = [0, 180]\n[values]"),
         "has both firing_order and firing_angles: give one of them"),
        (("[values]", "arrangement = 'boxer 4'\n[values]"), "has 4 cylinders, the engine 2"),
        (("[values]", "mass_factor = 1\n[values]"), "mass_factor = 1: must be a list of numbers"),
        (("stroke = 0.18", "stroke = 0.18\npin_offset = 0.34"), "pin_offset|crank cannot turn"),
        (("[values]", "[values]\nmass_factor_2 = 0.9"),
         "mass_factor_2: not allowed; the file has mass_factor"),
    ],
)  # fmt: skip
def test_engine_files_that_are_none(tmp_path: Path, change: tuple[str, str], message: str) -> None:
    path = written(tmp_path, VALUES.replace(*change) + modelled())
    assert re.search(message, refusal_of(lambda: load_engine(path, Path())))


@pytest.mark.compiled
def test_single_cylinders_are_the_lists_with_one_value_changed() -> None:
    """Each parameter as an axis, against the list of [set] that says the same."""
    base: dict[str, Any] = {"cylinders": 3, "reciprocating_mass": 6.67}
    quantities = (*DELTA, "imep", "friction_torque", "displacement")
    for key, values, name, lists in (
        ("pressure_factor_2", [0.0, 0.4], "pressure_factor", [[1, 0, 1], [1, 0.4, 1]]),
        ("mass_factor_3", [0.9, 1.1], "mass_factor", [[1, 1, 0.9], [1, 1, 1.1]]),
        ("radius_factor_2", [0.8, 1.0], "radius_factor", [[1, 0.8, 1], [1, 1, 1]]),
        ("firing_angle_2", [200.0, 480.0], "firing_angles", [[0, 200, 240], [0, 480, 240]]),
    ):
        found = run(quantities=quantities, set=base, axes={key: values})
        for place, each in enumerate(lists):
            same = run(quantities=quantities, set={**base, name: each})
            for quantity in quantities:
                here = found[quantity]
                here = here.isel({key: place}) if key in here.dims else here
                assert float(here) == pytest.approx(float(same[quantity]), rel=1e-12), quantity
    assert found["firing_angle_2"].attrs["units"] == "degree"
