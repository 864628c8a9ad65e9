"""Nodes of a period: fine ones, at which columns are known, and coarse ones among them."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["FEWEST_NODES", "WIDE", "Nodes", "nodes_of"]

FEWEST_NODES = 720
"""Least number of nodes of a cycle: one a degree, the step of most measured diagrams."""

FEWEST_COARSE = 60
"""Least number of coarse nodes of a period."""

WIDE, NARROW, STEEP = 5, 4, 3
"""Fine intervals of a coarse one, where there are many and few, and where the torque answers
steeply to the speed, as that of a motor: its error falls with the fifth power of the width."""


class Nodes(NamedTuple):
    """Nodes of a period of torque and load.

    Attributes
    ----------
    number, stride : int
        How many, and fine intervals of a coarse one.
    times : int
        How often the engine's own torque repeats in its cycle, or in the cycles of its firing
        pattern, as far as that is used.
    cycles : int
        Such repeats in the period: above 1 where the load needs longer than the engine.
    """

    number: int
    stride: int
    times: int
    cycles: int = 1

    @property
    def of_engine(self) -> int:
        """Nodes of one of the engine's repeats."""
        return self.number // self.cycles

    @property
    def of_cycle(self) -> int:
        """Nodes of the engine's cycle."""
        return self.of_engine * self.times

    def width(self, cycle: float) -> float:
        """Width of a fine interval, where the engine's cycle is `cycle` [rad]."""
        return cycle / self.of_cycle


def nodes_of(times: int, fewest: int, steep: bool = False, cycles: int = 1) -> Nodes:
    """Nodes of a period, with `fewest` in the engine's cycle; arguments as of `Nodes`.

    Laws that are `steep` have narrower coarse intervals.
    """
    each = -(-fewest // times)
    stride = WIDE if each >= FEWEST_COARSE * WIDE else NARROW
    stride = STEEP if steep else stride
    coarse = max(-(-each // stride), FEWEST_COARSE)
    coarse += coarse * stride % 2  # even, so that every other node tells whether all suffice
    return Nodes(coarse * stride * cycles, stride, times, cycles)
