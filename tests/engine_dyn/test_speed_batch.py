"""The batch solver: what its series leave, and which of several valleys holds the extreme."""

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


def product(
    inertia: np.ndarray,
    speed: np.ndarray,
    mass: np.ndarray,
    exponent: float,
    cylinders: int,
    variable: bool,
    friction: float,
) -> dict[str, Any]:
    """Keywords of `dispatch.solve`: inertia x speed x mass of one engine."""
    degrees, bar = table(PRESSURE)
    family = family_from_diagrams([0.0], [diagram_from_points(np.radians(degrees), bar * 1e5)])
    gas = mean_gas_torque(0.2571, 0.0, family)
    return {
        "family": family, "row": 0.0, "scale": 1.0, "crankcase_pressure": 1e5, "bore": 0.14,
        "double_radius": 0.18, "offset": 0.0, "crank_ratio": 0.2571, "exponent": exponent,
        "mass": mass[None, None, :], "speed": speed[None, :, None],
        "inertia": inertia[:, None, None], "friction_torque": friction, "cylinders": cylinders,
        "inertia_model": "variable" if variable else "constant",
        "mean_torque": cylinders * 0.25 * math.pi * 0.14**2 * 0.09 * gas - friction,
    }  # fmt: skip


@pytest.mark.parametrize("method", ["auto", "newton"])
def test_of_two_valleys_the_deeper_one_counts(method: str) -> None:
    # The lower node lies in the other valley: 3e-7 of the speed would be missed.
    inputs = product(
        inertia=np.array([1.8066586629]),
        speed=np.array([193.33333333]),
        mass=np.array([5.6666666667]),
        exponent=2.0,
        cylinders=6,
        variable=True,
        friction=180.0,
    )
    angles = np.linspace(0.0, 2.0 * math.pi / 3.0, 2401)
    found = dispatch.solve(wanted=("omega_min",), method=method, **inputs)
    curve = dispatch.solve(
        wanted=("omega",), method="newton", finer=4, tolerance=1e-9, crank_angle=angles, **inputs
    )["omega"]
    assert found["omega_min"].item() == pytest.approx(curve.min(), rel=1e-8)


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("cylinders", "variable", "exponent"),
    [(2, False, 2.0), (4, False, 3.0), (1, True, 1.0), (2, True, 0.0), (4, True, 0.0),
     (4, True, 2.0)],
)  # fmt: skip
def test_strong_fluctuations_are_as_good_as_they_say(
    cylinders: int, variable: bool, exponent: float
) -> None:
    # Light flywheels at high and low speed: up to where the speed falls to nothing.
    inputs = product(
        inertia=cylinders * np.geomspace(0.05, 40.0, 40),
        speed=np.geomspace(10.0, 400.0, 21),
        mass=np.linspace(0.5, 9.0, 5),
        exponent=exponent,
        cylinders=cylinders,
        variable=variable,
        friction=5.0 * cylinders,
    )
    speeds = ("omega_max", "omega_min", "omega_mean", "delta")
    found = dispatch.solve(wanted=(*speeds, "status"), **inputs)
    exact = dispatch.solve(wanted=(*speeds, "status"), method="newton", finer=4, **inputs)
    good = (found["status"] == 0) & (exact["status"] == 0)
    assert good.sum() > 0.5 * good.size
    for name in speeds:
        assert found[name][good] == pytest.approx(exact[name][good], rel=1e-6)
