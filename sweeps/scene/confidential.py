"""What must not stand in archives beside a confidential diagram, since it tells the diagram.

The force of the gas is the pressure times the area of the piston: who knows bore, stroke, rod and
masses finds the pressure in every curve of one cylinder, and in its orders, which are the same
curve. Torque of all cylinders and speed are what such studies are made for, and stay.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from engine_dyn.quantities.graph import ALL_QUANTITIES, NODES
from sweeps.base.errors import SceneError

__all__ = ["TELLING", "check_quantities", "without_pressures"]

_OF_ONE_CYLINDER = (
    "pressure", "crank_pin_components", "piston_pin_components", "main_journal_components",
    "torque_after_throw", "cylinder_gas_torque_harmonics", "cylinder_torque_harmonics",
    "throw_torque_harmonics",
)  # fmt: skip
"""Nodes that have the diagram of a single cylinder in them, over angle or order."""

_RESULT, _LEVEL = ": imep ", ": not pegged, "
_VALUE = re.compile(r"(?<![\d.])[+-]?[\d.]++(?:e[+-]?\d++)?+(?= ?(?:bar|%))")


def _all_that_need(roots: Iterable[str]) -> frozenset[str]:
    """Quantities among these nodes, and all that follow from them."""
    found = set(roots)
    more = set(found)
    while more:
        more = {
            name
            for name, nodes in NODES.items()
            if name not in found and any(not found.isdisjoint(node.needs) for node in nodes)
        }
        found |= more
    return frozenset(found & set(ALL_QUANTITIES))


TELLING = _all_that_need(_OF_ONE_CYLINDER)
"""Quantities that tell the pressure to who knows the engine's measures and masses."""


def check_quantities(quantities: Iterable[str], name: str) -> None:
    """Refuse quantities that tell a confidential diagram.

    Raises
    ------
    SceneError
        For the first of them; `name` is the scene as messages call it.
    """
    for quantity in quantities:
        if quantity in TELLING:
            raise SceneError(
                f"{name}: [output] quantities: '{quantity}': not allowed together with "
                "[indicator] confidential = true: the pressure could be derived from it with the "
                "engine's dimensions and masses"
            )


def without_pressures(notes: Iterable[str]) -> tuple[str, ...]:
    """Notes without imep and largest pressure; warnings and level without pressures."""
    return tuple(
        _VALUE.sub("...", note) if note.startswith("warning: ") or _LEVEL in note else note
        for note in notes
        if _RESULT not in note
    )
