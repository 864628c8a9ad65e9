"""Friction by component: every formula by hand, other engines, limits, and what the shares are."""

import math

import numpy as np
import pytest

from engine_dyn.loads import friction_components as components
from engine_dyn.loads.friction_components import VALVE_TRAINS
from engine_dyn.units import RPM

pytestmark = pytest.mark.quick

ROUND = {"bore": 0.1, "stroke": 0.1, "cylinders": 1}
"""A cylinder of round numbers: B = S = 100 mm."""

SPEED = 1000.0 * RPM
"""Where 1 + 1000/N is 2."""


@pytest.mark.parametrize(
    ("found", "pascal"),
    [
        # 1.22e5 x 50/1e6 = 6.1; 3.03e-4 x 1000 x 50^3 x 20 x 2/1e6 = 1.515 and 0.675 kPa
        (components.crankshaft_seals(**ROUND, journal_diameter=0.05), 6100.0),
        (components.main_bearings(**ROUND, speed=SPEED, journal_diameter=0.05, journal_width=0.02,
                                  bearings=2), 1515.0 + 675.0),
        # 294 x 3.3333/100 = 9.8; 4.06e4 x 2/1e4 = 8.12; 3.03e-4 x 1000 x 40^3 x 20/1e6 = 0.38784
        (components.skirt(0.1, 2.0 * 0.1 * 1000.0 / 60.0), 9800.0),
        (components.rings(0.1, SPEED), 8120.0),
        (components.crank_pin_bearings(**ROUND, speed=SPEED, pin_diameter=0.04, pin_width=0.02),
         387.84),
        (components.auxiliaries(SPEED), 11271.0),
    ],
)  # fmt: skip
def test_by_hand(found: float, pascal: float) -> None:
    assert found == pytest.approx(pascal)


def test_gas_on_the_rings_by_hand() -> None:
    """At 10/2.38 m/s the exponent is 1.23; at 13.866 m/s and more it is below 1."""
    found = components.ring_gas_pressure(8.0, 10.0 / 2.38)
    assert found == pytest.approx(6.89e3 * (0.704 + 0.182 * 8.0**1.23))
    assert components.ring_gas_pressure(8.0, 10.0 / 2.38, 0.4) == pytest.approx(0.4 * found)
    fast = components.ring_gas_pressure(8.0, 0.33 / 0.0238)
    assert fast == pytest.approx(6.89e3 * 8.0 * (0.088 + 0.182))


def test_valve_train_by_hand() -> None:
    """OHV, two valves that lift 10 mm: 4.608, then 16, 0.1 and 12.84 kPa."""
    found = components.valve_train(
        **ROUND, speed=SPEED, kind=VALVE_TRAINS["ohv"].number, lift=0.01, valves=2,
        camshaft_bearings=2,
    )  # fmt: skip
    camshaft = 244.0 * 1000.0 * 2.0 / 1e6 + 4.12
    followers, mixed = 400.0 * 2.0 * 2.0 / 100.0, 32.1 * 2.0 * 10.0 * 2.0 / 100.0
    in_oil = 0.5 * 10.0**1.5 * math.sqrt(1000.0) * 2.0 / 1e4
    assert (camshaft, followers, in_oil, mixed) == pytest.approx((4.608, 16.0, 0.1, 12.84))
    assert found == pytest.approx(1e3 * (camshaft + followers + in_oil + mixed))


def test_a_roller_turns_instead_of_sliding() -> None:
    """Its friction grows with the speed, 0.0227 N n_v/S kPa, where a flat follower's falls."""
    speeds = np.array([1000.0, 6000.0]) * RPM

    def followers(kind: str) -> np.ndarray:
        train = VALVE_TRAINS[kind]
        found: np.ndarray = components.valve_train(
            **ROUND, speed=speeds, kind=train.number, lift=1e-12, valves=4, camshaft_bearings=0
        )
        return found - 4120.0

    rollers, flat = followers("dohc_roller_finger_follower"), followers("dohc_finger_follower")
    np.testing.assert_allclose(rollers, 1e3 * 0.0227 * speeds / RPM * 4.0 / 100.0, rtol=1e-6)
    np.testing.assert_allclose(flat, 1e3 * 600.0 * np.array([2.0, 7.0 / 6.0]) * 0.04, rtol=1e-6)


def test_kinds_broadcast_with_speeds() -> None:
    numbers = np.array([train.number for train in VALVE_TRAINS.values()], dtype=float)
    speeds = np.array([900.0, 3000.0, 6000.0]) * RPM
    needs = {**ROUND, "lift": 0.009, "valves": 4, "camshaft_bearings": 10}
    table = components.valve_train(speed=speeds, kind=numbers[:, None], **needs)
    assert table.shape == (7, 3)
    for row, number in zip(table, numbers, strict=True):
        one = [float(components.valve_train(speed=w, kind=number, **needs)) for w in speeds]
        assert row.tolist() == one


def test_mixed_lubrication_fades_and_films_grow() -> None:
    speeds = np.array([500.0, 1000.0, 1e9]) * RPM
    found = components.rings(0.1, speeds) / 4060.0
    np.testing.assert_allclose(found, [3.0, 2.0, 1.0], rtol=1e-5)
    slow, fast = (
        components.crank_pin_bearings(0.1, 0.1, 4, w, 0.05, 0.02) for w in (SPEED, 3.0 * SPEED)
    )
    assert fast == pytest.approx(3.0 * slow)
