"""The keywords of `periodic_speed` in groups, with their checks and what follows from them.

`periodic_speed` and `energy_swing` take keywords; behind them stand an engine, what it drives, and
how its equation is solved.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from engine_dyn.forces.torque import piston_area
from engine_dyn.geometry.arrangement import Arrangement, Cylinder, Throw
from engine_dyn.geometry.cylinders import Cylinders, cylinders_of, even_cylinders
from engine_dyn.geometry.slider_crank import crank_radius_of_ratio
from engine_dyn.loads.driven_machine import DrivenMachine, constant_load, motor_torque, repeats_of
from engine_dyn.loads.friction import FrictionShape
from engine_dyn.loads.laws import LOAD_LAWS
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.pressure.family import Family, family_from_diagrams
from engine_dyn.speed.fields import FRICTION_NAMES
from engine_dyn.speed.mean_gas import mean_gas_torque
from engine_dyn.speed.methods import CLOSURES, INERTIA_MODELS, METHOD_NAMES, STEPPING

__all__ = ["CylinderGroup", "Engine", "Load", "Solver", "family_of"]


@lru_cache(maxsize=8)
def family_of(diagram: Diagram) -> Family:
    """Family of one diagram, cached because a search asks for the same one again and again."""
    return family_from_diagrams([0.0], [diagram])


@lru_cache(maxsize=64)
def _mean_gas(diagram: Diagram, crank_ratio: float, offset: float, factor: float) -> float:
    """Mean gas torque of a cylinder, cached because many have the same and searches ask again."""
    return float(mean_gas_torque(crank_ratio, 0.0, family_of(diagram), offset, factor))


def _check_positive(**values: float) -> None:
    for name, number in values.items():
        if not 0.0 < number < np.inf:
            raise ValueError(f"{name} = {number:g}: must be a positive number")


def _check_not_negative(**values: float) -> None:
    for name, number in values.items():
        if not 0.0 <= number < np.inf:
            raise ValueError(f"{name} = {number:g}: must be zero or a positive number")


@dataclass(frozen=True)
class CylinderGroup:
    """Cylinders, their firing angles [rad] and their factors; keywords of `periodic_speed`."""

    cylinders: int
    firing_angles: Sequence[float] | None
    pressure_factor: Sequence[float] | None
    mass_factor: Sequence[float] | None
    radius_factor: Sequence[float] | None

    def check(self) -> None:
        """Refuse a number of cylinders that is none."""
        if self.cylinders != int(self.cylinders) or self.cylinders < 1:
            raise ValueError(f"cylinders = {self.cylinders}: must be a whole number from 1 on")

    def over(self, period: float) -> Cylinders:
        """Return the cylinders over one cycle [rad]."""
        columns = (self.firing_angles, self.pressure_factor, self.mass_factor, self.radius_factor)
        given = (None if column is None else tuple(map(float, column)) for column in columns)
        return _cached_cylinders(self.cylinders, period, *given)


@lru_cache(maxsize=64)
def _cached_cylinders(
    count: int,
    period: float,
    firing_angles: tuple[float, ...] | None,
    pressure_factor: tuple[float, ...] | None,
    mass_factor: tuple[float, ...] | None,
    radius_factor: tuple[float, ...] | None,
) -> Cylinders:
    """Cylinders, cached with what they know of themselves: searches ask again and again."""
    engine = even_cylinders(count, period)
    if firing_angles is not None:
        if len(firing_angles) != count:
            raise ValueError(
                f"firing_angles: {len(firing_angles)} values for {count} cylinders: must be one "
                "for each"
            )
        throws = tuple(Throw(-float(a), float(i)) for i, a in enumerate(firing_angles))
        each = tuple(Cylinder(i, 0, float(angle)) for i, angle in enumerate(firing_angles))
        engine = cylinders_of(Arrangement(period, throws, (0.0,), each, True))
    return engine.with_factors(pressure_factor, mass_factor, radius_factor)


@dataclass(frozen=True)
class Engine:
    """The engine of one design: its diagram, sizes, masses and friction; see `periodic_speed`."""

    diagram: Diagram
    bore: float
    stroke: float
    crank_ratio: float
    reciprocating_mass: float
    speed: float
    offset: float
    group: CylinderGroup
    friction_shape: FrictionShape | None
    friction_torque: float
    crankcase_pressure: float

    def check(self) -> None:
        """Refuse values outside their physical range.

        Raises
        ------
        ValueError
            Naming the value.
        """
        _check_positive(bore=self.bore, stroke=self.stroke, speed=self.speed)
        _check_not_negative(
            reciprocating_mass=self.reciprocating_mass, crankcase_pressure=self.crankcase_pressure
        )
        if not 0.0 < self.crank_ratio < 1.0:
            raise ValueError(
                f"crank_ratio = {self.crank_ratio:g}: must lie between 0 and 1, both excluded"
            )
        self.group.check()
        if not all(map(math.isfinite, (self.friction_torque, self.offset))):
            raise ValueError("load_offset, friction_torque and offset must be finite numbers")

    @cached_property
    def double_radius(self) -> float:
        """Two crank radii [m]."""
        return 2.0 * float(crank_radius_of_ratio(self.stroke, self.crank_ratio, self.offset))

    @property
    def offset_ratio(self) -> float:
        """Offset of the pin's line over the crank radius."""
        return self.offset / (0.5 * self.double_radius)

    @property
    def lever(self) -> float:
        """Piston area times crank radius [m3]."""
        return float(piston_area(self.bore)) * 0.5 * self.double_radius

    @cached_property
    def cylinders(self) -> Cylinders:
        """Cylinders over one cycle.

        Raises
        ------
        ValueError
            Where the throws cannot turn.
        """
        found = self.group.over(self.diagram.period)
        found.check_turning(self.crank_ratio, self.offset_ratio)
        return found

    @property
    def torque_mean(self) -> float:
        """Mean torque over the cycle [N m]."""
        means, cylinders = [], self.cylinders
        for member in cylinders.members[:1] if cylinders.equal else cylinders.members:
            own = map(float, member.own(self.crank_ratio, self.offset_ratio))
            mean = _mean_gas(self.diagram, *own, member.pressure_factor)
            means.append(member.radius_factor * mean)
        mean_gas = sum(means) / len(means)
        return self.group.cylinders * self.lever * mean_gas - self.friction_torque

    def inputs(self) -> dict[str, float]:
        """Inputs of the kernels (`engine_dyn.speed.fields`) that belong to the engine."""
        return {
            "crank_ratio": self.crank_ratio,
            "row": 0.0,
            "scale": 1.0,
            "crankcase_pressure": self.crankcase_pressure,
            "offset_ratio": self.offset_ratio,
            "bore": self.bore,
            "double_radius": self.double_radius,
            "mass": self.reciprocating_mass,
            "speed": self.speed,
            "friction_torque": self.friction_torque,
            **self._friction_levels(),
        }

    def _friction_levels(self) -> dict[str, float]:
        """Inputs that spread the friction over the stroke [Pa]."""
        shape = self.friction_shape
        if shape is None:
            return {}
        fractions = (shape.boundary, shape.mixed, shape.hydrodynamic, shape.skirt)
        level = self.friction_torque / (self.group.cylinders * self.lever)
        levels = {n: s * level for n, s in zip(FRICTION_NAMES, fractions, strict=False)}
        return {**levels, "ring_pressure": shape.ring_pressure}


@dataclass(frozen=True)
class Load:
    """What the engine drives, or what drives it; keywords of `periodic_speed`."""

    driven: DrivenMachine
    load_exponent: float = 0.0
    load_offset: float = 0.0
    gear_ratio: float = 1.0
    load_phase: float = 0.0
    load_scale: float = 1.0
    synchronous_speed: float | None = None
    breakdown_slip: float | None = None
    breakdown_torque: float = 1.0
    load_linear: float = 0.0
    load_square: float = 0.0

    def check(self) -> None:
        """Refuse values outside their physical range.

        Raises
        ------
        ValueError
            Naming the value.
        """
        _check_not_negative(
            load_exponent=self.load_exponent,
            load_linear=self.load_linear,
            load_square=self.load_square,
        )
        law = LOAD_LAWS.get(self.driven.load_law)
        if law is not None and law.torque is not None and self.driven.law != law.name:
            raise ValueError(
                f"{', '.join(law.keys)}: not allowed together with a driver or a table over speed"
            )
        if not math.isfinite(self.load_offset):
            raise ValueError("load_offset, friction_torque and offset must be finite numbers")
        if self.driven.motor:
            for name in ("synchronous_speed", "breakdown_slip", "breakdown_torque"):
                given = getattr(self, name)
                if given is None or not 0.0 < given < np.inf:
                    raise ValueError(f"{name} = {given}: must be a positive number")

    def gear(self, period: float) -> float:
        """Speed of a load's shaft over the crank's: 1 where the load is over the crank's own.

        Raises
        ------
        ValueError
            For a ratio that is not positive, and a load that does not repeat with the cycle.
        """
        gear = self.gear_ratio if self.driven.geared else 1.0
        if not 0.0 < gear < np.inf:
            raise ValueError(f"gear_ratio = {gear:g}: must be a positive number")
        if self.driven.over_angle is not None:
            repeats_of(self.driven.over_angle, gear, period)
        return gear

    def constant(self, gear: float) -> float:
        """Torque that does not depend on the speed, with the mean of a load over angle [N m]."""
        if self.driven.over_angle is None:
            return self.load_offset
        return constant_load(self.load_offset, self.driven.over_angle, gear, self.load_scale)

    def torque_at_nominal(self, speed: float, gear: float) -> float:
        """Torque at the nominal speed [rad/s] that the balance's factor multiplies [N m]."""
        driven = self.driven
        if driven.over_speed is not None:
            return gear * float(driven.over_speed(gear * speed))
        if driven.motor:
            assert self.synchronous_speed is not None and self.breakdown_slip is not None
            return float(
                motor_torque(
                    speed, self.synchronous_speed, self.breakdown_slip, self.breakdown_torque
                )
            )
        law = LOAD_LAWS[driven.law]
        if law.torque is not None:
            return float(law.torque(speed, *(getattr(self, name) for name in law.needs)))
        with np.errstate(over="ignore"):  # of huge exponents: k tends to zero
            return float(np.power(speed, self.load_exponent))

    def inputs(self, gear: float) -> dict[str, float]:
        """Inputs of the kernels that belong to loads over an angle."""
        return {
            "gear_ratio": gear, "load_phase": self.load_phase, "load_scale": self.load_scale
        }  # fmt: skip

    def inputs_over_speed(self) -> dict[str, float]:
        """Inputs of the kernels that belong to laws over speed."""
        return {
            "exponent": self.load_exponent,
            "synchronous_speed": self.synchronous_speed or 1.0,
            "breakdown_slip": self.breakdown_slip or 1.0,
            "load_linear": self.load_linear,
            "load_square": self.load_square,
        }


@dataclass(frozen=True)
class Solver:
    """How the speed is solved; keywords of `periodic_speed`."""

    inertia_model: str
    method: str
    closure: str
    tolerance: float
    passes: int | None
    start_speed: float | None
    start_angle: float

    def check_names(self) -> None:
        """Refuse a choice that does not exist.

        Raises
        ------
        ValueError
            Naming the choice and what there is.
        """
        for name, value, known in (
            ("inertia_model", self.inertia_model, INERTIA_MODELS),
            ("method", self.method, METHOD_NAMES),
            ("closure", self.closure, CLOSURES),
        ):
            if value not in known:
                raise ValueError(f"{name} = {value!r}: must be one of {', '.join(known)}")

    def check(self) -> None:
        """Refuse values outside their range.

        Raises
        ------
        ValueError
            Naming the value.
        """
        _check_positive(tolerance=self.tolerance)
        if self.passes is not None and (self.passes != int(self.passes) or self.passes < 1):
            raise ValueError(f"passes = {self.passes}: must be a whole number from 1 on")
        if self.start_speed is not None and not 0.0 < self.start_speed < np.inf:
            raise ValueError(f"start_speed = {self.start_speed:g}: must be a positive number")
        if not math.isfinite(self.start_angle):
            raise ValueError(f"start_angle = {self.start_angle:g}: must be a finite number")
        if self.closure == "cycle_time" and self.method in STEPPING:
            raise ValueError(f"closure cycle_time: method {self.method} cannot solve for the load")

    def inputs(self) -> dict[str, float]:
        """Inputs of the kernels that belong to the methods that repeat cycles."""
        return {
            "start_speed": 0.0 if self.start_speed is None else self.start_speed,
            "passes": 0.0 if self.passes is None else float(self.passes),
            "start_angle": self.start_angle,
        }
