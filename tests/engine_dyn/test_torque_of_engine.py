"""An engine posed by its torque over the crank angle, and loads over more revolutions than two."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from engine_dyn.loads.driven_machine import DrivenMachine, cycles_of
from engine_dyn.loads.torque_curves import TorqueOverAngle, torque_of_harmonics
from engine_dyn.pressure.family import flat_family
from engine_dyn.speed import dispatch
from engine_dyn.speed.torque import torque_extremes

pytestmark = pytest.mark.compiled

NOMINAL, INERTIA = 420.0 * math.pi / 30.0, 900.0
ENGINE = torque_of_harmonics(25e3, {3: (-8e3, 0.0)})


def solved(load: TorqueOverAngle | None, **more: Any) -> dict[str, Any]:
    """Periodic speed of the engine of issues and textbooks, 25 - 8 sin(3 theta) kN m."""
    return dispatch.solve(
        **posed(load), inertia=INERTIA, exponent=more.pop("exponent", 0.0),
        offset=0.0 if load is None else load.mean, mean_torque=ENGINE.mean,
        wanted=more.pop("wanted", ("delta",)), **more,
    )  # fmt: skip


def posed(load: TorqueOverAngle | None) -> dict[str, Any]:
    """What all solvers take: a piston of 1 m2 on a crank of 1 m, without pressure and mass."""
    return {
        "family": flat_family(ENGINE.period), "crank_ratio": 0.25, "row": 0.0, "scale": 0.0,
        "crankcase_pressure": 0.0, "bore": math.sqrt(4.0 / math.pi), "double_radius": 2.0,
        "mass": 0.0, "speed": NOMINAL, "friction_torque": 0.0,
        "driven": DrivenMachine(over_angle=load, engine_torque=ENGINE),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("harmonics", "delta", "swing"),
    [({}, 0.0030634, 5333.33), ({1: (4.2e3, 0.0)}, 0.0078882, 13733.3333)],
    ids=["constant load", "load 25 + 4.2 sin"],
)
def test_published_engine(harmonics: dict[float, Any], delta: float, swing: float) -> None:
    load = torque_of_harmonics(25e3, harmonics)
    assert solved(load)["delta"] == pytest.approx(delta, rel=2e-5)
    found = torque_extremes(**posed(load), wanted=("energy_swing", "torque_max", "torque_min"))
    assert found["energy_swing"] == pytest.approx(swing, rel=1e-6)
    assert found["torque_max"] == pytest.approx(33e3, rel=1e-9)  # without the load
    assert found["torque_min"] == pytest.approx(17e3, rel=1e-9)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 2.0])
def test_load_over_three_revolutions(exponent: float) -> None:
    load = torque_of_harmonics(0.0, {1 / 3: (4.2e3, 0.0)})
    assert cycles_of(load, ENGINE.period) == 3
    found = solved(load, exponent=exponent)
    again = solved(load, exponent=exponent, method="newton")
    assert found["delta"] == pytest.approx(again["delta"], rel=1e-8)
    if exponent == 2.0:  # the equation is linear in omega^2, whose mean is that of nominal speed
        theta = np.linspace(0.0, 6.0 * math.pi, 60_001)
        lagged = [
            torque / (INERTIA * (1j * order + 2.0 * ENGINE.mean / (INERTIA * NOMINAL**2)))
            for order, torque in ((3.0, -8e3), (1.0 / 3.0, -4.2e3))
        ]
        square = NOMINAL**2 + 2.0 * sum(
            (z * np.exp(1j * order * theta)).imag
            for order, z in zip((3.0, 1.0 / 3.0), lagged, strict=True)
        )
        omega = np.sqrt(square)
        delta = np.ptp(omega) / np.trapezoid(omega, theta) * theta[-1]
        assert found["delta"] == pytest.approx(delta, rel=1e-7)


def test_closed_form_is_exact_between_the_knots() -> None:
    theta = np.linspace(-9.0, 20.0, 999)
    given = {0.5: (3.0, 1.0), 1: (0.0, -2.0), 6: (5.0, 0.5)}
    torque = torque_of_harmonics(7.0, given)
    exact = 7.0 + sum(a * np.sin(n * theta) + b * np.cos(n * theta) for n, (a, b) in given.items())
    np.testing.assert_allclose(torque(theta), exact, atol=1e-9)
    assert torque.period == pytest.approx(4.0 * math.pi)
    assert torque.mean == pytest.approx(7.0, abs=1e-12)


@pytest.mark.parametrize(
    ("harmonics", "message"),
    [
        ({0.0: (1.0, 0.0)}, "order = 0: must be above 0 and at most 256"),
        ({257.0: (1.0, 0.0)}, "order = 257: must be above 0 and at most 256"),
        ({math.pi: (1.0, 0.0)}, r"order = 3.14159: must repeat within 64 revolutions"),
        ({1 / 7: (1, 0), 1 / 11: (1, 0)}, "repeat together after 77 revolutions: must be at most"),
        ({1: (math.nan, 0.0)}, "torque must be a finite number"),
    ],
)
def test_no_closed_form(harmonics: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        torque_of_harmonics(0.0, harmonics)
