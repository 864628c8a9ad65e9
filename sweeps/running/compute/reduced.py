"""Runs that are reduced as they are computed: no more than a block of designs exists at a time.

The blocks of all portions come in units, whose reductions are what a run into an archive keeps on
the disk, and what workers compute; so resuming, shards and clusters are those of any run.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

from sweeps.running.archive.labels import Labels
from sweeps.running.compute.computation import Computation
from sweeps.running.compute.limits import LARGEST_BLOCK
from sweeps.running.compute.progress import progress_bar
from sweeps.running.reduce.reduction import Reduction, State
from sweeps.scene.plan.blocks import block_count, blocks, lengths_within, shape_in
from sweeps.scene.plan.plan import Plan
from sweeps.scene.plan.shards import Portions

if TYPE_CHECKING:
    import xarray as xr

# Largest number of units of a run; an interrupted run loses the unit that it was computing
MOST_UNITS = 256


class Units:
    """The blocks of all portions of a plan, in units that are reduced one after the other."""

    def __init__(
        self, plan: Plan, lengths: Mapping[str, int], *, labels: Labels | None = None,
        threads: int | None = None, device: str = "cpu", progress: bool = False,
    ) -> None:  # fmt: skip
        self.plan, self.lengths, self.labels = plan, lengths, labels
        self.threads, self.device, self.progress = threads, device, progress
        self.each = block_count(plan, lengths)
        self.pieces = self.each * len(plan.portions)
        self.portions = Portions(plan)

    def __len__(self) -> int:
        return min(MOST_UNITS, self.pieces)

    def empty(self) -> Reduction:
        """Reduction of nothing, to which units are added."""
        reduction = Reduction(self.plan, self.labels)
        self.labels = reduction.labels
        return reduction

    def states(self, numbers: list[int]) -> Iterator[tuple[int, State]]:
        """Reduce units; yields each with its number."""
        with progress_bar(
            total=self.plan.designs, unit_scale=True,
            unit=" points" if self.plan.points_each > 1 else " designs",
            disable=not self.progress, file=sys.stderr,
        ) as bar:  # fmt: skip
            for number in numbers:
                reduction = self.empty()
                self._add(reduction, number, bar.update)
                yield number, reduction.state()

    def _add(self, reduction: Reduction, number: int, show: Callable[[int], object]) -> None:
        """Add the blocks of a unit, and show the progress within blocks too."""
        left = 0

        def show_some(done: int) -> None:
            nonlocal left
            done = min(done, left)
            left -= done
            show(done)

        many = len(self)
        begin, end = (self.pieces * n // many for n in (number, number + 1))
        portions = self.plan.portions[begin // self.each : -(-end // self.each)]
        piece = begin // self.each * self.each
        for first, plan in self.portions.plans(portions):
            with Computation(
                plan, self.lengths, progress=show_some if self.progress else False,
                threads=self.threads, device=self.device, all_in_each=True,
            ) as computation:  # fmt: skip
                for block in blocks(plan, self.lengths):
                    if begin <= piece < end:
                        left = math.prod(shape_in(plan, plan.scene.dimensions, block))
                        reduction.add(plan, first, block, computation.results(block))
                        show(left)
                    piece += 1


def reduced(
    plan: Plan, *, progress: bool = False, threads: int | None = None, device: str = "cpu"
) -> xr.Dataset:
    """The reduction that [reduce] asks for, of a plan that is computed in memory."""
    units = Units(
        plan, lengths_within(plan, LARGEST_BLOCK), threads=threads, device=device,
        progress=progress,
    )  # fmt: skip
    whole, began = units.empty(), time.perf_counter()
    for _, state in units.states([*range(len(units))]):
        whole.merge(state)
    return whole.dataset(time.perf_counter() - began)
