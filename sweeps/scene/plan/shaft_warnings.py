"""Where the rigid engine, which the speed over the angle assumes, is far from the elastic shaft."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from engine_dyn.torsion.modes import elastic_over_rigid
from engine_dyn.torsion.shaft import Shaft
from engine_dyn.torsion.stress import shaft_stiffness
from engine_dyn.torsion.system import ShaftSystem
from engine_dyn.units import RPM
from sweeps.base.errors import shown
from sweeps.scene.cylinders import cylinders_of_count
from sweeps.scene.engine.silenced_warnings import RECIPROCATING_SHARE, RIGID_SHAFT, SHAFT_SECTION
from sweeps.scene.plan.leaves import mean_of
from sweeps.scene.plan.plan import Plan

__all__ = ["shaft_warnings"]

FAR = 0.05
"""Part by which the angle of the flywheel may differ from that of the rigid shaft."""

STRONG, ORDERS, SPEEDS = 0.5, 2, 25
"""Part of the cylinders whose phase vectors add up in strong orders; how many of these, and at how
many speeds from the lowest to the highest, are looked at."""

STEEL = 80e9
"""Shear modulus of steel [Pa]."""

SHORTEST, LONGEST = 0.05, 200.0
"""Usual lengths of shafts over their diameters: of webs, which are as stiff as short shafts, and of
ships' lines of shafts."""

MOST_SHARE = 0.3
"""Largest share of the reciprocating masses in the inertia of a throw that is not remarked on."""


def shaft_warnings(plan: Plan, off: frozenset[str]) -> list[str]:
    """Lines about the shaft of a plan, for a design with the means of all that varies.

    `off` are names of silenced warnings.
    """
    scene = plan.scene
    shaft = scene.engine.shaft
    of_share = "torsional_response" in plan.computed and RECIPROCATING_SHARE not in off
    of_rigid = "speed_solution" in plan.computed and RIGID_SHAFT not in off
    of_shaft = not plan.computed.keys().isdisjoint(("torsional_modes", "torsional_response"))
    of_section = of_shaft and SHAFT_SECTION not in off
    if shaft is None or not (of_share or of_rigid or of_section):
        return []
    values = {key: mean_of(scene, plan.leaves, key) for key in scene.shaft_keys}
    throws = len(shaft.throws)
    lines = list(_odd_sections(shaft, values)) if of_section else []
    try:
        moving = mean_of(scene, plan.leaves, "mean_reciprocating_inertia") / throws
    except KeyError:  # the engine has no masses, and no quantity that needs them
        moving = 0.0
    own = shaft.inertias(values, np.full(throws, moving))
    share = max(moving / own[disc] for disc in shaft.throws)
    if of_share and share >= 1.0 and shaft.includes_reciprocating:
        lines.append(
            f"{RECIPROCATING_SHARE}: the reciprocating masses have {share:.0%} of the inertia of a "
            "throw's disc, which is said to hold their mean (reciprocating = 'included'): must be "
            "less than 100%; give a larger inertia, or reciprocating = 'added'"
        )
    elif of_share and share > MOST_SHARE:
        lines.append(
            f"{RECIPROCATING_SHARE}: the reciprocating masses have {share:.0%} of the inertia of a "
            f"throw; above {MOST_SHARE:.0%} their variable part, which is left out, may excite "
            "secondary resonance"
        )
    if of_rigid:
        of_tables = np.full(len(shaft.shafts), np.nan)
        for place, table in shaft.tables.items():
            of_tables[place] = table.stiffness.mean()
        system = shaft.system(values, np.full(throws, moving), of_tables=of_tables)
        lines += _far_from_rigid(plan, shaft, system)
    return lines


def _odd_sections(shaft: Shaft, values: Mapping[str, Any]) -> Iterator[str]:
    """Lines on shafts whose length, for a steel shaft of their section, is not that of shafts."""
    for place in range(shaft.own_shafts):
        stiffness, length, diameter, bore = (
            values.get(f"shaft_{what}_{place + 1}")
            for what in ("stiffness", "length", "diameter", "bore")
        )
        if diameter is None:
            continue
        if length is None and stiffness is not None:
            length = shaft_stiffness(STEEL, 1.0, diameter, bore or 0.0) / stiffness
        if length is None or SHORTEST <= length / diameter <= LONGEST:
            continue
        given = "" if stiffness is None else f" of {stiffness:.4g} N m/rad"
        yield (
            f"{SHAFT_SECTION}: shaft {place + 1}, {shown(shaft.shaft_names[place])}{given}: a "
            f"steel shaft of its diameter, {diameter:.4g} m, is {length:.3g} m long, "
            f"{length / diameter:.3g} diameters; usual are {SHORTEST:g} to {LONGEST:g}"
        )


def _far_from_rigid(plan: Plan, shaft: Shaft, system: ShaftSystem) -> list[str]:
    """Line on the strong order that moves the flywheel most unlike the rigid shaft."""
    scene = plan.scene
    engine = (scene.arrangements or (cylinders_of_count(scene, scene.counts[0]),))[0]
    places = engine.along_shaft
    if places is None:
        return []
    phases = [[engine.members[i].phase for i in place] for place in places]
    orders = np.asarray(plan.points["order"])
    vectors = np.array([sum(np.exp(1j * orders * phase) for phase in throw) for throw in phases])
    strong = np.abs(vectors.sum(axis=0)) >= STRONG * engine.count
    orders, vectors = orders[strong][:ORDERS], vectors[:, strong][:, :ORDERS]
    if not orders.size:
        return []
    given = np.ravel(plan.leaves["speed"].si)
    speeds = np.unique(np.linspace(given.min(), given.max(), SPEEDS))
    ratio = elastic_over_rigid(system, orders, speeds, shaft.throws, vectors, shaft.flywheel)
    far = np.abs(np.where(np.isfinite(ratio), ratio, np.inf) - 1.0)
    if not far.max() > FAR:
        return []
    at, which = np.unravel_index(far.argmax(), far.shape)
    frequency = orders[which] * speeds[at] / (2.0 * np.pi)
    return [
        f"{RIGID_SHAFT}: order {orders[which]:g} at {speeds[at] / RPM:.4g} rpm, "
        f"{frequency:.4g} Hz, moves the flywheel {ratio[at, which]:.3g} times as much as with a "
        "rigid shaft, which delta and omega assume; delta_elastic is that of the elastic shaft"
    ]
