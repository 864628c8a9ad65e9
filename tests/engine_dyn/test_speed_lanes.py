"""Lanes: what their series leave, and which of several hills holds the extreme."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks import problem
from engine_dyn.speed import lanes, sweep

U = np.linspace(-lanes.SERIES_RANGE, lanes.SERIES_RANGE, 401)


def of_each(formula: object) -> np.ndarray:
    python = getattr(formula, "py_func", formula)
    return np.array([python(u) for u in U])  # type: ignore[operator]


def test_series_are_as_good_as_they_say() -> None:
    roots = np.array([math.sqrt(1.0 + u) - 1.0 - 0.5 * u for u in U])
    assert np.abs(of_each(lanes.root_series) - roots).max() < 1e-11
    logarithm = getattr(lanes.log_of, "py_func", lanes.log_of)
    wide = np.linspace(lanes.DEEPEST, lanes.HIGHEST, 401)
    assert max(abs(logarithm(u) - math.log1p(u)) for u in wide) < 2e-13


@pytest.mark.parametrize("method", ["auto", "newton"])
def test_of_two_valleys_the_deeper_one_counts(method: str) -> None:
    # The lower node lies in the other valley: 3e-7 of the speed would be missed.
    scene = problem.Scene(
        inertia=np.array([1.8066586629]),
        speed=np.array([193.33333333]),
        mass=np.array([5.6666666667]),
        exponent=2.0,
        cylinders=6,
        variable=True,
    )
    inputs = problem.own_inputs(scene, problem.family())
    angles = np.linspace(0.0, 2.0 * math.pi / 3.0, 2401)
    found = sweep.solve(wanted=("omega_min",), method=method, **inputs)
    curve = sweep.solve(
        wanted=("omega",), method="newton", finer=4, tolerance=1e-9, crank_angle=angles, **inputs
    )["omega"]
    assert found["omega_min"].item() == pytest.approx(curve.min(), rel=1e-8)
