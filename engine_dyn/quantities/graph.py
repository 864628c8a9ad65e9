"""The graph of parameters and quantities: plain data.

Planner, command line, README, file attributes and tests all read this table. A node without `make`
is a leaf. Everything is computed in SI units; a file's unit is `unit`, and `si` converts: the SI
value is the file's times `si`. The arguments of `make` are the node's needs, in any order, by name.
The axes of a node are the union of its needs' axes, plus what it adds; nobody writes axes by hand.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from engine_dyn.forces import torque
from engine_dyn.geometry import arrangement, masses, slider_crank
from engine_dyn.geometry.cylinders import CylindersByCount, Member
from engine_dyn.loads import driven_machine, friction
from engine_dyn.loads.characteristic import load_for_torque
from engine_dyn.pressure.diagram import Family
from engine_dyn.pressure.family_grid import FamilyStack
from engine_dyn.pressure.motored import peak_with_factor
from engine_dyn.quantities import (
    balance,
    bearing_loads,
    characteristics,
    flywheels,
    mechanism_forces,
    orders,
    series,
    single_cylinders,
)
from engine_dyn.quantities.node import Dimension, Node
from engine_dyn.units import BAR, DEGREE, RPM

__all__ = [
    "ALONG_SHAFT",
    "CONSTANTS",
    "CYCLE_KEYS",
    "DEFAULTS",
    "DIMENSIONS",
    "INERTIA_PARTS",
    "MOTOR_KEYS",
    "NEUTRAL",
    "NODES",
    "NO_STROKE_FRICTION",
    "PARAMETERS",
    "QUANTITIES",
    "SOLVER_COLUMNS",
    "STROKE_SHARES",
    "Node",
    "check_graph",
    "select",
]


def _parameter(name: str, symbol: str, unit: str, long_name: str, **more: Any) -> Node:
    return Node(name, symbol, unit, long_name, kind="parameter", **more)


_PARAMETERS = (
    _parameter(
        "reciprocating_mass", "m", "kg", "reciprocating mass per cylinder",
        source="Kakaitsas eq. 2.10", low=0.0, low_included=True,
        needs=("piston_mass", "rod_mass", "rod_centre_of_gravity", "rod"),
        make=lambda piston_mass, rod_mass, rod_centre_of_gravity, rod: masses.reciprocating_mass(
            piston_mass, rod_mass, rod_centre_of_gravity, rod
        ),
    ),
    _parameter(
        "inertia", r"\Theta", "kg m2", "moment of inertia of the whole engine with its load",
        source="Kakaitsas section 3.2", low=0.0, when="wanted_delta", needs=("inertia_required",),
        make=lambda inertia_required: inertia_required,
    ),
    _parameter(
        "inertia", r"\Theta", "kg m2", "moment of inertia of the whole engine with its load",
        source="Kakaitsas section 3.2", low=0.0, when="inertia_in_parts",
        needs=("engine_inertia", "auxiliary_inertia", "flywheel_inertia", "inertia_beyond_gear"),
        make=lambda engine_inertia, auxiliary_inertia, flywheel_inertia, inertia_beyond_gear:
        masses.inertia_of_parts(
            engine_inertia, auxiliary_inertia, flywheel_inertia, inertia_beyond_gear
        ),
    ),
    _parameter(
        "inertia", r"\Theta", "kg m2", "moment of inertia of the whole engine with its load",
        source="Kakaitsas section 3.2", low=0.0, when="inertia_whole",
    ),
    _parameter(
        "auxiliary_inertia", r"\Theta_{aux}", "kg m2",
        "moment of inertia of the auxiliaries, at the crank", low=0.0, low_included=True,
        source="Kakaitsas eq. 3.2",
    ),
    _parameter(
        "flywheel_inertia", r"\Theta_{fly}", "kg m2", "moment of inertia of the flywheel",
        low=0.0, low_included=True, source="Kakaitsas eq. 3.2",
    ),
    _parameter(
        "load_inertia", r"\Theta_L", "kg m2", "moment of inertia of the load at its own shaft",
        low=0.0, low_included=True, source="Kakaitsas eq. 3.1",
    ),
    _parameter(
        "gear_ratio", "i", "1", "speed of the load's shaft over that of the crank", low=0.0,
        high=100.0, high_included=True, source="Kakaitsas eq. 3.1",
    ),
    _parameter(
        "load_phase", r"\theta_0", "degree",
        "angle of a load over angle at firing dead centre of cylinder 1", si=DEGREE, low=-720.0,
        high=720.0, low_included=True, high_included=True, source="this project",
    ),
    _parameter(
        "load_table_factor", "f_L", "1", "factor on a load over angle", low=0.0, low_included=True,
        source="this project",
    ),
    _parameter(
        "motor_gear_ratio", "i_m", "1",
        "driving motor: speed of its shaft over that of the crank", low=0.0, high=100.0,
        high_included=True, source="this project",
    ),
    _parameter(
        "motor_synchronous_speed", "n_s", "rpm",
        "driving motor: synchronous speed, at its own shaft", si=RPM, low=0.0,
        source="Kloss's formula", when="motor_of_slip",
        needs=("speed", "motor_slip", "motor_gear_ratio"), make=driven_machine.synchronous_speed,
    ),
    _parameter(
        "motor_synchronous_speed", "n_s", "rpm",
        "driving motor: synchronous speed, at its own shaft", si=RPM, low=0.0,
        source="Kloss's formula", when="motor_of_speed",
    ),
    _parameter(
        "motor_slip", "s_n", "1",
        "driving motor: slip at nominal speed, for a gear or supply that follows that speed",
        low=0.0, high=1.0, source="Kloss's formula",
    ),
    _parameter(
        "motor_breakdown_slip", "s_b", "1", "driving motor: slip at the largest torque", low=0.0,
        high=10.0, source="Kloss's formula",
    ),
    _parameter(
        "motor_breakdown_torque", "M_b", "N m", "driving motor: largest torque, at its own shaft",
        low=0.0, source="Kloss's formula",
    ),
    _parameter(
        "crank_ratio", r"\lambda", "1", "crank ratio, crank radius over rod length",
        source="Kakaitsas eq. 1.3", low=0.0, high=1.0, when="offset",
        needs=("rod_length", "stroke", "pin_line"),
        make=lambda rod_length, stroke, pin_line: slider_crank.crank_radius(
            stroke, rod_length, pin_line
        ) / rod_length,
    ),
    _parameter(
        "crank_ratio", r"\lambda", "1", "crank ratio, crank radius over rod length",
        source="Kakaitsas eq. 1.3", low=0.0, high=1.0, when="centred",
        needs=("rod_length", "stroke"),
        make=lambda rod_length, stroke: 0.5 * stroke / rod_length,
    ),
    _parameter(
        "rod_length", "l", "m", "connecting rod length between centres", low=0.0,
        source="Kakaitsas table 4.1",
    ),
    _parameter("bore", "D", "m", "cylinder bore", low=0.0, source="Kakaitsas table 4.1"),
    _parameter("stroke", "s", "m", "piston stroke", low=0.0, source="Kakaitsas table 4.1"),
    _parameter(
        "pin_offset", "e_p", "m",
        "offset of the piston pin from the cylinder's axis, positive where the crank pin goes down",
        source="Norton, Design of Machinery: offset slider-crank",
    ),
    _parameter(
        "crank_offset", "e_c", "m",
        "offset of the cylinder's axis from the crank's, positive where the crank pin goes down",
        source="Norton, Design of Machinery: offset slider-crank",
    ),
    _parameter(
        "speed", "n", "rpm", "nominal crank speed", si=RPM, low=0.0, source="Kakaitsas table 4.1"
    ),
    _parameter(
        "load", "L", "percent", "engine load that names the indicator diagram",
        source="Kakaitsas section 5.2.5", low=0.0, low_included=True, when="given_load",
    ),
    _parameter(
        "load", "L", "percent", "engine load that names the indicator diagram",
        source="Power units, lecture 18", low=0.0, low_included=True, when="characteristic",
        needs=(
            "characteristic_torque", "characteristic_share", "words", "speed", "family", "cycle",
            "crank_ratio", "offset_ratio", "pressure_share", "sharing", "diagram_scale", "bore",
            "throw", "cylinders", "cylinder_set", "cylinders_by_count", "displacement", "period",
            "stroke_share", "cycle_known",
            "mean_piston_speed", "friction_constant", "friction_peak_pressure",
            "friction_mean_piston_speed", "friction_mean_piston_speed_square", "auxiliary_torque",
        ),
        make=lambda **needs: _load_of_characteristic(**needs),
    ),
    _parameter(
        "cylinders", "Z", "1", "number of cylinders", whole=True, low=1.0, low_included=True,
        high=float(arrangement.MOST_CYLINDERS), high_included=True, source="Kakaitsas section 5.4",
    ),
    _parameter(
        "misfire", "i_0", "1", "number of the cylinder that does not burn, 0: none", whole=True,
        low=0.0, low_included=True, high=float(arrangement.MOST_CYLINDERS), high_included=True,
        source="this project",
    ),
    _parameter(
        "load_exponent", r"\alpha", "1", "exponent of the load torque over speed", low=0.0,
        low_included=True, source="Kakaitsas eq. 3.4",
    ),
    _parameter(
        "load_offset", "a", "N m", "load torque that does not depend on speed",
        source="Kakaitsas eq. 3.4",
    ),
    _parameter(
        "crankcase_pressure", "p_c", "bar", "absolute pressure under the piston", si=BAR, low=0.0,
        low_included=True, source="Kakaitsas section 2.1",
    ),
    _parameter(
        "piston_mass", r"m_\epsilon", "kg", "piston with pin and rings", low=0.0,
        low_included=True, source="Kakaitsas table 4.1",
    ),
    _parameter(
        "rod_mass", r"m_\delta", "kg", "connecting rod mass", low=0.0, low_included=True,
        source="Kakaitsas table 4.1",
    ),
    _parameter(
        "rod_centre_of_gravity", "l_{cg}", "m",
        "distance of the rod's centre of gravity from the big end", low=0.0, low_included=True,
        source="Kakaitsas table 4.1",
    ),
    _parameter(
        "rod_inertia", r"\theta_\delta", "kg m2",
        "moment of inertia of the rod about its centre of gravity; unless given, that of its two "
        "masses",
        low=0.0, source="Rakopoulos notes, third condition", needs=("two_mass_rod_inertia",),
        make=lambda two_mass_rod_inertia: two_mass_rod_inertia,
    ),
    _parameter(
        "crank_mass", r"m_\sigma", "kg", "crank throw mass reduced to the crank radius", low=0.0,
        low_included=True, source="Kakaitsas eq. 2.15",
    ),
    _parameter(
        "friction_constant", "a_2", "bar", "constant part of the friction mean effective pressure",
        si=BAR, low=0.0, low_included=True, source="Kakaitsas eq. 3.9",
    ),
    _parameter(
        "friction_peak_pressure", "b_2", "1",
        "share of the peak pressure in the friction mean effective pressure", low=0.0,
        low_included=True, source="Kakaitsas eq. 3.9",
    ),
    _parameter(
        "friction_mean_piston_speed", "c_2", "bar s m-1",
        "friction mean effective pressure per mean piston speed", si=BAR, low=0.0,
        low_included=True, source="Kakaitsas eq. 3.9",
    ),
    _parameter(
        "friction_mean_piston_speed_square", "d_2", "bar s2 m-2",
        "friction mean effective pressure per square of the mean piston speed", si=BAR, low=0.0,
        low_included=True, source="Chen and Flynn, SAE 650733",
    ),
    _parameter(
        "friction_boundary", "f_b", "1",
        "share of the friction over the stroke with a constant coefficient", low=0.0,
        low_included=True, high=1.0, high_included=True,
        source="after Rezeka and Henein, SAE 840179",
    ),
    _parameter(
        "friction_mixed", "f_m", "1",
        "share of the friction over the stroke whose coefficient falls as the piston moves",
        low=0.0, low_included=True, high=1.0, high_included=True,
        source="after Rezeka and Henein, SAE 840179",
    ),
    _parameter(
        "friction_hydrodynamic", "f_h", "1",
        "share of the friction over the stroke that grows with the root of speed times pressure",
        low=0.0, low_included=True, high=1.0, high_included=True,
        source="after Rezeka and Henein, SAE 840179",
    ),
    _parameter(
        "friction_skirt", "f_s", "1",
        "share of the friction over the stroke that grows with the piston's speed", low=0.0,
        low_included=True, high=1.0, high_included=True,
        source="after Rezeka and Henein, SAE 840179",
    ),
    _parameter(
        "ring_pressure", "p_r", "bar",
        "pressure of the piston rings on the liner by their own tension", si=BAR, low=0.0,
        high=100.0, source="after Rezeka and Henein, SAE 840179",
    ),
    _parameter(
        "auxiliary_torque", "M_{aux}", "N m",
        "torque of the auxiliaries at the crankshaft, part of the friction", low=0.0,
        low_included=True, source="this project",
    ),
    _parameter(
        "compression_ratio", r"\varepsilon", "1",
        "modelled cycle: largest over smallest cylinder volume", low=1.5, high=40.0,
        source="Heywood (1988), ch. 2",
    ),
    _parameter(
        "intake_pressure", "p_i", "bar",
        "modelled cycle: absolute pressure of intake manifold or scavenge air", si=BAR, low=0.0,
        high=20.0, source="Heywood (1988), ch. 6",
    ),
    _parameter(
        "heat", "q", "bar", "modelled cycle: heat released per cycle over the swept volume",
        si=BAR, low=0.0, low_included=True, high=200.0, high_included=True,
        source="Heywood (1988), ch. 9",
    ),
    _parameter(
        "combustion_start", r"\varphi_b", "degree", "modelled cycle: start of the combustion",
        si=DEGREE, low=-90.0, high=90.0, source="Heywood (1988), eq. 9.30",
    ),
    _parameter(
        "combustion_duration", r"\Delta\varphi_b", "degree",
        "modelled cycle: duration of the combustion", si=DEGREE, low=2.0, high=270.0,
        source="Heywood (1988), eq. 9.30",
    ),
    _parameter(
        "truncation", r"\nu_{max}", "1",
        "highest order kept, an even number, of the shortened series of the piston's motion",
        whole=True, low=2.0, low_included=True, high=40.0, high_included=True,
        source="Mosakowski eqs. 13, 18",
    ),
    _parameter(
        "passes", "N", "1", "cycles to march (methods thesis and picard)", whole=True, low=1.0,
        low_included=True, source="Kakaitsas section 4.2",
    ),
    _parameter(
        "start_speed", r"\omega_1", "rad s-1", "crank speed to march from (thesis and picard)",
        low=0.0, source="Kakaitsas section 4.2",
    ),
    _parameter(
        "start_angle", r"\varphi_1", "degree", "crank angle to march from (thesis and picard)",
        si=DEGREE, low=-720.0, high=720.0, low_included=True, high_included=True,
        source="Kakaitsas section 4.2",
    ),
    *single_cylinders.PARAMETERS,
    *balance.PARAMETERS,
    *flywheels.PARAMETERS,
    *characteristics.PARAMETERS,
)  # fmt: skip

CYCLE_KEYS = (
    "compression_ratio", "intake_pressure", "heat", "combustion_start", "combustion_duration",
)  # fmt: skip
"""Parameters of a modelled cycle that a scene may replace in the engine's diagrams."""

NEUTRAL: Mapping[str, float] = MappingProxyType(
    {
        "pin_offset": 0.0, "crank_offset": 0.0, "friction_mean_piston_speed_square": 0.0,
        "auxiliary_torque": 0.0, "auxiliary_inertia": 0.0, "flywheel_inertia": 0.0,
        "load_inertia": 0.0, "gear_ratio": 1.0, "load_phase": 0.0, "load_table_factor": 1.0,
        "motor_gear_ratio": 1.0,
        "friction_boundary": 0.0, "friction_mixed": 0.0, "friction_hydrodynamic": 0.0,
        "friction_skirt": 0.0, "misfire": 0.0, **dict.fromkeys(balance.NEUTRAL, 0.0),
    }
)  # fmt: skip
"""Parameters that have these values, in file units, unless given."""

INERTIA_PARTS = ("auxiliary_inertia", "flywheel_inertia", "load_inertia")
"""Any of them given, the inertia is that of the engine's running gear and these parts."""

MOTOR_KEYS = (
    "motor_synchronous_speed", "motor_breakdown_slip", "motor_breakdown_torque", "motor_slip",
    "motor_gear_ratio",
)  # fmt: skip
"""Any of them given, an induction motor drives."""

STROKE_SHARES = (
    "friction_boundary", "friction_mixed", "friction_hydrodynamic", "friction_skirt",
)  # fmt: skip
"""Parameters that spread the friction over the stroke."""

NO_STROKE_FRICTION = (
    "boundary_friction", "mixed_friction", "hydrodynamic_friction", "skirt_friction",
    "ring_pressure",
)  # fmt: skip
"""Nodes that are 0 where all of `STROKE_SHARES` are."""

DEFAULTS: Mapping[str, float] = MappingProxyType({"truncation": 2.0})
"""Parameters that have another value unless given."""

SOLVER_COLUMNS = ("passes", "start_speed", "start_angle")
"""Parameters of the marching methods, given in [solver] or as columns of [designs]."""

_CONSTANTS = tuple(
    Node(name, "", "1", long_name, kind="constant", public=False)
    for name, long_name in (
        ("family", "indicator diagrams over load"),
        ("cycle", "which of the scene's modelled cycles"),
        ("cycle_known", "1, NaN where the parameters are no cycle"),
        ("period", "angle of one cycle"),
        ("closure", "what the nominal speed is the mean of"),
        ("tolerance", "relative error of delta aimed at"),
        ("scale_table", "factor on the pressure over speed"),
        ("driven", "load over angle, load over speed or driver"),
        ("cylinder_set", "which of the scene's sets of cylinders"),
        ("cylinders_by_count", "phases and factors of the cylinders of each set"),
        ("method", "method of the periodic speed"),
        ("inertia_model", "constant or variable inertia"),
        ("sharing", "tables of the sweep, and designs that share one"),
        ("characteristic", "power and torque over speed"),
        ("words", "what selects variants of nodes"),
    )
)


def _row(place: Any, cycle: Any, family: FamilyStack) -> Any:
    return family.row_of(cycle, place)


def _some(load: Any, family: Any) -> Any:
    """Loads to look up: the first where there is none, whose pressure scale is no number."""
    return np.where(np.isnan(load), family.loads[0], load)


def _place(load: Any, family: Family) -> Any:
    row, weight = family.locate(_some(load, family))
    return row + weight


def _place_at_speed(load: Any, speed: Any, family: Any) -> Any:
    return family.place(_some(load, family), speed)


def _load_of_characteristic(
    *, characteristic_torque: Any, characteristic_share: Any, words: tuple[str, ...], **needs: Any
) -> Any:  # fmt: skip
    """Load at which the mean torque, with all that it depends on, is the characteristic's share.

    NaN where the engine's diagrams do not give that torque, and where there is no torque.
    """

    def torque_of(load: Any) -> Any:
        known = {**needs, "load": load}

        def value(name: str) -> Any:
            if name not in known:
                node = select(name, *words)
                assert node.make is not None
                known[name] = node.make(**{need: value(need) for need in node.needs})
            return known[name]

        return value("torque_mean")

    arrays = [np.asarray(v) for v in needs.values() if isinstance(v, np.ndarray | float | int)]
    wanted = np.asarray(characteristic_torque) * characteristic_share
    wanted = np.broadcast_to(
        wanted, np.broadcast_shapes(wanted.shape, *(a.shape for a in arrays if a.dtype.kind == "f"))
    )
    return load_for_torque(torque_of, needs["family"].loads, wanted)


def _scale(speed: Any, scale_table: Any) -> Any:
    return np.interp(np.asarray(speed) / RPM, *scale_table)


def _mean_gas(
    crank_ratio: Any, offset_ratio: Any, row: Any, family: Family, pressure_share: Any,
    sharing: tuple[int, int],
) -> Any:  # fmt: skip
    # The kernels come in only when asked for: importing this table compiles and loads nothing.
    from engine_dyn.speed import dispatch

    of_tables = partial(
        dispatch.mean_gas_torque, crank_ratio, row, family, offset_ratio, tables=sharing[0]
    )
    whole = of_tables()
    share = np.asarray(pressure_share)
    if (share == 1.0).all():
        return whole * share
    motored = of_tables(pressure_factor=0.0)
    return np.where(share == 1.0, whole, motored + share * (whole - motored))


def _mean_gas_of_throws(
    crank_ratio: Any, offset_ratio: Any, row: Any, family: Family, cylinder_set: Any,
    cylinders_by_count: CylindersByCount, sharing: tuple[int, int],
) -> Any:  # fmt: skip
    """Mean over cylinders on throws of unequal radius, over the engine's."""
    from engine_dyn.speed import dispatch

    def of_one(member: Member) -> Any:
        own = member.own(crank_ratio, offset_ratio)
        return member.radius_factor * dispatch.mean_gas_torque(
            own.crank_ratio, row, family, own.offset, member.pressure_factor, sharing[0]
        )

    return _mean_of_cylinders(cylinder_set, cylinders_by_count, of_one)


def _mean_square_of_throws(
    crank_ratio: Any, offset_ratio: Any, cylinder_set: Any, cylinders_by_count: CylindersByCount
) -> Any:
    """Mean over cylinders of the square of velocity, times mass and radius factors."""

    def of_one(member: Member) -> Any:
        share = member.mass_factor * member.radius_factor**2
        return share * masses.mean_square_velocity(*member.own(crank_ratio, offset_ratio))

    return _mean_of_cylinders(cylinder_set, cylinders_by_count, of_one)


def _mean_stroke_of_throws(
    crank_ratio: Any, offset_ratio: Any, cylinder_set: Any, cylinders_by_count: CylindersByCount
) -> Any:
    """Mean over cylinders of the stroke over that of the engine's throw."""

    def of_one(member: Member) -> Any:
        own = slider_crank.dead_centres(*member.own(crank_ratio, offset_ratio)).stroke
        return member.radius_factor * own

    mean = _mean_of_cylinders(cylinder_set, cylinders_by_count, of_one)
    return mean / slider_crank.dead_centres(crank_ratio, offset_ratio).stroke


def _mean_of_cylinders(
    cylinder_set: Any, cylinders_by_count: CylindersByCount, of_one: Callable[[Member], Any]
) -> Any:
    """Mean of a value over the cylinders of each set; equal cylinders are computed once."""
    counts = np.asarray(cylinder_set)
    total: Any = np.nan
    for count in np.unique(counts):
        members = [m._replace(phase=0.0) for m in cylinders_by_count[int(count)].members]
        each = {member: of_one(member) for member in set(members)}
        whole = sum(each[member] for member in members) / len(members)
        total = np.where(counts == count, whole, total)
    return total


def _by_count(cylinders: Any, values: Callable[[int], Any]) -> Any:
    """Take a value for each set of cylinders."""
    counts = np.asarray(cylinders)
    found = np.empty(counts.shape)
    for count in np.unique(counts):
        found[counts == count] = values(int(count))
    return found


def _peaks(
    row: Any, family: Family, scale: Any, cylinders: Any, by_count: CylindersByCount,
    of_all: Callable[..., Any],
) -> Any:  # fmt: skip
    """Largest or mean p_max of unequal cylinders."""
    counts = np.asarray(cylinders)
    total: Any = np.nan
    for count in np.unique(counts):
        factors = by_count[int(count)].pressure_factors
        each = {f: peak_with_factor(row, family, f) for f in set(factors)}
        peaks = of_all([each[f] for f in factors], axis=0)
        total = np.where(counts == count, peaks, total)
    return total * scale


_RUBBING = (
    "friction_constant", "friction_peak_pressure", "friction_mean_piston_speed",
    "friction_mean_piston_speed_square", "mean_piston_speed",
)  # fmt: skip


def _rubbing(
    friction_constant: Any, friction_peak_pressure: Any, friction_mean_piston_speed: Any,
    friction_mean_piston_speed_square: Any, mean_piston_speed: Any, peak: Any,
) -> Any:  # fmt: skip
    return friction.friction_mean_effective_pressure(
        friction_constant, friction_peak_pressure, friction_mean_piston_speed, peak,
        mean_piston_speed, friction_mean_piston_speed_square,
    )  # fmt: skip


def _power(base: Any, exponent: Any) -> Any:
    """Power whose bits do not depend on how designs are cut into blocks.

    Along a loop with one exponent, NumPy squares where that is 2, and else calls `pow`: the last
    digit would depend on the shape of the arrays.
    """
    power = base**exponent
    if np.ndim(exponent) == 0 or not np.any(exponent == 2.0):
        return power
    return np.where(exponent == 2.0, np.square(base), power)


_OF_MOTOR = ("synchronous_speed", "motor_breakdown_slip", "breakdown_torque")

_NAMES_OF_LOAD = {
    "load_gear": "gear_ratio", "load_table_factor": "load_scale",
    "motor_breakdown_slip": "breakdown_slip",
}  # fmt: skip


def _speed_solution(**needs: Any) -> Any:
    from engine_dyn.speed import dispatch

    found = dispatch.solve(**_solver_inputs(needs))
    return {**found, "outcome": found["status"]}


def _inertia_search(**needs: Any) -> Any:
    from engine_dyn.speed.required import solve_for_inertia

    found = solve_for_inertia(**_solver_inputs(needs))
    return {"inertia_required": found.inertia, "search_status": found.status}


def _solver_inputs(needs: dict[str, Any]) -> dict[str, Any]:
    """Needs under the names that the solver's front has for them."""
    needs["mass"] = needs.pop("reciprocating_mass")
    needs["exponent"] = needs.pop("load_exponent", 1.0)
    # Of a load over angle, its mean is part of what the speed does not change.
    needs["offset"] = needs.pop("load_constant" if "load_constant" in needs else "load_offset")
    for name, here in _NAMES_OF_LOAD.items():
        if name in needs:
            needs[here] = needs.pop(name)
    needs["mean_torque"] = needs.pop("torque_mean")
    needs["scale"] = needs.pop("pressure_scale")
    needs["stroke"] = needs.pop("throw")
    needs["cylinders"] = needs.pop("cylinder_set")
    needs.pop("period")
    return needs


def _torque_solution(**needs: Any) -> Any:
    from engine_dyn.speed import dispatch

    needs["mass"] = needs.pop("reciprocating_mass")
    needs["scale"] = needs.pop("pressure_scale")
    needs["stroke"] = needs.pop("throw")
    needs["cylinders"] = needs.pop("cylinder_set")
    needs.pop("period")
    for name, here in _NAMES_OF_LOAD.items():
        if name in needs:
            needs[here] = needs.pop(name)
    return dispatch.torque_extremes(**needs)


def _product(**needs: Any) -> Any:
    return math.prod(needs.values())


def _stroke_friction(needs: dict[str, Any]) -> friction.StrokeFriction:
    """Take the friction over the stroke out of the needs of a curve."""
    return friction.StrokeFriction._make(needs.pop(name) for name in NO_STROKE_FRICTION)


def _curve_inputs(needs: dict[str, Any]) -> dict[str, Any]:
    """Rename the needs of a curve as `forces` has them."""
    names = {
        "crank_angle": "phi", "pressure_scale": "scale", "throw": "stroke",
        "reciprocating_mass": "mass", "offset_ratio": "offset", "cylinder_set": "cylinders",
        "cylinders_by_count": "by_count",
    }  # fmt: skip
    return {names.get(name, name): value for name, value in needs.items()}


def _friction_over_stroke(**needs: Any) -> Any:
    shape = _stroke_friction(needs)
    return torque.friction_over_stroke(shape=shape, **_curve_inputs(needs))


def _torque_after_throw(**needs: Any) -> Any:
    shape = _stroke_friction(needs)
    uniform = not any(np.any(level) for level in shape.levels)
    return torque.torque_after_throw(shape=None if uniform else shape, **_curve_inputs(needs))


def _ratio(numerator: Any, denominator: Any) -> Any:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(denominator == 0.0, np.nan, np.divide(numerator, denominator))


def _balance(plus: Any, minus: Any) -> Any:
    """Difference of two torques or pressures; nothing but rounding is nothing (idle)."""
    plus, minus = np.asarray(plus), np.asarray(minus)
    difference = plus - minus
    return np.where(np.abs(difference) <= 1e-13 * np.abs(minus), 0.0, difference)


def _speed_solution_node(when: str, load: str = "load_offset", *more: str) -> Node:
    """Return the stage of the periodic speed; `more` is what loads and drivers need."""
    return Node(
        "speed_solution", "", "", "periodic crank speed", kind="stage", public=False,
        can_fail=True, when=when,
        gives=(
            "delta", "delta_midrange", "omega_max", "omega_min", "omega_mean", "load_factor",
            "delta_error", "iterations", "omega", "angular_acceleration", "status",
            "outcome",
        ),
        needs=(
            "crank_ratio", "row", "pressure_scale", "crankcase_pressure", "offset_ratio",
            *NO_STROKE_FRICTION, "bore", "throw", "reciprocating_mass", "speed", "inertia", load,
            "torque_mean", "friction_torque", "cylinder_set", "cylinders_by_count", "passes",
            "start_speed", "start_angle", "family", "period", "closure", "tolerance", "sharing",
            "method", "inertia_model", "crank_angle",
            *(("load_exponent",) if "power_law" in when else ()), *more,
        ),
        make=_speed_solution, source="mathematics: energy form of Kakaitsas eq. 3.1",
    )  # fmt: skip


_OF_ANGLE = ("load_gear", "load_phase", "load_table_factor")

_STAGES = (
    Node(
        "place", "", "1", "place of load and speed in the table of one family", kind="value",
        public=False, when="over_load", needs=("load", "family"), make=_place,
    ),
    Node(
        "place", "", "1", "place of load and speed in the table of one family", kind="value",
        public=False, when="over_speed", needs=("load", "speed", "family"), make=_place_at_speed,
    ),
    Node(
        "row", "", "1", "place of the diagram in the family's table", kind="value", public=False,
        when="given_cycles", needs=("place",), make=lambda place: place,
    ),
    Node(
        "row", "", "1", "place of the diagram in the family's table", kind="value", public=False,
        when="own_cycles", needs=("place", "cycle", "family"), make=_row,
    ),
    Node(
        "rubbing", "", "Pa", "friction mean effective pressure without the auxiliaries",
        public=False, when="equal", needs=(*_RUBBING, "peak_pressure"),
        make=lambda friction_constant, friction_peak_pressure, friction_mean_piston_speed,
        friction_mean_piston_speed_square, mean_piston_speed, peak_pressure: _rubbing(
            friction_constant, friction_peak_pressure, friction_mean_piston_speed,
            friction_mean_piston_speed_square, mean_piston_speed, peak_pressure,
        ),
    ),
    Node(
        "rubbing", "", "Pa",
        "friction mean effective pressure without the auxiliaries, the mean of the cylinders",
        public=False, when="unequal", needs=(*_RUBBING, "mean_peak_pressure"),
        make=lambda friction_constant, friction_peak_pressure, friction_mean_piston_speed,
        friction_mean_piston_speed_square, mean_piston_speed, mean_peak_pressure: _rubbing(
            friction_constant, friction_peak_pressure, friction_mean_piston_speed,
            friction_mean_piston_speed_square, mean_piston_speed, mean_peak_pressure,
        ),
    ),
    *(
        node
        for name, when in (("pressure_scale", "given_load"), ("diagram_scale", "characteristic"))
        for node in (
            Node(
                name, "", "1", "factor on the diagram at this speed", public=False,
                needs=("speed", "scale_table"), make=_scale, when=f"given_cycles {when}",
                source="diesel_105x137: curve times peak pressure over speed",
            ),
            Node(
                name, "", "1",
                "factor on the diagram at this speed, NaN where the parameters are no cycle",
                public=False, needs=("speed", "scale_table", "cycle_known"),
                when=f"own_cycles {when}",
                make=lambda speed, scale_table, cycle_known: cycle_known
                * _scale(speed, scale_table),
            ),
        )
    ),
    Node(
        "pressure_scale", "", "1",
        "factor on the diagram, NaN where none gives the characteristic's torque", public=False,
        needs=("diagram_scale", "load"), when="characteristic",
        make=lambda diagram_scale, load: np.where(np.isnan(load), np.nan, diagram_scale),
    ),
    Node(
        "rod", "l", "m", "connecting rod length", public=False, needs=("throw", "crank_ratio"),
        make=lambda throw, crank_ratio: 0.5 * throw / crank_ratio,
    ),
    Node(
        "pin_line", "e", "m", "offset of the piston pin's line from the crank's axis",
        public=False, needs=("pin_offset", "crank_offset"),
        make=lambda pin_offset, crank_offset: pin_offset + crank_offset,
    ),
    Node(
        "throw", "2r", "m", "two crank radii", public=False, when="centred", needs=("stroke",),
        make=lambda stroke: stroke,
    ),
    Node(
        "throw", "2r", "m", "two crank radii", public=False, when="offset",
        needs=("stroke", "crank_ratio", "pin_line"),
        make=lambda stroke, crank_ratio, pin_line: 2.0 * slider_crank.crank_radius_of_ratio(
            stroke, crank_ratio, pin_line
        ),
    ),
    Node(
        "offset_ratio", "e/r", "1", "offset of the pin's line over the crank radius", public=False,
        needs=("pin_line", "throw"), make=lambda pin_line, throw: pin_line / (0.5 * throw),
    ),
    Node(
        "pressure_share", "", "1", "mean factor on the pressure of the cylinders", public=False,
        needs=("cylinder_set", "cylinders_by_count"),
        make=lambda cylinder_set, cylinders_by_count: _by_count(
            cylinder_set, lambda z: np.mean(cylinders_by_count[z].pressure_factors)
        ),
    ),
    Node(
        "mass_share", "", "1", "mean factor on the mass of the cylinders", public=False,
        needs=("cylinder_set", "cylinders_by_count"),
        make=lambda cylinder_set, cylinders_by_count: _by_count(
            cylinder_set, lambda z: np.mean(cylinders_by_count[z].mass_factors)
        ),
    ),
    Node(
        "mean_peak_pressure", "", "Pa", "largest pressure, the mean of the cylinders", public=False,
        needs=("row", "family", "pressure_scale", "cylinder_set", "cylinders_by_count"),
        make=lambda row, family, pressure_scale, cylinder_set, cylinders_by_count: _peaks(
            row, family, pressure_scale, cylinder_set, cylinders_by_count, np.mean
        ),
    ),
    Node(
        "mean_gas", "", "Pa", "mean of pressure times reduced piston velocity", public=False,
        needs=("crank_ratio", "offset_ratio", "row", "family", "pressure_share", "sharing"),
        make=_mean_gas, when="equal_throws",
    ),
    Node(
        "mean_gas", "", "Pa",
        "mean of pressure times piston velocity over the engine's crank radius and speed",
        public=False, when="unequal_throws",
        needs=("crank_ratio", "offset_ratio", "row", "family", "cylinder_set",
               "cylinders_by_count", "sharing"),
        make=_mean_gas_of_throws,
    ),
    Node(
        "stroke_share", "", "1", "mean stroke of the cylinders over the engine's", public=False,
        when="offset",
        needs=("crank_ratio", "offset_ratio", "cylinder_set", "cylinders_by_count"),
        make=_mean_stroke_of_throws,
    ),
    Node(
        "stroke_share", "", "1", "mean stroke of the cylinders over the engine's", public=False,
        when="centred", needs=("cylinder_set", "cylinders_by_count"),
        make=lambda cylinder_set, cylinders_by_count: _by_count(
            cylinder_set, lambda z: np.mean(cylinders_by_count[z].radius_factors)
        ),
    ),
    Node(
        "friction_level", "", "Pa",
        "mean friction torque of a cylinder over piston area and crank radius", public=False,
        needs=("rubbing", "stroke", "stroke_share", "throw", "period"),
        make=lambda rubbing, stroke, stroke_share, throw, period: rubbing * 2.0 * stroke
        * stroke_share / (throw * period),
    ),
    *(
        Node(
            f"{part}_friction", "", "Pa", f"level of the {part} part of the friction", public=False,
            needs=(f"friction_{part}", "friction_level"), make=_product,
        )
        for part in ("boundary", "mixed", "hydrodynamic", "skirt")
    ),
    *(
        Node(
            "torque_solution", "", "", "extremes of the torque at nominal speed, and of its work",
            kind="stage", public=False, gives=("torque_max", "torque_min", "energy_swing"),
            when=load,
            needs=(
                "crank_ratio", "row", "pressure_scale", "crankcase_pressure", "offset_ratio",
                *NO_STROKE_FRICTION, "bore",
                "throw", "reciprocating_mass", "speed", "friction_torque", "cylinder_set",
                "cylinders_by_count", "family", "period", "tolerance", *more,
            ),
            make=_torque_solution,
        )
        for load, more in (("steady_load", ()), ("angle_load", ("driven", *_OF_ANGLE)))
    ),
    Node(
        "inertia_beyond_gear", "", "kg m2", "moment of inertia of the load, at the crank",
        "Kakaitsas eq. 3.1", public=False, when="load_inertia",
        needs=("load_inertia", "gear_ratio"),
        make=lambda load_inertia, gear_ratio: gear_ratio**2 * load_inertia,
    ),
    Node(
        "inertia_beyond_gear", "", "kg m2", "moment of inertia of the load, at the crank",
        "Kakaitsas eq. 3.1", public=False, when="no_load_inertia", make=lambda: 0.0,
    ),
    Node(
        "load_gear", "i", "1", "speed of a load over its own angle or speed over the crank's",
        public=False,
        needs=("gear_ratio",), make=lambda gear_ratio: gear_ratio,
    ),
    Node(
        "load_constant", "", "N m", "load torque that the speed does not change", public=False,
        when="steady_load", needs=("load_offset",), make=lambda load_offset: load_offset,
    ),
    Node(
        "load_constant", "", "N m", "load torque that the speed does not change, its mean",
        public=False, when="angle_load",
        needs=("load_offset", "driven", "load_gear", "load_table_factor"),
        make=lambda load_offset, driven, load_gear, load_table_factor:
        driven_machine.constant_load(
            load_offset, driven.over_angle, load_gear, load_table_factor
        ),
    ),
    Node(
        "load_surplus", "", "N m", "mean torque that load over speed or driver make up for",
        public=False, when="power_mean", needs=("torque_mean", "load_constant"),
        make=lambda torque_mean, load_constant: torque_mean - load_constant,
    ),
    Node(
        "load_surplus", "", "N m", "mean torque that load over speed or driver make up for",
        public=False, when="cycle_time", needs=("torque_mean", "load_constant", "load_factor"),
        make=lambda torque_mean, load_constant, load_factor: load_factor
        * (torque_mean - load_constant),
    ),
    Node(
        "shape_at_nominal", "", "N m", "torque of the driver's table at nominal speed",
        public=False, when="table with_driver", needs=("driven", "speed"),
        make=lambda driven, speed: driven.over_speed(speed),
    ),
    Node(
        "shape_at_nominal", "", "N m", "torque of the load's table at nominal speed, at the crank",
        public=False, when="table no_driver", needs=("driven", "speed", "load_gear"),
        make=lambda driven, speed, load_gear: load_gear * driven.over_speed(load_gear * speed),
    ),
    Node(
        "synchronous_speed", "", "rad s-1", "driving motor: synchronous speed, at the crank",
        public=False, needs=("motor_synchronous_speed", "motor_gear_ratio"),
        make=lambda motor_synchronous_speed, motor_gear_ratio: motor_synchronous_speed
        / motor_gear_ratio,
    ),
    Node(
        "breakdown_torque", "", "N m", "driving motor: largest torque, at the crank",
        public=False, needs=("motor_breakdown_torque", "motor_gear_ratio"),
        make=lambda motor_breakdown_torque, motor_gear_ratio: motor_gear_ratio
        * motor_breakdown_torque,
    ),
    Node(
        "shape_at_nominal", "", "N m", "torque of the driving motor at nominal speed",
        public=False, when="motor", needs=("speed", *_OF_MOTOR),
        make=lambda speed, synchronous_speed, motor_breakdown_slip, breakdown_torque:
        driven_machine.motor_torque(
            speed, synchronous_speed, motor_breakdown_slip, breakdown_torque
        ),
    ),
    _speed_solution_node("power_law steady_load"),
    *(
        _speed_solution_node(
            f"{law} {load}", "load_constant", "driven", *dict.fromkeys((*of_law, *of_angle))
        )
        for law, of_law in (
            ("power_law", ()), ("table", ("load_gear",)),
            ("motor", ("synchronous_speed", "motor_breakdown_slip")),
        )
        for load, of_angle in (
            ("steady_load", ()), ("angle_load", _OF_ANGLE),
        )
        if (law, load) != ("power_law", "steady_load")
    ),
)  # fmt: skip


def _search_for_inertia(solution: Node) -> Node:
    """Stage that finds the inertia for a wanted delta, beside one that solves the speed."""
    needs = [need for need in solution.needs if need not in ("inertia", "crank_angle")]
    return replace(
        solution, name="inertia_search", long_name="inertia for the wanted delta",
        gives=("inertia_required", "search_status"), make=_inertia_search,
        needs=(*needs, "wanted_delta", "energy_swing"), source="this project",
    )  # fmt: skip


_SEARCHES = tuple(_search_for_inertia(n) for n in _STAGES if n.name == "speed_solution")


def _speed_result(name: str, symbol: str, unit: str, long_name: str, source: str,
                  **more: Any) -> Node:  # fmt: skip
    return Node(name, symbol, unit, long_name, source, needs=("speed_solution",), **more)


def _torque_result(name: str, symbol: str, unit: str, long_name: str, source: str) -> Node:
    return Node(name, symbol, unit, long_name, source, needs=("torque_solution",))


_LOAD = (
    Node(
        "load_coefficient", "k", "", "coefficient of the load torque over speed",
        "Kakaitsas eq. 3.5",
        needs=("torque_mean", "load_offset", "speed", "load_exponent"),
        when="power_law steady_load power_mean",
        make=lambda torque_mean, load_offset, speed, load_exponent: (torque_mean - load_offset)
        / _power(speed, load_exponent),
    ),
    Node(
        "load_coefficient", "k", "", "coefficient of the load torque over speed",
        "Kakaitsas eq. 3.5 with the solved speed",
        needs=("torque_mean", "load_offset", "speed", "load_exponent", "load_factor"),
        when="power_law steady_load cycle_time",
        make=lambda torque_mean, load_offset, speed, load_exponent, load_factor: load_factor
        * (torque_mean - load_offset) / _power(speed, load_exponent),
    ),
    Node(
        "load_coefficient", "k", "", "coefficient of the load torque over speed",
        "Kakaitsas eq. 3.5 with the mean of the load over angle",
        needs=("load_surplus", "speed", "load_exponent"), when="power_law angle_load",
        make=lambda load_surplus, speed, load_exponent: load_surplus
        / _power(speed, load_exponent),
    ),
    Node(
        "load_coefficient", "k", "1", "factor on the load's table over speed",
        "Kakaitsas eq. 3.5 with a table", needs=("load_surplus", "shape_at_nominal"),
        when="table no_driver",
        make=lambda load_surplus, shape_at_nominal: _ratio(load_surplus, shape_at_nominal),
    ),
    Node(
        "load_coefficient", "k", "1", "coefficient of the load torque over speed, 0: driven",
        "this project", when="with_driver", make=lambda: 0.0,
    ),
    Node(
        "driver_factor", "f_D", "1", "factor on the driver's torque, 0 without a driver",
        "this project", needs=("load_surplus", "shape_at_nominal"), when="with_driver",
        make=lambda load_surplus, shape_at_nominal: -_ratio(load_surplus, shape_at_nominal),
    ),
    Node(
        "driver_factor", "f_D", "1", "factor on the driver's torque, 0 without a driver",
        "this project", when="no_driver", make=lambda: 0.0,
    ),
    Node(
        "driver_torque", "M_D", "N m", "torque of the driver at the solved speed, 0 without one",
        "this project", kind="curve", when="no_driver", make=lambda: 0.0,
    ),
    Node(
        "driver_torque", "M_D", "N m", "torque of the driver at the solved speed, 0 without one",
        "this project", kind="curve", when="table with_driver",
        needs=("driver_factor", "driven", "omega"),
        make=lambda driver_factor, driven, omega: driver_factor * driven.over_speed(omega),
    ),
    Node(
        "driver_torque", "M_D", "N m", "torque of the driver at the solved speed, 0 without one",
        "Kloss's formula", kind="curve", when="motor",
        needs=("driver_factor", "omega", *_OF_MOTOR),
        make=lambda driver_factor, omega, synchronous_speed, motor_breakdown_slip,
        breakdown_torque: driver_factor * driven_machine.motor_torque(
            omega, synchronous_speed, motor_breakdown_slip, breakdown_torque
        ),
    ),
    Node(
        "load_torque_nominal", "k\\omega_n^\\alpha", "N m",
        "load torque at nominal speed without its offset", "Kakaitsas eq. 3.4",
        needs=("load_coefficient", "speed", "load_exponent"), when="power_law",
        make=lambda load_coefficient, speed, load_exponent: load_coefficient
        * _power(speed, load_exponent),
    ),
    Node(
        "load_torque_nominal", "k T(\\omega_n)", "N m",
        "load torque at nominal speed without its offset", "Kakaitsas eq. 3.4 with a table",
        needs=("load_coefficient", "shape_at_nominal"), when="table no_driver",
        make=lambda load_coefficient, shape_at_nominal: load_coefficient * shape_at_nominal,
    ),
    Node(
        "load_torque_nominal", "k\\omega_n^\\alpha", "N m",
        "load torque at nominal speed without its offset, 0: driven", "this project",
        when="with_driver", make=lambda: 0.0,
    ),
    Node(
        "load_torque", "M_L", "N m", "load torque at the solved speed", "Kakaitsas eq. 3.4",
        kind="curve", needs=("load_offset", "load_coefficient", "omega", "load_exponent"),
        when="power_law steady_load",
        make=lambda load_offset, load_coefficient, omega, load_exponent: load_offset
        + load_coefficient * _power(omega, load_exponent),
    ),
    Node(
        "load_torque", "M_L", "N m", "load torque at the solved speed", "Kakaitsas eq. 3.4",
        kind="curve", needs=("load_over_angle", "load_coefficient", "omega", "load_exponent"),
        when="power_law angle_load",
        make=lambda load_over_angle, load_coefficient, omega, load_exponent: load_over_angle
        + load_coefficient * _power(omega, load_exponent),
    ),
    Node(
        "load_torque", "M_L", "N m", "load torque at the solved speed",
        "Kakaitsas eq. 3.4 with a table", kind="curve", when="table no_driver",
        needs=("load_over_angle", "load_coefficient", "omega", "driven", "load_gear"),
        make=lambda load_over_angle, load_coefficient, omega, driven, load_gear: load_over_angle
        + load_coefficient * load_gear * driven.over_speed(load_gear * omega),
    ),
    Node(
        "load_torque", "M_L", "N m", "load torque, which the speed does not change", "this project",
        kind="curve", when="with_driver", needs=("load_over_angle",),
        make=lambda load_over_angle: load_over_angle,
    ),
    Node(
        "load_over_angle", "", "N m", "load torque that the speed does not change", kind="curve",
        public=False, when="steady_load", needs=("load_offset",),
        make=lambda load_offset: load_offset,
    ),
    Node(
        "load_over_angle", "", "N m", "load torque that the speed does not change", kind="curve",
        public=False, when="angle_load",
        needs=("load_offset", "driven", "crank_angle", "load_gear", "load_phase",
               "load_table_factor"),
        make=lambda load_offset, driven, crank_angle, load_gear, load_phase, load_table_factor:
        load_offset + driven_machine.load_over_angle(
            crank_angle, driven.over_angle, load_gear, load_phase, load_table_factor
        ),
    ),
)  # fmt: skip

_QUANTITIES: tuple[Node, ...] = (
    _speed_result(
        "delta", r"\delta", "1", "coefficient of speed fluctuation", "Kakaitsas eq. 3.6"
    ),
    _speed_result(
        "delta_midrange", r"\delta_{mid}", "1",
        "coefficient of speed fluctuation over the mid-range speed", "Kakaitsas eq. 3.7, Asgari 19",
    ),
    _speed_result(
        "delta_error", r"\Delta\delta/\delta", "1",
        "estimated relative error of the coefficient of speed fluctuation",
        "against a solution with more nodes, or that of omega_min where it is more; thesis and "
        "picard: against the periodic solution",
    ),
    _speed_result(
        "omega", r"\omega", "rad s-1", "crank speed over the cycle", "Kakaitsas eq. 3.1",
        adds=("crank_angle",), kind="curve",
    ),
    _speed_result("omega_max", r"\omega_{max}", "rad s-1", "largest crank speed",
                  "Kakaitsas eq. 3.6"),
    _speed_result("omega_min", r"\omega_{min}", "rad s-1", "smallest crank speed",
                  "Kakaitsas eq. 3.6"),
    _speed_result("omega_mean", r"\omega_m", "rad s-1", "mean crank speed over crank angle",
                  "Kakaitsas eq. 3.6"),
    _speed_result(
        "angular_acceleration", r"\epsilon", "rad s-2", "angular acceleration of the crank",
        "Kakaitsas eq. 4.1", adds=("crank_angle",), kind="curve",
    ),
    _speed_result(
        "iterations", "i", "1", "cycles marched, or sweeps of the iteration", "this project"
    ),
    _speed_result(
        "status", "", "1", "outcome of the design", "this project", when="given_inertia"
    ),
    _speed_result(
        "outcome", "", "1", "outcome of the periodic speed", "this project", public=False
    ),
    Node(
        "status", "", "1", "outcome of the design", "this project", when="wanted_delta",
        needs=("outcome", "search_status"), make=flywheels.both_statuses,
    ),
    _speed_result(
        "load_factor", "", "1", "load coefficient over its value at nominal speed",
        "closure cycle_time",
    ),
    _torque_result("torque_max", "M_{max}", "N m", "largest torque at nominal speed",
                   "Kakaitsas section 5.4"),
    _torque_result("torque_min", "M_{min}", "N m", "smallest torque at nominal speed",
                   "Kakaitsas section 5.4"),
    _torque_result(
        "energy_swing", "W", "J",
        "range of the work of the torque, less a load over angle and the mean", "Asgari method 2",
    ),
    Node(
        "torque_mean", "M_{mean}", "N m", "mean torque over the cycle", "Kakaitsas eq. 3.5",
        needs=("mean_gas", "pressure_scale", "bore", "throw", "cylinders", "friction_torque"),
        make=lambda mean_gas, pressure_scale, bore, throw, cylinders, friction_torque: _balance(
            cylinders * torque.piston_area(bore) * 0.5 * throw * pressure_scale * mean_gas,
            friction_torque,
        ),
    ),
    Node(
        "torque_range", "M_{max}-M_{min}", "N m", "range of the torque at nominal speed",
        "Kakaitsas section 5.4", needs=("torque_max", "torque_min"),
        make=lambda torque_max, torque_min: torque_max - torque_min,
    ),
    Node(
        "torque_ratio", "M_{max}/M_{mean}", "1", "largest over mean torque",
        "Kakaitsas section 5.4", needs=("torque_max", "torque_mean"),
        make=lambda torque_max, torque_mean: _ratio(torque_max, torque_mean),
    ),
    Node(
        "torque_irregularity", r"\mu", "1", "coefficient of torque irregularity",
        "Power units, lecture 18", needs=("torque_range", "torque_mean"),
        make=lambda torque_range, torque_mean: _ratio(torque_range, torque_mean),
    ),
    Node(
        "friction_torque", "M_{fr}", "N m", "mean friction torque, positive, subtracted",
        "Kakaitsas eq. 3.8", needs=("fmep", "displacement", "period"),
        make=lambda fmep, displacement, period: friction.friction_torque(
            fmep, displacement, period
        ),
    ),
    Node(
        "fmep", "p_{fr}", "bar", "friction mean effective pressure", "Kakaitsas eq. 3.9", si=BAR,
        when="bare", needs=("rubbing",), make=lambda rubbing: rubbing,
    ),
    Node(
        "fmep", "p_{fr}", "bar", "friction mean effective pressure, with the auxiliaries",
        "Kakaitsas eq. 3.9", si=BAR, when="auxiliaries",
        needs=("rubbing", "auxiliary_torque", "displacement", "period"),
        make=lambda rubbing, auxiliary_torque, displacement, period: rubbing
        + auxiliary_torque * period / displacement,
    ),
    Node(
        "imep", "p_i", "bar", "indicated mean effective pressure", "Rakopoulos notes", si=BAR,
        when="centred", needs=("mean_gas", "pressure_scale", "period", "stroke_share"),
        make=lambda mean_gas, pressure_scale, period, stroke_share: 0.5 * period * pressure_scale
        * mean_gas / stroke_share,
    ),
    Node(
        "imep", "p_i", "bar", "indicated mean effective pressure", "Rakopoulos notes", si=BAR,
        when="offset",
        needs=("mean_gas", "pressure_scale", "period", "throw", "stroke", "stroke_share"),
        make=lambda mean_gas, pressure_scale, period, throw, stroke, stroke_share: 0.5 * throw
        / (stroke * stroke_share) * period * pressure_scale * mean_gas,
    ),
    Node(
        "bmep", "p_e", "bar", "brake mean effective pressure", "Kakaitsas section 3.2.3", si=BAR,
        needs=("imep", "fmep"), make=lambda imep, fmep: _balance(imep, fmep),
    ),
    Node(
        "mechanical_efficiency", r"\eta_m", "1", "brake over indicated mean effective pressure",
        "Kakaitsas section 3.2.3", needs=("bmep", "imep"),
        make=lambda bmep, imep: _ratio(bmep, imep),
    ),
    Node(
        "brake_power", "P_e", "W", "brake power at nominal speed", "Kakaitsas section 3.2",
        needs=("torque_mean", "speed"), make=lambda torque_mean, speed: torque_mean * speed,
    ),
    Node(
        "mean_piston_speed", "c_m", "m s-1", "mean piston speed, of unequal throws their mean",
        "Kakaitsas eq. 3.9", needs=("stroke", "stroke_share", "speed"),
        make=lambda stroke, stroke_share, speed: friction.mean_piston_speed(
            stroke * stroke_share, speed
        ),
    ),
    Node(
        "peak_pressure", "p_{max}", "bar", "largest tabulated absolute cylinder pressure",
        "Kakaitsas eq. 3.9", si=BAR, when="equal", needs=("row", "family", "pressure_scale"),
        make=lambda row, family, pressure_scale: family.peak_between(row) * pressure_scale,
    ),
    Node(
        "peak_pressure", "p_{max}", "bar", "largest tabulated absolute cylinder pressure",
        "Kakaitsas eq. 3.9", si=BAR, when="unequal",
        needs=("row", "family", "pressure_scale", "cylinder_set", "cylinders_by_count"),
        make=lambda row, family, pressure_scale, cylinder_set, cylinders_by_count: _peaks(
            row, family, pressure_scale, cylinder_set, cylinders_by_count, np.max
        ),
    ),
    Node(
        "displacement", "V_h", "m3", "displacement of all cylinders", "Kakaitsas eq. 3.8",
        needs=("bore", "stroke", "cylinders", "stroke_share"),
        make=lambda bore, stroke, cylinders, stroke_share: cylinders * torque.piston_area(bore)
        * stroke * stroke_share,
    ),
    Node(
        "rotating_mass", "m_r", "kg", "rotating mass per cylinder at the crank radius",
        "Kakaitsas eq. 2.11",
        needs=("crank_mass", "rod_mass", "rod_centre_of_gravity", "rod"),
        make=lambda crank_mass, rod_mass, rod_centre_of_gravity, rod: masses.rotating_mass(
            crank_mass, rod_mass, rod_centre_of_gravity, rod
        ),
    ),
    Node(
        "engine_inertia", r"\Theta_{eng}", "kg m2",
        "cycle mean of the running gear's moment of inertia", "Kakaitsas eq. 3.2",
        when="equal_throws",
        needs=("reciprocating_mass", "rotating_mass", "throw", "crank_ratio", "cylinders",
               "offset_ratio", "mass_share"),
        make=lambda reciprocating_mass, rotating_mass, throw, crank_ratio, cylinders,
        offset_ratio, mass_share: masses.engine_inertia(
            mass_share * reciprocating_mass, rotating_mass, 0.5 * throw, crank_ratio, cylinders,
            offset_ratio,
        ),
    ),
    Node(
        "engine_inertia", r"\Theta_{eng}", "kg m2",
        "cycle mean of the running gear's moment of inertia", "Kakaitsas eq. 3.2",
        when="unequal_throws",
        needs=("reciprocating_mass", "rotating_mass", "throw", "crank_ratio", "offset_ratio",
               "cylinders", "cylinder_set", "cylinders_by_count"),
        make=lambda reciprocating_mass, rotating_mass, throw, crank_ratio, offset_ratio, cylinders,
        cylinder_set, cylinders_by_count: cylinders * (0.5 * throw) ** 2 * (
            reciprocating_mass
            * _mean_square_of_throws(crank_ratio, offset_ratio, cylinder_set, cylinders_by_count)
            + rotating_mass * _by_count(
                cylinder_set, lambda z: np.mean(np.square(cylinders_by_count[z].radius_factors))
            )
        ),
    ),
    *_LOAD,
    Node(
        "position", "x/r", "1", "piston travel from top dead centre over crank radius",
        "Kakaitsas eq. 1.4", kind="curve", needs=("crank_angle", "crank_ratio", "offset_ratio"),
        make=lambda crank_angle, crank_ratio, offset_ratio: slider_crank.position(
            crank_angle, crank_ratio, offset_ratio
        ),
    ),
    Node(
        "velocity", r"c/(r\omega)", "1", "reduced piston velocity", "Kakaitsas eq. 1.6",
        kind="curve", needs=("crank_angle", "crank_ratio", "offset_ratio"),
        make=lambda crank_angle, crank_ratio, offset_ratio: slider_crank.velocity(
            crank_angle, crank_ratio, offset_ratio
        ),
    ),
    Node(
        "acceleration", r"b/(r\omega^2)", "1", "reduced piston acceleration", "Kakaitsas eq. 1.8",
        kind="curve", needs=("crank_angle", "crank_ratio", "offset_ratio"),
        make=lambda crank_angle, crank_ratio, offset_ratio: slider_crank.acceleration(
            crank_angle, crank_ratio, offset_ratio
        ),
    ),
    Node(
        "pressure", "p", "bar", "absolute pressure in cylinder 1", "Kakaitsas section 2.1", si=BAR,
        kind="curve", when="equal", needs=("crank_angle", "family", "row", "pressure_scale"),
        make=lambda crank_angle, family, row, pressure_scale: torque.pressure(
            crank_angle, family, row, pressure_scale
        ),
    ),
    Node(
        "pressure", "p", "bar", "absolute pressure in cylinder 1", "Kakaitsas section 2.1", si=BAR,
        kind="curve", when="unequal",
        needs=("crank_angle", "family", "row", "pressure_scale", "cylinder_set",
               "cylinders_by_count"),
        make=lambda crank_angle, family, row, pressure_scale, cylinder_set, cylinders_by_count:
        torque.pressure_of_first(
            crank_angle, family, row, pressure_scale, cylinder_set, cylinders_by_count
        ),
    ),
    Node(
        "gas_torque", "M_g", "N m", "torque of the gas, all cylinders", "Kakaitsas eq. 2.6",
        kind="curve",
        needs=("crank_angle", "crank_ratio", "family", "row", "pressure_scale",
               "crankcase_pressure", "bore", "throw", "cylinder_set", "period", "offset_ratio",
               "cylinders_by_count"),
        make=lambda crank_angle, crank_ratio, family, row, pressure_scale, crankcase_pressure,
        bore, throw, cylinder_set, period, offset_ratio, cylinders_by_count: torque.gas_torque(
            crank_angle, crank_ratio, family, row, pressure_scale, crankcase_pressure, bore,
            throw, cylinder_set, period, offset_ratio, cylinders_by_count,
        ),
    ),
    Node(
        "inertia_torque", "M_l", "N m",
        "torque of the reciprocating masses at nominal speed, all cylinders",
        "Kakaitsas eqs. 2.12, 2.13", kind="curve",
        needs=("crank_angle", "crank_ratio", "reciprocating_mass", "throw", "speed", "cylinder_set",
               "period", "offset_ratio", "cylinders_by_count"),
        make=lambda crank_angle, crank_ratio, reciprocating_mass, throw, speed, cylinder_set,
        period, offset_ratio, cylinders_by_count: torque.inertia_torque(
            crank_angle, crank_ratio, reciprocating_mass, throw, speed, cylinder_set, period,
            offset_ratio, cylinders_by_count,
        ),
    ),
    Node(
        "inertia_torque_actual", "M_{l,act}", "N m",
        "torque of the reciprocating masses at the solved speed, all cylinders",
        "Eksergian's equation", kind="curve",
        needs=("crank_angle", "crank_ratio", "reciprocating_mass", "throw", "omega",
               "angular_acceleration", "cylinder_set", "period", "offset_ratio",
               "cylinders_by_count"),
        make=lambda crank_angle, crank_ratio, reciprocating_mass, throw, omega,
        angular_acceleration, cylinder_set, period, offset_ratio, cylinders_by_count:
        torque.inertia_torque_actual(
            crank_angle, crank_ratio, reciprocating_mass, throw, omega, angular_acceleration,
            cylinder_set, period, offset_ratio, cylinders_by_count,
        ),
    ),
    Node(
        "instantaneous_friction_torque", "M_{fr}(\\varphi)", "N m",
        "friction torque over crank angle, positive, subtracted", "Kakaitsas eq. 3.8",
        kind="curve", when="uniform_friction", needs=("friction_torque", "crank_angle"),
        make=lambda friction_torque, crank_angle: friction_torque + 0.0 * crank_angle,
    ),
    Node(
        "instantaneous_friction_torque", "M_{fr}(\\varphi)", "N m",
        "friction torque over crank angle, positive, subtracted",
        "after Rezeka and Henein, SAE 840179",
        kind="curve", when="stroke_friction",
        needs=("crank_angle", "crank_ratio", "family", "row", "pressure_scale",
               "crankcase_pressure", "bore", "throw", "friction_torque", "cylinder_set", "period",
               "offset_ratio", "cylinders_by_count", *NO_STROKE_FRICTION),
        make=_friction_over_stroke,
    ),
    Node(
        "torque", "M", "N m", "torque of the engine at nominal speed", "Kakaitsas eq. 3.3",
        kind="curve", when="uniform_friction",
        needs=("gas_torque", "inertia_torque", "friction_torque"),
        make=lambda gas_torque, inertia_torque, friction_torque: gas_torque + inertia_torque
        - friction_torque,
    ),
    Node(
        "torque", "M", "N m", "torque of the engine at nominal speed", "Kakaitsas eq. 3.3",
        kind="curve", when="stroke_friction",
        needs=("gas_torque", "inertia_torque", "instantaneous_friction_torque"),
        make=lambda gas_torque, inertia_torque, instantaneous_friction_torque: gas_torque
        + inertia_torque - instantaneous_friction_torque,
    ),
    Node(
        "torque_after_throw", "T_i", "N m",
        "torque in the shaft after each throw, from the last cylinder to the take-off at the first",
        "Kakaitsas section 5.4", kind="curve", adds=("cylinder",), throws=True,
        needs=("crank_angle", "crank_ratio", "family", "row", "pressure_scale",
               "crankcase_pressure", "bore", "throw", "reciprocating_mass", "speed",
               "friction_torque", "cylinder_set", "cylinders_by_count", "offset_ratio",
               *NO_STROKE_FRICTION),
        make=_torque_after_throw,
    ),
    *balance.NODES,
    *flywheels.NODES,
    *characteristics.NODES,
    *series.NODES,
    *mechanism_forces.NODES,
    *orders.NODES,
    *bearing_loads.NODES,
)  # fmt: skip

_DIMENSIONS = (
    Dimension("cylinder", "", "1", "cylinder along the shaft", whole=True),
    Dimension(
        "main_bearing", "j", "1", "main journal along the shaft, the first before throw 1",
        whole=True,
    ),
    Dimension("order", r"\nu", "1", "order, periods a revolution of the crank"),
    Dimension(
        "direction", r"\vartheta", "degree",
        "direction across the shaft, 0 along cylinder 1, in the sense of rotation", si=DEGREE,
    ),
    Dimension(
        "crank_angle", r"\varphi", "degree",
        "crank angle, 0 at firing top dead centre of cylinder 1", si=DEGREE,
    ),
)  # fmt: skip

DIMENSIONS: Mapping[str, Dimension] = MappingProxyType({d.name: d for d in _DIMENSIONS})
"""Dimensions beside the axes of a scene, in the order of archives."""

ALONG_SHAFT = frozenset({"cylinder", "main_bearing"})
"""Dimensions of what needs to know the throws of an engine."""

_POINTS = tuple(
    Node(d.name, d.symbol, d.unit, d.long_name, si=d.si, kind="parameter", public=False)
    for d in _DIMENSIONS
)
"""Leaves that hold the points of the dimensions."""

NODES: Mapping[str, tuple[Node, ...]]
"""Every node by name; a name with variants has one node for each."""

_by_name: dict[str, tuple[Node, ...]] = {}
for _node in (*_PARAMETERS, *_POINTS, *_CONSTANTS, *_STAGES, *_SEARCHES, *_QUANTITIES):
    _by_name[_node.name] = (*_by_name.get(_node.name, ()), _node)
NODES = MappingProxyType(_by_name)

PARAMETERS: Mapping[str, Node] = MappingProxyType({n.name: n for n in _PARAMETERS})
"""What a scene may set or vary."""

QUANTITIES: Mapping[str, Node] = MappingProxyType(
    {n.name: n for n in reversed(_QUANTITIES) if n.public}
)
"""What a scene may ask for."""
QUANTITIES = MappingProxyType(dict(sorted(QUANTITIES.items())))

CONSTANTS: tuple[str, ...] = tuple(n.name for n in _CONSTANTS)


def select(name: str, *words: str) -> Node:
    """Return the variant of a node that holds for the words of a scene: see `Node.when`."""
    for node in NODES[name]:
        if all(word in words for word in node.when.split()):
            return node
    raise KeyError(name)


def load_coefficient_unit(exponent: float) -> str | None:
    """Unit of k where the exponent is a whole number, None otherwise (UDUNITS reads no other)."""
    if exponent == 0.0:
        return "N m"
    if exponent == math.floor(exponent):
        return "N m s" if exponent == 1.0 else f"N m s{int(exponent)}"
    return None


def check_graph() -> None:
    """Raise ValueError if a need does not exist, a cycle does, or a function's arguments differ."""
    import inspect

    for variants in NODES.values():
        for node in variants:
            for need in node.needs:
                if need not in NODES:
                    raise ValueError(f"{node.name} needs {need}, which is not a node")
            if "cylinders_by_count" in node.needs and "cylinder_set" not in node.needs:
                raise ValueError(f"{node.name}: keys of cylinders_by_count are cylinder_set")
            if node.make is None:
                continue
            arguments = inspect.signature(node.make).parameters.values()
            named = {
                a.name for a in arguments if a.kind in (a.POSITIONAL_OR_KEYWORD, a.KEYWORD_ONLY)
            }
            takes_all = any(a.kind is a.VAR_KEYWORD for a in arguments)
            if not (named <= set(node.needs) if takes_all else named == set(node.needs)):
                raise ValueError(f"{node.name} takes {sorted(named)}, needs {sorted(node.needs)}")
    done: set[str] = set()

    def visit(name: str, path: tuple[str, ...]) -> None:
        if name in path:
            raise ValueError("cycle: " + " -> ".join((*path, name)))
        if name not in done:
            for node in NODES[name]:
                for need in node.needs:
                    visit(need, (*path, name))
            done.add(name)

    for name in NODES:
        visit(name, ())
