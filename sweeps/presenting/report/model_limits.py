"""Limits of the model, and which of them apply to the quantities of an archive."""

from __future__ import annotations

from collections.abc import Iterable

from sweeps.presenting.quantity_search import SUBJECTS

__all__ = ["model_limits"]

SPEED, TORQUE, LOADS = "crank speed", "torque", "load and driver"
BALANCE, ONE_CYLINDER, BEARINGS = "balance", "forces in one cylinder", "bearing loads"
PRESSURE, FRICTION, FLYWHEEL = "pressure, work and power", "friction", "flywheel"
ORDERS, SERIES = "orders", "truncated series"

GAS = (SPEED, TORQUE, PRESSURE, FLYWHEEL, ONE_CYLINDER, BEARINGS, ORDERS)
"""What needs the pressure in the cylinders."""

LIMITS: tuple[tuple[tuple[str, ...], str], ...] = (
    (
        (SPEED, TORQUE, ORDERS, FLYWHEEL),
        "The crankshaft is rigid and has one degree of freedom: there is no torsional vibration. "
        "Where a natural frequency of the shaft is near a strong order of the torque, the results "
        "are wrong.",
    ),
    (
        GAS,
        "The pressure is given: it reacts neither to the speed within the cycle nor to bore, "
        "stroke or rod. It follows the nominal speed only where the engine has diagrams, or a "
        "table of factors, over speed.",
    ),
    (
        (SPEED, TORQUE, ORDERS, ONE_CYLINDER, BEARINGS, BALANCE),
        "The rod is two masses. What that leaves out is not part of the torque.",
    ),
    (
        (SPEED, TORQUE, FRICTION),
        "Friction is a mean effective pressure; its shape over the stroke, where shares of it are "
        "given, is a model without a source for the shares, and equal for all cylinders but for "
        "their pressure. Friction by component was fitted to warm car engines of the 1980s.",
    ),
    (
        (SPEED, LOADS),
        "Load and driver act at once: there is no governor, no electrical transient of a motor, no "
        "slip and no play.",
    ),
    (
        GAS,
        "A cylinder without combustion leaves out the heat and charge lost while motored, and "
        "changes nothing in the other cylinders.",
    ),
    (
        (BEARINGS,),
        "The shaft is taken apart at its journals, rods on one pin act in its middle; there is no "
        "oil film and no bending. Counterweights count where scene or engine gives them, those of "
        "a throw in its middle.",
    ),
    (
        (BALANCE,),
        "Shaking forces and moments are those of a rigid engine at constant speed: mounts, a "
        "flexible shaft and what the gas does to them are not computed.",
    ),
    (
        (FLYWHEEL,),
        "The energy swing is that of the engine's torque less a load over angle; what the load "
        "changes with the speed has no part in it.",
    ),
    (
        (ORDERS,),
        "Orders of the torque are those of gas and masses, without friction over the stroke.",
    ),
    ((SERIES,), "The coefficients of the series hold for engines without pin offset."),
)
"""Subjects of quantities, and what holds for them."""

ALWAYS = (
    "Rods that hang on a master rod are not covered: radial engines have all rods on the pin "
    "itself."
)


TWO_STROKE = (
    "Two-stroke engines are solved by the same program; no measured two-stroke diagram has been "
    "compared."
)

EULER = (
    "Method thesis steps by one degree with Euler's explicit method, to reproduce the thesis: it "
    "is of first order and drifts."
)


def model_limits(
    quantities: Iterable[str], *, two_stroke: bool = False, methods: Iterable[str] = ()
) -> list[str]:
    """Return the limits of the model that apply to some quantities, a sentence or two each.

    Parameters
    ----------
    quantities : iterable of str
        Names.
    two_stroke : bool
        Whether a cycle of an engine is one revolution.
    methods : iterable of str
        Of the solution.
    """
    names = set(quantities)
    subjects = {s for s, nodes in SUBJECTS.items() if names & {node.name for node in nodes}}
    found = [limit for of, limit in LIMITS if subjects & set(of)]
    if two_stroke and subjects & set(GAS):
        found.append(TWO_STROKE)
    if "thesis" in methods and SPEED in subjects:
        found.append(EULER)
    return [*found, ALWAYS] if found else []
