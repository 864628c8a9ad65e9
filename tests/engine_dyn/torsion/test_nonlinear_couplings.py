"""Couplings that are not linear: limits, integration in time, closed forms and energy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from engine_dyn.status import CONVERGED, INVALID_INPUT, NO_STEADY_STATE
from engine_dyn.torsion.couplings import CONTACTS, Coupling, departure, linearised
from engine_dyn.torsion.forced import RESULTS, forced_response
from engine_dyn.torsion.nonlinear import nonlinear_response
from engine_dyn.torsion.system import shaft_system

ORDERS = np.array([0.5, 1.0, 2.0, 4.0])
TORQUE = np.array([[3.0 + 1.0j, 5.0 - 2.0j, 40.0, 6.0j]])

TWO: dict[str, Any] = {
    "inertia": [0.1, 0.25], "stiffness": [2000.0], "damping": [2.0], "disc_damping": [0.0, 1.5],
}  # fmt: skip

STAGES = np.array([0.0, 0.02, 0.06, 0.3]), np.array([0.0, 20.0, 140.0, 2000.0])
"""An arc spring: twist [rad] and torque [N m]."""

GEARED: dict[str, Any] = {
    "inertia": [0.02, 0.05, 0.05, 1.5, 0.3, 0.1, 4.0],
    "stiffness": [9e5, 1.2e6, 8e5, 2e4, 6e5],
    "shafts": [(1, 0), (1, 2), (2, 3), (6, 5), (4, 5)],
    "loss_factor": [0.03, 0.03, 0.03, 0.15, 0.02],
    "damping": [0.0, 1.0, 0.0, 0.5, 1.0],
    "disc_damping": [0.0, 2.0, 2.0, 0.0, 0.5, 0.0, 30.0],
    "meshes": [(3, 4)],
    "ratios": [-2.4],
}
"""A crank, a gear and a rubber coupling (shaft 3) whose first disc is the farther one."""

GEARED_STAGES = np.array([0.0, 0.02, 0.04, 0.2]), np.array([0.0, 200.0, 800.0, 1e4])


def solved(couplings: Any, mean: Any, speed: Any = 100.0, **more: Any) -> dict[str, Any]:
    given = {"system": TWO, "throws": [0], "torque": TORQUE, "orders": ORDERS} | more
    system = given.pop("system")
    return nonlinear_response(
        shaft_system(**system), couplings, given.pop("orders"), speed, given.pop("throws"),
        given.pop("torque"), mean, **given,
    )  # fmt: skip


def odd(twist: Any, table: Any = STAGES) -> Any:
    """Torque of an odd table, whose last piece goes on."""
    beyond = np.maximum(np.abs(twist) - table[0][-1], 0.0)
    slope = (table[1][-1] - table[1][-2]) / (table[0][-1] - table[0][-2])
    return np.sign(twist) * (np.interp(np.abs(twist), *table) + slope * beyond)


def backlash(stiffness: float, clearance: float) -> Callable[[Any], Any]:
    half = 0.5 * clearance
    return lambda twist: stiffness * (twist - np.clip(twist, -half, half))


def repeating(
    after: Callable[[Any, bool], Any], state: Any, stages: tuple[tuple[bool, float], ...]
) -> Any:
    """State that a cycle brings back, and to which motions near it come.

    `after` maps states, in columns, to those a cycle later. Newton's method, on the state and its
    neighbours, after some cycles that lead near it. Each stage says whether `after` is exact, and
    how large the change over a cycle may be, over the state.
    """
    for _ in range(6):
        state = after(state[:, None], False)[:, 0]
    for exact, enough in stages:
        for _ in range(12):
            size = 1e-6 * np.abs(state).max()
            ended = after(state[:, None] + size * np.eye(state.size, state.size + 1, 1), exact)
            slope = (ended[:, 1:] - ended[:, :1]) / size
            change = ended[:, 0] - state
            if np.abs(change).max() < enough * np.abs(state).max():
                break
            state = state + np.linalg.solve(np.eye(state.size) - slope, change)
        else:
            raise AssertionError("does not repeat")
    if np.abs(np.linalg.eigvals(slope)).max() >= 1.0:
        raise AssertionError("does not repeat")
    return state


def in_time(
    system: dict[str, Any], laws: list[Callable[[Any], Any]], mean: float, rest: list[float],
    speed: float = 100.0,
) -> Any:  # fmt: skip
    """Twist and torque of each shaft of a chain over a cycle, at 2^16 angles, by DOP853.

    Steps are so short that a corner lies in few of them. The mean torque drives disc 1 and brakes
    the last one.
    """
    inertia, damping = np.array(system["inertia"]), np.array(system["damping"])
    against, count = np.array(system["disc_damping"]), len(system["inertia"])
    w, cycle = ORDERS * speed, 4.0 * np.pi / speed

    def torques(state: Any) -> Any:
        twist, rate = np.diff(state[:count], axis=0), np.diff(state[count:], axis=0)
        own = np.stack([law(one) for law, one in zip(laws, twist, strict=True)])
        return twist, own + (damping * rate.T).T

    def rates(time: float, state: Any) -> Any:
        _, torque = torques(state)
        acting = -(against * state[count:].T).T
        acting[0] += mean + np.sum((TORQUE[0] * np.exp(1j * w * time)).real)
        acting[-1] -= mean
        acting[:-1] += torque
        acting[1:] -= torque
        return np.concatenate([state[count:], (acting.T / inertia).T])

    def run(state: Any, times: Any = None, exact: bool = True) -> Any:
        part = 1.0 if exact else 1e4
        return solve_ivp(
            lambda t, s: rates(t, s.reshape(state.shape)).ravel(), (0.0, cycle), state.ravel(),
            "DOP853", times, rtol=1e-10 * part, atol=1e-12 * part,
            max_step=cycle / (300.0 if exact else 100.0),
        ).y  # fmt: skip

    def after(relative: Any, exact: bool) -> Any:
        """State a cycle later; disc 1 begins at angle 0."""
        start = np.concatenate([np.zeros((1, relative.shape[1])), relative])
        ended = run(start, exact=exact)[:, -1].reshape(start.shape)
        ended[:count] -= ended[0]
        return ended[1:]

    rested = np.concatenate([np.cumsum(rest), np.zeros(count)])
    state = np.concatenate([[0.0], repeating(after, rested, ((False, 1e-5), (True, 1e-9)))])
    return torques(run(state, np.arange(2**16) * cycle / 2**16))


def geared_in_time(
    system: dict[str, Any], coupling: Coupling, law: Callable[[Any], Any], torque: Any,
    mean: float, speed: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Least and largest torque and mean twist of the coupling of `GEARED` over a cycle.

    The slider of dry friction has a state of its own: what its spring holds.
    """
    inertia, pairs = np.array(system["inertia"]), np.array(system["shafts"])
    stiffness, damping = np.array(system["stiffness"]), np.array(system["damping"])
    against, place = np.array(system["disc_damping"]), coupling.shaft
    # Independent angles: of all discs but the second one of the mesh, which follows its first.
    (first, second), ratio = system["meshes"][0], system["ratios"][0]
    follow = np.delete(np.eye(7), second, axis=1)
    follow[second] = ratio * follow[first]
    mass = np.linalg.inv(follow.T @ np.diag(inertia) @ follow)
    limit, stick = coupling.friction_torque, coupling.friction_stiffness
    w, cycle = ORDERS * speed, 4.0 * np.pi / speed
    table = coupling.table(2e4)
    gap = 0.5 * coupling.clearance
    rest = np.interp(mean, *table[::-1]) - gap  # The mean torque is below 0

    def torques(angle: Any, rate: Any, held: Any) -> Any:
        twist, turn = (v[pairs[:, 1]] - v[pairs[:, 0]] for v in (angle, rate))
        own = (stiffness * twist.T).T + (damping * turn.T).T
        own[place] = law(twist[place] + rest) - mean + damping[place] * turn[place] + held
        return own, twist[place] + rest, turn[place]

    def rates(time: float, state: Any) -> Any:
        angle, rate, held = follow @ state[:6], follow @ state[6:12], state[12]
        own, _, turn = torques(angle, rate, held)
        acting = -against * rate
        acting[:3] += (torque * np.exp(1j * w * time)).real.sum(axis=-1)
        np.add.at(acting, pairs[:, 0], own)
        np.add.at(acting, pairs[:, 1], -own)
        slips = abs(held) >= limit and held * turn > 0.0
        spring = 0.0 if slips else stick * turn
        return np.concatenate([state[6:12], mass @ (follow.T @ acting), [spring]])

    def run(state: Any, times: Any = None, exact: bool = True) -> Any:
        most, relative = (cycle / 300.0, 1e-6) if exact else (cycle / 75.0, 1e-4)
        return solve_ivp(
            rates, (0.0, cycle), state, "DOP853", times, rtol=relative, max_step=most
        ).y  # fmt: skip

    state = np.zeros(13)
    for number in range(40):
        exact = number >= 36  # most of the way by longer steps
        before, state = state, run(state, exact=exact)[:, -1]
        if exact and np.abs(state - before)[6:12].max() < 1e-6 * np.abs(state[6:12]).max():
            break
    found = run(state, np.arange(2**13) * cycle / 2**13)
    own, twist, _ = torques(follow @ found[:6], follow @ found[6:12], found[12])
    return own[place].min() + mean, own[place].max() + mean, twist.mean()


def assert_same(found: dict[str, Any], twist: Any, torque: Any, tolerance: float) -> None:
    assert found["status"] == CONVERGED
    assert found["error"] <= tolerance
    half = 0.5 * np.ptp(torque, axis=1)
    for place, extreme in enumerate((torque.min(axis=1), torque.max(axis=1))):
        off = np.abs(found["coupling_extremes"][:, place] - extreme) / half
        assert (off < tolerance).all()
    off = np.abs(found["coupling_mean_twist"] - twist.mean(axis=1)) / np.ptp(twist, axis=1)
    assert (off < tolerance).all()


@pytest.mark.parametrize("tabled", [True, False])
@pytest.mark.parametrize("crank", [0, 4])
def test_a_linear_coupling_gives_the_linear_response(tabled: bool, crank: int) -> None:
    """All results, behind a gear, in a shaft that is given from its far side."""
    system = shaft_system(**GEARED, crank=crank)
    orders = np.arange(0.5, 12.5, 0.5)
    draw = np.random.default_rng(5).normal(size=(2, 3, orders.size))
    torque = 200.0 * (draw[0] + 1j * draw[1]) / (1.0 + orders**2)
    speed = np.array([90.0, 190.0])
    more: Any = {"wanted": tuple(RESULTS), "twist": [(0, 3), (6, 5)], "speed_of": [3]}
    wanted = forced_response(system, orders, speed, [0, 1, 2], torque, **more)
    line = np.array([-1.0, 0.3, 2.0])
    coupling = Coupling(3, line, 2e4 * line) if tabled else Coupling(3)
    mean = [0.0, 0.0, 0.0, -350.0, 0.0]
    found = nonlinear_response(
        system, [coupling], orders, speed, [0, 1, 2], torque, mean, **more
    )  # fmt: skip
    assert (found["status"] == CONVERGED).all()
    for name in RESULTS:
        own, other = found[name], wanted[name]
        if name == "torque_extremes":  # the coupling's come from samples
            np.testing.assert_allclose(own[:, 3, :2], other[:, 3, :2], rtol=1e-3)
            own, other = (np.delete(values, 3, axis=1) for values in (own, other))
        bound = 1e-10 * np.abs(other).max() if name in {"angle", "torque"} else 1e-3
        np.testing.assert_allclose(own[..., :2], other[..., :2], rtol=1e-3, atol=bound)
    for name in ("angle", "torque", "shaft_loss", "frame_loss"):
        assert np.abs(found[name] - wanted[name]).max() < 1e-10 * np.abs(wanted[name]).max()
    np.testing.assert_allclose(found["coupling_mean_twist"], -350.0 / 2e4, rtol=1e-12)


def test_clearance_that_keeps_contact_changes_the_mean_twist_alone() -> None:
    mean = 150.0
    wanted = forced_response(shaft_system(**TWO), ORDERS, 100.0, [0], TORQUE)
    found = solved([Coupling(0, clearance=0.01)], [-mean])
    for name in ("angle", "torque"):
        assert np.abs(found[name] - wanted[name]).max() < 1e-10 * np.abs(wanted[name]).max()
    np.testing.assert_allclose(found["coupling_mean_twist"], -mean / 2000.0 - 0.005, rtol=1e-12)
    assert CONTACTS[found["contact"][0]] == "keeps_contact"
    sticks = solved([Coupling(0, friction_torque=1e4, friction_stiffness=500.0)], [-mean])
    stiffer = shaft_system(**{**TWO, "stiffness": [2500.0]})
    wanted = forced_response(stiffer, ORDERS, 100.0, [0], TORQUE)
    assert np.abs(sticks["angle"] - wanted["angle"]).max() < 1e-9 * np.abs(wanted["angle"]).max()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("coupling", "law", "mean", "contact"),
    [
        (Coupling(0, *STAGES), odd, 60.0, "keeps_contact"),
        (Coupling(0, clearance=0.01), backlash(2000.0, 0.01), 80.0, "lifts_off"),
        (Coupling(0, clearance=0.01), backlash(2000.0, 0.01), 3.0, "rattles"),
    ],
    ids=["stages", "lifts off", "rattles"],
)
def test_two_discs_are_those_of_integration_in_time(
    coupling: Coupling, law: Callable[[Any], Any], mean: float, contact: str
) -> None:
    _, rest = linearised(coupling, -mean) if coupling.twist is not None else (
        0.0, -mean / 2000.0 - 0.005
    )  # fmt: skip
    speed = 70.0
    twist, torque = in_time(TWO, [law], mean, [float(rest)], speed)
    tolerance = 1e-4
    assert_same(solved([coupling], [-mean], speed, tolerance=tolerance), twist, torque, tolerance)
    assert CONTACTS[solved([coupling], [-mean], speed)["contact"][0]] == contact
    assert (twist.max() > 0.005) == (contact == "rattles")


@pytest.mark.slow
def test_three_discs_with_two_couplings_are_those_of_integration_in_time() -> None:
    system = {
        "inertia": [0.1, 0.05, 0.25], "stiffness": [2000.0, 8000.0], "damping": [2.0, 3.0],
        "disc_damping": [0.0, 0.5, 1.5],
    }  # fmt: skip
    stages, mesh = Coupling(0, *STAGES), Coupling(1, clearance=0.004)
    rest = [float(linearised(stages, -30.0)[1]), -30.0 / 8000.0 - 0.002]
    twist, torque = in_time(system, [odd, backlash(8000.0, 0.004)], 30.0, rest)
    tolerance = 1e-4
    found = solved([stages, mesh], [-30.0, -30.0], system=system, tolerance=tolerance)
    assert_same(found, twist, torque, tolerance)
    assert CONTACTS[found["contact"][1]] != "keeps_contact"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("coupling", "law"),
    [
        (Coupling(3, *GEARED_STAGES), lambda x: odd(x, GEARED_STAGES)),
        (Coupling(3, clearance=0.01), backlash(2e4, 0.01)),
        (Coupling(3, friction_torque=60.0, friction_stiffness=4e4), lambda x: 2e4 * x),
    ],
    ids=["stages", "clearance", "friction"],
)
def test_behind_a_gear_it_is_the_motion_in_time(
    coupling: Coupling, law: Callable[[Any], Any]
) -> None:
    """All discs in their own turns, by DOP853; gears hold by a constraint on their angles."""
    # Softer than `GEARED`, for fewer steps in time.
    system = {**GEARED, "loss_factor": 0.0, "stiffness": [4e4, 5e4, 4e4, 2e4, 3e4]}
    torque = 4.0 * np.tile(TORQUE, (3, 1)) * np.array([[1.0], [0.6], [0.8j]])
    mean, speed = -250.0, 60.0
    # Orders of the crank, and of the second gear, which turns 2.4 times as fast.
    of_crank, of_gear = (
        nonlinear_response(
            shaft_system(**system, crank=crank), [coupling], ORDERS / ratio, speed * ratio,
            [0, 1, 2], torque, [mean] * 5, period=4.0 * np.pi * ratio, tolerance=1e-4,
        )
        for crank, ratio in ((0, 1.0), (4, 2.4))
    )  # fmt: skip
    assert of_crank["status"] == of_gear["status"] == CONVERGED
    both = of_crank["coupling_extremes"], of_gear["coupling_extremes"]
    np.testing.assert_allclose(*both, atol=2e-4 * np.ptp(both[0]))
    least, largest, average = geared_in_time(system, coupling, law, torque, mean, speed)
    half = 0.5 * (largest - least)
    assert abs(both[0][0, 0] - least) < 2e-3 * half
    assert abs(both[0][0, 1] - largest) < 2e-3 * half
    assert of_crank["coupling_mean_twist"][0] == pytest.approx(average, rel=2e-3)


def test_departure_from_the_linear_form() -> None:
    """Within a piece nothing; beyond, by the other slope; friction by what it holds."""
    stages = Coupling(0, *STAGES)
    assert departure(stages, [10.0, -80.0], [5.0, 55.0]) == pytest.approx([0.0, 0.0], abs=1e-12)
    # From 10 N m by 20 N m: the last 10 N m at 3000 in place of 1000 N m/rad.
    assert departure(stages, 10.0, 20.0) == pytest.approx(20.0 / 20.0)
    gap = Coupling(0, [0.0, 1.0], [0.0, 2000.0], clearance=0.01)
    assert departure(gap, 60.0, 50.0) == pytest.approx(0.0, abs=1e-12)
    assert departure(gap, 60.0, 70.0) == pytest.approx(10.0 / 70.0)
    rubbing = Coupling(0, [0.0, 1.0], [0.0, 2000.0], 0.0, 20.0, 1e5)
    assert departure(rubbing, 60.0, [0.1, 50.0]) == pytest.approx([50.0, 0.4])


@pytest.mark.compiled
def test_dry_friction_loses_what_its_loop_holds() -> None:
    """4 F (x - F/k_f) a cycle of a twist that turns twice in it, at +-x."""
    limit, stick, speed = 8.0, 9000.0, np.linspace(40.0, 60.0, 5)
    coupling = Coupling(0, friction_torque=limit, friction_stiffness=stick)
    system = {**TWO, "damping": [0.0]}
    found = solved(
        [coupling], [-60.0], speed, system=system, orders=[2.0], torque=[[40.0]], tolerance=1e-5,
        wanted=("angle", "shaft_loss", "frame_loss", "twist_extremes"), twist=[(0, 1)],
    )  # fmt: skip
    assert (found["status"] == CONVERGED).all()
    x = 0.5 * (found["twist_extremes"][:, 0, 1] - found["twist_extremes"][:, 0, 0])
    wanted = 4.0 * limit * (x - limit / stick) * 2.0 * speed / (2.0 * np.pi)
    np.testing.assert_allclose(found["shaft_loss"][:, 0], wanted, rtol=1e-4)
    # Without a mean of its own, friction leaves the mean twist to the spring.
    np.testing.assert_allclose(found["coupling_mean_twist"][:, 0], -60.0 / 2000.0, rtol=1e-4)


@pytest.mark.compiled
@pytest.mark.parametrize(
    "coupling",
    [
        Coupling(0, *STAGES),
        Coupling(0, clearance=0.01),
        Coupling(0, friction_torque=20.0, friction_stiffness=8000.0),
        Coupling(0, *STAGES, 0.01, 10.0, 8000.0),
    ],
    ids=["stages", "clearance", "friction", "all"],
)
def test_work_is_what_is_lost(coupling: Coupling) -> None:
    speed = np.linspace(40.0, 160.0, 25)
    found = solved([coupling], [-60.0], speed, wanted=("angle", "shaft_loss", "frame_loss"))
    assert (found["status"] == CONVERGED).all()
    turning = 1j * ORDERS * speed[:, None] * found["angle"][:, 0]
    work = 0.5 * (TORQUE[0] * turning.conj()).real.sum(axis=-1)
    lost = found["shaft_loss"].sum(axis=-1) + found["frame_loss"]
    np.testing.assert_allclose(lost, work, rtol=1e-6)


@pytest.mark.slow
@pytest.mark.compiled
def test_a_cubic_spring_has_a_lasting_amplitude() -> None:
    """Duffing's equation: its first harmonic, within what one harmonic can tell (5 %)."""
    inertia, k, cubic, damping, size = 0.1 * 0.25 / 0.35, 2000.0, 2e6, 0.8, 8.0
    points = np.linspace(0.0, 0.2, 801)
    coupling = Coupling(0, points, k * points + cubic * points**3)
    system = {**TWO, "damping": [damping], "disc_damping": [0.0, 1e-9]}
    speed = np.linspace(150.0, 300.0, 151)

    def sizes(w: float) -> Any:
        """Amplitudes that fulfil (k + 3 a^2 cubic/4 - w^2 J)^2 a^2 + (c w a)^2 = M^2."""
        low, part = k - w**2 * inertia, 0.75 * cubic
        own = size * inertia / 0.1
        squares = np.roots([part**2, 2.0 * low * part, low**2 + (damping * w) ** 2, -(own**2)])
        real = squares.real[np.abs(squares.imag) < 1e-9 * np.abs(squares)]
        return np.sort(np.sqrt(real[real > 0.0]))

    found = solved([coupling], [0.0], speed, system=system, orders=[1.0], torque=[[size]])
    assert (found["status"] == CONVERGED).all()
    twist = 0.5 * np.ptp(found["coupling_extremes"][:, 0], axis=-1)
    amplitude = [np.interp(one, k * points + cubic * points**3, points) for one in twist]
    several = [i for i, w in enumerate(speed) if sizes(w).size == 3]
    assert len(several) > 20
    for w, one in zip(speed, amplitude, strict=True):
        near = np.abs(sizes(w) / one - 1.0)
        assert near.min() < 0.05
        # Never the middle one of three, which does not last.
        assert near.size == 1 or near.argmin() != 1


@pytest.mark.slow
@pytest.mark.compiled
def test_what_does_not_repeat_has_an_outcome_and_no_numbers() -> None:
    """Integration in time repeats after two cycles at 110 rad/s, which one cycle cannot hold."""
    system = {**TWO, "damping": [0.5]}
    found = solved([Coupling(0, *STAGES)], [0.0], 110.0, system=system)
    assert found["status"] == NO_STEADY_STATE
    assert np.isnan(found["torque"]).all()
    assert found["contact"] == -1
    with pytest.raises(AssertionError, match="does not repeat"):
        in_time(system, [odd], 0.0, [0.0], 110.0)


def test_a_twist_beyond_the_table_is_invalid() -> None:
    short = Coupling(0, [0.0, 0.02, 0.04], [0.0, 20.0, 80.0])
    found = solved([short], [[-60.0], [-90.0]])
    assert (found["status"] == INVALID_INPUT).all()
    assert np.isnan(found["coupling_extremes"]).all()
    unknown = solved([Coupling(0, *STAGES)], [np.nan])
    assert unknown["status"] == INVALID_INPUT
    assert np.isnan(unknown["torque"]).all()


@pytest.mark.compiled
def test_cases_agree_bit_for_bit_one_by_one_and_on_threads() -> None:
    speed, clearance = np.linspace(60.0, 150.0, 13)[:, None], np.array([0.0, 0.004, 0.01])
    friction = Coupling(0, *STAGES, clearance, 5.0, 6000.0)
    many = solved([friction], [-40.0], speed, threads=3)
    assert many["torque"].shape == (13, 3, 1, 4)
    for i, j in ((0, 0), (6, 2), (12, 1)):
        one = solved([Coupling(0, *STAGES, clearance[j], 5.0, 6000.0)], [-40.0], speed[i, 0])
        for name, values in one.items():
            np.testing.assert_array_equal(values, many[name][i, j])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"couplings": []}, "couplings: must be at least one"),
        ({"couplings": [Coupling(1)]}, r"couplings\[0\] shaft = 1: must be a shaft, from 0 to 0"),
        ({"couplings": [Coupling(0), Coupling(0)]}, r"couplings\[1\] shaft = 0: has a coupling"),
        ({"couplings": [Coupling(0, clearance=-1.0)]}, "clearance = -1: must not be below 0"),
        (
            {"couplings": [Coupling(0, friction_torque=3.0)]},
            "friction_stiffness = 0: must be above 0 beside a friction_torque",
        ),
        (
            {"couplings": [Coupling(0, [0.0, 1.0], [0.0, 1.0, 2.0])]},
            "torque: 3 values over 2 of twist: must be as many, at least 2",
        ),
        (
            {"couplings": [Coupling(0, [0.0, 1.0, 2.0], [0.0, 2.0, 1.0])]},
            r"torque\[2\] = 1: must be above the value before, 2",
        ),
        (
            {"couplings": [Coupling(0, [1.0, 2.0], [1.0, 2.0], 0.1)]},
            "torque: must be 0 at a twist of 0, which clearance is around",
        ),
        ({"tolerance": 0.0}, "tolerance = 0: must be above 0"),
        (
            {"system": {**TWO, "stiffness": [0.0]}},
            r"stiffness\[0\]: must be above 0, that of the coupling's linear form",
        ),
        ({"torque": [[1.0]]}, r"torque: shape \(1, 1\): must end with 1 throws and 4 orders"),
        ({"mean": [1.0, 2.0]}, r"mean_torque: shape \(2,\): must end with 1 shafts"),
        ({"mean": 1.0}, r"mean_torque: shape \(\): must end with 1 shafts"),
        ({"orders": [0.5, 1.0, 1.7, 2.0]}, "orders: 1.7: must have whole periods in the cycle"),
        ({"throws": [2]}, "throws: 2: must be a disc, from 0 to 1"),
    ],
)
def test_what_does_not_fit_is_refused(change: dict[str, Any], message: str) -> None:
    given = {"couplings": [Coupling(0)], "mean": [-1.0]} | change
    with pytest.raises(ValueError, match=f"^{message}"):
        solved(given.pop("couplings"), given.pop("mean"), **given)
