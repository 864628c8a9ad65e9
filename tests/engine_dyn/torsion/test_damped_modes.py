"""Damped modes: closed forms, printed eigenvalues, the peak of the response, rigid shafts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine_dyn.torsion.forced import forced_response
from engine_dyn.torsion.modes import (
    critical_speeds,
    damped_critical_speeds,
    damped_modes,
    natural_modes,
)
from engine_dyn.torsion.shaft import pendulum
from engine_dyn.torsion.system import matrices, shaft_system
from tests.support.shafts import DIESEL, DIESEL_NODES

RINGED: dict[str, Any] = {
    "inertia": [*DIESEL["inertia"], 0.1],
    "stiffness": [*DIESEL["stiffness"], 0.0],
    "shafts": [*((i, i + 1) for i in range(8)), (0, 9)],
    "loss_factor": [*[0.035] * 8, 0.0],
    "damping": [*[0.0] * 8, 90.0],
    "disc_damping": [*DIESEL["disc_damping"], 0.0],
}
"""The measured diesel with a ring of 0.1 kg m2 in oil on its pulley."""


@pytest.mark.parametrize("ratio", [0.0, 0.1, 0.6, 0.9])
def test_one_disc_on_a_spring_in_oil(ratio: float) -> None:
    """s^2 J + s c + k = 0: |s|^2 = k/J, and c = 2 zeta (k J)^(1/2)."""
    made = shaft_system([0.5], [], ground_stiffness=2e3, disc_damping=2.0 * ratio * 1e3**0.5)
    found = damped_modes(made)
    assert found.omega[0] == pytest.approx(4000.0**0.5, rel=1e-12)
    assert found.ratio[0] == pytest.approx(ratio, abs=1e-12)
    assert found.swing[0] == pytest.approx((4000.0 * (1.0 - ratio**2)) ** 0.5, rel=1e-12)


@pytest.mark.parametrize("factor", [0.05, 0.5, 2.0])
def test_two_discs_on_rubber(factor: float) -> None:
    """s^2 = -omega^2 (1 + i eta): |s| = omega (1 + eta^2)^(1/4), zeta = sin(atan(eta)/2)."""
    made = shaft_system([0.5, 1.5], [3e3], loss_factor=factor)
    found = damped_modes(made)
    omega = natural_modes(made).omega[0]
    assert found.omega[0] == pytest.approx(omega * (1.0 + factor**2) ** 0.25, rel=1e-12)
    assert found.ratio[0] == pytest.approx(np.sin(0.5 * np.arctan(factor)), rel=1e-12)


def test_what_is_overdamped_does_not_swing() -> None:
    made = shaft_system([0.5, 1.0], [2e3], damping=[1e4])
    assert np.isnan(damped_modes(made).omega).all()
    # A load that damps the whole shaft takes no mode from it.
    loaded = shaft_system([0.5, 1.0, 3.0], [2e3, 5e3], disc_damping=[0.0, 0.0, 1.0])
    assert np.isfinite(damped_modes(loaded).omega).tolist() == [True, True]


def test_the_printed_eigenvalues_of_a_geared_system() -> None:
    """openTorsion prints the state matrix: -5.8726 +- 67.0518 i, -0.7809 +- 27.8630 i."""
    made = shaft_system(
        [1.0, 0.1, 0.1, 1.0], [400.0, 800.0], [(0, 1), (2, 3)], meshes=[(1, 2)], ratios=-1.0 / 6.0,
        damping=[1.0, 0.5], disc_damping=[0.5, 0.1, 0.1, 1.0],
    )  # fmt: skip
    found = damped_modes(made)
    np.testing.assert_allclose(found.swing, [27.863017, 67.051798], rtol=1e-7)
    np.testing.assert_allclose(found.ratio * found.omega, [0.7809345, 5.8726244], rtol=1e-6)


def test_a_damper_moves_the_mode_to_where_the_response_peaks() -> None:
    """188.7 Hz and 0.210, not 216.6 Hz and 0.259: eigenvalues of the state matrix of 20 numbers."""
    made = shaft_system(**RINGED)
    found = damped_modes(made)
    assert found.omega[0] / (2.0 * np.pi) == pytest.approx(188.69112, rel=1e-7)
    assert found.ratio[0] == pytest.approx(0.2098999, rel=1e-6)
    inertia, stiffness, loss, damping = matrices(made)
    zero, one = np.zeros((10, 10)), np.eye(10)
    state = np.block(
        [[zero, one], [-(stiffness + 1j * loss) / inertia[:, None], -damping / inertia[:, None]]]
    )
    roots = np.linalg.eigvals(state)
    # The shaft turns freely: two of the roots are 0 but for rounding, in whatever direction.
    roots = roots[(roots.imag > 0.1 * np.abs(roots)) & (np.abs(roots) > 1.0)]
    np.testing.assert_allclose(found.omega, np.sort(np.abs(roots)), rtol=1e-9)
    speed = 2.0 * np.pi * np.linspace(150.0, 230.0, 801)
    angle = forced_response(made, [1.0], speed, DIESEL_NODES, np.ones((6, 1)))["angle"]
    peak = speed[np.abs(angle[:, 0, 0]).argmax()]
    undamped = natural_modes(made).omega[0]
    assert abs(peak - found.omega[0]) < 0.25 * abs(peak - undamped)


def test_random_systems_are_their_state_matrix_and_rigid_shafts_join() -> None:
    random = np.random.default_rng(4)
    for _ in range(40):
        inertia, stiffness = random.uniform(0.1, 2.0, 4), random.uniform(1e3, 1e4, 3)
        more = {
            "loss_factor": random.uniform(0.0, 0.3, 3), "damping": random.uniform(0.0, 5.0, 3),
            "disc_damping": random.uniform(0.0, 2.0, 4),
        }  # fmt: skip
        made = shaft_system(inertia, stiffness, **more)
        j, k, h, c = matrices(made)
        state = np.block([[np.zeros((4, 4)), np.eye(4)],
                          [-(k + 1j * h) / j[:, None], -c / j[:, None]]])  # fmt: skip
        roots = np.linalg.eigvals(state)
        roots = roots[(roots.imag > 0.1 * np.abs(roots)) & (np.abs(roots) > 1.0)]
        found = damped_modes(made)
        np.testing.assert_allclose(found.omega[np.isfinite(found.omega)], np.sort(np.abs(roots)),
                                   rtol=1e-8)  # fmt: skip
        split = {key: np.append(value, 0.1) for key, value in more.items()}
        apart = damped_modes(
            shaft_system([*inertia[:3], 0.7 * inertia[3], 0.3 * inertia[3]], [*stiffness, 1e20],
                         **split)
        )  # fmt: skip
        split["disc_damping"] = np.append(more["disc_damping"][:3], 0.0)
        whole = [*more["disc_damping"][:3], more["disc_damping"][3] + 0.1]
        joined = damped_modes(shaft_system(inertia, stiffness, **{**more, "disc_damping": whole}))
        np.testing.assert_allclose(apart.omega[:3], joined.omega, rtol=1e-7)
        np.testing.assert_allclose(apart.ratio[:3], joined.ratio, rtol=1e-7)


@pytest.mark.parametrize("ring", [0.0, 3.0])
def test_critical_speeds_with_a_pendulum(ring: float) -> None:
    """At each, the modes of the shaft stiffened for that speed have one there; damping is small."""
    one = pendulum(0.4, 0.09, 0.01)
    made = shaft_system(
        [0.5, 0.2, 4.0, one.inertia], [3e4, 2e4, 0.0], [(0, 1), (1, 2), (1, 3)],
        speed_stiffness=[0.0, 0.0, one.speed_stiffness], damping=[ring, 0.0, 0.0],
    )  # fmt: skip
    orders = [0.5, 2.0, 3.0, 4.5]
    found, plain = damped_critical_speeds(made, orders), critical_speeds(made, orders)
    for order, speeds, undamped in zip(orders, found, plain, strict=True):
        known = speeds[np.isfinite(undamped)]
        if not ring:
            np.testing.assert_allclose(known, undamped[np.isfinite(undamped)], rtol=1e-6)
        for speed in known:
            omega = damped_modes(made, speed).omega
            assert np.abs(omega / (order * speed) - 1.0).min() < (2e-3 if ring else 1e-6)
