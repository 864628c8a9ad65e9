"""Seconds behind the estimated time of `engine-dyn plan`, and nothing else.

Written by `python -m benchmarks rates`; change that, not this.
"""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["RECORDED", "SECONDS", "SERIAL", "START", "WRITING", "Recorded"]

START = 1.0
"""Seconds to load what a command needs."""

WRITING = 3e-9
"""Seconds to write a byte of an archive."""

SECONDS: dict[str, float] = {
    "calls": 0.00756,
    "values": 8.31e-08,
    "points of curves": 5e-08,
    "revolutions": 0.0001,
    "modelled cycles": 8.95e-05,
    "mean torques": 1.2e-08,
    "groups of designs": 0.00289,
    "columns of diagrams": 4.05e-05,
    "columns of friction": 0.00243,
    "columns added up": 4.01e-09,
    "torques": 6.6e-06,
    "batch solver: designs of exponent 2": 5.22e-07,
    "batch solver: designs that iterate": 1.82e-06,
    "batch solver: designs with curves": 3.2e-05,
    "general solver: designs": 0.0001,
    "designs by thesis": 0.01,
}
"""Seconds that one core takes for one piece of work, by its name."""

SERIAL = frozenset(("calls", "values", "points of curves", "revolutions", "groups of designs",
                    "columns of diagrams", "columns of friction",
                    "mean torques"))  # fmt: skip
"""Work that is not shared by threads."""


class Recorded(NamedTuple):
    """A study of `benchmarks.studies` that was timed for the calibration."""

    study: str
    designs: int
    cores: int
    seconds: float


RECORDED: tuple[Recorded, ...] = (
    Recorded("one_table", 10000, 1, 0.01253),
    Recorded("one_table", 200000, 1, 0.1094),
    Recorded("grid_alpha_0", 8000, 1, 0.05313),
    Recorded("grid_alpha_0", 160000, 1, 0.2816),
    Recorded("grid_alpha_1", 8000, 1, 0.05453),
    Recorded("grid_alpha_1", 160000, 1, 0.2745),
    Recorded("grid_alpha_2", 8000, 1, 0.04154),
    Recorded("grid_alpha_2", 160000, 1, 0.158),
    Recorded("small_grid", 622, 1, 0.03566),
    Recorded("small_grid", 12441, 1, 0.04292),
    Recorded("sampled", 10000, 1, 0.1754),
    Recorded("sampled", 200000, 1, 0.5362),
    Recorded("sampled_four", 10000, 1, 0.0176),
    Recorded("sampled_four", 200000, 1, 0.23),
    Recorded("any_exponent", 5000, 1, 0.02136),
    Recorded("any_exponent", 100000, 1, 0.2749),
    Recorded("variable", 5000, 1, 0.02049),
    Recorded("variable", 100000, 1, 0.241),
    Recorded("pin_offset", 500, 1, 0.01919),
    Recorded("pin_offset", 10000, 1, 0.08603),
    Recorded("stroke_friction", 500, 1, 0.01584),
    Recorded("stroke_friction", 10000, 1, 0.02446),
    Recorded("v6_load", 1000, 1, 0.03109),
    Recorded("v6_load", 20000, 1, 0.0493),
    Recorded("v6_misfire", 300, 1, 0.1791),
    Recorded("v6_misfire", 2000, 1, 0.3258),
    Recorded("driven", 500, 1, 0.01217),
    Recorded("driven", 10000, 1, 0.04818),
    Recorded("angle_load", 500, 1, 0.01636),
    Recorded("angle_load", 10000, 1, 0.02344),
    Recorded("wanted_delta", 500, 1, 0.02079),
    Recorded("wanted_delta", 10000, 1, 0.07242),
    Recorded("modelled", 300, 1, 0.06317),
    Recorded("modelled", 1000, 1, 0.2111),
    Recorded("grid_errors", 8000, 1, 0.08817),
    Recorded("grid_errors", 160000, 1, 0.3477),
)
"""What the seconds were fitted to."""
