"""From the asked quantities back to the stages needed, each on the axes that it depends on.

The graph of quantities (`engine_dyn.quantities.graph`) says what needs what; the scene says which
parameters vary. The plan is the ancestors of what is asked, in order. Nobody writes axes by hand,
and nothing is computed on an axis that it does not depend on.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import psutil

from engine_dyn.geometry.arrangement import MOST_CYLINDERS
from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.pressure.diagram import Family, family_from_diagrams
from engine_dyn.pressure.family_grid import FamilyGrid, FamilyStack
from engine_dyn.quantities.balance import DIRECTIONS
from engine_dyn.quantities.friction import NO_STROKE_FRICTION
from engine_dyn.quantities.graph import (
    ALONG_SHAFT,
    CONSTANTS,
    DIMENSIONS,
    PARAMETERS,
    UNLESS_GIVEN,
    Variants,
    select,
)
from engine_dyn.quantities.node import Node
from engine_dyn.quantities.parameters import SOLVER_COLUMNS
from engine_dyn.quantities.single_cylinders import with_values
from engine_dyn.types import Floats, Integers
from sweeps.dimensions import DESIGN
from sweeps.errors import SceneError, size_text
from sweeps.planning.blocks import bytes_beside
from sweeps.scene.cylinders import cylinders_of_count
from sweeps.scene.driven import driven_machine
from sweeps.scene.model import Scene
from sweeps.scene.variants import variant_words

__all__ = ["Plan", "Stage", "Value", "make_plan"]


@dataclass(frozen=True, eq=False)
class Value:
    """An array, the names of its dimensions, and the SI value of one of its units.

    A constant is anything, without dimensions. Given columns stay in the units of files until a
    stage takes them: a copy of each in SI units would double them.
    """

    data: Any
    dims: tuple[str, ...] = ()
    unit: float = 1.0

    @property
    def si(self) -> Any:
        """The array in SI units; itself where it is so already."""
        return self.data if self.unit == 1.0 else self.data * self.unit


@dataclass(frozen=True, eq=False)
class Stage:
    """One node that is computed, with the dimensions of what it gives."""

    node: Node
    dims: tuple[str, ...]
    size: int

    @property
    def axes(self) -> tuple[str, ...]:
        """Dimensions of designs, without those that quantities add."""
        return tuple(d for d in self.dims if d not in DIMENSIONS)


@dataclass(frozen=True, eq=False)
class Plan:
    """What a scene computes.

    Attributes
    ----------
    scene : Scene
        What was asked.
    leaves : dict of Value
        Given values, SI, and constants.
    stages : tuple of Stage
        In the order of computing.
    points : dict of ndarray
        Points of the dimensions that quantities add, in the units of files.
    sizes : dict
        Length of every dimension.
    outputs : tuple of str
        Variables that the archive holds, `status` among them where a stage can fail.
    unused : tuple of str
        Axes that nothing depends on.
    of_tables : frozenset of str
        Axes that the tables of the kernels depend on.
    whole : Plan, optional
        What this is a part of.
    piece : str
        Which part: JSON; see `sweeps.planning.shards`.
    """

    scene: Scene
    leaves: Mapping[str, Value]
    stages: tuple[Stage, ...]
    points: Mapping[str, npt.NDArray[Any]]
    sizes: Mapping[str, int]
    outputs: tuple[str, ...]
    unused: tuple[str, ...]
    of_tables: frozenset[str]
    whole: Plan | None = None
    piece: str = ""

    @property
    def name(self) -> str:
        """What messages call the scene."""
        return self.scene.path.name if self.scene.path else "scene"

    @property
    def designs(self) -> int:
        """Number of designs, the product of the scene's axes."""
        return math.prod(self.sizes[d] for d in self.scene.dimensions)

    @property
    def output_bytes(self) -> int:
        """Size of the variables of the archive, uncompressed."""
        return sum(_bytes(s.node.name, s.size) for s in self.stages if s.node.name in self.outputs)

    @property
    def memory_bytes(self) -> int:
        """Arrays that exist at the same time at most: outputs, and what a block is made from."""
        return self.output_bytes + round(bytes_beside(self))

    def check_memory(self) -> None:
        """Refuse a scene larger than memory.

        Raises
        ------
        SceneError
            With the size and what is free.
        """
        free = psutil.virtual_memory().available
        if self.memory_bytes > 0.9 * free:
            need = size_text(self.memory_bytes)
            raise SceneError(
                f"{self.name}: {self.designs} designs need {need} of memory, "
                f"{size_text(free)} are free; ask for fewer points or fewer quantities "
                f"(largest: {max(self.stages, key=lambda s: s.size).node.name})"
            )

    def dims(self, name: str) -> tuple[str, ...]:
        """Dimensions of a result or of something given."""
        found = {s.node.name: s.dims for s in self.stages}
        return found[name] if name in found else self.leaves[name].dims

    def has(self, name: str) -> bool:
        """Whether a stage of this name is computed."""
        return any(s.node.name == name for s in self.stages)

    def wanted(self, stage: Stage) -> tuple[str, ...]:
        """Results of a stage that the plan uses."""
        return tuple(name for name in stage.node.gives if self.has(name))


def _bytes(name: str, size: int) -> int:
    return size if name == "status" else 8 * size


FIRST_SET = MOST_CYLINDERS + 1
"""Numbers of sets of cylinders begin here: none is a number of cylinders."""

_OF_TABLES = (
    "crank_ratio", "row", "pressure_scale", "crankcase_pressure", "offset_ratio",
    *NO_STROKE_FRICTION,
)  # fmt: skip
"""What the tables of the kernels depend on."""


def make_plan(scene: Scene) -> Plan:
    """Plan a scene.

    Raises
    ------
    SceneError
        Where a value that is needed is given by neither scene nor engine, or a quantity needs
        throws and no firing order is known.
    """
    points = _points(scene)
    leaves = _leaves(scene, points)
    sizes = _sizes(scene) | {name: len(values) for name, values in points.items()}
    words = variant_words(scene)
    order = (*scene.dimensions, *DIMENSIONS)
    stages: dict[str, Stage] = {}
    used: set[str] = set()

    def visit(name: str) -> tuple[str, ...]:
        if name in leaves:
            used.add(name)
            return leaves[name].dims
        if name in stages:
            return stages[name].dims
        node = select(name, *words)
        if node.make is None and not node.gives and node.kind == "parameter":
            raise SceneError(
                f"engine {scene.engine.name}: gives no {name} [{node.unit}], which "
                f"{_asked_for(scene, stages)} needs; give it in [set], [axes] or [designs]"
            )
        dims: set[str] = set(node.adds)
        for need in node.needs:
            here = visit(need)
            # A kernel takes points whole: only the curves among its results have their dimension.
            dims.update(d for d in here if not (node.kind == "stage" and d in DIMENSIONS))
        ordered = tuple(d for d in order if d in dims)
        stages[name] = Stage(node, ordered, math.prod(sizes[d] for d in ordered))
        return ordered

    for name in scene.quantities:
        along = not ALONG_SHAFT.isdisjoint(visit(name))
        if along or any(stage.node.throws for stage in stages.values()):
            _check_orders(scene, leaves, name)
    outputs = list(scene.quantities)
    if any(s.node.can_fail for s in stages.values()) and "status" not in outputs:
        outputs.append("status")
        visit("status")
    named: dict[str, Value | Stage] = {**leaves, **stages}
    of_tables = frozenset(d for n in _OF_TABLES if n in named for d in named[n].dims)
    tables = math.prod(sizes[d] for d in of_tables)
    designs = math.prod(sizes[d] for d in scene.dimensions)
    leaves["sharing"] = Value((tables, designs // tables))
    if "cycle" in used:
        used.update(scene.cycle_keys)
    if "cylinder_set" in used:
        varying = set(leaves["cylinder_set"].dims)
        keys = ("cylinders", "misfire", *scene.cylinder_keys)
        used.update(key for key in keys if set(leaves[key].dims) <= varying)
    touched = {d for name in used for d in leaves[name].dims}
    unused = tuple(d for d in scene.dimensions if d not in touched)
    if DESIGN in touched:
        unused += tuple(c for c in scene.designs if c not in used)
    return Plan(
        scene, leaves, tuple(stages.values()), points, sizes, tuple(outputs), unused, of_tables
    )


def _asked_for(scene: Scene, stages: Mapping[str, Stage]) -> str:
    return "'" + "', '".join(q for q in scene.quantities if q not in stages) + "'"


def _sizes(scene: Scene) -> dict[str, int]:
    sizes = {d: len(scene.axes[d]) for d in scene.dimensions if d in scene.axes}
    if scene.designs:
        sizes[DESIGN] = len(next(iter(scene.designs.values())))
    elif DESIGN in scene.dimensions:
        sizes[DESIGN] = len(next(iter(scene.labels.values())))
    return sizes


def _points(scene: Scene) -> dict[str, npt.NDArray[Any]]:
    """Points of the dimensions that quantities add, in the units of files."""
    most = int(np.max(_given(scene)["cylinders"].data))
    lowest = math.tau / scene.engine.period
    orders = math.floor(scene.highest_order / lowest + 1e-9)
    return {
        "cylinder": np.arange(1, most + 1, dtype=np.int32),
        "main_bearing": np.arange(1, _throws(scene) + 2, dtype=np.int32),
        "order": lowest * np.arange(1, orders + 1),
        "direction": np.array(DIRECTIONS),
        "crank_angle": _crank_angles(scene),
    }


def _throws(scene: Scene) -> int:
    """Throws of the engine with most of them; none where their order is unknown."""
    counts = np.unique(_given(scene)["cylinders"].data)
    engines = scene.arrangements or [cylinders_of_count(scene, int(count)) for count in counts]
    return max(len(engine.along_shaft or ()) for engine in engines)


def _crank_angles(scene: Scene) -> Floats:
    """Crank angles of curves [degree]: one cycle around firing top dead centre, end excluded."""
    cycle = math.degrees(scene.engine.period)
    count = round(cycle / scene.angle_step)
    return np.asarray(-0.5 * cycle + np.arange(count) * scene.angle_step, dtype=np.float64)


def _given(scene: Scene) -> dict[str, Value]:
    """Parameters that engine or scene give, in SI units; the scene's word counts."""
    engine = {k: Value(np.float64(v)) for k, v in scene.engine.values.items()}
    mine: dict[str, Value] = {}
    for key, number in scene.settings.items():
        mine[key] = Value(np.float64(number))
    for key, values in scene.axes.items():
        if key in PARAMETERS:
            mine[key] = Value(np.asarray(values, dtype=np.float64), (key,))
    for key, column in scene.designs.items():
        mine[key] = Value(np.asarray(column, dtype=np.float64), (DESIGN,))
    for key in SOLVER_COLUMNS:
        single = getattr(scene, key)
        if single is not None:
            mine[key] = Value(np.float64(single))
    if "rod_length" in mine:
        # The engine's own crank ratio is what a given rod replaces.
        engine.pop("crank_ratio", None)
    if scene.characteristic is not None:
        engine.pop("load", None)  # it follows from the speed
    if "wanted_delta" in mine:
        engine.pop("inertia", None)  # it follows from the wanted delta
    if "inertia_in_parts" in variant_words(scene):
        engine.pop("inertia", None)
    if "motor_of_slip" in variant_words(scene):
        engine.pop("motor_synchronous_speed", None)
    given = {
        **{key: Value(np.float64(number)) for key, number in UNLESS_GIVEN.items()},
        **engine,
        **mine,
    }
    return {k: Value(v.data, v.dims, PARAMETERS[k].si) for k, v in given.items()}


def _leaves(scene: Scene, points: Mapping[str, npt.NDArray[Any]]) -> dict[str, Value]:
    engine = scene.engine
    leaves = _given(scene)
    family = engine.family
    if scene.indicator is not None:
        # A given diagram holds whatever the load is called.
        family = family_from_diagrams([float(leaves["load"].data)], [scene.indicator])
    family, leaves["cycle"], leaves["cycle_known"] = _with_cycles(scene, family, leaves)
    if engine.pressure_scale is None or scene.indicator is not None:
        follows = scene.characteristic is not None  # the scale then tells whether it is reached
        leaves["diagram_scale" if follows else "pressure_scale"] = leaves["cycle_known"]
    if "centred" in variant_words(scene):
        leaves["offset_ratio"] = Value(np.float64(0.0))
    if "equal" in variant_words(scene):
        leaves["pressure_share"] = leaves["mass_share"] = Value(np.float64(1.0))
    if "equal_throws" in variant_words(scene):
        leaves["stroke_share"] = Value(np.float64(1.0))
    if "uniform_friction" in variant_words(scene):
        leaves |= {name: Value(np.float64(0.0)) for name in NO_STROKE_FRICTION}
    if not driven_machine(scene).geared:
        leaves["load_gear"] = Value(np.float64(1.0))
    leaves["cylinder_set"], sets = _cylinder_sets(scene, leaves)
    for name, values in points.items():
        leaves[name] = Value(values * DIMENSIONS[name].si, (name,))
    constants = {
        "family": family,
        "period": engine.period,
        "closure": scene.closure,
        "tolerance": scene.tolerance,
        "scale_table": engine.pressure_scale,
        "driven": driven_machine(scene),
        "cylinders_by_count": sets,
        "sharing": None,  # known with the stages
        "characteristic": scene.characteristic,
        "variant_of": Variants(variant_words(scene)),
    }
    words = {"method": scene.methods, "inertia_model": scene.inertia_models}
    for name in CONSTANTS:
        if name in leaves:
            continue
        if name in words:
            varies = name in scene.dimensions
            data = np.asarray(words[name]) if varies else words[name][0]
            leaves[name] = Value(data, (name,) if varies else ())
        else:
            leaves[name] = Value(constants[name])
    return leaves


def _with_cycles(
    scene: Scene, family: Family | FamilyGrid, leaves: Mapping[str, Value]
) -> tuple[Family, Value, Value]:
    """Family of the scene with the cycles that it asks for, which of them a design has, whether.

    Combinations of parameters that are no cycle have NaN instead of 1, and another one's place.
    """

    def of_speeds(found: Family | FamilyGrid) -> Family:
        return found.at_speeds(leaves["speed"].si) if isinstance(found, FamilyGrid) else found

    keys = scene.cycle_keys
    if not keys:
        plain = of_speeds(family)
        if scene.characteristic is not None and type(plain) is Family:
            # The load may vary along several axes, which only a stack's rows may.
            plain = FamilyStack.of([plain])
        return plain, Value(np.zeros(())), Value(np.float64(1.0))
    dims, distinct, number = _combinations(scene, [leaves[key] for key in keys])
    again = scene.engine.cycles or ()
    members: list[Family] = []
    place = np.zeros(len(distinct))
    known = np.full(len(distinct), np.nan)
    refused: ValueError | None = None
    for i, combination in enumerate(distinct.tolist()):
        fields = dict(zip(keys, combination, strict=True))
        made = iter(again)
        try:
            member = of_speeds(family.each(lambda _: next(made)(**fields)))  # noqa: B023
        except ValueError as error:
            refused = refused or error
            continue
        place[i], known[i] = len(members), 1.0
        members.append(member)
    if not members:
        name = scene.path.name if scene.path else "scene"
        raise SceneError(f"{name}: {scene.engine.name}: {refused}") from None
    whole = Value(np.float64(1.0)) if refused is None else Value(known[number], dims)
    return FamilyStack.of(members), Value(place[number], dims), whole


def _combinations(scene: Scene, values: list[Value]) -> tuple[tuple[str, ...], Floats, Integers]:
    """Axes on which any of the values depends, their combinations there, and which stands where.

    The combinations are rows of a table, each once.
    """
    dims = tuple(d for d in scene.dimensions if any(d in value.dims for value in values))
    shaped = [
        np.asarray(value.si).reshape([-1 if d in value.dims else 1 for d in dims])
        for value in values
    ]
    columns = np.stack([c.reshape(-1) for c in np.broadcast_arrays(*shaped)], axis=1)
    distinct, number = np.unique(columns, axis=0, return_inverse=True)
    return dims, distinct, number.reshape(np.broadcast_shapes(*(c.shape for c in shaped)))


def _cylinder_sets(scene: Scene, leaves: Mapping[str, Value]) -> tuple[Value, dict[int, Cylinders]]:
    """Which set of cylinders a design has, and the sets: by their number, if no more varies."""
    count, misfire = leaves["cylinders"], leaves["misfire"]
    arrangements, keys = scene.arrangements, scene.cylinder_keys
    if not (arrangements or keys or np.any(misfire.data)):
        counts = [n for n in range(1, MOST_CYLINDERS + 1) if (count.data == n).any()]
        return count, {n: cylinders_of_count(scene, n) for n in counts}
    which = Value(np.zeros(()))
    if arrangements:
        which = Value(np.arange(len(arrangements), dtype=float), ("arrangement",))
    of_keys = [leaves[key] for key in keys]
    dims, distinct, number = _combinations(scene, [count, which, misfire, *of_keys])
    sets = {}
    for i, (cylinders, place, silent, *values) in enumerate(distinct.tolist()):
        engine = cylinders_of_count(scene, int(cylinders))
        engine = arrangements[int(place)] if arrangements else engine
        engine = with_values(engine, dict(zip(keys, values, strict=True)))
        sets[FIRST_SET + i] = engine.without(int(silent))
    return Value(FIRST_SET + number, dims), sets


def _check_orders(scene: Scene, leaves: Mapping[str, Value], quantity: str) -> None:
    for cylinders in leaves["cylinders_by_count"].data.values():
        count = cylinders.count
        if cylinders.along_shaft is None:
            raise SceneError(
                f"{scene.path.name if scene.path else 'scene'}: cylinders = {count}: "
                f"'{quantity}' needs throws, and no firing order is known for "
                f"{count} cylinders; known: 1 to 8, and the engine's own"
            )
