"""Scenes of articulated rods and of VR engines: speed, torque, and what is refused."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from engine_dyn.geometry.layouts import arrangement_from_text
from engine_dyn.units import DEGREE
from oracle.solution import Problem, periodic_speed
from tests.support.engine_files import indicator_text
from tests.support.master_rods import (
    BORE,
    KNUCKLE,
    KNUCKLE_MASS,
    MASS,
    OFFSET,
    RADIUS,
    ROD,
    STEPS,
    gas_of_points,
    kinetic,
    over_phi,
    slope,
)  # fmt: skip
from tests.support.scenes import asking, computed, refusal

INERTIA, RPM = 9.0, 2200.0
OMEGA = RPM * np.pi / 30.0
STROKE = math.sqrt((ROD + RADIUS) ** 2 - OFFSET**2) - math.sqrt((ROD - RADIUS) ** 2 - OFFSET**2)
TEXT = f"""\
name = "radial"
cycle = "four-stroke"
arrangement = "radial 9"

[articulated_rods]
radius = {KNUCKLE / RADIUS!r}
knuckle_mass = {KNUCKLE_MASS / MASS!r}

[values]
bore = {BORE}
stroke = {STROKE!r}
rod_length = {ROD}
crank_offset = {OFFSET}
reciprocating_mass = {MASS}
inertia = {INERTIA}
speed = {RPM}
load = 100
load_exponent = 2
load_offset = 0
crankcase_pressure = 1.0
friction_constant = 0
friction_peak_pressure = 0
friction_mean_piston_speed = 0

[[diagram]]
load = 100
kind = "points"
file = "pressure.csv"
"""


@pytest.fixture(scope="module")
def engine(tmp_path_factory: Any) -> str:
    folder: Path = tmp_path_factory.mktemp("radial")
    degrees = np.arange(-360.0, 360.0)
    volume = 1.0 + 5.5 * 0.5 * (1.0 - np.cos(np.radians(degrees)))
    pressure = (6.5 / volume) ** 1.3 + 30.0 * np.exp(-(((degrees - 15.0) / 25.0) ** 2))
    rows = [(float(a), float(p)) for a, p in zip(degrees, pressure, strict=True)]
    folder.joinpath("pressure.csv").write_text(indicator_text(rows))
    path = folder / "radial.toml"
    path.write_text(TEXT, encoding="utf-8")
    return str(path)


def delta_of(torque: np.ndarray) -> float:
    """Of a load torque k omega^2: linear in omega^2, so each harmonic of the torque by itself."""
    k = torque.mean() / OMEGA**2
    orders = np.fft.fftfreq(torque.size, 1.0 / torque.size) / 2.0
    waves = 2.0 / INERTIA * np.fft.fft(torque) / (1j * orders + 2.0 * k / INERTIA)
    fine = np.zeros(8 * torque.size, dtype=complex)
    half = torque.size // 2
    fine[:half], fine[-half:] = 8.0 * waves[:half], 8.0 * waves[-half:]
    omega = np.sqrt(np.fft.ifft(fine).real)
    return float((omega.max() - omega.min()) / omega.mean())


def torque_of_points() -> np.ndarray:
    masses = -0.5 * OMEGA**2 * over_phi("customary", slope(kinetic("customary")))
    return gas_of_points("customary") + np.tile(masses, 2)


def test_speed_and_torque_are_those_of_points_at_fixed_distances(engine: str) -> None:
    expected = torque_of_points()
    here = computed(
        ("delta", "torque", "torque_max", "torque_mean", "delta_error"), engine,
        output={"angle_step": 0.5},
    )  # fmt: skip
    curve = np.roll(here["torque"].values, -STEPS)  # from the dead centre of cylinder 1 on
    assert np.abs(curve - expected).max() < 1e-5 * np.ptp(expected)
    assert float(here["torque_mean"]) == pytest.approx(expected.mean(), rel=1e-5)
    assert float(here["torque_max"]) == pytest.approx(expected.max(), rel=1e-4)
    assert float(here["delta"]) == pytest.approx(delta_of(expected), rel=2e-5)


def test_variable_inertia_is_that_of_points(engine: str) -> None:
    """An adaptive integration of the points' kinetic energy, by the oracle."""
    phi = np.arange(2 * STEPS + 1) * (math.tau / STEPS)

    def periodic(curve: np.ndarray) -> Any:
        twice = np.resize(curve, 2 * STEPS)
        return CubicSpline(phi, [*twice, twice[0]], bc_type="periodic")

    gas, masses = gas_of_points("customary"), over_phi("customary", kinetic("customary"))
    ratio = periodic(1.0 + (masses - masses.mean()) / INERTIA)
    slopes = ratio.derivative()
    problem = Problem(
        periodic(gas), float(gas.mean()), float(np.ptp(gas)), INERTIA,
        lambda a: ratio(np.mod(a, 2 * math.tau)), lambda a: slopes(np.mod(a, 2 * math.tau)), OMEGA,
        2.0, 0.0, "power_mean",
    )  # fmt: skip
    here = computed(("delta",), engine, solver={"inertia_model": "variable"})
    speed = periodic_speed(problem)
    delta = (speed.omega_max - speed.omega_min) / speed.omega_mean
    assert float(here["delta"]) == pytest.approx(delta, rel=2e-5)


def test_methods_and_axes_agree(engine: str) -> None:
    """Designs of a sweep are those of single scenes, by either solver."""
    axes = {"crank_ratio": [0.22, 0.255], "inertia": [6.0, 9.0]}
    methods = {"method": ["auto", "newton"], "inertia_model": ["constant", "variable"]}
    here = computed(("delta", "torque_max"), engine, axes=axes, solver=methods)
    auto, newton = (here["delta"].sel(method=number) for number in here["method"].values)
    assert auto.values == pytest.approx(newton.values, rel=1e-5)
    one = computed(
        ("delta", "torque"), engine, set={"crank_ratio": 0.22, "inertia": 6.0},
        output={"angle_step": 0.1},
    )  # fmt: skip
    first = here["delta"].isel(crank_ratio=0, inertia=0, method=0, inertia_model=0)
    assert float(one["delta"]) == pytest.approx(float(first), rel=1e-9)
    most = float(here["torque_max"].isel(crank_ratio=0))
    assert float(one["torque"].max()) == pytest.approx(most, rel=1e-5)


@pytest.mark.parametrize(
    "quantity",
    [
        "tangential_force", "gas_wall_thrust", "rod_force", "radial_force", "piston_pin_load",
        "main_journal_load_max",
        "shaking_moment", "shaking_force_max", "gravity_torque", "throw_torque_order",
        "phase_vector_sum", "inertia_torque_coefficient", "rod_couple", "best_fraction_rms",
    ],
)  # fmt: skip
def test_what_is_not_computed_is_refused_by_name(engine: str, quantity: str) -> None:
    line = refusal(asking((quantity,), engine))
    assert line.endswith(f"'{quantity}' is not computed for engines with articulated_rods")


def test_loads_of_the_master_rod(engine: str) -> None:
    """The tangential load of the pin does the work of the engine's torque."""
    names = (
        "torque", "wall_thrust", "crank_pin_tangential", "crank_pin_load", "crank_pin_load_max",
        "crank_pin_load_rms",
    )  # fmt: skip
    rods = {"rod_mass": 4.0, "rod_centre_of_gravity": 0.1}
    here = computed(names, engine, set=rods, output={"angle_step": 0.5})
    torque = RADIUS * here["crank_pin_tangential"].values
    assert np.abs(torque - here["torque"].values).max() < 1e-8 * np.ptp(torque)
    load = here["crank_pin_load"].values
    assert float(here["crank_pin_load_max"]) == pytest.approx(load.max(), rel=1e-4)
    assert float(here["crank_pin_load_rms"]) == pytest.approx(math.sqrt(np.mean(load**2)), rel=1e-9)
    plain = computed(
        ("wall_thrust",), engine,
        set={**rods, "articulated_rods": {"radius": 0.0, "knuckle_mass": 0.0}},
    )  # fmt: skip
    assert np.ptp(here["wall_thrust"].values) > 1.5 * np.ptp(plain["wall_thrust"].values)


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"articulated_rods": 0.7}, "articulated_rods = 0.7: must be a table of the rods"),
        ({"articulated_rods": {"radius": 0.7}}, "articulated_rods: knuckle_mass: missing"),
        ({"articulated_rods": {"radius": 3.0, "knuckle_mass": 0}},
         "articulated_rods: radius, value 2 = 3: must be from 0 to 2"),
        ({"articulated_rods": {"radius": [0.7] * 9, "knuckle_mass": 0}},
         "must be 0 for one of the cylinders 1, 2, 3, 4, 5, 6, 7, 8, 9 of throw 1"),
        ({"articulated_rods": {"radius": 0.7, "knuckle_mass": 0, "angles": [0.0, 40.0]}},
         "angles: 2 values for 9 cylinders"),
        ({"articulated_rods": {"radius": 0.7, "knuckle_mass": 0, "length": 1.5}},
         "a rod of 1.5 crank radii with its knuckle pin at 0.7: must be longer than"),
        ({"articulated_rods": {"radius": 0.7, "knuckle_mass": 0, "reach": 1}}, "reach"),
        ({"arrangement": "in-line 9 1-2-4-6-8-9-7-5-3"}, "has articulated_rods, which must be"),
        ({"friction_boundary": 0.5, "ring_pressure": 1.0}, "friction over the stroke"),
        ({"balance_shaft_mass": 1.0, "balance_shaft_radius": 0.05}, "balance_shaft_mass: not all"),
        ({"radius_factor_2": 0.9}, "radius_factor"),
    ],
)  # fmt: skip
def test_given_wrong(engine: str, tables: dict[str, Any], message: str) -> None:
    assert message in refusal(asking(("delta",), engine, set=tables))


ENGINE = "v6_96x81"
SET = {"arrangement": "VR6 15", "crank_offset": 0.0125}


def table(sides: list[float]) -> dict[str, object]:
    """The arrangement written out."""
    made = arrangement_from_text("VR6 15")
    return {
        "throws": [{"angle": float(one.angle / DEGREE)} for one in made.throws],
        "banks": [0.0, -15.0],
        "sides": sides,
        "cylinders": [
            {"throw": c.throw + 1, "bank": c.bank + 1, "firing_angle": c.firing_angle / DEGREE}
            for c in made.cylinders
        ],
    }


def test_stages_and_curves_have_the_offset_of_each_bank() -> None:
    names = ("torque", "torque_max", "torque_mean", "torque_order", "delta")
    here = computed(names, ENGINE, set=SET, output={"angle_step": 0.25})
    curve = here["torque"].values
    assert float(here["torque_max"]) == pytest.approx(curve.max(), rel=1e-5)
    assert float(here["torque_mean"]) == pytest.approx(curve.mean(), rel=1e-6)
    third = 2.0 * abs(np.fft.rfft(curve)[6]) / curve.size
    assert float(here["torque_order"].sel(order=3.0)) == pytest.approx(third, rel=1e-5)
    # Three firings of one bank follow on three of the other: the cycle does not repeat sooner.
    first = 2.0 * abs(np.fft.rfft(curve)[1]) / curve.size
    assert first > 1e-5 * third
    same = computed(("delta",), ENGINE, set={**SET, "arrangement": "in-line 6 1-5-3-6-2-4"})
    assert float(here["delta"]) != pytest.approx(float(same["delta"]), rel=1e-6)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"pin_offset": 0.001}, "pin_offset: must be 0 where banks lie to both sides"),
        ({"arrangement": table([1.0])}, "arrangement: sides = 1: must be 1 or -1 for each"),
        ({"arrangement": "VR6 60"}, "VR6: bank angle = 60 degree: must be above 0 and at most 45"),
        ({"crank_offset": 0.2}, "the crank cannot turn"),
    ],
)
def test_given_wrong_of_vr_engines(given: dict[str, object], message: str) -> None:
    line = refusal(asking(("delta",), ENGINE, set={**SET, **given}))
    assert message in line


def test_the_roll_moment_is_that_of_single_cylinders_to_either_side() -> None:
    """Of one cylinder with the offset of its bank, moved to where each fires."""
    names = ("roll_moment", "torque", "roll_moment_order")
    mounts = [{"lateral": -0.3}, {"lateral": 0.3}]
    whole = computed(names, ENGINE, set=SET, mounts=mounts)
    inertia = whole["roll_moment"].values + whole["torque"].values
    made = arrangement_from_text("VR6 15")
    expected = np.zeros(inertia.size)
    for side, cylinder in zip(made.cylinder_sides, made.cylinders, strict=True):
        single = {"cylinders": 1, "crank_offset": side * SET["crank_offset"]}
        one = computed(names, ENGINE, set=single, mounts=mounts)
        curve = one["roll_moment"].values + one["torque"].values
        expected += np.roll(curve, round(cylinder.firing_angle / DEGREE))
    assert np.abs(expected).max() > 1.0
    assert inertia == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())
