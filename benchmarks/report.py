"""What was measured, as docs/benchmarks.md and its figures."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from string import ascii_uppercase
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator

from benchmarks.compile_times import kept_section
from benchmarks.measure import (
    BigRun,
    Latencies,
    Memory,
    Result,
    SceneResult,
    Timing,
    Traces,
)
from benchmarks.quantity_times import Rates, quantities_section
from benchmarks.study_report import studies_section
from benchmarks.study_times import Studies
from benchmarks.wording import number, rows, small, span
from engine_dyn.compilation import source_hash
from sweeps.figures.sheet import STYLE

OWN = ("auto", "newton", "closed", "thesis")
AIM = 1e-6  # relative error of delta that the ratios are at
LOOP, SHARING = "Numba loop", "Numba loop, shared tables"
BALANCE = "Harmonic balance"


@dataclass(frozen=True)
class Measured:
    """One run of the benchmark."""

    date: str
    processor: str
    lanes: str
    threads: int
    quick: bool
    versions: list[tuple[str, str]]
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
    traces: tuple[Traces, ...]  # the larger array last
    flops: float
    flops_one: float
    writing: float
    latencies: Latencies
    memory: list[Memory]
    big: BigRun
    studies: Studies
    quantities: Rates
    took: float


@dataclass(frozen=True)
class Reached:
    """One aim in the last run on one machine, a row of MACHINES."""

    machine: str
    run: str
    code: str
    what: str
    aim: str
    measured: str
    reached: str


MACHINES = "benchmarks_machines.csv"
"""What the last run on each machine reached, beside the document."""


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


# Aims ---------------------------------------------------------------------------------------------


def targets(m: Measured) -> list[tuple[str, str, str, bool]]:
    """What is aimed at: words, aim, measured, reached."""
    plain = [s for s in m.scenes if not s.scene.variable and s.scene.exponent in (0.0, 1.0, 2.0)]
    variable = [s for s in m.scenes if s.scene.variable]
    real = [s for s in m.scenes if not s.scene.variable and s.scene.exponent not in (0.0, 1.0, 2.0)]
    found: list[tuple[str, str, str, bool]] = []

    def rate(words: str, aim: float, timings: list[Timing]) -> None:
        if timings:
            least = min(t.rate for t in timings)
            found.append((words, f"{number(aim)} designs/s", number(least), least >= aim))

    def under(words: str, aim: float, value: float) -> None:
        if math.isfinite(value):
            found.append((words, f"below {span(aim)}", span(value), value < aim))

    rate("factorial scenes, constant inertia, alpha 0, 1, 2 (slowest)", 1e7,
         [s.ours[0].timing for s in plain])  # fmt: skip
    rate("factorial scenes, variable inertia (slowest)", 3e6, [s.ours[0].timing for s in variable])
    rate("factorial scenes, any real alpha (slowest)", 1e6, [s.ours[0].timing for s in real])
    most = m.numbers["table"][-1]
    rate(f"table of designs that share nothing, {number(most.count)} at a time", 1e6, [most])
    worst = max(default_of(m.table).errors.worst, *(s.ours[0].errors.worst for s in m.scenes))
    found.append(("largest error of delta in all of these", small(AIM), small(worst), worst <= AIM))
    for words, aim, scenes in (("factorial scenes", 100.0, m.scenes), ("table", 10.0, [])):
        ratios = [
            loop_ratio(s.ours[0], s.peers, LOOP, max(s.ours[0].errors.worst, 1e-10)) for s in scenes
        ]
        if words == "table":
            ours = default_of(m.table)
            ratios = [loop_ratio(ours, m.table, LOOP, max(ours.errors.worst, 1e-10))]
        finite = [r for r in ratios if math.isfinite(r)]
        least = min(finite, default=math.nan)
        found.append((
            f"times the Numba loop's rate at equal error, {words} (least)", number(aim),
            number(least), least >= aim,
        ))  # fmt: skip
    # The first, smaller array has the words of runs on other machines, which had only that.
    for t, size in zip(m.traces, ("", f" ({m.traces[-1].size / 1e6:.0f} MB)"), strict=True):
        words = f"traces{size}: time over that of NumPy writing the array"
        ratio = t.solving / t.fresh
        found.append((words, "2", f"{ratio:.2g}", ratio <= 2.0))
    under("`engine_dyn.periodic_speed`, one design, warm", 1e-3, m.latencies.periodic_speed)
    under("`sweeps.run(dict)`, one design, warm", 20e-3, m.latencies.run)
    under("`engine-dyn run`, one design, cache warm", 2.5, m.latencies.command)
    under("`engine-dyn run`, one design, first ever", 20.0, m.latencies.first_command)
    under("`import engine_dyn` after Numba", 0.3, m.latencies.import_own)
    for each in m.memory:
        found.append((
            f"memory beyond the results, `{each.what}`, {number(each.designs)} designs",
            "150 MB", f"{each.overhead / 1e6:.0f} MB", each.overhead <= 150_000_000,
        ))  # fmt: skip
    return found


def reached_here(m: Measured) -> list[Reached]:
    """The aims of this run, as they are kept."""
    machine = f"{m.processor}, {m.threads} threads, {m.lanes}"
    run = f"{m.flops / 1e9:.0f} Gflop/s, {m.writing / 1e9:.1f} GB/s; {m.date}"
    code = source_hash()[:8]
    return [
        Reached(machine, run, code, what, aim, measured, "yes" if ok else "no")
        for what, aim, measured, ok in targets(m)
    ]


def on_all_machines(here: Sequence[Reached], folder: Path, keep: bool) -> list[Reached]:
    """Aims of this run, which is written down to `keep` it, and of those on other machines."""
    path, kept = folder / MACHINES, []
    if path.is_file():
        with path.open(encoding="utf-8", newline="") as file:
            kept = [Reached(**row) for row in csv.DictReader(file)]
    found = [*here, *(each for each in kept if each.machine != here[0].machine)]
    if keep:
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, [field.name for field in fields(Reached)])
            writer.writeheader()
            writer.writerows(asdict(each) for each in found)
    return found


def text(m: Measured, machines: Sequence[Reached], compiling: Sequence[str]) -> str:
    """The document; `machines` has the aims of this run and of those elsewhere.

    `compiling` is a section that another command measures.
    """
    lines = [
        "# Benchmarks",
        "",
        "<!-- Made by `make bench` (python -m benchmarks); change that, not this. -->",
        "",
        "This page compares run time and error of the solvers in this project with "
        "those of the alternatives, on the same designs and in one run.",
        "",
        f"Machine: {m.processor}, {m.threads} threads, {m.lanes}. Date: {m.date}. "
        + ", ".join(f"{name} {number}" for name, number in m.versions) + ".",
        "",
    ]  # fmt: skip
    if m.quick:
        lines += ["**A quick run: few designs and few settings, to see that it works.**", ""]
    lines += [
        "How it was measured. Times are medians of the wall-clock time of warm runs: "
        "at least 5 runs, 3 of slow peers and of all peers in scenes, 1 of Euler in "
        "Python. The solvers take turns and use all threads. Compile time is stated "
        "separately. Every solver gets as many designs as keep it busy for a while, "
        "always the first ones of the same list. For every solver, tabulating the "
        "torque and finding its mean is part of the timed work. Errors are relative errors of "
        "delta = (omega_max - omega_min)/omega_mean against a Fourier method that shares no code "
        "with the kernels (`benchmarks/problem.py`); it differs by "
        f"{small(m.agreement)} at most from the adaptive integration of `oracle` on "
        f"{m.agreed} designs. The pressure diagram is a closed formula. This project gets it as "
        "points at every half degree; that leaves an error of about 1e-10 to 1e-9, "
        "which finer nodes cannot remove.",
        "",
        *ratios_section(m), *studies_section(m.studies), *quantities_section(m.quantities),
        *sampled_section(m), *targets_section(m),
        *machines_section(machines), *table_section(m),
        *scenes_section(m), *scaling_section(m), *compiling, *rest_section(m),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


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


def sampled_section(m: Measured) -> list[str]:
    """Peers on sampled designs."""
    return [
        "## Sampled designs, beside other solvers", "",
        "Crank ratio, reciprocating mass, speed, inertia, friction, load and number of cylinders "
        "(one to eight) drawn at random; load exponent 2 (`benchmarks/sampled_peers.py`). The "
        "combustion pressure grows in proportion to the load. Peers solve all designs "
        "with the same number of cylinders together. How many times faster, at a "
        "worst error of "
        f"{AIM:g} of the peer:", "",
        *rows(["peer", "times faster"], times_faster(m.sampled)), "",
        *rows(HEAD, [result_row(r, default_of(m.sampled)) for r in m.sampled]), "",
    ]  # fmt: skip


def ratios_section(m: Measured) -> list[str]:
    """Ratios first."""
    ours = default_of(m.table)
    body = times_faster(m.table)
    lines = [
        "## Ratios",
        "",
        f"The table says how many times as many designs per second `auto` (default tolerance, "
        f"worst error "
        f"{small(ours.errors.worst)}) solves as each peer does at a worst error of {AIM:g}, in "
        "the table of designs that share nothing (exponents 0, 1, 1.6 and 2 mixed). The time of a "
        "peer is interpolated between two of its settings. Harmonic balance takes the Fourier "
        "transform of the torque and divides each harmonic by a number, in NumPy. It solves "
        "exponent 2 with constant inertia, where the equation is linear, and nothing else; there "
        "it is compared with `auto` on the same designs.",
        "",
        *rows(["peer", "times faster"], body),
        "",
        "The next table gives the same ratio to the hand-written Numba loop in "
        "factorial scenes, where a clever loop can keep its torque tables from design "
        "to design (shared tables), and to harmonic balance where that can solve the scene. "
        "Equal error means the worst error that `auto` has in that scene. A dash means that the "
        "loop does not reach this error with 2880 steps, or that harmonic balance is not "
        "measured.",
        "",
    ]
    body = []
    for one in m.scenes:
        auto = one.ours[0]
        equal = max(auto.errors.worst, 1e-10)
        body.append([
            one.name,
            *(number(loop_ratio(auto, one.peers, series, error))
              for series in (LOOP, SHARING, BALANCE) for error in (equal, AIM)),
        ])  # fmt: skip
    equal = max(ours.errors.worst, 1e-10)
    body.append([
        "table",
        *(number(loop_ratio(ours, m.table, LOOP, error)) for error in (equal, AIM)), *["-"] * 4,
    ])  # fmt: skip
    head = ["designs", "at equal error", "at 1e-6", "shared tables, equal error", "shared, at 1e-6",
            "harmonic balance, equal error", "harmonic balance, at 1e-6"]  # fmt: skip
    return [
        *lines, *rows(head, body), "",
        "![Time for a design against the error](figures/bench_work_precision.png)", "",
        "*Worst relative error of delta against the time per design, all threads. a: "
        "table of designs that share nothing. b: sampled designs, one to eight "
        "cylinders, any load. c: a factorial scene, load exponent alpha = 2, one "
        "cylinder. In a, harmonic balance has exponent 2 alone. Methods that left designs "
        "unsolved have hollow markers.*", "",
    ]  # fmt: skip


def targets_section(m: Measured) -> list[str]:
    """Reached or not."""
    body = [[w, aim, got, "reached" if ok else "**not reached**"] for w, aim, got, ok in targets(m)]
    return ["## Aims", "", *rows(["what", "aim", "measured", ""], body), ""]


def machines_section(machines: Sequence[Reached]) -> list[str]:
    """The same aims elsewhere; nothing where no other machine is known."""
    runs = {each.machine: each for each in machines}
    if len(runs) < 2:
        return []
    letters = dict(zip(runs, ascii_uppercase, strict=False))
    body: dict[str, list[str]] = {each.what: [each.aim] + ["-"] * len(runs) for each in machines}
    for each in machines:
        missed = "" if each.reached == "yes" else " (**not reached**)"
        body[each.what][1 + list(runs).index(each.machine)] = each.measured + missed
    return [
        "## The aims on other machines", "",
        "Results of the last run of this benchmark on each machine, with the "
        "floating-point rate and the writing rate measured there. A different source "
        "hash means an earlier version of the kernels.", "",
        *(
            f"- {letters[machine]}: {machine}; {each.run}; source hash `{each.code}`"
            f"{' (this run)' if machine == machines[0].machine else ''}."
            for machine, each in runs.items()
        ), "",
        *rows(["what", "aim", *letters.values()], [[what, *cells] for what, cells in body.items()]),
        "",
    ]  # fmt: skip


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


HEAD = ["method", "designs/s", "of auto", "median error", "99 %", "worst", "no answer",
        "first call", "designs x runs", "spread"]  # fmt: skip


def table_section(m: Measured) -> list[str]:
    """All methods and peers on independent designs."""
    ours = default_of(m.table)
    body = [result_row(r, ours) for r in m.table]
    checked = max(r.errors.checked for r in m.table)
    return [
        "## Designs that share nothing",
        "",
        "Each design has its own crank ratio (0.2 to 0.33), reciprocating mass, "
        "speed, inertia and friction; one cylinder; load exponents 0, 1, 1.6 and 2 in "
        "turn. Errors are taken over the first "
        f"{number(checked)} designs at most, or over as many as were solved. First call: its time "
        f"beyond "
        "that of a warm call, mostly compiling; the settings ran in this order in one "
        "process, so a later one reuses kernels compiled for an earlier one. Spread: "
        "time of the slowest run divided by that of the fastest.",
        "",
        *rows(HEAD, body),
        "",
        f"`sweep.solve` alone, given the mean torque of each design: "
        f"{number(m.table_alone.rate)} designs/s. "
        "`closed` solves only the exponents 0 and 2, harmonic balance only 2, and they are timed "
        "on these. `thesis` repeats cycles until one closes. Explicit Euler (`thesis`, Euler "
        "in Python) is timed on the exponents above 0, because at 0 its drift never "
        "ends. Euler in Python is stopped after 3,000 cycles; designs stopped there "
        "count as without an answer.",
        "",
    ]


def scenes_section(m: Measured) -> list[str]:
    """Factorial scenes."""
    lines = [
        "## Factorial scenes",
        "",
        "Grids of inertia, speed and reciprocating mass at one crank ratio, with "
        "scalar results. The loop is shown with the fewest steps for which its worst "
        "error is within 1e-6.",
        "",
    ]
    body = []
    for one in m.scenes:
        auto = one.ours[0]
        row = [
            one.name,
            number(auto.timing.rate),
            number(auto.timing.count),
            small(auto.errors.median),
            small(auto.errors.worst),
            f"{auto.timing.spread:.1f}",
        ]
        for series in (LOOP, SHARING):
            good = [r for r in of_series(one.peers, series) if r.errors.worst <= AIM]
            best = max(good, key=lambda r: r.timing.rate, default=None)
            row.append(f"{number(best.timing.rate)} ({best.case.setting})" if best else "-")
        body.append(row)
    head = ["scene", "auto, designs/s", "designs", "median error", "worst", "spread",
            "Numba loop, designs/s", "shared tables, designs/s"]  # fmt: skip
    lines += [*rows(head, body), ""]
    first = next((s for s in m.scenes if len(series_of(s.peers)) > 2), None)
    if first:
        lines += [f"All results for \"{first.name}\":", "",
                  *rows(HEAD, [result_row(r, first.ours[0]) for r in [*first.ours, *first.peers]]),
                  ""]  # fmt: skip
    return lines


def scaling_section(m: Measured) -> list[str]:
    """Number of designs, threads, cylinders."""
    lines = [
        "## Number of designs, threads, cylinders",
        "",
        "![Throughput against the number of designs](figures/bench_throughput.png)",
        "",
        "*Designs per second against the number of designs in one call of `sweep.solve`.*",
        "",
    ]
    sizes = sorted({t.count for timings in m.numbers.values() for t in timings})
    body = []
    for size in sizes:
        row = [number(size, 3)]
        for timings in m.numbers.values():
            here = [t for t in timings if t.count == size]
            row.append(f"{number(here[0].rate)} ({span(here[0].median)})" if here else "-")
        body.append(row)
    lines += [*rows(["designs", *(f"{name}, designs/s" for name in m.numbers)], body), ""]
    counts = [count for count, _ in next(iter(m.by_threads.values()))]
    body = [
        [name, *(number(t.rate) for _, t in found), f"{found[-1][1].rate / found[0][1].rate:.2f}"]
        for name, found in m.by_threads.items()
    ]
    lines += [
        *rows(["", *(f"{n} thread{'s'[: n > 1]}, designs/s" for n in counts), "ratio"], body), "",
        *rows(["cylinders (alpha 2, factorial)", "designs/s"],
              [[str(z), number(t.rate)] for z, t in m.by_cylinders]), "",
    ]  # fmt: skip
    return lines


def rest_section(m: Measured) -> list[str]:
    """Traces, one design, memory, a big run, what is missing."""
    one = m.latencies
    lines = [
        "## Traces",
        "",
        f"Omega at {m.traces[-1].angles} angles. A call has a fixed cost of some milliseconds, "
        f"which shows in the "
        "smaller array.",
        "",
        *rows(
            ["designs", "MB", "time", "GB/s", "NumPy, new array", "times its time", "array in use"],
            [
                [
                    number(t.designs, 3), f"{t.size / 1e6:.0f}", span(t.solving),
                    f"{t.size / t.solving / 1e9:.2g}", span(t.fresh),
                    f"{t.solving / t.fresh:.2g}", span(t.again),
                ]
                for t in m.traces
            ],
        ),
        "",
        "## One design, start-up, compiling",
        "",
        *rows(["", "time"], [
            ["`engine_dyn.periodic_speed`, warm", span(one.periodic_speed)],
            ["`sweeps.run(dict)`, warm", span(one.run)],
            ["`engine-dyn run`, one design, new process, cache warm", span(one.command)],
            ["`engine-dyn run`, one design, first ever (compiles), of three",
             span(one.first_command)],
            ["compiling, the difference", span(max(one.first_command - one.command, 0.0))],
            ["`import numba`", span(one.import_numba)],
            ["`import engine_dyn` after it", span(one.import_own)],
        ]),
        "",
        "## Memory and a large run",
        "",
        "Peak resident memory that a run adds to a process that has solved one design "
        "before:",
        "",
        *rows(["", "designs", "added", "results", "beyond the results"], [
            [f"`{e.what}`", number(e.designs, 3), f"{e.added / 1e6:.0f} MB",
             f"{e.results / 1e6:.0f} MB", f"{e.overhead / 1e6:.0f} MB"] for e in m.memory
        ]),
        "",
        f"`engine-dyn run`, {number(m.big.designs, 3)} designs (engine `ntua`, inertia x speed x "
        f"reciprocating mass; delta, omega_max, omega_min, omega_mean): {span(m.big.command)} for "
        f"the command, {span(m.big.computing)} of it for computing (`sweeps.run` in this "
        f"process), the rest for starting "
        f"and for writing a file of {m.big.size / 1e6:.0f} MB.",
        "",
    ]  # fmt: skip
    if m.absent:
        lines += ["## Left out", "", *(f"- {line}" for line in m.absent), ""]
    return [*lines, f"The whole benchmark took {m.took / 60.0:.0f} minutes."]


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
    "numbalsoda": ("#999933", ">"),
    "SciPy solve_ivp": ("#555555", "d"),
    "SciPy solve_bvp": ("#999999", "p"),
    "Euler in Python": ("#000000", "x"),
}


def work_precision(m: Measured) -> Figure:
    """Time for a design against error."""
    wide = [s for s in m.scenes if len(series_of(s.peers)) > 2] or m.scenes
    panels = [("a  Designs that share nothing", m.table), ("b  Sampled designs", m.sampled)]
    if wide:
        panels.append(
            (f"c  Factorial, α = {wide[0].scene.exponent:g}", [*wide[0].ours, *wide[0].peers])
        )
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
    """Document and figures below `folder`."""
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    machines = on_all_machines(reached_here(m), folder, keep=not m.quick)
    document = text(m, machines, kept_section(folder))
    (folder / "benchmarks.md").write_text(document, encoding="utf-8")
    style: Any = STYLE
    with matplotlib.rc_context(style):
        for name, figure in (("work_precision", work_precision(m)), ("throughput", throughput(m))):
            FigureCanvasAgg(figure)
            # 200 dpi: sharp in print at column width, small in the repository.
            figure.savefig(folder / "figures" / f"bench_{name}.png", dpi=200, metadata={})
