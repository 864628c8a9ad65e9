"""Times of the kernels by pytest-benchmark, so that a slow-down shows: `make bench-kernels`.

To compare with an earlier state: `pytest benchmarks/test_kernels.py --benchmark-autosave`, then
again with `--benchmark-compare`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sweeps
from benchmarks import problem
from benchmarks.problem import answer
from benchmarks.studies import STUDIES, Study
from engine_dyn import periodic_speed
from engine_dyn.speed.mean_gas import mean_gas_torque
from engine_dyn.speed.torque import torque_extremes

THREADS = 1  # the kernels, not the system's scheduling
SIZE = 8000


@pytest.mark.parametrize("variable", [False, True], ids=["constant", "variable"])
@pytest.mark.parametrize("cylinders", [1, 4, 8])
@pytest.mark.parametrize("exponent", [0.0, 1.0, 1.6, 2.0])
def test_factorial(benchmark: Any, exponent: float, cylinders: int, variable: bool) -> None:
    source = problem.scene(SIZE, exponent, cylinders, variable)
    answer(source, THREADS)
    delta = benchmark(answer, source, THREADS)["delta"]
    benchmark.extra_info["designs"] = len(source)
    assert np.isfinite(delta).all()


@pytest.mark.parametrize("exponent", [0.0, 1.0, 1.6, 2.0])
def test_table(benchmark: Any, exponent: float) -> None:
    source = problem.table(500, (exponent,))
    answer(source, THREADS)
    assert np.isfinite(benchmark(answer, source, THREADS)["delta"]).all()


@pytest.mark.parametrize("method", ["newton", "thesis"])
def test_method(benchmark: Any, method: str) -> None:
    source = problem.table(4, (1.0, 2.0))  # thesis repeats hundreds of cycles
    answer(source, THREADS, method=method)
    assert np.isfinite(benchmark(answer, source, THREADS, method=method)["delta"]).all()


@pytest.mark.parametrize("one", STUDIES, ids=lambda one: one.name)
def test_study(benchmark: Any, one: Study) -> None:
    """Every kind of study, and so every way in which designs are solved."""
    scene = one.build(200 if one.modelled else 2000)
    sweeps.run(scene, threads=THREADS)
    found = benchmark(sweeps.run, scene, threads=THREADS)
    benchmark.extra_info["designs"] = found["delta"].size
    assert np.isfinite(found["delta"]).all()


def test_traces(benchmark: Any) -> None:
    source, phi = problem.scene(1000, 2.0), np.linspace(0.0, 4.0 * np.pi, 720, endpoint=False)
    omega = benchmark(answer, source, THREADS, ("omega",), crank_angle=phi)["omega"]
    assert np.isfinite(omega).all()


def test_mean_gas_torque(benchmark: Any) -> None:
    ratio = np.linspace(0.2, 0.33, 1000)
    assert np.isfinite(benchmark(mean_gas_torque, ratio, 0.0, problem.family())).all()


def test_torque_extremes(benchmark: Any) -> None:
    source = problem.scene(1000, 2.0)
    given = problem.own_inputs(source)
    for name in ("exponent", "offset", "mean_torque", "inertia", "inertia_model"):
        del given[name]
    result = benchmark(torque_extremes, wanted=("torque_max",), threads=THREADS, **given)
    assert np.isfinite(result["torque_max"]).all()


def test_periodic_speed(benchmark: Any) -> None:
    one = benchmark(
        periodic_speed, problem.diagram(), bore=problem.BORE, stroke=problem.STROKE,
        crank_ratio=0.2571, reciprocating_mass=6.67, inertia=2.0, speed=125.66,
        friction_torque=30.0,
    )  # fmt: skip
    assert one.status == 0


def test_run_of_one_design(benchmark: Any) -> None:
    archive = benchmark(sweeps.run, {"engine": "ntua", "output": {"quantities": ["delta"]}})
    assert int(archive["status"]) == 0
