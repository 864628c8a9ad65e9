"""Orders of shaking forces: harmonics of the piston's acceleration, and ellipses."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.forces.cylinder_harmonics import velocity_harmonics
from engine_dyn.geometry import kinematic_series
from engine_dyn.types import Complexes

MOST = 512  # Highest order


def acceleration_harmonics(
    orders: npt.ArrayLike, crank_ratio: npt.ArrayLike, offset: npt.ArrayLike = 0.0
) -> Complexes:
    """Complex amplitudes of the reduced piston acceleration, b = Re sum c_nu e^(i nu phi).

    Parameters
    ----------
    orders : array_like
        Periods a revolution, above 0 and up to 512; the amplitude of orders that are not whole
        numbers is 0.
    crank_ratio, offset : array_like
        As `slider_crank.acceleration`; all three broadcast.

    Returns
    -------
    ndarray
        Exact in lambda. Without offset they are real, 1 for the first order and 0 for the other
        odd ones.

    Raises
    ------
    ValueError
        For an order that is not above 0, or above 512.
    """
    nu = kinematic_series.checked_orders(orders, MOST)
    whole = nu == np.rint(nu)
    ratio, offset_ratio = np.broadcast_arrays(
        np.asarray(crank_ratio, dtype=float), np.asarray(offset, dtype=float)
    )
    if not offset_ratio.any():
        among = np.where(whole, nu, 1.0)
        found_here = kinematic_series.acceleration_coefficients(among, ratio)
        return np.where(whole, found_here, 0.0).astype(np.complex128)
    among, which = np.unique(nu, return_inverse=True)
    # The acceleration is the slope of the velocity.
    harmonics = (
        1j * among * velocity_harmonics(among, ratio.reshape(-1, 1), offset_ratio.reshape(-1, 1))
    )
    place, row = np.broadcast_arrays(
        which.reshape(nu.shape), np.arange(ratio.size).reshape(ratio.shape)
    )
    return np.asarray(harmonics[row, place])


class Ellipse(NamedTuple):
    """The ellipse along which the tip of a vector of one order runs."""

    # Semi-axes.
    major: Any
    minor: Any
    # Angle of the long axis from cylinder 1 [rad], above -pi/2 and up to pi/2; 0 for a circle.
    inclination: Any


def ellipse_of(forward: Any, backward: Any, rounding: Any) -> Ellipse:
    """Ellipse of F e^(i nu phi) + B e^(-i nu phi); amplitudes up to `rounding` have no angle.

    Semi-axes |F| + |B| and ||F| - |B||; the long axis lies at half the angle of F B.
    """
    one, other = np.abs(forward), np.abs(backward)
    turned = forward * backward
    there = (one > rounding) & (other > rounding)
    angle = 0.5 * np.angle(np.where(there, turned, 1.0))
    # Rounding must not make -90 degrees of 90.
    angle = np.where(angle <= -0.5 * np.pi + 1e-9, angle + np.pi, angle)
    return Ellipse(one + other, np.abs(one - other), angle)


def direction_of(amplitude: Any, rounding: Any) -> Any:
    """Direction of an amplitude as a complex number of length 1; 1 where there is none."""
    size = np.abs(amplitude)
    there = size > rounding
    return np.where(there, amplitude / np.where(there, size, 1.0), 1.0)
