"""Nodes of the orders of the torque and of the piston's motion.

See `engine_dyn.forces.harmonics` and `engine_dyn.geometry.kinematic_series`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from engine_dyn.forces import harmonics, torque
from engine_dyn.geometry import kinematic_series
from engine_dyn.geometry.cylinders import EQUAL
from engine_dyn.loads import driven_machine
from engine_dyn.quantities.friction import gas_of, stroke_friction
from engine_dyn.quantities.node import Node, formula, hidden
from engine_dyn.speed.fields import FRICTION_NAMES
from engine_dyn.units import DEGREE

NOTES = "Rakopoulos notes"

EVERY = "every_"  # Prefix of names of harmonics of all orders, which the vibration of a shaft needs


def _motion(every: str = "") -> tuple[str, ...]:
    return f"{every}order", "crank_ratio", "offset_ratio"


_COUNTED = ("cylinder_set", "cylinders_by_count")


def _harmonic(name: str, unit: str, long_name: str, needs: tuple[str, ...], make: Any,
              **more: Any) -> Node:  # fmt: skip
    return hidden(name, unit, long_name, make, needs, width=16, **more)


def _gravity(scope: str, first_only: bool) -> Node:
    def make(**needs: Any) -> Any:
        return harmonics.gravity_harmonics(
            needs["order"], needs["crank_ratio"], needs["reciprocating_mass"],
            needs["journal_rod_mass"], 0.5 * needs["double_radius"], needs["cylinder_set"],
            needs["cylinders_by_count"], needs["offset_ratio"], first_only,
            needs["journal_throw_mass"], needs["engine_inclination"], needs["web_unbalance"],
        )  # fmt: skip

    return _harmonic(
        f"{scope}gravity_torque_harmonics", "N m", "harmonics of the gravity torque",
        (*_motion(), "reciprocating_mass", "journal_rod_mass", "journal_throw_mass",
         "double_radius", "engine_inclination", "web_unbalance", *_COUNTED), make,
    )  # fmt: skip


def _polar(scope: str, what: str, symbol: str, long_name: str) -> list[Node]:
    """Nodes of amplitude and phase of harmonics."""
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


_PARTS: dict[str, tuple[str, str, tuple[str, ...], Callable[[dict[str, Any]], harmonics.Part]]] = {
    "gas": (
        "Pa", "pressure times reduced piston velocity", ("row", "family", "period"),
        lambda needs: harmonics.gas_part(
            needs["row"], needs["family"], needs["period"], needs["threads"]
        ),
    ),
    "speed": ("1", "the reduced piston velocity", (), lambda _: harmonics.VELOCITY),
    "inertia": ("1", "the inertia torque over m r^2 omega^2", (), lambda _: harmonics.INERTIA),
}  # fmt: skip
"""Parts of the torque: unit, meaning, needs besides the motion, and function of the part."""

_SCOPES: dict[str, tuple[str, tuple[str, ...], tuple[str, ...], Any]] = {
    "cylinder_": ("cylinder 1", (), (), harmonics.of_first),
    "": ("all cylinders", (), ("phase_vectors",), harmonics.of_engine),
    "first_mode_": (
        "first mode of the shaft", (), ("first_mode_phase_vectors",), harmonics.of_first_mode
    ),
    "throw_": ("each throw", ("throw",), ("throw_phase_vectors",), harmonics.of_throws),
}  # fmt: skip
"""Scopes of harmonics: owner, further dimension, phase vectors for equal cylinders, sum."""


def _of_equal(part: str, every: str = "") -> Node:
    """Node of the harmonics of one of equal cylinders."""
    unit, text, more, made = _PARTS[part]

    def make(**needs: Any) -> Any:
        return made(needs).single(
            needs[f"{every}order"], needs["crank_ratio"], needs["offset_ratio"], EQUAL
        )

    return _harmonic(f"{every}{part}_harmonics", unit, f"harmonics of {text}",
                     (*_motion(every), *more), make, threaded=part == "gas")  # fmt: skip


def _of_scope(scope: str, part: str, every: str = "") -> list[Node]:
    """Nodes of a torque part's harmonics: from one of equal cylinders, or from each cylinder."""
    throws = scope == "first_mode_"
    unit, text, more, made = _PARTS[part]
    whose, dimension, vectors, add = _SCOPES[scope]
    vectors = tuple(f"{every}{name}" for name in vectors)
    name, one = f"{every}{scope or 'engine_'}{part}_sum", f"{every}{part}_harmonics"

    def of_one_cylinder(**needs: Any) -> Any:
        return needs[one] * needs[vectors[0]] if vectors else needs[one]

    def summed(**needs: Any) -> Any:
        arguments = (*_motion(every), *_COUNTED, *dimension)
        return add(made(needs), *(needs[argument] for argument in arguments))

    text = f"harmonics of {text}, {whose}"
    return [
        _harmonic(name, unit, text, (one, *vectors), of_one_cylinder, when="equal", throws=throws),
        _harmonic(name, unit, text, (*_motion(every), *more, *_COUNTED, *dimension), summed,
                  when="unequal", threaded=part == "gas", throws=throws),
    ]  # fmt: skip


def _complex_torques(scope: str) -> list[Node]:
    """Nodes of gas, inertia and total torque harmonics of one cylinder, all, or each throw."""
    whose = _SCOPES[scope][0]
    work, speed, inertia = (f"{scope or 'engine_'}{part}_sum" for part in _PARTS)
    names = [f"{scope}{what}torque_harmonics" for what in ("gas_", "inertia_", "")]

    def gas(**needs: Any) -> Any:
        lever = torque.piston_area(needs["bore"]) * 0.5 * needs["double_radius"]
        work_of_gas = needs["pressure_scale"] * needs[work]
        return lever * (work_of_gas - needs["crankcase_pressure"] * needs[speed])

    def masses_torque(**needs: Any) -> Any:
        moment = needs["reciprocating_mass"] * (0.5 * needs["double_radius"] * needs["speed"]) ** 2
        return moment * needs[inertia]

    def total(**needs: Any) -> Any:
        return needs[names[0]] + needs[names[1]] - needs.get("auxiliary_harmonics", 0.0)

    return [
        _harmonic(
            names[0], "N m", f"harmonics of the gas torque, {whose}",
            (work, speed, "pressure_scale", "crankcase_pressure", "bore", "double_radius"), gas,
        ),
        _harmonic(
            names[1], "N m", f"harmonics of the inertia torque, {whose}",
            (inertia, "reciprocating_mass", "double_radius", "speed"), masses_torque,
        ),
        _harmonic(names[2], "N m", f"harmonics of the torque, {whose}",
                  (*names[:2], *(() if scope else ("auxiliary_harmonics",))), total,
                  when="" if scope else "by_pressure"),
    ]  # fmt: skip


def _of_auxiliaries(every: str = "") -> tuple[Node, Node]:
    def make(*, driven: Any, period: Any, **order: Any) -> Any:
        (nu,) = order.values()
        return driven_machine.harmonics_of_load(driven.auxiliaries, nu, period)

    name, text = f"{every}auxiliary_harmonics", "harmonics of the torque of auxiliaries"
    return (
        _harmonic(name, "N m", text, ("driven", "period", f"{every}order"), make,
                  when="angle_auxiliaries"),
        _harmonic(name, "N m", text, (), lambda: 0.0, when="steady_auxiliaries"),
    )  # fmt: skip


def _throw_friction(
    *, every_order: Any, crank_ratio: Any, offset_ratio: Any, cylinder_set: Any,
    cylinders_by_count: Any, throw: Any, period: Any, **needs: Any,
) -> Any:  # fmt: skip
    part = harmonics.friction_part(gas_of(needs), stroke_friction(needs), period)
    return harmonics.of_throws(
        part, every_order, crank_ratio, offset_ratio, cylinder_set, cylinders_by_count, throw
    )


def _of_shaft() -> list[Node]:
    """Nodes of harmonics of all orders, for everything that acts on a shaft."""
    friction, load = (f"{EVERY}{what}" for what in ("throw_friction_sum", "load_harmonics"))
    of_friction = "harmonics of the friction of each throw, over piston area and crank radius"
    of_load = "harmonics of the load over angle, at the speed of the crank over the load's"
    return [
        _throw_vectors(EVERY),
        *(_of_equal(part, EVERY) for part in _PARTS),
        *(node for part in _PARTS for node in _of_scope("throw_", part, EVERY)),
        *_of_auxiliaries(EVERY),
        _harmonic(friction, "Pa", of_friction, (), lambda: 0.0, when="uniform_friction"),
        _harmonic(
            friction, "Pa", of_friction,
            (*_motion(EVERY), *_COUNTED, "throw", "period", "family", "row", "pressure_scale",
             "crankcase_pressure", *FRICTION_NAMES), _throw_friction, when="stroke_friction",
        ),
        _harmonic(load, "N m", of_load, (), lambda: 0.0, when="steady_load"),
        _harmonic(
            load, "N m", of_load, ("driven", "load_gear", "load_phase", "period", "every_order"),
            lambda driven, load_gear, load_phase, period, every_order:
            driven_machine.harmonics_of_load(
                driven.over_angle, every_order, period, load_gear, load_phase
            ), when="angle_load",
        ),
    ]  # fmt: skip


def _throw_vectors(every: str = "") -> Node:
    return _harmonic(
        f"{every}throw_phase_vectors", "1", "sum of the phase vectors on each throw",
        **formula(harmonics.throw_phase_vectors, f"{every}order", *_COUNTED, "throw"),
    )  # fmt: skip


def _of_given_torque(*, torque: Any, crank_angle: Any, order: Any) -> Any:
    # The axis of orders, of length 1 here, comes before the axis of the crank angle.
    return harmonics.of_curve(
        np.asarray(torque)[..., 0, :], np.ravel(crank_angle), np.ravel(order)
    )  # fmt: skip


_FIRST_MODE = "phase vectors in the mode of a uniform shaft, derived here"

NODES: tuple[Node, ...] = (
    *(_of_equal(part) for part in _PARTS),
    _harmonic(
        "phase_vectors", "1", "sum of the phase vectors of all cylinders",
        **formula(harmonics.phase_vectors, "order", *_COUNTED),
    ),
    _harmonic(
        "first_mode_phase_vectors", "1",
        "sum of the phase vectors of all cylinders, weighted by the shaft's first mode",
        **formula(harmonics.first_mode_phase_vectors, "order", *_COUNTED), throws=True,
    ),
    _throw_vectors(),
    *(node for scope in _SCOPES for part in _PARTS for node in _of_scope(scope, part)),
    *(node for scope in _SCOPES for node in _complex_torques(scope)),
    _harmonic(
        "torque_harmonics", "N m", "harmonics of the torque, all cylinders",
        ("torque", "crank_angle", "order"), _of_given_torque, when="by_torque",
        removes=("crank_angle",),
    ),
    *_of_auxiliaries(),
    *_of_shaft(),
    _gravity("", False),
    _gravity("cylinder_", True),
    Node(
        "order_frequency", r"f_\nu", "Hz", "frequency of the orders at nominal speed",
        f"{NOTES}, harmonics of the tangential force",
        make=lambda order, speed: order * speed / (2.0 * np.pi),
    ),
    Node(
        "phase_vector_sum", r"|\sum e^{i\nu\psi_k}|", "1",
        "sum of the cylinders' phase vectors, 0 where an order cancels, Z where it is major",
        f"{NOTES}, engines with several cylinders",
        make=lambda phase_vectors: np.abs(phase_vectors),
    ),
    Node(
        "first_mode_vector_sum", r"|\sum \beta_k e^{i\nu\psi_k}|", "1",
        "sum of the cylinders' phase vectors in the first torsional mode, equal throws on a "
        "uniform shaft fixed at the take-off, mode shape 1 at the last throw",
        _FIRST_MODE, make=lambda first_mode_phase_vectors: np.abs(first_mode_phase_vectors),
    ),
    Node(
        "first_mode_torque_order", r"M_{1,\nu}^\beta", "N m",
        "amplitude of the orders of the torque that excites the first torsional mode, equal "
        "throws on a uniform shaft fixed at the take-off",
        _FIRST_MODE, make=lambda first_mode_torque_harmonics: np.abs(first_mode_torque_harmonics),
    ),
    *_polar("", "gas_torque", r"M_{g,\nu}", "gas torque, all cylinders"),
    *_polar("", "inertia_torque", r"M_{l,\nu}", "inertia torque, all cylinders"),
    *_polar("", "gravity_torque", r"M_{G,\nu}", "gravity torque, all cylinders"),
    *_polar("", "torque", r"M_{\nu}",
            "torque of gas and reciprocating masses, with auxiliaries, all cylinders"),
    *_polar("cylinder_", "gas_torque", r"M_{g1,\nu}", "gas torque, cylinder 1"),
    *_polar("cylinder_", "inertia_torque", r"M_{l1,\nu}", "inertia torque, cylinder 1"),
    *_polar("cylinder_", "gravity_torque", r"M_{G1,\nu}", "gravity torque, cylinder 1"),
    *_polar("cylinder_", "torque", r"M_{1,\nu}",
            "torque of gas and reciprocating masses, cylinder 1"),
    *_polar("throw_", "torque", r"M_{j,\nu}",
            "torque on each throw, of gas and reciprocating masses, along the shaft"),
)  # fmt: skip

MOSAKOWSKI = "Mosakowski"


def _of_centred(
    name: str, symbol: str, long_name: str, source: str, function: Callable[..., Any], *needs: str,
    kind: str = "value",
) -> Node:  # fmt: skip
    """Node of a centred mechanism, whose `function` takes its needs in this order."""

    def make(*, offset_ratio: Any, **given: Any) -> Any:
        if np.any(offset_ratio):
            raise ValueError(
                f"{name} is that of a centred mechanism; pin_offset and crank_offset must add up "
                "to 0"
            )
        return function(*(given[need] for need in needs))

    return Node(name, symbol, "1", long_name, source, kind=kind, make=make,
                needs=(*needs, "offset_ratio"))  # fmt: skip


SERIES_NODES: tuple[Node, ...] = (
    _of_centred(
        "position_coefficient", r"a_\nu",
        "coefficients of cos(nu phi) in the reduced piston travel",
        f"{MOSAKOWSKI} eq. 7 (A = -a), {NOTES}", kinematic_series.position_coefficients,
        "order", "crank_ratio",
    ),
    _of_centred(
        "velocity_coefficient", r"\gamma_\nu",
        "coefficients of sin(nu phi) in the reduced piston velocity",
        f"{MOSAKOWSKI} eq. 5, {NOTES}", kinematic_series.velocity_coefficients,
        "order", "crank_ratio",
    ),
    _of_centred(
        "acceleration_coefficient", r"\beta_\nu",
        "coefficients of cos(nu phi) in the reduced piston acceleration",
        f"{MOSAKOWSKI} eq. 6, {NOTES}", kinematic_series.acceleration_coefficients,
        "order", "crank_ratio",
    ),
    _of_centred(
        "inertia_torque_coefficient", r"\Delta T_\nu",
        "coefficients of sin(nu phi) in the reduced inertia torque, over m r^2 omega^2, one "
        "cylinder",
        f"{NOTES}, Delta T_l", kinematic_series.inertia_torque_coefficients,
        "order", "crank_ratio",
    ),
    _of_centred(
        "position_mean", "a_0", "mean of the reduced piston travel over a turn", f"{NOTES}, a0",
        kinematic_series.mean_position, "crank_ratio",
    ),
    _of_centred(
        "position_truncated", r"\tilde x/r", "reduced piston travel by the truncated series",
        f"{MOSAKOWSKI} eqs. 9, 17", kinematic_series.truncated_position,
        "crank_angle", "crank_ratio", "truncation", kind="curve",
    ),
    _of_centred(
        "velocity_truncated", r"\tilde c/(r\omega)",
        "reduced piston velocity by the truncated series",
        f"{MOSAKOWSKI} eqs. 12, 17", kinematic_series.truncated_velocity,
        "crank_angle", "crank_ratio", "truncation", kind="curve",
    ),
    _of_centred(
        "acceleration_truncated", r"\tilde b/(r\omega^2)",
        "reduced piston acceleration by the truncated series",
        f"{MOSAKOWSKI} eqs. 13, 18", kinematic_series.truncated_acceleration,
        "crank_angle", "crank_ratio", "truncation", kind="curve",
    ),
    *(
        _of_centred(
            f"{what}_truncation_error", symbol, f"truncation error of the {text}",
            source, partial(kinematic_series.truncation_error, derivative=derivative),
            "crank_ratio", "truncation",
        )
        for derivative, (what, symbol, text, source) in enumerate((
            ("position", r"\Delta x/s", "travel, largest error over the stroke",
             f"after {MOSAKOWSKI} eq. 16"),
            ("velocity", r"\Delta c/c_{max}", "velocity, largest error over largest velocity",
             f"after {MOSAKOWSKI} eq. 16"),
            ("acceleration", r"\Delta b/b_{max}",
             "acceleration, largest error over largest acceleration", f"{MOSAKOWSKI} eq. 16"),
        ))
    ),
)  # fmt: skip
