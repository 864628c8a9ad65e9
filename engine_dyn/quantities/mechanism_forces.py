"""Nodes of the forces and torques of the mechanism, and of the rod loads at the crosshead pin.

See `engine_dyn.forces.mechanism`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.forces import mechanism, torque
from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.cylinder_means import value_of_sets
from engine_dyn.quantities.node import Node, formula, hidden, parameter
from engine_dyn.units import BAR, DEGREE

NOTES = "Rakopoulos notes"
KHURMI = "Khurmi and Gupta chapter 15"

PARAMETERS = (
    parameter(
        "engine_inclination", r"\gamma", "degree",
        "angle by which the engine is turned in the sense of rotation from where its outermost "
        "banks stand equally far from upright: 0 upright, 90 or -90 horizontal",
        "this project", si=DEGREE, low=-360.0, high=360.0, low_included=True, high_included=True,
        unless_given=0.0,
    ),
    parameter(
        "piston_friction", "F_f", "N",
        "friction force against the motion of each piston, constant, in net forces and net torque "
        "alone",
        KHURMI, low=0.0, low_included=True, unless_given=0.0,
    ),
    parameter(
        "piston_travel", "x_g", "m", "travel of the piston from top dead centre whose crank angle "
        "is asked for", KHURMI, low=0.0, low_included=True,
    ),
)  # fmt: skip

_ANGLE = ("crank_angle", "crank_ratio", "offset_ratio")


def _force(name: str, symbol: str, long_name: str, source: str, needs: tuple[str, ...], make: Any,
           **more: Any) -> Node:  # fmt: skip
    """Node of a force of cylinder 1 over the crank angle."""
    return Node(name, symbol, "N", f"{long_name}, cylinder 1", source, needs=needs, make=make,
                kind="curve", **more)  # fmt: skip


class _Part(NamedTuple):
    """A force on the piston with its components: of gas, of masses, or the sum of both."""

    # Prefix of the components' names, and letter of their symbols.
    prefix: str
    letter: str
    force: str  # Node of the force on the piston
    whose: str  # Words that follow a component's name; none for the sum


_PARTS = (
    _Part("", "", "piston_force", ""),
    _Part("gas_", "g", "gas_force", " of the gas"),
    _Part("inertia_", "l", "inertia_force", " of the reciprocating masses"),
)


class _Component(NamedTuple):
    """A component of the force on the piston: its ratio to the force, and its names."""

    # Name and symbol of the component, for the whole force.
    name: str
    symbol: str
    # Meaning for the whole force; for a part, the words before and after the part's name.
    long_name: str
    short: str
    behind: str
    sources: tuple[str, str, str]  # Equations for the sum, the gas and the masses
    needs: tuple[str, ...]  # Nodes that the ratio takes
    ratio: Callable[..., Any]  # Ratio of the component to the force on the piston


_FORCES = (
    _Component(
        "wall_thrust", "N",
        "wall thrust, side force of the piston on the cylinder wall, positive opposite to the "
        "side where the crank pin moves down",
        "wall thrust", ", positive opposite to the side where the crank pin moves down",
        ("Kakaitsas eq. 2.17", "Kakaitsas eq. 2.2", "Kakaitsas eqs. 2.12, 2.17"), _ANGLE,
        mechanism.thrust_ratio,
    ),
    _Component(
        "rod_force", "S", "rod force, compression positive", "rod force",
        ", compression positive",
        ("Kakaitsas eq. 2.18", "Kakaitsas eq. 2.3", "Kakaitsas eqs. 2.12, 2.18"), _ANGLE,
        mechanism.rod_ratio,
    ),
    _Component(
        "tangential_force", "T",
        "tangential force of the rod on the crank pin, positive in the sense of rotation",
        "tangential force", "",
        ("Kakaitsas eq. 2.19", "Kakaitsas eq. 2.4", "Kakaitsas eq. 2.13"), ("velocity",),
        lambda velocity: velocity,
    ),
    _Component(
        "radial_force", "R",
        "radial force of the rod on the crank pin, positive towards the crank axis",
        "radial force", ", positive towards the crank axis",
        ("Kakaitsas eq. 2.5", "Kakaitsas eq. 2.5", "Kakaitsas eqs. 2.5, 2.12"), _ANGLE,
        mechanism.radial_ratio,
    ),
)  # fmt: skip
"""Components N, S, T and R; each has one formula for the gas, the masses and their sum."""


def _component(component: _Component, part: _Part, source: str) -> Node:
    def make(**needs: Any) -> Any:
        return needs[part.force] * component.ratio(*(needs[name] for name in component.needs))

    symbol = f"{component.symbol}_{part.letter}" if part.letter else component.symbol
    # With articulated rods, nodes of the same names in `each_cylinder` hold.
    plain = part.prefix + component.name == "wall_thrust"
    of_part = f"{component.short}{part.whose}{component.behind}"
    return _force(
        part.prefix + component.name, symbol, of_part if part.prefix else component.long_name,
        source, (part.force, *component.needs), make, when="plain_rods" if plain else "",
    )  # fmt: skip


def _angle_at_travel(
    *, piston_travel: Any, crank_ratio: Any, offset_ratio: Any, double_radius: Any, stroke: Any
) -> Any:
    # For a travel equal to the stroke, rounding may make the quotient exceed its largest value.
    most = 2.0 * np.asarray(slider_crank.dead_centres(crank_ratio, offset_ratio).stroke)
    travel = np.minimum(2.0 * piston_travel / double_radius, most)
    angle = slider_crank.angle_of_travel(travel, True, crank_ratio, offset_ratio)
    return np.where(piston_travel <= stroke, angle, np.nan)


def _over_area(name: str, symbol: str, of: str, long_name: str) -> Node:
    return Node(
        name, symbol, "bar", f"{long_name} over piston area, cylinder 1",
        f"{NOTES}, reduced pressures", si=BAR, kind="curve", needs=(of, "bore"),
        make=lambda bore, **force: force[of] / torque.piston_area(bore),
    )  # fmt: skip


API = "API 618"


def _crosshead_inertia(
    piston_mass: Any, double_radius: Any, speed: Any, acceleration: Any, cylinder_set: Any,
    cylinders_by_count: Any,
) -> Any:  # fmt: skip
    factor = mechanism.of_cylinder(lambda m: m.mass_factor, cylinder_set, cylinders_by_count)
    return -factor * piston_mass * 0.5 * double_radius * speed**2 * acceleration


def _rod_load(
    name: str, symbol: str, of: str, long_name: str, extreme_of: tuple[str, str] | None,
    unit: str = "N", si: float = 1.0,
) -> Node:  # fmt: skip
    return Node(
        name, symbol, unit, f"{long_name}, the worst of all cylinders", API, si=si,
        extreme_of=extreme_of, make=lambda rod_load_extremes: rod_load_extremes[of],
    )  # fmt: skip


NODES: tuple[Node, ...] = (
    hidden(
        "mass_of_first", "kg", "reciprocating mass of cylinder 1",
        lambda reciprocating_mass: reciprocating_mass, when="equal",
    ),
    hidden(
        "mass_of_first", "kg", "reciprocating mass of cylinder 1",
        lambda reciprocating_mass, cylinder_set, cylinders_by_count: reciprocating_mass
        * mechanism.of_cylinder(lambda m: m.mass_factor, cylinder_set, cylinders_by_count),
        when="unequal",
    ),
    Node(
        "rod_angle", r"\beta", "degree",
        "angle between rod and cylinder axis, positive with the big end on the side where the "
        "crank pin moves down",
        "Kakaitsas eq. 1.3", si=DEGREE, kind="curve",
        **formula(slider_crank.rod_angle, "crank_angle", "crank_ratio", "offset_ratio"),
    ),
    Node(
        "rod_angular_velocity", r"\dot\beta", "rad s-1",
        "angular velocity of the rod at nominal speed, positive while the rod angle grows", KHURMI,
        kind="curve", make=lambda crank_angle, crank_ratio, offset_ratio, speed: speed
        * mechanism.rod_speed(crank_angle, crank_ratio, offset_ratio),
    ),
    Node(
        "rod_angular_acceleration", r"\ddot\beta", "rad s-2",
        "angular acceleration of the rod at nominal speed, positive in the sense of increasing rod "
        "angle",
        KHURMI, kind="curve", make=lambda crank_angle, crank_ratio, offset_ratio, speed: speed**2
        * mechanism.rod_acceleration(crank_angle, crank_ratio, offset_ratio),
    ),
    Node(
        "crank_angle_at_travel", r"\varphi_x", "degree",
        "crank angle at which the piston on its way down has the given travel, within the stroke",
        KHURMI, si=DEGREE, make=_angle_at_travel,
    ),
    hidden(
        "direction_of_first", "rad", "direction of cylinder 1",
        lambda engine_inclination, cylinder_set, cylinders_by_count: engine_inclination
        + value_of_sets(
            cylinder_set, cylinders_by_count, lambda engine: mechanism.banks_of(engine)[0]
        ),
    ),
    Node(
        "cylinder_direction", r"\gamma_1", "degree",
        "angle of cylinder 1 from the upward vertical, positive in the sense of rotation",
        "this project", si=DEGREE, make=lambda direction_of_first: 1.0 * direction_of_first,
    ),
    _force(
        "gas_force", "P_g", "gas force on the piston, positive towards the crank",
        "Kakaitsas eq. 2.1", ("pressure", "crankcase_pressure", "bore"),
        lambda pressure, crankcase_pressure, bore: (pressure - crankcase_pressure)
        * torque.piston_area(bore),
        when="single_acting",
    ),
    _force(
        "inertia_force", "P_l",
        "inertia force of the reciprocating masses, positive towards the crank",
        "Kakaitsas eq. 2.12", ("mass_of_first", "double_radius", "speed", "acceleration"),
        lambda mass_of_first, double_radius, speed, acceleration: -mass_of_first
        * 0.5 * double_radius * speed**2 * acceleration,
    ),
    _force(
        "piston_force", "P", "gas and inertia force on the piston, positive towards the crank",
        "Kakaitsas eq. 2.16", ("gas_force", "inertia_force"),
        lambda gas_force, inertia_force: gas_force + inertia_force,
    ),
    Node(
        "weight_force", "P_w", "N",
        "weight of the reciprocating masses along the cylinder, positive towards the crank, "
        "cylinder 1",
        KHURMI, make=lambda mass_of_first, direction_of_first: mechanism.GRAVITY * mass_of_first
        * np.cos(direction_of_first),
    ),
    _force(
        "net_piston_force", "P_n",
        "gas and inertia force on the piston with weight and piston friction, positive towards "
        "the crank",
        KHURMI, ("piston_force", "weight_force", "piston_friction", "velocity"),
        lambda piston_force, weight_force, piston_friction, velocity: piston_force + weight_force
        - piston_friction * mechanism.sense_of_motion(velocity),
    ),
    *(
        _component(component, part, source)
        for component in _FORCES
        for part, source in zip(_PARTS, component.sources, strict=True)
    ),
    _force(
        "net_wall_thrust", "N_n",
        "wall thrust with weight and piston friction, positive opposite to the side where the "
        "crank pin moves down",
        KHURMI, ("net_piston_force", "mass_of_first", "direction_of_first", *_ANGLE),
        # In a cylinder that leans, the weight also acts on the wall.
        lambda net_piston_force, mass_of_first, direction_of_first, crank_angle, crank_ratio,
        offset_ratio: net_piston_force
        * mechanism.thrust_ratio(crank_angle, crank_ratio, offset_ratio)
        - mechanism.GRAVITY * mass_of_first * np.sin(direction_of_first),
    ),
    *(_component(
        one, _Part("net_", "n", "net_piston_force", " with weight and piston friction"), KHURMI
    ) for one in _FORCES if one.name != "wall_thrust"),
    *(
        Node(
            f"{part}overturning_moment", symbol, "N m",
            f"overturning moment{whose} on the frame, positive in the sense of rotation, all "
            "cylinders", f"{source} (M_a = -N H)", kind="curve", make=make,
        )
        for part, symbol, whose, source, make in (
            ("", r"M_\alpha", "", "Kakaitsas eq. 2.8",
             lambda gas_torque, inertia_torque: -(gas_torque + inertia_torque)),
            ("gas_", r"M_{\alpha g}", " of the gas", "Kakaitsas eq. 2.8",
             lambda gas_torque: -gas_torque),
            ("inertia_", r"M_{\alpha l}", " of the reciprocating masses",
             "Kakaitsas eqs. 2.8, 2.13", lambda inertia_torque: -inertia_torque),
        )
    ),
    Node(
        "rotating_force", "P_r", "N",
        "centrifugal force of the rotating mass of one cylinder, without counterweights",
        "Kakaitsas eq. 2.14", make=lambda rotating_mass, double_radius, speed: rotating_mass
        * 0.5 * double_radius * speed**2,
    ),
    Node(
        "gravity_torque", "M_G", "N m",
        "gravity torque of the running gear, positive in the sense of rotation, including the "
        "given counterweights, all cylinders",
        f"{NOTES}, T_G", kind="curve",
        make=lambda crank_angle, crank_ratio, reciprocating_mass, journal_rod_mass,
        journal_throw_mass, double_radius, cylinder_set, cylinders_by_count, offset_ratio,
        engine_inclination, web_unbalance: mechanism.gravity_torque(
            crank_angle, crank_ratio, reciprocating_mass, journal_rod_mass, 0.5 * double_radius,
            cylinder_set, cylinders_by_count, offset_ratio, journal_throw_mass, engine_inclination,
            web_unbalance,
        ),
    ),
    Node(
        "piston_friction_torque", "M_{Ff}", "N m",
        "torque of the given friction force at the pistons, positive against the rotation, all "
        "cylinders",
        KHURMI, kind="curve",
        make=lambda crank_angle, crank_ratio, offset_ratio, piston_friction, double_radius,
        cylinder_set, cylinders_by_count: mechanism.piston_friction_torque(
            crank_angle, crank_ratio, piston_friction, 0.5 * double_radius, cylinder_set,
            cylinders_by_count, offset_ratio,
        ),
    ),
    Node(
        "net_torque", "M_n", "N m",
        "engine torque with the weights of the running gear and less the given friction at the "
        "pistons, positive in the sense of rotation",
        KHURMI, kind="curve",
        make=lambda torque, gravity_torque, piston_friction_torque: torque + gravity_torque
        - piston_friction_torque,
    ),
    _over_area("piston_pressure", "p", "piston_force", "gas and inertia force"),
    _over_area("gas_piston_pressure", "p_g", "gas_force", "gas force"),
    _over_area("inertia_piston_pressure", "p_l", "inertia_force",
               "force of the reciprocating masses"),
    *(
        _over_area(
            f"{part.prefix}{one.name.split('_')[0]}_pressure", f"p_{{{one.symbol}{part.letter}}}",
            part.prefix + one.name, one.short + part.whose,
        )
        for one in _FORCES
        for part in _PARTS
    ),
    *(
        Node(
            f"{part.prefix}reduced_torque",
            rf"\mu_{{\sigma {part.letter}}}" if part.letter else r"\mu_\sigma", "bar",
            f"torque{part.whose or ' of gas and reciprocating masses'} over the displacement, "
            "positive in the sense of rotation, cylinder 1",
            f"{NOTES}, mu", si=BAR, kind="curve",
            needs=(f"{part.prefix}tangential_pressure", "double_radius", "stroke"),
            make=lambda double_radius, stroke, **pressure: 0.5 * sum(pressure.values())
            * double_radius / stroke,
        )
        for part in _PARTS
    ),
    Node(
        "reduced_overturning_moment", r"\mu_\alpha", "bar",
        "overturning moment over the displacement, positive in the sense of rotation, cylinder 1",
        f"{NOTES}, mu", si=BAR, kind="curve", make=lambda reduced_torque: -reduced_torque,
    ),
    Node(
        "tangential_pressure_mean", r"\bar p_T", "bar",
        "cycle mean of the tangential force over piston area, averaged over the cylinders",
        f"{NOTES}: p_i/pi (two-stroke), p_i/(2 pi) (four-stroke)", si=BAR,
        make=lambda mean_gas, pressure_scale: mean_gas * pressure_scale,
    ),
    Node(
        "reduced_torque_mean", r"\bar\mu_\sigma", "bar",
        "cycle mean of the torque over the displacement, averaged over the cylinders",
        f"{NOTES}, mu", si=BAR,
        make=lambda tangential_pressure_mean, double_radius, stroke: 0.5 * tangential_pressure_mean
        * double_radius / stroke,
    ),
    Node(
        "specific_mass", "m/V_h", "kg m-3",
        "reciprocating mass per displacement of one cylinder", f"{NOTES}, p_l,nu",
        make=lambda reciprocating_mass, bore, stroke: reciprocating_mass
        / (torque.piston_area(bore) * stroke),
    ),
    Node(
        "inertia_pressure_order", r"p_{l,\nu}", "bar",
        "amplitude of each order of the inertia force over piston area, one cylinder",
        f"{NOTES}: Q_nu pi^2 m c_m^2/(2 V_h), with its sign", si=BAR,
        make=lambda acceleration_coefficient, specific_mass, mean_piston_speed:
        mechanism.inertia_pressure(acceleration_coefficient, specific_mass, mean_piston_speed),
    ),
    Node(
        "two_mass_rod_inertia", r"\theta^*_\delta", "kg m2",
        "moment of inertia of the rod's two-mass model about the centre of gravity",
        f"{NOTES}, third condition",
        **formula(mechanism.two_mass_rod_inertia, "rod_mass", "rod_centre_of_gravity", "rod"),
    ),
    Node(
        "rod_inertia_excess", r"\theta_\delta-\theta^*_\delta", "kg m2",
        "excess of the rod's moment of inertia over that of its two-mass model",
        f"{NOTES}, third condition",
        make=lambda rod_inertia, two_mass_rod_inertia: rod_inertia - two_mass_rod_inertia,
    ),
    Node(
        "rod_couple", "C_\\delta", "N m",
        "inertia couple of the rod neglected by the two-mass model, positive in the sense of "
        "increasing rod angle",
        "Kakaitsas section 2.2, derived here", kind="curve",
        make=lambda crank_angle, crank_ratio, offset_ratio, rod_inertia_excess, speed:
        mechanism.rod_couple(crank_angle, crank_ratio, rod_inertia_excess, speed, offset_ratio),
    ),
    Node(
        "rod_couple_torque", "M_\\delta", "N m",
        "rod torque neglected by the two-mass model, positive in the sense of rotation, one "
        "cylinder",
        "Kakaitsas section 2.2, derived here", kind="curve",
        **formula(mechanism.rod_couple_torque, "crank_angle", "crank_ratio", "rod_inertia_excess",
                  "speed", "offset_ratio"),
    ),
    Node(
        "rod_torque_error", r"\Delta M_l/M_l", "1",
        "largest error of the two-mass model's inertia torque, over the exact rod's largest "
        "inertia torque",
        "Kakaitsas section 2.2, derived here",
        make=lambda crank_ratio, rod_inertia_excess, reciprocating_mass, double_radius,
        offset_ratio: mechanism.rod_torque_error(
            crank_ratio, rod_inertia_excess, reciprocating_mass, 0.5 * double_radius, offset_ratio
        ),
    ),
    Node(
        "rod_thrust_error", r"\Delta N_l/N_l", "1",
        "largest error of the two-mass model's inertia wall thrust, over the exact rod's largest "
        "inertia wall thrust",
        "Kakaitsas section 2.2, derived here",
        make=lambda crank_ratio, rod_inertia_excess, reciprocating_mass, double_radius,
        offset_ratio: mechanism.rod_thrust_error(
            crank_ratio, rod_inertia_excess, reciprocating_mass, 0.5 * double_radius, offset_ratio
        ),
    ),
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
        API, kind="curve", make=_crosshead_inertia,
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
        lambda family, cylinders_by_count, curve_period, **needs: mechanism.rod_load_extremes(
            needs, family, cylinders_by_count, curve_period
        ),
        ("crank_ratio", "double_radius", "offset_ratio", "bore", "row", "pressure_scale",
         "crankcase_pressure", "piston_mass", "speed", "cylinder_set", "family",
         "cylinders_by_count", "curve_period"), width=48,
    ),
    _rod_load("gas_load_compression", "P_{g,+}", "gas_compression",
             "largest gas load that compresses the piston rod", ("gas_force", "above")),
    _rod_load("gas_load_tension", "P_{g,-}", "gas_tension",
             "largest gas load that pulls at the piston rod", ("gas_force", "below")),
    _rod_load("combined_rod_load_compression", "P_{c,+}", "compression",
             "largest compression of the combined rod load at the crosshead pin",
             ("combined_rod_load", "above")),
    _rod_load("combined_rod_load_tension", "P_{c,-}", "tension",
             "largest tension of the combined rod load at the crosshead pin",
             ("combined_rod_load", "below")),
    _rod_load("rod_load_reversal", r"\varphi_r", "reversal",
             "crank angle of the reversal of the combined rod load: the shorter of the longest "
             "stretches in compression and in tension", None, "degree", DEGREE),
    _rod_load("rod_load_reversal_ratio", r"P_{c,small}/P_{c,large}", "ratio",
             "largest reversed over largest opposite combined rod load",
             ("combined_rod_load", "reversal"), "1"),
)  # fmt: skip
