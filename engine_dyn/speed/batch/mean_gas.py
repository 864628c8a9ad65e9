"""Mean gas torques interpolated between crank ratios."""

from __future__ import annotations

import math

from engine_dyn.compilation import kernel
from engine_dyn.speed.batch import panels
from engine_dyn.types import Floats, Integers

__all__ = ["mean_gas_between", "panels_of"]


@kernel
def panels_of(ratio: Floats, number: Integers) -> None:
    """Panel of every crank ratio."""
    for i in range(ratio.size):
        number[i] = panels.panel_at(ratio[i], 1)


@kernel
def mean_gas_between(
    ratio: Floats, row: Floats, number: Integers, row_of: Integers, points: Floats, means: Floats,
    result: Floats,
) -> None:  # fmt: skip
    """As `mean_gas_of_pairs`, from `means` (panel, point, diagram) at the points of each panel."""
    for i in range(ratio.size):
        whole = int(math.floor(row[i]))
        weight = row[i] - whole
        first = row_of[whole]
        second = row_of[whole + 1] if weight > 0.0 else first
        here = points[number[i]]
        total = 0.0
        for j in range(here.shape[1]):
            share = panels.share_of(j, ratio[i], here)
            mean = means[number[i], j]
            total += share * ((1.0 - weight) * mean[first] + weight * mean[second])
        result[i] = total
