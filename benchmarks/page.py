"""docs/benchmarks.md: ten results and what they mean, from CSV files that lie beside the page.

`make bench`, `python -m benchmarks.engines` and `make compile-times` write the files below
docs/benchmarks, and this the page.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from benchmarks.studies import study
from benchmarks.wording import rows

__all__ = ["FACTS", "TABLES", "facts_of", "read", "save", "save_facts", "text", "write"]

FOLDER = "benchmarks"
"""Of the files, beside the page."""

FACTS = "facts"
"""File of single numbers and words: the machine, the day and others."""

TABLES: Mapping[str, tuple[str, str]] = {
    "peers": (
        "Other solvers",
        "How many times as many designs per second `auto` solves as each peer at a worst error of "
        "1e-6; the time of a peer is interpolated between two of its settings. *Share nothing*: "
        "each design has its own crank ratio (0.2 to 0.33), reciprocating mass, speed, inertia "
        "and friction; one cylinder; load exponents 0, 1, 1.6 and 2 in turn. *Sampled*: load and "
        "number of cylinders (1 to 8) drawn too, exponent 2 "
        "(`benchmarks/sampled_peers.py`). Harmonic balance divides each harmonic of the torque by "
        "a number, in NumPy; it solves exponent 2 with constant inertia and nothing else, and is "
        "compared on such designs.",
    ),
    "loop": (
        "The Numba loop in factorial scenes",
        "The same ratio to the loop, which may keep its torque tables from design to design "
        "(shared tables), and to harmonic balance. Equal error: the worst that `auto` has in that "
        "scene. A dash: not reached with 2880 steps, or not measured.",
    ),
    "studies": (
        "Studies",
        "Scenes as people write them (`benchmarks/studies.py`), computed in memory by "
        "`sweeps.run` with four scalar results, engine `ntua` unless another is named. Ratio: to "
        "\"one table\", another study, or the hand-written Numba loop ({loop_steps} steps, "
        "exponent 2, one cylinder, no scene around it), which did {loop_rate} designs/s in this "
        "run with a worst error of {loop_error}. Deferred: share of the designs that the batch "
        "solver passed on to the general one. General: share of all designs that the general "
        "solver solved. Errors are relative, the largest of {checked} designs drawn at random "
        "from each study, against the independent solvers of `oracle`, whose own error is about "
        "1e-8 where they need smooth curves. Compiling: first run less the next; later studies "
        "reuse the kernels of earlier ones.",
    ),
    "quantities": (
        "Quantities",
        "One quantity each of randomly sampled designs, in memory, {threads} threads "
        "(`benchmarks/quantity_times.py`); one stands for all that are computed together. Orders "
        "are 1/2 to 6; main journals are those of one to eight cylinders. Over the loop: of the "
        "studies. Before: on one core, before the quantity had a kernel of its own, on another "
        "day and beside other work.",
    ),
    "apart": (
        "Designs that share nothing",
        "All settings of all solvers. Errors are taken over the first {checked_apart} designs at "
        "most. First call: its time beyond a warm call's, mostly compiling. Spread: slowest run "
        "over quickest. `closed` has exponents 0 and 2 alone, harmonic balance 2, explicit Euler "
        "those above 0, because at 0 its drift never ends. `thesis` repeats cycles until one "
        "closes. Euler in Python is stopped after 3,000 cycles and counts as without an answer "
        "then. `sweep.solve` alone, given the mean torques: {alone_rate} designs/s.",
    ),
    "sampled": (
        "Sampled designs",
        "The same columns. The combustion pressure grows in proportion to the load. Peers solve "
        "all designs with the same number of cylinders together.",
    ),
    "factorial": (
        "Factorial scenes",
        "Grids of inertia, speed and reciprocating mass at one crank ratio. The loop has the "
        "fewest steps for which its worst error is within 1e-6.",
    ),
    "factorial_all": ("All solvers in \"{widest_scene}\"", "Columns as above."),
    "numbers": ("Number of designs", "In one call of `sweep.solve`."),
    "threads": ("Threads", "Rates with one and with all threads."),
    "cylinders": ("Cylinders", "Rates of a factorial scene, exponent 2."),
    "even_engines": (
        "Engines that fire evenly",
        "Processor time per design in microseconds, one thread, the least of 15 runs, of engines "
        "of the catalogue beside the plain in-line engine with the same number of cylinders, "
        "bore, stroke, masses and diagrams; their runs alternate ({engines}, shared with others: "
        "runs differ by a third or more, and a ratio below 1 is no gain). Sharing: "
        "{engines_designs} designs over inertia, speed and mass share a table. Own tables: "
        "{engines_tables} crank ratios. The ratios are {engines_ratios}.",
    ),
    "uneven_engines": (
        "Uneven, offset and unequal engines",
        "The same; the ratio is to the even engine with as many equal cylinders and no offset. "
        "Where designs share a table, a design costs in proportion to the nodes in one period of "
        "its torque: with cylinders of unequal mass the torque repeats once per cycle instead of "
        "Z times. An offset or friction over the stroke costs nothing beyond making the table. A "
        "table of its own is a sum of columns, made once for all designs, for each diagram and "
        "each cylinder that is no copy of another; with an offset there are six times as many to "
        "add up. Parameters of single cylinders (`mass_factor_3`) make each design an engine of "
        "its own, whose diagrams are sampled again: some milliseconds, ten times as long as a "
        "table.",
    ),
    "compiling": (
        "Compiling",
        "Processor time (all threads) that a first run takes beyond the next one. "
        "`engine-dyn run thesis` began with an empty cache. The studies ({compiled_designs} "
        "designs each) followed, each in a process of its own, with what the rows above had left "
        "there: a dash means that nothing was left to compile. The last row began with an empty "
        "cache again. Measured by `make compile-times` on {compiled}.",
    ),
    "traces": (
        "Traces",
        "Omega at {angles} angles. A call has a fixed cost of some milliseconds, which shows in "
        "the smaller array.",
    ),
    "single": ("One design", "Warm calls, start-up and the first command ever."),
    "memory": (
        "Memory",
        "Peak resident memory that a run adds to a process that has solved one design.",
    ),
    "machines": (
        "Aims",
        "Reached or not in the last run on each machine, with the floating-point rate and the "
        "writing rate measured there. A different source hash means other kernels.",
    ),
}  # fmt: skip
"""Files by name, in the page's order: a title, and what the columns mean. Braces hold facts."""

SHOWN = ("one_table", "sampled", "v6_misfire", "modelled")
"""Studies whose rates stand on the page."""


def save(folder: Path, name: str, head: Sequence[str], body: Iterable[Sequence[str]]) -> None:
    """Write a table as a file; names and numbers stand in it without marks."""
    path = folder / FOLDER / f"{name}.csv"
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerows([re.sub(r"`|\*\*", "", cell) for cell in row] for row in (head, *body))


def read(folder: Path, name: str) -> list[dict[str, str]]:
    """Rows of a file; none where it was not written."""
    path = folder / FOLDER / f"{name}.csv"
    if not path.is_file():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def facts_of(folder: Path) -> dict[str, str]:
    """Single numbers and words by their names."""
    return {row["fact"]: row["value"] for row in read(folder, FACTS)}


def save_facts(folder: Path, facts: Mapping[str, str]) -> None:
    """Add facts to those that are kept, or replace them."""
    save(folder, FACTS, ["fact", "value"], list((facts_of(folder) | dict(facts)).items()))


def _column(folder: Path, name: str, key: str, value: str) -> dict[str, str]:
    """One column of a file by the entries of another."""
    return {row[key]: row[value] for row in read(folder, name)}


def results(folder: Path) -> list[list[str]]:
    """Ten results: what, how much, and what it means."""
    facts = facts_of(folder)
    rates = _column(folder, "studies", "study", "designs/s")
    times = {row["peer"]: row for row in read(folder, "peers")}
    single = _column(folder, "single", "what", "time")
    meaning = (
        "a grid whose designs share their diagrams: the quickest kind",
        "every design has its own crank ratio, mass, load and cylinders",
        "a missing cylinder makes the torque repeat once a cycle only",
        "every design has a modelled cycle of its own: the slowest kind",
    )
    found = [
        [f"study \"{words}\"", f"{rates.get(words, '-')} designs/s", means]
        for words, means in zip((study(name).words for name in SHOWN), meaning, strict=True)
    ]  # fmt: skip

    def against(*peers: str) -> str:
        return ", ".join(
            f"{times[name]['share nothing']} ({name})" for name in peers if name in times
        )

    return [
        *found,
        ["times as many designs/s as loops written by hand", against("Numba loop", "NumPy steps"),
         "at a worst error of 1e-6, designs that share nothing; at the error of `auto` "
         f"({facts['worst']}) the Numba loop is {facts['loop_equal']} times slower"],
        ["times as many as solvers from libraries",
         against("SciPy solve_ivp", "JAX scan", "Diffrax", "heyoka", "numbalsoda"), "the same"],
        ["times as many as harmonic balance in NumPy",
         times.get("Harmonic balance (exponent 2 alone)", {}).get("share nothing", "-"),
         "exponent 2 and constant inertia alone, where the equation is linear"],
        ["largest error of delta", facts["worst"],
         "against a Fourier method that shares no code; asked for: 1e-6"],
        ["one design", f"{single['engine_dyn.periodic_speed, warm']}; "
         f"{single['engine-dyn run, one design, new process, cache warm']}; "
         f"{single['engine-dyn run, one design, first ever (compiles), of three']}",
         "`engine_dyn.periodic_speed`; a command; the first command ever, which compiles"],
        ["a large run", facts["big_run"], facts["big_run_means"]],
    ]  # fmt: skip


def text(folder: Path) -> str:
    """The page, from the files beside it."""
    facts = facts_of(folder)
    lines = [
        "# Benchmarks",
        "",
        "<!-- Made by `make bench` (python -m benchmarks); change that, not this. -->",
        "",
        "Run time and error of the solvers in this project beside those of the "
        "alternatives, on the same designs and in one run.",
        "",
        f"Machine: {facts['machine']}. Date: {facts['date']}. {facts['versions']}.",
        "",
    ]
    if facts["quick"] == "yes":
        lines += ["**A quick run: few designs and few settings, to see that it works.**", ""]
    lines += [
        *rows(["what", "result", "what it means"], results(folder), right=False),
        "",
        f"Of {facts['aims']} [aims](benchmarks/machines.csv) this run reached {facts['reached']}.",
        "",
        "![Time for a design against the error](figures/bench_work_precision.png)",
        "",
        "*Worst relative error of delta against the time per design, all threads. a: "
        "table of designs that share nothing. b: sampled designs, one to eight "
        "cylinders, any load. c: a factorial scene, load exponent alpha = 2, one "
        "cylinder. In a, harmonic balance has exponent 2 alone. Methods that left designs "
        "unsolved have hollow markers.*",
        "",
        "![Throughput against the number of designs](figures/bench_throughput.png)",
        "",
        "*Designs per second against the number of designs in one call of `sweep.solve`.*",
        "",
        "## How it was measured",
        "",
        "Times are medians of the wall-clock time of warm runs: at least 5 runs, 3 of slow peers "
        "and of all peers in scenes, 1 of Euler in Python. The solvers take turns and use all "
        "threads, on as many designs as keep them busy for a while, always the first ones of the "
        "same list. Tabulating the torque and finding its mean is part of the timed work. "
        "Errors are relative errors of delta = (omega_max - omega_min)/omega_mean against a "
        "Fourier method that shares no code with the kernels (`benchmarks/problem.py`); it "
        f"differs by {facts['agreement']} at most from the adaptive integration of `oracle` on "
        f"{facts['agreed']} designs. The pressure diagram is a closed formula, which this project "
        "gets as points at every half degree; that leaves an error of about 1e-10 to 1e-9, which "
        f"finer nodes cannot remove. The whole benchmark took {facts['minutes']} minutes.",
        "",
        "## All rows",
        "",
        *(
            f"- [{title.format(**facts)}](benchmarks/{name}.csv). {words.format(**facts)}"
            for name, (title, words) in TABLES.items()
            if read(folder, name)
        ),
        "",
    ]  # fmt: skip
    if facts["absent"]:
        lines += [f"Left out: {facts['absent']}.", ""]
    return "\n".join(lines)


def write(folder: Path) -> None:
    """Write the page beside its files."""
    (folder / "benchmarks.md").write_text(text(folder), encoding="utf-8")
