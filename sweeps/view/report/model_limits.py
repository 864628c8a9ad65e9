"""Limits of the model, and which of them apply to the quantities of an archive."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from engine_dyn.quantities.friction import FRICTION_LAWS
from sweeps.decide.explore.attributes import members_of
from sweeps.view.texts.lists import SUBJECTS

if TYPE_CHECKING:
    import xarray as xr

SPEED, TORQUE, FLYWHEEL, ORDERS = "crank speed", "torque", "flywheel", "orders"
ONE_CYLINDER, BEARINGS, TORSION = (
    "forces in one cylinder", "bearing loads", "torsional vibration of the shaft"
)  # fmt: skip

GAS = (
    SPEED, TORQUE, "pressure, work and power", FLYWHEEL, ONE_CYLINDER, BEARINGS, ORDERS, TORSION,
)  # fmt: skip
"""Subjects of quantities that need the pressure in the cylinders."""

LIMITS: tuple[tuple[tuple[str, ...], str, str], ...] = (
    (
        (SPEED, TORQUE, ORDERS, FLYWHEEL),
        "",
        "Crank speed, torques and orders are those of a rigid crankshaft with one degree of "
        "freedom, without torsional vibration. Where a natural frequency of the shaft is near a "
        "strong order of the torque, they are wrong.",
    ),
    (
        ("transients",),
        "transient",
        "The speed that is followed in time is that of a rigid crankshaft, also beside a shaft "
        "that twists. Each firing has the pressure of a steady engine at its fuel command, at any "
        "speed; there is no command beyond the last diagram. The charge air follows the fuel "
        "at once, or with one time constant (boost_lag), which decides the fall of the speed "
        "more than all else. Friction over the stroke and that of a cold engine are not included. "
        "Quantities of the periodic speed beside are those of the method auto.",
    ),
    (
        (TORSION,),
        "",
        "Torsional vibration is computed as linear, but for quantities with nonlinear in their "
        "names, at constant mean speed; passing a range of speeds has functions of its own "
        "(engine_dyn.torsion). The variable part of the reciprocating inertia (secondary "
        "resonance), bending and axial vibration are not included. Stress is nominal.",
    ),
    (
        (TORSION,),
        "stiffness_over_torque",
        "A coupling whose stiffness depends on the torque has the stiffness of the mean torque, "
        "also where the torque swings far from it.",
    ),
    (
        GAS,
        "torque_given",
        "The torque of the engine is given: it does not respond to speed or load, and contains "
        "masses and friction as its diagram does. Nothing is added to it.",
    ),
    (
        GAS,
        "pressure",
        "The pressure is given: it does not respond to the speed within the cycle or to bore, "
        "stroke or rod. It follows the nominal speed only if the engine has diagrams, or a table "
        "of factors, over speed.",
    ),
    (
        (SPEED, TORQUE, ORDERS, ONE_CYLINDER, BEARINGS, "balance"),
        "pressure",
        "The rod is modelled by two masses. The torque that this neglects is not included.",
    ),
    (
        (SPEED, TORQUE, "friction"),
        "pressure",
        "Friction is a mean effective pressure, the same for all cylinders except for their "
        "pressure.",
    ),
    (
        (SPEED, TORQUE, "friction"),
        "friction_over_stroke",
        "The shape of the friction over the stroke is a model without a published source for its "
        "shares.",
    ),
    (
        (SPEED, TORQUE, "friction"),
        "friction_by_components",
        "Friction by component was fitted to warm car engines of the 1980s.",
    ),
    (
        (SPEED, "load and driver"),
        "",
        "In the periodic speed load and driver respond at once: governor, electrical transients of "
        "a motor, slip of a coupling and play are not modelled.",
    ),
    (
        GAS,
        "misfire",
        "For a misfiring cylinder, heat and charge losses while motored are neglected, and the "
        "other cylinders do not change.",
    ),
    (
        (BEARINGS,),
        "",
        "The crankshaft is treated as cut at its main journals (statically determinate); oil film "
        "and bending are not modelled. Counterweights are included if scene or engine gives them, "
        "those of a throw at its middle.",
    ),
    ((BEARINGS,), "shared_pins", "Rods on one pin act at its middle."),
    (
        ("balance",),
        "",
        "Shaking forces and moments are those of a rigid engine at constant speed; mounts, a "
        "flexible shaft and gas forces are not included.",
    ),
    (
        (FLYWHEEL,),
        "",
        "The energy swing is that of the engine torque minus a load over angle; the "
        "speed-dependent part of the load is not included.",
    ),
    (
        (ORDERS,),
        "friction_over_stroke",
        "Orders of the torque include gas and inertia torque, but not friction over the stroke.",
    ),
    (
        ("truncated series",),
        "",
        "The coefficients of the series apply to engines without pin offset.",
    ),
    (
        tuple(SUBJECTS),
        "articulated_rods",
        "Each articulated rod is replaced by two masses, and the flange of the master rod is taken "
        "as balanced. A cylinder has the pressure of the master's diagram at the same part of its "
        "stroke.",
    ),
    (
        tuple(SUBJECTS),
        "radial",
        "All rods of the radial engine act on the crank pin itself; articulated_rods give those "
        "that hang on a master rod.",
    ),
    (
        GAS,
        "two_stroke",
        "Two-stroke engines are solved with the same equations; no comparison with a measured "
        "two-stroke diagram has been made.",
    ),
    (
        (SPEED,),
        "thesis",
        "Method thesis uses explicit Euler steps of one degree to reproduce the thesis; it is "
        "of first order and drifts.",
    ),
)
"""Limits of the model, each with the subjects of the quantities and the feature that it applies to;
without a feature, to all."""


def model_limits(quantities: Iterable[str], features: Collection[str] = ("pressure",)) -> list[str]:
    """Return the limits of the model that apply to some quantities, a sentence or two each.

    `features` are those of the scene and its engine, as `features_of` finds them.
    """
    names = set(quantities)
    subjects = {s for s, nodes in SUBJECTS.items() if names & {node.name for node in nodes}}
    return [
        limit for of, feature, limit in LIMITS
        if subjects & set(of) and (not feature or feature in features)
    ]  # fmt: skip


def features_of(archive: xr.Dataset, arrangements: Iterable[Mapping[str, Any]]) -> set[str]:
    """Features of the scene of an archive, and of its engines, that limits of the model are of."""
    given = members_of(archive, "parameters")
    written = "".join(str(archive.attrs.get(key, "")) for key in ("scene", "identity", "shaft"))

    def has(key: str) -> bool:
        """Whether a parameter is not zero, or varies."""
        return key in archive.coords or given.get(key, 0.0) not in (0.0, None)

    found = {"stiffness_over_torque"} if "stiffness_over_torque" in written else set()
    of_torque = {one.get("of") == "torque" for one in _diagrams(archive)}
    found |= {"torque_given"} if True in of_torque else set()
    found |= {"pressure"} if of_torque != {True} else set()  # Also of archives that tell nothing
    shares = ("friction_boundary", "friction_mixed", "friction_hydrodynamic", "friction_skirt")
    found |= {"friction_over_stroke"} if any(map(has, shares)) else set()
    law = FRICTION_LAWS.index("patton_nitschke_heywood") + 1.0
    if "friction_law" in archive.coords or given.get("friction_law") == law:
        found.add("friction_by_components")
    methods = members_of(archive, "solver").get("method")
    found |= {"transient"} if "transient" in members_of(archive, "scene") else set()
    found |= {"thesis"} if isinstance(methods, list) and "thesis" in methods else set()
    factors = [*given, *map(str, archive.coords)]
    if has("misfire") or any(name.startswith("pressure_factor") for name in factors):
        found.add("misfire")
    for one in arrangements:
        found |= {"two_stroke"} if one.get("period") == 360.0 and "pressure" in found else set()
        found |= {"misfire"} if _differ(one.get("pressure_factor")) else set()
        pins = [*zip(_listed(one, "throws"), _listed(one, "positions"), strict=False)]
        shared = len({*map(str, pins)}) < len(pins)
        found |= {"shared_pins"} if shared else set()
        if "articulated_rods" in one:
            found.add("articulated_rods")
        elif shared and len({*map(str, _listed(one, "banks"))}) > 2:
            found.add("radial")
    return found


def _diagrams(archive: xr.Dataset) -> list[Mapping[str, Any]]:
    """What an archive holds on the diagrams that were used."""
    try:
        held = json.loads(str(archive.attrs.get("indicator_diagrams", "[]")))
    except (ValueError, RecursionError):
        return []
    return [one for one in held if isinstance(one, dict)] if isinstance(held, list) else []


def _listed(one: Mapping[str, Any], key: str) -> list[Any]:
    value = one.get(key)
    return value if isinstance(value, list) else []


def _differ(values: Any) -> bool:
    return isinstance(values, list) and any(value != 1.0 for value in values)
