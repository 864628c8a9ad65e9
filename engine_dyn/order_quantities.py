"""The nodes of the orders of the torque, as plain data.

Part of the table in `engine_dyn.quantities`, which see.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine_dyn import forces, harmonics, mechanism
from engine_dyn.node import DEGREE, Node, hidden

__all__ = ["NODES"]

NOTES = "Rakopoulos notes"

COMPLEX = 16
"""Bytes of a harmonic."""

_MOTION = ("order", "crank_ratio", "offset_ratio")


def _gas_torque_of(work: Any, speed: Any, pressure_scale: Any, crankcase_pressure: Any, bore: Any,
                   throw: Any) -> Any:  # fmt: skip
    lever = forces.piston_area(bore) * 0.5 * throw
    return lever * (pressure_scale * work - crankcase_pressure * speed)


_COUNTED = ("cylinder_set", "cylinders_by_count")
_GAS = ("pressure_scale", "crankcase_pressure", "bore", "throw")


def _harmonic(name: str, unit: str, long_name: str, needs: tuple[str, ...], make: Any,
              **more: Any) -> Node:  # fmt: skip
    return hidden(name, unit, long_name, needs, make, width=COMPLEX, **more)


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
        (*_MOTION, "reciprocating_mass", "rotating_mass", "throw", *_COUNTED), make,
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
        "speed_harmonics", "1", "harmonics of the reduced piston velocity", _MOTION,
        lambda order, crank_ratio, offset_ratio: harmonics.velocity_harmonics(
            order, crank_ratio, offset_ratio
        ),
    ),
    _harmonic(
        "inertia_harmonics", "1", "harmonics of the inertia torque over m r^2 omega^2",
        _MOTION,
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

NODES: tuple[Node, ...] = (*_HARMONICS, *_ORDERS)
