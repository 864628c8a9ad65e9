"""Values of a plan that engines do not have: one line for each measure, before it is computed.

The ranges are those of `engine_dyn.plausibility`; only what the asked quantities depend on is
looked at. A long table costs the smallest and largest value of its columns, unless one of them may
be outside.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from engine_dyn.forces.balance.lines import is_boxer
from engine_dyn.loads.driven_machine import harmonics_of_load
from engine_dyn.plausibility.judgement import (
    MOST_CORNERS,
    Implausible,
    judged,
    judged_diagrams,
    outside,
)
from engine_dyn.plausibility.usual_ranges import (
    CHECKS,
    RESULT_CHECKS,
    Check,
    check_of_cylinder,
)
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.pressure.double_acting import ends_of
from engine_dyn.pressure.family import Family
from engine_dyn.quantities.features import auxiliaries
from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.torsion.shaft import Shaft
from engine_dyn.torsion.system import ShaftSystem, shaft_stiffness
from engine_dyn.units import BAR, MPA, RPM
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import counted, printable, shown
from sweeps.scene.engine.silenced_warnings import (
    DIAGRAM_SPEEDS,
    LINEAR_COUPLING,
    RECIPROCATING_SHARE,
    RIGID_SHAFT,
    SHAFT_SECTION,
)
from sweeps.scene.features.indicator_files import WARNING
from sweeps.scene.model import Scene
from sweeps.scene.plan.leaves import mean_of
from sweeps.scene.plan.plan import Plan

MOST_AXES = 30
"""Largest number of varying numbers whose ends are combined: NumPy's arrays have 64 axes at most,
older ones 32."""

_known: WeakKeyDictionary[Plan, tuple[str, ...]] = WeakKeyDictionary()


def silenced(scene: Scene) -> frozenset[str]:
    """Names of measures that scene or engine silence; `all` is every one."""
    of_engines = [frozenset(engine.silenced_warnings) for engine in scene.engines]
    return frozenset(scene.silenced_warnings).union(frozenset.intersection(*of_engines))


def implausible_results(plan: Plan) -> dict[str, Check]:
    """Ranges of the results of a plan, by their names."""
    off = silenced(plan.scene)
    if "motor" not in plan.scene.words:  # A table of torque may be given to any scale
        off |= {"driver_factor"}
    return {
        check.name: check
        for check in RESULT_CHECKS
        if check.name in plan.outputs and off.isdisjoint((check.name, "all"))
    }


def plausibility_warnings(plan: Plan) -> tuple[str, ...]:
    """One line for each measure of what is given that is outside its usual range."""
    if plan not in _known:  # Archive, terminal and Python ask for the same warnings
        _known[plan] = tuple(_lines(plan))
    return _known[plan]


def _lines(plan: Plan) -> list[str]:
    if plan.parts:
        return list(dict.fromkeys(
            f"{line}; engine {part.plan.scene.engine.name}"
            if f"engine {part.plan.scene.engine.name}" not in line
            else line
            for part in plan.parts
            for line in plausibility_warnings(part.plan)
        ))  # fmt: skip
    off = silenced(plan.scene)
    if "all" in off:
        return []
    if "double_acting" in plan.scene.words:  # A piston with rod and crosshead is no trunk piston
        off |= {check.name for check in CHECKS if check.name.endswith("_trunk_piston")}
    engines = plan.leaves["cylinders_by_count"].data.values()
    off |= {"cylinder_spacing" if any(map(is_boxer, engines)) else "boxer_spacing"}
    if "bank_offset" in plan.leaves:  # The throws of a boxer are then known to be understood
        off |= {"boxer_spacing"}
    used = {need for stage in plan.stages for need in stage.node.needs} | set(plan.outputs)
    if "family" in used:
        used.update(plan.scene.cycle_keys)
    lines = _of_diagrams(plan, off) if "family" in used else []
    if plan.scene.engine.torque is not None:
        lines += plan.scene.engine.diagram_warnings
    driving = auxiliaries.of(plan.scene.engine)
    lines += () if driving is None else driving.warnings
    given = _Given(plan)
    wrong: set[str] = set()
    numbered = [key for key in plan.leaves if key[-1:].isdigit()]
    of_cylinders = [check for check in map(check_of_cylinder, numbered) if check is not None]
    plain = {check.name: check.name.rpartition("_")[0] for check in of_cylinders}
    for check in (*of_cylinders, *CHECKS):
        if not off.isdisjoint((check.name, plain.get(check.name, check.name))):
            continue
        if check not in of_cylinders and used.isdisjoint(check.blames):
            continue
        names = given.behind(check.needs)
        if names is None or not wrong.isdisjoint(names) or given.inside(check, names):
            continue
        base = {name: given.shaped(name) for name in names}

        judgement = judged(check, base, partial(given.measure, check), _UNITS)
        if judgement is not None:
            # What follows from the plain key follows from that of a cylinder too.
            wrong |= {judgement.key, plain.get(judgement.key, judgement.key)}
            lines.append(judgement.text(_places(plan, judgement, base)))
    if "family" in used and "speed" not in wrong:
        lines += _of_speeds(plan, off)
    return [*lines, *shaft_warnings(plan, off)]


_UNITS = {
    name: ("" if node.unit == "1" else node.unit, node.si) for name, node in PARAMETERS.items()
}


class _Given:
    """Given values of a plan, and values that follow from them by formulas of the graph alone."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self._names: dict[str, tuple[str, ...] | None] = {}
        self._ends: dict[str, Any] = {}
        self._axes = 0

    def behind(self, needs: Iterable[str]) -> tuple[str, ...] | None:
        """Names of the given numbers that nodes follow from.

        None where one of them needs what the plan does not have, or what takes more than formulas.
        """
        names: dict[str, None] = {}
        for need in needs:
            if need not in self._names:
                self._names[need] = self._behind_one(need)
            inputs = self._names[need]
            if inputs is None:
                return None
            names |= dict.fromkeys(inputs)
        return tuple(names)

    def _behind_one(self, name: str) -> tuple[str, ...] | None:
        leaf = self.plan.leaves.get(name)
        if leaf is not None:
            if name in PARAMETERS:
                return (name,)
            return None if leaf.dims or isinstance(leaf.data, CycleTable) else ()
        # Unless they are given, these need a solution
        if name in ("inertia_required", "load", "held_load"):
            return None
        node = self.plan.scene.node(name)
        if node.make is None or node.kind == "stage" or node.threaded or node.adds:
            return None
        return self.behind(node.needs)

    def inside(self, check: Check, names: Sequence[str]) -> bool:
        """Whether a measure is inside its range for all designs, as their ends tell.

        False is not certain: see `judged`. Each number that varies has an axis of its own, with its
        smallest and its largest value: what several measures follow from is computed once.
        """
        leaves = self.plan.leaves
        if sum(bool(leaves[name].dims) for name in names) > MOST_CORNERS:
            return False
        for name in names:
            leaf = leaves[name]
            if name in self._ends:
                continue
            if not leaf.dims:
                self._ends[name] = leaf.si
            elif self._axes == MOST_AXES:
                return False
            else:
                ends = np.array([leaf.data.min(), leaf.data.max()]) * leaf.unit
                self._ends[name] = ends.reshape(2, *(1,) * self._axes)
                self._axes += 1
        bad = outside(check, self._measured(check, self._ends))
        return not (bad.any() if isinstance(bad, np.ndarray) else bad)

    def measure(self, check: Check, values: Mapping[str, Any]) -> Any:
        """The measure [SI] for some of these numbers."""
        si = {name: values[name] * self.plan.leaves[name].unit for name in values}
        return self._measured(check, si)

    def _measured(self, check: Check, si: dict[str, Any]) -> Any:
        return check.measure(*[self._value(need, si) for need in check.needs])

    def _value(self, name: str, si: dict[str, Any]) -> Any:
        """Value of a node in SI units, which is also added to `si`."""
        if name in si:
            return si[name]
        leaf = self.plan.leaves.get(name)
        if leaf is not None:
            return leaf.si
        node = self.plan.scene.node(name)
        assert node.make is not None
        si[name] = node.make(**{need: self._value(need, si) for need in node.needs})
        return si[name]

    def shaped(self, name: str) -> Any:
        """A number or column, in the units of files, that broadcasts over the scene's axes."""
        leaf = self.plan.leaves[name]
        if not leaf.dims:
            return float(leaf.data)
        shape = [self.plan.sizes[d] if d in leaf.dims else 1 for d in self.plan.scene.dimensions]
        return np.reshape(leaf.data, shape)


def _places(plan: Plan, judgement: Implausible, base: Mapping[str, Any]) -> str:
    """Text on the number of designs outside the range and the worst, with `whose` values."""
    scene = plan.scene
    parts = []
    if judgement.of > 1:
        count = judgement.count * (plan.designs // judgement.of)
        parts.append(f"{count} of {counted(plan.designs, 'design')}")
        place = dict(zip(scene.dimensions, judgement.place, strict=True))
        if DESIGN in place and any(np.ndim(v) and plan.leaves[n].dims == (DESIGN,)
                                   for n, v in base.items()):  # fmt: skip
            number = place[DESIGN]
            names = [labels[number] for labels in scene.labels.values()]
            label = f" ('{printable(names[0])}')" if names else ""
            parts[-1] += f", the worst is design {number + 1}{label}"
    if not any(scene.gives(name) for name in base):
        parts.append(f"given by engine {scene.engine.name}")
    return "; ".join(parts)


def _of_diagrams(plan: Plan, off: frozenset[str]) -> list[str]:
    """Lines about the indicator diagrams, unless they are modelled."""
    scene, family = plan.scene, plan.leaves["family"].data
    if isinstance(family, CycleTable):
        return []
    measured = scene.indicator is not None
    diagrams = (scene.indicator,) if scene.indicator is not None else scene.engine.diagrams
    ends = ends_of(scene.engine.family)
    if ends is not None:  # The effective pressure of both ends is not that of a gas
        diagrams = (ends.head_end, ends.crank_end)
    driven = plan.leaves["driven"].data.has_driver
    said = [
        f"[indicator]: {note.removeprefix(WARNING)}"
        for note in scene.indicator_notes
        if note.startswith(WARNING)
    ]
    lines = [
        line
        for line in (said if measured else scene.engine.diagram_warnings)
        if not any(f" {name}: " in line for name in off)
    ]
    if any(f" {name}: " in line for line in lines for name in ("peak_pressure", "level")):
        return lines  # Other measures are wrong for the same reason
    for judgement in judged_diagrams(diagrams, driven=driven, silenced=off, written=BAR):
        where = "[indicator]" if measured else f"engine {scene.engine.name}"
        if ends is not None:
            where += (", head end", ", crank end")[judgement.place[0]]
        elif not measured and type(scene.engine.family) is Family and len(diagrams) > 1:
            loads = scene.engine.family.loads
            number, place = divmod(int(judgement.place[0]), len(loads))
            if number:  # Diagrams of single cylinders come last
                where += f", cylinder {[*scene.engine.family.of_cylinders][number - 1]}"
            where += f", diagram at {loads[place]:g} percent load"
        if scene.confidential:
            lines.append(
                f"{where}: {judgement.check.name}: outside the usual range; value confidential"
            )
        else:
            lines.append(judgement.text(where))
    return lines


def _of_speeds(plan: Plan, off: frozenset[str]) -> list[str]:
    """A line where diagrams are used at speeds for which they do not hold."""
    engine, speed = plan.scene.engine, plan.leaves.get("speed")
    measured = plan.scene.indicator is not None
    given = (plan.scene.indicator_speeds,) if measured else engine.diagram_speeds
    if DIAGRAM_SPEEDS in off or speed is None or not any(given):
        return []
    # A load between the loads of two diagrams uses both diagrams.
    load = None if plan.scene.load_follows else plan.leaves.get("load")
    loads = engine.family.loads
    first, last = 0, len(given)
    if not measured and load is not None and load.data.size:
        first = max(int(np.searchsorted(loads, load.data.min(), "right")) - 1, 0)
        last = int(np.searchsorted(loads, load.data.max(), "left")) + 1
    ranges = [one for one in given[first:last] if one is not None]
    if not ranges:
        return []
    low, high = max(one[0] for one in ranges), min(one[1] for one in ranges)
    rpm = np.asarray(speed.si, float) / RPM
    beyond = np.maximum(low / rpm, rpm / high)
    count = int((beyond > 1.0 + 1e-9).sum())
    if not count:
        return []
    worst = float(rpm.reshape(-1)[int(np.argmax(beyond))])
    of = f"; {count} of {rpm.size} speeds, this is the worst" if rpm.size > 1 else ""
    whose = "[indicator] holds" if measured else f"the diagrams of engine {engine.name} hold"
    return [f"{DIAGRAM_SPEEDS}: speed = {worst:g} rpm; {whose} for {low:g} to {high:g} rpm{of}"]


MOST_SHARE = 0.3  # Largest share of reciprocating masses in the inertia of a throw without a remark


def shaft_warnings(plan: Plan, off: frozenset[str]) -> list[str]:
    """Lines about the shaft of a plan, for a design with the means of all that varies.

    `off` are names of silenced warnings.
    """
    scene = plan.scene
    shaft = scene.engine.shaft
    forced = not plan.computed.keys().isdisjoint(("torsional_response", "torsional_passing"))
    of_share = forced and RECIPROCATING_SHARE not in off
    of_rigid = "speed_solution" in plan.computed and RIGID_SHAFT not in off
    of_section = (forced or "torsional_modes" in plan.computed) and SHAFT_SECTION not in off
    of_linear = "coupling_departure" not in plan.computed and LINEAR_COUPLING not in off
    of_linear &= "torsional_response" in plan.computed
    if shaft is None or not (of_share or of_rigid or of_section or of_linear):
        return []
    values = {key: mean_of(scene.node, plan.leaves, key) for key in scene.shaft_keys}
    throws = len(shaft.throws)
    lines = list(_odd_sections(shaft, values)) if of_section else []
    for coupling in shaft.couplings(values) if of_linear else ():
        if coupling.twist is None and not (coupling.clearance or coupling.friction_torque):
            continue
        lines.append(
            f"{LINEAR_COUPLING}: shaft {coupling.shaft + 1}, "
            f"{shown(shaft.shaft_names[coupling.shaft])}, is not linear: results without "
            "'nonlinear' in their names take its stiffness at the mean torque; coupling_departure "
            "tells where they do not hold"
        )
    try:
        moving = mean_of(scene.node, plan.leaves, "mean_reciprocating_inertia") / throws
    except KeyError:  # The engine has no masses, and no quantity that needs them
        moving = 0.0
    own = shaft.inertias(values, np.full(throws, moving))
    share = max(moving / own[disc] for disc in shaft.throws)
    if of_share and share >= 1.0 and shaft.includes_reciprocating:
        lines.append(
            f"{RECIPROCATING_SHARE}: the reciprocating masses have {100.0 * share:.0f} % of the "
            "inertia of a throw's disc, which is said to hold their mean (reciprocating = "
            "'included'): must be less than 100 %; give a larger inertia, or reciprocating = "
            "'added'"
        )
    elif of_share and share > MOST_SHARE:
        lines.append(
            f"{RECIPROCATING_SHARE}: the reciprocating masses have {100.0 * share:.0f} % of the "
            f"inertia of a throw; above {100.0 * MOST_SHARE:.0f} % their variable part, which is "
            "left out, may excite secondary resonance"
        )
    if of_rigid:
        of_tables = np.full(len(shaft.shafts), np.nan)
        for place, table in shaft.tables.items():
            of_tables[place] = table.stiffness.mean()
        system = shaft.system(values, np.full(throws, moving), of_tables=of_tables)
        lines += _far_from_rigid(plan, shaft, system)
    return lines


def _odd_sections(shaft: Shaft, values: Mapping[str, Any]) -> Iterator[str]:
    """Lines on shafts with implausible lengths, as steel shafts of their section and stiffness."""
    for place in range(shaft.own_shafts):
        stiffness, length, diameter, bore = (
            values.get(f"shaft_{what}_{place + 1}")
            for what in ("stiffness", "length", "diameter", "bore")
        )
        if diameter is None:
            continue
        at = f"{SHAFT_SECTION}: shaft {place + 1}, {shown(shaft.shaft_names[place])}"
        strength = values.get(f"shaft_tensile_strength_{place + 1}")
        if strength is not None and not 300.0 <= strength / MPA <= 1500.0:  # Mild to spring steels
            yield (
                f"{at}: tensile_strength = {strength / MPA:.4g} MPa; of steels usual are 300 to "
                "1500 MPa, and IACS UR M68 holds from 400 MPa on"
            )
        if length is None and stiffness is not None:
            length = shaft_stiffness(80e9, 1.0, diameter, bore or 0.0) / stiffness
        # Usual lengths over the diameter: webs are as stiff as short shafts; the longest are ships'
        # lines of shafts.
        shortest, longest = 0.05, 200.0
        if length is None or shortest <= length / diameter <= longest:
            continue
        given = "" if stiffness is None else f" of {stiffness:.4g} N m/rad"
        yield (
            f"{at}{given}: a steel shaft of its diameter, {diameter:.4g} m, is {length:.3g} m "
            f"long, {length / diameter:.3g} diameters; usual are {shortest:g} to {longest:g}"
            + ("; is the diameter in mm?" if diameter > 5.0 else "")
        )


def _far_from_rigid(plan: Plan, shaft: Shaft, system: ShaftSystem) -> list[str]:
    """Line on the strong order that moves the flywheel least like a rigid shaft."""
    scene = plan.scene
    engine = scene.all_cylinders[0]
    places = engine.along_shaft
    if places is None:
        return []
    orders = np.asarray(plan.points["order"])
    torque = scene.engine.torque
    if torque is None:
        phases = [[engine.members[i].phase for i in place] for place in places]
        vectors = np.array(
            [sum(np.exp(1j * orders * phase) for phase in throw) for throw in phases]
        )
    else:
        vectors = np.array(
            [
                harmonics_of_load(one, orders, scene.engine.period)
                for one in scene.engine.throw_torques or (torque,)
            ]
        )
    # In strong orders the phase vectors of half of the cylinders add up; of a torque that is given,
    # these are half as large as the largest.
    size = np.abs(vectors.sum(axis=0))
    strong = size >= 0.5 * (engine.count if torque is None else size.max(initial=0.0))
    orders, vectors = orders[strong][:2], vectors[:, strong][:, :2]  # Two orders are enough
    if not orders.size:
        return []
    from engine_dyn.torsion.modes import elastic_over_rigid

    # At most 400 of the speeds that are computed
    given = np.unique(plan.leaves["speed"].si)
    speeds = given[:: 1 + given.size // 400]
    ratio = elastic_over_rigid(system, orders, speeds, shaft.throws, vectors, shaft.flywheel)
    far = np.abs(np.where(np.isfinite(ratio), ratio, np.inf) - 1.0)
    if not far.max() > 0.05:  # Share by which the angle may differ from that of a rigid shaft
        return []
    at, which = np.unravel_index(far.argmax(), far.shape)
    frequency = orders[which] * speeds[at] / (2.0 * np.pi)
    return [
        f"{RIGID_SHAFT}: order {orders[which]:g} at {speeds[at] / RPM:.4g} rpm, "
        f"{frequency:.4g} Hz, moves the flywheel {ratio[at, which]:.3g} times as much as with a "
        "rigid shaft, which delta and omega assume; delta_elastic is that of the elastic shaft"
    ]
