"""Portions of a sample: designs that are drawn, planned and reduced some at a time.

Each portion is a scene of its own with its own designs, so that nothing but the number of portions
grows with the sample.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

from sweeps.dimensions import DESIGN
from sweeps.planning.plan import Plan, make_plan
from sweeps.scene.consistency.whole import check_scene
from sweeps.scene.sample import Drawing

__all__ = ["Portions"]


@dataclass(frozen=True)
class Portions:
    """The portions of a plan; the plan itself is the only one where its designs are all there.

    Attributes
    ----------
    plan : Plan
        Of the first portion.
    """

    plan: Plan
    _drawing: list[Drawing] = field(default_factory=list, repr=False)

    @cached_property
    def length(self) -> int:
        """Designs of a portion along `design`."""
        return self.plan.sizes.get(DESIGN, 1)

    def plans(self, numbers: range) -> Iterator[tuple[int, Plan]]:
        """Plans of some portions, each with its first design."""
        for number in numbers:
            first = number * self.length
            yield first, self.plan if number == self.plan.portions[0] else self._of(number)

    def _of(self, number: int) -> Plan:
        scene = self.plan.scene
        assert scene.sample is not None
        if not self._drawing:
            self._drawing.append(Drawing(scene.sample))
        points = scene.sample.portion
        columns = self._drawing[0].columns(number * points, points)
        scene = replace(scene, designs=columns)
        check_scene(scene, self.plan.name)
        return make_plan(scene)
