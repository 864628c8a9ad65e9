"""What was measured, as the files and figures of docs/benchmarks.md."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator

from benchmarks import page, quantity_times, study_times
from benchmarks.command import versions
from benchmarks.measure import BigRun, Memory, Result, SceneResult, Timing, Traces
from benchmarks.tables import number, small, span
from engine_dyn.compilation import source_hash
from sweeps.figures.sheet import STYLE

OWN = ("auto", "newton", "closed", "thesis")
AIM = 1e-6  # relative error of delta that the ratios are at
LOOP, SHARING = "Numba loop", "Numba loop, shared tables"
BALANCE = "Harmonic balance"

Rows = list[list[str]]


@dataclass(frozen=True)
class Measured:
    """One run of the benchmark."""

    date: str
    machine: str
    threads: int
    quick: bool
    absent: list[str]
    agreement: float
    agreed: int
    table: list[Result]
    table_alone: Timing
    sampled: list[Result]
    scenes: list[SceneResult]
    numbers: dict[str, list[Timing]]
    by_threads: dict[str, list[tuple[int, Timing]]]
    by_cylinders: list[tuple[int, Timing]]
    traces: list[Traces]  # the larger array last
    flops: float
    writing: float
    latencies: dict[str, float]
    memory: list[Memory]
    big: BigRun
    studies: study_times.Studies
    quantities: quantity_times.Rates
    took: float


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


# Aims ---------------------------------------------------------------------------------------------


def targets(m: Measured) -> list[tuple[str, str, str, bool]]:
    """What is aimed at: words, aim, measured, reached."""
    plain: list[Timing] = []
    variable, real = plain.copy(), plain.copy()
    for one in m.scenes:
        exact = one.scene.exponent in (0.0, 1.0, 2.0)
        (variable if one.scene.variable else plain if exact else real).append(one.ours[0].timing)
    ours, most = default_of(m.table), m.numbers["table"][-1]
    worst = max(ours.errors.worst, *(one.ours[0].errors.worst for one in m.scenes))
    ratios = [at_equal_error(one.ours[0], one.peers, LOOP) for one in m.scenes]
    found: list[tuple[str, str, str, bool]] = []
    for words, aim, timings in (
        ("factorial scenes, constant inertia, alpha 0, 1, 2 (slowest)", 1e7, plain),
        ("factorial scenes, variable inertia (slowest)", 3e6, variable),
        ("factorial scenes, any real alpha (slowest)", 1e6, real),
        (f"table of designs that share nothing, {number(most.count)} at a time", 1e6, [most]),
    ):
        if timings:
            least = min(t.rate for t in timings)
            found.append((words, f"{number(aim)} designs/s", number(least), least >= aim))
    found.append(("largest error of delta in all of these", small(AIM), small(worst), worst <= AIM))
    for words, aim, of_loop in (
        ("factorial scenes", 100.0, [ratio for ratio in ratios if math.isfinite(ratio)]),
        ("table", 10.0, [at_equal_error(ours, m.table, LOOP)]),
    ):
        least = min(of_loop, default=math.nan)
        what = f"times the Numba loop's rate at equal error, {words} (least)"
        found.append((what, number(aim), number(least), least >= aim))
    # The first, smaller array has the words of runs on other machines, which had only that.
    for t, size in zip(m.traces, ("", f" ({m.traces[-1].size / 1e6:.0f} MB)"), strict=True):
        words = f"traces{size}: time over that of NumPy writing the array"
        found.append((words, "2", f"{t.solving / t.fresh:.2g}", t.solving / t.fresh <= 2.0))
    times = list(m.latencies.values())
    for words, aim, value in (
        ("`engine_dyn.periodic_speed`, one design, warm", 1e-3, times[0]),
        ("`sweeps.run(dict)`, one design, warm", 20e-3, times[1]),
        ("`engine-dyn run`, one design, cache warm", 2.5, times[2]),
        ("`engine-dyn run`, one design, first ever", 20.0, times[3]),
        ("`import engine_dyn` after Numba", 0.3, times[-1]),
    ):
        if math.isfinite(value):
            found.append((words, f"below {span(aim)}", span(value), value < aim))
    for each in m.memory:
        beyond = each.added - each.results
        words = f"memory beyond the results, `{each.what}`, {number(each.designs)} designs"
        found.append((words, "150 MB", f"{beyond / 1e6:.0f} MB", beyond <= 150_000_000))
    return found


MACHINES = ["machine", "run", "code", "what", "aim", "measured", "reached"]


def reached_here(m: Measured) -> Rows:
    """The aims of this run, as they are kept."""
    run = f"{m.flops / 1e9:.0f} Gflop/s, {m.writing / 1e9:.1f} GB/s; {m.date}"
    return [
        [m.machine, run, source_hash()[:8], what, aim, measured, "yes" if ok else "no"]
        for what, aim, measured, ok in targets(m)
    ]


def save_machines(here: Rows, folder: Path) -> None:
    """Keep the aims of this run beside those of the last ones on other machines."""
    kept = [list(row.values()) for row in page.read(folder, "machines")]
    page.save(folder, "machines", MACHINES, [*here, *(k for k in kept if k[0] != here[0][0])])


def facts_of_run(m: Measured) -> dict[str, str]:
    """Single numbers and words, which the page names."""
    ours = default_of(m.table)
    aims = [ok for *_, ok in targets(m)]
    checked = [row.errors.designs for row in m.studies.rows]
    big = m.big
    return {
        "machine": m.machine,
        "date": m.date,
        "versions": versions("engine-dyn", "numpy", "numba", "scipy", "xarray", "netCDF4", "jax",
                             "diffrax", "heyoka"),
        "quick": "yes" if m.quick else "no",
        "absent": "; ".join(m.absent),
        "aims": str(len(aims)),
        "reached": str(aims.count(True)),
        "threads": str(m.threads),
        "agreement": small(m.agreement),
        "agreed": str(m.agreed),
        "worst": small(ours.errors.worst),
        "loop_equal": number(at_equal_error(ours, m.table, LOOP)),
        "loop_steps": str(study_times.LOOP_STEPS),
        "loop_rate": number(m.studies.loop.rate),
        "loop_error": small(m.studies.loop_errors.worst),
        "checked": f"{min(checked, default=0)} to {max(checked, default=0)}",
        "checked_apart": number(max(r.errors.checked for r in m.table)),
        "alone_rate": number(m.table_alone.rate),
        "angles": str(m.traces[-1].angles),
        "big_run": f"{number(big.designs, 3)} designs in {span(big.command)}",
        "big_run_means": "`engine-dyn run`, engine `ntua`, inertia x speed x reciprocating mass, "
        f"four results: {span(big.computing)} of it for computing, the rest for starting and for "
        f"writing {big.size / 1e6:.0f} MB",
        "minutes": f"{m.took / 60.0:.0f}",
        "widest_scene": widest(m).name,
    }  # fmt: skip


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


def widest(m: Measured) -> SceneResult:
    """The scene with most peers."""
    return max(m.scenes, key=lambda one: len(series_of(one.peers)))


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


def number_rows(m: Measured) -> Rows:
    """Rates and times of some numbers of designs."""
    body = []
    for size in sorted({t.count for timings in m.numbers.values() for t in timings}):
        row = [number(size, 3)]
        for timings in m.numbers.values():
            here = [t for t in timings if t.count == size]
            row.append(f"{number(here[0].rate)} ({span(here[0].median)})" if here else "-")
        body.append(row)
    return body


def write_tables(m: Measured, folder: Path) -> None:
    """Everything that was measured, as files beside the page."""
    save = partial(page.save, folder)
    ours, wide, sampled = default_of(m.table), widest(m), dict(times_faster(m.sampled))
    save("peers", ["peer", "share nothing", "sampled"],
         [[peer, times, sampled.get(peer.partition(" (")[0], "-")]
          for peer, times in times_faster(m.table)])  # fmt: skip
    save("loop", ["designs", "at equal error", "at 1e-6", "shared tables, equal error",
                  "shared, at 1e-6", "harmonic balance, equal error", "harmonic balance, at 1e-6"],
         [*(loop_row(one.name, one.ours[0], one.peers, SHARING, BALANCE) for one in m.scenes),
          [*loop_row("table", ours, m.table), *["-"] * 4]])  # fmt: skip
    save("studies", study_times.HEAD, study_times.body(m.studies))
    save("quantities", quantity_times.HEAD, quantity_times.body(m.quantities))
    save("apart", HEAD, [result_row(r, ours) for r in m.table])
    save("sampled", HEAD, [result_row(r, default_of(m.sampled)) for r in m.sampled])
    save("factorial", ["scene", "auto, designs/s", "designs", "median error", "worst", "spread",
                       "Numba loop, designs/s", "shared tables, designs/s"],
         [factorial_row(one) for one in m.scenes])  # fmt: skip
    save("factorial_all", HEAD, [result_row(r, wide.ours[0]) for r in [*wide.ours, *wide.peers]])
    save("numbers", ["designs", *(f"{name}, designs/s" for name in m.numbers)], number_rows(m))
    counts = [count for count, _ in next(iter(m.by_threads.values()))]
    save("threads",
         ["designs", *(f"{n} thread{'s'[: n > 1]}, designs/s" for n in counts), "ratio"],
         [[name, *(number(t.rate) for _, t in found),
           f"{found[-1][1].rate / found[0][1].rate:.2f}"]
          for name, found in m.by_threads.items()])  # fmt: skip
    save("cylinders", ["cylinders", "designs/s"],
         [[str(z), number(t.rate)] for z, t in m.by_cylinders])  # fmt: skip
    save("traces", ["designs", "MB", "time", "GB/s", "NumPy, new array", "times its time",
                    "array in use"],
         [[number(t.designs, 3), f"{t.size / 1e6:.0f}", span(t.solving),
           f"{t.size / t.solving / 1e9:.2g}", span(t.fresh), f"{t.solving / t.fresh:.2g}",
           span(t.again)] for t in m.traces])  # fmt: skip
    save("single", ["what", "time"], [[what, span(s)] for what, s in m.latencies.items()])
    save("memory", ["what", "designs", "added", "results", "beyond the results"],
         [[e.what, number(e.designs, 3),
           *(f"{size / 1e6:.0f} MB" for size in (e.added, e.results, e.added - e.results))]
          for e in m.memory])  # fmt: skip


# Figures ------------------------------------------------------------------------------------------

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
    "SciPy solve_bvp": ("#999999", "p"),
    "Euler in Python": ("#000000", "x"),
}


def work_precision(m: Measured) -> Figure:
    """Time for a design against error."""
    wide = widest(m)
    panels = [
        ("a  Designs that share nothing", m.table), ("b  Sampled designs", m.sampled),
        (f"c  Factorial, α = {wide.scene.exponent:g}", [*wide.ours, *wide.peers]),
    ]  # fmt: skip
    figure = Figure(figsize=(3.4 * len(panels), 4.4), layout="constrained")
    axes = figure.subplots(1, len(panels), sharex=True, sharey=True)
    drawn: dict[str, Any] = {}
    for ax, (title, results) in zip(axes, panels, strict=False):
        for series in series_of(results):
            if series == SHARING and results is m.table:
                continue  # nothing is shared there
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


def throughput(m: Measured) -> Figure:
    """Designs a second against their number."""
    figure = Figure(figsize=(4.6, 3.2), layout="constrained")
    ax = figure.subplots()
    for (name, timings), (colour, marker) in zip(
        m.numbers.items(), (("#D55E00", "o"), ("#CC79A7", "s"), ("#0072B2", "D")), strict=False
    ):
        ax.plot([t.count for t in timings], [t.rate for t in timings], color=colour, marker=marker,
                label=name)  # fmt: skip
    ax.set(xscale="log", yscale="log", xlabel="designs in one call", ylabel="designs/s")
    ax.xaxis.set_major_locator(LogLocator(numticks=12))
    ax.yaxis.set_major_locator(LogLocator(numticks=12))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    ax.minorticks_off()
    ax.legend(loc="lower right")
    return figure


def write(m: Measured, folder: Path) -> None:
    """Page, files and figures below `folder`."""
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    if not m.quick:
        save_machines(reached_here(m), folder)
    page.save_facts(folder, facts_of_run(m))
    write_tables(m, folder)
    page.write(folder)
    style: Any = STYLE
    with matplotlib.rc_context(style):
        for name, figure in (("work_precision", work_precision(m)), ("throughput", throughput(m))):
            FigureCanvasAgg(figure)
            # 200 dpi: sharp in print at column width, small in the repository.
            figure.savefig(folder / "figures" / f"bench_{name}.png", dpi=200, metadata={})
