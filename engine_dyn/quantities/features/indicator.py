"""The measured diagram of a scene, in place of those of its engine: which diagrams hold, and where.

The diagram itself is an `engine_dyn.pressure.diagram.Diagram`, or the mean of recorded cycles, each
of which may be chosen by its number. What follows from any diagram stands in
`engine_dyn.quantities.pressure`.
"""

from __future__ import annotations

from typing import Any

from engine_dyn.quantities.features.feature import Feature
from engine_dyn.quantities.node import Node

FEATURE: Feature[Any] = Feature(
    "indicator", "measured diagram in place of the engine's", "pressure, work and power", (
        Node(
            "place", "", "1", "place of the recorded cycle in the table", kind="value",
            public=False, when="over_cycles", make=lambda recorded_cycle: recorded_cycle - 1.0,
        ),
    ),
    words=(
        {
            "over_load": "the engine's diagrams depend on the load",
            "over_speed": "the engine's diagrams depend on load and speed",
            "over_cycles": "the diagrams are recorded cycles, chosen by their numbers",
        },
        {
            "one_scale": "the diagrams are those of all speeds, or those of each are given",
            "scale_over_speed": "a factor on the engine's diagrams depends on the speed",
        },
    ),
)  # fmt: skip
