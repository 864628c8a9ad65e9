"""The benchmark runs, its solvers solve the same problem, and no time is judged here."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks import comparison, measure, page, peers, problem

ROOT = Path(__file__).resolve().parents[2]

pytestmark = pytest.mark.compiled


@pytest.fixture(scope="module")
def processes() -> Iterator[peers.Processes]:
    pool = peers.Processes(1)
    yield pool
    pool.close()


@pytest.mark.parametrize("variable", [False, True])
@pytest.mark.parametrize(("exponent", "cylinders"), [(0.0, 1), (1.0, 8), (1.6, 4), (2.0, 1)])
def test_loop_and_own_solve_the_same_scene(exponent: float, cylinders: int, variable: bool) -> None:
    scene = problem.scene(5, exponent, cylinders, variable)
    index = np.arange(0, len(scene), 7)
    designs = scene.take(index)
    exact = problem.reference(designs)
    ours = problem.answer(scene, 1)["delta"].ravel()[index]
    np.testing.assert_allclose(ours, exact, rtol=1e-6)
    if not variable:
        # Four cylinders have a quarter of the period and of the steps.
        np.testing.assert_allclose(peers.numba_loop(2880, 2)(designs), exact, rtol=1e-8)


def test_peers_solve_the_same_designs(processes: peers.Processes) -> None:
    """A table of all exponents, and one to eight cylinders at any load."""
    table, drawn = problem.table(8), problem.sampled(16)
    assert drawn.cylinders.tolist() == 2 * list(range(1, 9))
    exact = problem.reference(drawn)
    np.testing.assert_allclose(problem.answer(drawn, 1)["delta"], exact, rtol=1e-6)
    for case in peers.cases(1, processes, quick=True):
        chosen = table.take(np.isin(table.exponent, case.exponents or problem.EXPONENTS))
        errors = measure.errors_of(case.solve(chosen), problem.reference(chosen))
        assert errors.unanswered == 0.0 and errors.worst < 2e-5, case
        errors = measure.errors_of(comparison.by_cylinders(case).solve(drawn), exact)
        assert errors.worst < (1e-3 if "90 steps" in case.setting else 2e-5), case


@pytest.mark.parametrize("cylinders", [1, 2, 3, 8])
def test_errors_of_harmonic_balance_fall_with_the_number_of_nodes(cylinders: int) -> None:
    # So many designs that the largest node often lies beside another extreme than the largest.
    drawn = problem.sampled(2400)
    designs = replace(drawn.take(drawn.cylinders == cylinders), cylinders=cylinders)
    exact = problem.reference(designs)
    worst = [
        measure.errors_of(peers.harmonic_balance(designs, nodes), exact).worst
        for nodes in (96, 144, 192)
    ]
    assert worst[0] < 1e-5
    assert worst[1] < 0.1 * worst[0]
    assert worst[2] < min(0.3 * worst[1], 2e-9)


def result(
    series: str, setting: str, rate: float, worst: float = 1e-9, exponents: tuple[float, ...] = ()
) -> comparison.Result:
    errors = measure.Errors(worst, worst, worst, 0.0, 10)
    case = peers.Case(series, setting, comparison.own_solver(1), exponents=exponents)
    return comparison.Result(case, measure.Timing(10, (10.0 / rate,)), errors, 0.0)


def test_time_at_an_error_is_interpolated() -> None:
    results = [result("one", "slow", 1e3, 1e-8), result("one", "quick", 1e5, 1e-4)]
    assert comparison.seconds_at(results, 1e-6) == pytest.approx(1e-4)
    assert comparison.seconds_at(results, 1e-3) == pytest.approx(1e-5)
    assert np.isnan(comparison.seconds_at(results, 1e-9))
    lost = replace(results[1], errors=replace(results[1].errors, unanswered=0.1))
    assert comparison.seconds_at([results[0], lost], 1e-6) == pytest.approx(1e-3)


def test_peers_of_one_exponent_are_compared_on_its_designs() -> None:
    results = [
        result("auto", "tolerance 1e-06", 100.0),
        result("auto", "tolerance 1e-06, exponent 2", 300.0, exponents=(2.0,)),
        result("Harmonic balance", "96 nodes", 50.0, exponents=(2.0,)),
        result("Numba loop", "90 steps", 50.0),
    ]
    assert comparison.times_faster(results) == {"Harmonic balance": "6", "Numba loop": "2"}


def test_the_page_is_made_from_its_files() -> None:
    assert (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8") == page.text(ROOT / "docs")
