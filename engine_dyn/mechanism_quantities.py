"""The nodes of the mechanism: its series, forces, orders and bearings, as plain data.

Part of the table in `engine_dyn.quantities`, which see.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from engine_dyn import (
    bearings,
    forces,
    harmonics,
    kinematic_series,
    masses,
    mechanism,
    slider_crank,
)
from engine_dyn.cylinders import even_cylinders
from engine_dyn.node import BAR, DEGREE, Node

__all__ = ["NODES"]

MOSAKOWSKI = "Mosakowski"
NOTES = "Rakopoulos notes"


def _hidden(name: str, unit: str, long_name: str, needs: tuple[str, ...], make: Any,
            **more: Any) -> Node:  # fmt: skip
    return Node(name, "", unit, long_name, needs=needs, make=make, public=False, **more)


COMPLEX = 16
PARTS_WIDTH = 64
"""Bytes of a harmonic; of a load's components, with the parts that they are summed from."""


def _centred(offset_ratio: Any, what: str) -> None:
    if np.any(offset_ratio):
        raise ValueError(
            f"{what} is that of a centred mechanism; pin_offset and crank_offset must add up to 0"
        )


# Kinematic series -------------------------------------------------------------------------------


def _coefficients(function: Callable[..., Any], what: str) -> Callable[..., Any]:
    def make(order: Any, crank_ratio: Any, offset_ratio: Any) -> Any:
        _centred(offset_ratio, what)
        return function(order, crank_ratio)

    return make


def _mean_position(crank_ratio: Any, offset_ratio: Any) -> Any:
    _centred(offset_ratio, "position_mean")
    return kinematic_series.mean_position(crank_ratio)


def _truncated(function: Callable[..., Any], what: str) -> Callable[..., Any]:
    def make(crank_angle: Any, crank_ratio: Any, truncation: Any, offset_ratio: Any) -> Any:
        _centred(offset_ratio, what)
        return function(crank_angle, crank_ratio, truncation)

    return make


def _truncation_error(derivative: int, what: str) -> Callable[..., Any]:
    def make(crank_ratio: Any, truncation: Any, offset_ratio: Any) -> Any:
        _centred(offset_ratio, what)
        return kinematic_series.truncation_error(crank_ratio, truncation, derivative)

    return make


_SERIES_NEEDS = ("order", "crank_ratio", "offset_ratio")
_CURVE_NEEDS = ("crank_angle", "crank_ratio", "truncation", "offset_ratio")
_ERROR_NEEDS = ("crank_ratio", "truncation", "offset_ratio")

_SERIES = (
    Node(
        "position_coefficient", r"a_\nu", "1",
        "coefficients of the reduced piston travel, of cos(nu phi)",
        f"{MOSAKOWSKI} eq. 7 (A = -a), {NOTES}", needs=_SERIES_NEEDS,
        make=_coefficients(kinematic_series.position_coefficients, "position_coefficient"),
    ),
    Node(
        "velocity_coefficient", r"\gamma_\nu", "1",
        "coefficients of the reduced piston velocity, of sin(nu phi)",
        f"{MOSAKOWSKI} eq. 5, {NOTES}", needs=_SERIES_NEEDS,
        make=_coefficients(kinematic_series.velocity_coefficients, "velocity_coefficient"),
    ),
    Node(
        "acceleration_coefficient", r"\beta_\nu", "1",
        "coefficients of the reduced piston acceleration, of cos(nu phi)",
        f"{MOSAKOWSKI} eq. 6, {NOTES}", needs=_SERIES_NEEDS,
        make=_coefficients(kinematic_series.acceleration_coefficients, "acceleration_coefficient"),
    ),
    Node(
        "inertia_torque_coefficient", r"\Delta T_\nu", "1",
        "coefficients of the inertia torque over m r^2 omega^2, of sin(nu phi), one cylinder",
        NOTES, needs=_SERIES_NEEDS,
        make=_coefficients(
            kinematic_series.inertia_torque_coefficients, "inertia_torque_coefficient"
        ),
    ),
    Node(
        "position_mean", "a_0", "1", "mean of the reduced piston travel over a turn",
        f"{NOTES}, a0", needs=("crank_ratio", "offset_ratio"), make=_mean_position,
    ),
    Node(
        "position_truncated", r"\tilde x/r", "1", "reduced piston travel by the shortened series",
        f"{MOSAKOWSKI} eqs. 9, 17", kind="curve", needs=_CURVE_NEEDS,
        make=_truncated(kinematic_series.truncated_position, "position_truncated"),
    ),
    Node(
        "velocity_truncated", r"\tilde c/(r\omega)", "1",
        "reduced piston velocity by the shortened series", f"{MOSAKOWSKI} eqs. 12, 17",
        kind="curve", needs=_CURVE_NEEDS,
        make=_truncated(kinematic_series.truncated_velocity, "velocity_truncated"),
    ),
    Node(
        "acceleration_truncated", r"\tilde b/(r\omega^2)", "1",
        "reduced piston acceleration by the shortened series", f"{MOSAKOWSKI} eqs. 13, 18",
        kind="curve", needs=_CURVE_NEEDS,
        make=_truncated(kinematic_series.truncated_acceleration, "acceleration_truncated"),
    ),
    Node(
        "position_truncation_error", r"\Delta x/s", "1",
        "error of the shortened travel, the largest over the stroke",
        f"after {MOSAKOWSKI} eq. 16", needs=_ERROR_NEEDS,
        make=_truncation_error(0, "position_truncation_error"),
    ),
    Node(
        "velocity_truncation_error", r"\Delta c/c_{max}", "1",
        "error of the shortened velocity, the largest over the largest velocity",
        f"after {MOSAKOWSKI} eq. 16", needs=_ERROR_NEEDS,
        make=_truncation_error(1, "velocity_truncation_error"),
    ),
    Node(
        "acceleration_truncation_error", r"\Delta b/b_{max}", "1",
        "error of the shortened acceleration, the largest over the largest acceleration",
        f"{MOSAKOWSKI} eq. 16", needs=_ERROR_NEEDS,
        make=_truncation_error(2, "acceleration_truncation_error"),
    ),
)  # fmt: skip


# Forces and torques of the mechanism ------------------------------------------------------------

_ANGLE = ("crank_angle", "crank_ratio", "offset_ratio")


def _force(name: str, symbol: str, long_name: str, source: str, needs: tuple[str, ...], make: Any,
           **more: Any) -> Node:  # fmt: skip
    """A force of cylinder 1 over the crank angle."""
    return Node(name, symbol, "N", f"{long_name}, cylinder 1", source, needs=needs, make=make,
                kind="curve", **more)  # fmt: skip


def _over_area(name: str, symbol: str, of: str, long_name: str) -> Node:
    def make(**needs: Any) -> Any:
        return needs[of] / forces.piston_area(needs["bore"])

    return Node(
        name, symbol, "bar", f"{long_name} over the area of the piston, cylinder 1",
        f"{NOTES}, reduced pressures", si=BAR, kind="curve", needs=(of, "bore"), make=make,
    )  # fmt: skip


_FORCES = (
    _hidden(
        "mass_of_first", "kg", "reciprocating mass of cylinder 1", ("reciprocating_mass",),
        lambda reciprocating_mass: reciprocating_mass, when="equal",
    ),
    _hidden(
        "mass_of_first", "kg", "reciprocating mass of cylinder 1",
        ("reciprocating_mass", "cylinder_set", "cylinders_by_count"),
        lambda reciprocating_mass, cylinder_set, cylinders_by_count: reciprocating_mass
        * mechanism.of_cylinder(lambda m: m.mass_factor, cylinder_set, cylinders_by_count),
        when="unequal",
    ),
    Node(
        "rod_angle", r"\beta", "degree",
        "angle of the rod to the cylinder, positive with the big end where the crank pin goes down",
        "Kakaitsas eq. 1.3", si=DEGREE, kind="curve", needs=_ANGLE,
        make=lambda crank_angle, crank_ratio, offset_ratio: slider_crank.rod_angle(
            crank_angle, crank_ratio, offset_ratio
        ),
    ),
    _force(
        "gas_force", "P_g", "force of the gas on the piston, towards the crank",
        "Kakaitsas eq. 2.1", ("pressure", "crankcase_pressure", "bore"),
        lambda pressure, crankcase_pressure, bore: (pressure - crankcase_pressure)
        * forces.piston_area(bore),
    ),
    _force(
        "inertia_force", "P_l", "force of the reciprocating masses, towards the crank",
        "Kakaitsas eq. 2.12", ("mass_of_first", "throw", "speed", "acceleration"),
        lambda mass_of_first, throw, speed, acceleration: -mass_of_first * 0.5 * throw * speed**2
        * acceleration,
    ),
    _force(
        "piston_force", "P", "gas and inertia force on the piston, towards the crank",
        "Kakaitsas eq. 2.16", ("gas_force", "inertia_force"),
        lambda gas_force, inertia_force: gas_force + inertia_force,
    ),
    _force(
        "wall_thrust", "N",
        "force of the piston on the wall, opposite to the side where the crank pin goes down",
        "Kakaitsas eq. 2.17", ("piston_force", *_ANGLE),
        lambda piston_force, crank_angle, crank_ratio, offset_ratio: piston_force
        * mechanism.thrust_ratio(crank_angle, crank_ratio, offset_ratio),
    ),
    _force(
        "rod_force", "S", "force in the rod, compression positive", "Kakaitsas eq. 2.18",
        ("piston_force", *_ANGLE),
        lambda piston_force, crank_angle, crank_ratio, offset_ratio: piston_force
        * mechanism.rod_ratio(crank_angle, crank_ratio, offset_ratio),
    ),
    _force(
        "tangential_force", "T", "force of the rod on the crank pin in the sense of rotation",
        "Kakaitsas eq. 2.19", ("piston_force", "velocity"),
        lambda piston_force, velocity: piston_force * velocity,
    ),
    _force(
        "gas_tangential_force", "T_g", "tangential force of the gas", "Kakaitsas eq. 2.4",
        ("gas_force", "velocity"), lambda gas_force, velocity: gas_force * velocity,
    ),
    _force(
        "inertia_tangential_force", "T_l", "tangential force of the reciprocating masses",
        "Kakaitsas eq. 2.13", ("inertia_force", "velocity"),
        lambda inertia_force, velocity: inertia_force * velocity,
    ),
    _force(
        "radial_force", "R", "force of the rod on the crank pin towards the crank's axis",
        "Kakaitsas eq. 2.5", ("piston_force", *_ANGLE),
        lambda piston_force, crank_angle, crank_ratio, offset_ratio: piston_force
        * mechanism.radial_ratio(crank_angle, crank_ratio, offset_ratio),
    ),
    Node(
        "overturning_moment", r"M_\alpha", "N m",
        "overturning moment on the frame, in the sense of rotation, all cylinders",
        "Kakaitsas eq. 2.8", kind="curve", needs=("gas_torque", "inertia_torque"),
        make=lambda gas_torque, inertia_torque: -(gas_torque + inertia_torque),
    ),
    Node(
        "rotating_force", "P_r", "N",
        "centrifugal force of the rotating mass of one cylinder, without counterweights",
        "Kakaitsas eq. 2.14", needs=("rotating_mass", "throw", "speed"),
        make=lambda rotating_mass, throw, speed: rotating_mass * 0.5 * throw * speed**2,
    ),
    Node(
        "gravity_torque", "M_G", "N m",
        "torque of the weight of the running gear without counterweights, all cylinders",
        f"{NOTES}, T_G", kind="curve", when="equal_throws",
        needs=("crank_angle", "crank_ratio", "reciprocating_mass", "rotating_mass", "throw",
               "cylinder_set", "cylinders_by_count", "offset_ratio"),
        make=lambda crank_angle, crank_ratio, reciprocating_mass, rotating_mass, throw,
        cylinder_set, cylinders_by_count, offset_ratio: mechanism.gravity_torque(
            crank_angle, crank_ratio, reciprocating_mass, rotating_mass, 0.5 * throw, cylinder_set,
            cylinders_by_count, offset_ratio,
        ),
    ),
    _over_area("piston_pressure", "p", "piston_force", "gas and inertia force"),
    _over_area("wall_pressure", "p_N", "wall_thrust", "wall thrust"),
    _over_area("rod_pressure", "p_S", "rod_force", "rod force"),
    _over_area("tangential_pressure", "p_T", "tangential_force", "tangential force"),
    _over_area("radial_pressure", "p_R", "radial_force", "radial force"),
    Node(
        "reduced_torque", r"\mu_\sigma", "bar",
        "torque of gas and reciprocating masses over the displacement, cylinder 1",
        f"{NOTES}, mu", si=BAR, kind="curve", needs=("tangential_pressure", "throw", "stroke"),
        make=lambda tangential_pressure, throw, stroke: 0.5 * tangential_pressure * throw / stroke,
    ),
    Node(
        "tangential_pressure_mean", r"\bar p_T", "bar",
        "cycle mean of the tangential force over the area of the piston, mean of the cylinders",
        f"{NOTES}: p_i/pi (two-stroke), p_i/(2 pi) (four-stroke)", si=BAR,
        needs=("mean_gas", "pressure_scale"),
        make=lambda mean_gas, pressure_scale: mean_gas * pressure_scale,
    ),
    Node(
        "reduced_torque_mean", r"\bar\mu_\sigma", "bar",
        "cycle mean of the torque over the displacement, mean of the cylinders", f"{NOTES}, mu",
        si=BAR, needs=("tangential_pressure_mean", "throw", "stroke"),
        make=lambda tangential_pressure_mean, throw, stroke: 0.5 * tangential_pressure_mean
        * throw / stroke,
    ),
    Node(
        "specific_mass", "m/V_h", "kg m-3",
        "reciprocating mass over displacement of one cylinder", NOTES,
        needs=("reciprocating_mass", "bore", "stroke"),
        make=lambda reciprocating_mass, bore, stroke: reciprocating_mass
        / (forces.piston_area(bore) * stroke),
    ),
    Node(
        "inertia_pressure_order", r"p_{l,\nu}", "bar",
        "amplitude of the orders of the inertia force over the area of the piston, one cylinder",
        f"{NOTES}: Q_nu pi^2 m c_m^2/(2 V_h), with its sign", si=BAR,
        needs=("acceleration_coefficient", "specific_mass", "mean_piston_speed"),
        make=lambda acceleration_coefficient, specific_mass, mean_piston_speed:
        mechanism.inertia_pressure(acceleration_coefficient, specific_mass, mean_piston_speed),
    ),
    Node(
        "two_mass_rod_inertia", r"\theta^*_\delta", "kg m2",
        "moment of inertia of the rod's two masses about its centre of gravity",
        f"{NOTES}, third condition", needs=("rod_mass", "rod_centre_of_gravity", "rod"),
        make=lambda rod_mass, rod_centre_of_gravity, rod: mechanism.two_mass_rod_inertia(
            rod_mass, rod_centre_of_gravity, rod
        ),
    ),
    Node(
        "rod_inertia_excess", r"\theta_\delta-\theta^*_\delta", "kg m2",
        "moment of inertia of the rod less that of its two masses", f"{NOTES}, third condition",
        needs=("rod_inertia", "two_mass_rod_inertia"),
        make=lambda rod_inertia, two_mass_rod_inertia: rod_inertia - two_mass_rod_inertia,
    ),
    Node(
        "rod_couple", "C_\\delta", "N m",
        "inertia couple of the rod that two masses leave out, in the sense of a growing rod angle",
        "Kakaitsas section 2.2, derived here", kind="curve",
        needs=(*_ANGLE, "rod_inertia_excess", "speed"),
        make=lambda crank_angle, crank_ratio, offset_ratio, rod_inertia_excess, speed:
        mechanism.rod_couple(crank_angle, crank_ratio, rod_inertia_excess, speed, offset_ratio),
    ),
    Node(
        "rod_couple_torque", "M_\\delta", "N m",
        "torque of the rod that two masses leave out, one cylinder",
        "Kakaitsas section 2.2, derived here", kind="curve",
        needs=(*_ANGLE, "rod_inertia_excess", "speed"),
        make=lambda crank_angle, crank_ratio, offset_ratio, rod_inertia_excess, speed:
        mechanism.rod_couple_torque(
            crank_angle, crank_ratio, rod_inertia_excess, speed, offset_ratio
        ),
    ),
    Node(
        "rod_torque_error", r"\Delta M_l/M_l", "1",
        "largest error of the inertia torque of two masses over the largest of the exact rod",
        "Kakaitsas section 2.2, derived here",
        needs=("crank_ratio", "rod_inertia_excess", "reciprocating_mass", "throw", "offset_ratio"),
        make=lambda crank_ratio, rod_inertia_excess, reciprocating_mass, throw, offset_ratio:
        mechanism.rod_torque_error(
            crank_ratio, rod_inertia_excess, reciprocating_mass, 0.5 * throw, offset_ratio
        ),
    ),
    Node(
        "rod_thrust_error", r"\Delta N_l/N_l", "1",
        "largest error of the inertia wall thrust of two masses over the largest of the exact rod",
        "Kakaitsas section 2.2, derived here",
        needs=("crank_ratio", "rod_inertia_excess", "reciprocating_mass", "throw", "offset_ratio"),
        make=lambda crank_ratio, rod_inertia_excess, reciprocating_mass, throw, offset_ratio:
        mechanism.rod_thrust_error(
            crank_ratio, rod_inertia_excess, reciprocating_mass, 0.5 * throw, offset_ratio
        ),
    ),
)  # fmt: skip


# Orders -----------------------------------------------------------------------------------------


def _gas_torque_of(work: Any, speed: Any, pressure_scale: Any, crankcase_pressure: Any, bore: Any,
                   throw: Any) -> Any:  # fmt: skip
    lever = forces.piston_area(bore) * 0.5 * throw
    return lever * (pressure_scale * work - crankcase_pressure * speed)


_COUNTED = ("cylinder_set", "cylinders_by_count")
_GAS = ("pressure_scale", "crankcase_pressure", "bore", "throw")


def _harmonic(name: str, unit: str, long_name: str, needs: tuple[str, ...], make: Any,
              **more: Any) -> Node:  # fmt: skip
    return _hidden(name, unit, long_name, needs, make, width=COMPLEX, **more)


def _complex_torques(scope: str, work: str, speed: str, inertia: str, long_name: str) -> list[Node]:
    """Harmonics of gas, inertia and total torque of one cylinder, all, or each throw."""

    def gas(**needs: Any) -> Any:
        return _gas_torque_of(needs.pop(work), needs.pop(speed), **needs)

    def masses_torque(**needs: Any) -> Any:
        moment = needs["reciprocating_mass"] * (0.5 * needs["throw"] * needs["speed"]) ** 2
        return moment * needs[inertia]

    def total(**needs: Any) -> Any:
        return needs[f"{scope}gas_torque_harmonics"] + needs[f"{scope}inertia_torque_harmonics"]

    return [
        _harmonic(
            f"{scope}gas_torque_harmonics", "N m", f"harmonics of the gas torque, {long_name}",
            (work, speed, *_GAS), gas,
        ),
        _harmonic(
            f"{scope}inertia_torque_harmonics", "N m",
            f"harmonics of the inertia torque, {long_name}",
            (inertia, "reciprocating_mass", "throw", "speed"), masses_torque,
        ),
        _harmonic(
            f"{scope}torque_harmonics", "N m", f"harmonics of the torque, {long_name}",
            (f"{scope}gas_torque_harmonics", f"{scope}inertia_torque_harmonics"), total,
        ),
    ]  # fmt: skip


def _gravity(scope: str, first_only: bool) -> Node:
    def make(**needs: Any) -> Any:
        return harmonics.gravity_harmonics(
            needs["order"], needs["crank_ratio"], needs["reciprocating_mass"],
            needs["rotating_mass"], 0.5 * needs["throw"], needs["cylinder_set"],
            needs["cylinders_by_count"], needs["offset_ratio"], first_only,
        )  # fmt: skip

    return _harmonic(
        f"{scope}gravity_torque_harmonics", "N m", "harmonics of the gravity torque",
        (*_SERIES_NEEDS, "reciprocating_mass", "rotating_mass", "throw", *_COUNTED), make,
        when="" if first_only else "equal_throws",
    )  # fmt: skip


def _polar(scope: str, what: str, symbol: str, long_name: str) -> list[Node]:
    """Amplitude and phase of harmonics."""
    of = f"{scope}{what}_harmonics"
    return [
        Node(
            f"{scope}{what}_order", symbol, "N m", f"amplitude of the orders of the {long_name}",
            f"{NOTES}, harmonics of the tangential force", needs=(of,),
            make=lambda **needs: np.abs(needs[of]),
        ),
        Node(
            f"{scope}{what}_phase", rf"\psi_{{{symbol.replace('_', '')}}}", "degree",
            f"phase of the orders of the {long_name}, psi of cos(nu phi + psi)",
            f"{NOTES}, harmonics of the tangential force", si=DEGREE, needs=(of,),
            make=lambda **needs: harmonics.phase_of(needs[of]),
        ),
    ]  # fmt: skip


_DIAGRAM = ("order", "crank_ratio", "offset_ratio", "row", "family", "period")

_HARMONICS = (
    _harmonic(
        "speed_harmonics", "1", "harmonics of the reduced piston velocity", _SERIES_NEEDS,
        lambda order, crank_ratio, offset_ratio: harmonics.velocity_harmonics(
            order, crank_ratio, offset_ratio
        ),
    ),
    _harmonic(
        "inertia_harmonics", "1", "harmonics of the inertia torque over m r^2 omega^2",
        _SERIES_NEEDS,
        lambda order, crank_ratio, offset_ratio: harmonics.inertia_harmonics(
            order, crank_ratio, offset_ratio
        ),
    ),
    _harmonic(
        "gas_harmonics", "Pa", "harmonics of pressure times reduced piston velocity, cylinder 1",
        _DIAGRAM,
        lambda order, crank_ratio, offset_ratio, row, family, period: harmonics.gas_harmonics(
            order, crank_ratio, offset_ratio, row, family, period
        ),
        when="equal",
    ),
    _harmonic(
        "gas_harmonics", "Pa", "harmonics of pressure times reduced piston velocity, cylinder 1",
        (*_DIAGRAM, *_COUNTED),
        lambda order, crank_ratio, offset_ratio, row, family, period, cylinder_set,
        cylinders_by_count: harmonics.first_gas_harmonics(
            order, crank_ratio, offset_ratio, row, family, period, cylinder_set, cylinders_by_count
        ),
        when="unequal",
    ),
    _harmonic(
        "phase_vectors", "1", "sum of the phase vectors of all cylinders", ("order", *_COUNTED),
        lambda order, cylinder_set, cylinders_by_count: harmonics.phase_vectors(
            order, cylinder_set, cylinders_by_count
        ),
    ),
    _harmonic(
        "mass_vectors", "1", "sum of the phase vectors, weighted with the masses",
        ("order", *_COUNTED),
        lambda order, cylinder_set, cylinders_by_count: harmonics.phase_vectors(
            order, cylinder_set, cylinders_by_count, lambda member: member.mass_factor
        ),
    ),
    _harmonic(
        "engine_gas_harmonics", "Pa",
        "harmonics of pressure times reduced piston velocity, all cylinders",
        ("gas_harmonics", "phase_vectors"),
        lambda gas_harmonics, phase_vectors: gas_harmonics * phase_vectors, when="equal",
    ),
    _harmonic(
        "engine_gas_harmonics", "Pa",
        "harmonics of pressure times reduced piston velocity, all cylinders",
        (*_DIAGRAM, *_COUNTED),
        lambda order, crank_ratio, offset_ratio, row, family, period, cylinder_set,
        cylinders_by_count: harmonics.engine_gas_harmonics(
            order, crank_ratio, offset_ratio, row, family, period, cylinder_set, cylinders_by_count
        ),
        when="unequal equal_throws",
    ),
    _harmonic(
        "engine_speed_harmonics", "1", "harmonics of the reduced piston velocity, all cylinders",
        ("speed_harmonics", "phase_vectors"),
        lambda speed_harmonics, phase_vectors: speed_harmonics * phase_vectors,
        when="equal_throws",
    ),
    _harmonic(
        "engine_inertia_harmonics", "1",
        "harmonics of the inertia torque over m r^2 omega^2, all cylinders",
        ("inertia_harmonics", "mass_vectors"),
        lambda inertia_harmonics, mass_vectors: inertia_harmonics * mass_vectors,
        when="equal_throws",
    ),
    _harmonic(
        "first_inertia_harmonics", "1",
        "harmonics of the inertia torque over m r^2 omega^2, cylinder 1",
        ("inertia_harmonics", *_COUNTED),
        lambda inertia_harmonics, cylinder_set, cylinders_by_count: inertia_harmonics
        * mechanism.of_cylinder(lambda m: m.mass_factor, cylinder_set, cylinders_by_count),
        when="unequal",
    ),
    _harmonic(
        "first_inertia_harmonics", "1",
        "harmonics of the inertia torque over m r^2 omega^2, cylinder 1", ("inertia_harmonics",),
        lambda inertia_harmonics: inertia_harmonics, when="equal",
    ),
    _harmonic(
        "throw_phase_vectors", "1", "sum of the phase vectors on each throw",
        ("order", *_COUNTED, "cylinder"),
        lambda order, cylinder_set, cylinders_by_count, cylinder: harmonics.throw_phase_vectors(
            order, cylinder_set, cylinders_by_count, cylinder
        ),
    ),
    _harmonic(
        "throw_gas_harmonics", "Pa",
        "harmonics of pressure times reduced piston velocity of each throw",
        ("gas_harmonics", "throw_phase_vectors"),
        lambda gas_harmonics, throw_phase_vectors: gas_harmonics * throw_phase_vectors,
        when="equal",
    ),
    _harmonic(
        "throw_gas_harmonics", "Pa",
        "harmonics of pressure times reduced piston velocity of each throw",
        (*_DIAGRAM, *_COUNTED, "cylinder"),
        lambda order, crank_ratio, offset_ratio, row, family, period, cylinder_set,
        cylinders_by_count, cylinder: harmonics.throw_gas_harmonics(
            order, crank_ratio, offset_ratio, row, family, period, cylinder_set, cylinders_by_count,
            cylinder,
        ),
        when="unequal equal_throws",
    ),
    _harmonic(
        "throw_speed_harmonics", "1", "harmonics of the reduced piston velocity of each throw",
        ("speed_harmonics", "throw_phase_vectors"),
        lambda speed_harmonics, throw_phase_vectors: speed_harmonics * throw_phase_vectors,
        when="equal_throws",
    ),
    _harmonic(
        "throw_inertia_harmonics", "1",
        "harmonics of the inertia torque over m r^2 omega^2 of each throw",
        ("inertia_harmonics", "order", *_COUNTED, "cylinder"),
        lambda inertia_harmonics, order, cylinder_set, cylinders_by_count, cylinder:
        inertia_harmonics * harmonics.throw_phase_vectors(
            order, cylinder_set, cylinders_by_count, cylinder, lambda member: member.mass_factor
        ),
        when="equal_throws",
    ),
    *_complex_torques("cylinder_", "gas_harmonics", "speed_harmonics", "first_inertia_harmonics",
                      "cylinder 1"),
    *_complex_torques("", "engine_gas_harmonics", "engine_speed_harmonics",
                      "engine_inertia_harmonics", "all cylinders"),
    *_complex_torques("throw_", "throw_gas_harmonics", "throw_speed_harmonics",
                      "throw_inertia_harmonics", "each throw"),
    _gravity("", False),
    _gravity("cylinder_", True),
)  # fmt: skip

_ORDERS = (
    Node(
        "order_frequency", r"f_\nu", "Hz", "frequency of the orders at nominal speed",
        f"{NOTES}, harmonics of the tangential force", needs=("order", "speed"),
        make=lambda order, speed: order * speed / (2.0 * np.pi),
    ),
    Node(
        "phase_vector_sum", r"|\sum e^{i\nu\psi_k}|", "1",
        "sum of the cylinders' phase vectors, 0 where an order cancels, Z where it is major",
        f"{NOTES}, engines with several cylinders", needs=("phase_vectors",),
        make=lambda phase_vectors: np.abs(phase_vectors),
    ),
    *_polar("", "gas_torque", r"M_{g,\nu}", "gas torque, all cylinders"),
    *_polar("", "inertia_torque", r"M_{l,\nu}", "inertia torque, all cylinders"),
    *_polar("", "gravity_torque", r"M_{G,\nu}", "gravity torque, all cylinders"),
    *_polar("", "torque", r"M_{\nu}", "torque of gas and reciprocating masses, all cylinders"),
    *_polar("cylinder_", "gas_torque", r"M_{g1,\nu}", "gas torque, cylinder 1"),
    *_polar("cylinder_", "inertia_torque", r"M_{l1,\nu}", "inertia torque, cylinder 1"),
    *_polar("cylinder_", "gravity_torque", r"M_{G1,\nu}", "gravity torque, cylinder 1"),
    *_polar("cylinder_", "torque", r"M_{1,\nu}",
            "torque of gas and reciprocating masses, cylinder 1"),
    *_polar("throw_", "torque", r"M_{j,\nu}",
            "torque of gas and reciprocating masses on each throw along the shaft"),
)  # fmt: skip


# Bearings ---------------------------------------------------------------------------------------

_RODS = ("rod_mass", "rod_centre_of_gravity", "rod")
_LOADED = (
    "crank_ratio", "offset_ratio", "family", "row", "pressure_scale", "crankcase_pressure", "bore",
    "throw", "reciprocating_mass", "speed", "period",
)  # fmt: skip


def _factors(turning: Any, needs: dict[str, Any]) -> bearings.Factors:
    area = forces.piston_area(needs["bore"])
    centrifugal = 0.5 * needs["throw"] * needs["speed"] ** 2
    return bearings.Factors(
        needs["pressure_scale"] * area, needs["crankcase_pressure"] * area,
        needs["reciprocating_mass"] * centrifugal, turning * centrifugal,
    )  # fmt: skip


def _crank_pin_factors(needs: dict[str, Any]) -> bearings.Factors:
    return _factors(masses.rod_mass_at_crank(*(needs[name] for name in _RODS)), needs)


def _piston_pin_factors(needs: dict[str, Any]) -> bearings.Factors:
    return _factors(masses.rod_mass_at_piston(*(needs[name] for name in _RODS)), needs)


def _journal_factors(needs: dict[str, Any]) -> bearings.Factors:
    return _factors(needs["rotating_mass"], needs)


def _engines(needs: dict[str, Any]) -> tuple[Any, Any]:
    """Cylinders to take; of equal ones the first is that of any engine."""
    if "cylinder_set" in needs:
        return needs["cylinder_set"], needs["cylinders_by_count"]
    return 1, {1: even_cylinders(1, needs["period"])}


def _load_nodes(
    load: str, text: str, letter: str, own: tuple[str, ...],
    factors: Callable[[dict[str, Any]], bearings.Factors], function: Any,
) -> list[Node]:  # fmt: skip
    def components(**needs: Any) -> Any:
        more = {"journals": needs["main_bearing"]} if load == "main_journal" else {}
        one, other = function(
            needs["crank_angle"], needs["crank_ratio"], needs["offset_ratio"], needs["family"],
            needs["row"], factors(needs), *_engines(needs), **more,
        )  # fmt: skip
        return one + 1j * other

    def found(**needs: Any) -> Any:
        return bearings.extremes(
            load, needs["crank_ratio"], needs["offset_ratio"], needs["family"], needs["row"],
            factors(needs), *_engines(needs), needs["period"], needs.get("main_bearing", 1),
        )  # fmt: skip

    whole, extreme = f"{load}_components", f"{load}_extremes"
    variants: tuple[tuple[str, tuple[str, ...]], ...] = (("equal_throws", _COUNTED),)
    if load != "main_journal":
        variants = (("equal", ()), ("unequal", _COUNTED))
    hidden = [
        node
        for when, counted in variants
        for node in (
            _hidden(whole, "N", f"components of the {text}",
                    (*_LOADED, *own, *counted, "crank_angle"), components, kind="curve", when=when,
                    width=PARTS_WIDTH),
            _hidden(extreme, "N", f"extremes of the {text}", (*_LOADED, *own, *counted), found,
                    when=when, width=bearings.EXTREMES.itemsize),
        )
    ]  # fmt: skip
    return [
        *hidden,
        Node(f"{load}_load", letter, "N", text, NOTES, kind="curve", needs=(whole,),
             make=lambda **needs: np.abs(needs[whole])),
        Node(f"{load}_load_max", rf"{letter[:-1]},max}}", "N", f"largest {text}", NOTES,
             needs=(extreme,), make=lambda **needs: needs[extreme]["peak"]),
        Node(f"{load}_load_mean", rf"\bar {letter}", "N", f"cycle mean of the size of the {text}",
             NOTES, needs=(extreme,), make=lambda **needs: needs[extreme]["mean"]),
        Node(f"{load}_peak_angle", rf"\varphi_{{{letter[3:-1]},max}}", "degree",
             f"crank angle of the largest {text}", NOTES, si=DEGREE, needs=(extreme,),
             make=lambda **needs: needs[extreme]["angle"]),
    ]  # fmt: skip


_AROUND = ("crank_angle", "crank_ratio", "offset_ratio")


def _part(name: str, symbol: str, long_name: str, turning: str = "") -> Node:
    """One component of a load: as it is, or turned with its crank or crank 1 of the engine."""
    load, _, part = name.rpartition("_")
    of = f"{load}_components"
    needs = (of, *_AROUND, *_COUNTED) if turning == "engine" else (of, *_AROUND)

    def make(**needs: Any) -> Any:
        found = needs[of]
        if turning == "engine":
            found = bearings.turned(found, bearings.first_crank(
                needs["crank_angle"], needs["crank_ratio"], needs["offset_ratio"],
                needs["cylinder_set"], needs["cylinders_by_count"],
            ))  # fmt: skip
        elif turning == "crank":
            top = slider_crank.dead_centres(needs["crank_ratio"], needs["offset_ratio"]).top
            found = bearings.turned(found, needs["crank_angle"] + top)
        return found.real if part in ("radial", "x", "side") else found.imag

    return Node(
        name, symbol, "N", long_name, NOTES, kind="curve", needs=needs if turning else (of,),
        make=make,
    )  # fmt: skip


_BEARINGS = (
    *_load_nodes("crank_pin", "load of the rod on the crank pin, cylinder 1", "F_{C}", _RODS,
                 _crank_pin_factors, bearings.crank_pin_load),
    *_load_nodes("piston_pin", "load of the piston pin, cylinder 1", "F_{P}", _RODS,
                 _piston_pin_factors, bearings.piston_pin_load),
    *_load_nodes("main_journal", "load of the main journals, on their bearings", "F_{H}",
                 ("rotating_mass", "main_bearing"), _journal_factors, bearings.main_journal_load),
    _part("crank_pin_radial", "F_{C,r}",
          "load of the crank pin along the crank, outwards, cylinder 1"),
    _part("crank_pin_tangential", "F_{C,t}",
          "load of the crank pin across the crank, in the sense of rotation, cylinder 1"),
    _part("crank_pin_x", "F_{C,x}",
          "load of the crank pin across the cylinder, to the side where the pin goes down, "
          "cylinder 1", "crank"),
    _part("crank_pin_y", "F_{C,y}",
          "load of the crank pin along the cylinder, away from the crank, cylinder 1", "crank"),
    _part("piston_pin_side", "F_{P,s}",
          "load of the piston pin across the cylinder, to the side where the crank pin goes down, "
          "cylinder 1"),
    _part("piston_pin_down", "F_{P,d}",
          "load of the piston pin along the cylinder, towards the crank, cylinder 1"),
    _part("main_journal_x", "F_{H,x}",
          "sideways load of the main journals, to the side where an upright crank goes down"),
    _part("main_journal_y", "F_{H,y}", "upward load of the main journals, away from the crank"),
    _part("main_journal_radial", "F_{H,r}", "load of the main journals along crank 1, outwards",
          "engine"),
    _part("main_journal_tangential", "F_{H,t}",
          "load of the main journals across crank 1, in the sense of rotation", "engine"),
)  # fmt: skip

NODES: tuple[Node, ...] = (*_SERIES, *_FORCES, *_HARMONICS, *_ORDERS, *_BEARINGS)
"""Everything of this module; quantities of scenes are the public ones."""
