"""All checks of a whole scene, in the order in which a person wants to hear of them."""

from __future__ import annotations

from sweeps.scene.consistency.cylinders import check_misfire, check_single_cylinders
from sweeps.scene.consistency.friction import check_friction_fractions, check_friction_law
from sweeps.scene.consistency.loads import check_driven
from sweeps.scene.consistency.outputs import check_needs, check_start
from sweeps.scene.consistency.pressure import (
    check_cycles,
    check_diagram_count,
    check_load,
    check_motored,
    check_recorded_cycles,
    check_speed,
)
from sweeps.scene.consistency.rod import check_offset, check_rod, check_throw_radii
from sweeps.scene.model import Scene

__all__ = ["check_scene"]


def check_scene(scene: Scene, name: str) -> None:
    """Check what depends on the engine, or on several parameters.

    Raises
    ------
    SceneError
        For the first thing that does not fit.
    """
    check_load(scene, name)
    check_recorded_cycles(scene, name)
    check_speed(scene, name)
    check_cycles(scene, name)
    check_diagram_count(scene, name)
    check_rod(scene, name)
    check_single_cylinders(scene, name)
    check_offset(scene, name)
    check_throw_radii(scene, name)
    check_misfire(scene, name)
    check_friction_law(scene, name)
    check_friction_fractions(scene, name)
    check_motored(scene, name)
    check_driven(scene, name)
    check_needs(scene, name)
    check_start(scene, name)
