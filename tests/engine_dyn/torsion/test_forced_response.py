"""The response to each order, its losses and its extremes over the cycle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from engine_dyn.status import CONVERGED, NO_STEADY_STATE
from engine_dyn.torsion.forced import RESULTS, forced_response
from engine_dyn.torsion.modes import natural_modes
from engine_dyn.torsion.shaft import pendulum
from engine_dyn.torsion.synthesis import half_range
from engine_dyn.torsion.system import shaft_system
from tests.support.shafts import (
    DIESEL,
    DIESEL_NODES,
    DIESEL_SPEED,
    dense,
    diesel_torques,
)
from tests.support.tools import tool

published = tool("published_shafts")

BRANCHED: dict[str, Any] = {
    "inertia": [0.02, 0.05, 0.05, 1.5, 0.3, 0.1, 4.0, 0.06, 0.7],
    "stiffness": [9e5, 1.2e6, 8e5, 3e5, 0.0, 2e4, 6e5],
    "shafts": [(1, 0), (1, 2), (2, 3), (6, 5), (0, 7), (3, 8), (4, 5)],
    "loss_factor": [0.03, 0.03, 0.03, 0.01, 0.0, 0.15, 0.02],
    "damping": [0.0, 1.0, 0.0, 0.5, 20.0, 0.0, 0.0],
    "disc_damping": [0.0, 2.0, 2.0, 0.0, 0.5, 0.0, 30.0, 0.0, 1.0],
    "ground_stiffness": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 5e3, 0.0, 0.0],
    "meshes": [(3, 4)],
    "ratios": [-2.4],
}
"""A crank with a viscous ring, a rubber coupling, and a generator behind a gear."""

ORDERS = np.arange(0.5, 12.25, 0.5)


def torques(throws: int, seed: int = 1) -> Any:
    """Harmonics of some torques, falling with the order."""
    draw = np.random.default_rng(seed)
    values = draw.normal(size=(2, throws, ORDERS.size))
    return 500.0 * (values[0] + 1j * values[1]) / (1.0 + ORDERS**2)


def solved(system: dict[str, Any], throws: Any, speed: Any, torque: Any, **more: Any) -> Any:
    return forced_response(
        shaft_system(**system), ORDERS[: np.shape(torque)[-1]], speed, throws, torque, **more
    )


@pytest.mark.parametrize("system", [DIESEL, BRANCHED], ids=["chain", "geared tree"])
@pytest.mark.parametrize("crank", [0, 2])
def test_it_is_the_dense_solution(system: dict[str, Any], crank: int) -> None:
    throws, speed = (1, 2, 4), 190.0
    torque = torques(3)
    found = solved({**system, "crank": crank}, throws, speed, torque)
    for v, order in enumerate(ORDERS):
        forces = np.zeros(9, dtype=complex)
        forces[list(throws)] = torque[:, v]
        angle, shaft = dense(order * speed, forces, **system)
        for mine, other in ((found["angle"], angle), (found["torque"], shaft)):
            assert np.abs(mine[:, v] - other).max() < 1e-12 * np.abs(other).max()
    assert found["status"] == CONVERGED


@st.composite
def trees(draw: Any) -> dict[str, Any]:
    """Damped systems of any form, their discs numbered in any order."""
    count = draw(st.integers(1, 12))
    pick = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    name = pick.permutation(count)
    joined: tuple[list[Any], list[Any]] = [], []
    for disc in range(1, count):
        pair = (int(name[disc]), int(name[pick.integers(disc)]))
        joined[pick.random() < 0.25].append(pair if pick.random() < 0.5 else pair[::-1])
    shafts, meshes = joined
    return {
        "inertia": 10.0 ** pick.uniform(-2.0, 1.0, count),
        "stiffness": 10.0 ** pick.uniform(3.0, 6.0, len(shafts)),
        "shafts": shafts,
        "loss_factor": pick.uniform(0.01, 0.2, len(shafts)),
        "damping": pick.uniform(0.0, 50.0, len(shafts)),
        "disc_damping": pick.uniform(0.0, 5.0, count),
        "ground_stiffness": np.where(pick.random(count) < 0.2, 1e4, 0.0),
        "meshes": meshes,
        "ratios": pick.choice([-3.0, -0.4, 1.0, 2.0], len(meshes)),
        "crank": int(pick.integers(count)),
    }


@given(trees())
def test_any_tree_has_the_dense_solution(system: dict[str, Any]) -> None:
    count, orders = len(system["inertia"]), np.array([0.5, 1.0, 6.0])
    torque = torques(count)[:, :3]
    found = forced_response(shaft_system(**system), orders, 130.0, range(count), torque)
    known = {name: value for name, value in system.items() if name != "crank"}
    for v, order in enumerate(orders):
        angle, shaft = dense(order * 130.0, torque[:, v], **known)
        # Gears and cranks far behind gears make the dense matrix the worse of the two.
        np.testing.assert_allclose(found["angle"][:, v], angle, atol=1e-9 * np.abs(angle).max())
        if shaft.size:
            most = np.abs(shaft).max()
            np.testing.assert_allclose(found["torque"][:, v], shaft, atol=1e-9 * most)


@pytest.mark.compiled
@pytest.mark.quick
def test_cases_agree_bit_for_bit_one_by_one_and_on_threads() -> None:
    """Designs, speeds, loads and masses, each on an axis of its own."""
    stiffness = np.array(DIESEL["stiffness"]) * np.linspace(0.8, 1.2, 3)[:, None]
    system = shaft_system(**{**DIESEL, "stiffness": stiffness[:, None, None, None]})
    speed = np.linspace(100.0, 250.0, 200)[:, None, None]
    gas = diesel_torques() * np.array([0.3, 1.0])[:, None, None, None]
    mass = torques(6) * np.array([1e-4, 2e-4, 3e-4])[:, None, None]
    more: Any = {
        "wanted": tuple(RESULTS), "twist": [(8, 0), (2, 7)],
    }  # fmt: skip
    parts = [gas, mass], [1.0, speed**2]
    many = forced_response(system, ORDERS, speed, DIESEL_NODES, *parts, threads=3, **more)
    assert many["torque"].shape == (3, 200, 2, 3, 8, 24)
    assert many["twist_extremes"].shape == (3, 200, 2, 3, 2, 3)
    for i, j, k, n in ((0, 0, 0, 0), (2, 199, 1, 2), (1, 77, 0, 1)):
        one = forced_response(
            shaft_system(**{**DIESEL, "stiffness": stiffness[i]}), ORDERS, speed[j, 0, 0],
            DIESEL_NODES, [gas[k, 0], mass[n]], [1.0, speed[j, 0, 0] ** 2], **more,
        )  # fmt: skip
        for name, values in many.items():
            np.testing.assert_array_equal(values[i, j, k, n], one[name], err_msg=name)


@pytest.mark.parametrize("system", [DIESEL, BRANCHED], ids=["chain", "geared tree"])
def test_power_put_in_is_lost(system: dict[str, Any]) -> None:
    """1/2 Re(U conj(i omega theta)), summed over orders, is what shafts and discs lose."""
    throws, speed, torque = (1, 2, 4), 165.0, torques(3)
    found = solved(system, throws, speed, torque, wanted=("angle", "shaft_loss", "frame_loss"))
    rate = 1j * ORDERS * speed * found["angle"][list(throws)]
    put_in = 0.5 * (torque * rate.conj()).real.sum()
    assert found["shaft_loss"].sum() + found["frame_loss"] == pytest.approx(put_in, rel=1e-12)
    assert (found["shaft_loss"] > 0.0).all()


def test_a_stiff_shaft_turns_as_one() -> None:
    """theta = sum U/(-w^2 sum J + i w sum c); the difference falls as 1/stiffness.

    The numbers are those of another program, order 3 at 1000 rpm.
    """
    speed, torque = 1000.0 * np.pi / 30.0, diesel_torques()
    w = ORDERS * speed
    inertia, damping = np.sum(DIESEL["inertia"]), np.sum(DIESEL["disc_damping"])
    rigid = torque.sum(axis=0) / (-(w**2) * inertia + 1j * w * damping)
    major = [np.searchsorted(ORDERS, order) for order in (3.0, 6.0, 9.0, 12.0)]
    differences = []
    for scale in (1.0, 1e2, 1e4, 1e6, 1e12):
        stiff = {**DIESEL, "stiffness": np.array(DIESEL["stiffness"]) * scale}
        found = solved(stiff, DIESEL_NODES, speed, torque)["angle"][8]
        differences.append(abs(found[major[0]] / rigid[major[0]] - 1.0))
        if scale == 1e12:
            np.testing.assert_allclose(found[major], rigid[major], rtol=1e-10)
    np.testing.assert_allclose(differences[:3], [0.0445285, 0.000422465, 4.2225e-6], rtol=1e-4)
    assert differences[3] == pytest.approx(4.2225e-8, rel=1e-3)


def test_equal_discs_damped_and_forced() -> None:
    """Closed form of a chain of n equal discs, U on disc m, derived from its recurrence.

    theta_j = -U cos((min(j, m) - 1/2) b) cos((n - max(j, m) + 1/2) b)/(k* sin b sin(n b)),
    cos b = 1 - (w^2 J - i w c)/(2 k*).
    """
    count, inertia, stiffness, eta, relative, own = 6, 0.04, 1.2e6, 0.02, 5.0, 2.0
    speed = 2.0 * np.pi * 150.0
    for m in (1, 4):
        found = forced_response(
            shaft_system(
                np.full(count, inertia), stiffness, loss_factor=eta, damping=relative,
                disc_damping=own,
            ),
            [1.0, 3.0, 7.0], speed, [m - 1], np.full((1, 3), 1000.0),
        )["angle"]  # fmt: skip
        for v, order in enumerate((1.0, 3.0, 7.0)):
            w = order * speed
            k = stiffness * (1.0 + 1j * eta) + 1j * w * relative
            b = np.arccos(1.0 - (w**2 * inertia - 1j * w * own) / (2.0 * k))
            j = np.arange(1, count + 1)
            expected = (
                -1000.0 * np.cos((np.minimum(j, m) - 0.5) * b)
                * np.cos((count - np.maximum(j, m) + 0.5) * b) / (k * np.sin(b) * np.sin(count * b))
            )  # fmt: skip
            np.testing.assert_allclose(found[:, v], expected, rtol=1e-10)


def test_it_is_where_a_motion_in_time_ends() -> None:
    """Viscous damping, no loss factor: the steady state solves the equations over time.

    Started on it, the motion stays on it for a cycle.
    """
    system = {
        "inertia": [0.02, 0.05, 1.5], "stiffness": [4e4, 9e4], "damping": [10.0, 20.0],
        "disc_damping": [1.0, 2.0, 3.0],
    }  # fmt: skip
    speed, torque = 90.0, torques(2)[:, :8]
    orders = ORDERS[:8]
    angle = solved(system, [0, 1], speed, torque)["angle"]
    stiffness, damping = np.array([4e4, 9e4]), np.array([10.0, 20.0])
    inertia, own = np.array(system["inertia"]), np.array(system["disc_damping"])

    def rate(t: float, state: Any) -> Any:
        theta, velocity = state[:3], state[3:]
        shaft = stiffness * np.diff(theta) + damping * np.diff(velocity)
        total = -own * velocity
        total[:2] += (torque * np.exp(1j * orders * speed * t)).real.sum(axis=-1) + shaft
        total[1:] -= shaft
        return np.concatenate([velocity, total / inertia])

    def steady(t: float) -> Any:
        turned = angle * np.exp(1j * orders * speed * t)
        return np.concatenate(
            [turned.real.sum(axis=-1), (1j * orders * speed * turned).real.sum(-1)]
        )

    end = 4.0 * np.pi / speed
    times = np.linspace(0.0, end, 7)
    solution = solve_ivp(rate, (0.0, end), steady(0.0), "DOP853", times, rtol=1e-11, atol=1e-15)
    scale = np.abs(angle).sum(axis=-1).max()
    for t, state in zip(times, solution.y.T, strict=True):
        np.testing.assert_allclose(state[:3], steady(t)[:3], rtol=0.0, atol=1e-8 * scale)


def test_half_ranges_of_the_diesel() -> None:
    """Of 28800 samples of another program's response; the bound on the error holds."""
    found = solved(
        DIESEL, DIESEL_NODES, DIESEL_SPEED, diesel_torques(), twist=[(8, 0)],
        wanted=("torque_extremes", "angle_extremes", "twist_extremes"),
    )  # fmt: skip
    torque = found["torque_extremes"]
    expected = [768.585, 1164.03, 4551.71, 5462.63, 6920.99, 8297.85, 8123.27, 8073.37]
    np.testing.assert_allclose(half_range(torque), expected, rtol=2e-4)
    assert (np.abs(half_range(torque) - expected) < torque[:, 2]).all()
    degrees = np.degrees(half_range(found["angle_extremes"]))
    np.testing.assert_allclose(degrees[[0, 8]], [1.54512, 0.165119], rtol=2e-4)
    twist = np.degrees(half_range(found["twist_extremes"]))
    np.testing.assert_allclose(twist, [1.7024], rtol=2e-4)


# ---- resonance and vanishing pivots


@pytest.mark.parametrize("mode", [0, 2, 7])
def test_an_undamped_resonance_is_a_status_and_no_number(mode: int) -> None:
    undamped = {"inertia": DIESEL["inertia"], "stiffness": DIESEL["stiffness"]}
    system = shaft_system(**undamped)
    omega = natural_modes(system).omega[mode]
    found = forced_response(
        system, [0.5, 2.0, 3.0], np.array([0.9, 1.0, 1.1]) * omega / 2.0, DIESEL_NODES,
        diesel_torques()[:, :3], wanted=("torque", "torque_extremes", "shaft_loss"),
    )  # fmt: skip
    assert found["status"].tolist() == [CONVERGED, NO_STEADY_STATE, CONVERGED]
    assert np.isnan(found["torque"][1, :, 1]).all()
    assert np.isfinite(found["torque"][1][:, [0, 2]]).all()
    assert np.isnan(found["torque_extremes"][1]).all()
    assert np.isfinite(found["torque_extremes"][[0, 2]]).all()


def test_without_damping_it_is_the_sum_of_the_modes() -> None:
    system = shaft_system(DIESEL["inertia"], DIESEL["stiffness"])
    modes = natural_modes(system)
    speed, torque = 150.0, torques(6)
    found = forced_response(system, ORDERS, speed, DIESEL_NODES, torque)["angle"]
    w = ORDERS * speed
    expected = np.outer(np.ones(9), torque.sum(axis=0) / (-(w**2) * sum(DIESEL["inertia"])))
    for omega, shape, inertia in zip(*modes[:3], strict=True):
        work = shape[list(DIESEL_NODES)] @ torque
        expected = expected + shape[:, None] * work / (inertia * (omega**2 - w**2))
    np.testing.assert_allclose(found, expected, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("crank", [0, 1, 2])
@pytest.mark.parametrize("on_ring", [0.0, 30.0 - 20.0j])
def test_an_absorber_at_its_own_frequency(crank: int, on_ring: complex) -> None:
    """The dense solution exchanges rows; without a torque on the ring the hub stands still."""
    stiffness, ring, speed = 2e4, 0.02, 250.0
    own = np.sqrt(stiffness / ring)
    shafts: Any = [(0, 1), (0, 2)]
    system = shaft_system([0.5, ring, 3.0], [stiffness, 9e4], shafts, crank=crank)
    torque = np.array([100.0, on_ring])
    found = forced_response(system, [own / speed], speed, [0, 1], torque[:, None])
    angle, shaft = dense(own, [*torque, 0.0], [0.5, ring, 3.0], [stiffness, 9e4], shafts)
    assert found["status"] == CONVERGED
    np.testing.assert_allclose(found["angle"][:, 0], angle, atol=1e-12 * abs(angle[1]))
    np.testing.assert_allclose(found["torque"][:, 0], shaft, atol=1e-11 * abs(shaft[0]))
    if not on_ring:
        expected = [0.0, -100.0 / stiffness, 0.0]
        np.testing.assert_allclose(found["angle"][:, 0], expected, atol=2e-12 * 100.0 / stiffness)


def test_two_equal_absorbers_resonate_against_each_other_only_if_driven() -> None:
    """They share the torque; a torque on one of them alone leaves no steady state."""
    system = shaft_system([0.5, 0.02, 0.02], [2e4, 2e4], [(0, 1), (0, 2)])
    speed = np.sqrt(2e4 / 0.02)
    found = forced_response(system, [1.0], speed, [0], np.full((1, 1), 100.0))
    assert found["status"] == CONVERGED
    np.testing.assert_allclose(found["torque"][:, 0], [-50.0, -50.0], rtol=1e-9)
    driven = forced_response(system, [1.0], speed, [1], np.full((1, 1), 100.0))
    assert driven["status"] == NO_STEADY_STATE
    assert np.isnan(driven["torque"]).all()


@pytest.mark.parametrize("speed", [80.0, 240.0])
def test_a_pendulum_holds_its_carrier_at_its_order(speed: float) -> None:
    """At any speed; at other orders its inertia is m (R + r)^2/(1 - nu^2/n^2)."""
    mass, distance, length = 0.4, 0.09, 0.01
    made = pendulum(mass, distance, length)
    system = shaft_system(
        [0.5, 3.0, made.inertia], [9e4, 0.0], [(0, 1), (0, 2)],
        speed_stiffness=[0.0, made.speed_stiffness],
    )  # fmt: skip
    orders = np.array([1.0, 2.5, 3.0, 6.0])
    found = forced_response(system, orders, speed, [0], np.full((1, 4), 100.0))
    assert found["status"] == CONVERGED
    for v in (0, 1, 3):
        effective = mass * (distance + length) ** 2 / (1.0 - orders[v] ** 2 * length / distance)
        angle, _ = dense(orders[v] * speed, [100.0, 0.0], [0.5 + effective, 3.0], [9e4])
        np.testing.assert_allclose(found["angle"][:2, v], angle, rtol=1e-10)
    assert abs(found["angle"][0, 2]) < 2e-12 * 100.0 / (made.speed_stiffness * speed**2)
    # On the carrier at rest, the centrifugal force m (R + r) Omega^2 has the lever R psi.
    swing = made.swing * (found["angle"][2, 2] - found["angle"][0, 2])
    pull = mass * distance * (distance + length) * speed**2 * swing
    assert pull.real == pytest.approx(-100.0, rel=1e-8)


def test_the_pendulum_moves_as_its_nonlinear_equations_do_at_small_swings() -> None:
    """Lagrange's equations of carrier and point mass, integrated in time on the computed motion."""
    mass, distance, length, carrier, own, speed, order = 0.4, 0.09, 0.011, 0.05, 3.0, 60.0, 2.0
    made = pendulum(mass, distance, length)
    amplitude = 1e-3
    system = shaft_system(
        [carrier, made.inertia],
        [0.0],
        speed_stiffness=[made.speed_stiffness],
        disc_damping=[own, 0],
    )
    angle = forced_response(
        system, [order], speed, [0], np.full((1, 1), amplitude), wanted=("angle",)
    )["angle"][:, 0]
    swing = made.swing * (angle[1] - angle[0])

    def rate(t: float, state: Any) -> Any:
        _, psi, theta_rate, psi_rate = state
        spin = speed + theta_rate
        cross = mass * distance * length
        inner = mass * length**2
        matrix = np.array([
            [carrier + mass * distance**2 + inner + 2 * cross * np.cos(psi),
             inner + cross * np.cos(psi)],
            [inner + cross * np.cos(psi), inner],
        ])  # fmt: skip
        force = np.array([
            amplitude * np.cos(order * speed * t) - own * theta_rate
            + cross * np.sin(psi) * (2.0 * spin * psi_rate + psi_rate**2),
            -cross * np.sin(psi) * spin**2,
        ])  # fmt: skip
        return np.concatenate([state[2:], np.linalg.solve(matrix, force)])

    w = order * speed
    start = [angle[0].real, swing.real, (1j * w * angle[0]).real, (1j * w * swing).real]
    end = 2.0 * np.pi / speed
    solution = solve_ivp(
        rate, (0.0, end), start, "DOP853", [0.3 * end, end], rtol=1e-11, atol=1e-18
    )
    for t, state in zip(solution.t, solution.y.T, strict=True):
        turned = np.exp(1j * w * t)
        assert state[0] == pytest.approx((angle[0] * turned).real, abs=1e-5 * abs(angle[0]))
        assert state[1] == pytest.approx((swing * turned).real, abs=1e-5 * abs(swing))


# ---- dampers


@pytest.mark.compiled
@pytest.mark.parametrize("mu", [0.05, 0.3, 1.0])
def test_the_optimum_viscous_damper(mu: float) -> None:
    """Den Hartog: the peak is 1 + 2/mu at omega_m sqrt(2/(2 + mu)), and no damping has less."""
    inertia, omega = 2.0, 300.0
    best = published.optimum_viscous(mu * inertia, inertia, omega)
    assert best.magnifier == 1.0 + 2.0 / mu

    def peak(damping: float) -> tuple[float, float]:
        system = shaft_system(
            [inertia, mu * inertia], [0.0], damping=[damping],
            ground_stiffness=[inertia * omega**2, 0.0],
        )  # fmt: skip
        w = np.linspace(0.6, 1.1, 50001) * omega
        angle = forced_response(system, [1.0], w, [0], np.full((1, 1), inertia * omega**2))["angle"]
        size = np.abs(angle[:, 0, 0])
        return float(size.max()), float(w[size.argmax()] / omega)

    at_best = peak(best.damping)
    assert at_best[0] == pytest.approx(1.0 + 2.0 / mu, rel=1e-8)
    assert at_best[1] == pytest.approx(np.sqrt(2.0 / (2.0 + mu)), abs=2e-5)
    assert peak(0.97 * best.damping)[0] > at_best[0] < peak(1.03 * best.damping)[0]


@pytest.mark.compiled
@pytest.mark.parametrize(("mu", "true_peak"), [(0.05, 6.40844), (0.3, 2.78221), (1.0, 1.75439)])
def test_the_optimum_tuned_damper(mu: float, true_peak: float) -> None:
    """Den Hartog's fixed points, sqrt(1 + 2/mu); the peak by an independent search."""
    inertia, omega = 2.0, 300.0
    best = published.optimum_tuned(mu * inertia, inertia, omega)
    w = np.linspace(0.3, 1.6, 20001) * omega

    def size(damping: float) -> Any:
        system = shaft_system(
            [inertia, mu * inertia], [best.stiffness], damping=[damping],
            ground_stiffness=[inertia * omega**2, 0.0],
        )  # fmt: skip
        force = np.full((1, 1), inertia * omega**2)
        return np.abs(forced_response(system, [1.0], w, [0], force)["angle"][:, 0, 0])

    assert size(best.damping).max() == pytest.approx(true_peak, rel=1e-5)
    # Curves of any damping cross at the fixed points, and are equally high there.
    crossing = np.flatnonzero(np.diff(np.sign(size(best.damping) - size(2.0 * best.damping))))
    heights = size(best.damping)[crossing]
    np.testing.assert_allclose(heights, best.magnifier, rtol=2e-3)
    assert heights.size == 2


RINGS = {
    "none": {}, "viscous": {"ring": 0.0722, "stiffness": 0.0, "damping": 71.757199},
    "rubber": {"ring": 0.030, "stiffness": 38089.375731, "loss_factor": 0.2},
}  # fmt: skip


@pytest.mark.parametrize(
    ("damper", "frequency", "pulley", "flywheel", "twist", "torque", "heat"),
    [
        ("none", 216.5836, 1.21706071, 0.0997697315, 0.0, 6691.21747, 0.0),
        ("viscous", 50.0, 0.0790883293, 0.151991999, 0.0238371244, 543.270273, 0.612911387),
        ("viscous", 200.0, 0.258117277, 0.0231996872, 0.202451853, 1326.77514, 707.381108),
        ("rubber", 160.0, 0.205653282, 0.0288671994, 0.573024408, 1056.57376, 383.005211),
        ("rubber", 245.0, 0.409746763, 0.0314019167, 0.860049838, 2694.90544, 1321.14894),
    ],
)
def test_rings_on_the_diesel(
    damper: str, frequency: float, pulley: float, flywheel: float, twist: float, torque: float,
    heat: float,
) -> None:  # fmt: skip
    """100 N m in phase on all throws; values [degree, N m, W] of an independent program."""
    ring = dict(RINGS[damper])
    system = dict(DIESEL)
    if ring:
        system = {
            "inertia": [*DIESEL["inertia"], ring["ring"]],
            "stiffness": [*DIESEL["stiffness"], ring["stiffness"]],
            "shafts": [*((i, i + 1) for i in range(8)), (0, 9)],
            "loss_factor": [*[0.035] * 8, ring.get("loss_factor", 0.0)],
            "damping": [*[0.0] * 8, ring.get("damping", 0.0)],
            "disc_damping": [*DIESEL["disc_damping"], 0.0],
        }
    found = forced_response(
        shaft_system(**system), [1.0], 2.0 * np.pi * frequency, DIESEL_NODES,
        np.full((6, 1), 100.0), wanted=("angle", "torque", "shaft_loss"),
    )  # fmt: skip
    angle = found["angle"][:, 0]
    np.testing.assert_allclose(np.degrees(np.abs(angle[[0, 8]])), [pulley, flywheel], rtol=1e-8)
    assert abs(found["torque"][7, 0]) == pytest.approx(torque, rel=1e-8)
    if ring:
        assert np.degrees(abs(angle[9] - angle[0])) == pytest.approx(twist, rel=1e-8)
        assert found["shaft_loss"][8] == pytest.approx(heat, rel=1e-8)


def test_loss_of_a_viscous_damper_on_a_driven_hub() -> None:
    """pi c w a^2/(1 + (c/(J_d w))^2) a cycle, most at c = J_d w: Andre and Spurk (1982)."""
    ring, w, amplitude = 0.1, 400.0, 0.01
    for damping in (0.5 * ring * w, ring * w, 2.0 * ring * w):
        system = shaft_system([1e9, ring], [0.0], damping=[damping])
        force = np.full((1, 1), -amplitude * 1e9 * w**2)
        found = forced_response(system, [1.0], w, [0], force, wanted=("angle", "shaft_loss"))
        assert abs(found["angle"][0, 0]) == pytest.approx(amplitude, rel=1e-8)
        expected = np.pi * damping * w * amplitude**2 / (1.0 + (damping / (ring * w)) ** 2)
        assert found["shaft_loss"][0] * 2.0 * np.pi / w == pytest.approx(expected, rel=1e-8)


# ---- what is refused, and the largest order


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"wanted": ("angles",)}, "wanted: 'angles': must be of angle, torque"),
        ({"speed": [100.0, 0.0]}, "speed: 0: must be above 0"),
        ({"orders": [0.0, 1.0]}, "orders: 0: must be above 0"),
        ({"throws": [0, 2]}, "throws: 2: must be a disc, from 0 to 1"),
        ({"twist": [(0, 5)]}, "twist: 5: must be a disc"),
        ({"torque": np.ones((3, 2))}, "torque: shape (3, 2): must end with 2 throws and 2 orders"),
        (
            {"orders": [0.5, 0.7], "wanted": ("angle_extremes",)},
            "orders: 0.7: must have whole periods in the cycle",
        ),
    ],
)
def test_what_does_not_fit_is_refused(changed: dict[str, Any], message: str) -> None:
    given = {
        "orders": [0.5, 1.0], "speed": 100.0, "throws": [0, 1], "torque": np.ones((2, 2)), **changed
    }  # fmt: skip
    with pytest.raises(ValueError) as error:
        forced_response(shaft_system([1.0, 1.0], 1.0), **given)
    assert message in str(error.value)


def test_speeds_are_the_derivative_of_the_angle_over_the_cycle() -> None:
    """Behind a gear too; extremes of 28800 samples."""
    found = forced_response(
        shaft_system(**BRANCHED), ORDERS, 190.0, (0, 1, 2), torques(3),
        wanted=("angle", "speed_extremes", "twist_extremes"), speed_of=(3, 4, 6), twist=[(0, 3)],
    )  # fmt: skip
    phi = np.arange(28800) * (4.0 * np.pi / 28800)
    waves = 1j * ORDERS[:, None] * np.exp(1j * ORDERS[:, None] * phi)
    for line, disc in enumerate((3, 4, 6)):
        curve = (found["angle"][disc] @ waves).real
        least, most, bound = found["speed_extremes"][line]
        np.testing.assert_allclose([least, most], [curve.min(), curve.max()], rtol=2e-3)
        assert abs(most - curve.max()) <= bound and abs(least - curve.min()) <= bound
