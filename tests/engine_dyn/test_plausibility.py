"""Values that engines do not have: the table of ranges, and what Python is warned of."""

import math
import warnings
from typing import Any

import numpy as np
import pytest

import engine_dyn
from engine_dyn.pressure.diagram import Diagram, diagram_from_points
from engine_dyn.speed.api import energy_swing

ENGINE: dict[str, Any] = {
    "bore": 0.14, "stroke": 0.18, "crank_ratio": 9 / 35, "reciprocating_mass": 6.67,
    "inertia": 2.0, "speed": 125.66, "friction_torque": 32.8,
}  # fmt: skip


@pytest.fixture(scope="module")
def diagram() -> Diagram:
    """A diesel engine's, by polytropes."""
    phi = np.radians(np.arange(-360.0, 360.0, 2.0))
    volume = 1.0 + 8.0 * engine_dyn.position(phi, ENGINE["crank_ratio"])
    rising = (17.0 / volume) ** 1.35
    falling = 1.5 * (17.0 / volume) ** 1.3
    closed = np.abs(phi) < math.pi
    pressure = np.where(closed, np.where(phi < 0.0, rising, falling), 1.0)
    return diagram_from_points(phi, 1e5 * np.maximum(pressure, 1.0))


def test_a_usual_engine_is_not_warned_of(diagram: Diagram) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert engine_dyn.periodic_speed(diagram, **ENGINE).status == 0
    assert engine_dyn.implausible(diagram, **ENGINE) == ()


@pytest.mark.compiled  # uncompiled kernels raise at the roots of negative numbers, which are NaN
@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("bore", 5.5, r"bore: 5.5 m; .*5 times the usual maximum; is bore in inches\?"),
        ("stroke", 18.0, r"stroke in cm\?"),
        ("reciprocating_mass", 6670.0, r"in g\?"),
        ("inertia", 2e4, r"^inertia: .*inertia = 20000 kg m2.*in kg cm2\?"),
        ("speed", 1200.0, r"speed = 1200 rad/s.*is speed in rpm\?"),
        ("crankcase_pressure", 1.01325, r"1.01325 Pa.*in bar\?"),
        ("friction_torque", 1.5, r"0.068 bar .*mean pressure in bar\?"),
        ("crank_ratio", 18 / 35, r"the stroke over the rod\?"),
    ],
)
def test_another_unit_is_asked_about(diagram: Diagram, key: str, value: float, told: str) -> None:
    with pytest.warns(engine_dyn.ImplausibleWarning, match=told) as caught:
        engine_dyn.periodic_speed(diagram, **{**ENGINE, key: value})
    lines = [str(w.message) for w in caught if w.category is engine_dyn.ImplausibleWarning]
    assert all("\n" not in line for line in lines)
    assert caught[0].filename == __file__  # the caller's line, not one of ours


def test_arrays_are_one_line_each_with_the_worst() -> None:
    inertia = np.geomspace(1.0, 10.0, 1000)[:, None]
    speed = np.full((1, 7), 125.0)
    sizes = {key: ENGINE[key] for key in ("bore", "stroke")} | {"cylinders": 1}
    assert engine_dyn.implausible(inertia=inertia, speed=speed, **sizes) == ()
    inertia[[3, 500]] = [[5e3], [2e4]]
    (found,) = engine_dyn.implausible(inertia=inertia, speed=speed, **sizes)
    assert (found.count, found.of, found.place) == (2, 1000, (500, 0))
    assert "2 of 1000 values" in str(found)
    # Against the plain loop, also where an array is taken apart.
    speed = np.random.default_rng(1).uniform(10.0, 700.0, (40, 20000))
    (found,) = engine_dyn.implausible(speed=speed, stroke=np.linspace(0.05, 0.2, 40)[:, None])
    mean = np.linspace(0.05, 0.2, 40)[:, None] * speed / math.pi
    bad = (mean < 1.0) | (mean > 28.0)
    assert (found.count, found.of) == (int(bad.sum()), bad.size)
    assert found.value == pytest.approx(mean[found.place])
    far = np.abs(np.log(mean / math.sqrt(28.0)))
    assert far[found.place] == pytest.approx(far[bad].max())


def test_friction_that_drives_is_refused(diagram: Diagram) -> None:
    sizes = {key: value for key, value in ENGINE.items() if key != "inertia"}
    for value in (-32.8, -1e-300):
        for function, given in ((engine_dyn.periodic_speed, ENGINE), (energy_swing, sizes)):
            with pytest.raises(ValueError, match=r"friction_torque = -.*driver.*negative load_off"):
                function(diagram, **{**given, "friction_torque": value})
