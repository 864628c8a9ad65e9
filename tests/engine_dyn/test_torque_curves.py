"""Torque curves: an independent derivation, work over a cycle, the shaft."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from engine_dyn.forces import torque as forces
from engine_dyn.forces.superposition import CrankTrain
from engine_dyn.geometry.arrangement import CUSTOMARY_ORDERS
from engine_dyn.geometry.cylinders import even_cylinders
from engine_dyn.geometry.slider_crank import velocity
from engine_dyn.pressure.family import Family
from oracle import solution
from oracle.solution import Design
from tests.support.held_out import design_of, family_of

CYCLE = 4.0 * np.pi
PHI = np.arange(1440) * (CYCLE / 1440) - 0.5 * CYCLE
COUNTS = (1, 2, 3, 5, 6, 7, 8, 11, 16, 23)


@pytest.fixture(scope="module")
def design() -> Design:
    return design_of("alpha 1, constant, 1 cyl, power_mean")


@pytest.fixture(scope="module")
def family(design: Design) -> Family:
    return family_of(design)


def train_of(design: Design, cylinders: Any) -> CrankTrain:
    return CrankTrain(design.crank_ratio, design.stroke, cylinders, CYCLE)


def gas(design: Design, family: Family, phi: Any, cylinders: Any) -> Any:
    pressure = forces.GasPressure(family, 0.0, 1.0, design.crankcase_pressure)
    return forces.gas_torque(phi, train_of(design, cylinders), design.bore, pressure)


def inertia(design: Design, phi: Any, cylinders: Any) -> Any:
    return forces.inertia_torque(
        phi, train_of(design, cylinders), design.reciprocating_mass, design.omega_n
    )


@pytest.mark.parametrize("count", COUNTS)
def test_torques_of_a_second_derivation(design: Design, family: Family, count: int) -> None:
    engine = replace(design, cylinders=count)
    expected = solution.gas_torque(engine, PHI)
    # The spline through half degrees misses h^4/384 of a fourth derivative.
    np.testing.assert_allclose(
        gas(design, family, PHI, count), expected, atol=2e-7 * np.ptp(expected)
    )
    expected = solution.inertia_torque(engine, PHI)
    one = np.ptp(solution.inertia_torque(design, PHI))
    np.testing.assert_allclose(inertia(design, PHI, count), expected, atol=1e-12 * one)


@pytest.mark.parametrize("count", [1, 4])
def test_actual_torque_is_the_loss_of_kinetic_energy(design: Design, count: int) -> None:
    """For any course of the speed: -d/dphi of m r^2 sum v^2 omega^2/2."""
    moment = design.reciprocating_mass * (0.5 * design.stroke) ** 2

    def speed(phi: Any) -> Any:
        return 120.0 * np.exp(0.2 * np.sin(0.5 * phi) + 0.1 * np.cos(3.0 * phi))

    def energy(phi: Any) -> Any:
        squares = sum(
            velocity(phi - i * CYCLE / count, design.crank_ratio) ** 2 for i in range(count)
        )
        return 0.5 * moment * squares * speed(phi) ** 2

    h = 1e-4
    slope = 8.0 * (energy(PHI + h) - energy(PHI - h)) - energy(PHI + 2 * h) + energy(PHI - 2 * h)
    acceleration = speed(PHI) ** 2 * (0.1 * np.cos(0.5 * PHI) - 0.3 * np.sin(3.0 * PHI))
    found = forces.inertia_torque_actual(
        PHI, train_of(design, count), design.reciprocating_mass, speed(PHI), acceleration
    )
    np.testing.assert_allclose(found, -slope / (12.0 * h), atol=1e-9 * np.ptp(found))


def along_shaft(design: Design, family: Family, counts: Any, friction_torque: Any = 12.0) -> Any:
    by_count = {z: even_cylinders(z, CYCLE) for z in CUSTOMARY_ORDERS}
    return forces.torque_after_throw(
        PHI, train_of(design, counts)._replace(by_count=by_count), design.bore,
        forces.GasPressure(family, 0.0, 1.0, design.crankcase_pressure),
        design.reciprocating_mass, design.omega_n, friction_torque,
    )  # fmt: skip


@pytest.mark.parametrize("count", range(1, 9))
def test_each_throw_adds_its_cylinder(design: Design, family: Family, count: int) -> None:
    """Kakaitsas (2015), section 5.4: T_Z of the last cylinder, T_(Z-1) = T_Z + ..."""
    found = along_shaft(design, family, count)
    assert found.shape == (count, 1440)
    steps = np.vstack([found[:-1] - found[1:], found[-1:]])
    for place, cylinder in enumerate(CUSTOMARY_ORDERS[count]):
        phi = PHI - place * CYCLE / count  # where it fires
        own = gas(design, family, phi, 1) + inertia(design, phi, 1) - 12.0 / count
        np.testing.assert_allclose(steps[cylinder - 1], own, atol=1e-11 * np.ptp(own))


def test_shorter_engines_end_in_nan(design: Design, family: Family) -> None:
    counts = np.array([2, 4, 1]).reshape(3, 1)
    found = along_shaft(design, family, counts, np.array([4.0, 8.0, 2.0]).reshape(3, 1))
    assert found.shape == (3, 4, 1440)
    np.testing.assert_array_equal(
        np.isnan(found).all(axis=-1),
        [[False, False, True, True], [False] * 4, [False, True, True, True]],
    )
    for i, count in enumerate((2, 4, 1)):
        alone = along_shaft(design, family, count, 2.0 * count)
        np.testing.assert_array_equal(found[i, :count], alone)
