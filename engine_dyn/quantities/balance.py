"""Nodes of the balance of engines: see `engine_dyn.forces.balance`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from engine_dyn.forces import balance
from engine_dyn.forces.balance.lines import default_bank_offset
from engine_dyn.geometry import masses
from engine_dyn.quantities.node import Node, formula, hidden, parameter, variants
from engine_dyn.units import DEGREE

DIRECTIONS = (0.0, 90.0)  # Values of the dimension `direction` [degree]

PARAMETERS = (
    parameter(
        "cylinder_spacing", "a", "m", "distance between neighbouring throws along the shaft",
        "Power units, lecture 18", low=0.0,
    ),
    parameter(
        "bank_offset", "a_b", "m",
        "offset of each bank from the one before, along the shaft; by default cylinder_spacing in "
        "boxers, 0 in others", "this project",
        **formula(default_bank_offset, "cylinder_spacing", "cylinder_set", "cylinders_by_count"),
    ),
    parameter(
        "counterweight_fraction", "c", "1",
        "balance fraction, share of the reciprocating mass that counterweights balance in "
        "addition to all rotating mass",
        "Asgari eq. 9", low=0.0, low_included=True, high=1.0, high_included=True, unless_given=0.0,
    ),
    parameter(
        "counterweight_mass", "B", "kg",
        "counterweight mass of each throw, opposite its pin, scaled with its crank radius",
        "Asgari eq. 12", low=0.0, low_included=True,
    ),
    parameter(
        "counterweight_radius", "b", "m",
        "distance of the counterweights' centre of gravity from the shaft's axis",
        "Asgari eq. 12", low=0.0, make=lambda double_radius: 0.5 * double_radius,
    ),
    parameter(
        "balance_shaft_mass", "m_{s1}", "kg",
        "mass of the balance shaft that turns backwards at crankshaft speed", "Asgari eq. 13",
        low=0.0, low_included=True, unless_given=0.0,
    ),
    parameter(
        "balance_shaft_radius", "R_{s1}", "m",
        "distance of the balance shaft's centre of gravity from its axis", "Asgari eq. 13", low=0.0,
    ),
    parameter(
        "second_shaft_mass", "m_{s2}", "kg",
        "mass of each of the two balance shafts at twice crankshaft speed",
        "Lanchester's balancer; derived here", low=0.0, low_included=True, unless_given=0.0,
    ),
    parameter(
        "second_shaft_radius", "R_{s2}", "m",
        "distance of the centre of gravity from the axis, balance shafts at twice crankshaft speed",
        "Lanchester's balancer; derived here", low=0.0,
    ),
    parameter(
        "balance_couple", "(mRd)_{s1}", "kg m2",
        "balance couple on a shaft that turns backwards at crankshaft speed, unbalance times "
        "distance", "this project", low=0.0, low_included=True, unless_given=0.0,
    ),
)  # fmt: skip

_ENGINE = (
    "crank_ratio", "offset_ratio", "double_radius", "reciprocating_mass", "speed", "cylinder_set",
    "cylinders_by_count",
)  # fmt: skip
_MASSES = tuple(name for name in _ENGINE if name != "speed")
"""Inputs of results that do not depend on the speed, because only sizes of forces are compared."""

FORCE = (
    *_ENGINE, "turning_mass", "throw_turning_mass", "shaft_unbalance", "pair_unbalance",
    "web_unbalance",
)  # fmt: skip
_SPACES = ("cylinder_spacing", "bank_offset")
MOMENT = (
    *_ENGINE, "turning_mass", "throw_turning_mass", *_SPACES, "balance_couple",
    "web_unbalance_couple",
)  # fmt: skip

_TURNING = (
    *(one for one in _ENGINE if one != "reciprocating_mass"), "turning_mass", "throw_turning_mass",
)  # fmt: skip

_NAMES = {
    "shaft_unbalance": "shaft", "pair_unbalance": "pair", "cylinder_spacing": "spacing",
    "balance_couple": "couple", "cylinder_set": "cylinders",
    "cylinders_by_count": "by_count", "offset_ratio": "offset", "web_unbalance": "webs",
    "web_unbalance_couple": "web_couple",
}  # fmt: skip
"""Attribute of `balance.RunningGear` for each node that has another name."""


def running_gear(needs: dict[str, Any]) -> balance.RunningGear:
    """Return masses in motion, from the needs of a node; those of others are left out."""
    given = {_NAMES.get(name, name): value for name, value in needs.items()}
    given["crank_radius"] = 0.5 * given.pop("double_radius")
    return balance.RunningGear(**{"speed": 1.0, "reciprocating_mass": 0.0, **given})


def turning_gear(needs: dict[str, Any]) -> balance.RunningGear:
    """Running gear of nodes by name, without reciprocating masses."""
    return running_gear({**needs, "reciprocating_mass": 0.0})


def components_of(vector: Any) -> Any:
    """Both directions of a vector over the crank angle, (..., direction, crank angle)."""
    return np.stack([vector.real, vector.imag], axis=-2)


def _vector(
    name: str, symbol: str, unit: str, long_name: str, source: str, needs: tuple[str, ...],
    of: Callable[[balance.RunningGear, Any], Any], when: str = "",
) -> Node:  # fmt: skip
    return Node(
        name, symbol, unit, long_name, source, kind="curve", adds=("direction",), when=when,
        needs=("crank_angle", *needs), throws=True,
        make=lambda crank_angle, **needs: components_of(of(running_gear(needs), crank_angle)),
    )  # fmt: skip


def _turning_force(
    name: str, symbol: str, long_name: str, masses_of: dict[str, str], sign: float, source: str,
    when: str = "",
) -> Node:  # fmt: skip
    """Node of the force of rods and throws that turn with the crank, or (`sign`) opposite to it."""

    def make(*, crank_angle: Any, **needs: Any) -> Any:
        turning = {of: sign * np.asarray(needs.pop(mass)) for of, mass in masses_of.items()}
        gear = turning_gear({**needs, **turning})
        return components_of(gear.force(crank_angle))

    ratios = tuple(one for one in _ENGINE if one != "reciprocating_mass")
    return Node(
        name, symbol, "N", long_name, source, kind="curve", adds=("direction",), when=when,
        needs=("crank_angle", *ratios, *masses_of.values()), make=make, throws=True,
    )  # fmt: skip


def _scalar(
    name: str, symbol: str, unit: str, long_name: str, source: str, needs: tuple[str, ...],
    of: Callable[[balance.RunningGear], Any], extreme_of: tuple[str, str] | None = None,
) -> Node:  # fmt: skip
    return Node(name, symbol, unit, long_name, source, needs=needs, throws=True,
                extreme_of=extreme_of, make=lambda **needs: of(running_gear(needs)))  # fmt: skip


def _ellipses(
    what: str, letter: str, unit: str, needs: tuple[str, ...],
    of: Callable[[balance.RunningGear, Any], balance.Ellipse],
) -> tuple[Node, ...]:  # fmt: skip
    ends = (
        ("major", rf"{letter}_{{\nu,a}}", unit, 1.0, "long semi-axis of the ellipse of each order"),
        ("minor", rf"{letter}_{{\nu,b}}", unit, 1.0,
         "short semi-axis of the ellipse of each order"),
        ("inclination", rf"\vartheta_{{{letter},\nu}}", "degree", DEGREE,
         "angle of the ellipse's long axis from cylinder 1"),
    )  # fmt: skip

    def one(field: str) -> Callable[..., Any]:
        return lambda order, **needs: getattr(of(running_gear(needs), order), field)

    return tuple(
        Node(
            f"shaking_{what}_{field}", symbol, its, f"shaking {what}: {meaning}",
            "after Biezeno and Grammel, Technische Dynamik; derived here", si=si,
            needs=("order", *needs), make=one(field), throws=True,
        )
        for field, symbol, its, si, meaning in ends
    )  # fmt: skip


NODES = (
    *variants(
        Node("turning_mass", "", "kg",
             "rotating mass of a rod left unbalanced by the counterweights", public=False),
        {
            "weights_by_fraction": lambda counterweight_fraction, reciprocating_mass:
            -counterweight_fraction * reciprocating_mass,
            "weights_given": lambda rod_mass_at_crank: rod_mass_at_crank,
            "weights_of_webs": lambda rod_mass_at_crank: rod_mass_at_crank,
        },
    ),
    *variants(
        Node("throw_turning_mass", "", "kg",
             "mass of a throw left unbalanced by the counterweights", public=False),
        {
            "weights_by_fraction": lambda: 0.0,
            "weights_given": lambda crank_mass, weight_at_pin: crank_mass - weight_at_pin,
            "weights_of_webs": lambda crank_mass: crank_mass,
        },
    ),
    hidden(
        "weight_at_pin", "kg", "given counterweight of a throw, reduced to the crank radius",
        lambda counterweight_mass, counterweight_radius, double_radius: counterweight_mass
        * counterweight_radius / (0.5 * double_radius),
    ),
    hidden(
        "rod_weight_at_pin", "kg", "counterweight for a rod and its piston, at the crank radius",
        **formula(balance.unbalanced_mass, "counterweight_fraction", "reciprocating_mass",
                  "rod_mass_at_crank"),
    ),
    *variants(
        Node("journal_rod_mass", "", "kg", "rotating mass of a rod minus the given counterweights",
             public=False),
        {
            "counterweights": lambda turning_mass: turning_mass,
            "no_counterweights": lambda rod_mass_at_crank: rod_mass_at_crank,
        },
    ),
    *variants(
        Node("journal_throw_mass", "", "kg", "mass of a throw minus the given counterweights",
             public=False),
        {
            "counterweights": lambda throw_turning_mass: throw_turning_mass,
            "no_counterweights": lambda crank_mass: crank_mass,
        },
    ),
    *variants(
        Node("shaft_unbalance", "", "kg m", "mass times radius of the balance shaft", public=False),
        {
            "no_shaft": lambda: 0.0,
            "shaft": lambda balance_shaft_mass, balance_shaft_radius:
            balance_shaft_mass * balance_shaft_radius,
        },
    ),
    *variants(
        Node("pair_unbalance", "", "kg m", "mass times radius of each shaft at twice the speed",
             public=False),
        {
            "no_pair": lambda: 0.0,
            "pair": lambda second_shaft_mass, second_shaft_radius:
            second_shaft_mass * second_shaft_radius,
        },
    ),
    Node(
        "rod_mass_at_crank", "M'_c", "kg", "rod's mass at the crank pin", "Asgari eq. 4",
        **formula(masses.rod_mass_at_crank, "rod_mass", "rod_centre_of_gravity", "rod"),
    ),
    Node(
        "rod_mass_at_piston", "M'_p", "kg", "rod's mass at the piston pin", "Asgari eq. 5",
        **formula(masses.rod_mass_at_piston, "rod_mass", "rod_centre_of_gravity", "rod"),
    ),
    Node(
        "unbalanced_mass", "M", "kg",
        "mass at a crank pin to be balanced by a counterweight, with all its rods",
        "Asgari eq. 9",
        make=lambda counterweight_fraction, reciprocating_mass, rotating_mass, throws_per_cylinder:
        balance.unbalanced_mass(counterweight_fraction, reciprocating_mass, rotating_mass)
        / throws_per_cylinder,
    ),
    Node(
        "counterweight_required", "B", "kg",
        "counterweight mass of each throw for the balance fraction", "Asgari eq. 12",
        make=lambda unbalanced_mass, counterweight_radius, double_radius:
        balance.counterweight_mass(unbalanced_mass, 0.5 * double_radius, counterweight_radius),
    ),
    Node(
        "balance_shaft_asgari", "M_{Lan}", "kg",
        "balance-shaft mass for zero first order along the cylinder, single cylinder",
        "Asgari eq. 13",
        make=lambda counterweight_fraction, reciprocating_mass, double_radius, balance_shaft_radius:
        balance.balance_shaft_mass(
            counterweight_fraction, reciprocating_mass, 0.5 * double_radius, balance_shaft_radius
        ),
    ),
    Node(
        "balance_shaft_required", "m_{s1}", "kg",
        "balance-shaft mass for zero first order",
        "Asgari eq. 13 at c = 0.5", needs=(*_MASSES, "balance_shaft_radius"), throws=True,
        make=lambda balance_shaft_radius, **needs: running_gear(needs).shaft_required()
        / balance_shaft_radius,
    ),
    Node(
        "second_shaft_required", "m_{s2}", "kg",
        "mass of each second-order balance shaft for the smallest second-order force",
        "Lanchester's balancer; derived here", needs=(*_MASSES, "second_shaft_radius"), throws=True,
        make=lambda second_shaft_radius, **needs: running_gear(needs).pair_required()
        / second_shaft_radius,
    ),
    Node(
        "balance_couple_required", "(mRd)_{s1}", "kg m2",
        "balance couple, unbalance times distance, for zero backward part of the first-order "
        "moment; the forward part is the counterweights'",
        "this project", needs=(*_MASSES, *_SPACES), throws=True,
        make=lambda **needs: running_gear(needs).couple_required(),
    ),
    Node(
        "inertia_force_unit", r"m r \omega^2", "N",
        "first-order inertia force of one cylinder's reciprocating mass",
        "Power units, lecture 18",
        make=lambda reciprocating_mass, double_radius, speed: reciprocating_mass
        * 0.5 * double_radius * speed**2,
    ),
    _vector(
        "reciprocating_force", "P_J", "N", "inertia force of all reciprocating masses, exact",
        "Asgari eqs. 1, 7, 8", _ENGINE, lambda gear, phi: gear.force(phi), "plain_rods",
    ),
    _vector(
        "reciprocating_force_first", "P_{J,1}", "N",
        "first order of the inertia force of all reciprocating masses, primary force",
        "Asgari eq. 7", _ENGINE, lambda gear, phi: gear.force_of_order(1, phi), "plain_rods",
    ),
    _vector(
        "reciprocating_force_second", "P_{J,2}", "N",
        "second order of the inertia force of all reciprocating masses, secondary force",
        "Asgari eq. 8", _ENGINE, lambda gear, phi: gear.force_of_order(2, phi), "plain_rods",
    ),
    _turning_force(
        "throw_force", "P_r", "centrifugal force of the rotating masses of all throws",
        {"turning_mass": "rod_mass_at_crank", "throw_turning_mass": "crank_mass"}, 1.0,
        "Kakaitsas eq. 2.14",
    ),
    _turning_force(
        "counterweight_force", "P_B", "centrifugal force of all counterweights",
        {"turning_mass": "rod_weight_at_pin", "throw_turning_mass": "crank_mass"}, -1.0,
        "Asgari eqs. 9, 12, figure 6", "weights_by_fraction",
    ),
    _turning_force(
        "counterweight_force", "P_B", "centrifugal force of all counterweights",
        {"throw_turning_mass": "weight_at_pin"}, -1.0, "Asgari eqs. 9, 12, figure 6",
        "weights_given",
    ),
    _turning_force(
        "counterweight_force", "P_B", "centrifugal force of all counterweights",
        {"webs": "web_unbalance"}, 1.0, "Asgari eqs. 9, 12, figure 6", "weights_of_webs",
    ),
    _vector(
        "reciprocating_moment", "M_J", "N m",
        "moment of the reciprocating masses about the middle of the crankshaft, exact",
        "Power units, lecture 18", (*_ENGINE, *_SPACES), lambda gear, phi: gear.moment(phi),
    ),
    _vector(
        "shaking_force", "F", "N",
        "shaking force on the frame, exact, with counterweights and balance shafts",
        "Asgari section 2", FORCE, lambda gear, phi: gear.force(phi), "plain_rods",
    ),
    _vector(
        "shaking_moment", "M_F", "N m",
        "shaking moment about the middle of the crankshaft, exact",
        "Power units, lecture 18", MOMENT, lambda gear, phi: gear.moment(phi),
    ),
    _vector(
        "shaking_force_first", "F_1", "N", "first order of the shaking force", "Asgari eq. 7",
        FORCE, lambda gear, phi: gear.force_of_order(1, phi), "plain_rods",
    ),
    _vector(
        "shaking_force_second", "F_2", "N", "second order of the shaking force", "Asgari eq. 8",
        FORCE, lambda gear, phi: gear.force_of_order(2, phi), "plain_rods",
    ),
    _vector(
        "shaking_moment_first", "M_{F,1}", "N m", "first order of the shaking moment",
        "Power units, lecture 18", MOMENT, lambda gear, phi: gear.moment_of_order(1, phi),
    ),
    _vector(
        "shaking_moment_second", "M_{F,2}", "N m", "second order of the shaking moment",
        "Power units, lecture 18", MOMENT, lambda gear, phi: gear.moment_of_order(2, phi),
    ),
    *_ellipses("force", "F", "N", FORCE, lambda gear, order: gear.force_ellipse(order)),
    *_ellipses("moment", "M", "N m", MOMENT, lambda gear, order: gear.moment_ellipse(order)),
    _scalar(
        "shaking_force_max", "F_{max}", "N", "largest shaking force of a revolution, exact",
        "Asgari section 2", FORCE, lambda gear: gear.force_max(), ("shaking_force", "size"),
    ),
    _scalar(
        "shaking_force_rms", "F_{rms}", "N", "root mean square of the shaking force",
        "this project", FORCE, lambda gear: gear.force_rms(),
    ),
    _scalar(
        "shaking_moment_max", "M_{F,max}", "N m", "largest shaking moment of a revolution, exact",
        "Power units, lecture 18", MOMENT, lambda gear: gear.moment_max(),
        ("shaking_moment", "size"),
    ),
    _scalar(
        "shaking_moment_rms", "M_{F,rms}", "N m", "root mean square of the shaking moment",
        "this project", MOMENT, lambda gear: gear.moment_rms(),
    ),
    _scalar(
        "residual_rotating_force", "P_{r,res}", "N",
        "centrifugal force of all that turns with the crank and its counterweights",
        "Khurmi and Gupta chapter 21", (*_TURNING, "web_unbalance"),
        lambda gear: gear.turning_force(),
    ),
    _scalar(
        "residual_rotating_moment", "M_{r,res}", "N m",
        "moment about the middle of the crankshaft of all that turns with the crank and its "
        "counterweights",
        "Khurmi and Gupta chapter 21", (*_TURNING, *_SPACES, "web_unbalance_couple"),
        lambda gear: gear.turning_moment(),
    ),
    _scalar(
        "best_fraction_rms", "c_{rms}", "1",
        "balance fraction with the smallest root-mean-square shaking force, none if the "
        "counterweights of all throws cancel", "this project",
        (*_MASSES, "shaft_unbalance", "pair_unbalance"), lambda gear: gear.best_fraction("rms"),
    ),
    _scalar(
        "best_fraction_peak", "c_{peak}", "1",
        "balance fraction with the smallest peak shaking force, none if the counterweights of all "
        "throws cancel", "Asgari section 2: 0.5 to 0.63",
        (*_MASSES, "shaft_unbalance", "pair_unbalance"), lambda gear: gear.best_fraction("peak"),
    ),
)  # fmt: skip
