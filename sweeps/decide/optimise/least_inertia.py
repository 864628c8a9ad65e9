"""The least inertia under a limit of delta follows exactly: no search is needed for it.

Delta falls as the inertia grows. So the least inertia with which delta is at most a limit at every
point is the largest of those that give this delta at each point (Kakaitsas, section 3.2.2; the
search for a root in `engine_dyn.speed.required`). This holds where nothing else that the search is
about changes with the inertia: a heavier design could then never be needed, nor better.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine_dyn.quantities.graph import ALL_QUANTITIES
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import SceneError
from sweeps.decide.optimise.task import Task, plan_of_designs
from sweeps.running.compute.in_memory import compute
from sweeps.scene.distributions import Choice
from sweeps.scene.features import GIVEN_FEATURES
from sweeps.scene.plan.plan import Plan

KEY, LIMITED, WANTED, FOUND = "inertia", "delta", "wanted_delta", "inertia_required"


@dataclass(frozen=True, eq=False)
class LeastInertia:
    """Designs of all other parameters, each with the least inertia that meets the wanted delta."""

    task: Task  # Search that asks for the designs
    limit: float  # The largest delta that is allowed
    threads: int | None  # For the kernels

    def completed(self, columns: Mapping[str, Any]) -> dict[str, Any]:
        """Columns of all parameters: those given, and the inertia."""
        count = len(next(iter(columns.values()))) if columns else 1
        plan = self.plan(columns, count)
        results = compute(plan, threads=self.threads)
        dims = plan.dims(FOUND)
        inertia = results[FOUND]
        if DESIGN in dims:
            inertia = np.moveaxis(inertia, dims.index(DESIGN), 0).reshape(count, -1)
        # Points without an inertia are those where every inertia is enough, or none: the design is
        # computed there like all others.
        axis = -1 if DESIGN in dims else None
        largest = np.fmax.reduce(inertia, axis=axis, initial=-np.inf)
        law = self.task.space.parameters[KEY]
        assert not isinstance(law, Choice)
        least = np.clip(np.broadcast_to(largest, count), law.low, law.high)  # type: ignore[attr-defined]
        return {
            key: np.array(least, dtype=np.float64) if key == KEY else columns[key]
            for key in self.task.space.parameters
        }

    def plan(self, columns: Mapping[str, Any], count: int) -> Plan:
        """Plan of the inertia that some designs of all other parameters need."""
        task = self.task
        # Delta of the inertia that is found misses the wanted one by a tenth of the tolerance at
        # most; this keeps it at or below the limit.
        aim = self.limit * (1.0 - self.tolerance)
        settings = {**(task.given.raw.get("set") or {}), WANTED: aim}
        return plan_of_designs(
            task.given, task.space.without(KEY), columns, count, task.seed, task.files,
            set=settings, output={"quantities": [FOUND]},
        )  # fmt: skip

    @property
    def tolerance(self) -> float:
        """Relative error of delta that the scene aims at."""
        solver = self.task.given.raw.get("solver") or {}
        return float(solver.get("tolerance", 1e-6))


def least_inertia_of(task: Task, threads: int | None) -> LeastInertia | None:
    """The exact inverse, where a task has one; None where the inertia must be searched."""
    law = task.space.parameters.get(KEY)
    limits = [c.limit for c in task.conditions if c.name == LIMITED and c.above]
    if (KEY, 1.0) not in task.wanted or law is None or isinstance(law, Choice) or not limits:
        return None
    inertia_alone = [c for c in task.conditions if c.name == KEY]
    if min(limits) <= 0.0 or inertia_alone or not hasattr(law, "low"):
        return None
    names = [n for n, _ in task.wanted if n != KEY]
    names += [c.name for c in task.conditions if not (c.name == LIMITED and c.above)]
    inverse = LeastInertia(task, min(limits), threads)
    few = task.space.without(KEY).one_of_each()
    try:
        if any(_changes_with_inertia(task, name) for name in names if name in ALL_QUANTITIES):
            return None
        plan = inverse.plan(task.space.without(KEY).columns(few), len(few))
    except SceneError:  # a scene whose inertia is not one number, a method that searches nothing
        return None
    # The inertia that is found has what parts add to it, the key `inertia` has not.
    parts = (one for one in GIVEN_FEATURES.values() if one.feature.adds)
    return None if any(one.part_of(plan.scene) is not None for one in parts) else inverse


def _changes_with_inertia(task: Task, name: str) -> bool:
    """Whether a quantity depends on the inertia: then it has it as a dimension."""
    space = task.space.without(KEY)
    law: Any = task.space.parameters[KEY]
    few = space.one_of_each()
    axes = {**(task.given.raw.get("axes") or {}), KEY: [law.low, law.high]}
    plan = plan_of_designs(
        task.given, space, space.columns(few), len(few), task.seed, task.files,
        axes=axes, output={"quantities": [name]},
    )  # fmt: skip
    return KEY in plan.dims(name)
