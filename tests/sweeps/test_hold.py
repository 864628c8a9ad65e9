"""A set that holds its load: the load follows so that misfires leave the mean brake torque."""

import json
import math
import re
import tomllib
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose
from scipy.optimize import brentq

import engine_dyn
import sweeps
from engine_dyn.engine import Engine
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.motored import motored
from engine_dyn.status import MEANINGS, OF_STEADY, TORQUE_NOT_REACHED
from engine_dyn.units import RPM
from sweeps.base.dimensions import OF_PATTERNS
from sweeps.lab.speed.computed_speeds import engine_of
from sweeps.running.reduce.reduction import Reduction
from sweeps.scene.engine.engine_files import load_engine
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from tests.support.commands import invoke, ok
from tests.support.engine_files import ENGINES
from tests.support.scenes import computed, refusal, refusal_of, toml, write_scene

pytestmark = pytest.mark.filterwarnings("ignore::engine_dyn.ImplausibleWarning")

FOUR = "si_four_87x101"
ASKED = ("held_load", "torque_to_hold", "torque_mean", "delta")
HELD = {"speed": 3000.0, "load": 50.0, "hold": "brake_power"}
NUMBERS = {key: value for key, value in HELD.items() if key != "hold"}


@cache
def without_combustion(name: str) -> Family:
    """Diagrams of a cylinder that does not burn, over the load."""
    family = load_engine(name, Path(), "").family
    assert isinstance(family, Family)
    return family.each(motored)


def torque_of(
    name: str, load: float, speed: float, factors: list[float], **more: Any
) -> float:  # fmt: skip
    """Mean brake torque of one design by the interface for numbers, its friction by hand."""
    engine, dead = load_engine(name, Path(), ""), without_combustion(name).at(load)
    diagram = replace(engine.family.at(load), motored=lambda: dead)
    values, count = engine.values, len(factors)
    bore, stroke = values["bore"], values["stroke"]
    # Kakaitsas eq. 3.9, the peak being the mean over the cylinders
    peaks = [float((dead.pressure + f * (diagram.pressure - dead.pressure)).max()) for f in factors]
    mean_speed = speed * stroke / math.pi
    fmep = (
        1e5 * values["friction_constant"]
        + values["friction_peak_pressure"] * np.mean(peaks)
        + 1e5 * values["friction_mean_piston_speed"] * mean_speed
    )
    swept = count * math.pi / 4.0 * bore**2 * stroke
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return engine_dyn.periodic_speed(
            diagram, bore=bore, stroke=stroke, crank_ratio=values["crank_ratio"],
            reciprocating_mass=1.0, inertia=50.0, speed=speed, cylinders=count,
            crankcase_pressure=1e5 * values["crankcase_pressure"],
            friction_torque=float(fmep) * swept / engine.period, pressure_factor=factors, **more,
        ).torque_mean  # fmt: skip


def root(torque: Callable[[float], float], wanted: float, engine: Engine) -> float:
    """Load with a torque, by SciPy; NaN where the diagrams do not reach it."""
    low, high = engine.family.low, engine.family.high
    if not torque(low) <= wanted <= torque(high):
        return math.nan
    return float(brentq(lambda load: torque(load) - wanted, low, high, xtol=1e-11, rtol=1e-13))


@pytest.mark.parametrize(
    ("name", "cylinders", "rpm", "load"),
    [(FOUR, 4, 3000.0, 55.0), ("v6_96x81", 6, 4000.0, 40.0), ("marine_80x345", 7, 70.0, 75.0),
     ("boxer_twin_101x70", 2, 5000.0, 35.0), ("ntua", 4, 1200.0, 45.0),
     ("v8_cross_plane_93x86", 8, 3000.0, 92.0)],
)  # fmt: skip
def test_the_load_is_the_root_of_an_independent_search(
    name: str, cylinders: int, rpm: float, load: float
) -> None:
    """With and without a dead cylinder: loads to 1e-7 percent, torques to 1e-10."""
    engine = load_engine(name, Path(), "")
    settings = {"speed": rpm, "cylinders": cylinders, "inertia": 20.0 * engine.values["inertia"]}
    found = computed(
        ASKED, name, set={**settings, "load": load, "hold": "brake_torque"},
        axes={"misfire": [0, 2]},
    )  # fmt: skip

    def torque(at: float, dead: int) -> float:
        factors = [0.0 if i == dead else 1.0 for i in range(1, cylinders + 1)]
        return torque_of(name, at, rpm * RPM, factors)

    whole = torque(load, 0)
    wanted = root(lambda at: torque(at, 2), whole, engine)
    assert_allclose(found.torque_to_hold, whole, rtol=1e-9)
    assert found.held_load.values[0] == load
    assert_allclose(found.held_load.values[1], wanted, rtol=0.0, atol=1e-7)
    if math.isnan(wanted):
        assert found.status.values.tolist() == [0, TORQUE_NOT_REACHED]
        assert np.isnan(found.delta.values[1])
        return
    assert_allclose(found.torque_mean, whole, rtol=1e-10)
    # The same diagram named by its load gives the same
    named = computed(("delta",), name, set={**settings, "load": float(found.held_load[1]),
                                            "misfire": 2})  # fmt: skip
    assert_allclose(float(named.delta), float(found.delta[1]), rtol=1e-9)


def test_a_four_cylinder_at_75_percent_cannot_hold_with_one_dead() -> None:
    """Its last diagram, of 90 percent, gives 84 percent of the torque (here 85, at 1200 rpm)."""
    four = {"speed": 1200, "cylinders": 4, "inertia": 10}
    found = computed(ASKED, "ntua", set={**four, "load": 75, "hold": "brake_torque"},
                     axes={"misfire": [0, 1]})  # fmt: skip
    assert found.status.values.tolist() == [0, TORQUE_NOT_REACHED]
    assert np.isnan(found.held_load.values[1]) and np.isfinite(found.torque_to_hold).all()
    most = computed(["torque_mean"], "ntua", set={**four, "load": 90, "misfire": 1})
    assert float(most.torque_mean / found.torque_to_hold) == pytest.approx(0.84, abs=0.011)


def test_patterns_and_factors_are_disturbances_as_a_misfire_is() -> None:
    """Firing order 1-3-4-2: the fourth firing of each cycle is cylinder 2."""
    misfire = computed(ASKED, FOUR, set={**HELD, "misfire": 2})
    patterns = computed(ASKED, FOUR, set=HELD, axes={"firing_pattern": ["1", "1110", "110", "11d"]})
    factors = computed(ASKED, FOUR, set=HELD, axes={"pressure_factor_2": [1.0, 0.5, 0.0]})
    listed = computed(ASKED, FOUR, set={**HELD, "pressure_factor": [1, 0, 1, 1]})
    load = float(misfire.held_load)
    assert load > 50.0
    assert_allclose(
        [patterns.held_load[1], factors.held_load[2], listed.held_load], load, rtol=1e-11
    )
    assert_allclose(
        [patterns.delta[1], factors.delta[2], listed.delta], float(misfire.delta), rtol=1e-9
    )
    assert float(patterns.held_load[0]) == float(factors.held_load[0]) == 50.0
    assert 50.0 < float(factors.held_load[1]) < load
    for found in (misfire, patterns, factors, listed):
        assert_allclose(*np.broadcast_arrays(found.torque_mean, found.torque_to_hold), rtol=1e-11)


def test_what_is_not_disturbed_keeps_its_bits() -> None:
    plain = computed(("delta", "torque_max"), FOUR, set=NUMBERS, axes={"misfire": [0, 2]})
    held = computed(("delta", "torque_max"), FOUR, set=HELD, axes={"misfire": [0, 2]})
    for name in ("delta", "torque_max"):
        assert held[name].values[0] == plain[name].values[0]
        assert held[name].values[1] > plain[name].values[1]


def grid_engine(folder: Path) -> Path:
    """The four-cylinder with diagrams over load and speed."""
    raw = tomllib.loads((ENGINES / f"{FOUR}.toml").read_text(encoding="utf-8"))
    raw["values"]["speed"] = 3000
    rows = [
        {**table, "speed": rpm, "heat": table["heat"] * share}
        for table in raw.pop("diagram") for rpm, share in ((2500, 1.05), (4500, 0.95))
    ]  # fmt: skip
    for row in rows:
        del row["speeds"]
    text = "".join(f"{key} = {toml(raw[key])}\n" for key in ("title", "cycle", "arrangement"))
    for head, table in (("[values]", raw["values"]), *(("[[diagram]]", row) for row in rows)):
        text += f"{head}\n" + "".join(f"{key} = {toml(one)}\n" for key, one in table.items())
    path = folder / "grid.toml"
    path.write_text(text, encoding="utf-8")
    return path


CASES: dict[str, dict[str, Any]] = {
    "friction by components": {"set": {"friction_law": "patton_nitschke_heywood"}},
    "auxiliaries": {"set": {"auxiliary_torque": 4.0},
                    "auxiliaries": [{"mean": 3.0, "harmonics": [{"order": 2, "cosine": 1.0}]}]},
    "modelled cycles": {"axes": {"combustion_duration": [55.0, 65.0]}},
    "an offset": {"set": {"pin_offset": 0.003}},
    "friction over the stroke": {"set": {"friction_boundary": 0.3, "ring_pressure": 1.5}},
    "unequal throws": {"set": {"radius_factor_2": 0.97}},
    "articulated rods": {"set": {"arrangement": "radial 5", "cylinders": 5,
                                 "articulated_rods": {"radius": 0.3, "knuckle_mass": 0.2}}},
    "a wanted delta": {"set": {"wanted_delta": "1/50"}},
    "several engines": {"engine": [FOUR, "v6_96x81"]},
    "a sample": {"sample": {"number": 4, "bore": {"low": 0.085, "high": 0.09}}},
    "over load and speed": {"engine": "grid", "axes": {"speed": [2500.0, 3100.0, 4500.0]}},
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_it_holds_with_all_that_the_torque_depends_on(case: str, tmp_path: Path) -> None:
    """Torques to 1e-9, where the search stops at the resolution of modelled cycles to 1e-8."""
    tables = dict(CASES[case])
    engine = tables.pop("engine", FOUR)
    engine = str(grid_engine(tmp_path)) if engine == "grid" else engine
    axes = {"misfire": [0, 2], **tables.pop("axes", {})}
    settings = {k: v for k, v in {**HELD, **tables.pop("set", {})}.items() if k not in axes}
    found = computed(ASKED, engine, set=settings, axes=axes, **tables)
    held, wanted = xr.broadcast(found.torque_mean, found.torque_to_hold)
    assert (found.status == 0).all()
    assert_allclose(held, wanted, rtol=1e-8 if case == "modelled cycles" else 1e-9)
    assert (found.held_load.sel(misfire=0) == 50.0).all()
    assert (found.held_load.sel(misfire=2) > 50.0).all()
    # A design named by its load, without hold, has this torque
    one = {dim: -1 for dim in found.held_load.dims}
    place = found.isel(one)
    named = {k: v for k, v in settings.items() if k != "hold"}
    named |= {key: float(place[key]) for key in axes} | {"load": float(place.held_load)}
    if "sample" in tables:
        named["bore"] = float(place.bore)
    more = {k: v for k, v in tables.items() if k != "sample"}
    chosen = engine[-1] if isinstance(engine, list) else engine
    alone = computed(("torque_mean",), chosen, set=named, **more)
    assert_allclose(float(alone.torque_mean), float(place.torque_mean), rtol=1e-8)


def test_numbers_are_held_over_axes_designs_and_samples() -> None:
    """A brake power is a torque times the speed; neither needs a load."""
    found = computed(
        (*ASKED, "brake_power"), FOUR, set={"misfire": 1},
        axes={"held_power": [15e3, 30e3], "speed": [2800.0, 5000.0]},
    )  # fmt: skip
    power, wanted = xr.broadcast(found.brake_power, found.held_power)
    reached = found.status == 0
    assert reached.any() and not reached.all()
    assert_allclose(power.values[reached], wanted.values[reached], rtol=1e-11)
    assert (found.status.values[~reached.values] == TORQUE_NOT_REACHED).all()
    text = computed(("brake_power",), FOUR, set={"speed": 2800, "held_power": "30 kW"})
    assert float(text.brake_power) == pytest.approx(30e3, rel=1e-11)
    torques = computed(("torque_mean",), FOUR, set={"speed": 2800},
                       designs={"held_torque": [90.0, 120.0], "misfire": [0, 3]})  # fmt: skip
    assert_allclose(torques.torque_mean, [90.0, 120.0], rtol=1e-11)
    drawn = computed(("torque_mean",), FOUR, set={"speed": 2800, "misfire": 1},
                     sample={"number": 4, "held_torque": {"low": 90.0, "high": 120.0}})  # fmt: skip
    assert_allclose(drawn.torque_mean, drawn.held_torque, rtol=1e-11)


def test_the_outcome_is_of_scenes_that_hold_alone(tmp_path: Path) -> None:
    plain = computed(("delta",), FOUR, set=NUMBERS)
    held = computed(("delta",), FOUR, set={**HELD, "load": 100, "misfire": 1})
    assert plain.status.attrs["flag_meanings"].split() == list(MEANINGS[:TORQUE_NOT_REACHED])
    assert held.status.attrs["flag_meanings"].split() == list(OF_STEADY)
    assert int(held.status) == TORQUE_NOT_REACHED
    scene = write_scene(
        tmp_path, engine=FOUR, set={**HELD, "load": 100, "misfire": 1},
        output={"fail_on": ["torque_not_reached"]},
    )  # fmt: skip
    told = invoke("run", scene, "-o", tmp_path / "held.nc")
    assert told.exit_code == 3 and "torque_not_reached" in told.output
    assert "torque_not_reached" in ok("show", tmp_path / "held.nc")


def test_states_of_reductions_from_before_are_merged() -> None:
    """They count fewer outcomes."""
    scene = {"engine": FOUR, "set": NUMBERS, "axes": {"inertia": [0.2, 0.3]}, "reduce": {},
             "output": {"quantities": ["delta"]}}  # fmt: skip
    reduction = Reduction(make_plan(read_scene(scene)))
    state = dict(reduction.state())
    state["outcomes"] = np.arange(7).reshape(*state["outcomes"].shape[:-1], 7)
    reduction.merge(state)
    counts = reduction.outcomes.reshape(-1).tolist()
    assert counts[:7] == [*range(7)] and not any(counts[7:])


@pytest.mark.parametrize(
    ("tables", "says"),
    [
        ({"set": {"hold": "brake_powr"}}, "[set] hold = 'brake_powr': must be 'brake_torque' or "
         "'brake_power', of the engine whose cylinders all burn; a number belongs in held_torque "
         "[N m] or held_power [W]"),
        ({"set": {"hold": 38e3}}, "[set] hold = 38000: must be 'brake_torque' or 'brake_power', of "
         "the engine whose cylinders all burn; a number belongs in held_torque [N m] or "
         "held_power [W]"),
        ({"axes": {"hold": ["brake_power"]}}, "[axes] hold: must be in [set], one for all designs"),
        ({"designs": {"hold": ["brake_power"], "load": [50]}},
         "[designs] hold: must be in [set], one for all designs"),
        ({"sample": {"number": 4, "hold": ["brake_power"]}},
         "[sample] hold: must be in [set], one for all designs"),
        ({"sample": {"number": 4, "pressure_factor": [1, 2]}},
         "[sample] pressure_factor: must be in [set] or the engine file; [sample] may have "
         "pressure_factor_2 and so on"),
        ({"uncertainty": {"hold": ["brake_power", "brake_torque"]}},
         "[uncertainty] hold: must be in [set], one for all designs"),
        ({"uncertainty": {"held_power": {"low": 1e4, "high": 2e4}}},
         "[uncertainty] held_power: needs the value in [set] that it is uncertain about"),
        ({"set": {"hold": "brake_power", "held_power": "38kW"}}, "[set] hold: takes the torque of "
         "the undisturbed engine; not allowed together with held_torque or held_power, which "
         "give a number"),
        ({"set": {"held_torque": "100 N"}}, "[set] held_torque = '100 N': must be a number in "
         "N m, or a number with a unit, such as 10 N m"),
        ({"set": {"held_torque": -50}},
         "[set] held_torque = -50: must be a finite number 0 or more [N m]"),
        ({"set": {"held_power": "38 kw"}}, "[set] held_power = '38 kw': must be a number in W, or "
         "a number with a unit, such as 10 W"),
        ({"set": {"held_power": 1e4}, "axes": {"load": [40, 50]}},
         "load (in [axes]) and held_power (in [set]): the load follows from what is held; give "
         "one of them"),
        ({"set": {"held_power": 1e4, "held_torque": 50}},
         "held_torque (in [set]) and held_power (in [set]): both determine the torque that is "
         "held; give one of them"),
        ({"engine": "diesel_105x137", "set": {"hold": "brake_power"}},
         "hold: not allowed: engine diesel_105x137 has diagrams for one load alone; there is no "
         "load with another torque"),
    ],
)  # fmt: skip
def test_bad_input(tables: dict[str, Any], says: str) -> None:
    scene = {"engine": FOUR, "output": {"quantities": ["delta"]}, **tables}
    assert refusal(scene) == f"scene: {says}"


def test_columns_of_files_hold_nothing(tmp_path: Path) -> None:
    (tmp_path / "designs.csv").write_text("inertia,hold\n1.0,brake_power\n", encoding="utf-8")
    scene = {"engine": FOUR, "designs": {"file": str(tmp_path / "designs.csv")},
             "output": {"quantities": ["delta"]}}  # fmt: skip
    assert refusal(scene).endswith("hold: must be in [set], one for all designs")


@pytest.mark.parametrize("table", ["sample", "uncertainty"])
def test_values_that_are_drawn_go_with_a_torque_that_is_held(table: str) -> None:
    """Each design holds the torque; a held power may be drawn itself."""
    drawn = {"number": 8, "inertia": {"low": 0.5, "high": 2.0}}
    found = computed(ASKED, FOUR, set={**HELD, "misfire": 2}, **{table: drawn})
    assert (found.status == 0).all() and (found.held_load > 70.0).all()
    assert_allclose(found.torque_mean, found.torque_to_hold, rtol=1e-11)
    powers = {"number": 8, "held_power": {"low": 3.5e4, "high": 4e4}}
    found = computed(ASKED, FOUR, set={"speed": 3000.0, "held_power": 3.6e4} if table != "sample"
                     else {"speed": 3000.0}, **{table: powers})  # fmt: skip
    assert (found.status == 0).all()
    if table == "uncertainty":
        low, high = found.torque_to_hold_low, found.torque_to_hold_high
        assert 3.5e4 / (3000.0 * RPM) <= low < high <= 4e4 / (3000.0 * RPM)


def test_what_is_missing_is_told() -> None:
    """In N m beyond the first or the last diagram; nothing where the torque is held."""
    asked = ("torque_missing", "torque_to_hold", "torque_mean", "status")
    scene: dict[str, Any] = {"set": {**HELD, "load": 95.0}, "axes": {"misfire": [0, 2]}}
    found = computed(asked, FOUR, **scene)
    dead = {**NUMBERS, "load": 100.0, "misfire": 2}
    largest = float(computed(("torque_mean",), FOUR, set=dead).torque_mean)
    assert found.status.values.tolist() == [0, TORQUE_NOT_REACHED]
    assert found.torque_missing.values[0] == 0.0
    assert_allclose(found.torque_to_hold - found.torque_missing.values[1], largest, rtol=1e-12)
    engine = load_engine(FOUR, Path(), "")
    least = {**NUMBERS, "load": engine.family.low}
    smallest = float(computed(("torque_mean",), FOUR, set=least).torque_mean)
    few = computed(asked, FOUR, set={"speed": 3000.0, "held_torque": 0.5 * smallest})
    assert_allclose(few.torque_missing, -0.5 * smallest, rtol=1e-12)
    assert float(computed(asked[:1], FOUR, set=NUMBERS).torque_missing) == 0.0


@pytest.mark.parametrize(
    "search",
    [
        {"least": "inertia", "over": "inertia = 0.5 to 5"},
        {"least": "inertia", "over": ["inertia = 0.5 to 5", "cylinders = 3, 4"]},
        {"least": "mean_piston_speed", "over": ["stroke = 0.1 to 0.102"]},
    ],
)
def test_a_search_ends_early_where_no_design_holds(search: dict[str, Any]) -> None:
    pytest.importorskip("pymoo")
    scene: dict[str, Any] = {
        "engine": FOUR, "set": {**HELD, "load": 95.0}, "axes": {"misfire": [0, 2]},
        "within": "delta <= 1/50", "number": 16, "generations": 1000,
    }  # fmt: skip
    line = refusal_of(lambda: sweeps.optimise(**scene, **search))
    assert re.match(
        r"torque_not_reached: none of \d+ designs? holds its torque: of the one that comes "
        r"nearest, the largest torque at misfire = 2 is \d+\.?\d* N m, and \d+\.?\d* N m is to "
        r"be held",
        line,
    )
    few = {**scene, "set": {"speed": 3000.0, "held_torque": 5.0}, "axes": {}}
    assert "the smallest torque is" in refusal_of(lambda: sweeps.optimise(**few, **search))


def test_engine_files_hold_nothing(tmp_path: Path) -> None:
    text = (ENGINES / "ntua.toml").read_text(encoding="utf-8")
    path = tmp_path / "mine.toml"
    path.write_text(text.replace("[values]\n", "[values]\nheld_power = 1e4\n"), encoding="utf-8")
    line = refusal({"engine": str(path), "output": {"quantities": ["delta"]}})
    assert line.endswith(
        "[values] held_power: not allowed; belongs to a scene; an engine file gives the load"
    )


def test_patterns_of_a_density_hold_by_their_load() -> None:
    """Then no factor on the pressure keeps the torque; without hold it still does."""
    scene = {"engine": FOUR, "set": HELD, "output": {"quantities": ["torque_mean", "held_load"]}}
    found = sweeps.firing_patterns(scene, 0.75, longest=4)
    assert json.loads(found.attrs[OF_PATTERNS])["pressure_factor"] == 1.0
    whole = float(computed(("torque_mean",), FOUR, set=NUMBERS).torque_mean)
    assert_allclose(found.torque_mean, whole, rtol=1e-11)
    without = sweeps.firing_patterns({**scene, "set": NUMBERS}, 0.75, longest=4)
    assert json.loads(without.attrs[OF_PATTERNS])["pressure_factor"] > 1.3
    assert_allclose(without.torque_mean, whole, rtol=1e-3)


def test_deviations_of_cylinders_need_a_load() -> None:
    """They compare cycles at one load, which `hold` would change with a missing cylinder."""
    scene = read_scene({"engine": FOUR, "set": HELD, "output": {"quantities": ["delta"]}})
    assert refusal_of(lambda: engine_of(scene, "scene")) == (
        "scene: hold, held_torque and held_power are not allowed; load must be given"
    )


def test_shards_of_a_scene_that_holds_are_the_whole(tmp_path: Path) -> None:
    """Bit by bit, also where only one of them has the misfire."""
    scene = write_scene(
        tmp_path, ("delta", "held_load", "torque_to_hold"), engine=FOUR, set=NUMBERS | HELD,
        axes={"misfire": [0, 1, 2, 3]},
    )  # fmt: skip
    ok("run", scene, "-o", tmp_path / "whole.nc")
    for number in (1, 2):
        ok("run", scene, "--shard", f"{number}/2", "-o", tmp_path / f"{number}.nc")
    ok("merge", tmp_path / "1.nc", tmp_path / "2.nc", "-o", tmp_path / "merged.nc")
    whole, merged = (sweeps.open(tmp_path / f"{name}.nc") for name in ("whole", "merged"))
    for name in whole.data_vars:
        np.testing.assert_array_equal(whole[name], merged[name])
