"""Parts of a plan: some positions along one axis, computed as in the whole plan.

A part keeps what the whole plan decides (how tables are shared, the engine with most cylinders), so
that its numbers are those of the whole plan to the bit. Only firing patterns that repeat after
different numbers of cycles are computed each over its own, so that others change nothing.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from engine_dyn.types import Integers
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import SceneError, counted
from sweeps.scene.consistency.whole import check_scene
from sweeps.scene.known_values import Value
from sweeps.scene.plan.blocks import undivided
from sweeps.scene.plan.leaves import CYCLES, leaves_of_points, points_of
from sweeps.scene.plan.plan import Part, Plan, make_plan
from sweeps.scene.sample import Drawing


def shard(plan: Plan, number: int, count: int) -> Plan:
    """Shard `number`, from 1 on, of `count` shards of about equal size, parts of the longest axis.

    Raises
    ------
    SceneError
        Where no axis has so many positions.
    """
    used = {d for stage in plan.stages for d in stage.dims}
    axes = [d for d in plan.scene.dimensions if d in used]
    axis = max(axes, key=lambda d: plan.sizes[d], default="")
    group = undivided(plan, axis)
    size = plan.sizes.get(axis, 1) // group
    if count > size:
        points = counted(size, "point" if group == 1 else "base point")
        raise SceneError(
            f"{plan.name}: --shard {number}/{count}: the longest axis has {points}; must be at "
            f"most {counted(size, 'shard')}"
        )
    if count == 1:
        return plan
    if len(plan.portions) > 1:
        return _shard_of_portions(plan, number, count)
    begin, end = (group * (size * n // count) for n in (number - 1, number))
    about = {"shard": f"{number}/{count}", "axis": axis, "first": begin, "of": group * size}
    return part(plan, axis, np.arange(begin, end), json.dumps(about))


def _shard_of_portions(plan: Plan, number: int, count: int) -> Plan:
    """Shard of a sample that is drawn in portions: some of the portions."""
    many = len(plan.portions)
    if count > many:
        raise SceneError(
            f"{plan.name}: --shard {number}/{count}: the sample is drawn in "
            f"{counted(many, 'portion')}; must be at most {counted(many, 'shard')}"
        )
    numbers = plan.portions[many * (number - 1) // count : many * number // count]
    ((first, made),) = Portions(plan).plans(numbers[:1])
    of = many * plan.sizes[DESIGN]
    about = {"shard": f"{number}/{count}", "axis": DESIGN, "first": first, "of": of}
    return replace(made, portions=numbers, whole=plan, piece=json.dumps(about))


def part(plan: Plan, axis: str, places: Integers, piece: str) -> Plan:
    """Plan of some positions along one axis; `piece` says which, for the archive."""
    sizes = {**plan.sizes, axis: len(places)}
    leaves = dict(plan.leaves)
    if not plan.parts:  # Parts have points of their own: `_parts_of` takes those
        for name, value in leaves.items():
            if axis in value.dims:
                data = np.take(value.data, places, axis=value.dims.index(axis))
                leaves[name] = value._replace(data=data)
    return replace(
        plan,
        scene=_scene_of(plan, axis, places),
        leaves=leaves,
        stages=tuple(
            replace(stage, size=math.prod(sizes[d] for d in stage.dims)) for stage in plan.stages
        ),
        sizes=sizes,
        whole=plan,
        piece=piece,
        parts=_parts_of(plan.parts, axis, places),
        variations=tuple(
            replace(one, plans=tuple(part(other, axis, places, "") for other in one.plans))
            for one in plan.variations
        ),
    )


def by_cycles(plan: Plan) -> tuple[Plan, Plan | None]:
    """Divide a plan into what no firing pattern reaches, and a plan of one part for each period.

    Without patterns that repeat sooner than all of them together, the plan itself and None.
    """
    cycles = plan.leaves.get(CYCLES, Value(np.zeros(0))).data
    if plan.parts or np.all(cycles == plan.scene.cycles):
        return plan, None
    (axis,) = plan.leaves[CYCLES].dims
    asked = [name for name in plan.outputs if name not in plan.afterwards]
    reached = [name for name in asked if axis in plan.dims(name)]
    rest = _with_outputs(plan, [name for name in asked if name not in reached])
    whole = _with_outputs(plan, reached)
    leaves = {name: value for name, value in plan.leaves.items() if name != CYCLES}
    parts = []
    # Dimensions whose points depend on the number of cycles after which firing patterns repeat
    over_cycles = ("order", "every_order", "firing_cycle", "crank_angle", "close_angle")
    for own in np.unique(cycles).tolist():
        every_point = points_of(plan.scene, own)
        of_cycles = {name: every_point[name] for name in over_cycles}
        points = {**plan.points, **of_cycles}
        made = replace(
            whole,
            points=points,
            sizes={**plan.sizes, **{name: len(values) for name, values in points.items()}},
            leaves={**leaves, **leaves_of_points(of_cycles, plan.scene.engine.period)},
        )
        rows = np.flatnonzero(cycles == own)
        own_points = {d: np.arange(len(plan.points[d])) % len(points[d]) for d in over_cycles}
        own_points["order"] = np.full(len(plan.points["order"]), -1)
        there = np.searchsorted(plan.points["order"], points["order"])
        own_points["order"][there] = np.arange(len(there))
        made = part(made, axis, rows, "")
        parts.append(Part(made, {axis: rows}, own_points))
    return rest, replace(whole, parts=tuple(parts))


def _with_outputs(plan: Plan, outputs: Sequence[str]) -> Plan:
    """Plan that gives some outputs and computes nothing else."""
    needed, stages = set(outputs), []
    for stage in reversed(plan.stages):
        if stage.node.name in needed:
            needed.update(stage.node.needs)
            stages.append(stage)
    return replace(
        plan, outputs=tuple(outputs), stages=tuple(reversed(stages)), variations=(),
        afterwards=frozenset(),
    )  # fmt: skip


def _parts_of(parts: Sequence[Part], axis: str, places: Integers) -> tuple[Part, ...]:
    """Engines, out of several, in a part of all designs, and the part's designs of each."""
    those = []
    for one in parts:
        own, held = places, one.places
        if axis in held:
            here = np.flatnonzero(np.isin(places, held[axis]))
            if not here.size:
                continue
            own, held = np.searchsorted(held[axis], places[here]), {**held, axis: here}
        varies = axis in one.plan.scene.dimensions
        made = part(one.plan, axis, own, "") if varies else one.plan
        those.append(replace(one, plan=made, places=held))
    return tuple(those)


def _scene_of(plan: Plan, axis: str, places: Integers) -> Any:
    """Scene with the values of a part."""
    scene = plan.scene
    reference = scene.reference
    if reference is not None and axis in reference.dimensions:
        number = reference.dimensions.index(axis)
        columns = {k: np.take(v, places, axis=number) for k, v in reference.columns.items()}
        reference = replace(reference, columns=columns)
    if axis == DESIGN:
        return replace(
            scene,
            designs={key: column[places] for key, column in scene.designs.items()},
            labels={key: tuple(t[i] for i in places) for key, t in scene.labels.items()},
            reference=reference,
        )
    values = scene.axes[axis]
    if isinstance(values, tuple):
        chosen: Any = tuple(values[i] for i in places)
    else:
        chosen = values[places]
    return replace(scene, axes={**scene.axes, axis: chosen}, reference=reference)


class Portions:
    """The portions of a plan, in order; the plan itself is the first, and often the only one."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan

    @cached_property
    def _drawing(self) -> Drawing:
        """The sample as it is drawn, which is fastest in order."""
        assert self.plan.scene.sample is not None
        return Drawing(self.plan.scene.sample)

    def plans(self, numbers: range) -> Iterator[tuple[int, Plan]]:
        """Plans of some portions, each with its first design."""
        length = self.plan.sizes.get(DESIGN, 1)
        for number in numbers:
            plan = self.plan if number == self.plan.portions[0] else self._of(number)
            yield number * length, plan

    def _of(self, number: int) -> Plan:
        points = self._drawing.sample.portion
        columns = self._drawing.columns(number * points, points)
        scene = replace(self.plan.scene, designs=columns)
        check_scene(scene, self.plan.name)
        return make_plan(scene)
