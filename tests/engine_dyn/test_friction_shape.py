"""Friction over the crank angle, Chen and Flynn's full form."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from engine_dyn.geometry.arrangement import FOUR_STROKE, TWO_STROKE
from engine_dyn.loads.friction import FrictionShape
from engine_dyn.pressure.diagram import Diagram, diagram_from_points
from tests.support.cycles import case

pytestmark = pytest.mark.quick

BAR = 1e5
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
    speed = np.abs(np.sin(phi)) * (
        1.0 + 0.28 * np.cos(phi) / np.sqrt(1.0 - (0.28 * np.sin(phi)) ** 2)
    )
    load = 1.5 * BAR + fired(phi) - BAR
    coefficient = {}
    for name in ("boundary", "mixed", "hydrodynamic"):
        one = shape(**{**dict.fromkeys(SHARES, 0.0), name: 1.0})
        coefficient[name] = one(phi, 0.28, fired, BAR) / speed / load
    np.testing.assert_allclose(coefficient["boundary"], coefficient["boundary"][0], rtol=1e-9)
    assert (np.diff(coefficient["mixed"][phi < 1.5]) < 0.0).all()
    root = coefficient["hydrodynamic"] / np.sqrt(speed / load)
    np.testing.assert_allclose(root, root[0], rtol=1e-9)


def test_no_shares_is_the_constant_torque(fired: Diagram) -> None:
    none = shape(**dict.fromkeys(SHARES, 0.0))
    np.testing.assert_array_equal(none([-3.0, 0.0, 1.0], 0.3, fired, BAR), 1.0)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"boundary": -0.1}, "boundary = -0.1: must be between 0 and 1"),
        ({"mixed": 1.2}, "mixed = 1.2: must be between 0 and 1"),
        ({"skirt": 0.6}, "boundary + mixed + hydrodynamic + skirt = 1.1: must be at most 1"),
        ({"ring_pressure": 0.0}, "ring_pressure = 0 bar: must be between 0 and 100 bar"),
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
