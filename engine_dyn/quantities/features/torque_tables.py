"""Torque tables of load and driver, over an angle or a speed: their nodes, and the words for them.

What follows from a torque that depends on the angle or the speed, together with the laws of loads
and motors, stands in `engine_dyn.quantities.loads`; the curves themselves are
`engine_dyn.loads.torque_curves.TorqueOverAngle` and `TorqueOverSpeed`.
"""

from __future__ import annotations

from engine_dyn.loads import driven_machine
from engine_dyn.loads.torque_curves import TorqueOverAngle, TorqueOverSpeed
from engine_dyn.quantities.features.feature import Feature
from engine_dyn.quantities.node import Node

OF_ANGLE = ("load_gear", "load_phase", "load_table_factor")  # Nodes of a load over the angle

LOAD: Feature[TorqueOverAngle | TorqueOverSpeed] = Feature(
    "load_table", "torque of the load over an angle or a speed", "load and driver", (
        Node(
            "load_gear", "i", "1", "speed of a load over its own angle or speed over the crank's",
            public=False, make=lambda gear_ratio: gear_ratio,
        ),
        Node(
            "load_constant", "", "N m", "load torque independent of speed", public=False,
            when="steady_load", make=lambda load_offset: load_offset,
        ),
        Node(
            "load_constant", "", "N m", "load torque independent of speed, mean over the cycle",
            public=False, when="angle_load",
            make=lambda load_offset, driven, load_gear, load_table_factor:
            driven_machine.constant_load(
                load_offset, driven.over_angle, load_gear, load_table_factor
            ),
        ),
        Node(
            "load_over_angle", "", "N m", "load torque independent of speed", kind="curve",
            public=False, when="steady_load", make=lambda load_offset: load_offset,
        ),
        Node(
            "load_over_angle", "", "N m", "load torque independent of speed", kind="curve",
            public=False, when="angle_load",
            make=lambda load_offset, driven, crank_angle, load_gear, load_phase, load_table_factor:
            load_offset + driven_machine.load_over_angle(
                crank_angle, driven.over_angle, load_gear, load_phase, load_table_factor
            ),
        ),
        Node(
            "shape_at_nominal", "", "N m",
            "torque of the load's table at nominal speed, referred to the crankshaft",
            public=False, when="table no_driver",
            make=lambda driven, speed, load_gear: load_gear * driven.over_speed(load_gear * speed),
        ),
    ),
    words=(
        {
            "steady_load": "the load torque does not depend on the angle",
            "angle_load": "a part of the load torque depends on the angle",
        },
    ),
)  # fmt: skip

DRIVER: Feature[TorqueOverSpeed] = Feature(
    "driver_table", "torque of the driver over the speed", "load and driver", (
        Node(
            "shape_at_nominal", "", "N m", "torque of the driver's table at nominal speed",
            public=False, when="table with_driver",
            make=lambda driven, speed: driven.over_speed(speed),
        ),
    ),
    words=(
        {
            "no_driver": "the engine drives the load",
            "with_driver": "a driver turns the engine",
        },
    ),
)  # fmt: skip
