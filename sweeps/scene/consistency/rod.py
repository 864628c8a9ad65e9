"""Whether lengths fit each other in every combination of a scene: cranks turn, rings are rings."""

from __future__ import annotations

import itertools

import numpy as np

from engine_dyn.flywheel import mean_diameter
from engine_dyn.geometry.slider_crank import crank_radius, crank_radius_of_ratio
from engine_dyn.quantities.each_cylinder import OF_CYLINDER
from engine_dyn.types import Floats
from sweeps.base.checks import mentioned
from sweeps.base.errors import SceneError
from sweeps.scene.consistency.cylinders import extreme_cylinders
from sweeps.scene.model import Scene
from sweeps.scene.values import GivenValues


def check_rod(values: GivenValues, name: str) -> None:
    """Check that the rod is longer than half the stroke in every combination of the scene."""
    given = values.given.get("rod_length")
    if given is None:
        return
    table, rods, _ = given
    of_stroke, strokes, _ = values.given_or_own("stroke", 0.0)
    if not of_stroke == table == "designs":  # not column by column: all with all
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
    together = outer.table == inner.table == "designs"  # column by column
    try:
        mean_diameter(outer.values if together else outer.values[:, None], inner.values)
    except ValueError as error:
        raise SceneError(f"{name}: {error}") from None


def check_offset(scene: Scene, name: str) -> None:
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
            continue  # another check says what is missing
        try:
            if has_rod:
                radius = crank_radius(stroke, length, pin + crank)
                ratio = radius / length
            else:
                radius, ratio = crank_radius_of_ratio(stroke, length, pin + crank), length
            for engine in extreme_cylinders(scene, name):
                engine.check_turning(ratio, (pin + crank) / radius)
        except ValueError as error:
            offset = "pin_offset" if pin.any() else "crank_offset"
            table = scene.given_or_own(offset).table
            where = f"[{table}] " if table else f"engine {scene.engine.name} "
            raise SceneError(f"{name}: {where}{offset}: {mentioned(error)}") from None


def _worst(values: GivenValues, parameter: str) -> list[Floats]:
    """Values of a parameter that may be worst: columns of designs, which go together, or the ends.

    NaN where neither scene nor engine has a value.
    """
    default = 0.0 if parameter.endswith("offset") else np.nan
    found = values.given_or_own(parameter, default)
    if found.table == "designs":
        return [found.values]
    return [np.array([value]) for value in {found.values.min(), found.values.max()}]


def check_throw_radii(scene: Scene, name: str) -> None:
    """Check that the crank turns on throws of unequal radius; see `check_offset` for offsets."""
    words = scene.words
    if "equal_throws" in words or "offset" in words:
        return
    if scene.gives("rod_length"):
        stroke = float(scene.given_or_own("stroke", 0.0).values.max())
        ratio = 0.5 * stroke / float(scene.given["rod_length"].values.min())
    else:
        ratio = float(scene.given_or_own("crank_ratio", 0.0).values.max())
    for engine in extreme_cylinders(scene, name):
        try:
            engine.check_turning(ratio)
        except ValueError as error:
            raise SceneError(f"{name}: {_place_of_radii(scene)} {mentioned(error)}") from None


def _place_of_radii(scene: Scene) -> str:
    """Where the crank radii of single cylinders are given."""
    for key in scene.cylinder_keys:
        if OF_CYLINDER[key].what == "radius_factor":
            return f"[{scene.table_of(key)}]"
    if scene.arrangements:
        return "[axes] arrangement:"
    own = scene.own_cylinders is scene.engine.own_cylinders
    return f"engine {scene.engine.name}" if own else "[set]"
