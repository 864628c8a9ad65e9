"""Values of an engine file without a scene: what is not usual."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from engine_dyn.geometry.masses import reciprocating_mass
from engine_dyn.plausibility.judgement import implausible
from engine_dyn.quantities.graph import PARAMETERS
from sweeps.scene.engine.silenced_warnings import ALL


def unusual_values(values: Mapping[str, float], silenced: Sequence[str], name: str) -> list[str]:
    """One line for each measure of values, as `read_values` returns them, outside its usual range.

    Spacings of cylinders are left to scenes, which know the arrangement.
    """
    si: dict[str, Any] = {
        key: value * PARAMETERS[key].si for key, value in values.items() if key in PARAMETERS
    }  # fmt: skip
    if si.keys() >= {"stroke", "crank_ratio"}:
        si["rod"] = 0.5 * si["stroke"] / si["crank_ratio"]
    parts = ("piston_mass", "rod_mass", "rod_centre_of_gravity", "rod")
    if si.keys() >= set(parts):
        si["reciprocating_mass"] = reciprocating_mass(*(si[key] for key in parts))
    left = (*silenced, "cylinder_spacing", "boxer_spacing")
    unusual = () if ALL in silenced else implausible(silenced=left, **si)
    return [f"{name}: {one}" for one in unusual]
