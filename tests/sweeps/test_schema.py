"""The JSON schema of scenes: it says what the reader of scenes says."""

import json
import tomllib
from typing import Any

import pytest

from engine_dyn.quantities.graph import PARAMETERS, QUANTITIES
from sweeps.base.errors import SceneError
from sweeps.scene.json_schema import scene_schema
from sweeps.scene.reading import built_in_scenes, read_scene
from tests.support.json_schemas import fits as fits_schema

SCHEMA = scene_schema()


def fits(value: Any, schema: Any) -> bool:
    return fits_schema(value, schema, SCHEMA["$defs"])


@pytest.mark.parametrize("name", list(built_in_scenes()))
def test_built_in_scenes_fit(name: str) -> None:
    assert fits(tomllib.loads(built_in_scenes()[name].read_text(encoding="utf-8")), SCHEMA)


BASE = {"engine": "ntua", "output": {"quantities": ["delta"]}}

TWIN: dict[str, Any] = {
    "name": "twin", "throws": [{"angle": 0.0}, {"angle": 180.0, "radius_factor": 0.9}],
    "cylinders": [{"throw": 1, "firing_angle": 0}, {"throw": 2, "bank": 1, "firing_angle": 180}],
    "uneven": True,
}  # fmt: skip

RIGHT: list[dict[str, Any]] = [
    {},
    {"set": {"inertia": 2.0, "cylinders": 4, "misfire": 1.0, "mass_factor": [1.0, 1.1, 1, 1]}},
    {"set": {"arrangement": TWIN, "cylinders": 2}},
    {"set": {"cylinders": 2}, "axes": {"arrangement": ["in-line 2", TWIN]}},
    {"axes": {"speed": {"start": 1000, "stop": 2000, "num": 5, "spacing": "log"}}},
    {"axes": {"speed": [1000.0, 1200], "cylinders": [1, 2]}, "title": "x"},
    {"designs": {"inertia": [1.0, 1.0], "case": ["a", "b"]}},
    {"solver": {"method": ["auto", "thesis"], "passes": 20, "tolerance": 1e-9}},
    {"solver": {"closure": "cycle_time", "inertia_model": "variable", "method": "newton"}},
    {"output": {"quantities": ["delta", "omega"], "fail_on": ["stalled"], "angle_step": 2}},
    {"sample": {"number": 8, "seed": 3, "inertia": {"low": 1.0, "high": 2.0, "spacing": "log"}}},
    {"sample": {"method": "latin_hypercube", "number": 9, "cylinders": [1, 2, 4]}},
    {"characteristic": {"kind": "propeller"}, "set": {"rated_speed": 1600, "rated_power": 20}},
    {"set": {"rated_power": "62.5 kW"}, "axes": {"speed": [900, 1000]}},
    {"axes": {"rated_power": ["62.5 kW", 7e4, "0.08 MW"]}},
    {"axes": {"speed": {"start": "150 rad/s", "stop": "3000 rpm", "num": 5}}},
    {"set": {"inertia": "2 kg m2"}, "output": {"quantities": ["delta"], "angle_step": "2 deg"}},
]

WRONG: list[dict[str, Any]] = [
    {"engine": 3},
    {"titel": "x"},
    {"set": {"inertai": 2.0}},
    {"set": {"inertia": 0}},
    {"set": {"arrangement": {**TWIN, "throws": [{"angel": 0.0}]}}},
    {"axes": {"arrangement": [{**TWIN, "cylinders": []}]}},
    {"set": {"inertia": -2.0}},
    {"set": {"inertia": "heavy"}},
    {"set": {"rated_power": "62.5"}},
    {"set": {"inertia": True}},
    {"set": {"inertia": [1.0]}},
    {"set": {"cylinders": 2.5}},
    {"set": {"cylinders": 99}},
    {"set": {"crank_ratio": 1.0}},
    {"set": {"passes": 20}},
    {"set": {"mass_factor": 1.0}},
    {"axes": {"speed": 1000}},
    {"axes": {"speed": []}},
    {"axes": {"speed": [1000, 1000]}},
    {"axes": {"speed": {"start": 1000, "stop": 2000}}},
    {"axes": {"speed": {"start": 1000, "stop": 2000, "num": 1}}},
    {"axes": {"speed": {"start": 1000, "stop": 2000, "num": 5, "step": 3}}},
    {"axes": {"method": ["auto"]}},
    {"designs": {"inertia": 1.0}},
    {"sample": {"inertia": {"low": 1.0, "high": 2.0}}},
    {"sample": {"number": 1, "inertia": {"low": 1.0, "high": 2.0}}},
    {"sample": {"number": 8, "inertia": {"low": -1.0, "high": 2.0}}},
    {"sample": {"number": 8, "inertia": {"from": 1.0, "high": 2.0}}},
    {"sample": {"number": 8, "inertia": [1.0]}},
    {"sample": {"number": 8, "method": "halton", "inertia": {"low": 1.0, "high": 2.0}}},
    {"designs": {"file": "x.csv", "inertia": [1.0]}},
    {"designs": {"case": [1, 2], "inertia": [1.0, 2.0]}},
    {"solver": {"method": "newtn"}},
    {"solver": {"method": []}},
    {"solver": {"closure": "mean"}},
    {"solver": {"tolerance": 1.0}},
    {"output": {"quantities": []}},
    {"output": {"quantities": ["dleta"]}},
    {"output": {"quantities": ["delta"], "fail_on": ["converged"]}},
    {"output": {"quantities": ["delta"], "highest_order": 1000}},
    {"output": {}},
    {"characteristic": {"kind": "petrol"}},
    {"characteristic": {"coefficients": [1.0]}},
]


@pytest.mark.parametrize("more", RIGHT)
def test_what_the_reader_takes_fits(more: dict[str, Any]) -> None:
    scene = {**BASE, **more}
    read_scene(scene)
    assert fits(scene, SCHEMA)


@pytest.mark.parametrize("more", WRONG)
def test_what_the_reader_refuses_does_not_fit(more: dict[str, Any]) -> None:
    scene = {**BASE, **more}
    with pytest.raises(SceneError):
        read_scene(scene)
    assert not fits(scene, SCHEMA)


def test_all_names_of_the_table_are_in_it() -> None:
    quantities = SCHEMA["$defs"]["Output"]["properties"]["quantities"]
    names = {item["const"] for item in quantities["items"]["oneOf"] if "const" in item}
    assert names == set(QUANTITIES)
    assert set(PARAMETERS) <= set(SCHEMA["$defs"])
    assert "[kg m2]" in SCHEMA["$defs"]["inertia"]["description"]
    assert '"null"' not in json.dumps(SCHEMA)
