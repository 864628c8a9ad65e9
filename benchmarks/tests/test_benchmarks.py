"""The benchmark runs, its solvers solve the same problem, and no time is judged here."""

from __future__ import annotations

import re
import subprocess
import sys
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


def test_reference_agrees_with_the_oracle() -> None:
    for designs in (
        problem.table(4),
        problem.scene(60, 1.6, 4, True).take(np.array([0, 59])),
        problem.scene(60, 0.0, 3).take(np.array([30])),
    ):
        assert problem.agreement(designs, problem.reference(designs)) < 1e-10


@pytest.mark.parametrize("size", [1, 10, 97, 1000, 123_456, 10**7])
def test_scene_has_as_many_designs_as_asked(size: int) -> None:
    assert 0.9 * size <= len(problem.scene(size, 2.0)) <= size


@pytest.mark.parametrize("variable", [False, True])
@pytest.mark.parametrize(("exponent", "cylinders"), [(0.0, 1), (1.0, 8), (1.6, 4), (2.0, 1)])
def test_loop_and_own_solve_the_same_scene(exponent: float, cylinders: int, variable: bool) -> None:
    scene = problem.scene(120, exponent, cylinders, variable)
    index = np.arange(0, len(scene), 7)
    designs = scene.take(index)
    exact = problem.reference(designs)
    ours = problem.answer(scene, 1)["delta"].ravel()[index]
    np.testing.assert_allclose(ours, exact, rtol=1e-6)
    for share in (False, True):
        # Four cylinders have a quarter of the period and of the steps.
        np.testing.assert_allclose(
            peers.numba_loop(2880, 2, share)(designs), exact, rtol=1e-8
        )  # fmt: skip


def test_peers_solve_the_same_table(processes: peers.Processes) -> None:
    designs = problem.table(8)
    exact = problem.reference(designs)
    # What each is set to: the tolerances of adaptive solvers are not those of delta.
    allowed = {"Euler in Python": 1e-2}
    found, _ = peers.cases(1, processes, quick=True)
    assert {case.series for case in found} >= {"Numba loop", "NumPy steps", "SciPy solve_ivp"}
    for case in found:
        if case.series in ("JAX scan", "Diffrax", "heyoka"):
            continue  # seconds of compiling; the command below runs those that are installed
        chosen = designs.take(np.isin(designs.exponent, case.exponents or problem.EXPONENTS))
        errors = measure.errors_of(case.solve(chosen), problem.reference(chosen))
        assert errors.unanswered == 0.0 or case.series == "Euler in Python"
        if errors.unanswered < 1.0:
            assert errors.worst < allowed.get(case.series, 2e-5), case
    assert exact.min() > 0.0


def test_peers_solve_sampled_designs(processes: peers.Processes) -> None:
    """One to eight cylinders at any load; this project solves all at once."""
    designs = problem.sampled(16)
    assert designs.cylinders.tolist() == 2 * list(range(1, 9))
    exact = problem.reference(designs)
    for place in (0, 4):
        assert problem.agreement(designs.take([place]), exact[[place]]) < 1e-10
    np.testing.assert_allclose(problem.answer(designs, 1)["delta"], exact, rtol=1e-6)
    found, _ = peers.cases(1, processes, quick=True)
    for case in found:
        if case.series in ("JAX scan", "Diffrax", "heyoka", "Euler in Python"):
            continue
        errors = measure.errors_of(comparison.by_cylinders(case).solve(designs), exact)
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


@pytest.mark.parametrize(("exponent", "variable"), [(1.0, False), (2.0, True)])
def test_harmonic_balance_refuses_what_is_not_linear(exponent: float, variable: bool) -> None:
    designs = problem.scene(60, exponent, 1, variable).take(np.arange(3))
    with pytest.raises(ValueError, match="exponent 2 and constant inertia"):
        peers.harmonic_balance(designs, 96)


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
        result(comparison.BALANCE, "96 nodes", 50.0, exponents=(2.0,)),
        result("Euler in Python", "1 degree", 50.0, exponents=(1.0, 1.6, 2.0)),
    ]
    assert comparison.times_faster(results) == [
        [f"{comparison.BALANCE} (exponent 2 alone)", "6"], ["Euler in Python", "2"],
    ]  # fmt: skip


def test_the_page_is_made_from_its_files() -> None:
    assert (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8") == page.text(ROOT / "docs")


@pytest.mark.slow
def test_command_writes_document_and_figures(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "benchmarks", "--quick", "--threads", "2", "-o", tmp_path]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "benchmarks.md").read_text(encoding="utf-8")
    assert text == page.text(tmp_path)
    tables = re.findall(r"\]\(benchmarks/(\w+)\.csv\)", text)
    assert set(tables) >= {"peers", "studies", "quantities", "sampled", "apart", "traces"}
    for name in set(tables):
        assert page.read(tmp_path, name), name
    figures = re.findall(r"\]\((figures/[^)]+)\)", text)
    assert len(figures) == 2
    for name in figures:
        assert (tmp_path / name).stat().st_size < 300_000
    rows = page.read(tmp_path, "apart")
    (own_row,) = (row for row in rows if row["method"] == "auto, tolerance 1e-06")
    assert float(own_row["worst"]) <= 1e-6
    assert "nan" not in text
    assert not re.search(r"(?:^|[\s`(])/(?:home|root|tmp|work|usr|opt|Users)/", text)
