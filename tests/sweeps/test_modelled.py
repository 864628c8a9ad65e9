"""Modelled cycles in engine files, diagrams over load and speed, auxiliaries."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import sweeps
from engine_dyn.pressure import compressor
from engine_dyn.pressure.compressor import CompressorCycle
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.pressure.family_grid import FamilyGrid
from engine_dyn.pressure.file_fields import file_units
from engine_dyn.pressure.first_law import FourStrokeCycle, TwoStrokeCycle
from sweeps.scene.engine.engine_files import load_engine
from sweeps.scene.plan import forecast
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from tests.support.cycles import PORTS, SPARK, WALL
from tests.support.scenes import refusal_of

RPM = math.pi / 30.0

VALUES: dict[str, Any] = {
    "reciprocating_mass": 0.7, "inertia": 0.15, "crank_ratio": 0.3, "bore": 0.09, "stroke": 0.1,
    "speed": 3000, "load": 100, "cylinders": 2, "load_exponent": 2, "load_offset": 0,
    "crankcase_pressure": 1.0, "friction_constant": 0.2, "friction_peak_pressure": 0.005,
    "friction_mean_piston_speed": 0.1,
}  # fmt: skip


def without(table: dict[str, Any], key: str) -> dict[str, Any]:
    return {k: v for k, v in table.items() if k != key}


FOUR: dict[str, Any] = {
    **without(SPARK, "crank_ratio"), "kind": "first_law", "intake_pressure": 0.9, "heat": 22.0,
    "combustion_start": -20.0,
}  # fmt: skip
WOSCHNI = {"wall": "woschni", "wall_temperature": 440.0}
POLYTROPIC = WALL["polytropic"]
TWO: dict[str, Any] = {**without(PORTS, "crank_ratio"), "kind": "two_stroke"}
COMPRESSOR: dict[str, Any] = {
    "kind": "compressor", "clearance_ratio": 0.05, "suction_pressure": 1.0,
    "delivery_pressure": 7.0, "suction_loss": 0.05, "delivery_loss": 0.2,
    "compression_exponent": 1.3, "expansion_exponent": 1.25, "valve_ramp": 8.0, "valve_lag": 2.0,
}  # fmt: skip


def written(
    folder: Path, *tables: dict[str, Any], cycle: str = "four-stroke", more: str = "",
    **changes: Any,
) -> str:  # fmt: skip
    """Path of an engine file with these diagrams; a change to None leaves a value out."""
    values = {k: v for k, v in {**VALUES, **changes}.items() if v is not None}
    lines = ['title = "x"', f'cycle = "{cycle}"', "[values]"]
    lines += [f"{key} = {value}" for key, value in values.items()]
    for table in tables:
        lines.append("[[diagram]]")
        for key, value in {"load": 100, **table}.items():
            lines.append(f'{key} = "{value}"' if isinstance(value, str) else f"{key} = {value}")
    path = folder / "mine.toml"
    path.write_text("\n".join([*lines, more]) + "\n", encoding="utf-8")
    return str(path)


def built(kind: Any, table: dict[str, Any]) -> Diagram:
    units = file_units(compressor.FILE_FIELDS) if kind is CompressorCycle else kind.units
    fields = {k: v for k, v in table.items() if k not in ("kind", "step")}
    made = kind(**{k: v if k == "wall" else v * units[k][1] for k, v in fields.items()})
    diagram: Diagram = made.diagram(table.get("step", 0.5))
    return diagram


@pytest.mark.parametrize(
    ("table", "kind"),
    [
        (FOUR, FourStrokeCycle),
        ({**FOUR, **POLYTROPIC, "step": 1.0}, FourStrokeCycle),
        ({**FOUR, **WOSCHNI}, FourStrokeCycle),
        ({**FOUR, "premixed_share": 0.2, "premixed_start": -10.0}, FourStrokeCycle),
        (TWO, TwoStrokeCycle),
        ({**TWO, **POLYTROPIC, "exhaust_closing": -140.0}, TwoStrokeCycle),
        (COMPRESSOR, CompressorCycle),
        ({**FOUR, "crank_ratio": 0.25}, FourStrokeCycle),  # its own geometry
    ],
)
def test_a_file_makes_the_cycle(tmp_path: Path, table: dict[str, Any], kind: Any) -> None:
    four = kind is FourStrokeCycle
    path = written(tmp_path, table, cycle="four-stroke" if four else "two-stroke")
    found = load_engine(path, tmp_path).family.diagrams[0]
    own = {"crank_ratio": 0.3}
    if table.get("wall") == "woschni":
        own |= {"bore": 0.09, "stroke": 0.1, "speed": 3000.0}
    expected = built(kind, {**own, **table})
    assert_array_equal(found.pressure, expected.pressure)
    assert_array_equal(found.slope, expected.slope)
    if kind is not CompressorCycle:
        assert found.motored is not None
        unfired = built(kind, {**own, **table, "heat": 0.0})
        assert_array_equal(found.motored().pressure, unfired.pressure)


FAST = {"speed": 5000}
SLOW = {"speed": 2000}


@pytest.mark.parametrize(
    ("tables", "cycle", "message"),
    [
        ([{**FOUR, "kind": "otto"}], "four-stroke",
         "number 1 kind = 'otto': must be one of 'points', 'torque', 'diesel_cycle', 'first_law'"),
        ([FOUR], "two-stroke", "kind = 'first_law': must belong to a four-stroke engine"),
        ([TWO], "four-stroke", "kind = 'two_stroke': must belong to a two-stroke engine"),
        ([COMPRESSOR], "four-stroke", "kind = 'compressor': must belong to a two-stroke engine"),
        ([without(FOUR, "heat")], "four-stroke", "heat: missing; must be a number in bar"),
        ([{**FOUR, "heat": "much"}], "four-stroke", "heat = 'much': must be"),
        ([{**FOUR, "heat": 300}], "four-stroke",
         "heat = 300 bar: must be between 0 and 200 bar"),
        ([{**FOUR, "combustion_duration": -5}], "four-stroke",
         "combustion_duration = -5 degree: must be above 2 and below 270 degree"),
        ([{**FOUR, "wall": "cold"}], "four-stroke",
         "wall = 'cold': must be one of 'adiabatic', 'polytropic', 'woschni'"),
        ([{**FOUR, "wall": "woschni"}], "four-stroke",
         "wall_temperature: missing; must be a number in K"),
        ([{**FOUR, "wall_temperature": 440}], "four-stroke", "wall_temperature: unknown key"),
        ([{**FOUR, "scavenge_opening": 120}], "four-stroke", "scavenge_opening: unknown key"),
        ([{**COMPRESSOR, "wall": "woschni"}], "two-stroke", "wall: unknown key"),
        ([{**COMPRESSOR, "clearance_ratio": 0.9}], "two-stroke",
         "clearance_ratio = 0.9: must be above 0 and below 0.5"),
        ([{**FOUR, "step": 0.7}], "four-stroke", "step = 0.7 degree: 720 must be a multiple"),
        ([{**FOUR, **SLOW}, {**FOUR, "load": 50}], "four-stroke",
         "number 2 speed: missing; must be given, because other diagrams have one"),
        ([{**FOUR, **SLOW}, {**FOUR, **SLOW}], "four-stroke",
         "two diagrams for 100 percent at 2000 rpm"),
        ([{**FOUR, **SLOW}, {**FOUR, **FAST}, {**FOUR, **FAST, "load": 50}], "four-stroke",
         "no diagram for 50 percent at 2000 rpm: each of the 2 loads needs one at each of the 2"),
        ([{**FOUR, **FAST}], "four-stroke",
         "[values] speed = 3000: must be within the engine's diagrams, 5000 to 5000 rpm"),
        ([{**FOUR, "speed": -1}], "four-stroke", "speed = -1: must be"),
    ],
)  # fmt: skip
def test_one_line_says_what_is_wrong(
    tmp_path: Path, tables: list[dict[str, Any]], cycle: str, message: str
) -> None:
    path = written(tmp_path, *tables, cycle=cycle)
    line = refusal_of(lambda: load_engine(path, tmp_path))
    assert message in line
    assert "[[diagram]]" in line or "[values]" in line


CORNERS = [
    {**FOUR, **WOSCHNI, **speed, "load": load, "heat": heat, "combustion_start": start}
    for load, heat in ((30, 10.0), (100, 22.0))
    for speed, start in ((SLOW, -12.0), (FAST, -24.0))
]
QUANTITIES = ["delta", "omega_max", "torque_max", "torque_mean", "peak_pressure", "imep"]


def run(engine: str, **tables: Any) -> Any:
    return sweeps.run({"engine": engine, "output": {"quantities": QUANTITIES}, **tables})


@pytest.mark.compiled
def test_corners_are_the_given_diagrams(tmp_path: Path) -> None:
    grid = written(tmp_path, *CORNERS)
    found = run(grid, axes={"speed": [2000, 5000], "load": [30, 100]})
    assert found["delta"].dims == ("speed", "load")
    assert (found["status"] == 0).all()
    missing = run(grid, axes={"speed": [2000, 5000]}, set={"pressure_factor": [1.0, 0.0]})
    assert (missing["status"] == 0).all()
    assert (missing["imep"] < 0.55 * found["imep"].sel(load=100)).all()
    for corner in CORNERS:
        here = found.sel(speed=corner["speed"], load=corner["load"])
        alone = run(written(tmp_path, corner, speed=corner["speed"], load=corner["load"]))
        for name in QUANTITIES:
            assert float(here[name]) == pytest.approx(float(alone[name]), rel=1e-9)


@pytest.mark.compiled
def test_between_the_corners(tmp_path: Path) -> None:
    path = written(tmp_path, *CORNERS)
    family = load_engine(path, tmp_path).family
    assert isinstance(family, FamilyGrid)
    speeds, loads = [2000.0, 2710.0, 3333.0, 5000.0], [30.0, 41.7, 100.0]
    found = run(path, axes={"load": loads, "speed": speeds})
    for load in loads:
        for speed in speeds:
            here = found.sel(load=load, speed=speed)
            expected = family.at(load, speed * RPM)
            largest = float(expected(expected.peak_angle)) / 1e5  # between the points
            assert float(here["peak_pressure"]) == pytest.approx(largest, rel=1e-9)
    # A design is the same whatever else is asked for.
    for order in ({"speed": speeds[1:2], "load": loads}, {"load": loads, "speed": speeds[1:2]}):
        part = run(path, axes=order)
        for name in QUANTITIES:
            assert_allclose(part[name].sel(speed=2710.0), found[name].sel(speed=2710.0), rtol=1e-12)
    pairs = run(path, designs={"speed": [2710.0, 5000.0], "load": [41.7, 30.0]})
    for i, (speed, load) in enumerate(((2710.0, 41.7), (5000.0, 30.0))):
        assert float(pairs["delta"][i]) == pytest.approx(
            float(found["delta"].sel(speed=speed, load=load)), rel=1e-12
        )


@pytest.mark.compiled
def test_square_of_the_piston_speed_and_auxiliaries(tmp_path: Path) -> None:
    path = written(tmp_path, FOUR)
    names = ["fmep", "bmep", "imep", "friction_torque", "torque_mean"]
    axes = {"speed": [1000, 3000]}

    def of(**values: float) -> Any:
        scene = {"engine": path, "axes": axes, "set": values, "output": {"quantities": names}}
        return sweeps.run(scene)

    plain, driven = of(), of(auxiliary_torque=7.0)
    square = of(friction_mean_piston_speed_square=0.01)
    piston = 2.0 * 0.1 * np.array(axes["speed"]) / 60.0
    assert_allclose(square["fmep"] - plain["fmep"], 0.01 * piston**2, rtol=1e-9)
    assert_allclose(driven["friction_torque"] - plain["friction_torque"], 7.0)
    assert_allclose(plain["torque_mean"] - driven["torque_mean"], 7.0)
    assert_allclose(driven["imep"] - driven["fmep"], driven["bmep"])
    assert plain["fmep"].dims == driven["fmep"].dims == ("speed",)


@pytest.mark.compiled
def test_parameters_of_the_cycle_as_axes(tmp_path: Path) -> None:
    """Each design is the engine whose file has these numbers."""
    loads = [{**FOUR, "load": 50, "heat": 12.0}, {**FOUR, "load": 100}]
    path = written(tmp_path, *loads)
    axes: dict[str, list[float]] = {
        "combustion_start": [-25.0, -12.0], "inertia": [0.1, 0.3], "compression_ratio": [8.0, 11.0],
        "load": [50.0, 80.0],
    }  # fmt: skip
    found = run(path, axes=axes)
    assert found["delta"].dims == tuple(axes)
    assert found["imep"].dims == ("combustion_start", "compression_ratio", "load")
    assert (found["status"] == 0).all()
    for start in axes["combustion_start"]:
        for ratio in axes["compression_ratio"]:
            own = {"combustion_start": start, "compression_ratio": ratio}
            engine = written(tmp_path, *({**table, **own} for table in loads))
            alone = run(engine, axes={"inertia": axes["inertia"], "load": axes["load"]})
            for name in QUANTITIES:
                expected = alone[name].transpose(*[d for d in found[name].dims if d not in own])
                assert_allclose(found[name].sel(own), expected, rtol=1e-8)


@pytest.mark.parametrize(
    ("engine", "tables", "message"),
    [
        ("ntua", {"set": {"heat": 10.0}}, "[set] heat: not allowed: engine ntua has diagrams that"),
        ("mine", {"axes": {"combustion_duration": [-5.0]}}, "combustion_duration = -5"),
        ("mine", {"axes": {"combustion_start": [-5.0, 80.0]}, "set": {"combustion_duration": 1.0}},
         "combustion_duration = 1"),
        ("mine", {"set": {"heat": 199.0}}, "heat = 199 bar: must be lower; the gas would become h"),
        # A single combination that is no cycle.
        ("mine", {"set": {"heat": 150.0}, "axes": {"inertia": [0.1, 0.3]}},
         "heat = 150 bar: must be lower; the gas would become hotter"),
        ("mine", {"axes": {"heat": [150.0, 180.0]}},
         "heat = 150 bar: must be lower; the gas would become hotter"),
    ],
)  # fmt: skip
def test_cycles_that_are_refused(
    tmp_path: Path, engine: str, tables: dict[str, Any], message: str
) -> None:
    path = written(tmp_path, FOUR) if engine == "mine" else engine
    assert message in refusal_of(lambda: run(path, **tables))


@pytest.mark.compiled
def test_combinations_that_are_no_cycle_get_a_status(tmp_path: Path) -> None:
    """The gas would be hotter than the model allows: the other designs are as without these."""
    path = written(tmp_path, FOUR)
    names = [*QUANTITIES, "omega", "pressure", "delta_error", "friction_torque", "energy_swing"]
    asked = {"quantities": names, "angle_step": 30.0}
    axes: dict[str, Any] = {"inertia": [0.1, 0.3], "heat": [150.0, 22.0, 199.0, 12.0]}
    found = sweeps.run({"engine": path, "axes": axes, "output": asked})
    alone = sweeps.run({"engine": path, "axes": {**axes, "heat": [22.0, 12.0]}, "output": asked})
    for name in (*names, "status"):
        assert_array_equal(found[name].sel(heat=[22.0, 12.0]), alone[name])
        lost = found[name].sel(heat=[150.0, 199.0])
        assert (lost == 4).all() if name == "status" else lost.isnull().all()
    at_speeds = run(
        written(tmp_path, *CORNERS),
        axes={"speed": [2500, 4000], "intake_pressure": [0.05, 0.9], "inertia": [0.1, 0.2]},
    )  # fmt: skip
    assert (at_speeds["status"].sel(intake_pressure=0.05) == 4).all()
    assert (at_speeds["status"].sel(intake_pressure=0.9) == 0).all()
    axes = {"heat": [150.0, 22.0, 199.0], "compression_ratio": [8.0, 10.0]}
    scene = {"engine": written(tmp_path, FOUR), "axes": axes, "output": {"quantities": ["delta"]}}
    told = forecast.text(make_plan(read_scene(scene)))
    assert "no cycle: 4 of 6 combinations of compression_ratio, heat (status 4)" in told
