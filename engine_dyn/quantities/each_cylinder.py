"""Nodes of each cylinder's own mechanism, of articulated rods, and parameters of single cylinders.

A list in [set] gives the values of all cylinders at once. The parameters give the value of one
cylinder (`pressure_factor_3` is the factor on cylinder 3's pressure), so it can vary from design to
design: a gradual misfire, random masses, a crank pin turned through the cycle.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.forces import torque
from engine_dyn.geometry.arrangement import MOST_CYLINDERS
from engine_dyn.geometry.cylinder_means import value_of_each
from engine_dyn.geometry.cylinders import LARGEST_FACTOR, SMALLEST_RADIUS, Cylinders, Member
from engine_dyn.pressure.family import own_diagrams
from engine_dyn.quantities.balance import components_of, turning_gear
from engine_dyn.quantities.friction import gas_of, train_of
from engine_dyn.quantities.node import Node, hidden
from engine_dyn.units import BAR, DEGREE

SOURCE = "this project"

_OF_EACH = ("piston", "crank_ratio", "offset_ratio", "cylinder_set", "cylinders_by_count")
_NEEDS = (
    "crank_angle", "crank_ratio", "double_radius", "reciprocating_mass", "speed", "cylinder_set",
    "cylinders_by_count", "offset_ratio",
)  # fmt: skip
_TURNING = ("turning_mass", "throw_turning_mass")


def _of_each(needs: dict[str, Any], of_one: Callable[[Member, Any, Any], Any]) -> Any:
    crank = needs["crank_ratio"], needs["offset_ratio"]
    return value_of_each(
        lambda member: of_one(member, *crank), needs["piston"], needs["cylinder_set"],
        needs["cylinders_by_count"],
    )  # fmt: skip


def _top(*, period: float, **needs: Any) -> Any:
    top = _of_each(needs, lambda member, *crank: -member.phase_of(*crank))
    # An angle that only rounding puts below 0 is 0; other negative angles are moved up by a period.
    return np.where(top < -1e-12, top + period, np.maximum(top, 0.0))


def _bottom(*, period: float, **needs: Any) -> Any:
    bottom = _of_each(needs, lambda member, *crank: member.bottom(*crank) - member.phase_of(*crank))
    return bottom % period


def _travel(*, crank_angle: Any, double_radius: Any, **needs: Any) -> Any:
    def of_one(member: Member, *crank: Any) -> Any:
        return member.position(crank_angle + member.phase_of(*crank), *crank)

    return 0.5 * double_radius * _of_each(needs, of_one)


def _pressure(*, crank_angle: Any, **needs: Any) -> Any:
    def of_one(member: Member, *crank: Any) -> Any:
        angle = member.diagram_angle(crank_angle + member.phase_of(*crank), *crank)
        if "double_acting" in needs:
            return needs["double_acting"].head_end(angle)
        family = own_diagrams(needs["family"], member.diagram)
        return torque.pressure(
            angle, family, needs["row"], needs["pressure_scale"], member.pressure_factor
        )

    return _of_each(needs, of_one)


def _power(*, double_radius: Any, bore: Any, family: Any, row: Any, pressure_scale: Any,
           speed: Any, **needs: Any) -> Any:  # fmt: skip
    from engine_dyn.speed.torque import mean_gas_of_member

    def of_one(member: Member, crank_ratio: Any, offset: Any) -> Any:
        return mean_gas_of_member(member, crank_ratio, offset, row, family)

    lever = torque.piston_area(bore) * 0.5 * double_radius * pressure_scale
    return speed * lever * _of_each(needs, of_one)


def _force(name: str, symbol: str, long_name: str, order: int, turning: bool) -> Node:
    """Node of the reciprocating masses' force with articulated rods, alone or with rotating."""

    def make(**needs: Any) -> Any:
        from engine_dyn.forces import articulated

        motion = (
            needs["crank_ratio"], 0.5 * needs["double_radius"], needs["reciprocating_mass"],
            needs["speed"], needs["cylinder_set"], needs["cylinders_by_count"],
            needs["offset_ratio"],
        )  # fmt: skip
        phi = needs["crank_angle"]
        force = (
            articulated.inertia_force_of_order(order, phi, *motion) if order
            else articulated.inertia_force(phi, *motion)
        )  # fmt: skip
        if turning and order < 2:
            names = {*_NEEDS, *_TURNING} - {"crank_angle"}
            gear = turning_gear({name: value for name, value in needs.items() if name in names})
            force = force + gear.force(phi)
        return components_of(force)

    return Node(
        name, symbol, "N", long_name, SOURCE, kind="curve", adds=("direction",), throws=True,
        when="articulated_rods", needs=(*_NEEDS, *(_TURNING if turning else ())), make=make,
    )  # fmt: skip


MOTION = (
    Node(
        "cylinder_stroke", "s_k", "m", "stroke of each cylinder", SOURCE,
        needs=(*_OF_EACH, "double_radius"),
        make=lambda double_radius, **needs: double_radius * _of_each(needs, Member.stroke),
    ),
    Node(
        "top_dead_centre", r"\varphi_{T,k}", "degree",
        "crank angle at the firing top dead centre of each cylinder", SOURCE, si=DEGREE,
        needs=(*_OF_EACH, "period"), make=_top,
    ),
    Node(
        "bottom_dead_centre", r"\varphi_{B,k}", "degree",
        "crank angle at the bottom dead centre of each cylinder behind its firing", SOURCE,
        si=DEGREE, needs=(*_OF_EACH, "period"), make=_bottom,
    ),
    *(
        Node(
            "cylinder_pressure", "p_k", "bar",
            f"absolute pressure in {text}", SOURCE, si=BAR,
            kind="curve", when=when, needs=("crank_angle", *_OF_EACH, *needs), make=_pressure,
        )
        for when, text, needs in (
            ("single_acting", "each cylinder", ("family", "row", "pressure_scale")),
            ("double_acting", "the head end of each cylinder", ("double_acting",)),
        )
    ),
    Node(
        "cylinder_power", "P_{i,k}", "W", "indicated power of each cylinder at nominal speed",
        SOURCE, make=_power,
        needs=(*_OF_EACH, "double_radius", "bore", "family", "row", "pressure_scale", "speed"),
    ),
    Node(
        "cylinder_travel", "x_k", "m", "piston travel of each cylinder from its top dead centre",
        SOURCE, kind="curve", needs=("crank_angle", *_OF_EACH, "double_radius"), make=_travel,
    ),
)  # fmt: skip
"""Nodes of motion that every cylinder has."""

_LOADED = (
    *(need for need in _NEEDS if need != "crank_angle"), "bore", "family", "row", "pressure_scale",
    "crankcase_pressure", "period", "rod_mass_at_crank",
)  # fmt: skip


def _of_master(needs: dict[str, Any], more: tuple[Any, ...] = ()) -> tuple[Any, ...]:
    """Arguments of loads of the master rod of cylinder 1; `more` adds axes at the end."""
    arrays = {
        name: value
        if name in ("family", "period", "cylinders_by_count", "crank_angle")
        else np.asarray(value)[(..., *more)]
        for name, value in needs.items()
    }
    return (
        train_of(arrays), arrays["bore"], gas_of(arrays), arrays["reciprocating_mass"],
        arrays["speed"], arrays["rod_mass_at_crank"],
    )  # fmt: skip


def _master_loads(needs: dict[str, Any]) -> Any:
    from engine_dyn.forces import articulated

    return articulated.master_loads(needs["crank_angle"], *_of_master(needs))


def _crank_pin_extremes(*, curve_period: Any, **needs: Any) -> Any:
    from engine_dyn.forces import articulated

    return articulated.crank_pin_extremes(curve_period, *_of_master(needs, (None,)))


NODES = (
    *MOTION,
    _force("reciprocating_force", "P_J", "inertia force of all reciprocating masses, exact", 0,
           False),
    _force("reciprocating_force_first", "P_{J,1}",
           "first order of the inertia force of all reciprocating masses, primary force", 1, False),
    _force("reciprocating_force_second", "P_{J,2}",
           "second order of the inertia force of all reciprocating masses, secondary force", 2,
           False),
    _force("shaking_force", "F", "shaking force on the frame, exact, with counterweights", 0, True),
    _force("shaking_force_first", "F_1", "first order of the shaking force", 1, True),
    _force("shaking_force_second", "F_2", "second order of the shaking force", 2, True),
    Node(
        "wall_thrust", "N", "N",
        "wall thrust, side force of the piston on the cylinder wall, positive opposite to the side "
        "where the crank pin moves down, cylinder 1, with the moment of the articulated rods",
        SOURCE, kind="curve", throws=True, when="articulated_rods",
        needs=("crank_angle", *_LOADED), make=lambda **needs: _master_loads(needs).wall_thrust,
    ),
    hidden(
        "crank_pin_components", "N", "components of the load of the first crank pin",
        lambda **needs: _master_loads(needs).crank_pin, ("crank_angle", *_LOADED),
        kind="curve", throws=True, when="articulated_rods", width=160,
    ),
    hidden(
        "crank_pin_extremes", "N", "extremes of the load of the first crank pin",
        _crank_pin_extremes, (*_LOADED, "curve_period"), throws=True, when="articulated_rods",
        width=250_000,
    ),
)  # fmt: skip

NOT_FOLLOWED = frozenset({
    "tangential_force", "gas_tangential_force", "inertia_tangential_force", "net_tangential_force",
})  # fmt: skip
"""Nodes with another formula for articulated rods, though they take nothing of the mechanism."""

FOLLOWED = frozenset({
    *(node.name for node in NODES),
    # Lengths, masses and inertia; the motion of cylinder 1, whose rod is a master rod: it moves as
    # a plain rod does.
    "rod", "double_radius", "stroke_share", "mass_share", "mass_of_first", "direction_of_first",
    "throws_per_cylinder", "main_bearings", "position", "velocity", "acceleration",
    "position_coefficient", "velocity_coefficient", "acceleration_coefficient", "position_mean",
    "rod_angle", "rod_angular_velocity", "rod_angular_acceleration", "crank_angle_at_travel",
    "engine_inertia", "mean_reciprocating_inertia", "varying_inertia",
    # Pressure, torque and speed.
    "pressure_share", "mean_peak_pressure", "peak_pressure", "pressure", "mean_gas", "gas_torque",
    "inertia_torque", "inertia_torque_actual", "torque_after_throw", "shaft_torque_extremes",
    "torque_solution", "indicated_torque_solution", "speed_solution", "inertia_search",
    "piston_friction_torque", "held_load", "torque_to_hold",
    "torque_missing",
    *(f"{whose}_{part}_sum" for whose in ("engine", "cylinder")
      for part in ("gas", "speed", "inertia")),
    # Masses that turn with the crank, and the first crank pin.
    "throw_force", "counterweight_force", "crank_pin_x", "crank_pin_y",
})  # fmt: skip
"""Nodes that take the mechanism (crank ratio, offset or cylinders) and hold for articulated
rods.

All others that take the mechanism are refused: a new node has plain rods until it is added here."""


OF_MAKES = frozenset({
    # What all cylinders add up to.
    "displacement", "mean_peak_pressure", "peak_pressure", "mean_gas", "indicated_torque_mean",
    "gas_torque", "torque_after_throw", "shaft_torque_extremes", "torque_solution",
    "indicated_torque_solution", "speed_solution", "inertia_search", "torsional_response",
    "torsional_passing", "nonlinear_response", "throw_torque_mean",
    "gas_torque_harmonics", "first_mode_gas_torque_harmonics",
    "throw_gas_torque_harmonics", "engine_gas_sum", "first_mode_gas_sum", "throw_gas_sum",
    "every_throw_gas_sum", "main_journal_components", "main_journal_extremes",
    "all_main_journals_extremes", "bay_bending_moment_over_angle", "rod_load_extremes",
    "cylinder_pressure", "cylinder_power",
    # Where a load lies in the table of diagrams, whose loads all cylinders have in common.
    "place", "row",
    # Of cylinder 1, whose bore is the engine's, and whose diagram is asked for.
    "pressure", "cylinder_volume", "gas_force", "specific_mass", "cylinder_gas_sum",
    "cylinder_gas_torque_harmonics", "crank_pin_components", "crank_pin_extremes",
    "piston_pin_components", "piston_pin_extremes",
    *(f"{part}{force}_pressure" for part in ("", "gas_", "inertia_")
      for force in ("piston", "wall", "rod", "tangential", "radial")),
})  # fmt: skip
"""Nodes that take bore or diagrams and hold where cylinders have bores or diagrams of their own.

All others that take these are refused then: a new node holds for one make until it is added here.
"""

OF_ONE_MAKE = frozenset({"bore", "family", "mean_gas"})
"""Nodes that belong to cylinders of one make: see `OF_MAKES`."""


class Place(NamedTuple):
    """Kind of a parameter, such as `pressure_factor`, and the number of its cylinder, from 1."""

    what: str
    number: int


_FACTOR: dict[str, Any] = {
    "low": 0.0, "low_included": True, "high": LARGEST_FACTOR, "high_included": True,
}  # fmt: skip

PATTERNS: Mapping[str, Node] = MappingProxyType(
    {
        node.name: node
        for node in (
            Node(
                "pressure_factor_N", "f_N", "1",
                "factor on the combustion pressure (pressure above motored) of cylinder N, 0 for "
                "a misfire",
                "this project", kind="parameter", **_FACTOR,
            ),
            Node(
                "mass_factor_N", "m_N/m", "1", "factor on the reciprocating mass of cylinder N",
                "this project", kind="parameter", **_FACTOR,
            ),
            Node(
                "radius_factor_N", "r_N/r", "1",
                "crank radius of cylinder N, from 2 on, over that of cylinder 1", "this project",
                kind="parameter", **{**_FACTOR, "low": SMALLEST_RADIUS},
            ),
            Node(
                "bore_N", "D_N", "m", "bore of cylinder N, from 2 on", "this project",
                kind="parameter", low=0.0,
            ),
            Node(
                "firing_angle_N", r"\varphi_N", "degree",
                "crank angle at which cylinder N, from 2 on, fires; if the cylinder has its own "
                "throw, the throw moves with it",
                "this project", si=DEGREE, kind="parameter", low=0.0, low_included=True, high=720.0,
            ),
        )
    }
)  # fmt: skip
"""Parameters of cylinders as tables and messages list them: N is the number of a cylinder."""


def _named() -> dict[str, tuple[Place, Node]]:
    nodes = {}
    for pattern in PATTERNS.values():
        what = pattern.name.removesuffix("_N")
        # Cylinder 1 defines crank angle and stroke: some parameters exist from cylinder 2 on.
        for number in range(2 if "from 2 on" in pattern.long_name else 1, MOST_CYLINDERS + 1):
            text = pattern.long_name.replace(", from 2 on,", "").removesuffix(", from 2 on")
            text = text.replace(" N", f" {number}")
            node = replace(
                pattern, name=f"{what}_{number}", long_name=text,
                symbol=pattern.symbol.replace("N", f"{{{number}}}"), public=False,
            )  # fmt: skip
            nodes[node.name] = Place(what, number), node
    return nodes


_NAMED = _named()

PARAMETERS = tuple(node for _, node in _NAMED.values())

OF_CYLINDER: Mapping[str, Place] = MappingProxyType({k: place for k, (place, _) in _NAMED.items()})
"""Parameter and cylinder for each name of a cylinder's parameter."""


def with_values(cylinders: Cylinders, values: Mapping[str, float]) -> Cylinders:
    """Return the same cylinders with some of these parameters, by name, in SI units.

    The bore of a cylinder needs the engine's, `bore`, among them.

    Raises
    ------
    ValueError
        One line that begins with the name: a cylinder that does not exist, a bore without that of
        the engine, or what `Cylinders.with_factors` and `Cylinders.firing_at` refuse.
    """
    if not values:
        return cylinders
    factors: dict[str, list[float]] = {}
    bores = [1.0] * cylinders.count
    for key, value in values.items():
        if key == "bore":
            continue
        what, number = OF_CYLINDER[key]
        if number > cylinders.count:
            raise ValueError(f"{key}: must be of one of the {cylinders.count} cylinders")
        if what == "firing_angle":
            try:
                cylinders = cylinders.firing_at(number, value)
            except ValueError as error:
                raise ValueError(f"{key}: {error}") from None
            continue
        if what == "bore":
            if not values.get("bore", 0.0) > 0.0:
                raise ValueError(f"{key}: needs bore, that of cylinder 1")
            bores[number - 1] = value / values["bore"]
            continue
        each = factors.setdefault(what, list(getattr(cylinders, f"{what}s")))
        each[number - 1] = value
    cylinders = cylinders.with_factors(**{what: tuple(each) for what, each in factors.items()})
    return cylinders.with_makes(bores) if set(bores) != {1.0} else cylinders
