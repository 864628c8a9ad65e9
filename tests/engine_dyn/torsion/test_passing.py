"""Passing a range of speeds, against time integration, exact functions and steady running."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.integrate import cumulative_simpson, simpson, solve_ivp
from scipy.interpolate import CubicSpline
from scipy.special import wofz

from engine_dyn.status import CONVERGED, NO_STEADY_STATE, NOT_CONVERGED
from engine_dyn.torsion.forced import _respond, forced_response
from engine_dyn.torsion.modes import modal_roots, natural_modes
from engine_dyn.torsion.passing import AtNodes, node_speeds, passing, passing_history
from engine_dyn.torsion.ramp import advanced, largest_torques
from engine_dyn.torsion.shaft import pendulum
from engine_dyn.torsion.synthesis import half_range
from engine_dyn.torsion.system import ShaftSystem, matrices, shaft_system
from tests.support.shafts import DIESEL, DIESEL_NODES

ERROR = 1e-3  # Of the largest half range: what the docstring of `passing` states
ENERGY = 5e-3  # Of the loss: five times the stated error, since it adds up over the pass

ONE: dict[str, Any] = {"inertia": [1e6, 1.0], "stiffness": [1e4], "damping": [2.0]}
"""A disc of 1 kg m2 at 100 rad/s, damping ratio 0.01, on one that hardly moves."""

FREE: dict[str, Any] = {"inertia": [1e6, 1.0], "stiffness": [1e4]}
"""The same without damping: its resonance lies in the middle of a ramp from 60 to 140 rad/s."""

THREE: dict[str, Any] = {
    "inertia": [2.0, 3.0, 10.0],
    "stiffness": [4e5, 6e5],
    "damping": [30.0, 20.0],
}

GEARED: dict[str, Any] = {
    "inertia": [2.0, 3.0, 0.5, 1.0, 4.0, 0.8],
    "stiffness": [9e5, 5e5, 1e5, 2e4],
    "shafts": [(0, 1), (1, 2), (3, 4), (0, 5)],
    "damping": [40.0, 20.0, 15.0, 300.0],
    "disc_damping": [1.0, 0.0, 0.0, 0.0, 2.0, 0.0],
    "meshes": [(2, 3)],
    "ratios": [-2.4],
}
"""A ring in a stiff damper, whose mode is overdamped, and a disc behind a gear."""

NINE: dict[str, Any] = {**DIESEL, "loss_factor": 0.0, "damping": 8.0}

SIX = np.arange(0.5, 3.25, 0.5)


def some_torques(throws: int, orders: Any, seed: int = 1) -> Any:
    values = np.random.default_rng(seed).normal(size=(2, throws, np.size(orders)))
    return 300.0 * (values[0] + 1j * values[1]) / np.asarray(orders)


def followed(
    system: ShaftSystem, orders: Any, start: float, end: float, rate: float, throws: Any,
    torque: Any, power: int, times: Any,
) -> Any:  # fmt: skip
    """Torques in the shafts over time, by integration of all nodes; shape (times, S)."""
    inertia, stiffness, _, damping = matrices(system)
    nodes, alpha, nu = inertia.size, math.copysign(rate, end - start), np.asarray(orders)
    acting = np.zeros((nodes, len(throws)))
    for i, disc in enumerate(throws):
        acting[system.node_of_disc[disc], i] += system.ratio[disc]
    forces, state = acting @ torque, np.zeros((2, nodes), dtype=complex)
    for v, order in enumerate(nu):
        w = order * start
        dynamic = stiffness + 1j * w * damping - w**2 * np.diag(inertia)
        angle = np.linalg.solve(dynamic, forces[:, v] * start**power)
        state += np.array([angle, 1j * w * angle])

    def slope(time: float, now: Any) -> Any:
        omega, phi = start + alpha * time, (start + 0.5 * alpha * time) * time
        acts = (forces @ np.exp(1j * nu * phi)).real * omega**power
        return np.concatenate(
            [now[nodes:], (acts - stiffness @ now[:nodes] - damping @ now[nodes:]) / inertia]
        )

    now = solve_ivp(
        slope, (0.0, times[-1]), state.real.ravel(), "DOP853", times, rtol=1e-10, atol=1e-13
    ).y
    node = system.node_of_shaft
    twist, turning = (now[i:][node] - now[i:][system.parent[node]] for i in (0, nodes))
    held = system.stiffness[node, None] * twist + system.damping[node, None] * turning
    return (system.shaft_factor[:, None] * held).T


PASSAGES: list[tuple[Any, ...]] = [
    (ONE, [1.0], (60.0, 160.0), 30.0, [1]), (ONE, [1.0], (60.0, 160.0), 200.0, [1]),
    (FREE, [1.0, 2.0], (60.0, 140.0), 100.0, [1]),
    (THREE, SIX, (60.0, 260.0), 100.0, [0, 1]), (GEARED, SIX, (100.0, 200.0), 60.0, [0, 1, 4]),
    (NINE, np.arange(3.0, 12.25, 0.5), (100.0, 140.0), 25.0, DIESEL_NODES),
]  # fmt: skip


# Every pair of a passage, a direction and a power of the speed.
@pytest.mark.parametrize(
    ("shaft", "orders", "speeds", "rate", "throws", "upwards", "power"),
    [
        (*one, upwards, power)
        for number, one in enumerate(PASSAGES)
        for upwards, power in zip((True, False), ((0, 2), (2, 0))[number % 2], strict=True)
    ],
)
@pytest.mark.compiled
def test_torques_over_time_are_those_of_an_integration(
    shaft: dict[str, Any], orders: Any, speeds: tuple[float, float], rate: float, throws: Any,
    upwards: bool, power: int,
) -> None:  # fmt: skip
    system = shaft_system(**shaft)
    start, end = speeds if upwards else speeds[::-1]
    torque = some_torques(len(throws), orders)
    given: tuple[Any, ...] = (system, orders, start, end, rate, throws, [torque], [1.0], [power])
    found, history = passing(*given), passing_history(*given)
    exact = followed(system, orders, start, end, rate, throws, torque, power, history.time)
    angle = history.time * 0.5 * (start + history.speed)
    turning = np.exp(1j * angle[:, None] * np.asarray(orders))
    mine = np.einsum("tsv,tv->ts", history.torque, turning).real
    assert found["status"] == CONVERGED
    assert (np.abs(mine - exact).max(axis=0) < ERROR * found["half_range"]).all()
    # The largest half range is that of some cycle with the orders of some time.
    cycle = np.exp(1j * np.linspace(0.0, 4.0 * np.pi, 500) * np.asarray(orders)[:, None])
    largest = 0.5 * np.ptp((history.torque @ cycle).real, axis=-1).max(axis=0)
    assert found["half_range"] == pytest.approx(largest, rel=0.02)
    assert (found["half_range"] > (1.0 - ERROR) * largest).all()


@pytest.mark.parametrize("upwards", [True, False], ids=["up", "down"])
@pytest.mark.compiled
def test_energy_is_balanced_in_passing(upwards: bool) -> None:
    """Work of the excitation = change of energy + loss, with speeds from the torques alone."""
    system, torque = shaft_system(**THREE), some_torques(2, SIX)
    start, end = (60.0, 260.0) if upwards else (260.0, 60.0)
    history = passing_history(system, SIX, start, end, 50.0, [0, 1], torque, samples=3.0)
    time = np.linspace(0.0, history.time[-1], 200_001)
    angle = (start + math.copysign(25.0, end - start) * time) * time
    turning = np.exp(1j * angle[:, None] * SIX)
    within = CubicSpline(history.time, history.torque)(time)
    held = np.einsum("tsv,tv->ts", within, turning).real
    acting = np.zeros((time.size, 3))
    acting[:, :2] = (turning @ torque.T).real
    inertia, stiffness, damping = (np.array(THREE[k]) for k in ("inertia", "stiffness", "damping"))
    first = forced_response(system, SIX, start, [0, 1], torque, wanted=("angle",))["angle"]
    # A shaft pulls its first disc, and the second one back.
    pull = np.pad(held, [(0, 0), (0, 1)]) - np.pad(held, [(0, 0), (1, 0)])
    rate = (1j * SIX * start * first).sum(axis=1).real
    rate = rate + cumulative_simpson((acting + pull) / inertia, x=time, axis=0, initial=0.0)
    turned = np.diff(rate, axis=1)
    stored = 0.5 * (held - damping * turned) ** 2 / stiffness
    energy = 0.5 * (inertia * rate**2).sum(axis=1) + stored.sum(axis=1)
    work, loss = (
        simpson(power, x=time)
        for power in ((acting * rate).sum(axis=1), (damping * turned**2).sum(axis=1))
    )
    assert loss > 0.0
    assert abs(work - (energy[-1] - energy[0]) - loss) < ENERGY * loss


def test_steps_are_of_fourth_order_and_the_exact_function() -> None:
    """Of constant G, from long before: sqrt(pi/(4 a)) w(i d/(2 sqrt a)), a = -d'/2 (Lewis)."""
    turn, damping, span = 40.0j, 0.8, 1.5

    def exact(d: complex) -> complex:
        a = -0.5 * turn
        return complex(0.5 * np.sqrt(np.pi / a) * wofz(0.5j * d / np.sqrt(a)))

    errors = []
    for count in (40, 80, 160):
        h, start = 2.0 * span / count, damping - turn * span
        q = exact(start)
        for step in range(count):
            q = advanced(q, start + turn * h * (step + 0.5), turn, h, 1.0, 0.0, 0.0)
        errors.append(abs(q - exact(damping + turn * span)))
    assert errors[-1] < 1e-7
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (np.abs(orders - 4.0) < 0.2).all()


@pytest.mark.parametrize("d", [3.0 + 4.0j, 0.2 + 0.3j, 1e-9j, 0.0j])
def test_a_step_of_a_constant_mode_is_exact_for_parabolas(d: complex) -> None:
    h, force = 1.1, np.polynomial.Polynomial([0.3 + 1j, -2.0, 0.7j])
    node, weight = np.polynomial.legendre.leggauss(40)
    u = 0.5 * h * node
    added = (np.exp(-d * (0.5 * h - u)) * force(u) * weight).sum() * 0.5 * h
    found = advanced(2.0 - 1j, d, 0.0j, h, force(0.0), force.deriv()(0.0), force.deriv(2)(0.0))
    assert abs(found - (2.0 - 1j) * np.exp(-d * h) - added) < 1e-11


@pytest.mark.parametrize("beta", [4.0, 16.0])
def test_an_undamped_mode_has_the_magnifier_of_lewis(beta: float) -> None:
    """3.67 sqrt(q), q = f^2/(df/dt), in the limit of slow ramps: here within 2 percent."""
    system = shaft_system([1e9, 1.0], [1e4])
    found = passing(system, [1.0], 20.0, 180.0, beta, [1], [[1.0]])["half_range"][0]
    q = (100.0 / (2.0 * np.pi)) ** 2 / (beta / (2.0 * np.pi))
    assert found == pytest.approx(3.67 * math.sqrt(q), rel=0.02)


def magnifier_of_lewis(q: float, zeta: float) -> float:
    """Largest magnifier of one mode in passing, of slow ramps; derived, as Lewis prints curves.

    Near its resonance a mode omega_m has x = exp(i phi) Q with Q' = -(zeta omega_m + i alpha t) Q
    + 1/(2 i omega_m) from long before, so that omega_m^2 Q is Fresnel's integral in the complex
    plane, pi/2 sqrt(q) w(i d/(2 sqrt(a))), a = -i alpha/2, d = zeta omega_m + i alpha t: w is
    Faddeeva's function. With s = sqrt(alpha) t only q and zeta sqrt(2 pi q) count. Beside the
    largest magnifier of steady running, 1/(2 zeta), only their product zeta sqrt(q) does.
    """
    s = np.linspace(-3.0, 30.0, 33001)
    d = zeta * math.sqrt(2.0 * math.pi * q) + 1j * s
    values = wofz(0.5j * d / np.sqrt(-0.5j))
    return float(0.5 * math.pi * math.sqrt(q) * np.abs(values).max())


def error_function(z: Any, scale: Any, rest: Any) -> tuple[Any, Any]:
    """exp(scale) erf(z) as a difference of two: erf(z) = s - s exp(-z^2) w(i s z), s sign of Re z.

    `rest` is scale - z^2.
    """
    side = np.where(np.real(z) >= 0.0, 1.0, -1.0)
    return side * np.exp(scale), side * np.exp(rest) * wofz(1j * side * z)


def passed_exactly(start: float, alpha: float, omega: float, zeta: float, times: Any) -> Any:
    """Angle of a mode under cos(phi) times omega^2, from steady running, in closed form.

    Duhamel's integral, int_0^t exp(r (t - u) + i phi(u)) du, is an error function for both roots r.
    """
    phi, damped = (start + 0.5 * alpha * times) * times, omega * math.sqrt(1.0 - zeta**2)
    steady = 1.0 / (omega**2 - start**2 + 2j * zeta * omega * start)
    found = np.zeros(times.shape, dtype=complex)
    slope = np.sqrt(-0.5j * alpha)
    for sign in (1.0, -1.0):
        root, other = (complex(-zeta * omega, side * damped) for side in (sign, -sign))
        middle = 0.5 * (1j * start - root) / slope
        scale = middle**2 + root * times
        far = error_function(slope * times - middle, scale, 1j * phi)
        near = error_function(-middle, scale, root * times)
        integral = (far[0] - near[0]) - (far[1] - near[1])
        found += 0.5 * math.sqrt(math.pi) / slope * integral / (2j * sign * damped)
        found += steady * (1j * start - other) / (2j * sign * damped) * np.exp(root * times)
    return omega**2 * found


LEWIS = [
    (q, zeta, upwards)
    for q in (30.0, 100.0, 400.0)
    for zeta in (0.0, 0.003, 0.01, 0.03, 0.1)
    for upwards in (True, False)
]


@pytest.mark.parametrize(("q", "zeta", "upwards"), LEWIS)
def test_a_damped_mode_passes_as_lewis_found(q: float, zeta: float, upwards: bool) -> None:
    """Amplitude over that at rest, for q = f^2/(df/dt) and a damping ratio zeta."""
    omega, inertia = 100.0, 1.0
    rate = omega**2 / (2.0 * math.pi * q)
    system = shaft_system(
        [1e12, inertia], [inertia * omega**2], disc_damping=[0.0, 2.0 * zeta * omega * inertia]
    )  # fmt: skip
    start, end = (60.0, 150.0) if upwards else (150.0, 60.0)
    found = float(passing(system, [1.0], start, end, rate, [1], [[1.0]])["half_range"][0])
    times = np.linspace(0.0, 90.0 / rate, 20_001)
    alpha = rate if upwards else -rate
    exact = np.abs(passed_exactly(start, alpha, omega, zeta, times)).max()
    assert found == pytest.approx(exact, rel=ERROR)
    if q >= 100.0:
        assert found == pytest.approx(magnifier_of_lewis(q, zeta), rel=0.02)


@pytest.mark.parametrize("start", [100.0, 200.0])
@pytest.mark.compiled
def test_a_slow_ramp_finds_the_largest_of_steady_running(start: float) -> None:
    system, end = shaft_system(**DIESEL), 300.0 - start
    orders = np.arange(0.5, 12.25, 0.5)
    torque = some_torques(6, orders)
    found = passing(system, orders, start, end, 0.05, DIESEL_NODES, torque)
    speeds = np.linspace(100.0, 200.0, 4001)
    steady = half_range(
        forced_response(
            system, orders, speeds, DIESEL_NODES, torque, wanted=("torque_extremes",)
        )["torque_extremes"]
    )  # fmt: skip
    assert found["half_range"] == pytest.approx(steady.max(axis=0), rel=ERROR)
    apart = np.abs(found["speed"] - speeds[steady.argmax(axis=0)])
    assert (apart < 0.5).all()


@pytest.mark.parametrize("loss_factor", [0.0, 0.002, 0.035])
@pytest.mark.parametrize("rate", [10.0, 100.0])
@pytest.mark.compiled
def test_little_remains_between_samples(loss_factor: float, rate: float) -> None:
    draw, count = np.random.default_rng(2), 8
    inertia = np.array(DIESEL["inertia"]) * draw.uniform(0.9, 1.1, (count, 9))
    changed = {"inertia": inertia, "loss_factor": loss_factor, "disc_damping": 0.0}
    system, orders = shaft_system(**{**DIESEL, **changed}), np.arange(0.5, 12.25, 0.5)
    torque = draw.normal(size=(2, count, 6, orders.size)) / (1.0 + orders**2)
    start, end = (130.0, 155.0) if loss_factor == 0.0 else (100.0, 180.0)
    acting = torque[0] + 1j * torque[1]
    given: tuple[Any, ...] = (system, orders, start, end, rate, DIESEL_NODES, acting)
    found, fine = (passing(*given, samples=samples)["half_range"] for samples in (1.0, 6.0))
    assert found == pytest.approx(fine, rel=ERROR)


@pytest.mark.compiled
@pytest.mark.parametrize("seed", [5, 7])
def test_a_peak_near_the_end_of_a_ramp_is_not_beyond_its_neighbours(seed: int) -> None:
    # Samples lie closer and closer there: the top of a parabola may be on either side.
    draw, count = np.random.default_rng(seed), 100
    inertia = np.array(DIESEL["inertia"]) * draw.uniform(0.9, 1.1, (count, 9))
    system, orders = shaft_system(**{**DIESEL, "inertia": inertia}), np.arange(0.5, 12.25, 0.5)
    torque = draw.normal(size=(2, 6, orders.size)) * 400.0 / (1.0 + orders**2)
    given: tuple[Any, ...] = (
        system, orders, 84.0, 209.0, 10.0 ** draw.uniform(-0.7, 0.7, count), DIESEL_NODES,
        torque[0] + 1j * torque[1],
    )  # fmt: skip
    found, fine = (passing(*given, samples=samples)["half_range"] for samples in (1.0, 2.0))
    assert found == pytest.approx(fine, rel=ERROR)


@pytest.mark.compiled
def test_designs_broadcast_and_do_not_depend_on_their_company() -> None:
    inertia = np.array(THREE["inertia"]) * np.linspace(0.9, 1.1, 70)[:, None, None]
    system = shaft_system(**{**THREE, "inertia": inertia})
    torque, rates = some_torques(2, SIX), np.array([20.0, 90.0])
    all_ = passing(system, SIX, 100.0, 200.0, rates, [0, 1], torque, threads=2)
    assert all_["half_range"].shape == all_["speed"].shape == (70, 2, 2)
    for i, j in ((0, 0), (69, 1)):
        one = shaft_system(**{**THREE, "inertia": inertia[i, 0]})
        alone = passing(one, SIX, 100.0, 200.0, rates[j], [0, 1], torque)
        for name in ("half_range", "speed"):
            assert alone[name] == pytest.approx(all_[name][i, j], rel=1e-9)


@pytest.mark.compiled
def test_a_table_over_speed_is_the_power_that_it_has() -> None:
    system, torque = shaft_system(**THREE), some_torques(2, SIX)
    table = AtNodes(torque * 1e-4 * node_speeds(60.0, 250.0)[:, None, None] ** 2)
    found = passing(system, SIX, 60.0, 250.0, 50.0, [0, 1], table)
    powers = passing(system, SIX, 60.0, 250.0, 50.0, [0, 1], [torque], [1e-4], [2])
    assert found["half_range"] == pytest.approx(powers["half_range"], rel=1e-9)


def test_equal_branches_have_the_torque_that_one_has() -> None:
    """Two equal branches: their modes have one frequency, and one of them is not excited."""
    two = shaft_system(
        [5.0, 1.0, 1.0], [1e4, 1e4], [(0, 1), (0, 2)], damping=1.0, ground_stiffness=[1e5, 0, 0]
    )  # fmt: skip
    both = shaft_system([5.0, 2.0], [2e4], damping=[2.0], ground_stiffness=[1e5, 0.0])
    given: tuple[Any, ...] = ([1.0], 50.0, 200.0, 20.0, [0], [[10.0]])
    found, joined = (passing(system, *given)["half_range"] for system in (two, both))
    assert found == pytest.approx(0.5 * joined[[0, 0]], rel=1e-6)


@pytest.mark.parametrize("modal_damping", [(), (0.01, 0.03)])
def test_roots_answer_any_frequency(modal_damping: tuple[float, ...]) -> None:
    """Residues of all roots, with conjugates where they swing, are the steady response."""
    system = shaft_system(**GEARED, modal_damping=modal_damping)
    root, left, right = modal_roots(system, [4], all_roots=True)
    parts, pairs = left * right, root.imag > 0.1 * np.abs(root)
    for w in (3.0, 170.0, 2e3):
        total = (parts / (1j * w - root)[:, None])[np.abs(root) > 1e-9].sum(axis=0)
        total += (parts.conj() / (1j * w - root.conj())[:, None])[pairs].sum(axis=0)
        steady = forced_response(system, [1.0], w, [4], [[1.0]])["torque"][:, 0]
        assert np.abs(total - steady).max() < 1e-9 * np.abs(steady).max()


def test_what_starts_at_an_undamped_resonance_has_no_steady_state() -> None:
    system = shaft_system([1.0, 1.0], [1e4])
    start = [natural_modes(system).omega[0], 100.0]
    found = passing(system, [1.0], start, 200.0, 10.0, [0], [[1.0]])
    assert found["status"].tolist() == [NO_STEADY_STATE, CONVERGED]
    assert np.isnan(found["half_range"][0]).all()
    assert np.isfinite(found["half_range"][1]).all()


def test_a_ramp_too_fast_or_too_long_has_an_outcome_and_no_value() -> None:
    """Both were followed before: one to a torque beyond all bounds, the other for hours."""
    two = shaft_system([10.0, 10.0], [1e6], loss_factor=0.01)
    ends, rates = [90.0, 90.0, 1e11], [5.0, 1e11, 5.0]
    found = passing(two, [0.5, 6.0], 60.0, ends, rates, [0], [[400.0, 1000.0]])
    assert_array_equal(found["status"], [CONVERGED, NOT_CONVERGED, NOT_CONVERGED])
    alone = passing(two, [0.5, 6.0], 60.0, 90.0, 5.0, [0], [[400.0, 1000.0]])
    for name in ("half_range", "speed"):
        assert_array_equal(found[name][:, 0], [alone[name][0], np.nan, np.nan])


def test_wrong_input_is_named() -> None:
    system, torque = shaft_system(**ONE), [[1.0]]
    made = pendulum(0.1, 0.1, 0.02)
    swinging = shaft_system([1.0, made.inertia], [0.0], speed_stiffness=[made.speed_stiffness])
    for message, given in {
        "rate: -1: must be above 0": (system, [1.0], 1.0, 2.0, -1.0, [0], torque),
        "start: 0: must be above 0": (system, [1.0], 0.0, 2.0, 1.0, [0], torque),
        "end: must differ from start": (system, [1.0], 2.0, 2.0, 1.0, [0], torque),
        "must end with 1, 2": (system, [1.0, 2.0], 1.0, 2.0, 1.0, [0], torque),
        "factors: 1: must be as many": (system, [1.0], 1.0, 2.0, 1.0, [0], [torque] * 2, [1.0]),
        "speed_stiffness: must be 0": (swinging, [1.0], 1.0, 2.0, 1.0, [0], torque),
        "must end with 17, 1, 1": (system, [1.0], 1.0, 4.0, 1.0, [0], AtNodes([torque] * 2)),
    }.items():  # fmt: skip
        with pytest.raises(ValueError, match=message):
            passing(*given)


@pytest.mark.compiled
def test_any_number_of_passes_and_designs_share_the_compiled_kernels() -> None:
    """They were compiled again for arrays of another layout, or that may be written to."""
    many = shaft_system(**{**THREE, "inertia": [[2.0, 3.0, 10.0], [2.5, 3.0, 9.0]]})
    torque = some_torques(1, SIX)
    counts = set()
    for system in (shaft_system(**THREE), many, many.of(np.array([1])), many.of(np.array([1, 0]))):
        forced_response(system, SIX, 100.0, [0], torque, wanted=("torque", "torque_extremes"))
        passing(system, SIX, 60.0, 90.0, 5.0, [0], torque)
        counts.add((len(_respond._whole.overloads), len(largest_torques._whole.overloads)))
    assert len(counts) == 1, counts
