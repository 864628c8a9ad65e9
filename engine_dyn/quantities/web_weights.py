"""Nodes of counterweights on webs and of bending: see `engine_dyn.forces.web_weights`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from engine_dyn.forces import web_weights
from engine_dyn.geometry.arrangement import MOST_CYLINDERS
from engine_dyn.quantities.node import Node, hidden, parameter

__all__ = ["BENDING", "NODES", "OF_WEBS", "PARAMETERS", "crankshaft"]

PARAMETERS = (
    parameter(
        "counterweights_factor", "f_B", "1", "factor on the masses of the table [[counterweights]]",
        "this project", low=0.0, low_included=True, unless_given=1.0,
    ),
)  # fmt: skip

OF_WEBS = (
    "counterweights", "counterweights_factor", "crank_ratio", "offset_ratio", "cylinder_set",
    "cylinders_by_count",
)  # fmt: skip

_OTHERS = ("weights_by_fraction", "weights_given")
"""Words of scenes without counterweights of webs."""


def crankshaft(needs: dict[str, Any]) -> web_weights.Crankshaft:
    """What turns with the crank, from the needs of a node."""
    more = {
        field: needs[name]
        for field, name in (
            ("spacing", "cylinder_spacing"), ("bank_offset", "bank_offset"),
            ("rod_mass", "journal_rod_mass"), ("throw_mass", "journal_throw_mass"),
        )
        if name in needs
    }  # fmt: skip
    if "double_radius" in needs:
        more["crank_radius"] = 0.5 * needs["double_radius"]
    return web_weights.Crankshaft(*(needs[name] for name in OF_WEBS), **more)


def _of_webs(
    name: str, unit: str, long_name: str, more: tuple[str, ...], make: Callable[..., Any]
) -> list[Node]:  # fmt: skip
    """A vector of the counterweights of webs; nothing without them."""
    needs = (*OF_WEBS, *more)
    return [
        hidden(name, unit, long_name, make, needs, when="weights_of_webs", width=16, throws=True),
        *(hidden(name, unit, long_name, lambda: 0.0, when=word) for word in _OTHERS),
    ]  # fmt: skip


def _unbalance(**needs: Any) -> Any:
    return web_weights.unbalance(crankshaft(needs))


def _couple(**needs: Any) -> Any:
    return web_weights.couple(crankshaft(needs))


def _on_journals(*, main_bearing: Any, **needs: Any) -> Any:
    return web_weights.on_journals(crankshaft(needs), main_bearing)


BENDING = (
    *OF_WEBS, "cylinder_spacing", "bank_offset", "double_radius", "journal_rod_mass",
    "journal_throw_mass",
)  # fmt: skip


def _bending(*, speed: Any, bay: Any, **needs: Any) -> Any:
    return web_weights.largest_bending(crankshaft(needs), bay) * speed**2


def _largest_bending(*, speed: Any, **needs: Any) -> Any:
    shaft = crankshaft(needs)
    bays = (web_weights.largest_bending(shaft, bay) for bay in range(1, MOST_CYLINDERS + 1))
    found: Any = 0.0
    for bay in bays:
        found = np.fmax(found, bay)
    return found * speed**2


NODES: tuple[Node, ...] = (
    *_of_webs("web_unbalance", "kg m", "unbalance of the counterweights of webs", (), _unbalance),
    *_of_webs(
        "web_unbalance_couple", "kg m2",
        "unbalance of the counterweights of webs times distance from the middle of the crank",
        ("cylinder_spacing",), _couple,
    ),
    *_of_webs(
        "journal_web_unbalance", "kg m",
        "unbalance of the counterweights of webs that a main journal bears",
        ("cylinder_spacing", "main_bearing"), _on_journals,
    ),
    Node(
        "bay_bending_moment", "M_b", "N m",
        "largest bending moment of the shaft between the main bearings beside each throw, due to "
        "centrifugal forces, each bay a simply supported beam",
        "this project", needs=(*BENDING, "speed", "bay"), make=_bending, throws=True,
    ),
    Node(
        "bay_bending_moment_max", "M_{b,max}", "N m",
        "largest bending moment of the shaft in any bay, due to centrifugal forces",
        "this project", needs=(*BENDING, "speed"), make=_largest_bending, throws=True,
    ),
)  # fmt: skip
