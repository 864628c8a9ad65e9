"""Modelled cycles by the first law: an independent integration, closed forms, energy, the batch."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from engine_dyn import status
from engine_dyn.first_law import (
    FOUR_STROKE_UNITS,
    TWO_STROKE_UNITS,
    FourStrokeCycle,
    TwoStrokeCycle,
    tabulate,
)
from engine_dyn.indicator import TWO_STROKE, Diagram, diagram_from_points

DEGREE = np.pi / 180.0
BAR = 1e5

# A throttled spark-ignition engine, a turbocharged diesel, a slow uniflow two-stroke.
SPARK: dict[str, Any] = {
    "compression_ratio": 10.0, "crank_ratio": 0.28, "intake_pressure": 0.7,
    "exhaust_pressure": 1.05, "charge_temperature": 340.0, "heat": 14.0,
    "combustion_start": -18.0, "combustion_duration": 55.0, "combustion_form": 2.0,
    "valve_ramp": 40.0, "valve_lag": 8.0, "intake_loss": 0.06, "exhaust_loss": 0.05,
    "intake_closing": -125.0, "exhaust_opening": 130.0,
}  # fmt: skip
DIESEL: dict[str, Any] = {
    **SPARK, "compression_ratio": 17.0, "intake_pressure": 1.9, "exhaust_pressure": 1.7,
    "charge_temperature": 370.0, "heat": 25.0, "combustion_start": -4.0,
    "combustion_duration": 75.0, "combustion_form": 1.2, "premixed_share": 0.12,
    "premixed_start": -6.0, "premixed_duration": 9.0, "premixed_form": 2.0,
}  # fmt: skip
PORTS: dict[str, Any] = {
    "compression_ratio": 14.0, "crank_ratio": 0.45, "intake_pressure": 3.0,
    "exhaust_pressure": 2.6, "charge_temperature": 350.0, "heat": 24.0, "combustion_start": -2.0,
    "combustion_duration": 60.0, "combustion_form": 1.0, "valve_ramp": 20.0, "valve_lag": 5.0,
    "exhaust_opening": 110.0, "scavenge_opening": 135.0,
}  # fmt: skip
WALL: dict[str, dict[str, Any]] = {
    "adiabatic": {},
    "polytropic": {
        "wall": "polytropic", "compression_exponent": 1.34, "expansion_exponent": 1.28,
    },
    "woschni": {
        "wall": "woschni", "wall_temperature": 440.0, "bore": 0.1, "stroke": 0.12, "speed": 1800.0,
    },
}  # fmt: skip

CASES = {
    "spark, adiabatic": (FourStrokeCycle, SPARK, "adiabatic"),
    "spark, woschni": (FourStrokeCycle, SPARK, "woschni"),
    "diesel, polytropic": (FourStrokeCycle, DIESEL, "polytropic"),
    "diesel, woschni": (FourStrokeCycle, DIESEL, "woschni"),
    "motored, woschni": (FourStrokeCycle, {**DIESEL, "heat": 0.0}, "woschni"),
    "ports, woschni": (TwoStrokeCycle, PORTS, "woschni"),
    "uniflow, polytropic": (TwoStrokeCycle, {**PORTS, "exhaust_closing": -140.0}, "polytropic"),
}


def built(kind: Any, values: dict[str, Any], **changes: Any) -> Any:
    """A cycle from values in file units."""
    units = FOUR_STROKE_UNITS if kind is FourStrokeCycle else TWO_STROKE_UNITS
    given = {**values, **changes}
    return kind(**{n: v if n == "wall" else v * units[n][1] for n, v in given.items()})


def case(name: str, **changes: Any) -> Any:
    kind, values, wall = CASES[name]
    return built(kind, {**values, **WALL[wall]}, **changes)


def smooth_step(u: float) -> float:
    t = min(max(u, 0.0), 1.0)
    return t**3 * (10.0 + t * (6.0 * t - 15.0))


class Equation:
    """The model written from its description: pressure as unknown, rates of heat, own kinematics."""

    def __init__(self, m: Any) -> None:
        self.m = m
        self.four = isinstance(m, FourStrokeCycle)
        if self.four:
            self.closing = m.intake_closing
        else:
            exhaust = -m.exhaust_opening if np.isnan(m.exhaust_closing) else m.exhaust_closing
            self.closing = max(exhaust, -m.scavenge_opening)
            self.exhaust_last = exhaust > -m.scavenge_opening
        self.end = self.closing + m.period

    def geometry(self, phi: float) -> tuple[float, float]:
        lam = self.m.crank_ratio
        root = np.sqrt(1.0 - (lam * np.sin(phi)) ** 2)
        travel = 0.5 * (1.0 - np.cos(phi) + (1.0 - root) / lam)
        slope = 0.5 * (np.sin(phi) + lam * np.sin(phi) * np.cos(phi) / root)
        return 1.0 / (self.m.compression_ratio - 1.0) + travel, slope

    def heat_rate(self, phi: float) -> float:
        m, total = self.m, 0.0
        for share, start, duration, form in (
            (1.0 - m.premixed_share, m.combustion_start, m.combustion_duration, m.combustion_form),
            (m.premixed_share, m.premixed_start, m.premixed_duration, m.premixed_form),
        ):
            t = max(phi - start, 0.0) / duration
            power = m.wiebe_factor * t ** (form + 1.0)
            total += share * m.wiebe_factor * (form + 1.0) / duration * t**form * np.exp(-power)
        return m.heat * total

    def woschni(self, p: float, temperature: float, volume: float, motored: float) -> float:
        """Heat loss [Pa per rad of swept volume], all in the units of the formula."""
        m = self.m
        swept = 0.25 * np.pi * m.bore**2 * m.stroke
        wind = 2.28 * 2.0 * m.stroke * m.speed / (2.0 * np.pi)
        if p > motored:
            # T_r/(p_r V_r) at the closing, in m3: swept volume over V_r is 1/v_r.
            first = self.trapped * self.geometry(self.closing)[0]
            wind += 3.24e-3 * m.charge_temperature / first * (p - motored)
        h = m.wall_factor * 3.26 * m.bore**-0.2 * (p / 1e3) ** 0.8 * temperature**-0.55 * wind**0.8
        area = 0.5 * np.pi * m.bore**2 + 4.0 * volume * swept / m.bore
        return h * area * (temperature - m.wall_temperature) / m.speed / swept

    def closed(self, phi: float, y: Any) -> Any:
        """Pressure, motored pressure, heat lost, work."""
        m = self.m
        volume, growth = self.geometry(phi)
        rates = []
        losses = []
        mass = self.trapped * self.geometry(self.closing)[0] / m.charge_temperature
        for p, heat, other in ((y[0], self.heat_rate(phi), y[1]), (y[1], 0.0, y[1])):
            temperature = p * volume / mass
            gamma = m.gamma_300 - m.gamma_slope * (temperature - 300.0)
            loss = 0.0
            if m.wall == "woschni":
                loss = self.woschni(p, temperature, volume, other)
            elif m.wall == "polytropic":
                n = m.compression_exponent + (m.expansion_exponent - m.compression_exponent) * (
                    smooth_step(0.5 * (phi / (30.0 * DEGREE) + 1.0))
                )
                # What keeps p v^n: dQ = (gamma - n)/(gamma - 1) p dv.
                loss = -(gamma - n) / (gamma - 1.0) * p * growth
            rates.append((-gamma * p * growth + (gamma - 1.0) * (heat - loss)) / volume)
            losses.append(loss)
        return [*rates, losses[0], y[0] * growth]

    def manifold(self, phi: float) -> float:
        m = self.m
        if self.four:
            square = (2.0 * self.geometry(phi)[1]) ** 2
            share = smooth_step(0.5 * ((phi - 2.0 * np.pi) / m.valve_ramp + 1.0))
            before = m.exhaust_pressure + m.exhaust_loss * square
            return before * (1.0 - share) + (m.intake_pressure - m.intake_loss * square) * share
        share = smooth_step((phi - m.scavenge_opening) / m.valve_ramp)
        if self.exhaust_last:
            share *= smooth_step((2.0 * np.pi - m.scavenge_opening - phi) / m.valve_ramp)
        return m.exhaust_pressure * (1.0 - share) + m.intake_pressure * share

    def opened(self, phi: float, y: Any) -> Any:
        m, p = self.m, y[0]
        volume, growth = self.geometry(phi)
        share = smooth_step((phi - m.exhaust_opening) / m.valve_ramp)
        share *= smooth_step((self.end - phi) / m.valve_ramp)
        if phi < 0.5 * (m.exhaust_opening + self.end):
            gamma, loss = self.blown
            power = m.expansion_exponent if m.wall == "polytropic" else gamma
            gas = -power * p * growth + (gamma - 1.0) * (self.heat_rate(phi) - loss)
        else:
            gamma = m.gamma_300 - m.gamma_slope * (m.charge_temperature - 300.0)
            power = m.compression_exponent if m.wall == "polytropic" else gamma
            gas = -power * p * growth
            if m.wall == "woschni":
                gas -= (gamma - 1.0) * self.woschni(p, m.charge_temperature, volume, p)
        return [(1.0 - share) * gas / volume + share * (self.manifold(phi) - p) / m.valve_lag]

    def part(self, function: Any, start: float, end: float, y: Any, breaks: Any, marks: Any) -> Any:
        """Integrate between the corners of the equation; values at marks, and at the end."""
        edges = [start, *sorted(b for b in set(breaks) if start < b < end), end]
        found, places = [], []
        for low, high in zip(edges, edges[1:], strict=False):
            here = marks[(marks >= low) & (marks < high)]
            run = solve_ivp(
                function, (low, high), y, method="DOP853", rtol=3e-13, atol=1e-7,
                max_step=1.0 * DEGREE, t_eval=np.append(here, high),
            )  # fmt: skip
            assert run.success
            y = run.y[:, -1]
            found.append(run.y[:, :-1])
            places.append(here)
        return np.concatenate(places), np.concatenate(found, axis=1), y

    def cycle(self, trapped: float, marks: Any) -> Any:
        """One cycle from a trapped pressure: marks, pressures, closed part's end, last pressure."""
        m, self.trapped = self.m, trapped
        starts = [m.combustion_start, m.premixed_start, -30.0 * DEGREE, 30.0 * DEGREE]
        first, p, end = self.part(
            self.closed, self.closing, m.exhaust_opening, [trapped, trapped, 0.0, 0.0], starts, marks
        )
        volume = self.geometry(m.exhaust_opening)[0]
        mass = trapped * self.geometry(self.closing)[0] / m.charge_temperature
        hot = end[0] * volume / mass
        loss = 0.0
        if m.wall == "woschni":
            loss = self.woschni(end[0], hot, volume, end[1])
        self.blown = (m.gamma_300 - m.gamma_slope * (hot - 300.0), loss)
        turns = [m.exhaust_opening + m.valve_ramp, self.end - m.valve_ramp]
        turns.append(0.5 * (m.exhaust_opening + self.end))
        if self.four:
            turns += [2.0 * np.pi - m.valve_ramp, 2.0 * np.pi + m.valve_ramp]
        else:
            turns += [m.scavenge_opening, m.scavenge_opening + m.valve_ramp]
            turns += [2.0 * np.pi - m.scavenge_opening - x for x in (0.0, m.valve_ramp)]
        second, q, last = self.part(
            self.opened, m.exhaust_opening, self.end, [end[0]], turns, marks
        )
        return np.append(first, second), np.append(p[0], q[0]), end, float(last[0])


@pytest.mark.parametrize("name", CASES)
def test_against_a_general_integrator(name: str) -> None:
    model = case(name)
    step = 3.0
    angle, pressure = model.points(step)
    values = {f.name: getattr(model, f.name) for f in dataclasses.fields(model)}
    found = tabulate(type(model), values, step)
    equation = Equation(model)
    marks = np.sort(np.concatenate([angle, angle + model.period]))
    places, expected, end, last = equation.cycle(float(found.trapped_pressure), marks)
    index = np.rint((places - angle[0]) / (step * DEGREE)).astype(int) % len(angle)
    assert sorted(index) == list(range(len(angle)))
    np.testing.assert_allclose(pressure[index], expected, rtol=0.0, atol=1e-9 * pressure.max())
    # Periodic: the pressure at which the cylinder closes is that at which it began.
    assert last == pytest.approx(float(found.trapped_pressure), rel=1e-9)
    assert float(found.wall_loss) == pytest.approx(end[2], rel=1e-8, abs=1e-9 * 1e5)
    assert float(found.work) == pytest.approx(end[3], rel=1e-9)
