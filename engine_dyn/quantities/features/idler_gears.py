r"""Idler gears: gears that the crankshaft drives, each in a fixed ratio, with inertia and friction.

A gear that turns at i times the crank's speed has the angle i phi and the speed i omega. With its
moment of inertia J at its own shaft, its kinetic energy and the power of its friction torque T,
which opposes its rotation whichever way it turns, are

    E = J (i omega)^2 / 2 = (i^2 J) omega^2 / 2
    P = T |i omega|      = (|i| T) omega

(omega > 0). Since the ratio is fixed, the gear has no coordinate of its own: a moment of inertia
i^2 J at the crankshaft and a torque |i| T against its rotation do the same, whatever the speed over
the angle. All gears together have

    Theta_I = sum i^2 J         M_I = sum |i| T.

Theta_I belongs to the rotating inertia of engine and load, M_I to the part of the load torque that
does not depend on the speed. Both are on the load's side of the flywheel.

Source: equal energy and power (Dresig and Holzweissig, Dynamics of Machinery, section 2.2: reduced
moments of inertia), derived here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine_dyn.quantities.features.feature import Addition, Feature
from engine_dyn.quantities.node import Node
from engine_dyn.types import Floats


@dataclass(frozen=True, eq=False)
class IdlerGears:
    """Gears that the crankshaft drives, one a place of each array, shape (N,).

    Examples
    --------
    >>> gears = IdlerGears(np.array([0.01, 0.02]), np.array([-2.0, 0.5]), np.array([0.3, 0.4]))
    >>> round(gears.inertia_at_crank, 9), round(gears.torque_at_crank, 9)
    (0.045, 0.8)
    """

    inertia: Floats  # Moment of inertia about the gear's own shaft [kg m2]
    ratio: Floats  # Speed over the crankshaft's [1], negative where the gear turns the other way
    # Friction torque of bearings and teeth at the gear's own shaft [N m], against its rotation.
    friction_torque: Floats

    @property
    def inertia_at_crank(self) -> float:
        """Theta_I, moment of inertia of all gears referred to the crankshaft [kg m2]."""
        return float(np.sum(self.ratio**2 * self.inertia))

    @property
    def torque_at_crank(self) -> float:
        """M_I, friction torque of all gears referred to the crankshaft [N m]."""
        return float(np.sum(np.abs(self.ratio) * self.friction_torque))


_INERTIA = (
    "idler_gear_inertia", r"\Theta_I", "kg m2",
    "moment of inertia of the idler gears, referred to the crankshaft, 0 without them",
    "this project",
)  # fmt: skip
_FRICTION = (
    "idler_gear_friction_torque", "M_I", "N m",
    "friction torque of the idler gears, referred to the crankshaft, part of the load, 0 without "
    "them",
    "this project",
)  # fmt: skip

NODES: tuple[Node, ...] = (
    Node(*_INERTIA, when="idler_gears", make=lambda idler_gears: idler_gears.inertia_at_crank),
    Node(*_INERTIA, when="no_idler_gears", make=lambda: 0.0),
    Node(*_FRICTION, when="idler_gears", make=lambda idler_gears: idler_gears.torque_at_crank),
    Node(*_FRICTION, when="no_idler_gears", make=lambda: 0.0),
)

FEATURE: Feature[IdlerGears] = Feature(
    "idler_gears", "gears that the crankshaft drives", "load and driver", NODES,
    constant="idler_gears",
    words=(
        {
            "no_idler_gears": "the crankshaft drives no idler gears",
            "idler_gears": "idler gears add inertia and friction",
        },
    ),
    adds=(
        Addition("load_offset", "idler_gear_friction_torque"),
        Addition("inertia_beyond_gear", "idler_gear_inertia"),
        Addition("inertia", "idler_gear_inertia", "given_inertia inertia_whole"),
    ),
    called={
        "idler_gear_inertia": "intermediate gear, timing gears, gear train, reduced inertia",
        "idler_gear_friction_torque": "intermediate gear, timing gears, gear train loss",
    },
)  # fmt: skip
of = FEATURE.of
