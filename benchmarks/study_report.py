"""Times of the kinds of study as tables: ratios first, aims beside them."""

from __future__ import annotations

import math

from benchmarks.studies import LOOP, ONE_TABLE
from benchmarks.study_times import LOOP_STEPS, Measurement, Studies, ratio_of
from benchmarks.wording import number, rows, small, span
from engine_dyn.speed.mechanisms import BATCH

__all__ = ["studies_section", "table"]

HEAD = ["study", "ratio", "aim", "long-term aim", "over", "designs/s", "designs", "deferred",
        "general", "error of delta", "of speeds", "delta_error covers", "status 0",
        "compiling"]  # fmt: skip


def table(found: Studies) -> list[str]:
    """One row a study, in Markdown."""
    return rows(HEAD, [_row(found, row) for row in found.rows])


def _row(found: Studies, row: Measurement) -> list[str]:
    aim = row.study.aim
    ratio, wanted, dream, to = math.nan, "-", "-", "-"
    if aim is not None:
        ratio, wanted, to = ratio_of(found, row), f"{aim.wanted:.2g}", aim.of
        dream = "-" if aim.dream is None else f"{aim.dream:.2g}"
    reached = aim is None or not math.isfinite(ratio) or ratio >= aim.wanted
    shown = "-" if not math.isfinite(ratio) else f"{ratio:.2g}"
    tally, errors = row.tally, row.errors
    left = tally.deferred / (tally.designs[BATCH] or math.nan)
    holds = "-" if math.isnan(errors.honest) else _percent(errors.honest)
    return [
        row.study.words, shown if reached else f"**{shown}**", wanted, dream, to,
        number(row.timing.rate), number(row.timing.count, 6), _percent(left),
        _percent(tally.general_share), small(errors.delta), small(errors.speeds), holds,
        _percent(row.converged), "-" if row.compiling < 0.05 else span(row.compiling),
    ]  # fmt: skip


def _percent(share: float) -> str:
    """A share, with two digits where it is small."""
    return "-" if math.isnan(share) else f"{100.0 * share:.3g} %"


def studies_section(found: Studies) -> list[str]:
    """What people run."""
    checked = [row.errors.designs for row in found.rows]
    return [
        "## Studies", "",
        "These are scenes as people write them, computed in memory by `sweeps.run` "
        "with four scalar results and the engine `ntua` unless another is named "
        "(`benchmarks/studies.py`). Ratio: designs per second divided by those of "
        f"\"{ONE_TABLE}\", of another study, or of \"{LOOP}\": the hand-written Numba loop that "
        f"tabulates each design by itself ({LOOP_STEPS} steps, exponent 2, one cylinder, no scene "
        f"around it), which did {number(found.loop.rate)} designs/s in this run with a worst error "
        f"of {small(found.loop_errors.worst)}. A ratio below its aim is bold. Deferred: share of "
        f"the designs given to the "
        "batch solver that it passed on to the general solver. General: share of all "
        "designs that the general solver solved. Errors are relative: the largest of "
        f"{min(checked, default=0)} to {max(checked, default=0)} designs drawn at random from each "
        "study, against the independent solvers of `oracle`; where an independent solver is made "
        "for smooth curves only, its own error is "
        "about 1e-8. Compiling: how much longer the first run took than the next. The "
        "studies ran in this order in one process, so a later study reuses the "
        "kernels compiled for an earlier one.",
        "", *table(found), "",
    ]  # fmt: skip
