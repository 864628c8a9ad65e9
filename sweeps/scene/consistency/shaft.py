"""Whether the shaft of a scene fits its engine, and the keys of single discs fit the shaft."""

from __future__ import annotations

from engine_dyn.quantities.features import auxiliaries
from engine_dyn.quantities.shaft_numbers import OF_SHAFT
from engine_dyn.torsion.shaft import Shaft
from sweeps.base.errors import SceneError, counted, shown
from sweeps.scene.cylinders import cylinders_of_count
from sweeps.scene.features.shaft import SHAFT_KEYS
from sweeps.scene.model import Scene


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
    """Check that what the limit of a propulsion shaft follows from is complete."""
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
    engines = scene.arrangements or (cylinders_of_count(scene, scene.counts[0]),)
    for engine in engines:
        along = engine.along_shaft
        count = engine.count if along is None else len(along)
        if count != len(shaft.throws):
            raise SceneError(
                f"{name}: shaft: has discs for {counted(len(shaft.throws), 'throw')}, the engine "
                f"{scene.engine.name} has {counted(count, 'throw')}; must be equally many"
            )
