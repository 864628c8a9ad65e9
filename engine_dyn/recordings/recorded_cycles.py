"""Recorded cycles: cylinder pressure on one grid of crank angles, and what checks say of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.types import Floats


@dataclass(frozen=True)
class Finding:
    """One thing about a recording that is not as it should be. Its text is one line.

    Attributes
    ----------
    check : str
        Under which it is silenced.
    text : str
        The place, the number, what is usual, and what may be meant.
    value : float
        The number, in `unit`; NaN where there is none.
    unit : str
        Unit of `value`.
    """

    check: str
    text: str
    value: float
    unit: str = ""

    def __str__(self) -> str:
        return f"{self.check}: {self.text}"


@dataclass(frozen=True, eq=False)
class RecordedCycles:
    """Cylinder pressure of one or more consecutive cycles, each on the same angles.

    Attributes
    ----------
    angle : ndarray, shape (samples,)
        Crank angles [rad], strictly ascending from >= -period/2 to < period/2; 0 is firing top
        dead centre.
    pressure : ndarray, shape (cycles, samples)
        Pressure [Pa]; absolute, unless it is still to be pegged.
    period : float
        4 pi (four-stroke) or 2 pi (two-stroke) [rad].
    """

    angle: Floats
    pressure: Floats
    period: float = FOUR_STROKE

    def __post_init__(self) -> None:
        """Refuse angles and pressures that do not fit together."""
        if self.pressure.ndim != 2 or self.pressure.shape[1:] != self.angle.shape:
            raise ValueError(
                f"pressure: shape {self.pressure.shape}, not (cycles, {len(self.angle)})"
            )
        inside = self.angle[0] >= -0.5 * self.period and self.angle[-1] < 0.5 * self.period
        if not inside or not np.all(np.diff(self.angle) > 0.0):
            raise ValueError("angle: must ascend within one cycle, its end left out")

    @property
    def cycles(self) -> int:
        """Number of cycles."""
        return len(self.pressure)

    @property
    def mean(self) -> Floats:
        """Mean pressure of all cycles at each angle [Pa], shape (samples,)."""
        return np.asarray(self.pressure.mean(axis=0))
