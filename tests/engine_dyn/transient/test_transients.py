"""The speed while nothing repeats: against DOP853, the periodic solution, energy, and outcomes."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from engine_dyn import periodic_speed, status
from engine_dyn.geometry.cylinders import Cylinders, even_cylinders
from engine_dyn.pressure.family import Family, family_from_diagrams
from engine_dyn.pressure.motored import motored
from engine_dyn.transient.api import Transients, follow_designs
from engine_dyn.transient.limits import ISO_8528_5_G2, kept
from engine_dyn.transient.tables import TransientEngine, transient_engine
from oracle.hostile_transients import hostile_designs, hostile_engine, untrue
from oracle.transients import Reference
from sweeps.scene.engine.engine_files import load_engine

pytestmark = pytest.mark.compiled

CYCLE = 4.0 * math.pi
SPEED, RADIUS, RATIO, MASS = 125.66, 0.09, 0.25, 6.67
LEVER = 0.25 * math.pi * 0.14**2 * RADIUS
INJECTED, MIXED = -math.pi / 12.0, -2.0 * math.pi
BASE = {
    "inertia": 3.0, "reciprocating_inertia": MASS * RADIUS**2, "lever": LEVER, "speed": SPEED,
    "start_speed": SPEED, "start_command": 20.0, "load_exponent": 1.6, "friction_constant": 30.0,
    "friction_linear": 0.1, "friction_square": 5e-4, "friction_peak_share": 1e-6,
}  # fmt: skip
GOVERNOR = {
    "governed": 1.0, "reference_speed": SPEED, "gain": 500.0, "integral_gain": 800.0,
    "actuator_lag": 0.05, "highest_command": 90.0, "lowest_command": -16.0, "droop": 0.03,
}  # fmt: skip


@pytest.fixture(scope="module")
def family() -> Family:
    found = load_engine("ntua").family
    assert isinstance(found, Family)
    return found


def engine_of(family: Family, cylinders: int, command_angle: float = MIXED) -> TransientEngine:
    return transient_engine(
        family, even_cylinders(cylinders, CYCLE), crank_ratio=RATIO, command_angle=command_angle
    )


def same(one: Transients, other: Transients) -> bool:
    pairs = [(one.cycles[name], other.cycles[name]) for name in one.cycles]
    pairs += [(one.marks[name], other.marks[name]) for name in one.marks]
    return all(np.array_equal(a, b, equal_nan=True) for a, b in pairs)


CASES: dict[str, tuple[int, float, dict[str, float], Any, Any, int]] = {
    # cylinders, command angle, numbers besides, load, missed firings (cycle, cylinder), cycles
    "load steps and a ramp, misfires, dead time": (
        3, INJECTED, GOVERNOR | {"window": 3.0, "dead_time": 0.02},
        ([0.0, 0.15, 0.15, 0.5, 0.7], [300.0, 300.0, 700.0, 700.0, 200.0]), ((3, 1), (5, 0)), 9,
    ),
    "propeller, light flywheel": (
        2, INJECTED, GOVERNOR | {"inertia": 1.0, "load_exponent": 2.0},
        ([0.0, 0.1, 0.1], [100.0, 100.0, 250.0]), (), 6,
    ),
    "sampled in time, PID, boost, power, inertia switched in": (
        1, MIXED, GOVERNOR | {
            "sampling_time": 0.013, "derivative_gain": 2.0, "boost_lag": 0.3, "boost_margin": 10.0,
            "inertia": 6.0, "load_exponent": -1.0, "clutch_time": 0.41, "clutch_inertia": 1.0,
        }, ([0.1, 0.3], [50.0, 150.0]), ((3, 0),), 8,
    ),
    "starter and its freewheel": (
        4, INJECTED, GOVERNOR | {
            "start_speed": 20.0, "start_command": 60.0, "starter_torque": 400.0,
            "starter_speed": 40.0, "fuel_from": 25.0, "inertia": 4.0,
        }, ([0.0], [50.0]), (), 4,
    ),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_speed_at_the_end_of_each_cycle_is_that_of_dop853(family: Family, case: str) -> None:
    cylinders, angle, more, load, missed, cycles = CASES[case]
    engine, numbers = engine_of(family, cylinders, angle), BASE | more
    commands = engine.tables(48).commands
    rows = [motored(family.at(0.0)), *(family.at(float(one)) for one in commands[1:])]
    firing = [-member.phase % CYCLE for member in engine.cylinders.members]
    exact = Reference(rows, commands, firing, angle, RATIO, numbers, load, missed).run(cycles)
    found = follow_designs(engine, cycles, load=load, missed=missed, **numbers)
    assert found.outcome[0] == status.FOLLOWED
    np.testing.assert_allclose(found.cycles["speed_end"][0], exact[:, 1], rtol=1e-6)
    np.testing.assert_allclose(found.cycles["time"][0], exact[:, 0], rtol=1e-6)
    # The estimate is of the right size, but for what DOP853 itself leaves.
    error = np.abs(found.cycles["speed_end"][0] / exact[:, 1] - 1.0).max()
    assert error < 10.0 * found.error[0] + 1e-9


def load_steps(engine: TransientEngine, cycles: int = 40, **more: Any) -> Transients:
    """Load put on and off designs with inertia constants of some 0.3 to 3 s."""
    count = engine.cylinders.count
    numbers = BASE | GOVERNOR | {"inertia": count * np.geomspace(1.0, 8.0, 12), "droop": 0.0}
    numbers |= {"gain": np.linspace(200.0, 900.0, 12), "load_exponent": [2.0, 1.6] * 6}
    times, torques = [0.0, 0.5, 0.5, 2.5, 2.5], count * np.array([40.0, 40.0, 200.0, 200.0, 20.0])
    return follow_designs(engine, cycles, load=(times, torques), **(numbers | more))


@pytest.mark.parametrize("cylinders", [1, 4])
def test_order_of_convergence(family: Family, cylinders: int) -> None:
    engine = engine_of(family, cylinders)
    exact = load_steps(engine, steps=384, estimate=False).cycles["speed_end"]
    errors = {}
    for steps in (12, 24, 48):
        found = load_steps(engine, steps=steps, estimate=steps == 48)
        errors[steps] = np.abs(found.cycles["speed_end"] / exact - 1.0).max(axis=1)
        if steps == 48:
            assert (errors[48] < 5.0 * found.error + 1e-9).all()
    assert errors[48].max() < 1e-6
    # Smooth torques have order 8; with the knots of diagrams, errors fall faster than by order 4
    # until some 1e-10.
    assert np.log2(errors[12].max() / errors[48].max()) / 2.0 > 4.0


@pytest.mark.parametrize("cylinders", [1, 4])
@pytest.mark.parametrize("exponent", [1.6, 2.0])
def test_a_constant_command_ends_in_the_periodic_solution(
    family: Family, cylinders: int, exponent: float
) -> None:
    friction = 40.0 * cylinders
    steady = periodic_speed(
        family.at(50.0), bore=0.14, stroke=2.0 * RADIUS, crank_ratio=RATIO, reciprocating_mass=MASS,
        inertia=2.5 * cylinders, speed=SPEED, cylinders=cylinders, load_exponent=exponent,
        friction_torque=friction, inertia_model="variable", crank_angle=[0.0], tolerance=1e-8,
    )  # fmt: skip
    torque = steady.load_coefficient * SPEED**exponent
    numbers = BASE | {
        "start_command": 50.0, "friction_linear": 0.0, "friction_square": 0.0,
        "friction_peak_share": 0.0, "friction_constant": friction, "inertia": 2.5 * cylinders,
        "load_exponent": exponent, "start_speed": [1.1 * SPEED, steady.omega[0]],
    }  # fmt: skip
    found = follow_designs(engine_of(family, cylinders), 400, load=([0.0], [torque]), **numbers)
    np.testing.assert_allclose(found.delta[:, -1], steady.delta, rtol=1e-6)
    np.testing.assert_allclose(found.delta[1, 0], steady.delta, rtol=1e-6)
    np.testing.assert_allclose(found.cycles["speed_mean"][:, -1], steady.omega_mean, rtol=1e-7)
    np.testing.assert_allclose(found.cycles["speed_end"][:, -1], steady.omega[0], rtol=1e-7)


def test_a_governed_run_ends_in_the_same_cycle_from_anywhere(family: Family) -> None:
    engine = engine_of(family, 4)
    numbers = BASE | GOVERNOR | {"droop": 0.0, "inertia": 8.0, "start_speed": [110.0, 125.0, 140.0]}
    found = follow_designs(engine, 500, load=([0.0], [400.0]), **numbers)
    last = {name: values[:, -1] for name, values in found.cycles.items() if name != "time"}
    for name, values in last.items():
        np.testing.assert_allclose(values, values[0], rtol=1e-9, err_msg=name)
    # Isochronous: the time of the last cycle is that of the speed held.
    time = np.diff(found.cycles["time"][:, -2:], axis=1)[:, 0]
    np.testing.assert_allclose(CYCLE / time, SPEED, rtol=1e-9)


@pytest.mark.parametrize("cylinders", [1, 6])
def test_energy_is_conserved(family: Family, cylinders: int) -> None:
    engine = engine_of(family, cylinders)
    numbers = {name: BASE[name] for name in ("reciprocating_inertia", "lever", "speed")}
    numbers |= {"inertia": 20.0 * cylinders, "start_speed": 60.0, "start_command": 40.0}
    found = follow_designs(engine, 10, **numbers)
    # Work over the cycle by the mean of equal samples: spectral, but for the knots of the diagram.
    x = np.arange(1440) * CYCLE / 1440
    s, c = np.sin(x), np.cos(x)
    v = s + RATIO * s * c / np.sqrt(1.0 - (RATIO * s) ** 2)
    work = cylinders * LEVER * CYCLE * np.mean((family.at(40.0)(x) - 101325.0) * v)
    square = np.interp(np.arange(cylinders) * CYCLE / cylinders, x, v * v)
    inertia = numbers["inertia"] + numbers["reciprocating_inertia"] * (
        square.sum() - cylinders * np.mean(v * v)
    )
    energy = 0.5 * inertia * np.append(60.0, found.cycles["speed_end"][0]) ** 2
    np.testing.assert_allclose(np.diff(energy), work, rtol=1e-6)
    np.testing.assert_allclose(np.diff(energy), np.diff(energy)[0], rtol=1e-10)


def test_designs_do_not_depend_on_others_or_on_threads(family: Family) -> None:
    engine = engine_of(family, 3, INJECTED)
    count = 40
    numbers = BASE | GOVERNOR | {"inertia": np.geomspace(0.5, 20.0, count), "dispersion": 0.05}
    numbers |= {"cylinder_dispersion": 0.02, "seed": np.arange(count), "window": 3.0}
    load = ([0.0, 0.2, 0.2], [300.0, 300.0, 600.0])
    alone = [
        follow_designs(engine, 8, load=load, threads=1, estimate=False,
                       **(numbers | {"inertia": numbers["inertia"][i], "seed": float(i)}))
        for i in (0, 17, 39)
    ]  # fmt: skip
    for threads in (1, 2, 3):
        found = follow_designs(engine, 8, load=load, threads=threads, estimate=False, **numbers)
        for i, one in zip((0, 17, 39), alone, strict=True):
            for name, values in found.cycles.items():
                assert np.array_equal(values[i], one.cycles[name][0], equal_nan=True)
    assert same(found, follow_designs(engine, 8, load=load, estimate=False, **numbers))


def test_dispersion_has_its_standard_deviation(family: Family) -> None:
    engine = engine_of(family, 1)
    numbers = BASE | {"inertia": 500.0, "start_command": 40.0, "seed": np.arange(40.0)}
    found = follow_designs(engine, 100, dispersion=0.05, estimate=False, **numbers)
    motored_command = engine.tables(48).commands[0]
    share = (found.cycles["burnt"] - motored_command) / (40.0 - motored_command) - 1.0
    assert abs(share.mean()) < 0.05 * 4.0 / math.sqrt(4000)
    assert share.std() == pytest.approx(0.05, rel=0.05)
    assert abs(np.corrcoef(share[:, 1:].ravel(), share[:, :-1].ravel())[0, 1]) < 0.06


def test_run_down_stops_where_friction_holds(family: Family) -> None:
    for cylinders in (1, 2, 6):
        numbers = BASE | {"fuel_cut": 0.2, "inertia": 3.0 * np.array([1.0, 2.0, 4.0])}
        found = follow_designs(engine_of(family, cylinders), 200, **numbers)
        assert (found.outcome == status.STOPPED).all()
        assert (np.diff(found.run["cycles_to_stop"]) > 0.0).all()
        for i, done in enumerate(found.run["cycles_done"].astype(int)):
            assert np.isfinite(found.cycles["speed_end"][i, :done]).all()
            assert np.isnan(found.cycles["speed_end"][i, done:]).all()


def test_dry_friction_alone_stops_by_its_work(family: Family) -> None:
    """Without gas, the work of friction until standstill is the kinetic energy."""
    engine = engine_of(family, 2)
    numbers = {"inertia": 3.0, "lever": 1e-12, "speed": SPEED, "start_speed": 40.0}
    found = follow_designs(engine, 100, friction_constant=7.0, fuel_cut=1e-9, **numbers)
    turned = 0.5 * 3.0 * 40.0**2 / 7.0
    assert found.outcome[0] == status.STOPPED
    assert found.run["cycles_done"][0] * CYCLE + found.run["end_angle"][0] == pytest.approx(
        turned, rel=1e-7
    )
    assert found.run["end_time"][0] == pytest.approx(40.0 * 3.0 / 7.0, rel=1e-7)


def test_starting_and_not_starting(family: Family) -> None:
    numbers = BASE | GOVERNOR | {
        "start_speed": 0.0, "start_command": 60.0, "starter_torque": [20.0, 150.0, 500.0],
        "starter_speed": 40.0, "starter_release": 60.0, "fuel_from": [15.0, 80.0, 15.0],
        "ready_speed": 110.0, "inertia": 4.0,
    }  # fmt: skip
    found = follow_designs(engine_of(family, 4), 40, load=([0.0], [50.0]), **numbers)
    names = [status.MEANINGS[code] for code in found.outcome]
    assert names == ["not_started", "not_started", "followed"]
    assert np.isnan(found.run["time_to_start"][:2]).all() and found.run["time_to_start"][2] < 2.0


def test_time_of_a_start_without_gas_is_that_of_the_equation(family: Family) -> None:
    """Starter S(1 - w/n) on an inertia J: t = (J n/S) ln(1/(1 - w/n))."""
    numbers = {"inertia": 3.0, "lever": 1e-12, "speed": SPEED, "start_speed": 0.0}
    found = follow_designs(
        engine_of(family, 1), 30, starter_torque=90.0, starter_speed=50.0, ready_speed=40.0,
        **numbers,
    )  # fmt: skip
    expected = 3.0 * 50.0 / 90.0 * math.log(1.0 / (1.0 - 40.0 / 50.0))
    assert found.run["time_to_start"][0] == pytest.approx(expected, rel=1e-6)


def test_a_slipping_clutch_keeps_momentum(family: Family) -> None:
    """Without other torques both ends turn with their common momentum once it holds."""
    numbers = {"inertia": 3.0, "lever": 1e-12, "speed": SPEED, "start_speed": 100.0}
    clutch = {"clutch_time": 0.3, "clutch_inertia": 1.0, "clutch_torque": [40.0, math.inf]}
    found = follow_designs(engine_of(family, 2), 40, **numbers, **clutch)
    np.testing.assert_allclose(found.cycles["speed_end"][:, -1], 75.0, rtol=1e-9)
    # Slipping ends after 75 rad/s at 40 rad/s2; the angle is that of a constant torque.
    slip = 75.0 / 40.0
    angle = 100.0 * 0.3 + 100.0 * slip - 0.5 * 40.0 / 3.0 * slip**2
    time = 0.3 + slip + (40.0 * CYCLE - angle) / 75.0
    assert found.cycles["time"][0, -1] == pytest.approx(time, rel=1e-9)


def test_recovery_and_limits(family: Family) -> None:
    found = load_steps(engine_of(family, 6), 100, marks=[0.5, 2.5])
    marks = found.marks
    assert (marks["speed_lowest"][:, 0] < marks["speed_before"][:, 0]).all()
    assert (marks["speed_highest"][:, 1] > marks["speed_before"][:, 1]).all()
    dip = (marks["speed_before"] - marks["speed_lowest"])[:, 0]
    assert dip[0] > dip[-1]  # a heavier flywheel
    verdict = kept(found, np.full(12, SPEED), ISO_8528_5_G2)
    assert verdict.shape == (12, 2) and verdict.any() and not verdict.all()


def test_a_factor_on_the_gas_is_that_of_other_diagrams(family: Family) -> None:
    """Not on the crankcase pressure; friction's share of the peak pressure follows it."""
    factor = 0.8
    diagrams = [
        replace(one, pressure=factor * one.pressure, slope=factor * one.slope)
        for one in family.diagrams
    ]
    scaled = family_from_diagrams(family.loads, diagrams)
    found = []
    for one, more in ((family, {"gas_factor": factor}), (scaled, {})):
        engine = transient_engine(
            one, even_cylinders(3, CYCLE), crank_ratio=RATIO, crankcase_pressure=3e5
        )
        load = ([0.0, 0.3, 0.3], [100.0, 100.0, 400.0])
        found.append(follow_designs(engine, 8, load=load, **(BASE | GOVERNOR | more)))
    for name, values in found[0].cycles.items():
        np.testing.assert_allclose(values, found[1].cycles[name], rtol=1e-10, err_msg=name)
    np.testing.assert_allclose(found[0].delta, found[1].delta, rtol=1e-8)
    assert (found[0].outcome == status.FOLLOWED).all()


def test_tables_of_alike_cylinders_are_those_of_each(family: Family) -> None:
    """Cylinders that are not alike have tables of their own, which engines made before share."""
    equal = even_cylinders(6, CYCLE)
    differ = [one._replace(mass_factor=1.0 + 1e-13 * i) for i, one in enumerate(equal.members)]
    unequal = Cylinders(CYCLE, tuple(differ))
    made = {}
    for ratio in (0.2, RATIO):
        for cylinders in (equal, unequal):
            made[cylinders] = transient_engine(family, cylinders, crank_ratio=ratio).tables(36)
    for one, other in zip(made[equal], made[unequal], strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * np.abs(other).max())


def test_a_command_a_cycle_ahead_misses_the_firing_that_is_named(family: Family) -> None:
    """At angle 0 the cylinder takes its command for cycle 1; that of cycle 0 was taken before."""
    engine = engine_of(family, 1, -CYCLE)
    numbers = BASE | {"start_command": 40.0, "inertia": 50.0}
    burnt = [
        follow_designs(engine, 3, missed=[[cycle, 0]], **numbers).cycles["burnt"][0]
        for cycle in (0, 1, 2)
    ]
    none = engine.tables(36).commands[0]
    expected = [[40.0, 40.0, 40.0], [none, 40.0, 40.0], [40.0, none, 40.0]]
    np.testing.assert_allclose(burnt, expected, rtol=1e-12)


@pytest.mark.parametrize("seed", [1, 2])
def test_absurd_designs_end_in_a_true_outcome(seed: int, family: Family) -> None:
    """`python tools/hostile_transients.py` takes more of them, and compares some with DOP853."""
    draw, count, cycles = np.random.default_rng(seed), 1000, 20
    engine = hostile_engine(draw, family)
    given = hostile_designs(draw, count, engine.cylinders.count)
    found = follow_designs(engine, cycles, estimate=False, **given)
    assert untrue(found, given, cycles) == {}
    assert (found.outcome == status.NOT_CONVERGED).mean() < 0.05


def test_stiff_friction_below_the_switch_is_followed(family: Family) -> None:
    """A starter S(1 - w/n) against friction c w turns the shaft at S/(c + S/n), from the start on.

    Its time constant is a hundredth of a step's time.
    """
    numbers = {"inertia": 0.4, "lever": 1e-12, "speed": 435.0, "start_speed": 0.0}
    starter = {"starter_torque": 5000.0, "starter_speed": 1000.0, "friction_linear": 1000.0}
    found = follow_designs(engine_of(family, 8), 2, estimate=False, **numbers, **starter)
    held = 5000.0 / (1000.0 + 5000.0 / 1000.0)
    assert found.cycles["speed_highest"][0, 0] == pytest.approx(held, rel=1e-6)
    assert found.cycles["speed_lowest"][0, 1] == pytest.approx(held, rel=1e-6)
    assert found.cycles["speed_mean"][0, 1] == pytest.approx(held, rel=1e-6)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"actuator_lag": -0.1}, "actuator_lag = -0.1: must be at least 0"),
        ({"inertia": 0.0}, "inertia = 0: must be above 0"),
        ({"load": ([0.0, 2.0, 1.0], [1.0, 1.0, 1.0])}, "load: time 1 s after 2 s"),
        ({"load": ([0.0, math.inf], [1.0, 1.0])}, "load, times: must be finite"),
        ({"start_speed": 0.0}, "start_speed = 0: must be above 0 without a starter's torque"),
        ({"governed": 1.0}, "reference_speed: missing"),
        ({"starter_torque": 5.0}, "starter_speed: missing"),
        ({"command": ([0.0], [50.0]), **GOVERNOR}, "command: not allowed with a governor"),
        ({"missed": [[1, 7]]}, "missed, cylinder 7"),
        ({"gian": 4.0}, "gian: unknown"),
        ({"cycles": 0}, "cycles = 0"),
        ({"cycles": 10**9}, "cycles = 1e"),
        ({"sampling_time": 1e-9, **GOVERNOR}, "sampling_time = 1e-09"),
        ({"marks": [2.0, 1.0]}, "marks"),
        ({"lowest_command": 5.0, "highest_command": 3.0}, "must be at most highest_command, 3"),
        ({"seed": 1.5}, "seed = 1.5: must be a whole number at least 0"),
    ],
)
def test_bad_input_is_one_line(family: Family, changed: dict[str, Any], said: str) -> None:
    given = {"cycles": 3, **BASE} | changed
    with pytest.raises(ValueError) as raised:
        follow_designs(engine_of(family, 2), given.pop("cycles"), **given)
    assert said in str(raised.value) and "\n" not in str(raised.value)
