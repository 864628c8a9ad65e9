"""Nodes of the running gear: lengths, masses and inertia, and the piston's motion."""

from __future__ import annotations

from typing import Any

from engine_dyn.forces import torque
from engine_dyn.geometry import masses, slider_crank
from engine_dyn.geometry.cylinder_means import (
    engine_inertia_of_cylinders,
    mean_displacement_ratio,
    mean_factor,
    mean_stroke_ratio,
    throws_per_cylinder,
)
from engine_dyn.geometry.slider_crank import cylinder_volume
from engine_dyn.loads import friction
from engine_dyn.quantities.friction import train_of
from engine_dyn.quantities.node import Node, formula, hidden, variants
from engine_dyn.units import CUBIC_CENTIMETRE


def _volume(ratio: str, when: str) -> Node:
    """Node of cylinder 1's volume, by one of the two keys of the compression ratio."""

    def make(*, position: Any, double_radius: Any, bore: Any, stroke: Any, **needs: Any) -> Any:
        travel = 0.5 * double_radius * position
        return cylinder_volume(travel, torque.piston_area(bore), stroke, needs[ratio])

    return Node(
        "cylinder_volume", "V", "cm3", "volume of cylinder 1 above the piston",
        "Heywood (1988), section 2.2", si=CUBIC_CENTIMETRE, kind="curve", when=when,
        needs=("position", "double_radius", "bore", "stroke", ratio), make=make,
    )  # fmt: skip


NODES: tuple[Node, ...] = (
    Node(
        "rod", "l", "m", "connecting rod length", public=False,
        make=lambda double_radius, crank_ratio: 0.5 * double_radius / crank_ratio,
    ),
    Node(
        "pin_line", "e", "m", "offset of the piston-pin line from the crankshaft axis",
        public=False, make=lambda pin_offset, crank_offset: pin_offset + crank_offset,
    ),
    *variants(
        Node("double_radius", "2r", "m", "two crank radii", public=False),
        {
            "centred": lambda stroke: stroke,
            "offset": lambda stroke, crank_ratio, pin_line:
            2.0 * slider_crank.crank_radius_of_ratio(stroke, crank_ratio, pin_line),
        },
    ),
    Node(
        "offset_ratio", "e/r", "1",
        "offset of the piston-pin line over the crank radius", public=False,
        make=lambda pin_line, double_radius: pin_line / (0.5 * double_radius),
    ),
    Node(
        "mass_share", "", "1",
        "factor on the reciprocating mass, averaged over the cylinders", public=False,
        make=lambda cylinder_set, cylinders_by_count: mean_factor(
            "mass", cylinder_set, cylinders_by_count
        ),
    ),
    hidden(
        "throws_per_cylinder", "1", "number of throws over that of cylinders", when="shared_pins",
        **formula(throws_per_cylinder, "cylinder_set", "cylinders_by_count"),
    ),
    hidden(
        "throws_per_cylinder", "1", "number of throws over that of cylinders", lambda: 1.0,
        when="own_pins",
    ),
    *(
        Node(
            "stroke_share", "", "1", "mean stroke of the cylinders over the engine's", public=False,
            when=when, **formula(mean_stroke_ratio, "crank_ratio", "offset_ratio", "cylinder_set",
                                 "cylinders_by_count"),
        )
        for when in ("offset", "centred articulated_rods")
    ),
    Node(
        "stroke_share", "", "1", "mean stroke of the cylinders over the engine's", public=False,
        when="centred plain_rods", make=lambda cylinder_set, cylinders_by_count: mean_factor(
            "radius", cylinder_set, cylinders_by_count
        ),
    ),
    Node(
        "displacement", "V_h", "m3", "displacement of all cylinders", "Kakaitsas eq. 3.8",
        when="one_make",
        make=lambda bore, stroke, cylinders, stroke_share: cylinders * torque.piston_area(bore)
        * stroke * stroke_share,
    ),
    Node(
        "displacement", "V_h", "m3", "displacement of all cylinders", "Kakaitsas eq. 3.8",
        when="several_makes",
        make=lambda bore, stroke, cylinders, crank_ratio, offset_ratio, cylinder_set,
        cylinders_by_count: cylinders * torque.piston_area(bore) * stroke
        * mean_displacement_ratio(crank_ratio, offset_ratio, cylinder_set, cylinders_by_count),
    ),
    Node(
        "mean_piston_speed", "c_m", "m s-1", "mean piston speed, averaged over unequal throws",
        "Kakaitsas eq. 3.9", make=lambda stroke, stroke_share, speed: friction.mean_piston_speed(
            stroke * stroke_share, speed
        ),
    ),
    Node(
        "crank_mass_at_pin", "M''_c", "kg", "mass of each throw reduced to the crank radius",
        "Asgari eq. 6, Kakaitsas eq. 2.15", make=lambda crank_mass: crank_mass,
    ),
    Node(
        "reciprocating_mass_of_cylinder", "m_1", "kg",
        "reciprocating mass per cylinder, by default piston mass and the rod's reciprocating share",
        "Asgari eq. 10, Kakaitsas eq. 2.10", make=lambda reciprocating_mass: reciprocating_mass,
    ),
    Node(
        "rotating_mass", "m_r", "kg",
        "rotating mass per cylinder at the crank radius, with its share of its throw",
        "Kakaitsas eq. 2.11",
        **formula(masses.rotating_mass, "crank_mass", "rod_mass", "rod_centre_of_gravity", "rod",
                  "throws_per_cylinder"),
    ),
    *variants(
        Node("engine_inertia", r"\Theta_{eng}", "kg m2",
             "cycle mean of the running gear's moment of inertia", "Kakaitsas eq. 3.2"),
        {
            "equal_throws": lambda reciprocating_mass, rotating_mass, double_radius, crank_ratio,
            cylinders, offset_ratio, mass_share: masses.engine_inertia(
                mass_share * reciprocating_mass, rotating_mass, 0.5 * double_radius, crank_ratio,
                cylinders, offset_ratio,
            ),
            "unequal_throws": lambda reciprocating_mass, rod_mass_at_crank, crank_mass,
            double_radius, crank_ratio, offset_ratio, cylinders, cylinder_set, cylinders_by_count:
            engine_inertia_of_cylinders(
                reciprocating_mass, rod_mass_at_crank, crank_mass, 0.5 * double_radius, crank_ratio,
                cylinders, offset_ratio, cylinder_set, cylinders_by_count,
            ),
        },
    ),
    *variants(
        Node("mean_reciprocating_inertia", "", "kg m2",
             "cycle mean of the moment of inertia of the reciprocating masses", public=False),
        {
            "equal_throws": lambda reciprocating_mass, double_radius, crank_ratio, cylinders,
            offset_ratio, mass_share: masses.engine_inertia(
                mass_share * reciprocating_mass, 0.0, 0.5 * double_radius, crank_ratio, cylinders,
                offset_ratio,
            ),
            "unequal_throws": lambda reciprocating_mass, double_radius, crank_ratio, offset_ratio,
            cylinders, cylinder_set, cylinders_by_count: engine_inertia_of_cylinders(
                reciprocating_mass, 0.0, 0.0, 0.5 * double_radius, crank_ratio, cylinders,
                offset_ratio, cylinder_set, cylinders_by_count,
            ),
        },
    ),
    hidden(
        "varying_inertia", "kg m2",
        "moment of inertia of the reciprocating masses minus its cycle mean",
        lambda crank_angle, reciprocating_mass, mean_reciprocating_inertia, **needs:
        torque.reciprocating_inertia(crank_angle, train_of(needs), reciprocating_mass)
        - mean_reciprocating_inertia,
        ("crank_angle", "crank_ratio", "reciprocating_mass", "double_radius", "cylinder_set",
         "period", "offset_ratio", "cylinders_by_count", "mean_reciprocating_inertia"),
        kind="curve",
    ),
    Node(
        "instantaneous_engine_inertia", r"\Theta_{eng}(\varphi)", "kg m2",
        "moment of inertia of the running gear over crank angle", "Kakaitsas eq. 3.2",
        kind="curve", make=lambda engine_inertia, varying_inertia: engine_inertia + varying_inertia,
    ),
    Node(
        "instantaneous_inertia", r"\Theta(\varphi)", "kg m2",
        "moment of inertia of engine and load over crank angle",
        "Kakaitsas eqs. 3.1, 3.2", kind="curve",
        make=lambda inertia, varying_inertia: inertia + varying_inertia,
    ),
    *variants(
        Node("inertia_beyond_gear", "", "kg m2",
             "moment of inertia of the load, referred to the crankshaft", "Kakaitsas eq. 3.1",
             public=False),
        {
            "load_inertia": lambda load_inertia, gear_ratio: gear_ratio**2 * load_inertia,
            "no_load_inertia": lambda: 0.0,
        },
    ),
    Node(
        "position", "x/r", "1", "piston travel from top dead centre over crank radius",
        "Kakaitsas eq. 1.4", kind="curve",
        **formula(slider_crank.position, "crank_angle", "crank_ratio", "offset_ratio"),
    ),
    _volume("compression_ratio", "volume_of_diagrams"),
    _volume("geometric_compression_ratio", "volume_given"),
    Node(
        "velocity", r"c/(r\omega)", "1", "reduced piston velocity", "Kakaitsas eq. 1.6",
        kind="curve",
        **formula(slider_crank.velocity, "crank_angle", "crank_ratio", "offset_ratio"),
    ),
    Node(
        "acceleration", r"b/(r\omega^2)", "1", "reduced piston acceleration", "Kakaitsas eq. 1.8",
        kind="curve",
        **formula(slider_crank.acceleration, "crank_angle", "crank_ratio", "offset_ratio"),
    ),
)  # fmt: skip
