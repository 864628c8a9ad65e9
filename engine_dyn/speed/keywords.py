"""The keywords of `periodic_speed` in groups, with their checks and what follows from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.forces.torque import piston_area
from engine_dyn.geometry.arrangement import Arrangement, Cylinder, Throw
from engine_dyn.geometry.cylinders import Cylinders, cylinders_of, even_cylinders
from engine_dyn.geometry.slider_crank import crank_radius_of_ratio
from engine_dyn.given_numbers import given_array, given_number
from engine_dyn.loads.driven_machine import DrivenMachine, constant_load, repeats_of
from engine_dyn.loads.friction import FrictionShape
from engine_dyn.loads.laws import LAWS, LOAD_LAWS
from engine_dyn.parameters import KEYWORDS
from engine_dyn.plausibility.possible import impossible
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.pressure.family import Family, family_from_diagrams
from engine_dyn.speed.fields import CLOSURES, FRICTION_NAMES, INERTIA_MODELS, METHOD_NAMES, STEPPING
from engine_dyn.speed.torque import mean_gas_of_unequal_throws

LOAD_EXPONENT = KEYWORDS["load_exponent"].typical  # Default exponent of the load torque


OwnDiagrams = tuple[tuple[int, Diagram], ...]
"""Numbers of cylinders with diagrams of their own, from 1, and these."""


@lru_cache(maxsize=8)
def family_of(diagram: Diagram, own: OwnDiagrams = ()) -> Family:
    """Family of one diagram, and those of single cylinders.

    Cached because a search asks for the same one again and again.
    """
    family = family_from_diagrams([0.0], [diagram])
    return replace(family, of_cylinders={number: family_of(one) for number, one in own})


@lru_cache(maxsize=64)
def _mean_gas(family: Family, ratio: float, offset: float, cylinders: Cylinders) -> float:
    """Mean of `mean_gas_of_unequal_throws`, cached because searches ask repeatedly."""
    return float(mean_gas_of_unequal_throws(ratio, offset, 0.0, family, 1, {1: cylinders}))


@dataclass(frozen=True)
class _Group:
    """Keywords of `periodic_speed` that are checked together; numbers must be finite floats."""

    def __post_init__(self) -> None:
        """Take numbers as floats; ValueError names a value that is no number."""
        for item in fields(self):
            value = getattr(self, item.name)
            if item.type == "float" or (item.type == "float | None" and value is not None):
                number = given_number(item.name, value, finite=True)
                object.__setattr__(self, item.name, number)


def check_keywords(**values: float) -> None:
    """Refuse what lies below the range of a parameter, or is impossible; ValueError names it."""
    for name, number in values.items():
        one = KEYWORDS[name]
        if one.whole:
            number = given_number(name, number, finite=True)
            if number < 1.0 or number != int(number):
                raise ValueError(f"{name} = {number:g}: must be a whole number from 1 on")
        elif one.at_least is None:
            check_positive(**{name: number})
        elif not 0.0 <= number < np.inf:
            raise ValueError(f"{name} = {number:g}: must be zero or a positive number")
        if beyond := impossible(one.name, number / one.si, one.unit, one.si, written=1.0):
            raise ValueError(f"{name} = {number:g}: must be {beyond}")


def check_positive(**values: float) -> None:
    """Refuse what is no positive number; ValueError names it."""
    for name, number in values.items():
        if not 0.0 < number < np.inf:
            raise ValueError(f"{name} = {number:g}: must be a positive number")


class CylinderGroup(NamedTuple):
    """Cylinders, their firing angles [rad], factors and diagrams; keywords of `periodic_speed`."""

    cylinders: int
    firing_angles: Sequence[float] | None
    pressure_factor: Sequence[float] | None
    mass_factor: Sequence[float] | None
    radius_factor: Sequence[float] | None
    bore_factor: Sequence[float] | None = None
    firing_pattern: Sequence[float] | None = None
    diagrams: Mapping[int, Diagram] | None = None

    def over(self, period: float) -> Cylinders:
        """Return the cylinders with a cycle [rad]; ValueError names lists that do not fit."""
        given = map(_numbers_of_cylinders, self._fields[1:-1], self[1:-1])
        *lists, bores, pattern = given
        cylinders = _cylinders(int(self.cylinders), period, *lists)
        if self.several_makes:
            numbers = [number for number, _ in self.own_diagrams(period)]
            own = [number if number in numbers else 0 for number in range(1, cylinders.count + 1)]
            cylinders = cylinders.with_makes(_bores(bores, cylinders.count), own)
        return cylinders if pattern is None else cylinders.with_pattern(pattern)

    @property
    def several_makes(self) -> bool:
        """Whether cylinders are given bores or diagrams of their own."""
        return self.bore_factor is not None or bool(self.diagrams)

    def own_diagrams(self, period: float) -> OwnDiagrams:
        """Diagrams of single cylinders; ValueError names one that cannot be theirs."""
        given = dict(self.diagrams or {})
        for number, diagram in given.items():
            where = f"diagrams, cylinder {number}"
            if number not in range(1, int(self.cylinders) + 1):
                raise ValueError(f"{where}: must be a number from 1 to {int(self.cylinders)}")
            check_diagram(where, diagram)
            if diagram.period != period:
                raise ValueError(f"{where}: must have the period of the others, {period:g} rad")
        return tuple(sorted(given.items()))


def _bores(factors: tuple[float, ...] | None, count: int) -> tuple[float, ...] | None:
    """Checked bores over that of cylinder 1."""
    if factors is None:
        return None
    if len(factors) != count:
        raise ValueError(
            f"bore_factor: {len(factors)} values for {count} cylinders: must be one for each"
        )
    for number, factor in enumerate(factors, start=1):
        if factor <= 0.0:
            raise ValueError(f"bore_factor, value {number} = {factor:g}: must be a positive number")
    if factors[0] != 1.0:
        raise ValueError(
            f"bore_factor, value 1 = {factors[0]:g}: must be 1, the engine's bore is that of "
            "cylinder 1"
        )
    return factors


def check_diagram(name: str, given: object) -> None:
    """Refuse what is no diagram; ValueError names it."""
    if not isinstance(given, Diagram):
        text = repr(given).splitlines()[0][:60]
        raise ValueError(f"{name} = {text}: must be a Diagram, as returned by diagram_from_points")


def _numbers_of_cylinders(name: str, given: Sequence[float] | None) -> tuple[float, ...] | None:
    if given is None:
        return None
    numbers = given_array(name, given, finite=True)
    if numbers.ndim != 1:
        raise ValueError(f"{name}: must be a list of numbers, one for each cylinder")
    return tuple(numbers.tolist())


@lru_cache(maxsize=64)
def _cylinders(
    count: int, period: float, firing_angles: tuple[float, ...] | None,
    *factors: tuple[float, ...] | None,
) -> Cylinders:  # fmt: skip
    """Cylinders, cached with their derived values, because searches ask repeatedly."""
    if firing_angles is None:
        return even_cylinders(count, period).with_factors(*factors)
    if len(firing_angles) != count:
        raise ValueError(
            f"firing_angles: {len(firing_angles)} values for {count} cylinders: must be one for "
            "each"
        )
    throws = tuple(Throw(-angle, float(i)) for i, angle in enumerate(firing_angles))
    each = tuple(Cylinder(i, 0, angle) for i, angle in enumerate(firing_angles))
    return cylinders_of(Arrangement(period, throws, (0.0,), each, True)).with_factors(*factors)


@dataclass(frozen=True)
class Engine(_Group):
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

    def __post_init__(self) -> None:
        """Take numbers as floats after looking at the diagram; ValueError names a wrong value."""
        check_diagram("diagram", self.diagram)
        super().__post_init__()

    def check(self) -> None:
        """Refuse values outside their physical range; ValueError names the value."""
        names = "bore", "stroke", "speed", "reciprocating_mass", "crankcase_pressure"
        check_keywords(**{name: getattr(self, name) for name in names})
        if not 0.0 < self.crank_ratio < 1.0:
            raise ValueError(
                f"crank_ratio = {self.crank_ratio:g}: must lie between 0 and 1, both excluded"
            )
        check_keywords(cylinders=self.group.cylinders)
        if self.group.several_makes and self.friction_shape is not None:
            raise ValueError(
                "friction_shape: not allowed together with bore_factor or diagrams: its parts are "
                "those of equal cylinders"
            )
        if self.friction_torque < 0.0:
            raise ValueError(
                f"friction_torque = {self.friction_torque:g}: must be zero or a positive number, "
                "because it is subtracted; for a driving torque use a driver (driven) or a "
                "negative load_offset"
            )

    @cached_property
    def radius(self) -> float:
        """Crank radius [m]."""
        return float(crank_radius_of_ratio(self.stroke, self.crank_ratio, self.offset))

    @property
    def offset_ratio(self) -> float:
        """Offset of the pin's line over the crank radius."""
        return self.offset / self.radius

    @property
    def lever(self) -> float:
        """Piston area times crank radius, of all cylinders [m3]."""
        return self.group.cylinders * (float(piston_area(self.bore)) * self.radius)

    @cached_property
    def cylinders(self) -> Cylinders:
        """Cylinders over one cycle; ValueError where the throws cannot turn."""
        cylinders = self.group.over(self.diagram.period)
        cylinders.check_turning(self.crank_ratio, self.offset_ratio)
        return cylinders

    @property
    def family(self) -> Family:
        """The diagram, and those of single cylinders."""
        return family_of(self.diagram, self.group.own_diagrams(self.diagram.period))

    @property
    def torque_mean(self) -> float:
        """Mean torque over the cycle [N m]."""
        mean = _mean_gas(self.family, self.crank_ratio, self.offset_ratio, self.cylinders)
        return self.lever * mean - self.friction_torque

    def inputs(self) -> dict[str, Any]:
        """Inputs of the kernels (`engine_dyn.speed.fields`) that belong to the engine."""
        same = (
            "crank_ratio", "offset_ratio", "bore", "speed", "friction_torque", "crankcase_pressure"
        )  # fmt: skip
        inputs = {name: getattr(self, name) for name in same}
        inputs |= {"row": 0.0, "scale": 1.0, "double_radius": 2.0 * self.radius}
        inputs["mass"] = self.reciprocating_mass
        shape = self.friction_shape
        if shape is not None:  # levels [Pa] of friction's parts
            fractions = (shape.boundary, shape.mixed, shape.hydrodynamic, shape.skirt)
            levels = (fraction * (self.friction_torque / self.lever) for fraction in fractions)
            inputs |= zip(FRICTION_NAMES, (*levels, shape.ring_pressure), strict=True)
        return inputs


@dataclass(frozen=True)
class Load(_Group):
    """Machine that the engine drives, or that drives it; keywords of `periodic_speed`."""

    driven: DrivenMachine
    load_exponent: float = LOAD_EXPONENT
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
        """Refuse values outside their physical range; ValueError names the value."""
        names = "load_exponent", "load_linear", "load_square"
        check_keywords(**{name: getattr(self, name) for name in names})
        law = LOAD_LAWS.get(self.driven.load_law)
        if law is not None and law.factored and self.driven.law != law.name:
            raise ValueError(
                f"{', '.join(law.keys)}: not allowed together with a driver or a table over speed"
            )
        if self.driven.motor:
            for name in ("synchronous_speed", "breakdown_slip", "breakdown_torque"):
                if getattr(self, name) is None:
                    raise ValueError(f"{name}: missing; an induction motor needs it")
                check_positive(**{name: getattr(self, name)})

    def gear(self, period: float) -> float:
        """Speed of a load's shaft over the crank's: 1 where the load is over the crank's own.

        ValueError for a ratio that is not positive, and a load that does not repeat with the cycle.
        """
        gear = self.gear_ratio if self.driven.geared else 1.0
        check_positive(gear_ratio=gear)
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
        law, numbers = LAWS[driven.form.kind], self.inputs(gear)
        assert law.torque is not None
        with np.errstate(over="ignore"):  # a huge exponent overflows: k tends to 0
            torque, _ = law.torque(np.float64(speed), *(numbers[name] for name in law.numbers))
        return float(torque) * (self.breakdown_torque if driven.motor else 1.0)

    def inputs(self, gear: float) -> dict[str, Any]:
        """Inputs of the kernels (`engine_dyn.speed.fields`) that belong to load and driver."""
        return {
            "gear_ratio": gear,
            "load_phase": self.load_phase,
            "load_scale": self.load_scale,
            "exponent": self.load_exponent,
            "synchronous_speed": self.synchronous_speed or 1.0,
            "breakdown_slip": self.breakdown_slip or 1.0,
            "load_linear": self.load_linear,
            "load_square": self.load_square,
        }


@dataclass(frozen=True)
class Solver(_Group):
    """How the speed is solved; keywords of `periodic_speed`."""

    inertia_model: str
    method: str
    closure: str
    tolerance: float
    passes: int | None
    start_speed: float | None
    start_angle: float

    def check_names(self) -> None:
        """Refuse a choice that does not exist; ValueError names it and what there is."""
        for name, known in (
            ("inertia_model", INERTIA_MODELS), ("method", METHOD_NAMES), ("closure", CLOSURES)
        ):  # fmt: skip
            value = getattr(self, name)
            if value not in known:
                raise ValueError(f"{name} = {value!r}: must be one of {', '.join(known)}")

    def check(self) -> None:
        """Refuse values outside their range; ValueError names the value."""
        check_positive(tolerance=self.tolerance)
        if self.passes is not None:
            check_keywords(passes=self.passes)
        if self.start_speed is not None:
            check_keywords(start_speed=self.start_speed)
        if self.closure == "cycle_time" and self.method in STEPPING:
            raise ValueError(f"closure cycle_time: method {self.method} cannot solve for the load")

    def inputs(self) -> dict[str, Any]:
        """Inputs of the kernels that belong to the methods that repeat cycles."""
        return {
            "start_speed": self.start_speed or 0.0,
            "passes": float(self.passes or 0.0),
            "start_angle": self.start_angle,
        }
