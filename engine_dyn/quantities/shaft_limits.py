"""Nodes that judge what a shaft does: stress, limits, swing of pendulums, heat of dampers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from engine_dyn.quantities.node import Node
from engine_dyn.quantities.shaft_numbers import WILSON
from engine_dyn.torsion.shaft import Shaft
from engine_dyn.torsion.stress import (
    ALLOY_STEEL,
    CARBON_STEEL,
    propulsion_shaft_limits,
    shear_stress,
)
from engine_dyn.units import DEGREE, MPA

PENDULUMS = ("pendulum_mass", "pendulum_distance", "pendulum_length")
"""Kinds of numbers of a pendulum."""


NAN_WITHOUT = frozenset({
    "shaft_diameter", "shaft_stress_limit", "shaft_torque_limit", "shaft_tensile_strength",
    "pendulum_mass", "pendulum_stop_angle", "damper_surface",
})  # fmt: skip
"""Kinds of numbers without any of which the quantities here are NaN in all shafts."""


def _stress(*, shaft_system: Shaft, shaft_torque_half_range: Any, **values: Any) -> Any:
    """Nominal stress; NaN in shafts without diameter."""
    diameter, bore = (
        _of_shafts(shaft_system, what, values, default)
        for what, default in (("shaft_diameter", np.nan), ("shaft_bore", 0.0))
    )
    return shear_stress(shaft_torque_half_range, diameter, bore)


def _swing(*, shaft_system: Shaft, shaft_twist_half_range: Any, **values: Any) -> Any:
    own = {name: np.atleast_1d(value) for name, value in values.items()}
    factors = [made.swing for made in shaft_system.as_discs(own)]
    return shaft_twist_half_range * _placed(shaft_system, shaft_system.first_pendulum, factors)


def _over_stop(*, shaft_system: Shaft, pendulum_swing_half_range: Any, **values: Any) -> Any:
    stops = _numbered("pendulum_stop_angle", shaft_system.pendulums, values)
    return pendulum_swing_half_range / _placed(shaft_system, shaft_system.first_pendulum, stops)


def _heat_per_area(*, shaft_system: Shaft, shaft_loss: Any, **values: Any) -> Any:
    surfaces = _numbered("damper_surface", shaft_system.dampers, values)
    return shaft_loss / _placed(shaft_system, shaft_system.own_shafts, surfaces)


def _numbered(what: str, count: int, values: Mapping[str, Any]) -> list[Any]:
    return [np.atleast_1d(values.get(f"{what}_{i + 1}", np.nan)) for i in range(count)]


def _placed(shaft: Shaft, first: int, given: list[Any]) -> Any:
    """Values of dampers or pendulums at the places of their shafts, from `first` on; else NaN."""
    columns = [np.full(1, np.nan)] * len(shaft.shafts)
    columns[first : first + len(given)] = given
    return joined(columns)


def joined(parts: list[Any]) -> Any:
    """Arrays of length 1 along the last axis, else broadcast, one after another along it."""
    return np.concatenate(np.broadcast_arrays(*parts), axis=-1)


def _limit(what: str) -> Any:
    def make(*, shaft_system: Shaft, shaft: Any, **values: Any) -> Any:
        return _of_shafts(shaft_system, what, values, np.nan) + 0.0 * shaft

    return make


def _propulsion_limit(which: int) -> Any:
    def make(*, shaft_system: Shaft, speed: Any, rated_speed: Any, shaft: Any,
             **values: Any) -> Any:  # fmt: skip
        diameter, strength, factor = (
            _of_shafts(shaft_system, f"shaft_{what}", values, default)
            for what, default in (
                ("diameter", np.nan), ("tensile_strength", np.nan), ("shape_factor", np.nan)
            )
        )  # fmt: skip
        most = np.where(
            [place in shaft_system.alloy for place in range(len(shaft_system.shafts))],
            ALLOY_STEEL, CARBON_STEEL,
        )  # fmt: skip
        limits = propulsion_shaft_limits(speed / rated_speed, diameter, strength, factor, most)
        return limits[which] + 0.0 * shaft

    return make


def _of_shafts(shaft: Shaft, what: str, values: Mapping[str, Any], default: float) -> Any:
    """Values along the last axis, which those given have with the length 1."""
    return joined([np.atleast_1d(value) for value in shaft.along(what, values, default)])


NODES: tuple[Node, ...] = (
    Node(
        "shaft_stress_half_range", r"\hat\tau", "MPa",
        "nominal vibratory shear stress in each shaft, half of its range over the cycle", WILSON,
        si=MPA,
        needs=("shaft_system", "shaft_torque_half_range"), make=_stress,
        of_shaft=("shaft_diameter", "shaft_bore"),
    ),
    Node(
        "shaft_stress_limit", r"\tau_{lim}", "MPa",
        "largest allowed half range of the nominal shear stress in each shaft, as given", WILSON,
        si=MPA, needs=("shaft_system", "shaft"), make=_limit("shaft_stress_limit"),
        of_shaft=("shaft_stress_limit",),
    ),
    Node(
        "shaft_torque_limit", "T_{lim}", "N m",
        "largest allowed half range of the torque in each shaft, as given", WILSON,
        needs=("shaft_system", "shaft"), make=_limit("shaft_torque_limit"),
        of_shaft=("shaft_torque_limit",),
    ),
    Node(
        "shaft_stress_over_limit", r"\hat\tau/\tau_{lim}", "1",
        "half range of the nominal shear stress over its limit, above 1 where it is exceeded",
        WILSON, make=lambda shaft_stress_half_range, shaft_stress_limit: shaft_stress_half_range
        / shaft_stress_limit,
    ),
    Node(
        "shaft_torque_over_limit", r"\hat T/T_{lim}", "1",
        "half range of the torque over its limit, above 1 where it is exceeded", WILSON,
        make=lambda shaft_torque_half_range, shaft_torque_limit: shaft_torque_half_range
        / shaft_torque_limit,
    ),
    *(
        Node(
            f"propulsion_stress_{name}", symbol, "MPa",
            f"permissible vibratory stress of propulsion shafts, {text}", "IACS UR M68", si=MPA,
            needs=("shaft_system", "speed", "rated_speed", "shaft"),
            make=_propulsion_limit(which),
            of_shaft=("shaft_diameter", "shaft_tensile_strength", "shaft_shape_factor"),
        )
        for which, (name, symbol, text) in enumerate((
            ("limit", r"\tau_C", "in continuous service, by the speed over the rated speed"),
            ("limit_passing", r"\tau_T",
             "in ranges that are passed quickly, up to 0.8 of the rated speed"),
        ))
    ),
    Node(
        "propulsion_stress_over_limit", r"\hat\tau/\tau_C", "1",
        "half range of the nominal shear stress over its limit in continuous service, above 1 "
        "where it is exceeded", "IACS UR M68",
        make=lambda shaft_stress_half_range, propulsion_stress_limit: shaft_stress_half_range
        / propulsion_stress_limit,
    ),
    Node(
        "pendulum_swing_half_range", r"\hat\psi", "degree",
        "swing of each pendulum on its carrier, half of its range over the cycle, linear; of other "
        "shafts nothing", WILSON, si=DEGREE, needs=("shaft_system", "shaft_twist_half_range"),
        make=_swing, of_shaft=(*PENDULUMS, "shaft_gear_ratio"),
    ),
    Node(
        "pendulum_swing_over_stop", r"\hat\psi/\psi_s", "1",
        "swing of each pendulum over the angle of its stop, above 1 where it meets it", WILSON,
        needs=("shaft_system", "pendulum_swing_half_range"), make=_over_stop,
        of_shaft=("pendulum_stop_angle",),
    ),
    Node(
        "damper_heat_per_area", "P/A", "W m-2",
        "mean power lost in each damper over its surface; of other shafts nothing", WILSON,
        needs=("shaft_system", "shaft_loss"), make=_heat_per_area, of_shaft=("damper_surface",),
    ),
)  # fmt: skip

JUDGING = frozenset(node.name for node in NODES)  # Names of these quantities
