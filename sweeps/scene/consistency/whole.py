"""All checks of a whole scene, in the order in which a person wants to hear of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.loads.driven_machine import repeats_of
from engine_dyn.loads.laws import LOAD_LAWS
from engine_dyn.loads.torque_curves import TorqueOverSpeed
from engine_dyn.quantities.features import auxiliaries
from engine_dyn.quantities.features.transient import TABLES
from engine_dyn.quantities.friction import COMPONENT_NODES
from engine_dyn.quantities.graph import UNLESS_GIVEN
from engine_dyn.quantities.parameters import STROKE_SHARES
from engine_dyn.quantities.shaft_numbers import OF_SHAFT
from engine_dyn.torsion.shaft import Shaft
from engine_dyn.units import RPM
from sweeps.base.checks import mentioned
from sweeps.base.errors import SceneError, counted, shown
from sweeps.scene.consistency.features import check_crossings
from sweeps.scene.consistency.mechanism import check_mechanism
from sweeps.scene.consistency.outputs import check_needs, check_start
from sweeps.scene.consistency.pressure import check_diagram_count, check_motored, check_ranges
from sweeps.scene.consistency.transient import check_transient
from sweeps.scene.crossings import exclusive_pair, refused
from sweeps.scene.features.shaft import SHAFT_KEYS
from sweeps.scene.model import Scene
from sweeps.scene.values import GivenValues


def check_scene(scene: Scene, name: str) -> None:
    """Check what depends on the engine, or on several parameters.

    Raises
    ------
    SceneError
        For the first thing that does not fit.
    """
    check_ranges(scene, name)
    check_crossings(scene, name)
    check_diagram_count(scene, name)
    check_mechanism(scene, name)
    check_friction(scene, name)
    check_motored(scene, name)
    check_driven(scene, name)
    check_shaft(scene, name)
    check_transient(scene, name)
    check_needs(scene, name)
    check_start(scene, name)


def check_places(values: GivenValues, start: Mapping[str, float], name: str) -> None:
    """Check that each key is in one place, and that the rod, the inertia and so on are given once.

    `start` has what [solver] gives of the parameters.

    Raises
    ------
    SceneError
        With both places.
    """
    tables: dict[str, Iterable[str]] = {
        "set": values.settings,
        "axes": values.axes,
        "designs": values.designs,
        "solver": start,
        **{table: [key for key in values.engine.values if key.startswith(f"{table}_")]
           for table in TABLES},
    }  # fmt: skip
    place: dict[str, str] = {}
    for table, keys in tables.items():
        for key in keys:
            if key in place:
                raise SceneError(
                    f"{name}: {key} is in both [{place[key]}] and [{table}]; give it in one place"
                )
            place[key] = table
    pair = exclusive_pair(place)
    if pair is not None:
        first, second, reason = pair
        raise SceneError(
            f"{name}: {first} (in [{place[first]}]) and {second} (in [{place[second]}]): {reason}"
        )


def check_driven(scene: Scene, name: str) -> None:
    """Check that loads repeat with the cycle and tables over speed cover all nominal speeds."""
    driven = scene.driven
    law = LOAD_LAWS[driven.load_law]
    if law.factored and driven.law == law.name:
        _check_factors(law.keys, scene, name)
    if driven.over_speed is not None:
        what = "load_table" if driven.load_over_speed is not None else "driver_table"
        _check_speeds(driven.over_speed, what, scene, name)
    if driven.over_angle is not None:
        table, ratios, _ = scene.given_or_own("gear_ratio", UNLESS_GIVEN["gear_ratio"])
        try:
            repeats_of(driven.over_angle, ratios, scene.engine.period)
        except ValueError as error:
            where = f"[{table}] " if table else ""
            raise SceneError(f"{name}: {where}{mentioned(error)}") from None


def _check_factors(keys: Sequence[str], values: GivenValues, name: str) -> None:
    """Check that a load law with factors gives a torque in every design."""
    given = [values.given_or_own(key, 0.0) for key in keys]
    columns = [one.values for one in given if one.table == "designs"]
    zero = all((one.values == 0.0).any() for one in given if one.table != "designs")
    if zero and not (columns and np.any(columns, axis=0).all()):
        raise SceneError(
            f"{name}: {' and '.join(keys)} = 0 in one design: one of them must be more than 0"
        )


def _check_speeds(curve: TorqueOverSpeed, what: str, values: GivenValues, name: str) -> None:
    """Check that a table over speed covers all nominal speeds, or those of the load's own shaft."""
    table, speeds, _ = values.given_or_own("speed")
    where = f"[{table}] speed" if table else f"speed of engine {values.engine.name}"
    low, high = curve.low / RPM, curve.high / RPM
    gears = np.ones(1)
    if curve.own_speed:
        of_gear, gears, _ = values.given_or_own("gear_ratio", UNLESS_GIVEN["gear_ratio"])
        # Each speed occurs with each gear ratio, unless both are columns of [designs]
        if not of_gear == table == "designs":
            speeds, gears = np.broadcast_arrays(speeds[:, None], gears)
    there = gears * speeds
    bad = (there < low * (1.0 - 1e-9)) | (there > high * (1.0 + 1e-9))
    if bad.any():
        at_load = f" makes {there[bad][0]:g} of the load" if curve.own_speed else ""
        raise SceneError(
            f"{name}: {where} = {np.broadcast_to(speeds, bad.shape)[bad][0]:g}{at_load}: must "
            f"be from {low:g} to {high:g} rpm, which {what} covers"
        )


def check_friction(scene: Scene, name: str) -> None:
    """Check that the engine has one law of friction, and at most all of it over the stroke."""
    table = scene.table_of("friction_law")
    if table != "set":
        raise SceneError(
            f"{name}: [{table}] friction_law: must be one value, in [set] or the engine file; "
            "compare scenes with different laws by `engine-dyn compare`"
        )
    of_components = frozenset(node.name for node in COMPONENT_NODES if node.public)
    asked = next((q for q in scene.quantities if q in of_components), None)
    if scene.engine.period != FOUR_STROKE and asked:
        where = f"{name}: [output] quantities: '{asked}'"
        two = "friction by components", "a two-stroke engine"
        raise refused(*two, where, engine=scene.engine.name)
    total: Any = 0.0
    of_designs: Any = 0.0
    for key in STROKE_SHARES:
        table, fractions, _ = scene.given_or_own(key, 0.0)
        if table == "designs":
            of_designs = of_designs + fractions
        else:
            total += fractions.max()
    total = float(np.max(total + of_designs))
    if total > 1.0 + 1e-12:
        raise SceneError(
            f"{name}: {' + '.join(STROKE_SHARES)} = {total:g} in one design: the sum must be at "
            "most 1"
        )


def check_shaft(scene: Scene, name: str) -> None:
    """Check the shaft of a scene, and the keys that belong to shafts.

    Raises
    ------
    SceneError
        For the first key that has no shaft, disc or damper, or whose values a shaft cannot have;
        for a shaft with other throws than the engine, and for a disc of auxiliaries without any.
    """
    shaft, torques = scene.engine.shaft, scene.engine.throw_torques
    if torques and scene.engine.own_cylinders is not None:
        own = [member.phase for member in scene.engine.own_cylinders.members]
        if any([member.phase for member in one.members] != own for one in scene.all_cylinders):
            raise SceneError(
                f"{name}: cylinders: the engine {scene.engine.name} gives the torque of each of "
                "its own, which must not be changed"
            )
    if (
        shaft is not None
        and scene.engine.torque is not None
        and len(shaft.throws) > 1 > len(torques)
    ):
        raise SceneError(
            f"{name}: shaft: has {len(shaft.throws)} throws, but the engine {scene.engine.name} "
            "gives its whole torque; must have one, or the [[diagram]] of = 'cylinder'"
        )
    given = [key for key in scene.given if key in OF_SHAFT or key in SHAFT_KEYS]
    if shaft is None:
        if given:
            raise SceneError(
                f"{name}: [{scene.table_of(given[0])}] {given[0]}: the scene has no shaft: a table "
                "[shaft] with discs and shafts, or shaft = its name or file"
            )
        return
    for key in (key for key in given if key in OF_SHAFT):
        table, values, _ = scene.given[key]
        _check_key(shaft, key, bool(values.all()), f"{name}: [{table}] {key}")
    if shaft.auxiliaries != shaft.free_end and auxiliaries.of(scene.engine) is None:
        raise SceneError(
            f"{name}: [shaft] auxiliaries = {shown(shaft.discs[shaft.auxiliaries])}: has no "
            "effect: neither scene nor engine has [[auxiliaries]], the torque that acts there"
        )
    _check_sections(scene, name)
    _check_friction(scene, name)
    start, end = (scene.known.get(key) for key in ("passing_start", "passing_end"))
    if start is not None and end is not None and np.unique([*start.si.flat, *end.si.flat]).size < 2:
        raise SceneError(f"{name}: passing_end = {end.data:g}: must differ from passing_start")
    for engine in scene.all_cylinders:
        along = engine.along_shaft
        count = engine.count if along is None else len(along)
        if count != len(shaft.throws):
            raise SceneError(
                f"{name}: shaft: has discs for {counted(len(shaft.throws), 'throw')}, the engine "
                f"{scene.engine.name} has {counted(count, 'throw')}; must be equally many"
            )


def _check_key(shaft: Shaft, key: str, nonzero: bool, where: str) -> None:
    """Check that the shaft has the part of a key, and takes a number for it."""
    what, _, text = key.rpartition("_")
    kinds = {"shaft_gear_ratio": "gear", "modal_damping": "damped mode"}
    kind = kinds.get(what, what.split("_")[0])
    counts = {
        "disc": shaft.own_discs, "shaft": shaft.own_shafts, "gear": len(shaft.gears),
        "damper": shaft.dampers, "pendulum": shaft.pendulums,
        "excitation": len(shaft.excitations), "damped mode": shaft.modes,
    }  # fmt: skip
    if int(text) > counts[kind]:
        raise SceneError(
            f"{where}: there is no {kind} number {text}; the shaft has "
            f"{counted(counts[kind], kind)}"
        )
    if kind == "gear" and not nonzero:
        raise SceneError(f"{where} = 0: must not be 0")
    if key in shaft.damping_over_speed:
        raise SceneError(
            f"{where}: not allowed: {what.split('_')[0]} {text} has damping_over_speed"
        )
    by_length = f"shaft_length_{text}" in shaft.keys
    if what in ("shaft_length", "shaft_shear_modulus") and not by_length:
        raise SceneError(f"{where}: has no effect: the stiffness of shaft {text} is given")
    if what == "shaft_stiffness" and int(text) - 1 in shaft.tables:
        raise SceneError(f"{where}: not allowed: shaft {text} has a table of its stiffness")
    if what == "shaft_stiffness" and by_length:
        raise SceneError(
            f"{where}: not allowed: the stiffness of shaft {text} follows from its length"
        )


def _check_friction(values: GivenValues, name: str) -> None:
    """Check that dry friction has both a torque and a stiffness."""
    for key in values.shaft_keys:
        for one, other in (("torque", "stiffness"), ("stiffness", "torque")):
            partner = key.replace(f"shaft_friction_{one}", f"shaft_friction_{other}")
            if partner != key and partner not in values.shaft_keys:
                raise SceneError(
                    f"{name}: [{values.table_of(key)}] {key}: needs {partner}; dry friction has "
                    "both"
                )


def _check_sections(values: GivenValues, name: str) -> None:
    """Check that bores are within their shafts, and limits of propulsion shafts have a shape."""
    for key in values.shaft_keys:
        if not key.startswith("shaft_bore_"):
            continue
        diameter = key.replace("bore", "diameter")
        largest = float(values.given_or_own(key).values.max())
        smallest = float(values.given_or_own(diameter).values.min())
        if not largest < smallest:
            raise SceneError(
                f"{name}: [{values.table_of(key)}] {key} = {largest:g}: must be below the smallest "
                f"{diameter}, {smallest:g} m"
            )
    for key in values.shaft_keys:
        if not key.startswith("shaft_tensile_strength_"):
            continue
        factor = key.replace("tensile_strength", "shape_factor")
        if factor not in values.shaft_keys:
            raise SceneError(
                f"{name}: {key}: needs {factor}, shape_factor of the shaft: c_K of IACS UR M68, 1 "
                "for an integral flange or a shrink fit, 0.6 for a keyway in a taper, 0.5 at a "
                "radial hole, 0.45 for a keyway in a cylinder"
            )
