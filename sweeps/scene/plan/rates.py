"""Seconds behind the estimated time of `engine-dyn plan`, and nothing else.

Written by `python -m benchmarks rates`, which fits it to `benchmarks/recorded_times.csv`; change
that, not this.
"""

from __future__ import annotations

START = 1.0  # Seconds that loading a command's modules takes

WRITING = 3e-9  # Seconds that writing a byte of an archive takes

SECONDS: dict[str, float] = {
    "calls": 0.00872,
    "values": 5.62e-08,
    "revolutions": 0.0001,
    "modelled cycles": 8.92e-05,
    "columns of diagrams": 4.38e-05,
    "torques": 6.6e-06,
    "batch solver: designs of exponent 2": 4.22e-07,
    "batch solver: designs that iterate": 1.17e-06,
    "batch solver: designs with curves": 3.2e-05,
    "general solver: designs": 0.0001,
    "designs by thesis": 0.015,
}
"""Seconds that one core takes for one piece of each kind of work."""

SERIAL = frozenset(("calls", "values", "revolutions", "columns of diagrams"))
"""Kinds of work that threads do not share."""
