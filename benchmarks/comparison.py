"""Solvers beside each other on the same designs: time and error, as tables and a figure."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from benchmarks import page, peers, problem
from benchmarks.command import log
from benchmarks.measure import Errors, Run, Timing, enough, errors_of, in_turns, seconds_of
from benchmarks.peers import Case, Solver
from benchmarks.problem import Designs, answer, reference
from benchmarks.tables import number, small, span
from engine_dyn.types import Floats

AIM = 1e-6  # relative error of delta that the ratios are at
LOOP = "Numba loop"


@dataclass(frozen=True)
class Result:
    """A case, its time and its error."""

    case: Case
    timing: Timing
    errors: Errors
    first: float  # seconds of the first call, which compiles


def own_solver(threads: int, **options: Any) -> Solver:
    """Delta of a table of designs by this project."""
    return lambda designs: np.asarray(answer(designs, threads, **options)["delta"])


def own_cases(threads: int, quick: bool) -> list[Case]:
    """Every method of this project, at several tolerances and node counts."""
    one = partial(own_solver, threads)
    auto = (1e-6,) if quick else (1e-4, 1e-6, 1e-8)
    return [
        *(Case("auto", f"tolerance {t:.0e}", one(tolerance=t)) for t in auto),
        *(
            Case("newton", f"nodes x {n}", one(method="newton", finer=n))
            for n in ((1,) if quick else (1, 4))
        ),
        # What peers that solve exponent 2 alone are compared with.
        Case("auto", "tolerance 1e-06, exponent 2", one(tolerance=1e-6), exponents=(2.0,)),
        Case("closed", "exponents 0 and 2", one(method="closed"), exponents=(0.0, 2.0)),
        # Repeating cycles takes hundreds of them: few runs. Euler never closes at 0.
        Case("thesis", "Euler, 1 degree", one(method="thesis"), 3, exponents=(1.0, 1.6, 2.0)),
    ]


def by_cylinders(case: Case) -> Case:
    """A peer that solves the designs of one number of cylinders after the other."""

    def solve(designs: Designs) -> Floats:
        delta = np.empty(len(designs))
        for count in np.unique(designs.cylinders).tolist():
            index = np.flatnonzero(designs.cylinders == count)
            delta[index] = case.solve(replace(designs.take(index), cylinders=count))
        return delta

    return replace(case, solve=solve)


def compare(cases: Sequence[Case], designs: Designs, exact: Floats, seconds: float) -> list[Result]:
    """Time every case on the same designs, all cases taking turns run by run.

    Each case solves as many of the first designs as take about `seconds`.
    """
    indices: list[Any] = []
    works: list[Callable[[], Floats]] = []
    firsts: list[float] = []
    for case in cases:
        index = np.arange(len(designs))
        if case.exponents:
            index = np.flatnonzero(np.isin(designs.exponent, case.exponents))

        def solve(count: int, case: Case = case, index: Any = index) -> Floats:
            return case.solve(designs.take(index[:count]))

        firsts.append(seconds_of(solve, 8))
        count = enough(solve, seconds, index.size, case.least)
        indices.append(index[:count])
        works.append(partial(case.solve, designs.take(index[:count])))
    turns = in_turns(works, [case.runs for case in cases])
    results = []
    for case, first, index, (times, delta) in zip(cases, firsts, indices, turns, strict=True):
        known = index < exact.size
        errors = errors_of(delta[known], exact[index[known]])
        results.append(Result(case, Timing(index.size, times), errors, first))
    return results


# Ratios -------------------------------------------------------------------------------------------


def seconds_at(results: Sequence[Result], error: float) -> float:
    """Seconds a design that a solver needs for a worst error of at most `error`; NaN if it cannot.

    Of its settings the quickest that is as good; between two of them the time is interpolated in
    the logarithms, as if its steps could be chosen freely.
    """
    points = [
        (r.errors.worst, 1.0 / r.timing.rate) for r in results
        if r.errors.unanswered == 0.0 and r.errors.worst > 0.0
    ]  # fmt: skip
    good = [p for p in points if p[0] <= error]
    best = min((t for _, t in good), default=math.nan)
    for e1, t1 in good:
        for e2, t2 in points:
            if e2 > error:
                share = math.log(error / e1) / math.log(e2 / e1)
                best = min(best, math.exp(math.log(t1) + share * math.log(t2 / t1)))
    return best


def of_series(results: Sequence[Result], series: str) -> list[Result]:
    """Results of one solver."""
    return [r for r in results if r.case.series == series]


def default_of(results: Sequence[Result], exponents: tuple[float, ...] = ()) -> Result:
    """Method auto as it is unless told otherwise; on some exponents, where it was timed on them."""
    found = [r for r in of_series(results, "auto") if r.case.setting.startswith("tolerance 1e-06")]
    return next((r for r in found if r.case.exponents == exponents), found[0])


def times_faster(results: Sequence[Result]) -> dict[str, str]:
    """How many times as many designs a second `auto` solves as each peer does at `AIM`."""
    ratios = {}
    for series in dict.fromkeys(r.case.series for r in results):
        if series not in LOOKS or series in OWN:
            continue
        of_peer = of_series(results, series)
        rate = default_of(results, of_peer[0].case.exponents).timing.rate
        ratios[series] = number(seconds_at(of_peer, AIM) * rate)
    return ratios


# Tables and the figure ----------------------------------------------------------------------------

HEAD = ["method", "designs/s", "of auto", "median error", "99 %", "worst", "no answer",
        "first call", "designs x runs", "spread"]  # fmt: skip


def result_row(r: Result, ours: Result) -> list[str]:
    """One line of a table of results."""
    missing = "" if r.errors.unanswered == 0.0 else f"{100 * r.errors.unanswered:.0f} %"
    first = r.first - 8.0 / r.timing.rate
    return [
        f"{r.case.series}, {r.case.setting}", number(r.timing.rate),
        f"{r.timing.rate / ours.timing.rate:.2g}", small(r.errors.median), small(r.errors.most),
        small(r.errors.worst), missing, "-" if not first > 0.05 else span(first),
        f"{number(r.timing.count)} x {len(r.timing.seconds)}", f"{r.timing.spread:.1f}",
    ]  # fmt: skip


OWN = ("auto", "newton", "closed", "thesis")

# Own methods in strong colours, peers in muted ones; colours of Okabe and Ito.
LOOKS: dict[str, tuple[str, str]] = {
    "auto": ("#D55E00", "o"), "newton": ("#CC79A7", "s"), "closed": ("#E69F00", "D"),
    "thesis": ("#661100", "v"), LOOP: ("#0072B2", "P"), "Harmonic balance": ("#B15928", "H"),
    "SciPy solve_ivp": ("#555555", "d"),
}  # fmt: skip


def work_precision(folder: Path) -> Figure:
    """Time for a design against error, from the two tables beside the page."""
    figure = Figure(figsize=(6.8, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(1, 2, sharex=True, sharey=True)
    panels = {"apart": "a  Designs that share nothing", "sampled": "b  Sampled designs"}
    for ax, (name, title) in zip(axes, panels.items(), strict=True):
        for series, (colour, marker) in LOOKS.items():
            rows = [row for row in page.read(folder, name)
                    if row["method"].startswith(f"{series}, ") and "exponent 2" not in row["method"]
                    and row["worst"] != "-"]  # fmt: skip
            points = sorted((float(row["worst"]), 1e6 / float(row["designs/s"].replace(",", "")))
                            for row in rows)  # fmt: skip
            ax.plot(*np.array(points or np.zeros((0, 2))).T, color=colour, marker=marker,
                    label=series, linestyle="-" if series in OWN else "--")  # fmt: skip
        ax.set(xscale="log", yscale="log", xlabel="worst relative error of δ", title=title)
        ax.axvline(AIM, color="#888888", linewidth=0.7, linestyle=":")
        ax.minorticks_off()
    axes[0].set_ylabel("time for a design (µs)")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


# All of it ----------------------------------------------------------------------------------------


def measured(run: Run) -> dict[str, str]:
    """Compare, and write the tables; what the page tells of them."""
    threads, quick = run.threads, run.quick
    log("reference")
    sample = problem.table(64 if quick else 1000)
    exact = reference(sample)
    pool = peers.Processes(threads)
    others = peers.cases(threads, pool, quick)
    log("table of designs that share nothing")
    # The first designs are those of the reference, whatever the length.
    big = problem.joined(sample, problem.table(2_000 if quick else 400_000, seed=2))
    table = compare([*own_cases(threads, quick), *others], big, exact, run.seconds)
    log("sampled designs")
    drawn = problem.sampled(2_000 if quick else 400_000)
    of_drawn = reference(drawn.take(slice(0, 16 if quick else 200)))
    own = [
        Case("auto", f"tolerance {t:.0e}", own_solver(threads, tolerance=t))
        for t in ((1e-6,) if quick else (1e-6, 1e-4, 1e-8))
    ]
    sampled = compare([*own, *map(by_cylinders, others)], drawn, of_drawn, run.seconds)
    pool.close()
    ratios = zip(times_faster(table).items(), times_faster(sampled).values(), strict=True)
    body = [[peer, apart, in_samples] for (peer, apart), in_samples in ratios]
    run.save("peers", ["peer", "share nothing", "sampled"], body)
    run.save("apart", HEAD, [result_row(r, default_of(table)) for r in table])
    run.save("sampled", HEAD, [result_row(r, default_of(sampled)) for r in sampled])
    ours = default_of(table)
    equal = seconds_at(of_series(table, LOOP), max(ours.errors.worst, 1e-10)) * ours.timing.rate
    return {
        "worst": small(ours.errors.worst),
        "loop_equal": number(equal),
        "checked_apart": number(max(r.errors.checked for r in table)),
    }
