"""Scenes that several test files run."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import sweeps
from engine_dyn.quantities.features.transient import NODES as TRANSIENT_NODES
from sweeps.base.errors import SceneError
from sweeps.scene.reading import read_scene
from tests.support.shafts import complete_shaft


def asking(quantities: Sequence[str], engine: Any = "ntua", **tables: Any) -> dict[str, Any]:
    """A scene that asks for some quantities; its tables by their names."""
    output = {"quantities": [*quantities], **tables.pop("output", {})}
    return {"engine": engine, **tables, "output": output}


def toml(value: Any) -> str:
    """A value as scene files have it, tables inline."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list | tuple | range):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(str(value) if isinstance(value, Path) else value, ensure_ascii=False)


def write_scene(path: Path, quantities: Sequence[str] = ("delta",), **tables: Any) -> Path:
    """That scene as a file; `scene.toml` in a folder."""
    path = path / "scene.toml" if path.is_dir() else path
    lines = [f"{key} = {toml(value)}\n" for key, value in asking(quantities, **tables).items()]
    path.write_text("".join(lines), encoding="utf-8")
    return path


def computed(quantities: Sequence[str], engine: Any = "ntua", **tables: Any) -> xr.Dataset:
    """What that scene gives."""
    return sweeps.run(asking(quantities, engine, **tables))


def refusal_of(call: Callable[[], Any]) -> str:
    """The one line with which a call is refused."""
    with pytest.raises(SceneError) as caught:
        call()
    line = str(caught.value)
    assert "\n" not in line
    return line


def refusal(scene: Any) -> str:
    """The one line with which a scene is refused."""
    return refusal_of(lambda: read_scene(scene))


BEARINGS = {
    "crank_pin_diameter": 0.09, "crank_pin_width": 0.04, "main_journal_diameter": 0.1,
    "main_journal_width": 0.04, "piston_pin_diameter": 0.05, "piston_pin_width": 0.05,
}  # fmt: skip
"""Sizes of bearings, which engines of the catalogue mostly do not give."""

VALVES = {
    "geometric_compression_ratio": 17.0, "valve_train": "ohv", "valve_lift": 0.012,
    "valves_per_cylinder": 2, "camshaft_bearings": 2,
}  # fmt: skip
"""What else the friction of the components needs."""

NOT_OF_AN_ENGINE: dict[str, Any] = {
    "set": {
        "cylinder_spacing": 0.2, "bank_offset": 0.02, "balance_shaft_radius": 0.03,
        "second_shaft_radius": 0.02,
        "wanted_delta": "generator", "flywheel_outer_diameter": 0.5,
        "flywheel_inner_diameter": 0.3, "flywheel_density": "steel",
        "rim_speed_limit": "cast iron", "rim_speed_lowest": "cast iron",
        "rated_power": 20e3, "rated_speed": 1500, "given_energy_swing": 400.0,
        "given_energy_fluctuation": 0.3,
        "rod_inertia": 0.1, "piston_travel": 0.01, "rim_stress_limit": 7.0,
        "rim_width_over_thickness": 3.0, **BEARINGS, **VALVES,
        "pole_pairs": 2, "angle_deviation_limit": 3.0, "synchronising_power": 60e3,
        "interval_begin": -20.0, "interval_end": 40.0,
    },
    "characteristic": {"kind": "diesel"},
    "shaft": complete_shaft(1),
    "mounts": [{"lateral": -0.3}, {"lateral": 0.3}],
}  # fmt: skip
"""Tables of a scene that asks for every quantity: what engines of the catalogue do not give."""

IN_PASSING = (
    "shaft_torque_in_passing", "speed_in_passing", "passing_status", "shaft_stress_in_passing",
    "shaft_stress_limit_in_passing", "shaft_stress_in_passing_over_limit",
)  # fmt: skip
"""Quantities of a shaft that must have no pendulums, as `shafts.passing_shaft`."""

OF_TRANSIENTS = tuple(n.name for n in TRANSIENT_NODES if n.public and n.name != "status")
"""Quantities of a speed that is followed in time."""

APART = frozenset((*IN_PASSING, *OF_TRANSIENTS))
"""Quantities that need tables which exclude some of `NOT_OF_AN_ENGINE`."""

GENERATING_SET: dict[str, Any] = {
    "set": {"inertia": 4.0},
    "solver": {"method": "transient"},
    "transient": {
        "cycles": 200, "command_angle": -15.0, "record": [2, 3], "limits": "ISO 8528-5 G2",
        "load_steps": [{"time": 0.5, "torque": 60.0}, {"time": 3.0, "torque": 20.0}],
        "boost_lag": 0.2, "boost_margin": 60.0, "dispersion": 0.001, "fuel_cut": 6.0,
    },
    "governor": {"gain": 6.0, "integral": 6.0, "actuator_lag": 0.03},
}  # fmt: skip
"""Tables of a speed that is followed in time, for an engine of one cylinder such as `ntua`."""

CURVES = ["torque", "load_torque", "torque_after_throw"]

IN_BLOCKS: dict[str, dict[str, Any]] = {
    "a product": {
        "axes": {
            "inertia": [1.0, 2.0, 4.0],
            "crank_ratio": [0.2, 0.25, 0.3],
            "speed": [900, 1100, 1300, 1500, 1700],
        },
        "output": {"quantities": ["delta", "torque_max", "bmep", "position"]},
    },
    "designs beside an axis": {
        "designs": {
            "stroke": np.linspace(0.15, 0.2, 17).tolist(),
            "speed": np.linspace(900, 2000, 17).tolist(),
            "cylinders": [1, 1, 2, 4, 6, 1, 1, 1, 2, 2, 2, 3, 3, 4, 4, 8, 8],
        },
        "axes": {"load": [0, 30, 60]},
        "output": {"quantities": ["delta", "omega_mean", "imep"]},
    },
    "designs that share no table": {
        "designs": {
            "crank_ratio": np.linspace(0.2, 0.33, 70).tolist(),
            "reciprocating_mass": np.linspace(3.0, 9.0, 70).tolist(),
        },
        "output": {"quantities": ["delta", "torque_mean"]},
    },
    "curves, and throws that a block lacks": {
        "axes": {"cylinders": [1, 2, 4], "speed": [1000, 1200]},
        "output": {"quantities": ["delta", *CURVES], "angle_step": 10.0},
    },
    "words": {
        "axes": {"inertia": [2.0, 3.0, 4.0]},
        "solver": {"method": ["auto", "newton"], "inertia_model": ["constant", "variable"]},
        "output": {"quantities": ["delta", "load_torque_nominal"]},
    },
    "a speed that does not repeat": {
        **GENERATING_SET,
        "axes": {"crank_ratio": [0.2, 0.25, 0.3], "governor_gain": [2.0, 4.0, 6.0, 8.0, 12.0]},
        "governor": {"integral": 6.0, "actuator_lag": 0.03},
        "output": {"quantities": ["transient_delta", "recovery_time", "run_speed", "delta"]},
    },
    "results that all blocks share and use, in other units than SI": {
        "axes": {"speed": np.linspace(900, 2000, 300).tolist()},
        "output": {"quantities": ["imep", "bmep", "mechanical_efficiency"]},
    },
    "vectors, orders, bearings and means": {
        "set": {"cylinder_spacing": 0.2, "wanted_delta": 0.05},
        "axes": {"cylinders": [1, 3, 6], "speed": np.linspace(800, 1500, 7).tolist()},
        "output": {
            "quantities": ["shaking_moment_max", "shaking_force", "best_fraction_peak",
                           "inertia_required", "flywheel_shaft_torque_rms", "crank_pin_load_max",
                           "torque_order"],
            "angle_step": 15.0,
        },
    },
    "one design": {"output": {"quantities": ["delta", "fmep"]}},
}  # fmt: skip
"""Scenes of every shape, which blocks may divide in many ways; `engine` is left out."""

MAP = """\
title = "A map"
engine = "ntua"

[axes]
crank_ratio = [0.2, 0.25, 0.3]
inertia = { start = 1.5, stop = 9.0, num = 40 }
speed = { start = 1000, stop = 1800, num = 50 }

[output]
quantities = ["delta", "omega_mean", "imep", "fmep"]
"""


LARGE_MAP = MAP.replace("num = 40", "num = 400").replace("num = 50", "num = 100")
"""120 000 designs in some twenty blocks."""

TO_JOIN = """\
title = "To be joined"
engine = "ntua"

[axes]
speed = [1000, 1200, 1500, 1600]
inertia = { start = 1.5, stop = 9.0, num = 7 }

[output]
quantities = ["delta", "imep", "fmep", "torque_max", "load_torque"]
angle_step = 10
"""

DESIGN_TABLE = {
    "engine": "ntua",
    "designs": {"case": [f"design {i}" for i in range(12)],
        "stroke": np.linspace(0.15, 0.2, 12).tolist(),
        "cylinders": [1, 1, 2, 4, 6, 1, 1, 1, 2, 2, 2, 3]},
    "axes": {"load": [0, 30, 60]},
    "solver": {"method": ["auto", "newton"]},
    "output": {"quantities": ["delta", "imep", "torque_after_throw"], "angle_step": 30},
}  # fmt: skip
