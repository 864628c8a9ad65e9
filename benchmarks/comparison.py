"""Solvers beside each other on the same designs: time and error, as tables and a figure."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from benchmarks import peers, problem
from benchmarks.command import log
from benchmarks.measure import (
    Errors,
    Run,
    Timing,
    enough,
    errors_of,
    in_turns,
    seconds_of,
    warm,
)
from benchmarks.peers import Case, Solver
from benchmarks.problem import Designs, answer, own_inputs, reference
from benchmarks.tables import number, small, span
from engine_dyn.speed import dispatch
from engine_dyn.types import Floats

OWN = ("auto", "newton", "closed", "thesis")
AIM = 1e-6  # relative error of delta that the ratios are at
LOOP, SHARING = "Numba loop", "Numba loop, shared tables"
BALANCE = "Harmonic balance"

Build = Callable[[int], Designs]


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
    auto = (1e-6,) if quick else (1e-4, 1e-6, 1e-8, 1e-10)
    found = [Case("auto", f"tolerance {t:.0e}", one(tolerance=t)) for t in auto]
    for n in () if quick else (2, 4):
        found.append(Case("auto", f"tolerance 1e-06, nodes x {n}", one(finer=n)))
    for n in (1,) if quick else (1, 2, 4):
        found.append(Case("newton", f"nodes x {n}", one(method="newton", finer=n)))
    return [
        *found,
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
    indices, works, firsts = [], [], []
    for case in cases:
        index = np.arange(len(designs))
        if case.exponents:
            index = np.flatnonzero(np.isin(designs.exponent, case.exponents))

        def solve(count: int, case: Case = case, index: Any = index) -> Floats:
            return case.solve(designs.take(index[:count]))

        firsts.append(seconds_of(solve, 8))
        count = enough(solve, seconds, min(case.most, index.size), case.least)
        indices.append(index[:count])
        works.append(partial(case.solve, designs.take(index[:count])))
    results = []
    for case, first, index, (times, delta) in zip(
        cases, firsts, indices, in_turns(works, [case.runs for case in cases]), strict=True
    ):
        known = index < exact.size
        errors = errors_of(delta[known], exact[index[known]])
        results.append(Result(case, Timing(index.size, times), errors, first))
    return results


@dataclass(frozen=True)
class SceneResult:
    """A factorial scene: this project (the default first), and peers on some of its designs."""

    scene: Designs
    ours: list[Result]
    peers: list[Result]

    @property
    def name(self) -> str:
        """What is written of the scene."""
        variable = ", variable" if self.scene.variable else ""
        return f"factorial, alpha {self.scene.exponent:g}, Z {self.scene.cylinders}{variable}"


def in_scene(
    build: Build, others: Sequence[Case], run: Run, tolerances: Sequence[float] = (1e-6,)
) -> SceneResult:
    """Time this project on a whole scene, which keeps it busy, and peers on some of its designs."""
    scene = build(
        enough(lambda size: answer(build(size), run.threads), run.seconds, 10_000_000, 1000)
    )
    drawn = np.random.default_rng(2).permutation(len(scene))[:200_000]
    designs = scene.take(drawn)
    exact = reference(designs.take(slice(0, 200)))
    works = [partial(answer, scene, run.threads, tolerance=t) for t in tolerances]
    ours = [
        Result(
            Case("auto", f"tolerance {tolerance:.0e}", own_solver(run.threads)),
            Timing(len(scene), times), errors_of(found["delta"].ravel()[drawn], exact), np.nan,
        )
        for tolerance, (times, found) in zip(
            tolerances, in_turns(works, [run.runs] * len(works)), strict=True
        )
    ]  # fmt: skip
    few = [replace(case, runs=min(case.runs, 3)) for case in others]
    return SceneResult(scene, ours, compare(few, designs, exact, run.seconds))


# Comparisons --------------------------------------------------------------------------------------


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
    if not good:
        return math.nan
    best = min(t for _, t in good)
    for e1, t1 in good:
        for e2, t2 in points:
            if e2 > error:
                share = math.log(error / e1) / math.log(e2 / e1)
                best = min(best, math.exp(math.log(t1) + share * math.log(t2 / t1)))
    return best


def of_series(results: Sequence[Result], series: str) -> list[Result]:
    """Results of one solver."""
    return [r for r in results if r.case.series == series]


def series_of(results: Sequence[Result]) -> list[str]:
    """Solvers, in order."""
    return list(dict.fromkeys(r.case.series for r in results))


def default_of(results: Sequence[Result]) -> Result:
    """Method auto as it is unless told otherwise."""
    return next(r for r in results if r.case.setting == "tolerance 1e-06")


def beside(results: Sequence[Result], series: str) -> Result:
    """Method auto as it is unless told otherwise, on the exponents that a peer is timed on.

    On all of them where it was not timed on these alone.
    """
    exponents = of_series(results, series)[0].case.exponents
    same = [r for r in of_series(results, "auto") if exponents and r.case.exponents == exponents]
    return same[0] if same else default_of(results)


def loop_ratio(ours: Result, peers: Sequence[Result], series: str, error: float) -> float:
    """How many times as many designs a second as the loop with an error of at most `error`.

    NaN if no step count of the loop reaches it.
    """
    return seconds_at(of_series(peers, series), error) * ours.timing.rate


def at_equal_error(ours: Result, peers: Sequence[Result], series: str) -> float:
    """The same with the error that `ours` has."""
    return loop_ratio(ours, peers, series, max(ours.errors.worst, 1e-10))


def times_faster(results: Sequence[Result]) -> list[list[str]]:
    """How many times as many designs a second `auto` solves as each peer does at `AIM`."""
    body = []
    for series in series_of(results):
        if series in OWN or series == SHARING:
            continue
        ours = beside(results, series)
        seconds = seconds_at(of_series(results, series), AIM)
        best = min(of_series(results, series), key=lambda r: r.errors.worst)
        note = (
            number(seconds * ours.timing.rate) if math.isfinite(seconds)
            else f"not reached (best {small(best.errors.worst)}, then "
            f"{number(ours.timing.rate / best.timing.rate)})"
        )  # fmt: skip
        alone = f" (exponent {ours.case.exponents[0]:g} alone)" if ours.case.exponents else ""
        body.append([series + alone, note])
    return body


# Tables -------------------------------------------------------------------------------------------

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


def loop_row(name: str, auto: Result, peers: Sequence[Result], *more: str) -> list[str]:
    """How many times faster than the loops and harmonic balance, at equal error and at `AIM`."""
    equal = max(auto.errors.worst, 1e-10)
    return [name, *(number(loop_ratio(auto, peers, series, error))
                    for series in (LOOP, *more) for error in (equal, AIM))]  # fmt: skip


def factorial_row(one: SceneResult) -> list[str]:
    """A factorial scene."""
    auto = one.ours[0]
    row = [one.name, number(auto.timing.rate), number(auto.timing.count), small(auto.errors.median),
           small(auto.errors.worst), f"{auto.timing.spread:.1f}"]  # fmt: skip
    for series in (LOOP, SHARING):
        good = [r for r in of_series(one.peers, series) if r.errors.worst <= AIM]
        best = max(good, key=lambda r: r.timing.rate, default=None)
        row.append(f"{number(best.timing.rate)} ({best.case.setting})" if best else "-")
    return row


# Own methods in strong colours and filled, peers in muted ones; colours of Okabe and Ito.
LOOKS: dict[str, tuple[str, str]] = {
    "auto": ("#D55E00", "o"),
    "newton": ("#CC79A7", "s"),
    "closed": ("#E69F00", "D"),
    "thesis": ("#661100", "v"),
    LOOP: ("#0072B2", "P"),
    SHARING: ("#56B4E9", "P"),
    "NumPy steps": ("#009E73", "X"),
    BALANCE: ("#B15928", "H"),
    "JAX scan": ("#117733", "h"),
    "Diffrax": ("#44AA99", "*"),
    "heyoka": ("#332288", "<"),
    "SciPy solve_ivp": ("#555555", "d"),
    "Euler in Python": ("#000000", "x"),
}


def work_precision(panels: dict[str, list[Result]]) -> Figure:
    """Time for a design against error; nothing is shared by the designs of the first panel."""
    figure = Figure(figsize=(3.4 * len(panels), 4.4), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(1, len(panels), sharex=True, sharey=True)
    drawn: dict[str, Any] = {}
    for ax, (title, results) in zip(axes, panels.items(), strict=True):
        for series in series_of(results):
            if series == SHARING and ax is axes[0]:
                continue
            points = sorted(
                (r.errors.worst, 1e6 / r.timing.rate, r.errors.unanswered)
                for r in of_series(results, series)
                if math.isfinite(r.errors.worst)
                # The curve of `auto` is that of all exponents.
                and not (series == "auto" and r.case.exponents)
            )  # fmt: skip
            if not points:
                continue
            colour, marker = LOOKS[series]
            own = series in OWN
            error, time, missing = (np.array(column) for column in zip(*points, strict=True))
            hollow = bool(missing.max() > 0.0) and marker != "x"
            (drawn[series],) = ax.plot(
                error, time, color=colour, marker=marker, markersize=5.0 if own else 4.5,
                linewidth=1.8 if own else 1.0, linestyle="-" if own else (0, (4, 1.5)),
                markerfacecolor="white" if hollow else colour, zorder=3 if own else 2,
            )  # fmt: skip
        ax.set(xscale="log", yscale="log", xlabel="worst relative error of δ")
        ax.set_title(title)
        ax.axvline(AIM, color="#888888", linewidth=0.7, linestyle=":")
        ax.xaxis.set_major_locator(LogLocator(numticks=12))
        ax.yaxis.set_major_locator(LogLocator(numticks=12))
        ax.minorticks_off()
    axes[0].set_ylabel("time for a design (µs)")
    names = [name for name in LOOKS if name in drawn]
    figure.legend(
        [drawn[name] for name in names], names, loc="outside lower center", ncols=4,
        handlelength=2.6, columnspacing=1.6,
    )  # fmt: skip
    return figure


# All of it ----------------------------------------------------------------------------------------


def measured(run: Run) -> tuple[dict[str, str], Figure]:
    """Compare, and write the tables; what the page tells of them, and the figure."""
    threads, quick = run.threads, run.quick
    log("reference")
    sample = problem.table(64 if quick else 1000)
    exact = reference(sample)
    few = slice(0, 2 if quick else 8)
    some = problem.scene(50, 1.6, 4, True).take(np.arange(2))
    agreement = max(
        problem.agreement(sample.take(few), exact[few]), problem.agreement(some, reference(some))
    )
    if agreement > 1e-10:
        raise RuntimeError(f"the reference and oracle differ by {agreement:.1e}")

    pool = peers.Processes(threads)
    others, absent = peers.cases(threads, pool, quick)
    for line in absent:
        log(line)
    log("table of designs that share nothing")
    # The first designs are those of the reference, whatever the length.
    big = problem.joined(sample, problem.table(2_000 if quick else 400_000, seed=2))
    unshared = [case for case in others if case.series != SHARING]
    table = compare([*own_cases(threads, quick), *unshared], big, exact, run.seconds)
    log("sampled designs")
    drawn = problem.sampled(2_000 if quick else 400_000)
    of_drawn = reference(drawn.take(slice(0, 16 if quick else 200)))
    # Euler is written for one load.
    able = [case for case in unshared if case.series != "Euler in Python"]
    own = [
        Case("auto", f"tolerance {t:.0e}", own_solver(threads, tolerance=t))
        for t in ((1e-6,) if quick else (1e-6, 1e-4, 1e-8))
    ]
    sampled = compare([*own, *map(by_cylinders, able)], drawn, of_drawn, run.seconds)
    ours = default_of(table)
    length = min(len(big), ours.timing.count)
    alone = partial(dispatch.solve, wanted=("delta",), threads=threads,
                    **own_inputs(big.take(slice(0, length))))  # fmt: skip

    loops = [case for case in others if case.scenes]
    balanced = [case for case in others if case.series == BALANCE]
    left_out = ("Euler in Python", "SciPy solve_ivp")
    quickest = [case for case in others if not case.scenes and case.series not in left_out]
    kinds = [(a, z, False) for a in (2.0, 1.0, 0.0) for z in (1, 4, 8)]
    kinds += [(1.6, 1, False), (1.6, 4, False), (2.0, 1, True), (2.0, 4, True), (1.0, 4, True)]
    scenes = []
    for i, (exponent, cylinders, variable) in enumerate(kinds[:: 4 if quick else 1]):
        build = partial(problem.scene, exponent=exponent, cylinders=cylinders, variable=variable)
        log(f"scene: alpha {exponent:g}, Z {cylinders}{', variable' if variable else ''}")
        solvable = balanced if exponent == 2.0 and not variable else []
        tolerances = (1e-6, 1e-4, 1e-8, 1e-10)[: 1 if quick or i > 0 else 4]
        beside_it = loops + (quickest if i == 0 else solvable)
        scenes.append(in_scene(build, beside_it, run, tolerances))
    pool.close()

    wide, in_samples = scenes[0], dict(times_faster(sampled))
    run.save("peers", ["peer", "share nothing", "sampled"],
             [[peer, times, in_samples.get(peer.partition(" (")[0], "-")]
              for peer, times in times_faster(table)])  # fmt: skip
    run.save("loop", ["designs", "at equal error", "at 1e-6", "shared tables, equal error",
                      "shared, at 1e-6", "harmonic balance, equal error",
                      "harmonic balance, at 1e-6"],
             [*(loop_row(one.name, one.ours[0], one.peers, SHARING, BALANCE) for one in scenes),
              [*loop_row("table", ours, table), *["-"] * 4]])  # fmt: skip
    run.save("apart", HEAD, [result_row(r, ours) for r in table])
    run.save("sampled", HEAD, [result_row(r, default_of(sampled)) for r in sampled])
    run.save("factorial", ["scene", "auto, designs/s", "designs", "median error", "worst", "spread",
                           "Numba loop, designs/s", "shared tables, designs/s"],
             [factorial_row(one) for one in scenes])  # fmt: skip
    of_wide = [*wide.ours, *wide.peers]
    run.save("factorial_all", HEAD, [result_row(r, wide.ours[0]) for r in of_wide])
    facts = {
        "absent": "; ".join(absent),
        "agreement": small(agreement),
        "agreed": str(few.stop + len(some)),
        "worst": small(ours.errors.worst),
        "loop_equal": number(at_equal_error(ours, table, LOOP)),
        "checked_apart": number(max(r.errors.checked for r in table)),
        "alone_rate": number(warm(alone, length, run.runs).rate),
        "widest_scene": wide.name,
    }
    return facts, work_precision({
        "a  Designs that share nothing": table, "b  Sampled designs": sampled,
        f"c  Factorial, α = {wide.scene.exponent:g}": of_wide,
    })  # fmt: skip
