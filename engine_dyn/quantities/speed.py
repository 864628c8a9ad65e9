"""Nodes of the periodic speed: the stage that solves it, the search for an inertia, the results."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from engine_dyn import status, time_over_angle
from engine_dyn.card import card_of
from engine_dyn.geometry.cylinders import even_cylinders
from engine_dyn.geometry.firing_sequence import MOST_CYCLES
from engine_dyn.loads.laws import LAWS
from engine_dyn.pressure.family import flat_family
from engine_dyn.quantities.features.torque_tables import OF_ANGLE
from engine_dyn.quantities.node import Node
from engine_dyn.speed.fields import (
    CURVE_NAMES,
    CURVES,
    FRICTION_NAMES,
    NAMES_OF_QUANTITIES,
    RESULTS,
    SCALAR_NAMES,
)

CLOSE_CURVES = {f"{name}_close": name for name in CURVE_NAMES}
"""Curves of the solution at close points: node's name and kernel's name."""

AT_START = "omega_start"
"""Node of the speed at the start angle, which follows from the curve of the speed."""


def _cycle_delta(
    *, omega_close: Any, angular_acceleration_close: Any, omega_mean: Any, period: float,
    curve_period: float,
) -> Any:  # fmt: skip
    slope, cycles = angular_acceleration_close / omega_close, round(curve_period / period)
    step = curve_period / np.shape(omega_close)[-1]
    return time_over_angle.cycle_ranges(omega_close, slope, step, cycles) / omega_mean


def kernel_inputs(needs: dict[str, Any]) -> dict[str, Any]:
    """Needs of a stage under the names that the kernels' front has for them."""
    # Kernels have the load's torque that is independent of speed as `offset`; it contains the mean
    # of a load over angle.
    names = {**NAMES_OF_QUANTITIES, "load_constant": "offset", "cylinder_set": "cylinders"}
    return {names.get(name, name): value for name, value in needs.items()}


def _keywords(needs: dict[str, Any]) -> dict[str, Any]:
    """Keywords of the function that solves a stage; the name of the device becomes a card."""
    card = card_of(needs.pop("device", "cpu"))
    return {"exponent": 1.0, **kernel_inputs(needs), "card": card}


def _solve(**needs: Any) -> dict[str, Any]:
    from engine_dyn.speed import dispatch

    wanted: Sequence[str] = needs.pop("wanted")
    here = [name for name in wanted if name != AT_START and name not in CLOSE_CURVES]
    if AT_START in wanted and "omega" not in here:
        here.append("omega")
    close = {name: kernels for name, kernels in CLOSE_CURVES.items() if name in wanted}
    between, number = needs.pop("close_angle"), 0
    given = _keywords(needs)
    if close:  # one solution gives the curves at both sets of angles
        number = np.size(given["crank_angle"]) if set(CURVE_NAMES) & set(here) else 0
        points = np.concatenate([np.ravel(given["crank_angle"])[:number], np.ravel(between)])
        given["crank_angle"] = points
    asked = [*here, *(kernels for kernels in close.values() if kernels not in here)]
    results = dispatch.solve(**given | {"wanted": asked})
    if close:
        curves = {name: results[name] for name in CURVE_NAMES if name in results}
        results |= {n: np.ascontiguousarray(curves[k][..., number:]) for n, k in close.items()}
        results |= {n: np.ascontiguousarray(c[..., :number]) for n, c in curves.items()}
    if AT_START in wanted:
        results[AT_START] = _at_start(results["omega"], needs["start_angle"], needs["crank_angle"])
    return {**results, "outcome": results["status"]}


def for_given_torque(make: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function like `make` for engines whose torque is given."""
    return lambda period, **needs: make(**without_cylinders(period), **needs)


def without_cylinders(period: float) -> dict[str, Any]:
    """Inputs of the kernels for an engine whose torque is given: cylinders that do nothing.

    The piston has an area of 1 m2 and the crank a radius of 1 m, without pressure and mass; only
    the cycle, `period` [rad], counts.
    """
    neutral = {
        "crank_ratio": 0.25, "row": 0.0, "pressure_scale": 0.0, "crankcase_pressure": 0.0,
        "bore": math.sqrt(4.0 / math.pi), "double_radius": 2.0, "reciprocating_mass": 0.0,
        "friction_torque": 0.0,
    }  # fmt: skip
    return {name: np.float64(value) for name, value in neutral.items()} | {
        "family": flat_family(period),
        "cylinder_set": np.int64(1),
        "cylinders_by_count": {1: even_cylinders(1, period)},
    }


def _at_start(omega: Any, start_angle: Any, crank_angle: Any) -> Any:
    """Speed at the point nearest to the start angle, where a march that is not closed jumps."""
    angles = np.asarray(crank_angle).reshape(-1)
    turns = (np.asarray(start_angle) - angles[0]) / (angles[1] - angles[0])
    place = np.rint(turns).astype(np.int64) % angles.size
    at = np.broadcast_to(place[..., None], (*omega.shape[:-1], 1))
    return np.take_along_axis(omega, at, -1)[..., 0]


def _speed_search(key: str, extreme: str) -> Any:
    """Return a function that searches the nominal speed for a given extreme of the speed."""

    def make(period: float, **needs: Any) -> dict[str, Any]:
        target = np.asarray(needs.pop(key))
        del needs["wanted"], needs["progress"]
        wanted_delta, speed = needs.pop("wanted_delta", None), target
        for _ in range(40):
            given = {**without_cylinders(period), **needs, "speed": speed}
            if wanted_delta is not None:
                results = _search(**given, wanted_delta=wanted_delta)
                given["inertia"] = results["inertia_required"]
            ratio = target / _solve(**given, close_angle=None, wanted=[extreme])[extreme]
            # A design that fails keeps its speed; the solution reports it
            ratio = np.where(np.isfinite(ratio), ratio, 1.0)
            speed = speed * ratio
            if np.abs(ratio - 1.0).max() <= 1e-12:
                break
        return {"speed_found": speed}

    return make


def _search(**needs: Any) -> dict[str, Any]:
    from engine_dyn.speed.required import solve_for_inertia

    results = solve_for_inertia(**_keywords(needs))
    return {"inertia_required": results.inertia, "search_status": results.status}


def _both_statuses(outcome: Any, search_status: Any) -> Any:
    """Status of the search where it failed, else status of the periodic speed."""
    failed = np.isin(search_status, (1, 2, 3, 4, 5))
    return np.where(failed, search_status, outcome).astype(np.int8)


def _held_status(outcome: Any, held_load: Any, diagram_scale: Any) -> Any:
    """Status of the speed, unless the diagrams do not reach the torque that is held."""
    missed = np.isnan(held_load) & ~np.isnan(diagram_scale)
    return np.where(missed, status.TORQUE_NOT_REACHED, outcome).astype(np.int8)


_ANGLES_OF_CURVES = ("crank_angle", "close_angle")

_LAWS = {law.name: law.needs for law in LAWS}  # Nodes that each law over speed needs

_ANGLES: dict[str, tuple[str, ...]] = {"steady_load": (), "angle_load": OF_ANGLE}
"""Nodes that a load over angle needs."""

OF_CYLINDERS = (
    "crank_ratio", "row", "pressure_scale", "crankcase_pressure", "offset_ratio", *FRICTION_NAMES,
    "bore", "double_radius", "reciprocating_mass", "friction_torque", "cylinder_set",
    "cylinders_by_count", "family",
)  # fmt: skip
"""Nodes needed by an engine whose torque follows from its pressure."""

OF_TORQUE = ("period", "torque_factor", "driven")  # Nodes needed by an engine whose torque is given


def _solution(law: str, angle: str, by_torque: bool = False) -> Node:
    """Return the stage that solves the periodic speed under one kind of load or driver."""
    of_engine = OF_TORQUE if by_torque else OF_CYLINDERS
    if (law, angle) == ("power_law", "steady_load"):  # the law a + k omega^alpha alone
        constant = "load_offset"
        acting: tuple[str, ...] = ("load_exponent", "driven")
    else:
        # The constant load contains the mean of a load over angle.
        constant = "load_constant"
        acting = ("driven", *dict.fromkeys((*_LAWS[law], *_ANGLES[angle])))
    return Node(
        "speed_solution", "", "", "periodic crank speed", kind="stage", public=False,
        outcome="periodic_status",
        when=f"{law} {angle} {'by_torque' if by_torque else 'by_pressure'}",
        gives=(*SCALAR_NAMES, *CURVE_NAMES, *CLOSE_CURVES, AT_START, "status", "outcome"),
        needs=tuple(dict.fromkeys((
            *of_engine, "speed", "inertia", constant, "torque_mean", "passes", "start_speed",
            "start_angle", "closure", "tolerance", "method", "inertia_model", "crank_angle",
            "close_angle", *acting,
        ))),
        make=for_given_torque(_solve) if by_torque else _solve, on_card=True,
        source="mathematics: energy form of Kakaitsas eq. 3.1",
    )  # fmt: skip


def _inertia_search(solution: Node) -> Node:
    """Return the stage that finds the inertia for a wanted delta, beside a stage that solves."""
    needs = [need for need in solution.needs if need not in ("inertia", *_ANGLES_OF_CURVES)]
    # With a load over speed alone, the search finds a start without the energy swing, and faster.
    by_torque = "by_torque" in solution.when
    swing = ("energy_swing",) if by_torque or "load_offset" not in needs else ()
    return replace(
        solution, name="inertia_search", long_name="inertia for the wanted delta",
        gives=("inertia_required", "search_status"),
        make=for_given_torque(_search) if by_torque else _search,
        needs=(*needs, "wanted_delta", *swing), source="this project",
    )  # fmt: skip


def _speed_searches(solution: Node) -> tuple[Node, ...]:
    """Return the stages that find the nominal speed for an extreme, beside a stage that solves."""
    kept = tuple(n for n in solution.needs if n not in ("speed", "inertia", *_ANGLES_OF_CURVES))
    return tuple(
        replace(
            solution, name="speed_search", long_name=f"nominal speed from the {key}",
            gives=("speed_found",), make=_speed_search(key, extreme), outcome="",
            needs=(*kept, beside, key), when=f"{solution.when} {word} {choice}",
            source="this project",
        )
        for key, extreme, word in (
            ("largest_speed", "omega_max", "speed_of_largest"),
            ("smallest_speed", "omega_min", "speed_of_smallest"),
        )
        for beside, choice in (("inertia", "given_inertia"), ("wanted_delta", "wanted_delta"))
    )  # fmt: skip


def _result(name: str, symbol: str, unit: str, long_name: str, source: str, **more: Any) -> Node:
    return Node(name, symbol, unit, long_name, source, needs=("speed_solution",), **more)


_SOLUTIONS = tuple(
    _solution(law, angle, by_torque)
    for law in _LAWS for angle in _ANGLES for by_torque in (False, True)
)  # fmt: skip


def _beside(node: Node) -> Callable[..., Any]:
    """Outcomes of such a node as archives hold those beside `status`: plain numbers."""
    make = node.make
    assert make is not None
    return lambda **needs: np.asarray(make(**needs), dtype=np.float64)


_STATUSES = tuple(
    Node("status", "", "1", "outcome of the design", "this project", when=when, make=make,
         meanings=meanings)
    for when, make, meanings in (
        ("given_inertia not_held", lambda outcome: outcome, status.OF_SPEED),
        ("wanted_delta not_held", _both_statuses, status.OF_SPEED),
        ("given_inertia held", _held_status, status.OF_STEADY),
        ("wanted_delta held",
         lambda outcome, search_status, held_load, diagram_scale: _held_status(
             _both_statuses(outcome, search_status), held_load, diagram_scale
         ), status.OF_STEADY),
    )
)  # fmt: skip

NODES: tuple[Node, ...] = (
    *_SOLUTIONS,
    *(_inertia_search(solution) for solution in _SOLUTIONS),
    *(
        search
        for solution in _SOLUTIONS
        if "by_torque" in solution.when and "motor" not in solution.when
        for search in _speed_searches(solution)
    ),
    Node(
        "speed_found", "", "rad s-1", "nominal speed that an extreme belongs to", public=False,
        needs=("speed_search",),
    ),
    *(
        _result(*row, extreme_of={
            "omega_max": ("omega", "largest"), "omega_min": ("omega", "smallest"),
            "delta": ("omega", "over_mean"), "delta_midrange": ("omega", "over_middle"),
        }.get(row.name))
        for row in RESULTS
    ),
    *(_result(*row, adds=("crank_angle",), kind="curve") for row in CURVES),
    *(
        _result(close, row.symbol, row.unit, f"{row.long_name}, at close points", "",
                adds=("close_angle",), kind="curve", public=False)
        for close, row in zip(CLOSE_CURVES, CURVES, strict=True)
    ),
    _result(
        AT_START, r"\omega(\varphi_1)", "rad s-1",
        "crank speed at the start angle, in the cycle that omega shows", "Kakaitsas section 5.4",
    ),
    Node(
        "cycle_delta", r"\delta_i", "1",
        "range of the speed within each cycle over its mean over all of them", "this project",
        adds=("firing_cycle",), removes=("close_angle",), make=_cycle_delta, width=MOST_CYCLES * 8,
        extreme_of=("omega", "of_cycles"),
    ),
    _result("outcome", "", "1", "outcome of the periodic speed", "this project", public=False),
    _result(
        "status", "", "1", "outcome of the design", "this project",
        when="given_inertia not_held no_transient",
    ),
    *(replace(node, when=f"{node.when} no_transient") for node in _STATUSES[1:]),
    *(
        replace(node, name="periodic_status", symbol=r"\chi_\omega",
                long_name="outcome of the periodic speed", make=_beside(node))
        for node in _STATUSES
    ),
)  # fmt: skip
