"""Nodes of the friction: mean effective pressure, mean torque, torque over the crank angle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from engine_dyn.forces import torque
from engine_dyn.forces.superposition import CrankTrain
from engine_dyn.loads import friction
from engine_dyn.quantities.arithmetic import product
from engine_dyn.quantities.node import Node, hidden
from engine_dyn.speed.fields import FRICTION_NAMES
from engine_dyn.units import BAR


def _rubbing(
    peak: Any, *, friction_constant: Any, friction_peak_pressure: Any,
    friction_mean_piston_speed: Any, friction_mean_piston_speed_square: Any,
    mean_piston_speed: Any,
) -> Any:  # fmt: skip
    return friction.friction_mean_effective_pressure(
        friction_constant, friction_peak_pressure, friction_mean_piston_speed, peak,
        mean_piston_speed, friction_mean_piston_speed_square,
    )  # fmt: skip


_LEVER = ("stroke", "stroke_share", "double_radius", "period")


def _level(
    rubbing: Any, stroke: Any, stroke_share: Any, double_radius: Any, period: Any
) -> Any:  # fmt: skip
    """Mean torque of a cylinder over piston area and crank radius, of a mean effective pressure."""
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


NODES: tuple[Node, ...] = (
    Node(
        "rubbing", "", "Pa",
        "friction mean effective pressure without the auxiliaries, averaged over the cylinders",
        public=False, when="chen_flynn",
        needs=("friction_constant", "friction_peak_pressure", "friction_mean_piston_speed",
               "friction_mean_piston_speed_square", "mean_piston_speed", "mean_peak_pressure"),
        make=lambda mean_peak_pressure, **needs: _rubbing(mean_peak_pressure, **needs),
    ),
    Node(
        "rubbing", "", "Pa", "friction mean effective pressure of the engine's components",
        public=False, when="patton_nitschke_heywood",
        make=lambda fmep_components: 1.0 * fmep_components,  # a result of its own, not the same one
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
        "Kakaitsas eq. 3.8", make=lambda fmep, displacement, period: friction.friction_torque(
            fmep, displacement, period
        ),
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
)  # fmt: skip
