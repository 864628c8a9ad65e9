"""The coefficient of torque irregularity of lecture 18, against torques made from the pressure."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import sweeps

pytestmark = pytest.mark.compiled

BORE, RADIUS, ROD = 0.14, 0.09, 0.35  # of the NTUA engine, m
MASS = 6.67  # kg
STEP = 0.05  # degree


def run(quantities: list[str], step: float = 1.0, **tables: Any) -> Any:
    output = {"quantities": quantities, "angle_step": step}
    return sweeps.run({"engine": "ntua", "output": output, **tables})


def indicated_torque(pressure: np.ndarray, degrees: np.ndarray, rpm: float, count: int) -> Any:
    """Torque of gas and reciprocating masses of engines that fire evenly, by virtual work.

    The piston's place is that of the triangle of crank and rod; its velocity and acceleration are
    differences, so that nothing is shared with the package but the pressure.
    """
    phi, h = np.radians(degrees), 1e-4

    def place(angle: Any) -> Any:
        return RADIUS * np.cos(angle) + np.sqrt(ROD**2 - (RADIUS * np.sin(angle)) ** 2)

    first = (place(phi + h) - place(phi - h)) / (2.0 * h)
    second = (place(phi + h) - 2.0 * place(phi) + place(phi - h)) / h**2
    omega = rpm * np.pi / 30.0
    force = 0.25 * np.pi * BORE**2 * (pressure - 1.01325) * 1e5 + MASS * omega**2 * second
    one = -force * first
    return sum(np.roll(one, k * one.size // count) for k in range(count))


def test_it_is_over_the_mean_indicated_torque() -> None:
    """Power units, lecture 18: mu = (M_i max - M_i min)/M_i mean, index i without friction."""
    axes = {"load": [0, 2, 50], "speed": [700, 1500], "cylinders": [1, 4]}
    setting = {"reciprocating_mass": MASS}
    found = run(
        ["torque_irregularity", "torque_irregularity_brake", "torque_range", "torque_mean",
         "friction_torque", "pressure"],
        STEP, axes=axes, set=setting,
    )  # fmt: skip
    degrees = found["crank_angle"].values
    for place in np.ndindex(3, 2, 2):
        here = found.isel(dict(zip(axes, place, strict=True)))
        count, rpm = int(here["cylinders"]), float(here["speed"])
        curve = indicated_torque(here["pressure"].values, degrees, rpm, count)
        mean = float(curve.mean())
        assert mean == pytest.approx(float(here["torque_mean"] + here["friction_torque"]), rel=1e-4)
        mu = np.ptp(curve) / mean
        assert float(here["torque_irregularity"]) == pytest.approx(mu, rel=1e-4), place
    brake = found["torque_range"] / found["torque_mean"]
    assert_allclose(found["torque_irregularity_brake"], brake, rtol=1e-14)
    # Friction makes the difference, most of it where there is little else.
    ratio = abs(found["torque_irregularity_brake"] / found["torque_irregularity"])
    assert (ratio > 1.1).all()
    assert float(ratio.sel(load=2, speed=1500, cylinders=1)) > 2.0


def test_it_is_a_number_where_the_engine_idles() -> None:
    """Without a brake torque there is still an indicated one, which the friction takes."""
    found = run(
        ["torque_irregularity", "torque_irregularity_brake", "torque_range", "friction_torque",
         "torque_mean"],
        set={"load": 0, "speed": 1200},
    )  # fmt: skip
    mu = float(found["torque_irregularity"])
    whole = float(found["torque_mean"] + found["friction_torque"])
    assert mu == pytest.approx(float(found["torque_range"]) / whole, rel=1e-12)
    assert 0.0 < mu < 200.0
    brake = float(found["torque_irregularity_brake"])
    assert np.isnan(brake) or abs(brake) > 1e6


def test_friction_over_the_stroke_leaves_it_alone() -> None:
    names = ["torque_irregularity", "torque_irregularity_brake", "torque_range"]
    scene = {"axes": {"load": [20, 50], "speed": [800, 1500]}}
    shape = {
        "friction_boundary": 0.2, "friction_mixed": 0.3, "friction_hydrodynamic": 0.3,
        "friction_skirt": 0.1, "ring_pressure": 2.0,
    }  # fmt: skip
    even, over_stroke = run(names, **scene), run(names, set=shape, **scene)
    assert_allclose(over_stroke["torque_irregularity"], even["torque_irregularity"], rtol=1e-6)
    # The range of the torque with friction differs, and with it what is over the brake torque.
    assert (abs(over_stroke["torque_range"] / even["torque_range"] - 1.0) > 1e-4).all()
    assert (over_stroke["torque_irregularity_brake"] != even["torque_irregularity_brake"]).all()
