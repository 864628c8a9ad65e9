"""Ranges that are usual for engines: the one table, with sources and usual mistakes.

A range is wide: it holds the smallest model engine and the largest marine engine, idling and
racing, because a warning that comes without need is soon read no more. Where measures grow with
the engine, they are divided by what they grow with, so that one range holds for all sizes: masses
of geometrically similar engines go with the cube of the bore, moments of inertia with its fifth
power. A range without a source in print says "judgement", and what it rests on.

Formulas take SI values, numbers or arrays that broadcast; NaN is a value that is not judged.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from engine_dyn.parameters import COMPRESSION_RATIO, HEYWOOD, PARAMETERS
from engine_dyn.units import BAR, DEGREE, MPA, RPM

CROSSHEAD = 2.5
"""Stroke over bore above which an engine has a crosshead; trunk pistons end at about 1.6."""

MOST_DELTA = 0.5  # Largest coefficient of speed fluctuation that is plausible


@dataclass(frozen=True)
class Suspicion:
    """Another reading of a value that may have been meant."""

    question: str  # Words that complete the sentence "is the value ...?"
    # Function from the number as written to the SI value that it has in this other reading
    meant: Callable[[float], float]


@dataclass(frozen=True)
class Check:
    """One measure of an engine, and the range in which it usually lies."""

    name: str  # Name by which the check is silenced
    # Words for the measure, the number computed from the engine's values that is checked
    what: str
    unit: str  # Unit of the range, and of the measure in messages
    # Ends of the usual range, in the check's unit.
    low: float
    high: float
    source: str  # Source of the usual range
    needs: tuple[str, ...]  # Parameters and quantities that the formula takes, in order
    measure: Callable[..., Any]  # Function that gives the measure in SI units
    blames: tuple[str, ...]  # Parameters that may be wrong, the most usual one first
    si: float = 1.0  # SI value of one unit of the range
    # Whether a measure of exactly 0 also counts as usual: it says that something is left out
    zero: bool = False

    @property
    def plain(self) -> bool:
        """Whether the measure is the parameter itself."""
        return self.needs == self.blames[:1] and self.measure is _itself

    @cached_property
    def edges(self) -> tuple[float, float]:
        """Ends of the range, SI; decimal numbers on them are inside."""
        low, high = self.low * self.si, self.high * self.si
        slack = 1e-9 * max(abs(low), abs(high))
        return low - slack, high + slack

    def inside(self, *needs: Any) -> bool:
        """Whether the measure of single numbers is inside; False of arrays, which takes longer."""
        measure = self.measure(*needs)
        if not isinstance(measure, float | int):
            return False
        low, high = self.edges
        return not (measure < low or measure > high) or (self.zero and measure == 0.0)


def _itself(value: Any) -> Any:
    return value


def _own(name: str, what: str, unit: str, low: float, high: float, source: str,
         **more: Any) -> Check:  # fmt: skip
    """Check of a parameter's own value against a range."""
    return Check(name, what, unit, low, high, source, (name,), _itself, (name,), **more)


def _usual(name: str) -> Check:
    """Check of a parameter against its usual range in `engine_dyn.parameters`."""
    one = PARAMETERS[name]
    assert one.usual is not None
    what, low, high, source, zero = one.usual
    unit = "" if one.unit == "1" else one.unit
    return _own(name, what, unit, low, high, source, si=one.si, zero=zero)


def _where(condition: Any, value: Any) -> Any:
    """Return the value where a condition holds, NaN elsewhere."""
    if isinstance(condition, bool | np.bool_) and not isinstance(value, np.ndarray):
        return value if condition else math.nan
    return np.where(condition, value, math.nan)


def _displacement(bore: Any, stroke: Any, cylinders: Any) -> Any:
    return 0.25 * math.pi * bore * bore * stroke * cylinders


def _mean_pressure(torque: Any, period: Any, bore: Any, stroke: Any, cylinders: Any) -> Any:
    return abs(torque) * period / _displacement(bore, stroke, cylinders)


def _mass_for_size(mass: Any, bore: Any) -> Any:
    return mass / (0.25 * math.pi * bore**3)


# --- values that may have been meant --------------------------------------------------------------


def _in(unit: str, si: float) -> Suspicion:
    return Suspicion(f"in {unit}", lambda number: number * si)


LENGTH = (_in("mm", 1e-3), _in("cm", 1e-2), _in("inches", 0.0254), _in("m", 1.0))
MASS = (_in("g", 1e-3), _in("lb", 0.45359237), _in("t", 1e3), _in("kg", 1.0))
INERTIA = (
    _in("kg cm2", 1e-4), _in("g m2", 1e-3), _in("kg mm2", 1e-6), _in("lb ft2", 0.04214011),
    _in("t m2", 1e3),
)  # fmt: skip
SPEED = (_in("rpm", RPM), _in("rad/s", 1.0), _in("1/s", math.tau))
PRESSURE = (
    _in("kPa", 1e3), _in("Pa", 1.0), _in("bar", BAR), _in("MPa", 1e6), _in("psi", 6894.757),
)  # fmt: skip

SUSPICIONS: Mapping[str, tuple[Suspicion, ...]] = {
    **dict.fromkeys(
        ("bore", "stroke", "rod_length", "rod_centre_of_gravity", "cylinder_spacing",
         "counterweight_radius", "balance_shaft_radius", "second_shaft_radius", "pin_offset",
         "crank_offset", "offset", "flywheel_outer_diameter", "valve_lift",
         *(f"{bearing}_{size}" for bearing in ("crank_pin", "main_journal", "piston_pin")
           for size in ("diameter", "width"))),
        LENGTH,
    ),
    **dict.fromkeys(("reciprocating_mass", "piston_mass", "rod_mass", "crank_mass"), MASS),
    **dict.fromkeys(("inertia", "flywheel_inertia", "load_inertia", "rod_inertia"), INERTIA),
    **dict.fromkeys(("speed", "rated_speed", "start_speed", "motor_synchronous_speed"), SPEED),
    **dict.fromkeys(("intake_pressure", "heat", "ring_pressure", "friction_constant"), PRESSURE),
    "crankcase_pressure": (
        *PRESSURE, Suspicion("a gauge pressure", lambda number: number * BAR + 101325.0)
    ),
    "pressure": (*PRESSURE, _in("kgf/cm2", 98066.5)),
    "friction_mean_piston_speed": PRESSURE,
    "friction_torque": (Suspicion("a mean pressure in bar", lambda number: math.nan),),
    "crank_ratio": (
        Suspicion("the stroke over the rod", lambda number: 0.5 * number),
        Suspicion("half of what is meant", lambda number: 2.0 * number),
        Suspicion("from a rod length in mm", lambda number: 1e3 * number),
        Suspicion("from a rod length in cm", lambda number: 1e2 * number),
        Suspicion("from a rod length in inches", lambda number: number / 0.0254),
    ),
    "load": (Suspicion("a share of 1, not percent", lambda number: 1e2 * number),),
    "wanted_delta": (
        Suspicion("in percent", lambda number: 1e-2 * number),
        Suspicion("one over delta", lambda number: 1.0 / number),
    ),
    "motor_breakdown_slip": (Suspicion("in percent", lambda number: 1e-2 * number),),
    "combustion_start": (Suspicion("in radians", lambda number: number),),
    "combustion_duration": (Suspicion("in radians", lambda number: number),),
    **dict.fromkeys(
        # Kilowatts and horsepower are too alike to be told apart: data sheets have kilowatts
        ("rated_power", "held_power"), (_in("kW", 1e3), _in("MW", 1e6))
    ),
    "flywheel_density": (_in("g/cm3", 1e3),),
}  # fmt: skip
"""Values that each parameter may have been meant to have, the most usual first."""

# --- usual ranges ---------------------------------------------------------------------------------

_KOLCHIN = "Kolchin and Demidov, Design of Automotive Engines (1984), masses of the crank mechanism"

_LININGS = (
    "Neale, The Tribology Handbook, section A7: peak loads of linings 12 (white metal) to 31 in "
    "medium and large diesel engines, up to 52 (7500 lbf/in2) in those of cars; Pratt and Perkins, "
    "SAE 810199: above 55 in high-speed diesel engines; widened by judgement to linings of today"
)

CHECKS: tuple[Check, ...] = (
    _usual("bore"),
    Check(
        "stroke_bore_ratio", "stroke over bore", "", 0.35, 5.2,
        "judgement: racing engines 0.41, marine two-stroke engines with a very long stroke 5.0",
        ("stroke", "bore"), lambda stroke, bore: stroke / bore, ("stroke", "bore"),
    ),
    Check(
        "crank_ratio", "crank ratio", "", 0.1, 0.6,
        f"{HEYWOOD}, section 2.2: rod over crank radius 3 to 4, 5 to 9 in large slow engines; "
        "crosshead engines of today come down to 2",
        ("crank_ratio",), _itself, ("crank_ratio", "rod_length", "stroke"),
    ),
    Check(
        "crank_ratio_trunk_piston", f"crank ratio at a stroke under {CROSSHEAD:g} bores", "",
        0.16, 0.42, f"{HEYWOOD}, section 2.2: 1/4 to 1/3 in small and medium engines; widened to "
        "racing engines' 0.19 and old engines with short rods",
        ("crank_ratio", "stroke", "bore"),
        lambda crank_ratio, stroke, bore: _where(stroke < CROSSHEAD * bore, crank_ratio),
        ("crank_ratio", "rod_length", "stroke"),
    ),
    Check(
        "rod_centre_of_gravity", "rod's centre of gravity from the big end over the rod's length",
        "", 0.15, 0.5, "Kolchin and Demidov (1984): 0.2 to 0.3 of the rod's mass goes with the "
        "piston; widened to rods that are alike at both ends",
        ("rod_centre_of_gravity", "rod"), lambda gravity, rod: gravity / rod,
        ("rod_centre_of_gravity",),
    ),
    Check(
        "reciprocating_mass", "reciprocating mass over piston area and bore", "kg m-3", 300.0, 6e4,
        "judgement: crosshead engines with piston rod, 3e4 in the catalogue; below, as for trunk "
        "pistons", ("reciprocating_mass", "bore"), _mass_for_size,
        ("reciprocating_mass", "piston_mass", "rod_mass"), zero=True,
    ),
    Check(
        "reciprocating_mass_trunk_piston",
        f"reciprocating mass over piston area and bore, at a stroke under {CROSSHEAD:g} bores",
        "kg m-3", 300.0, 6e3, f"{_KOLCHIN}: pistons 80 to 400, rods 100 to 400 kg over the piston "
        "area at bores of 60 to 120 mm; widened",
        ("reciprocating_mass", "bore", "stroke"),
        lambda mass, bore, stroke: _where(stroke < CROSSHEAD * bore, _mass_for_size(mass, bore)),
        ("reciprocating_mass", "piston_mass", "rod_mass"), zero=True,
    ),
    Check(
        "crank_mass", "crank throw mass over piston area and bore", "kg m-3", 100.0, 6e4,
        f"{_KOLCHIN}: 100 to 400 kg over the piston area at bores of 60 to 120 mm; widened to "
        "crankshafts with their counterweights and to marine engines",
        ("crank_mass", "bore"), _mass_for_size, ("crank_mass",), zero=True,
    ),
    Check(
        "rod_inertia", "rod's moment of inertia over its mass and length squared", "", 0.05, 0.4,
        "judgement: a straight bar has 1/12, two masses at its ends 1/4",
        ("rod_inertia", "rod_mass", "rod"),
        lambda inertia, mass, rod: inertia / (mass * rod * rod), ("rod_inertia", "rod_mass"),
    ),
    Check(
        "inertia", "moment of inertia over displacement to the power 5/3", "kg m-3", 300.0, 1e6,
        "judgement: 1300 (V8 of a sports car) to 41000 (one cylinder with its flywheel) in the "
        "catalogue, and a margin for heavy loads",
        ("inertia", "bore", "stroke", "cylinders"),
        lambda inertia, *sizes: inertia / _displacement(*sizes) ** (5.0 / 3.0),
        ("inertia", "flywheel_inertia", "load_inertia"),
    ),
    Check(
        "mean_piston_speed", "mean piston speed", "m/s", 1.0, 28.0,
        f"{HEYWOOD}, section 2.2: at most 8 to 15; widened to racing engines' 26 and to idling",
        ("stroke", "speed"), lambda stroke, speed: stroke * speed / math.pi, ("speed", "stroke"),
    ),
    _usual("crankcase_pressure"),
    Check(
        "fmep", "friction mean effective pressure", "bar", 0.1, 6.0,
        f"{HEYWOOD}, chapter 13: 0.7 to 3; widened to roller bearings and racing speeds",
        ("friction_torque", "period", "bore", "stroke", "cylinders"), _mean_pressure,
        ("friction_torque", "friction_constant", "friction_mean_piston_speed",
         "friction_peak_pressure", "friction_mean_piston_speed_square", "auxiliary_torque"),
        si=BAR, zero=True,
    ),
    Check(
        "load_offset", "constant part of the load torque as a mean pressure", "bar", 0.0, 40.0,
        "as the largest brake mean effective pressure",
        ("load_offset", "period", "bore", "stroke", "cylinders"), _mean_pressure, ("load_offset",),
        si=BAR,
    ),
    _usual("load"),
    _usual("load_exponent"),
    Check(
        "offset", "offset of the pin's line over the stroke", "", 0.0, 0.3,
        "judgement: a few hundredths in engines, more in some compressors",
        ("pin_offset", "crank_offset", "stroke"),
        lambda pin, crank, stroke: abs(pin + crank) / stroke, ("pin_offset", "crank_offset"),
    ),
    Check(
        "cylinder_spacing", "distance of neighbouring throws over the bore", "", 0.8, 3.0,
        "Kolchin and Demidov (1984): 1.1 to 1.5 in engines in line; widened to large engines",
        ("cylinder_spacing", "bore"), lambda spacing, bore: spacing / bore, ("cylinder_spacing",),
    ),
    Check(
        "boxer_spacing", "distance of neighbouring throws of a boxer over the bore", "", 0.2, 1.0,
        "judgement: the throws of a pair stand as far apart as a rod and a web are thick, 0.3 to "
        "0.6 bores; the bores of one bank, two throws apart, are more than one bore apart",
        ("cylinder_spacing", "bore"), lambda spacing, bore: spacing / bore, ("cylinder_spacing",),
    ),
    *(
        Check(
            key, f"{of}'s centre of gravity from its axis over the crank radius", "", 0.05, 6.0,
            "judgement", (key, "stroke"), lambda radius, stroke: 2.0 * radius / stroke, (key,),
        )
        for key, of in (("counterweight_radius", "counterweight"),
                        ("balance_shaft_radius", "balance shaft"),
                        ("second_shaft_radius", "second shaft"))
    ),
    Check(
        "flywheel_outer_diameter", "flywheel's diameter over the stroke", "", 0.8, 20.0,
        "judgement; Asgari (2019) 3.8", ("flywheel_outer_diameter", "stroke"),
        lambda diameter, stroke: diameter / stroke, ("flywheel_outer_diameter",),
    ),
    _own("flywheel_density", "density of the flywheel", "kg m-3", 1000.0, 20000.0,
         "composites to tungsten"),
    _own("rim_speed_limit", "largest speed of the flywheel's rim", "m/s", 10.0, 1200.0,
         "cast iron 30, steel 60 to 200, composites 1000"),
    _own("wanted_delta", "coefficient of speed fluctuation wanted", "", 2e-4, 0.4,
         "1/6 (idling) to 1/300 (generators), the applications of this key; widened"),
    Check(
        "rated_power", "mean effective pressure of the rated power", "bar", 0.5, 40.0,
        f"{HEYWOOD}, section 2.7: 7 to 20; widened to highly charged engines",
        ("rated_power", "rated_speed", "period", "bore", "stroke", "cylinders"),
        lambda power, speed, *rest: _mean_pressure(power / speed, *rest),
        ("rated_power", "rated_speed"), si=BAR,
    ),
    Check(
        "held_power", "mean effective pressure of the power that is held", "bar", 0.1, 40.0,
        "as of the rated power; widened to light loads",
        ("held_power", "speed", "period", "bore", "stroke", "cylinders"),
        lambda power, speed, *rest: _mean_pressure(power / speed, *rest),
        ("held_power", "speed"), si=BAR, zero=True,
    ),
    Check(
        "motor_synchronous_speed", "motor's synchronous speed over its nominal speed", "", 0.9,
        1.6, "judgement: a slip of 1 to 10 percent; the rest is the solver's to refuse",
        ("motor_synchronous_speed", "speed", "motor_gear_ratio"),
        lambda synchronous, speed, gear: synchronous / (speed * gear),
        ("motor_synchronous_speed",),
    ),
    _usual("motor_breakdown_slip"),
    Check(
        "start_speed", "speed at the start over the nominal speed", "", 0.1, 3.0, "judgement",
        ("start_speed", "speed"), lambda start, speed: start / speed, ("start_speed",), zero=True,
    ),
    *(
        Check(
            f"{bearing}_diameter", f"diameter of a {text} over the bore", "", low, high,
            "judgement: " + known, (f"{bearing}_diameter", "bore"),
            lambda diameter, bore: diameter / bore, (f"{bearing}_diameter",),
        )
        for bearing, text, low, high, known in (
            ("crank_pin", "crank pin", 0.25, 1.2, "0.57 and 0.66 in the catalogue; marine 0.8"),
            ("main_journal", "main journal", 0.3, 1.4, "0.69 and 0.79 in the catalogue"),
            ("piston_pin", "piston pin", 0.12, 0.7, "0.24 and 0.38 in the catalogue; widened to "
             "pins of crossheads"),
        )
    ),
    *(
        Check(
            f"{bearing}_width", f"width of the {text}'s bearing over the diameter", "", 0.15, high,
            "judgement: 0.37 to 0.5 on crank pins and main journals in the catalogue, 0.9 to 1.3 "
            "on piston pins, 1.5 and more in old engines",
            (f"{bearing}_width", f"{bearing}_diameter"), lambda width, diameter: width / diameter,
            (f"{bearing}_width", f"{bearing}_diameter"),
        )
        for bearing, text, high in (("crank_pin", "crank pin", 2.0),
                                    ("main_journal", "main journal", 2.5),
                                    ("piston_pin", "piston pin", 3.0))
    ),
    Check(
        "valve_lift", "lift of a valve over the bore", "", 0.03, 0.25,
        f"{HEYWOOD}, section 6.3: valves of 0.33 to 0.5 bores, lifts up to a quarter of them",
        ("valve_lift", "bore"), lambda lift, bore: lift / bore, ("valve_lift",),
    ),
    _own("geometric_compression_ratio", COMPRESSION_RATIO.what, "", COMPRESSION_RATIO.low,
         COMPRESSION_RATIO.high, COMPRESSION_RATIO.source),
    *map(_usual, (
        "ring_pressure", "compression_ratio", "intake_pressure", "heat", "combustion_start",
        "combustion_duration",
    )),
)  # fmt: skip
"""Checks of given values. The first one that names a wrong parameter counts: other checks of
this parameter are skipped."""


def check_of_cylinder(key: str) -> Check | None:
    """Check of a key of one cylinder, such as bore_2: that of its plain key, where that has one.

    Examples
    --------
    >>> check_of_cylinder("bore_2").what
    'bore of cylinder 2'
    >>> check_of_cylinder("mass_factor_2") is None
    True
    """
    plain, _, number = key.rpartition("_")
    for check in CHECKS if number.isdigit() else ():
        if check.name == plain and check.needs == (plain,):
            what = f"{check.what} of cylinder {number}"
            return replace(check, name=key, what=what, needs=(key,), blames=(key,))
    return None


DIAGRAM_CHECKS: tuple[Check, ...] = (
    Check(
        "peak_pressure", "largest pressure", "bar", 2.0, 350.0,
        "judgement: compressors 2 to 30, engines 20 to 250, racing diesels more",
        ("largest",), _itself, ("pressure",), si=BAR,
    ),
    Check(
        "lowest_pressure", "lowest pressure", "bar", 0.15, 10.0,
        "judgement: idling with closed throttle to two-stage charging",
        ("lowest",), _itself, ("pressure",), si=BAR,
    ),
    Check(
        "pressure_ratio", "largest over lowest pressure of an engine's cycle", "", 4.0, 250.0,
        f"{HEYWOOD}, chapter 5: 40 to 100; widened to motored cycles and closed throttles",
        ("largest", "lowest", "burns"),
        lambda largest, lowest, burns: _where(burns, largest / lowest), ("pressure",),
    ),
    Check(
        "peak_angle", "angle of the largest pressure of an engine's cycle", "degree", -5.0, 25.0,
        f"{HEYWOOD}, section 9.1: 16 after dead centre at best timing; widened",
        ("peak_angle", "burns"), lambda angle, burns: _where(burns, angle), ("angle",),
        si=DEGREE,
    ),
    Check(
        "compression_rise", "pressure 60 over that 90 degrees before dead centre, of a four-stroke "
        "engine", "", 1.72, 2.4, "polytropes of exponents 1.25 to 1.4 at compression ratios from 6 "
        "to 25: 1.95 to 2.19 in the catalogue, at most 1.7 and at least 2.4 when its diagrams are "
        "20 degrees late and early",
        ("rise", "burns"), lambda rise, burns: _where(burns, rise), ("angle",),
    ),
    Check(
        "work_of_peak", "indicated mean effective over largest pressure of an engine's cycle", "",
        -0.04, 0.22, "judgement: at most 0.21 in the catalogue, and 0.19 to 0.35 when its "
        "diagrams are 20 degrees late",
        ("imep", "largest", "burns"),
        lambda imep, largest, burns: _where(burns, imep / largest), ("angle",),
    ),
    Check(
        "imep", "indicated mean effective pressure of an engine's cycle", "bar", -3.0, 45.0,
        f"{HEYWOOD}, section 2.7: brake mean effective pressure 7 to 20; widened to highly "
        "charged engines and their friction",
        ("imep", "burns"), lambda imep, burns: _where(burns, imep), ("pressure",), si=BAR,
    ),
)  # fmt: skip
"""Checks of indicator diagrams."""

RESULT_CHECKS: tuple[Check, ...] = (
    _own("shaft_stress_half_range", "vibratory shear stress in a shaft", "MPa", 0.0, 300.0,
         "judgement: rules for ships' shafts (IACS UR M68) allow some 30 to 90 in service, twice "
         "as much in passing; steel of crankshafts is fatigued by 200 to 300", si=MPA),
    _own("crankshaft_twist_half_range", "vibratory twist between disc 1 and flywheel", "degree",
         0.0, 5.0, "judgement: crankshafts fail at some 2 degrees; a damper's or pulley's rubber "
         "may twist more", si=DEGREE),
    _own("shaft_twist_half_range", "vibratory twist of a shaft", "degree", 0.0, 60.0,
         "judgement: arc springs of dual-mass flywheels reach their stops at 30 to 70, rubber "
         "couplings at 5 to 15", si=DEGREE),
    _own("coupling_departure", "departure of a coupling from its linear form", "", 0.0, 0.1,
         "judgement: beyond, linear results do not hold; shaft_torque_nonlinear does"),
    _own("grid_resonance_nearness", "resonance_band over the distance of an excited order from the "
         "natural order against the grid", "", 0.0, 1.0,
         "definition: an excited order lies within the band where it is above 1"),
    _own("driver_factor", "torque that is needed over that of the motor at nominal speed", "",
         -1.0, 1.0, "definition: above 1 a motor of this motor_breakdown_torque is too weak"),
    _own("delta", "coefficient of speed fluctuation", "", 0.0, MOST_DELTA,
         "judgement: engines that idle reach 1/6; beyond 1/2 an engine hardly runs"),
    _own("bmep", "brake mean effective pressure", "bar", -12.0, 40.0,
         f"{HEYWOOD}, section 2.7: 7 to 20; widened to highly charged engines, to motored ones "
         "and to compressors", si=BAR),
    *(
        _own(
            f"{bearing}_pressure_max", f"largest pressure of the {text}'s bearing over its "
            "projected area", "MPa", 0.3, high, source, si=MPA,
        )
        for bearing, text, high, source in (
            ("crank_pin", "crank pin", 120.0, _LININGS), ("main_journal", "main journal", 100.0,
                                                          _LININGS),
            ("piston_pin", "piston pin", 180.0, "Khurmi and Gupta, A Textbook of Machine Design, "
             "chapter 32: 25 for bronze bushes; widened by judgement to the pins of today"),
        )
    ),
)  # fmt: skip
"""Checks of results, for results that a scene asks for."""

NAMES = tuple(check.name for check in (*CHECKS, *DIAGRAM_CHECKS, *RESULT_CHECKS))
"""Names by which checks of given values and results are silenced."""

RECORDING_CHECKS = (
    "missing", "constant", "gap", "clipped", "noise", "samples", "drift", "gas_exchange",
    "level", "compression_exponent", "expansion_exponent", "dead_centre",
)  # fmt: skip
"""Names by which checks of recorded pressure (`engine_dyn.recordings`) are silenced."""
