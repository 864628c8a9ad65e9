"""Limits of the model, and which of them apply to the quantities of an archive."""

from __future__ import annotations

from collections.abc import Iterable

from sweeps.view.texts.lists import SUBJECTS

SPEED, TORQUE, FLYWHEEL, ORDERS = "crank speed", "torque", "flywheel", "orders"
ONE_CYLINDER, BEARINGS, TORSION = (
    "forces in one cylinder", "bearing loads", "torsional vibration of the shaft"
)  # fmt: skip

GAS = (
    SPEED, TORQUE, "pressure, work and power", FLYWHEEL, ONE_CYLINDER, BEARINGS, ORDERS, TORSION,
)  # fmt: skip
"""Subjects of quantities that need the pressure in the cylinders."""

LIMITS: tuple[tuple[tuple[str, ...], str], ...] = (
    (
        (SPEED, TORQUE, ORDERS, FLYWHEEL),
        "Crank speed, torques and orders are those of a rigid crankshaft with one degree of "
        "freedom, without torsional vibration. Where a natural frequency of the shaft is near a "
        "strong order of the torque, they are wrong.",
    ),
    (
        (TORSION,),
        "Torsional vibration is linear, at constant mean speed. The variable part of the "
        "reciprocating inertia (secondary resonance), bending and axial vibration, backlash and "
        "stiffness that depends on the torque are not included. Stress is nominal.",
    ),
    (
        GAS,
        "The pressure is given: it does not respond to the speed within the cycle or to bore, "
        "stroke or rod. It follows the nominal speed only if the engine has diagrams, or a table "
        "of factors, over speed.",
    ),
    (
        (SPEED, TORQUE, ORDERS, ONE_CYLINDER, BEARINGS, "balance"),
        "The rod is modelled by two masses. The torque that this neglects is not included.",
    ),
    (
        (SPEED, TORQUE, "friction"),
        "Friction is a mean effective pressure. Its shape over the stroke, if shares are given, "
        "is a model without a published source for the shares; it is the same for all cylinders "
        "except for their pressure. Friction by component was fitted to warm car engines of the "
        "1980s.",
    ),
    (
        (SPEED, "load and driver"),
        "Load and driver respond at once: governor, electrical transients of a motor, slip of a "
        "coupling and play are not modelled.",
    ),
    (
        GAS,
        "For a misfiring cylinder, heat and charge losses while motored are neglected, and the "
        "other cylinders do not change.",
    ),
    (
        (BEARINGS,),
        "The crankshaft is treated as cut at its main journals (statically determinate), and rods "
        "on one pin act at its middle; oil film and bending are not modelled. Counterweights are "
        "included if scene or engine gives them, those of a throw at its middle.",
    ),
    (
        ("balance",),
        "Shaking forces and moments are those of a rigid engine at constant speed; mounts, a "
        "flexible shaft and gas forces are not included.",
    ),
    (
        (FLYWHEEL,),
        "The energy swing is that of the engine torque minus a load over angle; the "
        "speed-dependent part of the load is not included.",
    ),
    (
        (ORDERS,),
        "Orders of the torque include gas and inertia torque, but not friction over the stroke.",
    ),
    (("truncated series",), "The coefficients of the series apply to engines without pin offset."),
)
"""Limits of the model, each with the subjects of the quantities that it applies to."""


def model_limits(
    quantities: Iterable[str], *, two_stroke: bool = False, methods: Iterable[str] = ()
) -> list[str]:
    """Return the limits of the model that apply to some quantities, a sentence or two each."""
    names = set(quantities)
    subjects = {s for s, nodes in SUBJECTS.items() if names & {node.name for node in nodes}}
    limits = [limit for of, limit in LIMITS if subjects & set(of)]
    if two_stroke and subjects & set(GAS):
        limits.append(
            "Two-stroke engines are solved with the same equations; no comparison with a measured "
            "two-stroke diagram has been made."
        )
    if "thesis" in methods and SPEED in subjects:
        limits.append(
            "Method thesis uses explicit Euler steps of one degree to reproduce the thesis; it is "
            "of first order and drifts."
        )
    if limits:
        limits.append(
            "Articulated rods on a master rod are not modelled; in radial engines all rods act on "
            "the crank pin itself."
        )
    return limits
