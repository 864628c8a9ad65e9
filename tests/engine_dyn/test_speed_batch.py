"""Which of several valleys of the speed holds the extreme."""

import math
from typing import Any

import numpy as np
import pytest

from engine_dyn import diagram_from_points, family_from_diagrams
from engine_dyn.speed import dispatch
from engine_dyn.speed.mean_gas import mean_gas_torque
from oracle.designs import SmoothPressure, table

pytestmark = pytest.mark.quick

PRESSURE = SmoothPressure(
    charge=1.0, compression=1.0, ratio=14.0, polytropic=1.33,
    burn=40.0, burn_angle=math.radians(10.0), burn_order=120,
    after=6.0, after_angle=math.radians(45.0), after_order=30,
)  # fmt: skip


@pytest.mark.parametrize("method", ["auto", "newton"])
def test_of_two_valleys_the_deeper_one_counts(method: str) -> None:
    """The lower node lies in the other valley: 3e-7 of the speed would be missed."""
    degrees, bar = table(PRESSURE)
    family = family_from_diagrams([0.0], [diagram_from_points(np.radians(degrees), bar * 1e5)])
    gas = float(mean_gas_torque(0.2571, 0.0, family))
    inputs: dict[str, Any] = {
        "family": family, "row": 0.0, "scale": 1.0, "crankcase_pressure": 1e5, "bore": 0.14,
        "double_radius": 0.18, "offset": 0.0, "crank_ratio": 0.2571, "exponent": 2.0,
        "mass": 5.6666666667, "speed": 193.33333333, "inertia": 1.8066586629,
        "friction_torque": 180.0, "cylinders": 6, "inertia_model": "variable",
        "mean_torque": 6.0 * 0.25 * math.pi * 0.14**2 * 0.09 * gas - 180.0,
    }  # fmt: skip
    angles = np.linspace(0.0, 2.0 * math.pi / 3.0, 2401)
    found = dispatch.solve(wanted=("omega_min",), method=method, **inputs)
    curve = dispatch.solve(
        wanted=("omega",), method="newton", finer=4, tolerance=1e-9, crank_angle=angles, **inputs
    )["omega"]
    assert found["omega_min"].item() == pytest.approx(curve.min(), rel=1e-8)
