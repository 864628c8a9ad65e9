"""Moments of an engine that hang on the distance of its banks along the shaft alone."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from engine_dyn.forces.balance.shaking_forces import running_gear
from engine_dyn.geometry.arrangement import SAME_ANGLE, TURN
from engine_dyn.geometry.cylinders import Cylinders


@lru_cache(maxsize=256)
def hangs_on_bank_offset(engine: Cylinders, order: int | None = None) -> bool:
    """Whether an engine's moment is nothing but that of the distance of its banks.

    Without it the moment would be 0, however far the throws are apart. Rods of a star work in one
    plane.

    Parameters
    ----------
    engine : Cylinders
        With known throws.
    order : int, optional
        One order of the moment; otherwise the whole.
    """
    made = engine.arrangement
    if made is None or len(made.banks) == 1 or _is_star(made.banks):
        return False

    def moment(spacing: float, bank_offset: float) -> float:
        gear = running_gear(
            engine, 0.25, 1.0, 1.0, 1.0, spacing=spacing, bank_offset=bank_offset,
        )  # fmt: skip
        return float(gear.moment_max() if order is None else gear.moment_ellipse(order).major)

    # A moment is none below this part of that of one cylinder's inertia force at the distance: V12
    # engines keep 3e-4 of sixth order.
    return moment(1.0, 0.0) < 1e-3 < moment(1e-12, 1.0)


def _is_star(banks: tuple[float, ...]) -> bool:
    angles = np.sort(np.remainder(banks, TURN))
    gaps = np.diff(angles, append=angles[0] + TURN)
    return len(banks) > 2 and bool((np.abs(gaps - TURN / len(banks)) < SAME_ANGLE).all())
