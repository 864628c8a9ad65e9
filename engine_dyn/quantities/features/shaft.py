"""The shaft that twists; physics in `engine_dyn.torsion`, nodes in four files of quantities."""

from __future__ import annotations

from engine_dyn.quantities import shaft_numbers, shaft_passing, shaft_response, torsion
from engine_dyn.quantities.features.feature import Feature
from engine_dyn.quantities.node import Dimension
from engine_dyn.torsion.shaft import Shaft

FEATURE: Feature[Shaft] = Feature(
    "shaft", "discs and shafts that twist", "torsional vibration of the shaft",
    (*torsion.NODES, *shaft_response.NODES, *shaft_passing.NODES, *shaft_numbers.LIMIT_NODES),
    constant="shaft_system", parameters=shaft_passing.PARAMETERS,
    dimensions=(
        Dimension(
            "disc", "", "1", "disc of the shaft, counted from 1; rings of dampers come last",
            whole=True,
        ),
        Dimension(
            "shaft", "", "1", "shaft between two discs, counted from 1; what holds the rings of "
            "dampers comes last", whole=True,
        ),
    ),
    sizes=lambda shaft: (len(shaft.discs), len(shaft.shafts)),
    words=(
        {
            "reciprocating_included": "discs of throws include the mean of their reciprocating "
            "masses",
            "reciprocating_added": "the mean of the reciprocating masses is added to them",
        },
        {
            "no_pendulums": "no pendulums swing on the shaft",
            "pendulums": "pendulums swing on the shaft, whose modes then depend on the speed",
        },
        {
            "linear_couplings": "no coupling has a table of its stiffness",
            "coupling_tables": "the mean torque chooses the stiffness of a coupling in its table",
        },
        {
            "steady_damping": "the damping does not depend on the speed",
            "damping_over_speed": "tables give damping over the speed",
        },
        {
            "no_excitations": "nothing but engine, load and auxiliaries excites the shaft",
            "excitations": "other torques excite the shaft, too",
        },
        {
            "transient_limits_given": "limits of stresses in passing are those given",
            "transient_limits_of_rule": "of propulsion shafts a rule gives those that are missing",
        },
        {
            "damping_of_law": "the load damps the shaft by the slope of its torque over the speed",
            "damping_by_factor": "it damps by a factor on its torque over the speed",
        },
    ),
)  # fmt: skip
of = FEATURE.of
