"""Values that a scene and its engine give: the leaves of the graph of quantities, with their axes.

Numbers flow one way here: what is given, the points of the dimensions that quantities add, then
everything that no stage of the plan computes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.flywheel import MOST_CROSSINGS
from engine_dyn.geometry.arrangement import MOST_CYLINDERS
from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.given_numbers import distinct_combinations
from engine_dyn.loads.driven_machine import cycles_of
from engine_dyn.loads.torque_curves import highest_order
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.pressure.double_acting import ends_of
from engine_dyn.pressure.family import Family, family_from_diagrams
from engine_dyn.pressure.family_grid import FamilyAtSpeeds, FamilyGrid, FamilyStack
from engine_dyn.quantities.balance import DIRECTIONS
from engine_dyn.quantities.each_cylinder import with_values
from engine_dyn.quantities.features import FEATURES
from engine_dyn.quantities.graph import CONSTANTS, DIMENSIONS
from engine_dyn.quantities.node import Node
from engine_dyn.torsion.shaft import Shaft
from engine_dyn.torsion.system import ShaftSystem
from engine_dyn.types import Booleans, Floats, Integers
from engine_dyn.units import RPM
from sweeps.base.errors import SceneError
from sweeps.scene.known_values import Value
from sweeps.scene.model import Scene

CYCLES = "cycles_of_pattern"
"""Name of the leaf with the cycles after which the pattern of each design repeats."""

LOOKED_AT, LOOKED_AT_ONCE = 1024, 16
"""Combinations of a scene's cycle parameters that are tried before a run, all and at a time: the
scene is refused if none of them gives a cycle."""


# --- values along dimensions of quantities, such as crank angle and order -------------------------


def points_of(scene: Scene, cycles: int) -> dict[str, npt.NDArray[Any]]:
    """Points of the dimensions that quantities add, in the units of files.

    `cycles` are those after which firing patterns repeat.
    """
    period, driven = scene.engine.period, scene.driven
    throws = max(len(engine.along_shaft or ()) for engine in scene.all_cylinders)
    turns = round(period / math.tau) * cycles
    cycles = cycles * cycles_of(driven.over_angle, period)
    of_features = [feature.points(scene.engine) for feature in FEATURES]
    orders = math.floor(scene.highest_order * turns + 1e-9)
    finest = round(period / math.tau) * cycles
    # Highest order in the vibration of a shaft, whatever is stored: diagrams resolve periods of
    # four degrees. Loads and auxiliaries that turn faster than the crank have higher orders.
    highest = max(scene.highest_order, 90.0, math.ceil(highest_order(driven.auxiliaries)))
    load = driven.over_angle
    if load is not None and load.own_angle and "gear_ratio" in scene.known:
        ratio = float(np.max(scene.known["gear_ratio"].si))
        if ratio > 1.0:
            highest = max(highest, math.ceil(ratio * highest_order(load)))
    shaft = scene.engine.shaft
    if shaft is not None and shaft.excitations:
        ratios = shaft.speed_ratios({key: scene.known[key].si for key in scene.shaft_keys})
        for one in shaft.excitations:
            ratio = float(np.max(np.abs(ratios[one.disc])))
            highest = max(highest, math.ceil(ratio * one.highest_order))
    every = round(highest * finest)
    return {
        "throw": np.arange(1, throws + 1, dtype=np.int32),
        "bay": np.arange(1, throws + 1, dtype=np.int32),
        "piston": np.arange(1, scene.counts[-1] + 1, dtype=np.int32),
        "main_bearing": np.arange(1, throws + 2, dtype=np.int32),
        **{d: np.arange(1, n + 1, dtype=np.int32) for one in of_features for d, n in one.items()},
        # Orders are quotients of whole numbers: equal orders are then equal numbers for all
        # divisors.
        "order": np.arange(1, orders + 1) / turns,
        "every_order": np.arange(1, every + 1) / finest,
        "crossing": np.arange(1, MOST_CROSSINGS + 1, dtype=np.int32),
        "firing_cycle": np.arange(1, cycles + 1, dtype=np.int32),
        "direction": np.array(DIRECTIONS),
        "crank_angle": _crank_angles(period, cycles, scene.angle_step),
        # Cubics between steps of half a degree have errors of some 2e-9 of the range of the speed.
        "close_angle": _crank_angles(period, cycles, 0.5),
    }


def leaves_of_points(points: Mapping[str, npt.NDArray[Any]], period: float) -> dict[str, Value]:
    """Points of dimensions in SI units, and the angle after which curves over them repeat."""
    leaves = {name: Value(p * DIMENSIONS[name].si, (name,)) for name, p in points.items()}
    return leaves | {"curve_period": Value(period * len(points["firing_cycle"]))}


def _crank_angles(period: float, cycles: int, step: float) -> Floats:
    """Crank angles of curves [degree] without the end; the first cycle lies around angle 0."""
    cycle = math.degrees(period)
    points = round(cycles * cycle / step)
    return np.asarray(-0.5 * cycle + np.arange(points) * step, dtype=np.float64)


# --- leaves: values that no stage computes --------------------------------------------------------


def leaves_of(scene: Scene, points: Mapping[str, npt.NDArray[Any]]) -> dict[str, Value]:
    """All that no stage computes: known values, points, and constants."""
    engine = scene.engine
    leaves = dict(scene.known)
    family = engine.family
    if scene.indicator is not None:
        # A given diagram holds for any load.
        load = [float(leaves["load"].data) if "load" in leaves else 100.0]
        family = family_from_diagrams(load, [scene.indicator])
        if "over_cycles" in scene.words:  # Recorded cycles are not interpolated
            cycles = scene.recorded_cycles
            family = FamilyStack.of([family_from_diagrams(load, [cycle]) for cycle in cycles])
    family, leaves["cycle"] = _with_cycles(scene, family, leaves)
    if not scene.cycle_keys and (engine.pressure_scale is None or scene.indicator is not None):
        # The scale shows whether a load that follows is reached
        scale = "diagram_scale" if scene.load_follows else "pressure_scale"
        leaves[scale] = Value(np.float64(1.0))
    driven = scene.driven
    if not driven.geared:
        leaves["load_gear"] = Value(np.float64(1.0))
    leaves["cylinder_set"], sets, whole = _cylinder_sets(scene, leaves)
    leaves["undisturbed_set"] = leaves["cylinder_set"]
    if "held" in scene.words or "no_transient" not in scene.words:
        leaves["undisturbed_set"], sets = _undisturbed_sets(leaves["cylinder_set"], sets, whole)
    patterns = scene.firing_patterns
    if patterns is not None:
        leaves[CYCLES] = Value(patterns.cycles_of_each(scene.counts), patterns.dims)
    if points:
        leaves |= leaves_of_points(points, engine.period)
    constants = {
        "family": family,
        "period": engine.period,
        "curve_period": engine.period,  # Used where curves have no points
        "closure": scene.closure,
        "tolerance": scene.tolerance,
        "scale_table": engine.pressure_scale,
        "driven": driven,
        "cylinders_by_count": sets,
        "double_acting": ends_of(engine.family),
        **{one.constant: one.of(engine) for one in FEATURES if one.constant is not None},
        "variant_of": scene.variants.__getitem__,
    }
    choices = {"method": scene.methods, "inertia_model": scene.inertia_models}
    for name in CONSTANTS:
        if name in leaves:
            continue
        if name in choices:
            varies = name in scene.dimensions
            data = np.asarray(choices[name]) if varies else choices[name][0]
            leaves[name] = Value(data, (name,) if varies else ())
        else:
            leaves[name] = Value(constants[name])
    return leaves


def mean_of(node_of: Callable[[str], Node], leaves: Mapping[str, Value], name: str) -> Any:
    """A value, the mean where it varies [SI]; KeyError where it takes more than formulas."""
    if name in leaves:
        leaf = leaves[name]
        if not leaf.dims:
            return leaf.si
        return np.ravel(leaf.data)[0] if name == "cylinder_set" else np.mean(leaf.si)
    node = node_of(name)
    if node.make is None or node.kind == "stage":
        raise KeyError(name)
    return node.make(**{need: mean_of(node_of, leaves, need) for need in node.needs})


def _with_cycles(
    scene: Scene, family: Family | FamilyGrid, leaves: Mapping[str, Value]
) -> tuple[Family, Value]:
    """Family with the modelled cycles of the scene, and the number of each design's cycle."""
    # Raises SceneError where none of the first `LOOKED_AT` combinations of parameters is a cycle.
    if isinstance(family, FamilyGrid):
        family = family.at_speeds(leaves["speed"].si)
    keys = scene.cycle_keys
    if not keys:
        if scene.load_follows and type(family) is Family:
            # A load that follows may vary along several axes: a stack serves for these.
            family = FamilyStack.of([family])
        return family, Value(np.zeros(()))
    dims, distinct, number = _combinations(scene, [leaves[key] for key in keys])
    changes = {key: np.ascontiguousarray(distinct[:, i]) for i, key in enumerate(keys)}
    table = CycleTable.of(family, scene.engine.cycles or (), changes)
    # A scene is refused whose first combinations all give no cycle.
    for begin in range(0, min(table.combinations, LOOKED_AT), LOOKED_AT_ONCE):
        some = np.arange(begin, min(begin + LOOKED_AT_ONCE, table.combinations))
        if cycles_known(table, leaves, some).any():
            # Without the rows that were made for the look
            return table.emptied(), Value(number.astype(float), dims)
    name = scene.path.name if scene.path else "scene"
    raise SceneError(f"{name}: {scene.engine.name}: {table.refusal(0)}")


def cycles_known(table: CycleTable, leaves: Mapping[str, Value], number: Integers) -> Booleans:
    """Whether combinations of parameters are cycles where the scene needs them.

    At its load and speed; where these vary or follow from others, whether any diagram is a cycle.
    """
    load = leaves.get("load")
    if load is None or load.dims or leaves["speed"].dims:
        return np.asarray(table.diagrams_known(number).any(axis=-1))
    if isinstance(table.own, FamilyAtSpeeds):
        place = table.place(load.si, leaves["speed"].si)
    else:
        place = np.add(*table.locate(load.si))
    return table.known(table.row_of(number, place))


def _combinations(scene: Scene, values: list[Value]) -> tuple[tuple[str, ...], Floats, Integers]:
    """Axes of the values, their distinct combinations, and the number of each on these axes."""
    # The combinations are rows of a table.
    dims = tuple(d for d in scene.dimensions if any(d in value.dims for value in values))
    shaped = [
        np.asarray(value.si).reshape([-1 if d in value.dims else 1 for d in dims])
        for value in values
    ]
    return dims, *distinct_combinations(*shaped)


Sets = dict[int, Cylinders]
"""Sets of cylinders by their numbers."""


def _cylinder_sets(scene: Scene, leaves: Mapping[str, Value]) -> tuple[Value, Sets, Sets]:
    """Number of each design's set, the sets, and the same without misfires and patterns."""
    # Where sets differ only in how many cylinders they have, that count is the number of the set.
    count, misfire = leaves["cylinders"], leaves["misfire"]
    arrangements, patterns = scene.arrangements, scene.firing_patterns
    keys = scene.cylinder_set_keys
    if not (arrangements or keys or np.any(misfire.data) or patterns):
        return count, scene.cylinders_by_count, scene.cylinders_by_count
    which = Value(np.zeros(()))
    if arrangements:
        which = Value(np.arange(len(arrangements), dtype=float), ("arrangement",))
    fires = Value(np.zeros(()))
    if patterns:
        fires = Value(patterns.which.astype(float), patterns.dims)
    of_keys = [leaves[key] for key in keys]
    dims, distinct, number = _combinations(scene, [count, which, misfire, fires, *of_keys])
    sets, whole = {}, {}
    # Numbers of sets of cylinders begin here, so that none is a number of cylinders
    first_set = MOST_CYLINDERS + 1
    for i, (cylinders, place, silent, pattern, *values) in enumerate(distinct.tolist()):
        engine = (
            arrangements[int(place)] if arrangements else scene.cylinders_by_count[int(cylinders)]
        )
        engine = whole[first_set + i] = with_values(engine, dict(zip(keys, values, strict=True)))
        engine = engine.without(int(silent))
        if patterns:
            engine = engine.with_pattern(patterns.each[int(pattern)].of(engine.count))
        sets[first_set + i] = engine
    return Value(first_set + number, dims), sets, whole


def _undisturbed_sets(numbers: Value, sets: Sets, whole: Sets) -> tuple[Value, Sets]:
    """Number of each design's set where all its cylinders burn fully, and the sets with these."""
    sets, places = dict(sets), {engine: number for number, engine in sets.items()}
    full: dict[int, int] = {}
    for number, engine in whole.items():
        burning = engine.with_factors(pressure_factor=(1.0,) * engine.count)
        if burning == sets[number]:
            full[number] = number
        else:
            full[number] = places.setdefault(burning, max(MOST_CYLINDERS, *sets) + 1)
            sets[full[number]] = burning
    distinct, place = np.unique(numbers.data, return_inverse=True)
    those = np.array([full[int(number)] for number in distinct])[place]
    those, dims = those.reshape(np.shape(numbers.data)), numbers.dims
    # Axes along which only misfires or firing patterns vary are dropped: without these, the engines
    # along such an axis are the same.
    for dim in numbers.dims:
        axis = dims.index(dim)
        first = np.take(those, [0], axis)
        if (those == first).all():
            those, dims = first.squeeze(axis), dims[:axis] + dims[axis + 1 :]
    return Value(those, dims), sets


# --- modes of shafts ------------------------------------------------------------------------------


class ModesKept(NamedTuple):
    """Number of modes that are computed, that of the system, and why so many, as people read it."""

    kept: int
    of: int
    why: str

    def __str__(self) -> str:
        return f"{self.kept} of {self.of} modes of the system{self.why and ': '}{self.why}"


def modes_kept(scene: Scene, leaves: Mapping[str, Value]) -> ModesKept:
    """Modes of a scene with a shaft.

    Raises
    ------
    SceneError
        In one line: where more modes are asked for than there are, or none is as low.
    """
    shaft = scene.engine.shaft
    name = scene.path.name if scene.path else "scene"
    if shaft is None:
        for key in ("modes", "modes_below"):
            if getattr(scene, key) is not None:
                raise SceneError(f"{name}: [output] {key}: has no effect: the scene has no shaft")
        return ModesKept(0, 0, "")
    stiff, soft = (_systems(scene, shaft, leaves, ends) for ends in (_largest, _lowest))
    from engine_dyn.torsion.modes import count_below, free_parts

    free = min(int(free_parts(system, 1.0)) for system in stiff)
    total = stiff[0].parent.size - free
    if scene.modes is not None:
        if scene.modes > total:
            raise SceneError(
                f"{name}: [output] modes = {scene.modes}: the shaft has {total}; must be at most "
                "as many"
            )
        return ModesKept(scene.modes, total, "as asked for")
    if scene.modes_below is not None:
        omega = math.tau * min(scene.modes_below, 1e100)
    elif "speed" in scene.known:
        speed = float(np.max(scene.known["speed"].si))
        # Frequencies up to 1.25 times the range of orders count: a mode responds below its
        # resonance too, and varying masses count with their mean.
        omega = 1.25 * scene.highest_order * speed
    else:
        return ModesKept(total, total, "")
    count = max(count_below(system, omega) for system in soft) - free
    if scene.modes_below is not None:
        if count < 1:
            raise SceneError(
                f"{name}: [output] modes_below = {scene.modes_below:g}: no mode is below it [Hz]"
            )
        return ModesKept(count, total, f"those below {scene.modes_below:g} Hz")
    # Smallest number of modes that are computed by default, even above the range of orders
    at_least = 6
    if count >= total or total <= at_least:
        return ModesKept(total, total, "")
    why = f"all that orders up to {scene.highest_order:g} can excite at {speed / RPM:.5g} rpm"
    if count < at_least:
        why += f", and {at_least} at least"
    return ModesKept(max(count, at_least), total, f"{why}; [output] modes gives others")


def _largest(what: str, values: Any) -> Any:
    return np.max(values)


def _lowest(what: str, values: Any) -> Any:
    """End of the values that lowers frequencies, or the mean where neither end does."""
    # Frequencies are lowest with the smallest values of `softening` and the largest of `heavy`.
    softening = (
        "shaft_stiffness", "damper_stiffness", "disc_ground_stiffness", "shaft_diameter",
        "shaft_shear_modulus",
    )  # fmt: skip
    heavy = ("disc_inertia", "damper_inertia", "pendulum_mass", "shaft_length", "shaft_bore")
    if what in softening:
        return np.min(values)
    return np.max(values) if what in heavy else np.mean(values)


def _systems(
    scene: Scene, shaft: Shaft, leaves: Mapping[str, Value], end: Any
) -> list[ShaftSystem]:  # fmt: skip
    """Systems with these ends of all varying values, for the least and largest gear ratios."""
    values = {key: end(key.rpartition("_")[0], scene.known[key].si) for key in scene.shaft_keys}
    try:
        masses = mean_of(scene.node, leaves, "mean_reciprocating_inertia")
    except KeyError:  # The engine has no masses, and no quantity that needs them
        masses = 0.0
    added = np.full(len(shaft.throws), masses / len(shaft.throws))
    tables = np.full(len(shaft.shafts), np.nan)
    for place, table in shaft.tables.items():
        tables[place] = end("shaft_stiffness", table.stiffness)
    excess = 0.0
    if "wanted_delta" in scene.words:
        # A wanted delta asks for a flywheel of unknown inertia. A thousand times the shaft's stands
        # for it: a still larger one lowers no mode.
        excess = 1e3 * shaft.inertia(values, added)
    systems = []
    for pick in (np.min, np.max):
        gears = {key: pick(scene.known[key].si) for key in values if "gear_ratio" in key}
        systems.append(shaft.system({**values, **gears}, added, excess, 0.0, tables))
    return systems
