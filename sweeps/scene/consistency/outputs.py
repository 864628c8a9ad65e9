"""Whether a scene can compute what [output] asks for: known names, and every value they need."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from engine_dyn.engine import Engine
from engine_dyn.forces.balance.lines import is_boxer
from engine_dyn.geometry.arrangement import MOST_CYLINDERS, TWO_STROKE, customary_order
from engine_dyn.geometry.cylinders import Cylinders, even_cylinders
from engine_dyn.quantities.curve_extremes import is_of_curve
from engine_dyn.quantities.each_cylinder import FOLLOWED, NOT_FOLLOWED, OF_MAKES, OF_ONE_MAKE
from engine_dyn.quantities.generator import OF_FOUR_STROKES
from engine_dyn.quantities.graph import (
    ALL_QUANTITIES,
    ALONG_SHAFT,
    CONSTANTS,
    DIMENSIONS,
    PARAMETERS,
    UNLESS_GIVEN,
)
from engine_dyn.quantities.node import Node
from engine_dyn.quantities.parameters import SOLVER_COLUMNS
from engine_dyn.quantities.shaft_numbers import JUDGING, NAN_WITHOUT
from engine_dyn.quantities.speed import AT_START
from engine_dyn.torsion.shaft import Shaft
from sweeps.base.dimensions import ELASTICITY
from sweeps.base.errors import SceneError, not_known, shown
from sweeps.scene.crossings import refused
from sweeps.scene.engine.engine_files import GEOMETRIC, RATIO
from sweeps.scene.features import BY_CONSTANT
from sweeps.scene.features.feature import GivenFeature
from sweeps.scene.model import Scene
from sweeps.scene.toml_tables import FAILURES, Output

SMALLEST_STEP = 0.01  # Smallest [output] angle_step [degree]


def check_output(output: Output, engine: Engine, name: str) -> None:
    """Check [output] by itself and against the engine's cycle.

    Raises
    ------
    SceneError
        For unknown and duplicate names, for a highest order that the cycle does not have, and for a
        step that does not divide the cycle.
    """
    _check_quantities(output, name)
    for outcome in output.fail_on:
        if outcome not in FAILURES:
            raise SceneError(
                f"{name}: [output] fail_on = {shown(outcome)}: unknown outcome"
                f"{not_known(outcome, FAILURES)}"
            )
    if output.modes is not None and output.modes_below is not None:
        raise SceneError(f"{name}: [output] has both modes and modes_below; give one of them")
    step, cycle = output.angle_step, round(math.degrees(engine.period))
    lowest = 360.0 / cycle
    if abs(output.highest_order / lowest - round(output.highest_order / lowest)) > 1e-9:
        raise SceneError(
            f"{name}: [output] highest_order = {output.highest_order:g}: must be a multiple of "
            f"{lowest:g}, the lowest order of a cycle of {cycle} degrees"
        )
    largest = cycle / 8
    count = cycle / step if step >= SMALLEST_STEP else 0.0
    # Decimal steps such as 0.1 divide the cycle only up to rounding.
    if not SMALLEST_STEP <= step <= largest or abs(count - round(count)) > 1e-9 * count:
        raise SceneError(
            f"{name}: [output] angle_step = {step:g}: must divide the cycle of {cycle} degrees "
            f"into equal steps of {SMALLEST_STEP:g} to {largest:g} degrees"
        )


def _check_quantities(output: Output, name: str) -> None:
    where = f"{name}: [output] quantities"
    if not output.quantities:
        raise SceneError(f"{where} = []: empty; request at least one quantity, such as 'delta'")
    for i, quantity in enumerate(output.quantities):
        if quantity.removesuffix(ELASTICITY) not in ALL_QUANTITIES:
            if quantity in PARAMETERS:
                raise SceneError(
                    f"{where}: '{quantity}' is a parameter, not a quantity; if given in [axes] or "
                    "[designs], it is a coordinate of the archive"
                )
            raise SceneError(
                f"{where}: {shown(quantity)}: unknown quantity"
                f"{not_known(quantity, ALL_QUANTITIES, command='engine-dyn list quantities')}"
            )
        if quantity in output.quantities[:i]:
            raise SceneError(f"{where}: duplicate '{quantity}'; quantities must be unique")


_NOT_OF_SHAFT: dict[str, tuple[Callable[[Shaft], Any], str]] = {
    "shaft_loss": (
        lambda shaft: shaft.modes, "needs the damping of each shaft, to none of which "
        "modal_damping belongs; give loss_factor, damping or magnifier of shafts and discs in its "
        "place",
    ),
    "nonlinear_response": (
        lambda shaft: shaft.modes, "needs the damping of each shaft in place of modal_damping: a "
        "motion that is not linear has no modes",
    ),
    "damped_critical_speed": (
        lambda shaft: shaft.damping_over_speed, "needs damping that does not depend on the speed, "
        "unlike damping_over_speed; damped_natural_frequency over the speed is computed",
    ),
    "torsional_passing": (
        lambda shaft: shaft.pendulums, "is not computed for a shaft with pendulums, whose modes "
        "follow the speed",
    ),
}  # fmt: skip
"""Nodes that some shafts lack: whether a shaft does, and why."""

_OF_COUPLINGS = ("nonlinear_response", "coupling_departure")

_OF_PARTS = ("sized_flywheel_inertia", "load_side_inertia")
"""Nodes that exist only where the inertia is given in parts."""

_NOT_OF_EVERY_ENGINE = {
    *BY_CONSTANT, *_NOT_OF_SHAFT, *_OF_COUPLINGS, *_OF_PARTS, *OF_FOUR_STROKES,
}  # fmt: skip


def check_needs(scene: Scene, name: str) -> None:
    """Check that scene and engine give everything that the asked quantities need.

    Raises
    ------
    SceneError
        With all parameters that are missing, and the quantities that need them.
    """
    words = scene.words
    articulated, makes = "articulated_rods" in words, "several_makes" in words
    given = {*scene.known, *DIMENSIONS, *CONSTANTS, *SOLVER_COLUMNS}
    if scene.indicator is None and not scene.engine.family.diagrams:
        given.remove("family")
    missing: dict[str, list[str]] = {}
    for quantity in scene.quantities:
        where = f"{name}: [output] quantities: '{quantity}'"
        waiting, seen = [quantity], set(given)
        along_shaft = False
        while waiting:
            need = waiting.pop()
            along_shaft |= need in ALONG_SHAFT
            if need in _NOT_OF_EVERY_ENGINE:
                _check_need(scene, need, where)
            if need == "bank_offset" and need not in given:
                _check_bank_offset(scene.all_cylinders, quantity, where)
            if need in seen:
                continue
            seen.add(need)
            node = scene.node(need)
            # Nodes that an engine with a given torque does not have
            of_pressure = ("family", "row", "place", "pressure_scale", "mean_gas", "cycle")
            if need in of_pressure and scene.engine.torque is not None:
                raise SceneError(
                    f"{where} needs the pressure in the cylinders, but engine "
                    f"{scene.engine.name} gives its torque in place of it"
                )
            if articulated and _is_of_plain_rods(node):
                raise SceneError(f"{where} is not computed for engines with articulated_rods")
            if makes and is_of_curve(scene.variants[need]):
                waiting += scene.variants[need].needs  # The curve, in place of all that it needs
            elif makes and need not in OF_MAKES and not OF_ONE_MAKE.isdisjoint(node.needs):
                raise SceneError(
                    f"{where} is not computed for cylinders with bores or diagrams of their own"
                )
            if node.of_shaft and (kind := _missing_of_shaft(node, scene.shaft_keys)):
                part, _, number = kind.partition("_")
                raise SceneError(
                    f"{where} needs {number} of a {part} in [shaft], which no {part} there has"
                )
            along_shaft |= node.throws
            if node.make is None and (need in PARAMETERS or need == "family"):
                missing.setdefault(need, []).append(quantity)
                continue
            waiting += (*node.needs, *node.beside)
            along_shaft |= not ALONG_SHAFT.isdisjoint(node.adds)
        if along_shaft:
            _check_throws(scene, quantity, name)
    if missing:
        raise SceneError(f"{name}: [output] quantities: {_missing_text(scene, missing)}")


def _check_need(scene: Scene, need: str, where: str) -> None:
    """Refuse what a scene asks for without the part of engine, shaft or file that it needs."""
    shaft = scene.engine.shaft
    feature = BY_CONSTANT.get(need)
    if feature is not None and feature.missing and feature.part_of(scene) is None:
        raise SceneError(f"{where} needs {feature.missing}")
    if feature is not None and feature.own_crank and _of_another_crank(scene, feature):
        two = "another crankshaft", f"{feature.written} of the engine"
        raise refused(*two, where, engine=scene.engine.name)
    if need in _NOT_OF_SHAFT and shaft is not None:
        lacks, why = _NOT_OF_SHAFT[need]
        if lacks(shaft):
            raise SceneError(f"{where} {why}")
    if need in _OF_COUPLINGS and shaft and not shaft.couplings(dict.fromkeys(scene.shaft_keys)):
        raise SceneError(
            f"{where} needs a coupling that is not linear: torque_over_twist, clearance "
            "or friction_torque of a shaft"
        )
    if need in OF_FOUR_STROKES and scene.engine.period == TWO_STROKE:
        raise SceneError(
            f"{where} needs a four-stroke engine; a two-stroke engine has "
            "compression_duration and expansion_duration, and interval_duration"
        )
    if need in _OF_PARTS and not _parts_known(scene.words):
        raise SceneError(
            f"{where} needs the separate inertias of flywheel and load, which are not "
            "known if inertia is given as a whole; give flywheel_inertia, "
            "auxiliary_inertia and load_inertia instead, or wanted_delta"
        )


def _check_bank_offset(engines: Sequence[Cylinders], quantity: str, where: str) -> None:
    """Check that a moment does not hang on a distance of banks that nobody gives.

    In the bays of a boxer it does: pins that are a whole distance of throws apart stand in the
    bearings of their bay.
    """
    from engine_dyn.forces.balance.shaking_forces import hangs_on_bank_offset

    order = {"shaking_moment_first": 1, "shaking_moment_second": 2}.get(
        quantity.removesuffix(ELASTICITY)
    )
    for engine in engines:
        if engine.arrangement is None:
            continue  # `_check_throws` refuses these cylinders
        if "bay_" in quantity if is_boxer(engine) else hangs_on_bank_offset(engine, order):
            raise SceneError(
                f"{where} needs bank_offset (offset of each bank from the one before, along the "
                "shaft), without which it is 0 or unknown for "
                f"{engine.arrangement.name or 'this arrangement'}; must be in [set], [axes] or "
                "[designs], 0 where the rods of a pair work in one plane"
            )


def _check_throws(scene: Scene, quantity: str, name: str) -> None:
    """Check that the order of the throws is known for every number of cylinders."""
    if scene.arrangements:
        return
    own = len(scene.own_cylinders.members) if scene.own_cylinders is not None else 0
    two_stroke = scene.engine.period == TWO_STROKE
    for count in scene.counts:
        if count != own and customary_order(count, two_stroke) is None:
            counts = range(1, MOST_CYLINDERS + 1)
            known = {z for z in counts if customary_order(z, two_stroke) is not None}
            orders = ", ".join(str(z) for z in sorted({*known, own} - {0}))
            raise SceneError(
                f"{name}: cylinders = {count}: no firing order is known, which '{quantity}' "
                f"needs; must be one of {orders}"
            )


def _is_of_plain_rods(node: Node) -> bool:
    """Whether a node does not hold for articulated rods."""
    # Nodes that quantities of the cylinders' mechanism need
    mechanism = {"crank_ratio", "offset_ratio", "cylinders_by_count"}
    followed = node.name in FOLLOWED or mechanism.isdisjoint(node.needs)
    return node.name in NOT_FOLLOWED or not followed


def _missing_of_shaft(node: Node, given: Sequence[str]) -> str:
    """Kind of the shaft's numbers that a node needs and no part has; "" otherwise."""
    kinds = (kind for kind in node.of_shaft if node.name in JUDGING and kind in NAN_WITHOUT)
    keys = {key.rpartition("_")[0] for key in given}
    return next((kind for kind in kinds if kind not in keys), "")


def _of_another_crank(scene: Scene, feature: GivenFeature) -> bool:
    """Whether a scene has other throws than those that the engine's part belongs to."""
    engine = scene.engine
    if feature.part_of(scene) is None or feature.given_in(scene.source):
        return False
    own = engine.own_cylinders or even_cylinders(int(engine.values["cylinders"]), engine.period)
    return any(_throws(one) != _throws(own) for one in scene.all_cylinders)


def _throws(engine: Cylinders) -> object:
    """Places and directions of the pins; None where they are not known."""
    made = engine.arrangement
    return made and [(throw.angle, throw.position) for throw in made.throws]


def _missing_text(scene: Scene, missing: Mapping[str, Sequence[str]]) -> str:
    """Text on quantities, the parameters that they lack, and where these belong."""
    file = str(scene.source.get("engine"))
    own = f", or in [values] of {Path(file).name}" if file.endswith(".toml") else ""
    by_place: dict[str, list[str]] = {}
    # Places of parameters that cannot always stand in [set], [axes] or [designs]
    places = {
        RATIO: "in [indicator], the same in each [[diagram]] of an engine file, or "
        f"{GEOMETRIC} in [set] or [values]",
        "family": "in its file, one for each load (`engine-dyn calibrate` makes them from "
        "[data_sheet]), or [indicator]",
    }
    # Parameters of [[diagram]] come first
    for need in sorted(missing, key=lambda need: need in PARAMETERS):
        place = places.get(need, f"in [set], [axes] or [designs]{own}")
        by_place.setdefault(place, []).append(need)
    texts = []
    for place, needs in by_place.items():
        asking = dict.fromkeys(q for need in needs for q in missing[need])
        listed = ", ".join(
            f"{need} ({PARAMETERS[need].long_name})" if need in PARAMETERS else "[[diagram]]"
            for need in needs
        )
        quoted = ", ".join(f"'{quantity}'" for quantity in asking)
        verb = "needs" if len(asking) == 1 else "need"
        why = f"engine {scene.engine.name} does not give"
        if not scene.engine.values.keys().isdisjoint(needs):
            why = f"{why} or the scene replaces"
        texts.append(f"{quoted} {verb} {listed}, which {why}; must be {place}")
    return "; ".join(texts)


def check_start(scene: Scene, name: str) -> None:
    """Check that the speed at the start angle is that of a point of the curves.

    Raises
    ------
    SceneError
        For the first start angle that is none.
    """
    if AT_START not in scene.quantities:
        return
    single = UNLESS_GIVEN["start_angle"] if scene.start_angle is None else scene.start_angle
    table, angles = "solver", np.array([single])
    if scene.gives("start_angle"):
        table, angles, _ = scene.given["start_angle"]
    steps = (angles - 0.5 * math.degrees(scene.engine.period)) / scene.angle_step
    off = np.abs(steps - np.rint(steps)) > 1e-9
    if off.any():
        raise SceneError(
            f"{name}: [{table}] start_angle = {angles[off][0]:g}: '{AT_START}' is a point of the "
            f"speed curve; must be one of its angles, in steps of {scene.angle_step:g} degrees "
            "([output] angle_step)"
        )


def _parts_known(words: tuple[str, ...]) -> bool:
    """Whether the inertia of the flywheel is given apart from others, or can be derived."""
    return "wanted_delta" in words or "inertia_in_parts" in words
