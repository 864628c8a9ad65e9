"""Masses of counterweights and of the one counter-rotating shaft, for one cylinder.

Source: T. Asgari et al. (2019), eqs. 9, 12 and 13.
"""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = [
    "balance_shaft_mass",
    "check_above_zero",
    "check_fraction",
    "counterweight_mass",
    "unbalanced_mass",
]


def unbalanced_mass(fraction: Any, reciprocating_mass: Any, rotating_mass: Any) -> Any:
    """Mass at the crank pin that a counterweight balances [kg]: c m_1 + m_2. Asgari, eq. 9."""
    check_fraction(fraction)
    return fraction * np.asarray(reciprocating_mass) + rotating_mass


def counterweight_mass(unbalanced: Any, crank_radius: Any, radius: Any) -> Any:
    """Counterweight [kg] whose centre of gravity lies at `radius` [m]: M R/b. Asgari, eq. 12.

    Raises
    ------
    ValueError
        For a radius that is not above 0.
    """
    check_above_zero("radius", radius)
    return np.asarray(unbalanced) * crank_radius / radius


def balance_shaft_mass(
    fraction: Any, reciprocating_mass: Any, crank_radius: Any, radius: Any
) -> Any:
    """Mass [kg] of the one counter-rotating shaft of Asgari, eq. 13: (1 - c) R m / R_shaft.

    For one cylinder it cancels the first order along the cylinder whatever c is, and leaves
    (1 - 2 c) m R omega^2 sin(phi) across it: both vanish only at c = 0.5.

    Raises
    ------
    ValueError
        For a radius that is not above 0, or a fraction outside 0 to 1.
    """
    check_fraction(fraction)
    check_above_zero("radius", radius)
    return (1.0 - np.asarray(fraction)) * crank_radius * reciprocating_mass / radius


def check_fraction(fraction: Any) -> None:
    """Refuse fractions outside 0 to 1, with a ValueError."""
    values = np.asarray(fraction, dtype=float)
    wrong = ~((values >= 0.0) & (values <= 1.0))
    if wrong.any():
        raise ValueError(f"fraction = {values[wrong].flat[0]:g}: must be from 0 to 1")


def check_above_zero(name: str, value: Any) -> None:
    """Refuse values that are not above 0, with a ValueError that names them."""
    values = np.asarray(value, dtype=float)
    wrong = ~((values > 0.0) & np.isfinite(values))
    if wrong.any():
        raise ValueError(f"{name} = {values[wrong].flat[0]:g}: must be above 0")
