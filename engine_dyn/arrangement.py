"""In-line engines: customary firing orders, phases of the cylinders, torque along the shaft."""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = [
    "CUSTOMARY_ORDERS",
    "MOST_CYLINDERS",
    "customary_order",
    "firing_phases",
    "phases_along_shaft",
]

MOST_CYLINDERS = 16

CUSTOMARY_ORDERS: dict[int, tuple[int, ...]] = {
    1: (1,),
    2: (1, 2),
    3: (1, 3, 2),
    4: (1, 3, 4, 2),
    5: (1, 2, 4, 5, 3),
    6: (1, 5, 3, 6, 2, 4),
    7: (1, 2, 4, 6, 7, 5, 3),
    8: (1, 5, 2, 6, 8, 4, 7, 3),
}
"""Firing orders of in-line four-stroke engines. 6 and 8: Kakaitsas (2015), section 5.4; 3, 4, 5
as Bosch Automotive Handbook; 2 with both pistons in step (360 degree firing interval); 7 as in
medium-speed marine engines."""


def customary_order(cylinders: int) -> tuple[int, ...] | None:
    """Return the customary firing order, or None where this project knows none (9 and more)."""
    return CUSTOMARY_ORDERS.get(int(cylinders))


def firing_phases(cylinders: int, period: float) -> Any:
    """Angles [rad] to add to the engine's crank angle to get each cylinder's own, evenly spaced.

    In firing order: the cylinder that fires i-th reaches its top dead centre i Phi/Z later. Their
    order does not matter to the sum over all cylinders.
    """
    return -np.arange(cylinders) * (period / cylinders)


def phases_along_shaft(order: tuple[int, ...], period: float) -> Any:
    """Phase [rad] of cylinders 1, 2, ... Z as they stand along the shaft, from the firing order."""
    cylinders = len(order)
    phases = np.empty(cylinders)
    for place, cylinder in enumerate(order):
        phases[cylinder - 1] = -place * (period / cylinders)
    return phases
