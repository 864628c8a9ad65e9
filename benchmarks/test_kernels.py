"""Times of the kernels by pytest-benchmark, so that a slow-down shows: `make bench-kernels`.

Every kind of study is one of them, and so every way in which designs are solved, and one quantity
of each way to compute any.

To compare with an earlier state: `pytest benchmarks/test_kernels.py --benchmark-autosave`, then
again with `--benchmark-compare`.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sweeps
from benchmarks import problem
from benchmarks.problem import answer
from benchmarks.studies import RANGES, STUDIES, Study, columns
from engine_dyn.speed.torque import torque_extremes
from engine_dyn.torsion.forced import forced_response
from engine_dyn.torsion.system import shaft_system
from sweeps.scene.features.shaft import read_shaft

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


SETTINGS: dict[str, Any] = {
    "cylinder_spacing": 0.2, "counterweight_fraction": 0.4, "counterweight_radius": 0.1,
    "balance_shaft_mass": 0.5, "balance_shaft_radius": 0.02, "rod_inertia": 0.1,
}  # fmt: skip
"""What balance and forces need to be known."""


@pytest.mark.parametrize(
    "quantity",
    [
        "imep", "torque_mean", "torque_max", "energy_swing", "gas_torque_order",
        "inertia_torque_order", "gravity_torque_order", "torque_order", "cylinder_torque_order",
        "throw_torque_order", "crank_pin_load_max", "piston_pin_load_max", "main_journal_load_max",
        "shaking_force_max", "shaking_force_rms", "shaking_moment_max", "shaking_force_major",
        "best_fraction_rms", "best_fraction_peak", "rod_torque_error", "rod_thrust_error",
        "velocity_truncation_error",
    ],
)  # fmt: skip
def test_quantity(benchmark: Any, quantity: str) -> None:
    scene = {"engine": "ntua", "designs": columns(500, RANGES), "set": SETTINGS,
             "output": {"quantities": [quantity], "highest_order": 6}}  # fmt: skip
    sweeps.run(scene, threads=THREADS)
    assert benchmark(sweeps.run, scene, threads=THREADS)[quantity].sizes["design"] == 500


def test_traces(benchmark: Any) -> None:
    source, phi = problem.scene(10, 2.0), np.linspace(0.0, 4.0 * np.pi, 720, endpoint=False)
    omega = benchmark(answer, source, THREADS, ("omega",), crank_angle=phi)["omega"]
    assert np.isfinite(omega).all()


@pytest.mark.parametrize("wanted", ["shaft_loss", "torque_extremes"])
def test_torsion(benchmark: Any, wanted: str) -> None:
    """The diesel's shaft of nine discs with inertias drawn within a tenth, orders 1/2 to 12."""
    given = read_shaft("diesel_105x137", Path(), "")
    assert given is not None
    shaft, values, random = given.shaft, given.values, np.random.default_rng(1)
    scatter = random.uniform(0.9, 1.1, (1000, len(shaft.discs)))
    system = shaft_system(
        np.array(shaft.inertias(values)) * scatter, shaft.stiffnesses(values),
        loss_factor=shaft.along("shaft_loss_factor", values, 0.0),
        disc_damping=shaft.along("disc_damping", values, 0.0),
    )  # fmt: skip
    orders = np.arange(0.5, 12.25, 0.5)
    torque = random.normal(size=(2, 6, orders.size)) * 400.0 / (1.0 + orders**2)
    solve = partial(
        forced_response, system, orders, random.uniform(100.0, 250.0, 1000), shaft.throws,
        torque[0] + 1j * torque[1], wanted=(wanted,), threads=THREADS,
    )  # fmt: skip
    solve()
    assert np.isfinite(benchmark(solve)[wanted]).all()


def test_torque_extremes(benchmark: Any) -> None:
    source = problem.scene(10, 2.0)
    given = problem.own_inputs(source)
    for name in ("exponent", "offset", "mean_torque", "inertia", "inertia_model"):
        del given[name]
    result = benchmark(torque_extremes, wanted=("torque_max",), threads=THREADS, **given)
    assert np.isfinite(result["torque_max"]).all()
