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
    "calls": 0.00576,
    "values": 4.39e-08,
    "points of curves": 5e-08,
    "revolutions": 0.0001,
    "modelled cycles": 0.0001,
    "mean torques with an offset": 4e-06,
    "torques": 3.48e-05,
    "tables of torque": 2.3e-05,
    "batch solver with shared tables: tables": 0.000201,
    "batch solver with shared tables: special tables": 0.000101,
    "batch solver with shared tables: designs in closed form": 1.37e-07,
    "batch solver with shared tables: designs that iterate": 2.84e-08,
    "batch solver with shared tables: designs with variable inertia": 2e-07,
    "batch solver with curves of each design: tables": 0.000236,
    "batch solver with curves of each design: designs in closed form": 1.4e-06,
    "batch solver with curves of each design: designs that iterate": 1.89e-06,
    "batch solver with curves of each design: designs with variable inertia": 1.05e-06,
    "general solver: designs": 5.65e-05,
    "general solver: driven designs": 0.000101,
    "designs by thesis": 0.01,
    "designs by picard": 0.1,
}
"""Seconds that one core takes for one piece of work, by its name."""

SERIAL = frozenset(("calls", "values", "points of curves", "revolutions",
                    "mean torques with an offset"))  # fmt: skip
"""Work that is not shared by threads."""


class Recorded(NamedTuple):
    """A study of `benchmarks.studies` that was timed for the calibration."""

    study: str
    designs: int
    cores: int
    seconds: float


RECORDED: tuple[Recorded, ...] = (
    Recorded("one_table", 5000, 2, 0.008455),
    Recorded("one_table", 100000, 2, 0.01227),
    Recorded("grid_alpha_0", 4000, 2, 0.0148),
    Recorded("grid_alpha_0", 80000, 2, 0.04356),
    Recorded("grid_alpha_1", 4000, 2, 0.01362),
    Recorded("grid_alpha_1", 80000, 2, 0.03562),
    Recorded("grid_alpha_2", 4000, 2, 0.01114),
    Recorded("grid_alpha_2", 80000, 2, 0.04997),
    Recorded("small_grid", 311, 2, 0.00848),
    Recorded("small_grid", 6220, 2, 0.02853),
    Recorded("sampled", 5000, 2, 0.749),
    Recorded("sampled", 100000, 2, 1.19),
    Recorded("sampled_four", 5000, 2, 0.00948),
    Recorded("sampled_four", 100000, 2, 0.06571),
    Recorded("any_exponent", 2500, 2, 0.01126),
    Recorded("any_exponent", 50000, 2, 0.06657),
    Recorded("variable", 2500, 2, 0.008006),
    Recorded("variable", 50000, 2, 0.04975),
    Recorded("cycle_time", 300, 2, 0.01647),
    Recorded("cycle_time", 5000, 2, 0.139),
    Recorded("pin_offset", 300, 2, 0.02087),
    Recorded("pin_offset", 5000, 2, 0.2389),
    Recorded("stroke_friction", 300, 2, 0.02643),
    Recorded("stroke_friction", 5000, 2, 0.303),
    Recorded("v6_load", 500, 2, 0.03951),
    Recorded("v6_load", 10000, 2, 0.05738),
    Recorded("v6_misfire", 300, 2, 0.3604),
    Recorded("v6_misfire", 1000, 2, 0.6949),
    Recorded("driven", 300, 2, 0.02661),
    Recorded("driven", 5000, 2, 0.3372),
    Recorded("angle_load", 300, 2, 0.02755),
    Recorded("angle_load", 5000, 2, 0.1965),
    Recorded("wanted_delta", 300, 2, 0.02139),
    Recorded("wanted_delta", 5000, 2, 0.1125),
    Recorded("modelled", 300, 2, 0.05768),
    Recorded("modelled", 3000, 2, 0.4336),
    Recorded("grid_errors", 4000, 2, 0.02592),
    Recorded("grid_errors", 80000, 2, 0.08725),
)
"""What the seconds were fitted to."""
