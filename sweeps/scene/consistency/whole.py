"""All checks of a whole scene, in the order in which a person wants to hear of them."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from engine_dyn.flywheel import mean_diameter
from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.geometry.slider_crank import crank_radius, crank_radius_of_ratio
from engine_dyn.loads.driven_machine import DrivenMachine, TorqueOverSpeed, repeats_of
from engine_dyn.loads.laws import LOAD_LAWS
from engine_dyn.quantities.each_cylinder import OF_CYLINDER
from engine_dyn.quantities.features import auxiliaries
from engine_dyn.quantities.friction import COMPONENT_NODES
from engine_dyn.quantities.graph import UNLESS_GIVEN
from engine_dyn.quantities.parameters import STROKE_SHARES
from engine_dyn.quantities.shaft_numbers import OF_SHAFT
from engine_dyn.torsion.shaft import Shaft
from engine_dyn.types import Floats
from engine_dyn.units import RPM
from sweeps.base.checks import mentioned
from sweeps.base.errors import SceneError, counted, shown
from sweeps.scene.consistency.cylinders import check_misfire, extreme_cylinders
from sweeps.scene.consistency.features import check_crossings
from sweeps.scene.consistency.outputs import check_needs, check_start
from sweeps.scene.consistency.pressure import check_diagram_count, check_motored, check_ranges
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
    check_rod(scene, name)
    check_ring(scene, name)
    extremes = extreme_cylinders(scene, name)  # Refuses values that no cylinder can have
    check_offset(scene, extremes, name)
    check_throw_radii(scene, extremes, name)
    check_misfire(scene, name)
    check_friction_law(scene, name)
    check_friction_fractions(scene, name)
    check_motored(scene, name)
    check_driven(scene, name)
    check_shaft(scene, name)
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
    tables: dict[str, Mapping[str, Any]] = {
        "set": values.settings,
        "axes": values.axes,
        "designs": values.designs,
        "solver": start,
    }
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
    _check_load_law(driven, scene, name)
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


def _check_load_law(driven: DrivenMachine, scene: Scene, name: str) -> None:
    """Check that a load law with given numbers gives a torque."""
    law = LOAD_LAWS[driven.load_law]
    if not law.factored or driven.law != law.name:
        return
    columns: list[Any] = []
    zero = True
    for key in law.keys:
        table, values, _ = scene.given_or_own(key, 0.0)
        if table == "designs":
            columns.append(values)
        else:
            zero = zero and bool((values == 0.0).any())
    if columns:
        zero = zero and not np.any(columns, axis=0).all()
    if zero:
        raise SceneError(
            f"{name}: {' and '.join(law.keys)} = 0 in one design: one of them must be more than 0"
        )


def _check_speeds(curve: TorqueOverSpeed, what: str, scene: Scene, name: str) -> None:
    """Check that a table over speed covers all nominal speeds, or those of the load's own shaft."""
    table, speeds, _ = scene.given_or_own("speed")
    where = f"[{table}] speed" if table else f"speed of engine {scene.engine.name}"
    low, high = curve.low / RPM, curve.high / RPM
    gears = np.ones(1)
    if curve.own_speed:
        of_gear, gears, _ = scene.given_or_own("gear_ratio", UNLESS_GIVEN["gear_ratio"])
        if not of_gear == table == "designs":  # Unless both are columns, all values meet
            speeds, gears = np.broadcast_arrays(speeds[:, None], gears)
    there = gears * speeds
    bad = (there < low * (1.0 - 1e-9)) | (there > high * (1.0 + 1e-9))
    if bad.any():
        at_load = f" makes {there[bad][0]:g} of the load" if curve.own_speed else ""
        raise SceneError(
            f"{name}: {where} = {np.broadcast_to(speeds, bad.shape)[bad][0]:g}{at_load}: must "
            f"be from {low:g} to {high:g} rpm, which {what} covers"
        )


def check_friction_law(scene: Scene, name: str) -> None:
    """Check that there is one law of the friction, and that it is for the engine."""
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


def check_friction_fractions(values: GivenValues, name: str) -> None:
    """Check that no design has more friction over the stroke than it has friction."""
    total: Any = 0.0
    of_designs: Any = 0.0
    for key in STROKE_SHARES:
        table, fractions, _ = values.given_or_own(key, 0.0)
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


def check_rod(values: GivenValues, name: str) -> None:
    """Check that the rod is longer than half the stroke in every combination of the scene."""
    given = values.given.get("rod_length")
    if given is None:
        return
    table, rods, _ = given
    of_stroke, strokes, _ = values.given_or_own("stroke", 0.0)
    if not of_stroke == table == "designs":  # Unless both are columns, all values meet
        rods, strokes = rods.min(keepdims=True), strokes.max(keepdims=True)
    short = np.flatnonzero(rods <= strokes / 2.0)
    if short.size:
        rod, length = rods[short[0]], strokes[short[0]]
        raise SceneError(
            f"{name}: [{table}] rod_length = {rod:g}: must be above half the stroke, "
            f"{length / 2.0:g} m"
        )


def check_ring(values: GivenValues, name: str) -> None:
    """Check that the flywheel's ring has a thickness in every combination of the scene."""
    keys = ("flywheel_outer_diameter", "flywheel_inner_diameter")
    outer, inner = (values.given_or_own(key) for key in keys)
    if np.isnan(outer.values).any() or np.isnan(inner.values).any():
        return
    together = outer.table == inner.table == "designs"  # Both are columns, compared row by row
    try:
        mean_diameter(outer.values if together else outer.values[:, None], inner.values)
    except ValueError as error:
        raise SceneError(f"{name}: {error}") from None


def check_offset(scene: Scene, extremes: Sequence[Cylinders], name: str) -> None:
    """Check that the crank turns in every combination of the scene: |e| + r < l."""
    if "centred" in scene.words:
        return
    has_rod = scene.gives("rod_length")
    key = "rod_length" if has_rod else "crank_ratio"
    columns = {
        parameter: _worst(scene, parameter)
        for parameter in ("pin_offset", "crank_offset", "stroke", key)
    }
    for pin, crank, stroke, length in itertools.product(*columns.values()):
        if np.isnan(stroke).any() or np.isnan(length).any():
            continue  # Another check reports missing values
        try:
            if has_rod:
                radius = crank_radius(stroke, length, pin + crank)
                ratio = radius / length
            else:
                radius, ratio = crank_radius_of_ratio(stroke, length, pin + crank), length
            for engine in extremes:
                engine.check_turning(ratio, (pin + crank) / radius)
        except ValueError as error:
            offset = "pin_offset" if pin.any() else "crank_offset"
            table = scene.given_or_own(offset).table
            where = f"[{table}] " if table else f"engine {scene.engine.name} "
            raise SceneError(f"{name}: {where}{offset}: {mentioned(error)}") from None


def _worst(values: GivenValues, parameter: str) -> list[Floats]:
    """Values of a parameter that may be worst: columns of designs, row by row, or the extremes."""
    # NaN where neither scene nor engine has a value.
    default = 0.0 if parameter.endswith("offset") else np.nan
    given = values.given_or_own(parameter, default)
    if given.table == "designs":
        return [given.values]
    return [np.array([value]) for value in {given.values.min(), given.values.max()}]


def check_throw_radii(scene: Scene, extremes: Sequence[Cylinders], name: str) -> None:
    """Check that the crank turns on throws of unequal radius; see `check_offset` for offsets."""
    words = scene.words
    if "equal_throws" in words or "offset" in words:
        return
    if scene.gives("rod_length"):
        stroke = float(scene.given_or_own("stroke", 0.0).values.max())
        ratio = 0.5 * stroke / float(scene.given["rod_length"].values.min())
    else:
        ratio = float(scene.given_or_own("crank_ratio", 0.0).values.max())
    for engine in extremes:
        try:
            engine.check_turning(ratio)
        except ValueError as error:
            raise SceneError(f"{name}: {_place_of_radii(scene)} {mentioned(error)}") from None


def _place_of_radii(scene: Scene) -> str:
    """Place where the crank radii of single cylinders are given."""
    for key in scene.cylinder_keys:
        if OF_CYLINDER[key].what == "radius_factor":
            return f"[{scene.table_of(key)}]"
    if scene.arrangements:
        return "[axes] arrangement:"
    own = scene.own_cylinders is scene.engine.own_cylinders
    return f"engine {scene.engine.name}" if own else "[set]"


def check_shaft(scene: Scene, name: str) -> None:
    """Check the shaft of a scene, and the keys that belong to shafts.

    Raises
    ------
    SceneError
        For the first key that has no shaft, disc or damper, or whose values a shaft cannot have;
        for a shaft with other throws than the engine, and for a disc of auxiliaries without any.
    """
    shaft = scene.engine.shaft
    given = [key for key in scene.given if key in OF_SHAFT or key in SHAFT_KEYS]
    if shaft is None:
        if given:
            raise SceneError(
                f"{name}: [{scene.table_of(given[0])}] {given[0]}: the scene has no shaft: a table "
                "[shaft] with discs and shafts, or shaft = its name or file"
            )
        return
    for key in (key for key in given if key in OF_SHAFT):
        _check_key(scene, shaft, key, f"{name}: [{scene.table_of(key)}] {key}")
    if shaft.auxiliaries != shaft.free_end and auxiliaries.of(scene.engine) is None:
        raise SceneError(
            f"{name}: [shaft] auxiliaries = {shown(shaft.discs[shaft.auxiliaries])}: has no "
            "effect: neither scene nor engine has [[auxiliaries]], the torque that acts there"
        )
    _check_bores(scene, name)
    _check_shapes(scene, name)
    _check_throws(scene, shaft, name)


def _check_key(scene: Scene, shaft: Shaft, key: str, where: str) -> None:
    what, _, text = key.rpartition("_")
    kind = "gear" if what == "shaft_gear_ratio" else what.split("_")[0]
    counts = {
        "disc": shaft.own_discs, "shaft": shaft.own_shafts, "gear": len(shaft.gears),
        "damper": shaft.dampers, "pendulum": shaft.pendulums,
    }  # fmt: skip
    if int(text) > counts[kind]:
        raise SceneError(
            f"{where}: there is no {kind} number {text}; the shaft has "
            f"{counted(counts[kind], kind)}"
        )
    if kind == "gear" and not scene.given[key].values.all():
        raise SceneError(f"{where} = 0: must not be 0")
    by_length = f"shaft_length_{text}" in shaft.keys
    if what in ("shaft_length", "shaft_shear_modulus") and not by_length:
        raise SceneError(f"{where}: has no effect: the stiffness of shaft {text} is given")
    if what == "shaft_stiffness" and int(text) - 1 in shaft.tables:
        raise SceneError(f"{where}: not allowed: shaft {text} has a table of its stiffness")
    if what == "shaft_stiffness" and by_length:
        raise SceneError(
            f"{where}: not allowed: the stiffness of shaft {text} follows from its length"
        )


def _check_bores(scene: Scene, name: str) -> None:
    for key in scene.shaft_keys:
        if not key.startswith("shaft_bore_"):
            continue
        diameter = key.replace("bore", "diameter")
        largest = float(scene.given_or_own(key).values.max())
        smallest = float(scene.given_or_own(diameter).values.min())
        if not largest < smallest:
            raise SceneError(
                f"{name}: [{scene.table_of(key)}] {key} = {largest:g}: must be below the smallest "
                f"{diameter}, {smallest:g} m"
            )


def _check_shapes(scene: Scene, name: str) -> None:
    """Check that the numbers behind the limit of a propulsion shaft are complete."""
    for key in scene.shaft_keys:
        if not key.startswith("shaft_tensile_strength_"):
            continue
        factor = key.replace("tensile_strength", "shape_factor")
        if factor not in scene.shaft_keys:
            raise SceneError(
                f"{name}: {key}: needs {factor}, shape_factor of the shaft: c_K of IACS UR M68, 1 "
                "for an integral flange or a shrink fit, 0.6 for a keyway in a taper, 0.5 at a "
                "radial hole, 0.45 for a keyway in a cylinder"
            )


def _check_throws(scene: Scene, shaft: Shaft, name: str) -> None:
    for engine in scene.all_cylinders:
        along = engine.along_shaft
        count = engine.count if along is None else len(along)
        if count != len(shaft.throws):
            raise SceneError(
                f"{name}: shaft: has discs for {counted(len(shaft.throws), 'throw')}, the engine "
                f"{scene.engine.name} has {counted(count, 'throw')}; must be equally many"
            )
