"""Nodes of the periodic speed: the stage that solves it, the search for an inertia, the results."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from engine_dyn.loads.laws import LAWS
from engine_dyn.quantities.loads import OF_ANGLE
from engine_dyn.quantities.node import Node
from engine_dyn.speed.fields import FRICTION_NAMES, NAMES_OF_QUANTITIES
from engine_dyn.speed.results import CURVE_NAMES, CURVES, RESULTS, SCALAR_NAMES

__all__ = ["NODES", "kernel_inputs"]

_KERNEL_NAMES = {
    **NAMES_OF_QUANTITIES, "load_constant": "offset", "cylinder_set": "cylinders"
}  # fmt: skip
"""Names of nodes in the kernels' front. Of a load over angle, the mean is part of the offset."""


def kernel_inputs(needs: dict[str, Any]) -> dict[str, Any]:
    """Needs of a stage under the names that the kernels' front has for them."""
    return {_KERNEL_NAMES.get(name, name): value for name, value in needs.items()}


# Kernels are imported where they are called: importing the graph compiles and loads none.


def _solve(**needs: Any) -> dict[str, Any]:
    from engine_dyn.speed import dispatch

    found = dispatch.solve(**{"exponent": 1.0, **kernel_inputs(needs)})
    return {**found, "outcome": found["status"]}


def _search(**needs: Any) -> dict[str, Any]:
    from engine_dyn.speed.required import solve_for_inertia

    found = solve_for_inertia(**{"exponent": 1.0, **kernel_inputs(needs)})
    return {"inertia_required": found.inertia, "search_status": found.status}


def _both_statuses(outcome: Any, search_status: Any) -> Any:
    """Status of the search where it failed, else that of the periodic speed."""
    failed = np.isin(search_status, (1, 2, 3, 4, 5))
    return np.where(failed, search_status, outcome).astype(np.int8)


_LAWS = {law.name: law.needs for law in LAWS}
"""What each law over speed needs."""

_ANGLES: dict[str, tuple[str, ...]] = {"steady_load": (), "angle_load": OF_ANGLE}
"""What a load over angle needs."""


def _solution(law: str, angle: str) -> Node:
    """Return the stage that solves the periodic speed under one kind of load or driver."""
    if (law, angle) == ("power_law", "steady_load"):  # a + k omega^alpha and nothing else
        constant = "load_offset"
        acting: tuple[str, ...] = ("load_exponent",)
    else:
        # Of a load over angle, its mean is part of what the speed does not change.
        constant = "load_constant"
        acting = ("driven", *dict.fromkeys((*_LAWS[law], *_ANGLES[angle])))
    return Node(
        "speed_solution", "", "", "periodic crank speed", kind="stage", public=False,
        can_fail=True, when=f"{law} {angle}",
        gives=(*SCALAR_NAMES, *CURVE_NAMES, "status", "outcome"),
        needs=(
            "crank_ratio", "row", "pressure_scale", "crankcase_pressure", "offset_ratio",
            *FRICTION_NAMES, "bore", "double_radius", "reciprocating_mass", "speed", "inertia",
            constant, "torque_mean", "friction_torque", "cylinder_set", "cylinders_by_count",
            "passes", "start_speed", "start_angle", "family", "closure", "tolerance", "sharing",
            "method", "inertia_model", "crank_angle", *acting,
        ),
        make=_solve, source="mathematics: energy form of Kakaitsas eq. 3.1",
    )  # fmt: skip


def _inertia_search(solution: Node) -> Node:
    """Return the stage that finds the inertia for a wanted delta, beside one that solves."""
    needs = [need for need in solution.needs if need not in ("inertia", "crank_angle")]
    # Of a load over speed alone, the search finds its start by itself, and faster.
    swing = ("energy_swing",) if "driven" in needs else ()
    return replace(
        solution, name="inertia_search", long_name="inertia for the wanted delta",
        gives=("inertia_required", "search_status"), make=_search,
        needs=(*needs, "wanted_delta", *swing), source="this project",
    )  # fmt: skip


def _result(name: str, symbol: str, unit: str, long_name: str, source: str, **more: Any) -> Node:
    return Node(name, symbol, unit, long_name, source, needs=("speed_solution",), **more)


_SOLUTIONS = tuple(_solution(law, angle) for law in _LAWS for angle in _ANGLES)

NODES: tuple[Node, ...] = (
    *_SOLUTIONS,
    *(_inertia_search(solution) for solution in _SOLUTIONS),
    *(_result(*row) for row in RESULTS),
    *(_result(*row, adds=("crank_angle",), kind="curve") for row in CURVES),
    _result("outcome", "", "1", "outcome of the periodic speed", "this project", public=False),
    _result("status", "", "1", "outcome of the design", "this project", when="given_inertia"),
    Node(
        "status", "", "1", "outcome of the design", "this project", when="wanted_delta",
        needs=("outcome", "search_status"), make=_both_statuses,
    ),
)  # fmt: skip
