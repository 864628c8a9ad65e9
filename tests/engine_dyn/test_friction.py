"""Friction: its mean, by component and as one formula, and over the crank angle."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from engine_dyn.geometry.arrangement import FOUR_STROKE, TWO_STROKE
from engine_dyn.loads import friction
from engine_dyn.loads.friction import VALVE_TRAINS, FrictionShape
from engine_dyn.pressure.diagram import Diagram, diagram_from_points
from engine_dyn.units import BAR, RPM
from oracle.solution import velocity
from tests.support.cycles import case

pytestmark = pytest.mark.quick

# ---- the mean, as one formula


def test_friction_by_hand() -> None:
    """Kakaitsas (2015), eqs. 3.8, 3.9, engine of table 4.1 at 1200 rpm and 80 bar."""
    speed = friction.mean_piston_speed(0.18, 1200.0 * np.pi / 30.0)
    assert speed == pytest.approx(2.0 * 0.18 * 20.0, rel=1e-15)
    fmep = friction.friction_mean_effective_pressure(0.137e5, 0.005, 0.142e5, 80e5, speed)
    assert fmep == pytest.approx((0.137 + 0.005 * 80.0 + 0.142 * 7.2) * 1e5, rel=1e-14)
    square = friction.friction_mean_effective_pressure(0.0, 0.0, 0.0, 80e5, speed, 0.0009e5)
    assert square == pytest.approx(0.0009 * 7.2**2 * 1e5, rel=1e-14)
    displacement = 0.25 * np.pi * 0.14**2 * 0.18
    torque = friction.friction_torque(fmep, displacement, FOUR_STROKE)
    # What it takes out of a cycle is fmep on the displacement.
    assert torque * FOUR_STROKE == pytest.approx(fmep * displacement, rel=1e-14)
    assert friction.friction_torque(fmep, displacement, 0.5 * FOUR_STROKE) == 2.0 * torque
    # Table 5.2 at 50 % load, whose diagram has 65.408 bar
    fmep = friction.friction_mean_effective_pressure(0.137e5, 0.005, 0.142e5, 65.408e5, speed)
    torque = friction.friction_torque(fmep, displacement, FOUR_STROKE)
    assert torque == pytest.approx(32.776, abs=5e-4)


# ---- by component: Patton, Nitschke and Heywood

ROUND = {"bore": 0.1, "stroke": 0.1, "cylinders": 1}
"""A cylinder of round numbers: B = S = 100 mm."""

SPEED = 1000.0 * RPM
"""Where 1 + 1000/N is 2."""


@pytest.mark.parametrize(
    ("found", "pascal"),
    [
        # 1.22e5 x 50/1e6 = 6.1; 3.03e-4 x 1000 x 50^3 x 20 x 2/1e6 = 1.515 and 0.675 kPa
        (friction.crankshaft_seals(**ROUND, journal_diameter=0.05), 6100.0),
        (friction.main_bearings(**ROUND, speed=SPEED, journal_diameter=0.05, journal_width=0.02,
                                  bearings=2), 1515.0 + 675.0),
        # 294 x 3.3333/100 = 9.8; 4.06e4 x 2/1e4 = 8.12; 3.03e-4 x 1000 x 40^3 x 20/1e6 = 0.38784
        (friction.skirt(0.1, 2.0 * 0.1 * 1000.0 / 60.0), 9800.0),
        (friction.rings(0.1, SPEED), 8120.0),
        (friction.crank_pin_bearings(**ROUND, speed=SPEED, pin_diameter=0.04, pin_width=0.02),
         387.84),
        (friction.auxiliaries(SPEED), 11271.0),
    ],
)  # fmt: skip
def test_by_hand(found: float, pascal: float) -> None:
    assert found == pytest.approx(pascal)


def test_gas_on_the_rings_by_hand() -> None:
    """At 10/2.38 m/s the exponent is 1.23; at 13.866 m/s and more it is below 1."""
    found = friction.ring_gas_pressure(8.0, 10.0 / 2.38)
    assert found == pytest.approx(6.89e3 * (0.704 + 0.182 * 8.0**1.23))
    assert friction.ring_gas_pressure(8.0, 10.0 / 2.38, 0.4) == pytest.approx(0.4 * found)
    fast = friction.ring_gas_pressure(8.0, 0.33 / 0.0238)
    assert fast == pytest.approx(6.89e3 * 8.0 * (0.088 + 0.182))


def test_valve_train_by_hand() -> None:
    """OHV, two valves that lift 10 mm: 4.608, then 16, 0.1 and 12.84 kPa."""
    found = friction.valve_train(
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
        found: np.ndarray = friction.valve_train(
            **ROUND, speed=speeds, kind=train.number, lift=1e-12, valves=4, camshaft_bearings=0
        )
        return found - 4120.0

    rollers, flat = followers("dohc_roller_finger_follower"), followers("dohc_finger_follower")
    np.testing.assert_allclose(rollers, 1e3 * 0.0227 * speeds / RPM * 4.0 / 100.0, rtol=1e-6)
    np.testing.assert_allclose(flat, 1e3 * 600.0 * np.array([2.0, 7.0 / 6.0]) * 0.04, rtol=1e-6)


def test_mixed_lubrication_fades_and_films_grow() -> None:
    speeds = np.array([500.0, 1000.0, 1e9]) * RPM
    found = friction.rings(0.1, speeds) / 4060.0
    np.testing.assert_allclose(found, [3.0, 2.0, 1.0], rtol=1e-5)
    slow, fast = (
        friction.crank_pin_bearings(0.1, 0.1, 4, w, 0.05, 0.02) for w in (SPEED, 3.0 * SPEED)
    )
    assert fast == pytest.approx(3.0 * slow)


# ---- over the crank angle: the full form of Chen and Flynn

SHARES = {"boundary": 0.1, "mixed": 0.15, "hydrodynamic": 0.25, "skirt": 0.2}


@pytest.fixture(scope="module")
def fired() -> Diagram:
    made: Diagram = case("spark, woschni").diagram()
    return made


def shape(**changes: float) -> FrictionShape:
    return FrictionShape(**{**SHARES, "ring_pressure": 1.5 * BAR, **changes})


def flat(period: float) -> Diagram:
    """A diagram that is nearly the crankcase's pressure everywhere."""
    phi = (np.arange(360) / 360.0 - 0.5) * period
    return diagram_from_points(phi, BAR * (1.0 + 1e-9 * np.cos(phi * 2.0 * np.pi / period)), period)


def exact_mean(curve: Any, period: float) -> float:
    """Cycle mean by the midpoint rule over an angle that is stretched at dead centres."""
    t = (np.arange(20000) + 0.5) / 20000
    place = np.arange(round(period / np.pi))[:, None] + t**3 * (10.0 + t * (6.0 * t - 15.0))
    return float((curve(place * np.pi) * 30.0 * (t * (1.0 - t)) ** 2).mean())


@pytest.mark.parametrize("only", [*SHARES, "all"])
def test_the_mean_is_one(fired: Diagram, only: str) -> None:
    """Whatever the shares, the cycle mean is 1 and the work is that of the mean torque."""
    changes = {} if only == "all" else {**dict.fromkeys(SHARES, 0.0), only: 1.0}
    one, ports = shape(**changes), case("ports, woschni").diagram()
    for curve, ratio, period in ((fired, 0.28, FOUR_STROKE), (ports, 0.45, TWO_STROKE)):
        mean = exact_mean(lambda phi, r=ratio, c=curve: one(phi, r, c, BAR), period)
        assert mean == pytest.approx(1.0, abs=1e-9)


def test_closed_forms_without_gas_and_with_a_long_rod() -> None:
    """With p = p_crankcase and u = |sin phi| the means are 2/pi, 2/pi - 1/2, ..., 1/2."""
    phi = np.linspace(0.0, 2.0 * np.pi, 721)
    u = np.abs(np.sin(phi))
    beta = 2.0 / np.pi * quad(lambda x: np.sin(x) ** 1.5, 0.0, 0.5 * np.pi, epsabs=1e-13)[0]
    for name, expected in (
        ("boundary", u * np.pi / 2.0), ("mixed", u * (1.0 - u) / (2.0 / np.pi - 0.5)),
        ("hydrodynamic", u**1.5 / beta), ("skirt", 2.0 * u**2),
    ):  # fmt: skip
        one = shape(**{**dict.fromkeys(SHARES, 0.0), name: 1.0})
        found = one(phi, 1e-9, flat(TWO_STROKE), BAR)
        np.testing.assert_allclose(found, expected, atol=2e-7)


def test_branches_of_the_stribeck_curve(fired: Diagram) -> None:
    """Coefficient of friction: constant, falling with speed, growing with sqrt(speed/load)."""
    phi = np.linspace(0.05, 3.0, 200)
    speed = np.abs(velocity(phi, 0.28))
    load = 1.5 * BAR + fired(phi) - BAR
    coefficient = {}
    for name in ("boundary", "mixed", "hydrodynamic"):
        one = shape(**{**dict.fromkeys(SHARES, 0.0), name: 1.0})
        coefficient[name] = one(phi, 0.28, fired, BAR) / speed / load
    np.testing.assert_allclose(coefficient["boundary"], coefficient["boundary"][0], rtol=1e-9)
    assert (np.diff(coefficient["mixed"][phi < 1.5]) < 0.0).all()
    root = coefficient["hydrodynamic"] / np.sqrt(speed / load)
    np.testing.assert_allclose(root, root[0], rtol=1e-9)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"boundary": -0.1}, "boundary = -0.1: must be between 0 and 1"),
        ({"mixed": 1.2}, "mixed = 1.2: must be between 0 and 1"),
        ({"skirt": 0.6}, "boundary + mixed + hydrodynamic + skirt = 1.1: must be at most 1"),
        ({"ring_pressure": 0.0}, "ring_pressure = 0 bar: must be above 0 and below 100 bar"),
        ({"hydrodynamic": float("nan")}, "hydrodynamic = nan"),
    ],
)
def test_bad_shares(changes: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError) as caught:
        shape(**changes)
    assert words in str(caught.value)


def test_rings_that_lift(fired: Diagram) -> None:
    """Where the pressure under the piston is higher by more than their tension, they bear nothing.

    The mean is still 1, and the skirt's part does not know of it.
    """
    dry = shape(**{**dict.fromkeys(SHARES, 0.0), "boundary": 1.0}, ring_pressure=0.01 * BAR)
    phi = np.linspace(-2.0 * np.pi, 2.0 * np.pi, 1441)
    lifted = fired(phi) - BAR < -0.01 * BAR
    assert lifted.any()
    curve = dry(phi, 0.28, fired, BAR)
    assert (curve[lifted] == 0.0).all()
    assert exact_mean(lambda phi: dry(phi, 0.28, fired, BAR), FOUR_STROKE) == pytest.approx(
        1.0, abs=1e-6
    )
