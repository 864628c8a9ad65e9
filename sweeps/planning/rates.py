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
    "calls": 0.0078,
    "values": 2.11e-08,
    "points of curves": 5e-08,
    "revolutions": 0.0001,
    "modelled cycles": 0.00027,
    "mean torques": 1.2e-08,
    "torques": 3.48e-05,
    "tables of torque": 2.3e-05,
    "batch solver with shared tables: tables": 0.000164,
    "batch solver with shared tables: special tables": 6.07e-05,
    "batch solver with shared tables: designs in closed form": 1.66e-07,
    "batch solver with shared tables: designs that iterate": 4.28e-07,
    "batch solver with shared tables: designs with variable inertia": 2e-07,
    "batch solver with curves of each design: tables": 4.45e-05,
    "batch solver with curves of each design: uneven tables": 0.000227,
    "batch solver with curves of each design: designs in closed form": 1.75e-06,
    "batch solver with curves of each design: designs that iterate": 2e-06,
    "batch solver with curves of each design: designs with variable inertia": 1.32e-06,
    "batch solver with curves of each design: designs with an offset": 5.21e-06,
    "general solver: designs": 5.65e-05,
    "general solver: driven designs": 0.000117,
    "designs by thesis": 0.01,
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
    Recorded("one_table", 10000, 2, 0.009072),
    Recorded("one_table", 200000, 2, 0.02064),
    Recorded("grid_alpha_0", 8000, 2, 0.02059),
    Recorded("grid_alpha_0", 160000, 2, 0.09478),
    Recorded("grid_alpha_1", 8000, 2, 0.0156),
    Recorded("grid_alpha_1", 160000, 2, 0.07498),
    Recorded("grid_alpha_2", 8000, 2, 0.01396),
    Recorded("grid_alpha_2", 160000, 2, 0.06907),
    Recorded("small_grid", 622, 2, 0.01425),
    Recorded("small_grid", 12441, 2, 0.02278),
    Recorded("sampled", 10000, 2, 0.05056),
    Recorded("sampled", 200000, 2, 0.3947),
    Recorded("sampled_four", 10000, 2, 0.01883),
    Recorded("sampled_four", 200000, 2, 0.1908),
    Recorded("any_exponent", 5000, 2, 0.01197),
    Recorded("any_exponent", 100000, 2, 0.1283),
    Recorded("variable", 5000, 2, 0.009123),
    Recorded("variable", 100000, 2, 0.1025),
    Recorded("cycle_time", 500, 2, 0.008208),
    Recorded("cycle_time", 10000, 2, 0.01728),
    Recorded("pin_offset", 500, 2, 0.009699),
    Recorded("pin_offset", 10000, 2, 0.03544),
    Recorded("stroke_friction", 500, 2, 0.02596),
    Recorded("stroke_friction", 10000, 2, 0.2957),
    Recorded("v6_load", 1000, 2, 0.01248),
    Recorded("v6_load", 20000, 2, 0.02465),
    Recorded("v6_misfire", 300, 2, 0.3587),
    Recorded("v6_misfire", 2000, 2, 0.622),
    Recorded("driven", 500, 2, 0.0158),
    Recorded("driven", 10000, 2, 0.03559),
    Recorded("angle_load", 500, 2, 0.01613),
    Recorded("angle_load", 10000, 2, 0.02553),
    Recorded("wanted_delta", 500, 2, 0.01315),
    Recorded("wanted_delta", 10000, 2, 0.05985),
    Recorded("modelled", 300, 2, 0.06757),
    Recorded("modelled", 1000, 2, 0.2467),
    Recorded("grid_errors", 8000, 2, 0.035),
    Recorded("grid_errors", 160000, 2, 0.1938),
)
"""What the seconds were fitted to."""
