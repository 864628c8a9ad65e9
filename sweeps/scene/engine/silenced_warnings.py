"""The key `silenced_warnings` of scenes and engine files: plausibility checks that are left out."""

from __future__ import annotations

from collections.abc import Sequence

from engine_dyn.plausibility.usual_ranges import NAMES, RECORDING_CHECKS
from sweeps.base.errors import SceneError, not_known, shown

ALL = "all"  # Word that silences every check

STATED_UNIT = "stated_unit"
"""Name of the warning that a file states another unit than the one given."""

BRAKE_TORQUE = "brake_torque"
"""Name of the warning that a recording gives less torque than was measured at the shaft."""

DIAGRAM_SPEEDS = "diagram_speeds"
"""Name of the warning that diagrams are used at speeds for which they do not hold."""

RIGID_SHAFT = "rigid_shaft"
"""Name of the warning that the rigid engine is far from the elastic shaft."""

RECIPROCATING_SHARE = "reciprocating_share"
"""Name of the warning that the reciprocating masses vary a shaft's inertia much."""

SHAFT_SECTION = "shaft_section"
"""Name of the warning that stiffness and section do not fit a steel shaft."""

LINEAR_COUPLING = "linear_coupling"
"""Name of the warning that linear results are those of couplings that are not linear."""

KNOWN = (
    *NAMES,
    *RECORDING_CHECKS,
    STATED_UNIT,
    BRAKE_TORQUE,
    DIAGRAM_SPEEDS,
    RIGID_SHAFT,
    RECIPROCATING_SHARE,
    SHAFT_SECTION,
    LINEAR_COUPLING,
    ALL,
)
"""Names of the checks of input, results and recorded pressure."""

SILENCED = (
    f"a list of names of plausibility checks to silence, or ['{ALL}']; see the page "
    "'Plausibility warnings'"
)
"""Meaning of the key `silenced_warnings`, with the allowed values."""


def read_silenced(names: Sequence[str], name: str) -> tuple[str, ...]:
    """Check names of checks that are left out; `name` is the file as messages call it."""
    for word in names:
        if word not in KNOWN:
            raise SceneError(
                f"{name}: silenced_warnings: {shown(word)}: no such check{not_known(word, KNOWN)}"
            )
    return tuple(names)
