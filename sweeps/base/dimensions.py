"""Names of the dimensions, labels and published values that scenes add to their quantities.

Scenes, plans and archives use the same names; each stands here alone.
"""

from __future__ import annotations

__all__ = [
    "ARRANGEMENT",
    "COMPARED",
    "COUNTED",
    "DESIGN",
    "ELASTICITY",
    "ENGINE",
    "EXPLAINED",
    "FAILED_DRAWS",
    "FIRING_PATTERN",
    "FOUND",
    "FULFILLING",
    "GENERATION",
    "HIGH",
    "INERTIA_MODEL",
    "LABELS",
    "LOW",
    "METHOD",
    "NOT_CHOSEN",
    "OF_ORDERS",
    "OF_PATTERNS",
    "PARAMETER",
    "PUBLISHED",
    "RANK",
    "REDUCTION",
    "RESTART",
    "SEARCHED",
    "SHARE",
    "STATE",
    "STATUS",
    "TORSION_STATUS",
    "UNCERTAIN",
]

DESIGN = "design"
"""Dimension of [designs]: parameters that vary together."""

ARRANGEMENT = "arrangement"
"""Dimension of [axes] arrangement, an axis of words."""

ENGINE = "engine"
"""Dimension of [axes] engine, an axis of words."""

FIRING_PATTERN = "firing_pattern"
"""Dimension of [axes] firing_pattern, an axis of words."""

COUNTED = ("throw", "bay", "piston", "main_bearing", "mount", "cylinder")
"""Dimensions whose points are parts of an engine, between which there is nothing."""

METHOD, INERTIA_MODEL = "method", "inertia_model"
"""Dimensions of [solver] method and inertia_model where they are lists: axes of words."""

NOT_CHOSEN = (
    "speed", "load", "characteristic_share", "recorded_cycle", "cycle_number", "misfire",
    "wanted_delta", METHOD, INERTIA_MODEL, "truncation",
)  # fmt: skip
"""Axes and columns that are not chosen with a design: operating points, recorded cycles and
misfires that it meets, what is wanted of it, and how it is computed. A search takes none of their
values for the best one unless it is asked to."""

LABELS = ("case", ENGINE, ARRANGEMENT, FIRING_PATTERN)
"""Columns of [designs] that hold texts: the name of each design, its engine, arrangement and firing
pattern."""

PARAMETER = "parameter"
"""Dimension of elasticities: the parameters that derivatives are taken by, by their keys."""

UNCERTAIN = "uncertain_parameter"
"""Dimension of shares of an uncertainty: the parameters that are not well known, by their keys."""

PUBLISHED = "_published"
"""Ending of the variables that hold a scene's [reference], beside the quantities' own."""

ELASTICITY = "_elasticity"
"""Ending of the elasticities of a quantity, over `PARAMETER`."""

LOW, HIGH, EXPLAINED, SHARE = "_low", "_high", "_explained", "_share"
"""Endings of what is known of the uncertainty of a quantity: the ends of its band, the part of the
variance that is linear, and the shares of the parameters, over `UNCERTAIN`."""

OF_ORDERS = "firing_orders"
"""Attribute of archives of all firing orders of an engine: how they were chosen, and how many there
are, as JSON."""

OF_PATTERNS = "firing_patterns"
"""Attribute of archives of firing patterns of a density: how they were ranked, as JSON."""

REDUCTION = "reduction"
"""Attribute of archives that hold what was asked of all designs together, in place of each: what
[reduce] asked for and what its searches found, as JSON."""

RANK, STATE = "rank", "reduction_state"
"""Their variables beside designs and numbers: the rank of each kept design by each search, and what
`merge` needs, as a ZIP file of NumPy's arrays."""

FAILED_DRAWS = "failed_draws"
"""Variable that counts the draws of uncertain values in which a design has no result."""

GENERATION, RESTART, FOUND, FULFILLING = "generation", "restart", "found", "fulfilling"
"""Columns of designs that a search computed: when it came to each, whether it is what was found,
and whether it fulfils the conditions."""

SEARCHED = (GENERATION, RESTART, FOUND, FULFILLING)

STATUS, TORSION_STATUS = "status", "torsion_status"
"""Variables with the outcome of each design: of its speed, and of the vibration of its shaft."""

COMPARED = "_compared"
"""Ending of the variables of a second archive beside those of the first."""
