"""Keys and nodes of the friction: means, those of each component, torque over the crank angle.

See `engine_dyn.loads.friction`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from engine_dyn.forces import torque
from engine_dyn.forces.superposition import CrankTrain
from engine_dyn.geometry.cylinder_means import value_of_sets
from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.loads import friction
from engine_dyn.quantities.node import Node, formula, hidden, parameter, product
from engine_dyn.speed.fields import FRICTION_NAMES
from engine_dyn.units import BAR

_LEVER = ("stroke", "stroke_share", "double_radius", "period")


def _level(
    rubbing: Any, stroke: Any, stroke_share: Any, double_radius: Any, period: Any
) -> Any:  # fmt: skip
    """Mean torque of a cylinder over piston area and crank radius, from a mean pressure."""
    return rubbing * 2.0 * stroke * stroke_share / (double_radius * period)


def stroke_friction(needs: dict[str, Any]) -> friction.StrokeFriction:
    """Take the friction over the stroke out of the needs of a curve."""
    return friction.StrokeFriction._make(needs.pop(name) for name in FRICTION_NAMES)


def train_of(needs: Mapping[str, Any]) -> CrankTrain:
    """Slider-cranks of the cylinders, out of the needs of a curve."""
    return CrankTrain(
        needs["crank_ratio"], needs["double_radius"], needs["cylinder_set"], needs["period"],
        needs["offset_ratio"], needs["cylinders_by_count"],
    )  # fmt: skip


def gas_of(needs: Mapping[str, Any]) -> torque.GasPressure:
    """Pressure in the cylinders, out of the needs of a curve."""
    return torque.GasPressure(
        needs["family"], needs["row"], needs["pressure_scale"], needs["crankcase_pressure"]
    )


def _friction_over_stroke(
    *, crank_angle: Any, bore: Any, auxiliary_swing: Any, **needs: Any
) -> Any:
    levels = stroke_friction(needs)
    return auxiliary_swing + torque.friction_over_stroke(
        crank_angle, train_of(needs), bore, gas_of(needs), needs["friction_torque"], levels
    )


PATTON = "Patton, Nitschke and Heywood, SAE 890836"

FRICTION_LAWS = ("chen_flynn", "patton_nitschke_heywood")
"""Laws of the friction mean effective pressure; the key's values count from 1."""


def _main_bearings(cylinder_set: Any, cylinders_by_count: Any) -> Any:
    """Number of main bearings: one more than throws, or than cylinders where throws are unknown."""

    def of_engine(engine: Cylinders) -> float:
        places = engine.along_shaft
        return 1.0 + (engine.count if places is None else len(places))

    return value_of_sets(cylinder_set, cylinders_by_count, of_engine)


PARAMETERS = (
    parameter(
        "friction_law", "i_{fr}", "1",
        "name of the friction law", "see the page 'Friction by component'",
        whole=True, low=1.0, low_included=True, high=float(len(FRICTION_LAWS)), high_included=True,
        named=tuple((name, float(i)) for i, name in enumerate(FRICTION_LAWS, start=1)),
        unless_given=1.0,
    ),
    parameter(
        "geometric_compression_ratio", r"\varepsilon_g", "1",
        "geometric compression ratio, used for ring friction; modelled cycles have their "
        "own", PATTON, low=1.5, high=40.0,
    ),
    parameter(
        "main_bearings", "n_H", "1",
        "number of main bearings; by default one more than the number of "
        "throws", PATTON, whole=True, low=1.0,
        low_included=True, high=100.0, make=_main_bearings,
    ),
    parameter(
        "valve_train", "i_V", "1", "type of valve train", PATTON, whole=True,
        low=1.0, low_included=True, high=float(len(friction.VALVE_TRAINS)), high_included=True,
        named=tuple((k, float(v.number)) for k, v in friction.VALVE_TRAINS.items()),
    ),
    parameter(
        "valve_lift", "h_v", "m", "largest valve lift", PATTON, low=0.0, high=0.3,
    ),
    parameter(
        "valves_per_cylinder", "n_v", "1", "number of valves per cylinder", PATTON, whole=True,
        low=1.0, low_included=True, high=10.0, high_included=True,
    ),
    parameter(
        "camshaft_bearings", "n_N", "1", "number of bearings of all camshafts", PATTON, whole=True,
        low=1.0, low_included=True, high=200.0,
    ),
)  # fmt: skip

_SIZE = ("bore", "mean_stroke", "cylinders")


def _part(
    name: str, index: str, long_name: str, needs: tuple[str, ...], make: Callable[..., Any]
) -> Node:
    return Node(
        f"fmep_{name}", f"p_{{fr,{index}}}", "bar",
        f"friction mean effective pressure of {long_name}", PATTON, si=BAR, needs=needs, make=make,
    )  # fmt: skip


def _sized(
    name: str, index: str, long_name: str, needs: tuple[str, ...], function: Callable[..., Any]
) -> Node:
    """Node of a friction component that depends on engine size; `needs` in the function's order."""
    return _part(name, index, long_name, **formula(function, *_SIZE, *needs))


_UNTHROTTLED = (
    "fmep_crankshaft_seals", "fmep_main_bearings", "fmep_crank_pin_bearings", "fmep_skirt",
    "fmep_rings", "fmep_valve_train", "fmep_auxiliaries",
)  # fmt: skip
"""Friction components that do not depend on the pressure in the cylinder."""


def _in_order(names: tuple[str, ...]) -> Callable[..., Any]:
    """Sum of needs in the order of the names, whatever order they come in."""

    def make(**needs: Any) -> Any:
        total: Any = 0.0
        for name in names:
            total = total + needs[name]
        return total

    return make


def _share(names: tuple[str, ...]) -> Callable[..., Any]:
    return lambda **needs: _in_order(names)(**needs) / needs["fmep_components"]


def _intake_ratio(family: Any, row: Any, pressure_scale: Any) -> Any:
    """Pressure at the dead centre before compression over atmospheric pressure."""
    # All designs have one angle, so that `pressure` computes any number of them in the same way.
    angle = np.array([-np.pi])
    place = np.asarray(row, dtype=float)[..., None]
    pressure = torque.pressure(angle, family, place)[..., 0]
    return pressure * pressure_scale / friction.ATMOSPHERE


COMPONENT_NODES: tuple[Node, ...] = (
    hidden("mean_stroke", "m", "mean stroke of the cylinders", product, ("stroke", "stroke_share")),
    hidden(
        "intake_ratio", "1",
        "pressure in the cylinder before compression over that of the atmosphere", _intake_ratio,
    ),
    _sized(
        "crankshaft_seals", "S", "the seals of the crankshaft", ("main_journal_diameter",),
        friction.crankshaft_seals,
    ),
    _sized(
        "main_bearings", "H", "the main bearings, including turbulent dissipation",
        ("speed", "main_journal_diameter", "main_journal_width", "main_bearings"),
        friction.main_bearings,
    ),
    _sized(
        "crank_pin_bearings", "C", "the connecting-rod bearings",
        ("speed", "crank_pin_diameter", "crank_pin_width"), friction.crank_pin_bearings,
    ),
    _part(
        "skirt", "K", "the skirts of the pistons",
        **formula(friction.skirt, "bore", "mean_piston_speed"),
    ),
    _part(
        "rings", "R", "the piston rings due to ring tension", ("bore", "speed"), friction.rings,
    ),
    hidden(
        "ring_gas_pressure_unthrottled", "Pa",
        "ring friction added by gas pressure at full throttle",
        **formula(friction.ring_gas_pressure, "geometric_compression_ratio", "mean_piston_speed"),
    ),
    _part(
        "ring_gas_pressure", "G", "the piston rings due to gas pressure",
        ("ring_gas_pressure_unthrottled", "intake_ratio"), product,
    ),
    _sized(
        "valve_train", "V", "the valve train",
        ("speed", "valve_train", "valve_lift", "valves_per_cylinder", "camshaft_bearings"),
        friction.valve_train,
    ),
    _part(
        "auxiliaries", "A", "the auxiliaries (oil pump, water pump and idle alternator)",
        ("speed",), friction.auxiliaries,
    ),
    hidden(
        "fmep_without_gas", "Pa",
        "friction mean effective pressure of all that does not depend on gas pressure",
        _in_order(_UNTHROTTLED), _UNTHROTTLED,
    ),
    Node(
        "fmep_components", "p_{fr,\\Sigma}", "bar",
        "friction mean effective pressure of all components, by the law of Patton, Nitschke and "
        "Heywood", PATTON, si=BAR,
        make=lambda fmep_without_gas, ring_gas_pressure_unthrottled, intake_ratio:
        fmep_without_gas + ring_gas_pressure_unthrottled * intake_ratio,
    ),
    *(
        Node(
            f"friction_share_{group}", f"s_{{fr,{group[0].upper()}}}", "1",
            f"share of {text} in the friction of all components", PATTON,
            needs=(*names, "fmep_components"), make=_share(names),
        )
        for group, text, names in (
            ("bearings", "the bearings and seals of the crankshaft",
             ("fmep_crankshaft_seals", "fmep_main_bearings", "fmep_crank_pin_bearings")),
            ("rings", "the piston rings", ("fmep_rings", "fmep_ring_gas_pressure")),
            ("skirt", "the skirts of the pistons", ("fmep_skirt",)),
            ("valve_train", "the valve train", ("fmep_valve_train",)),
            ("auxiliaries", "the auxiliaries", ("fmep_auxiliaries",)),
        )
    ),
)  # fmt: skip
"""Friction by components, for four-stroke engines."""

NODES: tuple[Node, ...] = (
    Node(
        "rubbing", "", "Pa",
        "friction mean effective pressure without the auxiliaries, averaged over the cylinders",
        public=False, when="chen_flynn",
        **formula(friction.friction_mean_effective_pressure, "friction_constant",
                  "friction_peak_pressure", "friction_mean_piston_speed", "mean_peak_pressure",
                  "mean_piston_speed", "friction_mean_piston_speed_square"),
    ),
    Node(
        "rubbing", "", "Pa", "friction mean effective pressure of the engine's components",
        public=False, when="patton_nitschke_heywood",
        make=lambda fmep_components: 1.0 * fmep_components,  # a new array, not the same one
    ),
    Node(
        "fmep", "p_{fr}", "bar", "friction mean effective pressure", "Kakaitsas eq. 3.9", si=BAR,
        when="bare", make=lambda rubbing: rubbing,
    ),
    Node(
        "fmep", "p_{fr}", "bar", "friction mean effective pressure, with the auxiliaries",
        "Kakaitsas eq. 3.9", si=BAR, when="auxiliaries",
        make=lambda rubbing, auxiliary_torque, auxiliary_mean, displacement, period: rubbing
        + (auxiliary_torque + auxiliary_mean) * period / displacement,
    ),
    *(
        node
        for name, text, kind, of_curve, make in (
            ("auxiliary_mean", "mean torque of auxiliaries over the angle", "value", (),
             lambda driven: driven.auxiliaries.mean),
            ("auxiliary_swing", "that torque less its mean", "curve", ("crank_angle",),
             lambda driven, crank_angle: driven.auxiliaries(crank_angle) - driven.auxiliaries.mean),
        )
        for node in (
            hidden(name, "N m", text, make, ("driven", *of_curve), kind=kind,
                   when="angle_auxiliaries"),
            hidden(name, "N m", text, lambda: 0.0, kind=kind, when="steady_auxiliaries"),
        )
    ),
    Node(
        "friction_torque", "M_{fr}", "N m",
        "mean friction torque, positive against the rotation, subtracted",
        "Kakaitsas eq. 3.8", **formula(friction.friction_torque, "fmep", "displacement", "period"),
    ),
    Node(
        "friction_level", "", "Pa",
        "mean friction torque of a cylinder over piston area and crank radius", public=False,
        make=_level,
    ),
    *(
        Node(
            f"{part}_friction", "", "Pa", f"level of the {part} part of the friction", public=False,
            when="chen_flynn", needs=(f"friction_{part}", "friction_level"), make=product,
        )
        for part in ("boundary", "mixed", "hydrodynamic", "skirt")
    ),
    Node(
        "boundary_friction", "", "Pa", "level of the boundary friction: all of the ring friction",
        public=False, when="patton_nitschke_heywood",
        needs=("fmep_rings", "fmep_ring_gas_pressure", *_LEVER),
        make=lambda fmep_rings, fmep_ring_gas_pressure, **needs: _level(
            fmep_rings + fmep_ring_gas_pressure, **needs
        ),
    ),
    *(
        Node(
            f"{part}_friction", "", "Pa", f"level of the {part} friction: none in this law",
            public=False, when="patton_nitschke_heywood", make=lambda: 0.0,
        )
        for part in ("mixed", "hydrodynamic")
    ),
    Node(
        "skirt_friction", "", "Pa", "level of the friction of the skirt", public=False,
        when="patton_nitschke_heywood", needs=("fmep_skirt", *_LEVER),
        make=lambda fmep_skirt, **needs: _level(fmep_skirt, **needs),
    ),
    Node(
        "instantaneous_friction_torque", "M_{fr}(\\varphi)", "N m",
        "friction torque over crank angle, positive against the rotation, subtracted",
        "Kakaitsas eq. 3.8", kind="curve", when="uniform_friction",
        make=lambda friction_torque, auxiliary_swing, crank_angle: friction_torque
        + auxiliary_swing + 0.0 * crank_angle,
    ),
    Node(
        "instantaneous_friction_torque", "M_{fr}(\\varphi)", "N m",
        "friction torque over crank angle, positive against the rotation, subtracted",
        "after Rezeka and Henein, SAE 840179",
        kind="curve", when="stroke_friction",
        needs=("crank_angle", "crank_ratio", "family", "row", "pressure_scale",
               "crankcase_pressure", "bore", "double_radius", "friction_torque",
               "cylinder_set", "period", "offset_ratio", "cylinders_by_count", "auxiliary_swing",
               *FRICTION_NAMES),
        make=_friction_over_stroke,
    ),
    *COMPONENT_NODES,
)  # fmt: skip
