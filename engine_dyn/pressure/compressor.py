"""Modelled reciprocating compressors and pumps: the diagram of a cycle a turn, driven from outside.

Compressor: compression and re-expansion of the clearance are polytropes; between them the pressure
relaxes to that of the suction or delivery line and the loss in its valve. Valves begin to open
where the ideal cycle reaches the pressure of their line, take an angle to do it, so that the
pressure overshoots as it does with real plates, and have closed at dead centre.

Pump: a liquid is not compressed, so there are two levels a turn. The cylinder has the pressure of
the suction line from top to bottom dead centre and that of the delivery line back to the top, less
and more what is lost in the open valve. From a dead centre on, over an angle in which the valves
change and the liquid gives way, the pressure goes from one level to the other, with two continuous
derivatives.

Every transition is smooth, so that a cubic spline through points at 0.5 degree follows the curve.

Sources
-------
Ideal cycle with clearance, its work and volumetric efficiency: Eastop and McConkey, Applied
Thermodynamics for Engineering Technologists, Longman, chapter on positive displacement machines.
Valves as in `cycle`. Pump, derived here: without losses and with valves that change at once, the
work of a turn is the difference of the levels times the swept volume.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from engine_dyn import status
from engine_dyn.compilation import inlined, kernel
from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.arrangement import TWO_STROKE
from engine_dyn.geometry.slider_crank import position_at, sum_of_angles, velocity_at
from engine_dyn.given_numbers import given_array, given_number
from engine_dyn.pressure.diagram import Diagram, never_burns, table_angles
from engine_dyn.pressure.file_fields import FileField, documented
from engine_dyn.pressure.first_law_formulas import smooth_step
from engine_dyn.types import Floats, Integers
from engine_dyn.units import BAR, DEGREE

LARGEST_STEP = 0.5 * DEGREE
STEPS_OF_LAG = 6.0
STEPS_OF_RAMP = 12.0
MOST_PASSES = 60

FILE_FIELDS: dict[str, FileField] = {
    "clearance_ratio": FileField("1", 0.0, 0.5),
    "crank_ratio": FileField("1", 0.0, 1.0),
    "suction_pressure": FileField("bar", 0.0, 200.0),
    "delivery_pressure": FileField("bar", 0.0, 400.0),
    "suction_loss": FileField("bar", 0.0, 50.0, ends=True),
    "delivery_loss": FileField("bar", 0.0, 50.0, ends=True),
    "compression_exponent": FileField("1", 1.0, 5.0 / 3.0, ends=True),
    "expansion_exponent": FileField("1", 1.0, 5.0 / 3.0, ends=True),
    "valve_ramp": FileField("degree", 1.0, 45.0),
    "valve_lag": FileField("degree", 0.25, 20.0),
}
"""Fields of the compressor's cycle in engine files."""


@documented("compressor", FILE_FIELDS)
@dataclass(frozen=True, kw_only=True)
class CompressorCycle:
    """Parameters of the compressor's cycle, in SI units and radians; 0 is top dead centre.

    The pressure p(phi) solves

        p' = c (-n p V'/V) - (1 - c) (p - p_m) / valve_lag,

    where c is 1 while both valves are closed and 0 while one is open, with a smooth ramp between;
    n is `compression_exponent` from the closing of the suction valve on and `expansion_exponent`
    from that of the delivery valve on; p_m is suction_pressure - suction_loss v^2 or
    delivery_pressure + delivery_loss v^2, v being the piston's velocity over the crank pin's.
    """

    clearance_ratio: float  # Clearance volume over swept volume [1]
    crank_ratio: float  # Crank radius over rod length [1]
    # Absolute pressures of the suction and delivery lines at the valves [Pa].
    suction_pressure: float
    delivery_pressure: float
    # Pressure difference across an open valve while the piston is as fast as the crank pin [Pa].
    suction_loss: float
    delivery_loss: float
    # Polytropic exponents of compression and expansion [1].
    compression_exponent: float
    expansion_exponent: float
    valve_ramp: float  # Crank angle over which a valve opens or closes [rad]
    # Crank angle in which, with an open valve, the difference between the pressures of cylinder and
    # line falls to 1/e [rad].
    valve_lag: float

    def __post_init__(self) -> None:
        """Refuse values that are no cycle; ValueError names field, value and what is allowed."""
        columns = {name: given_array(name, value) for name, value in self._values().items()}
        for bad, message in refusals(columns):
            if bad.any():
                raise ValueError(message)

    def volume(self, phi: ArrayLike) -> Floats:
        """Cylinder volume over the swept volume [1] at crank angles [rad]."""
        travel = slider_crank.position(phi, self.crank_ratio)
        return np.asarray(self.clearance_ratio + 0.5 * travel, dtype=np.float64)

    def points(self, step_degrees: float = 0.5) -> tuple[Floats, Floats]:
        """Tabulate the cycle.

        Parameters
        ----------
        step_degrees : float
            Step of the table [degree]; 360 must be a multiple of it. 0.5 by default.

        Returns
        -------
        angle, pressure : ndarray
            Crank angle [rad] from -pi, end excluded, and absolute pressure [Pa].

        Raises
        ------
        ValueError
            If the step does not divide the cycle or is over 10 degrees.
        """
        table = tabulate(self._values(), step_degrees)
        return table.angle, table.pressure

    def diagram(self, step_degrees: float = 0.5) -> Diagram:
        """Indicator diagram with the exact slopes at its points.

        Its peak lies before dead centre, where `diagram_from_points` would take it for a mistake.
        """
        table = tabulate(self._values(), step_degrees)
        return Diagram(table.angle, table.pressure, table.slope, TWO_STROKE, never_burns)

    def _values(self) -> dict[str, float]:
        return {name: getattr(self, name) for name in FILE_FIELDS}


class CompressorDiagrams(NamedTuple):
    """Tables of a batch of compressors, their shape that of the parameters."""

    angle: Floats  # Crank angle [rad] from -pi, end excluded; shape (K,)
    # Absolute pressure [Pa] and its exact derivative over angle [Pa/rad]; shape (..., K)
    pressure: Floats
    slope: Floats
    # Outcome (`engine_dyn.status`): converged; invalid_input for values that give no cycle, whose
    # numbers are NaN.
    status: Integers


def tabulate(
    values: Mapping[str, ArrayLike], step_degrees: float = 0.5, crank_end: bool = False
) -> CompressorDiagrams:
    """Tabulate a batch of compressors.

    Parameters
    ----------
    values : mapping
        Fields of CompressorCycle in SI units, scalars or arrays that broadcast together.
    step_degrees : float
        Step of the table [degree]; 360 must be a multiple of it.
    crank_end : bool
        Whether the gas is on the piston's side towards the crank; angle 0 is then the bottom dead
        centre. There 2 - x(phi + pi) is the travel x(phi) with the crank ratio negated.

    Raises
    ------
    ValueError
        For unknown or missing fields, arrays that do not broadcast or a step that does not divide
        the cycle.
    """
    angle = table_angles(TWO_STROKE, step_degrees)
    for name in {*values, *FILE_FIELDS}:
        if name not in FILE_FIELDS:
            raise ValueError(f"{name}: CompressorCycle has no such field")
        if name not in values:
            raise ValueError(f"{name}: missing; CompressorCycle needs it")
    given = (np.asarray(values[name], dtype=np.float64) for name in FILE_FIELDS)
    wide = np.broadcast_arrays(*given)
    shape = wide[0].shape
    columns = {name: array.reshape(-1) for name, array in zip(FILE_FIELDS, wide, strict=True)}
    bad = np.zeros(columns["valve_lag"].size, dtype=np.bool_)
    for wrong, _ in refusals(columns, crank_end):
        bad |= wrong
    size, count = bad.size, len(angle)
    outcome = np.where(bad, status.INVALID_INPUT, status.CONVERGED).astype(np.int64)
    pressure, slope = np.full((size, count), np.nan), np.full((size, count), np.nan)
    good = np.flatnonzero(~bad)
    if good.size:
        columns = _of_end(columns, crank_end)
        suction, delivery = _openings(columns)
        cases = np.stack([*columns.values(), suction, delivery], axis=-1)
        _integrate(cases, good, angle, pressure, slope, outcome)
    return CompressorDiagrams(
        angle, pressure.reshape(*shape, count), slope.reshape(*shape, count), outcome.reshape(shape)
    )


def _of_end(columns: dict[str, Floats], crank_end: bool) -> dict[str, Floats]:
    """Fields for one end: at the crank end, formulas take a negative crank ratio."""
    return {**columns, "crank_ratio": -columns["crank_ratio"]} if crank_end else columns


def _openings(columns: Mapping[str, Floats]) -> tuple[Floats, Floats]:
    """Angles at which the valves begin to open, 0 to pi and pi to 2 pi; NaN for never."""
    clearance = columns["clearance_ratio"]
    pressure_ratio = columns["delivery_pressure"] / columns["suction_pressure"]
    expanded = clearance * pressure_ratio ** (1.0 / columns["expansion_exponent"])
    compressed = (1.0 + clearance) * pressure_ratio ** (-1.0 / columns["compression_exponent"])
    suction = _angle_of(2.0 * (expanded - clearance), columns["crank_ratio"])
    delivery = 2.0 * math.pi - _angle_of(2.0 * (compressed - clearance), columns["crank_ratio"])
    return suction, delivery


def _angle_of(travel: Floats, crank_ratio: Floats) -> Floats:
    """Crank angle [rad, 0..pi] of a travel x/r, by the law of cosines in crank, rod and axis."""
    distance = 1.0 + 1.0 / crank_ratio - travel
    cosine = (1.0 + distance**2 - crank_ratio**-2.0) / (2.0 * distance)
    return np.asarray(np.arccos(np.where((travel >= 0.0) & (travel <= 2.0), cosine, np.nan)))


def refusals(
    columns: dict[str, Floats], crank_end: bool = False
) -> Iterator[tuple[NDArray[np.bool_], str]]:
    """Find what is no cycle: where, and the line that says it of the first; see `tabulate`."""

    def said(name: str, bad: NDArray[np.bool_], allowed: str) -> str:
        if not bad.any():
            return ""
        value = float(columns[name][bad].flat[0])
        if not math.isfinite(value):
            return f"{name} = {value}: must be a finite number"
        field = FILE_FIELDS[name]
        return f"{name} = {value / field.size:.6g}{field.words}: must be {allowed}"

    for name, item in FILE_FIELDS.items():
        low, high, ends, size = item.low, item.high, item.ends, item.size
        value = columns[name]
        within = (value >= low * size) & (value <= high * size)
        if not ends:
            within &= (value != low * size) & (value != high * size)
        yield ~within, said(name, ~within, item.allowed)
    bad = ~(columns["delivery_pressure"] > columns["suction_pressure"])
    yield bad, said("delivery_pressure", bad, "above suction_pressure")
    bad = columns["suction_loss"] > 0.5 * columns["suction_pressure"]
    yield bad, said("suction_loss", bad, "at most half of suction_pressure")
    with np.errstate(all="ignore"):
        suction, delivery = _openings(_of_end(columns, crank_end))
        both = 2.0 * columns["valve_ramp"]
        bad = ~(suction + both <= math.pi)
        allowed = "lower: gas re-expanding from the clearance volume leaves no suction"
        yield bad, said("delivery_pressure", bad, allowed)
        bad = ~(delivery + both <= 2.0 * math.pi)
        yield bad, said("delivery_pressure", bad, "lower: it is reached too late for any delivery")


class Case(NamedTuple):
    """One compressor as the kernel sees it: the fields in their order, and the openings."""

    clearance: float
    crank_ratio: float
    suction_pressure: float
    delivery_pressure: float
    suction_loss: float
    delivery_loss: float
    compression_exponent: float
    expansion_exponent: float
    ramp: float
    lag: float
    suction: float
    delivery: float


@inlined
def coefficients(phi: float, sine: float, cosine: float, case: Case) -> tuple[float, float]:
    """Coefficients of p' = source - decay p at an angle from 0 to 2 pi."""
    volume = case.clearance + 0.5 * position_at(sine, cosine, case.crank_ratio)
    speed = velocity_at(sine, cosine, case.crank_ratio)
    # The exponent changes while a valve is wide open, where it has no effect.
    if phi < math.pi:
        opened = smooth_step((phi - case.suction) / case.ramp)
        opened *= smooth_step((math.pi - phi) / case.ramp)
        line = case.suction_pressure - case.suction_loss * speed * speed
        first = phi < 0.5 * (case.suction + math.pi)
    else:
        opened = smooth_step((phi - case.delivery) / case.ramp)
        opened *= smooth_step((2.0 * math.pi - phi) / case.ramp)
        line = case.delivery_pressure + case.delivery_loss * speed * speed
        first = phi > 0.5 * (case.delivery + 2.0 * math.pi)
    power = case.expansion_exponent if first else case.compression_exponent
    decay = (1.0 - opened) * power * 0.5 * speed / volume + opened / case.lag
    return opened * line / case.lag, decay


@inlined
def butcher_change(
    h: float, k1: float, k3: float, k4: float, k5: float, k6: float, k7: float
) -> float:
    """Change over a step of Butcher's method; its second stage has no weight."""
    return h / 120.0 * (11.0 * (k1 + k7) + 81.0 * (k3 + k4) - 32.0 * (k5 + k6))


@inlined
def advance(phi: float, h: float, p: float, case: Case) -> float:
    """Pressure after one step of Butcher's method of order six, of seven stages.

    They lie at 0, 1/3, 2/3, 1/3, 1/2, 1/2 and 1 of the step (Butcher, The Numerical Analysis of
    Ordinary Differential Equations, Wiley 1987).
    """
    s0, c0 = math.sin(phi), math.cos(phi)
    s6, c6 = math.sin(h / 6.0), math.cos(h / 6.0)
    s3, c3 = sum_of_angles(s6, c6, s6, c6)
    a0, b0 = coefficients(phi, s0, c0, case)
    s, c = sum_of_angles(s0, c0, s3, c3)
    a1, b1 = coefficients(phi + h / 3.0, s, c, case)
    s, c = sum_of_angles(s, c, s6, c6)
    a2, b2 = coefficients(phi + 0.5 * h, s, c, case)
    s, c = sum_of_angles(s, c, s6, c6)
    a3, b3 = coefficients(phi + h / 1.5, s, c, case)
    s, c = sum_of_angles(s, c, s3, c3)
    a4, b4 = coefficients(phi + h, s, c, case)
    k1 = a0 - b0 * p
    k2 = a1 - b1 * (p + h / 3.0 * k1)
    k3 = a3 - b3 * (p + h / 1.5 * k2)
    k4 = a1 - b1 * (p + h / 12.0 * (k1 + 4.0 * k2 - k3))
    k5 = a2 - b2 * (p + h / 16.0 * (18.0 * k2 - k1 - 3.0 * k3 - 6.0 * k4))
    k6 = a2 - b2 * (p + h / 8.0 * (9.0 * k2 - 3.0 * k3 - 6.0 * k4 + 4.0 * k5))
    k7 = a4 - b4 * (p + h / 44.0 * (9.0 * k1 - 36.0 * k2 + 63.0 * k3 + 72.0 * k4 - 64.0 * k6))
    return p + butcher_change(h, k1, k3, k4, k5, k6, k7)


@inlined
def follow(case: Case, angle: Floats, pressure: Floats, slope: Floats, breaks: Floats) -> int:
    """Follow a cycle from top dead centre until it repeats; its outcome."""
    count = angle.size
    step = 2.0 * math.pi / count
    width = min(min(LARGEST_STEP, case.lag / STEPS_OF_LAG), case.ramp / STEPS_OF_RAMP)
    breaks[0], breaks[1], breaks[2] = case.suction, case.suction + case.ramp, math.pi - case.ramp
    breaks[3], breaks[4], breaks[5] = math.pi, case.delivery, case.delivery + case.ramp
    breaks[6], breaks[7] = 2.0 * math.pi - case.ramp, 2.0 * math.pi
    p = case.delivery_pressure
    for _ in range(MOST_PASSES):
        begin, phi = p, 0.0
        following = int(math.ceil(-angle[0] / step - 1e-9))
        edge = 0
        while edge < breaks.size:
            mark = angle[0] + following * step
            if mark <= phi + 1e-12:
                source, decay = coefficients(phi, math.sin(phi), math.cos(phi), case)
                pressure[following % count] = p
                slope[following % count] = source - decay * p
                following += 1
                continue
            if breaks[edge] <= phi + 1e-12:
                edge += 1
                continue
            target = min(breaks[edge], mark)
            steps = int(math.ceil((target - phi) / width - 1e-9))
            h = (target - phi) / steps
            for i in range(steps):
                p = advance(phi + i * h, h, p, case)
            phi = target
        if abs(p - begin) <= 1e-12 * begin:
            return status.CONVERGED
    return status.NOT_CONVERGED


@kernel
def _integrate(
    cases: Floats, rows: Integers, angle: Floats, pressure: Floats, slope: Floats, outcome: Integers
) -> None:
    """Integrate the cycles of some rows and write them into the tables."""
    breaks = np.zeros(8)
    for index in range(rows.size):
        row = rows[index]
        r = cases[row]
        case = Case(r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8], r[9], r[10], r[11])
        outcome[row] = follow(case, angle, pressure[row], slope[row], breaks)
        if outcome[row] != status.CONVERGED:
            pressure[row, :] = slope[row, :] = math.nan


PUMP_FIELDS: dict[str, FileField] = {
    "crank_ratio": FileField("1", 0.0, 1.0),
    "suction_pressure": FileField("bar", 0.0, 200.0),
    "delivery_pressure": FileField("bar", 0.0, 4000.0),
    "suction_loss": FileField("bar", 0.0, 50.0, ends=True),
    "delivery_loss": FileField("bar", 0.0, 50.0, ends=True),
    "valve_ramp": FileField("degree", 3.0, 90.0),
    "offset_ratio": FileField("1", -10.0, 10.0),
}
"""Fields of the pump's cycle in engine files."""


@documented("pump", PUMP_FIELDS)
@dataclass(frozen=True, kw_only=True)
class PumpCycle:
    """Parameters of the pump's cycle, in SI units and radians; 0 is top dead centre.

    With w going from 1 to 0 in `valve_ramp` after top dead centre and back after the bottom one,

        p = w (p_d + c_d v^2) + (1 - w) (p_s - c_s v^2),

    v being the piston's velocity over the crank pin's.
    """

    crank_ratio: float  # Crank radius over rod length [1]
    # Absolute pressures of the suction and delivery lines at the valves [Pa].
    suction_pressure: float
    delivery_pressure: float
    valve_ramp: float  # Crank angle over which the pressure changes after a dead centre [rad]
    # Pressure difference across an open valve while the piston is as fast as the crank pin [Pa];
    # none by default.
    suction_loss: float = 0.0
    delivery_loss: float = 0.0
    # Offset of the piston pin's line over the crank radius [1]; 0 by default.
    offset_ratio: float = 0.0

    def __post_init__(self) -> None:
        """Refuse values that are no cycle; ValueError names field, value and what is allowed."""
        for item in fields(self):
            field = PUMP_FIELDS[item.name]
            low, high = field.low, field.high
            value = given_number(item.name, getattr(self, item.name)) / field.size
            if not math.isfinite(value):
                raise ValueError(f"{item.name} = {value}: must be a finite number")
            if not (low <= value <= high if field.ends else low < value < high):
                raise ValueError(f"{item.name} = {value:.6g}{field.words}: must be {field.allowed}")
        if self.delivery_pressure <= self.suction_pressure:
            raise ValueError(
                f"delivery_pressure = {self.delivery_pressure / BAR:.6g} bar: must be above "
                f"suction_pressure, {self.suction_pressure / BAR:.6g} bar"
            )
        if self.suction_loss > 0.5 * self.suction_pressure:
            raise ValueError(
                f"suction_loss = {self.suction_loss / BAR:.6g} bar: must be at most half of "
                "suction_pressure"
            )
        slider_crank.position(0.0, self.crank_ratio, self.offset_ratio)  # a stuck crank raises

    def pressure_and_slope(self, phi: ArrayLike) -> tuple[Floats, Floats]:
        """Absolute pressure [Pa] and its derivative [Pa/rad] at crank angles [rad]."""
        angle = np.mod(np.asarray(phi, dtype=np.float64), TWO_STROKE)
        geometry = self.crank_ratio, self.offset_ratio
        bottom = float(slider_crank.dead_centres(*geometry).bottom)
        v = slider_crank.velocity(angle, *geometry)
        b = slider_crank.acceleration(angle, *geometry)
        delivering = angle >= bottom
        time = np.clip(np.where(delivering, angle - bottom, angle) / self.valve_ramp, 0.0, 1.0)
        step = time**3 * (10.0 + time * (6.0 * time - 15.0))
        rate = 30.0 * (time * (1.0 - time)) ** 2 / self.valve_ramp
        share = np.where(delivering, step, 1.0 - step)
        above = self.delivery_pressure + self.delivery_loss * v**2
        below = self.suction_pressure - self.suction_loss * v**2
        losses = share * self.delivery_loss - (1.0 - share) * self.suction_loss
        slope = np.where(delivering, rate, -rate) * (above - below) + 2.0 * losses * v * b
        return np.asarray(share * above + (1.0 - share) * below), np.asarray(slope)

    def diagram(self, step_degrees: float = 0.5) -> Diagram:
        """Indicator diagram with the exact slopes at its points.

        Its largest pressure lies before dead centre, where `diagram_from_points` would take it for
        a mistake.

        Raises
        ------
        ValueError
            If the step does not divide the turn or is over 10 degrees.
        """
        angle = table_angles(TWO_STROKE, step_degrees)
        return Diagram(angle, *self.pressure_and_slope(angle), TWO_STROKE, never_burns)
