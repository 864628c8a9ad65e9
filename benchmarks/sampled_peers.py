"""What one would use instead, on sampled designs: any crank ratio, load and number of cylinders.

Designs share nothing, not even the number of cylinders, of which each has one to eight. Peers solve
those of each number together, this project solves all at once.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from benchmarks import measure, own, problem
from benchmarks.measure import Result, Timing
from benchmarks.peers import Case
from benchmarks.problem import Designs
from engine_dyn.speed import dispatch
from engine_dyn.types import Floats

__all__ = ["compare", "groups", "own_cases"]

MOST_CYLINDERS = 8

Groups = Sequence[Designs]
Work = Callable[[Groups], Floats]

FAMILY = problem.family_of_loads()

LEFT_OUT = ("Euler in Python", "Numba loop, shared tables", "SciPy solve_bvp")
"""Peers that are not measured here: one is written for one cylinder and one load, one shares
nothing here, one is SciPy's slower."""


def groups(size: int) -> list[Designs]:
    """Designs by their number of cylinders, as many of each."""
    each = max(1, size // MOST_CYLINDERS)
    return [problem.sampled(each, count) for count in range(1, MOST_CYLINDERS + 1)]


def answer(some: Groups, threads: int, **options: Any) -> Floats:
    """Delta of all designs by one call of this project."""
    parts = [problem.own_inputs(each, FAMILY) for each in some]
    columns: dict[str, Any] = {
        name: value
        if isinstance(value, str) or name == "family"
        else np.concatenate(
            [np.broadcast_to(p[name], len(g)) for p, g in zip(parts, some, strict=True)]
        )
        for name, value in parts[0].items()
    }
    delta: Floats = dispatch.solve(wanted=("delta",), threads=threads, **columns, **options)[
        "delta"
    ]
    return delta


def own_cases(threads: int, quick: bool) -> list[tuple[Case, Work]]:
    """Cases of this project, at several tolerances."""
    found: list[tuple[Case, Work]] = []
    for tolerance in (1e-6,) if quick else (1e-6, 1e-4, 1e-8):
        case = Case("auto", f"tolerance {tolerance:.0e}", own.own(threads, tolerance=tolerance))
        found.append((case, partial(answer, threads=threads, tolerance=tolerance)))
    return found


def by_groups(case: Case) -> Work:
    """A peer on the designs of one number of cylinders after the other."""
    return lambda some: np.concatenate([case.solve(each) for each in some])


def compare(peers: Sequence[Case], threads: int, quick: bool, seconds: float) -> list[Result]:
    """Time this project and peers on sampled designs, all taking turns run by run.

    Each solves as many of the first designs of each number of cylinders as take about `seconds`.
    """
    whole = groups(2_000 if quick else 400_000)
    checked = 2 if quick else 25
    exact = [problem.reference(each.take(slice(0, checked))) for each in whole]
    chosen = [case for case in peers if case.series not in LEFT_OUT]
    cases = [*own_cases(threads, quick), *((case, by_groups(case)) for case in chosen)]

    def first(count: int) -> list[Designs]:
        return [each.take(slice(0, max(1, count // MOST_CYLINDERS))) for each in whole]

    def solve(work: Work, count: int) -> Floats:
        return work(first(count))

    sizes, firsts = [], []
    for case, work in cases:
        firsts.append(measure.seconds_of(work, first(1)))
        most = min(case.most, len(whole) * len(whole[0]))
        sizes.append(measure.enough(partial(solve, work), seconds, most, case.least))
    times: list[list[float]] = [[] for _ in cases]
    found: list[Any] = [None] * len(cases)
    for turn in range(max(case.runs for case, _ in cases)):
        for i, (case, work) in enumerate(cases):
            if turn < case.runs:
                some = first(sizes[i])
                begin = time.perf_counter()
                found[i] = work(some)
                times[i].append(time.perf_counter() - begin)
    results = []
    for i, (case, _) in enumerate(cases):
        delta = found[i].reshape(len(whole), -1)
        known = min(checked, delta.shape[1])
        errors = measure.errors_of(
            delta[:, :known].reshape(-1), np.concatenate([each[:known] for each in exact])
        )
        results.append(Result(case, Timing(delta.size, tuple(times[i])), errors, firsts[i]))
    return results
