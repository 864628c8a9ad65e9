"""Distributions of quantities over all designs, from the statistics of [reduce]."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.types import Floats
from sweeps.base.dimensions import REDUCTION
from sweeps.view.figures.marks import shade
from sweeps.view.figures.scales import log_ticks
from sweeps.view.figures.sheet import Entries, NamedFigures, multiples
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_PANELS, View, facet_of
from sweeps.view.figures.wording import middle_of_sentence, name_of, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def statistics_names(view: View) -> set[str]:
    """Variables of a reduced archive that hold no values of designs."""
    if REDUCTION not in view.data.attrs:
        return set()
    computed = json.loads(view.data.attrs[REDUCTION])["quantities"]
    return {str(name) for name in view.data.data_vars} - {*computed}


def distribution_names(view: View) -> list[str]:
    """Histograms of more than one bin."""
    known = statistics_names(view)
    return [
        str(name) for name, v in view.data.data_vars.items()
        if name in known and str(name).endswith("_histogram")
        and str(name).removesuffix("_histogram") + "_bin" in v.dims
    ]  # fmt: skip


def distributions(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the histogram of each quantity, with its mean and quantiles."""
    for name in names:
        quantity = name.removesuffix("_histogram")
        along, statistics = quantity + "_bin", [f"{quantity}_{key}" for key in ("mean", "quantile")]
        facet = facet_of(study.view, [name], (along,))
        view = study.view.only([name, *statistics], [along, facet, "quantile"])
        axis = view.axis(facet)
        picked = axis.picked(MOST_PANELS)
        edges = np.append(view.numbers(f"{along}_low"), view.numbers(f"{along}_high")[-1])
        widths = np.diff(edges)
        by_ratio = bool(widths.max() > 1.5 * widths.min())
        sheet = multiples(len(picked), 0.8, 2.0, sharex=True, sharey=True)
        for panel, index in zip(sheet.panels, picked, strict=True):
            at = axis.place(index)
            shares = 100.0 * view.numbers(name, at) / max(view.numbers(name, at).sum(), 1.0)
            if by_ratio:
                shares /= np.diff(np.log10(edges))
            panel.stairs(shares, edges, fill=True, color=shade(0.75), linewidth=0.0)
            _mark(panel, view, quantity, at, sheet.entries, told=not axis)
            if axis:
                panel.set_title(axis.heading(at))
        for panel in sheet.panels:
            panel.set_xlim(edges[0], edges[-1])
            panel.set_ylim(bottom=0.0)
            if by_ratio:
                panel.set_xscale("log")
                log_ticks(panel.xaxis, edges[0], edges[-1], few=sheet.columns > 1)
        sheet.label_x(view.label(along), 5.4 / sheet.columns)
        sheet.label_y(f"Share of the values (%{' per decade' * by_ratio})", 1.6)
        number = int(view.numbers(name).sum())
        notes = [*view.notes([name]), f"{number:,} values", axis.picked_text(MOST_PANELS)]
        what = middle_of_sentence(name_of(view.array(along), quantity))
        title = axis.by(f"Distribution of the {what}")
        yield f"distribution_{quantity}{view.suffix}", sheet.finish(title, notes)


def _mark(
    panel: Axes, view: View, quantity: str, at: Mapping[str, int], entries: Entries, *, told: bool
) -> None:
    """Draw lines at the mean and at quantiles, with the numbers in a single panel's legend."""
    of = view.array(f"{quantity}_mean")
    mean = float(view.numbers(f"{quantity}_mean", at))
    values = np.atleast_1d(view.numbers(f"{quantity}_quantile", at))
    shares = np.atleast_1d(view.numbers("quantile"))
    middle = shares == 0.5
    lines: list[tuple[str, Floats, str]] = [
        ("Mean", np.array([mean]), "-"),
        ("Median", values[middle], "--"),
        (f"Quantiles {', '.join(f'{100 * s:g}' for s in shares[~middle])} %", values[~middle], ":"),
    ]
    for text, places, style in lines:
        for place in places[np.isfinite(places)]:
            line = panel.axvline(place, color="black", linestyle=style, linewidth=1.1)
            numbers = ", ".join(with_unit(of, value) for value in places)
            entries.setdefault(f"{text}: {numbers}" if told else text, line)
