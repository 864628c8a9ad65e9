"""Ranked firing orders and firing patterns as tables for people."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.geometry.possible_orders import CRANKS
from sweeps.base.dimensions import ARRANGEMENT, FIRING_PATTERN, OF_ORDERS, OF_PATTERNS
from sweeps.base.errors import counted, one_line
from sweeps.base.naming import meaning_of
from sweeps.decide.explore.firing_orders import CRITERIA, worst_of_orders
from sweeps.decide.explore.rows import Rows
from sweeps.view.texts.tables import rows_text

if TYPE_CHECKING:
    import xarray as xr


def orders_text(
    ranked: xr.Dataset, limit: int = 20, units: str | None = None, width: int | None = None
) -> str:
    """Describe what `sweeps.firing_orders` returned: a row for each order, the best first."""
    about = json.loads(ranked.attrs[OF_ORDERS])
    best = ranked.isel({ARRANGEMENT: np.argsort(ranked["rank"].values, kind="stable")[:limit]})
    orders = [str(text) for text in best["firing_order"].values]
    known = [str(text) for text in best["known_order"].values]
    built, own = "*", "<"  # Marks of orders that engines are built with, and of the engine's own
    named = [
        f"{order}{' ' + built if text else ''}{' ' + own if order == about['own_order'] else ''}"
        for order, text in zip(orders, known, strict=True)
    ]
    table = {"rank": best["rank"].values.astype(float), "firing_order": np.array(named, object)}
    # The last two quantities show whether orders are alike in the whole engine's torque.
    shown_names = dict.fromkeys([*about["by"], *CRITERIA, "delta", "torque_range"])
    others = {dim for name in shown_names if name in ranked for dim in ranked[name].dims}
    others.discard(ARRANGEMENT)
    for name in shown_names:
        if name in best:
            table[name] = np.broadcast_to(worst_of_orders(best, name), len(orders))
    if len(about["by"]) > 1:
        table["rank_sum"] = best["rank_sum"].values.astype(float)
    numbers = {name: str(ranked[name].attrs.get("units", "1")) for name in [*table][2:]}
    numbers["rank"] = "1"
    rows = Rows(
        table=table, units=numbers,
        texts={name: meaning_of(ranked[name].attrs) for name in table},
        given=("rank", "firing_order"), fixed={}, designs=ranked.sizes[ARRANGEMENT], curves=(),
    )  # fmt: skip
    lines = [_head(ranked, about), rows_text(rows, units, width)]
    if others:
        lines.append(f"the worst value over {', '.join(sorted(map(str, others)))} counts")
    if own in "".join(named):
        lines.append(f"{own} the engine's own order")
    for order, text in zip(orders, known, strict=True):
        if text:
            lines.append(f"{built} {order}: {one_line(text, 200)}")
    return "\n".join(lines)


def _head(ranked: xr.Dataset, about: dict[str, object]) -> str:
    """Lines on the number of orders, and how many of them are different engines."""
    total, computed = int(str(about["orders"])), int(str(about["computed"]))
    engine = one_line(str(ranked.attrs.get("engine_title", "")), 80)
    text = f"{engine}: {total:,} firing orders, {CRANKS[str(about['crank'])]}"
    if computed < total:
        text += f"; {computed:,} of them, drawn at random"
    if "but_for_the_end" in about:
        text += (
            ". If it does not matter from which end they are counted, there are "
            f"{about['but_for_the_end']}, if the sense of rotation does not matter either "
            f"{about['but_for_end_and_way']}"
        )
    return text


def patterns_text(
    ranked: xr.Dataset, limit: int = 20, units: str | None = None, width: int | None = None
) -> str:
    """Describe what `sweeps.firing_patterns` returned: a row for each pattern, the best first."""
    about = json.loads(ranked.attrs[OF_PATTERNS])
    best = ranked.isel({FIRING_PATTERN: slice(limit)})
    name = str(about["by"]) + (f" {about['order']:g}" if about["order"] is not None else "")
    table = {"firings": best["firings"].values.astype(object), name: best["ranked_by"].values}
    attributes = ranked["ranked_by"].attrs
    rows = Rows(
        table=table, units={name: str(attributes.get("units", "1"))},
        texts={"firings": "", name: meaning_of(attributes)}, given=("firings",),
        fixed={}, designs=ranked.sizes[FIRING_PATTERN], curves=(),
    )  # fmt: skip
    engine = one_line(str(ranked.attrs.get("engine_title", "")), 80)
    count = counted(ranked.sizes[FIRING_PATTERN], "firing pattern")
    lines = [f"{engine}: {count} of density {about['density']}", rows_text(rows, units, width)]
    others = sorted(str(d) for d in ranked[about["by"]].dims if d not in (FIRING_PATTERN, "order"))
    if others:
        lines.append(f"the largest value over {', '.join(others)} counts")
    factor = float(about["pressure_factor"])
    if not np.isclose(factor, 1.0):
        lines.append(
            f"cylinders that fire have {factor:.4g} times the combustion pressure, which keeps the "
            "mean torque"
        )
    return "\n".join(lines)
