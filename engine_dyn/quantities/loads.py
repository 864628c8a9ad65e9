"""Nodes of load and driver: k, the driver's factor, torques at nominal and at solved speed.

Those of tables alone stand in `engine_dyn.quantities.features.torque_tables`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from engine_dyn.loads import driven_machine
from engine_dyn.loads.laws import LOAD_LAWS, LawFacts
from engine_dyn.quantities.node import Node, formula, power, quotient, variants

_BY_NUMBERS = tuple(law for law in LOAD_LAWS.values() if law.factored)
"""Laws of a load that numbers give, but for a + k omega^alpha, whose k has another unit."""

_SHAPED = {
    "table no_driver": "table", **{law.name: "law" for law in _BY_NUMBERS}
}  # fmt: skip
"""Cases in which k is a factor on the torque of a table or of one of those laws."""


def load_coefficient_unit(exponent: float) -> str | None:
    """Unit of k where the exponent is a whole number, None otherwise (UDUNITS reads no other)."""
    if exponent == 0.0:
        return "N m"
    if exponent == math.floor(exponent):
        return "N m s" if exponent == 1.0 else f"N m s{int(exponent)}"
    return None


def _at_nominal(law: LawFacts) -> Node:
    """Return the node of a law's torque at nominal speed."""

    def torque(speed: Any, **needs: Any) -> Any:
        assert law.torque is not None
        return law.torque(speed, *(needs[name] for name in law.needs))[0]

    return Node(
        "shape_at_nominal", "", "N m", "torque of the load's law at nominal speed, over k",
        public=False, when=law.name, needs=("speed", *law.needs), make=torque,
    )  # fmt: skip


NO_TORQUE = -math.inf  # Marks a torque that neither load nor driver has at the nominal speed


def _opposed_torque(when: str, sign: float = 1.0) -> Node:
    """Return the node of the surplus that load or driver can balance."""

    def make(
        load_surplus: Any, torque_mean: Any, friction_in_balance: Any, load_constant: Any,
        shape_at_nominal: Any = 1.0,
    ) -> Any:  # fmt: skip
        shape = np.asarray(sign * shape_at_nominal)
        size = np.abs(torque_mean) + np.abs(friction_in_balance) + np.abs(load_constant)
        lack = (torque_mean - load_constant) * np.sign(shape)
        # Below this fraction of the mean torques of engine, friction and load, a torque is none.
        return np.where((lack < -1e-9 * size) | (shape == 0.0), NO_TORQUE, load_surplus)

    shape = () if when == "power_law" else ("shape_at_nominal",)
    return Node(
        "opposed_torque", "", "N m",
        "mean torque that load or driver balance at nominal speed; -inf where they cannot",
        public=False, when=when, make=make,
        needs=("load_surplus", "torque_mean", "friction_in_balance", "load_constant", *shape),
    )  # fmt: skip


_LOAD_TORQUE = "load torque at the solved speed, positive against the rotation"

_DRIVER_TORQUE = (
    "driver torque at the solved speed, positive in the sense of rotation, 0 without a driver"
)


def _load_torque(law: LawFacts) -> Node:
    """Return the node of a law's load torque at the solved speed."""

    def torque(load_over_angle: Any, load_coefficient: Any, omega: Any, **needs: Any) -> Any:
        assert law.torque is not None
        shape, _ = law.torque(omega, *(needs[name] for name in law.needs))
        return load_over_angle + load_coefficient * shape

    return Node(
        "load_torque", "M_L", "N m", _LOAD_TORQUE, "Kakaitsas eq. 3.4",
        kind="curve", when=law.name,
        needs=("load_over_angle", "load_coefficient", "omega", *law.needs), make=torque,
    )  # fmt: skip


NODES: tuple[Node, ...] = (
    *variants(
        Node("friction_in_balance", "", "N m", "friction torque, 0 in a given torque, which lacks "
             "it already", public=False),
        {
            "by_pressure": lambda friction_torque: friction_torque,
            "by_torque": lambda: 0.0,
        },
    ),
    *variants(
        Node("load_surplus", "", "N m",
             "mean torque to be balanced by the speed-dependent load or the driver", public=False),
        {
            "power_mean": lambda torque_mean, load_constant: torque_mean - load_constant,
            "cycle_time": lambda torque_mean, load_constant, load_factor:
            load_factor * (torque_mean - load_constant),
        },
    ),
    *(_opposed_torque(when) for when in ("power_law", *_SHAPED)),
    *(_opposed_torque(when, -1.0) for when in ("table with_driver", "motor")),
    Node(
        "synchronous_speed", "", "rad s-1",
        "driving motor: synchronous speed, referred to the crankshaft",
        public=False, make=lambda motor_synchronous_speed, motor_gear_ratio: motor_synchronous_speed
        / motor_gear_ratio,
    ),
    Node(
        "breakdown_torque", "", "N m",
        "driving motor: breakdown torque, referred to the crankshaft",
        public=False, make=lambda motor_breakdown_torque, motor_gear_ratio: motor_gear_ratio
        * motor_breakdown_torque,
    ),
    Node(
        "shape_at_nominal", "", "N m", "torque of the driving motor at nominal speed",
        public=False, when="motor",
        **formula(driven_machine.motor_torque, "speed", "synchronous_speed", "motor_breakdown_slip",
                  "breakdown_torque"),
    ),
    Node(
        "load_coefficient", "k", "", "coefficient of the speed-dependent load torque",
        "Kakaitsas eq. 3.5", when="power_law steady_load power_mean",
        make=lambda torque_mean, load_offset, speed, load_exponent: (torque_mean - load_offset)
        / power(speed, load_exponent),
    ),
    Node(
        "load_coefficient", "k", "", "coefficient of the speed-dependent load torque",
        "Kakaitsas eq. 3.5 with the solved speed", when="power_law steady_load cycle_time",
        make=lambda torque_mean, load_offset, speed, load_exponent, load_factor: load_factor
        * (torque_mean - load_offset) / power(speed, load_exponent),
    ),
    Node(
        "load_coefficient", "k", "", "coefficient of the speed-dependent load torque",
        "Kakaitsas eq. 3.5 with the mean of the load over angle", when="power_law angle_load",
        make=lambda load_surplus, speed, load_exponent: load_surplus / power(speed, load_exponent),
    ),
    *(
        Node(
            "load_coefficient", "k", "1", f"factor on the load's {what} over speed",
            "Kakaitsas eq. 3.5 with a table", when=when,
            **formula(quotient, "load_surplus", "shape_at_nominal"),
        )
        for when, what in _SHAPED.items()
    ),
    Node(
        "load_coefficient", "k", "1",
        "coefficient of the speed-dependent load torque, 0 with a driver",
        "this project", when="with_driver", make=lambda: 0.0,
    ),
    *variants(
        Node("driver_factor", "f_D", "1", "factor on the driver's torque, 0 without a driver",
             "this project"),
        {
            "with_driver": lambda load_surplus, shape_at_nominal:
            -quotient(load_surplus, shape_at_nominal),
            "no_driver": lambda: 0.0,
        },
    ),
    *variants(
        Node("driver_torque", "M_D", "N m", _DRIVER_TORQUE, "this project", kind="curve"),
        {
            "no_driver": lambda: 0.0,
            "table with_driver": lambda driver_factor, driven, omega:
            driver_factor * driven.over_speed(omega),
        },
    ),
    Node(
        "driver_torque", "M_D", "N m", _DRIVER_TORQUE,
        "Kloss's formula", kind="curve", when="motor",
        make=lambda driver_factor, omega, synchronous_speed, motor_breakdown_slip,
        breakdown_torque: driver_factor * driven_machine.motor_torque(
            omega, synchronous_speed, motor_breakdown_slip, breakdown_torque
        ),
    ),
    Node(
        "load_torque_nominal", "k\\omega_n^\\alpha", "N m",
        "speed-dependent part of the load torque at nominal speed", "Kakaitsas eq. 3.4",
        when="power_law",
        make=lambda load_coefficient, speed, load_exponent: load_coefficient
        * power(speed, load_exponent),
    ),
    *(
        Node(
            "load_torque_nominal", "k T(\\omega_n)", "N m",
            "speed-dependent part of the load torque at nominal speed",
            "Kakaitsas eq. 3.4 with a table", when=when,
            make=lambda load_coefficient, shape_at_nominal: load_coefficient * shape_at_nominal,
        )
        for when in _SHAPED
    ),
    *(node for law in _BY_NUMBERS for node in (_at_nominal(law), _load_torque(law))),
    Node(
        "load_torque_nominal", "k\\omega_n^\\alpha", "N m",
        "speed-dependent part of the load torque at nominal speed, 0 with a driver", "this project",
        when="with_driver", make=lambda: 0.0,
    ),
    *variants(
        Node("load_torque", "M_L", "N m", _LOAD_TORQUE, "Kakaitsas eq. 3.4", kind="curve"),
        {
            "power_law steady_load": lambda load_offset, load_coefficient, omega, load_exponent:
            load_offset + load_coefficient * power(omega, load_exponent),
            "power_law angle_load": lambda load_over_angle, load_coefficient, omega, load_exponent:
            load_over_angle + load_coefficient * power(omega, load_exponent),
        },
    ),
    Node(
        "load_torque", "M_L", "N m", _LOAD_TORQUE,
        "Kakaitsas eq. 3.4 with a table", kind="curve", when="table no_driver",
        make=lambda load_over_angle, load_coefficient, omega, driven, load_gear: load_over_angle
        + load_coefficient * load_gear * driven.over_speed(load_gear * omega),
    ),
    Node(
        "load_torque", "M_L", "N m",
        "load torque, positive against the rotation, independent of speed", "this project",
        kind="curve", when="with_driver", make=lambda load_over_angle: load_over_angle,
    ),
)  # fmt: skip
