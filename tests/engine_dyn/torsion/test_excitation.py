"""Torques on discs besides the engine's: in step with it, drifting, over the speed, of modes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import eigh

from engine_dyn.loads.torque_curves import torque_of_harmonics
from engine_dyn.status import CONVERGED, NO_STEADY_STATE
from engine_dyn.torsion.excitation import Excitation, add_drifting
from engine_dyn.torsion.forced import forced_response
from engine_dyn.torsion.modes import damped_modes, modal_damping, natural_modes
from engine_dyn.torsion.system import ShaftSystem, shaft_system
from tests.support.shafts import dense

ORDERS = np.arange(0.5, 12.25, 0.5)
CYCLE = 4.0 * math.pi
GEARED = {
    "inertia": [0.05, 1.5, 0.1, 0.2, 6.0], "stiffness": [8e5, 4e4, 1e5],
    "shafts": [(0, 1), (1, 2), (3, 4)], "loss_factor": [0.02, 0.1, 0.01],
    "disc_damping": [1.0, 0.0, 0.0, 0.0, 20.0], "meshes": [(2, 3)], "ratios": [-0.4],
}  # fmt: skip
"""Throw, flywheel, pinion; behind the gear a wheel and a propeller."""


def blades(order: float = 4.0, psi: float = 0.3, **more: float) -> Excitation:
    amplitude = 300.0
    sine, cosine = -amplitude * math.sin(psi), amplitude * math.cos(psi)
    torque = torque_of_harmonics(-2000.0, {order: (sine, cosine)})
    return Excitation("blades", 4, (torque,), **more)


def test_its_order_at_the_crank_is_that_of_its_disc_times_the_ratio() -> None:
    found = blades(5.0, 0.3, phase=0.2).harmonics(ORDERS, 50.0, -0.4)
    want = np.zeros(ORDERS.size, dtype=complex)
    want[ORDERS == 2.0] = 300.0 * np.exp(1j * (0.3 + 5.0 * 0.2))
    assert np.abs(found - want).max() < 1e-7
    both = torque_of_harmonics(0.0, {0.5: (0.0, 3.0), 40: (0.0, 2.0)})
    found = Excitation("both", 4, (both,)).harmonics(ORDERS, 50.0, 1.0)  # 40 is beyond the orders
    assert np.abs(found - np.where(ORDERS == 0.5, 3.0, 0.0)).max() < 1e-7
    assert blades(5.0).in_step(-0.4, CYCLE) and not blades(4.0).in_step(-0.4, CYCLE)
    assert np.array_equal(blades(4.0).in_step(np.array([0.5, 0.37]), CYCLE), [True, False])


def test_in_step_it_is_the_dense_solution() -> None:
    speed, five = 60.0, blades(5.0)
    harmonics = -1.0 * five.harmonics(ORDERS, speed, -0.4)  # the disc turns the other way
    found = forced_response(shaft_system(**GEARED), ORDERS, speed, [4], harmonics[None, :])
    for v, order in enumerate(ORDERS):
        forces = np.zeros(5, dtype=complex)
        forces[4] = harmonics[v]
        angle, torque = dense(order * speed, forces, **GEARED)
        for mine, other in ((found["angle"], angle), (found["torque"], torque)):
            assert np.abs(mine[:, v] - other).max() <= 1e-12 * np.abs(other).max()


def test_what_drifts_meets_the_extremes_of_all_else() -> None:
    """A signal of both, over many beats of any two orders, comes near to the sum."""
    speed, ratio = 60.0, -0.4 * math.sqrt(0.9)
    geared = {**GEARED, "ratios": [ratio]}
    system = shaft_system(**geared)
    engine = np.zeros((1, ORDERS.size), dtype=complex)
    engine[0, :4] = [200.0, 100.0j, 50.0, 300.0]
    wanted = ("torque", "torque_extremes", "shaft_loss", "speed_extremes")
    alone = forced_response(
        system, ORDERS, speed, [0], engine, wanted=wanted, speed_of=(1,), period=CYCLE
    )
    both = add_drifting(alone, system, blades(), 1.5, speed, ratio, speed_of=(1,))
    order = 4.0 * abs(ratio)
    forces = np.zeros(5, dtype=complex)
    forces[4] = -1.5 * 300.0 * np.exp(0.3j)
    _, torque = dense(order * speed, forces, **geared)
    phi = np.linspace(0.0, 3000.0 * CYCLE, 3_000_000)
    for shaft in range(3):
        curve = np.real(torque[shaft] * np.exp(1j * order * phi))
        for v in range(4):
            curve += np.real(alone["torque"][shaft, v] * np.exp(1j * ORDERS[v] * phi))
        low, high, _ = both["torque_extremes"][shaft]
        assert 0.995 * high < curve.max() < 1.001 * high
        assert 1.001 * low < curve.min() < 0.995 * low
    assert (both["shaft_loss"] > alone["shaft_loss"]).all()


def test_extremes_of_speed_are_over_that_of_the_crank() -> None:
    """The same torque, once as an order of the crank and once as one of the disc's own turns."""
    system, speed, ratio = shaft_system(**GEARED), 60.0, -0.4
    none = np.zeros((1, ORDERS.size), dtype=complex)
    nothing = forced_response(
        system, ORDERS, speed, [0], none, wanted=("speed_extremes", "shaft_loss"), speed_of=(1,),
        period=CYCLE,
    )  # fmt: skip
    harmonics = -blades(5.0).harmonics(ORDERS, speed, ratio)[None, :]
    in_step = forced_response(
        system, ORDERS, speed, [4], harmonics, wanted=("speed_extremes", "shaft_loss"),
        speed_of=(1,), period=CYCLE,
    )  # fmt: skip
    drifting = add_drifting(nothing, system, blades(5.0), 1.0, speed, ratio, speed_of=(1,))
    extremes = (found["speed_extremes"][0, :2] for found in (drifting, in_step))
    assert np.allclose(*extremes, rtol=1e-6)
    assert np.allclose(drifting["shaft_loss"], in_step["shaft_loss"], rtol=1e-7)


def test_power_and_table_over_the_speed() -> None:
    squared = blades(4.0, 0.0, power=2.0, reference_speed=10.0)
    assert np.allclose(squared.mean([10.0, 20.0]), [-2000.0, -8000.0])
    assert np.allclose(squared.own_harmonics(20.0), 1200.0)
    two = tuple(torque_of_harmonics(mean, {4: (0.0, mean)}) for mean in (100.0, 300.0))
    table = Excitation("table", 4, two, np.array([10.0, 20.0]))
    assert np.allclose(table.mean([10.0, 15.0, 20.0]), [100.0, 200.0, 300.0])
    assert np.isnan(table.mean([9.0, 21.0])).all()
    at = table.harmonics(ORDERS, np.array([15.0, 20.0]), 0.5)
    assert np.allclose(at[:, ORDERS == 2.0].T, [[200.0, 300.0]])
    assert np.allclose(at[:, ORDERS != 2.0], 0.0)


# --- damping of modes -----------------------------------------------------------------------------

INERTIA, STIFFNESS = [1.0, 2.0, 0.5, 3.0], [1e4, 2e4, 5e3]


def modal(ratios: list[float], **more: object) -> ShaftSystem:
    return shaft_system(INERTIA, STIFFNESS, modal_damping=ratios, **more)


def of_modes(ratios: list[float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Inertia, stiffness and damping of all discs: C = J V diag(2 zeta omega) V^T J."""
    stiffness = np.zeros((4, 4))
    for i, k in enumerate(STIFFNESS):
        stiffness[i : i + 2, i : i + 2] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    inertia = np.diag(INERTIA)
    squares, vectors = eigh(stiffness, inertia)
    every = [0.0, *ratios, *[ratios[-1]] * 3][:4]
    rates = 2.0 * np.array(every) * np.sqrt(np.maximum(squares, 0.0))
    return inertia, stiffness, inertia @ vectors @ np.diag(rates) @ vectors.T @ inertia


@pytest.mark.parametrize("ratios", [[0.02, 0.05], [0.3], [0.0, 0.01, 0.02]])
def test_damping_of_modes_is_a_matrix_between_all_discs(ratios: list[float]) -> None:
    inertia, stiffness, damping = of_modes(ratios)
    damping = damping + np.diag([0.0, 3.0, 0.0, 0.0])
    orders, speed = np.array([0.5, 1.0, 2.5, 3.0]), 40.0
    torque = np.random.default_rng(1).normal(size=(2, 4)) + 1j
    system = modal(ratios, loss_factor=0.01, disc_damping=[0.0, 3.0, 0.0, 0.0])
    found = forced_response(system, orders, speed, [0, 2], torque)
    for v, w in enumerate(orders * speed):
        forces = np.zeros(4, dtype=complex)
        forces[[0, 2]] = torque[:, v]
        matrix = stiffness * (1.0 + 0.01j) + 1j * w * damping - w**2 * inertia
        angle = np.linalg.solve(matrix, forces)
        assert np.abs(found["angle"][:, v] - angle).max() < 1e-12 * np.abs(angle).max()


def test_at_resonance_the_magnifier_is_that_of_the_mode() -> None:
    """theta = |W|/(2 zeta omega^2 J_m) of one mode, which others hardly reach."""
    zeta = 1e-4
    system = modal([zeta])
    modes = natural_modes(system)
    assert np.allclose(modal_damping(system, modes), zeta, rtol=1e-12)
    assert np.allclose(damped_modes(system).ratio, zeta, rtol=1e-8)
    omega, shape = modes.omega[0], modes.shape[0]
    found = forced_response(system, [1.0], omega, [0], np.array([[5.0]]))
    want = 5.0 * abs(shape[0]) / (2.0 * zeta * omega**2 * modes.modal_inertia[0])
    assert abs(found["angle"][:, 0]).max() == pytest.approx(want, rel=1e-3)


def test_an_undamped_mode_beside_damped_ones_has_no_steady_state() -> None:
    system = modal([0.0, 0.1])
    omega = natural_modes(system).omega
    found = forced_response(system, [1.0], omega[:2], [0], np.ones((2, 1, 1)))
    assert found["status"].tolist() == [NO_STEADY_STATE, CONVERGED]
    assert np.isnan(found["angle"][0]).all() and np.isfinite(found["angle"][1]).all()


def test_designs_have_their_own_damping_of_modes() -> None:
    ratios = [[0.02, 0.05], [0.3, 0.3]]
    both = forced_response(
        shaft_system(INERTIA, STIFFNESS, modal_damping=ratios), ORDERS, 40.0, [0],
        np.ones((1, ORDERS.size)), wanted=("torque_extremes", "frame_loss"),
    )  # fmt: skip
    for place, each in enumerate(ratios):
        one = forced_response(
            modal(each), ORDERS, 40.0, [0], np.ones((1, ORDERS.size)),
            wanted=("torque_extremes", "frame_loss"),
        )  # fmt: skip
        assert np.array_equal(both["torque_extremes"][place], one["torque_extremes"])


@pytest.mark.parametrize("bad", [[-0.1], [math.nan], [0.1, math.inf]])
def test_damping_of_modes_below_0_is_refused(bad: list[float]) -> None:
    with pytest.raises(ValueError, match="modal_damping"):
        modal(bad)
