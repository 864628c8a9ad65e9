"""Nodes of the rod loads at the crosshead pin: see `engine_dyn.forces.rod_loads`."""

from __future__ import annotations

from typing import Any

from engine_dyn.forces import mechanism, torque
from engine_dyn.quantities.node import Node, hidden
from engine_dyn.units import DEGREE

API = "API 618"


def _extremes(*, family: Any, cylinders_by_count: Any, curve_period: Any, **needs: Any) -> Any:
    # Kernels are imported where they are called: importing the graph compiles and loads none.
    from engine_dyn.forces.rod_loads import rod_load_extremes

    return rod_load_extremes(needs, family, cylinders_by_count, curve_period)


def _inertia(
    piston_mass: Any, double_radius: Any, speed: Any, acceleration: Any, cylinder_set: Any,
    cylinders_by_count: Any,
) -> Any:  # fmt: skip
    factor = mechanism.of_cylinder(lambda m: m.mass_factor, cylinder_set, cylinders_by_count)
    return -factor * piston_mass * 0.5 * double_radius * speed**2 * acceleration


def _extreme(
    name: str, symbol: str, of: str, long_name: str, extreme_of: tuple[str, str] | None,
    unit: str = "N", si: float = 1.0,
) -> Node:  # fmt: skip
    return Node(
        name, symbol, unit, f"{long_name}, the worst of all cylinders", API, si=si,
        extreme_of=extreme_of, make=lambda rod_load_extremes: rod_load_extremes[of],
    )  # fmt: skip


NODES: tuple[Node, ...] = (
    Node(
        "gas_force", "P_g", "N", "gas force on the piston, positive towards the crank, cylinder 1",
        API, kind="curve", when="double_acting",
        make=lambda crank_angle, double_acting, crankcase_pressure, bore: torque.piston_area(bore)
        * (double_acting(crank_angle) - crankcase_pressure),
    ),
    Node(
        "crosshead_inertia_load", "P_i", "N",
        "inertia load at the crosshead pin, of piston_mass, compression of the piston rod "
        "positive, cylinder 1",
        API, kind="curve", make=_inertia,
    ),
    Node(
        "combined_rod_load", "P_c", "N",
        "combined rod load, gas and inertia load at the crosshead pin, compression of the piston "
        "rod positive, cylinder 1",
        API, kind="curve",
        make=lambda gas_force, crosshead_inertia_load: gas_force + crosshead_inertia_load,
    ),
    hidden(
        "rod_load_extremes", "N", "extremes and reversal of the rod loads",
        _extremes,
        ("crank_ratio", "double_radius", "offset_ratio", "bore", "row", "pressure_scale",
         "crankcase_pressure", "piston_mass", "speed", "cylinder_set", "family",
         "cylinders_by_count", "curve_period"), width=48,
    ),
    _extreme("gas_load_compression", "P_{g,+}", "gas_compression",
             "largest gas load that compresses the piston rod", ("gas_force", "above")),
    _extreme("gas_load_tension", "P_{g,-}", "gas_tension",
             "largest gas load that pulls at the piston rod", ("gas_force", "below")),
    _extreme("combined_rod_load_compression", "P_{c,+}", "compression",
             "largest compression of the combined rod load at the crosshead pin",
             ("combined_rod_load", "above")),
    _extreme("combined_rod_load_tension", "P_{c,-}", "tension",
             "largest tension of the combined rod load at the crosshead pin",
             ("combined_rod_load", "below")),
    _extreme("rod_load_reversal", r"\varphi_r", "reversal",
             "crank angle of the reversal of the combined rod load: the shorter of the longest "
             "stretches in compression and in tension", None, "degree", DEGREE),
    _extreme("rod_load_reversal_ratio", r"P_{c,small}/P_{c,large}", "ratio",
             "largest reversed over largest opposite combined rod load",
             ("combined_rod_load", "reversal"), "1"),
)  # fmt: skip
