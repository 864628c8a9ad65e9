"""The load that keeps a mean brake torque: what misfires take away, the other firings take up.

A set that drives a generator keeps its power when a cylinder fails: its governor gives more fuel
until the mean brake torque is what it was. Here, the load is the root of

    M_mean(load, cylinders as they fire) = M_hold

over the loads of the engine's diagrams, at constant nominal speed. M_hold is given, or it is the
torque of the undisturbed engine: the same design at the given load, where every cylinder burns
fully: no misfire, no firing pattern, all factors on the pressure 1. Each diagram between the given
ones is that of the family (`engine_dyn.pressure.family`), so the root is exact for the family.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from engine_dyn.quantities.features.characteristic import (
    OF_FRICTION,
    OF_TORQUE,
    load_with_torque,
    made_of,
    torque_beyond,
)
from engine_dyn.quantities.features.feature import Feature
from engine_dyn.quantities.node import Node, parameter

QUANTITIES = ("brake_torque", "brake_power")
"""What may be held; at a nominal speed that stays, both are the same."""


def _undisturbed_torque(
    *, load: Any, undisturbed_set: Any, variant_of: Callable[[str], Node], **needs: Any
) -> Any:  # fmt: skip
    known = {**needs, "held_load": load, "cylinder_set": undisturbed_set}
    return made_of("torque_mean", known, variant_of)


def _held_load(*, torque_to_hold: Any, variant_of: Callable[[str], Node], **needs: Any) -> Any:
    return load_with_torque(torque_to_hold, "held_load", needs, variant_of)


def _load_of_undisturbed(*, load: Any, undisturbed_set: Any, **needs: Any) -> Any:
    undisturbed = np.asarray(needs["cylinder_set"]) == undisturbed_set
    # Undisturbed designs keep the load that they are given, to the bit
    return np.where(undisturbed, load, _held_load(**needs))


def _torque_missing(*, torque_to_hold: Any, variant_of: Callable[[str], Node], **needs: Any) -> Any:
    return torque_beyond(torque_to_hold, "held_load", needs, variant_of)


PARAMETERS = (
    parameter(
        "held_torque", "M_h", "N m",
        "mean brake torque that the load follows, whatever cylinders fire", "this project",
        low=0.0, low_included=True,
    ),
    parameter(
        "held_power", "P_h", "W",
        "brake power that the load follows, whatever cylinders fire (0: idling)", "this project",
        low=0.0, low_included=True,
    ),
)  # fmt: skip

HELD_KEYS = tuple(key.name for key in PARAMETERS)
"""Keys with the number that is held."""

_UNDISTURBED = tuple(name for name in OF_TORQUE if name not in ("cylinder_set", "pressure_share"))
"""Nodes of the torque but for those of the cylinders as they fire."""

_WIDTH = 480  # Bytes of a design while its load is searched, measured

_LOAD = (
    "held_load", "L_h", "percent",
    "engine load of the diagram that is used",
    "this project",
)  # fmt: skip

_TORQUE = (
    "torque_to_hold", "M_{hold}", "N m",
    "mean brake torque that is held", "this project",
)  # fmt: skip

_MISSING = (
    "torque_missing", r"\Delta M_{hold}", "N m",
    "torque to hold less the nearest one that the diagrams give: 0 where it is held",
    "this project",
)  # fmt: skip

NODES = (
    Node(*_LOAD, when="not_held", make=lambda load: load),
    Node(*_TORQUE, when="not_held", make=lambda torque_mean: torque_mean),
    Node(*_MISSING, when="not_held", make=lambda torque_mean: 0.0 * torque_mean),
    Node(*_TORQUE, when="held hold_torque", make=lambda held_torque: held_torque),
    Node(*_TORQUE, when="held hold_power", make=lambda held_power, speed: held_power / speed),
    *(
        node
        for law, of_law in OF_FRICTION.items()
        for node in (
            Node(
                *_TORQUE, when=f"held hold_undisturbed {law}", make=_undisturbed_torque,
                needs=("load", "undisturbed_set", *_UNDISTURBED, *of_law),
            ),
            Node(
                *_LOAD, when=f"held hold_undisturbed {law}", make=_load_of_undisturbed,
                needs=("torque_to_hold", "load", "undisturbed_set", *OF_TORQUE, *of_law),
                width=_WIDTH,
            ),
            Node(
                *_MISSING, when=f"held {law}", make=_torque_missing, width=_WIDTH,
                needs=("torque_to_hold", *OF_TORQUE, *of_law),
            ),
            *(
                Node(
                    *_LOAD, when=f"held {source} {law}", make=_held_load, width=_WIDTH,
                    needs=("torque_to_hold", *OF_TORQUE, *of_law),
                )
                for source in ("hold_torque", "hold_power")
            ),
        )
    ),
)  # fmt: skip

FEATURE: Feature[str] = Feature(
    "hold", "mean brake torque that is held", "load and driver", NODES, PARAMETERS,
    words=(
        {
            "not_held": "the load names the diagram",
            "held": "the load follows from a mean brake torque that is held",
        },
        {
            "hold_undisturbed": "that torque is the undisturbed engine's",
            "hold_torque": "it is given",
            "hold_power": "it follows from a brake power",
        },
    ),
    called={
        "held_load": "governor, constant power, other cylinders take up the load",
        "torque_to_hold": "governor, constant torque",
        "torque_missing": "torque not reached, overload",
    },
)  # fmt: skip
