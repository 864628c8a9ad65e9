"""Whether the crank turns, and whether parameters of single cylinders and misfires fit it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from engine_dyn.flywheel import mean_diameter
from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.geometry.slider_crank import crank_radius, crank_radius_of_ratio
from engine_dyn.quantities.each_cylinder import OF_CYLINDER, with_values
from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.types import Floats
from sweeps.base.checks import mentioned
from sweeps.base.errors import SceneError
from sweeps.scene.model import Scene
from sweeps.scene.values import GivenValues


def check_mechanism(scene: Scene, name: str) -> None:
    """Check that cranks, rods, the flywheel's ring and single cylinders fit each other.

    Raises
    ------
    SceneError
        For the first that does not; `name` is the scene as messages call it.
    """
    _check_rod(scene, name)
    _check_ring(scene, name)
    _check_turning(scene, extreme_cylinders(scene, name), name)
    _check_misfire(scene, name)


def _check_rod(values: GivenValues, name: str) -> None:
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


def _check_ring(values: GivenValues, name: str) -> None:
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


def extreme_cylinders(scene: Scene, name: str) -> tuple[Cylinders, ...]:
    """Cylinders of the scene, with the parameters of single ones at both ends of what they take.

    Raises
    ------
    SceneError
        For a value that no cylinder of the engine can have.
    """
    keys = scene.cylinder_set_keys
    if not keys:
        return scene.described
    extremes = []
    for engine in scene.all_cylinders:
        for end in (np.min, np.max):
            values = {}
            for key in keys:
                table, given, _ = scene.given_or_own(key)
                values[key] = float(end(given)) * PARAMETERS[key].si
                try:
                    with_values(engine, {k: values[k] for k in ("bore", key) if k in values})
                except ValueError as error:
                    text = mentioned(error).removeprefix(f"{key}: ")
                    where = f"[{table}]" if table else f"engine {scene.engine.name}"
                    raise SceneError(f"{name}: {where} {key}: {text}") from None
            extremes.append(with_values(engine, values))
    return tuple(extremes)


def _check_turning(scene: Scene, extremes: Sequence[Cylinders], name: str) -> None:
    """Check that the crank turns in every combination of the scene: |e| + r < l on each throw."""
    has_rod = scene.gives("rod_length")
    key = "rod_length" if has_rod else "crank_ratio"
    if "offset" in scene.words:
        columns = (_worst(scene, k) for k in ("pin_offset", "crank_offset", "stroke", key))
        for pin, crank, stroke, length in itertools.product(*columns):
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
    elif "equal_throws" not in scene.words:
        largest = scene.given_or_own(key, 0.0).values.max()
        if has_rod:
            strokes = scene.given_or_own("stroke", 0.0).values
            largest = 0.5 * float(strokes.max()) / float(scene.given[key].values.min())
        try:
            for engine in extremes:
                engine.check_turning(largest)
        except ValueError as error:
            raise SceneError(f"{name}: {_place_of_radii(scene)} {mentioned(error)}") from None


def _worst(values: GivenValues, parameter: str) -> list[Floats]:
    """Values of a parameter that may be worst: columns of designs, row by row, or the extremes."""
    # NaN where neither scene nor engine has a value.
    default = 0.0 if parameter.endswith("offset") else np.nan
    given = values.given_or_own(parameter, default)
    if given.table == "designs":
        return [given.values]
    return [np.array([value]) for value in {given.values.min(), given.values.max()}]


def _place_of_radii(scene: Scene) -> str:
    """Place where the crank radii of single cylinders are given."""
    for key in scene.cylinder_keys:
        if OF_CYLINDER[key].what == "radius_factor":
            return f"[{scene.table_of(key)}]"
    if scene.arrangements:
        return "[axes] arrangement:"
    own = scene.own_cylinders is scene.engine.own_cylinders
    return f"engine {scene.engine.name}" if own else "[set]"


def _check_misfire(values: GivenValues, name: str) -> None:
    """Check that the cylinder that does not burn is one of the engine's in every combination."""
    table, silent, _ = values.given_or_own("misfire", 0.0)
    of_count, counts, _ = values.given_or_own("cylinders")
    if not of_count == table == "designs":  # Unless both are columns, all values meet
        silent, counts = silent.max(keepdims=True), counts.min(keepdims=True)
    wrong = np.flatnonzero(silent > counts)
    if wrong.size:
        most = np.broadcast_to(counts, silent.shape)[wrong[0]]
        raise SceneError(
            f"{name}: [{table or 'set'}] misfire = {silent[wrong[0]]:g}: must be the number of one "
            f"of {most:g} cylinders, or 0"
        )
