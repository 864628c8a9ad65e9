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
    "calls": 0.00557,
    "values": 7.75e-09,
    "points of curves": 5e-08,
    "revolutions": 0.0001,
    "modelled cycles": 0.000188,
    "mean torques": 1.6e-07,
    "torques": 3.48e-05,
    "tables of torque": 2.3e-05,
    "batch solver with shared tables: tables": 0.000129,
    "batch solver with shared tables: special tables": 6.05e-05,
    "batch solver with shared tables: designs in closed form": 7.86e-08,
    "batch solver with shared tables: designs that iterate": 1.29e-07,
    "batch solver with shared tables: designs with variable inertia": 2e-07,
    "batch solver with curves of each design: tables": 4.81e-05,
    "batch solver with curves of each design: uneven tables": 0.000174,
    "batch solver with curves of each design: designs in closed form": 8.74e-07,
    "batch solver with curves of each design: designs that iterate": 1.36e-06,
    "batch solver with curves of each design: designs with variable inertia": 9.49e-07,
    "batch solver with curves of each design: designs with an offset": 3.5e-06,
    "general solver: designs": 5.65e-05,
    "general solver: driven designs": 5.81e-05,
    "designs by thesis": 0.01,
    "designs by picard": 0.1,
}
"""Seconds that one core takes for one piece of work, by its name."""

SERIAL = frozenset(("calls", "values", "points of curves", "revolutions",
                    "mean torques"))  # fmt: skip
"""Work that is not shared by threads."""


class Recorded(NamedTuple):
    """A study of `benchmarks.studies` that was timed for the calibration."""

    study: str
    designs: int
    cores: int
    seconds: float


RECORDED: tuple[Recorded, ...] = (
    Recorded("one_table", 50000, 2, 0.007639),
    Recorded("one_table", 1000000, 2, 0.04307),
    Recorded("grid_alpha_0", 40000, 2, 0.01765),
    Recorded("grid_alpha_0", 800000, 2, 0.09174),
    Recorded("grid_alpha_1", 40000, 2, 0.01964),
    Recorded("grid_alpha_1", 800000, 2, 0.1091),
    Recorded("grid_alpha_2", 40000, 2, 0.01819),
    Recorded("grid_alpha_2", 800000, 2, 0.09233),
    Recorded("small_grid", 3110, 2, 0.0108),
    Recorded("small_grid", 62208, 2, 0.02488),
    Recorded("sampled", 50000, 2, 0.06713),
    Recorded("sampled", 1000000, 2, 0.7893),
    Recorded("sampled_four", 50000, 2, 0.02753),
    Recorded("sampled_four", 1000000, 2, 0.4336),
    Recorded("any_exponent", 25000, 2, 0.02508),
    Recorded("any_exponent", 500000, 2, 0.3577),
    Recorded("variable", 25000, 2, 0.01836),
    Recorded("variable", 500000, 2, 0.2694),
    Recorded("cycle_time", 2500, 2, 0.006454),
    Recorded("cycle_time", 50000, 2, 0.03666),
    Recorded("pin_offset", 2500, 2, 0.1254),
    Recorded("pin_offset", 50000, 2, 1.279),
    Recorded("stroke_friction", 2500, 2, 0.1576),
    Recorded("stroke_friction", 50000, 2, 1.548),
    Recorded("v6_load", 5000, 2, 0.01097),
    Recorded("v6_load", 100000, 2, 0.05161),
    Recorded("v6_misfire", 500, 2, 0.4026),
    Recorded("v6_misfire", 10000, 2, 0.5972),
    Recorded("driven", 2500, 2, 0.09704),
    Recorded("driven", 50000, 2, 2.039),
    Recorded("angle_load", 2500, 2, 0.07149),
    Recorded("angle_load", 50000, 2, 1.209),
    Recorded("wanted_delta", 2500, 2, 0.01712),
    Recorded("wanted_delta", 50000, 2, 0.1353),
    Recorded("modelled", 300, 2, 0.05241),
    Recorded("modelled", 5000, 2, 0.8082),
    Recorded("grid_errors", 40000, 2, 0.0541),
    Recorded("grid_errors", 800000, 2, 0.273),
)
"""What the seconds were fitted to."""
