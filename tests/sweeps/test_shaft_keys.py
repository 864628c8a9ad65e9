"""Every key of a shaft with every quantity of a shaft, as an axis, a column and a sample."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal

import sweeps
from engine_dyn.quantities.graph import QUANTITIES
from engine_dyn.quantities.shaft_numbers import PATTERNS
from sweeps.scene.model import Scene
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from tests.support.shafts import complete_shaft
from tests.support.tiers import every

LOAD = ("load_damping", "load_damping_factor")


def shaft() -> dict[str, Any]:
    """All that a shaft may have; of the coupling, whose stiffness is given, the section too."""
    found = complete_shaft(1)
    found["shafts"][1] |= {"diameter": 0.08, "bore": 0.02, "stress_limit": 60.0,
                           "torque_limit": 1e3, "tensile_strength": 500.0,
                           "shape_factor": 0.7}  # fmt: skip
    found["shafts"][2] |= {"diameter": 0.05}
    return found


def tables(quantities: list[str], **more: Any) -> dict[str, Any]:
    return {
        "engine": "ntua", "shaft": shaft(), "silenced_warnings": ["all"], **more,
        "set": {"speed": 1500, "load": 50, "rated_speed": 2000, **more.get("set", {})},
        "output": {"quantities": quantities, "highest_order": 4},
    }  # fmt: skip


BASE: Scene = sweeps.read_scene(tables(["delta"]))
KEYS = [*BASE.shaft_keys, *LOAD]


@functools.cache
def kinds(name: str) -> frozenset[str]:
    """Kinds of numbers of the shaft that a quantity depends on."""
    try:
        node = BASE.node(name)
    except KeyError:  # of the engine, or not of such a scene
        return frozenset()
    return frozenset(node.of_shaft).union(*(kinds(need) for need in node.needs))


def wanted() -> list[str]:
    """Quantities of a shaft, and of those of the rigid engine on it some."""
    rigid = kinds("shaft_inertia")
    found = []
    for name in QUANTITIES:
        if kinds(name) - rigid or name in ("delta", "shaft_inertia", "reciprocating_share"):
            try:
                sweeps.plan(tables([name]))
            except sweeps.SceneError:
                continue
            found.append(name)
    return found


NAMES = wanted()


def own(key: str) -> tuple[float, float]:
    """Its value and a smaller one, which all keys may have."""
    given = 20.0 if key in LOAD else float(BASE.known[key].data)
    return given, 0.95 * given


def test_the_walk_is_over_all_keys_and_quantities() -> None:
    kinds = {key.rpartition("_")[0] for key in BASE.shaft_keys}
    # Damping of modes leaves out the heat of shafts (test_shaft_excitations.py), and limits in
    # passing are not those of shafts with pendulums (test_shaft_passing.py).
    elsewhere = {"modal_damping", "shaft_transient_stress_limit"}
    assert {name.removesuffix("_N") for name in PATTERNS} - elsewhere <= kinds
    assert {
        "natural_frequency", "critical_speed", "mode_vector_sum", "modal_damping_ratio",
        "shaft_stress_over_limit", "propulsion_stress_limit", "damper_heat_per_area",
        "pendulum_swing_over_stop", "shaft_torque_min", "delta_elastic", "damping_ratio",
        "damped_natural_frequency",
    } <= {*NAMES}  # fmt: skip


@pytest.mark.parametrize("key", every(4, KEYS))
def test_every_key_varies(key: str) -> None:
    values = own(key)
    along = sweeps.run(tables(NAMES, axes={key: [*values]}))
    listed = sweeps.run(tables(NAMES, designs={key: [*values]}))
    ends = {"low": min(values), "high": max(values)}
    # Sampled designs are computed as those of a table.
    drawn = make_plan(read_scene(tables(NAMES, sample={"number": 2, "seed": 1, key: ends})))
    alone = sweeps.run(tables(NAMES, set={key: values[1]}))
    changes = []
    for name in NAMES:
        for dims, axis in (
            (along[name].dims, key), (listed[name].dims, "design"), (drawn.dims(name), "design"),
        ):  # fmt: skip
            assert {*dims} - {axis} == {*alone[name].dims}, name
        one = at(along, name, key)
        assert_array_equal(one, alone[name], err_msg=name)
        assert_array_equal(at(listed, name, "design"), alone[name], err_msg=name)
        if key in along[name].dims:
            first, last = (along[name].isel({key: i}).values for i in (0, 1))
            changes.append(not np.array_equal(first, last, equal_nan=True))
    assert any(changes), "changes nothing"


def at(found: xr.Dataset, name: str, axis: str) -> Any:
    """The second design."""
    return found[name].isel({axis: 1}, missing_dims="ignore")
