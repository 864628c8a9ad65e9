"""Designs of the big draw again, by the independent solver of oracle/spline.py."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from itertools import groupby
from typing import Any

import numpy as np

from benchmarks.stress import draw
from benchmarks.stress.chunks import example
from benchmarks.stress.findings import DEFECTS, Findings, gathered
from engine_dyn.status import (
    CONVERGED,
    INVALID_INPUT,
    MEANINGS,
    NO_STEADY_STATE,
    NOT_CONVERGED,
    STALLED,
    TOLERANCE_NOT_MET,
)
from oracle import spline

QUANTITIES = ("delta", "omega_max", "omega_min", "omega_mean")
TOLERANCE = 1e-6

BORDER = 1e-3
"""Smallest (omega/omega_n)^2 below which running and stalled are told apart by a hair: the kernels
call a solution below 1e-6 a stall."""

CLEARLY = 0.01
"""Relative difference that is one, however doubtful the last digits of the solver."""

VERDICTS = {
    "agrees": "same outcome, and numbers within the tolerance",
    "honest": "status 5, and the true errors of δ and of ω_min are within δ_error",
    "gave up": "status 3: there is a solution or a stall, but none was found",
    "border": "at the limit between running and stalling: smallest ω below 3 % of nominal",
    "rounding": "numbers differ by no more than 1e-13 of the speed (δ itself below 1e-7)",
    "unknown": "the independent solver has no answer, or none accurate to a tenth of the tolerance",
    "off": "numbers beyond the tolerance",
    "outcome": "another outcome",
}


def judge(
    found: dict[str, Any], exact: spline.Solutions, nominal: Any
) -> tuple[Any, dict[str, Any]]:
    """Verdict of each design, and relative differences of the quantities."""
    status, true = found["status"], exact.status
    differs = {}
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        for name in QUANTITIES:
            differs[name] = np.abs(found[name] / getattr(exact, name) - 1.0)
        differs["delta"] = np.where(
            (exact.delta == 0.0) & (found["delta"] == 0.0), 0.0, differs["delta"]
        )
        worst = np.max([differs[name] for name in QUANTITIES], axis=0)
        small = np.abs(found["delta"] - exact.delta) <= 1e-13
        small &= np.max([differs[name] for name in QUANTITIES[1:]], axis=0) <= 1e-13
        # Who claims to have seen a design run by a hair must have seen the hair.
        near = np.abs(exact.lowest) < BORDER
        near &= np.isnan(found["omega_min"]) | (found["omega_min"] < 0.1 * nominal)
        clearly = (worst > CLEARLY) & (status == CONVERGED)
        understood = (true != spline.UNDECIDED) & ~(
            (true == spline.CONVERGED) & (exact.doubt > 0.1 * TOLERANCE)
        )
        within = worst <= TOLERANCE
        either = np.maximum(differs["delta"], differs["omega_min"])
        honest = either <= np.maximum(found["delta_error"], TOLERANCE)
    runs, stalls = true == spline.CONVERGED, true == spline.STALLED
    kind = np.select(
        [
            (status == NO_STEADY_STATE) | (true == spline.NO_STEADY_STATE),
            (status == INVALID_INPUT) | (true == spline.INVALID_INPUT),
            (true != spline.UNDECIDED) & (status == NOT_CONVERGED),
            (status == STALLED) & stalls,
            (status == CONVERGED) & runs & within,
            (status == TOLERANCE_NOT_MET) & runs & honest,
            np.isin(status, (CONVERGED, TOLERANCE_NOT_MET)) & runs & small,
            near & (true != spline.UNDECIDED),
            ~understood & ~clearly,
            np.isin(status, (CONVERGED, TOLERANCE_NOT_MET)) & runs,
        ],
        [
            np.where((status == NO_STEADY_STATE) == (true == spline.NO_STEADY_STATE), "agrees",
                     "outcome"),
            np.where((status == INVALID_INPUT) == (true == spline.INVALID_INPUT), "agrees",
                     "outcome"),
            "gave up", "agrees", "agrees", "honest", "rounding", "border", "unknown", "off",
        ],
        "outcome",
    )  # fmt: skip
    return kind, differs


def compare(job: tuple[int, int, int, list[int]]) -> Findings:
    """Solve the chosen designs of one chunk by both."""
    seed, number, size, index = job
    chunk = draw.chunk(seed, number, size)
    columns = chunk.flat(index)
    part = draw.Chunk(columns, chunk.closure, (len(index),), chunk.seed)
    exact = draw.exact(columns, chunk.closure)
    return agreement_of(part, part.solve(threads=1), exact, index)


def agreement_of(
    part: draw.Chunk, found: dict[str, Any], exact: spline.Solutions, index: list[int]
) -> Findings:
    """Verdicts on designs that both have solved, by status."""
    kind, differs = judge(found, exact, part.columns["speed"])
    result = Findings(Counter(zip(found["status"].tolist(), kind.tolist(), strict=True)))
    good = (found["status"] == CONVERGED) & (kind == "agrees")
    for name in QUANTITIES:
        result.note(name, float(np.max(differs[name][good], initial=0.0)))
    for i in np.flatnonzero(np.isin(kind, (*DEFECTS, "gave up", "unknown"))):
        answers = {
            name: float(getattr(exact, name)[i]) for name in ("lowest", "doubt", *QUANTITIES)
        }
        result.examples.append({
            **example(part, int(i), found),
            "index": index[i],
            "verdict": str(kind[i]),
            "differs": {name: float(differs[name][i]) for name in QUANTITIES},
            "exact": {"status": MEANINGS[exact.status[i]], **answers},
        })  # fmt: skip
    return result


def run(
    seed: int, picked: list[tuple[int, int]], size: int, processes: int, say: Callable[[str], None]
) -> Findings:
    """Compare the picked designs (chunk, index), in processes of their own."""
    jobs = [
        (seed, number, size, [index for _, index in group])
        for number, group in groupby(sorted(picked), key=lambda pair: pair[0])
    ]
    return gathered(compare, jobs, processes, say, "sample, chunks")
