"""Exact kinematics of the slider-crank mechanism (piston pin on the crank's centre line).

Angle zero is top dead centre; the piston's travel, velocity and acceleration are positive towards
bottom dead centre. All three are reduced: they depend on the crank ratio lambda = r/l alone.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.compilation import inlined

__all__ = ["acceleration", "position", "rod_angle", "velocity"]


def _checked(phi: npt.ArrayLike, crank_ratio: npt.ArrayLike) -> tuple[Any, Any]:
    ratio = np.asarray(crank_ratio, dtype=float)
    if not np.all((ratio > 0.0) & (ratio < 1.0)):
        bad = ratio[~((ratio > 0.0) & (ratio < 1.0))].flat[0]
        raise ValueError(f"crank_ratio = {bad:g}: must lie between 0 and 1, both excluded")
    return np.asarray(phi, dtype=float), ratio


def position(phi: npt.ArrayLike, crank_ratio: npt.ArrayLike) -> Any:
    """Piston travel from top dead centre over the crank radius, x/r.

    Parameters
    ----------
    phi : array_like
        Crank angle from top dead centre [rad]; broadcasts with `crank_ratio`.
    crank_ratio : array_like
        Crank radius over rod length, lambda = r/l [1], in (0, 1).

    Returns
    -------
    numpy.ndarray or numpy.float64
        x/r, from 0 at top to 2 at bottom dead centre.

    Raises
    ------
    ValueError
        If a crank ratio lies outside (0, 1).

    Notes
    -----
    Kakaitsas (2015), eq. 1.4; Mosakowski, eq. 1 (there measured from the crank's axis). Written
    without the difference of near numbers, so that small lambda and small angles lose no digits.
    """
    angle, ratio = _checked(phi, crank_ratio)
    sine = np.sin(angle)
    root = np.sqrt(1.0 - (ratio * sine) ** 2)
    return 2.0 * np.sin(0.5 * angle) ** 2 + ratio * sine**2 / (1.0 + root)


def velocity(phi: npt.ArrayLike, crank_ratio: npt.ArrayLike) -> Any:
    """Piston velocity over the crank pin's, c/(r omega); positive towards bottom dead centre.

    Parameters and errors as `position`. Kakaitsas (2015), eq. 1.6; Mosakowski, eq. 2 (opposite
    sign there).
    """
    phi, ratio = _checked(phi, crank_ratio)
    sine, cosine = np.sin(phi), np.cos(phi)
    root = np.sqrt(1.0 - (ratio * sine) ** 2)
    return sine * (1.0 + ratio * cosine / root)


def acceleration(phi: npt.ArrayLike, crank_ratio: npt.ArrayLike) -> Any:
    """Piston acceleration at constant speed over the crank pin's, b/(r omega^2).

    Positive towards bottom dead centre. Parameters and errors as `position`. Kakaitsas (2015),
    eq. 1.8; Mosakowski, eq. 3 (opposite sign there).
    """
    phi, ratio = _checked(phi, crank_ratio)
    sine, cosine = np.sin(phi), np.cos(phi)
    square = 1.0 - (ratio * sine) ** 2
    bracket = cosine**2 - sine**2 + ratio**2 * sine**4
    return cosine + ratio * bracket / (square * np.sqrt(square))


def rod_angle(phi: npt.ArrayLike, crank_ratio: npt.ArrayLike) -> Any:
    """Angle beta of the connecting rod to the cylinder axis [rad]; sin(beta) = lambda sin(phi).

    Parameters and errors as `position`. Kakaitsas (2015), eq. 1.3.
    """
    phi, ratio = _checked(phi, crank_ratio)
    return np.arcsin(ratio * np.sin(phi))


# The same formulas for kernels: sine and cosine come from tables, crank ratios are checked before.


@inlined
def position_at(sine: float, cosine: float, ratio: float) -> float:
    """Return x/r, Kakaitsas eq. 1.4; for cos(phi) near 1 the caller accepts rounding of 1e-16."""
    root = math.sqrt(1.0 - ratio * ratio * sine * sine)
    return (1.0 - cosine) + ratio * sine * sine / (1.0 + root)


@inlined
def velocity_at(sine: float, cosine: float, ratio: float) -> float:
    """c/(r omega), Kakaitsas eq. 1.6."""
    return sine * (1.0 + ratio * cosine / math.sqrt(1.0 - ratio * ratio * sine * sine))


@inlined
def acceleration_at(sine: float, cosine: float, ratio: float) -> float:
    """b/(r omega^2), Kakaitsas eq. 1.8."""
    s2 = sine * sine
    square = 1.0 - ratio * ratio * s2
    bracket = cosine * cosine - s2 + ratio * ratio * s2 * s2
    return cosine + ratio * bracket / (square * math.sqrt(square))


@inlined
def jerk_at(sine: float, cosine: float, ratio: float) -> float:
    """Return db/dphi over r omega^2: the derivative of Kakaitsas eq. 1.8 (derived here)."""
    s2 = sine * sine
    square = 1.0 - ratio * ratio * s2
    bracket = cosine * cosine - s2 + ratio * ratio * s2 * s2
    slope = sine * cosine * (4.0 * ratio * ratio * s2 - 4.0)
    return -sine + ratio * (
        slope / (square * math.sqrt(square))
        + 3.0 * ratio * ratio * sine * cosine * bracket / (square * square * math.sqrt(square))
    )
