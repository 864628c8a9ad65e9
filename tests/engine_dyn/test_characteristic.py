"""Speed characteristics of lecture 18, and the load that gives a torque."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from engine_dyn.quantities.features.characteristic import (
    CHARACTERISTICS,
    PROPELLER,
    Characteristic,
    load_for_torque,
)

RPM = math.pi / 30.0
POWER, SPEED = 60e3, 4000 * RPM
LECTURE = {
    "spark ignition": (1.00, 1.00), "diesel": (0.87, 1.13), "pre-chamber diesel": (0.60, 1.40),
    "swirl-chamber diesel": (0.70, 1.30),
}  # fmt: skip


@pytest.mark.parametrize("name", list(LECTURE))
def test_lecture(name: str) -> None:
    """N_e = N_max x (A + C x - x^2), M = 9550 N_e/n in kW and rpm, printed with 9549.3 rounded."""
    a, c = LECTURE[name]
    curve = CHARACTERISTICS[name]
    for rpm in (500.0, 1700.0, 3000.0, 4000.0, 4400.0):
        x = rpm / 4000.0
        power = 60.0 * x * (a + c * x - x**2)
        assert curve.power(rpm * RPM, POWER, SPEED) == pytest.approx(1e3 * power, rel=1e-12)
        torque = curve.torque(rpm * RPM, POWER, SPEED)
        assert torque == pytest.approx(9550.0 * power / rpm, rel=1e-4)
        assert torque != pytest.approx(9550.0 * power / rpm, rel=1e-5)
    assert curve.power(SPEED, POWER, SPEED) == pytest.approx(POWER, rel=1e-12)
    x, over = curve.largest_torque
    best = minimize_scalar(
        lambda s: -curve.torque(s * SPEED, POWER, SPEED), bounds=(0.1, 1.0), method="bounded",
        options={"xatol": 1e-10},
    )  # fmt: skip
    assert x == pytest.approx(best.x, abs=1e-6)
    assert over == pytest.approx(-best.fun * SPEED / POWER)
    assert curve.torque(0.0, POWER, SPEED) == pytest.approx(a * POWER / SPEED)


def test_propeller() -> None:
    speeds = SPEED * np.array([0.25, 0.5, 1.0])
    np.testing.assert_allclose(PROPELLER.power(speeds, POWER, SPEED), POWER * np.array(
        [1 / 64, 1 / 8, 1.0]
    ))  # fmt: skip


@pytest.mark.parametrize(("power", "speed", "what"), [(0.0, 1.0, "power"), (1.0, -2.0, "speed")])
def test_bad_input(power: float, speed: float, what: str) -> None:
    with pytest.raises(ValueError, match=f"rated_{what} = .*: must be above 0"):
        Characteristic(1.0, 1.0, -1.0, "").torque(100.0, power, speed)


def test_load_for_torque() -> None:
    """Kinked, curved, at the ends and beyond them; every element is its own."""

    def torque(load: np.ndarray, _: object = None) -> np.ndarray:
        return np.where(load < 50.0, load**2 / 50.0, 50.0 + 3.0 * (load - 50.0)) - 5.0

    wanted = np.array([-6.0, -5.0, 0.0, 44.0, 45.0, 46.0, 195.0, 195.1])[:, None]
    found = load_for_torque(torque, [0.0, 30.0, 100.0], wanted)
    assert np.isnan(found[[0, -1]]).all()
    np.testing.assert_allclose(torque(found[1:-1]), wanted[1:-1], atol=1e-10)
    assert found[1, 0] == 0.0 and found[-2, 0] == 100.0
    for row in range(8):
        alone = load_for_torque(torque, [0.0, 30.0, 100.0], wanted[row])
        np.testing.assert_array_equal(alone, found[row])
    assert load_for_torque(lambda load, _: load * 0.0 + 7.0, [100.0], 7.0) == 100.0
    assert np.isnan(load_for_torque(lambda load, _: load * 0.0 + 7.0, [100.0], 8.0))
