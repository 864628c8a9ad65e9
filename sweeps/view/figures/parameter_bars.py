"""Bars of parameters and components: elasticities, indices, shares of uncertainty, friction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.types import Floats, Integers
from sweeps.base.dimensions import ELASTICITY, EXPLAINED, HIGH, LOW, PARAMETER, SHARE, UNCERTAIN
from sweeps.base.errors import counted
from sweeps.view.figures.marks import shade
from sweeps.view.figures.scales import parameter_ticks
from sweeps.view.figures.sheet import Entries, NamedFigures, finish, new_sheet, rc, x_label, y_label
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import StudyAxis, View, stem_of
from sweeps.view.figures.wording import (
    middle_of_sentence,
    name_of,
    sentence,
    symbol_of,
    typeset,
    value_text,
    with_unit,
    wrap,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Largest number of parameters of one chart; less important ones are left out, and counted
MOST_BARS = 14


def name_rows(panel: Axes, texts: Sequence[str], label: str) -> None:
    """Name the rows of a chart of bars, the first at the top, and its abscissa."""
    panel.set_yticks(range(len(texts)), texts)
    panel.invert_yaxis()
    panel.tick_params(axis="y", length=0.0)
    panel.grid(visible=False, axis="y")
    x_label(panel, label, 5.0)


def _parameters(view: View, places: Integers, along: str = PARAMETER) -> list[str]:
    """Long names of parameters, without explanations after the first comma."""
    texts = view.data[f"{along}_long_name"].values[places]
    return [wrap(sentence(str(text).split(",")[0]), 34) for text in texts]


def _largest_first(values: Floats, least: float) -> Integers:
    """Places of the values that are large enough, the largest first."""
    order = np.argsort(-values, kind="stable")
    return order[values[order] >= least][:MOST_BARS]


def tornado_names(view: View) -> list[str]:
    """Elasticities and what belongs to them."""
    named = [str(name) for name in view.data.data_vars if PARAMETER in view.array(str(name)).dims]
    more = [f"{ELASTICITY}_{end}" for end in ("error", "below", "above", "kind")]
    return [name for name in named if name.endswith((ELASTICITY, "_derivative", *more))]


def tornados(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the elasticities of each result at the nominal design."""
    for name in names:
        if not name.endswith(ELASTICITY):
            continue
        view = study.view.only([one for one in names if one.startswith(name)], [PARAMETER])
        values = view.array(name).values
        sizes = np.nan_to_num(np.abs(values))
        if not sizes.any():
            continue
        shown = _largest_first(sizes, 1e-3 * sizes.max())
        quantity = name.removesuffix(ELASTICITY)
        figure, (panel,) = new_sheet(1, 1, 1.1 + 0.3 * shown.size)
        rows = np.arange(shown.size)
        panel.barh(rows, values[shown], height=0.62, color=shade(0.35))
        entries: Entries = {}
        # Kind 1 means that derivatives on both sides of the nominal value differ.
        bent = view.array(f"{name}_kind").values[shown] == 1
        for side, change, marker in (("below", "falls", "<"), ("above", "rises", ">")):
            if bent.any():
                x, y = view.array(f"{name}_{side}").values[shown][bent], rows[bent]
                (marks,) = panel.plot(x, y, f"k{marker}", markersize=5.0)
                entries[f"Where the parameter {change}, if different"] = marks
        panel.axvline(0.0, color="black", linewidth=0.8)
        panel.margins(x=0.08)
        of = study.view.array(quantity)
        label = f"Change of {symbol_of(of) or quantity} in % for 1 % of the parameter"
        name_rows(panel, _parameters(view, shown), label)
        notes = view.notes([name])
        left_out = int(np.isfinite(values).sum()) - shown.size
        if left_out:
            notes.append(f"{left_out} more parameters have almost no effect")
        title = f"Elasticities of the {name_of(of, quantity)}"
        finished = finish(figure, title, notes, entries, "", view.caption, below=True)
        yield f"tornado_{quantity}{view.suffix}", finished


def index_names(view: View) -> list[str]:
    """Indices and what belongs to them: `engine-dyn sensitivities` writes them."""
    if "sensitivity_method" not in view.data.attrs:
        return []
    return [str(name) for name in view.data.data_vars]


def sensitivities(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw first-order and total indices of each quantity, with their confidence intervals."""
    for name in names:
        quantity, first_order, ending = name.partition("_first")
        if not first_order or ending not in ("", "_conditional"):
            continue
        belonging = [n for n in names if n.startswith(quantity)]
        for view in study.view.slices([name], [PARAMETER]):
            figure = _indices_figure(view.only(belonging, [PARAMETER]), quantity, ending)
            yield f"sensitivities_{quantity}{view.suffix}", figure


def _indices_figure(view: View, quantity: str, ending: str) -> Figure:
    texts = {"_first": "First-order index: by itself",
             "_total": "Total index: with all interactions"}  # fmt: skip
    kinds = [k for k in texts if view.has(f"{quantity}{k}{ending}")]
    values = {k: view.array(f"{quantity}{k}{ending}").values for k in kinds}
    shown = np.argsort(-values[kinds[-1]], kind="stable")[:MOST_BARS]
    figure, (panel,) = new_sheet(1, 1, 1.1 + 0.36 * shown.size)
    rows, height = np.arange(shown.size), 0.8 / len(kinds)
    entries: Entries = {}
    for number, kind in enumerate(kinds):
        text, half = texts[kind], f"{quantity}{kind}_confidence{ending}"
        bars = panel.barh(
            rows + (number - 0.5 * (len(kinds) - 1)) * height, values[kind][shown],
            height=0.9 * height, color=shade((0.65, 0.25)[number]),
            xerr=view.array(half).values[shown] if view.has(half) else None,
            error_kw={"linewidth": 0.9, "capsize": 2.0},
        )  # fmt: skip
        entries[text] = bars.patches[0]
    panel.axvline(0.0, color="black", linewidth=0.8)
    name_rows(panel, _parameters(view, shown), "Share of the variance")
    notes = view.notes([f"{quantity}_first{ending}"])
    if ending:
        notes.append("only designs with results: more than 1 % failed")
    left_out = values[kinds[0]].size - shown.size
    if left_out:
        notes.append(f"{left_out} more parameters have smaller indices")
    name = f"{quantity}_first{ending}"
    what = name_of(view.array(name), name).partition(" of the ")[2] or quantity
    title = f"Sobol' indices of the {what}"
    return finish(figure, title, notes, entries, "", view.caption, below=True)


def share_names(view: View) -> list[str]:
    """Shares of the uncertain values in the variance of results."""
    named = [str(name) for name in view.data.data_vars if UNCERTAIN in view.array(str(name)).dims]
    return [name for name in named if name.endswith(SHARE)]


def uncertain_values(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw for each result, at the nominal design, which uncertain values its band is due to."""
    for name in names:
        quantity = name.removesuffix(SHARE)
        results = [quantity + end for end in ("", LOW, HIGH, EXPLAINED)]
        view = study.view.only([name, *results], [UNCERTAIN])
        shares = np.nan_to_num(view.numbers(name))
        shown = _largest_first(shares, 0.005)
        if shown.size == 0:
            continue
        figure, (panel,) = new_sheet(1, 1, 1.1 + 0.3 * shown.size)
        panel.barh(range(shown.size), 100.0 * shares[shown], height=0.62, color=shade(0.35))
        panel.set_xlim(left=0.0)
        name_rows(panel, _parameters(view, shown, UNCERTAIN), "Share of the variance (%)")
        value, low, high, explained = (float(view.array(one).values) for one in results)
        of = view.array(quantity)
        ends = f"95 % range {typeset(low)} to {with_unit(of, high)}"
        notes = [*view.notes([name]), value_text(of, quantity, value), ends]
        # The shares mean little where straight lines explain less than 90 % of the variance.
        if explained < 0.9:
            notes.append(f"straight lines explain only {100.0 * explained:.0f} % of the variance")
        left_out = shares.size - shown.size
        if left_out:
            notes.append(f"{counted(left_out, 'more value')} with a smaller share")
        what = middle_of_sentence(name_of(of, quantity))
        title = f"Uncertainty of the {what}: what it comes from"
        finished = finish(figure, title, notes, {}, "", view.caption)
        yield f"uncertainty_{quantity}{view.suffix}", finished


COMPONENTS = {
    "fmep_rings": "rings, tension",
    "fmep_ring_gas_pressure": "rings, gas",
    "fmep_skirt": "skirts",
    "fmep_main_bearings": "main bearings",
    "fmep_crank_pin_bearings": "rod bearings",
    "fmep_crankshaft_seals": "crankshaft seals",
    "fmep_valve_train": "valve train",
    "fmep_auxiliaries": "auxiliaries",
}
"""Components from below, in the order of the thesis's loss categories, with short names."""

FMEP = "Friction mean effective pressure"


def friction_names(view: View) -> list[str]:
    """Components of the friction, if there are three or more."""
    present = [name for name in COMPONENTS if view.has(name)]
    return present if len(present) > 2 else []


def friction_components(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the components stacked over each axis, and `fmep`; of one design as bars."""
    for whole, along in study.views_by_axis(names):
        if along is None:
            yield _one_design(whole, names)
            continue
        drawn = [*names, *(["fmep"] if whole.has("fmep") else [])]
        view = whole.only(drawn, [along])
        axis = view.axis(along)
        figure, (panel,) = new_sheet(1, 1, 3.4)
        entries = _stacked_areas(panel, view, names, axis)
        if "fmep" in drawn:
            form = "-" if axis.joined else "D"
            values = _over(view, "fmep", axis)
            (line,) = panel.plot(axis.values, values, form, color="#b3261e", linewidth=1.6)
            entries = {"fmep of the torque": line, **entries}
        panel.set_ylim(bottom=0.0)
        if axis.joined:
            panel.set_xlim(float(np.min(axis.values)), float(np.max(axis.values)))
        parameter_ticks(panel, axis, "x", 5.0)
        x_label(panel, axis.label, 5.0)
        y_label(panel, FMEP + view.unit(names[0]), 2.9)
        title = axis.by("Components of the friction")
        finished = finish(figure, title, view.notes(drawn), entries, caption=view.caption)
        yield stem_of("friction_components", view, along), finished


def _over(view: View, name: str, axis: StudyAxis) -> Floats:
    """Values of a variable along an axis, repeated if they are constant."""
    return np.asarray(np.broadcast_to(view.numbers(name), (axis.size,)))


def _stacked_areas(panel: Axes, view: View, names: Sequence[str], axis: StudyAxis) -> Entries:
    """Draw areas, or bars along words, above each other; the topmost is named first."""
    base = np.zeros(axis.size)
    # Hatching separates neighbours in grey print.
    hatches = ("", "////", "", "", "....", "\\\\\\\\", "", "xxxx")
    entries: Entries = {}
    for rank, (name, text) in enumerate(COMPONENTS.items()):
        if name not in names:
            continue
        top = base + _over(view, name, axis)
        look = {
            "facecolor": shade(rank / (len(COMPONENTS) - 1)), "hatch": hatches[rank],
            "edgecolor": "white", "linewidth": 0.6,
        }  # fmt: skip
        if axis.joined:
            patch = panel.fill_between(axis.values, base, top, **look)
        else:
            patch = panel.bar(axis.values, top - base, 0.6, base, **look)[0]
        entries = {text: patch, **entries}
        base = top
    return entries


def _one_design(whole: View, names: Sequence[str]) -> tuple[str, Figure]:
    """Figure of one design's components with their values and shares."""
    view = whole.only(names, ())
    values = np.array([float(view.numbers(name)) for name in names])
    figure, (panel,) = new_sheet(1, 1, 1.1 + 0.3 * len(names))
    panel.barh(range(len(names)), values, height=0.62, color=shade(0.35))
    total = float(values.sum())
    for row, value in enumerate(values):
        text = f"{value:.3f}, {100.0 * value / total:.0f} %" if total > 0.0 else f"{value:.3f}"
        look = {"xytext": (3, 0), "textcoords": "offset points", "fontsize": rc("legend.fontsize")}
        panel.annotate(text, (value, row), va="center", **look)
    panel.margins(x=0.18)
    panel.set_xlim(left=0.0)
    name_rows(panel, [COMPONENTS[name].capitalize() for name in names], FMEP + view.unit(names[0]))
    notes = [*view.notes(names), f"together {total:.3f} {view.array(names[0]).attrs['units']}"]
    finished = finish(figure, "Components of the friction", notes, caption=view.caption)
    return f"friction_components{view.suffix}", finished
