"""Limits of a generating set after a change of load, and whether a run keeps them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.types import Booleans

if TYPE_CHECKING:
    from engine_dyn.transient.api import Transients


class TransientLimits(NamedTuple):
    """Limits relative to the nominal speed [1], and a time [s].

    Examples
    --------
    >>> from engine_dyn.transient import ISO_8528_5_G2
    >>> ISO_8528_5_G2._replace(recovery=3.0)
    TransientLimits(fall=0.1, rise=0.12, band=0.015, recovery=3.0)
    """

    fall: float  # Largest fall of the speed after load is put on
    rise: float  # Largest rise after load is taken off
    band: float  # Width of the band around the last speed
    recovery: float  # Time until the speed stays in the band [s]


ISO_8528_5_G2 = TransientLimits(fall=0.10, rise=0.12, band=0.015, recovery=5.0)
"""ISO 8528-5, performance class G2, as a project specification quotes it (the standard itself was
not seen; its droop is a matter of two runs). What could be read of classes G1 and G3 contradicts
itself: give those limits yourself.
"""


def kept(result: Transients, nominal: npt.ArrayLike, limits: TransientLimits) -> Booleans:
    """Whether runs keep the limits behind each mark.

    Parameters
    ----------
    result : Transients
        From `follow_designs`, to which half of `limits.band` was given as `recovery_band`.
    nominal : array_like, shape () or (designs,)
        Nominal speeds [rad/s].
    limits : TransientLimits
        Such as `ISO_8528_5_G2`.

    Returns
    -------
    ndarray of bool, shape (designs, marks)
        False, too, for a speed that does not recover.

    Examples
    --------
    A speed that nothing disturbs is within all limits:

    >>> import math
    >>> from engine_dyn.geometry.cylinders import even_cylinders
    >>> from engine_dyn.transient import ISO_8528_5_G2, follow_designs, kept, transient_engine
    >>> from sweeps.scene.engine.engine_files import load_engine
    >>> engine = transient_engine(
    ...     load_engine("ntua").family, even_cylinders(1, 4.0 * math.pi), crank_ratio=0.257
    ... )
    >>> found = follow_designs(engine, 30, marks=[1.0], inertia=3.0, lever=1e-12, speed=157.0)
    >>> kept(found, 157.0, ISO_8528_5_G2)
    array([[ True]])
    """
    found, speed = result.marks, np.reshape(np.asarray(nominal, dtype=np.float64), (-1, 1))
    fall = (found["speed_before"] - found["speed_lowest"]) / speed
    rise = (found["speed_highest"] - found["speed_before"]) / speed
    return keeps(fall, rise, found["recovery_time"], limits)


def keeps(
    fall: npt.ArrayLike, rise: npt.ArrayLike, recovery: npt.ArrayLike, limits: TransientLimits
) -> Booleans:
    """Whether a relative fall and rise of the speed [1] and a recovery time [s] keep limits.

    NaN keeps none: such a speed does not recover.
    """
    within = np.less_equal(fall, limits.fall) & np.less_equal(rise, limits.rise)
    return np.asarray(within & np.less_equal(recovery, limits.recovery))
