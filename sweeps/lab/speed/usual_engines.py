"""Assumptions on an engine that is known by its data sheet alone: one table a kind of engine.

Every number has the reason that an engine file states for it. They are usual values and no data of
any engine: whoever knows better writes the number into the data sheet, where it goes before these.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from engine_dyn.flywheel import ADMISSIBLE, triangular_torque
from engine_dyn.parameters import PARAMETERS
from engine_dyn.units import RPM
from sweeps.scene.engine.data_sheets import PERIOD

_HEYWOOD = "Heywood, Internal Combustion Engine Fundamentals (1988)"


@dataclass(frozen=True)
class Fuel:
    """Fuel that an engine burns."""

    name: str
    heating_value: float  # Lower heating value [J/kg]
    burnt: float  # Share of the fuel that burns [1]
    # Mass of air over mass of fuel at full load, where the charge limits the heat [1].
    air_fuel_ratio: float
    # Air-fuel ratio below which the engine smokes or does not ignite [1]
    least_air_fuel_ratio: float
    with_air: bool  # Whether the charge holds the fuel when the cylinder closes
    source: str  # Source of the numbers

    @property
    def heat(self) -> float:
        """Heat released by a kilogram of fuel [J/kg]."""
        return self.burnt * self.heating_value

    @property
    def heat_of_charge(self) -> float:
        """Heat released by a kilogram of charge at `air_fuel_ratio` [J/kg]; method.md (136)."""
        return self.heat / (self.air_fuel_ratio + (1.0 if self.with_air else 0.0))


@dataclass(frozen=True)
class Usual:
    """A usual value at full load, and where it is another one the value without load."""

    full: float
    reason: str
    none: float | None = None

    def at(self, share: float) -> float:
        """Value at a share of full load [1]; linear."""
        value = self.full if self.none is None else self.none + (self.full - self.none) * share
        return float(f"{value:.10g}")


@dataclass(frozen=True)
class EngineKind:
    """A kind of engine."""

    title: str  # Kind of engine in words, for messages
    fuel: Fuel
    cycle: Mapping[str, Usual]  # Usual numbers of the cycle, in the units of engine files
    # Earliest and latest start of the combustion in the fit of a largest pressure [degree].
    starts: tuple[float, float]
    intake: tuple[float, float]  # Smallest and largest intake pressure in a fit [bar]
    charge_fitted: bool  # Whether the intake pressure follows from the power at full load
    # Whether lower loads have a lower intake pressure, with the same air-fuel ratio.
    throttled: bool
    boosted: bool  # Whether there is a turbocharger: the exhaust pressure follows the intake's
    # Masses of piston, rod and crank throw over piston area and bore [kg/m3].
    piston: float
    rod: float
    throw: float
    inertia: float  # Moment of inertia over displacement to the power 5/3 [kg/m3]


_DIESEL = Fuel(
    "diesel fuel", 42.5e6, 0.98, 22.0, 18.0, False,
    f"{_HEYWOOD}, from memory: 42.5 MJ/kg (appendix D), air-fuel ratios of 18 and more (section "
    "2.9); 2 percent unburnt and an air-fuel ratio of 22 with a turbocharger are usual",
)  # fmt: skip
_GASOLINE = Fuel(
    "gasoline",
    44.0e6,
    0.97,
    14.7,
    12.0,
    True,
    f"{_HEYWOOD}, from memory: 44 MJ/kg (appendix D); stoichiometric; 3 percent unburnt is usual",
)

_VALVES = {
    "valve_ramp": Usual(40.0, "A usual valve motion, as for the engines of the catalogue."),
    "valve_lag": Usual(8.0, "A usual blow-down, as for the engines of the catalogue."),
}
_OF_DIESEL = {
    "charge_temperature": Usual(335.0, "Usual for a warm engine that breathes ambient air."),
    "combustion_duration": Usual(
        80.0, "Usual for a diesel engine, 0 to 99.9 percent; shorter where less burns.", 55.0
    ),
    "combustion_form": Usual(1.2, "Usual for the diffusion part (Miyamoto et al. 1985)."),
    "premixed_share": Usual(0.1, "Usual at high load (Watson et al. 1980); grows with delay."),
    "premixed_duration": Usual(12.0, "Usual, 0 to 99.9 percent."),
    "premixed_form": Usual(2.0, "A smooth premixed part, as for the catalogue's ntua."),
    "wall_temperature": Usual(480.0, "Usual mean of head, piston and liner of a diesel.", 420.0),
    "intake_loss": Usual(0.05, "Usual pressure loss in the valves at this speed."),
    "exhaust_loss": Usual(0.06, "As intake_loss."),
    "intake_closing": Usual(-140.0, "Usual: 40 degrees after bottom dead centre."),
    "exhaust_opening": Usual(130.0, "Usual: 50 degrees before bottom dead centre."),
    **_VALVES,
}
_OF_SPARK = {
    "charge_temperature": Usual(330.0, "Usual for a warm engine, hotter where throttled.", 360.0),
    "combustion_duration": Usual(60.0, "Usual, 0 to 99.9 percent; longer where throttled.", 75.0),
    "combustion_form": Usual(2.0, "Usual for spark ignition (Heywood 1988)."),
    "wall_temperature": Usual(440.0, "Usual mean of head, piston and liner."),
    "intake_loss": Usual(
        0.08, "Usual pressure loss in the valves at this speed; less throttled.", 0.02
    ),
    "exhaust_loss": Usual(0.10, "As intake_loss.", 0.02),
    "intake_closing": Usual(-115.0, "Usual for an engine of this speed."),
    "exhaust_opening": Usual(125.0, "As intake_closing."),
    **_VALVES,
}
_BACK_PRESSURE = Usual(
    1.05, "Atmosphere and silencer, and before a turbine as much above it as the intake is."
)

KINDS: Mapping[str, EngineKind] = {
    "diesel": EngineKind(
        "naturally aspirated diesel engine", _DIESEL,
        {
            "compression_ratio": Usual(18.0, f"Usual; {_HEYWOOD}, table 2.1, has 12 to 24."),
            "intake_pressure": Usual(0.97, "Atmosphere less what filter and manifold take."),
            "exhaust_pressure": Usual(1.1, "Usual back pressure.", 1.03),
            "combustion_start": Usual(-8.0, "Usual start of combustion; the same at every load."),
            **_OF_DIESEL,
        },
        starts=(-30.0, 12.0), intake=(0.5, 1.1), charge_fitted=False, throttled=False,
        boosted=False, piston=1900.0, rod=2200.0, throw=2000.0, inertia=9000.0,
    ),
    "turbocharged-diesel": EngineKind(
        "turbocharged diesel engine with intercooler", _DIESEL,
        {
            "compression_ratio": Usual(17.0, f"Usual; {_HEYWOOD}, table 2.1, has 12 to 24."),
            "exhaust_pressure": _BACK_PRESSURE,
            "combustion_start": Usual(-4.0, "Usual start of combustion; the same at every load."),
            **_OF_DIESEL,
            "charge_temperature": Usual(
                350.0, "Usual with an intercooler; cooler with less boost.", 335.0
            ),
        },
        starts=(-30.0, 15.0), intake=(0.9, 4.5), charge_fitted=True, throttled=False,
        boosted=True, piston=1900.0, rod=2200.0, throw=2000.0, inertia=9000.0,
    ),
    "spark-ignition": EngineKind(
        "naturally aspirated spark-ignition engine", _GASOLINE,
        {
            "compression_ratio": Usual(10.0, f"Usual; {_HEYWOOD}, table 2.1, has 6 to 12."),
            "exhaust_pressure": Usual(1.15, "Usual back pressure.", 1.0),
            "combustion_start": Usual(
                -24.0, "Usual advance for this speed, more where throttled.", -36.0
            ),
            **_OF_SPARK,
        },
        starts=(-55.0, 5.0), intake=(0.25, 1.2), charge_fitted=True, throttled=True,
        boosted=False, piston=950.0, rod=1000.0, throw=1000.0, inertia=3500.0,
    ),
    "turbocharged-spark-ignition": EngineKind(
        "turbocharged spark-ignition engine with intercooler", _GASOLINE,
        {
            "compression_ratio": Usual(9.5, f"Usual; {_HEYWOOD}, table 2.1, has 6 to 12."),
            "exhaust_pressure": _BACK_PRESSURE,
            "combustion_start": Usual(
                -14.0, "Usual: late at full load, because of knock; more where throttled.", -36.0
            ),
            **_OF_SPARK,
            "charge_temperature": Usual(340.0, "Usual with an intercooler.", 350.0),
        },
        starts=(-55.0, 15.0), intake=(0.25, 3.2), charge_fitted=True, throttled=True,
        boosted=True, piston=1100.0, rod=1150.0, throw=1100.0, inertia=3500.0,
    ),
}  # fmt: skip
"""Kinds of engines by their names in data sheets."""


@dataclass(frozen=True)
class UsualValue:
    """A usual value of a key of [values]."""

    # Function from the values that are known so far (with the rated power [kW]) and the kind of
    # engine to the value, in the unit of the key.
    make: Callable[[Mapping[str, float], EngineKind], float]
    reason: str


def _typical(key: str, reason: str) -> UsualValue:
    return UsualValue(lambda *_: PARAMETERS[key].typical, reason)


def _mass(density: float, values: Mapping[str, float]) -> float:
    return _rounded(density * 0.25 * math.pi * values["bore"] ** 3)


def _rod(values: Mapping[str, float]) -> float:
    if "rod_length" in values:
        return values["rod_length"]
    return 0.5 * values["stroke"] / values["crank_ratio"]


def _displacement(values: Mapping[str, float]) -> float:
    return 0.25 * math.pi * values["bore"] ** 2 * values["stroke"] * values["cylinders"]


def _inertia(values: Mapping[str, float], kind: EngineKind) -> float:
    """Inertia by size; for few cylinders by the power and its speed, if that is more."""
    by_size = kind.inertia * _displacement(values) ** (5.0 / 3.0)
    between = PERIOD / values["cylinders"]  # Angle from one firing to the next
    # Smallest coefficient of speed fluctuation that is usual for pumps
    steady_share = ADMISSIBLE["pump"][0]
    fired = triangular_torque(1e3 * values["power"], values["speed"] * RPM, steady_share, between)
    return _rounded(max(by_size, float(fired.inertia)))


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")


_MASS = (
    "From piston area and bore, as masses of similar engines go with the cube of the bore; Kolchin "
    "and Demidov (1984) have {range} kg/m2 over the piston area at bores of 60 to 120 mm."
)
_FRICTION = "Kakaitsas (2015), eq. 3.9, a diesel engine; no friction of this engine is known."

VALUES: Mapping[str, UsualValue] = {
    "rod_length": UsualValue(
        lambda values, _: _rounded(values["stroke"] / 0.58),
        f"Makes lambda 0.29; {_HEYWOOD}, section 2.2: 1/4 to 1/3 in small and medium engines.",
    ),
    "piston_mass": UsualValue(
        lambda values, kind: _mass(kind.piston, values),
        _MASS.format(range="80 to 400"),
    ),
    "rod_mass": UsualValue(
        lambda values, kind: _mass(kind.rod, values),
        _MASS.format(range="100 to 400"),
    ),
    "rod_centre_of_gravity": UsualValue(
        lambda values, _: _rounded(0.28 * _rod(values)),
        "Kolchin and Demidov (1984): 0.2 to 0.3 of the rod's mass goes with the piston.",
    ),
    "crank_mass": UsualValue(
        lambda values, kind: _mass(kind.throw, values),
        "As piston_mass; enters only rotating mass and engine inertia.",
    ),
    "inertia": UsualValue(
        _inertia,
        "Engine with flywheel, as similar engines of the catalogue (diesel_105x137, "
        "si_four_87x101) have it over displacement^(5/3), or as delta = 1/30 (of pumps) needs by "
        "Asgari's triangular torque at the rated point, if more. Replace it: delta goes "
        "with its inverse.",
    ),
    "load": UsualValue(lambda *_: 100.0, "The rated point is called 100 percent."),
    "load_exponent": _typical("load_exponent", "A brake or propeller, as in the catalogue."),
    "load_offset": _typical("load_offset", "No constant part of the load torque."),
    "crankcase_pressure": _typical("crankcase_pressure", "Atmosphere."),
    "friction_constant": _typical("friction_constant", _FRICTION),
    "friction_peak_pressure": _typical("friction_peak_pressure", "As friction_constant."),
    "friction_mean_piston_speed": _typical("friction_mean_piston_speed", "As friction_constant."),
}
"""Usual values of an engine, in the order in which they are made."""
