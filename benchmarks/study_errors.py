"""Designs of a study again, by the independent solvers of `oracle`.

A design's numbers come from the scene: what derives from them without a solution (masses, friction,
the blend of diagrams) is computed by the graph of quantities. The diagram is the spline through its
points, as the packages promise to solve it; mean torque and speed are the oracle's own. Where it
can, `oracle/spline.py` solves, to rounding. `oracle/solution.py` solves the rest; it is made for
smooth curves, and differs by some 1e-8 for splines.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from benchmarks.stress.driven import motor_law
from benchmarks.studies import Scene
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.pressure.family import Family, blend
from engine_dyn.pressure.motored import row_with_factor
from engine_dyn.types import Floats, Integers
from oracle import solution, spline
from oracle.solution import Design, Problem
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene

COMPARED = ("delta", "omega_max", "omega_min", "omega_mean")

RPM = math.pi / 30.0

ROUNDING = 1e-12
"""Of delta, relative, in the independent solution."""


class Differences(NamedTuple):
    """Largest relative differences from the independent solutions of some designs."""

    delta: float
    speeds: float  # of the three
    honest: float  # share with a `delta_error` of at least the true error; NaN where not asked for
    designs: int


def single(scene: Scene, shape: Sequence[int], index: int) -> Scene:
    """The scene of one design of a scene."""
    found = {key: value for key, value in scene.items() if key not in ("axes", "designs")}
    values = dict(scene.get("set", {}))
    if "designs" in scene:
        values |= {name: column[index].item() for name, column in scene["designs"].items()}
    for (name, axis), place in zip(
        scene.get("axes", {}).items(), np.unravel_index(index, tuple(shape)), strict="axes" in scene
    ):
        points = axis
        if isinstance(axis, dict):
            points = np.linspace(axis["start"], axis["stop"], axis["num"]).tolist()
        values[name] = points[int(place)]
    return {**found, "set": values}


def values_of(scene: Scene) -> dict[str, Any]:
    """All that is known of the design of a scene without a solution, in SI units."""
    plan = make_plan(read_scene(scene))
    values: dict[str, Any] = {name: value.si for name, value in plan.leaves.items()}
    for stage in plan.stages:
        node = stage.node
        if node.make is not None and node.kind != "stage" and set(node.needs) <= set(values):
            values[node.name] = node.make(**{need: values[need] for need in node.needs})
    values["period"] = plan.scene.engine.period
    return values


def problem_of(values: dict[str, Any]) -> Problem:
    """The equation of a design for `oracle/solution.py`."""

    def number(name: str) -> float:
        return float(values[name])

    engine = values["cylinders_by_count"][int(values["cylinder_set"])]
    place, family = number("row"), values["family"]
    scale = number("pressure_scale")
    members = engine.members
    shares = None
    if number("hydrodynamic_friction"):
        names = ("boundary", "mixed", "hydrodynamic", "skirt")
        shares = tuple(number(f"friction_{name}") for name in names)
    unequal = any(factor != 1.0 for factor in engine.pressure_factors)
    design = Design(
        pressure=scaled(diagram_at(family, place, 1.0), scale),
        motored=scaled(diagram_at(family, place, 0.0), scale) if unequal else None,
        pressure_factors=engine.pressure_factors if unequal else None,
        firing_angles=tuple(-member.phase % solution.CYCLE for member in members),
        bore=number("bore"), stroke=number("stroke"), crank_ratio=number("crank_ratio"),
        reciprocating_mass=number("reciprocating_mass"),
        inertia=number("inertia"),
        speed_rpm=number("speed") / RPM, cylinders=len(members),
        load_exponent=number("load_exponent") if "load_exponent" in values else 1.0,
        load_offset=number("load_offset"), friction_torque=number("friction_torque"),
        crankcase_pressure=number("crankcase_pressure"), inertia_model=str(values["inertia_model"]),
        closure=str(values["closure"]),
        offset=number("pin_line") if "pin_line" in values else 0.0,
        friction_shares=shares, ring_pressure=number("ring_pressure") if shares else 0.0,
    )  # fmt: skip
    problem, _ = solution.problem_of(design)
    return with_driver(with_load(problem, values), values)


def diagram_at(family: Family, place: float, factor: float) -> Diagram:
    """Diagram at a place in a family's table, of a cylinder with this factor on its pressure."""
    row = math.floor(place)
    here = row_with_factor(family, row, factor)
    if place == row:
        return here
    return blend(here, row_with_factor(family, row + 1, factor), place - row)


def scaled(diagram: Diagram, factor: float) -> Callable[[Any], Any]:
    """Pressure over angle, times a factor."""
    return lambda phi: factor * diagram(phi)


def with_load(problem: Problem, values: dict[str, Any]) -> Problem:
    """The equation with the load over angle, where the scene has one."""
    load = values["driven"].over_angle
    if load is None:
        return problem
    gear, phase = float(values["gear_ratio"]), float(values["load_phase"])
    factor, torque = float(values["load_table_factor"]) * gear, problem.torque

    def rest(phi: Any) -> Any:
        return torque(phi) - factor * load(gear * np.asarray(phi) + phase)

    return replace(problem, torque=rest, torque_mean=problem.torque_mean - factor * load.mean)


def with_driver(problem: Problem, values: dict[str, Any]) -> Problem:
    """The equation with a motor, where the scene has one."""
    if not values["driven"].motor:
        return problem
    synchronous = float(values["motor_synchronous_speed"]) / float(values["motor_gear_ratio"])
    law = motor_law(synchronous / problem.omega_n, float(values["motor_breakdown_slip"]))
    return replace(problem, law=law, sign=-1.0)


def differences(scene: Scene, found: Any, index: Integers, most: int) -> Differences:
    """Compare the first designs of `index`, flat places in an archive, with an independent solver.

    These are `most`, or a tenth as many where they are solved one by one.
    """
    shape = found["delta"].shape
    if not known_to_spline(values_of(single(scene, shape, int(index[0])))):
        most = max(1, most // 10)
    index = index[:most]
    flat = {name: found[name].values.reshape(-1)[index] for name in found.data_vars}
    scenes = [single(scene, shape, i) for i in index.tolist()]
    inertia = flat.get("inertia_required", np.full(index.size, np.nan)).tolist()
    values = [values_of(one) for one in scenes]
    for one, given in zip(values, inertia, strict=True):
        if math.isfinite(given):
            one["inertia"] = given
    exact = (
        by_spline(values) if all(known_to_spline(one) for one in values) else by_shooting(values)
    )
    miss = {name: np.abs(flat[name] / exact[name] - 1.0) for name in COMPARED}
    share = math.nan
    if "delta_error" in flat:
        share = float(np.mean(flat["delta_error"] >= miss["delta"] - ROUNDING))
    speeds = max(float(miss[name].max()) for name in COMPARED[1:])
    return Differences(float(miss["delta"].max()), speeds, share, index.size)


def by_shooting(values: Sequence[dict[str, Any]]) -> dict[str, Floats]:
    """Delta and speeds by adaptive integration and shooting, one design at a time."""
    found = [solution.periodic_speed(problem_of(one)) for one in values]
    exact = {name: np.array([getattr(one, name) for one in found]) for name in COMPARED[1:]}
    return exact | {"delta": (exact["omega_max"] - exact["omega_min"]) / exact["omega_mean"]}


def known_to_spline(values: dict[str, Any]) -> bool:
    """Whether `oracle/spline.py` knows all that the design has."""
    engine = values["cylinders_by_count"][int(values["cylinder_set"])]
    plain = values["driven"].plain and "pin_line" not in values
    uniform = not np.any(values["hydrodynamic_friction"])
    return plain and uniform and engine.plain and values["period"] == solution.CYCLE


def by_spline(values: Sequence[dict[str, Any]]) -> dict[str, Floats]:
    """Delta and speeds by collocation on the pieces of the spline."""

    def column(name: str) -> Floats:
        return np.array([float(one[name]) for one in values])

    numbers = {name: number for number, name in enumerate({id(v["family"]): 0 for v in values})}
    families = {numbers[id(v["family"])]: v["family"] for v in values}
    most = max(family.row_count for family in families.values()) + 1
    first = families[0].row(0)

    def pressure(row: int, phi: Any) -> Any:
        number, place = divmod(row, most)
        return families[number].row(place)(phi)

    friction = column("friction_torque") + column("load_offset")
    designs = spline.Designs.of(
        row=column("row") + most * np.array([numbers[id(v["family"])] for v in values]),
        scale=column("pressure_scale"), crankcase=column("crankcase_pressure"),
        crank_ratio=column("crank_ratio"), bore=column("bore"), stroke=column("stroke"),
        mass=column("reciprocating_mass"), inertia=column("inertia"), speed=column("speed"),
        exponent=column("load_exponent"), surplus=column("torque_mean") - column("load_offset"),
        cylinders=np.array([v["cylinders_by_count"][int(v["cylinder_set"])].count for v in values]),
        variable=np.array([str(v["inertia_model"]) == "variable" for v in values]),
        cycle_time=np.array([v["closure"] == "cycle_time" for v in values]),
    )  # fmt: skip
    once = spline.solve(designs, pressure, first.angle)
    # Again with the mean torque that the solver itself has found.
    own = replace(designs, surplus=once.mean_gas_torque - friction)
    found = spline.solve(own, pressure, first.angle)
    return {name: getattr(found, name) for name in COMPARED}
