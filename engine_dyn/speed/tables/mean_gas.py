"""Mean gas torque of a cylinder, by quadrature of its diagram."""

from __future__ import annotations

import math

from engine_dyn.compilation import kernel
from engine_dyn.loads.friction import FRICTIONLESS
from engine_dyn.speed.tables import work_tables
from engine_dyn.speed.tables.pressure_grid import Grid
from engine_dyn.speed.tables.work_tables import Blend
from engine_dyn.types import Floats, Integers

__all__ = ["mean_gas_of_pairs"]


@kernel
def mean_gas_of_pairs(
    ratio: Floats, offset: Floats, row: Floats, row_of: Integers, grid: Grid, rates: Floats,
    result: Floats,
) -> None:  # fmt: skip
    """Mean over angle of p c/(r omega) [Pa], one cylinder, for paired ratios, offsets and rows.

    The mean of docs/method.md (29). `rates` is scratch.
    """
    for i in range(ratio.size):
        whole = int(math.floor(row[i]))
        weight = row[i] - whole
        first = row_of[whole]
        second = row_of[whole + 1] if weight > 0.0 else first
        blend = Blend(first, second, weight, 1.0, 0.0, FRICTIONLESS)
        work_tables.rates_of_member(ratio[i], offset[i], blend, grid, 0, rates)
        result[i] = work_tables.mean_rate(rates)
