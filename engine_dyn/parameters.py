"""The parameters of engines and scenes: the one table of all that is said of them.

Graph, keywords of `engine_dyn.periodic_speed`, usual ranges and templates take names, units,
ranges and usual values from here. Parameters of one subject alone stand beside its quantities. No
compiled module imports this one, so that a new parameter does not compile kernels again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

from engine_dyn.geometry.arrangement import MOST_CYLINDERS
from engine_dyn.units import BAR, DEGREE, RPM


class Usual(NamedTuple):
    """The range in which engines usually have a parameter, in its unit, and where it is from.

    `what` names the parameter in a warning; `zero` says that 0 is meant: what is left out.
    """

    what: str
    low: float
    high: float
    source: str
    zero: bool = False


@dataclass(frozen=True)
class Parameter:
    """A key of scenes and engine files: a number, or a name for one."""

    # Five fields: name in scenes and files; symbol in the literature (mathtext without dollars);
    # unit of files as UDUNITS reads it; meaning in one line; source, author and equation.
    name: str
    symbol: str
    unit: str
    meaning: str
    source: str
    si: float = 1.0  # SI value of one file unit
    # Ends of the range of allowed values in file units: `above` and `below` are excluded,
    # `at_least` and `at_most` included.
    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None
    # Whether the value must be a whole number, and whether it must be even.
    whole: bool = False
    even: bool = False
    # Words that scenes may write in place of a number, each with its number in file units.
    named: tuple[tuple[str, float], ...] = ()
    # Value in file units where neither scene nor engine gives one. One outside the allowed range
    # stands for no value: with `passes` = 0, cycles are computed until the cycle closes.
    unless_given: float | None = None
    keyword: str = ""  # Keyword of `engine_dyn.periodic_speed` for the parameter, if not its name
    # Value in file units that templates propose, or the keyword's default. NaN where there is none.
    typical: float = math.nan
    usual: Usual | None = None  # Range outside of which a warning asks whether the value is meant

    @property
    def low(self) -> float:
        """Lower end of the range in file units."""
        ends = (end for end in (self.above, self.at_least) if end is not None)
        return next(ends, -math.inf)

    @property
    def high(self) -> float:
        """Upper end of the range in file units."""
        ends = (end for end in (self.below, self.at_most) if end is not None)
        return next(ends, math.inf)


HEYWOOD = "Heywood, Internal Combustion Engine Fundamentals (1988)"

COMPRESSION_RATIO = Usual(
    "compression ratio", 4.0, 25.0, f"{HEYWOOD}, table 2.1: 6 to 24; widened to old engines"
)
"""Usual range of compression ratios, for modelled cycles and for cylinders."""

_PARAMETERS = (
    Parameter(
        "reciprocating_mass", "m", "kg", "reciprocating mass per cylinder", "Kakaitsas eq. 2.10",
        at_least=0.0,
    ),
    Parameter(
        "inertia", r"\Theta", "kg m2", "moment of inertia of the whole engine with its load",
        "Kakaitsas section 3.2", above=0.0,
    ),
    Parameter(
        "auxiliary_inertia", r"\Theta_{aux}", "kg m2",
        "moment of inertia of the auxiliaries, referred to the crankshaft", "Kakaitsas eq. 3.2",
        at_least=0.0, unless_given=0.0,
    ),
    Parameter(
        "flywheel_inertia", r"\Theta_{fly}", "kg m2", "moment of inertia of the flywheel",
        "Kakaitsas eq. 3.2", at_least=0.0, unless_given=0.0,
    ),
    Parameter(
        "load_inertia", r"\Theta_L", "kg m2", "moment of inertia of the load at its own shaft",
        "Kakaitsas eq. 3.1", at_least=0.0, unless_given=0.0,
    ),
    Parameter(
        "gear_ratio", "i", "1", "gear ratio, load-shaft speed over crankshaft speed",
        "Kakaitsas eq. 3.1", above=0.0, at_most=100.0, unless_given=1.0,
    ),
    Parameter(
        "load_phase", r"\theta_0", "degree",
        "phase of a load over angle: the load's angle at firing top dead centre of cylinder 1",
        "this project", si=DEGREE, at_least=-720.0, at_most=720.0, unless_given=0.0,
    ),
    Parameter(
        "load_table_factor", "f_L", "1", "factor on a load over angle", "this project",
        at_least=0.0, unless_given=1.0, keyword="load_scale",
    ),
    Parameter(
        "torque_factor", "f_M", "1", "factor on the torque that an engine file gives",
        "this project", above=0.0, unless_given=1.0,
    ),
    Parameter(
        "motor_gear_ratio", "i_m", "1", "driving motor: shaft speed over crankshaft speed",
        "this project", above=0.0, at_most=100.0, unless_given=1.0,
    ),
    Parameter(
        "motor_synchronous_speed", "n_s", "rpm",
        "driving motor: synchronous speed, at its own shaft", "Kloss's formula", si=RPM, above=0.0,
    ),
    Parameter(
        "motor_slip", "s_n", "1",
        "driving motor: slip at nominal speed, for a gear or supply that follows that speed",
        "Kloss's formula", above=0.0, below=1.0,
    ),
    Parameter(
        "motor_breakdown_slip", "s_b", "1",
        "driving motor: breakdown slip, the slip at the largest torque", "Kloss's formula",
        above=0.0, below=10.0, keyword="breakdown_slip",
        usual=Usual("slip at the motor's largest torque", 0.02, 2.0,
                    "judgement: 0.1 to 0.3, motors with much resistance up to 1"),
    ),
    Parameter(
        "motor_breakdown_torque", "M_b", "N m",
        "driving motor: breakdown torque, the largest torque, at its own shaft", "Kloss's formula",
        above=0.0, keyword="breakdown_torque",
    ),
    Parameter(
        "crank_ratio", r"\lambda", "1", "crank ratio, crank radius over rod length",
        "Kakaitsas eq. 1.3", above=0.0, below=1.0,
    ),
    Parameter(
        "rod_length", "l", "m", "connecting rod length between centres", "Kakaitsas table 4.1",
        above=0.0,
    ),
    Parameter(
        "bore", "D", "m", "cylinder bore", "Kakaitsas table 4.1", above=0.0,
        usual=Usual("bore", 0.008, 1.1, "judgement: model aeroplane engines to the largest marine "
                    "engines, 0.98 m"),
    ),
    Parameter("stroke", "s", "m", "piston stroke", "Kakaitsas table 4.1", above=0.0),
    Parameter(
        "pin_offset", "e_p", "m",
        "piston-pin offset from the cylinder axis, positive on the side where the crank pin moves "
        "down", "Norton, Design of Machinery: offset slider-crank", unless_given=0.0,
    ),
    Parameter(
        "crank_offset", "e_c", "m",
        "cylinder-axis offset from the crankshaft axis, positive on the side where the crank pin "
        "moves down", "Norton, Design of Machinery: offset slider-crank", unless_given=0.0,
    ),
    Parameter("speed", "n", "rpm", "nominal crank speed", "Kakaitsas table 4.1", si=RPM, above=0.0),
    Parameter(
        "largest_speed", "n_{max}", "rpm",
        "largest crank speed over the cycle, in place of the nominal one, of an engine whose "
        "torque is given", "this project", si=RPM, above=0.0,
    ),
    Parameter(
        "smallest_speed", "n_{min}", "rpm",
        "smallest crank speed over the cycle, in place of the nominal one, of an engine whose "
        "torque is given", "this project", si=RPM, above=0.0,
    ),
    Parameter(
        "load", "L", "percent", "engine load", "Kakaitsas section 5.2.5", at_least=0.0,
        usual=Usual("load", 1.5, 150.0,
                    "judgement: 1 percent is mostly 100 percent written as a share", zero=True),
    ),
    Parameter(
        "recorded_cycle", "c", "1", "recorded cycle, treated as if it repeated", "this project",
        at_least=1.0, whole=True,
    ),
    Parameter(
        "cylinders", "Z", "1", "number of cylinders", "Kakaitsas section 5.4", at_least=1.0,
        at_most=float(MOST_CYLINDERS), whole=True,
    ),
    Parameter(
        "misfire", "i_0", "1", "misfiring cylinder, 0 for none", "this project", at_least=0.0,
        at_most=float(MOST_CYLINDERS), whole=True, unless_given=0.0,
    ),
    Parameter(
        "load_exponent", r"\alpha", "1", "exponent of the speed in the load torque",
        "Kakaitsas eq. 3.4", at_least=0.0, typical=2.0,
        usual=Usual("exponent of the load torque", 0.0, 3.5,
                    "judgement: constant torque 0, propeller and fan 2"),
    ),
    Parameter(
        "load_linear", "b", "N m s", "linear coefficient of the speed in the load torque",
        "M_L = a + k (b omega + c omega^2): a brake or a fan with bearing losses", at_least=0.0,
    ),
    Parameter(
        "load_square", "c", "N m s2", "quadratic coefficient of the speed in the load torque",
        "M_L = a + k (b omega + c omega^2): a brake or a fan with bearing losses", at_least=0.0,
    ),
    Parameter(
        "load_offset", "a", "N m", "load torque independent of speed", "Kakaitsas eq. 3.4",
        typical=0.0,
    ),
    Parameter(
        "crankcase_pressure", "p_c", "bar", "crankcase pressure, absolute, under the piston",
        "Kakaitsas section 2.1", si=BAR, at_least=0.0, typical=1.01325,
        usual=Usual("pressure under the piston", 0.5, 5.0,
                    "judgement: atmosphere at a height of 5000 m to compressors that breathe "
                    "through their crankcase"),
    ),
    Parameter(
        "piston_mass", r"m_\epsilon", "kg", "piston mass with pin and rings", "Kakaitsas table 4.1",
        at_least=0.0,
    ),
    Parameter(
        "rod_mass", r"m_\delta", "kg", "connecting rod mass", "Kakaitsas table 4.1", at_least=0.0,
    ),
    Parameter(
        "rod_centre_of_gravity", "l_{cg}", "m",
        "distance of the rod's centre of gravity from the big end", "Kakaitsas table 4.1",
        at_least=0.0,
    ),
    Parameter(
        "rod_inertia", r"\theta_\delta", "kg m2",
        "moment of inertia of the rod about its centre of gravity; by default, that of the "
        "two-mass model", "Rakopoulos notes, third condition", above=0.0,
    ),
    Parameter(
        "crank_mass", r"m_\sigma", "kg", "mass of each throw, reduced to the crank radius",
        "Kakaitsas eq. 2.15", at_least=0.0,
    ),
    Parameter(
        "throw_mass", "m_o", "kg", "mass of a crank throw", "Kakaitsas eq. 2.15, Asgari eq. 6",
        at_least=0.0,
    ),
    Parameter(
        "throw_radius", "r_o", "m", "distance of a throw's centre of gravity from the shaft axis",
        "Kakaitsas eq. 2.15, Asgari eq. 6", at_least=0.0,
    ),
    Parameter(
        "friction_constant", "a_2", "bar", "constant part of the friction mean effective pressure",
        "Kakaitsas eq. 3.9", si=BAR, at_least=0.0, typical=0.137,
    ),
    Parameter(
        "friction_peak_pressure", "b_2", "1", "friction mean effective pressure per peak pressure",
        "Kakaitsas eq. 3.9", at_least=0.0, typical=0.005,
    ),
    Parameter(
        "friction_mean_piston_speed", "c_2", "bar s m-1",
        "friction mean effective pressure per mean piston speed", "Kakaitsas eq. 3.9", si=BAR,
        at_least=0.0, typical=0.142,
    ),
    Parameter(
        "friction_mean_piston_speed_square", "d_2", "bar s2 m-2",
        "friction mean effective pressure per squared mean piston speed",
        "Chen and Flynn, SAE 650733", si=BAR, at_least=0.0, unless_given=0.0,
    ),
    Parameter(
        "friction_boundary", "f_b", "1",
        "share of piston friction with a constant coefficient (boundary lubrication)",
        "after Rezeka and Henein, SAE 840179", at_least=0.0, at_most=1.0, unless_given=0.0,
    ),
    Parameter(
        "friction_mixed", "f_m", "1",
        "share of piston friction whose coefficient falls with piston speed (mixed lubrication)",
        "after Rezeka and Henein, SAE 840179", at_least=0.0, at_most=1.0, unless_given=0.0,
    ),
    Parameter(
        "friction_hydrodynamic", "f_h", "1",
        "share of piston friction that grows with the square root of speed times pressure "
        "(hydrodynamic lubrication)", "after Rezeka and Henein, SAE 840179", at_least=0.0,
        at_most=1.0, unless_given=0.0,
    ),
    Parameter(
        "friction_skirt", "f_s", "1",
        "share of piston friction that grows with piston speed (skirt)",
        "after Rezeka and Henein, SAE 840179", at_least=0.0, at_most=1.0, unless_given=0.0,
    ),
    Parameter(
        "ring_pressure", "p_r", "bar",
        "contact pressure of the piston rings on the liner due to ring tension",
        "after Rezeka and Henein, SAE 840179", si=BAR, above=0.0, below=100.0,
        usual=Usual("pressure of the piston rings by their tension", 0.1, 20.0, "judgement",
                    zero=True),
    ),
    Parameter(
        "auxiliary_torque", "M_{aux}", "N m",
        "torque of the auxiliaries at the crankshaft, part of the friction", "this project",
        at_least=0.0, unless_given=0.0,
    ),
    Parameter(
        "compression_ratio", r"\varepsilon", "1",
        "compression ratio, largest over smallest cylinder volume; in a scene, that of the "
        "modelled cycles", "Heywood (1988), ch. 2", above=1.5, below=40.0,
        usual=COMPRESSION_RATIO,
    ),
    Parameter(
        "intake_pressure", "p_i", "bar",
        "modelled cycle: absolute pressure of intake manifold or scavenge air",
        "Heywood (1988), ch. 6", si=BAR, above=0.0, below=20.0,
        usual=Usual("pressure of the charge", 0.15, 7.0,
                    "judgement: idling with closed throttle to two-stage charging"),
    ),
    Parameter(
        "heat", "q", "bar", "modelled cycle: heat released per cycle over the swept volume",
        "Heywood (1988), ch. 9", si=BAR, at_least=0.0, at_most=200.0,
        usual=Usual("heat over the swept volume", 0.5, 100.0,
                    "judgement: twice to three times the indicated mean effective pressure",
                    zero=True),
    ),
    Parameter(
        "combustion_start", r"\varphi_b", "degree", "modelled cycle: start of the combustion",
        "Heywood (1988), eq. 9.30", si=DEGREE, above=-90.0, below=90.0,
        usual=Usual("start of the combustion", -60.0, 25.0,
                    f"{HEYWOOD}, chapters 9 and 10; widened"),
    ),
    Parameter(
        "combustion_duration", r"\Delta\varphi_b", "degree",
        "modelled cycle: duration of the combustion", "Heywood (1988), eq. 9.30", si=DEGREE,
        above=2.0, below=270.0,
        usual=Usual("duration of the combustion", 10.0, 160.0,
                    f"{HEYWOOD}, section 9.2 (30 to 90); widened to slow and late combustion"),
    ),
    Parameter(
        "truncation", r"\nu_{max}", "1",
        "highest order kept in the truncated series of piston motion", "Mosakowski eqs. 13, 18",
        at_least=2.0, at_most=40.0, whole=True, even=True, unless_given=2.0,
    ),
    Parameter(
        "passes", "N", "1", "number of cycles to compute (method thesis)", "Kakaitsas section 4.2",
        at_least=1.0, whole=True, unless_given=0.0,
    ),
    Parameter(
        "start_speed", r"\omega_1", "rad s-1", "crank speed at the start (method thesis)",
        "Kakaitsas section 4.2", above=0.0, unless_given=0.0,
    ),
    Parameter(
        "start_angle", r"\varphi_1", "degree", "crank angle at the start (method thesis)",
        "Kakaitsas section 4.2", si=DEGREE, at_least=-720.0, at_most=720.0, unless_given=-180.0,
    ),
)  # fmt: skip

PARAMETERS: Mapping[str, Parameter] = MappingProxyType({one.name: one for one in _PARAMETERS})
"""All parameters by name, in the order of lists."""

KEYWORDS: Mapping[str, Parameter] = MappingProxyType(
    {one.keyword or one.name: one for one in _PARAMETERS}
)
"""All parameters by their keywords of `engine_dyn.periodic_speed`."""
