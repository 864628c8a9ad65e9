"""What loads and drives the crankshaft of a scene beside the load law a + k omega^alpha.

Tables and motors of the scene replace those of the engine.
"""

from __future__ import annotations

from engine_dyn.loads.driven_machine import DrivenMachine, TorqueOverAngle, TorqueOverSpeed
from engine_dyn.loads.laws import LOAD_LAWS, MOTOR_KEYS
from engine_dyn.quantities.features import auxiliaries
from sweeps.scene.features.torque_tables import TorqueTables
from sweeps.scene.values import GivenValues

__all__ = ["driven_machine", "motor_of_slip"]


def driven_machine(values: GivenValues, tables: TorqueTables) -> DrivenMachine:
    """Load tables, driver tables and motor of a scene, or else of its engine."""
    engine = values.engine
    load = tables.load or engine.load_table
    motor = tables.driver is None and (
        values.gives(*MOTOR_KEYS)
        or (engine.driver_table is None and values.engine_gives(*MOTOR_KEYS))
    )
    given = auxiliaries.of(engine)
    return DrivenMachine(
        over_angle=load if isinstance(load, TorqueOverAngle) else None,
        load_over_speed=load if isinstance(load, TorqueOverSpeed) else None,
        driver_over_speed=None if motor else tables.driver or engine.driver_table,
        motor=motor,
        load_law=_load_law(values),
        engine_torque=engine.torque,
        auxiliaries=None if given is None else given.torque,
    )


def _load_law(values: GivenValues) -> str:
    """Name of the load's law over speed: the scene's keys choose it, or else the engine's."""
    for gives in (values.gives, values.engine_gives):
        for law in LOAD_LAWS.values():
            if gives(*law.keys):
                return law.name
    return next(iter(LOAD_LAWS))


def motor_of_slip(values: GivenValues) -> bool:
    """Whether the motor's synchronous speed follows from its slip."""
    if values.gives("motor_synchronous_speed"):
        return False
    return values.gives("motor_slip") or values.engine_gives("motor_slip")
