"""Portions of a sample: designs that are drawn, planned and reduced some at a time.

Each portion is a scene of its own with its own designs, so that nothing but the number of portions
grows with the sample.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

from sweeps.base.dimensions import DESIGN
from sweeps.scene.consistency.whole import check_scene
from sweeps.scene.plan.plan import Plan, make_plan
from sweeps.scene.sample import Drawing

__all__ = ["Portions"]


class Portions:
    """The portions of a plan, in order; the plan itself is the first, and often the only one."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan

    @cached_property
    def _drawing(self) -> Drawing:
        """The sample while it is drawn, which is fastest in order."""
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
