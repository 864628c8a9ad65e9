"""Nodes of the torque: gas, inertia and all of it over the crank angle, its mean and extremes."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine_dyn.forces import shaft_torque, torque
from engine_dyn.quantities.features.torque_tables import OF_ANGLE
from engine_dyn.quantities.friction import gas_of, stroke_friction, train_of
from engine_dyn.quantities.node import Node, balance_of, formula, hidden, quotient
from engine_dyn.quantities.speed import OF_CYLINDERS, OF_TORQUE, for_given_torque, kernel_inputs
from engine_dyn.speed.fields import FRICTION_NAMES, TORQUE_NAMES, TORQUE_RESULTS

_OF_CYLINDERS = (*OF_CYLINDERS, "speed", "tolerance")

_INDICATED = {"indicated_torque_max": "torque_max", "indicated_torque_min": "torque_min"}
"""Names of the extremes of the torque without friction, and the kernel's names of them."""


def _torque_solution(**needs: Any) -> Any:
    from engine_dyn.speed.torque import torque_extremes

    return torque_extremes(**kernel_inputs(needs))


def _solution(when: str, *needs: str, make: Any = _torque_solution) -> Node:
    """Return the stage that finds the extremes of the torque."""
    return Node(
        "torque_solution", "", "", "extremes of the torque at nominal speed, and of its work",
        kind="stage", public=False, gives=TORQUE_NAMES, when=when,
        needs=tuple(dict.fromkeys(needs)), make=make,
    )  # fmt: skip


_GIVEN = (*OF_TORQUE, "speed", "tolerance")


def _indicated_solution(**needs: Any) -> Any:
    extremes = _torque_solution(
        **{**needs, "friction_torque": 0.0, "wanted": list(_INDICATED.values())}
    )
    return {name: extremes[kernels] for name, kernels in _INDICATED.items()}


def _torque_result(name: str, symbol: str, unit: str, long_name: str, source: str) -> Node:
    extremes = {
        "torque_max": ("torque", "largest"), "torque_min": ("torque", "smallest"),
        "energy_swing": ("excess_energy", "range"),
    }  # fmt: skip
    return Node(name, symbol, unit, long_name, source, needs=("torque_solution",),
                extreme_of=extremes[name])  # fmt: skip


def _torque_after_throw(*, crank_angle: Any, bore: Any, **needs: Any) -> Any:
    friction = stroke_friction(needs)
    uniform = not any(np.any(level) for level in friction.levels)
    return torque.torque_after_throw(
        crank_angle, train_of(needs), bore, gas_of(needs), needs["reciprocating_mass"],
        needs["speed"], needs["friction_torque"], None if uniform else friction,
    )  # fmt: skip


def _shaft_extremes(
    *, family: Any, cylinders_by_count: Any, curve_period: Any, **needs: Any
) -> Any:
    friction = stroke_friction(needs)
    numbers = {**needs, **{f"friction_{i}": level for i, level in enumerate(friction)}}
    return shaft_torque.shaft_torque_extremes(numbers, family, cylinders_by_count, curve_period)


NODES: tuple[Node, ...] = (
    _solution("by_pressure steady_load", *_OF_CYLINDERS, "driven"),
    _solution("by_pressure angle_load", *_OF_CYLINDERS, "driven", *OF_ANGLE),
    _solution("by_torque steady_load", *_GIVEN, make=for_given_torque(_torque_solution)),
    _solution("by_torque angle_load", *_GIVEN, *OF_ANGLE, make=for_given_torque(_torque_solution)),
    *(_torque_result(*row) for row in TORQUE_RESULTS),
    Node(
        "indicated_torque_mean", "", "N m",
        "mean indicated torque over the cycle, without friction",
        public=False, make=lambda mean_gas, pressure_scale, bore, double_radius, cylinders:
        cylinders * torque.piston_area(bore) * 0.5 * double_radius * pressure_scale * mean_gas,
    ),
    Node(
        "torque_mean", "M_{mean}", "N m", "mean brake torque over the cycle", "Kakaitsas eq. 3.5",
        when="by_pressure", **formula(balance_of, "indicated_torque_mean", "friction_torque"),
    ),
    Node(
        "torque_mean", "M_{mean}", "N m", "mean brake torque over the cycle", "as given",
        when="by_torque", make=lambda torque_factor, driven, auxiliary_mean: torque_factor
        * driven.engine_torque.mean - auxiliary_mean,
    ),
    Node(
        "torque_range", "M_{max}-M_{min}", "N m", "range of the torque at nominal speed",
        "Kakaitsas section 5.4", make=lambda torque_max, torque_min: torque_max - torque_min,
    ),
    Node(
        "torque_ratio", "M_{max}/M_{mean}", "1", "ratio of largest to mean torque",
        "Kakaitsas section 5.4", **formula(quotient, "torque_max", "torque_mean"),
    ),
    Node(
        "indicated_torque_solution", "", "", "extremes of the indicated torque",
        kind="stage", public=False, gives=tuple(_INDICATED), needs=tuple(
            n for n in _OF_CYLINDERS if n not in (*FRICTION_NAMES, "friction_torque")
        ),
        make=_indicated_solution,
    ),
    *(
        Node(name, "", "N m", f"{which} indicated torque at nominal speed", public=False,
             needs=("indicated_torque_solution",))
        for name, which in zip(_INDICATED, ("largest", "smallest"), strict=True)
    ),
    Node(
        "indicated_torque_range", "", "N m", "range of the indicated torque", public=False,
        when="uniform_friction steady_auxiliaries", make=lambda torque_range: torque_range,
    ),
    *(
        Node(
            "indicated_torque_range", "", "N m", "range of the indicated torque", public=False,
            when=when,
            make=lambda indicated_torque_max, indicated_torque_min: indicated_torque_max
            - indicated_torque_min,
        )
        for when in ("stroke_friction", "uniform_friction angle_auxiliaries")
    ),
    Node(
        "torque_irregularity", r"\mu", "1",
        "coefficient of torque irregularity, range over mean of the indicated torque",
        "Power units, lecture 18",
        **formula(quotient, "indicated_torque_range", "indicated_torque_mean"),
    ),
    Node(
        "torque_irregularity_brake", r"\mu_e", "1",
        "coefficient of torque irregularity, range over mean of the brake torque",
        "after Power units, lecture 18", **formula(quotient, "torque_range", "torque_mean"),
    ),
    Node(
        "brake_power", "P_e", "W", "brake power at nominal speed",
        "Power units, lecture 18: M = 9550 N_e/n",
        make=lambda torque_mean, speed: torque_mean * speed,
    ),
    Node(
        "gas_torque", "M_g", "N m", "gas torque, positive in the sense of rotation, all cylinders",
        "Kakaitsas eq. 2.6", kind="curve",
        needs=("crank_angle", "crank_ratio", "family", "row", "pressure_scale",
               "crankcase_pressure", "bore", "double_radius", "cylinder_set", "period",
               "offset_ratio", "cylinders_by_count"),
        make=lambda crank_angle, bore, **needs: torque.gas_torque(
            crank_angle, train_of(needs), bore, gas_of(needs)
        ),
    ),
    Node(
        "inertia_torque", "M_l", "N m",
        "inertia torque of the reciprocating masses at nominal speed, positive in the sense of "
        "rotation, all cylinders",
        "Kakaitsas eqs. 2.12, 2.13", kind="curve",
        needs=("crank_angle", "crank_ratio", "reciprocating_mass", "double_radius", "speed",
               "cylinder_set", "period", "offset_ratio", "cylinders_by_count"),
        make=lambda crank_angle, reciprocating_mass, speed, **needs: torque.inertia_torque(
            crank_angle, train_of(needs), reciprocating_mass, speed
        ),
    ),
    Node(
        "inertia_torque_actual", "M_{l,act}", "N m",
        "inertia torque of the reciprocating masses at the solved speed, positive in the sense of "
        "rotation, all cylinders",
        "Eksergian's equation", kind="curve",
        needs=("crank_angle", "crank_ratio", "reciprocating_mass", "double_radius", "omega",
               "angular_acceleration", "cylinder_set", "period", "offset_ratio",
               "cylinders_by_count"),
        make=lambda crank_angle, reciprocating_mass, omega, angular_acceleration, **needs:
        torque.inertia_torque_actual(
            crank_angle, train_of(needs), reciprocating_mass, omega, angular_acceleration
        ),
    ),
    Node(
        "torque", "M", "N m", "engine torque at nominal speed, positive in the sense of rotation",
        "Kakaitsas eq. 3.3", kind="curve", when="by_pressure uniform_friction",
        make=lambda gas_torque, inertia_torque, friction_torque, auxiliary_swing: gas_torque
        + inertia_torque - friction_torque - auxiliary_swing,
    ),
    Node(
        "torque", "M", "N m", "engine torque at nominal speed, positive in the sense of rotation",
        "Kakaitsas eq. 3.3", kind="curve", when="by_pressure stroke_friction",
        make=lambda gas_torque, inertia_torque, instantaneous_friction_torque: gas_torque
        + inertia_torque - instantaneous_friction_torque,
    ),
    Node(
        "torque", "M", "N m", "engine torque at nominal speed, positive in the sense of rotation",
        "as given", kind="curve", when="by_torque",
        make=lambda crank_angle, torque_factor, driven, auxiliary_mean, auxiliary_swing:
        torque_factor * driven.engine_torque(crank_angle) - (auxiliary_mean + auxiliary_swing),
    ),
    Node(
        "torque_after_throw", "T_i", "N m",
        "torque in the shaft after each throw, summed from the last throw to the take-off at throw "
        "1, positive in the sense of rotation",
        "Kakaitsas section 5.4", kind="curve", adds=("throw",), throws=True,
        needs=("crank_angle", "crank_ratio", "family", "row", "pressure_scale",
               "crankcase_pressure", "bore", "double_radius", "reciprocating_mass", "speed",
               "friction_torque", "cylinder_set", "cylinders_by_count", "offset_ratio",
               "period", *FRICTION_NAMES),
        make=_torque_after_throw,
    ),
    hidden(
        "shaft_torque_extremes", "N m", "extremes of the torque along the shaft",
        _shaft_extremes,
        ("crank_ratio", "double_radius", "offset_ratio", "bore", "row", "pressure_scale",
         "crankcase_pressure", "reciprocating_mass", "speed", "friction_torque", "cylinder_set",
         *FRICTION_NAMES, "family", "cylinders_by_count", "curve_period"),
        throws=True, width=shaft_torque.EXTREMES.itemsize,
    ),
    Node(
        "torque_after_throw_range", r"\Delta T_{i,max}", "N m",
        "largest range of the torque along the shaft, after any throw",
        "after Kakaitsas section 5.4", extreme_of=("torque_after_throw", "range"),
        make=lambda shaft_torque_extremes: shaft_torque_extremes["range"],
    ),
    Node(
        "first_mode_torque_rms", r"M_{1,rms}^{\beta}", "N m",
        "root mean square of the torque that excites the first torsional mode, without its mean, "
        "equal throws on a uniform shaft fixed at the take-off",
        "phase vectors in the mode of a uniform shaft, derived here",
        make=lambda shaft_torque_extremes: shaft_torque_extremes["rms"],
    ),
)  # fmt: skip
