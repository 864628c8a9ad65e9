"""Nodes of speed characteristics: see `engine_dyn.loads.characteristic`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from engine_dyn.loads.characteristic import Characteristic, load_for_torque
from engine_dyn.quantities.features.feature import Feature
from engine_dyn.quantities.node import Node, parameter
from engine_dyn.units import RPM


def _load_of_characteristic(
    *, characteristic_torque: Any, characteristic_share: Any, variant_of: Callable[[str], Node],
    **needs: Any,
) -> Any:  # fmt: skip
    """Load at which the mean torque, with all that it depends on, is part of the characteristic's.

    NaN where the engine's diagrams do not give that torque, and where there is no torque.
    """
    wanted = np.asarray(characteristic_torque) * characteristic_share
    arrays = {n: v for n, v in needs.items() if isinstance(v, np.ndarray) and v.ndim}
    wanted = np.broadcast_to(
        wanted, np.broadcast_shapes(wanted.shape, *(v.shape for v in arrays.values()))
    )

    def torque_of(load: Any, which: Any) -> Any:
        places = np.unravel_index(which, wanted.shape) if wanted.shape else ()
        known = {**needs, "load": load}
        known |= {n: np.broadcast_to(v, wanted.shape)[places] for n, v in arrays.items()}

        def value(name: str) -> Any:
            if name not in known:
                node = variant_of(name)
                assert node.make is not None
                known[name] = node.make(**{need: value(need) for need in node.needs})
            return known[name]

        return value("torque_mean")

    family = needs["family"]
    return load_for_torque(torque_of, family.loads, wanted, family.resolution)


_OF_TORQUE = (
    "characteristic_torque", "characteristic_share", "variant_of", "speed", "family", "cycle",
    "crank_ratio", "offset_ratio", "pressure_share", "diagram_scale", "bore",
    "double_radius", "cylinders", "cylinder_set", "cylinders_by_count", "displacement", "period",
    "stroke_share", "all_cycles_known", "auxiliary_torque", "auxiliary_mean",
)  # fmt: skip

_OF_FRICTION = {
    "chen_flynn": (
        "mean_piston_speed", "friction_constant", "friction_peak_pressure",
        "friction_mean_piston_speed", "friction_mean_piston_speed_square",
    ),
    "patton_nitschke_heywood": ("fmep_without_gas", "ring_gas_pressure_unthrottled"),
}  # fmt: skip
"""Nodes of each law of the friction that do not depend on the load."""

PARAMETERS = (
    parameter(
        "rated_power", "N_{max}", "W",
        "rated power of the full-load curve (speed characteristic); its unit may stand beside it, "
        "as in '62.5 kW'",
        "Power units, lecture 18", low=0.0,
    ),
    parameter(
        "rated_speed", "n_{max}", "rpm",
        "rated speed of the full-load curve (speed characteristic)",
        "Power units, lecture 18", low=0.0, si=RPM,
    ),
    parameter(
        "characteristic_share", "s", "1", "share of the full-load torque", "this project",
        low=0.0, low_included=True, make=lambda: 1.0,
    ),
    *(
        parameter(
            "load", "L", "percent", "engine load",
            "Power units, lecture 18", low=0.0, low_included=True, when=f"characteristic {law}",
            needs=(*_OF_TORQUE, *needs), make=_load_of_characteristic,
        )
        for law, needs in _OF_FRICTION.items()
    ),
)  # fmt: skip

_RATED = ("characteristic", "speed", "rated_power", "rated_speed")

NODES = (
    Node(
        "characteristic_power", "N_e", "W", "power on the full-load curve (speed characteristic)",
        "Power units, lecture 18", needs=_RATED,
        make=lambda characteristic, speed, rated_power, rated_speed: characteristic.power(
            speed, rated_power, rated_speed
        ),
    ),
    Node(
        "characteristic_torque", "M_e", "N m",
        "torque on the full-load curve (speed characteristic)",
        "Power units, lecture 18", needs=_RATED,
        make=lambda characteristic, speed, rated_power, rated_speed: characteristic.torque(
            speed, rated_power, rated_speed
        ),
    ),
    Node(
        "characteristic_load", "L", "percent",
        "engine load that gives this share of the full-load torque", "this project",
        needs=("load",), make=lambda load: load,
    ),
)  # fmt: skip

FEATURE: Feature[Characteristic] = Feature(
    "characteristic", "power and torque over speed", "speed characteristic", NODES,
    constant="characteristic",
    words=(
        {
            "given_load": "the load that names the diagram is given",
            "characteristic": "it follows from a speed characteristic",
        },
    ),
)  # fmt: skip
of = FEATURE.of
