"""Orders of the torque that textbooks give for crankshafts, from the engines of the catalogue.

Expected values are closed forms: a harmonic of one cylinder's torque times the sum of the phase
vectors of all, |1 + exp(i nu psi)| for two (Mettig, Die Kurbelwelle, phase vectors; Heisler,
Advanced Engine Technology, twins and V8 engines). Both books are cited from memory; the forms are
derived here.
"""

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from engine_dyn.engine import Engine
from engine_dyn.forces import torque as torques
from engine_dyn.forces.superposition import CrankTrain
from engine_dyn.geometry.arrangement import Arrangement, phase_sums
from engine_dyn.geometry.cylinders import Cylinders, even_cylinders
from sweeps.reading.engine_files import load_engine

PERIOD = 4.0 * math.pi
COUNT = 7200
PHI = np.arange(COUNT) * (PERIOD / COUNT)
ORDERS = 0.5 * np.arange(1, 25)
"""Of a four-stroke engine: half orders up to 12."""

SMALL = 1e-9
"""Of the largest harmonic: rounding."""


@cache
def engine_of(name: str) -> Engine:
    return load_engine(name, Path())


def arrangement_of(name: str) -> Arrangement:
    own = engine_of(name).own_cylinders
    assert own is not None
    assert own.arrangement is not None
    return own.arrangement


def torque(name: str, engine: Cylinders, speed: float = 4000.0) -> np.ndarray:
    """Gas and inertia torque of a catalogue engine with these cylinders."""
    v, family = engine_of(name).values, engine_of(name).family
    row = 0.0 if len(family.loads) == 1 else float(family.row_count - 1)
    count = {engine.count: engine}
    train = CrankTrain(v["crank_ratio"], v["stroke"], engine.count, PERIOD, by_count=count)
    pressure = torques.GasPressure(family, row, 1.0, 1e5 * v["crankcase_pressure"])
    gas = torques.gas_torque(PHI, train, v["bore"], pressure)
    mass = v.get("reciprocating_mass", 0.5)
    inertia = torques.inertia_torque(PHI, train, mass, speed * math.pi / 30.0)
    return np.asarray(gas + inertia)


def harmonics(curve: np.ndarray) -> np.ndarray:
    """Amplitudes of the orders `ORDERS`."""
    return 2.0 * np.abs(np.fft.rfft(curve))[1 : len(ORDERS) + 1] / COUNT


@pytest.mark.parametrize(
    ("crank", "apart"), [(360, 2.0 * math.pi), (180, math.pi), (270, 1.5 * math.pi)]
)
def test_three_cranks_of_a_parallel_twin(crank: int, apart: float) -> None:
    """Cylinder 2 fires 360, 180 or 270 degrees behind cylinder 1: 2 |cos(nu apart/2)|."""
    name = f"parallel_twin_{crank}"
    own = engine_of(name).own_cylinders
    assert own is not None
    one = harmonics(torque(name, even_cylinders(1, PERIOD)))
    found = harmonics(torque(name, own))
    sums = 2.0 * np.abs(np.cos(0.5 * ORDERS * apart))
    np.testing.assert_allclose(found, sums * one, atol=SMALL * one.max())
    np.testing.assert_allclose(arrangement_of(name).phase_sums(ORDERS), sums, atol=1e-12)


def bank_of(name: str, bank: int) -> tuple[Cylinders, np.ndarray]:
    """One bank as an engine of four, and the crank angles between its firings [degree]."""
    own, arrangement = engine_of(name).own_cylinders, arrangement_of(name)
    assert own is not None
    places = [i for i, c in enumerate(arrangement.cylinders) if c.bank == bank]
    alone = Cylinders(PERIOD, tuple(own.members[i] for i in places))
    angles = np.sort(np.degrees(arrangement.firing_angles[places]))
    return alone, np.diff(angles, append=angles[0] + 720.0)


@pytest.mark.parametrize("bank", [0, 1])
def test_banks_of_a_cross_plane_v8_fire_unevenly(bank: int) -> None:
    """90, 180, 270 and 180 degrees apart, whence the half orders in the exhaust of each."""
    name = "v8_cross_plane_93x86"
    alone, gaps = bank_of(name, bank)
    assert sorted(gaps.round().tolist()) == [90.0, 180.0, 180.0, 270.0]
    one = harmonics(torque(name, even_cylinders(1, PERIOD)))
    found = harmonics(torque(name, alone))
    phases = np.array([member.phase for member in alone.members])
    sums = np.abs(np.exp(1j * ORDERS[:, None] * phases).sum(axis=1))
    np.testing.assert_allclose(found, sums * one, atol=SMALL * one.max())
    arrangement = arrangement_of(name)
    members = [cylinder.bank == bank for cylinder in arrangement.cylinders]
    of_bank = phase_sums(ORDERS, arrangement.phases[members], PERIOD)
    np.testing.assert_allclose(of_bank, sums, atol=1e-12)
    by_order = dict(zip(ORDERS.tolist(), sums, strict=True))
    assert all(by_order[order] > 0.5 for order in (0.5, 1.5, 2.5, 3.5))
    assert all(by_order[order] == pytest.approx(4.0) for order in (4.0, 8.0, 12.0))


@pytest.mark.parametrize("missing", [1, 4])
def test_a_missing_cylinder_brings_the_half_orders(missing: int) -> None:
    """What is lost is one cylinder's combustion: all its orders, in an engine that had every 4th.

    In the cross-plane V8 with a misfire, each order that is no multiple of 4 is that of the
    pressure above motored of one cylinder.
    """
    name = "v8_cross_plane_93x86"
    own = engine_of(name).own_cylinders
    assert own is not None
    single = even_cylinders(1, PERIOD)
    lost = torque(name, single) - torque(name, single.with_factors(pressure_factor=(0.0,)))
    found = harmonics(torque(name, own.without(missing)))
    others = ORDERS % 4.0 != 0.0
    expected = harmonics(lost)
    np.testing.assert_allclose(found[others], expected[others], atol=8.0 * SMALL * expected.max())
    assert (found[:4] > 0.05 * expected.max()).all()
