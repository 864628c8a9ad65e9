"""Firing patterns over several cycles, against torque and energy added up here."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pytest

from engine_dyn import diagram_from_points, periodic_speed
from engine_dyn.forces.harmonics import gas_part, of_engine
from engine_dyn.geometry.cylinders import Cylinders, even_cylinders
from engine_dyn.geometry.firing_sequence import SEALED
from engine_dyn.pressure.motored import motored, pressures_of_rows
from engine_dyn.speed.keywords import family_of
from engine_dyn.speed.torque import mean_gas_torque
from oracle import solution

CYCLE = 4.0 * math.pi
BORE, STROKE, RATIO, INERTIA, SPEED = 0.1, 0.12, 0.28, 2.5, 150.0

Curve = npt.NDArray[np.float64]


def wrapped(angle: Curve, period: float) -> Curve:
    return angle - period * np.floor(angle / period + 0.5)


def volume(angle: Curve) -> Curve:
    """Of the cylinder over its clearance: compression ratio 16."""
    return np.asarray(1.0 + 7.5 * solution.position(angle, RATIO))


def fired(angle: Curve) -> Curve:
    """A made-up diagram: polytropic, a smooth rise, gas exchange at 1.1 and 0.95 bar."""
    inside = wrapped(angle, CYCLE)
    closed = 1e5 * (16.0 / volume(inside)) ** 1.32
    burnt = 1.0 + 1.9 / (1.0 + np.exp(-(inside - 0.12) / 0.06))
    share = 1.0 / (1.0 + np.exp(-(np.abs(inside + 0.35) - 2.9) / 0.12))
    return closed * burnt * (1.0 - share) + share * np.where(inside > 0.0, 1.1e5, 0.95e5)


KNOTS = np.radians(np.arange(-360.0, 360.0, 0.5))
DIAGRAM = diagram_from_points(KNOTS, fired(KNOTS))
SILENT = motored(DIAGRAM)


def gas_torque(pattern: Sequence[float], firing: Sequence[float], cycles: int, phi: Curve) -> Curve:
    """Torque of an engine that fires at these angles; the pattern goes through them in sequence."""
    order = np.argsort(firing)
    total = np.zeros(phi.size)
    for n in range(cycles):
        for place, cylinder in enumerate(order):
            factor = pattern[(n * len(firing) + place) % len(pattern)]
            angle = wrapped(phi - firing[cylinder] - n * CYCLE, cycles * CYCLE)
            here = (angle >= -0.5 * CYCLE) & (angle < 0.5 * CYCLE)
            one = angle[here]
            if factor == SEALED:
                pressure = SILENT(-np.abs(wrapped(one, 2.0 * math.pi)))
            else:
                pressure = SILENT(one) + factor * (DIAGRAM(one) - SILENT(one))
            total[here] += (pressure - 101325.0) * solution.velocity(one, RATIO)
    return 0.25 * math.pi * BORE**2 * 0.5 * STROKE * total


def swing_of(torque: Curve, step: float) -> float:
    """Range of the work against a constant load, by Simpson's rule over pairs of steps [J]."""
    net = torque - torque.mean()
    net = np.append(net, net[0])
    work = np.cumsum((net[:-2:2] + 4.0 * net[1:-1:2] + net[2::2]) * step / 3.0)
    return float(work.max() - work.min())


FOUR = (0.0, 3.0 * math.pi, math.pi, 2.0 * math.pi)
UNEVEN = (0.0, 1.5 * math.pi)


@pytest.mark.parametrize(
    ("pattern", "firing", "cycles", "allowed"),
    [
        ((1.0, 1.0, 0.0), FOUR, 3, 1e-6),
        ((1.0, 0.0), (0.0,), 2, 1e-6),
        ((1.0, 0.0, 1.0, 1.0, 0.0), FOUR, 5, 1e-6),
        ((1.0, 0.9, 1.06, 0.7, 1.2, 0.0), UNEVEN, 3, 1e-6),
        # A pressure that jumps at a dead centre is a kink of the torque.
        ((1.0, 1.0, SEALED), FOUR, 3, 1e-4),
    ],
)
def test_energy_and_mean_torque(
    pattern: tuple[float, ...], firing: tuple[float, ...], cycles: int, allowed: float
) -> None:
    step = math.radians(0.0125)  # extremes between the points are then missed by 1e-7
    phi = np.arange(round(cycles * 720 / 0.0125)) * step
    torque = gas_torque(pattern, firing, cycles, phi)
    found = periodic_speed(
        DIAGRAM, bore=BORE, stroke=STROKE, crank_ratio=RATIO, reciprocating_mass=0.0,
        inertia=INERTIA, speed=SPEED, cylinders=len(firing), firing_angles=firing,
        firing_pattern=pattern, load_exponent=0.0,
    )  # fmt: skip
    assert found.torque_mean == pytest.approx(torque.mean(), rel=max(allowed, 1e-5))
    stored = 0.5 * INERTIA * (found.omega_max**2 - found.omega_min**2)
    assert stored == pytest.approx(swing_of(torque, step), rel=allowed)


@pytest.mark.compiled
def test_the_general_solver_agrees() -> None:
    given = {
        "bore": BORE, "stroke": STROKE, "crank_ratio": RATIO, "reciprocating_mass": 0.8,
        "inertia": INERTIA, "speed": SPEED, "cylinders": 4, "load_exponent": 2.6,
        "inertia_model": "variable",
    }  # fmt: skip
    for pattern in ([1, 1, 0, 1, 0], [1, SEALED, 1], [1.1, 0.9, 1.0, 1.05, 0.95, 1.0, 1.02]):
        batch = periodic_speed(DIAGRAM, **given, firing_pattern=pattern)
        general = periodic_speed(DIAGRAM, **given, firing_pattern=pattern, method="newton")
        assert batch.delta == pytest.approx(general.delta, rel=1e-7)


@pytest.mark.parametrize(
    "pattern", [(1.0, 1.0, 0.0), (1.0, 0.6, SEALED), (1.0, 0.0, 1.0, 1.0, 0.0)]
)
def test_orders_are_those_of_the_torque(pattern: tuple[float, ...]) -> None:
    """The harmonics in closed form against the discrete Fourier transform of the curve."""
    cylinders = even_cylinders(4, CYCLE).with_pattern(pattern)
    orders = np.arange(1, 24 * cylinders.cycles + 1) / (2.0 * cylinders.cycles)
    part = gas_part(0.0, family_of(DIAGRAM), CYCLE)
    found = of_engine(part, orders, RATIO, 0.0, 4, {4: cylinders})
    samples = round(cylinders.cycles * 720 / 0.05)
    phi = np.arange(samples) * cylinders.period / samples
    curve = gas_torque(pattern, FOUR, cylinders.cycles, phi)
    wanted = 2.0 * np.fft.rfft(curve)[1 : orders.size + 1] / samples
    lever = 0.25 * math.pi * BORE**2 * 0.5 * STROKE
    # Of the pressure without that of the air, whose torque has whole orders alone.
    air = 2.0 * np.fft.rfft(gas_of_air(cylinders, phi))[1 : orders.size + 1] / samples
    allowed = 1e-3 if SEALED in pattern else 1e-6
    assert np.abs(lever * found + air - wanted).max() < allowed * np.abs(wanted).max()


def gas_of_air(cylinders: Cylinders, phi: Curve) -> Curve:
    lever = 0.25 * math.pi * BORE**2 * 0.5 * STROKE
    return (
        -101325.0 * lever * sum(solution.velocity(phi + m.phase, RATIO) for m in cylinders.members)
    )


def test_valves_that_stay_shut_do_no_work() -> None:
    family, angle = family_of(DIAGRAM), np.radians(np.arange(-360.0, 360.0, 1.0))
    (sealed,) = pressures_of_rows(family, np.array([0]), angle, SEALED)
    assert sealed[1:] == pytest.approx(sealed[:0:-1], rel=1e-9)
    assert sealed[360] == pytest.approx(sealed[0], rel=1e-9)  # both dead centres
    assert sealed.max() == pytest.approx(float(SILENT(np.zeros(1))[0]), rel=1e-6)
    work = mean_gas_torque(RATIO, 0.0, family, 0.0, SEALED)
    assert abs(float(work)) < 1e-4 * float(mean_gas_torque(RATIO, 0.0, family))


def test_symmetry_counts_firings() -> None:
    """Equal cylinders that fire evenly repeat after the pattern, not after whole cycles."""
    for length in range(1, 13):
        pattern = [1.0] + [0.0] * (length - 1)
        found = even_cylinders(6, CYCLE).with_pattern(pattern)
        assert found.period / found.symmetry == pytest.approx(CYCLE / 6 * length)
        assert found.cycles == length // math.gcd(length, 6)
        burnt = found.all_pressure_factors.mean()
        assert burnt == pytest.approx(1.0 / length)


@pytest.mark.parametrize(
    ("pattern", "message"),
    [
        ([], "firing_pattern: empty; must have at least one firing"),
        ([1.0, 4.5], "firing_pattern, firing 2 = 4.5: must be a number from 0 .* to 4"),
        (
            [1.0] * 65 + [0.0] * 2,
            "67 firings of 4 cylinders repeat after 67 cycles; must be at most 64",
        ),
    ],
)
def test_refused(pattern: list[float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        even_cylinders(4, CYCLE).with_pattern(pattern)
