"""Dynamics of reciprocating engines: physics in SI units and radians, compiled where it pays.

Angle zero is firing top dead centre of cylinder 1; torque is positive in the sense of rotation.
"""

from engine_dyn.geometry.slider_crank import acceleration, position, rod_angle, velocity
from engine_dyn.plausibility.judgement import Implausible, ImplausibleWarning, implausible
from engine_dyn.pressure.diagram import Diagram, diagram_from_points
from engine_dyn.pressure.family import Family, family_from_diagrams
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
