"""Limits of a generating set after a change of load, and whether a run keeps them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from engine_dyn.transient.api import Transients
from engine_dyn.types import Booleans, Floats


class TransientLimits(NamedTuple):
    """Limits relative to the nominal speed [1], and a time [s]."""

    fall: float  # Largest fall of the speed after load is put on
    rise: float  # Largest rise after load is taken off
    band: float  # Width of the band around the last speed
    recovery: float  # Time until the speed stays in the band [s]
    droop: float  # Largest fall of the steady speed from no load to full load


ISO_8528_5_G2 = TransientLimits(fall=0.10, rise=0.12, band=0.015, recovery=5.0, droop=0.05)
"""ISO 8528-5, performance class G2, as a project specification quotes it (the standard itself was
not seen). What could be read of classes G1 and G3 contradicts itself: give those limits yourself.
"""


def kept(result: Transients, nominal: Floats, limits: TransientLimits) -> Booleans:
    """Whether runs keep the limits behind each mark, shape (designs, marks).

    Give `follow_designs` half of `limits.band` as `recovery_band`. A speed that does not recover
    keeps none. `nominal` is the nominal speed of each design [rad/s].
    """
    found, speed = result.marks, np.reshape(nominal, (-1, 1))
    fall = (found["speed_before"] - found["speed_lowest"]) / speed
    rise = (found["speed_highest"] - found["speed_before"]) / speed
    quick = found["recovery_time"] <= limits.recovery  # False for NaN
    return np.asarray((fall <= limits.fall) & (rise <= limits.rise) & quick)
