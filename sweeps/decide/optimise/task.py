"""The task of a search: a scene, parameters that vary, aims, and conditions.

Everything that can be seen to be wrong without computing is refused here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from engine_dyn.quantities.features.transient import TABLES
from engine_dyn.quantities.graph import ALL_QUANTITIES, DIMENSIONS, PARAMETERS
from sweeps.base.arguments import names_given
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import SceneError, not_known, shown
from sweeps.decide.optimise.space import Space, read_space
from sweeps.running.reduce.every_point import outcomes_given
from sweeps.scene.conditions import PARTS, Constraint, conditions_of
from sweeps.scene.plan.plan import Plan, make_plan
from sweeps.scene.reading import GivenScene, scene_of
from sweeps.scene.sample import SEARCH


@dataclass(frozen=True, eq=False)
class Task:
    """A search as it was asked for."""

    given: GivenScene  # The scene without [sample], and without values of the varied parameters
    space: Space  # Parameters that vary
    # Quantities and parameters that are optimised, with 1 where less is wanted and -1 where more
    # is.
    wanted: tuple[tuple[str, float], ...]
    conditions: tuple[Constraint, ...]  # Conditions that must hold at every point of the axes
    not_counted: tuple[str, ...]  # Outcomes; points of the axes with one of these are left out
    # Quantities that are computed: those of the scene and of the search, without curves.
    quantities: tuple[str, ...]
    left_out: tuple[str, ...]  # Curves that the scene asks for, which are left out
    files: Mapping[str, bytes]  # Contents of the files that the scene names; they are read once
    points: tuple[str, ...]  # Axes of the scene; a design is judged at all their points
    seed: int  # Seed of the random numbers

    @property
    def names(self) -> tuple[str, ...]:
        """Quantities of the task: those wanted least or most, and those of conditions."""
        return tuple(
            dict.fromkeys((*(n for n, _ in self.wanted), *(c.name for c in self.conditions)))
        )

    def plan(self, columns: Mapping[str, Any], number: int, quantities: Sequence[str] = ()) -> Plan:
        """Plan of some designs; `number` is how many of them the scene is said to have.

        `quantities` are others than those of the task.
        """
        output = _with_quantities(self.given, quantities or self.quantities)
        return plan_of_designs(
            self.given, self.space, columns, number, self.seed, self.files, output=output
        )


def plan_of_designs(
    given: GivenScene, space: Space, columns: Mapping[str, Any], number: int, seed: int,
    files: Mapping[str, bytes] | None = None, **tables: Mapping[str, Any],
) -> Plan:  # fmt: skip
    """Plan of a scene at some designs of a space; where nothing varies, of the scene as it is.

    `tables` are those of the scene that are others.
    """
    raw: dict[str, Any] = {**given.raw, **tables}
    drawn = None
    if len(space):
        sample = {"method": SEARCH, "number": number, "seed": seed, **space.tables}
        raw, drawn = {"sample": sample, **raw}, columns  # The first table's axis varies slowest
    return make_plan(scene_of(raw, given.name, given.base, given.path, files, given.instead, drawn))


def _with_quantities(given: GivenScene, quantities: Sequence[str]) -> dict[str, Any]:
    return {**(given.raw.get("output") or {}), "quantities": list(quantities)}


def read_task(
    given: GivenScene, over: Any, least: str | Sequence[str], most: str | Sequence[str],
    within: str | Sequence[str], not_counted: str | Sequence[str], seed: int,
) -> Task:  # fmt: skip
    """Check what a search is asked for, in one line for each refusal; see `sweeps.optimise`."""
    raw, name = given.raw, given.name
    for table in ("designs", "uncertainty", "measured", "reference"):
        if raw.get(table) is not None:
            why = "a search finds the designs" if table == "designs" else "not of a search"
            raise SceneError(f"{name}: [{table}]: not allowed with optimise: {why}")
    wanted = _wanted(least, most)
    conditions = conditions_of(within, _unit)
    outcomes_given(not_counted)
    space = read_space(over, raw, name)
    names = list(dict.fromkeys([*(n for n, _ in wanted), *(c.name for c in conditions)]))
    for one in names:
        _check_known(one, space, raw)
    given = GivenScene(_without(raw, space), name, given.base, given.path, given.instead)
    output = raw.get("output")
    asked = output.get("quantities", []) if isinstance(output, Mapping) else []
    if not isinstance(asked, list) or not all(isinstance(q, str) for q in asked):
        raise SceneError(f"{name}: [output] quantities = {shown(asked)}: must be a list of strings")
    own = [q for q in asked if q not in names]
    quantities = [*own, *(one for one in names if one in ALL_QUANTITIES)]
    if not quantities:
        raise SceneError("least and most: no computed quantity; at least one is needed")
    few = space.one_of_each()
    plan = plan_of_designs(
        given, space, space.columns(few), len(few), seed,
        output=_with_quantities(given, quantities),
    )  # fmt: skip
    for one in names:
        if one in ALL_QUANTITIES:
            _check_number(one, plan)
    for one, _ in wanted:
        if one in ALL_QUANTITIES and DESIGN not in plan.dims(one):
            raise SceneError(f"{one}: does not depend on any searched parameter: {_listed(space)}")
    curves = [q for q in own if q in plan.outputs and _curve(q, plan)]
    # Names that are no quantities by themselves, such as those of elasticities, are left out too.
    curves += [q for q in own if q not in ALL_QUANTITIES]
    kept = [q for q in quantities if q not in curves]
    points = tuple(d for d in plan.scene.dimensions if d != DESIGN)
    return Task(
        given, space, tuple(wanted), tuple(conditions),
        tuple(names_given(not_counted, "not_counted")), tuple(kept), tuple(curves),
        plan.scene.files, points, seed,
    )  # fmt: skip


def _wanted(least: str | Sequence[str], most: str | Sequence[str]) -> list[tuple[str, float]]:
    wanted = [(n, 1.0) for n in names_given(least, "least")]
    wanted += [(n, -1.0) for n in names_given(most, "most")]
    if not wanted:
        raise SceneError("optimise: neither least nor most is given; at least one name is needed")
    for number, (name, _) in enumerate(wanted):
        if name in [other for other, _ in wanted[:number]]:
            raise SceneError(f"optimise: {name} is given twice; give each name once")
    return wanted


def _unit(name: str) -> str | None:
    """Name that archives have for a unit."""
    node = ALL_QUANTITIES.get(name) or PARAMETERS.get(name)
    return None if node is None else node.unit


def _check_known(name: str, space: Space, raw: Mapping[str, Any]) -> None:
    """Check that a name is a quantity or a varied number."""
    if name == "status":
        raise SceneError(
            "status: an outcome cannot be minimised or maximised; failed designs are never selected"
        )
    if name in ALL_QUANTITIES:
        return
    searched = [key for key in space.parameters if key in PARAMETERS]
    if name in searched:
        return
    if name in space.parameters:
        raise SceneError(f"{name}: its values are words, which cannot be minimised or maximised")
    if name in (raw.get("axes") or {}):
        raise SceneError(
            f"{name}: is an axis of the scene, at whose every value the conditions must hold; "
            "search it instead (--over)"
        )
    if name in PARAMETERS:
        raise SceneError(f"{name}: this parameter is not searched; searched are {_listed(space)}")
    raise SceneError(
        f"{shown(name)}: not computed"
        f"{not_known(name, [*ALL_QUANTITIES, *searched], command='engine-dyn list quantities')}"
    )


def _curve(name: str, plan: Plan) -> list[str]:
    """Dimensions of a quantity besides those of designs and parts."""
    return [d for d in plan.dims(name) if d in DIMENSIONS and d not in PARTS]


def _check_number(name: str, plan: Plan) -> None:
    """Check that a quantity has one number for each design, or one for each part."""
    curve = _curve(name, plan)
    if curve:
        largest = f"{name}_max"
        hint = f"; use {largest}" if largest in ALL_QUANTITIES else ""
        raise SceneError(
            f"{name}: not one number per design, because it varies over {', '.join(curve)}, so it "
            f"cannot be minimised or limited{hint}"
        )


def _without(raw: Mapping[str, Any], space: Space) -> dict[str, Any]:
    """Tables of a scene without [sample] and without values of the varied parameters."""
    tables = {key: table for key, table in raw.items() if key not in ("sample", *space.parameters)}
    for table, before in (("set", ""), *((one, f"{one}_") for one in TABLES)):
        given = raw.get(table)
        if isinstance(given, Mapping):
            kept = {k: v for k, v in given.items() if f"{before}{k}" not in space.parameters}
            tables[table] = kept
    return tables


def _listed(space: Space) -> str:
    return ", ".join(space.parameters)
