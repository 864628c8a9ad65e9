"""Dynamics of reciprocating engines: physics in SI units and radians, compiled where it pays.

Angle zero is firing top dead centre of cylinder 1; torque is positive in the sense of rotation.
"""

from typing import TYPE_CHECKING, Any

from engine_dyn.geometry.slider_crank import acceleration, position, rod_angle, velocity
from engine_dyn.plausibility.judgement import Implausible, ImplausibleWarning, implausible
from engine_dyn.pressure.diagram import Diagram, diagram_from_points
from engine_dyn.pressure.family import Family, family_from_diagrams

if TYPE_CHECKING:
    from engine_dyn.speed.api import PeriodicSpeed, periodic_speed

__all__ = [
    "Diagram",
    "Family",
    "Implausible",
    "ImplausibleWarning",
    "PeriodicSpeed",
    "acceleration",
    "diagram_from_points",
    "family_from_diagrams",
    "implausible",
    "periodic_speed",
    "position",
    "rod_angle",
    "velocity",
]


def __getattr__(name: str) -> Any:
    if name in {"PeriodicSpeed", "periodic_speed"}:
        # This import loads the compiler, which listing quantities does not need.
        from engine_dyn.speed import api

        return getattr(api, name)
    if name == "__version__":
        from importlib.metadata import version

        return version("engine-dyn")
    raise AttributeError(f"module 'engine_dyn' has no attribute {name!r}")
