"""Stiffness and nominal stress of round shafts, and limits of propulsion shafts."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine_dyn.units import MPA


def shaft_stiffness(shear_modulus: Any, length: Any, diameter: Any, bore: Any = 0.0) -> Any:
    """Stiffness pi G (d^4 - d_b^4)/(32 l) [N m/rad] of a round shaft; arguments in Pa and m."""
    return np.pi * shear_modulus * (diameter**4 - bore**4) / (32.0 * length)


def shear_stress(torque: Any, diameter: Any, bore: Any = 0.0) -> Any:
    """Nominal shear stress 16 T d/(pi (d^4 - d_b^4)) [Pa] at the surface of a round shaft.

    Of the half range of the torque [N m] it is what rules of classification limit; notches are left
    out. Diameter and bore [m].
    """
    return 16.0 * torque * diameter / (np.pi * (diameter**4 - bore**4))


CARBON_STEEL, ALLOY_STEEL = 600.0 * MPA, 800.0 * MPA
"""Most tensile strength that IACS UR M68 counts for vibratory stresses [Pa]."""


def propulsion_shaft_limits(
    speed_ratio: Any, diameter: Any, tensile_strength: Any, shape_factor: Any,
    most_strength: Any = CARBON_STEEL,
) -> tuple[Any, Any]:  # fmt: skip
    """Permissible vibratory stresses [Pa] of ships' propulsion shafts: continuous, and in passing.

    tau_C = (sigma_B + 160)/18 c_K c_D (3 - 2 lambda^2) below a speed ratio lambda of 0.9, and
    1.38 in place of the bracket from there to 1.05; tau_T = 1.7 tau_C/sqrt(c_K) up to 0.8, where
    the speed passes quickly; sigma_B and the stresses in N/mm2, c_D = 0.35 + 0.93 d^-0.2 with d in
    mm. NaN where the rule gives no value. The limits hold for the half range of the synthesis of
    all orders, nominal, plain section.

    Parameters
    ----------
    speed_ratio : array_like
        lambda, speed over rated speed [1].
    diameter : array_like
        Diameter of the shaft [m].
    tensile_strength : array_like
        Specified minimum [Pa].
    shape_factor : array_like
        c_K [1]: 1 for integral flanges and shrink fits, 0.6 for a keyway in a taper, 0.45 in a
        cylinder, 0.5 at a radial hole.
    most_strength : array_like
        The strength that counts at most [Pa]: 600 MPa of carbon and carbon-manganese steel and
        of propeller shafts, 800 MPa of other shafts of alloy steel.

    Notes
    -----
    IACS UR M68, which does not hold for crankshafts (M53) and shafts of gears and generators.
    c_D, the half range and some of c_K were compared with Lloyd's Register, Rules for Naval Ships,
    Vol. 2 Part 5 Ch. 1 Sec. 3. The rest is general knowledge of the rule, not compared with its
    text: read that before you rely on it.
    """
    ratio = np.asarray(speed_ratio, dtype=float)
    size = 0.35 + 0.93 * (1000.0 * np.asarray(diameter)) ** -0.2
    strength = np.minimum(tensile_strength, most_strength)
    base = (strength / MPA + 160.0) / 18.0 * shape_factor * size * MPA
    bracket = np.where(ratio < 0.9, 3.0 - 2.0 * ratio**2, 1.38)
    continuous = base * np.where((ratio > 0.0) & (ratio < 1.05), bracket, np.nan)
    passing = np.where(ratio <= 0.8, 1.7 * continuous / np.sqrt(shape_factor), np.nan)
    return continuous, passing
