"""The graph of quantities: complete, without cycles, read by UDUNITS, and all of it reachable."""

from __future__ import annotations

import cf_units
import numpy as np
import pytest

import sweeps
from engine_dyn.quantities.graph import (
    CYCLE_KEYS,
    DIMENSIONS,
    NODES,
    PARAMETERS,
    QUANTITIES,
    check_graph,
)
from engine_dyn.quantities.single_cylinders import OF_CYLINDER
from tests.support import NOT_OF_AN_ENGINE

pytestmark = pytest.mark.compiled


def test_needs_exist_and_arguments_are_needs() -> None:
    check_graph()


def test_every_unit_is_read_by_udunits() -> None:
    for node in (*PARAMETERS.values(), *QUANTITIES.values()):
        if node.unit:
            cf_units.Unit(node.unit)
        else:
            assert node.name in ("load_coefficient",), node.name


def test_factors_to_si_are_those_of_udunits() -> None:
    base = {
        "bar": "Pa", "rpm": "rad s-1", "degree": "rad", "bar s m-1": "Pa s m-1",
        "bar s2 m-2": "Pa s2 m-2",
    }  # fmt: skip
    for node in (*PARAMETERS.values(), *QUANTITIES.values()):
        if node.unit in base:
            exact = cf_units.Unit(node.unit).convert(1.0, cf_units.Unit(base[node.unit]))
            assert node.si == pytest.approx(exact, rel=1e-12), node.name
        else:
            assert node.si == 1.0, node.name


def test_what_people_see_is_described() -> None:
    for node in (*PARAMETERS.values(), *QUANTITIES.values()):
        assert node.long_name and node.source, node.name
        if node.name not in ("status", "load_factor"):
            assert node.symbol, node.name


@pytest.mark.parametrize("closure", ["power_mean", "cycle_time"])
def test_every_quantity_is_computed(closure: str) -> None:
    result = sweeps.run(
        {
            "engine": "ntua",
            **NOT_OF_AN_ENGINE,
            "axes": {"speed": [1000, 1400]},
            "solver": {"closure": closure},
            "output": {"quantities": list(QUANTITIES), "angle_step": 10.0},
        }
    )
    for name in QUANTITIES:
        assert np.isfinite(result[name]).all(), name
    used = {need for variants in NODES.values() for node in variants for need in node.needs}
    used |= {*DIMENSIONS}  # points of what quantities add
    used |= set(CYCLE_KEYS)  # the planner makes the family and which cycle of it from them
    used |= {"misfire", *OF_CYLINDER}  # and the sets of cylinders
    assert {name for name in NODES if name not in used and name not in QUANTITIES} == set()
