"""Friction of four-stroke engines by component: the law of Patton, Nitschke and Heywood.

Each function gives the friction mean effective pressure of one component [Pa] from SI values, as
numbers or arrays that broadcast. The law was fitted to engines of cars of the 1980s with spark
ignition, warm, with oil of 10W-30, at some 1000 to 6000 rpm; it holds no pumping work. The formulas
below are printed with kPa, mm, rpm and m/s, and so are their constants here.

Sources
-------
K. J. Patton, R. C. Nitschke and J. B. Heywood, Development and evaluation of a friction model for
spark-ignition engines, SAE paper 890836, 1989 (not seen). The equations and their constants were
compared in three transcriptions that are independent of each other: those of two programs after
D. Sandoval, An improved friction model for spark ignition engines, thesis, MIT 2002, equations 7.a
to 11 and table 4.2, and that of a third program. They agree in all numbers that are used here.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.units import BAR, RPM

__all__ = [
    "ATMOSPHERE",
    "VALVE_TRAINS",
    "ValveTrain",
    "auxiliaries",
    "crank_pin_bearings",
    "crankshaft_seals",
    "main_bearings",
    "ring_gas_pressure",
    "rings",
    "skirt",
    "valve_train",
]

KILOPASCAL = 1e3

MM = 1e3
"""Millimetres in a metre."""

ATMOSPHERE = 1.01325 * BAR
"""Pressure that the intake is compared with [Pa]."""

BOUNDARY_SPEED = 1000.0
"""Speed at which friction of mixed lubrication is twice that of a fast engine [rpm]."""


class ValveTrain(NamedTuple):
    """Constants of a kind of valve train, in kPa, mm and rpm.

    Attributes
    ----------
    number : int
        Under which the kind is known.
    flat : float
        Of a flat follower on the cam [kPa mm]; 0 for a roller.
    roller : float
        Of a roller follower [kPa mm/rpm]; 0 for a flat one.
    hydrodynamic, mixed : float
        Of parts that move to and fro: in oil [kPa mm^0.5/rpm^0.5], and in mixed lubrication [kPa].
    """

    number: int
    flat: float
    roller: float
    hydrodynamic: float
    mixed: float


VALVE_TRAINS: Mapping[str, ValveTrain] = MappingProxyType(
    {
        "ohv": ValveTrain(1, 400.0, 0.0, 0.5, 32.1),
        "sohc_finger_follower": ValveTrain(2, 600.0, 0.0, 0.2, 42.8),
        "sohc_rocker_arm": ValveTrain(3, 400.0, 0.0, 0.5, 21.4),
        "sohc_direct_acting": ValveTrain(4, 200.0, 0.0, 0.5, 10.7),
        "dohc_finger_follower": ValveTrain(5, 600.0, 0.0, 0.2, 25.8),
        "dohc_direct_acting": ValveTrain(6, 133.0, 0.0, 0.5, 10.7),
        "dohc_roller_finger_follower": ValveTrain(7, 0.0, 0.0227, 0.2, 25.8),
    }
)
"""Kinds of valve trains: one camshaft in the block (OHV), one in the head (SOHC) or two (DOHC).

Sandoval's table 4.2. Rollers of other kinds are left out: their constants are in one transcription
alone, or are misprinted.
"""


def _swept(bore: Any, stroke: Any, cylinders: Any) -> Any:
    """Bore squared times stroke, of all cylinders [mm3]."""
    return (MM * bore) ** 2 * (MM * stroke) * cylinders


def _mixed_lubrication(speed: Any) -> Any:
    """Factor of mixed lubrication: 1 + 1000/N."""
    return 1.0 + BOUNDARY_SPEED * RPM / speed


def crankshaft_seals(bore: Any, stroke: Any, cylinders: Any, journal_diameter: Any) -> Any:
    """Seals of the crankshaft: 1.22e5 D_b/(B^2 S n_c) kPa.

    docs/method.md (33). `bore`, `stroke` and `journal_diameter` (of a main journal) in [m];
    `cylinders` is their number.
    """
    swept = _swept(bore, stroke, cylinders)
    return KILOPASCAL * 1.22e5 * (MM * journal_diameter) / swept


def _journal_bearings(
    bore: Any, stroke: Any, cylinders: Any, speed: Any, diameter: Any, width: Any, number: Any
) -> Any:
    """Oil films of journals: 3.03e-4 N D^3 L n/(B^2 S n_c) kPa."""
    across = MM * diameter
    sheared = (speed / RPM) * across * across * across * (MM * width) * number
    return KILOPASCAL * 3.03e-4 * sheared / _swept(bore, stroke, cylinders)


def main_bearings(
    bore: Any, stroke: Any, cylinders: Any, speed: Any, journal_diameter: Any, journal_width: Any,
    bearings: Any,
) -> Any:  # fmt: skip
    """Main bearings: films, and the oil that is pumped and churned (1.35e-10 D_b^2 N^2 n_b/n_c).

    docs/method.md (33). `speed` [rad/s]; `journal_diameter` and `journal_width` of a main journal
    [m]; `bearings` is the number of main bearings. The width is that of the bearing.

    Examples
    --------
    >>> from engine_dyn.units import RPM
    >>> round(main_bearings(0.1, 0.1, 1, 1000 * RPM, 0.05, 0.02, 2), 1)
    2190.7
    """
    turbulent = 1.35e-10 * (MM * journal_diameter) ** 2 * (speed / RPM) ** 2 * bearings / cylinders
    films = _journal_bearings(
        bore, stroke, cylinders, speed, journal_diameter, journal_width, bearings
    )
    return films + KILOPASCAL * turbulent


def crank_pin_bearings(
    bore: Any, stroke: Any, cylinders: Any, speed: Any, pin_diameter: Any, pin_width: Any
) -> Any:
    """Bearings of the rods on the crank pins, one for each cylinder: as films of main bearings.

    docs/method.md (34). `pin_diameter` [m]; `pin_width` is the width of one rod's bearing [m].
    """
    return _journal_bearings(bore, stroke, cylinders, speed, pin_diameter, pin_width, cylinders)


def skirt(bore: Any, piston_speed: Any) -> Any:
    """Skirts of the pistons: 294 S_p/B kPa.

    docs/method.md (34). `piston_speed` is the mean piston speed [m/s].
    """
    return KILOPASCAL * 294.0 * piston_speed / (MM * bore)


def rings(bore: Any, speed: Any) -> Any:
    """Piston rings by their own tension: 4.06e4 (1 + 1000/N)/B^2 kPa.

    docs/method.md (34). `speed` of the crank [rad/s].
    """
    return KILOPASCAL * 4.06e4 * _mixed_lubrication(speed) / (MM * bore) ** 2


def ring_gas_pressure(compression_ratio: Any, piston_speed: Any, intake_ratio: Any = 1.0) -> Any:
    """Piston rings, what gas adds: 6.89 (p_i/p_a) [0.088 r + 0.182 r^(1.33 - 0.0238 S_p)] kPa.

    docs/method.md (35). `compression_ratio` r [1], `piston_speed` [m/s], `intake_ratio` is the
    pressure of the intake over that of the atmosphere [1].
    """
    exponent = 1.33 - 2.38e-2 * piston_speed
    loading = 0.088 * compression_ratio + 0.182 * compression_ratio**exponent
    return KILOPASCAL * 6.89 * intake_ratio * loading


def valve_train(
    bore: Any, stroke: Any, cylinders: Any, speed: Any, kind: Any, lift: Any, valves: Any,
    camshaft_bearings: Any,
) -> Any:  # fmt: skip
    """Valve train: bearings and seals of the camshafts, followers, valves and what moves them.

    docs/method.md (36).

    Parameters
    ----------
    bore, stroke : array_like
        [m].
    cylinders : array_like
        Their number.
    speed : array_like
        Of the crank [rad/s].
    kind : array_like of int
        Number of a kind in `VALVE_TRAINS`.
    lift : array_like
        Largest lift of a valve [m].
    valves : array_like
        Number of valves of one cylinder.
    camshaft_bearings : array_like
        Number of bearings of all camshafts.
    """
    number = np.clip(np.nan_to_num(np.asarray(kind, dtype=float)), 1, len(VALVE_TRAINS))
    # Each kind has a row, by its number less 1.
    flat, roller, hydrodynamic, mixed = np.moveaxis(
        np.array([train[1:] for train in VALVE_TRAINS.values()])[number.astype(int) - 1], -1, 0
    )
    turns, high = speed / RPM, MM * lift
    camshafts = 244.0 * turns * camshaft_bearings / _swept(bore, stroke, cylinders) + 4.12
    followers = flat * _mixed_lubrication(speed) + roller * turns
    in_oil = hydrodynamic * high**1.5 * np.sqrt(turns) / (MM * bore)
    of_valves = (
        (followers + in_oil + mixed * _mixed_lubrication(speed) * high) * valves / (MM * stroke)
    )
    return KILOPASCAL * (camshafts + of_valves)


def auxiliaries(speed: Any) -> Any:
    """Oil pump, water pump and an alternator that does not charge, 6.23 + 5.22e-3 N - 1.79e-7 N^2.

    docs/method.md (37). `speed` of the crank [rad/s]; the law is printed in kPa.
    """
    turns = speed / RPM
    return KILOPASCAL * (6.23 + 5.22e-3 * turns - 1.79e-7 * turns**2)
