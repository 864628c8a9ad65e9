"""Master and articulated rods against a mechanism of points: `tests.support.master_rods`."""

import math
from typing import Any

import numpy as np
import pytest

from engine_dyn.forces import articulated, harmonics, torque
from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.geometry.cylinder_means import engine_inertia_of_cylinders, mean_stroke_ratio
from engine_dyn.geometry.cylinders import cylinders_of
from engine_dyn.geometry.layouts import arrangement_from_text
from engine_dyn.geometry.master_rods import with_rods
from tests.support.master_rods import (
    AREA,
    BORE,
    CASES,
    COUNT,
    CRANKCASE,
    KNUCKLE_MASS,
    MASS,
    OFFSET,
    RADIUS,
    RATIO,
    ROD,
    SPEED,
    STEPS,
    THETA,
    E,
    between,
    dead_centre,
    diagram,
    engine,
    gas_of_points,
    kinetic,
    made,
    over_phi,
    points,
    slope,
    top_of_first,
    train,
)  # fmt: skip

EACH = pytest.mark.parametrize("case", CASES)

# --- motion and masses ---------------------------------------------------------------------------


@EACH
def test_pistons_move_as_points_at_fixed_distances(case: str) -> None:
    cylinders, found = made(case), points(case)
    for k, member in enumerate(cylinders.members):
        angle = THETA + float(member.phase_of(RATIO, E))
        height = over_phi(case, found.heights[k])
        speed = over_phi(case, slope(found.heights[k]))
        rate = over_phi(case, slope(found.heights[k], 2))
        top = dead_centre(found.heights[k], k * math.tau / COUNT)
        highest = between(found.heights[k], np.array([top]))[0]
        x = RADIUS * member.position(angle, RATIO, E)
        assert x == pytest.approx(highest - height, abs=1e-11), k
        assert RADIUS * member.velocity(angle, RATIO, E) == pytest.approx(-speed, abs=1e-10), k
        assert RADIUS * member.acceleration(angle, RATIO, E) == pytest.approx(-rate, abs=1e-9), k


@EACH
def test_strokes_and_dead_centres_are_the_extremes_of_the_heights(case: str) -> None:
    cylinders, found = made(case), points(case)
    first = top_of_first(case)
    for k, member in enumerate(cylinders.members):
        bank = k * math.tau / COUNT
        top, bottom = (dead_centre(found.heights[k], bank + turn) for turn in (0.0, math.pi))
        ends = between(found.heights[k], np.array([top, bottom]))
        assert 2 * RADIUS * member.stroke(RATIO, E) == pytest.approx(-np.diff(ends)[0], abs=1e-12)
        fires = -float(member.phase_of(RATIO, E))
        assert math.remainder(fires - (top - first), math.tau) == pytest.approx(0.0, abs=1e-10)
        assert float(member.bottom(RATIO, E)) == pytest.approx(bottom - top, abs=1e-10)
    strokes = [member.stroke(RATIO, E) for member in cylinders.members]
    own = strokes[0]
    assert mean_stroke_ratio(RATIO, E, COUNT, {COUNT: cylinders}) == pytest.approx(
        np.mean(strokes) / own, rel=1e-14
    )


@EACH
def test_inertia_torque_is_the_rate_of_the_kinetic_energy(case: str) -> None:
    """Lagrange: at constant speed the masses take half the slope of their inertia."""
    expected = -0.5 * SPEED**2 * over_phi(case, slope(kinetic(case)))
    found = torque.inertia_torque(THETA, train(made(case)), MASS, SPEED)
    assert np.abs(found - expected).max() < 1e-9 * np.ptp(expected)
    inertia = torque.reciprocating_inertia(THETA, train(made(case)), MASS)
    assert inertia == pytest.approx(over_phi(case, kinetic(case)), rel=1e-10)
    mean = engine_inertia_of_cylinders(
        MASS, 0.0, 0.0, RADIUS, RATIO, COUNT, E, COUNT, {COUNT: made(case)}
    )
    assert mean == pytest.approx(kinetic(case).mean(), rel=1e-12)
    plain = torque.inertia_torque(
        THETA, train(cylinders_of(arrangement_from_text("radial 9"))), MASS, SPEED
    )
    assert np.ptp(expected) > 2.0 * np.ptp(plain)


@EACH
def test_inertia_force_is_that_of_points(case: str) -> None:
    found = points(case)
    lines = np.exp(1j * np.arange(COUNT) * (math.tau / COUNT))
    moved = MASS * (lines[:, None] * slope(found.heights, 2)).sum(axis=0)
    pin = RADIUS * np.exp(1j * THETA)
    moved = moved + KNUCKLE_MASS * (slope(found.knuckles[1:], 2) + pin).sum(axis=0)
    expected = -(SPEED**2) * (over_phi(case, moved.real) + 1j * over_phi(case, moved.imag))
    motion = RATIO, RADIUS, MASS, SPEED, COUNT, {COUNT: made(case)}, E
    force = articulated.inertia_force(THETA, *motion)
    assert np.abs(force - expected).max() < 1e-9 * np.abs(expected).max()
    second = articulated.inertia_force_of_order(2, THETA, *motion)
    waves = np.fft.fft(expected) / STEPS
    both = waves[2] * np.exp(2j * THETA) + waves[-2] * np.exp(-2j * THETA)
    assert np.abs(second - both).max() < 1e-9 * np.abs(expected).max()


# --- gas -----------------------------------------------------------------------------------------


@EACH
def test_gas_torque_is_the_virtual_work_on_the_pistons(case: str) -> None:
    expected = gas_of_points(case)
    gas = torque.GasPressure(diagram(), 0.0, 1.0, CRANKCASE)
    phi = np.arange(2 * STEPS) * (math.tau / STEPS)
    found = torque.gas_torque(phi, train(made(case)), BORE, gas)
    assert np.abs(found - expected).max() < 1e-6 * np.ptp(expected)


def test_orders_are_those_of_the_curves() -> None:
    by_count, order = {COUNT: engine()}, np.array([0.5, 1.0, 1.5, 2.0, 3.0, 4.5, 9.0])
    phi = np.arange(2880) * (math.pi / 720)
    gas = torque.GasPressure(diagram(), 0.0, 1.0, 0.0)
    for part, curve in (
        (harmonics.gas_part(0.0, diagram(), FOUR_STROKE),
         torque.gas_torque(phi, train(engine()), BORE, gas) / (AREA * RADIUS)),
        (harmonics.INERTIA,
         torque.inertia_torque(phi, train(engine()), MASS, SPEED) / (MASS * (RADIUS * SPEED) ** 2)),
    ):  # fmt: skip
        found = harmonics.of_engine(part, order, RATIO, E, COUNT, by_count)
        assert found == pytest.approx(
            harmonics.of_curve(curve, phi, order), abs=1e-6 * np.ptp(curve)
        )


# --- limits, and what is refused -----------------------------------------------------------------


def test_without_a_knuckle_radius_it_is_the_plain_radial() -> None:
    plain = cylinders_of(arrangement_from_text("radial 9"))
    near = with_rods(plain, 1e-12, 0.3, length=ROD / RADIUS)
    gas = torque.GasPressure(diagram(), 0.0, 1.0, CRANKCASE)
    phi = np.arange(2 * STEPS) * (math.tau / STEPS)
    for curve in (
        lambda one: torque.gas_torque(phi, train(one), BORE, gas),
        lambda one: torque.inertia_torque(phi, train(one), MASS, SPEED),
        lambda one: torque.reciprocating_inertia(phi, train(one), MASS),
    ):
        expected = curve(plain)
        assert np.abs(curve(near) - expected).max() < 1e-7 * np.abs(expected).max()
    assert with_rods(near, 0.0, 0.0).members == plain.members


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0.7, [0.1]), "knuckle_mass: 1 values for 9 cylinders"),
        ((3.0, 0.1), "radius, value 2 = 3: must be from 0 to 2"),
        ((0.7, -0.1), "knuckle_mass, value 2 = -0.1: must be from 0 to 2"),
        (([0.7, 0.0, *[0.7] * 7], 0.1), "radius: must be 0 for one of the cylinders 1, 2, 3"),
        (([0.0, 0.0, *[0.7] * 7], 0.1), "of throw 1, the master"),
    ],
)
def test_rods_that_are_none(arguments: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        with_rods(cylinders_of(arrangement_from_text("radial 9")), *arguments)


@EACH
def test_the_load_of_the_crank_pin_does_the_work_of_the_engine(case: str) -> None:
    """Thrust and load follow from moments and forces, the torque from virtual work."""
    gas = torque.GasPressure(diagram(), 0.0, 1.0, CRANKCASE)
    phi = np.arange(2 * STEPS) * (math.tau / STEPS)
    loads = articulated.master_loads(phi, train(made(case)), BORE, gas, MASS, SPEED, 1.3)
    whole = torque.gas_torque(phi, train(made(case)), BORE, gas)
    whole = whole + torque.inertia_torque(phi, train(made(case)), MASS, SPEED)
    assert np.abs(RADIUS * loads.crank_pin.imag - whole).max() < 1e-9 * np.ptp(whole)


@EACH
def test_loads_are_what_walls_and_gas_leave(case: str) -> None:
    """Momentum and its moment about the crank's axis, of the points with their walls."""
    gas = torque.GasPressure(diagram(), 0.0, 1.0, CRANKCASE)
    phi = THETA
    loads = articulated.master_loads(phi, train(made(case)), BORE, gas, MASS, SPEED, 0.0)
    found, lines = points(case), np.exp(1j * np.arange(COUNT) * (math.tau / COUNT))
    at = phi + top_of_first(case)
    knuckles = np.array([between(k.real, at) + 1j * between(k.imag, at) for k in found.knuckles])
    pins = np.array([(between(h, at) + 1j * OFFSET) for h in found.heights]) * lines[:, None]
    pulled = np.array([
        over_phi(case, slope(k, 2).real) + 1j * over_phi(case, slope(k, 2).imag)
        for k in found.knuckles
    ])  # fmt: skip
    forces, moments = np.zeros(STEPS, dtype=complex), np.zeros(STEPS)
    for k, member in enumerate(made(case).members):
        own = phi + member.phase_of(RATIO, E)
        push = AREA * gas.difference(own, member, train(made(case)))
        push = push + MASS * SPEED**2 * over_phi(case, slope(found.heights[k], 2))
        if k == 0:
            side = loads.wall_thrust
        else:  # the rod pushes along itself
            rod = (knuckles[k] - pins[k]) * np.conj(lines[k])
            side = -push * rod.imag / rod.real
        wall = 1j * side * lines[k] - push * lines[k]
        if k > 0:
            inertia = -KNUCKLE_MASS * SPEED**2 * pulled[k]
            forces += inertia
            moments += (np.conj(knuckles[k]) * inertia).imag
        forces += wall
        moments += (np.conj(pins[k]) * wall).imag
    turn = np.exp(1j * at)
    # A mass that turns with the crank pin has no tangential part, and its pull is not in the load.
    expected = forces * np.conj(turn) - (COUNT - 1) * KNUCKLE_MASS * RADIUS * SPEED**2
    size = np.abs(expected).max()
    assert np.abs(loads.crank_pin - expected).max() < 1e-8 * size
    assert RADIUS * loads.crank_pin.imag == pytest.approx(moments, abs=1e-8 * RADIUS * size)
