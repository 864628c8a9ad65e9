"""What `plan` tells: work counted against designs, diagrams, iteration, what is skipped."""

from typing import Any

import pytest

import sweeps
from engine_dyn.quantities.graph import QUANTITIES
from engine_dyn.speed.fields import METHOD_NAMES
from sweeps.scene.plan import forecast
from sweeps.scene.plan.blocks import divided
from sweeps.scene.plan.forecast import diagram_count, seconds_of_computing, text, work_of
from sweeps.scene.plan.plan import Plan, make_plan
from sweeps.scene.plan.rates import SECONDS
from sweeps.scene.reading import read_scene

AXES = {"crank_ratio": [0.2, 0.25, 0.3], "inertia": [1.0, 2.0], "speed": [1000, 1100, 1200, 1300]}


def plan_of(*quantities: str, engine: str = "ntua", **tables: Any) -> Plan:
    return make_plan(
        read_scene({"engine": engine, "output": {"quantities": list(quantities)}, **tables})
    )


def row(told: str, stage: str) -> list[str]:
    """Words of the line of one stage."""
    return next(line.split() for line in told.splitlines() if line.startswith(f"{stage} "))


def test_stages_are_counted_against_designs() -> None:
    told = text(plan_of("delta", "velocity", axes=AXES))
    assert "24 designs" in told
    assert row(told, "velocity")[1:4] == ["crank_ratio", "3", "8"]
    assert "720 crank angles" in told
    assert row(told, "mean_piston_speed")[1:4] == ["speed", "4", "6"]
    assert row(told, "rod")[1:5] == ["crank_ratio", "3", "8"]
    words = row(told, "speed_solution")
    assert words[1:6] == ["crank_ratio,", "inertia,", "speed", "24", "1"]


@pytest.mark.parametrize(
    ("axes", "engine", "diagrams"),
    [
        ({"inertia": [1, 2], "speed": [1000, 1100], "bore": [0.1, 0.2]}, "ntua", 2),
        ({"inertia": [1, 2], "crank_ratio": [0.2, 0.3]}, "ntua", 2),
        ({"load": [0, 50, 90], "crank_ratio": [0.2, 0.3], "inertia": [1, 2]}, "ntua", 6),
        ({"load": {"start": 0, "stop": 90, "num": 1000}}, "ntua", 181),  # all that there are
        ({"speed": [1000, 1100]}, "compressor_79x83", 1),
    ],
)
def test_diagrams_that_are_needed(axes: dict[str, list[float]], engine: str, diagrams: int) -> None:
    plan = plan_of("delta", engine=engine, axes=axes)
    assert diagram_count(plan) == diagrams
    assert f"{diagrams} diagram" in text(plan)


def test_what_is_skipped_and_why() -> None:
    told = text(plan_of("velocity", axes=AXES))
    for expected in (
        "skipped: cylinder pressure and gas work",
        "skipped: the periodic speed",
        "skipped: extremes of torque",
        "axis inertia: no requested quantity depends on it",
        "axis speed: no requested quantity depends on it",
    ):
        assert expected in told
    assert "speed_solution" not in told
    told = text(plan_of("delta", "torque_max"))
    assert "skipped: " not in told
    plan = plan_of("delta", "torque_max")
    left = len(QUANTITIES) - len(set(QUANTITIES) & set(plan.computed))
    assert f"not requested: {left} more quantities; engine-dyn list quantities names all" in told
    assert "acceleration" not in told  # nor any other of them


def test_blocks_and_memory_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks are for what nobody asked for: friction here depends on every axis, there on one."""
    long = {"start": 1000, "stop": 2000, "num": 3000}
    inertia = {**long, "start": 1.0, "stop": 2.0}
    plan = plan_of("delta", axes={"inertia": inertia, "speed": long})
    assert "blocks" not in text(plan)
    assert divided(plan)[1] < 1.01 * plan.output_bytes
    stroke = {**long, "start": 0.15, "stop": 0.2}
    plan = plan_of("delta", axes={"stroke": stroke, "speed": long})
    monkeypatch.setattr(forecast, "seconds", lambda _: 12.3)
    assert " blocks, time about 10 s (plus " in text(plan)
    assert divided(plan)[1] < plan.output_bytes + 150e6


def test_the_forecast_has_the_columns_of_designs() -> None:
    drawn = {
        "number": 4096,
        "inertia": {"low": 1.0, "high": 2.0},
        "speed": {"low": 1e3, "high": 2e3},
    }
    scene = {"engine": "ntua", "sample": drawn, "output": {"quantities": ["delta"]}}
    stored = sweeps.run(**scene)
    size = sum(v.nbytes for name, v in stored.variables.items() if name != "design")
    plan = plan_of("delta", sample=drawn)
    assert plan.output_bytes == size + 4 * 4096


"""Factor up to which a rate may differ from a measured one."""


@pytest.mark.parametrize(
    "tables",
    [
        {"axes": AXES},
        {"axes": {**AXES, "load_exponent": [0.0, 1.0, 1.6, 2.0]}},
        {"axes": AXES, "solver": {"inertia_model": ["constant", "variable"]}},
        {"axes": AXES, "solver": {"method": list(METHOD_NAMES)}},
        {"axes": AXES, "solver": {"closure": "cycle_time"}},
        {"axes": {"pin_offset": [0.0, 0.01], "inertia": [1.0, 2.0]}},
        {"set": {"wanted_delta": 0.02}, "axes": {"speed": [1000, 1100]}},
        {"engine": "compressor_79x83"},
        {"engine": "v6_96x81", "axes": {"misfire": [0, 1, 2]}},
    ],
)
def test_every_piece_of_work_has_its_seconds(tables: dict[str, Any]) -> None:
    plan = plan_of("delta", "delta_error", "omega", "crank_pin_load_max", **tables)
    work = work_of(plan)
    assert set(work) <= {*SECONDS, "extremes of loads"}
    assert all(count >= 0.0 for count in work.values())
    assert seconds_of_computing(plan, 1) > seconds_of_computing(plan, 8) > 0.0
    assert "solved by: " in text(plan) or "whole cycles, repeated" in text(plan)
