"""Parameters of the shaft that twists, and nodes that judge what it does.

Parameters are numbers of single discs, shafts, gears, dampers and pendulums: `disc_inertia_3` is
that of disc 3. A table [shaft] gives them all; as parameters they vary from design to design. Nodes
judge stress, limits, the swing of pendulums and the heat of dampers.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from engine_dyn.quantities.node import Node, formula, parameter
from engine_dyn.torsion.shaft import (
    MOST_DAMPERS,
    MOST_EXCITATIONS,
    MOST_GEARS,
    MOST_MODES,
    MOST_OF_SCENE,
    Shaft,
)
from engine_dyn.torsion.system import (
    ALLOY_STEEL,
    CARBON_STEEL,
    propulsion_shaft_limits,
    shear_stress,
)
from engine_dyn.units import DEGREE, GPA, MPA

WILSON = "Ker Wilson, Practical Solution of Torsional Vibration Problems"

_POSITIVE: dict[str, Any] = {"low": 0.0}
_FROM_ZERO: dict[str, Any] = {"low": 0.0, "low_included": True}


def _numbered(what: str, symbol: str, unit: str, long_name: str, most: int, **more: Any) -> Node:
    return Node(f"{what}_N", symbol, unit, long_name, WILSON, kind="parameter", width=most, **more)


_SHAFTS, _HALF = MOST_OF_SCENE - 1, MOST_DAMPERS

_PATTERNS = (
    _numbered("disc_inertia", "J_N", "kg m2", "moment of inertia of disc N of the shaft",
              MOST_OF_SCENE, **_POSITIVE),
    _numbered("disc_damping", "c_N", "N m s rad-1", "viscous damping of disc N against the frame",
              MOST_OF_SCENE, **_FROM_ZERO),
    _numbered("disc_ground_stiffness", "k_{g,N}", "N m rad-1",
              "spring of disc N to the frame, such as the synchronising torque of a generator on "
              "the grid", MOST_OF_SCENE, **_FROM_ZERO),
    _numbered("shaft_stiffness", "k_N", "N m rad-1", "stiffness of shaft N", _SHAFTS, **_POSITIVE),
    _numbered("shaft_loss_factor", r"\eta_N", "1",
              "loss factor of shaft N, the relative damping psi of couplings over 2 pi", _SHAFTS,
              high=10.0, **_FROM_ZERO),
    _numbered("shaft_damping", "c_{s,N}", "N m s rad-1", "viscous damping in shaft N", _SHAFTS,
              **_FROM_ZERO),
    _numbered("shaft_length", "l_N", "m", "length of shaft N, in place of its stiffness", _SHAFTS,
              **_POSITIVE),
    _numbered("shaft_diameter", "d_N", "m", "diameter of shaft N", _SHAFTS, **_POSITIVE),
    _numbered("shaft_bore", "d_{b,N}", "m", "bore of shaft N", _SHAFTS, **_FROM_ZERO),
    _numbered("shaft_shear_modulus", "G_N", "GPa", "shear modulus of shaft N", _SHAFTS, si=GPA,
              high=1e3, **_POSITIVE),
    _numbered("shaft_stress_limit", r"\tau_{N}", "MPa",
              "largest allowed half range of the nominal shear stress in shaft N", _SHAFTS, si=MPA,
              high=3e3, **_POSITIVE),
    _numbered("shaft_transient_stress_limit", r"\tau_{T,N}", "MPa",
              "largest allowed half range of the nominal shear stress in shaft N in passing",
              _SHAFTS, si=MPA, high=3e3, **_POSITIVE),
    _numbered("shaft_torque_limit", "T_{N}", "N m",
              "largest allowed half range of the torque in shaft N", _SHAFTS, **_POSITIVE),
    _numbered("shaft_clearance", r"\psi_{c,N}", "degree",
              "clearance of shaft N, a coupling or mesh: angle between the contacts of its two "
              "sides", _SHAFTS, si=DEGREE, high=180.0, **_FROM_ZERO),
    _numbered("shaft_friction_torque", "F_N", "N m",
              "torque of dry friction in shaft N, beside that of its twist", _SHAFTS,
              **_FROM_ZERO),
    _numbered("shaft_friction_stiffness", "k_{F,N}", "N m rad-1",
              "stiffness with which the dry friction of shaft N sticks", _SHAFTS, **_POSITIVE),
    _numbered("shaft_tensile_strength", r"\sigma_{B,N}", "MPa",
              "specified tensile strength of shaft N, a propulsion shaft of a ship", _SHAFTS,
              si=MPA, high=3e3, **_POSITIVE),
    _numbered("shaft_shape_factor", "c_{K,N}", "1",
              "factor c_K of the shape of shaft N, a propulsion shaft of a ship", _SHAFTS,
              high=1.0, high_included=True, **_POSITIVE),
    _numbered("shaft_gear_ratio", "i_N", "1",
              "speed of the second disc of gear N over that of the first, below 0 where it turns "
              "the other way", MOST_GEARS, low=-1000.0, high=1000.0),
    _numbered("damper_inertia", "J_{d,N}", "kg m2", "moment of inertia of the ring of damper N",
              _HALF, **_POSITIVE),
    _numbered("damper_damping", "c_{d,N}", "N m s rad-1",
              "viscous damping between ring and hub of damper N", _HALF, **_FROM_ZERO),
    _numbered("damper_stiffness", "k_{d,N}", "N m rad-1", "stiffness that holds the ring of "
              "damper N", _HALF, **_FROM_ZERO),
    _numbered("damper_loss_factor", r"\eta_{d,N}", "1",
              "loss factor of what holds the ring of damper N", _HALF, high=10.0, **_FROM_ZERO),
    _numbered("damper_surface", "A_N", "m2", "surface of damper N that gives off its heat", _HALF,
              **_POSITIVE),
    _numbered("pendulum_mass", "m_N", "kg", "mass of all pendulums of number N on their carrier",
              _HALF, **_POSITIVE),
    _numbered("pendulum_distance", "R_N", "m",
              "distance of the suspension of pendulum N from the shaft's axis", _HALF,
              **_POSITIVE),
    _numbered("pendulum_length", "r_N", "m",
              "length of pendulum N, which is tuned to the order (R/r)^(1/2)", _HALF, **_POSITIVE),
    _numbered("pendulum_stop_angle", r"\psi_N", "degree",
              "angle at which pendulum N meets its stop", _HALF, si=DEGREE, high=180.0,
              **_POSITIVE),
    _numbered("excitation_factor", "f_N", "1", "factor on the torque of excitation N of the shaft",
              MOST_EXCITATIONS, **_FROM_ZERO),
    _numbered("modal_damping", r"\zeta_N", "1",
              "damping ratio of mode N of the shaft, which adds to all other damping; over a "
              "dynamic magnifier M it is 1/(2 M)", MOST_MODES, high=1.0, **_FROM_ZERO),
)  # fmt: skip

PATTERNS: Mapping[str, Node] = MappingProxyType(
    {node.name: replace(node, width=8) for node in _PATTERNS}
)
"""Parameters of single discs, shafts, gears and dampers as lists show them: N counts from 1."""


def _named(pattern: Node) -> list[Node]:
    """Parameters of a pattern for all numbers; the pattern's `width` is the largest number."""
    return [
        replace(
            pattern,
            name=pattern.name.replace("_N", f"_{number}"),
            symbol=pattern.symbol.replace("N", f"{{{number}}}"),
            long_name=pattern.long_name.replace(" N", f" {number}", 1),
            public=False,
            width=8,
        )
        for number in range(1, pattern.width + 1)
    ]


_OF_NUMBERS = tuple(node for pattern in _PATTERNS for node in _named(pattern))

OF_SHAFT = frozenset(node.name for node in _OF_NUMBERS)
"""Names of the parameters that belong to a single disc, shaft, gear or damper."""


def _damping(torque: Any, over_torque: Any, counted: Any = None) -> Any:
    """Damping from its ratio to a torque; `NO_TORQUE` is passed on, for the outcome."""
    counted = torque if counted is None else counted
    lacking = np.isneginf(torque)
    return np.where(lacking, torque, np.where(lacking, 0.0, counted) * over_torque)


_LOAD_DAMPING = (
    "load_damping", "c_L", "N m s rad-1",
    "damping by the load of the shaft, against the frame, at the crank's speed; by default the "
    "slope of the load's torque over the speed",
)  # fmt: skip

PARAMETERS: tuple[Node, ...] = (
    *_OF_NUMBERS,
    parameter(
        *_LOAD_DAMPING, WILSON, **_FROM_ZERO, when="damping_of_law",
        make=lambda opposed_torque, load_slope: _damping(opposed_torque, load_slope),
    ),
    parameter(
        *_LOAD_DAMPING, WILSON, **_FROM_ZERO, when="damping_by_factor",
        make=lambda opposed_torque, load_surplus, load_damping_factor, speed:
        _damping(opposed_torque, load_damping_factor / speed, np.maximum(load_surplus, 0.0)),
    ),
    parameter(
        "load_damping_factor", "a", "1",
        "damping by the load over its mean torque and speed, c omega/M: of a propeller a number "
        "after Archer, divided by 9.55 if it belongs to rpm", WILSON, **_FROM_ZERO,
    ),
)  # fmt: skip

PENDULUMS = ("pendulum_mass", "pendulum_distance", "pendulum_length")
"""Kinds of numbers of a pendulum."""

NAN_WITHOUT = frozenset({
    "shaft_diameter", "shaft_stress_limit", "shaft_transient_stress_limit", "shaft_torque_limit",
    "shaft_tensile_strength", "pendulum_mass", "pendulum_stop_angle", "damper_surface",
})  # fmt: skip
"""Kinds of numbers of a shaft without any of which quantities of limits are NaN."""


def _stress(torque: str, after: int = 0) -> Any:
    """Nominal stress of each shaft by a torque with `after` axes after that of the shafts.

    NaN for shafts without diameter.
    """

    def make(*, shaft_system: Shaft, **values: Any) -> Any:
        # Without the axes after that of the shafts, which only the torque has
        own = {
            name: value[(..., *(0,) * after)] if np.ndim(value) else value
            for name, value in values.items() if name != torque
        }  # fmt: skip
        diameter, bore = (
            _of_shafts(shaft_system, what, own, default)[(..., *(None,) * after)]
            for what, default in (("shaft_diameter", np.nan), ("shaft_bore", 0.0))
        )
        return shear_stress(values[torque], diameter, bore)

    return make


def _stress_node(name: str, symbol: str, unit: str, long_name: str, torque: str,
                 after: int = 0, si: float = MPA) -> Node:  # fmt: skip
    return Node(
        name, symbol, unit, long_name, WILSON, si=si, needs=("shaft_system", torque),
        make=_stress(torque, after), of_shaft=("shaft_diameter", "shaft_bore"),
    )  # fmt: skip


def _swing(*, shaft_system: Shaft, shaft_twist_half_range: Any, **values: Any) -> Any:
    own = {name: np.atleast_1d(value) for name, value in values.items()}
    factors = [made.swing for made in shaft_system.as_discs(own)]
    return shaft_twist_half_range * _placed(shaft_system, shaft_system.first_pendulum, factors)


def _over_stop(*, shaft_system: Shaft, pendulum_swing_half_range: Any, **values: Any) -> Any:
    stops = _of_number("pendulum_stop_angle", shaft_system.pendulums, values)
    return pendulum_swing_half_range / _placed(shaft_system, shaft_system.first_pendulum, stops)


def _heat_per_area(*, shaft_system: Shaft, shaft_loss: Any, **values: Any) -> Any:
    surfaces = _of_number("damper_surface", shaft_system.dampers, values)
    return shaft_loss / _placed(shaft_system, shaft_system.own_shafts, surfaces)


def _of_number(what: str, count: int, values: Mapping[str, Any]) -> list[Any]:
    return [np.atleast_1d(values.get(f"{what}_{i + 1}", np.nan)) for i in range(count)]


def _placed(shaft: Shaft, first: int, given: list[Any]) -> Any:
    """Values of dampers or pendulums along the shafts' axis, from `first` on; else NaN."""
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
            _of_shafts(shaft_system, f"shaft_{what}", values, np.nan)
            for what in ("diameter", "tensile_strength", "shape_factor")
        )
        alloy = [place in shaft_system.alloy for place in range(len(shaft_system.shafts))]
        most = np.where(alloy, ALLOY_STEEL, CARBON_STEEL)
        limits = propulsion_shaft_limits(speed / rated_speed, diameter, strength, factor, most)
        return limits[which] + 0.0 * shaft

    return make


def _limit_in_passing(*, speed_in_passing: Any, **values: Any) -> Any:
    given = _limit("shaft_transient_stress_limit")(
        **{name: one for name, one in values.items() if name != "rated_speed"}
    )
    return np.where(np.isnan(given), _propulsion_limit(1)(speed=speed_in_passing, **values), given)


def _of_shafts(shaft: Shaft, what: str, values: Mapping[str, Any], default: float) -> Any:
    """Values along the axis of shafts; given values have that axis with the length 1."""
    return joined([np.atleast_1d(value) for value in shaft.along(what, values, default)])


def _over(name: str, symbol: str, text: str, source: str, value: str, limit: str) -> Node:
    return Node(
        f"{name}_over_limit", symbol, "1",
        f"half range of the {text}, above 1 where it is exceeded", source,
        **formula(lambda half_range, limit: half_range / limit, value, limit),
    )  # fmt: skip


LIMIT_NODES: tuple[Node, ...] = (
    _stress_node(
        "shaft_stress_half_range", r"\hat\tau", "MPa",
        "nominal vibratory shear stress in each shaft, half of its range over the cycle",
        "shaft_torque_half_range",
    ),
    _stress_node(
        "shaft_stress_nonlinear", r"\hat\tau_n", "MPa",
        "nominal vibratory shear stress in each shaft with couplings that are not linear, half of "
        "its range over the cycle", "shaft_torque_nonlinear",
    ),
    _stress_node(
        "shaft_stress_order", r"\tau_\nu", "MPa",
        "amplitude of the orders of the nominal vibratory shear stress in each shaft",
        "shaft_torque_order", after=1,
    ),
    _stress_node(
        "mode_stress", r"\tau_m", "MPa degree-1",
        "nominal shear stress in each shaft in a mode, per degree of amplitude of the free end of "
        "the crankshaft", "mode_torque", si=MPA / DEGREE,
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
    _over("shaft_stress", r"\hat\tau/\tau_{lim}", "nominal shear stress over its limit", WILSON,
          "shaft_stress_half_range", "shaft_stress_limit"),
    _over("shaft_torque", r"\hat T/T_{lim}", "torque over its limit", WILSON,
          "shaft_torque_half_range", "shaft_torque_limit"),
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
    _over("propulsion_stress", r"\hat\tau/\tau_C", "nominal shear stress over its limit in "
          "continuous service", "IACS UR M68", "shaft_stress_half_range",
          "propulsion_stress_limit"),
    _stress_node(
        "shaft_stress_in_passing", r"\hat\tau_p", "MPa",
        "largest half range of the nominal shear stress in each shaft while the speed passes a "
        "range", "shaft_torque_in_passing",
    ),
    Node(
        "shaft_stress_limit_in_passing", r"\tau_T", "MPa",
        "permissible half range of the nominal shear stress in passing, as given", WILSON, si=MPA,
        needs=("shaft_system", "shaft"), make=_limit("shaft_transient_stress_limit"),
        of_shaft=("shaft_transient_stress_limit",), when="transient_limits_given",
    ),
    Node(
        "shaft_stress_limit_in_passing", r"\tau_T", "MPa",
        "permissible half range of the nominal shear stress in passing, as given, or of "
        "propulsion shafts up to 0.8 of the rated speed", "IACS UR M68", si=MPA,
        needs=("shaft_system", "speed_in_passing", "rated_speed", "shaft"), make=_limit_in_passing,
        of_shaft=("shaft_transient_stress_limit", "shaft_diameter", "shaft_tensile_strength",
                  "shaft_shape_factor"), when="transient_limits_of_rule",
    ),
    _over("shaft_stress_in_passing", r"\hat\tau_p/\tau_T", "nominal shear stress in passing over "
          "its limit", "IACS UR M68", "shaft_stress_in_passing", "shaft_stress_limit_in_passing"),
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

JUDGING = frozenset(node.name for node in LIMIT_NODES)  # Quantities that judge a shaft
