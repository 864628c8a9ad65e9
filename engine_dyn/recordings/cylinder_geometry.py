"""Recorded cycles, and the volume of a cylinder from which the work of their pressure follows."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.geometry.slider_crank import clearance_volume
from engine_dyn.types import Floats


@dataclass(frozen=True)
class CylinderGeometry:
    """Measures of one cylinder.

    Parameters
    ----------
    bore, stroke : float
        [m]
    crank_ratio : float
        Crank radius over rod length [1].
    compression_ratio : float, optional
        Largest over smallest volume [1]. Without it the works are known, but neither the volume
        itself nor what follows from it.
    pin_offset : float
        Distance of the piston pin's line from the crank's axis [m], positive towards the side on
        which the crank pin goes down.

    Raises
    ------
    ValueError
        For measures that are no cylinder.
    """

    bore: float
    stroke: float
    crank_ratio: float
    compression_ratio: float | None = None
    pin_offset: float = 0.0

    def __post_init__(self) -> None:
        """Refuse measures that are no cylinder."""
        for name in ("bore", "stroke"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} = {getattr(self, name):g} m: must be above 0")
        if self.compression_ratio is not None and not 1.0 < self.compression_ratio < math.inf:
            raise ValueError(f"compression_ratio = {self.compression_ratio:g}: must be above 1")
        self.volume_slope(0.0)

    @property
    def area(self) -> float:
        """Area of the piston [m2]."""
        return 0.25 * math.pi * self.bore**2

    @property
    def swept_volume(self) -> float:
        """Swept volume [m3]."""
        return self.area * self.stroke

    @property
    def clearance_volume(self) -> float:
        """Smallest volume [m3].

        Raises
        ------
        ValueError
            Where the compression ratio is not known.
        """
        if self.compression_ratio is None:
            raise ValueError("compression_ratio: must be given, the volume depends on it")
        return float(clearance_volume(self.swept_volume, self.compression_ratio))

    @property
    def _radius(self) -> float:
        return float(
            slider_crank.crank_radius_of_ratio(self.stroke, self.crank_ratio, self.pin_offset)
        )

    @property
    def offset_ratio(self) -> float:
        """Offset of the pin's line over the crank radius [1]."""
        return self.pin_offset / self._radius

    def displaced(self, angle: ArrayLike) -> Floats:
        """Volume above the smallest one [m3] at crank angles [rad], docs/method.md (121)."""
        travel = slider_crank.position(angle, self.crank_ratio, self.offset_ratio)
        return np.asarray(self.area * self._radius * travel, dtype=np.float64)

    def volume(self, angle: ArrayLike) -> Floats:
        """Volume of the cylinder [m3] at crank angles [rad], docs/method.md (121).

        Raises
        ------
        ValueError
            Where the compression ratio is not known.
        """
        return self.clearance_volume + self.displaced(angle)

    def volume_slope(self, angle: ArrayLike) -> Floats:
        """dV/dphi [m3/rad] at crank angles [rad]."""
        speed = slider_crank.velocity(angle, self.crank_ratio, self.offset_ratio)
        return np.asarray(self.area * self._radius * speed, dtype=np.float64)

    def with_compression_ratio(self, compression_ratio: float) -> CylinderGeometry:
        """Return the same cylinder with another compression ratio."""
        return replace(self, compression_ratio=compression_ratio)


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
