"""The batch solver: what its series leave, and which of several valleys holds the extreme."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from engine_dyn import diagram_from_points, family_from_diagrams
from engine_dyn.speed import dispatch
from engine_dyn.speed.batch import powers, recurrence, two_grid
from engine_dyn.speed.batch.state import LANES
from engine_dyn.speed.mean_gas import mean_gas_torque
from oracle.designs import SmoothPressure, table

pytestmark = pytest.mark.quick

PRESSURE = SmoothPressure(
    charge=1.0, compression=1.0, ratio=14.0, polytropic=1.33,
    burn=40.0, burn_angle=math.radians(10.0), burn_order=120,
    after=6.0, after_angle=math.radians(45.0), after_order=30,
)  # fmt: skip

U = np.linspace(-powers.SERIES_RANGE, powers.SERIES_RANGE, 401)


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


def of_each(formula: object) -> np.ndarray:
    python = getattr(formula, "py_func", formula)
    return np.array([python(u) for u in U])  # type: ignore[operator]


def test_series_are_as_good_as_they_say() -> None:
    roots = np.array([math.sqrt(1.0 + u) - 1.0 - 0.5 * u for u in U])
    assert np.abs(of_each(powers.root_remainder) - roots).max() < 2e-10
    rising = np.array([0.5 / math.sqrt(1.0 + u) - 0.5 for u in U])
    slope = getattr(powers.root_slope, "py_func", powers.root_slope)
    assert np.abs([slope(u, 0.0) for u in U] - rising).max() < 2e-5
    assert slope(0.1, 0.3) - slope(0.1, 0.0) == pytest.approx(-0.15)
    logarithm = getattr(powers.log_of, "py_func", powers.log_of)
    wide = np.linspace(powers.DEEPEST, powers.HIGHEST, 401)
    assert max(abs(logarithm(u) - math.log1p(u)) for u in wide) < 2e-13


@pytest.mark.parametrize("nodes", [4, 24, two_grid.MOST_IN_SERIES])
def test_the_work_of_a_period_is_a_polynomial_of_the_load(nodes: int) -> None:
    """Where y' = -beta y + work ends after a period: one exponential of each interval's work."""
    coarse = np.random.default_rng(nodes).normal(size=(nodes, two_grid.NODE_FIELDS))
    constants = np.zeros(two_grid.CONSTANTS)
    two_grid.fill_series_of_work(coarse, constants)
    series = getattr(recurrence.work_series, "py_func", recurrence.work_series)
    behind = np.arange(nodes)[::-1]
    for field, first in (
        (two_grid.WORK, two_grid.WORK_SERIES),
        (two_grid.SQUARES, two_grid.SQUARES_SERIES),
    ):
        size = np.abs(coarse[:, field]).sum()
        for x in np.linspace(0.0, two_grid.LARGEST_STEP, 31):
            end = np.sum(coarse[:, field] * np.exp(-x * behind))
            found = series(2.0 * x / two_grid.LARGEST_STEP - 1.0, first, constants)
            assert found == pytest.approx(end, abs=1e-11 * size)


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


@pytest.mark.parametrize("half", [0.25, 0.5, 0.8, 1.3, 2.5, 5.0])
def test_series_of_powers_are_as_good_as_they_say(half: float) -> None:
    terms = powers.SERIES_TERMS
    series = np.zeros(powers.SERIES_ROWS)
    coefficients = [half * (half - 1.0) / 2.0]
    for i in range(3, terms + 2):
        coefficients.append(coefficients[-1] * (half - i + 1.0) / i)
    series[::LANES] = coefficients
    value = getattr(powers.power_remainder, "py_func", powers.power_remainder)
    slope = getattr(powers.power_slope, "py_func", powers.power_slope)
    remainder = (1.0 + U) ** half - 1.0 - half * U
    rising = half * ((1.0 + U) ** (half - 1.0) - 1.0)
    assert np.abs([value(u, 0, series) for u in U] - remainder).max() < 1e-11
    assert np.abs([slope(u, half, 0.0, 0, series) for u in U] - rising).max() < 2e-5
    turned = slope(0.1, half, 0.3, 0, series) - slope(0.1, half, 0.0, 0, series)
    assert turned == pytest.approx(-0.3 * half)


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
