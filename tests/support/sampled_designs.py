"""Random designs that have no table in common, for solvers of the periodic speed."""

from typing import Any

import numpy as np

from engine_dyn.pressure.diagram import diagram_from_points
from engine_dyn.pressure.family import Family, family_from_diagrams
from engine_dyn.speed.torque import mean_gas_torque
from oracle.designs import table
from tests.support.held_out import BAR, design_of


def three_loads() -> Family:
    """One diagram at three loads, scaled."""
    degrees, bar = table(design_of("alpha 1, constant, 1 cyl, power_mean").pressure)
    factors = (0.9, 1.0, 1.3)
    return family_from_diagrams(
        [10.0, 11.0, 13.0],
        [diagram_from_points(np.radians(degrees), f * bar * BAR) for f in factors],
    )


def sampled_designs(
    family: Family, count: int, cylinders: Any, *, seed: int, largest_ratio: float, exponent: Any
) -> dict[str, Any]:
    """Keywords of `dispatch.solve`."""
    random = np.random.default_rng(seed)
    ratio = random.uniform(0.02, largest_ratio, count)
    row = random.uniform(0.0, family.row_count - 1.0, count)
    lever = 0.25 * np.pi * 0.1**2 * 0.05
    return {
        "family": family, "crank_ratio": ratio, "row": row, "cylinders": cylinders, "bore": 0.1,
        "scale": random.uniform(0.8, 1.2, count), "double_radius": 0.1, "friction_torque": 0.0,
        "crankcase_pressure": random.uniform(0.0, 1.2e5, count), "offset": 0.0,
        "mass": random.uniform(0.3, 1.0, count), "speed": random.uniform(150.0, 400.0, count),
        "inertia": cylinders * random.uniform(0.6, 3.0, count), "exponent": exponent,
        "mean_torque": 0.8 * cylinders * lever * mean_gas_torque(ratio, row, family),
    }  # fmt: skip
