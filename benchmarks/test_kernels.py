"""Times of the kernels by pytest-benchmark, so that a slow-down shows: `make bench-kernels`.

Every kind of study is one of them, and so every way in which designs are solved.

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
from engine_dyn.speed.torque import torque_extremes

THREADS = 1  # the kernels, not the system's scheduling


@pytest.mark.parametrize("method", ["newton", "thesis"])
def test_method(benchmark: Any, method: str) -> None:
    source = problem.table(4, (1.0, 2.0))  # thesis repeats hundreds of cycles
    answer(source, THREADS, method=method)
    assert np.isfinite(benchmark(answer, source, THREADS, method=method)["delta"]).all()


@pytest.mark.parametrize("one", STUDIES, ids=lambda one: one.name)
def test_study(benchmark: Any, one: Study) -> None:
    scene = one.build(200 if one.modelled else 2000)
    sweeps.run(scene, threads=THREADS)
    found = benchmark(sweeps.run, scene, threads=THREADS)
    benchmark.extra_info["designs"] = found["delta"].size
    assert np.isfinite(found["delta"]).all()


def test_traces(benchmark: Any) -> None:
    source, phi = problem.scene(1000, 2.0), np.linspace(0.0, 4.0 * np.pi, 720, endpoint=False)
    omega = benchmark(answer, source, THREADS, ("omega",), crank_angle=phi)["omega"]
    assert np.isfinite(omega).all()


def test_torque_extremes(benchmark: Any) -> None:
    source = problem.scene(1000, 2.0)
    given = problem.own_inputs(source)
    for name in ("exponent", "offset", "mean_torque", "inertia", "inertia_model"):
        del given[name]
    result = benchmark(torque_extremes, wanted=("torque_max",), threads=THREADS, **given)
    assert np.isfinite(result["torque_max"]).all()
