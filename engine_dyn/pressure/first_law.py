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
temperature (constants as they are usually quoted; the paper itself was not compared). Woschni, SAE
paper 670931, 1967. The numerical method has its sources in
`collocation`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from engine_dyn import status
from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.arrangement import FOUR_STROKE, TWO_STROKE
from engine_dyn.given_numbers import given_array
from engine_dyn.pressure.curves import on_threads
from engine_dyn.pressure.diagram import Diagram, table_angles
from engine_dyn.pressure.file_fields import documented
from engine_dyn.pressure.first_law_formulas import (
    BURNT,
    BURNT_OUT,
    FOUR_STROKE_FIELDS,
    FOUR_STROKE_UNITS,
    HOTTEST,
    TWO_STROKE_FIELDS,
    TWO_STROKE_UNITS,
    WOSCHNI_FACTOR,
    WOSCHNI_PISTON,
    Case,
    closing_angle,
    refusals,
    wall_code,
)
from engine_dyn.pressure.first_law_kernel import integrate, new_memory
from engine_dyn.types import Floats, Integers
from engine_dyn.units import BAR, DEGREE

REFERENCE = 300.0

WIEBE = math.log(1000.0)  # Wiebe's factor for a duration that ends when 99.9 % have burnt


@dataclass(frozen=True, kw_only=True)
class _ClosedCycle:
    """Parameters that four-stroke and two-stroke cycles share."""

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
    offset_ratio: float = 0.0
    premixed_share: float = 0.0
    premixed_start: float = 0.0
    premixed_duration: float = 10.0 * DEGREE
    premixed_form: float = 2.0
    wiebe_factor: float = WIEBE
    # By default gamma = 1.38 - 0.08 (T - 300 K)/1000 K: Gatowski et al. (1984), as usually quoted.
    gamma_300: float = 1.38
    gamma_slope: float = 8e-5
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
        columns = {n: given_array(n, v) for n, v in values.items() if n != "wall"}
        for bad, message in refusals(self.period, columns, wall_code(self.wall)):
            if bad.any():
                raise ValueError(message(0))

    def volume(self, phi: ArrayLike) -> Floats:
        """Cylinder volume over the swept volume [1] at crank angles [rad]."""
        travel = slider_crank.position(phi, self.crank_ratio, self.offset_ratio)
        if self.offset_ratio != 0.0:
            travel = travel / slider_crank.dead_centres(self.crank_ratio, self.offset_ratio).stroke
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
            (self.premixed_share, self.premixed_start, self.premixed_duration, self.premixed_form),
        ):
            time = np.clip((np.asarray(phi) - start) / duration, 0.0, BURNT_OUT)
            total = total - share * np.expm1(-self.wiebe_factor * time ** (form + 1.0))
        return total

    def gamma(self, temperature: ArrayLike) -> Floats:
        """Ratio of specific heats [1] at temperatures [K] (after Gatowski et al. 1984)."""
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
        table = self._table(step_degrees)
        return table.angle, table.pressure

    def diagram(self, step_degrees: float = 0.5) -> Diagram:
        """Indicator diagram with the exact slopes at its points; parameters and errors as `points`.

        Where a combustion starts between two points it follows the curve closer than the spline
        through the points would.
        """
        table = self._table(step_degrees)
        return Diagram(table.angle, table.pressure, table.slope, self.period)

    def _table(self, step_degrees: float) -> Diagrams:
        values: dict[str, Any] = {item.name: getattr(self, item.name) for item in fields(self)}
        table = tabulate(type(self), values, step_degrees)
        if table.status == status.NOT_CONVERGED:
            raise ValueError(
                f"valve_lag = {self.valve_lag / DEGREE:.6g} degree: must be shorter; the cylinder "
                "is not emptied while the valve is open"
            )
        if table.status == status.INVALID_INPUT:
            raise ValueError(
                f"heat = {self.heat / BAR:.6g} bar: must be lower; the gas would become hotter "
                f"than {HOTTEST:g} K"
            )
        return table


@documented("first_law", FOUR_STROKE_FIELDS)
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

    While a valve is open the pressure relaxes to the manifold's exactly as in
    `diesel_cycle.DieselCycle`; on the ramps between, exponent and loss stay as at the end of the
    closed part.

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
    offset_ratio : float
        Offset of the piston pin's line over the crank radius [1]; 0 by default. With it, half the
        stroke is the radius that speeds of the piston are taken over.
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

    period: ClassVar[float] = FOUR_STROKE
    units: ClassVar[dict[str, tuple[str, float]]] = FOUR_STROKE_UNITS


@documented("two_stroke", TWO_STROKE_FIELDS)
@dataclass(frozen=True, kw_only=True)
class TwoStrokeCycle(_ClosedCycle):
    """Parameters of a modelled two-stroke cycle, in SI units and radians.

    The closed part is that of `FourStrokeCycle`. The exhaust opens first, and the pressure relaxes
    to the exhaust's; from the opening of the scavenge ports on, over `valve_ramp`, to that of the
    scavenge air (`intake_pressure`). Ports open and close symmetrically about bottom dead centre;
    an exhaust valve (uniflow scavenging) may close at another angle. Where the exhaust closes
    last, the pressure goes back to the exhaust's before.
    """

    # Angles at which exhaust and scavenge ports begin to open [rad, in the expansion stroke].
    exhaust_opening: float
    scavenge_opening: float
    # Exhaust fully closed [rad, in the compression stroke]; NaN, the default: -exhaust_opening.
    exhaust_closing: float = math.nan

    period: ClassVar[float] = TWO_STROKE
    units: ClassVar[dict[str, tuple[str, float]]] = TWO_STROKE_UNITS


class Diagrams(NamedTuple):
    """Tables of a batch of cycles, their shape that of the parameters."""

    angle: Floats  # Crank angle [rad] from -period/2, end excluded; shape (K,)
    # Absolute pressure [Pa] and its exact derivative over the angle [Pa/rad], so that a Diagram
    # needs no spline; shape (..., K)
    pressure: Floats
    slope: Floats
    # Outcome (`engine_dyn.status`): converged; invalid_input, for values that give no cycle or gas
    # hotter than 4000 K; not_converged, where the pressure does not repeat. The numbers of a cycle
    # that is not converged are NaN.
    status: Integers
    trapped_pressure: Floats  # Pressure when the cylinder has just closed [Pa]
    hottest: Floats  # Highest temperature of the gas in the closed cylinder [K]
    # Heat released, work of the gas and heat lost while the cylinder is closed, over the swept
    # volume [Pa].
    heat: Floats
    work: Floats
    wall_loss: Floats


def tabulate(
    kind: type[_ClosedCycle], values: Mapping[str, Any], step_degrees: float = 0.5, threads: int = 1
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
    threads : int
        Largest number of threads; numbers do not depend on it.

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
    wall = wall_code(given.pop("wall", "adiabatic"))
    known = {item.name: item.default for item in fields(kind) if item.name != "wall"}
    for name in given:
        if name not in known:
            raise ValueError(f"{name}: {kind.__name__} has no such field")
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
        for wrong, _ in refusals(kind.period, columns, wall):
            bad |= wrong

    count, size = len(angle), bad.size
    outcome = np.where(bad, status.INVALID_INPUT, status.CONVERGED).astype(np.int64)
    pressure, slope = np.full((size, count), np.nan), np.full((size, count), np.nan)
    summary = np.full((size, len(_SUMMARY)), np.nan)
    good = np.flatnonzero(~bad)
    if good.size:
        from engine_dyn.plain_arrays import plain  # imports Numba, which only kernels need

        cases = _cases(kind, columns, wall)
        angles = plain(angle), plain(np.sin(angle)), plain(np.cos(angle))
        tables = plain(pressure), plain(slope), plain(summary), plain(outcome)

        def work(begin: int, end: int) -> None:
            integrate(
                plain(cases), plain(good[begin:end]), kind.period, *angles, *tables,
                plain(new_memory()),
            )  # fmt: skip

        on_threads(good.size, work, threads)
    rest = {name: summary[:, i].reshape(shape) for i, name in enumerate(_SUMMARY)}
    return Diagrams(
        angle,
        pressure.reshape(*shape, count),
        slope.reshape(*shape, count),
        outcome.reshape(shape),
        **rest,
    )


_SUMMARY = ("trapped_pressure", "hottest", "heat", "work", "wall_loss")


def _end_of_combustion(which: str, columns: Mapping[str, Floats]) -> Floats:
    """Angle at which all of a combustion has burnt."""
    power = 1.0 / (columns[f"{which}_form"] + 1.0)
    durations = np.minimum((BURNT / columns["wiebe_factor"]) ** power, BURNT_OUT)
    return np.asarray(columns[f"{which}_start"] + columns[f"{which}_duration"] * durations)


def _cases(kind: type[_ClosedCycle], columns: Mapping[str, Floats], wall: int) -> Floats:
    """Values of each cycle in the order of the fields of `Case`, a row a cycle."""
    four = kind is FourStrokeCycle
    size = columns["heat"].size
    zero, one = np.zeros(size), np.ones(size)
    warmer = columns["charge_temperature"] - REFERENCE
    bore, stroke, speed = (columns[n] for n in ("bore", "stroke", "speed"))
    closing = closing_angle(kind.period, columns)
    scavenge = zero if four else columns["scavenge_opening"]
    # Rows that are no valid cycle get a crank that turns, so that the other rows are computed.
    ratio, offset = columns["crank_ratio"], columns["offset_ratio"]
    turns = ratio * (1.0 + np.abs(offset)) < 1.0
    crank = np.where(turns, ratio, 0.5), np.where(turns, offset, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        case: dict[str, Floats] = {n: columns[n] for n in Case._fields if n in columns}
        if not four:
            case |= dict(intake_loss=zero, exhaust_loss=zero)
        case |= dict(
            two_stroke=zero if four else one,
            wall=wall * one,
            clearance=1.0 / (columns["compression_ratio"] - 1.0),
            half_stroke=np.asarray(slider_crank.dead_centres(*crank).stroke),
            charge_gamma=columns["gamma_300"] - columns["gamma_slope"] * warmer,
            share=1.0 - columns["premixed_share"],
            start=columns["combustion_start"],
            duration=columns["combustion_duration"],
            form=columns["combustion_form"],
            second_start=columns["premixed_start"],
            second_duration=columns["premixed_duration"],
            second_form=columns["premixed_form"],
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
            end=_end_of_combustion("combustion", columns),
            second_end=_end_of_combustion("premixed", columns),
        )
    return np.stack([case[name] for name in Case._fields], axis=-1)
