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
    "calls": 0.00588,
    "values": 4.62e-08,
    "points of curves": 5e-08,
    "revolutions": 0.0001,
    "modelled cycles": 7.33e-05,
    "mean torques": 1.2e-08,
    "groups of designs": 0.0007,
    "columns of diagrams": 4.01e-05,
    "columns of friction": 0.00382,
    "columns added up": 3.76e-09,
    "torques": 6.6e-06,
    "batch solver: designs of exponent 2": 3.83e-07,
    "batch solver: designs that iterate": 1.17e-06,
    "batch solver: designs with curves": 3.2e-05,
    "general solver: designs": 0.0001,
    "designs by thesis": 0.015,
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
    Recorded("one_table", 50000, 1, 0.02269),
    Recorded("one_table", 1000000, 1, 0.3302),
    Recorded("grid_alpha_0", 40000, 1, 0.05567),
    Recorded("grid_alpha_0", 800000, 1, 0.958),
    Recorded("grid_alpha_1", 40000, 1, 0.04117),
    Recorded("grid_alpha_1", 800000, 1, 0.9798),
    Recorded("grid_alpha_2", 40000, 1, 0.02731),
    Recorded("grid_alpha_2", 800000, 1, 0.5751),
    Recorded("small_grid", 3110, 1, 0.01582),
    Recorded("small_grid", 62208, 1, 0.04816),
    Recorded("sampled", 50000, 1, 0.174),
    Recorded("sampled", 1000000, 1, 1.799),
    Recorded("sampled_four", 50000, 1, 0.04091),
    Recorded("sampled_four", 1000000, 1, 0.7043),
    Recorded("any_exponent", 25000, 1, 0.0404),
    Recorded("any_exponent", 500000, 1, 0.8361),
    Recorded("variable", 25000, 1, 0.041),
    Recorded("variable", 500000, 1, 0.7315),
    Recorded("cycle_time", 2500, 1, 0.009082),
    Recorded("cycle_time", 50000, 1, 0.09906),
    Recorded("pin_offset", 2500, 1, 0.01954),
    Recorded("pin_offset", 50000, 1, 0.08312),
    Recorded("stroke_friction", 2500, 1, 0.01001),
    Recorded("stroke_friction", 50000, 1, 0.06218),
    Recorded("v6_load", 5000, 1, 0.02844),
    Recorded("v6_load", 100000, 1, 0.09285),
    Recorded("v6_misfire", 500, 1, 0.179),
    Recorded("v6_misfire", 10000, 1, 0.294),
    Recorded("driven", 2500, 1, 0.01679),
    Recorded("driven", 50000, 1, 0.1673),
    Recorded("angle_load", 2500, 1, 0.01194),
    Recorded("angle_load", 50000, 1, 0.05074),
    Recorded("wanted_delta", 2500, 1, 0.01597),
    Recorded("wanted_delta", 50000, 1, 0.176),
    Recorded("modelled", 300, 1, 0.06241),
    Recorded("modelled", 5000, 1, 0.8939),
    Recorded("grid_errors", 40000, 1, 0.06844),
    Recorded("grid_errors", 800000, 1, 1.558),
)
"""What the seconds were fitted to."""
