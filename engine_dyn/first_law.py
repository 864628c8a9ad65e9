"""Modelled cycles by the first law: one zone, gas that depends on temperature, loss to the walls.

Beside `cycle`, whose effective exponents hold everything, this one says where the heat goes. While
the cylinder is closed its gas is one zone of ideal gas of fixed mass; heat comes from one or two
Wiebe functions and goes to the walls by Woschni's formula, by a polytrope, or not at all. While it
is open, the pressure relaxes to the manifolds, through valves (four-stroke) or ports (two-stroke).
Residual gas, blow-by, dissociation and the chemistry of burnt gas are left out.

Everything is per swept volume, so that bore, stroke and speed enter through Woschni alone. Angles
are in radians from firing top dead centre, pressures absolute, all SI. A batch of cycles is one
call of one kernel: `tabulate`.

Sources
-------
Heywood, Internal Combustion Engine Fundamentals, McGraw-Hill 1988: first law of one zone, ch. 9;
Wiebe function, eq. 9.30; Woschni's formula with its constants, section 12.4. Gatowski, Balles,
Chun, Nelson, Ekchian and Heywood, SAE paper 841359, 1984: ratio of specific heats linear in
temperature. Woschni, SAE paper 670931, 1967. Butcher, The Numerical Analysis of Ordinary
Differential Equations, Wiley 1987: Runge-Kutta method of order six in seven stages.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from engine_dyn import slider_crank, status
from engine_dyn.compilation import inlined, kernel
from engine_dyn.slider_crank import position_at, velocity_at

__all__ = [
    "FOUR_STROKE_UNITS",
    "TWO_STROKE_UNITS",
    "WALLS",
    "Diagrams",
    "FourStrokeCycle",
    "TwoStrokeCycle",
    "table_angles",
    "tabulate",
]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

DEGREE = math.pi / 180.0
BAR = 1e5

WALLS = ("adiabatic", "polytropic", "woschni")
"""Models of the heat that goes to the walls."""
ADIABATIC, POLYTROPIC, WOSCHNI = range(3)

GAMMA_300, GAMMA_SLOPE = 1.38, 8e-5
"""gamma = 1.38 - 0.08 (T - 300 K)/1000 K: Gatowski et al. (1984)."""
REFERENCE = 300.0

WIEBE = math.log(1000.0)
"""Wiebe's factor for a duration that ends when 99.9 % have burnt."""

HOTTEST = 4000.0
"""Beyond this temperature [K] nothing supports a gamma that falls with a straight line."""

# Woschni (1967) as in Heywood, eqs. 12.67 to 12.69: h = 3.26 B^-0.2 p^0.8 T^-0.55 w^0.8 with p in
# kPa, w = 2.28 c_m + 3.24e-3 (V_h T_r)/(p_r V_r) (p - p_m); the second part from combustion on.
WOSCHNI_FACTOR = 3.26 * 1000.0**-0.8
WOSCHNI_PISTON = 2.28
WOSCHNI_COMBUSTION = 3.24e-3

# The exponent of a polytrope changes over this angle to both sides of dead centre.
EXPONENT_REACH = 30.0 * DEGREE

# Steps: at most this wide, this share of a combustion and of the lag of a valve.
LARGEST_STEP = 0.5 * DEGREE
STEPS_OF_COMBUSTION = 24.0
STEPS_OF_LAG = 6.0
STEPS_OF_RAMP = 12.0
# A rate that begins like (phi - start)^m has no derivatives there beyond m: the first steps after
# it begin small and double.
DOUBLINGS = 6

MOST_PASSES = 60
"""Cycles that are followed until the pressure repeats."""
REPEATS = 1e-12

# Wiebe functions are followed to this many durations: nothing is left, and powers stay finite.
BURNT_OUT = 4.0


class _Field(NamedTuple):
    """Unit of a field in files and its range there; `ends` says whether the range's ends belong."""

    unit: str
    low: float
    high: float
    ends: bool = False


_SIZE = {"1": 1.0, "bar": BAR, "degree": DEGREE, "K": 1.0, "K-1": 1.0, "m": 1.0, "rpm": math.pi / 30.0}

_GAS = {
    "compression_ratio": _Field("1", 1.5, 40.0),
    "crank_ratio": _Field("1", 0.0, 1.0),
    "intake_pressure": _Field("bar", 0.0, 20.0),
    "exhaust_pressure": _Field("bar", 0.0, 20.0),
    "charge_temperature": _Field("K", 200.0, 700.0),
    "heat": _Field("bar", 0.0, 200.0, ends=True),
    "combustion_start": _Field("degree", -90.0, 90.0),
    "combustion_duration": _Field("degree", 2.0, 270.0),
    # Below 1 the rate of heat release has a corner that no spline follows.
    "combustion_form": _Field("1", 1.0, 10.0, ends=True),
    "valve_ramp": _Field("degree", 2.0, 90.0),
    "valve_lag": _Field("degree", 0.5, 45.0),
}
_FURTHER = {
    "premixed_share": _Field("1", 0.0, 1.0, ends=True),
    "premixed_start": _Field("degree", -90.0, 90.0),
    "premixed_duration": _Field("degree", 2.0, 180.0),
    "premixed_form": _Field("1", 1.0, 10.0, ends=True),
    "wiebe_factor": _Field("1", 1.0, 20.0),
    "gamma_300": _Field("1", 1.0, 5.0 / 3.0, ends=True),
    "gamma_slope": _Field("K-1", 0.0, 3e-4, ends=True),
}
_OF_WALL = {
    POLYTROPIC: {
        "compression_exponent": _Field("1", 1.0, 5.0 / 3.0),
        "expansion_exponent": _Field("1", 1.0, 5.0 / 3.0),
    },
    WOSCHNI: {
        "wall_temperature": _Field("K", 200.0, 1200.0),
        "wall_factor": _Field("1", 0.0, 10.0, ends=True),
        "bore": _Field("m", 0.0, 3.0),
        "stroke": _Field("m", 0.0, 6.0),
        "speed": _Field("rpm", 0.0, 30000.0),
    },
}
_VALVES = {
    "intake_loss": _Field("bar", 0.0, 10.0, ends=True),
    "exhaust_loss": _Field("bar", 0.0, 10.0, ends=True),
    "intake_closing": _Field("degree", -180.0, -45.0),
    "exhaust_opening": _Field("degree", 45.0, 180.0),
}
_PORTS = {
    "exhaust_opening": _Field("degree", 45.0, 180.0),
    "scavenge_opening": _Field("degree", 45.0, 180.0),
    "exhaust_closing": _Field("degree", -180.0, -45.0),
}
_WALL_FIELDS = {name: item for part in _OF_WALL.values() for name, item in part.items()}


def _units(*parts: Mapping[str, _Field]) -> dict[str, tuple[str, float]]:
    return {n: (item.unit, _SIZE[item.unit]) for part in parts for n, item in part.items()}


FOUR_STROKE_UNITS = _units(_GAS, _FURTHER, _WALL_FIELDS, _VALVES)
"""Unit in which an engine file gives each number of a FourStrokeCycle, and its size in SI."""
TWO_STROKE_UNITS = _units(_GAS, _FURTHER, _WALL_FIELDS, _PORTS)
"""The same of a TwoStrokeCycle."""


@dataclass(frozen=True, kw_only=True)
class _ClosedCycle:
    """What four-stroke and two-stroke cycles share."""

    compression_ratio: float
    crank_ratio: float
    intake_pressure: float
    exhaust_pressure: float
    charge_temperature: float
    heat: float
    combustion_start: float
    combustion_duration: float
    combustion_form: float
    valve_ramp: float
    valve_lag: float
    premixed_share: float = 0.0
    premixed_start: float = 0.0
    premixed_duration: float = 10.0 * DEGREE
    premixed_form: float = 2.0
    wiebe_factor: float = WIEBE
    gamma_300: float = GAMMA_300
    gamma_slope: float = GAMMA_SLOPE
    wall: str = "adiabatic"
    compression_exponent: float = math.nan
    expansion_exponent: float = math.nan
    wall_temperature: float = math.nan
    wall_factor: float = 1.0
    bore: float = math.nan
    stroke: float = math.nan
    speed: float = math.nan

    period: ClassVar[float]
    units: ClassVar[dict[str, tuple[str, float]]]

    def __post_init__(self) -> None:
        """Refuse values that are no cycle; ValueError names field, value and what is allowed."""
        values = {item.name: getattr(self, item.name) for item in fields(self)}
        columns = {n: np.asarray(v, dtype=np.float64) for n, v in values.items() if n != "wall"}
        for bad, message in _refusals(type(self), columns, _wall_code(self.wall)):
            if bad.any():
                raise ValueError(message(0))

    def volume(self, phi: ArrayLike) -> Floats:
        """Cylinder volume over the swept volume [1] at crank angles [rad]."""
        travel = slider_crank.position(phi, self.crank_ratio)
        return np.asarray(1.0 / (self.compression_ratio - 1.0) + 0.5 * travel, dtype=np.float64)

    def burnt_fraction(self, phi: ArrayLike) -> Floats:
        """Part of the heat released by each crank angle [rad], 0..1 (Heywood eq. 9.30)."""
        total: Floats = np.zeros(np.shape(phi))
        for share, start, duration, form in (
            (
                1.0 - self.premixed_share,
                self.combustion_start,
                self.combustion_duration,
                self.combustion_form,
            ),
            (
                self.premixed_share,
                self.premixed_start,
                self.premixed_duration,
                self.premixed_form,
            ),
        ):
            time = np.clip((np.asarray(phi) - start) / duration, 0.0, BURNT_OUT)
            total = total - share * np.expm1(-self.wiebe_factor * time ** (form + 1.0))
        return total

    def gamma(self, temperature: ArrayLike) -> Floats:
        """Ratio of specific heats [1] at temperatures [K] (Gatowski et al. 1984)."""
        warmer = np.asarray(temperature, dtype=np.float64) - REFERENCE
        return np.asarray(self.gamma_300 - self.gamma_slope * warmer)

    def points(self, step_degrees: float = 0.5) -> tuple[Floats, Floats]:
        """Tabulate the cycle for a Diagram.

        Parameters
        ----------
        step_degrees : float
            Step of the table [degree]; the cycle must be a multiple of it. 0.5 by default.

        Returns
        -------
        angle, pressure : ndarray
            Crank angle [rad] from -period/2, end excluded, and absolute pressure [Pa].

        Raises
        ------
        ValueError
            If the step does not divide the cycle or is over 10 degrees; if the pressure does not
            repeat because the cylinder is open too briefly; if the gas becomes too hot.
        """
        values: dict[str, Any] = {item.name: getattr(self, item.name) for item in fields(self)}
        found = tabulate(type(self), values, step_degrees)
        if found.status == status.NOT_CONVERGED:
            raise ValueError(
                f"valve_lag = {self.valve_lag / DEGREE:.6g} degree: must be shorter, the cylinder "
                "is not emptied while it is open"
            )
        if found.status == status.INVALID_INPUT:
            raise ValueError(
                f"heat = {self.heat / BAR:.6g} bar: must be less, the gas becomes hotter than "
                f"{HOTTEST:g} K"
            )
        return found.angle, found.pressure


@dataclass(frozen=True, kw_only=True)
class FourStrokeCycle(_ClosedCycle):
    """Parameters of a modelled four-stroke cycle, in SI units and radians.

    While the cylinder is closed, with u the internal energy per mass, v the volume and all heats
    over the swept volume,

        d(m u)/dphi = Q x'(phi) - p v' - Q_w',      u' = R T'/(gamma(T) - 1),
        gamma(T) = gamma_300 - gamma_slope (T - 300 K),       p v = m R T,

    where x is the burnt fraction, a sum of two Wiebe functions. Its mass follows from
    `charge_temperature` at the end of the closing. The loss to the walls is none ("adiabatic");
    such that an unfired charge follows p v^n ("polytropic", n from the compression's value to the
    expansion's within 30 degrees of dead centre); or h A (T - T_w)/omega with Woschni's h and
    the walls of a disc-shaped chamber, A = pi B^2/2 + 4 V/B ("woschni"). The pressure p_m of the
    motored engine that his formula wants is integrated beside p.

    While a valve is open the pressure relaxes to the manifold's exactly as in `cycle.DieselCycle`;
    on the ramps between, exponent and loss stay as at the end of the closed part.

    Attributes
    ----------
    compression_ratio : float
        Largest over smallest cylinder volume [1].
    crank_ratio : float
        Crank radius over rod length [1].
    intake_pressure, exhaust_pressure : float
        Pressure of the manifolds at the valves, absolute [Pa]; a throttle lowers the first.
    charge_temperature : float
        Temperature of the charge when the cylinder has closed [K].
    heat : float
        Heat released per cycle over the swept volume [Pa = J/m3]; 0 is a motored engine.
    combustion_start, combustion_duration, combustion_form : float
        Wiebe function: start [rad], duration [rad] and form exponent m [1].
    valve_ramp : float
        Angle over which a valve closes or opens, and half of that of the change from exhaust to
        intake manifold around gas exchange dead centre [rad].
    valve_lag : float
        Angle in which the difference to the manifold pressure falls to 1/e with an open
        valve [rad].
    premixed_share, premixed_start, premixed_duration, premixed_form : float
        Share and Wiebe function of a second, premixed combustion (diesel); no share by default.
    wiebe_factor : float
        Factor a in 1 - exp(-a t^(m+1)) [1]; ln 1000 by default, 5 in Heywood.
    gamma_300, gamma_slope : float
        Ratio of specific heats at 300 K [1] and its fall per kelvin [1/K].
    wall : str
        "adiabatic", "polytropic" or "woschni".
    compression_exponent, expansion_exponent : float
        Polytropic exponents [1], needed by "polytropic" alone.
    wall_temperature, wall_factor, bore, stroke, speed : float
        Mean temperature of the walls [K], factor on Woschni's h [1], bore and stroke [m], crank
        speed [rad/s], needed by "woschni" alone.
    intake_loss, exhaust_loss : float
        Difference of pressure across the open valve while the piston is as fast as the crank
        pin [Pa].
    intake_closing, exhaust_opening : float
        Intake fully closed [rad, in the compression stroke], exhaust begins to open [rad, in the
        expansion stroke].
    """

    intake_loss: float
    exhaust_loss: float
    intake_closing: float
    exhaust_opening: float

    period: ClassVar[float] = 4.0 * math.pi
    units: ClassVar[dict[str, tuple[str, float]]] = FOUR_STROKE_UNITS


@dataclass(frozen=True, kw_only=True)
class TwoStrokeCycle(_ClosedCycle):
    """Parameters of a modelled two-stroke cycle, in SI units and radians.

    The closed part is that of `FourStrokeCycle`. The exhaust opens first, and the pressure relaxes
    to the exhaust's; from the opening of the scavenge ports on, over `valve_ramp`, to that of the
    scavenge air (`intake_pressure`). Ports open and close symmetrically about bottom dead centre;
    an exhaust valve (uniflow scavenging) may close at another angle. Where the exhaust closes
    last, the pressure goes back to the exhaust's before.

    Attributes
    ----------
    exhaust_opening, scavenge_opening : float
        Exhaust and scavenge begin to open [rad, in the expansion stroke].
    exhaust_closing : float
        Exhaust fully closed [rad, in the compression stroke]; NaN, the default: -exhaust_opening.
    """

    exhaust_opening: float
    scavenge_opening: float
    exhaust_closing: float = math.nan

    period: ClassVar[float] = 2.0 * math.pi
    units: ClassVar[dict[str, tuple[str, float]]] = TWO_STROKE_UNITS


class Diagrams(NamedTuple):
    """Tables of a batch of cycles, their shape that of the parameters.

    Attributes
    ----------
    angle : ndarray, shape (K,)
        Crank angle [rad] from -period/2, end excluded.
    pressure, slope : ndarray, shape (..., K)
        Absolute pressure [Pa] and its exact derivative over angle [Pa/rad]: with both, a Diagram
        needs no spline.
    status : ndarray of int64
        Outcome (`engine_dyn.status`): converged; invalid_input, for values that are no cycle or
        gas hotter than 4000 K; not_converged, where the pressure does not repeat. All numbers of
        the last two are NaN.
    trapped_pressure : ndarray
        Pressure when the cylinder has closed [Pa].
    hottest : ndarray
        Highest temperature of the gas in the closed cylinder [K].
    heat, work, wall_loss : ndarray
        Heat released, work of the gas and heat lost while the cylinder is closed, over the swept
        volume [Pa].
    """

    angle: Floats
    pressure: Floats
    slope: Floats
    status: Integers
    trapped_pressure: Floats
    hottest: Floats
    heat: Floats
    work: Floats
    wall_loss: Floats


def table_angles(period: float, step_degrees: float) -> Floats:
    """Crank angles [rad] of a table from -period/2, end excluded.

    Raises
    ------
    ValueError
        If the step does not divide the cycle or is over 10 degrees.
    """
    whole = round(period / DEGREE)
    count = round(whole / step_degrees) if step_degrees > 0.0 else 0
    if count * 10 < whole or not math.isclose(count * step_degrees, whole, rel_tol=1e-12):
        raise ValueError(
            f"step = {step_degrees:g} degree: {whole} must be a multiple of it, at most 10"
        )
    angle: Floats = np.arange(count, dtype=np.float64) * (period / count) - 0.5 * period
    return angle


def tabulate(
    kind: type[FourStrokeCycle] | type[TwoStrokeCycle],
    values: Mapping[str, Any],
    step_degrees: float = 0.5,
) -> Diagrams:
    """Tabulate a batch of cycles.

    Parameters
    ----------
    kind : type
        FourStrokeCycle or TwoStrokeCycle.
    values : mapping
        Its fields in SI units, scalars or arrays that broadcast together; `wall` is one word for
        all. Fields with a default may be missing.
    step_degrees : float
        Step of the table [degree]; the cycle must be a multiple of it.

    Returns
    -------
    Diagrams
        Values that are no cycle make that diagram NaN and its status invalid_input; nothing is
        raised for them. Building `kind` with those values says what is wrong.

    Raises
    ------
    ValueError
        For unknown or missing fields, arrays that do not broadcast, a wall that is not one of
        WALLS, or a step that does not divide the cycle.
    """
    angle = table_angles(kind.period, step_degrees)
    given = dict(values)
    wall = _wall_code(given.pop("wall", "adiabatic"))
    known = {item.name: item.default for item in fields(kind) if item.name != "wall"}
    for name in given:
        if name not in known:
            raise ValueError(f"{name}: no field of {kind.__name__}")
    for name, default in known.items():
        if name not in given:
            if not isinstance(default, float):
                raise ValueError(f"{name}: missing; {kind.__name__} needs it")
            given[name] = default
    wide = np.broadcast_arrays(*(np.asarray(given[name], dtype=np.float64) for name in known))
    shape = wide[0].shape
    columns = {name: array.reshape(-1) for name, array in zip(known, wide, strict=True)}
    bad = np.zeros(columns["heat"].size, dtype=np.bool_)
    with np.errstate(invalid="ignore"):
        for wrong, _ in _refusals(kind, columns, wall):
            bad |= wrong

    count, size = len(angle), bad.size
    outcome = np.where(bad, status.INVALID_INPUT, status.CONVERGED).astype(np.int64)
    pressure, slope = np.full((size, count), np.nan), np.full((size, count), np.nan)
    summary = np.full((size, len(_SUMMARY)), np.nan)
    good = np.flatnonzero(~bad)
    if good.size:
        cases = _cases(kind, columns, wall)
        _integrate(cases, good, kind.period, angle, pressure, slope, summary, outcome)
    rest = {name: summary[:, i].reshape(shape) for i, name in enumerate(_SUMMARY)}
    return Diagrams(
        angle,
        pressure.reshape(*shape, count),
        slope.reshape(*shape, count),
        outcome.reshape(shape),
        **rest,
    )


_SUMMARY = ("trapped_pressure", "hottest", "heat", "work", "wall_loss")


def _wall_code(wall: str) -> int:
    if wall not in WALLS:
        allowed = ", ".join(f"'{word}'" for word in WALLS)
        raise ValueError(f"wall = {wall!r}: must be one of {allowed}")
    return WALLS.index(wall)


def _refusals(kind: type[_ClosedCycle], columns: Mapping[str, Floats], wall: int) -> Iterator[Any]:
    """Find what is no cycle: where (an array), and a function of the place that says it."""
    four = kind is FourStrokeCycle
    ranges = {**_GAS, **_FURTHER, **(_VALVES if four else _PORTS), **_OF_WALL.get(wall, {})}

    def said(name: str, allowed: str) -> Any:
        unit, size = kind.units[name]
        words = "" if unit == "1" else f" {unit}"

        def message(place: int) -> str:
            value = float(columns[name].reshape(-1)[place])
            if not math.isfinite(value):
                return f"{name} = {value}: must be a finite number"
            return f"{name} = {value / size:.6g}{words}: must be {allowed}"

        return message

    for name, (unit, low, high, ends) in ranges.items():
        size, words = _SIZE[unit], "" if unit == "1" else f" {unit}"
        value = columns[name]
        within = (value >= low * size) & (value <= high * size)
        if not ends:
            within &= (value != low * size) & (value != high * size)
        if name == "exhaust_closing":
            within |= np.isnan(value)
        yield ~within, said(name, f"between {low:.6g} and {high:.6g}{words}")

    closing, opening = _closing(kind, columns), columns["exhaust_opening"]
    starts = [columns["combustion_start"]]
    starts.append(np.where(columns["premixed_share"] > 0.0, columns["premixed_start"], starts[0]))
    last = "intake_closing" if four else "scavenge_opening"
    if not four:
        yield (
            columns["scavenge_opening"] <= opening,
            said("scavenge_opening", "after exhaust_opening"),
        )
        last = "exhaust_opening"
    else:
        for name, source in (
            ("intake_loss", "intake_pressure"),
            ("exhaust_loss", "exhaust_pressure"),
        ):
            yield columns[name] > 0.5 * columns[source], said(name, f"at most half of {source}")
    for name, start in zip(("combustion_start", "premixed_start"), starts, strict=True):
        yield start <= closing, said(name, f"after the cylinder has closed ({last})")
        yield start >= opening, said(name, "before exhaust_opening")
    ramp = columns["valve_ramp"]
    room = kind.period + closing - opening
    yield 2.0 * ramp > room, said("valve_ramp", "at most half the time for which the cylinder is open")


def _closing(kind: type[_ClosedCycle], columns: Mapping[str, Floats]) -> Floats:
    """Angle [rad] at which the cylinder has closed."""
    if kind is FourStrokeCycle:
        return columns["intake_closing"]
    exhaust = columns["exhaust_closing"]
    exhaust = np.where(np.isnan(exhaust), -columns["exhaust_opening"], exhaust)
    return np.asarray(np.maximum(exhaust, -columns["scavenge_opening"]))


class _Case(NamedTuple):
    """One cycle as the kernel sees it: SI units, heats over the swept volume."""

    two_stroke: float
    wall: float
    clearance: float
    crank_ratio: float
    intake_pressure: float
    exhaust_pressure: float
    intake_loss: float
    exhaust_loss: float
    charge_temperature: float
    charge_gamma: float
    gamma_slope: float
    heat: float
    wiebe_factor: float
    share: float
    start: float
    duration: float
    form: float
    second_start: float
    second_duration: float
    second_form: float
    compression_exponent: float
    expansion_exponent: float
    wall_temperature: float
    wall_scale: float
    wall_ends: float
    wall_liner: float
    piston_wind: float
    closing: float
    opening: float
    ramp: float
    lag: float
    scavenge: float
    returns: float


def _cases(kind: type[_ClosedCycle], columns: Mapping[str, Floats], wall: int) -> Floats:
    """Rows of `_Case`."""
    four = kind is FourStrokeCycle
    size = columns["heat"].size
    zero, one = np.zeros(size), np.ones(size)
    warmer = columns["charge_temperature"] - REFERENCE
    bore, stroke, speed = (columns[n] for n in ("bore", "stroke", "speed"))
    closing = _closing(kind, columns)
    scavenge = zero if four else columns["scavenge_opening"]
    with np.errstate(invalid="ignore", divide="ignore"):
        case = _Case(
            two_stroke=zero if four else one,
            wall=wall * one,
            clearance=1.0 / (columns["compression_ratio"] - 1.0),
            crank_ratio=columns["crank_ratio"],
            intake_pressure=columns["intake_pressure"],
            exhaust_pressure=columns["exhaust_pressure"],
            intake_loss=columns["intake_loss"] if four else zero,
            exhaust_loss=columns["exhaust_loss"] if four else zero,
            charge_temperature=columns["charge_temperature"],
            charge_gamma=columns["gamma_300"] - columns["gamma_slope"] * warmer,
            gamma_slope=columns["gamma_slope"],
            heat=columns["heat"],
            wiebe_factor=columns["wiebe_factor"],
            share=1.0 - columns["premixed_share"],
            start=columns["combustion_start"],
            duration=columns["combustion_duration"],
            form=columns["combustion_form"],
            second_start=columns["premixed_start"],
            second_duration=columns["premixed_duration"],
            second_form=columns["premixed_form"],
            compression_exponent=columns["compression_exponent"],
            expansion_exponent=columns["expansion_exponent"],
            wall_temperature=columns["wall_temperature"],
            wall_scale=columns["wall_factor"] * WOSCHNI_FACTOR * bore**-0.2 / speed,
            wall_ends=2.0 / stroke,
            wall_liner=4.0 / bore,
            piston_wind=WOSCHNI_PISTON * stroke * speed / math.pi,
            closing=closing,
            opening=columns["exhaust_opening"],
            ramp=columns["valve_ramp"],
            lag=columns["valve_lag"],
            scavenge=scavenge,
            returns=(closing > -scavenge).astype(np.float64),
        )
    return np.stack(case, axis=-1)


# The kernel's functions hand numbers over, not arrays: counting references would take half the time.
Place = tuple[float, float, float, float]
"""What depends on angle alone: volume, its derivative, and two numbers more."""
Blown = tuple[float, float, float]
"""Exponent, gamma - 1 and heat loss at the end of the closed part."""


@inlined
def smooth_step(u: float) -> float:
    """Rise from 0 at u = 0 to 1 at u = 1 with two derivatives zero at both ends."""
    if u <= 0.0:
        return 0.0
    if u >= 1.0:
        return 1.0
    return u * u * u * (10.0 + u * (6.0 * u - 15.0))


@inlined
def geometry(sine: float, cosine: float, case: _Case) -> tuple[float, float]:
    """Volume over the swept volume and its derivative over angle; the one place that knows it."""
    ratio = case.crank_ratio
    volume = case.clearance + 0.5 * position_at(sine, cosine, ratio)
    return volume, 0.5 * velocity_at(sine, cosine, ratio)


@inlined
def turned(sine: float, cosine: float, s: float, c: float) -> tuple[float, float]:
    """Sine and cosine of a sum of angles: sines are dear."""
    return sine * c + cosine * s, cosine * c - sine * s


@inlined
def wiebe(phi: float, start: float, duration: float, form: float, factor: float) -> float:
    """Burnt fraction, Heywood eq. 9.30."""
    time = (phi - start) / duration
    if time <= 0.0:
        return 0.0
    return -math.expm1(-factor * min(time, BURNT_OUT) ** (form + 1.0))


@inlined
def wiebe_rate(phi: float, start: float, duration: float, form: float, factor: float) -> float:
    """Return the derivative of the burnt fraction over angle."""
    time = (phi - start) / duration
    if time <= 0.0 or time >= BURNT_OUT:
        return 0.0
    power = time**form
    return factor * (form + 1.0) / duration * power * math.exp(-factor * power * time)


@inlined
def burnt(phi: float, case: _Case) -> float:
    """Part of the heat released."""
    total = 0.0
    if case.share > 0.0:
        total = case.share * wiebe(phi, case.start, case.duration, case.form, case.wiebe_factor)
    if case.share < 1.0:
        total += (1.0 - case.share) * wiebe(
            phi, case.second_start, case.second_duration, case.second_form, case.wiebe_factor
        )
    return total


@inlined
def burning(phi: float, case: _Case) -> float:
    """Return the derivative of `burnt` over angle."""
    total = 0.0
    if case.share > 0.0:
        total = case.share * wiebe_rate(
            phi, case.start, case.duration, case.form, case.wiebe_factor
        )
    if case.share < 1.0:
        total += (1.0 - case.share) * wiebe_rate(
            phi, case.second_start, case.second_duration, case.second_form, case.wiebe_factor
        )
    return total


@inlined
def exponent(phi: float, case: _Case) -> float:
    """Polytropic exponent of an unfired charge."""
    change = case.expansion_exponent - case.compression_exponent
    turned = smooth_step(0.5 * (phi / EXPONENT_REACH + 1.0))
    return case.compression_exponent + change * turned


@inlined
def state(
    energy: float, mass: float, volume: float, case: _Case
) -> tuple[float, float, float]:
    """Temperature, pressure and gamma - 1 of the closed gas.

    u/R = -ln(G/G_1)/s with G = gamma - 1 = G_1 - s (T - T_1), solved for T; `energy` is that above
    the trapped charge's, `mass` is m R over the swept volume [Pa/K].
    """
    first = case.charge_gamma - 1.0
    drop = -case.gamma_slope * energy / mass
    # expm1(x)/x, which is 1 + x/2 where x is lost beside one.
    rise = 1.0 + 0.5 * drop if abs(drop) < 1e-9 else math.expm1(drop) / drop
    warmer = first * energy / mass * rise
    temperature = case.charge_temperature + warmer
    return temperature, mass * temperature / volume, first - case.gamma_slope * warmer


@inlined
def woschni(
    pressure: float, temperature: float, above: float, volume: float, case: _Case
) -> float:
    """Heat that the walls take per angle, over the swept volume [Pa].

    `above` is (p - p_m)/(m R) [K]: T_r/(p_r V_r) of any state of the closed gas is 1/(m R).
    """
    wind = case.piston_wind + WOSCHNI_COMBUSTION * max(above, 0.0)
    transfer = math.exp(0.8 * math.log(pressure * wind) - 0.55 * math.log(temperature))
    area = case.wall_ends + case.wall_liner * volume
    return case.wall_scale * area * transfer * (temperature - case.wall_temperature)


@inlined
def closed_place(phi: float, sine: float, cosine: float, case: _Case) -> Place:
    """Volume, its derivative, burnt fraction and exponent at an angle."""
    volume, growth = geometry(sine, cosine, case)
    fraction = burnt(phi, case) if case.heat > 0.0 else 0.0
    power = exponent(phi, case) if case.wall == POLYTROPIC else 0.0
    return volume, growth, fraction, power


@inlined
def closed_rates(
    energy: float, motored: float, mass: float, two: bool, place: Place, case: _Case
) -> tuple[float, float, float, float, float]:
    """Rates of energy, of the motored engine's energy and of work; temperature and heat loss.

    `energy` is the internal energy less the heat released so far, which so needs no rate.
    """
    volume, growth, fraction, power = place
    temperature, pressure, gamma_less = state(energy + case.heat * fraction, mass, volume, case)
    work = pressure * growth
    loss, motored_rate = 0.0, 0.0
    if case.wall == POLYTROPIC:
        loss = work * ((power - 1.0) / gamma_less - 1.0)
    elif case.wall == WOSCHNI:
        above = 0.0
        if two:
            cooler, lower, _ = state(motored, mass, volume, case)
            above = (pressure - lower) / mass
            motored_rate = -lower * growth - woschni(lower, cooler, 0.0, volume, case)
        loss = woschni(pressure, temperature, above, volume, case)
    return -work - loss, motored_rate, work, temperature, loss


@inlined
def weighted(h: float, k1: float, k3: float, k4: float, k5: float, k6: float, k7: float) -> float:
    """Change over a step of Butcher's method; its second stage has no weight."""
    return h / 120.0 * (11.0 * (k1 + k7) + 81.0 * (k3 + k4) - 32.0 * (k5 + k6))


@inlined
def closed_step(
    phi: float, h: float, e: float, m: float, mass: float, two: bool, case: _Case
) -> tuple[float, float, float]:
    """Energy and motored energy after one step, and its work.

    Butcher's seven stages lie at 0, 1/3, 2/3, 1/3, 1/2, 1/2 and 1 of the step.
    """
    s0, c0 = math.sin(phi), math.cos(phi)
    s6, c6 = math.sin(h / 6.0), math.cos(h / 6.0)
    s3, c3 = turned(s6, c6, s6, c6)
    start = closed_place(phi, s0, c0, case)
    s, c = turned(s0, c0, s3, c3)
    third = closed_place(phi + h / 3.0, s, c, case)
    s, c = turned(s, c, s6, c6)
    half = closed_place(phi + 0.5 * h, s, c, case)
    s, c = turned(s, c, s6, c6)
    later = closed_place(phi + 2.0 * h / 3.0, s, c, case)
    s, c = turned(s, c, s3, c3)
    end = closed_place(phi + h, s, c, case)

    e1, m1, w1, _, _ = closed_rates(e, m, mass, two, start, case)
    g = h / 3.0
    e2, m2, _, _, _ = closed_rates(e + g * e1, m + g * m1, mass, two, third, case)
    g = 2.0 * h / 3.0
    e3, m3, w3, _, _ = closed_rates(e + g * e2, m + g * m2, mass, two, later, case)
    g = h / 12.0
    e4, m4, w4, _, _ = closed_rates(
        e + g * (e1 + 4.0 * e2 - e3), m + g * (m1 + 4.0 * m2 - m3), mass, two, third, case
    )
    g = h / 16.0
    e5, m5, w5, _, _ = closed_rates(
        e + g * (18.0 * e2 - e1 - 3.0 * e3 - 6.0 * e4),
        m + g * (18.0 * m2 - m1 - 3.0 * m3 - 6.0 * m4),
        mass, two, half, case,
    )  # fmt: skip
    g = h / 8.0
    e6, m6, w6, _, _ = closed_rates(
        e + g * (9.0 * e2 - 3.0 * e3 - 6.0 * e4 + 4.0 * e5),
        m + g * (9.0 * m2 - 3.0 * m3 - 6.0 * m4 + 4.0 * m5),
        mass, two, half, case,
    )  # fmt: skip
    g = h / 44.0
    e7, m7, w7, _, _ = closed_rates(
        e + g * (9.0 * e1 - 36.0 * e2 + 63.0 * e3 + 72.0 * e4 - 64.0 * e6),
        m + g * (9.0 * m1 - 36.0 * m2 + 63.0 * m3 + 72.0 * m4 - 64.0 * m6),
        mass, two, end, case,
    )  # fmt: skip
    return (
        e + weighted(h, e1, e3, e4, e5, e6, e7),
        m + weighted(h, m1, m3, m4, m5, m6, m7),
        weighted(h, w1, w3, w4, w5, w6, w7),
    )


@inlined
def manifold(phi: float, growth: float, case: _Case) -> float:
    """Pressure to which an open cylinder relaxes."""
    if case.two_stroke > 0.0:
        share = smooth_step((phi - case.scavenge) / case.ramp)
        if case.returns > 0.0:
            share *= smooth_step((2.0 * math.pi - case.scavenge - phi) / case.ramp)
        return case.exhaust_pressure + (case.intake_pressure - case.exhaust_pressure) * share
    share = smooth_step(0.5 * ((phi - 2.0 * math.pi) / case.ramp + 1.0))
    square = 4.0 * growth * growth
    intake = case.intake_pressure - case.intake_loss * square
    exhaust = case.exhaust_pressure + case.exhaust_loss * square
    return exhaust + (intake - exhaust) * share


@inlined
def open_place(phi: float, sine: float, cosine: float, period: float, case: _Case) -> Place:
    """Volume, its derivative, how open the cylinder is, and to what pressure, at an angle."""
    volume, growth = geometry(sine, cosine, case)
    opened = smooth_step((phi - case.opening) / case.ramp)
    opened *= smooth_step((case.closing + period - phi) / case.ramp)
    outside = manifold(phi, growth, case) if opened > 0.0 else 0.0
    return volume, growth, opened, outside


@inlined
def gas_rate(
    phi: float,
    pressure: float,
    after: bool,
    volume: float,
    growth: float,
    blown: Blown,
    case: _Case,
) -> float:
    """Derivative of the pressure by the gas inside, its exponent as at the closed part's end."""
    heat = 0.0
    if after:
        power, gamma_less, loss = blown
        heat = gamma_less * (case.heat * burning(phi, case) - loss)
    elif case.wall == POLYTROPIC:
        power = case.compression_exponent
    else:
        power = case.charge_gamma
        if case.wall == WOSCHNI:
            loss = woschni(pressure, case.charge_temperature, 0.0, volume, case)
            heat = (1.0 - power) * loss
    return (heat - power * pressure * growth) / volume


@inlined
def open_rate(
    phi: float, pressure: float, after: bool, place: Place, blown: Blown, case: _Case
) -> float:
    """Derivative of the pressure while the cylinder is open.

    `after` the exhaust's opening, not before the closing.
    """
    volume, growth, opened, outside = place
    rate = 0.0
    if opened > 0.0:
        rate = opened * (outside - pressure) / case.lag
    if opened == 1.0:
        return rate
    return rate + (1.0 - opened) * gas_rate(phi, pressure, after, volume, growth, blown, case)


@inlined
def open_step(
    phi: float, h: float, p: float, period: float, after: bool, blown: Blown, case: _Case
) -> float:
    """Pressure after one step, as in `closed_step`."""
    s0, c0 = math.sin(phi), math.cos(phi)
    s6, c6 = math.sin(h / 6.0), math.cos(h / 6.0)
    s3, c3 = turned(s6, c6, s6, c6)
    to_third, to_half, to_later, to_end = phi + h / 3.0, phi + 0.5 * h, phi + h / 1.5, phi + h
    start = open_place(phi, s0, c0, period, case)
    s, c = turned(s0, c0, s3, c3)
    third = open_place(to_third, s, c, period, case)
    s, c = turned(s, c, s6, c6)
    half = open_place(to_half, s, c, period, case)
    s, c = turned(s, c, s6, c6)
    later = open_place(to_later, s, c, period, case)
    s, c = turned(s, c, s3, c3)
    end = open_place(to_end, s, c, period, case)

    k1 = open_rate(phi, p, after, start, blown, case)
    k2 = open_rate(to_third, p + h / 3.0 * k1, after, third, blown, case)
    k3 = open_rate(to_later, p + h / 1.5 * k2, after, later, blown, case)
    q = p + h / 12.0 * (k1 + 4.0 * k2 - k3)
    k4 = open_rate(to_third, q, after, third, blown, case)
    q = p + h / 16.0 * (18.0 * k2 - k1 - 3.0 * k3 - 6.0 * k4)
    k5 = open_rate(to_half, q, after, half, blown, case)
    q = p + h / 8.0 * (9.0 * k2 - 3.0 * k3 - 6.0 * k4 + 4.0 * k5)
    k6 = open_rate(to_half, q, after, half, blown, case)
    q = p + h / 44.0 * (9.0 * k1 - 36.0 * k2 + 63.0 * k3 + 72.0 * k4 - 64.0 * k6)
    k7 = open_rate(to_end, q, after, end, blown, case)
    return p + weighted(h, k1, k3, k4, k5, k6, k7)


@inlined
def next_break(phi: float, breaks: Floats, count: int) -> float:
    """First break after an angle."""
    found = math.inf
    for i in range(count):
        if breaks[i] > phi + 1e-9 and breaks[i] < found:
            found = breaks[i]
    return found


@inlined
def add_start(start: float, h: float, breaks: Floats, count: int) -> int:
    """Add the start of a combustion and the small first steps after it."""
    breaks[count] = start
    for i in range(DOUBLINGS):
        breaks[count + 1 + i] = start + h * 0.5 ** (DOUBLINGS - i)
    return count + 1 + DOUBLINGS


@inlined
def closed_breaks(case: _Case, width: float, breaks: Floats) -> int:
    """Angles at which the equation of the closed part is not smooth; how many."""
    breaks[0], breaks[1] = -EXPONENT_REACH, EXPONENT_REACH
    count = 2
    if case.heat > 0.0 and case.share > 0.0:
        count = add_start(case.start, width, breaks, count)
    if case.heat > 0.0 and case.share < 1.0:
        count = add_start(case.second_start, width, breaks, count)
    return count


@inlined
def open_breaks(case: _Case, period: float, breaks: Floats) -> int:
    """Angles at which the equation of the open part is not smooth; how many."""
    end = case.closing + period
    breaks[0], breaks[1] = case.opening + case.ramp, end - case.ramp
    breaks[2] = 0.5 * (case.opening + end)
    if case.two_stroke == 0.0:
        breaks[3], breaks[4] = 2.0 * math.pi - case.ramp, 2.0 * math.pi + case.ramp
        return 5
    breaks[3], breaks[4] = case.scavenge, case.scavenge + case.ramp
    breaks[5] = 2.0 * math.pi - case.scavenge
    breaks[6] = breaks[5] - case.ramp
    return 7


@inlined
def closed_part(
    trapped: float,
    width: float,
    start: float,
    angle: Floats,
    step: float,
    case: _Case,
    pressure: Floats,
    slope: Floats,
    summary: Floats,
    breaks: Floats,
) -> tuple[float, Blown]:
    """Follow the closed cylinder, from its `trapped` pressure to that when the exhaust opens."""
    count, opening = angle.size, case.opening
    breaking = closed_breaks(case, width, breaks)
    phi = case.closing
    volume, _ = geometry(math.sin(phi), math.cos(phi), case)
    mass = trapped * volume / case.charge_temperature
    energy, motored, work = 0.0, 0.0, 0.0
    hottest = case.charge_temperature
    following = int(math.ceil((phi - angle[0]) / step - 1e-9))
    while True:
        mark = angle[0] + following * step
        # From the start of combustion on, Woschni's motored engine is followed beside.
        two = phi >= start - 1e-12
        if mark <= phi + 1e-12 or phi >= opening - 1e-12:
            place = closed_place(phi, math.sin(phi), math.cos(phi), case)
            volume, growth, fraction, _ = place
            rate, _, _, temperature, loss = closed_rates(energy, motored, mass, two, place, case)
            hottest = max(hottest, temperature)
            warmer = temperature - case.charge_temperature
            gamma_less = case.charge_gamma - 1.0 - case.gamma_slope * warmer
            p = mass * temperature / volume
            if phi >= opening - 1e-12:
                break
            gain = gamma_less * (rate + case.heat * burning(phi, case))
            pressure[following % count] = p
            slope[following % count] = (gain - p * growth) / volume
            following += 1
            continue
        target = min(min(next_break(phi, breaks, breaking), opening), mark)
        steps = int(math.ceil((target - phi) / width - 1e-9))
        h = (target - phi) / steps
        for i in range(steps):
            energy, motored, gained = closed_step(
                phi + i * h, h, energy, motored, mass, two, case
            )
            work += gained
            if not two:
                motored = energy
        phi = target
    summary[0], summary[1] = trapped, hottest
    summary[2] = case.heat * fraction
    summary[3], summary[4] = work, -energy - work
    if case.wall == POLYTROPIC:
        return p, (case.expansion_exponent, gamma_less, 0.0)
    return p, (gamma_less + 1.0, gamma_less, loss)


@inlined
def open_part(
    phi: float,
    p: float,
    width: float,
    angle: Floats,
    step: float,
    period: float,
    case: _Case,
    pressure: Floats,
    slope: Floats,
    blown: Blown,
    breaks: Floats,
) -> float:
    """Follow the open cylinder from an angle on; its pressure when it has closed."""
    count, end = angle.size, case.closing + period
    middle = 0.5 * (case.opening + end)
    breaking = open_breaks(case, period, breaks)
    following = int(math.ceil((phi - angle[0]) / step - 1e-9))
    while phi < end - 1e-12:
        mark = angle[0] + following * step
        after = phi < middle - 1e-12
        if mark <= phi + 1e-12:
            place = open_place(phi, math.sin(phi), math.cos(phi), period, case)
            pressure[following % count] = p
            slope[following % count] = open_rate(phi, p, after, place, blown, case)
            following += 1
            continue
        target = min(min(next_break(phi, breaks, breaking), end), mark)
        steps = int(math.ceil((target - phi) / width - 1e-9))
        h = (target - phi) / steps
        for i in range(steps):
            p = open_step(phi + i * h, h, p, period, after, blown, case)
        phi = target
    return p


@inlined
def follow(
    case: _Case,
    period: float,
    angle: Floats,
    pressure: Floats,
    slope: Floats,
    summary: Floats,
    breaks: Floats,
) -> int:
    """Follow a cycle until it repeats; its outcome."""
    step = period / angle.size
    closed_width, start = LARGEST_STEP, math.inf
    if case.heat > 0.0 and case.share > 0.0:
        closed_width = min(closed_width, case.duration / STEPS_OF_COMBUSTION)
        start = case.start
    if case.heat > 0.0 and case.share < 1.0:
        closed_width = min(closed_width, case.second_duration / STEPS_OF_COMBUSTION)
        start = min(start, case.second_start)
    if case.wall != WOSCHNI:
        start = math.inf
    open_width = min(LARGEST_STEP, case.lag / STEPS_OF_LAG, case.ramp / STEPS_OF_RAMP)

    # Half an open part, from the manifold's pressure, begins near the first cycle's pressure.
    middle = 0.5 * (case.opening + case.closing + period)
    _, growth = geometry(math.sin(middle), math.cos(middle), case)
    p = open_part(
        middle, manifold(middle, growth, case), open_width, angle, step, period, case, pressure,
        slope, (case.charge_gamma, 0.0, 0.0), breaks,
    )  # fmt: skip
    for _ in range(MOST_PASSES):
        trapped = p
        p, blown = closed_part(
            trapped, closed_width, start, angle, step, case, pressure, slope, summary, breaks
        )
        if case.gamma_slope > 0.0 and summary[1] > HOTTEST:
            return status.INVALID_INPUT
        p = open_part(
            case.opening, p, open_width, angle, step, period, case, pressure, slope, blown, breaks,
        )  # fmt: skip
        if abs(p - trapped) <= REPEATS * trapped:
            return status.CONVERGED
    return status.NOT_CONVERGED


@inlined
def _case_of(r: Floats) -> _Case:
    return _Case(
        r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8],
        r[9], r[10], r[11], r[12], r[13], r[14], r[15], r[16], r[17],
        r[18], r[19], r[20], r[21], r[22], r[23], r[24], r[25], r[26],
        r[27], r[28], r[29], r[30], r[31], r[32],
    )  # fmt: skip


@kernel
def _integrate(
    cases: Floats,
    rows: Integers,
    period: float,
    angle: Floats,
    pressures: Floats,
    slopes: Floats,
    summary: Floats,
    outcome: Integers,
) -> None:
    """Fill in the rows `rows` of the tables."""
    breaks = np.zeros(32)
    for index in range(rows.size):
        row = rows[index]
        outcome[row] = follow(
            _case_of(cases[row]), period, angle, pressures[row], slopes[row], summary[row], breaks
        )
        if outcome[row] != status.CONVERGED:
            pressures[row, :] = math.nan
            slopes[row, :] = math.nan
            summary[row, :] = math.nan
