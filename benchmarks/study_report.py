"""Times of the kinds of study as tables: ratios first, aims beside them."""

from __future__ import annotations

import math

from benchmarks.study_times import Measurement, Studies, ratio_of
from benchmarks.wording import number, rows, small, span
from engine_dyn.speed.mechanisms import BATCH

__all__ = ["HEAD", "body", "table"]

HEAD = ["study", "ratio", "aim", "long-term aim", "over", "designs/s", "designs", "deferred",
        "general", "error of delta", "of speeds", "delta_error covers", "status 0",
        "compiling"]  # fmt: skip


def body(found: Studies) -> list[list[str]]:
    """One row a study; ratios below their aim are bold."""
    return [_row(found, row) for row in found.rows]


def table(found: Studies) -> list[str]:
    """The rows in Markdown."""
    return rows(HEAD, body(found))


def _row(found: Studies, row: Measurement) -> list[str]:
    aim = row.study.aim
    ratio, wanted, hoped_for, to = math.nan, "-", "-", "-"
    if aim is not None:
        ratio, wanted, to = ratio_of(found, row), f"{aim.wanted:.2g}", aim.of
        hoped_for = "-" if aim.hoped_for is None else f"{aim.hoped_for:.2g}"
    reached = aim is None or not math.isfinite(ratio) or ratio >= aim.wanted
    shown = "-" if not math.isfinite(ratio) else f"{ratio:.2g}"
    tally, errors = row.tally, row.errors
    left = tally.deferred / (tally.designs[BATCH] or math.nan)
    holds = "-" if math.isnan(errors.honest) else _percent(errors.honest)
    return [
        row.study.words, shown if reached else f"**{shown}**", wanted, hoped_for, to,
        number(row.timing.rate), number(row.timing.count, 6), _percent(left),
        _percent(tally.general_share), small(errors.delta), small(errors.speeds), holds,
        _percent(row.converged), "-" if row.compiling < 0.05 else span(row.compiling),
    ]  # fmt: skip


def _percent(share: float) -> str:
    """A share, with two digits where it is small."""
    return "-" if math.isnan(share) else f"{100.0 * share:.3g} %"
