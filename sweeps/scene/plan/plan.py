"""From the asked quantities back to the stages needed, each on the axes that it depends on.

The graph of quantities (`engine_dyn.quantities.graph`) says what needs what; the scene says which
parameters vary. The plan is the ancestors of what is asked, in order. Nobody writes axes by hand,
and nothing is computed on an axis that it does not depend on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.quantities.features import FEATURES
from engine_dyn.quantities.friction import FRICTION_LAWS
from engine_dyn.quantities.graph import DIMENSIONS
from engine_dyn.quantities.node import Node
from engine_dyn.speed.fields import TABLE_QUANTITIES
from engine_dyn.types import Integers
from sweeps.base.dimensions import DESIGN, PERIODIC_STATUS, STATUS
from sweeps.base.errors import SceneError, counted, one_line, size_text
from sweeps.scene.known_values import Value
from sweeps.scene.model import Scene, SeveralEngines
from sweeps.scene.plan.leaves import leaves_of, modes_kept, points_of
from sweeps.scene.plan.variations import Variation, variations_of
from sweeps.scene.representations import html_tables, named_some

MOST_CELLS = 1000
"""Largest number of points of the axes that statistics of [reduce] do not go over; each has sums
and bins."""


@dataclass(frozen=True, eq=False)
class Stage:
    """One node that is computed, with the dimensions of what it gives."""

    node: Node
    dims: tuple[str, ...]
    size: int

    @cached_property
    def axes(self) -> tuple[str, ...]:
        """Dimensions of designs, without those that quantities add."""
        return tuple(d for d in self.dims if d not in DIMENSIONS)


@dataclass(frozen=True, eq=False, repr=False)
class Plan:
    """Stages, points and outputs of a scene, which it computes.

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
        Axes that no requested quantity depends on.
    unused_settings : tuple of str
        Keys of [set] that no requested quantity depends on, and modes of [output] that none has.
    of_tables : frozenset of str
        Axes that the tables of the kernels depend on.
    whole : Plan, optional
        The plan of which this is a part.
    piece : str
        Which part: JSON; see `sweeps.scene.plan.shards`.
    parts : tuple of Part
        Plans of the ordinary scenes that a scene of several engines consists of; empty for an
        ordinary one. Stages are then those of all parts, and it is the parts that are computed.
    variations : tuple of Variation
        Plans with other values, for elasticities and for uncertainty; the variables that are made
        of their results are among stages and outputs.
    afterwards : frozenset of str
        These variables, which no stage computes.
    portions : range
        Which portions of a sample it is about, where that is reduced as it is computed; the plan
        is then that of the first of them (`sweeps.scene.plan.shards`).

    Examples
    --------
    >>> import sweeps
    >>> plan = sweeps.plan("first")
    >>> plan.sizes["inertia"], plan.sizes["load"]
    (25, 3)
    >>> "delta" in plan.outputs
    True
    """

    scene: Scene
    leaves: Mapping[str, Value]
    stages: tuple[Stage, ...]
    points: Mapping[str, npt.NDArray[Any]]
    sizes: Mapping[str, int]
    outputs: tuple[str, ...]
    unused: tuple[str, ...]
    unused_settings: tuple[str, ...]
    of_tables: frozenset[str]
    whole: Plan | None = None
    piece: str = ""
    parts: tuple[Part, ...] = ()
    variations: tuple[Variation, ...] = ()
    afterwards: frozenset[str] = frozenset()
    portions: range = range(1)

    def __repr__(self) -> str:
        return (
            f"<Plan of '{one_line(self.scene.title, 60)}': engine {self.scene.engine_names}; "
            f"{self.scene.varying}; {named_some(self.outputs)}, "
            f"{size_text(self.output_bytes)} uncompressed>"
        )

    def _repr_html_(self) -> str:
        unused = ", ".join((*self.unused, *self.unused_settings))
        rows = [
            *(("engine", f"{engine.name}: {engine.title}") for engine in self.scene.engines),
            ("varies", self.scene.varying),
            ("archive", f"{', '.join(self.outputs)}; {size_text(self.output_bytes)} uncompressed"),
            *([("no requested quantity depends on", unused)] if unused else []),
        ]
        columns = {
            "stage": [stage.node.name for stage in self.stages],
            "over": [", ".join(stage.dims) or "one value" for stage in self.stages],
            "values": [f"{stage.size:,}" for stage in self.stages],
            "kept": ["yes" if s.node.name in self.outputs else "" for s in self.stages],
        }
        return html_tables(f"Plan: {self.scene.title}", rows, columns)

    @property
    def name(self) -> str:
        """Name of the scene in messages."""
        return self.scene.path.name if self.scene.path else "scene"

    @property
    def designs(self) -> int:
        """Number of designs, the product of the scene's axes, in all portions."""
        return math.prod(self.sizes[d] for d in self.scene.dimensions) * len(self.portions)

    @property
    def points_each(self) -> int:
        """Number of points at which a reduction with `at_every` judges each design."""
        reduce = self.scene.reduce
        return math.prod(self.sizes[d] for d in reduce.at_every) if reduce else 1

    @property
    def designs_text(self) -> str:
        """Number of designs, and of points of each where there are several."""
        number, points = counted(self.designs // self.points_each, "design"), self.points_each
        return number if points == 1 else f"{number} at {points} points each"

    @property
    def output_bytes(self) -> int:
        """Size of the archive, uncompressed."""
        return self.bytes_of_outputs(8)

    def bytes_of_outputs(self, each: int) -> int:
        """Size of the archive with this many bytes for each result; columns of designs have 8."""
        columns = self.sizes.get(DESIGN, 0) * (4 + 8 * len(self.scene.designs))  # With the numbers
        kept = [stage for stage in self.stages if stage.node.name in self.outputs]
        return columns + sum(s.size * (1 if s.node.name == STATUS else each) for s in kept)

    @cached_property
    def computed(self) -> dict[str, Stage]:
        """Stages by their names."""
        return {stage.node.name: stage for stage in self.stages}

    def dims(self, name: str) -> tuple[str, ...]:
        """Dimensions of a result or of something given."""
        return self.computed[name].dims if name in self.computed else self.leaves[name].dims

    @property
    def modes(self) -> str:
        """Modes of a shaft that the archive has, as people read it; empty where it has none."""
        if self.parts or not any("mode" in self.dims(name) for name in self.outputs):
            return ""
        return str(modes_kept(self.scene, self.leaves))

    def wanted(self, stage: Stage) -> tuple[str, ...]:
        """Results of a stage that the plan uses."""
        # A name may have a formula in its place: the outcome of a speed that is followed in time
        made = self.computed
        return tuple(n for n in stage.node.gives if n in made and made[n].node.make is None)


@dataclass(frozen=True, eq=False)
class Part:
    """One ordinary scene out of several, and where its results belong."""

    plan: Plan  # Plan of the ordinary scene
    # Ascending positions of the part's points among those of all parts, along each dimension where
    # the part may lack some: dimensions of designs on which parts differ, and those that quantities
    # add.
    places: Mapping[str, Integers]
    # Dimensions along which the part's results repeat: for each position in the results of all
    # parts, the position in the part's own, or -1 where results are 0.
    own: Mapping[str, Integers] = field(default_factory=dict)


def make_plan(scene: Scene) -> Plan:
    """Plan a scene.

    Raises
    ------
    SceneError
        For modelled cycles none of which is one.
    """
    if isinstance(scene, SeveralEngines):
        return _plan_of_several(scene)
    points = points_of(scene, scene.cycles)
    leaves = leaves_of(scene, points)
    modes = modes_kept(scene, leaves)
    points["mode"] = np.arange(1, modes.kept + 1, dtype=np.int32)
    leaves["mode"] = Value(points["mode"], ("mode",))
    sizes = scene.sizes | {name: len(values) for name, values in points.items()}
    ancestors = _Ancestors(scene.node, (*scene.dimensions, *DIMENSIONS), leaves, sizes)
    for name in scene.quantities:
        ancestors.visit(name)
    outputs = list(scene.quantities)
    for stage in tuple(ancestors.stages.values()):
        outcome = stage.node.outcome
        if outcome == PERIODIC_STATUS and "no_transient" in scene.words:
            outcome = STATUS  # No other speed has an outcome
        if outcome and outcome not in outputs:
            outputs.append(outcome)
            ancestors.visit(outcome)
        for name in stage.node.beside:
            if name not in outputs:
                outputs.append(name)
                ancestors.visit(name)
    named: dict[str, Value | Stage] = {**leaves, **ancestors.stages}
    of_tables = frozenset(d for n in TABLE_QUANTITIES if n in named for d in named[n].dims)
    used = _used(scene, leaves, ancestors.used)
    unused = _unused(scene, leaves, used)
    chosen = {word for stage in ancestors.stages.values() for word in stage.node.when.split()}
    # A friction law is a word that selects variants, not a value that stages take.
    by_words = set() if chosen.isdisjoint(FRICTION_LAWS) else {"friction_law"}
    settings = tuple(key for key in scene.settings if key not in used | by_words)
    stages = tuple(ancestors.stages.values())
    if not any("mode" in stage.dims for stage in stages):
        settings += tuple(
            f"[output] {k}" for k in ("modes", "modes_below") if getattr(scene, k) is not None
        )
    settings += tuple(
        f"[[{feature.name}]]" if isinstance(scene.source[feature.name], list) else
        f"[{feature.name}]"
        for feature in FEATURES
        if scene.source.get(feature.name) and feature.constant and feature.constant not in used
    )  # fmt: skip
    drawn = None if scene.reduce is None else scene.sample  # A reduced sample comes in portions
    plan = Plan(
        scene, leaves, stages, points, sizes, tuple(outputs), unused, settings, of_tables,
        portions=range(1 if drawn is None else drawn.number // drawn.portion),
    )  # fmt: skip
    if scene.reduce is not None:
        _check_reduced(plan)
    for one in variations_of(scene, ancestors.stages, leaves, used, make_plan, plan.name):
        plan = _with_variation(plan, one)
    return plan


def _check_reduced(plan: Plan) -> None:
    """Check that reduced results have one number for each design, and are small enough."""
    # SceneError refuses curves as results, and statistics that keep axes with too many points.
    scene = plan.scene
    assert scene.reduce is not None
    for name in plan.outputs:
        added = [d for d in plan.dims(name) if d not in scene.dimensions]
        if added:
            raise SceneError(
                f"{plan.name}: [reduce] takes quantities of one number for each design; {name} "
                f"varies over {', '.join(added)}; leave it out, and compute it for the designs "
                "that are kept"
            )
    left = [d for d in scene.dimensions if d not in scene.reduce.over]
    cells = math.prod(plan.sizes[d] for d in left) * (len(plan.portions) if DESIGN in left else 1)
    if cells > MOST_CELLS:
        raise SceneError(
            f"{plan.name}: [reduce] over: leaves {' x '.join(left)}, {cells} points; must be at "
            f"most {MOST_CELLS}"
        )
    chosen = [d for d in left if d not in scene.reduce.at_every]
    if chosen and scene.reduce.kept:
        raise SceneError(
            f"{plan.name}: [reduce] over: leaves {', '.join(chosen)}, along which [reduce] keeps "
            f"designs; {chosen[0]} must be in over or at_every, or another scene keeps the designs"
        )


def _with_variation(plan: Plan, variation: Variation) -> Plan:
    """Add the variables computed from the results of this plan and of plans with other values."""
    dimension, keys = variation.dimension, variation.keys
    sizes = {**plan.sizes, dimension: len(keys)}
    stages = list(plan.stages)
    for result, node in variation.variables:
        dims = (*plan.dims(result), *node.adds)
        stages.append(Stage(node, dims, math.prod(sizes[d] for d in dims)))
    names = [node.name for _, node in variation.variables]
    return replace(
        plan,
        stages=tuple(stages),
        points={**plan.points, dimension: np.array(keys, dtype=object)},
        sizes=sizes,
        outputs=(*plan.outputs, *names),
        variations=(*plan.variations, variation),
        afterwards=plan.afterwards | set(names),
    )


def _plan_of_several(scene: SeveralEngines) -> Plan:
    """Plan of a scene of several engines: all their plans, and the dimensions of their results."""
    # An engine is not asked for quantities that it does not have: see `sweeps.scene.reading`.
    plans = [make_plan(one) for one in scene.each]
    points, places = _points_of_several([made.points for made in plans])
    apart = frozenset(scene.places[0])
    sizes = scene.sizes | {name: len(values) for name, values in points.items()}
    stages = _stages_of_several(scene, plans, sizes, apart)
    outputs = [name for name in scene.quantities if name in stages]
    kept = [STATUS, *(name for node in stages.values() for name in node.node.beside)]
    outputs += [n for n in kept if n not in outputs and any(n in made.outputs for made in plans)]
    names = {name: None for made in plans for name in made.leaves}
    leaves = {name: next(p.leaves[name] for p in plans if name in p.leaves) for name in names}
    return Plan(
        scene, leaves, tuple(stages.values()), points, sizes, tuple(outputs),
        tuple(n for n in plans[0].unused if all(n in made.unused for made in plans)),
        tuple(n for n in plans[0].unused_settings
              if (n in scene.settings or n.startswith("["))
              and all(n in made.unused_settings for made in plans)),
        frozenset(d for made in plans for d in made.of_tables) | apart,
        parts=tuple(
            Part(made, {**own, **of_points})
            for made, own, of_points in zip(plans, scene.places, places, strict=True)
        ),
    )  # fmt: skip


def _stages_of_several(
    scene: Scene, plans: Sequence[Plan], sizes: Mapping[str, int], apart: frozenset[str]
) -> dict[str, Stage]:
    """Stages of all plans, each on the dimensions that it has in any of them, and on `apart`."""
    dims: dict[str, set[str]] = {}
    nodes: dict[str, Node] = {}
    for made in plans:
        for stage in made.stages:
            nodes.setdefault(stage.node.name, stage.node)
            dims.setdefault(stage.node.name, set(apart)).update(stage.dims)
    stages = {}
    for name, node in nodes.items():
        ordered = tuple(d for d in (*scene.dimensions, *DIMENSIONS) if d in dims[name])
        stages[name] = Stage(node, ordered, math.prod(sizes[d] for d in ordered))
    return stages


Points = Mapping[str, npt.NDArray[Any]]


def _points_of_several(each: Sequence[Points]) -> tuple[Points, list[dict[str, Integers]]]:
    """Points of all engines, and the places of each engine's points among them."""
    joined: dict[str, npt.NDArray[Any]] = {}
    places: list[dict[str, Integers]] = [{} for _ in each]
    for name, first in each[0].items():
        own = [points[name] for points in each]
        if all(np.array_equal(first, other) for other in own):
            joined[name], here = first, [np.arange(len(first))] * len(own)
        else:  # Points are equal if nine decimals agree
            rounded = [np.round(values, 9) for values in own]
            union, at = np.unique(np.concatenate(rounded), return_index=True)
            joined[name] = np.concatenate(own)[at]
            here = [np.searchsorted(union, values) for values in rounded]
        for part, positions in zip(places, here, strict=True):
            part[name] = positions
    return joined, places


class _Ancestors:
    """The stages that quantities need, and the leaves that these use."""

    def __init__(
        self, node: Callable[[str], Node], order: tuple[str, ...], leaves: Mapping[str, Value],
        sizes: Mapping[str, int],
    ) -> None:  # fmt: skip
        self.node = node
        self.order = order
        self.leaves = leaves
        self.sizes = sizes
        self.stages: dict[str, Stage] = {}
        self.used: set[str] = set()

    def visit(self, name: str) -> tuple[str, ...]:
        """Add a node and all that it needs, in the order of computing; returns its dimensions."""
        if name in self.leaves:
            self.used.add(name)
            return self.leaves[name].dims
        if name in self.stages:
            return self.stages[name].dims
        node = self.node(name)
        dims: set[str] = set(node.adds)
        for need in node.needs:
            here = self.visit(need)
            # A kernel takes all points of a dimension at once: among its results only curves have
            # that dimension.
            dims.update(set(here) - DIMENSIONS.keys() if node.kind == "stage" else here)
        dims.difference_update(node.removes)
        ordered = tuple(d for d in self.order if d in dims)
        size = math.prod(self.sizes[d] for d in ordered)
        self.stages[name] = Stage(node, ordered, size)
        return ordered


def _used(scene: Scene, leaves: Mapping[str, Value], used: set[str]) -> set[str]:
    """Leaves that the stages use, and the parameters from which some of them follow."""
    used = set(used)
    if "cycle" in used:
        used.update(scene.cycle_keys)
    if "cylinder_set" in used:
        varying = set(leaves["cylinder_set"].dims)
        keys = ("cylinders", "misfire", *scene.cylinder_set_keys)
        used.update(key for key in keys if set(leaves[key].dims) <= varying)
    return used


def _unused(scene: Scene, leaves: Mapping[str, Value], used: set[str]) -> tuple[str, ...]:
    """Axes and columns of designs without effect, where the stages use given leaves."""
    touched = {d for name in used for d in leaves[name].dims}
    unused = tuple(d for d in scene.dimensions if d not in touched)
    if DESIGN in touched:
        unused += tuple(c for c in scene.designs if c not in used)
    return unused
